//! Contacts at seams between separate shapes that nothing can push: floors of many boxes, meshes side by side, platforms.
//!
//! After the narrow phase, a body with new contacts against such shapes is looked at if it has several of them, not all with
//! one normal: each contact that another shape hides (see `narrow_phase::seam`) is left out of this step's solve. An arbiter
//! all of whose contacts are hidden keeps them and is not solved, so that it goes on as long as the shapes touch; from one with
//! others too, the hidden ones are taken. One that bears with a normal that is a little off gets that of the surface.
//! The manifold of either is made anew in the next step, whatever moves: so what was hidden comes back as soon as
//! nothing hides it, and the other way round.
//!
//! Each body looks at its own arbiters alone, and decides on all before it changes any: order and threads do not matter.

use super::super::bodies::Body;
use super::super::pairs::Pair;
use super::super::shapes::ShapeSlot;
use super::loads::Load;
use crate::arbiter::{Arbiter, ContactData, HIDDEN, NONE, ONE_NORMAL, SLOTS};
use crate::edge_lists::EdgeLists;
use crate::math::{Pose, Real, Vec3};
use crate::narrow_phase::{Patch, SeamCast as Cast, Verdict, scale_of};
use crate::parallel::{SharedSlice, StagePool};
use crate::shape::{Ray, ShapeHit, cast_placed};
use crate::solver::SolverBodies;
use crate::storage::FixedList;

/// Contacts with fixed shapes that are looked at of a body; further ones are never hidden.
const MOST: usize = 24;
/// Bodies that a thread looks at at a time.
const BODIES_PER_BLOCK: usize = 16;
/// Normals this near to each other (the square of their distance) are one.
const SAME: Real = 1e-8;

/// What the search for hidden contacts reads and writes.
pub(super) struct SeamSearch<'a> {
    pub shapes: &'a [ShapeSlot],
    pub bodies: &'a [Body],
    pub solver: &'a SolverBodies,
    pub lists: &'a EdgeLists,
    pub pairs: SharedSlice<'a, Pair>,
    pub arbiters: SharedSlice<'a, Arbiter>,
    pub slop: Real,
    pub break_distance: Real,
}

/// A shape that nothing can push near the body, and their arbiter if they touch.
#[derive(Clone, Copy)]
struct Fixed<'a> {
    /// `NONE` if they do not touch.
    arbiter: u32,
    pair: u32,
    shape: &'a ShapeSlot,
    /// The shape of the body.
    own: u32,
    /// Which body of the pair is the fixed one.
    side: usize,
    /// Where the fixed shape is, seen from the middle of the body, in world axes.
    pose: Pose,
    /// Where the fixed body's centre of mass is.
    center: Pose,
    scale: Real,
}

/// What is wrong with the contacts of an arbiter, by slots.
#[derive(Clone, Copy)]
struct Found {
    /// At seams.
    hidden: u8,
    /// With normals that are a little off this one, which points away from the fixed shape.
    leaning: u8,
    upright: Vec3,
}

impl Found {
    const NOTHING: Self = Self { hidden: 0, leaning: 0, upright: Vec3::ZERO };
}

impl Fixed<'_> {
    fn cast(&self, ray: &Ray) -> Option<ShapeHit> {
        cast_placed(&self.shape.geometry, &self.pose, ray)
    }

    /// The contacts in some slots with one normal.
    fn patch(&self, data: &ContactData, members: u8) -> Patch {
        let mut patch = Patch { points: [Vec3::ZERO; SLOTS], count: 0, normal: Vec3::ZERO };
        for contact in (0..SLOTS).filter(|slot| members >> slot & 1 == 1).map(|slot| &data.slots[slot]) {
            let (anchor, normal) = match self.side {
                0 => (contact.local_anchor1, contact.normal),
                _ => (contact.local_anchor2, -contact.normal),
            };
            (patch.points[patch.count], patch.normal) = (self.center.transform_point(anchor), normal);
            patch.count += 1;
        }
        patch
    }
}

/// Slots with contacts of the engine's own.
pub(super) fn own_slots(data: &ContactData) -> u8 {
    let own = |slot: &usize| data.usage_mask >> slot & 1 == 1 && !data.slots[*slot].world_normal;
    (0..SLOTS).filter(own).fold(0, |mask, slot| mask | 1 << slot)
}

/// The slots of a mask whose normal is that of its first.
fn alike(data: &ContactData, mask: u8) -> u8 {
    let normal = data.slots[mask.trailing_zeros() as usize & (SLOTS - 1)].normal;
    let same = |slot: &usize| mask >> slot & 1 == 1 && data.slots[*slot].normal == normal;
    (0..SLOTS).filter(same).fold(mask & mask.wrapping_neg(), |found, slot| found | 1 << slot)
}

impl SeamSearch<'_> {
    /// Hides the contacts at seams of some bodies, each named once, and hands on their loads of the last step, by body.
    pub fn run(&self, bodies: &[u32], loads: &[Load], pool: &mut StagePool) {
        pool.run(bodies.len().div_ceil(BODIES_PER_BLOCK), |block| {
            let first = block * BODIES_PER_BLOCK;
            for &body in bodies.iter().skip(first).take(BODIES_PER_BLOCK) {
                self.hide_contacts_of(body);
                if let Ok(at) = loads.binary_search_by_key(&body, |load| load.body) {
                    self.hand_on(&loads[at]);
                }
            }
        });
    }

    /// The contacts with a shape, if they touch.
    fn data(&self, fixed: &Fixed<'_>) -> Option<&ContactData> {
        // SAFETY: an arbiter with a fixed body belongs to its other body, which one thread looks at.
        (fixed.arbiter != NONE).then(|| unsafe { &self.arbiters.get(fixed.arbiter as usize).data })
    }

    fn hide_contacts_of(&self, body: u32) {
        if !self.has_several_normals(body) {
            return;
        }
        let mut list = FixedList::<Fixed<'_>, MOST>::new();
        self.list_fixed(body, &mut list);
        let list = list.as_slice();
        let mut found = [Found::NOTHING; MOST];
        for at in 0..list.len() {
            found[at] = self.look_at(at, (list, &found));
        }
        for (found, fixed) in found.iter().zip(list).filter(|(found, _)| found.hidden | found.leaning != 0) {
            // SAFETY: as above, and nothing else of this body's is borrowed now.
            let (pair, arbiter) =
                unsafe { (self.pairs.get_mut(fixed.pair as usize), self.arbiters.get_mut(fixed.arbiter as usize)) };
            let (data, hidden) = (&mut arbiter.data, found.hidden);
            pair.has_manifold = false;
            for slot in (0..SLOTS).filter(|slot| found.leaning >> slot & 1 == 1) {
                data.slots[slot].normal = if fixed.side == 0 { found.upright } else { -found.upright };
            }
            (0..SLOTS).filter(|slot| hidden >> slot & 1 == 1).for_each(|slot| data.slots[slot].reset_impulses());
            if data.usage_mask & 15 & !hidden == 0 {
                data.flags |= HIDDEN;
            } else {
                data.usage_mask &= !hidden;
            }
        }
    }

    /// What nothing can push near a body.
    fn list_fixed<'a>(&'a self, body: u32, list: &mut FixedList<Fixed<'a>, MOST>) {
        let middle = self.solver.masses[body as usize].center;
        for (index, pair, side) in self.fixed_pairs(body).take(MOST) {
            let other = pair.bodies[side] as usize;
            let shape = &self.shapes[pair.shapes[side] as usize];
            let seen = |pose: Pose| Pose::new(pose.position - middle, pose.rotation);
            list.push(Fixed {
                arbiter: pair.arbiter,
                pair: index,
                shape,
                own: pair.shapes[1 - side],
                side,
                pose: seen(self.bodies[other].pose.mul(&shape.pose)),
                center: seen(self.solver.masses[other].pose()),
                scale: scale_of(self.slop, pair.size),
            });
        }
    }

    /// Whether a body has contacts with several normals against what nothing can push.
    fn has_several_normals(&self, body: u32) -> bool {
        let mut first: Option<Vec3> = None;
        let mut several = false;
        let mut touching = 0;
        for (_, pair, side) in self.fixed_pairs(body).filter(|(_, pair, _)| pair.arbiter != NONE) {
            // SAFETY: an arbiter with a fixed body belongs to its other body, which one thread looks at.
            let data = unsafe { &self.arbiters.get(pair.arbiter as usize).data };
            let used = data.usage_mask & 15;
            if used == 0 {
                continue;
            }
            touching += 1;
            let normal = data.slots[used.trailing_zeros() as usize].normal;
            let normal = if side == 0 { normal } else { -normal };
            let known = *first.get_or_insert(normal);
            several |= data.flags & ONE_NORMAL == 0 || (known - normal).length_squared() > SAME;
        }
        several && touching > 1
    }

    /// The pairs of a body with what nothing can push, and which side that is.
    pub(super) fn fixed_pairs(&self, body: u32) -> impl Iterator<Item = (u32, &Pair, usize)> {
        self.lists.of_body(body).filter_map(move |index| {
            // SAFETY: nobody changes a pair between two moving bodies here, and others are this body's.
            let pair = unsafe { self.pairs.get(index as usize) };
            let side = usize::from(pair.bodies[0] == body);
            (pair.borne() == Some(body)).then_some((index, pair, side))
        })
    }

    /// What is wrong with the contacts of an arbiter; `found` is that of the arbiters before it. What is hidden hides nothing,
    /// so that of several contacts that would hide each other one is left.
    fn look_at(&self, at: usize, (list, before): (&[Fixed<'_>], &[Found; MOST])) -> Found {
        let fixed = &list[at];
        let Some(data) = self.data(fixed) else { return Found::NOTHING };
        let near = |other: &Fixed<'_>| other.own == fixed.own;
        let cast = |ray: &Ray| first_hit(list.iter().filter(|other| near(other)), ray);
        let own = |ray: &Ray| fixed.cast(ray);
        let (mut left, mut found) = (own_slots(data), Found::NOTHING);
        while left != 0 {
            let members = alike(data, left);
            left &= !members;
            let patch = fixed.patch(data, members);
            let others = list.iter().zip(before).enumerate().filter(|(place, (other, _))| *place != at && near(other));
            let mut verdicts = others
                .map(|(_, (other, found))| self.verdict((other, found.hidden), &patch, ((&cast, &own), fixed.scale)));
            match verdicts.find(|verdict| *verdict != Verdict::Counts) {
                Some(Verdict::Hidden) => found.hidden |= members,
                Some(Verdict::Straightened(normal)) if found.leaning == 0 || found.upright == normal => {
                    (found.leaning, found.upright) = (found.leaning | members, normal);
                }
                _ => {}
            }
        }
        found
    }

    /// What a contact is beside the bearings on another shape, of those not hidden themselves.
    fn verdict(
        &self,
        (other, hidden): (&Fixed<'_>, u8),
        patch: &Patch,
        (casts, scale): ((Cast<'_>, Cast<'_>), Real),
    ) -> Verdict {
        let Some(data) = self.data(other) else { return Verdict::Counts };
        let mut left = own_slots(data) & !hidden;
        while left != 0 {
            let members = alike(data, left);
            left &= !members;
            let verdict = patch.beside(&other.patch(data, members).bearing(), casts, scale);
            if verdict != Verdict::Counts {
                return verdict;
            }
        }
        Verdict::Counts
    }
}

/// The first hit of a ray on several shapes.
fn first_hit<'a>(shapes: impl Iterator<Item = &'a Fixed<'a>>, ray: &Ray) -> Option<ShapeHit> {
    let mut first: Option<ShapeHit> = None;
    for shape in shapes {
        let limit = first.map_or(ray.max_fraction, |hit| hit.fraction);
        if let Some(hit) = shape.cast(&Ray { max_fraction: limit, ..*ray })
            && first.is_none_or(|first| hit.fraction < first.fraction)
        {
            first = Some(hit);
        }
    }
    first
}
