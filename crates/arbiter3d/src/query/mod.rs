//! Questions about shapes that do not change them: rays, casts of shapes, overlaps, distances.
//!
//! What a shape is made of is known in one place ([`parts`]); rays have kernels of their own ([`ray`]) for the kinds
//! that allow it. The world (`world::queries`) finds the shapes that may matter and asks here about each.

pub(crate) mod cast;
mod convex_ray;
pub(crate) mod pair;
pub(crate) mod parts;
pub mod ray;

pub use cast::ShapeCast;
pub(crate) use convex_ray::{cast_cone, cast_cylinder, cast_support};
pub use pair::{ShapeDistance, distance, overlaps};
pub(crate) use ray::cast_placed;
pub use ray::{Ray, ShapeHit, cast_ray};
pub(crate) use ray::{cast_capsule, cast_cuboid, cast_planes, cast_sphere};
