//! Which rows are solved together: greedy graph colouring.
//!
//! Rows of one colour share no dynamic body, so they can be solved in lanes and on threads in any order with the same result.
//! The rows come in key order and each takes the lowest colour free at both its bodies; a set of colours is one `u64` a body.
//! Rows with only one dynamic body need no search: the n-th such row of a body takes the n-th *static colour*. Static
//! colours are solved last, so that the ground has the final say. A row that finds no colour (a body with more than
//! [`DYNAMIC_COLORS`] dynamic neighbours) goes to the overflow, solved one row at a time before the rest.
//!
//! The colours are made anew each step: 15,000 rows take about 0.1 ms, and the result depends on the contacts alone, not on
//! how they came about.

use super::bodies::SolverBodies;
use crate::arbiter::{Arbiter, Entry, ONE_NORMAL, SLOTS};
use crate::math::Vec3;
use crate::storage;

/// Colours for rows between two dynamic bodies.
const DYNAMIC_COLORS: usize = 64;
/// Colours for rows with one dynamic body.
const STATIC_COLORS: usize = 64;
/// The overflow's place in the order.
const OVERFLOW: u8 = 0;
/// All groups of rows: the overflow, the dynamic colours, the static colours.
const GROUPS: usize = 1 + DYNAMIC_COLORS + STATIC_COLORS;

/// How many arbiters ahead of their use they are asked for.
const PREFETCH_AHEAD: usize = 8;

/// Contacts of one arbiter that share a normal: what becomes one lane of a row.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RowSource {
    pub arbiter: u32,
    /// Which slots, as bits.
    pub slots: u8,
    /// Whether rolling resistance acts here: once an arbiter.
    pub first: bool,
    /// Whether the arbiter asks for what few rows need, or a body of it has a locked axis: see
    /// [`super::rows::ExtraRow`].
    pub extra: bool,
    color: u8,
}

impl RowSource {
    /// No row: an empty lane.
    pub const NONE: Self = Self { arbiter: u32::MAX, slots: 0, first: false, extra: false, color: 0 };

    /// By its number of points: one, two, up to four.
    fn class(self) -> usize {
        match self.slots.count_ones() {
            1 => 0,
            2 => 1,
            _ => 2,
        }
    }
}

/// Rows with one, two or up to four points are kept apart, so that a sphere's contact does not carry four.
pub(crate) const CLASSES: usize = 3;

/// One group of rows: `ranges[class]` of [`RowPlan::rows`].
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct RowGroup {
    pub ranges: [(u32, u32); CLASSES],
    /// Rows share bodies: solve them one by one.
    pub serial: bool,
    /// One body of each row is not dynamic.
    pub fixed: bool,
}

/// All rows of a step in solving order.
#[derive(Debug, Default)]
pub(crate) struct RowPlan {
    pub rows: Vec<RowSource>,
    pub groups: Vec<RowGroup>,
    unsorted: Vec<RowSource>,
    /// Colours in use at each body, by body slot; zero between steps.
    used: Vec<u64>,
    /// Static colours in use at each body.
    fixed_rows: Vec<u8>,
}

impl RowPlan {
    /// Collects the rows of the awake arbiters and colours them.
    pub fn build(&mut self, order: &[Entry], arbiters: &mut [Arbiter], bodies: &mut SolverBodies) {
        self.used.resize(bodies.states.len(), 0);
        self.fixed_rows.resize(bodies.states.len(), 0);
        self.unsorted.clear();
        storage::reserve(&mut self.unsorted, order.len());
        for (i, &Entry { index, .. }) in order.iter().enumerate() {
            if let Some(&Entry { index: later, .. }) = order.get(i + PREFETCH_AHEAD) {
                crate::simd::prefetch(&arbiters[later as usize].body1);
                crate::simd::prefetch(&arbiters[later as usize].data.usage_mask);
            }
            let arbiter = &mut arbiters[index as usize];
            arbiter.data.mark_solved();
            if arbiter.data.usage_mask & 15 != 0 {
                self.add_rows(index, arbiter, bodies);
            }
        }
        self.sort();
        for row in &self.unsorted {
            let arbiter = &arbiters[row.arbiter as usize];
            for body in [arbiter.body1.index as usize, arbiter.body2.index as usize] {
                self.used[body] = 0;
                self.fixed_rows[body] = 0;
            }
        }
    }

    /// Splits an arbiter into groups of equal normal and mode; each is a row.
    fn add_rows(&mut self, index: u32, arbiter: &Arbiter, bodies: &mut SolverBodies) {
        let data = &arbiter.data;
        let locked = |body: u32| bodies.states[body as usize].locked != 0;
        let extra = data.restitution > 0.0
            || data.rolling_resistance > 0.0
            || data.tangent_velocity != Vec3::ZERO
            || locked(arbiter.body1.index)
            || locked(arbiter.body2.index);
        if data.flags & ONE_NORMAL != 0 {
            let slots = data.usage_mask & 15;
            let color = self.color(arbiter, bodies);
            self.unsorted.push(RowSource { arbiter: index, slots, first: true, extra, color });
            return;
        }
        let mut left = data.usage_mask & 15;
        let mut first = true;
        while left != 0 {
            let lead = &data.slots[left.trailing_zeros() as usize];
            let mut slots = 0;
            for slot in 0..SLOTS {
                let contact = &data.slots[slot];
                let same = contact.remove == lead.remove && contact.normal == lead.normal;
                slots |= u8::from(same && left >> slot & 1 == 1) << slot;
            }
            // A normal that is not equal to itself cannot occur (validated), but must not loop.
            slots |= left & left.wrapping_neg();
            left &= !slots;
            let color = self.color(arbiter, bodies);
            self.unsorted.push(RowSource { arbiter: index, slots, first, extra, color });
            first = false;
        }
    }

    fn color(&mut self, arbiter: &Arbiter, bodies: &mut SolverBodies) -> u8 {
        let (a, b) = (arbiter.body1.index as usize, arbiter.body2.index as usize);
        let (a_moves, b_moves) = (bodies.states[a].moves != 0, bodies.states[b].moves != 0);
        bodies.states[a].constrained = 1.0;
        bodies.states[b].constrained = 1.0;
        if a_moves && b_moves {
            let free = !(self.used[a] | self.used[b]);
            if free == 0 {
                return OVERFLOW;
            }
            let bit = free & free.wrapping_neg();
            self.used[a] |= bit;
            self.used[b] |= bit;
            1 + free.trailing_zeros() as u8
        } else {
            let body = if a_moves { a } else { b };
            let nth = self.fixed_rows[body];
            if nth as usize >= STATIC_COLORS {
                return OVERFLOW;
            }
            self.fixed_rows[body] += 1;
            (1 + DYNAMIC_COLORS) as u8 + nth
        }
    }

    /// Counting sort by colour and class; equal ones keep their key order.
    fn sort(&mut self) {
        let mut counts = [0_u32; GROUPS * CLASSES + 1];
        for row in &self.unsorted {
            counts[row.color as usize * CLASSES + row.class() + 1] += 1;
        }
        for i in 1..counts.len() {
            counts[i] += counts[i - 1];
        }
        self.groups.clear();
        for group in 0..GROUPS {
            let range = |class: usize| (counts[group * CLASSES + class], counts[group * CLASSES + class + 1]);
            if range(0).0 < range(CLASSES - 1).1 {
                self.groups.push(RowGroup {
                    ranges: std::array::from_fn(range),
                    serial: group == OVERFLOW as usize,
                    fixed: group > DYNAMIC_COLORS,
                });
            }
        }
        self.rows.clear();
        storage::reserve(&mut self.rows, self.unsorted.len());
        self.rows.resize(self.unsorted.len(), RowSource::NONE);
        for row in &self.unsorted {
            let next = &mut counts[row.color as usize * CLASSES + row.class()];
            self.rows[*next as usize] = *row;
            *next += 1;
        }
    }
}
