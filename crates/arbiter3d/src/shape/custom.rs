//! Convex shapes of the user's own, told by a support function and a centre.

use super::convex::{Feature, mass_of_support, sampled_feature, sphere_grid};
use super::convex_ray::cast_support;
use super::geometry::Geometry;
use super::inside::Inside;
use super::ray::{Ray, ShapeHit};
use super::support::Support;
use super::{MassProperties, ShapeError};
use crate::math::{Aabb, Pose, Real, Vec3, max, min};
use glam::DVec3;
use std::fmt::Debug;
use std::sync::OnceLock;

/// A convex shape of your own. The support function and a centre are enough: box, mass, rays and contacts follow from them.
/// What you know better, override.
///
/// A half ball, solid for `y ≥ 0`:
///
/// ```
/// use arbiter3d::{ConvexShape, Shape, math::Vec3};
///
/// #[derive(Debug)]
/// struct HalfBall;
///
/// impl ConvexShape for HalfBall {
///     fn support(&self, direction: Vec3) -> Vec3 {
///         let across = Vec3::new(direction.x, 0.0, direction.z);
///         if direction.y > 0.0 { direction.normalize_or_zero() } else { across.normalize_or_zero() }
///     }
///
///     fn center(&self) -> Vec3 {
///         Vec3::new(0.0, 0.375, 0.0)
///     }
/// }
///
/// let dome = Shape::custom(HalfBall)?;
/// let mass = dome.mass_properties(1.0)?;
/// assert!((mass.mass - 2.0 / 3.0 * std::f32::consts::PI).abs() < 1e-3);
/// assert!((mass.center.y - 0.375).abs() < 1e-3);
/// # Ok::<(), arbiter3d::ShapeError>(())
/// ```
pub trait ConvexShape: Debug + Send + Sync {
    /// A point of the shape that is furthest along `direction` (not zero, of any length), metres. Pure: the same direction
    /// always gives the same point.
    fn support(&self, direction: Vec3) -> Vec3;

    /// A point inside the shape, metres; best the centre of mass.
    fn center(&self) -> Vec3;

    /// The box around it. Default: from the support function.
    fn aabb(&self) -> Aabb {
        let (mut low, mut high) = (Vec3::ZERO, Vec3::ZERO);
        for (axis, direction) in [Vec3::X, Vec3::Y, Vec3::Z].into_iter().enumerate() {
            (low[axis], high[axis]) = (self.support(-direction)[axis], self.support(direction)[axis]);
        }
        Aabb::new(low, high)
    }

    /// Mass, centre and inertia at a density of 1 kg/m³; `None` for those reckoned from the support function, which are good
    /// to about 0.1 %. Default `None`.
    fn unit_mass(&self) -> Option<MassProperties> {
        None
    }

    /// The radius with which it rolls, metres, for rolling resistance. Default zero.
    fn rounding_radius(&self) -> Real {
        0.0
    }

    /// The first point along a ray in the shape's frame. The outer `None` has it reckoned from the support function.
    /// Default `None`.
    fn cast_ray(&self, _ray: &Ray) -> Option<Option<ShapeHit>> {
        None
    }

    /// Corners of the face, edge or point furthest along a unit direction, a face counter-clockwise seen against it, at most
    /// 16; they carry the contact. Default: empty, which has them found from support points around the direction.
    fn feature(&self, _direction: Vec3) -> Vec<Vec3> {
        Vec::new()
    }
}

/// A shape of the user's own with what is known of it.
#[derive(Debug)]
pub struct Custom {
    shape: Box<dyn ConvexShape>,
    aabb: Aabb,
    unit_mass: Option<MassProperties>,
    center: Vec3,
    inner_radius: Real,
    reach: Real,
    /// Once it is asked for.
    inside: OnceLock<Option<Inside>>,
}

/// Steps of the grid of directions in which a shape is tried.
const TRIED_STEPS: usize = 8;
/// What the inner radius in the directions tried is taken for.
const INNER_SHARE: Real = 0.9;

impl Custom {
    /// Tries a shape in many directions.
    ///
    /// # Errors
    /// If a support point or the box is not finite, or a support point is behind the centre.
    pub(crate) fn new(shape: Box<dyn ConvexShape>) -> Result<Self, ShapeError> {
        let center = shape.center();
        let (mut inner, mut reach): (Real, Real) = (Real::MAX, 0.0);
        for direction in sphere_grid(TRIED_STEPS).0 {
            let direction = direction.as_vec3();
            let point = shape.support(direction);
            let height = (point - center).dot(direction);
            if !(point.is_finite() && height >= -1e-5 * point.length()) {
                return Err(ShapeError::BadSupport { direction, point, center });
            }
            inner = min(height, inner);
            reach = max((point - center).length(), reach);
        }
        let aabb = shape.aabb();
        if !(aabb.min.is_finite() && aabb.max.is_finite() && aabb.min.cmple(aabb.max).all()) {
            return Err(ShapeError::BadBox { min: aabb.min, max: aabb.max });
        }
        let inner_radius = INNER_SHARE * max(inner, 0.0);
        let mut custom = Self { shape, aabb, unit_mass: None, center, inner_radius, reach, inside: OnceLock::new() };
        custom.unit_mass = custom.shape.unit_mass().or_else(|| mass_of_support(&Support::Custom(&custom)).ok());
        Ok(custom)
    }

    /// The user's shape.
    #[must_use]
    pub fn shape(&self) -> &dyn ConvexShape {
        &*self.shape
    }

    /// What continuous collision sweeps of it.
    pub(crate) fn inside(&self) -> Option<&Inside> {
        self.inside.get_or_init(|| Inside::of_support(&Support::Custom(self), |point| point)).as_ref()
    }

    #[inline]
    pub(crate) fn support(&self, direction: DVec3) -> DVec3 {
        let length = direction.length();
        // A direction in single precision must not vanish.
        let unit = if length > 0.0 { (direction / length).as_vec3() } else { Vec3::Y };
        self.shape.support(unit).as_dvec3()
    }

    /// Its box placed by `pose`, from six support points.
    fn box_at(&self, pose: &Pose) -> Aabb {
        let axes = pose.rotation.to_mat3().transpose();
        let (mut low, mut high) = (Vec3::ZERO, Vec3::ZERO);
        for (axis, d) in [axes.x_axis, axes.y_axis, axes.z_axis].into_iter().enumerate() {
            (low[axis], high[axis]) = (self.shape.support(-d).dot(d), self.shape.support(d).dot(d));
        }
        let slack = (high - low) * 1e-6;
        Aabb::new(low - slack + pose.position, high + slack + pose.position)
    }

    pub(crate) fn feature(&self, d: Vec3, out: &mut Feature) {
        let own = self.shape.feature(d);
        if own.is_empty() {
            sampled_feature(&|d| self.shape.support(d), d, max(self.inner_radius, 0.1 * self.reach), out);
        } else {
            out.set_thinned(own.len(), |k| own[k]);
        }
    }
}

impl Geometry for Custom {
    fn local_aabb(&self) -> Aabb {
        self.aabb
    }

    fn aabb(&self, pose: &Pose) -> Aabb {
        self.box_at(pose)
    }

    fn mass_properties(&self, density: Real) -> Result<MassProperties, ShapeError> {
        let unit = self.unit_mass.ok_or(ShapeError::NoVolume {
            shape: "the custom shape",
            advice: "give its body a mass and the shape a density of zero",
        })?;
        Ok(unit.scaled(density))
    }

    fn inner_ball(&self) -> (Vec3, Real) {
        (self.center, self.inner_radius)
    }

    fn reach_from(&self, point: Vec3) -> Real {
        (point - self.center).length() + self.reach
    }

    fn rounding_radius(&self) -> Real {
        self.shape.rounding_radius()
    }

    fn cast_ray(&self, ray: &Ray) -> Option<ShapeHit> {
        self.shape.cast_ray(ray).unwrap_or_else(|| cast_support(&Support::Custom(self), ray))
    }
}
