//! No ghost collisions: what slides over a floor of many shapes feels one floor, and what stands on it still stops.

mod common;

use arbiter3d::math::{Quat, Vec3};
use arbiter3d::*;
use common::floors::*;
use common::*;

fn ice(shape: Shape) -> ShapeDefinition {
    ShapeDefinition::new(shape).friction(0.0).rolling_resistance(0.0)
}

fn drifter(at: Vec3, along: Vec3, rotation: Quat) -> BodyDefinition {
    BodyDefinition { can_sleep: false, ..BodyDefinition::dynamic().at(at).rotated(rotation).moving(along, Vec3::ZERO) }
}

/// Slides all kinds of shapes over floors in 32 directions: no vertical speed of 1 mm/s, no speed lost, no millimetre aside.
fn slide_over(floors: &[Floor]) {
    let sliders = sliders();
    let mut felt = Vec::new();
    for &floor in floors {
        for passage in slide(floor, &sliders) {
            let name = sliders[passage.slider].name;
            let Passage { bump, least, ahead, aside, .. } = passage;
            if !(ahead > 11.0 * 0.9999 && least > 0.9999 && bump < 1e-3 && aside < 1e-3) {
                felt.push(format!("{name} on {floor:?}: {passage:?}"));
            }
        }
    }
    assert!(felt.is_empty(), "{}", felt.join("\n"));
}

#[test]
fn nothing_is_felt_of_the_seams_between_shapes() {
    slide_over(&[Floor::Shapes, Floor::Bodies]);
}

#[test]
fn nothing_is_felt_of_the_seams_between_shapes_of_a_platform_and_of_meshes() {
    slide_over(&[Floor::Platform, Floor::Meshes, Floor::Tiles]);
}

#[test]
fn nothing_is_felt_of_the_seams_within_a_shape() {
    slide_over(&[Floor::Compound, Floor::Voxels, Floor::Mesh, Floor::Field]);
}

#[test]
fn nothing_is_felt_of_shapes_that_overlap() {
    slide_over(&[Floor::Overlapping, Floor::Patchwork]);
}

/// What rolls with friction, balls, capsules and cylinders, keeps its line to a millimetre in 10 m, its heading to a third of a
/// minute of arc a metre, its speed to a ten thousandth, and its height without a bump of 1 mm/s, in 32 directions on all floors.
#[test]
fn what_rolls_keeps_its_line() {
    let rollers = rollers();
    let mut felt = Vec::new();
    for floor in FLOORS {
        for passage in roll(floor, &rollers) {
            let name = rollers[passage.slider].name;
            let Passage { bump, least, ahead, aside, turned, .. } = passage;
            let straight = aside < 1e-3 && turned < 1e-3 && (ahead - 10.2).abs() < 1e-3;
            if !(straight && bump < 1e-3 && least > 0.9999) {
                felt.push(format!("{name} on {floor:?}: {passage:?}"));
            }
        }
    }
    assert!(felt.is_empty(), "{}", felt.join("\n"));
}

/// Where a body of 0.4 m is after it has slid towards x = 0 from the left, with something built there.
fn stopped_by(floor: Floor, build: impl Fn(&mut World), shape: &Shape, speed: f32) -> Vec3 {
    let mut world = world();
    lay(&mut world, floor, &ice);
    build(&mut world);
    let start = Vec3::new(-1.1, 0.2, 0.11);
    let body = add(&mut world, &drifter(start, Vec3::X * speed, Quat::IDENTITY), &ice(shape.clone()));
    run(&mut world, 2.2 / speed);
    position(&world, body)
}

#[test]
fn walls_steps_and_fences_still_stop() {
    for floor in FLOORS {
        for shape in [cube(0.2), sphere(0.2)] {
            let box_at = |half: Vec3, at: Vec3| {
                let wall = ice(Shape::cuboid(half).unwrap()).at(at);
                move |world: &mut World| {
                    world.add_shape(BodyId::WORLD, &wall).unwrap();
                }
            };
            let wall = stopped_by(floor, box_at(Vec3::new(0.5, 1.0, 3.0), Vec3::new(0.5, 1.0, 0.0)), &shape, 3.0);
            assert!(wall.x < -0.19 && wall.y < 0.3, "{floor:?}: through the wall to {wall}");
            let fence = stopped_by(floor, box_at(Vec3::new(0.005, 0.5, 3.0), Vec3::new(0.005, 0.5, 0.0)), &shape, 3.0);
            assert!(fence.x < -0.19 && fence.y < 0.3, "{floor:?}: through the fence to {fence}");
            // A wall that reaches down through the floor.
            let deep = stopped_by(floor, box_at(Vec3::new(0.5, 2.0, 3.0), Vec3::new(0.5, 0.0, 0.0)), &shape, 3.0);
            assert!(deep.x < -0.19 && deep.y < 0.3, "{floor:?}: through the deep wall to {deep}");
        }
        let step = ice(cuboid(0.5, 0.015, 3.0)).at(Vec3::new(0.5, 0.015, 0.0));
        // Faster, it would trip over the step, on any floor.
        let build = |world: &mut World| {
            world.add_shape(BodyId::WORLD, &step).unwrap();
        };
        let on_step = stopped_by(floor, build, &cube(0.2), 0.7);
        assert!(on_step.x < -0.19, "{floor:?}: over a step of 3 cm to {on_step}");
    }
}

/// The floor and a wall of one voxel grid, or one compound: the inner corner holds, also diagonally.
#[test]
fn inner_corners_of_one_shape_hold() {
    let cells = || cells().map(|(x, z)| [x, -1, z]).chain((0..64).map(|i| [2, i / 16, i % 16 - 8]));
    let walls = cells().map(|[x, y, z]| Vec3::new(x as f32 + 0.5, y as f32 + 0.5, z as f32 + 0.5) * CELL);
    let children: Vec<_> = walls.map(|at| CompoundChild::new(cube(0.5 * CELL)).at(at)).collect();
    for ground in [Shape::voxels(CELL, cells()).unwrap(), Shape::compound(&children).unwrap()] {
        for (shape, height) in [(cube(0.2), 0.2), (sphere(0.25), 0.25), (cuboid(0.3, 1.0, 0.2), 1.0)] {
            let mut world = world();
            world.add_shape(BodyId::WORLD, &ice(ground.clone())).unwrap();
            let start = Vec3::new(-1.0, height, 0.3);
            let body = add(&mut world, &drifter(start, Vec3::new(3.0, 0.0, 1.0), Quat::IDENTITY), &ice(shape.clone()));
            run(&mut world, 2.0);
            let (at, v) = (position(&world, body), velocity(&world, body));
            assert!(at.x < 2.0 * CELL - 0.15 && v.x < 0.01, "{} through the wall at {at}", shape.reach());
            // Along the wall it slides on, over its seams.
            assert!((v.z - 1.0).abs() < 0.02, "slides along the wall at {} m/s", v.z);
            assert!((at.y - height).abs() < 0.01, "{at}");
        }
    }
}

/// Two roofs meet in a ridge: a ball comes to rest on neither and rolls down the side it was put on, and one that is thrown
/// over lands on the other side.
#[test]
fn a_ridge_of_two_roofs_holds_from_both_sides() {
    for (side, expected) in [(-0.05_f32, -1.0), (0.05, 1.0)] {
        let mut world = world();
        for lean in [-1.0_f32, 1.0] {
            let rotation = turn(Vec3::Z, -20.0 * lean);
            let middle = rotation * Vec3::new(2.0 * lean, -0.5, 0.0);
            let roof = ice(cuboid(2.0, 0.5, 3.0)).at(middle).rotated(rotation);
            world.add_shape(BodyId::WORLD, &roof).unwrap();
        }
        let body = add(&mut world, &drifter(Vec3::new(side, 0.4, 0.0), Vec3::ZERO, Quat::IDENTITY), &ice(sphere(0.3)));
        for _ in 0..50 {
            world.step(DT).unwrap();
            let at = position(&world, body);
            let over = at - turn(Vec3::Z, -20.0 * at.x.signum()) * Vec3::new(0.0, 0.3, 0.0);
            let roof = -(20.0_f32.to_radians().tan()) * over.x.abs();
            assert!(over.y > roof - 0.02, "fell into the roof at {at}");
        }
        let at = position(&world, body);
        assert!(at.x * expected > 0.5, "rolled to {at}");
    }
}

/// A seam is none any more once the shape behind it is gone: the side face of what is left stops.
#[test]
fn what_was_hidden_comes_back_when_nothing_hides_it() {
    let mut world = world();
    let near = world.add_shape(BodyId::WORLD, &ice(cuboid(1.0, 0.5, 1.0)).at(Vec3::new(-1.0, -0.5, 0.0))).unwrap();
    world.add_shape(BodyId::WORLD, &ice(cuboid(1.0, 0.5, 1.0)).at(Vec3::new(1.0, -0.5, 0.0))).unwrap();
    let low = ice(cuboid(4.0, 0.5, 4.0)).at(Vec3::new(0.0, -0.8, 0.0));
    world.add_shape(BodyId::WORLD, &low).unwrap();
    // Its front is just over the seam.
    let body = add(&mut world, &drifter(Vec3::new(-0.199, 0.2, 0.0), Vec3::ZERO, Quat::IDENTITY), &ice(cube(0.2)));
    run(&mut world, 0.5);
    assert!((position(&world, body).y - 0.2).abs() < 0.005, "{}", position(&world, body));
    world.remove_shape(near).unwrap();
    run(&mut world, 0.5);
    let at = position(&world, body);
    assert!((at.y + 0.1).abs() < 0.01 && at.x < -0.19, "on the low floor before the block: {at}");
    world.body_mut(body).unwrap().apply_impulse(Vec3::X * 100.0).unwrap();
    run(&mut world, 0.5);
    assert!(position(&world, body).x < -0.19, "through the block: {}", position(&world, body));
}
