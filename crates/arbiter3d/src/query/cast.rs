//! Shapes that move past others: from one pose to another, until they touch.
//!
//! A shape that only moves along a line is cast by GJK on the moving difference (`shape::distance::linear_cast`), one that
//! turns as well by conservative advancement (`narrow_phase::time_of_impact`). Composites, on either side, are taken
//! part by part.
//!
//! A shape that overlaps at the start hits at fraction 0; how deep and along which normal is what the narrow phase says
//! of the two shapes as wholes. A one-sided triangle stops only shapes whose middle is in front of it when they touch,
//! as in contacts.

use super::pair::deepest_contact;
use super::parts::{Part, Path, Region, Solid, visit_parts};
use crate::math::{Pose, Real, Vec3, normalize_or};
use crate::narrow_phase::{Cast, CastPoint, Support, Sweep, closest, linear_cast, time_of_impact};
use crate::shape::Shape;

/// How far apart turning shapes count as touching, as a share of their reach.
const CONTACT: Real = 1e-5;
/// A shape that still spins close to a surface after so many rounds is stopped there, early.
const MAX_ROUNDS: usize = 256;
/// How far behind a one-sided triangle the middle of a shape may be that it stops, as a share of the shape's size.
const BEHIND: Real = 1e-3;

/// A shape that moves from one pose to another.
///
/// The origin of its frame moves straight and evenly, while the rotation blends the short way as in
/// [`Pose::interpolate`](crate::math::Pose::interpolate).
///
/// ```
/// use arbiter3d::{Shape, ShapeCast, math::{Pose, Vec3}};
/// let ball = Shape::sphere(0.5)?;
/// let drop = ShapeCast::along(&ball, Pose::from_position(Vec3::Y * 5.0), Vec3::Y * -10.0);
/// assert_eq!(drop.at(0.5).position, Vec3::ZERO);
/// # Ok::<(), arbiter3d::ShapeError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct ShapeCast<'a> {
    /// What moves. Any shape; one made of many parts costs as many casts.
    pub shape: &'a Shape,
    /// Where it starts, world.
    pub start: Pose,
    /// Where it ends, world.
    pub end: Pose,
}

impl<'a> ShapeCast<'a> {
    /// A shape that moves by `displacement` without turning, metres.
    #[must_use]
    pub fn along(shape: &'a Shape, start: Pose, displacement: Vec3) -> Self {
        Self { shape, start, end: Pose::new(start.position + displacement, start.rotation) }
    }

    /// A shape that moves from one pose to another.
    #[must_use]
    pub fn between(shape: &'a Shape, start: Pose, end: Pose) -> Self {
        Self { shape, start, end }
    }

    /// Where the shape is at a fraction of the way.
    #[must_use]
    pub fn at(&self, fraction: Real) -> Pose {
        self.start.interpolate(&self.end, fraction)
    }
}

/// Where a moving shape first touches another, world.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Impact {
    pub fraction: Real,
    /// On the surface of the other shape.
    pub point: Vec3,
    /// Unit normal of the other shape's surface, towards the moving shape.
    pub normal: Vec3,
    /// How deep the shapes overlap at the start.
    pub depth: Real,
    pub child: Option<u32>,
    pub triangle: Option<u32>,
}

/// A cast made ready for many shapes.
pub(crate) struct Mover<'a> {
    shape: &'a Shape,
    start: Pose,
    end: Pose,
    displacement: Vec3,
    turns: bool,
    /// The convex parts of the shape and where they are in its frame.
    parts: Parts<'a>,
    /// Middle of the shape's box, in its frame.
    middle: Vec3,
    /// Half the length of the diagonal of that box: the measure of what is small.
    size: Real,
    /// Distance of the farthest point from the origin of the frame.
    reach: Real,
}

enum Parts<'a> {
    One(Support<'a>),
    Many(Vec<(Support<'a>, Pose)>),
}

impl<'a> Mover<'a> {
    pub(crate) fn new(cast: &ShapeCast<'a>) -> Self {
        let shape = cast.shape;
        let around = shape.local_aabb();
        let parts = Support::new(shape).map_or_else(
            || {
                let mut parts = Vec::new();
                visit_parts(shape, &Region::Box(around), |part, limit| {
                    parts.push((part.support, part.pose.unwrap_or(Pose::IDENTITY)));
                    limit
                });
                Parts::Many(parts)
            },
            Parts::One,
        );
        let turned = cast.start.rotation.dot(cast.end.rotation).abs() < 1.0 - 1e-6
            || (cast.start.rotation.vector() - cast.end.rotation.vector()).length_squared() > 1e-12
                && (cast.start.rotation.vector() + cast.end.rotation.vector()).length_squared() > 1e-12;
        Self {
            shape,
            start: cast.start,
            end: cast.end,
            displacement: cast.end.position - cast.start.position,
            turns: turned && !matches!(shape, Shape::Sphere(_)),
            parts,
            middle: around.center(),
            size: around.half_extents().length(),
            reach: shape.reach(),
        }
    }

    /// Middle and half extents of a box around the shape, with the axes of a frame, that goes with it on its way.
    pub(crate) fn bounds_from(&self, frame: &Pose) -> (Vec3, Vec3) {
        let start = frame.relative(&self.start);
        if self.turns {
            (start.position, Vec3::splat(self.reach))
        } else {
            let aabb = self.shape.aabb(&start);
            (aabb.center(), aabb.half_extents())
        }
    }

    /// Its way in a frame.
    fn path(&self, frame: &Pose, limit: Real) -> Path {
        let (center, half) = self.bounds_from(frame);
        let start = frame.relative(&self.start);
        let solid = if self.turns {
            Solid { radius: self.reach, ..Solid::point(center) }
        } else {
            let (half, radius) = match self.shape {
                Shape::Sphere(ball) => (Vec3::ZERO, ball.radius()),
                Shape::Capsule(capsule) => (Vec3::Y * capsule.half_length(), capsule.radius()),
                other => (other.local_aabb().half_extents(), 0.0),
            };
            let axes = start.rotation.to_mat3();
            let edges = [axes.x_axis * half.x, axes.y_axis * half.y, axes.z_axis * half.z];
            Solid { middle: start.transform_point(self.middle), edges, radius, is_rigid: true }
        };
        Path { center, half, displacement: frame.rotation.inverse_rotate(self.displacement), limit, solid }
    }

    /// How far it goes.
    pub(crate) fn displacement(&self) -> Vec3 {
        self.displacement
    }

    /// Where it first touches a shape placed in the world by `pose`, up to the share `limit` of its way.
    pub(crate) fn cast(&self, shape: &Shape, pose: &Pose, limit: Real) -> Option<Impact> {
        let path = self.path(pose, limit);
        let displacement = path.displacement;
        let mut search = Search {
            mover: self,
            start: pose.relative(&self.start),
            end: pose.relative(&self.end),
            displacement,
            best: None,
            overlaps: None,
        };
        match &self.parts {
            Parts::One(support) => {
                visit_parts(shape, &Region::Path(path), |part, limit| search.visit(part, (support, None), limit));
            }
            Parts::Many(parts) => {
                for (support, own) in parts {
                    let reach = search.best.map_or(limit, |(hit, ..)| hit.fraction);
                    let region = Region::Path(Path { limit: reach, ..path });
                    visit_parts(shape, &region, |part, limit| search.visit(part, (support, Some(own)), limit));
                }
            }
        }
        if let Some(ids) = search.overlaps {
            return Some(self.overlap_at_start(shape, pose, ids));
        }
        search.best.map(|(hit, child, triangle)| Impact {
            fraction: hit.fraction,
            point: pose.transform_point(hit.point1),
            normal: pose.rotation.rotate(hit.normal),
            depth: 0.0,
            child,
            triangle,
        })
    }

    /// What the narrow phase says of an overlap; failing that, back where it came from.
    fn overlap_at_start(&self, shape: &Shape, pose: &Pose, (child, triangle): (Option<u32>, Option<u32>)) -> Impact {
        let found = deepest_contact(shape, self.shape, &pose.relative(&self.start));
        if let Some(contact) = found {
            let (point, normal) = (pose.transform_point(contact.point1), pose.rotation.rotate(contact.normal));
            let depth = crate::math::max(-contact.separation, 0.0);
            return Impact { fraction: 0.0, point, normal, depth, child, triangle };
        }
        let middle = self.start.transform_point(self.middle);
        let normal = normalize_or(-self.displacement, normalize_or(middle - pose.position, Vec3::Y));
        Impact { fraction: 0.0, point: middle, normal, depth: 0.0, child, triangle }
    }
}

/// A cast against one shape, in its frame.
struct Search<'m, 'a> {
    mover: &'m Mover<'a>,
    start: Pose,
    end: Pose,
    displacement: Vec3,
    best: Option<(CastPoint, Option<u32>, Option<u32>)>,
    overlaps: Option<(Option<u32>, Option<u32>)>,
}

impl Search<'_, '_> {
    /// Casts a part of the mover against a part of the shape; returns how far is of interest from now on.
    fn visit(&mut self, part: &Part, (support, own): (&Support, Option<&Pose>), limit: Real) -> Real {
        let (mover, size) = (self.mover, self.mover.size);
        let start = part.seen(&self.start);
        let placed = own.map_or(start, |own| start.mul(own));
        let found = if mover.turns {
            let end = part.seen(&self.end);
            let pivot = own.map_or(Vec3::ZERO, |own| own.inverse().position);
            let end = own.map_or(end, |own| end.mul(own));
            turning_cast(&part.support, support, &Sweep { start: placed, end, pivot }, limit)
        } else {
            linear_cast((&part.support, support), &placed, part.vector_in(self.displacement), limit, size)
        };
        match found {
            Cast::Miss => limit,
            Cast::Overlap => {
                if self.overlaps.is_some() || !part.faces(start.transform_point(mover.middle), BEHIND * size) {
                    return limit;
                }
                self.overlaps = Some((part.child, part.triangle));
                -1.0
            }
            Cast::Hit(hit) => {
                let at = self.start.interpolate(&self.end, hit.fraction);
                if !part.faces(part.seen(&at).transform_point(mover.middle), BEHIND * size) {
                    return limit;
                }
                let ids = (part.child, part.triangle);
                let first = self.best.is_none_or(|(best, child, triangle)| {
                    hit.fraction < best.fraction || hit.fraction == best.fraction && ids < (child, triangle)
                });
                if first {
                    let point1 = part.point_out(hit.point1);
                    let hit = CastPoint { point1, normal: part.vector_out(hit.normal), ..hit };
                    self.best = Some((hit, ids.0, ids.1));
                }
                crate::math::min(hit.fraction, limit)
            }
        }
    }
}

/// A shape that turns on its way, against one that stands still in the frame of the sweep.
fn turning_cast(still: &Support, support: &Support, sweep: &Sweep, limit: Real) -> Cast {
    let apart = closest(still, support, &swept(sweep, 0.0)).is_some_and(|found| found.gap(still, support) > 0.0);
    if !apart {
        return Cast::Overlap;
    }
    let target = CONTACT * support.reach(sweep.pivot);
    let stop = time_of_impact(still, &Sweep::still(Pose::IDENTITY), support, sweep, target);
    let fraction = stop.and_then(|stop| approach((still, support), sweep, stop, target));
    let Some(fraction) = fraction.filter(|&fraction| fraction <= limit) else { return Cast::Miss };
    // Where rounding has the cores overlap there is no normal: a moment earlier there is.
    let mut back = 0.0;
    loop {
        let time = crate::math::max(fraction - back, 0.0);
        if let Some(found) = closest(still, support, &swept(sweep, time)) {
            let point1 = found.point1 + found.normal * still.radius();
            return Cast::Hit(CastPoint { fraction, normal: found.normal, point1 });
        }
        back = crate::math::max(2.0 * back, 1e-6);
    }
}

/// Goes on from a time that may be early, for a shape that spins close to a surface, until the gap is the target's;
/// `None` if it never is. By the same bound of the speed as in `time_of_impact`.
fn approach((still, support): (&Support, &Support), sweep: &Sweep, from: Real, target: Real) -> Option<Real> {
    let (p, q) = (sweep.start.rotation, sweep.end.rotation);
    let sign = if p.dot(q) < 0.0 { -1.0 } else { 1.0 };
    let spin = q.mul(p.conjugate()).vector() * (sign * 4.0 / (1.0 + p.dot(q).abs()));
    let displacement = sweep.end.transform_point(sweep.pivot) - sweep.start.transform_point(sweep.pivot);
    let reach = support.reach(sweep.pivot);
    let mut time = from;
    for _ in 0..MAX_ROUNDS {
        let Some(found) = closest(still, support, &swept(sweep, time)) else { return Some(time) };
        let gap = found.gap(still, support);
        if gap <= 2.0 * target {
            return Some(time);
        }
        let speed = reach * spin.cross(found.normal).length() - displacement.dot(found.normal);
        let next = time + (gap - target) / speed;
        if speed <= 0.0 || next > 1.0 {
            return None;
        }
        if next <= time {
            return Some(time);
        }
        time = next;
    }
    Some(time)
}

/// Where a sweep is at a time: its pivot moves straight, not the origin of its frame.
fn swept(sweep: &Sweep, time: Real) -> Pose {
    let rotation = sweep.start.interpolate(&sweep.end, time).rotation;
    let from = sweep.start.transform_point(sweep.pivot);
    let pivot = from + (sweep.end.transform_point(sweep.pivot) - from) * time;
    Pose::new(pivot - rotation.rotate(sweep.pivot), rotation)
}
