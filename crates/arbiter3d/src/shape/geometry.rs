//! What every kind of shape can tell of itself.
//!
//! A new kind of shape is a file with its data and an `impl Geometry`, an entry in [`Shape`](super::Shape), and an arm in
//! its `geometry`. A convex one also has a variant in the narrow phase's `Support`, which is all that contacts and queries
//! need; a composite one has an arm where convex parts are listed.

use super::ray::{Ray, ShapeHit};
use super::{MassProperties, ShapeError};
use crate::math::{Aabb, Pose, Real, Vec3};

/// What the world, the queries and the tools ask of a shape, in its own frame.
pub(crate) trait Geometry {
    /// The box around it.
    fn local_aabb(&self) -> Aabb;

    /// The box around it where `pose` puts it.
    fn aabb(&self, pose: &Pose) -> Aabb {
        self.local_aabb().transform(pose)
    }

    /// Mass, centre and inertia at a density, or why it has none.
    fn mass_properties(&self, density: Real) -> Result<MassProperties, ShapeError>;

    /// Centre and radius of a ball that fits inside.
    fn inner_ball(&self) -> (Vec3, Real);

    /// Distance of its farthest point from a point; an upper bound will do.
    fn reach_from(&self, point: Vec3) -> Real {
        self.local_aabb().farthest_from(point).length()
    }

    /// The radius that rolls.
    fn rounding_radius(&self) -> Real {
        0.0
    }

    /// The first point along a ray.
    fn cast_ray(&self, ray: &Ray) -> Option<ShapeHit>;
}
