//! Lights as a receiver sees them: each a convex polygon, made for that receiver, or a single point.
//!
//! The sun is a polygon of directions, put beyond everything that blocks; something round turns towards its receiver; an
//! area light with a spread is cut to what reaches it. The kernel of [`crate::visibility`] then finds what is visible of
//! it, exactly; a point is visible or not. So the light of a disc past a blocker is that of a polygon with
//! [`round::SIDES`] sides that sends as much where nothing blocks.
//!
//! **Not modelled.** Inside a round light, all of the hemisphere shines and nothing blocks.

mod cone;
mod cube_map;
mod gather;
mod lines;
mod round;
mod sky;

use glam::DVec3;

pub(crate) use crate::lamps::sky::Sky;

use crate::lamps::cone::{Cone, Spread};
use crate::lamps::round::{corner_tangent, share_of_angle, spokes};
use crate::scene::world::World;
use crate::scene::{LampInput, LampShape};
use crate::transport::sources::blockers_among;
use crate::visibility::blockers::Blockers;
use crate::visibility::shaft::{BOX_EDGES, Shaft, box_corners};
use crate::visibility::{ConvexPolygon, Receiver, Weight, unoccluded_weighted};

/// Distance of what is far away, in diagonals of the scene: beyond all that blocks, and no farther than needed, since
/// coordinates are rounded to their size.
const BEYOND: f64 = 4.0;

/// What holds the polygon of something round, in radii: its corners are 0.3 % farther out than the disc.
const AROUND: f64 = 1.01;

/// A light that is not a surface.
#[derive(Debug)]
pub(crate) struct Lamp {
    kind: Kind,
    casts_shadows: bool,
    /// Per object, where not all are lit.
    lights: Option<Vec<bool>>,
    /// What blocks, where that is not everything.
    blockers: Option<Blockers>,
    /// Of what is far away, metres.
    reach: f64,
}

#[derive(Debug)]
enum Kind {
    Sun {
        /// Unit vector.
        towards: DVec3,
        /// Of what faces it, W/m².
        irradiance: DVec3,
        disc: Option<SunDisc>,
    },
    Round {
        centre: DVec3,
        radius: f64,
        faces_receiver: bool,
        /// W/sr.
        intensity: DVec3,
        cone: Option<Cone>,
    },
    Panel {
        polygon: ConvexPolygon,
        exitance: DVec3,
        spread: Option<Spread>,
    },
}

/// A sun that is not a point.
#[derive(Debug)]
struct SunDisc {
    /// As seen from the origin.
    polygon: ConvexPolygon,
    /// Share of the hemisphere that it fills straight ahead.
    share: f64,
    /// Four directions around it.
    cone: [DVec3; 4],
}

/// A lamp as a receiver sees it.
#[expect(clippy::large_enum_variant, reason = "it lives for the length of one look, on the stack")]
pub(crate) enum Sight<'a> {
    /// It sends nothing there.
    Dark,
    /// All around, whatever blocks; W/m².
    Around(DVec3),
    /// From one point, relative to the receiver; W/m² if nothing blocks.
    Point(DVec3, DVec3),
    /// From a polygon.
    Polygon(SeenPolygon<'a>),
}

/// A polygon that sends light to the side of its normal.
pub(crate) struct SeenPolygon<'a> {
    pub(crate) polygon: ConvexPolygon,
    /// W/m².
    pub(crate) exitance: DVec3,
    beam: Option<Beam<'a>>,
    /// Its form factor if nothing blocks, where that is known.
    open: Option<f64>,
}

/// Light that depends on its direction.
enum Beam<'a> {
    Cone(&'a Cone),
    Spread(&'a Spread, DVec3),
}

impl SeenPolygon<'_> {
    /// Uses what directions from the receiver are worth.
    fn with_weight<T>(&self, use_it: impl FnOnce(Option<Weight>) -> T) -> T {
        match &self.beam {
            None => use_it(None),
            Some(Beam::Cone(cone)) => use_it(Some(&|way| cone.keeps(-way))),
            Some(Beam::Spread(spread, normal)) => use_it(Some(&|way| spread.keeps(-way, *normal))),
        }
    }

    /// The form factor if nothing blocks, weighted.
    fn open(&self, receiver: &Receiver) -> f64 {
        self.open.unwrap_or_else(|| {
            self.with_weight(|weight| unoccluded_weighted(receiver, &self.polygon, weight))
        })
    }
}

impl Lamp {
    /// The lamps of a scene that send anything.
    pub(crate) fn all(world: &World) -> Vec<Self> {
        (world.lamps.iter())
            .filter(|lamp| lamp.strength_rgb() != [0.0; 3])
            .filter_map(|lamp| Self::new(lamp, world))
            .collect()
    }

    fn new(input: &LampInput, world: &World) -> Option<Self> {
        let reach = BEYOND * world.diagonal;
        let among = |linked: &Option<Vec<u32>>| {
            let mut is_linked = vec![false; world.objects.len()];
            linked.as_ref()?.iter().for_each(|&object| is_linked[object as usize] = true);
            Some(is_linked)
        };
        let kind = match &input.shape {
            LampShape::Sun { direction, angle, irradiance_rgb } => {
                let towards = direction.normalize();
                let disc = if *angle > 0.0 { Some(SunDisc::new(towards, 0.5 * angle, reach)?) } else { None };
                Kind::Sun { towards, irradiance: DVec3::from_array(*irradiance_rgb), disc }
            }
            LampShape::Point { position, radius, faces_receiver, intensity_rgb, cone } => Kind::Round {
                centre: *position,
                radius: *radius,
                faces_receiver: *faces_receiver,
                intensity: DVec3::from_array(*intensity_rgb),
                cone: cone.as_ref().map(Cone::new),
            },
            LampShape::Panel { outline, exitance_rgb, spread } => Kind::Panel {
                polygon: ConvexPolygon::new(outline)?,
                exitance: DVec3::from_array(*exitance_rgb),
                spread: Spread::new(*spread),
            },
        };
        let blocks = among(&input.blocking_objects);
        let blockers = blocks
            .map(|blocks| blockers_among(world, |face| blocks[world.faces[face.index()].object.index()]));
        let lights = among(&input.lit_objects);
        Some(Self { kind, casts_shadows: input.casts_shadows, lights, blockers, reach })
    }

    /// Whether it lights an object; what is on none it lights.
    pub(crate) fn lights(&self, object: u32) -> bool {
        self.lights.as_ref().is_none_or(|lights| lights.get(object as usize).is_none_or(|&lights| lights))
    }

    /// What it looks like from a receiver.
    pub(crate) fn seen_from(&self, receiver: &Receiver) -> Sight<'_> {
        if !self.lights(receiver.object) {
            return Sight::Dark;
        }
        match &self.kind {
            Kind::Sun { towards, irradiance, disc } => {
                self.sun(receiver, *towards, *irradiance, disc.as_ref())
            }
            Kind::Round { radius: 0.0, .. } => self.point(receiver),
            Kind::Round { .. } => self.disc(receiver),
            Kind::Panel { polygon, exitance, spread } => panel(receiver, polygon, *exitance, spread.as_ref()),
        }
    }

    fn sun(
        &self,
        receiver: &Receiver,
        towards: DVec3,
        irradiance: DVec3,
        disc: Option<&SunDisc>,
    ) -> Sight<'_> {
        let cosine = receiver.normal.dot(towards);
        let Some(disc) = disc else {
            return if cosine > 0.0 {
                Sight::Point(self.reach * towards, cosine * irradiance)
            } else {
                Sight::Dark
            };
        };
        let open = (cosine > AROUND * disc.share.sqrt()).then_some(cosine * disc.share);
        Sight::Polygon(SeenPolygon {
            polygon: disc.polygon.moved(receiver.position),
            exitance: irradiance / disc.share,
            beam: None,
            open,
        })
    }

    fn point(&self, receiver: &Receiver) -> Sight<'_> {
        let Kind::Round { centre, intensity, cone, .. } = &self.kind else { return Sight::Dark };
        let way = centre - receiver.position;
        let distance2 = way.length_squared();
        let cosine = receiver.normal.dot(way) / distance2.sqrt();
        let kept = cone.as_ref().map_or(1.0, |cone| cone.keeps(-way));
        if cosine > 0.0 && kept > 0.0 {
            Sight::Point(way, kept * cosine / distance2 * *intensity)
        } else {
            Sight::Dark
        }
    }

    fn disc(&self, receiver: &Receiver) -> Sight<'_> {
        let Kind::Round { centre, radius, faces_receiver, intensity, cone } = &self.kind else {
            return Sight::Dark;
        };
        let exitance = *intensity / (radius * radius);
        let way = centre - receiver.position;
        let distance = way.length();
        let height = receiver.normal.dot(way);
        if height <= -AROUND * radius || distance == 0.0 {
            return Sight::Dark;
        }
        let squared_ratio = (radius / distance).powi(2);
        // A sphere is seen as the disc inside the circle in which lines of sight touch it.
        let (middle, share) = if *faces_receiver {
            (*centre, squared_ratio / (1.0 + squared_ratio))
        } else {
            (centre - squared_ratio * way, squared_ratio)
        };
        if share >= 1.0 {
            let kept = cone.as_ref().map_or(1.0, |cone| cone.keeps(-way));
            return Sight::Around(kept * exitance);
        }
        let corner = corner_tangent(share) * middle.distance(receiver.position);
        let corners: Vec<DVec3> = spokes(-way / distance).map(|spoke| middle + corner * spoke).collect();
        let beam = match cone {
            None => None,
            Some(cone) => {
                let ways = || corners.iter().chain([&middle]).map(|&point| receiver.position - point);
                if ways().all(|way| cone.keeps(way) == 0.0) {
                    return Sight::Dark;
                }
                (!cone.keeps_all(ways())).then_some(Beam::Cone(cone))
            }
        };
        let above = receiver.normal.dot(middle - receiver.position) > corner;
        let open = (above && beam.is_none()).then_some(height / distance * share);
        match ConvexPolygon::new(&corners) {
            Some(polygon) => Sight::Polygon(SeenPolygon { polygon, exitance, beam, open }),
            // So far away that its corners are one by rounding
            None => self.point(receiver),
        }
    }

    /// What it brings to a receiver if nothing blocks, W/m².
    pub(crate) fn unblocked(&self, receiver: &Receiver) -> DVec3 {
        match self.seen_from(receiver) {
            Sight::Dark => DVec3::ZERO,
            Sight::Around(irradiance) | Sight::Point(_, irradiance) => irradiance,
            Sight::Polygon(seen) => seen.open(receiver) * seen.exitance,
        }
    }

    /// The most that it brings to any of some receivers if nothing blocks, per channel, W/m².
    pub(crate) fn brightest(&self, receivers: &[Receiver]) -> DVec3 {
        receivers.iter().fold(DVec3::ZERO, |most, receiver| most.max(self.unblocked(receiver).abs()))
    }

    /// Power that it sends into a scene of this surface area, about, W: what is far away sends it over a quarter of it,
    /// as much as a convex scene shows to any side on the mean.
    pub(crate) fn power(&self, surface_area: f64) -> DVec3 {
        match &self.kind {
            Kind::Sun { irradiance, .. } => 0.25 * surface_area * *irradiance,
            Kind::Round { intensity, .. } => 4.0 * std::f64::consts::PI * *intensity,
            Kind::Panel { polygon, exitance, .. } => polygon.area() * *exitance,
        }
    }

    /// What blocks between a box and the lamp lies in here.
    fn shaft(&self, low: DVec3, high: DVec3) -> Shaft {
        match &self.kind {
            Kind::Sun { towards, disc, .. } => {
                let cone = disc.as_ref().map_or(std::slice::from_ref(towards), |disc| &disc.cone);
                Shaft::along(&box_corners(low, high), &BOX_EDGES, cone, self.reach, None)
            }
            Kind::Round { centre, radius, .. } => {
                let around = AROUND * radius * DVec3::ONE;
                Shaft::between_boxes([low, high], [centre - around, centre + around])
            }
            Kind::Panel { polygon, .. } => Shaft::new(&box_corners(low, high), &BOX_EDGES, polygon, None),
        }
    }

    /// The same for one receiver and a lamp that is a point.
    fn tube(&self, receiver: &Receiver) -> Shaft {
        let at = receiver.position;
        match &self.kind {
            Kind::Sun { towards, .. } => {
                Shaft::along(&[at], &[], &[*towards], self.reach, Some((at, receiver.normal)))
            }
            Kind::Round { .. } | Kind::Panel { .. } => self.shaft(at, at),
        }
    }
}

fn panel<'a>(
    receiver: &Receiver,
    polygon: &ConvexPolygon,
    exitance: DVec3,
    spread: Option<&'a Spread>,
) -> Sight<'a> {
    if polygon.normal().dot(receiver.position - polygon.vertices()[0]) <= 0.0 {
        return Sight::Dark;
    }
    let Some(spread) = spread else {
        return Sight::Polygon(SeenPolygon { polygon: polygon.clone(), exitance, beam: None, open: None });
    };
    let normal = polygon.normal();
    match spread.reaches(polygon, receiver.position) {
        Some(polygon) => Sight::Polygon(SeenPolygon {
            polygon,
            exitance,
            beam: Some(Beam::Spread(spread, normal)),
            open: None,
        }),
        None => Sight::Dark,
    }
}

impl SunDisc {
    fn new(towards: DVec3, half_angle: f64, reach: f64) -> Option<Self> {
        let share = share_of_angle(half_angle);
        let tangent = corner_tangent(share);
        let corners: Vec<DVec3> = spokes(-towards).map(|spoke| reach * (towards + tangent * spoke)).collect();
        let (u, v) = towards.any_orthonormal_pair();
        let beside = AROUND * tangent;
        let cone = [u + v, v - u, -u - v, u - v].map(|corner| towards + beside * corner);
        Some(Self { polygon: ConvexPolygon::new(&corners)?, share, cone })
    }
}
