//! One triangle of a mesh against a sphere or a capsule, and the normals that a triangle may push along.
//!
//! All is in the frame of the convex shape, whose centre is near the origin: large meshes lose no precision.
//!
//! A triangle may push along its face normal where the shape is above its face; along other normals only from an edge or a
//! corner where the whole surface has a summit in that direction (see `mesh_edges`). A sphere on a seam therefore touches
//! the face beside it, with the plane's own distance, and never the edge: seams inside a surface are not felt.

use super::mesh_points::{Candidate, Candidates, NO_FACET, ROLLING};
use super::triangle_lanes::{Near, Planes};
use crate::math::{Aabb, Mat3, Real, Vec3, abs3, clamp, max, max3, min, min3};
use crate::shape::{Capsule, Facet, LEAF as LANES, Sphere, Surface, Surroundings};
use crate::simd::Lanes;

/// Sine by which a normal may leave the range that an edge or a corner allows: rounding, not geometry.
const ALLOWED_SINE: Real = 2e-3;
/// A sphere counts as above a face up to this sine beyond its edges: seams flatter than that have no normals of their own.
const SEAM_SINE: Real = 2e-3;

/// Corners visited at most to learn whether a surface goes on.
const MOST_CLIMBS: usize = 256;

/// Where the convex shape is.
pub(super) struct Frame {
    /// From the shape's frame to the mesh's.
    pub(super) rotation: Mat3,
    /// From the mesh's frame to the shape's.
    pub(super) inverse: Mat3,
    pub(super) position: Vec3,
    /// As in [`Reach`].
    pub(super) scale: Real,
}

/// How close is close.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reach {
    /// Gaps up to this give points, metres.
    pub(super) margin: Real,
    /// Length that tolerances are relative to: the margin, but no more than the shape's inner radius.
    pub(super) scale: Real,
    /// Only overlaps give points: the second look at triangles that were left out (see `mesh`).
    pub(super) second_look: bool,
}

/// A triangle in the frame of the convex shape.
pub(super) struct Triangle<'a> {
    pub(super) mesh: Surface<'a>,
    pub(super) frame: &'a Frame,
    pub(super) around: Surroundings,
    pub(super) index: u32,
    pub(super) corners: [Vec3; 3],
    /// Unit normal on the side of the shape's centre.
    pub(super) normal: Vec3,
    /// Unit normal on the front.
    pub(super) front: Vec3,
    /// Of the plane: `normal · x = offset`. Computed in the mesh's axes, where a large triangle's corners are not rounded
    /// by turning them.
    offset: Real,
    /// Unit vectors in the plane from each edge inwards.
    pub(super) inward: [Vec3; 3],
    /// How far the edges are let out, so that a point exactly on a seam belongs to both triangles.
    pub(super) slack: Real,
}

impl<'a> Triangle<'a> {
    /// The triangle as seen from its front (`side` 1) or back (−1).
    #[inline]
    pub(super) fn new(mesh: Surface<'a>, frame: &'a Frame, index: u32, side: Real) -> Self {
        Self::of(mesh, frame, &mesh.facet(index as usize), (index, side))
    }

    /// As [`Triangle::new`], for those who have its corners at hand.
    #[inline]
    pub(super) fn of(mesh: Surface<'a>, frame: &'a Frame, facet: &Facet, (index, side): (u32, Real)) -> Self {
        let [a, b, c] = facet.corners();
        let first = a - frame.position;
        let corners =
            [frame.inverse * first, frame.inverse * (b - frame.position), frame.inverse * (c - frame.position)];
        let [a, b, c] = corners;
        let (low, high) = (min3(a, min3(b, c)), max3(a, max3(b, c)));
        let front = frame.inverse * facet.normal();
        let inward = |along: Vec3| {
            let across = front.cross(along);
            across * (1.0 / across.length())
        };
        let extent = max3(abs3(low), abs3(high));
        let size = max(extent.x, max(extent.y, extent.z));
        Self {
            mesh,
            frame,
            around: mesh.surroundings(index as usize),
            index,
            corners,
            normal: front * side,
            front,
            offset: facet.normal().dot(first) * side,
            inward: [inward(b - a), inward(c - b), inward(a - c)],
            slack: 1e-3 * frame.scale + 2e-7 * size,
        }
    }

    /// Height of a point above the plane.
    #[inline(always)]
    pub(super) fn height(&self, point: Vec3) -> Real {
        self.normal.dot(point) - self.offset
    }

    /// Ends of edge `i`.
    #[inline(always)]
    pub(super) fn edge(&self, i: usize) -> (Vec3, Vec3) {
        (self.corners[i], self.corners[(i + 1) % 3])
    }

    /// The edge that is longest, the first of several.
    pub(super) fn longest_edge(&self) -> usize {
        let squared = |i: usize| (self.corners[(i + 1) % 3] - self.corners[i]).length_squared();
        let (ab, bc, ca) = (squared(0), squared(1), squared(2));
        if ca > max(ab, bc) { 2 } else { usize::from(bc > ab) }
    }

    /// Whether the surface goes on flat across an edge that cut something off: the neighbour has the rest, so where it
    /// was cut is no end of the contact.
    #[inline(always)]
    pub(super) fn is_seam(&self, cut: u32) -> bool {
        self.around.edge_is_flat(cut as usize)
    }

    /// Whether no edge and no corner can touch, only the face.
    #[inline(always)]
    pub(super) fn is_plain(&self) -> bool {
        self.around.is_plain()
    }

    #[inline(always)]
    pub(super) fn edge_is_sharp(&self, i: usize) -> bool {
        self.around.edge_is_sharp(i)
    }

    /// Whether the surface has a summit along `normal` at edge `i`, for a normal at a right angle to the edge.
    pub(super) fn edge_allows(&self, i: usize, normal: Vec3) -> bool {
        self.edge_is_sharp(i)
            && self.inward[i].dot(normal) <= ALLOWED_SINE
            && self.normal.dot(normal) >= -ALLOWED_SINE
            && self.around.bend(i).across(self.front, self.inward[i]).dot(normal) <= ALLOWED_SINE
    }

    /// Whether the surface has a summit along `normal` at corner `i`.
    pub(super) fn corner_allows(&self, i: usize, normal: Vec3) -> bool {
        if !self.around.corner_is_sharp(i) || self.normal.dot(normal) < -ALLOWED_SINE {
            return false;
        }
        let falls = |along: Vec3| along.dot(normal) <= ALLOWED_SINE * along.length();
        // Its own edges tell most of those that are not allowed.
        if !falls(self.corners[(i + 1) % 3] - self.corners[i]) || !falls(self.corners[(i + 2) % 3] - self.corners[i]) {
            return false;
        }
        let normal = self.frame.rotation * normal;
        let corner = self.mesh.corners(self.index as usize)[i];
        let mut allowed = true;
        self.mesh.each_end(corner, |end| {
            let along = end - corner;
            allowed = along.dot(normal) <= ALLOWED_SINE * along.length();
            allowed
        });
        allowed
    }

    /// Whether the surface goes on from corner `i` by `distance` along `normal` before it has fallen by `fall` under the
    /// plane of this triangle: steepest climb from corner to corner.
    pub(super) fn goes_on(&self, i: usize, normal: Vec3, distance: Real, fall: Real) -> bool {
        let (along, up) = (self.frame.rotation * normal, self.frame.rotation * self.normal);
        let start = self.mesh.corners(self.index as usize)[i];
        let mut corner = start;
        let mut reached = 0.0;
        for _ in 0..MOST_CLIMBS {
            let mut next = None;
            self.mesh.each_end(corner, |end| {
                let step = end - start;
                if step.dot(along) > reached && step.dot(up) >= -fall {
                    (reached, next) = (step.dot(along), Some(end));
                }
                true
            });
            let Some(end) = next else { return false };
            if reached >= distance {
                return true;
            }
            corner = end;
        }
        // So finely cut that it went on for hundreds of edges: it is no rim.
        true
    }

    /// How far inside each of its three sides a point is.
    #[inline(always)]
    pub(super) fn insides(&self, point: Vec3) -> [Real; 3] {
        // Spelled out: `array::map` is not inlined here, at a cost of a tenth of the whole.
        let inside = |i: usize| self.inward[i].dot(point - self.corners[i]) + self.slack;
        [inside(0), inside(1), inside(2)]
    }

    /// The part of a segment above the face, given how far inside the sides its ends are: two numbers in `[0, 1]`, and
    /// which sides cut it off (3 for none); `None` if no part is.
    #[inline(always)]
    pub(super) fn clip(start: &[Real; 3], end: &[Real; 3]) -> Option<([Real; 2], [u32; 2])> {
        let (mut ends, mut cuts) = ([0.0, 1.0], [3, 3]);
        for (i, (&da, &db)) in start.iter().zip(end).enumerate() {
            if da < 0.0 && db < 0.0 {
                return None;
            }
            if da < 0.0 && da / (da - db) > ends[0] {
                (ends[0], cuts[0]) = (da / (da - db), i as u32);
            } else if db < 0.0 && da / (da - db) < ends[1] {
                (ends[1], cuts[1]) = (da / (da - db), i as u32);
            }
        }
        (ends[0] <= ends[1]).then_some((ends, cuts))
    }

    /// A point below `above` on the plane, pushed along the face normal.
    pub(super) fn face_candidate(&self, above: Vec3, height: Real, radius: Real, feature: u32) -> Candidate {
        Candidate {
            position: above - self.normal * height,
            normal: self.normal,
            separation: height - radius,
            feature: feature_id(self.around.patch, feature),
            facet: self.index,
            triangle: self.index,
        }
    }

    /// A point on an edge or a corner.
    pub(super) fn rim_candidate(&self, position: Vec3, normal: Vec3, separation: Real, feature: u32) -> Candidate {
        let feature = feature_id(self.around.id, feature);
        Candidate { position, normal, separation, feature, facet: NO_FACET, triangle: self.index }
    }

    /// The same of what is round there.
    pub(super) fn rolling_candidate(&self, position: Vec3, normal: Vec3, separation: Real, feature: u32) -> Candidate {
        Candidate { facet: ROLLING, ..self.rim_candidate(position, normal, separation, feature) }
    }
}

/// One number for a triangle (or patch) and what touches it.
pub(super) fn feature_id(triangle: u32, feature: u32) -> u32 {
    let mixed = (triangle ^ 0x5bd1_e995).wrapping_mul(0x9e37_79b1).rotate_left(15) ^ feature.wrapping_mul(0x85eb_ca6b);
    (mixed ^ mixed >> 15).wrapping_mul(0x2c1b_3c6d)
}

/// Up to eight triangles, to be looked at together.
#[derive(Default)]
pub(super) struct Group {
    pub(super) indices: [u32; LANES],
    /// From which side of each triangle the shape comes: 1 or −1.
    pub(super) sides: [Real; LANES],
    pub(super) count: usize,
}

impl Group {
    /// Adds a triangle; true when there is no room for another.
    #[inline(always)]
    pub(super) fn push(&mut self, index: u32, side: Real) -> bool {
        (self.indices[self.count], self.sides[self.count]) = (index, side);
        self.count += 1;
        self.count == LANES
    }

    /// Visits the triangles one by one, and is empty then. Returns whether any visit returned true.
    #[inline(always)]
    pub(super) fn drain(&mut self, mesh: Surface<'_>, frame: &Frame, mut visit: impl FnMut(&Triangle) -> bool) -> bool {
        let mut any = false;
        for k in 0..std::mem::take(&mut self.count) {
            any |= visit(&Triangle::new(mesh, frame, self.indices[k], self.sides[k]));
        }
        any
    }
}

/// A convex shape that can be held against triangles one by one.
pub(super) trait Solid {
    /// A point inside, in the shape's frame.
    fn center(&self) -> Vec3;
    /// Radius of a ball about the centre inside the shape.
    fn inner_radius(&self) -> Real;
    /// The box around the shape in its frame.
    fn bounds(&self) -> Aabb;
    /// Makes ready for [`Solid::keep_reached`].
    fn place(&mut self, _frame: &Frame) {}
    /// Zero where a triangle is farther than the margin, as far as can be told at a small cost.
    fn keep_reached<W: Lanes<LANES>>(&self, near: &Near, sides: W, planes: &Planes<W>) -> W;
    /// Adds the points of the triangles of a group, which is empty after it, or keeps some for [`Solid::finish`]. Returns
    /// whether one might overlap the shape but gave no point, because it is the neighbours' matter: if they give none
    /// either, it is looked at again.
    fn touch_group(
        &mut self,
        mesh: Surface<'_>,
        frame: &Frame,
        group: &mut Group,
        reach: &Reach,
        out: &mut Candidates,
    ) -> bool;
    /// Adds the points of triangles that were kept; returns as [`Solid::touch_group`].
    fn finish(&mut self, _mesh: Surface<'_>, _frame: &Frame, _reach: &Reach, _out: &mut Candidates) -> bool {
        false
    }
}

/// A ball, or a ball moved along a segment: held against one triangle after the other.
trait Round {
    /// Of the ball.
    fn radius(&self) -> Real;
    /// The box around the shape in its frame.
    fn bounds(&self) -> Aabb;
    /// Zero where the lowest point of the shape is too far above a triangle's plane.
    fn keep_low<W: Lanes<LANES>>(&self, frame: &Frame, sides: W, planes: &Planes<W>) -> W;
    /// Adds the points of one triangle; returns as [`Solid::touch_group`].
    fn touch(&self, triangle: &Triangle, reach: &Reach, out: &mut Candidates) -> bool;
}

impl<R: Round> Solid for R {
    fn center(&self) -> Vec3 {
        Vec3::ZERO
    }

    fn inner_radius(&self) -> Real {
        self.radius()
    }

    fn bounds(&self) -> Aabb {
        Round::bounds(self)
    }

    #[inline(always)]
    fn keep_reached<W: Lanes<LANES>>(&self, near: &Near, sides: W, planes: &Planes<W>) -> W {
        near.keep_in_box(self.keep_low(near.frame, sides, planes), planes)
    }

    fn touch_group(
        &mut self,
        mesh: Surface<'_>,
        frame: &Frame,
        group: &mut Group,
        reach: &Reach,
        out: &mut Candidates,
    ) -> bool {
        group.drain(mesh, frame, |triangle| self.touch(triangle, reach, out))
    }
}

impl Round for Sphere {
    fn radius(&self) -> Real {
        Self::radius(self)
    }

    fn bounds(&self) -> Aabb {
        self.local_aabb()
    }

    #[inline(always)]
    fn keep_low<W: Lanes<LANES>>(&self, _frame: &Frame, sides: W, planes: &Planes<W>) -> W {
        planes.keep_low(sides, &[Vec3::ZERO], self.radius())
    }

    #[inline(always)]
    fn touch(&self, triangle: &Triangle, reach: &Reach, out: &mut Candidates) -> bool {
        touch_sphere(self, triangle, reach, out)
    }
}

/// The face if the centre is above it, else the nearest edge or corner if that is a summit.
#[inline]
fn touch_sphere(sphere: &Sphere, triangle: &Triangle, reach: &Reach, out: &mut Candidates) -> bool {
    let height = triangle.height(Vec3::ZERO);
    if height - sphere.radius() > reach.margin {
        return false;
    }
    let slack = SEAM_SINE * height.abs() + triangle.slack;
    let inside = |i: usize| triangle.inward[i].dot(triangle.corners[i]) <= slack;
    if inside(0) && inside(1) && inside(2) {
        out.push(triangle.face_candidate(Vec3::ZERO, height, sphere.radius(), 0));
        return false;
    }
    if triangle.is_plain() && !reach.second_look {
        return height < sphere.radius();
    }
    let mut nearest = (Real::MAX, 0, 0.0, Vec3::ZERO);
    for i in 0..3 {
        let (a, b) = triangle.edge(i);
        let edge = b - a;
        let t = clamp(-a.dot(edge) / edge.length_squared(), 0.0, 1.0);
        let point = a + edge * t;
        if point.length_squared() < nearest.0 {
            nearest = (point.length_squared(), i, t, point);
        }
    }
    let (squared, i, t, point) = nearest;
    let distance = squared.sqrt();
    if distance - sphere.radius() > reach.margin || distance < 1e-6 * sphere.radius() {
        return distance < sphere.radius();
    }
    let normal = point * (-1.0 / distance);
    if rim_allows(triangle, i, t, normal) {
        out.push(triangle.rim_candidate(point, normal, distance - sphere.radius(), i as u32));
        return false;
    }
    // The neighbours have a nearer point. If rounding lost it between them, or the neighbour is another shape, the face takes
    // it: right under the centre, for the normal of a ball goes through it (else a ball that rolls would be thrown up).
    if reach.second_look && distance < sphere.radius() {
        out.push(triangle.face_candidate(Vec3::ZERO, height, sphere.radius(), 0));
    }
    distance < sphere.radius()
}

/// Whether the point at `t` of edge `i` may push along `normal`.
#[inline]
fn rim_allows(triangle: &Triangle, i: usize, t: Real, normal: Vec3) -> bool {
    if t <= 0.0 {
        triangle.corner_allows(i, normal)
    } else if t >= 1.0 {
        triangle.corner_allows((i + 1) % 3, normal)
    } else {
        triangle.edge_allows(i, normal)
    }
}

impl Round for Capsule {
    fn radius(&self) -> Real {
        Self::radius(self)
    }

    fn bounds(&self) -> Aabb {
        self.local_aabb()
    }

    #[inline(always)]
    fn keep_low<W: Lanes<LANES>>(&self, frame: &Frame, sides: W, planes: &Planes<W>) -> W {
        let end = frame.rotation.y_axis * self.half_length();
        planes.keep_low(sides, &[-end, end], self.radius())
    }

    #[inline(always)]
    fn touch(&self, triangle: &Triangle, reach: &Reach, out: &mut Candidates) -> bool {
        touch_capsule(self, triangle, reach, out)
    }
}

/// The ends of the part of the segment above the face, and the nearest points of the edges that are summits there.
#[inline]
fn touch_capsule(capsule: &Capsule, triangle: &Triangle, reach: &Reach, out: &mut Candidates) -> bool {
    let end = Vec3::new(0.0, capsule.half_length(), 0.0);
    let (low, high) = (triangle.height(-end), triangle.height(end));
    let lowest = min(low, high);
    if lowest - capsule.radius() > reach.margin {
        return false;
    }
    let mut missing = lowest < capsule.radius();
    if let Some((ends, cuts)) = Triangle::clip(&triangle.insides(-end), &triangle.insides(end)) {
        let heights = ends.map(|t| low + (high - low) * t);
        // A segment that runs under the triangle without crossing it counts only while the capsule still reaches up
        // through the plane.
        let crosses = max(heights[0], heights[1]) >= -capsule.radius();
        let count = if ends[1] - ends[0] > 1e-6 { 2 } else { 1 };
        for k in 0..count {
            if crosses
                && heights[k] - capsule.radius() <= reach.margin
                && (reach.second_look || !triangle.is_seam(cuts[k]))
            {
                let cut = 2 + (triangle.around.id << 3 | cuts[k] << 1 | k as u32);
                let feature = if cuts[k] == 3 { k as u32 } else { cut };
                let point = end * (2.0 * ends[k] - 1.0);
                out.push(triangle.face_candidate(point, heights[k], capsule.radius(), feature));
                missing = false;
            }
        }
    }
    for i in 0..3 {
        if triangle.edge_is_sharp(i) || triangle.around.corner_is_sharp(i) {
            missing &= !capsule.touch_edge(triangle, i, reach, out);
        }
    }
    if missing && reach.second_look {
        capsule.touch_anyway(triangle, out);
    }
    missing
}

impl Capsule {
    /// The overlap that no face and no summit explains, as a push along the face.
    fn touch_anyway(&self, triangle: &Triangle, out: &mut Candidates) {
        let end = Vec3::new(0.0, self.half_length(), 0.0);
        for i in 0..3 {
            let pair = SegmentPair::nearest(triangle.edge(i), (-end, end));
            if (pair.on_second - pair.on_first).length() < self.radius() {
                let height = triangle.height(pair.on_second);
                out.push(triangle.face_candidate(pair.on_second, height, self.radius(), 8 + i as u32));
            }
        }
    }

    /// The point or two nearest to edge `i`; whether there are any.
    #[inline]
    fn touch_edge(&self, triangle: &Triangle, i: usize, reach: &Reach, out: &mut Candidates) -> bool {
        let (a, b) = triangle.edge(i);
        let end = Vec3::new(0.0, self.half_length(), 0.0);
        let pair = SegmentPair::nearest((a, b), (-end, end));
        let gap = pair.on_second - pair.on_first;
        let distance = gap.length();
        if distance - self.radius() > reach.margin || distance < 1e-6 * self.radius() {
            return false;
        }
        let normal = gap * (1.0 / distance);
        if !rim_allows(triangle, i, pair.t, normal) {
            return false;
        }
        let feature = 64 + 8 * i as u32;
        if let Some(ends) = parallel_part((a, b), (-end, end)) {
            for (k, (on_edge, on_axis)) in ends.into_iter().enumerate() {
                let separation = normal.dot(on_axis - on_edge) - self.radius();
                if separation <= reach.margin {
                    out.push(triangle.rolling_candidate(on_edge, normal, separation, feature + 1 + k as u32));
                }
            }
        } else {
            out.push(triangle.rolling_candidate(pair.on_first, normal, distance - self.radius(), feature));
        }
        true
    }
}

/// The nearest points of two segments.
pub(super) struct SegmentPair {
    pub(super) on_first: Vec3,
    pub(super) on_second: Vec3,
    /// Position on the first segment, 0 to 1.
    pub(super) t: Real,
}

impl SegmentPair {
    /// Source: Ericson, "Real-Time Collision Detection", 2005, section 5.1.9.
    #[inline]
    pub(super) fn nearest(first: (Vec3, Vec3), second: (Vec3, Vec3)) -> Self {
        let (d1, d2, r) = (first.1 - first.0, second.1 - second.0, first.0 - second.0);
        let (a, e, b) = (d1.length_squared(), d2.length_squared(), d1.dot(d2));
        let (c, f) = (d1.dot(r), d2.dot(r));
        let determinant = a * e - b * b;
        // (Almost) parallel: any point of the first serves as a start, the clamping below finds its partner.
        let mut t = if determinant > 1e-6 * a * e { clamp((b * f - c * e) / determinant, 0.0, 1.0) } else { 0.5 };
        let mut s = (b * t + f) / e;
        if !(0.0..=1.0).contains(&s) {
            s = clamp(s, 0.0, 1.0);
            t = clamp((b * s - c) / a, 0.0, 1.0);
        }
        Self { on_first: first.0 + d1 * t, on_second: second.0 + d2 * s, t }
    }
}

/// The ends of the stretch along which two almost parallel segments run side by side, as points of the first and the
/// second; `None` if they are not parallel (within 3°) or do not run side by side.
pub(super) fn parallel_part(first: (Vec3, Vec3), second: (Vec3, Vec3)) -> Option<[(Vec3, Vec3); 2]> {
    let (d1, d2) = (first.1 - first.0, second.1 - second.0);
    let (a, b) = (d1.length_squared(), d1.dot(d2));
    if d1.cross(d2).length_squared() > 0.0025 * a * d2.length_squared() {
        return None;
    }
    let (t0, t1) = (d1.dot(second.0 - first.0) / a, d1.dot(second.1 - first.0) / a);
    let (low, high) = if t0 < t1 { (t0, t1) } else { (t1, t0) };
    let ts = [max(0.0, low), min(1.0, high)];
    if ts[1] - ts[0] <= 1e-3 {
        return None;
    }
    Some(ts.map(|t| {
        let s = clamp((t - t0) * a / b, 0.0, 1.0);
        (first.0 + d1 * t, second.0 + d2 * s)
    }))
}
