//! The broad phase: which shapes may touch, by their boxes.
//!
//! Each shape has a *proxy*: a leaf in one of two [`DynamicTree`]s, one for what stands still and one for what moves. The
//! leaf's box is *fat*: larger than the shape by a margin, so that a shape that creeps or jitters changes nothing. Only when
//! the tight box leaves the fat one is the proxy moved and marked, and only pairs with a marked proxy are looked for.
//!
//! A step is: [`BroadPhase::update`] for each moved shape, then [`BroadPhase::find_pairs`]. To spread the work over
//! threads, let them write boxes with [`Boxes::update`] and call [`BroadPhase::lift`] with the shapes of which it said that
//! they have moved; and call the three parts of the search: [`BroadPhase::prepare`], which also cuts the work into
//! independent parts, [`BroadPhase::pairs_of`] for each part with buffers of the thread's own, and [`BroadPhase::finish`] with
//! all that was found. The result is sorted, so it does not depend on how the work was cut or who did it. Nothing is ever
//! dropped: all buffers grow.
//!
//! A search meets the pairs that are known already again and again. Most are told from new ones without looking them up: the
//! boxes of both shapes overlapped in the last search too. A caller that drops a pair although its boxes overlap says so with
//! [`BroadPhase::forget`].
//!
//! Keeping the trees good: marked boxes are refitted each step, every [`REBUILD_INTERVAL`]th search rebuilds what has
//! moved since the last rebuild, and a tree that many shapes were added to is built anew.

mod pair_set;
mod tree;

pub use pair_set::PairSet;
pub use tree::DynamicTree;

use crate::math::{Aabb, Real, Vec3};
use crate::parallel::{SharedSlice, StagePool};
use pair_set::pair_key;
use tree::{Leaf, LinkPair, PairSearch};

/// Searches from one rebuild of what has moved to the next.
///
/// In between, boxes are refitted, which keeps them tight but lets subtrees grow into each other. Measured with 8,000
/// boxes that all leave their fat box every step: in all, 1 costs about 30 % more than 8 and 32 about 20 % more.
const REBUILD_INTERVAL: u32 = 8;

/// Which tree a proxy lives in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TreeKind {
    /// Shapes of static bodies. They never pair with each other.
    Static,
    /// Shapes of dynamic and kinematic bodies.
    Moving,
}

/// Where a shape's box is.
#[derive(Clone, Copy, Debug)]
struct Proxy {
    /// [`NO_LEAF`] for an index without proxy.
    leaf: u32,
    kind: TreeKind,
}

const NO_LEAF: u32 = u32::MAX;

/// A part of the search for pairs that does not depend on the others.
#[derive(Clone, Copy, Debug)]
pub struct PairWork {
    links: LinkPair,
    /// Moving against static, rather than moving against moving.
    between: bool,
}

/// The boxes of all shapes while threads move them.
pub struct Boxes<'a> {
    proxies: &'a [Proxy],
    fixed: &'a DynamicTree,
    moving: SharedSlice<'a, Leaf>,
}

impl Boxes<'_> {
    /// Whether a static shape's fat box overlaps `aabb`.
    pub fn meets_static(&self, aabb: &Aabb) -> bool {
        let mut meets = false;
        self.fixed.query(aabb, |_| {
            meets = true;
            false
        });
        meets
    }

    /// Gives a shape of a moving body the box `fat` if the `tight` box has left its old one, and tells whether that was so.
    ///
    /// # Safety
    /// No other thread may update the same shape at the same time.
    #[inline(always)]
    pub unsafe fn update(&self, shape: u32, tight: &Aabb, fat: impl FnOnce() -> Aabb) -> bool {
        let Some(&Proxy { leaf, kind: TreeKind::Moving }) = self.proxies.get(shape as usize) else { return false };
        if leaf == NO_LEAF {
            return false;
        }
        // SAFETY: a leaf belongs to one shape, and the caller promises that no one else is at this one.
        let leaf = unsafe { self.moving.get_mut(leaf as usize) };
        let left = !leaf.aabb.contains(tight);
        if left {
            leaf.aabb = fat();
        }
        left
    }
}

/// The boxes of all shapes, by shape index.
#[derive(Clone, Debug, Default)]
pub struct BroadPhase {
    fixed: DynamicTree,
    moving: DynamicTree,
    proxies: Vec<Proxy>,
    /// By leaf of the moving tree: its box in the last search; empty if it was not there, or a pair of it was dropped.
    seen: Vec<Aabb>,
    searches: u32,
    /// Whether the trees are ready for the next search.
    tight: bool,
    /// Kept for their memory.
    work: Vec<PairWork>,
    links: Vec<LinkPair>,
}

impl BroadPhase {
    /// No proxies.
    pub fn new() -> Self {
        Self::default()
    }

    /// Number of proxies.
    pub fn len(&self) -> usize {
        self.fixed.len() + self.moving.len()
    }

    /// Gives a shape a proxy with a fat box. Its pairs are found by the next search.
    pub fn add(&mut self, shape: u32, kind: TreeKind, fat: Aabb) {
        let index = shape as usize;
        if self.proxies.len() <= index {
            self.proxies.resize(index + 1, Proxy { leaf: NO_LEAF, kind });
        }
        debug_assert!(self.proxies[index].leaf == NO_LEAF, "shape {shape} has a proxy already");
        let tree = self.tree_mut(kind);
        let leaf = tree.insert(fat, shape);
        tree.mark(leaf);
        if kind == TreeKind::Moving {
            if self.seen.len() <= leaf as usize {
                self.seen.resize(leaf as usize + 1, Aabb::EMPTY);
            }
            self.seen[leaf as usize] = Aabb::EMPTY;
        }
        self.proxies[index] = Proxy { leaf, kind };
    }

    /// Takes a shape's proxy out. The caller knows the shape's pairs and drops them.
    pub fn remove(&mut self, shape: u32) {
        let Some(proxy) = self.proxy(shape) else { return };
        self.tree_mut(proxy.kind).remove(proxy.leaf);
        self.proxies[shape as usize].leaf = NO_LEAF;
    }

    /// Moves the proxy to `fat` if the `tight` box has left its fat one, and tells whether that was so.
    #[inline]
    pub fn update(&mut self, shape: u32, tight: &Aabb, fat: &Aabb) -> bool {
        let Some(proxy) = self.proxy(shape) else { return false };
        let tree = self.tree_mut(proxy.kind);
        if tree.aabb(proxy.leaf).contains(tight) {
            return false;
        }
        tree.move_leaf(proxy.leaf, fat);
        true
    }

    /// The boxes of all shapes, for several threads to move.
    pub fn boxes(&mut self) -> Boxes<'_> {
        Boxes { proxies: &self.proxies, fixed: &self.fixed, moving: SharedSlice::new(self.moving.leaves_mut()) }
    }

    /// Brings the tree up to date with what [`Boxes::update`] has moved: `moved` are the shapes, in any order.
    pub fn lift(&mut self, moved: &[u32], pool: Option<&mut StagePool>) {
        let proxies = &self.proxies;
        self.moving.lift_leaves(moved.len(), |at| proxies[moved[at] as usize].leaf, pool);
    }

    /// Has the next search find the pairs of a shape anew, though it has not moved: its filter has changed, say.
    pub fn touch(&mut self, shape: u32) {
        if let Some(proxy) = self.proxy(shape) {
            self.tree_mut(proxy.kind).mark(proxy.leaf);
        }
        self.forget(shape);
    }

    /// A pair of the shape is dropped by other means than its boxes' parting: the next search in which the two meet with a
    /// mark does not call them known.
    pub fn forget(&mut self, shape: u32) {
        if let Some(Proxy { leaf, kind: TreeKind::Moving }) = self.proxy(shape) {
            self.seen[leaf as usize] = Aabb::EMPTY;
        }
    }

    /// The fat box of a shape with a proxy.
    pub fn fat_aabb(&self, shape: u32) -> Option<&Aabb> {
        self.proxy(shape).map(|proxy| self.tree(proxy.kind).aabb(proxy.leaf))
    }

    /// One of the two trees.
    pub fn tree(&self, kind: TreeKind) -> &DynamicTree {
        match kind {
            TreeKind::Static => &self.fixed,
            TreeKind::Moving => &self.moving,
        }
    }

    /// Finds all pairs of shapes with overlapping fat boxes of which one has moved since the last search, which `filter`
    /// lets pass; not those of two static shapes. `out` is overwritten: smaller shape first, sorted, each pair once.
    ///
    /// The filter is also told whether the pair is known: it has been met by an earlier search, and its boxes have overlapped
    /// ever since. One that rejects the pairs that the caller has already makes the result the new pairs.
    pub fn find_pairs(&mut self, filter: impl Fn(u32, u32, bool) -> bool, out: &mut Vec<(u32, u32)>) {
        out.clear();
        self.prepare(1);
        for part in self.work() {
            self.pairs_of(part, &filter, |a, b| out.push((a, b)));
        }
        self.finish(out, None);
    }

    /// Tightens the trees and cuts the search into about `parts` independent parts a pair of trees.
    pub fn prepare(&mut self, parts: usize) {
        self.tighten();
        self.tight = false;
        let (mut work, mut links) = (std::mem::take(&mut self.work), std::mem::take(&mut self.links));
        work.clear();
        for between in [false, true] {
            self.search(between).split(parts, &mut links);
            work.extend(links.iter().map(|&links| PairWork { links, between }));
        }
        (self.work, self.links) = (work, links);
    }

    /// The first part of [`BroadPhase::prepare`], for one thread to do while others have better to do: tightens the trees.
    /// Nothing may move between this and the search.
    pub fn tighten(&mut self) {
        if std::mem::replace(&mut self.tight, true) {
            return;
        }
        self.searches = self.searches.wrapping_add(1);
        let rebuild = self.searches.is_multiple_of(REBUILD_INTERVAL);
        for tree in [&mut self.fixed, &mut self.moving] {
            if tree.wants_rebuild() {
                tree.rebuild();
            } else if rebuild {
                tree.rebuild_loose();
            } else {
                tree.refit_marked();
            }
        }
    }

    /// The parts of the search prepared.
    pub fn work(&self) -> &[PairWork] {
        &self.work
    }

    /// Calls `emit` with the pairs of one part of the work, in no particular order.
    pub fn pairs_of(&self, part: &PairWork, filter: impl Fn(u32, u32, bool) -> bool, mut emit: impl FnMut(u32, u32)) {
        let second = if part.between { &self.fixed } else { &self.moving };
        self.search(part.between).run(part.links, |left, right| {
            let before = &self.seen[left.index()];
            let known = if part.between {
                !right.is_marked() && before.overlaps(second.aabb(right.index() as u32))
            } else {
                before.overlaps(&self.seen[right.index()])
            };
            let (a, b) = (self.moving.data(left.index() as u32), second.data(right.index() as u32));
            let pair = if a < b { (a, b) } else { (b, a) };
            if filter(pair.0, pair.1, known) {
                emit(pair.0, pair.1);
            }
        });
    }

    /// Whether the next search has something to do.
    pub fn has_moved(&self) -> bool {
        self.moving.has_marks() || self.fixed.has_marks()
    }

    /// Sorts what all parts have found and forgets what has moved.
    pub fn finish(&mut self, out: &mut [(u32, u32)], pool: Option<&mut StagePool>) {
        out.sort_unstable_by_key(|&(a, b)| pair_key(a, b));
        self.fixed.clear_marks(|_, _| (), None);
        let seen = SharedSlice::new(&mut self.seen);
        // SAFETY: each leaf is visited once.
        self.moving.clear_marks(|leaf, aabb| unsafe { *seen.get_mut(leaf) = *aabb }, pool);
    }

    /// Calls `visit` with each static shape whose fat box overlaps `aabb`.
    pub fn query_static(&self, aabb: &Aabb, mut visit: impl FnMut(u32)) {
        self.fixed.query(aabb, |shape| {
            visit(shape);
            true
        });
    }

    /// Calls `visit` with each shape whose fat box overlaps `aabb`, static ones first, until it returns `false`.
    pub fn query(&self, aabb: &Aabb, mut visit: impl FnMut(u32) -> bool) {
        let mut go_on = true;
        for tree in [&self.fixed, &self.moving] {
            if go_on {
                tree.query(aabb, |shape| {
                    go_on = visit(shape);
                    go_on
                });
            }
        }
    }

    /// Calls `visit` with each shape whose fat box the ray meets, static ones first; see [`DynamicTree::ray`].
    #[inline]
    pub fn ray(&self, origin: Vec3, direction: Vec3, max_fraction: Real, mut visit: impl FnMut(u32, Real) -> Real) {
        self.each_tree(max_fraction, |tree, limit| {
            tree.ray(origin, direction, *limit, |shape, present| {
                *limit = crate::math::min(visit(shape, present), present);
                *limit
            });
        });
    }

    /// Calls `visit` with each shape whose fat box a moving box meets, static ones first; see [`DynamicTree::cast`].
    pub fn cast(
        &self,
        (origin, half): (Vec3, Vec3),
        direction: Vec3,
        max_fraction: Real,
        mut visit: impl FnMut(u32, Real) -> Real,
    ) {
        self.each_tree(max_fraction, |tree, limit| {
            tree.cast((origin, half), direction, *limit, |shape, present| {
                *limit = crate::math::min(visit(shape, present), present);
                *limit
            });
        });
    }

    /// Calls `visit` with each shape whose fat box is near, static ones first; see [`DynamicTree::nearest`].
    pub fn nearest(&self, aabb: &Aabb, limit: Real, mut visit: impl FnMut(u32, Real) -> Real) {
        self.each_tree(limit, |tree, limit| {
            tree.nearest(aabb, *limit, |shape, present| {
                *limit = crate::math::min(visit(shape, present), present);
                *limit
            });
        });
    }

    /// Searches both trees, the second with the limit that the first has left, unless that is negative.
    #[inline(always)]
    fn each_tree(&self, limit: Real, mut search: impl FnMut(&DynamicTree, &mut Real)) {
        let mut limit = limit;
        for tree in [&self.fixed, &self.moving] {
            if limit >= 0.0 {
                search(tree, &mut limit);
            }
        }
    }

    /// Checks both trees and that shapes and leaves know each other.
    ///
    /// # Errors
    /// The first violation found, in words.
    pub fn validate(&self) -> Result<(), String> {
        self.fixed.validate().map_err(|error| format!("static tree: {error}"))?;
        self.moving.validate().map_err(|error| format!("moving tree: {error}"))?;
        let mut count = 0;
        for (shape, proxy) in self.proxies.iter().enumerate().filter(|(_, proxy)| proxy.leaf != NO_LEAF) {
            count += 1;
            if self.tree(proxy.kind).data(proxy.leaf) as usize != shape {
                return Err(format!("shape {shape}: leaf {} belongs to another shape", proxy.leaf));
            }
        }
        if count == self.len() { Ok(()) } else { Err(format!("{count} proxies, {} leaves", self.len())) }
    }

    fn search(&self, between: bool) -> PairSearch<'_> {
        if between { PairSearch::between(&self.moving, &self.fixed) } else { PairSearch::within(&self.moving) }
    }

    #[inline]
    fn proxy(&self, shape: u32) -> Option<Proxy> {
        self.proxies.get(shape as usize).copied().filter(|proxy| proxy.leaf != NO_LEAF)
    }

    #[inline]
    fn tree_mut(&mut self, kind: TreeKind) -> &mut DynamicTree {
        match kind {
            TreeKind::Static => &mut self.fixed,
            TreeKind::Moving => &mut self.moving,
        }
    }
}

#[cfg(test)]
mod tests;
