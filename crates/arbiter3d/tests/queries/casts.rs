//! Shape casts against small steps, and by hand.

use crate::common::*;
use crate::{shapes, strewn_two_sided};
use arbiter3d::math::{Pose, Rotation, Vec3};
use arbiter3d::{
    BodyDefinition, BodyId, MeshSides, QueryFilter, Shape, ShapeCast, ShapeDefinition, TriangleMesh, World, distance,
    overlaps,
};
use std::sync::Arc;

fn pose(random: &mut Random, half: f32) -> Pose {
    Pose::new(random.vector(half), Rotation::from_quat(random.rotation()))
}

/// Least gap to any shape, no more than `limit`.
fn gap(world: &World, shape: &Shape, at: &Pose, limit: f32) -> f32 {
    let near = world.closest_shape(shape, at, limit, &QueryFilter::default()).unwrap();
    near.map_or(limit, |hit| hit.distance)
}

/// Every hit is a touch: the gap to the shape that was hit is under 10⁻⁴ of the size there, nothing was overlapped on
/// the way, the normal points from the shape to the mover; and a miss overlaps nothing anywhere.
fn check_cast(world: &World, cast: &ShapeCast<'_>, steps: usize) -> bool {
    let filter = QueryFilter::default();
    let tolerance = 1e-4;
    let hit = world.cast_shape(cast, &filter).unwrap();
    assert_eq!(world.cast_shape_any(cast, &filter).unwrap(), hit.is_some());
    let first = world.cast_shape_all(cast, &filter).unwrap().first().copied();
    assert_eq!(first, hit, "the first of all is the closest");
    // Depths are rounded towards faces by the narrow phase, so that a touch may read as an overlap: look just before
    // it.
    let reached = hit.map_or(1.0, |hit| (hit.fraction - 1e-4).max(0.0));
    let starts_free = !world.overlap_shape_any(cast.shape, &cast.start, &filter).unwrap();
    assert_eq!(hit.is_some_and(|hit| hit.fraction == 0.0 && hit.depth > 0.0), !starts_free, "{hit:?}");
    if starts_free {
        for step in 0..=steps {
            let at = cast.at(reached * step as f32 / steps as f32);
            let depth = gap(world, cast.shape, &at, 1.0);
            assert!(depth > -tolerance, "{cast:?} overlaps by {depth} at step {step} before {hit:?}");
        }
    }
    let Some(hit) = hit else { return false };
    let other = world.shape(hit.shape).unwrap();
    assert_eq!(other.body(), hit.body);
    assert!((hit.normal.length() - 1.0).abs() < 1e-5);
    if hit.fraction > 0.0 {
        let at = cast.at(hit.fraction - 1e-5);
        let found = distance(other.geometry(), &other.world_pose(), cast.shape, &at, 1.0).unwrap();
        assert!(
            found.distance.abs() < 2.0 * tolerance,
            "a gap of {} at {hit:?} from {:?} to {:?}",
            found.distance,
            cast.start,
            cast.end
        );
        // The point is on both: of two edges side by side any point may be told.
        let probe = (sphere(1e-6), Pose::from_position(hit.point));
        let off = |shape: &Shape, pose: &Pose| distance(shape, pose, &probe.0, &probe.1, 1.0).unwrap().distance.abs();
        let gaps = [off(other.geometry(), &other.world_pose()), off(cast.shape, &cast.at(hit.fraction))];
        // A shape that comes in flat slides along under the point on the last 10⁻⁵ of its size.
        let way = (cast.end.position - cast.start.position).normalize_or_zero();
        let slide = 3e-5 / hit.normal.dot(way).abs().max(1e-3);
        assert!(gaps[0] < 2.0 * tolerance && gaps[1] < 3.0 * tolerance + slide, "{gaps:?} {slide} {hit:?}");
    }
    true
}

/// Casts along lines, or that turn on their way, at random. How many hit.
fn random_casts(seed: u64, count: usize, turns: bool) -> usize {
    let mut random = Random(seed);
    let world = strewn_two_sided(&mut random);
    let mut hits = 0;
    for at in 0..count {
        let shape = random.shape();
        let start = pose(&mut random, 12.0);
        let displacement = if at % 7 == 0 { Vec3::X * 9.0 } else { random.vector(8.0) };
        let rotation = if turns { Rotation::from_quat(random.rotation()) } else { start.rotation };
        let end = Pose::new(start.position + displacement, rotation);
        hits += usize::from(check_cast(&world, &ShapeCast::between(&shape, start, end), 60));
    }
    hits
}

#[test]
fn casts_stop_where_small_steps_find_the_first_touch() {
    let hits = random_casts(41, 600, false);
    assert!((100..580).contains(&hits), "{hits}");
}

#[test]
fn casts_that_turn_stop_where_small_steps_find_the_first_touch() {
    let hits = random_casts(42, 300, true);
    assert!((50..290).contains(&hits), "{hits}");
}

#[test]
#[ignore = "30,000 casts"]
fn many_casts_stop_where_small_steps_find_the_first_touch() {
    assert!(random_casts(43, 20_000, false) > 4000 && random_casts(44, 10_000, true) > 2000);
}

/// A box made of twelve triangles, cast part by part, stops where the box does.
#[test]
fn a_mesh_can_be_cast() {
    let mut world = weightless();
    drop_shape(&mut world, &sphere(1.0), Vec3::ZERO);
    let wall = BodyDefinition::fixed().at(Vec3::X * 6.0).rotated(turn(Vec3::Y, 30.0));
    add(&mut world, &wall, &ShapeDefinition::new(cuboid(0.2, 3.0, 3.0)));
    let corners = (0..8).map(|k| Vec3::new((k & 1) as f32, (k >> 1 & 1) as f32, (k >> 2) as f32) - Vec3::splat(0.5));
    let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = sides.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
    let hollow = Shape::mesh(corners.collect(), triangles.collect()).unwrap();
    for end in [Vec3::X * 9.0, Vec3::new(9.0, 1.4, 0.0), Vec3::new(9.0, 0.0, 1.0)] {
        for angle in [0.0, 50.0] {
            let end = Pose::new(end, Rotation::from_quat(turn(Vec3::Z, angle)));
            let start = Pose::from_position(Vec3::X * -4.0);
            let cast = |shape: &Shape| {
                world.cast_shape(&ShapeCast::between(shape, start, end), &QueryFilter::default()).unwrap()
            };
            let (solid, parts) = (cast(&cube(0.5)).unwrap(), cast(&hollow).unwrap());
            assert!(
                solid.shape == parts.shape && (solid.fraction - parts.fraction).abs() < 1e-4,
                "{solid:?} {parts:?}"
            );
            assert!(solid.normal.distance(parts.normal) < 1e-2);
        }
    }
}

/// A ball and a box onto a floor at height 0, straight and on a slant, from known heights.
#[test]
fn casts_by_hand() {
    let mut world = weightless();
    let floor = ShapeDefinition::new(cuboid(20.0, 1.0, 20.0)).at(Vec3::Y * -1.0);
    let floor = world.add_shape(BodyId::WORLD, &floor).unwrap();
    let filter = QueryFilter::default();
    let (ball, cube) = (sphere(0.5), cube(0.5));
    for slant in [0.0, 1.0, 5.0] {
        for shape in [&ball, &cube] {
            let way = Vec3::new(slant, -4.0, -slant);
            let cast = ShapeCast::along(shape, Pose::from_position(Vec3::Y * 3.5), way);
            let hit = world.cast_shape(&cast, &filter).unwrap().unwrap();
            assert_eq!((hit.shape, hit.body, hit.depth), (floor, BodyId::WORLD, 0.0));
            assert_near(hit.fraction, 0.75, 2e-6, "fraction");
            assert!(hit.normal.distance(Vec3::Y) < 1e-5 && hit.point.y.abs() < 1e-5, "{hit:?}");
            let short = ShapeCast::along(shape, Pose::from_position(Vec3::Y * 3.5), way * 0.749);
            assert!(world.cast_shape(&short, &filter).unwrap().is_none());
        }
    }
    // Already touching: pressing on is a hit at once, sliding along and lifting off are none.
    let resting = Pose::from_position(Vec3::Y * 0.500_001);
    let cast = |way: Vec3| world.cast_shape(&ShapeCast::along(&cube, resting, way), &filter).unwrap();
    assert!(cast(Vec3::Y * -1.0).unwrap().fraction < 1e-4);
    assert!(cast(Vec3::X * 5.0).is_none() && cast(Vec3::Y).is_none());
    // 0.2 deep: fraction 0, up, 0.2.
    let sunk = Pose::from_position(Vec3::Y * 0.3);
    let hit = world.cast_shape(&ShapeCast::along(&cube, sunk, Vec3::X), &filter).unwrap().unwrap();
    assert_eq!((hit.fraction, hit.shape), (0.0, floor));
    assert_near(hit.depth, 0.2, 1e-5, "depth");
    assert!(hit.normal.distance(Vec3::Y) < 1e-5);
}

/// Exactly one radius from a wall: what falls along it meets the floor, what presses on it the wall, at once and level.
#[test]
fn what_touches_a_wall_slides_along_it() {
    let mut world = weightless();
    let floor = ShapeDefinition::new(cuboid(20.0, 1.0, 20.0)).at(Vec3::Y * -1.0);
    let floor = world.add_shape(BodyId::WORLD, &floor).unwrap();
    let wall = ShapeDefinition::new(cuboid(1.0, 10.0, 5.0)).at(Vec3::X * 2.0);
    let wall = world.add_shape(BodyId::WORLD, &wall).unwrap();
    for (shape, low) in [(capsule(0.5, 0.5), 1.0), (sphere(0.5), 0.5)] {
        let cast = |way: Vec3| {
            let cast = ShapeCast::along(&shape, Pose::from_position(Vec3::new(0.5, 3.0, 0.3)), way);
            world.cast_shape(&cast, &QueryFilter::default()).unwrap()
        };
        let fall = cast(Vec3::Y * -5.0).unwrap();
        assert_eq!(fall.shape, floor);
        assert_near(fall.fraction, (3.0 - low) / 5.0, 1e-5, "fraction of the fall");
        assert!(fall.normal.distance(Vec3::Y) < 1e-5, "{fall:?}");
        let push = cast(Vec3::X).unwrap();
        assert_eq!(push.shape, wall);
        assert!(push.fraction < 1e-5 && push.depth < 1e-5 && push.normal.distance(-Vec3::X) < 1e-5, "{push:?}");
        assert!(cast(Vec3::new(-1.0, 0.0, 3.0)).is_none());
    }
}

/// A rod of length 2 that stands 0.5 in front of a wall and turns by 90° about z hits with its end at 30°.
#[test]
fn a_turning_rod_hits_with_its_end() {
    let mut world = weightless();
    let wall = ShapeDefinition::new(cuboid(0.1, 5.0, 5.0)).at(Vec3::X * 0.6);
    world.add_shape(BodyId::WORLD, &wall).unwrap();
    let rod = capsule(1.0, 0.01);
    let end = Pose::new(Vec3::ZERO, Rotation::from_quat(turn(Vec3::Z, -90.0)));
    let cast = ShapeCast::between(&rod, Pose::IDENTITY, end);
    let hit = world.cast_shape(&cast, &QueryFilter::default()).unwrap().unwrap();
    let tip = cast.at(hit.fraction).transform_point(Vec3::Y).x + 0.01;
    assert_near(tip, 0.5, 1e-4, "where the tip is");
    assert!(hit.normal.distance(-Vec3::X) < 1e-3 && hit.point.distance(Vec3::new(0.5, 0.8717, 0.0)) < 1e-3, "{hit:?}");
}

/// A sheet of two triangles: a one-sided one stops what comes from its front alone, a two-sided one both.
#[test]
fn the_back_of_a_one_sided_mesh_stops_nothing() {
    let corners =
        [Vec3::new(-3.0, 0.0, -3.0), Vec3::new(-3.0, 0.0, 3.0), Vec3::new(3.0, 0.0, 3.0), Vec3::new(3.0, 0.0, -3.0)];
    for sides in [MeshSides::One, MeshSides::Two] {
        let mut world = weightless();
        let sheet = TriangleMesh::with_sides(corners.to_vec(), vec![[0, 1, 2], [0, 2, 3]], sides).unwrap();
        world.add_shape(BodyId::WORLD, &ShapeDefinition::new(Shape::Mesh(Arc::new(sheet)))).unwrap();
        for shape in [sphere(0.5), cube(0.5), capsule(0.5, 0.25)] {
            let low = if matches!(shape, Shape::Capsule(_)) { 0.75 } else { 0.5 };
            let cast = |from: f32, way: f32| {
                let cast = ShapeCast::along(&shape, Pose::from_position(Vec3::new(1.0, from, 0.5)), Vec3::Y * way);
                world.cast_shape(&cast, &QueryFilter::default()).unwrap()
            };
            let hit = cast(4.0, -8.0).unwrap();
            assert_near(hit.fraction, (4.0 - low) / 8.0, 1e-5, "from the front");
            assert!(hit.normal.distance(Vec3::Y) < 1e-4 && hit.triangle.is_some(), "{hit:?}");
            assert_eq!(cast(-4.0, 8.0).is_some(), sides == MeshSides::Two, "from behind");
            assert_eq!(cast(-0.2, -8.0).is_some(), sides == MeshSides::Two, "half through");
            assert!(cast(0.2, -8.0).unwrap().fraction == 0.0);
        }
    }
}

/// Overlaps of placed shapes are those that each shape gives on its own.
#[test]
fn shapes_overlap_what_brute_force_overlaps() {
    let mut random = Random(43);
    let world = strewn_two_sided(&mut random);
    let mut count = 0;
    for _ in 0..1500 {
        let (shape, at) = (random.shape(), pose(&mut random, 11.0));
        let found = world.overlap_shape(&shape, &at, &QueryFilter::default()).unwrap();
        let mut expected = shapes(&world);
        expected.retain(|&id| {
            let other = world.shape(id).unwrap();
            !other.is_sensor() && overlaps(other.geometry(), &other.world_pose(), &shape, &at)
        });
        expected.sort_unstable();
        assert_eq!(found, expected);
        assert_eq!(world.overlap_shape_any(&shape, &at, &QueryFilter::default()).unwrap(), !found.is_empty());
        count += found.len();
    }
    assert!(count > 100, "{count}");
}

/// Points are inside what they are inside of by hand.
#[test]
fn points_are_inside_by_hand() {
    let mut world = weightless();
    let ball = drop_shape(&mut world, &sphere(1.0), Vec3::ZERO);
    let block = add(
        &mut world,
        &BodyDefinition::fixed().at(Vec3::X * 1.5).rotated(turn(Vec3::Z, 45.0)),
        &ShapeDefinition::new(cube(1.0)),
    );
    let inside = |point: Vec3| -> Vec<BodyId> {
        let found = world.overlap_point(point, &QueryFilter::default()).unwrap();
        found.into_iter().map(|id| world.shape(id).unwrap().body()).collect()
    };
    assert_eq!(inside(Vec3::X * 0.5), [ball, block]);
    assert_eq!(inside(Vec3::new(-0.5, 0.5, 0.5)), [ball]);
    assert_eq!(inside(Vec3::X * 2.9), [block]);
    assert!(inside(Vec3::new(0.58, 0.58, 0.58)).is_empty() && inside(Vec3::new(2.5, 1.0, 0.0)).is_empty());
}
