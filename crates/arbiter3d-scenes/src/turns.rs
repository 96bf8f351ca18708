//! Angles and rotations with the same bits on every machine: sine and cosine come from the `libm` crate in double
//! precision and are rounded once.

use arbiter3d::math::{Quat, Real, Rotation, Vec3};

/// Sine and cosine of an angle in radians.
#[must_use]
pub fn sin_cos(angle: Real) -> (Real, Real) {
    let angle = f64::from(angle);
    (libm::sin(angle) as Real, libm::cos(angle) as Real)
}

/// Rotation by `angle` radians about a unit `axis`.
#[must_use]
pub fn about(axis: Vec3, angle: Real) -> Quat {
    let (s, c) = sin_cos(0.5 * angle);
    Quat::from_xyzw(axis.x * s, axis.y * s, axis.z * s, c)
}

/// The rotation `first`, then the rotation `second`, in a fixed order of operations (`Quat`'s own product is not).
#[must_use]
pub fn then(first: Quat, second: Quat) -> Quat {
    Rotation::from_quat(second).mul(Rotation::from_quat(first)).to_quat()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::FRAC_PI_2;

    #[test]
    fn turning_twice_turns_in_the_order_given() {
        let both = then(about(Vec3::Z, FRAC_PI_2), about(Vec3::Y, FRAC_PI_2));
        // x goes to y by the first turn, and stays there by the second.
        assert!((Rotation::from_quat(both).rotate(Vec3::X) - Vec3::Y).length() < 1e-6);
    }
}
