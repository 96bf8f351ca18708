//! Symmetric 3×3 matrices as six numbers: inertia tensors and their inverses.

use super::{Mat3, Real, Vec3};

/// A symmetric 3×3 matrix; for inertia, kg m² (or its inverse).
///
/// ```
/// use arbiter3d::math::{SymmetricMat3, Vec3};
/// let m = SymmetricMat3::diagonal(Vec3::new(1.0, 2.0, 4.0));
/// assert_eq!(m.inverse().unwrap().mul(Vec3::ONE), Vec3::new(1.0, 0.5, 0.25));
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct SymmetricMat3 {
    /// Row 1, column 1.
    pub xx: Real,
    /// Row 2, column 2.
    pub yy: Real,
    /// Row 3, column 3.
    pub zz: Real,
    /// Rows 1 and 2.
    pub xy: Real,
    /// Rows 1 and 3.
    pub xz: Real,
    /// Rows 2 and 3.
    pub yz: Real,
}

impl SymmetricMat3 {
    /// All zero.
    pub const ZERO: Self = Self { xx: 0.0, yy: 0.0, zz: 0.0, xy: 0.0, xz: 0.0, yz: 0.0 };

    /// A diagonal matrix.
    #[inline(always)]
    #[must_use]
    pub const fn diagonal(d: Vec3) -> Self {
        Self { xx: d.x, yy: d.y, zz: d.z, xy: 0.0, xz: 0.0, yz: 0.0 }
    }

    /// Matrix times vector.
    #[inline(always)]
    #[must_use]
    pub fn mul(&self, v: Vec3) -> Vec3 {
        Vec3::new(
            self.xx * v.x + self.xy * v.y + self.xz * v.z,
            self.xy * v.x + self.yy * v.y + self.yz * v.z,
            self.xz * v.x + self.yz * v.y + self.zz * v.z,
        )
    }

    /// Sum.
    #[inline]
    #[must_use]
    pub fn add(&self, o: &Self) -> Self {
        Self {
            xx: self.xx + o.xx,
            yy: self.yy + o.yy,
            zz: self.zz + o.zz,
            xy: self.xy + o.xy,
            xz: self.xz + o.xz,
            yz: self.yz + o.yz,
        }
    }

    /// All entries times `s`.
    #[inline]
    #[must_use]
    pub fn scale(&self, s: Real) -> Self {
        Self { xx: self.xx * s, yy: self.yy * s, zz: self.zz * s, xy: self.xy * s, xz: self.xz * s, yz: self.yz * s }
    }

    /// The same tensor in the outer frame of `rotation`: `R M Rᵀ`.
    #[inline(always)]
    #[must_use]
    pub fn rotate(&self, rotation: &Mat3) -> Self {
        // Columns of R M, then the upper half of (R M) Rᵀ.
        let (c0, c1, c2) = (rotation.x_axis, rotation.y_axis, rotation.z_axis);
        let m0 = c0 * self.xx + c1 * self.xy + c2 * self.xz;
        let m1 = c0 * self.xy + c1 * self.yy + c2 * self.yz;
        let m2 = c0 * self.xz + c1 * self.yz + c2 * self.zz;
        Self {
            xx: m0.x * c0.x + m1.x * c1.x + m2.x * c2.x,
            yy: m0.y * c0.y + m1.y * c1.y + m2.y * c2.y,
            zz: m0.z * c0.z + m1.z * c1.z + m2.z * c2.z,
            xy: m0.x * c0.y + m1.x * c1.y + m2.x * c2.y,
            xz: m0.x * c0.z + m1.x * c1.z + m2.x * c2.z,
            yz: m0.y * c0.z + m1.y * c1.z + m2.y * c2.z,
        }
    }

    /// Steiner's term `mass · (|d|² 1 − d dᵀ)`: what an inertia gains when its axis moves off the centre by `d`.
    #[inline]
    #[must_use]
    pub fn steiner(mass: Real, d: Vec3) -> Self {
        Self {
            xx: mass * (d.y * d.y + d.z * d.z),
            yy: mass * (d.x * d.x + d.z * d.z),
            zz: mass * (d.x * d.x + d.y * d.y),
            xy: -mass * d.x * d.y,
            xz: -mass * d.x * d.z,
            yz: -mass * d.y * d.z,
        }
    }

    /// Determinant.
    #[inline]
    #[must_use]
    pub fn determinant(&self) -> Real {
        self.xx * (self.yy * self.zz - self.yz * self.yz)
            + self.xy * (self.xz * self.yz - self.xy * self.zz)
            + self.xz * (self.xy * self.yz - self.xz * self.yy)
    }

    /// The inverse; `None` where the matrix is singular or not finite.
    ///
    /// Computed on the matrix scaled by its trace, so that tiny and huge bodies invert alike.
    #[must_use]
    pub fn inverse(&self) -> Option<Self> {
        let trace = self.xx + self.yy + self.zz;
        if !(trace > 0.0 && trace.is_finite()) {
            return None;
        }
        let m = self.scale(1.0 / trace);
        let determinant = m.determinant();
        if !(determinant > 1e-12 && determinant.is_finite()) {
            return None;
        }
        let s = 1.0 / (determinant * trace);
        let inverse = Self {
            xx: (m.yy * m.zz - m.yz * m.yz) * s,
            yy: (m.xx * m.zz - m.xz * m.xz) * s,
            zz: (m.xx * m.yy - m.xy * m.xy) * s,
            xy: (m.xz * m.yz - m.xy * m.zz) * s,
            xz: (m.xy * m.yz - m.xz * m.yy) * s,
            yz: (m.xy * m.xz - m.xx * m.yz) * s,
        };
        inverse.is_finite().then_some(inverse)
    }

    /// Whether every entry is finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        [self.xx, self.yy, self.zz, self.xy, self.xz, self.yz].iter().all(|e| e.is_finite())
    }

    /// Whether the matrix is a multiple of the identity to one part in 10⁵ (a sphere's or a cube's inertia).
    #[must_use]
    pub fn is_isotropic(&self) -> bool {
        let tolerance = 1e-5 * (self.xx + self.yy + self.zz).abs();
        (self.xx - self.yy).abs() <= tolerance
            && (self.yy - self.zz).abs() <= tolerance
            && self.xy.abs() <= tolerance
            && self.xz.abs() <= tolerance
            && self.yz.abs() <= tolerance
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rotation;

    #[test]
    fn inverse_and_rotation() {
        let q = Rotation::from_xyzw(0.3, -0.2, 0.5, 0.7).normalize();
        let m = SymmetricMat3::diagonal(Vec3::new(1.0, 2.0, 3.0)).rotate(&q.to_mat3());
        let v = Vec3::new(1.0, -2.0, 0.5);
        let expected = q.rotate(q.inverse_rotate(v) * Vec3::new(1.0, 2.0, 3.0));
        assert!((m.mul(v) - expected).length() < 1e-5);
        assert!((m.inverse().unwrap().mul(m.mul(v)) - v).length() < 1e-5);
        assert!(SymmetricMat3::diagonal(Vec3::new(1.0, 1.0, 0.0)).inverse().is_none());
    }
}
