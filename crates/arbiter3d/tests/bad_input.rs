//! Bad input: error values that name the argument, nothing changed, nothing spread.

mod common;

use arbiter3d::math::{Quat, SymmetricMat3, Vec3};
use arbiter3d::{
    ArbiterKey, BodyDefinition, BodyId, CombineRule, ContactPoint, Error, MassProperties, Material, QueryFilter, Shape,
    ShapeDefinition, ShapeError, ShapeId, TriangleMesh, UNIT_TOLERANCE, World, WorldSettings,
};
use common::*;

const BAD: [f32; 3] = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY];

/// Each vector with one bad coordinate.
fn bad_vectors() -> Vec<Vec3> {
    let with = |axis: usize, bad: f32| {
        let mut v = Vec3::ONE;
        v[axis] = bad;
        v
    };
    BAD.iter().flat_map(|&bad| (0..3).map(move |axis| with(axis, bad))).collect()
}

/// Quaternions that are no rotation.
fn bad_rotations() -> Vec<Quat> {
    let mut bad: Vec<Quat> = BAD.iter().map(|&x| Quat::from_xyzw(0.0, x, 0.0, 1.0)).collect();
    bad.push(Quat::from_xyzw(0.0, 0.0, 0.0, 0.0));
    bad.push(Quat::from_xyzw(0.0, 0.0, 0.0, 1.0 + 2.0 * UNIT_TOLERANCE));
    bad.push(Quat::from_xyzw(1.0, 1.0, 1.0, 1.0));
    bad.push(Quat::from_xyzw(3e38, 3e38, 0.0, 0.0));
    bad
}

/// A world with a resting block and a rolling ball.
fn scene() -> (World, BodyId, BodyId) {
    let mut world = sleepless();
    floor(&mut world, 0.5);
    let block = drop_shape(&mut world, &cube(0.5), Vec3::Y * 0.5);
    let ball = BodyDefinition::dynamic().at(Vec3::new(3.0, 0.5, 0.0)).moving(Vec3::X, Vec3::ZERO);
    let ball = add(&mut world, &ball, &ShapeDefinition::new(sphere(0.5)));
    run(&mut world, 0.2);
    (world, block, ball)
}

/// Calls with bad input, asserts the error and that nothing has changed.
#[track_caller]
fn refused<T: std::fmt::Debug>(
    world: &mut World,
    what: &str,
    call: impl FnOnce(&mut World) -> Result<T, Error>,
) -> Error {
    let before = (world.hash(), world.body_count(), world.arbiter_count(), world.awake_count(), *world.settings());
    let error = call(world).expect_err(what);
    let after = (world.hash(), world.body_count(), world.arbiter_count(), world.awake_count(), *world.settings());
    assert_eq!(before, after, "{what}: the world has changed");
    world.validate().unwrap();
    error
}

#[track_caller]
fn refused_naming<T: std::fmt::Debug>(
    world: &mut World,
    name: &str,
    call: impl FnOnce(&mut World) -> Result<T, Error>,
) {
    let message = refused(world, name, call).to_string();
    assert!(message.contains(name), "'{message}' does not name {name}");
}

/// Bodies are refused by name of what is wrong.
#[test]
fn bad_body_definitions_are_refused() {
    let (mut world, _, _) = scene();
    let good = BodyDefinition::dynamic;
    for v in bad_vectors() {
        refused_naming(&mut world, "position", |w| w.add_body(&good().at(v)));
        refused_naming(&mut world, "linear_velocity", |w| w.add_body(&good().moving(v, Vec3::ZERO)));
        refused_naming(&mut world, "angular_velocity", |w| w.add_body(&good().moving(Vec3::ZERO, v)));
        let mass = MassProperties { mass: 1.0, center: v, inertia: SymmetricMat3::diagonal(Vec3::ONE) };
        refused_naming(&mut world, "centre of mass", |w| w.add_body(&BodyDefinition { mass: Some(mass), ..good() }));
    }
    for q in bad_rotations() {
        refused_naming(&mut world, "rotation", |w| w.add_body(&good().rotated(q)));
    }
    for bad in BAD.into_iter().chain([-1.0, 2e6]) {
        refused_naming(&mut world, "linear_damping", |w| w.add_body(&BodyDefinition { linear_damping: bad, ..good() }));
        refused_naming(&mut world, "angular_damping", |w| {
            w.add_body(&BodyDefinition { angular_damping: bad, ..good() })
        });
    }
    for bad in BAD {
        refused_naming(&mut world, "gravity_scale", |w| w.add_body(&BodyDefinition { gravity_scale: bad, ..good() }));
    }
}

/// Masses that no matter has are refused.
#[test]
fn bad_masses_are_refused() {
    let (mut world, block, _) = scene();
    let unit = SymmetricMat3::diagonal(Vec3::ONE);
    let masses = [
        (0.0, unit),
        (-1.0, unit),
        (f32::NAN, unit),
        (f32::INFINITY, unit),
        (1.0, SymmetricMat3::ZERO),
        (1.0, SymmetricMat3::diagonal(Vec3::new(1.0, 1.0, 0.0))),
        (1.0, SymmetricMat3::diagonal(Vec3::new(1.0, 1.0, f32::NAN))),
        (1.0, SymmetricMat3::diagonal(Vec3::new(-1.0, 1.0, 1.0))),
        (1.0, SymmetricMat3::diagonal(Vec3::new(-1.0, -1.0, 1.0))),
    ];
    for (mass, inertia) in masses {
        let given = Some(MassProperties { mass, center: Vec3::ZERO, inertia });
        let what = format!("mass {mass} with {inertia:?}");
        let error =
            refused(&mut world, &what, |w| w.add_body(&BodyDefinition { mass: given, ..BodyDefinition::dynamic() }));
        assert!(matches!(error, Error::BadMass { .. }), "{error}");
        refused(&mut world, &what, |w| w.body_mut(block).unwrap().set_mass(given));
    }
    assert_relative(world.body(block).unwrap().mass(), 1000.0, 1e-6, "mass");
}

/// All that can be set on a body refuses what is not finite.
#[test]
fn bad_body_changes_are_refused() {
    let (mut world, block, _) = scene();
    for v in bad_vectors() {
        refused_naming(&mut world, "position", |w| w.body_mut(block).unwrap().set_position(v));
        refused_naming(&mut world, "position", |w| w.body_mut(block).unwrap().set_pose(v, Quat::IDENTITY));
        refused_naming(&mut world, "linear_velocity", |w| w.body_mut(block).unwrap().set_linear_velocity(v));
        refused_naming(&mut world, "angular_velocity", |w| w.body_mut(block).unwrap().set_angular_velocity(v));
        refused_naming(&mut world, "force", |w| w.body_mut(block).unwrap().apply_force(v));
        refused_naming(&mut world, "force", |w| w.body_mut(block).unwrap().apply_force_at(v, Vec3::ZERO));
        refused_naming(&mut world, "point", |w| w.body_mut(block).unwrap().apply_force_at(Vec3::X, v));
        refused_naming(&mut world, "torque", |w| w.body_mut(block).unwrap().apply_torque(v));
        refused_naming(&mut world, "impulse", |w| w.body_mut(block).unwrap().apply_impulse(v));
        refused_naming(&mut world, "point", |w| w.body_mut(block).unwrap().apply_impulse_at(Vec3::X, v));
        refused_naming(&mut world, "angular impulse", |w| w.body_mut(block).unwrap().apply_angular_impulse(v));
    }
    for q in bad_rotations() {
        refused_naming(&mut world, "rotation", |w| w.body_mut(block).unwrap().set_rotation(q));
        refused_naming(&mut world, "rotation", |w| w.body_mut(block).unwrap().set_pose(Vec3::ZERO, q));
    }
    for bad in BAD {
        refused_naming(&mut world, "linear_damping", |w| w.body_mut(block).unwrap().set_linear_damping(bad));
        refused_naming(&mut world, "angular_damping", |w| w.body_mut(block).unwrap().set_angular_damping(bad));
        refused_naming(&mut world, "gravity_scale", |w| w.body_mut(block).unwrap().set_gravity_scale(bad));
    }
    // Finite arguments whose result is not.
    refused(&mut world, "a lever too long", |w| {
        w.body_mut(block).unwrap().apply_force_at(Vec3::X * 3e38, Vec3::Y * 3e38)
    });
    refused(&mut world, "an impulse too far out", |w| {
        w.body_mut(block).unwrap().apply_impulse_at(Vec3::X * 3e38, Vec3::Y * 3e38)
    });
    world.body_mut(block).unwrap().apply_force(Vec3::X * 3e38).unwrap();
    refused(&mut world, "forces that add up to infinity", |w| w.body_mut(block).unwrap().apply_force(Vec3::X * 3e38));
    assert_eq!(world.body(block).unwrap().force(), Vec3::X * 3e38);
}

/// A quaternion that is nearly of unit length is normalised.
#[test]
fn nearly_unit_rotations_are_normalised() {
    let mut world = world();
    for factor in [1.0 - 0.9 * UNIT_TOLERANCE, 1.0 + 0.9 * UNIT_TOLERANCE] {
        let exact = turn(Vec3::Y, 37.0);
        let body = world.add_body(&BodyDefinition::dynamic().rotated(exact * factor)).unwrap();
        let q = world.body(body).unwrap().rotation();
        assert_near(q.length(), 1.0, 1e-6, "length");
        assert!(q.dot(exact) > 1.0 - 1e-6);
        world.body_mut(body).unwrap().set_rotation(exact * factor).unwrap();
        assert_near(world.body(body).unwrap().rotation().length(), 1.0, 1e-6, "length");
    }
}

/// Shapes: sizes, offsets, densities and materials.
#[test]
fn bad_shapes_are_refused() {
    for bad in BAD.into_iter().chain([0.0, -1.0]) {
        assert!(Shape::sphere(bad).is_err() && Shape::capsule(bad, 1.0).is_err() && Shape::capsule(1.0, bad).is_err());
        for axis in 0..3 {
            let mut half = Vec3::ONE;
            half[axis] = bad;
            let error = Shape::cuboid(half).unwrap_err();
            assert!(matches!(error, ShapeError::NotPositive { .. }), "{error}");
        }
    }
    let (mut world, block, _) = scene();
    let good = || ShapeDefinition::new(cube(0.5));
    for v in bad_vectors() {
        refused_naming(&mut world, "position", |w| w.add_shape(block, &good().at(v)));
        let material = Material { tangent_velocity: v, ..Material::default() };
        refused_naming(&mut world, "tangent_velocity", |w| w.add_shape(block, &ShapeDefinition { material, ..good() }));
    }
    for q in bad_rotations() {
        refused_naming(&mut world, "rotation", |w| w.add_shape(block, &good().rotated(q)));
    }
    for bad in BAD.into_iter().chain([-0.1]) {
        refused_naming(&mut world, "density", |w| w.add_shape(block, &good().density(bad)));
        refused_naming(&mut world, "friction", |w| w.add_shape(block, &good().friction(bad)));
        refused_naming(&mut world, "restitution", |w| w.add_shape(block, &good().restitution(bad)));
        refused_naming(&mut world, "rolling_resistance", |w| w.add_shape(block, &good().rolling_resistance(bad)));
    }
    refused_naming(&mut world, "restitution", |w| w.add_shape(block, &good().restitution(1.1)));
    let shape = world.body(block).unwrap().shapes()[0];
    for bad in BAD.into_iter().chain([-0.1]) {
        refused_naming(&mut world, "density", |w| w.shape_mut(shape).unwrap().set_density(bad));
        let material = Material { friction: bad, friction_combine: CombineRule::Average, ..Material::default() };
        refused_naming(&mut world, "friction", |w| w.shape_mut(shape).unwrap().set_material(material));
    }
    assert_eq!(world.shape(shape).unwrap().material(), Material::default());
}

/// Hulls and meshes say what is wrong and where.
#[test]
fn bad_hulls_and_meshes_are_refused() {
    let corners = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z];
    assert!(Shape::hull(&corners).is_ok());
    for points in [&corners[..0], &corners[..1], &corners[..3]] {
        assert!(Shape::hull(points).is_err(), "{} points", points.len());
    }
    let flat: Vec<Vec3> = (0..9).map(|i| Vec3::new((i % 3) as f32, 0.0, (i / 3) as f32)).collect();
    assert!(Shape::hull(&flat).is_err(), "flat");
    assert!(Shape::hull(&[Vec3::ONE; 8]).is_err(), "all at one point");
    let line: Vec<Vec3> = (0..8).map(|i| Vec3::ONE * i as f32).collect();
    assert!(Shape::hull(&line).is_err(), "on a line");
    for v in bad_vectors() {
        let message = Shape::hull(&[corners[0], corners[1], v, corners[2], corners[3]]).unwrap_err().to_string();
        assert!(message.contains('2'), "'{message}' names the point");
    }
    let mesh = |vertices: Vec<Vec3>, triangles: Vec<[u32; 3]>| TriangleMesh::new(vertices, triangles);
    assert!(mesh(corners.to_vec(), vec![[0, 1, 2]]).is_ok());
    assert!(mesh(corners.to_vec(), vec![]).is_err(), "no triangle");
    assert!(mesh(vec![], vec![]).is_err(), "nothing");
    let message = mesh(corners.to_vec(), vec![[0, 1, 2], [0, 1, 7]]).unwrap_err().to_string();
    assert!(message.contains('7') && message.contains('1'), "'{message}' names triangle and index");
    let message = mesh(corners.to_vec(), vec![[0, 1, 2], [1, 1, 2]]).unwrap_err().to_string();
    assert!(message.contains('1'), "'{message}' names the triangle without area");
    for v in bad_vectors() {
        let mut vertices = corners.to_vec();
        vertices[1] = v;
        let message = mesh(vertices, vec![[0, 1, 2]]).unwrap_err().to_string();
        assert!(message.contains('1'), "'{message}' names the vertex");
    }
}

/// Time steps: not finite, negative and too long are refused; zero does nothing.
#[test]
fn bad_time_steps_are_refused() {
    let (mut world, _, _) = scene();
    for bad in BAD.into_iter().chain([-1e-9, -1.0, 1.5]) {
        refused_naming(&mut world, "dt", |w| w.step(bad));
    }
    let hash = world.hash();
    world.step(0.0).unwrap();
    assert_eq!(world.hash(), hash);
    for tiny in [1e-9, 1e-7, 1e-5] {
        world.step(tiny).unwrap();
        world.validate().unwrap();
    }
}

/// Settings are refused field by field, in a new world as in an old one.
#[test]
fn bad_settings_are_refused() {
    type Change = fn(&mut WorldSettings, f32);
    let fields: [(&str, Change); 11] = [
        ("gravity", |s, x| s.gravity.y = x),
        ("length_unit", |s, x| s.length_unit = x),
        ("slop", |s, x| s.slop = x),
        ("speculative_distance", |s, x| s.speculative_distance = x),
        ("contact_break_distance", |s, x| s.contact_break_distance = x),
        ("contact_hertz", |s, x| s.contact_hertz = x),
        ("push_out_speed", |s, x| s.push_out_speed = x),
        ("restitution_threshold", |s, x| s.restitution_threshold = x),
        ("hit_speed_threshold", |s, x| s.hit_speed_threshold = x),
        ("time_to_sleep", |s, x| s.time_to_sleep = x),
        ("sleep_speed", |s, x| s.sleep_speed = x),
    ];
    let (mut world, _, _) = scene();
    for (name, change) in fields {
        for bad in BAD.into_iter().chain([-1.0]) {
            if name == "gravity" && bad == -1.0 {
                continue;
            }
            let mut settings = WorldSettings::default();
            change(&mut settings, bad);
            let message = World::new(settings).unwrap_err().to_string();
            assert!(message.contains(name), "'{message}' does not name {name}");
            refused_naming(&mut world, name, |w| w.set_settings(settings));
        }
    }
    for (substeps, threads, name) in [(0, 1, "substeps"), (65, 1, "substeps"), (4, 0, "threads"), (4, 65, "threads")] {
        let settings = WorldSettings { substeps, threads, ..WorldSettings::default() };
        refused_naming(&mut world, name, |w| w.set_settings(settings));
    }
}

/// Ids of what has gone, and of other worlds, are `None` or errors.
#[test]
fn stale_and_foreign_ids_are_errors() {
    let (mut world, block, _) = scene();
    let (mut other, foreign, _) = scene();
    let shape = world.body(block).unwrap().shapes()[0];
    let arbiter = world.arbiters_of(block).next().unwrap().id();
    let foreign_arbiter = other.arbiters_of(foreign).next().unwrap().id();
    world.remove_body(block).unwrap();
    let reuse = drop_shape(&mut world, &cube(0.5), Vec3::Y * 9.0);
    assert_eq!(reuse.index(), block.index(), "the slot is used again");
    let contact = ContactPoint::new(Vec3::ZERO, Vec3::ZERO, Vec3::Y);
    for id in [block, foreign] {
        assert!(world.body(id).is_none() && world.body_mut(id).is_none());
        assert_eq!(world.arbiters_of(id).count(), 0);
        let unknown = Error::UnknownBody { id };
        assert_eq!(refused(&mut world, "remove_body", |w| w.remove_body(id)), unknown);
        assert_eq!(refused(&mut world, "add_shape", |w| w.add_shape(id, &ShapeDefinition::new(cube(1.0)))), unknown);
        let key = ArbiterKey::new(u64::MAX, 1);
        assert_eq!(refused(&mut world, "arbiter", |w| w.get_or_create_arbiter(key, BodyId::WORLD, id)), unknown);
        assert_eq!(
            refused(&mut world, "contact", |w| w.register_contact_by_key(key, id, BodyId::WORLD, contact)),
            unknown
        );
    }
    for id in [shape, ShapeId::from_raw(0), ShapeId::from_raw(u64::MAX)] {
        assert!(world.shape(id).is_none() && world.shape_mut(id).is_none() && world.sensor_visitors(id).is_empty());
        assert_eq!(refused(&mut world, "remove_shape", |w| w.remove_shape(id)), Error::UnknownShape { id });
    }
    for id in [arbiter, foreign_arbiter] {
        assert!(world.arbiter_by_id(id).is_none() && world.arbiter_mut(id).is_none());
        assert_eq!(refused(&mut world, "contact", |w| w.register_contact(id, contact)), Error::UnknownArbiter { id });
        assert_eq!(refused(&mut world, "remove_arbiter", |w| w.remove_arbiter(id)), Error::UnknownArbiter { id });
    }
    assert!(other.body(foreign).is_some() && other.step(DT).is_ok());
}

/// Rays refuse what is not finite.
#[test]
fn bad_rays_are_refused() {
    let (mut world, _, _) = scene();
    let filter = QueryFilter::default();
    for v in bad_vectors() {
        refused_naming(&mut world, "origin", |w| w.cast_ray(v, Vec3::X, 1.0, &filter));
        refused_naming(&mut world, "direction", |w| w.cast_ray(Vec3::ZERO, v, 1.0, &filter));
        refused_naming(&mut world, "direction", |w| w.cast_ray_all(Vec3::ZERO, v, 1.0, &filter));
    }
    for bad in [f32::NAN, -1.0, f32::NEG_INFINITY] {
        refused_naming(&mut world, "max_fraction", |w| w.cast_ray(Vec3::ZERO, Vec3::X, bad, &filter));
    }
    let nowhere = world.cast_ray(Vec3::Y * 5.0, Vec3::ZERO, f32::INFINITY, &filter).unwrap();
    assert!(nowhere.is_none(), "a ray without direction in free air hits nothing: {nowhere:?}");
}

/// A body that goes non-finite inside a step is put back, stopped and reported; the others go on.
#[test]
fn a_broken_body_is_frozen_and_its_neighbours_go_on() {
    let mut world = sleepless();
    floor(&mut world, 0.5);
    let light = BodyDefinition {
        mass: Some(MassProperties {
            mass: 1e-3,
            center: Vec3::ZERO,
            inertia: SymmetricMat3::diagonal(Vec3::splat(1e-3)),
        }),
        ..BodyDefinition::dynamic().at(Vec3::Y * 0.5)
    };
    let light = add(&mut world, &light, &ShapeDefinition::new(cube(0.5)));
    let rider = drop_shape(&mut world, &cube(0.5), Vec3::Y * 1.5);
    let falling = drop_shape(&mut world, &sphere(0.5), Vec3::new(5.0, 50.0, 0.0));
    run(&mut world, 0.2);
    let place = position(&world, light);
    world.body_mut(light).unwrap().apply_force(Vec3::X * 3e38).unwrap();
    let report = world.step(DT).unwrap();
    assert_eq!(report.frozen, [light]);
    assert!(world.body(light).unwrap().is_frozen());
    assert_eq!((position(&world, light), velocity(&world, light)), (place, Vec3::ZERO));
    for _ in 0..60 {
        assert!(world.step(DT).unwrap().frozen.is_empty(), "reported once");
        world.validate().unwrap();
    }
    assert_eq!(position(&world, light), place, "it stays");
    assert_near(position(&world, rider).y, 1.5, 0.05, "the rider stands on it still");
    let fallen = 50.0 - position(&world, falling).y;
    let time = 73.0 * DT;
    assert_relative(fallen, 0.5 * GRAVITY * time * time, 1e-4, "the others fell on");
    // Setting its velocity sets it free.
    world.body_mut(light).unwrap().set_position(Vec3::new(-5.0, 3.0, 0.0)).unwrap();
    assert!(!world.body(light).unwrap().is_frozen());
    run(&mut world, 0.5);
    assert!(position(&world, light).y < 2.5, "it falls again");
}

/// Forces, torques and impulses that are huge but lead to finite numbers end at the speed limit, in their direction.
#[test]
fn huge_pushes_end_at_the_speed_limit() {
    type Push = fn(&mut World, BodyId);
    let pushes: [(&str, Push); 3] = [
        ("force", |world, id| world.body_mut(id).unwrap().apply_force(Vec3::X * 3e38).unwrap()),
        ("impulse", |world, id| world.body_mut(id).unwrap().apply_impulse(Vec3::X * 3e38).unwrap()),
        ("velocity", |world, id| world.body_mut(id).unwrap().set_linear_velocity(Vec3::X * 3e38).unwrap()),
    ];
    for (what, push) in pushes {
        let mut world = weightless();
        let body = drop_shape(&mut world, &cube(0.5), Vec3::ZERO);
        push(&mut world, body);
        let report = world.step(DT).unwrap();
        let v = velocity(&world, body);
        assert!(report.frozen == [body] || v.distance(Vec3::X * 1000.0) < 1.0, "{what}: {v}, {report:?}");
        world.validate().unwrap();
    }
}

/// A thousand bodies at one point: slow, but none is lost and all stay finite.
#[test]
fn a_thousand_bodies_at_one_point() {
    let mut world = World::new(WorldSettings { threads: 2, ..*sleepless().settings() }).unwrap();
    floor(&mut world, 0.5);
    let shapes = [sphere(0.2), cube(0.2), capsule(0.1, 0.15), icosahedron(0.2)];
    let bodies: Vec<BodyId> = (0..1000).map(|at| drop_shape(&mut world, &shapes[at % 4], Vec3::Y * 5.0)).collect();
    for _ in 0..4 {
        let report = world.step(DT).unwrap();
        assert!(report.frozen.is_empty());
    }
    assert_eq!(world.body_count(), 1000);
    let apart = bodies.iter().filter(|&&body| position(&world, body).distance(Vec3::Y * 5.0) > 0.05).count();
    for &body in &bodies {
        let read = world.body(body).unwrap();
        assert!(read.position().is_finite() && read.rotation().is_finite() && read.linear_velocity().is_finite());
        assert!(read.position().distance(Vec3::Y * 5.0) < 200.0, "{}", read.position());
    }
    println!("1,000 at one point: {apart} have moved apart, {} contacts", world.contact_count());
    assert!(apart > 900, "{apart} have moved apart");
}

/// Two bodies at exactly the same place come apart, whatever their shapes.
#[test]
fn coincident_pairs_come_apart() {
    let shapes = [sphere(0.3), cube(0.3), capsule(0.3, 0.2), icosahedron(0.3), wedge(0.3)];
    for a in &shapes {
        for b in &shapes {
            let mut world = weightless();
            let first = drop_shape(&mut world, a, Vec3::ZERO);
            let second = drop_shape(&mut world, b, Vec3::ZERO);
            run(&mut world, 3.0);
            let gap = position(&world, first).distance(position(&world, second));
            assert!(gap > 0.15 && gap < 5.0, "{a:?} and {b:?}: {gap} m apart");
            assert!(world.deepest_penetration() < 0.01);
        }
    }
}

/// Worlds at the edges of their numbers step without harm.
#[test]
fn extreme_but_finite_worlds_step() {
    let cases: [(Vec3, f32, f32); 5] = [
        (Vec3::splat(1e6), 1.0, 1000.0),
        (Vec3::new(0.0, 1e18, 0.0), 1.0, 1000.0),
        (Vec3::ZERO, 1e-4, 1e-3),
        (Vec3::ZERO, 1e4, 1e12),
        (Vec3::splat(3e37), 1.0, 1.0),
    ];
    for (place, size, density) in cases {
        let mut world = sleepless();
        for at in 0..3 {
            let body = BodyDefinition::dynamic().at(place + Vec3::Y * size * at as f32).moving(Vec3::X, Vec3::Y);
            add(&mut world, &body, &ShapeDefinition::new(cube(0.5 * size)).density(density));
        }
        for _ in 0..30 {
            world.step(DT).unwrap();
        }
        world.validate().unwrap();
    }
}
