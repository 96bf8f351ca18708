//! Tapered capsules: the convex hull of two balls.

use super::convex::{FLAT_SINE, Feature};
use super::convex_ray::cast_support;
use super::geometry::Geometry;
use super::mass::{RevolvedPiece, mass_of_revolution};
use super::ray::{Ray, ShapeHit};
use super::support::Support;
use super::{MassProperties, ShapeError, positive};
use crate::math::{Aabb, Pose, Real, Vec3, max};
use glam::DVec3;

/// The convex hull of a ball of `top_radius` at `half_length` on y and one of `bottom_radius` at `-half_length`.
///
/// ```
/// use arbiter3d::TaperedCapsule;
/// let arm = TaperedCapsule::new(0.3, 0.05, 0.08)?;
/// assert!(TaperedCapsule::new(0.1, 0.05, 0.3).is_err(), "the large ball would hold the small one");
/// # Ok::<(), arbiter3d::ShapeError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TaperedCapsule {
    half_length: Real,
    top_radius: Real,
    bottom_radius: Real,
}

impl TaperedCapsule {
    /// Two balls at `±half_length` on y with what is between them; metres.
    ///
    /// # Errors
    /// If a length is not finite and above zero, or one ball holds the other.
    pub fn new(half_length: Real, top_radius: Real, bottom_radius: Real) -> Result<Self, ShapeError> {
        let half_length = positive("tapered capsule half length", half_length)?;
        let top_radius = positive("tapered capsule top radius", top_radius)?;
        let bottom_radius = positive("tapered capsule bottom radius", bottom_radius)?;
        if (top_radius - bottom_radius).abs() >= 2.0 * half_length {
            return Err(ShapeError::BallInBall { distance: 2.0 * half_length, top_radius, bottom_radius });
        }
        Ok(Self { half_length, top_radius, bottom_radius })
    }

    /// Half the distance of the balls' centres, metres.
    #[must_use]
    pub fn half_length(&self) -> Real {
        self.half_length
    }

    /// Radius of the ball at `half_length`, metres.
    #[must_use]
    pub fn top_radius(&self) -> Real {
        self.top_radius
    }

    /// Radius of the ball at `-half_length`, metres.
    #[must_use]
    pub fn bottom_radius(&self) -> Real {
        self.bottom_radius
    }

    /// The smaller radius is added by the general kernels; what the larger ball has more is part of the core.
    pub(crate) fn core_radius(&self) -> Real {
        crate::math::min(self.top_radius, self.bottom_radius)
    }

    #[inline]
    pub(crate) fn core_support(&self, d: DVec3) -> DVec3 {
        let (h, slim) = (f64::from(self.half_length), f64::from(self.core_radius()));
        let (top, bottom) = (f64::from(self.top_radius) - slim, f64::from(self.bottom_radius) - slim);
        let length = d.length();
        let unit = if length > 0.0 { d / length } else { DVec3::Y };
        if h * d.y + top * length >= bottom * length - h * d.y {
            unit * top + DVec3::new(0.0, h, 0.0)
        } else {
            unit * bottom - DVec3::new(0.0, h, 0.0)
        }
    }

    /// The line on its side, or a point of a ball along a unit direction.
    pub(crate) fn feature(&self, d: Vec3, out: &mut Feature) {
        let slope = (self.bottom_radius - self.top_radius) / (2.0 * self.half_length);
        let (top, bottom) = (Vec3::Y * self.half_length, Vec3::Y * -self.half_length);
        let (a, b) = (top + d * self.top_radius, bottom + d * self.bottom_radius);
        // On the side `d_y` is the slope, and both balls are as far along `d`.
        let (first, second) = if d.y >= slope { (a, b) } else { (b, a) };
        out.push(first);
        if (d.y - slope).abs() < FLAT_SINE {
            out.push(second);
        }
    }
}

impl Geometry for TaperedCapsule {
    fn local_aabb(&self) -> Aabb {
        self.aabb(&Pose::IDENTITY)
    }

    fn aabb(&self, pose: &Pose) -> Aabb {
        let axis = pose.rotation.rotate(Vec3::Y) * self.half_length;
        let ball = |center: Vec3, radius: Real| Aabb::from_center(center, Vec3::splat(radius));
        ball(pose.position + axis, self.top_radius).union(&ball(pose.position - axis, self.bottom_radius))
    }

    /// Two pieces of balls and the frustum between the circles where it touches them; `ρ²` of each is a square polynomial.
    fn mass_properties(&self, density: Real) -> Result<MassProperties, ShapeError> {
        let [h, a, b] = [self.half_length, self.top_radius, self.bottom_radius].map(f64::from);
        let slope = (b - a) / (2.0 * h);
        let cosine = (1.0 - slope * slope).sqrt();
        let (low, high) = (slope * b - h, slope * a + h);
        let ball = |center: f64, radius: f64| move |y: f64| radius * radius - (y - center) * (y - center);
        let frustum = |y: f64| {
            let radius = cosine * (b + (a - b) * (y - low) / (high - low));
            radius * radius
        };
        let pieces: [RevolvedPiece<'_>; 3] =
            [(-h - b, low, &ball(-h, b)), (low, high, &frustum), (high, h + a, &ball(h, a))];
        Ok(mass_of_revolution(&pieces).scaled(density))
    }

    fn inner_ball(&self) -> (Vec3, Real) {
        let at = if self.top_radius > self.bottom_radius { self.half_length } else { -self.half_length };
        (Vec3::Y * at, max(self.top_radius, self.bottom_radius))
    }

    fn rounding_radius(&self) -> Real {
        self.core_radius()
    }

    fn cast_ray(&self, ray: &Ray) -> Option<ShapeHit> {
        cast_support(&Support::TaperedCapsule(*self), ray)
    }
}
