//! Which rows are solved together: greedy graph colouring.
//!
//! Rows of one colour share no dynamic body, so they can be solved in lanes and on threads in any order with the same result.
//! The rows come in key order and each takes the lowest colour free at both its bodies, a set of colours being one `u64` a
//! body; but colours come in twos, and which of the two counts as the lower one is drawn for each row (see [`first_choice`]).
//! Rows with only one dynamic body need no search: the n-th such row of a body takes the n-th *static colour*. Static
//! colours are solved last, so that the ground has the final say. A row that finds no colour (a body with more than
//! [`DYNAMIC_COLORS`] dynamic neighbours) goes to the overflow, solved one row at a time before the rest.
//!
//! The colours depend on the contacts alone, not on how these came about. Each colour depends on those given before: one
//! thread gives them all. So threads first gather what that needs in short records, in key order. Where all records are those
//! of the step before, as in a pile at rest, so are the colours.

use super::bodies::SolverBodies;
use crate::arbiter::{ANISOTROPIC, Arbiter, ArbiterKey, ContactData, Entry, HIDDEN, ONE_NORMAL, SLOTS};
use crate::math::Vec3;
use crate::parallel::{SharedSlice, StagePool};
use crate::place_table::mix;
use crate::storage;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};

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
/// Arbiters that a thread looks at at a time at least.
const LEAST_ARBITERS: usize = 128;

/// Which of its arbiter's rows a row is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum RowPart {
    Only,
    First,
    Later,
}

/// Contacts of one arbiter that share a normal: what becomes one lane of a row.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RowSource {
    pub arbiter: u32,
    /// Which slots, as bits.
    pub slots: u8,
    pub part: RowPart,
    /// Whether the arbiter asks for what few rows need, or a body of it has a locked axis: see
    /// [`super::rows::ExtraRow`].
    pub extra: bool,
    color: u8,
}

impl RowSource {
    /// No row: an empty lane.
    pub const NONE: Self = Self { arbiter: u32::MAX, slots: 0, part: RowPart::Later, extra: false, color: 0 };

    /// Whether the rolling impulse of the last step goes on here, and is told from here: once an arbiter.
    #[inline(always)]
    pub fn is_first(self) -> bool {
        self.part != RowPart::Later
    }

    /// By colour, then by its number of points: one, two, up to four.
    #[inline(always)]
    fn place(self) -> usize {
        self.color as usize * CLASSES + (self.slots.count_ones() as usize - 1).min(CLASSES - 1)
    }
}

/// What colouring needs to know of an arbiter.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Record {
    bodies: [u32; 2],
    arbiter: u32,
    /// The slots of each of its rows, four bits a row, the first lowest; zero after the last.
    rows: u16,
    /// Which bodies move.
    moves: [bool; 2],
    extra: bool,
    /// Which of two colours its rows take first.
    first: u8,
}

impl Record {
    const NONE: Self = Self { bodies: [0; 2], arbiter: 0, rows: 0, moves: [false; 2], extra: false, first: 0 };

    #[inline(always)]
    fn of(index: u32, arbiter: &Arbiter, bodies: &SolverBodies) -> Self {
        let data = &arbiter.data;
        let states = [arbiter.body1, arbiter.body2].map(|body| &bodies.states[body.index as usize]);
        let extra = data.restitution > 0.0
            || data.other_slots != 0 && data.other_restitution > 0.0
            || data.rolling_resistance > 0.0
            || data.tangent_velocity != Vec3::ZERO
            || data.flags & ANISOTROPIC != 0
            || states[0].locked != 0
            || states[1].locked != 0;
        Self {
            bodies: [arbiter.body1.index, arbiter.body2.index],
            arbiter: index,
            rows: if data.flags & (ONE_NORMAL | HIDDEN) == ONE_NORMAL {
                u16::from(data.usage_mask & 15)
            } else {
                rows_of(data)
            },
            moves: states.map(|state| state.moves != 0),
            extra,
            first: first_choice(arbiter.key),
        }
    }
}

/// Splits the slots of an arbiter into groups of equal normal, mode and material; each is a row.
fn rows_of(data: &ContactData) -> u16 {
    let mut left = if data.flags & HIDDEN == 0 { data.usage_mask & 15 } else { 0 };
    let (mut rows, mut count) = (0, 0);
    while left != 0 {
        let lead = &data.slots[left.trailing_zeros() as usize];
        let mut slots = 0;
        for slot in 0..SLOTS {
            let contact = &data.slots[slot];
            let same = contact.remove == lead.remove
                && contact.normal == lead.normal
                && data.is_other(1 << slot) == data.is_other(left & left.wrapping_neg());
            slots |= u8::from(same && left >> slot & 1 == 1) << slot;
        }
        // A normal that is not equal to itself cannot occur (validated), but must not loop.
        slots |= left & left.wrapping_neg();
        left &= !slots;
        rows |= u16::from(slots) << count;
        count += 4;
    }
    rows
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
fn first_choice(key: ArbiterKey) -> u8 {
    (mix(mix(0, key.key2.wrapping_sub(key.key1)), 0) >> 63) as u8
}

/// The lowest free colour, where `first` swaps the two colours of each pair. `free` must have one.
#[inline(always)]
fn nearest_color(free: u64, first: u8) -> u8 {
    const LOWER: u64 = 0x5555_5555_5555_5555;
    let swapped = if first == 0 { free } else { (free & LOWER) << 1 | (free >> 1 & LOWER) };
    swapped.trailing_zeros() as u8 ^ first
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
    records: Vec<Record>,
    /// Dynamic colours in use at each body, by body slot.
    used: Vec<u64>,
    /// Static colours in use at each body.
    fixed_rows: Vec<u8>,
    /// Bodies of rows without a colour.
    crowded: Vec<u32>,
}

impl RowPlan {
    /// Collects the rows of the awake arbiters and colours them.
    pub fn build(&mut self, order: &[Entry], arbiters: &mut [Arbiter], bodies: &SolverBodies, pool: &mut StagePool) {
        let count = bodies.states.len();
        // Few are forgotten one by one, before their records go; but then it does not matter whether these change.
        let few = self.records.len() < count / 8;
        if few {
            self.clear_few();
        }
        let same = AtomicBool::new(!few && self.records.len() == order.len() && self.used.len() == count);
        storage::reserve(&mut self.records, order.len());
        self.records.resize(order.len(), Record::NONE);
        let (arbiters, records) = (SharedSlice::new(arbiters), SharedSlice::new(&mut self.records));
        pool.run_ranges(order.len(), LEAST_ARBITERS, |range| {
            // SAFETY: an arbiter stands in the order once, and each place of the order belongs to one run.
            if !unsafe { collect(order, range, &arbiters, bodies, &records) } {
                same.store(false, Ordering::Relaxed);
            }
        });
        if same.into_inner() {
            return;
        }
        if !few {
            self.used.fill(0);
            self.fixed_rows.fill(0);
        }
        self.used.resize(count, 0);
        self.fixed_rows.resize(count, 0);
        let counts = self.color();
        self.sort(counts);
    }

    /// The bodies of each arbiter of the step, and whether both move.
    pub fn ties(&self) -> impl Iterator<Item = ([u32; 2], bool)> + '_ {
        self.records.iter().map(|record| (record.bodies, record.moves == [true; 2]))
    }

    /// Whether a row acts on a body that moves.
    #[inline(always)]
    pub fn constrains(&self, body: usize) -> bool {
        self.used[body] != 0 || self.fixed_rows[body] != 0
    }

    /// Forgets the colours of the last step, body by body.
    fn clear_few(&mut self) {
        for body in self.records.iter().flat_map(|record| record.bodies) {
            self.used[body as usize] = 0;
            self.fixed_rows[body as usize] = 0;
        }
    }

    /// Gives each row its colour, and counts the rows by place: one further on, as [`Self::sort`] wants it.
    fn color(&mut self) -> [u32; GROUPS * CLASSES + 1] {
        let mut counts = [0; GROUPS * CLASSES + 1];
        self.unsorted.clear();
        storage::reserve(&mut self.unsorted, self.records.len());
        for record in &self.records {
            let [a, b] = record.bodies.map(|body| body as usize);
            let mut rows = record.rows;
            while rows != 0 {
                let color = if record.moves[0] && record.moves[1] {
                    dynamic_color(&mut self.used, [a, b], record.first)
                } else {
                    static_color(&mut self.fixed_rows[if record.moves[0] { a } else { b }])
                };
                let source = RowSource {
                    arbiter: record.arbiter,
                    slots: rows as u8 & 15,
                    part: match (rows == record.rows, rows >> 4) {
                        (true, 0) => RowPart::Only,
                        (true, _) => RowPart::First,
                        (false, _) => RowPart::Later,
                    },
                    extra: record.extra,
                    color,
                };
                if color == OVERFLOW {
                    self.crowded.extend(record.bodies);
                }
                counts[source.place() + 1] += 1;
                storage::push(&mut self.unsorted, source);
                rows >>= 4;
            }
        }
        // Now that all colours are given, a bit more tells only that a row is there.
        for body in self.crowded.drain(..) {
            self.used[body as usize] |= 1;
        }
        counts
    }

    /// Counting sort by colour and class; equal ones keep their key order.
    fn sort(&mut self, mut counts: [u32; GROUPS * CLASSES + 1]) {
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
            let next = &mut counts[row.place()];
            self.rows[*next as usize] = *row;
            *next += 1;
        }
    }
}

/// Writes the records of a part of the order, and tells whether they are what they were.
///
/// # Safety
/// No other thread may touch the arbiters of this part, or its records.
unsafe fn collect(
    order: &[Entry],
    range: Range<usize>,
    arbiters: &SharedSlice<'_, Arbiter>,
    bodies: &SolverBodies,
    records: &SharedSlice<'_, Record>,
) -> bool {
    let mut same = true;
    for at in range {
        if let Some(later) = order.get(at + PREFETCH_AHEAD) {
            arbiters.prefetch_bytes(later.index as usize, std::mem::offset_of!(Arbiter, body1));
            arbiters.prefetch_bytes(later.index as usize, std::mem::offset_of!(Arbiter, data.usage_mask));
        }
        let index = order[at].index;
        // SAFETY: promised by the caller.
        let (arbiter, record) = unsafe { (arbiters.get_mut(index as usize), records.get_mut(at)) };
        arbiter.data.mark_solved();
        let new = Record::of(index, arbiter, bodies);
        same &= *record == new;
        *record = new;
    }
    same
}

/// The first colour that is free at both bodies.
#[inline(always)]
fn dynamic_color(used: &mut [u64], [a, b]: [usize; 2], first: u8) -> u8 {
    let free = !(used[a] | used[b]);
    if free == 0 {
        return OVERFLOW;
    }
    let color = nearest_color(free, first);
    used[a] |= 1 << color;
    used[b] |= 1 << color;
    1 + color
}

/// The next colour of a body's rows with what is not dynamic.
#[inline(always)]
fn static_color(rows: &mut u8) -> u8 {
    if *rows as usize >= STATIC_COLORS {
        return OVERFLOW;
    }
    *rows += 1;
    DYNAMIC_COLORS as u8 + *rows
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    /// Colours rows of arbiters between these bodies, of which those from `first_fixed` on do not move; each arbiter has the
    /// rows that `rows` packs.
    fn plan_of(ties: &[[u32; 2]], first_fixed: u32, rows: u16) -> RowPlan {
        let mut plan = RowPlan::default();
        let bodies = ties.iter().flatten().max().map_or(0, |&last| last as usize + 1);
        plan.used.resize(bodies, 0);
        plan.fixed_rows.resize(bodies, 0);
        plan.records = (0..)
            .zip(ties)
            .map(|(arbiter, &bodies)| Record {
                bodies,
                arbiter,
                rows,
                moves: bodies.map(|body| body < first_fixed),
                first: (arbiter % 2) as u8,
                ..Record::NONE
            })
            .collect();
        let counts = plan.color();
        plan.sort(counts);
        plan
    }

    /// Asserts the laws of a plan; returns how many rows are in the overflow.
    fn check(plan: &RowPlan, ties: &[[u32; 2]], first_fixed: u32) -> usize {
        let (mut next, mut overflow) = (0, 0);
        let mut slots = vec![0_u8; ties.len()];
        for group in &plan.groups {
            let mut taken = vec![false; plan.used.len()];
            for (class, &(start, end)) in group.ranges.iter().enumerate() {
                assert_eq!(start, next, "groups and classes follow one another");
                next = end;
                let rows = &plan.rows[start as usize..end as usize];
                assert!(rows.is_sorted_by_key(|row| row.arbiter), "equal ones keep their order");
                for row in rows {
                    assert_eq!((row.slots.count_ones() as usize - 1).min(CLASSES - 1), class);
                    assert_eq!(slots[row.arbiter as usize] & row.slots, 0);
                    slots[row.arbiter as usize] |= row.slots;
                    let moving = ties[row.arbiter as usize].into_iter().filter(|&body| body < first_fixed);
                    assert!(!group.fixed || moving.clone().count() == 1);
                    for body in moving {
                        assert!(plan.constrains(body as usize));
                        let shared = std::mem::replace(&mut taken[body as usize], true);
                        assert!(!shared || group.serial, "two rows of a colour act on body {body}");
                    }
                }
                overflow += if group.serial { rows.len() } else { 0 };
            }
        }
        assert_eq!(next as usize, plan.rows.len());
        let all = plan.records.first().map_or(0, |record| record.rows & 15 | record.rows >> 4);
        assert!(slots.iter().all(|&slots| u16::from(slots) == all), "each row stands in the plan once");
        overflow
    }

    /// 3,000 arbiters of two rows between 400 bodies, a fifth of which do not move: no colour has two rows of a body.
    #[test]
    fn rows_of_a_color_share_no_body_that_moves() {
        let mut random = Random(7);
        let ties: Vec<[u32; 2]> = (0..3000)
            .map(|_| {
                let a = random.below(320);
                [a, (a + 1 + random.below(399)) % 400]
            })
            .collect();
        let plan = plan_of(&ties, 320, 0b1010_0001);
        assert_eq!(plan.rows.len(), 6000);
        check(&plan, &ties, 320);
        assert!(plan.rows.iter().all(|row| row.part == if row.slots == 1 { RowPart::First } else { RowPart::Later }));
    }

    /// A hub with 100 neighbours that move has 36 too many, one with 70 that do not has 6.
    #[test]
    fn rows_without_a_color_go_to_the_overflow() {
        let star = |neighbors: u32| (1..=neighbors).map(|other| [0, other]).collect::<Vec<_>>();
        let (moving, fixed) = (star(100), star(70));
        let plan = plan_of(&moving, 101, 0b1111);
        assert_eq!(check(&plan, &moving, 101), 100 - DYNAMIC_COLORS);
        assert!(plan.rows.iter().all(|row| row.part == RowPart::Only && row.is_first()));
        assert_eq!(check(&plan_of(&fixed, 1, 0b1111), &fixed, 1), 70 - STATIC_COLORS);
    }

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
        let upper: u32 = (1..=1000).map(choice).map(u32::from).sum();
        let changes = (1..=1000).filter(|&apart| choice(apart) != choice(apart + 2)).count();
        assert!((450..550).contains(&upper) && (400..600).contains(&changes), "{upper}, {changes}");
        assert_eq!(choice(5), first_choice(ArbiterKey::new(1007, 1012)), "only the distance counts");
    }
}
