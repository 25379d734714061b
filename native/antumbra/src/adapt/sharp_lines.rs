//! The borders of sharp shadows: of suns without an angle, and of points and spots without a radius (the paper, §2.3: D0).
//!
//! No five-case test is needed: a point is seen or not, so that every silhouette edge of what may come between throws its
//! line. The light jumps across it; it is drawn like a contact, with a value on each side.

use glam::DVec3;
use rayon::prelude::*;

use crate::adapt::line_choice::{ENDS, ShadowLine};
use crate::adapt::line_search::{LineSearch, MOST_CANDIDATES, line};
use crate::error::Error;
use crate::index::FaceId;
use crate::lamps::Lamp;
use crate::mesh::arrangement::LineKind;
use crate::shadow::boundary::{Plane, clip_to_triangle};
use crate::shadow::sharp::{Apex, shadow_of_edge};
use crate::transport::form_factors::{Candidates, FormFactors};
use crate::transport::gather::rms;
use crate::visibility::Receiver;

/// Times that a face is quartered in search of parts with few enough candidates.
const DEEPEST: u32 = 5;

/// Where it is looked whether the light jumps, along a line: as much as half of it may lie in another's shadow.
const PROBES: [f64; 8] = [0.02, 0.13, 0.27, 0.42, 0.58, 0.73, 0.87, 0.98];

/// Distance of the probes from a line, relative to the face: far above the rounding of the line and of the grid.
const BESIDE: f64 = 1e-6;

/// A face under search.
struct Plate {
    corners: [DVec3; 3],
    plane: Plane,
    reach: f64,
    shown: DVec3,
}

impl LineSearch<'_> {
    /// The borders of sharp shadows on every baked face that could be worth drawing.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    pub(crate) fn find_sharp(
        &self,
        lamps: &[Lamp],
        form_factors: &FormFactors,
    ) -> Result<Vec<(FaceId, Vec<ShadowLine>)>, Error> {
        let sharp: Vec<(&Lamp, Apex)> = lamps.iter().filter_map(|lamp| Some((lamp, lamp.apex()?))).collect();
        if sharp.is_empty() {
            return Ok(Vec::new());
        }
        let faces: Vec<FaceId> =
            FaceId::range(0..self.world.faces.len()).filter(|&face| self.world.receives(face)).collect();
        let lines: Vec<Vec<ShadowLine>> = (faces.par_iter())
            .map_init(Vec::new, |found, &face| {
                let plate = self.plate(face);
                let mut lines = Vec::new();
                for &(lamp, apex) in sharp.iter().filter(|_| !(self.ends)()) {
                    self.add_sharp(&plate, lamp, apex, form_factors, found, &mut lines);
                }
                lines
            })
            .collect();
        self.monitor.check()?;
        Ok(faces.into_iter().zip(lines).filter(|(_, lines)| !lines.is_empty()).collect())
    }

    fn plate(&self, id: FaceId) -> Plate {
        let face = &self.world.faces[id.index()];
        let corners = self.world.corners(face);
        let point = (corners[0] + corners[1] + corners[2]) / 3.0;
        let reach = 1.01 * corners.iter().map(|c| c.distance(point)).fold(0.0, f64::max);
        let plane = Plane { point, normal: face.normal };
        Plate { corners, plane, reach, shown: self.shown[face.material as usize] }
    }

    /// Adds the lines of one lamp on one face.
    fn add_sharp(
        &self,
        plate: &Plate,
        lamp: &Lamp,
        apex: Apex,
        form_factors: &FormFactors,
        found: &mut Vec<u32>,
        lines: &mut Vec<ShadowLine>,
    ) {
        let above = match apex {
            Apex::Point(point) => plate.plane.normal.dot(point - plate.plane.point),
            Apex::Direction(towards) => plate.plane.normal.dot(towards),
        };
        let least = self.price.map(|price| ENDS * price);
        let most = rms(plate.shown * lamp.most_to(plate.plane.point, plate.reach));
        // A line is at most as long as the face.
        let could_pay = |least: f64| removes(most, 2.0 * plate.reach) >= least;
        if above <= 0.0 || !least.is_none_or(could_pay) {
            return;
        }

        // Silhouette edges of all that may come between
        let mut blockers = Vec::new();
        self.between(plate.corners, plate.plane.normal, lamp, 0, found, &mut blockers);
        blockers.sort_unstable();
        blockers.dedup();
        let mut edges: Vec<u32> =
            blockers.iter().flat_map(|&blocker| self.edges.edges_of(blocker)).copied().collect();
        edges.sort_unstable();
        edges.dedup();

        // Their shadows on the face
        for edge in edges {
            if !self.edges.is_silhouette_from(edge, apex) {
                continue;
            }
            let ends = self.edges.edge(edge).ends;
            let Some(traced) = shadow_of_edge(apex, ends, &plate.plane, plate.reach) else { continue };
            let Some(part) = clip_to_triangle(traced, plate.corners) else { continue };
            let Some(line) = line(part, LineKind::Sharp) else { continue };
            let [from, to] =
                part.map(|w| w.x * plate.corners[0] + w.y * plate.corners[1] + w.z * plate.corners[2]);
            let removes = removes(jump(plate, lamp, [from, to], form_factors), from.distance(to));
            if least.is_none_or(|least| removes >= least) {
                lines.push(ShadowLine::new(line, removes, self.allowed));
            }
        }
    }

    /// Collects what may come between a part of a face and a lamp; a crowd that no list holds is left to refinement.
    fn between(
        &self,
        corners: [DVec3; 3],
        normal: DVec3,
        lamp: &Lamp,
        level: u32,
        found: &mut Vec<u32>,
        blockers: &mut Vec<u32>,
    ) {
        let shaft = lamp.shaft_of_triangle(corners, normal);
        if self.blockers.candidates(&shaft, MOST_CANDIDATES, found).is_ok() {
            blockers.extend_from_slice(found);
        } else if level < DEEPEST && !(self.ends)() {
            let [a, b, c] = corners;
            let [ab, bc, ca] = [0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)];
            for part in [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]] {
                self.between(part, normal, lamp, level + 1, found, blockers);
            }
        }
    }
}

/// The largest jump of what is shown across a line, over the channels, W/m².
fn jump(plate: &Plate, lamp: &Lamp, [from, to]: [DVec3; 2], form_factors: &FormFactors) -> f64 {
    let across = BESIDE * plate.reach * plate.plane.normal.cross(to - from).normalize_or_zero();
    let jump_at = |t: f64| {
        let middle = from.lerp(to, t);
        let [left, right] = [middle - across, middle + across].map(|position| {
            let receiver = Receiver { position, normal: plate.plane.normal };
            lamp.sharp_light(&receiver, Candidates::Crowd, form_factors)
        });
        rms(plate.shown * (left - right))
    };
    PROBES.into_iter().map(jump_at).fold(0.0, f64::max)
}

/// The squared error that a line removes, about, W²/m²: without it the light is off by half of its jump, over a strip whose
/// elements are as wide as the line is long before anything is refined.
fn removes(jump: f64, length: f64) -> f64 {
    (0.5 * jump * length).powi(2)
}
