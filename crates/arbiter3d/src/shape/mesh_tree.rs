//! Bounding-volume tree over the triangles of a mesh: eight children a node, their boxes side by side so that all are
//! tested at once.
//!
//! A walk asks each node which of its eight boxes overlap the wanted one and goes down lane by lane, so triangles come in
//! ascending order; it is entered once with the machine's best lanes, and what looks at the leaves ([`Leaves`]) runs
//! inside it. The build (see `mesh_tree_builder`) fills leaves with up to [`LEAF`] triangles of consecutive numbers.
//!
//! Invariants: lanes are filled from the first; those left over hold a box that overlaps nothing and that no ray enters.
//! Source of the wide tree: Wald, Benthin, Boulos, "Getting Rid of Packets", 2008.

use super::mesh_tree_builder::Builder;
use crate::math::{Aabb, Real, Vec3, abs3};
use crate::simd::{KernelOfEight, LaneVec3, Lanes, Number, Wide, run_eight};

/// Children of a node.
pub(super) const WIDTH: usize = 8;
/// Triangles in a leaf at most.
pub(crate) const LEAF: usize = 8;
/// Nodes on the way to a leaf at most: a child either holds at most half of the triangles of its parent or came from seven
/// cuts, of which at most 31 in a row are uneven.
const MOST_LEVELS: usize = 40;

/// A node of the tree: the boxes of its children, side by side.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(super) struct Node {
    low: LaneVec3<Wide<WIDTH>>,
    high: LaneVec3<Wide<WIDTH>>,
    /// First triangle of a leaf, or number of the node.
    first: [u32; WIDTH],
    /// Triangles in a leaf; 0 for a node.
    counts: [u8; WIDTH],
}

impl Node {
    pub(super) const EMPTY: Self = Self {
        low: LaneVec3 { x: Wide([Real::MAX; WIDTH]), y: Wide([Real::MAX; WIDTH]), z: Wide([Real::MAX; WIDTH]) },
        high: LaneVec3 { x: Wide([-Real::MAX; WIDTH]), y: Wide([-Real::MAX; WIDTH]), z: Wide([-Real::MAX; WIDTH]) },
        first: [0; WIDTH],
        counts: [0; WIDTH],
    };

    /// Fills a lane; `count` is 0 for a node.
    pub(super) fn set(&mut self, lane: usize, aabb: &Aabb, first: u32, count: usize) {
        self.low.set::<WIDTH>(lane, aabb.min);
        self.high.set::<WIDTH>(lane, aabb.max);
        (self.first[lane], self.counts[lane]) = (first, count as u8);
    }
}

/// What a walk does with the leaves it comes by, in ascending order of their triangles.
pub(crate) trait Leaves {
    /// Zero where a box (its centre and half its size) is of no interest after all; `overlapping` is positive for those that
    /// overlap the box of the walk.
    #[inline(always)]
    fn keep<W: Lanes<WIDTH>>(&self, overlapping: W, _center: &LaneVec3<W>, _half: &LaneVec3<W>) -> W {
        overlapping
    }

    /// A leaf with the triangles from `first` on.
    fn leaf<W: Lanes<WIDTH>>(&mut self, first: usize, count: usize);
}

/// The tree: nodes alone; the triangles are its owner's.
#[derive(Clone, Debug)]
pub(super) struct MeshTree {
    nodes: Vec<Node>,
    around: Aabb,
}

impl MeshTree {
    /// Builds the tree of some boxes, and the order in which their owners have to be stored.
    pub(super) fn build(boxes: impl Iterator<Item = Aabb>) -> (Self, Vec<u32>) {
        let (nodes, around, order) = Builder::build(boxes);
        (Self { nodes, around }, order)
    }

    pub(super) fn around(&self) -> Aabb {
        self.around
    }

    #[cfg(test)]
    pub(super) fn bytes(&self) -> usize {
        self.nodes.capacity() * size_of::<Node>()
    }

    /// Shows the leaves whose boxes overlap the given one.
    #[inline]
    pub(super) fn walk(&self, aabb: &Aabb, leaves: &mut impl Leaves) {
        run_eight(Walk { nodes: &self.nodes, aabb, leaves });
    }

    /// Calls `visit` with every stored triangle of every leaf that overlaps the box, in ascending order.
    #[inline]
    pub(super) fn query(&self, aabb: &Aabb, visit: impl FnMut(usize)) {
        self.walk(aabb, &mut Each(visit));
    }

    /// Shows the leaves to a search that wants the nearest first.
    #[inline]
    pub(super) fn descend(&self, limit: Real, search: &mut impl Descent) {
        run_eight(Descend { nodes: &self.nodes, limit, search });
    }
}

/// A search that goes down the tree nearest box first, and ever less far.
pub(crate) trait Descent {
    /// How far away the boxes with these corners are; [`Real::MAX`] for those farther than `limit`.
    fn distances<W: Lanes<WIDTH>>(&self, low: &LaneVec3<W>, high: &LaneVec3<W>, limit: Real) -> W;

    /// Looks at a leaf with the triangles from `first` on; returns how far is of interest from now on, negative to stop.
    fn leaf<W: Lanes<WIDTH>>(&mut self, first: usize, count: usize, limit: Real) -> Real;
}

struct Descend<'a, S> {
    nodes: &'a [Node],
    limit: Real,
    search: &'a mut S,
}

impl<S: Descent> KernelOfEight for Descend<'_, S> {
    #[inline(always)]
    fn run<W: Lanes<WIDTH>>(self) {
        let mut limit = self.limit;
        // Children still to be visited (eight times the node's number plus the lane), and how far away they are.
        let mut stack = [(0_u32, 0.0 as Real); MOST_LEVELS * (WIDTH - 1) + 1];
        let mut top = 0;
        let mut index = 0;
        loop {
            let node = &self.nodes[index as usize];
            let distances = self.search.distances::<W>(&node.low.to_lanes(), &node.high.to_lanes(), limit);
            let mut lanes = W::splat(Real::MAX).if_above(distances, W::splat(1.0), W::ZERO).positive();
            let distances = distances.to_array();
            let bottom = top;
            while lanes != 0 {
                let lane = lanes.trailing_zeros() as usize % WIDTH;
                lanes &= lanes - 1;
                let distance = distances[lane];
                let mut place = top;
                while place > bottom && stack[place - 1].1 < distance {
                    stack[place] = stack[place - 1];
                    place -= 1;
                }
                stack[place] = (index * WIDTH as u32 + lane as u32, distance);
                top += 1;
            }
            // Down to the next node, past leaves.
            loop {
                if top == 0 {
                    return;
                }
                top -= 1;
                let (child, distance) = stack[top];
                if distance > limit {
                    continue;
                }
                let (node, lane) = (&self.nodes[child as usize / WIDTH], child as usize % WIDTH);
                if node.counts[lane] == 0 {
                    index = node.first[lane];
                    break;
                }
                limit = self.search.leaf::<W>(node.first[lane] as usize, node.counts[lane] as usize, limit);
                if limit < 0.0 {
                    return;
                }
            }
        }
    }
}

/// Calls a function with every triangle.
struct Each<F>(F);

impl<F: FnMut(usize)> Leaves for Each<F> {
    #[inline(always)]
    fn leaf<W: Lanes<WIDTH>>(&mut self, first: usize, count: usize) {
        for triangle in first..first + count {
            (self.0)(triangle);
        }
    }
}

struct Walk<'a, V> {
    nodes: &'a [Node],
    aabb: &'a Aabb,
    leaves: &'a mut V,
}

impl<V: Leaves> KernelOfEight for Walk<'_, V> {
    #[inline(always)]
    fn run<W: Lanes<WIDTH>>(self) {
        let (low, high) = (LaneVec3::<W>::splat(self.aabb.min), LaneVec3::<W>::splat(self.aabb.max));
        // Nodes on the way and the lanes of each that are still to be visited.
        let mut stack = [(0_u32, 0_u32); MOST_LEVELS];
        let mut depth = 0;
        let mut index = 0;
        let mut lanes = overlapping(&self.nodes[0], &low, &high, self.leaves);
        loop {
            let node = &self.nodes[index as usize];
            if lanes == 0 {
                if depth == 0 {
                    return;
                }
                depth -= 1;
                (index, lanes) = stack[depth];
                continue;
            }
            let lane = lanes.trailing_zeros() as usize % WIDTH;
            lanes &= lanes - 1;
            if node.counts[lane] > 0 {
                self.leaves.leaf::<W>(node.first[lane] as usize, node.counts[lane] as usize);
                continue;
            }
            if lanes != 0 {
                stack[depth] = (index, lanes);
                depth += 1;
            }
            index = node.first[lane];
            lanes = overlapping(&self.nodes[index as usize], &low, &high, self.leaves);
        }
    }
}

/// The lanes whose boxes overlap the given one, a bit each.
#[inline(always)]
fn overlapping<W: Lanes<WIDTH>>(node: &Node, low: &LaneVec3<W>, high: &LaneVec3<W>, leaves: &impl Leaves) -> u32 {
    let (from, to): (LaneVec3<W>, LaneVec3<W>) = (node.low.to_lanes(), node.high.to_lanes());
    let found = keep_overlapping(W::splat(1.0), [from.x, to.x], [low.x, high.x]);
    let found = keep_overlapping(found, [from.y, to.y], [low.y, high.y]);
    let found = keep_overlapping(found, [from.z, to.z], [low.z, high.z]);
    if found.positive() == 0 {
        return 0;
    }
    let half = W::splat(0.5);
    let center = LaneVec3 { x: (from.x + to.x) * half, y: (from.y + to.y) * half, z: (from.z + to.z) * half };
    leaves.keep(found, &center, &(to - center)).positive()
}

#[inline(always)]
fn keep_overlapping<W: Number>(found: W, [low, high]: [W; 2], [wanted_low, wanted_high]: [W; 2]) -> W {
    let found = wanted_high.if_at_least(low, found, W::ZERO);
    high.if_at_least(wanted_low, found, W::ZERO)
}

/// A box that moves along a line, or a point of it, made ready for boxes.
///
/// The box enters another where its centre enters that one grown by its half extents. The near planes are moved towards the
/// start and the far ones away from it by more than the three roundings on the way can do, so that no box is missed whose
/// triangle an exact test would hit. Source: Ize, "Robust BVH Ray Traversal", 2013.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slabs {
    origin: Vec3,
    half: Vec3,
    axes: [Slab; 3],
    slack: Real,
}

/// An axis of a direction: its inverse for near planes and for far ones. Both are zero where the direction is.
#[derive(Clone, Copy, Debug)]
struct Slab {
    near: Real,
    far: Real,
}

impl Slab {
    /// More than `1 + 3 · 2⁻²⁴`, twice over.
    const GROW: Real = 1.0 + 1e-6;

    fn new(direction: Real) -> Self {
        let inverse = if direction == 0.0 { 0.0 } else { 1.0 / direction };
        Self { near: inverse / Self::GROW, far: inverse * Self::GROW }
    }
}

impl Slabs {
    /// A point that moves from `origin` along `direction`.
    pub(crate) fn of_point(origin: Vec3, direction: Vec3) -> Self {
        let axes = [Slab::new(direction.x), Slab::new(direction.y), Slab::new(direction.z)];
        Self { origin, half: Vec3::ZERO, axes, slack: 0.0 }
    }

    /// A box with these half extents, for a tree with this box around it.
    pub(crate) fn of_box(origin: Vec3, half: Vec3, direction: Vec3, around: &Aabb) -> Self {
        // Growing a box rounds its corners.
        let slack = 1e-6 * (around.farthest_from(Vec3::ZERO) + abs3(origin) + half);
        Self { half: half + slack, slack: slack.max_element(), ..Self::of_point(origin, direction) }
    }

    /// Fraction at which the line enters each box by `limit`; [`Real::MAX`] for those that it misses.
    #[inline(always)]
    pub(crate) fn enter<W: Lanes<WIDTH>>(&self, low: &LaneVec3<W>, high: &LaneVec3<W>, limit: Real) -> W {
        let (enter, leave) = self.pass(low, high, limit);
        leave.if_at_least(enter, enter, W::splat(Real::MAX))
    }

    /// Fractions at which the line enters each box and leaves it again or reaches the limit; in reverse order for those that it
    /// misses.
    #[inline(always)]
    pub(crate) fn pass<W: Lanes<WIDTH>>(&self, low: &LaneVec3<W>, high: &LaneVec3<W>, limit: Real) -> (W, W) {
        let (low, high) = (low.columns(), high.columns());
        let none = W::splat(Real::MAX);
        let (mut enter, mut leave) = (W::ZERO, W::splat(limit));
        for axis in 0..3 {
            let (origin, half) = (self.origin[axis], self.half[axis]);
            let (a, b) = if half == 0.0 {
                (low[axis] - W::splat(origin), high[axis] - W::splat(origin))
            } else {
                (low[axis] - W::splat(half) - W::splat(origin), high[axis] + W::splat(half) - W::splat(origin))
            };
            let inverse = self.axes[axis];
            if inverse.far == 0.0 {
                leave = a.if_positive(-none, leave);
                leave = b.if_at_least(W::ZERO, leave, -none);
                continue;
            }
            let (near, far) = if inverse.far > 0.0 { (a, b) } else { (b, a) };
            enter = (near * W::splat(inverse.near)).max(enter);
            leave = (far * W::splat(inverse.far)).min(leave);
        }
        (enter, leave)
    }

    /// How much the box was grown against rounding, at most.
    pub(crate) fn slack(&self) -> Real {
        self.slack
    }
}

/// Squared distance of a box from each of eight; [`Real::MAX`] for those farther than `limit` (squared as well).
#[inline(always)]
pub(crate) fn box_distances<W: Lanes<WIDTH>>(aabb: &Aabb, low: &LaneVec3<W>, high: &LaneVec3<W>, limit: Real) -> W {
    let zero = W::ZERO;
    let x = (low.x - W::splat(aabb.max.x)).max(W::splat(aabb.min.x) - high.x).max(zero);
    let y = (low.y - W::splat(aabb.max.y)).max(W::splat(aabb.min.y) - high.y).max(zero);
    let z = (low.z - W::splat(aabb.max.z)).max(W::splat(aabb.min.z) - high.z).max(zero);
    let squared = x * x + y * y + z * z;
    W::splat(limit).if_at_least(squared, squared, W::splat(Real::MAX))
}
