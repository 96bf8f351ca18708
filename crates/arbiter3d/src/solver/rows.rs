//! Wide rows: `L` contact manifolds side by side, each with up to `P` points on one normal.
//!
//! Both levers of a point end at the same place but for its gap, which lies along the normal: `r₂ × n` and `r₁ × n`
//! differ by the same vector for all points of a row, its *offset*. So a point stores `a = r₁ × n` alone; its normal
//! velocity is `n·(v₂ − v₁) + offset·ω₂ + a·(ω₂ − ω₁)`, and its separation to first order the same expression with the
//! displacements of the step. (Points that users register may have drifted apart sideways, by up to the break distance:
//! their row takes the mean offset.)
//!
//! The points of a row are solved one after the other (Gauss–Seidel), but in the space of their normal velocities: `coupling`
//! holds how much an impulse at point `i` changes the normal velocity at point `j`, so the bodies are read and written once a
//! row.
//!
//! What both passes need stands in [`NormalRow`]; what only the relax pass needs stands in [`FrictionRow`], so that the
//! biased pass streams less memory: passes over more rows than the cache holds take as long as their bytes. What few
//! rows need (rolling, restitution, conveyors, anisotropic friction, locked axes) stands in [`ExtraRow`]: only those
//! wide rows have one that ask for it, and it is read where [`RowFeatures`] say so.

use crate::simd::{LaneSymmetric, LaneVec3, Lanes, Number};

/// One point of a wide row.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(crate) struct NormalPoint<W> {
    /// `r₁ × n`.
    pub arm: LaneVec3<W>,
    /// Gap when the step began.
    pub separation: W,
    /// Effective mass: zero in an empty lane.
    pub mass: W,
}

/// The normal part of `L` manifolds of up to `P` points; `C` is `P (P − 1) / 2`.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct NormalRow<W, const L: usize, const P: usize, const C: usize> {
    pub body1: [u32; L],
    pub body2: [u32; L],
    pub normal: LaneVec3<W>,
    /// `(r₂ − r₁) × n`.
    pub offset: LaneVec3<W>,
    pub inverse_mass1: W,
    pub inverse_mass2: W,
    pub inverse_inertia1: LaneSymmetric<W>,
    pub inverse_inertia2: LaneSymmetric<W>,
    pub points: [NormalPoint<W>; P],
    /// Change of normal velocity at `j` by a unit impulse at `i`, for the pairs (0,1), (0,2), (0,3), (1,2), (1,3), (2,3).
    pub coupling: [W; C],
    /// Accumulated impulses of this substep.
    pub impulses: [W; P],
}

/// Friction of `L` manifolds.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct FrictionRow<W, const P: usize> {
    /// The other tangent is `n × t₁`.
    pub tangent1: LaneVec3<W>,
    /// From each body's centre of mass to the friction centre.
    pub lever1: LaneVec3<W>,
    pub lever2: LaneVec3<W>,
    /// Inverse of the 2×2 tangential response.
    pub mass11: W,
    pub mass12: W,
    pub mass22: W,
    pub twist_mass: W,
    pub friction: W,
    /// Distance of each point from the friction centre.
    pub levers: [W; P],
    pub impulse1: W,
    pub impulse2: W,
    pub twist_impulse: W,
    /// Sum of the normal impulses over the substeps done.
    pub totals: [W; P],
    /// Largest tangential drift of a cached contact when the step began. Read once a step.
    pub drift: W,
}

/// What few rows need.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct ExtraRow<W, const P: usize> {
    /// 1 for each world axis along which a body is free to move, else 0.
    pub free1: LaneVec3<W>,
    pub free2: LaneVec3<W>,
    /// Surface velocity along the tangents.
    pub target1: W,
    pub target2: W,
    /// Friction along the first tangent as a share of that along the second; 0 where both are the same.
    pub ratio: W,
    pub rolling_resistance: W,
    pub rolling_impulse: LaneVec3<W>,
    pub restitution: W,
    /// Normal velocity with which each point would hit: negative when closing.
    pub approach: [W; P],
}

/// Which parts of an [`ExtraRow`] a wide row uses; the others hold nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct RowFeatures {
    /// Some body cannot move along some axis.
    pub locks: bool,
    pub conveyor: bool,
    /// Friction differs along a direction.
    pub anisotropic: bool,
    pub rolling: bool,
    pub restitution: bool,
}

impl RowFeatures {
    /// Whether the extra row is used at all.
    pub fn any(self) -> bool {
        self.locks | self.conveyor | self.anisotropic | self.rolling | self.restitution
    }
}

impl<W: Lanes<L>, const L: usize, const P: usize, const C: usize> NormalRow<W, L, P, C> {
    /// A row of empty lanes, all on the world's own body.
    pub const EMPTY: Self = Self {
        body1: [super::bodies::READ_ONLY; L],
        body2: [super::bodies::READ_ONLY; L],
        normal: LaneVec3::ZERO,
        offset: LaneVec3::ZERO,
        inverse_mass1: W::ZERO,
        inverse_mass2: W::ZERO,
        inverse_inertia1: LaneSymmetric::ZERO,
        inverse_inertia2: LaneSymmetric::ZERO,
        points: [NormalPoint { arm: LaneVec3::ZERO, separation: W::ZERO, mass: W::ZERO }; P],
        coupling: [W::ZERO; C],
        impulses: [W::ZERO; P],
    };
}

impl<W: Number, const P: usize> FrictionRow<W, P> {
    /// A row of empty lanes.
    pub const EMPTY: Self = Self {
        tangent1: LaneVec3::ZERO,
        lever1: LaneVec3::ZERO,
        lever2: LaneVec3::ZERO,
        mass11: W::ZERO,
        mass12: W::ZERO,
        mass22: W::ZERO,
        twist_mass: W::ZERO,
        friction: W::ZERO,
        levers: [W::ZERO; P],
        impulse1: W::ZERO,
        impulse2: W::ZERO,
        twist_impulse: W::ZERO,
        totals: [W::ZERO; P],
        drift: W::ZERO,
    };
}

impl<W: Number, const P: usize> ExtraRow<W, P> {
    /// Nothing.
    pub const EMPTY: Self = Self {
        free1: LaneVec3::ZERO,
        free2: LaneVec3::ZERO,
        target1: W::ZERO,
        target2: W::ZERO,
        ratio: W::ZERO,
        rolling_resistance: W::ZERO,
        rolling_impulse: LaneVec3::ZERO,
        restitution: W::ZERO,
        approach: [W::ZERO; P],
    };
}
