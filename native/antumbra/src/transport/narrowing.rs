//! Form factors of all receivers of a cluster, from sources and from their parts: what may come between is looked for once
//! for all of them, and for a part among what may come between them and the whole.

use std::ops::Range;

use glam::DVec3;

use crate::transport::clusters::{Cluster, Clustered};
use crate::transport::form_factors::{
    ALWAYS_EXACT, Candidates, FormFactors, Found, Narrowed, Workspace, faces,
};
use crate::visibility::screens::{is_screened, screens};
use crate::visibility::shaft::{BOX_EDGES, Shaft};
use crate::visibility::{ConvexPolygon, Receiver, grey};

impl FormFactors<'_> {
    /// Finds what may come between a cluster and the parts of a source, if that is little; nothing when no receiver of
    /// the cluster faces it.
    pub(crate) fn narrow(
        &self,
        at: Clustered,
        source: &ConvexPolygon,
        known: Narrowed,
        workspace: &mut Workspace,
    ) -> Option<Narrowed> {
        if !self.may_light(at, source, workspace) {
            return None;
        }
        let Workspace { shared, narrowed, screened, .. } = workspace;
        if self.shortcuts.nothing_hides {
            let none = narrowed.len() as u32;
            return Some(Narrowed::Known { start: none, end: none });
        }
        if self.is_screened(at.cluster, source, known, narrowed, screened) {
            return None;
        }
        if let Narrowed::Known { start, end } = known {
            let Range { start, end } = self.narrow_further(at.cluster, source, start..end, narrowed);
            return Some(Narrowed::Known { start, end });
        }
        let shaft = Shaft::new(&at.cluster.corners, &BOX_EDGES, source, None);
        if self.blockers.hiding(&shaft, ALWAYS_EXACT, shared).is_err() {
            return Some(Narrowed::Unknown);
        }
        let start = narrowed.len() as u32;
        narrowed.extend_from_slice(shared);
        Some(Narrowed::Known { start, end: narrowed.len() as u32 })
    }

    /// Whether a single polygon hides all of a source from all of a cluster: one of those that may come between, where
    /// these are known, or one that stands between their middles.
    fn is_screened(
        &self,
        cluster: &Cluster,
        source: &ConvexPolygon,
        known: Narrowed,
        narrowed: &[u32],
        counts: &mut [u64; 2],
    ) -> bool {
        if !self.blockers.looks_for_screens() {
            return false;
        }
        let (from, to) = (&cluster.corners, source.vertices());
        let is_screened = match known {
            Narrowed::Unknown => is_screened(self.blockers, from, to),
            Narrowed::Known { start, end } => (narrowed[start as usize..end as usize].iter())
                .any(|&candidate| screens(self.blockers, candidate, from, to)),
        };
        counts[0] += 1;
        counts[1] += u64::from(is_screened);
        is_screened
    }

    /// What of the candidates for a source may come between a cluster and a part of it.
    fn narrow_further(
        &self,
        cluster: &Cluster,
        part: &ConvexPolygon,
        candidates: Range<u32>,
        narrowed: &mut Vec<u32>,
    ) -> Range<u32> {
        if candidates.len() <= 1 || self.blockers.takes_everything() {
            return candidates;
        }
        let (low, high) = cluster.bounds();
        let shaft = Shaft::of_boxes([low, high], part);
        let start = narrowed.len() as u32;
        for index in candidates {
            let candidate = narrowed[index as usize];
            if shaft.may_block(&self.blockers.polygons()[candidate as usize]) {
                narrowed.push(candidate);
            }
        }
        start..narrowed.len() as u32
    }

    /// What places bring to each receiver of a cluster, by one ray each, as discs of the area that each stands for
    /// (Wallace, Elmquist, Haines 1989): however near one is, it sends no more than the whole hemisphere can.
    ///
    /// `area`: of one of them, m².
    pub(crate) fn of_representatives(
        &self,
        at: Clustered,
        places: &[(DVec3, DVec3)],
        area: f64,
        mut found: impl FnMut(usize, Found),
    ) {
        let mut rays = 0;
        for k in 0..at.cluster.members.len() {
            let Receiver { position, normal, .. } = *at.receiver(k);
            let (mut open, mut value) = (0.0, DVec3::ZERO);
            for &(place, facing) in places {
                let to = place - position;
                let distance2 = to.length_squared();
                let cosines = normal.dot(to).max(0.0) * (-facing.dot(to)).max(0.0) / distance2;
                if cosines > 0.0 {
                    rays += 1;
                    let form_factor = area * cosines / (std::f64::consts::PI * distance2 + area);
                    open += form_factor;
                    value += form_factor * self.blockers.between(position, place);
                }
            }
            if open > 0.0 {
                let (filters, value) = (value, grey(value));
                let filter = if value > 0.0 { filters / value } else { DVec3::ONE };
                let noise = (value * (open - value) / places.len() as f64).sqrt();
                found(k, Found::of(value, filter, noise));
            }
        }
        if rays > 0 {
            self.count_rays(rays);
        }
    }

    /// The form factors of all receivers of a cluster that face a source.
    ///
    /// `known`: what was found for what the source is a part of. `found`: gets the receiver's number in the cluster.
    pub(crate) fn of_cluster(
        &self,
        at: Clustered,
        source: &ConvexPolygon,
        weight: f64,
        known: Narrowed,
        workspace: &mut Workspace,
        mut found: impl FnMut(usize, Found),
    ) {
        // Most clusters lie behind a source or face away from it.
        if !self.may_light(at, source, workspace) {
            return;
        }
        let Workspace { narrowed, screened, .. } = workspace;
        // Among few candidates the kernel finds it as soon.
        if matches!(known, Narrowed::Unknown)
            && !self.shortcuts.nothing_hides
            && self.is_screened(at.cluster, source, known, narrowed, screened)
        {
            return;
        }
        let mut shared = std::mem::take(&mut workspace.shared);
        let mut narrowed = std::mem::take(&mut workspace.narrowed);
        let before = narrowed.len();
        let candidates = match known {
            Narrowed::Known { start, end } => {
                let kept = self.narrow_further(at.cluster, source, start..end, &mut narrowed);
                Candidates::Shared(&narrowed[kept.start as usize..kept.end as usize])
            }
            Narrowed::Unknown => {
                self.candidates(|| Shaft::new(&at.cluster.corners, &BOX_EDGES, source, None), &mut shared)
            }
        };
        for k in 0..at.cluster.members.len() {
            let receiver = at.receiver(k);
            if faces(receiver, source) {
                found(k, self.visible(receiver, source, candidates, weight, at.seed(k), workspace));
            }
        }
        narrowed.truncate(before);
        workspace.shared = shared;
        workspace.narrowed = narrowed;
    }
}
