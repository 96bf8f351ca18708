//! Named scenes for the `arbiter3d` engine, built through its public API alone.
//!
//! Tests, benchmarks and tools all take their scenes from here, so that "large_pyramid" means the same bodies everywhere.
//! The numbers are those that other engines publish for their own scenes, so that times can be set side by side; each
//! scene's function names where its numbers come from. Units are metres, kilograms and seconds, +y is up.
//!
//! Every coordinate comes from IEEE arithmetic and the `libm` crate, never from the platform's sine, so a scene has the
//! same bits on every machine.
//!
//! ```
//! use arbiter3d_scenes::{SceneOptions, find};
//! let scene = find("bounce").expect("a registered name");
//! let mut built = scene.build(&SceneOptions::default())?;
//! for step in 0..10 {
//!     built.step(step)?;
//! }
//! # Ok::<(), arbiter3d::Error>(())
//! ```

mod builder;
mod random;
mod registry;
mod scenes;

pub mod meshes;
pub mod turns;

pub use builder::SceneOptions;
pub use random::Random;
pub use registry::{SCENES, Scene, Size, find, nearest};

use arbiter3d::{Error, StepReport, World, math::Real};

/// What a scene does before each step: it gets the index of the step about to be taken, from zero.
pub type BeforeStep = Box<dyn FnMut(usize, &mut World) -> Result<(), Error> + Send>;

/// A scene ready to be stepped.
///
/// ```
/// use arbiter3d_scenes::{SceneOptions, find};
/// let built = find("large_pyramid").unwrap().build(&SceneOptions { size: Some(10), ..Default::default() })?;
/// assert_eq!(built.world.bodies().count(), 1 + 1 + 55); // the world's own body, the ground, the cubes
/// # Ok::<(), arbiter3d::Error>(())
/// ```
pub struct BuiltScene {
    /// The world with all bodies of the start.
    pub world: World,
    /// How many steps the scene is meant to be run for.
    pub steps: usize,
    /// Steps a second.
    pub hz: Real,
    /// What to do before each step, if anything. [`BuiltScene::step`] calls it.
    pub before_step: Option<BeforeStep>,
}

impl BuiltScene {
    /// Length of a step, seconds.
    #[must_use]
    pub fn dt(&self) -> Real {
        1.0 / self.hz
    }

    /// What has to happen before step `index` (from zero): spawns a body, steers a pusher, or nothing.
    ///
    /// # Errors
    /// If the engine refuses what the scene asks for.
    pub fn prepare_step(&mut self, index: usize) -> Result<(), Error> {
        match &mut self.before_step {
            Some(hook) => hook(index, &mut self.world),
            None => Ok(()),
        }
    }

    /// Prepares and takes step `index` (from zero).
    ///
    /// # Errors
    /// If the engine refuses what the scene asks for.
    pub fn step(&mut self, index: usize) -> Result<StepReport, Error> {
        self.prepare_step(index)?;
        self.world.step(self.dt())
    }
}
