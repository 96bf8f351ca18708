//! Sensors: they report who is inside, and push nobody.

mod common;

use arbiter3d::math::Vec3;
use arbiter3d::{BodyDefinition, BodyId, BodyKind, Filter, SensorEvent, ShapeDefinition, ShapeId, World};
use common::*;

fn shape_of(world: &World, body: BodyId) -> ShapeId {
    world.body(body).unwrap().shapes()[0]
}

/// A sensor box of 2 m about the origin on a static body.
fn gate(world: &mut World) -> ShapeId {
    let body = world.add_body(&BodyDefinition::fixed()).unwrap();
    world.add_shape(body, &ShapeDefinition::new(cube(1.0)).sensor()).unwrap()
}

/// What passes through is reported once in and once out, and is not pushed.
#[test]
fn a_visitor_is_reported_in_and_out() {
    for kind in [BodyKind::Dynamic, BodyKind::Kinematic] {
        let mut world = weightless();
        let sensor = gate(&mut world);
        let visitor = BodyDefinition { kind, ..BodyDefinition::dynamic() }.at(Vec3::X * -4.0);
        let visitor = add(&mut world, &visitor.moving(Vec3::X * 4.0, Vec3::ZERO), &ShapeDefinition::new(sphere(0.5)));
        let shape = shape_of(&world, visitor);
        let mut events: Vec<(usize, SensorEvent)> = Vec::new();
        for step in 0..120 {
            world.step(DT).unwrap();
            events.extend(world.drain_sensor_events().map(|event| (step, event)));
            let inside = position(&world, visitor).x.abs() < 1.4;
            if inside {
                assert_eq!(world.sensor_visitors(sensor), [shape], "{kind:?} inside at step {step}");
            }
        }
        assert_eq!(events.len(), 2, "{kind:?}: {events:?}");
        assert_eq!(events[0].1, SensorEvent { sensor, visitor: shape, begin: true });
        assert_eq!(events[1].1, SensorEvent { sensor, visitor: shape, begin: false });
        // It enters at x = −1.5 after 2.5 m, 37.5 steps, and leaves at 1.5 after 5.5 m, 82.5 steps.
        assert!((37..=39).contains(&events[0].0) && (82..=84).contains(&events[1].0), "{kind:?}: {events:?}");
        assert_eq!(velocity(&world, visitor), Vec3::X * 4.0, "it was not pushed");
        assert_eq!((world.arbiter_count(), world.sensor_visitors(sensor).len()), (0, 0));
    }
}

/// A moving sensor sees bodies of every kind.
#[test]
fn a_moving_sensor_sees_every_kind() {
    for kind in [BodyKind::Static, BodyKind::Kinematic, BodyKind::Dynamic] {
        let mut world = weightless();
        let scanner = BodyDefinition::dynamic().at(Vec3::X * -3.0).moving(Vec3::X * 3.0, Vec3::ZERO);
        let scanner = add(&mut world, &scanner, &ShapeDefinition::new(sphere(0.5)).sensor());
        let target = BodyDefinition { kind, ..BodyDefinition::dynamic() };
        let target = add(&mut world, &target, &ShapeDefinition::new(cube(0.5)));
        let (mut begun, mut ended) = (0, 0);
        for _ in 0..150 {
            world.step(DT).unwrap();
            for event in world.sensor_events() {
                assert_eq!((event.sensor, event.visitor), (shape_of(&world, scanner), shape_of(&world, target)));
                if event.begin { begun += 1 } else { ended += 1 }
            }
        }
        assert_eq!((begun, ended), (1, 1), "{kind:?}");
        assert_eq!((velocity(&world, target), velocity(&world, scanner)), (Vec3::ZERO, Vec3::X * 3.0));
    }
}

/// Sensors have no mass and do not see each other.
#[test]
fn sensors_weigh_nothing_and_do_not_see_each_other() {
    let mut world = weightless();
    let body = world.add_body(&BodyDefinition::dynamic()).unwrap();
    world.add_shape(body, &ShapeDefinition::new(cube(0.5))).unwrap();
    let mass = world.body(body).unwrap().mass();
    world.add_shape(body, &ShapeDefinition::new(cube(2.0)).sensor()).unwrap();
    assert_eq!(world.body(body).unwrap().mass(), mass);
    let other = world.add_body(&BodyDefinition::dynamic().at(Vec3::X * 3.0)).unwrap();
    world.add_shape(other, &ShapeDefinition::new(cube(2.0)).sensor()).unwrap();
    world.step(DT).unwrap();
    assert!(world.sensor_events().is_empty());
}

/// A visitor that rests and sleeps inside is still inside; its removal is reported.
#[test]
fn a_sleeping_visitor_stays_inside() {
    let mut world = world();
    let ground = floor(&mut world, 0.5);
    let sensor = gate(&mut world);
    let block = drop_shape(&mut world, &cube(0.3), Vec3::Y * 0.5);
    let shape = shape_of(&world, block);
    run(&mut world, 3.0);
    assert!(!world.body(block).unwrap().is_awake());
    assert_eq!(world.sensor_visitors(sensor), [ground, shape]);
    world.drain_sensor_events().count();
    world.remove_body(block).unwrap();
    let ends: Vec<SensorEvent> = world.drain_sensor_events().collect();
    assert_eq!(ends, [SensorEvent { sensor, visitor: shape, begin: false }]);
    assert_eq!(world.sensor_visitors(sensor), [ground]);
}

/// Steps the world once and returns its sensor events as (visitor, begin).
fn step_and_list(world: &mut World) -> Vec<(ShapeId, bool)> {
    world.step(DT).unwrap();
    world.drain_sensor_events().map(|event| (event.visitor, event.begin)).collect()
}

/// A sensor put around a body that sleeps sees it in the next step, without waking it; so does one that is moved there.
#[test]
fn a_sensor_sees_what_sleeps_and_does_not_wake_it() {
    for kind in [BodyKind::Static, BodyKind::Kinematic] {
        let mut world = world();
        let ground = floor(&mut world, 0.5);
        let block = drop_shape(&mut world, &cube(0.3), Vec3::Y * 0.3);
        let shape = shape_of(&world, block);
        run(&mut world, 3.0);
        let sleeps = |world: &World| !world.body(block).unwrap().is_awake();
        assert!(sleeps(&world));
        let sensor = BodyDefinition { kind, ..BodyDefinition::dynamic() };
        let body = add(&mut world, &sensor, &ShapeDefinition::new(cube(1.0)).sensor());
        let sensor = shape_of(&world, body);
        assert_eq!(step_and_list(&mut world), [(ground, true), (shape, true)], "{kind:?}");
        assert_eq!(world.sensor_visitors(sensor), [ground, shape]);
        assert!(sleeps(&world) && step_and_list(&mut world).is_empty());
        // Away by less than its box is fat, then far, then back.
        for (place, inside) in [(Vec3::X * 1.305, false), (Vec3::Y * 50.0, false), (Vec3::ZERO, true)] {
            world.body_mut(body).unwrap().set_position(place).unwrap();
            let events = step_and_list(&mut world);
            assert!(events.contains(&(shape, inside)) || place.y > 9.0, "{kind:?} at {place}: {events:?}");
            assert!(step_and_list(&mut world).is_empty());
            assert_eq!(world.sensor_visitors(sensor).contains(&shape), inside, "{kind:?} at {place}");
            assert_eq!(world.sensor_visitors(sensor).contains(&ground), place.y < 9.0, "{kind:?} at {place}");
            assert!(sleeps(&world), "{kind:?} at {place}");
        }
        world.validate().unwrap();
    }
}

/// A static sensor sees static shapes: those that stand there, those that come, are moved, turned off or filtered out.
#[test]
fn a_static_sensor_sees_what_is_static() {
    let mut world = world();
    let first = add(&mut world, &BodyDefinition::fixed().at(Vec3::X), &ShapeDefinition::new(cube(0.3)));
    let sensor = gate(&mut world);
    let shapes = [first, add(&mut world, &BodyDefinition::fixed(), &ShapeDefinition::new(sphere(0.3)))]
        .map(|body| shape_of(&world, body));
    let second = world.shape(shapes[1]).unwrap().body();
    assert_eq!(step_and_list(&mut world), [(shapes[0], true), (shapes[1], true)]);
    assert!(step_and_list(&mut world).is_empty());
    world.body_mut(second).unwrap().set_position(Vec3::Y * 9.0).unwrap();
    assert_eq!(step_and_list(&mut world), [(shapes[1], false)]);
    world.body_mut(second).unwrap().set_position(Vec3::Y * 0.5).unwrap();
    assert_eq!(step_and_list(&mut world), [(shapes[1], true)]);
    world.body_mut(first).unwrap().set_enabled(false).unwrap();
    assert_eq!(world.drain_sensor_events().map(|event| event.visitor).collect::<Vec<_>>(), [shapes[0]]);
    assert_eq!(world.sensor_visitors(sensor), [shapes[1]]);
    world.body_mut(first).unwrap().set_enabled(true).unwrap();
    assert_eq!(step_and_list(&mut world), [(shapes[0], true)]);
    world.shape_mut(shapes[0]).unwrap().set_filter(Filter { category: 0, ..Filter::default() });
    assert_eq!(step_and_list(&mut world), [(shapes[0], false)]);
    world.shape_mut(shapes[0]).unwrap().set_filter(Filter::default());
    assert_eq!(step_and_list(&mut world), [(shapes[0], true)]);
    world.set_pair_filter(Some(Box::new(|_| false)));
    assert_eq!(step_and_list(&mut world), [(shapes[0], false), (shapes[1], false)]);
    world.set_pair_filter(None);
    assert_eq!(step_and_list(&mut world), [(shapes[0], true), (shapes[1], true)]);
    // The sensor goes: its visitors are told to have left it.
    world.remove_shape(sensor).unwrap();
    let ends: Vec<SensorEvent> = world.drain_sensor_events().collect();
    assert!(ends.iter().all(|event| event.sensor == sensor && !event.begin));
    assert_eq!(ends.len(), 2);
    assert!(step_and_list(&mut world).is_empty());
    world.validate().unwrap();
}

/// Shapes of the sensor's own body are not seen, whatever its kind.
#[test]
fn a_sensor_does_not_see_its_own_body() {
    for kind in [BodyKind::Static, BodyKind::Kinematic, BodyKind::Dynamic] {
        let mut world = weightless();
        let body =
            add(&mut world, &BodyDefinition { kind, ..BodyDefinition::dynamic() }, &ShapeDefinition::new(cube(0.5)));
        let sensor = world.add_shape(body, &ShapeDefinition::new(cube(1.0)).sensor()).unwrap();
        run(&mut world, 0.2);
        assert!(world.sensor_visitors(sensor).is_empty(), "{kind:?}");
    }
}

/// A body that is placed into a sensor, or out of it, is reported in the next step.
#[test]
fn teleports_are_reported() {
    let mut world = weightless();
    let sensor = gate(&mut world);
    let ball = drop_shape(&mut world, &sphere(0.3), Vec3::X * 20.0);
    let shape = shape_of(&world, ball);
    assert!(step_and_list(&mut world).is_empty());
    for (place, begin) in [(Vec3::ZERO, true), (Vec3::X * 1.31, false), (Vec3::X * 1.2, true), (Vec3::Y * 30.0, false)]
    {
        world.body_mut(ball).unwrap().set_position(place).unwrap();
        assert_eq!(step_and_list(&mut world), [(shape, begin)], "{place}");
        assert_eq!(world.sensor_visitors(sensor).len(), usize::from(begin), "{place}");
    }
}

/// Filters hold for sensors as for all shapes.
#[test]
fn sensors_obey_filters() {
    let mut world = weightless();
    let only_two = Filter { category: 1, mask: 2, group: 0 };
    let body = world.add_body(&BodyDefinition::fixed()).unwrap();
    let sensor = world.add_shape(body, &ShapeDefinition::new(cube(1.0)).sensor().filter(only_two)).unwrap();
    drop_shape(&mut world, &sphere(0.2), Vec3::X * 0.5);
    let two = ShapeDefinition::new(sphere(0.2)).filter(Filter { category: 2, ..Filter::default() });
    let seen = add(&mut world, &BodyDefinition::dynamic().at(Vec3::X * -0.5), &two);
    world.step(DT).unwrap();
    assert_eq!(world.sensor_visitors(sensor), [shape_of(&world, seen)]);
}

/// A shape may become a sensor and back: what stood on it falls, and later stands.
#[test]
fn a_shape_may_become_a_sensor() {
    let mut world = sleepless();
    let ground = floor(&mut world, 0.5);
    let block = drop_shape(&mut world, &cube(0.5), Vec3::Y * 0.5);
    run(&mut world, 0.5);
    world.shape_mut(ground).unwrap().set_sensor(true);
    run(&mut world, 0.3);
    assert!(position(&world, block).y < 0.2 && world.sensor_visitors(ground).len() == 1);
    world.body_mut(block).unwrap().set_position(Vec3::Y * 0.6).unwrap();
    world.body_mut(block).unwrap().set_linear_velocity(Vec3::ZERO).unwrap();
    world.shape_mut(ground).unwrap().set_sensor(false);
    run(&mut world, 1.0);
    assert_near(position(&world, block).y, 0.5, 0.01, "height");
    assert!(world.sensor_visitors(ground).is_empty());
}

/// Events come in the order of their ids, whatever the number of threads.
#[test]
fn many_visitors_are_reported_in_order() {
    let mut lists = Vec::new();
    for threads in [1, 2, 5] {
        let settings = arbiter3d::WorldSettings { threads, ..*weightless().settings() };
        let mut world = World::new(settings).unwrap();
        let body = world.add_body(&BodyDefinition::fixed()).unwrap();
        world.add_shape(body, &ShapeDefinition::new(cuboid(30.0, 1.0, 30.0)).sensor()).unwrap();
        for at in 0..400 {
            let place = Vec3::new((at % 20) as f32 * 2.0 - 20.0, 1.8, (at / 20) as f32 * 2.0 - 20.0);
            let body = BodyDefinition::dynamic().at(place).moving(Vec3::Y * -30.0, Vec3::ZERO);
            add(&mut world, &body, &ShapeDefinition::new(sphere(0.5)));
        }
        let mut events = Vec::new();
        for _ in 0..15 {
            world.step(DT).unwrap();
            let new: Vec<SensorEvent> = world.drain_sensor_events().collect();
            assert!(new.windows(2).all(|pair| (pair[0].sensor, pair[0].visitor) < (pair[1].sensor, pair[1].visitor)));
            events.extend(new);
        }
        assert_eq!(events.iter().filter(|event| event.begin).count(), 400);
        lists.push(events.iter().map(|event| (event.visitor, event.begin)).collect::<Vec<_>>());
    }
    assert!(lists.windows(2).all(|pair| pair[0] == pair[1]));
}
