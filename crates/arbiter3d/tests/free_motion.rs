//! Motion without contact: falling, spinning, damping, forces, impulses, locks.

mod common;

use arbiter3d::math::{Pose, SymmetricMat3, Vec3};
use arbiter3d::{BodyDefinition, BodyId, BodyKind, LockedAxes, MassProperties, ShapeDefinition, World, WorldSettings};
use common::*;

/// Angular momentum about the centre of mass, in double precision.
fn angular_momentum(world: &World, body: BodyId) -> [f64; 3] {
    let body = world.body(body).unwrap();
    let q = body.rotation();
    let (x, y, z, w) = (f64::from(q.x), f64::from(q.y), f64::from(q.z), f64::from(q.w));
    let rows = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ];
    let omega = body.angular_velocity().to_array().map(f64::from);
    let m = body.mass_properties().inertia;
    let inertia = [[m.xx, m.xy, m.xz], [m.xy, m.yy, m.yz], [m.xz, m.yz, m.zz]];
    let local: [f64; 3] = std::array::from_fn(|i| (0..3).map(|k| rows[k][i] * omega[k]).sum());
    let turned: [f64; 3] = std::array::from_fn(|i| (0..3).map(|k| f64::from(inertia[i][k]) * local[k]).sum());
    std::array::from_fn(|i| (0..3).map(|k| rows[i][k] * turned[k]).sum())
}

fn length(v: [f64; 3]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn difference(a: [f64; 3], b: [f64; 3]) -> f64 {
    length(std::array::from_fn(|i| a[i] - b[i]))
}

/// A free fall covers ½gt², whatever the time step: positions advance with the mean velocity of a substep.
#[test]
fn free_fall_covers_half_g_t_squared() {
    for rate in [30.0, 60.0, 100.0, 144.0, 240.0] {
        for seconds in [2.0, 5.0, 10.0] {
            let (dt, mut world) = (1.0 / rate, sleepless());
            let ball = drop_shape(&mut world, &sphere(0.5), Vec3::ZERO);
            let steps = (seconds * rate) as usize;
            for _ in 0..steps {
                world.step(dt).unwrap();
            }
            let time = steps as f64 * f64::from(dt);
            let expected = 0.5 * f64::from(GRAVITY) * time * time;
            let error = (-f64::from(position(&world, ball).y) - expected) / expected;
            assert!(error.abs() < 1e-5, "after {seconds} s at {rate} Hz: relative error {error:e}");
            let speed = f64::from(GRAVITY) * time;
            let error = (-f64::from(velocity(&world, ball).y) - speed) / speed;
            assert!(error.abs() < 1e-5, "speed after {seconds} s at {rate} Hz: relative error {error:e}");
        }
    }
}

/// A thrown body follows the parabola; its spin does not bend it.
#[test]
fn a_throw_is_a_parabola() {
    let mut world = sleepless();
    let throw = BodyDefinition::dynamic().moving(Vec3::new(3.0, 12.0, -2.0), Vec3::new(1.0, 5.0, -4.0));
    let block = add(&mut world, &throw, &ShapeDefinition::new(cuboid(0.1, 0.4, 0.2)));
    run_at(&mut world, 2.0, 1.0 / 100.0);
    let expected = Vec3::new(6.0, 24.0 - 2.0 * GRAVITY, -4.0);
    assert!(position(&world, block).distance(expected) < 2e-4, "{} against {expected}", position(&world, block));
}

/// Gravity scale multiplies gravity, and only that.
#[test]
fn gravity_scale_multiplies_gravity() {
    let mut world = sleepless();
    for (at, scale) in [-1.0, 0.0, 0.5, 2.0].into_iter().enumerate() {
        let body = BodyDefinition { gravity_scale: scale, ..BodyDefinition::dynamic().at(Vec3::X * 5.0 * at as f32) };
        add(&mut world, &body, &ShapeDefinition::new(sphere(0.5)));
    }
    run(&mut world, 2.0);
    for (id, scale) in world.bodies().skip(1).zip([-1.0, 0.0, 0.5, 2.0]) {
        assert_near(position(&world, id).y, -0.5 * GRAVITY * scale * 4.0, 1e-3, "height");
    }
}

/// Gravity that changes acts from the next step on.
#[test]
fn gravity_may_change_between_steps() {
    let mut world = sleepless();
    let ball = drop_shape(&mut world, &sphere(0.5), Vec3::ZERO);
    world.set_settings(WorldSettings { gravity: Vec3::new(2.0, 0.0, 0.0), ..*world.settings() }).unwrap();
    world.step(DT).unwrap();
    assert!(velocity(&world, ball).distance(Vec3::X * 2.0 * DT) < 1e-7);
}

/// Without torque an uneven body keeps its angular momentum, direction and all, for 20 s.
#[test]
fn a_free_asymmetric_body_keeps_its_angular_momentum() {
    let mut worst: f64 = 0.0;
    for (seed, rate) in [(1, 60.0), (2, 60.0), (3, 100.0), (4, 240.0)] {
        let mut random = Random(seed);
        let mut world = weightless();
        let body = BodyDefinition::dynamic().rotated(random.rotation()).moving(Vec3::ZERO, random.vector(6.0));
        let body = add(&mut world, &body, &ShapeDefinition::new(cuboid(0.1, 0.3, 0.7)));
        let start = angular_momentum(&world, body);
        for _ in 0..(20.0 * rate) as usize {
            world.step(1.0 / rate).unwrap();
            worst = worst.max(difference(angular_momentum(&world, body), start) / length(start));
        }
    }
    println!("angular momentum: largest relative change {worst:e}");
    assert!(worst < 1e-4, "relative change {worst:e}");
}

/// The T-handle turns over again and again (Dzhanibekov): about the middle axis, spin flips every 0.535 s.
///
/// Two boxes, 0.1 kg together, ω₀ = (7.5, 5.025, 0) rad/s; the exact solution changes the sign of ω·x 37 times in 20 s and
/// never that of ω·y. Source of the parameters: P. Terdiman, PEEL.
#[test]
fn the_t_handle_flips_37_times_in_20_seconds() {
    for (dt, substeps) in [(1.0 / 60.0, 4), (1.0 / 120.0, 4), (1.0 / 60.0, 8)] {
        let settings = WorldSettings { substeps, ..*weightless().settings() };
        let mut world = World::new(settings).unwrap();
        let spinning = BodyDefinition::dynamic().moving(Vec3::ZERO, Vec3::new(7.5, 5.025, 0.0));
        let handle = world.add_body(&spinning).unwrap();
        let density = 0.1 / 0.012;
        let stem = ShapeDefinition::new(cuboid(0.05, 0.5, 0.05)).density(density);
        let bar = ShapeDefinition::new(cuboid(0.1, 0.05, 0.05)).density(density).at(Vec3::new(0.1, 0.0, 0.0));
        world.add_shape(handle, &stem).unwrap();
        world.add_shape(handle, &bar).unwrap();
        assert_relative(world.body(handle).unwrap().mass(), 0.1, 1e-5, "mass");
        let energy = world.kinetic_energy();
        assert!((energy - 0.20243).abs() < 2e-4, "{energy}");
        let local = |world: &World| {
            let body = world.body(handle).unwrap();
            body.rotation().inverse() * body.angular_velocity()
        };
        let (mut flips, mut sign) = (0, 1.0);
        for _ in 0..(20.0 / dt) as usize {
            world.step(dt).unwrap();
            let omega = local(&world);
            assert!(omega.y > 0.0, "the spin about the long axis never turns: {omega}");
            if omega.x * sign < 0.0 {
                (flips, sign) = (flips + 1, -sign);
            }
        }
        let drift = world.kinetic_energy() / energy - 1.0;
        println!("T-handle at {} Hz, {substeps} substeps: {flips} flips, energy {drift:e}", 1.0 / dt);
        assert!((36..=38).contains(&flips), "{flips} flips");
        assert!(drift.abs() < 0.01, "energy changed by {drift:e}");
    }
}

/// A ball and a box about a principal axis keep their angular velocity exactly as it is.
#[test]
fn spin_about_a_principal_axis_stays() {
    let mut world = weightless();
    let spinning = BodyDefinition::dynamic().moving(Vec3::ZERO, Vec3::new(0.0, 0.0, 8.0));
    let ball = add(&mut world, &spinning, &ShapeDefinition::new(sphere(0.5)));
    let block = add(&mut world, &spinning.at(Vec3::X * 5.0), &ShapeDefinition::new(cuboid(0.5, 0.2, 0.1)));
    run(&mut world, 10.0);
    for body in [ball, block] {
        assert!(spin(&world, body).distance(Vec3::Z * 8.0) < 1e-3, "{}", spin(&world, body));
    }
    let expected = turn(Vec3::Z, 80.0_f32.to_degrees());
    let turned = world.body(ball).unwrap().rotation().dot(expected).abs();
    assert!(turned > 1.0 - 1e-5, "80 rad about z: {turned}");
}

/// Damping is a rate a second: the same decay for every time step, near e^(−ct).
#[test]
fn damping_is_a_rate_per_second() {
    for rate in [30.0, 60.0, 240.0] {
        let mut world = weightless();
        let moving = BodyDefinition {
            linear_damping: 1.0,
            angular_damping: 2.0,
            ..BodyDefinition::dynamic().moving(Vec3::X * 10.0, Vec3::Y * 4.0)
        };
        let damped = add(&mut world, &moving, &ShapeDefinition::new(sphere(0.5)));
        let free = BodyDefinition::dynamic().at(Vec3::Y * 9.0).moving(Vec3::X * 10.0, Vec3::Y * 4.0);
        let free = add(&mut world, &free, &ShapeDefinition::new(sphere(0.5)));
        run_at(&mut world, 1.0, 1.0 / rate);
        assert_relative(velocity(&world, damped).x, 10.0 * libm::exp(-1.0) as f32, 0.01, "speed");
        assert_relative(spin(&world, damped).y, 4.0 * libm::exp(-2.0) as f32, 0.02, "spin");
        assert_eq!((velocity(&world, free), spin(&world, free)), (Vec3::X * 10.0, Vec3::Y * 4.0));
    }
}

/// A force acts in the step after it was given, once, and without lag: F = ma.
#[test]
fn a_force_accelerates_for_one_step() {
    let mut world = weightless();
    let ball = drop_shape(&mut world, &sphere(0.5), Vec3::ZERO);
    let mass = world.body(ball).unwrap().mass();
    let mut body = world.body_mut(ball).unwrap();
    body.apply_force(Vec3::X * 100.0).unwrap();
    body.apply_force(Vec3::X * 200.0).unwrap();
    assert_eq!(world.body(ball).unwrap().force(), Vec3::X * 300.0);
    world.step(0.01).unwrap();
    assert_relative(velocity(&world, ball).x, 3.0 / mass, 1e-5, "speed");
    assert_relative(position(&world, ball).x, 0.5 * 3.0 / mass * 0.01, 1e-4, "½at²");
    assert_eq!(world.body(ball).unwrap().force(), Vec3::ZERO);
    world.step(0.01).unwrap();
    assert_relative(velocity(&world, ball).x, 3.0 / mass, 1e-5, "speed after the force has gone");
}

/// A torque turns at τ/I; a force at a point pushes and turns; so do impulses.
#[test]
fn forces_and_impulses_at_a_point_push_and_turn() {
    let (mut world, dt) = (weightless(), 0.01);
    let bodies: Vec<BodyId> =
        (0..4).map(|i| drop_shape(&mut world, &cuboid(0.5, 0.25, 0.125), Vec3::X * 5.0 * i as f32)).collect();
    let properties = world.body(bodies[0]).unwrap().mass_properties();
    let (mass, izz) = (properties.mass, properties.inertia.zz);
    assert_relative(izz, mass / 3.0 * (0.25 + 0.0625), 1e-5, "m/12 (a² + b²)");
    let at = |i: usize| Vec3::X * 5.0 * i as f32 + Vec3::new(0.5, 0.0, 0.0);
    world.body_mut(bodies[0]).unwrap().apply_torque(Vec3::Z * 50.0).unwrap();
    world.body_mut(bodies[1]).unwrap().apply_force_at(Vec3::Y * 100.0, at(1)).unwrap();
    world.body_mut(bodies[2]).unwrap().apply_impulse_at(Vec3::Y, at(2)).unwrap();
    world.body_mut(bodies[3]).unwrap().apply_angular_impulse(Vec3::Z * 0.5).unwrap();
    // Impulses act at once.
    assert_relative(velocity(&world, bodies[2]).y, 1.0 / mass, 1e-5, "speed by an impulse");
    assert_relative(spin(&world, bodies[2]).z, 0.5 / izz, 1e-5, "spin by an impulse");
    assert_relative(spin(&world, bodies[3]).z, 0.5 / izz, 1e-5, "spin by an angular impulse");
    world.step(dt).unwrap();
    assert_relative(spin(&world, bodies[0]).z, 50.0 * dt / izz, 1e-4, "spin by a torque");
    assert_relative(velocity(&world, bodies[1]).y, 100.0 * dt / mass, 1e-4, "speed by a force at a point");
    assert_relative(spin(&world, bodies[1]).z, 50.0 * dt / izz, 1e-3, "spin by a force at a point");
}

/// Forces and impulses do nothing to bodies that are not dynamic, and zero does nothing to any.
#[test]
fn only_dynamic_bodies_take_forces() {
    let mut world = weightless();
    for kind in [BodyKind::Static, BodyKind::Kinematic] {
        let body = BodyDefinition { kind, ..BodyDefinition::dynamic() };
        let body = add(&mut world, &body, &ShapeDefinition::new(sphere(0.5)));
        let mut wall = world.body_mut(body).unwrap();
        wall.apply_force(Vec3::X).unwrap();
        wall.apply_torque(Vec3::X).unwrap();
        wall.apply_impulse(Vec3::X).unwrap();
        wall.apply_impulse_at(Vec3::X, Vec3::ONE).unwrap();
        wall.apply_angular_impulse(Vec3::X).unwrap();
        world.step(DT).unwrap();
        let body = world.body(body).unwrap();
        assert_eq!(
            (body.linear_velocity(), body.angular_velocity(), body.force()),
            (Vec3::ZERO, Vec3::ZERO, Vec3::ZERO)
        );
    }
}

/// Locked axes stay as they are under gravity, force, torque, impulse and collision.
#[test]
fn locked_axes_do_not_move() {
    let mut world = sleepless();
    floor(&mut world, 0.5);
    let locked = LockedAxes::TRANSLATION_X | LockedAxes::ROTATION_Y | LockedAxes::ROTATION_Z;
    let body = BodyDefinition {
        locked_axes: locked,
        ..BodyDefinition::dynamic().at(Vec3::new(0.0, 3.0, 0.0)).moving(Vec3::splat(2.0), Vec3::splat(3.0))
    };
    let body = add(&mut world, &body, &ShapeDefinition::new(cuboid(0.5, 0.3, 0.4)));
    assert_eq!((velocity(&world, body).x, spin(&world, body).y, spin(&world, body).z), (0.0, 0.0, 0.0));
    for _ in 0..120 {
        let mut handle = world.body_mut(body).unwrap();
        handle.apply_force_at(Vec3::new(500.0, 0.0, 100.0), Vec3::new(0.3, 2.0, 1.0)).unwrap();
        handle.apply_impulse(Vec3::X * 100.0).unwrap();
        world.step(DT).unwrap();
        let (v, w) = (velocity(&world, body), spin(&world, body));
        assert_eq!((v.x, w.y, w.z), (0.0, 0.0, 0.0));
        assert_eq!(position(&world, body).x, 0.0);
    }
    assert!(position(&world, body).z > 1.0 && spin(&world, body).x.abs() < 100.0, "the free axes move");
    let rotation = world.body(body).unwrap().rotation();
    assert!(rotation.y.abs() < 1e-5 && rotation.z.abs() < 1e-5, "{rotation}");
}

/// A body locked in rotation is heavy in its own right: an off-centre push moves it straight.
#[test]
fn a_body_that_cannot_turn_goes_straight() {
    let mut world = weightless();
    let body = BodyDefinition { locked_axes: LockedAxes::ROTATION, ..BodyDefinition::dynamic() };
    let body = add(&mut world, &body, &ShapeDefinition::new(cube(0.5)));
    let bullet = BodyDefinition::dynamic().at(Vec3::new(-3.0, 0.4, 0.0)).moving(Vec3::X * 10.0, Vec3::ZERO);
    let ball = add(&mut world, &bullet, &ShapeDefinition::new(sphere(0.2)).friction(0.0));
    run(&mut world, 1.0);
    assert_eq!(world.body(body).unwrap().rotation(), arbiter3d::math::Quat::IDENTITY);
    let (m1, m2) = (world.body(body).unwrap().mass(), world.body(ball).unwrap().mass());
    assert_relative(velocity(&world, body).x, m2 * 10.0 / (m1 + m2), 1e-3, "speed after a plastic hit");
}

/// Mass from density: the sum over the shapes, about their common centre (parallel axes).
#[test]
fn mass_is_the_sum_over_the_shapes() {
    let mut world = weightless();
    let dumbbell = world.add_body(&BodyDefinition::dynamic().at(Vec3::new(1.0, 2.0, 3.0))).unwrap();
    let (a, b) = (Vec3::new(1.0, 0.0, 0.0), Vec3::new(-2.0, 0.0, 0.0));
    world.add_shape(dumbbell, &ShapeDefinition::new(sphere(0.5)).density(600.0).at(a)).unwrap();
    let heavy = world.add_shape(dumbbell, &ShapeDefinition::new(cube(0.25)).density(800.0).at(b)).unwrap();
    let (m1, m2) = (600.0 * 4.0 / 3.0 * std::f32::consts::PI * 0.125, 100.0);
    let center = (m1 * 1.0 - m2 * 2.0) / (m1 + m2);
    let body = world.body(dumbbell).unwrap();
    let properties = body.mass_properties();
    assert_relative(body.mass(), m1 + m2, 1e-5, "mass");
    assert!(body.center_of_mass().distance(Vec3::new(1.0 + center, 2.0, 3.0)) < 1e-5);
    let own = 0.4 * m1 * 0.25 + m2 / 6.0 * 0.25;
    let levers = m1 * (1.0 - center) * (1.0 - center) + m2 * (2.0 + center) * (2.0 + center);
    assert_relative(properties.inertia.xx, own, 1e-4, "about the axis through both");
    assert_relative(properties.inertia.yy, own + levers, 1e-4, "about an axis across");
    world.remove_shape(heavy).unwrap();
    assert_relative(world.body(dumbbell).unwrap().mass(), m1, 1e-5, "mass without the second shape");
    assert!(world.body(dumbbell).unwrap().center_of_mass().distance(Vec3::new(2.0, 2.0, 3.0)) < 1e-5);
}

/// A body turns about its centre of mass, wherever its origin is.
#[test]
fn a_body_turns_about_its_center_of_mass() {
    let mut world = weightless();
    let spinning = BodyDefinition::dynamic().moving(Vec3::ZERO, Vec3::Z * 3.0);
    let body = world.add_body(&spinning).unwrap();
    world.add_shape(body, &ShapeDefinition::new(sphere(0.5)).at(Vec3::new(2.0, 0.0, 0.0))).unwrap();
    for _ in 0..120 {
        world.step(DT).unwrap();
        let body = world.body(body).unwrap();
        assert!(body.center_of_mass().distance(Vec3::X * 2.0) < 1e-4, "{}", body.center_of_mass());
        assert_near(body.position().distance(Vec3::X * 2.0), 2.0, 1e-4, "radius of the origin's circle");
    }
}

/// A given mass overrules the shapes, and counts for impulses; taking it back restores theirs.
#[test]
fn a_given_mass_overrules_the_shapes() {
    let mut world = weightless();
    let given =
        MassProperties { mass: 2.0, center: Vec3::Y * 0.5, inertia: SymmetricMat3::diagonal(Vec3::new(1.0, 2.0, 3.0)) };
    let body = BodyDefinition { mass: Some(given), ..BodyDefinition::dynamic() };
    let body = add(&mut world, &body, &ShapeDefinition::new(cube(0.5)));
    world.body_mut(body).unwrap().apply_impulse_at(Vec3::new(4.0, 0.0, 0.0), Vec3::ZERO).unwrap();
    assert_eq!(velocity(&world, body), Vec3::X * 2.0);
    // r × J = (0, −0.5, 0) × (4, 0, 0) = (0, 0, 2), over 3 kg m².
    assert!(spin(&world, body).distance(Vec3::Z * (2.0 / 3.0)) < 1e-6);
    world.body_mut(body).unwrap().set_mass(None).unwrap();
    assert_relative(world.body(body).unwrap().mass(), 1000.0, 1e-6, "mass by density");
    world.body_mut(body).unwrap().set_mass(Some(given)).unwrap();
    assert_eq!(world.body(body).unwrap().mass_properties(), given);
}

/// A kinematic body moves at its velocity, exactly, and nothing stops it.
#[test]
fn a_kinematic_body_moves_as_told() {
    let mut world = sleepless();
    let body = BodyDefinition::kinematic().moving(Vec3::new(0.5, 0.0, 0.0), Vec3::Y * 0.5);
    let platform = add(&mut world, &body, &ShapeDefinition::new(cuboid(1.0, 0.2, 1.0)));
    let wall = BodyDefinition::fixed().at(Vec3::X * 2.0);
    add(&mut world, &wall, &ShapeDefinition::new(cube(0.5)));
    run(&mut world, 4.0);
    assert!(position(&world, platform).distance(Vec3::X * 2.0) < 1e-4, "{}", position(&world, platform));
    let expected = turn(Vec3::Y, 2.0_f32.to_degrees());
    assert!(world.body(platform).unwrap().rotation().dot(expected).abs() > 1.0 - 1e-6);
}

/// In a hollow box without gravity, a thousand collisions among all and with the box keep the total momentum to rounding.
#[test]
fn momentum_is_kept_through_a_thousand_collisions() {
    let mut world = weightless();
    let shell = world.add_body(&BodyDefinition::dynamic()).unwrap();
    for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
        let half = Vec3::splat(3.2) - axis * 3.0;
        for side in [-3.2, 3.2] {
            let wall = ShapeDefinition::new(cuboid(half.x, half.y, half.z)).at(axis * side);
            world.add_shape(shell, &wall.density(200.0).restitution(1.0).friction(0.3)).unwrap();
        }
    }
    let mut random = Random(7);
    for at in 0..64 {
        let place = Vec3::new((at % 4) as f32, (at / 4 % 4) as f32, (at / 16) as f32) - Vec3::splat(1.5);
        let body = BodyDefinition::dynamic().at(place * 1.2).rotated(random.rotation());
        let shape = ShapeDefinition::new(random.shape()).restitution(0.9);
        add(&mut world, &body.moving(random.vector(5.0), random.vector(3.0)), &shape);
    }
    let start = world.linear_momentum();
    let scale: f64 = world
        .bodies()
        .skip(1)
        .map(|id| world.body(id).unwrap())
        .map(|body| f64::from(body.mass() * body.linear_velocity().length()))
        .sum();
    let (mut collisions, mut steps) = (0, 0);
    while collisions < 1000 {
        world.step(DT).unwrap();
        collisions += world.drain_begin_events().count();
        steps += 1;
        assert!(steps < 3000, "only {collisions} collisions");
    }
    let drift = difference(world.linear_momentum(), start) / scale;
    println!("momentum: {collisions} collisions in {steps} steps, drift {drift:e} of Σ m|v|");
    assert!(drift < 1e-5, "momentum changed by {drift:e} of Σ m|v|");
    let lost = world.bodies().skip(2).filter(|&id| (position(&world, id) - position(&world, shell)).length() > 7.0);
    assert_eq!(lost.count(), 0, "nothing left the box");
}

/// The pose that the body reports is that of its frame, through all of it.
#[test]
fn poses_agree() {
    let mut world = weightless();
    let mut random = Random(3);
    let body = BodyDefinition::dynamic().at(random.vector(5.0)).rotated(random.rotation());
    let body = body.moving(random.vector(3.0), random.vector(3.0));
    let id = world.add_body(&body).unwrap();
    let shape = ShapeDefinition::new(cube(0.3)).at(Vec3::new(1.0, 2.0, 3.0)).rotated(random.rotation());
    let shape = world.add_shape(id, &shape).unwrap();
    run(&mut world, 1.0);
    let body = world.body(id).unwrap();
    let pose: Pose = body.pose();
    assert_eq!(pose.position, body.position());
    let corner = world.shape(shape).unwrap().world_pose().position;
    assert!(corner.distance(pose.transform_point(Vec3::new(1.0, 2.0, 3.0))) < 1e-6);
    // One shape: the centre of mass is its own.
    assert!(corner.distance(body.center_of_mass()) < 1e-5);
    let speed = body.velocity_at(body.center_of_mass() + Vec3::X);
    assert!(speed.distance(body.linear_velocity() + body.angular_velocity().cross(Vec3::X)) < 1e-5);
}
