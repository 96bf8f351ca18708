//! Rapier, through its public interface, on a thread pool of its own.

use super::{Ask, Engine, State, beyond_peers};
use crate::memory;
use crate::queries::{BALL, BOX, tilt};
use crate::scene::{Body, Scene};
use arbiter3d::math::{Quat, Real, Vec3};
use arbiter3d::{BodyKind, CombineRule, Shape, ShapeDefinition, WorldSettings};
use rapier3d::parry::query::ShapeCastOptions;
use rapier3d::parry::utils::Array2;
use rapier3d::prelude::*;
use std::collections::HashMap;
use std::sync::Arc;

/// A world of Rapier's.
pub struct Rapier {
    world: PhysicsWorld,
    bodies: Vec<RigidBodyHandle>,
    /// Hulls and meshes, shared.
    shapes: HashMap<usize, SharedShape>,
    allow_sleep: bool,
    sleep_speed: Option<Real>,
}

/// Why Rapier cannot have this body, if it cannot.
pub fn unsupported(body: &Body) -> Option<String> {
    let wide = |shape: &ShapeDefinition| shape.filter.category >> 32 != 0;
    if body.shapes.iter().any(|shape| wide(shape) || shape.filter.group != 0) {
        return Some("filters of 64 bits or with groups".into());
    }
    beyond_peers(body)
}

/// Steps within which what starts asleep must have fallen asleep.
const SETTLE: usize = 240;

fn vec(v: Vec3) -> Vector {
    Vector::new(v.x, v.y, v.z)
}

fn unvec(v: Vector) -> Vec3 {
    Vec3::new(v.x, v.y, v.z)
}

fn pose(position: Vec3, rotation: Quat) -> Pose {
    Pose::from_parts(vec(position), Rotation::from_xyzw(rotation.x, rotation.y, rotation.z, rotation.w))
}

fn rule(rule: CombineRule) -> CoefficientCombineRule {
    match rule {
        CombineRule::Maximum => CoefficientCombineRule::Max,
        CombineRule::Average => CoefficientCombineRule::Average,
        CombineRule::GeometricMean => CoefficientCombineRule::GeometricMean,
        CombineRule::Multiply => CoefficientCombineRule::Multiply,
        CombineRule::Minimum => CoefficientCombineRule::Min,
    }
}

impl Rapier {
    /// Builds the scene.
    pub fn new(scene: &Scene, threads: usize) -> Result<Self, String> {
        let mut world = PhysicsWorld::new();
        world.gravity = vec(scene.settings.gravity);
        world.configure_thread_pool(threads).map_err(|error| error.to_string())?;
        // Our default threshold is also theirs; a scene's own is handed over.
        let default = WorldSettings::default().sleep_speed;
        let sleep_speed = Some(scene.settings.sleep_speed).filter(|&speed| speed != default);
        let mut engine = Self {
            world,
            bodies: Vec::new(),
            shapes: HashMap::new(),
            allow_sleep: scene.settings.allow_sleep,
            sleep_speed,
        };
        engine.fill(scene)?;
        Ok(engine)
    }

    /// Adds the bodies of the scene. Rapier wakes bodies when their first contacts are found, also those inserted asleep; so
    /// what starts asleep is put on the ground first and stepped until it sleeps, before anything else is there.
    fn fill(&mut self, scene: &Scene) -> Result<(), String> {
        let asleep = |body: &Body| !body.definition.awake && body.definition.kind == BodyKind::Dynamic;
        let any_asleep = scene.bodies.iter().any(asleep);
        let early = |body: &Body| !any_asleep || body.definition.kind == BodyKind::Static || asleep(body);
        self.bodies = vec![RigidBodyHandle::invalid(); scene.bodies.len()];
        for (index, body) in scene.bodies.iter().enumerate().filter(|(_, body)| early(body)) {
            self.bodies[index] = self.insert(body)?;
        }
        let mut steps = 0;
        while any_asleep && (steps == 0 || self.world.islands.num_active_bodies() > 0) {
            if steps == SETTLE {
                return Err(format!("bodies that start asleep are not so after {SETTLE} steps"));
            }
            self.step(scene.dt)?;
            steps += 1;
        }
        for (index, body) in scene.bodies.iter().enumerate().filter(|(_, body)| !early(body)) {
            self.bodies[index] = self.insert(body)?;
        }
        Ok(())
    }

    fn insert(&mut self, body: &Body) -> Result<RigidBodyHandle, String> {
        let handle = self.world.insert_body(self.builder(body));
        if let (Some(speed), true) = (self.sleep_speed, body.definition.can_sleep && self.allow_sleep) {
            self.world.bodies[handle].activation_mut().normalized_linear_threshold = speed;
        }
        for shape in &body.shapes {
            let collider = self.collider(shape)?;
            self.world.insert_collider(collider, Some(handle));
        }
        Ok(handle)
    }

    fn builder(&self, body: &Body) -> RigidBodyBuilder {
        let from = &body.definition;
        let builder = match from.kind {
            BodyKind::Static => RigidBodyBuilder::fixed(),
            BodyKind::Kinematic => RigidBodyBuilder::kinematic_velocity_based(),
            BodyKind::Dynamic => RigidBodyBuilder::dynamic(),
        };
        builder
            .pose(pose(from.position, from.rotation))
            .linvel(vec(from.linear_velocity))
            .angvel(vec(from.angular_velocity))
            .linear_damping(from.linear_damping)
            .angular_damping(from.angular_damping)
            .gravity_scale(from.gravity_scale)
            .locked_axes(LockedAxes::from_bits_truncate(from.locked_axes.bits()))
            .can_sleep(from.can_sleep && self.allow_sleep)
            .sleeping(!from.awake)
    }

    fn geometry(&mut self, shape: &Shape) -> Result<SharedShape, String> {
        let failed = |error: &dyn std::fmt::Display| format!("Rapier refuses a mesh: {error}");
        match shape {
            Shape::Sphere(sphere) => Ok(SharedShape::ball(sphere.radius())),
            Shape::Capsule(capsule) => Ok(SharedShape::capsule_y(capsule.half_length(), capsule.radius())),
            Shape::Cuboid(cuboid) => {
                let h = cuboid.half_extents();
                Ok(SharedShape::cuboid(h.x, h.y, h.z))
            }
            Shape::Hull(hull) => {
                let key = Arc::as_ptr(hull) as usize;
                if let Some(shape) = self.shapes.get(&key) {
                    return Ok(shape.clone());
                }
                let points: Vec<Vector> = hull.vertices().iter().map(|&v| vec(v)).collect();
                let shape = SharedShape::convex_hull(&points).ok_or("Rapier refuses a hull")?;
                Ok(self.shapes.entry(key).or_insert(shape).clone())
            }
            Shape::Mesh(mesh) => {
                let key = Arc::as_ptr(mesh) as usize;
                if let Some(shape) = self.shapes.get(&key) {
                    return Ok(shape.clone());
                }
                let vertices = mesh.vertices().iter().map(|&v| vec(v)).collect();
                let shape = SharedShape::trimesh(vertices, mesh.triangles().to_vec()).map_err(|e| failed(&e))?;
                Ok(self.shapes.entry(key).or_insert(shape).clone())
            }
            Shape::HeightField(field) => {
                // Listed column by column there, rows along z.
                let (rows, columns) = (field.rows() + 1, field.columns() + 1);
                let heights = (0..columns * rows).map(|k| field.heights()[k % rows * columns + k / rows]);
                let heights = Array2::new(rows, columns, heights.collect());
                Ok(SharedShape::heightfield(heights, vec(shape.local_aabb().half_extents() * 2.0).with_y(1.0)))
            }
            other => Err(format!("a shape that this program does not know: {other:?}")),
        }
    }

    fn collider(&mut self, shape: &ShapeDefinition) -> Result<ColliderBuilder, String> {
        let group = |bits: u64| Group::from_bits_truncate(bits as u32);
        let filter =
            InteractionGroups::new(group(shape.filter.category), group(shape.filter.mask), InteractionTestMode::And);
        // A height field lies about its middle there.
        let middle = if matches!(shape.shape, Shape::HeightField(_)) {
            shape.shape.local_aabb().center() * Vec3::new(1.0, 0.0, 1.0)
        } else {
            Vec3::ZERO
        };
        let position = shape.position + arbiter3d::math::Rotation::from_quat(shape.rotation).rotate(middle);
        Ok(ColliderBuilder::new(self.geometry(&shape.shape)?)
            .position(pose(position, shape.rotation))
            .density(shape.density)
            .friction(shape.material.friction)
            .friction_combine_rule(rule(shape.material.friction_combine))
            .restitution(shape.material.restitution)
            .restitution_combine_rule(rule(shape.material.restitution_combine))
            .collision_groups(filter))
    }
}

impl Engine for Rapier {
    fn step(&mut self, dt: Real) -> Result<(), String> {
        self.world.integration_parameters.dt = dt;
        self.world.step();
        Ok(())
    }

    fn spawn(&mut self, body: &Body) -> Result<(), String> {
        let handle = self.insert(body)?;
        self.bodies.push(handle);
        Ok(())
    }

    fn remove(&mut self, body: usize) {
        self.world.remove_body(self.bodies[body]);
    }

    fn set_velocity(&mut self, body: usize, linear: Vec3, angular: Vec3) {
        if let Some(body) = self.world.bodies.get_mut(self.bodies[body]) {
            body.set_linvel(vec(linear), true);
            body.set_angvel(vec(angular), true);
        }
    }

    fn state(&self, body: usize) -> Option<State> {
        self.world.bodies.get(self.bodies[body]).map(|body| {
            let q = body.rotation();
            State {
                position: unvec(body.translation()),
                rotation: Quat::from_xyzw(q.x, q.y, q.z, q.w),
                linear_velocity: unvec(body.linvel()),
                angular_velocity: unvec(body.angvel()),
                awake: !body.is_sleeping(),
            }
        })
    }

    fn contacts(&self) -> Option<usize> {
        let pairs = self.world.narrow_phase.contact_pairs();
        Some(pairs.map(|pair| pair.manifolds().iter().map(|manifold| manifold.points.len()).sum::<usize>()).sum())
    }

    fn bytes(&self) -> Option<isize> {
        Some(memory::held())
    }
}

impl Rapier {
    fn pipeline(&self) -> QueryPipeline<'_> {
        self.world.broad_phase.as_query_pipeline(
            self.world.narrow_phase.query_dispatcher(),
            &self.world.bodies,
            &self.world.colliders,
            QueryFilter::default(),
        )
    }

    fn cast(&self, start: &Pose, way: Vec3, shape: &dyn rapier3d::parry::shape::Shape) -> Option<Real> {
        let options = ShapeCastOptions {
            max_time_of_impact: 1.0,
            compute_impact_geometry_on_penetration: false,
            ..ShapeCastOptions::default()
        };
        self.pipeline().cast_shape(start, vec(way), shape, options).map(|(_, hit)| hit.time_of_impact)
    }
}

impl Ask for Rapier {
    fn ray(&self, origin: Vec3, way: Vec3) -> Option<Real> {
        let ray = Ray::new(vec(origin), vec(way));
        self.pipeline().cast_ray_and_get_normal(&ray, 1.0, true).map(|(_, hit)| hit.time_of_impact)
    }

    fn ball(&self, origin: Vec3, way: Vec3) -> Option<Real> {
        self.cast(&pose(origin, Quat::IDENTITY), way, &Ball::new(BALL))
    }

    fn cuboid(&self, origin: Vec3, way: Vec3) -> Option<Real> {
        self.cast(&pose(origin, tilt()), way, &Cuboid::new(vec(BOX)))
    }
}
