//! Which velocity parts of the two bodies a contact may change.

use std::ops::{BitAnd, BitOr, Not};

/// A set of velocity parts: the linear and the angular velocity of body 1 and of body 2.
///
/// As the solve mode of an arbiter: what its contacts may change. As the `remove` of a registered contact: what to leave out,
/// so `remove: SolveMode::ANGULAR` gives a linear-only response.
///
/// ```
/// use arbiter3d::SolveMode;
/// assert_eq!(SolveMode::FULL & !SolveMode::ANGULAR, SolveMode::LINEAR);
/// assert!(SolveMode::FULL_BODY1.contains(SolveMode::LINEAR_BODY1));
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct SolveMode(u8);

impl SolveMode {
    /// Nothing.
    pub const NONE: Self = Self(0);
    /// Linear velocity of body 1.
    pub const LINEAR_BODY1: Self = Self(1);
    /// Angular velocity of body 1.
    pub const ANGULAR_BODY1: Self = Self(2);
    /// Linear velocity of body 2.
    pub const LINEAR_BODY2: Self = Self(4);
    /// Angular velocity of body 2.
    pub const ANGULAR_BODY2: Self = Self(8);
    /// Both velocities of body 1.
    pub const FULL_BODY1: Self = Self(3);
    /// Both velocities of body 2.
    pub const FULL_BODY2: Self = Self(12);
    /// Linear velocities of both bodies.
    pub const LINEAR: Self = Self(5);
    /// Angular velocities of both bodies.
    pub const ANGULAR: Self = Self(10);
    /// Everything.
    pub const FULL: Self = Self(15);

    /// Whether all of `other` is in the set.
    #[must_use]
    pub const fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// The set as four bits: linear 1, angular 1, linear 2, angular 2.
    #[must_use]
    pub const fn bits(self) -> u8 {
        self.0
    }
}

impl BitOr for SolveMode {
    type Output = Self;
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

impl BitAnd for SolveMode {
    type Output = Self;
    fn bitand(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }
}

impl Not for SolveMode {
    type Output = Self;
    fn not(self) -> Self {
        Self(!self.0 & 15)
    }
}
