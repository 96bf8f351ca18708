//! An impact solved at once: the impulses at the contacts of two shapes that meet.
//!
//! The arbiter of the two shapes is looked up or made, with the contacts of their manifold at the moment of the meeting, and its
//! begin is raised, so that listeners can edit it before it counts. Then the contacts are solved one after the other, again and
//! again (Gauss–Seidel), for the normal velocity `−e v₀` and for no sliding within the friction cone. Newton's
//! restitution with friction can give more energy than there was; the work of the impulses `P` is `½ P·(u₀ + u₁)` with the
//! relative velocities `u` at the contacts before and after, and where that is above zero, all impulses are made smaller by
//! the same share, so that it is zero.

use super::bullets::Meeting;
use crate::arbiter::{ArbiterId, ArbiterKey, Contact, NONE, SolveMode};
use crate::id::{BodyId, ShapeId};
use crate::math::{Pose, Real, SymmetricMat3, Vec3, max, min};
use crate::narrow_phase::{Manifold, PairCache, collide_on};
use crate::solver::BodyMass;
use crate::world::World;
use crate::world::bodies::world_inverse_inertia;

/// Rounds over the contacts. Four corners that hit flat need about ten.
const ROUNDS: usize = 16;
/// Contacts of a manifold at most.
const CONTACTS: usize = 4;

/// An impact of a bullet, as continuous collision has solved it.
///
/// ```
/// use arbiter3d::{BodyDefinition, BodyId, Shape, ShapeDefinition, World, math::Vec3};
/// let mut world = World::default();
/// world.add_shape(BodyId::WORLD, &ShapeDefinition::new(Shape::cuboid(Vec3::new(0.01, 2.0, 2.0))?))?;
/// let shot = BodyDefinition::dynamic().at(Vec3::X * -2.0).moving(Vec3::X * 300.0, Vec3::ZERO);
/// let shot = world.add_body(&BodyDefinition { bullet: true, ..shot })?;
/// world.add_shape(shot, &ShapeDefinition::new(Shape::sphere(0.05)?))?;
/// world.step(1.0 / 60.0)?;
/// assert!((world.impacts()[0].approach_speed - 300.0).abs() < 1.0);
/// # Ok::<(), arbiter3d::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Impact {
    /// When in the step: 0 at its beginning, 1 at its end.
    pub time: Real,
    /// The bodies, that of the older shape first.
    pub bodies: [BodyId; 2],
    /// Their shapes.
    pub shapes: [ShapeId; 2],
    /// Where, world, metres: the middle of the contacts.
    pub point: Vec3,
    /// Unit vector from the first body to the second.
    pub normal: Vec3,
    /// How fast the shapes came together there along the normal, m/s.
    pub approach_speed: Real,
    /// Sum of the impulses along the normal, N s.
    pub impulse: Real,
}

/// How two shapes have met.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Outcome {
    /// Their bodies have new velocities.
    Solved,
    /// A filter or a listener wants that they pass each other.
    Passed,
    /// They have no contacts, by rounding.
    Stuck,
}

/// One contact while it is solved.
#[derive(Clone, Copy, Default)]
struct Point {
    levers: [Vec3; 2],
    normal: Vec3,
    /// Velocity of body 2 against body 1 here before the impact.
    before: Vec3,
    /// Speed along the normal that is wanted.
    wanted: Real,
    normal_impulse: Real,
    friction_impulse: Vec3,
}

/// What an impact is solved with.
struct Solve {
    friction: Real,
    /// Velocity of the surface of body 1 against that of body 2.
    surface: Vec3,
    inverse_mass: [Vec3; 2],
    inverse_inertia: [SymmetricMat3; 2],
    linear: [Vec3; 2],
    angular: [Vec3; 2],
    points: [Point; CONTACTS],
    count: usize,
}

impl Solve {
    fn velocity(&self, point: &Point) -> Vec3 {
        let [v1, v2] = [0, 1].map(|side| self.linear[side] + self.angular[side].cross(point.levers[side]));
        v2 - v1
    }

    /// How much velocity along a unit vector an impulse of 1 along it gives.
    fn response(&self, point: &Point, direction: Vec3) -> Real {
        (0..2).fold(0.0, |sum, side| {
            let swing = point.levers[side].cross(direction);
            sum + direction.dot(self.inverse_mass[side] * direction) + swing.dot(self.inverse_inertia[side].mul(swing))
        })
    }

    fn apply(&mut self, levers: [Vec3; 2], impulse: Vec3) {
        for (side, sign) in [-1.0, 1.0].into_iter().enumerate() {
            let impulse = impulse * sign;
            self.linear[side] += self.inverse_mass[side] * impulse;
            self.angular[side] += self.inverse_inertia[side].mul(levers[side].cross(impulse));
        }
    }

    /// Solves all contacts.
    fn run(&mut self) {
        for _ in 0..ROUNDS {
            for at in 0..self.count {
                self.solve_normal(at);
                self.solve_friction(at);
            }
        }
        self.keep_energy();
    }

    fn solve_normal(&mut self, at: usize) {
        let point = self.points[at];
        let response = self.response(&point, point.normal);
        if response <= 0.0 {
            return;
        }
        let missing = point.wanted - self.velocity(&point).dot(point.normal);
        let sum = max(point.normal_impulse + missing / response, 0.0);
        self.points[at].normal_impulse = sum;
        self.apply(point.levers, point.normal * (sum - point.normal_impulse));
    }

    fn solve_friction(&mut self, at: usize) {
        let point = self.points[at];
        let velocity = self.velocity(&point) - self.surface;
        let sliding = velocity - point.normal * velocity.dot(point.normal);
        let speed = sliding.length();
        if speed <= 0.0 || self.friction <= 0.0 {
            return;
        }
        let response = self.response(&point, sliding / speed);
        if response <= 0.0 {
            return;
        }
        let wanted = point.friction_impulse - sliding / response;
        let (size, most) = (wanted.length(), self.friction * point.normal_impulse);
        let sum = if size > most { wanted * (most / size) } else { wanted };
        self.points[at].friction_impulse = sum;
        self.apply(point.levers, sum - point.friction_impulse);
    }

    /// Makes all impulses smaller where they have done work. Surfaces that move by themselves may.
    fn keep_energy(&mut self) {
        if self.surface != Vec3::ZERO {
            return;
        }
        let (mut linear, mut squared) = (0.0, 0.0);
        for point in &self.points[..self.count] {
            let impulse = point.normal * point.normal_impulse + point.friction_impulse;
            linear += impulse.dot(point.before);
            squared += 0.5 * impulse.dot(self.velocity(point) - point.before);
        }
        if linear + squared <= 0.0 || squared <= 0.0 {
            return;
        }
        let share = min(max(-linear / squared, 0.0), 1.0);
        for at in 0..self.count {
            let point = self.points[at];
            let impulse = point.normal * point.normal_impulse + point.friction_impulse;
            self.apply(point.levers, impulse * (share - 1.0));
            self.points[at].normal_impulse *= share;
            self.points[at].friction_impulse *= share;
        }
    }
}

impl World {
    /// Impacts of bullets in the last step, in the order of time.
    #[must_use]
    pub fn impacts(&self) -> &[Impact] {
        &self.impacts
    }

    /// Puts the centre frame of a body somewhere on its way.
    pub(super) fn place_center(&mut self, index: u32, pose: &Pose) {
        let (body, motion) = (&self.bodies[index as usize], &self.solver_bodies.motions[index as usize]);
        let mass = &mut self.solver_bodies.masses[index as usize];
        (mass.center, mass.rotation) = (pose.position, pose.rotation);
        if body.is_dynamic() && body.enabled && !body.frozen {
            let free = body.locked_axes.free().1;
            mass.inverse_inertia = world_inverse_inertia(&pose.rotation.to_mat3(), motion, free);
        }
    }

    /// Solves the impact of two shapes whose bodies' centres are where they meet.
    pub(super) fn solve_impact(&mut self, made: &mut Vec<ArbiterId>, meeting: &Meeting) -> Outcome {
        let [a, b] = meeting.slots;
        let slots = if self.shapes[a as usize].id < self.shapes[b as usize].id { [a, b] } else { [b, a] };
        let mut manifold = self.impact_manifold(slots);
        if manifold.points().is_empty() {
            return Outcome::Stuck;
        }
        if !self.filters.passes_manifold((&self.shapes, &self.bodies), slots, &mut manifold)
            || manifold.points().is_empty()
        {
            return Outcome::Passed;
        }
        let Some(id) = self.impact_arbiter(slots, &manifold) else { return Outcome::Passed };
        crate::storage::push(made, id);
        let Some(index) = self.arbiters.index_of(id) else { return Outcome::Passed };
        let mut solve = self.impact_solve(index);
        for (_, contact) in self.arbiters.at(index).data.contacts() {
            solve.points[solve.count] = self.impact_point(index, contact, &solve);
            solve.count += 1;
        }
        solve.run();
        if solve.count == 0 {
            return Outcome::Passed; // a listener has taken the contacts away
        }
        self.note_impact(index, slots, &solve, meeting.time as Real);
        Outcome::Solved
    }

    /// The contacts of two shapes that are within two slops.
    fn impact_manifold(&self, slots: [u32; 2]) -> Manifold {
        let shapes = slots.map(|slot| &self.shapes[slot as usize]);
        let [pose1, pose2] =
            shapes.map(|shape| self.solver_bodies.masses[shape.body as usize].pose().mul(&shape.from_center));
        let mut manifold = Manifold::EMPTY;
        let kept = (&mut PairCache::default(), &mut manifold);
        let margin = 2.0 * self.scaled.slop;
        collide_on(self.level, (&shapes[0].geometry, &shapes[1].geometry), &pose1.relative(&pose2), margin, kept);
        manifold
    }

    /// The arbiter of two shapes with the contacts of their meeting, begun; `None` if a listener has removed it.
    fn impact_arbiter(&mut self, slots: [u32; 2], manifold: &Manifold) -> Option<ArbiterId> {
        let [s1, s2] = slots.map(|slot| &self.shapes[slot as usize]);
        let [touched1, touched2] = manifold.materials();
        let (key, indices, materials) =
            (ArbiterKey::of_shapes(s1.id, s2.id), [s1.body, s2.body], [*s1.surface(touched1), *s2.surface(touched2)]);
        let (pose1, from_center) = (self.solver_bodies.masses[s1.body as usize].pose(), s1.from_center);
        let index = match self.arbiters.find(key) {
            Some(index) => index,
            None => {
                let [body1, body2] = indices.map(|index| self.body_id(index));
                let index = self.create_arbiter(key, body1, body2);
                self.arbiters.custom += 1;
                let rotations = indices.map(|body| self.solver_bodies.masses[body as usize].rotation);
                let data = &mut self.arbiters.at_mut(index).data;
                let [m1, m2] = &materials;
                data.friction = m1.friction_combine.max(m2.friction_combine).combine(m1.friction, m2.friction);
                data.restitution =
                    m1.restitution_combine.max(m2.restitution_combine).combine(m1.restitution, m2.restitution);
                data.tangent_velocity = crate::world::arbiters::surface_velocity([m1, m2], rotations);
                index
            }
        };
        let shape1 = pose1.mul(&from_center);
        let poses = indices.map(|body| self.solver_bodies.masses[body as usize].pose());
        let arbiter = self.arbiters.at_mut(index);
        arbiter.data.clear();
        let least = manifold.points().iter().fold(Real::MAX, |least, point| min(point.separation, least));
        for point in manifold.points().iter().filter(|point| point.separation <= least + 0.25 * self.scaled.slop) {
            let normal = shape1.rotation.rotate(point.normal);
            let on1 = shape1.transform_point(point.point1);
            let contact = Contact {
                local_anchor1: poses[0].inverse_transform_point(on1),
                local_anchor2: poses[1].inverse_transform_point(on1 + normal * point.separation),
                normal,
                separation: point.separation,
                world_normal: true,
                ..Contact::default()
            };
            arbiter.data.add(contact, 0.0);
        }
        let (id, pair) = (arbiter.id, arbiter.pair);
        if pair != NONE {
            self.pairs[pair as usize].has_manifold = false;
        }
        indices.into_iter().for_each(|body| self.wake(body));
        self.raise_begin();
        let alive = indices.iter().all(|&body| self.bodies[body as usize].alive && self.bodies[body as usize].enabled);
        (alive && self.arbiters.index_of(id).is_some()).then_some(id)
    }

    /// What the bodies of an arbiter bring to an impact.
    fn impact_solve(&self, index: u32) -> Solve {
        let arbiter = self.arbiters.at(index);
        let data = &arbiter.data;
        let bodies = [arbiter.body1.index, arbiter.body2.index];
        let masses: [&BodyMass; 2] = bodies.map(|body| &self.solver_bodies.masses[body as usize]);
        let velocities = bodies.map(|body| self.flight_velocities(body));
        let linear_mode = [SolveMode::LINEAR_BODY1, SolveMode::LINEAR_BODY2];
        let angular_mode = [SolveMode::ANGULAR_BODY1, SolveMode::ANGULAR_BODY2];
        let sides = [0, 1];
        Solve {
            friction: data.friction,
            surface: data.tangent_velocity,
            inverse_mass: sides.map(|side| {
                if data.solve_mode.contains(linear_mode[side]) { masses[side].inverse_mass } else { Vec3::ZERO }
            }),
            inverse_inertia: sides.map(|side| {
                let turns = data.solve_mode.contains(angular_mode[side]);
                if turns { masses[side].inverse_inertia } else { SymmetricMat3::ZERO }
            }),
            linear: velocities.map(|[linear, _]| linear),
            angular: velocities.map(|[_, angular]| angular),
            points: [Point::default(); CONTACTS],
            count: 0,
        }
    }

    fn impact_point(&self, index: u32, contact: &Contact, solve: &Solve) -> Point {
        let arbiter = self.arbiters.at(index);
        let masses = [arbiter.body1, arbiter.body2].map(|body| &self.solver_bodies.masses[body.index as usize]);
        // Both impulses in the middle of the gap: friction across it would turn what it should not.
        let apart = masses[1].center - masses[0].center;
        let on1 = masses[0].rotation.rotate(contact.local_anchor1);
        let on2 = masses[1].rotation.rotate(contact.local_anchor2) + apart;
        let middle = (on1 + on2) * 0.5;
        let levers = [middle, middle - apart];
        let mut point = Point { levers, normal: contact.normal, ..Point::default() };
        point.before = solve.velocity(&point);
        let approach = -point.before.dot(point.normal);
        let bounces = approach > self.scaled.restitution_threshold;
        point.wanted = if bounces { arbiter.data.restitution * approach } else { 0.0 };
        point
    }

    /// Gives the bodies their new velocities and the arbiter its impulses, and notes the impact.
    fn note_impact(&mut self, index: u32, slots: [u32; 2], solve: &Solve, time: Real) {
        let arbiter = self.arbiters.at_mut(index);
        let bodies = [arbiter.body1, arbiter.body2];
        let mut points = solve.points[..solve.count].iter();
        for slot in 0..CONTACTS {
            if arbiter.data.usage_mask >> slot & 1 == 1
                && let Some(point) = points.next()
            {
                let contact = &mut arbiter.data.slots[slot];
                (contact.normal_impulse, contact.total_impulse) = (point.normal_impulse, point.normal_impulse);
            }
        }
        let masses = &self.solver_bodies.masses;
        let (mut middle, mut impulse, mut approach) = (Vec3::ZERO, 0.0, 0.0);
        for point in &solve.points[..solve.count] {
            middle += (masses[bodies[0].index as usize].center + point.levers[0]) / solve.count as Real;
            impulse += point.normal_impulse;
            approach = max(-point.before.dot(point.normal), approach);
        }
        let shapes = slots.map(|slot| self.shapes[slot as usize].id);
        let (normal, approach_speed) = (solve.points[0].normal, approach);
        let noted = Impact { time, bodies, shapes, point: middle, normal, approach_speed, impulse };
        crate::storage::push(&mut self.impacts, noted);
        for (side, body) in bodies.into_iter().enumerate() {
            if self.bodies[body.index as usize].is_dynamic() {
                // What is faster than the way leads stays beside it, and none of it is lost here.
                let [linear, angular] = self.flight_velocities(body.index);
                let state = &mut self.solver_bodies.states[body.index as usize];
                state.linear_velocity = solve.linear[side] + (state.linear_velocity - linear);
                state.angular_velocity = solve.angular[side] + (state.angular_velocity - angular);
            }
        }
    }
}
