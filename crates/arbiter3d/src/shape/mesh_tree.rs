//! Bounding-volume tree over the triangles of a mesh: built once, flat, depth first.
//!
//! Top-down build: each range of triangles is cut where the surface-area heuristic `area · count` (left plus right) is least,
//! centroids sorted into bins along each axis. Where the bins cannot cut (equal centroids) or the tree has become deep, the
//! range is halved at its median instead, which bounds the depth: at most [`SAH_DEPTH`] levels by area, then at most 32 halvings.
//! Source: Wald, "On fast Construction of SAH-based Bounding Volume Hierarchies", 2007.
//!
//! Invariants: the first child follows its parent, the second is `first`; leaves hold 1 to [`LEAF_SIZE`] triangles of
//! consecutive numbers, numbered in the order in which the tree is walked.

use crate::math::{Aabb, Real, Vec3, max, max3, min, min3};

/// A node of the mesh's tree.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct MeshNode {
    /// Box around everything below.
    pub aabb: Aabb,
    /// First triangle of a leaf, or index of the second child (the first follows its parent).
    pub first: u32,
    /// Triangles in a leaf, zero for an inner node.
    pub count: u32,
}

/// Triangles in a leaf at most.
const LEAF_SIZE: usize = 4;
/// Bins an axis.
const BINS: usize = 16;
/// Levels that may be cut by area; below them ranges are halved.
const SAH_DEPTH: usize = 31;
/// Entries of a walk's stack: one a level.
const STACK: usize = 64;

/// The tree: nodes alone; the triangles are its owner's.
#[derive(Clone, Debug, Default)]
pub(super) struct MeshTree {
    nodes: Vec<MeshNode>,
}

impl MeshTree {
    /// Builds the tree of some boxes, and the order in which their owners have to be stored.
    pub(super) fn build(boxes: &[Aabb]) -> (Self, Vec<u32>) {
        let mut builder = Builder {
            boxes,
            centers: boxes.iter().map(Aabb::center).collect(),
            order: (0..boxes.len() as u32).collect(),
            scratch: Vec::with_capacity(boxes.len()),
            nodes: Vec::with_capacity(boxes.len()),
        };
        builder.node(0, boxes.len(), 0);
        (Self { nodes: builder.nodes }, builder.order)
    }

    pub(super) fn nodes(&self) -> &[MeshNode] {
        &self.nodes
    }

    /// Calls `visit` with every stored triangle of every leaf that overlaps the box, in ascending order.
    #[inline]
    pub(super) fn query(&self, aabb: &Aabb, mut visit: impl FnMut(usize)) {
        let mut stack = [0_u32; STACK];
        let mut top = 0;
        let mut index = 0;
        loop {
            let node = &self.nodes[index];
            if node.aabb.overlaps(aabb) {
                if node.count == 0 {
                    stack[top] = node.first;
                    top += 1;
                    index += 1;
                    continue;
                }
                for triangle in node.first..node.first + node.count {
                    visit(triangle as usize);
                }
            }
            if top == 0 {
                return;
            }
            top -= 1;
            index = stack[top] as usize;
        }
    }

    /// Walks the leaves along a ray, near ones first. `visit` gets a stored triangle and returns how far (in multiples of
    /// the direction) is still of interest.
    pub(super) fn cast(&self, ray: &Slabs, limit: Real, mut visit: impl FnMut(usize) -> Real) {
        let mut limit = limit;
        let mut stack = [(0_u32, 0.0 as Real); STACK];
        let mut top = 0;
        let Some(mut entry) = ray.entry(&self.nodes[0].aabb, limit) else { return };
        let mut index = 0_usize;
        loop {
            let node = &self.nodes[index];
            if node.count > 0 && entry <= limit {
                for triangle in node.first..node.first + node.count {
                    limit = visit(triangle as usize);
                }
            } else if entry <= limit {
                let (near, far) = self.children(index, ray, limit);
                if let Some(far) = far {
                    stack[top] = far;
                    top += 1;
                }
                if let Some((child, at)) = near {
                    (index, entry) = (child as usize, at);
                    continue;
                }
            }
            if top == 0 {
                return;
            }
            top -= 1;
            (index, entry) = (stack[top].0 as usize, stack[top].1);
        }
    }

    /// The children that a ray enters, with where it does, the nearer first.
    #[expect(clippy::type_complexity, reason = "two optional (node, entry) pairs: a name would say no more")]
    fn children(&self, index: usize, ray: &Slabs, limit: Real) -> (Option<(u32, Real)>, Option<(u32, Real)>) {
        let enter = |child: u32| ray.entry(&self.nodes[child as usize].aabb, limit).map(|at| (child, at));
        match (enter(index as u32 + 1), enter(self.nodes[index].first)) {
            (Some(a), Some(b)) if b.1 < a.1 => (Some(b), Some(a)),
            (None, b) => (b, None),
            pair => pair,
        }
    }
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

    /// Where the ray enters the box, if it does before `limit`. Grown by a few rounding errors, so that no box is missed
    /// whose triangle the exact test would hit.
    fn entry(&self, aabb: &Aabb, limit: Real) -> Option<Real> {
        const GROW: Real = 1.0 + 1e-6;
        let (low, high) = (aabb.min.to_array(), aabb.max.to_array());
        let (mut enter, mut leave) = (0.0, limit);
        for axis in 0..3 {
            let (a, b) = (low[axis] - self.origin[axis], high[axis] - self.origin[axis]);
            let slack = 1e-6 * max(max(low[axis].abs(), high[axis].abs()), self.origin[axis].abs());
            if self.inverse[axis] == 0.0 {
                if a > slack || b < -slack {
                    return None;
                }
                continue;
            }
            let (t1, t2) = ((a - slack) * self.inverse[axis], (b + slack) * self.inverse[axis]);
            enter = max(enter, min(t1, t2) / GROW);
            leave = min(leave, max(t1, t2) * GROW);
        }
        (enter <= leave).then_some(enter)
    }
}

struct Builder<'a> {
    boxes: &'a [Aabb],
    centers: Vec<Vec3>,
    order: Vec<u32>,
    scratch: Vec<u32>,
    nodes: Vec<MeshNode>,
}

/// Where to cut a range.
struct Cut {
    axis: usize,
    low: Real,
    scale: Real,
    /// Bins up to this one go left.
    last: usize,
}

impl Cut {
    fn bin(&self, center: Vec3) -> usize {
        (((center[self.axis] - self.low) * self.scale) as usize).min(BINS - 1)
    }
}

impl Builder<'_> {
    fn node(&mut self, start: usize, end: usize, depth: usize) {
        let index = self.nodes.len();
        let aabb = self.order[start..end].iter().fold(Aabb::EMPTY, |b, &t| b.union(&self.boxes[t as usize]));
        self.nodes.push(MeshNode { aabb, first: start as u32, count: (end - start) as u32 });
        if end - start <= LEAF_SIZE {
            return;
        }
        let cut = if depth < SAH_DEPTH { self.best_cut(start, end) } else { None };
        let middle = match cut {
            Some(cut) => self.partition(start, end, &cut),
            None => self.halve(start, end),
        };
        self.node(start, middle, depth + 1);
        self.nodes[index].first = self.nodes.len() as u32;
        self.nodes[index].count = 0;
        self.node(middle, end, depth + 1);
    }

    fn center_bounds(&self, start: usize, end: usize) -> Aabb {
        self.order[start..end].iter().fold(Aabb::EMPTY, |b, &t| {
            let c = self.centers[t as usize];
            Aabb::new(min3(b.min, c), max3(b.max, c))
        })
    }

    /// The cut with the least `area · count`; `None` where all centroids are equal (or too close to tell apart).
    fn best_cut(&self, start: usize, end: usize) -> Option<Cut> {
        let bounds = self.center_bounds(start, end);
        let mut best: Option<Cut> = None;
        let mut best_cost = Real::MAX;
        for axis in 0..3 {
            let extent = bounds.max[axis] - bounds.min[axis];
            let scale = BINS as Real / extent;
            if !(extent > 0.0 && scale.is_finite()) {
                continue;
            }
            let cut = Cut { axis, low: bounds.min[axis], scale, last: 0 };
            if let Some((last, cost)) = self.cheapest_bin(start, end, &cut)
                && cost < best_cost
            {
                best_cost = cost;
                best = Some(Cut { last, ..cut });
            }
        }
        best
    }

    /// The last bin on the left of the cheapest cut of one axis, and that cut's cost.
    fn cheapest_bin(&self, start: usize, end: usize, cut: &Cut) -> Option<(usize, Real)> {
        let mut boxes = [Aabb::EMPTY; BINS];
        let mut counts = [0_usize; BINS];
        for &triangle in &self.order[start..end] {
            let bin = cut.bin(self.centers[triangle as usize]);
            boxes[bin] = boxes[bin].union(&self.boxes[triangle as usize]);
            counts[bin] += 1;
        }
        // Costs of everything right of each bin, from the far end.
        let mut right = [0.0; BINS];
        let (mut aabb, mut count) = (Aabb::EMPTY, 0);
        for bin in (1..BINS).rev() {
            aabb = aabb.union(&boxes[bin]);
            count += counts[bin];
            right[bin - 1] = if count == 0 { Real::MAX } else { aabb.area() * count as Real };
        }
        let mut best = None;
        let mut best_cost = Real::MAX;
        (aabb, count) = (Aabb::EMPTY, 0);
        for bin in 0..BINS - 1 {
            aabb = aabb.union(&boxes[bin]);
            count += counts[bin];
            if count == 0 || right[bin] == Real::MAX {
                continue;
            }
            let cost = aabb.area() * count as Real + right[bin];
            if cost < best_cost {
                best_cost = cost;
                best = Some((bin, cost));
            }
        }
        best
    }

    /// Sorts a range into left and right of a cut, keeping the order within each.
    fn partition(&mut self, start: usize, end: usize, cut: &Cut) -> usize {
        self.scratch.clear();
        let mut middle = start;
        for i in start..end {
            let triangle = self.order[i];
            if cut.bin(self.centers[triangle as usize]) <= cut.last {
                self.order[middle] = triangle;
                middle += 1;
            } else {
                self.scratch.push(triangle);
            }
        }
        self.order[middle..end].copy_from_slice(&self.scratch);
        middle
    }

    /// Halves a range along its longest axis.
    fn halve(&mut self, start: usize, end: usize) -> usize {
        let bounds = self.center_bounds(start, end);
        let size = bounds.max - bounds.min;
        let axis = if size.x >= size.y && size.x >= size.z { 0 } else { 1 + usize::from(size.z > size.y) };
        let centers = &self.centers;
        self.order[start..end]
            .sort_by(|&a, &b| centers[a as usize][axis].total_cmp(&centers[b as usize][axis]).then(a.cmp(&b)));
        start + (end - start) / 2
    }
}
