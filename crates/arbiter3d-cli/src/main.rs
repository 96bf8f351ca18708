//! The `arbiter3d` command.

fn main() {}
