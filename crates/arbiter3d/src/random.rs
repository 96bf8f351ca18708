//! Numbers for unit tests that look random and are the same in each run: Marsaglia's xorshift ("Xorshift RNGs", 2003), its
//! top bits. The seed is anything but zero.

use crate::math::{Real, Rotation, Vec3};

/// A stream of numbers from a seed.
pub(crate) struct Random(pub u64);

impl Random {
    fn step(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    /// A whole number below `end`.
    pub fn below(&mut self, end: u32) -> u32 {
        (self.step() >> 33) as u32 % end
    }

    /// From 0 to 1.
    pub fn unit(&mut self) -> Real {
        (self.step() >> 40) as Real / 16_777_216.0
    }

    /// From −1 to 1.
    pub fn signed(&mut self) -> Real {
        2.0 * self.unit() - 1.0
    }

    pub fn between(&mut self, low: Real, high: Real) -> Real {
        low + (high - low) * self.unit()
    }

    /// In the cube from −1 to 1.
    pub fn vector(&mut self) -> Vec3 {
        Vec3::new(self.signed(), self.signed(), self.signed())
    }

    pub fn in_ball(&mut self) -> Vec3 {
        loop {
            let point = self.vector();
            if point.length_squared() <= 1.0 {
                return point;
            }
        }
    }

    /// A unit vector.
    pub fn direction(&mut self) -> Vec3 {
        loop {
            let v = self.vector();
            if v.length_squared() > 0.01 && v.length_squared() < 1.0 {
                return v.normalize();
            }
        }
    }

    pub fn rotation(&mut self) -> Rotation {
        let (v, w) = (self.vector(), self.signed());
        Rotation::from_xyzw(v.x, v.y, v.z, w).normalize()
    }
}
