//! Contacts between two shapes: which points touch, along which normal, how deep.
//!
//! [`collide`] sorts a pair by the kind of its shapes, so that each kernel is written once, with the more complex
//! shape in the role of shape 1: compound, voxels, mesh, hull, cuboid, capsule, sphere. Where the caller's order is the
//! other one, the result is mirrored.
//!
//! Every kernel keeps these laws:
//! - all is in the frame of shape 1, so only the relative pose counts and a pair far from the origin loses no
//!   precision;
//! - a normal is a finite unit vector from shape 1 to shape 2, even where centres coincide or edges are parallel;
//! - all points of a convex pair have the bit-equal normal;
//! - a manifold is complete in one call: up to four points, those within `margin` included, those beyond it left out;
//! - shapes that overlap never give an empty manifold;
//! - tolerances scale with the shapes, so a millimetre box behaves as a kilometre box.

mod capsule;
mod clip;
mod composite;
mod cuboid;
mod general;
mod half_space;
mod hull;
mod manifold;
mod mesh;
mod mesh_points;
mod nearest;
mod penetration;
mod revolved;
mod seam;
mod sphere;
mod surfaces;
mod time_of_impact;
mod triangle;
mod triangle_general;
mod triangle_lanes;
mod triangle_solid;

pub(crate) use crate::shape::Support;
pub(crate) use crate::shape::distance::{Cast, CastPoint, closest, linear_cast};
pub(crate) use cuboid::{CuboidLanes, CuboidPair, Near as NearCuboids, WideManifold};
pub(crate) use seam::{Cast as SeamCast, Patch, Verdict, scale_of};
pub(crate) use time_of_impact::{Approach, Sweep, Touch, approach, gap, time_of_impact};

pub use manifold::{Manifold, ManifoldPoint};

use crate::math::{Pose, Real};
use crate::shape::{Shape, Surface};
use crate::simd::SimdLevel;
use glam::DQuat;

/// What a pair remembers between steps to find its contact faster: the last separating or reference feature.
///
/// A cache never changes a result, only its cost: kernels verify what it suggests.
///
/// ```
/// use arbiter3d::narrow_phase::PairCache;
/// assert_eq!(PairCache::default().words, [0, 0]); // remembers nothing
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PairCache {
    /// Kernel-defined.
    pub words: [u32; 2],
}

/// Finds the contacts of two shapes that are closer than `margin` (metres, zero or more).
///
/// `pose` places shape 2 in the frame of shape 1; the manifold is in that frame, its normals point from shape 1 to
/// shape 2.
///
/// ```
/// use arbiter3d::{Shape, math::{Pose, Vec3}, narrow_phase::{Manifold, PairCache, collide}};
/// let cube = Shape::cuboid(Vec3::ONE)?;
/// let above = Pose::from_position(Vec3::new(0.0, 1.9, 0.0));
/// let mut manifold = Manifold::EMPTY;
/// collide(&cube, &cube, &above, 0.02, &mut PairCache::default(), &mut manifold);
/// assert_eq!(manifold.points().len(), 4);
/// assert!((manifold.points()[0].separation + 0.1).abs() < 1e-6);
/// # Ok::<(), arbiter3d::ShapeError>(())
/// ```
pub fn collide(
    shape1: &Shape,
    shape2: &Shape,
    pose: &Pose,
    margin: Real,
    cache: &mut PairCache,
    manifold: &mut Manifold,
) {
    manifold.clear();
    collide_on(SimdLevel::best(), (shape1, shape2), pose, margin, (cache, manifold));
}

/// [`collide`] with the instructions of a level; the result is the same bits for all.
///
/// If one of the shapes [chooses among many points](keeps_points), the manifold may hold the points of the last step, each
/// as far as its two sides are apart now: of points that serve about as well, those that go on from them are chosen.
#[inline(always)]
pub(crate) fn collide_on(
    level: SimdLevel,
    (shape1, shape2): (&Shape, &Shape),
    pose: &Pose,
    margin: Real,
    (cache, manifold): (&mut PairCache, &mut Manifold),
) {
    if rank(shape1) >= rank(shape2) {
        collide_sorted(level, (shape1, shape2), pose, margin, (cache, manifold));
    } else {
        // The plain inverse would cost a pebble on a hall its last digits.
        let inverse = if rank(shape2) == GENERAL { exact_inverse(pose) } else { pose.inverse() };
        mirror(&inverse, manifold);
        collide_sorted(level, (shape2, shape1), &inverse, margin, (cache, manifold));
        mirror(pose, manifold);
    }
}

/// The inverse with the position reckoned in `f64`: as far away as it was but for one rounding.
fn exact_inverse(pose: &Pose) -> Pose {
    let q = pose.rotation;
    let q = DQuat::from_xyzw(q.x.into(), q.y.into(), q.z.into(), q.w.into()).normalize();
    Pose::new(-(q.conjugate() * pose.position.as_dvec3()).as_vec3(), pose.rotation.conjugate())
}

/// Whether contacts with a shape are chosen among those of its many parts, so that the choice may go on from the last one.
pub(crate) fn keeps_points(shape: &Shape) -> bool {
    matches!(shape, Shape::Mesh(_) | Shape::HeightField(_) | Shape::Voxels(_) | Shape::Compound(_))
}

/// Rank of shapes without a kernel of their own.
const GENERAL: u8 = 4;

/// The shape with the higher rank plays shape 1.
#[inline(always)]
fn rank(shape: &Shape) -> u8 {
    match shape {
        Shape::Sphere(_) => 0,
        Shape::Capsule(_) => 1,
        Shape::Cuboid(_) => 2,
        Shape::Hull(_) => 3,
        Shape::HalfSpace(_) => 6,
        Shape::Mesh(_) | Shape::HeightField(_) => 5,
        Shape::Voxels(_) => 7,
        Shape::Compound(_) => 8,
        _ => GENERAL,
    }
}

#[inline(always)]
fn collide_sorted(
    level: SimdLevel,
    (shape1, shape2): (&Shape, &Shape),
    pose: &Pose,
    margin: Real,
    (cache, manifold): (&mut PairCache, &mut Manifold),
) {
    match (shape1, shape2) {
        (Shape::Cuboid(a), Shape::Cuboid(b)) => cuboid::cuboid_cuboid(a, b, pose, margin, manifold),
        (Shape::Sphere(a), Shape::Sphere(b)) => sphere::sphere_sphere(a, b, pose, margin, manifold),
        (Shape::Capsule(a), Shape::Sphere(b)) => sphere::capsule_sphere(a, b, pose, margin, manifold),
        (Shape::Cuboid(a), Shape::Sphere(b)) => sphere::cuboid_sphere(a, b, pose, margin, manifold),
        (Shape::Capsule(a), Shape::Capsule(b)) => capsule::capsule_capsule(a, b, pose, margin, manifold),
        (Shape::Cuboid(a), Shape::Capsule(b)) => capsule::cuboid_capsule(a, b, pose, margin, manifold),
        (Shape::Hull(a), Shape::Sphere(b)) => sphere::hull_sphere(a, b, pose, margin, manifold),
        (Shape::Hull(a), Shape::Capsule(b)) => capsule::hull_capsule(a, b, pose, margin, manifold),
        (Shape::Hull(a), Shape::Cuboid(b)) => hull::collide(level, (a, b), pose, margin, (cache, manifold)),
        (Shape::Hull(a), Shape::Hull(b)) => hull::collide(level, (a, &**b), pose, margin, (cache, manifold)),
        (Shape::Compound(a), other) => composite::collide(level, (&**a, other), pose, margin, manifold),
        (Shape::Voxels(a), other) => composite::collide(level, (&**a, other), pose, margin, manifold),
        (Shape::HalfSpace(_), other) => half_space::collide(other, pose, margin, manifold),
        (Shape::Mesh(_) | Shape::HeightField(_), other) => collide_surface(shape1, other, pose, margin, manifold),
        (revolved, Shape::Sphere(b)) if revolved::revolved_sphere(revolved, b, pose, margin, manifold) => {}
        _ => general::collide((shape1, shape2), pose, margin, manifold),
    }
}

/// A mesh or a height field against anything.
fn collide_surface(shape1: &Shape, shape2: &Shape, pose: &Pose, margin: Real, manifold: &mut Manifold) {
    match (Surface::of(shape1), Surface::of(shape2)) {
        (Some(a), None) => mesh::collide(a, shape2, pose, margin, manifold),
        (Some(a), Some(b)) => surfaces::collide((a, b), pose, margin, manifold),
        _ => manifold.clear(),
    }
}

/// Swaps the roles: what was found in the frame of shape 2 (as shape 1), told in the frame of shape 1.
fn mirror(pose: &Pose, manifold: &mut Manifold) {
    for point in manifold.points_mut() {
        point.point1 = pose.transform_point(point.point2());
        point.normal = -pose.rotation.rotate(point.normal);
    }
    manifold.swap_materials();
}

#[cfg(test)]
mod nearest_tests;
#[cfg(test)]
mod oracle_tests;
#[cfg(test)]
mod tests;
