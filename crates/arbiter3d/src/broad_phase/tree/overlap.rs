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

use super::{DynamicTree, Link};

/// Two subtrees to be searched for pairs, or one to be searched against itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LinkPair(Link, Link);

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
        self.start(parts);
        let mut next = 0;
        while parts.len() - next > 0 && parts.len() < count {
            let part = parts[next];
            if part.0.is_leaf() && part.1.is_leaf() {
                next += 1;
                continue;
            }
            parts.remove(next);
            self.expand(part, parts);
        }
    }

    /// The whole work as one part, if there is any.
    pub fn start(&self, parts: &mut Vec<LinkPair>) {
        let (a, b) = (self.left.root, self.right.root);
        if a == Link::NONE || b == Link::NONE || !(a.is_moved() || b.is_moved()) {
            return;
        }
        if self.within || self.left.box_of(a).overlaps(&self.right.box_of(b)) {
            parts.push(LinkPair(a, b));
        }
    }

    /// Works the parts off, calling `emit` with the data of both leaves of each pair. `parts` is left empty.
    pub fn run(&self, parts: &mut Vec<LinkPair>, mut emit: impl FnMut(u32, u32)) {
        while let Some(part) = parts.pop() {
            if part.0.is_leaf() && part.1.is_leaf() {
                if !(self.within && part.0 == part.1) {
                    emit(self.left.leaves[part.0.index()].data, self.right.leaves[part.1.index()].data);
                }
                continue;
            }
            self.expand(part, parts);
        }
    }

    /// Appends the pairs of children that overlap and hold a mark.
    #[inline(always)]
    fn expand(&self, LinkPair(a, b): LinkPair, parts: &mut Vec<LinkPair>) {
        if self.within && a == b {
            let node = &self.left.nodes[a.index()];
            let [first, second] = node.children;
            if (first.is_moved() || second.is_moved()) && node.bounds[0].overlaps(&node.bounds[1]) {
                parts.push(LinkPair(first, second));
            }
            for child in [first, second] {
                if child.is_moved() && !child.is_leaf() {
                    parts.push(LinkPair(child, child));
                }
            }
        } else if a.is_leaf() {
            let aabb = &self.left.leaves[a.index()].aabb;
            let node = &self.right.nodes[b.index()];
            for side in 0..2 {
                let child = node.children[side];
                if (a.is_moved() || child.is_moved()) && node.bounds[side].overlaps(aabb) {
                    parts.push(LinkPair(a, child));
                }
            }
        } else if b.is_leaf() {
            let aabb = &self.right.leaves[b.index()].aabb;
            let node = &self.left.nodes[a.index()];
            for side in 0..2 {
                let child = node.children[side];
                if (b.is_moved() || child.is_moved()) && node.bounds[side].overlaps(aabb) {
                    parts.push(LinkPair(child, b));
                }
            }
        } else {
            let (left, right) = (&self.left.nodes[a.index()], &self.right.nodes[b.index()]);
            for i in 0..2 {
                for j in 0..2 {
                    let (first, second) = (left.children[i], right.children[j]);
                    if (first.is_moved() || second.is_moved()) && left.bounds[i].overlaps(&right.bounds[j]) {
                        parts.push(LinkPair(first, second));
                    }
                }
            }
        }
    }
}
