//! Two placed shapes: whether they overlap, how far apart they are, where they touch.
//!
//! Distances are those of the closest parts, found by GJK. Where parts overlap, GJK has no distance; the narrow phase
//! then says how deep, as far as it knows: it gives the depth along the normal by which it would push the shapes apart.

use super::parts::{Part, Region, visit_parts};
use crate::math::{Aabb, Pose, Real, Vec3, normalize_or};
use crate::narrow_phase::{Manifold, ManifoldPoint, PairCache, Support, closest, collide};
use crate::shape::Shape;

/// The closest points of two shapes, world.
///
/// ```
/// use arbiter3d::{Shape, distance, math::{Pose, Vec3}};
/// let (ball, cube) = (Shape::sphere(1.0)?, Shape::cuboid(Vec3::ONE)?);
/// let apart = Pose::from_position(Vec3::X * 5.0);
/// let found = distance(&ball, &Pose::IDENTITY, &cube, &apart, 10.0).unwrap();
/// assert!((found.distance - 3.0).abs() < 1e-5 && found.point2.distance(Vec3::X * 4.0) < 1e-5);
/// # Ok::<(), arbiter3d::ShapeError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShapeDistance {
    /// Gap, metres; negative where the shapes overlap: how deep the narrow phase finds them.
    pub distance: Real,
    /// On the surface of shape 1.
    pub point1: Vec3,
    /// On the surface of shape 2.
    pub point2: Vec3,
    /// Unit vector from shape 1 to shape 2.
    pub normal: Vec3,
}

/// Distance and closest points of two shapes placed in the world; `None` where they are farther apart than
/// `max_distance` (metres, may be infinite).
///
/// Meshes count as surfaces, seen from both sides. Method: Gilbert, Johnson and Keerthi, 1988, on the nearest parts.
///
/// ```
/// use arbiter3d::{Shape, distance, math::{Pose, Vec3}};
/// let cube = Shape::cuboid(Vec3::ONE)?;
/// let place = |x: f32| Pose::from_position(Vec3::X * x);
/// let overlap = distance(&cube, &place(0.0), &cube, &place(1.9), 0.0).unwrap();
/// assert!((overlap.distance + 0.1).abs() < 1e-5 && overlap.normal == Vec3::X);
/// assert!(distance(&cube, &place(0.0), &cube, &place(5.0), 1.0).is_none());
/// # Ok::<(), arbiter3d::ShapeError>(())
/// ```
#[must_use]
pub fn distance(
    shape1: &Shape,
    pose1: &Pose,
    shape2: &Shape,
    pose2: &Pose,
    max_distance: Real,
) -> Option<ShapeDistance> {
    let found = separation(shape1, shape2, &pose1.relative(pose2), max_distance)?.distance;
    Some(ShapeDistance {
        distance: found.distance,
        point1: pose1.transform_point(found.point1),
        point2: pose1.transform_point(found.point2),
        normal: pose1.rotation.rotate(found.normal),
    })
}

/// Whether two shapes placed in the world share a point. Meshes count as surfaces, seen from both sides.
///
/// ```
/// use arbiter3d::{Shape, overlaps, math::{Pose, Vec3}};
/// let ball = Shape::sphere(1.0)?;
/// assert!(overlaps(&ball, &Pose::IDENTITY, &ball, &Pose::from_position(Vec3::X * 1.9)));
/// assert!(!overlaps(&ball, &Pose::IDENTITY, &ball, &Pose::from_position(Vec3::X * 2.1)));
/// # Ok::<(), arbiter3d::ShapeError>(())
/// ```
#[must_use]
pub fn overlaps(shape1: &Shape, pose1: &Pose, shape2: &Shape, pose2: &Pose) -> bool {
    let pose = pose1.relative(pose2);
    let mut found = false;
    each_part(shape2, &shape1.aabb(&pose.inverse()), |part2| {
        let placed = part2.pose.map_or(pose, |own| pose.mul(&own));
        visit_parts(shape1, &Region::Box(part2.support.bounds(&placed)), |part1, limit| {
            found |= parts_overlap(&part1.support, &part2.support, &part1.seen(&placed));
            if found { -1.0 } else { limit }
        });
        !found
    });
    found
}

/// Whether two parts share a point.
pub(crate) fn parts_overlap(part1: &Support, part2: &Support, pose: &Pose) -> bool {
    closest(part1, part2, pose).is_none_or(|found| found.gap(part1, part2) <= 0.0)
}

/// Calls `visit` with the parts of a shape that overlap a box, until it returns false.
fn each_part<'a>(shape: &'a Shape, aabb: &Aabb, mut visit: impl FnMut(&Part<'a>) -> bool) {
    visit_parts(shape, &Region::Box(*aabb), |part, limit| if visit(part) { limit } else { -1.0 });
}

/// Distance of two shapes in the frame of the first, and which part of it is closest.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Separation {
    pub distance: ShapeDistance,
    pub child: Option<u32>,
    pub triangle: Option<u32>,
}

/// Distance of two shapes, `pose` placing the second in the frame of the first, if it is at most `max_distance`.
pub(crate) fn separation(shape1: &Shape, shape2: &Shape, pose: &Pose, max_distance: Real) -> Option<Separation> {
    let mut best: Option<Separation> = None;
    let mut overlap = None;
    let near = shape1.aabb(&pose.inverse());
    visit_parts(shape2, &Region::Near { aabb: near, limit: max_distance }, |part2, limit| {
        let placed = part2.pose.map_or(*pose, |own| pose.mul(&own));
        let aabb = part2.support.bounds(&placed);
        let limit = best.map_or(limit, |best| best.distance.distance);
        visit_parts(shape1, &Region::Near { aabb, limit }, |part1, limit| {
            let limit = best.map_or(limit, |best| best.distance.distance);
            match part_distance(part1, &part2.support, &placed) {
                None => {
                    overlap = Some((part1.child, part1.triangle));
                    -1.0
                }
                Some(found) => {
                    let first = best.is_none_or(|b| {
                        let known = (b.distance.distance, b.child, b.triangle);
                        (found.distance.distance, found.child, found.triangle) < known
                    });
                    if first && found.distance.distance <= limit {
                        best = Some(found);
                    }
                    crate::math::min(found.distance.distance, limit)
                }
            }
        });
        if overlap.is_some() { -1.0 } else { best.map_or(limit, |best| best.distance.distance) }
    });
    if let Some((child, triangle)) = overlap {
        return Some(Separation { distance: depth(shape1, shape2, pose), child, triangle });
    }
    best
}

/// Distance of two parts that are apart, in the frame of shape 1.
fn part_distance(part1: &Part, support2: &Support, placed: &Pose) -> Option<Separation> {
    let found = closest(&part1.support, support2, &part1.seen(placed))?;
    let distance = found.gap(&part1.support, support2);
    if distance <= 0.0 {
        return None;
    }
    let normal = part1.vector_out(found.normal);
    let distance = ShapeDistance {
        distance,
        point1: part1.point_out(found.point1) + normal * part1.support.radius(),
        point2: part1.point_out(found.point2) - normal * support2.radius(),
        normal,
    };
    Some(Separation { distance, child: part1.child, triangle: part1.triangle })
}

/// What touches may be apart by rounding: by this share of the smaller shape's reach at most.
const TOUCHING: Real = 1e-4;

/// The point at which two shapes that overlap, or touch but for rounding, overlap most, in the frame of shape 1.
pub(crate) fn deepest_contact(shape1: &Shape, shape2: &Shape, pose: &Pose) -> Option<ManifoldPoint> {
    let mut manifold = Manifold::EMPTY;
    let margin = TOUCHING * crate::math::min(shape1.reach(), shape2.reach());
    collide(shape1, shape2, pose, margin, &mut PairCache::default(), &mut manifold);
    let mut deepest: Option<ManifoldPoint> = None;
    for point in manifold.points() {
        if deepest.is_none_or(|other| point.separation < other.separation) {
            deepest = Some(*point);
        }
    }
    deepest
}

/// How deep two shapes overlap. Where the narrow phase has nothing to say (two surfaces that cross, or a body behind a
/// one-sided mesh) that is zero, along the line between their middles.
fn depth(shape1: &Shape, shape2: &Shape, pose: &Pose) -> ShapeDistance {
    if let Some(contact) = deepest_contact(shape1, shape2, pose) {
        let distance = crate::math::min(contact.separation, 0.0);
        return ShapeDistance { distance, point1: contact.point1, point2: contact.point2(), normal: contact.normal };
    }
    let (middle1, middle2) = (shape1.local_aabb().center(), pose.transform_point(shape2.local_aabb().center()));
    let normal = normalize_or(middle2 - middle1, Vec3::Y);
    ShapeDistance { distance: 0.0, point1: middle2, point2: middle2, normal }
}

/// The point of a shape that is closest to a point of its frame, no farther than `max_distance`. The point itself where
/// it is inside, with a zero normal.
pub(crate) fn closest_point(shape: &Shape, point: Vec3, max_distance: Real) -> Option<Separation> {
    let probe = Support::Triangle([Vec3::ZERO; 3]);
    let placed = Pose::from_position(point);
    let mut best: Option<Separation> = None;
    let region = Region::Near { aabb: Aabb::new(point, point), limit: max_distance };
    visit_parts(shape, &region, |part, limit| {
        let limit = best.map_or(limit, |best| best.distance.distance);
        let inside = ShapeDistance { distance: 0.0, point1: point, point2: point, normal: Vec3::ZERO };
        let found = part_distance(part, &probe, &placed).unwrap_or(Separation {
            distance: inside,
            child: part.child,
            triangle: part.triangle,
        });
        let first = best.is_none_or(|b| {
            (found.distance.distance, found.child, found.triangle) < (b.distance.distance, b.child, b.triangle)
        });
        if first && found.distance.distance <= limit {
            best = Some(found);
        }
        crate::math::min(found.distance.distance, limit)
    });
    best
}

/// Whether a point of a shape's frame is inside it. Meshes have no inside.
pub(crate) fn holds_point(shape: &Shape, point: Vec3) -> bool {
    let probe = Support::Triangle([Vec3::ZERO; 3]);
    let placed = Pose::from_position(point);
    let mut found = false;
    each_part(shape, &Aabb::new(point, point), |part| {
        found |= part.triangle.is_none() && parts_overlap(&part.support, &probe, &part.seen(&placed));
        !found
    });
    found
}
