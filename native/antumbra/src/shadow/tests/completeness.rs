//! No discontinuity without a line: wherever the exact form factor bends along a scan of the floor, a line crosses.

use super::*;
use crate::shadow::contact::contact_line;

/// Metres between the points of a scan.
const STEP: f64 = 1e-3;

/// Third differences of values that are exact to 1e-16 but change their method of quadrature at 3e-14.
const NOISE: f64 = 3e-13;

/// Where third differences stand out from their surroundings: there the curvature or the slope jumps.
fn bends(values: &[f64]) -> Vec<usize> {
    let third: Vec<f64> = values.windows(4).map(|f| (f[3] - 3.0 * f[2] + 3.0 * f[1] - f[0]).abs()).collect();
    let largest = |range: std::ops::Range<usize>| third[range].iter().copied().fold(0.0, f64::max);
    // A bend is in three successive differences.
    (12..third.len() - 12)
        .filter(|&i| {
            let smooth = largest(i - 12..i - 2).max(largest(i + 3..i + 13));
            third[i] > NOISE + 20.0 * smooth
        })
        .collect()
}

/// Scans the floor; gives the number of bends, all of which a line explains.
fn scan(scene: &mut Scene, random: &mut Random, scans: usize) -> usize {
    let mut known: Vec<[DVec3; 2]> = scene.lines().iter().map(|line| line.ends).collect();
    // Where blockers touch the floor, and where the source's plane meets it
    let floor = [DVec3::new(-9.0, -9.0, 0.0), DVec3::new(27.0, -9.0, 0.0), DVec3::new(-9.0, 27.0, 0.0)];
    let at = |w: DVec3| floor[0] * w.x + floor[1] * w.y + floor[2] * w.z;
    let contacts = scene.blockers.iter().flat_map(|blocker| contact_line(floor, DVec3::Z, blocker));
    known.extend(contacts.map(|contact| contact.ends.map(at)));
    let (normal, origin) = (scene.source.normal(), scene.source.vertices()[0]);
    if let Some(along) = normal.cross(DVec3::Z).try_normalize() {
        let across = along.cross(DVec3::Z);
        let foot = across * (normal.dot(origin) / normal.dot(across));
        known.push([foot - 9.0 * along, foot + 9.0 * along]);
    }
    let centre: DVec3 =
        scene.blockers.iter().map(ConvexPolygon::centroid).sum::<DVec3>() / scene.blockers.len() as f64;
    let ray = centre - scene.source.centroid();
    let shadow = (centre - ray * (centre.z / ray.z.min(-1.0))).with_z(0.0);
    // The nearer the blocker is to the source, the larger is its shadow
    let spread = 0.6 * (scene.source.centroid().z / ray.z).abs().clamp(1.0, 4.0);
    let mut found = 0;
    for _ in 0..scans {
        // Through some point around the blocker's shadow
        let mut place = || DVec3::new(random.between(-1.0, 1.0), random.between(-1.0, 1.0), 0.0);
        let direction = (place() - place()).normalize();
        let start = shadow + spread * place() - direction * (1000.0 * STEP);
        let values: Vec<f64> =
            (0..2000).map(|k| scene.light_at(start + direction * (STEP * f64::from(k)))).collect();
        let crossings: Vec<f64> = known.iter().filter_map(|&ends| crossing(ends, start, direction)).collect();
        for i in bends(&values) {
            let (low, high) = (STEP * (i as f64 - 1.0), STEP * (i as f64 + 4.0));
            assert!(
                crossings.iter().any(|&at| low < at && at < high),
                "no line explains the bend at {}",
                start + direction * (0.5 * (low + high))
            );
            found += 1;
        }
    }
    found
}

/// Solids of a size at a height, turned at random under a square light at height 3.
fn scan_all(seed: u64, height: f64, size: f64) {
    let mut random = Random(seed);
    for shape in 0..3 {
        let mut found = 0;
        for _ in 0..4 {
            let turn = random.rotation();
            let at = |p: DVec3| DVec3::new(0.1, -0.2, height) + size * (turn * p);
            let blockers = [cube(at), tetrahedron(at), card(at)][shape].clone();
            found += scan(&mut Scene::new(light(DVec3::Z * 3.0, 0.6), blockers), &mut random, 6);
        }
        println!("height {height}, shape {shape}: {found} bends");
        assert!(found > 10, "only {found} bends of shape {shape}");
    }
}

#[test]
fn blockers_halfway_bend_the_light_only_on_lines() {
    scan_all(21, 1.5, 0.3);
}

#[test]
fn blockers_near_the_light_bend_it_only_on_lines() {
    scan_all(22, 2.6, 0.2);
}

#[test]
fn blockers_near_the_floor_bend_the_light_only_on_lines() {
    scan_all(23, 0.6, 0.3);
}

#[test]
fn blockers_through_the_light_bend_it_only_on_lines() {
    scan_all(24, 2.9, 0.3);
}

#[test]
fn blockers_through_the_floor_bend_the_light_only_on_lines() {
    scan_all(25, 0.2, 0.3);
}

#[test]
fn a_light_through_the_floor_is_bent_only_on_lines() {
    let mut random = Random(26);
    let mut found = 0;
    for _ in 0..6 {
        let (turn, tilt) = (random.rotation(), random.rotation());
        let corners = light(DVec3::ZERO, 0.8);
        let corners: Vec<DVec3> =
            corners.vertices().iter().map(|&p| DVec3::new(1.5, 0.0, 0.1) + tilt * p).collect();
        let source = polygon(&corners);
        let source = if source.normal().x < 0.0 { source } else { source.flipped() };
        let blockers = cube(|p| DVec3::new(0.3, 0.1, 0.4) + 0.15 * (turn * p));
        found += scan(&mut Scene::new(source, blockers), &mut random, 10);
    }
    println!("{found} bends");
    assert!(found > 50);
}
