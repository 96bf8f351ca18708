//! Questions about shapes that do not change them: rays.

pub mod ray;

pub use ray::{Ray, ShapeHit, cast_ray};
