//! Capsules: a segment with a radius.

use super::geometry::Geometry;
use super::ray::{Ray, ShapeHit, cast_capsule};
use super::{MassProperties, ShapeError, positive};
use crate::math::{Aabb, Pose, Real, Rotation, SymmetricMat3, Vec3, abs3};

/// A segment on the y axis from `-half_length` to `half_length`, grown by `radius`.
///
/// ```
/// use arbiter3d::{Capsule, math::Vec3};
/// let (capsule, pose) = Capsule::between(Vec3::ZERO, Vec3::new(0.0, 0.0, 2.0), 0.3)?;
/// assert_eq!(capsule.half_length(), 1.0);
/// assert!((pose.transform_point(Vec3::Y) - Vec3::new(0.0, 0.0, 2.0)).length() < 1e-6);
/// # Ok::<(), arbiter3d::ShapeError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Capsule {
    half_length: Real,
    radius: Real,
}

impl Capsule {
    /// A capsule along y; both lengths in metres.
    ///
    /// # Errors
    /// If a length is not finite and above zero.
    pub fn new(half_length: Real, radius: Real) -> Result<Self, ShapeError> {
        Ok(Self {
            half_length: positive("capsule half length", half_length)?,
            radius: positive("capsule radius", radius)?,
        })
    }

    /// The capsule around the segment from `a` to `b`, and the pose that puts it there.
    ///
    /// # Errors
    /// If the points coincide or the radius is not a finite length above zero.
    pub fn between(a: Vec3, b: Vec3, radius: Real) -> Result<(Self, Pose), ShapeError> {
        let axis = b - a;
        let capsule = Self::new(0.5 * axis.length(), radius)?;
        let d = axis / axis.length();
        // Half-way quaternion from y to d; a half turn about x where d points down.
        let rotation = if d.y < -0.999_999 {
            Rotation::from_xyzw(1.0, 0.0, 0.0, 0.0)
        } else {
            Rotation::from_xyzw(d.z, 0.0, -d.x, 1.0 + d.y).normalize()
        };
        Ok((capsule, Pose::new((a + b) * 0.5, rotation)))
    }

    /// Half the length of the segment, metres.
    #[inline(always)]
    #[must_use]
    pub fn half_length(&self) -> Real {
        self.half_length
    }

    /// Radius, metres.
    #[inline(always)]
    #[must_use]
    pub fn radius(&self) -> Real {
        self.radius
    }

    pub(crate) fn local_aabb(&self) -> Aabb {
        let r = self.radius;
        Aabb::from_center(Vec3::ZERO, Vec3::new(r, self.half_length + r, r))
    }

    pub(crate) fn aabb(&self, pose: &Pose) -> Aabb {
        let axis = pose.rotation.rotate(Vec3::new(0.0, self.half_length, 0.0));
        Aabb::from_center(pose.position, abs3(axis) + Vec3::splat(self.radius))
    }

    /// A cylinder and two half spheres, the halves moved out by Steiner's rule from their own centres at `3/8 r`.
    pub(crate) fn mass_properties(&self, density: Real) -> MassProperties {
        let (r, h) = (self.radius, 2.0 * self.half_length);
        let pi = std::f32::consts::PI as Real;
        let cylinder = density * pi * r * r * h;
        let sphere = density * (4.0 / 3.0) * pi * r * r * r;
        let along = 0.5 * cylinder * r * r + 0.4 * sphere * r * r;
        let across = cylinder * (r * r / 4.0 + h * h / 12.0) + sphere * (0.4 * r * r + 0.25 * h * h + 0.375 * h * r);
        MassProperties {
            mass: cylinder + sphere,
            center: Vec3::ZERO,
            inertia: SymmetricMat3::diagonal(Vec3::new(across, along, across)),
        }
    }
}

impl Geometry for Capsule {
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
        (Vec3::ZERO, self.radius)
    }

    fn reach_from(&self, point: Vec3) -> Real {
        Vec3::new(point.x, point.y.abs() + self.half_length, point.z).length() + self.radius
    }

    fn rounding_radius(&self) -> Real {
        self.radius
    }

    fn cast_ray(&self, ray: &Ray) -> Option<ShapeHit> {
        cast_capsule(self, ray)
    }
}
