//! One triangle of a mesh against a cuboid or a convex hull.
//!
//! Separating axes: the face of the triangle, the faces of the solid, and pairs of edges. For a pair of edges the axis is
//! not taken from their cross product: where the two faces at an edge of the solid, with normals `a` and `b`, lie on either
//! side of the direction `e` of the triangle's edge, the outward normal of that edge square to `e` is `m = a |b·e| + b |a·e|`,
//! and `−m` separates the two if it looks out of the triangle. Source of the arc test: Gregorius, "The Separating Axis
//! Test between Convex Polyhedra", 2013.
//!
//! The axis of least overlap decides who deals with the contact. The face of the triangle: the solid's lowest face is
//! clipped to the prism over the triangle. Another axis: if the surface has a summit along it there (see `mesh_edges`),
//! that edge or corner makes the contact. If not, a neighbour reaches further along the axis. Where the surface goes on so
//! far that the way out along the face is shorter, the face pushes; else the axis leads over a rim, and the contact is the
//! neighbour's. Triangles without sharp edges, which are most, skip all this while the overlap is shallow.

use super::mesh_points::{Candidate, Candidates};
use super::triangle::{Frame, Group, Reach, Solid, Triangle, feature_id, parallel_part};
#[cfg(test)]
use super::triangle_lanes::BACKWARD;
use super::triangle_lanes::{EdgeSearch, FaceSearch, Near, Overlaps, Planes, Search};
use crate::math::{Aabb, Real, Vec3, clamp, max, max3, min, min3};
use crate::shape::polyhedron::Polyhedron;
use crate::shape::{Facet, LEAF as LANES, Surface};
use crate::simd::{LaneVec3, Lanes};

/// An edge, or the face, of a triangle lies level with its highest corner below this sine.
const LEVEL_SINE: Real = 0.02;

/// Overlaps up to this share of the solid's inner radius are shallow: inside a smooth surface its face alone pushes. Deeper
/// ones may come from the side (a box past the rim of a finely cut block), so all axes are tried.
const SHALLOW: Real = 0.5;

/// A face of the solid lies along the triangle, or an edge of the triangle along a face, below this sine (3°): what of it
/// is farther than that leans out of reach is no longer held.
const FLAT_SINE: Real = 0.05;

/// Points of a face that lies along the triangle count although another axis overlaps less, unless they are deeper than
/// the overlap by this share of the scale.
const EXTRA_DEPTH: Real = 0.25;

/// The triangle's face wins unless another axis is better by more than rounding and rocking can make it: this share of
/// the scale.
const BIAS: Real = 0.02;

/// A cuboid or a hull with the box around it.
pub(super) struct Faceted<'a> {
    features: Polyhedron<'a>,
    bounds: Aabb,
    /// Between what planes it lies, in the axes of the mesh: all of its faces or the first of them.
    slabs: [Slab; MOST_SLABS],
    slab_count: usize,
    underside: Underside,
    pending: Pending,
}

/// The points with `low ≤ normal · x ≤ high`: two opposite faces, or one with nothing opposite.
#[derive(Clone, Copy)]
struct Slab {
    normal: Vec3,
    low: Real,
    high: Real,
}

/// Slabs against which triangles are tried as they come from the tree.
const MOST_SLABS: usize = 16;
/// Square of the angle up to which faces are opposite: what it moves a corner by is less than rounding is given.
const OPPOSITE: Real = 1e-12;

/// Triangles that have no gap along any face and whose edges are to be tried, eight at a time.
struct Pending {
    facets: [Facet; LANES],
    indices: [u32; LANES],
    sides: [Real; LANES],
    found: Overlaps,
    count: usize,
}

impl Pending {
    /// Adds triangle `k` of a group; true when there is no room for another.
    #[inline(always)]
    fn push(&mut self, facet: &Facet, group: &Group, found: &Overlaps, k: usize) -> bool {
        let place = self.count;
        (self.facets[place], self.indices[place], self.sides[place]) = (*facet, group.indices[k], group.sides[k]);
        self.found.take(place, found, k);
        self.count += 1;
        self.count == LANES
    }
}

/// What of the solid is lowest over a triangle.
#[derive(Clone, Copy)]
struct Underside {
    normal: Vec3,
    corner: usize,
    /// The face at that corner that lies flattest.
    face: usize,
    /// A ball around that face; the radius is negative while there is no face.
    center: Vec3,
    radius: Real,
}

/// The axis of least overlap.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Axis {
    Triangle,
    Face { face: usize },
    Edges { edge: usize, solid_edge: usize, normal: Vec3 },
}

impl<'a> Faceted<'a> {
    pub(super) fn new(features: Polyhedron<'a>) -> Self {
        let mut bounds = Aabb::EMPTY;
        for &vertex in features.vertices {
            bounds = Aabb::new(min3(bounds.min, vertex), max3(bounds.max, vertex));
        }
        let pending = Pending {
            facets: [Facet::NONE; LANES],
            indices: [0; LANES],
            sides: [0.0; LANES],
            found: Overlaps::default(),
            count: 0,
        };
        let slabs = [Slab { normal: Vec3::ZERO, low: 0.0, high: 0.0 }; MOST_SLABS];
        Self { features, bounds, slabs, slab_count: 0, underside: Underside::NONE, pending }
    }

    fn search<'b>(
        &'b self,
        frame: &'b Frame,
        facets: &'b [Facet; LANES],
        sides: [Real; LANES],
        reach: &Reach,
    ) -> Search<'b> {
        Search { solid: &self.features, frame, facets, sides, margin: reach.margin, bias: BIAS * reach.scale }
    }
}

impl Solid for Faceted<'_> {
    fn center(&self) -> Vec3 {
        self.features.center
    }

    fn inner_radius(&self) -> Real {
        self.features.inner_radius
    }

    fn bounds(&self) -> Aabb {
        self.bounds
    }

    fn place(&mut self, frame: &Frame) {
        self.slab_count = 0;
        for plane in self.features.planes {
            let normal = frame.rotation * plane.normal;
            let slabs = &mut self.slabs[..self.slab_count];
            if let Some(slab) = slabs.iter_mut().find(|slab| (slab.normal + normal).length_squared() < OPPOSITE) {
                slab.low = max(slab.low, -plane.offset);
            } else if self.slab_count < MOST_SLABS {
                self.slabs[self.slab_count] = Slab { normal, low: -Real::MAX, high: plane.offset };
                self.slab_count += 1;
            }
        }
    }

    #[inline(always)]
    fn keep_reached<W: Lanes<LANES>>(&self, near: &Near, sides: W, planes: &Planes<W>) -> W {
        let mut sides = sides;
        let [a, b, c] = &planes.corners;
        let gap = near.reach.margin + near.slack();
        for slab in &self.slabs[..self.slab_count] {
            let outward = LaneVec3::splat(slab.normal);
            let (a, b, c) = (outward.dot(a), outward.dot(b), outward.dot(c));
            sides = W::splat(slab.high + gap).if_at_least(a.min(b.min(c)), sides, W::ZERO);
            sides = a.max(b.max(c)).if_at_least(W::splat(slab.low - gap), sides, W::ZERO);
        }
        sides
    }

    fn touch_group(
        &mut self,
        mesh: Surface<'_>,
        frame: &Frame,
        group: &mut Group,
        reach: &Reach,
        out: &mut Candidates,
    ) -> bool {
        let count = std::mem::take(&mut group.count);
        if count == 0 {
            return false;
        }
        let (mut facets, mut wanted, mut sharp) = ([Facet::NONE; LANES], [0.0; LANES], [0.0; LANES]);
        for (k, &index) in group.indices[..count].iter().enumerate() {
            let index = index as usize;
            facets[k] = mesh.facet(index);
            wanted[k] = 1.0;
            sharp[k] = if mesh.surroundings(index).is_plain() { 0.0 } else { 1.0 };
        }
        let search = self.search(frame, &facets, group.sides, reach);
        let shallow = if reach.second_look { -Real::MAX } else { SHALLOW * self.features.inner_radius };
        let found = FaceSearch { search, wanted, sharp, shallow }.find();
        let mut missing = false;
        for (k, facet) in facets[..count].iter().enumerate() {
            if found.near[k] > 0.0 && self.pending.push(facet, group, &found, k) {
                missing |= self.finish(mesh, frame, reach, out);
            }
        }
        missing
    }

    fn finish(&mut self, mesh: Surface<'_>, frame: &Frame, reach: &Reach, out: &mut Candidates) -> bool {
        let count = std::mem::take(&mut self.pending.count);
        let mut found = self.pending.found;
        found.open[count..].fill(0.0);
        if found.open != [0.0; LANES] {
            let search = self.search(frame, &self.pending.facets, self.pending.sides, reach);
            EdgeSearch { search, found: &mut found }.find();
        }
        let mut missing = false;
        for k in 0..count {
            if found.near[k] > 0.0 {
                let place = (self.pending.indices[k], self.pending.sides[k]);
                let triangle = Triangle::of(mesh, frame, &self.pending.facets[k], place);
                self.underside.turn_to(&self.features, triangle.normal, found.corner[k] as usize);
                let height = found.height[k];
                let pair =
                    Pair { solid: &self.features, triangle: &triangle, reach, underside: &self.underside, height };
                missing |= pair.touch(found.axis[k] as usize, found.separation[k], out);
            }
        }
        missing
    }
}

impl Underside {
    const NONE: Self = Self { normal: Vec3::ZERO, corner: 0, face: 0, center: Vec3::ZERO, radius: -1.0 };

    /// Makes it that over a plane with this normal, given the corner that is lowest there.
    fn turn_to(&mut self, solid: &Polyhedron, normal: Vec3, corner: usize) {
        if self.normal == normal && self.radius >= 0.0 {
            return;
        }
        let mut flattest = (0, Real::MAX);
        for &face in solid.faces_around(corner) {
            let cosine = solid.planes[face as usize].normal.dot(normal);
            if cosine < flattest.1 {
                flattest = (face as usize, cosine);
            }
        }
        let face = flattest.0;
        (self.normal, self.corner) = (normal, corner);
        if self.face == face && self.radius >= 0.0 {
            return;
        }
        let corners = || solid.face_loop(face).map(|edge| solid.edge_points(edge).0);
        let center = Aabb::from_points(corners()).center();
        let squared = corners().fold(0.0, |m, corner| max(m, (corner - center).length_squared()));
        (self.face, self.center, self.radius) = (face, center, squared.sqrt());
    }
}

/// Which points of the solid's lowest face count.
struct FacePoints {
    /// Those at least so high over the triangle: deeper ones have a shorter way out.
    least: Real,
    /// Also those where a rim cuts the face's edges.
    rims: bool,
}

impl FacePoints {
    const ALL: Self = Self { least: -Real::MAX, rims: true };
}

/// A solid over a triangle.
struct Pair<'a> {
    solid: &'a Polyhedron<'a>,
    triangle: &'a Triangle<'a>,
    reach: &'a Reach,
    underside: &'a Underside,
    /// Of the solid's lowest corner over the triangle's plane.
    height: Real,
}

impl Pair<'_> {
    /// Whether the lowest corner is over the triangle, farther from each edge than deep. Then no axis is better than the
    /// face's: along one that leans by the angle θ the corner overlaps by at least `depth · (cos θ + sin θ)`.
    fn stands_on_face(&self, corner: usize) -> bool {
        let corner = self.solid.vertices[corner];
        let triangle = self.triangle;
        (0..3).all(|i| triangle.inward[i].dot(corner - triangle.corners[i]) >= self.height.abs())
    }

    /// Adds the points, given the axis of least overlap (see [`Overlaps`](super::triangle_lanes::Overlaps)) and the
    /// separation along it.
    fn touch(&self, axis: usize, separation: Real, out: &mut Candidates) -> bool {
        let shallow = self.triangle.is_plain() && self.height >= -SHALLOW * self.solid.inner_radius;
        if (shallow || self.stands_on_face(self.underside.corner)) && !self.reach.second_look {
            return self.touch_face(&FacePoints::ALL, out) == 0 && self.height < 0.0;
        }
        let axis = self.axis(axis);
        let resolved = self.resolve(axis);
        let points = match resolved {
            Some(Axis::Triangle) => self.touch_face(&FacePoints::ALL, out),
            Some(Axis::Face { face }) => self.touch_solid_face(face, out),
            Some(Axis::Edges { edge, solid_edge, normal }) => self.touch_edges(edge, solid_edge, normal, out),
            None if separation < 0.0 && self.is_hemmed_in(axis, separation) => self.touch_face(&FacePoints::ALL, out),
            None => 0,
        };
        if resolved != Some(Axis::Triangle) && !self.reach.second_look && self.lies_flat() {
            let least = separation - EXTRA_DEPTH * self.reach.scale;
            self.touch_face(&FacePoints { least, rims: points == 0 }, out);
        }
        if points > 0 || separation >= 0.0 {
            return false;
        }
        if self.reach.second_look && self.touch_face(&FacePoints::ALL, out) == 0 {
            self.touch_overlap(out);
        }
        true
    }

    /// The axis of a number as in [`Overlaps`](super::triangle_lanes::Overlaps).
    fn axis(&self, number: usize) -> Axis {
        let (faces, edges) = (self.solid.planes.len(), self.solid.edges.len() / 2);
        if number == 0 {
            return Axis::Triangle;
        }
        if number <= faces {
            return Axis::Face { face: number - 1 };
        }
        let number = number - 1 - faces;
        let edge = (self.triangle.longest_edge() + number / edges) % 3;
        let solid_edge = 2 * (number % edges);
        let (start, end) = self.triangle.edge(edge);
        match self.edge_normal(end - start, solid_edge) {
            Some(normal) => Axis::Edges { edge, solid_edge, normal },
            None => Axis::Triangle,
        }
    }

    /// The axis of least overlap and the separation along it, one triangle at a time; `None` if some axis shows a gap
    /// beyond the margin.
    #[cfg(test)]
    fn least_overlap(&self) -> Option<(Axis, Real)> {
        let mut best = (Axis::Triangle, self.height);
        let bias = BIAS * self.reach.scale;
        let mut offer = |axis: Axis, normal: Vec3, separation: Real| {
            if separation > best.1 + bias && normal.dot(self.triangle.normal) > BACKWARD {
                best = (axis, separation);
            }
            separation <= self.reach.margin
        };
        for (face, plane) in self.solid.planes.iter().enumerate() {
            let above = |i: usize| plane.normal.dot(self.triangle.corners[i]) - plane.offset;
            if !offer(Axis::Face { face }, -plane.normal, min(above(0), min(above(1), above(2)))) {
                return None;
            }
        }
        for k in 0..3 {
            let edge = (self.triangle.longest_edge() + k) % 3;
            let (start, end) = self.triangle.edge(edge);
            let along = end - start;
            for solid_edge in (0..self.solid.edges.len()).step_by(2) {
                let Some(normal) = self.edge_normal(along, solid_edge) else { continue };
                let origin = self.solid.vertices[self.solid.edges[solid_edge].origin as usize];
                let separation = normal.dot(origin - start);
                if !offer(Axis::Edges { edge, solid_edge, normal }, normal, separation) {
                    return None;
                }
            }
        }
        Some(best)
    }

    /// The axis of a pair of edges, from the triangle to the solid; `None` if the two cannot be the nearest features.
    #[inline]
    fn edge_normal(&self, along: Vec3, solid_edge: usize) -> Option<Vec3> {
        let a = self.solid.planes[self.solid.edges[solid_edge].face as usize].normal;
        let b = self.solid.planes[self.solid.edges[solid_edge + 1].face as usize].normal;
        let (da, db) = (a.dot(along), b.dot(along));
        if da * db >= 0.0 {
            return None;
        }
        let outward = a * db.abs() + b * da.abs();
        let squared = outward.length_squared();
        if outward.dot(self.triangle.front.cross(along)) <= 0.0 || squared < 1e-12 * along.length_squared() {
            return None;
        }
        Some(outward * (-1.0 / squared.sqrt()))
    }

    /// Whether the surface around the triangle goes on along an axis so far that the way out along the triangle's normal
    /// is shorter after all. The surface may fall by half that way, no more: else the axis leads over its rim.
    fn is_hemmed_in(&self, axis: Axis, separation: Real) -> bool {
        let normal = match axis {
            Axis::Triangle => return true,
            Axis::Face { face } => -self.solid.planes[face].normal,
            Axis::Edges { normal, .. } => normal,
        };
        self.triangle.goes_on(self.top(normal), normal, separation - self.height, -0.5 * self.height)
    }

    /// The corner of the triangle that is farthest along a direction.
    fn top(&self, direction: Vec3) -> usize {
        let [a, b, c] = self.triangle.corners.map(|corner| direction.dot(corner));
        if a >= b && a >= c { 0 } else { 1 + usize::from(c > b) }
    }

    /// What the axis means for the surface: an axis across a level triangle is the triangle's own; one along which the
    /// surface has no summit here is `None`.
    fn resolve(&self, axis: Axis) -> Option<Axis> {
        let triangle = self.triangle;
        match axis {
            Axis::Triangle => Some(axis),
            Axis::Edges { edge, normal, .. } => triangle.edge_allows(edge, normal).then_some(axis),
            Axis::Face { face } => {
                let normal = -self.solid.planes[face].normal;
                let rise = triangle.corners.map(|corner| normal.dot(corner));
                let top = self.top(normal);
                let level = |i: usize| {
                    let length = (triangle.corners[i] - triangle.corners[top]).length();
                    rise[top] - rise[i] <= LEVEL_SINE * length
                };
                let (next, last) = ((top + 1) % 3, (top + 2) % 3);
                let allowed = match (level(next), level(last)) {
                    (true, true) => return Some(Axis::Triangle),
                    (true, false) => triangle.edge_allows(top, normal),
                    (false, true) => triangle.edge_allows(last, normal),
                    (false, false) => triangle.corner_allows(top, normal),
                };
                allowed.then_some(axis)
            }
        }
    }

    /// Whether the solid's lowest face lies (almost) along the triangle, so that its corners bear although another axis
    /// overlaps less: without them a solid that rests on a rim, or over a slight bend, would rock from step to step.
    fn lies_flat(&self) -> bool {
        let across = self.solid.planes[self.underside.face].normal.cross(self.triangle.normal);
        across.length_squared() <= FLAT_SINE * FLAT_SINE
    }

    /// The solid's lowest face cut by the prism over the triangle, and the triangle's corners under that face.
    fn touch_face(&self, wanted: &FacePoints, out: &mut Candidates) -> usize {
        let triangle = self.triangle;
        let seams = !self.reach.second_look;
        let left_out =
            |cut: u32| seams && triangle.is_seam(cut) || !wanted.rims && triangle.edge_is_sharp(cut as usize);
        let mut points = 0;
        let Underside { face, center, radius, .. } = *self.underside;
        if triangle.insides(center).iter().any(|inside| *inside < -radius) {
            return 0;
        }
        let first = self.solid.edge_points(self.solid.face_edges[face] as usize).0;
        let mut end = triangle.insides(first);
        // Corners amid a flat surface are no ends of the contact.
        let bent = |i: usize| !(seams && triangle.around.corner_is_flat(i));
        let mut under = [bent(0), bent(1), bent(2)];
        let any = under != [false; 3];
        for edge in self.solid.face_loop(face) {
            let (a, b) = self.solid.edge_points(edge);
            // Looks into the face's prism: the face winds clockwise as seen from the triangle.
            let inside = (b - a).cross(triangle.normal);
            for (corner, under) in triangle.corners.iter().zip(&mut under).filter(|_| any) {
                *under &= inside.dot(*corner - a) > 0.0;
            }
            let start = end;
            end = triangle.insides(b);
            let Some((ends, cuts)) = Triangle::clip(&start, &end) else { continue };
            if cuts[0] == 3 {
                points += self.face_point(a, wanted.least, u32::from(self.solid.edges[edge].origin), out);
            }
            for k in 0..2 {
                // Where a seam cuts is no end of the contact.
                if cuts[k] != 3 && !left_out(cuts[k]) {
                    let feature = self.cut(edge, cuts[k], k as u32);
                    points += self.face_point(a + (b - a) * ends[k], wanted.least, feature, out);
                }
            }
        }
        let plane = self.solid.planes[face];
        let slope = plane.normal.dot(triangle.normal);
        for (i, corner) in triangle.corners.iter().enumerate() {
            if under[i] && slope < -0.01 && wanted.rims {
                let gap = (plane.offset - plane.normal.dot(*corner)) / slope;
                let feature = 512 + (triangle.around.id << 2 | i as u32);
                points += self.face_point(*corner + triangle.normal * gap, wanted.least, feature, out);
            }
        }
        points
    }

    /// Number of the point where side `cut` of this triangle's prism cuts an edge of the solid.
    fn cut(&self, edge: usize, cut: u32, end: u32) -> u32 {
        feature_id(self.triangle.around.id, 1024 + (((edge as u32) << 3) | (cut << 1) | end))
    }

    /// A point of the solid over (or under) the triangle.
    fn face_point(&self, point: Vec3, least: Real, feature: u32, out: &mut Candidates) -> usize {
        let height = self.triangle.height(point);
        if height > self.reach.margin || height < least {
            return 0;
        }
        out.push(self.triangle.face_candidate(point, height, 0.0, feature));
        1
    }

    /// The triangle's edges cut by the prism over a face of the solid.
    fn touch_solid_face(&self, face: usize, out: &mut Candidates) -> usize {
        let plane = self.solid.planes[face];
        let mut ends = [[0.0, 1.0]; 3];
        for solid_edge in self.solid.face_loop(face) {
            let (side, offset) = self.solid.side_plane(solid_edge);
            let distance = self.triangle.corners.map(|corner| offset + self.triangle.slack - side.dot(corner));
            for (i, ends) in ends.iter_mut().enumerate() {
                let (da, db) = (distance[i], distance[(i + 1) % 3]);
                if da < 0.0 && db < 0.0 {
                    ends[0] = 2.0;
                } else if da < 0.0 {
                    ends[0] = max(ends[0], da / (da - db));
                } else if db < 0.0 {
                    ends[1] = min(ends[1], da / (da - db));
                }
            }
        }
        let mut points = 0;
        for (i, ends) in ends.iter().enumerate() {
            if ends[0] > ends[1] {
                continue;
            }
            let (a, b) = self.triangle.edge(i);
            for (k, t) in ends.iter().enumerate() {
                let position = a + (b - a) * *t;
                let separation = plane.normal.dot(position) - plane.offset;
                if separation <= self.reach.margin && (k == 0 || *t < 1.0) {
                    let feature = (face as u32) << 3 | (i as u32) << 1 | k as u32;
                    out.push(self.triangle.rim_candidate(position, -plane.normal, separation, feature));
                    points += 1;
                }
            }
        }
        points
    }

    /// Where two edges cross, or the ends of the stretch along which they run side by side.
    fn touch_edges(&self, edge: usize, solid_edge: usize, normal: Vec3, out: &mut Candidates) -> usize {
        let (first, second) = (self.triangle.edge(edge), self.solid.edge_points(solid_edge));
        let feature = 4096 + ((solid_edge as u32) << 4 | (edge as u32) << 2);
        if let Some(ends) = parallel_part(first, second) {
            for (k, (on_edge, on_solid)) in ends.into_iter().enumerate() {
                let separation = normal.dot(on_solid - on_edge);
                out.push(self.triangle.rim_candidate(on_edge, normal, separation, feature + 1 + k as u32));
            }
            return 2;
        }
        let points = self.touch_lying_edge(edge, solid_edge, normal, out);
        if points > 0 {
            return points;
        }
        let (d1, d2, r) = (first.1 - first.0, second.1 - second.0, first.0 - second.0);
        let (a, e, b) = (d1.length_squared(), d2.length_squared(), d1.dot(d2));
        let t = clamp((b * d2.dot(r) - d1.dot(r) * e) / (a * e - b * b), 0.0, 1.0);
        let separation = normal.dot(second.0 - first.0);
        out.push(self.triangle.rim_candidate(first.0 + d1 * t, normal, separation, feature));
        1
    }

    /// An edge of the triangle that lies (almost) along a face beside the solid's edge bears at both ends of the stretch
    /// under that face, not only where the two edges cross.
    fn touch_lying_edge(&self, edge: usize, solid_edge: usize, normal: Vec3, out: &mut Candidates) -> usize {
        let (a, b) = self.triangle.edge(edge);
        let along = b - a;
        let faces = [solid_edge, solid_edge ^ 1].map(|e| self.solid.edges[e].face as usize);
        let slopes = faces.map(|face| self.solid.planes[face].normal.dot(along).abs());
        let (face, slope) = if slopes[0] <= slopes[1] { (faces[0], slopes[0]) } else { (faces[1], slopes[1]) };
        let plane = self.solid.planes[face];
        let facing = -plane.normal.dot(normal);
        if slope * slope > FLAT_SINE * FLAT_SINE * along.length_squared() || facing < 0.5 {
            return 0;
        }
        let mut ends = [0.0, 1.0];
        for side_edge in self.solid.face_loop(face) {
            let (side, offset) = self.solid.side_plane(side_edge);
            let (da, db) = (offset - side.dot(a), offset - side.dot(b));
            if da < 0.0 && db < 0.0 {
                return 0;
            } else if da < 0.0 {
                ends[0] = max(ends[0], da / (da - db));
            } else if db < 0.0 {
                ends[1] = min(ends[1], da / (da - db));
            }
        }
        if ends[0] >= ends[1] {
            return 0;
        }
        let mut points = 0;
        for (k, t) in ends.into_iter().enumerate() {
            let position = a + along * t;
            let separation = (plane.normal.dot(position) - plane.offset) / facing;
            if separation <= self.reach.margin {
                let feature = 2048 + ((face as u32) << 3 | (edge as u32) << 1 | k as u32);
                out.push(self.triangle.rim_candidate(position, normal, separation, feature));
                points += 1;
            }
        }
        points
    }

    /// The part of the triangle inside the solid, pushed out along the face normal: never nothing for a real overlap.
    fn touch_overlap(&self, out: &mut Candidates) {
        for i in 0..3 {
            let (a, b) = self.triangle.edge(i);
            let (mut enter, mut leave) = (0.0, 1.0);
            for plane in self.solid.planes {
                let da = plane.offset - plane.normal.dot(a);
                let db = plane.offset - plane.normal.dot(b);
                if da < 0.0 && db < 0.0 {
                    leave = -1.0;
                } else if da < 0.0 {
                    enter = max(enter, da / (da - db));
                } else if db < 0.0 {
                    leave = min(leave, da / (da - db));
                }
            }
            if enter <= leave {
                self.push_out(a + (b - a) * enter, i as u32, out);
                self.push_out(a + (b - a) * leave, 4 + i as u32, out);
            }
        }
        for edge in (0..self.solid.edges.len()).step_by(2) {
            let (a, b) = self.solid.edge_points(edge);
            let (da, db) = (self.triangle.height(a), self.triangle.height(b));
            if da * db < 0.0 {
                let point = a + (b - a) * (da / (da - db));
                if self.triangle.insides(point).iter().all(|inside| *inside >= 0.0) {
                    self.push_out(point, 16 + edge as u32, out);
                }
            }
        }
    }

    /// A point of the triangle inside the solid: the gap is how far the solid reaches below it.
    fn push_out(&self, position: Vec3, feature: u32, out: &mut Candidates) {
        let mut depth = Real::MAX;
        for plane in self.solid.planes {
            let sinking = -plane.normal.dot(self.triangle.normal);
            if sinking > 1e-6 {
                depth = min(depth, max(0.0, plane.offset - plane.normal.dot(position)) / sinking);
            }
        }
        out.push(Candidate {
            position,
            normal: self.triangle.normal,
            separation: -depth,
            feature: feature_id(self.triangle.around.id, feature),
            facet: self.triangle.index,
            triangle: self.triangle.index,
        });
    }
}

#[cfg(test)]
#[path = "triangle_lanes_tests.rs"]
mod tests;
