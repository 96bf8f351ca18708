//! The world: bodies, shapes and arbiters by id, and the step that moves them.

mod arbiters;
mod bearings;
mod bodies;
mod collide;
mod contact_events;
mod continuous;
mod definition;
mod events;
mod filters;
mod numbers;
mod one_way;
mod pairs;
mod queries;
mod sensors;
mod settings;
mod shapes;
mod sleep;
mod step;
mod timings;
mod validate;

pub use crate::error::{Error, UNIT_TOLERANCE};
pub use crate::id::{BodyId, ShapeId};
pub use bodies::{BodyMut, BodyRef};
pub use contact_events::{HitEvent, HitListener, PersistEvent, PreSolveListener};
pub use continuous::Impact;
pub use definition::{
    Anisotropy, BodyDefinition, BodyKind, CombineRule, ContactEvents, Filter, LockedAxes, Material, ShapeDefinition,
};
pub use events::{BeginEvent, BeginListener, ContactProvider, EndEvent, EndListener, SensorEvent, StepContext};
pub use filters::{ContactFilter, PairFilter, ShapePair};
pub(crate) use one_way::stops;
pub use queries::{BodyKinds, CastHit, PointHit, QueryFilter, RayHit, ShapeContacts, ShapePredicate};
pub use settings::WorldSettings;
pub use shapes::{ShapeMut, ShapeRef};
pub use step::StepReport;
pub use timings::{Phase, Timings};

use crate::arbiter::{ArbiterStore, EndReason, NONE};
use crate::broad_phase::{BroadPhase, PairSet};
use crate::edge_lists::EdgeLists;
use crate::error::unit_rotation;
use crate::island::{IslandFinder, SleepingIslands};
use crate::math::{Pose, Real};
use crate::parallel::StagePool;
use crate::place_table::PlaceTable;
use crate::simd::SimdLevel;
use crate::solver::{ContactSolver, RowPlan, SolverBodies, contact_solver};
use crate::storage;
use bearings::Bearings;
use bodies::Body;
use std::sync::atomic::{AtomicU32, Ordering};

/// Everything that steps together: bodies, their shapes, and the arbiters between them.
///
/// A world is `Send` and `Sync`: it may be moved to another thread, and several threads may query it at once.
///
/// ```
/// use arbiter3d::{BodyDefinition, BodyId, Shape, ShapeDefinition, World, math::Vec3};
/// let mut world = World::default();
/// let ground = Shape::cuboid(Vec3::new(20.0, 1.0, 20.0))?;
/// world.add_shape(BodyId::WORLD, &ShapeDefinition::new(ground).at(Vec3::new(0.0, -1.0, 0.0)))?;
/// let ball = world.add_body(&BodyDefinition::dynamic().at(Vec3::new(0.0, 3.0, 0.0)))?;
/// world.add_shape(ball, &ShapeDefinition::new(Shape::sphere(0.5)?))?;
/// for _ in 0..180 {
///     world.step(1.0 / 60.0)?;
/// }
/// assert!((world.body(ball).unwrap().position().y - 0.5).abs() < 0.01);
/// # Ok::<(), arbiter3d::Error>(())
/// ```
pub struct World {
    settings: WorldSettings,
    /// The settings with lengths in the world's units.
    scaled: WorldSettings,
    /// Where generations start, so that ids of one world are unlikely to be taken for another's.
    tag: u32,
    next_id: u64,
    /// Seconds of the last step.
    dt: Real,
    bodies: Vec<Body>,
    free_bodies: Vec<u32>,
    solver_bodies: SolverBodies,
    /// Awake dynamic and moving kinematic bodies, in no particular order.
    awake: Vec<u32>,
    /// Whether that list has changed since the step made its own of it.
    awake_changed: bool,
    shapes: Vec<shapes::ShapeSlot>,
    free_shapes: Vec<u32>,
    /// Shapes whose proxies have moved since the last narrow phase, by slot.
    moved_shapes: Vec<bool>,
    /// Places of the shapes, by id.
    shape_slots: PlaceTable,
    broad_phase: BroadPhase,
    pairs: Vec<pairs::Pair>,
    free_pairs: Vec<u32>,
    /// The pairs of each body.
    pair_lists: EdgeLists,
    bearings: Bearings,
    pair_set: PairSet,
    active_pairs: pairs::PlaceSet,
    arbiters: ArbiterStore,
    sleeping: SleepingIslands,
    finder: IslandFinder,
    plan: RowPlan,
    solver: Box<dyn ContactSolver>,
    level: SimdLevel,
    pool: StagePool,
    events: events::Events,
    listeners: events::Listeners,
    filters: filters::UserFilters,
    providers: Vec<Box<dyn ContactProvider>>,
    removals: Vec<events::Removal>,
    timings: Timings,
    scratch: step::StepScratch,
    narrow: collide::NarrowPhaseScratch,
    /// How many shapes are sensors.
    sensors: u32,
    /// Static shapes that have come or moved since the last search for pairs: those of two static shapes are found
    /// apart.
    still_news: Vec<u32>,
    /// Pairs of sensors that nobody awake has, and that have to be looked at once.
    resting_sensors: Vec<u32>,
    wake_scratch: Vec<u32>,
    index_scratch: Vec<u32>,
    /// Where fast bodies stop.
    stops: Vec<Option<continuous::Held>>,
    /// Kinematic bodies, sorted, and those of them that are awake; and their shapes on their ways, while fast bodies are
    /// looked at.
    kinematic: Vec<u32>,
    awake_kinematic: Vec<u32>,
    /// Bullets, sorted; and what their flight needs.
    bullets: Vec<u32>,
    flight: continuous::FlightScratch,
    impacts: Vec<Impact>,
    kinematic_shapes: Vec<continuous::KinematicShape>,
    member_scratch: Vec<(u32, u32)>,
    /// Bodies of new pairs, and whether one is awake.
    tie_scratch: Vec<pairs::Tie>,
}

impl std::fmt::Debug for World {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("World")
            .field("bodies", &self.body_count())
            .field("arbiters", &self.arbiter_count())
            .field("awake", &self.awake_count())
            .finish_non_exhaustive()
    }
}

impl Default for World {
    fn default() -> Self {
        Self::build(WorldSettings::default())
    }
}

impl World {
    /// An empty world with these settings.
    ///
    /// # Errors
    /// If a setting is not finite or out of its range, or asks for an instruction set that this machine lacks.
    pub fn new(settings: WorldSettings) -> Result<Self, Error> {
        settings.validate()?;
        Ok(Self::build(settings))
    }

    fn build(settings: WorldSettings) -> Self {
        static WORLDS: AtomicU32 = AtomicU32::new(0);
        let tag = WORLDS.fetch_add(1, Ordering::Relaxed).wrapping_mul(0x9E37_79B1);
        let level = settings.simd.unwrap_or_else(SimdLevel::best);
        let mut world = Self {
            settings,
            scaled: settings.scaled(),
            tag,
            next_id: 1,
            dt: 0.0,
            bodies: vec![Body::new(0)],
            free_bodies: Vec::new(),
            solver_bodies: SolverBodies::default(),
            awake: Vec::new(),
            awake_changed: false,
            shapes: Vec::new(),
            free_shapes: Vec::new(),
            moved_shapes: Vec::new(),
            shape_slots: PlaceTable::default(),
            broad_phase: BroadPhase::new(),
            pairs: Vec::new(),
            free_pairs: Vec::new(),
            pair_lists: EdgeLists::default(),
            bearings: Bearings::default(),
            pair_set: PairSet::new(),
            active_pairs: pairs::PlaceSet::default(),
            arbiters: ArbiterStore::new(tag),
            sleeping: SleepingIslands::default(),
            finder: IslandFinder::default(),
            plan: RowPlan::default(),
            solver: contact_solver(level),
            level,
            pool: StagePool::new(settings.threads),
            events: events::Events::default(),
            listeners: events::Listeners::default(),
            filters: filters::UserFilters::default(),
            providers: Vec::new(),
            removals: Vec::new(),
            timings: Timings::default(),
            scratch: step::StepScratch::default(),
            narrow: collide::NarrowPhaseScratch::default(),
            sensors: 0,
            still_news: Vec::new(),
            resting_sensors: Vec::new(),
            wake_scratch: Vec::new(),
            index_scratch: Vec::new(),
            stops: Vec::new(),
            kinematic: Vec::new(),
            awake_kinematic: Vec::new(),
            bullets: Vec::new(),
            flight: continuous::FlightScratch::default(),
            impacts: Vec::new(),
            kinematic_shapes: Vec::new(),
            member_scratch: Vec::new(),
            tie_scratch: Vec::new(),
        };
        world.solver_bodies.push();
        world.refresh_solver_body(0);
        world
    }

    /// The settings.
    #[must_use]
    pub fn settings(&self) -> &WorldSettings {
        &self.settings
    }

    /// Changes the settings from the next step on. A change of gravity wakes all bodies.
    ///
    /// # Errors
    /// As [`World::new`].
    pub fn set_settings(&mut self, settings: WorldSettings) -> Result<(), Error> {
        settings.validate()?;
        let level = settings.simd.unwrap_or_else(SimdLevel::best);
        if level != self.level {
            self.level = level;
            self.solver = contact_solver(level);
        }
        if settings.threads != self.settings.threads {
            self.pool = StagePool::new(settings.threads);
        }
        let falls = settings.gravity != self.settings.gravity;
        self.settings = settings;
        self.scaled = settings.scaled();
        if falls || !settings.allow_sleep {
            self.wake_all();
        }
        Ok(())
    }

    /// Wakes every body.
    pub fn wake_all(&mut self) {
        for index in 0..self.bodies.len() as u32 {
            if self.bodies[index as usize].alive {
                self.wake(index);
            }
        }
    }

    /// The instruction set in use.
    #[must_use]
    pub fn simd_level(&self) -> SimdLevel {
        self.level
    }

    /// How long each phase of the last step took.
    #[must_use]
    pub fn timings(&self) -> &Timings {
        &self.timings
    }

    /// A body, to read.
    #[must_use]
    pub fn body(&self, id: BodyId) -> Option<BodyRef<'_>> {
        self.body_index(id).ok().map(|_| BodyRef::new(self, id))
    }

    /// A body, to read and change.
    pub fn body_mut(&mut self, id: BodyId) -> Option<BodyMut<'_>> {
        self.body_index(id).ok().map(|_| BodyMut::new(self, id))
    }

    /// All bodies in the order of their slots, [`BodyId::WORLD`] first.
    pub fn bodies(&self) -> impl Iterator<Item = BodyId> + '_ {
        let alive = self.bodies.iter().enumerate().filter(|(_, body)| body.alive);
        alive.map(|(index, body)| BodyId { index: index as u32, generation: body.generation })
    }

    /// A shape, to read.
    #[must_use]
    pub fn shape(&self, id: ShapeId) -> Option<ShapeRef<'_>> {
        self.shape_slot(id).ok().map(|slot| ShapeRef::new(self, slot))
    }

    /// A shape, to read and change.
    pub fn shape_mut(&mut self, id: ShapeId) -> Option<ShapeMut<'_>> {
        self.shape_slot(id).ok().map(|slot| ShapeMut::new(self, slot))
    }

    /// Adds a body without shapes and returns its id.
    ///
    /// # Errors
    /// If a number of the definition is not finite or out of its range, or the rotation is not of unit length.
    pub fn add_body(&mut self, definition: &BodyDefinition) -> Result<BodyId, Error> {
        definition.validate()?;
        let rotation = unit_rotation("rotation", definition.rotation)?;
        let index = if let Some(index) = self.free_bodies.pop() {
            let generation = self.bodies[index as usize].generation.wrapping_add(1);
            self.bodies[index as usize] = Body::new(generation);
            self.solver_bodies.reset(index as usize);
            index
        } else {
            storage::push(&mut self.bodies, Body::new(self.tag.wrapping_add(1)));
            self.solver_bodies.push();
            self.sleeping.reserve(self.bodies.len());
            crate::storage::reserve(&mut self.wake_scratch, self.bodies.len());
            (self.bodies.len() - 1) as u32
        };
        let body = &mut self.bodies[index as usize];
        body.kind = definition.kind;
        body.pose = Pose::new(definition.position, rotation);
        body.given_mass = definition.mass;
        body.gravity_scale = definition.gravity_scale;
        body.locked_axes = definition.locked_axes;
        body.can_sleep = definition.can_sleep;
        body.enabled = definition.enabled;
        body.continuous = definition.continuous;
        body.bullet = definition.bullet;
        body.user_data = definition.user_data;
        let (linear, angular) = definition.locked_axes.free();
        let state = &mut self.solver_bodies.states[index as usize];
        state.linear_velocity = definition.linear_velocity * linear;
        state.angular_velocity = definition.angular_velocity * angular;
        let motion = &mut self.solver_bodies.motions[index as usize];
        (motion.linear_damping, motion.angular_damping) = (definition.linear_damping, definition.angular_damping);
        self.update_mass(index);
        self.note_kind(index);
        if definition.awake {
            self.wake(index);
        } else if definition.kind == BodyKind::Dynamic && definition.enabled && definition.can_sleep {
            self.bodies[index as usize].island = self.sleeping.add(&[index]);
        } else {
            self.wake(index);
        }
        Ok(self.body_id(index))
    }

    /// Removes a body with its shapes; its arbiters end, and what touched it wakes.
    ///
    /// # Errors
    /// If it is unknown, or the world's own.
    pub fn remove_body(&mut self, id: BodyId) -> Result<(), Error> {
        let index = self.body_index(id)?;
        if id == BodyId::WORLD {
            return Err(Error::WorldBody);
        }
        self.end_arbiters_of(index, EndReason::BodyRemoved);
        for slot in std::mem::take(&mut self.bodies[index as usize].shape_slots) {
            self.drop_shape(slot, EndReason::BodyRemoved);
        }
        self.leave_sleep(index);
        self.bodies[index as usize].alive = false;
        self.note_kind(index);
        self.solver_bodies.reset(index as usize);
        self.flush_events();
        self.listeners.forget_body(index);
        self.free_bodies.push(index);
        Ok(())
    }

    /// Removes all bodies but the world's own, all shapes and all arbiters; ends are raised. Listeners of the world, providers
    /// and settings stay.
    pub fn clear(&mut self) {
        let arbiters: Vec<u32> = self.arbiters.iter().map(|arbiter| arbiter.id().index).collect();
        for index in arbiters {
            self.end_arbiter(index, EndReason::WorldCleared);
        }
        self.flush_events();
        let bodies: Vec<BodyId> = self.bodies().collect();
        for id in bodies {
            for shape in self.bodies[id.index as usize].shapes.clone() {
                drop(self.remove_shape(shape));
            }
            drop(self.remove_body(id));
        }
    }

    /// Takes a body off the awake list or out of its sleeping island.
    fn leave_sleep(&mut self, index: u32) {
        self.set_asleep(index);
        let island = std::mem::replace(&mut self.bodies[index as usize].island, NONE);
        if island != NONE {
            self.sleeping.remove_body(island, index);
        }
    }

    /// A body was placed elsewhere: refresh what depends on its pose, and wake what this concerns.
    fn body_teleported(&mut self, index: u32) {
        self.refresh_solver_body(index);
        self.wake_neighbours(index);
        self.clear_contacts_of(index);
        let slots = self.bodies[index as usize].shape_slots.clone();
        if self.bodies[index as usize].enabled {
            for slot in slots {
                let tight = self.tight_aabb(slot);
                let near = tight.expand(self.scaled.speculative_distance);
                if self.broad_phase.update(slot, &near, &tight.expand(self.fat_margin(slot))) {
                    self.note_moved(slot);
                    self.note_still(slot);
                }
            }
        }
        self.forget_manifolds(index);
        self.wake(index);
    }

    /// A proxy has moved: its pairs are tested for overlap in the next narrow phase.
    fn note_moved(&mut self, slot: u32) {
        self.moved_shapes[slot as usize] = true;
        self.scratch.note_moved(slot);
        // Pairs whose bodies all rest are not visited: they are tested here and now.
        let body = self.shapes[slot as usize].body;
        let resting: Vec<u32> = self.pairs_of_body(body).filter(|&pair| !self.pairs[pair as usize].active).collect();
        for pair in resting {
            let boxes = self.pairs[pair as usize].shapes.map(|slot| self.broad_phase.fat_aabb(slot).copied());
            if !matches!(boxes, [Some(a), Some(b)] if a.overlaps(&b)) {
                self.remove_pair(pair, EndReason::Separated);
            }
        }
    }

    /// Manifolds of a body's pairs are made anew in the next step.
    fn forget_manifolds(&mut self, index: u32) {
        let pairs: Vec<u32> = self.pairs_of_body(index).collect();
        for index in pairs {
            let pair = &mut self.pairs[index as usize];
            pair.has_manifold = false;
            if pair.sensor && !pair.active {
                storage::push(&mut self.resting_sensors, index);
            }
        }
    }

    /// Keeps the lists of kinematic bodies and of bullets.
    fn note_kind(&mut self, index: u32) {
        let body = &self.bodies[index as usize];
        let kinematic = body.alive && body.kind == BodyKind::Kinematic;
        let bullet = body.alive && body.bullet;
        list_body(&mut self.kinematic, index, kinematic);
        list_body(&mut self.bullets, index, bullet);
        storage::reserve(&mut self.awake_kinematic, self.kinematic.len());
    }

    fn change_kind(&mut self, index: u32, kind: BodyKind) {
        self.wake_neighbours(index);
        self.end_arbiters_of(index, EndReason::KindChanged);
        let slots = self.bodies[index as usize].shape_slots.clone();
        for &slot in &slots {
            self.remove_proxy(slot, EndReason::KindChanged);
        }
        self.leave_sleep(index);
        self.bodies[index as usize].kind = kind;
        self.note_kind(index);
        self.refresh_solver_body(index);
        if self.bodies[index as usize].enabled {
            for &slot in &slots {
                self.add_proxy(slot);
            }
        }
        self.wake(index);
    }

    fn change_enabled(&mut self, index: u32, enabled: bool) {
        let slots = self.bodies[index as usize].shape_slots.clone();
        if enabled {
            self.bodies[index as usize].enabled = true;
            self.refresh_solver_body(index);
            for slot in slots {
                self.add_proxy(slot);
            }
            self.wake(index);
        } else {
            self.wake_neighbours(index);
            self.end_arbiters_of(index, EndReason::BodyDisabled);
            for slot in slots {
                self.remove_proxy(slot, EndReason::BodyDisabled);
            }
            self.leave_sleep(index);
            self.bodies[index as usize].enabled = false;
            self.refresh_solver_body(index);
        }
    }

    /// Largest coordinate of any velocity component, for tests of sanity.
    #[cfg(debug_assertions)]
    fn validate_quick(&self) -> Result<(), String> {
        for &index in &self.awake {
            let state = &self.solver_bodies.states[index as usize];
            let pose = &self.bodies[index as usize].pose;
            if !(pose.is_finite() && state.linear_velocity.is_finite() && state.angular_velocity.is_finite()) {
                return Err(format!("body {index} is not finite: {pose:?}"));
            }
        }
        Ok(())
    }
}

/// Keeps a body in a sorted list, or out of it.
fn list_body(list: &mut Vec<u32>, index: u32, listed: bool) {
    match list.binary_search(&index) {
        Ok(at) if !listed => drop(list.remove(at)),
        Err(at) if listed => {
            storage::reserve(list, list.len() + 1);
            list.insert(at, index);
        }
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::World;

    #[test]
    fn worlds_move_between_threads_and_are_queried_from_several() {
        fn is_send_and_sync<T: Send + Sync>() {}
        is_send_and_sync::<World>();
    }
}
