//! How a body has come through a step: from one pose of its centre of mass to another.
//!
//! The middle goes straight; the turn is that of the step's rotation vector, cut into parts of less than a radian, since a blend
//! of two rotations takes the short way round and would take a rod that spins by 200° for one that spins by −160°. What
//! the parts miss at the end (the spin of a body in free flight changes) is shared out evenly.

use crate::math::{Pose, Real, Rotation, Vec3, min};
use crate::world::shapes::ShapeSlot;

/// Parts of a way turn by no more than this, radians.
const LONGEST_TURN: Real = 0.8;
/// Parts at most. Bodies turn by no more than 1.5 radians a substep.
const MOST_PARTS: usize = 64;

/// The way of a body's centre frame through a step, or through what is left of one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Way {
    pub start: Pose,
    pub end: Pose,
    /// The rotation vector of the turn, radians.
    pub turn: Vec3,
    pub parts: usize,
    /// Share of it at which the body stops, to stay there: 1 if it comes to the end. A shorter way made anew would lead past
    /// the poses of this one, which have been found to be free.
    until: Real,
}

impl Way {
    pub fn new(start: Pose, end: Pose, turn: Vec3) -> Self {
        let parts = turn.length() / LONGEST_TURN;
        // Not a number becomes zero.
        Self { start, end, turn, parts: (parts.ceil() as usize).clamp(1, MOST_PARTS), until: 1.0 }
    }

    /// A body that stays where it is.
    pub fn still(pose: Pose) -> Self {
        Self { start: pose, end: pose, turn: Vec3::ZERO, parts: 1, until: 1.0 }
    }

    /// The same way for a body that stops at a share of it.
    pub fn stopped(self, time: Real) -> Self {
        Self { until: min(time, self.until), ..self }
    }

    /// Where the body comes to.
    pub fn last(&self) -> Pose {
        if self.until < 1.0 { self.at(self.until) } else { self.end }
    }

    /// How far some point of a shape of the body goes at most.
    pub fn length_at(&self, shape: &ShapeSlot) -> Real {
        (self.end.position - self.start.position).length() + self.turn.length() * (shape.middle.length() + shape.reach)
    }

    /// The poses at the ends of a part.
    pub fn part(&self, part: usize) -> [Pose; 2] {
        [self.node(part), self.node(part + 1)]
    }

    fn node(&self, node: usize) -> Pose {
        if node == 0 {
            return self.start;
        }
        if node >= self.parts {
            return self.end;
        }
        let each = self.turn / self.parts as Real;
        let (mut rotation, mut reached) = (self.start.rotation, self.start.rotation);
        for at in 0..self.parts {
            reached = reached.integrate(each);
            if at + 1 == node {
                rotation = reached;
            }
        }
        let t = node as Real / self.parts as Real;
        let missed = Pose::new(Vec3::ZERO, self.end.rotation.mul(reached.conjugate()));
        let rotation = Pose::IDENTITY.interpolate(&missed, t).rotation.mul(rotation).normalize();
        Pose::new(self.start.position + (self.end.position - self.start.position) * t, rotation)
    }

    /// Where the body is at a share of its way, from 0 to 1.
    pub fn at(&self, time: Real) -> Pose {
        let time = min(time, self.until);
        if self.parts == 1 {
            return self.start.interpolate(&self.end, time);
        }
        let along = time * self.parts as Real;
        let part = (along as usize).min(self.parts - 1);
        let [from, to] = self.part(part);
        from.interpolate(&to, along - part as Real)
    }
}

/// A rotation turned back by a rotation vector of any length: what it was before.
pub(super) fn turned_back(rotation: Rotation, turn: Vec3) -> Rotation {
    const SHORT: Real = 0.25;
    let parts = (turn.length() / SHORT).ceil().clamp(1.0, 256.0);
    (0..parts as usize).fold(rotation, |rotation, _| rotation.integrate(-turn / parts))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A turn by 200° and one by 340° go the way they went: half of it is 100° and 170°, not −80° and −10°.
    #[test]
    fn long_turns_go_the_long_way_round() {
        for degrees in [10.0_f32, 100.0, 200.0, 340.0] {
            let angle = degrees.to_radians();
            let about_z = |angle: Real| Rotation::from_xyzw(0.0, 0.0, libm::sinf(0.5 * angle), libm::cosf(0.5 * angle));
            let end = Pose::new(Vec3::X, about_z(angle));
            let way = Way::new(Pose::IDENTITY, end, Vec3::Z * angle);
            for step in 0..=20 {
                let t = step as Real / 20.0;
                let (found, expected) = (way.at(t), about_z(t * angle));
                let off = found.rotation.rotate(Vec3::X) - expected.rotate(Vec3::X);
                assert!(off.length() < 0.02, "{degrees}° at {t}: off by {}", off.length());
                assert!((found.position - Vec3::X * t).length() < 1e-6);
            }
            let back = turned_back(end.rotation, way.turn).rotate(Vec3::X);
            assert!((back - Vec3::X).length() < 1e-3, "{degrees}°: back to {back}");
        }
    }
}
