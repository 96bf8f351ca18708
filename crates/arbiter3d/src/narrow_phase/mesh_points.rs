//! Which four of a mesh's many contact points carry the pair.
//!
//! Points are gathered from all triangles into a fixed buffer. They are grouped by normal; when the buffer is full, each
//! group keeps its deepest point and its extremes along eight directions of its plane. That loses no corner of a box,
//! however many triangles the box lies on: a corner of a right angle is extreme along at least one of eight directions.
//!
//! At the end the groups are merged, nearest normals first, until there are at most four. Every group gives its deepest
//! point; the remaining places go where they add most, points that touch before those that do not: the square of a length
//! for the second point of a group, twice the area for the third and the fourth. So a box on a floor keeps its four corners,
//! a box in a groove two on each side.
//!
//! Where more than four points bear a body, the choice among them decides where it comes to rest, and there another choice may
//! be the better one. So points that go on from those of the last step, by their features or by where they are on either
//! shape (what was the crossing of two edges is where a face ends in the next step), are *held*: another one has to be deeper
//! or wider by a margin to take their place, and a held one that bears is given up for one that stands off only if it adds
//! next to nothing. Without that, thin plates on waves went to and fro between two choices and never slept.

use super::Manifold;
use crate::math::{Real, Vec3, max, min, tangents};
use crate::storage::FixedList;

/// The normal of a point is not that of a triangle.
pub(super) const NO_FACET: u32 = u32::MAX;
/// Neither is it, and what touches is round there: a point or a line of it bears, and moves on as it rolls.
pub(super) const ROLLING: u32 = u32::MAX - 1;

/// A contact point, in the frame of the convex shape.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    /// On the mesh.
    pub(super) position: Vec3,
    /// From the mesh to the convex shape.
    pub(super) normal: Vec3,
    pub(super) separation: Real,
    pub(super) feature: u32,
    /// Internal number of the triangle whose normal this is (on either side of it), [`NO_FACET`] or
    /// [`ROLLING`].
    pub(super) facet: u32,
    /// Internal number of the triangle that touches.
    pub(super) triangle: u32,
}

impl Candidate {
    /// Whether its normal is that of a triangle.
    pub(super) fn is_on_face(&self) -> bool {
        self.facet < ROLLING
    }
}

/// A number for a corner by where it is: the same from step to step, whichever triangle brings it.
pub(super) fn position_number(corner: Vec3) -> u32 {
    let [x, y, z] = corner.to_array().map(Real::to_bits);
    let mixed = (x ^ 0x5bd1_e995).wrapping_mul(0x9e37_79b1).rotate_left(15) ^ y.wrapping_mul(0x85eb_ca6b);
    (mixed.rotate_left(13) ^ z).wrapping_mul(0x2c1b_3c6d) ^ mixed >> 16
}

/// Points that the buffer holds.
const CAPACITY: usize = 64;
/// Groups kept when the buffer is full: six of nine points leave room for ten more.
const MOST_GROUPS: usize = 6;
/// Normals closer than this (one degree) become one, so that the solver treats the points as one patch.
const SAME_NORMAL: Real = 0.99985;
/// Cosines at which groups are tried: 8°, 25°, 60°, 90°, 120°, anything.
const MERGE: [Real; 6] = [0.99, 0.9, 0.5, 0.0, -0.5, -2.0];
/// Points less deep than the deepest by this share of the tolerance count as deepest: rounding, not rocking.
const EQUALLY_DEEP: Real = 0.02;
/// What is deeper than this, in tolerances, has run into something.
const DEEP: Real = 50.0;
/// How much a fixed direction counts beside the distance from the middle, where corners are equally deep.
const PREFERRED: Real = 0.1;
/// Another choice must be better by this share, so that rounding does not swap equal ones from step to step.
const TIE: Real = 1.000_001;

/// A point that touches goes before one that stands off (the ends of a ridge before the corners that lean over it) if
/// it adds at least this share of what that would: as second, third and fourth point of its group. Past two points the
/// corners matter more, else one is missing on the side to which the solid rocks.
const BEARING_SHARES: [Real; 4] = [0.05, 0.5, 0.5, 1.0];
/// A group stands off that is farther than the nearest by this many tolerances.
const STANDS_OFF: Real = 2.5;
/// A fourth point that adds less to the area of three than this share is not worth moving one for.
const WORTH_WIDENING: Real = 0.1;
/// A candidate goes on from a point of the last step that is no more than this many tolerances away.
const SAME_POINT: Real = 20.0;
/// What a held point adds is taken for this many times as much.
const HELD_GAIN: Real = 1.5;
/// The share by which a held point that bears goes before one that stands off is this many times smaller.
const HELD_SHARE: Real = 1.0 / 8.0;
/// A held point stays the first of its group while it is less deep than the deepest by at most this many tolerances.
const HELD_DEPTH: Real = 1.0;
/// A held point touches up to this many times the separation up to which others do.
const HELD_BEARING: Real = 2.0;
/// Mask of all groups.
const ALL_GROUPS: u8 = u8::MAX;

/// The points found so far.
pub(super) struct Candidates {
    list: FixedList<Candidate, CAPACITY>,
    /// Length below which points do not differ, metres.
    tolerance: Real,
    /// The least separation of all points.
    deepest: Real,
    /// By point: the place of the held point that it goes on from, or [`NOT_HELD`].
    places: [u8; CAPACITY],
}

/// Points of the last step, in the frame of the candidates.
pub(super) struct Held {
    list: FixedList<HeldPoint, 4>,
}

#[derive(Clone, Copy)]
struct HeldPoint {
    /// On the two shapes, as they stand now.
    sides: [Vec3; 2],
    feature: u32,
}

/// Stands for no point among those held.
const NOT_HELD: u8 = 4;

impl Held {
    /// Takes the points out of a manifold.
    #[inline(always)]
    pub(super) fn take(manifold: &mut Manifold) -> Self {
        let mut list = FixedList::new();
        for point in manifold.points() {
            list.push(HeldPoint { sides: [point.point1, point.point2()], feature: point.feature });
        }
        manifold.clear();
        Self { list }
    }

    /// The same in the frame of the candidates, into which `place` brings a point.
    fn placed(&self, place: impl Fn(Vec3) -> Vec3) -> Self {
        let mut list = FixedList::new();
        for point in self.list.as_slice() {
            list.push(HeldPoint { sides: point.sides.map(&place), feature: point.feature });
        }
        Self { list }
    }

    /// Which of them a candidate goes on from: the one of the same features, or the first on either shape by less than
    /// `distance`. [`NOT_HELD`] if none.
    fn place(&self, candidate: &Candidate, distance: Real) -> u8 {
        let held = self.list.as_slice();
        if let Some(place) = held.iter().position(|point| point.feature == candidate.feature) {
            return place as u8;
        }
        let sides = [candidate.position, candidate.position + candidate.normal * candidate.separation];
        let near = |point: &HeldPoint| {
            let apart = |side: usize| (point.sides[side] - sides[side]).length_squared();
            min(apart(0), apart(1)) < distance * distance
        };
        held.iter().position(near).map_or(NOT_HELD, |place| place as u8)
    }
}

/// Points by group.
struct Groups {
    of: [u8; CAPACITY],
    normals: FixedList<Vec3, CAPACITY>,
}

impl Groups {
    #[inline(always)]
    fn count(&self) -> usize {
        self.normals.as_slice().len()
    }

    #[inline(always)]
    fn normal(&self, group: usize) -> Vec3 {
        self.normals.as_slice()[group]
    }
}

impl Candidates {
    // Inlined, so that the list is made where it stays.
    #[inline(always)]
    pub(super) fn new(tolerance: Real) -> Self {
        Self { list: FixedList::new(), tolerance, deepest: Real::MAX, places: [NOT_HELD; CAPACITY] }
    }

    /// The least separation of all points that were added, also of those dropped since.
    pub(super) fn deepest(&self) -> Real {
        self.deepest
    }

    /// Adds a point. One that is not finite (shapes too large for single precision) is left out.
    pub(super) fn push(&mut self, candidate: Candidate) {
        if !(candidate.separation.is_finite() && candidate.position.is_finite() && candidate.normal.is_finite()) {
            return;
        }
        if self.list.as_slice().len() == CAPACITY {
            self.thin_out();
        }
        if candidate.separation < self.deepest {
            self.deepest = candidate.separation;
        }
        self.list.push(candidate);
    }

    /// Hands out the four points that matter most, or fewer; of those that matter about as much, the ones that go on from
    /// points of the last step; `place` brings these into the frame of the candidates.
    pub(super) fn choose(&mut self, held: &Held, place: impl Fn(Vec3) -> Vec3, mut take: impl FnMut(&Candidate)) {
        if self.list.as_slice().is_empty() {
            return;
        }
        // Of four or fewer none is given up.
        if self.list.as_slice().len() > 4 && !held.list.as_slice().is_empty() {
            let held = held.placed(place);
            for (place, candidate) in self.places.iter_mut().zip(self.list.as_slice()) {
                *place = held.place(candidate, SAME_POINT * self.tolerance);
            }
        }
        self.unite_normals();
        let groups = self.group(4);
        let mut chosen = Chosen { points: [[0; 4]; 4], counts: [0; 4] };
        for group in 0..groups.count() {
            chosen.add(group, self.deepest_of(&groups, group));
        }
        let (touching, limit) = self.touching(&chosen, groups.count());
        for _ in groups.count()..4 {
            let next = match self.most_useful(&groups, &chosen, touching, limit) {
                (Some(bearing), Some(widest)) if bearing.2 >= self.bearing_share(&chosen, bearing) * widest.2 => {
                    Some(bearing)
                }
                (_, Some(widest)) => Some(widest),
                _ => self.most_useful(&groups, &chosen, ALL_GROUPS, Real::MAX).1,
            };
            let Some((group, index, _)) = next else { break };
            chosen.add(group, index);
        }
        for group in 0..groups.count() {
            let widened = if groups.count() > 1 { self.widened(&groups, &chosen, group) } else { None };
            for (k, &index) in chosen.points[group][..chosen.counts[group]].iter().enumerate() {
                match widened {
                    Some((place, candidate)) if place == k => take(&candidate),
                    _ => take(&self.list.as_slice()[index]),
                }
            }
        }
    }

    /// How much of what the widest would add a point that touches has to add.
    fn bearing_share(&self, chosen: &Chosen, (group, index, _): Gain) -> Real {
        let share = BEARING_SHARES[chosen.counts[group] - 1];
        if self.is_held(index) { HELD_SHARE * share } else { share }
    }

    /// Whether a candidate goes on from a point of the last step.
    fn is_held(&self, index: usize) -> bool {
        self.places[index] < NOT_HELD
    }

    /// The groups that come about as near as the nearest one, a bit for each, and the separation up to which points do:
    /// what stands off (a wall beside a box on a floor) bears nothing yet, and one point is enough to stop at it.
    fn touching(&self, chosen: &Chosen, groups: usize) -> (u8, Real) {
        let nearest = |group: usize| self.list.as_slice()[chosen.points[group][0]].separation;
        let least = (0..groups).fold(Real::MAX, |m, group| min(m, nearest(group)));
        let limit = max(least, 0.0) + STANDS_OFF * self.tolerance;
        let touches = |group: &usize| {
            let held = self.is_held(chosen.points[*group][0]);
            nearest(*group) <= if held { HELD_BEARING * limit } else { limit }
        };
        ((0..groups).filter(touches).fold(0, |mask, group| mask | 1 << group), limit)
    }

    /// Where only three places were left for a patch of four corners, the middle between the fourth and its nearest
    /// neighbour takes the place of that neighbour: three corners alone would leave a box to rock over their longest side.
    fn widened(&self, groups: &Groups, chosen: &Chosen, group: usize) -> Option<(usize, Candidate)> {
        if chosen.counts[group] != 3 {
            return None;
        }
        let [a, b, c] = [0, 1, 2].map(|k| &self.list.as_slice()[chosen.points[group][k]]);
        let area = groups.normal(group).dot((b.position - a.position).cross(c.position - a.position)).abs();
        let (_, fourth, gain) = self.most_useful(groups, chosen, 1 << group, Real::MAX).1?;
        let fourth = &self.list.as_slice()[fourth];
        if gain < WORTH_WIDENING * area {
            return None;
        }
        // The first is the deepest, which stays.
        let far = |other: &Candidate| (other.position - fourth.position).length_squared();
        let (place, other) = if far(c) * TIE < far(b) { (2, c) } else { (1, b) };
        if other.normal != fourth.normal {
            return None;
        }
        let position = (other.position + fourth.position) * 0.5;
        Some((place, Candidate { position, separation: (other.separation + fourth.separation) * 0.5, ..*other }))
    }

    /// Gives points with almost the same normal the very same, that of a triangle if there is one among them.
    fn unite_normals(&mut self) {
        let list = self.list.as_mut_slice();
        let first = list[0].normal;
        if list.iter().all(|c| c.normal == first) {
            return;
        }
        self.drop_points_beside_faces();
        let list = self.list.as_mut_slice();
        let mut leaders = [0_u8; CAPACITY];
        let mut count = 0;
        for faces in [true, false] {
            for i in 0..list.len() {
                let candidate = list[i];
                if candidate.is_on_face() != faces {
                    continue;
                }
                let same = |&&leader: &&u8| list[leader as usize].normal.dot(candidate.normal) > SAME_NORMAL;
                if let Some(&leader) = leaders[..count].iter().find(same) {
                    let leader = list[leader as usize];
                    list[i].normal = leader.normal;
                    list[i].facet = leader.facet;
                } else {
                    leaders[count] = i as u8;
                    count += 1;
                }
            }
        }
    }

    /// Drops points at edges and corners, beside a face, of what rolls on that face: they are as deep as the face or less, only
    /// by a hair aside of what bears, where the next moment presses it into them.
    fn drop_points_beside_faces(&mut self) {
        let mut kept = 0;
        for i in 0..self.list.as_slice().len() {
            let list = self.list.as_slice();
            let point = list[i];
            let limit = point.separation + EQUALLY_DEEP * self.tolerance;
            let bears =
                |c: &Candidate| c.is_on_face() && c.separation <= limit && c.normal.dot(point.normal) > SAME_NORMAL;
            if point.facet != ROLLING || !list.iter().any(bears) {
                self.list.as_mut_slice()[kept] = point;
                self.places[kept] = self.places[i];
                kept += 1;
            }
        }
        self.list.truncate(kept);
    }

    /// Groups the points by normal into at most `limit` groups.
    fn group(&self, limit: usize) -> Groups {
        let mut groups = Groups { of: [0; CAPACITY], normals: FixedList::new() };
        for cosine in MERGE {
            groups.normals.truncate(0);
            for (i, candidate) in self.list.as_slice().iter().enumerate() {
                let known = groups.normals.as_slice().iter().position(|n| n.dot(candidate.normal) > cosine);
                let group = known.unwrap_or(groups.count());
                if known.is_none() {
                    groups.normals.push(candidate.normal);
                }
                groups.of[i] = group as u8;
            }
            if groups.count() <= limit {
                break;
            }
        }
        groups
    }

    /// The points of a group, with their places in the list.
    fn members<'a>(&'a self, groups: &'a Groups, group: usize) -> impl Iterator<Item = (usize, &'a Candidate)> {
        let all = self.list.as_slice().iter().enumerate();
        all.filter(move |(i, _)| groups.of[*i] as usize == group)
    }

    /// The deepest point of a group, or the first held one that is about as deep. Of several that are equally deep, an
    /// outermost one: a corner of the contact patch rather than a point inside it (where parts of a floor meet under the
    /// patch), and the same one in every step.
    fn deepest_of(&self, groups: &Groups, group: usize) -> usize {
        let (mut least, mut sum, mut count) = (Real::MAX, Vec3::ZERO, 0.0);
        for (_, candidate) in self.members(groups, group) {
            least = min(least, candidate.separation);
            sum += candidate.position;
            count += 1.0;
        }
        let mut first = (0, NOT_HELD);
        for (i, candidate) in self.members(groups, group) {
            if self.places[i] < first.1 && candidate.separation <= least + HELD_DEPTH * self.tolerance {
                first = (i, self.places[i]);
            }
        }
        if first.1 < NOT_HELD {
            return first.0;
        }
        let middle = sum * (1.0 / count);
        let (t1, t2) = tangents(groups.normal(group));
        let outwards = t1 + t2 * 0.618;
        let mut best = (0, -Real::MAX);
        for (i, candidate) in self.members(groups, group) {
            let away = candidate.position - middle;
            // Of corners that are about as far out, the first one along a fixed direction; deep inside, where nothing slides on,
            // that direction alone decides.
            let along = away.dot(outwards);
            let reach = if least < -DEEP * self.tolerance { along } else { away.length() + PREFERRED * along };
            if candidate.separation <= least + EQUALLY_DEEP * self.tolerance && reach > best.1 {
                best = (i, reach);
            }
        }
        best.0
    }

    /// The point up to `limit` that adds most to its group, and the one whatever its separation, of the groups in the bit
    /// mask.
    fn most_useful(&self, groups: &Groups, chosen: &Chosen, mask: u8, limit: Real) -> (Option<Gain>, Option<Gain>) {
        let (mut near, mut any) = (None, None);
        let mut most = [self.tolerance * self.tolerance; 2];
        let corners = chosen.points.map(|points| points.map(|j| self.list.as_slice()[j].position));
        for (i, candidate) in self.list.as_slice().iter().enumerate() {
            let group = groups.of[i] as usize;
            if mask >> group & 1 == 0 {
                continue;
            }
            let corners = &corners[group][..chosen.counts[group]];
            let mut gain = gain(corners, candidate.position, groups.normal(group), self.tolerance);
            let mut limit = limit;
            if self.is_held(i) {
                (gain, limit) = (HELD_GAIN * gain, HELD_BEARING * limit);
            }
            if gain > most[0] * TIE && candidate.separation <= limit {
                (most[0], near) = (gain, Some((group, i, gain)));
            }
            if gain > most[1] * TIE {
                (most[1], any) = (gain, Some((group, i, gain)));
            }
        }
        (near, any)
    }

    /// Makes room: keeps the deepest point of each group and its extremes along eight directions.
    fn thin_out(&mut self) {
        const DIAGONAL: Real = std::f32::consts::FRAC_1_SQRT_2;
        let groups = self.group(MOST_GROUPS);
        let mut keep = [false; CAPACITY];
        for group in 0..groups.count() {
            let (t1, t2) = tangents(groups.normal(group));
            let (d1, d2) = ((t1 + t2) * DIAGONAL, (t1 - t2) * DIAGONAL);
            keep[self.deepest_of(&groups, group)] = true;
            for direction in [t1, -t1, t2, -t2, d1, -d1, d2, -d2] {
                let mut best = (0, -Real::MAX);
                for (i, candidate) in self.members(&groups, group) {
                    let reach = candidate.position.dot(direction);
                    if reach > best.1 {
                        best = (i, reach);
                    }
                }
                keep[best.0] = true;
            }
        }
        let mut count = 0;
        for (i, _) in keep.iter().enumerate().filter(|(_, kept)| **kept) {
            self.list.as_mut_slice()[count] = self.list.as_slice()[i];
            count += 1;
        }
        self.list.truncate(count);
    }
}

/// Group and index of a point, and what it adds.
type Gain = (usize, usize, Real);

/// The points chosen so far, by group; the first of each is its deepest.
struct Chosen {
    points: [[usize; 4]; 4],
    counts: [usize; 4],
}

impl Chosen {
    fn add(&mut self, group: usize, index: usize) {
        self.points[group][self.counts[group]] = index;
        self.counts[group] += 1;
    }
}

/// What a point adds to those of its group: square of the distance, twice the area of the triangle, twice the area outside
/// it; nothing if it is within a tolerance of a line through two of them: what lies on a line bears with its ends.
fn gain(corners: &[Vec3], point: Vec3, normal: Vec3, tolerance: Real) -> Real {
    let beyond = |p: Vec3, q: Vec3| {
        let (along, area) = (q - p, normal.dot((q - p).cross(point - p)));
        if area * area > tolerance * tolerance * along.length_squared() { area } else { 0.0 }
    };
    match *corners {
        [a] => (point - a).length_squared(),
        [a, b] => beyond(a, b).abs(),
        [a, b, c] => {
            let turn = if normal.dot((b - a).cross(c - a)) < 0.0 { -1.0 } else { 1.0 };
            let outside = |p: Vec3, q: Vec3| -turn * beyond(p, q);
            max(max(outside(a, b), outside(b, c)), outside(c, a))
        }
        _ => 0.0,
    }
}
