//! The vector closest to a wanted one that respects some planes.
//!
//! Each limit asks that `n · x ≥ least`. The closest such `x` to the wanted `d` is unique; it is `d` itself, or lies on
//! one limit, on the line of two, or in the corner of three, with multipliers `λ ≥ 0` in
//!
//! ```text
//! x = d + Σ λᵢ nᵢ        nᵢ · x = leastᵢ for the limits taken        n · x ≥ least for all
//! ```
//!
//! (the conditions of Karush, Kuhn and Tucker). With at most sixteen limits, all sets of up to three are tried in
//! `f64`: no iteration that stops early, no order of planes that matters, no violation beyond rounding. A mover that
//! slides by this neither climbs out of acute corners nor trembles in them, as one that projects on one plane after the
//! other does.
//!
//! Limits may contradict each other, as when walls close in on a mover. Then no `x` is right, and the result is a
//! compromise that shares the violation, marked as such.

use crate::math::{Real, Vec3};
use glam::DVec3;

/// Limits beyond these are left out, the loosest first.
const MOST: usize = 16;

/// Normals closer than this (cosine) count as one.
const SAME: Real = 0.99999;

/// How far along its normal a vector must reach at least.
///
/// ```
/// use arbiter3d::{PlaneLimit, math::Vec3};
/// let floor_one_centimetre_below = PlaneLimit { normal: Vec3::Y, least: -0.01 };
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PlaneLimit {
    /// Unit normal of the plane.
    pub normal: Vec3,
    /// The vector's least component along it: negative where there is room before the plane, positive where the mover
    /// must be pushed out of it.
    pub least: Real,
}

/// What [`solve_planes`] has found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaneSolution {
    /// The vector.
    pub vector: Vec3,
    /// Whether it respects all limits. Where no limit is above zero, it always does.
    pub satisfied: bool,
}

/// The vector closest to `wanted` that respects all limits (of more than 16 different ones, the tightest).
///
/// ```
/// use arbiter3d::{PlaneLimit, math::Vec3, solve_planes};
/// let wall = |normal: Vec3| PlaneLimit { normal, least: 0.0 };
/// // Along the floor and one wall; two walls and the floor leave no way.
/// let walls = [wall(Vec3::Y), wall(Vec3::NEG_X), wall(Vec3::new(-0.6, 0.0, -0.8))];
/// assert!(solve_planes(Vec3::new(1.0, -1.0, -1.0), &walls[..2]).vector.distance(Vec3::NEG_Z) < 1e-6);
/// assert!(solve_planes(Vec3::new(1.0, -1.0, 1.0), &walls).vector.length() < 1e-6);
/// ```
#[must_use]
pub fn solve_planes(wanted: Vec3, limits: &[PlaneLimit]) -> PlaneSolution {
    let planes = Planes::new(wanted, limits);
    if let Some(vector) = planes.closest() {
        return PlaneSolution { vector: vector.as_vec3(), satisfied: true };
    }
    let vector = planes.compromise();
    let satisfied = planes.allows(vector, 1e-6);
    PlaneSolution { vector: vector.as_vec3(), satisfied }
}

/// A limit in `f64`.
#[derive(Clone, Copy, Default)]
struct Plane {
    normal: DVec3,
    least: f64,
}

struct Planes {
    wanted: DVec3,
    planes: [Plane; MOST],
    count: usize,
    /// The measure of what is rounding.
    size: f64,
}

impl Planes {
    fn new(wanted: Vec3, limits: &[PlaneLimit]) -> Self {
        let mut kept = [PlaneLimit::default(); MOST];
        let mut count = 0;
        for &limit in limits {
            // How far the wanted vector is on the right side: the tightest limits come first.
            let slack = |limit: &PlaneLimit| limit.normal.dot(wanted) - limit.least;
            if let Some(same) = kept[..count].iter_mut().find(|same| same.normal.dot(limit.normal) > SAME) {
                same.least = crate::math::max(limit.least, same.least);
            } else if count < MOST {
                kept[count] = limit;
                count += 1;
            } else {
                let mut loosest = 0;
                for index in 1..MOST {
                    if slack(&kept[index]) > slack(&kept[loosest]) {
                        loosest = index;
                    }
                }
                if slack(&limit) < slack(&kept[loosest]) {
                    kept[loosest] = limit;
                }
            }
        }
        let wanted = wanted.as_dvec3();
        let mut planes = [Plane::default(); MOST];
        let mut size = wanted.length();
        for (plane, limit) in planes.iter_mut().zip(&kept[..count]) {
            *plane = Plane { normal: limit.normal.as_dvec3().normalize_or_zero(), least: f64::from(limit.least) };
            size += plane.least.abs();
        }
        Self { wanted, planes, count, size }
    }

    fn allows(&self, x: DVec3, tolerance: f64) -> bool {
        self.planes[..self.count].iter().all(|plane| plane.normal.dot(x) >= plane.least - tolerance * self.size)
    }

    /// By how much the wanted vector falls short of a limit.
    fn shortfall(&self, plane: &Plane) -> f64 {
        plane.least - plane.normal.dot(self.wanted)
    }

    fn closest(&self) -> Option<DVec3> {
        const EXACT: f64 = 1e-9;
        if self.allows(self.wanted, EXACT) {
            return Some(self.wanted);
        }
        let planes = &self.planes[..self.count];
        let good = |x: Option<DVec3>| x.filter(|&x| self.allows(x, EXACT));
        for (i, a) in planes.iter().enumerate() {
            let x = (self.shortfall(a) >= 0.0).then(|| self.wanted + a.normal * self.shortfall(a));
            if let Some(x) = good(x) {
                return Some(x);
            }
            for b in &planes[..i] {
                if let Some(x) = good(self.on_line(a, b)) {
                    return Some(x);
                }
            }
        }
        for (i, a) in planes.iter().enumerate() {
            for (j, b) in planes[..i].iter().enumerate() {
                for c in &planes[..j] {
                    if let Some(x) = good(self.in_corner(a, b, c)) {
                        return Some(x);
                    }
                }
            }
        }
        // Rounding may hide a corner from the test of its multipliers; standing still is always allowed then.
        planes.iter().all(|plane| plane.least <= 0.0).then_some(DVec3::ZERO)
    }

    /// The closest vector on two limits, if both push.
    fn on_line(&self, a: &Plane, b: &Plane) -> Option<DVec3> {
        let (p, q) = (self.shortfall(a), self.shortfall(b));
        let c = a.normal.dot(b.normal);
        let determinant = 1.0 - c * c;
        let (from_a, from_b) = ((p - c * q) / determinant, (q - c * p) / determinant);
        let pushes = determinant > 1e-10 && from_a >= 0.0 && from_b >= 0.0;
        pushes.then(|| self.wanted + a.normal * from_a + b.normal * from_b)
    }

    /// The corner of three limits, if all push.
    fn in_corner(&self, a: &Plane, b: &Plane, c: &Plane) -> Option<DVec3> {
        let across = b.normal.cross(c.normal);
        let determinant = a.normal.dot(across);
        if determinant.abs() < 1e-7 {
            return None;
        }
        let others = [across, c.normal.cross(a.normal), a.normal.cross(b.normal)];
        let x = (others[0] * a.least + others[1] * b.least + others[2] * c.least) / determinant;
        // `x − wanted = Σ λ n`, and the crossed normals are dual to the normals.
        let push = x - self.wanted;
        let slightly_less = -1e-9 * self.size;
        others.iter().all(|other| push.dot(*other) / determinant >= slightly_less).then_some(x)
    }

    /// For limits that contradict each other: what ever smaller pushes by one after the other lead to.
    fn compromise(&self) -> DVec3 {
        let mut x = self.wanted;
        for round in 0..64 {
            let share = 1.0 / (1.0 + 0.25 * f64::from(round));
            for plane in &self.planes[..self.count] {
                let short = plane.least - plane.normal.dot(x);
                if short > 0.0 {
                    x += plane.normal * (short * share);
                }
            }
        }
        x
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::normalize_or;
    use crate::random::Random;

    fn limit(x: Real, y: Real, z: Real, least: Real) -> PlaneLimit {
        PlaneLimit { normal: normalize_or(Vec3::new(x, y, z), Vec3::Y), least }
    }

    #[test]
    fn free_vectors_stay_as_they_are() {
        let solution = solve_planes(Vec3::new(1.0, 2.0, 3.0), &[limit(0.0, 1.0, 0.0, 1.5), limit(1.0, 0.0, 0.0, -1.0)]);
        assert_eq!(solution, PlaneSolution { vector: Vec3::new(1.0, 2.0, 3.0), satisfied: true });
    }

    /// No limit is broken, and no vector nearby that keeps them is closer: for random limits and wishes.
    #[test]
    fn solutions_keep_all_limits_and_are_closest() {
        let mut random = Random(3);
        for round in 0..3000 {
            let count = round % 9;
            let limits: Vec<PlaneLimit> = (0..count)
                .map(|_| {
                    let normal = normalize_or(random.vector(), Vec3::Y);
                    PlaneLimit { normal, least: 0.2 * random.signed() - 0.2 }
                })
                .collect();
            let wanted = random.vector();
            let found = solve_planes(wanted, &limits);
            assert!(found.satisfied);
            for limit in &limits {
                assert!(limit.normal.dot(found.vector) >= limit.least - 1e-6, "round {round}");
            }
            for _ in 0..50 {
                let other = found.vector + random.vector() * 0.05;
                let kept = limits.iter().all(|limit| limit.normal.dot(other) >= limit.least);
                assert!(!kept || other.distance(wanted) >= found.vector.distance(wanted) - 1e-6, "round {round}");
            }
        }
    }

    /// In a wedge of 30° that closes ahead there is no way but up.
    #[test]
    fn acute_wedges_leave_no_way_but_up() {
        let walls = [limit(-0.2588, 0.0, 0.9659, 0.0), limit(-0.2588, 0.0, -0.9659, 0.0), limit(0.0, 1.0, 0.0, 0.0)];
        let found = solve_planes(Vec3::new(1.0, 0.3, 0.05), &walls);
        assert!(found.vector.distance(Vec3::Y * 0.3) < 1e-6, "{}", found.vector);
    }

    /// Walls that close in: the mover ends in the middle, and the result says so.
    #[test]
    fn contradictions_are_shared_and_told() {
        let found = solve_planes(Vec3::ZERO, &[limit(1.0, 0.0, 0.0, 0.1), limit(-1.0, 0.0, 0.0, 0.1)]);
        assert!(!found.satisfied && found.vector.length() < 0.03, "{found:?}");
    }

    /// The order of the limits does not matter.
    #[test]
    fn the_order_of_limits_does_not_matter() {
        let mut random = Random(11);
        for _ in 0..200 {
            let mut limits: Vec<PlaneLimit> =
                (0..6).map(|_| PlaneLimit { normal: normalize_or(random.vector(), Vec3::Y), least: 0.0 }).collect();
            let wanted = random.vector();
            let forwards = solve_planes(wanted, &limits).vector;
            limits.reverse();
            assert!(solve_planes(wanted, &limits).vector.distance(forwards) < 1e-5);
        }
    }
}
