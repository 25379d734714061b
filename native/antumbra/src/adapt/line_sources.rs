//! Whose shadow boundaries are looked for: emitters, and the surfaces that reflect enough of their light (the paper,
//! §3.2: "primary lightsources and strong secondary lightsources").

use glam::DVec3;
use rayon::prelude::*;
use smallvec::SmallVec;

use crate::index::FaceId;
use crate::scene::world::World;
use crate::shadow::silhouette::BlockerEdges;
use crate::shadow::wedge::{WedgeId, WedgeKind};
use crate::transport::form_factors::faces;
use crate::transport::gather::rms;
use crate::transport::secondary::Reflector;
use crate::transport::source_tree::LitPolygon;
use crate::visibility::{Receiver, unoccluded_form_factor};

/// Most pairs of a secondary source and a face that are looked at, the strongest sources first: of thousands of faces
/// none is searched as a source, of fifty all that could matter. It bounds the search and is no result of a sweep; at
/// 20,000 the search in a room with four finely tessellated balls took minutes before the first shot.
const MOST_PAIRS: usize = 2_000;

/// A polygon that sends light, and the parts of its border that throw lines.
#[derive(Debug, Clone)]
pub(crate) struct LineSource {
    pub(crate) lit: LitPolygon,
    /// Per edge: whether the light ends there. Where a flat surface goes on behind an edge, the next polygon takes over
    /// what this one loses.
    border: SmallVec<[bool; 4]>,
    /// The integral of the squared error that no line of it removes more of, W²/m².
    pub(super) most: f64,
}

impl LineSource {
    /// An emitter.
    pub(crate) fn emitter(lit: &LitPolygon) -> Self {
        let border = SmallVec::from_elem(true, lit.polygon.vertices().len());
        Self { lit: lit.clone(), border, most: f64::INFINITY }
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

/// What reflects light, the strongest first.
///
/// All form factors from a source to whatever it lights sum to its area (reciprocity), and a line that is left out errs
/// by at most half of the form factor: that bounds what it could remove.
///
/// `brightest`: the largest share of arriving light that is shown anywhere, per channel. `faces`: how many faces lines
/// are looked for on.
pub(crate) fn secondary_sources(
    reflectors: &[Reflector],
    edges: &BlockerEdges,
    brightest: DVec3,
    faces: usize,
) -> Vec<LineSource> {
    let mut strong: Vec<LineSource> = Vec::new();
    for (index, reflector) in reflectors.iter().enumerate() {
        for (radiosity, flipped) in reflector.radiosity.into_iter().zip([false, true]) {
            let error = 0.5 * rms(brightest * radiosity);
            let most = error * error * reflector.polygon.area();
            if most > 0.0 {
                let (lit, border) = whole_source(reflectors, edges, index, radiosity, flipped);
                strong.push(LineSource { lit, border, most });
            }
        }
    }
    // Stable, so that equals keep the order of the scene.
    strong.sort_by(|a, b| b.most.total_cmp(&a.most));
    strong.truncate(MOST_PAIRS / faces.max(1));
    strong
}

/// Mean radiosity that sources bring to what is baked if nothing blocks them, over the channels, W/m².
pub(crate) fn mean_brought(world: &World, shown: &[DVec3], sources: &[LineSource]) -> f64 {
    let baked: Vec<FaceId> =
        FaceId::range(0..world.faces.len()).filter(|&face| world.receives(face)).collect();
    let brought = |&id: &FaceId| {
        let face = &world.faces[id.index()];
        let [a, b, c] = world.corners(face);
        let receiver = Receiver::new((a + b + c) / 3.0, face.normal);
        let arriving: DVec3 = (sources.iter())
            .filter(|source| faces(&receiver, &source.lit.polygon))
            .map(|source| unoccluded_form_factor(&receiver, &source.lit.polygon) * source.lit.radiosity)
            .sum();
        face.area * (shown[face.material as usize] * arriving).element_sum() / 3.0
    };
    // Summed in the order of the faces, whatever the threads.
    let power: Vec<f64> = baked.par_iter().map(brought).collect();
    let area: f64 = baked.iter().map(|face| world.faces[face.index()].area).sum();
    if area > 0.0 { power.iter().sum::<f64>() / area } else { 0.0 }
}

/// A side of a reflector, and where its border is one.
fn whole_source(
    reflectors: &[Reflector],
    edges: &BlockerEdges,
    index: usize,
    radiosity: DVec3,
    flipped: bool,
) -> (LitPolygon, SmallVec<[bool; 4]>) {
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
    (LitPolygon { polygon, radiosity }, border)
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

    fn sources(reflectors: &[Reflector]) -> Vec<LineSource> {
        let polygons: Vec<ConvexPolygon> = reflectors.iter().map(|r| r.polygon.clone()).collect();
        secondary_sources(reflectors, &BlockerEdges::new(&polygons), DVec3::ONE, 1)
    }

    #[test]
    fn both_sides_are_sources_the_stronger_one_first_and_the_dark_are_none() {
        let found = sources(&[square(0.0, 0, [2.0, 4.0]), square(5.0, 0, [0.0, 0.0])]);
        // (4/2)² and (2/2)² over 1 m²
        assert_eq!(found.iter().map(|source| source.most).collect::<Vec<_>>(), [4.0, 1.0]);
        assert_eq!(found.iter().map(|source| source.lit.polygon.normal().z).collect::<Vec<_>>(), [-1.0, 1.0]);
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
            let found = sources(&surface);
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
