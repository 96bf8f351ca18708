//! What can go wrong at the API, each with what to do about it.

use crate::arbiter::{ArbiterId, ArbiterKey};
use crate::id::{BodyId, ShapeId};
use crate::math::{Quat, Real, Rotation, Vec3};
use crate::shape::ShapeError;
use crate::simd::SimdLevel;

/// How far the length of a unit vector or quaternion may be from 1.
pub const UNIT_TOLERANCE: Real = 1e-3;

/// A call that could not be carried out; the world is as it was before.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A number is NaN or infinite.
    #[error("{what} is {value}: it must be finite")]
    NotFinite {
        /// The argument.
        what: &'static str,
        /// Its value.
        value: Real,
    },
    /// A vector has a coordinate that is NaN or infinite.
    #[error("{what} is {value:?}: all coordinates must be finite")]
    NotFiniteVector {
        /// The argument.
        what: &'static str,
        /// Its value.
        value: Vec3,
    },
    /// A number is outside its range.
    #[error("{what} is {value}: it must be from {low} to {high}")]
    OutOfRange {
        /// The argument.
        what: &'static str,
        /// Its value.
        value: Real,
        /// Smallest allowed value.
        low: Real,
        /// Largest allowed value.
        high: Real,
    },
    /// A normal is not of unit length.
    #[error("{what} {value:?} has length {length}: normalise it (within {UNIT_TOLERANCE})")]
    NotUnit {
        /// The argument.
        what: &'static str,
        /// Its value.
        value: Vec3,
        /// Its length.
        length: Real,
    },
    /// A rotation is not of unit length.
    #[error("{what} {value:?} has length {length}: normalise the quaternion (within {UNIT_TOLERANCE})")]
    NotUnitRotation {
        /// The argument.
        what: &'static str,
        /// Its value.
        value: Quat,
        /// Its length.
        length: Real,
    },
    /// The body was removed, or belongs to another world.
    #[error("{id:?} is not in this world: it was removed, or belongs to another world")]
    UnknownBody {
        /// The id given.
        id: BodyId,
    },
    /// The shape was removed, or belongs to another world.
    #[error("{id:?} is not in this world: it was removed, or belongs to another world")]
    UnknownShape {
        /// The id given.
        id: ShapeId,
    },
    /// The arbiter has ended, or belongs to another world.
    #[error("{id:?} is not in this world: its shapes have separated or it was removed; look it up by key")]
    UnknownArbiter {
        /// The id given.
        id: ArbiterId,
    },
    /// The world's own body cannot be removed or changed in kind.
    #[error("the world's own body is static and cannot be removed, moved or changed in kind")]
    WorldBody,
    /// An arbiter between a body and itself.
    #[error("both sides are {id:?}: an arbiter needs two different bodies")]
    SameBody {
        /// The body.
        id: BodyId,
    },
    /// An arbiter between two bodies of which neither can move.
    #[error("neither {body1:?} nor {body2:?} is dynamic: a contact between them would do nothing")]
    NeitherMoves {
        /// First body.
        body1: BodyId,
        /// Second body.
        body2: BodyId,
    },
    /// An arbiter of a body that is disabled.
    #[error("{id:?} is disabled: it takes no contacts until it is enabled again")]
    BodyDisabled {
        /// The body.
        id: BodyId,
    },
    /// The key is in use for other bodies.
    #[error("{key:?} is in use between {body1:?} and {body2:?}: use ids of your own from World::reserve_ids")]
    KeyInUse {
        /// The key.
        key: ArbiterKey,
        /// First body of the arbiter that has it.
        body1: BodyId,
        /// Second body of the arbiter that has it.
        body2: BodyId,
    },
    /// A slot of an arbiter that holds no contact.
    #[error("slot {slot} of the arbiter holds no contact (slots in use: {mask:04b})")]
    EmptySlot {
        /// The slot asked for.
        slot: usize,
        /// The slots in use, as bits.
        mask: u8,
    },
    /// A velocity, force or impulse on a body that does not take it.
    #[error("{id:?} is static: it has no velocity; make it kinematic or dynamic first")]
    StaticBody {
        /// The body.
        id: BodyId,
    },
    /// A vehicle on a body that forces do not move.
    #[error("{id:?} is not dynamic: forces do not move it; make it dynamic first")]
    NotDynamic {
        /// The body.
        id: BodyId,
    },
    /// A mass or inertia that no matter can have.
    #[error("mass {mass} with this inertia cannot be: mass and principal moments must be finite and above zero")]
    BadMass {
        /// The mass given.
        mass: Real,
    },
    /// More ids than are left.
    #[error("cannot reserve {count} ids: ask for 1 to {limit}")]
    IdRange {
        /// How many were asked for.
        count: u64,
        /// How many may be asked for.
        limit: u64,
    },
    /// The machine lacks the instruction set.
    #[error("this machine has no {level}: leave the SIMD level unset to take the best there is")]
    SimdUnavailable {
        /// The level asked for.
        level: SimdLevel,
    },
    /// A shape could not be built.
    #[error(transparent)]
    Shape(#[from] ShapeError),
}

pub(crate) fn finite(what: &'static str, value: Real) -> Result<Real, Error> {
    if value.is_finite() { Ok(value) } else { Err(Error::NotFinite { what, value }) }
}

pub(crate) fn finite_vec(what: &'static str, value: Vec3) -> Result<Vec3, Error> {
    if value.is_finite() { Ok(value) } else { Err(Error::NotFiniteVector { what, value }) }
}

pub(crate) fn in_range(what: &'static str, value: Real, low: Real, high: Real) -> Result<Real, Error> {
    if value >= low && value <= high { Ok(value) } else { Err(Error::OutOfRange { what, value, low, high }) }
}

pub(crate) fn unit_vec(what: &'static str, value: Vec3) -> Result<Vec3, Error> {
    finite_vec(what, value)?;
    let length = value.length();
    if (length - 1.0).abs() <= UNIT_TOLERANCE {
        Ok(value / length)
    } else {
        Err(Error::NotUnit { what, value, length })
    }
}

/// A rotation from the API: within the tolerance it is normalised, else refused.
pub(crate) fn unit_rotation(what: &'static str, value: Quat) -> Result<Rotation, Error> {
    let q = Rotation::from_quat(value);
    let length = q.dot(q).sqrt();
    if (length - 1.0).abs() <= UNIT_TOLERANCE {
        Ok(q.normalize())
    } else {
        Err(Error::NotUnitRotation { what, value, length })
    }
}
