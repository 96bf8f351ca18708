//! What shapes may ask to be told of their arbiters beyond begin and end: before each solve, in each step, at each hit.
//!
//! The narrow phase reports the active pairs that ask for something ([`super::pairs::WATCHED`]), and what wakes later
//! in the step is added; so a world in which nobody asks does nothing here. All lists are sorted by key.
//!
//! *Hits.* A contact hits when it was not pressed in the step before, closes at the threshold or faster, and is pressed
//! in this step. The speed is that of the moment of touching: a point that is a gap `s` away, closes at `u₀`, and is
//! accelerated by `a`, touches at `u² = u₀² + 2as`. The impulse is the sum over the substeps and restitution, of all
//! contacts of the arbiter. What lies or rolls is pressed all the time, or closes slowly: it hits no more.

use super::World;
use super::events::StepContext;
use super::pairs::{HITS, PERSIST, PRE_SOLVE};
use crate::arbiter::{Arbiter, ArbiterId, ArbiterKey, NONE, SLOTS};
use crate::error::Error;
use crate::id::BodyId;
use crate::math::{Real, Vec3, clamp, max};
use crate::storage;

/// An arbiter goes on: it began in an earlier step and has not ended in this one. Only of shapes that ask for
/// [`ContactEvents::PERSIST`](crate::ContactEvents::PERSIST), and not while both bodies sleep.
///
/// ```
/// let world = arbiter3d::World::default();
/// for event in world.persist_events() {
///     println!("{:?} and {:?} still touch", event.body1, event.body2);
/// }
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PersistEvent {
    /// The arbiter.
    pub arbiter: ArbiterId,
    /// Its key: the ids of the shapes.
    pub key: ArbiterKey,
    /// First body.
    pub body1: BodyId,
    /// Second body.
    pub body2: BodyId,
}

/// Two shapes have hit each other: of shapes that ask for [`ContactEvents::HITS`](crate::ContactEvents::HITS), at
/// [`WorldSettings::hit_speed_threshold`](crate::WorldSettings::hit_speed_threshold) or faster.
///
/// ```
/// let world = arbiter3d::World::default();
/// for hit in world.hit_events() {
///     println!("a blow of {} N s at {}: {} m/s", hit.impulse, hit.point, hit.speed);
/// }
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HitEvent {
    /// The arbiter; it may have ended within the step already.
    pub arbiter: ArbiterId,
    /// Its key: the ids of the shapes.
    pub key: ArbiterKey,
    /// First body.
    pub body1: BodyId,
    /// Second body.
    pub body2: BodyId,
    /// Where, world space: the mean of the contacts that hit, by their impulses.
    pub point: Vec3,
    /// Unit normal from body 1 to body 2 where the speed was greatest.
    pub normal: Vec3,
    /// Speed along the normal with which they came together, m/s: before the solve, the greatest of all contacts that
    /// hit.
    pub speed: Real,
    /// Impulse along the normals in this step, N s: of all contacts of the arbiter, all substeps, with that of the
    /// bounce.
    pub impulse: Real,
}

/// Called with each arbiter that asks for it, right before it is solved.
pub type PreSolveListener = Box<dyn FnMut(&mut StepContext<'_>, ArbiterId) + Send + Sync>;

/// Called with each hit, after the solve.
pub type HitListener = Box<dyn FnMut(&mut StepContext<'_>, &HitEvent) + Send + Sync>;

/// An arbiter of shapes that ask for something.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Watched {
    key: ArbiterKey,
    id: ArbiterId,
    traits: u8,
    /// Whether it was there before this step.
    goes_on: bool,
}

/// Contacts of an arbiter that close fast.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Closing {
    key: ArbiterKey,
    id: ArbiterId,
    /// Speed at which each slot's contact will touch; zero where it does not hit.
    speeds: [Real; SLOTS],
    /// Where.
    points: [Vec3; SLOTS],
}

impl World {
    /// Calls `listener` in each step, right before the solve, with each arbiter of awake bodies of which a shape asks
    /// for [`ContactEvents::PRE_SOLVE`](crate::ContactEvents::PRE_SOLVE), those that have just begun included; in the
    /// order of the keys.
    ///
    /// Manifolds of such arbiters are made anew in each step, so normals, gaps and dropped contacts are changed for
    /// this one step: the next one shows them as they are, to be changed again. Friction, restitution, rolling
    /// resistance, surface velocity, anisotropy and solve mode hold for the arbiter's life, as ever.
    ///
    /// ```
    /// use arbiter3d::{ContactEvents, Shape, ShapeDefinition, World};
    /// let mut world = World::default();
    /// // Grip that grows with the load.
    /// world.on_pre_solve(Box::new(|context, id| {
    ///     let Some(arbiter) = context.arbiter_mut(id) else { return };
    ///     let load: f32 = arbiter.data().contacts().map(|(_, contact)| contact.normal_impulse()).sum();
    ///     let _ = arbiter.data_mut().set_friction(0.3 + 0.1 * load.min(5.0));
    /// }));
    /// let tyre = ShapeDefinition::new(Shape::sphere(0.3)?).events(ContactEvents::PRE_SOLVE);
    /// # Ok::<(), arbiter3d::Error>(())
    /// ```
    pub fn on_pre_solve(&mut self, listener: PreSolveListener) {
        self.listeners.pre_solve.push(listener);
    }

    /// Calls `listener` with each [`HitEvent`] after the solve, in the order of the keys.
    pub fn on_hit(&mut self, listener: HitListener) {
        self.listeners.hit.push(listener);
    }

    /// Hits of the last step, in the order of their keys.
    #[must_use]
    pub fn hit_events(&self) -> &[HitEvent] {
        &self.events.hit.events
    }

    /// Arbiters that went on in the last step, in the order of their keys.
    #[must_use]
    pub fn persist_events(&self) -> &[PersistEvent] {
        &self.events.persist.events
    }

    /// Takes the hits out of their list.
    pub fn drain_hit_events(&mut self) -> impl Iterator<Item = HitEvent> + '_ {
        self.events.hit.drain()
    }

    /// Takes the persist events out of their list.
    pub fn drain_persist_events(&mut self) -> impl Iterator<Item = PersistEvent> + '_ {
        self.events.persist.drain()
    }

    /// Sets the gap of a contact, metres, by moving its point on body 2 along the normal. It holds until the contact is
    /// made anew: for arbiters of shapes that ask for [`ContactEvents::PRE_SOLVE`](crate::ContactEvents::PRE_SOLVE),
    /// for this step.
    ///
    /// # Errors
    /// If the arbiter has ended, the slot is empty, or the gap is not finite.
    pub fn set_contact_separation(&mut self, arbiter: ArbiterId, slot: usize, separation: Real) -> Result<(), Error> {
        let separation = crate::error::finite("separation", separation)?;
        let index = self.arbiters.index_of(arbiter).ok_or(Error::UnknownArbiter { id: arbiter })?;
        let arbiter = self.arbiters.at_mut(index);
        let bodies = [arbiter.body1, arbiter.body2];
        let [pose1, pose2] = bodies.map(|body| self.solver_bodies.masses[body.index as usize].pose());
        let contact = arbiter.data.slot_mut(slot)?;
        let apart = pose2.rotation.rotate(contact.local_anchor2) - pose1.rotation.rotate(contact.local_anchor1)
            + (pose2.position - pose1.position);
        let shift = contact.normal * (separation - apart.dot(contact.normal));
        contact.local_anchor2 += pose2.rotation.inverse_rotate(shift);
        contact.separation = separation;
        Ok(())
    }

    /// Shows arbiters to the listeners that want them before the solve, and lists all that ask for something.
    pub(crate) fn raise_pre_solve(&mut self) {
        self.events.watched.clear();
        while !self.events.watched_pairs.is_empty() {
            // Listeners may wake what asks too.
            let first = self.events.watched.len();
            self.list_watched();
            for at in first..self.events.watched.len() {
                let Watched { id, traits, .. } = self.events.watched[at];
                if traits & PRE_SOLVE != 0 && self.arbiters.index_of(id).is_some() {
                    let mut listeners = std::mem::take(&mut self.listeners);
                    let mut context = StepContext::new(self);
                    listeners.pre_solve.iter_mut().for_each(|listener| listener(&mut context, id));
                    self.listeners = listeners;
                }
            }
            self.flush_events();
        }
        self.events.watched.sort_unstable_by_key(|watched| (watched.key, watched.id));
        self.events.watched.dedup_by_key(|watched| watched.id);
        if !self.events.unbegun.is_empty() {
            self.raise_begin();
        }
    }

    /// Appends the arbiters of the pairs watched, by key.
    fn list_watched(&mut self) {
        let events = &mut self.events;
        let first = events.watched.len();
        storage::reserve(&mut events.watched, first + events.watched_pairs.len());
        for (pair, goes_on) in events.watched_pairs.drain(..) {
            let pair = &self.pairs[pair as usize];
            if pair.alive && pair.arbiter != NONE {
                let arbiter = self.arbiters.at(pair.arbiter);
                events.watched.push(Watched { key: arbiter.key, id: arbiter.id, traits: pair.traits, goes_on });
            }
        }
        events.watched[first..].sort_unstable_by_key(|watched| (watched.key, watched.id, watched.goes_on));
    }

    /// Notes which contacts close fast enough to hit, before the solve.
    pub(crate) fn note_closing(&mut self) {
        self.events.closing.clear();
        let threshold = self.scaled.hit_speed_threshold;
        for at in 0..self.events.watched.len() {
            let Watched { key, id, traits, .. } = self.events.watched[at];
            let Some(index) = self.arbiters.index_of(id).filter(|_| traits & HITS != 0) else { continue };
            let mut closing = Closing { key, id, speeds: [0.0; SLOTS], points: [Vec3::ZERO; SLOTS] };
            self.measure(self.arbiters.at(index), threshold, &mut closing);
            if closing.speeds != [0.0; SLOTS] {
                storage::push(&mut self.events.closing, closing);
            }
        }
    }

    /// Speeds and places at which the contacts of an arbiter will touch, of those that were not pressed and are fast.
    fn measure(&self, arbiter: &Arbiter, threshold: Real, closing: &mut Closing) {
        let [b1, b2] = [arbiter.body1, arbiter.body2].map(|body| body.index as usize);
        let bodies = &self.solver_bodies;
        let (mass1, mass2) = (&bodies.masses[b1], &bodies.masses[b2]);
        let apart = mass2.center - mass1.center;
        let pull = bodies.motions[b2].acceleration - bodies.motions[b1].acceleration;
        for (slot, contact) in arbiter.data.contacts().filter(|(_, contact)| contact.total_impulse == 0.0) {
            let (r1, r2) = (mass1.rotation.rotate(contact.local_anchor1), mass2.rotation.rotate(contact.local_anchor2));
            let velocity = |body: usize, r: Vec3| {
                let state = &bodies.states[body];
                state.linear_velocity + state.angular_velocity.cross(r)
            };
            let (v1, v2) = (velocity(b1, r1), velocity(b2, r2));
            let gap = (apart + (r2 - r1)).dot(contact.normal);
            let speed = -contact.normal.dot(v2 - v1);
            let touching = speed * speed - 2.0 * contact.normal.dot(pull) * gap;
            let touching = if speed > 0.0 && touching > 0.0 { touching.sqrt() } else { max(speed, 0.0) };
            if touching >= threshold && touching > 0.0 {
                let wait = if speed > 0.0 { clamp(gap / speed, 0.0, self.dt) } else { 0.0 };
                closing.speeds[slot] = touching;
                closing.points[slot] = mass1.center + r1 + v1 * wait;
            }
        }
    }

    /// Makes events of the contacts that were pressed in the solve.
    pub(crate) fn note_hits(&mut self) {
        for at in 0..self.events.closing.len() {
            let closing = &self.events.closing[at];
            let Some(index) = self.arbiters.index_of(closing.id) else { continue };
            if let Some(event) = hit_of(self.arbiters.at(index), closing) {
                storage::push(&mut self.events.hit.events, event);
            }
        }
    }

    /// Tells the listeners of this step's hits, then notes which arbiters have gone on.
    pub(crate) fn raise_hits(&mut self, first: usize) {
        if !self.listeners.hit.is_empty() {
            for at in first..self.events.hit.events.len() {
                let event = self.events.hit.events[at];
                let mut listeners = std::mem::take(&mut self.listeners);
                let mut context = StepContext::new(self);
                listeners.hit.iter_mut().for_each(|listener| listener(&mut context, &event));
                self.listeners = listeners;
            }
        }
        for watched in &self.events.watched {
            if watched.traits & PERSIST == 0 || !watched.goes_on {
                continue;
            }
            if let Some(index) = self.arbiters.index_of(watched.id) {
                let &Arbiter { key, body1, body2, id: arbiter, .. } = self.arbiters.at(index);
                storage::push(&mut self.events.persist.events, PersistEvent { arbiter, key, body1, body2 });
            }
        }
    }
}

/// The hit of an arbiter, if a contact that closed fast was pressed.
fn hit_of(arbiter: &Arbiter, closing: &Closing) -> Option<HitEvent> {
    let (mut impulse, mut struck) = (0.0, 0.0);
    let (mut speed, mut normal, mut point) = (0.0, Vec3::ZERO, Vec3::ZERO);
    for (slot, contact) in arbiter.data.contacts() {
        impulse += contact.total_impulse;
        if closing.speeds[slot] == 0.0 || contact.total_impulse <= 0.0 {
            continue;
        }
        struck += contact.total_impulse;
        point += closing.points[slot] * contact.total_impulse;
        if closing.speeds[slot] > speed {
            (speed, normal) = (closing.speeds[slot], contact.normal);
        }
    }
    let event = |point: Vec3| HitEvent {
        arbiter: arbiter.id,
        key: closing.key,
        body1: arbiter.body1,
        body2: arbiter.body2,
        point,
        normal,
        speed,
        impulse,
    };
    (struck > 0.0).then(|| event(point / struck))
}
