//! Affine images of convex shapes: ellipsoids, sheared boxes, squashed cylinders.
//!
//! The image of a shape `S` under `x → A x + t` has its farthest point along `d` at `A s(Aᵀ d) + t`, with `s` the support
//! map of `S`. Rays are taken back by the inverse, which keeps fractions; moments are mapped exactly.

use super::convex::Feature;
use super::cores::Ellipsoid;
use super::geometry::Geometry;
use super::inside::Inside;
use super::mass::Moments;
use super::ray::{Ray, ShapeHit, cast_ray};
use super::support::Support;
use super::{MassProperties, Shape, ShapeError};
use crate::math::{Aabb, Mat3, Pose, Real, Vec3, max, max3, min3};
use glam::{DMat3, DVec3};
use std::sync::OnceLock;

/// A convex shape after an affine map.
///
/// ```
/// use arbiter3d::{Shape, math::Vec3};
/// let egg = Shape::ellipsoid(Vec3::new(0.02, 0.03, 0.02))?;
/// let mass = egg.mass_properties(1000.0)?.mass;
/// assert!((mass - 4.0 / 3.0 * std::f32::consts::PI * 0.02 * 0.03 * 0.02 * 1000.0).abs() < 1e-6);
/// # Ok::<(), arbiter3d::ShapeError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Transformed {
    shape: Shape,
    linear: Mat3,
    translation: Vec3,
    inverse: Mat3,
    unit_mass: MassProperties,
    inner_radius: Real,
    /// Where the shape is a sphere.
    ellipsoid: Option<Ellipsoid>,
    /// Once it is asked for.
    inside: OnceLock<Option<Inside>>,
}

impl Transformed {
    /// The image of `shape` under `x → linear · x + translation`.
    ///
    /// # Errors
    /// If the shape is not convex, a number is not finite, or the map is (almost) flat.
    pub fn new(shape: &Shape, linear: Mat3, translation: Vec3) -> Result<Self, ShapeError> {
        if let Shape::Transformed(inner) = shape {
            return Self::new(&inner.shape, linear * inner.linear, linear * inner.translation + translation);
        }
        if Support::new(shape).is_none() {
            return Err(ShapeError::NotConvex { what: "a transformed shape" });
        }
        let inverse = inverse_of(linear, translation)?;
        let unit = shape.mass_properties(1.0)?;
        let mapped = Moments::of(&unit).map(&double(linear), translation.as_dvec3());
        let flat = ShapeError::FlatTransform { determinant: linear.determinant() };
        let unit_mass = mapped.unit_mass().ok_or(flat)?;
        let inner_radius = shape.inner_ball().1 / norm_bound(inverse);
        let ellipsoid = if let Shape::Sphere(ball) = shape {
            // A ball rolls inside whose radius is the square of the shortest half axis over the longest one.
            let longest = f64::from(norm_bound(linear) * ball.radius());
            let rolling = f64::from(inner_radius) * f64::from(inner_radius) / longest;
            let linear = double(linear) * f64::from(ball.radius());
            Some(Ellipsoid { linear, center: translation.as_dvec3(), rolling })
        } else {
            None
        };
        Ok(Self {
            shape: shape.clone(),
            linear,
            translation,
            inverse,
            unit_mass,
            inner_radius,
            ellipsoid,
            inside: OnceLock::new(),
        })
    }

    /// The shape before the map.
    #[must_use]
    pub fn shape(&self) -> &Shape {
        &self.shape
    }

    /// The linear part of the map.
    #[must_use]
    pub fn linear(&self) -> Mat3 {
        self.linear
    }

    /// The translation of the map, metres.
    #[must_use]
    pub fn translation(&self) -> Vec3 {
        self.translation
    }

    /// What the searches need of an ellipsoid, if it is one.
    pub(crate) fn ellipsoid(&self) -> Option<Ellipsoid> {
        self.ellipsoid
    }

    /// What continuous collision sweeps of it.
    pub(crate) fn inside(&self) -> Option<&Inside> {
        let map = |point: DVec3| double(self.linear) * point + self.translation.as_dvec3();
        self.inside.get_or_init(|| Inside::of_support(&Support::new(&self.shape)?, map)).as_ref()
    }

    pub(crate) fn support(&self, d: DVec3) -> DVec3 {
        let linear = double(self.linear);
        let local = linear.transpose() * d;
        let point = Support::new(&self.shape).map_or(DVec3::ZERO, |inner| inner.full_support(local));
        linear * point + self.translation.as_dvec3()
    }

    pub(crate) fn feature(&self, d: Vec3, out: &mut Feature) {
        if let Some(inner) = Support::new(&self.shape) {
            inner.feature(self.before(d), out);
        }
        self.map(out);
    }

    /// The image of the most level edge.
    pub(crate) fn edge(&self, d: Vec3, out: &mut Feature) {
        if let Some(inner) = Support::new(&self.shape) {
            inner.edge(self.before(d), out);
        }
        self.map(out);
    }

    /// The unit direction before the map whose level planes become those of `d`.
    fn before(&self, d: Vec3) -> Vec3 {
        let local = self.linear.transpose() * d;
        local * (1.0 / local.length())
    }

    fn map(&self, feature: &mut Feature) {
        let mirrored = self.linear.determinant() < 0.0;
        let points = feature.points_mut();
        points.iter_mut().for_each(|point| *point = self.linear * *point + self.translation);
        if mirrored {
            points.reverse();
        }
    }
}

/// The inverse of a map that is finite and not flat.
pub(super) fn inverse_of(linear: Mat3, translation: Vec3) -> Result<Mat3, ShapeError> {
    let size = [linear.x_axis, linear.y_axis, linear.z_axis].map(Vec3::length);
    let determinant = linear.determinant();
    let volume = size[0] * size[1] * size[2];
    if !(translation.is_finite() && determinant.is_finite() && determinant.abs() > 1e-6 * volume) {
        return Err(ShapeError::FlatTransform { determinant });
    }
    Ok(double(linear).inverse().as_mat3())
}

/// A bound of how much a matrix stretches, exact for diagonal ones: `‖M‖² ≤ ‖M‖₁ ‖M‖∞`.
fn norm_bound(m: Mat3) -> Real {
    let most = |m: Mat3| {
        let sum = |c: Vec3| c.x.abs() + c.y.abs() + c.z.abs();
        max(max(sum(m.x_axis), sum(m.y_axis)), sum(m.z_axis))
    };
    (most(m) * most(m.transpose())).sqrt()
}

fn double(m: Mat3) -> DMat3 {
    DMat3::from_cols(m.x_axis.as_dvec3(), m.y_axis.as_dvec3(), m.z_axis.as_dvec3())
}

impl Geometry for Transformed {
    fn local_aabb(&self) -> Aabb {
        self.aabb(&Pose::IDENTITY)
    }

    fn aabb(&self, pose: &Pose) -> Aabb {
        let rotation = pose.rotation.to_mat3().transpose();
        let (mut low, mut high) = (Vec3::ZERO, Vec3::ZERO);
        for (axis, direction) in [rotation.x_axis, rotation.y_axis, rotation.z_axis].into_iter().enumerate() {
            let reach = |d: Vec3| self.support(d.as_dvec3()).dot(d.as_dvec3()) as Real;
            (low[axis], high[axis]) = (-reach(-direction), reach(direction));
        }
        let slack = Vec3::splat(1e-6) * (high - low);
        Aabb::new(min3(low, high) - slack + pose.position, max3(low, high) + slack + pose.position)
    }

    fn mass_properties(&self, density: Real) -> Result<MassProperties, ShapeError> {
        Ok(self.unit_mass.scaled(density))
    }

    fn inner_ball(&self) -> (Vec3, Real) {
        (self.linear * self.shape.inner_ball().0 + self.translation, self.inner_radius)
    }

    /// What rolled before, shrunk as the inner ball.
    fn rounding_radius(&self) -> Real {
        let inner = self.shape.inner_ball().1;
        if inner > 0.0 { self.shape.rounding_radius() * (self.inner_radius / inner) } else { 0.0 }
    }

    fn cast_ray(&self, ray: &Ray) -> Option<ShapeHit> {
        let origin = self.inverse * (ray.origin - self.translation);
        let hit = cast_ray(&self.shape, &Ray { origin, direction: self.inverse * ray.direction, ..*ray })?;
        let normal = self.inverse.transpose() * hit.normal;
        let length = normal.length();
        Some(ShapeHit { fraction: hit.fraction, normal: if length > 0.0 { normal / length } else { Vec3::ZERO } })
    }
}
