//! How much all that surfaces reflect could be: where that is little, it is left out.

use glam::DVec3;

use crate::display::{Display, Light, baked_area};
use crate::index::FaceId;
use crate::settings::Quantity;
use crate::transport::hierarchical::Hierarchical;

impl Hierarchical<'_> {
    /// A bound of the rms of what surfaces could show of what they reflect, by all bounces, W/m².
    ///
    /// All that arrives was reflected by something, and no more arrives in square than was sent: the exchange is symmetric, and
    /// no sum of form factors exceeds 1.
    pub(crate) fn most_reflected(&self, display: &Display) -> f64 {
        let world = self.problem.world;
        let squared = |rho: DVec3, h: DVec3| (rho * h).length_squared() / 3.0;
        let mut sent = 0.0;
        display.for_each_lit(Light::Direct, |face, places, values| {
            let rho = DVec3::from_array(world.material(face).reflectance_rgb);
            let [a, b, c] = places;
            // Barycentric coordinates span the triangle's share of its face.
            let area = world.faces[face.index()].area * a.dot(b.cross(c)).abs();
            // A linear function's square, by the middles of the edges
            let middles = [0, 1, 2].map(|k| 0.5 * (values[k] + values[(k + 1) % 3]));
            sent += area / 3.0 * middles.into_iter().map(|h| squared(rho, h)).sum::<f64>();
        });
        for (node, direct) in self.hierarchy.nodes.iter().zip(&self.direct).filter(|(node, _)| node.is_leaf())
        {
            let Some(surface) = self.hierarchy.surface(node).filter(|s| !self.is_displayed(s)) else {
                continue;
            };
            sent += node.area * squared(surface.reflectance, direct.most.max(direct.mean).max(DVec3::ZERO));
        }
        let most = self.hierarchy.nodes.iter().filter_map(|node| self.hierarchy.surface(node));
        let rho = most.map(|surface| surface.reflectance.max_element()).fold(0.0, f64::max);
        self.brightest_shown() * sent.sqrt() / (1.0 - rho) / baked_area(world).sqrt()
    }

    /// The largest share of arriving light that is shown anywhere, of any channel.
    fn brightest_shown(&self) -> f64 {
        if self.problem.settings.quantity == Quantity::Irradiance {
            return 1.0;
        }
        let world = self.problem.world;
        let shown = |face| DVec3::from_array(world.shown_material(face).reflectance_rgb).max_element();
        let baked = FaceId::range(0..world.faces.len()).filter(|&face| world.receives(face));
        baked.map(shown).fold(0.0, f64::max)
    }
}
