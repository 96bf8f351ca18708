//! Short words for the behaviour tests: worlds, grounds, bodies, random numbers, measurements.
#![allow(dead_code)] // every test file uses its own part

pub mod floors;

use arbiter3d::math::{Quat, Vec3};
use arbiter3d::{BodyDefinition, BodyId, Shape, ShapeDefinition, ShapeId, World, WorldSettings};

/// The usual time step, s.
pub const DT: f32 = 1.0 / 60.0;
/// The default gravity, m/s².
pub const GRAVITY: f32 = 9.81;

pub fn world() -> World {
    World::default()
}

/// A world in which nothing falls asleep.
pub fn sleepless() -> World {
    World::new(WorldSettings { allow_sleep: false, ..WorldSettings::default() }).unwrap()
}

/// A world without gravity and without sleep.
pub fn weightless() -> World {
    let settings = WorldSettings { gravity: Vec3::ZERO, allow_sleep: false, ..WorldSettings::default() };
    World::new(settings).unwrap()
}

pub fn cube(half: f32) -> Shape {
    Shape::cuboid(Vec3::splat(half)).unwrap()
}

pub fn cuboid(x: f32, y: f32, z: f32) -> Shape {
    Shape::cuboid(Vec3::new(x, y, z)).unwrap()
}

pub fn sphere(radius: f32) -> Shape {
    Shape::sphere(radius).unwrap()
}

pub fn capsule(half_length: f32, radius: f32) -> Shape {
    Shape::capsule(half_length, radius).unwrap()
}

/// A twelve-cornered hull: an icosahedron of about this radius.
pub fn icosahedron(radius: f32) -> Shape {
    let (a, b) = (0.525_731_1 * radius, 0.850_650_8 * radius);
    let mut points = Vec::new();
    for (s, t) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
        points.push(Vec3::new(0.0, s * a, t * b));
        points.push(Vec3::new(s * a, t * b, 0.0));
        points.push(Vec3::new(t * b, 0.0, s * a));
    }
    Shape::hull(&points).unwrap()
}

/// A wedge: a hull with a sloping face.
pub fn wedge(half: f32) -> Shape {
    let h = half;
    let low = [Vec3::new(-h, -h, -h), Vec3::new(h, -h, -h), Vec3::new(h, -h, h), Vec3::new(-h, -h, h)];
    Shape::hull(&[&low[..], &[Vec3::new(-h, h, -h), Vec3::new(-h, h, h)]].concat()).unwrap()
}

/// A level floor at height zero, 400 m wide, without rolling resistance of its own.
pub fn floor(world: &mut World, friction: f32) -> ShapeId {
    let ground = ShapeDefinition::new(cuboid(200.0, 1.0, 200.0)).at(Vec3::new(0.0, -1.0, 0.0));
    world.add_shape(BodyId::WORLD, &ground.friction(friction).rolling_resistance(0.0)).unwrap()
}

/// Adds a body with one shape.
pub fn add(world: &mut World, body: &BodyDefinition, shape: &ShapeDefinition) -> BodyId {
    let id = world.add_body(body).unwrap();
    world.add_shape(id, shape).unwrap();
    id
}

/// Adds a dynamic body with one shape of the default material.
pub fn drop_shape(world: &mut World, shape: &Shape, position: Vec3) -> BodyId {
    add(world, &BodyDefinition::dynamic().at(position), &ShapeDefinition::new(shape.clone()))
}

/// Steps for about so many seconds.
pub fn run(world: &mut World, seconds: f32) {
    run_at(world, seconds, DT);
}

pub fn run_at(world: &mut World, seconds: f32, dt: f32) {
    for _ in 0..(seconds / dt).round() as usize {
        world.step(dt).unwrap();
    }
}

pub fn position(world: &World, body: BodyId) -> Vec3 {
    world.body(body).unwrap().position()
}

pub fn velocity(world: &World, body: BodyId) -> Vec3 {
    world.body(body).unwrap().linear_velocity()
}

pub fn spin(world: &World, body: BodyId) -> Vec3 {
    world.body(body).unwrap().angular_velocity()
}

/// A rotation by an angle (degrees) about a unit axis, from portable sines.
pub fn turn(axis: Vec3, degrees: f32) -> Quat {
    let half = f64::from(degrees).to_radians() * 0.5;
    let v = axis * libm::sin(half) as f32;
    Quat::from_xyzw(v.x, v.y, v.z, libm::cos(half) as f32)
}

/// A level direction at an angle (degrees) from x towards z.
pub fn heading(degrees: f32) -> Vec3 {
    let angle = f64::from(degrees).to_radians();
    Vec3::new(libm::cos(angle) as f32, 0.0, libm::sin(angle) as f32)
}

/// Asserts that two numbers differ by no more than a share of the second.
#[track_caller]
pub fn assert_relative(actual: f32, expected: f32, share: f32, what: &str) {
    let error = (f64::from(actual) - f64::from(expected)).abs();
    let allowed = f64::from(share) * f64::from(expected).abs();
    assert!(error <= allowed, "{what}: {actual}, expected {expected} within {share} of it");
}

/// Asserts that two numbers differ by no more than `tolerance`.
#[track_caller]
pub fn assert_near(actual: f32, expected: f32, tolerance: f32, what: &str) {
    assert!((actual - expected).abs() <= tolerance, "{what}: {actual}, expected {expected} ± {tolerance}");
}

/// A small random generator (SplitMix64) with the same numbers everywhere.
#[derive(Clone)]
pub struct Random(pub u64);

impl Random {
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    pub fn range(&mut self, low: f32, high: f32) -> f32 {
        let unit = (self.bits() >> 40) as f32 / 16_777_216.0;
        low + (high - low) * unit
    }

    /// A vector in the cube from −`half` to `half`.
    pub fn vector(&mut self, half: f32) -> Vec3 {
        let x = self.range(-half, half);
        let y = self.range(-half, half);
        Vec3::new(x, y, self.range(-half, half))
    }

    /// A rotation, evenly spread; only sums, products and square roots, so the same bits everywhere.
    pub fn rotation(&mut self) -> Quat {
        loop {
            let (v, w) = (self.vector(1.0), self.range(-1.0, 1.0));
            let squared = v.x * v.x + v.y * v.y + v.z * v.z + w * w;
            if squared > 0.01 && squared <= 1.0 {
                let length = squared.sqrt();
                return Quat::from_xyzw(v.x / length, v.y / length, v.z / length, w / length);
            }
        }
    }

    /// A sphere, capsule, box or hull of up to a metre across.
    pub fn shape(&mut self) -> Shape {
        match self.bits() % 5 {
            0 => sphere(self.range(0.2, 0.5)),
            1 => capsule(self.range(0.1, 0.3), self.range(0.15, 0.25)),
            2 => cuboid(self.range(0.2, 0.5), self.range(0.2, 0.5), self.range(0.2, 0.5)),
            3 => icosahedron(self.range(0.25, 0.5)),
            _ => wedge(self.range(0.2, 0.4)),
        }
    }
}
