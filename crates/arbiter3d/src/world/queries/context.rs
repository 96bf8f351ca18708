//! The queries that listeners and contact providers use most, said to their context. All others:
//! [`StepContext::world`].

use super::{CastHit, PointHit, QueryFilter, RayHit};
use crate::error::Error;
use crate::id::ShapeId;
use crate::math::{Pose, Real, Vec3};
use crate::query::ShapeCast;
use crate::shape::Shape;
use crate::world::StepContext;

impl StepContext<'_> {
    /// As [`World::cast_ray`](crate::World::cast_ray).
    ///
    /// # Errors
    /// As there.
    pub fn cast_ray(
        &self,
        origin: Vec3,
        direction: Vec3,
        max_fraction: Real,
        filter: &QueryFilter<'_>,
    ) -> Result<Option<RayHit>, Error> {
        self.world().cast_ray(origin, direction, max_fraction, filter)
    }

    /// As [`World::cast_shape`](crate::World::cast_shape).
    ///
    /// # Errors
    /// As there.
    pub fn cast_shape(&self, cast: &ShapeCast<'_>, filter: &QueryFilter<'_>) -> Result<Option<CastHit>, Error> {
        self.world().cast_shape(cast, filter)
    }

    /// As [`World::overlap_shape`](crate::World::overlap_shape).
    ///
    /// # Errors
    /// As there.
    pub fn overlap_shape(&self, shape: &Shape, pose: &Pose, filter: &QueryFilter<'_>) -> Result<Vec<ShapeId>, Error> {
        self.world().overlap_shape(shape, pose, filter)
    }

    /// As [`World::closest_point`](crate::World::closest_point).
    ///
    /// # Errors
    /// As there.
    pub fn closest_point(
        &self,
        point: Vec3,
        max_distance: Real,
        filter: &QueryFilter<'_>,
    ) -> Result<Option<PointHit>, Error> {
        self.world().closest_point(point, max_distance, filter)
    }
}
