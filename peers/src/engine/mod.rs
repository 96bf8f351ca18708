//! The engines behind one small interface.
//!
//! An engine builds a scene through its own public interface with its own defaults (four substeps where it has them); what a
//! scene sets (gravity, step, density, friction, restitution, rolling resistance, locks, filters, sleep) it takes over.

mod arbiter;
mod box3d;
#[cfg(feature = "jolt")]
mod jolt;
mod rapier;

use crate::scene::{Body, Change, Scene};
use arbiter3d::math::{Quat, Real, Vec3};

/// Which engine.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Kind {
    /// This project's.
    Arbiter,
    /// Box3D, in C.
    Box3d,
    /// Rapier, in Rust.
    Rapier,
    /// Jolt, in C++.
    Jolt,
}

impl Kind {
    /// All of them, in the order in which they are shown.
    pub const ALL: [Self; 4] = [Self::Arbiter, Self::Box3d, Self::Rapier, Self::Jolt];

    /// What it is called on the command line and in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Arbiter => "arbiter3d",
            Self::Box3d => "box3d",
            Self::Rapier => "rapier",
            Self::Jolt => "jolt",
        }
    }

    /// The engine of this name.
    pub fn find(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }

    /// Whether this program was built with it.
    pub fn is_built_in(self) -> bool {
        self != Self::Jolt || cfg!(feature = "jolt")
    }
}

/// Where a body is and how it moves.
#[derive(Clone, Copy, Debug)]
pub struct State {
    /// Origin of the body's frame.
    pub position: Vec3,
    /// From body to world.
    pub rotation: Quat,
    /// Of the centre of mass.
    pub linear_velocity: Vec3,
    /// About world axes.
    pub angular_velocity: Vec3,
    /// Whether it is simulated.
    pub awake: bool,
}

/// A world of some engine, built from a scene. Bodies have the indices of [`Scene::all_bodies`].
pub trait Engine {
    /// Takes one step.
    fn step(&mut self, dt: Real) -> Result<(), String>;
    /// Adds a body; it gets the next index.
    fn spawn(&mut self, body: &Body) -> Result<(), String>;
    /// Removes a body.
    fn remove(&mut self, body: usize);
    /// Gives a body velocities.
    fn set_velocity(&mut self, body: usize, linear: Vec3, angular: Vec3);
    /// Where a body is; `None` if it was removed.
    fn state(&self, body: usize) -> Option<State>;
    /// Contact points or contacts, as the engine itself counts them.
    fn contacts(&self) -> Option<usize>;
    /// Bytes that all worlds of this engine hold, if it can tell.
    fn bytes(&self) -> Option<isize>;

    /// Makes a change of the scene's script.
    fn apply(&mut self, change: &Change) -> Result<(), String> {
        match change {
            Change::Spawn(body) => return self.spawn(body),
            Change::Remove(index) => self.remove(*index),
            Change::Velocity(index, linear, angular) => self.set_velocity(*index, *linear, *angular),
        }
        Ok(())
    }
}

/// A world that can be asked for the closest hit: the share of the way, from 0 to 1.
pub trait Ask {
    /// Of a ray.
    fn ray(&self, origin: Vec3, way: Vec3) -> Option<Real>;
    /// Of a moving ball of radius [`BALL`](crate::queries::BALL).
    fn ball(&self, origin: Vec3, way: Vec3) -> Option<Real>;
    /// Of a moving box of half extents [`BOX`](crate::queries::BOX), turned by [`tilt`](crate::queries::tilt).
    fn cuboid(&self, origin: Vec3, way: Vec3) -> Option<Real>;
}

/// A fresh world of an engine to ask, stepped once so that it is ready; `None` where this program cannot ask the engine.
pub fn ask(kind: Kind, scene: &Scene) -> Option<Box<dyn Ask>> {
    fn ready<E: Engine + Ask + 'static>(engine: Result<E, String>, scene: &Scene) -> Option<Box<dyn Ask>> {
        let mut engine = engine.ok()?;
        engine.step(scene.dt).ok()?;
        Some(Box::new(engine))
    }
    match kind {
        Kind::Arbiter => ready(arbiter::Arbiter::new(scene, 1), scene),
        Kind::Box3d => ready(box3d::Box3d::new(scene, 1), scene),
        Kind::Rapier => ready(rapier::Rapier::new(scene, 1), scene),
        Kind::Jolt => None,
    }
}

/// Why an engine cannot express a scene, if it cannot.
pub fn unsupported(kind: Kind, scene: &Scene) -> Option<String> {
    scene.all_bodies().find_map(|body| match kind {
        Kind::Arbiter => None,
        Kind::Box3d => box3d::unsupported(body),
        Kind::Rapier => rapier::unsupported(body),
        #[cfg(feature = "jolt")]
        Kind::Jolt => jolt::unsupported(body),
        #[cfg(not(feature = "jolt"))]
        Kind::Jolt => Some("built without the feature `jolt`".into()),
    })
}

/// A fresh world of an engine with everything that the scene has at its start.
pub fn build(kind: Kind, scene: &Scene, threads: usize) -> Result<Box<dyn Engine>, String> {
    Ok(match kind {
        Kind::Arbiter => Box::new(arbiter::Arbiter::new(scene, threads)?),
        Kind::Box3d => Box::new(box3d::Box3d::new(scene, threads)?),
        Kind::Rapier => Box::new(rapier::Rapier::new(scene, threads)?),
        #[cfg(feature = "jolt")]
        Kind::Jolt => Box::new(jolt::Jolt::new(scene, threads)?),
        #[cfg(not(feature = "jolt"))]
        Kind::Jolt => return Err("built without the feature `jolt`".into()),
    })
}

/// What no peer's interface takes: given masses, sensors, conveyors, disabled bodies.
fn beyond_peers(body: &Body) -> Option<String> {
    let definition = &body.definition;
    let belt = |shape: &arbiter3d::ShapeDefinition| shape.material.tangent_velocity != Vec3::ZERO;
    if definition.mass.is_some() {
        Some("a body whose mass is given".into())
    } else if !definition.enabled {
        Some("a disabled body".into())
    } else if body.shapes.iter().any(|shape| shape.sensor || belt(shape)) {
        Some("sensors or conveyor belts".into())
    } else {
        None
    }
}

/// The rolling resistance to hand over: for polyhedra ours counts only where it was set above the default.
fn rolling_resistance(shape: &arbiter3d::ShapeDefinition) -> Real {
    let set = shape.material.rolling_resistance > arbiter3d::Material::DEFAULT_ROLLING_RESISTANCE;
    if set || shape.shape.rounding_radius() > 0.0 { shape.material.rolling_resistance } else { 0.0 }
}
