//! What a line would remove: how wrong the light of its face would be without it (the paper, §3.1: "practically
//! invisible" boundaries are not worth computing).

use glam::DVec3;

use crate::adapt::line_search::MOST_CANDIDATES;
use crate::adapt::plate::{Part, Plate};
use crate::shadow::silhouette::BlockerEdges;
use crate::shadow::strength::jump;
use crate::shadow::wedge::Wedge;
use crate::transport::gather::rms;
use crate::transport::source_tree::LitPolygon;
use crate::visibility::blockers::Blockers;
use crate::visibility::shaft::{Shaft, TRIANGLE_EDGES};
use crate::visibility::{Scratch, visible_weighted};

/// Where the strength of a line is looked at, along it.
const PROBES: [f64; 3] = [0.15, 0.5, 0.85];

/// Measures lines of one scene.
pub(super) struct Strength<'a> {
    pub(super) blockers: &'a Blockers,
    pub(super) edges: &'a BlockerEdges,
    pub(super) scratch: Scratch,
    pub(super) found: Vec<u32>,
}

/// A line on its face.
struct Place {
    from: DVec3,
    along: DVec3,
    /// Unit, perpendicular to the line in the face.
    across: DVec3,
    length: f64,
    /// Of the penumbra, metres: it is as wide as it takes the line's trace to sweep over the source.
    width: f64,
}

impl Place {
    fn new(plate: &Plate, wedge: &Wedge, part: Part, lit: &LitPolygon) -> Self {
        let [from, to] = part.map(|weights| plate.at(weights));
        let along = to - from;
        let height = |point: DVec3| plate.plane.normal.dot(point - plate.plane.point);
        let source_height = 0.5 * (height(wedge.from[0]) + height(wedge.from[1]));
        let blocker_height =
            wedge.through.iter().map(|&p| height(p).max(0.0)).sum::<f64>() / wedge.through.len() as f64;
        let diameter = 2.0 * (lit.polygon.area() / std::f64::consts::PI).sqrt();
        let width = diameter * blocker_height / (source_height - blocker_height).max(1e-12);
        Self {
            from,
            along,
            across: plate.plane.normal.cross(along).normalize_or_zero(),
            length: along.length(),
            width: width.min(plate.reach),
        }
    }

    /// Of an element that the line would divide, metres.
    fn size(&self) -> f64 {
        self.width.min(self.length)
    }
}

impl Strength<'_> {
    /// The integral of the squared error that a line removes, about, W²/m²: by the jumps across it, and no more than the
    /// light bends there. Nothing when that is less than `least`; without a `least`, by the jumps alone.
    pub(super) fn removes(
        &mut self,
        plate: &Plate,
        wedge: &Wedge,
        part: Part,
        lit: &LitPolygon,
        least: Option<f64>,
    ) -> f64 {
        let place = Place::new(plate, wedge, part, lit);
        let removes = |form_factor: f64| {
            let error = rms(plate.shown * form_factor * lit.radiosity);
            error * error * place.width * place.length
        };
        let size = place.size();
        let mut bounds = PROBES.map(|t| {
            let middle = place.from + t * place.along;
            (jump(wedge, &plate.receiver(middle), &lit.polygon, self.edges).bound(size), middle)
        });
        bounds.sort_by(|a, b| b.0.total_cmp(&a.0));
        let Some(least) = least else { return removes(bounds[0].0) };

        let mut strongest = 0.0_f64;
        for (bound, middle) in bounds {
            // Of the others no more can come.
            if bound <= strongest || removes(bound) < least {
                break;
            }
            strongest = strongest.max(bound.min(self.bend(plate, &place, middle, lit)));
        }
        removes(strongest)
    }

    /// By how much the visible form factor in the middle of an element differs from the mean of its ends, at a point of
    /// the line: little where something else hides the source.
    fn bend(&mut self, plate: &Plate, place: &Place, middle: DVec3, lit: &LitPolygon) -> f64 {
        let step = place.size() * place.across;
        let points = [middle - step, middle, middle + step];
        let shaft = Shaft::new(&points, &TRIANGLE_EDGES, &lit.polygon, None);
        if self.blockers.candidates(&shaft, MOST_CANDIDATES, &mut self.found).is_err() {
            return 0.0;
        }
        let blocking = self.blockers.blocking();
        let values = points.map(|p| {
            let receiver = plate.receiver(p);
            visible_weighted(&receiver, &lit.polygon, None, blocking, &self.found, &mut self.scratch)
                .map_or(0.0, |found| found.grey())
        });
        0.25 * (values[0] + values[2] - 2.0 * values[1]).abs()
    }
}
