//! Walks through the tree: boxes that overlap, boxes along a ray, boxes near a box.
//!
//! No walk allocates: a tree is at most [`MAX_HEIGHT`] high, and a depth-first walk keeps one sibling a level.

use super::{DynamicTree, Link, MAX_HEIGHT};
use crate::math::{Aabb, Real, Vec3, max3};

const STACK: usize = MAX_HEIGHT as usize + 2;

/// A point, or a box with these half extents, that moves along a line.
///
/// The line enters a box (grown by the half extents) where it has passed the near plane of all three axes, and leaves where it
/// passes the first far plane. Every operation is monotone in the box, rounding included: a parent is never missed when its
/// child is hit.
#[derive(Clone, Copy, Debug)]
struct Line {
    origin: Vec3,
    inverse: Vec3,
    half: Vec3,
}

impl Line {
    fn new(origin: Vec3, direction: Vec3) -> Self {
        Self { origin, inverse: Vec3::ONE / direction, half: Vec3::ZERO }
    }

    /// Fraction at which the line enters, if it does so by `limit`.
    #[inline(always)]
    fn enter(&self, aabb: &Aabb, limit: Real) -> Option<Real> {
        let low = aabb.min - self.origin - self.half;
        let high = aabb.max - self.origin + self.half;
        let mut entry: Real = 0.0;
        let mut exit = limit;
        for axis in 0..3 {
            let inverse = self.inverse[axis];
            let (near, far) = if inverse < 0.0 { (high[axis], low[axis]) } else { (low[axis], high[axis]) };
            // A line inside the plane of a face gives 0 · ∞ = NaN, which fails both comparisons: touching counts.
            let (near, far) = (near * inverse, far * inverse);
            if near > entry {
                entry = near;
            }
            if far < exit {
                exit = far;
            }
        }
        // Two roundings on either side: a line along an edge must not slip between two boxes.
        if entry <= exit * (1.0 + 4.0 * Real::EPSILON) { Some(entry) } else { None }
    }
}

impl DynamicTree {
    /// Calls `visit` with the data of each leaf whose box overlaps `aabb`, until it returns `false`.
    pub fn query(&self, aabb: &Aabb, mut visit: impl FnMut(u32) -> bool) {
        if self.is_empty() || !self.box_of(self.root).overlaps(aabb) {
            return;
        }
        let mut stack = [Link::NONE; STACK];
        let mut depth = 1;
        stack[0] = self.root;
        while depth > 0 {
            depth -= 1;
            let link = stack[depth];
            if link.is_leaf() {
                if !visit(self.leaves[link.index()].data) {
                    return;
                }
                continue;
            }
            let node = &self.nodes[link.index()];
            // Written in any case, kept only on overlap: cheaper than a branch that cannot be predicted.
            stack[depth] = node.children[1];
            depth += usize::from(node.bounds[1].overlaps(aabb));
            stack[depth] = node.children[0];
            depth += usize::from(node.bounds[0].overlaps(aabb));
        }
    }

    /// Calls `visit` with the data of each leaf whose box the ray `origin + t · direction`, `0 ≤ t ≤ max_fraction`, meets,
    /// near ones mostly first. It gets the present limit of `t` and returns a new one: the same to go on, a smaller one to
    /// cut the ray, a negative one to stop.
    pub fn ray(&self, origin: Vec3, direction: Vec3, max_fraction: Real, visit: impl FnMut(u32, Real) -> Real) {
        let line = Line::new(origin, direction);
        self.descend(max_fraction, |aabb, limit| line.enter(aabb, limit), visit);
    }

    /// As [`Self::ray`] for a box with these half extents that moves with its middle on the ray.
    pub fn cast(
        &self,
        (origin, half): (Vec3, Vec3),
        direction: Vec3,
        max_fraction: Real,
        visit: impl FnMut(u32, Real) -> Real,
    ) {
        let line = Line { half, ..Line::new(origin, direction) };
        self.descend(max_fraction, |aabb, limit| line.enter(aabb, limit), visit);
    }

    /// Calls `visit` with the data of each leaf whose box is no farther from `aabb` than `limit`, near ones mostly first. It
    /// gets the present limit and returns a new one, as in [`Self::ray`]. All distances are squared.
    pub fn nearest(&self, aabb: &Aabb, limit: Real, visit: impl FnMut(u32, Real) -> Real) {
        let distance = |other: &Aabb, limit: Real| {
            let gap = max3(max3(aabb.min - other.max, other.min - aabb.max), Vec3::ZERO);
            Some(gap.length_squared()).filter(|&squared| squared <= limit)
        };
        self.descend(limit, distance, visit);
    }

    /// Visits leaves, those with the least `entry` mostly first. An entry is how far away a box is, if that is within the limit.
    #[inline(always)]
    fn descend(
        &self,
        max_fraction: Real,
        entry_of: impl Fn(&Aabb, Real) -> Option<Real>,
        mut visit: impl FnMut(u32, Real) -> Real,
    ) {
        let mut limit = max_fraction;
        let mut stack = [(Link::NONE, 0.0); STACK];
        let mut depth = 0;
        let start = if self.is_empty() { None } else { entry_of(&self.box_of(self.root), limit) };
        if let Some(entry) = start {
            stack[0] = (self.root, entry);
            depth = 1;
        }
        while depth > 0 {
            depth -= 1;
            let (link, entry) = stack[depth];
            if entry > limit {
                continue;
            }
            if link.is_leaf() {
                limit = crate::math::min(visit(self.leaves[link.index()].data, limit), limit);
                if limit < 0.0 {
                    return;
                }
                continue;
            }
            let node = &self.nodes[link.index()];
            let entries = [entry_of(&node.bounds[0], limit), entry_of(&node.bounds[1], limit)];
            let near = usize::from(matches!(entries, [Some(a), Some(b)] if b < a));
            for side in [1 - near, near] {
                if let Some(entry) = entries[side] {
                    stack[depth] = (node.children[side], entry);
                    depth += 1;
                }
            }
        }
    }

    /// Whether the walks would meet this box: the test they apply to leaves, for comparison with brute force.
    #[cfg(test)]
    pub(super) fn line_meets(origin: Vec3, direction: Vec3, limit: Real, aabb: &Aabb) -> bool {
        Line::new(origin, direction).enter(aabb, limit).is_some()
    }
}
