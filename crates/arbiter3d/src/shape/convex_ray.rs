//! Rays against cylinders, cones, and convex shapes known by their support alone.
//!
//! A cylinder is the part of an endless one between two planes, a cone the part of an endless one over a plane: the line is
//! inside for an interval of each, and enters the shape where the last of them begins. The quadratics are solved in `f64`.
//!
//! Any other convex shape is met by a point that is cast at it (`distance::linear_cast`).

use super::distance::{Cast, linear_cast};
use super::support::Support;
use super::{Cone, Cylinder, Ray, ShapeHit};
use crate::math::{Pose, Real, Vec3};
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
        let normal = self.normal.normalize_or(DVec3::Y).as_vec3();
        (fraction <= ray.max_fraction).then_some(ShapeHit { fraction, normal })
    }
}

/// Cylinder along y.
pub(super) fn cast_cylinder(cylinder: &Cylinder, ray: &Ray) -> Option<ShapeHit> {
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
pub(super) fn cast_cone(cone: &Cone, ray: &Ray) -> Option<ShapeHit> {
    let (r, h) = (f64::from(cone.radius()), f64::from(cone.half_length()));
    let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let base = Stretch::behind(-DVec3::Y, -o.y - h, -d.y)?;
    let tip = Stretch::behind(DVec3::Y, o.y - h, d.y)?;
    let k2 = (r / (2.0 * h)) * (r / (2.0 * h));
    let w = h - o.y;
    let a = d.x * d.x + d.z * d.z - k2 * d.y * d.y;
    let b = o.x * d.x + o.z * d.z + k2 * w * d.y;
    let c = o.x * o.x + o.z * o.z - k2 * w * w;
    let discriminant = b * b - a * c;
    if a > 0.0 && discriminant < 0.0 {
        return None;
    }
    let normal_at = |t: f64| {
        let p = o + d * t;
        DVec3::new(p.x, k2 * (h - p.y), p.z)
    };
    // The roots without cancellation.
    let root = if discriminant > 0.0 { discriminant.sqrt() } else { 0.0 };
    let q = if b > 0.0 { -b - root } else { -b + root };
    let (t1, t2) = if q == 0.0 { (0.0, 0.0) } else { (c / q, q / a) };
    let (first, second) = if t1 <= t2 { (t1, t2) } else { (t2, t1) };
    let side = if a > 0.0 {
        // Through one half of the double cone.
        Stretch { enter: first, leave: second, normal: normal_at(first) }
    } else if a == 0.0 && b == 0.0 {
        return None; // On the side itself.
    } else if a == 0.0 {
        // Along the side: in or out once.
        let t = -0.5 * c / b;
        if b > 0.0 {
            Stretch { leave: t, ..Stretch::ALL }
        } else {
            Stretch { enter: t, normal: normal_at(t), ..Stretch::ALL }
        }
    } else if d.y < 0.0 {
        // Steeper than the side: down out of the mirror image above the tip, then inside for good; or up the other way.
        Stretch { enter: second, normal: normal_at(second), ..Stretch::ALL }
    } else {
        Stretch { leave: first, ..Stretch::ALL }
    };
    side.and(base).and(tip).hit(ray)
}

/// Any bounded convex shape.
pub(super) fn cast_support(support: &Support<'_>, ray: &Ray) -> Option<ShapeHit> {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Mat3, tangents};
    use crate::random::Random;
    use crate::shape::distance::closest;
    use crate::shape::{Shape, Sphere};

    fn shapes(size: Real) -> Vec<Shape> {
        let points: Vec<Vec3> = (0..20)
            .map(|i| {
                Vec3::new((i * 7 % 11) as Real / 11.0, (i * 5 % 13) as Real / 13.0, (i * 3 % 17) as Real / 17.0) * size
            })
            .collect();
        let sheared = Mat3::from_cols(Vec3::X, Vec3::new(0.4, 0.9, -0.2), Vec3::Z * 0.7);
        [
            Shape::cylinder(0.6 * size, 0.3 * size),
            Shape::cylinder(0.01 * size, 0.8 * size),
            Shape::cone(0.6 * size, 0.5 * size),
            Shape::cone(0.02 * size, 0.5 * size),
            Shape::tapered_capsule(0.4 * size, 0.2 * size, 0.5 * size),
            Shape::ellipsoid(Vec3::new(0.3, 0.5, 0.7) * size),
            Shape::cylinder(0.6 * size, 0.3 * size).unwrap().transformed(sheared, Vec3::X * size),
            Shape::rounded(&Shape::cuboid(Vec3::new(0.3, 0.4, 0.5) * size).unwrap(), 0.2 * size),
            Shape::rounded(&Shape::hull(&points).unwrap(), 0.1 * size),
            Shape::point_cloud(&points),
            Shape::triangle([Vec3::ZERO, Vec3::X * size, Vec3::new(0.2, 0.3, 0.9) * size]),
        ]
        .map(|shape| shape.unwrap())
        .to_vec()
    }

    /// How far a point is outside a shape, zero inside.
    fn outside(support: &Support<'_>, point: Vec3) -> Real {
        let dot = Support::Sphere(Sphere::new(1.0).unwrap());
        closest(support, &dot, &Pose::from_position(point))
            .map_or(0.0, |c| crate::math::max(c.distance - support.radius(), 0.0))
    }

    fn check(shape: &Shape, ray: &Ray) -> bool {
        let support = Support::new(shape).unwrap();
        let size = shape.reach();
        let at = |t: Real| ray.origin + ray.direction * t;
        let rounding = 5e-6 * (size + ray.origin.length() + ray.direction.length());
        let told = || format!("{shape:?} {ray:?}");
        let Some(hit) = shape.geometry().cast_ray(ray) else {
            for k in 0..=400 {
                let t = k as Real / 400.0 * ray.max_fraction;
                let inside = support.inner_ball().1 > 0.0 && outside(&support, at(t)) == 0.0;
                // What grazes may be missed: but not by more than rounding.
                let deeper = (0..4).all(|i| {
                    let (t1, t2) = tangents(ray.direction.normalize());
                    outside(&support, at(t) + [t1, -t1, t2, -t2][i] * (5.0 * rounding)) == 0.0
                });
                assert!(!(inside && deeper), "missed at {t}: {}", told());
            }
            return false;
        };
        let point = at(hit.fraction);
        assert!((0.0..=ray.max_fraction).contains(&hit.fraction), "{hit:?} {}", told());
        assert!(outside(&support, point) <= rounding, "{hit:?} is off by {}: {}", outside(&support, point), told());
        if outside(&support, ray.origin) == 0.0 {
            assert!(hit.fraction * ray.direction.length() <= rounding, "{hit:?} starts inside: {}", told());
            return true;
        }
        let n = hit.normal;
        assert!(
            (n.length() - 1.0).abs() < 1e-4 && n.dot(ray.direction) <= 1e-3 * ray.direction.length(),
            "{hit:?} {}",
            told()
        );
        // A plane through the point that all of the shape is behind.
        let over = support.full_support(n.as_dvec3()).dot(n.as_dvec3()) - n.as_dvec3().dot(point.as_dvec3());
        assert!(
            over.abs() <= f64::from(10.0 * rounding + 1e-5 * size),
            "{hit:?}: the surface is {over} beyond: {}",
            told()
        );
        true
    }

    /// Hits lie on the surface, with the normal of a plane that parts it from the ray's origin; what is missed is not there.
    #[test]
    fn rays_end_on_the_surface() {
        let mut random = Random(0x0123_4567_89AB_CDEF);
        for size in [1.0, 1e-3, 1e3] {
            for shape in shapes(size) {
                let mut hits = 0;
                for round in 0..400 {
                    let target = random.vector() * (0.9 * size);
                    let far = [1.5, 3.0, 30.0, 0.2][round % 4] * size;
                    let direction = match round % 5 {
                        0 => [Vec3::Y, -Vec3::Y, Vec3::X, -Vec3::Z][round / 5 % 4],
                        _ => random.direction(),
                    };
                    let target = if round % 10 == 0 { Vec3::ZERO } else { target };
                    let ray =
                        Ray { origin: target - direction * far, direction: direction * (2.0 * far), max_fraction: 1.0 };
                    hits += usize::from(check(&shape, &ray));
                }
                let flat = matches!(shape, Shape::Triangle(_));
                assert!(flat || (40..=360).contains(&hits), "{shape:?}: {hits}");
            }
        }
    }

    /// Rays that graze a surface by a ten thousandth hit within and miss without.
    #[test]
    fn grazing_rays_hit_and_miss() {
        let mut random = Random(0xFEDC_BA98_7654_3210);
        for shape in shapes(1.0) {
            let support = Support::new(&shape).unwrap();
            for _ in 0..300 {
                let n = random.direction();
                let top = support.full_support(n.as_dvec3()).as_vec3();
                let (t1, t2) = tangents(n);
                let along = (t1 * random.between(-1.0, 1.0) + t2 * random.between(-1.0, 1.0)).normalize();
                let above = top + n * 1e-4;
                let ray = Ray { origin: above - along * 3.0, direction: along * 6.0, max_fraction: 1.0 };
                assert!(shape.geometry().cast_ray(&ray).is_none(), "{shape:?} {ray:?}");
                check(&shape, &Ray { origin: ray.origin - n * 3e-4, ..ray });
            }
        }
    }
}
