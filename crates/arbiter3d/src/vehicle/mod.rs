//! Vehicles whose wheels are rays.
//!
//! A wheel has no body and no shape: each step a ray looks for the ground along its suspension. Where it finds some,
//! the wheel adds three rows to a small system of its own,
//!
//! - the *strut*, a spring and damper along the suspension that can only push,
//! - the *tyre* along and across the wheel, whose force grows with slip and ends at a friction circle,
//!
//! and one more degree of freedom, the spin of the wheel, which engine, brake and tyre turn. `solve.rs` solves the
//! system for the velocity at the end of the step, so that stiff springs, locked wheels and light wheels on heavy cars
//! are stable at any step, a car at rest stays where it is, and all of its wheels know of each other. What comes out is
//! given to the bodies as forces over the coming step: to the chassis, and the opposite to a ground that can move.
//!
//! Call [`Vehicle::update`] before each [`World::step`] with the same `dt`.
//!
//! Invariants: the forces of a wheel lie in the friction cone of its load; what the chassis gets and what the ground
//! gets cancel; a vehicle that rests on what rests falls asleep like any body, and is woken by its controls or a change
//! of ground.

mod definition;
mod solve;
mod wheel;

pub use definition::{AntiRollBar, Suspension, Tyre, VehicleControls, VehicleDefinition, WheelDefinition};
pub use wheel::{WheelContact, WheelState};

use crate::error::{Error, finite, in_range};
use crate::id::BodyId;
use crate::math::{Pose, Real, Vec3, sin_cos, turn};
use crate::world::{BodyKind, World};
use solve::System;
use wheel::Wheel;

/// A vehicle on a dynamic body.
///
/// ```
/// use arbiter3d::math::Vec3;
/// use arbiter3d::{BodyDefinition, BodyId, Shape, ShapeDefinition, Vehicle, VehicleControls, VehicleDefinition, World};
/// let mut world = World::default();
/// let floor = ShapeDefinition::new(Shape::cuboid(Vec3::new(100.0, 1.0, 100.0))?);
/// world.add_shape(BodyId::WORLD, &floor.at(Vec3::new(0.0, -1.0, 0.0)))?;
/// let chassis = world.add_body(&BodyDefinition::dynamic().at(Vec3::new(0.0, 1.0, 0.0)))?;
/// world.add_shape(chassis, &ShapeDefinition::new(Shape::cuboid(Vec3::new(0.8, 0.3, 2.0))?).density(300.0))?;
///
/// let mut car = Vehicle::new(&world, chassis, &VehicleDefinition::car(0.8, 1.4, -0.1))?;
/// car.set_controls(VehicleControls { throttle: 1.0, ..VehicleControls::default() })?;
/// for _ in 0..120 {
///     car.update(&mut world, 1.0 / 60.0)?;
///     world.step(1.0 / 60.0)?;
/// }
/// assert!(world.body(chassis).unwrap().linear_velocity().z < -4.0);
/// # Ok::<(), arbiter3d::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Vehicle {
    chassis: BodyId,
    definition: VehicleDefinition,
    controls: VehicleControls,
    wheels: Vec<Wheel>,
    /// Whether the driver has done something since the last update.
    changed: bool,
    system: System,
}

impl Vehicle {
    /// A vehicle on the body `chassis`.
    ///
    /// # Errors
    /// If the body is unknown or not dynamic, a number of the definition is out of its range, or an anti-roll bar names
    /// a wheel that is not there.
    pub fn new(world: &World, chassis: BodyId, definition: &VehicleDefinition) -> Result<Self, Error> {
        definition.validate()?;
        let body = world.body(chassis).ok_or(Error::UnknownBody { id: chassis })?;
        if body.kind() != BodyKind::Dynamic {
            return Err(Error::NotDynamic { id: chassis });
        }
        let wheels = definition.wheels.iter().map(Wheel::new).collect();
        Ok(Self {
            chassis,
            definition: definition.clone(),
            controls: VehicleControls::default(),
            wheels,
            changed: true,
            system: System::new(definition),
        })
    }

    /// The body it is built on.
    #[must_use]
    pub fn chassis(&self) -> BodyId {
        self.chassis
    }

    /// What it is made of.
    #[must_use]
    pub fn definition(&self) -> &VehicleDefinition {
        &self.definition
    }

    /// What the driver does.
    #[must_use]
    pub fn controls(&self) -> &VehicleControls {
        &self.controls
    }

    /// Sets what the driver does from the next update on.
    ///
    /// # Errors
    /// If a number is out of its range.
    pub fn set_controls(&mut self, controls: VehicleControls) -> Result<(), Error> {
        controls.validate()?;
        self.changed |= controls != self.controls;
        self.controls = controls;
        self.steer();
        Ok(())
    }

    /// Sets a torque on one wheel, N m, that comes on top of its share of the engine's: electric motors, a
    /// differential, tank steering. It stays until it is set again.
    ///
    /// # Errors
    /// If the torque is not finite or there is no such wheel.
    pub fn set_wheel_torque(&mut self, wheel: usize, torque: Real) -> Result<(), Error> {
        finite("wheel torque", torque)?;
        let last = self.wheels.len() as Real - 1.0;
        in_range("wheel", wheel as Real, 0.0, last)?;
        self.changed |= self.wheels[wheel].extra_torque != torque;
        self.wheels[wheel].extra_torque = torque;
        Ok(())
    }

    /// State of a wheel after the last update: ground, load, slip, spin.
    #[must_use]
    pub fn wheel(&self, wheel: usize) -> Option<&WheelState> {
        self.wheels.get(wheel).map(|wheel| &wheel.state)
    }

    /// Where to draw a wheel seen from the chassis: its centre, and its frame with the axle along the vehicle's left
    /// and right, steered and turned as it is.
    #[must_use]
    pub fn wheel_pose(&self, wheel: usize) -> Option<Pose> {
        let wheel = self.wheels.get(wheel)?;
        let (forward, up) = (self.definition.forward, self.definition.up);
        let left = up.cross(forward);
        // The half angle of a turn that takes `forward` to `forward + left tan`: tan(δ/2) = tan / (1 + sqrt(1 + tan²)).
        let half = wheel.steer_tangent / (1.0 + (1.0 + wheel.steer_tangent * wheel.steer_tangent).sqrt());
        let steer = crate::math::Rotation::from_xyzw(up.x * half, up.y * half, up.z * half, 1.0).normalize();
        let position = wheel.definition.attachment - up * wheel.state.suspension_length;
        Some(Pose::new(position, steer.mul(turn(left, wheel.state.angle))))
    }

    /// Speed ahead, m/s.
    ///
    /// # Errors
    /// If the chassis was removed.
    pub fn speed(&self, world: &World) -> Result<Real, Error> {
        let body = world.body(self.chassis).ok_or(Error::UnknownBody { id: self.chassis })?;
        Ok(body.linear_velocity().dot(body.pose().rotation.rotate(self.definition.forward)))
    }

    /// Finds the ground under the wheels and applies their forces for the coming step of `dt` seconds.
    ///
    /// A chassis that is disabled, or no longer dynamic, is left alone.
    ///
    /// # Errors
    /// If the chassis was removed, `dt` is not above 0 and at most 1, or a force is not finite.
    pub fn update(&mut self, world: &mut World, dt: Real) -> Result<(), Error> {
        in_range("dt", dt, 1e-6, 1.0)?;
        let body = world.body(self.chassis).ok_or(Error::UnknownBody { id: self.chassis })?;
        if body.kind() != BodyKind::Dynamic || !body.is_enabled() || body.is_frozen() {
            return Ok(());
        }
        let asleep = !body.is_awake();
        let moved = self.find_ground(world)?;
        if asleep {
            if !(moved || self.changed || self.is_driven()) {
                return Ok(());
            }
            world.body_mut(self.chassis).ok_or(Error::UnknownBody { id: self.chassis })?.wake();
        }
        self.changed = false;
        if self.is_driven() {
            // An engine that pushes against an obstacle does not fall asleep.
            world.body_mut(self.chassis).ok_or(Error::UnknownBody { id: self.chassis })?.wake();
        }
        self.system.solve(world, self.chassis, &self.definition, &self.controls, (&mut self.wheels, dt))?;
        self.system.report(&mut self.wheels, dt);
        self.system.apply(world, dt)
    }

    fn is_driven(&self) -> bool {
        let shared = self.controls.throttle != 0.0 && self.definition.drive_torque > 0.0;
        shared || self.wheels.iter().any(|wheel| wheel.extra_torque != 0.0)
    }

    /// Casts the rays; says whether the ground is another than before.
    fn find_ground(&mut self, world: &World) -> Result<bool, Error> {
        let body = world.body(self.chassis).ok_or(Error::UnknownBody { id: self.chassis })?;
        let pose = body.pose();
        let filter = crate::world::QueryFilter { exclude_body: Some(self.chassis), ..self.definition.filter };
        let mut moved = false;
        for wheel in &mut self.wheels {
            moved |= wheel.find_ground(world, &pose, self.definition.up, &filter)?;
        }
        Ok(moved)
    }

    /// Turns each steered wheel along its circle about the common centre.
    fn steer(&mut self) {
        let definition = &self.definition;
        let left = definition.up.cross(definition.forward);
        let (s, c) = sin_cos(self.controls.steering);
        let tangent = s / c;
        let mean = |steered: bool| {
            let mut sum = (0.0, 0.0);
            for wheel in definition.wheels.iter().filter(|wheel| wheel.steered == steered) {
                sum = (sum.0 + wheel.attachment.dot(definition.forward), sum.1 + 1.0);
            }
            (sum.1 > 0.0).then(|| sum.0 / sum.1)
        };
        let base = match (mean(true), mean(false)) {
            (Some(steered), Some(fixed)) => Some((fixed, steered - fixed)),
            _ => None,
        };
        for wheel in self.wheels.iter_mut().filter(|wheel| wheel.definition.steered) {
            let attachment: Vec3 = wheel.definition.attachment;
            wheel.steer_tangent = match base {
                Some((fixed, length)) if length != 0.0 => {
                    let ahead = attachment.dot(definition.forward) - fixed;
                    let denominator = length - attachment.dot(left) * tangent;
                    // A circle so tight that a wheel passes its centre has no sensible angle: steer it as asked.
                    if denominator * length > 0.0 { ahead * tangent / denominator } else { tangent }
                }
                _ => tangent,
            };
        }
    }
}
