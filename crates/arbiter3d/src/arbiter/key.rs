//! How arbiters are told apart.

use crate::id::ShapeId;
use crate::place_table::mix;

/// An ordered pair of numbers that names an arbiter: `(1, 2)` and `(2, 1)` are different keys.
///
/// The engine's own arbiters carry the two [`ShapeId`]s, the smaller one first. For arbiters of your own any pair will do;
/// [`World::reserve_ids`](crate::World::reserve_ids) hands out numbers that never clash with shapes.
///
/// ```
/// use arbiter3d::ArbiterKey;
/// assert_ne!(ArbiterKey::new(1, 2), ArbiterKey::new(2, 1));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ArbiterKey {
    /// First number.
    pub key1: u64,
    /// Second number.
    pub key2: u64,
}

impl ArbiterKey {
    /// The key of two numbers, in this order.
    #[must_use]
    pub const fn new(key1: u64, key2: u64) -> Self {
        Self { key1, key2 }
    }

    /// For the table in which arbiters are found.
    pub(crate) fn hash(self) -> u64 {
        mix(mix(0, self.key1), self.key2)
    }

    /// The key of the arbiter between two shapes, whichever order they are given in.
    #[must_use]
    pub fn of_shapes(a: ShapeId, b: ShapeId) -> Self {
        let (a, b) = (a.raw(), b.raw());
        Self { key1: a.min(b), key2: a.max(b) }
    }
}
