//! One-way platforms: bodies pass through along a direction, and stand on them from the other side.
//!
//! Whether a body passes is decided where its contact would begin, and holds until the pair is apart again. With `d`
//! the direction in which bodies pass, `n` the contact normal from the platform to the body, and `v` the velocity of
//! the body there against the platform:
//!
//! - It *stands* when some `n · d` is above a tenth, unless it comes up at such a speed that it may have come through within
//!   the step.
//! - Else it *waits* when no point of it is lower, along `d`, than the top of the platform, but for the speculative
//!   distance: a body that slides from one platform to the next meets the side of that one for an instant. It has no contact
//!   in this step, and is judged again in the next one.
//! - Else it *passes*. It has no contact until no point of the shapes overlaps any more.
//!
//! An arbiter that has begun is solid for its life. All is measured against the platform, so a moving one works alike.

use super::pairs::{BORNE, HITS, ONE_WAY, PASSING, PERSIST, PRE_SOLVE, Pair};
use super::shapes::{ShapeRef, ShapeSlot};
use crate::math::{Pose, Real, Rotation, Vec3};
use crate::shape::Shape;

/// Least cosine between a normal and the direction at which a body stands: 84°.
const LEAST_RISE: Real = 0.1;

/// A contact as seen from a platform.
#[derive(Clone, Copy, Debug)]
pub(super) struct Approach {
    /// The largest cosine between a normal, from the platform to the body, and the direction of passing.
    pub rise: Real,
    /// How far the body moves that way within the step against the platform, metres.
    pub way: Real,
}

/// What becomes of a contact that would begin.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Verdict {
    Stands,
    Waits,
    Passes,
}

/// What becomes of a body that comes so to a platform; `visitor` is its shape, seen from the platform's.
pub(super) fn judge(
    platform: &ShapeSlot,
    direction: Vec3,
    (visitor, pose): (&Shape, &Pose),
    approach: Approach,
    speculative_distance: Real,
) -> Verdict {
    if approach.way > 0.5 * speculative_distance {
        Verdict::Passes
    } else if approach.rise > LEAST_RISE {
        Verdict::Stands
    } else if is_above(&platform.geometry, direction, (visitor, pose), speculative_distance) {
        Verdict::Waits
    } else {
        Verdict::Passes
    }
}

/// Whether a platform does not stop a fast body on its way from `start` to `end`, both seen from the platform's shape:
/// because it passes, or because it was not above the platform when the step began.
pub(super) fn lets_pass(
    platform: &ShapeSlot,
    visitor: &Shape,
    (start, end): (&Pose, &Pose),
    speculative_distance: Real,
) -> bool {
    platform.one_way.is_some_and(|direction| {
        direction.dot(end.position - start.position) >= 0.0
            || platform.geometry.is_convex()
                && !is_above(&platform.geometry, direction, (visitor, start), speculative_distance)
    })
}

/// Whether a one-way platform is in the way of a shape that is moved by hand: it is above the platform. Of platforms that are
/// not convex nobody can tell; they always are.
pub(crate) fn stops(platform: &ShapeRef<'_>, (visitor, pose): (&Shape, &Pose)) -> bool {
    platform.one_way().is_none_or(|direction| {
        let seen = platform.world_pose().relative(pose);
        !platform.geometry().is_convex() || is_above(platform.geometry(), direction, (visitor, &seen), 0.0)
    })
}

/// Whether the lowest point of a shape is at most a speculative distance below the highest one of a platform.
fn is_above(platform: &Shape, up: Vec3, (visitor, pose): (&Shape, &Pose), speculative_distance: Real) -> bool {
    let upright = Pose::new(Vec3::ZERO, turn_to_y(up));
    let (top, bottom) = (platform.aabb(&upright).max.y, visitor.aabb(&upright.mul(pose)).min.y);
    bottom >= top - speculative_distance
}

/// The shortest turn from a unit vector to the y axis.
fn turn_to_y(from: Vec3) -> Rotation {
    let w = 1.0 + from.y;
    if w < 1e-6 {
        return Rotation::from_xyzw(1.0, 0.0, 0.0, 0.0);
    }
    Rotation::from_xyzw(-from.z, 0.0, from.x, w).normalize()
}

impl Pair {
    /// Whether the shapes may be passing through each other one day, so that each new contact has to be judged.
    pub fn is_one_way(&self) -> bool {
        self.traits & ONE_WAY != 0
    }

    /// Notes whether the shapes pass through each other.
    pub fn set_passing(&mut self, passing: bool) {
        self.traits = self.traits & !PASSING | if passing { PASSING } else { 0 };
    }

    pub fn is_passing(&self) -> bool {
        self.traits & PASSING != 0
    }
}

const _: () = assert!(
    BORNE[0] + BORNE[1] + PASSING + ONE_WAY + HITS + PERSIST + PRE_SOLVE == 127,
    "each trait has a bit of its own"
);

#[cfg(test)]
mod tests {
    use super::turn_to_y;
    use crate::math::Vec3;

    #[test]
    fn any_direction_is_turned_upright() {
        let directions = [Vec3::X, Vec3::Y, Vec3::Z, -Vec3::X, -Vec3::Y, -Vec3::Z, Vec3::new(0.48, -0.6, 0.64)];
        for from in directions {
            let up = turn_to_y(from).rotate(from);
            assert!((up - Vec3::Y).length() < 1e-5, "{from} becomes {up}");
        }
    }
}
