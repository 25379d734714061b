//! What a scene does not need: named, with the reason, for the report. Whatever is left out can be done anyway, so that
//! tests can tell what it would have changed.

use glam::DVec3;

use crate::report::{Kind, LeftOut, VisibilitySummary};
use crate::scene::world::World;
use crate::scene::{LampInput, LampShape};
use crate::settings::Anyway;
use crate::transport::sources::Emitters;
use crate::visibility::ConvexPolygon;

/// Distance from a plane, of the scene's size, up to which a point lies in it: far above the rounding of f32 coordinates,
/// and nothing that shallow sends light along it that could be noticed.
const IN_PLANE: f64 = 1e-6;

/// What is left out of a bake.
#[derive(Debug)]
pub(crate) struct Plan {
    anyway: Anyway,
    /// Why surfaces bring each other no light, where they do not.
    no_reflection: Option<&'static str>,
    /// Per blocker: whether everything is on one side of it.
    outer_faces: Vec<bool>,
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
        Self { anyway, no_reflection, outer_faces }
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
    pub(crate) fn left_out(&self, visibility: &VisibilitySummary) -> Vec<LeftOut> {
        let mut all = Vec::new();
        if let Some(reason) = self.no_reflection.filter(|_| !self.exchanges()) {
            all.push(LeftOut {
                name: "reflection",
                what: "the exchange of light between surfaces",
                reason: reason.to_owned(),
                kind: Kind::Exact,
                bound: 0.0,
                saved: "all of it".to_owned(),
            });
        }
        if visibility.open > 0 {
            let all_of_them = visibility.exact + visibility.sampled;
            all.push(LeftOut {
                name: "open_visibility",
                what: "looking for what is visible of a source",
                reason: "nothing stands between it and a surface".to_owned(),
                kind: Kind::Exact,
                bound: 0.0,
                saved: format!(
                    "{} of {all_of_them} form factors ({:.0} %)",
                    visibility.open,
                    100.0 * visibility.open as f64 / all_of_them as f64
                ),
            });
        }
        if self.outer_faces.contains(&true) {
            let outer = self.outer_faces.iter().filter(|&&outer| outer).count();
            all.push(LeftOut {
                name: "outer_faces",
                what: "looking for what faces hide",
                reason: "everything is on one side of them".to_owned(),
                kind: Kind::Exact,
                bound: 0.0,
                saved: format!("{outer} of {} faces and quadrilaterals", self.outer_faces.len()),
            });
        }
        all
    }
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
/// pass them.
fn outer_faces(world: &World, blockers: &[ConvexPolygon]) -> Vec<bool> {
    let endless = |lamp: &LampInput| matches!(lamp.shape, LampShape::Sun { .. });
    if world.sky.is_some() || world.lamps.iter().any(endless) {
        // What is far away is on the other side of something.
        return vec![false; blockers.len()];
    }
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
            points.iter().all(|&point| take(height(point), 0.0))
                && round.iter().all(|&(centre, radius)| take(height(centre), radius))
        })
        .collect()
}

/// What holds something round, in radii: its polygon's corners are a little farther out.
const AROUND: f64 = 1.01;
