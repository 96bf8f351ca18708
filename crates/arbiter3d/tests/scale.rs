//! A world of millimetres and one of kilometres behave as one of metres: sizes, gravity and `length_unit` scaled alike.

mod common;

use arbiter3d::math::{Mat3, Vec3};
use arbiter3d::{BodyDefinition, BodyId, CompoundChild, Shape, ShapeDefinition, World, WorldSettings};
use common::*;

const UNITS: [f32; 3] = [1.0, 1e-3, 1e3];

fn scaled_world(unit: f32) -> World {
    let settings = WorldSettings { gravity: Vec3::Y * (-9.81 * unit), length_unit: unit, ..WorldSettings::default() };
    let mut world = World::new(settings).unwrap();
    let ground = Shape::cuboid(Vec3::new(50.0, 1.0, 50.0) * unit).unwrap();
    let ground = ShapeDefinition::new(ground).at(-Vec3::Y * unit);
    world.add_shape(BodyId::WORLD, &ground).unwrap();
    world
}

fn shape(at: usize, unit: f32) -> Shape {
    let [a, b, c] = [0.3 * unit, 0.2 * unit, 0.25 * unit];
    match at % 9 {
        0 => Shape::cylinder(a, c),
        1 => Shape::cone(a, c),
        2 => Shape::tapered_capsule(c, 0.12 * unit, b),
        3 => Shape::ellipsoid(Vec3::new(a, b, c)),
        4 => Shape::rounded(&Shape::cuboid(Vec3::new(a, b, c)).unwrap(), 0.05 * unit),
        5 => Shape::sphere(c),
        6 => Shape::capsule(c, b),
        7 => Shape::cuboid(Vec3::new(a, b, c)),
        _ => Shape::hull(&[Vec3::X * a, Vec3::Y * a, Vec3::Z * a, Vec3::new(-b, -b, -c), Vec3::new(a, a, c)]),
    }
    .unwrap()
}

/// One of each kind, dropped and thrown, far from the others.
fn throw_all(unit: f32) -> (World, Vec<BodyId>) {
    let (mut world, mut random) = (scaled_world(unit), Random(21));
    let mut bodies = Vec::new();
    for at in 0..27 {
        let place = Vec3::new((at % 6) as f32 * 5.0 - 12.0, 0.5, (at / 6) as f32 * 5.0 - 10.0) * unit;
        let body = BodyDefinition::dynamic().at(place).rotated(random.rotation());
        let body = body.moving(Vec3::new(1.0, 0.0, 0.3) * unit, random.vector(1.0));
        bodies.push(add(&mut world, &body, &ShapeDefinition::new(shape(at, unit)).rolling_resistance(0.05)));
    }
    (world, bodies)
}

/// For a second all move alike; what has come to rest lies equally high.
#[test]
fn thrown_shapes_move_alike_at_every_scale() {
    let runs = UNITS.map(|unit| {
        let (mut world, bodies) = throw_all(unit);
        run(&mut world, 1.0);
        let early: Vec<Vec3> = bodies.iter().map(|&body| position(&world, body) / unit).collect();
        run(&mut world, 14.0);
        let deepest = world.deepest_penetration() / unit;
        let low = |body: BodyId| world.shape(world.body(body).unwrap().shapes()[0]).unwrap().aabb().min.y / unit;
        let lowest: Vec<f32> = bodies.iter().map(|&body| low(body)).collect();
        (early, lowest, deepest, world.awake_count())
    });
    let (early, ..) = &runs[0];
    for ((other, lowest, deepest, awake), unit) in runs.iter().zip(UNITS) {
        let apart = early.iter().zip(other).map(|(a, b)| (*a - *b).length());
        let far: Vec<(usize, f32)> = apart.enumerate().filter(|(_, d)| *d > 0.003).collect();
        println!("unit {unit}: apart {far:?}, deepest {deepest}, {awake} awake");
        assert!(far.is_empty(), "unit {unit}: {far:?}");
        assert_eq!(*awake, 0, "unit {unit}");
        assert!(*deepest < 0.006, "unit {unit}: {deepest}");
        for (at, low) in lowest.iter().enumerate() {
            assert!(low.abs() < 0.006 && (low - runs[0].1[at]).abs() < 1e-3, "unit {unit}: {at} rests at {low}");
        }
    }
}

/// A pile of all kinds is as high and as wide at every scale.
#[test]
fn piles_are_alike_at_every_scale() {
    let measures = UNITS.map(|unit| {
        let (mut world, mut random) = (scaled_world(unit), Random(22));
        let mut bodies = Vec::new();
        for at in 0..90 {
            let place = Vec3::new((at % 3) as f32 * 0.7, 0.5 + (at / 9) as f32 * 0.8, (at / 3 % 3) as f32 * 0.7);
            let body = BodyDefinition::dynamic().at(place * unit).rotated(random.rotation());
            bodies.push(add(&mut world, &body, &ShapeDefinition::new(shape(at, unit)).rolling_resistance(0.1)));
        }
        run(&mut world, 8.0);
        let mean = |of: &dyn Fn(Vec3) -> f32| {
            bodies.iter().map(|&body| of(position(&world, body) / unit)).sum::<f32>() / bodies.len() as f32
        };
        let middle = Vec3::new(0.7, 0.0, 0.7);
        let wide = mean(&|p| Vec3::new(p.x - middle.x, 0.0, p.z - middle.z).length());
        (mean(&|p| p.y), wide, world.deepest_penetration() / unit)
    });
    println!("{measures:?}");
    let (height, wide, _) = measures[0];
    for (other, other_wide, deepest) in measures {
        assert_relative(other, height, 0.15, "mean height");
        assert_relative(other_wide, wide, 0.2, "mean distance from the middle");
        assert!(deepest < 0.03, "{deepest}");
    }
}

/// The same bits, but for numbers so small that their impulses are none in a millimetre's world: of a ball that rolls on a level
/// floor the spin that is left over from rounding, 10⁻²³ rad/s.
#[track_caller]
fn assert_same<const N: usize>(a: [Vec3; N], b: [Vec3; N], what: &str) {
    for (a, b) in a.iter().zip(&b) {
        let none = |axis: usize| a[axis].abs() < 1e-20 && b[axis].abs() < 1e-20;
        assert!((0..3).all(|axis| a[axis] == b[axis] || none(axis)), "{what}: {a:?} and {b:?}");
    }
}

/// A millimetre and a kilometre in powers of two: every length is scaled without rounding, so stacks that fall over come out the
/// same but for the exponent, to the last bit.
#[test]
fn worlds_scaled_by_powers_of_two_are_the_same_bits() {
    let fall = |kind: usize, unit: f32| {
        let (mut world, mut random) = (scaled_world(unit), Random(23));
        let bodies: Vec<BodyId> = (0..6)
            .map(|at| {
                let place = Vec3::new(0.1 * at as f32, 0.5 + 0.8 * at as f32, 0.0) * unit;
                let body = BodyDefinition::dynamic().at(place).rotated(random.rotation());
                add(&mut world, &body, &ShapeDefinition::new(shape(kind, unit)).rolling_resistance(0.1))
            })
            .collect();
        let mut path = Vec::new();
        for _ in 0..240 {
            world.step(DT).unwrap();
            path.extend(bodies.iter().map(|&body| (position(&world, body) / unit, spin(&world, body))));
        }
        path
    };
    for kind in 0..9 {
        let metres = fall(kind, 1.0);
        for unit in [1.0 / 1024.0, 1024.0] {
            for (at, (a, b)) in metres.iter().zip(&fall(kind, unit)).enumerate() {
                assert_same(
                    [a.0, a.1],
                    [b.0, b.1],
                    &format!("unit {unit}, kind {kind}, body {} in step {}", at % 6, at / 6),
                );
            }
        }
    }
}

/// What is made of other shapes, or given by points.
fn made_shape(at: usize, unit: f32) -> Shape {
    let (a, b) = (0.3 * unit, 0.2 * unit);
    let mut random = Random(24);
    let mut points = || (0..20).map(|_| random.vector(0.3) * unit).collect::<Vec<_>>();
    let hull = Shape::hull(&points()).unwrap();
    match at % 7 {
        0 => return hull,
        1 => Shape::point_cloud(&points()),
        2 => Shape::rounded(&hull, 0.05 * unit),
        3 => Shape::voxels(b, [[0, 0, 0], [1, 0, 0], [1, 1, 0]]),
        4 => {
            let sheared = Mat3::from_cols(Vec3::X, Vec3::new(0.4, 0.9, -0.2), Vec3::Z * 0.7);
            Shape::cylinder(a, b).unwrap().transformed(sheared, Vec3::ZERO)
        }
        5 => {
            let (vertices, triangles) = hull.triangulate(1);
            Shape::mesh(vertices, triangles)
        }
        _ => {
            let [ball, cube] = [Shape::sphere(b), Shape::cuboid(Vec3::splat(b))].map(Result::unwrap);
            Shape::compound(&[CompoundChild::new(ball).at(Vec3::X * a), CompoundChild::new(cube).at(-Vec3::X * b)])
        }
    }
    .unwrap()
}

/// Heaps of one kind and of all kinds mixed, some of them thrown together so that they overlap, are the same bits for a second at
/// a millimetre, a metre and a kilometre. The friction of a millimetre's ball is an impulse of 10⁻¹⁶ N s and less: its
/// square does not fit single precision.
#[test]
fn mixed_heaps_scaled_by_powers_of_two_are_the_same_bits() {
    let shape = |kind: usize, unit: f32| if kind < 9 { shape(kind, unit) } else { made_shape(kind, unit) };
    let heap = |kinds: &[usize], unit: f32, spacing: f32| {
        let (mut world, mut random) = (scaled_world(unit), Random(25));
        let bodies: Vec<BodyId> = (0..48)
            .map(|at| {
                let cell = Vec3::new((at % 3) as f32, 0.5 + (at / 9) as f32, (at / 3 % 3) as f32);
                let place = (cell * spacing + random.vector(0.02)) * unit;
                let body = BodyDefinition::dynamic().at(place).rotated(random.rotation());
                let shape = shape(kinds[at % kinds.len()], unit);
                add(&mut world, &body, &ShapeDefinition::new(shape).rolling_resistance(0.1))
            })
            .collect();
        let mut path = Vec::new();
        for _ in 0..60 {
            world.step(DT).unwrap();
            let motion = |&body| [position(&world, body) / unit, velocity(&world, body) / unit, spin(&world, body)];
            path.extend(bodies.iter().map(motion));
        }
        path
    };
    let all: Vec<usize> = (0..16).collect();
    for kinds in all.chunks(1).chain([&[5, 6, 7, 8][..], &all]) {
        for spacing in [0.45, 0.6, 0.8] {
            let metres = heap(kinds, 1.0, spacing);
            for unit in [1.0 / 1024.0, 1024.0] {
                for (at, (a, b)) in metres.iter().zip(&heap(kinds, unit, spacing)).enumerate() {
                    let (body, step) = (at % 48, at / 48);
                    assert_same(
                        *a,
                        *b,
                        &format!("unit {unit}, kinds {kinds:?}, spacing {spacing}, body {body} in step {step}"),
                    );
                }
            }
        }
    }
}
