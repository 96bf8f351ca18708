//! A pool of threads that share the stages of a step.
//!
//! A stage is a function over item numbers `0..count`: single ones ([`StagePool::run`]), or runs of them
//! ([`StagePool::run_ranges`]). The caller publishes it, each thread works off a *share* of the items, then helps with what is
//! left of the others' shares, and the caller returns when all items are done: both are barriers. Which thread takes which
//! item is left to chance, so a stage may only write what belongs to its items; then results do not depend on the number of
//! threads.
//!
//! Shares are of equal size, and the same whenever a stage has as many items as before: what a thread has written in one stage
//! it mostly finds in its own cache in the next. A thread takes its own items from the front, and those of others from the
//! back, so that the owner's next items stay its own to the last. Claims on one's own share touch a cache line that others
//! look at only in the end.
//!
//! Within a step the next stage is microseconds away: [`StagePool::begin_step`] wakes the workers, and they look for stages
//! until the step ends. Between steps they soon sleep on a condition variable. With one thread, and in a step with too little
//! to do for several, the pool is a plain loop. Source of the scheme: the stage scheduler of
//! BepuPhysics 2 and Box2D 3.

mod gather;
mod shared;

pub(crate) use gather::{BlockList, Gather};
pub(crate) use shared::SharedSlice;

use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicPtr, AtomicU32, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;

/// How many times an idle worker looks for the next stage before it sleeps, or within a step gives way to other programs;
/// about 50 µs.
const SPINS: u32 = 4000;

/// How many times it looks within a step before it sleeps all the same: a step may have ended in a panic.
const STEP_SPINS: u32 = 1 << 16;

/// Items that one claim word can count; a larger stage runs in batches.
const MAX_ITEMS: usize = 0xffff;

/// What is left of a share is taken in runs of this part of it: few claims, and small ones in the end, when others wait.
const CLAIM_PART: usize = 4;

/// A stage as the workers see it: a thin pointer to the closure and the function that calls it with a run of items.
struct Stage {
    data: *const (),
    call: unsafe fn(*const (), Range<usize>),
}

/// A value with cache lines of its own: two of them, since they are fetched in pairs.
#[repr(align(128))]
struct Padded<T>(T);

/// What is left of a thread's share of the items: stage number (32 bits), end (16) and next item (16) in one word, so that a
/// claim on an old stage finds its items used up and can never hit a new stage.
struct Share(AtomicU64);

impl Share {
    fn offer(&self, epoch: u32, start: usize, end: usize) {
        self.0.store(u64::from(epoch) << 32 | (end as u64) << 16 | start as u64, Ordering::Release);
    }

    /// Takes items of stage `epoch`: the first for the owner, the last for others. One at a time if `least` is zero, else a part
    /// of what is left but at least so many.
    fn claim(&self, epoch: u32, own: bool, least: usize) -> Option<Range<usize>> {
        let mut word = self.0.load(Ordering::Relaxed);
        loop {
            let (end, next) = ((word >> 16 & 0xffff) as usize, (word & 0xffff) as usize);
            if (word >> 32) as u32 != epoch || next >= end {
                return None;
            }
            let left = end - next;
            let count = if least == 0 { 1 } else { (left / CLAIM_PART).max(least).min(left) };
            let taken = if own { word + count as u64 } else { word - ((count as u64) << 16) };
            match self.0.compare_exchange_weak(word, taken, Ordering::AcqRel, Ordering::Relaxed) {
                Ok(_) => return Some(if own { next..next + count } else { end - count..end }),
                Err(changed) => word = changed,
            }
        }
    }
}

/// First item of a thread's share.
pub(crate) fn share_start(count: usize, thread: usize, threads: usize) -> usize {
    count * thread / threads
}

/// What the caller and the workers share.
struct Shared {
    /// By thread; the caller's comes first.
    shares: Box<[Padded<Share>]>,
    /// Items that workers have done.
    done: Padded<AtomicUsize>,
    epoch: Padded<AtomicU32>,
    /// The stage under way: lives while an item of it is not done.
    stage: AtomicPtr<Stage>,
    /// How many items to take at least: see [`Share::claim`].
    least: AtomicUsize,
    /// Workers that sleep, or are about to. Changed under the lock.
    sleepers: AtomicUsize,
    bed: Mutex<()>,
    wake: Condvar,
    /// Whether a step is under way.
    stepping: AtomicBool,
    quit: AtomicBool,
    panicked: AtomicBool,
}

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
            shares: (0..threads.max(1)).map(|_| Padded(Share(AtomicU64::new(0)))).collect(),
            done: Padded(AtomicUsize::new(0)),
            epoch: Padded(AtomicU32::new(0)),
            stage: AtomicPtr::new(std::ptr::null_mut()),
            least: AtomicUsize::new(0),
            sleepers: AtomicUsize::new(0),
            bed: Mutex::new(()),
            wake: Condvar::new(),
            stepping: AtomicBool::new(false),
            quit: AtomicBool::new(false),
            panicked: AtomicBool::new(false),
        });
        let workers = (1..threads)
            .filter_map(|number| {
                let shared = Arc::clone(&shared);
                // A thread that the system refuses is done without: the others take its share.
                std::thread::Builder::new().name("arbiter3d".into()).spawn(move || shared.work(number)).ok()
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
            // A stage without items: no claim succeeds on it.
            self.next_epoch();
            self.shared.announce(self.epoch);
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

    /// Calls `stage(item)` for every item in `0..count`, on all threads, and returns when all are done.
    pub fn run<F: Fn(usize) + Sync>(&mut self, count: usize, stage: F) {
        self.run_all(count, 0, |range| range.for_each(&stage));
    }

    /// As [`Self::run`], while one of the threads does `beside` as well: work for one thread that has nothing to do with the
    /// items, and would else leave the others without work. It comes first; a single thread does it before all items.
    pub fn run_beside<F: Fn(usize) + Sync>(&mut self, count: usize, stage: F, beside: impl FnOnce() + Send) {
        let beside = Mutex::new(Some(beside));
        self.run(count + 1, |item| match item.checked_sub(1) {
            Some(item) => stage(item),
            None => {
                let beside = beside.lock().unwrap_or_else(PoisonError::into_inner).take();
                beside.into_iter().for_each(|work| work());
            }
        });
    }

    /// Calls `stage` with runs of at least `least` items (but for the last of a share) that make up `0..count`, on all
    /// threads, and returns when all are done. A single thread gets all in one piece.
    pub fn run_ranges<F: Fn(Range<usize>) + Sync>(&mut self, count: usize, least: usize, stage: F) {
        self.run_all(count, least.max(1), stage);
    }

    fn run_all<F: Fn(Range<usize>) + Sync>(&mut self, count: usize, least: usize, stage: F) {
        if self.workers.is_empty() || self.alone || count <= least.max(1) {
            if count > 0 {
                stage(0..count);
            }
            return;
        }
        for first in (0..count).step_by(MAX_ITEMS) {
            let items = MAX_ITEMS.min(count - first);
            self.run_batch(items, least, |range: Range<usize>| stage(first + range.start..first + range.end));
        }
    }

    /// One batch of at most [`MAX_ITEMS`] items.
    fn run_batch<F: Fn(Range<usize>) + Sync>(&mut self, count: usize, least: usize, stage: F) {
        /// Calls the closure behind the pointer.
        ///
        /// # Safety
        /// `data` must point to a live `F`.
        unsafe fn call<F: Fn(Range<usize>) + Sync>(data: *const (), range: Range<usize>) {
            // SAFETY: promised by the caller.
            unsafe { (*data.cast::<F>())(range) }
        }
        self.next_epoch();
        let shared = &*self.shared;
        let mut published = Stage { data: (&raw const stage).cast(), call: call::<F> };
        shared.stage.store(&raw mut published, Ordering::Relaxed);
        shared.least.store(least, Ordering::Relaxed);
        shared.done.0.store(0, Ordering::Relaxed);
        let threads = shared.shares.len();
        for (thread, share) in shared.shares.iter().enumerate() {
            share.0.offer(self.epoch, share_start(count, thread, threads), share_start(count, thread + 1, threads));
        }
        shared.announce(self.epoch);
        let own = shared.take_items(self.epoch, 0);
        let mut spins = 0_u32;
        while shared.done.0.load(Ordering::Acquire) + own < count {
            spins += 1;
            if spins < SPINS { std::hint::spin_loop() } else { std::thread::yield_now() }
        }
        assert!(!shared.panicked.load(Ordering::Relaxed), "a solver thread panicked: this is a bug in arbiter3d");
    }

    /// As [`Self::run_ranges`], in one piece if there is no pool.
    pub fn run_ranges_of<F: Fn(Range<usize>) + Sync>(pool: Option<&mut Self>, count: usize, least: usize, stage: F) {
        match pool {
            Some(pool) => pool.run_ranges(count, least, stage),
            None if count > 0 => stage(0..count),
            None => {}
        }
    }

    fn next_epoch(&mut self) {
        self.epoch = self.epoch.wrapping_add(1);
    }
}

impl Drop for StagePool {
    fn drop(&mut self) {
        self.shared.quit.store(true, Ordering::SeqCst);
        self.next_epoch();
        self.shared.announce(self.epoch);
        for worker in self.workers.drain(..) {
            let _ = worker.join();
        }
    }
}

impl Shared {
    fn bed(&self) -> MutexGuard<'_, ()> {
        self.bed.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Makes a stage known to those who look for one, and wakes those who have given up.
    fn announce(&self, epoch: u32) {
        self.epoch.0.store(epoch, Ordering::SeqCst);
        // Either this sees the sleeper, or the sleeper sees the new stage: both sides write first, then read, in one order.
        if self.sleepers.load(Ordering::SeqCst) > 0 {
            let _guard = self.bed();
            self.wake.notify_all();
        }
    }

    /// Works off items of stage `epoch`, those of the thread's own share first, and returns their number.
    fn take_items(&self, epoch: u32, thread: usize) -> usize {
        let mut count = 0;
        let (threads, least) = (self.shares.len(), self.least.load(Ordering::Relaxed));
        for other in 0..threads {
            let share = &self.shares[(thread + other) % threads].0;
            while let Some(range) = share.claim(epoch, other == 0, least) {
                count += range.len();
                let call = std::panic::AssertUnwindSafe(|| {
                    // SAFETY: the claim succeeded on the current stage, so its caller is still waiting in `run_batch`: stage
                    // and closure are alive until these items have been counted.
                    unsafe {
                        let stage = &*self.stage.load(Ordering::Relaxed);
                        (stage.call)(stage.data, range);
                    }
                });
                if std::panic::catch_unwind(call).is_err() {
                    self.panicked.store(true, Ordering::Relaxed);
                }
            }
        }
        count
    }

    /// A worker's life.
    fn work(&self, thread: usize) {
        let mut seen = 0;
        loop {
            seen = self.await_epoch(seen);
            if self.quit.load(Ordering::SeqCst) {
                return;
            }
            let count = self.take_items(seen, thread);
            if count > 0 {
                self.done.0.fetch_add(count, Ordering::Release);
            }
        }
    }

    /// Waits until the stage number differs from `seen`.
    fn await_epoch(&self, seen: u32) -> u32 {
        let mut spins = 0;
        while spins < if self.stepping.load(Ordering::Relaxed) { STEP_SPINS } else { SPINS } {
            let epoch = self.epoch.0.load(Ordering::Acquire);
            if epoch != seen {
                return epoch;
            }
            spins += 1;
            if spins < SPINS { std::hint::spin_loop() } else { std::thread::yield_now() }
        }
        let mut guard = self.bed();
        self.sleepers.fetch_add(1, Ordering::SeqCst);
        loop {
            let epoch = self.epoch.0.load(Ordering::SeqCst);
            if epoch != seen {
                self.sleepers.fetch_sub(1, Ordering::SeqCst);
                return epoch;
            }
            guard = self.wake.wait(guard).unwrap_or_else(PoisonError::into_inner);
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
                while pool.shared.sleepers.load(Ordering::SeqCst) < 2 {
                    std::thread::yield_now();
                }
            }
        }
        assert_eq!(hits.load(Ordering::Relaxed), 300 * 5 * 7);
    }

    #[test]
    fn what_is_done_beside_a_stage_is_done_once() {
        for threads in [1, 2, 4] {
            let mut pool = StagePool::new(threads);
            for count in 0..200 {
                let hits: Vec<AtomicU32> = (0..count).map(|_| AtomicU32::new(0)).collect();
                let mut beside = 0;
                let hit = |item: usize| {
                    hits[item].fetch_add(1, Ordering::Relaxed);
                };
                pool.run_beside(count, hit, || beside += 1);
                assert!(beside == 1 && hits.iter().all(|hit| hit.load(Ordering::Relaxed) == 1));
            }
        }
    }

    #[test]
    fn runs_make_up_all_items_and_a_single_thread_gets_them_in_one_piece() {
        for (threads, least) in [(1, 3), (2, 1), (3, 4), (4, 100)] {
            let mut pool = StagePool::new(threads);
            for count in [0, 1, 5, 64, 1000, 70_000] {
                let hits: Vec<AtomicU32> = (0..count).map(|_| AtomicU32::new(0)).collect();
                let pieces = AtomicU32::new(0);
                pool.run_ranges(count, least, |range| {
                    pieces.fetch_add(1, Ordering::Relaxed);
                    for hit in &hits[range] {
                        hit.fetch_add(1, Ordering::Relaxed);
                    }
                });
                assert!(hits.iter().all(|hit| hit.load(Ordering::Relaxed) == 1));
                assert!(threads > 1 && count > least || pieces.into_inner() == u32::from(count > 0));
            }
        }
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
