//! Unit quaternions on plain floats: `q = w + xi + yj + zk` turns `v` into `q v q*`.
//!
//! Rotating uses `v + 2w(u × v) + 2u × (u × v)` with `u = (x, y, z)`; nothing here calls a sine or a cosine.

use super::{Mat3, Quat, Real, Vec3};

/// A rotation as a unit quaternion, with a fixed order of operations on every machine.
///
/// ```
/// use arbiter3d::math::{Rotation, Vec3};
/// let quarter_turn_about_z = Rotation::from_xyzw(0.0, 0.0, 0.5_f32.sqrt(), 0.5_f32.sqrt());
/// assert!((quarter_turn_about_z.rotate(Vec3::X) - Vec3::Y).length() < 1e-6);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct Rotation {
    /// First imaginary part.
    pub x: Real,
    /// Second imaginary part.
    pub y: Real,
    /// Third imaginary part.
    pub z: Real,
    /// Real part.
    pub w: Real,
}

impl Default for Rotation {
    fn default() -> Self {
        Self::IDENTITY
    }
}

impl Rotation {
    /// No rotation.
    pub const IDENTITY: Self = Self { x: 0.0, y: 0.0, z: 0.0, w: 1.0 };

    /// The quaternion with these parts, taken as they are; the caller keeps it of unit length.
    #[inline(always)]
    #[must_use]
    pub const fn from_xyzw(x: Real, y: Real, z: Real, w: Real) -> Self {
        Self { x, y, z, w }
    }

    /// From `glam`'s quaternion.
    #[inline]
    #[must_use]
    pub fn from_quat(q: Quat) -> Self {
        Self { x: q.x, y: q.y, z: q.z, w: q.w }
    }

    /// To `glam`'s quaternion.
    #[inline]
    #[must_use]
    pub fn to_quat(self) -> Quat {
        Quat::from_xyzw(self.x, self.y, self.z, self.w)
    }

    /// The imaginary part.
    #[inline(always)]
    #[must_use]
    pub fn vector(self) -> Vec3 {
        Vec3::new(self.x, self.y, self.z)
    }

    /// The inverse of a unit quaternion.
    #[inline(always)]
    #[must_use]
    pub fn conjugate(self) -> Self {
        Self { x: -self.x, y: -self.y, z: -self.z, w: self.w }
    }

    /// Four-dimensional dot product.
    #[inline(always)]
    #[must_use]
    pub fn dot(self, other: Self) -> Real {
        self.x * other.x + self.y * other.y + self.z * other.z + self.w * other.w
    }

    /// Scaled to unit length; the identity where the length is zero or not finite.
    #[inline(always)]
    #[must_use]
    pub fn normalize(self) -> Self {
        let squared = self.dot(self);
        if !(squared > 1e-30 && squared < 1e30) {
            return Self::IDENTITY;
        }
        let s = 1.0 / squared.sqrt();
        Self { x: self.x * s, y: self.y * s, z: self.z * s, w: self.w * s }
    }

    /// `self` after `other`: `(self * other).rotate(v) == self.rotate(other.rotate(v))`.
    #[inline(always)]
    #[must_use]
    #[expect(clippy::should_implement_trait, reason = "a method keeps the chain readable: a.mul(b).rotate(v)")]
    pub fn mul(self, b: Self) -> Self {
        let a = self;
        Self {
            x: a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
            y: a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
            z: a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w,
            w: a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z,
        }
    }

    /// Turns a vector.
    #[inline(always)]
    #[must_use]
    pub fn rotate(self, v: Vec3) -> Vec3 {
        let u = self.vector();
        let t = u.cross(v) * 2.0;
        v + t * self.w + u.cross(t)
    }

    /// Turns a vector back.
    #[inline(always)]
    #[must_use]
    pub fn inverse_rotate(self, v: Vec3) -> Vec3 {
        self.conjugate().rotate(v)
    }

    /// Turned further by the rotation vector `angle` (world axes, radians): the angle `|angle|` about its direction.
    ///
    /// `tan(θ/2) ≈ (θ/2)(1 + θ²/12)` puts the error at `θ⁵/120 · 1/2`: 1e-9 for the 0.04 rad that a body spinning at
    /// 10 rad/s turns in a substep, where the usual `q + ½ωhq` is off by 5e-6.
    #[inline(always)]
    #[must_use]
    pub fn integrate(self, angle: Vec3) -> Self {
        let half = angle * (0.5 * (1.0 + angle.length_squared() * (1.0 / 12.0)));
        let q = self;
        Self {
            x: q.x + half.x * q.w + half.y * q.z - half.z * q.y,
            y: q.y - half.x * q.z + half.y * q.w + half.z * q.x,
            z: q.z + half.x * q.y - half.y * q.x + half.z * q.w,
            w: q.w - half.x * q.x - half.y * q.y - half.z * q.z,
        }
        .normalize()
    }

    /// The matrix whose columns are the turned axes.
    #[inline(always)]
    #[must_use]
    pub fn to_mat3(self) -> Mat3 {
        let (x, y, z, w) = (self.x, self.y, self.z, self.w);
        let (x2, y2, z2) = (x + x, y + y, z + z);
        let (xx, xy, xz) = (x * x2, x * y2, x * z2);
        let (yy, yz, zz) = (y * y2, y * z2, z * z2);
        let (wx, wy, wz) = (w * x2, w * y2, w * z2);
        Mat3::from_cols(
            Vec3::new(1.0 - (yy + zz), xy + wz, xz - wy),
            Vec3::new(xy - wz, 1.0 - (xx + zz), yz + wx),
            Vec3::new(xz + wy, yz - wx, 1.0 - (xx + yy)),
        )
    }

    /// Whether every part is finite.
    #[inline]
    #[must_use]
    pub fn is_finite(self) -> bool {
        self.x.is_finite() && self.y.is_finite() && self.z.is_finite() && self.w.is_finite()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integrating_a_constant_spin_turns_by_the_exact_angle() {
        let mut q = Rotation::IDENTITY;
        let steps = 1000;
        let angle = std::f32::consts::TAU * 10.0 / steps as Real;
        for _ in 0..steps {
            q = q.integrate(Vec3::new(0.0, angle, 0.0));
        }
        assert!((q.rotate(Vec3::X) - Vec3::X).length() < 2e-4, "{:?}", q.rotate(Vec3::X));
    }

    #[test]
    fn matrix_and_quaternion_agree_and_invert() {
        let q = Rotation::from_xyzw(1.0, 2.0, 3.0, 4.0).normalize();
        let v = Vec3::new(0.3, -1.0, 2.0);
        assert!((q.to_mat3() * v - q.rotate(v)).length() < 1e-6);
        assert!((q.inverse_rotate(q.rotate(v)) - v).length() < 1e-6);
        assert!((q.mul(q.conjugate()).w - 1.0).abs() < 1e-6);
    }
}
