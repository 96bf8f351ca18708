//! Many queries at once, filters, and queries from within a step.

use crate::common::*;
use crate::{strewn, strewn_two_sided};
use arbiter3d::math::{Pose, Rotation, Vec3};
use arbiter3d::{
    BodyDefinition, BodyId, BodyKinds, QueryFilter, Ray, Shape, ShapeCast, ShapeDefinition, ShapeRef, World,
    WorldSettings,
};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

fn rays(random: &mut Random, count: usize) -> Vec<Ray> {
    (0..count).map(|_| Ray::new(random.vector(14.0), random.vector(25.0))).collect()
}

#[test]
fn a_batch_answers_like_single_queries_on_any_number_of_threads() {
    let mut random = Random(61);
    let mut world = strewn(&mut random);
    let rays = rays(&mut random, 5000);
    let shapes: Vec<Shape> = (0..20).map(|_| random.shape()).collect();
    let casts: Vec<ShapeCast<'_>> = (0..300)
        .map(|k| ShapeCast::along(&shapes[k % 20], Pose::from_position(random.vector(12.0)), random.vector(9.0)))
        .collect();
    let filter = QueryFilter { sensors: true, ..QueryFilter::default() };
    let expected: Vec<_> =
        rays.iter().map(|r| world.cast_ray(r.origin, r.direction, r.max_fraction, &filter).unwrap()).collect();
    let touched: Vec<_> = casts.iter().map(|cast| world.cast_shape(cast, &filter).unwrap()).collect();
    assert!(expected.iter().flatten().count() > 500 && touched.iter().flatten().count() > 50);
    let mut hits = Vec::new();
    for threads in [1, 2, 3, 8] {
        world.set_settings(WorldSettings { threads, ..*world.settings() }).unwrap();
        world.cast_rays_into(&rays, &filter, &mut hits).unwrap();
        assert_eq!(hits, expected, "{threads} threads");
        assert_eq!(world.cast_shapes(&casts, &filter).unwrap(), touched, "{threads} threads");
    }
    assert!(world.cast_rays(&[], &filter).unwrap().is_empty());
    let wrong = [rays[0], Ray::new(Vec3::NAN, Vec3::X)];
    assert!(world.cast_rays(&wrong, &filter).is_err());
}

/// Several threads ask one world at once and get what one thread gets.
#[test]
fn several_threads_ask_at_once() {
    fn is_sync<T: Sync>(_: &T) {}
    let mut random = Random(62);
    let world = strewn_two_sided(&mut random);
    is_sync(&world);
    let rays = rays(&mut random, 500);
    let filter = QueryFilter::default();
    let ask = || -> Vec<_> {
        let one = |r: &Ray| world.cast_ray(r.origin, r.direction, r.max_fraction, &filter).unwrap();
        rays.iter().map(one).collect()
    };
    let expected = ask();
    std::thread::scope(|scope| {
        let others: Vec<_> = (0..4).map(|_| scope.spawn(ask)).collect();
        for other in others {
            assert_eq!(other.join().unwrap(), expected);
        }
    });
}

/// Five balls in a row: each part of the filter takes away what it should.
#[test]
fn filters_by_hand() {
    let mut world = weightless();
    let kinds = [BodyDefinition::fixed(), BodyDefinition::kinematic(), BodyDefinition::dynamic()];
    let ball = ShapeDefinition::new(sphere(0.4));
    let bodies: Vec<BodyId> = (0..6)
        .map(|k| add(&mut world, &kinds[k % 3].clone().at(Vec3::X * k as f32), &ball.clone().density(100.0 * k as f32)))
        .collect();
    let all = QueryFilter::default();
    let seen = |filter: &QueryFilter<'_>| -> Vec<usize> {
        let hits = world.cast_ray_all(Vec3::X * -3.0, Vec3::X * 20.0, 1.0, filter).unwrap();
        let place = |body: BodyId| bodies.iter().position(|&other| other == body).unwrap();
        let found: Vec<usize> = hits.iter().map(|hit| place(hit.body)).collect();
        let cast = ShapeCast::along(&ball.shape, Pose::from_position(Vec3::X * -3.0), Vec3::X * 20.0);
        let touched = world.cast_shape_all(&cast, filter).unwrap();
        assert_eq!(touched.iter().map(|hit| place(hit.body)).collect::<Vec<_>>(), found);
        let mut near: Vec<usize> =
            world.nearest_shapes(Vec3::X * -3.0, 10, 50.0, filter).unwrap().iter().map(|hit| place(hit.body)).collect();
        near.sort_unstable();
        assert_eq!(near, found);
        found
    };
    assert_eq!(seen(&all), [0, 1, 2, 3, 4, 5]);
    assert_eq!(seen(&QueryFilter { kinds: BodyKinds::STATIC, ..all }), [0, 3]);
    assert_eq!(seen(&QueryFilter { kinds: BodyKinds::KINEMATIC | BodyKinds::DYNAMIC, ..all }), [1, 2, 4, 5]);
    assert_eq!(seen(&QueryFilter { exclude_bodies: &bodies[1..4], ..all }), [0, 4, 5]);
    let shapes = [world.body(bodies[5]).unwrap().shapes()[0], world.body(bodies[0]).unwrap().shapes()[0]];
    assert_eq!(seen(&QueryFilter { exclude_shapes: &shapes, exclude_body: Some(bodies[2]), ..all }), [1, 3, 4]);
    let light = |shape: &ShapeRef<'_>| shape.density() < 250.0;
    assert_eq!(seen(&QueryFilter { predicate: Some(&light), kinds: BodyKinds::DYNAMIC, ..all }), [2]);
}

/// A listener casts a ray and a shape, overlaps and looks for the closest point in the middle of a step.
#[test]
fn queries_work_inside_listeners() {
    let mut world = World::default();
    let ground = floor(&mut world, 0.5);
    let ball = drop_shape(&mut world, &sphere(0.5), Vec3::Y * 0.6);
    let asked = Arc::new(AtomicUsize::new(0));
    let count = Arc::clone(&asked);
    world.on_begin_collide(Box::new(move |context, _| {
        let not_the_ball = QueryFilter { exclude_body: Some(ball), ..QueryFilter::default() };
        let from = context.body(ball).unwrap().position();
        let hit = context.cast_ray(from, Vec3::Y * -5.0, 1.0, &not_the_ball).unwrap().unwrap();
        assert_eq!(hit.shape, ground);
        let probe = sphere(0.1);
        let cast = ShapeCast::along(&probe, Pose::from_position(from), Vec3::Y * -5.0);
        assert_eq!(context.cast_shape(&cast, &not_the_ball).unwrap().unwrap().shape, ground);
        let wide = sphere(2.0);
        assert_eq!(context.overlap_shape(&wide, &Pose::from_position(from), &not_the_ball).unwrap(), [ground]);
        let near = context.closest_point(from, 9.0, &not_the_ball).unwrap().unwrap();
        assert!((near.distance - from.y).abs() < 1e-4);
        let many = context.world().cast_rays(&[Ray::new(from, Vec3::Y * -5.0); 1000], &not_the_ball).unwrap();
        assert!(many.iter().all(|other| *other == Some(hit)));
        count.fetch_add(1, Ordering::Relaxed);
    }));
    run(&mut world, 1.0);
    assert!(asked.load(Ordering::Relaxed) > 0);
}

/// Numbers that make no sense are errors, and lengths of zero and infinity are none.
#[test]
fn bad_numbers_are_errors_and_extreme_ones_are_answered() {
    let mut random = Random(63);
    let world = strewn(&mut random);
    let filter = QueryFilter::default();
    let ball = sphere(0.5);
    let good = Pose::IDENTITY;
    let bad = [
        Pose::from_position(Vec3::new(0.0, f32::NAN, 0.0)),
        Pose::from_position(Vec3::splat(f32::INFINITY)),
        Pose::new(Vec3::ZERO, Rotation::from_xyzw(0.0, 0.0, 0.0, 2.0)),
        Pose::new(Vec3::ZERO, Rotation::from_xyzw(f32::NAN, 0.0, 0.0, 1.0)),
    ];
    for pose in &bad {
        for (start, end) in [(*pose, good), (good, *pose)] {
            let cast = ShapeCast::between(&ball, start, end);
            assert!(world.cast_shape(&cast, &filter).is_err() && world.cast_shapes(&[cast], &filter).is_err());
            assert!(world.cast_shape_all(&cast, &filter).is_err() && world.cast_shape_any(&cast, &filter).is_err());
        }
        assert!(world.overlap_shape(&ball, pose, &filter).is_err());
        assert!(world.closest_shape(&ball, pose, 1.0, &filter).is_err());
        assert!(world.collide_shape(&ball, pose, 0.0, &filter).is_err());
    }
    assert!(world.collide_shape(&ball, &good, -1.0, &filter).is_err());
    assert!(world.nearest_shapes(Vec3::ZERO, 3, f32::NAN, &filter).is_err());
    assert!(world.overlap_point(Vec3::splat(f32::NAN), &filter).is_err());
    for at in 0..200 {
        let start = Pose::from_position(random.vector(10.0));
        let rest = world.cast_shape(&ShapeCast::along(&ball, start, Vec3::ZERO), &filter).unwrap();
        // The back of the sheet is overlapped but stops nothing.
        let solid = |shape: &ShapeRef<'_>| shape.geometry().is_convex();
        let overlaps =
            world.overlap_shape_any(&ball, &start, &QueryFilter { predicate: Some(&solid), ..filter }).unwrap();
        assert!(rest.is_some() || !overlaps, "{at}");
        let way = random.vector(1.0);
        let endless = world.cast_ray(start.position, way, f32::INFINITY, &filter).unwrap();
        let long = world.cast_ray(start.position, way, 1e6, &filter).unwrap();
        assert_eq!(endless, long);
        let far = ShapeCast::along(&ball, start, way * 1e6);
        let near = ShapeCast::along(&ball, start, way * 1e2);
        let [far, near] = [far, near].map(|cast| world.cast_shape(&cast, &filter).unwrap());
        assert_eq!(far.map(|hit| hit.shape), near.map(|hit| hit.shape), "{at}");
    }
}
