//! Asks for memory ahead of its use.
//!
//! Records of bodies, shapes and arbiters are read at places that follow from other records: their latency, not the
//! arithmetic, is what a pair costs. A hint changes no result, and where a target has none it is left out.

/// Asks for the cache lines of a record that will be read soon. The pointer need not be valid.
#[inline(always)]
pub(crate) fn prefetch<T>(record: *const T) {
    let mut offset = 0;
    while offset < size_of::<T>() {
        prefetch_line(record.wrapping_byte_add(offset));
        offset += 64;
    }
}

/// Asks for the first cache line of a record.
#[inline(always)]
pub(crate) fn prefetch_line<T>(record: *const T) {
    #[cfg(target_arch = "x86_64")]
    // SAFETY: a prefetch reads nothing and faults on no address; SSE is part of the target.
    unsafe {
        std::arch::x86_64::_mm_prefetch::<{ std::arch::x86_64::_MM_HINT_T0 }>(record.cast());
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = record;
}
