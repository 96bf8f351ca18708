//! Cylinders, cones, tapered capsules, ellipsoids, rounded and custom shapes: how they slide, roll, stand, tip and rest.

mod common;

use arbiter3d::math::{Pose, Quat, Rotation, Vec3};
use arbiter3d::narrow_phase::{Manifold, PairCache, collide};
use arbiter3d::{BodyDefinition, BodyId, ConvexShape, Shape, ShapeDefinition, World, WorldSettings};
use common::*;

/// The upper half of a ball, with its support function, its centre of mass and the radius with which it rolls.
#[derive(Debug)]
struct HalfBall(f32, f32);

impl ConvexShape for HalfBall {
    fn support(&self, direction: Vec3) -> Vec3 {
        let across = Vec3::new(direction.x, 0.0, direction.z);
        if direction.y > 0.0 { direction.normalize_or_zero() * self.0 } else { across.normalize_or_zero() * self.0 }
    }

    fn center(&self) -> Vec3 {
        Vec3::new(0.0, 0.375 * self.0, 0.0)
    }

    fn rounding_radius(&self) -> f32 {
        self.1
    }
}

fn can() -> Shape {
    Shape::cylinder(0.3, 0.25).unwrap()
}

fn rounded_box() -> Shape {
    Shape::rounded(&cuboid(0.3, 0.2, 0.25), 0.05).unwrap()
}

/// A shape that lies as it rests: the pose of its frame over the floor.
struct Lying {
    name: &'static str,
    shape: Shape,
    rotation: Quat,
    height: f32,
}

fn lying_shapes() -> Vec<Lying> {
    let upright = Quat::IDENTITY;
    let (h, top, bottom) = (0.3, 0.1, 0.2);
    let slope: f32 = (bottom - top) / (2.0 * h);
    let lean = libm::asin(f64::from(slope)).to_degrees() as f32;
    let cone_lean = libm::atan(0.25 / 0.6_f64).to_degrees() as f32;
    let cone_side = (0.6_f32 * 0.6 + 0.25 * 0.25).sqrt();
    let of = |name, shape, rotation, height| Lying { name, shape, rotation, height };
    vec![
        of("can", can(), upright, 0.3),
        of("can on its side", can(), turn(Vec3::Z, 90.0), 0.25),
        of("cone", Shape::cone(0.3, 0.25).unwrap(), upright, 0.3),
        of(
            "cone on its side",
            Shape::cone(0.3, 0.25).unwrap(),
            turn(Vec3::Z, -90.0 - cone_lean),
            0.3 * 0.25 / cone_side,
        ),
        of("rounded box", rounded_box(), upright, 0.25),
        of("ellipsoid", Shape::ellipsoid(Vec3::new(0.4, 0.2, 0.3)).unwrap(), upright, 0.2),
        of(
            "tapered capsule",
            Shape::tapered_capsule(h, top, bottom).unwrap(),
            turn(Vec3::Z, -90.0 - lean),
            slope * h + top,
        ),
        of("half ball", Shape::custom(HalfBall(0.3, 0.0)).unwrap(), upright, 0.0),
        of("half ball on its round side", Shape::custom(HalfBall(0.3, 0.0)).unwrap(), turn(Vec3::X, 180.0), 0.3),
    ]
}

/// A grid of squares about the origin, solid from above.
fn grid(cells: u32, size: f32, height: impl Fn(f32, f32) -> f32) -> Shape {
    let at = |i: u32| (i as f32 - 0.5 * cells as f32) * size;
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for z in 0..=cells {
        vertices.extend((0..=cells).map(|x| Vec3::new(at(x), height(at(x), at(z)), at(z))));
    }
    for z in 0..cells {
        for x in 0..cells {
            let corner = z * (cells + 1) + x;
            triangles.push([corner, corner + cells + 1, corner + 1]);
            triangles.push([corner + 1, corner + cells + 1, corner + cells + 2]);
        }
    }
    Shape::mesh(vertices, triangles).unwrap()
}

/// Seams inside a flat mesh are not felt, in any direction: no vertical speed, no speed lost where there is no friction.
#[test]
fn nothing_feels_the_seams_of_a_flat_mesh() {
    let floor = grid(60, 0.5, |_, _| 0.0);
    let mut worst = Vec::new();
    for Lying { name, shape, rotation, height } in lying_shapes() {
        let (mut bump, mut lost): (f32, f32) = (0.0, 0.0);
        for direction in 0..32 {
            let degrees = direction as f32 * 11.25;
            let mut world = sleepless();
            world.add_shape(BodyId::WORLD, &ShapeDefinition::new(floor.clone()).friction(0.0)).unwrap();
            let rotation = turn(Vec3::Y, 17.0 * direction as f32) * rotation;
            let body = BodyDefinition::dynamic().at(Vec3::new(0.13, height - 0.002, 0.21)).rotated(rotation);
            let body = add(&mut world, &body, &ShapeDefinition::new(shape.clone()).friction(0.0));
            run(&mut world, 0.5);
            let before = velocity(&world, body);
            world.body_mut(body).unwrap().set_linear_velocity(heading(degrees) * 6.0).unwrap();
            for _ in 0..60 {
                world.step(DT).unwrap();
                bump = bump.max(velocity(&world, body).y.abs());
            }
            lost = lost.max((6.0 - velocity(&world, body).dot(heading(degrees))).abs());
            assert!(before.length() < 2e-3, "{name} is not at rest: {before}");
        }
        println!("{name}: bump {bump:.1e} m/s, lost {lost:.1e} m/s");
        worst.push((name, bump, lost));
    }
    assert!(worst.iter().all(|(_, bump, lost)| *bump < 1e-3 && *lost < 1e-3), "{worst:?}");
}

/// A cylinder rolls over a mesh along a straight line, as far as it should.
#[test]
fn a_rolling_cylinder_keeps_its_line_on_a_mesh() {
    let floor = grid(60, 0.5, |_, _| 0.0);
    for degrees in [0.0, 10.0, 33.0, 45.0, 80.0] {
        let mut world = sleepless();
        world.add_shape(BodyId::WORLD, &ShapeDefinition::new(floor.clone()).rolling_resistance(0.0)).unwrap();
        let ahead = heading(degrees);
        let axis = Vec3::Y.cross(ahead);
        // The cylinder's own axis, y, turned into the axle.
        let rotation = turn(Vec3::Y, -degrees) * turn(Vec3::X, 90.0);
        let body = BodyDefinition::dynamic().at(Vec3::Y * 0.25).rotated(rotation).moving(ahead * 3.0, axis * 12.0);
        let body = add(&mut world, &body, &ShapeDefinition::new(can()).rolling_resistance(0.0));
        run(&mut world, 3.0);
        let way = position(&world, body);
        assert_relative(way.dot(ahead), 9.0, 0.005, "way");
        assert_near(way.dot(axis), 0.0, 0.02, "aside");
        assert_near(way.y, 0.25, 0.003, "height");
    }
}

fn mixed(at: usize) -> Shape {
    match at % 8 {
        0 => can(),
        1 => Shape::cone(0.3, 0.25).unwrap(),
        2 => rounded_box(),
        3 => Shape::ellipsoid(Vec3::new(0.35, 0.2, 0.25)).unwrap(),
        4 => Shape::tapered_capsule(0.25, 0.12, 0.2).unwrap(),
        5 => Shape::custom(HalfBall(0.3, 0.3)).unwrap(),
        6 => Shape::rounded(&Shape::cylinder(0.15, 0.2).unwrap(), 0.05).unwrap(),
        _ => {
            let corner = |i: u32| {
                Vec3::new([0.3, -0.3][i as usize & 1], [0.2, -0.2][i as usize >> 1 & 1], [0.25, -0.2][i as usize >> 2])
            };
            Shape::point_cloud(&(0..8).map(corner).collect::<Vec<_>>()).unwrap()
        }
    }
}

/// Two hundred of all kinds come to rest on a wavy mesh: above it, hardly sunk in, asleep.
#[test]
fn mixed_shapes_rest_on_waves() {
    let mut world = world();
    let height = |x: f32, z: f32| 0.4 * (libm::sin(f64::from(0.9 * x)) * libm::cos(f64::from(0.8 * z))) as f32;
    let hills = ShapeDefinition::new(grid(60, 0.5, height)).friction(0.8);
    world.add_shape(BodyId::WORLD, &hills).unwrap();
    let mut random = Random(9);
    let mut bodies = Vec::new();
    for at in 0..200 {
        let place = Vec3::new((at % 10) as f32 - 4.5, 1.5 + (at / 50) as f32, (at / 10 % 5) as f32 * 2.0 - 4.0);
        let body = BodyDefinition::dynamic().at(place).rotated(random.rotation());
        let shape = ShapeDefinition::new(mixed(at)).friction(0.8).rolling_resistance(0.1);
        bodies.push(add(&mut world, &body, &shape));
    }
    run(&mut world, 30.0);
    println!("waves: {} awake, deepest {:.2} mm", world.awake_count(), world.deepest_penetration() * 1e3);
    for (at, &body) in bodies.iter().enumerate() {
        let p = world.body(body).unwrap().center_of_mass();
        assert!(p.x.abs() < 15.0 && p.z.abs() < 15.0, "{at}: {p} is off the mesh");
        assert!(p.y > height(p.x, p.z) + 0.05, "{at} at {p} is not above the ground");
    }
    assert!(world.deepest_penetration() < 0.01, "{}", world.deepest_penetration());
    let awake: Vec<usize> = (0..200).filter(|&at| world.body(bodies[at]).unwrap().is_awake()).collect();
    assert!(awake.is_empty(), "{awake:?} are awake");
}

fn contacts(a: &Shape, b: &Shape, pose: &Pose) -> Manifold {
    let mut manifold = Manifold::EMPTY;
    collide(a, b, pose, 0.01, &mut PairCache::default(), &mut manifold);
    manifold
}

/// What stands has four points, what lies on a line two, what crosses one; on a box, a mesh and a half-space alike.
#[test]
fn manifolds_are_full() {
    let turned = |rotation: Quat| Rotation::from_xyzw(rotation.x, rotation.y, rotation.z, rotation.w);
    let (block, mesh, floor) = (cuboid(5.0, 1.0, 5.0), grid(20, 0.5, |_, _| 0.0), Shape::half_space());
    let expected = [4, 2, 4, 2, 4, 1, 2, 4, 1];
    for (lying, expected) in lying_shapes().iter().zip(expected) {
        for (ground, top) in [(&block, 1.0), (&mesh, 0.0), (&floor, 0.0)] {
            let position = Vec3::new(0.13, top + lying.height - 0.001, 0.21);
            let found = contacts(ground, &lying.shape, &Pose::new(position, turned(lying.rotation)));
            assert_eq!(found.points().len(), expected, "{} on {ground:?}: {found:?}", lying.name);
            for point in found.points() {
                assert!((point.normal - Vec3::Y).length() < 1e-4, "{}: {point:?}", lying.name);
                assert_near(point.separation, -0.001, 1e-4, lying.name);
            }
        }
    }
    let on_top = contacts(&can(), &can(), &Pose::from_position(Vec3::new(0.05, 0.599, 0.0)));
    assert_eq!(on_top.points().len(), 4, "{on_top:?}");
    let level = turned(turn(Vec3::X, 90.0));
    let across = Pose::new(Vec3::new(0.499, 0.0, 0.0), level);
    assert_eq!(contacts(&can(), &can(), &across).points().len(), 1);
    let beside = Pose::from_position(Vec3::new(0.499, 0.1, 0.0));
    assert_eq!(contacts(&can(), &can(), &beside).points().len(), 2);
}

/// What stands on a disc of radius 0.3 on a slope tips where its centre of mass leaves the disc: the tangent of that angle is
/// the radius over the centre's height. The slope grows by half a degree a second, as gravity that leans more and more; however
/// the shape is turned about its own axis.
fn slope_that_tips(shape: &Shape, height: f32, about: f32) -> (f32, f32) {
    let mut world = sleepless();
    floor(&mut world, 3.0);
    let body = BodyDefinition::dynamic().at(Vec3::Y * height).rotated(turn(Vec3::Y, about));
    let body = add(&mut world, &body, &ShapeDefinition::new(shape.clone()).friction(3.0));
    let expected = libm::atan2(0.3, f64::from(world.body(body).unwrap().center_of_mass().y)).to_degrees() as f32;
    let mut slope = |degrees: f32| {
        let gravity = turn(Vec3::Z, degrees) * (Vec3::Y * -GRAVITY);
        world.set_settings(WorldSettings { gravity, ..*world.settings() }).unwrap();
        world.step(DT).unwrap();
        (world.body(body).unwrap().rotation() * Vec3::Y).y > 0.999
    };
    for step in 0..60 {
        slope((expected - 4.0) * step as f32 / 60.0);
    }
    let (mut degrees, mut stood) = (expected - 4.0, 0.0);
    // Not beyond: what has tumbled once may pass upright again.
    while degrees < expected + 3.0 && slope(degrees) {
        stood = degrees;
        degrees += 0.5 * DT;
    }
    (stood, expected)
}

#[test]
fn what_stands_on_a_disc_tips_at_its_angle() {
    let rounded = Shape::rounded(&Shape::cylinder(0.45, 0.3).unwrap(), 0.05).unwrap();
    let cases = [
        ("can", Shape::cylinder(0.5, 0.3).unwrap(), 0.5),
        ("cone", Shape::cone(0.6, 0.3).unwrap(), 0.6),
        ("rounded can", rounded, 0.5),
    ];
    for (name, shape, height) in &cases {
        for about in [0.0, 7.0, 11.25, 20.0, 33.0, 45.0, 70.0, 100.0] {
            let (stood, expected) = slope_that_tips(shape, *height, about);
            println!("{name} turned by {about}°: stands up to {stood}° of {expected}°");
            assert_near(stood, expected, 1.5, name);
        }
    }
}

/// Stacks of ten stand for twenty seconds, where they were, and sleep.
#[test]
fn stacks_of_ten_stand_and_sleep() {
    for (name, shape, half) in [("cans", can(), 0.3), ("rounded boxes", rounded_box(), 0.25)] {
        let mut world = world();
        floor(&mut world, 0.6);
        let place = |at: usize| Vec3::new(0.0, half + 2.0 * half * at as f32, 0.0);
        let bodies: Vec<BodyId> = (0..10).map(|at| drop_shape(&mut world, &shape, place(at))).collect();
        run(&mut world, 20.0);
        for (at, &body) in bodies.iter().enumerate() {
            let moved = position(&world, body) - place(at);
            assert!(moved.length() < 0.03, "{name}: number {at} moved by {moved}");
        }
        assert_eq!(world.awake_count(), 0, "{name}");
    }
}

/// A solid cylinder that rolls down a slope accelerates by ⅔ g sin θ.
#[test]
fn a_solid_cylinder_rolls_down_a_slope() {
    let degrees = 20.0_f32;
    let (sine, cosine) = libm::sincos(f64::from(degrees).to_radians());
    let gravity = Vec3::new(GRAVITY * sine as f32, -GRAVITY * cosine as f32, 0.0);
    let mut world = World::new(WorldSettings { gravity, allow_sleep: false, ..WorldSettings::default() }).unwrap();
    floor(&mut world, 1.0);
    let body = BodyDefinition::dynamic().at(Vec3::Y * 0.25).rotated(turn(Vec3::X, 90.0));
    let body = add(&mut world, &body, &ShapeDefinition::new(can()).friction(1.0).rolling_resistance(0.0));
    run(&mut world, 2.0);
    assert_relative(velocity(&world, body).x, 2.0 / 3.0 * GRAVITY * sine as f32 * 2.0, 0.01, "speed");
    assert_relative(-spin(&world, body).z * 0.25, velocity(&world, body).x, 0.01, "it rolls");
}

/// Kinetic and potential energy of a body.
fn energy(world: &World, body: BodyId) -> f32 {
    let state = world.body(body).unwrap();
    let (v, w) = (state.linear_velocity(), state.angular_velocity());
    let local = state.rotation().inverse() * w;
    let i = state.mass_properties().inertia;
    let turning = i.xx * local.x * local.x
        + i.yy * local.y * local.y
        + i.zz * local.z * local.z
        + 2.0 * (i.xy * local.x * local.y + i.xz * local.x * local.z + i.yz * local.y * local.z);
    state.mass() * (0.5 * v.length_squared() + GRAVITY * state.center_of_mass().y) + 0.5 * turning
}

/// What rocks or spins on a floor gains no energy.
#[test]
fn rocking_and_spinning_gain_no_energy() {
    let coin = Shape::cylinder(0.01, 0.2).unwrap();
    let egg = Shape::ellipsoid(Vec3::new(0.4, 0.2, 0.3)).unwrap();
    let cases = [
        ("ellipsoid", egg, turn(Vec3::Z, 35.0), Vec3::new(0.0, 0.29, 0.0), Vec3::ZERO),
        ("coin", coin, turn(Vec3::X, 87.0), Vec3::new(0.0, 0.2, 0.0), Vec3::Y * 20.0),
    ];
    for (name, shape, rotation, place, turning) in cases {
        let mut world = sleepless();
        floor(&mut world, 0.6);
        let body = BodyDefinition::dynamic().at(place).rotated(rotation).moving(Vec3::ZERO, turning);
        let body = add(&mut world, &body, &ShapeDefinition::new(shape).rolling_resistance(0.0));
        run(&mut world, 0.2);
        let start = energy(&world, body);
        let mut most = start;
        for _ in 0..600 {
            world.step(DT).unwrap();
            most = most.max(energy(&world, body));
        }
        println!("{name}: {start} J at first, {most} J at most, {} J in the end", energy(&world, body));
        assert!(most <= 1.01 * start, "{name} gains energy: {start} J at first, {most} J later");
    }
}

/// A half ball that rocks on its round side, told by its support alone, does as a ball with the same mass and centre of mass.
#[test]
fn a_half_ball_rocks_like_a_weighted_ball() {
    let dome = Shape::custom(HalfBall(0.3, 0.0)).unwrap();
    let mass = dome.mass_properties(1000.0).unwrap();
    let runs = [dome, sphere(0.3)].map(|shape| {
        let mut world = sleepless();
        floor(&mut world, 0.6);
        let body = BodyDefinition::dynamic().at(Vec3::Y * 0.3).rotated(turn(Vec3::X, 150.0));
        let body = add(&mut world, &body, &ShapeDefinition::new(shape).rolling_resistance(0.0));
        world.body_mut(body).unwrap().set_mass(Some(mass)).unwrap();
        let mut track = Vec::new();
        for _ in 0..120 {
            world.step(DT).unwrap();
            track.push(world.body(body).unwrap().center_of_mass());
        }
        track
    });
    for (step, (a, b)) in runs[0].iter().zip(&runs[1]).enumerate() {
        assert!((*a - *b).length() < 0.01, "step {step}: {a} and {b}");
    }
}

/// Whatever way they fall, they come to rest on a floor and sleep.
#[test]
fn all_kinds_fall_asleep() {
    let mut world = world();
    floor(&mut world, 0.6);
    let mut random = Random(3);
    let mut bodies = Vec::new();
    for at in 0..64 {
        let place = Vec3::new((at % 8) as f32 * 2.0, 0.6, (at / 8) as f32 * 2.0);
        let body = BodyDefinition::dynamic().at(place).rotated(random.rotation());
        bodies.push(add(&mut world, &body, &ShapeDefinition::new(mixed(at)).rolling_resistance(0.05)));
    }
    run(&mut world, 15.0);
    let awake: Vec<usize> = (0..64).filter(|&at| world.body(bodies[at]).unwrap().is_awake()).collect();
    assert!(awake.len() <= 1, "{awake:?} are awake");
    assert!(world.deepest_penetration() < 0.006, "{}", world.deepest_penetration());
}

/// A half ball of the user's own falls and rests on its flat face; pushed on its round side it rolls and comes back upright.
#[test]
fn a_custom_half_ball_rests_and_rolls() {
    let mut world = world();
    floor(&mut world, 0.6);
    let shape = ShapeDefinition::new(Shape::custom(HalfBall(0.3, 0.0)).unwrap()).rolling_resistance(0.02);
    let flat = add(&mut world, &BodyDefinition::dynamic().at(Vec3::Y * 0.3), &shape);
    let round = BodyDefinition::dynamic().at(Vec3::new(3.0, 0.3, 0.0)).rotated(turn(Vec3::X, 180.0));
    let round = add(&mut world, &round.moving(Vec3::ZERO, Vec3::Z * 3.0), &shape);
    let mut leaned: f32 = 1.0;
    for _ in 0..60 {
        world.step(DT).unwrap();
        leaned = leaned.min(-(world.body(round).unwrap().rotation() * Vec3::Y).y);
    }
    assert!(leaned < 0.97 && leaned > 0.3, "it rocks: {leaned}");
    run(&mut world, 15.0);
    assert_near(position(&world, flat).y, 0.0, 0.003, "height on the flat face");
    assert_near(position(&world, round).y, 0.3, 0.003, "height on the round side");
    assert_eq!(world.awake_count(), 0);
}
