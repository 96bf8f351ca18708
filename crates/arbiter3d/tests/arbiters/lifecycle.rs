//! From begin to end: contact lifecycle, filters, the world's own body, and one end for each begin whatever the reason.

use crate::support::*;
use arbiter3d::math::Vec3;
use arbiter3d::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// CL1.
#[test]
fn one_step_of_overlap_begins_once_on_each_body() {
    let (mut world, (a, _), (b, _)) = touching_pair();
    let (on_a, on_b, on_all) = (Watch::body(&mut world, a), Watch::body(&mut world, b), Watch::world(&mut world));
    world.step(DT).unwrap();
    for watch in [on_a, on_b, on_all] {
        assert_eq!(watch.counts(), (1, 0));
    }
    assert_eq!(world.arbiters_of(a).next().unwrap().other_body(a), Some(b));
    assert_eq!(world.arbiters_of(b).next().unwrap().other_body(b), Some(a));
    assert_eq!(only_arbiter(&world, a).data().contact_count(), 1);
}

/// CL2: a separation by teleport is told in the very next step.
#[test]
fn a_body_moved_away_ends_once_on_each_body() {
    let (mut world, (a, _), (b, _)) = touching_pair();
    let (on_a, on_b) = (Watch::body(&mut world, a), Watch::body(&mut world, b));
    world.step(DT).unwrap();
    world.body_mut(b).unwrap().set_position(Vec3::new(5.0, 0.0, 0.0)).unwrap();
    world.step(DT).unwrap();
    assert_eq!((on_a.counts(), on_b.counts()), ((1, 1), (1, 1)));
    world.step(DT).unwrap();
    assert_eq!((on_a.counts(), on_b.counts()), ((1, 1), (1, 1)));
    assert_eq!((world.arbiters_of(a).count(), world.arbiters_of(b).count()), (0, 0));
}

/// CL3.
#[test]
fn removing_a_body_frees_its_partner_at_once() {
    let (mut world, (a, _), (b, _)) = touching_pair();
    world.step(DT).unwrap();
    world.remove_body(b).unwrap();
    assert_eq!((world.arbiters_of(a).count(), world.arbiters_of(b).count(), world.arbiter_count()), (0, 0, 0));
}

/// CL4: a teleport clears the cached contacts at once; the arbiter lives on while the shapes overlap.
#[test]
fn a_small_teleport_clears_the_contacts_and_keeps_the_arbiter() {
    let (mut world, (a, _), (b, _)) = touching_pair();
    let watch = Watch::world(&mut world);
    world.step(DT).unwrap();
    let id = only_arbiter(&world, a).id();
    assert_ne!(only_arbiter(&world, a).data().usage_mask() & 15, 0);
    world.body_mut(b).unwrap().set_position(Vec3::new(1.4, 0.0, 0.0)).unwrap();
    assert_eq!(only_arbiter(&world, a).data().usage_mask() & 15, 0);
    world.step(DT).unwrap();
    assert_eq!(only_arbiter(&world, a).id(), id);
    assert_eq!(only_arbiter(&world, a).data().contact_count(), 1);
    assert_eq!(watch.counts(), (1, 0));
}

/// CF1.
#[test]
fn a_pair_filter_that_says_no_is_asked_and_obeyed() {
    let (mut world, (a, sa), (b, sb)) = touching_pair();
    let asked = Log::default();
    let log = asked.clone();
    world.set_pair_filter(Some(Box::new(move |pair| {
        log.push(*pair);
        false
    })));
    world.step(DT).unwrap();
    assert!(asked.all().contains(&ShapePair { shape1: sa, shape2: sb, body1: a, body2: b }));
    assert_eq!(world.arbiter_count(), 0);
    let watch = Watch::world(&mut world);
    world.set_pair_filter(None);
    world.step(DT).unwrap();
    assert_eq!((world.arbiter_count(), watch.counts()), (1, (1, 0)), "without the filter the shapes collide");
    world.set_pair_filter(Some(Box::new(|_| false)));
    assert_eq!((world.arbiter_count(), watch.counts()), (0, (1, 1)));
    assert_eq!(watch.ends.all()[0].reason, EndReason::FilterChanged);
}

/// CF2.
#[test]
fn a_contact_filter_that_says_no_is_asked_and_obeyed() {
    let (mut world, (a, _), _) = touching_pair();
    let asked = Arc::new(AtomicUsize::new(0));
    let count = Arc::clone(&asked);
    world.set_contact_filter(Some(Box::new(move |_, manifold| {
        assert_eq!(manifold.points().len(), 1);
        count.fetch_add(1, Ordering::Relaxed);
        false
    })));
    let watch = Watch::world(&mut world);
    world.step(DT).unwrap();
    assert!(asked.load(Ordering::Relaxed) >= 1);
    assert_eq!((world.arbiter_count(), watch.counts()), (0, (0, 0)));
    assert_eq!(world.body(a).unwrap().linear_velocity(), Vec3::ZERO);
}

/// A contact filter may change what it sees: here the normal, and with it the way the spheres are pushed.
#[test]
fn a_contact_filter_may_change_the_manifold() {
    let (mut world, (a, _), (b, _)) = touching_pair();
    world.set_contact_filter(Some(Box::new(|_, manifold| {
        manifold.points_mut()[0].normal = Vec3::Y;
        true
    })));
    world.step(DT).unwrap();
    let [va, vb] = [a, b].map(|body| world.body(body).unwrap().position());
    assert!(va.y < 0.0 && vb.y > 0.0 && va.x == 0.0 && vb.x == 1.5, "{va} {vb}");
}

/// NB1.
#[test]
fn the_worlds_own_body_is_static_and_without_inverse_mass() {
    let world = World::default();
    let own = world.body(BodyId::WORLD).unwrap();
    assert_eq!((own.kind(), own.mass(), own.position()), (BodyKind::Static, 0.0, Vec3::ZERO));
    let inertia = own.inverse_inertia();
    assert!([inertia.xx, inertia.yy, inertia.zz, inertia.xy, inertia.xz, inertia.yz].iter().all(|&x| x == 0.0));
}

/// NB3.
#[test]
fn the_worlds_own_body_carries_shapes() {
    let mut world = weightless();
    let shape = world.add_shape(BodyId::WORLD, &ShapeDefinition::new(Shape::sphere(1.0).unwrap())).unwrap();
    let (body, _) = add_sphere(&mut world, Vec3::new(1.5, 0.0, 0.0));
    world.step(DT).unwrap();
    assert_eq!((only_arbiter(&world, body).data().contact_count(), world.arbiters_of(BodyId::WORLD).count()), (1, 1));
    world.remove_shape(shape).unwrap();
    for _ in 0..2 {
        world.step(DT).unwrap();
    }
    assert_eq!((world.arbiters_of(body).count(), world.arbiters_of(BodyId::WORLD).count()), (0, 0));
    assert!(world.body(BodyId::WORLD).unwrap().shapes().is_empty());
}

/// What a test does to end the arbiter of the touching pair (world, body B, shape of B).
type Cause = fn(&mut World, BodyId, ShapeId);

/// Every way an arbiter can end.
const CAUSES: [(EndReason, Cause); 11] = [
    (EndReason::Separated, |world, b, _| {
        world.body_mut(b).unwrap().set_linear_velocity(Vec3::new(100.0, 0.0, 0.0)).unwrap();
        world.step(DT).unwrap();
    }),
    (EndReason::Separated, |world, b, _| {
        world.body_mut(b).unwrap().set_position(Vec3::new(100.0, 0.0, 0.0)).unwrap();
        world.step(DT).unwrap();
    }),
    (EndReason::ArbiterRemoved, |world, b, _| {
        let id = only_arbiter(world, b).id();
        world.remove_arbiter(id).unwrap();
    }),
    (EndReason::ShapeRemoved, |world, _, shape| world.remove_shape(shape).unwrap()),
    (EndReason::BodyRemoved, |world, b, _| world.remove_body(b).unwrap()),
    (EndReason::BodyDisabled, |world, b, _| world.body_mut(b).unwrap().set_enabled(false).unwrap()),
    (EndReason::KindChanged, |world, b, _| world.body_mut(b).unwrap().set_kind(BodyKind::Static).unwrap()),
    (EndReason::KindChanged, |world, b, _| world.body_mut(b).unwrap().set_kind(BodyKind::Kinematic).unwrap()),
    (EndReason::FilterChanged, |world, _, shape| {
        world.shape_mut(shape).unwrap().set_filter(Filter { mask: 0, ..Filter::default() });
    }),
    (EndReason::FilterChanged, |world, _, shape| world.shape_mut(shape).unwrap().set_sensor(true)),
    (EndReason::WorldCleared, |world, _, _| world.clear()),
];

#[test]
fn every_reason_ends_exactly_once_everywhere_and_says_so() {
    for (reason, cause) in CAUSES {
        let (mut world, (a, sa), (b, sb)) = touching_pair();
        let watches = [Watch::body(&mut world, a), Watch::body(&mut world, b), Watch::world(&mut world)];
        world.step(DT).unwrap();
        let id = only_arbiter(&world, a).id();
        world.arbiter_mut(id).unwrap().data_mut().set_friction(0.125).unwrap();
        assert_eq!(world.drain_begin_events().count(), 1);
        cause(&mut world, b, sb);
        let listed: Vec<EndEvent> = world.drain_end_events().collect();
        assert_eq!(listed.len(), 1, "{reason:?}");
        for watch in &watches {
            assert_eq!(watch.ends.all(), listed, "{reason:?}: bodies, world and list tell the same");
        }
        let end = listed[0];
        assert_eq!((end.reason, end.arbiter, end.key), (reason, id, ArbiterKey::of_shapes(sa, sb)));
        assert_eq!((end.body1, end.body2), (a, b));
        assert_eq!(end.data.friction(), 0.125, "the last data can still be read");
        if reason != EndReason::Separated {
            assert!((end.data.contact(0).unwrap().normal().x - 1.0).abs() < 1e-6, "{reason:?}");
        }
        assert!(world.arbiter_by_id(id).is_none());
        let (begins, ends) = (watches[2].begins.len(), watches[2].ends.len());
        assert_eq!((begins, ends), (1, 1), "{reason:?}");
        world.validate().unwrap();
    }
}

/// Whatever happens to a heap of bodies, in the end there were as many ends as begins, for each body and each key.
#[test]
fn begins_and_ends_alternate_for_every_key() {
    let mut world = World::default();
    add_floor(&mut world);
    let watch = Watch::world(&mut world);
    let sequence: Log<(ArbiterKey, bool)> = Log::default();
    let (begin, end) = (sequence.clone(), sequence.clone());
    world.on_begin_collide(Box::new(move |context, id| begin.push((context.arbiter(id).unwrap().key(), true))));
    world.on_end_collide(Box::new(move |_, event| end.push((event.key, false))));
    let bodies: Vec<(BodyId, ShapeId)> = (0..24_u16)
        .map(|i| {
            let position = Vec3::new(f32::from(i % 3) * 0.9, 1.0 + f32::from(i / 3) * 1.1, f32::from(i % 2) * 0.8);
            let cube = Shape::cuboid(Vec3::splat(0.5)).unwrap();
            add(&mut world, position, cube)
        })
        .collect();
    for step in 0..120_usize {
        world.step(DT).unwrap();
        let (body, shape) = bodies[(step * 7) % bodies.len()];
        match step % 12 {
            2 => world.body_mut(body).unwrap().set_kind(BodyKind::Kinematic).unwrap(),
            3 => world.body_mut(body).unwrap().set_kind(BodyKind::Dynamic).unwrap(),
            5 => world.body_mut(body).unwrap().set_enabled(step % 24 < 12).unwrap(),
            6 => world.shape_mut(shape).unwrap().set_filter(Filter { mask: step as u64, ..Filter::default() }),
            8 => world.shape_mut(shape).unwrap().set_sensor(step % 24 < 12),
            9 => world.body_mut(body).unwrap().set_position(Vec3::new(0.5, 9.0, 0.0)).unwrap(),
            10 => {
                let first = world.arbiters().map(Arbiter::id).min();
                first.map(|id| world.remove_arbiter(id)).transpose().map(drop).unwrap();
            }
            _ => {}
        }
        world.validate().unwrap();
    }
    assert!(watch.ends.len() > 50, "{} ends", watch.ends.len());
    world.clear();
    assert_eq!(watch.begins.len(), watch.ends.len());
    let mut live = std::collections::HashSet::new();
    for (key, begins) in sequence.all() {
        assert!(if begins { live.insert(key) } else { live.remove(&key) }, "{key:?} twice in a row");
    }
    assert!(live.is_empty());
}

/// A filter change that still lets a pair collide leaves its arbiter alone.
#[test]
fn a_filter_change_spares_arbiters_that_it_does_not_concern() {
    let (mut world, (a, _), (_, sb)) = touching_pair();
    let watch = Watch::world(&mut world);
    world.step(DT).unwrap();
    let id = only_arbiter(&world, a).id();
    world.shape_mut(sb).unwrap().set_filter(Filter { category: 3, ..Filter::default() });
    world.step(DT).unwrap();
    assert_eq!((only_arbiter(&world, a).id(), watch.counts()), (id, (1, 0)));
}

/// MI1: ids are handed out in ranges that follow each other and never meet a shape's.
#[test]
fn reserved_ids_never_clash_with_shapes_or_each_other() {
    let mut world = weightless();
    let mut last = 0;
    for i in 1..20_u64 {
        let range = world.reserve_ids(i).unwrap();
        assert_eq!(range.end - range.start, i);
        assert!(range.start > last);
        let (_, shape) = add_sphere(&mut world, Vec3::ZERO);
        assert!(shape.raw() >= range.end);
        last = shape.raw();
    }
    let next = world.reserve_ids(1).unwrap();
    assert_eq!(world.reserve_ids(1).unwrap(), next.end..next.end + 1, "ranges are contiguous");
    assert_eq!(world.reserve_ids(0).unwrap_err(), Error::IdRange { count: 0, limit: 1 << 48 });
    assert!(world.reserve_ids(u64::MAX).is_err());
    assert_eq!(world.reserve_ids(1).unwrap().start, next.end + 1, "a refused call takes nothing");
}

/// A filter that lets more pass makes shapes collide that overlap already, also where they sleep.
#[test]
fn a_lifted_filter_lets_overlapping_shapes_collide() {
    for asleep in [false, true] {
        let (mut world, (a, _), (b, sb)) = touching_pair();
        world.shape_mut(sb).unwrap().set_filter(Filter { mask: 0, ..Filter::default() });
        world.step(DT).unwrap();
        assert_eq!(world.arbiter_count(), 0);
        if asleep {
            world.body_mut(a).unwrap().sleep();
            world.body_mut(b).unwrap().sleep();
        }
        world.shape_mut(sb).unwrap().set_filter(Filter::default());
        world.step(DT).unwrap();
        assert_eq!(only_arbiter(&world, a).data().contact_count(), 1, "asleep {asleep}");
        assert!(world.body(a).unwrap().linear_velocity().x < 0.0, "and they are pushed apart");
    }
}
