//! Repeatable random numbers: the 32-bit linear congruential generator that Box3D's benchmark scenes use, so that hulls
//! made from "32 random points" are the very same points.
//!
//! `s ← s · 2147001325 + 715136305 (mod 2³²)`, and a number is the low 16 bits of `s` mapped to [−½, ½].

use arbiter3d::math::{Quat, Real, Vec3};

/// A stream of repeatable random numbers.
///
/// ```
/// use arbiter3d_scenes::Random;
/// let (mut a, mut b) = (Random::new(42), Random::new(42));
/// assert_eq!(a.unit_vector(), b.unit_vector());
/// ```
#[derive(Clone, Debug)]
pub struct Random(u32);

impl Random {
    /// A stream that starts at `seed`.
    #[must_use]
    pub fn new(seed: u32) -> Self {
        Self(seed)
    }

    /// A stream for a scene: the published start for seed 0, else one that depends on every bit of the seed.
    #[must_use]
    pub fn for_scene(published: u32, seed: u64) -> Self {
        if seed == 0 {
            return Self(published);
        }
        // splitmix64's finaliser: neighbouring seeds must give unrelated streams.
        let mut z = seed.wrapping_add(0x9e37_79b9_7f4a_7c15).wrapping_add(u64::from(published) << 32);
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        Self(((z ^ (z >> 31)) >> 16) as u32)
    }

    /// A number from −½ to ½.
    pub fn signed_half(&mut self) -> Real {
        self.0 = self.0.wrapping_mul(2_147_001_325).wrapping_add(715_136_305);
        (self.0 & 0xffff) as Real / 65535.0 - 0.5
    }

    /// A number from `low` to `high`.
    pub fn range(&mut self, low: Real, high: Real) -> Real {
        low + (self.signed_half() + 0.5) * (high - low)
    }

    /// A point in the cube of the given half width, each coordinate even.
    pub fn in_cube(&mut self, half_width: Real) -> Vec3 {
        let mut next = || 2.0 * half_width * self.signed_half();
        let (x, y, z) = (next(), next(), next());
        Vec3::new(x, y, z)
    }

    /// A direction, even over the sphere (by rejection from the cube).
    pub fn unit_vector(&mut self) -> Vec3 {
        loop {
            let p = self.in_cube(0.5);
            let squared = p.length_squared();
            if squared <= 0.25 && squared > 1e-6 {
                return p * (1.0 / squared.sqrt());
            }
        }
    }

    /// Points on a sphere about the origin; the convex hull of them is a rock.
    pub fn points_on_sphere(&mut self, count: usize, radius: Real) -> Vec<Vec3> {
        (0..count).map(|_| self.unit_vector() * radius).collect()
    }

    /// A rotation, even over all rotations (a point of the four-dimensional ball, by rejection).
    pub fn rotation(&mut self) -> Quat {
        loop {
            let q = [self.signed_half(), self.signed_half(), self.signed_half(), self.signed_half()];
            let squared = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
            if squared <= 0.25 && squared > 1e-4 {
                let s = 1.0 / squared.sqrt();
                return Quat::from_xyzw(q[0] * s, q[1] * s, q[2] * s, q[3] * s);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_numbers_are_those_of_the_published_generator() {
        let expected = (42u64 * 2_147_001_325 + 715_136_305) as u32 & 0xffff;
        assert_eq!(Random::new(42).signed_half(), expected as Real / 65535.0 - 0.5);
    }

    #[test]
    fn directions_are_of_unit_length_and_balanced() {
        let mut random = Random::new(7);
        let mut sum = Vec3::ZERO;
        for _ in 0..4000 {
            let u = random.unit_vector();
            assert!((u.length() - 1.0).abs() < 1e-6);
            sum += u;
        }
        assert!((sum / 4000.0).length() < 0.05, "{sum:?}");
    }

    #[test]
    fn seed_zero_is_the_published_stream_and_others_differ() {
        let first = |seed| Random::for_scene(42, seed).signed_half();
        assert_eq!(first(0), Random::new(42).signed_half());
        assert!(first(1) != first(0) && first(2) != first(1));
    }
}
