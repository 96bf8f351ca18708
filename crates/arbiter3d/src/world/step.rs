//! The step, phase by phase.

use super::World;
use super::bodies::world_inverse_inertia;
use super::collide::shapes_overlap;
use super::continuous::{FastBody, KinematicBody, MOST_TURN};
use super::pairs::PairRules;
use super::timings::{Phase, PhaseClock, Timings};
use crate::arbiter::{Arbiter, Entry, NONE};
use crate::broad_phase::Boxes;
use crate::error::{Error, in_range};
use crate::id::BodyId;
use crate::math::{Aabb, Pose, Real, Vec3, min};
use crate::parallel::{BlockList, Gather, SharedSlice};
use crate::solver::{
    BodyMass, BodyMotion, BodyState, IntegrateParameters, IntegrateTarget, Integration, Pass, PassParameters,
    PrepareContext, RowPart, Softness, SquareScale, StoreTarget,
};
use std::sync::atomic::{AtomicBool, Ordering};

/// Overlap of the most heavily loaded contact at rest, in slops. A light body under a heavy pile would sink deeper into its
/// soft springs: to 3 cm, measured on 1,000 mixed bodies.
const DEEPEST_REST: Real = 1.97;
/// Bodies that a thread takes at a time at least: of many shapes each, a few are much work.
const LEAST_BODIES: usize = 8;
/// Bodies whose forces a thread looks at at a time.
const BODIES_PER_BLOCK: usize = 64;
/// What a thread's list of what it has found has room for from the start.
const NEWS_PER_THREAD: usize = 64;

/// Rows whose contacts a thread looks at at a time.
const ROWS_PER_BLOCK: usize = 512;
/// Arbiters without contacts that a thread looks at at a time.
const EMPTY_PER_BLOCK: usize = 16;
/// Parts of the search for pairs for each thread: they differ in size.
const PARTS_PER_THREAD: usize = 16;

/// Awake bodies, pairs and arbiters from which on a step uses several threads: below, waiting for each other costs more.
const WORK_FOR_THREADS: usize = 1500;
/// Milliseconds of the last step from which on threads pay off, however few the bodies; and down to which they do, where they
/// took part in that step.
const TIME_FOR_THREADS: [f64; 2] = [0.1, 0.07];

/// Stiffest spring of a contact, as a share of the substep rate: past it, tall stacks ring.
const MAX_CONTACT_RATE: Real = 0.1875;

/// What a step has to report beyond events.
///
/// ```
/// let mut world = arbiter3d::World::default();
/// let report = world.step(1.0 / 60.0)?;
/// assert!(report.frozen.is_empty());
/// # Ok::<(), arbiter3d::Error>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct StepReport {
    /// Bodies that went non-finite in this step: put back to their last finite pose and stopped, until they are set free by
    /// setting their pose or velocity.
    pub frozen: Vec<BodyId>,
}

/// What a body's finalizing has to tell.
#[derive(Clone, Copy, Debug)]
enum BodyNews {
    /// The body may have passed through something.
    Fast(FastBody),
    /// The body may have if it is a kinematic one at rest; how far its points have come at most.
    Passing(FastBody, Real),
    /// The same of a bullet.
    Bullet(FastBody),
    /// The body has moved, and there are bullets.
    Moved(FastBody),
    /// The body went non-finite.
    Broken(u32),
}

/// Buffers of the step, kept from one to the next.
#[derive(Debug, Default)]
pub(crate) struct StepScratch {
    pairs: Vec<(u32, u32)>,
    may_break: Vec<bool>,
    /// Whether the last step was done on several threads.
    shared: bool,
    news: Gather<BodyNews>,
    /// Bodies that may have passed something.
    fast: Vec<FastBody>,
    /// Bullets that may have, and the other bodies that have moved while there are bullets.
    bullets: Vec<FastBody>,
    movers: Vec<FastBody>,
    kinematic: Vec<KinematicBody>,
    /// Shapes whose boxes have left their fat boxes in this step, then all that have since the last narrow phase.
    left: Gather<u32>,
    moved: Vec<u32>,
    /// Arbiters that have lost their last contact, then whether they end.
    broken: Gather<u32>,
    over: Vec<bool>,
    /// Whether a body has rested long enough to sleep.
    pub any_rested: bool,
    /// Pairs that several threads have found.
    found: Gather<(u32, u32)>,
    /// Bodies that this step integrates.
    sorted_awake: Vec<u32>,
    /// Memory for the list with the woken ones.
    admitted: Vec<u32>,
}

impl StepScratch {
    /// Has the next narrow phase test the pairs of a shape.
    pub fn note_moved(&mut self, slot: u32) {
        self.moved.push(slot);
    }
}

impl World {
    /// Advances the world by `dt` seconds. Zero, or less than a nanosecond, does nothing.
    ///
    /// # Errors
    /// If `dt` is not finite, negative, or longer than a second.
    pub fn step(&mut self, dt: Real) -> Result<StepReport, Error> {
        in_range("dt", dt, 0.0, 1.0)?;
        let mut report = StepReport::default();
        if dt < 1e-9 {
            return Ok(report);
        }
        self.dt = dt;
        self.impacts.clear();
        if self.is_at_rest() {
            self.events.begin_step();
            self.events.end_step();
            self.timings = Timings::default();
            return Ok(report);
        }
        let mut clock = PhaseClock::start();
        let work = self.awake.len() + self.active_pairs.len() + self.arbiters.order().len();
        // Few bodies can be much work too: meshes. What the last step took tells.
        let enough = TIME_FOR_THREADS[usize::from(self.scratch.shared)];
        self.scratch.shared = work >= WORK_FOR_THREADS || self.timings.total() > enough;
        self.pool.begin_step(self.scratch.shared);
        self.events.begin_step();
        self.flush_events();
        self.apply_forces();
        self.find_pairs();
        clock.mark(Phase::BroadPhase);
        self.collide_pairs(dt);
        self.call_providers();
        clock.mark(Phase::NarrowPhase);
        self.raise_begin();
        self.raise_pre_solve();
        self.admit_woken();
        self.note_closing();
        clock.mark(Phase::BeginEvents);
        self.plan_rows();
        clock.mark(Phase::Coloring);
        self.prepare_rows();
        clock.mark(Phase::Prepare);
        self.solve(dt);
        clock.mark(Phase::Solve);
        self.store_rows();
        let hits = self.events.hit.events.len();
        self.note_hits();
        clock.mark(Phase::Store);
        self.finalize(dt, &mut report);
        clock.mark(Phase::Finalize);
        self.end_broken();
        self.raise_hits(hits);
        self.flush_events();
        clock.mark(Phase::EndEvents);
        self.sleep_islands();
        self.events.end_step();
        self.pool.end_step();
        clock.mark(Phase::Sleep);
        self.timings = clock.finish();
        #[cfg(debug_assertions)]
        if let Err(broken) = self.validate_quick() {
            unreachable!("the world is inconsistent after a step, a bug in arbiter3d: {broken}");
        }
        Ok(report)
    }

    /// Whether a step would change nothing: all sleep, nothing has been moved, and nobody has anything to be told. The
    /// clock alone would take longer than such a step.
    fn is_at_rest(&self) -> bool {
        self.awake.is_empty()
            && !self.awake_changed
            && self.active_pairs.len() == 0
            && self.arbiters.are_asleep()
            && !self.broad_phase.has_moved()
            && self.scratch.moved.is_empty()
            && self.resting_sensors.is_empty()
            && self.providers.is_empty()
            && self.removals.is_empty()
            && self.events.are_told()
    }

    /// Lists the awake bodies and turns gravity and their forces into this step's accelerations; beside that, the trees are
    /// made ready for the search.
    fn apply_forces(&mut self) {
        if std::mem::take(&mut self.awake_changed) {
            let list = &mut self.scratch.sorted_awake;
            list.clone_from(&self.awake);
            list.sort_unstable();
        }
        let awake = &self.scratch.sorted_awake;
        let gravity = self.settings.gravity;
        let bodies = SharedSlice::new(&mut self.bodies);
        let states = SharedSlice::new(&mut self.solver_bodies.states);
        let motions = SharedSlice::new(&mut self.solver_bodies.motions);
        let masses = &self.solver_bodies.masses;
        let (blocks, broad_phase) = (awake.len().div_ceil(BODIES_PER_BLOCK), &mut self.broad_phase);
        let accelerate_block = |block: usize| {
            let start = block * BODIES_PER_BLOCK;
            for &body in &awake[start..(start + BODIES_PER_BLOCK).min(awake.len())] {
                let index = body as usize;
                // SAFETY: a body stands in the list once.
                let (body, state, motion) =
                    unsafe { (bodies.get_mut(index), states.get_mut(index), motions.get_mut(index)) };
                accelerate(body, (state, motion, &masses[index]), gravity);
            }
        };
        self.pool.run_beside(blocks, accelerate_block, || {
            if broad_phase.has_moved() {
                broad_phase.tighten();
            }
        });
    }

    /// Lets bodies that contacts have woken take part in the step in full, and drops those that listeners have removed. What
    /// is solved but not integrated would lose the impulses that it is warm started with.
    fn admit_woken(&mut self) {
        if !std::mem::take(&mut self.awake_changed) {
            return;
        }
        let mut list = std::mem::take(&mut self.scratch.admitted);
        list.clone_from(&self.awake);
        list.sort_unstable();
        for &index in &list {
            if self.scratch.sorted_awake.binary_search(&index).is_err() {
                let at = index as usize;
                let solver = &mut self.solver_bodies;
                let records = (&mut solver.states[at], &mut solver.motions[at], &solver.masses[at]);
                accelerate(&mut self.bodies[at], records, self.settings.gravity);
            }
        }
        std::mem::swap(&mut list, &mut self.scratch.sorted_awake);
        self.scratch.admitted = list;
    }

    /// Finds the pairs of shapes that have moved.
    fn find_pairs(&mut self) {
        if !self.broad_phase.has_moved() {
            return;
        }
        let mut found = std::mem::take(&mut self.scratch.pairs);
        self.search_pairs(&mut found);
        if !self.still_news.is_empty() {
            self.find_still_sensors(&mut found);
        }
        found.retain(|&(a, b)| self.passes_pair_filter(a, b));
        self.add_pairs(&found);
        found.clear();
        self.scratch.pairs = found;
    }

    /// The pairs that are new, sorted.
    fn search_pairs(&mut self, found: &mut Vec<(u32, u32)>) {
        let rules = PairRules { shapes: &self.shapes, bodies: &self.bodies };
        // A filter of the user's own may have changed its mind about a pair that it has rejected.
        let (pair_set, trust) = (&self.pair_set, self.filters.pair.is_none());
        let is_new = |a: u32, b: u32, known: bool| !(known && trust || pair_set.contains(a, b)) && rules.may_pair(a, b);
        let threads = self.pool.active_threads();
        if threads == 1 {
            self.broad_phase.find_pairs(is_new, found);
            return;
        }
        self.scratch.found.prepare(threads, NEWS_PER_THREAD);
        self.broad_phase.prepare(PARTS_PER_THREAD * threads);
        let (broad_phase, gather) = (&self.broad_phase, &self.scratch.found);
        let work = broad_phase.work();
        self.pool.run(work.len(), |block| {
            let mut list = gather.block();
            broad_phase.pairs_of(&work[block], is_new, |a, b| list.push((a, b)));
        });
        found.append(self.scratch.found.list());
        self.broad_phase.finish(found, Some(&mut self.pool));
    }

    fn call_providers(&mut self) {
        let mut providers = std::mem::take(&mut self.providers);
        for provider in &mut providers {
            provider.provide(&mut super::events::StepContext::new(self));
        }
        self.providers = providers;
        for shape in self.scratch.moved.drain(..) {
            self.moved_shapes[shape as usize] = false;
        }
    }

    fn plan_rows(&mut self) {
        self.arbiters.awake_by_key(Some(&mut self.pool));
        let (order, arbiters) = self.arbiters.order_and_slots_mut();
        self.plan.build(order, arbiters, &self.solver_bodies, &mut self.pool);
    }

    fn prepare_rows(&mut self) {
        let context = PrepareContext {
            arbiters: self.arbiters.slots(),
            bodies: &self.solver_bodies,
            speculative_distance: self.scaled.speculative_distance,
        };
        self.solver.prepare(&self.plan, &context, &mut self.pool);
    }

    /// The substeps, then restitution.
    fn solve(&mut self, dt: Real) {
        let settings = self.scaled;
        let substep = dt / settings.substeps as Real;
        let hertz = min(settings.contact_hertz, MAX_CONTACT_RATE / substep);
        let pass = |softness: Softness| PassParameters {
            inverse_substep: 1.0 / substep,
            push_out_speed: settings.push_out_speed,
            deepest_rest: if settings.slop > 0.0 { DEEPEST_REST * settings.slop } else { 1e6 },
            softness,
            restitution_threshold: settings.restitution_threshold,
            squares: SquareScale::new(settings.length_unit),
        };
        // Against the ground twice as stiff: what stands on it has the weight of all above.
        let soft = pass(Softness::new(hertz, settings.contact_damping_ratio, substep));
        let stiff = pass(Softness::new(2.0 * hertz, 0.5 * settings.contact_damping_ratio, substep));
        let integrate = IntegrateParameters {
            substep,
            max_linear_speed: settings.max_linear_speed,
            max_angular_speed: MOST_TURN / substep,
        };
        for index in 0..settings.substeps {
            let first = index == 0;
            self.integrate(if first { Integration::FirstVelocities } else { Integration::Velocities }, &integrate);
            if first {
                self.run_pass(Pass::WarmStart, &soft, &stiff);
            }
            self.run_pass(Pass::Solve, &soft, &stiff);
            self.integrate(Integration::Positions, &integrate);
            self.run_pass(Pass::Relax, &soft, &stiff);
        }
        self.run_pass(Pass::Restitution, &soft, &stiff);
    }

    fn run_pass(&mut self, pass: Pass, soft: &PassParameters, stiff: &PassParameters) {
        for (index, group) in self.plan.groups.iter().enumerate() {
            let parameters = if group.fixed { stiff } else { soft };
            self.solver.pass(index, pass, &mut self.solver_bodies.states, parameters, &mut self.pool);
        }
    }

    fn integrate(&mut self, phase: Integration, parameters: &IntegrateParameters) {
        let target = IntegrateTarget::new(&self.scratch.sorted_awake, &mut self.solver_bodies, &self.plan);
        self.solver.integrate(phase, target, parameters, &mut self.pool);
    }

    /// Impulses back to the arbiters. Whose contacts may have broken is noted.
    fn store_rows(&mut self) {
        let mut may_break = std::mem::take(&mut self.scratch.may_break);
        may_break.clear();
        may_break.resize(self.plan.rows.len(), false);
        let target = StoreTarget {
            plan: &self.plan,
            arbiters: self.arbiters.slots_mut(),
            states: &mut self.solver_bodies.states,
            break_distance: self.scaled.contact_break_distance,
            may_break: &mut may_break,
        };
        self.solver.store(target, &mut self.pool);
        self.scratch.may_break = may_break;
    }

    /// New poses, boxes and rest times; then continuous collision for the fast.
    fn finalize(&mut self, dt: Real, report: &mut StepReport) {
        let mut gather = std::mem::take(&mut self.scratch.news);
        let mut left = std::mem::take(&mut self.scratch.left);
        gather.prepare(self.pool.threads(), NEWS_PER_THREAD);
        left.prepare(self.pool.threads(), NEWS_PER_THREAD);
        self.finalize_bodies(dt, &gather, &left);
        // Before the fast: a body that is stopped short moves its boxes back. In any order: the tree comes out the same.
        self.broad_phase.lift(left.list(), Some(&mut self.pool));
        self.scratch.moved.append(left.list());
        self.scratch.left = left;
        let news = gather.list();
        // Threads report in any order; the report must not depend on it.
        news.sort_unstable_by_key(|item| match *item {
            BodyNews::Broken(body) => (0, body),
            BodyNews::Fast(fast) | BodyNews::Passing(fast, _) => (1, fast.index),
            BodyNews::Bullet(fast) => (2, fast.index),
            BodyNews::Moved(fast) => (3, fast.index),
        });
        let mut fast = std::mem::take(&mut self.scratch.fast);
        let mut bullets = std::mem::take(&mut self.scratch.bullets);
        let mut movers = std::mem::take(&mut self.scratch.movers);
        let mut resting = None;
        for item in news.drain(..) {
            match item {
                BodyNews::Passing(body, traveled) => {
                    let resting = resting.get_or_insert_with(|| self.list_resting_kinematic());
                    fast.extend(self.may_pass(&body, traveled, resting).then_some(body));
                }
                BodyNews::Broken(body) => {
                    self.freeze(body);
                    report.frozen.push(self.body_id(body));
                }
                BodyNews::Fast(body) => fast.push(body),
                BodyNews::Bullet(body) => bullets.push(body),
                BodyNews::Moved(body) => movers.push(body),
            }
        }
        self.scratch.kinematic = resting.unwrap_or_else(|| std::mem::take(&mut self.scratch.kinematic));
        self.stop_at_impacts(&mut fast);
        self.fly_bullets(&bullets, &movers);
        [&mut fast, &mut bullets, &mut movers].into_iter().for_each(Vec::clear);
        (self.scratch.fast, self.scratch.bullets, self.scratch.movers) = (fast, bullets, movers);
        self.scratch.news = gather;
    }

    fn finalize_bodies(&mut self, dt: Real, news: &Gather<BodyNews>, left: &Gather<u32>) {
        let mut kinematic = std::mem::take(&mut self.scratch.kinematic);
        self.list_kinematic_bodies(true, &mut kinematic);
        let awake = &self.scratch.sorted_awake;
        let world = FinalizeContext {
            shapes: &self.shapes,
            boxes: self.broad_phase.boxes(),
            moved: SharedSlice::new(&mut self.moved_shapes),
            settings: &self.scaled,
            any_bullets: !self.bullets.is_empty(),
            kinematic: &kinematic,
            any_resting: self.kinematic.len() > self.awake_kinematic.len(),
            dt,
        };
        let rested = AtomicBool::new(false);
        let bodies = SharedSlice::new(&mut self.bodies);
        let states = SharedSlice::new(&mut self.solver_bodies.states);
        let motions = SharedSlice::new(&mut self.solver_bodies.motions);
        let masses = SharedSlice::new(&mut self.solver_bodies.masses);
        self.pool.run_ranges(awake.len(), LEAST_BODIES, |range| {
            let mut found = (news.block(), left.block());
            let mut any_rested = false;
            for &index in &awake[range] {
                let at = index as usize;
                // SAFETY: a body stands in the list once.
                let (body, state, motion, mass) =
                    unsafe { (bodies.get_mut(at), states.get_mut(at), motions.get_mut(at), masses.get_mut(at)) };
                world.finalize_body(index, (body, state, motion, mass), &mut found);
                any_rested |= body.sleep_time >= world.settings.time_to_sleep;
            }
            if any_rested {
                rested.store(true, Ordering::Relaxed);
            }
        });
        self.scratch.any_rested = rested.into_inner();
        self.scratch.kinematic = kinematic;
    }

    /// The kinematic bodies at rest. They are listed when the first body of a step asks: where nothing is fast they cost
    /// nothing, however many there are.
    fn list_resting_kinematic(&mut self) -> Vec<KinematicBody> {
        let mut resting = std::mem::take(&mut self.scratch.kinematic);
        self.list_kinematic_bodies(false, &mut resting);
        resting
    }

    /// Whether a body, none of whose points has come farther than `traveled`, may have passed through one of some kinematic
    /// bodies.
    fn may_pass(&self, fast: &FastBody, traveled: Real, kinematic: &[KinematicBody]) -> bool {
        let body = &self.bodies[fast.index as usize];
        let center = self.solver_bodies.masses[fast.index as usize].center;
        let own = (traveled, body.reach, 0.5 * body.inner_radius);
        kinematic.iter().any(|other| other.may_be_passed(center, own))
    }

    /// Puts a body that went non-finite back to its last finite pose and stops it.
    fn freeze(&mut self, index: u32) {
        let state = &mut self.solver_bodies.states[index as usize];
        (state.linear_velocity, state.angular_velocity) = (Vec3::ZERO, Vec3::ZERO);
        self.solver_bodies.motions[index as usize].broken = 0.0;
        self.bodies[index as usize].frozen = true;
        self.refresh_solver_body(index);
        self.clear_contacts_of(index);
    }

    /// Drops contacts past the break distance and ends arbiters that have none left and whose shapes do not overlap.
    fn end_broken(&mut self) {
        let mut empty = std::mem::take(&mut self.narrow.empty);
        self.break_contacts(&mut empty);
        let custom = if self.arbiters.custom > 0 { self.arbiters.order() } else { &[] };
        for &Entry { index, .. } in custom {
            let arbiter = self.arbiters.at(index);
            if arbiter.alive && arbiter.pair == NONE && arbiter.data.usage_mask & 15 == 0 {
                empty.push(index);
            }
        }
        empty.sort_unstable();
        empty.dedup();
        self.keep_overlapping(&mut empty);
        self.end_separated(&empty);
        empty.clear();
        self.narrow.empty = empty;
    }

    /// Drops contacts past the break distance; arbiters that have none left are appended to `empty`, in no particular order.
    fn break_contacts(&mut self, empty: &mut Vec<u32>) {
        self.scratch.broken.prepare(self.pool.threads(), NEWS_PER_THREAD);
        let (rows, may_break) = (&self.plan.rows, &self.scratch.may_break);
        let (broken, masses) = (&self.scratch.broken, &self.solver_bodies.masses);
        let break_distance = self.scaled.contact_break_distance;
        let break_one = |arbiter: &mut Arbiter| {
            let [pose1, pose2] = [arbiter.body1, arbiter.body2].map(|body| masses[body.index as usize].pose());
            arbiter.data.break_contacts(&pose1, &pose2, break_distance);
            arbiter.data.usage_mask & 15 == 0
        };
        let arbiters = SharedSlice::new(self.arbiters.slots_mut());
        self.pool.run(rows.len().div_ceil(ROWS_PER_BLOCK), |block| {
            let mut found = broken.block();
            let range = block * ROWS_PER_BLOCK..((block + 1) * ROWS_PER_BLOCK).min(rows.len());
            for (row, _) in rows[range.clone()].iter().zip(&may_break[range]).filter(|(_, may_break)| **may_break) {
                // Where the arbiter has other rows, they may be another thread's at this moment: it has to wait.
                let is_over = row.part != RowPart::Only || {
                    // SAFETY: the arbiter has this row alone.
                    break_one(unsafe { arbiters.get_mut(row.arbiter as usize) })
                };
                if is_over {
                    found.push(row.arbiter);
                }
            }
        });
        // No other thread is at work here.
        let (found, arbiters) = (self.scratch.broken.list(), self.arbiters.slots_mut());
        found.retain(|&index| {
            let arbiter = &mut arbiters[index as usize];
            arbiter.data.usage_mask & 15 == 0 || break_one(arbiter)
        });
        empty.append(found);
    }

    /// Takes out of a list of arbiters without contacts those that go on: their shapes overlap, or they are gone already.
    fn keep_overlapping(&mut self, empty: &mut Vec<u32>) {
        let mut over = std::mem::take(&mut self.scratch.over);
        over.clear();
        over.resize(empty.len(), false);
        let (arbiters, pairs, shapes, bodies) = (&self.arbiters, &self.pairs, &self.shapes, &self.bodies);
        let (list, flags) = (&*empty, SharedSlice::new(&mut over));
        self.pool.run(list.len().div_ceil(EMPTY_PER_BLOCK), |block| {
            let first = block * EMPTY_PER_BLOCK;
            for (at, &index) in list.iter().enumerate().skip(first).take(EMPTY_PER_BLOCK) {
                let arbiter = arbiters.at(index);
                let without = arbiter.alive && arbiter.data.usage_mask & 15 == 0;
                let ends =
                    without && (arbiter.pair == NONE || !shapes_overlap(&pairs[arbiter.pair as usize], shapes, bodies));
                // SAFETY: each place belongs to one block.
                unsafe { *flags.get_mut(at) = ends };
            }
        });
        let mut flags = over.iter();
        empty.retain(|&index| {
            let ends = *flags.next().unwrap_or(&false);
            let arbiter = self.arbiters.at(index);
            if !ends && arbiter.alive && arbiter.pair != NONE && arbiter.data.usage_mask & 15 == 0 {
                self.pairs[arbiter.pair as usize].has_manifold = false;
            }
            ends
        });
        self.scratch.over = over;
    }
}

/// What finalizing a body reads.
struct FinalizeContext<'a> {
    shapes: &'a [super::shapes::ShapeSlot],
    boxes: Boxes<'a>,
    /// By shape: whether its proxy has moved.
    moved: SharedSlice<'a, bool>,
    settings: &'a super::WorldSettings,
    /// Whether there are bullets.
    any_bullets: bool,
    /// The kinematic bodies that are awake, and whether there are others.
    kinematic: &'a [KinematicBody],
    any_resting: bool,
    dt: Real,
}

impl FinalizeContext<'_> {
    fn finalize_body(
        &self,
        index: u32,
        (body, state, motion, mass): (&mut super::bodies::Body, &mut BodyState, &mut BodyMotion, &mut BodyMass),
        (news, left): &mut (BlockList<'_, BodyNews>, BlockList<'_, u32>),
    ) {
        let center = mass.center + state.translation;
        let finite = center.is_finite()
            && mass.rotation.is_finite()
            && state.linear_velocity.is_finite()
            && state.angular_velocity.is_finite();
        if motion.broken > 0.0 || !finite {
            news.push(BodyNews::Broken(index));
            return;
        }
        let began = std::mem::replace(&mut mass.center, center);
        let rotation = mass.rotation.to_mat3();
        if body.is_dynamic() && !body.frozen {
            mass.inverse_inertia = world_inverse_inertia(&rotation, motion, body.locked_axes.free().1);
        }
        let start = Pose::new(began, body.pose.rotation);
        body.pose.rotation = mass.rotation;
        body.pose.position = center - rotation * body.mass.center;
        let speed = state.linear_velocity.length() + body.surface_speed(rotation.transpose() * state.angular_velocity);
        let rests =
            if motion.kinematic > 0.0 { speed == 0.0 } else { body.can_sleep && speed < self.settings.sleep_speed };
        body.sleep_time = if rests { body.sleep_time + self.dt } else { 0.0 };
        let traveled = state.translation.length() + state.turn.length() * (body.reach - body.inner_radius);
        if self.settings.continuous && traveled > self.least_way(body) {
            self.note_fast(FastBody { index, start }, body, (state, traveled), news);
        }
        for &slot in &body.shape_slots {
            let shape = &self.shapes[slot as usize];
            let lever = if shape.centered { Vec3::ZERO } else { rotation * shape.middle };
            let velocity = state.linear_velocity + state.angular_velocity.cross(lever);
            self.update_box(slot, body, velocity * self.dt, left);
        }
    }

    /// How far a body has to move to be noticed: half its inner radius, less where bullets have to know where it was.
    #[inline(always)]
    fn least_way(&self, body: &super::bodies::Body) -> Real {
        let own = 0.5 * body.inner_radius;
        if self.any_bullets { min(self.settings.slop, own) } else { own }
    }

    /// Tells of a body that may have passed through something.
    #[inline(always)]
    fn note_fast(
        &self,
        fast: FastBody,
        body: &super::bodies::Body,
        (state, traveled): (&BodyState, Real),
        news: &mut BlockList<'_, BodyNews>,
    ) {
        let thickness = 0.5 * body.inner_radius;
        let swept = body.continuous && traveled > thickness;
        if body.bullet && swept {
            news.push(BodyNews::Bullet(fast));
            return;
        }
        if self.any_bullets {
            news.push(BodyNews::Moved(fast));
        }
        if body.is_dynamic() && swept {
            if self.may_pass(body, fast.start.position, (state.translation, traveled)) {
                news.push(BodyNews::Fast(fast));
            } else if self.any_resting {
                news.push(BodyNews::Passing(fast, traveled));
            }
        }
    }

    /// Whether a body, none of whose points has come farther than `traveled`, may have passed through something other than a
    /// kinematic body at rest.
    fn may_pass(&self, body: &super::bodies::Body, start: Vec3, (translation, traveled): (Vec3, Real)) -> bool {
        let (center, own) = (start + translation, (traveled, body.reach, 0.5 * body.inner_radius));
        self.kinematic.iter().any(|other| other.may_be_passed(center, own))
            || self.meets_static(body, center, translation)
    }

    /// Whether a body may have met a static shape on its way.
    ///
    /// In continuous collision a shape turns about its own middle, which goes straight. So no point comes farther from the way
    /// of the centre of mass than three times the reach: once from there to that middle, twice across the body.
    fn meets_static(&self, body: &super::bodies::Body, center: Vec3, translation: Vec3) -> bool {
        let way = Aabb::from_points([center - translation, center]);
        self.boxes.meets_static(&way.expand(3.0 * body.reach + self.settings.speculative_distance))
    }

    /// Reports a shape whose box has left its fat box. Boxes of fast shapes reach ahead, so that what they will touch within
    /// the next step is found now.
    fn update_box(&self, slot: u32, body: &super::bodies::Body, displacement: Vec3, left: &mut BlockList<'_, u32>) {
        let shape = &self.shapes[slot as usize];
        let tight = shape.geometry.aabb(&body.pose.mul(&shape.pose));
        let speculative = self.settings.speculative_distance;
        let ahead = displacement.length();
        let reach = if ahead > speculative {
            displacement * (min(ahead, shape.geometry.inner_radius() + speculative) / ahead)
        } else {
            Vec3::ZERO
        };
        let tight = tight.sweep(reach);
        let near = tight.expand(speculative);
        let fat = || near.expand(min(shape.creep, 2.5 * speculative));
        // SAFETY: a shape belongs to one body, which stands in the list of bodies once.
        if unsafe { self.boxes.update(slot, &near, fat) } {
            left.push(slot);
            // SAFETY: as above.
            unsafe { *self.moved.get_mut(slot as usize) = true };
        }
    }
}

/// Turns gravity and the forces on a body into its accelerations, and starts its motion of this step at zero.
fn accelerate(
    body: &mut super::bodies::Body,
    (state, motion, mass): (&mut BodyState, &mut BodyMotion, &BodyMass),
    gravity: Vec3,
) {
    let (free, _) = body.locked_axes.free();
    let dynamic = motion.kinematic == 0.0 && !body.frozen;
    let gravity = gravity * body.gravity_scale * free;
    motion.acceleration = if dynamic { gravity + mass.inverse_mass * body.force } else { Vec3::ZERO };
    motion.angular_acceleration = if dynamic { mass.inverse_inertia.mul(body.torque) } else { Vec3::ZERO };
    (body.force, body.torque) = (Vec3::ZERO, Vec3::ZERO);
    (state.translation, state.turn, state.constrained) = (Vec3::ZERO, Vec3::ZERO, 0.0);
}
