//! Rays through the world.

use super::QueryFilter;
use crate::error::{Error, finite_vec};
use crate::id::{BodyId, ShapeId};
use crate::math::{Real, Vec3};
use crate::query::ray::{PartHit, find};
use crate::shape::Ray;
use crate::world::{Material, World};

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
    /// Child of a compound.
    pub child: Option<u32>,
    /// Triangle of a mesh, as numbered by the user.
    pub triangle: Option<u32>,
    /// What the surface is made of there.
    pub material: Material,
    /// Where, world.
    pub point: Vec3,
    /// Unit normal of the surface, world; zero when the ray starts inside the shape.
    pub normal: Vec3,
    /// Share of the direction travelled.
    pub fraction: Real,
}

/// A hit of a shape whose details nobody has asked for yet.
#[derive(Clone, Copy)]
pub(super) struct Found {
    slot: u32,
    id: ShapeId,
    part: PartHit,
}

impl World {
    /// The first shape that a ray meets: from `origin` along `direction` (any length), up to `max_fraction` times it.
    /// Of shapes hit at the same fraction, the oldest.
    ///
    /// # Errors
    /// If the origin or the direction is not finite, or the fraction is NaN or negative.
    pub fn cast_ray(
        &self,
        origin: Vec3,
        direction: Vec3,
        max_fraction: Real,
        filter: &QueryFilter<'_>,
    ) -> Result<Option<RayHit>, Error> {
        let ray = checked_ray(&Ray { origin, direction, max_fraction })?;
        Ok(self.first_on(&ray, filter))
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
        filter: &QueryFilter<'_>,
    ) -> Result<Vec<RayHit>, Error> {
        let ray = checked_ray(&Ray { origin, direction, max_fraction })?;
        let mut hits = Vec::new();
        self.broad_phase.ray(ray.origin, ray.direction, ray.max_fraction, |slot, limit| {
            if self.sees(filter, slot)
                && let Some(found) = self.ray_at(slot, &ray)
            {
                hits.push(self.ray_hit(&ray, &found));
            }
            limit
        });
        hits.sort_by(|a, b| a.fraction.total_cmp(&b.fraction).then(a.shape.cmp(&b.shape)));
        Ok(hits)
    }

    /// Whether a ray meets any shape at all: faster than looking for the first one.
    ///
    /// ```
    /// use arbiter3d::{BodyId, QueryFilter, Shape, ShapeDefinition, World, math::Vec3};
    /// let mut world = World::default();
    /// world.add_shape(BodyId::WORLD, &ShapeDefinition::new(Shape::sphere(1.0)?))?;
    /// let (eye, target) = (Vec3::X * -5.0, Vec3::X * 5.0);
    /// assert!(world.cast_ray_any(eye, target - eye, 1.0, &QueryFilter::default())?);
    /// # Ok::<(), arbiter3d::Error>(())
    /// ```
    ///
    /// # Errors
    /// As [`World::cast_ray`].
    pub fn cast_ray_any(
        &self,
        origin: Vec3,
        direction: Vec3,
        max_fraction: Real,
        filter: &QueryFilter<'_>,
    ) -> Result<bool, Error> {
        let ray = checked_ray(&Ray { origin, direction, max_fraction })?;
        let mut any = false;
        self.broad_phase.ray(ray.origin, ray.direction, ray.max_fraction, |slot, limit| {
            any = self.sees(filter, slot) && self.ray_at(slot, &ray).is_some();
            if any { -1.0 } else { limit }
        });
        Ok(any)
    }

    /// The first hit of a sound ray.
    pub(super) fn first_on(&self, ray: &Ray, filter: &QueryFilter<'_>) -> Option<RayHit> {
        let mut closest: Option<Found> = None;
        self.broad_phase.ray(ray.origin, ray.direction, ray.max_fraction, |slot, limit| {
            if !self.sees(filter, slot) {
                return limit;
            }
            let Some(found) = self.ray_at(slot, &Ray { max_fraction: limit, ..*ray }) else { return limit };
            let fraction = found.part.hit.fraction;
            // Equal fractions go to the older shape, whatever the order of the tree.
            if closest.is_none_or(|best| (fraction, found.id) < (best.part.hit.fraction, best.id)) {
                closest = Some(found);
            }
            crate::math::min(fraction, limit)
        });
        closest.map(|found| self.ray_hit(ray, &found))
    }

    fn ray_at(&self, slot: u32, ray: &Ray) -> Option<Found> {
        let shape = &self.shapes[slot as usize];
        let pose = self.placed(slot);
        let local = Ray {
            origin: pose.inverse_transform_point(ray.origin),
            direction: pose.rotation.inverse_rotate(ray.direction),
            max_fraction: ray.max_fraction,
        };
        find(&shape.geometry, &local).map(|part| Found { slot, id: shape.id, part })
    }

    fn ray_hit(&self, ray: &Ray, found: &Found) -> RayHit {
        let Found { slot, id, part } = *found;
        let (point, normal) = (ray.at(part.hit.fraction), self.placed(slot).rotation.rotate(part.hit.normal));
        RayHit {
            body: self.body_id(self.shapes[slot as usize].body),
            shape: id,
            child: part.child,
            triangle: part.triangle,
            material: self.material_at(slot, (part.child, part.triangle), (point, normal)),
            point,
            normal,
            fraction: part.hit.fraction,
        }
    }
}

pub(super) fn checked_ray(ray: &Ray) -> Result<Ray, Error> {
    finite_vec("ray origin", ray.origin)?;
    finite_vec("ray direction", ray.direction)?;
    super::checked_reach("max_fraction", ray.max_fraction)?;
    Ok(*ray)
}
