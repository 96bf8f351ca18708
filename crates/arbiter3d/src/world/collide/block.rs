//! The passes over the pairs of one block: which have parted, which manifolds still hold, and new ones for the rest.
//!
//! Each pass touches other records, at places that do not follow from one another, so that the machine can fetch those of
//! many pairs at once; what a pass leaves for the next stands in small lists. Pairs of cuboids are gathered and collided `L`
//! at a time.

use super::super::arbiters::{mix_shape_materials, surface_velocity, turn_anisotropy};
use super::super::one_way::{self, Approach, Verdict};
use super::super::pairs::{PRE_SOLVE, Pair, REUSE_ROTATION, WATCHED};
use super::super::shapes::ShapeSlot;
use super::contacts::{FrameRecords, PairFrame, Place, Places, WideFrame, turn_levers, update_contacts};
use super::{Begin, CollideContext, News};
use crate::arbiter::{Arbiter, ArbiterKey, ContactData, NONE, TANGENT_VELOCITY_OVERRIDDEN};
use crate::math::{Pose, Real, Rotation, Vec3, max, min};
use crate::narrow_phase::{
    CuboidLanes, CuboidPair, Manifold, ManifoldPoint, NearCuboids, WideManifold, collide_on, keeps_points,
};
use crate::parallel::{BlockList, SharedSlice};
use crate::shape::Shape;
use crate::simd::{Kernel, LanePose, LaneRotation, LaneVec3, Lanes, prefetch};
use crate::solver::BodyMass;
use crate::storage::FixedList;
use std::marker::PhantomData;

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

    fn shared(&self, index: u32) -> &Pair {
        // SAFETY: as above, and `&self` lets nobody change the pairs meanwhile.
        unsafe { self.pairs.get(index as usize) }
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

/// A bullet that moves farther in a step than this share of its inner radius is left to its flight: a little more than
/// what makes a body fast, since contacts may slow it down until then.
const FLIGHT: Real = 0.6;

/// A list with room for the pairs of a block.
type Queue<T> = FixedList<T, PAIRS_PER_BLOCK>;

/// A pair that needs a new manifold.
#[derive(Clone, Copy)]
struct Fresh {
    pair: u32,
    /// Centre frame of body 2 seen from that of body 1.
    between: Pose,
}

/// A pair of cuboids that are not apart, and what their axes have told.
#[derive(Clone, Copy)]
struct NearPair {
    item: Fresh,
    cuboids: CuboidPair,
    found: NearCuboids,
}

/// Which manifolds still hold; a bit for each pair.
struct ReuseTest<W> {
    /// Centre frames of bodies 2 seen from those of bodies 1.
    between: LanePose<W>,
    kept: u32,
    /// Body 1 is still turned as when the normal was put into world axes.
    same_axes: u32,
    conveyors: u32,
}

/// Stands in for bodies of pairs that a group lacks.
static NO_MASS: BodyMass = BodyMass::NONE;

/// The work on one block, `L` pairs at a time.
pub(super) struct BlockKernel<'a, W, const L: usize> {
    pub context: &'a CollideContext<'a>,
    pub pairs: BlockPairs<'a>,
    pub news: BlockList<'a, News>,
    pub begins: BlockList<'a, Begin>,
    pub lanes: PhantomData<W>,
}

impl<W: Lanes<L>, const L: usize> Kernel for BlockKernel<'_, W, L> {
    #[inline(always)]
    fn run(mut self) {
        let near = self.drop_parted();
        let mut fresh = Queue::new();
        for chunk in near.as_slice().chunks(L) {
            self.keep_manifolds(chunk, &mut fresh);
        }
        let (mut cuboids, mut others) = (Queue::new(), Queue::new());
        for item in fresh.as_slice() {
            if self.is_of_cuboids(item) { cuboids.push(*item) } else { others.push(*item) }
        }
        self.collide_cuboids(cuboids.as_slice());
        for item in others.as_slice() {
            self.collide_anew(item);
        }
    }
}

impl<W: Lanes<L>, const L: usize> BlockKernel<'_, W, L> {
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
                    if pair.traits & WATCHED != 0 {
                        self.news.push(News::Watched(index, pair.arbiter != NONE));
                    }
                    near.push(index);
                }
            }
        }
        near
    }

    /// Keeps the manifolds that still hold, or the lack of one, and lists the other pairs.
    #[inline(always)]
    fn keep_manifolds(&mut self, chunk: &[u32], fresh: &mut Queue<Fresh>) {
        let ReuseTest { between, kept, same_axes, conveyors } = self.test_reuse(chunk);
        let mut busy = !(kept & same_axes & !conveyors) & (u32::MAX >> (u32::BITS - chunk.len() as u32));
        if busy == 0 {
            return;
        }
        let (position, q) = (&between.position, &between.rotation);
        let positions = W::store(&[position.x, position.y, position.z, W::ZERO]);
        let rotations = W::store(&[q.vector.x, q.vector.y, q.vector.z, q.w]);
        while busy != 0 {
            let lane = busy.trailing_zeros() as usize;
            busy &= busy - 1;
            let (index, holds) = (chunk[lane], kept >> lane & 1 == 1);
            if !holds {
                let ([px, py, pz, _], [x, y, z, w]) = (positions[lane], rotations[lane]);
                let between = Pose::new(Vec3::new(px, py, pz), Rotation::from_xyzw(x, y, z, w));
                fresh.push(Fresh { pair: index, between });
                self.prefetch_fresh(index);
            }
            self.turn_along(index, holds && same_axes >> lane & 1 == 0);
        }
    }

    /// Whether the manifolds of up to `L` pairs still hold.
    #[inline(always)]
    fn test_reuse(&self, chunk: &[u32]) -> ReuseTest<W> {
        let (context, none) = (self.context, NO_MASS.quads());
        let (mut masses1, mut masses2) = ([none; L], [none; L]);
        let (mut old, mut middles) = ([&[[0.0; 4]; 3]; L], [&[[0.0; 4]]; L]);
        let (mut distance, mut rotation) = ([0.0; L], [0.0; L]);
        let (mut keepable, mut conveyors) = (0, 0);
        for (lane, &index) in chunk.iter().enumerate().take(L) {
            let pair = self.pairs.shared(index);
            masses1[lane] = context.solver.masses[pair.bodies[0] as usize].quads();
            masses2[lane] = context.solver.masses[pair.bodies[1] as usize].quads();
            (old[lane], middles[lane]) = (pair.quads(), pair.middle_quad());
            (distance[lane], rotation[lane]) = pair.reuse_limits(context.settings.speculative_distance);
            let holds = pair.has_manifold
                && (pair.arbiter != NONE
                    || Pair::closes_slowly(context.closing(pair), context.settings.speculative_distance));
            keepable |= u32::from(holds) << lane;
            conveyors |= u32::from(pair.conveyor) << lane;
        }
        let center1 = LanePose::<W>::load(&masses1);
        let between = center1.relative(&LanePose::load(&masses2));
        let [qx, qy, qz, qw] = W::load_quad(&old, 0);
        let [px, py, pz, rx] = W::load_quad(&old, 1);
        let [ry, rz, rw, _] = W::load_quad(&old, 2);
        let old_between = LaneRotation { vector: LaneVec3 { x: qx, y: qy, z: qz }, w: qw };
        let old_rotation = LaneRotation { vector: LaneVec3 { x: rx, y: ry, z: rz }, w: rw };
        let [mx, my, mz, _] = W::load_quad(&middles, 0);
        let turned = between.rotation.mul(&old_between.conjugate()).vector;
        let swung = turned.cross(&LaneVec3 { x: mx, y: my, z: mz });
        let moved = between.position - LaneVec3 { x: px, y: py, z: pz } + (swung + swung);
        let along = old_rotation.conjugate().mul(&center1.rotation).vector;
        let (distance, rotation) = (W::from_array(distance), W::from_array(rotation));
        let (distance, rotation, one) = (distance * distance, rotation * rotation, W::splat(1.0));
        let still = rotation.if_above(turned.dot(&turned), one, W::ZERO);
        let still = distance.if_above(moved.dot(&moved), still, W::ZERO);
        let same_axes = W::splat(REUSE_ROTATION * REUSE_ROTATION).if_above(along.dot(&along), one, W::ZERO);
        ReuseTest { between, kept: keepable & still.positive(), same_axes: same_axes.positive(), conveyors }
    }

    /// Turns what has to turn with its bodies, of pairs with arbiters.
    #[inline(always)]
    fn turn_along(&mut self, index: u32, turns_levers: bool) {
        let context = self.context;
        let (pair, arbiter) = self.pairs.pair_and_arbiter(index);
        let Some(arbiter) = arbiter else { return };
        if !pair.conveyor && !turns_levers {
            return;
        }
        let rotations = pair.bodies.map(|body| context.solver.masses[body as usize].rotation);
        if pair.conveyor {
            turn_conveyor(pair, context.shapes, rotations, &mut arbiter.data);
        }
        if turns_levers {
            pair.manifold_rotation = rotations[0];
            turn_levers(&mut arbiter.data, rotations);
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
        let (mut manifold, mut places) = (WideManifold::EMPTY, [Places::NONE; L]);
        for chunk in near.as_slice().chunks(L) {
            self.clip_faces(chunk, &mut manifold, &mut places);
        }
    }

    /// Whether the cuboid kernel may take a pair: a filter has to see each manifold by itself.
    #[inline(always)]
    fn is_of_cuboids(&mut self, item: &Fresh) -> bool {
        let (context, pair) = (self.context, self.pairs.pair(item.pair));
        let boxes = pair.shapes.map(|slot| matches!(context.shapes[slot as usize].geometry, Shape::Cuboid(_)));
        boxes[0] & boxes[1] && !pair.sensor && context.filters.contact.is_none()
    }

    /// A pair as the cuboid kernel sees it.
    #[inline(always)]
    fn cuboid_pair(&self, item: &Fresh) -> CuboidPair {
        let (context, pair) = (self.context, self.pairs.shared(item.pair));
        let [s1, s2] = pair.shapes.map(|slot| &context.shapes[slot as usize]);
        match (&s1.geometry, &s2.geometry) {
            (Shape::Cuboid(a), Shape::Cuboid(b)) => {
                CuboidPair::new((a, b), &shapes_relative(&item.between, s1, s2), context.margin(pair))
            }
            _ => CuboidPair::NONE,
        }
    }

    /// Settles the pairs that are apart, and lists the others.
    #[inline(always)]
    fn test_axes(&mut self, chunk: &[Fresh], near: &mut Queue<NearPair>) {
        let mut pairs = [CuboidPair::NONE; L];
        for (lane, item) in chunk.iter().enumerate().take(L) {
            pairs[lane] = self.cuboid_pair(item);
        }
        let axes = CuboidLanes::<W>::load(&pairs.each_ref()).test_axes();
        for (lane, item) in chunk.iter().enumerate().take(L) {
            match axes.near(lane) {
                Some(found) => near.push(NearPair { item: *item, cuboids: pairs[lane], found }),
                None => self.settle(item, &Places::NONE),
            }
        }
    }

    /// Finds the contacts of pairs that are near.
    #[inline(always)]
    fn clip_faces(&mut self, chunk: &[NearPair], manifold: &mut WideManifold<L>, places: &mut [Places; L]) {
        let (mut pairs, mut near) = ([&CuboidPair::NONE; L], [&NearCuboids::NONE; L]);
        let mut frames = FrameRecords::<L>::NONE;
        for (lane, pair) in chunk.iter().enumerate().take(L) {
            (pairs[lane], near[lane]) = (&pair.cuboids, &pair.found);
            frames.set(lane, self.pairs.shared(pair.item.pair), self.context.shapes, self.context.solver);
        }
        CuboidLanes::<W>::load(&pairs).contacts(&pairs, &near, chunk.len(), manifold);
        WideFrame::<W>::load(&frames).place(manifold, places);
        for (pair, places) in chunk.iter().zip(places) {
            self.settle(&pair.item, places);
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
        if pair.arbiter != NONE && (keeps_points(&s1.geometry) || keeps_points(&s2.geometry)) {
            self.recall(fresh, &mut manifold);
        }
        let pair = self.pairs.pair(fresh.pair);
        let (margin, kept) = (context.margin(pair), (&mut pair.cache, &mut manifold));
        collide_on(context.level, (&s1.geometry, &s2.geometry), &relative, margin, kept);
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
        let touching = (manifold.materials(), manifold.other_materials().0);
        if (pair.materials, pair.other_materials) != touching && !manifold.points().is_empty() {
            self.change_materials(fresh.pair, touching);
        }
        let pair = self.pairs.shared(fresh.pair);
        let places = Places::of_manifold(&manifold, &PairFrame::new(pair, context.shapes, context.solver));
        self.settle(fresh, &places);
    }

    /// Puts the contacts of the last step into a manifold, as they stand now.
    fn recall(&mut self, fresh: &Fresh, manifold: &mut Manifold) {
        let shapes = self.context.shapes;
        let (pair, arbiter) = self.pairs.pair_and_arbiter(fresh.pair);
        let Some(arbiter) = arbiter else { return };
        let to_shape = shapes[pair.shapes[0] as usize].from_center.inverse();
        for (_, contact) in arbiter.data.contacts() {
            let (anchor1, anchor2) = (contact.local_anchor1, fresh.between.transform_point(contact.local_anchor2));
            let (point1, normal) = (to_shape.transform_point(anchor1), to_shape.rotation.rotate(anchor2 - anchor1));
            manifold.push(ManifoldPoint { point1, normal, separation: 1.0, feature: contact.feature });
        }
    }

    /// Other parts of the surfaces touch than before.
    #[cold]
    fn change_materials(&mut self, index: u32, materials: ([u8; 2], [u8; 2])) {
        let context = self.context;
        let (pair, arbiter) = self.pairs.pair_and_arbiter(index);
        (pair.materials, pair.other_materials) = materials;
        if let Some(arbiter) = arbiter {
            mix_shape_materials(pair, &mut arbiter.data, context.shapes, context.bodies);
        }
    }

    /// Gives a new manifold to the arbiter, or begins one.
    #[inline(always)]
    fn settle(&mut self, item: &Fresh, places: &Places) {
        let context = self.context;
        let (pair, arbiter) = self.pairs.pair_and_arbiter(item.pair);
        context.note_fresh(pair, item, arbiter.is_some() || places.count == 0);
        if pair.is_one_way() && !context.one_way_holds(pair, item, places) {
            return;
        }
        if let Some(arbiter) = arbiter {
            let rotations = context.rotations(pair);
            update_contacts(&mut arbiter.data, places, rotations, context.settings.contact_break_distance);
            if places.count == 0 {
                self.news.push(News::Empty(pair.arbiter));
            } else if let Some(body) = context.borne(pair) {
                self.news.push(News::Borne(body));
            }
        } else if context.begins(pair, places) {
            let [id1, id2] = pair.shapes.map(|slot| context.shapes[slot as usize].id);
            let (key, bodies) = (ArbiterKey::of_shapes(id1, id2), pair.bodies);
            let wakes = bodies.iter().any(|&body| context.bodies[body as usize].can_wake());
            if let Some(body) = context.borne(pair) {
                self.news.push(News::Borne(body));
            }
            self.begins.push(Begin { key, pair: item.pair, bodies, wakes, places: *places });
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

/// Surface velocities and directions of friction turn with their bodies.
fn turn_conveyor(pair: &Pair, shapes: &[ShapeSlot], rotations: [Rotation; 2], data: &mut ContactData) {
    let slots = pair.shapes.map(|slot| &shapes[slot as usize]);
    let materials = [0, 1].map(|side| slots[side].surface(pair.materials[side]));
    if data.flags & TANGENT_VELOCITY_OVERRIDDEN == 0 {
        data.tangent_velocity = surface_velocity(materials, rotations);
    }
    turn_anisotropy(slots, materials, rotations, data);
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
    /// Against what stands still, continuous collision does the looking ahead, unless something bounces: that has to leave from
    /// the surface. Contacts that are far apart would be hit one after the other, substep by substep, and a long body that
    /// hits so is thrown up by blows none of which bounces (measured: falling trunks of 25 m, by 1.4 m).
    ///
    /// Spin is left out of how fast they move: heaps of tumbling rocks would take 6 % more instructions for contacts that seldom
    /// come to touch, and thin rods, whose size is their thickness, would see no farther.
    #[inline(always)]
    fn margin(&self, pair: &Pair) -> Real {
        if pair.sensor {
            return 0.0;
        }
        let fixed = pair.bodies.iter().any(|&body| self.solver.states[body as usize].is_fixed());
        if fixed && pair.shapes.iter().all(|&slot| !self.shapes[slot as usize].bounces()) {
            return self.settings.speculative_distance;
        }
        max(self.settings.speculative_distance, min(self.closing(pair), pair.size))
    }

    /// Notes how the bodies stand for which a manifold was made.
    #[inline(always)]
    fn note_fresh(&self, pair: &mut Pair, fresh: &Fresh, reusable: bool) {
        pair.has_manifold = reusable && self.filters.contact.is_none() && pair.traits & PRE_SOLVE == 0;
        let shapes = pair.shapes.map(|slot| &self.shapes[slot as usize]);
        pair.note_manifold(&fresh.between, self.solver.masses[pair.bodies[0] as usize].rotation, shapes);
    }

    /// The body of a pair that lies on what nothing can push, if there are several such things by it.
    #[inline(always)]
    fn borne(&self, pair: &Pair) -> Option<u32> {
        pair.borne().filter(|&body| self.bearings[body as usize] > 1)
    }

    /// Whether a new manifold of a pair with a one-way platform counts; see [`one_way`].
    #[cold]
    #[inline(never)]
    fn one_way_holds(&self, pair: &mut Pair, item: &Fresh, places: &Places) -> bool {
        let places = &places.points[..places.count];
        if pair.arbiter != NONE {
            return true;
        }
        let overlaps = places.iter().any(|place| place.separation <= 0.0);
        if places.is_empty() || !overlaps {
            pair.set_passing(false);
        }
        if places.is_empty() || pair.is_passing() {
            return places.is_empty();
        }
        let shapes = pair.shapes.map(|slot| &self.shapes[slot as usize]);
        let relative = shapes_relative(&item.between, shapes[0], shapes[1]);
        let seen = [(&shapes[1].geometry, relative), (&shapes[0].geometry, relative.inverse())];
        let mut verdict = Verdict::Stands;
        for (side, (visitor, pose)) in seen.iter().enumerate() {
            if let Some(direction) = shapes[side].one_way {
                let approach = self.approach(pair, side, direction, places);
                let speculative = self.settings.speculative_distance;
                verdict = verdict.max(one_way::judge(shapes[side], direction, (visitor, pose), approach, speculative));
            }
        }
        pair.set_passing(verdict == Verdict::Passes);
        verdict == Verdict::Stands
    }

    /// How the other shape of a pair comes to the platform on one side of it.
    fn approach(&self, pair: &Pair, side: usize, direction: Vec3, places: &[Place]) -> Approach {
        let rotations = self.rotations(pair);
        let direction = rotations[side].rotate(self.shapes[pair.shapes[side] as usize].pose.rotation.rotate(direction));
        let sign = if side == 0 { 1.0 } else { -1.0 };
        let [v1, v2] = pair.bodies.map(|body| &self.solver.states[body as usize]);
        let mut approach = Approach { rise: -1.0, way: 0.0 };
        for place in places {
            let rise = sign * place.normal.dot(direction);
            if rise > approach.rise {
                let velocity1 = v1.linear_velocity + v1.angular_velocity.cross(rotations[0].rotate(place.anchor1));
                let velocity2 = v2.linear_velocity + v2.angular_velocity.cross(rotations[1].rotate(place.anchor2));
                approach = Approach { rise, way: sign * (velocity2 - velocity1).dot(direction) * self.dt };
            }
        }
        approach
    }

    /// How both bodies are turned.
    #[inline(always)]
    fn rotations(&self, pair: &Pair) -> [Rotation; 2] {
        pair.bodies.map(|body| self.solver.masses[body as usize].rotation)
    }

    /// How far a pair may close in a step for its contact to begin here. What comes faster is left to the flight of a bullet
    /// that will be swept in this step: stopping it here would lose the time that it has left after the bounce.
    fn most_closing(&self, pair: &Pair) -> Real {
        let mut most = Real::INFINITY;
        for &index in &pair.bodies {
            let body = &self.bodies[index as usize];
            if body.bullet && body.continuous && self.settings.continuous {
                let least = FLIGHT * body.inner_radius;
                if self.solver.states[index as usize].linear_velocity.length() * self.dt > least {
                    most = min(least, most);
                }
            }
        }
        most
    }

    /// Whether a pair without arbiter touches, or closes fast enough to touch within this step.
    fn begins(&self, pair: &Pair, places: &Places) -> bool {
        let [(v1, a1), (v2, a2)] =
            pair.bodies.map(|body| (&self.solver.states[body as usize], &self.solver.motions[body as usize]));
        let [rotation1, rotation2] = self.rotations(pair);
        let most_closing = self.most_closing(pair);
        places.points[..places.count].iter().any(|point| {
            if point.separation <= 0.0 {
                return true;
            }
            let velocity1 = v1.linear_velocity + v1.angular_velocity.cross(rotation1.rotate(point.anchor1));
            let velocity2 = v2.linear_velocity + v2.angular_velocity.cross(rotation2.rotate(point.anchor2));
            let speed =
                point.normal.dot(velocity2 - velocity1) + point.normal.dot(a2.acceleration - a1.acceleration) * self.dt;
            point.separation + speed * self.dt <= 0.0 && -speed * self.dt <= most_closing
        })
    }
}
