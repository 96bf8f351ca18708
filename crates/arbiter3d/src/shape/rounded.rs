//! Convex shapes grown by a radius: rounded boxes, hulls, cylinders.

use super::convex::{Feature, mass_of_support};
use super::geometry::Geometry;
use super::{MassProperties, Shape, ShapeError, positive};
use crate::math::{Aabb, Pose, Real, Vec3};
use crate::narrow_phase::Support;
use crate::query::{Ray, ShapeHit, cast_support};

/// A convex shape grown by a radius on all sides.
///
/// ```
/// use arbiter3d::{Shape, math::Vec3};
/// // A die of 2 cm with edges rounded by 2 mm.
/// let die = Shape::rounded(&Shape::cuboid(Vec3::splat(0.008))?, 0.002)?;
/// assert!((die.local_aabb().max.x - 0.01).abs() < 1e-7);
/// # Ok::<(), arbiter3d::ShapeError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Rounded {
    core: Shape,
    radius: Real,
    unit_mass: MassProperties,
}

impl Rounded {
    /// `core` grown by `radius`, metres.
    ///
    /// # Errors
    /// If the radius is not a finite length above zero, or the core is not convex.
    pub fn new(core: &Shape, radius: Real) -> Result<Self, ShapeError> {
        let radius = positive("rounding radius", radius)?;
        if Support::new(core).is_none() {
            return Err(ShapeError::NotConvex { what: "the core of a rounded shape" });
        }
        let mut rounded = Self { core: core.clone(), radius, unit_mass: MassProperties::default() };
        rounded.unit_mass = mass_of_support(&Support::Rounded(&rounded))?;
        Ok(rounded)
    }

    /// The shape inside.
    #[must_use]
    pub fn core(&self) -> &Shape {
        &self.core
    }

    /// By how much it is grown, metres.
    #[must_use]
    pub fn radius(&self) -> Real {
        self.radius
    }

    /// The core's feature, moved out.
    pub(crate) fn feature(&self, d: Vec3, out: &mut Feature) {
        if let Some(core) = Support::new(&self.core) {
            core.feature(d, out);
        }
        out.points_mut().iter_mut().for_each(|point| *point += d * self.radius);
    }

    /// The core's most level edge, moved out.
    pub(crate) fn edge(&self, d: Vec3, out: &mut Feature) {
        if let Some(core) = Support::new(&self.core) {
            core.edge(d, out);
        }
        out.points_mut().iter_mut().for_each(|point| *point += d * self.radius);
    }
}

impl Geometry for Rounded {
    fn local_aabb(&self) -> Aabb {
        self.core.local_aabb().expand(self.radius)
    }

    fn aabb(&self, pose: &Pose) -> Aabb {
        self.core.aabb(pose).expand(self.radius)
    }

    fn mass_properties(&self, density: Real) -> Result<MassProperties, ShapeError> {
        Ok(self.unit_mass.scaled(density))
    }

    fn inner_ball(&self) -> (Vec3, Real) {
        let (center, radius) = self.core.inner_ball();
        (center, radius + self.radius)
    }

    fn reach_from(&self, point: Vec3) -> Real {
        self.core.reach_from(point) + self.radius
    }

    fn rounding_radius(&self) -> Real {
        self.core.rounding_radius() + self.radius
    }

    fn cast_ray(&self, ray: &Ray) -> Option<ShapeHit> {
        cast_support(&Support::Rounded(self), ray)
    }
}
