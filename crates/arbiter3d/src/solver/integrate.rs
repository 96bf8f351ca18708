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
//!
//! Bodies are independent: as many as there are lanes are integrated together, in blocks on all threads.

use super::bodies::{BodyMass, BodyMotion, BodyState, SolverBodies};
use super::coloring::RowPlan;
use crate::math::Real;
use crate::parallel::SharedSlice;
use crate::simd::{Kernel, LaneRotation, LaneSymmetric, LaneVec3, Lanes, Number, Quad};
use std::marker::PhantomData;
use std::ops::Range;

/// Spin below which its own torque is left out, radians a substep: the change of ω is that share of ω.
const GYROSCOPIC_TURN: Real = 1e-5;

/// Share of the energy before that a torque-free spin may have after a substep; past that its torque is left out.
const MOST_ENERGY: Real = 1.02;

/// What the integrator needs to know of the step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct IntegrateParameters {
    pub substep: Real,
    pub max_linear_speed: Real,
    pub max_angular_speed: Real,
}

/// What to do with the bodies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Integration {
    /// Velocities at the beginning of the first substep, where there is nothing to warm start with yet.
    FirstVelocities,
    /// Velocities at the beginning of a substep.
    Velocities,
    /// Positions at the end of a substep.
    Positions,
}

/// The bodies to integrate, as the threads share them.
pub(crate) struct IntegrateTarget<'a> {
    awake: &'a [u32],
    states: SharedSlice<'a, BodyState>,
    motions: SharedSlice<'a, BodyMotion>,
    masses: SharedSlice<'a, BodyMass>,
    plan: &'a RowPlan,
}

impl<'a> IntegrateTarget<'a> {
    /// Integrates the bodies of a list in which each stands once.
    pub fn new(awake: &'a [u32], bodies: &'a mut SolverBodies, plan: &'a RowPlan) -> Self {
        assert!(awake.iter().all(|&body| (body as usize) < bodies.states.len()), "the list is of other bodies");
        Self {
            awake,
            states: SharedSlice::new(&mut bodies.states),
            motions: SharedSlice::new(&mut bodies.motions),
            masses: SharedSlice::new(&mut bodies.masses),
            plan,
        }
    }

    /// How many groups of as many bodies as there are lanes.
    pub fn groups_of(&self, lanes: usize) -> usize {
        self.awake.len().div_ceil(lanes)
    }
}

/// Integrates some groups of the list.
pub(super) struct IntegrateKernel<'a, W, const L: usize> {
    pub target: &'a IntegrateTarget<'a>,
    pub groups: Range<usize>,
    pub phase: Integration,
    pub parameters: &'a IntegrateParameters,
    pub lanes: PhantomData<W>,
}

/// Stands in for bodies that a group lacks.
static NO_STATE: BodyState = BodyState::NONE;
static NO_MOTION: BodyMotion = BodyMotion::NONE;
static NO_MASS: BodyMass = BodyMass::NONE;

impl<W: Lanes<L>, const L: usize> Kernel for IntegrateKernel<'_, W, L> {
    #[inline(always)]
    fn run(self) {
        let awake = self.target.awake;
        let awake = &awake[self.groups.start * L..(self.groups.end * L).min(awake.len())];
        for bodies in awake.chunks(L) {
            // SAFETY: a body stands in the list once, and this run alone has this part of the list.
            unsafe {
                match self.phase {
                    Integration::FirstVelocities => velocities::<W, L>(self.target, bodies, self.parameters, true),
                    Integration::Velocities => velocities::<W, L>(self.target, bodies, self.parameters, false),
                    Integration::Positions => positions::<W, L>(self.target, bodies, self.parameters),
                }
            }
        }
    }
}

/// A vector of the first three columns.
#[inline(always)]
fn vector<W: Number>([x, y, z, _]: [W; 4]) -> LaneVec3<W> {
    LaneVec3 { x, y, z }
}

/// Velocities at the beginning of a substep.
///
/// # Safety
/// No other thread may touch the bodies.
#[inline(always)]
unsafe fn velocities<W: Lanes<L>, const L: usize>(
    target: &IntegrateTarget<'_>,
    bodies: &[u32],
    parameters: &IntegrateParameters,
    first: bool,
) {
    let mut states = [NO_STATE.quads(); L];
    let mut motions = [NO_MOTION.quads(); L];
    for (lane, &body) in bodies.iter().enumerate() {
        // SAFETY: promised by the caller; in bounds by `IntegrateTarget::new`.
        unsafe {
            states[lane] = target.states.get(body as usize).quads();
            motions[lane] = target.motions.get(body as usize).quads();
        }
    }
    let [vx, vy, vz, wx] = W::load_quad(&states, 0);
    let [wy, wz, px, py] = W::load_quad(&states, 1);
    let (mut linear, mut angular) = (LaneVec3 { x: vx, y: vy, z: vz }, LaneVec3 { x: wx, y: wy, z: wz });
    let (free_linear, free_angular) = (W::load_quad(&motions, 0), W::load_quad(&motions, 1));
    let (acceleration, angular_acceleration) = (W::load_quad(&motions, 2), W::load_quad(&motions, 3));
    let mut residual = vector(W::load_quad(&motions, 4));
    let (mut warm_linear, mut warm_angular) = (LaneVec3::ZERO, LaneVec3::ZERO);
    if !first {
        (warm_linear, warm_angular) = (linear - vector(free_linear), angular - vector(free_angular));
    }
    let h = W::splat(parameters.substep);
    let gained = vector(acceleration).scale(h) - residual;
    let sum = linear + gained;
    residual = (sum - linear) - gained;
    linear = sum;
    angular = angular + vector(angular_acceleration).scale(h);
    let one = W::splat(1.0);
    linear = linear.scale(one / (one + h * free_linear[3]));
    angular = angular.scale(one / (one + h * free_angular[3]));
    linear = limit(linear, parameters.max_linear_speed);
    angular = limit(angular, parameters.max_angular_speed);
    let finite = finiteness(&linear) + finiteness(&angular) + finiteness(&warm_linear) + finiteness(&warm_angular);
    let finite = one - finite;
    let broken = finite.if_positive(W::ZERO, one);
    for part in [&mut linear, &mut angular, &mut warm_linear, &mut warm_angular, &mut residual] {
        *part = part.if_positive(finite);
    }
    let (v, w) = (linear + warm_linear, angular + warm_angular);
    let state = [W::store(&[v.x, v.y, v.z, w.x]), W::store(&[w.y, w.z, px, py])];
    let free_linear = W::store(&[linear.x, linear.y, linear.z, free_linear[3]]);
    let free_angular = W::store(&[angular.x, angular.y, angular.z, free_angular[3]]);
    let residual = W::store(&[residual.x, residual.y, residual.z, broken]);
    let kinematic = acceleration[3].to_array();
    for (lane, &body) in bodies.iter().enumerate() {
        if kinematic[lane] == 0.0 {
            // SAFETY: promised by the caller; in bounds by `IntegrateTarget::new`.
            unsafe {
                let quads = target.states.get_unchecked_mut(body as usize).quads_mut();
                (quads[0], quads[1]) = (state[0][lane], state[1][lane]);
                let quads = target.motions.get_unchecked_mut(body as usize).quads_mut();
                (quads[0], quads[1], quads[4]) = (free_linear[lane], free_angular[lane], residual[lane]);
            }
            if first && target.plan.constrains(body as usize) {
                // SAFETY: as above.
                unsafe { target.states.get_unchecked_mut(body as usize) }.constrained = 1.0;
            }
        }
    }
}

/// Zero where a vector is finite, else not a number.
#[inline(always)]
fn finiteness<W: Number>(v: &LaneVec3<W>) -> W {
    v.x * W::ZERO + v.y * W::ZERO + v.z * W::ZERO
}

/// Vectors no longer than `longest`.
#[inline(always)]
fn limit<W: Number>(v: LaneVec3<W>, longest: Real) -> LaneVec3<W> {
    let longest = W::splat(longest);
    let excess = v.dot(&v) - longest * longest;
    // Scaled first, since the square of a finite length may be infinite.
    let largest = v.x.max(-v.x).max(v.y.max(-v.y)).max(v.z.max(-v.z));
    let scaled = v.scale(W::splat(1.0) / largest);
    let limited = scaled.scale(longest / scaled.dot(&scaled).sqrt());
    LaneVec3 {
        x: excess.if_positive(limited.x, v.x),
        y: excess.if_positive(limited.y, v.y),
        z: excess.if_positive(limited.z, v.z),
    }
}

/// Positions at the end of a substep.
///
/// # Safety
/// No other thread may touch the bodies.
#[inline(always)]
unsafe fn positions<W: Lanes<L>, const L: usize>(
    target: &IntegrateTarget<'_>,
    bodies: &[u32],
    parameters: &IntegrateParameters,
) {
    let mut states = [NO_STATE.quads(); L];
    let mut motions = [NO_MOTION.quads(); L];
    let mut masses = [NO_MASS.quads(); L];
    for (lane, &body) in bodies.iter().enumerate() {
        // SAFETY: promised by the caller; in bounds by `IntegrateTarget::new`.
        unsafe {
            states[lane] = target.states.get(body as usize).quads();
            motions[lane] = target.motions.get(body as usize).quads();
            masses[lane] = target.masses.get(body as usize).quads();
        }
    }
    let [vx, vy, vz, wx] = W::load_quad(&states, 0);
    let [wy, wz, px, py] = W::load_quad(&states, 1);
    let [pz, tx, ty, tz] = W::load_quad(&states, 2);
    let constrained = W::load_quad(&states, 3)[0];
    let acceleration = W::load_quad(&motions, 2);
    let gyroscopic = W::load_quad(&motions, 3)[3];
    let [cx, cy, cz, qx] = W::load_quad(&masses, 0);
    let [qy, qz, qw, mx] = W::load_quad(&masses, 1);
    let (linear, mut angular) = (LaneVec3 { x: vx, y: vy, z: vz }, LaneVec3 { x: wx, y: wy, z: wz });
    let rotation = LaneRotation { vector: LaneVec3 { x: qx, y: qy, z: qz }, w: qw };
    let h = W::splat(parameters.substep);
    let free = W::splat(1.0) - constrained - acceleration[3];
    let fall = vector(acceleration).scale(W::splat(0.5) * h * h).if_positive(free);
    let position = LaneVec3 { x: px, y: py, z: pz } + (linear.scale(h) - fall);
    let mut angle = angular.scale(h);
    let spins = gyroscopic * (angle.dot(&angle) - W::splat(GYROSCOPIC_TURN * GYROSCOPIC_TURN));
    if spins.to_array().iter().any(|&excess| excess > 0.0) {
        let body = Spinning::load(&motions, rotation);
        let (mean, end) = body.spin(angular, h);
        angle = select(spins, &mean.scale(h), &angle);
        let end = select(spins, &end, &angular);
        // The change is free motion, not a contact's doing.
        let free = body.free_angular + (end - angular);
        let free = W::store(&[free.x, free.y, free.z, body.damping]);
        angular = end;
        for (lane, &body) in bodies.iter().enumerate() {
            // SAFETY: promised by the caller; in bounds by `IntegrateTarget::new`.
            unsafe { target.motions.get_unchecked_mut(body as usize).quads_mut()[1] = free[lane] };
        }
    }
    let turned = angle.dot(&angle);
    let turn = LaneVec3 { x: tx, y: ty, z: tz } + angle.if_positive(turned);
    let q = rotation.integrate(&angle);
    let q =
        LaneRotation { vector: select(turned, &q.vector, &rotation.vector), w: turned.if_positive(q.w, rotation.w) };
    let state = [
        W::store(&[vx, vy, vz, angular.x]),
        W::store(&[angular.y, angular.z, position.x, position.y]),
        W::store(&[position.z, turn.x, turn.y, turn.z]),
    ];
    let mass = [W::store(&[cx, cy, cz, q.vector.x]), W::store(&[q.vector.y, q.vector.z, q.w, mx])];
    for (lane, &body) in bodies.iter().enumerate() {
        // SAFETY: promised by the caller; in bounds by `IntegrateTarget::new`.
        unsafe {
            let quads = target.states.get_unchecked_mut(body as usize).quads_mut();
            (quads[0], quads[1], quads[2]) = (state[0][lane], state[1][lane], state[2][lane]);
            let quads = target.masses.get_unchecked_mut(body as usize).quads_mut();
            (quads[0], quads[1]) = (mass[0][lane], mass[1][lane]);
        }
    }
}

/// `yes` where `mask > 0`, else `no`.
#[inline(always)]
fn select<W: Number>(mask: W, yes: &LaneVec3<W>, no: &LaneVec3<W>) -> LaneVec3<W> {
    LaneVec3 { x: mask.if_positive(yes.x, no.x), y: mask.if_positive(yes.y, no.y), z: mask.if_positive(yes.z, no.z) }
}

/// Bodies whose spin changes by itself.
struct Spinning<W> {
    rotation: LaneRotation<W>,
    free_angular: LaneVec3<W>,
    damping: W,
    inertia: LaneSymmetric<W>,
    inverse_inertia: LaneSymmetric<W>,
}

impl<W: Number> Spinning<W> {
    #[inline(always)]
    fn load<const L: usize>(motions: &[&[Quad; 8]; L], rotation: LaneRotation<W>) -> Self
    where
        W: Lanes<L>,
    {
        let [fx, fy, fz, damping] = W::load_quad(motions, 1);
        let [xx, yy, zz, xy] = W::load_quad(motions, 5);
        let [xz, yz, ixx, iyy] = W::load_quad(motions, 6);
        let [izz, ixy, ixz, iyz] = W::load_quad(motions, 7);
        Self {
            rotation,
            free_angular: LaneVec3 { x: fx, y: fy, z: fz },
            damping,
            inertia: LaneSymmetric { xx, yy, zz, xy, xz, yz },
            inverse_inertia: LaneSymmetric { xx: ixx, yy: iyy, zz: izz, xy: ixy, xz: ixz, yz: iyz },
        }
    }

    /// Mean and final angular velocity of a torque-free spin over `h`.
    #[inline(always)]
    fn spin(&self, angular_velocity: LaneVec3<W>, h: W) -> (LaneVec3<W>, LaneVec3<W>) {
        let momentum = through(&self.rotation, &self.inertia, &angular_velocity);
        let mean =
            self.at(&self.rotation.integrate(&angular_velocity.scale(W::splat(0.5) * h)), &angular_velocity, &momentum);
        let end = self.at(&self.rotation.integrate(&mean.scale(h)), &angular_velocity, &momentum);
        // Twice the energies are ω · L. Where a slender body turns far, an error of the axis is multiplied by the ratio of its
        // inertias: spin that stays as it is keeps the energy.
        let gained = end.dot(&momentum) - angular_velocity.dot(&momentum) * W::splat(MOST_ENERGY);
        (select(gained, &angular_velocity, &mean), select(gained, &angular_velocity, &end))
    }

    /// Angular velocity that has the momentum in another orientation: `ω' = ω + I'⁻¹ (L − I' ω)` rather than `I'⁻¹ L`,
    /// so that rounding errs by a share of the change, not of the whole.
    #[inline(always)]
    fn at(&self, q: &LaneRotation<W>, angular_velocity: &LaneVec3<W>, momentum: &LaneVec3<W>) -> LaneVec3<W> {
        let missing = *momentum - through(q, &self.inertia, angular_velocity);
        *angular_velocity + through(q, &self.inverse_inertia, &missing)
    }
}

/// A matrix in body axes applied to a world vector.
#[inline(always)]
fn through<W: Number>(q: &LaneRotation<W>, m: &LaneSymmetric<W>, v: &LaneVec3<W>) -> LaneVec3<W> {
    q.rotate(&m.mul(&q.inverse_rotate(v)))
}
