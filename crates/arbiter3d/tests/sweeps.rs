//! Continuous collision of what is made of parts, of round and pointed kinds, of what turns, and by what sweeps.

mod common;

use arbiter3d::math::Vec3;
use arbiter3d::{
    BodyDefinition, BodyId, CompoundChild, ContactEvents, Shape, ShapeDefinition, TriangleMesh, World, WorldSettings,
};
use common::*;

/// What stands across z with its near side at z = 0: a wall of 1 cm, a mesh, a height field and a half-space.
fn obstacles() -> [(&'static str, ShapeDefinition); 4] {
    let corner = |x: f32, y: f32| Vec3::new(x * 100.0, y * 100.0, 0.0);
    let square = vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
    let mesh = TriangleMesh::new(square, vec![[0, 2, 1], [0, 3, 2]]).unwrap();
    // Fields and half-spaces look along y: a quarter turn about x takes that to −z.
    let up = turn(Vec3::X, -90.0);
    let field = Shape::height_field(vec![0.0; 41 * 41], 41, [5.0, 5.0]).unwrap();
    let middle = up * field.local_aabb().center();
    [
        ("wall", ShapeDefinition::new(cuboid(100.0, 100.0, 0.005)).at(Vec3::Z * 0.005)),
        ("mesh", ShapeDefinition::new(Shape::Mesh(mesh.into()))),
        ("field", ShapeDefinition::new(field).at(-middle).rotated(up)),
        ("half-space", ShapeDefinition::new(Shape::half_space()).rotated(up)),
    ]
}

/// A closed mesh of two bars of 4 cm by 4 cm that meet at the origin: 0.6 m along x and 0.4 m along y.
fn l_mesh() -> Shape {
    let outline =
        [(-0.02, -0.02), (0.58, -0.02), (0.58, 0.02), (0.02, 0.02), (0.02, 0.38), (-0.02, 0.38)].map(|(x, y)| (x, y));
    let mut vertices: Vec<Vec3> = Vec::new();
    for z in [-0.02, 0.02] {
        vertices.extend(outline.map(|(x, y)| Vec3::new(x, y, z)));
    }
    // The corner at (−0.02, 0.02) is no vertex: the fan is about the inner corner, from which all is seen.
    let mut triangles: Vec<[u32; 3]> = Vec::new();
    for [a, b, c] in [[3, 4, 5], [3, 5, 0], [3, 0, 1], [3, 1, 2]] {
        triangles.extend([[c, b, a], [a + 6, b + 6, c + 6]]);
    }
    for a in 0..6 {
        let b = (a + 1) % 6;
        triangles.extend([[a, b, b + 6], [a, b + 6, a + 6]]);
    }
    let mesh = TriangleMesh::new(vertices, triangles).unwrap();
    assert_eq!(mesh.open_edges(), 0);
    Shape::Mesh(mesh.into())
}

/// Bodies of thin parts, each with points of its parts that are well inside.
fn bodies_of_parts() -> [(&'static str, Shape, Vec<Vec3>); 4] {
    let arm = |x: f32| Vec3::X * x;
    let hammer = Shape::compound(&[
        CompoundChild::new(capsule(0.4, 0.015)),
        CompoundChild::new(cuboid(0.12, 0.05, 0.05)).at(Vec3::Y * 0.45),
    ]);
    let letter = Shape::compound(&[
        CompoundChild::new(cuboid(0.3, 0.02, 0.02)).at(arm(0.28)),
        CompoundChild::new(cuboid(0.02, 0.2, 0.02)).at(Vec3::Y * 0.18),
    ]);
    let steps = Shape::voxels(0.05, (0..8).map(|at| [at, at / 2, 0]));
    let ends = vec![Vec3::ZERO, arm(0.5), Vec3::Y * 0.3];
    [
        ("hammer", hammer.unwrap(), vec![Vec3::Y * -0.35, Vec3::ZERO, Vec3::Y * 0.45]),
        ("letter", letter.unwrap(), ends.clone()),
        ("voxels", steps.unwrap(), vec![Vec3::splat(0.025), Vec3::new(0.375, 0.175, 0.025)]),
        ("mesh", l_mesh(), ends),
    ]
}

/// Needles and discs, 1:10 to 1:20, each with points well inside, near its ends.
fn slender_kinds() -> [(&'static str, Shape, Vec<Vec3>); 6] {
    let along = |ends: [f32; 2]| ends.iter().map(|&y| Vec3::Y * y).collect::<Vec<_>>();
    let ellipsoid = Shape::ellipsoid(Vec3::new(0.03, 0.4, 0.03)).unwrap();
    let rim = vec![Vec3::X * 0.25, Vec3::Z * -0.25];
    [
        ("cone", Shape::cone(0.4, 0.04).unwrap(), along([-0.38, 0.3])),
        ("tapered capsule", Shape::tapered_capsule(0.4, 0.06, 0.02).unwrap(), along([-0.38, 0.4])),
        ("ellipsoid", ellipsoid, along([-0.3, 0.3])),
        ("rounded", Shape::rounded(&cuboid(0.01, 0.4, 0.01), 0.01).unwrap(), along([-0.39, 0.39])),
        ("disc", Shape::cylinder(0.02, 0.3).unwrap(), rim.clone()),
        ("coin", Shape::rounded(&Shape::cylinder(0.01, 0.28).unwrap(), 0.01).unwrap(), rim),
    ]
}

/// Shoots bodies at all obstacles, and lists those of which a point comes across.
fn shoot(kinds: &[(&'static str, Shape, Vec<Vec3>)], shots: usize, bullet: bool) {
    let mut crossed = Vec::new();
    for (obstacle, target) in obstacles() {
        let mut random = Random(90);
        for (name, shape, points) in kinds {
            for shot in 0..shots {
                let mut world = weightless();
                world.add_shape(BodyId::WORLD, &target).unwrap();
                let velocity =
                    Vec3::new(random.range(-1.0, 1.0), random.range(-1.0, 1.0), 1.0) * random.range(30.0, 200.0);
                let body = BodyDefinition::dynamic().at(Vec3::Z * random.range(-6.0, -0.7)).rotated(random.rotation());
                let body = BodyDefinition { bullet, ..body.moving(velocity, random.vector(20.0)) };
                let body = add(&mut world, &body, &ShapeDefinition::new(shape.clone()));
                for step in 0..30 {
                    world.step(DT).unwrap();
                    let pose = world.body(body).unwrap().pose();
                    let deepest = points.iter().map(|&point| pose.transform_point(point).z).fold(-1e9, f32::max);
                    if deepest > 0.012 {
                        crossed.push(format!("{name} {shot} at {obstacle}, step {step}: z = {deepest}"));
                        break;
                    }
                }
            }
        }
    }
    let first = &crossed[..crossed.len().min(20)];
    assert!(crossed.is_empty(), "{} have crossed: {first:#?}", crossed.len());
}

/// A hammer, an L, stairs of voxels and an L as a mesh at 30 to 200 m/s: neither the thick parts nor the thin ones get through a
/// wall of 1 cm, a mesh, a height field or into a half-space.
#[test]
fn bodies_of_parts_never_cross() {
    shoot(&bodies_of_parts(), 12, false);
}

/// The same as bullets.
#[test]
fn bullets_of_parts_never_cross() {
    shoot(&bodies_of_parts(), 6, true);
}

/// Cones, tapered capsules, ellipsoids, rounded bars, discs and coins: as far as their ends.
#[test]
fn slender_bodies_of_all_kinds_never_cross() {
    shoot(&slender_kinds(), 12, false);
}

/// A ring as a mesh, thrown over a peg at 150 m/s, is not held by its hollow: it flies on at its speed.
#[test]
fn what_flies_through_a_ring_is_not_stopped() {
    let (count, mut vertices, mut triangles) = (24_u32, Vec::new(), Vec::new());
    for at in 0..count {
        let out = heading(360.0 * at as f32 / count as f32);
        for (radius, y) in [(0.3, -0.05), (0.4, -0.05), (0.4, 0.05), (0.3, 0.05)] {
            vertices.push(out * radius + Vec3::Y * y);
        }
        let next = (at + 1) % count;
        for side in 0..4 {
            let (a, b) = (4 * at + side, 4 * at + (side + 1) % 4);
            let (c, d) = (4 * next + side, 4 * next + (side + 1) % 4);
            triangles.extend([[a, b, d], [a, d, c]]);
        }
    }
    let ring = Shape::mesh(vertices, triangles).unwrap();
    for bullet in [false, true] {
        let mut world = weightless();
        world.add_shape(BodyId::WORLD, &ShapeDefinition::new(capsule(1.0, 0.1))).unwrap();
        let body = BodyDefinition::dynamic().at(Vec3::new(0.05, -9.0, 0.02)).moving(Vec3::Y * 150.0, Vec3::ZERO);
        let body = add(&mut world, &BodyDefinition { bullet, ..body }, &ShapeDefinition::new(ring.clone()));
        run(&mut world, 0.2);
        assert_near(position(&world, body).y, 21.0, 0.01, "it has passed");
        // From the side it is stopped by the peg.
        let thrown = BodyDefinition::dynamic().at(Vec3::new(-6.0, 0.0, 0.0)).moving(Vec3::X * 150.0, Vec3::ZERO);
        let thrown = add(&mut world, &BodyDefinition { bullet, ..thrown }, &ShapeDefinition::new(ring.clone()));
        run(&mut world, 0.2);
        assert!(position(&world, thrown).x < -0.1, "{}", position(&world, thrown));
    }
}

/// A paddle of 1 cm at 50 m/s strikes balls and boxes that rest in its way, awake and asleep, at any phase: none is skipped, all
/// are in front of it in the end, at its speed.
#[test]
fn a_fast_paddle_strikes_what_is_slow() {
    for phase in 0..20 {
        for (asleep, shape) in [(false, sphere(0.05)), (true, sphere(0.05)), (false, cube(0.04)), (true, cube(0.04))] {
            let mut world = World::new(WorldSettings { gravity: Vec3::ZERO, ..WorldSettings::default() }).unwrap();
            let paddle = BodyDefinition::kinematic().at(Vec3::X * (-2.0 - 0.042 * phase as f32));
            let paddle = paddle.moving(Vec3::X * 50.0, Vec3::ZERO);
            let paddle = add(&mut world, &paddle, &ShapeDefinition::new(cuboid(0.005, 0.5, 0.5)));
            let ball = drop_shape(&mut world, &shape, Vec3::ZERO);
            if asleep {
                world.body_mut(ball).unwrap().sleep();
            }
            run(&mut world, 0.2);
            let ahead = position(&world, ball).x - position(&world, paddle).x;
            assert!(ahead > 0.0, "phase {phase}, asleep {asleep}: {ahead} m ahead");
            assert!(velocity(&world, ball).x > 49.0, "phase {phase}, asleep {asleep}: {}", velocity(&world, ball));
        }
    }
}

/// A spinning paddle does too: its end goes 40 m/s.
#[test]
fn a_spinning_paddle_strikes_what_is_slow() {
    for phase in 0..20 {
        let mut world = weightless();
        let paddle = BodyDefinition::kinematic().rotated(turn(Vec3::Y, 90.0 + phase as f32)).at(Vec3::ZERO);
        let paddle = paddle.moving(Vec3::ZERO, Vec3::Y * 40.0);
        add(&mut world, &paddle, &ShapeDefinition::new(cuboid(1.0, 0.2, 0.005)));
        let ball = drop_shape(&mut world, &sphere(0.03), heading(0.0) * 0.9);
        run(&mut world, 0.1);
        assert!(velocity(&world, ball).length() > 30.0, "phase {phase}: {}", velocity(&world, ball));
    }
}

/// Hits of balls that fall: the speed is √(2gh) to a hundredth of a m/s, also where continuous collision has stopped them in
/// between, at all phases of the step; the impulse is m v, and the weight for what is left of the step.
#[test]
fn falling_balls_hit_at_the_speed_of_their_fall() {
    for at in 0..60 {
        let height = 8.0 + 0.05 * at as f32;
        let mut world = world();
        floor(&mut world, 0.0);
        let shape = ShapeDefinition::new(sphere(0.05)).events(ContactEvents::HITS);
        let ball = add(&mut world, &BodyDefinition::dynamic().at(Vec3::Y * (height + 0.05)), &shape);
        let mass = world.body(ball).unwrap().mass();
        for _ in 0..120 {
            world.step(DT).unwrap();
            if let Some(hit) = world.hit_events().first() {
                let expected = (2.0 * GRAVITY * height).sqrt();
                assert_near(hit.speed, expected, 0.02, &format!("hit speed from {height} m"));
                let weight = mass * GRAVITY * DT;
                let blow = mass * hit.speed;
                assert!(hit.impulse > blow - 0.02 * mass && hit.impulse < blow + weight + 0.02 * mass, "{hit:?}");
                break;
            }
        }
    }
}
