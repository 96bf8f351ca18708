//! Cylinders along y.

use super::convex::Feature;
use super::convex_ray::cast_cylinder;
use super::geometry::Geometry;
use super::ray::{Ray, ShapeHit};
use super::{MassProperties, ShapeError, positive};
use crate::math::{Aabb, Pose, Real, SymmetricMat3, Vec3, abs3, min};
use glam::DVec3;

/// A cylinder along y about the origin.
///
/// ```
/// use arbiter3d::Cylinder;
/// let can = Cylinder::new(0.6, 0.3)?;
/// assert_eq!((can.half_length(), can.radius()), (0.6, 0.3));
/// # Ok::<(), arbiter3d::ShapeError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cylinder {
    half_length: Real,
    radius: Real,
}

impl Cylinder {
    /// A cylinder from `-half_length` to `half_length` on y; metres.
    ///
    /// # Errors
    /// If a length is not finite and above zero.
    pub fn new(half_length: Real, radius: Real) -> Result<Self, ShapeError> {
        Ok(Self {
            half_length: positive("cylinder half length", half_length)?,
            radius: positive("cylinder radius", radius)?,
        })
    }

    /// Half its length, metres.
    #[must_use]
    pub fn half_length(&self) -> Real {
        self.half_length
    }

    /// Its radius, metres.
    #[must_use]
    pub fn radius(&self) -> Real {
        self.radius
    }

    #[inline]
    pub(crate) fn support(&self, d: DVec3) -> DVec3 {
        let across = (d.x * d.x + d.z * d.z).sqrt();
        let scale = if across > 0.0 { f64::from(self.radius) / across } else { 0.0 };
        let h = f64::from(self.half_length);
        DVec3::new(d.x * scale, if d.y < 0.0 { -h } else { h }, d.z * scale)
    }

    /// The face, line or point along a unit direction.
    pub(crate) fn feature(&self, d: Vec3, out: &mut Feature) {
        let across = (d.x * d.x + d.z * d.z).sqrt();
        let h = if d.y < 0.0 { -self.half_length } else { self.half_length };
        if d.y.abs() >= across {
            out.set_disc(h, self.radius, d);
        } else {
            let side = Vec3::new(d.x, 0.0, d.z) * (self.radius / across);
            out.push(side + Vec3::Y * h);
            out.push(side - Vec3::Y * h);
        }
    }
}

impl Geometry for Cylinder {
    fn local_aabb(&self) -> Aabb {
        Aabb::from_center(Vec3::ZERO, Vec3::new(self.radius, self.half_length, self.radius))
    }

    /// Along a world axis `e` the rim reaches `r √(1 − (e · axis)²)` beyond the ends of the axis.
    fn aabb(&self, pose: &Pose) -> Aabb {
        let axis = pose.rotation.rotate(Vec3::Y);
        Aabb::from_center(pose.position, abs3(axis) * self.half_length + rim(axis) * self.radius)
    }

    fn mass_properties(&self, density: Real) -> Result<MassProperties, ShapeError> {
        let (r, h) = (self.radius, 2.0 * self.half_length);
        let mass = density * std::f32::consts::PI as Real * r * r * h;
        let across = mass * (0.25 * r * r + h * h / 12.0);
        let inertia = SymmetricMat3::diagonal(Vec3::new(across, 0.5 * mass * r * r, across));
        Ok(MassProperties { mass, center: Vec3::ZERO, inertia })
    }

    fn inner_ball(&self) -> (Vec3, Real) {
        (Vec3::ZERO, min(self.radius, self.half_length))
    }

    fn reach_from(&self, point: Vec3) -> Real {
        let across = (point.x * point.x + point.z * point.z).sqrt() + self.radius;
        let along = point.y.abs() + self.half_length;
        (across * across + along * along).sqrt()
    }

    /// Its side rolls.
    fn rounding_radius(&self) -> Real {
        self.radius
    }

    fn cast_ray(&self, ray: &Ray) -> Option<ShapeHit> {
        cast_cylinder(self, ray)
    }
}

/// Half extents of a unit circle square to a unit `axis`.
pub(super) fn rim(axis: Vec3) -> Vec3 {
    let reach = |a: Real| crate::math::max(1.0 - a * a, 0.0).sqrt();
    Vec3::new(reach(axis.x), reach(axis.y), reach(axis.z))
}
