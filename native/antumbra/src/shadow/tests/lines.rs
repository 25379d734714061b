//! Where the lines are, against closed forms.

use super::*;
use crate::shadow::wedge::WedgeKind;

/// The distinct values, ascending.
fn distinct(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_unstable_by(f64::total_cmp);
    values.dedup_by(|a, b| (*a - *b).abs() < 1e-9);
    values
}

fn assert_close(found: &[f64], expected: &[f64]) {
    assert_eq!(found.len(), expected.len(), "found {found:?}, expected {expected:?}");
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() < 1e-12, "{found} instead of {expected}");
    }
}

/// The x of lines along y that pass y = `at`.
fn upright_lines(lines: &[Line], at: f64) -> Vec<f64> {
    distinct(lines.iter().filter(|line| (line.ends[0].x - line.ends[1].x).abs() < 1e-9).filter_map(|line| {
        let [low, high] = [line.ends[0].y.min(line.ends[1].y), line.ends[0].y.max(line.ends[1].y)];
        (low <= at && at <= high).then_some(line.ends[0].x)
    }))
}

#[test]
fn a_half_plane_has_a_penumbra_by_similar_triangles() {
    // x > 0 is dark at height 1; the light reaches from -0.5 to 0.5 at height 3
    let half_plane = card(|p| DVec3::new(1e3 * (p.x + 1.0), 1e3 * p.y, 1.0));
    let scene = Scene::new(light(DVec3::new(0.0, 0.0, 3.0), 0.5), half_plane);
    assert_close(&upright_lines(&scene.lines(), 0.0), &[-0.25, 0.25]);
}

#[test]
fn a_box_has_the_boundaries_of_similar_triangles() {
    let blocker = cuboid(DVec3::Z, DVec3::splat(0.5));
    let scene = Scene::new(light(DVec3::new(0.0, 0.0, 4.0), 1.0), blocker);
    let lines = scene.lines();
    // Outer penumbra past the top, umbra past the bottom, and the sides seen edge-on
    let umbra = 3.0 / 7.0;
    assert_close(&upright_lines(&lines, 0.0), &[-1.4, -0.5, -umbra, umbra, 0.5, 1.4]);
    // Corners of the top seen past the light's near edge, as long as the side beside them is hidden
    assert_close(&upright_lines(&lines, 1.0), &[-1.4, -0.5, -0.2, 0.2, 0.5, 1.4]);
    // Corners of the bottom seen past the light's far edge
    let bottom = 5.0 / 7.0;
    assert_close(&upright_lines(&lines, 0.46), &[-1.4, -bottom, -0.5, -umbra, umbra, 0.5, bottom, 1.4][..]);

    // Each kind covers its part of the outer boundary
    let outer = |kind: WedgeKind| {
        distinct(
            (lines.iter())
                .filter(|line| {
                    line.wedge.id.kind == kind && line.ends.iter().all(|p| (p.x - 1.4).abs() < 1e-12)
                })
                .flat_map(|line| line.ends.map(|end| end.y)),
        )
    };
    assert_close(&outer(WedgeKind::VertexEdge), &[-1.4, -0.2, 0.2, 1.4]);
    assert_close(&outer(WedgeKind::EdgeVertex), &[-1.4, -0.2, 0.2, 1.4]);
    assert!(outer(WedgeKind::Face).is_empty());
}

#[test]
fn winding_and_order_change_no_line() {
    let mut random = Random(7);
    let turn = random.rotation();
    let blocker = cube(|p| DVec3::Z * 1.5 + 0.4 * (turn * p));
    let ends = |blockers: Vec<ConvexPolygon>| {
        let scene = Scene::new(light(DVec3::new(0.2, 0.1, 4.0), 0.7), blockers);
        let mut ends: Vec<[[f64; 3]; 2]> = (scene.lines().iter())
            .map(|line| {
                let [a, b] = line.ends.map(|p| (p * 1e9).round().to_array());
                if a < b { [a, b] } else { [b, a] }
            })
            .collect();
        ends.sort_by(|a, b| a.partial_cmp(b).expect("lines are finite"));
        ends
    };
    let expected = ends(blocker.clone());
    let mut other: Vec<_> =
        blocker.iter().enumerate().map(|(i, p)| if i % 2 == 0 { p.flipped() } else { p.clone() }).collect();
    other.reverse();
    assert_eq!(ends(other), expected);
}

#[test]
fn a_shared_edge_gives_both_polygons_the_same_wedges() {
    let blocker = cuboid(DVec3::Z, DVec3::splat(0.5));
    let source = light(DVec3::new(0.1, 0.2, 4.0), 1.0);
    let scene = Scene::new(source.clone(), blocker.clone());
    let cache = WedgeCache::new(&source, &scene.edges, &blocker);
    let all: Vec<Wedge> = (0..6).flat_map(|blocker| cache.wedges(blocker).to_vec()).collect();
    for wedge in scene.wedges() {
        let same: Vec<_> = all.iter().filter(|other| other.id == wedge.id).collect();
        assert!(same.iter().all(|other| **other == wedge));
        let sharing = match wedge.id.kind {
            WedgeKind::VertexEdge => 2,
            WedgeKind::EdgeVertex => 3,
            WedgeKind::Face => 1,
        };
        assert_eq!(same.len(), sharing);
    }
}

#[test]
fn a_blocker_through_the_source_counts_only_in_front_of_it() {
    let source = light(DVec3::Z * 2.0, 0.5);
    let through = Scene::new(source.clone(), cuboid(DVec3::new(0.3, 0.1, 2.0), DVec3::new(0.3, 0.4, 0.5)));
    for wedge in through.wedges() {
        assert!(wedge.through.iter().all(|p| p.z <= 2.0), "{wedge:?}");
    }
    assert!(through.lines().iter().flat_map(|line| line.ends).all(DVec3::is_finite));
    let behind = Scene::new(source, cuboid(DVec3::Z * 3.0, DVec3::splat(0.5)));
    assert!(behind.wedges().is_empty());
}

#[test]
fn a_blocker_through_the_floor_throws_lines_only_above_it() {
    // A wall 1 m high, sunk 1 m deep: its shadow begins at its foot
    let wall = card(|p| DVec3::new(0.0, p.x, p.y));
    let scene = Scene::new(light(DVec3::new(-2.0, 0.0, 3.0), 0.25), wall);
    for line in scene.lines() {
        assert!(line.ends.iter().all(|end| end.x > -1e-12), "{:?}", line.ends);
    }
    let feet = scene.lines().iter().flat_map(|line| line.ends).filter(|end| end.x.abs() < 1e-12).count();
    assert!(feet >= 8, "four corners of the light past two uprights");
}

#[test]
fn triangles_throw_the_lines_of_their_quads() {
    let turn = Random(5).rotation();
    let quads = cube(|p| DVec3::Z * 1.5 + 0.4 * (turn * p));
    let triangles = (quads.iter().map(ConvexPolygon::vertices))
        .flat_map(|v| [polygon(&[v[0], v[1], v[2]]), polygon(&[v[0], v[2], v[3]])])
        .collect();
    let source = light(DVec3::new(0.2, 0.1, 4.0), 0.7);
    let lines = |blockers: Vec<ConvexPolygon>| {
        let lines = Scene::new(source.clone(), blockers).lines();
        lines.into_iter().filter(|line| line.wedge.id.kind != WedgeKind::Face).map(|line| line.ends)
    };
    let (of_quads, of_triangles) = (lines(quads), lines(triangles));
    let mut left: Vec<_> = of_triangles.collect();
    for [a, b] in of_quads {
        let same = left.iter().position(|&[c, d]| {
            a.distance(c) + b.distance(d) < 1e-12 || a.distance(d) + b.distance(c) < 1e-12
        });
        left.swap_remove(same.expect("the triangles throw it too"));
    }
    assert!(left.is_empty());
}

#[test]
fn what_lies_in_the_receivers_plane_throws_no_line_on_it() {
    // The floor's own neighbours, and the foot of a box
    let source = light(DVec3::Z * 3.0, 0.5);
    assert!(Scene::new(source.clone(), card(|p| p)).lines().is_empty());
    let scene = Scene::new(source, cuboid(DVec3::Z * 0.5, DVec3::splat(0.5)));
    for line in scene.lines() {
        assert!(line.wedge.through.iter().any(|p| p.z > 0.0), "{:?}", line.wedge);
    }
}

#[test]
fn a_source_through_the_floor_sends_only_from_above() {
    let corner = |y: f64, z: f64| DVec3::new(-2.0, y, z);
    let source = polygon(&[corner(-1.0, -2.0), corner(1.0, -2.0), corner(1.0, 2.0), corner(-1.0, 2.0)]);
    assert_eq!(source.normal(), DVec3::X);
    let scene = Scene::new(source, cuboid(DVec3::new(0.0, 0.0, 0.5), DVec3::splat(0.25)));
    let lines = scene.lines();
    assert!(!lines.is_empty());
    for line in &lines {
        // Light that arrives from above has passed the blocker on its way down
        assert!(line.ends.iter().all(|end| end.x > -0.25 && end.z.abs() < 1e-12), "{:?}", line.ends);
    }
    // The top of the box is below the top of the light, so that its shadow ends; from 0.75 up it does not
    assert!(lines.iter().any(|line| line.ends.iter().any(|end| end.length() > REACH - 1e-9)));
}

/// Whether light from the wedge's part of the source passes its part of the blocker on its way to a point.
fn passes(wedge: &Wedge, x: DVec3) -> bool {
    let between = |past: &[DVec3], point: DVec3| {
        let beside = wedge.normal.cross(point - x).normalize();
        let sides = past.iter().map(|p| beside.dot((p - x).normalize()));
        let (low, high) =
            sides.fold((1.0_f64, -1.0_f64), |(low, high), side| (low.min(side), high.max(side)));
        low < 1e-9 && high > -1e-9
    };
    match wedge.id.kind {
        WedgeKind::VertexEdge => between(&wedge.through, wedge.from[0]),
        WedgeKind::EdgeVertex => between(&wedge.from, wedge.through[0]),
        WedgeKind::Face => {
            wedge.through.iter().any(|&p| between(&wedge.from, p))
                || wedge.from.iter().any(|&z| between(&wedge.through, z))
        }
    }
}

#[test]
fn traced_points_lie_on_the_plane_and_in_the_wedge() {
    let mut random = Random(3);
    let (mut worst, mut count) = (0.0_f64, 0);
    for _ in 0..400 {
        let (turn, tilt) = (random.rotation(), random.rotation());
        let place =
            DVec3::new(random.between(-1.0, 1.0), random.between(-1.0, 1.0), random.between(0.0, 3.5));
        let size = 10.0_f64.powf(random.between(-3.0, 0.0));
        let blockers = cube(|p| place + size * (turn * p));
        let source = light(DVec3::new(0.0, 0.0, 3.0), 10.0_f64.powf(random.between(-2.0, 0.5)));
        let plane = Plane { point: DVec3::ZERO, normal: tilt * DVec3::Z };
        for wedge in Scene::new(source, blockers).wedges() {
            let Some(ends) = trace(&wedge, &plane, REACH) else { continue };
            let sine = wedge.normal.cross(plane.normal).length();
            for end in ends {
                assert!(end.length() <= REACH * (1.0 + 1e-12));
                assert!(passes(&wedge, end), "{end} of {wedge:?}");
                let off_wedge = wedge.normal.dot(end - wedge.from[0]).abs();
                // A grazing wedge's own plane is known to its coordinates' rounding over its size only.
                let conditioned = sine * size.min(1.0);
                worst = worst.max(plane.normal.dot(end).abs() / REACH).max(off_wedge * conditioned / REACH);
                count += 1;
            }
        }
    }
    assert!(count > 10_000 && worst < 1e-12, "{count} points, worst {worst:e}");
    println!("{count} traced points, worst distance from plane and wedge {worst:e} of the reach");
}
