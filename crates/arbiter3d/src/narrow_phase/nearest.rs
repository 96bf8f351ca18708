//! Where two convex cores are nearest, or where they overlap least: closed forms first, a search where they do not
//! tell.
//!
//! Every answer is a direction `n` with a point of each core, held between two bounds of the separation (a gap, or a
//! depth with a minus): from below by the gap along `n`, which no two points can come closer than; from above by two
//! points of the cores as far apart, or by a point that lies as deep in one core as the overlap along `n`: a ball
//! around it shows that there is no shorter way out (see `penetration`). Where both bounds are the same the answer is
//! exact, wherever the guess is from:
//!
//! - **Faces.** The face of one core that looks at the other one, and the other one's lowest point over it. If that is
//!   over the face (and, if it is below its plane, farther from the sides than deep), the face's normal it is: what
//!   stands or lies on a box, or on the end of a can.
//! - **Lines.** Round sides that touch along lines which cross, or side by side: logs on logs.
//! - **Sides** of cylinders, cones and hulls of two balls, and the other core's lowest point over one of their lines:
//!   as for a face, once the line is found by Newton's method (`Seen::over_side`): a rim, a corner or an ellipsoid on a
//!   lying can.
//! - **Ellipsoids**, against each other and what has a known curvature: Newton's method (`distance::newton`). Balls
//!   that roll inside of the ellipsoids prove the height the least of all as long as it is less than their radii.
//!
//! And a direction along which the cores are apart by more than is asked for ends all of this at once. What is left is
//! searched for with `distance` and `penetration`.

use super::penetration::{Penetration, penetration};
use crate::shape::cores::{Belt, Core, Ellipsoid, smaller};
use crate::shape::distance::{Gap, Nearness, Placed, Settled, Simplex};
use glam::{DMat3, DVec2, DVec3};

/// Bounds this close, as a share of the depth, are the same.
const SAME: f64 = 1e-5;
/// A point is over a face although it is beyond its sides by this share of its distance from the origin.
const BESIDE: f64 = 1e-8;
/// Points on both sides that are a distance apart are on them within this share of how far they are from the middle of
/// core 2, which a rotation in single precision stretches.
const STRETCH: f64 = 1e-6;
/// Axes whose angle has a sine with a smaller square are parallel.
const PARALLEL: f64 = 1e-6;
/// Newton's method ends where the extreme difference is off the direction by less than this share of the rolling
/// radius: what is left of the height is the square of it.
const ALIGNED: f64 = 1e-5;
/// Newton's method about an axis may end with a turn of so many radians.
const STILL: f64 = 1e-6;
/// It takes three or four rounds, or does not work.
const SIDE_ROUNDS: usize = 8;

/// Where two cores are nearest, or overlap least, in the frame of shape 1.
#[derive(Clone, Copy, Debug)]
pub(super) struct Nearest {
    /// On the core of shape 1.
    pub point1: DVec3,
    /// Unit vector from shape 1 to shape 2.
    pub normal: DVec3,
    /// Negative where the cores overlap.
    pub distance: f64,
}

/// What a closed form tells.
enum Answer {
    Beyond,
    Found(Nearest),
    Open,
}

impl Answer {
    #[inline(always)]
    fn or_else(self, next: impl FnOnce() -> Self) -> Self {
        if let Self::Open = self { next() } else { self }
    }
}

/// `None` if the cores are apart by more than `limit` (zero or more).
pub(super) fn nearest(placed: &Placed<'_>, limit: f64) -> Option<Nearest> {
    let (first, second) = (Seen::from_first(placed), Seen::from_second(placed));
    let answer = first
        .over_face(limit)
        .or_else(|| second.over_face(limit))
        .or_else(|| across_sides(placed, limit))
        .or_else(|| first.over_side(limit))
        .or_else(|| second.over_side(limit))
        .or_else(|| between_ellipsoids(placed, limit));
    match answer {
        Answer::Beyond => return None,
        Answer::Found(found) => return Some(found),
        Answer::Open => {}
    }
    let mut simplex = Simplex::default();
    match placed.nearness_by(limit, &mut simplex) {
        Nearness::Beyond => None,
        Nearness::Gap(Gap { point1, way }) => {
            let distance = way.length();
            Some(Nearest { point1, normal: way / distance, distance })
        }
        Nearness::Overlap => {
            let Penetration { point1, normal, depth } = penetration(placed, &simplex);
            Some(Nearest { point1, normal, distance: -depth })
        }
    }
}

/// One core seen from the other one, in the frame of that.
struct Seen<'a> {
    placed: &'a Placed<'a>,
    core: &'a Core<'a>,
    other: &'a Core<'a>,
    /// Whether the own frame is that of shape 1.
    first: bool,
}

impl<'a> Seen<'a> {
    fn from_first(placed: &'a Placed<'a>) -> Self {
        let [core, other] = placed.cores();
        Self { placed, core, other, first: true }
    }

    fn from_second(placed: &'a Placed<'a>) -> Self {
        let [other, core] = placed.cores();
        Self { placed, core, other, first: false }
    }

    /// Takes a direction to the other core's frame.
    #[inline(always)]
    fn outward(&self, direction: DVec3) -> DVec3 {
        if self.first { self.placed.turn_back(direction) } else { self.placed.turn(direction) }
    }

    /// Takes a point from the other core's frame to the own one.
    #[inline(always)]
    fn inward(&self, point: DVec3) -> DVec3 {
        if self.first { self.placed.place(point) } else { self.placed.turn_back(point - self.placed.position()) }
    }

    /// Whether a plane of the own core with the other one's lowest point over it is the answer: where that is over the
    /// part of the surface that is in the plane, and as deep inside as below the plane.
    fn over_plane(&self, normal: DVec3, lowest: DVec3, distance: f64) -> Answer {
        let below = lowest - normal * distance;
        let is_least = if distance >= 0.0 {
            let slack = BESIDE * (lowest.x.abs() + lowest.y.abs() + lowest.z.abs());
            self.core.inner_depth(below, below, normal) >= -slack
        } else {
            self.core.inner_depth(lowest, below, normal) >= -distance * (1.0 - SAME)
        };
        if !is_least {
            return Answer::Open;
        }
        Answer::Found(if self.first {
            Nearest { point1: below, normal, distance }
        } else {
            Nearest { point1: self.placed.place(lowest), normal: -self.placed.turn(normal), distance }
        })
    }

    /// The face under the other core.
    fn over_face(&self, limit: f64) -> Answer {
        let Some((normal, offset)) = self.core.face_towards(self.inward(self.other.middle())) else {
            return Answer::Open;
        };
        let lowest = self.inward(self.other.support(self.outward(-normal)));
        let distance = lowest.dot(normal) - offset;
        if distance > limit { Answer::Beyond } else { self.over_plane(normal, lowest, distance) }
    }

    /// The inward normal of the other core's face that looks towards the own one.
    fn face_above(&self) -> Option<DVec3> {
        let middle = self.core.middle();
        let own =
            if self.first { self.placed.turn_back(middle - self.placed.position()) } else { self.placed.place(middle) };
        let (normal, _) = self.other.face_towards(own)?;
        Some(-if self.first { self.placed.turn(normal) } else { self.placed.turn_back(normal) })
    }

    /// The round side under the other core: Newton's method for the turn about the axis.
    ///
    /// The unit normal `n` of the side turns by an angle about y. With `n'` and `r = −n''` its derivatives and `x` the
    /// other core's lowest point, the height `offset − n · x` has the slope `−n' · x` and the second derivative `n' · K
    /// n' + r · x`, with `K` the second derivative of the other core's support function.
    fn over_side(&self, limit: f64) -> Answer {
        let Some(Belt { rise, offset }) = self.core.belt() else { return Answer::Open };
        let middle = self.inward(self.other.middle());
        let across = (middle.x * middle.x + middle.z * middle.z).sqrt();
        if across <= 0.0 {
            return Answer::Open;
        }
        let level = (1.0 - rise * rise).sqrt();
        let mut start = DVec2::new(middle.x / across, middle.z / across);
        if let Some(normal) = self.face_above() {
            // A rim turns fast about where its face is level: the search begins there.
            start = DVec2::new(normal.x, normal.z).try_normalize().unwrap_or(start);
        }
        let mut turn = Turn::new(start);
        for _ in 0..SIDE_ROUNDS {
            let DVec2 { x: cosine, y: sine } = turn.direction;
            let normal = DVec3::new(level * cosine, rise, level * sine);
            let back = self.outward(-normal);
            let touching = self.other.support(back);
            let lowest = self.inward(touching);
            let distance = lowest.dot(normal) - offset;
            if distance > limit {
                return Answer::Beyond;
            }
            let tangent = DVec3::new(-sine, 0.0, cosine);
            let turned = self.outward(tangent);
            let Some([bend, ..]) = self.other.curvature(touching, back, [turned, turned]) else { return Answer::Open };
            let bend = level * level * bend + level * (cosine * lowest.x + sine * lowest.z);
            if bend <= 0.0 {
                return Answer::Open;
            }
            let angle = level * tangent.dot(lowest) / bend;
            if angle.abs() <= STILL
                && let Answer::Found(found) = self.over_plane(normal, lowest, distance)
            {
                return Answer::Found(found);
            }
            turn.by(angle);
        }
        Answer::Open
    }
}

/// A direction in a plane between two bounds, once both are known.
struct Turn {
    direction: DVec2,
    /// It has to turn on from here, with a growing angle,
    low: Option<DVec2>,
    /// and back from here.
    high: Option<DVec2>,
}

impl Turn {
    fn new(direction: DVec2) -> Self {
        Self { direction, low: None, high: None }
    }

    /// Turns by a small angle; half way between the bounds where that would leave them.
    fn by(&mut self, angle: f64) {
        let from = self.direction;
        if angle > 0.0 {
            self.low = Some(from)
        } else {
            self.high = Some(from)
        }
        let mut to = from + from.perp() * angle;
        if let (Some(low), Some(high)) = (self.low, self.high)
            && !(low.perp_dot(to) > 0.0 && to.perp_dot(high) > 0.0)
        {
            to = low + high;
        }
        self.direction = to.normalize_or(DVec2::X);
    }
}

/// The round sides of both cores, where a line of one crosses a line of the other.
///
/// The normal has the height of either circle of normals along either axis; what is left of its length is square to
/// both.
fn across_sides(placed: &Placed<'_>, limit: f64) -> Answer {
    let [core1, core2] = placed.cores();
    let (Some(belt1), Some(belt2)) = (core1.belt(), core2.belt()) else { return Answer::Open };
    let (position, axis2) = (placed.position(), placed.turn(DVec3::Y).normalize());
    let (cosine, rise1, rise2) = (axis2.y, belt1.rise, -belt2.rise);
    let sine_squared = 1.0 - cosine * cosine;
    if sine_squared <= PARALLEL {
        return side_by_side(placed, limit);
    }
    let share2 = (rise2 - rise1 * cosine) / sine_squared;
    let level = DVec3::Y * (rise1 - share2 * cosine) + axis2 * share2;
    let rest = (1.0 - level.length_squared()) / sine_squared;
    if rest <= 0.0 {
        return Answer::Open;
    }
    let across = DVec3::Y.cross(axis2) * rest.sqrt();
    let normal = level + if across.dot(position) < 0.0 { -across } else { across };
    let corner = placed.corner(-normal);
    let gap = corner.difference.dot(normal);
    if gap > limit {
        return Answer::Beyond;
    }
    let distance = normal.dot(position) - belt1.offset - belt2.offset;
    let (line1, line2) = (DVec3::Y - normal * rise1, axis2 - normal * rise2);
    let along = corner.difference.cross(line2).dot(normal) / line1.cross(line2).dot(normal);
    let point1 = corner.point1 + line1 * along;
    if is_between(placed, point1, normal, (gap, distance)) {
        Answer::Found(Nearest { point1, normal, distance: gap })
    } else {
        Answer::Open
    }
}

/// The sides of two cylinders whose axes are parallel: half way along what they share.
fn side_by_side(placed: &Placed<'_>, limit: f64) -> Answer {
    let [core1, core2] = placed.cores();
    let (Some((length1, radius1)), Some((length2, radius2))) = (axis(core1), axis(core2)) else { return Answer::Open };
    let position = placed.position();
    let low = smaller(length1, length2 - position.y);
    let high = smaller(length1, length2 + position.y);
    let way = DVec3::new(position.x, 0.0, position.z);
    let length = way.length();
    if low + high <= 0.0 || length <= 0.0 {
        return Answer::Open;
    }
    let (normal, distance) = (way / length, length - radius1 - radius2);
    let gap = placed.corner(-normal).difference.dot(normal);
    if gap > limit {
        return Answer::Beyond;
    }
    let point1 = normal * radius1 + DVec3::Y * (0.5 * (high - low));
    if is_between(placed, point1, normal, (gap, distance)) {
        Answer::Found(Nearest { point1, normal, distance: gap })
    } else {
        Answer::Open
    }
}

/// Half the length and the radius of a cylinder or a segment.
fn axis(core: &Core<'_>) -> Option<(f64, f64)> {
    match core {
        Core::Segment(half_length) => Some((*half_length, 0.0)),
        Core::Cylinder { half_length, radius } => Some((*half_length, *radius)),
        _ => None,
    }
}

/// Whether a point on the side of core 1, and the one `distance` further along the normal on that of core 2, are those
/// that prove the gap (of both cores, along the normal) the largest; where it is negative, by the point half way
/// between them.
fn is_between(placed: &Placed<'_>, point1: DVec3, normal: DVec3, (gap, distance): (f64, f64)) -> bool {
    let [core1, core2] = placed.cores();
    let local = |point: DVec3| placed.turn_back(point - placed.position());
    let sum = |v: DVec3| v.x.abs() + v.y.abs() + v.z.abs();
    let length2 = axis(core2).map_or(0.0, |(half_length, _)| half_length);
    let slack = BESIDE * sum(point1) + STRETCH * (sum(point1 - placed.position()) + length2);
    if distance >= 0.0 {
        let point2 = local(point1 + normal * distance);
        return gap >= distance - slack
            && core1.inner_depth(point1, point1, normal) >= -slack
            && core2.inner_depth(point2, point2, normal) >= -slack;
    }
    let middle = point1 + normal * (0.5 * distance);
    let inner1 = core1.inner_depth(middle, middle, normal);
    let inner2 = core2.inner_depth(local(middle), middle, normal);
    inner1 >= 0.0 && inner2 >= 0.0 && inner1 + inner2 >= -gap * (1.0 - SAME)
}

/// An ellipsoid and what has a known curvature.
fn between_ellipsoids(placed: &Placed<'_>, limit: f64) -> Answer {
    let [core1, core2] = placed.cores();
    let (rolling, start) = match (core1, core2) {
        (Core::Ellipsoid(a), Core::Ellipsoid(b)) => (a.rolling + b.rolling, first_normal(placed, a, b)),
        (Core::Ellipsoid(a), _) | (_, Core::Ellipsoid(a)) => {
            let way = placed.place(core2.middle()) - core1.middle();
            (a.rolling, way.normalize_or(DVec3::Y))
        }
        _ => return Answer::Open,
    };
    let aligned = ALIGNED * rolling;
    match placed.settle(start, DVec3::ZERO, limit, |aside, _| aside <= aligned * aligned) {
        Settled::Beyond => Answer::Beyond,
        Settled::Open => Answer::Open,
        Settled::At { corner, normal, height, aside } => {
            // The ball that touches where the core is farthest reaches as far behind the origin, but for its share
            // aside.
            let beyond = rolling - height;
            let proved = height <= 0.0 || beyond > 0.0 && aside <= 2.0 * SAME * beyond * rolling;
            let found = Nearest { point1: corner.point1, normal, distance: -height };
            if proved { Answer::Found(found) } else { Answer::Open }
        }
    }
}

/// The normal where an ellipsoid, the sum of both about as large, would be met.
fn first_normal(placed: &Placed<'_>, a: &Ellipsoid, b: &Ellipsoid) -> DVec3 {
    let columns = [b.linear.x_axis, b.linear.y_axis, b.linear.z_axis].map(|column| placed.turn(column));
    let other = DMat3::from_cols(columns[0], columns[1], columns[2]);
    let sum = a.linear * a.linear.transpose() + other * other.transpose();
    let way = placed.place(b.center) - a.center;
    // The adjugate, as a length does not matter: no division, and no determinant that could vanish.
    let normal = DVec3::new(
        sum.y_axis.cross(sum.z_axis).dot(way),
        sum.z_axis.cross(sum.x_axis).dot(way),
        sum.x_axis.cross(sum.y_axis).dot(way),
    );
    normal.normalize_or(DVec3::Y)
}
