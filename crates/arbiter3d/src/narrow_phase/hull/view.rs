//! The side of a pair seen from one of its hulls: which face and which edges can be best, and the clipped face.

use super::edges::{EdgeSet, MAX_EDGE_WORDS};
use super::{BALL_SLACK, face_gap, transposed_mul};
use crate::math::{Mat3, Real, Vec3, max};
use crate::narrow_phase::clip::{ClipPoint, clip_polygon, reduce};
use crate::narrow_phase::{Manifold, ManifoldPoint};
use crate::shape::LANES;
use crate::shape::polyhedron::{ALL_LANES, Polyhedron, negatives};

/// Share of the smaller size by which side planes are moved out, so that corners on the border stay corners.
const GROWTH: Real = 1e-4;

/// The side of a pair seen from one of its hulls: what face queries and clipping need.
pub(super) struct View<'a, const G: usize> {
    pub own: &'a Polyhedron<'a>,
    pub other: &'a Polyhedron<'a>,
    /// Axes and origin of the other hull's frame in the own one.
    pub m: Mat3,
    pub t: Vec3,
    /// Height of the other centre over each of the own faces.
    pub heights: [[Real; LANES]; G],
}

impl<'a, const G: usize> View<'a, G> {
    #[inline(always)]
    pub fn new(own: &'a Polyhedron<'a>, other: &'a Polyhedron<'a>, m: Mat3, t: Vec3) -> Self {
        let mut heights = [[0.0; LANES]; G];
        let center = m * other.center + t;
        for (height, face) in heights.iter_mut().zip(own.faces) {
            *height = std::array::from_fn(|k| {
                face.x[k] * center.x + face.y[k] * center.y + face.z[k] * center.z - face.offset[k]
            });
        }
        Self { own, other, m, t, heights }
    }

    #[inline(always)]
    pub fn height(&self, face: usize) -> Real {
        self.heights[face / LANES][face % LANES]
    }

    /// Height of the other hull over the plane of a face.
    #[inline(always)]
    pub fn face_gap(&self, face: usize) -> Real {
        face_gap(self.own.planes[face], self.other, &self.m, self.t)
    }

    /// The face that the other centre is highest above, most often the best one; of several, the first.
    #[inline(always)]
    pub fn highest(&self) -> usize {
        let heights = &self.heights[..self.own.faces.len()];
        let mut running = [-Real::MAX; LANES];
        for group in heights {
            for k in 0..LANES {
                running[k] = max(group[k], running[k]);
            }
        }
        let highest = running.iter().fold(-Real::MAX, |highest, &height| max(height, highest));
        for (index, group) in heights.iter().enumerate() {
            let lower = negatives(&std::array::from_fn(|k| group[k] - highest));
            if lower != ALL_LANES {
                let face = index * LANES + (!lower).trailing_zeros() as usize;
                return if face < self.own.planes.len() { face } else { 0 };
            }
        }
        0
    }

    /// The first face with the largest gap; faces that cannot reach `floor` are not looked at. A face whose gap is
    /// known prunes the others from the start.
    #[inline(always)]
    pub fn best_face(&self, known: Option<(usize, Real)>, floor: Real) -> (usize, Real) {
        let radius = self.other.inner_radius * (1.0 - BALL_SLACK);
        let (first, mut gap) = if let Some(known) = known {
            known
        } else {
            let first = self.highest();
            (first, if self.height(first) - radius < floor { -Real::MAX } else { self.face_gap(first) })
        };
        let mut best = first;
        for (group, heights) in self.heights[..self.own.faces.len()].iter().enumerate() {
            let bound = max(gap, floor);
            let mut bits = ALL_LANES & !negatives(&std::array::from_fn(|k| heights[k] - radius - bound));
            while bits != 0 {
                let lane = bits.trailing_zeros() as usize;
                bits &= bits - 1;
                let face = group * LANES + lane;
                if face == first || heights[lane] - radius < max(gap, floor) || face >= self.own.planes.len() {
                    continue;
                }
                let g = self.face_gap(face);
                if g > gap || (g == gap && face < best) {
                    (best, gap) = (face, g);
                }
            }
        }
        (best, gap)
    }

    /// The edges that can have a gap of `floor` or more: see [`super`].
    #[inline(always)]
    pub fn promising_edges(&self, floor: Real) -> EdgeSet {
        let limit = floor + self.other.inner_radius * (1.0 - BALL_SLACK);
        let squared = limit * limit;
        let mut set = [0; MAX_EDGE_WORDS];
        for (group, (heights, faces)) in self.heights.iter().zip(self.own.faces).enumerate() {
            // A face whose height `h` is below the limit reaches it on no arc to a lower face if `h / cos(half the
            // arc)` does not: then both differences are negative.
            let short = std::array::from_fn(|k| heights[k] - limit);
            let flat = std::array::from_fn(|k| {
                if heights[k] > 0.0 { heights[k] * heights[k] - squared * faces.cosine_squared[k] } else { -1.0 }
            });
            let mut bits = ALL_LANES & !(negatives(&short) & negatives(&flat));
            while bits != 0 {
                let face = group * LANES + bits.trailing_zeros() as usize;
                bits &= bits - 1;
                if face >= self.own.planes.len() {
                    break; // padding, which only a pose that is no number can reach
                }
                // The edge is met from the higher of its faces.
                let height = self.height(face);
                for border in self.own.border(face) {
                    let rises = (height > 0.0) & (height * height >= squared * border.cosine_squared);
                    set[border.edge as usize / 64] |= u64::from((height >= limit) | rises) << (border.edge % 64);
                }
            }
        }
        set
    }

    /// Clips the incident face against the reference face; the manifold is in the own frame.
    #[inline(always)]
    pub fn face_contact(&self, face: usize, reach: (Real, Real), manifold: &mut Manifold) {
        let incident = self.incident_face(self.own.planes[face].normal);
        let corners = self.own.face_loop(face).count() + self.other.face_loop(incident).count();
        // Each plane adds at most one corner. Large faces are rare: only they pay for clearing large buffers.
        if corners <= 8 {
            self.clip_faces::<8>(face, incident, reach, manifold);
        } else if corners <= 24 {
            self.clip_faces::<24>(face, incident, reach, manifold);
        } else {
            self.clip_faces::<512>(face, incident, reach, manifold);
        }
    }

    /// Of the faces around the other hull's lowest corner, the one that looks most against `normal`.
    ///
    /// Among all faces it would be the wrong one where two faces meet almost flat: the one that looks straighter down may
    /// end at the edge between them, with the deepest corner on the other one.
    #[inline(always)]
    pub fn incident_face(&self, normal: Vec3) -> usize {
        let n = transposed_mul(&self.m, normal);
        let mut best = 0;
        let mut cosine = Real::MAX;
        for &face in self.other.faces_around(self.other.lowest_corner(n)) {
            let c = self.other.planes[face as usize].normal.dot(n);
            // Clearly more, so that of two faces at the same angle the first one stays.
            if c < cosine - 1e-3 {
                (best, cosine) = (face as usize, c);
            }
        }
        best
    }

    pub fn clip_faces<const N: usize>(
        &self,
        face: usize,
        incident: usize,
        (margin, size): (Real, Real),
        manifold: &mut Manifold,
    ) {
        let plane = self.own.planes[face];
        let mut buffers = [[ClipPoint::default(); N]; 2];
        let [front, back] = &mut buffers;
        let (mut front, mut back) = (front, back);
        let mut count = 0;
        for edge in self.other.face_loop(incident) {
            let position = self.m * self.other.vertices[self.other.edges[edge].origin as usize] + self.t;
            let separation = plane.normal.dot(position) - plane.offset;
            front[count] = ClipPoint { position, separation, feature: (edge as u32 + 1) << 12 };
            count += 1;
        }
        for (cut, edge) in self.own.face_loop(face).enumerate() {
            let (out, offset) = self.own.side_plane(edge);
            count = clip_polygon(&front[..count], (out, offset + GROWTH * size), cut as u32, back);
            std::mem::swap(&mut front, &mut back);
        }
        let mut kept = 0;
        for k in 0..count {
            if front[k].separation <= margin {
                front[kept] = front[k];
                kept += 1;
            }
        }
        let faces = ((face as u32 + 1).wrapping_mul(0x85EB_CA6B) ^ (incident as u32 + 1).wrapping_mul(0xC2B2_AE35))
            & 0x1FFF_F000;
        let (chosen, count) = reduce(&front[..kept], plane.normal, size);
        for &k in &chosen[..count] {
            let p = front[k];
            manifold.push(ManifoldPoint {
                point1: p.position - plane.normal * p.separation,
                normal: plane.normal,
                separation: p.separation,
                feature: p.feature ^ faces,
            });
        }
    }
}
