//! A scene as plain data: what every engine is built from, and what happens to it before each step.
//!
//! Read once, through the public interface of arbiter3d, from the world that `arbiter3d-scenes` builds. A scene's hook (which
//! steers a pillar or drops balls) is run in advance on that world, which is never stepped: only its kinematic bodies are
//! moved by their velocities. What the hook changes becomes a script, so that each engine, ours too, gets the very same
//! changes before the very same steps, and nothing but the step runs while the clock does.

use crate::catalog::Entry;
use arbiter3d::math::{Pose, Quat, Real, Rotation, Vec3};
use arbiter3d::{BodyDefinition, BodyId, BodyKind, Error, ShapeDefinition, World, WorldSettings};
use arbiter3d_scenes::{BuiltScene, SceneOptions, find};
use std::collections::HashMap;

/// A body with its shapes.
#[derive(Clone, Debug)]
pub struct Body {
    /// Whether this is the world's own body rather than one of the scene's.
    pub is_world: bool,
    /// Kind, pose, velocities, locks, sleep.
    pub definition: BodyDefinition,
    /// Geometry, local pose, density, surface, filter.
    pub shapes: Vec<ShapeDefinition>,
}

/// Something that happens before a step.
#[derive(Clone, Debug)]
pub enum Change {
    /// A body appears; it gets the next free index.
    Spawn(Box<Body>),
    /// A body disappears.
    Remove(usize),
    /// A body is given velocities: index, linear, angular.
    Velocity(usize, Vec3, Vec3),
}

/// A scene as plain data.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Gravity, sleep, substeps.
    pub settings: WorldSettings,
    /// Length of a step, seconds.
    pub dt: Real,
    /// Steps of a run.
    pub steps: usize,
    /// What is there at the start.
    pub bodies: Vec<Body>,
    /// What changes, by step.
    pub script: Vec<(usize, Change)>,
}

impl Scene {
    /// Builds the scene of a catalogue entry and reads it.
    pub fn load(entry: &Entry, steps: Option<usize>) -> Result<Self, Error> {
        let options = SceneOptions { size: entry.size, ..SceneOptions::default() };
        let scene = find(entry.name).expect("the catalogue lists scenes that exist");
        let built = scene.build(&options)?;
        let steps = steps.or(entry.steps).unwrap_or(built.steps);
        Self::read(built, steps)
    }

    /// Reads a scene, to be run for `steps` steps.
    pub fn read(mut built: BuiltScene, steps: usize) -> Result<Self, Error> {
        let settings = *built.world.settings();
        let dt = built.dt();
        let mut recorder = Recorder::default();
        let bodies = recorder.read_all(&built.world);
        if built.before_step.is_some() {
            for step in 0..steps {
                built.prepare_step(step)?;
                recorder.record(step, &built.world);
                recorder.advance(&mut built.world, dt)?;
            }
        }
        Ok(Self { settings, dt, steps, bodies, script: recorder.script })
    }

    /// All bodies that there ever are, in the order of their indices.
    pub fn all_bodies(&self) -> impl Iterator<Item = &Body> {
        let spawned = self.script.iter().filter_map(|(_, change)| match change {
            Change::Spawn(body) => Some(&**body),
            _ => None,
        });
        self.bodies.iter().chain(spawned)
    }

    /// Dynamic bodies at the start.
    pub fn dynamic_count(&self) -> usize {
        self.bodies.iter().filter(|body| body.definition.kind == BodyKind::Dynamic).count()
    }
}

/// Turns what a hook does into a script.
#[derive(Default)]
struct Recorder {
    /// Bodies in the order of the world's slots.
    known: Vec<BodyId>,
    indices: HashMap<BodyId, usize>,
    kinematic: Vec<(BodyId, Vec3, Vec3)>,
    next: usize,
    script: Vec<(usize, Change)>,
}

impl Recorder {
    fn read_all(&mut self, world: &World) -> Vec<Body> {
        let ids: Vec<BodyId> = world.bodies().filter(|&id| counts(world, id)).collect();
        let bodies = ids.iter().map(|&id| self.admit(world, id)).collect();
        self.known = world.bodies().collect();
        bodies
    }

    fn admit(&mut self, world: &World, id: BodyId) -> Body {
        self.indices.insert(id, self.next);
        self.next += 1;
        let body = read_body(world, id);
        if body.definition.kind == BodyKind::Kinematic {
            self.kinematic.push((id, body.definition.linear_velocity, body.definition.angular_velocity));
        }
        body
    }

    /// Notes what differs from before.
    fn record(&mut self, step: usize, world: &World) {
        if !world.bodies().eq(self.known.iter().copied()) {
            let gone = |id: &&BodyId| world.body(**id).is_none();
            for id in self.known.iter().filter(gone) {
                if let Some(index) = self.indices.remove(id) {
                    self.script.push((step, Change::Remove(index)));
                }
            }
            self.kinematic.retain(|(id, ..)| world.body(*id).is_some());
            self.known = world.bodies().collect();
            let new: Vec<BodyId> = self.known.iter().copied().filter(|id| !self.indices.contains_key(id)).collect();
            for id in new.into_iter().filter(|&id| counts(world, id)) {
                let body = self.admit(world, id);
                self.script.push((step, Change::Spawn(Box::new(body))));
            }
        }
        for (id, linear, angular) in &mut self.kinematic {
            let Some(body) = world.body(*id) else { continue };
            if (*linear, *angular) != (body.linear_velocity(), body.angular_velocity()) {
                (*linear, *angular) = (body.linear_velocity(), body.angular_velocity());
                self.script.push((step, Change::Velocity(self.indices[id], *linear, *angular)));
            }
        }
    }

    /// Moves the kinematic bodies as a step would.
    fn advance(&self, world: &mut World, dt: Real) -> Result<(), Error> {
        for &(id, linear, angular) in &self.kinematic {
            let Some(mut body) = world.body_mut(id) else { continue };
            let pose = moved(body.read().pose(), linear, angular, dt);
            body.set_pose(pose.position, pose.rotation.to_quat())?;
        }
        Ok(())
    }
}

/// The world's own body counts only when it carries something.
fn counts(world: &World, id: BodyId) -> bool {
    id != BodyId::WORLD || world.body(id).is_some_and(|body| !body.shapes().is_empty())
}

/// A pose after `dt` seconds at constant velocities, the turn to first order.
fn moved(pose: Pose, linear: Vec3, angular: Vec3, dt: Real) -> Pose {
    let q = pose.rotation.to_quat();
    let turned = q + Quat::from_xyzw(angular.x, angular.y, angular.z, 0.0) * q * (0.5 * dt);
    Pose::new(pose.position + linear * dt, Rotation::from_quat(turned.normalize()))
}

fn read_body(world: &World, id: BodyId) -> Body {
    let body = world.body(id).expect("listed by the world");
    let definition = BodyDefinition {
        kind: body.kind(),
        position: body.position(),
        rotation: body.rotation(),
        linear_velocity: body.linear_velocity(),
        angular_velocity: body.angular_velocity(),
        linear_damping: body.linear_damping(),
        angular_damping: body.angular_damping(),
        gravity_scale: body.gravity_scale(),
        locked_axes: body.locked_axes(),
        mass: body.given_mass(),
        can_sleep: body.can_sleep(),
        awake: body.kind() != BodyKind::Dynamic || body.is_awake(),
        enabled: body.is_enabled(),
        continuous: body.is_continuous(),
        bullet: body.is_bullet(),
        user_data: 0,
    };
    let shapes = body.shapes().iter().filter_map(|&shape| world.shape(shape)).map(|shape| ShapeDefinition {
        shape: shape.geometry().clone(),
        position: shape.position(),
        rotation: shape.rotation(),
        density: shape.density(),
        material: shape.material(),
        filter: shape.filter(),
        palette: shape.palette().to_vec(),
        one_way: shape.one_way(),
        events: shape.events(),
        sensor: shape.is_sensor(),
        user_data: 0,
    });
    Body { is_world: id == BodyId::WORLD, definition, shapes: shapes.collect() }
}
