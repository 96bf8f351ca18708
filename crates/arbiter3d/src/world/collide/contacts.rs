//! From a manifold to the contacts of an arbiter.
//!
//! All is reckoned from the bodies' centres of mass, never from the world's origin: with the centre frames at `c₁, q₁` and
//! `c₂, q₂`, a point `p₁` seen from the centre of body 1 and its gap `s` along the world normal `n` give
//!
//! ```text
//! anchor₁ = p₁,  anchor₂ = q₂⁻¹ (q₁ p₁ + s n − (c₂ − c₁))
//! ```

use super::super::pairs::Pair;
use super::super::shapes::ShapeSlot;
use crate::arbiter::{Contact, ContactData, HIDDEN, ONE_NORMAL, SLOTS, SolveMode};
use crate::math::{Pose, Real, Rotation, Vec3, min};
use crate::narrow_phase::{Manifold, ManifoldPoint, WideManifold};
use crate::simd::{LanePose, LaneRotation, LaneVec3, Lanes, Number, Quad};
use crate::solver::SolverBodies;

/// Least cosine between normals of points of which one takes over the load of another.
pub(super) const GOES_ON: Real = 0.99;

/// Where a contact is: what a new manifold changes of it.
#[derive(Clone, Copy, Debug)]
#[repr(C)] // in the order in which lanes are stored
pub(super) struct Place {
    pub anchor1: Vec3,
    pub anchor2: Vec3,
    pub normal: Vec3,
    pub separation: Real,
    pub feature: u32,
}

impl Place {
    const NOWHERE: Self =
        Self { anchor1: Vec3::ZERO, anchor2: Vec3::ZERO, normal: Vec3::ZERO, separation: 0.0, feature: 0 };

    /// Its numbers in order.
    #[inline(always)]
    fn of_quads([a, b, c]: &[Quad; 3], feature: u32) -> Self {
        Self {
            anchor1: Vec3::new(a[0], a[1], a[2]),
            anchor2: Vec3::new(a[3], b[0], b[1]),
            normal: Vec3::new(b[2], b[3], c[0]),
            separation: c[1],
            feature,
        }
    }
}

/// Up to four places.
#[derive(Clone, Copy, Debug)]
pub(super) struct Places {
    pub points: [Place; SLOTS],
    pub count: usize,
    /// A bit for each point of the second pair of materials.
    pub others: u8,
}

impl Places {
    pub const NONE: Self = Self { points: [Place::NOWHERE; SLOTS], count: 0, others: 0 };

    /// Those of a manifold in the frame of shape 1.
    pub fn of_manifold(manifold: &Manifold, frame: &PairFrame) -> Self {
        let mut places = Self::NONE;
        for (place, point) in places.points.iter_mut().zip(manifold.points()) {
            *place = frame.place(point);
        }
        places.count = manifold.points().len();
        places.others = manifold.other_materials().1;
        places
    }
}

/// How a manifold in the frame of shape 1 becomes places on the two bodies.
pub(super) struct PairFrame {
    /// Shape 1 seen from the centre of body 1.
    pub shape: Pose,
    pub rotation1: Rotation,
    pub rotation2: Rotation,
    /// From centre to centre, world axes.
    pub apart: Vec3,
}

impl PairFrame {
    #[inline(always)]
    pub fn new(pair: &Pair, shapes: &[ShapeSlot], bodies: &SolverBodies) -> Self {
        let [m1, m2] = pair.bodies.map(|body| &bodies.masses[body as usize]);
        Self {
            shape: shapes[pair.shapes[0] as usize].from_center,
            rotation1: m1.rotation,
            rotation2: m2.rotation,
            apart: m2.center - m1.center,
        }
    }

    fn place(&self, point: &ManifoldPoint) -> Place {
        let anchor1 = self.shape.transform_point(point.point1);
        let normal = self.rotation1.rotate(self.shape.rotation.rotate(point.normal));
        let arm2 = self.rotation1.rotate(anchor1) + normal * point.separation - self.apart;
        Place {
            anchor1,
            anchor2: self.rotation2.inverse_rotate(arm2),
            normal,
            separation: point.separation,
            feature: point.feature,
        }
    }
}

/// What [`WideFrame`] is loaded from.
pub(super) struct FrameRecords<'a, const L: usize> {
    masses1: [&'a [Quad; 4]; L],
    masses2: [&'a [Quad; 4]; L],
    /// Position and rotation of shape 1 seen from the centre of body 1.
    shapes: [[Quad; 2]; L],
}

/// Stands in for bodies of pairs that a group lacks.
static NO_MASS: [Quad; 4] = [[0.0; 4]; 4];

impl<'a, const L: usize> FrameRecords<'a, L> {
    pub const NONE: Self = Self { masses1: [&NO_MASS; L], masses2: [&NO_MASS; L], shapes: [[[0.0; 4]; 2]; L] };

    #[inline(always)]
    pub fn set(&mut self, lane: usize, pair: &Pair, shapes: &[ShapeSlot], bodies: &'a SolverBodies) {
        let Pose { position: p, rotation: q } = shapes[pair.shapes[0] as usize].from_center;
        self.masses1[lane] = bodies.masses[pair.bodies[0] as usize].quads();
        self.masses2[lane] = bodies.masses[pair.bodies[1] as usize].quads();
        self.shapes[lane] = [[p.x, p.y, p.z, q.x], [q.y, q.z, q.w, 0.0]];
    }
}

/// [`PairFrame`], several side by side.
pub(super) struct WideFrame<W> {
    shape: LanePose<W>,
    rotation1: LaneRotation<W>,
    rotation2: LaneRotation<W>,
    apart: LaneVec3<W>,
}

impl<W: Number> WideFrame<W> {
    #[inline(always)]
    pub fn load<const L: usize>(records: &FrameRecords<'_, L>) -> Self
    where
        W: Lanes<L>,
    {
        let center1 = LanePose::<W>::load(&records.masses1);
        let center2 = LanePose::<W>::load(&records.masses2);
        Self {
            shape: LanePose::load(&records.shapes.each_ref()),
            rotation1: center1.rotation,
            rotation2: center2.rotation,
            apart: center2.position - center1.position,
        }
    }

    /// What [`PairFrame::place`] does to each point of each lane.
    #[inline(always)]
    pub fn place<const L: usize>(&self, manifold: &WideManifold<L>, places: &mut [Places; L])
    where
        W: Lanes<L>,
    {
        let normal = self.rotation1.rotate(&self.shape.rotation.rotate(&manifold.normal.to_lanes()));
        let mut most = 0;
        for (places, &count) in places.iter_mut().zip(&manifold.count) {
            places.count = count as usize;
            most = most.max(places.count);
        }
        for i in 0..most.min(SLOTS) {
            let (point, separation) = (manifold.point1[i].to_lanes(), W::from_array(manifold.separation[i].0));
            let a = self.shape.rotation.rotate(&point) + self.shape.position;
            let arm2 = self.rotation1.rotate(&a) + normal.scale(separation) - self.apart;
            let b = self.rotation2.inverse_rotate(&arm2);
            let first = W::store(&[a.x, a.y, a.z, b.x]);
            let second = W::store(&[b.y, b.z, normal.x, normal.y]);
            let third = W::store(&[normal.z, separation, W::ZERO, W::ZERO]);
            for (lane, places) in places.iter_mut().enumerate() {
                let quads = [first[lane], second[lane], third[lane]];
                places.points[i] = Place::of_quads(&quads, manifold.feature[i][lane]);
            }
        }
    }
}

/// Turns normals and levers to where the bodies have turned.
pub(super) fn turn_levers(data: &mut ContactData, rotations: [Rotation; 2]) {
    let then = std::mem::replace(&mut data.rotations, rotations)[0];
    for slot in (0..SLOTS).filter(|slot| data.usage_mask >> slot & 1 == 1) {
        let contact = &mut data.slots[slot];
        if !contact.world_normal {
            let normal = rotations[0].rotate(then.inverse_rotate(contact.normal));
            contact.normal = normal / normal.length(); // else rounding adds up, turn by turn
        }
    }
}

/// Replaces the contacts of an arbiter by those of a new manifold; points that were there before keep their slot and
/// impulses.
///
/// A point is the same when its features are; else when an old one not yet taken is within the break distance on either body:
/// the corner of a box that slides on stays that corner, whatever part of the floor it passes to. `rotations` are those of the
/// bodies.
pub(super) fn update_contacts(data: &mut ContactData, places: &Places, rotations: [Rotation; 2], break_distance: Real) {
    data.rotations = rotations;
    let points = &places.points[..places.count.min(SLOTS)];
    let mut matches = match_slots(data, points, break_distance);
    let mut used: u8 = matches.iter().filter(|&&slot| slot < SLOTS).fold(0, |mask, &slot| mask | 1 << slot);
    let left = ((data.usage_mask & 15) | data.usage_mask >> 4) & !used;
    let sunk = has_sunk(points, break_distance);
    let mut loads = [0.0; SLOTS];
    for (i, place) in points.iter().enumerate().filter(|(i, _)| matches[*i] == SLOTS) {
        if !sunk {
            loads[i] = passed_on(data, left, place, (points, &matches));
        }
    }
    let (mut one_normal, mut others) = (true, 0);
    for (i, place) in points.iter().enumerate() {
        let kept = matches[i] < SLOTS;
        if !kept {
            matches[i] = (!used).trailing_zeros() as usize & (SLOTS - 1);
            used |= 1 << matches[i];
        }
        let contact = &mut data.slots[matches[i]];
        set_place(contact, place);
        if kept {
            contact.tangent_impulse -= place.normal * place.normal.dot(contact.tangent_impulse);
        } else {
            contact.reset_impulses();
            contact.normal_impulse = loads[i];
        }
        one_normal &= place.normal == points[0].normal;
        others |= (places.others >> i & 1) << matches[i];
    }
    data.other_slots = others;
    one_normal &= others == 0;
    data.usage_mask = data.usage_mask & 0xf0 | used;
    data.flags = data.flags & !(ONE_NORMAL | HIDDEN) | if one_normal { ONE_NORMAL } else { 0 };
}

/// What a new point that touches takes over of points that are no more, in the slots of the bit mask `left`: of what slides or
/// rolls, the load goes on though other points bear it.
fn passed_on(data: &ContactData, left: u8, point: &Place, (points, matches): (&[Place], &[usize; SLOTS])) -> Real {
    if left == 0 || point.separation > 0.0 {
        return 0.0;
    }
    let alike = |normal: Vec3| normal.dot(point.normal) > GOES_ON;
    let heirs = |i: &usize| matches[*i] == SLOTS && points[*i].separation <= 0.0 && alike(points[*i].normal);
    let gone = |slot: &usize| left >> slot & 1 == 1 && alike(data.slots[*slot].normal);
    let load = (0..SLOTS).filter(gone).fold(0.0, |sum, slot| sum + data.slots[slot].normal_impulse);
    load / (0..points.len()).filter(heirs).count() as Real
}

/// Whether shapes have run into each other: such a body is pushed out, not borne, and no point is another's heir.
fn has_sunk(points: &[Place], break_distance: Real) -> bool {
    points.iter().any(|point| point.separation < -break_distance)
}

/// The slot of the contact that each point goes on from, or [`SLOTS`].
fn match_slots(data: &ContactData, points: &[Place], break_distance: Real) -> [usize; SLOTS] {
    let old = &data.slots;
    let mut unclaimed = (data.usage_mask & 15) | data.usage_mask >> 4;
    let mut matches = [SLOTS; SLOTS];
    let mut missing = false;
    for (found, point) in matches.iter_mut().zip(points) {
        for slot in (0..SLOTS).rev() {
            if unclaimed >> slot & 1 == 1 && old[slot].feature == point.feature {
                *found = slot;
            }
        }
        unclaimed &= !(1_u32 << *found) as u8;
        missing |= *found == SLOTS;
    }
    if !missing || unclaimed == 0 {
        return matches;
    }
    let sunk = has_sunk(points, break_distance);
    for (found, point) in matches.iter_mut().zip(points).filter(|(found, _)| **found == SLOTS) {
        let near = |slot: usize| {
            let apart1 = (old[slot].local_anchor1 - point.anchor1).length_squared();
            if sunk {
                return apart1;
            }
            min(apart1, (old[slot].local_anchor2 - point.anchor2).length_squared())
        };
        let mut best = break_distance * break_distance;
        for slot in (0..SLOTS).filter(|&slot| unclaimed >> slot & 1 == 1) {
            if near(slot) < best {
                best = near(slot);
                *found = slot;
            }
        }
        unclaimed &= !(1_u32 << *found) as u8;
    }
    matches
}

#[inline(always)]
fn set_place(contact: &mut Contact, place: &Place) {
    contact.local_anchor1 = place.anchor1;
    contact.local_anchor2 = place.anchor2;
    contact.normal = place.normal;
    contact.separation = place.separation;
    contact.feature = place.feature;
    contact.remove = SolveMode::NONE;
    contact.world_normal = false;
}
