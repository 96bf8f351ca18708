//! What is done to many leaves at once, on several threads: bringing the tree up to date with moved leaves, forgetting marks.
//!
//! The tree is cut below its uppermost nodes into subtrees. Nodes of different subtrees have nothing to do with each other, so
//! threads work off whole subtrees from the bottom up, then one thread the few nodes above. Each subtree is listed parents
//! first, a walk down one side after the other, as a rebuild lays nodes out in memory. Boxes are unions, so it does not matter
//! who makes them in which order.

use super::{DynamicTree, FLAGS, Leaf, MOVED, Node};
use crate::math::Aabb;
use crate::parallel::{SharedSlice, StagePool};
use crate::storage;

/// From one leaf in so many on, moved leaves are lifted together.
const BULK_SHARE: usize = 32;
/// Subtrees to cut a tree into: several for each thread, as they differ in size.
const SUBTREES: usize = 64;
/// Leaves or nodes that a thread takes at a time at least.
const LEAST: usize = 128;

/// All inner nodes, in an order in which threads can work them off.
#[derive(Clone, Debug, Default)]
pub(super) struct Order {
    /// Nodes above the cut, parents first.
    top: Vec<u32>,
    /// Nodes of the subtrees, one after the other, parents first.
    nodes: Vec<u32>,
    /// Where each subtree begins in `nodes`, and where the last one ends; empty when the tree has changed its form since.
    starts: Vec<u32>,
    /// Roots of subtrees to be listed, or what waits on the way down one. Kept for its memory.
    stack: Vec<u32>,
    /// Whether so many leaves are marked that a pass over all nodes pays.
    many_marked: bool,
}

impl Order {
    /// The tree changes its form.
    pub fn clear(&mut self) {
        self.starts.clear();
        self.many_marked = false;
    }

    pub fn is_stale(&self) -> bool {
        self.starts.is_empty()
    }

    /// Whether these are the nodes, in any order.
    pub fn holds(&self, nodes: &[u32]) -> bool {
        let mut mine: Vec<u32> = self.top.iter().chain(&self.nodes).copied().collect();
        let mut theirs = nodes.to_vec();
        mine.sort_unstable();
        theirs.sort_unstable();
        mine == theirs
    }

    /// Lists the nodes below `root`, itself included.
    fn list(&mut self, tree: &[Node], root: u32) {
        let Self { top, nodes, starts, stack, many_marked } = self;
        let inner = |node: u32| {
            let children = tree[node as usize].children.into_iter();
            children.filter(|child| !child.is_leaf()).map(|child| child.index() as u32)
        };
        *many_marked = false;
        for list in [&mut *top, nodes, starts, stack] {
            list.clear();
        }
        stack.push(root);
        // Level by level: what has been passed is the top, what waits are the roots of the subtrees.
        while top.len() < stack.len() && stack.len() - top.len() < SUBTREES {
            let node = stack[top.len()];
            top.push(node);
            stack.extend(inner(node));
        }
        let roots = top.len()..stack.len();
        for at in roots.clone() {
            storage::push(starts, nodes.len() as u32);
            stack.push(stack[at]);
            while stack.len() > roots.end {
                let Some(node) = stack.pop() else { break };
                storage::push(nodes, node);
                stack.extend(inner(node));
                // The first child next.
                let count = stack.len();
                if inner(node).count() == 2 {
                    stack.swap(count - 1, count - 2);
                }
            }
        }
        storage::push(starts, nodes.len() as u32);
    }
}

impl DynamicTree {
    /// Brings the tree up to date with the boxes of the leaves that `leaf_of` finds for `0..count`, and marks them.
    ///
    /// Few are lifted one by one. For many, each hands its box to its node, and one pass over all nodes from the bottom up
    /// makes all boxes tight.
    pub fn lift_leaves(
        &mut self,
        count: usize,
        leaf_of: impl Fn(usize) -> u32 + Sync,
        mut pool: Option<&mut StagePool>,
    ) {
        if count * BULK_SHARE < self.len() || self.len() < 3 {
            (0..count).for_each(|at| self.lift_leaf(leaf_of(at)));
            return;
        }
        if self.order.is_stale() {
            self.order.list(&self.nodes, self.root.index() as u32);
        }
        let (leaves, nodes) = (&self.leaves, SharedSlice::new(&mut self.nodes));
        StagePool::run_ranges_of(pool.as_deref_mut(), count, LEAST, |range| {
            for at in range {
                let Leaf { aabb, parent, .. } = leaves[leaf_of(at) as usize];
                if let Some((node, side)) = parent.split() {
                    // SAFETY: each side of a node belongs to one leaf, and nothing else of it is touched.
                    unsafe {
                        (*nodes.at(node)).bounds[side] = aabb;
                        (*nodes.at(node)).children[side].0 |= FLAGS;
                    }
                }
            }
        });
        let order = &self.order;
        StagePool::run_ranges_of(pool, order.starts.len() - 1, 1, |subtrees| {
            for subtree in subtrees.rev() {
                let range = order.starts[subtree] as usize..order.starts[subtree + 1] as usize;
                for &index in order.nodes[range].iter().rev() {
                    // SAFETY: a subtree is one thread's, and of the node above it each thread writes another side.
                    unsafe { hand_up(&nodes, index as usize) };
                }
            }
        });
        for &index in self.order.top.iter().rev() {
            // SAFETY: there is only this thread now.
            unsafe { hand_up(&nodes, index as usize) };
        }
        self.root.0 |= self.nodes[self.root.index()].flags();
        self.tight = true;
        self.order.many_marked = true;
    }

    /// Whether leaves have been lifted together since the marks were forgotten.
    pub(super) fn has_many_marks(&self) -> bool {
        self.order.many_marked
    }

    /// Lists the nodes anew after a rebuild of a tree with many marks.
    pub(super) fn list_many_marked(&mut self) {
        if !self.root.is_leaf() && self.order.is_stale() {
            self.order.list(&self.nodes, self.root.index() as u32);
        }
        self.order.many_marked = !self.order.is_stale();
    }

    /// Forgets all marks, and calls `visit` with each marked leaf and its box.
    pub fn clear_marks(&mut self, visit: impl Fn(usize, &Aabb) + Sync, pool: Option<&mut StagePool>) {
        if self.is_empty() {
            return;
        }
        if self.root.is_leaf() && self.root.is_moved() {
            visit(self.root.index(), &self.leaves[self.root.index()].aabb);
        }
        if self.order.is_stale() || !std::mem::take(&mut self.order.many_marked) {
            self.collect_marked();
            self.root = self.root.without(MOVED);
            self.marked.iter().for_each(|&index| self.nodes[index as usize].clear_marks(&visit));
            return;
        }
        self.root = self.root.without(MOVED);
        let nodes = SharedSlice::new(&mut self.nodes);
        let (top, below) = (&self.order.top, &self.order.nodes);
        StagePool::run_ranges_of(pool, below.len(), LEAST, |range| {
            for &index in &below[range] {
                // SAFETY: a node stands in the list once.
                unsafe { nodes.get_mut(index as usize) }.clear_marks(&visit);
            }
        });
        for &index in top {
            // SAFETY: there is only this thread now.
            unsafe { nodes.get_mut(index as usize) }.clear_marks(&visit);
        }
    }
}

impl Node {
    #[inline(always)]
    fn clear_marks(&mut self, visit: &impl Fn(usize, &Aabb)) {
        for (child, bounds) in self.children.iter_mut().zip(&self.bounds) {
            if child.is_leaf() && child.is_moved() {
                visit(child.index(), bounds);
            }
            *child = child.without(MOVED);
        }
    }
}

/// Hands box and marks of a node to the one above.
///
/// # Safety
/// No other thread may touch the node, or what the one above knows of it.
#[inline(always)]
unsafe fn hand_up(nodes: &SharedSlice<'_, Node>, index: usize) {
    // SAFETY: promised by the caller.
    unsafe {
        let node = &*nodes.at(index);
        if let Some((parent, side)) = node.parent.split() {
            let parent = nodes.at(parent);
            (*parent).bounds[side] = node.aabb();
            (*parent).children[side].0 |= node.flags();
        }
    }
}
