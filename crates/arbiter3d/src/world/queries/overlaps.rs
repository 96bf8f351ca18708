//! What overlaps a box, a shape or a point.

use super::{QueryFilter, checked_pose};
use crate::error::{Error, finite_vec};
use crate::id::ShapeId;
use crate::math::{Aabb, Pose, Vec3};
use crate::query::overlaps;
use crate::query::pair::holds_point;
use crate::shape::Shape;
use crate::world::World;

impl World {
    /// Shapes whose boxes overlap `aabb`, oldest first. The shapes themselves may be beside it: see
    /// [`World::overlap_shape`].
    #[must_use]
    pub fn overlap_aabb(&self, aabb: &Aabb, filter: &QueryFilter<'_>) -> Vec<ShapeId> {
        self.overlapping(aabb, filter, |_| true)
    }

    /// Shapes that share a point with a shape placed by `pose`, oldest first. Meshes count as surfaces, seen from both
    /// sides.
    ///
    /// ```
    /// use arbiter3d::{BodyId, QueryFilter, Shape, ShapeDefinition, World, math::{Pose, Vec3}};
    /// let mut world = World::default();
    /// let ball = world.add_shape(BodyId::WORLD, &ShapeDefinition::new(Shape::sphere(1.0)?))?;
    /// let around = |x: f32| Pose::from_position(Vec3::new(x, 0.9, 0.9));
    /// let cube = Shape::cuboid(Vec3::splat(0.5))?;
    /// assert_eq!(world.overlap_shape(&cube, &around(0.0), &QueryFilter::default())?, [ball]);
    /// assert!(world.overlap_shape(&cube, &around(1.4), &QueryFilter::default())?.is_empty()); // only their boxes overlap
    /// # Ok::<(), arbiter3d::Error>(())
    /// ```
    ///
    /// # Errors
    /// If the pose is not finite, or its rotation not of unit length.
    pub fn overlap_shape(&self, shape: &Shape, pose: &Pose, filter: &QueryFilter<'_>) -> Result<Vec<ShapeId>, Error> {
        let pose = checked_pose("pose", pose)?;
        Ok(self.overlapping(&shape.aabb(&pose), filter, |slot| {
            overlaps(&self.shapes[slot as usize].geometry, &self.placed(slot), shape, &pose)
        }))
    }

    /// Whether any shape shares a point with a shape placed by `pose`: faster than finding all.
    ///
    /// # Errors
    /// As [`World::overlap_shape`].
    pub fn overlap_shape_any(&self, shape: &Shape, pose: &Pose, filter: &QueryFilter<'_>) -> Result<bool, Error> {
        let pose = checked_pose("pose", pose)?;
        let aabb = shape.aabb(&pose);
        let mut any = false;
        self.broad_phase.query(&aabb, |slot| {
            any = self.sees(filter, slot)
                && overlaps(&self.shapes[slot as usize].geometry, &self.placed(slot), shape, &pose);
            !any
        });
        Ok(any)
    }

    /// Shapes with a point inside or on their surface, oldest first. Meshes have no inside.
    ///
    /// # Errors
    /// If the point is not finite.
    pub fn overlap_point(&self, point: Vec3, filter: &QueryFilter<'_>) -> Result<Vec<ShapeId>, Error> {
        let point = finite_vec("point", point)?;
        Ok(self.overlapping(&Aabb::new(point, point), filter, |slot| {
            let local = self.placed(slot).inverse_transform_point(point);
            holds_point(&self.shapes[slot as usize].geometry, local)
        }))
    }

    fn overlapping(&self, aabb: &Aabb, filter: &QueryFilter<'_>, accepts: impl Fn(u32) -> bool) -> Vec<ShapeId> {
        let mut found = Vec::new();
        self.broad_phase.query(aabb, |slot| {
            if self.tight_aabb(slot).overlaps(aabb) && self.sees(filter, slot) && accepts(slot) {
                found.push(self.shapes[slot as usize].id);
            }
            true
        });
        found.sort_unstable();
        found
    }
}
