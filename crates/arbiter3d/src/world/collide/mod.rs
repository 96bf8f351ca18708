//! The narrow phase of a step: for each active pair, a new manifold or last step's once more.
//!
//! A manifold is used again while the bodies have hardly moved against each other since it was made ([`Pair::reuse_limits`]):
//! the anchors turn and move with their bodies, so gaps stay exact; the choice of points, the normal and the levers are those
//! of when it was made. That keeps tall stacks up: were normals and levers to follow each small tilt, a soft stack would
//! buckle under its own weight as a tall column does (measured: a triangle of 100 rows falls after 8 s, and stands for good
//! with levers kept). Where a pair turns together, on a turntable, normal and levers are turned along every 1.4°. Materials and arbiters are read anew each step
//! whatever is used again.
//!
//! Pairs are independent: they run on all threads in blocks of neighbours in memory ([`block`]), each writing its own arbiter
//! ([`contacts`]). What begins is gathered and sorted by key.

mod block;
mod contacts;

use super::World;
use super::arbiters::{fresh_data, mix_shape_materials};
use super::bodies::Body;
use super::filters::UserFilters;
use super::pairs::Pair;
use super::settings::WorldSettings;
use super::shapes::ShapeSlot;
use crate::arbiter::{ArbiterKey, NONE};
use crate::math::Real;
use crate::narrow_phase::{Manifold, collide};
use crate::parallel::{Gather, SharedSlice};
#[cfg(target_arch = "x86_64")]
use crate::simd::{Avx2, Avx2Lanes, Avx512, Avx512Lanes, Sse2Lanes};
use crate::simd::{Baseline, Instructions, Lanes, SimdLevel, Wide, prefetch};
use crate::solver::SolverBodies;
use block::{BlockKernel, PAIRS_PER_BLOCK, WORDS_PER_BLOCK};
use contacts::{Places, update_contacts};
use std::marker::PhantomData;

/// How many begins ahead of its making what an arbiter touches is asked for.
const BEGINS_AHEAD: usize = 8;
/// Arbiters that a thread fills at a time at least.
const LEAST_BEGINS: usize = 32;

/// What a pair has to tell beyond its own records.
#[derive(Clone, Copy, Debug)]
enum News {
    /// The fat boxes have parted.
    Apart(u32),
    /// A sensor's overlap has begun or ended.
    Sensor(u32, bool),
    /// The arbiter has no contacts.
    Empty(u32),
}

/// A pair whose shapes begin to touch.
#[derive(Clone, Copy, Debug)]
struct Begin {
    key: ArbiterKey,
    pair: u32,
    bodies: [u32; 2],
    /// Once it is made.
    arbiter: u32,
    /// Whether the user had not made it before.
    is_new: bool,
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
        scratch.blocks.clear();
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
            }
        }
        // Threads report in any order; events and places must not depend on it.
        scratch.sensors.sort_unstable_by_key(|&(pair, _)| self.pair_key(pair));
        for (pair, overlaps) in scratch.sensors.drain(..) {
            self.set_sensor_overlap(pair, overlaps);
        }
        scratch.apart.sort_unstable();
        self.part_pairs(&scratch.apart);
        scratch.apart.clear();
        scratch.empty.retain(|&index| self.arbiters.at(index).alive);
        self.begin_pairs(scratch.begins.list(), &mut scratch.begin_order);
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

    fn pair_key(&self, pair: u32) -> ArbiterKey {
        let [a, b] = self.pairs[pair as usize].shapes.map(|slot| self.shapes[slot as usize].id);
        ArbiterKey::of_shapes(a, b)
    }

    /// Makes the arbiters of the pairs that begin to touch, by key, then fills them on all threads.
    fn begin_pairs(&mut self, begins: &mut Vec<Begin>, order: &mut Vec<(ArbiterKey, u32)>) {
        order.extend(begins.iter().zip(0..).map(|(begin, place)| (begin.key, place)));
        order.sort_unstable();
        for (at, &(_, place)) in order.iter().enumerate() {
            if let Some(&(key, later)) = order.get(at + BEGINS_AHEAD) {
                let later = &begins[later as usize];
                prefetch(&self.pairs[later.pair as usize].arbiter);
                for body in later.bodies {
                    prefetch(&self.bodies[body as usize].island);
                    prefetch(&self.bodies[body as usize].awake);
                }
                self.arbiters.prefetch_new(key, later.bodies, BEGINS_AHEAD);
            }
            self.begin_pair(&mut begins[place as usize]);
        }
        order.clear();
        self.fill_arbiters(begins);
        begins.clear();
    }

    /// Makes the arbiter of a pair that begins to touch, without contacts.
    fn begin_pair(&mut self, begin: &mut Begin) {
        let ids = begin.bodies.map(|body| self.body_id(body));
        // The engine's own arbiters end with their pairs: only one of the user's can have the key already.
        let present = if self.arbiters.custom > 0 { self.arbiters.find(begin.key) } else { None };
        begin.is_new = present.is_none();
        begin.arbiter = match present {
            None => self.create_blank_arbiter(begin.key, ids[0], ids[1]),
            // The user has made an arbiter under the key of these shapes: it is theirs from now on.
            Some(index) if [self.arbiters.at(index).body1, self.arbiters.at(index).body2] == ids => index,
            Some(_) => return, // a key that was not reserved, in use between other bodies
        };
        self.arbiters.at_mut(begin.arbiter).pair = begin.pair;
        self.pairs[begin.pair as usize].arbiter = begin.arbiter;
    }

    /// Gives contacts and materials to the arbiters just made.
    fn fill_arbiters(&mut self, begins: &[Begin]) {
        let reusable = self.filters.contact.is_none();
        let (shapes, bodies, masses) = (&self.shapes, &self.bodies, &self.solver_bodies.masses);
        let break_distance = self.scaled.contact_break_distance;
        let pairs = SharedSlice::new(&mut self.pairs);
        let arbiters = SharedSlice::new(self.arbiters.slots_mut());
        self.pool.run_ranges(begins.len(), LEAST_BEGINS, |range| {
            for begin in begins[range].iter().filter(|begin| begin.arbiter != NONE) {
                // SAFETY: a pair begins once, and an arbiter belongs to one pair.
                let (pair, arbiter) =
                    unsafe { (pairs.get_mut(begin.pair as usize), arbiters.get_mut(begin.arbiter as usize)) };
                if begin.is_new {
                    arbiter.data = fresh_data();
                }
                let rotations = begin.bodies.map(|body| masses[body as usize].rotation);
                update_contacts(&mut arbiter.data, &begin.places, rotations, break_distance);
                pair.has_manifold = reusable;
                mix_shape_materials(pair, &mut arbiter.data, shapes, bodies);
            }
        });
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
