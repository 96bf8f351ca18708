//! Boxes.

use super::geometry::Geometry;
use super::ray::{Ray, ShapeHit, cast_cuboid};
use super::{MassProperties, ShapeError, positive};
use crate::math::{Aabb, Pose, Real, SymmetricMat3, Vec3, abs3, rotated_half_extents};

/// A box about the origin of its frame.
///
/// ```
/// use arbiter3d::{Cuboid, math::Vec3};
/// assert!(Cuboid::new(Vec3::new(1.0, 0.0, 1.0)).is_err());
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cuboid {
    half_extents: Vec3,
}

impl Cuboid {
    /// A box; half extents in metres.
    ///
    /// # Errors
    /// If a half extent is not a finite length above zero.
    pub fn new(half_extents: Vec3) -> Result<Self, ShapeError> {
        positive("cuboid half extent x", half_extents.x)?;
        positive("cuboid half extent y", half_extents.y)?;
        positive("cuboid half extent z", half_extents.z)?;
        Ok(Self { half_extents })
    }

    /// Half the size along each axis, metres.
    #[inline(always)]
    #[must_use]
    pub fn half_extents(&self) -> Vec3 {
        self.half_extents
    }

    pub(crate) fn local_aabb(&self) -> Aabb {
        Aabb::from_center(Vec3::ZERO, self.half_extents)
    }

    #[inline(always)]
    pub(crate) fn aabb(&self, pose: &Pose) -> Aabb {
        Aabb::from_center(pose.position, rotated_half_extents(&pose.rotation.to_mat3(), self.half_extents))
    }

    /// `m = 8 abc ρ`, `I = m/3 (b² + c², …)` with half extents `a, b, c`.
    pub(crate) fn mass_properties(&self, density: Real) -> MassProperties {
        let h = self.half_extents;
        let mass = density * 8.0 * h.x * h.y * h.z;
        let s = h * h * (mass / 3.0);
        MassProperties {
            mass,
            center: Vec3::ZERO,
            inertia: SymmetricMat3::diagonal(Vec3::new(s.y + s.z, s.x + s.z, s.x + s.y)),
        }
    }
}

impl Geometry for Cuboid {
    fn local_aabb(&self) -> Aabb {
        self.local_aabb()
    }

    fn aabb(&self, pose: &Pose) -> Aabb {
        self.aabb(pose)
    }

    fn mass_properties(&self, density: Real) -> Result<MassProperties, ShapeError> {
        Ok(self.mass_properties(density))
    }

    fn inner_ball(&self) -> (Vec3, Real) {
        (Vec3::ZERO, self.half_extents.min_element())
    }

    fn reach_from(&self, point: Vec3) -> Real {
        (abs3(point) + self.half_extents).length()
    }

    fn cast_ray(&self, ray: &Ray) -> Option<ShapeHit> {
        cast_cuboid(self, ray)
    }
}
