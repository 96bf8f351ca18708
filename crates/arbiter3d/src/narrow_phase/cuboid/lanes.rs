//! Pairs of cuboids side by side, and their contacts.

use super::super::polyhedron::cuboid_size;
use super::super::{Manifold, ManifoldPoint};
use crate::math::{Pose, Real, Vec3, min};
use crate::shape::Cuboid;
use crate::simd::{Number, Wide, WidePose, WideVec3};

/// `L` pairs of cuboids, each told in the frame of its first.
pub(crate) struct CuboidLanes<const L: usize> {
    pub(super) half1: WideVec3<L>,
    pub(super) half2: WideVec3<L>,
    pub(super) pose: WidePose<L>,
    pub(super) margin: Wide<L>,
    /// [`cuboid_size`] of the smaller one: what tolerances are shares of.
    pub(super) size: Wide<L>,
}

impl<const L: usize> CuboidLanes<L> {
    /// No pairs.
    pub(crate) const EMPTY: Self = Self {
        half1: WideVec3::ZERO,
        half2: WideVec3::ZERO,
        pose: WidePose::ZERO,
        margin: Wide::ZERO,
        size: Wide::ZERO,
    };

    /// Puts a pair into a lane.
    #[inline(always)]
    pub(crate) fn set(&mut self, lane: usize, (cuboid1, cuboid2): (&Cuboid, &Cuboid), pose: &Pose, margin: Real) {
        self.half1.set(lane, cuboid1.half_extents());
        self.half2.set(lane, cuboid2.half_extents());
        self.pose.set(lane, pose);
        self.margin[lane] = margin;
        self.size[lane] = min(cuboid_size(cuboid1.half_extents()), cuboid_size(cuboid2.half_extents()));
    }
}

/// Chooses one of three in each lane.
#[derive(Clone, Copy)]
pub(super) struct Pick<const L: usize>(pub Wide<L>);

impl<const L: usize> Pick<L> {
    #[inline(always)]
    pub fn of(&self, [x, y, z]: [Wide<L>; 3]) -> Wide<L> {
        self.0.if_above(Wide::splat(1.5), z, self.0.if_above(Wide::splat(0.5), y, x))
    }
}

/// Up to four contact points in each of `L` lanes, in the frame of shape 1, all of a lane along one normal.
pub(crate) struct WideManifold<const L: usize> {
    pub(crate) point1: [WideVec3<L>; 4],
    pub(crate) separation: [Wide<L>; 4],
    pub(crate) feature: [[u32; L]; 4],
    pub(crate) normal: WideVec3<L>,
    pub(crate) count: [u32; L],
}

impl<const L: usize> WideManifold<L> {
    pub(super) const EMPTY: Self = Self {
        point1: [WideVec3::ZERO; 4],
        separation: [Wide::ZERO; 4],
        feature: [[0; L]; 4],
        normal: WideVec3::ZERO,
        count: [0; L],
    };

    /// Replaces the points of a lane by at most one.
    pub(super) fn set_point(&mut self, lane: usize, point: Option<ManifoldPoint>) {
        self.count[lane] = u32::from(point.is_some());
        let Some(point) = point else { return };
        self.normal.set(lane, point.normal);
        self.point1[0].set(lane, point.point1);
        self.separation[0][lane] = point.separation;
        self.feature[0][lane] = point.feature;
    }

    /// Whether a lane has points and none deeper than `depth`.
    pub(super) fn stands_in(&self, lane: usize, depth: Real) -> bool {
        let count = self.count[lane] as usize;
        count > 0 && self.separation[..count].iter().all(|separation| separation[lane] >= depth)
    }

    /// Adds the points of a lane to a manifold.
    pub(crate) fn push_lane(&self, lane: usize, manifold: &mut Manifold) {
        let normal: Vec3 = self.normal.get(lane);
        for i in 0..self.count[lane] as usize {
            manifold.push(ManifoldPoint {
                point1: self.point1[i].get(lane),
                normal,
                separation: self.separation[i][lane],
                feature: self.feature[i][lane],
            });
        }
    }
}
