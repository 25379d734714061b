//! Whose shadow boundaries are looked for: emitters, and the surfaces that reflect enough of their light (the paper,
//! §3.2: "primary lightsources and strong secondary lightsources").

use glam::DVec3;
use smallvec::SmallVec;

use crate::adapt::line_choice::ENDS;
use crate::shadow::silhouette::BlockerEdges;
use crate::shadow::wedge::{WedgeId, WedgeKind};
use crate::transport::gather::rms;
use crate::transport::secondary::Reflector;
use crate::transport::source_tree::LitPolygon;

/// Most pairs of a secondary source and a face that are looked at, the strongest sources first. Most pairs cost less than
/// a microsecond, so that the search stays below the exchange of light between the same surfaces: of thousands of
/// faces some dozens are searched as sources, of hundreds all that could matter.
const MOST_PAIRS: usize = 300_000;

/// A polygon that sends light, and the parts of its border that throw lines.
#[derive(Debug, Clone)]
pub(crate) struct LineSource {
    pub(crate) lit: LitPolygon,
    /// Per edge: whether the light ends there. Where a flat surface goes on behind an edge, the next polygon takes over
    /// what this one loses.
    border: SmallVec<[bool; 4]>,
}

impl LineSource {
    /// An emitter.
    pub(crate) fn emitter(lit: &LitPolygon) -> Self {
        Self { border: SmallVec::from_elem(true, lit.polygon.vertices().len()), lit: lit.clone() }
    }

    /// Whether something changes across a wedge of this source.
    pub(super) fn throws(&self, wedge: WedgeId) -> bool {
        let (count, edge) = (self.border.len(), wedge.source as usize);
        match wedge.kind {
            WedgeKind::EdgeVertex => self.border[edge],
            WedgeKind::VertexEdge => self.border[edge] && self.border[(edge + count - 1) % count],
            WedgeKind::Face => true,
        }
    }
}

/// The secondary sources whose lines could be worth drawing, the strongest first.
///
/// All form factors from a source to whatever it lights sum to its area (reciprocity), and a line that is left out errs
/// by at most half of the form factor. So nothing is left that removes as much as the ends of a line must.
///
/// `brightest`: the largest share of arriving light that is shown anywhere, per channel. `least`: squared error that a
/// vertex must remove, W²/m². `faces`: those that lines are looked for on.
pub(crate) fn secondary_sources(
    reflectors: &[Reflector],
    edges: &BlockerEdges,
    brightest: DVec3,
    least: f64,
    faces: usize,
) -> Vec<LineSource> {
    let mut strong: Vec<(f64, LineSource)> = Vec::new();
    for (index, reflector) in reflectors.iter().enumerate() {
        for (radiosity, flipped) in reflector.radiosity.into_iter().zip([false, true]) {
            let error = 0.5 * rms(brightest * radiosity);
            let removes = error * error * reflector.polygon.area();
            if removes > 0.0 && removes >= ENDS * least {
                strong.push((removes, whole_source(reflectors, edges, index, radiosity, flipped)));
            }
        }
    }
    // Stable, so that equals keep the order of the scene.
    strong.sort_by(|a, b| b.0.total_cmp(&a.0));
    strong.truncate(MOST_PAIRS / faces.max(1));
    strong.into_iter().map(|(_, source)| source).collect()
}

fn whole_source(
    reflectors: &[Reflector],
    edges: &BlockerEdges,
    index: usize,
    radiosity: DVec3,
    flipped: bool,
) -> LineSource {
    let Reflector { polygon, material, .. } = &reflectors[index];
    let goes_on = |edge: u32| {
        let sharing = &edges.edge(edge).polygons;
        edges.is_flat(edge) && sharing.iter().all(|&p| reflectors[p as usize].material == *material)
    };
    let mut border: SmallVec<[bool; 4]> =
        edges.edges_of(index as u32).iter().map(|&edge| !goes_on(edge)).collect();
    let polygon = if flipped {
        // Backwards, edge k runs from vertex n-1-k to n-2-k.
        border.reverse();
        border.rotate_left(1);
        polygon.flipped()
    } else {
        polygon.clone()
    };
    LineSource { lit: LitPolygon { polygon, radiosity }, border }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::visibility::ConvexPolygon;

    fn square(x: f64, material: u32, radiosity: [f64; 2]) -> Reflector {
        let at = |x: f64, y: f64| DVec3::new(x, y, 0.0);
        let corners = [at(x, 0.0), at(x + 1.0, 0.0), at(x + 1.0, 1.0), at(x, 1.0)];
        let polygon = ConvexPolygon::new(&corners).expect("a square has an area");
        Reflector { polygon, material, radiosity: radiosity.map(DVec3::splat) }
    }

    fn sources(reflectors: &[Reflector], least: f64) -> Vec<LineSource> {
        let polygons: Vec<ConvexPolygon> = reflectors.iter().map(|r| r.polygon.clone()).collect();
        secondary_sources(reflectors, &BlockerEdges::new(&polygons), DVec3::ONE, least, 1)
    }

    #[test]
    fn a_side_that_cannot_remove_the_price_of_a_line_is_no_source() {
        // (4/2)² · 1 m² against two vertices
        let found = sources(&[square(0.0, 0, [4.0, 1.0])], 1.9);
        assert_eq!(found.len(), 1);
        assert!(found[0].lit.polygon.normal().z > 0.0);
        assert!(sources(&[square(0.0, 0, [4.0, 1.0])], 2.1).is_empty());
        assert!(sources(&[square(0.0, 0, [0.0, 0.0])], 0.0).is_empty());
    }

    /// Two squares side by side: their common edge is a border only where the material changes.
    #[test]
    fn inside_a_flat_surface_nothing_throws_lines() {
        let inner = |source: &LineSource| {
            let vertices = source.lit.polygon.vertices();
            (0..4_usize)
                .filter(|&k| vertices[k].x == 1.0 && vertices[(k + 1) % 4].x == 1.0)
                .map(|k| WedgeId { kind: WedgeKind::EdgeVertex, source: k as u32, blocker: 0 })
                .next()
                .expect("an edge is there")
        };
        for (materials, ends) in [([0, 0], false), ([0, 1], true)] {
            let surface = [square(0.0, materials[0], [3.0, 2.0]), square(1.0, materials[1], [1.0, 4.0])];
            let found = sources(&surface, 0.0);
            assert_eq!(found.len(), 4);
            for source in &found {
                assert_eq!(source.throws(inner(source)), ends);
                let thrown = (0..4).filter(|&k| {
                    source.throws(WedgeId { kind: WedgeKind::VertexEdge, source: k, blocker: 0 })
                });
                assert_eq!(thrown.count(), if ends { 4 } else { 2 }, "corners that are corners");
            }
        }
    }
}
