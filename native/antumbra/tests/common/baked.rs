//! What a bake holds, and what every bake must obey.

use std::collections::HashMap;
use std::f64::consts::PI;

use antumbra::scene::{ObjectInput, SceneInput};
use antumbra::weld::{Bake, BakedMesh};
use glam::DVec3;

/// Every corner: its vertex in object space, and its radiosity or irradiance, W/m².
pub(crate) fn corners(mesh: &BakedMesh) -> impl Iterator<Item = (DVec3, DVec3)> {
    (mesh.triangles.iter().zip(&mesh.corner_radiance)).flat_map(|(triangle, colours)| {
        (0..3).map(|k| (mesh.positions[triangle[k] as usize], light(colours[k])))
    })
}

/// The light of all corners of all meshes, W/m².
pub(crate) fn all_light(bake: &Bake) -> impl Iterator<Item = DVec3> {
    bake.meshes.iter().flat_map(corners).map(|(_, light)| light)
}

/// Radiosity or irradiance from what the colour attribute holds, W/m².
pub(crate) fn light(colour: [f32; 3]) -> DVec3 {
    DVec3::from_array(colour.map(f64::from)) * PI
}

/// The green light at a point of a horizontal mesh, linear over its triangle, W/m².
pub(crate) fn light_over(mesh: &BakedMesh, x: f64, y: f64) -> f64 {
    for (triangle, colours) in mesh.triangles.iter().zip(&mesh.corner_radiance) {
        let [a, b, c] = triangle.map(|v| mesh.positions[v as usize].truncate());
        let p = glam::DVec2::new(x, y);
        let whole = (b - a).perp_dot(c - a);
        let weights = [(c - b).perp_dot(p - b), (a - c).perp_dot(p - c), (b - a).perp_dot(p - a)]
            .map(|part| part / whole);
        if weights.iter().all(|&w| w >= -1e-12) {
            return (0..3).map(|k| weights[k] * light(colours[k]).y).sum();
        }
    }
    panic!("no triangle holds ({x}, {y})");
}

/// The light at a point of a mesh whose object is not moved, linear over its triangle, W/m²; none where the mesh is not.
pub(crate) fn light_at(mesh: &BakedMesh, at: DVec3) -> Option<DVec3> {
    (mesh.triangles.iter().zip(&mesh.corner_radiance)).find_map(|(triangle, colours)| {
        let [a, b, c] = triangle.map(|v| mesh.positions[v as usize]);
        let normal = (b - a).cross(c - a);
        let weights = [(c - b).cross(at - b), (a - c).cross(at - c), (b - a).cross(at - a)]
            .map(|part| part.dot(normal) / normal.length_squared());
        let off = normal.normalize().dot(at - a).abs();
        let inside = off < 1e-9 && weights.iter().all(|&weight| weight >= -1e-12);
        inside.then(|| (0..3).map(|k| weights[k] * light(colours[k])).sum())
    })
}

pub(crate) fn area(corners: [DVec3; 3]) -> f64 {
    let [a, b, c] = corners;
    0.5 * (b - a).cross(c - a).length()
}

/// Checks all that any bake of any scene promises.
pub(crate) fn assert_sound(input: &SceneInput, bake: &Bake) {
    for mesh in &bake.meshes {
        let source = &input.objects[mesh.object];
        assert!(source.receives, "“{}” was baked", source.name);
        assert_arrays_fit(mesh);
        assert_parts_of_source(source, mesh);
        assert_source_edges(source, mesh);
        assert_borders_are_source_borders(source, mesh);
        for light in corners(mesh).map(|(_, light)| light) {
            assert!(light.is_finite() && light.min_element() >= 0.0, "“{}”: {light}", source.name);
        }
    }
    let sum = |count: fn(&BakedMesh) -> usize| bake.meshes.iter().map(count).sum::<usize>();
    assert_eq!(bake.report.result.triangles, sum(|mesh| mesh.triangles.len()));
    assert_eq!(bake.report.result.vertices, sum(|mesh| mesh.positions.len()));
}

fn assert_arrays_fit(mesh: &BakedMesh) {
    let (triangles, vertices) = (mesh.triangles.len(), mesh.positions.len());
    assert_eq!(mesh.source_triangle.len(), triangles);
    assert_eq!(mesh.corner_barycentric.len(), triangles);
    assert_eq!(mesh.source_edge.len(), triangles);
    assert_eq!(mesh.corner_radiance.len(), triangles);
    assert_eq!(mesh.vertex_source_triangle.len(), vertices);
    assert_eq!(mesh.vertex_barycentric.len(), vertices);
    let mut used = vec![false; vertices];
    mesh.triangles.as_flattened().iter().for_each(|&v| used[v as usize] = true);
    assert!(used.iter().all(|&used| used), "a vertex without a triangle");
}

/// Barycentrics reproduce positions, areas of parts sum to the whole, and source vertices keep their coordinates.
fn assert_parts_of_source(source: &ObjectInput, mesh: &BakedMesh) {
    let source_corners = |t: u32| source.triangles[t as usize].map(|v| source.positions[v as usize]);
    let size = source.positions.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
    let at = |t: u32, [u, v, w]: [f64; 3]| {
        let [a, b, c] = source_corners(t);
        assert!(u >= 0.0 && v >= 0.0 && w >= 0.0 && (u + v + w - 1.0).abs() < 1e-12);
        u * a + v * b + w * c
    };
    for (vertex, &position) in mesh.positions.iter().enumerate() {
        let barycentric = mesh.vertex_barycentric[vertex];
        let expected = at(mesh.vertex_source_triangle[vertex], barycentric);
        assert!(position.distance(expected) <= 1e-12 * size, "vertex {vertex} is not where it says");
        if barycentric.contains(&1.0) {
            assert!(source.positions.contains(&position), "a source vertex moved");
        }
    }
    let mut areas = vec![0.0; source.triangles.len()];
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        let of = mesh.source_triangle[t];
        let positions = triangle.map(|v| mesh.positions[v as usize]);
        for (k, (position, &barycentric)) in positions.iter().zip(&mesh.corner_barycentric[t]).enumerate() {
            let expected = at(of, barycentric);
            assert!(position.distance(expected) <= 1e-12 * size, "corner {k} of {t} is not where it says");
        }
        areas[of as usize] += area(positions);
        let normal = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a);
        let parallel = normal(positions).dot(normal(source_corners(of)));
        assert!(parallel >= 0.0, "triangle {t} is wound backwards");
    }
    for (t, &sum) in areas.iter().enumerate() {
        let [a, b, c] = source_corners(t as u32);
        let whole = area([a, b, c]);
        // Rounding of positions moves the border of a sliver by much of its width.
        let rounding = 4.0 * f64::EPSILON * size * (a.distance(b) + b.distance(c) + c.distance(a));
        assert!(
            (sum - whole).abs() <= 1e-9 * whole + rounding,
            "parts of triangle {t} have {sum} m² of {whole} m²"
        );
    }
}

/// An edge says that it lies on a source edge if and only if both its ends do.
fn assert_source_edges(source: &ObjectInput, mesh: &BakedMesh) {
    for (t, edges) in mesh.source_edge.iter().enumerate() {
        let triangle = source.triangles[mesh.source_triangle[t] as usize];
        let [a, b, c] = triangle.map(|v| source.positions[v as usize]);
        if area([a, b, c]) == 0.0 {
            continue;
        }
        let ends = [(a, b), (b, c), (c, a)];
        for (k, &edge) in edges.iter().enumerate() {
            let on = |edge: usize| {
                [k, (k + 1) % 3].into_iter().all(|corner| {
                    let p = mesh.positions[mesh.triangles[t][corner] as usize];
                    let (from, to) = ends[edge];
                    (p - from).cross(to - from).length() <= 1e-12 * (to - from).length_squared()
                })
            };
            match usize::try_from(edge) {
                Ok(edge) => assert!(on(edge), "edge {k} of triangle {t} is not on source edge {edge}"),
                Err(_) => assert!(!(0..3).any(on), "edge {k} of triangle {t} is on a source edge"),
            }
        }
    }
}

/// Where the mesh ends, the source ended: no cracks, no T-vertices.
fn assert_borders_are_source_borders(source: &ObjectInput, mesh: &BakedMesh) {
    let of_source = edge_uses(&source.triangles);
    let uses = edge_uses(&mesh.triangles);
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        for k in 0..3 {
            let count = uses[&key(triangle[k], triangle[(k + 1) % 3])];
            let expected = usize::try_from(mesh.source_edge[t][k]).map_or(2, |edge| {
                let corners = source.triangles[mesh.source_triangle[t] as usize];
                of_source[&key(corners[edge], corners[(edge + 1) % 3])]
            });
            assert_eq!(count, expected, "triangles on edge {k} of triangle {t} of “{}”", source.name);
        }
    }
}

/// Whether every edge belongs to exactly two triangles.
pub(crate) fn is_watertight(triangles: &[[u32; 3]]) -> bool {
    edge_uses(triangles).values().all(|&uses| uses == 2)
}

fn key(a: u32, b: u32) -> (u32, u32) {
    (a.min(b), a.max(b))
}

fn edge_uses(triangles: &[[u32; 3]]) -> HashMap<(u32, u32), usize> {
    let mut uses = HashMap::new();
    for triangle in triangles {
        for k in 0..3 {
            *uses.entry(key(triangle[k], triangle[(k + 1) % 3])).or_default() += 1;
        }
    }
    uses
}
