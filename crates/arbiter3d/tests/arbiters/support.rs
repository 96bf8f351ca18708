//! Small worlds and listeners that the tests share.

use arbiter3d::math::{SymmetricMat3, Vec3};
use arbiter3d::*;
use std::sync::{Arc, Mutex, MutexGuard};

pub const DT: f32 = 1.0 / 60.0;

/// A world without gravity.
pub fn weightless() -> World {
    World::new(WorldSettings { gravity: Vec3::ZERO, ..WorldSettings::default() }).unwrap()
}

/// A dynamic body with one shape.
pub fn add(world: &mut World, position: Vec3, shape: Shape) -> (BodyId, ShapeId) {
    let body = world.add_body(&BodyDefinition::dynamic().at(position)).unwrap();
    let shape = world.add_shape(body, &ShapeDefinition::new(shape)).unwrap();
    (body, shape)
}

/// A dynamic sphere of 1 m.
pub fn add_sphere(world: &mut World, position: Vec3) -> (BodyId, ShapeId) {
    add(world, position, Shape::sphere(1.0).unwrap())
}

/// A dynamic body of 2 kg with isotropic inertia 0.4 kg m², without shapes.
pub fn add_bare(world: &mut World, position: Vec3) -> BodyId {
    let mass = MassProperties { mass: 2.0, center: Vec3::ZERO, inertia: SymmetricMat3::diagonal(Vec3::splat(0.4)) };
    world.add_body(&BodyDefinition { mass: Some(mass), ..BodyDefinition::dynamic().at(position) }).unwrap()
}

/// The world's floor: its top at height zero, 40 m wide.
pub fn add_floor(world: &mut World) -> ShapeId {
    let ground = Shape::cuboid(Vec3::new(20.0, 1.0, 20.0)).unwrap();
    world.add_shape(BodyId::WORLD, &ShapeDefinition::new(ground).at(Vec3::new(0.0, -1.0, 0.0))).unwrap()
}

/// Two spheres that overlap by half a metre, no gravity, not stepped yet: (world, A at 0, B at x = 1.5).
pub fn touching_pair() -> (World, (BodyId, ShapeId), (BodyId, ShapeId)) {
    let mut world = weightless();
    let a = add_sphere(&mut world, Vec3::ZERO);
    let b = add_sphere(&mut world, Vec3::new(1.5, 0.0, 0.0));
    (world, a, b)
}

/// The only arbiter of a body.
pub fn only_arbiter(world: &World, body: BodyId) -> &Arbiter {
    let mut all = world.arbiters_of(body);
    let first = all.next().expect("an arbiter");
    assert!(all.next().is_none(), "one arbiter only");
    first
}

/// A list that listeners write to and tests read.
#[derive(Clone)]
pub struct Log<T>(Arc<Mutex<Vec<T>>>);

impl<T> Default for Log<T> {
    fn default() -> Self {
        Self(Arc::default())
    }
}

impl<T: Clone> Log<T> {
    pub fn get(&self) -> MutexGuard<'_, Vec<T>> {
        self.0.lock().unwrap()
    }

    pub fn push(&self, entry: T) {
        self.get().push(entry);
    }

    pub fn all(&self) -> Vec<T> {
        self.get().clone()
    }

    pub fn len(&self) -> usize {
        self.get().len()
    }
}

/// Logs begins and ends: of one body, or of all for `None`.
#[derive(Clone, Default)]
pub struct Watch {
    pub begins: Log<ArbiterId>,
    pub ends: Log<EndEvent>,
}

impl Watch {
    pub fn body(world: &mut World, body: BodyId) -> Self {
        let watch = Self::default();
        let (begins, ends) = (watch.begins.clone(), watch.ends.clone());
        let mut body = world.body_mut(body).unwrap();
        body.on_begin_collide(Box::new(move |_, id| begins.push(id)));
        body.on_end_collide(Box::new(move |_, event| ends.push(*event)));
        watch
    }

    pub fn world(world: &mut World) -> Self {
        let watch = Self::default();
        let (begins, ends) = (watch.begins.clone(), watch.ends.clone());
        world.on_begin_collide(Box::new(move |_, id| begins.push(id)));
        world.on_end_collide(Box::new(move |_, event| ends.push(*event)));
        watch
    }

    /// How often (begin, end) was raised.
    pub fn counts(&self) -> (usize, usize) {
        (self.begins.len(), self.ends.len())
    }
}

/// World points of an arbiter on both bodies, sorted.
pub fn sorted_points(world: &World, arbiter: &Arbiter) -> Vec<(Vec3, Vec3)> {
    let mut points: Vec<_> = world.contact_points(arbiter).map(|(_, p1, p2)| (p1, p2)).collect();
    points.sort_by(|a, b| a.0.to_array().partial_cmp(&b.0.to_array()).unwrap());
    points
}

/// Asserts that two vectors agree within a tolerance.
#[track_caller]
pub fn assert_close(a: Vec3, b: Vec3, tolerance: f32) {
    assert!((a - b).length() <= tolerance, "{a} is not within {tolerance} of {b}");
}
