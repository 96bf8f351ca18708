//! The solver for one lane count: its rows, and the stages over them.

use super::bodies::{BodyState, SharedStates};
use super::coloring::{CLASSES, RowPlan, RowSource};
use super::integrate::{IntegrateKernel, IntegrateParameters, IntegrateTarget, Integration};
use super::prepare::{PrepareContext, RowTarget, SolvedRow, prepare_row, read_row, store_lane};
use super::rows::{ExtraRow, FrictionRow, NormalRow, RowFeatures};
use super::solve::{PassParameters, RowPass};
use crate::arbiter::Arbiter;
use crate::math::Real;
use crate::parallel::{SharedSlice, StagePool};
#[cfg(target_arch = "x86_64")]
use crate::simd::{Avx2, Avx2Lanes, Avx512, Avx512Lanes, Sse2Lanes};
use crate::simd::{Baseline, Instructions, Kernel, Lanes, SimdLevel, Wide, prefetch};
use crate::storage;
use std::marker::PhantomData;

/// Wide rows that a thread takes at a time.
const ROWS_PER_BLOCK: usize = 16;

/// Which pass to run over the rows of a group.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Pass {
    WarmStart,
    Solve,
    Relax,
    Restitution,
}

/// The solver as the step sees it, whatever its lane count.
pub(crate) trait ContactSolver: Send + Sync {
    /// Makes the rows of a plan.
    fn prepare(&mut self, plan: &RowPlan, context: &PrepareContext<'_>, pool: &mut StagePool);

    /// Runs a pass over one group of the plan.
    fn pass(
        &mut self,
        group: usize,
        pass: Pass,
        states: &mut [BodyState],
        parameters: &PassParameters,
        pool: &mut StagePool,
    );

    /// Integrates velocities or positions of bodies.
    fn integrate(
        &self,
        phase: Integration,
        target: IntegrateTarget<'_>,
        parameters: &IntegrateParameters,
        pool: &mut StagePool,
    );

    /// Writes impulses and gaps back to the arbiters; notes in `may_break` (by row of the plan) whose contacts to test.
    fn store(&mut self, target: StoreTarget<'_>, pool: &mut StagePool);
}

/// Where stored impulses go.
pub(crate) struct StoreTarget<'a> {
    pub plan: &'a RowPlan,
    pub arbiters: &'a mut [Arbiter],
    pub states: &'a mut [BodyState],
    pub break_distance: Real,
    pub may_break: &'a mut [bool],
}

/// The solver for a level.
pub(crate) fn contact_solver(level: SimdLevel) -> Box<dyn ContactSolver> {
    match level {
        SimdLevel::Scalar => Box::new(LaneSolver::<_, Wide<1>, 1>::new(Baseline)),
        #[cfg(target_arch = "x86_64")]
        SimdLevel::Avx2 if let Some(avx2) = Avx2::detect() => Box::new(LaneSolver::<_, Avx2Lanes, 8>::new(avx2)),
        #[cfg(target_arch = "x86_64")]
        SimdLevel::Avx512 if let Some(avx512) = Avx512::detect() => {
            Box::new(LaneSolver::<_, Avx512Lanes, 16>::new(avx512))
        }
        #[cfg(target_arch = "x86_64")]
        _ => Box::new(LaneSolver::<_, Sse2Lanes, 4>::new(Baseline)),
        #[cfg(not(target_arch = "x86_64"))]
        _ => Box::new(LaneSolver::<_, Wide<4>, 4>::new(Baseline)),
    }
}

/// Wide rows of one class.
struct RowSet<W, const L: usize, const P: usize, const C: usize> {
    normals: Vec<NormalRow<W, L, P, C>>,
    frictions: Vec<FrictionRow<W, P>>,
    /// Those of the wide rows that need one, in their order.
    extras: Vec<ExtraRow<W, P>>,
    /// How many extra rows stand before that of each wide row, and at the end how many there are.
    extras_before: Vec<u32>,
    features: Vec<RowFeatures>,
    /// First source of each wide row, and how many there are.
    sources: Vec<(u32, u32)>,
    /// Wide rows of each group.
    groups: Vec<(u32, u32)>,
}

impl<W: Lanes<L>, const L: usize, const P: usize, const C: usize> RowSet<W, L, P, C> {
    const fn new() -> Self {
        Self {
            normals: Vec::new(),
            frictions: Vec::new(),
            extras: Vec::new(),
            extras_before: Vec::new(),
            features: Vec::new(),
            sources: Vec::new(),
            groups: Vec::new(),
        }
    }

    /// Cuts the plan's rows of one class into wide rows; rows of a serial group stand alone.
    fn lay_out(&mut self, plan: &RowPlan, class: usize) {
        self.sources.clear();
        self.groups.clear();
        self.extras_before.clear();
        let mut extras = 0;
        for group in &plan.groups {
            let first = self.sources.len() as u32;
            let (start, end) = group.ranges[class];
            let width = if group.serial { 1 } else { L as u32 };
            let mut at = start;
            while at < end {
                let count = width.min(end - at);
                storage::push(&mut self.sources, (at, count));
                storage::push(&mut self.extras_before, extras);
                let mut needed = false;
                for source in &plan.rows[at as usize..(at + count) as usize] {
                    needed |= source.extra;
                }
                extras += u32::from(needed);
                at += count;
            }
            self.groups.push((first, self.sources.len() as u32));
        }
        storage::push(&mut self.extras_before, extras);
        let count = self.sources.len();
        enlarge(&mut self.normals, count, NormalRow::EMPTY);
        enlarge(&mut self.frictions, count, FrictionRow::EMPTY);
        enlarge(&mut self.extras, extras as usize, ExtraRow::EMPTY);
        enlarge(&mut self.features, count, RowFeatures::default());
    }

    /// Shares the wide rows of `range` among threads.
    fn share(&mut self, range: (usize, usize)) -> SharedRows<'_, W, L, P, C> {
        SharedRows {
            normals: SharedSlice::new(&mut self.normals),
            frictions: SharedSlice::new(&mut self.frictions),
            extras: SharedSlice::new(&mut self.extras),
            extras_before: &self.extras_before,
            features: SharedSlice::new(&mut self.features),
            sources: &self.sources,
            range,
        }
    }

    /// Whether some row may bounce.
    fn bounces(&self) -> bool {
        self.features[..self.sources.len()].iter().any(|features| features.restitution)
    }
}

/// A run of wide rows as the threads share them, block by block.
struct SharedRows<'a, W, const L: usize, const P: usize, const C: usize> {
    normals: SharedSlice<'a, NormalRow<W, L, P, C>>,
    frictions: SharedSlice<'a, FrictionRow<W, P>>,
    extras: SharedSlice<'a, ExtraRow<W, P>>,
    extras_before: &'a [u32],
    features: SharedSlice<'a, RowFeatures>,
    sources: &'a [(u32, u32)],
    range: (usize, usize),
}

impl<W: Lanes<L>, const L: usize, const P: usize, const C: usize> SharedRows<'_, W, L, P, C> {
    fn blocks(&self) -> usize {
        (self.range.1 - self.range.0).div_ceil(ROWS_PER_BLOCK)
    }

    /// The rows of a block.
    ///
    /// # Safety
    /// Each block may be held once at a time.
    unsafe fn block(&self, block: usize) -> Rows<'_, W, L, P, C> {
        let start = self.range.0 + block * ROWS_PER_BLOCK;
        let end = (start + ROWS_PER_BLOCK).min(self.range.1);
        let extras_before = &self.extras_before[start..=end];
        let extras = (extras_before[0] as usize, extras_before[end - start] as usize);
        // SAFETY: blocks do not overlap, and each is held once by the caller's promise.
        unsafe {
            Rows {
                normals: self.normals.range_mut(start, end),
                frictions: self.frictions.range_mut(start, end),
                extras: self.extras.range_mut(extras.0, extras.1),
                extras_before,
                features: self.features.range_mut(start, end),
                sources: &self.sources[start..end],
            }
        }
    }
}

/// The wide rows of a block.
struct Rows<'a, W, const L: usize, const P: usize, const C: usize> {
    normals: &'a mut [NormalRow<W, L, P, C>],
    frictions: &'a mut [FrictionRow<W, P>],
    extras: &'a mut [ExtraRow<W, P>],
    extras_before: &'a [u32],
    features: &'a mut [RowFeatures],
    sources: &'a [(u32, u32)],
}

/// Makes a list of rows longer. Rows are overwritten whole by `prepare_row`: only new ones need a value.
fn enlarge<T: Clone>(list: &mut Vec<T>, count: usize, empty: T) {
    if list.len() < count {
        storage::reserve(list, count);
        list.resize(count, empty);
    }
}

/// The extra row of wide row `i` of a block, if it has one.
#[inline(always)]
fn extra_of<'a, E>(extras: &'a mut [E], before: &[u32], i: usize) -> Option<&'a mut E> {
    if before[i] == before[i + 1] { None } else { extras.get_mut((before[i] - before[0]) as usize) }
}

struct PrepareKernel<'a, W, const L: usize, const P: usize, const C: usize> {
    block: Rows<'a, W, L, P, C>,
    rows: &'a [RowSource],
    context: &'a PrepareContext<'a>,
}

impl<W: Lanes<L>, const L: usize, const P: usize, const C: usize> Kernel for PrepareKernel<'_, W, L, P, C> {
    #[inline(always)]
    fn run(self) {
        let block = self.block;
        for (i, &(first, count)) in block.sources.iter().enumerate() {
            if let Some(&(first, count)) = block.sources.get(i + 1) {
                for source in &self.rows[first as usize..(first + count) as usize] {
                    prefetch(&self.context.arbiters[source.arbiter as usize]);
                }
            }
            let target = RowTarget {
                row: &mut block.normals[i],
                friction: &mut block.frictions[i],
                extra: extra_of(block.extras, block.extras_before, i),
                features: &mut block.features[i],
            };
            let sources = &self.rows[first as usize..(first + count) as usize];
            prepare_row(target, sources, self.context);
        }
    }
}

/// [`StoreTarget`] as the threads share it.
struct StoreShared<'a> {
    rows: &'a [RowSource],
    arbiters: SharedSlice<'a, Arbiter>,
    states: SharedStates<'a>,
    break_distance: Real,
    may_break: SharedSlice<'a, bool>,
}

struct StoreKernel<'a, W, const L: usize, const P: usize, const C: usize> {
    block: Rows<'a, W, L, P, C>,
    target: &'a StoreShared<'a>,
}

impl<W: Lanes<L>, const L: usize, const P: usize, const C: usize> Kernel for StoreKernel<'_, W, L, P, C> {
    #[inline(always)]
    fn run(self) {
        let (target, block) = (self.target, self.block);
        for (i, &(first, count)) in block.sources.iter().enumerate() {
            if let Some(&(first, count)) = block.sources.get(i + 1) {
                for source in &target.rows[first as usize..(first + count) as usize] {
                    target.arbiters.prefetch(source.arbiter as usize);
                }
            }
            let solved = SolvedRow {
                row: &block.normals[i],
                friction: &block.frictions[i],
                extra: extra_of(block.extras, block.extras_before, i).map(|extra| &*extra),
                features: block.features[i],
            };
            // SAFETY: storing writes no states.
            let outcome = unsafe { read_row(&solved, &target.states, target.break_distance) };
            for lane in 0..count as usize {
                let row = first as usize + lane;
                let source = &target.rows[row];
                // SAFETY: rows of one arbiter share its bodies, so they stand in different groups, and groups are stored
                // one after the other; those of the serial group are stored by one thread.
                let arbiter = unsafe { target.arbiters.get_mut(source.arbiter as usize) };
                store_lane(&outcome, &solved, lane, source, arbiter);
                // SAFETY: each row belongs to one block alone.
                *unsafe { target.may_break.get_mut(row) } = outcome.excess[lane] > 0.0;
            }
        }
    }
}

struct PassKernel<'a, W, const L: usize, const P: usize, const C: usize> {
    block: Rows<'a, W, L, P, C>,
    pass: Pass,
    states: &'a SharedStates<'a>,
    parameters: &'a PassParameters,
}

impl<W: Lanes<L>, const L: usize, const P: usize, const C: usize> Kernel for PassKernel<'_, W, L, P, C> {
    #[inline(always)]
    fn run(self) {
        let (block, parameters) = (self.block, self.parameters);
        for i in 0..block.sources.len() {
            let row = RowPass {
                row: &mut block.normals[i],
                friction: &mut block.frictions[i],
                extra: extra_of(block.extras, block.extras_before, i),
                features: block.features[i],
                states: self.states,
            };
            // SAFETY: rows of one colour share no dynamic body, and each block runs on one thread.
            unsafe {
                match self.pass {
                    Pass::WarmStart => row.warm_start(),
                    Pass::Solve => row.solve(parameters),
                    Pass::Relax => row.relax(parameters),
                    Pass::Restitution => row.restitute(parameters),
                }
            }
        }
    }
}

/// Rows for `L` lanes, by class.
struct LaneSolver<I, W, const L: usize> {
    level: I,
    one: RowSet<W, L, 1, 0>,
    two: RowSet<W, L, 2, 1>,
    four: RowSet<W, L, 4, 6>,
    /// Groups whose rows share bodies.
    serial: Vec<bool>,
    /// Whether some row may bounce.
    bounces: bool,
}

impl<I: Instructions, W: Lanes<L>, const L: usize> LaneSolver<I, W, L> {
    const fn new(level: I) -> Self {
        Self { level, serial: Vec::new(), bounces: false, one: RowSet::new(), two: RowSet::new(), four: RowSet::new() }
    }
}

/// The three classes of a group.
struct Group<'a, W, const L: usize> {
    one: SharedRows<'a, W, L, 1, 0>,
    two: SharedRows<'a, W, L, 2, 1>,
    four: SharedRows<'a, W, L, 4, 6>,
}

impl<W: Lanes<L>, const L: usize> Group<'_, W, L> {
    /// Calls `visit` with each block of each class: on all threads, or in order on this one where rows share bodies.
    fn for_each_block(&self, serial: bool, pool: &mut StagePool, visit: impl Fn(usize, usize) + Sync) {
        let (ones, twos, fours) = (self.one.blocks(), self.two.blocks(), self.four.blocks());
        let stage = |block: usize| {
            if block < fours {
                visit(2, block);
            } else if block < fours + twos {
                visit(1, block - fours);
            } else {
                visit(0, block - fours - twos);
            }
        };
        let count = ones + twos + fours;
        if serial { (0..count).for_each(stage) } else { pool.run(count, stage) }
    }
}

impl<I: Instructions, W: Lanes<L>, const L: usize> LaneSolver<I, W, L> {
    /// The wide rows of a group.
    fn group(&mut self, group: usize) -> Group<'_, W, L> {
        let range = |groups: &[(u32, u32)]| (groups[group].0 as usize, groups[group].1 as usize);
        let ranges = (range(&self.one.groups), range(&self.two.groups), range(&self.four.groups));
        Group { one: self.one.share(ranges.0), two: self.two.share(ranges.1), four: self.four.share(ranges.2) }
    }

    /// All wide rows.
    fn all(&mut self) -> Group<'_, W, L> {
        let ends = (self.one.sources.len(), self.two.sources.len(), self.four.sources.len());
        Group { one: self.one.share((0, ends.0)), two: self.two.share((0, ends.1)), four: self.four.share((0, ends.2)) }
    }
}

impl<I: Instructions, W: Lanes<L>, const L: usize> ContactSolver for LaneSolver<I, W, L> {
    fn prepare(&mut self, plan: &RowPlan, context: &PrepareContext<'_>, pool: &mut StagePool) {
        const { assert!(CLASSES == 3) };
        self.serial.clear();
        self.serial.extend(plan.groups.iter().map(|group| group.serial));
        self.one.lay_out(plan, 0);
        self.two.lay_out(plan, 1);
        self.four.lay_out(plan, 2);
        let (level, rows) = (self.level, &plan.rows[..]);
        let all = self.all();
        all.for_each_block(false, pool, |class, block| {
            // SAFETY: each block is visited once.
            unsafe {
                match class {
                    0 => level.run(PrepareKernel { block: all.one.block(block), rows, context }),
                    1 => level.run(PrepareKernel { block: all.two.block(block), rows, context }),
                    _ => level.run(PrepareKernel { block: all.four.block(block), rows, context }),
                }
            }
        });
        self.bounces = self.one.bounces() || self.two.bounces() || self.four.bounces();
    }

    fn pass(
        &mut self,
        group: usize,
        pass: Pass,
        states: &mut [BodyState],
        parameters: &PassParameters,
        pool: &mut StagePool,
    ) {
        if pass == Pass::Restitution && !self.bounces {
            return;
        }
        let states = &SharedSlice::new(states);
        let (level, serial) = (self.level, self.serial[group]);
        let group = self.group(group);
        group.for_each_block(serial, pool, |class, block| {
            // SAFETY: each block is visited once.
            unsafe {
                match class {
                    0 => level.run(PassKernel { block: group.one.block(block), pass, states, parameters }),
                    1 => level.run(PassKernel { block: group.two.block(block), pass, states, parameters }),
                    _ => level.run(PassKernel { block: group.four.block(block), pass, states, parameters }),
                }
            }
        });
    }

    fn integrate(
        &self,
        phase: Integration,
        target: IntegrateTarget<'_>,
        parameters: &IntegrateParameters,
        pool: &mut StagePool,
    ) {
        let target = &target;
        pool.run(target.blocks(), |block| {
            self.level.run(IntegrateKernel::<W, L> { target, block, phase, parameters, lanes: PhantomData });
        });
    }

    fn store(&mut self, target: StoreTarget<'_>, pool: &mut StagePool) {
        let shared = &StoreShared {
            rows: &target.plan.rows,
            arbiters: SharedSlice::new(target.arbiters),
            states: SharedSlice::new(target.states),
            break_distance: target.break_distance,
            may_break: SharedSlice::new(target.may_break),
        };
        for index in 0..target.plan.groups.len() {
            let (level, serial) = (self.level, self.serial[index]);
            let group = self.group(index);
            group.for_each_block(serial, pool, |class, block| {
                // SAFETY: each block is visited once.
                unsafe {
                    match class {
                        0 => level.run(StoreKernel { block: group.one.block(block), target: shared }),
                        1 => level.run(StoreKernel { block: group.two.block(block), target: shared }),
                        _ => level.run(StoreKernel { block: group.four.block(block), target: shared }),
                    }
                }
            });
        }
    }
}
