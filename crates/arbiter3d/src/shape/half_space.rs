//! Half-spaces: endless floors.

use super::geometry::Geometry;
use super::ray::{Ray, ShapeHit};
use super::{MassProperties, ShapeError};
use crate::math::{Aabb, Pose, Real, Vec3};

/// Everything with `y ≤ 0`: an endless floor, for static and kinematic bodies. Turn the shape for other directions.
///
/// ```
/// use arbiter3d::{BodyId, Shape, ShapeDefinition, World};
/// let mut world = World::default();
/// world.add_shape(BodyId::WORLD, &ShapeDefinition::new(Shape::half_space()))?;
/// # Ok::<(), arbiter3d::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct HalfSpace;

/// What stands for endless in boxes, metres: the square of it still fits.
const ENDLESS: Real = 1e8;

impl Geometry for HalfSpace {
    fn local_aabb(&self) -> Aabb {
        self.aabb(&Pose::IDENTITY)
    }

    /// Endless but along an axis that it looks along exactly.
    fn aabb(&self, pose: &Pose) -> Aabb {
        let normal = pose.rotation.rotate(Vec3::Y);
        let (mut low, mut high) = (Vec3::splat(-ENDLESS), Vec3::splat(ENDLESS));
        for axis in 0..3 {
            let square = (0..3).all(|other| other == axis || normal[other].abs() < 1e-6);
            if square && normal[axis] > 0.0 {
                high[axis] = pose.position[axis];
            } else if square {
                low[axis] = pose.position[axis];
            }
        }
        Aabb::new(low, high)
    }

    fn mass_properties(&self, _: Real) -> Result<MassProperties, ShapeError> {
        Err(ShapeError::NoVolume { shape: "a half-space", advice: "put it on a static or kinematic body" })
    }

    fn inner_ball(&self) -> (Vec3, Real) {
        (Vec3::ZERO, 0.0)
    }

    fn reach_from(&self, _: Vec3) -> Real {
        ENDLESS
    }

    fn cast_ray(&self, ray: &Ray) -> Option<ShapeHit> {
        let (height, rate) = (ray.origin.y, ray.direction.y);
        if height < 0.0 {
            return Some(ShapeHit { fraction: 0.0, normal: Vec3::ZERO });
        }
        let fraction = height / -rate;
        let hits = rate < 0.0 && fraction <= ray.max_fraction;
        hits.then_some(ShapeHit { fraction, normal: Vec3::Y })
    }
}
