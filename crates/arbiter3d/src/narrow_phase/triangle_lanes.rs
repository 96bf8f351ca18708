//! Eight triangles of a mesh at once against a convex shape: which are near, and where a solid overlaps them least.
//!
//! Of the triangles that the mesh's tree finds around a body a third lie near its surface, and of these again a fourth
//! touch. Both are told by arithmetic without branches, so it is done in lanes: [`Sift`] drops triangles outside the box
//! around the shape in its own frame or seen from behind, [`LeastOverlap`] tries all separating axes of a solid (see
//! `triangle_solid`) and drops those with a gap beyond the margin. What is left is held against the shape one by one.
//!
//! Lanes never mix and go through the operations of one triangle alone in the same order, so that a triangle's result does
//! not depend on its neighbours in the group nor on the instructions that the machine has.

use super::polyhedron::Polyhedron;
use super::triangle::Frame;
use crate::math::{Aabb, Mat3, Real, Vec3};
use crate::shape::{Facet, OCTET, Octet};
use crate::simd::{Kernel, Wide, WideVec3, run_widest};
use std::array::from_fn;

/// Triangles in a group.
pub(super) const LANES: usize = OCTET;

type Lanes = Wide<LANES>;
type Vectors = WideVec3<LANES>;

/// Axes that push through the triangle to its other side are no way out; those that lean back less tell at least that
/// the contact is a neighbour's.
pub(super) const BACKWARD: Real = -0.7;

/// What a triangle has to be near to.
pub(super) struct Near<'a> {
    pub(super) frame: &'a Frame,
    /// The box around the shape, margin included, in the frame of the mesh.
    pub(super) aabb: Aabb,
    /// The same in the frame of the shape.
    pub(super) bounds: Aabb,
    /// A point inside the shape, in the frame of the mesh.
    pub(super) center: Vec3,
    /// Planes farther from that point than this are out of reach.
    pub(super) far: Real,
    /// Triangles seen from behind are left out.
    pub(super) one_sided: bool,
    /// But for those that the centre is behind by no more than this.
    pub(super) behind: Real,
}

impl Near<'_> {
    /// For each triangle on which side of it the shape is (1 in front, −1 behind), 0 if it is out of reach.
    pub(super) fn sides(&self, octet: &Octet) -> [Real; LANES] {
        let mut sides = [0.0; LANES];
        run_widest(Sift { near: self, octet, sides: &mut sides });
        sides
    }
}

struct Sift<'a> {
    near: &'a Near<'a>,
    octet: &'a Octet,
    sides: &'a mut [Real; LANES],
}

impl Kernel for Sift<'_> {
    #[inline(always)]
    fn run(self) {
        let near = self.near;
        let corners = &self.octet.corners;
        let height = self.octet.normal.dot(&(splat(near.center) - corners[0]));
        let (behind, other) = if near.one_sided { (-near.behind, 0.0) } else { (0.0, -1.0) };
        let sides = not_below(height, Lanes::splat(behind), Lanes::splat(1.0), Lanes::splat(other));
        let sides = not_below(Lanes::splat(near.far), absolute(height), sides, Lanes::ZERO);
        let sides = keep_overlapping(sides, corners, &near.aabb);
        let position = splat(near.frame.position);
        let local = turn_corners(&near.frame.inverse, &from_position(corners, &position));
        *self.sides = keep_overlapping(sides, &local, &near.bounds).0;
    }
}

/// Zero where the box around the corners does not overlap the given one.
#[inline(always)]
fn keep_overlapping(sides: Lanes, corners: &[Vectors; 3], aabb: &Aabb) -> Lanes {
    let [a, b, c] = corners;
    let axis = |sides: Lanes, (a, b, c): (Lanes, Lanes, Lanes), low: Real, high: Real| {
        let (least, most) = (a.min(b.min(c)), a.max(b.max(c)));
        let sides = not_below(Lanes::splat(high), least, sides, Lanes::ZERO);
        not_below(most, Lanes::splat(low), sides, Lanes::ZERO)
    };
    let sides = axis(sides, (a.x, b.x, c.x), aabb.min.x, aabb.max.x);
    let sides = axis(sides, (a.y, b.y, c.y), aabb.min.y, aabb.max.y);
    axis(sides, (a.z, b.z, c.z), aabb.min.z, aabb.max.z)
}

/// The axis of least overlap of a solid with each of some triangles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Overlaps {
    /// Of the solid's lowest corner over the triangle's plane.
    pub(super) height: [Real; LANES],
    /// Along the axis of least overlap.
    pub(super) separation: [Real; LANES],
    /// 0 for the triangle's face; then the solid's faces; then its edges (one half of each) with the triangle's first,
    /// second and third edge.
    pub(super) axis: [Real; LANES],
    /// 1 where the solid's lowest corner is within the margin of the triangle's plane and no axis that was tried shows a
    /// gap beyond it, else 0.
    pub(super) near: [Real; LANES],
}

/// Tries all axes; see [`Overlaps`].
pub(super) struct LeastOverlap<'a> {
    pub(super) solid: &'a Polyhedron<'a>,
    pub(super) frame: &'a Frame,
    pub(super) facets: [&'a Facet; LANES],
    /// 1 or −1: from which side the solid comes.
    pub(super) sides: [Real; LANES],
    /// Gaps up to this give points.
    pub(super) margin: Real,
    /// An axis must be better than the triangle's face by this.
    pub(super) bias: Real,
    /// Over a triangle without sharp edges the face alone counts, up to this depth: other axes are not tried.
    pub(super) shallow: Real,
}

impl LeastOverlap<'_> {
    pub(super) fn find(self) -> Overlaps {
        const NONE: [Real; LANES] = [0.0; LANES];
        let mut found = Overlaps { height: NONE, separation: NONE, axis: NONE, near: NONE };
        run_widest(Search { input: self, found: &mut found });
        found
    }
}

struct Search<'a, 'b> {
    input: LeastOverlap<'a>,
    found: &'b mut Overlaps,
}

impl Kernel for Search<'_, '_> {
    #[inline(always)]
    fn run(self) {
        let LeastOverlap { solid, frame, facets, sides, margin, bias, shallow } = self.input;
        let unturned = from_position(&gather_corners(&facets), &splat(frame.position));
        let front = gather(&facets, |facet| facet.normal);
        let normal = turn(&frame.inverse, &front).scale(Wide(sides));
        let offset = front.dot(&unturned[0]) * Wide(sides);
        let lowest = solid.vertices.iter().fold(Lanes::splat(Real::MAX), |low, v| splat(*v).dot(&normal).min(low));
        let height = lowest - offset;
        let low = not_below(Lanes::splat(margin), height, Lanes::splat(1.0), Lanes::ZERO);
        let sharp = Wide(from_fn(|k| if facets[k].sharp_edges | facets[k].sharp_corners == 0 { 0.0 } else { 1.0 }));
        let tried = low * not_below(height, Lanes::splat(-shallow), sharp, Lanes::splat(1.0));
        let mut best = Best { axis: Lanes::ZERO, separation: height, near: tried, margin, bias };
        if best.any_near() {
            let corners = turn_corners(&frame.inverse, &unturned);
            best.try_faces(solid, &corners, &normal);
            for edge in 0..3 {
                if best.any_near() {
                    let inward = turn(&frame.inverse, &gather(&facets, |facet| facet.inward[edge]));
                    let along = corners[(edge + 1) % 3] - corners[edge];
                    best.try_edges(solid, edge, &TriangleEdge { start: corners[edge], along, inward, normal });
                }
            }
        }
        let near = low - tried + best.near;
        *self.found = Overlaps { height: height.0, separation: best.separation.0, axis: best.axis.0, near: near.0 };
    }
}

/// The same edge of each triangle.
struct TriangleEdge {
    start: Vectors,
    along: Vectors,
    inward: Vectors,
    normal: Vectors,
}

/// The best axes so far.
#[derive(Clone, Copy)]
struct Best {
    axis: Lanes,
    separation: Lanes,
    near: Lanes,
    margin: Real,
    bias: Real,
}

impl Best {
    #[inline(always)]
    fn any_near(&self) -> bool {
        self.near.0.iter().fold(false, |any, near| any | (*near > 0.0))
    }

    /// Takes an axis where it is better, and drops triangles with a gap along it. An axis that is none has a separation of
    /// `-Real::MAX`.
    #[inline(always)]
    fn offer(&mut self, axis: Real, facing: Lanes, separation: Lanes) {
        let least = Lanes::splat(-Real::MAX);
        let forward = above(facing, Lanes::splat(BACKWARD), separation, least);
        let wanted = self.separation + Lanes::splat(self.bias);
        self.axis = above(forward, wanted, Lanes::splat(axis), self.axis);
        self.separation = above(forward, wanted, separation, self.separation);
        self.near = not_below(Lanes::splat(self.margin), separation, self.near, Lanes::ZERO);
    }

    #[inline(always)]
    fn try_faces(&mut self, solid: &Polyhedron, corners: &[Vectors; 3], normal: &Vectors) {
        for (face, plane) in solid.planes.iter().enumerate() {
            let outward = splat(plane.normal);
            let [a, b, c] = corners;
            let (a, b, c) = (outward.dot(a), outward.dot(b), outward.dot(c));
            let offset = Lanes::splat(plane.offset);
            let separation = (a - offset).min((b - offset).min(c - offset));
            self.offer(1.0 + face as Real, splat(-plane.normal).dot(normal), separation);
        }
    }

    #[inline(always)]
    fn try_edges(&mut self, solid: &Polyhedron, edge: usize, of: &TriangleEdge) {
        let pairs = solid.edges.as_chunks::<2>().0;
        let first = 1 + solid.planes.len() + edge * pairs.len();
        let shortest = Lanes::splat(1e-12) * of.along.dot(&of.along);
        for (index, twins) in pairs.iter().enumerate() {
            let a = splat(solid.planes[twins[0].face as usize].normal);
            let b = splat(solid.planes[twins[1].face as usize].normal);
            let (da, db) = (a.dot(&of.along), b.dot(&of.along));
            let across = da * db;
            if across.0.iter().fold(true, |all, product| all & (*product >= 0.0)) {
                continue;
            }
            let outward = a.scale(absolute(db)) + b.scale(absolute(da));
            let squared = outward.dot(&outward);
            let axis = outward.scale(Lanes::splat(-1.0) / squared.sqrt());
            let separation = axis.dot(&(splat(solid.vertices[twins[0].origin as usize]) - of.start));
            let none = Lanes::splat(-Real::MAX);
            let separation = not_below(across, Lanes::ZERO, none, separation);
            let separation = above(outward.dot(&of.inward), Lanes::ZERO, separation, none);
            let separation = not_below(squared, shortest, separation, none);
            self.offer((first + index) as Real, axis.dot(&of.normal), separation);
        }
    }
}

#[inline(always)]
fn absolute(a: Lanes) -> Lanes {
    Wide(from_fn(|k| a[k].abs()))
}

#[inline(always)]
fn splat(v: Vec3) -> Vectors {
    WideVec3 { x: Lanes::splat(v.x), y: Lanes::splat(v.y), z: Lanes::splat(v.z) }
}

/// In each lane `yes` where `a >= b`, else `no`. One condition a choice: of several at once the compiler makes branches.
#[inline(always)]
fn not_below(a: Lanes, b: Lanes, yes: Lanes, no: Lanes) -> Lanes {
    Wide(from_fn(|k| if a[k] >= b[k] { yes[k] } else { no[k] }))
}

/// In each lane `yes` where `a > b`, else `no`.
#[inline(always)]
fn above(a: Lanes, b: Lanes, yes: Lanes, no: Lanes) -> Lanes {
    Wide(from_fn(|k| if a[k] > b[k] { yes[k] } else { no[k] }))
}

#[inline(always)]
fn gather(facets: &[&Facet; LANES], pick: impl Fn(&Facet) -> Vec3) -> Vectors {
    WideVec3 {
        x: Wide(from_fn(|k| pick(facets[k]).x)),
        y: Wide(from_fn(|k| pick(facets[k]).y)),
        z: Wide(from_fn(|k| pick(facets[k]).z)),
    }
}

#[inline(always)]
fn gather_corners(facets: &[&Facet; LANES]) -> [Vectors; 3] {
    [gather(facets, |f| f.corners[0]), gather(facets, |f| f.corners[1]), gather(facets, |f| f.corners[2])]
}

#[inline(always)]
fn from_position(corners: &[Vectors; 3], position: &Vectors) -> [Vectors; 3] {
    [corners[0] - *position, corners[1] - *position, corners[2] - *position]
}

#[inline(always)]
fn turn_corners(m: &Mat3, corners: &[Vectors; 3]) -> [Vectors; 3] {
    [turn(m, &corners[0]), turn(m, &corners[1]), turn(m, &corners[2])]
}

/// A matrix times vectors, in the order of one vector.
#[inline(always)]
fn turn(m: &Mat3, v: &Vectors) -> Vectors {
    let part = |x: Real, y: Real, z: Real| Lanes::splat(x) * v.x + Lanes::splat(y) * v.y + Lanes::splat(z) * v.z;
    WideVec3 {
        x: part(m.x_axis.x, m.y_axis.x, m.z_axis.x),
        y: part(m.x_axis.y, m.y_axis.y, m.z_axis.y),
        z: part(m.x_axis.z, m.y_axis.z, m.z_axis.z),
    }
}
