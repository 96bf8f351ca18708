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
    pub squares: SquareScale,
}

/// Powers of two that bring impulses near one before they are squared, by the length unit of the world. A world of
/// millimetres has impulses of 10⁻¹² N s (mass by the cube of the length, speed by the length) and angular ones of
/// 10⁻¹⁵ N m s, whose squares fall out of single precision where friction is weak. Powers of two change no other bit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SquareScale {
    pub linear: Real,
    pub angular: Real,
}

impl SquareScale {
    /// For lengths of about `length_unit`, from 10⁻⁶ to 10⁶.
    pub fn new(length_unit: Real) -> Self {
        /// The bits of the exponent alone: the largest power of two that is no larger.
        const EXPONENT: u32 = 0x7f80_0000;
        let unit = Real::from_bits(length_unit.to_bits() & EXPONENT);
        let squared = unit * unit;
        Self { linear: 1.0 / (squared * squared), angular: 1.0 / (squared * squared * unit) }
    }
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
            self.solve_rolling(load, &mut sides, pass);
        }
        self.solve_twist(twist_load, &mut sides);
        self.solve_tangents(load, &mut sides, pass);
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
    fn solve_rolling(&mut self, load: W, sides: &mut Sides<W>, pass: &PassParameters) {
        let Some(extra) = &mut self.extra else { return };
        let response = self.row.inverse_inertia1.add(&self.row.inverse_inertia2);
        let old = extra.rolling_impulse;
        let wanted = old - response.solve(&(sides.v2.angular - sides.v1.angular));
        let near_one = W::splat(pass.squares.angular);
        let (length, limit) = (wanted.scale(near_one), extra.rolling_resistance * load * near_one);
        let new = wanted.scale(cone_scale(length.dot(&length), limit));
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
    fn solve_tangents(&mut self, load: W, sides: &mut Sides<W>, pass: &PassParameters) {
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
        let near_one = W::splat(pass.squares.linear);
        let (w1, w2, limit) = (wanted1 * near_one, wanted2 * near_one, friction.friction * load * near_one);
        let scale = cone_scale(w1 * w1 + w2 * w2, limit);
        (friction.impulse1, friction.impulse2) = (wanted1 * scale, wanted2 * scale);
        if let Some(extra) = &self.extra
            && self.features.anisotropic
        {
            let (on1, on2) = on_ellipse(friction, [w1, w2], extra.ratio, limit);
            let back = W::splat(1.0 / pass.squares.linear);
            friction.impulse1 = extra.ratio.if_positive(on1 * back, friction.impulse1);
            friction.impulse2 = extra.ratio.if_positive(on2 * back, friction.impulse2);
        }
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

/// Newton steps towards the ellipse of anisotropic friction.
const ELLIPSE_STEPS: usize = 6;

/// The friction impulse inside the ellipse `(f₁ / r)² + f₂² ≤ limit²` that leaves least energy of sliding.
///
/// With `f = D y`, `D = diag(r, 1)` and the response `K = D A D`, that is the `y` of length `limit` at most that is
/// nearest to the wanted one `w` in the metric of `K`: `(K + λ) y = K w` for a `λ ≥ 0` that makes the length right,
/// found by Newton's method on `1 / |y|`, which is nearly straight in `λ` (Moré and Sorensen, "Computing a trust region
/// step", 1983). Merely shortening `w`, as in a circle, would let a ski that is pushed at an angle drift off sideways.
#[inline(always)]
fn on_ellipse<W: Number, const P: usize>(friction: &FrictionRow<W, P>, wanted: [W; 2], ratio: W, limit: W) -> (W, W) {
    let (zero, one) = (W::ZERO, W::splat(1.0));
    // The response is the inverse of the mass; everything is measured in limits, so that loads of any size are alike.
    let (m11, m12, m22) = (friction.mass11, friction.mass12, friction.mass22);
    let inverse = (m11 * m22 - m12 * m12).inverse_or_zero();
    let (k11, k12, k22) = (m22 * inverse * ratio * ratio, -(m12 * inverse * ratio), m11 * inverse);
    let unit = limit.inverse_or_zero();
    let (w1, w2) = (wanted[0] * unit * ratio.inverse_or_zero(), wanted[1] * unit);
    let (b1, b2) = (k11 * w1 + k12 * w2, k12 * w1 + k22 * w2);
    let (mut shift, mut y1, mut y2) = (zero, w1, w2);
    for _ in 0..ELLIPSE_STEPS {
        let (length, inverse) = ((y1 * y1 + y2 * y2).sqrt(), inverse_of(k11, k12, k22, shift));
        let curve = inverse.0 * y1 * y1 + (inverse.1 + inverse.1) * y1 * y2 + inverse.2 * y2 * y2;
        shift = (shift + length * length * curve.inverse_or_zero() * (length - one)).max(zero);
        let (i11, i12, i22) = inverse_of(k11, k12, k22, shift);
        (y1, y2) = (i11 * b1 + i12 * b2, i12 * b1 + i22 * b2);
    }
    let inside = one - (w1 * w1 + w2 * w2);
    let (y1, y2) = (inside.if_positive(w1, y1), inside.if_positive(w2, y2));
    let scale = cone_scale(y1 * y1 + y2 * y2, one) * limit;
    // Numbers beyond reckoning push nothing.
    let (f1, f2) = (y1 * scale * ratio, y2 * scale);
    let sound = (limit * limit * W::splat(1.001)).if_at_least(y1 * scale * (y1 * scale) + f2 * f2, limit, zero);
    (sound.if_positive(f1, zero), sound.if_positive(f2, zero))
}

/// The inverse of a symmetric 2×2 matrix with `shift` on its diagonal, as `(11, 12, 22)`.
#[inline(always)]
fn inverse_of<W: Number>(k11: W, k12: W, k22: W, shift: W) -> (W, W, W) {
    let (a, d) = (k11 + shift, k22 + shift);
    let inverse = (a * d - k12 * k12).inverse_or_zero();
    (d * inverse, -(k12 * inverse), a * inverse)
}

/// Scales a length down to a limit: `limit / length` where it is longer, else 1.
#[inline(always)]
fn cone_scale<W: Number>(squared_length: W, limit: W) -> W {
    let excess = squared_length - limit * limit;
    excess.if_positive(limit / squared_length.sqrt(), W::splat(1.0))
}

#[cfg(test)]
mod tests {
    use super::{Number, on_ellipse};
    use crate::math::Real;
    use crate::simd::Wide;
    use crate::solver::rows::FrictionRow;

    /// The impulse for a response `[k11, k12, k22]`, one lane wide.
    fn solve([k11, k12, k22]: [Real; 3], wanted: [Real; 2], ratio: Real, limit: Real) -> [Real; 2] {
        let determinant = k11 * k22 - k12 * k12;
        let mut friction = FrictionRow::<Wide<1>, 4>::EMPTY;
        friction.mass11 = Wide::splat(k22 / determinant);
        friction.mass12 = Wide::splat(-k12 / determinant);
        friction.mass22 = Wide::splat(k11 / determinant);
        let (f1, f2) = on_ellipse(&friction, wanted.map(Wide::splat), Wide::splat(ratio), Wide::splat(limit));
        [f1.0[0], f2.0[0]]
    }

    /// Energy of sliding that is left, but for a constant.
    fn energy([k11, k12, k22]: [Real; 3], f: [Real; 2], wanted: [Real; 2]) -> f64 {
        let [x, y] = [0, 1].map(|axis| f64::from(f[axis]) - f64::from(wanted[axis]));
        f64::from(k11) * x * x + 2.0 * f64::from(k12) * x * y + f64::from(k22) * y * y
    }

    /// No point of the ellipse leaves less energy than the one found, whatever the ratio, the response and the load.
    #[test]
    fn the_impulse_on_the_ellipse_leaves_least_energy() {
        for ratio in [0.001, 0.02, 0.1, 0.5, 0.99, 1.5, 10.0, 1000.0_f32] {
            for response in [[1.0, 0.0, 1.0], [2.0, 0.7, 0.5], [0.01, -0.005, 0.004]] {
                for wanted in [[3.0, 4.0], [-30.0, 1.0], [0.3, -0.02], [1e3, 1e3], [0.0, -5.0], [2.0, 0.0_f32]] {
                    for limit in [0.01, 1.0, 3.0_f32] {
                        let f = solve(response, wanted, ratio, limit);
                        let length = ((f[0] / ratio).powi(2) + f[1] * f[1]).sqrt();
                        assert!(length <= 1.0002 * limit, "{f:?} is outside");
                        let found = energy(response, f, wanted);
                        let best = (0..7200)
                            .map(|step| {
                                let angle = step as Real * (std::f32::consts::TAU / 7200.0);
                                let on = [ratio * limit * libm::cosf(angle), limit * libm::sinf(angle)];
                                energy(response, on, wanted)
                            })
                            .fold(Real::INFINITY as f64, f64::min);
                        let inside = (wanted[0] / ratio).powi(2) + wanted[1] * wanted[1] < limit * limit;
                        let least = if inside { 0.0 } else { best };
                        let scale = energy(response, [0.0; 2], wanted);
                        let what = format!("ratio {ratio}, {response:?}, wanted {wanted:?}, limit {limit}");
                        assert!(found <= least + 1e-3 * scale, "{what}: {f:?} leaves {found} of {scale}, not {least}");
                        // Measured by what friction can change at all.
                        let change = scale - least;
                        assert!(scale - found >= 0.99 * change - 1e-6 * scale, "{what}: {f:?} takes {}", scale - found);
                    }
                }
            }
        }
    }

    /// No load or absurd numbers push nothing that is not a number.
    #[test]
    fn without_load_or_sense_the_ellipse_pushes_nothing() {
        assert_eq!(solve([1.0, 0.0, 1.0], [3.0, 4.0], 0.1, 0.0), [0.0, 0.0]);
        for (wanted, limit) in
            [([1e30, -1e30], 1e-30), ([1e38, 1e38], 1.0), ([1e-30, 1e-38], 1e-38), ([1.0, 1.0], 1e38)]
        {
            for ratio in [0.001, 1000.0] {
                let f = solve([1.0, 0.5, 1.0], wanted, ratio, limit);
                assert!(f.iter().all(|x| x.is_finite()), "{wanted:?}, {limit}, {ratio}: {f:?}");
            }
        }
    }
}
