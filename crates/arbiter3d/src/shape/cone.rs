//! Cones along y.

use super::convex::Feature;
use super::convex_ray::cast_cone;
use super::cylinder::rim;
use super::geometry::Geometry;
use super::ray::{Ray, ShapeHit};
use super::{MassProperties, ShapeError, positive};
use crate::math::{Aabb, Pose, Real, SymmetricMat3, Vec3};
use glam::DVec3;

/// A cone along y: its tip at `half_length`, its base of `radius` at `-half_length`.
///
/// The origin is half way up; the centre of mass is a quarter of the height above the base.
///
/// ```
/// use arbiter3d::{Cone, Shape};
/// let cone = Cone::new(1.0, 0.5)?;
/// let mass = Shape::Cone(cone).mass_properties(1000.0)?;
/// assert!((mass.center.y + 0.5).abs() < 1e-6);
/// # Ok::<(), arbiter3d::ShapeError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cone {
    half_length: Real,
    radius: Real,
}

impl Cone {
    /// A cone of height `2 half_length` on a base of `radius`; metres.
    ///
    /// # Errors
    /// If a length is not finite and above zero.
    pub fn new(half_length: Real, radius: Real) -> Result<Self, ShapeError> {
        Ok(Self { half_length: positive("cone half length", half_length)?, radius: positive("cone radius", radius)? })
    }

    /// Half its height, metres.
    #[must_use]
    pub fn half_length(&self) -> Real {
        self.half_length
    }

    /// Radius of its base, metres.
    #[must_use]
    pub fn radius(&self) -> Real {
        self.radius
    }

    /// The tip beats the rim where `2 h d_y > r |d_xz|`.
    #[inline]
    pub(crate) fn support(&self, d: DVec3) -> DVec3 {
        let (h, r) = (f64::from(self.half_length), f64::from(self.radius));
        let across = (d.x * d.x + d.z * d.z).sqrt();
        if 2.0 * h * d.y > r * across {
            return DVec3::new(0.0, h, 0.0);
        }
        let scale = if across > 0.0 { r / across } else { 0.0 };
        DVec3::new(d.x * scale, -h, d.z * scale)
    }

    /// The base, a line from the rim to the tip, or a point along a unit direction.
    pub(crate) fn feature(&self, d: Vec3, out: &mut Feature) {
        let (h, r) = (self.half_length, self.radius);
        let across = (d.x * d.x + d.z * d.z).sqrt();
        if -d.y >= across {
            out.set_disc(-h, r, d);
            return;
        }
        let slant = (4.0 * h * h + r * r).sqrt();
        // Cosine of the angle to the side's normal.
        let along_side = (2.0 * h * across + r * d.y) / slant;
        if along_side > 0.8 {
            let rim = Vec3::new(d.x, 0.0, d.z) * (r / across);
            out.push(Vec3::Y * h);
            out.push(rim - Vec3::Y * h);
        } else {
            out.push(self.support(d.as_dvec3()).as_vec3());
        }
    }
}

impl Geometry for Cone {
    fn local_aabb(&self) -> Aabb {
        Aabb::from_center(Vec3::ZERO, Vec3::new(self.radius, self.half_length, self.radius))
    }

    fn aabb(&self, pose: &Pose) -> Aabb {
        let axis = pose.rotation.rotate(Vec3::Y);
        let tip = pose.position + axis * self.half_length;
        let base = Aabb::from_center(pose.position - axis * self.half_length, rim(axis) * self.radius);
        base.union(&Aabb::new(tip, tip))
    }

    fn mass_properties(&self, density: Real) -> Result<MassProperties, ShapeError> {
        let (r, h) = (self.radius, 2.0 * self.half_length);
        let mass = density * (std::f32::consts::PI as Real / 3.0) * r * r * h;
        let across = mass * (0.15 * r * r + 0.0375 * h * h);
        let inertia = SymmetricMat3::diagonal(Vec3::new(across, 0.3 * mass * r * r, across));
        Ok(MassProperties { mass, center: Vec3::new(0.0, -0.25 * h, 0.0), inertia })
    }

    /// The circle in its triangle of width `2r` and height `2h`.
    fn inner_ball(&self) -> (Vec3, Real) {
        let (r, h) = (self.radius, 2.0 * self.half_length);
        let inner = r * h / (r + (r * r + h * h).sqrt());
        (Vec3::new(0.0, inner - self.half_length, 0.0), inner)
    }

    /// Its side rolls.
    fn rounding_radius(&self) -> Real {
        self.radius
    }

    fn cast_ray(&self, ray: &Ray) -> Option<ShapeHit> {
        cast_cone(self, ray)
    }
}
