//! How the wide rows of a step are dealt to the threads.
//!
//! Each class of each group is cut into as many parts as there are threads. The rows of a stage are listed part by part, so
//! that the equal shares of [`StagePool::run_ranges`] hold about as many rows of each class, and a thread meets the same part
//! of the contacts, and so mostly the same bodies, in all groups, when they are prepared, and when they are stored. Rows come
//! in the order of their shapes' ids: a part is a neighbourhood in most scenes.

use crate::parallel::share_start;
use crate::storage;
use std::ops::Range;

#[cfg(doc)]
use crate::parallel::StagePool;

/// Wide rows `rows` of a class, listed from `item` on.
#[derive(Clone, Debug)]
struct Run {
    item: usize,
    class: usize,
    rows: Range<usize>,
}

/// Wide rows in the order in which a stage lists them.
#[derive(Clone, Debug, Default)]
pub(super) struct Deal {
    runs: Vec<Run>,
    count: usize,
}

impl Deal {
    pub const EMPTY: Self = Self { runs: Vec::new(), count: 0 };

    /// How many rows there are.
    pub fn count(&self) -> usize {
        self.count
    }

    pub fn clear(&mut self) {
        self.runs.clear();
        self.count = 0;
    }

    /// Adds the part of a class's rows that belongs to a thread.
    pub fn add(&mut self, class: usize, rows: Range<usize>, (thread, threads): (usize, usize)) {
        let start = rows.start + share_start(rows.len(), thread, threads);
        let end = rows.start + share_start(rows.len(), thread + 1, threads);
        if start < end {
            storage::push(&mut self.runs, Run { item: self.count, class, rows: start..end });
            self.count += end - start;
        }
    }

    /// Calls `visit` with the classes and rows listed in `items`.
    #[inline]
    pub fn visit(&self, items: Range<usize>, visit: impl Fn(usize, Range<usize>)) {
        let first = self.runs.partition_point(|run| run.item + run.rows.len() <= items.start);
        for run in &self.runs[first..] {
            if run.item >= items.end {
                return;
            }
            let start = run.rows.start + items.start.max(run.item) - run.item;
            let end = run.rows.end.min(run.rows.start + items.end - run.item);
            visit(run.class, start..end);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::RefCell;

    /// Two classes among three threads: however the items are cut, each row is visited once, and a third of the items holds a
    /// third of each class.
    #[test]
    fn any_cut_visits_each_row_once_and_parts_hold_their_share_of_each_class() {
        let mut deal = Deal::default();
        for thread in 0..3 {
            deal.add(2, 10..40, (thread, 3));
            deal.add(0, 5..17, (thread, 3));
            deal.add(1, 8..8, (thread, 3));
        }
        assert_eq!(deal.count(), 42);
        for piece in [1, 4, 14, 42] {
            let seen = RefCell::new([[0; 40]; 3]);
            for start in (0..42).step_by(piece) {
                let classes = RefCell::new([0; 3]);
                deal.visit(start..(start + piece).min(42), |class, rows| {
                    classes.borrow_mut()[class] += rows.len();
                    rows.for_each(|row| seen.borrow_mut()[class][row] += 1);
                });
                assert!(piece != 14 || classes.into_inner() == [4, 0, 10]);
            }
            let seen = seen.into_inner();
            for (class, rows) in [(0, 5..17), (1, 0..0), (2, 10..40)] {
                assert!((0..40).all(|row| seen[class][row] == i32::from(rows.contains(&row))));
            }
        }
    }
}
