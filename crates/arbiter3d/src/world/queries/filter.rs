//! Which shapes a query sees.

use crate::id::{BodyId, ShapeId};
use crate::world::{BodyKind, ShapeRef, World};

/// A set of kinds of bodies.
///
/// ```
/// use arbiter3d::{BodyKind, BodyKinds};
/// let solid_ground = BodyKinds::STATIC | BodyKinds::KINEMATIC;
/// assert!(solid_ground.contains(BodyKind::Static) && !solid_ground.contains(BodyKind::Dynamic));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct BodyKinds(u8);

impl BodyKinds {
    /// Bodies that never move.
    pub const STATIC: Self = Self(1);
    /// Bodies that move as they are told.
    pub const KINEMATIC: Self = Self(2);
    /// Bodies that forces move.
    pub const DYNAMIC: Self = Self(4);
    /// All bodies.
    pub const ALL: Self = Self(7);

    /// Whether a kind is in the set.
    #[must_use]
    pub fn contains(self, kind: BodyKind) -> bool {
        let bit = match kind {
            BodyKind::Static => Self::STATIC,
            BodyKind::Kinematic => Self::KINEMATIC,
            BodyKind::Dynamic => Self::DYNAMIC,
        };
        self.0 & bit.0 != 0
    }
}

impl Default for BodyKinds {
    fn default() -> Self {
        Self::ALL
    }
}

impl std::ops::BitOr for BodyKinds {
    type Output = Self;
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

/// A condition of your own: a query sees the shapes for which it returns true. It may be asked from several threads.
pub type ShapePredicate<'a> = &'a (dyn Fn(&ShapeRef<'_>) -> bool + Sync);

/// Which shapes a query sees: those for which all of this holds.
///
/// ```
/// use arbiter3d::{BodyId, BodyKinds, QueryFilter, ShapeRef};
/// let all_but_the_world = QueryFilter { exclude_body: Some(BodyId::WORLD), ..QueryFilter::default() };
/// let heavy = |shape: &ShapeRef<'_>| shape.density() > 2000.0;
/// let heavy_props = QueryFilter { kinds: BodyKinds::DYNAMIC, predicate: Some(&heavy), ..QueryFilter::default() };
/// ```
#[derive(Clone, Copy)]
pub struct QueryFilter<'a> {
    /// What the query is, for the masks of the shapes. Default all.
    pub category: u64,
    /// Categories of shapes that the query sees. Default all.
    pub mask: u64,
    /// Whether sensors are seen. Default false.
    pub sensors: bool,
    /// Kinds of bodies whose shapes are seen. Default all.
    pub kinds: BodyKinds,
    /// A body not to see. Default none.
    pub exclude_body: Option<BodyId>,
    /// A shape not to see. Default none.
    pub exclude_shape: Option<ShapeId>,
    /// More bodies not to see. Default none.
    pub exclude_bodies: &'a [BodyId],
    /// More shapes not to see. Default none.
    pub exclude_shapes: &'a [ShapeId],
    /// A condition of your own, asked last. Default none.
    pub predicate: Option<ShapePredicate<'a>>,
}

impl Default for QueryFilter<'_> {
    fn default() -> Self {
        Self {
            category: u64::MAX,
            mask: u64::MAX,
            sensors: false,
            kinds: BodyKinds::ALL,
            exclude_body: None,
            exclude_shape: None,
            exclude_bodies: &[],
            exclude_shapes: &[],
            predicate: None,
        }
    }
}

impl std::fmt::Debug for QueryFilter<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("QueryFilter")
            .field("category", &self.category)
            .field("mask", &self.mask)
            .field("sensors", &self.sensors)
            .field("kinds", &self.kinds)
            .field("exclude_body", &self.exclude_body)
            .field("exclude_shape", &self.exclude_shape)
            .field("exclude_bodies", &self.exclude_bodies)
            .field("exclude_shapes", &self.exclude_shapes)
            .field("predicate", &self.predicate.is_some())
            .finish()
    }
}

impl World {
    /// Whether a query with this filter sees a shape.
    pub(super) fn sees(&self, filter: &QueryFilter<'_>, slot: u32) -> bool {
        let shape = &self.shapes[slot as usize];
        let body = self.body_id(shape.body);
        filter.mask & shape.filter.category != 0
            && shape.filter.mask & filter.category != 0
            && (filter.sensors || !shape.sensor)
            && (filter.kinds == BodyKinds::ALL || filter.kinds.contains(self.bodies[shape.body as usize].kind))
            && filter.exclude_shape != Some(shape.id)
            && filter.exclude_body != Some(body)
            && !filter.exclude_shapes.contains(&shape.id)
            && !filter.exclude_bodies.contains(&body)
            && filter.predicate.is_none_or(|accepts| accepts(&ShapeRef::new(self, slot)))
    }
}
