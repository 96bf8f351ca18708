//! Builds the tree over the triangles of a mesh.
//!
//! Ranges of boxes are cut in two where the surface-area heuristic `area · count` (left plus right) is least, centres sorted
//! into bins along the longest axis of the range; the boxes of the bins give those of the halves. Where bins cannot cut
//! (equal centres), or a range has been cut unevenly often, it is halved at its median, which bounds the depth. Ranges that
//! fit under one node are cut at multiples of a leaf, so that leaves are full. A node takes the children that come of
//! cutting the largest part again and again.
//! Source: Wald, "On fast Construction of SAH-based Bounding Volume Hierarchies", 2007.
//!
//! The boxes themselves are moved, not their numbers: all passes run through consecutive memory.

use super::mesh_tree::{LEAF, Node, WIDTH};
use crate::math::{Aabb, Real, Vec3, max, min};

/// Boxes that fit under one node.
const BOTTOM: usize = LEAF * WIDTH;
/// Bins along an axis.
const BINS: usize = 16;
/// Cuts by area on the way to a range; after them ranges are halved.
const MOST_CUTS: usize = 31;

/// A box and its number, whose bits stand beside the lower corner: four numbers fill a register.
#[derive(Clone, Copy)]
#[repr(C)]
struct Item {
    low: [Real; 4],
    high: [Real; 4],
}

impl Item {
    fn new(aabb: &Aabb, number: u32) -> Self {
        let ([a, b, c], [d, e, f]) = (aabb.min.to_array(), aabb.max.to_array());
        Self { low: [a, b, c, Real::from_bits(number)], high: [d, e, f, 0.0] }
    }

    #[inline(always)]
    fn number(&self) -> u32 {
        self.low[3].to_bits()
    }

    /// Twice the centre along an axis.
    #[inline(always)]
    fn center(&self, axis: usize) -> Real {
        self.low[axis] + self.high[axis]
    }
}

/// A box that grows; the fourth numbers mean nothing.
#[derive(Clone, Copy)]
struct Bounds {
    low: [Real; 4],
    high: [Real; 4],
}

impl Bounds {
    const EMPTY: Self = Self { low: [Real::MAX; 4], high: [-Real::MAX; 4] };

    #[inline(always)]
    fn add(&mut self, low: &[Real; 4], high: &[Real; 4]) {
        for k in 0..4 {
            self.low[k] = min(low[k], self.low[k]);
            self.high[k] = max(high[k], self.high[k]);
        }
    }

    fn area(&self) -> Real {
        self.aabb().area()
    }

    fn aabb(&self) -> Aabb {
        Aabb::new(Vec3::new(self.low[0], self.low[1], self.low[2]), Vec3::new(self.high[0], self.high[1], self.high[2]))
    }

    fn of(items: &[Item]) -> Self {
        let mut bounds = Self::EMPTY;
        for item in items {
            bounds.add(&item.low, &item.high);
        }
        bounds
    }
}

/// Consecutive boxes and the box around them.
#[derive(Clone, Copy)]
struct Range {
    start: usize,
    end: usize,
    bounds: Bounds,
    /// Cuts by area above it.
    cuts: usize,
}

impl Range {
    const NONE: Self = Self { start: 0, end: 0, bounds: Bounds::EMPTY, cuts: 0 };

    fn len(&self) -> usize {
        self.end - self.start
    }

    fn longest_axis(&self) -> usize {
        let size = self.bounds.aabb().half_extents();
        if size.x >= size.y && size.x >= size.z { 0 } else { 1 + usize::from(size.z > size.y) }
    }
}

/// Where to cut a range.
struct Cut {
    axis: usize,
    low: Real,
    scale: Real,
}

impl Cut {
    #[inline(always)]
    fn bin(&self, item: &Item) -> usize {
        // Saturates for what is out of range or not a number.
        (((item.center(self.axis) - self.low) * self.scale) as usize).min(BINS - 1)
    }
}

pub(super) struct Builder {
    items: Vec<Item>,
    nodes: Vec<Node>,
}

impl Builder {
    /// The nodes, the box around all, and the order in which the boxes stand under the leaves.
    pub(super) fn build(boxes: impl Iterator<Item = Aabb>) -> (Vec<Node>, Aabb, Vec<u32>) {
        let items: Vec<Item> = boxes.enumerate().map(|(i, aabb)| Item::new(&aabb, i as u32)).collect();
        let whole = Range { start: 0, end: items.len(), bounds: Bounds::of(&items), cuts: 0 };
        let mut builder = Self { items, nodes: Vec::new() };
        builder.node(&whole);
        builder.nodes.shrink_to_fit();
        let order = builder.items.iter().map(Item::number).collect();
        (builder.nodes, whole.bounds.aabb(), order)
    }

    /// Makes the node of a range; returns its number.
    fn node(&mut self, whole: &Range) -> u32 {
        let index = self.nodes.len();
        self.nodes.push(Node::EMPTY);
        let enough = if whole.len() <= BOTTOM { LEAF } else { BOTTOM };
        let (mut parts, mut count) = ([Range::NONE; WIDTH], 1);
        parts[0] = *whole;
        while count < WIDTH {
            let mut largest = 0;
            for part in 1..count {
                if parts[part].len() > parts[largest].len() {
                    largest = part;
                }
            }
            if parts[largest].len() <= enough {
                break;
            }
            let (left, right) = self.split(&parts[largest]);
            parts.copy_within(largest + 1..count, largest + 2);
            (parts[largest], parts[largest + 1]) = (left, right);
            count += 1;
        }
        for (lane, part) in parts[..count].iter().enumerate() {
            let (first, triangles) = if part.len() <= LEAF {
                self.items[part.start..part.end].sort_unstable_by_key(Item::number);
                (part.start as u32, part.len())
            } else {
                (self.node(part), 0)
            };
            self.nodes[index].set(lane, &part.bounds.aabb(), first, triangles);
        }
        index as u32
    }

    /// Cuts a range of more than one leaf in two.
    fn split(&mut self, range: &Range) -> (Range, Range) {
        if range.len() <= BOTTOM {
            let half = (range.len() / 2).next_multiple_of(LEAF);
            return self.halve(range, half);
        }
        if range.cuts < MOST_CUTS
            && let Some(parts) = self.cut(range)
        {
            return parts;
        }
        self.halve(range, range.len() / 2)
    }

    /// The cut with the least `area · count` along the longest axis; `None` where all centres fall into one bin.
    fn cut(&mut self, range: &Range) -> Option<(Range, Range)> {
        let axis = range.longest_axis();
        let (low, high) = (2.0 * range.bounds.low[axis], 2.0 * range.bounds.high[axis]);
        let scale = BINS as Real / (high - low);
        if !(scale > 0.0 && scale.is_finite()) {
            return None;
        }
        let cut = Cut { axis, low, scale };
        let items = &mut self.items[range.start..range.end];
        let (mut bins, mut counts) = ([Bounds::EMPTY; BINS], [0_usize; BINS]);
        for item in &*items {
            let bin = cut.bin(item);
            bins[bin].add(&item.low, &item.high);
            counts[bin] += 1;
        }
        let (last, left, right) = cheapest(&bins, &counts)?;
        // Both ends move inwards and swap what stands on the wrong side.
        let (mut middle, mut end) = (0, items.len());
        while middle < end {
            if cut.bin(&items[middle]) <= last {
                middle += 1;
            } else {
                end -= 1;
                items.swap(middle, end);
            }
        }
        let (middle, cuts) = (range.start + middle, range.cuts + 1);
        Some((
            Range { start: range.start, end: middle, bounds: left, cuts },
            Range { start: middle, end: range.end, bounds: right, cuts },
        ))
    }

    /// Puts the `count` boxes with the smallest centres along the longest axis on the left.
    fn halve(&mut self, range: &Range, count: usize) -> (Range, Range) {
        let axis = range.longest_axis();
        let items = &mut self.items[range.start..range.end];
        items.select_nth_unstable_by(count, |a, b| {
            a.center(axis).total_cmp(&b.center(axis)).then(a.number().cmp(&b.number()))
        });
        let (left, right) = items.split_at(count);
        let middle = range.start + count;
        (
            Range { end: middle, bounds: Bounds::of(left), ..*range },
            Range { start: middle, bounds: Bounds::of(right), ..*range },
        )
    }
}

/// The last bin on the left of the cheapest cut, and the boxes of both sides.
fn cheapest(bins: &[Bounds; BINS], counts: &[usize; BINS]) -> Option<(usize, Bounds, Bounds)> {
    let mut right = [(Bounds::EMPTY, 0); BINS];
    for bin in (0..BINS - 1).rev() {
        right[bin] = (right[bin + 1].0, right[bin + 1].1 + counts[bin + 1]);
        right[bin].0.add(&bins[bin + 1].low, &bins[bin + 1].high);
    }
    let (mut best, mut best_cost) = (None, Real::MAX);
    let (mut left, mut count) = (Bounds::EMPTY, 0);
    for bin in 0..BINS - 1 {
        left.add(&bins[bin].low, &bins[bin].high);
        count += counts[bin];
        let (others, rest) = &right[bin];
        if count == 0 || *rest == 0 {
            continue;
        }
        let cost = left.area() * count as Real + others.area() * *rest as Real;
        if cost < best_cost {
            (best, best_cost) = (Some((bin, left, *others)), cost);
        }
    }
    best
}
