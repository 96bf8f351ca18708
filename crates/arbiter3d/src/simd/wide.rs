//! Lanes of floats, vectors and symmetric matrices with the operations of the solver, each lane on its own.

use crate::math::Vec3;
use std::array::from_fn;
use std::ops::{Add, AddAssign, Div, Index, IndexMut, Mul, Neg, Sub, SubAssign};

/// `L` numbers side by side.
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub(crate) struct Wide<const L: usize>(pub [f32; L]);

impl<const L: usize> Wide<L> {
    pub const ZERO: Self = Self([0.0; L]);

    #[inline(always)]
    pub fn splat(x: f32) -> Self {
        Self([x; L])
    }

    #[inline(always)]
    pub fn sqrt(self) -> Self {
        Self(from_fn(|i| self.0[i].sqrt()))
    }

    /// `other` unless `self < other`.
    #[inline(always)]
    pub fn min(self, other: Self) -> Self {
        Self(from_fn(|i| if self.0[i] < other.0[i] { self.0[i] } else { other.0[i] }))
    }

    /// `other` unless `self > other`.
    #[inline(always)]
    pub fn max(self, other: Self) -> Self {
        Self(from_fn(|i| if self.0[i] > other.0[i] { self.0[i] } else { other.0[i] }))
    }

    /// In each lane `yes` where `self > 0`, else `no`.
    #[inline(always)]
    pub fn if_positive(self, yes: Self, no: Self) -> Self {
        Self(from_fn(|i| if self.0[i] > 0.0 { yes.0[i] } else { no.0[i] }))
    }

    /// In each lane `yes` where `self > other`, else `no`.
    #[inline(always)]
    pub fn if_greater(self, other: Self, yes: Self, no: Self) -> Self {
        Self(from_fn(|i| if self.0[i] > other.0[i] { yes.0[i] } else { no.0[i] }))
    }

    /// In each lane `yes` where `self` is zero of either sign, else `no`.
    #[inline(always)]
    pub fn if_zero(self, yes: Self, no: Self) -> Self {
        Self(from_fn(|i| if self.0[i] == 0.0 { yes.0[i] } else { no.0[i] }))
    }

    #[inline(always)]
    pub fn abs(self) -> Self {
        Self(from_fn(|i| self.0[i].abs()))
    }

    /// `1 / self` where `self > 0`, else 0.
    #[inline(always)]
    pub fn inverse_or_zero(self) -> Self {
        Self(from_fn(|i| if self.0[i] > 0.0 { 1.0 / self.0[i] } else { 0.0 }))
    }
}

macro_rules! lanewise {
    ($trait:ident, $method:ident, $op:tt) => {
        impl<const L: usize> $trait for Wide<L> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(from_fn(|i| self.0[i] $op other.0[i]))
            }
        }
    };
}
lanewise!(Add, add, +);
lanewise!(Sub, sub, -);
lanewise!(Mul, mul, *);
lanewise!(Div, div, /);

impl<const L: usize> Neg for Wide<L> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(from_fn(|i| -self.0[i]))
    }
}

impl<const L: usize> AddAssign for Wide<L> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<const L: usize> SubAssign for Wide<L> {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl<const L: usize> Index<usize> for Wide<L> {
    type Output = f32;
    #[inline(always)]
    fn index(&self, lane: usize) -> &f32 {
        &self.0[lane]
    }
}

impl<const L: usize> IndexMut<usize> for Wide<L> {
    #[inline(always)]
    fn index_mut(&mut self, lane: usize) -> &mut f32 {
        &mut self.0[lane]
    }
}

/// `L` vectors side by side.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(crate) struct WideVec3<const L: usize> {
    pub x: Wide<L>,
    pub y: Wide<L>,
    pub z: Wide<L>,
}

impl<const L: usize> WideVec3<L> {
    pub const ZERO: Self = Self { x: Wide::ZERO, y: Wide::ZERO, z: Wide::ZERO };

    #[inline(always)]
    pub fn set(&mut self, lane: usize, v: Vec3) {
        self.x[lane] = v.x;
        self.y[lane] = v.y;
        self.z[lane] = v.z;
    }

    #[inline(always)]
    pub fn get(&self, lane: usize) -> Vec3 {
        Vec3::new(self.x[lane], self.y[lane], self.z[lane])
    }

    /// The three coordinates.
    #[inline(always)]
    pub fn columns(&self) -> [Wide<L>; 3] {
        [self.x, self.y, self.z]
    }

    #[inline(always)]
    pub fn dot(&self, o: &Self) -> Wide<L> {
        self.x * o.x + self.y * o.y + self.z * o.z
    }

    #[inline(always)]
    pub fn cross(&self, o: &Self) -> Self {
        Self { x: self.y * o.z - self.z * o.y, y: self.z * o.x - self.x * o.z, z: self.x * o.y - self.y * o.x }
    }

    #[inline(always)]
    pub fn scale(&self, s: Wide<L>) -> Self {
        Self { x: self.x * s, y: self.y * s, z: self.z * s }
    }

    /// `self + o · s`.
    #[inline(always)]
    pub fn add_scaled(&self, o: &Self, s: Wide<L>) -> Self {
        Self { x: self.x + o.x * s, y: self.y + o.y * s, z: self.z + o.z * s }
    }

    /// `self − o · s`.
    #[inline(always)]
    pub fn sub_scaled(&self, o: &Self, s: Wide<L>) -> Self {
        Self { x: self.x - o.x * s, y: self.y - o.y * s, z: self.z - o.z * s }
    }
}

impl<const L: usize> Add for WideVec3<L> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Self { x: self.x + o.x, y: self.y + o.y, z: self.z + o.z }
    }
}

impl<const L: usize> Sub for WideVec3<L> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Self { x: self.x - o.x, y: self.y - o.y, z: self.z - o.z }
    }
}

/// `L` symmetric matrices side by side.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(crate) struct WideSymmetric<const L: usize> {
    pub xx: Wide<L>,
    pub yy: Wide<L>,
    pub zz: Wide<L>,
    pub xy: Wide<L>,
    pub xz: Wide<L>,
    pub yz: Wide<L>,
}

impl<const L: usize> WideSymmetric<L> {
    pub const ZERO: Self =
        Self { xx: Wide::ZERO, yy: Wide::ZERO, zz: Wide::ZERO, xy: Wide::ZERO, xz: Wide::ZERO, yz: Wide::ZERO };

    #[inline(always)]
    pub fn mul(&self, v: &WideVec3<L>) -> WideVec3<L> {
        WideVec3 {
            x: self.xx * v.x + self.xy * v.y + self.xz * v.z,
            y: self.xy * v.x + self.yy * v.y + self.yz * v.z,
            z: self.xz * v.x + self.yz * v.y + self.zz * v.z,
        }
    }

    #[inline(always)]
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

    /// `x` with `self · x = v`, by cofactors; zero where the matrix is singular.
    #[inline(always)]
    pub fn solve(&self, v: &WideVec3<L>) -> WideVec3<L> {
        let (c00, c01, c02) = (
            self.yy * self.zz - self.yz * self.yz,
            self.xz * self.yz - self.xy * self.zz,
            self.xy * self.yz - self.xz * self.yy,
        );
        let (c11, c12, c22) = (
            self.xx * self.zz - self.xz * self.xz,
            self.xy * self.xz - self.xx * self.yz,
            self.xx * self.yy - self.xy * self.xy,
        );
        let s = (self.xx * c00 + self.xy * c01 + self.xz * c02).inverse_or_zero();
        WideVec3 {
            x: (c00 * v.x + c01 * v.y + c02 * v.z) * s,
            y: (c01 * v.x + c11 * v.y + c12 * v.z) * s,
            z: (c02 * v.x + c12 * v.y + c22 * v.z) * s,
        }
    }
}
