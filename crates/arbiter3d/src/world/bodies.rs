//! Bodies: what the world keeps of them, and how users read and change them.

use super::World;
use super::continuous::depth_on_body;
use super::definition::{BodyKind, LockedAxes, validate_mass};
use super::events::{BeginListener, EndListener};
use crate::arbiter::{EndReason, NONE};
use crate::error::{Error, finite, finite_vec, in_range, unit_rotation};
use crate::id::{BodyId, ShapeId};
use crate::math::{Mat3, Pose, Quat, Real, SymmetricMat3, Vec3, abs3, max3, min};
use crate::shape::MassProperties;
use crate::solver::BodyMotion;

/// What the world keeps of a body beside the solver's records.
#[derive(Clone, Debug)]
pub(crate) struct Body {
    pub generation: u32,
    pub alive: bool,
    pub enabled: bool,
    pub awake: bool,
    pub can_sleep: bool,
    pub continuous: bool,
    pub bullet: bool,
    /// Went non-finite and was stopped; any change by the user sets it free.
    pub frozen: bool,
    pub kind: BodyKind,
    pub locked_axes: LockedAxes,
    /// Pose of the body's origin.
    pub pose: Pose,
    pub mass: MassProperties,
    /// Mass given by the user, rather than summed over the shapes.
    pub given_mass: Option<MassProperties>,
    pub force: Vec3,
    pub torque: Vec3,
    pub gravity_scale: Real,
    pub sleep_time: Real,
    /// Place among the awake bodies.
    pub awake_place: u32,
    /// Sleeping island the body belongs to.
    pub island: u32,
    /// Smallest ball inside its shapes (of what is made of parts, its thinnest part), and the farthest a point of it is
    /// from the centre of mass.
    pub inner_radius: Real,
    pub reach: Real,
    /// Half the size of the smallest box about the centre of mass that holds its shapes, in its axes.
    pub extents: Vec3,
    pub shapes: Vec<ShapeId>,
    /// Places of the shapes.
    pub shape_slots: Vec<u32>,
    pub user_data: u128,
}

impl Body {
    /// Speed of the fastest point of a body that turns about its centre of mass, at most; `spin` (rad/s) in the body's axes.
    ///
    /// A long body that rolls about its own axis is slow, one that turns end over end is fast.
    #[inline(always)]
    pub fn surface_speed(&self, spin: Vec3) -> Real {
        let (spin, half) = (abs3(spin), self.extents);
        let fastest = Vec3::new(
            spin.y * half.z + spin.z * half.y,
            spin.z * half.x + spin.x * half.z,
            spin.x * half.y + spin.y * half.x,
        );
        min(fastest.length(), spin.length() * self.reach)
    }

    /// Whether it is a kinematic body that takes along what it would sweep over.
    pub fn sweeps(&self) -> bool {
        self.kind == BodyKind::Kinematic && self.enabled && self.continuous && !self.bullet
    }

    pub fn is_dynamic(&self) -> bool {
        self.kind == BodyKind::Dynamic
    }

    /// Whether waking the body may change anything: it sleeps, or has begun to rest.
    #[inline(always)]
    pub fn can_wake(&self) -> bool {
        match self.kind {
            BodyKind::Static => false,
            BodyKind::Kinematic => !self.awake,
            BodyKind::Dynamic => !self.awake || self.island != NONE || self.sleep_time != 0.0,
        }
    }

    pub fn new(generation: u32) -> Self {
        Self {
            generation,
            alive: true,
            enabled: true,
            awake: false,
            can_sleep: true,
            continuous: true,
            bullet: false,
            frozen: false,
            kind: BodyKind::Static,
            locked_axes: LockedAxes::NONE,
            pose: Pose::IDENTITY,
            mass: MassProperties::default(),
            given_mass: None,
            force: Vec3::ZERO,
            torque: Vec3::ZERO,
            gravity_scale: 1.0,
            sleep_time: 0.0,
            awake_place: NONE,
            island: NONE,
            inner_radius: 0.0,
            reach: 0.0,
            extents: Vec3::ZERO,
            shapes: Vec::new(),
            shape_slots: Vec::new(),
            user_data: 0,
        }
    }
}

/// A body, to read.
///
/// ```
/// use arbiter3d::{BodyId, World};
/// let world = World::default();
/// assert!(!world.body(BodyId::WORLD).unwrap().is_awake());
/// ```
#[derive(Clone, Copy, Debug)]
pub struct BodyRef<'a> {
    world: &'a World,
    id: BodyId,
}

/// A body, to read and change. Changes take effect at once.
///
/// ```
/// use arbiter3d::{BodyDefinition, Shape, ShapeDefinition, World, math::Vec3};
/// let mut world = World::default();
/// let body = world.add_body(&BodyDefinition::dynamic())?;
/// world.add_shape(body, &ShapeDefinition::new(Shape::sphere(0.5)?))?;
/// world.body_mut(body).unwrap().set_linear_velocity(Vec3::X)?;
/// assert!(world.body_mut(body).unwrap().apply_impulse(Vec3::NAN).is_err());
/// # Ok::<(), arbiter3d::Error>(())
/// ```
#[derive(Debug)]
pub struct BodyMut<'a> {
    world: &'a mut World,
    id: BodyId,
}

impl<'a> BodyRef<'a> {
    pub(crate) fn new(world: &'a World, id: BodyId) -> Self {
        Self { world, id }
    }

    fn body(&self) -> &'a Body {
        &self.world.bodies[self.id.index as usize]
    }

    /// Its id.
    #[must_use]
    pub fn id(&self) -> BodyId {
        self.id
    }

    /// Static, kinematic or dynamic.
    #[must_use]
    pub fn kind(&self) -> BodyKind {
        self.body().kind
    }

    /// Origin of the body's frame, metres.
    #[must_use]
    pub fn position(&self) -> Vec3 {
        self.body().pose.position
    }

    /// From body to world.
    #[must_use]
    pub fn rotation(&self) -> Quat {
        self.body().pose.rotation.to_quat()
    }

    /// Pose of the body's frame.
    #[must_use]
    pub fn pose(&self) -> Pose {
        self.body().pose
    }

    /// Velocity of the centre of mass, m/s.
    #[must_use]
    pub fn linear_velocity(&self) -> Vec3 {
        self.world.solver_bodies.states[self.id.index as usize].linear_velocity
    }

    /// Angular velocity about world axes, rad/s.
    #[must_use]
    pub fn angular_velocity(&self) -> Vec3 {
        self.world.solver_bodies.states[self.id.index as usize].angular_velocity
    }

    /// Velocity of the point of the body that is at `point` (world), m/s.
    #[must_use]
    pub fn velocity_at(&self, point: Vec3) -> Vec3 {
        self.linear_velocity() + self.angular_velocity().cross(point - self.center_of_mass())
    }

    /// Mass, kg; zero for bodies that are not dynamic.
    #[must_use]
    pub fn mass(&self) -> Real {
        if self.body().is_dynamic() { self.body().mass.mass } else { 0.0 }
    }

    /// Mass, centre of mass and inertia in the body's frame, as they count when it is dynamic.
    #[must_use]
    pub fn mass_properties(&self) -> MassProperties {
        self.body().mass
    }

    /// The mass that was given to the body; `None` if it is the sum over the shapes.
    #[must_use]
    pub fn given_mass(&self) -> Option<MassProperties> {
        self.body().given_mass
    }

    /// Centre of mass, world.
    #[must_use]
    pub fn center_of_mass(&self) -> Vec3 {
        self.world.solver_bodies.masses[self.id.index as usize].center
    }

    /// Inverse inertia about the centre of mass in world axes, locks included; zero for bodies that are not dynamic.
    #[must_use]
    pub fn inverse_inertia(&self) -> SymmetricMat3 {
        self.world.solver_bodies.masses[self.id.index as usize].inverse_inertia
    }

    /// Force gathered for the next step, N.
    #[must_use]
    pub fn force(&self) -> Vec3 {
        self.body().force
    }

    /// Torque gathered for the next step, N m.
    #[must_use]
    pub fn torque(&self) -> Vec3 {
        self.body().torque
    }

    /// Rate at which linear velocity decays, 1/s.
    #[must_use]
    pub fn linear_damping(&self) -> Real {
        self.world.solver_bodies.motions[self.id.index as usize].linear_damping
    }

    /// Rate at which angular velocity decays, 1/s.
    #[must_use]
    pub fn angular_damping(&self) -> Real {
        self.world.solver_bodies.motions[self.id.index as usize].angular_damping
    }

    /// What gravity is multiplied by.
    #[must_use]
    pub fn gravity_scale(&self) -> Real {
        self.body().gravity_scale
    }

    /// World axes on which it may not move.
    #[must_use]
    pub fn locked_axes(&self) -> LockedAxes {
        self.body().locked_axes
    }

    /// Whether it is stepped. Static bodies never are; kinematic ones while they move.
    #[must_use]
    pub fn is_awake(&self) -> bool {
        self.body().awake
    }

    /// Whether it may fall asleep.
    #[must_use]
    pub fn can_sleep(&self) -> bool {
        self.body().can_sleep
    }

    /// Whether continuous collision looks at it when it is fast.
    #[must_use]
    pub fn is_continuous(&self) -> bool {
        self.body().continuous
    }

    /// Whether it is a bullet: see [`BodyDefinition::bullet`](crate::BodyDefinition::bullet).
    #[must_use]
    pub fn is_bullet(&self) -> bool {
        self.body().bullet
    }

    /// Whether it takes part at all.
    #[must_use]
    pub fn is_enabled(&self) -> bool {
        self.body().enabled
    }

    /// Whether it went non-finite and was stopped; setting its pose or velocity sets it free.
    #[must_use]
    pub fn is_frozen(&self) -> bool {
        self.body().frozen
    }

    /// Its shapes, oldest first.
    #[must_use]
    pub fn shapes(&self) -> &'a [ShapeId] {
        &self.body().shapes
    }

    /// Yours.
    #[must_use]
    pub fn user_data(&self) -> u128 {
        self.body().user_data
    }
}

impl<'a> BodyMut<'a> {
    pub(crate) fn new(world: &'a mut World, id: BodyId) -> Self {
        Self { world, id }
    }

    /// The same body, to read.
    #[must_use]
    pub fn read(&self) -> BodyRef<'_> {
        BodyRef { world: self.world, id: self.id }
    }

    fn index(&self) -> usize {
        self.id.index as usize
    }

    fn body(&mut self) -> &mut Body {
        &mut self.world.bodies[self.id.index as usize]
    }

    /// The world's own body stays where it is.
    fn movable(&self) -> Result<(), Error> {
        if self.id == BodyId::WORLD { Err(Error::WorldBody) } else { Ok(()) }
    }

    /// Puts the body somewhere else at once: wakes it and what touches it, and clears its cached contacts.
    ///
    /// # Errors
    /// If the position is not finite, or this is the world's own body.
    pub fn set_position(&mut self, position: Vec3) -> Result<(), Error> {
        let rotation = self.read().rotation();
        self.set_pose(position, rotation)
    }

    /// Turns the body at once; see [`BodyMut::set_position`].
    ///
    /// # Errors
    /// If the rotation is not a finite unit quaternion, or this is the world's own body.
    pub fn set_rotation(&mut self, rotation: Quat) -> Result<(), Error> {
        let position = self.read().position();
        self.set_pose(position, rotation)
    }

    /// Places the body at once; see [`BodyMut::set_position`].
    ///
    /// # Errors
    /// If the pose is not finite or the rotation not of unit length, or this is the world's own body.
    pub fn set_pose(&mut self, position: Vec3, rotation: Quat) -> Result<(), Error> {
        self.movable()?;
        finite_vec("position", position)?;
        let rotation = unit_rotation("rotation", rotation)?;
        self.body().pose = Pose::new(position, rotation);
        self.body().frozen = false;
        self.world.body_teleported(self.id.index);
        Ok(())
    }

    /// Sets the velocity of the centre of mass, m/s. A velocity other than zero wakes the body.
    ///
    /// # Errors
    /// If it is not finite, or the body is static.
    pub fn set_linear_velocity(&mut self, velocity: Vec3) -> Result<(), Error> {
        finite_vec("linear_velocity", velocity)?;
        let angular = self.read().angular_velocity();
        self.set_velocities(velocity, angular, velocity)
    }

    /// Sets the angular velocity about world axes, rad/s. A velocity other than zero wakes the body.
    ///
    /// # Errors
    /// If it is not finite, or the body is static.
    pub fn set_angular_velocity(&mut self, velocity: Vec3) -> Result<(), Error> {
        finite_vec("angular_velocity", velocity)?;
        let linear = self.read().linear_velocity();
        self.set_velocities(linear, velocity, velocity)
    }

    fn set_velocities(&mut self, linear: Vec3, angular: Vec3, changed: Vec3) -> Result<(), Error> {
        if self.read().kind() == BodyKind::Static {
            return Err(Error::StaticBody { id: self.id });
        }
        let (free_linear, free_angular) = self.read().locked_axes().free();
        let index = self.index();
        let state = &mut self.world.solver_bodies.states[index];
        state.linear_velocity = linear * free_linear;
        state.angular_velocity = angular * free_angular;
        self.world.solver_bodies.motions[index].residual = Vec3::ZERO;
        if std::mem::take(&mut self.body().frozen) {
            self.world.refresh_solver_body(self.id.index);
        }
        if changed != Vec3::ZERO {
            self.world.wake(self.id.index);
        }
        Ok(())
    }

    /// Adds a force at the centre of mass for the next step, N; wakes the body. Nothing happens to bodies that are not dynamic.
    ///
    /// # Errors
    /// If it is not finite.
    pub fn apply_force(&mut self, force: Vec3) -> Result<(), Error> {
        let force = finite_vec("force", force)?;
        self.add_force(force, Vec3::ZERO)
    }

    /// Adds a force at a world point for the next step, N; wakes the body.
    ///
    /// # Errors
    /// If an argument is not finite.
    pub fn apply_force_at(&mut self, force: Vec3, point: Vec3) -> Result<(), Error> {
        finite_vec("force", force)?;
        finite_vec("point", point)?;
        let torque = (point - self.read().center_of_mass()).cross(force);
        self.add_force(force, finite_vec("torque of the force", torque)?)
    }

    /// Adds a torque about world axes for the next step, N m; wakes the body.
    ///
    /// # Errors
    /// If it is not finite.
    pub fn apply_torque(&mut self, torque: Vec3) -> Result<(), Error> {
        let torque = finite_vec("torque", torque)?;
        self.add_force(Vec3::ZERO, torque)
    }

    fn add_force(&mut self, force: Vec3, torque: Vec3) -> Result<(), Error> {
        if self.read().kind() != BodyKind::Dynamic {
            return Ok(());
        }
        let body = self.body();
        let (sum, turning) = (body.force + force, body.torque + torque);
        finite_vec("sum of the forces", sum)?;
        finite_vec("sum of the torques", turning)?;
        (body.force, body.torque) = (sum, turning);
        if force != Vec3::ZERO || torque != Vec3::ZERO {
            self.world.wake(self.id.index);
        }
        Ok(())
    }

    /// Changes the velocity at once by an impulse at the centre of mass, N s; wakes the body.
    ///
    /// # Errors
    /// If it is not finite.
    pub fn apply_impulse(&mut self, impulse: Vec3) -> Result<(), Error> {
        let center = self.read().center_of_mass();
        self.apply_impulse_at(impulse, center)
    }

    /// Changes the velocities at once by an impulse at a world point, N s; wakes the body. Nothing happens to bodies that
    /// are not dynamic.
    ///
    /// # Errors
    /// If an argument is not finite, or the new velocity would not be.
    pub fn apply_impulse_at(&mut self, impulse: Vec3, point: Vec3) -> Result<(), Error> {
        finite_vec("impulse", impulse)?;
        finite_vec("point", point)?;
        let turn = (point - self.read().center_of_mass()).cross(impulse);
        self.add_impulse(impulse, turn)
    }

    /// Changes the angular velocity at once by an angular impulse, N m s; wakes the body.
    ///
    /// # Errors
    /// If it is not finite, or the new velocity would not be.
    pub fn apply_angular_impulse(&mut self, impulse: Vec3) -> Result<(), Error> {
        finite_vec("angular impulse", impulse)?;
        self.add_impulse(Vec3::ZERO, impulse)
    }

    fn add_impulse(&mut self, impulse: Vec3, turn: Vec3) -> Result<(), Error> {
        if self.read().kind() != BodyKind::Dynamic || (impulse == Vec3::ZERO && turn == Vec3::ZERO) {
            return Ok(());
        }
        let index = self.index();
        let mass = self.world.solver_bodies.masses[index];
        let state = &self.world.solver_bodies.states[index];
        let linear = state.linear_velocity + mass.inverse_mass * impulse;
        let angular = state.angular_velocity + mass.inverse_inertia.mul(turn);
        finite_vec("velocity after the impulse", linear)?;
        finite_vec("angular velocity after the impulse", angular)?;
        let state = &mut self.world.solver_bodies.states[index];
        (state.linear_velocity, state.angular_velocity) = (linear, angular);
        self.world.wake(self.id.index);
        Ok(())
    }

    /// Makes the body static, kinematic or dynamic. Its arbiters end; contacts are found anew in the next step. A body that
    /// becomes static loses its velocity.
    ///
    /// # Errors
    /// If it carries a shape without a volume (see [`World::add_shape`]) and would become dynamic, or is the world's own.
    pub fn set_kind(&mut self, kind: BodyKind) -> Result<(), Error> {
        self.movable()?;
        if kind == self.read().kind() {
            return Ok(());
        }
        if kind == BodyKind::Dynamic {
            self.world.check_dynamic(self.id.index)?;
        }
        self.world.change_kind(self.id.index, kind);
        self.world.flush_events();
        Ok(())
    }

    /// Takes the body out of the world or puts it back. While disabled it has no contacts, is found by no query, and rests.
    ///
    /// # Errors
    /// For the world's own body.
    pub fn set_enabled(&mut self, enabled: bool) -> Result<(), Error> {
        self.movable()?;
        if self.read().is_enabled() != enabled {
            self.world.change_enabled(self.id.index, enabled);
            self.world.flush_events();
        }
        Ok(())
    }

    /// Gives the body a mass, centre and inertia of its own, or with `None` those of its shapes. Clears its cached contacts.
    ///
    /// # Errors
    /// If the mass or a principal moment is not finite and above zero.
    pub fn set_mass(&mut self, mass: Option<MassProperties>) -> Result<(), Error> {
        mass.as_ref().map_or(Ok(()), validate_mass)?;
        self.body().given_mass = mass;
        self.world.update_mass(self.id.index);
        Ok(())
    }

    /// Sets the rate at which linear velocity decays, 1/s.
    ///
    /// # Errors
    /// If it is not from 0 to 10⁶.
    pub fn set_linear_damping(&mut self, damping: Real) -> Result<(), Error> {
        let index = self.index();
        self.world.solver_bodies.motions[index].linear_damping = in_range("linear_damping", damping, 0.0, 1e6)?;
        Ok(())
    }

    /// Sets the rate at which angular velocity decays, 1/s.
    ///
    /// # Errors
    /// If it is not from 0 to 10⁶.
    pub fn set_angular_damping(&mut self, damping: Real) -> Result<(), Error> {
        let index = self.index();
        self.world.solver_bodies.motions[index].angular_damping = in_range("angular_damping", damping, 0.0, 1e6)?;
        Ok(())
    }

    /// Sets what gravity is multiplied by; wakes the body.
    ///
    /// # Errors
    /// If it is not finite.
    pub fn set_gravity_scale(&mut self, scale: Real) -> Result<(), Error> {
        self.body().gravity_scale = finite("gravity_scale", scale)?;
        self.world.wake(self.id.index);
        Ok(())
    }

    /// Locks world axes; the velocity along them is lost.
    pub fn set_locked_axes(&mut self, locked: LockedAxes) {
        self.body().locked_axes = locked;
        self.world.update_mass(self.id.index);
        let (linear, angular) = locked.free();
        let index = self.index();
        let state = &mut self.world.solver_bodies.states[index];
        state.linear_velocity *= linear;
        state.angular_velocity *= angular;
    }

    /// Allows or forbids sleep; forbidding wakes the body.
    pub fn set_can_sleep(&mut self, can_sleep: bool) {
        self.body().can_sleep = can_sleep;
        if !can_sleep {
            self.world.wake(self.id.index);
        }
    }

    /// Switches continuous collision on or off.
    pub fn set_continuous(&mut self, continuous: bool) {
        self.body().continuous = continuous;
    }

    /// Makes the body a bullet or an ordinary body: see [`BodyDefinition::bullet`](crate::BodyDefinition::bullet).
    pub fn set_bullet(&mut self, bullet: bool) {
        self.body().bullet = bullet;
        self.world.note_kind(self.id.index);
    }

    /// Calls `listener` whenever an arbiter of this body begins, before it is solved.
    pub fn on_begin_collide(&mut self, listener: BeginListener) {
        self.world.listeners.of_body(self.id.index).begin.push(listener);
    }

    /// Calls `listener` whenever an arbiter of this body has ended.
    pub fn on_end_collide(&mut self, listener: EndListener) {
        self.world.listeners.of_body(self.id.index).end.push(listener);
    }

    /// Sets what is yours.
    pub fn set_user_data(&mut self, user_data: u128) {
        self.body().user_data = user_data;
    }

    /// Wakes the body and its island, and starts its time to sleep again.
    pub fn wake(&mut self) {
        self.world.wake(self.id.index);
    }

    /// Puts the body to sleep with all it is tied to, where that may sleep. The island loses its velocities.
    pub fn sleep(&mut self) {
        self.world.put_to_sleep(self.id.index);
    }
}

impl World {
    pub(crate) fn body_index(&self, id: BodyId) -> Result<u32, Error> {
        match self.bodies.get(id.index as usize) {
            Some(body) if body.alive && body.generation == id.generation => Ok(id.index),
            _ => Err(Error::UnknownBody { id }),
        }
    }

    pub(crate) fn body_id(&self, index: u32) -> BodyId {
        BodyId { index, generation: self.bodies[index as usize].generation }
    }

    /// Sums the mass over the shapes (or takes the given one) and refreshes what depends on it.
    pub(crate) fn update_mass(&mut self, index: u32) {
        let body = &self.bodies[index as usize];
        let mass = body.given_mass.unwrap_or_else(|| self.mass_of_shapes(index));
        let moved = mass.center != self.bodies[index as usize].mass.center;
        self.bodies[index as usize].mass = mass;
        if moved {
            // Anchors are kept from the centre of mass.
            self.clear_contacts_of(index);
        }
        for &slot in &self.bodies[index as usize].shape_slots {
            self.shapes[slot as usize].set_center(mass.center);
        }
        self.refresh_reach(index);
        self.refresh_solver_body(index);
    }

    /// The sum over the shapes; a body without any mass gets 1 kg on a ball of 1 m, so that it can move.
    fn mass_of_shapes(&self, index: u32) -> MassProperties {
        let mut sum = MassProperties::default();
        for &slot in &self.bodies[index as usize].shape_slots {
            let shape = &self.shapes[slot as usize];
            if let (false, Ok(mass)) = (shape.sensor, shape.geometry.mass_properties(shape.density)) {
                let mass = mass.transform(&shape.pose);
                sum = if sum.mass > 0.0 { sum.combine(&mass) } else { mass };
            }
        }
        if sum.mass > 0.0 && sum.inertia.inverse().is_some() {
            sum
        } else {
            MassProperties { mass: 1.0, center: Vec3::ZERO, inertia: SymmetricMat3::diagonal(Vec3::splat(0.4)) }
        }
    }

    fn refresh_reach(&mut self, index: u32) {
        let (mut inner, mut reach, mut extents) = (Real::MAX, 0.0, Vec3::ZERO);
        let body = &self.bodies[index as usize];
        for &slot in &body.shape_slots {
            let shape = &self.shapes[slot as usize];
            inner = crate::math::min(2.0 * depth_on_body(&shape.geometry, body.kind), inner);
            let center_of_mass = shape.from_center.inverse().position;
            reach = crate::math::max(shape.geometry.reach_from(center_of_mass), reach);
            extents = max3(shape.geometry.aabb(&shape.from_center).farthest_from(Vec3::ZERO), extents);
        }
        let body = &mut self.bodies[index as usize];
        body.inner_radius = if body.shape_slots.is_empty() { 0.0 } else { inner };
        (body.reach, body.extents) = (reach, extents);
    }

    /// Adds a force that comes anew in every step, as a spring or a fluid gives it. Other than a push it does not keep the
    /// body awake, and a body at rest takes none.
    pub(crate) fn add_lasting_force(&mut self, id: BodyId, force: Vec3, torque: Vec3) -> Result<(), Error> {
        let index = self.body_index(id)? as usize;
        let body = &mut self.bodies[index];
        if !body.awake || !body.is_dynamic() {
            return Ok(());
        }
        let (sum, turning) = (body.force + force, body.torque + torque);
        finite_vec("sum of the forces", sum)?;
        finite_vec("sum of the torques", turning)?;
        (body.force, body.torque) = (sum, turning);
        Ok(())
    }

    /// Lists the awake bodies, in no particular order.
    pub(crate) fn list_awake(&self, list: &mut Vec<BodyId>) {
        list.clear();
        list.extend(self.awake.iter().map(|&index| self.body_id(index)));
    }

    /// Copies kind, mass and pose of a body into the solver's records.
    pub(crate) fn refresh_solver_body(&mut self, index: u32) {
        let body = &self.bodies[index as usize];
        let dynamic = body.is_dynamic() && body.enabled && !body.frozen;
        let (free_linear, free_angular) = body.locked_axes.free();
        let motion = &mut self.solver_bodies.motions[index as usize];
        motion.kinematic = flag(body.kind != BodyKind::Dynamic);
        motion.inertia = body.mass.inertia;
        motion.inverse_inertia = body.mass.inertia.inverse().unwrap_or_default();
        motion.gyroscopic = flag(dynamic && !body.mass.inertia.is_isotropic() && free_angular == Vec3::ONE);
        let state = &mut self.solver_bodies.states[index as usize];
        if body.kind == BodyKind::Static {
            (state.linear_velocity, state.angular_velocity) = (Vec3::ZERO, Vec3::ZERO);
        }
        let mass = &mut self.solver_bodies.masses[index as usize];
        mass.inverse_mass = if dynamic { free_linear / body.mass.mass } else { Vec3::ZERO };
        mass.rotation = body.pose.rotation;
        mass.center = body.pose.transform_point(body.mass.center);
        mass.inverse_inertia = if dynamic {
            world_inverse_inertia(&mass.rotation.to_mat3(), motion, free_angular)
        } else {
            SymmetricMat3::ZERO
        };
        let moves = dynamic && (free_linear != Vec3::ZERO || free_angular != Vec3::ZERO);
        let state = &mut self.solver_bodies.states[index as usize];
        let moved = std::mem::replace(&mut state.moves, u32::from(moves)) != 0;
        state.locked = u32::from(moves && free_linear != Vec3::ONE);
        if moved != moves {
            self.refresh_bearings(index);
        }
    }

    pub(crate) fn end_arbiters_of(&mut self, index: u32, reason: EndReason) {
        loop {
            let first = self.arbiters.of_body(index).next();
            let Some(arbiter) = first else { break };
            self.end_arbiter(arbiter, reason);
        }
    }
}

/// Yes or no as the integrator's lanes have it.
fn flag(yes: bool) -> Real {
    if yes { 1.0 } else { 0.0 }
}

/// Inverse inertia in world axes; with locked axes (0 in `free`), the inverse of the block that may turn.
#[inline(always)]
pub(crate) fn world_inverse_inertia(rotation: &Mat3, motion: &BodyMotion, free: Vec3) -> SymmetricMat3 {
    if free == Vec3::ONE {
        return motion.inverse_inertia.rotate(rotation);
    }
    let m = motion.inertia.rotate(rotation);
    let (xy, xz, yz) = (free.x * free.y, free.x * free.z, free.y * free.z);
    let block = SymmetricMat3 {
        xx: if free.x > 0.0 { m.xx } else { m.xx + m.yy + m.zz },
        yy: if free.y > 0.0 { m.yy } else { m.xx + m.yy + m.zz },
        zz: if free.z > 0.0 { m.zz } else { m.xx + m.yy + m.zz },
        xy: m.xy * xy,
        xz: m.xz * xz,
        yz: m.yz * yz,
    };
    let inverse = block.inverse().unwrap_or_default();
    SymmetricMat3 {
        xx: inverse.xx * free.x,
        yy: inverse.yy * free.y,
        zz: inverse.zz * free.z,
        xy: inverse.xy * xy,
        xz: inverse.xz * xz,
        yz: inverse.yz * yz,
    }
}
