//! arbiter3d, through its public interface.

use super::{Ask, Engine, State};
use crate::memory;
use crate::queries::{BALL, BOX, tilt};
use crate::scene::{Body, Scene};
use arbiter3d::math::{Pose, Real, Rotation, Vec3};
use arbiter3d::{BodyId, QueryFilter, Shape, ShapeCast, World, WorldSettings};
use std::collections::HashMap;
use std::sync::Arc;

/// A world of this project's.
pub struct Arbiter {
    world: World,
    bodies: Vec<BodyId>,
    copies: Copies,
    /// The ball and the box that are cast.
    probes: [Shape; 2],
}

impl Arbiter {
    /// Builds the scene.
    pub fn new(scene: &Scene, threads: usize) -> Result<Self, String> {
        let settings = WorldSettings { threads, simd: None, ..scene.settings };
        let world = World::new(settings).map_err(|error| error.to_string())?;
        let probes = [Shape::sphere(BALL), Shape::cuboid(BOX)].map(|shape| shape.map_err(|error| error.to_string()));
        let [ball, cuboid] = probes;
        let bodies = Vec::with_capacity(scene.bodies.len());
        let mut engine = Self { world, bodies, copies: Copies::default(), probes: [ball?, cuboid?] };
        scene.bodies.iter().try_for_each(|body| engine.spawn(body))?;
        Ok(engine)
    }

    /// The world itself.
    #[cfg(test)]
    pub fn world(&self) -> &World {
        &self.world
    }

    fn add(&mut self, body: &Body) -> Result<BodyId, arbiter3d::Error> {
        let id = if body.is_world { BodyId::WORLD } else { self.world.add_body(&body.definition)? };
        for shape in &body.shapes {
            let definition = arbiter3d::ShapeDefinition { shape: self.copies.of(&shape.shape), ..shape.clone() };
            self.world.add_shape(id, &definition)?;
        }
        Ok(id)
    }
}

impl Engine for Arbiter {
    fn step(&mut self, dt: Real) -> Result<(), String> {
        let report = self.world.step(dt).map_err(|error| error.to_string())?;
        if report.frozen.is_empty() { Ok(()) } else { Err(format!("{} bodies went non-finite", report.frozen.len())) }
    }

    fn spawn(&mut self, body: &Body) -> Result<(), String> {
        let id = self.add(body).map_err(|error| error.to_string())?;
        self.bodies.push(id);
        Ok(())
    }

    fn remove(&mut self, body: usize) {
        self.world.remove_body(self.bodies[body]).expect("a body that is removed once");
    }

    fn set_velocity(&mut self, body: usize, linear: Vec3, angular: Vec3) {
        let mut body = self.world.body_mut(self.bodies[body]).expect("a body that lives");
        body.set_linear_velocity(linear).expect("a finite velocity");
        body.set_angular_velocity(angular).expect("a finite velocity");
    }

    fn state(&self, body: usize) -> Option<State> {
        self.world.body(self.bodies[body]).map(|body| State {
            position: body.position(),
            rotation: body.rotation(),
            linear_velocity: body.linear_velocity(),
            angular_velocity: body.angular_velocity(),
            awake: body.is_awake(),
        })
    }

    fn contacts(&self) -> Option<usize> {
        Some(self.world.contact_count())
    }

    fn bytes(&self) -> Option<isize> {
        Some(memory::held())
    }
}

/// Own copies of hulls and meshes, each made once, so that their memory counts as the engine's.
#[derive(Default)]
struct Copies(HashMap<usize, Shape>);

impl Copies {
    fn of(&mut self, shape: &Shape) -> Shape {
        match shape {
            Shape::Hull(hull) => {
                let copy = || Shape::Hull(Arc::new(hull.as_ref().clone()));
                self.0.entry(Arc::as_ptr(hull) as usize).or_insert_with(copy).clone()
            }
            Shape::Mesh(mesh) => {
                let copy = || Shape::Mesh(Arc::new(mesh.as_ref().clone()));
                self.0.entry(Arc::as_ptr(mesh) as usize).or_insert_with(copy).clone()
            }
            other => other.clone(),
        }
    }
}

impl Ask for Arbiter {
    fn ray(&self, origin: Vec3, way: Vec3) -> Option<Real> {
        self.world.cast_ray(origin, way, 1.0, &QueryFilter::default()).ok()?.map(|hit| hit.fraction)
    }

    fn ball(&self, origin: Vec3, way: Vec3) -> Option<Real> {
        let start = Pose::from_position(origin);
        let cast = ShapeCast::along(&self.probes[0], start, way);
        self.world.cast_shape(&cast, &QueryFilter::default()).ok()?.map(|hit| hit.fraction)
    }

    fn cuboid(&self, origin: Vec3, way: Vec3) -> Option<Real> {
        let start = Pose::new(origin, Rotation::from_quat(tilt()));
        let cast = ShapeCast::along(&self.probes[1], start, way);
        self.world.cast_shape(&cast, &QueryFilter::default()).ok()?.map(|hit| hit.fraction)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use arbiter3d::BodyKind;
    use arbiter3d_scenes::{SceneOptions, find};

    /// Steps a scene itself and what was read of it side by side, and shows both to `compare` after each step.
    fn side_by_side(name: &str, size: usize, compare: impl Fn(&World, &World, usize)) {
        let build = || {
            let options = SceneOptions { size: Some(size), ..SceneOptions::default() };
            find(name).unwrap().build(&options).unwrap()
        };
        let steps = 40;
        let mut original = build();
        let scene = Scene::read(build(), steps).unwrap();
        let mut copy = Arbiter::new(&scene, 1).unwrap();
        for step in 0..steps {
            original.step(step).unwrap();
            for (_, change) in scene.script.iter().filter(|(at, _)| *at == step) {
                copy.apply(change).unwrap();
            }
            copy.step(scene.dt).unwrap();
            compare(&original.world, copy.world(), step);
        }
    }

    /// A scene that was read and built anew steps to the same bits as the scene itself.
    #[test]
    fn nothing_is_lost_in_reading() {
        let sizes = [("large_pyramid", 6), ("trees100", 3), ("mesh_rain10k", 100), ("large_world", 12), ("washer", 3)];
        for (name, size) in sizes.into_iter().chain([("sleeping_field", 50), ("convex_vs_mesh", 1)]) {
            side_by_side(name, size, |original, copy, step| {
                assert_eq!(copy.hash(), original.hash(), "{name} differs after step {step}");
            });
        }
    }

    /// The pillar of the junkyard, which steers by where it is, follows its script to rounding.
    #[test]
    fn a_steered_body_follows_its_script() {
        let pillar = |world: &World| {
            let kinematic = |id: &BodyId| world.body(*id).unwrap().kind() == BodyKind::Kinematic;
            world.body(world.bodies().find(kinematic).unwrap()).unwrap().position()
        };
        side_by_side("junkyard", 1, |original, copy, step| {
            let [a, b] = [original, copy].map(pillar);
            assert!((a - b).length() < 1e-4, "step {step}: {a} and {b}");
            assert!(step < 20 || a.z < -1.0, "step {step}: {a} has hardly moved");
        });
    }
}
