//! The manual's statements on arbiters, each with a test. The comment above a test says which statement it holds, in other
//! words.

use crate::support::*;
use arbiter3d::math::Vec3;
use arbiter3d::*;

/// Overview: an arbiter comes to be when two shapes begin to overlap …
#[test]
fn an_arbiter_is_made_when_shapes_begin_to_overlap_and_not_before() {
    let mut world = weightless();
    let (a, _) = add_sphere(&mut world, Vec3::ZERO);
    let (b, _) = add_sphere(&mut world, Vec3::new(2.5, 0.0, 0.0));
    world.step(DT).unwrap();
    assert_eq!(world.arbiter_count(), 0);
    world.body_mut(b).unwrap().set_position(Vec3::new(1.9, 0.0, 0.0)).unwrap();
    world.step(DT).unwrap();
    assert_eq!(world.arbiters_of(a).count(), 1);
}

/// … and goes when they separate …
#[test]
fn an_arbiter_goes_when_the_shapes_separate() {
    let (mut world, (a, _), (b, _)) = touching_pair();
    world.step(DT).unwrap();
    world.body_mut(b).unwrap().set_linear_velocity(Vec3::new(20.0, 0.0, 0.0)).unwrap();
    for _ in 0..10 {
        world.step(DT).unwrap();
    }
    assert_eq!((world.arbiters_of(a).count(), world.arbiter_count()), (0, 0));
}

/// … or when one of the bodies is taken out of the world.
#[test]
fn an_arbiter_goes_with_either_of_its_bodies() {
    for remove_first in [true, false] {
        let (mut world, (a, _), (b, _)) = touching_pair();
        world.step(DT).unwrap();
        world.remove_body(if remove_first { a } else { b }).unwrap();
        assert_eq!(world.arbiter_count(), 0);
        assert_eq!(world.arbiters_of(if remove_first { b } else { a }).count(), 0);
    }
}

/// An arbiter caches up to four contact points, never more.
#[test]
fn an_arbiter_holds_up_to_four_contacts() {
    let mut world = weightless();
    let body = add_bare(&mut world, Vec3::ZERO);
    let id = world.get_or_create_arbiter(ArbiterKey::new(1, 2), BodyId::WORLD, body).unwrap();
    for i in 0..9_u8 {
        let point = Vec3::new(f32::from(i % 3), 0.0, f32::from(i / 3));
        world.register_contact(id, ContactPoint::new(point, point, Vec3::Y)).unwrap();
        let count = world.arbiter_by_id(id).unwrap().data().contact_count();
        assert_eq!(count, usize::from(i + 1).min(4));
    }
}

/// Arbiters are between shapes: two boxes of one body on one sphere of another give two arbiters.
#[test]
fn two_boxes_of_a_body_that_overlap_one_sphere_have_an_arbiter_each() {
    let mut world = weightless();
    let a = world.add_body(&BodyDefinition::dynamic()).unwrap();
    let cube = Shape::cuboid(Vec3::splat(0.5)).unwrap();
    let left = ShapeDefinition::new(cube.clone()).at(Vec3::new(-0.6, 0.0, 0.0));
    let left = world.add_shape(a, &left).unwrap();
    let right = world.add_shape(a, &ShapeDefinition::new(cube).at(Vec3::new(0.6, 0.0, 0.0))).unwrap();
    let (b, sphere) = add_sphere(&mut world, Vec3::new(0.0, 1.4, 0.0));
    world.step(DT).unwrap();
    let mut keys: Vec<ArbiterKey> = world.arbiters_of(b).map(Arbiter::key).collect();
    keys.sort_unstable();
    assert_eq!(keys, [ArbiterKey::of_shapes(left, sphere), ArbiterKey::of_shapes(right, sphere)]);
    assert!(world.arbiters_of(b).all(|arbiter| arbiter.other_body(b) == Some(a)));
}

/// The same arbiter serves a pair for as long as it touches, however its manifold changes.
#[test]
fn the_arbiter_stays_the_same_while_the_manifold_changes() {
    let mut world = World::default();
    add_floor(&mut world);
    // A box that lands on an edge and falls over to a face: its manifold goes from two points to four.
    let (body, _) = add(&mut world, Vec3::new(0.0, 0.7, 0.0), Shape::cuboid(Vec3::splat(0.5)).unwrap());
    let tilt = math::Quat::from_xyzw(0.0, 0.0, 0.3, 0.953_939_2);
    world.body_mut(body).unwrap().set_rotation(tilt).unwrap();
    let watch = Watch::world(&mut world);
    let mut counts = Vec::new();
    for _ in 0..120 {
        world.step(DT).unwrap();
        counts.extend(world.arbiters_of(body).next().map(|arbiter| arbiter.data().contact_count()));
    }
    assert!(counts.contains(&2) && counts.contains(&4), "the box lies down: {counts:?}");
    assert_eq!(watch.counts(), (1, 0), "one arbiter all the way");
    assert_eq!(only_arbiter(&world, body).id(), watch.begins.all()[0]);
}

/// Points are kept and updated from step to step: in place, in the same slots, with the impulses they carried.
#[test]
fn contacts_are_cached_across_steps_with_their_impulses() {
    let mut world = World::default();
    add_floor(&mut world);
    let (body, _) = add(&mut world, Vec3::new(0.0, 0.5, 0.0), Shape::cuboid(Vec3::splat(0.5)).unwrap());
    for _ in 0..20 {
        world.step(DT).unwrap();
    }
    let before = *only_arbiter(&world, body).data();
    world.step(DT).unwrap();
    let after = only_arbiter(&world, body).data();
    assert_eq!(after.contact_count(), 4);
    let weight = 1000.0 * 9.81 * DT / 4.0;
    for (slot, contact) in after.contacts() {
        let old = before.contact(slot).expect("the same slots");
        assert_close(contact.local_anchor2(), old.local_anchor2(), 1e-3);
        // At rest each corner carries a quarter of a substep's weight, also at the start of the step.
        assert!((old.normal_impulse() - weight / 4.0).abs() < 0.01 * weight, "{old:?}");
        assert!((contact.normal_impulse() - weight / 4.0).abs() < 0.01 * weight, "{contact:?}");
        assert!((contact.total_normal_impulse() - weight).abs() < 0.02 * weight, "{contact:?}");
    }
}

/// The engine's own keys are the ids of the two shapes, the smaller one first, whichever body is older.
#[test]
fn engine_keys_are_the_shape_ids_smaller_first() {
    let mut world = weightless();
    let older = world.add_body(&BodyDefinition::dynamic()).unwrap();
    let newer = world.add_body(&BodyDefinition::dynamic().at(Vec3::new(1.5, 0.0, 0.0))).unwrap();
    let sphere = ShapeDefinition::new(Shape::sphere(1.0).unwrap());
    let first = world.add_shape(newer, &sphere).unwrap();
    let second = world.add_shape(older, &sphere).unwrap();
    assert!(first < second);
    world.step(DT).unwrap();
    let arbiter = world.arbiter(ArbiterKey::new(first.raw(), second.raw())).expect("smaller id first");
    assert_eq!((arbiter.body1(), arbiter.body2()), (newer, older), "body 1 has the smaller shape id");
    assert!(arbiter.is_of_shapes());
    assert!(world.arbiter(ArbiterKey::new(second.raw(), first.raw())).is_none());
    assert!(arbiter.data().contact(0).unwrap().normal().x < -0.99, "from body 1 to body 2");
}

/// The order of a key's two numbers counts for equality, for hashing, and for finding arbiters.
#[test]
fn the_order_of_a_key_matters() {
    let (there, back) = (ArbiterKey::new(1, 2), ArbiterKey::new(2, 1));
    assert_ne!(there, back);
    let set: std::collections::HashSet<ArbiterKey> = [there, back, ArbiterKey::new(1, 2)].into();
    assert_eq!(set.len(), 2);
    let mut world = weightless();
    let body = add_bare(&mut world, Vec3::ZERO);
    let id = world.get_or_create_arbiter(there, BodyId::WORLD, body).unwrap();
    let other = world.get_or_create_arbiter(back, BodyId::WORLD, body).unwrap();
    assert_ne!(id, other);
    assert_eq!(world.arbiter_count(), 2);
}

/// The contact data of an arbiter can be read and changed by the user.
#[test]
fn contact_data_is_open_to_read_and_write() {
    let (mut world, (a, _), _) = touching_pair();
    world.step(DT).unwrap();
    let id = only_arbiter(&world, a).id();
    let data = world.arbiter_mut(id).unwrap().data_mut();
    data.set_friction(0.25).unwrap();
    data.set_restitution(0.75).unwrap();
    data.set_normal(0, Vec3::Y).unwrap();
    data.set_tangent_velocity(Vec3::Z).unwrap();
    data.set_rolling_resistance(0.125).unwrap();
    data.set_solve_mode(SolveMode::LINEAR);
    let data = world.arbiter_by_id(id).unwrap().data();
    assert_eq!((data.friction(), data.restitution(), data.rolling_resistance()), (0.25, 0.75, 0.125));
    assert_eq!(data.contact(0).unwrap().normal(), Vec3::Y);
    assert_eq!((data.tangent_velocity(), data.solve_mode()), (Vec3::Z, SolveMode::LINEAR));
    world.arbiter_mut(id).unwrap().data_mut().remove_contact(0).unwrap();
    assert_eq!(world.arbiter_by_id(id).unwrap().data().contact_count(), 0);
}

/// The usage mask says which of the four slots hold a contact.
#[test]
fn the_usage_mask_tells_the_active_slots() {
    let mut world = weightless();
    let body = add_bare(&mut world, Vec3::ZERO);
    let id = world.get_or_create_arbiter(ArbiterKey::new(1, 2), BodyId::WORLD, body).unwrap();
    assert_eq!(world.arbiter_by_id(id).unwrap().data().usage_mask(), 0);
    for (i, mask) in [0b1_u8, 0b11, 0b111, 0b1111].into_iter().enumerate() {
        let point = Vec3::new(i as f32, 0.0, (i * i) as f32);
        world.register_contact(id, ContactPoint::new(point, point, Vec3::Y)).unwrap();
        assert_eq!(world.arbiter_by_id(id).unwrap().data().usage_mask(), mask);
    }
    let data = world.arbiter_mut(id).unwrap().data_mut();
    data.remove_contact(2).unwrap();
    assert_eq!(data.usage_mask(), 0b1011);
    assert!(data.contact(2).is_none() && data.contact(3).is_some() && data.contact(4).is_none());
    world.step(DT).unwrap();
    assert_eq!(world.arbiter_by_id(id).unwrap().data().usage_mask(), 0b1011_1011, "what was solved is in bits 4 to 7");
}

/// Friction and restitution of an arbiter start as the larger of the two sides' values.
#[test]
fn friction_and_restitution_are_the_maximum_of_the_two_sides() {
    for (first, second) in [((0.2, 0.6), (0.7, 0.1)), ((0.7, 0.1), (0.2, 0.6))] {
        let mut world = weightless();
        for (x, (friction, restitution)) in [(0.0, first), (1.5, second)] {
            let body = world.add_body(&BodyDefinition::dynamic().at(Vec3::new(x, 0.0, 0.0))).unwrap();
            let shape = ShapeDefinition::new(Shape::sphere(1.0).unwrap());
            world.add_shape(body, &shape.friction(friction).restitution(restitution)).unwrap();
        }
        world.step(DT).unwrap();
        let arbiter = world.arbiters().next().unwrap();
        assert_eq!((arbiter.data().friction(), arbiter.data().restitution()), (0.7, 0.6));
    }
}

/// Contact data is only there while its arbiter is: an id kept for longer finds nothing, not even the next tenant.
#[test]
fn what_is_kept_of_a_dead_arbiter_finds_nothing() {
    let (mut world, (a, _), (b, _)) = touching_pair();
    world.step(DT).unwrap();
    let old = only_arbiter(&world, a).id();
    world.remove_arbiter(old).unwrap();
    assert!(world.arbiter_by_id(old).is_none() && world.arbiter_mut(old).is_none());
    world.step(DT).unwrap();
    let new = only_arbiter(&world, b).id();
    assert_ne!(old, new, "the place is used again, the id is not");
    assert!(world.arbiter_by_id(old).is_none() && world.arbiter_mut(old).is_none());
}

/// Each body has a begin and an end to listen to, and both give the arbiter.
#[test]
fn bodies_hear_the_begin_and_the_end_of_their_arbiters() {
    let (mut world, (a, _), (b, _)) = touching_pair();
    let (c, _) = add_sphere(&mut world, Vec3::new(0.0, 50.0, 0.0));
    let [on_a, on_b, on_c] = [a, b, c].map(|body| Watch::body(&mut world, body));
    world.step(DT).unwrap();
    let id = only_arbiter(&world, a).id();
    assert_eq!((on_a.begins.all(), on_b.begins.all()), (vec![id], vec![id]));
    world.body_mut(b).unwrap().set_position(Vec3::new(9.0, 0.0, 0.0)).unwrap();
    world.step(DT).unwrap();
    assert_eq!((on_a.counts(), on_b.counts(), on_c.counts()), ((1, 1), (1, 1), (0, 0)));
    assert_eq!((on_a.ends.all()[0].arbiter, on_b.ends.all()[0].arbiter), (id, id));
}

/// A begin listener may look at and change contact properties; friction made zero there is zero for that contact from the
/// first solve on, and only for that contact.
#[test]
fn a_begin_listener_can_override_the_friction_of_one_contact() {
    let mut world = World::default();
    add_floor(&mut world);
    let cube = Shape::cuboid(Vec3::splat(0.5)).unwrap();
    let [ice, wood] = [-3.0, 3.0].map(|z| add(&mut world, Vec3::new(0.0, 0.5, z), cube.clone()).0);
    let seen = Log::default();
    let log = seen.clone();
    world.body_mut(ice).unwrap().on_begin_collide(Box::new(move |context, id| {
        let data = context.arbiter_mut(id).unwrap().data_mut();
        log.push((data.contact_count(), data.friction()));
        data.set_friction(0.0).unwrap();
    }));
    for body in [ice, wood] {
        world.body_mut(body).unwrap().set_linear_velocity(Vec3::new(2.0, 0.0, 0.0)).unwrap();
    }
    world.step(DT).unwrap();
    assert_eq!(seen.all(), [(4, 0.5)], "the contacts are there already when the begin is raised");
    assert_eq!(world.body(ice).unwrap().linear_velocity().x, 2.0, "no friction in this very step");
    let slowed = 2.0 - 0.5 * 9.81 * DT;
    assert!((world.body(wood).unwrap().linear_velocity().x - slowed).abs() < 0.02, "μ g for the other");
    for _ in 0..59 {
        world.step(DT).unwrap();
    }
    assert!((world.body(ice).unwrap().linear_velocity().x - 2.0).abs() < 1e-3, "for as long as they touch");
    assert!(world.body(wood).unwrap().linear_velocity().x.abs() < 1e-3);
}

/// Arbiters being between shapes, a body of several shapes can begin several times with the same other body.
#[test]
fn begin_is_raised_once_for_each_shape_pair() {
    let mut world = weightless();
    let a = world.add_body(&BodyDefinition::dynamic()).unwrap();
    for x in [-1.0, 0.0, 1.0] {
        let ball = ShapeDefinition::new(Shape::sphere(0.5).unwrap()).at(Vec3::new(x, 0.0, 0.0));
        world.add_shape(a, &ball).unwrap();
    }
    let (b, _) = add(&mut world, Vec3::new(0.0, 0.9, 0.0), Shape::cuboid(Vec3::new(2.0, 0.5, 2.0)).unwrap());
    let (on_a, on_b) = (Watch::body(&mut world, a), Watch::body(&mut world, b));
    for _ in 0..3 {
        world.step(DT).unwrap();
    }
    assert_eq!((on_a.begins.len(), on_b.begins.len()), (3, 3));
    world.remove_body(a).unwrap();
    assert_eq!((on_a.ends.len(), on_b.ends.len()), (3, 3), "and ends as often");
}

/// Arbiters need no collision detection of the engine: what users make and feed pushes bodies like the rest.
#[test]
fn a_custom_arbiter_pushes_bodies_without_any_shape() {
    let mut world = weightless();
    let body = add_bare(&mut world, Vec3::ZERO);
    world.body_mut(body).unwrap().set_linear_velocity(Vec3::new(0.0, -3.0, 0.0)).unwrap();
    let contact = ContactPoint::new(Vec3::ZERO, Vec3::ZERO, Vec3::Y);
    world.register_contact_by_key(ArbiterKey::new(1, 2), BodyId::WORLD, body, contact).unwrap();
    world.step(DT).unwrap();
    assert!(world.body(body).unwrap().linear_velocity().length() < 1e-5);
    let impulse = world.arbiter(ArbiterKey::new(1, 2)).unwrap().data().contact(0).unwrap().total_normal_impulse();
    assert!((impulse - 6.0).abs() < 1e-3, "2 kg at 3 m/s, not {impulse}");
}

/// Get or create: the existing arbiter of a key comes back with all it holds; without one, a new one is made.
#[test]
fn get_or_create_returns_the_existing_arbiter_or_makes_one() {
    let mut world = weightless();
    let body = add_bare(&mut world, Vec3::ZERO);
    let key = ArbiterKey::new(5, 6);
    assert!(world.arbiter(key).is_none());
    let id = world.get_or_create_arbiter(key, BodyId::WORLD, body).unwrap();
    world.register_contact(id, ContactPoint::new(Vec3::X, Vec3::X, Vec3::Y)).unwrap();
    assert_eq!(world.get_or_create_arbiter(key, BodyId::WORLD, body).unwrap(), id);
    assert_eq!(world.arbiter(key).unwrap().data().contact_count(), 1);
    assert_eq!(world.arbiter_count(), 1);
    world.step(DT).unwrap();
    assert_eq!(world.get_or_create_arbiter(key, BodyId::WORLD, body).unwrap(), id, "also after a step");
}

/// … also the engine's own, by the ids of its shapes.
#[test]
fn get_or_create_finds_the_engines_own_arbiters() {
    let (mut world, (a, sa), (b, sb)) = touching_pair();
    world.step(DT).unwrap();
    let own = only_arbiter(&world, a).id();
    assert_eq!(world.get_or_create_arbiter(ArbiterKey::of_shapes(sa, sb), a, b).unwrap(), own);
}

/// The numbers of a key need not be shape ids: any u64 will do.
#[test]
fn keys_may_be_any_numbers() {
    let mut world = weightless();
    let body = add_bare(&mut world, Vec3::ZERO);
    let keys = [(0, 0), (u64::MAX, 0), (u64::MAX, u64::MAX), (7, 7), (1 << 63, 3)].map(|(a, b)| ArbiterKey::new(a, b));
    for (i, key) in keys.into_iter().enumerate() {
        let point = Vec3::new(i as f32, 0.0, 0.0);
        let contact = ContactPoint::new(point, point, Vec3::Y);
        world.register_contact_by_key(key, BodyId::WORLD, body, contact).unwrap();
    }
    world.step(DT).unwrap();
    for (i, key) in keys.into_iter().enumerate() {
        let arbiter = world.arbiter(key).unwrap();
        let (_, point, _) = world.contact_points(arbiter).next().unwrap();
        assert_close(point, Vec3::new(i as f32, 0.0, 0.0), 1e-6);
        assert!(!arbiter.is_of_shapes());
    }
    world.validate().unwrap();
}

/// Points and normals are registered in world space, on bodies that stand and are turned anyhow.
#[test]
fn contacts_are_registered_in_world_space() {
    let mut world = weightless();
    let turned =
        BodyDefinition::dynamic().at(Vec3::new(3.0, -2.0, 5.0)).rotated(math::Quat::from_xyzw(0.5, -0.5, 0.5, 0.5));
    let [a, b] = [world.add_body(&turned).unwrap(), world.add_body(&turned.at(Vec3::new(1.0, 1.0, 1.0))).unwrap()];
    let (p1, p2) = (Vec3::new(2.0, 0.5, -1.0), Vec3::new(2.0, 0.4, -1.0));
    let id = world.register_contact_by_key(ArbiterKey::new(1, 2), a, b, ContactPoint::new(p1, p2, Vec3::Y)).unwrap();
    let arbiter = world.arbiter_by_id(id).unwrap();
    let (_, q1, q2) = world.contact_points(arbiter).next().unwrap();
    assert_close(q1, p1, 1e-5);
    assert_close(q2, p2, 1e-5);
    let contact = arbiter.data().contact(0).unwrap();
    assert_eq!(contact.normal(), Vec3::Y);
    assert!((contact.separation() + 0.1).abs() < 1e-6, "overlap by 10 cm is a gap of −0.1");
}

/// Remove flags leave velocity components out: without the angular ones the response is linear only, and the reverse.
#[test]
fn remove_flags_leave_velocity_components_out() {
    for (remove, moves, turns) in [
        (SolveMode::NONE, true, true),
        (SolveMode::ANGULAR, true, false),
        (SolveMode::LINEAR, false, true),
        (SolveMode::FULL, false, false),
    ] {
        let mut world = weightless();
        let body = add_bare(&mut world, Vec3::ZERO);
        world.body_mut(body).unwrap().set_linear_velocity(Vec3::new(0.0, -1.0, 0.0)).unwrap();
        let point = Vec3::new(0.3, 0.0, 0.0);
        let contact = ContactPoint::new(point, point, Vec3::Y).without(remove);
        world.register_contact_by_key(ArbiterKey::new(1, 2), BodyId::WORLD, body, contact).unwrap();
        world.step(1e-3).unwrap();
        let body = world.body(body).unwrap();
        assert_eq!(body.linear_velocity().y > -1.0 + 1e-3, moves, "{remove:?}: {}", body.linear_velocity());
        assert_eq!(body.angular_velocity().length() > 1e-3, turns, "{remove:?}: {}", body.angular_velocity());
    }
}

/// Contacts can be registered by key straight away, which makes the arbiter where there is none.
#[test]
fn registering_by_key_makes_the_arbiter_if_needed() {
    let mut world = weightless();
    let body = add_bare(&mut world, Vec3::ZERO);
    let key = ArbiterKey::new(11, 12);
    let contact = |x: f32| ContactPoint::new(Vec3::new(x, 0.0, 0.0), Vec3::new(x, 0.0, 0.0), Vec3::Y);
    let id = world.register_contact_by_key(key, BodyId::WORLD, body, contact(0.0)).unwrap();
    assert_eq!(world.register_contact_by_key(key, BodyId::WORLD, body, contact(1.0)).unwrap(), id);
    assert_eq!((world.arbiter_count(), world.contact_count()), (1, 2));
}

/// Lifecycle, creation: begin is raised on both bodies, in the step in which the overlap is found.
#[test]
fn creation_raises_begin_on_both_bodies_in_that_step() {
    let mut world = weightless();
    let (a, _) = add_sphere(&mut world, Vec3::ZERO);
    let (b, _) = add_sphere(&mut world, Vec3::new(2.31, 0.0, 0.0));
    world.body_mut(b).unwrap().set_linear_velocity(Vec3::new(-3.0, 0.0, 0.0)).unwrap();
    let (on_a, on_b) = (Watch::body(&mut world, a), Watch::body(&mut world, b));
    // 5 cm a step: the gap of 31 cm closes within the seventh step.
    for step in 1..=8 {
        world.step(DT).unwrap();
        let expected = usize::from(step >= 7);
        assert_eq!((on_a.begins.len(), on_b.begins.len()), (expected, expected), "step {step}");
    }
}

/// Lifecycle, update: each step moves the contacts with their bodies, drops those past the threshold, adds new ones.
#[test]
fn each_step_updates_drops_and_adds_contacts() {
    let mut world = World::default();
    let ledge = Shape::cuboid(Vec3::new(1.0, 0.5, 2.0)).unwrap();
    world.add_shape(BodyId::WORLD, &ShapeDefinition::new(ledge).at(Vec3::new(-1.0, -0.5, 0.0)).friction(0.0)).unwrap();
    let body = world.add_body(&BodyDefinition::dynamic().at(Vec3::new(-0.7, 0.5, 0.0))).unwrap();
    let cube = ShapeDefinition::new(Shape::cuboid(Vec3::splat(0.5)).unwrap()).friction(0.0);
    world.add_shape(body, &cube).unwrap();
    world.body_mut(body).unwrap().set_linear_velocity(Vec3::new(0.5, 0.0, 0.0)).unwrap();
    let mut front = Vec::new();
    for _ in 0..60 {
        world.step(DT).unwrap();
        let arbiter = only_arbiter(&world, body);
        assert_eq!(arbiter.data().contact_count(), 4);
        front.push(world.contact_points(arbiter).map(|(_, _, p)| p.x).fold(f32::MIN, f32::max));
    }
    // The front points move with the box until it passes the ledge's end at x = 0; there new ones stand in for them.
    assert!((front[10] - (-0.2 + 0.5 * 11.0 * DT)).abs() < 5e-3, "{}", front[10]);
    assert!(front[40..].iter().all(|x| x.abs() < 0.02), "{:?}", &front[40..]);
}

/// Lifecycle, removal: without contacts and without overlap the arbiter goes, end is raised on both bodies, …
#[test]
fn removal_raises_end_on_both_bodies_with_no_contact_left() {
    let (mut world, (a, _), (b, _)) = touching_pair();
    let (on_a, on_b) = (Watch::body(&mut world, a), Watch::body(&mut world, b));
    world.step(DT).unwrap();
    world.body_mut(b).unwrap().set_linear_velocity(Vec3::new(3.0, 0.0, 0.0)).unwrap();
    for _ in 0..60 {
        world.step(DT).unwrap();
        let gap = world.body(b).unwrap().position().x - world.body(a).unwrap().position().x - 2.0;
        let ended = on_a.ends.len() == 1 && on_b.ends.len() == 1;
        assert_eq!(ended, world.arbiter_count() == 0);
        assert!(gap > 0.0 || !ended, "they still overlap: gap {gap}");
        assert!(gap < 0.05 + 3.0 * DT || ended, "long apart: gap {gap}");
    }
    assert_eq!(on_a.ends.all()[0].reason, EndReason::Separated);
    assert_eq!(on_a.ends.all()[0].data.contact_count(), 0);
}

/// … and as long as the shapes overlap it stays, even without a contact.
#[test]
fn an_arbiter_without_contacts_stays_while_the_shapes_overlap() {
    let (mut world, (a, _), _) = touching_pair();
    world.set_contact_filter(None);
    world.step(DT).unwrap();
    let id = only_arbiter(&world, a).id();
    let watch = Watch::world(&mut world);
    world.arbiter_mut(id).unwrap().data_mut().clear();
    world.set_contact_filter(Some(Box::new(|_, _| false)));
    world.step(DT).unwrap();
    let arbiter = world.arbiter_by_id(id).expect("the shapes overlap");
    assert_eq!(arbiter.data().contact_count(), 0);
    world.set_contact_filter(None);
    world.step(DT).unwrap();
    assert_eq!(world.arbiter_by_id(id).expect("the same arbiter").data().contact_count(), 1);
    assert_eq!(watch.counts(), (0, 0));
}
