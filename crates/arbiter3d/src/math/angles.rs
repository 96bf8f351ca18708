//! Sine and cosine with the same bits on every machine.
//!
//! The angle is brought to a quarter turn about zero, `r = x − n π/2` with `n` the nearest whole number, and the two
//! Taylor series are summed in double precision: the first term left out is below 1e-13 for `|r| ≤ π/4`, so the results
//! are those of exact functions rounded once, up to some 10⁵ turns.

use super::{Real, Rotation, Vec3};

/// Sine and cosine of an angle in radians.
#[must_use]
pub(crate) fn sin_cos(angle: Real) -> (Real, Real) {
    let x = f64::from(angle);
    let quarters = (x * std::f64::consts::FRAC_2_PI).round();
    let r = x - quarters * std::f64::consts::FRAC_PI_2;
    let q = r * r;
    let terms = |odd: f64| {
        // 1 − q/(o(o+1)) (1 − q/((o+2)(o+3)) (1 − …)), from the innermost outwards.
        let mut sum = 1.0;
        for k in (0..6).rev() {
            let first = odd + 2.0 * f64::from(k);
            sum = 1.0 - q / (first * (first + 1.0)) * sum;
        }
        sum
    };
    let (sine, cosine) = (r * terms(2.0), terms(1.0));
    let (sine, cosine) = match (quarters as i64) & 3 {
        0 => (sine, cosine),
        1 => (cosine, -sine),
        2 => (-sine, -cosine),
        _ => (-cosine, sine),
    };
    (sine as Real, cosine as Real)
}

/// The rotation by `angle` radians about a unit axis.
#[must_use]
pub(crate) fn turn(axis: Vec3, angle: Real) -> Rotation {
    let (s, c) = sin_cos(0.5 * angle);
    Rotation::from_xyzw(axis.x * s, axis.y * s, axis.z * s, c)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sines_and_cosines_are_those_of_the_book() {
        for step in -2000..=2000 {
            let angle = step as Real * 0.01;
            let (s, c) = sin_cos(angle);
            let (exact_s, exact_c) = f64::from(angle).sin_cos();
            assert!((f64::from(s) - exact_s).abs() < 6e-8 && (f64::from(c) - exact_c).abs() < 6e-8, "{angle}");
        }
    }

    #[test]
    fn a_quarter_turn_about_y_takes_z_to_x() {
        assert!((turn(Vec3::Y, std::f32::consts::FRAC_PI_2).rotate(Vec3::Z) - Vec3::X).length() < 1e-6);
    }
}
