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
use crate::simd::{KernelOfEight, LaneVec3, Lanes, Number, run_eight};
use std::array::from_fn;

/// Triangles in a group.
pub(super) const LANES: usize = OCTET;

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
        run_eight(Sift { near: self, octet, sides: &mut sides });
        sides
    }
}

struct Sift<'a> {
    near: &'a Near<'a>,
    octet: &'a Octet,
    sides: &'a mut [Real; LANES],
}

impl KernelOfEight for Sift<'_> {
    #[inline(always)]
    fn run<W: Lanes<LANES>>(self) {
        let near = self.near;
        let [a, b, c] = &self.octet.corners;
        let corners: [LaneVec3<W>; 3] = [a.to_lanes(), b.to_lanes(), c.to_lanes()];
        let normal: LaneVec3<W> = self.octet.normal.to_lanes();
        let height = normal.dot(&(LaneVec3::splat(near.center) - corners[0]));
        let (behind, other) = if near.one_sided { (-near.behind, 0.0) } else { (0.0, -1.0) };
        let sides = height.if_at_least(W::splat(behind), W::splat(1.0), W::splat(other));
        let sides = W::splat(near.far).if_at_least(height.abs(), sides, W::ZERO);
        let sides = keep_overlapping(sides, &corners, &near.aabb);
        let position = LaneVec3::splat(near.frame.position);
        let local = turn_corners(&near.frame.inverse, &from_position(&corners, &position));
        *self.sides = keep_overlapping(sides, &local, &near.bounds).to_array();
    }
}

/// Zero where the box around the corners does not overlap the given one.
#[inline(always)]
fn keep_overlapping<W: Number>(sides: W, corners: &[LaneVec3<W>; 3], aabb: &Aabb) -> W {
    let [a, b, c] = corners;
    let sides = keep_between(sides, [a.x, b.x, c.x], aabb.min.x, aabb.max.x);
    let sides = keep_between(sides, [a.y, b.y, c.y], aabb.min.y, aabb.max.y);
    keep_between(sides, [a.z, b.z, c.z], aabb.min.z, aabb.max.z)
}

/// Zero where three numbers are all below `low` or all above `high`.
#[inline(always)]
fn keep_between<W: Number>(sides: W, [a, b, c]: [W; 3], low: Real, high: Real) -> W {
    let (least, most) = (a.min(b.min(c)), a.max(b.max(c)));
    let sides = W::splat(high).if_at_least(least, sides, W::ZERO);
    most.if_at_least(W::splat(low), sides, W::ZERO)
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
        run_eight(Search { input: self, found: &mut found });
        found
    }
}

struct Search<'a, 'b> {
    input: LeastOverlap<'a>,
    found: &'b mut Overlaps,
}

impl KernelOfEight for Search<'_, '_> {
    #[inline(always)]
    fn run<W: Lanes<LANES>>(self) {
        let LeastOverlap { solid, frame, facets, sides, margin, bias, shallow } = self.input;
        let unturned = from_position(&gather_corners::<W>(&facets), &LaneVec3::splat(frame.position));
        let front: LaneVec3<W> = gather(&facets, |facet| facet.normal);
        let sides = W::from_array(sides);
        let normal = turn(&frame.inverse, &front).scale(sides);
        let offset = front.dot(&unturned[0]) * sides;
        let mut lowest = W::splat(Real::MAX);
        for &vertex in solid.vertices {
            lowest = LaneVec3::splat(vertex).dot(&normal).min(lowest);
        }
        let height = lowest - offset;
        let low = W::splat(margin).if_at_least(height, W::splat(1.0), W::ZERO);
        let has_sharp = |facet: &Facet| if facet.sharp_edges | facet.sharp_corners == 0 { 0.0 } else { 1.0 };
        let sharp = W::from_array(from_fn(|k| has_sharp(facets[k])));
        let tried = low * height.if_at_least(W::splat(-shallow), sharp, W::splat(1.0));
        let mut best = Best { axis: W::ZERO, separation: height, near: tried, margin, bias };
        if best.any_near::<LANES>() {
            let corners = turn_corners(&frame.inverse, &unturned);
            best.try_faces(solid, &corners, &normal);
            for edge in 0..3 {
                if best.any_near::<LANES>() {
                    let inward = turn(&frame.inverse, &gather(&facets, |facet| facet.inward[edge]));
                    let along = corners[(edge + 1) % 3] - corners[edge];
                    best.try_edges::<LANES>(solid, edge, &TriangleEdge { start: corners[edge], along, inward, normal });
                }
            }
        }
        let near = low - tried + best.near;
        *self.found = Overlaps {
            height: height.to_array(),
            separation: best.separation.to_array(),
            axis: best.axis.to_array(),
            near: near.to_array(),
        };
    }
}

/// The same edge of each triangle.
struct TriangleEdge<W> {
    start: LaneVec3<W>,
    along: LaneVec3<W>,
    inward: LaneVec3<W>,
    normal: LaneVec3<W>,
}

/// The best axes so far.
#[derive(Clone, Copy)]
struct Best<W> {
    axis: W,
    separation: W,
    near: W,
    margin: Real,
    bias: Real,
}

impl<W: Number> Best<W> {
    #[inline(always)]
    fn any_near<const L: usize>(&self) -> bool
    where
        W: Lanes<L>,
    {
        self.near.to_array().iter().fold(false, |any, near| any | (*near > 0.0))
    }

    /// Takes an axis where it is better, and drops triangles with a gap along it. An axis that is none has a separation of
    /// `-Real::MAX`.
    #[inline(always)]
    fn offer(&mut self, axis: Real, facing: W, separation: W) {
        let least = W::splat(-Real::MAX);
        let forward = facing.if_above(W::splat(BACKWARD), separation, least);
        let wanted = self.separation + W::splat(self.bias);
        self.axis = forward.if_above(wanted, W::splat(axis), self.axis);
        self.separation = forward.if_above(wanted, separation, self.separation);
        self.near = W::splat(self.margin).if_at_least(separation, self.near, W::ZERO);
    }

    #[inline(always)]
    fn try_faces(&mut self, solid: &Polyhedron, corners: &[LaneVec3<W>; 3], normal: &LaneVec3<W>) {
        for (face, plane) in solid.planes.iter().enumerate() {
            let outward = LaneVec3::splat(plane.normal);
            let [a, b, c] = corners;
            let (a, b, c) = (outward.dot(a), outward.dot(b), outward.dot(c));
            let offset = W::splat(plane.offset);
            let separation = (a - offset).min((b - offset).min(c - offset));
            self.offer(1.0 + face as Real, LaneVec3::splat(-plane.normal).dot(normal), separation);
        }
    }

    #[inline(always)]
    fn try_edges<const L: usize>(&mut self, solid: &Polyhedron, edge: usize, of: &TriangleEdge<W>)
    where
        W: Lanes<L>,
    {
        let pairs = solid.edges.as_chunks::<2>().0;
        let first = 1 + solid.planes.len() + edge * pairs.len();
        let shortest = W::splat(1e-12) * of.along.dot(&of.along);
        for (index, twins) in pairs.iter().enumerate() {
            let a = LaneVec3::splat(solid.planes[twins[0].face as usize].normal);
            let b = LaneVec3::splat(solid.planes[twins[1].face as usize].normal);
            let (da, db) = (a.dot(&of.along), b.dot(&of.along));
            let across = da * db;
            if across.to_array().iter().fold(true, |all, product| all & (*product >= 0.0)) {
                continue;
            }
            let outward = a.scale(db.abs()) + b.scale(da.abs());
            let squared = outward.dot(&outward);
            let axis = outward.scale(W::splat(-1.0) / squared.sqrt());
            let separation = axis.dot(&(LaneVec3::splat(solid.vertices[twins[0].origin as usize]) - of.start));
            let none = W::splat(-Real::MAX);
            let separation = across.if_at_least(W::ZERO, none, separation);
            let separation = outward.dot(&of.inward).if_above(W::ZERO, separation, none);
            let separation = squared.if_at_least(shortest, separation, none);
            self.offer((first + index) as Real, axis.dot(&of.normal), separation);
        }
    }
}

#[inline(always)]
fn gather<W: Lanes<LANES>>(facets: &[&Facet; LANES], pick: impl Fn(&Facet) -> Vec3) -> LaneVec3<W> {
    LaneVec3 {
        x: W::from_array(from_fn(|k| pick(facets[k]).x)),
        y: W::from_array(from_fn(|k| pick(facets[k]).y)),
        z: W::from_array(from_fn(|k| pick(facets[k]).z)),
    }
}

#[inline(always)]
fn gather_corners<W: Lanes<LANES>>(facets: &[&Facet; LANES]) -> [LaneVec3<W>; 3] {
    [gather(facets, |f| f.corners[0]), gather(facets, |f| f.corners[1]), gather(facets, |f| f.corners[2])]
}

#[inline(always)]
fn from_position<W: Number>(corners: &[LaneVec3<W>; 3], position: &LaneVec3<W>) -> [LaneVec3<W>; 3] {
    [corners[0] - *position, corners[1] - *position, corners[2] - *position]
}

#[inline(always)]
fn turn_corners<W: Number>(m: &Mat3, corners: &[LaneVec3<W>; 3]) -> [LaneVec3<W>; 3] {
    [turn(m, &corners[0]), turn(m, &corners[1]), turn(m, &corners[2])]
}

/// A matrix times vectors, in the order of one vector.
#[inline(always)]
fn turn<W: Number>(m: &Mat3, v: &LaneVec3<W>) -> LaneVec3<W> {
    LaneVec3 {
        x: LaneVec3::splat(m.row(0)).dot(v),
        y: LaneVec3::splat(m.row(1)).dot(v),
        z: LaneVec3::splat(m.row(2)).dot(v),
    }
}
