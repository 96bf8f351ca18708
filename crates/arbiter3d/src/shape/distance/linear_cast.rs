//! When a convex shape that moves along a line first touches another: GJK on the moving difference.
//!
//! The difference `x2 − x1` of the cores moves by the displacement; it touches when the origin comes within the sum of
//! the radii. In each round the extreme point `w` of the difference towards the origin gives a plane with normal `v`
//! (from the closest point found so far) behind which all of the difference lies. While that plane is beyond the
//! radius, the time goes on until it is there, which can jump over nothing; else `w` joins the simplex. So the search
//! for the closest points and the advance in time are one loop. Source: van den Bergen, "Ray Casting against General
//! Convex Objects with Application to Continuous Collision Detection", 2004.
//!
//! The time stops a thin *shell* before the surfaces touch, where the direction between the closest points still has
//! its digits. There the closest points are found to the end, and one last advance along their direction closes the
//! shell: exact for faces, edges and corners, for round surfaces early by a share of the shell. All in `f64`, as in the
//! parent module.

use super::{Closest, Corner, Placed, Simplex, Support, larger};
use crate::math::{Pose, Real, Vec3};
use glam::DVec3;

/// Thickness of the shell, as a share of the size of the moving shape.
const SHELL: f64 = 1e-5;
/// Cores closer than this share of their size overlap: beyond it the direction is rounding.
const TOUCHING: f64 = 1e-13;
/// Rounding of a coordinate, as a share of the size.
const ROUNDING: f64 = 1e-14;
/// Sine of the angle under which a motion from a touch is along the surface.
const GRAZING: f64 = 1e-6;
/// A new extreme point that gains less than this share of the distance is none.
const GAIN: f64 = 1e-12;
/// Far more than polyhedra need. After it the time reached is given back: early, never late.
const MAX_ROUNDS: usize = 96;

/// What a moving shape meets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Cast {
    /// Nothing.
    Miss,
    /// The shapes overlap at the start.
    Overlap,
    /// Their surfaces touch.
    Hit(CastPoint),
}

/// Where a moving shape first touches another, in the frame of that one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CastPoint {
    /// Share of the displacement.
    pub fraction: Real,
    /// Unit normal from shape 1 to the moving shape 2.
    pub normal: Vec3,
    /// On the surface of shape 1.
    pub point1: Vec3,
}

/// Moves shape 2, placed in the frame of shape 1 by `pose`, along `displacement` up to the share `limit` of it. `size`
/// is that of the moving shape, metres: what is exact is relative to it.
pub(crate) fn linear_cast(
    (shape1, shape2): (&Support, &Support),
    pose: &Pose,
    displacement: Vec3,
    limit: Real,
    size: Real,
) -> Cast {
    let placed = Placed::new(shape1, shape2, pose);
    let (radius1, radius2) = (f64::from(shape1.radius()), f64::from(shape2.radius()));
    Search {
        base: placed.position,
        placed,
        displacement: displacement.as_dvec3(),
        limit: f64::from(limit),
        radius: radius1 + radius2,
        shell: SHELL * f64::from(size),
        time: 0.0,
        simplex: Simplex::default(),
        extent: 0.0,
    }
    .run(radius1)
}

struct Search<'a> {
    placed: Placed<'a>,
    /// Where shape 2 starts.
    base: DVec3,
    displacement: DVec3,
    limit: f64,
    /// Sum of the radii.
    radius: f64,
    shell: f64,
    time: f64,
    simplex: Simplex,
    /// Length of the longest difference seen.
    extent: f64,
}

impl Search<'_> {
    fn run(mut self, radius1: f64) -> Cast {
        let mut v = self.placed.position;
        if v.length_squared() == 0.0 {
            v = DVec3::X;
        }
        let mut shortest = f64::MAX;
        for _ in 0..MAX_ROUNDS {
            let mut corner = self.placed.corner(-v);
            let length = v.length();
            self.extent = larger(self.extent, corner.difference.length());
            self.shell = larger(self.shell, 1e-10 * self.extent);
            let plane = v.dot(corner.difference) / length;
            let gap = plane - self.radius;
            let known = self.has(&corner);
            if gap > 1.1 * self.shell {
                let closing = -v.dot(self.displacement) / length;
                let step = (gap - self.shell) / closing;
                let reaches = closing > 0.0 && self.time + step <= self.limit;
                if !reaches {
                    return Cast::Miss;
                }
                self.advance(step, &mut corner);
                shortest = f64::MAX;
            } else {
                let gains = length - plane > GAIN * length + ROUNDING * self.extent;
                if self.simplex.count > 0 && (known || !gains || v.length_squared() >= shortest) {
                    break;
                }
                shortest = if self.simplex.count > 0 { v.length_squared() } else { f64::MAX };
            }
            if !known {
                self.simplex.push(corner);
            }
            if !self.simplex.reduce() {
                return self.touch();
            }
            v = self.simplex.point();
            if v.length() <= TOUCHING * self.extent {
                return self.touch();
            }
        }
        self.finish(v, radius1)
    }

    /// Whether a corner is one of the simplex, but for rounding.
    fn has(&self, corner: &Corner) -> bool {
        let near = ROUNDING * self.extent;
        let corners = &self.simplex.corners[..self.simplex.count];
        corners.iter().any(|c| (c.difference - corner.difference).length_squared() <= near * near)
    }

    fn advance(&mut self, step: f64, corner: &mut Corner) {
        self.time += step;
        let shift = self.displacement * step;
        self.placed.position = self.base + self.displacement * self.time;
        corner.difference += shift;
        for known in &mut self.simplex.corners[..self.simplex.count] {
            known.difference += shift;
        }
    }

    /// The cores themselves touch: they overlap from the start, for the shell keeps them apart later.
    fn touch(&self) -> Cast {
        if self.time == 0.0 {
            return Cast::Overlap;
        }
        let back = -self.displacement.normalize_or_zero();
        let point1 = self.simplex.witness().as_vec3();
        Cast::Hit(CastPoint { fraction: self.time as Real, normal: back.as_vec3(), point1 })
    }

    /// Closes the shell.
    fn finish(&self, v: DVec3, radius1: f64) -> Cast {
        let distance = v.length();
        let normal = v / distance;
        let gap = distance - self.radius;
        let closing = -normal.dot(self.displacement);
        // What touches and slides along, or goes away, meets nothing.
        let leaves = closing <= GRAZING * self.displacement.length();
        if gap <= 0.0 && self.time == 0.0 && !(leaves && gap > -self.shell) {
            return Cast::Overlap;
        }
        if closing <= 0.0 || leaves && self.time == 0.0 {
            return Cast::Miss;
        }
        // The plane, not the distance: it is as far away but for smooth shapes that took too many rounds, and never too
        // far.
        let plane = normal.dot(self.placed.corner(-v).difference) - self.radius;
        let time = self.time + larger(plane, 0.0) / closing;
        if time > self.limit {
            return Cast::Miss;
        }
        let point1 = self.simplex.witness() + normal * radius1;
        Cast::Hit(CastPoint { fraction: time as Real, normal: normal.as_vec3(), point1: point1.as_vec3() })
    }
}

impl Closest {
    /// Distance of the surfaces, negative where they overlap.
    pub(crate) fn gap(&self, shape1: &Support, shape2: &Support) -> Real {
        self.distance - shape1.radius() - shape2.radius()
    }
}
