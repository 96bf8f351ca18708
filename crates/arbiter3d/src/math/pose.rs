//! A rigid placement: rotate, then translate.

use super::{Real, Rotation, Vec3};

/// Position and rotation of a frame inside another.
///
/// ```
/// use arbiter3d::math::{Pose, Vec3};
/// let pose = Pose::from_position(Vec3::new(1.0, 2.0, 3.0));
/// assert_eq!(pose.transform_point(Vec3::X), Vec3::new(2.0, 2.0, 3.0));
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct Pose {
    /// Turns from the inner to the outer frame.
    pub rotation: Rotation,
    /// Origin of the inner frame in the outer one, metres.
    pub position: Vec3,
}

impl Pose {
    /// The frame itself.
    pub const IDENTITY: Self = Self { rotation: Rotation::IDENTITY, position: Vec3::ZERO };

    /// A pose from its parts.
    #[inline(always)]
    #[must_use]
    pub const fn new(position: Vec3, rotation: Rotation) -> Self {
        Self { rotation, position }
    }

    /// A translation.
    #[inline(always)]
    #[must_use]
    pub const fn from_position(position: Vec3) -> Self {
        Self { rotation: Rotation::IDENTITY, position }
    }

    /// A point of the inner frame in the outer one.
    #[inline(always)]
    #[must_use]
    pub fn transform_point(&self, point: Vec3) -> Vec3 {
        self.rotation.rotate(point) + self.position
    }

    /// A point of the outer frame in the inner one.
    #[inline(always)]
    #[must_use]
    pub fn inverse_transform_point(&self, point: Vec3) -> Vec3 {
        self.rotation.inverse_rotate(point - self.position)
    }

    /// `self` after `inner`: the pose in the outer frame of what `inner` places in this frame.
    #[inline(always)]
    #[must_use]
    pub fn mul(&self, inner: &Self) -> Self {
        Self { rotation: self.rotation.mul(inner.rotation), position: self.transform_point(inner.position) }
    }

    /// The pose of `other` seen from this frame: `self⁻¹ · other`.
    #[inline(always)]
    #[must_use]
    pub fn relative(&self, other: &Self) -> Self {
        Self {
            rotation: self.rotation.conjugate().mul(other.rotation),
            position: self.rotation.inverse_rotate(other.position - self.position),
        }
    }

    /// The inverse placement.
    #[inline(always)]
    #[must_use]
    pub fn inverse(&self) -> Self {
        Self { rotation: self.rotation.conjugate(), position: -self.rotation.inverse_rotate(self.position) }
    }

    /// Whether every number is finite.
    #[inline]
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.position.is_finite() && self.rotation.is_finite()
    }

    /// Linear blend of the positions and normalised blend of the rotations; `t` from 0 (`self`) to 1 (`end`).
    #[inline]
    #[must_use]
    pub fn interpolate(&self, end: &Self, t: Real) -> Self {
        let sign = if self.rotation.dot(end.rotation) < 0.0 { -1.0 } else { 1.0 };
        let (a, b) = (1.0 - t, t * sign);
        let (p, q) = (self.rotation, end.rotation);
        Self {
            position: self.position + (end.position - self.position) * t,
            rotation: Rotation::from_xyzw(p.x * a + q.x * b, p.y * a + q.y * b, p.z * a + q.z * b, p.w * a + q.w * b)
                .normalize(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn relative_undoes_mul() {
        let a = Pose::new(Vec3::new(1.0, -2.0, 0.5), Rotation::from_xyzw(0.1, 0.7, -0.2, 0.6).normalize());
        let b = Pose::new(Vec3::new(-3.0, 0.25, 2.0), Rotation::from_xyzw(0.5, 0.1, 0.3, -0.4).normalize());
        let again = a.relative(&a.mul(&b));
        assert!((again.position - b.position).length() < 1e-5);
        assert!((again.rotation.dot(b.rotation) - 1.0).abs() < 1e-5);
        let p = Vec3::new(4.0, 5.0, 6.0);
        assert!((a.inverse().transform_point(a.transform_point(p)) - p).length() < 1e-5);
        assert!((a.inverse_transform_point(a.transform_point(p)) - p).length() < 1e-5);
    }
}
