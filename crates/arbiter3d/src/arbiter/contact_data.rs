//! The contact state of one arbiter: four slots and what they share.
//!
//! Layout: the four slots stand in the record itself, so that one arbiter is one run of memory for the solver to gather.
//! Anchors are kept in body axes from each body's centre of mass, so that a contact moves with its bodies and its gap can be
//! read off at any time without asking the shapes. The solver's levers are the anchors in world axes as of when the manifold
//! was made: not kept, but turned anew from the anchors by the rotations that the bodies had then. So a contact is 72 bytes
//! and an arbiter seven cache lines: in large worlds the solver's time to gather and store contacts is that of their bytes.

use super::SolveMode;
use crate::error::{self, Error};
use crate::math::{Real, Rotation, Vec3};
use crate::simd::quad_view;

/// Slots of an arbiter.
pub(crate) const SLOTS: usize = 4;

/// One point of an arbiter.
///
/// ```
/// # use arbiter3d::*;
/// # fn show(arbiter: &Arbiter) {
/// for (slot, contact) in arbiter.data().contacts() {
///     println!("slot {slot}: gap {} m, impulse {} N s", contact.separation(), contact.normal_impulse());
/// }
/// # }
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)] // in groups of four numbers, as the solver's rows load and store them
pub struct Contact {
    pub(crate) local_anchor1: Vec3,
    pub(crate) local_anchor2: Vec3,
    /// World normal from body 1 to body 2, as of when the manifold was made or the contact was registered.
    pub(crate) normal: Vec3,
    /// Normal impulse of the last substep: what warm starting begins with.
    pub(crate) normal_impulse: Real,
    pub(crate) tangent_impulse: Vec3,
    pub(crate) twist_impulse: Real,
    pub(crate) separation: Real,
    /// Sum of the normal impulses of the last step's substeps.
    pub(crate) total_impulse: Real,
    pub(crate) feature: u32,
    /// Velocity parts that this contact leaves alone.
    pub(crate) remove: SolveMode,
    /// Whether the normal keeps its world direction instead of turning with body 1, and the levers follow the bodies each
    /// step: contacts that users registered.
    pub(crate) world_normal: bool,
}

impl Contact {
    /// Unit normal from body 1 to body 2, world axes.
    #[must_use]
    pub fn normal(&self) -> Vec3 {
        self.normal
    }

    /// Gap along the normal, metres, as of the last step; negative when the bodies overlap.
    #[must_use]
    pub fn separation(&self) -> Real {
        self.separation
    }

    /// Impulse along the normal that the last substep applied, N s; zero or more.
    #[must_use]
    pub fn normal_impulse(&self) -> Real {
        self.normal_impulse
    }

    /// Impulse along the normal over the whole last step, N s.
    #[must_use]
    pub fn total_normal_impulse(&self) -> Real {
        self.total_impulse
    }

    /// This contact's share of the arbiter's friction impulse in the last substep, N s, world axes.
    #[must_use]
    pub fn tangent_impulse(&self) -> Vec3 {
        self.tangent_impulse
    }

    /// The point on body 1, from its centre of mass, in its axes, metres.
    #[must_use]
    pub fn local_anchor1(&self) -> Vec3 {
        self.local_anchor1
    }

    /// The point on body 2, from its centre of mass, in its axes, metres.
    #[must_use]
    pub fn local_anchor2(&self) -> Vec3 {
        self.local_anchor2
    }

    /// Velocity parts that this contact leaves alone.
    #[must_use]
    pub fn removed(&self) -> SolveMode {
        self.remove
    }

    quad_view! {
        /// The first sixteen numbers in groups of four: anchors, normal, impulses and gap.
        pub(crate) fn quads,
        /// The same, to change.
        quads_mut;
        [4] of (local_anchor1, local_anchor2, normal, normal_impulse, tangent_impulse, twist_impulse, separation,
            total_impulse)
    }

    /// Takes over the impulses of the contact that this one replaces, the tangential one turned into the new plane.
    pub(crate) fn inherit(&mut self, old: &Self) {
        self.normal_impulse = old.normal_impulse;
        self.total_impulse = old.total_impulse;
        self.twist_impulse = old.twist_impulse;
        self.tangent_impulse = old.tangent_impulse - self.normal * self.normal.dot(old.tangent_impulse);
    }

    /// Forgets the impulses.
    pub(crate) fn reset_impulses(&mut self) {
        self.normal_impulse = 0.0;
        self.total_impulse = 0.0;
        self.twist_impulse = 0.0;
        self.tangent_impulse = Vec3::ZERO;
    }
}

/// Contact state of an arbiter: four slots, and the material that they share.
///
/// Changes last as long as the arbiter, and count from the next solve on; those made while its begin is raised count in that
/// very step.
///
/// ```
/// use arbiter3d::{World, math::Vec3};
/// let mut world = World::default();
/// world.on_begin_collide(Box::new(|context, id| {
///     if let Some(arbiter) = context.arbiter_mut(id) {
///         let _ = arbiter.data_mut().set_friction(0.0); // ice
///     }
/// }));
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)] // what is shared comes first: colouring reads that alone
pub struct ContactData {
    pub(crate) usage_mask: u8,
    pub(crate) solve_mode: SolveMode,
    pub(crate) flags: u8,
    /// Slots whose contacts are of other materials than the rest: [`ContactData::other_friction`] and
    /// [`ContactData::other_restitution`] are theirs, and they are solved apart.
    pub(crate) other_slots: u8,
    pub(crate) friction: Real,
    pub(crate) restitution: Real,
    pub(crate) rolling_resistance: Real,
    /// Surface velocity of body 2 against body 1, world axes.
    pub(crate) tangent_velocity: Vec3,
    pub(crate) rolling_impulse: Vec3,
    /// How the bodies were turned when the engine's contacts were made, or last turned along: see `world::collide`.
    pub(crate) rotations: [Rotation; 2],
    pub(crate) slots: [Contact; SLOTS],
    /// Direction along which friction differs, world axes, and by how much: with [`ANISOTROPIC`] alone.
    pub(crate) friction_direction: Vec3,
    pub(crate) friction_ratio: Real,
    pub(crate) other_friction: Real,
    pub(crate) other_restitution: Real,
}

/// The user has set the friction: materials no longer reach it.
pub(crate) const FRICTION_OVERRIDDEN: u8 = 1;
/// The user has set the restitution.
pub(crate) const RESTITUTION_OVERRIDDEN: u8 = 2;
/// The user has set the surface velocity.
pub(crate) const TANGENT_VELOCITY_OVERRIDDEN: u8 = 4;
/// The user has set the rolling resistance.
pub(crate) const ROLLING_OVERRIDDEN: u8 = 8;
/// All contacts have the bit-equal normal and nothing removed: one row holds them all.
pub(crate) const ONE_NORMAL: u8 = 16;
/// All contacts are with inner edges or faces of what several shapes make together: they are not solved.
pub(crate) const HIDDEN: u8 = 128;
/// Friction differs along a direction.
pub(crate) const ANISOTROPIC: u8 = 32;
/// The user has set that direction, or that there is none.
pub(crate) const ANISOTROPY_OVERRIDDEN: u8 = 64;

impl ContactData {
    quad_view! {
        /// The rotations of the levers as groups of four numbers.
        pub(crate) fn rotation_quads;
        [2] of (rotations)
    }

    /// Bits 0 to 3: the slot holds a contact. Bits 4 to 7: the slot was solved in the last step.
    #[must_use]
    pub fn usage_mask(&self) -> u8 {
        self.usage_mask
    }

    /// The contact in a slot (0 to 3), if it holds one.
    #[must_use]
    pub fn contact(&self, slot: usize) -> Option<&Contact> {
        (slot < SLOTS && self.usage_mask >> slot & 1 == 1).then(|| &self.slots[slot])
    }

    /// Slots that hold contacts, with the contacts.
    pub fn contacts(&self) -> impl Iterator<Item = (usize, &Contact)> {
        self.slots.iter().enumerate().filter(|(slot, _)| self.usage_mask >> slot & 1 == 1)
    }

    /// Number of contacts, 0 to 4.
    #[must_use]
    pub fn contact_count(&self) -> usize {
        (self.usage_mask & 15).count_ones() as usize
    }
}

/// The material that the contacts share, to read.
impl ContactData {
    /// Coulomb friction of a contact (slot 0 to 3): of shapes with several materials, contacts may differ.
    #[must_use]
    pub fn friction_of(&self, slot: usize) -> Real {
        if self.is_other(1 << (slot & 7)) { self.other_friction } else { self.friction }
    }

    /// Restitution of a contact (slot 0 to 3).
    #[must_use]
    pub fn restitution_of(&self, slot: usize) -> Real {
        if self.is_other(1 << (slot & 7)) { self.other_restitution } else { self.restitution }
    }

    /// Whether the contacts in some slots are those of the second pair of materials.
    #[inline(always)]
    pub(crate) fn is_other(&self, slots: u8) -> bool {
        self.other_slots & slots != 0
    }

    /// Coulomb friction. Starts as the combination of the two materials, the maximum by default. Of shapes with several
    /// materials, that of the deepest contact: see [`ContactData::friction_of`].
    #[must_use]
    pub fn friction(&self) -> Real {
        self.friction
    }

    /// Share of the approach speed given back. Starts as the combination of the two materials, the maximum by default.
    #[must_use]
    pub fn restitution(&self) -> Real {
        self.restitution
    }

    /// Torque that resists rolling, as a share of normal force times radius, metres.
    #[must_use]
    pub fn rolling_resistance(&self) -> Real {
        self.rolling_resistance
    }

    /// Velocity of the surface of body 1 that carries body 2 along, m/s, world axes.
    #[must_use]
    pub fn tangent_velocity(&self) -> Vec3 {
        self.tangent_velocity
    }

    /// What the arbiter may change of its bodies.
    #[must_use]
    pub fn solve_mode(&self) -> SolveMode {
        self.solve_mode
    }

    /// The direction (unit vector, world axes) along which friction is a share of [`ContactData::friction`], and that
    /// share.
    #[must_use]
    pub fn anisotropy(&self) -> Option<(Vec3, Real)> {
        (self.flags & ANISOTROPIC != 0).then_some((self.friction_direction, self.friction_ratio))
    }
}

/// The material, to change.
impl ContactData {
    /// Sets the friction for the arbiter's life.
    ///
    /// # Errors
    /// If it is not from 0 to 10⁶.
    pub fn set_friction(&mut self, friction: Real) -> Result<(), Error> {
        self.friction = error::in_range("friction", friction, 0.0, 1e6)?;
        self.other_friction = self.friction;
        self.flags |= FRICTION_OVERRIDDEN;
        Ok(())
    }

    /// Sets the restitution for the arbiter's life.
    ///
    /// # Errors
    /// If it is not from 0 to 1.
    pub fn set_restitution(&mut self, restitution: Real) -> Result<(), Error> {
        self.restitution = error::in_range("restitution", restitution, 0.0, 1.0)?;
        self.other_restitution = self.restitution;
        self.flags |= RESTITUTION_OVERRIDDEN;
        Ok(())
    }

    /// Sets the rolling resistance for the arbiter's life: a share of the normal force, times a radius, metres.
    ///
    /// # Errors
    /// If it is not from 0 to 10⁶.
    pub fn set_rolling_resistance(&mut self, rolling_resistance: Real) -> Result<(), Error> {
        self.rolling_resistance = error::in_range("rolling_resistance", rolling_resistance, 0.0, 1e6)?;
        self.flags |= ROLLING_OVERRIDDEN;
        Ok(())
    }

    /// Sets the surface velocity (m/s, world axes) with which body 1 carries body 2 along.
    ///
    /// # Errors
    /// If it is not finite.
    pub fn set_tangent_velocity(&mut self, velocity: Vec3) -> Result<(), Error> {
        self.tangent_velocity = error::finite_vec("tangent_velocity", velocity)?;
        self.flags |= TANGENT_VELOCITY_OVERRIDDEN;
        Ok(())
    }

    /// Sets what the arbiter may change of its bodies; parts of bodies that are not dynamic never change anyway.
    pub fn set_solve_mode(&mut self, mode: SolveMode) {
        self.solve_mode = mode;
    }

    /// Sets, for the arbiter's life, a direction (unit vector, world axes) along which friction is `ratio` times what
    /// it is across; `None` makes it the same in all directions. The direction stands still: to have it turn with a
    /// body, set it before each solve, or use [`Material::anisotropy`](crate::Material::anisotropy).
    ///
    /// # Errors
    /// If the direction is not finite and of unit length, or the ratio not from 0.001 to 1000.
    pub fn set_anisotropy(&mut self, anisotropy: Option<(Vec3, Real)>) -> Result<(), Error> {
        let valid = |(direction, ratio)| {
            let direction = error::unit_vec("anisotropy direction", direction)?;
            Ok::<_, Error>((direction, error::in_range("anisotropy ratio", ratio, 1e-3, 1e3)?))
        };
        self.put_anisotropy(anisotropy.map(valid).transpose()?);
        self.flags |= ANISOTROPY_OVERRIDDEN;
        Ok(())
    }

    pub(crate) fn put_anisotropy(&mut self, anisotropy: Option<(Vec3, Real)>) {
        self.flags &= !ANISOTROPIC;
        if let Some((direction, ratio)) = anisotropy {
            (self.friction_direction, self.friction_ratio) = (direction, ratio);
            self.flags |= ANISOTROPIC;
        }
    }
}

/// The contacts, to change.
impl ContactData {
    /// Turns the normal of a contact; it points from body 1 to body 2, world axes.
    ///
    /// # Errors
    /// If the slot is empty or the normal is not finite and of unit length.
    pub fn set_normal(&mut self, slot: usize, normal: Vec3) -> Result<(), Error> {
        let normal = error::unit_vec("normal", normal)?;
        let contact = self.slot_mut(slot)?;
        contact.normal = normal;
        contact.world_normal = true;
        contact.tangent_impulse -= normal * normal.dot(contact.tangent_impulse);
        self.flags &= !ONE_NORMAL;
        Ok(())
    }

    /// Removes a contact from its slot.
    ///
    /// # Errors
    /// If the slot is empty.
    pub fn remove_contact(&mut self, slot: usize) -> Result<(), Error> {
        self.slot_mut(slot)?;
        self.usage_mask &= !(1 << slot);
        Ok(())
    }

    /// Forgets the accumulated impulses, so that the next step starts without them.
    pub fn reset_impulses(&mut self) {
        self.slots.iter_mut().for_each(Contact::reset_impulses);
        self.rolling_impulse = Vec3::ZERO;
    }

    /// Removes all contacts.
    pub fn clear(&mut self) {
        self.usage_mask = 0;
    }

    pub(crate) fn slot_mut(&mut self, slot: usize) -> Result<&mut Contact, Error> {
        if slot < SLOTS && self.usage_mask >> slot & 1 == 1 {
            Ok(&mut self.slots[slot])
        } else {
            Err(Error::EmptySlot { slot, mask: self.usage_mask & 15 })
        }
    }
}
