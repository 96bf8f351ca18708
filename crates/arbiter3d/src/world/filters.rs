//! Filters of the user's own: which pairs are looked at, and which manifolds count.

use super::World;
use super::pairs::Pair;
use crate::arbiter::EndReason;
use crate::id::{BodyId, ShapeId};
use crate::narrow_phase::Manifold;

/// Two shapes that may collide; shape 1 has the smaller id.
///
/// ```
/// use arbiter3d::World;
/// let mut world = World::default();
/// // Only neighbours in creation order collide.
/// world.set_pair_filter(Some(Box::new(|pair| pair.shape2.raw() - pair.shape1.raw() == 1)));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ShapePair {
    /// Shape with the smaller id.
    pub shape1: ShapeId,
    /// The other shape.
    pub shape2: ShapeId,
    /// Body of shape 1.
    pub body1: BodyId,
    /// Body of shape 2.
    pub body2: BodyId,
}

/// Decides whether two shapes whose boxes have come together collide at all: `true` lets them.
pub type PairFilter = Box<dyn Fn(&ShapePair) -> bool + Send + Sync>;

/// Sees each new manifold, in the frame of shape 1, before it becomes contacts; may change it; `false` drops it.
///
/// Called from all threads, in no particular order.
pub type ContactFilter = Box<dyn Fn(&ShapePair, &mut Manifold) -> bool + Send + Sync>;

/// The filters set.
#[derive(Default)]
pub(crate) struct UserFilters {
    pub pair: Option<PairFilter>,
    pub contact: Option<ContactFilter>,
}

impl std::fmt::Debug for UserFilters {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("UserFilters")
            .field("pair", &self.pair.is_some())
            .field("contact", &self.contact.is_some())
            .finish()
    }
}

impl World {
    /// Asks `filter` about each pair of shapes whose boxes come together, after the shapes' own filters. Pairs that exist are
    /// asked about again at once; arbiters that this rules out end. `None` lets all pass.
    pub fn set_pair_filter(&mut self, filter: Option<PairFilter>) {
        self.filters.pair = filter;
        for index in 0..self.pairs.len() as u32 {
            let pair = &self.pairs[index as usize];
            if pair.alive && !self.passes_pair_filter(pair.shapes[0], pair.shapes[1]) {
                self.remove_pair(index, EndReason::FilterChanged);
            }
        }
        for slot in 0..self.shapes.len() as u32 {
            self.broad_phase.touch(slot);
            self.note_still(slot);
        }
        self.flush_events();
    }

    /// Shows `filter` each new manifold before it becomes contacts. While one is set, manifolds are made anew in each step.
    /// `None` lets all pass.
    pub fn set_contact_filter(&mut self, filter: Option<ContactFilter>) {
        self.filters.contact = filter;
        for pair in &mut self.pairs {
            pair.has_manifold = false;
        }
    }

    pub(crate) fn passes_pair_filter(&self, a: u32, b: u32) -> bool {
        self.filters.passes_pair((&self.shapes, &self.bodies), [a, b])
    }
}

impl UserFilters {
    /// Whether the pair filter lets two shapes collide.
    pub fn passes_pair(
        &self,
        (shapes, bodies): (&[super::shapes::ShapeSlot], &[super::bodies::Body]),
        pair: [u32; 2],
    ) -> bool {
        let Some(filter) = &self.pair else { return true };
        let [a, b] = pair.map(|slot| &shapes[slot as usize]);
        let (s1, s2) = if a.id < b.id { (a, b) } else { (b, a) };
        let id = |index: u32| BodyId { index, generation: bodies[index as usize].generation };
        filter(&ShapePair { shape1: s1.id, shape2: s2.id, body1: id(s1.body), body2: id(s2.body) })
    }

    /// Whether the manifold counts; the filter may change it.
    pub fn passes_contact(
        &self,
        pair: &Pair,
        context: (&[super::shapes::ShapeSlot], &[super::bodies::Body]),
        manifold: &mut Manifold,
    ) -> bool {
        self.passes_manifold(context, pair.shapes, manifold)
    }

    /// The same for two shapes that may have no pair; the first has the smaller id.
    pub fn passes_manifold(
        &self,
        (shapes, bodies): (&[super::shapes::ShapeSlot], &[super::bodies::Body]),
        slots: [u32; 2],
        manifold: &mut Manifold,
    ) -> bool {
        let Some(filter) = &self.contact else { return true };
        let [s1, s2] = slots.map(|slot| &shapes[slot as usize]);
        let id = |index: u32| BodyId { index, generation: bodies[index as usize].generation };
        filter(&ShapePair { shape1: s1.id, shape2: s2.id, body1: id(s1.body), body2: id(s2.body) }, manifold)
    }
}
