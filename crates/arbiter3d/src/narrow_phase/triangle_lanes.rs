//! Eight triangles of a mesh at once against a convex shape: which are near, and where a solid overlaps them least.
//!
//! All is told by arithmetic without branches, so it is done in lanes, and after each stage what is left is packed anew.
//! [`Near`] drops boxes of the tree beside the shape's own box, then triangles seen from behind and those that a first look
//! tells to be out of reach: beyond a face of a solid, under a ball or a capsule. [`FaceSearch`] tries the faces of triangle
//! and solid as separating axes and drops those with a gap beyond the margin, [`EdgeSearch`] the pairs of edges (see
//! `triangle_solid`). What is left is held against the shape one by one.
//!
//! Lanes never mix and go through the operations of one triangle alone in the same order, so that a triangle's result does
//! not depend on its neighbours in the group nor on the instructions that the machine has.

use super::triangle::{Frame, Reach, Solid};
use crate::math::{Aabb, Mat3, Real, Vec3, abs3};
use crate::shape::polyhedron::Polyhedron;
use crate::shape::{Facet, LEAF as LANES};
use crate::simd::{KernelOfEight, LaneVec3, Lanes, Number, run_eight};

/// Axes that push through the triangle to its other side are no way out; those that lean back less tell at least that
/// the contact is a neighbour's.
pub(super) const BACKWARD: Real = -0.7;

/// What a triangle has to be near to.
pub(super) struct Near<'a> {
    pub(super) frame: &'a Frame,
    pub(super) reach: &'a Reach,
    /// The box around the shape, margin included, in the frame of the shape.
    pub(super) bounds: Aabb,
    /// How large that box is: what rounding is relative to.
    pub(super) size: Real,
    /// A point inside the shape, in the frame of the mesh.
    pub(super) center: Vec3,
    /// Triangles seen from behind are left out.
    pub(super) one_sided: bool,
    /// But for those that the centre is behind by no more than this.
    pub(super) behind: Real,
}

impl Near<'_> {
    /// Rounding, as a share of the numbers compared.
    const SLACK: Real = 1e-5;

    /// Zero where a box in the frame of the mesh does not overlap the bounds.
    #[inline(always)]
    pub(super) fn keep_boxes<W: Number>(&self, found: W, center: &LaneVec3<W>, half: &LaneVec3<W>) -> W {
        let m = &self.frame.inverse;
        let absolute = Mat3::from_cols(abs3(m.x_axis), abs3(m.y_axis), abs3(m.z_axis));
        let from = turn(m, &(*center - LaneVec3::splat(self.frame.position)));
        let size = turn(&absolute, half);
        let (middle, reach) = (self.bounds.center(), self.bounds.half_extents());
        let found = keep_reached(found, from.x, size.x, [middle.x, reach.x]);
        let found = keep_reached(found, from.y, size.y, [middle.y, reach.y]);
        keep_reached(found, from.z, size.z, [middle.z, reach.z])
    }

    /// For each triangle on which side of it the shape is (1 in front, −1 behind), 0 if it is out of reach.
    #[inline(always)]
    pub(super) fn sides<W: Lanes<LANES>>(&self, solid: &impl Solid, corners: &[LaneVec3<W>; 3]) -> W {
        let [a, b, c] = from_position(corners, &LaneVec3::splat(self.frame.position));
        let normal = (b - a).cross(&(c - a));
        let length = normal.dot(&normal).sqrt();
        let height = normal.dot(&(LaneVec3::splat(self.center - self.frame.position) - a));
        let (behind, other) = if self.one_sided { (-self.behind, 0.0) } else { (0.0, -1.0) };
        let sides = height.if_at_least(W::splat(behind) * length, W::splat(1.0), W::splat(other));
        let gap = W::splat(self.reach.margin + self.slack()) * length;
        solid.keep_reached(self, sides, &Planes { corners: [a, b, c], normal: normal.scale(sides), length, gap })
    }

    /// What rounding may make of distances of points beside the shape, metres.
    #[inline(always)]
    pub(super) fn slack(&self) -> Real {
        Self::SLACK * self.size
    }

    /// Zero where a triangle is outside the box around the shape.
    #[inline(always)]
    pub(super) fn keep_in_box<W: Number>(&self, sides: W, planes: &Planes<W>) -> W {
        let [a, b, c] = turn_corners(&self.frame.inverse, &planes.corners);
        let sides = keep_between(sides, [a.x, b.x, c.x], self.bounds.min.x, self.bounds.max.x);
        let sides = keep_between(sides, [a.y, b.y, c.y], self.bounds.min.y, self.bounds.max.y);
        keep_between(sides, [a.z, b.z, c.z], self.bounds.min.z, self.bounds.max.z)
    }
}

/// Triangles as seen from the shape's position, in the mesh's axes, and their planes.
pub(super) struct Planes<W> {
    pub(super) corners: [LaneVec3<W>; 3],
    /// Towards the side of the shape, as long as twice the triangle's area.
    normal: LaneVec3<W>,
    length: W,
    /// The most that the lowest point may be above the plane, times that length.
    gap: W,
}

impl<W: Number> Planes<W> {
    /// Zero where the lowest of some points, grown by a radius, is too far above the plane.
    #[inline(always)]
    pub(super) fn keep_low(&self, sides: W, points: &[Vec3], radius: Real) -> W {
        let mut lowest = W::splat(Real::MAX);
        for &point in points {
            lowest = LaneVec3::splat(point).dot(&self.normal).min(lowest);
        }
        let height = lowest - self.normal.dot(&self.corners[0]) - W::splat(radius) * self.length;
        self.gap.if_at_least(height, sides, W::ZERO)
    }
}

/// Zero where an interval, by its centre and half its length, does not overlap another.
#[inline(always)]
fn keep_reached<W: Number>(found: W, center: W, half: W, [middle, reach]: [Real; 2]) -> W {
    let slack = W::splat(Near::SLACK) * (center.abs() + half);
    (half + W::splat(reach) + slack).if_at_least((center - W::splat(middle)).abs(), found, W::ZERO)
}

/// Zero where three numbers are all below `low` or all above `high`.
#[inline(always)]
fn keep_between<W: Number>(sides: W, [a, b, c]: [W; 3], low: Real, high: Real) -> W {
    let (least, most) = (a.min(b.min(c)), a.max(b.max(c)));
    let sides = W::splat(high).if_at_least(least, sides, W::ZERO);
    most.if_at_least(W::splat(low), sides, W::ZERO)
}

/// The axis of least overlap of a solid with each of some triangles.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Overlaps {
    /// Of the solid's lowest corner over the triangle's plane.
    pub(super) height: [Real; LANES],
    /// That corner.
    pub(super) corner: [Real; LANES],
    /// Along the axis of least overlap.
    pub(super) separation: [Real; LANES],
    /// 0 for the triangle's face; then the solid's faces; then its edges (one half of each) with the triangle's longest
    /// edge and the two after it.
    pub(super) axis: [Real; LANES],
    /// 1 where the solid's lowest corner is within the margin of the triangle's plane and no axis that was tried shows a
    /// gap beyond it, else 0.
    pub(super) near: [Real; LANES],
    /// 1 where pairs of edges are to be tried, else 0.
    pub(super) open: [Real; LANES],
}

impl Overlaps {
    /// Takes what was found of one triangle over into another lane.
    #[inline(always)]
    pub(super) fn take(&mut self, lane: usize, other: &Self, from: usize) {
        self.height[lane] = other.height[from];
        self.corner[lane] = other.corner[from];
        self.separation[lane] = other.separation[from];
        self.axis[lane] = other.axis[from];
        self.near[lane] = other.near[from];
        self.open[lane] = other.open[from];
    }
}

/// What axes are tried against, and by which measure.
#[derive(Clone, Copy)]
pub(super) struct Search<'a> {
    pub(super) solid: &'a Polyhedron<'a>,
    pub(super) frame: &'a Frame,
    pub(super) facets: &'a [Facet; LANES],
    /// 1 or −1: from which side the solid comes.
    pub(super) sides: [Real; LANES],
    /// Gaps up to this give points.
    pub(super) margin: Real,
    /// An axis must be better than the triangle's face by this.
    pub(super) bias: Real,
}

/// Tries the faces of triangles and solid.
pub(super) struct FaceSearch<'a> {
    pub(super) search: Search<'a>,
    /// 1 in lanes that hold a triangle, else 0.
    pub(super) wanted: [Real; LANES],
    /// 1 for triangles with sharp edges or corners, else 0.
    pub(super) sharp: [Real; LANES],
    /// Over a triangle without sharp edges the face alone counts, up to this depth: other axes are not tried.
    pub(super) shallow: Real,
}

impl FaceSearch<'_> {
    pub(super) fn find(self) -> Overlaps {
        let mut found = Overlaps::default();
        run_eight(OfFaces { input: self, found: &mut found });
        found
    }
}

struct OfFaces<'a, 'b> {
    input: FaceSearch<'a>,
    found: &'b mut Overlaps,
}

impl KernelOfEight for OfFaces<'_, '_> {
    #[inline(always)]
    fn run<W: Lanes<LANES>>(self) {
        let FaceSearch { search, wanted, sharp, shallow } = self.input;
        let (unturned, front) = gather::<W>(search.facets, search.frame);
        let sides = W::from_array(search.sides);
        let normal = turn(&search.frame.inverse, &front).scale(sides);
        let offset = front.dot(&unturned[0]) * sides;
        let (mut lowest, mut corner) = (W::splat(Real::MAX), W::ZERO);
        for (index, &vertex) in search.solid.vertices.iter().enumerate() {
            let height = LaneVec3::splat(vertex).dot(&normal);
            corner = lowest.if_above(height, W::splat(index as Real), corner);
            lowest = height.min(lowest);
        }
        let height = lowest - offset;
        let low = W::splat(search.margin).if_at_least(height, W::from_array(wanted), W::ZERO);
        let tried = low * height.if_at_least(W::splat(-shallow), W::from_array(sharp), W::splat(1.0));
        let mut best =
            Best { axis: W::ZERO, separation: height, near: tried, margin: search.margin, bias: search.bias };
        if best.near.positive() != 0 {
            best.try_faces(search.solid, &turn_corners(&search.frame.inverse, &unturned), &normal);
        }
        *self.found = Overlaps {
            height: height.to_array(),
            corner: corner.to_array(),
            separation: best.separation.to_array(),
            axis: best.axis.to_array(),
            near: (low - tried + best.near).to_array(),
            open: best.near.to_array(),
        };
    }
}

/// Tries the pairs of edges of the solid with those of the triangles for which they are open.
pub(super) struct EdgeSearch<'a> {
    pub(super) search: Search<'a>,
    pub(super) found: &'a mut Overlaps,
}

impl EdgeSearch<'_> {
    pub(super) fn find(self) {
        run_eight(self);
    }
}

impl KernelOfEight for EdgeSearch<'_> {
    #[inline(always)]
    fn run<W: Lanes<LANES>>(self) {
        let Search { solid, frame, facets, sides, margin, bias } = self.search;
        let (unturned, front) = gather::<W>(facets, frame);
        let corners = turn_corners(&frame.inverse, &unturned);
        let front = turn(&frame.inverse, &front);
        let normal = front.scale(W::from_array(sides));
        let open = W::from_array(self.found.open);
        let mut best = Best {
            axis: W::from_array(self.found.axis),
            separation: W::from_array(self.found.separation),
            near: open,
            margin,
            bias,
        };
        let mut slopes = [W::ZERO; MOST_SLOPES];
        // In a regular mesh the longest edges are parallel, and so are those that follow: edges of the solid that are no
        // match for one triangle's edge are none for the others' either.
        let corners = longest_first(&corners);
        for edge in 0..3 {
            if best.near.positive() == 0 {
                break;
            }
            let along = corners[(edge + 1) % 3] - corners[edge];
            let inward = front.cross(&along);
            let edges = TriangleEdge { start: corners[edge], along, inward, normal };
            best.try_edges::<LANES>(solid, edge, &edges, &mut slopes);
        }
        let near = W::from_array(self.found.near) - open + best.near;
        self.found.separation = best.separation.to_array();
        self.found.axis = best.axis.to_array();
        self.found.near = near.to_array();
    }
}

/// The corners in turn, from the one where the longest edge starts.
#[inline(always)]
fn longest_first<W: Number>(corners: &[LaneVec3<W>; 3]) -> [LaneVec3<W>; 3] {
    let [a, b, c] = corners;
    let (ab, bc, ca) = (*b - *a, *c - *b, *a - *c);
    let (ab, bc, ca) = (ab.dot(&ab), bc.dot(&bc), ca.dot(&ca));
    // Positive where the second or the third edge is the longest.
    let second = bc.if_above(ab, W::splat(1.0), W::ZERO);
    let third = ca.if_above(ab.max(bc), W::splat(1.0), W::ZERO);
    [pick(second, third, [a, b, c]), pick(second, third, [b, c, a]), pick(second, third, [c, a, b])]
}

/// The first vector, but the second where `second` is positive, and the third where `third` is.
#[inline(always)]
fn pick<W: Number>(second: W, third: W, [a, b, c]: [&LaneVec3<W>; 3]) -> LaneVec3<W> {
    LaneVec3 {
        x: third.if_positive(c.x, second.if_positive(b.x, a.x)),
        y: third.if_positive(c.y, second.if_positive(b.y, a.y)),
        z: third.if_positive(c.z, second.if_positive(b.z, a.z)),
    }
}

/// Faces of a solid whose slopes along an edge are worked out once for all of their edges.
const MOST_SLOPES: usize = 32;

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
    fn try_edges<const L: usize>(
        &mut self,
        solid: &Polyhedron,
        edge: usize,
        of: &TriangleEdge<W>,
        slopes: &mut [W; MOST_SLOPES],
    ) where
        W: Lanes<L>,
    {
        let pairs = solid.edges.as_chunks::<2>().0;
        let first = 1 + solid.planes.len() + edge * pairs.len();
        let shortest = W::splat(1e-12) * of.along.dot(&of.along);
        let known = solid.planes.len() <= MOST_SLOPES;
        for (plane, slope) in solid.planes.iter().zip(slopes.iter_mut()) {
            *slope = LaneVec3::splat(plane.normal).dot(&of.along);
        }
        for (index, twins) in pairs.iter().enumerate() {
            let faces = [twins[0].face as usize, twins[1].face as usize];
            let (da, db) = if known {
                (slopes[faces[0] % MOST_SLOPES], slopes[faces[1] % MOST_SLOPES])
            } else {
                let [a, b] = [solid.planes[faces[0]].normal, solid.planes[faces[1]].normal];
                (LaneVec3::splat(a).dot(&of.along), LaneVec3::splat(b).dot(&of.along))
            };
            // Positive where the arc between the two faces crosses the plane square to the edge, in lanes that still count.
            let crosses = (da * db).if_at_least(W::ZERO, W::ZERO, self.near);
            if crosses.positive() == 0 {
                continue;
            }
            let (a, b) =
                (LaneVec3::splat(solid.planes[faces[0]].normal), LaneVec3::splat(solid.planes[faces[1]].normal));
            let outward = a.scale(db.abs()) + b.scale(da.abs());
            let valid = outward.dot(&of.inward).if_above(W::ZERO, crosses, W::ZERO);
            if valid.positive() == 0 {
                continue;
            }
            let squared = outward.dot(&outward);
            let valid = squared.if_at_least(shortest, valid, W::ZERO);
            let axis = outward.scale(W::splat(-1.0) / squared.sqrt());
            let separation = axis.dot(&(LaneVec3::splat(solid.vertices[twins[0].origin as usize]) - of.start));
            let separation = valid.if_positive(separation, W::splat(-Real::MAX));
            // Neither a gap nor better than what is known, in any lane: most are not.
            let useful = (self.separation + W::splat(self.bias)).min(W::splat(self.margin));
            if separation.if_above(useful, W::splat(1.0), W::ZERO).positive() != 0 {
                self.offer((first + index) as Real, axis.dot(&of.normal), separation);
            }
        }
    }
}

/// Corners as seen from the position of the solid, and normals.
#[inline(always)]
fn gather<W: Lanes<LANES>>(facets: &[Facet; LANES], frame: &Frame) -> ([LaneVec3<W>; 3], LaneVec3<W>) {
    let mut records = [&facets[0].quads; LANES];
    for (record, facet) in records.iter_mut().zip(facets) {
        *record = &facet.quads;
    }
    let [ax, ay, az, bx] = W::load_quad(&records, 0);
    let [by, bz, cx, cy] = W::load_quad(&records, 1);
    let [cz, x, y, z] = W::load_quad(&records, 2);
    let corners =
        [LaneVec3 { x: ax, y: ay, z: az }, LaneVec3 { x: bx, y: by, z: bz }, LaneVec3 { x: cx, y: cy, z: cz }];
    (from_position(&corners, &LaneVec3::splat(frame.position)), LaneVec3 { x, y, z })
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
