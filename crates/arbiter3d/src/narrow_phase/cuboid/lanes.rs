//! Pairs of cuboids side by side, and their contacts.

use super::super::{Manifold, ManifoldPoint};
use crate::math::{Pose, Real, Rotation, Vec3, min};
use crate::shape::Cuboid;
use crate::shape::polyhedron::cuboid_size;
use crate::simd::{LanePose, LaneRotation, LaneVec3, Lanes, Number, Quad, Wide};

/// Two cuboids, told in the frame of the first, in groups of four numbers: half extents of the first and margin; half
/// extents of the second and [`cuboid_size`] of the smaller one; rotation; position.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CuboidPair([Quad; 4]);

impl CuboidPair {
    /// No boxes.
    pub(crate) const NONE: Self = Self([[0.0; 4]; 4]);

    #[inline(always)]
    pub(crate) fn new((cuboid1, cuboid2): (&Cuboid, &Cuboid), pose: &Pose, margin: Real) -> Self {
        let (a, b) = (cuboid1.half_extents(), cuboid2.half_extents());
        let (p, q) = (pose.position, pose.rotation);
        let size = min(cuboid_size(a), cuboid_size(b));
        Self([[a.x, a.y, a.z, margin], [b.x, b.y, b.z, size], [q.x, q.y, q.z, q.w], [p.x, p.y, p.z, 0.0]])
    }

    pub(super) fn half1(&self) -> Vec3 {
        let [x, y, z, _] = self.0[0];
        Vec3::new(x, y, z)
    }

    pub(super) fn half2(&self) -> Vec3 {
        let [x, y, z, _] = self.0[1];
        Vec3::new(x, y, z)
    }

    pub(super) fn pose(&self) -> Pose {
        let ([x, y, z, w], [px, py, pz, _]) = (self.0[2], self.0[3]);
        Pose::new(Vec3::new(px, py, pz), Rotation::from_xyzw(x, y, z, w))
    }

    pub(super) fn margin(&self) -> Real {
        self.0[0][3]
    }

    pub(super) fn size(&self) -> Real {
        self.0[1][3]
    }
}

/// [`CuboidPair`]s side by side.
pub(crate) struct CuboidLanes<W> {
    pub(super) half1: LaneVec3<W>,
    pub(super) half2: LaneVec3<W>,
    pub(super) pose: LanePose<W>,
    pub(super) margin: W,
    /// What tolerances are shares of.
    pub(super) size: W,
}

impl<W: Number> CuboidLanes<W> {
    #[inline(always)]
    pub(crate) fn load<const L: usize>(pairs: &[&CuboidPair; L]) -> Self
    where
        W: Lanes<L>,
    {
        let mut records = [&CuboidPair::NONE.0; L];
        for (record, pair) in records.iter_mut().zip(pairs) {
            *record = &pair.0;
        }
        let [ax, ay, az, margin] = W::load_quad(&records, 0);
        let [bx, by, bz, size] = W::load_quad(&records, 1);
        let [qx, qy, qz, w] = W::load_quad(&records, 2);
        let [x, y, z, _] = W::load_quad(&records, 3);
        let rotation = LaneRotation { vector: LaneVec3 { x: qx, y: qy, z: qz }, w };
        Self {
            half1: LaneVec3 { x: ax, y: ay, z: az },
            half2: LaneVec3 { x: bx, y: by, z: bz },
            pose: LanePose { rotation, position: LaneVec3 { x, y, z } },
            margin,
            size,
        }
    }
}

/// In each lane one of three: `which` is 0, 1 or 2.
#[inline(always)]
pub(super) fn pick<W: Number>(which: W, [x, y, z]: [W; 3]) -> W {
    which.if_above(W::splat(1.5), z, which.if_above(W::splat(0.5), y, x))
}

/// Up to four contact points in each of `L` lanes, in the frame of shape 1, all of a lane along one normal.
///
/// In plain arrays, since points are chosen lane by lane.
pub(crate) struct WideManifold<const L: usize> {
    pub(crate) point1: [LaneVec3<Wide<L>>; 4],
    pub(crate) separation: [Wide<L>; 4],
    pub(crate) feature: [[u32; L]; 4],
    pub(crate) normal: LaneVec3<Wide<L>>,
    pub(crate) count: [u32; L],
}

impl<const L: usize> WideManifold<L> {
    pub(crate) const EMPTY: Self = Self {
        point1: [LaneVec3::ZERO; 4],
        separation: [Wide::ZERO; 4],
        feature: [[0; L]; 4],
        normal: LaneVec3::ZERO,
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
