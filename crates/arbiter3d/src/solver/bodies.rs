//! The bodies as the solver sees them: three records a body, by how often they are read.
//!
//! `BodyState` (64 bytes, one cache line) is what rows gather and scatter in every pass. `BodyMass` (64 bytes) is read when
//! rows are prepared. `BodyMotion` is read by the integrator alone. All are indexed by body slot: a sleeping body costs
//! nothing but its place.

use crate::math::{Pose, Real, Rotation, SymmetricMat3, Vec3};
use crate::parallel::SharedSlice;
use crate::simd::{Wide, WideVec3};

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
    /// Whether a row acts on the body in this step.
    pub constrained: u32,
    /// Whether contacts can move the body at all: dynamic, enabled, not locked on all axes.
    pub moves: u32,
    unused: [u32; 2],
}

impl Default for BodyState {
    fn default() -> Self {
        Self {
            linear_velocity: Vec3::ZERO,
            angular_velocity: Vec3::ZERO,
            translation: Vec3::ZERO,
            turn: Vec3::ZERO,
            constrained: 0,
            moves: 0,
            unused: [0; 2],
        }
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

impl Default for BodyMass {
    fn default() -> Self {
        Self {
            center: Vec3::ZERO,
            rotation: Rotation::IDENTITY,
            inverse_mass: Vec3::ZERO,
            inverse_inertia: SymmetricMat3::ZERO,
        }
    }
}

impl BodyMass {
    /// Pose of the frame at the centre of mass.
    #[inline(always)]
    pub fn pose(&self) -> Pose {
        Pose::new(self.center, self.rotation)
    }
}

/// What the integrator needs.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct BodyMotion {
    /// Velocities before this substep's contact impulses; what they added is warm starting for the next substep.
    pub free_linear: Vec3,
    pub free_angular: Vec3,
    /// Acceleration by gravity and forces in this step.
    pub acceleration: Vec3,
    pub angular_acceleration: Vec3,
    /// What rounding has lost when gravity was added, to be added later (Kahan).
    pub residual: Vec3,
    /// Inertia in body axes and its inverse.
    pub inertia: SymmetricMat3,
    pub inverse_inertia: SymmetricMat3,
    pub linear_damping: Real,
    pub angular_damping: Real,
    /// 1 for each free world axis of rotation.
    pub free_rotation: Vec3,
    /// Whether nothing but its velocity moves it.
    pub kinematic: bool,
    /// Whether the torque-free spin changes: the inertia is not that of a ball, and no rotation is locked.
    pub gyroscopic: bool,
    /// Whether a velocity overflowed in this step.
    pub broken: bool,
}

impl Default for BodyMotion {
    fn default() -> Self {
        Self {
            free_linear: Vec3::ZERO,
            free_angular: Vec3::ZERO,
            acceleration: Vec3::ZERO,
            angular_acceleration: Vec3::ZERO,
            residual: Vec3::ZERO,
            inertia: SymmetricMat3::ZERO,
            inverse_inertia: SymmetricMat3::ZERO,
            linear_damping: 0.0,
            angular_damping: 0.0,
            free_rotation: Vec3::ONE,
            kinematic: false,
            gyroscopic: false,
            broken: false,
        }
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
        self.states.push(BodyState::default());
        self.masses.push(BodyMass::default());
        self.motions.push(BodyMotion::default());
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
pub(crate) struct WideVelocity<const L: usize> {
    pub linear: WideVec3<L>,
    pub angular: WideVec3<L>,
}

/// How far the bodies on one side of a wide row have come in this step.
#[derive(Clone, Copy)]
pub(crate) struct WideDisplacement<const L: usize> {
    pub translation: WideVec3<L>,
    pub turn: WideVec3<L>,
}

/// Body states as the passes share them: the rows of one colour touch different bodies.
pub(crate) type SharedStates<'a> = SharedSlice<'a, BodyState>;

/// Loads velocities and displacements of one side.
///
/// # Safety
/// No other thread may write the bodies: rows of one colour share no dynamic body, and others are not written.
#[inline(always)]
pub(crate) unsafe fn gather<const L: usize>(
    states: &SharedStates<'_>,
    bodies: &[u32; L],
) -> (WideVelocity<L>, WideDisplacement<L>) {
    let mut columns = [Wide::<L>::ZERO; 12];
    for lane in 0..L {
        // SAFETY: promised by the caller; the reference ends with this iteration.
        let s = unsafe { &*states.get_mut((bodies[lane] & !READ_ONLY) as usize) };
        let values = [
            s.linear_velocity.x,
            s.linear_velocity.y,
            s.linear_velocity.z,
            s.angular_velocity.x,
            s.angular_velocity.y,
            s.angular_velocity.z,
            s.translation.x,
            s.translation.y,
            s.translation.z,
            s.turn.x,
            s.turn.y,
            s.turn.z,
        ];
        for k in 0..12 {
            columns[k][lane] = values[k];
        }
    }
    let [vx, vy, vz, wx, wy, wz, px, py, pz, tx, ty, tz] = columns;
    (
        WideVelocity { linear: WideVec3 { x: vx, y: vy, z: vz }, angular: WideVec3 { x: wx, y: wy, z: wz } },
        WideDisplacement { translation: WideVec3 { x: px, y: py, z: pz }, turn: WideVec3 { x: tx, y: ty, z: tz } },
    )
}

/// Stores the velocities of one side; read-only bodies are left alone.
///
/// # Safety
/// No other thread may touch the bodies without [`READ_ONLY`].
#[inline(always)]
pub(crate) unsafe fn scatter<const L: usize>(states: &SharedStates<'_>, bodies: &[u32; L], velocity: &WideVelocity<L>) {
    for (lane, &body) in bodies.iter().enumerate() {
        if body & READ_ONLY == 0 {
            // SAFETY: promised by the caller; the reference ends with this iteration.
            let state = unsafe { states.get_mut(body as usize) };
            state.linear_velocity = velocity.linear.get(lane);
            state.angular_velocity = velocity.angular.get(lane);
        }
    }
}
