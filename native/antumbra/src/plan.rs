//! What a scene does not need: named, with the reason, for the report. Whatever is left out can be done anyway, so that
//! tests can tell what it would have changed.

use std::f64::consts::FRAC_PI_4;

use glam::DVec3;

use crate::report::{Kind, LeftOut, VisibilitySummary};
use crate::scene::world::World;
use crate::scene::{LampInput, LampShape};
use crate::settings::Anyway;
use crate::transport::form_factors::{FormFactors, Shortcuts};
use crate::transport::sources::Emitters;
use crate::visibility::ConvexPolygon;

/// Distance from a plane, of the scene's size, up to which a point lies in it: far above the rounding of f32 coordinates,
/// and nothing that shallow sends light along it that could be noticed.
const IN_PLANE: f64 = 1e-6;

/// What leaving out the light of a second bounce may add to the rms error, at most, in wanted errors. What refinement leaves
/// is 0.4 for each kind of light, so that all of it stays below one.
const SLIGHT: f64 = 0.2;

/// What is left out of a bake.
#[derive(Debug)]
pub(crate) struct Plan {
    anyway: Anyway,
    /// Why surfaces bring each other no light, where they do not.
    no_reflection: Option<&'static str>,
    /// Per blocker: whether everything is on one side of it.
    outer_faces: Vec<bool>,
    /// Whether that is so of all blockers.
    nothing_hides: bool,
    /// What leaving it out may add to the rms error, in wanted errors, where it was.
    second_bounce: Option<f64>,
}

impl Plan {
    /// One look at the scene.
    pub(crate) fn new(
        world: &World,
        emitters: &Emitters,
        blockers: &[ConvexPolygon],
        anyway: Anyway,
    ) -> Self {
        let no_reflection = if emitters.around.is_some() {
            // What the sky sends is then found by looking around, like what surfaces send.
            None
        } else {
            no_reflection(world)
        };
        let outer_faces =
            if anyway.outer_faces { vec![false; blockers.len()] } else { outer_faces(world, blockers) };
        let nothing_hides = outer_faces.iter().all(|&outer| outer) && !anyway.open_visibility;
        Self { anyway, no_reflection, outer_faces, nothing_hides, second_bounce: None }
    }

    /// What form factors need not look at.
    pub(crate) fn shortcuts(&self) -> Shortcuts {
        Shortcuts {
            nothing_hides: self.nothing_hides && !self.anyway.occlusion,
            look_behind: self.anyway.facing_away,
        }
    }

    /// Whether anything may cast a shadow that has a boundary.
    pub(crate) fn looks_for_shadows(&self) -> bool {
        !self.nothing_hides || self.anyway.shadow_lines
    }

    /// Whether what surfaces reflect is too little to be exchanged.
    ///
    /// `bound`: of the rms of what that would bring, in wanted errors.
    pub(crate) fn leaves_out_second_bounce(&mut self, bound: f64) -> bool {
        self.second_bounce = (bound <= SLIGHT && !self.anyway.second_bounce).then_some(bound);
        self.second_bounce.is_some()
    }

    /// Whether surfaces bring each other no light.
    pub(crate) fn nothing_is_reflected(&self) -> bool {
        self.no_reflection.is_some()
    }

    /// Whether surfaces are to exchange what they reflect.
    pub(crate) fn exchanges(&self) -> bool {
        self.no_reflection.is_none() || self.anyway.reflection
    }

    /// Per blocker: whether it hides nothing from anything.
    pub(crate) fn hide_nothing(&self) -> Vec<bool> {
        self.outer_faces.clone()
    }

    /// What was left out, for the report.
    pub(crate) fn left_out(
        &self,
        visibility: &VisibilitySummary,
        form_factors: &FormFactors,
    ) -> Vec<LeftOut> {
        let mut all = Vec::new();
        let found = visibility.exact + visibility.sampled;
        if let Some(reason) = self.no_reflection.filter(|_| !self.exchanges()) {
            all.push(LeftOut::exact(
                "reflection",
                "the exchange of light between surfaces",
                reason,
                "all of it",
            ));
        }
        if visibility.open > 0 {
            all.push(LeftOut::exact(
                "open_visibility",
                "looking for what is visible of a source",
                "nothing stands between it and a surface",
                share(visibility.open, found, "form factors"),
            ));
        }
        if self.outer_faces.contains(&true) {
            let outer = self.outer_faces.iter().filter(|&&outer| outer).count();
            all.push(LeftOut::exact(
                "outer_faces",
                "looking for what faces hide",
                "everything is on one side of them",
                format!("{outer} of {} faces and quadrilaterals", self.outer_faces.len()),
            ));
        }
        let everything_outside = "everything is on one side of every face";
        if self.shortcuts().nothing_hides {
            all.push(LeftOut::exact(
                "occlusion",
                "looking for what could stand before a source",
                everything_outside,
                format!("all shafts of {} form factors", with_commas(found)),
            ));
        }
        if !self.looks_for_shadows() {
            all.push(LeftOut::exact(
                "shadow_lines",
                "the search for shadow boundaries",
                everything_outside,
                "all of it",
            ));
        }
        let [pairs, away] = form_factors.pairs();
        if away > 0 && !self.anyway.facing_away {
            all.push(LeftOut::exact(
                "facing_away",
                "the light from sources to points",
                "they face away from each other",
                share(away, pairs, "sources of groups of points"),
            ));
        }
        let [asked, hidden] = form_factors.blockers.screened();
        if hidden > 0 {
            all.push(LeftOut::exact(
                "screens",
                "the light and the shadows of sources",
                "a single polygon hides all of them from a group of points, or from a face",
                share(hidden, asked, "sources of groups of points and faces"),
            ));
        }
        all.extend(self.second_bounce.map(|bound| LeftOut {
            name: "second_bounce",
            what: "the exchange of light between surfaces",
            reason: "what they reflect is too little to be noticed".to_owned(),
            kind: Kind::Bounded,
            bound,
            saved: "all of it".to_owned(),
        }));
        all
    }
}

/// How much of something was left out.
fn share(part: u64, whole: u64, of: &str) -> String {
    let percent = 100.0 * part as f64 / whole as f64;
    format!("{} of {} {of} ({percent:.0} %)", with_commas(part), with_commas(whole))
}

/// A number as people read it.
fn with_commas(number: u64) -> String {
    let digits = number.to_string();
    let groups = digits.as_bytes().rchunks(3).rev().map(String::from_utf8_lossy);
    groups.collect::<Vec<_>>().join(",")
}

/// Why no light goes from surface to surface.
fn no_reflection(world: &World) -> Option<&'static str> {
    let reflects =
        |material: u32| world.materials[material as usize].reflectance_rgb.iter().any(|&rho| rho > 0.0);
    let Some(first) = world.faces.iter().find(|face| reflects(face.material)) else {
        return Some("no surface reflects any");
    };
    let [at, ..] = world.corners(first);
    let near = IN_PLANE * world.diagonal;
    let in_plane = |&point: &DVec3| first.normal.dot(point - at).abs() <= near;
    let mut corners = world.faces.iter().flat_map(|face| world.corners(face));
    corners.all(|corner| in_plane(&corner)).then_some("all surfaces lie in one plane")
}

/// Distance from a plane, of the scene's size, up to which a point is on both of its sides: where the kernel snaps.
const ON_PLANE: f64 = 1e-12;

/// Points that are looked at, at most: a sphere of a hundred thousand faces is the hull of as many points.
const MOST_LOOKS: usize = 20_000_000;

/// Which blockers have all surfaces and lights on one side: what goes in a straight line from one thing to another does not
/// pass them. A sun is on the side that all of it shines on.
fn outer_faces(world: &World, blockers: &[ConvexPolygon]) -> Vec<bool> {
    if world.sky.is_some() {
        // It is on both sides of everything.
        return vec![false; blockers.len()];
    }
    let suns: Vec<(DVec3, f64)> = world.lamps.iter().filter_map(sun).collect();
    let round = world.lamps.iter().filter_map(|lamp| match lamp.shape {
        LampShape::Point { position, radius, .. } => Some((position, AROUND * radius)),
        LampShape::Sun { .. } | LampShape::Panel { .. } => None,
    });
    let round: Vec<(DVec3, f64)> = round.collect();
    let flat = world.lamps.iter().filter(|lamp| matches!(lamp.shape, LampShape::Panel { .. }));
    let outlines =
        world.lights.iter().flat_map(|light| &light.outline).chain(flat.flat_map(LampInput::points));
    let points: Vec<DVec3> =
        world.faces.iter().flat_map(|face| world.corners(face)).chain(outlines.copied()).collect();
    let near = ON_PLANE * world.diagonal;
    let mut looks = 0;
    (blockers.iter())
        .map(|blocker| {
            let height = |point: DVec3| blocker.normal().dot(point - blocker.vertices()[0]);
            let (mut low, mut high) = (0.0_f64, 0.0_f64);
            let mut take = |height: f64, radius: f64| {
                low = low.min(height - radius);
                high = high.max(height + radius);
                looks += 1;
                looks < MOST_LOOKS && (low >= -near || high <= near)
            };
            let is_outer = points.iter().all(|&point| take(height(point), 0.0))
                && round.iter().all(|&(centre, radius)| take(height(centre), radius));
            let side = if low >= -near { 1.0 } else { -1.0 };
            is_outer && suns.iter().all(|&(towards, least)| side * blocker.normal().dot(towards) > least)
        })
        .collect()
}

/// Where the middle of a sun is, a unit vector, and how far above a plane, as a cosine, it must be for all of it to be.
fn sun(lamp: &LampInput) -> Option<(DVec3, f64)> {
    let LampShape::Sun { direction, angle, .. } = lamp.shape else { return None };
    let half = 0.5 * angle;
    let least = if half < FRAC_PI_4 { AROUND * half.tan() + GRAZING } else { f64::INFINITY };
    Some((direction.normalize(), least))
}

/// Cosine below which light grazes a plane: far above where the kernel snaps.
const GRAZING: f64 = 1e-6;

/// What holds something round, in radii: its polygon's corners are a little farther out.
const AROUND: f64 = 1.01;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_a_comma_for_every_thousand() {
        let all = [0, 999, 1_000, 28_757, 2_928_757].map(with_commas);
        assert_eq!(all, ["0", "999", "1,000", "28,757", "2,928,757"]);
    }
}
