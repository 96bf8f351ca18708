//! An obstacle course, and a character that takes it by a script.

use crate::builder::{Builder, plain};
use crate::meshes::MeshData;
use crate::turns::{about, sin_cos};
use crate::{BuiltScene, SceneOptions};
use arbiter3d::{
    BodyDefinition, BodyId, CharacterController, CharacterSettings, Error, Shape, ShapeDefinition, World,
    math::{Real, Vec3},
};
use std::f32::consts::{FRAC_PI_4, PI, TAU};

/// Walking speed, m/s.
const SPEED: Real = 3.0;
/// Height of the upper deck, metres.
const DECK: Real = 3.0;

/// What the script asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Order {
    /// Walk to (x, z).
    Go(Real, Real),
    /// Walk in a direction (x, z) for so many seconds, whatever is there.
    Push(Real, Real, Real),
    /// Stand on the lift until it is up.
    Ride,
    /// Stand still for so many seconds.
    Wait(Real),
}

/// The way through the course. What each place is, see [`build`].
const SCRIPT: [Order; 29] = [
    Order::Wait(0.3),
    Order::Go(12.0, 0.0),
    Order::Go(16.0, 0.0),
    Order::Wait(0.5),
    Order::Go(20.0, 0.0),
    Order::Push(1.0, 0.5, 1.0),
    Order::Go(20.5, -2.0),
    Order::Go(24.5, -2.0),
    Order::Go(25.5, 0.0),
    Order::Push(1.0, 0.0, 1.0),
    Order::Go(25.0, 2.3),
    Order::Go(28.5, 2.3),
    Order::Go(33.0, 0.0),
    Order::Go(36.0, 0.0),
    Order::Ride,
    Order::Go(40.0, 0.0),
    Order::Go(45.05, 1.5),
    Order::Wait(2.0),
    Order::Go(49.5, 0.0),
    Order::Go(52.5, 0.0),
    Order::Push(1.0, 0.5, 1.0),
    Order::Go(53.0, -2.0),
    Order::Go(56.5, -2.0),
    Order::Go(64.5, 1.3),
    Order::Go(65.0, 0.0),
    Order::Go(70.0, 0.0),
    Order::Go(69.0, -2.5),
    Order::Push(1.0, 0.45, 3.0),
    Order::Go(66.0, -2.5),
];

/// A character goes through stairs, slopes, gaps, a lift, a disc, a ceiling, a mesh, a crate and a wedge.
pub(crate) fn character_course(options: &SceneOptions, size: usize) -> Result<BuiltScene, Error> {
    let mut scene = Builder::new(options, size)?;
    let dt = 1.0 / scene.hz;
    let mut run = Run::new(&mut scene)?;
    scene.finish_with(2700, Box::new(move |_, world| run.step(world, dt)))
}

/// Adds a static box by its corners.
fn block(scene: &mut Builder, low: [Real; 3], high: [Real; 3]) -> Result<(), Error> {
    let (low, high) = (Vec3::from_array(low), Vec3::from_array(high));
    let shape = plain(Shape::cuboid((high - low) * 0.5)?);
    scene.add(&BodyDefinition::fixed().at((low + high) * 0.5), &shape).map(|_| ())
}

/// Adds a ramp along x: its face starts at `x` on the floor and rises by `angle` for `length` metres.
fn ramp(scene: &mut Builder, x: Real, angle: Real, length: Real, z: [Real; 2]) -> Result<(), Error> {
    let (s, c) = sin_cos(angle);
    let shape = plain(Shape::cuboid(Vec3::new(0.5 * length, 0.25, 0.5 * (z[1] - z[0])))?);
    let middle = Vec3::new(x + 0.5 * length * c + 0.25 * s, 0.5 * length * s - 0.25 * c, 0.5 * (z[0] + z[1]));
    scene.add(&BodyDefinition::fixed().at(middle).rotated(about(Vec3::Z, angle)), &shape).map(|_| ())
}

/// Builds the obstacles; returns the lift.
fn build(scene: &mut Builder) -> Result<BodyId, Error> {
    // The floor: boxes with a crevice of 0.3 m at x = 31, and triangles from 57 to 64.
    for (from, to) in [(-5.0, 30.85), (31.15, 57.0), (64.0, 90.0)] {
        block(scene, [from, -1.0, -4.0], [to, 0.0, 4.0])?;
    }
    scene.mesh(triangles(57.0, 64.0))?;
    // Eight stairs up and down, a landing of 2 m between them.
    for step in 0..8 {
        let (height, at) = (0.25 * (step + 1) as Real, 0.3 * step as Real);
        block(scene, [4.0 + at, 0.0, -4.0], [4.3 + at, height, 4.0])?;
        block(scene, [10.5 - at, 0.0, -4.0], [10.8 - at, height, 4.0])?;
    }
    block(scene, [6.4, 0.0, -4.0], [8.4, 2.0, 4.0])?;
    // 45° up, a plateau of 2 m, 45° down.
    let half = 8.0_f32.sqrt();
    ramp(scene, 13.0, FRAC_PI_4, half, [-4.0, 4.0])?;
    block(scene, [15.0, 1.0, -4.0], [17.0, 2.0, 4.0])?;
    let down = plain(Shape::cuboid(Vec3::new(0.5 * half, 0.25, 4.0))?);
    let (s, c) = sin_cos(FRAC_PI_4);
    let middle = Vec3::new(18.0 - 0.25 * s, 1.0 - 0.25 * c, 0.0);
    scene.add(&BodyDefinition::fixed().at(middle).rotated(about(Vec3::Z, -FRAC_PI_4)), &down)?;
    // 60°, beside a free way; then a gap of 0.6 m between free ways.
    ramp(scene, 21.0, PI / 3.0, 3.0, [-0.5, 4.0])?;
    block(scene, [27.0, 0.0, 0.3], [28.0, 2.0, 1.5])?;
    block(scene, [27.0, 0.0, -4.0], [28.0, 2.0, -0.3])?;
    // The lift, a deck, a disc that turns, a deck; 3 m down again.
    let lift = plain(Shape::cuboid(Vec3::new(1.5, 0.1, 1.5))?);
    let lift = scene.add(&BodyDefinition::kinematic().at(Vec3::new(36.0, -0.05, 0.0)), &lift)?;
    block(scene, [37.6, DECK - 0.3, -3.0], [42.0, DECK, 3.0])?;
    let rim = (0..64).map(|index| {
        let (s, c) = sin_cos(TAU * (index / 2) as Real / 32.0);
        Vec3::new(3.0 * c, [0.15, -0.15][index % 2], 3.0 * s)
    });
    let disc = plain(Shape::hull(&rim.collect::<Vec<_>>())?);
    let turning = BodyDefinition::kinematic().moving(Vec3::ZERO, Vec3::new(0.0, 0.5, 0.0));
    scene.add(&turning.at(Vec3::new(45.05, DECK - 0.15, 0.0)), &disc)?;
    block(scene, [48.1, DECK - 0.3, -3.0], [51.0, DECK, 3.0])?;
    // A ceiling at 1.5 m beside a free way.
    block(scene, [54.0, 1.5, -0.5], [56.0, 2.0, 4.0])?;
    // A crate, and two walls that close at 30°.
    let crate_shape = plain(Shape::cuboid(Vec3::splat(0.5))?).density(40.0);
    scene.drop(Vec3::new(67.0, 0.5, 0.0), &crate_shape)?;
    let (s, c) = sin_cos(PI / 12.0);
    for side in [1.0, -1.0] {
        let wall = plain(Shape::cuboid(Vec3::new(3.0, 1.0, 0.2))?);
        // The inner faces meet at x = 78.
        let middle = Vec3::new(78.0 - 3.0 * c + 0.2 * s, 1.0, side * (3.0 * s + 0.2 * c));
        scene.add(&BodyDefinition::fixed().at(middle).rotated(about(Vec3::Y, side * PI / 12.0)), &wall)?;
    }
    Ok(lift)
}

/// A level floor of triangles at y = 0.
fn triangles(from: Real, to: Real) -> MeshData {
    let count = 14_u32;
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for i in 0..=count {
        for j in 0..=count {
            let x = from + (to - from) * i as Real / count as Real;
            vertices.push(Vec3::new(x, 0.0, 8.0 * j as Real / count as Real - 4.0));
        }
    }
    for i in 0..count {
        for j in 0..count {
            let (a, b) = (i * (count + 1) + j, (i + 1) * (count + 1) + j);
            triangles.extend([[a, a + 1, b], [b, a + 1, b + 1]]);
        }
    }
    (vertices, triangles)
}

/// The character on its way.
struct Run {
    hero: CharacterController,
    /// What is drawn of it.
    figure: BodyId,
    lift: BodyId,
    /// Which order is being carried out, and for how long.
    order: usize,
    time: Real,
}

impl Run {
    fn new(scene: &mut Builder) -> Result<Self, Error> {
        let lift = build(scene)?;
        let hero = CharacterController::new(Vec3::new(0.0, 0.0, 0.0), CharacterSettings::default())?;
        let capsule = ShapeDefinition::new(Shape::capsule(0.55, 0.35)?).sensor();
        let figure = scene.add(&BodyDefinition::kinematic().at(hero.center()), &capsule)?;
        Ok(Self { hero, figure, lift, order: 0, time: 0.0 })
    }

    fn step(&mut self, world: &mut World, dt: Real) -> Result<(), Error> {
        let wanted = self.decide(world)?;
        self.time += dt;
        self.hero.update(world, wanted, dt)?;
        if let Some(mut figure) = world.body_mut(self.figure) {
            figure.set_position(self.hero.center())?;
        }
        Ok(())
    }

    /// The velocity that the present order asks for; goes on to the next one where it is done.
    fn decide(&mut self, world: &mut World) -> Result<Vec3, Error> {
        let at = self.hero.position();
        let Some(&order) = SCRIPT.get(self.order) else { return Ok(Vec3::ZERO) };
        let (wanted, done) = match order {
            Order::Go(x, z) => {
                let way = Vec3::new(x - at.x, 0.0, z - at.z);
                let length = way.length();
                (way * (SPEED / length.max(1e-3)), length < 0.1)
            }
            Order::Push(x, z, seconds) => (Vec3::new(x, 0.0, z).normalize_or_zero() * SPEED, self.time > seconds),
            Order::Wait(seconds) => (Vec3::ZERO, self.time > seconds),
            Order::Ride => (Vec3::ZERO, self.ride(world)?),
        };
        if done {
            (self.order, self.time) = (self.order + 1, 0.0);
        }
        Ok(wanted)
    }

    /// Moves the lift up at 1 m/s until it is there.
    fn ride(&self, world: &mut World) -> Result<bool, Error> {
        let Some(mut lift) = world.body_mut(self.lift) else { return Ok(true) };
        let done = lift.read().position().y >= DECK - 0.1;
        lift.set_linear_velocity(if done { Vec3::ZERO } else { Vec3::Y })?;
        Ok(done)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use arbiter3d::math::Pose;

    struct Course {
        world: World,
        run: Run,
    }

    fn course(threads: usize) -> Course {
        let options = SceneOptions { threads, ..SceneOptions::default() };
        let mut scene = Builder::new(&options, 1).unwrap();
        let run = Run::new(&mut scene).unwrap();
        Course { world: scene.world, run }
    }

    const DT: Real = 1.0 / 60.0;

    impl Course {
        fn step(&mut self) {
            self.run.step(&mut self.world, DT).unwrap();
            self.world.step(DT).unwrap();
        }

        fn deepest(&self) -> Real {
            let capsule = Shape::capsule(0.55, 0.35).unwrap();
            let pose = Pose::from_position(self.run.hero.center());
            let found = self.world.collide_shape(&capsule, &pose, 0.0, &self.run.hero.settings().filter).unwrap();
            let points = found.iter().flat_map(|contacts| contacts.manifold.points().iter());
            points.fold(0.0, |deepest: Real, point| deepest.max(-point.separation))
        }
    }

    /// Where each order ends: its number, and the height and the latest time (s) at which it does.
    const CHECKS: [(usize, Real, Real); 8] = [
        (1, 0.0, 5.5),   // stairs up and down
        (2, 2.0, 7.5),   // on the plateau
        (4, 0.0, 10.0),  // down the slope
        (12, 0.0, 19.0), // past the steep slope, the gap and the crevice
        (14, DECK, 24.0),
        (18, DECK, 32.0), // over the disc
        (25, 0.0, 46.0),  // under the ceiling not; over the triangles; behind the crate
        (28, 0.0, 54.0),  // out of the wedge
    ];

    /// The whole way: every check point in its time, no overlap deeper than the skin, no stop where the way is free, no
    /// climbing where there is nothing to climb.
    #[test]
    fn the_course_is_run() {
        let mut course = course(1);
        let (mut slow, mut next) = (0, 0);
        for step in 0..3300 {
            let (order, before) = (course.run.order, course.run.hero.position());
            course.step();
            let (at, seconds) = (course.run.hero.position(), DT * step as Real);
            let moved = at - before;
            assert!(course.deepest() < 0.02, "{at}: {} m deep", course.deepest());
            assert!(!course.run.hero.is_crushed(), "crushed at {at}");
            // On level floor nothing moves up or down.
            let level = (0.5..3.0).contains(&at.x) || (58.0..63.0).contains(&at.x);
            assert!(!level || moved.y.abs() < 1e-3 * DT, "{at}: {} m/s up", moved.y / DT);
            // Where an order goes on for a while, it makes way.
            if let Some(Order::Go(x, z)) = SCRIPT.get(order).filter(|_| course.run.order == order) {
                let way = Vec3::new(x - before.x, 0.0, z - before.z).normalize_or_zero();
                let progress = Vec3::new(moved.x, 0.0, moved.z).dot(way) / DT;
                slow = if progress < 0.4 * SPEED && course.run.time > 0.2 { slow + 1 } else { 0 };
                assert!(slow < 12, "order {order} stalls at {at}: {progress} m/s");
            }
            if course.run.order != order && CHECKS.get(next).is_some_and(|check| check.0 == order) {
                let (_, height, latest) = CHECKS[next];
                assert!((at.y - height).abs() < 0.02, "order {order} ends at {at}, not at height {height}");
                assert!(seconds < latest, "order {order} ends after {seconds} s");
                next += 1;
            }
            if SCRIPT.get(order) == Some(&Order::Push(1.0, 0.5, 1.0)) {
                assert!(at.x > 30.0 || at.y < 0.1, "climbs the steep slope: {at}");
                assert!(at.x < 54.0, "enters what is too low: {at}");
            }
        }
        assert_eq!(next, CHECKS.len(), "order {} at {}", course.run.order, course.run.hero.position());
        // The crate has been pushed from 67 to before 70.
        assert!(course.run.order == SCRIPT.len());
    }

    /// Two runs, and one and two threads, give the same bits.
    #[test]
    fn the_course_has_the_same_bits() {
        let bits = |threads: usize| {
            let mut course = course(threads);
            for _ in 0..2900 {
                course.step();
            }
            (course.run.hero.position().to_array().map(Real::to_bits), course.world.hash())
        };
        let once = bits(1);
        assert_eq!(once, bits(1));
        assert_eq!(once, bits(2));
    }
}
