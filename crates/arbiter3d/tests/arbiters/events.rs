//! Listening: order, lists, edits that count at once, the material that arbiters start with and follow.

use crate::support::*;
use arbiter3d::math::Vec3;
use arbiter3d::*;

/// A rain of 60 mixed bodies on the floor, with all events of each step.
fn events_of_rain(threads: usize) -> Vec<(u32, ArbiterKey, Option<EndReason>)> {
    let mut world = World::new(WorldSettings { threads, ..WorldSettings::default() }).unwrap();
    add_floor(&mut world);
    for i in 0..60_u16 {
        let shape = match i % 3 {
            0 => Shape::sphere(0.5).unwrap(),
            1 => Shape::capsule(0.3, 0.3).unwrap(),
            _ => Shape::cuboid(Vec3::splat(0.4)).unwrap(),
        };
        let position = Vec3::new(f32::from(i % 4) * 0.9, 1.0 + f32::from(i / 8) * 1.2, f32::from(i / 4 % 2) * 0.9);
        let body = world.add_body(&BodyDefinition::dynamic().at(position)).unwrap();
        world.add_shape(body, &ShapeDefinition::new(shape).restitution(0.6)).unwrap();
    }
    let heard: Log<(ArbiterKey, Option<EndReason>)> = Log::default();
    let (begin, end) = (heard.clone(), heard.clone());
    world.on_begin_collide(Box::new(move |context, id| begin.push((context.arbiter(id).unwrap().key(), None))));
    world.on_end_collide(Box::new(move |_, event| end.push((event.key, Some(event.reason)))));
    let mut all = Vec::new();
    for step in 0..150 {
        world.step(DT).unwrap();
        let begins: Vec<ArbiterKey> = world.begin_events().iter().map(|event| event.key).collect();
        assert!(begins.is_sorted(), "begins come by key");
        let mut lists: Vec<_> = world.drain_begin_events().map(|event| (event.key, None)).collect();
        lists.extend(world.drain_end_events().map(|event| (event.key, Some(event.reason))));
        let mut closures = std::mem::take(&mut *heard.get());
        all.extend(closures.iter().map(|&(key, reason)| (step, key, reason)));
        // Lists and closures tell the same; closures hear ends of the narrow phase between the begins.
        let by_end = |entry: &(ArbiterKey, Option<EndReason>)| entry.1.is_some();
        closures.sort_by_key(by_end);
        assert_eq!(closures, lists);
    }
    all
}

#[test]
fn events_come_by_key_and_alike_for_any_number_of_threads() {
    let alone = events_of_rain(1);
    assert!(alone.len() > 300, "{} events", alone.len());
    assert!(alone.iter().any(|(_, _, reason)| *reason == Some(EndReason::Separated)));
    for threads in [2, 5] {
        assert_eq!(events_of_rain(threads), alone, "{threads} threads");
    }
}

#[test]
fn bodies_are_told_before_the_world_and_first_bodies_first() {
    let (mut world, (a, _), (b, _)) = touching_pair();
    let heard: Log<&str> = Log::default();
    let tell = |name: &'static str| {
        let log = heard.clone();
        Box::new(move |_: &mut StepContext<'_>, _: ArbiterId| log.push(name))
    };
    world.on_begin_collide(tell("world"));
    world.body_mut(b).unwrap().on_begin_collide(tell("body 2"));
    world.body_mut(a).unwrap().on_begin_collide(tell("body 1"));
    world.body_mut(a).unwrap().on_begin_collide(tell("body 1 again"));
    world.step(DT).unwrap();
    assert_eq!(heard.all(), ["body 1", "body 1 again", "body 2", "world"]);
}

#[test]
fn lists_hold_what_happened_until_the_next_step_and_between_steps() {
    let (mut world, _, (b, _)) = touching_pair();
    world.step(DT).unwrap();
    assert_eq!(world.begin_events().len(), 1);
    world.step(DT).unwrap();
    assert_eq!((world.begin_events().len(), world.end_events().len()), (0, 0));
    world.remove_body(b).unwrap();
    assert_eq!(world.end_events().len(), 1, "at once");
    world.step(DT).unwrap();
    assert_eq!(world.drain_end_events().count(), 1, "draining after each step sees what happened before it");
    assert_eq!(world.end_events().len(), 0, "drained");
    world.step(DT).unwrap();
    assert_eq!(world.end_events().len(), 0);
}

/// A ball that touches the floor's top while falling at 2 m/s without turning, no gravity, no friction. After one step,
/// its velocity.
fn velocity_after_begin(edit: impl Fn(&mut ContactData) + Send + Sync + 'static) -> Vec3 {
    let mut world = weightless();
    let floor = add_floor(&mut world);
    let ball = world.add_body(&BodyDefinition::dynamic().at(Vec3::new(0.0, 1.0, 0.0))).unwrap();
    let ice = Material { friction: 0.0, ..Material::default() };
    world.shape_mut(floor).unwrap().set_material(ice).unwrap();
    world.add_shape(ball, &ShapeDefinition::new(Shape::sphere(1.0).unwrap()).friction(0.0)).unwrap();
    world.body_mut(ball).unwrap().set_locked_axes(LockedAxes::ROTATION);
    world.body_mut(ball).unwrap().set_linear_velocity(Vec3::new(0.0, -2.0, 0.0)).unwrap();
    world.on_begin_collide(Box::new(move |context, id| edit(context.arbiter_mut(id).unwrap().data_mut())));
    world.step(DT).unwrap();
    assert_eq!(world.begin_events().len(), 1);
    world.body(ball).unwrap().linear_velocity()
}

#[test]
fn edits_while_begin_is_raised_count_in_that_very_solve() {
    assert_close(velocity_after_begin(|_| {}), Vec3::ZERO, 1e-4);
    // A normal tilted by 45° takes the velocity along it and leaves the rest: (0, −2) becomes (1, −1).
    let tilted = Vec3::new(0.5_f32.sqrt(), 0.5_f32.sqrt(), 0.0);
    assert_close(
        velocity_after_begin(move |data| data.set_normal(0, tilted).unwrap()),
        Vec3::new(1.0, -1.0, 0.0),
        1e-3,
    );
    // Nothing may change: the ball flies on.
    let fall = Vec3::new(0.0, -2.0, 0.0);
    assert_eq!(velocity_after_begin(|data| data.set_solve_mode(SolveMode::NONE)), fall);
    assert_eq!(velocity_after_begin(ContactData::clear), fall);
    // It bounces as if both were of rubber.
    let bounce = velocity_after_begin(|data| data.set_restitution(0.5).unwrap());
    assert_close(bounce, Vec3::new(0.0, 1.0, 0.0), 0.02);
    // A conveyor belt with friction takes it along.
    let belt = velocity_after_begin(|data| {
        data.set_friction(1.0).unwrap();
        data.set_tangent_velocity(Vec3::new(0.5, 0.0, 0.0)).unwrap();
    });
    assert!(belt.x > 0.1, "{belt}");
}

#[test]
fn edits_last_for_the_arbiters_life_and_no_longer() {
    let (mut world, (a, _), _) = touching_pair();
    world.step(DT).unwrap();
    let id = only_arbiter(&world, a).id();
    let data = world.arbiter_mut(id).unwrap().data_mut();
    data.set_friction(0.01).unwrap();
    data.set_restitution(0.02).unwrap();
    data.set_solve_mode(SolveMode::ANGULAR);
    for _ in 0..30 {
        world.step(DT).unwrap();
    }
    let data = only_arbiter(&world, a).data();
    assert_eq!((data.friction(), data.restitution(), data.solve_mode()), (0.01, 0.02, SolveMode::ANGULAR));
    world.remove_arbiter(id).unwrap();
    world.step(DT).unwrap();
    let data = only_arbiter(&world, a).data();
    assert_eq!((data.friction(), data.restitution(), data.solve_mode()), (0.5, 0.0, SolveMode::FULL), "a new life");
}

#[test]
fn a_changed_material_reaches_live_arbiters_but_for_what_was_overridden() {
    let (mut world, (a, sa), _) = touching_pair();
    world.step(DT).unwrap();
    let id = only_arbiter(&world, a).id();
    let material = |friction, restitution| Material { friction, restitution, ..Material::default() };
    world.shape_mut(sa).unwrap().set_material(material(0.9, 0.3)).unwrap();
    world.step(DT).unwrap();
    let data = world.arbiter_by_id(id).unwrap().data();
    assert_eq!((data.friction(), data.restitution()), (0.9, 0.3));
    world.arbiter_mut(id).unwrap().data_mut().set_friction(0.2).unwrap();
    world.shape_mut(sa).unwrap().set_material(material(0.8, 0.4)).unwrap();
    world.step(DT).unwrap();
    let data = world.arbiter_by_id(id).unwrap().data();
    assert_eq!((data.friction(), data.restitution()), (0.2, 0.4), "friction is the user's, restitution is not");
}

#[test]
fn other_combine_rules_are_an_option_of_the_material() {
    for (rule, friction) in [
        (CombineRule::Maximum, 0.8),
        (CombineRule::Average, 0.5),
        (CombineRule::GeometricMean, 0.4),
        (CombineRule::Multiply, 0.16),
        (CombineRule::Minimum, 0.2),
    ] {
        let (mut world, (a, sa), (_, sb)) = touching_pair();
        let material = |friction| Material { friction, friction_combine: rule, ..Material::default() };
        world.shape_mut(sa).unwrap().set_material(material(0.2)).unwrap();
        world.shape_mut(sb).unwrap().set_material(material(0.8)).unwrap();
        world.step(DT).unwrap();
        assert!((only_arbiter(&world, a).data().friction() - friction).abs() < 1e-6, "{rule:?}");
    }
}

/// Custom arbiters take the maximum over the shapes of both bodies, and follow changes too.
#[test]
fn custom_arbiters_take_the_materials_of_their_bodies() {
    let mut world = weightless();
    let (body, shape) = add_sphere(&mut world, Vec3::ZERO);
    let rough = Material { friction: 0.9, restitution: 0.25, ..Material::default() };
    world.shape_mut(shape).unwrap().set_material(rough).unwrap();
    let id = world.get_or_create_arbiter(ArbiterKey::new(500, 1), BodyId::WORLD, body).unwrap();
    let data = world.arbiter_by_id(id).unwrap().data();
    assert_eq!((data.friction(), data.restitution()), (0.9, 0.25));
    world.shape_mut(shape).unwrap().set_material(Material { friction: 0.1, ..rough }).unwrap();
    assert_eq!(world.arbiter_by_id(id).unwrap().data().friction(), 0.1);
    world.arbiter_mut(id).unwrap().data_mut().set_friction(0.3).unwrap();
    world.shape_mut(shape).unwrap().set_material(rough).unwrap();
    assert_eq!(world.arbiter_by_id(id).unwrap().data().friction(), 0.3);
    world.arbiter_mut(id).unwrap().data_mut().set_restitution(0.75).unwrap();
    world.shape_mut(shape).unwrap().set_material(Material { restitution: 0.5, ..rough }).unwrap();
    assert_eq!(world.arbiter_by_id(id).unwrap().data().restitution(), 0.75);
}

/// Sensors come by key too: 200 balls fall through as many sensors at once.
#[test]
fn sensor_events_come_alike_for_any_number_of_threads() {
    let run = |threads: usize| {
        let mut world = World::new(WorldSettings { threads, ..WorldSettings::default() }).unwrap();
        for i in 0..400_u16 {
            let at = Vec3::new(f32::from(i % 20) * 3.0, 0.0, f32::from(i / 20) * 3.0);
            let trap = ShapeDefinition::new(Shape::cuboid(Vec3::ONE).unwrap()).at(at).sensor();
            world.add_shape(BodyId::WORLD, &trap).unwrap();
            add(&mut world, at + Vec3::Y * 1.6, Shape::sphere(0.5).unwrap());
        }
        let mut all = Vec::new();
        for _ in 0..60 {
            world.step(DT).unwrap();
            all.push(world.drain_sensor_events().collect::<Vec<_>>());
        }
        all
    };
    let alone = run(1);
    let busy: Vec<_> = alone.iter().filter(|events| !events.is_empty()).collect();
    assert!(busy.len() == 2 && busy.iter().all(|events| events.len() == 400 && events.is_sorted()));
    for threads in [2, 5] {
        assert_eq!(run(threads), alone, "{threads} threads");
    }
}

/// Listeners and providers are told how long the step is.
#[test]
fn listeners_know_the_length_of_the_step() {
    let (mut world, ..) = touching_pair();
    let told = Log::default();
    let log = told.clone();
    world.on_begin_collide(Box::new(move |context, _| log.push(context.dt())));
    world.step(0.0125).unwrap();
    assert_eq!(told.all(), [0.0125]);
}

/// By key, not by age: custom arbiters made in falling order, and ends in another order than that of making.
#[test]
fn custom_arbiters_begin_and_end_in_the_order_of_their_keys() {
    let mut world = weightless();
    let body = add_bare(&mut world, Vec3::ZERO);
    let watch = Watch::body(&mut world, body);
    let keys = [(9, 1), (4, 7), (4, 2), (u64::MAX, 0), (0, 5)].map(|(a, b)| ArbiterKey::new(a, b));
    for key in keys {
        let contact = ContactPoint::new(Vec3::ZERO, Vec3::ZERO, Vec3::Y);
        world.register_contact_by_key(key, BodyId::WORLD, body, contact).unwrap();
    }
    let mut sorted = keys;
    sorted.sort_unstable();
    world.step(DT).unwrap();
    assert_eq!(world.begin_events().iter().map(|event| event.key).collect::<Vec<_>>(), sorted);
    assert_eq!(watch.begins.all().iter().map(|&id| world.arbiter_by_id(id).unwrap().key()).collect::<Vec<_>>(), sorted);
    world.remove_body(body).unwrap();
    assert_eq!(world.end_events().iter().map(|event| event.key).collect::<Vec<_>>(), sorted);
    assert_eq!(watch.ends.all().iter().map(|event| event.key).collect::<Vec<_>>(), sorted);
}
