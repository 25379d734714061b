//! All lines that faces are cut along before any refinement: contacts, and the shadow boundaries of what lights most.

use glam::DVec3;

use crate::adapt::contact_lines::contacts;
use crate::adapt::line_choice::{Lines, WORTH_A_VERTEX};
use crate::adapt::line_search::LineSearch;
use crate::adapt::line_sources::{LineSource, mean_brought, secondary_sources};
use crate::display::baked_area;
use crate::error::Error;
use crate::index::FaceId;
use crate::lamps::Lamp;
use crate::settings::Method;
use crate::shadow::silhouette::BlockerEdges;
use crate::transport::mode::Solution;
use crate::transport::problem::Problem;

/// Tolerance below which lines of a scene in which patches look around are not looked for: in an interior of 260,000
/// triangles it took 9 s of processor time at 5 % and 90 s at 1 %, a third of the bake.
const LINES_OF_CROWDS: f64 = 0.03;

/// What lines are looked for in.
pub(crate) struct SceneLines<'a> {
    pub(crate) problem: Problem<'a>,
    /// Per material: the share of arriving light that is shown, per channel.
    pub(crate) shown: &'a [DVec3],
    /// Of the wanted error, what the light of emitters and that of patches may be wrong by.
    pub(crate) shares: [f64; 2],
    /// Whether anything casts a shadow.
    pub(crate) looks_for_shadows: bool,
}

impl SceneLines<'_> {
    /// Contacts, and the shadow boundaries of emitters and of what reflects their light.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    pub(crate) fn find(&self, exchange: &Solution, ends: &(dyn Fn() -> bool + Sync)) -> Result<Lines, Error> {
        let Problem { world, settings, monitor, form_factors, emitters } = self.problem;
        let blockers = form_factors.blockers;
        let [share_of_emitters, share_of_patches] = self.shares;
        // Where no emitter is known to be seen there is no light that a line's would be little of: all that comes through a
        // pinhole lies between lines. Any that removes anything is then worth it.
        let worth_a_vertex = if exchange.is_dark() { f64::MIN_POSITIVE } else { WORTH_A_VERTEX };
        let worth = (settings.method == Method::Adm).then_some(worth_a_vertex);
        let mut wanted_error = exchange.wanted_error();
        let tolerance = match exchange {
            Solution::Looking(_) => settings.tolerance.max(LINES_OF_CROWDS),
            _ => settings.tolerance,
        };
        wanted_error *= tolerance / settings.tolerance;
        let edges = BlockerEdges::new(blockers.polygons());
        let search = |wanted_error: f64| {
            let allowed = wanted_error.powi(2) * baked_area(world);
            LineSearch {
                world,
                blockers,
                edges: &edges,
                monitor,
                ends,
                shown: self.shown,
                allowed,
                max_blockers: settings.max_blockers as usize,
                price: worth.map(|worth| worth * allowed),
            }
        };

        // The light jumps by about its mean across a contact, and without the line would be wrong over about its length
        // in square, or over what it parts from the face.
        let primary = search(share_of_emitters * wanted_error);
        let mean_radiosity = wanted_error / tolerance;
        let least_area = primary.price.map_or(0.0, |price| price / mean_radiosity.powi(2));
        let receives = |face| world.receives(face);
        let mut lines = Lines::new(contacts(world, blockers, receives, least_area.sqrt(), least_area), worth);
        if !self.looks_for_shadows {
            return Ok(lines);
        }
        let panels = emitters.tree.lamps.iter().filter_map(Lamp::panel);
        let lit = emitters.polygons.iter().cloned().chain(panels);
        let sources: Vec<LineSource> = lit.map(|lit| LineSource::emitter(&lit)).collect();
        lines.add(primary.find(&sources)?);
        lines.add(primary.find_of_lamps(&emitters.tree.lamps, form_factors)?);

        // Where no emitter is seen, all the light there is comes from these.
        let brightest = self.shown.iter().copied().fold(DVec3::ZERO, DVec3::max);
        let faces = FaceId::range(0..world.faces.len()).filter(|&face| receives(face)).count();
        let reflecting = secondary_sources(&exchange.reflectors(), &edges, brightest, faces);
        let mean_radiosity = mean_radiosity.max(mean_brought(world, self.shown, &reflecting));
        let secondary = search(share_of_patches * tolerance * mean_radiosity);
        lines.add(secondary.find(&reflecting)?);
        Ok(lines)
    }
}
