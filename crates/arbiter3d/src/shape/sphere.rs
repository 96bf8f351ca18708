//! Spheres.

use super::{MassProperties, ShapeError, positive};
use crate::math::{Aabb, Real, SymmetricMat3, Vec3};

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
