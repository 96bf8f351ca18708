//! Spheres.

use super::geometry::Geometry;
use super::ray::{Ray, ShapeHit, cast_sphere};
use super::{MassProperties, ShapeError, positive};
use crate::math::{Aabb, Pose, Real, SymmetricMat3, Vec3};

/// A ball about the origin of its frame.
///
/// ```
/// let ball = arbiter3d::Sphere::new(0.5)?;
/// assert_eq!(ball.radius(), 0.5);
/// # Ok::<(), arbiter3d::ShapeError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    radius: Real,
}

impl Sphere {
    /// What stands where a shape has gone.
    pub(crate) const UNIT: Self = Self { radius: 1.0 };

    /// A sphere; radius in metres.
    ///
    /// # Errors
    /// If the radius is not a finite length above zero.
    pub fn new(radius: Real) -> Result<Self, ShapeError> {
        Ok(Self { radius: positive("sphere radius", radius)? })
    }

    /// Radius, metres.
    #[inline(always)]
    #[must_use]
    pub fn radius(&self) -> Real {
        self.radius
    }

    pub(crate) fn local_aabb(&self) -> Aabb {
        Aabb::from_center(Vec3::ZERO, Vec3::splat(self.radius))
    }

    /// `m = 4/3 π r³ ρ`, `I = 2/5 m r²`.
    pub(crate) fn mass_properties(&self, density: Real) -> MassProperties {
        let r = self.radius;
        let mass = density * (4.0 / 3.0) * std::f32::consts::PI as Real * r * r * r;
        MassProperties { mass, center: Vec3::ZERO, inertia: SymmetricMat3::diagonal(Vec3::splat(0.4 * mass * r * r)) }
    }
}

impl Geometry for Sphere {
    fn local_aabb(&self) -> Aabb {
        self.local_aabb()
    }

    fn aabb(&self, pose: &Pose) -> Aabb {
        Aabb::from_center(pose.position, Vec3::splat(self.radius))
    }

    fn mass_properties(&self, density: Real) -> Result<MassProperties, ShapeError> {
        Ok(self.mass_properties(density))
    }

    fn inner_ball(&self) -> (Vec3, Real) {
        (Vec3::ZERO, self.radius)
    }

    fn reach_from(&self, point: Vec3) -> Real {
        point.length() + self.radius
    }

    fn rounding_radius(&self) -> Real {
        self.radius
    }

    fn cast_ray(&self, ray: &Ray) -> Option<ShapeHit> {
        cast_sphere(self.radius, ray)
    }
}
