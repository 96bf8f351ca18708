//! Jolt, through its C interface, which has neither meshes nor joints, nor a way to set gravity.
//!
//! One collision step per step with Jolt's default iterations; two layers, of what never moves and of what may.

use super::{Engine, State, beyond_peers};
use crate::scene::{Body, Scene};
use arbiter3d::math::{Quat, Real, Vec3};
use arbiter3d::{BodyKind, Filter, Shape, ShapeDefinition, WorldSettings};
use joltc_sys::*;
use std::collections::HashMap;
use std::ffi::{c_uint, c_void};
use std::ptr::{null, null_mut};
use std::sync::{Arc, Once};

unsafe extern "C" fn layer_count(_: *const c_void) -> c_uint {
    2
}
unsafe extern "C" fn broad_phase_layer(_: *const c_void, layer: JPC_ObjectLayer) -> JPC_BroadPhaseLayer {
    layer as JPC_BroadPhaseLayer
}
unsafe extern "C" fn meets_layer(_: *const c_void, a: JPC_ObjectLayer, b: JPC_BroadPhaseLayer) -> bool {
    a != STILL || JPC_ObjectLayer::from(b) != STILL
}
unsafe extern "C" fn meets(_: *const c_void, a: JPC_ObjectLayer, b: JPC_ObjectLayer) -> bool {
    a != STILL || b != STILL
}

const STILL: JPC_ObjectLayer = 0;
const MOVING: JPC_ObjectLayer = 1;
const LAYERS: JPC_BroadPhaseLayerInterfaceFns = JPC_BroadPhaseLayerInterfaceFns {
    GetNumBroadPhaseLayers: Some(layer_count as _),
    GetBroadPhaseLayer: Some(broad_phase_layer as _),
};
const LAYER_FILTER: JPC_ObjectVsBroadPhaseLayerFilterFns =
    JPC_ObjectVsBroadPhaseLayerFilterFns { ShouldCollide: Some(meets_layer as _) };
const PAIR_FILTER: JPC_ObjectLayerPairFilterFns = JPC_ObjectLayerPairFilterFns { ShouldCollide: Some(meets as _) };

/// A world of Jolt's.
pub struct Jolt {
    system: *mut JPC_PhysicsSystem,
    interface: *mut JPC_BodyInterface,
    memory: *mut JPC_TempAllocatorImpl,
    jobs: *mut JPC_JobSystemThreadPool,
    bodies: Vec<Option<JPC_BodyID>>,
    /// Single shapes of hulls by address and density, shared.
    hulls: HashMap<(usize, u32), *mut JPC_Shape>,
    /// Boxes and balls by their sizes and density, shared.
    solids: HashMap<[u32; 5], *mut JPC_Shape>,
    allow_sleep: bool,
}

/// Why Jolt cannot have this body, if it cannot.
pub fn unsupported(body: &Body) -> Option<String> {
    if body.shapes.iter().any(|shape| matches!(shape.shape, Shape::Mesh(_))) {
        return Some("meshes (its C interface has none)".into());
    }
    if body.shapes.iter().any(|shape| shape.filter != Filter::default()) {
        return Some("collision filters".into());
    }
    beyond_peers(body)
}

fn vec(v: Vec3) -> JPC_Vec3 {
    JPC_Vec3 { x: v.x, y: v.y, z: v.z, _w: v.z }
}

fn unvec(v: JPC_Vec3) -> Vec3 {
    Vec3::new(v.x, v.y, v.z)
}

fn place(v: Vec3) -> JPC_RVec3 {
    JPC_RVec3 { x: v.x, y: v.y, z: v.z, _w: v.z }
}

fn quat(q: Quat) -> JPC_Quat {
    JPC_Quat { x: q.x, y: q.y, z: q.z, w: q.w }
}

impl Jolt {
    /// Builds the scene.
    pub fn new(scene: &Scene, threads: usize) -> Result<Self, String> {
        if scene.settings.gravity != WorldSettings::default().gravity {
            return Err("Jolt's C interface cannot set gravity".into());
        }
        static ONCE: Once = Once::new();
        let count = scene.all_bodies().count();
        let pairs = (count * 16).clamp(1 << 16, 1 << 20) as c_uint;
        // SAFETY: the library is set up once, before anything of it is used; the three objects live until `drop`.
        let mut engine = unsafe {
            ONCE.call_once(|| {
                JPC_RegisterDefaultAllocator();
                JPC_FactoryInit();
                JPC_RegisterTypes();
            });
            let memory = JPC_TempAllocatorImpl_new(1 << 30);
            let (max_jobs, barriers) = (JPC_MAX_PHYSICS_JOBS as c_uint, JPC_MAX_PHYSICS_BARRIERS as c_uint);
            // The calling thread works too.
            let jobs = JPC_JobSystemThreadPool_new3(max_jobs, barriers, threads as i32 - 1);
            let system = JPC_PhysicsSystem_new();
            JPC_PhysicsSystem_Init(
                system,
                count as c_uint + 1,
                0,
                pairs,
                pairs,
                JPC_BroadPhaseLayerInterface_new(null(), LAYERS),
                JPC_ObjectVsBroadPhaseLayerFilter_new(null_mut(), LAYER_FILTER),
                JPC_ObjectLayerPairFilter_new(null_mut(), PAIR_FILTER),
            );
            let interface = JPC_PhysicsSystem_GetBodyInterface(system);
            let (bodies, hulls, solids) = (Vec::with_capacity(count), HashMap::new(), HashMap::new());
            let allow_sleep = scene.settings.allow_sleep;
            Self { system, interface, memory, jobs, bodies, hulls, solids, allow_sleep }
        };
        scene.bodies.iter().try_for_each(|body| engine.spawn(body))?;
        // SAFETY: the system lives.
        unsafe { JPC_PhysicsSystem_OptimizeBroadPhase(engine.system) };
        Ok(engine)
    }

    fn geometry(&mut self, shape: &ShapeDefinition) -> Result<*mut JPC_Shape, String> {
        let density = shape.density;
        let key = |numbers: [Real; 4]| {
            let [a, b, c, d] = numbers.map(Real::to_bits);
            [a, b, c, d, density.to_bits()]
        };
        match &shape.shape {
            Shape::Hull(hull) => {
                let key = (Arc::as_ptr(hull) as usize, density.to_bits());
                if let Some(&built) = self.hulls.get(&key) {
                    return Ok(built);
                }
                let points: Vec<JPC_Vec3> = hull.vertices().iter().map(|&v| vec(v)).collect();
                let settings = JPC_ConvexHullShapeSettings {
                    Points: points.as_ptr(),
                    PointsLen: points.len(),
                    Density: density,
                    ..Default::default()
                };
                // SAFETY: the points outlive the call.
                let built = finish(|out, error| unsafe { JPC_ConvexHullShapeSettings_Create(&settings, out, error) })?;
                Ok(*self.hulls.entry(key).or_insert(built))
            }
            Shape::Cuboid(cuboid) => {
                let h = cuboid.half_extents();
                let settings = JPC_BoxShapeSettings { HalfExtent: vec(h), Density: density, ..Default::default() };
                // SAFETY: the settings outlive the call.
                let build = || finish(|out, error| unsafe { JPC_BoxShapeSettings_Create(&settings, out, error) });
                self.shared(key([h.x, h.y, h.z, 0.0]), build)
            }
            Shape::Sphere(sphere) => {
                let radius = sphere.radius();
                let settings = JPC_SphereShapeSettings { Radius: radius, Density: density, ..Default::default() };
                // SAFETY: the settings outlive the call.
                let build = || finish(|out, error| unsafe { JPC_SphereShapeSettings_Create(&settings, out, error) });
                self.shared(key([radius, 0.0, 0.0, 1.0]), build)
            }
            Shape::Capsule(capsule) => {
                let (half, radius) = (capsule.half_length(), capsule.radius());
                let settings = JPC_CapsuleShapeSettings {
                    Radius: radius,
                    HalfHeightOfCylinder: half,
                    Density: density,
                    ..Default::default()
                };
                // SAFETY: the settings outlive the call.
                let build = || finish(|out, error| unsafe { JPC_CapsuleShapeSettings_Create(&settings, out, error) });
                self.shared(key([radius, half, 0.0, 2.0]), build)
            }
            other => Err(format!("a shape that this program does not know: {other:?}")),
        }
    }

    fn shared(
        &mut self,
        key: [u32; 5],
        build: impl FnOnce() -> Result<*mut JPC_Shape, String>,
    ) -> Result<*mut JPC_Shape, String> {
        if let Some(&built) = self.solids.get(&key) {
            return Ok(built);
        }
        Ok(*self.solids.entry(key).or_insert(build()?))
    }

    /// The shape of a body: a single one, or a compound where there are several or one is off the origin.
    fn body_shape(&mut self, body: &Body) -> Result<*mut JPC_Shape, String> {
        match &body.shapes[..] {
            [shape] if shape.position == Vec3::ZERO && shape.rotation == Quat::IDENTITY => self.geometry(shape),
            shapes => {
                let part = |shape: &ShapeDefinition, built: *mut JPC_Shape| JPC_SubShapeSettings {
                    Shape: built,
                    Position: vec(shape.position),
                    Rotation: quat(shape.rotation),
                    ..Default::default()
                };
                let mut parts = Vec::with_capacity(shapes.len());
                for shape in shapes {
                    parts.push(part(shape, self.geometry(shape)?));
                }
                let settings = JPC_StaticCompoundShapeSettings {
                    SubShapes: parts.as_ptr(),
                    SubShapesLen: parts.len(),
                    ..Default::default()
                };
                // SAFETY: the parts outlive the call.
                finish(|out, error| unsafe { JPC_StaticCompoundShapeSettings_Create(&settings, out, error) })
            }
        }
    }
}

/// The shape that `create` makes, or an error.
fn finish(create: impl FnOnce(*mut *mut JPC_Shape, *mut *mut JPC_String) -> bool) -> Result<*mut JPC_Shape, String> {
    let (mut shape, mut error) = (null_mut(), null_mut());
    if create(&mut shape, &mut error) { Ok(shape) } else { Err("Jolt refuses a shape".into()) }
}

impl Engine for Jolt {
    fn step(&mut self, dt: Real) -> Result<(), String> {
        // SAFETY: all three live.
        let error = unsafe { JPC_PhysicsSystem_Update(self.system, dt, 1, self.memory, self.jobs) };
        if error == JPC_PHYSICS_UPDATE_ERROR_NONE { Ok(()) } else { Err(format!("Jolt ran out of a buffer ({error})")) }
    }

    fn spawn(&mut self, body: &Body) -> Result<(), String> {
        let from = &body.definition;
        let shape = self.body_shape(body)?;
        let motion = match from.kind {
            BodyKind::Static => JPC_MOTION_TYPE_STATIC,
            BodyKind::Kinematic => JPC_MOTION_TYPE_KINEMATIC,
            BodyKind::Dynamic => JPC_MOTION_TYPE_DYNAMIC,
        };
        let settings = JPC_BodyCreationSettings {
            Position: place(from.position),
            Rotation: quat(from.rotation),
            LinearVelocity: vec(from.linear_velocity),
            AngularVelocity: vec(from.angular_velocity),
            ObjectLayer: if from.kind == BodyKind::Static { STILL } else { MOVING },
            MotionType: motion,
            AllowedDOFs: !from.locked_axes.bits() & 0b11_1111,
            AllowSleeping: from.can_sleep && self.allow_sleep,
            Friction: body.shapes[0].material.friction,
            Restitution: body.shapes[0].material.restitution,
            LinearDamping: from.linear_damping,
            AngularDamping: from.angular_damping,
            GravityFactor: from.gravity_scale,
            Shape: shape,
            ..Default::default()
        };
        let awake = from.awake && from.kind != BodyKind::Static;
        let activation = if awake { JPC_ACTIVATION_ACTIVATE } else { JPC_ACTIVATION_DONT_ACTIVATE };
        // SAFETY: the interface and the shape live.
        let id = unsafe { JPC_BodyInterface_CreateAndAddBody(self.interface, &settings, activation) };
        self.bodies.push(Some(id));
        Ok(())
    }

    fn remove(&mut self, body: usize) {
        if let Some(id) = self.bodies[body].take() {
            // SAFETY: the body lives: its id is forgotten with it.
            unsafe {
                JPC_BodyInterface_RemoveBody(self.interface, id);
                JPC_BodyInterface_DestroyBody(self.interface, id);
            }
        }
    }

    fn set_velocity(&mut self, body: usize, linear: Vec3, angular: Vec3) {
        if let Some(id) = self.bodies[body] {
            // SAFETY: the body lives.
            unsafe { JPC_BodyInterface_SetLinearAndAngularVelocity(self.interface, id, vec(linear), vec(angular)) };
        }
    }

    fn state(&self, body: usize) -> Option<State> {
        self.bodies[body].map(|id| {
            // SAFETY: the body lives.
            let (p, q, linear, angular, awake) = unsafe {
                (
                    JPC_BodyInterface_GetPosition(self.interface, id),
                    JPC_BodyInterface_GetRotation(self.interface, id),
                    JPC_BodyInterface_GetLinearVelocity(self.interface, id),
                    JPC_BodyInterface_GetAngularVelocity(self.interface, id),
                    JPC_BodyInterface_IsActive(self.interface, id),
                )
            };
            State {
                position: Vec3::new(p.x, p.y, p.z),
                rotation: Quat::from_xyzw(q.x, q.y, q.z, q.w),
                linear_velocity: unvec(linear),
                angular_velocity: unvec(angular),
                awake,
            }
        })
    }

    fn contacts(&self) -> Option<usize> {
        None
    }

    fn bytes(&self) -> Option<isize> {
        None
    }
}

impl Drop for Jolt {
    fn drop(&mut self) {
        // SAFETY: nothing refers to them any more; the system goes first.
        unsafe {
            JPC_PhysicsSystem_delete(self.system);
            JPC_JobSystemThreadPool_delete(self.jobs);
            JPC_TempAllocatorImpl_delete(self.memory);
        }
    }
}
