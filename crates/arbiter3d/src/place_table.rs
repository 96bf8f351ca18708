//! A hash table of places in a list, whose entries hold their keys themselves.
//!
//! Open addressing with linear probing in a table of a power of two, at most half full, of places alone: four bytes a slot,
//! where a map that stores keys as well takes up to a hundred bytes an entry. A removal shifts the entries behind it back
//! (Knuth, TAOCP volume 3, section 6.4, algorithm R), so there are no tombstones: the table never ages, and grows only when it
//! holds more entries than ever before.
//!
//! The caller tells what the entry at a place has as its hash, and whether it is the one wanted. Invariant: between an entry
//! and the slot that its hash names there is no empty slot.

/// "None" among indices.
pub(crate) const NONE: u32 = u32::MAX;

/// Slots of the smallest table.
const MIN_SLOTS: usize = 16;

/// Finds places by hash.
#[derive(Clone, Debug, Default)]
pub(crate) struct PlaceTable {
    /// [`NONE`] where empty.
    slots: Vec<u32>,
    len: usize,
}

/// Mixes a number, or the hash so far (start with zero) with another one. Keys are ids, not attacks.
#[inline]
pub(crate) fn mix(hash: u64, number: u64) -> u64 {
    let product = (hash.rotate_left(26) ^ number).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    product ^ product >> 32
}

impl PlaceTable {
    /// Number of entries.
    pub fn len(&self) -> usize {
        self.len
    }

    /// The place with this hash that `is_wanted`.
    pub fn find(&self, hash: u64, is_wanted: impl Fn(u32) -> bool) -> Option<u32> {
        self.slot_of(hash, is_wanted).map(|slot| self.slots[slot])
    }

    /// Asks for the slot of a hash to be brought into the cache.
    #[inline]
    pub fn prefetch(&self, hash: u64) {
        if let Some(slot) = self.slots.len().checked_sub(1).and_then(|mask| self.slots.get(hash as usize & mask)) {
            crate::simd::prefetch(slot);
        }
    }

    /// Adds a place that is not there yet.
    pub fn insert(&mut self, hash: u64, place: u32, hash_of: impl Fn(u32) -> u64) {
        self.reserve(1, hash_of);
        self.insert_reserved(hash, place);
    }

    /// Makes room for `count` more places.
    pub fn reserve(&mut self, count: usize, hash_of: impl Fn(u32) -> u64) {
        let mut slots = self.slots.len().max(MIN_SLOTS);
        while 2 * (self.len + count) > slots {
            slots *= 2;
        }
        if slots > self.slots.len() {
            let old = std::mem::replace(&mut self.slots, vec![NONE; slots]);
            for place in old.into_iter().filter(|&place| place != NONE) {
                self.put(hash_of(place), place);
            }
        }
    }

    /// Adds a place that is not there yet, for which there is room. Looks at no other entry.
    pub fn insert_reserved(&mut self, hash: u64, place: u32) {
        self.len += 1;
        self.put(hash, place);
    }

    /// Takes a place out, if it is there.
    pub fn remove(&mut self, hash: u64, place: u32, hash_of: impl Fn(u32) -> u64) {
        let Some(mut hole) = self.slot_of(hash, |other| other == place) else { return };
        let mask = self.slots.len() - 1;
        let mut next = hole;
        loop {
            next = (next + 1) & mask;
            let other = self.slots[next];
            if other == NONE {
                break;
            }
            // An entry may fall back into the hole unless its own slot lies behind the hole.
            let home = hash_of(other) as usize & mask;
            if next.wrapping_sub(home) & mask >= next.wrapping_sub(hole) & mask {
                self.slots[hole] = other;
                hole = next;
            }
        }
        self.slots[hole] = NONE;
        self.len -= 1;
    }

    fn slot_of(&self, hash: u64, is_wanted: impl Fn(u32) -> bool) -> Option<usize> {
        let mask = self.slots.len().checked_sub(1)?;
        let mut slot = hash as usize & mask;
        while self.slots[slot] != NONE {
            if is_wanted(self.slots[slot]) {
                return Some(slot);
            }
            slot = (slot + 1) & mask;
        }
        None
    }

    fn put(&mut self, hash: u64, place: u32) {
        let mask = self.slots.len() - 1;
        let mut slot = hash as usize & mask;
        while self.slots[slot] != NONE {
            slot = (slot + 1) & mask;
        }
        self.slots[slot] = place;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use std::collections::BTreeMap;

    /// 60,000 random edits on 500 keys, of which many meet in a few slots: as a sorted map has it.
    #[test]
    fn finds_what_a_sorted_map_finds() {
        let mut keys: Vec<u64> = Vec::new();
        let (mut table, mut model) = (PlaceTable::default(), BTreeMap::new());
        let hash = |key: u64| mix(0, key) & 0x3f0f;
        let mut random = Random(5);
        for _ in 0..60_000 {
            let key = u64::from(random.below(500));
            let found = table.find(hash(key), |place| keys[place as usize] == key);
            assert_eq!(found, model.get(&key).copied());
            if let Some(place) = found {
                model.remove(&key);
                table.remove(hash(key), place, |other| hash(keys[other as usize]));
            } else {
                let place = keys.len() as u32;
                keys.push(key);
                model.insert(key, place);
                table.insert(hash(key), place, |other| hash(keys[other as usize]));
            }
            assert_eq!(table.len(), model.len());
        }
        assert!(table.slots.len() <= 1024, "{} slots for at most 500 entries", table.slots.len());
    }

    #[test]
    fn neighbouring_ids_do_not_cluster() {
        let mut table = PlaceTable::default();
        let hash = |place: u32| mix(mix(0, u64::from(place)), u64::from(place) + 20);
        for place in 0..16_000 {
            table.insert(hash(place), place, hash);
        }
        let mask = table.slots.len() - 1;
        let distances = table.slots.iter().enumerate().filter(|(_, place)| **place != NONE);
        let total: usize = distances.map(|(slot, &place)| slot.wrapping_sub(hash(place) as usize) & mask).sum();
        assert!(total <= 16_000, "mean distance {}", total as f64 / 16_000.0);
    }
}
