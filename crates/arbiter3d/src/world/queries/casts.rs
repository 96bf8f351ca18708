//! Shapes that move through the world.

use super::{QueryFilter, checked_pose};
use crate::error::Error;
use crate::id::{BodyId, ShapeId};
use crate::math::{Pose, Real, Vec3};
use crate::query::ShapeCast;
use crate::query::cast::{Impact, Mover};
use crate::world::{Material, World};

/// Where a moving shape first touches another.
///
/// ```
/// use arbiter3d::{BodyId, QueryFilter, Shape, ShapeCast, ShapeDefinition, World, math::{Pose, Vec3}};
/// let mut world = World::default();
/// let floor = Shape::cuboid(Vec3::new(9.0, 1.0, 9.0))?;
/// world.add_shape(BodyId::WORLD, &ShapeDefinition::new(floor))?;
/// let ball = Shape::sphere(0.5)?;
/// let drop = ShapeCast::along(&ball, Pose::from_position(Vec3::Y * 6.5), Vec3::Y * -10.0);
/// let hit = world.cast_shape(&drop, &QueryFilter::default())?.unwrap();
/// assert!((hit.fraction - 0.5).abs() < 1e-5 && hit.normal.distance(Vec3::Y) < 1e-5 && hit.depth == 0.0);
/// # Ok::<(), arbiter3d::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CastHit {
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
    /// Where the surface of the shape that was hit is touched, world.
    pub point: Vec3,
    /// Unit normal there, from the shape that was hit to the moving one, world.
    pub normal: Vec3,
    /// Share of the way travelled, 0 to 1; 0 where the shapes overlap at the start.
    pub fraction: Real,
    /// How deep the shapes overlap at the start, metres along the normal; 0 for all other hits, and where the narrow
    /// phase knows no depth (two meshes).
    pub depth: Real,
}

impl CastHit {
    /// The order of hits: the earlier one; of overlaps at the start the deeper one; the older shape.
    fn is_before(&self, other: &Self) -> bool {
        (self.fraction, -self.depth, self.shape) < (other.fraction, -other.depth, other.shape)
    }
}

impl World {
    /// The first shape that a moving shape touches. Shapes that it overlaps at the start count, at fraction 0; of those
    /// the deepest. Of shapes touched at the same time the oldest.
    ///
    /// The fraction is early, never late, by no more than 10⁻⁴ of the moving shape's size. Shapes that touch at the
    /// start but part do not count. Method: van den Bergen, "Ray Casting against General Convex Objects", 2004;
    /// conservative advancement where the shape turns.
    ///
    /// # Errors
    /// If a pose is not finite, or a rotation not of unit length.
    pub fn cast_shape(&self, cast: &ShapeCast<'_>, filter: &QueryFilter<'_>) -> Result<Option<CastHit>, Error> {
        Ok(self.first_touched(&checked_cast(cast)?, filter))
    }

    /// All shapes that a moving shape touches or overlaps at the start, each once, in the order in which it would meet
    /// them if nothing stopped it.
    ///
    /// # Errors
    /// As [`World::cast_shape`].
    pub fn cast_shape_all(&self, cast: &ShapeCast<'_>, filter: &QueryFilter<'_>) -> Result<Vec<CastHit>, Error> {
        let mover = Mover::new(&checked_cast(cast)?);
        let mut hits = Vec::new();
        self.each_on_way(&mover, |slot, limit| {
            if self.sees(filter, slot)
                && let Some(impact) = mover.cast(&self.shapes[slot as usize].geometry, &self.placed(slot), limit)
            {
                hits.push(self.cast_hit(slot, &impact));
            }
            limit
        });
        hits.sort_by(|a, b| {
            a.fraction.total_cmp(&b.fraction).then(b.depth.total_cmp(&a.depth)).then(a.shape.cmp(&b.shape))
        });
        Ok(hits)
    }

    /// Whether a moving shape touches any shape, or overlaps one at the start: faster than looking for the first one.
    ///
    /// # Errors
    /// As [`World::cast_shape`].
    pub fn cast_shape_any(&self, cast: &ShapeCast<'_>, filter: &QueryFilter<'_>) -> Result<bool, Error> {
        let mover = Mover::new(&checked_cast(cast)?);
        let mut any = false;
        self.each_on_way(&mover, |slot, limit| {
            any = self.sees(filter, slot)
                && mover.cast(&self.shapes[slot as usize].geometry, &self.placed(slot), limit).is_some();
            if any { -1.0 } else { limit }
        });
        Ok(any)
    }

    /// The first shape that a sound cast touches.
    pub(super) fn first_touched(&self, cast: &ShapeCast<'_>, filter: &QueryFilter<'_>) -> Option<CastHit> {
        let mover = Mover::new(cast);
        let mut first: Option<CastHit> = None;
        self.each_on_way(&mover, |slot, limit| {
            if !self.sees(filter, slot) {
                return limit;
            }
            let impact = mover.cast(&self.shapes[slot as usize].geometry, &self.placed(slot), limit);
            let Some(impact) = impact else { return limit };
            let hit = self.cast_hit(slot, &impact);
            if first.is_none_or(|best| hit.is_before(&best)) {
                first = Some(hit);
            }
            crate::math::min(hit.fraction, limit)
        });
        first
    }

    /// Calls `visit` with the shapes whose boxes the mover's box meets on its way.
    fn each_on_way(&self, mover: &Mover<'_>, visit: impl FnMut(u32, Real) -> Real) {
        let bounds = mover.bounds_from(&Pose::IDENTITY);
        self.broad_phase.cast(bounds, mover.displacement(), 1.0, visit);
    }

    fn cast_hit(&self, slot: u32, impact: &Impact) -> CastHit {
        let shape = &self.shapes[slot as usize];
        CastHit {
            body: self.body_id(shape.body),
            shape: shape.id,
            child: impact.child,
            triangle: impact.triangle,
            material: self.material_at(slot, (impact.child, impact.triangle), (impact.point, impact.normal)),
            point: impact.point,
            normal: impact.normal,
            fraction: impact.fraction,
            depth: impact.depth,
        }
    }
}

pub(super) fn checked_cast<'a>(cast: &ShapeCast<'a>) -> Result<ShapeCast<'a>, Error> {
    Ok(ShapeCast {
        shape: cast.shape,
        start: checked_pose("start of the cast", &cast.start)?,
        end: checked_pose("end of the cast", &cast.end)?,
    })
}
