//! Arbiter: 3D rigid-body physics whose contacts live in open arbiters.

#[allow(dead_code, unused_imports, reason = "the world is about to use it")]
mod broad_phase;
pub mod math;
pub mod narrow_phase;
mod query;
mod shape;

pub use query::{Ray, ShapeHit, cast_ray};
pub use shape::{
    Capsule, ConvexHull, Cuboid, HalfEdge, MassProperties, MeshEdge, MeshNode, MeshRayHit, MeshSides, Plane, Shape,
    ShapeError, Sphere, TriangleMesh,
};
