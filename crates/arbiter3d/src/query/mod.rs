//! Questions about shapes that do not change them: rays, casts of shapes, overlaps, distances.
//!
//! What a shape is made of is known in one place ([`parts`]); the kinds of shapes have ray
//! casts of their own (`shape::ray`). The world (`world::queries`) finds the shapes that may matter and asks here about each.

pub(crate) mod cast;
pub(crate) mod pair;
pub(crate) mod parts;
pub(crate) mod ray;

pub use cast::ShapeCast;
pub use pair::{ShapeDistance, distance, overlaps};
