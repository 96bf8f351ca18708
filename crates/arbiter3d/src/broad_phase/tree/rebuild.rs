//! Building inner nodes from the top down over given subtrees.
//!
//! A range of subtrees is split along the longest axis of their centres' box, in one of three ways:
//! - *Middle*, for [`DynamicTree::rebuild_loose`] in the course of motion: at the middle of the centres. One cheap pass.
//! - *Surface*, for [`DynamicTree::rebuild`] after many insertions: at the best of seven planes by the surface area
//!   heuristic. Twice the time; 3 % better than the middle for equal boxes, 10–20 % where sizes differ.
//!   Source: Wald, "On fast Construction of SAH-based Bounding Volume Hierarchies", 2007.
//! - *Median*, where the others would grow the tree past [`MAX_HEIGHT`]: half on each side, the least height there is.
//!
//! Ranges that a plane does not split (equal centres) are cut in half.

use super::{DynamicTree, LOOSE, Link, MAX_HEIGHT, Slot};
use crate::math::{Aabb, Real, Vec3, max3, min3};

/// Intervals of the longest axis whose borders a [`Split::Surface`] tries.
const BINS: usize = 8;

/// Room for what waits on the way down a tree, so that a deeper one than before needs no new memory.
const STACK: usize = MAX_HEIGHT as usize + 1;

/// A subtree that a rebuild joins to others.
#[derive(Clone, Copy, Debug)]
struct Item {
    /// Twice the centre of its box.
    center: Vec3,
    link: Link,
}

/// A range of items that goes to one place.
#[derive(Clone, Copy, Debug)]
struct Range {
    start: usize,
    end: usize,
    slot: Slot,
}

/// Memory of the builder, kept from one rebuild to the next.
#[derive(Clone, Debug, Default)]
pub(super) struct Buffers {
    items: Vec<Item>,
    ranges: Vec<Range>,
    /// Inner nodes taken apart, then those made.
    nodes: Vec<u32>,
    stack: Vec<Link>,
}

#[derive(Clone, Copy, PartialEq)]
enum Split {
    /// At the middle of the centres.
    Middle,
    /// Where the surface area heuristic finds least cost, among [`BINS`] − 1 planes across the longest axis.
    Surface,
    /// Half of the subtrees on each side.
    Median,
}

impl DynamicTree {
    /// Builds anew the part of the tree above leaves that have moved since the last rebuild; subtrees without any stay.
    ///
    /// This has a mark of its own: a leaf that moves every eighth step would else meet only refits and never a rebuild.
    pub fn rebuild_loose(&mut self) {
        if !self.is_empty() && self.root.is_loose() {
            let many_marked = self.has_many_marks();
            self.rebuild_where(Link::is_loose, Split::Middle);
            self.limit_height();
            if many_marked {
                self.list_many_marked();
            }
        }
    }

    /// Builds the whole tree anew, with more care than [`Self::rebuild_loose`].
    pub fn rebuild(&mut self) {
        self.inserted = 0;
        self.rebuild_where(|_| true, Split::Surface);
        self.limit_height();
    }

    /// Balances a tree that has become too high for the traversal stacks.
    pub(super) fn limit_height(&mut self) {
        if self.height() > MAX_HEIGHT {
            self.rebuild_where(|_| true, Split::Median);
        }
    }

    fn rebuild_where(&mut self, replace: impl Fn(Link) -> bool, split: Split) {
        if self.is_empty() || self.root.is_leaf() {
            self.root = if self.is_empty() { Link::NONE } else { self.root.without(LOOSE) };
            return;
        }
        let mut buffers = std::mem::take(&mut self.build);
        self.take_apart(replace, &mut buffers);
        buffers.ranges.clear();
        buffers.ranges.reserve(STACK);
        buffers.ranges.push(Range { start: 0, end: buffers.items.len(), slot: Slot::ROOT });
        while let Some(range) = buffers.ranges.pop() {
            self.build_range(range, split, &mut buffers);
        }
        for &node in buffers.nodes.iter().rev() {
            self.finish_node(node as usize);
        }
        self.build = buffers;
    }

    /// Frees the inner nodes to be replaced and lists the subtrees that hung below them.
    fn take_apart(&mut self, replace: impl Fn(Link) -> bool, buffers: &mut Buffers) {
        buffers.items.clear();
        buffers.nodes.clear();
        // The stack is a vector: this is also how a tree above the height limit is cured.
        buffers.stack.reserve(STACK);
        buffers.stack.push(self.root);
        while let Some(link) = buffers.stack.pop() {
            if link.is_leaf() || !replace(link) {
                let aabb = self.box_of(link);
                buffers.items.push(Item { center: aabb.min + aabb.max, link: link.without(LOOSE) });
                continue;
            }
            buffers.nodes.push(link.index() as u32);
            let [first, second] = self.nodes[link.index()].children;
            buffers.stack.push(second);
            buffers.stack.push(first);
        }
        // New nodes take the places of old ones in the order of a walk, which keeps walks local in memory.
        self.free_nodes.extend(buffers.nodes.iter().rev());
        buffers.nodes.clear();
    }

    /// Places a single subtree, or makes a node for several and leaves its halves to be done, first half next.
    fn build_range(&mut self, range: Range, split: Split, buffers: &mut Buffers) {
        let items = &mut buffers.items[range.start..range.end];
        if let [Item { link, .. }] = *items {
            let aabb = self.box_of(link);
            self.place(range.slot, link, aabb);
            return;
        }
        let count = match split {
            Split::Middle => split_middle(items),
            Split::Surface => self.split_surface(range, buffers),
            Split::Median => split_median(items),
        };
        let node = self.new_node();
        buffers.nodes.push(node as u32);
        // Box, mark and height follow when all below is known.
        self.place(range.slot, Link::node(node as u32), Aabb::EMPTY);
        let middle = range.start + count;
        buffers.ranges.push(Range { start: middle, end: range.end, slot: Slot::new(node, 1) });
        buffers.ranges.push(Range { start: range.start, end: middle, slot: Slot::new(node, 0) });
    }

    /// Moves the items on the cheaper side of the best plane to the front and returns their number.
    fn split_surface(&self, range: Range, buffers: &mut Buffers) -> usize {
        let items = &mut buffers.items[range.start..range.end];
        let (axis, low, spread) = longest_axis(items);
        if items.len() <= 4 || spread <= 0.0 {
            return split_middle(items);
        }
        let scale = BINS as Real / spread;
        let bin_of = |item: &Item| (((item.center[axis] - low) * scale) as usize).min(BINS - 1);
        let mut bins = [(Aabb::EMPTY, 0_usize); BINS];
        for item in items.iter() {
            let bin = &mut bins[bin_of(item)];
            *bin = (bin.0.union(&self.box_of(item.link)), bin.1 + 1);
        }
        // Cost of what lies right of each plane, then of both sides while the left one grows.
        let mut right_costs = [0.0; BINS];
        let mut right = (Aabb::EMPTY, 0);
        for bin in (1..BINS).rev() {
            right = (right.0.union(&bins[bin].0), right.1 + bins[bin].1);
            right_costs[bin] = if right.1 == 0 { 0.0 } else { right.0.area() * right.1 as Real };
        }
        let (mut left, mut best, mut best_cost) = ((Aabb::EMPTY, 0), 0, Real::INFINITY);
        for bin in 1..BINS {
            left = (left.0.union(&bins[bin - 1].0), left.1 + bins[bin - 1].1);
            let cost = left.0.area() * left.1 as Real + right_costs[bin];
            if cost < best_cost && left.1 > 0 && left.1 < items.len() {
                (best, best_cost) = (bin, cost);
            }
        }
        if best == 0 { split_middle(items) } else { partition(items, |item| bin_of(item) < best) }
    }

    fn finish_node(&mut self, index: usize) {
        let height = self.height_above(index);
        let node = &mut self.nodes[index];
        node.height = height;
        let (aabb, slot) = (node.aabb(), node.parent);
        let link = Link::node(index as u32).with(node.flags());
        if let Some((parent, side)) = slot.split() {
            self.nodes[parent].bounds[side] = aabb;
            self.nodes[parent].children[side] = link;
        } else {
            self.root = link;
        }
    }
}

/// The axis along which the centres spread most, where they begin and how far they spread.
fn longest_axis(items: &[Item]) -> (usize, Real, Real) {
    let (mut low, mut high) = (items[0].center, items[0].center);
    for item in items {
        low = min3(item.center, low);
        high = max3(item.center, high);
    }
    let spread = high - low;
    let axis = if spread.x >= spread.y && spread.x >= spread.z {
        0
    } else if spread.y >= spread.z {
        1
    } else {
        2
    };
    (axis, low[axis], spread[axis])
}

/// Moves the items below the middle to the front and returns their number, at least one and not all.
fn split_middle(items: &mut [Item]) -> usize {
    let (axis, low, spread) = longest_axis(items);
    let middle = low + 0.5 * spread;
    let below = partition(items, |item| item.center[axis] < middle);
    if below == 0 || below == items.len() { items.len() / 2 } else { below }
}

/// Moves the items that belong to the front there and returns their number.
fn partition(items: &mut [Item], is_front: impl Fn(&Item) -> bool) -> usize {
    let mut front = 0;
    for index in 0..items.len() {
        // Swaps without a branch: which side comes next cannot be predicted.
        let to_front = is_front(&items[index]);
        items.swap(index, front);
        front += usize::from(to_front);
    }
    front
}

/// Moves the lower half to the front and returns its number.
fn split_median(items: &mut [Item]) -> usize {
    let (axis, ..) = longest_axis(items);
    let half = items.len() / 2;
    let key = |item: &Item| (item.center[axis], item.link.0);
    items.select_nth_unstable_by(half, |a, b| {
        let ((a, a_link), (b, b_link)) = (key(a), key(b));
        a.total_cmp(&b).then(a_link.cmp(&b_link))
    });
    half
}
