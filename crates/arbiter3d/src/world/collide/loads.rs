//! Loads that several shapes bear together: of a body on a floor of many shapes, as of one floor.
//!
//! Where the parts of the patch on which a body bears meet, at a seam, two shapes give two points each that one floor would not
//! give. They push as springs do: with them, a can on two shapes leans towards where there are fewer, and rolls in a curve. So
//! of all points that touch and push one way, those are left out that are within the convex outline of the others, or on it.
//!
//! What rolls or slides from one such shape to the next is borne by other points in each step, of other arbiters. Their impulses
//! of the last step, with which the solver begins, would be those of points that are no more: for a moment one end of a can has
//! no load and the other one too much. It dips and, as it spins, it veers.
//!
//! So before the narrow phase, the loads of all contacts with what nothing can push are added up (a [`Load`]), if they push one
//! way: with the impulse `Jᵢ` at the lever `rᵢ` from the centre of mass, `Σ Jᵢ` and `Σ Jᵢ rᵢ`; of friction the impulse and the
//! moment about the normal. After it, the points that touch now get loads with the same sums: to what each has from the contact
//! that it goes on from, the least changes `Δᵢ = a + b · rᵢ` are added that do it. Where that would make a point pull, it gets
//! none and the others share it. A rigid body feels only the sums, so that nothing moves by this; friction is shared as
//! loads are, and no two arbiters twist a body against each other.
//!
//! Of bodies with points that several directions push, and of those that have sunk in, each arbiter keeps what is its own.

use super::super::definition::BodyKind;
use super::super::pairs::Pair;
use super::contacts::GOES_ON;
use super::seams::{SeamSearch, own_slots};
use crate::arbiter::{Contact, ContactData, HIDDEN, NONE, SLOTS};
use crate::math::{Real, Vec3, clamp, max, min, tangents};
use crate::storage::FixedList;

/// Points that share a load; what rests on more keeps it as it is.
const MOST: usize = 64;
/// Points that are farther away than this share of the slop bear nothing.
const TOUCHING: Real = 0.02;
/// Times that points which would pull are left out.
const ROUNDS: usize = 4;
/// Points that are outside the outline of the others by no more than this share of the slop are on it.
const ON_OUTLINE: Real = 0.02;
/// Points on a line get a width of this share of its length (squared), so that all moments have an answer.
const WIDTH: Real = 1e-4;

/// What the contacts of a body with what nothing can push bear together, about its centre of mass.
#[derive(Clone, Copy, Debug)]
pub(super) struct Load {
    pub body: u32,
    /// Away from what bears.
    normal: Vec3,
    push: Real,
    /// Sum of the levers, each times its impulse.
    moment: Vec3,
    /// Of friction.
    drag: Vec3,
    /// About the normal.
    twist: Real,
}

/// A point that bears.
#[derive(Clone, Copy)]
struct Bearer {
    arbiter: u32,
    slot: usize,
    /// From the centre of mass, square to the normal.
    lever: [Real; 2],
    /// Handed on by the contact that it goes on from.
    kept: Real,
    impulse: Real,
    separation: Real,
    pulls: bool,
}

/// How a contact is seen from the body: which side of the arbiter the fixed one is.
fn seen(data: &ContactData, contact: &Contact, side: usize) -> (Vec3, Vec3, Real) {
    let anchor = if side == 0 { contact.local_anchor2 } else { contact.local_anchor1 };
    let sign = if side == 0 { 1.0 } else { -1.0 };
    (data.rotations[1 - side].rotate(anchor), contact.normal * sign, sign)
}

impl SeamSearch<'_> {
    /// What a body was borne with in the last step; nothing if several directions pushed it.
    pub(super) fn load_of(&self, body: u32) -> Option<Load> {
        let mut load = Load { body, normal: Vec3::ZERO, push: 0.0, moment: Vec3::ZERO, drag: Vec3::ZERO, twist: 0.0 };
        for (_, pair, side) in self.fixed_pairs(body).filter(|(_, pair, _)| pair.arbiter != NONE) {
            // SAFETY: an arbiter with a fixed body belongs to its other body, which one thread looks at.
            let data = unsafe { &self.arbiters.get(pair.arbiter as usize).data };
            let solved = |slot: &usize| data.usage_mask >> 4 >> slot & 1 == 1;
            let (mut middle, mut count, mut drag) = (Vec3::ZERO, 0.0, Vec3::ZERO);
            for contact in (0..SLOTS).filter(solved).map(|slot| &data.slots[slot]) {
                let (lever, normal, sign) = seen(data, contact, side);
                (middle, count) = (middle + lever, count + 1.0);
                if contact.normal_impulse <= 0.0 {
                    continue;
                }
                if load.push <= 0.0 {
                    load.normal = normal;
                }
                if contact.world_normal || normal.dot(load.normal) < GOES_ON {
                    return None;
                }
                load.push += contact.normal_impulse;
                load.moment += lever * contact.normal_impulse;
                drag += contact.tangent_impulse * sign;
                load.twist += contact.twist_impulse;
            }
            if count > 0.0 {
                load.drag += drag;
                load.twist += (middle * (1.0 / count)).cross(drag).dot(load.normal);
            }
        }
        (load.push > 0.0).then_some(load)
    }

    /// Hands the load of a body on to the points that bear it now.
    pub(super) fn hand_on(&self, load: &Load) {
        let mut points = FixedList::<Bearer, MOST>::new();
        if !self.list_bearers(load, &mut points) || points.as_slice().is_empty() {
            return;
        }
        self.keep_outline(load.body, &mut points);
        share(load, points.as_mut_slice());
        for point in points.as_slice() {
            // SAFETY: an arbiter with a fixed body belongs to its other body, which one thread looks at.
            let data = unsafe { &mut self.arbiters.get_mut(point.arbiter as usize).data };
            data.slots[point.slot].normal_impulse = point.impulse;
        }
        self.share_friction(load);
    }

    /// The points that push along the load; false where others bear too, or there are too many.
    fn list_bearers(&self, load: &Load, points: &mut FixedList<Bearer, MOST>) -> bool {
        let (t1, t2) = tangents(load.normal);
        for (_, pair, side) in self.fixed_pairs(load.body).filter(|(_, pair, _)| pair.arbiter != NONE) {
            // SAFETY: as above.
            let data = unsafe { &self.arbiters.get(pair.arbiter as usize).data };
            if data.flags & HIDDEN != 0 {
                continue;
            }
            let mine = own_slots(data);
            for slot in (0..SLOTS).filter(|slot| data.usage_mask >> slot & 1 == 1) {
                let contact = &data.slots[slot];
                let (lever, normal, _) = seen(data, contact, side);
                let along = mine >> slot & 1 == 1 && normal.dot(load.normal) > GOES_ON;
                let deep = contact.separation < -self.break_distance;
                if deep || !along && contact.normal_impulse > 0.0 || points.as_slice().len() == MOST {
                    return false;
                }
                if along && contact.separation <= TOUCHING * self.slop {
                    let lever = [lever.dot(t1), lever.dot(t2)];
                    let kept = contact.normal_impulse;
                    points.push(Bearer {
                        arbiter: pair.arbiter,
                        slot,
                        lever,
                        kept,
                        impulse: kept,
                        separation: contact.separation,
                        pulls: false,
                    });
                }
            }
        }
        true
    }

    /// Leaves out the points of several arbiters that are not needed beside the others.
    fn keep_outline(&self, body: u32, points: &mut FixedList<Bearer, MOST>) {
        let list = points.as_mut_slice();
        if list.iter().all(|point| point.arbiter == list[0].arbiter) {
            return;
        }
        let width = ON_OUTLINE * self.slop;
        let mut needed = outline(list, width);
        let outer = |place: usize| needed >> place & 1 == 1;
        let deepest = (0..list.len()).filter(|&place| outer(place)).fold(Real::MAX, |m, i| min(list[i].separation, m));
        for (place, point) in list.iter().enumerate() {
            needed |= u64::from(point.separation < deepest - TOUCHING * self.slop) << place;
        }
        let moves =
            |(_, pair, side): (u32, &Pair, usize)| self.bodies[pair.bodies[side] as usize].kind == BodyKind::Kinematic;
        let again = self.fixed_pairs(body).any(moves);
        let mut kept = 0;
        for place in 0..list.len() {
            let point = list[place];
            if needed >> place & 1 == 1 {
                list[kept] = point;
                kept += 1;
                continue;
            }
            // SAFETY: an arbiter with a fixed body belongs to its other body, which one thread looks at, and so does its pair.
            unsafe {
                let arbiter = self.arbiters.get_mut(point.arbiter as usize);
                leave_out(&mut arbiter.data, point.slot);
                self.pairs.get_mut(arbiter.pair as usize).has_manifold &= !again;
            }
        }
        points.truncate(kept);
    }

    /// Shares friction among the arbiters as the load is shared.
    fn share_friction(&self, load: &Load) {
        let arbiters = || self.fixed_pairs(load.body).filter(|(_, pair, _)| pair.arbiter != NONE);
        let (mut push, mut firm, mut twist, mut friction) = (0.0, 0.0, load.twist, None);
        for (_, pair, side) in arbiters() {
            // SAFETY: as above.
            let data = unsafe { &self.arbiters.get(pair.arbiter as usize).data };
            let part = Part::of(data, side);
            push += part.push;
            firm += if part.count > 1 { part.push } else { 0.0 };
            if part.push > 0.0 && *friction.get_or_insert(data.friction) != data.friction {
                return;
            }
        }
        if push <= 0.0 {
            return;
        }
        let drag = load.drag - load.normal * load.normal.dot(load.drag);
        for (_, pair, side) in arbiters() {
            // SAFETY: as above.
            let part = Part::of(unsafe { &self.arbiters.get(pair.arbiter as usize).data }, side);
            twist -= part.middle.cross(drag * (part.push / push)).dot(load.normal);
        }
        for (_, pair, side) in arbiters() {
            // SAFETY: as above.
            let data = unsafe { &mut self.arbiters.get_mut(pair.arbiter as usize).data };
            let part = Part::of(data, side);
            let sign = if side == 0 { 1.0 } else { -1.0 };
            for slot in (0..SLOTS).filter(|slot| data.usage_mask >> slot & 1 == 1) {
                let contact = &mut data.slots[slot];
                contact.tangent_impulse = drag * (sign * (contact.normal_impulse / push));
                let turns = part.count > 1 && firm > 0.0;
                contact.twist_impulse = if turns { twist * (contact.normal_impulse / firm) } else { 0.0 };
            }
        }
    }
}

/// Takes a contact from an arbiter; one that has no others keeps it and is not solved.
fn leave_out(data: &mut ContactData, slot: usize) {
    data.slots[slot].reset_impulses();
    if data.usage_mask & 15 == 1 << slot {
        data.flags |= HIDDEN;
    } else {
        data.usage_mask &= !(1 << slot);
    }
}

/// The points that are corners of the outline of all by more than `width`: a bit for each.
fn outline(points: &[Bearer], width: Real) -> u64 {
    let mut ring = FixedList::<usize, MOST>::new();
    hull(points, &mut ring);
    let ring = ring.as_mut_slice();
    let mut count = ring.len();
    while count > 1 {
        // Of the corners near the way between their neighbours, the one that bears least goes.
        let (mut least, mut place) = (Real::MAX, MOST);
        for k in 0..count {
            let [before, corner, after] = [k + count - 1, k, k + 1].map(|k| &points[ring[k % count]]);
            if corner.kept < least && distance(before.lever, after.lever, corner.lever) <= width {
                (least, place) = (corner.kept, k);
            }
        }
        if place == MOST {
            break;
        }
        ring.copy_within(place + 1..count, place);
        count -= 1;
    }
    ring[..count].iter().fold(0, |mask, &place| mask | 1 << place)
}

/// How far a point is from the way between two others.
fn distance(a: [Real; 2], b: [Real; 2], point: [Real; 2]) -> Real {
    let (along, way) = ([b[0] - a[0], b[1] - a[1]], [point[0] - a[0], point[1] - a[1]]);
    let squared = along[0] * along[0] + along[1] * along[1];
    let share = if squared > 0.0 { (along[0] * way[0] + along[1] * way[1]) / squared } else { 0.0 };
    let share = clamp(share, 0.0, 1.0);
    let (x, y) = (way[0] - along[0] * share, way[1] - along[1] * share);
    (x * x + y * y).sqrt()
}

/// Whether a point is to the right of the way from `a` to `b`.
fn is_right(a: [Real; 2], b: [Real; 2], point: [Real; 2]) -> bool {
    (b[1] - a[1]) * (point[0] - a[0]) - (b[0] - a[0]) * (point[1] - a[1]) > 0.0
}

/// The corners of the convex hull of some points, counter-clockwise: Andrew's monotone chain.
fn hull(points: &[Bearer], ring: &mut FixedList<usize, MOST>) {
    let mut order = FixedList::<usize, MOST>::new();
    (0..points.len()).for_each(|place| order.push(place));
    let order = order.as_mut_slice();
    let before = |&a: &usize, &b: &usize| {
        let ([ax, ay], [bx, by]) = (points[a].lever, points[b].lever);
        ax.total_cmp(&bx).then(ay.total_cmp(&by)).then(a.cmp(&b))
    };
    order.sort_unstable_by(before);
    let mut chain = |places: &mut dyn Iterator<Item = usize>| {
        let first = ring.as_slice().len();
        for place in places {
            while let [.., a, b] = ring.as_slice()[first..]
                && !is_right(points[a].lever, points[place].lever, points[b].lever)
            {
                ring.truncate(ring.as_slice().len() - 1);
            }
            if ring.as_slice().len() < MOST {
                ring.push(place);
            }
        }
        // The end of one chain begins the other.
        ring.truncate(ring.as_slice().len() - 1);
    };
    chain(&mut order.iter().copied());
    chain(&mut order.iter().rev().copied());
}

/// What one arbiter bears.
struct Part {
    push: Real,
    /// Where its friction acts, from the centre of mass.
    middle: Vec3,
    count: u32,
}

impl Part {
    fn of(data: &ContactData, side: usize) -> Self {
        let mut part = Self { push: 0.0, middle: Vec3::ZERO, count: 0 };
        if data.flags & HIDDEN != 0 {
            return part;
        }
        for slot in (0..SLOTS).filter(|slot| data.usage_mask >> slot & 1 == 1) {
            part.push += data.slots[slot].normal_impulse;
            part.middle += seen(data, &data.slots[slot], side).0;
            part.count += 1;
        }
        part.middle *= 1.0 / max(part.count as Real, 1.0);
        part
    }
}

/// Gives points impulses with the sums of a load.
fn share(load: &Load, points: &mut [Bearer]) {
    let (t1, t2) = tangents(load.normal);
    let moment = [load.moment.dot(t1), load.moment.dot(t2)];
    for _ in 0..ROUNDS {
        let changes = Changes::new((load.push, moment), points);
        let mut pulls = false;
        for point in points.iter_mut().filter(|point| !point.pulls) {
            point.impulse = point.kept + changes.at(point.lever);
            if point.impulse < 0.0 {
                (point.impulse, point.pulls, pulls) = (0.0, true, true);
            }
        }
        if !pulls {
            break;
        }
    }
}

/// What each point gets in addition: `all + slope · (lever − middle)`.
struct Changes {
    all: Real,
    slope: [Real; 2],
    middle: [Real; 2],
}

impl Changes {
    fn new((push, moment): (Real, [Real; 2]), points: &[Bearer]) -> Self {
        let (mut count, mut missing, mut lacks, mut middle) = (0.0, push, moment, [0.0; 2]);
        for Bearer { lever: [x, y], kept, .. } in points.iter().filter(|point| !point.pulls) {
            count += 1.0;
            missing -= kept;
            lacks = [lacks[0] - x * kept, lacks[1] - y * kept];
            middle = [middle[0] + x, middle[1] + y];
        }
        let share = 1.0 / max(count, 1.0);
        let middle = [middle[0] * share, middle[1] * share];
        let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
        for Bearer { lever: [x, y], .. } in points.iter().filter(|point| !point.pulls) {
            let (x, y) = (x - middle[0], y - middle[1]);
            (xx, xy, yy) = (xx + x * x, xy + x * y, yy + y * y);
        }
        let width = WIDTH * (xx + yy) + Real::MIN_POSITIVE;
        let (xx, yy) = (xx + width, yy + width);
        let inverse = 1.0 / (xx * yy - xy * xy);
        let [x, y] = [lacks[0] - middle[0] * missing, lacks[1] - middle[1] * missing];
        let slope = [(yy * x - xy * y) * inverse, (xx * y - xy * x) * inverse];
        let slope = if inverse.is_finite() { slope } else { [0.0; 2] };
        Self { all: missing * share, slope, middle }
    }

    fn at(&self, [x, y]: [Real; 2]) -> Real {
        self.all + self.slope[0] * (x - self.middle[0]) + self.slope[1] * (y - self.middle[1])
    }
}
