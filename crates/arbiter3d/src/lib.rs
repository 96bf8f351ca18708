//! Arbiter: 3D rigid-body physics whose contacts live in open arbiters.

pub mod math;
pub mod narrow_phase;
mod shape;

pub use shape::{
    Capsule, ConvexHull, Cuboid, HalfEdge, MassProperties, MeshEdge, MeshNode, MeshRayHit, MeshSides, Plane, Shape,
    ShapeError, Sphere, TriangleMesh,
};
