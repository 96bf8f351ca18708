//! Pairs of edges: their gap, and the search for the best pair, one edge of hull 1 against a group of hull 2 at a time.

use super::{Axis, EDGES};
use crate::math::{Mat3, Real, Vec3, max, normalize_or};
use crate::shape::polyhedron::{Polyhedron, negatives};
use crate::shape::{HalfEdge, LANES};

/// Edges with `sin²` of their angle below this are parallel: faces stand in for them.
const PARALLEL: Real = 1e-5;
/// A hull of 255 corners has at most 759 edges.
pub(super) const MAX_EDGE_WORDS: usize = 12;

/// An edge with the normals of its faces, all in the frame of hull 1.
#[derive(Clone, Copy, Default)]
pub(super) struct Edge {
    pub start: Vec3,
    pub along: Vec3,
    pub left: Vec3,
    pub right: Vec3,
}

/// Some edges of a hull, a bit each.
pub(super) type EdgeSet = [u64; MAX_EDGE_WORDS];

/// [`LANES`] edges of hull 2, turned into the frame of hull 1: an edge of hull 1 is tried against all of them at once.
#[derive(Clone, Copy, Default)]
pub(super) struct EdgeGroup {
    pub indices: [u32; LANES],
    pub start: [[Real; LANES]; 3],
    pub along: [[Real; LANES]; 3],
    pub left: [[Real; LANES]; 3],
    pub right: [[Real; LANES]; 3],
}

impl Edge {
    #[inline(always)]
    pub fn new(polyhedron: &Polyhedron, index: usize) -> Self {
        let (start, end) = polyhedron.edge_points(index);
        let normal = |e: HalfEdge| polyhedron.planes[e.face as usize].normal;
        Self {
            start,
            along: end - start,
            left: normal(polyhedron.edges[index]),
            right: normal(polyhedron.edges[index ^ 1]),
        }
    }

    #[inline(always)]
    pub fn placed(&self, m: &Mat3, t: Vec3) -> Self {
        Self { start: *m * self.start + t, along: *m * self.along, left: *m * self.left, right: *m * self.right }
    }

    /// Gap and normal of a pair of edges whose arcs cross; `self` is of hull 1.
    #[inline(always)]
    pub fn gap(&self, other: &Self) -> Option<(Real, Vec3)> {
        let (c, d) = (other.left.dot(self.along), other.right.dot(self.along));
        let (a, b) = (self.left.dot(other.along), self.right.dot(other.along));
        // One branch, as the three tests are hard to foretell each by itself.
        if !((c * d < 0.0) & (a * b < 0.0) & (c * b < 0.0)) {
            return None;
        }
        self.gap_of_crossing(other.start, other.along)
    }

    /// Gap and normal of a pair of edges whose arcs are known to cross.
    #[inline(always)]
    pub fn gap_of_crossing(&self, start: Vec3, along: Vec3) -> Option<(Real, Vec3)> {
        let cross = self.along.cross(along);
        let squared = cross.length_squared();
        if squared <= PARALLEL * self.along.length_squared() * along.length_squared() {
            return None;
        }
        let normal = normalize_or(cross, self.left);
        let normal = if normal.dot(self.left + self.right) < 0.0 { -normal } else { normal };
        Some((normal.dot(start - self.start), normal))
    }
}

impl EdgeGroup {
    /// Takes up to [`LANES`] edges out of a set; false if there is none left.
    #[inline(always)]
    pub fn fill(&mut self, set: &mut EdgeSet, polyhedron: &Polyhedron, (m, t): (&Mat3, Vec3)) -> bool {
        let words = polyhedron.edges.len().div_ceil(128).min(MAX_EDGE_WORDS);
        let mut count = 0;
        for (word, bits) in set[..words].iter_mut().enumerate() {
            while *bits != 0 && count < LANES {
                let index = 64 * word as u32 + bits.trailing_zeros();
                *bits &= *bits - 1;
                let edge = Edge::new(polyhedron, 2 * index as usize);
                self.indices[count] = index;
                let lists = [&mut self.start, &mut self.along, &mut self.left, &mut self.right];
                for (list, v) in lists.into_iter().zip([edge.start, edge.along, edge.left, edge.right]) {
                    (list[0][count], list[1][count], list[2][count]) = (v.x, v.y, v.z);
                }
                count += 1;
            }
        }
        if count == 0 {
            return false;
        }
        // No normals, no arcs: what is left over from the last group never crosses.
        for lane in count..LANES {
            for list in [&mut self.left, &mut self.right] {
                (list[0][lane], list[1][lane], list[2][lane]) = (0.0, 0.0, 0.0);
            }
        }
        turn(&mut self.start, m);
        turn(&mut self.along, m);
        turn(&mut self.left, m);
        turn(&mut self.right, m);
        for k in 0..LANES {
            self.start[0][k] += t.x;
            self.start[1][k] += t.y;
            self.start[2][k] += t.z;
        }
        true
    }

    /// Puts in the place of `best` what has a larger gap.
    #[inline(always)]
    pub fn improve(&self, index1: u32, edge: &Edge, best: &mut Axis) {
        let (c, d) = (dots(edge.along, &self.left), dots(edge.along, &self.right));
        let (a, b) = (dots(edge.left, &self.along), dots(edge.right, &self.along));
        let mut sign = [0.0; LANES];
        for k in 0..LANES {
            sign[k] = max(max(c[k] * d[k], a[k] * b[k]), c[k] * b[k]);
        }
        let mut bits = negatives(&sign);
        while bits != 0 {
            let k = bits.trailing_zeros() as usize;
            bits &= bits - 1;
            // Not so for a negative zero.
            if sign[k] < 0.0 {
                let take = |list: &[[Real; LANES]; 3]| Vec3::new(list[0][k], list[1][k], list[2][k]);
                let Some((gap, _)) = edge.gap_of_crossing(take(&self.start), take(&self.along)) else { continue };
                let code = EDGES | index1 << 16 | self.indices[k] << 1;
                if gap > best.gap || (gap == best.gap && code < best.code) {
                    *best = Axis { code, gap };
                }
            }
        }
    }
}

/// `m v` for each lane.
#[inline(always)]
fn turn(v: &mut [[Real; LANES]; 3], m: &Mat3) {
    let [x, y, z] = *v;
    for (axis, list) in v.iter_mut().enumerate() {
        let (a, b, c) = (m.x_axis[axis], m.y_axis[axis], m.z_axis[axis]);
        *list = std::array::from_fn(|k| a * x[k] + b * y[k] + c * z[k]);
    }
}

/// `u · v` for each lane.
#[inline(always)]
fn dots(u: Vec3, v: &[[Real; LANES]; 3]) -> [Real; LANES] {
    std::array::from_fn(|k| u.x * v[0][k] + u.y * v[1][k] + u.z * v[2][k])
}
