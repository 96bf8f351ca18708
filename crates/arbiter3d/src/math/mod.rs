//! Vectors, rotations, boxes and poses, every operation with one fixed order of IEEE additions, subtractions,
//! multiplications, divisions and square roots.
//!
//! `glam`'s three-component vectors and matrices are plain floats without SIMD, so they give the same bits everywhere and
//! serve both the API and the step. `glam::Quat` is not used inside: its product is evaluated in another order on SSE2 than
//! on NEON. The step rotates with [`Rotation`], whose formulas are spelled out on scalars.

mod aabb;
mod angles;
mod pose;
mod rotation;
mod symmetric;

pub use aabb::Aabb;
pub(crate) use aabb::rotated_half_extents;
pub(crate) use angles::{sin_cos, turn};
pub use glam::{Mat3, Quat, Vec3};
pub use pose::Pose;
pub use rotation::Rotation;
pub use symmetric::SymmetricMat3;

/// The scalar type of the engine.
pub type Real = f32;

/// The smaller of two numbers: `b` unless `a < b`, so a NaN in `a` gives `b` on every machine.
#[inline(always)]
#[must_use]
pub fn min(a: Real, b: Real) -> Real {
    if a < b { a } else { b }
}

/// The larger of two numbers: `b` unless `a > b`, so a NaN in `a` gives `b` on every machine.
#[inline(always)]
#[must_use]
pub fn max(a: Real, b: Real) -> Real {
    if a > b { a } else { b }
}

/// `x` limited to `[low, high]`; a NaN gives `low`.
#[inline(always)]
#[must_use]
pub fn clamp(x: Real, low: Real, high: Real) -> Real {
    min(max(x, low), high)
}

/// Component-wise [`min`].
#[inline(always)]
#[must_use]
pub fn min3(a: Vec3, b: Vec3) -> Vec3 {
    Vec3::new(min(a.x, b.x), min(a.y, b.y), min(a.z, b.z))
}

/// Component-wise [`max`].
#[inline(always)]
#[must_use]
pub fn max3(a: Vec3, b: Vec3) -> Vec3 {
    Vec3::new(max(a.x, b.x), max(a.y, b.y), max(a.z, b.z))
}

/// Component-wise absolute value.
#[inline(always)]
#[must_use]
pub fn abs3(a: Vec3) -> Vec3 {
    Vec3::new(a.x.abs(), a.y.abs(), a.z.abs())
}

/// `a / |a|`, or `fallback` where `a` is too short (or not finite) to have a direction.
#[inline]
#[must_use]
pub fn normalize_or(a: Vec3, fallback: Vec3) -> Vec3 {
    let squared = a.length_squared();
    if squared > 1e-30 && squared < 1e30 {
        a * (1.0 / squared.sqrt())
    } else {
        // Too small or too large to square: scale by the largest component first.
        let scale = max(max(a.x.abs(), a.y.abs()), a.z.abs());
        if scale > 1e-37 && scale.is_finite() {
            let b = a / scale;
            b * (1.0 / b.length_squared().sqrt())
        } else {
            fallback
        }
    }
}

/// Two unit vectors that make a right-handed orthonormal frame with the unit vector `n`: `t1 × t2 = n`.
///
/// Branch-free but for one sign; the lanes of the solver use the same formula.
/// Source: Duff et al., "Building an Orthonormal Basis, Revisited", 2017.
#[inline(always)]
#[must_use]
pub fn tangents(n: Vec3) -> (Vec3, Vec3) {
    let sign: Real = if n.z >= 0.0 { 1.0 } else { -1.0 };
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    (Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x), Vec3::new(b, sign + n.y * n.y * a, -n.y))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tangents_make_a_right_handed_frame() {
        for n in [Vec3::X, Vec3::Y, Vec3::Z, -Vec3::Z, -Vec3::Y, Vec3::new(0.6, -0.48, -0.64)] {
            let (t1, t2) = tangents(n);
            assert!((t1.cross(t2) - n).length() < 1e-6);
            assert!(t1.dot(n).abs() < 1e-6 && t2.dot(n).abs() < 1e-6);
        }
    }

    #[test]
    fn min_and_max_pin_nan() {
        assert_eq!(min(Real::NAN, 1.0), 1.0);
        assert_eq!(max(Real::NAN, 1.0), 1.0);
        assert_eq!(clamp(Real::NAN, 2.0, 3.0), 2.0);
    }
}
