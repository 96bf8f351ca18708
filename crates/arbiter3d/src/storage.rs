//! Lists that hold little more memory than their entries need.
//!
//! A `Vec` that grows doubles: on average a quarter of it is empty, in a large world many megabytes. [`push`] and [`reserve`]
//! grow by an eighth instead: each entry is then moved eight times rather than once while a list fills up, which happens once
//! in a world's life (and large blocks are mapped to another place rather than copied). Small lists double as ever.
//!
//! Lists that are filled and drained in every step have to hold the most that a step puts in, and the first step of a scene
//! in which all contacts begin puts in a hundred times what later steps do. A [`Peak`] notes how full a list gets, and once
//! in [`WINDOW`] steps gives back what none of them has needed. A steady world gives nothing back, and so allocates nothing.
//!
//! A [`FixedList`] is a short list on the stack, for what one pass leaves for the next.

use std::mem::MaybeUninit;

/// Steps over which the most is taken.
const WINDOW: u32 = 32;
/// Bytes up to which a list may double.
const SMALL: usize = 1 << 15;
/// Entries that a list may have to spare in any case.
const SPARE: usize = 64;

/// Adds an entry; a full list grows by an eighth.
#[inline]
pub(crate) fn push<T>(list: &mut Vec<T>, entry: T) {
    reserve(list, list.len() + 1);
    list.push(entry);
}

/// Makes room for `count` entries in all; where there is less, for an eighth more.
#[inline]
pub(crate) fn reserve<T>(list: &mut Vec<T>, count: usize) {
    if list.capacity() < count {
        grow(list, count);
    }
}

#[cold]
fn grow<T>(list: &mut Vec<T>, count: usize) {
    let small = count.min(SMALL / size_of::<T>().max(1)).max(4);
    list.reserve_exact(count + small.max(count / 8) - list.len());
}

/// How full a list has been of late.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Peak {
    most: usize,
    steps: u32,
}

impl Peak {
    /// Notes that a list has held so many entries.
    #[inline]
    pub fn note(&mut self, count: usize) {
        self.most = self.most.max(count);
    }

    /// A step has ended: once in a while, how many entries the list is to have room for.
    pub fn end_step(&mut self) -> Option<usize> {
        self.steps += 1;
        if self.steps < WINDOW {
            return None;
        }
        self.steps = 0;
        Some(std::mem::take(&mut self.most))
    }
}

/// Gives back memory of a list that has to hold no more than `count` entries, if it is much.
pub(crate) fn shrink<T>(list: &mut Vec<T>, count: usize) {
    let wanted = count + count / 2 + SPARE;
    if list.capacity() > 2 * wanted {
        list.shrink_to(wanted);
    }
}

/// A list with room for `N` entries, in place.
///
/// Left blank at first: to fill lists of which little is used would cost more than that use.
pub(crate) struct FixedList<T, const N: usize> {
    entries: [MaybeUninit<T>; N],
    count: usize,
}

impl<T: Copy, const N: usize> FixedList<T, N> {
    #[inline(always)]
    pub fn new() -> Self {
        Self { entries: [const { MaybeUninit::uninit() }; N], count: 0 }
    }

    /// Adds an entry.
    ///
    /// # Panics
    /// If the list is full.
    #[inline(always)]
    pub fn push(&mut self, entry: T) {
        self.entries[self.count] = MaybeUninit::new(entry);
        self.count += 1;
    }

    #[inline(always)]
    pub fn as_slice(&self) -> &[T] {
        // SAFETY: `push` has written the first `count`, and `MaybeUninit<T>` lies in memory as `T` does.
        unsafe { std::slice::from_raw_parts(self.entries.as_ptr().cast(), self.count) }
    }

    #[inline(always)]
    pub fn as_mut_slice(&mut self) -> &mut [T] {
        // SAFETY: as above.
        unsafe { std::slice::from_raw_parts_mut(self.entries.as_mut_ptr().cast(), self.count) }
    }

    /// Drops all but the first `count` entries.
    #[inline(always)]
    pub fn truncate(&mut self, count: usize) {
        self.count = count.min(self.count);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fixed_list_holds_what_was_pushed_up_to_its_size() {
        let mut list = FixedList::<(u8, u64), 5>::new();
        assert!(list.as_slice().is_empty());
        for i in 0..5 {
            list.push((i, 1 << (10 * i)));
            let expected = (0..=i).map(|k| (k, 1 << (10 * k)));
            assert!(list.as_slice().iter().copied().eq(expected), "{:?}", list.as_slice());
        }
    }

    #[test]
    #[should_panic(expected = "out of bounds")]
    fn a_full_fixed_list_takes_no_more() {
        let mut list = FixedList::<u32, 2>::new();
        for i in 0..3 {
            list.push(i);
        }
    }

    #[test]
    fn a_long_list_never_has_more_than_an_eighth_to_spare_and_moves_rarely() {
        let (mut list, mut moves) = (Vec::new(), 0);
        for i in 0..100_000_u32 {
            let before = list.capacity();
            push(&mut list, i);
            moves += usize::from(list.capacity() != before);
            assert!(
                list.capacity() <= list.len() + (list.len() / 8).max(8192),
                "{} for {}",
                list.capacity(),
                list.len()
            );
        }
        assert!(moves < 60, "{moves} times");
        assert!(list.iter().copied().eq(0..100_000));
    }

    #[test]
    fn a_burst_is_given_back_after_a_while_and_steady_use_is_not() {
        let (mut list, mut peak) = (Vec::new(), Peak::default());
        let mut capacities = Vec::new();
        for step in 0..4 * WINDOW {
            let count = if step == 3 { 5_000 } else { 300 + step as usize % 20 };
            list.extend(0..count);
            peak.note(list.len());
            list.clear();
            if let Some(count) = peak.end_step() {
                shrink(&mut list, count);
            }
            capacities.push(list.capacity());
        }
        assert!(capacities[WINDOW as usize] >= 5_000);
        let kept = capacities[2 * WINDOW as usize];
        assert!((319..1_200).contains(&kept), "{kept}");
        assert!(capacities[2 * WINDOW as usize..].iter().all(|&capacity| capacity == kept));
    }
}
