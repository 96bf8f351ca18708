//! What the blocks of a stage have to tell, gathered in one list without allocating in steady state.
//!
//! A block that has something to tell borrows a spare list, fills it without a lock, and hands it over when it ends. Blocks
//! come in any order: whoever reads the list sorts it first.

use crate::storage::{self, Peak};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The gathered list, and spare ones for blocks to borrow.
#[derive(Debug)]
pub(crate) struct Gather<T> {
    state: Mutex<State<T>>,
}

#[derive(Debug)]
struct State<T> {
    list: Vec<T>,
    spares: Vec<Vec<T>>,
    peak: Peak,
}

impl<T> Default for Gather<T> {
    fn default() -> Self {
        Self { state: Mutex::new(State { list: Vec::new(), spares: Vec::new(), peak: Peak::default() }) }
    }
}

impl<T> Gather<T> {
    fn lock(&self) -> MutexGuard<'_, State<T>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Begins a stage: sets a spare list aside for each thread, with room for `capacity` entries, and gives back memory that
    /// the stage has not needed of late.
    pub fn prepare(&mut self, threads: usize, capacity: usize) {
        let state = self.state.get_mut().unwrap_or_else(PoisonError::into_inner);
        if let Some(count) = state.peak.end_step() {
            storage::shrink(&mut state.list, count);
        }
        while state.spares.len() < threads {
            state.spares.push(Vec::with_capacity(capacity));
        }
    }

    /// The list of one block.
    pub fn block(&self) -> BlockList<'_, T> {
        BlockList { gather: self, entries: None }
    }

    /// All that was gathered, in no particular order.
    pub fn list(&mut self) -> &mut Vec<T> {
        &mut self.state.get_mut().unwrap_or_else(PoisonError::into_inner).list
    }
}

/// Where a block puts what it has to tell; handed over when it is dropped.
#[derive(Debug)]
pub(crate) struct BlockList<'a, T> {
    gather: &'a Gather<T>,
    entries: Option<Vec<T>>,
}

impl<T> BlockList<'_, T> {
    /// Adds an entry.
    #[inline]
    pub fn push(&mut self, entry: T) {
        self.entries.get_or_insert_with(|| self.gather.lock().spares.pop().unwrap_or_default()).push(entry);
    }
}

impl<T> Drop for BlockList<'_, T> {
    fn drop(&mut self) {
        if let Some(mut entries) = self.entries.take() {
            let mut state = self.gather.lock();
            let count = state.list.len() + entries.len();
            state.peak.note(count);
            storage::reserve(&mut state.list, count);
            state.list.append(&mut entries);
            state.spares.push(entries);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_entry_of_every_block_arrives_once_and_lists_are_used_again() {
        let mut pool = crate::parallel::StagePool::new(3);
        let mut gather = Gather::default();
        for _ in 0..50 {
            gather.prepare(pool.threads(), 8);
            pool.run(40, |block| {
                let mut found = gather.block();
                (0..block % 5).for_each(|i| found.push(block * 10 + i));
            });
            let list = gather.list();
            list.sort_unstable();
            let wanted: Vec<usize> = (0..40).flat_map(|block| (0..block % 5).map(move |i| block * 10 + i)).collect();
            assert_eq!(*list, wanted);
            list.clear();
            assert_eq!(gather.lock().spares.len(), 3);
        }
    }
}
