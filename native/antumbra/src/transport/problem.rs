//! What is to be solved: a scene, what emits in it and what hides it, and what is asked for.

use crate::monitor::Monitor;
use crate::scene::world::World;
use crate::settings::Settings;
use crate::transport::form_factors::FormFactors;
use crate::transport::gather::{Gather, Lit};
use crate::transport::sources::Emitters;

/// What every way of exchanging light starts from and does not change.
#[derive(Clone, Copy)]
pub(crate) struct Problem<'a> {
    pub(crate) world: &'a World,
    pub(crate) settings: &'a Settings,
    pub(crate) monitor: &'a Monitor,
    pub(crate) form_factors: &'a FormFactors<'a>,
    pub(crate) emitters: &'a Emitters,
}

/// When to leave it at what is known.
type Ends<'a> = &'a (dyn Fn() -> bool + Sync);

impl<'a> Problem<'a> {
    /// Gathers from some sources; `wanted_error`: rms, W/m².
    pub(crate) fn gather<'g>(self, sources: Lit<'g>, wanted_error: f64, ends: Ends<'g>) -> Gather<'g>
    where
        'a: 'g,
    {
        Gather { form_factors: self.form_factors, monitor: self.monitor, sources, wanted_error, ends }
    }

    /// The same from all that emits.
    pub(crate) fn gather_direct<'g>(self, wanted_error: f64, ends: Ends<'g>) -> Gather<'g>
    where
        'a: 'g,
    {
        self.gather(Lit::Sources(&self.emitters.tree), wanted_error, ends)
    }
}
