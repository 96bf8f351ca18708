//! The closed forms against the searches, and shapes on which formulas break.

use super::nearest::nearest;
use crate::math::{Pose, Real, Rotation, Vec3};
use crate::random::Random;
use crate::shape::Shape;
use crate::shape::Support;
use crate::shape::distance::{Nearness, Placed};

/// Shapes of all kinds about as large as given, up to `thin` times as long as wide.
fn specimens(size: Real, thin: Real, random: &mut Random) -> Vec<Shape> {
    let mut length = || size * if random.unit() < 0.5 { 1.0 } else { random.between(1.0 / thin, 1.0) };
    let [a, b, c] = [length(), length(), length()];
    let half = Vec3::new(a, b, c);
    let mut points = |count: usize| -> Vec<Vec3> { (0..count).map(|_| random.direction() * half).collect() };
    let (cloud, corners) = (points(9), points(12));
    [
        Shape::sphere(a),
        Shape::capsule(a, b),
        Shape::cuboid(half),
        Shape::hull(&corners),
        Shape::cylinder(a, b),
        Shape::cone(a, b),
        Shape::tapered_capsule((a - b).abs() + 0.2 * c, a, b),
        Shape::ellipsoid(half),
        Shape::point_cloud(&cloud),
        Shape::cuboid(half).and_then(|core| Shape::rounded(&core, 0.3 * c)),
        Shape::cylinder(a, b).and_then(|can| can.transformed(crate::math::Mat3::from_diagonal(half), Vec3::X * a)),
        // Flat ones.
        Shape::triangle([Vec3::ZERO, Vec3::X * a, Vec3::new(0.2 * a, b, 0.0)]),
        Shape::point_cloud(&[Vec3::Y * a]),
        Shape::point_cloud(&[Vec3::Y * a, Vec3::X * b, Vec3::ZERO]),
        Shape::point_cloud(&[Vec3::X * -a, Vec3::ZERO, Vec3::X * b]),
        Shape::point_cloud(&[Vec3::X * a, Vec3::Z * b, Vec3::X * -a, Vec3::Z * -b]),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// Poses with everything from parallel axes and equal centres to chance.
fn pose(size: Real, random: &mut Random) -> Pose {
    let square = Rotation::from_xyzw(1.0, 0.0, 0.0, 1.0).normalize();
    let rotation = match (random.unit() * 4.0) as u32 {
        0 => Rotation::IDENTITY,
        1 => square,
        2 => Rotation::from_xyzw(random.between(-1e-4, 1e-4), random.unit(), random.between(-1e-4, 1e-4), 1.0)
            .normalize(),
        _ => random.rotation(),
    };
    let reach = random.between(0.0, 3.0) * size;
    let position = match (random.unit() * 4.0) as u32 {
        0 => Vec3::Y * reach,
        1 => Vec3::X * reach,
        _ => random.vector() * reach,
    };
    Pose::new(position, rotation)
}

/// Where shapes are apart, faces, axes, sides and Newton's method give the distance that the search on simplices gives.
#[test]
fn closed_forms_give_the_distance_of_the_search() {
    let mut random = Random(0x0FAC_E0FF_ACE5_1DE5);
    let mut apart = 0;
    for _ in 0..60 {
        let (pool1, pool2) = (specimens(1.0, 5.0, &mut random), specimens(0.8, 5.0, &mut random));
        for shape1 in &pool1 {
            for shape2 in &pool2 {
                let (support1, support2) = (Support::new(shape1).unwrap(), Support::new(shape2).unwrap());
                let pose = pose(1.0, &mut random);
                let placed = Placed::new(&support1, &support2, &pose);
                let Nearness::Gap(gap) = placed.nearness(f64::INFINITY) else { continue };
                let found = nearest(&placed, f64::INFINITY).unwrap();
                let (expected, told) = (gap.way.length(), format!("{found:?} {gap:?} {pose:?} {shape1:?} {shape2:?}"));
                if expected < 1e-4 {
                    continue;
                }
                apart += 1;
                assert!((found.distance - expected).abs() < 1e-6, "{told}");
                assert!(found.normal.dot(gap.way) > (1.0 - 1e-6) * expected, "{told}");
                // A direction shows the gap, and two points of the cores that far apart show that it is no more.
                let shown = placed.corner(-found.normal).difference.dot(found.normal);
                assert!((shown - found.distance).abs() < 1e-6, "{told}");
                assert!(nearest(&placed, 0.99 * expected).is_none(), "{told}");
            }
        }
    }
    assert!(apart > 5000, "{apart}");
}

/// Needles, plates, points and coplanar figures, ten thousand times as long as wide: always an end, always a finite
/// answer.
#[test]
fn what_is_flat_or_thin_still_gets_an_answer() {
    let mut random = Random(0x00DE_9E4E_4A7E_0BAD);
    for round in 0..60 {
        let size = [1.0, 1e-3, 1e3][round % 3];
        let (pool1, pool2) = (specimens(1.0, 1e4, &mut random), specimens(size, 1e4, &mut random));
        for shape1 in &pool1 {
            for shape2 in &pool2 {
                let (support1, support2) = (Support::new(shape1).unwrap(), Support::new(shape2).unwrap());
                let near = if round % 2 == 0 { 0.3 } else { 1.0 };
                let pose = pose(near * crate::math::max(size, 1.0), &mut random);
                let placed = Placed::new(&support1, &support2, &pose);
                let found = nearest(&placed, f64::INFINITY).unwrap();
                let told = format!("{found:?} {pose:?} {shape1:?} {shape2:?}");
                assert!(found.distance.is_finite() && found.point1.is_finite(), "{told}");
                // As long as the columns of a rotation in single precision.
                assert!((found.normal.length() - 1.0).abs() < 1e-6, "{told}");
                // Never deeper than along the way told.
                let shown = placed.corner(-found.normal).difference.dot(found.normal);
                let large = f64::from(shape1.reach() + shape2.reach() + pose.position.length());
                assert!((shown - found.distance).abs() <= 1e-6 * large, "{shown} {told}");
            }
        }
    }
}
