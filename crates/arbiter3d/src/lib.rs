//! Arbiter: 3D rigid-body physics whose contacts live in open arbiters.
//!
//! Build a [`World`], add bodies and shapes, and step it:
//!
//! ```
//! use arbiter3d::{BodyDefinition, BodyId, Shape, ShapeDefinition, World, math::Vec3};
//!
//! let mut world = World::default();
//! let ground = Shape::cuboid(Vec3::new(50.0, 1.0, 50.0))?;
//! world.add_shape(BodyId::WORLD, &ShapeDefinition::new(ground).at(Vec3::new(0.0, -1.0, 0.0)))?;
//!
//! let block = world.add_body(&BodyDefinition::dynamic().at(Vec3::new(0.0, 2.0, 0.0)))?;
//! world.add_shape(block, &ShapeDefinition::new(Shape::cuboid(Vec3::splat(0.5))?))?;
//!
//! for _ in 0..120 {
//!     world.step(1.0 / 60.0)?;
//! }
//! assert!((world.body(block).unwrap().position().y - 0.5).abs() < 0.01);
//! # Ok::<(), arbiter3d::Error>(())
//! ```
//!
//! What touches has an [`Arbiter`]: read it, edit it, make your own, and feed it contacts from any collision system of yours
//! (see [`ContactProvider`]). The step gives the same bits for any number of threads and any [`SimdLevel`].

mod arbiter;
mod broad_phase;
mod edge_lists;
mod error;
#[cfg(doctest)]
mod guide;
mod id;
mod island;
pub mod math;
pub mod narrow_phase;
mod parallel;
mod place_table;
mod query;
mod shape;
mod simd;
mod solver;
mod storage;
mod world;

pub use arbiter::{Arbiter, ArbiterId, ArbiterKey, Contact, ContactData, ContactPoint, EndReason, SolveMode};
pub use query::{Ray, ShapeCast, ShapeDistance, ShapeHit, cast_ray, distance, overlaps};
pub use shape::{
    Capsule, Cone, ConvexHull, ConvexShape, Cuboid, Custom, Cylinder, HalfEdge, HalfSpace, MassProperties, MeshRayHit,
    MeshSides, Plane, PointCloud, Rounded, Shape, ShapeError, Sphere, TaperedCapsule, Transformed, Triangle,
    TriangleMesh,
};
pub use simd::{SimdLevel, UnknownSimdLevel};
pub use world::{
    Anisotropy, BeginEvent, BeginListener, BodyDefinition, BodyId, BodyKind, BodyKinds, BodyMut, BodyRef, CastHit,
    CombineRule, ContactEvents, ContactFilter, ContactProvider, EndEvent, EndListener, Error, Filter, HitEvent,
    HitListener, Impact, LockedAxes, Material, PairFilter, PersistEvent, Phase, PointHit, PreSolveListener,
    QueryFilter, RayHit, SensorEvent, ShapeContacts, ShapeDefinition, ShapeId, ShapeMut, ShapePair, ShapePredicate,
    ShapeRef, StepContext, StepReport, Timings, UNIT_TOLERANCE, World, WorldSettings,
};
