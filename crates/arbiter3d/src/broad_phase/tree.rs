//! A dynamic binary tree of axis-aligned boxes.
//!
//! Leaves are the caller's boxes (made larger than the shapes they hold, so that a small motion changes nothing). They keep
//! their id for life. An inner node stores the boxes of its **two children**, not its own: a visit reads one cache line of
//! 64 bytes and rejects both children without touching them.
//!
//! - **Insertion** walks down greedily by the surface area heuristic: the new leaf's best sibling is the subtree that adds
//!   least area to the tree. On the way back up each node tries the four swaps of a child with a grandchild and keeps the
//!   one that shrinks the tree most. Ties go to the lower subtree, so equal boxes make a balanced tree.
//!   Source: Catto, "Dynamic Bounding Volume Hierarchies", GDC 2019.
//! - **Motion** ([`DynamicTree::move_leaf`]) writes the new box, grows the ancestors that do not hold it yet, and *marks* the
//!   path from the root. Growing leaves slack: [`DynamicTree::refit_marked`] makes the marked boxes tight again. Subtrees
//!   that grow into each other stay so: [`DynamicTree::rebuild_loose`], called now and then, throws away the inner nodes above
//!   all that has moved since the last time, and builds better ones over what hung below them. Marks also tell the pair
//!   search where anything has moved.
//!
//! Invariants, checked by [`DynamicTree::validate`]: `n` leaves have `n − 1` inner nodes; parent and child links agree; a
//! child's box holds everything below it; stored heights are exact and at most [`MAX_HEIGHT`]; above a marked leaf every
//! link is marked. The tree is valid after every call: queries may come between any two edits.

mod bulk;
mod overlap;
mod query;
mod rebuild;
#[cfg(test)]
mod tests;

pub use overlap::{LinkPair, PairSearch};

use crate::math::Aabb;

/// No tree is higher than this, so traversal stacks have a fixed size. A tree that would grow higher is rebuilt in balance,
/// which makes it at most 32 high.
pub(crate) const MAX_HEIGHT: u32 = 64;

const LEAF: u32 = 1 << 31;
const MOVED: u32 = 1 << 30;
const LOOSE: u32 = 1 << 29;
const FLAGS: u32 = MOVED | LOOSE;
const INDEX: u32 = LOOSE - 1;

/// A child: index of a leaf or of an inner node, and two flags that hold if they hold for anything below: moved since the
/// last search, moved since the last rebuild.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Link(u32);

impl Link {
    const NONE: Self = Self(u32::MAX);

    fn leaf(index: u32) -> Self {
        Self(index | LEAF)
    }

    fn node(index: u32) -> Self {
        Self(index)
    }

    #[inline(always)]
    fn is_leaf(self) -> bool {
        self.0 & LEAF != 0
    }

    #[inline(always)]
    fn is_moved(self) -> bool {
        self.0 & MOVED != 0
    }

    #[inline(always)]
    fn is_loose(self) -> bool {
        self.0 & LOOSE != 0
    }

    #[inline(always)]
    fn flags(self) -> u32 {
        self.0 & FLAGS
    }

    #[inline(always)]
    fn index(self) -> usize {
        (self.0 & INDEX) as usize
    }

    #[inline(always)]
    fn with(self, flags: u32) -> Self {
        Self(self.0 | flags)
    }

    #[inline(always)]
    fn without(self, flags: u32) -> Self {
        Self(self.0 & !flags)
    }
}

/// Where a link is stored: a side of a node, or the root of the tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Slot(u32);

impl Slot {
    const ROOT: Self = Self(u32::MAX);
    /// Marks a leaf that is not in use.
    const FREE: Self = Self(u32::MAX - 1);

    #[inline(always)]
    fn new(node: usize, side: usize) -> Self {
        Self((node as u32) << 1 | side as u32)
    }

    /// Node and side, or `None` at the root.
    #[inline(always)]
    fn split(self) -> Option<(usize, usize)> {
        if self == Self::ROOT { None } else { Some(((self.0 >> 1) as usize, (self.0 & 1) as usize)) }
    }
}

/// An inner node: one cache line.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
struct Node {
    /// Boxes of the two children.
    bounds: [Aabb; 2],
    children: [Link; 2],
    parent: Slot,
    /// Length of the longest way down to a leaf.
    height: u32,
}

const _: () = assert!(size_of::<Node>() == 64);

impl Node {
    #[inline(always)]
    fn aabb(&self) -> Aabb {
        self.bounds[0].union(&self.bounds[1])
    }

    #[inline(always)]
    fn flags(&self) -> u32 {
        (self.children[0].0 | self.children[1].0) & FLAGS
    }
}

/// A leaf: the caller's box and number.
#[derive(Clone, Copy, Debug)]
pub(super) struct Leaf {
    pub(super) aabb: Aabb,
    parent: Slot,
    /// The caller's number.
    data: u32,
}

/// A tree of boxes that come, go and move. See the [module page](self).
#[derive(Clone, Debug)]
pub struct DynamicTree {
    nodes: Vec<Node>,
    leaves: Vec<Leaf>,
    root: Link,
    free_nodes: Vec<u32>,
    free_leaves: Vec<u32>,
    /// Insertions since everything was built anew.
    inserted: usize,
    /// Marked inner nodes, parents first. Kept to be reused.
    marked: Vec<u32>,
    /// All inner nodes in an order for threads.
    order: bulk::Order,
    /// Whether the boxes above all leaves are tight.
    tight: bool,
    /// Subtrees to be joined by a rebuild. Kept to be reused.
    build: rebuild::Buffers,
}

impl Default for DynamicTree {
    fn default() -> Self {
        Self::new()
    }
}

impl DynamicTree {
    /// An empty tree.
    pub fn new() -> Self {
        Self {
            nodes: Vec::new(),
            leaves: Vec::new(),
            root: Link::NONE,
            free_nodes: Vec::new(),
            free_leaves: Vec::new(),
            inserted: 0,
            marked: Vec::new(),
            order: bulk::Order::default(),
            tight: true,
            build: rebuild::Buffers::default(),
        }
    }

    /// Whether so many leaves have been inserted one by one that building everything anew pays: a built tree answers
    /// queries in 70 % of the time of an inserted one.
    pub fn wants_rebuild(&self) -> bool {
        self.inserted > 32 && 2 * self.inserted > self.len()
    }

    /// Number of leaves.
    pub fn len(&self) -> usize {
        self.leaves.len() - self.free_leaves.len()
    }

    /// Whether there is no leaf.
    pub fn is_empty(&self) -> bool {
        self.root == Link::NONE
    }

    /// Length of the longest way from the root to a leaf; zero for up to one leaf.
    pub fn height(&self) -> u32 {
        if self.is_empty() { 0 } else { self.height_of(self.root) }
    }

    /// Surface areas of all inner nodes over that of the root: the expected number of nodes a random query visits.
    #[cfg(test)]
    pub fn cost(&self) -> crate::math::Real {
        let mut sum = 0.0;
        if self.is_empty() || self.root.is_leaf() {
            return sum;
        }
        for index in self.inner_nodes() {
            sum += self.nodes[index as usize].aabb().area();
        }
        sum / self.box_of(self.root).area()
    }

    /// The stored box of a leaf.
    #[inline(always)]
    pub fn aabb(&self, leaf: u32) -> &Aabb {
        &self.leaves[leaf as usize].aabb
    }

    /// The number the caller gave to a leaf.
    #[inline(always)]
    pub fn data(&self, leaf: u32) -> u32 {
        self.leaves[leaf as usize].data
    }

    /// Whether a leaf has been moved or marked since the last [`Self::clear_marks`].
    #[cfg(test)]
    pub fn is_marked(&self, leaf: u32) -> bool {
        self.link_at(self.leaves[leaf as usize].parent).is_moved()
    }

    /// Adds a box and returns the id of its leaf.
    pub fn insert(&mut self, aabb: Aabb, data: u32) -> u32 {
        let leaf = self.new_leaf(aabb, data);
        let link = Link::leaf(leaf);
        self.inserted += 1;
        if self.is_empty() {
            self.place(Slot::ROOT, link, aabb);
            return leaf;
        }
        let slot = self.best_sibling(&aabb);
        let sibling = self.link_at(slot);
        let sibling_box = self.box_of(sibling);
        let node = self.new_node();
        self.place(slot, Link::node(node as u32).with(sibling.flags()), sibling_box.union(&aabb));
        self.place(Slot::new(node, 0), sibling, sibling_box);
        self.place(Slot::new(node, 1), link, aabb);
        self.nodes[node].height = self.height_of(sibling) + 1;
        self.climb(slot, true);
        self.limit_height();
        leaf
    }

    /// Takes a leaf out; its id may be given to a later one.
    pub fn remove(&mut self, leaf: u32) {
        let slot = self.leaves[leaf as usize].parent;
        debug_assert!(slot != Slot::FREE, "leaf {leaf} has been removed before");
        if let Some((node, side)) = slot.split() {
            let Node { bounds, children, parent, .. } = self.nodes[node];
            self.place(parent, children[1 - side], bounds[1 - side]);
            self.free_nodes.push(node as u32);
            self.climb(parent, false);
        } else {
            self.root = Link::NONE;
        }
        self.leaves[leaf as usize].parent = Slot::FREE;
        self.free_leaves.push(leaf);
    }

    /// Gives a leaf another box and marks it. Cheap: ancestors only grow, until the next refit or rebuild.
    #[inline]
    pub fn move_leaf(&mut self, leaf: u32, aabb: &Aabb) {
        self.leaves[leaf as usize].aabb = *aabb;
        self.lift_leaf(leaf);
    }

    /// The leaves, whose boxes may be changed from several threads before [`Self::lift_leaves`].
    pub(super) fn leaves_mut(&mut self) -> &mut [Leaf] {
        &mut self.leaves
    }

    /// Grows the ancestors of a leaf over its box, and marks it.
    #[inline]
    fn lift_leaf(&mut self, leaf: u32) {
        self.tight = false;
        let Leaf { aabb, parent: mut slot, .. } = self.leaves[leaf as usize];
        let aabb = &aabb;
        if let Some((node, side)) = slot.split() {
            let parent = &mut self.nodes[node];
            parent.bounds[side] = *aabb;
            parent.children[side].0 |= FLAGS;
            slot = parent.parent;
        }
        while let Some((node, side)) = slot.split() {
            let ancestor = &mut self.nodes[node];
            let bounds = &mut ancestor.bounds[side];
            if ancestor.children[side].flags() == FLAGS && bounds.contains(aabb) {
                return;
            }
            *bounds = bounds.union(aabb);
            ancestor.children[side].0 |= FLAGS;
            slot = ancestor.parent;
        }
        self.root.0 |= FLAGS;
    }

    /// Marks a leaf without moving it.
    pub fn mark(&mut self, leaf: u32) {
        let aabb = self.leaves[leaf as usize].aabb;
        self.move_leaf(leaf, &aabb);
    }

    /// Whether a leaf is marked.
    pub fn has_marks(&self) -> bool {
        !self.is_empty() && self.root.is_moved()
    }

    /// Makes the boxes above all marked leaves tight.
    pub fn refit_marked(&mut self) {
        if std::mem::replace(&mut self.tight, true) {
            return;
        }
        self.collect_marked();
        for position in (0..self.marked.len()).rev() {
            let node = &self.nodes[self.marked[position] as usize];
            if let Some((parent, side)) = node.parent.split() {
                self.nodes[parent].bounds[side] = node.aabb();
            }
        }
    }

    /// Lists the inner nodes with a moved leaf below, each before its children.
    fn collect_marked(&mut self) {
        self.marked.clear();
        if !self.is_empty() && !self.root.is_leaf() && self.root.is_moved() {
            self.marked.push(self.root.index() as u32);
        }
        let mut next = 0;
        while next < self.marked.len() {
            for child in self.nodes[self.marked[next] as usize].children {
                if child.is_moved() && !child.is_leaf() {
                    self.marked.push(child.index() as u32);
                }
            }
            next += 1;
        }
    }

    /// All inner nodes, parents first. For checks and statistics: allocates.
    fn inner_nodes(&self) -> Vec<u32> {
        let mut nodes = Vec::new();
        if !self.is_empty() && !self.root.is_leaf() {
            nodes.push(self.root.index() as u32);
        }
        let mut next = 0;
        while next < nodes.len() {
            let children = self.nodes[nodes[next] as usize].children;
            nodes.extend(children.iter().filter(|child| !child.is_leaf()).map(|child| child.index() as u32));
            next += 1;
        }
        nodes
    }

    /// The place whose subtree should become the sibling of a new box.
    ///
    /// Making a parent at a subtree costs the area of both together, plus what the new box adds to every ancestor.
    /// Descending goes on while a child may still be cheaper; at equal cost it goes on too, towards the lower child.
    fn best_sibling(&self, aabb: &Aabb) -> Slot {
        let area = aabb.area();
        let mut link = self.root;
        let mut bounds = self.box_of(link);
        let mut inherited = 0.0;
        let (mut best_slot, mut best_cost) = (Slot::ROOT, bounds.union(aabb).area());
        while !link.is_leaf() {
            let node = &self.nodes[link.index()];
            inherited += bounds.union(aabb).area() - bounds.area();
            let mut next = None;
            for side in 0..2 {
                let child = node.children[side];
                let cost = inherited + node.bounds[side].union(aabb).area();
                if cost <= best_cost {
                    (best_slot, best_cost) = (Slot::new(link.index(), side), cost);
                }
                // What lies below can at best save the child's own growth.
                let slack = if child.is_leaf() { 0.0 } else { crate::math::min(area - node.bounds[side].area(), 0.0) };
                let height = self.height_of(child);
                let better = match next {
                    None => true,
                    Some((_, other, _, other_height)) => {
                        cost + slack < other || (cost + slack == other && height < other_height)
                    }
                };
                if better {
                    next = Some((side, cost + slack, cost, height));
                }
            }
            let Some((side, bound, cost, _)) = next else { break };
            if bound > best_cost {
                break;
            }
            if cost == best_cost {
                // A tie on the way to a leaf: the deeper place keeps equal boxes in balance.
                best_slot = Slot::new(link.index(), side);
            }
            bounds = node.bounds[side];
            link = node.children[side];
        }
        best_slot
    }

    /// Brings boxes, heights and marks above a changed place up to date, and with `rotate` improves each node passed.
    fn climb(&mut self, from: Slot, rotate: bool) {
        let mut slot = from;
        while let Some((index, _)) = slot.split() {
            if rotate {
                self.rotate(index);
            }
            let height = self.height_above(index);
            let node = &mut self.nodes[index];
            let (aabb, flags) = (node.aabb(), node.flags());
            let mut unchanged = node.height == height;
            node.height = height;
            slot = node.parent;
            if let Some((parent, side)) = slot.split() {
                let parent = &mut self.nodes[parent];
                unchanged &= parent.bounds[side] == aabb;
                parent.bounds[side] = aabb;
                parent.children[side] = parent.children[side].with(flags);
            } else {
                self.root = self.root.with(flags);
            }
            if unchanged && !rotate {
                return;
            }
        }
    }

    /// Swaps a child with a child of the other child if that makes the other child smaller.
    fn rotate(&mut self, index: usize) {
        let node = &self.nodes[index];
        let mut best = None;
        let mut best_change = 0.0;
        for side in 0..2 {
            let other = node.children[1 - side];
            if other.is_leaf() {
                continue;
            }
            let grand = &self.nodes[other.index()].bounds;
            let before = node.bounds[1 - side].area();
            for down in 0..2 {
                let change = node.bounds[side].union(&grand[1 - down]).area() - before;
                if change < best_change {
                    best = Some((side, down));
                    best_change = change;
                }
            }
        }
        let Some((side, down)) = best else { return };
        let (upper, upper_box) = (node.children[side], node.bounds[side]);
        let child = node.children[1 - side].index();
        let (lower, lower_box) = (self.nodes[child].children[down], self.nodes[child].bounds[down]);
        self.place(Slot::new(index, side), lower, lower_box);
        self.place(Slot::new(child, down), upper, upper_box);
        self.nodes[child].height = self.height_above(child);
        let below = &self.nodes[child];
        let (aabb, flags) = (below.aabb(), below.flags());
        let node = &mut self.nodes[index];
        node.bounds[1 - side] = aabb;
        node.children[1 - side] = node.children[1 - side].without(FLAGS).with(flags);
    }

    /// Hangs a subtree into a place.
    fn place(&mut self, slot: Slot, link: Link, aabb: Aabb) {
        self.order.clear();
        if let Some((node, side)) = slot.split() {
            self.nodes[node].children[side] = link;
            self.nodes[node].bounds[side] = aabb;
        } else {
            self.root = link;
        }
        if link.is_leaf() {
            self.leaves[link.index()].parent = slot;
        } else {
            self.nodes[link.index()].parent = slot;
        }
    }

    #[inline]
    fn link_at(&self, slot: Slot) -> Link {
        slot.split().map_or(self.root, |(node, side)| self.nodes[node].children[side])
    }

    #[inline]
    fn box_of(&self, link: Link) -> Aabb {
        if link.is_leaf() { self.leaves[link.index()].aabb } else { self.nodes[link.index()].aabb() }
    }

    #[inline]
    fn height_of(&self, link: Link) -> u32 {
        if link.is_leaf() { 0 } else { self.nodes[link.index()].height }
    }

    fn height_above(&self, node: usize) -> u32 {
        let [a, b] = self.nodes[node].children;
        1 + self.height_of(a).max(self.height_of(b))
    }

    fn new_leaf(&mut self, aabb: Aabb, data: u32) -> u32 {
        let leaf = Leaf { aabb, parent: Slot::ROOT, data };
        if let Some(index) = self.free_leaves.pop() {
            self.leaves[index as usize] = leaf;
            index
        } else {
            self.leaves.push(leaf);
            (self.leaves.len() - 1) as u32
        }
    }

    fn new_node(&mut self) -> usize {
        if let Some(index) = self.free_nodes.pop() {
            return index as usize;
        }
        let node = Node { bounds: [Aabb::EMPTY; 2], children: [Link::NONE; 2], parent: Slot::ROOT, height: 0 };
        self.nodes.push(node);
        self.nodes.len() - 1
    }

    /// Checks every invariant of the module page.
    ///
    /// # Errors
    /// The first violation found, in words.
    pub fn validate(&self) -> Result<(), String> {
        let mut leaves = 0;
        let inner = self.inner_nodes();
        if !self.is_empty() && self.root.is_leaf() {
            leaves = 1;
            check(self.leaves[self.root.index()].parent == Slot::ROOT, || "the root leaf has a parent".into())?;
        }
        for &index in &inner {
            let node = &self.nodes[index as usize];
            check(node.height == self.height_above(index as usize), || format!("node {index}: wrong height"))?;
            check(self.link_at(node.parent).without(FLAGS) == Link::node(index), || {
                format!("node {index}: its parent does not know it")
            })?;
            check(node.flags() & !self.link_at(node.parent).flags() == 0, || format!("node {index}: mark missing"))?;
            for side in 0..2 {
                let child = node.children[side];
                check(node.bounds[side].contains(&self.box_of(child)), || {
                    format!("node {index}: child {side} sticks out of its box")
                })?;
                if child.is_leaf() {
                    leaves += 1;
                    let parent = self.leaves[child.index()].parent;
                    check(parent == Slot::new(index as usize, side), || {
                        format!("leaf {}: wrong parent", child.index())
                    })?;
                }
            }
        }
        check(self.order.is_stale() || self.order.holds(&inner), || "the list of nodes is out of date".into())?;
        check(leaves == self.len(), || format!("{leaves} leaves in the tree, {} in use", self.len()))?;
        check(inner.len() == self.nodes.len() - self.free_nodes.len(), || "lost nodes".into())?;
        check(inner.len() + 1 == leaves.max(1), || format!("{} nodes for {leaves} leaves", inner.len()))?;
        check(self.height() <= MAX_HEIGHT, || format!("height {}", self.height()))
    }
}

fn check(condition: bool, message: impl FnOnce() -> String) -> Result<(), String> {
    if condition { Ok(()) } else { Err(message()) }
}
