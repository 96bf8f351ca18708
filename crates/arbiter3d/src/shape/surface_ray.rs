//! Rays against meshes and height fields.
//!
//! The watertight test of Woop, Benthin and Wald ("Watertight Ray/Triangle Intersection", 2013) with its edge functions in
//! double precision: both sides of a shared edge compute the same number with opposite sign, so a ray cannot slip through
//! between them. The triangles of a leaf are first looked at side by side in single precision with a bound on its rounding,
//! which passes on all that the exact test might hit.

use super::mesh::MeshSides;
use super::mesh_tree::{Descent, LEAF, Slabs};
use super::surface::Surface;
use crate::math::{Aabb, Real, Vec3};
use crate::simd::{LaneVec3, Lanes};

/// How far away a ray (from a point, along a direction, up to a multiple of it) meets which triangle, by its internal number,
/// and whether from behind. Of triangles met at the same distance the first in the user's list.
pub(super) fn first_triangle(
    surface: Surface<'_>,
    (origin, direction, limit): (Vec3, Vec3, Real),
    sides: MeshSides,
) -> Option<(Real, usize, bool)> {
    let ray = SharpRay::new(origin, direction, &surface.local_aabb())?;
    let slabs = Slabs::of_point(origin, direction);
    let mut search = RaySearch { surface, ray, slabs, sides, best: None };
    surface.descend(limit, &mut search);
    search.best
}

/// A ray in the frame of the watertight test: sheared so that it runs along its longest axis.
pub(super) struct SharpRay {
    origin: Vec3,
    axes: [usize; 3],
    shear: [f64; 3],
    /// What rounding to single precision does to a sheared coordinate at most, twice over.
    rounding: Real,
}

impl SharpRay {
    /// A ray for triangles in the box `around`.
    pub(super) fn new(origin: Vec3, direction: Vec3, around: &Aabb) -> Option<Self> {
        let size = crate::math::abs3(direction);
        let z = if size.x >= size.y && size.x >= size.z { 0 } else { 1 + usize::from(size.z > size.y) };
        if !(size[z] > 0.0 && direction.is_finite() && origin.is_finite()) {
            return None;
        }
        let (x, y) = ((z + 1) % 3, (z + 2) % 3);
        let d = direction.as_dvec3();
        let shear = [d[x] / d[z], d[y] / d[z], 1.0 / d[z]];
        // A difference, a factor of at most 1 and its product, and another difference of up to twice that: 5 half-steps.
        let rounding = 6e-7 * around.farthest_from(origin).max_element();
        Some(Self { origin, axes: [x, y, z], shear, rounding })
    }

    /// The triangles that [`SharpRay::hit`] may hit, a bit each: those whose edge functions are of one sign as far as single
    /// precision can tell, and that do not turn away a ray from behind for sure.
    #[inline(always)]
    fn may_hit<W: Lanes<LEAF>>(&self, corners: &[LaneVec3<W>; 3], sides: MeshSides) -> u32 {
        let [x, y, z] = self.axes;
        let (shear_x, shear_y) = (W::splat(self.shear[0] as Real), W::splat(self.shear[1] as Real));
        let origin = LaneVec3::<W>::splat(self.origin);
        let mut sheared = [[W::ZERO; 2]; 3];
        let mut extent = W::ZERO;
        for i in 0..3 {
            let p = (corners[i] - origin).columns();
            sheared[i] = [p[x] - shear_x * p[z], p[y] - shear_y * p[z]];
            extent = sheared[i][0].abs().max(sheared[i][1].abs()).max(extent);
        }
        let [a, b, c] = sheared;
        let u = c[0] * b[1] - c[1] * b[0];
        let v = a[0] * c[1] - a[1] * c[0];
        let w = b[0] * a[1] - b[1] * a[0];
        // Each of the four factors is off by `rounding`, each product and the difference by half-steps of `extent²`.
        let rounding = W::splat(self.rounding);
        let error = W::splat(4.0) * rounding * (extent + rounding) + W::splat(5e-7) * extent * extent;
        let (least, most) = (u.min(v).min(w), u.max(v).max(w));
        let one = W::splat(1.0);
        let mixed = most.if_above(error, (-least).if_above(error, one, W::ZERO), W::ZERO);
        let mut may = one - mixed;
        if sides == MeshSides::One {
            let front = if self.shear[2] < 0.0 { -(u + v + w) } else { u + v + w };
            may = (-front).if_above(W::splat(4.0) * error, W::ZERO, may);
        }
        may.positive()
    }

    /// How far along the ray a triangle is met, and whether from behind.
    pub(super) fn hit(&self, corners: &[Vec3; 3], sides: MeshSides) -> Option<(Real, bool)> {
        let origin = self.origin.as_dvec3();
        let [x, y, z] = self.axes;
        let sheared = corners.map(|corner| {
            let p = corner.as_dvec3() - origin;
            [p[x] - self.shear[0] * p[z], p[y] - self.shear[1] * p[z], self.shear[2] * p[z]]
        });
        let [a, b, c] = sheared;
        let u = c[0] * b[1] - c[1] * b[0];
        let v = a[0] * c[1] - a[1] * c[0];
        let w = b[0] * a[1] - b[1] * a[0];
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        let sum = u + v + w;
        if sum == 0.0 {
            return None;
        }
        let distance = ((u * a[2] + v * b[2] + w * c[2]) / sum) as Real;
        // The sum is minus twice the area as seen along the axis, which the ray may run down.
        let back = (sum < 0.0) != (self.shear[2] < 0.0);
        (distance >= 0.0 && !(back && sides == MeshSides::One)).then_some((distance, back))
    }
}

/// The first triangle along a ray.
struct RaySearch<'a> {
    surface: Surface<'a>,
    ray: SharpRay,
    slabs: Slabs,
    sides: MeshSides,
    /// Distance, internal number, whether hit from behind.
    best: Option<(Real, usize, bool)>,
}

impl Descent for RaySearch<'_> {
    #[inline(always)]
    fn distances<W: Lanes<LEAF>>(&self, low: &LaneVec3<W>, high: &LaneVec3<W>, limit: Real) -> W {
        self.slabs.enter(low, high, limit)
    }

    #[inline(always)]
    fn leaf<W: Lanes<LEAF>>(&mut self, first: usize, count: usize, limit: Real) -> Real {
        let corners = self.surface.corners_of_leaf::<W>(first, count);
        let mut bits = self.ray.may_hit(&corners, self.sides) & ((1 << count) - 1);
        let mut limit = limit;
        while bits != 0 {
            let index = first + bits.trailing_zeros() as usize % LEAF;
            bits &= bits - 1;
            let Some((distance, back)) = self.ray.hit(&self.surface.corners(index), self.sides) else { continue };
            let first = match self.best {
                Some((best, other, _)) => (distance, self.surface.id(index)) < (best, self.surface.id(other)),
                None => true,
            };
            if distance <= limit && first {
                limit = distance;
                self.best = Some((distance, index, back));
            }
        }
        limit
    }
}
