//! The parts of the `arbiter3d` command that can be used and tested on their own.

pub mod replay;
