//! What is closest to a point or to a shape.

use super::{QueryFilter, checked_pose, checked_reach};
use crate::error::{Error, finite_vec};
use crate::id::{BodyId, ShapeId};
use crate::math::{Aabb, Pose, Real, Vec3};
use crate::query::pair::{Separation, closest_point, separation};
use crate::query::{ShapeDistance, distance};
use crate::shape::Shape;
use crate::world::{Material, World};

/// The point of a shape that is closest to a point, or to another shape.
///
/// ```
/// use arbiter3d::{BodyId, QueryFilter, Shape, ShapeDefinition, World, math::Vec3};
/// let mut world = World::default();
/// world.add_shape(BodyId::WORLD, &ShapeDefinition::new(Shape::cuboid(Vec3::ONE)?))?;
/// let hit = world.closest_point(Vec3::X * 3.0, 10.0, &QueryFilter::default())?.unwrap();
/// assert!((hit.distance - 2.0).abs() < 1e-6 && hit.point.distance(Vec3::X) < 1e-6 && hit.normal == Vec3::X);
/// # Ok::<(), arbiter3d::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointHit {
    /// Body of the shape.
    pub body: BodyId,
    /// The shape.
    pub shape: ShapeId,
    /// Child of a compound.
    pub child: Option<u32>,
    /// Triangle of a mesh, as numbered by the user.
    pub triangle: Option<u32>,
    /// What the surface is made of there.
    pub material: Material,
    /// The closest point of the shape, world.
    pub point: Vec3,
    /// Unit vector from there to what was asked about; zero where a point is inside the shape.
    pub normal: Vec3,
    /// Distance, metres: 0 for a point inside the shape; negative where two shapes overlap.
    pub distance: Real,
}

impl PointHit {
    fn is_before(&self, other: &Self) -> bool {
        (self.distance, self.shape) < (other.distance, other.shape)
    }
}

impl World {
    /// The point of the world that is closest to a point, no farther than `max_distance` (metres, may be infinite).
    /// Inside a shape that is the point itself. Of shapes at the same distance, the oldest.
    ///
    /// # Errors
    /// If the point is not finite, or the distance is NaN or negative.
    pub fn closest_point(
        &self,
        point: Vec3,
        max_distance: Real,
        filter: &QueryFilter<'_>,
    ) -> Result<Option<PointHit>, Error> {
        let mut best: Option<PointHit> = None;
        self.near_point(point, max_distance, filter, |hit| {
            if best.is_none_or(|best| hit.is_before(&best)) {
                best = Some(*hit);
            }
            hit.distance
        })?;
        Ok(best)
    }

    /// The `count` shapes closest to a point, no farther than `max_distance` (metres, may be infinite), nearest first;
    /// at the same distance, the oldest first.
    ///
    /// ```
    /// use arbiter3d::{BodyId, QueryFilter, Shape, ShapeDefinition, World, math::Vec3};
    /// let mut world = World::default();
    /// let ball = ShapeDefinition::new(Shape::sphere(0.5)?);
    /// for x in 0..10 {
    ///     world.add_shape(BodyId::WORLD, &ball.clone().at(Vec3::X * x as f32))?;
    /// }
    /// let near = world.nearest_shapes(Vec3::X * 6.8, 3, f32::INFINITY, &QueryFilter::default())?;
    /// let expected = [0.0, 0.3, 0.7]; // balls 7 (inside), 6 and 8
    /// assert!(near.iter().zip(expected).all(|(hit, gap)| (hit.distance - gap).abs() < 1e-5));
    /// # Ok::<(), arbiter3d::Error>(())
    /// ```
    ///
    /// # Errors
    /// As [`World::closest_point`].
    pub fn nearest_shapes(
        &self,
        point: Vec3,
        count: usize,
        max_distance: Real,
        filter: &QueryFilter<'_>,
    ) -> Result<Vec<PointHit>, Error> {
        let mut best: Vec<PointHit> = Vec::new();
        self.near_point(point, max_distance, filter, |hit| {
            let place = best.partition_point(|other| other.is_before(hit));
            if place < count {
                best.insert(place, *hit);
                best.truncate(count);
            }
            best.last().filter(|_| best.len() == count).map_or(max_distance, |last| last.distance)
        })?;
        Ok(best)
    }

    /// The shape of the world that is closest to a shape placed by `pose`, no farther than `max_distance` (metres, may
    /// be infinite); of overlapping ones the deepest. Of shapes at the same distance, the oldest.
    ///
    /// # Errors
    /// If the pose is not finite, its rotation not of unit length, or the distance is NaN or negative.
    pub fn closest_shape(
        &self,
        shape: &Shape,
        pose: &Pose,
        max_distance: Real,
        filter: &QueryFilter<'_>,
    ) -> Result<Option<PointHit>, Error> {
        let pose = checked_pose("pose", pose)?;
        checked_reach("max_distance", max_distance)?;
        let mut best: Option<PointHit> = None;
        self.each_near(&shape.aabb(&pose), max_distance, filter, |slot, limit| {
            let placed = self.placed(slot);
            let geometry = &self.shapes[slot as usize].geometry;
            let found = separation(geometry, shape, &placed.relative(&pose), limit)?;
            let hit = self.point_hit(slot, &placed, &found);
            if best.is_none_or(|best| hit.is_before(&best)) {
                best = Some(hit);
            }
            Some(crate::math::max(hit.distance, 0.0))
        });
        Ok(best)
    }

    /// Distance and closest points of two shapes of the world; `None` where they are farther apart than `max_distance`
    /// (metres, may be infinite). Negative where they overlap: see [`distance`].
    ///
    /// # Errors
    /// If a shape is unknown, or the distance is NaN or negative.
    pub fn distance_between(
        &self,
        shape1: ShapeId,
        shape2: ShapeId,
        max_distance: Real,
    ) -> Result<Option<ShapeDistance>, Error> {
        checked_reach("max_distance", max_distance)?;
        let slots = [self.shape_slot(shape1)?, self.shape_slot(shape2)?];
        let [first, second] = slots.map(|slot| &self.shapes[slot as usize].geometry);
        let [pose1, pose2] = slots.map(|slot| self.placed(slot));
        Ok(distance(first, &pose1, second, &pose2, max_distance))
    }

    /// Calls `visit` with the closest points of shapes near a point; it returns how far is of interest from now on.
    fn near_point(
        &self,
        point: Vec3,
        max_distance: Real,
        filter: &QueryFilter<'_>,
        mut visit: impl FnMut(&PointHit) -> Real,
    ) -> Result<(), Error> {
        finite_vec("point", point)?;
        checked_reach("max_distance", max_distance)?;
        self.each_near(&Aabb::new(point, point), max_distance, filter, |slot, limit| {
            let placed = self.placed(slot);
            let local = placed.inverse_transform_point(point);
            let found = closest_point(&self.shapes[slot as usize].geometry, local, limit)?;
            Some(visit(&self.point_hit(slot, &placed, &found)))
        });
        Ok(())
    }

    /// Calls `visit` with the shapes whose boxes are near a box, and how far is of interest; it may return less.
    fn each_near(
        &self,
        aabb: &Aabb,
        max_distance: Real,
        filter: &QueryFilter<'_>,
        mut visit: impl FnMut(u32, Real) -> Option<Real>,
    ) {
        let mut limit = max_distance;
        self.broad_phase.nearest(aabb, max_distance * max_distance, |slot, squared| {
            if !self.sees(filter, slot) {
                return squared;
            }
            limit = visit(slot, limit).map_or(limit, |reach| crate::math::min(reach, limit));
            // What is just as near counts as well, so nothing may be lost to rounding.
            limit * limit * (1.0 + 1e-6)
        });
    }

    fn point_hit(&self, slot: u32, placed: &Pose, found: &Separation) -> PointHit {
        let shape = &self.shapes[slot as usize];
        let (point, normal) =
            (placed.transform_point(found.distance.point1), placed.rotation.rotate(found.distance.normal));
        PointHit {
            body: self.body_id(shape.body),
            shape: shape.id,
            child: found.child,
            triangle: found.triangle,
            material: self.material_at(slot, (found.child, found.triangle), (point, normal)),
            point,
            normal,
            distance: found.distance.distance,
        }
    }
}
