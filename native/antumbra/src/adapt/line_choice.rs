//! Which lines go into the mesh (the paper, §3.2: "shadow boundaries only where necessary, i.e. where they are visible").
//!
//! A line earns its place when leaving it out would cost a noticeable share of the allowed squared error. Lines of
//! emitters and of secondary sources compete for the same triangles.

use std::collections::BTreeMap;

use rustc_hash::FxHashMap;

use crate::index::FaceId;
use crate::mesh::arrangement::Line;
use crate::mesh::grid::{GridPoint, Step, cross_properly};

/// Share of the allowed squared error that every vertex of a line must remove. Where bisection ends, with N vertices,
/// one more removes about 2/N of the squared error, since that falls with the square of N; N is of the order of 1000. On
/// the paper's scene ten times more or less changes neither error nor vertices by more than 3 %.
pub(crate) const WORTH_A_VERTEX: f64 = 2e-3;

/// Lines that are this near, in cells of the grid, are one: a millionth of the face, as for what touches.
const SAME_LINE: f64 = 64.0;

/// Vertices of the shortest line: its ends.
pub(super) const ENDS: f64 = 2.0;

/// Most allowances of squared error that a line may count as: where next to nothing is allowed, as in the dark, prices
/// must still be able to rise above every line.
const MOST_REMOVED: f64 = 1e100;

/// A shadow boundary on a face.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ShadowLine {
    pub(super) line: Line,
    /// The squared error that it removes, about, in parts of the squared error that is allowed.
    removes: f64,
}

impl ShadowLine {
    /// `removes`, `allowed`: integrals of squared error, W²/m².
    pub(super) fn new(line: Line, removes: f64, allowed: f64) -> Self {
        let removes = if removes > 0.0 { (removes / allowed).min(MOST_REMOVED) } else { 0.0 };
        Self { line, removes }
    }
}

/// The lines of a scene, and what they are worth.
pub(crate) struct Lines {
    contacts: FxHashMap<FaceId, Vec<Line>>,
    shadows: BTreeMap<FaceId, Vec<ShadowLine>>,
    /// Share of the allowed squared error that a vertex must remove, or nothing for every line.
    price: Option<f64>,
}

impl Lines {
    /// Contacts, which are always drawn.
    pub(crate) fn new(contacts: FxHashMap<FaceId, Vec<Line>>, price: Option<f64>) -> Self {
        Self { contacts, shadows: BTreeMap::new(), price }
    }

    /// Adds boundaries that may be drawn.
    pub(crate) fn add(&mut self, found: Vec<(FaceId, Vec<ShadowLine>)>) {
        for (face, found) in found {
            self.shadows.entry(face).or_default().extend(found);
        }
    }

    /// The contacts, and the shadow boundaries that remove at least as much error as their vertices could elsewhere: two
    /// at their ends and one wherever they cross a stronger one. Vertices become dearer until there are at most `most`.
    pub(crate) fn worthwhile(mut self, most: usize) -> FxHashMap<FaceId, Vec<Line>> {
        for found in self.shadows.values_mut() {
            found.sort_by(|a, b| b.removes.total_cmp(&a.removes).then(a.line.cmp(&b.line)));
        }
        loop {
            if let Some(lines) = self.at_this_price(most) {
                return lines;
            }
            self.raise_price();
        }
    }

    /// Lines at the current price, unless they make more than so many vertices, about.
    fn at_this_price(&self, most: usize) -> Option<FxHashMap<FaceId, Vec<Line>>> {
        let mut lines = self.contacts.clone();
        let mut vertices = 0;
        for (face, shadows) in &self.shadows {
            let drawn = lines.entry(*face).or_default();
            for shadow in shadows {
                if self.price.is_some_and(|price| shadow.removes < ENDS * price) {
                    // Those that follow remove less.
                    break;
                }
                let ends = shadow.line.ends;
                if drawn.iter().any(|other| lies_along(ends, other.ends)) {
                    continue;
                }
                let makes = 2 + drawn.iter().filter(|other| cross_properly(ends, other.ends)).count();
                if self.price.is_none_or(|price| shadow.removes >= price * makes as f64) {
                    drawn.push(shadow.line);
                    vertices += makes;
                    if vertices > most {
                        return None;
                    }
                }
            }
        }
        lines.retain(|_, lines| !lines.is_empty());
        Some(lines)
    }

    /// The least price is a millionth of what the strongest line removes, and never nothing: where no line removes
    /// anything, as in the dark, the next price leaves all out.
    fn raise_price(&mut self) {
        let strongest =
            self.shadows.values().filter_map(|found| Some(found.first()?.removes)).fold(0.0, f64::max);
        let least = (1e-6 * strongest).max(f64::MIN_POSITIVE);
        self.price = Some(self.price.map_or(least, |price| (4.0 * price).max(least)));
    }
}

/// Whether a line runs along another, nearer than [`SAME_LINE`]: the plane of a wall throws one where the wall touches
/// the floor, and a sliver between the two would carry light into the wall.
fn lies_along(line: [GridPoint; 2], other: [GridPoint; 2]) -> bool {
    let near = |p: GridPoint| {
        let (along, to) = (Step::between(other[0], other[1]), Step::between(other[0], p));
        let length = (along.length_squared() as f64).sqrt();
        let t = along.dot(to) as f64 / length;
        (along.cross(to) as f64).abs() <= SAME_LINE * length && (-SAME_LINE..=length + SAME_LINE).contains(&t)
    };
    near(line[0]) && near(line[1])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::arrangement::LineKind;

    fn shadow(from: [i32; 2], to: [i32; 2], removes: f64) -> ShadowLine {
        let ends = [from, to].map(|[u, v]| GridPoint { u, v });
        ShadowLine::new(Line { ends, kind: LineKind::Shadow }, removes, 1.0)
    }

    fn choose(lines: Vec<ShadowLine>, price: Option<f64>, most: usize) -> Vec<Line> {
        let mut all = Lines::new(FxHashMap::default(), price);
        // Found in two searches
        for line in lines {
            all.add(vec![(FaceId::new(0), vec![line])]);
        }
        all.worthwhile(most).remove(&FaceId::new(0)).unwrap_or_default()
    }

    /// In the dark no line removes anything and vertices cost nothing; too many lines must still come to an end.
    #[test]
    fn lines_that_remove_nothing_give_way_to_the_budget() {
        for price in [None, Some(0.0)] {
            assert!(choose(vec![shadow([1000, 1000], [9_000_000, 1000], 0.0)], price, 1).is_empty());
        }
        // Nothing is allowed, and yet something removed.
        let ends = [GridPoint { u: 1000, v: 1000 }, GridPoint { u: 9_000_000, v: 1000 }];
        let line = ShadowLine::new(Line { ends, kind: LineKind::Shadow }, 1.0, 0.0);
        assert!(choose(vec![line], Some(WORTH_A_VERTEX), 1).is_empty());
    }

    #[test]
    fn lines_of_all_searches_compete_for_the_same_vertices() {
        let weak = shadow([1000, 1000], [9_000_000, 1000], 1.0);
        let strong = shadow([1000, 9_000_000], [9_000_000, 9_000_000], 100.0);
        assert_eq!(choose(vec![weak, strong], None, 4), [strong.line, weak.line]);
        assert_eq!(choose(vec![weak, strong], None, 3), [strong.line]);
        assert_eq!(choose(vec![weak, strong], Some(1.0), 4), [strong.line]);
    }

    #[test]
    fn a_line_along_a_stronger_one_is_not_drawn_twice() {
        let line = shadow([1000, 1000], [9_000_000, 1000], 100.0);
        let along = shadow([2000, 1010], [8_000_000, 1010], 50.0);
        assert_eq!(choose(vec![along, line], Some(1.0), 100), [line.line]);
    }
}
