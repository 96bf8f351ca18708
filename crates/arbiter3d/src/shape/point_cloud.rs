//! Point clouds: the convex hull of points, wrapped around them by the support map alone.
//!
//! No faces are built, so the points may be flat, few or many. A hull ([`ConvexHull`](super::ConvexHull)) is faster in
//! contacts where the points have volume and their hull at most 255 corners.

use super::convex::{Feature, sampled_feature, sphere_grid};
use super::geometry::Geometry;
use super::{ConvexHull, MassProperties, ShapeError};
use crate::math::{Aabb, Pose, Real, Vec3, max};
use crate::narrow_phase::Support;
use crate::query::{Ray, ShapeHit, cast_support};
use glam::DVec3;

/// The shrink-wrap of points: everything between them.
///
/// ```
/// use arbiter3d::{PointCloud, math::Vec3};
/// // A flat sheet is a good cloud, but no hull.
/// let sheet = [Vec3::ZERO, Vec3::X, Vec3::Z, Vec3::X + Vec3::Z];
/// assert_eq!(PointCloud::new(&sheet)?.points().len(), 4);
/// # Ok::<(), arbiter3d::ShapeError>(())
/// ```
#[derive(Clone, Debug)]
pub struct PointCloud {
    points: Vec<Vec3>,
    aabb: Aabb,
    unit_mass: Option<MassProperties>,
    inner: (Vec3, Real),
}

impl PointCloud {
    /// All of the points, metres; the cost of a contact grows with their number.
    ///
    /// # Errors
    /// If there is no point, or one is not finite.
    pub fn new(points: &[Vec3]) -> Result<Self, ShapeError> {
        if points.is_empty() {
            return Err(ShapeError::NoPoints);
        }
        if let Some(index) = points.iter().position(|p| !p.is_finite()) {
            return Err(ShapeError::NotFinite { index, point: points[index] });
        }
        let aabb = Aabb::from_points(points.iter().copied());
        let hull = ConvexHull::with_max_vertices(points, 255).ok();
        let inner = hull.as_ref().map_or((aabb.center(), 0.0), |hull| (hull.centroid(), hull.inner_radius()));
        let unit_mass = hull.map(|hull| hull.mass_properties(1.0));
        Ok(Self { points: points.to_vec(), aabb, unit_mass, inner })
    }

    /// Only those points that are outermost in one of about `4 steps²` directions: for dense clouds, as of a scan.
    ///
    /// # Errors
    /// As [`PointCloud::new`].
    pub fn wrapped(points: &[Vec3], steps: usize) -> Result<Self, ShapeError> {
        let all = Self::new(points)?;
        let mut kept: Vec<usize> =
            sphere_grid(steps.clamp(1, 64)).0.iter().map(|&d| outermost(&all.points, d).0).collect();
        kept.sort_unstable();
        kept.dedup();
        let points: Vec<Vec3> = kept.into_iter().map(|index| all.points[index]).collect();
        Self::new(&points)
    }

    /// The points, metres.
    #[must_use]
    pub fn points(&self) -> &[Vec3] {
        &self.points
    }

    pub(crate) fn feature(&self, d: Vec3, out: &mut Feature) {
        let size = 0.5 * self.aabb.half_extents().length();
        sampled_feature(&|d| outermost(&self.points, d.as_dvec3()).1.as_vec3(), d, size, out);
    }
}

/// The first of the points that are furthest along a direction.
fn outermost(points: &[Vec3], direction: DVec3) -> (usize, DVec3) {
    let mut best = (0, DVec3::ZERO, f64::MIN);
    for (index, point) in points.iter().enumerate() {
        let point = point.as_dvec3();
        let along = point.dot(direction);
        if along > best.2 {
            best = (index, point, along);
        }
    }
    (best.0, best.1)
}

impl Geometry for PointCloud {
    fn local_aabb(&self) -> Aabb {
        self.aabb
    }

    fn aabb(&self, pose: &Pose) -> Aabb {
        Aabb::from_points(self.points.iter().map(|&point| pose.transform_point(point)))
    }

    fn mass_properties(&self, density: Real) -> Result<MassProperties, ShapeError> {
        let unit = self.unit_mass.ok_or(ShapeError::NoVolume {
            shape: "a flat point cloud",
            advice: "give its body a mass and the shape a density of zero",
        })?;
        Ok(unit.scaled(density))
    }

    fn inner_ball(&self) -> (Vec3, Real) {
        self.inner
    }

    fn reach_from(&self, point: Vec3) -> Real {
        self.points.iter().fold(0.0, |far, p| max((*p - point).length(), far))
    }

    fn cast_ray(&self, ray: &Ray) -> Option<ShapeHit> {
        cast_support(&Support::Cloud(self), ray)
    }
}
