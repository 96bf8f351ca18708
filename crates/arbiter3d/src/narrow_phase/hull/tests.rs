//! Hulls of all proportions against separating axes in `f64`, and what must not change a bit.

use super::super::tests::{contacts, hull_oracle};
use super::super::{collide, collide_on};
use super::*;
use crate::math::Rotation;
use crate::random::Random;
use crate::shape::Shape;
use crate::shape::distance::closest;

/// Rocks, plates, needles and boxes about one size, as hulls and as cuboids.
fn solids(random: &mut Random, size: Real) -> Vec<Shape> {
    let mut solids = vec![Shape::cuboid(Vec3::new(0.5, 0.4, 0.3) * size).unwrap()];
    for (count, stretch) in [
        (4, Vec3::ONE),
        (8, Vec3::ONE),
        (32, Vec3::ONE),
        (60, Vec3::ONE),
        (10, Vec3::new(1.0, 0.03, 0.8)),
        (9, Vec3::new(0.05, 0.04, 1.0)),
    ] {
        let points: Vec<Vec3> = (0..count).map(|_| random.direction() * stretch * size).collect();
        solids.push(Shape::hull(&points).unwrap());
    }
    solids.push(Shape::Hull(std::sync::Arc::new(ConvexHull::from_cuboid(Vec3::new(0.3, 0.5, 0.2) * size).unwrap())));
    solids
}

fn as_hull(shape: &Shape) -> ConvexHull {
    match shape {
        Shape::Hull(hull) => hull.as_ref().clone(),
        Shape::Cuboid(cuboid) => ConvexHull::from_cuboid(cuboid.half_extents()).unwrap(),
        _ => unreachable!(),
    }
}

fn lowest(manifold: &Manifold) -> Real {
    manifold.points().iter().fold(Real::MAX, |m, p| min(p.separation, m))
}

/// Places shape 2 so that the pair overlaps by about `depth`, along the line of the centres.
fn sunk(random: &mut Random, a: &Shape, b: &Shape, depth: Real) -> Pose {
    let (rotation, way) = (random.rotation(), random.direction());
    let apart =
        Pose::new(way * 10.0 * (a.local_aabb().half_extents() + b.local_aabb().half_extents()).length(), rotation);
    let found = closest(&Support::new(a).unwrap(), &Support::new(b).unwrap(), &apart).unwrap();
    Pose::new(apart.position - found.normal * (found.distance + depth), rotation)
}

/// Millimetre, metre and hundred metres: thin, sharp and round, deep, touching and apart.
#[test]
fn the_depth_is_that_of_the_best_axis_in_double_precision() {
    let mut random = Random(0x7171_2323_ABAB_0101);
    let (mut touching, mut apart) = (0, 0);
    for size in [1e-3, 1.0, 100.0] {
        let solids = solids(&mut random, size);
        for round in 0..900 {
            let (a, b) = (&solids[round % solids.len()], &solids[round / solids.len() % solids.len()]);
            let thin = min(a.inner_radius(), b.inner_radius());
            let depth = [-0.5, -1e-3, 1e-3, 0.1, 1.0][round % 5] * thin;
            let pose = sunk(&mut random, a, b, depth);
            let oracle = hull_oracle(&as_hull(a), &as_hull(b), &pose) as Real;
            let found = contacts(a, b, &pose, 0.0);
            let slack = 1e-5 * size;
            assert!(oracle > -slack || !found.points().is_empty(), "{round} {size}: overlap {oracle} lost");
            assert!(oracle < slack || found.points().is_empty(), "{round} {size}: apart by {oracle}, {found:?}");
            if oracle < -slack {
                touching += 1;
                // Faces are preferred by less than a hundredth of the tolerance size.
                let size = min(as_polyhedron_size(a), as_polyhedron_size(b));
                let deepest = lowest(&found);
                assert!(deepest >= oracle - 8e-3 * size - slack, "{round}: {deepest}, best axis {oracle}");
                assert!(deepest <= slack, "{round}: {deepest}");
            }
            apart += (oracle > slack) as u32;
        }
    }
    assert!(touching > 900 && apart > 400, "{touching} {apart}");
}

fn as_polyhedron_size(shape: &Shape) -> Real {
    Polyhedron::from_hull(&as_hull(shape)).size
}

/// A remembered axis, of the same place or of another one, changes the cost but no bit; nor do the instructions.
#[test]
fn neither_cache_nor_instructions_change_a_bit() {
    let mut random = Random(0x0F0F_1E1E_2D2D_3C3C);
    let solids = solids(&mut random, 1.0);
    let mut touching = 0;
    for round in 0..4000 {
        let (a, b) = (&solids[round % solids.len()], &solids[round / solids.len() % solids.len()]);
        let mut pose = sunk(&mut random, a, b, [0.02, 0.2][round % 2]);
        let mut cache = PairCache::default();
        for _ in 0..4 {
            let expected = contacts(a, b, &pose, 0.02);
            touching += expected.points().len();
            let mut left = None;
            for level in SimdLevel::available() {
                let (mut remembered, mut found) = (cache, Manifold::EMPTY);
                collide_on(level, (a, b), &pose, 0.02, (&mut remembered, &mut found));
                assert_eq!(found.points(), expected.points(), "{round} {level} {cache:?}");
                assert_eq!(*left.get_or_insert(remembered), remembered, "{round} {level} {cache:?}");
            }
            cache = left.unwrap();
            let turn = random.vector() * 0.05;
            let turned = Rotation::from_xyzw(turn.x, turn.y, turn.z, 1.0).normalize().mul(pose.rotation);
            pose = Pose::new(pose.position + random.vector() * 0.05, turned);
        }
    }
    assert!(touching > 8000, "{touching}");
}

/// Equal boxes have many axes with the same gap: the choice is the first, whatever is remembered.
#[test]
fn ties_go_to_the_first_axis_whatever_is_remembered() {
    let cube = Shape::Hull(std::sync::Arc::new(ConvexHull::from_cuboid(Vec3::ONE).unwrap()));
    let quarter = Rotation::from_xyzw(0.0, 0.0, libm::sinf(0.125 * std::f32::consts::PI), 0.923_879_5);
    let tilted = Rotation::from_xyzw(libm::sinf(0.125 * std::f32::consts::PI), 0.0, 0.0, 0.923_879_5);
    for pose in [
        Pose::from_position(Vec3::new(1.9, 1.9, 0.0)),
        Pose::from_position(Vec3::ZERO),
        Pose::new(Vec3::new(0.0, 2.3, 0.0), quarter),
        Pose::new(Vec3::new(0.0, 2.7, 0.0), quarter.mul(tilted)),
    ] {
        let expected = contacts(&cube, &cube, &pose, 0.02);
        for kind in [FACE1, FACE2, EDGES] {
            for index in (0..6).chain((0..24).flat_map(|e1| (0..24).map(move |e2| e1 << 15 | e2))) {
                let (mut cache, mut found) = (PairCache { words: [kind | index, 0] }, Manifold::EMPTY);
                collide(&cube, &cube, &pose, 0.02, &mut cache, &mut found);
                assert_eq!(found.points(), expected.points(), "{kind:x} {index:x}");
            }
        }
    }
}
