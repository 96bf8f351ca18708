//! Where arbiters live: a pool with stable places, found by key, by body or by id.
//!
//! A place is reused after its arbiter has ended; the generation in the [`ArbiterId`] then differs, so an old id finds
//! nothing. The arbiters of a body hang on a list ([`EdgeLists`]). Those that begin in a step are made together, their records
//! by all threads. The solver walks `awake`, the live arbiters of awake bodies in the
//! order of their keys: the order of solving then depends on names, not on history.

use super::contact_data::ContactData;
use super::key::ArbiterKey;
use crate::edge_lists::EdgeLists;
use crate::id::BodyId;
use crate::parallel::{SharedSlice, StagePool};
pub(crate) use crate::place_table::NONE;
use crate::place_table::PlaceTable;
use crate::storage::{self, Peak};
use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};
use std::mem::MaybeUninit;
use std::slice;

/// Names an arbiter for as long as it lives.
///
/// ```
/// use arbiter3d::{ArbiterKey, BodyDefinition, BodyId, World};
/// let mut world = World::default();
/// let body = world.add_body(&BodyDefinition::dynamic())?;
/// let id = world.get_or_create_arbiter(ArbiterKey::new(7, 8), BodyId::WORLD, body)?;
/// world.remove_arbiter(id)?;
/// assert!(world.arbiter_by_id(id).is_none());
/// # Ok::<(), arbiter3d::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ArbiterId {
    pub(crate) index: u32,
    pub(crate) generation: u32,
}

/// Why an arbiter ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum EndReason {
    /// Its contacts broke and its shapes do not overlap.
    Separated,
    /// [`World::remove_arbiter`](crate::World::remove_arbiter).
    ArbiterRemoved,
    /// One of its shapes was removed.
    ShapeRemoved,
    /// One of its bodies was removed.
    BodyRemoved,
    /// One of its bodies was disabled.
    BodyDisabled,
    /// One of its bodies changed its kind.
    KindChanged,
    /// A filter or a sensor flag changed so that its shapes no longer collide.
    FilterChanged,
    /// The world was cleared.
    WorldCleared,
}

/// The contact state of one pair: a key, two bodies and the contact data.
///
/// ```
/// use arbiter3d::{ArbiterKey, BodyDefinition, BodyId, ContactPoint, World, math::Vec3};
/// let mut world = World::default();
/// let body = world.add_body(&BodyDefinition::dynamic())?;
/// let key = ArbiterKey::new(1_000_000, 1);
/// let point = ContactPoint::new(Vec3::ZERO, Vec3::ZERO, Vec3::Y);
/// world.register_contact_by_key(key, BodyId::WORLD, body, point)?;
/// assert_eq!(world.arbiter(key).unwrap().data().contact_count(), 1);
/// # Ok::<(), arbiter3d::Error>(())
/// ```
#[derive(Clone, Debug)]
#[repr(C, align(64))] // names and what the contacts share fill the first two cache lines, the contacts follow
pub struct Arbiter {
    pub(crate) key: ArbiterKey,
    pub(crate) body1: BodyId,
    pub(crate) body2: BodyId,
    pub(crate) id: ArbiterId,
    /// The broad-phase pair it belongs to; `NONE` for custom arbiters.
    pub(crate) pair: u32,
    pub(crate) alive: bool,
    /// Whether the begin has been raised.
    pub(crate) begun: bool,
    /// Whether one of its bodies is awake.
    pub(crate) awake: bool,
    pub(crate) data: ContactData,
}

impl Arbiter {
    /// None yet.
    fn blank(index: u32, tag: u32) -> Self {
        Self {
            data: ContactData::default(),
            key: ArbiterKey::new(0, 0),
            body1: BodyId::WORLD,
            body2: BodyId::WORLD,
            id: ArbiterId { index, generation: tag },
            pair: NONE,
            alive: false,
            begun: false,
            awake: false,
        }
    }

    /// Becomes the next arbiter at its place, without pair; the data stay.
    fn begin(&mut self, name: &Name) {
        self.id.generation = self.id.generation.wrapping_add(1);
        (self.key, self.body1, self.body2) = (name.key, name.bodies[0], name.bodies[1]);
        (self.alive, self.begun, self.pair) = (true, false, NONE);
    }

    /// Names this arbiter while it lives.
    #[must_use]
    pub fn id(&self) -> ArbiterId {
        self.id
    }

    /// Its key.
    #[must_use]
    pub fn key(&self) -> ArbiterKey {
        self.key
    }

    /// The body that normals point away from.
    #[must_use]
    pub fn body1(&self) -> BodyId {
        self.body1
    }

    /// The body that normals point to.
    #[must_use]
    pub fn body2(&self) -> BodyId {
        self.body2
    }

    /// The other body; `None` when `body` is neither.
    #[must_use]
    pub fn other_body(&self, body: BodyId) -> Option<BodyId> {
        if body == self.body1 { Some(self.body2) } else { (body == self.body2).then_some(self.body1) }
    }

    /// Whether the engine made it for two shapes, rather than a user.
    #[must_use]
    pub fn is_of_shapes(&self) -> bool {
        self.pair != NONE
    }

    /// Contacts and material.
    #[must_use]
    pub fn data(&self) -> &ContactData {
        &self.data
    }

    /// Contacts and material, to change.
    pub fn data_mut(&mut self) -> &mut ContactData {
        &mut self.data
    }
}

/// What an arbiter that begins is called.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Name {
    pub key: ArbiterKey,
    pub bodies: [BodyId; 2],
}

/// Multiply-and-rotate hashing: keys are ids, not attacks.
#[derive(Default)]
pub(crate) struct IdHasher(u64);

impl Hasher for IdHasher {
    fn finish(&self) -> u64 {
        self.0 ^ self.0 >> 32
    }

    fn write(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.write_u64(u64::from(byte));
        }
    }

    fn write_u64(&mut self, n: u64) {
        self.0 = (self.0.rotate_left(26) ^ n).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    }
}

/// A map whose keys are ids.
pub(crate) type IdMap<K, V> = HashMap<K, V, BuildHasherDefault<IdHasher>>;

/// An arbiter in the solving order: its place, the generation by which one that has ended is told from its successor, and its
/// key, so that the order is kept without a look at the arbiters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Entry {
    key: ArbiterKey,
    pub index: u32,
    generation: u32,
}

impl Entry {
    const NONE: Self = Self { key: ArbiterKey::new(0, 0), index: NONE, generation: 0 };

    /// Whether the arbiter that was meant is awake.
    #[inline(always)]
    fn is_live(&self, awake: &[u64]) -> bool {
        awake[self.index as usize] == u64::from(self.generation)
    }
}

/// Arbiters that a thread makes at a time.
const NEW_PER_BLOCK: usize = 16;
/// How many arbiters ahead of its making what an arbiter touches is asked for.
const NEW_AHEAD: usize = 8;

/// Arbiters in the solving order from which on it is merged in halves.
const LEAST_HALVED: usize = 2048;
/// Arbiters that a thread ends at a time.
const ENDS_PER_BLOCK: usize = 16;
/// How many arbiters ahead of its end what an arbiter touches is asked for.
const ENDS_AHEAD: usize = 4;

/// In place of a generation: no awake arbiter.
const ASLEEP: u64 = u64::MAX;

/// The pool of arbiters.
#[derive(Debug, Default)]
pub(crate) struct ArbiterStore {
    /// Where generations start.
    tag: u32,
    arbiters: Vec<Arbiter>,
    /// By place: the generation of an arbiter that is awake, else [`ASLEEP`].
    awake: Vec<u64>,
    free: Vec<u32>,
    by_key: PlaceTable,
    /// The arbiters of each body.
    lists: EdgeLists,
    /// Live arbiters of awake bodies: `sorted` in key order, `fresh` not merged yet.
    sorted: Vec<Entry>,
    fresh: Vec<Entry>,
    fresh_peak: Peak,
    /// Live arbiters that users made.
    pub custom: u32,
    merged: Vec<Entry>,
    stale: bool,
}

impl ArbiterStore {
    /// An empty pool whose generations start at `tag`.
    pub fn new(tag: u32) -> Self {
        Self { tag, ..Self::default() }
    }

    /// Number of live arbiters.
    pub fn len(&self) -> usize {
        self.by_key.len()
    }

    /// The arbiter at a place that is known to be live.
    #[inline(always)]
    pub fn at(&self, index: u32) -> &Arbiter {
        &self.arbiters[index as usize]
    }

    /// The same, to change.
    #[inline(always)]
    pub fn at_mut(&mut self, index: u32) -> &mut Arbiter {
        &mut self.arbiters[index as usize]
    }

    /// All places, live or not.
    pub fn slots(&self) -> &[Arbiter] {
        &self.arbiters
    }

    /// All places, live or not.
    pub fn slots_mut(&mut self) -> &mut [Arbiter] {
        &mut self.arbiters
    }

    /// Live arbiters, by place.
    pub fn iter(&self) -> impl Iterator<Item = &Arbiter> {
        self.arbiters.iter().filter(|a| a.alive)
    }

    /// The place of the live arbiter with this id.
    pub fn index_of(&self, id: ArbiterId) -> Option<u32> {
        let arbiter = self.arbiters.get(id.index as usize)?;
        (arbiter.alive && arbiter.id == id).then_some(id.index)
    }

    /// The place of the live arbiter with this key.
    pub fn find(&self, key: ArbiterKey) -> Option<u32> {
        self.by_key.find(key.hash(), |place| self.arbiters[place as usize].key == key)
    }

    /// Makes an arbiter; the key must be free and the bodies different.
    pub fn create(&mut self, key: ArbiterKey, body1: BodyId, body2: BodyId) -> u32 {
        debug_assert!(self.find(key).is_none(), "{key:?} is in use");
        let index = self.free.pop().unwrap_or_else(|| self.add_place());
        let arbiter = &mut self.arbiters[index as usize];
        arbiter.begin(&Name { key, bodies: [body1, body2] });
        (arbiter.awake, arbiter.data) = (false, ContactData::default());
        let arbiters = &self.arbiters;
        self.by_key.insert(key.hash(), index, |place| arbiters[place as usize].key.hash());
        self.lists.grow(arbiters.len(), body1.index.max(body2.index) as usize + 1);
        self.lists.link(index, [body1.index, body2.index]);
        self.set_awake(index, true);
        index
    }

    /// Makes the pool one place larger.
    fn add_place(&mut self) -> u32 {
        let index = u32::try_from(self.arbiters.len()).unwrap_or(NONE);
        storage::push(&mut self.arbiters, Arbiter::blank(index, self.tag));
        storage::push(&mut self.awake, ASLEEP);
        // The free list has room for every place: else it would grow in the middle of a step.
        storage::reserve(&mut self.free, self.arbiters.len());
        index
    }

    /// Makes arbiters with the names that `name_of` finds for `0..count`, and has `fill` make what they hold out of the data
    /// of some that have ended. The keys must be free, the bodies of each different and below `bodies`.
    ///
    /// Records are written on all threads; beside that, one thread enters the names.
    pub fn create_many(
        &mut self,
        count: usize,
        bodies: usize,
        pool: &mut StagePool,
        name_of: impl Fn(usize) -> Name + Sync,
        fill: impl Fn(usize, &mut Arbiter) + Sync,
    ) {
        let (old, reused) = (self.arbiters.len(), self.free.len().min(count));
        let (places, first_fresh) = (old + count - reused, self.fresh.len());
        self.make_room(places, count, bodies);
        let (tag, free) = (self.tag, &self.free[..]);
        let place_of = |nth: usize| if nth < reused { free[free.len() - 1 - nth] } else { (old + nth - reused) as u32 };
        // SAFETY: there is room for so many; what is not an arbiter yet is written before it is read.
        let slots =
            unsafe { slice::from_raw_parts_mut(self.arbiters.as_mut_ptr().cast::<MaybeUninit<Arbiter>>(), places) };
        let (slots, awake) = (SharedSlice::new(slots), SharedSlice::new(&mut self.awake));
        let fresh = SharedSlice::new(&mut self.fresh[first_fresh..]);
        let make = |block: usize| {
            for nth in block * NEW_PER_BLOCK..((block + 1) * NEW_PER_BLOCK).min(count) {
                let (index, name) = (place_of(nth), name_of(nth));
                // SAFETY: each has a place of its own and belongs to one block; places that are used again hold arbiters.
                unsafe {
                    let slot = slots.get_mut(index as usize);
                    let arbiter = match nth < reused {
                        true => slot.assume_init_mut(),
                        false => slot.write(Arbiter::blank(index, tag)),
                    };
                    arbiter.begin(&name);
                    arbiter.awake = true;
                    let generation = arbiter.id.generation;
                    *awake.get_mut(index as usize) = u64::from(generation);
                    *fresh.get_mut(nth) = Entry { key: name.key, index, generation };
                    fill(nth, arbiter);
                }
                if nth + NEW_AHEAD < count {
                    slots.prefetch(place_of(nth + NEW_AHEAD) as usize);
                }
            }
        };
        let (by_key, lists) = (&mut self.by_key, &mut self.lists);
        pool.run_beside(count.div_ceil(NEW_PER_BLOCK), make, || {
            for nth in 0..count {
                if nth + NEW_AHEAD < count {
                    by_key.prefetch(name_of(nth + NEW_AHEAD).key.hash());
                }
                let name = name_of(nth);
                by_key.insert_reserved(name.key.hash(), place_of(nth));
                lists.link(place_of(nth), name.bodies.map(|body| body.index));
            }
        });
        // SAFETY: old ones keep their places, and each new place has been written.
        unsafe { self.arbiters.set_len(places) };
        self.free.truncate(self.free.len() - reused);
    }

    /// Makes room for so many places in all, of which `count` get a new arbiter.
    fn make_room(&mut self, places: usize, count: usize, bodies: usize) {
        storage::reserve(&mut self.arbiters, places);
        storage::reserve(&mut self.free, places);
        storage::reserve(&mut self.awake, places);
        self.awake.resize(places, ASLEEP);
        let arbiters = &self.arbiters;
        self.by_key.reserve(count, |place| arbiters[place as usize].key.hash());
        self.lists.grow(places, bodies);
        let fresh = self.fresh.len() + count;
        storage::reserve(&mut self.fresh, fresh);
        self.fresh.resize(fresh, Entry::NONE);
    }

    /// Ends an arbiter; its place goes back to the pool.
    pub fn remove(&mut self, index: u32) {
        let arbiter = &mut self.arbiters[index as usize];
        debug_assert!(arbiter.alive);
        arbiter.alive = false;
        arbiter.awake = false;
        self.awake[index as usize] = ASLEEP;
        let (key, body1, body2) = (arbiter.key, arbiter.body1.index, arbiter.body2.index);
        let arbiters = &self.arbiters;
        self.by_key.remove(key.hash(), index, |place| arbiters[place as usize].key.hash());
        self.lists.unlink(index, [body1, body2]);
        self.free.push(index);
        self.stale = true;
    }

    /// Ends arbiters, each once. Before that `visit` is shown each with its number in the list, on all threads; beside that, one
    /// thread takes the names out.
    pub fn remove_many(&mut self, list: &[u32], pool: &mut StagePool, visit: impl Fn(usize, &Arbiter) + Sync) {
        let (slots, awake) = (SharedSlice::new(&mut self.arbiters), SharedSlice::new(&mut self.awake));
        let (by_key, lists, free) = (&mut self.by_key, &mut self.lists, &mut self.free);
        let end = |block: usize| {
            for (nth, &index) in list.iter().enumerate().skip(block * ENDS_PER_BLOCK).take(ENDS_PER_BLOCK) {
                let arbiter = slots.at(index as usize);
                // SAFETY: an arbiter stands in the list once, so nobody else writes it; and of what is written here, the thread
                // that takes names out reads nothing.
                unsafe {
                    visit(nth, &*arbiter);
                    ((*arbiter).alive, (*arbiter).awake) = (false, false);
                    *awake.get_mut(index as usize) = ASLEEP;
                }
            }
        };
        // SAFETY: nobody writes keys in this stage.
        let hash_of = |place: u32| unsafe { (*slots.at(place as usize)).key }.hash();
        pool.run_beside(list.len().div_ceil(ENDS_PER_BLOCK), end, || {
            for (nth, &index) in list.iter().enumerate() {
                if let Some(&later) = list.get(nth + 2 * ENDS_AHEAD) {
                    slots.prefetch(later as usize);
                    lists.prefetch(later);
                }
                if let Some(&later) = list.get(nth + ENDS_AHEAD) {
                    by_key.prefetch(hash_of(later));
                }
                let arbiter = slots.at(index as usize);
                // SAFETY: nobody writes bodies in this stage.
                let bodies = unsafe { [(*arbiter).body1.index, (*arbiter).body2.index] };
                by_key.remove(hash_of(index), index, hash_of);
                lists.unlink(index, bodies);
                free.push(index);
            }
        });
        self.stale = true;
    }

    /// Puts an arbiter among those that are solved, or takes it out.
    pub fn set_awake(&mut self, index: u32, awake: bool) {
        let arbiter = &mut self.arbiters[index as usize];
        if arbiter.awake != awake {
            arbiter.awake = awake;
            let (key, generation) = (arbiter.key, arbiter.id.generation);
            self.awake[index as usize] = if awake { u64::from(generation) } else { ASLEEP };
            if awake {
                storage::push(&mut self.fresh, Entry { key, index, generation });
            } else {
                self.stale = true;
            }
        }
    }

    /// Brings the solving order up to date and returns it: awake arbiters by key.
    pub fn awake_by_key(&mut self, pool: Option<&mut StagePool>) -> &[Entry] {
        self.fresh_peak.note(self.fresh.len());
        if self.stale || !self.fresh.is_empty() {
            self.merge_fresh(pool);
        }
        if let Some(count) = self.fresh_peak.end_step() {
            storage::shrink(&mut self.fresh, count);
        }
        &self.sorted
    }

    /// Merges the arbiters that have woken into the solving order, and drops those that sleep or have ended: the upper half
    /// beside the lower one where there are threads for both.
    fn merge_fresh(&mut self, pool: Option<&mut StagePool>) {
        let awake = &self.awake[..];
        self.fresh.retain(|entry| entry.is_live(awake));
        self.fresh.sort_unstable_by_key(|entry| entry.key);
        let (sorted, fresh) = (&self.sorted[..], &self.fresh[..]);
        let pool = pool.filter(|pool| pool.active_threads() > 1 && sorted.len() >= LEAST_HALVED);
        let cut = if pool.is_some() { sorted.len() / 2 } else { sorted.len() };
        let fresh_cut = sorted.get(cut).map_or(fresh.len(), |entry| fresh.partition_point(|new| new.key < entry.key));
        let (middle, count) = (cut + fresh_cut, sorted.len() + fresh.len());
        storage::reserve(&mut self.merged, count);
        self.merged.resize(count, Entry::NONE);
        let (low, high) = self.merged.split_at_mut(middle);
        let (mut lower, mut upper) = (0, 0);
        if let Some(pool) = pool {
            let upper_part = SharedSlice::new(high);
            let told = SharedSlice::new(std::slice::from_mut(&mut upper));
            let merge_upper = |_: usize| {
                // SAFETY: the only item of its stage.
                unsafe {
                    let part = upper_part.range_mut(0, count - middle);
                    *told.get_mut(0) = merge(&sorted[cut..], &fresh[fresh_cut..], awake, part);
                }
            };
            pool.run_beside(1, merge_upper, || lower = merge(&sorted[..cut], &fresh[..fresh_cut], awake, low));
        } else {
            lower = merge(sorted, fresh, awake, low);
        }
        self.merged.copy_within(middle..middle + upper, lower);
        self.merged.truncate(lower + upper);
        std::mem::swap(&mut self.sorted, &mut self.merged);
        self.fresh.clear();
        self.stale = false;
    }

    /// Whether no arbiter is to be solved.
    pub fn are_asleep(&self) -> bool {
        !self.stale && self.fresh.is_empty() && self.sorted.is_empty()
    }

    /// The solving order as of the last [`ArbiterStore::awake_by_key`].
    pub fn order(&self) -> &[Entry] {
        &self.sorted
    }

    /// Both the solving order and the places, to change.
    pub fn order_and_slots_mut(&mut self) -> (&[Entry], &mut [Arbiter]) {
        (&self.sorted, &mut self.arbiters)
    }

    /// Places of the arbiters of a body.
    pub fn of_body(&self, body: u32) -> impl Iterator<Item = u32> + '_ {
        self.lists.of_body(body)
    }

    /// Checks every invariant; the message says which is broken.
    pub fn validate(&self) -> Result<(), String> {
        let live = self.iter().count();
        if live != self.by_key.len() || live + self.free.len() != self.arbiters.len() {
            return Err(format!("{live} live arbiters, {} keys, {} free", self.by_key.len(), self.free.len()));
        }
        for arbiter in self.iter() {
            if self.find(arbiter.key) != Some(arbiter.id.index) {
                return Err(format!("{:?} is not found by its key", arbiter.id));
            }
            for body in [arbiter.body1.index, arbiter.body2.index] {
                if !self.of_body(body).any(|index| index == arbiter.id.index) {
                    return Err(format!("{:?} is missing from the list of body {body}", arbiter.id));
                }
            }
        }
        Ok(())
    }
}

/// Merges two lists in key order without what is not awake, and returns the number of entries. What slept and woke since the
/// last merge stands in both lists: it is taken once.
fn merge(sorted: &[Entry], fresh: &[Entry], awake: &[u64], merged: &mut [Entry]) -> usize {
    let mut count = 0;
    let mut add = |entry: Entry| {
        if count == 0 || merged[count - 1] != entry {
            merged[count] = entry;
            count += 1;
        }
    };
    let mut fresh = fresh.iter().peekable();
    for entry in sorted.iter().filter(|entry| entry.is_live(awake)) {
        while let Some(new) = fresh.next_if(|new| new.key <= entry.key) {
            add(*new);
        }
        add(*entry);
    }
    fresh.for_each(|new| add(*new));
    count
}

#[cfg(test)]
mod tests {
    use super::*;

    fn body(index: u32) -> BodyId {
        BodyId { index, generation: 0 }
    }

    #[test]
    fn the_solving_order_follows_the_keys_whatever_the_history() {
        let mut store = ArbiterStore::default();
        let c = store.create(ArbiterKey::new(3, 1), body(1), body(2));
        let a = store.create(ArbiterKey::new(1, 2), body(1), body(3));
        assert_eq!(store.awake_by_key(None).iter().map(|e| e.index).collect::<Vec<_>>(), [a, c]);
        store.remove(c);
        let b = store.create(ArbiterKey::new(1, 3), body(2), body(3));
        assert_eq!(b, c, "the place is reused");
        store.set_awake(a, false);
        store.set_awake(a, true);
        assert_eq!(store.awake_by_key(None).iter().map(|e| e.index).collect::<Vec<_>>(), [a, b]);
        store.validate().unwrap();
    }

    /// 6,000 arbiters made together, of which a third ends, as many begin and some sleep: halves merged by two threads are the
    /// order that one thread finds.
    #[test]
    fn many_arbiters_come_and_go_alike_on_any_number_of_threads() {
        let orders = [1, 2, 3].map(|threads| {
            let (mut store, mut pool) = (ArbiterStore::default(), StagePool::new(threads));
            let name = |nth: usize| Name {
                key: ArbiterKey::new((nth * 7919 % 6007) as u64, nth as u64),
                bodies: [body(nth as u32 % 50), body(50 + nth as u32 % 61)],
            };
            store.create_many(6000, 111, &mut pool, name, |nth, arbiter| arbiter.pair = nth as u32);
            assert_eq!(store.awake_by_key(Some(&mut pool)).len(), 6000);
            let ended: Vec<u32> = store.iter().map(|a| a.id.index).filter(|index| index % 3 == 0).collect();
            store.remove_many(&ended, &mut pool, |nth, arbiter| assert_eq!(arbiter.id.index, ended[nth]));
            store.create_many(2500, 111, &mut pool, |nth| name(6000 + nth), |nth, arbiter| arbiter.pair = nth as u32);
            for index in (0..6000).step_by(10) {
                let alive = store.at(index).alive;
                store.set_awake(index, false);
                store.set_awake(index, alive && index % 20 == 0);
            }
            store.validate().unwrap();
            store.awake_by_key(Some(&mut pool)).iter().map(|e| (e.key, e.generation)).collect::<Vec<_>>()
        });
        assert!(orders[0].is_sorted() && orders[0].len() == 6500 - 300, "{}", orders[0].len());
        assert!(orders[1] == orders[0] && orders[2] == orders[0]);
    }

    #[test]
    fn lists_of_bodies_survive_removal_in_any_order() {
        let mut store = ArbiterStore::default();
        let all: Vec<u32> = (0..6).map(|i| store.create(ArbiterKey::new(0, i), body(0), body(1 + i as u32))).collect();
        for index in [all[2], all[0], all[5]] {
            store.remove(index);
            store.validate().unwrap();
        }
        assert_eq!(store.of_body(0).count(), 3);
    }
}
