//! Queries against brute force.

mod common;

#[path = "queries/batch.rs"]
mod batch;
#[path = "queries/casts.rs"]
mod casts;
#[path = "queries/fields.rs"]
mod fields;
#[path = "queries/nearest.rs"]
mod nearest;
#[path = "queries/watertight.rs"]
mod watertight;

use arbiter3d::math::{Aabb, Vec3};
use arbiter3d::{
    BodyDefinition, BodyId, Filter, MeshSides, QueryFilter, Ray, RayHit, Shape, ShapeDefinition, ShapeId, TriangleMesh,
    World, cast_ray,
};
use common::*;
use std::sync::Arc;

/// 300 bodies of all shapes strewn about, some static, and a piece of mesh.
fn strewn(random: &mut Random) -> World {
    strewn_with(random, MeshSides::One, 300)
}

/// The same with a mesh that is solid on both sides.
fn strewn_two_sided(random: &mut Random) -> World {
    strewn_with(random, MeshSides::Two, 300)
}

fn strewn_with(random: &mut Random, sides: MeshSides, count: usize) -> World {
    let mut world = weightless();
    for at in 0..count {
        let place = Vec3::new(random.range(-10.0, 10.0), random.range(-10.0, 10.0), random.range(-10.0, 10.0));
        let body = if at % 3 == 0 { BodyDefinition::fixed() } else { BodyDefinition::dynamic() };
        let shape =
            ShapeDefinition::new(random.shape()).filter(Filter { category: 1 << (at % 4), ..Filter::default() });
        let shape = shape.at(random.vector(0.3)).rotated(random.rotation());
        let shape = if at % 10 == 7 { shape.sensor() } else { shape };
        add(&mut world, &body.at(place).rotated(random.rotation()), &shape);
    }
    let sheet =
        [Vec3::new(-9.0, 0.0, -9.0), Vec3::new(9.0, 1.0, -9.0), Vec3::new(9.0, 0.0, 9.0), Vec3::new(-9.0, -1.0, 9.0)];
    let mesh = TriangleMesh::with_sides(sheet.to_vec(), vec![[0, 2, 1], [0, 3, 2]], sides).unwrap();
    world.add_shape(BodyId::WORLD, &ShapeDefinition::new(Shape::Mesh(Arc::new(mesh)))).unwrap();
    world
}

fn shapes(world: &World) -> Vec<ShapeId> {
    world.bodies().flat_map(|body| world.body(body).unwrap().shapes().to_vec()).collect()
}

/// All hits, by asking each shape on its own.
fn brute_force(world: &World, origin: Vec3, direction: Vec3, limit: f32, filter: &QueryFilter) -> Vec<(f32, ShapeId)> {
    let mut hits = Vec::new();
    for id in shapes(world) {
        let shape = world.shape(id).unwrap();
        let seen = filter.mask & shape.filter().category != 0
            && shape.filter().mask & filter.category != 0
            && (filter.sensors || !shape.is_sensor())
            && filter.exclude_body != Some(shape.body())
            && filter.exclude_shape != Some(id);
        if !seen {
            continue;
        }
        let pose = shape.world_pose();
        let ray = Ray {
            origin: pose.inverse_transform_point(origin),
            direction: pose.rotation.inverse_rotate(direction),
            max_fraction: limit,
        };
        let hit = match shape.geometry() {
            Shape::Mesh(mesh) => mesh.cast_ray(ray.origin, ray.direction, limit).map(|hit| hit.distance),
            convex => cast_ray(convex, &ray).map(|hit| hit.fraction),
        };
        hits.extend(hit.map(|fraction| (fraction, id)));
    }
    hits.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    hits
}

fn filters(world: &World) -> [QueryFilter<'_>; 5] {
    let all = QueryFilter::default();
    let body = world.bodies().nth(5).unwrap();
    let shape = world.body(world.bodies().nth(8).unwrap()).unwrap().shapes()[0];
    [
        all,
        QueryFilter { sensors: true, ..all },
        QueryFilter { mask: 0b0101, ..all },
        QueryFilter { exclude_body: Some(body), ..all },
        QueryFilter { exclude_shape: Some(shape), sensors: true, ..all },
    ]
}

/// Closest and all hits are those that each shape gives on its own, for any filter and length.
#[test]
fn rays_hit_what_brute_force_hits() {
    let mut random = Random(31);
    let world = strewn(&mut random);
    let filters = filters(&world);
    let mut count = 0;
    for at in 0..1500 {
        let origin = random.vector(14.0);
        let direction = match at % 6 {
            0 => Vec3::X * 20.0,
            1 => Vec3::Y * -3.0,
            _ => random.vector(14.0) - origin,
        };
        let limit = [1.0, 0.3, 5.0][at % 3];
        let filter = &filters[at % filters.len()];
        let expected = brute_force(&world, origin, direction, limit, filter);
        let all = world.cast_ray_all(origin, direction, limit, filter).unwrap();
        let found: Vec<(f32, ShapeId)> = all.iter().map(|hit| (hit.fraction, hit.shape)).collect();
        assert_eq!(found, expected, "all hits from {origin} along {direction}");
        let closest = world.cast_ray(origin, direction, limit, filter).unwrap();
        assert_eq!(closest.map(|hit| (hit.fraction, hit.shape)), expected.first().copied(), "closest from {origin}");
        for hit in &all {
            assert!(hit.point.distance(origin + direction * hit.fraction) < 1e-4);
            let normal = hit.normal.length();
            assert!((normal - 1.0).abs() < 1e-3 || (hit.fraction == 0.0 && normal == 0.0), "{hit:?}");
            assert!(hit.normal.dot(direction) <= 1e-3 * direction.length(), "the normal faces the ray: {hit:?}");
            assert_eq!(world.shape(hit.shape).unwrap().body(), hit.body);
        }
        count += all.len();
    }
    assert!(count > 200, "only {count} hits");
}

/// Rays stay right while the world moves.
#[test]
fn rays_follow_moving_bodies() {
    let mut random = Random(32);
    let mut world = strewn(&mut random);
    for step in 0..120 {
        world.step(DT).unwrap();
        if step % 10 == 0 {
            for _ in 0..30 {
                let (origin, direction) = (random.vector(12.0), random.vector(20.0));
                let expected = brute_force(&world, origin, direction, 1.0, &QueryFilter::default());
                let closest = world.cast_ray(origin, direction, 1.0, &QueryFilter::default()).unwrap();
                assert_eq!(closest.map(|hit| (hit.fraction, hit.shape)), expected.first().copied(), "step {step}");
            }
        }
    }
}

/// Hits of simple shapes, by hand.
#[test]
fn rays_by_hand() {
    let mut world = weightless();
    let ball = drop_shape(&mut world, &sphere(1.2), Vec3::ZERO);
    let block = drop_shape(&mut world, &cube(1.2), Vec3::X * 10.0);
    let lying = BodyDefinition::fixed().at(Vec3::X * 20.0).rotated(turn(Vec3::Z, 90.0));
    let lying = add(&mut world, &lying, &ShapeDefinition::new(capsule(1.0, 0.5)));
    let cast = |x: f32, y: f32, direction: Vec3| -> Option<RayHit> {
        world.cast_ray(Vec3::new(x, y, 0.0), direction, 1.0, &QueryFilter::default()).unwrap()
    };
    for (x, body, top) in [(0.0, ball, 1.2), (10.0, block, 1.2), (20.9, lying, 0.5)] {
        let hit = cast(x, top + 0.25, -Vec3::Y).unwrap();
        assert_eq!(hit.body, body);
        assert_near(hit.fraction, 0.25, 1e-5, "fraction");
        assert!(hit.normal.distance(Vec3::Y) < 1e-4 && hit.point.distance(Vec3::new(x, top, 0.0)) < 1e-4, "{hit:?}");
        assert_near(cast(x, top + 0.25, Vec3::Y * -2.0).unwrap().fraction, 0.125, 1e-5, "fraction of twice the length");
        assert!(cast(x, -top - 1.2, Vec3::Y * -1.1).is_none(), "away from it");
        let inside = cast(x, top - 0.25, -Vec3::Y).unwrap();
        assert_eq!((inside.fraction, inside.normal), (0.0, Vec3::ZERO), "from inside");
    }
    let through = world.cast_ray_all(Vec3::X * -5.0, Vec3::X * 30.0, 1.0, &QueryFilter::default()).unwrap();
    assert_eq!(through.iter().map(|hit| hit.body).collect::<Vec<_>>(), [ball, block, lying]);
}

/// Boxes find the shapes whose boxes they overlap.
#[test]
fn boxes_find_what_brute_force_finds() {
    let mut random = Random(33);
    let mut world = strewn(&mut random);
    for round in 0..3 {
        let filters = filters(&world);
        for at in 0..400 {
            let half = random.vector(1.5).abs() + Vec3::splat(0.01);
            let query = Aabb::from_center(random.vector(11.0), half);
            let filter = &filters[at % filters.len()];
            let mut expected: Vec<ShapeId> = shapes(&world)
                .into_iter()
                .filter(|&id| {
                    let shape = world.shape(id).unwrap();
                    filter.mask & shape.filter().category != 0
                        && (filter.sensors || !shape.is_sensor())
                        && filter.exclude_body != Some(shape.body())
                        && filter.exclude_shape != Some(id)
                        && shape.aabb().overlaps(&query)
                })
                .collect();
            expected.sort_unstable();
            assert_eq!(world.overlap_aabb(&query, filter), expected, "round {round}");
        }
        run(&mut world, 0.5);
    }
}

/// Queries on an empty world, and on one whose bodies have gone, find nothing.
#[test]
fn nothing_is_found_where_nothing_is() {
    let mut world = world();
    let everywhere = Aabb::from_center(Vec3::ZERO, Vec3::splat(1e6));
    let filter = QueryFilter { sensors: true, ..QueryFilter::default() };
    for _ in 0..2 {
        assert!(world.cast_ray(Vec3::Y * 50.0, Vec3::Y * -100.0, 1.0, &filter).unwrap().is_none());
        assert!(world.overlap_aabb(&everywhere, &filter).is_empty());
        let body = drop_shape(&mut world, &cube(0.5), Vec3::ZERO);
        assert_eq!(world.overlap_aabb(&everywhere, &filter).len(), 1);
        assert!(world.cast_ray(Vec3::Y * 50.0, Vec3::Y * -100.0, 1.0, &filter).unwrap().is_some());
        world.remove_body(body).unwrap();
    }
}
