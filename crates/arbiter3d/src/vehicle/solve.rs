//! The forces of all wheels of a vehicle, found together for the velocity at the end of the step.
//!
//! Unknown are the impulses of each wheel over the step: `λn` along its strut, `λf` and `λl` of its tyre ahead and to
//! the left, `b` of its brake. With `u' = u + K λ` the velocity of a row after the step,
//!
//! - strut: `λn = dt k (x − u' dt) − dt c u'`, at least 0: a spring compressed by `x` and a damper, taken implicitly.
//!   The bump stop adds its stiffness past the travel, an anti-roll bar the difference of two compressions.
//! - tyre: `λ = −u' / e` with `e = s_peak V / (μ N dt)`, a force in proportion to slip `u / V` that reaches `μ N` at
//!   the peak. At a standstill `e` is zero and the tyre sticks. `(λf, λl)` stays within the circle `μ N g(s)`.
//! - spin: `I ω' = I ω + dt T − r λf + b` with `|b|` up to the brake's. Wheel, tyre and brake are solved as a block: a
//!   light wheel between a heavy car and a firm brake converges in one go, where rows of their own would need hundreds
//!   of sweeps.
//!
//! Rows of different wheels are coupled through the chassis by Gauss–Seidel sweeps, alternately forwards and backwards,
//! so that left and right are treated alike. The prediction starts from gravity and the forces already gathered, so a
//! car at rest gets what carries it and does not move at all.
//!
//! The ground is taken at its present speed. Where it can move, its mass softens tyre and damper, so that a light plate
//! is not shot away; it does not soften the spring, whose load at rest is exact on whatever ground.

use super::definition::{VehicleControls, VehicleDefinition};
use super::wheel::{Wheel, WheelContact};
use crate::error::Error;
use crate::id::BodyId;
use crate::math::{Real, SymmetricMat3, Vec3, clamp, max, min, normalize_or};
use crate::world::{BodyKind, BodyRef, World};

/// Sweeps over the wheels. The rows are soft or alike, so few are needed, and the last step's
/// forces are a good start: with 16, a car under power
/// stays within 5 mm of a straight line for 100 m.
const SWEEPS: usize = 16;

/// Stiffness of the bump stop as a multiple of the spring's.
const STOP_STIFFNESS: Real = 20.0;

/// Slip is measured against at least this speed (m/s): slower wheels do not count as sliding.
const SLOWEST: Real = 0.3;

/// Wheels never spin faster, rad/s.
const FASTEST_SPIN: Real = 1e4;

/// A body as the rows see it.
#[derive(Clone, Copy, Debug)]
struct Moving {
    id: BodyId,
    linear: Vec3,
    angular: Vec3,
    center: Vec3,
    inverse_mass: Vec3,
    inverse_inertia: SymmetricMat3,
}

impl Moving {
    fn new(body: &BodyRef<'_>) -> Self {
        let dynamic = body.kind() == BodyKind::Dynamic && body.is_enabled();
        let inverse_mass = if dynamic { body.locked_axes().free().0 / body.mass() } else { Vec3::ZERO };
        Self {
            id: body.id(),
            linear: body.linear_velocity(),
            angular: body.angular_velocity(),
            center: body.center_of_mass(),
            inverse_mass,
            inverse_inertia: body.inverse_inertia(),
        }
    }

    fn velocity_at(&self, point: Vec3) -> Vec3 {
        self.linear + self.angular.cross(point - self.center)
    }

    /// Change of the velocity along `direction` at a point per impulse along it.
    fn response(&self, point: Vec3, direction: Vec3) -> Real {
        let turn = (point - self.center).cross(direction);
        direction.dot(direction * self.inverse_mass) + turn.dot(self.inverse_inertia.mul(turn))
    }

    fn push(&mut self, point: Vec3, impulse: Vec3) {
        self.linear += impulse * self.inverse_mass;
        self.angular += self.inverse_inertia.mul((point - self.center).cross(impulse));
    }
}

/// A wheel that touches the ground.
#[derive(Clone, Copy, Debug)]
struct Row {
    wheel: usize,
    ground: usize,
    point: Vec3,
    /// Jacobian of the length of the strut: the normal over its cosine with the suspension.
    axis: Vec3,
    cosine: Real,
    forward: Vec3,
    left: Vec3,
    compression: Real,
    /// Impulse of the strut if its length did not change, and what it loses per speed of extension.
    push: Real,
    resistance: Real,
    strut_response: Real,
    strut_limit: Real,
    strut: Real,
    forward_response: Real,
    left_response: Real,
    /// Softness of the tyre along and across, times the impulse that it may give at its peak.
    softness: [Real; 2],
    friction: Real,
    grip: Real,
    tyre: [Real; 2],
    radius: Real,
    inverse_inertia: Real,
    brake_limit: Real,
    brake: Real,
    spin: Real,
    slip: [Real; 2],
}

/// A spring and damper taken implicitly over a step.
struct Strut {
    compression: Real,
    push: Real,
    resistance: Real,
}

impl Strut {
    /// The strut of a wheel that carries `mass`, on ground that gives way by `response`.
    fn new(wheel: &Wheel, mass: Real, response: Real, dt: Real) -> Self {
        let suspension = &wheel.definition.suspension;
        let rate = std::f32::consts::TAU * suspension.frequency;
        let (spring, damper) = (mass * rate * rate, 2.0 * suspension.damping_ratio * mass * rate);
        let compression = suspension.rest_length - wheel.state.suspension_length;
        let past = max(compression - suspension.travel, 0.0);
        let stop = if past > 0.0 { STOP_STIFFNESS * spring } else { 0.0 };
        let resistance = dt * (damper + (spring + stop) * dt);
        Self {
            compression,
            push: dt * (spring * compression + stop * past),
            resistance: resistance / (1.0 + resistance * response),
        }
    }
}

/// The rows of a vehicle, kept so that updates allocate nothing.
#[derive(Clone, Debug, Default)]
pub(super) struct System {
    chassis: Option<Moving>,
    drag: Vec3,
    grounds: Vec<Moving>,
    rows: Vec<Row>,
    /// Anti-roll bars between rows, with their stiffness.
    bars: Vec<(usize, usize, Real)>,
}

impl System {
    pub fn new(definition: &VehicleDefinition) -> Self {
        let wheels = definition.wheels.len();
        Self {
            grounds: Vec::with_capacity(wheels),
            rows: Vec::with_capacity(wheels),
            bars: Vec::with_capacity(definition.anti_roll_bars.len()),
            ..Self::default()
        }
    }

    /// Finds the impulses of the wheels for a step.
    pub fn solve(
        &mut self,
        world: &World,
        chassis: BodyId,
        definition: &VehicleDefinition,
        controls: &VehicleControls,
        (wheels, dt): (&mut [Wheel], Real),
    ) -> Result<(), Error> {
        let body = world.body(chassis).ok_or(Error::UnknownBody { id: chassis })?;
        self.grounds.clear();
        self.rows.clear();
        self.bars.clear();
        let start = Moving::new(&body);
        for (index, wheel) in wheels.iter_mut().enumerate() {
            let shared = definition.drive_torque * wheel.definition.drive_share * controls.throttle;
            let spin = wheel.state.angular_velocity + (shared + wheel.extra_torque) * dt / wheel.definition.inertia;
            let brake = dt
                * (controls.brake * wheel.definition.brake_torque
                    + controls.handbrake * wheel.definition.handbrake_torque);
            let Some(contact) = wheel.state.contact else {
                // In the air only engine and brake turn it.
                let held = clamp(-spin * wheel.definition.inertia, -brake, brake);
                wheel.state.angular_velocity = spin + held / wheel.definition.inertia;
                continue;
            };
            let mut row = self.row(world, &body, &start, definition, (wheel, &contact, dt))?;
            row.wheel = index;
            row.brake_limit += brake;
            row.brake = clamp(wheel.brake_torque * dt, -row.brake_limit, row.brake_limit);
            row.spin = spin + (row.brake - row.tyre[0] * row.radius) * row.inverse_inertia;
            self.rows.push(row);
        }
        self.predict(world, &body, definition.drag, dt);
        self.tie_bars(definition);
        self.warm_start();
        for sweep in 0..SWEEPS {
            for step in 0..self.rows.len() {
                let index = if sweep % 2 == 0 { step } else { self.rows.len() - 1 - step };
                self.solve_strut(index, dt);
                self.solve_tyre(index);
            }
        }
        Ok(())
    }

    /// What a wheel on the ground has at the start of the step.
    fn row(
        &mut self,
        world: &World,
        body: &BodyRef<'_>,
        chassis: &Moving,
        definition: &VehicleDefinition,
        (wheel, contact, dt): (&Wheel, &WheelContact, Real),
    ) -> Result<Row, Error> {
        let ground = self.ground(world, contact.body)?;
        let (point, normal) = (contact.point, contact.normal);
        let rotation = body.pose().rotation;
        let up = rotation.rotate(definition.up);
        let cosine = normal.dot(up);
        let axis = normal / cosine;
        let steered = definition.forward + definition.up.cross(definition.forward) * wheel.steer_tangent;
        let ahead = rotation.rotate(steered);
        let forward = normalize_or(ahead - normal * normal.dot(ahead), ahead);
        let left = normal.cross(forward);

        let mass = body.mass() / definition.wheels.len() as Real;
        let strut = Strut::new(wheel, mass, self.grounds[ground].response(point, axis), dt);
        let velocity = chassis.velocity_at(point) - self.grounds[ground].velocity_at(point);
        let tyre = &wheel.definition.tyre;
        let radius = wheel.definition.radius;
        let (ahead_speed, tread) = (velocity.dot(forward), wheel.state.angular_velocity * radius);
        let speed = max(ahead_speed.abs(), tread.abs());
        let measured = max(speed, SLOWEST);
        let slip = [(tread - ahead_speed) / measured, velocity.dot(left) / measured];
        let (along, across) = (slip[0] / tyre.longitudinal_peak, slip[1] / tyre.lateral_peak);
        let friction = ground_friction(world, wheel, contact);
        let both = |direction| chassis.response(point, direction) + self.grounds[ground].response(point, direction);
        Ok(Row {
            wheel: 0,
            ground,
            point,
            axis,
            cosine,
            forward,
            left,
            compression: strut.compression,
            push: strut.push,
            resistance: strut.resistance,
            strut_response: chassis.response(point, axis),
            strut_limit: wheel.definition.suspension.max_force * dt,
            strut: contact.load * cosine * dt,
            forward_response: both(forward),
            left_response: both(left),
            softness: [tyre.longitudinal_peak * speed, tyre.lateral_peak * speed],
            friction,
            grip: friction * tyre.grip_at((along * along + across * across).sqrt()),
            tyre: [contact.longitudinal_force * dt, contact.lateral_force * dt],
            radius,
            inverse_inertia: 1.0 / wheel.definition.inertia,
            brake_limit: tyre.rolling_resistance * contact.load * radius * dt,
            brake: 0.0,
            spin: 0.0,
            slip,
        })
    }

    /// Place of a ground among the grounds.
    fn ground(&mut self, world: &World, id: BodyId) -> Result<usize, Error> {
        if let Some(at) = self.grounds.iter().position(|ground| ground.id == id) {
            return Ok(at);
        }
        let body = world.body(id).ok_or(Error::UnknownBody { id })?;
        self.grounds.push(Moving::new(&body));
        Ok(self.grounds.len() - 1)
    }

    /// The velocity of the chassis after the step if there were no wheels.
    fn predict(&mut self, world: &World, body: &BodyRef<'_>, drag: Real, dt: Real) {
        let mut chassis = Moving::new(body);
        let speed = chassis.linear.length();
        // Implicit, so that no step is too long for it.
        let resistance = drag * speed;
        self.drag = chassis.linear * (-resistance / (1.0 + dt * resistance / max(body.mass(), 1e-30)));
        let free = body.locked_axes().free().0;
        let gravity = world.settings().gravity * body.gravity_scale() * free;
        chassis.linear += (gravity + (body.force() + self.drag) * chassis.inverse_mass) * dt;
        chassis.angular += chassis.inverse_inertia.mul(body.torque()) * dt;
        chassis.linear *= 1.0 / (1.0 + dt * body.linear_damping());
        chassis.angular *= 1.0 / (1.0 + dt * body.angular_damping());
        self.chassis = Some(chassis);
    }

    /// Starts from the forces of the last step, which are nearly those of this one.
    fn warm_start(&mut self) {
        let Some(chassis) = &mut self.chassis else { return };
        for row in &self.rows {
            let tyre = row.forward * row.tyre[0] + row.left * row.tyre[1];
            chassis.push(row.point, row.axis * row.strut + tyre);
            self.grounds[row.ground].push(row.point, -tyre);
        }
    }

    fn tie_bars(&mut self, definition: &VehicleDefinition) {
        for bar in &definition.anti_roll_bars {
            let row = |wheel| self.rows.iter().position(|row| row.wheel == wheel);
            if let (Some(left), Some(right)) = (row(bar.left), row(bar.right)) {
                self.bars.push((left, right, bar.stiffness));
            }
        }
    }

    /// Speed at which a strut extends.
    fn extension(&self, row: &Row) -> Real {
        let chassis = self.chassis.map_or(Vec3::ZERO, |chassis| chassis.velocity_at(row.point));
        row.axis.dot(chassis - self.grounds[row.ground].velocity_at(row.point))
    }

    fn solve_strut(&mut self, index: usize, dt: Real) {
        let row = self.rows[index];
        let speed = self.extension(&row);
        let (mut push, mut resistance) = (row.push, row.resistance);
        for &(left, right, stiffness) in &self.bars {
            let other = match index {
                at if at == left => &self.rows[right],
                at if at == right => &self.rows[left],
                _ => continue,
            };
            let other = other.compression - self.extension(other) * dt;
            push += dt * stiffness * (row.compression - other);
            resistance += dt * dt * stiffness;
        }
        let change = (push - resistance * speed - row.strut) / (1.0 + resistance * row.strut_response);
        let strut = clamp(row.strut + change, 0.0, row.strut_limit);
        if let Some(chassis) = &mut self.chassis {
            chassis.push(row.point, row.axis * (strut - row.strut));
        }
        self.rows[index].strut = strut;
    }

    /// Tyre, brake and spin of a wheel at once.
    fn solve_tyre(&mut self, index: usize) {
        let mut row = self.rows[index];
        let load = row.strut / row.cosine;
        let Some(chassis) = &mut self.chassis else { return };
        let ground = &mut self.grounds[row.ground];
        let velocity = chassis.velocity_at(row.point) - ground.velocity_at(row.point);
        // The spin without the brake's impulse so far.
        let free = row.spin - row.brake * row.inverse_inertia;
        let peak = max(row.friction * load, 1e-20);
        let (soft_along, soft_across) = (row.softness[0] / peak, row.softness[1] / peak);
        let per_spin = row.radius * row.inverse_inertia;
        let tyre_impulse = |spin: Real, spin_response: Real| {
            let slip = velocity.dot(row.forward) - spin * row.radius;
            row.tyre[0] - (slip + soft_along * row.tyre[0]) / (row.forward_response + spin_response + soft_along)
        };
        let brake_for = |impulse: Real| -(free - (impulse - row.tyre[0]) * per_spin) / row.inverse_inertia;
        // Locked, if the brake can hold it; else the brake gives all it has, and the wheel turns.
        let locked = tyre_impulse(0.0, 0.0);
        let along = if brake_for(clamp(locked, -row.grip * load, row.grip * load)).abs() <= row.brake_limit {
            locked
        } else {
            let brake = clamp(brake_for(locked), -row.brake_limit, row.brake_limit);
            tyre_impulse(free + brake * row.inverse_inertia, row.radius * per_spin)
        };
        let sideways = velocity.dot(row.left);
        let across = row.tyre[1] - (sideways + soft_across * row.tyre[1]) / (row.left_response + soft_across);
        let size = (along * along + across * across).sqrt();
        let scale = if size > row.grip * load { row.grip * load / size } else { 1.0 };
        let [along, across] = [along * scale, across * scale];
        let impulse = row.forward * (along - row.tyre[0]) + row.left * (across - row.tyre[1]);
        chassis.push(row.point, impulse);
        ground.push(row.point, -impulse);
        row.brake = clamp(brake_for(along), -row.brake_limit, row.brake_limit);
        row.spin = free - (along - row.tyre[0]) * per_spin + row.brake * row.inverse_inertia;
        row.tyre = [along, across];
        self.rows[index] = row;
    }

    /// Gives the forces to the bodies.
    pub fn apply(&self, world: &mut World, dt: Real) -> Result<(), Error> {
        let Some(chassis) = &self.chassis else { return Ok(()) };
        let (mut force, mut torque) = (self.drag, Vec3::ZERO);
        let rests = chassis.linear.length() <= world.settings().sleep_speed * world.settings().length_unit;
        for row in &self.rows {
            let normal = row.axis * row.cosine;
            let pushed = (normal * (row.strut / row.cosine) + row.forward * row.tyre[0] + row.left * row.tyre[1]) / dt;
            force += pushed;
            torque += (row.point - chassis.center).cross(pushed);
            let ground = &self.grounds[row.ground];
            if ground.inverse_mass != Vec3::ZERO {
                if !rests && let Some(mut body) = world.body_mut(ground.id) {
                    body.wake();
                }
                world.add_lasting_force(ground.id, -pushed, (row.point - ground.center).cross(-pushed))?;
            }
        }
        world.add_lasting_force(chassis.id, force, torque)
    }

    /// Notes in the wheels what came out.
    pub fn report(&self, wheels: &mut [Wheel], dt: Real) {
        for row in &self.rows {
            wheels[row.wheel].brake_torque = row.brake / dt;
            let state = &mut wheels[row.wheel].state;
            state.angular_velocity = clamp(row.spin, -FASTEST_SPIN, FASTEST_SPIN);
            if let Some(contact) = &mut state.contact {
                contact.load = row.strut / row.cosine / dt;
                contact.longitudinal_force = row.tyre[0] / dt;
                contact.lateral_force = row.tyre[1] / dt;
                [contact.longitudinal_slip, contact.lateral_slip] = row.slip;
            }
        }
        for wheel in wheels {
            let turns = wheel.state.angle + wheel.state.angular_velocity * dt;
            let whole = (turns / std::f32::consts::TAU).round();
            wheel.state.angle = turns - whole * std::f32::consts::TAU;
        }
    }
}

/// Friction between a tyre and what it stands on.
fn ground_friction(world: &World, wheel: &Wheel, contact: &WheelContact) -> Real {
    let tyre = &wheel.definition.tyre;
    let Some(shape) = world.shape(contact.shape) else { return tyre.friction };
    let ground = shape.material();
    let rule =
        if ground.friction_combine > tyre.friction_combine { ground.friction_combine } else { tyre.friction_combine };
    min(rule.combine(tyre.friction, ground.friction), 1e6)
}
