//! Broad-phase pairs: two shapes whose fat boxes overlap, from when they come near until they part.
//!
//! A pair remembers what the narrow phase may use again: its arbiter, the last separating feature, and the relative pose at
//! the last full manifold. Those with an awake body stand in `active_pairs`, listed in the order of their places: the narrow
//! phase walks them through memory in one direction, whatever has come and gone.
//!
//! New pairs are made together: all threads write their records, beside which one enters them in the set of pairs; then they
//! are hung on the lists of their bodies.

use super::World;
use super::bodies::Body;
use super::definition::BodyKind;
use super::shapes::ShapeSlot;
use crate::arbiter::{EndReason, NONE};
use crate::math::{Pose, Real, Rotation, Vec3, max, min};
use crate::narrow_phase::PairCache;
use crate::parallel::SharedSlice;
use crate::shape::Shape;
use crate::simd::{prefetch, quad_view};
use crate::solver::BodyState;
use crate::storage;
use std::mem::MaybeUninit;

/// What the world keeps of a pair. Shape 1 has the smaller id.
#[derive(Clone, Debug)]
#[repr(C, align(64))] // what tells whether the manifold still holds fills the first cache line
pub(crate) struct Pair {
    /// Centre frame of body 2 seen from that of body 1 when the manifold was made.
    pub manifold_pose: Pose,
    /// How body 1 was turned when the manifold's normal and levers were put into world axes.
    pub manifold_rotation: Rotation,
    pub bodies: [u32; 2],
    /// `NONE` while the shapes do not touch.
    pub arbiter: u32,
    pub alive: bool,
    /// Whether a body of the two is awake.
    pub active: bool,
    pub sensor: bool,
    /// Whether a surface of the two moves along itself: its direction turns with its body.
    pub conveyor: bool,
    /// For sensors: whether the shapes overlap.
    pub overlapping: bool,
    /// Whether `manifold_pose` holds: cleared by teleports and edits.
    pub has_manifold: bool,
    /// What the shapes ask for beyond contacts: [`WATCHED`], [`ONE_WAY`], [`PASSING`]; and [`BORNE`].
    pub traits: u8,
    pub shapes: [u32; 2],
    /// Middle of the smaller shape when the manifold was made, from the centre of body 2 in the axes of body 1.
    ///
    /// How far the pair has moved is measured there: a long body that rolls or turns elsewhere does not count.
    manifold_middle: Vec3,
    /// Inner radius of the smaller shape, metres.
    pub size: Real,
    /// How far a pair without contact may turn (sine of half the angle) until its shapes are looked at again.
    apart_rotation: Real,
    /// How far a pair with contacts may move until then, metres.
    touch_distance: Real,
    /// How far it may turn until then (sine of half the angle): when both bodies can be pushed, and when only one can.
    touch_rotation: [Real; 2],
    pub cache: PairCache,
    /// Which materials of their palettes the two shapes touch with.
    pub materials: [u8; 2],
    /// Those of contacts that are of others: equal to `materials` where there are none.
    pub other_materials: [u8; 2],
}

/// Traits that are those of [`super::definition::ContactEvents`].
pub(crate) const WATCHED: u8 = 7;
/// Listeners want the arbiter before each solve: its manifold is made anew in each step.
pub(crate) const PRE_SOLVE: u8 = 1;
/// An event in each step in which the arbiter goes on.
pub(crate) const PERSIST: u8 = 2;
/// An event for each hit.
pub(crate) const HITS: u8 = 4;
/// One of the shapes lets bodies pass one way.
pub(crate) const ONE_WAY: u8 = 8;
/// The shapes are passing through each other: no contact until they are out again.
pub(crate) const PASSING: u8 = 16;
/// Only one body of the two can be pushed: the first or the second. Never of a pair of a sensor.
pub(crate) const BORNE: [u8; 2] = [32, 64];

/// How many pairs ahead of its end what a pair touches is asked for.
const PARTED_AHEAD: usize = 4;
/// The same for pairs that are made.
const FOUND_AHEAD: usize = 6;
/// New pairs that a thread makes at a time.
const NEW_PER_BLOCK: usize = 16;

/// How far a pair may move, in shares of the smaller shape's inner radius, before its manifold is made anew.
const REUSE_TRANSLATION: Real = 0.02;
/// The same for pairs of cuboids, whose manifolds cost little: their corners sink in less where they slide on.
const REUSE_CUBOIDS: Real = 0.01;
/// How far a pair may turn (sine of half the angle) before its manifold is made anew: 1.4°.
pub(super) const REUSE_ROTATION: Real = 0.0125;
/// The same for curved shapes on what cannot be pushed. Four points hold a disc only where its rim is lowest, and are those of
/// how it leant when the manifold was made: a can tipped at 27° instead of 31°. And a point that trails behind what rocks
/// pushes it on: an ellipsoid in a hollow never came to rest.
const REUSE_CURVED: Real = 3e-5;
/// The same for long shapes, in shares of the smaller shape's inner radius over its reach.
const REUSE_REACH: Real = 0.08;

impl Pair {
    quad_view! {
        /// Rotation and position of `manifold_pose`, then `manifold_rotation`; the twelfth number means nothing.
        pub fn quads;
        [3] of (manifold_pose, manifold_rotation, bodies)
    }

    quad_view! {
        /// The middle of the smaller shape and [`Pair::size`].
        pub fn middle_quad;
        [1] of (manifold_middle, size)
    }

    /// Notes how the bodies stand for which a manifold is made: `between` is the centre frame of body 2 seen from that of
    /// body 1, `rotation` how body 1 is turned.
    pub fn note_manifold(&mut self, between: &Pose, rotation: Rotation, shapes: [&ShapeSlot; 2]) {
        (self.manifold_pose, self.manifold_rotation) = (*between, rotation);
        self.manifold_middle = if shapes[0].reach < shapes[1].reach {
            shapes[0].middle - between.position
        } else {
            between.rotation.rotate(shapes[1].middle)
        };
    }

    /// How far (metres, sine of half the angle) the bodies may move against each other before their shapes are looked at
    /// again.
    ///
    /// Where they touch, relative to the size of the smaller shape, so that small bodies are treated as large ones are.
    /// Where they were more than a speculative distance apart, half of that is left for moving and turning, half for
    /// closing: see [`Pair::closes_slowly`].
    #[inline(always)]
    pub fn reuse_limits(&self, speculative_distance: Real) -> (Real, Real) {
        if self.arbiter == NONE {
            (0.25 * speculative_distance, self.apart_rotation)
        } else {
            let borne = self.traits & (BORNE[0] | BORNE[1]) != 0;
            (self.touch_distance, self.touch_rotation[usize::from(borne)])
        }
    }

    /// Whether shapes that were more than a speculative distance apart, and now close by `closing` in a step, are still too
    /// far apart to touch within it.
    #[inline(always)]
    pub fn closes_slowly(closing: Real, speculative_distance: Real) -> bool {
        closing < 2.0 * (0.25 * speculative_distance)
    }

    /// The body that can be pushed, if the other one cannot.
    #[inline(always)]
    pub fn borne(&self) -> Option<u32> {
        match self.traits & (BORNE[0] | BORNE[1]) {
            0 => None,
            side => Some(self.bodies[usize::from(side != BORNE[0])]),
        }
    }

    /// Notes which bodies can be pushed.
    fn note_borne(&mut self, moves: [bool; 2]) {
        let borne = match moves {
            [true, false] if !self.sensor => BORNE[0],
            [false, true] if !self.sensor => BORNE[1],
            _ => 0,
        };
        self.traits = self.traits & !(BORNE[0] | BORNE[1]) | borne;
    }

    /// What two shapes ask for.
    pub fn traits_of(shapes: [&ShapeSlot; 2]) -> u8 {
        let one_way = shapes[0].one_way.is_some() || shapes[1].one_way.is_some();
        shapes[0].events.0 | shapes[1].events.0 | if one_way { ONE_WAY } else { 0 }
    }

    pub fn has_shape(&self, slot: u32) -> bool {
        self.shapes[0] == slot || self.shapes[1] == slot
    }
}

/// A set of places as bits, so that they can be visited in the order in which they lie in memory.
#[derive(Clone, Debug, Default)]
pub(crate) struct PlaceSet {
    words: Vec<u64>,
    count: usize,
}

impl PlaceSet {
    /// Adds a place, which may be there already.
    pub fn insert(&mut self, place: u32) {
        let (word, bit) = (place as usize / 64, 1 << (place % 64));
        if self.words.len() <= word {
            self.words.resize(word + 1, 0);
        }
        self.count += usize::from(self.words[word] & bit == 0);
        self.words[word] |= bit;
    }

    /// Removes a place, which may be missing.
    pub fn remove(&mut self, place: u32) {
        let bit = 1 << (place % 64);
        if let Some(word) = self.words.get_mut(place as usize / 64) {
            self.count -= usize::from(*word & bit != 0);
            *word &= !bit;
        }
    }

    /// How many places are in the set.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Bit `i % 64` of word `i / 64` is place `i`.
    pub fn words(&self) -> &[u64] {
        &self.words
    }
}

impl World {
    /// Whether two shapes may have a pair at all.
    pub(crate) fn may_pair(&self, a: u32, b: u32) -> bool {
        PairRules { shapes: &self.shapes, bodies: &self.bodies }.may_pair(a, b)
    }
}

/// What decides whether two shapes may have a pair.
pub(crate) struct PairRules<'a> {
    pub shapes: &'a [ShapeSlot],
    pub bodies: &'a [Body],
}

impl PairRules<'_> {
    pub fn may_pair(&self, a: u32, b: u32) -> bool {
        let (shape_a, shape_b) = (&self.shapes[a as usize], &self.shapes[b as usize]);
        if shape_a.body == shape_b.body || !shape_a.filter.accepts(&shape_b.filter) {
            return false;
        }
        let (kind_a, kind_b) = (self.bodies[shape_a.body as usize].kind, self.bodies[shape_b.body as usize].kind);
        let dynamic = kind_a == BodyKind::Dynamic || kind_b == BodyKind::Dynamic;
        match (shape_a.sensor, shape_b.sensor) {
            (true, true) => false,
            (false, false) => dynamic,
            _ => true,
        }
    }
}

/// What is told of a new pair.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tie {
    bodies: [u32; 2],
    active: bool,
    /// The body that alone can be pushed, or `NONE`.
    borne: u32,
}

impl Tie {
    const NONE: Self = Self { bodies: [0; 2], active: false, borne: NONE };
}

/// What a new pair is made of.
struct PairMaker<'a> {
    shapes: &'a [ShapeSlot],
    bodies: &'a [Body],
    states: &'a [BodyState],
    speculative_distance: Real,
}

impl PairMaker<'_> {
    fn make(&self, (a, b): (u32, u32)) -> Pair {
        let smaller_first = self.shapes[a as usize].id < self.shapes[b as usize].id;
        let shapes = if smaller_first { [a, b] } else { [b, a] };
        let slots = shapes.map(|slot| &self.shapes[slot as usize]);
        let bodies = slots.map(|shape| shape.body);
        let size = match slots.map(|shape| shape.geometry.inner_radius()) {
            [a, b] if a > 0.0 && b > 0.0 => min(a, b),
            [a, b] => max(a, b), // a mesh has no inside
        };
        let cuboids = slots.iter().all(|shape| matches!(shape.geometry, Shape::Cuboid(_)));
        let curved = slots.iter().any(|shape| shape.geometry.is_curved());
        let turns = if curved { REUSE_CURVED } else { REUSE_ROTATION };
        let reach = min(slots[0].reach, slots[1].reach);
        let mut pair = Pair {
            shapes,
            bodies,
            arbiter: NONE,
            alive: true,
            active: bodies.iter().any(|&body| self.bodies[body as usize].awake),
            sensor: slots.iter().any(|shape| shape.sensor),
            conveyor: slots.iter().any(|shape| shape.material.turns()),
            overlapping: false,
            has_manifold: false,
            traits: Pair::traits_of(slots),
            manifold_pose: Pose::IDENTITY,
            manifold_rotation: Rotation::IDENTITY,
            manifold_middle: Vec3::ZERO,
            size,
            touch_distance: size * if cuboids { REUSE_CUBOIDS } else { REUSE_TRANSLATION },
            apart_rotation: self.speculative_distance / (8.0 * reach),
            // The end of a long shape moves farther than its own thickness by turning.
            touch_rotation: [REUSE_ROTATION, turns].map(|turns| min(turns, REUSE_REACH * size / reach)),
            cache: PairCache::default(),
            materials: [0; 2],
            other_materials: [0; 2],
        };
        pair.note_borne(bodies.map(|body| self.states[body as usize].moves != 0));
        pair
    }

    /// Asks for what the pair of two shapes is made of, their bodies once the shapes are there.
    fn prefetch(&self, found: &[(u32, u32)], at: usize) {
        if let Some(&(a, b)) = found.get(at + 2 * FOUND_AHEAD) {
            [a, b].into_iter().for_each(|slot| prefetch(&self.shapes[slot as usize]));
        }
        if let Some(&(a, b)) = found.get(at + FOUND_AHEAD) {
            for slot in [a, b] {
                prefetch(&self.bodies[self.shapes[slot as usize].body as usize].awake);
            }
        }
    }
}

impl World {
    /// Makes pairs of shapes that have none yet.
    pub(crate) fn add_pairs(&mut self, found: &[(u32, u32)]) {
        if found.is_empty() {
            return;
        }
        let (old, reused) = (self.pairs.len(), self.free_pairs.len().min(found.len()));
        let count = old + found.len() - reused;
        storage::reserve(&mut self.pairs, count);
        self.pair_set.reserve(found.len());
        let mut ties = std::mem::take(&mut self.tie_scratch);
        ties.clear();
        ties.resize(found.len(), Tie::NONE);
        let free = &self.free_pairs[..];
        let place_of = |nth: usize| if nth < reused { free[free.len() - 1 - nth] } else { (old + nth - reused) as u32 };
        let maker = PairMaker {
            shapes: &self.shapes,
            bodies: &self.bodies,
            states: &self.solver_bodies.states,
            speculative_distance: self.scaled.speculative_distance,
        };
        // SAFETY: there is room for so many; what is not a pair yet is only written.
        let places =
            unsafe { std::slice::from_raw_parts_mut(self.pairs.as_mut_ptr().cast::<MaybeUninit<Pair>>(), count) };
        let (places, told, set) = (SharedSlice::new(places), SharedSlice::new(&mut ties), &mut self.pair_set);
        let make = |block: usize| {
            let first = block * NEW_PER_BLOCK;
            for (nth, &pair) in found.iter().enumerate().skip(first).take(NEW_PER_BLOCK) {
                maker.prefetch(found, nth);
                let pair = maker.make(pair);
                // SAFETY: each has a place of its own, and belongs to one block.
                unsafe {
                    let borne = pair.borne().unwrap_or(NONE);
                    *told.get_mut(nth) = Tie { bodies: pair.bodies, active: pair.active, borne };
                    places.get_mut(place_of(nth) as usize).write(pair);
                }
            }
        };
        self.pool.run_beside(found.len().div_ceil(NEW_PER_BLOCK), make, || {
            for (nth, &(a, b)) in found.iter().enumerate() {
                if let Some(&(a, b)) = found.get(nth + FOUND_AHEAD) {
                    set.prefetch(a, b);
                }
                set.insert(a, b, place_of(nth));
            }
        });
        // SAFETY: old pairs keep their places, and each new place has been written.
        unsafe { self.pairs.set_len(count) };
        self.pair_lists.grow(count, self.bodies.len());
        self.bearings.resize(self.bodies.len());
        for (nth, &Tie { bodies, active, borne }) in ties.iter().enumerate() {
            let place = place_of(nth);
            self.pair_lists.link(place, bodies);
            if borne != NONE {
                self.bearings.add(borne);
            }
            if active {
                self.active_pairs.insert(place);
            } else if self.pairs[place as usize].sensor {
                storage::push(&mut self.resting_sensors, place);
            }
        }
        self.free_pairs.truncate(self.free_pairs.len() - reused);
        self.tie_scratch = ties;
    }

    /// Ends a pair: its arbiter ends for `reason`, a sensor's overlap ends too.
    pub(crate) fn remove_pair(&mut self, index: u32, reason: EndReason) {
        for slot in self.pairs[index as usize].shapes {
            self.broad_phase.forget(slot);
        }
        self.drop_pair(index, reason);
    }

    /// Ends pairs whose fat boxes did not overlap any more in this step's search: the broad phase knows.
    pub(crate) fn part_pairs(&mut self, list: &[u32]) {
        for (at, &index) in list.iter().enumerate() {
            if let Some(&later) = list.get(at + 2 * PARTED_AHEAD) {
                prefetch(&self.pairs[later as usize].shapes);
                self.pair_lists.prefetch(later);
            }
            if let Some(&later) = list.get(at + PARTED_AHEAD) {
                let pair = &self.pairs[later as usize];
                self.pair_set.prefetch(pair.shapes[0], pair.shapes[1]);
            }
            self.drop_pair(index, EndReason::Separated);
        }
    }

    fn drop_pair(&mut self, index: u32, reason: EndReason) {
        let pair = &self.pairs[index as usize];
        let (shapes, bodies, arbiter, overlapping) = (pair.shapes, pair.bodies, pair.arbiter, pair.overlapping);
        let borne = pair.borne();
        if let Some(body) = borne {
            self.bearings.remove(body);
        }
        if arbiter != NONE {
            self.end_arbiter(arbiter, reason);
        }
        if overlapping {
            self.set_sensor_overlap(index, false);
        }
        self.deactivate_pair(index);
        self.pair_lists.unlink(index, bodies);
        self.pair_set.remove(shapes[0], shapes[1]);
        self.pairs[index as usize].alive = false;
        self.free_pairs.push(index);
        if let Some(body) = borne.filter(|_| arbiter != NONE) {
            // Contacts that this one made needless are looked for again.
            for other in self.pair_lists.of_body(body) {
                self.pairs[other as usize].has_manifold = false;
            }
        }
    }

    /// The pairs of a body.
    pub(crate) fn pairs_of_body(&self, body: u32) -> impl Iterator<Item = u32> + '_ {
        self.pair_lists.of_body(body)
    }

    pub(crate) fn activate_pair(&mut self, index: u32) {
        let pair = &mut self.pairs[index as usize];
        if !std::mem::replace(&mut pair.active, true) && pair.traits & WATCHED != 0 {
            // Woken in the middle of a step: the narrow phase may have gone by.
            let goes_on = pair.arbiter != NONE;
            self.events.watch(index, goes_on);
        }
        self.active_pairs.insert(index);
    }

    /// What the shapes of a pair ask for has changed.
    pub(crate) fn refresh_traits(&mut self, slot: u32) {
        let body = self.shapes[slot as usize].body;
        let pairs: Vec<u32> =
            self.pairs_of_body(body).filter(|&pair| self.pairs[pair as usize].has_shape(slot)).collect();
        for index in pairs {
            let pair = &mut self.pairs[index as usize];
            let borne = pair.traits & (BORNE[0] | BORNE[1]);
            pair.traits = Pair::traits_of(pair.shapes.map(|slot| &self.shapes[slot as usize])) | borne;
            pair.has_manifold = false;
        }
    }

    /// Whether a body with pairs can be pushed has changed.
    pub(crate) fn refresh_bearings(&mut self, body: u32) {
        for index in self.pair_lists.of_body(body) {
            let pair = &mut self.pairs[index as usize];
            if let Some(body) = pair.borne() {
                self.bearings.remove(body);
            }
            pair.note_borne(pair.bodies.map(|body| self.solver_bodies.states[body as usize].moves != 0));
            if let Some(body) = pair.borne() {
                self.bearings.add(body);
            }
        }
    }

    pub(crate) fn deactivate_pair(&mut self, index: u32) {
        if std::mem::take(&mut self.pairs[index as usize].active) {
            self.active_pairs.remove(index);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::PlaceSet;
    use crate::random::Random;
    use std::collections::BTreeSet;

    /// 2,000 random edits over 300 places: bits and count are those of a sorted set, however often a place comes and goes.
    #[test]
    fn places_are_those_of_a_set_whatever_came_and_went() {
        let (mut set, mut model) = (PlaceSet::default(), BTreeSet::new());
        let mut random = Random(3);
        for edit in 0..2_000 {
            let place = random.below(300);
            if model.remove(&place) {
                set.remove(place);
            } else {
                model.insert(place);
                set.insert(place);
            }
            if edit % 7 == 0 {
                let bit =
                    |place: &u32| set.words().get(*place as usize / 64).is_some_and(|w| w >> (place % 64) & 1 == 1);
                assert!((0..300).filter(bit).eq(model.iter().copied()));
                assert_eq!(set.len(), model.len());
            }
        }
    }
}
