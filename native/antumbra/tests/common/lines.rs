//! Whether mesh edges lie on a line.

use antumbra::weld::BakedMesh;
use glam::DVec3;

/// Points at which a line is looked at, evenly spaced, its ends left out.
const SAMPLES: u32 = 200;

/// Share of a segment, in object space, along which no mesh edge runs.
///
/// An edge runs along it when both its ends are within `distance` of the infinite line.
pub(crate) fn uncovered(mesh: &BakedMesh, [from, to]: [DVec3; 2], distance: f64) -> f64 {
    let length = from.distance(to);
    let along = (to - from) / length;
    let height = |p: DVec3| ((p - from) - along * along.dot(p - from)).length();
    let mut intervals: Vec<[f64; 2]> = Vec::new();
    for triangle in &mesh.triangles {
        for k in 0..3 {
            let [a, b] = [triangle[k], triangle[(k + 1) % 3]].map(|v| mesh.positions[v as usize]);
            if height(a) <= distance && height(b) <= distance {
                let [s, t] = [a, b].map(|p| along.dot(p - from));
                intervals.push([s.min(t) - distance, s.max(t) + distance]);
            }
        }
    }
    let is_open = |&i: &u32| {
        let s = length * (f64::from(i) + 0.5) / f64::from(SAMPLES);
        !intervals.iter().any(|&[low, high]| low <= s && s <= high)
    };
    (0..SAMPLES).filter(is_open).count() as f64 / f64::from(SAMPLES)
}

/// The edges of a horizontal rectangle from `low` to `high`, at a height.
pub(crate) fn outline([low, high]: [[f64; 2]; 2], height: f64) -> [[DVec3; 2]; 4] {
    let corners = [[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]];
    let corners = corners.map(|[x, y]| DVec3::new(x, y, height));
    std::array::from_fn(|k| [corners[k], corners[(k + 1) % 4]])
}
