//! What filters cover of the visible part of a source: surfaces that let a share of the light through.
//!
//! Where opaque blockers are subtracted, filters divide: the part that one covers is kept, with its share of the light.
//! Shares multiply, so that neither the order nor the number of filters matters.

use glam::DVec3;

use super::clip::{Fragments, Plane};

/// Parts of a source behind filters, together where the same share gets through.
#[derive(Debug, Default)]
pub(super) struct Filtered {
    /// Those in use, then others for later.
    layers: Vec<(DVec3, Fragments)>,
    used: usize,
    /// What one filter covers, and what gets through each of it.
    covered: Fragments,
    shares: Vec<DVec3>,
}

impl Filtered {
    /// Nothing is covered yet.
    pub(super) fn restart(&mut self) {
        self.used = 0;
    }

    /// How many fragments are covered.
    pub(super) fn len(&self) -> usize {
        self.layers[..self.used].iter().map(|(_, fragments)| fragments.len()).sum()
    }

    /// The share that gets through, per channel, and the outlines of which it does.
    pub(super) fn layers(&self) -> impl Iterator<Item = (DVec3, &Fragments)> {
        self.layers[..self.used].iter().map(|(share, fragments)| (*share, fragments))
    }

    /// Covers what lies inside all of `planes`, of the `clear` fragments and of those behind other filters; whether that
    /// is anything.
    pub(super) fn cover(&mut self, clear: &mut Fragments, planes: &[Plane], transmittance: DVec3) -> bool {
        let Self { layers, used, covered, shares } = self;
        covered.clear();
        shares.clear();
        let mut cover = |fragments: &mut Fragments, share: DVec3| {
            fragments.take(planes, |outline| {
                covered.add(outline);
                shares.push(share);
            });
        };
        cover(clear, transmittance);
        for (share, fragments) in &mut layers[..*used] {
            cover(fragments, *share * transmittance);
        }
        for (outline, &share) in covered.outlines().zip(shares.iter()) {
            let known = layers[..*used].iter().position(|(known, _)| *known == share);
            let layer = known.unwrap_or_else(|| {
                if *used == layers.len() {
                    layers.push((share, Fragments::default()));
                }
                layers[*used].0 = share;
                layers[*used].1.clear();
                *used += 1;
                *used - 1
            });
            layers[layer].1.add(outline);
        }
        !shares.is_empty()
    }
}
