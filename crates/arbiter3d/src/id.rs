//! Names of things: cheap to copy, never dangling.

/// Names a body of one world. A removed body's id is never valid again.
///
/// ```
/// use arbiter3d::{BodyDefinition, World};
/// let mut world = World::default();
/// let body = world.add_body(&BodyDefinition::dynamic())?;
/// world.remove_body(body)?;
/// assert!(world.body(body).is_none());
/// # Ok::<(), arbiter3d::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct BodyId {
    pub(crate) index: u32,
    pub(crate) generation: u32,
}

impl BodyId {
    /// The world's own body: static, at the origin, always there. Contacts and joints with "nothing" use it, and it may
    /// carry shapes.
    pub const WORLD: Self = Self { index: 0, generation: 0 };

    /// Slot of the body: dense, reused after removal. For tables of one's own.
    #[must_use]
    pub fn index(self) -> u32 {
        self.index
    }
}

/// Names a shape that is attached to a body: a number that only grows and is never used twice in a world.
///
/// ```
/// use arbiter3d::{ArbiterKey, ShapeId};
/// let key = ArbiterKey::of_shapes(ShapeId::from_raw(9), ShapeId::from_raw(4));
/// assert_eq!((key.key1, key.key2), (4, 9));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ShapeId(pub(crate) u64);

impl ShapeId {
    /// The number inside, as it stands in an [`ArbiterKey`](crate::ArbiterKey).
    #[must_use]
    pub fn raw(self) -> u64 {
        self.0
    }

    /// The id with this number, which need not exist in any world.
    #[must_use]
    pub fn from_raw(raw: u64) -> Self {
        Self(raw)
    }
}
