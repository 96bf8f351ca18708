//! Contact points of shapes with the world, without a step.

use super::{QueryFilter, checked_pose, checked_reach};
use crate::error::Error;
use crate::id::{BodyId, ShapeId};
use crate::math::{Pose, Real};
use crate::narrow_phase::{Manifold, PairCache, collide};
use crate::shape::Shape;
use crate::world::{Material, World};

/// Where a shape touches a shape of the world.
///
/// ```
/// use arbiter3d::{BodyId, QueryFilter, Shape, ShapeDefinition, World, math::{Pose, Vec3}};
/// let mut world = World::default();
/// world.add_shape(BodyId::WORLD, &ShapeDefinition::new(Shape::cuboid(Vec3::new(9.0, 1.0, 9.0))?))?;
/// let (cube, pose) = (Shape::cuboid(Vec3::ONE)?, Pose::from_position(Vec3::Y * 1.9));
/// let contacts = world.collide_shape(&cube, &pose, 0.0, &QueryFilter::default())?;
/// let points = contacts[0].manifold.points();
/// assert!(points.len() == 4 && points.iter().all(|p| p.normal == Vec3::Y && (p.separation + 0.1).abs() < 1e-6));
/// # Ok::<(), arbiter3d::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShapeContacts {
    /// Body of the world's shape.
    pub body: BodyId,
    /// The world's shape.
    pub shape: ShapeId,
    /// What it is made of.
    pub material: Material,
    /// The contact points, world: `point1` is on the world's shape, normals point from there to the shape that was
    /// asked about.
    pub manifold: Manifold,
}

impl World {
    /// Contacts of a shape placed by `pose` with the shapes of the world that are closer than `margin` (metres, zero or
    /// more), oldest first: up to four points each, as the step would find them.
    ///
    /// # Errors
    /// If the pose is not finite, its rotation not of unit length, or the margin not finite or negative.
    pub fn collide_shape(
        &self,
        shape: &Shape,
        pose: &Pose,
        margin: Real,
        filter: &QueryFilter<'_>,
    ) -> Result<Vec<ShapeContacts>, Error> {
        let mut found = Vec::new();
        self.collect_contacts((shape, pose), margin, filter, &mut found)?;
        Ok(found)
    }

    /// As [`World::collide_shape`], into a list that is overwritten.
    pub(crate) fn collect_contacts(
        &self,
        (shape, pose): (&Shape, &Pose),
        margin: Real,
        filter: &QueryFilter<'_>,
        found: &mut Vec<ShapeContacts>,
    ) -> Result<(), Error> {
        found.clear();
        let pose = checked_pose("pose", pose)?;
        crate::error::in_range("margin", margin, 0.0, Real::MAX)?;
        let aabb = shape.aabb(&pose).expand(margin);
        self.broad_phase.query(&aabb, |slot| {
            if self.tight_aabb(slot).overlaps(&aabb) && self.sees(filter, slot) {
                let own = &self.shapes[slot as usize];
                let manifold = placed_manifold((&own.geometry, &self.placed(slot)), (shape, &pose), margin);
                if !manifold.points().is_empty() {
                    let (body, material) = (self.body_id(own.body), *own.surface(manifold.materials()[0]));
                    found.push(ShapeContacts { body, shape: own.id, material, manifold });
                }
            }
            true
        });
        found.sort_unstable_by_key(|contacts| contacts.shape);
        Ok(())
    }

    /// Contact points of two shapes of the world that are closer than `margin` (metres, zero or more), world: `point1`
    /// is on
    /// `shape1`, normals point from there to `shape2`. Filters and joints count for nothing.
    ///
    /// # Errors
    /// If a shape is unknown, or the margin not finite or negative.
    pub fn manifold_between(&self, shape1: ShapeId, shape2: ShapeId, margin: Real) -> Result<Manifold, Error> {
        checked_reach("margin", margin)?;
        let slots = [self.shape_slot(shape1)?, self.shape_slot(shape2)?];
        let [first, second] = slots.map(|slot| &self.shapes[slot as usize].geometry);
        let [pose1, pose2] = slots.map(|slot| self.placed(slot));
        Ok(placed_manifold((first, &pose1), (second, &pose2), margin))
    }
}

/// Contacts of two placed shapes, world.
fn placed_manifold((shape1, pose1): (&Shape, &Pose), (shape2, pose2): (&Shape, &Pose), margin: Real) -> Manifold {
    let mut manifold = Manifold::EMPTY;
    collide(shape1, shape2, &pose1.relative(pose2), margin, &mut PairCache::default(), &mut manifold);
    for point in manifold.points_mut() {
        point.point1 = pose1.transform_point(point.point1);
        point.normal = pose1.rotation.rotate(point.normal);
    }
    manifold
}
