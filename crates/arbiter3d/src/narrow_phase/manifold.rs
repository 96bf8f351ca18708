//! What the narrow phase tells of a pair: up to four contact points.

use crate::math::{Real, Vec3};

/// One point where two shapes touch or nearly touch, in the frame of shape 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ManifoldPoint {
    /// Point on the surface of shape 1. The twin on shape 2 is `point1 + normal * separation`.
    pub point1: Vec3,
    /// Unit normal from shape 1 to shape 2. Points with bit-equal normals are solved together, with one friction.
    pub normal: Vec3,
    /// Gap along the normal, metres; negative when the shapes overlap.
    pub separation: Real,
    /// Which features met: equal from step to step while the same features touch, so that impulses find their point.
    pub feature: u32,
}

impl ManifoldPoint {
    /// The point on the surface of shape 2, in the frame of shape 1.
    #[inline(always)]
    #[must_use]
    pub fn point2(&self) -> Vec3 {
        self.point1 + self.normal * self.separation
    }
}

/// Up to four contact points of a pair.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Manifold {
    points: [ManifoldPoint; 4],
    count: u8,
    materials: [u8; 2],
}

impl Manifold {
    /// No points.
    pub const EMPTY: Self = Self {
        points: [ManifoldPoint { point1: Vec3::ZERO, normal: Vec3::ZERO, separation: 0.0, feature: 0 }; 4],
        count: 0,
        materials: [0; 2],
    };

    /// Removes all points.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.count = 0;
        self.materials = [0; 2];
    }

    /// Adds a point.
    ///
    /// # Panics
    /// If there are four already: kernels reduce before they push.
    #[inline(always)]
    pub fn push(&mut self, point: ManifoldPoint) {
        self.points[self.count as usize] = point;
        self.count += 1;
    }

    /// The points.
    #[inline(always)]
    #[must_use]
    pub fn points(&self) -> &[ManifoldPoint] {
        &self.points[..self.count as usize]
    }

    /// Of shape 1 and of shape 2, which of its palette's materials touches: that of the triangle with the deepest point. Zero
    /// for shapes of one material.
    #[inline(always)]
    #[must_use]
    pub fn materials(&self) -> [u8; 2] {
        self.materials
    }

    pub(crate) fn set_materials(&mut self, materials: [u8; 2]) {
        self.materials = materials;
    }

    /// The points, to change.
    #[inline(always)]
    pub fn points_mut(&mut self) -> &mut [ManifoldPoint] {
        &mut self.points[..self.count as usize]
    }
}
