//! All pairs of overlapping leaves of which at least one is marked, found by walking two trees at once.
//!
//! A pair of subtrees whose boxes overlap splits into the pairs of their children, and a subtree paired with itself into its
//! two children, each with itself, and the pair of them. So every pair of leaves is reached exactly once: two leaves that
//! have both moved need no rule about who reports. A pair of subtrees in which nothing is marked is dropped at once, so a
//! resting world costs nothing. Compared with one query from the root for each moved leaf, the upper levels are walked once
//! rather than thousands of times.
//!
//! The work is a list of [`LinkPair`]s that do not depend on each other. [`PairSearch::split`] cuts it into parts for any
//! number of threads; the union of what they find does not depend on the cut.

use super::{DynamicTree, Link, MAX_HEIGHT, MOVED};

/// A pair of subtrees splits into at most so many.
const MOST: usize = 4;

/// Pairs that wait at most: each step down, in either tree, leaves all but one of [`MOST`] behind.
const STACK: usize = 2 * MAX_HEIGHT as usize * (MOST - 1) + MOST;

/// Two subtrees to be searched for pairs, or one to be searched against itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LinkPair(Link, Link);

impl LinkPair {
    #[inline(always)]
    fn is_leaves(self) -> bool {
        self.0.is_leaf() & self.1.is_leaf()
    }
}

/// A leaf of a pair found.
#[derive(Clone, Copy, Debug)]
pub struct FoundLeaf(Link);

impl FoundLeaf {
    /// Its number.
    #[inline(always)]
    pub fn index(self) -> usize {
        self.0.index()
    }

    /// Whether it is marked.
    #[inline(always)]
    pub fn is_marked(self) -> bool {
        self.0.is_moved()
    }
}

/// A search for pairs between two trees, or inside one.
#[derive(Clone, Copy, Debug)]
pub struct PairSearch<'a> {
    left: &'a DynamicTree,
    right: &'a DynamicTree,
    /// Both are the same tree, and equal links mean a subtree against itself.
    within: bool,
}

impl<'a> PairSearch<'a> {
    /// Pairs inside one tree.
    pub fn within(tree: &'a DynamicTree) -> Self {
        Self { left: tree, right: tree, within: true }
    }

    /// Pairs of a leaf of `left` and a leaf of `right`.
    pub fn between(left: &'a DynamicTree, right: &'a DynamicTree) -> Self {
        Self { left, right, within: false }
    }

    /// Replaces `parts` by about `count` independent parts of the work, in a fixed order.
    pub fn split(&self, count: usize, parts: &mut Vec<LinkPair>) {
        parts.clear();
        let (a, b) = (self.left.root, self.right.root);
        if a == Link::NONE || b == Link::NONE || !any_moved(a, b) {
            return;
        }
        if self.within || self.left.box_of(a).overlaps(&self.right.box_of(b)) {
            parts.push(LinkPair(a, b));
        }
        let mut next = 0;
        while next < parts.len() && parts.len() < count {
            let part = parts[next];
            if part.is_leaves() {
                next += 1;
            } else {
                parts.remove(next);
                let mut children = [part; MOST];
                let found = self.expand(part, &mut children);
                parts.extend_from_slice(&children[..found]);
            }
        }
    }

    /// Works a part off, calling `emit` with both leaves of each pair.
    pub fn run(&self, part: LinkPair, mut emit: impl FnMut(FoundLeaf, FoundLeaf)) {
        let mut stack = [part; STACK];
        let mut depth = 1;
        while depth > 0 {
            depth -= 1;
            let part = stack[depth];
            if part.is_leaves() {
                if !(self.within && part.0 == part.1) {
                    emit(FoundLeaf(part.0), FoundLeaf(part.1));
                }
                continue;
            }
            if let Some(free) = stack[depth..].first_chunk_mut() {
                depth += self.expand(part, free);
            }
        }
    }

    /// The pairs of children that overlap and hold a mark: an array and how many of it count.
    ///
    /// Which pairs overlap cannot be predicted, so each is written in any case and the count decides: three quarters
    /// of the time of a version with branches. They go straight to where they are read again, four bytes at a time: copied in
    /// larger pieces they cost a third more.
    #[inline(always)]
    fn expand(&self, LinkPair(a, b): LinkPair, out: &mut [LinkPair; MOST]) -> usize {
        let mut found = 0;
        if self.within && a == b {
            let node = &self.left.nodes[a.index()];
            let [first, second] = node.children;
            for child in [first, second] {
                out[found] = LinkPair(child, child);
                found += usize::from(child.is_moved() & !child.is_leaf());
            }
            out[found] = LinkPair(first, second);
            found += usize::from(any_moved(first, second) & node.bounds[0].overlaps(&node.bounds[1]));
        } else if a.is_leaf() {
            let aabb = &self.left.leaves[a.index()].aabb;
            let node = &self.right.nodes[b.index()];
            for (child, bounds) in node.children.into_iter().zip(&node.bounds) {
                out[found] = LinkPair(a, child);
                found += usize::from(any_moved(a, child) & bounds.overlaps(aabb));
            }
        } else if b.is_leaf() {
            let aabb = &self.right.leaves[b.index()].aabb;
            let node = &self.left.nodes[a.index()];
            for (child, bounds) in node.children.into_iter().zip(&node.bounds) {
                out[found] = LinkPair(child, b);
                found += usize::from(any_moved(child, b) & bounds.overlaps(aabb));
            }
        } else {
            let (left, right) = (&self.left.nodes[a.index()], &self.right.nodes[b.index()]);
            for lane in 0..4 {
                let (i, j) = (lane >> 1, lane & 1);
                let (first, second) = (left.children[i], right.children[j]);
                if any_moved(first, second) {
                    out[found & 3] = LinkPair(first, second);
                    found += usize::from(left.bounds[i].overlaps(&right.bounds[j]));
                }
            }
        }
        found
    }
}

#[inline(always)]
fn any_moved(a: Link, b: Link) -> bool {
    (a.0 | b.0) & MOVED != 0
}
