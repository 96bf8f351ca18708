//! Lanes of rotations and poses, each lane with the operations and their order of [`crate::math::Rotation`] and
//! [`crate::math::Pose`].

use super::{LaneRotation, LaneVec3, Lanes, Number, Quad};

/// Poses side by side.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LanePose<W> {
    pub rotation: LaneRotation<W>,
    pub position: LaneVec3<W>,
}

impl<W: Number> LanePose<W> {
    /// From records whose first seven numbers are position and rotation.
    #[inline(always)]
    pub fn load<const N: usize, const L: usize>(records: &[&[Quad; N]; L]) -> Self
    where
        W: Lanes<L>,
    {
        let [x, y, z, qx] = W::load_quad(records, 0);
        let [qy, qz, w, _] = W::load_quad(records, 1);
        Self { rotation: LaneRotation { vector: LaneVec3 { x: qx, y: qy, z: qz }, w }, position: LaneVec3 { x, y, z } }
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
    use crate::math::{Pose, Rotation, Vec3};
    use crate::simd::Wide;

    fn record(pose: &Pose) -> [Quad; 2] {
        let (p, q) = (pose.position, pose.rotation);
        [[p.x, p.y, p.z, q.x], [q.y, q.z, q.w, 0.0]]
    }

    fn rotation_of(q: &LaneRotation<Wide<8>>, lane: usize) -> Rotation {
        let v = q.vector.get(lane);
        Rotation::from_xyzw(v.x, v.y, v.z, q.w[lane])
    }

    /// What lanes compute is what one pose computes, bit for bit.
    #[test]
    fn lanes_are_poses_side_by_side() {
        let pose = |i: usize| {
            let s = 0.37 * i as f32;
            Pose::new(Vec3::new(s, 1.0 - s, 0.3 * s), Rotation::from_xyzw(s, 0.4, -0.2 * s, 1.0).normalize())
        };
        let first: [[Quad; 2]; 8] = std::array::from_fn(|lane| record(&pose(lane)));
        let second: [[Quad; 2]; 8] = std::array::from_fn(|lane| record(&pose(lane * 3 + 1)));
        let a = LanePose::<Wide<8>>::load(&first.each_ref());
        let b = LanePose::<Wide<8>>::load(&second.each_ref());
        let (relative, axes) = (a.relative(&b), a.rotation.axes());
        let turned = a.rotation.rotate(&b.position);
        for lane in 0..8 {
            let (a, b) = (pose(lane), pose(lane * 3 + 1));
            let found = Pose::new(relative.position.get(lane), rotation_of(&relative.rotation, lane));
            assert_eq!(found, a.relative(&b));
            assert_eq!(turned.get(lane), a.rotation.rotate(b.position));
            let m = a.rotation.to_mat3();
            assert_eq!([m.x_axis, m.y_axis, m.z_axis], [axes[0].get(lane), axes[1].get(lane), axes[2].get(lane)]);
        }
    }
}
