//! The solver for one lane count: its rows, and the stages over them.

use super::bodies::{BodyState, SharedStates, SolverBodies};
use super::coloring::{CLASSES, RowPlan, RowSource};
use super::prepare::{Outcome, PrepareContext, prepare_row, store_lane};
use super::rows::{FrictionRow, NormalRow};
use super::solve::{PassParameters, relax, restitute, solve, warm_start};
use crate::arbiter::Arbiter;
use crate::math::Real;
use crate::parallel::{SharedSlice, StagePool};
#[cfg(target_arch = "x86_64")]
use crate::simd::{Avx2, Avx512};
use crate::simd::{Baseline, Instructions, Kernel, SimdLevel};

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

    /// Writes impulses and gaps back to the arbiters; notes in `may_break` (by row of the plan) whose contacts to test.
    fn store(&mut self, target: StoreTarget<'_>, pool: &mut StagePool);
}

/// Where stored impulses go.
pub(crate) struct StoreTarget<'a> {
    pub plan: &'a RowPlan,
    pub arbiters: &'a mut [Arbiter],
    pub bodies: &'a SolverBodies,
    pub break_distance: Real,
    pub may_break: &'a mut [bool],
}

/// The solver for a level.
pub(crate) fn contact_solver(level: SimdLevel) -> Box<dyn ContactSolver> {
    match level {
        SimdLevel::Scalar => Box::new(LaneSolver::<Baseline, 1>::new(Baseline)),
        #[cfg(target_arch = "x86_64")]
        SimdLevel::Avx2 if let Some(avx2) = Avx2::detect() => Box::new(LaneSolver::<Avx2, 8>::new(avx2)),
        #[cfg(target_arch = "x86_64")]
        SimdLevel::Avx512 if let Some(avx512) = Avx512::detect() => Box::new(LaneSolver::<Avx512, 16>::new(avx512)),
        _ => Box::new(LaneSolver::<Baseline, 4>::new(Baseline)),
    }
}

/// Wide rows of one class.
struct RowSet<const L: usize, const P: usize, const C: usize> {
    normals: Vec<NormalRow<L, P, C>>,
    frictions: Vec<FrictionRow<L, P>>,
    /// First source of each wide row, and how many there are.
    sources: Vec<(u32, u32)>,
    /// Wide rows of each group.
    groups: Vec<(u32, u32)>,
}

impl<const L: usize, const P: usize, const C: usize> RowSet<L, P, C> {
    const fn new() -> Self {
        Self { normals: Vec::new(), frictions: Vec::new(), sources: Vec::new(), groups: Vec::new() }
    }

    /// Cuts the plan's rows of one class into wide rows; rows of a serial group stand alone.
    fn lay_out(&mut self, plan: &RowPlan, class: usize) {
        self.sources.clear();
        self.groups.clear();
        for group in &plan.groups {
            let first = self.sources.len() as u32;
            let (start, end) = group.ranges[class];
            let width = if group.serial { 1 } else { L as u32 };
            let mut at = start;
            while at < end {
                let count = width.min(end - at);
                self.sources.push((at, count));
                at += count;
            }
            self.groups.push((first, self.sources.len() as u32));
        }
        // Rows are overwritten whole by `prepare_row`: only new ones need a value.
        if self.normals.len() < self.sources.len() {
            self.normals.resize(self.sources.len(), NormalRow::EMPTY);
            self.frictions.resize(self.sources.len(), FrictionRow::EMPTY);
        }
    }

    fn prepare<I: Instructions>(
        &mut self,
        plan: &RowPlan,
        context: &PrepareContext<'_>,
        level: I,
        pool: &mut StagePool,
    ) {
        let count = self.sources.len();
        let normals = SharedSlice::new(&mut self.normals);
        let frictions = SharedSlice::new(&mut self.frictions);
        let sources = &self.sources;
        pool.run(count.div_ceil(ROWS_PER_BLOCK), |block| {
            let (start, end) = block_range(block, 0, count);
            // SAFETY: blocks do not overlap.
            let (normals, frictions) = unsafe { (normals.range_mut(start, end), frictions.range_mut(start, end)) };
            level.run(PrepareKernel { normals, frictions, sources: &sources[start..end], rows: &plan.rows, context });
        });
    }
}

/// Wide rows of a block.
fn block_range(block: usize, first: usize, last: usize) -> (usize, usize) {
    let start = first + block * ROWS_PER_BLOCK;
    (start, (start + ROWS_PER_BLOCK).min(last))
}

struct PrepareKernel<'a, const L: usize, const P: usize, const C: usize> {
    normals: &'a mut [NormalRow<L, P, C>],
    frictions: &'a mut [FrictionRow<L, P>],
    sources: &'a [(u32, u32)],
    rows: &'a [RowSource],
    context: &'a PrepareContext<'a>,
}

impl<const L: usize, const P: usize, const C: usize> Kernel for PrepareKernel<'_, L, P, C> {
    #[inline(always)]
    fn run(self) {
        for (i, &(first, count)) in self.sources.iter().enumerate() {
            let sources = &self.rows[first as usize..(first + count) as usize];
            prepare_row(&mut self.normals[i], &mut self.frictions[i], sources, self.context);
        }
    }
}

/// [`StoreTarget`] as the threads share it.
struct StoreShared<'a> {
    rows: &'a [RowSource],
    arbiters: SharedSlice<'a, Arbiter>,
    bodies: &'a SolverBodies,
    break_distance: Real,
    may_break: SharedSlice<'a, bool>,
}

struct StoreKernel<'a, const L: usize, const P: usize, const C: usize> {
    normals: &'a [NormalRow<L, P, C>],
    frictions: &'a [FrictionRow<L, P>],
    sources: &'a [(u32, u32)],
    target: &'a StoreShared<'a>,
}

impl<const L: usize, const P: usize, const C: usize> Kernel for StoreKernel<'_, L, P, C> {
    #[inline(always)]
    fn run(self) {
        let target = self.target;
        for (i, &(first, count)) in self.sources.iter().enumerate() {
            for lane in 0..count as usize {
                let row = first as usize + lane;
                let source = &target.rows[row];
                // SAFETY: rows of one arbiter share its bodies, so they stand in different groups, and groups are stored
                // one after the other; those of the serial group are stored by one thread.
                let arbiter = unsafe { target.arbiters.get_mut(source.arbiter as usize) };
                let outcome = store_lane(
                    (&self.normals[i], &self.frictions[i]),
                    lane,
                    source,
                    (arbiter, target.bodies),
                    target.break_distance,
                );
                // SAFETY: each row belongs to one block alone.
                *unsafe { target.may_break.get_mut(row) } = outcome == Outcome::MayBreak;
            }
        }
    }
}

struct PassKernel<'a, const L: usize, const P: usize, const C: usize> {
    normals: &'a mut [NormalRow<L, P, C>],
    frictions: &'a mut [FrictionRow<L, P>],
    pass: Pass,
    states: &'a SharedStates<'a>,
    parameters: &'a PassParameters,
}

impl<const L: usize, const P: usize, const C: usize> Kernel for PassKernel<'_, L, P, C> {
    #[inline(always)]
    fn run(self) {
        let rows = self.normals.iter_mut().zip(self.frictions.iter_mut());
        match self.pass {
            Pass::WarmStart => {
                for (row, friction) in rows {
                    // SAFETY: rows of one colour share no dynamic body, and each block runs on one thread.
                    unsafe { warm_start(row, friction, self.states) };
                }
            }
            Pass::Solve => {
                for (row, _) in rows {
                    // SAFETY: as above.
                    unsafe { solve(row, self.states, self.parameters) };
                }
            }
            Pass::Relax => {
                for (row, friction) in rows {
                    // SAFETY: as above.
                    unsafe { relax(row, friction, self.states, self.parameters) };
                }
            }
            Pass::Restitution => {
                for (row, friction) in rows {
                    // SAFETY: as above.
                    unsafe { restitute(row, friction, self.states, self.parameters) };
                }
            }
        }
    }
}

/// Rows for `L` lanes, by class.
struct LaneSolver<I, const L: usize> {
    level: I,
    one: RowSet<L, 1, 0>,
    two: RowSet<L, 2, 1>,
    four: RowSet<L, 4, 6>,
    /// Groups whose rows share bodies.
    serial: Vec<bool>,
}

impl<I: Instructions, const L: usize> LaneSolver<I, L> {
    const fn new(level: I) -> Self {
        Self { level, serial: Vec::new(), one: RowSet::new(), two: RowSet::new(), four: RowSet::new() }
    }
}

/// The wide rows of one class in one group, as the threads share them.
struct GroupRows<'a, const L: usize, const P: usize, const C: usize> {
    normals: SharedSlice<'a, NormalRow<L, P, C>>,
    frictions: SharedSlice<'a, FrictionRow<L, P>>,
    sources: &'a [(u32, u32)],
    range: (usize, usize),
}

impl<'a, const L: usize, const P: usize, const C: usize> GroupRows<'a, L, P, C> {
    fn new(set: &'a mut RowSet<L, P, C>, group: usize) -> Self {
        let (start, end) = set.groups[group];
        Self {
            normals: SharedSlice::new(&mut set.normals),
            frictions: SharedSlice::new(&mut set.frictions),
            sources: &set.sources,
            range: (start as usize, end as usize),
        }
    }

    fn blocks(&self) -> usize {
        (self.range.1 - self.range.0).div_ceil(ROWS_PER_BLOCK)
    }

    /// Runs a pass over one block.
    fn run<I: Instructions>(
        &self,
        block: usize,
        pass: Pass,
        states: &SharedStates<'_>,
        (level, parameters): (I, &PassParameters),
    ) {
        let (start, end) = block_range(block, self.range.0, self.range.1);
        // SAFETY: blocks do not overlap, and each is run once.
        let (normals, frictions) =
            unsafe { (self.normals.range_mut(start, end), self.frictions.range_mut(start, end)) };
        level.run(PassKernel { normals, frictions, pass, states, parameters });
    }

    /// Stores one block.
    fn store<I: Instructions>(&self, block: usize, level: I, target: &StoreShared<'_>) {
        let (start, end) = block_range(block, self.range.0, self.range.1);
        // SAFETY: blocks do not overlap, and each is run once.
        let (normals, frictions) =
            unsafe { (&*self.normals.range_mut(start, end), &*self.frictions.range_mut(start, end)) };
        level.run(StoreKernel { normals, frictions, sources: &self.sources[start..end], target });
    }
}

/// The three classes of a group.
struct Group<'a, const L: usize> {
    one: GroupRows<'a, L, 1, 0>,
    two: GroupRows<'a, L, 2, 1>,
    four: GroupRows<'a, L, 4, 6>,
}

impl<const L: usize> Group<'_, L> {
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

impl<I: Instructions, const L: usize> LaneSolver<I, L> {
    fn group(&mut self, group: usize) -> Group<'_, L> {
        Group {
            one: GroupRows::new(&mut self.one, group),
            two: GroupRows::new(&mut self.two, group),
            four: GroupRows::new(&mut self.four, group),
        }
    }
}

impl<I: Instructions, const L: usize> ContactSolver for LaneSolver<I, L> {
    fn prepare(&mut self, plan: &RowPlan, context: &PrepareContext<'_>, pool: &mut StagePool) {
        const { assert!(CLASSES == 3) };
        self.serial.clear();
        self.serial.extend(plan.groups.iter().map(|group| group.serial));
        self.one.lay_out(plan, 0);
        self.two.lay_out(plan, 1);
        self.four.lay_out(plan, 2);
        self.one.prepare(plan, context, self.level, pool);
        self.two.prepare(plan, context, self.level, pool);
        self.four.prepare(plan, context, self.level, pool);
    }

    fn pass(
        &mut self,
        group: usize,
        pass: Pass,
        states: &mut [BodyState],
        parameters: &PassParameters,
        pool: &mut StagePool,
    ) {
        let states = SharedSlice::new(states);
        let (common, serial) = ((self.level, parameters), self.serial[group]);
        let group = self.group(group);
        group.for_each_block(serial, pool, |class, block| match class {
            0 => group.one.run(block, pass, &states, common),
            1 => group.two.run(block, pass, &states, common),
            _ => group.four.run(block, pass, &states, common),
        });
    }

    fn store(&mut self, target: StoreTarget<'_>, pool: &mut StagePool) {
        let shared = StoreShared {
            rows: &target.plan.rows,
            arbiters: SharedSlice::new(target.arbiters),
            bodies: target.bodies,
            break_distance: target.break_distance,
            may_break: SharedSlice::new(target.may_break),
        };
        for index in 0..target.plan.groups.len() {
            let (level, serial) = (self.level, self.serial[index]);
            let group = self.group(index);
            group.for_each_block(serial, pool, |class, block| match class {
                0 => group.one.store(block, level, &shared),
                1 => group.two.store(block, level, &shared),
                _ => group.four.store(block, level, &shared),
            });
        }
    }
}
