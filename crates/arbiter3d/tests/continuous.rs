//! Continuous collision: what is fast does not pass through what is thin.

mod common;

use arbiter3d::math::{Quat, Vec3};
use arbiter3d::{
    BodyDefinition, BodyId, LockedAxes, MeshSides, Shape, ShapeDefinition, TriangleMesh, World, WorldSettings,
};
use common::*;

/// What stands in the way, across z, with its near side at z = 0.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Target {
    /// 1 cm thick.
    Wall,
    OneSidedMesh,
    TwoSidedMesh,
}

fn target(kind: Target) -> ShapeDefinition {
    if kind == Target::Wall {
        return ShapeDefinition::new(cuboid(200.0, 200.0, 0.005)).at(Vec3::new(0.0, 0.0, 0.005));
    }
    // Cells of 5 m, wound so that they are solid towards −z.
    let (cells, size) = (80, 5.0);
    let mut vertices = Vec::new();
    let mut triangles = Vec::new();
    for y in 0..=cells {
        for x in 0..=cells {
            let at = |i: u32| (i as f32 - 0.5 * cells as f32) * size;
            vertices.push(Vec3::new(at(x), at(y), 0.0));
        }
    }
    for y in 0..cells {
        for x in 0..cells {
            let corner = y * (cells + 1) + x;
            triangles.push([corner, corner + cells + 1, corner + 1]);
            triangles.push([corner + 1, corner + cells + 1, corner + cells + 2]);
        }
    }
    let sides = if kind == Target::TwoSidedMesh { MeshSides::Two } else { MeshSides::One };
    let mesh = TriangleMesh::with_sides(vertices, triangles, sides).unwrap();
    ShapeDefinition::new(Shape::Mesh(mesh.into()))
}

/// Shoots a body at the target and returns how far its centre has come across (m), at the worst.
fn shoot(world: &mut World, body: &BodyDefinition, shape: &Shape) -> f32 {
    let bullet = add(world, body, &ShapeDefinition::new(shape.clone()));
    let mut farthest = -Real::MAX;
    for _ in 0..30 {
        world.step(DT).unwrap();
        farthest = farthest.max(position(world, bullet).z);
    }
    world.remove_body(bullet).unwrap();
    farthest
}

type Real = f32;

/// A velocity of this speed towards +z, up to 70° askew.
fn askew(random: &mut Random, speed: f32) -> Vec3 {
    let z = random.range(0.34, 1.0);
    let (side, angle) = ((1.0 - z * z).sqrt(), f64::from(random.range(0.0, 360.0)).to_radians());
    Vec3::new(side * libm::cos(angle) as f32, side * libm::sin(angle) as f32, z) * speed
}

/// Spheres of 2.5 to 5 cm at 200 m/s, at any angle and distance, never cross a wall of 1 cm or a mesh.
#[test]
fn fast_spheres_never_cross() {
    for kind in [Target::Wall, Target::OneSidedMesh, Target::TwoSidedMesh] {
        let mut world = weightless();
        world.add_shape(BodyId::WORLD, &target(kind)).unwrap();
        let mut random = Random(5);
        for shot in 0..100 {
            let radius = random.range(0.025, 0.05);
            let from = Vec3::new(random.range(-3.0, 3.0), random.range(-3.0, 3.0), random.range(-8.0, -0.1));
            let body = BodyDefinition::dynamic().at(from).moving(askew(&mut random, 200.0), random.vector(50.0));
            let farthest = shoot(&mut world, &body, &sphere(radius));
            assert!(farthest < 0.0, "shot {shot} at {kind:?}: radius {radius} from {from} came to z = {farthest}");
        }
    }
}

/// The same straight on, at every phase of the step: the distance varies by a hundredth of a step's way.
#[test]
fn spheres_never_cross_at_any_phase() {
    for kind in [Target::Wall, Target::OneSidedMesh] {
        let mut world = weightless();
        world.add_shape(BodyId::WORLD, &target(kind)).unwrap();
        for phase in 0..100 {
            let z = -1.0 - 200.0 * DT * phase as f32 / 100.0;
            let body = BodyDefinition::dynamic().at(Vec3::new(0.3, 0.7, z)).moving(Vec3::Z * 200.0, Vec3::ZERO);
            let farthest = shoot(&mut world, &body, &sphere(0.025));
            assert!(farthest < 0.0, "phase {phase} at {kind:?}: came to z = {farthest}");
            assert!(farthest > -0.1, "phase {phase} at {kind:?}: it did reach the target, {farthest}");
        }
    }
}

/// Thin rods, boxes, hulls and capsules at 50 to 200 m/s, turning at will, do not cross either.
#[test]
fn fast_bodies_of_all_kinds_never_cross() {
    let shapes = [
        ("rod", capsule(0.4, 0.01)),
        ("stick", cuboid(0.5, 0.01, 0.01)),
        ("box", cuboid(0.1, 0.05, 0.15)),
        ("plate", cuboid(0.3, 0.01, 0.3)),
        ("hull", icosahedron(0.1)),
        ("wedge", wedge(0.05)),
    ];
    for kind in [Target::Wall, Target::OneSidedMesh] {
        let mut world = weightless();
        world.add_shape(BodyId::WORLD, &target(kind)).unwrap();
        let mut random = Random(6);
        for shot in 0..60 {
            let (name, shape) = &shapes[shot % shapes.len()];
            let speed = random.range(50.0, 200.0);
            let from = Vec3::new(random.range(-3.0, 3.0), random.range(-3.0, 3.0), random.range(-8.0, -0.7));
            let body = BodyDefinition::dynamic().at(from).rotated(random.rotation());
            let body = body.moving(askew(&mut random, speed), random.vector(10.0));
            let farthest = shoot(&mut world, &body, shape);
            assert!(farthest < 0.01, "shot {shot}, a {name} at {speed} m/s at {kind:?}: came to z = {farthest}");
        }
    }
}

/// A rod that spins fast but hardly moves does not sweep through a wall beside it.
#[test]
fn a_spinning_rod_does_not_sweep_through() {
    let mut world = weightless();
    world.add_shape(BodyId::WORLD, &target(Target::Wall)).unwrap();
    let rod = BodyDefinition::dynamic().at(Vec3::new(0.0, 0.0, -0.2)).moving(Vec3::ZERO, Vec3::X * 60.0);
    let rod = add(&mut world, &rod, &ShapeDefinition::new(cuboid(0.02, 0.5, 0.02)));
    for _ in 0..60 {
        world.step(DT).unwrap();
        assert!(position(&world, rod).z < 0.0, "{}", position(&world, rod));
    }
}

/// A bullet that is stopped turns its velocity away: it ends beside the wall, not stuck in it.
#[test]
fn a_stopped_bullet_loses_its_approach() {
    let mut world = weightless();
    world.add_shape(BodyId::WORLD, &target(Target::Wall).friction(0.0)).unwrap();
    let shot = BodyDefinition::dynamic().at(Vec3::Z * -2.0).moving(Vec3::new(30.0, 0.0, 150.0), Vec3::ZERO);
    let shot = add(&mut world, &shot, &ShapeDefinition::new(sphere(0.05)).friction(0.0));
    run(&mut world, 0.2);
    let v = velocity(&world, shot);
    assert!(v.z.abs() < 0.1, "no speed towards the wall is left: {v}");
    assert_relative(v.x, 30.0, 1e-3, "the speed along the wall stays");
    assert_near(position(&world, shot).z, -0.05, 0.006, "beside the wall");
}

/// With continuous collision off, a bullet may pass: the feature is what stops it.
#[test]
fn without_it_a_bullet_passes() {
    let mut world = weightless();
    world.add_shape(BodyId::WORLD, &target(Target::Wall)).unwrap();
    let shot = BodyDefinition { continuous: false, ..BodyDefinition::dynamic().at(Vec3::Z * -2.0) };
    let farthest = shoot(&mut world, &shot.moving(Vec3::Z * 200.0, Vec3::ZERO), &sphere(0.025));
    assert!(farthest > 10.0, "{farthest}");
}

/// A bullet meets a moving body too, as long as a step's way is not longer than both are thick.
#[test]
fn speculative_contacts_stop_moving_bodies() {
    let mut world = weightless();
    let block = drop_shape(&mut world, &cube(0.5), Vec3::ZERO);
    let ball = BodyDefinition::dynamic().at(Vec3::Z * -3.0).moving(Vec3::Z * 40.0, Vec3::ZERO);
    let ball = add(&mut world, &ball, &ShapeDefinition::new(sphere(0.3)));
    run(&mut world, 0.5);
    assert!(position(&world, ball).z < position(&world, block).z, "it did not pass");
    let (m1, m2) = (world.body(ball).unwrap().mass(), world.body(block).unwrap().mass());
    assert_relative(velocity(&world, block).z, 40.0 * m1 / (m1 + m2), 0.01, "momentum is shared");
}

/// Filters and sensors do not stop bullets.
#[test]
fn bullets_pass_what_they_do_not_collide_with() {
    let mut world = weightless();
    world.add_shape(BodyId::WORLD, &target(Target::Wall).sensor()).unwrap();
    let nothing = arbiter3d::Filter { mask: 0, ..arbiter3d::Filter::default() };
    world.add_shape(BodyId::WORLD, &target(Target::Wall).filter(nothing)).unwrap();
    let shot = BodyDefinition::dynamic().at(Vec3::Z * -2.0).moving(Vec3::Z * 200.0, Vec3::ZERO);
    assert_relative(shoot(&mut world, &shot, &sphere(0.025)), -2.0 + 200.0 * 0.5, 1e-3, "way");
}

/// How a rod meets the wall.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Meeting {
    /// Its centre is held beside the wall.
    Pinned,
    /// At 10 to 60 m/s.
    Thrown,
    /// It falls on it.
    Dropped,
}

/// Rods of 2 m by 2 cm: a capsule, a box, the same as a hull, and a hull that is thin at one end.
fn rods() -> [(&'static str, Shape); 4] {
    let bar = |near: f32, far: f32| -> Vec<Vec3> {
        let sides = [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)];
        let corner = |(x, z): (f32, f32)| [Vec3::new(x * near, -1.0, z * near), Vec3::new(x * far, 1.0, z * far)];
        sides.into_iter().flat_map(corner).collect()
    };
    [
        ("capsule", capsule(0.99, 0.01)),
        ("box", cuboid(0.01, 1.0, 0.01)),
        ("hull", Shape::hull(&bar(0.01, 0.01)).unwrap()),
        ("taper", Shape::hull(&bar(0.02, 0.01)).unwrap()),
    ]
}

/// A rod on this side of the wall: where, and how it is turned.
fn beside_the_wall(random: &mut Random, meeting: Meeting) -> (Vec3, Quat) {
    loop {
        let far = if meeting == Meeting::Pinned { -0.98 } else { -2.5 };
        let center = Vec3::new(random.range(-3.0, 3.0), random.range(-3.0, 3.0), random.range(far, -0.05));
        let rotation = random.rotation();
        let end = (rotation * Vec3::Y).z.abs();
        if center.z + end < -0.04 {
            return (center, rotation);
        }
    }
}

/// Rods that spin at `speed` beside, into and onto a wall of 1 cm and meshes: their centres stay on this side, and no point of
/// their centre lines comes farther than `deepest` beyond the far side.
fn spin_rods(speed: f32, rounds: usize, deepest: f32) {
    let mut crossed = Vec::new();
    for kind in [Target::Wall, Target::OneSidedMesh, Target::TwoSidedMesh] {
        let far_side = if kind == Target::Wall { 0.01 } else { 0.0 };
        for (meeting, (name, shape)) in [Meeting::Pinned, Meeting::Thrown, Meeting::Dropped]
            .into_iter()
            .flat_map(|meeting| rods().into_iter().map(move |rod| (meeting, rod)))
        {
            let mut world = weightless();
            if meeting == Meeting::Dropped {
                let settings =
                    WorldSettings { gravity: Vec3::Z * 9.81, allow_sleep: false, ..WorldSettings::default() };
                world = World::new(settings).unwrap();
            }
            world.add_shape(BodyId::WORLD, &target(kind)).unwrap();
            let mut random = Random(70);
            for round in 0..rounds {
                let (center, rotation) = beside_the_wall(&mut random, meeting);
                let throw = random.range(10.0, 60.0);
                let velocity = if meeting == Meeting::Thrown { askew(&mut random, throw) } else { Vec3::ZERO };
                let spin = random.vector(1.0).normalize() * speed;
                let mut body = BodyDefinition::dynamic().at(center).rotated(rotation).moving(velocity, spin);
                if meeting == Meeting::Pinned {
                    body.locked_axes = LockedAxes::TRANSLATION;
                }
                let rod = add(&mut world, &body, &ShapeDefinition::new(shape.clone()));
                for step in 0..60 {
                    world.step(DT).unwrap();
                    let seen = world.body(rod).unwrap();
                    let end = (seen.rotation() * Vec3::Y).z.abs();
                    let (middle, tip) = (seen.center_of_mass().z, seen.position().z + end);
                    let at = format!("{kind:?}, {meeting:?} {name}, round {round}, step {step}");
                    if middle >= far_side || tip >= far_side + deepest {
                        crossed.push(format!("{at}: centre at z = {middle}, end at z = {tip}"));
                        break;
                    }
                }
                world.remove_body(rod).unwrap();
            }
        }
    }
    let first = &crossed[..crossed.len().min(20)];
    assert!(crossed.is_empty(), "{} rods have crossed: {first:#?}", crossed.len());
}

/// At 100 rad/s: an end goes 1.7 m in a step.
#[test]
fn spinning_rods_never_cross() {
    spin_rods(100.0, 12, 0.01);
}

/// At 340 rad/s a rod turns by 5.7 radians in a step: nearly all the way round.
#[test]
fn rods_that_nearly_turn_full_circle_in_a_step_never_cross() {
    spin_rods(340.0, 4, 0.01);
}

/// The same in many more directions and phases.
#[test]
#[ignore = "a minute long"]
fn spinning_rods_never_cross_in_any_direction() {
    spin_rods(100.0, 300, 0.01);
    spin_rods(60.0, 100, 0.01);
    spin_rods(340.0, 100, 0.01);
}

/// Doors of 2 cm that stand, swing and come: bodies at 60 to 200 m/s never get behind them.
#[test]
fn fast_bodies_do_not_pass_kinematic_doors() {
    let shapes = [sphere(0.05), cube(0.05), capsule(0.2, 0.03), wedge(0.06)];
    let doors = [
        (Vec3::ZERO, Vec3::ZERO),
        (Vec3::Z * 10.0, Vec3::ZERO),
        (Vec3::Z * -20.0, Vec3::ZERO),
        (Vec3::X * 5.0, Vec3::ZERO),
        (Vec3::ZERO, Vec3::Y * 3.0),
    ];
    for (at, (velocity, spin)) in doors.into_iter().enumerate() {
        let mut random = Random(71);
        for shot in 0..30 {
            let mut world = weightless();
            let door = BodyDefinition::kinematic().moving(velocity, spin);
            let door = add(&mut world, &door, &ShapeDefinition::new(cuboid(6.0, 6.0, 0.01)));
            let from = Vec3::new(random.range(-1.0, 1.0), random.range(-1.0, 1.0), random.range(-4.0, -2.0));
            let ahead = Vec3::Z * random.range(60.0, 200.0);
            let body = BodyDefinition::dynamic().at(from).moving(ahead, random.vector(20.0));
            let body = add(&mut world, &body, &ShapeDefinition::new(shapes[shot % 4].clone()));
            for step in 0..8 {
                world.step(DT).unwrap();
                let seen = world.body(door).unwrap().pose().inverse_transform_point(position(&world, body));
                assert!(seen.z < 0.0, "door {at}, shot {shot}, step {step}: {seen}");
            }
        }
    }
}

/// A pair filter that lets a body pass a wall is heard by continuous collision.
#[test]
fn pair_filters_are_heard() {
    let mut world = weightless();
    world.add_shape(BodyId::WORLD, &target(Target::Wall)).unwrap();
    world.set_pair_filter(Some(Box::new(|_| false)));
    let body = BodyDefinition::dynamic().at(Vec3::Z * -2.0).moving(Vec3::Z * 200.0, Vec3::ZERO);
    assert!(shoot(&mut world, &body, &sphere(0.05)) > 50.0);
}

/// At 50 m/s over a floor and a mesh, spinning about the vertical at 40 rad/s: nothing is held, lifted or shaken.
#[test]
fn spinning_bodies_slide_on_without_being_held() {
    let ground = [
        ShapeDefinition::new(cuboid(200.0, 200.0, 1.0)).at(Vec3::Z),
        target(Target::OneSidedMesh),
        target(Target::TwoSidedMesh),
    ];
    let bodies =
        [(cuboid(0.5, 0.1, 0.1), 0.1), (Shape::hull(&corners(0.5, 0.1)).unwrap(), 0.1), (cuboid(0.3, 0.3, 0.05), 0.05)];
    for (kind, below) in ground.into_iter().enumerate() {
        for (at, &(ref shape, half)) in bodies.iter().enumerate() {
            let half: f32 = half;
            let settings = WorldSettings { gravity: Vec3::Z * 9.81, ..WorldSettings::default() };
            let mut world = World::new(settings).unwrap();
            world.add_shape(BodyId::WORLD, &below.clone().friction(0.0)).unwrap();
            let body = BodyDefinition::dynamic().at(Vec3::new(-60.0, 0.3, -half));
            let body = body.moving(Vec3::X * 50.0, Vec3::Z * 40.0);
            let body = add(&mut world, &body, &ShapeDefinition::new(shape.clone()).friction(0.0));
            run(&mut world, 2.0);
            let seen = world.body(body).unwrap();
            let what = format!("ground {kind}, body {at}");
            assert_relative(seen.position().x, 40.0, 0.01, &what);
            assert_relative(seen.linear_velocity().x, 50.0, 0.005, &what);
            assert_relative(seen.angular_velocity().z, 40.0, 0.01, &what);
            assert_near(seen.position().z, -half, 0.006, &what);
        }
    }
}

/// Corners of a bar along x.
fn corners(long: f32, half: f32) -> Vec<Vec3> {
    let side = |i: u32, bit: u32, half: f32| if i >> bit & 1 == 1 { half } else { -half };
    (0..8).map(|i| Vec3::new(side(i, 0, long), side(i, 1, half), side(i, 2, half))).collect()
}
