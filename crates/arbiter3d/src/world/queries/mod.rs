//! Questions to the world: rays, casts of shapes, overlaps, distances, contacts.
//!
//! The broad phase finds the shapes whose boxes may matter, nearest first where there is such an order, and `query`
//! asks each of them. Answers do not depend on the order of the trees: hits at the same fraction, or shapes at the same
//! distance, come in the order of their ids. Nothing here changes the world, so any number of threads may ask at once.

mod batch;
mod casts;
mod contacts;
mod context;
mod filter;
mod nearest;
mod overlaps;
mod rays;

pub use casts::CastHit;
pub use contacts::ShapeContacts;
pub use filter::{BodyKinds, QueryFilter, ShapePredicate};
pub use nearest::PointHit;
pub use rays::RayHit;

use super::World;
use super::definition::Material;
use crate::error::{Error, finite_vec};
use crate::math::{Pose, Real, Vec3};

impl World {
    /// Pose of a shape's frame in the world.
    fn placed(&self, slot: u32) -> Pose {
        let shape = &self.shapes[slot as usize];
        self.bodies[shape.body as usize].pose.mul(&shape.pose)
    }

    /// What the surface of a shape is made of at a part of it: child and triangle, a point there and its normal in the world.
    fn material_at(&self, slot: u32, part: (Option<u32>, Option<u32>), (point, normal): (Vec3, Vec3)) -> Material {
        let (shape, placed) = (&self.shapes[slot as usize], self.placed(slot));
        let there = (placed.inverse_transform_point(point), placed.rotation.inverse_rotate(normal));
        *shape.surface(shape.geometry.part_material(part, there))
    }
}

/// A pose from the API: finite, with a rotation of unit length.
fn checked_pose(what: &'static str, pose: &Pose) -> Result<Pose, Error> {
    let position = finite_vec(what, pose.position)?;
    let rotation = crate::error::unit_rotation(what, pose.rotation.to_quat())?;
    Ok(Pose::new(position, rotation))
}

/// A length from the API: zero or more, may be infinite.
fn checked_reach(what: &'static str, value: Real) -> Result<Real, Error> {
    crate::error::in_range(what, value, 0.0, Real::INFINITY)
}
