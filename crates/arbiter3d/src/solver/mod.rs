//! The solver: coloured wide rows, soft steps, integration. It knows arbiters and bodies' masses, not shapes.

mod bodies;
mod coloring;
mod deal;
mod integrate;
mod lanes;
mod prepare;
mod rows;
mod solve;

pub(crate) use bodies::{BodyMass, BodyMotion, BodyState, SolverBodies};
pub(crate) use coloring::{RowPart, RowPlan};
pub(crate) use integrate::{IntegrateParameters, IntegrateTarget, Integration};
pub(crate) use lanes::{ContactSolver, Pass, StoreTarget, contact_solver};
pub(crate) use prepare::PrepareContext;
pub(crate) use solve::{PassParameters, Softness, SquareScale};
