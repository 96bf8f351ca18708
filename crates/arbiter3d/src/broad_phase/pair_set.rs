//! A hash map from pairs of shape indices to a number.
//!
//! Open addressing with linear probing in a table of a power of two, at most half full. A removal shifts the entries behind
//! it back (Knuth, TAOCP volume 3, section 6.4, algorithm R), so there are no tombstones and the table never ages. The hash is
//! two multiplications and a shift; it has no seed, so the table is the same in every run.
//!
//! Invariant: between an entry and the slot its hash names there is no empty slot.

/// Key of an empty slot: a pair of the largest index with itself, which no caller can have.
const EMPTY: u64 = u64::MAX;

/// Slots of the smallest table.
const MIN_SLOTS: usize = 64;

/// A map from unordered pairs of indices to a `u32`.
#[derive(Clone, Debug, Default)]
pub struct PairSet {
    keys: Vec<u64>,
    values: Vec<u32>,
    len: usize,
}

/// The key of a pair: smaller index in the high half, so that keys sort like pairs.
#[inline(always)]
pub fn pair_key(a: u32, b: u32) -> u64 {
    let (low, high) = if a < b { (a, b) } else { (b, a) };
    u64::from(low) << 32 | u64::from(high)
}

impl PairSet {
    /// An empty map.
    pub fn new() -> Self {
        Self::default()
    }

    /// The value of a pair; the order of the two does not matter.
    #[inline]
    pub fn get(&self, a: u32, b: u32) -> Option<u32> {
        if self.len == 0 {
            return None;
        }
        let slot = self.find(pair_key(a, b));
        if self.keys[slot] == EMPTY { None } else { Some(self.values[slot]) }
    }

    /// Whether the pair is there.
    #[inline]
    pub fn contains(&self, a: u32, b: u32) -> bool {
        self.get(a, b).is_some()
    }

    /// Asks for the slots of a pair to be brought into the cache.
    #[inline]
    pub fn prefetch(&self, a: u32, b: u32) {
        if self.len > 0 {
            let slot = self.home(pair_key(a, b));
            crate::simd::prefetch(&self.keys[slot]);
            crate::simd::prefetch(&self.values[slot]);
        }
    }

    /// Makes room for so many more pairs.
    pub fn reserve(&mut self, count: usize) {
        while (self.len + count) * 2 > self.keys.len() {
            self.grow();
        }
    }

    /// Stores a value for a pair and returns the one it had before.
    pub fn insert(&mut self, a: u32, b: u32, value: u32) -> Option<u32> {
        let key = pair_key(a, b);
        debug_assert!(key != EMPTY, "the largest index cannot pair with itself");
        self.reserve(1);
        let slot = self.find(key);
        if self.keys[slot] == key {
            return Some(std::mem::replace(&mut self.values[slot], value));
        }
        self.keys[slot] = key;
        self.values[slot] = value;
        self.len += 1;
        None
    }

    /// Takes a pair out and returns its value.
    pub fn remove(&mut self, a: u32, b: u32) -> Option<u32> {
        if self.len == 0 {
            return None;
        }
        let mut hole = self.find(pair_key(a, b));
        if self.keys[hole] == EMPTY {
            return None;
        }
        let value = self.values[hole];
        let mask = self.keys.len() - 1;
        let mut next = hole;
        loop {
            next = (next + 1) & mask;
            let key = self.keys[next];
            if key == EMPTY {
                break;
            }
            // An entry may fall back into the hole unless its own slot lies behind the hole.
            let distance = next.wrapping_sub(self.home(key)) & mask;
            if distance >= (next.wrapping_sub(hole) & mask) {
                self.keys[hole] = key;
                self.values[hole] = self.values[next];
                hole = next;
            }
        }
        self.keys[hole] = EMPTY;
        self.len -= 1;
        Some(value)
    }

    /// The slot of a key, or the empty slot where it would go. The table must not be empty.
    #[inline(always)]
    fn find(&self, key: u64) -> usize {
        let mask = self.keys.len() - 1;
        let mut slot = self.home(key);
        while self.keys[slot] != key && self.keys[slot] != EMPTY {
            slot = (slot + 1) & mask;
        }
        slot
    }

    #[inline(always)]
    fn home(&self, key: u64) -> usize {
        // The first product mixes both indices into the high half; the fold lets them meet; the second spreads the result.
        let mixed = key.wrapping_mul(0x9E37_79B9_7F4A_7C15);
        let mixed = (mixed ^ mixed >> 32).wrapping_mul(0xD6E8_FEB8_6659_FD93);
        (mixed >> 32) as usize & (self.keys.len() - 1)
    }

    fn grow(&mut self) {
        let slots = (self.keys.len() * 2).max(MIN_SLOTS);
        let keys = std::mem::replace(&mut self.keys, vec![EMPTY; slots]);
        let values = std::mem::replace(&mut self.values, vec![0; slots]);
        for (key, value) in keys.into_iter().zip(values) {
            if key != EMPTY {
                let slot = self.find(key);
                self.keys[slot] = key;
                self.values[slot] = value;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use std::collections::BTreeMap;

    /// 200,000 random edits on few enough pairs that inserts, hits and removals are all common.
    #[test]
    fn behaves_like_a_sorted_map() {
        let (mut set, mut model) = (PairSet::new(), BTreeMap::new());
        let mut random = Random(7);
        for step in 0..200_000 {
            // The range breathes, so the table fills up and empties again.
            let range = if step / 20_000 % 2 == 0 { 200 } else { 20 };
            let (a, b) = (random.below(range), random.below(range));
            let (low, high) = (a.min(b), a.max(b));
            match random.below(3) {
                0 => assert_eq!(set.insert(a, b, step), model.insert((low, high), step)),
                1 => assert_eq!(set.remove(b, a), model.remove(&(low, high))),
                _ => assert_eq!(set.get(b, a), model.get(&(low, high)).copied()),
            }
            assert_eq!(set.len, model.len());
        }
        for (&(a, b), &value) in &model {
            assert_eq!(set.get(a, b), Some(value));
        }
        for &(a, b) in model.keys() {
            set.remove(a, b);
        }
        assert!(set.len == 0 && set.keys.iter().all(|&key| key == EMPTY));
    }

    /// Neighbouring indices, as scenes have them, must not cluster: a few probes a lookup, in a table half full.
    #[test]
    fn probes_stay_short_for_neighbouring_indices() {
        let mut set = PairSet::new();
        for a in 0..16_000_u32 {
            set.insert(a, a + 1, a);
            set.insert(a, a + 20, a);
        }
        let mask = set.keys.len() - 1;
        let (mut total, mut longest) = (0, 0);
        for (slot, &key) in set.keys.iter().enumerate().filter(|(_, key)| **key != EMPTY) {
            let distance = slot.wrapping_sub(set.home(key)) & mask;
            total += distance;
            longest = longest.max(distance);
        }
        assert!(total as f64 / set.len as f64 <= 1.0, "mean distance {}", total as f64 / set.len as f64);
        assert!(longest <= 64, "longest distance {longest}");
    }
}
