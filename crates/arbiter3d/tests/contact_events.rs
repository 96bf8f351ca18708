//! What shapes may ask for: hooks before the solve, events while they touch, and hits.

mod common;

use arbiter3d::math::Vec3;
use arbiter3d::{
    ArbiterKey, BodyDefinition, BodyId, ContactEvents, HitEvent, ShapeDefinition, ShapeId, World, WorldSettings,
};
use common::*;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

fn shape_of(world: &World, body: BodyId) -> ShapeId {
    world.body(body).unwrap().shapes()[0]
}

/// A list that listeners write and tests read.
type Log<T> = Arc<Mutex<Vec<T>>>;

/// The same list twice: to write and to read.
fn log<T>() -> (Log<T>, Log<T>) {
    let list = Arc::new(Mutex::new(Vec::new()));
    (list.clone(), list)
}

/// The hook is called in each step from the first one on, for what asks for it and nothing else, in the order of the
/// keys.
#[test]
fn the_hook_is_called_in_each_step_for_what_asks_for_it() {
    let mut world = sleepless();
    let ground = floor(&mut world, 0.5);
    let events = [ContactEvents::PRE_SOLVE, ContactEvents::NONE, ContactEvents::ALL, ContactEvents::HITS];
    let mut asking = Vec::new();
    for (at, events) in events.into_iter().enumerate().rev() {
        let shape = ShapeDefinition::new(cube(0.5)).events(events);
        let body = add(&mut world, &BodyDefinition::dynamic().at(Vec3::new(at as f32 * 3.0, 0.5, 0.0)), &shape);
        if events.contains(ContactEvents::PRE_SOLVE) {
            asking.push(ArbiterKey::of_shapes(ground, shape_of(&world, body)));
        }
    }
    let (seen, list) = log();
    world.on_pre_solve(Box::new(move |context, id| {
        seen.lock().unwrap().push(context.arbiter(id).unwrap().key());
    }));
    asking.sort_unstable();
    for step in 0..30 {
        world.step(DT).unwrap();
        let called = std::mem::take(&mut *list.lock().unwrap());
        assert_eq!(called, asking, "step {step}");
    }
}

/// Contacts that the hook drops are gone for that step alone: what it holds off falls, and stands once it lets go.
#[test]
fn contacts_dropped_before_the_solve_are_dropped_for_one_step() {
    let mut world = sleepless();
    floor(&mut world, 0.5);
    let shape = ShapeDefinition::new(cube(0.5)).events(ContactEvents::PRE_SOLVE);
    let block = add(&mut world, &BodyDefinition::dynamic().at(Vec3::Y * 0.5), &shape);
    let dropping = Arc::new(AtomicBool::new(false));
    let drops = dropping.clone();
    world.on_pre_solve(Box::new(move |context, id| {
        let arbiter = context.arbiter_mut(id).unwrap();
        assert_eq!(arbiter.data().contact_count(), 4, "each step shows the whole manifold");
        if drops.load(Ordering::Relaxed) {
            arbiter.data_mut().clear();
        }
    }));
    run(&mut world, 0.5);
    let before = position(&world, block).y;
    dropping.store(true, Ordering::Relaxed);
    run(&mut world, 4.0 * DT);
    let fallen = before - position(&world, block).y;
    // Free fall: g (4 dt)² / 2.
    assert_near(fallen, 0.5 * GRAVITY * (4.0 * DT) * (4.0 * DT), 0.002, "way of free fall");
    dropping.store(false, Ordering::Relaxed);
    run(&mut world, 1.0);
    assert_near(position(&world, block).y, 0.5, 0.01, "height once it is held again");
}

/// Edits of one step are not there in the next one: a gap that the hook takes a centimetre off holds a ball a
/// centimetre higher, however long it rests there, and normals are shown as they are.
#[test]
fn edits_of_a_step_are_neither_lost_nor_doubled() {
    let mut world = sleepless();
    floor(&mut world, 0.5);
    let shape = ShapeDefinition::new(sphere(0.5)).events(ContactEvents::PRE_SOLVE);
    let ball = add(&mut world, &BodyDefinition::dynamic().at(Vec3::Y * 0.5), &shape);
    let tilted = Vec3::new(0.0, 0.8, 0.6);
    world.on_pre_solve(Box::new(move |context, id| {
        let gaps: Vec<(usize, f32, Vec3)> = (context.world().contact_points(context.arbiter(id).unwrap()))
            .map(|(slot, point1, point2)| (slot, point1.y, point2))
            .collect();
        for (slot, ground, bottom) in gaps {
            let normal = context.arbiter(id).unwrap().data().contact(slot).unwrap().normal();
            assert_eq!(normal, Vec3::Y, "the normal is that of the floor");
            context.set_contact_separation(id, slot, bottom.y - ground - 0.01).unwrap();
            if context.dt() > 0.02 {
                context.arbiter_mut(id).unwrap().data_mut().set_normal(slot, tilted).unwrap();
            }
        }
    }));
    run(&mut world, 2.0);
    assert_near(position(&world, ball).y, 0.51, 0.001, "height over the raised floor");
    run(&mut world, 5.0);
    assert_near(position(&world, ball).y, 0.51, 0.001, "height later");
    // One longer step with a normal that leans: the ball is pushed along z; then no more.
    world.body_mut(ball).unwrap().set_linear_velocity(Vec3::Y * -1.0).unwrap();
    world.step(0.025).unwrap();
    let pushed = velocity(&world, ball).z;
    assert!(pushed > 0.1, "the leaning normal pushes sideways: {pushed} m/s");
    let ends = world.end_events().len();
    world.step(DT).unwrap();
    assert!(velocity(&world, ball).z <= pushed && ends == 0, "it counts once: {}", velocity(&world, ball).z);
}

/// Friction that the hook sets counts in that very step, and holds on.
#[test]
fn friction_set_before_the_solve_counts_at_once() {
    let mut world = sleepless();
    floor(&mut world, 0.5);
    let shape = ShapeDefinition::new(cuboid(0.5, 0.1, 0.5)).events(ContactEvents::PRE_SOLVE);
    let block = add(&mut world, &BodyDefinition::dynamic().at(Vec3::Y * 0.1), &shape);
    world.on_pre_solve(Box::new(|context, id| {
        let friction = if context.arbiter(id).unwrap().data().friction() > 0.25 { 0.2 } else { 0.1 };
        context.arbiter_mut(id).unwrap().data_mut().set_friction(friction).unwrap();
    }));
    run(&mut world, 0.5);
    world.body_mut(block).unwrap().set_linear_velocity(Vec3::X * 10.0).unwrap();
    run(&mut world, 1.0);
    assert_near(velocity(&world, block).x, 10.0 - 0.1 * GRAVITY, 0.05, "speed after a second");
}

/// A tower stands as well when its manifolds are made anew in each step, and falls asleep.
#[test]
fn a_tower_that_asks_for_hooks_stands() {
    let mut world = world();
    floor(&mut world, 0.5);
    let shape = ShapeDefinition::new(cube(0.5)).events(ContactEvents::PRE_SOLVE);
    let tower: Vec<BodyId> =
        (0..10).map(|at| add(&mut world, &BodyDefinition::dynamic().at(Vec3::Y * (at as f32 + 0.5)), &shape)).collect();
    run(&mut world, 10.0);
    let top = position(&world, tower[9]);
    assert!(top.distance(Vec3::Y * 9.5) < 0.06, "the top is at {top}");
    assert!(!world.body(tower[9]).unwrap().is_awake());
}

/// What sleeps is not asked about; the step that wakes it calls the hook again before it is solved.
#[test]
fn what_is_woken_in_a_step_is_shown_in_that_step() {
    let mut world = world();
    floor(&mut world, 0.5);
    let shape = ShapeDefinition::new(cube(0.5)).events(ContactEvents::ALL);
    let block = add(&mut world, &BodyDefinition::dynamic().at(Vec3::Y * 0.5), &shape);
    let (seen, list) = log();
    world.on_pre_solve(Box::new(move |_, id| seen.lock().unwrap().push(id)));
    run(&mut world, 3.0);
    assert!(!world.body(block).unwrap().is_awake());
    list.lock().unwrap().clear();
    run(&mut world, 0.5);
    assert!(list.lock().unwrap().is_empty() && world.persist_events().is_empty());
    let bullet = BodyDefinition::dynamic().at(Vec3::new(-1.0, 0.6, 0.0)).moving(Vec3::X * 10.0, Vec3::ZERO);
    add(&mut world, &bullet, &ShapeDefinition::new(sphere(0.2)));
    let mut steps = 0;
    while !world.body(block).unwrap().is_awake() {
        world.step(DT).unwrap();
        steps += 1;
        assert!(steps < 20);
    }
    assert_eq!(list.lock().unwrap().len(), 2, "the arbiter with the floor and that with the ball");
    assert_eq!(world.persist_events().len(), 1, "that with the floor has gone on");
}

/// An arbiter that asks for it is reported in each step but that of its begin, until it ends.
#[test]
fn what_goes_on_is_reported_in_each_step() {
    let mut world = sleepless();
    floor(&mut world, 0.5);
    drop_shape(&mut world, &cube(0.5), Vec3::new(3.0, 0.5, 0.0));
    let shape = ShapeDefinition::new(cube(0.5)).events(ContactEvents::PERSIST);
    let block = add(&mut world, &BodyDefinition::dynamic().at(Vec3::Y * 0.6), &shape);
    let (mut begun, mut steps) = (None, 0);
    for step in 0..60 {
        world.step(DT).unwrap();
        if let Some(id) = begun {
            let ids: Vec<_> = world.persist_events().iter().map(|event| (event.arbiter, event.body2)).collect();
            assert_eq!(ids, [(id, block)], "step {step}");
            steps += 1;
        } else {
            assert!(world.persist_events().is_empty(), "step {step}");
            begun = world.begin_events().iter().find(|event| event.body2 == block).map(|event| event.arbiter);
        }
    }
    assert!(steps > 40);
    world.body_mut(block).unwrap().set_position(Vec3::Y * 5.0).unwrap();
    world.drain_persist_events().count();
    world.step(DT).unwrap();
    assert!(world.persist_events().is_empty() && world.end_events().len() == 1);
}

/// Drops a body of a mass and returns its hits with the steps in which they came.
fn hits_of_fall(height: f32, restitution: f32, box_shaped: bool, radius: f32) -> (Vec<(usize, HitEvent)>, f32) {
    let mut world = sleepless();
    floor(&mut world, 0.5);
    let shape = if box_shaped { cuboid(radius, radius, radius) } else { sphere(radius) };
    let shape = ShapeDefinition::new(shape).restitution(restitution).events(ContactEvents::HITS);
    let body = add(&mut world, &BodyDefinition::dynamic().at(Vec3::new(1.0, height + radius, -2.0)), &shape);
    let mass = world.body(body).unwrap().mass();
    let mut hits = Vec::new();
    for step in 0..240 {
        let before = velocity(&world, body).y;
        world.step(DT).unwrap();
        hits.extend(world.hit_events().iter().map(|&hit| (step, hit)));
        if let Some(hit) = world.hit_events().first() {
            // Newton's second law over the step.
            let gained = mass * (velocity(&world, body).y - before + GRAVITY * DT);
            assert_relative(hit.impulse, gained, 0.001, "impulse");
        }
    }
    (hits, mass)
}

/// A ball that falls from `h` hits once, at √(2gh), with m v (1 + e); then again at the speed of each bounce, and never
/// while it rests.
#[test]
fn a_falling_ball_hits_with_the_speed_and_impulse_of_its_fall() {
    for height in [0.4, 1.0, 2.3, 5.0, 8.0] {
        for restitution in [0.0, 0.5] {
            for box_shaped in [false, true] {
                let (hits, mass) = hits_of_fall(height, restitution, box_shaped, 0.5);
                let mut speed = (2.0 * GRAVITY * height).sqrt();
                let what = format!("height {height}, restitution {restitution}, box {box_shaped}");
                assert!(!hits.is_empty(), "{what}: no hit");
                let (_, first) = hits[0];
                // The corners of a box share the blow nearly, not quite, alike.
                let off = first.point.distance(Vec3::new(1.0, 0.0, -2.0));
                assert!(off < if box_shaped { 0.05 } else { 0.01 }, "{what}: at {}", first.point);
                // From the blow to the end of the step the floor bears the weight as well.
                let rest = (hits[0].0 as f32 + 1.0) * DT - speed / GRAVITY;
                let impulse = mass * (speed * (1.0 + restitution) + GRAVITY * rest);
                // A box that came in deep in one step is pushed out by a little more.
                assert_relative(first.impulse, impulse, if box_shaped { 0.03 } else { 0.02 }, &what);
                assert!((first.normal - Vec3::Y).length() < 1e-3 && first.body1 == BodyId::WORLD, "{what}");
                let mut expected = Vec::new();
                while speed > 1.0 {
                    expected.push(speed);
                    speed *= restitution;
                }
                assert!(hits.len().abs_diff(expected.len()) <= usize::from(restitution > 0.0), "{what}: {hits:?}");
                for ((_, hit), speed) in hits.iter().zip(expected).take(3) {
                    println!("{what}: {} m/s ({speed}), {} N s", hit.speed, hit.impulse);
                    assert_relative(hit.speed, speed, 0.01, &what);
                    // For what is left of the step, the floor bears the weight too.
                    let (blow, weight) = (mass * speed * (1.0 + restitution), mass * GRAVITY * DT);
                    let range = 0.98 * blow..if box_shaped { 1.03 } else { 1.02 } * blow + weight;
                    assert!(range.contains(&hit.impulse), "{what}: {} N s, not {blow}", hit.impulse);
                }
            }
        }
    }
}

/// What is stopped by continuous collision hits with the speed that it had, once.
#[test]
fn a_bullet_hits_with_the_speed_that_it_had() {
    for speed in [50.0, 200.0, 700.0] {
        let mut world = weightless();
        floor(&mut world, 0.5);
        let shape = ShapeDefinition::new(sphere(0.05)).events(ContactEvents::HITS);
        let bullet = BodyDefinition::dynamic().at(Vec3::Y * 3.21).moving(Vec3::Y * -speed, Vec3::ZERO);
        let bullet = add(&mut world, &bullet, &shape);
        let mass = world.body(bullet).unwrap().mass();
        let mut hits = Vec::new();
        for _ in 0..30 {
            world.step(DT).unwrap();
            hits.extend(world.drain_hit_events());
        }
        assert_eq!(hits.len(), 1, "{hits:?}");
        assert_relative(hits[0].speed, speed, 0.001, "speed");
        assert_relative(hits[0].impulse, mass * speed, 0.02, "impulse");
        assert!(hits[0].point.length() < 0.01, "{}", hits[0].point);
    }
}

/// Two balls meet head on: the speed is the difference of theirs, the impulse that of the reduced mass.
#[test]
fn balls_hit_each_other_with_their_relative_speed() {
    let mut world = weightless();
    let shape = ShapeDefinition::new(sphere(0.5)).events(ContactEvents::HITS);
    let ball = |x: f32, v: f32| BodyDefinition::dynamic().at(Vec3::X * x).moving(Vec3::X * v, Vec3::ZERO);
    let a = add(&mut world, &ball(-2.0, 3.0), &shape.clone().density(500.0));
    let b = add(&mut world, &ball(2.0, -4.0), &shape);
    let masses = [a, b].map(|body| world.body(body).unwrap().mass());
    let (seen, list) = log();
    world.on_hit(Box::new(move |context, hit| {
        assert!(context.arbiter(hit.arbiter).is_some());
        seen.lock().unwrap().push(*hit);
    }));
    run(&mut world, 1.0);
    let hits = list.lock().unwrap().clone();
    assert_eq!(hits.len(), 1);
    assert_relative(hits[0].speed, 7.0, 0.001, "speed");
    assert_relative(hits[0].impulse, 7.0 * masses[0] * masses[1] / (masses[0] + masses[1]), 0.01, "impulse");
    // They have 3 m to go between their surfaces: the first one makes 3/7 of it.
    assert_near(hits[0].point.x, -1.5 + 3.0 * 3.0 / 7.0, 0.01, "place");
}

/// What rests, rolls or is leaned on raises no hits; below the threshold nothing does, and it follows the unit of
/// length.
#[test]
fn only_hits_above_the_threshold_count() {
    for (unit, threshold, expected) in [(1.0, 1.0, 1), (1.0, 3.0, 0), (1000.0, 1.0, 1), (1000.0, 3.0, 0), (1.0, 0.0, 1)]
    {
        let gravity = Vec3::Y * -GRAVITY * unit;
        let settings = WorldSettings {
            length_unit: unit,
            hit_speed_threshold: threshold,
            gravity,
            allow_sleep: false,
            ..WorldSettings::default()
        };
        let mut world = World::new(settings).unwrap();
        let ground = ShapeDefinition::new(cuboid(20.0 * unit, unit, 20.0 * unit)).at(Vec3::Y * -unit);
        world.add_shape(BodyId::WORLD, &ground).unwrap();
        let shape = ShapeDefinition::new(sphere(0.5 * unit)).events(ContactEvents::HITS);
        // A fall of 0.3 m ends at 2.43 m/s; it rolls on.
        let body = BodyDefinition::dynamic().at(Vec3::Y * 0.8 * unit).moving(Vec3::X * unit, Vec3::ZERO);
        add(&mut world, &body, &shape);
        let mut count = 0;
        for _ in 0..120 {
            world.step(DT).unwrap();
            count += world.hit_events().len();
        }
        assert_eq!(count, expected, "unit {unit}, threshold {threshold}");
    }
}

/// All events of a rain of bodies, by step.
fn events_of_rain(threads: usize) -> Vec<(u32, ArbiterKey, u32)> {
    let settings = WorldSettings { threads, ..WorldSettings::default() };
    let mut world = World::new(settings).unwrap();
    let ground = ShapeDefinition::new(cuboid(40.0, 1.0, 40.0)).events(ContactEvents::PERSIST).at(-Vec3::Y);
    world.add_shape(BodyId::WORLD, &ground).unwrap();
    let mut random = Random(7);
    for at in 0..600 {
        let place = Vec3::new((at % 12) as f32 - 6.0, (at / 144) as f32 * 1.2 + 2.0, (at / 12 % 12) as f32 - 6.0) * 1.1;
        let events = [ContactEvents::ALL, ContactEvents::HITS, ContactEvents::NONE][at % 3];
        let shape = ShapeDefinition::new(random.shape()).restitution(0.4).events(events);
        let body =
            BodyDefinition::dynamic().at(place).rotated(random.rotation()).moving(random.vector(3.0), Vec3::ZERO);
        add(&mut world, &body, &shape);
    }
    let (seen, list) = log();
    let hits = seen.clone();
    world.on_pre_solve(Box::new(move |context, id| {
        let arbiter = context.arbiter_mut(id).unwrap();
        let key = arbiter.key();
        arbiter.data_mut().set_friction(0.7).unwrap();
        seen.lock().unwrap().push((0, key, 0));
    }));
    world.on_hit(Box::new(move |_, hit| hits.lock().unwrap().push((1, hit.key, hit.impulse.to_bits()))));
    for step in 0..90 {
        world.step(DT).unwrap();
        assert!(world.hit_events().windows(2).all(|pair| pair[0].key < pair[1].key), "step {step}");
        assert!(world.persist_events().windows(2).all(|pair| pair[0].key < pair[1].key), "step {step}");
        let mut list = list.lock().unwrap();
        list.extend(world.hit_events().iter().map(|hit| (2, hit.key, hit.speed.to_bits())));
        list.extend(world.persist_events().iter().map(|event| (3, event.key, event.body2.index())));
    }
    let hash = world.hash();
    let mut events = std::mem::take(&mut *list.lock().unwrap());
    events.push((4, ArbiterKey::new(hash, 0), 0));
    events
}

/// Hooks and events come alike for any number of threads.
#[test]
fn events_come_alike_for_any_number_of_threads() {
    let reference = events_of_rain(1);
    for kind in 0..4 {
        let count = reference.iter().filter(|event| event.0 == kind).count();
        assert!(count > 100, "{count} events of kind {kind}");
    }
    for threads in [2, 5] {
        assert!(events_of_rain(threads) == reference, "{threads} threads");
    }
}

/// A shape may begin to ask while it touches, and cease.
#[test]
fn a_shape_may_ask_later() {
    let mut world = sleepless();
    let ground = floor(&mut world, 0.5);
    drop_shape(&mut world, &cube(0.5), Vec3::Y * 0.5);
    run(&mut world, 0.2);
    assert!(world.persist_events().is_empty());
    world.shape_mut(ground).unwrap().set_events(ContactEvents::PERSIST);
    world.step(DT).unwrap();
    assert_eq!(world.persist_events().len(), 1);
    assert_eq!(world.shape(ground).unwrap().events(), ContactEvents::PERSIST);
    world.shape_mut(ground).unwrap().set_events(ContactEvents::NONE);
    world.step(DT).unwrap();
    assert!(world.persist_events().is_empty());
}

/// Anything may be removed in the hooks: it takes effect, and nothing panics.
#[test]
fn anything_may_be_removed_in_the_hooks() {
    for before_solve in [true, false] {
        let mut world = sleepless();
        floor(&mut world, 0.5);
        let shape = ShapeDefinition::new(sphere(0.3)).events(ContactEvents::ALL);
        for at in 0..20 {
            add(&mut world, &BodyDefinition::dynamic().at(Vec3::new(at as f32, 2.0, 0.0)), &shape);
        }
        if before_solve {
            world.on_pre_solve(Box::new(|context, id| {
                let body = context.arbiter(id).unwrap().body2();
                context.remove_body(body).unwrap();
                context.remove_arbiter(id).unwrap();
            }));
        } else {
            world.on_hit(Box::new(|context, hit| context.remove_body(hit.body2).unwrap()));
        }
        run(&mut world, 2.0);
        world.validate().unwrap();
        assert_eq!(world.body_count(), 0, "all are gone");
    }
}
