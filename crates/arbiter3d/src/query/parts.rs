//! The convex parts of any shape: the one place that knows what a shape is made of.
//!
//! Every query but the ray asks for the parts of a shape in some region ([`Region`]) and does the same with each of
//! them: a convex shape has one part, a mesh one for each triangle. A new kind of convex shape needs nothing here once
//! it has a [`Support`]. A new kind of composite needs one arm in [`visit_parts`], which hands over every part whose
//! box the region meets: nearest first if it has a tree of its own, else in any order.

use crate::math::{Aabb, Pose, Real, Vec3, abs3, max, max3, min, min3};
use crate::narrow_phase::Support;
use crate::shape::{Compound, Cuboid, Descent, Geometry, LEAF, MeshSides, Shape, Slabs, Surface, box_distances};
use crate::simd::{LaneVec3, Lanes};

/// A convex part of a shape.
pub(crate) struct Part<'a> {
    pub support: Support<'a>,
    /// Where it is in the frame of the shape; `None` where it is right there.
    pub pose: Option<Pose>,
    /// Child of a compound.
    pub child: Option<u32>,
    /// Triangle of a mesh, as numbered by the user, or of a height field.
    pub triangle: Option<u32>,
    /// Whether only its front is solid: the side from which the corners of the triangle wind counter-clockwise.
    pub one_sided: bool,
}

impl<'a> Part<'a> {
    fn whole(support: Support<'a>) -> Self {
        Self { support, pose: None, child: None, triangle: None, one_sided: false }
    }

    /// The pose in the frame of the part of what `pose` places in the frame of the shape.
    #[inline]
    pub(crate) fn seen(&self, pose: &Pose) -> Pose {
        self.pose.map_or(*pose, |own| own.relative(pose))
    }

    /// A point of the part's frame in that of the shape.
    pub(crate) fn point_out(&self, point: Vec3) -> Vec3 {
        self.pose.map_or(point, |own| own.transform_point(point))
    }

    /// A vector of the part's frame in that of the shape.
    pub(crate) fn vector_out(&self, vector: Vec3) -> Vec3 {
        self.pose.map_or(vector, |own| own.rotation.rotate(vector))
    }

    /// A vector of the shape's frame in that of the part.
    pub(crate) fn vector_in(&self, vector: Vec3) -> Vec3 {
        self.pose.map_or(vector, |own| own.rotation.inverse_rotate(vector))
    }

    /// Whether a shape whose middle is here (in the frame of the part) is pushed by the part: not from behind one that
    /// is solid in front only. `slack` is how far behind still counts, metres.
    pub(crate) fn faces(&self, middle: Vec3, slack: Real) -> bool {
        match &self.support {
            Support::Triangle([a, b, c]) if self.one_sided => {
                let normal = (*b - *a).cross(*c - *a);
                (middle - *a).dot(normal) >= -slack * normal.length()
            }
            _ => true,
        }
    }
}

/// A way through space: a box and, inside of it, a solid that move by up to `limit` times the displacement.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Path {
    /// Middle of the box at the start.
    pub center: Vec3,
    /// Half extents of the box.
    pub half: Vec3,
    pub displacement: Vec3,
    pub limit: Real,
    pub solid: Solid,
}

/// A turned box grown by a radius, around what moves.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Solid {
    /// Its middle at the start.
    pub middle: Vec3,
    /// Half of its edges.
    pub edges: [Vec3; 3],
    pub radius: Real,
    /// Whether what moves keeps its middle there: then a one-sided triangle behind which it starts and stays is no
    /// part.
    pub is_rigid: bool,
}

impl Solid {
    /// A point.
    pub(crate) fn point(at: Vec3) -> Self {
        Self { middle: at, edges: [Vec3::ZERO; 3], radius: 0.0, is_rigid: false }
    }

    fn reach(&self) -> Real {
        self.radius + self.edges[0].length() + self.edges[1].length() + self.edges[2].length()
    }
}

/// Where parts are looked for, in the frame of the shape. Each visit returns a new limit; a negative one ends the
/// search.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Region {
    /// What overlaps a box. The limit means nothing but its sign.
    Box(Aabb),
    /// What something meets on its way.
    Path(Path),
    /// What is within the distance `limit` of a box.
    Near { aabb: Aabb, limit: Real },
}

impl Region {
    /// What of a box is in the box around the region; empty where they are apart.
    pub(crate) fn within(&self, aabb: &Aabb) -> Aabb {
        let bounds = self.bounds();
        Aabb::new(max3(bounds.min, aabb.min), min3(bounds.max, aabb.max))
    }

    /// The limit to begin with.
    pub(crate) fn limit(&self) -> Real {
        match self {
            Self::Box(_) => 1.0,
            Self::Path(path) => path.limit,
            Self::Near { limit, .. } => *limit,
        }
    }

    /// Whether the region, with this limit, meets a box.
    pub(crate) fn meets(&self, aabb: &Aabb, limit: Real) -> bool {
        match self {
            Self::Box(wanted) => wanted.overlaps(aabb),
            Self::Path(path) => path.meets(aabb, limit),
            Self::Near { aabb: near, .. } => {
                let gap = max3(max3(near.min - aabb.max, aabb.min - near.max), Vec3::ZERO);
                gap.length_squared() <= limit * limit * (1.0 + 1e-6)
            }
        }
    }

    /// A box around the region, for composites that look for their parts by boxes alone.
    pub(crate) fn bounds(&self) -> Aabb {
        match self {
            Self::Box(aabb) => *aabb,
            Self::Path(Path { center, half, displacement, limit, .. }) => {
                let way = |d: Real| if d == 0.0 { 0.0 } else { d * *limit };
                let way = Vec3::new(way(displacement.x), way(displacement.y), way(displacement.z));
                Aabb::from_center(*center, *half).sweep(way)
            }
            Self::Near { aabb, limit } => aabb.expand(*limit),
        }
    }
}

impl Path {
    /// Whether the moving box meets a box by `limit`; more often rather than less.
    fn meets(&self, aabb: &Aabb, limit: Real) -> bool {
        let slack = 1e-6 * (aabb.farthest_from(Vec3::ZERO) + abs3(self.center)) + 1e-5 * self.half;
        let reach = self.half + slack;
        let (low, high) = (aabb.min - self.center - reach, aabb.max - self.center + reach);
        let (mut enter, mut leave) = (0.0, limit);
        for axis in 0..3 {
            let rate = self.displacement[axis];
            if rate == 0.0 {
                if low[axis] > 0.0 || high[axis] < 0.0 {
                    return false;
                }
                continue;
            }
            let (near, far) = if rate > 0.0 { (low[axis], high[axis]) } else { (high[axis], low[axis]) };
            enter = max(near / rate, enter);
            leave = min(far / rate, leave);
        }
        enter <= leave * (1.0 + 1e-6)
    }
}

/// Calls `visit` with each convex part of a shape whose box meets the region, and the present limit; it returns a new
/// one.
pub(crate) fn visit_parts<'a>(shape: &'a Shape, region: &Region, mut visit: impl FnMut(&Part<'a>, Real) -> Real) {
    match shape {
        Shape::Mesh(mesh) => visit_triangles(Surface::Mesh(mesh), region, &mut visit),
        Shape::HeightField(field) => visit_triangles(Surface::Field(field), region, &mut visit),
        Shape::HalfSpace(_) => visit_half_space(region, &mut visit),
        Shape::Compound(compound) => visit_children(compound, region, &mut visit),
        Shape::Voxels(grid) => {
            let mut limit = region.limit();
            grid.for_each_box(&region.within(&shape.local_aabb()), |_, cuboid, center| {
                if limit >= 0.0 {
                    let pose = Some(Pose::from_position(center));
                    limit = visit(&Part { pose, ..Part::whole(Support::Cuboid(cuboid)) }, limit);
                }
            });
        }
        convex => {
            let limit = region.limit();
            if region.meets(&convex.local_aabb(), limit)
                && let Some(support) = Support::new(convex)
            {
                visit(&Part::whole(support), limit);
            }
        }
    }
}

/// The parts of the children of a compound.
fn visit_children<'a>(compound: &'a Compound, region: &Region, visit: &mut dyn FnMut(&Part<'a>, Real) -> Real) {
    let (mut limit, within) = (region.limit(), region.within(&compound.local_aabb()));
    compound.for_each_child(&within, |child, shape, placed| {
        let local = Region::Box(within.transform(&placed.inverse()));
        if limit < 0.0 {
            return;
        }
        let mut hand_on = |part: &Part<'a>, _: Real| {
            let pose = Some(part.pose.map_or(*placed, |pose| placed.mul(&pose)));
            limit = visit(&Part { support: part.support, pose, child: Some(child as u32), ..*part }, limit);
            limit
        };
        visit_parts(shape, &local, &mut hand_on as &mut dyn FnMut(&Part<'a>, Real) -> Real);
    });
}

/// The part of a half-space that the region can tell from all of it: a block below the region, larger than it.
fn visit_half_space<'a>(region: &Region, visit: &mut impl FnMut(&Part<'a>, Real) -> Real) {
    let bounds = region.bounds();
    let (center, half) = (bounds.center(), bounds.half_extents());
    let reach = max(half.max_element(), bounds.min.y.abs());
    // Of a point at height zero any block will do.
    let size = if reach > 0.0 { min(2.0 * reach, LARGEST_BLOCK) } else { 1.0 };
    let Ok(block) = Cuboid::new(Vec3::splat(size)) else { return };
    if bounds.min.y <= 0.0 || matches!(region, Region::Near { .. }) {
        let pose = Pose::from_position(Vec3::new(center.x, -size, center.z));
        visit(&Part { pose: Some(pose), ..Part::whole(Support::Cuboid(block)) }, region.limit());
    }
}

/// Half extent of the block that stands for a half-space where a region is endless, metres.
const LARGEST_BLOCK: Real = 1e7;

fn visit_triangles<'a>(surface: Surface<'a>, region: &Region, visit: &mut impl FnMut(&Part<'a>, Real) -> Real) {
    match region {
        Region::Box(aabb) => {
            let mut limit = region.limit();
            surface.for_each_facet(aabb, |index| {
                if limit >= 0.0 {
                    limit = visit(&triangle(surface, index), limit);
                }
            });
        }
        Region::Path(path) => {
            let slabs = Slabs::of_box(path.center, path.half, path.displacement, &surface.local_aabb());
            surface.descend(path.limit, &mut Along { surface, path, slabs, visit });
        }
        Region::Near { aabb, limit } => {
            surface.descend(*limit * *limit * ROUNDED, &mut Around { surface, aabb, visit });
        }
    }
}

fn triangle(surface: Surface<'_>, index: usize) -> Part<'_> {
    Part {
        support: Support::Triangle(surface.corners(index)),
        pose: None,
        child: None,
        triangle: Some(surface.id(index)),
        one_sided: surface.sides() == MeshSides::One,
    }
}

/// The boxes of triangles.
#[inline(always)]
fn boxes<W: Lanes<LEAF>>([a, b, c]: &[LaneVec3<W>; 3]) -> (LaneVec3<W>, LaneVec3<W>) {
    let low = LaneVec3 { x: a.x.min(b.x).min(c.x), y: a.y.min(b.y).min(c.y), z: a.z.min(b.z).min(c.z) };
    let high = LaneVec3 { x: a.x.max(b.x).max(c.x), y: a.y.max(b.y).max(c.y), z: a.z.max(b.z).max(c.z) };
    (low, high)
}

/// Lanes that are not too far, of the first `count`.
#[inline(always)]
fn near_lanes<W: Lanes<LEAF>>(distances: W, count: usize) -> u32 {
    W::splat(Real::MAX).if_above(distances, W::splat(1.0), W::ZERO).positive() & ((1 << count) - 1)
}

/// Triangles that a box meets on its way.
struct Along<'a, 'v, F> {
    surface: Surface<'a>,
    path: &'v Path,
    slabs: Slabs,
    visit: &'v mut F,
}

impl<'a, F: FnMut(&Part<'a>, Real) -> Real> Descent for Along<'a, '_, F> {
    #[inline(always)]
    fn distances<W: Lanes<LEAF>>(&self, low: &LaneVec3<W>, high: &LaneVec3<W>, limit: Real) -> W {
        self.slabs.enter(low, high, limit)
    }

    #[inline(always)]
    fn leaf<W: Lanes<LEAF>>(&mut self, first: usize, count: usize, limit: Real) -> Real {
        let corners = self.surface.corners_of_leaf::<W>(first, count);
        let (low, high) = boxes(&corners);
        let times = self.slabs.pass(&low, &high, limit);
        let one_sided = self.surface.sides() == MeshSides::One;
        let distances =
            self.path.solid.through_planes(&corners, times, (self.path.displacement, self.slabs.slack()), one_sided);
        let lanes = near_lanes(distances, count);
        visit_near(self.surface, first, (lanes, distances.to_array()), limit, |part, limit| (self.visit)(part, limit))
    }
}

impl Solid {
    /// When the solid is in the box of each triangle and in its plane, given the times at which it enters the box and
    /// leaves it; [`Real::MAX`] where it never is in both at once, or stays behind a one-sided triangle.
    #[inline(always)]
    fn through_planes<W: Lanes<LEAF>>(
        &self,
        [a, b, c]: &[LaneVec3<W>; 3],
        (enter, leave): (W, W),
        (displacement, slack): (Vec3, Real),
        one_sided: bool,
    ) -> W {
        let none = W::splat(Real::MAX);
        let (ab, ac) = (*b - *a, *c - *a);
        let normal = ab.cross(&ac);
        let length = normal.dot(&normal).sqrt();
        // The normal of a sliver has lost digits: what that does within reach of the triangle.
        let size = ab.dot(&ab) + ac.dot(&ac);
        let rounding = W::splat(4e-7) * size * (size.sqrt() + W::splat(self.reach()));
        let mut extent = W::splat(self.radius + 2.0 * slack) * length + rounding;
        for edge in self.edges {
            extent += normal.dot(&LaneVec3::splat(edge)).abs();
        }
        let height = normal.dot(&(LaneVec3::splat(self.middle) - *a));
        let rate = normal.dot(&LaneVec3::splat(displacement));
        // A plane along the way is in reach all the time (−∞ to ∞) or never (twice the same infinity).
        let (first, second) = ((-height - extent) / rate, (extent - height) / rate);
        let enter = first.min(second).max(enter);
        let leave = first.max(second).min(leave);
        let mut found = enter.if_above(leave * W::splat(1.0 + 1e-5), none, enter);
        if one_sided && self.is_rigid {
            let stays_behind = rate.if_positive(W::ZERO, -height - extent * W::splat(0.01));
            found = stays_behind.if_positive(none, found);
        }
        found
    }
}

/// What is just as near counts as well, the first in the list of all: squares of distances are off by less than this.
const ROUNDED: Real = 1.0 + 1e-6;

/// Triangles near a box.
struct Around<'a, 'v, F> {
    surface: Surface<'a>,
    aabb: &'v Aabb,
    visit: &'v mut F,
}

impl<'a, F: FnMut(&Part<'a>, Real) -> Real> Descent for Around<'a, '_, F> {
    #[inline(always)]
    fn distances<W: Lanes<LEAF>>(&self, low: &LaneVec3<W>, high: &LaneVec3<W>, limit: Real) -> W {
        box_distances(self.aabb, low, high, limit)
    }

    #[inline(always)]
    fn leaf<W: Lanes<LEAF>>(&mut self, first: usize, count: usize, limit: Real) -> Real {
        let (low, high) = boxes(&self.surface.corners_of_leaf::<W>(first, count));
        let distances = box_distances(self.aabb, &low, &high, limit);
        let lanes = near_lanes(distances, count);
        visit_near(self.surface, first, (lanes, distances.to_array()), limit, |part, limit| {
            let limit = (self.visit)(part, limit.sqrt());
            if limit < 0.0 { limit } else { limit * limit * ROUNDED }
        })
    }
}

/// Visits the triangles of some lanes of a leaf, nearest first, and returns the last limit.
#[inline]
fn visit_near<'a>(
    surface: Surface<'a>,
    first: usize,
    (mut lanes, distances): (u32, [Real; LEAF]),
    limit: Real,
    mut visit: impl FnMut(&Part<'a>, Real) -> Real,
) -> Real {
    let mut limit = limit;
    while lanes != 0 && limit >= 0.0 {
        let mut nearest = lanes.trailing_zeros() as usize % LEAF;
        let mut others = lanes & (lanes - 1);
        while others != 0 {
            let lane = others.trailing_zeros() as usize % LEAF;
            others &= others - 1;
            if distances[lane] < distances[nearest] {
                nearest = lane;
            }
        }
        lanes &= !(1 << nearest);
        if distances[nearest] > limit {
            break;
        }
        limit = crate::math::min(visit(&triangle(surface, first + nearest), limit), limit);
    }
    limit
}
