//! The solver for one lane count: its rows, and the stages over them.

use super::bodies::{BodyState, SharedStates};
use super::coloring::{CLASSES, RowPlan, RowSource};
use super::deal::Deal;
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
use std::ops::Range;

/// Contacts that a thread takes at a time at least: what takes about a microsecond.
const LEAST_CONTACTS: usize = 64;

/// Bodies that a thread integrates at a time at least.
const LEAST_BODIES: usize = 128;

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

    /// Lets threads share the wide rows.
    fn share(&mut self) -> SharedRows<'_, W, L, P, C> {
        SharedRows {
            normals: SharedSlice::new(&mut self.normals),
            frictions: SharedSlice::new(&mut self.frictions),
            extras: SharedSlice::new(&mut self.extras),
            extras_before: &self.extras_before,
            features: SharedSlice::new(&mut self.features),
            sources: &self.sources,
        }
    }

    /// Whether some row may bounce.
    fn bounces(&self) -> bool {
        self.features[..self.sources.len()].iter().any(|features| features.restitution)
    }
}

/// Wide rows as the threads share them, run by run.
struct SharedRows<'a, W, const L: usize, const P: usize, const C: usize> {
    normals: SharedSlice<'a, NormalRow<W, L, P, C>>,
    frictions: SharedSlice<'a, FrictionRow<W, P>>,
    extras: SharedSlice<'a, ExtraRow<W, P>>,
    extras_before: &'a [u32],
    features: SharedSlice<'a, RowFeatures>,
    sources: &'a [(u32, u32)],
}

impl<W: Lanes<L>, const L: usize, const P: usize, const C: usize> SharedRows<'_, W, L, P, C> {
    /// The rows of a run.
    ///
    /// # Safety
    /// Runs held at the same time may not overlap.
    unsafe fn run(&self, run: Range<usize>) -> Rows<'_, W, L, P, C> {
        let (start, end) = (run.start, run.end);
        let extras_before = &self.extras_before[start..=end];
        let extras = (extras_before[0] as usize, extras_before[end - start] as usize);
        // SAFETY: runs do not overlap, by the caller's promise.
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

/// A run of wide rows.
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

/// The extra row of wide row `i` of a run, if it has one.
#[inline(always)]
fn extra_of<'a, E>(extras: &'a mut [E], before: &[u32], i: usize) -> Option<&'a mut E> {
    if before[i] == before[i + 1] { None } else { extras.get_mut((before[i] - before[0]) as usize) }
}

struct PrepareKernel<'a, W, const L: usize, const P: usize, const C: usize> {
    rows: Rows<'a, W, L, P, C>,
    plan: &'a [RowSource],
    context: &'a PrepareContext<'a>,
}

impl<W: Lanes<L>, const L: usize, const P: usize, const C: usize> Kernel for PrepareKernel<'_, W, L, P, C> {
    #[inline(always)]
    fn run(self) {
        let rows = self.rows;
        for (i, &(first, count)) in rows.sources.iter().enumerate() {
            if let Some(&(first, count)) = rows.sources.get(i + 1) {
                for source in &self.plan[first as usize..(first + count) as usize] {
                    prefetch(&self.context.arbiters[source.arbiter as usize]);
                }
            }
            let target = RowTarget {
                row: &mut rows.normals[i],
                friction: &mut rows.frictions[i],
                extra: extra_of(rows.extras, rows.extras_before, i),
                features: &mut rows.features[i],
            };
            let sources = &self.plan[first as usize..(first + count) as usize];
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
    rows: Rows<'a, W, L, P, C>,
    target: &'a StoreShared<'a>,
}

impl<W: Lanes<L>, const L: usize, const P: usize, const C: usize> Kernel for StoreKernel<'_, W, L, P, C> {
    #[inline(always)]
    fn run(self) {
        let (target, rows) = (self.target, self.rows);
        for (i, &(first, count)) in rows.sources.iter().enumerate() {
            if let Some(&(first, count)) = rows.sources.get(i + 1) {
                for source in &target.rows[first as usize..(first + count) as usize] {
                    target.arbiters.prefetch(source.arbiter as usize);
                }
            }
            let solved = SolvedRow {
                row: &rows.normals[i],
                friction: &rows.frictions[i],
                extra: extra_of(rows.extras, rows.extras_before, i).map(|extra| &*extra),
                features: rows.features[i],
            };
            // SAFETY: storing writes no states.
            let outcome = unsafe { read_row(&solved, &target.states, target.break_distance) };
            for lane in 0..count as usize {
                let row = first as usize + lane;
                let source = &target.rows[row];
                let arbiter = target.arbiters.at(source.arbiter as usize);
                // SAFETY: rows of one arbiter have different slots, and only one is the first.
                unsafe { store_lane(&outcome, &solved, lane, source, arbiter) };
                // SAFETY: each row belongs to one run alone.
                *unsafe { target.may_break.get_mut(row) } = outcome.excess[lane] > 0.0;
            }
        }
    }
}

struct PassKernel<'a, W, const L: usize, const P: usize, const C: usize> {
    rows: Rows<'a, W, L, P, C>,
    pass: Pass,
    states: &'a SharedStates<'a>,
    parameters: &'a PassParameters,
}

impl<W: Lanes<L>, const L: usize, const P: usize, const C: usize> Kernel for PassKernel<'_, W, L, P, C> {
    #[inline(always)]
    fn run(self) {
        let (rows, parameters) = (self.rows, self.parameters);
        for i in 0..rows.sources.len() {
            let row = RowPass {
                row: &mut rows.normals[i],
                friction: &mut rows.frictions[i],
                extra: extra_of(rows.extras, rows.extras_before, i),
                features: rows.features[i],
                states: self.states,
            };
            // SAFETY: rows of one colour share no dynamic body, and each run is one thread's.
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
    /// The rows of each group as threads share them; there may be more of them than groups.
    deals: Vec<Deal>,
    all: Deal,
    /// Whether some row may bounce.
    bounces: bool,
}

impl<I: Instructions, W: Lanes<L>, const L: usize> LaneSolver<I, W, L> {
    const fn new(level: I) -> Self {
        Self {
            level,
            serial: Vec::new(),
            deals: Vec::new(),
            all: Deal::EMPTY,
            bounces: false,
            one: RowSet::new(),
            two: RowSet::new(),
            four: RowSet::new(),
        }
    }
}

impl<I: Instructions, W: Lanes<L>, const L: usize> LaneSolver<I, W, L> {
    /// Lists the rows of each group, and of all, for as many threads.
    fn deal_rows(&mut self, threads: usize) {
        let sets = [&self.one.groups, &self.two.groups, &self.four.groups];
        let rows = |class: usize, group: usize| {
            let (start, end) = sets[class][group];
            start as usize..end as usize
        };
        self.all.clear();
        self.deals.resize(self.serial.len().max(self.deals.len()), Deal::EMPTY);
        for (group, deal) in self.deals.iter_mut().take(self.serial.len()).enumerate() {
            deal.clear();
            for thread in 0..threads {
                for class in (0..CLASSES).rev() {
                    deal.add(class, rows(class, group), (thread, threads));
                }
            }
        }
        if threads == 1 {
            let counts = [self.one.sources.len(), self.two.sources.len(), self.four.sources.len()];
            for class in (0..CLASSES).rev() {
                self.all.add(class, 0..counts[class], (0, 1));
            }
            return;
        }
        for thread in 0..threads {
            for group in 0..self.serial.len() {
                for class in (0..CLASSES).rev() {
                    self.all.add(class, rows(class, group), (thread, threads));
                }
            }
        }
    }
}

/// Calls `visit` with runs of a deal's rows: on all threads, or in order on this one where rows share bodies.
fn for_each_run<const L: usize>(
    deal: &Deal,
    serial: bool,
    pool: &mut StagePool,
    visit: impl Fn(usize, Range<usize>) + Sync,
) {
    if serial {
        deal.visit(0..deal.count(), visit);
    } else {
        pool.run_ranges(deal.count(), LEAST_CONTACTS.div_ceil(L), |items| deal.visit(items, &visit));
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
        self.deal_rows(pool.active_threads());
        let (level, plan) = (self.level, &plan.rows[..]);
        let (one, two, four) = (self.one.share(), self.two.share(), self.four.share());
        for_each_run::<L>(&self.all, false, pool, |class, run| {
            // SAFETY: each run is visited once.
            unsafe {
                match class {
                    0 => level.run(PrepareKernel { rows: one.run(run), plan, context }),
                    1 => level.run(PrepareKernel { rows: two.run(run), plan, context }),
                    _ => level.run(PrepareKernel { rows: four.run(run), plan, context }),
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
        let level = self.level;
        let (one, two, four) = (self.one.share(), self.two.share(), self.four.share());
        for_each_run::<L>(&self.deals[group], self.serial[group], pool, |class, run| {
            // SAFETY: each run is visited once.
            unsafe {
                match class {
                    0 => level.run(PassKernel { rows: one.run(run), pass, states, parameters }),
                    1 => level.run(PassKernel { rows: two.run(run), pass, states, parameters }),
                    _ => level.run(PassKernel { rows: four.run(run), pass, states, parameters }),
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
        pool.run_ranges(target.groups_of(L), LEAST_BODIES.div_ceil(L), |groups| {
            self.level.run(IntegrateKernel::<W, L> { target, groups, phase, parameters, lanes: PhantomData });
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
        let level = self.level;
        let (one, two, four) = (self.one.share(), self.two.share(), self.four.share());
        for_each_run::<L>(&self.all, false, pool, |class, run| {
            // SAFETY: each run is visited once.
            unsafe {
                match class {
                    0 => level.run(StoreKernel { rows: one.run(run), target: shared }),
                    1 => level.run(StoreKernel { rows: two.run(run), target: shared }),
                    _ => level.run(StoreKernel { rows: four.run(run), target: shared }),
                }
            }
        });
    }
}
