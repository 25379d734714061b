//! Indices that are types: an element's number cannot be used where a sample's is meant.

/// Declares `u32` newtypes that index into vectors.
macro_rules! typed_index {
    ($($(#[$doc:meta])* $name:ident),+ $(,)?) => {$(
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub(crate) struct $name(u32);

        #[expect(clippy::allow_attributes, reason = "not every index type uses every method")]
        #[allow(dead_code)]
        impl $name {
            pub(crate) fn new(index: usize) -> Self {
                Self(u32::try_from(index).expect("more than 2^32 parts in a mesh; this is a bug in antumbra"))
            }

            /// All indices of a range, in order.
            pub(crate) fn range(range: std::ops::Range<usize>) -> impl DoubleEndedIterator<Item = Self> + Clone {
                range.map(Self::new)
            }

            pub(crate) fn index(self) -> usize {
                self.0 as usize
            }
        }
    )+};
}
pub(crate) use typed_index;

typed_index! {
    /// A triangle of the input that has an area.
    FaceId,
    /// A point of the refined mesh, shared by all elements that meet there.
    VertexId,
    /// A place where irradiance is known: a vertex seen from one smooth group of elements.
    SampleId,
    /// A triangle of the element hierarchy.
    ElementId,
}
