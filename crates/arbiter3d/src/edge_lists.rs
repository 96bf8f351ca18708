//! Lists of what ties two bodies: their pairs, or their arbiters.
//!
//! A tie has a *place*, the same as its record, and hangs on a list of each of its two bodies. The lists are doubly linked, so
//! that ties come and go in constant time and a world in steady state allocates nothing. Heads and links stand apart from the
//! records: sixteen bytes a tie, so that those of tens of thousands fit a core's cache, where each neighbour's record would be
//! a miss of its own; and one thread can hang ties on their lists while others fill the records.
//!
//! An *edge* is a side of a tie, `place * 2 + side`.

use crate::place_table::NONE;
use crate::storage;

/// Neighbours of a tie in the lists of its two bodies, as edges.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(16))] // never across two cache lines
struct Links {
    next: [u32; 2],
    previous: [u32; 2],
}

impl Links {
    const NONE: Self = Self { next: [NONE; 2], previous: [NONE; 2] };
}

/// The ties of each body.
#[derive(Clone, Debug, Default)]
pub(crate) struct EdgeLists {
    /// First edge of each body.
    heads: Vec<u32>,
    /// By place.
    links: Vec<Links>,
}

impl EdgeLists {
    /// Makes room for so many places and bodies.
    pub fn grow(&mut self, places: usize, bodies: usize) {
        if self.links.len() < places {
            storage::reserve(&mut self.links, places);
            self.links.resize(places, Links::NONE);
        }
        if self.heads.len() < bodies {
            storage::reserve(&mut self.heads, bodies);
            self.heads.resize(bodies, NONE);
        }
    }

    /// Puts a tie in front of the lists of its bodies. There must be room.
    #[inline]
    pub fn link(&mut self, place: u32, bodies: [u32; 2]) {
        for (side, body) in bodies.into_iter().enumerate() {
            let edge = place * 2 + side as u32;
            let head = std::mem::replace(&mut self.heads[body as usize], edge);
            let links = &mut self.links[place as usize];
            (links.next[side], links.previous[side]) = (head, NONE);
            if head != NONE {
                self.links[(head >> 1) as usize].previous[(head & 1) as usize] = edge;
            }
        }
    }

    /// Takes a tie out of the lists of its bodies.
    #[inline]
    pub fn unlink(&mut self, place: u32, bodies: [u32; 2]) {
        for (side, body) in bodies.into_iter().enumerate() {
            let links = &self.links[place as usize];
            let (next, previous) = (links.next[side], links.previous[side]);
            if next != NONE {
                self.links[(next >> 1) as usize].previous[(next & 1) as usize] = previous;
            }
            if previous == NONE {
                self.heads[body as usize] = next;
            } else {
                self.links[(previous >> 1) as usize].next[(previous & 1) as usize] = next;
            }
        }
    }

    /// Places of the ties of a body, the latest first.
    pub fn of_body(&self, body: u32) -> impl Iterator<Item = u32> + '_ {
        let mut edge = self.heads.get(body as usize).copied().unwrap_or(NONE);
        std::iter::from_fn(move || {
            if edge == NONE {
                return None;
            }
            let place = edge >> 1;
            edge = self.links[place as usize].next[(edge & 1) as usize];
            Some(place)
        })
    }

    /// Asks for the links of a tie.
    #[inline]
    pub fn prefetch(&self, place: u32) {
        if let Some(links) = self.links.get(place as usize) {
            crate::simd::prefetch(links);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::EdgeLists;
    use crate::random::Random;
    use std::collections::BTreeMap;

    /// 20,000 random edits on 60 places and 9 bodies: each body has the ties of a model, the latest first.
    #[test]
    fn bodies_have_their_ties_whatever_came_and_went() {
        let (mut lists, mut model) = (EdgeLists::default(), BTreeMap::new());
        lists.grow(60, 9);
        let mut random = Random(11);
        for edit in 0..20_000_u32 {
            let place = random.below(60);
            if let Some((_, bodies)) = model.remove(&place) {
                lists.unlink(place, bodies);
            } else {
                let first = random.below(9);
                let bodies = [first, (first + 1 + random.below(8)) % 9];
                model.insert(place, (edit, bodies));
                lists.link(place, bodies);
            }
            for body in 0..9 {
                let mut wanted: Vec<_> = model
                    .iter()
                    .filter(|(_, (_, bodies))| bodies.contains(&body))
                    .map(|(&p, &(e, _))| (e, p))
                    .collect();
                wanted.sort_unstable_by(|a, b| b.cmp(a));
                assert!(lists.of_body(body).eq(wanted.into_iter().map(|(_, place)| place)));
            }
        }
        assert_eq!(lists.of_body(100).next(), None);
    }
}
