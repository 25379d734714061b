//! The ways to exchange light, behind one front.

use glam::DVec3;

use crate::adapt::patch_light::PatchLight;
use crate::display::Light;
use crate::report::TransportSummary;
use crate::transport::gather::Reflected;
use crate::transport::hierarchical::Hierarchical;
use crate::transport::looking::Looking;
use crate::transport::secondary::Reflector;
use crate::transport::shooting::Shooting;
use crate::visibility::Receiver;

/// A solution on its way.
pub(crate) enum Solution<'a> {
    Shooting(Box<Shooting<'a>>),
    Hierarchical(Box<Hierarchical<'a>>),
    Looking(Box<Looking<'a>>),
}

impl Solution<'_> {
    /// The error that the user wants, W/m².
    pub(crate) fn wanted_error(&self) -> f64 {
        match self {
            Self::Shooting(shooting) => shooting.wanted_error(),
            Self::Hierarchical(hierarchical) => hierarchical.wanted_error(),
            Self::Looking(looking) => looking.wanted_error(),
        }
    }

    /// Whether no emitter is known to light what is baked.
    pub(crate) fn is_dark(&self) -> bool {
        match self {
            Self::Shooting(shooting) => shooting.is_dark(),
            Self::Hierarchical(hierarchical) => hierarchical.is_dark(),
            Self::Looking(looking) => looking.is_dark(),
        }
    }

    /// What whole faces reflect of the emitters' light.
    pub(crate) fn reflectors(&self) -> Vec<Reflector> {
        match self {
            Self::Shooting(shooting) => shooting.reflectors(),
            Self::Hierarchical(hierarchical) => hierarchical.reflectors(),
            // Of thousands of faces, none is strong.
            Self::Looking(_) => Vec::new(),
        }
    }

    /// Direct light at the first samples of the display mesh that is known, front, W/m².
    pub(crate) fn direct_at(&self, samples: usize) -> Vec<DVec3> {
        match self {
            Self::Shooting(shooting) => shooting.direct_at(samples),
            Self::Hierarchical(_) | Self::Looking(_) => Vec::new(),
        }
    }

    /// Indirect light at the first samples of the display mesh that is known, front, W/m².
    pub(crate) fn indirect_at(&self, samples: usize) -> Vec<DVec3> {
        match self {
            Self::Shooting(shooting) => shooting.indirect_at(samples),
            Self::Hierarchical(_) | Self::Looking(_) => Vec::new(),
        }
    }

    /// Whether it can tell about what arrives anywhere, from its patches.
    pub(crate) fn knows_all(&self) -> bool {
        matches!(self, Self::Looking(_))
    }

    /// About what arrives at a place on a surface: what its patch gets, W/m²; nothing where that is not known.
    pub(crate) fn about(&self, light: Light, place: &Receiver) -> DVec3 {
        match self {
            Self::Shooting(_) | Self::Hierarchical(_) => DVec3::ZERO,
            Self::Looking(looking) => looking.about(light, place),
        }
    }

    /// What surfaces reflect.
    pub(crate) fn lit(&self) -> Reflected<'_> {
        match self {
            Self::Shooting(shooting) => Reflected::Sources(shooting.lit()),
            Self::Hierarchical(hierarchical) => Reflected::Sources(hierarchical.lit()),
            Self::Looking(looking) => looking.lit(),
        }
    }

    /// What patches know of the light on the faces that they lie on, where they looked around.
    pub(crate) fn patch_light(&self) -> Option<PatchLight> {
        match self {
            Self::Shooting(_) | Self::Hierarchical(_) => None,
            Self::Looking(looking) => Some(looking.patch_light()),
        }
    }

    /// What the indirect light must be scaled by to hold the light that was never sent.
    pub(crate) fn closing_factor(&self) -> DVec3 {
        match self {
            Self::Shooting(shooting) => shooting.closing_factor(),
            Self::Hierarchical(_) | Self::Looking(_) => DVec3::ONE,
        }
    }

    /// Share of all light that has not arrived yet.
    pub(crate) fn remaining(&self) -> f64 {
        match self {
            Self::Shooting(shooting) => shooting.remaining(),
            Self::Hierarchical(hierarchical) => hierarchical.remaining(),
            Self::Looking(looking) => looking.remaining(),
        }
    }

    /// Sources that have sent their light one by one.
    pub(crate) fn shots(&self) -> usize {
        match self {
            Self::Shooting(shooting) => shooting.shots,
            Self::Hierarchical(_) | Self::Looking(_) => 0,
        }
    }

    /// For the report.
    pub(crate) fn summary(&self) -> TransportSummary {
        match self {
            Self::Shooting(shooting) => shooting.summary(),
            Self::Hierarchical(hierarchical) => hierarchical.summary(),
            Self::Looking(looking) => looking.summary(),
        }
    }
}
