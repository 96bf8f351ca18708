//! When two moving convex shapes first come within a given distance: conservative advancement.
//!
//! At time `t` let the gap be `d` along the unit normal `n` of the closest points. A plane square to `n` separates the
//! shapes, and no point crosses it faster than
//!
//! ```text
//! speed ≤ (v1 − v2) · n + swing1 |ω1 × n| + swing2 |ω2 × n|
//! ```
//!
//! with the swing of a shape how far its core reaches from the axis about which it turns (the core: what is round is
//! a ball at each of its points, and balls may turn as they like). So
//! the gap stays above `target` for at least `(d − target) / speed`: the time goes on by that much, and the
//! distance is taken anew, until it is the target's (Mirtich, "Impulse-based Dynamic Simulation", 1996, section 2.3).
//! Nothing can be jumped over, however thin it is and however fast the shapes are. Positions move evenly; rotations
//! blend as in [`Pose::interpolate`], about one axis, at most `4 tan(φ / 2)` radians per unit of time with `cos φ` the
//! dot product of the quaternions.
//!
//! Positions are subtracted in `f64` before they are rounded, so sweeps far from the origin lose nothing more.

use crate::math::{Pose, Real, Vec3, max, min};
use crate::shape::Support;
use crate::shape::distance::closest;
use glam::DVec3;

/// The time found so far is given back after this many rounds: early, never late.
const MAX_ROUNDS: usize = 64;
/// Hit when the gap is above the target by no more than this share of it.
const TOLERANCE: Real = 0.1;

/// The motion of a shape in a step: from one pose to another, blended by [`Pose::interpolate`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sweep {
    pub start: Pose,
    pub end: Pose,
    /// The point of the shape, in its frame, that moves evenly along a straight line while the rest turns about it: its
    /// middle, however far that is from the origin of the frame.
    pub pivot: Vec3,
}

impl Sweep {
    /// A shape that does not move.
    pub(crate) fn still(pose: Pose) -> Self {
        Self { start: pose, end: pose, pivot: Vec3::ZERO }
    }

    /// Where the pivot is at the start.
    fn from(&self) -> DVec3 {
        self.start.position.as_dvec3() + self.start.rotation.rotate(self.pivot).as_dvec3()
    }

    /// How far the pivot moves.
    fn displacement(&self) -> DVec3 {
        self.end.position.as_dvec3() + self.end.rotation.rotate(self.pivot).as_dvec3() - self.from()
    }

    /// Axis of the turn in world space, as long as the largest angular speed (radians per unit of time).
    fn spin(&self) -> Vec3 {
        let (p, q) = (self.start.rotation, self.end.rotation);
        let sign = if p.dot(q) < 0.0 { -1.0 } else { 1.0 };
        // q p*: its vector part is sin φ times the axis. 4 tan(φ/2) = 4 sin φ / (1 + cos φ) needs no root and no
        // difference.
        let turn = q.mul(p.conjugate()).vector() * sign;
        turn * (4.0 / (1.0 + p.dot(q).abs()))
    }

    /// [`Self::spin`] times how far the core reaches from the axis.
    fn swing_of(&self, shape: &Support) -> Vec3 {
        let spin = self.spin();
        let speed = spin.length();
        if speed == 0.0 {
            return Vec3::ZERO;
        }
        // The axis is the same at the end: it is what does not turn.
        spin * shape.swing(self.pivot, self.start.rotation.inverse_rotate(spin / speed))
    }
}

/// Shape 2 in the frame of shape 1, as a function of time.
struct Motion<'a> {
    sweep1: &'a Sweep,
    sweep2: &'a Sweep,
    apart: DVec3,
    displacement: DVec3,
}

impl<'a> Motion<'a> {
    fn new(sweep1: &'a Sweep, sweep2: &'a Sweep) -> Self {
        let apart = sweep2.from() - sweep1.from();
        Self { sweep1, sweep2, apart, displacement: sweep2.displacement() - sweep1.displacement() }
    }

    /// Pose of shape 1 (its rotation alone counts), and of shape 2 in its frame.
    fn at(&self, t: Real) -> (Pose, Pose) {
        let (pose1, pose2) =
            (self.sweep1.start.interpolate(&self.sweep1.end, t), self.sweep2.start.interpolate(&self.sweep2.end, t));
        let between = (self.apart + self.displacement * f64::from(t)).as_vec3();
        let turned = pose1.rotation.conjugate().mul(pose2.rotation);
        let pivot1 = pose1.rotation.inverse_rotate(between) + self.sweep1.pivot;
        let relative = Pose::new(pivot1 - turned.rotate(self.sweep2.pivot), turned);
        (pose1, relative)
    }
}

/// When and how two moving shapes come to touch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Touch {
    /// Share of the motion.
    pub time: Real,
    /// Unit vector from shape 1 to shape 2, world.
    pub normal: Vec3,
}

/// How two moving shapes come near each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Approach {
    /// They overlap at the start: they have a touching contact, which is for the solver to part.
    Overlap,
    /// They never come as near as asked.
    Miss,
    Touch(Touch),
}

/// The first time in `[0, 1]` at which the gap of two moving shapes falls to `target` (metres, about a tenth more
/// counts), if it ever does.
///
/// Shapes that start apart but within `target` are stopped where half of that first gap is left, so that one that slides
/// along another is not held. After [`MAX_ROUNDS`] rounds (fast spin close to a surface) the time reached is given
/// back: nothing is ever missed, a stop may be early.
pub(crate) fn approach(shape1: &Support, sweep1: &Sweep, shape2: &Support, sweep2: &Sweep, target: Real) -> Approach {
    let motion = Motion::new(sweep1, sweep2);
    let radii = shape1.radius() + shape2.radius();
    let (spin1, spin2) = (sweep1.swing_of(shape1), sweep2.swing_of(shape2));
    let rounding = 1e-6 * max(shape1.reach(sweep1.pivot), shape2.reach(sweep2.pivot));
    let mut target = target;
    let mut touch = Touch { time: 0.0, normal: Vec3::ZERO };
    for round in 0..MAX_ROUNDS {
        let t = touch.time;
        let (pose1, relative) = motion.at(t);
        let found = closest(shape1, shape2, &relative);
        let gap = found.map_or(-1.0, |c| c.distance - radii);
        let Some(found) = found.filter(|_| gap > 0.0) else {
            // Past the start this is rounding: the gap was there a moment ago.
            return if round == 0 { Approach::Overlap } else { Approach::Touch(touch) };
        };
        let normal = pose1.rotation.rotate(found.normal);
        touch.normal = normal;
        if round == 0 {
            target = min(0.5 * gap, target);
        } else if gap <= target + max(TOLERANCE * target, rounding) {
            return Approach::Touch(touch);
        }
        let closing = -(motion.displacement.dot(normal.as_dvec3())) as Real;
        let speed = closing + spin1.cross(normal).length() + spin2.cross(normal).length();
        if speed <= 0.0 {
            return Approach::Miss;
        }
        let next = t + (gap - target) / speed;
        if next >= 1.0 {
            return Approach::Miss;
        }
        if next <= t {
            return Approach::Touch(touch);
        }
        touch.time = next;
    }
    Approach::Touch(touch)
}

/// The time of the touch that [`approach`] finds.
pub(crate) fn time_of_impact(
    shape1: &Support,
    sweep1: &Sweep,
    shape2: &Support,
    sweep2: &Sweep,
    target: Real,
) -> Option<Real> {
    match approach(shape1, sweep1, shape2, sweep2, target) {
        Approach::Touch(touch) => Some(touch.time),
        Approach::Overlap | Approach::Miss => None,
    }
}

/// Gap of two shapes, `pose` placing shape 2 in the frame of shape 1; zero or less where they overlap.
pub(crate) fn gap(shape1: &Support, shape2: &Support, pose: &Pose) -> Real {
    closest(shape1, shape2, pose).map_or(-1.0, |found| found.distance - shape1.radius() - shape2.radius())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rotation;
    use crate::shape::Shape;

    const SLOP: Real = 0.005;

    fn slide(from: Vec3, to: Vec3) -> Sweep {
        Sweep { start: Pose::from_position(from), end: Pose::from_position(to), pivot: Vec3::ZERO }
    }

    fn impact(a: &Shape, sweep: &Sweep, b: &Shape, pose: Pose) -> Option<Real> {
        let (a, b) = (Support::new(a).unwrap(), Support::new(b).unwrap());
        let found = time_of_impact(&a, sweep, &b, &Sweep::still(pose), SLOP);
        let swapped = time_of_impact(&b, &Sweep::still(pose), &a, sweep, SLOP);
        match (found, swapped) {
            (Some(x), Some(y)) => assert!((x - y).abs() < 1e-3),
            _ => assert_eq!(found, swapped),
        }
        found
    }

    /// A 5 cm ball at 200 m/s covers 3.3 m in a 1/60 s step: 330 times the thickness of the wall.
    #[test]
    fn a_bullet_never_passes_a_thin_wall() {
        let ball = Shape::sphere(0.05).unwrap();
        let wall = Shape::cuboid(Vec3::new(0.005, 2.0, 2.0)).unwrap();
        for k in 0..100 {
            let offset = Vec3::new(0.0, -1.9 + 0.035 * k as Real, 0.3);
            let start = -0.2 - 0.03 * k as Real;
            let sweep = slide(offset + Vec3::X * start, offset + Vec3::new(start + 3.333, 0.2, 0.0));
            let t = impact(&ball, &sweep, &wall, Pose::IDENTITY).unwrap();
            let gap = -(start + 3.333 * t) - 0.055;
            assert!((SLOP * 0.99..SLOP * 1.2).contains(&gap), "{k} {gap}");
        }
    }

    /// A crate as a hull whose points are 40 m from its frame's origin, tumbling, hits when the same crate about its own
    /// origin does, and as soon.
    #[test]
    fn a_hull_far_from_its_frame_hits_like_one_in_the_middle_of_it() {
        let far = Vec3::new(30.0, 20.0, 17.0);
        let corners = |at: Vec3| -> Vec<Vec3> {
            let corner = |i: u8| Vec3::from([i & 1, i >> 1 & 1, i >> 2].map(|b| Real::from(b) - 0.5));
            (0..8u8).map(|i| corner(i) + at).collect()
        };
        let (near, away) = (Shape::hull(&corners(Vec3::ZERO)).unwrap(), Shape::hull(&corners(far)).unwrap());
        let wall = Shape::cuboid(Vec3::new(0.005, 9.0, 9.0)).unwrap();
        for k in 0..20 {
            let turned = Rotation::from_xyzw(0.1 * k as Real, 0.2, 0.3, 1.0).normalize();
            let (start, end) = (Pose::from_position(Vec3::X * -2.0), Pose::new(Vec3::new(1.0, 0.3, 0.0), turned));
            let centred = Sweep { start, end, pivot: Vec3::ZERO };
            let shifted = |pose: Pose| Pose::new(pose.position - pose.rotation.rotate(far), pose.rotation);
            let offset = Sweep { start: shifted(start), end: shifted(end), pivot: far };
            let expected = impact(&near, &centred, &wall, Pose::IDENTITY).unwrap();
            let found = impact(&away, &offset, &wall, Pose::IDENTITY).unwrap();
            assert!((expected - found).abs() < 1e-3, "{k}: {found}, not {expected}");
        }
        let about = |pivot: Vec3| Support::new(&away).unwrap().reach(pivot);
        assert!(about(far) < 0.87 && about(Vec3::ZERO) > 39.0);
    }

    /// The same far from the origin, where a step of `f32` is a millimetre.
    #[test]
    fn a_bullet_stops_at_a_wall_ten_kilometres_away() {
        let ball = Shape::sphere(0.05).unwrap();
        let wall = Shape::cuboid(Vec3::new(0.005, 2.0, 2.0)).unwrap();
        let far = Vec3::new(1e4, -2e4, 3e4);
        let sweep = slide(far - Vec3::X, far + Vec3::X * 2.0);
        let t = impact(&ball, &sweep, &wall, Pose::from_position(far)).unwrap();
        assert!((t - (1.0 - 0.055 - SLOP) / 3.0).abs() < 1e-3, "{t}");
    }

    #[test]
    fn what_flies_past_or_away_or_overlaps_already_has_no_impact() {
        let (ball, cube) = (Shape::sphere(0.5).unwrap(), Shape::cuboid(Vec3::ONE).unwrap());
        assert_eq!(
            impact(&ball, &slide(Vec3::new(-5.0, 1.6, 0.0), Vec3::new(5.0, 1.6, 0.0)), &cube, Pose::IDENTITY),
            None
        );
        assert_eq!(impact(&ball, &slide(Vec3::X * 2.0, Vec3::X * 9.0), &cube, Pose::IDENTITY), None);
        assert_eq!(impact(&ball, &slide(Vec3::X * 9.0, Vec3::X * 2.0), &cube, Pose::IDENTITY), None);
        assert_eq!(impact(&ball, &slide(Vec3::X * 1.4, Vec3::X * -9.0), &cube, Pose::IDENTITY), None);
    }

    /// A ball that rolls over the floor at half the slop is not held; one that dives into it is.
    #[test]
    fn within_the_slop_only_an_approach_counts() {
        let (ball, floor) = (Shape::sphere(0.5).unwrap(), Shape::cuboid(Vec3::new(50.0, 1.0, 50.0)).unwrap());
        let start = Vec3::new(0.0, 1.5 + 0.5 * SLOP, 0.0);
        assert_eq!(impact(&ball, &slide(start, start + Vec3::X * 5.0), &floor, Pose::IDENTITY), None);
        let t = impact(&ball, &slide(start, start + Vec3::new(5.0, -2.0, 0.0)), &floor, Pose::IDENTITY).unwrap();
        assert!(t > 0.0 && t < 1e-3, "{t}");
    }

    /// A rod of length 2 turns a quarter about its middle beside a wall at 0.5: it hits where its end is 0.5 out, at
    /// 30°.
    #[test]
    fn a_turning_rod_hits_with_its_end() {
        let rod = Shape::capsule(1.0, 0.01).unwrap();
        let wall = Shape::cuboid(Vec3::new(0.1, 5.0, 5.0)).unwrap();
        let half = libm::sqrtf(0.5);
        let sweep = Sweep {
            start: Pose::IDENTITY,
            end: Pose::new(Vec3::ZERO, Rotation::from_xyzw(0.0, 0.0, -half, half)),
            pivot: Vec3::ZERO,
        };
        let t = impact(&rod, &sweep, &wall, Pose::from_position(Vec3::new(0.6, 0.0, 0.0))).unwrap();
        let end = sweep.start.interpolate(&sweep.end, t).rotation.rotate(Vec3::Y);
        let gap = 0.5 - end.x - 0.01;
        assert!((SLOP * 0.99..SLOP * 1.2).contains(&gap), "{gap}");
    }

    /// Box tumbling at a triangle, against small steps in time.
    #[test]
    fn a_tumbling_box_stops_at_a_triangle_where_small_steps_find_it() {
        let cube = Shape::cuboid(Vec3::new(0.3, 0.2, 0.1)).unwrap();
        let cube = Support::new(&cube).unwrap();
        let triangle =
            Support::Triangle([Vec3::new(-3.0, 0.0, -3.0), Vec3::new(0.0, 0.0, 4.0), Vec3::new(3.0, 0.0, -3.0)]);
        for k in 0..50 {
            let q = |i: i32| {
                Rotation::from_xyzw((i * k % 7) as Real - 3.0, (k % 5) as Real, (i + k % 3) as Real, 4.0).normalize()
            };
            let end = Vec3::new(0.02 * k as Real, -1.5, 0.1);
            let start = Pose::new(Vec3::new(0.0, 1.0, 0.0), q(1));
            let sweep = Sweep { start, end: Pose::new(end, q(2)), pivot: Vec3::ZERO };
            let t = time_of_impact(&cube, &sweep, &triangle, &Sweep::still(Pose::IDENTITY), SLOP).unwrap();
            let gap = |t: Real| {
                let pose = sweep.start.interpolate(&sweep.end, t);
                closest(&triangle, &cube, &pose).map_or(0.0, |c| c.distance)
            };
            assert!((SLOP * 0.99..SLOP * 1.2).contains(&gap(t)), "{}", gap(t));
            for step in 0..1000 {
                assert!(gap(t * step as Real / 1000.0) > SLOP * 0.99);
            }
        }
    }
}
