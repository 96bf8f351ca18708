//! Spheres against spheres, capsules, cuboids and hulls: one point, from the closest point of the other shape.
//!
//! With `c` the centre of the sphere and `q` the closest point of the other shape's core (a point, a segment, a
//! solid), the normal is `(c − q) / |c − q|` and the separation `|c − q|` minus the radii. Where `c` is inside a
//! solid, the nearest face gives normal and depth; where `c = q` any direction square to the core is as good as
//! another.

use super::{Manifold, ManifoldPoint};
use crate::math::{Pose, Real, Vec3, clamp, normalize_or, tangents};
use crate::shape::Support;
use crate::shape::distance::closest;
use crate::shape::polyhedron::Polyhedron;
use crate::shape::{Capsule, ConvexHull, Cuboid, Sphere};

/// Sphere against sphere.
pub(crate) fn sphere_sphere(a: &Sphere, b: &Sphere, pose: &Pose, margin: Real, manifold: &mut Manifold) {
    manifold.clear();
    push_rounded(Vec3::ZERO, a.radius(), pose.position, b.radius(), Vec3::Y, (margin, manifold));
}

/// Capsule (shape 1) against sphere.
pub(crate) fn capsule_sphere(a: &Capsule, b: &Sphere, pose: &Pose, margin: Real, manifold: &mut Manifold) {
    manifold.clear();
    let h = a.half_length();
    let closest = Vec3::new(0.0, clamp(pose.position.y, -h, h), 0.0);
    push_rounded(closest, a.radius(), pose.position, b.radius(), Vec3::X, (margin, manifold));
}

/// Cuboid (shape 1) against sphere.
pub(crate) fn cuboid_sphere(a: &Cuboid, b: &Sphere, pose: &Pose, margin: Real, manifold: &mut Manifold) {
    manifold.clear();
    let (h, c) = (a.half_extents(), pose.position);
    let q = Vec3::new(clamp(c.x, -h.x, h.x), clamp(c.y, -h.y, h.y), clamp(c.z, -h.z, h.z));
    if q != c {
        push_rounded(q, 0.0, c, b.radius(), Vec3::Y, (margin, manifold));
        return;
    }
    // Inside, or just on the surface: out through the nearest face.
    let gaps = [c.x.abs() - h.x, c.y.abs() - h.y, c.z.abs() - h.z];
    let mut axis = 0;
    for k in 1..3 {
        if gaps[k] > gaps[axis] {
            axis = k;
        }
    }
    let sign = if c[axis] < 0.0 { -1.0 } else { 1.0 };
    let mut normal = Vec3::ZERO;
    normal[axis] = sign;
    let mut point1 = c;
    point1[axis] = sign * h[axis];
    manifold.push(ManifoldPoint { point1, normal, separation: gaps[axis] - b.radius(), feature: 0 });
}

/// Hull (shape 1) against sphere.
///
/// The face that the centre is highest above holds the closest point whenever the centre is over it, and shows at once
/// when the pair is apart; beside it, an edge or a corner is closest and [`closest`] finds it.
pub(crate) fn hull_sphere(a: &ConvexHull, b: &Sphere, pose: &Pose, margin: Real, manifold: &mut Manifold) {
    manifold.clear();
    let polyhedron = Polyhedron::from_hull(a);
    let (c, r) = (pose.position, b.radius());
    let (mut face, mut height) = (0, -Real::MAX);
    for (i, plane) in polyhedron.planes.iter().enumerate() {
        let h = plane.normal.dot(c) - plane.offset;
        if h > height {
            (face, height) = (i, h);
        }
    }
    if height > r + margin {
        return;
    }
    let normal = polyhedron.planes[face].normal;
    let over = |edge| {
        let (out, offset) = polyhedron.side_plane(edge);
        out.dot(c) <= offset
    };
    if height > 0.0
        && !polyhedron.face_loop(face).all(over)
        && let Some(found) = closest(&Support::Hull(a), &Support::Sphere(*b), pose)
    {
        push_rounded(found.point1, 0.0, c, r, normal, (margin, manifold));
        return;
    }
    manifold.push(ManifoldPoint { point1: c - normal * height, normal, separation: height - r, feature: 0 });
}

/// One point between two cores that are closest at `p1` and `p2`, each with a radius.
///
/// `fallback` is the normal where the cores touch.
pub(super) fn push_rounded(
    p1: Vec3,
    radius1: Real,
    p2: Vec3,
    radius2: Real,
    fallback: Vec3,
    (margin, manifold): (Real, &mut Manifold),
) {
    let between = p2 - p1;
    let reach = radius1 + radius2 + margin;
    let normal = normalize_or(between, fallback);
    let distance = between.dot(normal);
    if distance <= reach {
        let separation = distance - radius1 - radius2;
        manifold.push(ManifoldPoint { point1: p1 + normal * radius1, normal, separation, feature: 0 });
    }
}

/// A unit vector square to the unit vector `direction`.
pub(super) fn any_perpendicular(direction: Vec3) -> Vec3 {
    tangents(direction).0
}
