//! Outlines of what touches a face: without the edges inside it, and without vertices along straight lines.

use std::collections::{BTreeMap, BTreeSet};

use smallvec::SmallVec;

use crate::mesh::grid::{GridPoint, Step};

/// A segment on a face's grid.
type Segment = [GridPoint; 2];

/// Distance from a vertex that is left out to the line without it, in cells of the grid: less than the step that samples
/// beside a contact are away from it.
const STRAIGHT: f64 = 1.0;

/// What touches a face, from segments and whether something lies on the face left and right of each: connected lines, together.
///
/// Between two polygons that both lie on the face is no line, however many hold the same edge.
pub(super) fn outlines(touched: impl Iterator<Item = (Segment, [bool; 2])>) -> Vec<Vec<Segment>> {
    let mut covered = BTreeMap::<Segment, [bool; 2]>::new();
    for (mut ends, mut covers) in touched {
        if ends[0] > ends[1] {
            ends.reverse();
            covers.reverse();
        }
        let known = covered.entry(ends).or_default();
        *known = [known[0] || covers[0], known[1] || covers[1]];
    }
    let segments = covered.into_iter().filter(|(_, covers)| *covers != [true, true]).map(|(ends, _)| ends);
    connected(&straightened(&segments.collect::<Vec<_>>()))
}

/// The segments that end in each point.
struct Ends(BTreeMap<GridPoint, SmallVec<[usize; 2]>>);

impl Ends {
    fn of(segments: &[Segment]) -> Self {
        let mut ends = BTreeMap::<_, SmallVec<_>>::new();
        for (index, segment) in segments.iter().enumerate() {
            for &end in segment {
                ends.entry(end).or_default().push(index);
            }
        }
        Self(ends)
    }

    /// The only other segment that ends where a segment does.
    fn after(&self, segment: usize, end: GridPoint) -> Option<usize> {
        match self.0[&end][..] {
            [a, b] if a == segment => Some(b),
            [a, b] if b == segment => Some(a),
            _ => None,
        }
    }
}

fn other_end([a, b]: Segment, end: GridPoint) -> GridPoint {
    if a == end { b } else { a }
}

/// Joins what follows each other on a straight line.
fn straightened(segments: &[Segment]) -> Vec<Segment> {
    let ends = Ends::of(segments);
    let is_corner = |&end: &GridPoint| {
        let [a, b] = ends.0[&end][..] else { return true };
        let mut sleeve = Sleeve::new(other_end(segments[a], end), end);
        !sleeve.goes_on_to(other_end(segments[b], end))
    };
    let mut is_joined = vec![false; segments.len()];
    let mut joined = Vec::new();
    // From corners first, then around what has none
    for start in ends.0.keys().filter(|&end| is_corner(end)).chain(ends.0.keys()).copied() {
        for &first in &ends.0[&start] {
            if is_joined[first] {
                continue;
            }
            is_joined[first] = true;
            let (mut segment, mut end) = (first, other_end(segments[first], start));
            let mut sleeve = Sleeve::new(start, end);
            while let Some(next) = ends.after(segment, end).filter(|&next| !is_joined[next]) {
                let far = other_end(segments[next], end);
                if !sleeve.goes_on_to(far) {
                    break;
                }
                is_joined[next] = true;
                (segment, end) = (next, far);
            }
            joined.push(if start < end { [start, end] } else { [end, start] });
        }
    }
    joined
}

/// The directions from a point that pass near all others of a line (Williams 1978).
struct Sleeve {
    start: GridPoint,
    along: Step,
    /// Cells from the start to the last point.
    reached: f64,
    /// Angles from the first segment, in radians.
    low: f64,
    high: f64,
}

impl Sleeve {
    fn new(start: GridPoint, end: GridPoint) -> Self {
        let along = Step::between(start, end);
        let reached = (along.length_squared() as f64).sqrt();
        Self { start, along, reached, low: -STRAIGHT / reached, high: STRAIGHT / reached }
    }

    /// Whether a line from the start to a point passes near all points before it.
    fn goes_on_to(&mut self, point: GridPoint) -> bool {
        let to = Step::between(self.start, point);
        let distance = (to.length_squared() as f64).sqrt();
        let angle = (self.along.cross(to) as f64).atan2(self.along.dot(to) as f64);
        if distance <= self.reached || angle < self.low || angle > self.high {
            return false;
        }
        self.reached = distance;
        self.low = self.low.max(angle - STRAIGHT / distance);
        self.high = self.high.min(angle + STRAIGHT / distance);
        true
    }
}

/// Segments that hang together, together.
fn connected(segments: &[Segment]) -> Vec<Vec<Segment>> {
    let ends = Ends::of(segments);
    let mut left: BTreeSet<usize> = (0..segments.len()).collect();
    let mut all = Vec::new();
    while let Some(first) = left.pop_first() {
        let (mut one, mut open) = (Vec::new(), vec![first]);
        while let Some(segment) = open.pop() {
            one.push(segments[segment]);
            let touching = segments[segment].iter().flat_map(|end| &ends.0[end]);
            open.extend(touching.filter(|&segment| left.remove(segment)));
        }
        all.push(one);
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn at(u: i32, v: i32) -> GridPoint {
        GridPoint { u, v }
    }

    /// The sides of a square cut into `cells` by `cells` small ones that all lie on the face.
    fn tiles(cells: i32) -> Vec<(Segment, [bool; 2])> {
        let squares = (0..cells).flat_map(|i| (0..cells).map(move |j| (i, j)));
        squares
            .flat_map(|(i, j)| {
                let corners = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                let corners = corners.map(|corner| at(100 * corner.u + 50, 100 * corner.v + 50));
                (0..4).map(move |k| ([corners[k], corners[(k + 1) % 4]], [true, false]))
            })
            .collect()
    }

    #[test]
    fn many_small_faces_that_lie_on_another_have_the_outline_of_one_large_face() {
        let [outline] = &outlines(tiles(7).into_iter())[..] else { panic!("one outline") };
        let mut outline = outline.clone();
        outline.sort_unstable();
        let (low, high) = (50, 750);
        assert_eq!(
            outline,
            [
                [at(low, low), at(low, high)],
                [at(low, low), at(high, low)],
                [at(low, high), at(high, high)],
                [at(high, low), at(high, high)],
            ]
        );
    }

    #[test]
    fn a_face_that_lies_there_twice_keeps_its_outline() {
        let twice = tiles(1).into_iter().chain(tiles(1));
        assert_eq!(outlines(twice).concat().len(), 4);
    }

    #[test]
    fn what_stands_on_a_face_is_a_line_whatever_lies_beside_it() {
        let edge = [at(0, 0), at(1000, 0)];
        assert_eq!(outlines([(edge, [false, false]), (edge, [true, false])].into_iter()), [[edge]]);
    }

    #[test]
    fn a_slow_curve_is_not_straight() {
        // Each step of a circle of 10,000 cells leaves the line before it by a fortieth of a cell.
        let on = |k: i32| {
            let angle = f64::from(k) * std::f64::consts::TAU / 3000.0;
            at(20_000 + (1e4 * angle.cos()).round() as i32, 20_000 + (1e4 * angle.sin()).round() as i32)
        };
        let circle = (0..3000).map(|k| ([on(k), on((k + 1) % 3000)], [true, false]));
        let [outline] = &outlines(circle)[..] else { panic!("one outline") };
        assert!((50..500).contains(&outline.len()), "{}", outline.len());
        for [a, b] in outline {
            let middle = GridPoint::middle(*a, *b);
            let radius = f64::from(middle.u - 20_000).hypot(f64::from(middle.v - 20_000));
            assert!(radius > 1e4 - 2.0 * STRAIGHT - 1.0, "{radius}");
        }
    }

    #[test]
    fn lines_that_do_not_meet_are_apart() {
        let lines = [[at(0, 0), at(9, 9)], [at(9, 9), at(9, 0)], [at(50, 50), at(60, 70)]];
        let outlines = outlines(lines.into_iter().map(|line| (line, [false, false])));
        assert_eq!(outlines.iter().map(Vec::len).collect::<Vec<_>>(), [2, 1]);
    }
}
