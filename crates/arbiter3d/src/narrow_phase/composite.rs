//! Shapes made of many solid parts (compounds, voxel grids) against any other shape.
//!
//! Each part whose box is near is held against the other shape by the kernel for that pair; where the other shape is made
//! of parts too, that kernel takes the turn, until all are convex (or one is a mesh or a half-space). The points come into the
//! frame of the whole and are reduced to the four that matter as those of a mesh are (`mesh_points`).
//!
//! Contacts with edges and faces between parts are left out (`seam`): where the contacts of the parts do not all have the
//! same normal, the parts are looked at once more, and those that others hide say nothing. If that left nothing at all, all
//! count: what overlaps never has an empty manifold.
//!
//! The number of a feature holds that of the part: see [`feature_of`].

use super::mesh_points::{Candidate, Candidates, Held, NO_FACET};
use super::seam::{self, Bearing, Patch, Verdict};
use super::{Manifold, ManifoldPoint, PairCache, collide_on};
use crate::math::{Aabb, Pose, Real, Vec3, min};

use crate::shape::{Compound, Cuboid, Geometry, Ray, Shape, VoxelGrid, cast_placed};
use crate::simd::SimdLevel;

/// Directions in which parts bear that are remembered.
const MOST_BEARINGS: usize = 8;
/// Normals this near to each other (the square of their distance) are one bearing.
const SAME_BEARING: Real = 1e-8;
/// Bits of a feature that tell of the touching features of a part; the others are the part's number.
const FEATURE_BITS: u32 = 12;

/// A shape made of solid parts.
pub(crate) trait Parts: Geometry {
    /// Calls `visit` with the number, shape and pose of each part whose box overlaps `aabb`.
    fn parts(&self, aabb: &Aabb, visit: &mut dyn FnMut(u32, &Shape, &Pose));

    /// Which material of the palette a part has where it is touched, given that of the part's own shape there.
    fn material(&self, part: u32, own: u8, point: &ManifoldPoint) -> u8;
}

impl Parts for Compound {
    fn parts(&self, aabb: &Aabb, visit: &mut dyn FnMut(u32, &Shape, &Pose)) {
        self.for_each_child(aabb, |child, shape, pose| visit(child as u32, shape, pose));
    }

    fn material(&self, part: u32, own: u8, _: &ManifoldPoint) -> u8 {
        self.child_material(part as usize, own)
    }
}

impl Parts for VoxelGrid {
    fn parts(&self, aabb: &Aabb, visit: &mut dyn FnMut(u32, &Shape, &Pose)) {
        self.for_each_box(aabb, |number, cuboid: Cuboid, center| {
            visit(number, &Shape::Cuboid(cuboid), &Pose::from_position(center));
        });
    }

    fn material(&self, _: u32, _: u8, point: &ManifoldPoint) -> u8 {
        self.material_under(point.point1, point.normal)
    }
}

/// The number of a feature of a part: the part's own number in the upper twenty bits, what is left of the part's feature in
/// the lower twelve. Two features of a part that come out alike are told apart by where they are.
fn feature_of(part: u32, feature: u32) -> u32 {
    let folded = feature ^ feature >> FEATURE_BITS ^ feature >> (2 * FEATURE_BITS);
    part << FEATURE_BITS | folded & ((1 << FEATURE_BITS) - 1)
}

/// Contacts of a shape made of parts (shape 1, whose frame the manifold is in) with another one placed there by `pose`.
pub(crate) fn collide(
    level: SimdLevel,
    (whole, other): (&impl Parts, &Shape),
    pose: &Pose,
    margin: Real,
    manifold: &mut Manifold,
) {
    let held = Held::take(manifold);
    let size = match [whole.inner_ball().1, other.inner_radius()] {
        [a, b] if a > 0.0 && b > 0.0 => min(a, b),
        [a, b] => crate::math::max(a, b),
    };
    let scale = if margin > 0.0 { min(margin, size) } else { 0.02 * size };
    let mut contact = Contact {
        level,
        whole,
        other,
        pose,
        margin,
        near: other.aabb(pose).expand(margin),
        // The margin is four slops where there is one.
        seam: seam::scale_of(if margin > 0.0 { 0.25 * margin } else { size }, size),
        bearings: [Bearing { point: Vec3::ZERO, normal: Vec3::ZERO }; MOST_BEARINGS],
        bearing_count: 0,
    };
    let mut all = Candidates::new(0.02 * scale);
    contact.gather(&mut all);
    if contact.bearing_count > 1 {
        let mut outside = Candidates::new(0.02 * scale);
        contact.gather_outside(&mut outside);
        if outside.deepest() < Real::MAX {
            all = outside;
        }
    }
    let mut materials = [[0; 2]; 4];
    all.choose(
        &held,
        |point| point,
        |&Candidate { position, normal, separation, feature, triangle, .. }| {
            materials[manifold.points().len() & 3] = [triangle as u8, (triangle >> 8) as u8];
            manifold.push(ManifoldPoint { point1: position, normal, separation, feature });
        },
    );
    manifold.set_point_materials(&materials);
}

struct Contact<'a, P> {
    level: SimdLevel,
    whole: &'a P,
    other: &'a Shape,
    pose: &'a Pose,
    margin: Real,
    /// The box around the other shape and what is near it.
    near: Aabb,
    /// Length below which edges are none, metres.
    seam: Real,
    bearings: [Bearing; MOST_BEARINGS],
    bearing_count: usize,
}

impl<P: Parts> Contact<'_, P> {
    /// Shows the contacts of each part that is near, in the frame of the whole.
    fn for_each(&self, mut visit: impl FnMut(u32, &Manifold, (&Shape, &Pose))) {
        self.whole.parts(&self.near, &mut |number, shape, placed| {
            let mut found = Manifold::EMPTY;
            let kept = (&mut PairCache::default(), &mut found);
            collide_on(self.level, (shape, self.other), &placed.relative(self.pose), self.margin, kept);
            for point in found.points_mut() {
                point.point1 = placed.transform_point(point.point1);
                point.normal = placed.rotation.rotate(point.normal);
            }
            if !found.points().is_empty() {
                visit(number, &found, (shape, placed));
            }
        });
    }

    /// All points of all parts; notes the directions in which they bear.
    fn gather(&mut self, out: &mut Candidates) {
        let (mut bearings, mut count) = (self.bearings, 0);
        self.for_each(|number, found, _| {
            for (at, point) in found.points().iter().enumerate() {
                out.push(self.candidate(number, point, found.materials_of(at)));
            }
            let mut left = (1_u32 << found.points().len()) - 1;
            while left != 0 {
                let (patch, members) = patch_of(found, left);
                left &= !members;
                let known = |b: &Bearing| (b.normal - patch.normal).length_squared() <= SAME_BEARING;
                if count < MOST_BEARINGS && !bearings[..count].iter().any(known) {
                    bearings[count] = patch.bearing();
                    count += 1;
                }
            }
        });
        (self.bearings, self.bearing_count) = (bearings, count);
    }

    /// The points that are not at seams.
    fn gather_outside(&self, out: &mut Candidates) {
        self.for_each(|number, found, part| {
            let mut left = (1_u32 << found.points().len()) - 1;
            while left != 0 {
                let (patch, members) = patch_of(found, left);
                left &= !members;
                let normal = match self.verdict(&patch, part) {
                    Verdict::Counts => patch.normal,
                    Verdict::Straightened(normal) => normal,
                    Verdict::Hidden => continue,
                };
                for (at, point) in found.points().iter().enumerate().filter(|(at, _)| members >> at & 1 == 1) {
                    let separation = point.separation * patch.normal.dot(normal);
                    let point = ManifoldPoint { normal, separation, ..*point };
                    out.push(self.candidate(number, &point, found.materials_of(at)));
                }
            }
        });
    }

    fn candidate(&self, part: u32, point: &ManifoldPoint, materials: [u8; 2]) -> Candidate {
        let own = self.whole.material(part, materials[0], point);
        Candidate {
            position: point.point1,
            normal: point.normal,
            separation: point.separation,
            feature: feature_of(part, point.feature),
            facet: NO_FACET,
            triangle: u32::from(own) | u32::from(materials[1]) << 8,
        }
    }

    /// What a contact with a part is beside all bearings.
    fn verdict(&self, patch: &Patch, (shape, placed): (&Shape, &Pose)) -> Verdict {
        let cast = |ray: &Ray| self.whole.cast_ray(ray);
        let own = |ray: &Ray| cast_placed(shape, placed, ray);
        let mut verdicts =
            self.bearings[..self.bearing_count].iter().map(|b| patch.beside(b, (&cast, &own), self.seam));
        verdicts.find(|verdict| *verdict != Verdict::Counts).unwrap_or(Verdict::Counts)
    }
}

/// The points with the normal of the first of those in a bit mask, and which they are.
fn patch_of(found: &Manifold, mask: u32) -> (Patch, u32) {
    let normal = found.points()[mask.trailing_zeros() as usize].normal;
    let mut patch = Patch { points: [Vec3::ZERO; 4], count: 0, normal };
    let mut members = mask & mask.wrapping_neg();
    for (at, point) in found.points().iter().enumerate() {
        if mask >> at & 1 == 1 && (point.normal == normal || members >> at & 1 == 1) {
            (patch.points[patch.count], members) = (point.point1, members | 1 << at);
            patch.count += 1;
        }
    }
    (patch, members)
}
