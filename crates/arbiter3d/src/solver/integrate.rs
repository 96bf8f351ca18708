//! Velocities and positions of bodies over a substep.
//!
//! Velocities: `v ← v + h a`, summed with Kahan's correction so that a long fall keeps its acceleration; then damping,
//! `v ← v / (1 + h c)`. Contacts act after that: what they changed in the last substep is applied again, which is warm
//! starting without touching a single contact (their directions and masses are fixed within a step, so the accumulated
//! impulses of all contacts of a body add up to just this velocity change).
//!
//! Positions: `x ← x + h v`, minus `½ h² a` where no contact acts: the mean of the velocities before and after, exact for
//! constant acceleration.
//!
//! Torque-free spin keeps the angular momentum `L = R I Rᵀ ω` in world axes, not `ω`. One midpoint step: turn half way with
//! `ω`, take `ω` from `L` there, turn the whole way with that, and read the new `ω` from the same `L`. Momentum is kept to
//! rounding and the energy to second order.

use super::bodies::{BodyMass, BodyMotion, BodyState};
use crate::math::{Real, Rotation, SymmetricMat3, Vec3};

/// What the integrator needs to know of the step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct IntegrateParameters {
    pub substep: Real,
    pub max_linear_speed: Real,
    pub max_angular_speed: Real,
}

/// Spin below which its own torque is left out, radians a substep: the change of ω is that share of ω.
const GYROSCOPIC_TURN: Real = 1e-5;

/// Velocities at the beginning of a substep; in the first one there is nothing to warm start with yet.
#[inline]
pub(crate) fn integrate_velocity(
    state: &mut BodyState,
    motion: &mut BodyMotion,
    parameters: &IntegrateParameters,
    first: bool,
) {
    if motion.kinematic {
        return;
    }
    let h = parameters.substep;
    let (mut linear, mut angular) = (state.linear_velocity, state.angular_velocity);
    let (mut warm_linear, mut warm_angular) = (Vec3::ZERO, Vec3::ZERO);
    if !first {
        warm_linear = linear - motion.free_linear;
        warm_angular = angular - motion.free_angular;
    }
    let gained = motion.acceleration * h - motion.residual;
    let sum = linear + gained;
    motion.residual = (sum - linear) - gained;
    linear = sum;
    angular += motion.angular_acceleration * h;
    if motion.linear_damping > 0.0 {
        linear *= 1.0 / (1.0 + h * motion.linear_damping);
    }
    if motion.angular_damping > 0.0 {
        angular *= 1.0 / (1.0 + h * motion.angular_damping);
    }
    linear = limit(linear, parameters.max_linear_speed);
    angular = limit(angular, parameters.max_angular_speed);
    if !(linear.is_finite() && angular.is_finite() && warm_linear.is_finite() && warm_angular.is_finite()) {
        motion.broken = true;
        (linear, angular, warm_linear, warm_angular) = (Vec3::ZERO, Vec3::ZERO, Vec3::ZERO, Vec3::ZERO);
        motion.residual = Vec3::ZERO;
    }
    (motion.free_linear, motion.free_angular) = (linear, angular);
    state.linear_velocity = linear + warm_linear;
    state.angular_velocity = angular + warm_angular;
}

/// A vector no longer than `longest`.
fn limit(v: Vec3, longest: Real) -> Vec3 {
    let squared = v.length_squared();
    if squared <= longest * longest {
        return v;
    }
    // Scaled first, since the square of a finite length may be infinite.
    let scaled = v / v.abs().max_element();
    if v.is_finite() { scaled * (longest / scaled.length()) } else { v }
}

/// Positions at the end of a substep.
#[inline]
pub(crate) fn integrate_position(
    state: &mut BodyState,
    motion: &mut BodyMotion,
    mass: &mut BodyMass,
    parameters: &IntegrateParameters,
) {
    let h = parameters.substep;
    let mut translation = state.linear_velocity * h;
    if state.constrained == 0 && !motion.kinematic {
        translation -= motion.acceleration * (0.5 * h * h);
    }
    state.translation += translation;
    let mut angle = state.angular_velocity * h;
    if motion.gyroscopic && angle.length_squared() > GYROSCOPIC_TURN * GYROSCOPIC_TURN {
        let (mean, end) = spin(mass.rotation, state.angular_velocity, h, motion);
        // The change is free motion, not a contact's doing.
        motion.free_angular = end - (state.angular_velocity - motion.free_angular);
        state.angular_velocity = end;
        angle = mean * h;
    }
    if angle != Vec3::ZERO {
        state.turn += angle;
        mass.rotation = mass.rotation.integrate(angle);
    }
}

/// Mean and final angular velocity of a torque-free spin over `h`.
fn spin(rotation: Rotation, angular_velocity: Vec3, h: Real, motion: &BodyMotion) -> (Vec3, Vec3) {
    let through = |q: Rotation, m: &SymmetricMat3, v: Vec3| q.rotate(m.mul(q.inverse_rotate(v)));
    let momentum = through(rotation, &motion.inertia, angular_velocity);
    // ω' = ω + I'⁻¹ (L − I' ω) rather than I'⁻¹ L: rounding then errs by a share of the change, not of the whole.
    let at = |q: Rotation| {
        let missing = momentum - through(q, &motion.inertia, angular_velocity);
        angular_velocity + through(q, &motion.inverse_inertia, missing)
    };
    let mean = at(rotation.integrate(angular_velocity * (0.5 * h)));
    (mean, at(rotation.integrate(mean * h)))
}
