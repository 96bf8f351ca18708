//! A character that walks, climbs stairs, slides, jumps, rides platforms and pushes things.
//!
//! An update has these parts, each a function of [`ShapeMover`] or of this file:
//!
//! 1. *Recover*: out of what has come too close since the last update, as kinematic walls do.
//! 2. *Probe*: what is below, how it moves, whether one can stand on it.
//! 3. *Steer*: the velocity against the ground goes towards the wanted one; in the air gravity counts, and less
//!    steering.
//! 4. *Walk* along the ground: slide; where something blocks, try to step over it; then sink to the ground again, which
//!    is how stairs are walked down. Or *fly*: slide along half old, half new velocity, and lose what points into
//!    obstacles.
//! 5. *Carry*: move as the ground will in the coming step, its turning included.
//! 6. *Push* dynamic bodies in the way with a force up to `push_force`; press on those below with the weight.
//!
//! Small errors of the height (below a twentieth of the skin) are left alone, so a character at rest has a vertical
//! speed of exactly zero. Call [`CharacterController::update`] before each [`World::step`] with the same `dt`.

use super::mover::{Ground, MoverLists, ShapeMover};
use super::planes::{PlaneLimit, solve_planes};
use crate::error::{Error, finite, finite_vec, in_range, unit_vec};
use crate::id::BodyId;
use crate::math::{Real, Vec3, clamp, max, sin_cos};
use crate::shape::Shape;
use crate::world::{BodyKind, QueryFilter, World};

/// What a character is like.
///
/// ```
/// use arbiter3d::CharacterSettings;
/// let child = CharacterSettings { height: 1.1, radius: 0.2, mass: 25.0, ..CharacterSettings::default() };
/// ```
#[derive(Clone, Debug)]
pub struct CharacterSettings {
    /// Radius of the capsule, metres (10⁻³ to 10³). Default 0.35.
    pub radius: Real,
    /// Height of the capsule, metres; more than twice the radius. Default 1.8.
    pub height: Real,
    /// Depth of the outermost layer of the capsule that is kept free of overlap, metres; above 0 and less than half the
    /// radius. Default 0.02.
    pub skin: Real,
    /// Unit vector up. Default +y.
    pub up: Vec3,
    /// Steepest slope that can be walked on, radians (0 to 1.5). Default 0.8727, that is 50°.
    pub max_slope: Real,
    /// Highest step that is walked up or down, metres (0 to 10³). Default 0.35.
    pub step_height: Real,
    /// Gravity against `up`, m/s² (0 to 10³). Default 9.81.
    pub gravity: Real,
    /// How fast the velocity on the ground can change, m/s² (0 to 10⁶). Default 60.
    pub acceleration: Real,
    /// How fast the level velocity in the air can change, m/s² (0 to 10⁶). Default 12.
    pub air_acceleration: Real,
    /// Fastest fall, m/s (0 to 10⁴). Default 60.
    pub max_fall_speed: Real,
    /// Weight that presses on dynamic bodies below, kg (0 to 10⁶). Default 75.
    pub mass: Real,
    /// Force with which dynamic bodies are pushed aside at most, N (0 to 10⁹). Default 500.
    pub push_force: Real,
    /// What is in its way. Default everything but sensors.
    pub filter: QueryFilter<'static>,
}

impl Default for CharacterSettings {
    fn default() -> Self {
        Self {
            radius: 0.35,
            height: 1.8,
            skin: 0.02,
            up: Vec3::Y,
            max_slope: 0.872_664_6,
            step_height: 0.35,
            gravity: 9.81,
            acceleration: 60.0,
            air_acceleration: 12.0,
            max_fall_speed: 60.0,
            mass: 75.0,
            push_force: 500.0,
            filter: QueryFilter::default(),
        }
    }
}

impl CharacterSettings {
    fn validate(&self) -> Result<(), Error> {
        in_range("character radius", self.radius, 1e-3, 1e3)?;
        in_range("character height", self.height, 2.0 * self.radius + 1e-4, 1e4)?;
        in_range("character skin", self.skin, 1e-5, 0.5 * self.radius)?;
        unit_vec("character up", self.up)?;
        in_range("max_slope", self.max_slope, 0.0, 1.5)?;
        in_range("step_height", self.step_height, 0.0, 1e3)?;
        in_range("character gravity", self.gravity, 0.0, 1e3)?;
        in_range("acceleration", self.acceleration, 0.0, 1e6)?;
        in_range("air_acceleration", self.air_acceleration, 0.0, 1e6)?;
        in_range("max_fall_speed", self.max_fall_speed, 0.0, 1e4)?;
        in_range("character mass", self.mass, 0.0, 1e6)?;
        in_range("push_force", self.push_force, 0.0, 1e9).map(|_| ())
    }
}

/// A walking capsule.
///
/// It has no body: the world does not feel it but by its pushes and its weight. Give it a kinematic body of your own,
/// left out by `filter`, if others shall bump into it.
///
/// ```
/// use arbiter3d::{BodyId, CharacterController, CharacterSettings, Shape, ShapeDefinition, World, math::Vec3};
/// let mut world = World::default();
/// let floor = ShapeDefinition::new(Shape::cuboid(Vec3::new(50.0, 1.0, 50.0))?);
/// world.add_shape(BodyId::WORLD, &floor.at(Vec3::new(0.0, -1.0, 0.0)))?;
/// let mut hero = CharacterController::new(Vec3::ZERO, CharacterSettings::default())?;
/// for _ in 0..60 {
///     hero.update(&mut world, Vec3::new(3.0, 0.0, 0.0), 1.0 / 60.0)?;
///     world.step(1.0 / 60.0)?;
/// }
/// assert!(hero.is_on_ground() && (hero.position().x - 3.0).abs() < 0.1);
/// # Ok::<(), arbiter3d::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct CharacterController {
    settings: CharacterSettings,
    /// The capsule without its skin.
    core: Shape,
    walkable_cosine: Real,
    /// Middle of the capsule.
    center: Vec3,
    velocity: Vec3,
    ground: Option<Ground>,
    /// Rises from a jump: does not stick to the ground.
    rising: bool,
    /// Caught between things that leave no room.
    crushed: bool,
    lists: MoverLists,
    /// What the ground does not carry it through: all that the filter excludes, and the ground.
    excluded: Vec<BodyId>,
}

impl CharacterController {
    /// A character that stands with its feet at a position, metres.
    ///
    /// # Errors
    /// If a number is not finite or out of its range.
    pub fn new(position: Vec3, settings: CharacterSettings) -> Result<Self, Error> {
        finite_vec("position of the character", position)?;
        settings.validate()?;
        let half_length = 0.5 * settings.height - settings.radius;
        let core = Shape::capsule(half_length, settings.radius - settings.skin)?;
        let center = position + settings.up * (0.5 * settings.height);
        let walkable_cosine = sin_cos(settings.max_slope).1;
        Ok(Self {
            settings,
            core,
            walkable_cosine,
            center,
            velocity: Vec3::ZERO,
            ground: None,
            rising: false,
            crushed: false,
            lists: MoverLists::default(),
            excluded: Vec::new(),
        })
    }

    /// What it is like.
    #[must_use]
    pub fn settings(&self) -> &CharacterSettings {
        &self.settings
    }

    /// Where its feet are, metres.
    #[must_use]
    pub fn position(&self) -> Vec3 {
        self.center - self.settings.up * (0.5 * self.settings.height)
    }

    /// Middle of the capsule, metres.
    #[must_use]
    pub fn center(&self) -> Vec3 {
        self.center
    }

    /// Velocity, m/s, that of the ground included.
    #[must_use]
    pub fn velocity(&self) -> Vec3 {
        self.velocity
    }

    /// What it stands on; `None` in the air.
    #[must_use]
    pub fn ground(&self) -> Option<&Ground> {
        self.ground.as_ref()
    }

    /// Whether it stands on something.
    #[must_use]
    pub fn is_on_ground(&self) -> bool {
        self.ground.is_some()
    }

    /// Whether it was caught in the last update between things that left it no room.
    #[must_use]
    pub fn is_crushed(&self) -> bool {
        self.crushed
    }

    /// Puts its feet somewhere else, metres; it then stands on nothing until the next update.
    ///
    /// # Errors
    /// If the position is not finite.
    pub fn set_position(&mut self, position: Vec3) -> Result<(), Error> {
        finite_vec("position of the character", position)?;
        self.center = position + self.settings.up * (0.5 * self.settings.height);
        self.ground = None;
        Ok(())
    }

    /// Sets its velocity, m/s: a blow, a spring board. Upwards it leaves the ground.
    ///
    /// # Errors
    /// If it is not finite.
    pub fn set_velocity(&mut self, velocity: Vec3) -> Result<(), Error> {
        self.velocity = finite_vec("velocity of the character", velocity)?;
        let below = self.ground.map_or(Vec3::ZERO, |ground| ground.velocity);
        if (velocity - below).dot(self.settings.up) > 0.01 {
            (self.rising, self.ground) = (true, None);
        }
        Ok(())
    }

    /// Jumps with a speed against the ground, m/s; does nothing in the air. Says whether it jumped.
    ///
    /// # Errors
    /// If the speed is not finite.
    pub fn jump(&mut self, speed: Real) -> Result<bool, Error> {
        finite("jump speed", speed)?;
        let Some(ground) = self.ground else { return Ok(false) };
        let up = self.settings.up;
        self.velocity = self.level(self.velocity) + up * (ground.velocity.dot(up) + speed);
        (self.rising, self.ground) = (true, None);
        Ok(true)
    }

    /// The speed of a jump of some height, metres: `√(2 g h)`.
    #[must_use]
    pub fn jump_speed(&self, height: Real) -> Real {
        (2.0 * self.settings.gravity * max(height, 0.0)).sqrt()
    }

    /// Moves for a step of `dt` seconds, with the `wanted` velocity against the ground (m/s; its part along `up` does
    /// not count).
    ///
    /// # Errors
    /// If a number is not finite, or `dt` is not above 0 and at most 1.
    pub fn update(&mut self, world: &mut World, wanted: Vec3, dt: Real) -> Result<(), Error> {
        in_range("dt", dt, 1e-6, 1.0)?;
        let wanted = self.level(finite_vec("wanted velocity", wanted)?);
        let mut lists = std::mem::take(&mut self.lists);
        let result = self.update_with(world, wanted, dt, &mut lists);
        self.lists = lists;
        result
    }

    fn update_with(&mut self, world: &mut World, wanted: Vec3, dt: Real, lists: &mut MoverLists) -> Result<(), Error> {
        let (push, free) = self.mover(&self.settings.filter).recover_with(world, self.center, lists)?;
        self.center += push;
        self.crushed = !free;
        self.find_ground(world, lists)?;
        let base = self.ground.map_or(Vec3::ZERO, |ground| ground.velocity);
        if self.ground.is_none() {
            self.fly(world, wanted, dt, lists)?;
            return self.push_bodies(world, base + wanted, dt, lists);
        }
        self.walk(world, wanted, dt, lists)?;
        self.push_bodies(world, base + wanted, dt, lists)?;
        self.carry(world, dt, lists)
    }

    fn mover<'a>(&'a self, filter: &QueryFilter<'a>) -> ShapeMover<'a> {
        ShapeMover {
            shape: &self.core,
            skin: self.settings.skin,
            up: self.settings.up,
            walkable_cosine: self.walkable_cosine,
            filter: *filter,
        }
    }

    /// The part of a vector at right angles to up.
    fn level(&self, vector: Vec3) -> Vec3 {
        vector - self.settings.up * vector.dot(self.settings.up)
    }

    /// Errors of the height that are left alone.
    fn slack(&self) -> Real {
        0.05 * self.settings.skin
    }

    /// Looks for ground: from the ground as far down as a step, from the air only what is touched and not left behind.
    fn find_ground(&mut self, world: &World, lists: &mut MoverLists) -> Result<(), Error> {
        let up = self.settings.up;
        let step = self.settings.step_height;
        let reach = if self.ground.is_some() { step } else { self.slack() };
        let found = self.mover(&self.settings.filter).probe_ground_with(world, self.center, max(step, reach), lists)?;
        let Some(found) = found else {
            self.ground = None;
            return Ok(());
        };
        let rise = (self.velocity - found.velocity).dot(up);
        self.rising &= rise > 1e-3;
        let touches = found.distance <= reach && !self.rising && (self.ground.is_some() || rise <= 1e-3);
        let stands = touches && (found.walkable || self.is_wedged(world, lists)?);
        self.ground = stands.then_some(found);
        Ok(())
    }

    /// Whether steep things around it keep it from sinking: a crevice holds as well as a floor.
    fn is_wedged(&self, world: &World, lists: &mut MoverLists) -> Result<bool, Error> {
        self.mover(&self.settings.filter).planes_at(world, self.center, 1.5 * self.settings.skin, lists)?;
        let MoverLists { planes, limits, .. } = lists;
        limits.clear();
        limits.extend(planes.iter().map(|plane| PlaneLimit { normal: plane.normal, least: 0.0 }));
        Ok(solve_planes(-self.settings.up, limits).vector.length() < 0.1)
    }

    /// Towards a velocity, by at most `change`.
    fn steer(from: Vec3, to: Vec3, change: Real) -> Vec3 {
        let way = to - from;
        let length = way.length();
        if length <= change { to } else { from + way * (change / length) }
    }

    fn walk(&mut self, world: &World, wanted: Vec3, dt: Real, lists: &mut MoverLists) -> Result<(), Error> {
        let Some(ground) = self.ground else { return Ok(()) };
        let settings = &self.settings;
        let up = settings.up;
        let speed = self.level(self.velocity - ground.velocity);
        let speed = Self::steer(speed, wanted, settings.acceleration * dt);
        let mover = self.mover(&settings.filter);
        let level = speed * dt;
        let mut position = self.center;
        if level.length() > 1e-6 {
            // Along the ground, at the speed that is wanted.
            let rise = ground.normal.dot(up);
            let normal = if rise >= self.walkable_cosine { ground.normal } else { up };
            let along = level - up * (level.dot(normal) / normal.dot(up));
            let along = along * (level.length() / along.length());
            let slide = mover.slide_with(world, position, along, lists)?;
            let progress = |end: Vec3| (end - self.center).dot(level) / level.length();
            position = slide.position;
            if slide.blocked && progress(position) < 0.95 * progress(self.center + along) {
                let stepped = mover.step_up_with(world, self.center, (level, settings.step_height), lists)?;
                if let Some(stepped) = stepped.filter(|&end| progress(end) > progress(position) + 1e-4) {
                    position = stepped;
                }
            }
        }
        let found = mover.probe_ground_with(world, position, settings.step_height, lists)?;
        let moved = self.level(position - self.center);
        // Wedged in a crevice there is nothing to walk on but what held before.
        let held = found.filter(|found| found.walkable || !ground.walkable);
        if let Some(found) = held {
            let sink = if found.distance.abs() > self.slack() { found.distance } else { 0.0 };
            if sink > 0.0 {
                position += mover.advance(world, position, up * -sink, &[])?.0;
                position = mover.raised(world, position, lists)?;
            } else if found.normal.dot(up) >= self.walkable_cosine {
                position -= up * sink;
            }
        }
        (self.center, self.ground) = (position, held);
        self.velocity = ground.velocity + if level.length() > 1e-6 { moved / dt } else { Vec3::ZERO };
        Ok(())
    }

    fn fly(&mut self, world: &World, wanted: Vec3, dt: Real, lists: &mut MoverLists) -> Result<(), Error> {
        let settings = &self.settings;
        let up = settings.up;
        let (level, fall) = (self.level(self.velocity), self.velocity.dot(up));
        // Without a wish the flight goes on as it is.
        let level = if wanted == Vec3::ZERO {
            level
        } else {
            let change = Self::steer(level, wanted, settings.air_acceleration * dt) - level;
            level + self.change_beside_walls(world, change, lists)?
        };
        let next = max(fall - settings.gravity * dt, -settings.max_fall_speed);
        let before = self.velocity;
        let velocity = level + up * next;
        let mover = self.mover(&settings.filter);
        let way = (self.level(before) + level + up * (fall + next)) * (0.5 * dt);
        let slide = mover.slide_with(world, self.center, way, lists)?;
        mover.planes_at(world, slide.position, 1.1 * settings.skin, lists)?;
        self.velocity = self.clipped(world, velocity, lists);
        self.center = slide.position;
        self.find_ground(world, lists)
    }

    /// A change of the level velocity without what points into walls and steep slopes: else leaning against a slope
    /// would slow the slide down on it.
    fn change_beside_walls(&self, world: &World, change: Vec3, lists: &mut MoverLists) -> Result<Vec3, Error> {
        let mover = self.mover(&self.settings.filter);
        mover.planes_at(world, self.center, 1.1 * self.settings.skin, lists)?;
        let MoverLists { planes, limits, .. } = lists;
        limits.clear();
        limits.extend(planes.iter().filter_map(|p| mover.wall(PlaneLimit { normal: p.normal, least: 0.0 })));
        Ok(solve_planes(change, limits).vector)
    }

    /// A velocity without what points into the planes listed, each of which moves with its body.
    fn clipped(&self, world: &World, velocity: Vec3, lists: &mut MoverLists) -> Vec3 {
        let mover = self.mover(&self.settings.filter);
        let MoverLists { planes, limits, .. } = lists;
        limits.clear();
        for plane in &*planes {
            let surface = world.body(plane.body).map_or(Vec3::ZERO, |body| body.velocity_at(plane.point));
            limits.push(PlaneLimit { normal: plane.normal, least: surface.dot(plane.normal) });
        }
        for index in 0..limits.len() {
            limits.extend(mover.wall(limits[index]));
        }
        solve_planes(velocity, limits).vector
    }

    /// Goes with the ground for the coming step, along a circle where it turns.
    fn carry(&mut self, world: &World, dt: Real, lists: &mut MoverLists) -> Result<(), Error> {
        let Some(ground) = self.ground else { return Ok(()) };
        let Some(body) = world.body(ground.body) else { return Ok(()) };
        if body.kind() == BodyKind::Static || !body.is_awake() {
            return Ok(());
        }
        let arm = self.position() - body.center_of_mass();
        let turned = crate::math::Rotation::IDENTITY.integrate(body.angular_velocity() * dt).rotate(arm);
        let way = body.linear_velocity() * dt + (turned - arm);
        // Dynamic ground at rest trembles by less than this.
        if way.length() < 1e-6 {
            return Ok(());
        }
        let mut excluded = std::mem::take(&mut self.excluded);
        excluded.clear();
        excluded.extend(self.settings.filter.exclude_bodies.iter().copied().chain([ground.body]));
        let filter = QueryFilter { exclude_bodies: &excluded, ..self.settings.filter };
        let slide = self.mover(&filter).slide_with(world, self.center, way, lists);
        self.excluded = excluded;
        self.center = slide?.position;
        Ok(())
    }

    /// Pushes the dynamic bodies in the way towards the wanted velocity, and presses on what is below.
    fn push_bodies(&self, world: &mut World, wanted: Vec3, dt: Real, lists: &mut MoverLists) -> Result<(), Error> {
        let settings = &self.settings;
        self.mover(&settings.filter).planes_at(world, self.center, 1.5 * settings.skin, lists)?;
        let planes = &lists.planes;
        for plane in planes {
            let Some(body) = world.body(plane.body) else { continue };
            let below = plane.normal.dot(settings.up) >= self.walkable_cosine;
            if body.kind() != BodyKind::Dynamic || below {
                continue;
            }
            let points = planes.iter().filter(|other| other.shape == plane.shape).count() as Real;
            let approach = plane.normal.dot(body.velocity_at(plane.point) - wanted);
            let turn = (plane.point - body.center_of_mass()).cross(plane.normal);
            let response = 1.0 / max(body.mass(), 1e-30) + turn.dot(body.inverse_inertia().mul(turn));
            let impulse = clamp(approach / response, 0.0, settings.push_force * dt) / points;
            if impulse > 0.0
                && let Some(mut body) = world.body_mut(plane.body)
            {
                body.apply_impulse_at(plane.normal * -impulse, plane.point)?;
            }
        }
        let Some(ground) = self.ground else { return Ok(()) };
        let weight = settings.up * -(settings.mass * settings.gravity);
        let Some(center) = world.body(ground.body).map(|body| body.center_of_mass()) else { return Ok(()) };
        world.add_lasting_force(ground.body, weight, (ground.point - center).cross(weight))
    }
}
