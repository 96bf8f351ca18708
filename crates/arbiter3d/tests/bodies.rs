//! Bodies and shapes: kinds, teleports, enabling, filters, ids, user data.

mod common;

use arbiter3d::math::{Quat, Vec3};
use arbiter3d::{
    BodyDefinition, BodyId, BodyKind, Error, Filter, Material, QueryFilter, Shape, ShapeDefinition, World,
};
use arbiter3d::{EndReason, math::Aabb};
use common::*;

/// Number of contacts of a body.
fn contacts(world: &World, body: BodyId) -> usize {
    world.arbiters_of(body).map(|arbiter| arbiter.data().contact_count()).sum()
}

fn others(world: &World, body: BodyId) -> Vec<BodyId> {
    let mut others: Vec<_> = world.arbiters_of(body).filter_map(|arbiter| arbiter.other_body(body)).collect();
    others.sort();
    others
}

/// A platform and two boxes on it, a second later.
fn platform() -> (World, [BodyId; 3]) {
    let mut world = sleepless();
    let base = BodyDefinition::fixed().at(Vec3::Y * -1.0);
    let base = add(&mut world, &base, &ShapeDefinition::new(cuboid(5.0, 1.0, 5.0)));
    let first = drop_shape(&mut world, &cube(0.5), Vec3::Y * 0.5);
    let second = drop_shape(&mut world, &cube(0.5), Vec3::Y * 1.5);
    run_at(&mut world, 1.0, 0.01);
    (world, [base, first, second])
}

/// A static platform ties nothing together; a dynamic one does; each change finds its contacts anew.
#[test]
fn a_platform_may_change_its_kind() {
    let (mut world, [base, first, second]) = platform();
    let island = |world: &World, body: BodyId| world.islands()[body.index() as usize];
    assert_eq!((contacts(&world, base), contacts(&world, first), contacts(&world, second)), (4, 8, 4));
    assert_eq!(island(&world, base), u32::MAX);
    assert_eq!(island(&world, first), island(&world, second));

    // Weightless, so that the platform does not fall away while it is dynamic.
    world.body_mut(base).unwrap().set_kind(BodyKind::Dynamic).unwrap();
    world.body_mut(base).unwrap().set_gravity_scale(0.0).unwrap();
    world.step(0.01).unwrap();
    assert_eq!(others(&world, first), [base, second]);
    assert_eq!(island(&world, base), island(&world, second));

    for kind in [BodyKind::Kinematic, BodyKind::Static] {
        world.body_mut(base).unwrap().set_kind(kind).unwrap();
        if kind == BodyKind::Kinematic {
            world.body_mut(base).unwrap().set_linear_velocity(Vec3::ZERO).unwrap();
        }
        run_at(&mut world, 1.0, 0.01);
        assert_eq!((contacts(&world, base), contacts(&world, first), contacts(&world, second)), (4, 8, 4), "{kind:?}");
        assert_eq!(island(&world, base), u32::MAX);
        assert_near(position(&world, second).y - position(&world, base).y, 2.5, 0.01, "height above the platform");
    }
    world.validate().unwrap();
}

/// A box that becomes kinematic in the air-like grip of nothing holds what stands on it, and touches the platform no more.
#[test]
fn a_kinematic_box_holds_what_stands_on_it() {
    let (mut world, [base, first, second]) = platform();
    world.body_mut(first).unwrap().set_kind(BodyKind::Kinematic).unwrap();
    assert_eq!(contacts(&world, base), 0, "the change ends the arbiters at once");
    world.body_mut(first).unwrap().set_linear_velocity(Vec3::ZERO).unwrap();
    run_at(&mut world, 1.0, 0.01);
    assert_eq!((contacts(&world, base), contacts(&world, first), contacts(&world, second)), (0, 4, 4));
    assert_near(position(&world, second).y, 1.5, 0.01, "height");
    let reasons: Vec<EndReason> = {
        world.body_mut(first).unwrap().set_kind(BodyKind::Dynamic).unwrap();
        world.drain_end_events().map(|event| event.reason).collect()
    };
    assert!(reasons.contains(&EndReason::KindChanged), "{reasons:?}");
}

/// Mass stays known whatever the kind; only dynamic bodies show it; static ones lose their velocity.
#[test]
fn kinds_and_mass_and_velocity() {
    let mut world = weightless();
    let body = BodyDefinition::dynamic().moving(Vec3::X, Vec3::Y);
    let body = add(&mut world, &body, &ShapeDefinition::new(cube(0.5)));
    assert_eq!(world.body(body).unwrap().mass(), 1000.0);
    for kind in [BodyKind::Kinematic, BodyKind::Static] {
        world.body_mut(body).unwrap().set_kind(kind).unwrap();
        let read = world.body(body).unwrap();
        assert_eq!((read.kind(), read.mass(), read.mass_properties().mass), (kind, 0.0, 1000.0));
        assert_eq!(read.inverse_inertia().xx, 0.0);
    }
    assert_eq!((velocity(&world, body), spin(&world, body)), (Vec3::ZERO, Vec3::ZERO), "static bodies do not move");
    let refused = world.body_mut(body).unwrap().set_linear_velocity(Vec3::X);
    assert_eq!(refused, Err(Error::StaticBody { id: body }));
    world.body_mut(body).unwrap().set_kind(BodyKind::Dynamic).unwrap();
    assert_eq!(world.body(body).unwrap().mass(), 1000.0);
    world.body_mut(body).unwrap().apply_impulse(Vec3::X * 1000.0).unwrap();
    assert_eq!(velocity(&world, body), Vec3::X);
}

/// The world's own body is static, has no mass, carries shapes, and cannot be removed, moved or changed.
#[test]
fn the_worlds_own_body() {
    let mut world = world();
    let own = world.body(BodyId::WORLD).unwrap();
    assert_eq!((own.kind(), own.mass(), own.position()), (BodyKind::Static, 0.0, Vec3::ZERO));
    assert_eq!(world.remove_body(BodyId::WORLD), Err(Error::WorldBody));
    let mut own = world.body_mut(BodyId::WORLD).unwrap();
    assert_eq!(own.set_position(Vec3::X), Err(Error::WorldBody));
    assert_eq!(own.set_kind(BodyKind::Dynamic), Err(Error::WorldBody));
    assert_eq!(own.set_enabled(false), Err(Error::WorldBody));
    assert!(own.set_linear_velocity(Vec3::X).is_err());
    let shape = world.add_shape(BodyId::WORLD, &ShapeDefinition::new(sphere(1.0))).unwrap();
    let mut ball = BodyDefinition::dynamic().at(Vec3::X * 1.5);
    ball.gravity_scale = 0.0;
    let ball = add(&mut world, &ball, &ShapeDefinition::new(sphere(1.0)));
    world.step(DT).unwrap();
    assert_eq!(contacts(&world, ball), 1);
    world.remove_shape(shape).unwrap();
    world.step(DT).unwrap();
    assert_eq!((contacts(&world, ball), world.body(BodyId::WORLD).unwrap().shapes().len()), (0, 0));
}

/// A teleport moves the boxes at once: queries see it without a step.
#[test]
fn a_teleport_is_seen_at_once() {
    let mut world = weightless();
    let ball = drop_shape(&mut world, &sphere(1.0), Vec3::ZERO);
    let filter = QueryFilter::default();
    let near = Aabb::from_center(Vec3::ZERO, Vec3::splat(2.0));
    let far = Aabb::from_center(Vec3::X * 10.0, Vec3::splat(2.0));
    assert_eq!((world.overlap_aabb(&near, &filter).len(), world.overlap_aabb(&far, &filter).len()), (1, 0));
    world.body_mut(ball).unwrap().set_position(Vec3::X * 10.0).unwrap();
    assert_eq!((world.overlap_aabb(&near, &filter).len(), world.overlap_aabb(&far, &filter).len()), (0, 1));
    // A turn changes the box as well: 4 × 2 × 2 on end is 2 × 4 × 2.
    let block = drop_shape(&mut world, &cuboid(2.0, 1.0, 1.0), Vec3::Y * 50.0);
    world.body_mut(block).unwrap().set_rotation(turn(Vec3::Z, 90.0)).unwrap();
    let size = world.shape(world.body(block).unwrap().shapes()[0]).unwrap().aabb().half_extents();
    assert!(size.distance(Vec3::new(1.0, 2.0, 1.0)) < 1e-5, "{size}");
}

/// A teleport clears the cached contacts; what still touches is found again in the next step by the same arbiter.
#[test]
fn a_teleport_clears_cached_contacts() {
    let mut world = weightless();
    drop_shape(&mut world, &sphere(1.0), Vec3::ZERO);
    let b = drop_shape(&mut world, &sphere(1.0), Vec3::X * 1.5);
    world.step(DT).unwrap();
    let before = world.arbiters_of(b).next().unwrap().id();
    assert_eq!(contacts(&world, b), 1);
    world.body_mut(b).unwrap().set_position(Vec3::X * 1.4).unwrap();
    assert_eq!(contacts(&world, b), 0, "no contacts until the next step");
    world.step(DT).unwrap();
    assert_eq!(contacts(&world, b), 1);
    assert_eq!(world.arbiters_of(b).next().unwrap().id(), before);
    world.body_mut(b).unwrap().set_position(Vec3::X * 50.0).unwrap();
    world.step(DT).unwrap();
    assert!(world.arbiters_of(b).next().is_none() && world.arbiter_count() == 0);
}

/// A stack does not jump when a body of it is placed where it stands.
#[test]
fn placing_a_body_where_it_is_does_not_shake_the_stack() {
    let (mut world, [_, first, second]) = platform();
    for _ in 0..30 {
        let place = position(&world, first);
        world.body_mut(first).unwrap().set_position(place).unwrap();
        run_at(&mut world, 0.1, 0.01);
        assert!(velocity(&world, second).length() < 0.05, "{}", velocity(&world, second));
    }
    assert_near(position(&world, second).y, 1.5, 0.01, "height");
}

/// A disabled body neither moves nor collides nor is found, and comes back as it was.
#[test]
fn a_disabled_body_is_not_there() {
    let (mut world, [_, first, second]) = platform();
    world.body_mut(first).unwrap().set_enabled(false).unwrap();
    assert!(!world.body(first).unwrap().is_enabled());
    assert_eq!(contacts(&world, first), 0);
    let reasons: Vec<EndReason> = world.drain_end_events().map(|event| event.reason).collect();
    assert_eq!(reasons, [EndReason::BodyDisabled; 2]);
    let place = position(&world, first);
    run(&mut world, 1.0);
    assert_eq!(position(&world, first), place);
    assert_near(position(&world, second).y, 0.5, 0.02, "what stood on it has fallen");
    let found = world.overlap_aabb(&Aabb::from_center(place, Vec3::splat(0.4)), &QueryFilter::default());
    assert!(found.iter().all(|&shape| world.shape(shape).unwrap().body() != first));
    world.body_mut(first).unwrap().set_position(Vec3::Y * 3.0).unwrap();
    world.body_mut(first).unwrap().set_enabled(true).unwrap();
    run(&mut world, 2.0);
    assert_near(position(&world, first).y, 1.5, 0.02, "it falls on the other");
    world.validate().unwrap();
}

/// A body may start disabled.
#[test]
fn a_body_may_start_disabled() {
    let mut world = sleepless();
    let body = BodyDefinition { enabled: false, ..BodyDefinition::dynamic() };
    let body = add(&mut world, &body, &ShapeDefinition::new(cube(0.5)));
    run(&mut world, 0.5);
    assert_eq!(position(&world, body), Vec3::ZERO);
    world.body_mut(body).unwrap().set_enabled(true).unwrap();
    run(&mut world, 0.5);
    assert!(position(&world, body).y < -1.0);
}

/// User data of bodies and shapes comes back as it was given.
#[test]
fn user_data_is_kept() {
    let mut world = world();
    let body = BodyDefinition { user_data: u128::MAX - 5, ..BodyDefinition::dynamic() };
    let body = world.add_body(&body).unwrap();
    let shape = ShapeDefinition { user_data: 1 << 100, ..ShapeDefinition::new(cube(0.5)) };
    let shape = world.add_shape(body, &shape).unwrap();
    run(&mut world, 0.1);
    assert_eq!(
        (world.body(body).unwrap().user_data(), world.shape(shape).unwrap().user_data()),
        (u128::MAX - 5, 1 << 100)
    );
    world.body_mut(body).unwrap().set_user_data(3);
    world.shape_mut(shape).unwrap().set_user_data(4);
    assert_eq!((world.body(body).unwrap().user_data(), world.shape(shape).unwrap().user_data()), (3, 4));
}

/// Categories and masks decide on both sides; a shared group overrules them.
#[test]
fn filters_decide_who_collides() {
    let filter = |category, mask, group| Filter { category, mask, group };
    let cases = [
        (filter(1, !0, 0), filter(1, !0, 0), true),
        (filter(1, 2, 0), filter(2, 1, 0), true),
        (filter(1, 2, 0), filter(2, 2, 0), false),
        (filter(1, 1, 0), filter(2, 1, 0), false),
        (filter(1, !0, -3), filter(1, !0, -3), false),
        (filter(1, 0, 3), filter(1, 0, 3), true),
        (filter(1, !0, -3), filter(1, !0, -4), true),
        (filter(1, 0, 3), filter(1, 0, 4), false),
        (filter(1 << 63, 1 << 62, 0), filter(1 << 62, 1 << 63, 0), true),
    ];
    for (a, b, collide) in cases {
        let mut world = sleepless();
        world.add_shape(BodyId::WORLD, &ShapeDefinition::new(cuboid(5.0, 1.0, 5.0)).at(-Vec3::Y).filter(a)).unwrap();
        let ball = BodyDefinition::dynamic().at(Vec3::Y);
        let ball = add(&mut world, &ball, &ShapeDefinition::new(sphere(0.5)).filter(b));
        run(&mut world, 2.0);
        assert_eq!(position(&world, ball).y > 0.4, collide, "{a:?} and {b:?}: {}", position(&world, ball));
    }
}

/// A filter that changes ends what it forbids at once, and lets begin what it allows.
#[test]
fn a_filter_may_change() {
    let (mut world, [base, first, _]) = platform();
    let shape = world.body(base).unwrap().shapes()[0];
    world.shape_mut(shape).unwrap().set_filter(Filter { mask: 0, ..Filter::default() });
    assert_eq!(contacts(&world, base), 0);
    assert_eq!(world.drain_end_events().next().unwrap().reason, EndReason::FilterChanged);
    run(&mut world, 0.3);
    let fallen = position(&world, first).y;
    assert!(fallen < 0.2, "{fallen}");
    world.body_mut(first).unwrap().set_position(Vec3::Y * 0.6).unwrap();
    world.body_mut(first).unwrap().set_linear_velocity(Vec3::ZERO).unwrap();
    world.shape_mut(shape).unwrap().set_filter(Filter::default());
    run(&mut world, 1.0);
    assert!(contacts(&world, base) >= 4);
}

/// A material changed on a live body counts in the next step: a box that stuck slides.
#[test]
fn a_material_may_change_under_a_resting_body() {
    let mut world = sleepless();
    let tilt = turn(Vec3::Z, -20.0);
    let ramp = BodyDefinition::fixed().rotated(tilt).at(tilt * -Vec3::Y);
    let ramp = add(&mut world, &ramp, &ShapeDefinition::new(cuboid(50.0, 1.0, 5.0)).friction(0.0));
    let block = BodyDefinition::dynamic().rotated(tilt).at(tilt * (Vec3::Y * 0.5));
    let block = add(&mut world, &block, &ShapeDefinition::new(cube(0.5)).friction(0.8));
    run(&mut world, 1.0);
    assert!(velocity(&world, block).length() < 1e-3);
    let shape = world.body(block).unwrap().shapes()[0];
    world.shape_mut(shape).unwrap().set_material(Material { friction: 0.0, ..Material::default() }).unwrap();
    run(&mut world, 1.0);
    let expected = GRAVITY * libm::sin(20.0_f64.to_radians()) as f32;
    assert_relative(velocity(&world, block).length(), expected, 0.01, "speed without friction");
    assert!(world.body(ramp).is_some());
}

/// A density that changes changes the mass.
#[test]
fn a_density_may_change() {
    let mut world = world();
    let body = drop_shape(&mut world, &cube(0.5), Vec3::ZERO);
    let shape = world.body(body).unwrap().shapes()[0];
    world.shape_mut(shape).unwrap().set_density(10.0).unwrap();
    assert_relative(world.body(body).unwrap().mass(), 10.0, 1e-6, "mass");
}

/// Several shapes make one body, each with its own arbiter; shapes of one body do not meet.
#[test]
fn a_body_of_several_shapes() {
    let mut world = sleepless();
    floor(&mut world, 0.5);
    let table = world.add_body(&BodyDefinition::dynamic().at(Vec3::Y * 1.0)).unwrap();
    world.add_shape(table, &ShapeDefinition::new(cuboid(1.0, 0.1, 1.0)).at(Vec3::Y * 0.1)).unwrap();
    for (x, z) in [(-0.8, -0.8), (-0.8, 0.8), (0.8, -0.8), (0.8, 0.8)] {
        world.add_shape(table, &ShapeDefinition::new(cuboid(0.1, 0.5, 0.1)).at(Vec3::new(x, -0.5, z))).unwrap();
    }
    run(&mut world, 2.0);
    assert_near(position(&world, table).y, 1.0, 0.01, "height");
    assert_eq!(world.arbiters_of(table).count(), 4, "one a leg");
    assert!(world.body(table).unwrap().rotation().dot(Quat::IDENTITY) > 1.0 - 1e-6);
    let legs: Vec<_> = world.body(table).unwrap().shapes()[1..3].to_vec();
    for leg in legs {
        world.remove_shape(leg).unwrap();
    }
    run(&mut world, 2.0);
    assert!(world.body(table).unwrap().rotation().dot(Quat::IDENTITY) < 0.99, "without two legs it falls over");
}

/// Clearing a world leaves its own body, and the world can be used again.
#[test]
fn a_world_can_be_cleared() {
    let (mut world, bodies) = platform();
    world.clear();
    assert_eq!((world.body_count(), world.arbiter_count(), world.contact_count(), world.awake_count()), (0, 0, 0, 0));
    assert!(bodies.iter().all(|&body| world.body(body).is_none()) && world.body(BodyId::WORLD).is_some());
    floor(&mut world, 0.5);
    let block = drop_shape(&mut world, &cube(0.5), Vec3::Y);
    run(&mut world, 1.0);
    assert_near(position(&world, block).y, 0.5, 0.01, "height");
    world.validate().unwrap();
}

/// Adding and removing at random for a while keeps every record in order.
#[test]
fn adding_and_removing_keeps_the_world_in_order() {
    let mut world = world();
    floor(&mut world, 0.5);
    let mut random = Random(21);
    let mut bodies: Vec<BodyId> = Vec::new();
    for step in 0..600 {
        if bodies.len() < 60 || random.bits().is_multiple_of(2) {
            let place = Vec3::new(random.range(-3.0, 3.0), random.range(0.5, 4.0), random.range(-3.0, 3.0));
            let shape = random.shape();
            bodies.push(drop_shape(&mut world, &shape, place));
        } else {
            let at = random.bits() as usize % bodies.len();
            world.remove_body(bodies.swap_remove(at)).unwrap();
        }
        if step % 7 == 0 {
            let at = random.bits() as usize % bodies.len();
            let kind = [BodyKind::Static, BodyKind::Kinematic, BodyKind::Dynamic][random.bits() as usize % 3];
            world.body_mut(bodies[at]).unwrap().set_kind(kind).unwrap();
        }
        world.step(DT).unwrap();
        if step % 20 == 0 {
            world.validate().unwrap();
        }
    }
    assert_eq!(world.body_count(), bodies.len());
}

/// What a definition says of mass and continuous collision can be read back.
#[test]
fn given_mass_and_continuity_are_told() {
    let mut world = World::default();
    let plain = world.add_body(&BodyDefinition::dynamic()).unwrap();
    let sum = world.body(plain).unwrap().mass_properties();
    let mut given = sum;
    given.mass = 7.0;
    let definition = BodyDefinition { mass: Some(given), continuous: false, ..BodyDefinition::dynamic() };
    let heavy = world.add_body(&definition).unwrap();
    let read = |world: &World, id: BodyId| {
        let body = world.body(id).unwrap();
        (body.given_mass().map(|mass| mass.mass), body.is_continuous())
    };
    assert_eq!(read(&world, plain), (None, true));
    assert_eq!(read(&world, heavy), (Some(7.0), false));
    world.body_mut(heavy).unwrap().set_mass(None).unwrap();
    world.body_mut(heavy).unwrap().set_continuous(true);
    assert_eq!(read(&world, heavy), (None, true));
}

/// Ten thousand bodies with one hull hold one hull, and those that go let go of it.
#[test]
fn bodies_share_their_geometry() {
    let mut world = weightless();
    let rock = icosahedron(0.5);
    let Shape::Hull(hull) = &rock else { panic!("an icosahedron is a hull") };
    let definition = ShapeDefinition::new(rock.clone());
    let before = std::sync::Arc::strong_count(hull);
    let bodies: Vec<BodyId> = (0..10_000)
        .map(|k| {
            let at = Vec3::new((k % 100) as f32, (k / 100) as f32, 0.0) * 2.0;
            add(&mut world, &BodyDefinition::dynamic().at(at), &definition)
        })
        .collect();
    assert_eq!(std::sync::Arc::strong_count(hull), before + 10_000);
    for body in &bodies[..5_000] {
        world.remove_body(*body).unwrap();
    }
    assert_eq!(std::sync::Arc::strong_count(hull), before + 5_000);
}
