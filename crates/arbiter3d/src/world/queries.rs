//! Questions to the world: rays and boxes.

use super::World;
use super::shapes::ShapeSlot;
use crate::error::{Error, finite_vec};
use crate::id::{BodyId, ShapeId};
use crate::math::{Aabb, Real, Vec3};
use crate::query::{Ray, ShapeHit, cast_ray};
use crate::shape::Shape;

/// Which shapes a query sees.
///
/// ```
/// use arbiter3d::{BodyId, QueryFilter};
/// let all_but_the_world = QueryFilter { exclude_body: Some(BodyId::WORLD), ..QueryFilter::default() };
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct QueryFilter {
    /// What the query is, for the masks of the shapes. Default all.
    pub category: u64,
    /// Categories of shapes that the query sees. Default all.
    pub mask: u64,
    /// Whether sensors are seen. Default false.
    pub sensors: bool,
    /// A body not to see. Default none.
    pub exclude_body: Option<BodyId>,
    /// A shape not to see. Default none.
    pub exclude_shape: Option<ShapeId>,
}

impl Default for QueryFilter {
    fn default() -> Self {
        Self { category: u64::MAX, mask: u64::MAX, sensors: false, exclude_body: None, exclude_shape: None }
    }
}

/// Where a ray meets a shape.
///
/// ```
/// use arbiter3d::{BodyId, QueryFilter, Shape, ShapeDefinition, World, math::Vec3};
/// let mut world = World::default();
/// world.add_shape(BodyId::WORLD, &ShapeDefinition::new(Shape::sphere(1.0)?))?;
/// let down = Vec3::new(0.0, -10.0, 0.0);
/// let hit = world.cast_ray(Vec3::new(0.0, 6.0, 0.0), down, 1.0, &QueryFilter::default())?.unwrap();
/// assert!((hit.fraction - 0.5).abs() < 1e-6 && (hit.point.y - 1.0).abs() < 1e-5);
/// # Ok::<(), arbiter3d::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayHit {
    /// Body that was hit.
    pub body: BodyId,
    /// Shape that was hit.
    pub shape: ShapeId,
    /// Where, world.
    pub point: Vec3,
    /// Unit normal of the surface, world; zero when the ray starts inside the shape.
    pub normal: Vec3,
    /// Share of the direction travelled.
    pub fraction: Real,
    /// Triangle of a mesh, as numbered by the user, or of a height field.
    pub triangle: Option<u32>,
}

impl World {
    /// The first shape that a ray meets: from `origin` along `direction` (any length), up to `max_fraction` times it.
    ///
    /// # Errors
    /// If the origin or the direction is not finite, or the fraction is NaN or negative.
    pub fn cast_ray(
        &self,
        origin: Vec3,
        direction: Vec3,
        max_fraction: Real,
        filter: &QueryFilter,
    ) -> Result<Option<RayHit>, Error> {
        let ray = checked_ray(origin, direction, max_fraction)?;
        let mut closest: Option<RayHit> = None;
        self.broad_phase.ray(origin, direction, max_fraction, |slot, limit| {
            let Some(hit) = self.cast_at(slot, &Ray { max_fraction: limit, ..ray }, filter) else { return limit };
            // Equal fractions go to the older shape, whatever the order of the tree.
            let better = closest.is_none_or(|best| (hit.fraction, hit.shape) < (best.fraction, best.shape));
            if better {
                closest = Some(hit);
            }
            crate::math::min(hit.fraction, limit)
        });
        Ok(closest)
    }

    /// All shapes that a ray meets, each once, nearest first.
    ///
    /// # Errors
    /// As [`World::cast_ray`].
    pub fn cast_ray_all(
        &self,
        origin: Vec3,
        direction: Vec3,
        max_fraction: Real,
        filter: &QueryFilter,
    ) -> Result<Vec<RayHit>, Error> {
        let ray = checked_ray(origin, direction, max_fraction)?;
        let mut hits = Vec::new();
        self.broad_phase.ray(origin, direction, max_fraction, |slot, limit| {
            hits.extend(self.cast_at(slot, &ray, filter));
            limit
        });
        hits.sort_by(|a, b| a.fraction.total_cmp(&b.fraction).then(a.shape.cmp(&b.shape)));
        Ok(hits)
    }

    /// Shapes whose boxes overlap `aabb`, oldest first.
    #[must_use]
    pub fn overlap_aabb(&self, aabb: &Aabb, filter: &QueryFilter) -> Vec<ShapeId> {
        let mut found = Vec::new();
        self.broad_phase.query(aabb, |slot| {
            if self.sees(filter, slot) && self.tight_aabb(slot).overlaps(aabb) {
                found.push(self.shapes[slot as usize].id);
            }
            true
        });
        found.sort_unstable();
        found
    }

    fn cast_at(&self, slot: u32, ray: &Ray, filter: &QueryFilter) -> Option<RayHit> {
        if !self.sees(filter, slot) {
            return None;
        }
        let shape = &self.shapes[slot as usize];
        let pose = self.bodies[shape.body as usize].pose.mul(&shape.pose);
        let local = Ray {
            origin: pose.inverse_transform_point(ray.origin),
            direction: pose.rotation.inverse_rotate(ray.direction),
            max_fraction: ray.max_fraction,
        };
        let (hit, triangle) = cast_shape(shape, &local)?;
        Some(RayHit {
            body: self.body_id(shape.body),
            shape: shape.id,
            point: ray.at(hit.fraction),
            normal: pose.rotation.rotate(hit.normal),
            fraction: hit.fraction,
            triangle,
        })
    }

    fn sees(&self, filter: &QueryFilter, slot: u32) -> bool {
        let shape = &self.shapes[slot as usize];
        filter.mask & shape.filter.category != 0
            && shape.filter.mask & filter.category != 0
            && (filter.sensors || !shape.sensor)
            && filter.exclude_shape != Some(shape.id)
            && filter.exclude_body != Some(self.body_id(shape.body))
    }
}

fn cast_shape(shape: &ShapeSlot, ray: &Ray) -> Option<(ShapeHit, Option<u32>)> {
    if let Shape::Mesh(mesh) = &shape.geometry {
        let hit = mesh.cast_ray(ray.origin, ray.direction, ray.max_fraction)?;
        return Some((ShapeHit { fraction: hit.distance, normal: hit.normal }, Some(hit.triangle)));
    }
    if let Shape::HeightField(field) = &shape.geometry {
        let hit = field.cast_ray(ray.origin, ray.direction, ray.max_fraction)?;
        return Some((ShapeHit { fraction: hit.distance, normal: hit.normal }, Some(hit.triangle)));
    }
    cast_ray(&shape.geometry, ray).map(|hit| (hit, None))
}

fn checked_ray(origin: Vec3, direction: Vec3, max_fraction: Real) -> Result<Ray, Error> {
    finite_vec("ray origin", origin)?;
    finite_vec("ray direction", direction)?;
    crate::error::in_range("max_fraction", max_fraction, 0.0, Real::INFINITY)?;
    Ok(Ray { origin, direction, max_fraction })
}
