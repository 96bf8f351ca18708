//! The bodies as the solver sees them: three records a body, by how often they are read.
//!
//! `BodyState` (64 bytes, one cache line) is what rows gather and scatter in every pass. `BodyMass` (64 bytes) is read when
//! rows are prepared. `BodyMotion` is read by the integrator alone. All are indexed by body slot: a sleeping body costs
//! nothing but its place.

use crate::math::{Pose, Real, Rotation, SymmetricMat3, Vec3};
use crate::parallel::SharedSlice;
use crate::simd::{LaneVec3, Lanes, quad_view};
use crate::storage;

/// Marks a body index in a row whose body is not to be written.
pub(crate) const READ_ONLY: u32 = 1 << 31;

/// Velocities, and how far the body has come within this step.
///
/// Twelve numbers in the order in which rows gather them: linear velocity, angular velocity, translation since the step
/// began, and the rotation vector since then. The separation of a contact to first order needs no more.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct BodyState {
    pub linear_velocity: Vec3,
    pub angular_velocity: Vec3,
    pub translation: Vec3,
    pub turn: Vec3,
    /// 1 if a row acts on the body in this step, else 0.
    pub constrained: Real,
    /// Whether contacts can move the body at all: dynamic, enabled, not locked on all axes.
    pub moves: u32,
    /// Whether contacts cannot move it along some axis, but can along others.
    pub locked: u32,
    unused: u32,
}

impl BodyState {
    /// A body that rests and is not there.
    pub const NONE: Self = Self {
        linear_velocity: Vec3::ZERO,
        angular_velocity: Vec3::ZERO,
        translation: Vec3::ZERO,
        turn: Vec3::ZERO,
        constrained: 0.0,
        moves: 0,
        locked: 0,
        unused: 0,
    };
}

impl Default for BodyState {
    fn default() -> Self {
        Self::NONE
    }
}

impl BodyState {
    /// Whether nothing moves the body and it does not move by itself.
    #[inline(always)]
    pub fn is_fixed(&self) -> bool {
        self.moves == 0 && self.linear_velocity == Vec3::ZERO && self.angular_velocity == Vec3::ZERO
    }

    quad_view! {
        /// The record as groups of four numbers, the first three of which are its twelve.
        pub fn quads,
        /// The same, to change; the fourth group is to be left alone.
        quads_mut;
        [4] of (linear_velocity, angular_velocity, translation, turn, constrained, moves, locked, unused)
    }
}

/// Where the mass is and how it resists: world axes, locks included.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct BodyMass {
    /// Centre of mass, world.
    pub center: Vec3,
    pub rotation: Rotation,
    /// Inverse mass along each world axis: zero where locked.
    pub inverse_mass: Vec3,
    /// Inverse inertia about the centre, world axes: zero rows where locked.
    pub inverse_inertia: SymmetricMat3,
}

impl BodyMass {
    /// A body at the origin that nothing moves.
    pub const NONE: Self = Self {
        center: Vec3::ZERO,
        rotation: Rotation::IDENTITY,
        inverse_mass: Vec3::ZERO,
        inverse_inertia: SymmetricMat3::ZERO,
    };
}

impl Default for BodyMass {
    fn default() -> Self {
        Self::NONE
    }
}

impl BodyMass {
    quad_view! {
        /// The record as groups of four numbers.
        pub fn quads,
        /// The same, to change.
        quads_mut;
        [4] of (center, rotation, inverse_mass, inverse_inertia)
    }

    /// Pose of the frame at the centre of mass.
    #[inline(always)]
    pub fn pose(&self) -> Pose {
        Pose::new(self.center, self.rotation)
    }
}

/// What the integrator needs: 128 bytes, in groups of four numbers as it loads them.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct BodyMotion {
    /// Velocities before this substep's contact impulses; what they added is warm starting for the next substep.
    pub free_linear: Vec3,
    pub linear_damping: Real,
    pub free_angular: Vec3,
    pub angular_damping: Real,
    /// Acceleration by gravity and forces in this step.
    pub acceleration: Vec3,
    /// 1 if nothing but its velocity moves it, else 0.
    pub kinematic: Real,
    pub angular_acceleration: Vec3,
    /// 1 if the torque-free spin changes, else 0: the inertia is not that of a ball, and no rotation is locked.
    pub gyroscopic: Real,
    /// What rounding has lost when gravity was added, to be added later (Kahan).
    pub residual: Vec3,
    /// 1 if a velocity overflowed in this step, else 0.
    pub broken: Real,
    /// Inertia in body axes and its inverse.
    pub inertia: SymmetricMat3,
    pub inverse_inertia: SymmetricMat3,
}

impl Default for BodyMotion {
    fn default() -> Self {
        Self::NONE
    }
}

impl BodyMotion {
    /// Nothing that moves.
    pub const NONE: Self = Self {
        free_linear: Vec3::ZERO,
        linear_damping: 0.0,
        free_angular: Vec3::ZERO,
        angular_damping: 0.0,
        acceleration: Vec3::ZERO,
        kinematic: 0.0,
        angular_acceleration: Vec3::ZERO,
        gyroscopic: 0.0,
        residual: Vec3::ZERO,
        broken: 0.0,
        inertia: SymmetricMat3::ZERO,
        inverse_inertia: SymmetricMat3::ZERO,
    };

    quad_view! {
        /// The record as groups of four numbers.
        pub fn quads,
        /// The same, to change.
        quads_mut;
        [8] of (free_linear, linear_damping, free_angular, angular_damping, acceleration, kinematic,
            angular_acceleration, gyroscopic, residual, broken, inertia, inverse_inertia)
    }
}

/// The three records of every body, by slot.
#[derive(Clone, Debug, Default)]
pub(crate) struct SolverBodies {
    pub states: Vec<BodyState>,
    pub masses: Vec<BodyMass>,
    pub motions: Vec<BodyMotion>,
}

impl SolverBodies {
    /// Adds a slot.
    pub fn push(&mut self) {
        storage::push(&mut self.states, BodyState::default());
        storage::push(&mut self.masses, BodyMass::default());
        storage::push(&mut self.motions, BodyMotion::default());
    }

    /// Resets a slot.
    pub fn reset(&mut self, index: usize) {
        self.states[index] = BodyState::default();
        self.masses[index] = BodyMass::default();
        self.motions[index] = BodyMotion::default();
    }
}

/// Velocities of the bodies on one side of a wide row.
#[derive(Clone, Copy)]
pub(crate) struct WideVelocity<W> {
    pub linear: LaneVec3<W>,
    pub angular: LaneVec3<W>,
}

/// How far the bodies on one side of a wide row have come in this step.
#[derive(Clone, Copy)]
pub(crate) struct WideDisplacement<W> {
    pub translation: LaneVec3<W>,
    pub turn: LaneVec3<W>,
}

/// Body states as the passes share them: the rows of one colour touch different bodies.
pub(crate) type SharedStates<'a> = SharedSlice<'a, BodyState>;

/// Loads velocities and displacements of one side.
///
/// # Safety
/// No other thread may write the bodies: rows of one colour share no dynamic body, and others are not written.
#[inline(always)]
pub(crate) unsafe fn gather<W: Lanes<L>, const L: usize>(
    states: &SharedStates<'_>,
    bodies: &[u32; L],
) -> (WideVelocity<W>, WideDisplacement<W>) {
    let mut records = [&[[0.0; 4]; 4]; L];
    for lane in 0..L {
        // SAFETY: promised by the caller; the references end with this function.
        records[lane] = unsafe { states.get((bodies[lane] & !READ_ONLY) as usize) }.quads();
    }
    let [vx, vy, vz, wx] = W::load_quad(&records, 0);
    let [wy, wz, px, py] = W::load_quad(&records, 1);
    let [pz, tx, ty, tz] = W::load_quad(&records, 2);
    (
        WideVelocity { linear: LaneVec3 { x: vx, y: vy, z: vz }, angular: LaneVec3 { x: wx, y: wy, z: wz } },
        WideDisplacement { translation: LaneVec3 { x: px, y: py, z: pz }, turn: LaneVec3 { x: tx, y: ty, z: tz } },
    )
}

/// Stores the velocities of one side; read-only bodies are left alone. `displacement` is what [`gather`] gave with them:
/// half of a group of four numbers that is written whole.
///
/// # Safety
/// No other thread may touch the bodies without [`READ_ONLY`].
#[inline(always)]
pub(crate) unsafe fn scatter<W: Lanes<L>, const L: usize>(
    states: &SharedStates<'_>,
    bodies: &[u32; L],
    (velocity, displacement): (&WideVelocity<W>, &WideDisplacement<W>),
) {
    let (v, w, p) = (&velocity.linear, &velocity.angular, &displacement.translation);
    let first = W::store(&[v.x, v.y, v.z, w.x]);
    let second = W::store(&[w.y, w.z, p.x, p.y]);
    for (lane, &body) in bodies.iter().enumerate() {
        if body & READ_ONLY == 0 {
            // SAFETY: promised by the caller; the reference ends with this iteration.
            let quads = unsafe { states.get_unchecked_mut(body as usize) }.quads_mut();
            (quads[0], quads[1]) = (first[lane], second[lane]);
        }
    }
}
