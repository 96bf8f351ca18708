//! No ghost collisions: what slides over a floor of many shapes feels one floor, and what stands on it still stops.

mod common;

use arbiter3d::math::{Quat, Vec3};
use arbiter3d::*;
use common::*;

/// Cells along each side of a floor.
const CELLS: i32 = 32;
/// Length of a cell, metres. Bodies start off the middle, so that they meet seams at all sorts of places.
const CELL: f32 = 0.8;

/// How a floor is put together; its top is at height zero.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Floor {
    /// Boxes as shapes of one static body.
    Shapes,
    /// Boxes, each a static body.
    Bodies,
    /// Boxes on one kinematic body.
    Platform,
    /// A compound of boxes.
    Compound,
    /// Cells.
    Voxels,
    /// Two meshes that meet along a line.
    Meshes,
    /// Two boxes that overlap by half, of the same height.
    Overlapping,
    /// Boxes of random size that overlap.
    Patchwork,
}

const FLOORS: [Floor; 8] = [
    Floor::Shapes,
    Floor::Bodies,
    Floor::Platform,
    Floor::Compound,
    Floor::Voxels,
    Floor::Meshes,
    Floor::Overlapping,
    Floor::Patchwork,
];

fn ice(shape: Shape) -> ShapeDefinition {
    ShapeDefinition::new(shape).friction(0.0).rolling_resistance(0.0)
}

/// Corners of the cells about the origin.
fn cells() -> impl Iterator<Item = (i32, i32)> {
    (0..CELLS * CELLS).map(|at| (at % CELLS - CELLS / 2, at / CELLS - CELLS / 2))
}

fn middle((x, z): (i32, i32)) -> Vec3 {
    Vec3::new((x as f32 + 0.5) * CELL, -0.5 * CELL, (z as f32 + 0.5) * CELL)
}

/// A mesh of the half of the floor on one side of x = 0, two triangles a cell.
fn half_mesh(side: i32) -> Shape {
    let (mut corners, mut triangles) = (Vec::new(), Vec::new());
    for (x, z) in cells().filter(|&(x, _)| (x < 0) == (side < 0)) {
        let first = corners.len() as u32;
        let corner = |i: i32, j: i32| Vec3::new((x + i) as f32 * CELL, 0.0, (z + j) as f32 * CELL);
        corners.extend([corner(0, 0), corner(0, 1), corner(1, 0), corner(1, 1)]);
        triangles.extend([[first, first + 1, first + 2], [first + 2, first + 1, first + 3]]);
    }
    Shape::mesh(corners, triangles).unwrap()
}

fn lay(world: &mut World, floor: Floor, material: &dyn Fn(Shape) -> ShapeDefinition) {
    let half = 0.5 * CELL;
    match floor {
        Floor::Shapes | Floor::Platform => {
            let body = if floor == Floor::Shapes {
                BodyId::WORLD
            } else {
                world.add_body(&BodyDefinition::kinematic()).unwrap()
            };
            for cell in cells() {
                world.add_shape(body, &material(cube(half)).at(middle(cell))).unwrap();
            }
        }
        Floor::Bodies => {
            for cell in cells() {
                add(world, &BodyDefinition::fixed().at(middle(cell)), &material(cube(half)));
            }
        }
        Floor::Compound => {
            let children: Vec<_> = cells().map(|cell| CompoundChild::new(cube(half)).at(middle(cell))).collect();
            world.add_shape(BodyId::WORLD, &material(Shape::compound(&children).unwrap())).unwrap();
        }
        Floor::Voxels => {
            let grid = Shape::voxels(CELL, cells().map(|(x, z)| [x, -1, z])).unwrap();
            world.add_shape(BodyId::WORLD, &material(grid)).unwrap();
        }
        Floor::Meshes => {
            for side in [-1, 1] {
                world.add_shape(BodyId::WORLD, &material(half_mesh(side))).unwrap();
            }
        }
        Floor::Overlapping => {
            for x in [-4.0, 4.0] {
                let place = Vec3::new(x, -0.5, 0.0);
                world.add_shape(BodyId::WORLD, &material(cuboid(8.0, 0.5, 14.0)).at(place)).unwrap();
            }
        }
        Floor::Patchwork => {
            let mut random = Random(7);
            for cell in cells() {
                let size = Vec3::new(random.range(1.0, 1.8), random.range(0.4, 0.9), random.range(1.0, 1.8)) * half;
                let place = Vec3::new(middle(cell).x, -size.y, middle(cell).z);
                let shape = Shape::cuboid(size).unwrap();
                world.add_shape(BodyId::WORLD, &material(shape).at(place)).unwrap();
            }
        }
    }
}

fn drifter(at: Vec3, along: Vec3, rotation: Quat) -> BodyDefinition {
    BodyDefinition { can_sleep: false, ..BodyDefinition::dynamic().at(at).rotated(rotation).moving(along, Vec3::ZERO) }
}

/// Slides bodies of a shape in some directions without friction, each in a world of its own, and tells what they felt.
fn slide(floor: Floor, name: &str, shape: &Shape, (height, lying): (f32, Quat), directions: usize) -> Vec<String> {
    let speed = 4.0;
    let mut felt = Vec::new();
    for direction in 0..directions {
        let mut world = world();
        lay(&mut world, floor, &ice);
        let angle = 360.0 * (direction as f32 + 0.13) / directions as f32;
        let along = heading(angle);
        let start = Vec3::new(0.07, height, 0.11) - along * 5.0;
        // Turned at random about the vertical, so that corners, edges and faces lead.
        let about = turn(Vec3::Y, 37.0 * direction as f32) * lying;
        let body = add(&mut world, &drifter(start, along * speed, about), &ice(shape.clone()));
        run(&mut world, 0.25);
        let (mut fastest, mut least) = (0.0_f32, speed);
        for _ in 0..150 {
            world.step(DT).unwrap();
            let v = velocity(&world, body);
            fastest = fastest.max(v.y.abs());
            least = least.min(v.dot(along));
        }
        let moved = position(&world, body) - start;
        let sideways = (moved - along * moved.dot(along)) * Vec3::new(1.0, 0.0, 1.0);
        let good = moved.dot(along) > 10.0 * 0.999 && least > 0.999 * speed;
        if !(good && fastest < 1e-3 && sideways.length() < 2e-3) {
            felt.push(format!(
                "{name} on {floor:?} towards {angle}°: {} m, at least {least} m/s, {} m sideways, up or down at {fastest} m/s",
                moved.dot(along),
                sideways.length()
            ));
        }
    }
    felt
}

fn directions() -> usize {
    if std::env::var_os("ARBITER3D_LONG").is_some() { 32 } else { 6 }
}

fn slide_over(floors: &[Floor], count: usize) {
    let flat = Quat::IDENTITY;
    let side = turn(Vec3::Z, 90.0);
    let hull = Shape::hull(
        &[-0.3, 0.3].map(|x| [-0.2, 0.2].map(|y| [-0.4, 0.4].map(|z| Vec3::new(x, y, z)))).concat().concat(),
    );
    let bodies = [
        ("a box", cuboid(0.3, 0.2, 0.5), (0.2, flat)),
        ("a ball", sphere(0.3), (0.3, flat)),
        ("a lying capsule", capsule(0.4, 0.2), (0.2, side)),
        ("a hull", hull.unwrap(), (0.2, flat)),
        ("a standing cylinder", Shape::cylinder(0.3, 0.25).unwrap(), (0.3, flat)),
    ];
    let mut felt = Vec::new();
    for &floor in floors {
        // Meshes know no contacts with cylinders.
        let known =
            bodies.iter().filter(|(_, shape, _)| floor != Floor::Meshes || !matches!(shape, Shape::Cylinder(_)));
        for (name, shape, lies) in known {
            felt.extend(slide(floor, name, shape, *lies, count));
        }
    }
    assert!(felt.is_empty(), "{}", felt.join("\n"));
}

#[test]
fn nothing_is_felt_of_the_seams_between_shapes() {
    slide_over(&FLOORS[..3], directions());
}

#[test]
fn nothing_is_felt_of_the_seams_within_a_shape() {
    slide_over(&FLOORS[3..6], directions());
}

#[test]
fn nothing_is_felt_of_shapes_that_overlap() {
    slide_over(&FLOORS[6..], directions());
}

/// All directions of all floors: a minute.
#[test]
#[ignore = "long: 32 directions"]
fn nothing_is_felt_in_any_of_32_directions() {
    slide_over(&FLOORS, 32);
}

/// Balls that roll with friction keep their line and their speed.
#[test]
fn rolling_balls_keep_their_line() {
    for floor in FLOORS {
        for direction in 0..directions() {
            let mut world = world();
            let grip = |shape: Shape| ShapeDefinition::new(shape).friction(0.8).rolling_resistance(0.0);
            lay(&mut world, floor, &grip);
            let along = heading(360.0 * (direction as f32 + 0.13) / directions() as f32);
            let start = Vec3::new(0.03, 0.3, 0.05) - along * 5.0;
            let rolling = BodyDefinition {
                can_sleep: false,
                ..BodyDefinition::dynamic().at(start).moving(along * 3.0, Vec3::Y.cross(along) * 10.0)
            };
            let body = add(&mut world, &rolling, &grip(sphere(0.3)));
            run(&mut world, 3.4);
            let moved = position(&world, body) - start;
            let sideways = moved.dot(Vec3::Y.cross(along));
            assert!((moved.dot(along) - 10.2).abs() < 0.02, "{floor:?}: {} m", moved.dot(along));
            assert!(sideways.abs() < 1e-3, "{floor:?} {direction}: {sideways} m off its line");
        }
    }
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
