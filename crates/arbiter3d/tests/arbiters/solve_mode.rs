//! Which velocity parts a contact changes, and that only masses which take part count.

use crate::support::*;
use arbiter3d::math::{SymmetricMat3, Vec3};
use arbiter3d::*;

const DT_SMALL: f32 = 1e-3;

/// All 16 sets.
fn modes() -> impl Iterator<Item = SolveMode> {
    let parts = [SolveMode::LINEAR_BODY1, SolveMode::ANGULAR_BODY1, SolveMode::LINEAR_BODY2, SolveMode::ANGULAR_BODY2];
    (0..16_u8).map(move |bits| {
        let chosen = parts.iter().enumerate().filter(|(i, _)| bits >> i & 1 == 1);
        chosen.fold(SolveMode::NONE, |set, (_, &part)| set | part)
    })
}

/// Velocities of two free bodies (2 kg at the origin, 4 kg at x = 1) after body 1 came at body 2 with 1 m/s along the
/// normal x, touching 30 cm above both centres: (linear 1, angular 1, linear 2, angular 2, impulse).
fn collide(prepare: impl Fn(&mut World, BodyId, BodyId)) -> ([Vec3; 4], f32) {
    let mut world = weightless();
    let body = |world: &mut World, x: f32, mass: f32, moment: f32| {
        let inertia = SymmetricMat3::diagonal(Vec3::splat(moment));
        let mass = Some(MassProperties { mass, center: Vec3::ZERO, inertia });
        world.add_body(&BodyDefinition { mass, ..BodyDefinition::dynamic().at(Vec3::new(x, 0.0, 0.0)) }).unwrap()
    };
    let (a, b) = (body(&mut world, 0.0, 2.0, 0.4), body(&mut world, 1.0, 4.0, 1.0));
    world.body_mut(a).unwrap().set_linear_velocity(Vec3::X).unwrap();
    prepare(&mut world, a, b);
    let key = ArbiterKey::new(1, 2);
    let id = world.arbiter(key).unwrap().id();
    world.arbiter_mut(id).unwrap().data_mut().set_friction(0.0).unwrap();
    world.step(DT_SMALL).unwrap();
    let [a, b] = [a, b].map(|id| world.body(id).unwrap());
    let impulse = world.arbiter(key).unwrap().data().contact(0).unwrap().total_normal_impulse();
    ([a.linear_velocity(), a.angular_velocity(), b.linear_velocity(), b.angular_velocity()], impulse)
}

fn register(world: &mut World, a: BodyId, b: BodyId, remove: SolveMode) -> ArbiterId {
    let point = Vec3::new(0.5, 0.3, 0.0);
    let contact = ContactPoint::new(point, point, Vec3::X).without(remove);
    world.register_contact_by_key(ArbiterKey::new(1, 2), a, b, contact).unwrap()
}

/// N3: with `K` the sum of the terms of the parts that take part, the impulse that stops the approach is 1/K.
#[track_caller]
fn check(mode: SolveMode, velocities: [Vec3; 4], impulse: f32) {
    let has = |part| if mode.contains(part) { 1.0_f32 } else { 0.0 };
    let [l1, a1] = [has(SolveMode::LINEAR_BODY1), has(SolveMode::ANGULAR_BODY1)];
    let [l2, a2] = [has(SolveMode::LINEAR_BODY2), has(SolveMode::ANGULAR_BODY2)];
    let lever = 0.3_f32;
    let k = l1 / 2.0 + a1 * lever * lever / 0.4 + l2 / 4.0 + a2 * lever * lever / 1.0;
    let expected = if k > 0.0 { 1.0 / k } else { 0.0 };
    assert!((impulse - expected).abs() <= 2e-3 * expected, "{mode:?}: impulse {impulse}, not {expected}");
    let turn = Vec3::new(0.0, 0.0, lever * expected);
    let wanted = [
        Vec3::X - Vec3::X * (l1 * expected / 2.0),
        turn * (a1 / 0.4),
        Vec3::X * (l2 * expected / 4.0),
        turn * (-a2 / 1.0),
    ];
    for (found, wanted) in velocities.into_iter().zip(wanted) {
        assert_close(found, wanted, 5e-3);
    }
    // What does not take part is left alone to the bit.
    for (part, (found, before)) in
        [l1, a1, l2, a2].into_iter().zip(velocities.into_iter().zip([Vec3::X, Vec3::ZERO, Vec3::ZERO, Vec3::ZERO]))
    {
        assert!(part == 1.0 || found == before, "{mode:?}: {found}");
    }
}

#[test]
fn all_solve_modes_use_only_the_masses_that_take_part() {
    for mode in modes() {
        let (velocities, impulse) = collide(|world, a, b| {
            let id = register(world, a, b, SolveMode::NONE);
            world.arbiter_mut(id).unwrap().data_mut().set_solve_mode(mode);
        });
        check(mode, velocities, impulse);
    }
}

#[test]
fn all_remove_flags_do_the_opposite_of_the_solve_mode() {
    for remove in modes() {
        let (velocities, impulse) = collide(|world, a, b| {
            register(world, a, b, remove);
        });
        check(!remove, velocities, impulse);
    }
}

/// Remove flags belong to the contact that came with them, not to the arbiter nor to what is registered later.
#[test]
fn remove_flags_hold_for_their_contact_alone() {
    let mut world = weightless();
    let body = add_bare(&mut world, Vec3::ZERO);
    world.body_mut(body).unwrap().set_linear_velocity(Vec3::new(0.0, -1.0, 0.0)).unwrap();
    let key = ArbiterKey::new(1, 2);
    let at = |x: f32| ContactPoint::new(Vec3::new(x, 0.0, 0.0), Vec3::new(x, 0.0, 0.0), Vec3::Y);
    world.register_contact_by_key(key, BodyId::WORLD, body, at(-0.3).without(SolveMode::FULL)).unwrap();
    world.register_contact_by_key(key, BodyId::WORLD, body, at(0.3)).unwrap();
    let data = *world.arbiter(key).unwrap().data();
    assert_eq!(
        (data.contact(0).unwrap().removed(), data.contact(1).unwrap().removed()),
        (SolveMode::FULL, SolveMode::NONE)
    );
    assert_eq!(data.solve_mode(), SolveMode::FULL, "the arbiter's own mode is untouched");
    world.step(DT_SMALL).unwrap();
    let data = world.arbiter(key).unwrap().data();
    let [dead, live] = [0, 1].map(|slot| data.contact(slot).unwrap().total_normal_impulse());
    assert_eq!(dead, 0.0);
    // The live one alone: 1/(1/2 + 0.3²/0.4).
    assert!((live - 1.0 / 0.725).abs() < 5e-3, "{live}");
    // Registered again without flags, the point acts again.
    world.register_contact_by_key(key, BodyId::WORLD, body, at(-0.3)).unwrap();
    assert_eq!(world.arbiter(key).unwrap().data().contact(0).unwrap().removed(), SolveMode::NONE);
}

/// Parts of bodies that are not dynamic never change, whatever the mode.
#[test]
fn bodies_that_are_not_dynamic_take_no_part() {
    let mut world = weightless();
    let moving = BodyDefinition::kinematic().moving(Vec3::new(0.0, 1.0, 0.0), Vec3::ZERO);
    let lift = world.add_body(&moving).unwrap();
    let body = add_bare(&mut world, Vec3::ZERO);
    let contact = ContactPoint::new(Vec3::ZERO, Vec3::ZERO, Vec3::Y);
    world.register_contact_by_key(ArbiterKey::new(1, 2), lift, body, contact).unwrap();
    world.step(DT_SMALL).unwrap();
    assert_eq!(world.body(lift).unwrap().linear_velocity(), Vec3::Y);
    assert_close(world.body(body).unwrap().linear_velocity(), Vec3::Y, 1e-4);
}

#[test]
fn sets_of_velocity_parts_are_what_their_names_say() {
    assert_eq!(SolveMode::LINEAR, SolveMode::LINEAR_BODY1 | SolveMode::LINEAR_BODY2);
    assert_eq!(SolveMode::ANGULAR, SolveMode::ANGULAR_BODY1 | SolveMode::ANGULAR_BODY2);
    assert_eq!(SolveMode::FULL_BODY1, SolveMode::LINEAR_BODY1 | SolveMode::ANGULAR_BODY1);
    assert_eq!(SolveMode::FULL_BODY2, SolveMode::LINEAR_BODY2 | SolveMode::ANGULAR_BODY2);
    assert_eq!(SolveMode::FULL, SolveMode::LINEAR | SolveMode::ANGULAR);
    assert_eq!(modes().map(SolveMode::bits).collect::<Vec<_>>(), (0..16).collect::<Vec<_>>());
    assert!(modes().all(|mode| !mode & mode == SolveMode::NONE && !mode | mode == SolveMode::FULL));
}
