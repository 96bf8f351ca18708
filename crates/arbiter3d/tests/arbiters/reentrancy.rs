//! Changing the world while listening to it: removals wait for the end of the phase, registrations count at once.

use crate::support::*;
use arbiter3d::math::Vec3;
use arbiter3d::*;

/// What a listener removes, given the two bodies of the event and a bystander.
#[derive(Clone, Copy, Debug)]
enum Victim {
    Body1,
    Body2,
    Bystander,
    Shapes,
    OwnArbiter,
    AllArbiters,
}

/// When it does.
#[derive(Clone, Copy, Debug, PartialEq)]
enum When {
    Begin,
    End,
}

/// Removes without minding whether it is there: stale ids must be errors, never panics.
fn strike(context: &mut StepContext<'_>, victim: Victim, bodies: [BodyId; 2], bystander: BodyId, own: ArbiterId) {
    match victim {
        Victim::Body1 => drop(context.remove_body(bodies[0])),
        Victim::Body2 => drop(context.remove_body(bodies[1])),
        Victim::Bystander => drop(context.remove_body(bystander)),
        Victim::Shapes => {
            let shapes = bodies.iter().filter_map(|&id| context.body(id)).flat_map(|body| body.shapes().to_vec());
            for shape in shapes.collect::<Vec<_>>() {
                context.remove_shape(shape).unwrap();
                context.remove_shape(shape).unwrap(); // asked for twice: once is enough
            }
        }
        Victim::OwnArbiter => drop(context.remove_arbiter(own)),
        Victim::AllArbiters => {
            let all: Vec<ArbiterId> = context.world().arbiters().map(Arbiter::id).collect();
            for id in all {
                context.remove_arbiter(id).unwrap();
            }
        }
    }
}

/// A heap of overlapping, falling bodies whose listeners strike at every third event.
fn run(victim: Victim, when: When, threads: usize) -> (u64, usize) {
    let mut world = World::new(WorldSettings { threads, ..WorldSettings::default() }).unwrap();
    add_floor(&mut world);
    let watch = Watch::world(&mut world);
    let bodies: Vec<BodyId> = (0..40_u16)
        .map(|i| {
            let position = Vec3::new(f32::from(i % 4), 0.6 + f32::from(i / 8) * 0.9, f32::from(i / 4 % 2));
            let shape = if i % 2 == 0 { Shape::sphere(0.6) } else { Shape::cuboid(Vec3::splat(0.5)) };
            add(&mut world, position, shape.unwrap()).0
        })
        .collect();
    let mut count = 0;
    let mut due = move || {
        count += 1;
        count % 3 == 0
    };
    let bystander = bodies[bodies.len() / 2];
    match when {
        When::Begin => world.on_begin_collide(Box::new(move |context, id| {
            let arbiter = context.arbiter(id).expect("alive while its begin is raised");
            let pair = [arbiter.body1(), arbiter.body2()];
            if due() {
                strike(context, victim, pair, bystander, id);
                assert!(context.arbiter(id).is_some(), "removal waits for the end of the phase");
                assert!(pair.iter().all(|&body| context.body(body).is_some()));
            }
        })),
        When::End => world.on_end_collide(Box::new(move |context, event| {
            assert!(context.arbiter(event.arbiter).is_none());
            if due() {
                strike(context, victim, [event.body1, event.body2], bystander, event.arbiter);
            }
        })),
    }
    for _ in 0..90 {
        world.step(DT).unwrap();
        world.validate().unwrap();
    }
    let hash = world.hash();
    world.clear();
    world.validate().unwrap();
    assert_eq!(watch.begins.len(), watch.ends.len(), "{victim:?} at {when:?}: one end for each begin");
    (hash, watch.begins.len())
}

#[test]
fn anything_may_be_removed_while_listening() {
    use Victim::{AllArbiters, Body1, Body2, Bystander, OwnArbiter, Shapes};
    for victim in [Body1, Body2, Bystander, Shapes, OwnArbiter, AllArbiters] {
        for when in [When::Begin, When::End] {
            let alone = run(victim, when, 1);
            assert!(alone.1 > 20, "{victim:?} at {when:?}: {} begins", alone.1);
            assert_eq!(run(victim, when, 2), alone, "{victim:?} at {when:?} on two threads");
        }
    }
}

/// The begin phase ends before the solve: what was removed in it pushes nobody.
#[test]
fn what_is_removed_at_its_begin_does_not_push() {
    for victim in 0..3 {
        let (mut world, (a, _), (b, sb)) = touching_pair();
        world.body_mut(a).unwrap().set_linear_velocity(Vec3::X).unwrap();
        world.on_begin_collide(Box::new(move |context, id| match victim {
            0 => context.remove_body(b).unwrap(),
            1 => context.remove_shape(sb).unwrap(),
            _ => context.remove_arbiter(id).unwrap(),
        }));
        world.step(DT).unwrap();
        assert_eq!(world.body(a).unwrap().linear_velocity(), Vec3::X);
        assert_eq!((world.begin_events().len(), world.end_events().len()), (1, 1));
        assert_eq!(world.body(b).is_none(), victim == 0);
        assert_eq!(world.shape(sb).is_none(), victim < 2);
    }
}

/// A body that removes itself when something touches it, three in a row: the others never know it was there.
#[test]
fn a_listener_may_remove_its_own_body() {
    let mut world = weightless();
    let bodies = [0.0, 1.5, 3.0].map(|x| add_sphere(&mut world, Vec3::new(x, 0.0, 0.0)).0);
    let middle = bodies[1];
    world.body_mut(middle).unwrap().on_begin_collide(Box::new(move |context, _| {
        let _ = context.remove_body(middle);
    }));
    let heard = Watch::body(&mut world, middle);
    world.step(DT).unwrap();
    assert_eq!(heard.counts(), (2, 2), "both begins and both ends reach it");
    assert!(world.body(middle).is_none());
    assert_eq!(world.body(bodies[0]).unwrap().position(), Vec3::ZERO);
    assert!(world.end_events().iter().all(|event| event.reason == EndReason::BodyRemoved));
}

/// An arbiter made in a begin listener begins and is solved in that very step.
#[test]
fn arbiters_made_while_begin_is_raised_count_in_that_step() {
    let (mut world, ..) = touching_pair();
    let third = add_bare(&mut world, Vec3::new(0.0, 9.0, 0.0));
    world.body_mut(third).unwrap().set_linear_velocity(Vec3::new(0.0, -4.0, 0.0)).unwrap();
    let key = ArbiterKey::new(900, 900);
    world.on_begin_collide(Box::new(move |context, id| {
        let at = context.body(third).unwrap().position();
        if context.arbiter(id).unwrap().key() != key {
            context.register_contact_by_key(key, BodyId::WORLD, third, ContactPoint::new(at, at, Vec3::Y)).unwrap();
        }
    }));
    world.step(DT).unwrap();
    assert_eq!(world.begin_events().len(), 2);
    assert_eq!(world.begin_events()[1].key, key);
    assert!(world.body(third).unwrap().linear_velocity().length() < 1e-4);
}

/// A contact registered with the arbiter whose begin is raised is solved with it.
#[test]
fn contacts_registered_while_begin_is_raised_count_in_that_step() {
    let (mut world, (a, _), _) = touching_pair();
    world.body_mut(a).unwrap().set_linear_velocity(Vec3::new(0.0, -2.0, 0.0)).unwrap();
    world.on_begin_collide(Box::new(move |context, id| {
        // A second point that stops A's way down as well: normal up from B to A is −y from A to B.
        let below = Vec3::new(0.75, -0.2, 0.0);
        context.register_contact(id, ContactPoint::new(below, below, -Vec3::Y)).unwrap();
    }));
    world.step(DT).unwrap();
    let arbiter = only_arbiter(&world, a);
    assert_eq!(arbiter.data().usage_mask() >> 4, 0b11, "both were solved");
    assert!(world.body(a).unwrap().linear_velocity().y > -1.9);
}

/// What an end listener makes begins in the next step; ends never go round in circles within a step.
#[test]
fn arbiters_made_while_end_is_raised_begin_in_the_next_step() {
    let (mut world, _, (b, _)) = touching_pair();
    let third = add_bare(&mut world, Vec3::new(0.0, 9.0, 0.0));
    let key = ArbiterKey::new(900, 901);
    world.on_end_collide(Box::new(move |context, event| {
        if event.key != key {
            let at = Vec3::new(0.0, 9.0, 0.0);
            context.register_contact_by_key(key, BodyId::WORLD, third, ContactPoint::new(at, at, Vec3::Y)).unwrap();
        }
    }));
    world.step(DT).unwrap();
    world.remove_body(b).unwrap();
    assert!(world.arbiter(key).is_some());
    assert_eq!(world.drain_begin_events().filter(|event| event.key == key).count(), 0);
    world.step(DT).unwrap();
    assert_eq!(world.drain_begin_events().filter(|event| event.key == key).count(), 1);
}

/// An arbiter that is made and removed before its begin was raised has neither begin nor end.
#[test]
fn an_arbiter_removed_before_its_begin_is_never_heard_of() {
    let mut world = weightless();
    let body = add_bare(&mut world, Vec3::ZERO);
    let watch = Watch::world(&mut world);
    let id = world.get_or_create_arbiter(ArbiterKey::new(1, 2), BodyId::WORLD, body).unwrap();
    world.remove_arbiter(id).unwrap();
    let id = world.get_or_create_arbiter(ArbiterKey::new(1, 3), BodyId::WORLD, body).unwrap();
    world.remove_body(body).unwrap();
    assert!(world.arbiter_by_id(id).is_none());
    world.step(DT).unwrap();
    assert_eq!(watch.counts(), (0, 0));
}
