//! Bullets: bodies that meet whatever moves, and lose no time when they bounce.

mod common;

use arbiter3d::math::Vec3;
use arbiter3d::{BodyDefinition, BodyId, LockedAxes, Shape, ShapeDefinition, World, WorldSettings};
use common::*;

fn bullet(position: Vec3, velocity: Vec3) -> BodyDefinition {
    BodyDefinition { bullet: true, ..BodyDefinition::dynamic().at(position).moving(velocity, Vec3::ZERO) }
}

fn momentum(world: &World, bodies: &[BodyId]) -> Vec3 {
    bodies.iter().map(|&id| world.body(id).unwrap().linear_velocity() * world.body(id).unwrap().mass()).sum()
}

/// Two bullets of 5 cm, head on at 400 m/s each, at 200 phases of the step and up to a millimetre beside each other: they
/// meet, never change sides, share their momentum, and part with half their speed.
#[test]
fn bullets_never_pass_through_each_other() {
    for shape in [sphere(0.05), cube(0.05)] {
        let mut world = weightless();
        let mut random = Random(80);
        for round in 0..200 {
            let phase = 13.4 * round as f32 / 200.0;
            let beside = Vec3::new(0.0, random.range(-1e-3, 1e-3), random.range(-1e-3, 1e-3));
            let surface = ShapeDefinition::new(shape.clone()).restitution(0.5).friction(0.0);
            let left = add(&mut world, &bullet(Vec3::X * (-3.0 - phase), Vec3::X * 400.0), &surface);
            let right = add(&mut world, &bullet(Vec3::X * 3.0 + beside, Vec3::X * -400.0), &surface);
            let mut impacts = 0;
            for step in 0..6 {
                world.step(DT).unwrap();
                impacts += world.impacts().len();
                let (l, r) = (position(&world, left).x, position(&world, right).x);
                assert!(r - l > 0.099, "round {round}, step {step}: at {l} and {r}");
            }
            assert_eq!(impacts, 1, "round {round}");
            let mass = world.body(left).unwrap().mass();
            let sum = momentum(&world, &[left, right]).length();
            assert!(sum < 1e-4 * mass * 400.0, "round {round}: momentum {sum}");
            let speed = velocity(&world, right).x - velocity(&world, left).x;
            assert_relative(speed, 400.0, 0.01, "half the speed is given back");
            world.remove_body(left).unwrap();
            world.remove_body(right).unwrap();
        }
    }
}

/// The same up to 9 cm beside each other and at different speeds: all meet, and momentum and angular momentum about the
/// origin are kept.
#[test]
fn glancing_bullets_meet_and_keep_their_momentum() {
    let mut random = Random(81);
    for round in 0..100 {
        let mut world = weightless();
        let shape = ShapeDefinition::new([sphere(0.05), capsule(0.05, 0.05)][round % 2].clone()).restitution(0.8);
        let beside = Vec3::Y * random.range(-0.09, 0.09);
        let (fast, slow) = (random.range(200.0, 400.0), random.range(100.0, 400.0));
        let left = add(&mut world, &bullet(Vec3::X * -4.0, Vec3::X * fast), &shape);
        let right = add(&mut world, &bullet(Vec3::X * 4.0 + beside, Vec3::X * -slow), &shape);
        let spin = |world: &World| -> Vec3 {
            let of = |id: BodyId| {
                let body = world.body(id).unwrap();
                let own = body.inverse_inertia().inverse().unwrap().mul(body.angular_velocity());
                own + body.position().cross(body.linear_velocity()) * body.mass()
            };
            of(left) + of(right)
        };
        let (before, turning) = (momentum(&world, &[left, right]), spin(&world));
        let met = (0..4).any(|_| {
            world.step(DT).unwrap();
            !world.impacts().is_empty()
        });
        assert!(met, "round {round}: {beside}");
        // At once: in the next step, spin is limited.
        let scale = world.body(left).unwrap().mass() * 400.0;
        assert!((momentum(&world, &[left, right]) - before).length() < 1e-4 * scale, "round {round}");
        assert!((spin(&world) - turning).length() < 2e-3 * scale, "round {round}: {} {turning}", spin(&world));
    }
}

/// A bullet hits a plate of 4 mm that flies towards it, away from it or across: never comes out behind it.
#[test]
fn a_bullet_does_not_pass_a_moving_plate() {
    let mut random = Random(82);
    for round in 0..60 {
        let mut world = weightless();
        let plate = ShapeDefinition::new(cuboid(0.002, 1.0, 1.0)).density([100.0, 8000.0][round % 2]);
        let drift = random.vector(20.0);
        let plate = add(&mut world, &BodyDefinition::dynamic().moving(drift, Vec3::ZERO), &plate);
        let from = Vec3::new(random.range(-8.0, -3.0), 0.0, 0.0);
        let aim = drift * (-from.x / 400.0);
        let shot = bullet(from, Vec3::X * 400.0 + Vec3::new(0.0, aim.y, aim.z) * 30.0);
        let shot = add(&mut world, &shot, &ShapeDefinition::new(sphere(0.05)));
        let before = momentum(&world, &[plate, shot]);
        let mut met = 0;
        for step in 0..4 {
            world.step(DT).unwrap();
            met += world.impacts().len();
            let body = world.body(plate).unwrap();
            let seen = body.pose().inverse_transform_point(position(&world, shot));
            let beside = seen.y.abs() > 0.95 || seen.z.abs() > 0.95;
            assert!(seen.x < 0.0 || beside, "round {round}, step {step}: at {seen}");
        }
        assert!(met > 0, "round {round}");
        let kept = momentum(&world, &[plate, shot]) - before;
        assert!(kept.length() < 1e-4 * before.length(), "round {round}: {kept}");
    }
}

/// How far a ball flies between two walls in a step: from where it was to each impact, in the middle of a gap of a slop, and on.
fn way_in_step(from: Vec3, world: &World, ball: BodyId, radius: f32) -> f32 {
    let (mut at, mut way) = (from, 0.0);
    for impact in world.impacts() {
        let center =
            impact.point + if impact.bodies[0] == ball { -impact.normal } else { impact.normal } * (radius + 0.0026);
        way += (center - at).length();
        at = center;
    }
    way + (position(world, ball) - at).length()
}

/// An elastic ball between two walls for a minute: its speed stays, and its way is speed times time.
#[test]
fn an_elastic_bullet_loses_neither_speed_nor_time() {
    for (speed, apart) in [(100.0, 2.0), (300.0, 2.0), (300.0, 0.4), (37.0, 1.0)] {
        let mut world = weightless();
        for side in [-1.0, 1.0] {
            let wall = ShapeDefinition::new(cuboid(0.01, 5.0, 5.0)).at(Vec3::X * side * (0.5 * apart + 0.01));
            world.add_shape(BodyId::WORLD, &wall.restitution(1.0).friction(0.0)).unwrap();
        }
        let ball = ShapeDefinition::new(sphere(0.05)).restitution(1.0).friction(0.0);
        let ball = add(&mut world, &bullet(Vec3::X * 0.03, Vec3::X * speed), &ball);
        let (mut way, mut impacts) = (0.0_f64, 0);
        for _ in 0..3600 {
            let from = position(&world, ball);
            world.step(DT).unwrap();
            way += f64::from(way_in_step(from, &world, ball, 0.05));
            impacts += world.impacts().len();
            assert!(position(&world, ball).x.abs() < 0.5 * apart, "inside");
        }
        assert_relative(velocity(&world, ball).length(), speed, 0.01, "speed");
        assert_relative(way as f32, speed * 60.0, 0.01, "way");
        // From wall to wall less the ball and the slop at both sides.
        assert_relative(impacts as f32, speed * 60.0 / (apart - 0.11), 0.015, "bounces");
    }
}

/// Each impact begins an arbiter before it is solved and ends it once the bullet is away: a listener that makes the wall
/// elastic is heard in time, and there are as many ends as begins.
#[test]
fn impacts_begin_and_end_arbiters() {
    let mut world = weightless();
    for side in [-1.0, 1.0] {
        let wall = ShapeDefinition::new(cuboid(0.01, 5.0, 5.0)).at(Vec3::X * side);
        world.add_shape(BodyId::WORLD, &wall).unwrap();
    }
    world.on_begin_collide(Box::new(|context, id| {
        if let Some(arbiter) = context.arbiter_mut(id) {
            assert!(arbiter.data().contact_count() > 0);
            arbiter.data_mut().set_restitution(1.0).unwrap();
        }
    }));
    let ball = add(&mut world, &bullet(Vec3::ZERO, Vec3::X * 100.0), &ShapeDefinition::new(sphere(0.05)));
    let (mut begins, mut ends, mut impacts) = (0, 0, 0);
    for _ in 0..600 {
        world.step(DT).unwrap();
        begins += world.begin_events().len();
        ends += world.end_events().len();
        impacts += world.impacts().len();
        assert!(ends <= begins && begins <= ends + 2);
    }
    assert_relative(velocity(&world, ball).length(), 100.0, 0.01, "speed");
    assert!(impacts > 400, "{impacts}");
    // Two bounces off the same wall within a step belong to one arbiter.
    assert!(begins > 400 && begins <= impacts, "{begins} begins of {impacts} impacts");
    world.validate().unwrap();
}

/// A listener that removes the arbiter, or the bullet, is obeyed: the bullet passes, or is gone.
#[test]
fn listeners_may_remove_what_meets() {
    for gone in [false, true] {
        let mut world = weightless();
        let wall = ShapeDefinition::new(cuboid(0.01, 5.0, 5.0));
        world.add_shape(BodyId::WORLD, &wall).unwrap();
        let shot = add(&mut world, &bullet(Vec3::X * -1.0, Vec3::X * 200.0), &ShapeDefinition::new(sphere(0.05)));
        world.on_begin_collide(Box::new(move |context, id| {
            if gone {
                context.remove_body(shot).unwrap();
            } else {
                context.remove_arbiter(id).unwrap();
            }
        }));
        world.step(DT).unwrap();
        assert_eq!(world.body(shot).is_none(), gone);
        if !gone {
            assert_relative(position(&world, shot).x, -1.0 + 200.0 * DT, 1e-3, "it has passed");
        }
        world.step(DT).unwrap();
        world.validate().unwrap();
    }
}

/// Filters let bullets pass what they do not collide with.
#[test]
fn bullets_obey_filters() {
    for kind in 0..3 {
        let mut world = weightless();
        let wall = ShapeDefinition::new(cuboid(0.01, 5.0, 5.0));
        let nothing = arbiter3d::Filter { mask: 0, ..arbiter3d::Filter::default() };
        let wall = if kind == 0 { wall.filter(nothing) } else { wall };
        let fence = ShapeDefinition::new(cuboid(0.01, 5.0, 5.0)).at(Vec3::X * 0.5);
        world.add_shape(BodyId::WORLD, &if kind == 0 { fence.filter(nothing) } else { fence }).unwrap();
        world.add_shape(BodyId::WORLD, &wall).unwrap();
        match kind {
            1 => world.set_pair_filter(Some(Box::new(|_| false))),
            2 => world.set_contact_filter(Some(Box::new(|_, _| false))),
            _ => {}
        }
        let shot = add(&mut world, &bullet(Vec3::X * -1.0, Vec3::X * 200.0), &ShapeDefinition::new(sphere(0.05)));
        world.step(DT).unwrap();
        assert!(position(&world, shot).x > 2.0, "filter {kind}: {}", position(&world, shot));
    }
}

/// An ordinary body that a bullet throws at a wall is stopped there.
#[test]
fn what_a_bullet_hits_is_not_driven_through_a_wall() {
    let mut world = weightless();
    world.add_shape(BodyId::WORLD, &ShapeDefinition::new(cuboid(0.005, 5.0, 5.0)).at(Vec3::X)).unwrap();
    let ball = drop_shape(&mut world, &sphere(0.05), Vec3::ZERO);
    let heavy = ShapeDefinition::new(sphere(0.05)).density(50_000.0);
    let shot = add(&mut world, &bullet(Vec3::X * -2.0, Vec3::X * 300.0), &heavy);
    for step in 0..10 {
        world.step(DT).unwrap();
        for body in [ball, shot] {
            assert!(position(&world, body).x < 1.0, "step {step}: {}", position(&world, body));
        }
    }
}

/// A kinematic bullet is a bat: it hits resting balls that it would otherwise sweep over, and they leave at twice its
/// speed.
#[test]
fn a_kinematic_bullet_hits_what_it_sweeps_over() {
    for phase in 0..20 {
        let mut world = weightless();
        let bat = BodyDefinition::kinematic().at(Vec3::X * (-1.0 - 0.08 * phase as f32));
        let bat = BodyDefinition { bullet: true, ..bat.moving(Vec3::X * 100.0, Vec3::ZERO) };
        add(&mut world, &bat, &ShapeDefinition::new(cuboid(0.01, 0.5, 0.5)).restitution(1.0));
        let ball = drop_shape(&mut world, &sphere(0.05), Vec3::ZERO);
        for _ in 0..4 {
            world.step(DT).unwrap();
        }
        assert_relative(velocity(&world, ball).x, 200.0, 0.01, "twice the speed of the bat");
    }
}

/// Bullets that roll, slide and rest on a floor do so as other bodies do.
#[test]
fn bullets_slide_and_rest_like_other_bodies() {
    let mut world = world();
    floor(&mut world, 0.0);
    let slippery = |shape: Shape| ShapeDefinition::new(shape).friction(0.0);
    let bodies = [(sphere(0.2), 0.2), (cube(0.2), 0.2), (icosahedron(0.2), 0.2)].map(|(shape, height)| {
        let place = Vec3::new(-60.0, height, 3.0 * shape.reach() + 5.0 * shape.inner_radius());
        add(&mut world, &bullet(place, Vec3::X * 50.0), &slippery(shape))
    });
    let rest = add(&mut world, &bullet(Vec3::Y * 0.3, Vec3::ZERO), &ShapeDefinition::new(cube(0.3)));
    run(&mut world, 2.0);
    for body in bodies {
        assert_relative(velocity(&world, body).x, 50.0, 0.01, "nothing holds it");
        assert_relative(position(&world, body).x, 40.0, 0.02, "way");
    }
    assert!(!world.body(rest).unwrap().is_awake(), "a bullet may sleep");
}

/// A bullet against stacked crates: it is stopped, and nothing is left overlapping or not finite.
#[test]
fn a_bullet_breaks_a_stack() {
    let mut world = world();
    floor(&mut world, 0.5);
    let crates: Vec<BodyId> =
        (0..10).map(|at| drop_shape(&mut world, &cube(0.25), Vec3::new(0.0, 0.25 + 0.5 * at as f32, 0.0))).collect();
    run(&mut world, 1.0);
    let ball = ShapeDefinition::new(sphere(0.1)).density(7800.0);
    let shot = add(&mut world, &bullet(Vec3::new(-8.0, 1.4, 0.05), Vec3::X * 300.0), &ball);
    run(&mut world, 0.1);
    let fastest = crates.iter().map(|&id| velocity(&world, id).length()).fold(0.0, f32::max);
    assert!(fastest > 10.0, "{fastest}");
    assert!(velocity(&world, shot).length() < 290.0, "{}", velocity(&world, shot));
    run(&mut world, 3.0);
    assert!(crates.iter().all(|&id| position(&world, id).y > 0.2), "none is in the floor");
}

/// A million metres a second and a spin to match, ordinary bodies and bullets: nothing panics, nothing leaves the box.
#[test]
fn absurd_speeds_do_no_harm() {
    (83..91).for_each(fly_absurdly);
}

fn fly_absurdly(seed: u64) {
    let settings = WorldSettings { max_linear_speed: 1e7, gravity: Vec3::ZERO, ..WorldSettings::default() };
    let mut world = World::new(settings).unwrap();
    for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
        for side in [-1.0, 1.0] {
            let half = Vec3::splat(6.0) - axis * 5.0;
            let wall = ShapeDefinition::new(Shape::cuboid(half).unwrap()).at(axis * side * 6.0);
            world.add_shape(BodyId::WORLD, &wall.restitution(1.0)).unwrap();
        }
    }
    let mut random = Random(seed);
    let bodies: Vec<BodyId> = (0..40)
        .map(|at| {
            let body = BodyDefinition::dynamic().at(random.vector(4.0)).moving(random.vector(1e6), random.vector(1e6));
            let body = BodyDefinition { bullet: at % 2 == 0, ..body };
            add(&mut world, &body, &ShapeDefinition::new(random.shape()).restitution(0.5))
        })
        .collect();
    for step in 0..60 {
        world.step(DT).unwrap();
        for &body in &bodies {
            let place = position(&world, body);
            let bullet = world.body(body).unwrap().is_bullet();
            assert!(place.abs().max_element() < 6.0, "seed {seed}, step {step}: {place}, a bullet: {bullet}");
        }
    }
    world.validate().unwrap();
}

/// Locked axes stay locked in impacts.
#[test]
fn impacts_respect_locked_axes() {
    let mut world = weightless();
    let locked = LockedAxes::TRANSLATION_Y | LockedAxes::ROTATION;
    let post = BodyDefinition { locked_axes: locked, ..BodyDefinition::dynamic() };
    let post = add(&mut world, &post, &ShapeDefinition::new(cube(0.2)));
    let shot = bullet(Vec3::new(-3.0, 0.1, 0.1), Vec3::X * 200.0);
    add(&mut world, &shot, &ShapeDefinition::new(sphere(0.05)));
    run(&mut world, 0.2);
    let body = world.body(post).unwrap();
    assert!(body.linear_velocity().x > 0.1, "{}", body.linear_velocity());
    assert_eq!((body.position().y, body.angular_velocity()), (0.0, Vec3::ZERO));
}
