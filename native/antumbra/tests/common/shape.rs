//! Triangle meshes for small scenes.

use std::collections::HashMap;

use glam::DVec3;

use super::Solid;

/// A triangle mesh, counter-clockwise seen from its front.
#[derive(Clone, Default)]
pub(crate) struct Shape {
    pub(crate) positions: Vec<DVec3>,
    pub(crate) triangles: Vec<[u32; 3]>,
    pub(crate) corner_normals: Option<Vec<[DVec3; 3]>>,
}

impl Shape {
    /// A parallelogram of two triangles, facing `u × v`.
    pub(crate) fn quad(corner: DVec3, u: DVec3, v: DVec3) -> Self {
        Self::grid(corner, u, v, [1, 1])
    }

    /// A parallelogram cut into `cells` of two triangles each, facing `u × v`.
    pub(crate) fn grid(corner: DVec3, u: DVec3, v: DVec3, cells: [u32; 2]) -> Self {
        let [columns, rows] = cells;
        let mut shape = Self::default();
        for j in 0..=rows {
            for i in 0..=columns {
                let (s, t) = (f64::from(i) / f64::from(columns), f64::from(j) / f64::from(rows));
                shape.positions.push(corner + s * u + t * v);
            }
        }
        for j in 0..rows {
            for i in 0..columns {
                let a = j * (columns + 1) + i;
                let [b, c, d] = [a + 1, a + columns + 2, a + columns + 1];
                shape.triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
        shape
    }

    /// A horizontal square that faces up, or down when `half` is negative.
    pub(crate) fn square(center: DVec3, half: f64) -> Self {
        let corner = center + DVec3::new(-half.abs(), -half, 0.0);
        Self::quad(corner, DVec3::X * 2.0 * half.abs(), DVec3::Y * 2.0 * half)
    }

    /// A closed box that faces outwards.
    pub(crate) fn cuboid(center: DVec3, half: DVec3) -> Self {
        let solid = Solid::cube().map(|corner| center + corner * half);
        let triangles = (solid.faces.iter())
            .flat_map(|face| [[face[0], face[1], face[2]], [face[0], face[2], face[3]]])
            .map(|triangle| triangle.map(|corner| corner as u32))
            .collect();
        Self { positions: solid.corners, triangles, corner_normals: None }
    }

    /// The closed box from 0 to `size`, seen from inside.
    pub(crate) fn room(size: DVec3) -> Self {
        Self::cuboid(0.5 * size, 0.5 * size).inside_out()
    }

    /// A smooth sphere about the origin: an octahedron subdivided `level` times.
    pub(crate) fn sphere(radius: f64, level: u32) -> Self {
        let mut positions: Vec<DVec3> =
            [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z].into();
        let mut triangles: Vec<[u32; 3]> =
            [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]].into();
        for _ in 0..level {
            let mut middles = HashMap::new();
            let mut middle = |a: u32, b: u32| {
                *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                    positions.push((positions[a as usize] + positions[b as usize]).normalize());
                    positions.len() as u32 - 1
                })
            };
            triangles = (triangles.into_iter())
                .flat_map(|[a, b, c]| {
                    let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
                    [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
                })
                .collect();
        }
        let unit = Self { positions, triangles, corner_normals: None };
        unit.map(|p| p * radius).smooth_about(DVec3::ZERO)
    }

    /// A closed L of height 1 that faces outwards: arms 3 m long, one of them 1 cm thin, with faces of all sizes.
    pub(crate) fn thin_l() -> Self {
        let outline = [[0.0, 0.0], [3.0, 0.0], [3.0, 0.01], [0.5, 0.01], [0.5, 3.0], [0.0, 3.0]];
        let at = |z: f64| outline.map(|[x, y]| DVec3::new(x, y, z));
        let positions = [at(0.0), at(1.0)].concat();
        let caps = [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]];
        let mut triangles: Vec<[u32; 3]> =
            caps.iter().flat_map(|&[a, b, c]| [[a, c, b], [a + 6, b + 6, c + 6]]).collect();
        for a in 0..6 {
            let b = (a + 1) % 6;
            triangles.extend([[a, b, b + 6], [a, b + 6, a + 6]]);
        }
        Self { positions, triangles, corner_normals: None }
    }

    /// The same surface seen from its other side.
    pub(crate) fn inside_out(mut self) -> Self {
        for triangle in &mut self.triangles {
            triangle.swap(1, 2);
        }
        if let Some(normals) = &mut self.corner_normals {
            for corners in normals {
                corners.swap(1, 2);
                *corners = corners.map(|n| -n);
            }
        }
        self
    }

    /// Shading normals that point away from `center`.
    pub(crate) fn smooth_about(mut self, center: DVec3) -> Self {
        let normal = |v: u32| (self.positions[v as usize] - center).normalize();
        self.corner_normals = Some(self.triangles.iter().map(|corners| corners.map(normal)).collect());
        self
    }

    pub(crate) fn map(mut self, place: impl Fn(DVec3) -> DVec3) -> Self {
        for position in &mut self.positions {
            *position = place(*position);
        }
        self
    }

    /// Both meshes as one, without shading normals.
    pub(crate) fn and(mut self, other: &Self) -> Self {
        let first = self.positions.len() as u32;
        self.positions.extend(&other.positions);
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|v| first + v)));
        self.corner_normals = None;
        self
    }
}
