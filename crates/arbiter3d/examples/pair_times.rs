//! Times the narrow phase on single pairs of convex shapes that are known by their support: cans, cones, ellipsoids,
//! rounded and custom shapes.
//!
//! Each pair is posed 64 times with other turns and shifts, at four distances: at rest (an overlap of some thousandths
//! of the size), apart by half of the margin, apart by more, and deep in each other. What is told is the time of one
//! call of `collide`, the least of several rounds, in nanoseconds. Run with `cargo run --release -p arbiter3d --example
//! pair_times`; words after `--` choose pairs whose name holds one of them, and a number alone says how many rounds (so
//! that `valgrind --tool=callgrind` can count the instructions of few).

use arbiter3d::math::{Pose, Rotation, Vec3};
use arbiter3d::narrow_phase::{Manifold, PairCache, collide};
use arbiter3d::{ConvexShape, Shape, ShapeError};
use std::hint::black_box;
use std::time::Instant;

/// Within which contacts are wanted, metres.
const MARGIN: f32 = 0.02;
/// Poses of each pair at each distance.
const POSES: usize = 64;
/// Gaps of the four columns, metres, for shapes about a metre large.
const GAPS: [(&str, f32); 4] = [("rest", -0.003), ("near", 0.01), ("apart", 0.05), ("deep", -0.2)];

/// The lower half of a ball.
#[derive(Debug)]
struct Bowl;

impl ConvexShape for Bowl {
    fn support(&self, direction: Vec3) -> Vec3 {
        let across = Vec3::new(direction.x, 0.0, direction.z);
        (if direction.y < 0.0 { direction } else { across }).normalize_or_zero() * 0.5
    }

    fn center(&self) -> Vec3 {
        Vec3::new(0.0, -0.1875, 0.0)
    }
}

/// Two shapes, the second above the first.
struct Pair {
    name: &'static str,
    below: Shape,
    above: Shape,
    /// How each is turned before the pose is varied.
    turns: [Rotation; 2],
}

/// Numbers that look random and are the same in each run.
struct Random(u64);

impl Random {
    /// Between −1 and 1.
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1 << 23) as f32 - 1.0
    }
}

fn main() -> Result<(), ShapeError> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let rounds = words.iter().find_map(|word| word.parse().ok()).unwrap_or(200);
    let names: Vec<&String> = words.iter().filter(|word| word.parse::<usize>().is_err()).collect();
    let heads = GAPS.map(|(name, _)| format!("{name:>9}")).concat();
    println!("{:28}{heads}   ns a call", "pair");
    for pair in pairs()? {
        if !names.is_empty() && !names.iter().any(|name| pair.name.contains(name.as_str())) {
            continue;
        }
        let times = GAPS.map(|(_, gap)| format!("{:9.0}", time(&pair, &poses(&pair, gap), rounds))).concat();
        println!("{:28}{times}", pair.name);
    }
    Ok(())
}

fn pairs() -> Result<Vec<Pair>, ShapeError> {
    let upright = Rotation::IDENTITY;
    let lying = Rotation::from_xyzw(1.0, 0.0, 0.0, 1.0).normalize();
    let crossed = Rotation::from_xyzw(0.0, 0.0, 1.0, 1.0).normalize();
    let leaning = Rotation::from_xyzw(0.3, 0.0, 0.1, 1.0).normalize();
    let plate = Shape::cuboid(Vec3::new(2.0, 0.5, 2.0))?;
    let can = Shape::cylinder(0.6, 0.4)?;
    let cone = Shape::cone(0.6, 0.4)?;
    let egg = Shape::ellipsoid(Vec3::new(0.4, 0.6, 0.5))?;
    let die = Shape::rounded(&Shape::cuboid(Vec3::splat(0.4))?, 0.05)?;
    let ring = |y: f32| (0..7).map(move |k| [0.4 * COSINES[k], y, 0.4 * COSINES[(k + 5) % 7]]);
    let prism = Shape::hull(&ring(-0.5).chain(ring(0.5)).map(Vec3::from).collect::<Vec<_>>())?;
    let bowl = Shape::custom(Bowl)?;
    let arm = Shape::tapered_capsule(0.5, 0.2, 0.4)?;
    let pair =
        |name, below: &Shape, above: &Shape, turns| Pair { name, below: below.clone(), above: above.clone(), turns };
    Ok(vec![
        pair("can standing on box", &plate, &can, [upright, upright]),
        pair("can lying on box", &plate, &can, [upright, lying]),
        pair("can leaning on box", &plate, &can, [upright, leaning]),
        pair("cans standing", &can, &can, [upright, upright]),
        pair("cans lying, crossed", &can, &can, [lying, crossed]),
        pair("cans lying, parallel", &can, &can, [lying, lying]),
        pair("can lying on standing can", &can, &can, [upright, lying]),
        pair("can leaning on lying can", &can, &can, [lying, leaning]),
        pair("cone on box", &plate, &cone, [upright, upright]),
        pair("cone lying on lying cone", &cone, &cone, [lying, crossed]),
        pair("ellipsoids", &egg, &egg, [leaning, crossed]),
        pair("ellipsoid on box", &plate, &egg, [upright, leaning]),
        pair("ellipsoid on lying can", &can, &egg, [lying, leaning]),
        pair("rounded box on box", &plate, &die, [upright, upright]),
        pair("rounded boxes, edges", &die, &die, [leaning, crossed]),
        pair("custom half ball on box", &plate, &bowl, [upright, leaning]),
        pair("custom half balls", &bowl, &bowl, [crossed, leaning]),
        pair("can standing on hull", &prism, &can, [upright, upright]),
        pair("can lying on lying hull", &prism, &can, [lying, crossed]),
        pair("tapered capsule on box", &plate, &arm, [upright, lying]),
        pair("tapered capsules", &arm, &arm, [lying, crossed]),
        pair("box edge on lying can", &can, &plate, [lying, leaning]),
    ])
}

/// Of sevenths of a turn.
const COSINES: [f32; 7] = [1.0, 0.623_49, -0.222_52, -0.900_97, -0.900_97, -0.222_52, 0.623_49];

/// Poses of the upper shape in the frame of the lower one with about the given gap.
fn poses(pair: &Pair, gap: f32) -> Vec<Pose> {
    let mut random = Random(7);
    let mut pose = || {
        let mut little = |most: f32| most * random.next();
        let (yaw, tilt) = (little(1.5), [little(1e-3), little(1e-3)]);
        let turn = Rotation::from_xyzw(tilt[0], yaw, tilt[1], 1.0).normalize();
        let rotation = turn.mul(pair.turns[1]);
        let aside = Vec3::new(little(0.15), 0.0, little(0.15));
        let below = Pose::new(Vec3::ZERO, pair.turns[0]);
        let placed = |height: f32| below.relative(&Pose::new(aside + Vec3::Y * height, rotation));
        let (mut low, mut high) = (0.0, 4.0);
        for _ in 0..30 {
            let middle = 0.5 * (low + high);
            if separation(pair, &placed(middle)) < gap { low = middle } else { high = middle }
        }
        placed(high)
    };
    (0..POSES).map(|_| pose()).collect()
}

fn separation(pair: &Pair, pose: &Pose) -> f32 {
    let mut manifold = Manifold::EMPTY;
    collide(&pair.below, &pair.above, pose, 10.0, &mut PairCache::default(), &mut manifold);
    manifold.points().iter().map(|point| point.separation).fold(f32::MAX, f32::min)
}

/// Nanoseconds a call.
fn time(pair: &Pair, poses: &[Pose], rounds: usize) -> f64 {
    let mut best = f64::MAX;
    let mut manifold = Manifold::EMPTY;
    let mut caches = vec![PairCache::default(); poses.len()];
    for _ in 0..rounds {
        let start = Instant::now();
        measured(pair, poses, &mut caches, &mut manifold);
        best = best.min(start.elapsed().as_nanos() as f64 / poses.len() as f64);
    }
    best
}

/// What the clock and callgrind look at.
#[inline(never)]
fn measured(pair: &Pair, poses: &[Pose], caches: &mut [PairCache], manifold: &mut Manifold) {
    for (pose, cache) in poses.iter().zip(caches) {
        collide(&pair.below, &pair.above, black_box(pose), MARGIN, cache, manifold);
        black_box(&mut *manifold);
    }
}
