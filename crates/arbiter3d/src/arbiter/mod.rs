//! Arbiters: the contact state between two bodies, open to everyone.
//!
//! An arbiter is made when two shapes begin to touch and ends when they separate. Between, it holds up to four contacts that
//! are cached from step to step with the impulses they carried, the material of the pair, and what the contacts may change of
//! the two bodies. Arbiters are between shapes, not bodies: two bodies of several shapes can have several. Each has a
//! [`ArbiterKey`]; for the engine's own these are the two shape ids, the smaller one first. Users make arbiters of their own
//! with keys of their own and register contacts into them; the engine solves, caches, sleeps and ends them like the rest.
//!
//! ```text
//!   begin ──► contacts found or registered, cached, solved, moved with the bodies ──► broken ──► end, back to the pool
//!   
//!               ▲                                                              │
//!               └────────────────────── each step ─────────────────────────────┘
//!               
//! ```
//!
//! Nothing here knows shapes, trees or the solver: the same code serves contacts from any source.

mod cache;
mod contact_data;
mod key;
mod solve_mode;
mod store;

pub use contact_data::{Contact, ContactData};
pub use key::ArbiterKey;
pub use solve_mode::SolveMode;
pub use store::{Arbiter, ArbiterId, EndReason};

pub(crate) use contact_data::{
    ANISOTROPIC, ANISOTROPY_OVERRIDDEN, FRICTION_OVERRIDDEN, HIDDEN, ONE_NORMAL, RESTITUTION_OVERRIDDEN,
    ROLLING_OVERRIDDEN, SLOTS, TANGENT_VELOCITY_OVERRIDDEN,
};
pub(crate) use store::{ArbiterStore, Entry, IdMap, NONE, Name};

use crate::math::Vec3;

/// A contact to be registered: where two bodies meet, in world space.
///
/// ```
/// use arbiter3d::{ContactPoint, SolveMode, math::Vec3};
/// let linear_only = ContactPoint::new(Vec3::ZERO, Vec3::ZERO, Vec3::Y).without(SolveMode::ANGULAR);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactPoint {
    /// Point on body 1, metres.
    pub point1: Vec3,
    /// Point on body 2, metres.
    pub point2: Vec3,
    /// Unit normal from body 1 to body 2. The gap is `(point2 − point1) · normal`.
    pub normal: Vec3,
    /// Velocity parts that this contact leaves alone. Default none.
    pub remove: SolveMode,
}

impl ContactPoint {
    /// A contact that acts on everything that can move.
    #[must_use]
    pub const fn new(point1: Vec3, point2: Vec3, normal: Vec3) -> Self {
        Self { point1, point2, normal, remove: SolveMode::NONE }
    }

    /// The same, leaving some velocity parts alone.
    #[must_use]
    pub const fn without(self, remove: SolveMode) -> Self {
        Self { remove, ..self }
    }
}
