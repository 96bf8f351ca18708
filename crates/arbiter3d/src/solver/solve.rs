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
use super::rows::{ExtraRow, FrictionRow, NormalRow, RowFeatures};
use crate::math::Real;
use crate::simd::{LaneVec3, Lanes, Number};

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

/// A wide row as a pass sees it.
pub(crate) struct RowPass<'a, W, const L: usize, const P: usize, const C: usize> {
    pub row: &'a mut NormalRow<W, L, P, C>,
    pub friction: &'a mut FrictionRow<W, P>,
    /// There if `features` has any.
    pub extra: Option<&'a mut ExtraRow<W, P>>,
    pub features: RowFeatures,
    pub states: &'a SharedStates<'a>,
}

/// Both bodies of a wide row.
struct Sides<W> {
    v1: WideVelocity<W>,
    d1: WideDisplacement<W>,
    v2: WideVelocity<W>,
    d2: WideDisplacement<W>,
}

impl<W: Lanes<L>, const L: usize, const P: usize, const C: usize> RowPass<'_, W, L, P, C> {
    /// Applies the impulses of the last step.
    ///
    /// # Safety
    /// No other thread may touch the dynamic bodies of the row.
    #[inline(always)]
    pub unsafe fn warm_start(self) {
        // SAFETY: promised by the caller.
        let mut sides = unsafe { self.gather() };
        let mut sum = Impulse::ZERO;
        for i in 0..P {
            sum.add_point(self.row, i, self.row.impulses[i]);
        }
        self.apply(&sum, &mut sides);
        let tangents = Tangents::of(self.row, self.friction);
        self.apply_friction(&tangents, [self.friction.impulse1, self.friction.impulse2], &mut sides);
        let twist = self.row.normal.scale(self.friction.twist_impulse);
        let torque = match &self.extra {
            Some(extra) if self.features.rolling => twist + extra.rolling_impulse,
            _ => twist,
        };
        self.apply_torque(&torque, &mut sides);
        // SAFETY: promised by the caller.
        unsafe { self.scatter(&sides) };
    }

    /// The biased pass.
    ///
    /// # Safety
    /// No other thread may touch the dynamic bodies of the row.
    #[inline(always)]
    pub unsafe fn solve(mut self, pass: &PassParameters) {
        // SAFETY: promised by the caller.
        let mut sides = unsafe { self.gather() };
        self.solve_normals::<true>(&mut sides, pass);
        // SAFETY: promised by the caller.
        unsafe { self.scatter(&sides) };
    }

    /// The unbiased pass, with friction.
    ///
    /// # Safety
    /// No other thread may touch the dynamic bodies of the row.
    #[inline(always)]
    pub unsafe fn relax(mut self, pass: &PassParameters) {
        // SAFETY: promised by the caller.
        let mut sides = unsafe { self.gather() };
        self.solve_normals::<false>(&mut sides, pass);
        let mut load = W::ZERO;
        let mut twist_load = W::ZERO;
        for i in 0..P {
            let impulse = self.row.impulses[i];
            self.friction.totals[i] += impulse;
            load += impulse;
            twist_load += impulse * self.friction.levers[i];
        }
        if self.features.rolling {
            self.solve_rolling(load, &mut sides);
        }
        self.solve_twist(twist_load, &mut sides);
        self.solve_tangents(load, &mut sides);
        // SAFETY: promised by the caller.
        unsafe { self.scatter(&sides) };
    }

    /// Gives points that were hit their share of the approach speed back.
    ///
    /// The points of a manifold share the bounce: what one gives, it gives to all through the coupling. One sweep over four
    /// points costs a box that lands flat 7 % of its height; eight leave less than a tenth of a percent.
    ///
    /// # Safety
    /// No other thread may touch the dynamic bodies of the row.
    #[inline(always)]
    pub unsafe fn restitute(self, pass: &PassParameters) {
        let Some(extra) = self.extra.as_deref().filter(|_| self.features.restitution) else { return };
        // SAFETY: promised by the caller.
        let mut sides = unsafe { self.gather() };
        let mut velocities = self.normal_velocities(&sides);
        let (row, friction) = (&mut *self.row, &mut *self.friction);
        let threshold = W::splat(-pass.restitution_threshold);
        let mut own = [W::ZERO; P];
        for (own, point) in own.iter_mut().zip(&row.points) {
            *own = point.mass.inverse_or_zero();
        }
        let mut sum = Impulse::ZERO;
        for _ in 0..if P > 1 { RESTITUTION_SWEEPS } else { 1 } {
            for i in 0..P {
                let target = extra.restitution * extra.approach[i];
                let old = row.impulses[i];
                let wanted = (old - row.points[i].mass * (velocities[i] + target)).max(W::ZERO);
                // Bounces only what hit: closing fast enough, and pressed within this step.
                let bounces = (threshold - extra.approach[i]).if_positive(friction.totals[i], W::ZERO);
                let new = (bounces * extra.restitution).if_positive(wanted, old);
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
        self.apply(&sum, &mut sides);
        // SAFETY: promised by the caller.
        unsafe { self.scatter(&sides) };
    }

    /// # Safety
    /// No other thread may touch the dynamic bodies of the row.
    #[inline(always)]
    unsafe fn gather(&self) -> Sides<W> {
        // SAFETY: promised by the caller.
        let (v1, d1) = unsafe { gather(self.states, &self.row.body1) };
        // SAFETY: promised by the caller.
        let (v2, d2) = unsafe { gather(self.states, &self.row.body2) };
        Sides { v1, d1, v2, d2 }
    }

    /// # Safety
    /// No other thread may touch the dynamic bodies of the row.
    #[inline(always)]
    unsafe fn scatter(&self, sides: &Sides<W>) {
        // SAFETY: promised by the caller.
        unsafe { scatter(self.states, &self.row.body1, (&sides.v1, &sides.d1)) };
        // SAFETY: promised by the caller.
        unsafe { scatter(self.states, &self.row.body2, (&sides.v2, &sides.d2)) };
    }

    /// Normal velocity at each point.
    #[inline(always)]
    fn normal_velocities(&self, sides: &Sides<W>) -> [W; P] {
        let (row, w1, w2) = (&*self.row, &sides.v1.angular, &sides.v2.angular);
        let common = row.normal.dot(&(sides.v2.linear - sides.v1.linear)) + row.offset.dot(w2);
        let spin = *w2 - *w1;
        let mut velocities = [common; P];
        for (velocity, point) in velocities.iter_mut().zip(&row.points) {
            *velocity = common + point.arm.dot(&spin);
        }
        velocities
    }

    /// Gap at each point now, to first order in the displacements of the step.
    #[inline(always)]
    fn separations(&self, sides: &Sides<W>) -> [W; P] {
        let (row, t1, t2) = (&*self.row, &sides.d1.turn, &sides.d2.turn);
        let common = row.normal.dot(&(sides.d2.translation - sides.d1.translation)) + row.offset.dot(t2);
        let turned = *t2 - *t1;
        let mut separations = [common; P];
        for (separation, point) in separations.iter_mut().zip(&row.points) {
            *separation = point.separation + common + point.arm.dot(&turned);
        }
        separations
    }

    /// One Gauss–Seidel sweep over the points of a row.
    #[inline(always)]
    fn solve_normals<const BIAS: bool>(&mut self, sides: &mut Sides<W>, pass: &PassParameters) {
        let separations = self.separations(sides);
        let mut velocities = self.normal_velocities(sides);
        let row = &mut *self.row;
        let inverse_substep = W::splat(pass.inverse_substep);
        let rate = W::splat(pass.softness.mass_scale * pass.softness.bias_rate);
        let (soft, one) = (W::splat(pass.softness.mass_scale), W::splat(1.0));
        let leak = W::splat(pass.softness.impulse_scale);
        let limit = W::splat(-pass.push_out_speed);
        let firmest = rate * W::splat(pass.deepest_rest);
        let mut sum = Impulse::ZERO;
        let mut pair = 0;
        for i in 0..P {
            let s = separations[i];
            let old = row.impulses[i];
            let change = if BIAS {
                let bias = s.if_positive(s * inverse_substep, (s * rate).max(limit));
                let scale = s.if_positive(one, soft);
                let leak = s.if_positive(W::ZERO, leak);
                row.points[i].mass * (scale * velocities[i] + bias) + (leak * old).min(row.points[i].mass * firmest)
            } else {
                row.points[i].mass * (velocities[i] + s.max(W::ZERO) * inverse_substep)
            };
            let new = (old - change).max(W::ZERO);
            let delta = new - old;
            row.impulses[i] = new;
            for later in &mut velocities[i + 1..] {
                *later += row.coupling[pair] * delta;
                pair += 1;
            }
            sum.add_point(row, i, delta);
        }
        self.apply(&sum, sides);
    }

    /// Rolling resistance: a torque against the relative spin, limited by the load.
    #[inline(always)]
    fn solve_rolling(&mut self, load: W, sides: &mut Sides<W>) {
        let Some(extra) = &mut self.extra else { return };
        let response = self.row.inverse_inertia1.add(&self.row.inverse_inertia2);
        let old = extra.rolling_impulse;
        let wanted = old - response.solve(&(sides.v2.angular - sides.v1.angular));
        let new = wanted.scale(cone_scale(wanted.dot(&wanted), extra.rolling_resistance * load));
        extra.rolling_impulse = new;
        self.apply_torque(&(new - old), sides);
    }

    /// Friction against turning about the normal.
    #[inline(always)]
    fn solve_twist(&mut self, twist_load: W, sides: &mut Sides<W>) {
        if P == 1 {
            return; // one point has no lever
        }
        let limit = self.friction.friction * twist_load;
        let old = self.friction.twist_impulse;
        let spin = self.row.normal.dot(&(sides.v2.angular - sides.v1.angular));
        let new = (old - self.friction.twist_mass * spin).min(limit).max(-limit);
        self.friction.twist_impulse = new;
        self.apply_torque(&self.row.normal.scale(new - old), sides);
    }

    /// Friction against sliding: both tangents at once, inside the circle of the cone.
    #[inline(always)]
    fn solve_tangents(&mut self, load: W, sides: &mut Sides<W>) {
        let tangents = Tangents::of(self.row, self.friction);
        let friction = &mut *self.friction;
        let slide = sides.v2.linear - sides.v1.linear + sides.v2.angular.cross(&friction.lever2)
            - sides.v1.angular.cross(&friction.lever1);
        let (mut slip1, mut slip2) = (tangents.first.dot(&slide), tangents.second.dot(&slide));
        if let (true, Some(extra)) = (self.features.conveyor, &self.extra) {
            (slip1, slip2) = (slip1 - extra.target1, slip2 - extra.target2);
        }
        let (old1, old2) = (friction.impulse1, friction.impulse2);
        let wanted1 = old1 - (friction.mass11 * slip1 + friction.mass12 * slip2);
        let wanted2 = old2 - (friction.mass12 * slip1 + friction.mass22 * slip2);
        let scale = cone_scale(wanted1 * wanted1 + wanted2 * wanted2, friction.friction * load);
        friction.impulse1 = wanted1 * scale;
        friction.impulse2 = wanted2 * scale;
        let change = [friction.impulse1 - old1, friction.impulse2 - old2];
        self.apply_friction(&tangents, change, sides);
    }

    /// Applies the impulses of all points.
    #[inline(always)]
    fn apply(&self, sum: &Impulse<W>, sides: &mut Sides<W>) {
        self.apply_linear(&self.row.normal.scale(sum.along_normal), sides);
        let angular2 = sum.angular.add_scaled(&self.row.offset, sum.along_normal);
        sides.v1.angular = sides.v1.angular - self.row.inverse_inertia1.mul(&sum.angular);
        sides.v2.angular = sides.v2.angular + self.row.inverse_inertia2.mul(&angular2);
    }

    /// Applies tangential impulses at the friction centre.
    #[inline(always)]
    fn apply_friction(&self, tangents: &Tangents<W>, [impulse1, impulse2]: [W; 2], sides: &mut Sides<W>) {
        let impulse = tangents.first.scale(impulse1).add_scaled(&tangents.second, impulse2);
        self.apply_linear(&impulse, sides);
        let angular1 = self.friction.lever1.cross(&impulse);
        let angular2 = self.friction.lever2.cross(&impulse);
        sides.v1.angular = sides.v1.angular - self.row.inverse_inertia1.mul(&angular1);
        sides.v2.angular = sides.v2.angular + self.row.inverse_inertia2.mul(&angular2);
    }

    /// Pushes body 2 by `impulse` and body 1 by its opposite.
    #[inline(always)]
    fn apply_linear(&self, impulse: &LaneVec3<W>, sides: &mut Sides<W>) {
        let mut push1 = impulse.scale(self.row.inverse_mass1);
        let mut push2 = impulse.scale(self.row.inverse_mass2);
        if let (true, Some(extra)) = (self.features.locks, &self.extra) {
            (push1, push2) = (push1.times(&extra.free1), push2.times(&extra.free2));
        }
        sides.v1.linear = sides.v1.linear - push1;
        sides.v2.linear = sides.v2.linear + push2;
    }

    /// Turns body 2 by the angular impulse and body 1 by its opposite.
    #[inline(always)]
    fn apply_torque(&self, impulse: &LaneVec3<W>, sides: &mut Sides<W>) {
        sides.v1.angular = sides.v1.angular - self.row.inverse_inertia1.mul(impulse);
        sides.v2.angular = sides.v2.angular + self.row.inverse_inertia2.mul(impulse);
    }
}

/// Sweeps of the bounce over the points of a manifold; once a step, and only where something bounces.
const RESTITUTION_SWEEPS: usize = 8;

/// Place of the points `i < j` in [`NormalRow::coupling`].
#[inline(always)]
const fn pair_of<const P: usize>(i: usize, j: usize) -> usize {
    i * P - i * (i + 1) / 2 + j - i - 1
}

/// The plane of friction.
struct Tangents<W> {
    first: LaneVec3<W>,
    second: LaneVec3<W>,
}

impl<W: Number> Tangents<W> {
    #[inline(always)]
    fn of<const L: usize, const P: usize, const C: usize>(
        row: &NormalRow<W, L, P, C>,
        friction: &FrictionRow<W, P>,
    ) -> Self {
        Self { first: friction.tangent1, second: row.normal.cross(&friction.tangent1) }
    }
}

/// Impulses of several points gathered up, to be applied at once.
struct Impulse<W> {
    along_normal: W,
    /// About the centre of body 1.
    angular: LaneVec3<W>,
}

impl<W: Number> Impulse<W> {
    const ZERO: Self = Self { along_normal: W::ZERO, angular: LaneVec3::ZERO };

    #[inline(always)]
    fn add_point<const L: usize, const P: usize, const C: usize>(
        &mut self,
        row: &NormalRow<W, L, P, C>,
        point: usize,
        impulse: W,
    ) {
        self.along_normal += impulse;
        self.angular = self.angular.add_scaled(&row.points[point].arm, impulse);
    }
}

/// Scales a length down to a limit: `limit / length` where it is longer, else 1.
#[inline(always)]
fn cone_scale<W: Number>(squared_length: W, limit: W) -> W {
    let excess = squared_length - limit * limit;
    excess.if_positive(limit / squared_length.sqrt(), W::splat(1.0))
}
