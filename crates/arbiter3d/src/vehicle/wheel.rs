//! A wheel: where its ray finds ground, and what is known of it after an update.

use super::definition::WheelDefinition;
use crate::error::Error;
use crate::id::{BodyId, ShapeId};
use crate::math::{Pose, Real, Vec3};
use crate::world::{QueryFilter, World};

/// Suspensions that meet the ground at a flatter angle than this (sine) touch a wall, not the ground.
const STEEPEST: Real = 0.3;

/// How far ground may move (m, and change of the normal) before a sleeping vehicle notices.
const NOTICED: Real = 1e-3;

/// What a wheel stands on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WheelContact {
    /// Body of the ground.
    pub body: BodyId,
    /// Shape of the ground.
    pub shape: ShapeId,
    /// Triangle of a mesh, as numbered by the user.
    pub triangle: Option<u32>,
    /// Where, world.
    pub point: Vec3,
    /// Unit normal of the ground, world.
    pub normal: Vec3,
    /// Force of the ground along its normal in the coming step, N.
    pub load: Real,
    /// Force of the ground ahead, along the wheel, N.
    pub longitudinal_force: Real,
    /// Force of the ground to the left of the wheel, N.
    pub lateral_force: Real,
    /// Slip speed along the wheel as a share of the speed; positive when the tread is faster than the ground.
    pub longitudinal_slip: Real,
    /// Speed to the left as a share of the speed: the tangent of the slip angle.
    pub lateral_slip: Real,
}

/// State of a wheel.
///
/// ```
/// use arbiter3d::{BodyDefinition, Vehicle, VehicleDefinition, World};
/// let mut world = World::default();
/// let chassis = world.add_body(&BodyDefinition::dynamic())?;
/// let car = Vehicle::new(&world, chassis, &VehicleDefinition::car(0.8, 1.4, 0.0))?;
/// assert!(car.wheel(0).unwrap().contact.is_none() && car.wheel(4).is_none());
/// # Ok::<(), arbiter3d::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WheelState {
    /// The ground, if it touches any.
    pub contact: Option<WheelContact>,
    /// Distance from the attachment to the centre of the wheel, metres.
    pub suspension_length: Real,
    /// Spin about the axle, rad/s; positive rolls ahead.
    pub angular_velocity: Real,
    /// How far it has turned, radians, from −π to π.
    pub angle: Real,
}

/// A wheel with what it keeps between updates.
#[derive(Clone, Debug)]
pub(super) struct Wheel {
    pub definition: WheelDefinition,
    pub state: WheelState,
    /// Tangent of its steering angle, positive to the left.
    pub steer_tangent: Real,
    pub extra_torque: Real,
    /// What the brake gave in the last step, N m.
    pub brake_torque: Real,
}

impl Wheel {
    pub fn new(definition: &WheelDefinition) -> Self {
        let suspension_length = definition.suspension.rest_length;
        let state = WheelState { suspension_length, ..WheelState::default() };
        Self { definition: *definition, state, steer_tangent: 0.0, extra_torque: 0.0, brake_torque: 0.0 }
    }

    /// Looks for ground along the suspension; says whether it is another than before.
    pub fn find_ground(
        &mut self,
        world: &World,
        chassis: &Pose,
        up: Vec3,
        filter: &QueryFilter<'_>,
    ) -> Result<bool, Error> {
        let definition = &self.definition;
        let full = definition.suspension.rest_length + definition.radius;
        let origin = chassis.transform_point(definition.attachment);
        let up = chassis.rotation.rotate(up);
        let hit = world.cast_ray(origin, up * -full, 1.0, filter)?;
        let hit = hit.filter(|hit| hit.normal.dot(up) >= STEEPEST);
        let before = self.state.contact;
        self.state.contact = hit.map(|hit| {
            let kept = before.unwrap_or(WheelContact {
                body: hit.body,
                shape: hit.shape,
                triangle: None,
                point: hit.point,
                normal: hit.normal,
                load: 0.0,
                longitudinal_force: 0.0,
                lateral_force: 0.0,
                longitudinal_slip: 0.0,
                lateral_slip: 0.0,
            });
            let (body, shape, triangle) = (hit.body, hit.shape, hit.triangle);
            WheelContact { body, shape, triangle, point: hit.point, normal: hit.normal, ..kept }
        });
        self.state.suspension_length = match hit {
            Some(hit) => hit.fraction * full - definition.radius,
            None => definition.suspension.rest_length,
        };
        Ok(match (before, self.state.contact) {
            (None, None) => false,
            (Some(a), Some(b)) => {
                a.body != b.body || (a.point - b.point).length() > NOTICED || (a.normal - b.normal).length() > NOTICED
            }
            _ => true,
        })
    }
}
