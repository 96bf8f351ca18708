//! Rays against single shapes, in the shape's own frame.
//!
//! A ray is `origin + t · direction` for `0 ≤ t ≤ max_fraction`; the direction need not be a unit vector, and `t`
//! scales with its inverse. A ray that starts inside a shape (or on its surface, unless it enters there) hits at
//! fraction 0 with a zero normal, for there is no surface to speak of. Otherwise the normal is the unit normal of the
//! surface, pointing out. A hit exactly at `max_fraction` counts. Numbers that are not finite miss.
//!
//! - *Sphere, capsule:* the quadratic is solved about the point of the line that is closest to the centre, not about the
//!   origin: with `p` that point, `t = t_p − sqrt(r² − |p|²) / |d|`, which keeps its digits when the origin is far away.
//!   Source: Haines et al., "Precision Improvements for Ray/Sphere Intersection", Ray Tracing Gems, 2019.
//! - *Box:* the last of the three near planes is entered before the first far plane is left (slabs).
//! - *Hull:* the same with the planes of all faces. Source: Cyrus and Beck, "Generalized two- and three-dimensional
//!   clipping", 1978.
//! - *Everything else:* see `convex_ray`, `surface_ray`, and the files of the shapes.

use super::{Capsule, Cuboid, Plane, Shape};
use crate::math::{Pose, Real, Vec3};

/// The part of a line from `origin` to `origin + max_fraction · direction`.
///
/// ```
/// use arbiter3d::{Ray, math::Vec3};
/// let ray = Ray::new(Vec3::new(0.0, 2.0, 0.0), Vec3::new(0.0, -4.0, 0.0));
/// assert_eq!(ray.at(0.5), Vec3::ZERO);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where it starts, metres.
    pub origin: Vec3,
    /// Where it goes, of any length. Fractions are in units of this vector.
    pub direction: Vec3,
    /// Where it ends, as a fraction of the direction; may be infinite. Default 1.
    pub max_fraction: Real,
}

impl Ray {
    /// The ray from `origin` to `origin + direction`.
    #[must_use]
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        Self { origin, direction, max_fraction: 1.0 }
    }

    /// The point at a fraction.
    #[inline]
    #[must_use]
    pub fn at(&self, fraction: Real) -> Vec3 {
        self.origin + self.direction * fraction
    }
}

/// Where a ray meets a shape.
///
/// ```
/// use arbiter3d::{Ray, Shape, cast_ray, math::Vec3};
/// let ray = Ray::new(Vec3::new(0.0, 3.0, 0.0), Vec3::new(0.0, -4.0, 0.0));
/// let hit = cast_ray(&Shape::sphere(1.0)?, &ray).unwrap();
/// assert_eq!((hit.fraction, hit.normal), (0.5, Vec3::Y));
/// # Ok::<(), arbiter3d::ShapeError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShapeHit {
    /// Position along the ray, from 0 to the ray's `max_fraction`.
    pub fraction: Real,
    /// Outward unit normal of the surface, or zero where the ray starts inside.
    pub normal: Vec3,
}

impl ShapeHit {
    pub(crate) const INSIDE: Self = Self { fraction: 0.0, normal: Vec3::ZERO };
}

/// The first point of a shape along a ray given in the shape's frame.
///
/// Meshes have no inside: a ray meets their triangles, those of one-sided meshes from the front only.
#[inline]
#[must_use]
pub fn cast_ray(shape: &Shape, ray: &Ray) -> Option<ShapeHit> {
    match shape {
        Shape::Sphere(sphere) => cast_sphere(sphere.radius(), ray),
        Shape::Capsule(capsule) => cast_capsule(capsule, ray),
        Shape::Cuboid(cuboid) => cast_cuboid(cuboid, ray),
        Shape::Hull(hull) => cast_planes(hull.planes(), ray),
        other => other.geometry().cast_ray(ray),
    }
}

/// As [`cast_ray`], with the shape placed by `pose` in the frame of the ray.
pub(crate) fn cast_placed(shape: &Shape, pose: &Pose, ray: &Ray) -> Option<ShapeHit> {
    let local = Ray {
        origin: pose.inverse_transform_point(ray.origin),
        direction: pose.rotation.inverse_rotate(ray.direction),
        ..*ray
    };
    let hit = cast_ray(shape, &local)?;
    Some(ShapeHit { normal: pose.rotation.rotate(hit.normal), ..hit })
}

/// A hit, if it lies on the ray.
fn hit_at(fraction: Real, normal: Vec3, ray: &Ray) -> Option<ShapeHit> {
    (fraction >= 0.0 && fraction <= ray.max_fraction).then_some(ShapeHit { fraction, normal })
}

/// Where a ray from outside enters the ball of a radius about the origin, and the point there.
fn enter_ball(radius: Real, origin: Vec3, direction: Vec3) -> Option<(Real, Vec3)> {
    let length = direction.length();
    // A zero direction gives NaN here, which misses below.
    let unit = direction / length;
    let along = -origin.dot(unit);
    let closest = origin + unit * along;
    let squared = radius * radius - closest.length_squared();
    let hits = along >= 0.0 && squared >= 0.0;
    if !hits {
        return None;
    }
    let half_chord = squared.sqrt();
    // Rounding may put the surface behind an origin that lies on it: heading in, that is a hit at the start.
    let distance = crate::math::max(along - half_chord, 0.0);
    // `closest` already has small coordinates, so the surface point keeps their digits.
    Some((distance / length, closest - unit * half_chord))
}

pub(super) fn cast_sphere(radius: Real, ray: &Ray) -> Option<ShapeHit> {
    if ray.origin.length_squared() < radius * radius {
        return Some(ShapeHit::INSIDE);
    }
    let (fraction, point) = enter_ball(radius, ray.origin, ray.direction)?;
    hit_at(fraction, point / point.length(), ray)
}

/// The line first enters the infinite cylinder about y. Within the segment that is the hit. Past an end, everything
/// that follows inside the cylinder reaches the capsule through the ball at that end, so the ball decides.
pub(super) fn cast_capsule(capsule: &Capsule, ray: &Ray) -> Option<ShapeHit> {
    let (radius, half_length) = (capsule.radius(), capsule.half_length());
    let (origin, direction) = (ray.origin, ray.direction);
    let on_axis = Vec3::new(0.0, crate::math::clamp(origin.y, -half_length, half_length), 0.0);
    if (origin - on_axis).length_squared() < radius * radius {
        return Some(ShapeHit::INSIDE);
    }
    let across = Vec3::new(origin.x, 0.0, origin.z);
    let end = if across.length_squared() < radius * radius {
        // Inside the cylinder but not the capsule: past an end.
        on_axis
    } else {
        let (fraction, point) = enter_ball(radius, across, Vec3::new(direction.x, 0.0, direction.z))?;
        let height = origin.y + direction.y * fraction;
        if height.abs() <= half_length {
            return hit_at(fraction, point / point.length(), ray);
        }
        Vec3::new(0.0, if height < 0.0 { -half_length } else { half_length }, 0.0)
    };
    let (fraction, point) = enter_ball(radius, origin - end, direction)?;
    hit_at(fraction, point / point.length(), ray)
}

/// The part of a line that lies behind some planes.
struct Clip {
    enter: Real,
    leave: Real,
    normal: Vec3,
}

impl Clip {
    fn new(ray: &Ray) -> Self {
        Self { enter: 0.0, leave: ray.max_fraction, normal: Vec3::ZERO }
    }

    /// Cuts off what lies in front of a plane, given the height of the origin over it and the rate at which the ray
    /// rises.
    #[inline(always)]
    fn cut(&mut self, normal: Vec3, height: Real, rate: Real) -> bool {
        if height.is_nan() || rate.is_nan() {
            return false;
        }
        if rate < 0.0 {
            let fraction = height / -rate;
            // Entering at the very start is a hit of the surface, so the normal counts at 0 as well.
            if height >= 0.0 && (fraction > self.enter || self.normal == Vec3::ZERO) {
                self.enter = fraction;
                self.normal = normal;
            }
        } else if rate > 0.0 {
            self.leave = crate::math::min(-height / rate, self.leave);
        } else if height > 0.0 {
            return false;
        }
        self.enter <= self.leave
    }

    fn hit(&self) -> Option<ShapeHit> {
        self.enter.is_finite().then_some(ShapeHit { fraction: self.enter, normal: self.normal })
    }
}

pub(super) fn cast_cuboid(cuboid: &Cuboid, ray: &Ray) -> Option<ShapeHit> {
    let half_extents = cuboid.half_extents();
    let mut clip = Clip::new(ray);
    for (axis, normal) in [Vec3::X, Vec3::Y, Vec3::Z].into_iter().enumerate() {
        let (position, rate, half_extent) = (ray.origin[axis], ray.direction[axis], half_extents[axis]);
        if !clip.cut(normal, position - half_extent, rate) || !clip.cut(-normal, -position - half_extent, -rate) {
            return None;
        }
    }
    clip.hit()
}

pub(super) fn cast_planes(planes: &[Plane], ray: &Ray) -> Option<ShapeHit> {
    let mut clip = Clip::new(ray);
    for plane in planes {
        let height = plane.normal.dot(ray.origin) - plane.offset;
        if !clip.cut(plane.normal, height, plane.normal.dot(ray.direction)) {
            return None;
        }
    }
    clip.hit()
}

#[cfg(test)]
mod tests;
