//! The passes over the pairs of one block: which have parted, which manifolds still hold, and new ones for the rest.
//!
//! Each pass touches other records, at places that do not follow from one another, so that the machine can fetch those of
//! many pairs at once; what a pass leaves for the next stands in small lists. Pairs of cuboids are gathered and collided `L`
//! at a time.

use super::super::arbiters::surface_velocity;
use super::super::pairs::{Pair, REUSE_ROTATION};
use super::super::shapes::ShapeSlot;
use super::contacts::{PairFrame, Places, WideFrame, turn_levers, update_contacts};
use super::{Begin, CollideContext, News};
use crate::arbiter::{Arbiter, ArbiterKey, ContactData, NONE, TANGENT_VELOCITY_OVERRIDDEN};
use crate::math::{Pose, Real, Rotation, max, min};
use crate::narrow_phase::{CuboidAxes, CuboidLanes, Manifold, NearCuboids, collide};
use crate::parallel::{BlockList, SharedSlice};
use crate::shape::Shape;
use crate::simd::{Kernel, Number, Wide, WidePose, WideRotation, prefetch};
use std::mem::MaybeUninit;

/// Words of the active set in a block.
pub(super) const WORDS_PER_BLOCK: usize = 2;
/// Pairs in a block.
pub(super) const PAIRS_PER_BLOCK: usize = 64 * WORDS_PER_BLOCK;

/// How far ahead of its use a pair is asked for: also those of the next block, which is mostly the same thread's.
const PAIRS_AHEAD: usize = 24;

/// The active pairs of one block and their arbiters.
pub(super) struct BlockPairs<'a> {
    pairs: &'a SharedSlice<'a, Pair>,
    arbiters: &'a SharedSlice<'a, Arbiter>,
    first: usize,
    words: &'a [u64],
}

impl<'a> BlockPairs<'a> {
    /// Block `block`, whose words of the active set are `words`.
    ///
    /// # Safety
    /// No other thread may touch the pairs of this block, or the arbiters that they name, while this lives.
    pub unsafe fn new(
        pairs: &'a SharedSlice<'a, Pair>,
        arbiters: &'a SharedSlice<'a, Arbiter>,
        block: usize,
        words: &'a [u64],
    ) -> Self {
        Self { pairs, arbiters, first: block * PAIRS_PER_BLOCK, words }
    }

    fn pair(&mut self, index: u32) -> &mut Pair {
        // SAFETY: the pairs of the block are this thread's, by the promise of `new`; `&mut self` keeps references apart.
        unsafe { self.pairs.get_mut(index as usize) }
    }

    /// A pair and its arbiter, if it has one.
    fn pair_and_arbiter(&mut self, index: u32) -> (&mut Pair, Option<&mut Arbiter>) {
        // SAFETY: as above.
        let pair = unsafe { self.pairs.get_mut(index as usize) };
        // SAFETY: an arbiter belongs to one pair.
        let arbiter = (pair.arbiter != NONE).then(|| unsafe { self.arbiters.get_mut(pair.arbiter as usize) });
        (pair, arbiter)
    }
}

/// A list with room for the pairs of a block.
///
/// Left blank at first: filling the lists of a block would cost as much as looking at the pairs of one that rests.
struct Queue<T> {
    items: [MaybeUninit<T>; PAIRS_PER_BLOCK],
    count: usize,
}

impl<T: Copy> Queue<T> {
    #[inline(always)]
    fn new() -> Self {
        Self { items: [const { MaybeUninit::uninit() }; PAIRS_PER_BLOCK], count: 0 }
    }

    #[inline(always)]
    fn push(&mut self, item: T) {
        self.items[self.count] = MaybeUninit::new(item);
        self.count += 1;
    }

    #[inline(always)]
    fn items(&self) -> &[T] {
        // SAFETY: `push` has written the first `count`, and `MaybeUninit<T>` lies in memory as `T` does.
        unsafe { std::slice::from_raw_parts(self.items.as_ptr().cast(), self.count) }
    }
}

/// A pair that needs a new manifold.
#[derive(Clone, Copy)]
struct Fresh {
    pair: u32,
    /// Centre frame of body 2 seen from that of body 1.
    between: Pose,
}

/// The work on one block, `L` pairs at a time.
pub(super) struct BlockKernel<'a, const L: usize> {
    pub context: &'a CollideContext<'a>,
    pub pairs: BlockPairs<'a>,
    pub news: BlockList<'a, News>,
    pub begins: BlockList<'a, Begin>,
}

impl<const L: usize> Kernel for BlockKernel<'_, L> {
    #[inline(always)]
    fn run(mut self) {
        let near = self.drop_parted();
        let mut fresh = Queue::new();
        for chunk in near.items().chunks(L) {
            self.keep_manifolds(chunk, &mut fresh);
        }
        let (mut cuboids, mut others) = (Queue::new(), Queue::new());
        for item in fresh.items() {
            if self.is_of_cuboids(item) { cuboids.push(*item) } else { others.push(*item) }
        }
        self.collide_cuboids(cuboids.items());
        for item in others.items() {
            self.collide_anew(item);
        }
    }
}

impl<const L: usize> BlockKernel<'_, L> {
    /// The pairs whose fat boxes still overlap; the others are reported.
    #[inline(always)]
    fn drop_parted(&mut self) -> Queue<u32> {
        let mut near = Queue::new();
        for (word, &bits) in self.pairs.words.iter().enumerate() {
            let mut bits = bits;
            while bits != 0 {
                let index = (self.pairs.first + word * 64) as u32 + bits.trailing_zeros();
                bits &= bits - 1;
                self.pairs.pairs.prefetch(index as usize + PAIRS_AHEAD);
                let pair = self.pairs.pair(index);
                if pair.shapes.iter().any(|&slot| self.context.moved[slot as usize])
                    && !self.context.boxes_overlap(pair)
                {
                    self.news.push(News::Apart(index));
                } else {
                    self.context.prefetch_bodies(pair);
                    near.push(index);
                }
            }
        }
        near
    }

    /// Keeps the manifolds that still hold, or the lack of one, and lists the other pairs.
    #[inline(always)]
    fn keep_manifolds(&mut self, chunk: &[u32], fresh: &mut Queue<Fresh>) {
        let (mut center1, mut center2, mut old) = (WidePose::<L>::ZERO, WidePose::<L>::ZERO, WidePose::<L>::ZERO);
        let mut old_rotation = WideRotation::<L>::ZERO;
        let (mut distance, mut rotation) = (Wide::<L>::ZERO, Wide::<L>::ZERO);
        let mut holds = [false; L];
        for (lane, &index) in chunk.iter().enumerate().take(L) {
            let (context, pair) = (self.context, self.pairs.pair(index));
            let [m1, m2] = pair.bodies.map(|body| &context.solver.masses[body as usize]);
            center1.set(lane, &m1.pose());
            center2.set(lane, &m2.pose());
            old.set(lane, &pair.manifold_pose);
            old_rotation.set(lane, pair.manifold_rotation);
            (distance[lane], rotation[lane]) = pair.reuse_limits(context.settings.speculative_distance);
            holds[lane] = pair.has_manifold
                && (pair.arbiter != NONE
                    || Pair::closes_slowly(context.closing(pair), context.settings.speculative_distance));
        }
        let between = center1.relative(&center2);
        let moved = between.position - old.position;
        let turned = old.rotation.conjugate().mul(&between.rotation).vector();
        let along = old_rotation.conjugate().mul(&center1.rotation).vector();
        let (moved, turned, along) = (moved.dot(&moved), turned.dot(&turned), along.dot(&along));
        let (distance, rotation) = (distance * distance, rotation * rotation);
        for (lane, &index) in chunk.iter().enumerate().take(L) {
            let holds = holds[lane] & (moved[lane] < distance[lane]) & (turned[lane] < rotation[lane]);
            let same_axes = along[lane] < REUSE_ROTATION * REUSE_ROTATION;
            if !holds {
                fresh.push(Fresh { pair: index, between: between.get(lane) });
                self.prefetch_fresh(index);
            }
            let (pair, arbiter) = self.pairs.pair_and_arbiter(index);
            if holds && same_axes && !pair.conveyor {
                continue;
            }
            let Some(arbiter) = arbiter else { continue };
            let rotations = [center1.rotation.get(lane), center2.rotation.get(lane)];
            if pair.conveyor {
                turn_conveyor(pair, self.context.shapes, rotations, &mut arbiter.data);
            }
            if holds && !same_axes {
                pair.manifold_rotation = rotations[0];
                turn_levers(&mut arbiter.data, rotations);
            }
        }
    }

    /// Asks for what the next pass reads of a pair.
    #[inline(always)]
    fn prefetch_fresh(&mut self, index: u32) {
        let (context, arbiters) = (self.context, self.pairs.arbiters);
        let pair = self.pairs.pair(index);
        for side in 0..2 {
            prefetch(&context.shapes[pair.shapes[side] as usize].geometry);
            prefetch(&context.solver.states[pair.bodies[side] as usize]);
        }
        if pair.arbiter != NONE {
            arbiters.prefetch(pair.arbiter as usize);
        }
    }

    /// Makes new manifolds of pairs of cuboids.
    #[inline(always)]
    fn collide_cuboids(&mut self, cuboids: &[Fresh]) {
        let mut near = Queue::new();
        for chunk in cuboids.chunks(L) {
            self.test_axes(chunk, &mut near);
        }
        for chunk in near.items().chunks(L) {
            self.clip_faces(chunk);
        }
    }

    /// Whether the cuboid kernel may take a pair: a filter has to see each manifold by itself.
    #[inline(always)]
    fn is_of_cuboids(&mut self, item: &Fresh) -> bool {
        let (context, pair) = (self.context, self.pairs.pair(item.pair));
        let boxes = pair.shapes.map(|slot| matches!(context.shapes[slot as usize].geometry, Shape::Cuboid(_)));
        boxes[0] & boxes[1] && !pair.sensor && context.filters.contact.is_none()
    }

    #[inline(always)]
    fn gather_cuboids(&mut self, lanes: &mut CuboidLanes<L>, lane: usize, item: &Fresh) {
        let (context, pair) = (self.context, self.pairs.pair(item.pair));
        let [s1, s2] = pair.shapes.map(|slot| &context.shapes[slot as usize]);
        if let (Shape::Cuboid(a), Shape::Cuboid(b)) = (&s1.geometry, &s2.geometry) {
            lanes.set(lane, (a, b), &shapes_relative(&item.between, s1, s2), context.margin(pair));
        }
    }

    /// Settles the pairs that are apart, and lists the others.
    #[inline(always)]
    fn test_axes(&mut self, chunk: &[Fresh], near: &mut Queue<(Fresh, NearCuboids)>) {
        let mut lanes = CuboidLanes::<L>::EMPTY;
        for (lane, item) in chunk.iter().enumerate().take(L) {
            self.gather_cuboids(&mut lanes, lane, item);
        }
        let axes = lanes.test_axes();
        for (lane, item) in chunk.iter().enumerate().take(L) {
            match axes.near(lane) {
                Some(found) => near.push((*item, found)),
                None => self.settle(item, &Places::NONE),
            }
        }
    }

    /// Finds the contacts of pairs that are near.
    #[inline(always)]
    fn clip_faces(&mut self, chunk: &[(Fresh, NearCuboids)]) {
        let (mut lanes, mut axes) = (CuboidLanes::<L>::EMPTY, CuboidAxes::<L>::EMPTY);
        let mut frame = WideFrame::<L>::EMPTY;
        for (lane, (item, found)) in chunk.iter().enumerate().take(L) {
            self.gather_cuboids(&mut lanes, lane, item);
            axes.set(lane, found);
            frame.set(lane, self.pairs.pair(item.pair), self.context.shapes, self.context.solver);
        }
        let manifold = lanes.contacts(&axes, chunk.len());
        let places = frame.places(&manifold);
        for (lane, (item, _)) in chunk.iter().enumerate().take(L) {
            self.settle(item, &places.get(lane, &manifold));
        }
    }

    /// Makes a new manifold.
    #[inline(always)]
    fn collide_anew(&mut self, fresh: &Fresh) {
        let context = self.context;
        let pair = self.pairs.pair(fresh.pair);
        let [s1, s2] = pair.shapes.map(|slot| &context.shapes[slot as usize]);
        let relative = shapes_relative(&fresh.between, s1, s2);
        let mut manifold = Manifold::EMPTY;
        collide(&s1.geometry, &s2.geometry, &relative, context.margin(pair), &mut pair.cache, &mut manifold);
        if !context.filters.passes_contact(pair, (context.shapes, context.bodies), &mut manifold) {
            manifold.clear();
        }
        if pair.sensor {
            let overlaps = !manifold.points().is_empty();
            if overlaps != pair.overlapping {
                self.news.push(News::Sensor(fresh.pair, overlaps));
            }
            return;
        }
        let places = Places::of_manifold(&manifold, &PairFrame::new(pair, context.shapes, context.solver));
        self.settle(fresh, &places);
    }

    /// Gives a new manifold to the arbiter, or begins one.
    #[inline(always)]
    fn settle(&mut self, item: &Fresh, places: &Places) {
        let context = self.context;
        let (pair, arbiter) = self.pairs.pair_and_arbiter(item.pair);
        context.note_fresh(pair, item, arbiter.is_some() || places.count == 0);
        if let Some(arbiter) = arbiter {
            let rotations = context.rotations(pair);
            update_contacts(&mut arbiter.data, places, rotations, context.settings.contact_break_distance);
            if places.count == 0 {
                self.news.push(News::Empty(pair.arbiter));
            }
        } else if context.begins(pair, places) {
            let [id1, id2] = pair.shapes.map(|slot| context.shapes[slot as usize].id);
            self.begins.push(Begin { key: ArbiterKey::of_shapes(id1, id2), pair: item.pair, places: *places });
        }
    }
}

/// Shape 2 seen from shape 1, given their bodies' centre frames.
#[inline(always)]
pub(super) fn shapes_relative(between: &Pose, s1: &ShapeSlot, s2: &ShapeSlot) -> Pose {
    match s1.centered & s2.centered {
        true => *between,
        false => s1.from_center.relative(&between.mul(&s2.from_center)),
    }
}

/// Surface velocities turn with their bodies.
fn turn_conveyor(pair: &Pair, shapes: &[ShapeSlot], rotations: [Rotation; 2], data: &mut ContactData) {
    if data.flags & TANGENT_VELOCITY_OVERRIDDEN == 0 {
        let materials = pair.shapes.map(|slot| &shapes[slot as usize].material);
        data.tangent_velocity = surface_velocity(materials, rotations);
    }
}

impl CollideContext<'_> {
    fn boxes_overlap(&self, pair: &Pair) -> bool {
        let [a, b] = pair.shapes.map(|slot| self.broad_phase.fat_aabb(slot));
        matches!((a, b), (Some(a), Some(b)) if a.overlaps(b))
    }

    /// Asks for what tells whether the manifold of a pair still holds.
    #[inline(always)]
    fn prefetch_bodies(&self, pair: &Pair) {
        for body in pair.bodies {
            prefetch(&self.solver.masses[body as usize]);
            if pair.arbiter == NONE {
                prefetch(&self.solver.states[body as usize]);
            }
        }
    }

    /// Length of the way that the centres make against each other in a step.
    #[inline(always)]
    fn closing(&self, pair: &Pair) -> Real {
        let [v1, v2] = pair.bodies.map(|body| self.solver.states[body as usize].linear_velocity);
        (v2 - v1).length() * self.dt
    }

    /// Gap up to which contacts count: the speculative distance, more for pairs that move fast against each other, but not
    /// more than the smaller shape. Sensors have to overlap.
    ///
    /// Against what stands still, continuous collision does the looking ahead. Contacts that are far apart would be hit one
    /// after the other, substep by substep, and a long body that hits so is thrown up by blows none of which bounces
    /// (measured: falling trunks of 25 m, by 1.4 m).
    #[inline(always)]
    fn margin(&self, pair: &Pair) -> Real {
        if pair.sensor {
            return 0.0;
        }
        if pair.bodies.iter().any(|&body| self.solver.states[body as usize].is_fixed()) {
            return self.settings.speculative_distance;
        }
        max(self.settings.speculative_distance, min(self.closing(pair), pair.size))
    }

    /// Notes how the bodies stand for which a manifold was made.
    #[inline(always)]
    fn note_fresh(&self, pair: &mut Pair, fresh: &Fresh, reusable: bool) {
        pair.has_manifold = reusable && self.filters.contact.is_none();
        pair.manifold_pose = fresh.between;
        pair.manifold_rotation = self.solver.masses[pair.bodies[0] as usize].rotation;
    }

    /// How both bodies are turned.
    #[inline(always)]
    fn rotations(&self, pair: &Pair) -> [Rotation; 2] {
        pair.bodies.map(|body| self.solver.masses[body as usize].rotation)
    }

    /// Whether a pair without arbiter touches, or closes fast enough to touch within this step.
    fn begins(&self, pair: &Pair, places: &Places) -> bool {
        let [(v1, a1), (v2, a2)] =
            pair.bodies.map(|body| (&self.solver.states[body as usize], &self.solver.motions[body as usize]));
        let [rotation1, rotation2] = self.rotations(pair);
        places.points[..places.count].iter().any(|point| {
            if point.separation <= 0.0 {
                return true;
            }
            let velocity1 = v1.linear_velocity + v1.angular_velocity.cross(rotation1.rotate(point.anchor1));
            let velocity2 = v2.linear_velocity + v2.angular_velocity.cross(rotation2.rotate(point.anchor2));
            let speed =
                point.normal.dot(velocity2 - velocity1) + point.normal.dot(a2.acceleration - a1.acceleration) * self.dt;
            point.separation + speed * self.dt <= 0.0
        })
    }
}
