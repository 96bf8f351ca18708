//! Axis-aligned boxes.

use super::{Mat3, Pose, Real, Vec3, abs3, max3, min3};

/// An axis-aligned box from `min` to `max`, metres.
///
/// ```
/// use arbiter3d::math::{Aabb, Vec3};
/// let a = Aabb::new(Vec3::ZERO, Vec3::ONE);
/// assert!(a.overlaps(&Aabb::new(Vec3::splat(0.5), Vec3::splat(2.0))));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct Aabb {
    /// Corner with the smallest coordinates.
    pub min: Vec3,
    /// Corner with the largest coordinates.
    pub max: Vec3,
}

impl Aabb {
    /// The empty box: the neutral element of [`Aabb::union`].
    pub const EMPTY: Self = Self { min: Vec3::splat(Real::MAX), max: Vec3::splat(-Real::MAX) };

    /// A box from its corners.
    #[inline(always)]
    #[must_use]
    pub const fn new(min: Vec3, max: Vec3) -> Self {
        Self { min, max }
    }

    /// A box from its centre and half extents.
    #[inline(always)]
    #[must_use]
    pub fn from_center(center: Vec3, half_extents: Vec3) -> Self {
        Self { min: center - half_extents, max: center + half_extents }
    }

    /// The smallest box around the points; [`Aabb::EMPTY`] for none.
    #[must_use]
    pub fn from_points(points: impl IntoIterator<Item = Vec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, |b, p| Self { min: min3(b.min, p), max: max3(b.max, p) })
    }

    /// Middle of the box.
    #[inline(always)]
    #[must_use]
    pub fn center(&self) -> Vec3 {
        (self.min + self.max) * 0.5
    }

    /// Half the size along each axis.
    #[inline(always)]
    #[must_use]
    pub fn half_extents(&self) -> Vec3 {
        (self.max - self.min) * 0.5
    }

    /// The largest distance of its points from `point` along each axis.
    #[must_use]
    pub(crate) fn farthest_from(&self, point: Vec3) -> Vec3 {
        max3(abs3(self.max - point), abs3(self.min - point))
    }

    /// Surface area: the cost of a box in a tree.
    #[inline(always)]
    #[must_use]
    pub fn area(&self) -> Real {
        let d = self.max - self.min;
        2.0 * (d.x * d.y + d.y * d.z + d.z * d.x)
    }

    /// Whether the boxes share a point; touching counts.
    #[inline(always)]
    #[must_use]
    pub fn overlaps(&self, other: &Self) -> bool {
        (self.min.x <= other.max.x)
            & (self.min.y <= other.max.y)
            & (self.min.z <= other.max.z)
            & (other.min.x <= self.max.x)
            & (other.min.y <= self.max.y)
            & (other.min.z <= self.max.z)
    }

    /// Whether a point lies inside or on the border.
    #[inline(always)]
    pub(crate) fn holds(&self, point: Vec3) -> bool {
        self.contains(&Self::new(point, point))
    }

    /// Whether `other` lies inside.
    #[inline(always)]
    #[must_use]
    pub fn contains(&self, other: &Self) -> bool {
        (self.min.x <= other.min.x)
            & (self.min.y <= other.min.y)
            & (self.min.z <= other.min.z)
            & (other.max.x <= self.max.x)
            & (other.max.y <= self.max.y)
            & (other.max.z <= self.max.z)
    }

    /// The smallest box around both.
    #[inline(always)]
    #[must_use]
    pub fn union(&self, other: &Self) -> Self {
        Self { min: min3(self.min, other.min), max: max3(self.max, other.max) }
    }

    /// Grown by `margin` on every side.
    #[inline(always)]
    #[must_use]
    pub fn expand(&self, margin: Real) -> Self {
        Self { min: self.min - Vec3::splat(margin), max: self.max + Vec3::splat(margin) }
    }

    /// Grown to also hold the box moved by `displacement`.
    #[inline]
    #[must_use]
    pub fn sweep(&self, displacement: Vec3) -> Self {
        Self { min: self.min + min3(displacement, Vec3::ZERO), max: self.max + max3(displacement, Vec3::ZERO) }
    }

    /// The box around this one placed by `pose`.
    #[inline]
    #[must_use]
    pub fn transform(&self, pose: &Pose) -> Self {
        Self::from_center(
            pose.transform_point(self.center()),
            rotated_half_extents(&pose.rotation.to_mat3(), self.half_extents()),
        )
    }

    /// Whether both corners are finite and in order.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        self.min.is_finite()
            && self.max.is_finite()
            && self.min.x <= self.max.x
            && self.min.y <= self.max.y
            && self.min.z <= self.max.z
    }
}

/// Half extents of the axis-aligned box around a box turned by `rotation`: `|R| h`.
#[inline(always)]
pub(crate) fn rotated_half_extents(rotation: &Mat3, half_extents: Vec3) -> Vec3 {
    abs3(rotation.x_axis) * half_extents.x
        + abs3(rotation.y_axis) * half_extents.y
        + abs3(rotation.z_axis) * half_extents.z
}
