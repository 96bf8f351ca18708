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
use crate::math::{Aabb, Real, Vec3};
use crate::simd::{KernelOfEight, LaneVec3, Lanes, Number, Wide, run_eight};

/// Children of a node.
pub(super) const WIDTH: usize = 8;
/// Triangles in a leaf at most.
pub(crate) const LEAF: usize = 8;
/// Nodes on the way to a leaf at most: a child either holds at most half of the triangles of its parent or came from seven
/// cuts, of which at most 31 in a row are uneven.
const MOST_LEVELS: usize = 48;

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

    /// Walks the leaves along a ray, near ones first. `visit` gets a stored triangle and returns how far (in multiples of
    /// the direction) is still of interest.
    pub(super) fn cast(&self, ray: &Slabs, limit: Real, mut visit: impl FnMut(usize) -> Real) {
        let mut limit = limit;
        // Children that the ray enters (eight times the node's number plus the lane), and where it does.
        let mut stack = [(0_u32, 0.0 as Real); MOST_LEVELS * (WIDTH - 1) + 1];
        let mut top = self.enter(0, ray, limit, &mut stack, 0);
        while top > 0 {
            top -= 1;
            let (child, entry) = stack[top];
            if entry > limit {
                continue;
            }
            let (node, lane) = (&self.nodes[child as usize / WIDTH], child as usize % WIDTH);
            if node.counts[lane] == 0 {
                top = self.enter(node.first[lane], ray, limit, &mut stack, top);
            } else {
                for triangle in node.first[lane]..node.first[lane] + u32::from(node.counts[lane]) {
                    limit = visit(triangle as usize);
                }
            }
        }
    }

    /// Puts the children that a ray enters on the stack, the nearest last. Returns the new height of the stack.
    fn enter(&self, node: u32, ray: &Slabs, limit: Real, stack: &mut [(u32, Real)], top: usize) -> usize {
        let mut entries = [0.0; WIDTH];
        run_eight(Entries { node: &self.nodes[node as usize], ray, limit, entries: &mut entries });
        let mut end = top;
        for (lane, &entry) in entries.iter().enumerate() {
            if entry == Real::MAX {
                continue;
            }
            let mut place = end;
            while place > top && stack[place - 1].1 < entry {
                stack[place] = stack[place - 1];
                place -= 1;
            }
            stack[place] = (node * WIDTH as u32 + lane as u32, entry);
            end += 1;
        }
        end
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

/// A ray made ready for boxes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slabs {
    origin: [Real; 3],
    inverse: [Real; 3],
}

impl Slabs {
    pub(super) fn new(origin: Vec3, direction: Vec3) -> Self {
        let inverse = |d: Real| if d == 0.0 { 0.0 } else { 1.0 / d };
        Self { origin: origin.to_array(), inverse: direction.to_array().map(inverse) }
    }
}

/// Where a ray enters the boxes of a node before `limit`; [`Real::MAX`] for those that it misses. Boxes are grown by a
/// few rounding errors, so that none is missed whose triangle the exact test would hit.
struct Entries<'a> {
    node: &'a Node,
    ray: &'a Slabs,
    limit: Real,
    entries: &'a mut [Real; WIDTH],
}

impl KernelOfEight for Entries<'_> {
    #[inline(always)]
    fn run<W: Lanes<WIDTH>>(self) {
        const GROW: Real = 1.0 + 1e-6;
        let (low, high): (LaneVec3<W>, LaneVec3<W>) = (self.node.low.to_lanes(), self.node.high.to_lanes());
        let (low, high) = (low.columns(), high.columns());
        let none = W::splat(Real::MAX);
        let (mut enter, mut leave) = (W::ZERO, W::splat(self.limit));
        for axis in 0..3 {
            let origin = W::splat(self.ray.origin[axis]);
            let slack = W::splat(1e-6) * low[axis].abs().max(high[axis].abs()).max(origin.abs());
            let (a, b) = (low[axis] - origin - slack, high[axis] - origin + slack);
            let inverse = self.ray.inverse[axis];
            if inverse == 0.0 {
                enter = a.if_positive(none, enter);
                enter = b.if_at_least(W::ZERO, enter, none);
                continue;
            }
            let (near, far) = if inverse > 0.0 { (a, b) } else { (b, a) };
            enter = (near * W::splat(inverse / GROW)).max(enter);
            leave = (far * W::splat(inverse * GROW)).min(leave);
        }
        *self.entries = leave.if_at_least(enter, enter, none).to_array();
    }
}
