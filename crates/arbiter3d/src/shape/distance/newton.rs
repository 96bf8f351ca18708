//! Newton's method for the direction in which two cores are farthest apart, or overlap least.
//!
//! The height of the differences `x1 − x2` along a unit vector `n` is `h = n · w`, with `w` the farthest one. With `K`
//! the sum of the second derivatives of both cores' support functions (`cores`) it changes by `w · t + t · (K − h) t /
//! 2` when `n` turns by a small `t` square to it. Its lowest value is the depth, or for cores that are apart the
//! distance with a minus; there `w` lies along `n`. Near it three rounds do, where the search on simplices needs the
//! more the rounder the cores are beside the gap. It fails (which is told, and costs little) where lines or faces
//! touch.

use super::{Corner, Placed};
use glam::DVec3;

/// It takes three or four rounds from near by.
const ROUNDS: usize = 7;
/// The direction turns by at most the angle with this tangent.
const LONGEST_TURN: f64 = 0.7;

/// How the method ends.
pub(crate) enum Settled {
    /// The cores are apart by more than was asked for.
    Beyond,
    At {
        /// Of the differences `x2 − x1`, the farthest against the normal.
        corner: Corner,
        normal: DVec3,
        height: f64,
        /// Square of how far the corner is off the normal.
        aside: f64,
    },
    /// It does not work here.
    Open,
}

impl Placed<'_> {
    /// Begins with the direction `normal`, shape 2 being moved by `shift`, and ends where `is_settled` for the square
    /// of how far the corner is off the normal and for the height.
    pub(crate) fn settle(
        &self,
        mut normal: DVec3,
        shift: DVec3,
        limit: f64,
        is_settled: impl Fn(f64, f64) -> bool,
    ) -> Settled {
        let mut last = f64::MAX;
        for _ in 0..ROUNDS {
            let mut corner = self.corner(-normal);
            let point2 = corner.point1 + corner.difference;
            corner.difference += shift;
            let height = -corner.difference.dot(normal);
            if -height > limit {
                return Settled::Beyond;
            }
            let tangents = tangents(normal);
            let slope = tangents.map(|t| -corner.difference.dot(t));
            let aside = slope[0] * slope[0] + slope[1] * slope[1];
            if is_settled(aside, height) {
                return Settled::At { corner, normal, height, aside };
            }
            if aside > 0.5 * last {
                return Settled::Open;
            }
            last = if last == f64::MAX { 4.0 * aside } else { aside };
            let Some(curvature) = self.curvature(normal, tangents, (corner.point1, point2)) else {
                return Settled::Open;
            };
            let Some(turn) = turn(curvature, height, slope) else { return Settled::Open };
            normal = (normal + tangents[0] * turn[0] + tangents[1] * turn[1]).normalize();
        }
        Settled::Open
    }

    /// Of both support functions, along two tangents.
    fn curvature(&self, normal: DVec3, tangents: [DVec3; 2], (point1, point2): (DVec3, DVec3)) -> Option<[f64; 3]> {
        let own = self.cores[0].curvature(point1, normal, tangents)?;
        let local = self.turn_back(point2 - self.position);
        let [t1, t2] = tangents;
        let back = [self.turn_back(t1), self.turn_back(t2)];
        let other = self.cores[1].curvature(local, self.turn_back(-normal), back)?;
        Some([own[0] + other[0], own[1] + other[1], own[2] + other[2]])
    }
}

/// By how much the direction is to turn along both tangents; `None` where the height is not convex around it.
fn turn([k11, k12, k22]: [f64; 3], height: f64, [s1, s2]: [f64; 2]) -> Option<[f64; 2]> {
    let (k11, k22) = (k11 - height, k22 - height);
    let determinant = k11 * k22 - k12 * k12;
    if !(k11 > 0.0 && determinant > 0.0) {
        return None;
    }
    let turn = [(k12 * s2 - k22 * s1) / determinant, (k12 * s1 - k11 * s2) / determinant];
    let length = (turn[0] * turn[0] + turn[1] * turn[1]).sqrt();
    Some(if length > LONGEST_TURN { turn.map(|t| t * (LONGEST_TURN / length)) } else { turn })
}

/// Two unit vectors square to a unit vector and to each other.
///
/// [`crate::math::tangents`] does the same in single precision, branch-free for the solver's lanes. Any pair serves here, but
/// that formula in `f64` would give other last bits to contacts of round shapes, and save nothing: what counts is the support
/// map that is asked between two calls.
pub(crate) fn tangents(normal: DVec3) -> [DVec3; 2] {
    let axis = if normal.x.abs() > 0.6 { DVec3::Y } else { DVec3::X };
    let first = normal.cross(axis).normalize();
    [first, normal.cross(first)]
}
