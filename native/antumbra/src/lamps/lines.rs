//! What the search for shadows' borders asks of a lamp.

use glam::DVec3;

use crate::lamps::{AROUND, Kind, Lamp};
use crate::shadow::sharp::Apex;
use crate::transport::source_tree::LitPolygon;
use crate::visibility::screens::Body;
use crate::visibility::shaft::{Shaft, TRIANGLE_EDGES, box_corners};

impl Lamp {
    /// Where the middle of it is, if it is round or far away and casts shadows.
    pub(crate) fn apex(&self) -> Option<Apex> {
        match &self.kind {
            Kind::Sun { towards, .. } => Some(Apex::Direction(*towards)),
            Kind::Round { centre, .. } => Some(Apex::Point(*centre)),
            Kind::Panel { .. } => None,
        }
        .filter(|_| self.casts_shadows)
    }

    /// Whether all of its light comes from its [`Self::apex`].
    pub(crate) fn is_sharp(&self) -> bool {
        matches!(&self.kind, Kind::Sun { disc: None, .. } | Kind::Round { radius: 0.0, .. })
    }

    /// Points or directions of it in the two planes through an edge that touch it; none when the edge's line meets it.
    pub(crate) fn tangents(&self, [from, to]: [DVec3; 2]) -> Option<[Apex; 2]> {
        let along = (to - from).try_normalize()?;
        match &self.kind {
            Kind::Sun { towards, disc: Some(disc), .. } => {
                // On the plane of the disc, one away: tangents of a circle from where the edge's direction meets it, at
                // infinity for an edge that is square to the sun
                let radius = (disc.share / (1.0 - disc.share)).sqrt();
                let ahead = along.dot(*towards);
                let aside = along - ahead * towards;
                let axis = (aside * ahead.signum()).try_normalize()?;
                let sine = radius * ahead.abs() / aside.length();
                let cosine = (1.0 - sine * sine).sqrt();
                let across = towards.cross(axis);
                let touching = [1.0, -1.0].map(|side| radius * (sine * axis + side * cosine * across));
                (cosine > 0.0).then(|| touching.map(|way| Apex::Direction((towards + way).normalize())))
            }
            Kind::Round { centre, radius, faces_receiver, .. } => {
                let to_centre = centre - from;
                let aside = to_centre - along * along.dot(to_centre);
                let axis = aside.try_normalize()?;
                let sine = radius / aside.length();
                let across = along.cross(axis);
                // A disc that faces the edge, or a sphere, whose tangents touch it before its middle
                let cosine = (1.0 - sine * sine).sqrt();
                let touching = |side: f64| {
                    if *faces_receiver {
                        centre + side * radius * across
                    } else {
                        centre + radius * (side * cosine * across - sine * axis)
                    }
                };
                (cosine > 0.0).then(|| [1.0, -1.0].map(|side| Apex::Point(touching(side))))
            }
            Kind::Sun { disc: None, .. } | Kind::Panel { .. } => None,
        }
    }

    /// The polygon that it is, if it is one for all receivers and casts shadows.
    pub(crate) fn panel(&self) -> Option<LitPolygon> {
        match &self.kind {
            Kind::Panel { polygon, exitance, .. } if self.casts_shadows => {
                Some(LitPolygon { polygon: polygon.clone(), radiosity: *exitance })
            }
            _ => None,
        }
    }

    /// No irradiance within a distance of a place is larger, W/m². Of lamps with an [`Self::apex`].
    pub(crate) fn most_to(&self, place: DVec3, within: f64) -> DVec3 {
        match &self.kind {
            Kind::Sun { irradiance, .. } => irradiance.abs(),
            Kind::Round { centre, intensity, .. } => {
                let nearest = (centre.distance(place) - within).max(0.0);
                (intensity.abs() / (nearest * nearest)).min(DVec3::splat(f64::MAX))
            }
            Kind::Panel { exitance, .. } => exitance.abs(),
        }
    }

    /// What holds all of it, where it is somewhere and everything blocks its light.
    pub(crate) fn body(&self) -> Body {
        if !self.casts_shadows || self.blockers.is_some() {
            return None;
        }
        match &self.kind {
            Kind::Sun { .. } => None,
            Kind::Round { centre, radius, .. } => {
                let around = AROUND * radius * DVec3::ONE;
                Some(box_corners(centre - around, centre + around).into_iter().collect())
            }
            Kind::Panel { polygon, .. } => Some(polygon.vertices().iter().copied().collect()),
        }
    }

    /// What blocks between a flat triangle and the lamp lies in here.
    pub(crate) fn shaft_of_triangle(&self, corners: [DVec3; 3], normal: DVec3) -> Shaft {
        let [a, b, c] = corners;
        match &self.kind {
            Kind::Sun { towards, disc, .. } => {
                let cone = disc.as_ref().map_or(std::slice::from_ref(towards), |disc| &disc.cone);
                Shaft::along(&corners, &TRIANGLE_EDGES, cone, self.reach, Some((a, normal)))
            }
            Kind::Round { .. } | Kind::Panel { .. } => {
                self.shaft(a.min(b).min(c), a.max(b).max(c)).capped(a, normal)
            }
        }
    }
}
