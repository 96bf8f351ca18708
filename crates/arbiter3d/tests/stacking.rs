//! What stands, stands: towers, pyramids, piles.

mod common;

use arbiter3d::math::Vec3;
use arbiter3d::{BodyDefinition, BodyId, ShapeDefinition, World, WorldSettings};
use common::*;

fn tower(world: &mut World, count: usize) -> Vec<BodyId> {
    (0..count).map(|i| drop_shape(world, &cube(0.5), Vec3::Y * (0.5 + i as f32))).collect()
}

fn pyramid(world: &mut World, rows: usize) -> Vec<BodyId> {
    let mut blocks = Vec::new();
    for row in 0..rows {
        for column in 0..rows - row {
            let x = column as f32 * 1.01 + row as f32 * 0.505;
            blocks.push(drop_shape(world, &cube(0.5), Vec3::new(x, 0.5 + row as f32, 0.0)));
        }
    }
    blocks
}

/// How far the bodies are from where they were: (sideways, down), the largest of each.
fn displacement(world: &World, bodies: &[BodyId], start: &[Vec3]) -> (f32, f32) {
    bodies.iter().zip(start).fold((0.0, 0.0), |(side, down), (&body, &from)| {
        let moved = position(world, body) - from;
        (side.max((moved * Vec3::new(1.0, 0.0, 1.0)).length()), down.max(moved.y.abs()))
    })
}

fn positions(world: &World, bodies: &[BodyId]) -> Vec<Vec3> {
    bodies.iter().map(|&body| position(world, body)).collect()
}

/// Runs the world and returns how far its blocks have gone: (sideways, down), metres.
fn drift(world: &mut World, blocks: &[BodyId], seconds: f32, name: &str) -> (f32, f32) {
    let start = positions(world, blocks);
    run(world, seconds);
    let (side, down) = displacement(world, blocks, &start);
    let deepest = world.deepest_penetration();
    println!("{name}: {:.3} mm sideways, {:.3} mm down; deepest {deepest}", side * 1e3, down * 1e3);
    (side, down)
}

/// A tower of 40 cubes stands for a minute and sleeps.
#[test]
fn a_tower_of_40_cubes_stands_and_sleeps() {
    let mut world = world();
    floor(&mut world, 0.5);
    let blocks = tower(&mut world, 40);
    let (side, down) = drift(&mut world, &blocks, 60.0, "tower");
    assert_eq!(world.awake_count(), 0, "it sleeps");
    assert!(side < 0.1 && down < 0.2, "moved {side} sideways, {down} down");
    assert!(world.deepest_penetration() < 0.01);
}

/// The same tower stands for a minute without the help of sleep.
#[test]
fn a_tower_of_40_cubes_stands_awake() {
    let mut world = sleepless();
    floor(&mut world, 0.5);
    let blocks = tower(&mut world, 40);
    let (side, down) = drift(&mut world, &blocks, 60.0, "awake tower");
    assert_eq!(world.awake_count(), 40);
    assert!(side < 0.1 && down < 0.2, "moved {side} sideways, {down} down");
    assert!(world.deepest_penetration() < 0.01);
}

/// A pyramid of 20 rows stands for a minute and sleeps.
#[test]
fn a_pyramid_of_20_rows_stands_and_sleeps() {
    let mut world = world();
    floor(&mut world, 0.6);
    let blocks = pyramid(&mut world, 20);
    let (side, down) = drift(&mut world, &blocks, 60.0, "pyramid");
    assert_eq!(world.awake_count(), 0, "it sleeps");
    assert!(side < 0.03 && down < 0.1, "moved {side} sideways, {down} down");
    assert!(world.deepest_penetration() < 0.01);
}

/// The same pyramid without sleep.
#[test]
fn a_pyramid_of_20_rows_stands_awake() {
    let mut world = sleepless();
    floor(&mut world, 0.6);
    let blocks = pyramid(&mut world, 20);
    let (side, down) = drift(&mut world, &blocks, 20.0, "awake pyramid");
    assert!(side < 0.03 && down < 0.1, "moved {side} sideways, {down} down");
    assert!(world.deepest_penetration() < 0.01);
}

/// Far from the origin stacks stand as well.
#[test]
fn a_stack_stands_far_from_the_origin() {
    let mut world = sleepless();
    let far = Vec3::new(1000.0, 0.0, 1000.0);
    add(&mut world, &BodyDefinition::fixed().at(far - Vec3::Y), &ShapeDefinition::new(cuboid(20.0, 1.0, 20.0)));
    let blocks: Vec<BodyId> =
        (0..12).map(|i| drop_shape(&mut world, &cube(0.5), far + Vec3::Y * (0.5 + i as f32))).collect();
    let (side, down) = drift(&mut world, &blocks, 10.0, "far stack");
    assert!(side < 0.02 && down < 0.05, "moved {side} sideways, {down} down");
}

/// A bin for piles, 12 m wide.
fn bin(world: &mut World) {
    floor(world, 0.6);
    for (axis, half) in [(Vec3::X, cuboid(1.0, 10.0, 8.0)), (Vec3::Z, cuboid(8.0, 10.0, 1.0))] {
        for side in [-7.0, 7.0] {
            let wall = ShapeDefinition::new(half.clone()).at(axis * side + Vec3::Y * 10.0);
            world.add_shape(BodyId::WORLD, &wall).unwrap();
        }
    }
}

fn rain(world: &mut World, count: usize, random: &mut Random) -> Vec<BodyId> {
    let mut bodies = Vec::new();
    for at in 0..count {
        let place = Vec3::new((at % 10) as f32 - 4.5, (at / 100) as f32 + 0.6, (at / 10 % 10) as f32 - 4.5);
        let body = BodyDefinition::dynamic().at(place * 1.1 + random.vector(0.05)).rotated(random.rotation());
        let shape = ShapeDefinition::new(random.shape()).friction(0.6).rolling_resistance(0.02);
        bodies.push(add(world, &body, &shape));
    }
    bodies
}

/// A pile of 1,000 spheres, capsules, boxes and hulls sleeps within 20 s, and nothing is deeper than two slops.
#[test]
fn a_pile_of_1000_mixed_bodies_sleeps_within_20_seconds() {
    let mut world = World::new(WorldSettings { threads: 2, ..WorldSettings::default() }).unwrap();
    bin(&mut world);
    let bodies = rain(&mut world, 1000, &mut Random(11));
    let mut asleep_at = None;
    for step in 0..1200 {
        world.step(DT).unwrap();
        if world.awake_count() == 0 {
            asleep_at = Some(step as f32 * DT);
            break;
        }
    }
    let deepest = world.deepest_penetration();
    println!("pile: asleep at {asleep_at:?} s, {} awake, deepest {:.2} mm", world.awake_count(), deepest * 1e3);
    for body in bodies {
        let p = position(&world, body);
        // The origin of a wedge lies on its slope, so it may be as low as the floor.
        assert!(p.y > -0.01 && p.x.abs() < 6.02 && p.z.abs() < 6.02, "{body:?} is in the bin: {p}");
    }
    assert!(deepest < 0.01, "nothing is deeper than two slops: {deepest}");
    assert!(asleep_at.is_some(), "asleep within 20 s: {} awake", world.awake_count());
    world.validate().unwrap();
}

/// At rest bodies of every kind overlap by no more than two slops, on the floor and on each other.
#[test]
fn nothing_is_deeper_than_two_slops_at_rest() {
    let mut world = sleepless();
    floor(&mut world, 0.6);
    for (at, shape) in [sphere(0.5), cube(0.5), capsule(0.5, 0.3), icosahedron(0.5), wedge(0.5)].into_iter().enumerate()
    {
        let x = at as f32 * 4.0;
        let settled = ShapeDefinition::new(shape).rolling_resistance(0.05);
        add(&mut world, &BodyDefinition::dynamic().at(Vec3::new(x, 1.0, 0.0)), &settled);
        // A heavy slab on each but the ones that roll.
        if at == 1 || at == 4 {
            let slab = ShapeDefinition::new(cuboid(0.4, 0.4, 0.4)).density(4000.0);
            add(&mut world, &BodyDefinition::dynamic().at(Vec3::new(x, 2.5, 0.0)), &slab);
        }
    }
    run(&mut world, 5.0);
    assert!(world.arbiter_count() >= 6, "{}", world.arbiter_count());
    assert!(world.deepest_penetration() < 0.01, "{}", world.deepest_penetration());
}

/// Overlapping bodies are pushed apart gently: no faster than the push-out speed, and no higher than they need.
#[test]
fn overlapping_bodies_are_pushed_apart_gently() {
    let mut world = sleepless();
    floor(&mut world, 0.5);
    let sunk = drop_shape(&mut world, &cube(0.5), Vec3::Y * 0.2);
    let mut fastest: f32 = 0.0;
    for _ in 0..180 {
        world.step(DT).unwrap();
        fastest = fastest.max(velocity(&world, sunk).y);
    }
    assert!(fastest < 3.0, "{fastest} m/s");
    assert_near(position(&world, sunk).y, 0.5, 0.01, "height");
}

/// A light body carries one that is 100 times heavier.
#[test]
fn a_light_box_carries_a_heavy_one() {
    let mut world = sleepless();
    floor(&mut world, 0.5);
    let light = drop_shape(&mut world, &cube(0.5), Vec3::Y * 0.5);
    let heavy = BodyDefinition::dynamic().at(Vec3::Y * 1.5);
    let heavy = add(&mut world, &heavy, &ShapeDefinition::new(cube(0.5)).density(100_000.0));
    run(&mut world, 10.0);
    println!("heavy on light: {} and {}", position(&world, light).y, position(&world, heavy).y);
    assert_near(position(&world, light).y, 0.5, 0.02, "height of the light one");
    assert_near(position(&world, heavy).y, 1.5, 0.04, "height of the heavy one");
}
