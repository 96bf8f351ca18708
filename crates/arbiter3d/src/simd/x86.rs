//! The registers of x86-64 as lanes: 4 of SSE2, 8 of AVX2, 16 of AVX-512.
//!
//! Every operation is one instruction with the meaning that [`Number`] gives it: IEEE single precision, `min` and `max` that
//! give the second operand where the comparison fails. So the bits are those of [`super::Wide`].
//!
//! Values of a type exist only in kernels that [`super::Instructions::run`] has entered with the instructions of that type;
//! everything here is inlined into them. That is what makes the intrinsics safe to call.
//!
//! Records become columns by a 4×4 transpose, `unpack` pairs and then `shuffle` pairs of pairs, within each 128-bit part of
//! a register; part `b` of register `j` holds record `4b + j`, so that the lanes come out in order. One load a record and
//! eight shuffles for all lanes, where number by number costs more than the arithmetic of a solver pass.

use super::{Lanes, Number, Quad};
use std::arch::x86_64::*;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// Implements the arithmetic of one register type.
macro_rules! register {
    ($(#[$meta:meta])* $name:ident($register:ty), $lanes:literal lanes,
     $add:ident $sub:ident $mul:ident $div:ident $sqrt:ident $min:ident $max:ident $set1:ident $andnot:ident,
     |$a:ident, $b:ident, $yes:ident, $no:ident| above $above:expr, at least $at_least:expr) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug)]
        #[repr(transparent)]
        pub(crate) struct $name($register);

        register!(@operator $name Add add $add);
        register!(@operator $name Sub sub $sub);
        register!(@operator $name Mul mul $mul);
        register!(@operator $name Div div $div);

        impl Neg for $name {
            type Output = Self;
            #[inline(always)]
            fn neg(self) -> Self {
                // −0 − x would lose the sign of a zero.
                Self::splat(-1.0) * self
            }
        }

        impl AddAssign for $name {
            #[inline(always)]
            fn add_assign(&mut self, other: Self) {
                *self = *self + other;
            }
        }

        impl SubAssign for $name {
            #[inline(always)]
            fn sub_assign(&mut self, other: Self) {
                *self = *self - other;
            }
        }

        impl Number for $name {
            // SAFETY: a register is as many floats.
            const ZERO: Self = Self(unsafe { std::mem::transmute::<[f32; $lanes], $register>([0.0; $lanes]) });

            #[inline(always)]
            fn splat(x: f32) -> Self {
                // SAFETY: see the module: the machine has the instructions.
                Self(unsafe { $set1(x) })
            }

            #[inline(always)]
            fn sqrt(self) -> Self {
                // SAFETY: as above.
                Self(unsafe { $sqrt(self.0) })
            }

            #[inline(always)]
            fn min(self, other: Self) -> Self {
                // SAFETY: as above.
                Self(unsafe { $min(self.0, other.0) })
            }

            #[inline(always)]
            fn max(self, other: Self) -> Self {
                // SAFETY: as above.
                Self(unsafe { $max(self.0, other.0) })
            }

            #[inline(always)]
            fn if_positive(self, yes: Self, no: Self) -> Self {
                self.if_above(Self::ZERO, yes, no)
            }

            #[inline(always)]
            fn if_above(self, other: Self, yes: Self, no: Self) -> Self {
                let ($a, $b, $yes, $no) = (self.0, other.0, yes.0, no.0);
                // SAFETY: as above.
                Self(unsafe { $above })
            }

            #[inline(always)]
            fn if_at_least(self, other: Self, yes: Self, no: Self) -> Self {
                let ($a, $b, $yes, $no) = (self.0, other.0, yes.0, no.0);
                // SAFETY: as above.
                Self(unsafe { $at_least })
            }

            #[inline(always)]
            fn abs(self) -> Self {
                // SAFETY: as above.
                Self(unsafe { $andnot($set1(-0.0), self.0) })
            }
        }
    };
    (@operator $name:ident $trait:ident $method:ident $intrinsic:ident) => {
        impl $trait for $name {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                // SAFETY: see the module: the machine has the instructions.
                Self(unsafe { $intrinsic(self.0, other.0) })
            }
        }
    };
}

register!(
    /// Four lanes of SSE2.
    Sse2Lanes(__m128), 4 lanes,
    _mm_add_ps _mm_sub_ps _mm_mul_ps _mm_div_ps _mm_sqrt_ps _mm_min_ps _mm_max_ps _mm_set1_ps _mm_andnot_ps,
    |a, b, yes, no| above sse2_select(_mm_cmplt_ps(b, a), yes, no), at least sse2_select(_mm_cmple_ps(b, a), yes, no)
);

register!(
    /// Eight lanes of AVX2.
    Avx2Lanes(__m256), 8 lanes,
    _mm256_add_ps _mm256_sub_ps _mm256_mul_ps _mm256_div_ps _mm256_sqrt_ps _mm256_min_ps _mm256_max_ps _mm256_set1_ps
    _mm256_andnot_ps,
    |a, b, yes, no| above _mm256_blendv_ps(no, yes, _mm256_cmp_ps::<_CMP_GT_OQ>(a, b)),
    at least _mm256_blendv_ps(no, yes, _mm256_cmp_ps::<_CMP_GE_OQ>(a, b))
);

register!(
    /// Sixteen lanes of AVX-512.
    Avx512Lanes(__m512), 16 lanes,
    _mm512_add_ps _mm512_sub_ps _mm512_mul_ps _mm512_div_ps _mm512_sqrt_ps _mm512_min_ps _mm512_max_ps _mm512_set1_ps
    avx512_andnot,
    |a, b, yes, no| above _mm512_mask_blend_ps(_mm512_cmp_ps_mask::<_CMP_GT_OQ>(a, b), no, yes),
    at least _mm512_mask_blend_ps(_mm512_cmp_ps_mask::<_CMP_GE_OQ>(a, b), no, yes)
);

/// `yes` where the mask is set, else `no`.
///
/// # Safety
/// None: SSE2 is in every x86-64.
#[inline(always)]
unsafe fn sse2_select(mask: __m128, yes: __m128, no: __m128) -> __m128 {
    // SAFETY: SSE2 is in every x86-64.
    unsafe { _mm_or_ps(_mm_and_ps(mask, yes), _mm_andnot_ps(mask, no)) }
}

/// `!a & b`; AVX-512 F has it for integers only.
///
/// # Safety
/// The machine must have AVX-512 F.
#[inline(always)]
unsafe fn avx512_andnot(a: __m512, b: __m512) -> __m512 {
    // SAFETY: promised by the caller.
    unsafe { _mm512_castsi512_ps(_mm512_andnot_si512(_mm512_castps_si512(a), _mm512_castps_si512(b))) }
}

/// # Safety
/// None: SSE2 is in every x86-64.
#[inline(always)]
unsafe fn load(quad: &Quad) -> __m128 {
    // SAFETY: a quad is 16 readable bytes, and the load asks for no alignment.
    unsafe { _mm_loadu_ps(quad.as_ptr()) }
}

impl Lanes<4> for Sse2Lanes {
    #[inline(always)]
    fn from_array(array: [f32; 4]) -> Self {
        // SAFETY: the register is as many floats.
        Self(unsafe { std::mem::transmute::<[f32; 4], __m128>(array) })
    }

    #[inline(always)]
    fn to_array(self) -> [f32; 4] {
        // SAFETY: the register is as many floats.
        unsafe { std::mem::transmute::<__m128, [f32; 4]>(self.0) }
    }

    #[inline(always)]
    fn positive(self) -> u32 {
        // SAFETY: see the module: the machine has the instructions.
        unsafe { _mm_movemask_ps(_mm_cmplt_ps(_mm_setzero_ps(), self.0)) as u32 }
    }

    #[inline(always)]
    fn load(records: &[&Quad; 4]) -> [Self; 4] {
        // SAFETY: SSE2 is in every x86-64.
        unsafe {
            let [a, b, c, d] = [load(records[0]), load(records[1]), load(records[2]), load(records[3])];
            let (ab, cd) = (_mm_unpacklo_ps(a, b), _mm_unpacklo_ps(c, d));
            let (ab2, cd2) = (_mm_unpackhi_ps(a, b), _mm_unpackhi_ps(c, d));
            [
                Self(_mm_movelh_ps(ab, cd)),
                Self(_mm_movehl_ps(cd, ab)),
                Self(_mm_movelh_ps(ab2, cd2)),
                Self(_mm_movehl_ps(cd2, ab2)),
            ]
        }
    }

    #[inline(always)]
    fn store(columns: &[Self; 4]) -> [Quad; 4] {
        // A transpose undoes itself.
        let [a, b, c, d] = columns.map(Self::to_array);
        Self::load(&[&a, &b, &c, &d]).map(Self::to_array)
    }
}

impl Lanes<8> for Avx2Lanes {
    #[inline(always)]
    fn from_array(array: [f32; 8]) -> Self {
        // SAFETY: the register is as many floats.
        Self(unsafe { std::mem::transmute::<[f32; 8], __m256>(array) })
    }

    #[inline(always)]
    fn to_array(self) -> [f32; 8] {
        // SAFETY: the register is as many floats.
        unsafe { std::mem::transmute::<__m256, [f32; 8]>(self.0) }
    }

    #[inline(always)]
    fn positive(self) -> u32 {
        // SAFETY: see the module: the machine has the instructions.
        unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_GT_OQ>(self.0, _mm256_setzero_ps())) as u32 }
    }

    #[inline(always)]
    fn load(records: &[&Quad; 8]) -> [Self; 4] {
        let mut rows = [Self::ZERO; 4];
        for j in 0..4 {
            // SAFETY: see the module: the machine has AVX2.
            rows[j].0 =
                unsafe { _mm256_insertf128_ps::<1>(_mm256_castps128_ps256(load(records[j])), load(records[4 + j])) };
        }
        Self::transpose(rows)
    }

    #[inline(always)]
    fn store(columns: &[Self; 4]) -> [Quad; 8] {
        let rows = Self::transpose(*columns);
        let mut quads = [[0.0; 4]; 8];
        for j in 0..4 {
            // SAFETY: see the module: the machine has AVX2; each store stays within its quad.
            unsafe {
                _mm_storeu_ps(quads[j].as_mut_ptr(), _mm256_castps256_ps128(rows[j].0));
                _mm_storeu_ps(quads[4 + j].as_mut_ptr(), _mm256_extractf128_ps::<1>(rows[j].0));
            }
        }
        quads
    }
}

impl Avx2Lanes {
    #[inline(always)]
    fn transpose([a, b, c, d]: [Self; 4]) -> [Self; 4] {
        // SAFETY: see the module: the machine has AVX2.
        unsafe {
            let (ab, cd) = (_mm256_unpacklo_ps(a.0, b.0), _mm256_unpacklo_ps(c.0, d.0));
            let (ab2, cd2) = (_mm256_unpackhi_ps(a.0, b.0), _mm256_unpackhi_ps(c.0, d.0));
            [
                Self(_mm256_shuffle_ps::<0x44>(ab, cd)),
                Self(_mm256_shuffle_ps::<0xee>(ab, cd)),
                Self(_mm256_shuffle_ps::<0x44>(ab2, cd2)),
                Self(_mm256_shuffle_ps::<0xee>(ab2, cd2)),
            ]
        }
    }
}

impl Lanes<16> for Avx512Lanes {
    #[inline(always)]
    fn from_array(array: [f32; 16]) -> Self {
        // SAFETY: the register is as many floats.
        Self(unsafe { std::mem::transmute::<[f32; 16], __m512>(array) })
    }

    #[inline(always)]
    fn to_array(self) -> [f32; 16] {
        // SAFETY: the register is as many floats.
        unsafe { std::mem::transmute::<__m512, [f32; 16]>(self.0) }
    }

    #[inline(always)]
    fn positive(self) -> u32 {
        // SAFETY: see the module: the machine has the instructions.
        unsafe { u32::from(_mm512_cmp_ps_mask::<_CMP_GT_OQ>(self.0, _mm512_setzero_ps())) }
    }

    #[inline(always)]
    fn load(records: &[&Quad; 16]) -> [Self; 4] {
        let mut rows = [Self::ZERO; 4];
        for j in 0..4 {
            // SAFETY: see the module: the machine has AVX-512 F.
            rows[j].0 = unsafe {
                let first = _mm512_castps128_ps512(load(records[j]));
                let second = _mm512_insertf32x4::<1>(first, load(records[4 + j]));
                let third = _mm512_insertf32x4::<2>(second, load(records[8 + j]));
                _mm512_insertf32x4::<3>(third, load(records[12 + j]))
            };
        }
        Self::transpose(rows)
    }

    #[inline(always)]
    fn store(columns: &[Self; 4]) -> [Quad; 16] {
        let rows = Self::transpose(*columns);
        let mut quads = [[0.0; 4]; 16];
        for j in 0..4 {
            // SAFETY: see the module: the machine has AVX-512 F; each store stays within its quad.
            unsafe {
                _mm_storeu_ps(quads[j].as_mut_ptr(), _mm512_castps512_ps128(rows[j].0));
                _mm_storeu_ps(quads[4 + j].as_mut_ptr(), _mm512_extractf32x4_ps::<1>(rows[j].0));
                _mm_storeu_ps(quads[8 + j].as_mut_ptr(), _mm512_extractf32x4_ps::<2>(rows[j].0));
                _mm_storeu_ps(quads[12 + j].as_mut_ptr(), _mm512_extractf32x4_ps::<3>(rows[j].0));
            }
        }
        quads
    }
}

impl Avx512Lanes {
    #[inline(always)]
    fn transpose([a, b, c, d]: [Self; 4]) -> [Self; 4] {
        // SAFETY: see the module: the machine has AVX-512 F.
        unsafe {
            let (ab, cd) = (_mm512_unpacklo_ps(a.0, b.0), _mm512_unpacklo_ps(c.0, d.0));
            let (ab2, cd2) = (_mm512_unpackhi_ps(a.0, b.0), _mm512_unpackhi_ps(c.0, d.0));
            [
                Self(_mm512_shuffle_ps::<0x44>(ab, cd)),
                Self(_mm512_shuffle_ps::<0xee>(ab, cd)),
                Self(_mm512_shuffle_ps::<0x44>(ab2, cd2)),
                Self(_mm512_shuffle_ps::<0xee>(ab2, cd2)),
            ]
        }
    }
}
