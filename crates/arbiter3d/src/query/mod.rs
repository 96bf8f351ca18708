//! Questions about shapes that do not change them: rays.

mod convex_ray;
pub mod ray;

pub(crate) use convex_ray::{cast_cone, cast_cylinder, cast_support};
pub(crate) use ray::{cast_capsule, cast_cuboid, cast_planes, cast_sphere};

pub use ray::{Ray, ShapeHit, cast_ray};
