//! Islands: bodies tied together by contacts, which sleep and wake as one.
//!
//! Nothing is kept while bodies are awake. When some body has rested long enough, the awake bodies are joined along their
//! contacts by union-find; islands all of whose bodies have rested go to sleep. A sleeping island is a list of bodies, kept
//! until one of them is woken. Worlds that are busy everywhere pay nothing, worlds at rest pay once.
//!
//! Roots are always the smallest member, so the result depends on the contacts and not on their order.

use crate::arbiter::NONE;
use crate::storage;

/// Finds islands among the bodies of one step.
#[derive(Clone, Debug, Default)]
pub(crate) struct IslandFinder {
    /// Parent of each body, by slot; meaningful for the bodies last reset.
    parents: Vec<u32>,
    /// By root: whether a body of the island is too busy to sleep.
    busy: Vec<bool>,
}

impl IslandFinder {
    /// Starts with each of `bodies` alone.
    pub fn reset(&mut self, slots: usize, bodies: impl Iterator<Item = u32>) {
        self.parents.resize(slots, 0);
        self.busy.resize(slots, false);
        for body in bodies {
            self.parents[body as usize] = body;
            self.busy[body as usize] = false;
        }
    }

    /// The smallest body of the island, shortening the path on the way.
    pub fn root(&mut self, mut body: u32) -> u32 {
        loop {
            let parent = self.parents[body as usize];
            if parent == body {
                return body;
            }
            let grandparent = self.parents[parent as usize];
            self.parents[body as usize] = grandparent;
            body = grandparent;
        }
    }

    /// Ties two bodies.
    pub fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        let (low, high) = (a.min(b), a.max(b));
        self.parents[high as usize] = low;
    }

    /// Notes, when all ties are known, that the island of a body cannot sleep.
    pub fn keep_awake(&mut self, body: u32) {
        let root = self.root(body);
        self.busy[root as usize] = true;
    }

    /// The island of a body, unless some body keeps it awake.
    pub fn idle_root(&mut self, body: u32) -> Option<u32> {
        let root = self.root(body);
        (!self.busy[root as usize]).then_some(root)
    }
}

/// Sleeping islands, each a list of bodies: linked through one array, so that worlds that sleep and wake need no new memory.
#[derive(Clone, Debug, Default)]
pub(crate) struct SleepingIslands {
    /// First body of each island.
    first: Vec<u32>,
    /// By body slot: the body after it in its island.
    next: Vec<u32>,
    free: Vec<u32>,
}

impl SleepingIslands {
    /// Makes room for as many islands as there may be, so that falling asleep allocates nothing.
    pub fn reserve(&mut self, bodies: usize) {
        storage::reserve(&mut self.first, bodies);
        storage::reserve(&mut self.free, bodies);
        storage::reserve(&mut self.next, bodies);
        self.next.resize(bodies.max(self.next.len()), NONE);
    }

    /// Makes an island of bodies of no other and returns its number.
    pub fn add(&mut self, bodies: &[u32]) -> u32 {
        let slots = bodies.iter().fold(self.next.len(), |slots, &body| slots.max(body as usize + 1));
        self.next.resize(slots, NONE);
        let mut after = NONE;
        for &body in bodies.iter().rev() {
            self.next[body as usize] = std::mem::replace(&mut after, body);
        }
        if let Some(number) = self.free.pop() {
            self.first[number as usize] = after;
            return number;
        }
        self.first.push(after);
        (self.first.len() - 1) as u32
    }

    /// Ends an island: its bodies are appended to `bodies`, in the order in which they were given.
    pub fn take(&mut self, number: u32, bodies: &mut Vec<u32>) {
        bodies.extend(self.bodies(number));
        self.first[number as usize] = NONE;
        self.free.push(number);
    }

    /// Bodies of an island.
    pub fn bodies(&self, number: u32) -> impl Iterator<Item = u32> + '_ {
        let listed = |body: u32| (body != NONE).then_some(body);
        std::iter::successors(listed(self.first[number as usize]), move |&body| listed(self.next[body as usize]))
    }

    /// Takes one body out of an island, which stays asleep.
    pub fn remove_body(&mut self, number: u32, body: u32) {
        let next = self.next[body as usize];
        let before = self.bodies(number).find(|&other| self.next[other as usize] == body);
        match before {
            Some(before) => self.next[before as usize] = next,
            None => self.first[number as usize] = next,
        }
        if self.first[number as usize] == NONE {
            self.free.push(number);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn islands_are_named_after_their_smallest_body_in_any_order() {
        let ties = [(4, 7), (1, 4), (2, 3), (7, 9)];
        let mut roots = Vec::new();
        for order in [[0, 1, 2, 3], [3, 2, 1, 0], [1, 3, 0, 2]] {
            let mut finder = IslandFinder::default();
            finder.reset(10, 0..10);
            order.iter().for_each(|&i: &usize| finder.join(ties[i].0, ties[i].1));
            roots.push((0..10).map(|body| finder.root(body)).collect::<Vec<_>>());
        }
        assert_eq!(roots[0], [0, 1, 2, 2, 1, 5, 6, 1, 8, 1]);
        assert!(roots.iter().all(|r| *r == roots[0]));
    }
    #[test]
    fn sleeping_islands_keep_their_bodies_in_order_and_their_numbers_are_used_again() {
        let mut islands = SleepingIslands::default();
        let (a, b) = (islands.add(&[3, 5, 9]), islands.add(&[1]));
        islands.remove_body(a, 5);
        assert_eq!(islands.bodies(a).collect::<Vec<_>>(), [3, 9]);
        islands.remove_body(a, 3);
        islands.remove_body(b, 1);
        assert_eq!(islands.add(&[5, 3]), b);
        assert_eq!(
            (islands.bodies(a).collect::<Vec<_>>(), islands.bodies(b).collect::<Vec<_>>()),
            (vec![9], vec![5, 3])
        );
        let mut taken = vec![7];
        islands.take(b, &mut taken);
        assert_eq!(taken, [7, 5, 3]);
        assert_eq!(islands.add(&[2]), b);
    }
}
