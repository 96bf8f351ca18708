//! Which rows are solved together: greedy graph colouring.
//!
//! Rows of one colour share no dynamic body, so they can be solved in lanes and on threads in any order with the same result.
//! The rows come in key order and each takes the lowest colour free at both its bodies, a set of colours being one `u64` a
//! body; but colours come in twos, and which of the two counts as the lower one is drawn for each row (see [`first_choice`]).
//! Rows with only one dynamic body need no search: the n-th such row of a body takes the n-th *static colour*. Static
//! colours are solved last, so that the ground has the final say. A row that finds no colour (a body with more than
//! [`DYNAMIC_COLORS`] dynamic neighbours) goes to the overflow, solved one row at a time before the rest.
//!
//! The colours are made anew each step: 15,000 rows take about 0.1 ms, and the result depends on the contacts alone, not on
//! how they came about.

use super::bodies::SolverBodies;
use crate::arbiter::{Arbiter, ArbiterKey, Entry, ONE_NORMAL, SLOTS};
use crate::math::Vec3;
use crate::place_table::mix;
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

/// Which of two neighbouring colours a row takes first: the lower one (0) or the upper one (1).
///
/// Bodies are mostly numbered as they stand. Were it always the lower one, the contacts to one side of all bodies would be
/// solved before those to the other side, and what the passes leave unsolved would push all the same way: a triangle of 100
/// rows leaned by 0.4 m while it settled, and swayed on.
///
/// Drawn from how far the two numbers of the key are apart, so that worlds whose numbers start elsewhere are solved alike.
fn first_choice(key: ArbiterKey) -> u32 {
    (mix(mix(0, key.key2.wrapping_sub(key.key1)), 0) >> 63) as u32
}

/// The lowest free colour, where `first` swaps the two colours of each pair. `free` must have one.
fn nearest_color(free: u64, first: u32) -> u32 {
    const LOWER: u64 = 0x5555_5555_5555_5555;
    let swapped = if first == 0 { free } else { (free & LOWER) << 1 | (free >> 1 & LOWER) };
    swapped.trailing_zeros() ^ first
}

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
            let first = first_choice(arbiter.key);
            let color = nearest_color(free, first);
            let bit = 1 << color;
            self.used[a] |= bit;
            self.used[b] |= bit;
            1 + color as u8
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_choice_swaps_the_colors_of_each_two() {
        assert_eq!((nearest_color(!0, 0), nearest_color(!0, 1)), (0, 1));
        assert_eq!((nearest_color(0b1101, 0), nearest_color(0b1101, 1)), (0, 0));
        assert_eq!((nearest_color(0b1110, 0), nearest_color(0b1110, 1)), (1, 1));
        assert_eq!((nearest_color(0b1100, 0), nearest_color(0b1100, 1)), (2, 3));
        assert_eq!((nearest_color(1 << 63, 0), nearest_color(1 << 63, 1)), (63, 63));
    }

    /// Rows between neighbours of numbers `n` apart: half of all `n` choose one way, and so do half of those next to them.
    #[test]
    fn neither_choice_is_favored() {
        let choice = |apart: u64| first_choice(ArbiterKey::new(7, 7 + apart));
        let upper: u32 = (1..=1000).map(choice).sum();
        let changes = (1..=1000).filter(|&apart| choice(apart) != choice(apart + 2)).count();
        assert!((450..550).contains(&upper) && (400..600).contains(&changes), "{upper}, {changes}");
        assert_eq!(choice(5), first_choice(ArbiterKey::new(1007, 1012)), "only the distance counts");
    }
}
