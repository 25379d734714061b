//! The test of the paper's §3.2: what a source and what stands before it do to an element, and so what is done to it.
//!
//! The paper asks the element's vertices only, and so misses a shadow that lies between them. Here the polygons that
//! may come between the element and the source are known (its shaft's candidates), so only an element without any
//! counts as fully visible, and only one that a single blocker hides from all vertices as hidden.

use crate::visibility::Visibility;

/// What an element's vertices see of a source.
#[derive(Debug, Clone)]
pub(crate) struct Seen {
    pub(crate) state: Visibility,
    /// The light blockers: polygons that hide something of the source.
    pub(crate) blockers: Vec<u32>,
}

/// The paper's cases.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Case {
    /// 1. The source is hidden from the whole element: nothing to do.
    Hidden,
    /// 2 and 3. The source is fully visible: subdivision by differences refines it where it is lit unevenly, and
    /// there are no boundaries to look for.
    Visible,
    /// 4. Whatever blocks it, the source is too weak to make a difference here.
    Slight,
    /// 5a. Many blockers: look at the element's quarters.
    Crossed,
    /// 5b. Few blockers, or the deepest level: split along the boundaries.
    Split,
}

/// Tells the cases apart.
///
/// `slight`: whether no difference that the source can make matters here. `candidates`: how many polygons may come
/// between. `most`: the user's `max_blockers`. `may_descend`: whether the deepest level is not reached.
pub(crate) fn case(
    slight: bool,
    seen: &[Seen; 3],
    candidates: usize,
    most: usize,
    may_descend: bool,
) -> Case {
    if slight {
        return Case::Slight;
    }
    if candidates == 0 {
        return Case::Visible;
    }
    let hidden = seen.iter().all(|seen| matches!(seen.state, Visibility::Hidden | Visibility::BelowHorizon));
    // What one convex blocker hides a convex source from is convex, so all between the vertices is hidden as well.
    let alone = |seen: &Seen| match seen.blockers[..] {
        [only] => Some(only),
        _ => None,
    };
    if hidden && seen.iter().all(|one| alone(one).is_some() && alone(one) == alone(&seen[0])) {
        return Case::Hidden;
    }
    let mut blockers: Vec<u32> = seen.iter().flat_map(|seen| seen.blockers.iter().copied()).collect();
    blockers.sort_unstable();
    blockers.dedup();
    // Candidates that no vertex knows cast their shadow between them.
    let count = if blockers.is_empty() { candidates } else { blockers.len() };
    if count > most && may_descend { Case::Crossed } else { Case::Split }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MOST: usize = 4;

    fn seen(state: Visibility, blockers: &[u32]) -> Seen {
        Seen { state, blockers: blockers.to_vec() }
    }

    fn lit() -> Seen {
        seen(Visibility::Visible, &[])
    }

    fn hidden_by(blockers: &[u32]) -> Seen {
        seen(Visibility::Hidden, blockers)
    }

    fn partly(blockers: &[u32]) -> Seen {
        seen(Visibility::Partial, blockers)
    }

    #[test]
    fn one_convex_blocker_that_hides_the_source_from_all_vertices_hides_it_from_the_element() {
        let all = [hidden_by(&[7]), hidden_by(&[7]), hidden_by(&[7])];
        assert_eq!(case(false, &all, 3, MOST, true), Case::Hidden);
    }

    #[test]
    fn several_blockers_that_hide_it_together_may_let_light_between_them() {
        let two = [hidden_by(&[7]), hidden_by(&[7]), hidden_by(&[8])];
        assert_eq!(case(false, &two, 2, MOST, true), Case::Split);
        let pair = [hidden_by(&[7, 8]), hidden_by(&[7, 8]), hidden_by(&[7, 8])];
        assert_eq!(case(false, &pair, 2, MOST, true), Case::Split);
    }

    #[test]
    fn below_the_horizon_nothing_blocks_so_nothing_proves_the_element_hidden() {
        let below = || seen(Visibility::BelowHorizon, &[]);
        assert_eq!(case(false, &[below(), below(), below()], 1, MOST, true), Case::Split);
        assert_eq!(case(false, &[below(), below(), hidden_by(&[7])], 1, MOST, true), Case::Split);
    }

    #[test]
    fn without_candidates_the_source_is_visible() {
        assert_eq!(case(false, &[lit(), lit(), lit()], 0, MOST, true), Case::Visible);
    }

    /// Where the paper's test errs: a shadow between vertices that are all lit.
    #[test]
    fn candidates_forbid_the_verdict_visible() {
        assert_eq!(case(false, &[lit(), lit(), lit()], 1, MOST, true), Case::Split);
    }

    #[test]
    fn a_slight_source_makes_no_difference_whatever_blocks_it() {
        assert_eq!(
            case(true, &[lit(), partly(&[1, 2, 3, 4, 5]), hidden_by(&[7])], 9, MOST, true),
            Case::Slight
        );
    }

    #[test]
    fn many_blockers_ask_for_quarters() {
        let many = [partly(&[1, 2]), partly(&[2, 3]), partly(&[4, 5])];
        assert_eq!(case(false, &many, 5, MOST, true), Case::Crossed);
        // Candidates that hide nothing count only where no vertex is in shadow.
        assert_eq!(case(false, &[lit(), lit(), lit()], 5, MOST, true), Case::Crossed);
        assert_eq!(case(false, &[partly(&[1]), lit(), lit()], 5, MOST, true), Case::Split);
    }

    #[test]
    fn few_blockers_split_the_element() {
        let few = [partly(&[1, 2]), partly(&[2, 3]), partly(&[4, 1])];
        assert_eq!(case(false, &few, 9, MOST, true), Case::Split);
    }

    #[test]
    fn at_the_deepest_level_many_blockers_split_it_too() {
        let many = [partly(&[1, 2]), partly(&[2, 3]), partly(&[4, 5])];
        assert_eq!(case(false, &many, 5, MOST, false), Case::Split);
    }
}
