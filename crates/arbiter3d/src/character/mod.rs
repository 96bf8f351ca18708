//! Characters: shapes that go where they are told, and no farther than the world lets them.
//!
//! A character is not a rigid body: it does not tumble, it climbs stairs, and it stands still on a slope. So it is
//! moved by hand, with questions to the world. The parts stand for themselves, to build movers of one's own: planes
//! around a shape and the way that respects them all ([`solve_planes`]), sliding, steps, ground ([`ShapeMover`]).
//! [`CharacterController`] puts them together.

mod controller;
mod mover;
mod planes;

pub use controller::{CharacterController, CharacterSettings};
pub use mover::{ContactPlane, Ground, ShapeMover, SlideResult};
pub use planes::{PlaneLimit, PlaneSolution, solve_planes};
