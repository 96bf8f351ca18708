//! The passes over wide rows: warm start, solve, relax, restitution.
//!
//! *Solve* pushes overlaps apart: with separation `s`, a point wants the normal velocity `−s/h` while it is apart (it may
//! close the gap but not cross it), and behaves as a spring and damper where it overlaps. *Relax*, after the positions have
//! moved, takes out the velocity that the spring has put in, and solves friction. Restitution comes last, once a step.
//!
//! Softness, with `ω = 2π·hertz`, damping ratio `ζ` and substep `h`:
//!
//! ```text
//! a₁ = 2ζ + hω,  a₂ = hω·a₁,  bias rate = ω/a₁,  mass scale = a₂/(1 + a₂),  impulse scale = 1/(1 + a₂)
//! λ' = max(λ − m (mass scale · vₙ + bias) − impulse scale · λ, 0)
//! ```
//!
//! The spring is stiffer (45 Hz at four substeps of 60 Hz) and less damped (3) than the 30 Hz and 10 of the source: a tower of 40
//! cubes then sags 9.6 mm at its foot rather than 21.7, and what is wedged into a heap 5 mm rather than 13. The limit is
//! 0.1875 of the substep rate; at 60 Hz a triangle of 100 rows rings.
//!
//! Source: Catto, "Soft Constraints", GDC 2011, and "Solver2D", 2024 (Soft Step). Friction is solved once a manifold, at a
//! centre of its points: two tangents limited by a circular cone, a twist about the normal limited by the levers of the
//! points.

use super::bodies::{SharedStates, WideDisplacement, WideVelocity, gather, scatter};
use super::rows::{FrictionRow, NormalRow};
use crate::math::Real;
use crate::simd::{Wide, WideVec3};

/// Spring of a contact, as the solver uses it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Softness {
    pub bias_rate: Real,
    pub mass_scale: Real,
    pub impulse_scale: Real,
}

impl Softness {
    /// From frequency (Hz), damping ratio and substep (s); a frequency of zero gives a rigid contact without push-out.
    pub fn new(hertz: Real, damping_ratio: Real, substep: Real) -> Self {
        if hertz <= 0.0 {
            return Self { bias_rate: 0.0, mass_scale: 1.0, impulse_scale: 0.0 };
        }
        let omega = 2.0 * std::f32::consts::PI as Real * hertz;
        let a1 = 2.0 * damping_ratio + substep * omega;
        let a2 = substep * omega * a1;
        let a3 = 1.0 / (1.0 + a2);
        Self { bias_rate: omega / a1, mass_scale: a2 * a3, impulse_scale: a3 }
    }
}

/// What the passes of a substep share.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PassParameters {
    pub inverse_substep: Real,
    pub push_out_speed: Real,
    /// Overlap past which a contact at rest gives no further, m: its spring is as much stiffer as its load asks for.
    pub deepest_rest: Real,
    pub softness: Softness,
    pub restitution_threshold: Real,
}

/// Applies the impulses of the last step.
///
/// # Safety
/// No other thread may touch the dynamic bodies of the row.
#[inline(always)]
pub(crate) unsafe fn warm_start<const L: usize, const P: usize, const C: usize>(
    row: &NormalRow<L, P, C>,
    friction: &FrictionRow<L, P>,
    states: &SharedStates<'_>,
) {
    // SAFETY: promised by the caller.
    let (mut v1, _) = unsafe { gather(states, &row.body1) };
    // SAFETY: promised by the caller.
    let (mut v2, _) = unsafe { gather(states, &row.body2) };
    let mut sum = Impulse::ZERO;
    for i in 0..P {
        sum.add_point(row, i, row.impulses[i]);
    }
    sum.apply(row, &mut v1, &mut v2);
    apply_friction(row, friction, [friction.impulse1, friction.impulse2], &mut v1, &mut v2);
    let twist = row.normal.scale(friction.twist_impulse);
    apply_torque(row, &(twist + friction.rolling_impulse), &mut v1, &mut v2);
    // SAFETY: promised by the caller.
    unsafe { scatter(states, &row.body1, &v1) };
    // SAFETY: promised by the caller.
    unsafe { scatter(states, &row.body2, &v2) };
}

/// The biased pass.
///
/// # Safety
/// No other thread may touch the dynamic bodies of the row.
#[inline(always)]
pub(crate) unsafe fn solve<const L: usize, const P: usize, const C: usize>(
    row: &mut NormalRow<L, P, C>,
    states: &SharedStates<'_>,
    pass: &PassParameters,
) {
    // SAFETY: promised by the caller.
    let (mut v1, d1) = unsafe { gather(states, &row.body1) };
    // SAFETY: promised by the caller.
    let (mut v2, d2) = unsafe { gather(states, &row.body2) };
    let separations = separations(row, &d1, &d2);
    solve_normals::<L, P, C, true>(row, &separations, &mut v1, &mut v2, pass);
    // SAFETY: promised by the caller.
    unsafe { scatter(states, &row.body1, &v1) };
    // SAFETY: promised by the caller.
    unsafe { scatter(states, &row.body2, &v2) };
}

/// The unbiased pass, with friction.
///
/// # Safety
/// No other thread may touch the dynamic bodies of the row.
#[inline(always)]
pub(crate) unsafe fn relax<const L: usize, const P: usize, const C: usize>(
    row: &mut NormalRow<L, P, C>,
    friction: &mut FrictionRow<L, P>,
    states: &SharedStates<'_>,
    pass: &PassParameters,
) {
    // SAFETY: promised by the caller.
    let (mut v1, d1) = unsafe { gather(states, &row.body1) };
    // SAFETY: promised by the caller.
    let (mut v2, d2) = unsafe { gather(states, &row.body2) };
    let separations = separations(row, &d1, &d2);
    solve_normals::<L, P, C, false>(row, &separations, &mut v1, &mut v2, pass);
    let mut load = Wide::ZERO;
    let mut twist_load = Wide::ZERO;
    for i in 0..P {
        friction.totals[i] += row.impulses[i];
        load += row.impulses[i];
        twist_load += row.impulses[i] * friction.levers[i];
    }
    if friction.has_rolling {
        solve_rolling(row, friction, load, &mut v1, &mut v2);
    }
    solve_twist(row, friction, twist_load, &mut v1, &mut v2);
    solve_tangents(row, friction, load, &mut v1, &mut v2);
    // SAFETY: promised by the caller.
    unsafe { scatter(states, &row.body1, &v1) };
    // SAFETY: promised by the caller.
    unsafe { scatter(states, &row.body2, &v2) };
}

/// Gives points that were hit their share of the approach speed back.
///
/// The points of a manifold share the bounce: what one gives, it gives to all through the coupling. One sweep over four
/// points costs a box that lands flat 7 % of its height; eight leave less than a tenth of a percent.
///
/// # Safety
/// No other thread may touch the dynamic bodies of the row.
#[inline(always)]
pub(crate) unsafe fn restitute<const L: usize, const P: usize, const C: usize>(
    row: &mut NormalRow<L, P, C>,
    friction: &mut FrictionRow<L, P>,
    states: &SharedStates<'_>,
    pass: &PassParameters,
) {
    if !friction.has_restitution {
        return;
    }
    // SAFETY: promised by the caller.
    let (mut v1, _) = unsafe { gather(states, &row.body1) };
    // SAFETY: promised by the caller.
    let (mut v2, _) = unsafe { gather(states, &row.body2) };
    let mut velocities = normal_velocities(row, &v1, &v2);
    let threshold = Wide::splat(-pass.restitution_threshold);
    let own: [Wide<L>; P] = std::array::from_fn(|i| row.points[i].mass.inverse_or_zero());
    let mut sum = Impulse::ZERO;
    for _ in 0..if P > 1 { RESTITUTION_SWEEPS } else { 1 } {
        for i in 0..P {
            let target = friction.restitution * friction.approach[i];
            let old = row.impulses[i];
            let wanted = (old - row.points[i].mass * (velocities[i] + target)).max(Wide::ZERO);
            // Bounces only what hit: closing fast enough, and pressed within this step.
            let bounces = (threshold - friction.approach[i]).if_positive(friction.totals[i], Wide::ZERO);
            let new = (bounces * friction.restitution).if_positive(wanted, old);
            let delta = new - old;
            row.impulses[i] = new;
            friction.totals[i] += delta;
            for (j, velocity) in velocities.iter_mut().enumerate() {
                let response = if i == j { own[i] } else { row.coupling[pair_of::<P>(i.min(j), i.max(j))] };
                *velocity += response * delta;
            }
            sum.add_point(row, i, delta);
        }
    }
    sum.apply(row, &mut v1, &mut v2);
    // SAFETY: promised by the caller.
    unsafe { scatter(states, &row.body1, &v1) };
    // SAFETY: promised by the caller.
    unsafe { scatter(states, &row.body2, &v2) };
}

/// Sweeps of the bounce over the points of a manifold; once a step, and only where something bounces.
const RESTITUTION_SWEEPS: usize = 8;

/// Place of the points `i < j` in [`NormalRow::coupling`].
#[inline(always)]
const fn pair_of<const P: usize>(i: usize, j: usize) -> usize {
    i * P - i * (i + 1) / 2 + j - i - 1
}

/// Gap at each point now, to first order in the displacements of the step.
#[inline(always)]
fn separations<const L: usize, const P: usize, const C: usize>(
    row: &NormalRow<L, P, C>,
    d1: &WideDisplacement<L>,
    d2: &WideDisplacement<L>,
) -> [Wide<L>; P] {
    let approach = row.normal.dot(&(d2.translation - d1.translation));
    std::array::from_fn(|i| {
        let point = &row.points[i];
        point.separation + approach + point.arm2.dot(&d2.turn) - point.arm1.dot(&d1.turn)
    })
}

/// Normal velocity at each point.
#[inline(always)]
fn normal_velocities<const L: usize, const P: usize, const C: usize>(
    row: &NormalRow<L, P, C>,
    v1: &WideVelocity<L>,
    v2: &WideVelocity<L>,
) -> [Wide<L>; P] {
    let linear = row.normal.dot(&(v2.linear - v1.linear));
    std::array::from_fn(|i| linear + row.points[i].arm2.dot(&v2.angular) - row.points[i].arm1.dot(&v1.angular))
}

/// One Gauss–Seidel sweep over the points of a row.
#[inline(always)]
fn solve_normals<const L: usize, const P: usize, const C: usize, const BIAS: bool>(
    row: &mut NormalRow<L, P, C>,
    separations: &[Wide<L>; P],
    v1: &mut WideVelocity<L>,
    v2: &mut WideVelocity<L>,
    pass: &PassParameters,
) {
    let mut velocities = normal_velocities(row, v1, v2);
    let inverse_substep = Wide::splat(pass.inverse_substep);
    let rate = Wide::splat(pass.softness.mass_scale * pass.softness.bias_rate);
    let (soft, one) = (Wide::splat(pass.softness.mass_scale), Wide::splat(1.0));
    let leak = Wide::splat(pass.softness.impulse_scale);
    let limit = Wide::splat(-pass.push_out_speed);
    let firmest = rate * Wide::splat(pass.deepest_rest);
    let mut sum = Impulse::ZERO;
    let mut pair = 0;
    for i in 0..P {
        let s = separations[i];
        let (bias, scale, leak) = if BIAS {
            let push = (s * rate).max(limit);
            (s.if_positive(s * inverse_substep, push), s.if_positive(one, soft), s.if_positive(Wide::ZERO, leak))
        } else {
            (s.max(Wide::ZERO) * inverse_substep, one, Wide::ZERO)
        };
        let old = row.impulses[i];
        let change = if BIAS {
            row.points[i].mass * (scale * velocities[i] + bias) + (leak * old).min(row.points[i].mass * firmest)
        } else {
            row.points[i].mass * (velocities[i] + bias)
        };
        let new = (old - change).max(Wide::ZERO);
        let delta = new - old;
        row.impulses[i] = new;
        for later in &mut velocities[i + 1..] {
            *later += row.coupling[pair] * delta;
            pair += 1;
        }
        sum.add_point(row, i, delta);
    }
    sum.apply(row, v1, v2);
}

/// Impulses of several points gathered up, to be applied at once.
struct Impulse<const L: usize> {
    along_normal: Wide<L>,
    angular1: WideVec3<L>,
    angular2: WideVec3<L>,
}

impl<const L: usize> Impulse<L> {
    const ZERO: Self = Self { along_normal: Wide::ZERO, angular1: WideVec3::ZERO, angular2: WideVec3::ZERO };

    #[inline(always)]
    fn add_point<const P: usize, const C: usize>(&mut self, row: &NormalRow<L, P, C>, point: usize, impulse: Wide<L>) {
        self.along_normal += impulse;
        self.angular1 = self.angular1.add_scaled(&row.points[point].arm1, impulse);
        self.angular2 = self.angular2.add_scaled(&row.points[point].arm2, impulse);
    }

    #[inline(always)]
    fn apply<const P: usize, const C: usize>(
        &self,
        row: &NormalRow<L, P, C>,
        v1: &mut WideVelocity<L>,
        v2: &mut WideVelocity<L>,
    ) {
        let linear = row.normal.scale(self.along_normal);
        apply_linear(row, &linear, v1, v2);
        v1.angular = v1.angular - row.inverse_inertia1.mul(&self.angular1);
        v2.angular = v2.angular + row.inverse_inertia2.mul(&self.angular2);
    }
}

/// Pushes body 2 by `impulse` and body 1 by its opposite.
#[inline(always)]
fn apply_linear<const L: usize, const P: usize, const C: usize>(
    row: &NormalRow<L, P, C>,
    impulse: &WideVec3<L>,
    v1: &mut WideVelocity<L>,
    v2: &mut WideVelocity<L>,
) {
    v1.linear.x -= row.inverse_mass1.x * impulse.x;
    v1.linear.y -= row.inverse_mass1.y * impulse.y;
    v1.linear.z -= row.inverse_mass1.z * impulse.z;
    v2.linear.x += row.inverse_mass2.x * impulse.x;
    v2.linear.y += row.inverse_mass2.y * impulse.y;
    v2.linear.z += row.inverse_mass2.z * impulse.z;
}

/// Turns body 2 by the angular impulse and body 1 by its opposite.
#[inline(always)]
fn apply_torque<const L: usize, const P: usize, const C: usize>(
    row: &NormalRow<L, P, C>,
    impulse: &WideVec3<L>,
    v1: &mut WideVelocity<L>,
    v2: &mut WideVelocity<L>,
) {
    v1.angular = v1.angular - row.inverse_inertia1.mul(impulse);
    v2.angular = v2.angular + row.inverse_inertia2.mul(impulse);
}

/// Applies tangential impulses at the friction centre.
#[inline(always)]
fn apply_friction<const L: usize, const P: usize, const C: usize>(
    row: &NormalRow<L, P, C>,
    friction: &FrictionRow<L, P>,
    [impulse1, impulse2]: [Wide<L>; 2],
    v1: &mut WideVelocity<L>,
    v2: &mut WideVelocity<L>,
) {
    let linear = friction.tangent1.scale(impulse1).add_scaled(&friction.tangent2, impulse2);
    apply_linear(row, &linear, v1, v2);
    let angular1 = friction.arm11.scale(impulse1).add_scaled(&friction.arm12, impulse2);
    let angular2 = friction.arm21.scale(impulse1).add_scaled(&friction.arm22, impulse2);
    v1.angular = v1.angular - row.inverse_inertia1.mul(&angular1);
    v2.angular = v2.angular + row.inverse_inertia2.mul(&angular2);
}

/// Scales a length down to a limit: `limit / length` where it is longer, else 1.
#[inline(always)]
fn cone_scale<const L: usize>(squared_length: Wide<L>, limit: Wide<L>) -> Wide<L> {
    let excess = squared_length - limit * limit;
    excess.if_positive(limit / squared_length.sqrt(), Wide::splat(1.0))
}

/// Rolling resistance: a torque against the relative spin, limited by the load.
#[inline(always)]
fn solve_rolling<const L: usize, const P: usize, const C: usize>(
    row: &NormalRow<L, P, C>,
    friction: &mut FrictionRow<L, P>,
    load: Wide<L>,
    v1: &mut WideVelocity<L>,
    v2: &mut WideVelocity<L>,
) {
    let response = row.inverse_inertia1.add(&row.inverse_inertia2);
    let old = friction.rolling_impulse;
    let wanted = old - response.solve(&(v2.angular - v1.angular));
    let new = wanted.scale(cone_scale(wanted.dot(&wanted), friction.rolling_resistance * load));
    friction.rolling_impulse = new;
    apply_torque(row, &(new - old), v1, v2);
}

/// Friction against turning about the normal.
#[inline(always)]
fn solve_twist<const L: usize, const P: usize, const C: usize>(
    row: &NormalRow<L, P, C>,
    friction: &mut FrictionRow<L, P>,
    twist_load: Wide<L>,
    v1: &mut WideVelocity<L>,
    v2: &mut WideVelocity<L>,
) {
    if P == 1 {
        return; // one point has no lever
    }
    let limit = friction.friction * twist_load;
    let old = friction.twist_impulse;
    let spin = row.normal.dot(&(v2.angular - v1.angular));
    let new = (old - friction.twist_mass * spin).min(limit).max(-limit);
    friction.twist_impulse = new;
    apply_torque(row, &row.normal.scale(new - old), v1, v2);
}

/// Friction against sliding: both tangents at once, inside the circle of the cone.
#[inline(always)]
fn solve_tangents<const L: usize, const P: usize, const C: usize>(
    row: &NormalRow<L, P, C>,
    friction: &mut FrictionRow<L, P>,
    load: Wide<L>,
    v1: &mut WideVelocity<L>,
    v2: &mut WideVelocity<L>,
) {
    let linear = v2.linear - v1.linear;
    let slip1 = friction.tangent1.dot(&linear) + friction.arm21.dot(&v2.angular)
        - friction.arm11.dot(&v1.angular)
        - friction.target1;
    let slip2 = friction.tangent2.dot(&linear) + friction.arm22.dot(&v2.angular)
        - friction.arm12.dot(&v1.angular)
        - friction.target2;
    let (old1, old2) = (friction.impulse1, friction.impulse2);
    let wanted1 = old1 - (friction.mass11 * slip1 + friction.mass12 * slip2);
    let wanted2 = old2 - (friction.mass12 * slip1 + friction.mass22 * slip2);
    let scale = cone_scale(wanted1 * wanted1 + wanted2 * wanted2, friction.friction * load);
    friction.impulse1 = wanted1 * scale;
    friction.impulse2 = wanted2 * scale;
    let change = [friction.impulse1 - old1, friction.impulse2 - old2];
    apply_friction(row, friction, change, v1, v2);
}
