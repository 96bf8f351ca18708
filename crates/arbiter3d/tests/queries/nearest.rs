//! Closest points and nearest shapes against brute force and closed forms.

use crate::common::*;
use crate::{shapes, strewn_two_sided};
use arbiter3d::math::{Pose, Vec3};
use arbiter3d::{BodyDefinition, BodyId, PointHit, QueryFilter, Shape, ShapeDefinition, World, distance};

/// Distance of a point from a shape, in double precision, where there is a closed form.
fn exact(shape: &Shape, point: Vec3) -> Option<f64> {
    let p = point.as_dvec3();
    match shape {
        Shape::Sphere(ball) => Some((p.length() - f64::from(ball.radius())).max(0.0)),
        Shape::Capsule(capsule) => {
            let half = f64::from(capsule.half_length());
            let along = p - Vec3::Y.as_dvec3() * p.y.clamp(-half, half);
            Some((along.length() - f64::from(capsule.radius())).max(0.0))
        }
        Shape::Cuboid(cuboid) => Some((p.abs() - cuboid.half_extents().as_dvec3()).max(Vec3::ZERO.as_dvec3()).length()),
        _ => None,
    }
}

/// All shapes by distance, each asked on its own through a point-sized ball.
fn brute_force(world: &World, point: Vec3) -> Vec<(f32, arbiter3d::ShapeId)> {
    let probe = sphere(1e-6);
    let mut all: Vec<_> = shapes(world)
        .into_iter()
        .filter(|&id| !world.shape(id).unwrap().is_sensor())
        .map(|id| {
            let shape = world.shape(id).unwrap();
            let found = distance(shape.geometry(), &shape.world_pose(), &probe, &Pose::from_position(point), 1e9);
            (found.unwrap().distance.max(0.0), id)
        })
        .collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    all
}

#[test]
fn the_nearest_shapes_are_those_of_brute_force() {
    let mut random = Random(51);
    let world = strewn_two_sided(&mut random);
    let filter = QueryFilter::default();
    let mut closed_forms = 0;
    for at in 0..300 {
        let point = random.vector(13.0);
        let expected = brute_force(&world, point);
        let near = world.nearest_shapes(point, 8, f32::INFINITY, &filter).unwrap();
        assert_eq!(near.len(), 8);
        for (hit, (distance, id)) in near.iter().zip(&expected) {
            assert!((hit.distance - distance).abs() < 1e-4, "{point}: {hit:?} instead of {distance} {id:?}");
            let shape = world.shape(hit.shape).unwrap();
            if let Some(exact) = exact(shape.geometry(), shape.world_pose().inverse_transform_point(point)) {
                assert!((f64::from(hit.distance) - exact).abs() < 2e-5, "{hit:?}: {exact}");
                closed_forms += 1;
            }
            let off = point - hit.point;
            assert!((off.length() - hit.distance).abs() < 1e-4 && off.distance(hit.normal * hit.distance) < 1e-3);
        }
        assert!(near.windows(2).all(|pair| (pair[0].distance, pair[0].shape) < (pair[1].distance, pair[1].shape)));
        let first = world.closest_point(point, f32::INFINITY, &filter).unwrap();
        assert_eq!(first.as_ref(), near.first(), "{at}");
        let reach = near[3].distance;
        let within = world.nearest_shapes(point, 100, reach, &filter).unwrap();
        assert!(within.len() >= 4 && within.iter().all(|hit| hit.distance <= reach), "{reach} {within:?}");
        let inside = near.iter().filter(|hit| hit.distance == 0.0 && hit.triangle.is_none()).count();
        assert_eq!(world.overlap_point(point, &filter).unwrap().len(), inside);
    }
    assert!(closed_forms > 500, "{closed_forms}");
}

#[test]
fn equal_distances_go_by_age() {
    let mut world = weightless();
    let ids: Vec<_> = [Vec3::X, -Vec3::X, Vec3::Y, -Vec3::Y, Vec3::Z, -Vec3::Z]
        .map(|at| world.add_shape(BodyId::WORLD, &ShapeDefinition::new(cube(0.5)).at(at * 3.0)).unwrap())
        .to_vec();
    let filter = QueryFilter::default();
    let near = world.nearest_shapes(Vec3::ZERO, 4, 10.0, &filter).unwrap();
    assert_eq!(near.iter().map(|hit| hit.shape).collect::<Vec<_>>(), ids[..4]);
    assert!(world.nearest_shapes(Vec3::ZERO, 4, 2.49, &filter).unwrap().is_empty());
    assert!(world.nearest_shapes(Vec3::ZERO, 0, 10.0, &filter).unwrap().is_empty());
    assert!(world.closest_point(Vec3::NAN, 1.0, &filter).is_err());
    assert!(world.closest_point(Vec3::ZERO, -1.0, &filter).is_err());
}

/// The closest of all shapes to a shape, and distances between two shapes of the world, signed.
#[test]
fn distances_between_shapes_by_hand() {
    let mut world = weightless();
    let ball = drop_shape(&mut world, &sphere(1.0), Vec3::ZERO);
    let block = add(&mut world, &BodyDefinition::fixed().at(Vec3::X * 4.0), &ShapeDefinition::new(cube(1.0)));
    let id = |world: &World, body: BodyId| world.body(body).unwrap().shapes()[0];
    let (ball, block) = (id(&world, ball), id(&world, block));
    let found = world.distance_between(ball, block, 10.0).unwrap().unwrap();
    assert_near(found.distance, 2.0, 1e-6, "gap");
    assert!(found.point1.distance(Vec3::X) < 1e-5 && found.point2.distance(Vec3::X * 3.0) < 1e-5);
    assert!(found.normal.distance(Vec3::X) < 1e-6);
    assert!(world.distance_between(ball, block, 1.9).unwrap().is_none());
    let near = |x: f32| -> Option<PointHit> {
        let pose = Pose::from_position(Vec3::new(x, 0.0, 0.0));
        world.closest_shape(&cube(0.25), &pose, 5.0, &QueryFilter::default()).unwrap()
    };
    let hit = near(1.75).unwrap();
    assert!(hit.shape == ball && (hit.distance - 0.5).abs() < 1e-5 && hit.normal.distance(Vec3::X) < 1e-5, "{hit:?}");
    let hit = near(2.9).unwrap();
    assert!(
        hit.shape == block && (hit.distance + 0.15).abs() < 1e-5 && hit.normal.distance(-Vec3::X) < 1e-5,
        "{hit:?}"
    );
    let contacts = world.collide_shape(&cube(0.25), &Pose::from_position(Vec3::X * 2.9), 0.0, &QueryFilter::default());
    let contacts = contacts.unwrap();
    assert!(contacts.len() == 1 && contacts[0].shape == block && contacts[0].manifold.points().len() == 4);
    assert!(contacts[0].manifold.points().iter().all(|p| (p.separation + 0.15).abs() < 1e-5 && p.point1.x == 3.0));
    assert!(world.manifold_between(ball, block, 0.0).unwrap().points().is_empty());
    let apart = world.manifold_between(ball, block, 3.0).unwrap();
    assert!(apart.points().len() == 1 && (apart.points()[0].separation - 2.0).abs() < 1e-5);
}
