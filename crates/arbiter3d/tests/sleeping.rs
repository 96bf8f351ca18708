//! Sleeping and waking.

mod common;

use arbiter3d::math::Vec3;
use arbiter3d::{BodyDefinition, BodyId, BodyKind, ShapeDefinition, World, WorldSettings};
use common::*;

/// Something done to a body.
type Change = fn(&mut World, BodyId);

fn awake(world: &World, body: BodyId) -> bool {
    world.body(body).unwrap().is_awake()
}

/// A base and two boxes on it; all touch and sleep after a second or so.
fn stack(kind: BodyKind) -> (World, [BodyId; 3]) {
    let mut world = world();
    let base = BodyDefinition { kind, ..BodyDefinition::dynamic() }.at(Vec3::Y * -1.0);
    let base = add(&mut world, &base, &ShapeDefinition::new(cuboid(5.0, 1.0, 5.0)));
    let middle = drop_shape(&mut world, &cube(0.5), Vec3::Y * 0.5);
    let top = drop_shape(&mut world, &cube(0.5), Vec3::Y * 1.5);
    run(&mut world, 3.0);
    (world, [base, middle, top])
}

/// Static bodies are never awake, whatever is done to them.
#[test]
fn a_static_body_is_never_awake() {
    let mut world = world();
    let fixed = add(&mut world, &BodyDefinition::fixed(), &ShapeDefinition::new(cube(0.5)));
    assert!(!awake(&world, fixed));
    world.body_mut(fixed).unwrap().wake();
    assert!(!awake(&world, fixed));
    world.body_mut(fixed).unwrap().set_position(Vec3::X).unwrap();
    assert!(!awake(&world, fixed));
    world.step(DT).unwrap();
    assert!(!awake(&world, fixed) && position(&world, fixed) == Vec3::X);
}

/// A body at rest sleeps after the time that the settings say, counted anew after each waking.
#[test]
fn a_body_sleeps_after_its_time() {
    for time_to_sleep in [0.5, 3.0] {
        let settings = WorldSettings { time_to_sleep, gravity: Vec3::ZERO, ..WorldSettings::default() };
        let mut world = World::new(settings).unwrap();
        let body = drop_shape(&mut world, &cube(0.5), Vec3::ZERO);
        for _ in 0..2 {
            run(&mut world, time_to_sleep - 0.1);
            assert!(awake(&world, body), "awake before {time_to_sleep} s");
            run(&mut world, 0.2);
            assert!(!awake(&world, body), "asleep after {time_to_sleep} s");
            world.body_mut(body).unwrap().wake();
            assert!(awake(&world, body));
        }
    }
}

/// The speed of the surface counts, not that of a sphere around the body: a log of 20 m that rolls about its own axis
/// with 0.03 m/s at its bark sleeps, the same spin end over end (1 m/s at the ends) keeps it awake.
#[test]
fn a_long_body_that_rolls_slowly_sleeps() {
    for (spin, sleeps) in [(Vec3::X * 0.1, true), (Vec3::Y * 0.1, false)] {
        let mut world = World::new(WorldSettings { gravity: Vec3::ZERO, ..WorldSettings::default() }).unwrap();
        let log = world.add_body(&BodyDefinition { angular_velocity: spin, ..BodyDefinition::dynamic() }).unwrap();
        for i in 0..20_u8 {
            let at = Vec3::new(f32::from(i) - 9.5, 0.0, 0.0);
            world.add_shape(log, &ShapeDefinition::new(cuboid(0.5, 0.2, 0.2)).at(at)).unwrap();
        }
        run(&mut world, 1.0);
        assert_eq!(awake(&world, log), !sleeps, "spin {spin}");
    }
}

/// A moving body does not sleep, however long; one that is slower than the sleep speed does.
#[test]
fn speed_keeps_awake() {
    let mut world = World::new(WorldSettings { gravity: Vec3::ZERO, ..WorldSettings::default() }).unwrap();
    let moving = |at: f32, v: Vec3, w: Vec3| BodyDefinition::dynamic().at(Vec3::Y * at).moving(v, w);
    let shape = ShapeDefinition::new(cube(0.5));
    let fast = add(&mut world, &moving(0.0, Vec3::X * 0.1, Vec3::ZERO), &shape);
    let slow = add(&mut world, &moving(5.0, Vec3::X * 0.01, Vec3::ZERO), &shape);
    let spinning = add(&mut world, &moving(10.0, Vec3::ZERO, Vec3::Y * 0.2), &shape);
    run(&mut world, 5.0);
    assert_eq!((awake(&world, fast), awake(&world, slow), awake(&world, spinning)), (true, false, true));
    assert_eq!(velocity(&world, slow), Vec3::ZERO, "sleepers have no velocity");
    assert_near(position(&world, fast).x, 0.5, 1e-3, "way of the one that is awake");
}

/// Bodies that may not sleep keep their whole island awake.
#[test]
fn one_sleepless_body_keeps_its_island_awake() {
    let (mut world, [_, middle, top]) = stack(BodyKind::Static);
    assert!(!awake(&world, middle) && !awake(&world, top));
    world.body_mut(top).unwrap().set_can_sleep(false);
    run(&mut world, 3.0);
    assert!(awake(&world, middle) && awake(&world, top));
    world.body_mut(top).unwrap().set_can_sleep(true);
    run(&mut world, 2.0);
    assert!(!awake(&world, middle) && !awake(&world, top));
}

/// Waking one wakes its island; it sleeps again when it has rested.
#[test]
fn waking_one_wakes_the_island() {
    let (mut world, [base, middle, top]) = stack(BodyKind::Static);
    assert!(!awake(&world, middle) && !awake(&world, top), "asleep after 3 s");
    world.body_mut(middle).unwrap().wake();
    world.step(DT).unwrap();
    assert!(awake(&world, middle) && awake(&world, top) && !awake(&world, base));
    run(&mut world, 2.0);
    assert!(!awake(&world, middle) && !awake(&world, top), "asleep again");
}

/// Removing what a body stands on wakes it, and it falls.
#[test]
fn removing_the_middle_wakes_the_top() {
    let (mut world, [_, middle, top]) = stack(BodyKind::Static);
    world.remove_body(middle).unwrap();
    run(&mut world, 1.0);
    assert_near(position(&world, top).y, 0.5, 0.01, "height of what stood on top");
}

/// So does removing its shape, disabling the body, or moving the ground away.
#[test]
fn changes_below_wake_what_stands_there() {
    let cases: [(&str, Change, f32); 4] = [
        ("lower the base", |world, base| world.body_mut(base).unwrap().set_position(Vec3::Y * -1.5).unwrap(), 1.0),
        ("remove the base", |world, base| world.remove_body(base).unwrap(), -0.5),
        ("disable the base", |world, base| world.body_mut(base).unwrap().set_enabled(false).unwrap(), -0.5),
        (
            "remove its shape",
            |world, base| {
                let shape = world.body(base).unwrap().shapes()[0];
                world.remove_shape(shape).unwrap();
            },
            -0.5,
        ),
    ];
    for (what, change, highest) in cases {
        let (mut world, [base, middle, top]) = stack(BodyKind::Static);
        change(&mut world, base);
        run(&mut world, 1.0);
        assert!(position(&world, top).y < highest + 0.02, "{what}: top at {}", position(&world, top));
        assert!(position(&world, middle).y < highest - 0.9, "{what}: middle at {}", position(&world, middle));
        world.validate().unwrap();
    }
}

/// Forces, impulses, velocities and teleports wake; zeros do not.
#[test]
fn what_wakes_a_sleeper() {
    let wakes: [(&str, Change); 7] = [
        ("force", |world, id| world.body_mut(id).unwrap().apply_force(Vec3::X).unwrap()),
        ("torque", |world, id| world.body_mut(id).unwrap().apply_torque(Vec3::X).unwrap()),
        ("impulse", |world, id| world.body_mut(id).unwrap().apply_impulse(Vec3::X).unwrap()),
        ("velocity", |world, id| world.body_mut(id).unwrap().set_linear_velocity(Vec3::X).unwrap()),
        ("spin", |world, id| world.body_mut(id).unwrap().set_angular_velocity(Vec3::X).unwrap()),
        ("teleport", |world, id| world.body_mut(id).unwrap().set_position(Vec3::Y * 5.0).unwrap()),
        ("gravity scale", |world, id| world.body_mut(id).unwrap().set_gravity_scale(-1.0).unwrap()),
    ];
    for (what, change) in wakes {
        let (mut world, [_, middle, top]) = stack(BodyKind::Static);
        change(&mut world, top);
        assert!(awake(&world, top), "{what} wakes the body");
        world.step(DT).unwrap();
        assert!(awake(&world, middle), "{what} wakes the island");
    }
    let leaves: [(&str, Change); 5] = [
        ("no force", |world, id| world.body_mut(id).unwrap().apply_force(Vec3::ZERO).unwrap()),
        ("no impulse", |world, id| world.body_mut(id).unwrap().apply_impulse(Vec3::ZERO).unwrap()),
        ("no velocity", |world, id| world.body_mut(id).unwrap().set_linear_velocity(Vec3::ZERO).unwrap()),
        ("no spin", |world, id| world.body_mut(id).unwrap().set_angular_velocity(Vec3::ZERO).unwrap()),
        ("user data", |world, id| world.body_mut(id).unwrap().set_user_data(7)),
    ];
    for (what, change) in leaves {
        let (mut world, [_, _, top]) = stack(BodyKind::Static);
        change(&mut world, top);
        run(&mut world, 0.1);
        assert!(!awake(&world, top), "{what} does not wake");
    }
}

/// A change of gravity wakes everything.
#[test]
fn new_gravity_wakes_all() {
    let (mut world, [_, middle, top]) = stack(BodyKind::Static);
    world.set_settings(WorldSettings { gravity: Vec3::Y * 5.0, ..*world.settings() }).unwrap();
    run(&mut world, 1.0);
    for body in [middle, top] {
        assert!(position(&world, body).y > 2.0, "{}", position(&world, body));
    }
}

/// A thrown body wakes the island it hits, and only that one.
#[test]
fn a_hit_wakes_an_island() {
    let (mut world, [_, middle, top]) = stack(BodyKind::Static);
    let far = drop_shape(&mut world, &cube(0.5), Vec3::new(4.0, 0.5, 0.0));
    run(&mut world, 2.0);
    assert!(!awake(&world, far));
    let ball = BodyDefinition::dynamic().at(Vec3::new(-3.0, 1.5, 0.0)).moving(Vec3::X * 8.0, Vec3::ZERO);
    add(&mut world, &ball, &ShapeDefinition::new(sphere(0.3)));
    run(&mut world, 0.5);
    assert!(awake(&world, top) && awake(&world, middle) && !awake(&world, far));
}

/// A kinematic platform that starts to move wakes its riders and carries them; as long as it moves they stay awake.
#[test]
fn a_platform_wakes_and_carries_its_riders() {
    let (mut world, [base, middle, top]) = stack(BodyKind::Kinematic);
    assert!(!awake(&world, middle));
    world.body_mut(base).unwrap().set_linear_velocity(Vec3::new(0.3, 0.5, 0.0)).unwrap();
    assert!(awake(&world, middle) && awake(&world, top));
    run(&mut world, 4.0);
    assert!(awake(&world, top));
    assert_near(position(&world, base).y, 1.0, 1e-3, "height of the platform");
    for (rider, above) in [(middle, 1.5), (top, 2.5)] {
        let gap = position(&world, rider) - position(&world, base);
        assert!(gap.distance(Vec3::Y * above) < 0.02, "rider keeps its place: {gap}");
    }
    world.body_mut(base).unwrap().set_linear_velocity(Vec3::ZERO).unwrap();
    run(&mut world, 2.0);
    assert!(!awake(&world, top) && !awake(&world, base));
}

/// A platform slower than the sleep speed moves on all the same, and carries its rider (0.02 m/s for 4 s).
#[test]
fn a_slow_platform_neither_sleeps_nor_loses_its_rider() {
    let mut world = world();
    let base = BodyDefinition::kinematic().at(-Vec3::Y).moving(Vec3::X * 0.02, Vec3::ZERO);
    let base = add(&mut world, &base, &ShapeDefinition::new(cuboid(5.0, 1.0, 5.0)));
    let rider = drop_shape(&mut world, &cube(0.5), Vec3::Y * 0.5);
    let turning = BodyDefinition::kinematic().at(Vec3::X * 20.0).moving(Vec3::ZERO, Vec3::Y * 0.02);
    let turning = add(&mut world, &turning, &ShapeDefinition::new(cube(0.5)));
    run(&mut world, 4.0);
    assert_near(position(&world, base).x, 0.08, 1e-4, "way of the platform");
    assert_near(position(&world, rider).x, 0.08, 2e-3, "way of the rider");
    let expected = turn(Vec3::Y, 0.08_f32.to_degrees());
    assert!(world.body(turning).unwrap().rotation().dot(expected) > 1.0 - 1e-6);
}

/// An island that is put to sleep stops at once, all of it, and stays where it is until something wakes it.
#[test]
fn an_island_can_be_put_to_sleep() {
    let mut world = sleepless();
    world.set_settings(WorldSettings { allow_sleep: true, gravity: Vec3::ZERO, ..*world.settings() }).unwrap();
    let moving = |x: f32| BodyDefinition::dynamic().at(Vec3::X * x).moving(Vec3::Y * 3.0, Vec3::ZERO);
    let a = add(&mut world, &moving(0.0), &ShapeDefinition::new(cube(0.5)));
    let b = add(&mut world, &moving(0.999), &ShapeDefinition::new(cube(0.5)));
    let other = add(&mut world, &moving(5.0), &ShapeDefinition::new(cube(0.5)));
    run(&mut world, 0.1);
    world.body_mut(a).unwrap().sleep();
    assert!(!awake(&world, a) && !awake(&world, b) && awake(&world, other));
    let place = position(&world, b);
    run(&mut world, 1.0);
    assert_eq!((position(&world, b), velocity(&world, b)), (place, Vec3::ZERO));
    assert!(position(&world, other).y > 3.0);
    world.validate().unwrap();
}

/// A body may be added asleep, and wakes when it is hit.
#[test]
fn bodies_may_be_added_asleep() {
    let mut world = world();
    let floating = BodyDefinition { awake: false, ..BodyDefinition::dynamic().at(Vec3::Y * 3.0) };
    let floating = world.add_body(&floating).unwrap();
    assert!(!awake(&world, floating));
    run(&mut world, 1.0);
    assert_eq!(position(&world, floating), Vec3::Y * 3.0);
    assert_eq!((world.awake_count(), world.sleeping_count()), (0, 1));
    world.body_mut(floating).unwrap().wake();
    run(&mut world, 1.0);
    assert!(position(&world, floating).y < 0.0);
}

/// A sleeping world costs nothing and changes nothing: its hash stays.
#[test]
fn a_sleeping_world_stays_as_it_is() {
    let (mut world, _) = stack(BodyKind::Static);
    assert_eq!(world.awake_count(), 0);
    let (hash, contacts) = (world.hash(), world.contact_count());
    run(&mut world, 5.0);
    assert_eq!((world.hash(), world.contact_count()), (hash, contacts));
    assert!(contacts >= 8, "contacts of sleepers are still there: {contacts}");
}

/// With sleep off nothing sleeps, and switching it off wakes all.
#[test]
fn sleep_can_be_switched_off() {
    let (mut world, [_, middle, top]) = stack(BodyKind::Static);
    world.set_settings(WorldSettings { allow_sleep: false, ..*world.settings() }).unwrap();
    run(&mut world, 3.0);
    assert!(awake(&world, middle) && awake(&world, top));
}
