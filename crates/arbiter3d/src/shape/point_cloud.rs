//! Point clouds: the convex hull of points, wrapped around them by the support map alone.
//!
//! No faces are built ahead, so the points may be flat, few or many: the one that a contact asks for is found by gift
//! wrapping (Chand and Kapur, "An Algorithm for Convex Polytopes", 1970) around the furthest point. A hull
//! ([`ConvexHull`](super::ConvexHull)) is faster in contacts where the points have volume and their hull at most 255
//! corners.

use super::convex::{FEATURE_POINTS, FLAT_SINE, Feature, sampled_feature, sphere_grid};
use super::convex_ray::cast_support;
use super::geometry::Geometry;
use super::inside::Inside;
use super::ray::{Ray, ShapeHit};
use super::support::Support;
use super::{ConvexHull, MassProperties, ShapeError};
use crate::math::{Aabb, Pose, Real, Vec3, max, tangents};
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
    /// What continuous collision sweeps of it; `None` of a flat one.
    inside: Option<Inside>,
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
        let inside = hull.as_ref().map(Inside::of_hull);
        let unit_mass = hull.map(|hull| hull.mass_properties(1.0));
        Ok(Self { points: points.to_vec(), aabb, unit_mass, inner, inside })
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

    /// What is well inside.
    pub(crate) fn inside(&self) -> Option<&Inside> {
        self.inside.as_ref()
    }

    /// The face around the point that is furthest along `d`; where all faces there look away, or where there are none,
    /// what samples tell.
    pub(crate) fn feature(&self, d: Vec3, out: &mut Feature) {
        let d = d.as_dvec3();
        let (_, top) = outermost(&self.points, d);
        let face = self.face_around(top, d).filter(|normal| normal.dot(d) > 0.5);
        match face {
            Some(normal) => self.outline(top, normal, out),
            None => {
                let size = 0.5 * self.aabb.half_extents().length();
                sampled_feature(&|d| outermost(&self.points, d.as_dvec3()).1.as_vec3(), d.as_vec3(), size, out);
            }
        }
    }

    /// The edge that a plane through the furthest point along `d` meets first when it is tilted about it.
    pub(crate) fn edge(&self, d: Vec3, out: &mut Feature) {
        let d = d.as_dvec3();
        let (_, top) = outermost(&self.points, d);
        let Some(way) = self.least_tilt(top, d, &|way| (way - d * d.dot(way)).length()) else { return };
        let slope = -d.dot(way) / way.length();
        if slope < f64::from(FLAT_SINE) {
            // Its ends keep their order when both are as far.
            let [a, b] = [top.as_vec3(), (top + way).as_vec3()];
            let swapped = (b.x, b.y, b.z) < (a.x, a.y, a.z);
            let [a, b] = if swapped { [b, a] } else { [a, b] };
            out.push(a);
            out.push(b);
        }
    }

    /// The way to the point that a plane through `top` with this normal meets first, tilted so that points sink by as much as
    /// they are aside.
    fn least_tilt(&self, top: DVec3, normal: DVec3, aside: &dyn Fn(DVec3) -> f64) -> Option<DVec3> {
        let (mut best, mut slope) = (None, f64::MIN);
        for point in &self.points {
            let way = point.as_dvec3() - top;
            let far = aside(way);
            // Points on the edge itself have no side.
            if far > 1e-6 * way.length() && normal.dot(way) > slope * far {
                (best, slope) = (Some(way), normal.dot(way) / far);
            }
        }
        best
    }

    /// Normal of the hull's face that a plane through `top` square to `d` meets first: tilted about the point towards
    /// the one that takes the least tilt, then turned about the edge to that, to the side where the face looks more
    /// along `d`.
    fn face_around(&self, top: DVec3, d: DVec3) -> Option<DVec3> {
        let edge = self.least_tilt(top, d, &|way| (way - d * d.dot(way)).length())?;
        let across = edge.cross(d).normalize_or_zero();
        let tilted = across.cross(edge).normalize_or_zero();
        let mut found: Option<DVec3> = None;
        for side in [across, -across] {
            let Some(way) = self.least_tilt(top, tilted, &|way| side.dot(way)) else { continue };
            let normal = edge.cross(way).normalize_or_zero();
            let normal = if normal.dot(tilted) < 0.0 { -normal } else { normal };
            if found.is_none_or(|other| normal.dot(d) > other.dot(d) + 1e-3) {
                found = Some(normal);
            }
        }
        found
    }

    /// The corners of the face through `top` with this normal, counter-clockwise: each time the rightmost point.
    fn outline(&self, top: DVec3, normal: DVec3, out: &mut Feature) {
        let thickness = 1e-5 * self.aabb.half_extents().as_dvec3().length();
        let on_face = |point: &&Vec3| normal.dot(point.as_dvec3() - top).abs() <= thickness;
        let (t1, _) = tangents(normal.as_vec3());
        let first = self.points.iter().filter(on_face).fold(top, |best, point| {
            let point = point.as_dvec3();
            if point.dot(t1.as_dvec3()) > best.dot(t1.as_dvec3()) { point } else { best }
        });
        let mut corner = first;
        for _ in 0..FEATURE_POINTS {
            out.push(corner.as_vec3());
            let mut next = corner;
            for point in self.points.iter().filter(on_face) {
                let (way, best) = (point.as_dvec3() - corner, next - corner);
                if way.length_squared() <= thickness * thickness {
                    continue;
                }
                let right = normal.dot(way.cross(best));
                let level = 1e-9 * way.length() * best.length();
                let farther = right >= -level && way.length_squared() > best.length_squared();
                if next == corner || right > level || farther && right.abs() <= level {
                    next = point.as_dvec3();
                }
            }
            if (next - first).length_squared() <= thickness * thickness {
                break;
            }
            corner = next;
        }
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
