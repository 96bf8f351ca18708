//! Custom arbiters and contact providers.

use crate::support::*;
use arbiter3d::math::Vec3;
use arbiter3d::*;

/// A floor at height zero for balls of one radius; tells the order in which providers are called.
struct BallFloor {
    name: u64,
    radius: f32,
    calls: Log<u64>,
}

impl ContactProvider for BallFloor {
    fn provide(&mut self, context: &mut StepContext<'_>) {
        self.calls.push(self.name);
        let bodies: Vec<BodyId> = context.awake_bodies().collect();
        for id in bodies {
            let position = context.body(id).unwrap().position();
            let bottom = position - Vec3::Y * self.radius;
            if bottom.y < 0.02 {
                let key = ArbiterKey::new(u64::MAX - self.name, u64::from(id.index()));
                let ground = Vec3::new(position.x, 0.0, position.z);
                let contact = ContactPoint::new(ground, bottom, Vec3::Y);
                context.register_contact_by_key(key, BodyId::WORLD, id, contact).unwrap();
            }
        }
    }
}

#[test]
fn providers_are_called_once_a_step_in_the_order_they_were_added() {
    let mut world = World::default();
    let calls = Log::default();
    for name in [3, 1, 2] {
        world.add_contact_provider(Box::new(BallFloor { name, radius: 0.5, calls: calls.clone() }));
    }
    for _ in 0..2 {
        world.step(DT).unwrap();
    }
    assert_eq!(calls.all(), [3, 1, 2, 3, 1, 2]);
}

/// What a provider feeds gives the same bits for any number of threads, and events by key.
#[test]
fn provided_contacts_are_deterministic() {
    let run = |threads: usize| {
        let mut world = World::new(WorldSettings { threads, ..WorldSettings::default() }).unwrap();
        for name in [2, 1] {
            world.add_contact_provider(Box::new(BallFloor { name, radius: 0.5, calls: Log::default() }));
        }
        for i in 0..50_u16 {
            let position =
                Vec3::new(f32::from(i % 5) * 0.8, 0.45 + f32::from(i / 10) * 0.9, f32::from(i / 5 % 2) * 0.8);
            add(&mut world, position, Shape::sphere(0.5).unwrap());
        }
        let mut keys = Vec::new();
        for _ in 0..60 {
            world.step(DT).unwrap();
            let begins: Vec<ArbiterKey> = world.begin_events().iter().map(|event| event.key).collect();
            assert!(begins.is_sorted());
            keys.extend(begins);
        }
        (world.hash(), keys)
    };
    let alone = run(1);
    assert!(alone.1.iter().any(|key| key.key1 > u64::MAX / 2) && alone.1.iter().any(|key| key.key1 < u64::MAX / 2));
    assert_eq!(run(2), alone);
    assert_eq!(run(5), alone);
}

/// A ball on a provided floor rests, is begun once, and keeps its arbiter; lifted off, the arbiter ends.
#[test]
fn a_provided_floor_begins_once_and_ends_once() {
    let mut world = World::default();
    world.add_contact_provider(Box::new(BallFloor { name: 0, radius: 0.5, calls: Log::default() }));
    let (ball, _) = add(&mut world, Vec3::new(0.0, 0.6, 0.0), Shape::sphere(0.5).unwrap());
    let watch = Watch::body(&mut world, ball);
    for _ in 0..60 {
        world.step(DT).unwrap();
    }
    assert_eq!(watch.counts(), (1, 0));
    assert!((world.body(ball).unwrap().position().y - 0.5).abs() < 0.006);
    world.body_mut(ball).unwrap().set_linear_velocity(Vec3::new(0.0, 5.0, 0.0)).unwrap();
    for _ in 0..3 {
        world.step(DT).unwrap();
    }
    assert_eq!((watch.counts(), watch.ends.all()[0].reason), ((1, 1), EndReason::Separated));
}

/// A custom arbiter that nobody feeds ends in the first step that finds it empty.
#[test]
fn an_arbiter_without_contacts_and_shapes_ends_in_its_first_step() {
    let mut world = weightless();
    let body = add_bare(&mut world, Vec3::ZERO);
    let watch = Watch::body(&mut world, body);
    world.get_or_create_arbiter(ArbiterKey::new(1, 2), BodyId::WORLD, body).unwrap();
    world.step(DT).unwrap();
    assert_eq!((watch.counts(), world.arbiter_count()), ((1, 1), 0));
}

/// Registered between steps, in a provider, in a listener: a contact does the same everywhere.
#[test]
fn contacts_may_be_registered_between_steps_in_providers_and_in_listeners() {
    /// Registers one contact in its first call.
    struct Once(Option<(BodyId, ContactPoint)>);
    impl ContactProvider for Once {
        fn provide(&mut self, context: &mut StepContext<'_>) {
            if let Some((body, contact)) = self.0.take() {
                context.register_contact_by_key(ArbiterKey::new(70, 70), BodyId::WORLD, body, contact).unwrap();
            }
        }
    }
    let contact = ContactPoint::new(Vec3::ZERO, Vec3::ZERO, Vec3::Y);
    for way in 0..3 {
        let (mut world, ..) = touching_pair();
        let body = add_bare(&mut world, Vec3::ZERO);
        world.body_mut(body).unwrap().set_linear_velocity(Vec3::new(0.0, -1.0, 0.0)).unwrap();
        match way {
            0 => drop(world.register_contact_by_key(ArbiterKey::new(70, 70), BodyId::WORLD, body, contact).unwrap()),
            1 => world.add_contact_provider(Box::new(Once(Some((body, contact))))),
            _ => world.on_begin_collide(Box::new(move |context, _| {
                context.register_contact_by_key(ArbiterKey::new(70, 70), BodyId::WORLD, body, contact).unwrap();
            })),
        }
        world.step(DT).unwrap();
        assert!(world.body(body).unwrap().linear_velocity().length() < 1e-4, "way {way}");
        assert_eq!(world.begin_events().iter().filter(|event| event.body2 == body).count(), 1);
    }
}

/// A key made of two shape ids before the shapes touch: the engine adopts that arbiter instead of making another.
#[test]
fn the_engine_adopts_an_arbiter_made_for_its_own_key() {
    let mut world = weightless();
    let (a, sa) = add_sphere(&mut world, Vec3::ZERO);
    let (b, sb) = add_sphere(&mut world, Vec3::new(1.5, 0.0, 0.0));
    let key = ArbiterKey::of_shapes(sa, sb);
    let id = world.get_or_create_arbiter(key, a, b).unwrap();
    world.arbiter_mut(id).unwrap().data_mut().set_friction(0.125).unwrap();
    let watch = Watch::world(&mut world);
    for _ in 0..3 {
        world.step(DT).unwrap();
        let arbiter = only_arbiter(&world, a);
        assert_eq!((arbiter.id(), arbiter.data().contact_count(), arbiter.data().friction()), (id, 1, 0.125));
    }
    assert!(world.arbiter_by_id(id).unwrap().is_of_shapes());
    world.body_mut(b).unwrap().set_position(Vec3::new(9.0, 0.0, 0.0)).unwrap();
    world.step(DT).unwrap();
    assert_eq!(watch.counts(), (1, 1));
    world.validate().unwrap();
}

/// Rolling resistance of the bodies' materials holds on custom arbiters as on the engine's own.
#[test]
fn custom_arbiters_resist_rolling() {
    let mut world = World::default();
    world.add_contact_provider(Box::new(BallFloor { name: 0, radius: 0.5, calls: Log::default() }));
    let ball = world.add_body(&BodyDefinition::dynamic().at(Vec3::new(0.0, 0.5, 0.0))).unwrap();
    world.add_shape(ball, &ShapeDefinition::new(Shape::sphere(0.5).unwrap()).rolling_resistance(0.05)).unwrap();
    let rolling = (Vec3::new(1.0, 0.0, 0.0), Vec3::new(0.0, 0.0, -2.0));
    world.body_mut(ball).unwrap().set_linear_velocity(rolling.0).unwrap();
    world.body_mut(ball).unwrap().set_angular_velocity(rolling.1).unwrap();
    for _ in 0..240 {
        world.step(DT).unwrap();
    }
    // The torque μ N r slows a rolling ball by μ g / (1 + 2/5) = 0.35 m/s².
    let rolled = world.body(ball).unwrap().position().x;
    assert!((rolled - 1.0 / (2.0 * 0.05 * 9.81 / 1.4)).abs() < 0.15, "{rolled}");
    assert!(world.body(ball).unwrap().linear_velocity().length() < 1e-3);
}
