//! The core of a hull: its corners drawn inwards, for continuous collision.
//!
//! With the planes `n · x ≤ d` of the hull, the points that are at least `t` inside are `n · x ≤ d − t`. That set is
//! convex, so the hull of any points in it is in it. For each corner a point of it near the corner is taken: cyclic
//! projection onto the planes moved inwards that it is beyond (Kaczmarz' method, 1937), which for a box ends at the
//! corner of the smaller box at once, and for a long tip comes close. What is still outside after some rounds is drawn
//! towards the middle, which lies inside by more than `t`, until it is in. So a long thin hull keeps its length, where
//! a copy scaled about the middle would lose half of it.

use super::Plane;
use crate::math::{Real, Vec3, max};

/// Rounds of projections. Blunt corners need one, tips of a few degrees all of them.
const ROUNDS: usize = 12;

/// For each corner a point near it that is `thickness` inside all planes; `middle` is farther inside than that.
pub(super) fn eroded_corners(corners: &[Vec3], planes: &[Plane], middle: Vec3, thickness: Real) -> Vec<Vec3> {
    let outside = |plane: &Plane, point: Vec3| plane.distance(point) + thickness;
    let erode = |corner: &Vec3| {
        let mut point = *corner;
        for _ in 0..ROUNDS {
            let before = point;
            for plane in planes {
                point -= plane.normal * max(outside(plane, point), 0.0);
            }
            if point == before {
                break;
            }
        }
        let mut share: Real = 0.0;
        for plane in planes {
            let (here, inside) = (outside(plane, point), outside(plane, middle));
            if here > 0.0 {
                share = max(if inside < 0.0 { here / (here - inside) } else { 1.0 }, share);
            }
        }
        point + (middle - point) * share
    };
    corners.iter().map(erode).collect()
}

#[cfg(test)]
mod tests {
    use crate::ConvexHull;
    use crate::math::{Real, Vec3};
    use crate::random::Random;

    /// A rod of 2 m and 2 cm keeps its length but for half a centimetre at each end; each corner goes in by that much.
    #[test]
    fn a_rod_keeps_its_length() {
        let half = Vec3::new(0.01, 1.0, 0.01);
        let rod = ConvexHull::from_cuboid(half).unwrap();
        for (corner, core) in rod.vertices().iter().zip(rod.core()) {
            let expected = *corner - corner.signum() * 0.005;
            assert!((*core - expected).length() < 1e-5, "{core}, not {expected}");
        }
    }

    /// Cores of random hulls, slivers among them, are inside by half the inner radius, and no corner goes past the middle.
    #[test]
    fn cores_are_inside_by_half_the_inner_radius() {
        let mut random = Random(7);
        for round in 0..200 {
            let flat = if round % 2 == 0 { 1.0 } else { 0.05 };
            let points: Vec<Vec3> = (0..20).map(|_| random.vector() * Vec3::new(0.5, 0.5 * flat, 0.5)).collect();
            let hull = ConvexHull::new(&points).unwrap();
            let (thickness, middle) = (0.5 * hull.inner_radius(), hull.centroid());
            for ((corner, core), spine) in hull.vertices().iter().zip(hull.core()).zip(hull.spine()) {
                let highest =
                    |point: &Vec3| hull.planes().iter().map(|plane| plane.distance(*point)).fold(-Real::MAX, Real::max);
                assert!(highest(core) < -0.999 * thickness, "{}, not {}", highest(core), -thickness);
                assert!(highest(spine) < -1.798 * thickness, "{}, not {}", highest(spine), -1.8 * thickness);
                assert!((*core - *corner).dot(middle - *corner) > 0.0);
            }
        }
    }
}
