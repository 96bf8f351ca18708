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
mod buoyancy;
mod character;
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
#[cfg(test)]
mod random;
mod shape;
mod simd;
mod solver;
mod storage;
mod vehicle;
mod world;

pub use arbiter::{Arbiter, ArbiterId, ArbiterKey, Contact, ContactData, ContactPoint, EndReason, SolveMode};
pub use buoyancy::{FluidDefinition, FluidSurface, FluidVolume, Submersion};
pub use character::{
    CharacterController, CharacterSettings, ContactPlane, Ground, PlaneLimit, PlaneSolution, ShapeMover, SlideResult,
    solve_planes,
};
pub use query::{ShapeCast, ShapeDistance, distance, overlaps};
#[cfg(feature = "decomposition")]
pub use shape::DecompositionSettings;
pub use shape::{
    Capsule, Compound, CompoundChild, Cone, ConvexHull, ConvexShape, Cuboid, Custom, Cylinder, FieldDiagonals,
    FieldSide, HalfEdge, HalfSpace, HeightField, MassProperties, MeshRayHit, MeshSides, Plane, PointCloud, Ray,
    Rounded, Shape, ShapeError, ShapeHit, Sphere, TaperedCapsule, Transformed, Triangle, TriangleMesh, VoxelGrid,
    cast_ray,
};
pub use simd::{SimdLevel, UnknownSimdLevel};
pub use vehicle::{
    AntiRollBar, Suspension, Tyre, Vehicle, VehicleControls, VehicleDefinition, WheelContact, WheelDefinition,
    WheelState,
};
pub use world::{
    Anisotropy, BeginEvent, BeginListener, BodyDefinition, BodyId, BodyKind, BodyKinds, BodyMut, BodyRef, CastHit,
    CombineRule, ContactEvents, ContactFilter, ContactProvider, EndEvent, EndListener, Error, Filter, HitEvent,
    HitListener, Impact, LockedAxes, Material, PairFilter, PersistEvent, Phase, PointHit, PreSolveListener,
    QueryFilter, RayHit, SensorEvent, ShapeContacts, ShapeDefinition, ShapeId, ShapeMut, ShapePair, ShapePredicate,
    ShapeRef, StepContext, StepReport, Timings, UNIT_TOLERANCE, World, WorldSettings,
};
