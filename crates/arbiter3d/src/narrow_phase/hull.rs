//! Convex hulls against hulls and cuboids: separating axes from faces and edge pairs, then a clipped face.
//!
//! For a face of one hull the gap is that of its plane to the lowest corner of the other hull. A pair of edges gives a
//! candidate only where it makes a face of the Minkowski difference: where the arcs that join the normals of their
//! faces cross on the unit sphere (Gregorius, "The Separating Axis Test between Convex Polyhedra", GDC 2013). With
//! edge directions `e1`, `e2`, face normals `a`, `b` left and right of `e1`, and `c`, `d` of `e2`, they cross when
//!
//! ```text
//! (c · e1)(d · e1) < 0,   (a · e2)(b · e2) < 0,   (c · e1)(b · e2) < 0
//! ```
//!
//! Most candidates are never looked at. The other hull holds a ball of radius `r` about its centre `m`, so the gap
//! along a unit normal `n` that supports this hull at `v` is at most `n · (m − v) − r`. For an edge, `n` is on the arc
//! between two normals, and `n · (m − v)` is at most the larger of the values at its ends, over the cosine of half the
//! arc where that is positive. What cannot beat the best gap so far is skipped; in round hulls this leaves the few
//! features next to the contact.
//!
//! Faces and edges are weighed against each other as in the cuboid kernel, with
//! [`tolerance_size`](super::polyhedron::tolerance_size) of the inner radius.
//!
//! The cache holds the last axis. It only ends the search early, when the hulls are still apart along it.

use super::clip::{ClipPoint, clip_polygon, reduce};
use super::cuboid::{ALIGNED, EDGE_BIAS, stands_in};
use super::distance::{Support, closest};
use super::polyhedron::{CuboidFeatures, Polyhedron};
use super::{Manifold, ManifoldPoint, PairCache};
use crate::math::{Mat3, Pose, Real, Vec3, clamp, max, min, normalize_or};
use crate::shape::{ConvexHull, Cuboid, HalfEdge};

/// A face of hull 2 is the reference when it is better by this share of the smaller size.
const FACE_BIAS: Real = 2e-3;
/// An edge pair is looked at when it is better than the best face by this share of the smaller size.
const EDGE_GAIN: Real = 2e-4;
/// Share of the smaller size by which side planes are moved out, so that corners on the border stay corners.
const GROWTH: Real = 1e-4;
/// Edges with `sin²` of their angle below this are parallel: faces stand in for them.
const PARALLEL: Real = 1e-5;
/// Edges of hull 2 that are held in the frame of hull 1 at a time.
const BATCH: usize = 32;

/// Edges that are tried at once.
const LANES: usize = 8;
/// A hull of 255 corners has at most 506 faces.
const MAX_FACES: usize = 512;
/// A hull of 255 corners has at most 759 edges.
const MAX_EDGES: usize = 768;

const FACE1: u32 = 1 << 30;
const FACE2: u32 = 2 << 30;
const EDGES: u32 = 3 << 30;

/// Two polyhedra and the placement of the second one in the frame of the first.
pub(crate) struct HullPair<'a> {
    pub polyhedron1: Polyhedron<'a>,
    pub polyhedron2: Polyhedron<'a>,
    /// Their support maps.
    pub supports: [Support<'a>; 2],
    pub pose: Pose,
    pub margin: Real,
}

/// Hull (shape 1) against hull.
pub(crate) fn hull_hull(
    a: &ConvexHull,
    b: &ConvexHull,
    pose: &Pose,
    margin: Real,
    (cache, manifold): (&mut PairCache, &mut Manifold),
) {
    let (polyhedron1, polyhedron2) = (Polyhedron::from_hull(a), Polyhedron::from_hull(b));
    let supports = [Support::Hull(a), Support::Hull(b)];
    HullPair { polyhedron1, polyhedron2, supports, pose: *pose, margin }.collide(cache, manifold);
}

/// Hull (shape 1) against cuboid.
pub(crate) fn hull_cuboid(
    a: &ConvexHull,
    b: &Cuboid,
    pose: &Pose,
    margin: Real,
    (cache, manifold): (&mut PairCache, &mut Manifold),
) {
    let features = CuboidFeatures::new(b);
    let (polyhedron1, polyhedron2) = (Polyhedron::from_hull(a), features.view());
    let supports = [Support::Hull(a), Support::Cuboid(*b)];
    HullPair { polyhedron1, polyhedron2, supports, pose: *pose, margin }.collide(cache, manifold);
}

/// An axis as the cache holds it, and the gap along it.
#[derive(Clone, Copy)]
struct Axis {
    code: u32,
    gap: Real,
}

impl Axis {
    /// The face, for a face axis.
    fn index(self) -> usize {
        (self.code & 0x3FFF_FFFF) as usize
    }

    /// The edges of hull 1 and hull 2, for a pair of edges.
    fn edges(self) -> (usize, usize) {
        (self.index() >> 15, self.index() & 0x7FFF)
    }
}

/// An edge with the normals of its faces, all in the frame of hull 1.
#[derive(Clone, Copy, Default)]
struct Edge {
    index: u16,
    start: Vec3,
    along: Vec3,
    left: Vec3,
    right: Vec3,
}

/// The side of a pair seen from one of its hulls: what face queries and clipping need.
struct View<'a> {
    own: &'a Polyhedron<'a>,
    other: &'a Polyhedron<'a>,
    /// Axes and centre of the other hull's frame in the own one.
    m: Mat3,
    t: Vec3,
    /// Height of the other centre over each of the own faces.
    heights: [Real; MAX_FACES],
}

/// [`LANES`] edges of hull 2, turned into the frame of hull 1: an edge of hull 1 is tried against all of them at once.
#[derive(Clone, Copy, Default)]
struct EdgeGroup {
    indices: [u16; LANES],
    along: [[Real; LANES]; 3],
    left: [[Real; LANES]; 3],
    right: [[Real; LANES]; 3],
}

impl HullPair<'_> {
    /// Contacts, in the frame of polyhedron 1.
    pub(crate) fn collide(&self, cache: &mut PairCache, manifold: &mut Manifold) {
        manifold.clear();
        let m = self.pose.rotation.to_mat3();
        let inverse = m.transpose();
        let t = self.pose.position;
        let mut view1 = View::new(&self.polyhedron1, &self.polyhedron2, m, t);
        let mut view2 = View::new(&self.polyhedron2, &self.polyhedron1, inverse, -(inverse * t));
        if self.cached_gap(cache.words[0], &view1, &view2) > self.margin {
            return;
        }
        let size = min(self.polyhedron1.size, self.polyhedron2.size);
        view1.measure_heights();
        view2.measure_heights();
        let face = self.best_face(&view1, &view2, size);
        cache.words[0] = face.code;
        if face.gap > self.margin {
            return;
        }
        let edges = self.best_edges(&view1, &view2, face.gap + EDGE_GAIN * size);
        if let Some(edges) = edges {
            cache.words[0] = edges.code;
            if edges.gap > self.margin {
                return;
            }
        }
        if edges.is_none_or(|edges| self.is_aligned(edges, face, &m)) {
            self.face_contact(face, (&view1, &view2), size, manifold);
        }
        if let Some(edges) = edges
            && !stands_in(manifold, edges.gap - EDGE_BIAS * size)
        {
            manifold.clear();
            self.edge_contact(edges, &m, manifold);
        }
        if manifold.points().is_empty() {
            self.passing_by(face, &view1, &view2, manifold);
        }
    }

    /// Clips the incident face of one hull against the reference face of the other.
    fn face_contact(&self, face: Axis, (view1, view2): (&View, &View), size: Real, manifold: &mut Manifold) {
        if face.code & EDGES == FACE1 {
            view1.face_contact(face.index(), (self.margin, size), manifold);
            return;
        }
        view2.face_contact(face.index(), (self.margin, size), manifold);
        // Found in the frame of hull 2 with the roles swapped.
        for p in manifold.points_mut() {
            p.point1 = view1.m * p.point2() + view1.t;
            p.normal = -(view1.m * p.normal);
            p.feature ^= 0x4000_0000;
        }
    }

    /// Whether the axis of a pair of edges is almost the normal of a face.
    fn is_aligned(&self, edges: Axis, face: Axis, m: &Mat3) -> bool {
        let normal = if face.code & EDGES == FACE1 {
            self.polyhedron1.planes[face.index()].normal
        } else {
            -(*m * self.polyhedron2.planes[face.index()].normal)
        };
        self.edge_gap(edges, m).is_some_and(|(_, axis)| axis.dot(normal) > ALIGNED)
    }

    /// Gap and normal of a pair of edges that makes a face of the Minkowski difference.
    fn edge_gap(&self, edges: Axis, m: &Mat3) -> Option<(Real, Vec3)> {
        let (e1, e2) = edges.edges();
        Edge::new(&self.polyhedron1, e1).gap(&Edge::new(&self.polyhedron2, e2).placed(m, self.pose.position))
    }

    /// The gap along the axis of the last step: above the margin only if the hulls are apart along it.
    fn cached_gap(&self, code: u32, view1: &View, view2: &View) -> Real {
        let axis = Axis { code, gap: 0.0 };
        let (index, (e1, e2)) = (axis.index(), axis.edges());
        match code & EDGES {
            FACE1 if index < self.polyhedron1.planes.len() => view1.face_gap(index),
            FACE2 if index < self.polyhedron2.planes.len() => view2.face_gap(index),
            EDGES if e1 < self.polyhedron1.edges.len() && e2 < self.polyhedron2.edges.len() => {
                self.edge_gap(axis, &view1.m).map_or(-Real::MAX, |(gap, _)| gap)
            }
            _ => -Real::MAX,
        }
    }

    /// The face to build the contact on, or one along which the hulls are apart by more than the margin.
    fn best_face(&self, view1: &View, view2: &View, size: Real) -> Axis {
        let (face, gap) = view1.best_face(-Real::MAX);
        let best = Axis { code: FACE1 | face as u32, gap };
        if gap > self.margin {
            return best;
        }
        let floor = gap + FACE_BIAS * size;
        let (face, gap) = view2.best_face(floor);
        if gap > floor { Axis { code: FACE2 | face as u32, gap } } else { best }
    }

    /// The edge pair with the largest gap, if that is above `floor`.
    fn best_edges(&self, view1: &View, view2: &View, floor: Real) -> Option<Axis> {
        let mut list1 = [0u16; MAX_EDGES];
        let mut list2 = [0u16; MAX_EDGES];
        let count1 = view1.promising_edges(floor, &mut list1);
        let count2 = view2.promising_edges(floor, &mut list2);
        let m = self.pose.rotation.to_mat3();
        let mut best = Axis { code: 0, gap: floor };
        for indices in list2[..count2].chunks(BATCH) {
            let mut groups = [EdgeGroup::default(); BATCH / LANES];
            for (group, indices) in groups.iter_mut().zip(indices.chunks(LANES)) {
                group.fill(&self.polyhedron2, indices, &m);
            }
            for &index in &list1[..count1] {
                let edge1 = Edge::new(&self.polyhedron1, index as usize);
                for group in &groups[..indices.len().div_ceil(LANES)] {
                    group.for_each_crossing(&edge1, |index2| {
                        let edge2 = Edge::new(&self.polyhedron2, index2 as usize).placed(&m, self.pose.position);
                        if let Some((gap, _)) = edge1.gap(&edge2)
                            && gap > best.gap
                        {
                            best = Axis { code: EDGES | u32::from(index) << 15 | u32::from(index2), gap };
                        }
                    });
                }
            }
        }
        (best.code != 0).then_some(best)
    }

    /// Closest points of the two edges; nothing if the hulls are apart and the edges are closest beyond their ends.
    fn edge_contact(&self, edges: Axis, m: &Mat3, manifold: &mut Manifold) {
        let (e1, e2) = edges.edges();
        let edge1 = Edge::new(&self.polyhedron1, e1);
        let edge2 = Edge::new(&self.polyhedron2, e2).placed(m, self.pose.position);
        let Some((separation, normal)) = edge1.gap(&edge2) else { return };
        let (d1, d2, w) = (edge1.along, edge2.along, edge2.start - edge1.start);
        let (a11, a12, a22) = (d1.dot(d1), d1.dot(d2), d2.dot(d2));
        let determinant = a11 * a22 - a12 * a12;
        let s = (w.dot(d1) * a22 - w.dot(d2) * a12) / determinant;
        let t = (w.dot(d1) * a12 - w.dot(d2) * a11) / determinant;
        if separation > 0.0 && !((0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t)) {
            return;
        }
        let point1 = edge1.start + d1 * clamp(s, 0.0, 1.0);
        let feature = 0x8000_0000 | edges.index() as u32;
        manifold.push(ManifoldPoint { point1, normal, separation, feature });
    }

    /// Hulls that pass each other with no corner over the other's face: the closest points, or the deepest corner.
    #[cold]
    fn passing_by(&self, axis: Axis, view1: &View, view2: &View, manifold: &mut Manifold) {
        let feature = 0x2000_0000;
        if let Some(c) = closest(&self.supports[0], &self.supports[1], &self.pose) {
            if c.distance <= self.margin {
                manifold.push(ManifoldPoint { point1: c.point1, normal: c.normal, separation: c.distance, feature });
            }
            return;
        }
        let index = axis.index();
        if axis.code & EDGES == FACE1 {
            let normal = self.polyhedron1.planes[index].normal;
            let point1 = view1.lowest_corner(normal) - normal * axis.gap;
            manifold.push(ManifoldPoint { point1, normal, separation: axis.gap, feature });
        } else {
            let normal2 = self.polyhedron2.planes[index].normal;
            let point1 = self.pose.transform_point(view2.lowest_corner(normal2));
            let normal = -self.pose.rotation.rotate(normal2);
            manifold.push(ManifoldPoint { point1, normal, separation: axis.gap, feature });
        }
    }
}

impl Edge {
    #[inline(always)]
    fn new(polyhedron: &Polyhedron, index: usize) -> Self {
        let (start, end) = polyhedron.edge_points(index);
        let normal = |e: HalfEdge| polyhedron.planes[e.face as usize].normal;
        Self {
            index: index as u16,
            start,
            along: end - start,
            left: normal(polyhedron.edges[index]),
            right: normal(polyhedron.edges[index ^ 1]),
        }
    }

    fn placed(&self, m: &Mat3, t: Vec3) -> Self {
        Self {
            index: self.index,
            start: *m * self.start + t,
            along: *m * self.along,
            left: *m * self.left,
            right: *m * self.right,
        }
    }

    /// Gap and normal of a pair of edges whose arcs cross; `self` is of hull 1.
    #[inline(always)]
    fn gap(&self, other: &Self) -> Option<(Real, Vec3)> {
        let (c, d) = (other.left.dot(self.along), other.right.dot(self.along));
        let (a, b) = (self.left.dot(other.along), self.right.dot(other.along));
        // One branch, as the three tests are hard to foretell each by itself.
        if !((c * d < 0.0) & (a * b < 0.0) & (c * b < 0.0)) {
            return None;
        }
        let cross = self.along.cross(other.along);
        let squared = cross.length_squared();
        if squared <= PARALLEL * self.along.length_squared() * other.along.length_squared() {
            return None;
        }
        let normal = normalize_or(cross, self.left);
        let normal = if normal.dot(self.left + self.right) < 0.0 { -normal } else { normal };
        Some((normal.dot(other.start - self.start), normal))
    }
}

impl EdgeGroup {
    /// Lanes past the last edge keep their zeros, which never cross.
    fn fill(&mut self, polyhedron: &Polyhedron, indices: &[u16], m: &Mat3) {
        for (k, &index) in indices.iter().enumerate() {
            let edge = Edge::new(polyhedron, index as usize);
            self.indices[k] = index;
            let lists = [&mut self.along, &mut self.left, &mut self.right];
            for (list, v) in lists.into_iter().zip([edge.along, edge.left, edge.right]) {
                let v = *m * v;
                (list[0][k], list[1][k], list[2][k]) = (v.x, v.y, v.z);
            }
        }
    }

    /// Calls back with each edge whose arc crosses that of `edge`.
    #[inline(always)]
    fn for_each_crossing(&self, edge: &Edge, mut found: impl FnMut(u16)) {
        let (c, d) = (dots(edge.along, &self.left), dots(edge.along, &self.right));
        let (a, b) = (dots(edge.left, &self.along), dots(edge.right, &self.along));
        let mut sign = [0.0; LANES];
        for k in 0..LANES {
            sign[k] = max(max(c[k] * d[k], a[k] * b[k]), c[k] * b[k]);
        }
        for (k, &sign) in sign.iter().enumerate() {
            if sign < 0.0 {
                found(self.indices[k]);
            }
        }
    }
}

/// `u · v` for each lane.
#[inline(always)]
fn dots(u: Vec3, v: &[[Real; LANES]; 3]) -> [Real; LANES] {
    let mut sum = [0.0; LANES];
    for k in 0..LANES {
        sum[k] = u.x * v[0][k] + u.y * v[1][k] + u.z * v[2][k];
    }
    sum
}

impl<'a> View<'a> {
    fn new(own: &'a Polyhedron<'a>, other: &'a Polyhedron<'a>, m: Mat3, t: Vec3) -> Self {
        Self { own, other, m, t, heights: [0.0; MAX_FACES] }
    }

    fn measure_heights(&mut self) {
        let center = self.m * self.other.center + self.t;
        for (height, plane) in self.heights.iter_mut().zip(self.own.planes) {
            *height = plane.normal.dot(center) - plane.offset;
        }
    }

    /// Height of the other hull over the plane of a face.
    fn face_gap(&self, face: usize) -> Real {
        let plane = self.own.planes[face];
        let n = plane.normal;
        let local = Vec3::new(self.m.x_axis.dot(n), self.m.y_axis.dot(n), self.m.z_axis.dot(n));
        lowest(self.other.vertices, local) + n.dot(self.t) - plane.offset
    }

    /// The first face with the largest gap; faces that cannot reach `floor` are not looked at.
    fn best_face(&self, floor: Real) -> (usize, Real) {
        let heights = &self.heights[..self.own.planes.len()];
        // The face that the other centre is highest above is most often the one: its gap prunes the others.
        let mut first = 0;
        for (face, &height) in heights.iter().enumerate() {
            if height > heights[first] {
                first = face;
            }
        }
        let radius = self.other.inner_radius * (1.0 - 1e-4);
        if heights[first] - radius < floor {
            return (first, -Real::MAX);
        }
        let (mut best, mut gap) = (first, self.face_gap(first));
        for (face, &height) in heights.iter().enumerate() {
            if face == first || height - radius < max(gap, floor) {
                continue;
            }
            let g = self.face_gap(face);
            if g > gap || (g == gap && face < best) {
                (best, gap) = (face, g);
            }
        }
        (best, gap)
    }

    /// Lists the edges (one half of each) that can have a gap above `floor`.
    fn promising_edges(&self, floor: Real, list: &mut [u16; MAX_EDGES]) -> usize {
        let limit = floor + self.other.inner_radius * (1.0 - 1e-4);
        let planes = self.own.planes;
        let mut count = 0;
        for (pair, twins) in self.own.edges.as_chunks::<2>().0.iter().enumerate() {
            // The start of the edge is on both planes, so `n · (m − v)` is the height over the plane.
            let [left, right] = twins.map(|e| e.face as usize);
            let highest = max(self.heights[left], self.heights[right]);
            // `highest / cos(half the arc) < limit`, with `cos² = (1 + left · right) / 2`, both sides positive.
            let cosine_squared = 0.5 * (1.0 + planes[left].normal.dot(planes[right].normal));
            let rises = (highest > 0.0) & (highest * highest >= limit * limit * cosine_squared);
            // Written always, counted if it may matter: whether it does is hard to foretell. There is room for all
            // edges.
            list[count.min(MAX_EDGES - 1)] = 2 * pair as u16;
            count += ((highest >= limit) | rises) as usize;
        }
        count.min(MAX_EDGES)
    }

    /// The first corner of the other hull that lies lowest along `normal`, in the own frame.
    fn lowest_corner(&self, normal: Vec3) -> Vec3 {
        let mut best = self.m * self.other.vertices[0] + self.t;
        for &vertex in &self.other.vertices[1..] {
            let p = self.m * vertex + self.t;
            if p.dot(normal) < best.dot(normal) {
                best = p;
            }
        }
        best
    }

    /// Clips the incident face against the reference face; the manifold is in the own frame.
    fn face_contact(&self, face: usize, reach: (Real, Real), manifold: &mut Manifold) {
        let incident = self.incident_face(self.own.planes[face].normal);
        let corners = self.own.face_loop(face).count() + self.other.face_loop(incident).count();
        // Each plane adds at most one corner. Large faces are rare: only they pay for clearing large buffers.
        if corners <= 24 {
            self.clip_faces::<24>(face, incident, reach, manifold);
        } else {
            self.clip_faces::<512>(face, incident, reach, manifold);
        }
    }

    /// Of the faces around the other hull's lowest corner, the one that looks most against `normal`.
    ///
    /// Among all faces it would be the wrong one where two faces meet almost flat: the one that looks straighter down may
    /// end at the edge between them, with the deepest corner on the other one.
    fn incident_face(&self, normal: Vec3) -> usize {
        let n = Vec3::new(self.m.x_axis.dot(normal), self.m.y_axis.dot(normal), self.m.z_axis.dot(normal));
        let mut lowest = 0;
        let mut height = self.other.vertices[0].dot(n);
        for (vertex, position) in self.other.vertices.iter().enumerate().skip(1) {
            let h = position.dot(n);
            if h < height {
                (lowest, height) = (vertex, h);
            }
        }
        let mut best = 0;
        let mut cosine = Real::MAX;
        for edge in self.other.edges.iter().filter(|edge| edge.origin as usize == lowest) {
            let c = self.other.planes[edge.face as usize].normal.dot(n);
            // Clearly more, so that of two faces at the same angle the first one stays.
            if c < cosine - 1e-3 {
                (best, cosine) = (edge.face as usize, c);
            }
        }
        best
    }

    fn clip_faces<const N: usize>(
        &self,
        face: usize,
        incident: usize,
        (margin, size): (Real, Real),
        manifold: &mut Manifold,
    ) {
        let plane = self.own.planes[face];
        let (mut front, mut back) = ([ClipPoint::default(); N], [ClipPoint::default(); N]);
        let mut count = 0;
        for edge in self.other.face_loop(incident) {
            let position = self.m * self.other.vertices[self.other.edges[edge].origin as usize] + self.t;
            let separation = plane.normal.dot(position) - plane.offset;
            front[count] = ClipPoint { position, separation, feature: (edge as u32 + 1) << 12 };
            count += 1;
        }
        for (cut, edge) in self.own.face_loop(face).enumerate() {
            let (out, offset) = self.own.side_plane(edge, plane.normal);
            count = clip_polygon(&front[..count], (out, offset + GROWTH * size), cut as u32, &mut back);
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

/// The lowest value of `direction · v` over the corners.
fn lowest(vertices: &[Vec3], direction: Vec3) -> Real {
    // Four running minima, as one would wait for itself at each corner.
    let mut running = [Real::MAX; 4];
    let chunks = vertices.chunks_exact(4);
    for (k, &v) in chunks.remainder().iter().enumerate() {
        running[k] = direction.dot(v);
    }
    for chunk in chunks {
        for k in 0..4 {
            running[k] = min(direction.dot(chunk[k]), running[k]);
        }
    }
    min(min(running[0], running[1]), min(running[2], running[3]))
}
