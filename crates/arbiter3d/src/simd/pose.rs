//! Lanes of rotations and poses, each lane with the operations and their order of [`Rotation`] and [`Pose`].

use super::{LaneVec3, Number, Wide};
use crate::math::{Pose, Rotation};

/// `L` vectors side by side.
pub(crate) type WideVec3<const L: usize> = LaneVec3<Wide<L>>;

/// `L` unit quaternions side by side.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(crate) struct WideRotation<const L: usize> {
    pub x: Wide<L>,
    pub y: Wide<L>,
    pub z: Wide<L>,
    pub w: Wide<L>,
}

impl<const L: usize> WideRotation<L> {
    pub const ZERO: Self = Self { x: Wide::ZERO, y: Wide::ZERO, z: Wide::ZERO, w: Wide::ZERO };

    #[inline(always)]
    pub fn set(&mut self, lane: usize, q: Rotation) {
        self.x[lane] = q.x;
        self.y[lane] = q.y;
        self.z[lane] = q.z;
        self.w[lane] = q.w;
    }

    #[inline(always)]
    pub fn get(&self, lane: usize) -> Rotation {
        Rotation::from_xyzw(self.x[lane], self.y[lane], self.z[lane], self.w[lane])
    }

    #[inline(always)]
    pub fn vector(&self) -> WideVec3<L> {
        WideVec3 { x: self.x, y: self.y, z: self.z }
    }

    #[inline(always)]
    pub fn conjugate(&self) -> Self {
        Self { x: -self.x, y: -self.y, z: -self.z, w: self.w }
    }

    #[inline(always)]
    pub fn mul(&self, b: &Self) -> Self {
        let a = self;
        Self {
            x: a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
            y: a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
            z: a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w,
            w: a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z,
        }
    }

    #[inline(always)]
    pub fn rotate(&self, v: &WideVec3<L>) -> WideVec3<L> {
        let u = self.vector();
        let t = u.cross(v).scale(Wide::splat(2.0));
        *v + t.scale(self.w) + u.cross(&t)
    }

    #[inline(always)]
    pub fn inverse_rotate(&self, v: &WideVec3<L>) -> WideVec3<L> {
        self.conjugate().rotate(v)
    }

    /// The turned axes.
    #[inline(always)]
    pub fn axes(&self) -> [WideVec3<L>; 3] {
        let (x, y, z, w) = (self.x, self.y, self.z, self.w);
        let (x2, y2, z2) = (x + x, y + y, z + z);
        let (xx, xy, xz) = (x * x2, x * y2, x * z2);
        let (yy, yz, zz) = (y * y2, y * z2, z * z2);
        let (wx, wy, wz) = (w * x2, w * y2, w * z2);
        let one = Wide::splat(1.0);
        [
            WideVec3 { x: one - (yy + zz), y: xy + wz, z: xz - wy },
            WideVec3 { x: xy - wz, y: one - (xx + zz), z: yz + wx },
            WideVec3 { x: xz + wy, y: yz - wx, z: one - (xx + yy) },
        ]
    }
}

/// `L` poses side by side.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(crate) struct WidePose<const L: usize> {
    pub rotation: WideRotation<L>,
    pub position: WideVec3<L>,
}

impl<const L: usize> WidePose<L> {
    pub const ZERO: Self = Self { rotation: WideRotation::ZERO, position: WideVec3::ZERO };

    #[inline(always)]
    pub fn set(&mut self, lane: usize, pose: &Pose) {
        self.rotation.set(lane, pose.rotation);
        self.position.set(lane, pose.position);
    }

    #[inline(always)]
    pub fn get(&self, lane: usize) -> Pose {
        Pose::new(self.position.get(lane), self.rotation.get(lane))
    }

    /// The poses of `other` seen from these frames.
    #[inline(always)]
    pub fn relative(&self, other: &Self) -> Self {
        Self {
            rotation: self.rotation.conjugate().mul(&other.rotation),
            position: self.rotation.inverse_rotate(&(other.position - self.position)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Vec3;

    /// What lanes compute is what one pose computes, bit for bit.
    #[test]
    fn lanes_are_poses_side_by_side() {
        let pose = |i: usize| {
            let s = 0.37 * i as f32;
            Pose::new(Vec3::new(s, 1.0 - s, 0.3 * s), Rotation::from_xyzw(s, 0.4, -0.2 * s, 1.0).normalize())
        };
        let (mut a, mut b) = (WidePose::<8>::ZERO, WidePose::<8>::ZERO);
        for lane in 0..8 {
            a.set(lane, &pose(lane));
            b.set(lane, &pose(lane * 3 + 1));
        }
        let (relative, axes) = (a.relative(&b), a.rotation.axes());
        let turned = a.rotation.rotate(&b.position);
        for lane in 0..8 {
            let (a, b) = (pose(lane), pose(lane * 3 + 1));
            assert_eq!(relative.get(lane), a.relative(&b));
            assert_eq!(turned.get(lane), a.rotation.rotate(b.position));
            let m = a.rotation.to_mat3();
            assert_eq!([m.x_axis, m.y_axis, m.z_axis], [axes[0].get(lane), axes[1].get(lane), axes[2].get(lane)]);
        }
    }
}
