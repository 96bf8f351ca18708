//! The narrow phase of a step: for each active pair, a new manifold or last step's once more.
//!
//! A manifold is used again while the bodies have hardly moved against each other since it was made ([`Pair::reuse_limits`]):
//! the anchors turn and move with their bodies, so gaps stay exact; the choice of points, the normal and the levers are those
//! of when it was made. That keeps tall stacks up: were normals and levers to follow each small tilt, a soft stack would
//! buckle under its own weight as a tall column does (measured: a triangle of 100 rows falls after 8 s, and stands for good
//! with levers kept). Where a pair turns together, on a turntable, normal and levers are turned along every 1.4°.
//! Materials and arbiters are read anew each step whatever is used again.
//!
//! Pairs are independent: they run on all threads in blocks of neighbours in memory ([`block`]), each writing its own arbiter
//! ([`contacts`]). What begins is gathered and sorted by key.

mod block;
mod contacts;
mod loads;
mod seams;

use super::World;
use super::arbiters::{fresh_data, mix_shape_materials};
use super::bearings::Bearings;
use super::bodies::Body;
use super::filters::UserFilters;
use super::pairs::{PRE_SOLVE, Pair};
use super::settings::WorldSettings;
use super::shapes::ShapeSlot;
use crate::arbiter::{Arbiter, ArbiterId, ArbiterKey, ContactData, NONE, Name};
use crate::id::BodyId;
use crate::math::Real;
use crate::narrow_phase::{Manifold, collide};
use crate::parallel::{Gather, SharedSlice, StagePool};
#[cfg(target_arch = "x86_64")]
use crate::simd::{Avx2, Avx2Lanes, Avx512, Avx512Lanes, Sse2Lanes};
use crate::simd::{Baseline, Instructions, Lanes, SimdLevel, Wide};
use crate::solver::{BodyMass, SolverBodies};
use crate::storage;
use block::{BlockKernel, PAIRS_PER_BLOCK, WORDS_PER_BLOCK};
use contacts::{Places, update_contacts};
use loads::Load;
use seams::SeamSearch;
use std::marker::PhantomData;

/// How many begins ahead of its making the pair of an arbiter is asked for.
const BEGINS_AHEAD: usize = 4;

/// What a pair has to tell beyond its own records.
#[derive(Clone, Copy, Debug)]
enum News {
    /// The fat boxes have parted.
    Apart(u32),
    /// A sensor's overlap has begun or ended.
    Sensor(u32, bool),
    /// The arbiter has no contacts.
    Empty(u32),
    /// The body, which has several pairs with what nothing can push, has new contacts of such a pair.
    Borne(u32),
    /// The shapes ask to be told something of their arbiter, and whether they have one.
    Watched(u32, bool),
}

/// A pair whose shapes begin to touch.
#[derive(Clone, Copy, Debug)]
struct Begin {
    key: ArbiterKey,
    pair: u32,
    bodies: [u32; 2],
    /// Whether a body of it sleeps, or has begun to rest.
    wakes: bool,
    places: Places,
}

/// What all pairs read.
struct CollideContext<'a> {
    shapes: &'a [ShapeSlot],
    bodies: &'a [Body],
    solver: &'a SolverBodies,
    broad_phase: &'a crate::broad_phase::BroadPhase,
    settings: &'a WorldSettings,
    level: SimdLevel,
    filters: &'a UserFilters,
    /// Shapes whose proxies have moved since the last narrow phase.
    moved: &'a [bool],
    /// By body: how many pairs it has with what nothing can push.
    bearings: &'a [u32],
    dt: Real,
}

/// Buffers of the narrow phase, kept from step to step.
#[derive(Debug, Default)]
pub(crate) struct NarrowPhaseScratch {
    news: Gather<News>,
    /// Runs of pairs of which one is active.
    blocks: Vec<u32>,
    begins: Gather<Begin>,
    /// Places of the begins, by key.
    begin_order: Vec<(ArbiterKey, u32)>,
    apart: Vec<u32>,
    sensors: Vec<(u32, bool)>,
    /// Bodies with new contacts against what nothing can push.
    borne: Vec<u32>,
    /// What bodies by several things that nothing can push were borne with in the last step, by body.
    loads: Vec<Load>,
    /// Arbiters that may have nothing left.
    pub empty: Vec<u32>,
}

impl World {
    /// Finds the contacts of all active pairs and makes the arbiters that begin.
    pub(crate) fn collide_pairs(&mut self, dt: Real) {
        let mut scratch = std::mem::take(&mut self.narrow);
        scratch.empty.clear();
        scratch.news.prepare(self.pool.threads(), PAIRS_PER_BLOCK);
        scratch.begins.prepare(self.pool.threads(), PAIRS_PER_BLOCK);
        for list in [&mut scratch.borne, &mut scratch.empty, &mut scratch.apart] {
            crate::storage::reserve(list, PAIRS_PER_BLOCK);
        }
        self.add_up_loads(&mut scratch.loads);
        scratch.blocks.clear();
        self.events.watched_pairs.clear();
        let blocks = self.active_pairs.words().chunks(WORDS_PER_BLOCK).enumerate();
        scratch.blocks.extend(blocks.filter(|(_, words)| words.iter().any(|&word| word != 0)).map(|(i, _)| i as u32));
        match self.level {
            SimdLevel::Scalar => self.run_pairs::<_, Wide<1>, 1>(Baseline, dt, &scratch),
            #[cfg(target_arch = "x86_64")]
            SimdLevel::Avx2 if let Some(avx2) = Avx2::detect() => {
                self.run_pairs::<_, Avx2Lanes, 8>(avx2, dt, &scratch);
            }
            #[cfg(target_arch = "x86_64")]
            SimdLevel::Avx512 if let Some(avx512) = Avx512::detect() => {
                self.run_pairs::<_, Avx512Lanes, 16>(avx512, dt, &scratch);
            }
            #[cfg(target_arch = "x86_64")]
            _ => self.run_pairs::<_, Sse2Lanes, 4>(Baseline, dt, &scratch),
            #[cfg(not(target_arch = "x86_64"))]
            _ => self.run_pairs::<_, Wide<4>, 4>(Baseline, dt, &scratch),
        }
        for item in scratch.news.list().drain(..) {
            match item {
                News::Apart(pair) => scratch.apart.push(pair),
                News::Sensor(pair, overlaps) => scratch.sensors.push((pair, overlaps)),
                News::Empty(arbiter) => scratch.empty.push(arbiter),
                News::Borne(body) => scratch.borne.push(body),
                News::Watched(pair, goes_on) => self.events.watch(pair, goes_on),
            }
        }
        // Threads report in any order; events and places must not depend on it.
        self.test_resting_sensors(&mut scratch.sensors);
        scratch.sensors.sort_unstable_by_key(|&(pair, _)| self.pair_key(pair));
        for (pair, overlaps) in scratch.sensors.drain(..) {
            self.set_sensor_overlap(pair, overlaps);
        }
        scratch.apart.sort_unstable();
        self.part_pairs(&scratch.apart);
        scratch.apart.clear();
        scratch.empty.retain(|&index| self.arbiters.at(index).alive);
        self.begin_pairs(scratch.begins.list(), &mut scratch.begin_order);
        self.hide_seams(&mut scratch.borne, &scratch.loads);
        self.narrow = scratch;
    }

    /// The blocks with active pairs, with the instructions of a level.
    fn run_pairs<I: Instructions, W: Lanes<L>, const L: usize>(
        &mut self,
        level: I,
        dt: Real,
        scratch: &NarrowPhaseScratch,
    ) {
        let context = CollideContext {
            shapes: &self.shapes,
            bodies: &self.bodies,
            solver: &self.solver_bodies,
            broad_phase: &self.broad_phase,
            settings: &self.scaled,
            level: self.level,
            filters: &self.filters,
            moved: &self.moved_shapes,
            bearings: self.bearings.counts(),
            dt,
        };
        let active = self.active_pairs.words();
        let pairs = SharedSlice::new(&mut self.pairs);
        let arbiters = SharedSlice::new(self.arbiters.slots_mut());
        self.pool.run(scratch.blocks.len(), |index| {
            let block = scratch.blocks[index] as usize;
            let words = &active[block * WORDS_PER_BLOCK..((block + 1) * WORDS_PER_BLOCK).min(active.len())];
            level.run(BlockKernel::<W, L> {
                context: &context,
                // SAFETY: `run` gives each block to one thread, once.
                pairs: unsafe { block::BlockPairs::new(&pairs, &arbiters, block, words) },
                news: scratch.news.block(),
                begins: scratch.begins.block(),
                lanes: PhantomData,
            });
        });
    }

    /// Adds up the loads of bodies that several things bear which nothing can push.
    fn add_up_loads(&mut self, loads: &mut Vec<Load>) {
        loads.clear();
        if !self.bearings.any_several() {
            return;
        }
        let (search, awake, bearings, _) = self.seam_search();
        let several = || awake.iter().filter(|&&body| bearings.has_several(body));
        storage::reserve(loads, awake.len());
        loads.extend(several().filter_map(|&body| search.load_of(body)));
        loads.sort_unstable_by_key(|load| load.body);
    }

    /// Leaves contacts at seams between shapes that nothing can push out of the solve, and hands on loads.
    fn hide_seams(&mut self, bodies: &mut Vec<u32>, loads: &[Load]) {
        if bodies.is_empty() {
            return;
        }
        bodies.sort_unstable();
        bodies.dedup();
        let (search, _, _, pool) = self.seam_search();
        search.run(bodies, loads, pool);
        bodies.clear();
    }

    /// Also which bodies are awake, how many things by them nothing can push, and the threads.
    fn seam_search(&mut self) -> (SeamSearch<'_>, &[u32], &Bearings, &mut StagePool) {
        let search = SeamSearch {
            shapes: &self.shapes,
            bodies: &self.bodies,
            solver: &self.solver_bodies,
            lists: &self.pair_lists,
            pairs: SharedSlice::new(&mut self.pairs),
            arbiters: SharedSlice::new(self.arbiters.slots_mut()),
            slop: self.scaled.slop,
            break_distance: self.scaled.contact_break_distance,
        };
        (search, &self.awake, &self.bearings, &mut self.pool)
    }

    /// Makes the arbiters of the pairs that begin to touch, by key.
    fn begin_pairs(&mut self, begins: &mut Vec<Begin>, order: &mut Vec<(ArbiterKey, u32)>) {
        order.extend(begins.iter().zip(0..).map(|(begin, place)| (begin.key, place)));
        order.sort_unstable();
        // The engine's own arbiters end with their pairs: only one of the user's can have a key already.
        if self.arbiters.custom > 0 {
            order.retain(|&(_, place)| !self.take_over(&begins[place as usize]));
        }
        if !order.is_empty() {
            self.create_arbiters(begins, order);
        }
        for begin in order.iter().map(|&(_, place)| &begins[place as usize]).filter(|begin| begin.wakes) {
            begin.bodies.into_iter().for_each(|body| self.wake(body));
        }
        order.clear();
        begins.clear();
    }

    /// Whether the key of a pair that begins to touch is in use. If the user has made an arbiter under it between the same
    /// bodies, the engine goes on with that one.
    fn take_over(&mut self, begin: &Begin) -> bool {
        let Some(index) = self.arbiters.find(begin.key) else { return false };
        let ids = begin.bodies.map(|body| self.body_id(body));
        let arbiter = self.arbiters.at_mut(index);
        if [arbiter.body1, arbiter.body2] == ids {
            let filler = Filler::new((&self.shapes, &self.bodies), &self.solver_bodies, &self.scaled, &self.filters);
            let pair = &mut self.pairs[begin.pair as usize];
            if arbiter.pair == NONE {
                self.arbiters.custom -= 1; // it ends with its pair now
            }
            let arbiter = self.arbiters.at_mut(index);
            (arbiter.pair, pair.arbiter) = (begin.pair, index);
            filler.fill(begin, pair, &mut arbiter.data);
        }
        true
    }

    /// Makes arbiters with contacts and materials, their begins still to be raised.
    fn create_arbiters(&mut self, begins: &[Begin], order: &[(ArbiterKey, u32)]) {
        let filler = Filler::new((&self.shapes, &self.bodies), &self.solver_bodies, &self.scaled, &self.filters);
        let first = self.events.unbegun.len();
        storage::reserve(&mut self.events.unbegun, first + order.len());
        self.events
            .unbegun
            .resize(first + order.len(), (ArbiterKey::new(0, 0), ArbiterId { index: NONE, generation: 0 }));
        let unbegun = SharedSlice::new(&mut self.events.unbegun[first..]);
        let pairs = SharedSlice::new(&mut self.pairs);
        let name_of = |nth: usize| {
            let (key, place) = order[nth];
            let bodies = begins[place as usize].bodies;
            Name {
                key,
                bodies: bodies.map(|index| BodyId { index, generation: filler.bodies[index as usize].generation }),
            }
        };
        let fill = |nth: usize, arbiter: &mut Arbiter| {
            if let Some(&(_, later)) = order.get(nth + BEGINS_AHEAD) {
                pairs.prefetch(begins[later as usize].pair as usize);
            }
            let begin = &begins[order[nth].1 as usize];
            // SAFETY: a pair begins once, and each begin is filled once.
            let (pair, told) = unsafe { (pairs.get_mut(begin.pair as usize), unbegun.get_mut(nth)) };
            *told = (begin.key, arbiter.id);
            (arbiter.pair, pair.arbiter) = (begin.pair, arbiter.id.index);
            arbiter.data = fresh_data();
            filler.fill(begin, pair, &mut arbiter.data);
        };
        self.arbiters.create_many(order.len(), self.bodies.len(), &mut self.pool, name_of, fill);
    }
}

/// Gives contacts and materials to arbiters that begin.
struct Filler<'a> {
    shapes: &'a [ShapeSlot],
    bodies: &'a [Body],
    masses: &'a [BodyMass],
    break_distance: Real,
    /// Whether manifolds may be used again.
    reusable: bool,
}

impl<'a> Filler<'a> {
    fn new(
        (shapes, bodies): (&'a [ShapeSlot], &'a [Body]),
        solver: &'a SolverBodies,
        settings: &WorldSettings,
        filters: &UserFilters,
    ) -> Self {
        let (break_distance, reusable) = (settings.contact_break_distance, filters.contact.is_none());
        Self { shapes, bodies, masses: &solver.masses, break_distance, reusable }
    }

    fn fill(&self, begin: &Begin, pair: &mut Pair, data: &mut ContactData) {
        let rotations = begin.bodies.map(|body| self.masses[body as usize].rotation);
        update_contacts(data, &begin.places, rotations, self.break_distance);
        pair.has_manifold = self.reusable && pair.traits & PRE_SOLVE == 0;
        mix_shape_materials(pair, data, self.shapes, self.bodies);
    }
}

/// Whether the shapes of a pair overlap in the present poses.
pub(crate) fn shapes_overlap(pair: &Pair, shapes: &[ShapeSlot], bodies: &[Body]) -> bool {
    let [a, b] = pair.shapes.map(|slot| &shapes[slot as usize]);
    let pose = |side: usize, shape: &ShapeSlot| bodies[pair.bodies[side] as usize].pose.mul(&shape.pose);
    let relative = pose(0, a).relative(&pose(1, b));
    let (mut cache, mut manifold) = (pair.cache, Manifold::EMPTY);
    collide(&a.geometry, &b.geometry, &relative, 0.0, &mut cache, &mut manifold);
    !manifold.points().is_empty()
}
