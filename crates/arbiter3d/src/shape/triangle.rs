//! Single triangles.

use super::convex::Feature;
use super::convex_ray::cast_support;
use super::geometry::Geometry;
use super::ray::{Ray, ShapeHit};
use super::support::Support;
use super::{MassProperties, ShapeError};
use crate::math::{Aabb, Pose, Real, Vec3, max};

/// One triangle, solid from both sides: a sail, a ramp, a test.
///
/// It has no volume: on a dynamic body it needs a density of zero, and the body a mass of its own.
///
/// ```
/// use arbiter3d::{Triangle, math::Vec3};
/// let sail = Triangle::new([Vec3::ZERO, Vec3::Y * 5.0, Vec3::X * 2.0])?;
/// assert_eq!(sail.normal(), -Vec3::Z);
/// # Ok::<(), arbiter3d::ShapeError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Triangle {
    corners: [Vec3; 3],
    normal: Vec3,
}

impl Triangle {
    /// The triangle of three corners, metres.
    ///
    /// # Errors
    /// If a corner is not finite, or the triangle has no area.
    pub fn new(corners: [Vec3; 3]) -> Result<Self, ShapeError> {
        if let Some(index) = corners.iter().position(|p| !p.is_finite()) {
            return Err(ShapeError::NotFinite { index, point: corners[index] });
        }
        let [a, b, c] = corners.map(Vec3::as_dvec3);
        let cross = (b - a).cross(c - a);
        let longest = (b - a).length_squared().max((c - a).length_squared()).max((c - b).length_squared());
        if cross.length() <= 1e-9 * longest {
            return Err(ShapeError::DegenerateTriangle { triangle: 0 });
        }
        Ok(Self { corners, normal: cross.normalize().as_vec3() })
    }

    /// Its corners, metres.
    #[must_use]
    pub fn corners(&self) -> [Vec3; 3] {
        self.corners
    }

    /// Unit normal on the side from which the corners wind counter-clockwise.
    #[must_use]
    pub fn normal(&self) -> Vec3 {
        self.normal
    }
}

/// The triangle itself, an edge or a corner along a unit direction.
pub(crate) fn triangle_feature([a, b, c]: [Vec3; 3], d: Vec3, out: &mut Feature) {
    let cross = (b - a).cross(c - a);
    let cosine = cross.dot(d);
    if cosine.abs() > 0.5 * cross.length() {
        let [second, third] = if cosine > 0.0 { [b, c] } else { [c, b] };
        [a, second, third].into_iter().for_each(|corner| out.push(corner));
        return;
    }
    triangle_edge([a, b, c], d, out);
}

/// The edge that lies most square to a unit direction, or the corner that is furthest along it.
pub(crate) fn triangle_edge([a, b, c]: [Vec3; 3], d: Vec3, out: &mut Feature) {
    // The edge that lies most square to the direction, of those at the furthest corner.
    let mut corners = [a, b, c];
    let along = corners.map(|p| p.dot(d));
    let top = if along[1] > along[0] { 1 } else { 0 };
    let top = if along[2] > along[top] { 2 } else { top };
    corners.rotate_left(top);
    let slope = |end: Vec3| (corners[0] - end).dot(d) / (corners[0] - end).length();
    let next = if slope(corners[1]) <= slope(corners[2]) { corners[1] } else { corners[2] };
    out.push(corners[0]);
    if slope(next) < super::convex::FLAT_SINE {
        out.push(next);
    }
}

impl Geometry for Triangle {
    fn local_aabb(&self) -> Aabb {
        Aabb::from_points(self.corners)
    }

    fn aabb(&self, pose: &Pose) -> Aabb {
        Aabb::from_points(self.corners.map(|corner| pose.transform_point(corner)))
    }

    fn mass_properties(&self, _: Real) -> Result<MassProperties, ShapeError> {
        Err(ShapeError::NoVolume {
            shape: "a triangle",
            advice: "give its body a mass and the shape a density of zero",
        })
    }

    fn inner_ball(&self) -> (Vec3, Real) {
        ((self.corners[0] + self.corners[1] + self.corners[2]) * (1.0 / 3.0), 0.0)
    }

    fn reach_from(&self, point: Vec3) -> Real {
        self.corners.iter().fold(0.0, |far, p| max((*p - point).length(), far))
    }

    fn cast_ray(&self, ray: &Ray) -> Option<ShapeHit> {
        cast_support(&Support::Triangle(self.corners), ray)
    }
}
