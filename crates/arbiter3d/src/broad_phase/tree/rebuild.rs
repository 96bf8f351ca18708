//! Building inner nodes from the top down over given subtrees.
//!
//! Each range of subtrees is split at the middle of its centres' box, along the longest axis; ranges that do not split that
//! way (equal centres) are cut in half. The middle of the space costs one pass a level, a third of a binned surface-area
//! build, and for the near-uniform sizes of moving bodies its trees are as good. Where it would grow the tree past
//! [`MAX_HEIGHT`] everything is built again with the median, which gives the least height there is.

use super::{DynamicTree, Link, MAX_HEIGHT, Slot};
use crate::math::{Vec3, max3, min3};

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
    /// Half of the subtrees on each side.
    Median,
}

impl DynamicTree {
    /// Builds the marked part of the tree anew: unmarked subtrees stay as they are, the nodes above them are replaced.
    pub fn rebuild_marked(&mut self) {
        if !self.is_empty() && self.root.is_moved() {
            self.rebuild_where(Link::is_moved, Split::Middle);
            self.limit_height();
        }
    }

    /// Builds the whole tree anew.
    pub fn rebuild(&mut self) {
        self.rebuild_where(|_| true, Split::Middle);
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
            return;
        }
        let mut buffers = std::mem::take(&mut self.build);
        self.take_apart(replace, &mut buffers);
        buffers.ranges.clear();
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
        buffers.stack.push(self.root);
        while let Some(link) = buffers.stack.pop() {
            if link.is_leaf() || !replace(link) {
                let aabb = self.box_of(link);
                buffers.items.push(Item { center: aabb.min + aabb.max, link });
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
        if let [item] = items {
            let link = item.link;
            let aabb = self.box_of(link);
            self.place(range.slot, link, aabb);
            return;
        }
        let count = match split {
            Split::Middle => split_middle(items),
            Split::Median => split_median(items),
        };
        let node = self.new_node();
        buffers.nodes.push(node as u32);
        // Box, mark and height follow when all below is known.
        self.place(range.slot, Link::node(node as u32), crate::math::Aabb::EMPTY);
        let middle = range.start + count;
        buffers.ranges.push(Range { start: middle, end: range.end, slot: Slot::new(node, 1) });
        buffers.ranges.push(Range { start: range.start, end: middle, slot: Slot::new(node, 0) });
    }

    fn finish_node(&mut self, index: usize) {
        let height = self.height_above(index);
        let node = &mut self.nodes[index];
        node.height = height;
        let (aabb, moved, slot) = (node.aabb(), node.is_moved(), node.parent);
        let link = Link::node(index as u32).with_moved(moved);
        if let Some((parent, side)) = slot.split() {
            self.nodes[parent].bounds[side] = aabb;
            self.nodes[parent].children[side] = link;
        } else {
            self.root = link;
        }
    }
}

/// The axis along which the centres spread most, and the middle of that spread.
fn longest_axis(items: &[Item]) -> (usize, f32) {
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
    (axis, low[axis] + 0.5 * spread[axis])
}

/// Moves the items below the middle to the front and returns their number, at least one and not all.
fn split_middle(items: &mut [Item]) -> usize {
    let (axis, middle) = longest_axis(items);
    let mut below = 0;
    for index in 0..items.len() {
        // Swaps without a branch: which side comes next cannot be predicted.
        let is_below = items[index].center[axis] < middle;
        items.swap(index, below);
        below += usize::from(is_below);
    }
    if below == 0 || below == items.len() { items.len() / 2 } else { below }
}

/// Moves the lower half to the front and returns its number.
fn split_median(items: &mut [Item]) -> usize {
    let (axis, _) = longest_axis(items);
    let half = items.len() / 2;
    let key = |item: &Item| (item.center[axis], item.link.0);
    items.select_nth_unstable_by(half, |a, b| {
        let ((a, a_link), (b, b_link)) = (key(a), key(b));
        a.total_cmp(&b).then(a_link.cmp(&b_link))
    });
    half
}
