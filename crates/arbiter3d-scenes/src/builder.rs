//! What all scenes share: options, a world under construction and short verbs to fill it.

use crate::{BeforeStep, BuiltScene, Random};
use arbiter3d::{
    BodyDefinition, BodyId, Error, Shape, ShapeDefinition, SimdLevel, World, WorldSettings,
    math::{Real, Vec3},
};

/// How a scene is to be built. The default is the scene as published, on one thread.
///
/// ```
/// use arbiter3d_scenes::SceneOptions;
/// let options = SceneOptions { threads: 2, substeps: Some(8), ..SceneOptions::default() };
/// assert_eq!(options.seed, 0);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct SceneOptions {
    /// 0 builds the scene exactly as published; another number reshuffles whatever in it is random: hulls made from random
    /// points, scattered positions. A scene with nothing random in it ignores the seed. Default 0.
    pub seed: u64,
    /// Threads that step the world. Default 1.
    pub threads: usize,
    /// Instruction set; `None` takes the best there is. Default `None`.
    pub simd: Option<SimdLevel>,
    /// Solver slices of a step; `None` takes the scene's own. Default `None`.
    pub substeps: Option<u32>,
    /// Steps a second; `None` takes the scene's own. Default `None`.
    pub hz: Option<Real>,
    /// The number that scales the scene (rows of a pyramid, layers of a pile: see [`crate::Scene::size`]);
    /// `None` takes the scene's own. Default `None`.
    pub size: Option<usize>,
}

impl Default for SceneOptions {
    fn default() -> Self {
        Self { seed: 0, threads: 1, simd: None, substeps: None, hz: None, size: None }
    }
}

/// Friction of the scenes that come from Box3D, whose default it is.
pub(crate) const BOX3D_FRICTION: Real = 0.6;

/// A world that a scene fills.
pub(crate) struct Builder {
    pub world: World,
    pub hz: Real,
    /// The scale.
    pub size: usize,
    seed: u64,
}

impl Builder {
    /// An empty world with the engine's settings.
    pub fn new(options: &SceneOptions, size: usize) -> Result<Self, Error> {
        Self::with_settings(options, size, WorldSettings::default())
    }

    /// An empty world with settings of the scene's own, on which the options have the last word.
    pub fn with_settings(options: &SceneOptions, size: usize, settings: WorldSettings) -> Result<Self, Error> {
        let hz = options.hz.unwrap_or(60.0);
        let substeps = options.substeps.unwrap_or(settings.substeps);
        let settings = WorldSettings { threads: options.threads, simd: options.simd, substeps, ..settings };
        Ok(Self { world: World::new(settings)?, hz, size, seed: options.seed })
    }

    /// An empty world whose bodies never sleep.
    pub fn sleepless(options: &SceneOptions, size: usize) -> Result<Self, Error> {
        Self::with_settings(options, size, WorldSettings { allow_sleep: false, ..WorldSettings::default() })
    }

    /// The scene's random numbers: the published stream unless a seed was given.
    pub fn random(&self, published: u32) -> Random {
        Random::for_scene(published, self.seed)
    }

    /// Scatter for scenes that are published as regular grids: zero for seed 0, else up to `half_width` a coordinate.
    pub fn scatter(&self, half_width: Real) -> impl FnMut() -> Vec3 + use<> {
        let (mut random, amount) = (self.random(1), if self.seed == 0 { 0.0 } else { half_width });
        move || random.in_cube(amount)
    }

    /// Adds a body with one shape.
    pub fn add(&mut self, body: &BodyDefinition, shape: &ShapeDefinition) -> Result<BodyId, Error> {
        let id = self.world.add_body(body)?;
        self.world.add_shape(id, shape)?;
        Ok(id)
    }

    /// Adds a dynamic body with one shape.
    pub fn drop(&mut self, position: Vec3, shape: &ShapeDefinition) -> Result<BodyId, Error> {
        self.add(&BodyDefinition::dynamic().at(position), shape)
    }

    /// Adds a static box whose top is at y = 0.
    pub fn ground(&mut self, half_extents: Vec3) -> Result<BodyId, Error> {
        let body = BodyDefinition::fixed().at(Vec3::new(0.0, -half_extents.y, 0.0));
        self.add(&body, &cuboid(half_extents)?)
    }

    /// Adds a static mesh at the origin.
    pub fn mesh(&mut self, mesh: crate::meshes::MeshData) -> Result<BodyId, Error> {
        self.add(&BodyDefinition::fixed(), &plain(Shape::mesh(mesh.0, mesh.1)?))
    }

    /// The scene, to be run for `steps` steps.
    pub fn finish(self, steps: usize) -> Result<BuiltScene, Error> {
        Ok(BuiltScene { world: self.world, steps, hz: self.hz, before_step: None })
    }

    /// The scene with something to do before each step.
    pub fn finish_with(self, steps: usize, hook: BeforeStep) -> Result<BuiltScene, Error> {
        Ok(BuiltScene { world: self.world, steps, hz: self.hz, before_step: Some(hook) })
    }
}

/// A shape with the friction of Box3D's scenes.
pub(crate) fn plain(shape: Shape) -> ShapeDefinition {
    ShapeDefinition::new(shape).friction(BOX3D_FRICTION)
}

/// A box with the friction of Box3D's scenes.
pub(crate) fn cuboid(half_extents: Vec3) -> Result<ShapeDefinition, Error> {
    Ok(plain(Shape::cuboid(half_extents)?))
}

/// Four kinds of small bodies in turn: a box, a ball, a capsule and a rock of 20 points.
pub(crate) struct Mixed([ShapeDefinition; 4]);

impl Mixed {
    pub fn new(random: &mut Random) -> Result<Self, Error> {
        Ok(Self([
            cuboid(Vec3::new(0.4, 0.3, 0.5))?,
            plain(Shape::sphere(0.45)?),
            plain(Shape::capsule(0.4, 0.3)?),
            plain(Shape::hull(&random.points_on_sphere(20, 0.5))?),
        ]))
    }

    /// The same with balls and capsules that come to rest: without it they roll about for minutes.
    pub fn resisting_to_roll(mut self) -> Self {
        self.0.iter_mut().for_each(|shape| shape.material.rolling_resistance = 0.05);
        self
    }

    pub fn get(&self, index: usize) -> &ShapeDefinition {
        &self.0[index % 4]
    }
}
