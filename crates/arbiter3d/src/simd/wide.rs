//! What kernels compute with: numbers in lanes.
//!
//! A kernel is written once over a type `W` that stands for `L` numbers side by side. [`Number`] is its arithmetic, [`Lanes`]
//! the way in and out. The plain array [`Wide`] serves every machine; x86-64 has register types of its own (see `x86`), since
//! compilers turn loops over arrays into such instructions only in part: 100 steps of a large pyramid took 0.80 s with
//! arrays, 0.47 with registers.

use std::array::from_fn;
use std::fmt::Debug;
use std::ops::{Add, AddAssign, Div, Index, IndexMut, Mul, Neg, Sub, SubAssign};

/// Four numbers of a record.
pub(crate) type Quad = [f32; 4];

/// Arithmetic of IEEE numbers side by side, each lane on its own.
pub(crate) trait Number:
    Copy
    + Debug
    + Send
    + Sync
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
{
    const ZERO: Self;

    /// The same in all lanes.
    fn splat(x: f32) -> Self;

    /// Square root.
    fn sqrt(self) -> Self;

    /// `other` unless `self < other`.
    fn min(self, other: Self) -> Self;

    /// `other` unless `self > other`.
    fn max(self, other: Self) -> Self;

    /// In each lane `yes` where `self > 0`, else `no`.
    fn if_positive(self, yes: Self, no: Self) -> Self;

    /// In each lane `yes` where `self >= other`, else `no`.
    fn if_at_least(self, other: Self, yes: Self, no: Self) -> Self;

    /// In each lane `yes` where `self > other`, else `no`.
    fn if_above(self, other: Self, yes: Self, no: Self) -> Self;

    /// Without its sign.
    fn abs(self) -> Self;

    /// `1 / self` where `self > 0`, else 0.
    #[inline(always)]
    fn inverse_or_zero(self) -> Self {
        self.if_positive(Self::splat(1.0) / self, Self::ZERO)
    }
}

/// Numbers in `L` lanes.
pub(crate) trait Lanes<const L: usize>: Number {
    fn from_array(array: [f32; L]) -> Self;

    fn to_array(self) -> [f32; L];

    /// Number `k` of each record as column `k`.
    fn load(records: &[&Quad; L]) -> [Self; 4];

    /// The records that have these columns: undoes [`Lanes::load`].
    fn store(columns: &[Self; 4]) -> [Quad; L];

    /// A bit for each lane that is positive, lane 0 in the lowest.
    fn positive(self) -> u32;

    /// One lane.
    #[inline(always)]
    fn get(&self, lane: usize) -> f32 {
        self.to_array()[lane]
    }

    /// Changes one lane.
    #[inline(always)]
    fn set(&mut self, lane: usize, x: f32) {
        let mut array = self.to_array();
        array[lane] = x;
        *self = Self::from_array(array);
    }

    /// Group `k` of each record as four columns.
    #[inline(always)]
    fn load_quad<const N: usize>(records: &[&[Quad; N]; L], k: usize) -> [Self; 4] {
        let mut quads = [&[0.0; 4]; L];
        for (quad, record) in quads.iter_mut().zip(records) {
            *quad = &record[k];
        }
        Self::load(&quads)
    }
}

/// `L` numbers side by side in a plain array: what a machine without a register type of its own here uses.
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub(crate) struct Wide<const L: usize>(pub [f32; L]);

impl<const L: usize> Number for Wide<L> {
    const ZERO: Self = Self([0.0; L]);

    #[inline(always)]
    fn splat(x: f32) -> Self {
        Self([x; L])
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(from_fn(|i| self.0[i].sqrt()))
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self(from_fn(|i| if self.0[i] < other.0[i] { self.0[i] } else { other.0[i] }))
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self(from_fn(|i| if self.0[i] > other.0[i] { self.0[i] } else { other.0[i] }))
    }

    #[inline(always)]
    fn if_positive(self, yes: Self, no: Self) -> Self {
        Self(from_fn(|i| if self.0[i] > 0.0 { yes.0[i] } else { no.0[i] }))
    }

    #[inline(always)]
    fn if_at_least(self, other: Self, yes: Self, no: Self) -> Self {
        Self(from_fn(|i| if self.0[i] >= other.0[i] { yes.0[i] } else { no.0[i] }))
    }

    #[inline(always)]
    fn if_above(self, other: Self, yes: Self, no: Self) -> Self {
        Self(from_fn(|i| if self.0[i] > other.0[i] { yes.0[i] } else { no.0[i] }))
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Self(from_fn(|i| self.0[i].abs()))
    }
}

impl<const L: usize> Lanes<L> for Wide<L> {
    #[inline(always)]
    fn from_array(array: [f32; L]) -> Self {
        Self(array)
    }

    #[inline(always)]
    fn to_array(self) -> [f32; L] {
        self.0
    }

    #[inline(always)]
    fn positive(self) -> u32 {
        let mut bits = 0;
        for (lane, &x) in self.0.iter().enumerate() {
            bits |= u32::from(x > 0.0) << lane;
        }
        bits
    }

    #[inline(always)]
    fn get(&self, lane: usize) -> f32 {
        self.0[lane]
    }

    #[inline(always)]
    fn set(&mut self, lane: usize, x: f32) {
        self.0[lane] = x;
    }

    #[inline(always)]
    fn load(records: &[&Quad; L]) -> [Self; 4] {
        let mut columns = [Self::ZERO; 4];
        for (lane, record) in records.iter().enumerate() {
            for k in 0..4 {
                columns[k].0[lane] = record[k];
            }
        }
        columns
    }

    #[inline(always)]
    fn store(columns: &[Self; 4]) -> [Quad; L] {
        from_fn(|lane| from_fn(|k| columns[k].0[lane]))
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
