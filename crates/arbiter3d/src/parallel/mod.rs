//! A pool of threads that share the stages of a step.
//!
//! A stage is a function over block numbers `0..count`. The caller publishes it, every thread claims blocks from one atomic
//! counter, and the caller returns when all blocks are done: `run` is a barrier. Which thread takes which block is left to
//! chance, so a stage may only write what belongs to its block; then results do not depend on the number of threads.
//!
//! Within a step the next stage is microseconds away: [`StagePool::begin_step`] wakes the workers, and they look for stages
//! until the step ends. Between steps they soon sleep on a condition variable. With one thread, and in a step with too little
//! to do for several, the pool is a plain loop. Source of the scheme: the stage scheduler of
//! BepuPhysics 2 and Box2D 3.

mod gather;
mod shared;

pub(crate) use gather::{BlockList, Gather};
pub(crate) use shared::SharedSlice;

use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex};
use std::thread::JoinHandle;

/// How many times an idle worker looks for the next stage before it sleeps, or within a step gives way to other programs;
/// about 50 µs.
const SPINS: u32 = 4000;

/// How many times it looks within a step before it sleeps all the same: a step may have ended in a panic.
const STEP_SPINS: u32 = 1 << 16;

/// Blocks that one claim word can count; a larger stage runs in batches.
const MAX_BLOCKS: usize = 0xffff;

/// A stage as the workers see it: a thin pointer to the closure and the function that calls it with a block number.
#[derive(Clone, Copy)]
struct Stage {
    data: *const (),
    call: unsafe fn(*const (), usize),
}

/// What the caller and the workers share.
struct Shared {
    /// Stage number (32 bits), number of blocks (16) and next block (16) in one word: a claim on an old stage finds its
    /// blocks used up and can never hit a new stage.
    claim: AtomicU64,
    done: AtomicUsize,
    stage: Mutex<Option<Stage>>,
    epoch: AtomicU32,
    sleepers: Mutex<usize>,
    wake: Condvar,
    /// Whether a step is under way.
    stepping: AtomicBool,
    quit: AtomicBool,
    panicked: AtomicBool,
}

// SAFETY: `Stage` is a pointer to a `Sync` closure that outlives the stage: `StagePool::run` does not return before
// every claimed block is done, and no block of it can be claimed after that (the stage number differs).
unsafe impl Send for Shared {}
// SAFETY: as above; all fields but the pointer are atomics or locks.
unsafe impl Sync for Shared {}

/// Threads that run stages together with the caller.
pub(crate) struct StagePool {
    shared: Arc<Shared>,
    workers: Vec<JoinHandle<()>>,
    epoch: u32,
    /// Whether the caller works alone for now.
    alone: bool,
}

impl std::fmt::Debug for StagePool {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("StagePool").field("threads", &self.threads()).finish()
    }
}

impl StagePool {
    /// A pool of `threads` threads, the caller included.
    pub fn new(threads: usize) -> Self {
        let shared = Arc::new(Shared {
            claim: AtomicU64::new(0),
            done: AtomicUsize::new(0),
            stage: Mutex::new(None),
            epoch: AtomicU32::new(0),
            sleepers: Mutex::new(0),
            wake: Condvar::new(),
            stepping: AtomicBool::new(false),
            quit: AtomicBool::new(false),
            panicked: AtomicBool::new(false),
        });
        let workers = (1..threads)
            .filter_map(|_| {
                let shared = Arc::clone(&shared);
                // A thread that the system refuses is done without: results do not depend on it.
                std::thread::Builder::new().name("arbiter3d".into()).spawn(move || shared.work()).ok()
            })
            .collect();
        Self { shared, workers, epoch: 0, alone: false }
    }

    /// Threads that take part, the caller included.
    pub fn threads(&self) -> usize {
        self.workers.len() + 1
    }

    /// A step begins, in which the workers help if there is enough to do for them.
    pub fn begin_step(&mut self, enough: bool) {
        self.alone = !enough || self.workers.is_empty();
        if !self.alone {
            self.shared.stepping.store(true, Ordering::SeqCst);
            // A stage without blocks: no claim succeeds on it.
            self.epoch = self.epoch.wrapping_add(1);
            self.shared.epoch.store(self.epoch, Ordering::SeqCst);
            self.wake_sleepers();
        }
    }

    /// The step is over: the workers may sleep.
    pub fn end_step(&mut self) {
        self.alone = false;
        self.shared.stepping.store(false, Ordering::SeqCst);
    }

    /// Threads that take part in the stages of this step.
    pub fn active_threads(&self) -> usize {
        if self.alone { 1 } else { self.threads() }
    }

    /// Calls `stage(block)` for every block in `0..count`, on all threads, and returns when all are done.
    pub fn run<F: Fn(usize) + Sync>(&mut self, count: usize, stage: F) {
        if self.workers.is_empty() || self.alone || count <= 1 {
            (0..count).for_each(stage);
            return;
        }
        for first in (0..count).step_by(MAX_BLOCKS) {
            self.run_batch(MAX_BLOCKS.min(count - first), |block| stage(first + block));
        }
    }

    /// One batch of at most [`MAX_BLOCKS`] blocks.
    fn run_batch<F: Fn(usize) + Sync>(&mut self, count: usize, stage: F) {
        /// Calls the closure behind the pointer.
        ///
        /// # Safety
        /// `data` must point to a live `F`.
        unsafe fn call<F: Fn(usize) + Sync>(data: *const (), block: usize) {
            // SAFETY: promised by the caller.
            unsafe { (*data.cast::<F>())(block) }
        }
        self.epoch = self.epoch.wrapping_add(1);
        let shared = &*self.shared;
        let published = Stage { data: (&raw const stage).cast(), call: call::<F> };
        *shared.stage.lock().unwrap_or_else(std::sync::PoisonError::into_inner) = Some(published);
        shared.done.store(0, Ordering::Relaxed);
        shared.claim.store(u64::from(self.epoch) << 32 | (count as u64) << 16, Ordering::Release);
        shared.epoch.store(self.epoch, Ordering::SeqCst);
        self.wake_sleepers();
        shared.take_blocks(self.epoch, published);
        let mut spins = 0_u32;
        while shared.done.load(Ordering::Acquire) < count {
            spins += 1;
            if spins < SPINS { std::hint::spin_loop() } else { std::thread::yield_now() }
        }
        assert!(!shared.panicked.load(Ordering::Relaxed), "a solver thread panicked: this is a bug in arbiter3d");
    }

    /// Wakes the workers that gave up spinning.
    fn wake_sleepers(&self) {
        let sleepers = self.shared.sleepers.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if *sleepers > 0 {
            self.shared.wake.notify_all();
        }
    }
}

impl Drop for StagePool {
    fn drop(&mut self) {
        self.shared.quit.store(true, Ordering::SeqCst);
        self.shared.epoch.fetch_add(1, Ordering::SeqCst);
        {
            let _guard = self.shared.sleepers.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
            self.shared.wake.notify_all();
        }
        for worker in self.workers.drain(..) {
            let _ = worker.join();
        }
    }
}

impl Shared {
    /// Claims blocks of stage `epoch` until none is left.
    fn take_blocks(&self, epoch: u32, stage: Stage) {
        loop {
            let claim = self.claim.load(Ordering::Acquire);
            let (count, block) = ((claim >> 16 & 0xffff) as usize, (claim & 0xffff) as usize);
            if (claim >> 32) as u32 != epoch || block >= count {
                return;
            }
            if self.claim.compare_exchange_weak(claim, claim + 1, Ordering::AcqRel, Ordering::Relaxed).is_ok() {
                let call = std::panic::AssertUnwindSafe(|| {
                    // SAFETY: the claim succeeded on the current stage, so its caller is still waiting in `run` and the
                    // closure is alive.
                    unsafe { (stage.call)(stage.data, block) }
                });
                if std::panic::catch_unwind(call).is_err() {
                    self.panicked.store(true, Ordering::Relaxed);
                }
                self.done.fetch_add(1, Ordering::Release);
            }
        }
    }

    /// A worker's life.
    fn work(&self) {
        let mut seen = 0;
        loop {
            let epoch = self.next_epoch(seen);
            if self.quit.load(Ordering::SeqCst) {
                return;
            }
            seen = epoch;
            let stage = *self.stage.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
            if let Some(stage) = stage {
                // The stage read may be a later one than `epoch`; then the blocks of `epoch` are used up and nothing is
                // taken here.
                self.take_blocks(epoch, stage);
            }
        }
    }

    /// Waits until the stage number differs from `seen`.
    fn next_epoch(&self, seen: u32) -> u32 {
        let mut spins = 0;
        while spins < if self.stepping.load(Ordering::Relaxed) { STEP_SPINS } else { SPINS } {
            let epoch = self.epoch.load(Ordering::SeqCst);
            if epoch != seen {
                return epoch;
            }
            spins += 1;
            if spins < SPINS { std::hint::spin_loop() } else { std::thread::yield_now() }
        }
        let mut sleepers = self.sleepers.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        *sleepers += 1;
        loop {
            let epoch = self.epoch.load(Ordering::SeqCst);
            if epoch != seen {
                *sleepers -= 1;
                return epoch;
            }
            sleepers = self.wake.wait(sleepers).unwrap_or_else(std::sync::PoisonError::into_inner);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn workers_sleep_between_steps_and_help_within() {
        let mut pool = StagePool::new(3);
        let hits = AtomicU32::new(0);
        for step in 0..300 {
            pool.begin_step(step % 3 != 0);
            assert_eq!(pool.active_threads(), if step % 3 == 0 { 1 } else { 3 });
            for _ in 0..5 {
                pool.run(7, |_| {
                    hits.fetch_add(1, Ordering::Relaxed);
                });
            }
            pool.end_step();
            if step % 100 == 99 {
                while *pool.shared.sleepers.lock().unwrap() < 2 {
                    std::thread::yield_now();
                }
            }
        }
        assert_eq!(hits.load(Ordering::Relaxed), 300 * 5 * 7);
    }

    #[test]
    fn every_block_runs_exactly_once_in_thousands_of_stages() {
        for threads in [1, 2, 5] {
            let mut pool = StagePool::new(threads);
            for round in 0..2000 {
                let count = round % 17;
                let hits: Vec<AtomicU32> = (0..count).map(|_| AtomicU32::new(0)).collect();
                pool.run(count, |block| {
                    hits[block].fetch_add(1, Ordering::Relaxed);
                });
                assert!(hits.iter().all(|h| h.load(Ordering::Relaxed) == 1));
            }
        }
    }
}
