//! Custom arbiters sleep and wake as the engine's own do.

use crate::support::*;
use arbiter3d::math::Vec3;
use arbiter3d::*;

/// Holds a body in the air with three contacts below it, on the world's own body or on another one.
fn prop_up(world: &mut World, key1: u64, below: BodyId, body: BodyId) -> ArbiterId {
    let center = world.body(body).unwrap().position();
    let key = ArbiterKey::new(key1, u64::from(body.index()));
    let mut id = None;
    for (x, z) in [(0.4, 0.0), (-0.3, 0.3), (-0.3, -0.3)] {
        let point = center + Vec3::new(x, -0.5, z);
        id = Some(world.register_contact_by_key(key, below, body, ContactPoint::new(point, point, Vec3::Y)).unwrap());
    }
    id.unwrap()
}

fn steps(world: &mut World, count: usize) {
    for _ in 0..count {
        world.step(DT).unwrap();
    }
}

fn awake(world: &World, body: BodyId) -> bool {
    world.body(body).unwrap().is_awake()
}

#[test]
fn a_body_on_custom_contacts_sleeps_and_keeps_them() {
    let mut world = World::default();
    let body = add_bare(&mut world, Vec3::new(0.0, 5.0, 0.0));
    let id = prop_up(&mut world, 900, BodyId::WORLD, body);
    let watch = Watch::body(&mut world, body);
    steps(&mut world, 120);
    assert!(!awake(&world, body));
    let before = *world.arbiter_by_id(id).unwrap().data();
    assert_eq!(before.contact_count(), 3);
    steps(&mut world, 300);
    assert_eq!(world.arbiter_by_id(id).unwrap().data(), &before, "asleep nothing changes");
    assert_eq!(watch.counts(), (1, 0), "sleep is no end");
    world.body_mut(body).unwrap().wake();
    steps(&mut world, 2);
    assert_eq!(world.arbiter_by_id(id).unwrap().data().contact_count(), 3);
    assert!((world.body(body).unwrap().position().y - 5.0).abs() < 0.01, "it stands on the impulses it slept with");
    assert_eq!(watch.counts(), (1, 0));
}

#[test]
fn removing_a_custom_arbiter_wakes_what_stood_on_it() {
    let mut world = World::default();
    let [first, second] = [0.0, 50.0].map(|x| add_bare(&mut world, Vec3::new(x, 5.0, 0.0)));
    let id = prop_up(&mut world, 900, BodyId::WORLD, first);
    prop_up(&mut world, 900, BodyId::WORLD, second);
    steps(&mut world, 120);
    assert_eq!(world.awake_count(), 0);
    world.remove_arbiter(id).unwrap();
    assert!(awake(&world, first) && !awake(&world, second));
    steps(&mut world, 30);
    assert!(world.body(first).unwrap().position().y < 4.0 && !awake(&world, second));
}

#[test]
fn custom_arbiters_tie_islands_together() {
    let mut world = World::default();
    let [low, high, alone] = [Vec3::new(0.0, 5.0, 0.0), Vec3::new(0.0, 6.0, 0.0), Vec3::new(9.0, 5.0, 0.0)]
        .map(|at| add_bare(&mut world, at));
    prop_up(&mut world, 900, BodyId::WORLD, low);
    prop_up(&mut world, 901, low, high);
    prop_up(&mut world, 900, BodyId::WORLD, alone);
    let islands = world.islands();
    assert_eq!(islands[low.index() as usize], islands[high.index() as usize]);
    assert_ne!(islands[low.index() as usize], islands[alone.index() as usize]);
    steps(&mut world, 150);
    assert_eq!(world.awake_count(), 0);
    world.body_mut(high).unwrap().apply_impulse(Vec3::new(0.0, 0.01, 0.0)).unwrap();
    assert!(awake(&world, low) && awake(&world, high) && !awake(&world, alone), "an island wakes as one");
    // One that does not rest keeps the other awake.
    for _ in 0..20 {
        world.body_mut(high).unwrap().wake();
        steps(&mut world, 5);
    }
    assert!(awake(&world, low));
}

#[test]
fn a_new_custom_arbiter_wakes_its_bodies() {
    let mut world = World::default();
    let [low, other] = [0.0, 9.0].map(|x| add_bare(&mut world, Vec3::new(x, 5.0, 0.0)));
    prop_up(&mut world, 900, BodyId::WORLD, low);
    prop_up(&mut world, 900, BodyId::WORLD, other);
    steps(&mut world, 120);
    assert_eq!(world.awake_count(), 0);
    let at = Vec3::new(0.0, 5.5, 0.0);
    world
        .register_contact_by_key(ArbiterKey::new(902, 0), BodyId::WORLD, low, ContactPoint::new(at, at, -Vec3::Y))
        .unwrap();
    assert!(awake(&world, low) && !awake(&world, other));
}

/// Moving contacts (a lever that is still to fall) do not sleep; when all has come to rest the same world does.
#[test]
fn sleep_waits_for_the_whole_island() {
    let mut world = World::default();
    add_floor(&mut world);
    let (box_, _) = add(&mut world, Vec3::new(0.0, 0.5, 0.0), Shape::cuboid(Vec3::splat(0.5)).unwrap());
    steps(&mut world, 60);
    assert!(!awake(&world, box_));
    let (ball, _) = add(&mut world, Vec3::new(0.0, 1.51, 0.0), Shape::sphere(0.5).unwrap());
    world.body_mut(ball).unwrap().set_can_sleep(false);
    steps(&mut world, 90);
    assert!(awake(&world, box_) && awake(&world, ball), "a body that may not sleep keeps awake what it touches");
    world.body_mut(ball).unwrap().set_can_sleep(true);
    steps(&mut world, 90);
    assert!(!awake(&world, box_) && !awake(&world, ball));
}

/// Where two balls are 10 steps after one has hit the other, which was asleep or just lay there.
fn billiards(asleep: bool, custom: bool) -> [Vec3; 2] {
    let mut world = weightless();
    let ball = Shape::sphere(0.5).unwrap();
    let (target, _) = add(&mut world, Vec3::ZERO, ball.clone());
    if asleep {
        world.body_mut(target).unwrap().sleep();
        assert!(!awake(&world, target));
    }
    let (cue, shape) = add(&mut world, Vec3::new(-1.01, 0.0, 0.0), ball);
    world.body_mut(cue).unwrap().set_linear_velocity(Vec3::new(12.0, 0.0, 0.0)).unwrap();
    if custom {
        // The same contact, from a provider.
        world.shape_mut(shape).unwrap().set_filter(Filter { mask: 0, ..Filter::default() });
        let mut once = Some(ContactPoint::new(Vec3::new(-0.51, 0.0, 0.0), Vec3::new(-0.5, 0.0, 0.0), Vec3::X));
        world.add_contact_provider(Box::new(Provide(move |context: &mut StepContext<'_>| {
            if let Some(contact) = once.take() {
                context.register_contact_by_key(ArbiterKey::new(900, 900), cue, target, contact).unwrap();
            }
        })));
    }
    steps(&mut world, 10);
    assert!(awake(&world, target));
    [cue, target].map(|body| world.body(body).unwrap().position())
}

/// A provider from a closure.
struct Provide<F>(F);

impl<F: FnMut(&mut StepContext<'_>) + Send + Sync> ContactProvider for Provide<F> {
    fn provide(&mut self, context: &mut StepContext<'_>) {
        (self.0)(context);
    }
}

/// What wakes in the middle of a step takes part in it in full: to be hit asleep or awake makes no difference.
#[test]
fn a_body_hit_in_its_sleep_moves_as_if_it_had_been_awake() {
    for custom in [false, true] {
        assert_eq!(billiards(true, custom), billiards(false, custom), "custom {custom}");
    }
}
