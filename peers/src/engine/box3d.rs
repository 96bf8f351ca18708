//! Box3D, through its C interface.
//!
//! Boxes are its box hulls, hulls are shared by its own database, a mesh is built once and outlives the world.

use super::{Ask, Engine, State, beyond_peers, rolling_resistance};
use crate::queries::{BALL, BOX, tilt};
use crate::scene::{Body, Scene};
use arbiter3d::math::{Quat, Real, Rotation, Vec3};
use arbiter3d::{
    BodyKind, CombineRule, ConvexHull, HeightField, LockedAxes, Shape, ShapeDefinition, TriangleMesh, WorldSettings,
};
use boxddd_sys::ffi;
use std::collections::HashMap;
use std::ffi::{CStr, c_char, c_int, c_void};
use std::ptr::null_mut;
use std::sync::Arc;

/// A world of Box3D's.
pub struct Box3d {
    world: ffi::b3WorldId,
    bodies: Vec<Option<ffi::b3BodyId>>,
    hulls: HashMap<usize, *mut ffi::b3HullData>,
    meshes: HashMap<usize, *mut ffi::b3MeshData>,
    fields: HashMap<usize, *mut ffi::b3HeightFieldData>,
    allow_sleep: bool,
    sleep_speed: Real,
    substeps: i32,
}

/// Why Box3D cannot have this body, if it cannot.
pub fn unsupported(body: &Body) -> Option<String> {
    let mesh = |shape: &ShapeDefinition| matches!(shape.shape, Shape::Mesh(_) | Shape::HeightField(_));
    let offset = |shape: &ShapeDefinition| shape.position != Vec3::ZERO || shape.rotation != Quat::IDENTITY;
    let mixes_otherwise = |shape: &ShapeDefinition| {
        let material = &shape.material;
        [material.friction_combine, material.restitution_combine] != [CombineRule::Maximum; 2]
    };
    if body.shapes.iter().any(mixes_otherwise) {
        return Some("friction or restitution that is not the larger of two".into());
    }
    if body.definition.kind != BodyKind::Static && body.shapes.iter().any(mesh) {
        return Some("a moving mesh".into());
    }
    if body.shapes.iter().any(|shape| mesh(shape) && offset(shape)) {
        return Some("a mesh off its body's origin".into());
    }
    beyond_peers(body)
}

fn vec(v: Vec3) -> ffi::b3Vec3 {
    ffi::b3Vec3 { x: v.x, y: v.y, z: v.z }
}

fn unvec(v: ffi::b3Vec3) -> Vec3 {
    Vec3::new(v.x, v.y, v.z)
}

fn quat(q: Quat) -> ffi::b3Quat {
    ffi::b3Quat { v: vec(Vec3::new(q.x, q.y, q.z)), s: q.w }
}

/// Our scenes take the larger friction of two, Box3D the root of the product. They agree where all frictions are the same;
/// only where they are not is its mixing replaced.
fn frictions_differ(scene: &Scene) -> bool {
    let mut frictions = scene.all_bodies().flat_map(|body| &body.shapes).map(|shape| shape.material.friction);
    let first = frictions.next();
    frictions.any(|friction| Some(friction) != first)
}

/// Passes a warning on to where it does not get into the results.
unsafe extern "C" fn warn(message: *const c_char) {
    // SAFETY: Box3D hands over a string that ends in zero and lives during the call.
    eprintln!("Box3D: {}", unsafe { CStr::from_ptr(message) }.to_string_lossy());
}

unsafe extern "C" fn larger_friction(a: f32, _: u64, b: f32, _: u64) -> f32 {
    if a > b { a } else { b }
}

impl Box3d {
    /// Builds the scene.
    pub fn new(scene: &Scene, threads: usize) -> Result<Self, String> {
        let defaults = WorldSettings::default();
        let settings = &scene.settings;
        // SAFETY: the definition is the library's default with plain fields and callbacks without state changed.
        let world = unsafe {
            ffi::b3SetLogFcn(Some(warn));
            let mut definition = ffi::b3DefaultWorldDef();
            definition.gravity = vec(settings.gravity);
            definition.enableSleep = settings.allow_sleep;
            definition.enableContinuous = settings.continuous;
            definition.workerCount = threads as u32;
            if frictions_differ(scene) {
                definition.frictionCallback = Some(larger_friction);
            }
            ffi::b3CreateWorld(&definition)
        };
        // Our default threshold is also theirs; a scene's own is handed over.
        let sleep_speed = if settings.sleep_speed == defaults.sleep_speed { -1.0 } else { settings.sleep_speed };
        let mut engine = Self {
            world,
            bodies: Vec::with_capacity(scene.bodies.len()),
            hulls: HashMap::new(),
            meshes: HashMap::new(),
            fields: HashMap::new(),
            allow_sleep: settings.allow_sleep,
            sleep_speed,
            substeps: settings.substeps as i32,
        };
        scene.bodies.iter().try_for_each(|body| engine.spawn(body))?;
        Ok(engine)
    }

    fn definition(&self, body: &Body) -> ffi::b3BodyDef {
        let from = &body.definition;
        let locked = |axis: LockedAxes| from.locked_axes.contains(axis);
        // SAFETY: no arguments, no state.
        let mut definition = unsafe { ffi::b3DefaultBodyDef() };
        definition.type_ = match from.kind {
            BodyKind::Static => ffi::b3BodyType_b3_staticBody,
            BodyKind::Kinematic => ffi::b3BodyType_b3_kinematicBody,
            BodyKind::Dynamic => ffi::b3BodyType_b3_dynamicBody,
        };
        definition.position = vec(from.position);
        definition.rotation = quat(from.rotation);
        definition.linearDamping = from.linear_damping;
        definition.angularDamping = from.angular_damping;
        definition.gravityScale = from.gravity_scale;
        if self.sleep_speed >= 0.0 {
            definition.sleepThreshold = self.sleep_speed;
        }
        definition.enableSleep = from.can_sleep && self.allow_sleep;
        definition.isAwake = from.awake;
        definition.motionLocks = ffi::b3MotionLocks {
            linearX: locked(LockedAxes::TRANSLATION_X),
            linearY: locked(LockedAxes::TRANSLATION_Y),
            linearZ: locked(LockedAxes::TRANSLATION_Z),
            angularX: locked(LockedAxes::ROTATION_X),
            angularY: locked(LockedAxes::ROTATION_Y),
            angularZ: locked(LockedAxes::ROTATION_Z),
        };
        definition
    }

    fn shape(&mut self, body: ffi::b3BodyId, shape: &ShapeDefinition, updates_mass: bool) {
        // SAFETY: no arguments, no state.
        let mut definition = unsafe { ffi::b3DefaultShapeDef() };
        definition.density = shape.density;
        definition.baseMaterial.friction = shape.material.friction;
        definition.baseMaterial.restitution = shape.material.restitution;
        definition.baseMaterial.rollingResistance = rolling_resistance(shape);
        definition.filter.categoryBits = shape.filter.category;
        definition.filter.maskBits = shape.filter.mask;
        definition.filter.groupIndex = shape.filter.group;
        definition.updateBodyMass = updates_mass;
        let local = ffi::b3Transform { p: vec(shape.position), q: quat(shape.rotation) };
        let at = |y: Real| vec(shape.position + Rotation::from_quat(shape.rotation).rotate(Vec3::new(0.0, y, 0.0)));
        // SAFETY: the body lives; Box3D copies all geometry but meshes and fields, which live until `drop`.
        unsafe {
            match &shape.shape {
                Shape::Sphere(sphere) => {
                    let ball = ffi::b3Sphere { center: local.p, radius: sphere.radius() };
                    ffi::b3CreateSphereShape(body, &definition, &ball);
                }
                Shape::Capsule(capsule) => {
                    let (half, radius) = (capsule.half_length(), capsule.radius());
                    let capsule = ffi::b3Capsule { center1: at(-half), center2: at(half), radius };
                    ffi::b3CreateCapsuleShape(body, &definition, &capsule);
                }
                Shape::Cuboid(cuboid) => {
                    let h = cuboid.half_extents();
                    let hull = ffi::b3MakeTransformedBoxHull(h.x, h.y, h.z, local);
                    ffi::b3CreateHullShape(body, &definition, &hull.base);
                }
                Shape::Hull(hull) => {
                    let hull = self.hull(hull);
                    if shape.position == Vec3::ZERO && shape.rotation == Quat::IDENTITY {
                        ffi::b3CreateHullShape(body, &definition, hull);
                    } else {
                        ffi::b3CreateTransformedHullShape(body, &definition, hull, local, vec(Vec3::ONE));
                    }
                }
                Shape::Mesh(mesh) => {
                    let mesh = self.mesh(mesh);
                    ffi::b3CreateMeshShape(body, &definition, mesh, vec(Vec3::ONE));
                }
                Shape::HeightField(field) => {
                    let field = self.field(field);
                    ffi::b3CreateHeightFieldShape(body, &definition, field);
                }
                other => unreachable!("a shape that this program does not know: {other:?}"),
            }
        }
    }

    fn hull(&mut self, hull: &Arc<ConvexHull>) -> *const ffi::b3HullData {
        let build = || {
            let points: Vec<ffi::b3Vec3> = hull.vertices().iter().map(|&v| vec(v)).collect();
            // SAFETY: pointer and length are those of the vector, which outlives the call.
            unsafe { ffi::b3CreateHull(points.as_ptr(), points.len() as i32, points.len() as i32) }
        };
        *self.hulls.entry(Arc::as_ptr(hull) as usize).or_insert_with(build)
    }

    /// Heights become steps of 1/65535 of their range.
    fn field(&mut self, field: &Arc<HeightField>) -> *const ffi::b3HeightFieldData {
        let build = || {
            let mut heights = field.heights().to_vec();
            let [width, length] = field.cell_size();
            let definition = ffi::b3HeightFieldDef {
                heights: heights.as_mut_ptr(),
                materialIndices: null_mut(),
                scale: vec(Vec3::new(width, 1.0, length)),
                countX: field.columns() as i32 + 1,
                countZ: field.rows() as i32 + 1,
                globalMinimumHeight: heights.iter().fold(Real::MAX, |low, y| low.min(*y)),
                globalMaximumHeight: heights.iter().fold(-Real::MAX, |high, y| high.max(*y)),
                clockwiseWinding: false,
            };
            // SAFETY: pointer and counts are those of the vector, which outlives the call and is copied.
            unsafe { ffi::b3CreateHeightField(&definition) }
        };
        *self.fields.entry(Arc::as_ptr(field) as usize).or_insert_with(build)
    }

    fn mesh(&mut self, mesh: &Arc<TriangleMesh>) -> *const ffi::b3MeshData {
        let build = || {
            let mut vertices: Vec<ffi::b3Vec3> = mesh.vertices().iter().map(|&v| vec(v)).collect();
            let mut indices: Vec<i32> = mesh.triangles().iter().flatten().map(|&i| i as i32).collect();
            let definition = ffi::b3MeshDef {
                vertices: vertices.as_mut_ptr(),
                indices: indices.as_mut_ptr(),
                materialIndices: null_mut(),
                weldTolerance: 0.0,
                vertexCount: vertices.len() as i32,
                triangleCount: mesh.triangles().len() as i32,
                weldVertices: false,
                useMedianSplit: false,
                identifyEdges: true,
            };
            // SAFETY: pointers and counts are those of the vectors, which outlive the call and are copied.
            unsafe { ffi::b3CreateMesh(&definition, null_mut(), 0) }
        };
        *self.meshes.entry(Arc::as_ptr(mesh) as usize).or_insert_with(build)
    }
}

impl Engine for Box3d {
    fn step(&mut self, dt: Real) -> Result<(), String> {
        // SAFETY: the world lives.
        unsafe { ffi::b3World_Step(self.world, dt, self.substeps) };
        Ok(())
    }

    fn spawn(&mut self, body: &Body) -> Result<(), String> {
        let definition = self.definition(body);
        // SAFETY: the world lives, the definition is valid.
        let id = unsafe { ffi::b3CreateBody(self.world, &definition) };
        let last = body.shapes.len().saturating_sub(1);
        for (index, shape) in body.shapes.iter().enumerate() {
            // One computation of the mass, after the last shape.
            self.shape(id, shape, index == last);
        }
        let (linear, angular) = (body.definition.linear_velocity, body.definition.angular_velocity);
        self.bodies.push(Some(id));
        if linear != Vec3::ZERO || angular != Vec3::ZERO {
            // After the shapes: now it is the velocity of the centre of mass.
            self.set_velocity(self.bodies.len() - 1, linear, angular);
        }
        Ok(())
    }

    fn remove(&mut self, body: usize) {
        if let Some(id) = self.bodies[body].take() {
            // SAFETY: the body lives: its id is forgotten with it.
            unsafe { ffi::b3DestroyBody(id) };
        }
    }

    fn set_velocity(&mut self, body: usize, linear: Vec3, angular: Vec3) {
        let Some(id) = self.bodies[body] else { return };
        // SAFETY: the body lives.
        unsafe {
            ffi::b3Body_SetLinearVelocity(id, vec(linear));
            ffi::b3Body_SetAngularVelocity(id, vec(angular));
        }
    }

    fn state(&self, body: usize) -> Option<State> {
        // SAFETY: the body lives.
        self.bodies[body].map(|id| unsafe {
            let q = ffi::b3Body_GetRotation(id);
            State {
                position: unvec(ffi::b3Body_GetPosition(id)),
                rotation: Quat::from_xyzw(q.v.x, q.v.y, q.v.z, q.s),
                linear_velocity: unvec(ffi::b3Body_GetLinearVelocity(id)),
                angular_velocity: unvec(ffi::b3Body_GetAngularVelocity(id)),
                awake: ffi::b3Body_IsAwake(id),
            }
        })
    }

    fn contacts(&self) -> Option<usize> {
        // SAFETY: the world lives.
        let counters = unsafe { ffi::b3World_GetCounters(self.world) };
        usize::try_from(counters.contactCount).ok()
    }

    fn bytes(&self) -> Option<isize> {
        // SAFETY: reads a counter.
        Some(unsafe { ffi::b3GetByteCount() } as isize)
    }
}

impl Drop for Box3d {
    fn drop(&mut self) {
        // SAFETY: the world first, then what it refers to.
        unsafe {
            ffi::b3DestroyWorld(self.world);
            self.hulls.values().for_each(|&hull| ffi::b3DestroyHull(hull));
            self.meshes.values().for_each(|&mesh| ffi::b3DestroyMesh(mesh));
            self.fields.values().for_each(|&field| ffi::b3DestroyHeightField(field));
        }
    }
}

/// Keeps the least fraction, and clips the cast there.
unsafe extern "C" fn keep_closest(
    _: ffi::b3ShapeId,
    _: ffi::b3Pos,
    _: ffi::b3Vec3,
    fraction: f32,
    _: u64,
    _: c_int,
    _: c_int,
    context: *mut c_void,
) -> f32 {
    // SAFETY: `cast` hands over a pointer to such an option, which lives during the call.
    unsafe { *context.cast::<Option<f32>>() = Some(fraction) };
    fraction
}

impl Box3d {
    fn cast(&self, origin: Vec3, way: Vec3, points: &[ffi::b3Vec3], radius: f32) -> Option<Real> {
        let proxy = ffi::b3ShapeProxy { points: points.as_ptr(), count: points.len() as c_int, radius };
        let mut closest: Option<f32> = None;
        let context = (&raw mut closest).cast::<c_void>();
        // SAFETY: the world lives; the proxy and the context outlive the call.
        unsafe {
            let filter = ffi::b3DefaultQueryFilter();
            ffi::b3World_CastShape(self.world, vec(origin), &proxy, vec(way), filter, Some(keep_closest), context);
        }
        closest
    }
}

impl Ask for Box3d {
    fn ray(&self, origin: Vec3, way: Vec3) -> Option<Real> {
        // SAFETY: the world lives.
        let result =
            unsafe { ffi::b3World_CastRayClosest(self.world, vec(origin), vec(way), ffi::b3DefaultQueryFilter()) };
        result.hit.then_some(result.fraction)
    }

    fn ball(&self, origin: Vec3, way: Vec3) -> Option<Real> {
        self.cast(origin, way, &[vec(Vec3::ZERO)], BALL)
    }

    fn cuboid(&self, origin: Vec3, way: Vec3) -> Option<Real> {
        let rotation = Rotation::from_quat(tilt());
        let (x, y, z) =
            (rotation.rotate(Vec3::X * BOX.x), rotation.rotate(Vec3::Y * BOX.y), rotation.rotate(Vec3::Z * BOX.z));
        let corners = [x + y + z, x + y - z, x - y + z, x - y - z, y + z - x, y - x - z, z - x - y, -x - y - z];
        self.cast(origin, way, &corners.map(vec), 0.0)
    }
}
