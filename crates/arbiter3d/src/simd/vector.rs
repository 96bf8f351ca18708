//! Vectors, rotations and symmetric matrices in lanes, each lane on its own.

use super::{Lanes, Number, Wide};
use crate::math::Vec3;
use std::ops::{Add, Sub};

/// Vectors side by side, a lane each.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(crate) struct LaneVec3<W> {
    pub x: W,
    pub y: W,
    pub z: W,
}

impl<W: Number> LaneVec3<W> {
    pub const ZERO: Self = Self { x: W::ZERO, y: W::ZERO, z: W::ZERO };

    /// The same vector in all lanes.
    #[inline(always)]
    pub fn splat(v: Vec3) -> Self {
        Self { x: W::splat(v.x), y: W::splat(v.y), z: W::splat(v.z) }
    }

    /// The three coordinates.
    #[inline(always)]
    pub fn columns(&self) -> [W; 3] {
        [self.x, self.y, self.z]
    }

    #[inline(always)]
    pub fn dot(&self, o: &Self) -> W {
        self.x * o.x + self.y * o.y + self.z * o.z
    }

    #[inline(always)]
    pub fn cross(&self, o: &Self) -> Self {
        Self { x: self.y * o.z - self.z * o.y, y: self.z * o.x - self.x * o.z, z: self.x * o.y - self.y * o.x }
    }

    #[inline(always)]
    pub fn scale(&self, s: W) -> Self {
        Self { x: self.x * s, y: self.y * s, z: self.z * s }
    }

    /// Part by part.
    #[inline(always)]
    pub fn times(&self, o: &Self) -> Self {
        Self { x: self.x * o.x, y: self.y * o.y, z: self.z * o.z }
    }

    /// The same where `mask > 0`, else zero.
    #[inline(always)]
    pub fn if_positive(&self, mask: W) -> Self {
        Self {
            x: mask.if_positive(self.x, W::ZERO),
            y: mask.if_positive(self.y, W::ZERO),
            z: mask.if_positive(self.z, W::ZERO),
        }
    }

    /// `self + o · s`.
    #[inline(always)]
    pub fn add_scaled(&self, o: &Self, s: W) -> Self {
        Self { x: self.x + o.x * s, y: self.y + o.y * s, z: self.z + o.z * s }
    }

    /// `self − o · s`.
    #[inline(always)]
    pub fn sub_scaled(&self, o: &Self, s: W) -> Self {
        Self { x: self.x - o.x * s, y: self.y - o.y * s, z: self.z - o.z * s }
    }
}

impl<const L: usize> LaneVec3<Wide<L>> {
    /// The same numbers in lanes of another kind.
    #[inline(always)]
    pub fn to_lanes<W: Lanes<L>>(self) -> LaneVec3<W> {
        LaneVec3 { x: W::from_array(self.x.0), y: W::from_array(self.y.0), z: W::from_array(self.z.0) }
    }
}

/// Access to single lanes.
impl<W> LaneVec3<W> {
    /// The same numbers in plain arrays, whose lanes can be read and written one by one.
    #[inline(always)]
    pub fn to_wide<const L: usize>(self) -> LaneVec3<Wide<L>>
    where
        W: Lanes<L>,
    {
        LaneVec3 { x: Wide(self.x.to_array()), y: Wide(self.y.to_array()), z: Wide(self.z.to_array()) }
    }

    #[inline(always)]
    pub fn set<const L: usize>(&mut self, lane: usize, v: Vec3)
    where
        W: Lanes<L>,
    {
        self.x.set(lane, v.x);
        self.y.set(lane, v.y);
        self.z.set(lane, v.z);
    }

    #[inline(always)]
    pub fn get<const L: usize>(&self, lane: usize) -> Vec3
    where
        W: Lanes<L>,
    {
        Vec3::new(self.x.get(lane), self.y.get(lane), self.z.get(lane))
    }
}

impl<W: Number> Add for LaneVec3<W> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Self { x: self.x + o.x, y: self.y + o.y, z: self.z + o.z }
    }
}

impl<W: Number> Sub for LaneVec3<W> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Self { x: self.x - o.x, y: self.y - o.y, z: self.z - o.z }
    }
}

/// Unit quaternions side by side.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LaneRotation<W> {
    pub vector: LaneVec3<W>,
    pub w: W,
}

impl<W: Number> LaneRotation<W> {
    /// [`crate::math::Rotation::rotate`] in lanes.
    #[inline(always)]
    pub fn rotate(&self, v: &LaneVec3<W>) -> LaneVec3<W> {
        let t = self.vector.cross(v).scale(W::splat(2.0));
        *v + t.scale(self.w) + self.vector.cross(&t)
    }

    /// [`crate::math::Rotation::inverse_rotate`] in lanes.
    #[inline(always)]
    pub fn inverse_rotate(&self, v: &LaneVec3<W>) -> LaneVec3<W> {
        self.conjugate().rotate(v)
    }

    /// [`crate::math::Rotation::conjugate`] in lanes.
    #[inline(always)]
    pub fn conjugate(&self) -> Self {
        Self { vector: LaneVec3 { x: -self.vector.x, y: -self.vector.y, z: -self.vector.z }, w: self.w }
    }

    /// [`crate::math::Rotation::mul`] in lanes.
    #[inline(always)]
    pub fn mul(&self, other: &Self) -> Self {
        let (a, b, aw, bw) = (&self.vector, &other.vector, self.w, other.w);
        Self {
            vector: LaneVec3 {
                x: aw * b.x + a.x * bw + a.y * b.z - a.z * b.y,
                y: aw * b.y - a.x * b.z + a.y * bw + a.z * b.x,
                z: aw * b.z + a.x * b.y - a.y * b.x + a.z * bw,
            },
            w: aw * bw - a.x * b.x - a.y * b.y - a.z * b.z,
        }
    }

    /// The turned axes: the columns of [`crate::math::Rotation::to_mat3`].
    #[inline(always)]
    pub fn axes(&self) -> [LaneVec3<W>; 3] {
        let (LaneVec3 { x, y, z }, w) = (self.vector, self.w);
        let (x2, y2, z2) = (x + x, y + y, z + z);
        let (xx, xy, xz) = (x * x2, x * y2, x * z2);
        let (yy, yz, zz) = (y * y2, y * z2, z * z2);
        let (wx, wy, wz) = (w * x2, w * y2, w * z2);
        let one = W::splat(1.0);
        [
            LaneVec3 { x: one - (yy + zz), y: xy + wz, z: xz - wy },
            LaneVec3 { x: xy - wz, y: one - (xx + zz), z: yz + wx },
            LaneVec3 { x: xz + wy, y: yz - wx, z: one - (xx + yy) },
        ]
    }

    /// [`crate::math::Rotation::integrate`] in lanes.
    #[inline(always)]
    pub fn integrate(&self, angle: &LaneVec3<W>) -> Self {
        let grow = W::splat(0.5) * (W::splat(1.0) + angle.dot(angle) * W::splat(1.0 / 12.0));
        let (half, u, w) = (angle.scale(grow), &self.vector, self.w);
        let x = u.x + half.x * w + half.y * u.z - half.z * u.y;
        let y = u.y - half.x * u.z + half.y * w + half.z * u.x;
        let z = u.z + half.x * u.y - half.y * u.x + half.z * w;
        let w = w - half.x * u.x - half.y * u.y - half.z * u.z;
        // Of unit length; the identity where the length is zero or not finite.
        let squared = x * x + y * y + z * z + w * w;
        let regular = (squared - W::splat(1e-30)).min(W::splat(1e30) - squared);
        let s = W::splat(1.0) / squared.sqrt();
        Self {
            vector: LaneVec3 { x: x * s, y: y * s, z: z * s }.if_positive(regular),
            w: regular.if_positive(w * s, W::splat(1.0)),
        }
    }
}

/// Symmetric matrices side by side.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(crate) struct LaneSymmetric<W> {
    pub xx: W,
    pub yy: W,
    pub zz: W,
    pub xy: W,
    pub xz: W,
    pub yz: W,
}

impl<W: Number> LaneSymmetric<W> {
    pub const ZERO: Self = Self { xx: W::ZERO, yy: W::ZERO, zz: W::ZERO, xy: W::ZERO, xz: W::ZERO, yz: W::ZERO };

    #[inline(always)]
    pub fn mul(&self, v: &LaneVec3<W>) -> LaneVec3<W> {
        LaneVec3 {
            x: self.xx * v.x + self.xy * v.y + self.xz * v.z,
            y: self.xy * v.x + self.yy * v.y + self.yz * v.z,
            z: self.xz * v.x + self.yz * v.y + self.zz * v.z,
        }
    }

    #[inline(always)]
    pub fn add(&self, o: &Self) -> Self {
        Self {
            xx: self.xx + o.xx,
            yy: self.yy + o.yy,
            zz: self.zz + o.zz,
            xy: self.xy + o.xy,
            xz: self.xz + o.xz,
            yz: self.yz + o.yz,
        }
    }

    /// `x` with `self · x = v`, by cofactors; zero where the matrix is singular.
    ///
    /// The matrix is scaled to a trace of one first: the cube of what a millimetre's or a kilometre's inertia is like does
    /// not fit.
    #[inline(always)]
    pub fn solve(&self, v: &LaneVec3<W>) -> LaneVec3<W> {
        let scale = (self.xx + self.yy + self.zz).inverse_or_zero();
        let m = Self {
            xx: self.xx * scale,
            yy: self.yy * scale,
            zz: self.zz * scale,
            xy: self.xy * scale,
            xz: self.xz * scale,
            yz: self.yz * scale,
        };
        m.solve_scaled(&v.scale(scale))
    }

    /// [`LaneSymmetric::solve`] for numbers near one.
    #[inline(always)]
    fn solve_scaled(&self, v: &LaneVec3<W>) -> LaneVec3<W> {
        let (c00, c01, c02) = (
            self.yy * self.zz - self.yz * self.yz,
            self.xz * self.yz - self.xy * self.zz,
            self.xy * self.yz - self.xz * self.yy,
        );
        let (c11, c12, c22) = (
            self.xx * self.zz - self.xz * self.xz,
            self.xy * self.xz - self.xx * self.yz,
            self.xx * self.yy - self.xy * self.xy,
        );
        let s = (self.xx * c00 + self.xy * c01 + self.xz * c02).inverse_or_zero();
        LaneVec3 {
            x: (c00 * v.x + c01 * v.y + c02 * v.z) * s,
            y: (c01 * v.x + c11 * v.y + c12 * v.z) * s,
            z: (c02 * v.x + c12 * v.y + c22 * v.z) * s,
        }
    }
}

impl<W> LaneSymmetric<W> {
    /// Zero in one lane.
    #[inline(always)]
    pub fn clear<const L: usize>(&mut self, lane: usize)
    where
        W: Lanes<L>,
    {
        for part in [&mut self.xx, &mut self.yy, &mut self.zz, &mut self.xy, &mut self.xz, &mut self.yz] {
            part.set(lane, 0.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Rotation, SymmetricMat3};

    /// Spins, products and sums in lanes are those of one body, bit for bit; what a matrix solves, it multiplies back.
    #[test]
    fn lanes_are_rotations_and_matrices_side_by_side() {
        let (mut spins, mut turns) = (LaneVec3::<Wide<8>>::ZERO, LaneVec3::<Wide<8>>::ZERO);
        let (mut real, mut matrices) = (Wide([0.0; 8]), LaneSymmetric::<Wide<8>>::ZERO);
        let of_lane = |lane: usize| {
            let s = 0.2 + 0.31 * lane as f32;
            let q = Rotation::from_xyzw(s, 0.4, -0.2 * s, 1.0).normalize();
            let m = SymmetricMat3 { xx: 1.0 + s, yy: 3.0, zz: 2.0 + s * s, xy: 0.1 * s, xz: -0.3, yz: 0.2 * s };
            (Vec3::new(0.02 * s, -0.3, 0.1 + s), q, m)
        };
        for lane in 0..8 {
            let (spin, q, m) = of_lane(lane);
            spins.set(lane, spin);
            turns.set(lane, Vec3::new(q.x, q.y, q.z));
            real[lane] = q.w;
            for (part, x) in [
                (&mut matrices.xx, m.xx),
                (&mut matrices.yy, m.yy),
                (&mut matrices.zz, m.zz),
                (&mut matrices.xy, m.xy),
                (&mut matrices.xz, m.xz),
                (&mut matrices.yz, m.yz),
            ] {
                part[lane] = x;
            }
        }
        let turned = LaneRotation { vector: turns, w: real }.integrate(&spins);
        let (product, doubled) = (matrices.mul(&spins), matrices.add(&matrices).mul(&spins));
        let solved = matrices.solve(&product);
        for lane in 0..8 {
            let (spin, q, m) = of_lane(lane);
            let v = turned.vector.get(lane);
            assert_eq!(Rotation::from_xyzw(v.x, v.y, v.z, turned.w[lane]), q.integrate(spin));
            assert_eq!((product.get(lane), doubled.get(lane)), (m.mul(spin), m.add(&m).mul(spin)));
            assert!((solved.get(lane) - spin).length() < 1e-5, "{} for {spin}", solved.get(lane));
        }
    }

    /// A rotation that is no number becomes the identity, as [`Rotation::normalize`] has it; a singular matrix solves to zero.
    #[test]
    fn what_has_no_answer_is_harmless() {
        let none = LaneRotation { vector: LaneVec3::<Wide<1>>::splat(Vec3::splat(f32::NAN)), w: Wide([0.0]) };
        let turned = none.integrate(&LaneVec3::splat(Vec3::X));
        assert_eq!((turned.vector.get(0), turned.w[0]), (Vec3::ZERO, 1.0));
        let flat = LaneSymmetric::<Wide<1>> { xx: Wide([1.0]), ..LaneSymmetric::ZERO };
        assert_eq!(flat.solve(&LaneVec3::splat(Vec3::ONE)).get(0), Vec3::ZERO);
    }
}
