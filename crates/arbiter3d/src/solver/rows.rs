//! Wide rows: `L` contact manifolds side by side, each with up to `P` points on one normal.
//!
//! A point stores `r × n` for both bodies instead of `r`: its normal velocity is `n·(v₂ − v₁) + (r₂×n)·ω₂ − (r₁×n)·ω₁`,
//! and its separation to first order is the same expression with the displacements of the step. The points of a row are
//! solved one after the other (Gauss–Seidel), but in the space of their normal velocities: `coupling` holds how much an
//! impulse at point `i` changes the normal velocity at point `j`, so the bodies are read and written once a row.
//!
//! What both passes need stands in [`NormalRow`]; what only the relax pass needs (friction, rolling, restitution) stands in
//! [`FrictionRow`], so that the biased pass streams half the memory.

use crate::simd::{Wide, WideSymmetric, WideVec3};

/// One point of a wide row.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(crate) struct NormalPoint<const L: usize> {
    /// `r₁ × n`.
    pub arm1: WideVec3<L>,
    /// `r₂ × n`.
    pub arm2: WideVec3<L>,
    /// Gap when the step began.
    pub separation: Wide<L>,
    /// Effective mass: zero in an empty lane.
    pub mass: Wide<L>,
}

/// The normal part of `L` manifolds of up to `P` points; `C` is `P (P − 1) / 2`.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct NormalRow<const L: usize, const P: usize, const C: usize> {
    pub body1: [u32; L],
    pub body2: [u32; L],
    pub normal: WideVec3<L>,
    pub inverse_mass1: WideVec3<L>,
    pub inverse_mass2: WideVec3<L>,
    pub inverse_inertia1: WideSymmetric<L>,
    pub inverse_inertia2: WideSymmetric<L>,
    pub points: [NormalPoint<L>; P],
    /// Change of normal velocity at `j` by a unit impulse at `i`, for the pairs (0,1), (0,2), (0,3), (1,2), (1,3), (2,3).
    pub coupling: [Wide<L>; C],
    /// Accumulated impulses of this substep.
    pub impulses: [Wide<L>; P],
}

/// Friction, rolling resistance and restitution of `L` manifolds.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct FrictionRow<const L: usize, const P: usize> {
    pub tangent1: WideVec3<L>,
    pub tangent2: WideVec3<L>,
    /// `r × t` at the friction centre: body 1 with tangent 1, body 2 with tangent 1, then with tangent 2.
    pub arm11: WideVec3<L>,
    pub arm21: WideVec3<L>,
    pub arm12: WideVec3<L>,
    pub arm22: WideVec3<L>,
    /// Inverse of the 2×2 tangential response.
    pub mass11: Wide<L>,
    pub mass12: Wide<L>,
    pub mass22: Wide<L>,
    pub twist_mass: Wide<L>,
    pub friction: Wide<L>,
    /// Distance of each point from the friction centre.
    pub levers: [Wide<L>; P],
    /// Surface velocity along the tangents.
    pub target1: Wide<L>,
    pub target2: Wide<L>,
    pub impulse1: Wide<L>,
    pub impulse2: Wide<L>,
    pub twist_impulse: Wide<L>,
    /// Sum of the normal impulses over the substeps done.
    pub totals: [Wide<L>; P],
    pub has_rolling: bool,
    pub has_restitution: bool,
    // From here on read by few rows, or once a step.
    pub rolling_resistance: Wide<L>,
    pub rolling_impulse: WideVec3<L>,
    pub restitution: Wide<L>,
    /// Normal velocity with which each point would hit: negative when closing.
    pub approach: [Wide<L>; P],
    /// Largest tangential drift of a cached contact when the step began.
    pub drift: Wide<L>,
}

impl<const L: usize, const P: usize, const C: usize> NormalRow<L, P, C> {
    /// A row of empty lanes, all on the world's own body.
    pub const EMPTY: Self = Self {
        body1: [super::bodies::READ_ONLY; L],
        body2: [super::bodies::READ_ONLY; L],
        normal: WideVec3::ZERO,
        inverse_mass1: WideVec3::ZERO,
        inverse_mass2: WideVec3::ZERO,
        inverse_inertia1: WideSymmetric::ZERO,
        inverse_inertia2: WideSymmetric::ZERO,
        points: [NormalPoint { arm1: WideVec3::ZERO, arm2: WideVec3::ZERO, separation: Wide::ZERO, mass: Wide::ZERO };
            P],
        coupling: [Wide::ZERO; C],
        impulses: [Wide::ZERO; P],
    };
}

impl<const L: usize, const P: usize> FrictionRow<L, P> {
    /// A row of empty lanes.
    pub const EMPTY: Self = Self {
        tangent1: WideVec3::ZERO,
        tangent2: WideVec3::ZERO,
        arm11: WideVec3::ZERO,
        arm21: WideVec3::ZERO,
        arm12: WideVec3::ZERO,
        arm22: WideVec3::ZERO,
        mass11: Wide::ZERO,
        mass12: Wide::ZERO,
        mass22: Wide::ZERO,
        twist_mass: Wide::ZERO,
        friction: Wide::ZERO,
        levers: [Wide::ZERO; P],
        target1: Wide::ZERO,
        target2: Wide::ZERO,
        impulse1: Wide::ZERO,
        impulse2: Wide::ZERO,
        twist_impulse: Wide::ZERO,
        totals: [Wide::ZERO; P],
        rolling_resistance: Wide::ZERO,
        rolling_impulse: WideVec3::ZERO,
        restitution: Wide::ZERO,
        approach: [Wide::ZERO; P],
        drift: Wide::ZERO,
        has_rolling: false,
        has_restitution: false,
    };
}
