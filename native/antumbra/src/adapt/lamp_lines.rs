//! Where the shadows of suns, points and spots end.
//!
//! Without an angle or a radius a lamp is seen or not: every silhouette edge of what may come between throws a line, across
//! which the light jumps (the paper, §2.3: D0). It is drawn like a contact, with a value on each side.
//!
//! What is round throws two for each edge, in the planes through the edge that touch it: the borders of the penumbra. They
//! are what a polygon's wedges of edges and vertices have around them; the many in between, one for each corner of a
//! polygon that a disc is not, bend nothing. Which disc a light without falloff shows depends on the receiver, for its lines
//! it is the one that the edge sees.

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use smallvec::{SmallVec, smallvec};

use crate::adapt::line_choice::{ENDS, ShadowLine};
use crate::adapt::line_search::{LineSearch, MOST_CANDIDATES, Seen};
use crate::adapt::plate::{Part, Plate, line};
use crate::error::Error;
use crate::index::FaceId;
use crate::lamps::Lamp;
use crate::mesh::arrangement::LineKind;
use crate::shadow::boundary::clip_to_triangle;
use crate::shadow::sharp::{Apex, shadow_of_edge};
use crate::threads::AT_A_TIME;
use crate::transport::form_factors::{FormFactors, Workspace};
use crate::transport::gather::rms;
use crate::visibility::Receiver;
use crate::visibility::screens::Body;

/// Times that a face is quartered in search of parts with few enough candidates.
const DEEPEST: u32 = 5;

/// Where it is looked whether the light jumps, along a line: as much as half of it may lie in another's shadow.
const PROBES: [f64; 8] = [0.02, 0.13, 0.27, 0.42, 0.58, 0.73, 0.87, 0.98];

/// The same for lines of penumbrae, where each look costs more.
const PROBES_OF_SOFT: [f64; 3] = [0.15, 0.5, 0.85];

/// Lines of a lamp on a face up to which it is looked where they cross: the looks grow with their square.
const MOST_CROSSING: usize = 64;

/// Distance of the probes from a line, relative to the face: far above the rounding of the line and of the grid.
const BESIDE: f64 = 1e-6;

impl LineSearch<'_> {
    /// The borders of the shadows of suns, points and spots on every baked face that could be worth drawing.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    pub(crate) fn find_of_lamps(
        &self,
        lamps: &[Lamp],
        form_factors: &FormFactors,
    ) -> Result<Vec<(FaceId, Vec<ShadowLine>)>, Error> {
        let lamps: Vec<(&Lamp, Apex)> = lamps.iter().filter_map(|lamp| Some((lamp, lamp.apex()?))).collect();
        if lamps.is_empty() {
            return Ok(Vec::new());
        }
        let faces: Vec<FaceId> =
            FaceId::range(0..self.world.faces.len()).filter(|&face| self.world.receives(face)).collect();
        let bodies: Vec<Body> = lamps.iter().map(|(lamp, _)| lamp.body()).collect();
        let seen = Seen::new(self, &faces, &bodies);
        let lines: Vec<Vec<ShadowLine>> = (faces.par_iter().enumerate().with_max_len(AT_A_TIME))
            .map_init(Workspace::default, |workspace, (number, &face)| {
                let plate = Plate::new(self, face);
                let object = self.world.faces[face.index()].object.index() as u32;
                let mut lines = Vec::new();
                let seen = seen.of(number).iter().map(|&lamp| lamps[lamp as usize]);
                for (lamp, apex) in seen.filter(|(lamp, _)| !(self.ends)() && lamp.lights(object)) {
                    let mut light = |position| {
                        let receiver = Receiver::new(position, plate.plane.normal).of(object);
                        plate.shown * lamp.light(&receiver, form_factors, workspace)
                    };
                    self.add_lines_of_lamp(&plate, lamp, apex, &mut light, &mut lines);
                }
                lines
            })
            .collect();
        self.monitor.check()?;
        Ok(faces.into_iter().zip(lines).filter(|(_, lines)| !lines.is_empty()).collect())
    }

    /// Adds the lines of one lamp on one face.
    ///
    /// `light`: what of it is shown at a place, W/m².
    fn add_lines_of_lamp(
        &self,
        plate: &Plate,
        lamp: &Lamp,
        apex: Apex,
        light: &mut impl FnMut(DVec3) -> DVec3,
        lines: &mut Vec<ShadowLine>,
    ) {
        let above = match apex {
            Apex::Point(point) => plate.plane.normal.dot(point - plate.plane.point),
            Apex::Direction(towards) => plate.plane.normal.dot(towards),
        };
        let least = self.price.map(|price| ENDS * price);
        let most = rms(plate.shown * lamp.most_to(plate.plane.point, plate.reach));
        // A line is at most as long as the face.
        let could_pay = |least: f64| removes(0.5 * most, 2.0 * plate.reach) >= least;
        if above <= 0.0 || !least.is_none_or(could_pay) {
            return;
        }

        // Silhouette edges of all that may come between
        let mut blockers = Vec::new();
        self.between(plate.corners, plate.plane.normal, lamp, 0, &mut Vec::new(), &mut blockers);
        blockers.sort_unstable();
        blockers.dedup();
        let mut edges: Vec<u32> =
            blockers.iter().flat_map(|&blocker| self.edges.edges_of(blocker)).copied().collect();
        edges.sort_unstable();
        edges.dedup();

        // Their shadows on the face
        let length = |part: Part| plate.at(part[0]).distance(plate.at(part[1]));
        let mut add = |part: Part, kind: LineKind, error: f64| {
            let removes = removes(error, length(part));
            if least.is_none_or(|least| removes >= least)
                && let Some(line) = line(part, kind)
            {
                lines.push(ShadowLine::new(line, removes, self.allowed));
            }
        };
        let thrown = |edge: u32, apex: Apex| {
            let silhouette = self.edges.is_silhouette_from(edge, apex);
            let ends = self.edges.edge(edge).ends;
            silhouette.then(|| shadow_of_edge(apex, ends, &plate.plane, plate.reach)).flatten()
        };
        if lamp.is_sharp() {
            let on_face = |edge: u32| clip_to_triangle(thrown(edge, apex)?, plate.corners);
            let parts: Vec<Part> = edges.into_iter().filter_map(on_face).collect();
            for &part in &parts {
                let error = 0.5 * plate.jump(part, light);
                let pays =
                    |error: f64, part: Part| least.is_none_or(|least| removes(error, length(part)) >= least);
                if pays(error, part) || parts.len() > MOST_CROSSING {
                    add(part, LineKind::Sharp, error);
                    continue;
                }
                // What borders a pinhole's spot is a short piece of a long edge's shadow
                for piece in between_crossings(part, &parts).filter(|&piece| pays(0.5 * most, piece)) {
                    add(piece, LineKind::Sharp, 0.5 * plate.jump_at(0.5, piece, light));
                }
            }
            return;
        }
        for edge in edges {
            let Some(borders) = lamp.tangents(self.edges.edge(edge).ends) else { continue };
            let borders = borders.map(|apex| thrown(edge, apex));
            for (border, other) in [(borders[0], borders[1]), (borders[1], borders[0])] {
                let (Some(border), Some(other)) = (border, other) else { continue };
                if let Some(part) = clip_to_triangle(border, plate.corners) {
                    add(part, LineKind::Shadow, plate.bend(part, other, light));
                }
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

impl Plate {
    /// The largest jump of light across a line, over the channels, W/m².
    fn jump(&self, part: Part, light: &mut impl FnMut(DVec3) -> DVec3) -> f64 {
        PROBES.into_iter().map(|t| self.jump_at(t, part, light)).fold(0.0, f64::max)
    }

    /// The jump of light at a share of a line's length, over the channels, W/m².
    fn jump_at(&self, t: f64, part: Part, light: &mut impl FnMut(DVec3) -> DVec3) -> f64 {
        let [from, to] = part.map(|weights| self.at(weights));
        let across = BESIDE * self.reach * self.plane.normal.cross(to - from).normalize_or_zero();
        let middle = from.lerp(to, t);
        rms(light(middle - across) - light(middle + across))
    }

    /// By how much light on a line differs from the mean of what it is a penumbra's width to either side, at most.
    ///
    /// `other`: the penumbra's other border.
    fn bend(&self, part: Part, other: [DVec3; 2], light: &mut impl FnMut(DVec3) -> DVec3) -> f64 {
        let [from, to] = part.map(|weights| self.at(weights));
        let along = (to - from).normalize_or_zero();
        let to_other = 0.5 * (other[0] + other[1]) - from;
        let across = to_other - along * along.dot(to_other);
        let mut bend_at = |t: f64| {
            let middle = from.lerp(to, t);
            0.25 * rms(light(middle - across) + light(middle + across) - 2.0 * light(middle))
        };
        PROBES_OF_SOFT.into_iter().map(&mut bend_at).fold(0.0, f64::max)
    }
}

/// The pieces of a line between those that cross it or end on it: all of one piece lies in the same shadows.
fn between_crossings(part: Part, others: &[Part]) -> impl Iterator<Item = Part> {
    let flat = |weights: DVec3| DVec2::new(weights.y, weights.z);
    let from = flat(part[0]);
    let along = flat(part[1]) - from;
    let mut crossings: SmallVec<[f64; 8]> = smallvec![0.0, 1.0];
    for other in others {
        let start = flat(other[0]) - from;
        let across = flat(other[1]) - flat(other[0]);
        let turn = along.perp_dot(across);
        let [t, u] = [start.perp_dot(across) / turn, start.perp_dot(along) / turn];
        // Of parallel lines, neither is a number between 0 and 1
        if (-BESIDE..=1.0 + BESIDE).contains(&u) && t > 0.0 && t < 1.0 {
            crossings.push(t);
        }
    }
    crossings.sort_unstable_by(f64::total_cmp);
    let ends = crossings.into_iter().map(move |t| part[0].lerp(part[1], t));
    let next = ends.clone().skip(1);
    ends.zip(next).map(|(from, to)| [from, to])
}

/// The squared error that a line removes, about, W²/m²: without it the light is off by `error` in elements as wide as the
/// line is long, before anything is refined; and however narrow a penumbra is, nothing less than its width will do.
fn removes(error: f64, length: f64) -> f64 {
    (error * length).powi(2)
}
