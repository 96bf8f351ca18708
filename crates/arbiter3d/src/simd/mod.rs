//! Wide numbers and the choice of instruction set at run time.
//!
//! Kernels are written once over a type of numbers in lanes ([`Lanes`]): registers of SSE2, AVX2 or AVX-512 on x86-64, plain
//! arrays elsewhere. Lanes never mix and every operation is that of IEEE, so every level gives the same bits.
//!
//! [`Instructions::run`] enters a kernel under the instructions of a level. Fused multiply-add is never enabled.

mod pose;
mod quads;
mod vector;
mod wide;
#[cfg(target_arch = "x86_64")]
mod x86;

pub(crate) use pose::LanePose;
pub(crate) use quads::{quad_view, size_of_words};
pub(crate) use vector::{LaneRotation, LaneSymmetric, LaneVec3};
pub(crate) use wide::{Lanes, Number, Quad, Wide};
#[cfg(target_arch = "x86_64")]
pub(crate) use x86::{Avx2Lanes, Avx512Lanes, Sse2Lanes};

use std::fmt;
use std::str::FromStr;

/// An instruction set that the solver can use. Results are the same bits for all.
///
/// ```
/// use arbiter3d::SimdLevel;
/// assert!(SimdLevel::best().is_available());
/// assert_eq!("avx2".parse(), Ok(SimdLevel::Avx2));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[non_exhaustive]
pub enum SimdLevel {
    /// One lane at a time.
    Scalar,
    /// x86-64's baseline, 4 lanes.
    Sse2,
    /// 8 lanes.
    Avx2,
    /// AVX-512 F, DQ and VL.
    Avx512,
    /// AArch64's baseline, 4 lanes.
    Neon,
    /// WebAssembly's 128-bit SIMD, 4 lanes.
    WasmSimd128,
}

impl SimdLevel {
    /// All levels, in order.
    const ALL: [Self; 6] = [Self::Scalar, Self::Sse2, Self::Avx2, Self::Avx512, Self::Neon, Self::WasmSimd128];

    /// The widest level of this machine.
    #[must_use]
    pub fn best() -> Self {
        Self::ALL.into_iter().rev().find(|level| level.is_available()).unwrap_or(Self::Scalar)
    }

    /// The levels that this machine has, narrowest first.
    #[must_use]
    pub fn available() -> Vec<Self> {
        Self::ALL.into_iter().filter(|level| level.is_available()).collect()
    }

    /// Whether this machine has the instructions.
    #[must_use]
    pub fn is_available(self) -> bool {
        match self {
            Self::Scalar => true,
            Self::Sse2 => cfg!(target_arch = "x86_64"),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => std::arch::is_x86_feature_detected!("avx2"),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => {
                std::arch::is_x86_feature_detected!("avx512f")
                    && std::arch::is_x86_feature_detected!("avx512dq")
                    && std::arch::is_x86_feature_detected!("avx512vl")
            }
            #[cfg(not(target_arch = "x86_64"))]
            Self::Avx2 | Self::Avx512 => false,
            Self::Neon => cfg!(target_arch = "aarch64"),
            Self::WasmSimd128 => cfg!(all(target_arch = "wasm32", target_feature = "simd128")),
        }
    }
}

/// Instructions that a kernel may be compiled for; a value is the proof that this machine has them.
pub(crate) trait Instructions: Copy + Send + Sync {
    /// Runs a kernel with these instructions.
    fn run<K: Kernel>(self, kernel: K);
}

/// Asks for a value to be brought into the cache, for those who know what they will read next and the machine does not.
#[inline(always)]
pub(crate) fn prefetch<T>(value: &T) {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        const LINE: usize = 64;
        let start = std::ptr::from_ref(value).cast::<i8>();
        for offset in (0..size_of::<T>()).step_by(LINE) {
            // SAFETY: a hint that reads nothing, within the value.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(start.add(offset)) };
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = value;
}

/// What every machine of the target has.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Baseline;

impl Instructions for Baseline {
    #[inline]
    fn run<K: Kernel>(self, kernel: K) {
        kernel.run();
    }
}

/// AVX2.
#[cfg(target_arch = "x86_64")]
#[derive(Clone, Copy, Debug)]
pub(crate) struct Avx2(());

#[cfg(target_arch = "x86_64")]
impl Avx2 {
    /// The proof, where there is one.
    pub fn detect() -> Option<Self> {
        SimdLevel::Avx2.is_available().then_some(Self(()))
    }
}

#[cfg(target_arch = "x86_64")]
impl Instructions for Avx2 {
    #[inline]
    fn run<K: Kernel>(self, kernel: K) {
        // SAFETY: a value exists only after `detect` has found AVX2.
        unsafe { run_avx2(kernel) }
    }
}

/// AVX-512 F, DQ and VL.
#[cfg(target_arch = "x86_64")]
#[derive(Clone, Copy, Debug)]
pub(crate) struct Avx512(());

#[cfg(target_arch = "x86_64")]
impl Avx512 {
    /// The proof, where there is one.
    pub fn detect() -> Option<Self> {
        SimdLevel::Avx512.is_available().then_some(Self(()))
    }
}

#[cfg(target_arch = "x86_64")]
impl Instructions for Avx512 {
    #[inline]
    fn run<K: Kernel>(self, kernel: K) {
        // SAFETY: a value exists only after `detect` has found AVX-512 F, DQ and VL, which imply AVX2.
        unsafe { run_avx512(kernel) }
    }
}

/// Work on eight lanes at once, whatever the machine has: for kernels too short to be told their level in each step.
/// Implement `run` as `#[inline(always)]`.
pub(crate) trait KernelOfEight {
    /// Does the work.
    fn run<W: Lanes<8>>(self);
}

/// Runs a kernel of eight lanes with AVX2 where there is AVX2, else with what every machine has.
#[inline]
pub(crate) fn run_eight<K: KernelOfEight>(kernel: K) {
    #[cfg(target_arch = "x86_64")]
    if let Some(avx2) = Avx2::detect() {
        avx2.run(Eight::<K, Avx2Lanes>(kernel, std::marker::PhantomData));
        return;
    }
    kernel.run::<Wide<8>>();
}

/// A kernel of eight lanes with its lanes chosen.
struct Eight<K, W>(K, std::marker::PhantomData<W>);

impl<K: KernelOfEight, W: Lanes<8>> Kernel for Eight<K, W> {
    #[inline(always)]
    fn run(self) {
        self.0.run::<W>();
    }
}

/// Work to be compiled once per instruction set; implement `run` as `#[inline(always)]`.
pub(crate) trait Kernel {
    /// Does the work.
    fn run(self);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn run_avx2<K: Kernel>(kernel: K) {
    kernel.run();
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,avx512f,avx512dq,avx512vl")]
fn run_avx512<K: Kernel>(kernel: K) {
    kernel.run();
}

impl fmt::Display for SimdLevel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Scalar => "scalar",
            Self::Sse2 => "sse2",
            Self::Avx2 => "avx2",
            Self::Avx512 => "avx512",
            Self::Neon => "neon",
            Self::WasmSimd128 => "simd128",
        })
    }
}

/// A name that is no SIMD level.
///
/// ```
/// let error = "mmx".parse::<arbiter3d::SimdLevel>().unwrap_err();
/// assert!(error.to_string().contains("avx2"));
/// ```
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("'{name}' is no SIMD level: use scalar, sse2, avx2, avx512, neon or simd128")]
pub struct UnknownSimdLevel {
    name: String,
}

impl FromStr for SimdLevel {
    type Err = UnknownSimdLevel;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        let found = Self::ALL.into_iter().find(|level| level.to_string().eq_ignore_ascii_case(name));
        found.ok_or_else(|| UnknownSimdLevel { name: name.to_owned() })
    }
}
