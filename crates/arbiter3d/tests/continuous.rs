//! Continuous collision: what is fast does not pass through what is thin.

mod common;

use arbiter3d::math::Vec3;
use arbiter3d::{BodyDefinition, BodyId, MeshSides, Shape, ShapeDefinition, TriangleMesh, World};
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
