//! What happened: begin and end of arbiters, overlaps of sensors; see `contact_events` for what is told on request. To
//! listen with closures, or to drain from lists.
//!
//! Events raised in a step stand in the lists until the next step begins; those raised between two steps stand until the step
//! after next begins, so that draining once after each step sees everything. Their order is that of the keys, whatever the
//! number of threads.
//!
//! Listeners get a [`StepContext`]: they read everything, edit arbiters, register contacts, and ask for removals, which are
//! carried out at the end of the phase.

use super::World;
use super::bodies::BodyRef;
use super::contact_events::{Closing, HitEvent, HitListener, PersistEvent, PreSolveListener, Watched};
use super::shapes::ShapeRef;
use crate::arbiter::{Arbiter, ArbiterId, ArbiterKey, ContactData, ContactPoint, EndReason, IdMap};
use crate::error::Error;
use crate::id::{BodyId, ShapeId};
use crate::math::{Aabb, Real};
use crate::parallel::SharedSlice;
use crate::storage::{self, Peak};

/// Events that a thread copies at a time at least.
const LEAST_EVENTS: usize = 64;

/// An arbiter has begun.
///
/// ```
/// let world = arbiter3d::World::default();
/// for event in world.begin_events() {
///     println!("{:?} and {:?} touch", event.body1, event.body2);
/// }
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BeginEvent {
    /// The arbiter.
    pub arbiter: ArbiterId,
    /// Its key: for shapes, their ids.
    pub key: ArbiterKey,
    /// First body.
    pub body1: BodyId,
    /// Second body.
    pub body2: BodyId,
}

/// An arbiter has ended.
///
/// ```
/// let world = arbiter3d::World::default();
/// for event in world.end_events() {
///     println!("{:?} parted: {:?}", event.key, event.reason);
/// }
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EndEvent {
    /// The arbiter that was; no longer valid.
    pub arbiter: ArbiterId,
    /// Its key.
    pub key: ArbiterKey,
    /// First body; no longer valid if it was removed.
    pub body1: BodyId,
    /// Second body; no longer valid if it was removed.
    pub body2: BodyId,
    /// Why it ended.
    pub reason: EndReason,
    /// Its contacts and material at the end.
    pub data: ContactData,
}

impl EndEvent {
    pub(crate) fn of(arbiter: &Arbiter, reason: EndReason) -> Self {
        Self {
            arbiter: arbiter.id,
            key: arbiter.key,
            body1: arbiter.body1,
            body2: arbiter.body2,
            reason,
            data: arbiter.data,
        }
    }
}

/// A shape has entered or left a sensor.
///
/// ```
/// let world = arbiter3d::World::default();
/// let entered = world.sensor_events().iter().filter(|event| event.begin).count();
/// assert_eq!(entered, 0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct SensorEvent {
    /// The sensor.
    pub sensor: ShapeId,
    /// The shape that entered or left.
    pub visitor: ShapeId,
    /// Whether it entered.
    pub begin: bool,
}

/// Called when an arbiter has begun, before it is solved.
pub type BeginListener = Box<dyn FnMut(&mut StepContext<'_>, ArbiterId) + Send + Sync>;

/// Called when an arbiter has ended.
pub type EndListener = Box<dyn FnMut(&mut StepContext<'_>, &EndEvent) + Send + Sync>;

/// Finds contacts of its own in the narrow phase of each step.
///
/// ```
/// use arbiter3d::*;
/// use arbiter3d::math::Vec3;
///
/// /// An endless floor at height zero, for spheres.
/// struct Floor;
///
/// impl ContactProvider for Floor {
///     fn provide(&mut self, context: &mut StepContext<'_>) {
///         let touching: Vec<_> = context
///             .awake_bodies()
///             .filter_map(|id| Some((id, context.body(id)?.position())))
///             .filter(|(_, position)| position.y < 0.5)
///             .collect();
///         for (id, position) in touching {
///             let key = ArbiterKey::new(u64::MAX, u64::from(id.index()));
///             let bottom = position - Vec3::Y * 0.5;
///             let contact = ContactPoint::new(Vec3::new(position.x, 0.0, position.z), bottom, Vec3::Y);
///             let _ = context.register_contact_by_key(key, BodyId::WORLD, id, contact);
///         }
///     }
/// }
///
/// let mut world = World::default();
/// world.add_contact_provider(Box::new(Floor));
/// let ball = world.add_body(&BodyDefinition::dynamic().at(Vec3::new(0.0, 0.6, 0.0)))?;
/// world.add_shape(ball, &ShapeDefinition::new(Shape::sphere(0.5)?))?;
/// for _ in 0..120 {
///     world.step(1.0 / 60.0)?;
/// }
/// assert!((world.body(ball).unwrap().position().y - 0.5).abs() < 0.01);
/// # Ok::<(), arbiter3d::Error>(())
/// ```
pub trait ContactProvider: Send + Sync {
    /// Registers contacts for the step that is under way. Called once a step, providers in the order they were added.
    fn provide(&mut self, context: &mut StepContext<'_>);
}

/// The world as listeners and contact providers see it in the middle of a step.
///
/// Reading shows the state between two phases. Removals are noted and carried out at the end of the phase.
///
/// ```
/// use arbiter3d::World;
/// let mut world = World::default();
/// world.on_end_collide(Box::new(|context, event| {
///     // Glass: whatever stops touching it is gone.
///     let _ = context.remove_body(event.body2);
/// }));
/// ```
#[derive(Debug)]
pub struct StepContext<'a> {
    world: &'a mut World,
}

/// A removal asked for by a listener.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Removal {
    Body(BodyId),
    Shape(ShapeId),
    Arbiter(ArbiterId),
}

impl<'a> StepContext<'a> {
    pub(crate) fn new(world: &'a mut World) -> Self {
        Self { world }
    }

    /// The whole world, to read.
    #[must_use]
    pub fn world(&self) -> &World {
        self.world
    }

    /// Seconds of the step under way; of the last one for what is raised between two steps.
    #[must_use]
    pub fn dt(&self) -> Real {
        self.world.dt
    }

    /// A body, to read.
    #[must_use]
    pub fn body(&self, id: BodyId) -> Option<BodyRef<'_>> {
        self.world.body(id)
    }

    /// A shape, to read.
    #[must_use]
    pub fn shape(&self, id: ShapeId) -> Option<ShapeRef<'_>> {
        self.world.shape(id)
    }

    /// Bodies that are awake, in the order of their slots.
    pub fn awake_bodies(&self) -> impl Iterator<Item = BodyId> + '_ {
        self.world.bodies().filter(|&id| self.world.bodies[id.index as usize].awake)
    }

    /// An arbiter, to read.
    #[must_use]
    pub fn arbiter(&self, id: ArbiterId) -> Option<&Arbiter> {
        self.world.arbiter_by_id(id)
    }

    /// An arbiter, to change; `None` if it has ended.
    pub fn arbiter_mut(&mut self, id: ArbiterId) -> Option<&mut Arbiter> {
        self.world.arbiter_mut(id)
    }

    /// As [`World::get_or_create_arbiter`].
    ///
    /// # Errors
    /// As there.
    pub fn get_or_create_arbiter(&mut self, key: ArbiterKey, body1: BodyId, body2: BodyId) -> Result<ArbiterId, Error> {
        self.world.get_or_create_arbiter(key, body1, body2)
    }

    /// As [`World::register_contact`].
    ///
    /// # Errors
    /// As there.
    pub fn register_contact(&mut self, arbiter: ArbiterId, contact: ContactPoint) -> Result<(), Error> {
        self.world.register_contact(arbiter, contact)
    }

    /// As [`World::register_contact_by_key`].
    ///
    /// # Errors
    /// As there.
    pub fn register_contact_by_key(
        &mut self,
        key: ArbiterKey,
        body1: BodyId,
        body2: BodyId,
        contact: ContactPoint,
    ) -> Result<ArbiterId, Error> {
        self.world.register_contact_by_key(key, body1, body2, contact)
    }

    /// As [`World::set_contact_separation`].
    ///
    /// # Errors
    /// As there.
    pub fn set_contact_separation(&mut self, arbiter: ArbiterId, slot: usize, separation: Real) -> Result<(), Error> {
        self.world.set_contact_separation(arbiter, slot, separation)
    }

    /// Removes a body at the end of the phase.
    ///
    /// # Errors
    /// If it is unknown or the world's own.
    pub fn remove_body(&mut self, id: BodyId) -> Result<(), Error> {
        self.world.body_index(id)?;
        if id == BodyId::WORLD {
            return Err(Error::WorldBody);
        }
        self.world.removals.push(Removal::Body(id));
        Ok(())
    }

    /// Removes a shape at the end of the phase.
    ///
    /// # Errors
    /// If it is unknown.
    pub fn remove_shape(&mut self, id: ShapeId) -> Result<(), Error> {
        self.world.shape_slot(id)?;
        self.world.removals.push(Removal::Shape(id));
        Ok(())
    }

    /// Removes an arbiter at the end of the phase.
    ///
    /// # Errors
    /// If it has ended.
    pub fn remove_arbiter(&mut self, id: ArbiterId) -> Result<(), Error> {
        self.world.arbiters.index_of(id).ok_or(Error::UnknownArbiter { id })?;
        self.world.removals.push(Removal::Arbiter(id));
        Ok(())
    }

    /// Shapes whose boxes overlap `aabb`, as [`World::overlap_aabb`].
    #[must_use]
    pub fn overlap_aabb(&self, aabb: &Aabb) -> Vec<ShapeId> {
        self.world.overlap_aabb(aabb, &super::QueryFilter::default())
    }
}

/// Closures that listen to one body, or to all.
#[derive(Default)]
pub(crate) struct ListenerSet {
    pub begin: Vec<BeginListener>,
    pub end: Vec<EndListener>,
}

/// All closures.
#[derive(Default)]
pub(crate) struct Listeners {
    pub world: ListenerSet,
    pub pre_solve: Vec<PreSolveListener>,
    pub hit: Vec<HitListener>,
    bodies: IdMap<u32, ListenerSet>,
}

impl std::fmt::Debug for Listeners {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Listeners").field("bodies", &self.bodies.len()).finish_non_exhaustive()
    }
}

impl Listeners {
    pub fn of_body(&mut self, body: u32) -> &mut ListenerSet {
        self.bodies.entry(body).or_default()
    }

    pub fn forget_body(&mut self, body: u32) {
        self.bodies.remove(&body);
    }

    /// Whether nobody listens to ends.
    fn are_deaf_to_ends(&self) -> bool {
        self.bodies.is_empty() && self.world.end.is_empty()
    }

    /// Whether nobody listens to begins.
    fn are_deaf_to_begins(&self) -> bool {
        self.bodies.is_empty() && self.world.begin.is_empty()
    }

    fn begin(&mut self, context: &mut StepContext<'_>, event: &BeginEvent) {
        for body in [event.body1.index, event.body2.index] {
            if let Some(set) = self.bodies.get_mut(&body) {
                set.begin.iter_mut().for_each(|listener| listener(context, event.arbiter));
            }
        }
        self.world.begin.iter_mut().for_each(|listener| listener(context, event.arbiter));
    }

    fn end(&mut self, context: &mut StepContext<'_>, event: &EndEvent) {
        for body in [event.body1.index, event.body2.index] {
            if let Some(set) = self.bodies.get_mut(&body) {
                set.end.iter_mut().for_each(|listener| listener(context, event));
            }
        }
        self.world.end.iter_mut().for_each(|listener| listener(context, event));
    }
}

/// A list of events, of which the older part was there when the last step ended.
#[derive(Clone, Debug)]
pub(crate) struct EventList<T> {
    pub events: Vec<T>,
    seen: usize,
    peak: Peak,
}

impl<T> Default for EventList<T> {
    fn default() -> Self {
        Self { events: Vec::new(), seen: 0, peak: Peak::default() }
    }
}

impl<T> EventList<T> {
    /// A step begins: what was there when the last one ended goes.
    fn begin_step(&mut self) {
        self.events.drain(..self.seen.min(self.events.len()));
        self.seen = 0;
    }

    fn end_step(&mut self) {
        self.seen = self.events.len();
        self.peak.note(self.seen);
        if let Some(count) = self.peak.end_step() {
            storage::shrink(&mut self.events, count);
        }
    }

    pub fn drain(&mut self) -> std::vec::Drain<'_, T> {
        self.seen = 0;
        self.events.drain(..)
    }
}

/// All lists.
#[derive(Clone, Debug, Default)]
pub(crate) struct Events {
    pub begin: EventList<BeginEvent>,
    pub end: EventList<EndEvent>,
    pub sensor: EventList<SensorEvent>,
    pub persist: EventList<PersistEvent>,
    pub hit: EventList<HitEvent>,
    /// Active pairs that ask for something, and whether their arbiters were there before the step.
    pub watched_pairs: Vec<(u32, bool)>,
    /// Arbiters of the step that ask for something, by key.
    pub watched: Vec<Watched>,
    /// Those of them that close fast.
    pub closing: Vec<Closing>,
    /// Arbiters whose begin has not been raised.
    pub unbegun: Vec<(ArbiterKey, ArbiterId)>,
    /// Ends whose listeners have not been called.
    pub pending_ends: Vec<EndEvent>,
    /// The batch whose listeners are being called, while these make the next one: empty in between, kept for its memory.
    spare_unbegun: Vec<(ArbiterKey, ArbiterId)>,
    spare_ends: Vec<EndEvent>,
    /// Keys of the batch of ends with their places in it: sorted instead of the events, which are twenty times larger.
    end_order: Vec<(ArbiterKey, ArbiterId, u32)>,
    spare_removals: Vec<Removal>,
    /// The most that a batch has held of late.
    begin_peak: Peak,
    end_peak: Peak,
}

impl Events {
    pub fn begin_step(&mut self) {
        self.begin.begin_step();
        self.end.begin_step();
        self.sensor.begin_step();
        self.persist.begin_step();
        self.hit.begin_step();
    }

    /// Notes an active pair that asks for something.
    pub fn watch(&mut self, pair: u32, goes_on: bool) {
        storage::push(&mut self.watched_pairs, (pair, goes_on));
    }

    /// Whether no listener has anything to be told.
    pub fn are_told(&self) -> bool {
        self.unbegun.is_empty() && self.pending_ends.is_empty()
    }

    pub fn end_step(&mut self) {
        self.begin.end_step();
        self.end.end_step();
        self.sensor.end_step();
        self.persist.end_step();
        self.hit.end_step();
        if let Some(count) = self.begin_peak.end_step() {
            storage::shrink(&mut self.unbegun, count);
            storage::shrink(&mut self.spare_unbegun, count);
        }
        if let Some(count) = self.end_peak.end_step() {
            storage::shrink(&mut self.pending_ends, count);
            storage::shrink(&mut self.spare_ends, count);
            storage::shrink(&mut self.end_order, count);
        }
    }
}

impl World {
    /// Calls `listener` whenever an arbiter begins, before it is solved; after the listeners of its bodies.
    pub fn on_begin_collide(&mut self, listener: BeginListener) {
        self.listeners.world.begin.push(listener);
    }

    /// Calls `listener` whenever an arbiter has ended; after the listeners of its bodies.
    pub fn on_end_collide(&mut self, listener: EndListener) {
        self.listeners.world.end.push(listener);
    }

    /// Has `provider` called in the narrow phase of each step, to register contacts of its own.
    pub fn add_contact_provider(&mut self, provider: Box<dyn ContactProvider>) {
        self.providers.push(provider);
    }

    /// Arbiters that have begun, in the order of their keys.
    #[must_use]
    pub fn begin_events(&self) -> &[BeginEvent] {
        &self.events.begin.events
    }

    /// Arbiters that have ended.
    #[must_use]
    pub fn end_events(&self) -> &[EndEvent] {
        &self.events.end.events
    }

    /// Overlaps of sensors that have begun or ended.
    #[must_use]
    pub fn sensor_events(&self) -> &[SensorEvent] {
        &self.events.sensor.events
    }

    /// Takes the begin events out of their list.
    pub fn drain_begin_events(&mut self) -> impl Iterator<Item = BeginEvent> + '_ {
        self.events.begin.drain()
    }

    /// Takes the end events out of their list.
    pub fn drain_end_events(&mut self) -> impl Iterator<Item = EndEvent> + '_ {
        self.events.end.drain()
    }

    /// Takes the sensor events out of their list.
    pub fn drain_sensor_events(&mut self) -> impl Iterator<Item = SensorEvent> + '_ {
        self.events.sensor.drain()
    }

    /// Raises the begin of all arbiters that are new, those made by listeners included.
    pub(crate) fn raise_begin(&mut self) {
        while !self.events.unbegun.is_empty() {
            let mut batch = std::mem::take(&mut self.events.spare_unbegun);
            std::mem::swap(&mut batch, &mut self.events.unbegun);
            self.events.begin_peak.note(batch.len());
            batch.sort_unstable();
            let heard = !self.listeners.are_deaf_to_begins();
            for (key, id) in batch.drain(..) {
                let Some(arbiter) = self.arbiters.index_of(id).map(|index| self.arbiters.at_mut(index)) else {
                    continue; // removed before its begin: neither begin nor end
                };
                arbiter.begun = true;
                let event = BeginEvent { arbiter: id, key, body1: arbiter.body1, body2: arbiter.body2 };
                storage::push(&mut self.events.begin.events, event);
                if heard {
                    let mut listeners = std::mem::take(&mut self.listeners);
                    listeners.begin(&mut StepContext::new(self), &event);
                    self.listeners = listeners;
                }
            }
            self.events.spare_unbegun = batch;
        }
        self.flush_events();
    }

    /// Puts a batch of ends into the list in a given order, on all threads: they are large.
    fn note_ends(&mut self, batch: &[EndEvent], order: &[(ArbiterKey, ArbiterId, u32)]) {
        let events = &mut self.events.end.events;
        let count = events.len() + order.len();
        storage::reserve(events, count);
        let places = SharedSlice::new(&mut events.spare_capacity_mut()[..order.len()]);
        self.pool.run_ranges(order.len(), LEAST_EVENTS, |range| {
            for nth in range {
                // SAFETY: each place belongs to one run.
                unsafe { places.get_mut(nth) }.write(batch[order[nth].2 as usize]);
            }
        });
        // SAFETY: all of them have been written.
        unsafe { events.set_len(count) };
    }

    /// Calls the listeners of all ends and carries out the removals they and others have asked for, until none is left.
    pub(crate) fn flush_events(&mut self) {
        loop {
            while !self.events.pending_ends.is_empty() {
                let mut batch = std::mem::take(&mut self.events.spare_ends);
                std::mem::swap(&mut batch, &mut self.events.pending_ends);
                self.events.end_peak.note(batch.len());
                let mut order = std::mem::take(&mut self.events.end_order);
                order.extend((0..).zip(&batch).map(|(place, event)| (event.key, event.arbiter, place)));
                order.sort_unstable();
                if self.listeners.are_deaf_to_ends() {
                    self.note_ends(&batch, &order);
                } else {
                    for &(.., place) in &order {
                        let event = &batch[place as usize];
                        storage::push(&mut self.events.end.events, *event);
                        let mut listeners = std::mem::take(&mut self.listeners);
                        listeners.end(&mut StepContext::new(self), event);
                        self.listeners = listeners;
                    }
                }
                order.clear();
                self.events.end_order = order;
                batch.clear();
                self.events.spare_ends = batch;
            }
            if self.removals.is_empty() {
                return;
            }
            let mut batch = std::mem::take(&mut self.events.spare_removals);
            std::mem::swap(&mut batch, &mut self.removals);
            for removal in batch.drain(..) {
                // What is gone already was asked for twice: nothing is left to do.
                match removal {
                    Removal::Body(id) => drop(self.remove_body(id)),
                    Removal::Shape(id) => drop(self.remove_shape(id)),
                    Removal::Arbiter(id) => drop(self.remove_arbiter(id)),
                }
            }
            self.events.spare_removals = batch;
        }
    }
}
