//! Fluids: what floats, sinks and drifts in them.
//!
//! A [`FluidVolume`] is what lies below a surface, a plane or waves, within some bounds. Before each step it finds the
//! part of each shape that is in it (`clip.rs`; a formula for balls below a plane), and pushes the body
//!
//! - by Archimedes: against gravity with the weight of the displaced fluid `ρ V g`, at the centroid of that part,
//! - by drag: against its motion through the fluid with `ρ V k u + ½ ρ C A |u| u` at the same point, where `A` is the
//!   shadow of the part along the motion, and against its spin.
//!
//! Drag is taken at the velocity after the step, so that it never reverses a motion however light the body; and where
//! the surface cuts a shape, so is the change of what is displaced, `ρ g dA` per way at each point of the cut: balloons
//! and shells, whose bobbing is quicker than a step, come to rest instead of jittering.
//!
//! Waves are taken as a plane below each shape: through the mean of the heights at its middle and at four points of its
//! rim, with their mean slope. Shapes of one body that overlap count twice where they do.
//!
//! Call [`FluidVolume::update`] before each [`World::step`] with the same `dt`.

mod clip;
mod outline;

use crate::error::{Error, finite, finite_vec, in_range, unit_vec};
use crate::id::{BodyId, ShapeId};
use crate::math::{Aabb, Pose, Real, SymmetricMat3, Vec3, clamp, max, normalize_or};
use crate::shape::{Plane, Shape};
use crate::world::{BodyKind, BodyRef, QueryFilter, ShapeRef, World};
use clip::{Clipper, Solid, Triangle};
use std::sync::Arc;

/// Where a fluid ends at its top.
///
/// ```
/// use arbiter3d::{FluidSurface, math::Vec3};
/// use std::sync::Arc;
/// let calm = FluidSurface::level(2.0);
/// let waves = FluidSurface::Height(Arc::new(|at: Vec3| 0.2 * (at.x - at.x.floor() - 0.5).abs()));
/// ```
#[derive(Clone)]
pub enum FluidSurface {
    /// A plane; the fluid is behind it.
    Plane(Plane),
    /// The height (y) of the surface above or below a point (x, z). For waves that move, set a new one before each
    /// step.
    Height(Arc<dyn Fn(Vec3) -> Real + Send + Sync>),
}

impl FluidSurface {
    /// A level surface at the height `y`, metres.
    #[must_use]
    pub fn level(y: Real) -> Self {
        Self::Plane(Plane { normal: Vec3::Y, offset: y })
    }

    /// The plane of the surface near a box.
    fn near(&self, around: &Aabb) -> Result<Plane, Error> {
        let height = match self {
            Self::Plane(plane) => return Ok(*plane),
            Self::Height(height) => height,
        };
        let (middle, half) = (around.center(), around.half_extents());
        let (x, z) = (Vec3::X * max(half.x, 1e-3), Vec3::Z * max(half.z, 1e-3));
        let at = [middle, middle + x, middle - x, middle + z, middle - z].map(|point| height(point));
        let mean = finite("height of the fluid", (at[0] + at[1] + at[2] + at[3] + at[4]) * 0.2)?;
        let slope = Vec3::new((at[2] - at[1]) / (2.0 * x.x), 1.0, (at[4] - at[3]) / (2.0 * z.z));
        let normal = normalize_or(slope, Vec3::Y);
        Ok(Plane { normal, offset: normal.dot(Vec3::new(middle.x, mean, middle.z)) })
    }
}

impl std::fmt::Debug for FluidSurface {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Plane(plane) => f.debug_tuple("Plane").field(plane).finish(),
            Self::Height(_) => f.write_str("Height(..)"),
        }
    }
}

/// A fluid to be made.
///
/// ```
/// use arbiter3d::{FluidDefinition, FluidSurface, math::Vec3};
/// let river = FluidDefinition { flow: Vec3::new(1.5, 0.0, 0.0), ..FluidDefinition::default() };
/// let oil = FluidDefinition { density: 900.0, linear_drag: 5.0, ..FluidDefinition::default() };
/// let pool = FluidDefinition::pool(Vec3::new(0.0, -1.0, 0.0), Vec3::new(5.0, 1.0, 10.0));
/// ```
#[derive(Clone, Debug)]
pub struct FluidDefinition {
    /// Its top. Default level at y = 0.
    pub surface: FluidSurface,
    /// Planes behind which the fluid lies, besides the surface: walls and bottom of any convex region. Default none, an
    /// ocean.
    pub bounds: Vec<Plane>,
    /// Mass per volume, kg/m³ (0 to 10⁶). Default 1000, water.
    pub density: Real,
    /// Velocity of the fluid, m/s. Default zero.
    pub flow: Vec3,
    /// Drag that grows with speed, 1/s (0 to 10⁴): the rate at which a body that displaces its own mass loses speed.
    /// Default 0.1.
    pub linear_drag: Real,
    /// Drag that grows with the square of speed: the coefficient `C` on the shadow of the body (0 to 10⁴). Default 0.5,
    /// a ball; a box has about 1.
    pub quadratic_drag: Real,
    /// Drag against spin, 1/s (0 to 10⁴): the rate at which a body that displaces its own mass loses spin. Default 0.5.
    pub angular_drag: Real,
    /// Drag that grows with the square of spin: that rate per rad/s (0 to 10⁴). Default 0.2.
    pub quadratic_angular_drag: Real,
    /// Which shapes feel it. Default all but sensors.
    pub filter: QueryFilter<'static>,
}

impl Default for FluidDefinition {
    fn default() -> Self {
        Self {
            surface: FluidSurface::level(0.0),
            bounds: Vec::new(),
            density: 1000.0,
            flow: Vec3::ZERO,
            linear_drag: 0.1,
            quadratic_drag: 0.5,
            angular_drag: 0.5,
            quadratic_angular_drag: 0.2,
            filter: QueryFilter::default(),
        }
    }
}

impl FluidDefinition {
    /// Water in a box about `center`, full to its top; metres.
    #[must_use]
    pub fn pool(center: Vec3, half_extents: Vec3) -> Self {
        let wall = |normal: Vec3| Plane { normal, offset: normal.dot(center) + normal.abs().dot(half_extents) };
        let bounds = [Vec3::X, Vec3::NEG_X, Vec3::Z, Vec3::NEG_Z, Vec3::NEG_Y].map(wall).to_vec();
        Self { surface: FluidSurface::level(center.y + half_extents.y), bounds, ..Self::default() }
    }

    fn validate(&self) -> Result<(), Error> {
        let surface = match &self.surface {
            FluidSurface::Plane(plane) => Some(plane),
            FluidSurface::Height(_) => None,
        };
        for plane in surface.into_iter().chain(&self.bounds) {
            unit_vec("normal of a plane of the fluid", plane.normal)?;
            finite("offset of a plane of the fluid", plane.offset)?;
        }
        in_range("fluid density", self.density, 0.0, 1e6)?;
        finite_vec("flow", self.flow)?;
        in_range("linear_drag", self.linear_drag, 0.0, 1e4)?;
        in_range("quadratic_drag", self.quadratic_drag, 0.0, 1e4)?;
        in_range("angular_drag", self.angular_drag, 0.0, 1e4)?;
        in_range("quadratic_angular_drag", self.quadratic_angular_drag, 0.0, 1e4).map(|_| ())
    }

    /// Whether a box lies behind all bounds; `None` if it is wholly in front of one.
    fn holds(&self, around: &Aabb) -> Option<bool> {
        let (middle, half) = (around.center(), around.half_extents());
        let mut inside = true;
        for plane in &self.bounds {
            let (height, reach) = (plane.distance(middle), plane.normal.abs().dot(half));
            if height >= reach {
                return None;
            }
            inside &= height + reach <= 0.0;
        }
        Some(inside)
    }
}

/// How much of something is in a fluid.
///
/// ```
/// use arbiter3d::Submersion;
/// assert_eq!(Submersion::default().volume, 0.0);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Submersion {
    /// Volume below the surface, m³.
    pub volume: Real,
    /// Centroid of that volume, world; zero where there is none.
    pub center: Vec3,
}

/// A body of fluid in a world.
///
/// ```
/// use arbiter3d::math::Vec3;
/// use arbiter3d::{BodyDefinition, FluidDefinition, FluidVolume, Shape, ShapeDefinition, World};
/// let mut world = World::default();
/// let buoy = world.add_body(&BodyDefinition::dynamic().at(Vec3::new(0.0, -2.0, 0.0)))?;
/// world.add_shape(buoy, &ShapeDefinition::new(Shape::sphere(0.5)?).density(500.0))?;
/// let mut water = FluidVolume::new(FluidDefinition { linear_drag: 2.0, ..FluidDefinition::default() })?;
/// for _ in 0..600 {
///     water.update(&mut world, 1.0 / 60.0)?;
///     world.step(1.0 / 60.0)?;
/// }
/// assert!(world.body(buoy).unwrap().position().y.abs() < 0.01);
/// # Ok::<(), arbiter3d::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct FluidVolume {
    definition: FluidDefinition,
    /// Whether the fluid is another than at the last update.
    changed: bool,
    /// Triangles of shapes other than hulls, by shape.
    outlines: Vec<(ShapeId, Vec<Triangle>)>,
    clipper: Clipper,
    bodies: Vec<BodyId>,
    parts: Vec<Part>,
    /// Points with areas that stand for where the surface cuts the parts.
    cuts: Vec<(Vec3, Real)>,
}

/// The part of a shape that is in the fluid.
#[derive(Clone, Copy, Debug)]
struct Part {
    solid: Solid,
    /// Shadow along the motion of the part.
    shadow: Real,
    /// Where its points in the surface end in the list of all.
    cuts_end: usize,
}

impl FluidVolume {
    /// A fluid as defined.
    ///
    /// # Errors
    /// If a number is out of its range or the normal of a plane not of unit length.
    pub fn new(definition: FluidDefinition) -> Result<Self, Error> {
        definition.validate()?;
        Ok(Self {
            definition,
            changed: true,
            outlines: Vec::new(),
            clipper: Clipper::default(),
            bodies: Vec::new(),
            parts: Vec::new(),
            cuts: Vec::new(),
        })
    }

    /// What the fluid is like.
    #[must_use]
    pub fn definition(&self) -> &FluidDefinition {
        &self.definition
    }

    /// Makes the fluid another; the next update wakes what is in it or was.
    ///
    /// # Errors
    /// As [`FluidVolume::new`]; the fluid is then as before.
    pub fn set_definition(&mut self, world: &mut World, definition: FluidDefinition) -> Result<(), Error> {
        definition.validate()?;
        self.wake(world)?;
        self.definition = definition;
        self.changed = true;
        Ok(())
    }

    /// Wakes what is in the fluid. Call it before the fluid is dropped, so that what floats asleep falls.
    ///
    /// # Errors
    /// If the height of the surface is not finite.
    pub fn wake(&mut self, world: &mut World) -> Result<(), Error> {
        self.bodies.clear();
        self.bodies.extend(world.bodies().filter(|&id| world.body(id).is_some_and(|body| !body.is_awake())));
        for index in 0..self.bodies.len() {
            let id = self.bodies[index];
            if self.submersion(world, id)?.volume > 0.0
                && let Some(mut body) = world.body_mut(id)
            {
                body.wake();
            }
        }
        Ok(())
    }

    /// How much of a body is in the fluid.
    ///
    /// # Errors
    /// If the body is unknown, or the height of the surface is not finite.
    pub fn submersion(&mut self, world: &World, body: BodyId) -> Result<Submersion, Error> {
        self.find_parts(world, body)?;
        let (mut volume, mut moment) = (0.0, Vec3::ZERO);
        for part in &self.parts {
            volume += part.solid.volume;
            moment += part.solid.center * part.solid.volume;
        }
        Ok(if volume > 0.0 { Submersion { volume, center: moment / volume } } else { Submersion::default() })
    }

    /// Pushes the awake dynamic bodies that are in the fluid, for the coming step of `dt` seconds. What sleeps floats
    /// on as it is; a change of the fluid wakes it.
    ///
    /// # Errors
    /// If `dt` is not above 0 and at most 1, or a height or force is not finite.
    pub fn update(&mut self, world: &mut World, dt: Real) -> Result<(), Error> {
        in_range("dt", dt, 1e-6, 1.0)?;
        if std::mem::take(&mut self.changed) {
            self.outlines.retain(|(shape, _)| world.shape(*shape).is_some());
            self.wake(world)?;
        }
        world.list_awake(&mut self.bodies);
        for index in 0..self.bodies.len() {
            let id = self.bodies[index];
            let Some(body) = world.body(id) else { continue };
            if body.kind() != BodyKind::Dynamic || body.is_frozen() {
                continue;
            }
            self.find_parts(world, id)?;
            if self.parts.is_empty() {
                continue;
            }
            let Some(body) = world.body(id) else { continue };
            let (force, torque) = self.push(&body, world.settings().gravity, dt);
            world.add_lasting_force(id, force, torque)?;
        }
        Ok(())
    }

    /// Finds the parts of a body's shapes that are in the fluid.
    fn find_parts(&mut self, world: &World, id: BodyId) -> Result<(), Error> {
        self.parts.clear();
        self.cuts.clear();
        let body = world.body(id).ok_or(Error::UnknownBody { id })?;
        for &shape in body.shapes() {
            let Some(shape) = world.shape(shape) else { continue };
            if !world.filter_accepts(&self.definition.filter, shape.id()) {
                continue;
            }
            let around = shape.aabb();
            let Some(inside) = self.definition.holds(&around) else { continue };
            let surface = self.definition.surface.near(&around)?;
            if surface.distance(around.center()) >= surface.normal.abs().dot(around.half_extents()) {
                continue;
            }
            let part = match shape.geometry() {
                Shape::Sphere(sphere) if inside => self.ball(sphere.radius(), shape.world_pose().position, &surface),
                _ => self.cut(&shape, &surface, inside, &body),
            };
            if part.solid.volume > 0.0 {
                self.parts.push(part);
            }
        }
        Ok(())
    }

    /// The part of a shape below the surface and, unless it is `inside` them, behind the bounds.
    fn cut(&mut self, shape: &ShapeRef<'_>, surface: &Plane, inside: bool, body: &BodyRef<'_>) -> Part {
        let pose = shape.world_pose();
        match shape.geometry() {
            Shape::Hull(hull) => self.clipper.load(outline::faces(hull)),
            geometry => {
                let at = match self.outlines.binary_search_by_key(&shape.id(), |(id, _)| *id) {
                    Ok(at) => at,
                    Err(at) => {
                        self.outlines.insert(at, (shape.id(), outline::triangles(geometry)));
                        at
                    }
                };
                self.clipper.load(self.outlines[at].1.iter().copied());
            }
        }
        if !inside {
            for plane in &self.definition.bounds {
                self.clipper.cut(&local(plane, &pose));
            }
        }
        let surface = local(surface, &pose);
        self.clipper.cut(&surface);
        let points = self.clipper.face_points(surface.normal);
        self.cuts.extend(points.map(|(point, area)| (pose.transform_point(point), area)));
        let mut solid = self.clipper.solid();
        solid.center = pose.transform_point(solid.center);
        let motion = body.velocity_at(solid.center) - self.definition.flow;
        let direction = pose.rotation.inverse_rotate(normalize_or(motion, Vec3::Y));
        Part { solid, shadow: self.clipper.shadow(direction), cuts_end: self.cuts.len() }
    }

    /// The part of a ball below a plane: a cap of height `h` has the volume `π h² (3r − h) / 3` and its centroid at
    /// `3 (2r − h)² / (4 (3r − h))` below the middle. Its shadow is taken as that share of the whole disc.
    fn ball(&mut self, radius: Real, middle: Vec3, surface: &Plane) -> Part {
        let height = surface.distance(middle);
        let h = clamp(radius - height, 0.0, 2.0 * radius);
        let pi = std::f32::consts::PI;
        let volume = pi * h * h * (3.0 * radius - h) / 3.0;
        let rest = 2.0 * radius - h;
        let depth = 3.0 * rest * rest / (4.0 * (3.0 * radius - h));
        let share = volume / (4.0 / 3.0 * pi * radius * radius * radius);
        // Rolling does not change what a ball displaces: one point stands for the whole cut.
        self.cuts.push((middle, pi * h * rest));
        Part {
            solid: Solid { volume, center: middle - surface.normal * depth },
            shadow: share * pi * radius * radius,
            cuts_end: self.cuts.len(),
        }
    }

    /// Force and torque about the centre of mass on a body whose parts have been found.
    fn push(&self, body: &BodyRef<'_>, gravity: Vec3, dt: Real) -> (Vec3, Vec3) {
        let fluid = &self.definition;
        let mut floating = Floating::new(body);
        let start = floating;
        let free = body.locked_axes().free().0;
        floating.linear += (gravity * body.gravity_scale() * free + body.force() * floating.inverse_mass) * dt;
        floating.angular += floating.inverse_inertia.mul(body.torque()) * dt;
        let mut displaced = 0.0;
        for part in &self.parts {
            let mass = fluid.density * part.solid.volume;
            displaced += mass;
            floating.push(part.solid.center, gravity * (-mass * dt));
        }
        let strength = gravity.length();
        let up = normalize_or(-gravity, Vec3::Y);
        let mut cuts = 0;
        for part in &self.parts {
            let at = part.solid.center;
            let speed = (start.velocity_at(at) - fluid.flow).length();
            let drag = fluid.density
                * (fluid.linear_drag * part.solid.volume + 0.5 * fluid.quadratic_drag * part.shadow * speed);
            floating.resist(at, floating.velocity_at(at) - fluid.flow, drag * dt);
            // What a rise or fall of the cut within the step changes in the displaced volume.
            for &(point, area) in &self.cuts[cuts..part.cuts_end] {
                let stiffness = fluid.density * strength * max(area, 0.0);
                floating.resist(point, up * up.dot(floating.velocity_at(point)), stiffness * dt * dt);
            }
            cuts = part.cuts_end;
        }
        let spin = floating.angular;
        let rate = fluid.angular_drag + fluid.quadratic_angular_drag * start.angular.length();
        floating.angular = spin / (1.0 + dt * rate * displaced / max(body.mass(), 1e-30));
        let turned = floating.turn + floating.inertia.mul(floating.angular - spin);
        (floating.impulse / dt, turned / dt)
    }
}

/// A body in the fluid, as drag sees it.
#[derive(Clone, Copy, Debug)]
struct Floating {
    linear: Vec3,
    angular: Vec3,
    center: Vec3,
    inverse_mass: Vec3,
    inverse_inertia: SymmetricMat3,
    inertia: SymmetricMat3,
    /// Given so far: impulse and angular impulse.
    impulse: Vec3,
    turn: Vec3,
}

impl Floating {
    fn new(body: &BodyRef<'_>) -> Self {
        let mass = body.mass_properties();
        Self {
            linear: body.linear_velocity(),
            angular: body.angular_velocity(),
            center: body.center_of_mass(),
            inverse_mass: body.locked_axes().free().0 / mass.mass,
            inverse_inertia: body.inverse_inertia(),
            inertia: mass.inertia.rotate(&body.pose().rotation.to_mat3()),
            impulse: Vec3::ZERO,
            turn: Vec3::ZERO,
        }
    }

    fn velocity_at(&self, point: Vec3) -> Vec3 {
        self.linear + self.angular.cross(point - self.center)
    }

    fn push(&mut self, point: Vec3, impulse: Vec3) {
        let turn = (point - self.center).cross(impulse);
        self.linear += impulse * self.inverse_mass;
        self.angular += self.inverse_inertia.mul(turn);
        self.impulse += impulse;
        self.turn += turn;
    }

    /// Resists a velocity of a point with an impulse of `strength` (kg) times what is left of it afterwards.
    fn resist(&mut self, point: Vec3, velocity: Vec3, strength: Real) {
        let direction = normalize_or(velocity, Vec3::ZERO);
        let turn = (point - self.center).cross(direction);
        let response = direction.dot(direction * self.inverse_mass) + turn.dot(self.inverse_inertia.mul(turn));
        self.push(point, velocity * (-strength / (1.0 + strength * response)));
    }
}

/// A plane seen from a frame.
fn local(plane: &Plane, pose: &Pose) -> Plane {
    Plane { normal: pose.rotation.inverse_rotate(plane.normal), offset: -plane.distance(pose.position) }
}
