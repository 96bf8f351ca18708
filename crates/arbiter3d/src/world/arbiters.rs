//! Arbiters as the world's users see them: look up, make, feed, remove.

use super::World;
use super::bodies::Body;
use super::definition::Material;
use super::events::EndEvent;
use super::pairs::Pair;
use super::shapes::ShapeSlot;
use crate::arbiter::{
    ANISOTROPIC, ANISOTROPY_OVERRIDDEN, Arbiter, ArbiterId, ArbiterKey, Contact, ContactData, ContactPoint, EndReason,
    FRICTION_OVERRIDDEN, NONE, RESTITUTION_OVERRIDDEN, ROLLING_OVERRIDDEN, SolveMode, TANGENT_VELOCITY_OVERRIDDEN,
};
use crate::error::{Error, finite_vec, unit_vec};
use crate::id::BodyId;
use crate::math::{Real, Rotation, Vec3, max};
use crate::parallel::SharedSlice;
use crate::shape::Shape;
use crate::storage;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};

/// Ids that one call may reserve.
const ID_RANGE_LIMIT: u64 = 1 << 48;

impl World {
    /// The arbiter with this key, if there is one.
    #[must_use]
    pub fn arbiter(&self, key: ArbiterKey) -> Option<&Arbiter> {
        self.arbiters.find(key).map(|index| self.arbiters.at(index))
    }

    /// The arbiter with this id, if it lives.
    #[must_use]
    pub fn arbiter_by_id(&self, id: ArbiterId) -> Option<&Arbiter> {
        self.arbiters.index_of(id).map(|index| self.arbiters.at(index))
    }

    /// The arbiter with this id, to change; `None` if it has ended.
    pub fn arbiter_mut(&mut self, id: ArbiterId) -> Option<&mut Arbiter> {
        self.arbiters.index_of(id).map(|index| self.arbiters.at_mut(index))
    }

    /// All arbiters, those of sleeping bodies included, in no particular order.
    pub fn arbiters(&self) -> impl Iterator<Item = &Arbiter> {
        self.arbiters.iter()
    }

    /// The arbiters of a body; none for an unknown one.
    pub fn arbiters_of(&self, body: BodyId) -> impl Iterator<Item = &Arbiter> {
        let index = self.body_index(body).unwrap_or(NONE);
        self.arbiters.of_body(index).map(|arbiter| self.arbiters.at(arbiter))
    }

    /// World points of an arbiter's contacts: slot, point on body 1, point on body 2.
    pub fn contact_points<'a>(&'a self, arbiter: &'a Arbiter) -> impl Iterator<Item = (usize, Vec3, Vec3)> + 'a {
        let pose =
            |body: BodyId| self.solver_bodies.masses.get(body.index as usize).copied().unwrap_or_default().pose();
        let (pose1, pose2) = (pose(arbiter.body1), pose(arbiter.body2));
        arbiter.data.contacts().map(move |(slot, contact)| {
            (slot, pose1.transform_point(contact.local_anchor1), pose2.transform_point(contact.local_anchor2))
        })
    }

    /// Hands out `count` numbers for keys of your own, which no shape and no other call will get.
    ///
    /// # Errors
    /// If `count` is zero or more than 2⁴⁸.
    pub fn reserve_ids(&mut self, count: u64) -> Result<Range<u64>, Error> {
        let fits = self.next_id.checked_add(count).filter(|_| (1..=ID_RANGE_LIMIT).contains(&count));
        let end = fits.ok_or(Error::IdRange { count, limit: ID_RANGE_LIMIT })?;
        Ok(std::mem::replace(&mut self.next_id, end)..end)
    }

    /// The arbiter with this key, made if there is none.
    ///
    /// A new one begins in the next step (or in this one, when called by a provider or a begin listener), wakes its bodies,
    /// and takes the maximum of its bodies' frictions, restitutions and rolling resistances. It ends in the first step that
    /// finds it without contacts. Under the key of two shapes, the engine goes on with it once they touch.
    ///
    /// # Errors
    /// If a body is unknown or disabled, both are the same, neither is dynamic, or the key is in use between other bodies.
    pub fn get_or_create_arbiter(&mut self, key: ArbiterKey, body1: BodyId, body2: BodyId) -> Result<ArbiterId, Error> {
        if let Some(index) = self.arbiters.find(key) {
            let arbiter = self.arbiters.at(index);
            return if (arbiter.body1, arbiter.body2) == (body1, body2) {
                Ok(arbiter.id)
            } else {
                Err(Error::KeyInUse { key, body1: arbiter.body1, body2: arbiter.body2 })
            };
        }
        let (b1, b2) = (self.body_index(body1)?, self.body_index(body2)?);
        if b1 == b2 {
            return Err(Error::SameBody { id: body1 });
        }
        if let Some(&id) = [body1, body2].iter().find(|id| !self.bodies[id.index as usize].enabled) {
            return Err(Error::BodyDisabled { id });
        }
        if ![b1, b2].iter().any(|&index| self.bodies[index as usize].is_dynamic()) {
            return Err(Error::NeitherMoves { body1, body2 });
        }
        let index = self.create_arbiter(key, body1, body2);
        self.arbiters.custom += 1;
        self.mix_body_materials(index);
        Ok(self.arbiters.at(index).id)
    }

    /// Registers a contact with an arbiter, by the cache rules: near an old one it takes its place and its impulses, else it
    /// takes an empty slot, else that of the contact whose loss leaves the widest patch.
    ///
    /// # Errors
    /// If the arbiter has ended, a point is not finite, or the normal is not of unit length (within 10⁻³).
    pub fn register_contact(&mut self, arbiter: ArbiterId, contact: ContactPoint) -> Result<(), Error> {
        let index = self.arbiters.index_of(arbiter).ok_or(Error::UnknownArbiter { id: arbiter })?;
        validate_point(&contact)?;
        self.add_contact(index, &contact);
        Ok(())
    }

    /// Registers a contact with the arbiter of this key, made if there is none.
    ///
    /// # Errors
    /// As [`World::get_or_create_arbiter`] and [`World::register_contact`]; then no arbiter is made.
    pub fn register_contact_by_key(
        &mut self,
        key: ArbiterKey,
        body1: BodyId,
        body2: BodyId,
        contact: ContactPoint,
    ) -> Result<ArbiterId, Error> {
        validate_point(&contact)?;
        let id = self.get_or_create_arbiter(key, body1, body2)?;
        self.add_contact(id.index, &contact);
        Ok(id)
    }

    /// Ends an arbiter and wakes its bodies. Shapes that still touch begin a new one in the next step.
    ///
    /// # Errors
    /// If it has ended already.
    pub fn remove_arbiter(&mut self, id: ArbiterId) -> Result<(), Error> {
        let index = self.arbiters.index_of(id).ok_or(Error::UnknownArbiter { id })?;
        self.end_arbiter(index, EndReason::ArbiterRemoved);
        self.flush_events();
        Ok(())
    }

    fn add_contact(&mut self, index: u32, point: &ContactPoint) {
        let arbiter = self.arbiters.at_mut(index);
        let pose = |body: BodyId| self.solver_bodies.masses[body.index as usize].pose();
        let normal = point.normal / point.normal.length();
        let contact = Contact {
            local_anchor1: pose(arbiter.body1).inverse_transform_point(point.point1),
            local_anchor2: pose(arbiter.body2).inverse_transform_point(point.point2),
            normal,
            separation: (point.point2 - point.point1).dot(normal),
            remove: point.remove,
            world_normal: true,
            ..Contact::default()
        };
        arbiter.data.add(contact, self.scaled.contact_break_distance);
    }

    /// Makes an arbiter whose begin is still to be raised, and wakes its bodies.
    pub(crate) fn create_arbiter(&mut self, key: ArbiterKey, body1: BodyId, body2: BodyId) -> u32 {
        let index = self.arbiters.create(key, body1, body2);
        let arbiter = self.arbiters.at_mut(index);
        arbiter.data = fresh_data();
        self.events.unbegun.push((key, arbiter.id));
        self.wake(body1.index);
        self.wake(body2.index);
        index
    }

    /// Ends an arbiter, wakes its bodies, and notes the event if its begin was raised.
    pub(crate) fn end_arbiter(&mut self, index: u32, reason: EndReason) {
        let arbiter = self.arbiters.at(index);
        let (b1, b2, pair) = (arbiter.body1.index, arbiter.body2.index, arbiter.pair);
        if arbiter.begun {
            let event = EndEvent::of(arbiter, reason);
            storage::push(&mut self.events.pending_ends, event);
        }
        if pair == NONE {
            self.arbiters.custom -= 1;
        } else {
            self.pairs[pair as usize].arbiter = NONE;
            self.pairs[pair as usize].has_manifold = false;
        }
        self.arbiters.remove(index);
        if reason != EndReason::Separated || !both_awake(&self.bodies, [b1, b2]) {
            self.wake(b1);
            self.wake(b2);
        }
    }

    /// Ends arbiters whose shapes have separated, each once.
    pub(crate) fn end_separated(&mut self, list: &[u32]) {
        let is_plain = |&index: &u32| self.arbiters.at(index).begun && self.arbiters.at(index).pair != NONE;
        if list.is_empty() || !list.iter().all(is_plain) {
            list.iter().for_each(|&index| self.end_arbiter(index, EndReason::Separated));
            return;
        }
        let events = &mut self.events.pending_ends;
        let (first, count) = (events.len(), events.len() + list.len());
        storage::reserve(events, count);
        let told = SharedSlice::new(&mut events.spare_capacity_mut()[..list.len()]);
        let (pairs, bodies, rests) = (SharedSlice::new(&mut self.pairs), &self.bodies, AtomicBool::new(false));
        self.arbiters.remove_many(list, &mut self.pool, |nth, arbiter| {
            // SAFETY: each arbiter has its number, and its pair.
            let (event, pair) = unsafe { (told.get_mut(nth), pairs.get_mut(arbiter.pair as usize)) };
            event.write(EndEvent::of(arbiter, EndReason::Separated));
            (pair.arbiter, pair.has_manifold) = (NONE, false);
            if !both_awake(bodies, [arbiter.body1.index, arbiter.body2.index]) {
                rests.store(true, Ordering::Relaxed);
            }
        });
        // SAFETY: an event has been written for each.
        unsafe { events.set_len(count) };
        if rests.into_inner() {
            for nth in first..count {
                let event = &self.events.pending_ends[nth];
                let pair = [event.body1.index, event.body2.index];
                if !both_awake(&self.bodies, pair) {
                    pair.into_iter().for_each(|body| self.wake(body));
                }
            }
        }
    }

    /// Clears the cached contacts of a body: its anchors no longer hold.
    pub(crate) fn clear_contacts_of(&mut self, body: u32) {
        let arbiters: Vec<u32> = self.arbiters.of_body(body).collect();
        for index in arbiters {
            let arbiter = self.arbiters.at_mut(index);
            arbiter.data.clear();
            if arbiter.pair != NONE {
                let pair = arbiter.pair;
                self.pairs[pair as usize].has_manifold = false;
            }
        }
    }

    /// Material of a custom arbiter: the maximum over the shapes of both bodies, or the defaults where neither has any.
    fn mix_body_materials(&mut self, index: u32) {
        let arbiter = self.arbiters.at(index);
        let (mut friction, mut restitution, mut rolling, mut any) = (0.0, 0.0, 0.0, false);
        for body in [arbiter.body1.index, arbiter.body2.index] {
            for &slot in &self.bodies[body as usize].shape_slots {
                let shape = &self.shapes[slot as usize];
                friction = max(friction, shape.material.friction);
                restitution = max(restitution, shape.material.restitution);
                let resistance = shape.material.rolling_resistance;
                rolling = max(resistance * rolling_radius([(&shape.geometry, 0); 2], [&shape.material; 2]), rolling);
                any = true;
            }
        }
        let default = Material::default();
        let data = &mut self.arbiters.at_mut(index).data;
        if data.flags & FRICTION_OVERRIDDEN == 0 {
            data.friction = if any { friction } else { default.friction };
        }
        if data.flags & RESTITUTION_OVERRIDDEN == 0 {
            data.restitution = if any { restitution } else { default.restitution };
        }
        if data.flags & ROLLING_OVERRIDDEN == 0 {
            data.rolling_resistance = rolling;
        }
    }

    /// Mixes the materials of all arbiters of a body anew.
    pub(crate) fn refresh_materials_of(&mut self, body: u32) {
        let arbiters: Vec<u32> = self.arbiters.of_body(body).collect();
        for index in arbiters {
            if self.arbiters.at(index).pair == NONE {
                self.mix_body_materials(index);
            } else {
                let arbiter = self.arbiters.at_mut(index);
                let pair = &mut self.pairs[arbiter.pair as usize];
                mix_shape_materials(pair, &mut arbiter.data, &self.shapes, &self.bodies);
            }
        }
    }
}

/// Whether neither body is a dynamic one that sleeps.
fn both_awake(bodies: &[Body], pair: [u32; 2]) -> bool {
    pair.into_iter().all(|index| !bodies[index as usize].is_dynamic() || bodies[index as usize].awake)
}

/// Data of an arbiter that begins.
pub(crate) fn fresh_data() -> ContactData {
    ContactData { solve_mode: SolveMode::FULL, ..ContactData::default() }
}

/// Material of an engine arbiter, from its two shapes; what users have set stays.
pub(crate) fn mix_shape_materials(pair: &mut Pair, data: &mut ContactData, shapes: &[ShapeSlot], bodies: &[Body]) {
    let [a, b] = pair.shapes.map(|slot| &shapes[slot as usize]);
    let (ma, mb) = (a.surface(pair.materials[0]), b.surface(pair.materials[1]));
    let (friction, restitution) = grip_and_bounce(ma, mb);
    let (other_friction, other_restitution) = if pair.other_materials == pair.materials {
        (friction, restitution)
    } else {
        grip_and_bounce(a.surface(pair.other_materials[0]), b.surface(pair.other_materials[1]))
    };
    let rolling = max(ma.rolling_resistance, mb.rolling_resistance)
        * rolling_radius([(&a.geometry, pair.materials[0]), (&b.geometry, pair.materials[1])], [ma, mb]);
    pair.conveyor = ma.turns() || mb.turns();
    let free = |flag: u8| data.flags & flag == 0;
    let (f, r, t, o) = (
        free(FRICTION_OVERRIDDEN),
        free(RESTITUTION_OVERRIDDEN),
        free(TANGENT_VELOCITY_OVERRIDDEN),
        free(ROLLING_OVERRIDDEN),
    );
    if f {
        (data.friction, data.other_friction) = (friction, other_friction);
    }
    if r {
        (data.restitution, data.other_restitution) = (restitution, other_restitution);
    }
    if t {
        data.tangent_velocity = surface_velocity([ma, mb], pair.bodies.map(|body| bodies[body as usize].pose.rotation));
    }
    if o {
        data.rolling_resistance = rolling;
    }
    if pair.conveyor || data.flags & ANISOTROPIC != 0 {
        turn_anisotropy([a, b], [ma, mb], pair.bodies.map(|body| bodies[body as usize].pose.rotation), data);
    }
}

/// Friction and restitution of two materials.
fn grip_and_bounce(a: &Material, b: &Material) -> (Real, Real) {
    let friction = a.friction_combine.max(b.friction_combine).combine(a.friction, b.friction);
    (friction, a.restitution_combine.max(b.restitution_combine).combine(a.restitution, b.restitution))
}

/// Direction and ratio of the anisotropic friction of an arbiter, if users have not set them: of the two materials that
/// with the smaller ratio.
pub(crate) fn turn_anisotropy(
    shapes: [&ShapeSlot; 2],
    materials: [&Material; 2],
    rotations: [Rotation; 2],
    data: &mut ContactData,
) {
    if data.flags & ANISOTROPY_OVERRIDDEN != 0 {
        return;
    }
    let side = match materials.map(|material| material.anisotropy) {
        [Some(a), Some(b)] => Some(usize::from(b.ratio < a.ratio)),
        [Some(_), None] => Some(0),
        [None, Some(_)] => Some(1),
        [None, None] => None,
    };
    let chosen = side.and_then(|side| Some((side, materials[side].anisotropy?)));
    data.put_anisotropy(chosen.map(|(side, anisotropy)| {
        let direction = rotations[side].rotate(shapes[side].pose.rotation.rotate(anisotropy.direction));
        (direction, anisotropy.ratio)
    }));
}

/// Velocity of the surface of body 1 against that of body 2, world axes.
pub(crate) fn surface_velocity(materials: [&Material; 2], rotations: [Rotation; 2]) -> Vec3 {
    let [a, b] = [0, 1].map(|side| rotations[side].rotate(materials[side].tangent_velocity));
    a - b
}

/// Radius that rolls: that of the round shape, or for compounds and polyhedra with a resistance of their own that of the round
/// child with the material that touches, or a quarter of the inner radius.
fn rolling_radius([a, b]: [(&Shape, u8); 2], materials: [&Material; 2]) -> Real {
    let round = max(a.0.rounding_radius(), b.0.rounding_radius());
    let set = materials.iter().any(|m| m.rolling_resistance > Material::DEFAULT_ROLLING_RESISTANCE);
    if round > 0.0 || !set {
        return round;
    }
    let round = max(a.0.part_rounding(a.1), b.0.part_rounding(b.1));
    if round > 0.0 { round } else { 0.25 * max(a.0.inner_radius(), b.0.inner_radius()) }
}

fn validate_point(contact: &ContactPoint) -> Result<(), Error> {
    finite_vec("point1", contact.point1)?;
    finite_vec("point2", contact.point2)?;
    unit_vec("normal", contact.normal).map(|_| ())
}
