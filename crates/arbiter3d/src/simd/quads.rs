//! Records as groups of four numbers: how kernels load and store them.
//!
//! A view takes a run of fields that stand one after the other in memory and shows their words as [`Quad`]s. That they do
//! stand so, that they fill the groups, and that each is made of plain words is checked when the program is compiled, so
//! that a view of any record is safe.
//!
//! [`Quad`]: super::Quad

use crate::math::{Pose, Rotation, SymmetricMat3, Vec3};

/// A type made of words of four bytes without gaps, of which any bits are a value.
///
/// # Safety
/// It must be so: words are written as floats.
pub(crate) unsafe trait Words: Copy {}

// SAFETY: a word.
unsafe impl Words for f32 {}
// SAFETY: a word.
unsafe impl Words for u32 {}
// SAFETY: `repr(C)`, three floats.
unsafe impl Words for Vec3 {}
// SAFETY: `repr(C)`, four floats.
unsafe impl Words for Rotation {}
// SAFETY: `repr(C)`, a rotation and a vector.
unsafe impl Words for Pose {}
// SAFETY: `repr(C)`, six floats.
unsafe impl Words for SymmetricMat3 {}
// SAFETY: an array has no gaps but those of its elements.
unsafe impl<T: Words, const N: usize> Words for [T; N] {}

/// Bytes of a field, given how to reach it: this is where a field that is not made of words is refused.
pub(crate) const fn size_of_words<R, T: Words>(_: fn(&R) -> &T) -> usize {
    size_of::<T>()
}

/// A method of a record that shows fields, named in the order in which they lie in memory, as `[Quad; n]`; with a second
/// name, also the method to change them. The groups end within the last field named, or with it.
macro_rules! quad_view {
    (
        $(#[$about:meta])*
        $visibility:vis fn $read:ident $(, $(#[$about_write:meta])* $write:ident)?;
        [$count:literal] of $fields:tt
    ) => {
        $(#[$about])*
        #[inline(always)]
        $visibility fn $read(&self) -> &[$crate::simd::Quad; $count] {
            let start = $crate::simd::quad_view!(@start [$count] of $fields);
            // SAFETY: `@start` has found that there are so many words without gaps from there on.
            unsafe { &*std::ptr::from_ref(self).byte_add(start).cast() }
        }
        $(
            $(#[$about_write])*
            #[inline(always)]
            $visibility fn $write(&mut self) -> &mut [$crate::simd::Quad; $count] {
                let start = $crate::simd::quad_view!(@start [$count] of $fields);
                // SAFETY: as above, and any bits are a value of words.
                unsafe { &mut *std::ptr::from_mut(self).byte_add(start).cast() }
            }
        )?
    };
    // Where the first field starts; does not compile unless the fields are a run of words that fills the groups.
    (@start [$count:literal] of ($first:ident $(, $field:ident)*)) => {
        const {
            let start = std::mem::offset_of!(Self, $first);
            let end = start + $crate::simd::size_of_words(|record: &Self| &record.$first);
            $(
                assert!(std::mem::offset_of!(Self, $field) == end, "the field is not where the one before it ends");
                let end = end + $crate::simd::size_of_words(|record: &Self| &record.$field);
            )*
            assert!(end - start >= size_of::<[$crate::simd::Quad; $count]>(), "the fields do not fill the groups");
            start
        }
    };
}
pub(crate) use quad_view;

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Clone, Copy)]
    #[repr(C)]
    struct Record {
        flag: bool,
        position: Vec3,
        place: u32,
        rotation: Rotation,
    }

    impl Record {
        quad_view! {
            fn quads, quads_mut; [2] of (position, place, rotation)
        }

        quad_view! {
            fn second; [1] of (rotation)
        }
    }

    /// A view starts at its first field, whatever comes before it, and what is written through it is in the fields.
    #[test]
    fn a_view_is_its_fields_in_their_order() {
        let mut record = Record {
            flag: true,
            position: Vec3::new(1.0, 2.0, 3.0),
            place: 4.0_f32.to_bits(),
            rotation: Rotation::from_xyzw(5.0, 6.0, 7.0, 8.0),
        };
        assert_eq!(record.quads(), &[[1.0, 2.0, 3.0, 4.0], [5.0, 6.0, 7.0, 8.0]]);
        assert_eq!(record.second(), &[[5.0, 6.0, 7.0, 8.0]]);
        record.quads_mut()[0] = [9.0, 8.0, 7.0, -0.0];
        assert_eq!((record.position, record.place), (Vec3::new(9.0, 8.0, 7.0), 0x8000_0000));
        assert!(record.flag && record.rotation == Rotation::from_xyzw(5.0, 6.0, 7.0, 8.0));
    }
}
