//! Rays against cylinders, cones, and convex shapes known by their support alone.
//!
//! A cylinder is the part of an endless one between two planes, a cone the part of an endless one over a plane: the line is
//! inside for an interval of each, and enters the shape where the last of them begins. The quadratics are solved in `f64`.
//!
//! Any other convex shape is met by a point that is cast at it (`narrow_phase::linear_cast`).

use super::ray::{Ray, ShapeHit};
use crate::math::{Pose, Real, Vec3};
use crate::narrow_phase::{Cast, Support, linear_cast};
use crate::shape::{Cone, Cylinder};
use glam::DVec3;

/// Where a line is inside something, and the outward normal where it enters.
#[derive(Clone, Copy)]
struct Stretch {
    enter: f64,
    leave: f64,
    normal: DVec3,
}

impl Stretch {
    const ALL: Self = Self { enter: f64::NEG_INFINITY, leave: f64::INFINITY, normal: DVec3::ZERO };

    fn and(self, other: Self) -> Self {
        let leave = if other.leave < self.leave { other.leave } else { self.leave };
        if other.enter > self.enter { Self { leave, ..other } } else { Self { leave, ..self } }
    }

    /// Behind a plane, given the height of the origin over it and the rate at which the line rises.
    fn behind(normal: DVec3, height: f64, rate: f64) -> Option<Self> {
        if rate < 0.0 {
            return Some(Self { enter: height / -rate, normal, ..Self::ALL });
        }
        if rate > 0.0 {
            return Some(Self { leave: -height / rate, ..Self::ALL });
        }
        (height <= 0.0).then_some(Self::ALL)
    }

    fn hit(self, ray: &Ray) -> Option<ShapeHit> {
        if !(self.enter <= self.leave && self.leave >= 0.0) {
            return None;
        }
        if self.enter < 0.0 {
            return (self.leave > 0.0).then_some(ShapeHit::INSIDE);
        }
        let fraction = self.enter as Real;
        (fraction <= ray.max_fraction).then(|| ShapeHit { fraction, normal: self.normal.normalize().as_vec3() })
    }
}

/// Cylinder along y.
pub(crate) fn cast_cylinder(cylinder: &Cylinder, ray: &Ray) -> Option<ShapeHit> {
    let (r, h) = (f64::from(cylinder.radius()), f64::from(cylinder.half_length()));
    let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let top = Stretch::behind(DVec3::Y, o.y - h, d.y)?;
    let bottom = Stretch::behind(-DVec3::Y, -o.y - h, -d.y)?;
    let (a, b, c) = (d.x * d.x + d.z * d.z, o.x * d.x + o.z * d.z, o.x * o.x + o.z * o.z - r * r);
    let side = if a > 0.0 {
        // Nearest to the axis at `−b / a`; half the chord from there.
        let near = o + d * (-b / a);
        let squared = (r * r - near.x * near.x - near.z * near.z) / a;
        if squared < 0.0 {
            return None;
        }
        let (middle, half) = (-b / a, squared.sqrt());
        let at = o + d * (middle - half);
        Stretch { enter: middle - half, leave: middle + half, normal: DVec3::new(at.x, 0.0, at.z) }
    } else if c <= 0.0 {
        Stretch::ALL
    } else {
        return None;
    };
    side.and(top).and(bottom).hit(ray)
}

/// Cone along y, its tip up: `x² + z² ≤ k² w²` with `w = h − y ≥ 0` and `k = r / 2h`.
pub(crate) fn cast_cone(cone: &Cone, ray: &Ray) -> Option<ShapeHit> {
    let (r, h) = (f64::from(cone.radius()), f64::from(cone.half_length()));
    let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let base = Stretch::behind(-DVec3::Y, -o.y - h, -d.y)?;
    let k2 = (r / (2.0 * h)) * (r / (2.0 * h));
    let w = h - o.y;
    let a = d.x * d.x + d.z * d.z - k2 * d.y * d.y;
    let b = o.x * d.x + o.z * d.z + k2 * w * d.y;
    let c = o.x * o.x + o.z * o.z - k2 * w * w;
    let discriminant = b * b - a * c;
    if discriminant < 0.0 {
        return None;
    }
    let normal_at = |t: f64| {
        let p = o + d * t;
        DVec3::new(p.x, k2 * (h - p.y), p.z)
    };
    // The roots without cancellation; those on the mirror image of the cone above the tip do not count.
    let q = if b > 0.0 { -b - discriminant.sqrt() } else { -b + discriminant.sqrt() };
    let (t1, t2) = if q == 0.0 { (0.0, 0.0) } else { (c / q, q / a) };
    let (first, second) = if t1 <= t2 { (t1, t2) } else { (t2, t1) };
    let below = |t: f64| t.is_finite() && h - (o.y + d.y * t) >= 0.0;
    let side = match (below(first), below(second)) {
        (true, true) => Stretch { enter: first, leave: second, normal: normal_at(first) },
        // The line runs down inside the cone for good, or comes from there.
        (false, true) if d.y < 0.0 => Stretch { enter: second, normal: normal_at(second), ..Stretch::ALL },
        (true, false) if d.y < 0.0 => Stretch { enter: first, normal: normal_at(first), ..Stretch::ALL },
        (true, false) => Stretch { leave: first, ..Stretch::ALL },
        (false, true) => Stretch { leave: second, ..Stretch::ALL },
        (false, false) => return None,
    };
    side.and(base).hit(ray)
}

/// Any bounded convex shape.
pub(crate) fn cast_support(support: &Support<'_>, ray: &Ray) -> Option<ShapeHit> {
    if !(ray.origin.is_finite() && ray.direction.is_finite() && ray.max_fraction >= 0.0) {
        return None;
    }
    let probe = Support::Triangle([Vec3::ZERO; 3]);
    let start = Pose::from_position(ray.origin);
    let size = support.reach(support.inner_ball().0);
    match linear_cast((support, &probe), &start, ray.direction, ray.max_fraction, size) {
        Cast::Miss => None,
        Cast::Overlap => Some(ShapeHit::INSIDE),
        Cast::Hit(hit) => Some(ShapeHit { fraction: hit.fraction, normal: hit.normal }),
    }
}
