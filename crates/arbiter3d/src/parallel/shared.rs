//! A slice that several threads write at different places.

use std::marker::PhantomData;

/// A mutable slice split by agreement: every thread touches only the elements that its block owns.
pub(crate) struct SharedSlice<'a, T> {
    start: *mut T,
    len: usize,
    borrow: PhantomData<&'a mut [T]>,
}

// SAFETY: elements are handed out one at a time under the contract of `get_mut`, so sharing the slice moves `T`s between
// threads at most: `T: Send` is enough.
unsafe impl<T: Send> Send for SharedSlice<'_, T> {}
// SAFETY: as above.
unsafe impl<T: Send> Sync for SharedSlice<'_, T> {}

impl<'a, T> SharedSlice<'a, T> {
    /// Shares a slice for as long as it is borrowed.
    pub fn new(slice: &'a mut [T]) -> Self {
        Self { start: slice.as_mut_ptr(), len: slice.len(), borrow: PhantomData }
    }

    /// One element.
    ///
    /// # Safety
    /// No other thread may touch element `index` while the reference lives, and this thread may hold no other reference to it.
    #[inline(always)]
    #[expect(clippy::mut_from_ref, reason = "disjointness is the caller's promise")]
    pub unsafe fn get_mut(&self, index: usize) -> &mut T {
        assert!(index < self.len, "index {index} of a shared slice of {}", self.len);
        // SAFETY: in bounds; unaliased by the caller's promise.
        unsafe { &mut *self.start.add(index) }
    }

    /// Where an element is, for writing single fields of it: the references of [`Self::get_mut`] would claim it whole.
    #[inline(always)]
    pub fn at(&self, index: usize) -> *mut T {
        assert!(index < self.len, "index {index} of a shared slice of {}", self.len);
        // SAFETY: in bounds.
        unsafe { self.start.add(index) }
    }

    /// One element to read, in bounds by construction.
    ///
    /// # Safety
    /// `index` must be in bounds, and no thread may write the element while the reference lives.
    #[inline(always)]
    pub unsafe fn get(&self, index: usize) -> &T {
        debug_assert!(index < self.len, "index {index} of a shared slice of {}", self.len);
        // SAFETY: promised by the caller.
        unsafe { &*self.start.add(index) }
    }

    /// One element to write, in bounds by construction.
    ///
    /// # Safety
    /// As [`SharedSlice::get_mut`], and `index` must be in bounds.
    #[inline(always)]
    #[expect(clippy::mut_from_ref, reason = "disjointness is the caller's promise")]
    pub unsafe fn get_unchecked_mut(&self, index: usize) -> &mut T {
        debug_assert!(index < self.len, "index {index} of a shared slice of {}", self.len);
        // SAFETY: promised by the caller.
        unsafe { &mut *self.start.add(index) }
    }

    /// Asks for an element to be brought into the cache.
    #[inline(always)]
    pub fn prefetch(&self, index: usize) {
        if index < self.len {
            // SAFETY: in bounds; not read.
            crate::simd::prefetch(unsafe { &*self.start.add(index).cast::<std::mem::MaybeUninit<T>>() });
        }
    }

    /// Asks for the part of an element that begins `offset` bytes into it.
    #[inline(always)]
    pub fn prefetch_bytes(&self, index: usize, offset: usize) {
        if index < self.len && offset < size_of::<T>() {
            // SAFETY: in bounds; not read.
            crate::simd::prefetch(unsafe { &*self.start.add(index).cast::<std::mem::MaybeUninit<u8>>().add(offset) });
        }
    }

    /// A run of elements.
    ///
    /// # Safety
    /// As [`SharedSlice::get_mut`], for every element of the run.
    #[inline(always)]
    #[expect(clippy::mut_from_ref, reason = "disjointness is the caller's promise")]
    pub unsafe fn range_mut(&self, start: usize, end: usize) -> &mut [T] {
        assert!(start <= end && end <= self.len, "run {start}..{end} of a shared slice of {}", self.len);
        // SAFETY: in bounds; unaliased by the caller's promise.
        unsafe { std::slice::from_raw_parts_mut(self.start.add(start), end - start) }
    }
}
