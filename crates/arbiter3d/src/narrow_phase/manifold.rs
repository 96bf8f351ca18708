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
    /// Those of the points in the bit mask `other_points`.
    others: [u8; 2],
    other_points: u8,
}

impl Manifold {
    /// No points.
    pub const EMPTY: Self = Self {
        points: [ManifoldPoint { point1: Vec3::ZERO, normal: Vec3::ZERO, separation: 0.0, feature: 0 }; 4],
        count: 0,
        materials: [0; 2],
        others: [0; 2],
        other_points: 0,
    };

    /// Removes all points.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.count = 0;
        self.set_materials([0; 2]);
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

    /// Of shape 1 and of shape 2, which of its palette's materials touches: that of the triangle, child or cell with the
    /// deepest point. Zero for shapes of one material.
    #[inline(always)]
    #[must_use]
    pub fn materials(&self) -> [u8; 2] {
        self.materials
    }

    /// The same of a point: a manifold has at most two pairs of materials, that of the deepest point, and that of the deepest
    /// of the points whose is another.
    #[must_use]
    pub fn materials_of(&self, point: usize) -> [u8; 2] {
        if point < 4 && self.other_points >> point & 1 == 1 { self.others } else { self.materials }
    }

    /// The second pair of materials, and a bit for each point that has it.
    #[inline(always)]
    pub(crate) fn other_materials(&self) -> ([u8; 2], u8) {
        (self.others, self.other_points)
    }

    /// Shape 1 and shape 2 change places.
    #[inline(always)]
    pub(crate) fn swap_materials(&mut self) {
        self.materials.swap(0, 1);
        self.others.swap(0, 1);
    }

    /// All points are of one pair of materials.
    pub(crate) fn set_materials(&mut self, materials: [u8; 2]) {
        (self.materials, self.others, self.other_points) = (materials, materials, 0);
    }

    /// Notes the pair of materials of each point.
    pub(crate) fn set_point_materials(&mut self, materials: &[[u8; 2]; 4]) {
        let count = self.count as usize;
        let deepest = |points: &[ManifoldPoint], counts: &dyn Fn(usize) -> bool| {
            let mut best: Option<usize> = None;
            for i in (0..count).filter(|&i| counts(i)) {
                if best.is_none_or(|best| points[i].separation < points[best].separation) {
                    best = Some(i);
                }
            }
            best
        };
        let Some(first) = deepest(&self.points, &|_| true) else { return };
        self.set_materials(materials[first]);
        if let Some(second) = deepest(&self.points, &|i| materials[i] != materials[first]) {
            self.others = materials[second];
            for (i, found) in materials[..count].iter().enumerate() {
                self.other_points |= u8::from(*found != self.materials) << i;
            }
        }
    }

    /// The points, to change.
    #[inline(always)]
    pub fn points_mut(&mut self) -> &mut [ManifoldPoint] {
        &mut self.points[..self.count as usize]
    }
}
