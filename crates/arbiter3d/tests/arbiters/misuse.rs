//! Misuse is an error value that names what is wrong; the world stays as it was.

use crate::support::*;
use arbiter3d::math::Vec3;
use arbiter3d::*;

const KEY: ArbiterKey = ArbiterKey::new(100, 200);

/// Two bare bodies, no arbiter.
fn two_bodies() -> (World, BodyId, BodyId) {
    let mut world = weightless();
    let a = add_bare(&mut world, Vec3::ZERO);
    let b = add_bare(&mut world, Vec3::X);
    (world, a, b)
}

fn contact() -> ContactPoint {
    ContactPoint::new(Vec3::ZERO, Vec3::ZERO, Vec3::X)
}

/// Both forms of making an arbiter refuse with the same error, and leave nothing behind.
#[track_caller]
fn refuses(world: &mut World, key: ArbiterKey, a: BodyId, b: BodyId, error: &Error) {
    let (hash, count) = (world.hash(), world.arbiter_count());
    assert_eq!(&world.get_or_create_arbiter(key, a, b).unwrap_err(), error);
    assert_eq!(&world.register_contact_by_key(key, a, b, contact()).unwrap_err(), error);
    assert_eq!((world.hash(), world.arbiter_count()), (hash, count));
    world.step(DT).unwrap();
    world.validate().unwrap();
}

#[test]
fn an_arbiter_of_a_body_with_itself_is_refused() {
    let (mut world, a, _) = two_bodies();
    refuses(&mut world, KEY, a, a, &Error::SameBody { id: a });
    refuses(&mut world, KEY, BodyId::WORLD, BodyId::WORLD, &Error::SameBody { id: BodyId::WORLD });
}

#[test]
fn an_arbiter_of_two_bodies_that_cannot_move_is_refused() {
    let (mut world, a, _) = two_bodies();
    let wall = world.add_body(&BodyDefinition::fixed()).unwrap();
    let lift = world.add_body(&BodyDefinition::kinematic()).unwrap();
    for (first, second) in [(wall, BodyId::WORLD), (wall, lift), (lift, wall)] {
        refuses(&mut world, KEY, first, second, &Error::NeitherMoves { body1: first, body2: second });
    }
    assert!(world.get_or_create_arbiter(KEY, lift, a).is_ok());
}

#[test]
fn an_arbiter_of_a_disabled_body_is_refused() {
    let (mut world, a, b) = two_bodies();
    world.body_mut(a).unwrap().set_enabled(false).unwrap();
    refuses(&mut world, KEY, a, b, &Error::BodyDisabled { id: a });
    refuses(&mut world, KEY, b, a, &Error::BodyDisabled { id: a });
}

#[test]
fn removed_and_foreign_bodies_are_unknown() {
    let (mut world, a, b) = two_bodies();
    world.remove_body(b).unwrap();
    refuses(&mut world, KEY, a, b, &Error::UnknownBody { id: b });
    refuses(&mut world, KEY, b, a, &Error::UnknownBody { id: b });
    let again = add_bare(&mut world, Vec3::X);
    assert_eq!(again.index(), b.index(), "the slot is used again");
    refuses(&mut world, KEY, a, b, &Error::UnknownBody { id: b });
    let (_, foreign, _) = two_bodies();
    refuses(&mut world, KEY, a, foreign, &Error::UnknownBody { id: foreign });
    assert_eq!(world.arbiters_of(foreign).count(), 0);
}

#[test]
fn a_key_in_use_with_other_bodies_is_refused() {
    let (mut world, a, b) = two_bodies();
    let id = world.register_contact_by_key(KEY, a, b, contact()).unwrap();
    refuses(&mut world, KEY, b, a, &Error::KeyInUse { key: KEY, body1: a, body2: b });
    refuses(&mut world, KEY, BodyId::WORLD, a, &Error::KeyInUse { key: KEY, body1: a, body2: b });
    assert_eq!(world.get_or_create_arbiter(KEY, a, b).unwrap(), id);
}

#[test]
fn normals_must_be_finite_and_of_unit_length() {
    let (mut world, a, b) = two_bodies();
    let id = world.register_contact_by_key(KEY, a, b, contact()).unwrap();
    let hash = world.hash();
    for length in [0.0, 0.998, 1.002, 3.0] {
        let bad = ContactPoint { normal: Vec3::X * length, ..contact() };
        let error = world.register_contact(id, bad).unwrap_err();
        assert_eq!(error, Error::NotUnit { what: "normal", value: bad.normal, length });
        assert!(error.to_string().contains("normalise"), "{error}");
        assert_eq!(world.register_contact_by_key(ArbiterKey::new(1, 1), a, b, bad).unwrap_err(), error);
        let mut data = *world.arbiter_by_id(id).unwrap().data();
        assert_eq!(data.set_normal(0, bad.normal).unwrap_err(), error);
    }
    for value in [f32::NAN, f32::INFINITY] {
        let bad = ContactPoint { normal: Vec3::new(value, 0.0, 0.0), ..contact() };
        let error = world.register_contact(id, bad).unwrap_err();
        assert!(matches!(error, Error::NotFiniteVector { what: "normal", .. }), "{error}");
    }
    assert_eq!((world.hash(), world.arbiter_count()), (hash, 1), "nothing has changed and no arbiter was made");
    for length in [0.9995, 1.0005] {
        world.register_contact(id, ContactPoint { normal: Vec3::X * length, ..contact() }).unwrap();
        let normal = world.arbiter_by_id(id).unwrap().data().contact(0).unwrap().normal();
        assert!((normal.length() - 1.0).abs() < 1e-6, "within the tolerance it is normalised");
    }
}

#[test]
fn points_must_be_finite() {
    let (mut world, a, b) = two_bodies();
    let id = world.get_or_create_arbiter(KEY, a, b).unwrap();
    for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let bad = Vec3::new(0.0, value, 0.0);
        let first = world.register_contact(id, ContactPoint { point1: bad, ..contact() }).unwrap_err();
        assert!(matches!(first, Error::NotFiniteVector { what: "point1", .. }), "{first}");
        let second = world.register_contact(id, ContactPoint { point2: bad, ..contact() }).unwrap_err();
        assert!(matches!(second, Error::NotFiniteVector { what: "point2", .. }), "{second}");
    }
    assert_eq!(world.contact_count(), 0);
}

#[test]
fn stale_and_foreign_arbiter_ids_are_errors() {
    let (mut world, a, b) = two_bodies();
    let (mut other, c, d) = two_bodies();
    let id = world.register_contact_by_key(KEY, a, b, contact()).unwrap();
    let foreign = other.register_contact_by_key(KEY, c, d, contact()).unwrap();
    assert!(world.arbiter_by_id(foreign).is_none() && other.arbiter_by_id(id).is_none());
    world.remove_arbiter(id).unwrap();
    for stale in [id, foreign] {
        assert_eq!(world.remove_arbiter(stale).unwrap_err(), Error::UnknownArbiter { id: stale });
        assert_eq!(world.register_contact(stale, contact()).unwrap_err(), Error::UnknownArbiter { id: stale });
        assert!(world.arbiter_mut(stale).is_none());
    }
    // The next arbiter takes the place: the old id still finds nothing.
    let next = world.register_contact_by_key(KEY, a, b, contact()).unwrap();
    assert_ne!(next, id);
    assert!(world.arbiter_by_id(id).is_none() && world.remove_arbiter(id).is_err());
}

/// Listeners meet the same errors, for what they hold of earlier steps.
#[test]
fn stale_ids_are_errors_inside_listeners() {
    let (mut world, (a, sa), (b, _)) = touching_pair();
    let (gone, gone_shape) = add_sphere(&mut world, Vec3::new(0.0, 50.0, 0.0));
    let gone_arbiter = world.get_or_create_arbiter(KEY, BodyId::WORLD, gone).unwrap();
    world.remove_body(gone).unwrap();
    let errors: Log<Error> = Log::default();
    let log = errors.clone();
    world.on_begin_collide(Box::new(move |context, _| {
        log.push(context.remove_body(gone).unwrap_err());
        log.push(context.remove_shape(gone_shape).unwrap_err());
        log.push(context.remove_arbiter(gone_arbiter).unwrap_err());
        log.push(context.register_contact(gone_arbiter, contact()).unwrap_err());
        log.push(context.get_or_create_arbiter(KEY, a, gone).unwrap_err());
        log.push(context.remove_body(BodyId::WORLD).unwrap_err());
        assert!(context.body(gone).is_none() && context.shape(gone_shape).is_none());
        assert!(context.arbiter(gone_arbiter).is_none() && context.arbiter_mut(gone_arbiter).is_none());
    }));
    world.step(DT).unwrap();
    assert_eq!(
        errors.all(),
        [
            Error::UnknownBody { id: gone },
            Error::UnknownShape { id: gone_shape },
            Error::UnknownArbiter { id: gone_arbiter },
            Error::UnknownArbiter { id: gone_arbiter },
            Error::UnknownBody { id: gone },
            Error::WorldBody,
        ]
    );
    assert_eq!((world.body(a).unwrap().shapes(), world.arbiters_of(b).count()), (&[sa][..], 1));
}

#[test]
fn edits_of_contact_data_are_checked() {
    let (mut world, a, b) = two_bodies();
    let id = world.register_contact_by_key(KEY, a, b, contact()).unwrap();
    let before = *world.arbiter_by_id(id).unwrap().data();
    let data = world.arbiter_mut(id).unwrap().data_mut();
    for bad in [-0.1, f32::NAN, f32::INFINITY] {
        assert!(data.set_friction(bad).is_err() && data.set_restitution(bad).is_err());
        assert!(data.set_rolling_resistance(bad).is_err());
        assert!(data.set_tangent_velocity(Vec3::new(0.0, bad.sqrt(), 0.0)).is_err());
    }
    assert!(data.set_restitution(1.1).is_err());
    for slot in [1, 3, 4, usize::MAX] {
        assert_eq!(data.set_normal(slot, Vec3::Y).unwrap_err(), Error::EmptySlot { slot, mask: 1 });
        assert_eq!(data.remove_contact(slot).unwrap_err(), Error::EmptySlot { slot, mask: 1 });
        assert!(data.contact(slot).is_none());
    }
    assert_eq!(world.arbiter_by_id(id).unwrap().data(), &before);
}

/// Contacts that lie far off or overlap by metres are legal, and stay finite.
#[test]
fn absurd_but_finite_contacts_do_no_harm() {
    let (mut world, a, b) = two_bodies();
    for far in [1e3, 1e6, 1e15] {
        for separation in [-far, 0.0, far] {
            let point = Vec3::splat(far);
            let contact = ContactPoint::new(point, point + Vec3::X * separation, Vec3::X);
            world.register_contact_by_key(ArbiterKey::new(far as u64, 1), a, b, contact).unwrap();
            world.step(DT).unwrap();
            world.validate().unwrap();
        }
    }
}
