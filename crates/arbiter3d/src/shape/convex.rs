//! What the general kernels ask of convex shapes: their features, and surfaces and masses made from support points alone.

use super::mass::Moments;
use super::support::Support;
use super::{MassProperties, ShapeError};
use crate::math::{Real, Vec3, clamp, tangents};
use glam::DVec3;

/// Corners of a feature at most; a disc is told by as many.
pub(crate) const FEATURE_POINTS: usize = 16;

/// A line whose direction is off a right angle to the normal by more than this sine is no feature: its end is.
pub(crate) const FLAT_SINE: Real = 0.5;

/// The part of a convex surface that lies most along a direction: a point, a line, or a convex polygon that winds
/// counter-clockwise about the direction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Feature {
    points: [Vec3; FEATURE_POINTS],
    count: usize,
}

impl Default for Feature {
    fn default() -> Self {
        Self { points: [Vec3::ZERO; FEATURE_POINTS], count: 0 }
    }
}

impl Feature {
    /// Adds a corner; past the limit they are left out.
    #[inline]
    pub fn push(&mut self, point: Vec3) {
        if self.count < FEATURE_POINTS {
            self.points[self.count] = point;
            self.count += 1;
        }
    }

    /// Its corners.
    pub fn points(&self) -> &[Vec3] {
        &self.points[..self.count]
    }

    /// Its corners, to move.
    pub fn points_mut(&mut self) -> &mut [Vec3] {
        &mut self.points[..self.count]
    }

    /// The disc about the y axis at height `y`, which looks along `d`. Where it leans, one corner is the point of the rim that
    /// is furthest along `d`; level its corners stay where they are on the body, so that rest is rest. In between they turn
    /// from the one to the other.
    pub fn set_disc(&mut self, y: Real, radius: Real, d: Vec3) {
        let across = (d.x * d.x + d.z * d.z).sqrt();
        let share = clamp((across - LEVEL) / (LEANING - LEVEL), 0.0, 1.0);
        let (cosine, sine) = if share <= 0.0 {
            (1.0, 0.0)
        } else if share >= 1.0 {
            (d.x / across, d.z / across)
        } else {
            // Of the four corners that carry the disc the nearest is turned there: which corner is which stays.
            let along_x = d.x.abs() >= d.z.abs();
            let sign = if (if along_x { d.x } else { d.z }) < 0.0 { -1.0 } else { 1.0 };
            let (near, aside) = if along_x { (d.x * sign, d.z * sign) } else { (d.z * sign, -d.x * sign) };
            let (x, z) = (1.0 + (near / across - 1.0) * share, aside / across * share);
            let length = (x * x + z * z).sqrt();
            (x / length, z / length)
        };
        let turn = if d.y > 0.0 { -1.0 } else { 1.0 };
        for (c, s) in SIXTEENTHS {
            let (x, z) = (c * cosine - s * turn * sine, c * sine + s * turn * cosine);
            self.push(Vec3::new(x * radius, y, z * radius));
        }
    }

    /// A polygon with too many corners: every so many of them.
    pub fn set_thinned(&mut self, count: usize, corner: impl Fn(usize) -> Vec3) {
        let kept = count.min(FEATURE_POINTS);
        for k in 0..kept {
            self.push(corner(k * count / kept));
        }
    }
}

/// A disc is level whose axis is off the direction by no more than this sine, and leans beyond the other one.
const LEVEL: Real = 1e-5;
const LEANING: Real = 5e-5;

/// Cosines and sines of the sixteenths of a turn.
const SIXTEENTHS: [(Real, Real); FEATURE_POINTS] = {
    const A: Real = 0.923_879_5;
    const B: Real = std::f32::consts::FRAC_1_SQRT_2;
    const C: Real = 0.382_683_43;
    [
        (1.0, 0.0),
        (A, C),
        (B, B),
        (C, A),
        (0.0, 1.0),
        (-C, A),
        (-B, B),
        (-A, C),
        (-1.0, 0.0),
        (-A, -C),
        (-B, -B),
        (-C, -A),
        (0.0, -1.0),
        (C, -A),
        (B, -B),
        (A, -C),
    ]
};

/// Directions, evenly spread enough, as corners of triangles that wind counter-clockwise from outside: an octahedron with
/// `steps` steps along each edge.
pub(crate) fn sphere_grid(steps: usize) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let (mut directions, mut triangles) = (Vec::new(), Vec::new());
    let signs = |octant: usize| [0, 1, 2].map(|axis| if octant >> axis & 1 == 1 { -1.0 } else { 1.0 });
    for octant in 0..8 {
        let ([sx, sy, sz], first) = (signs(octant), directions.len() as u32);
        let mirrored = octant.count_ones() % 2 == 1;
        for i in 0..=steps {
            for j in 0..=steps - i {
                let k = (steps - i - j) as f64;
                directions.push(DVec3::new(sx * i as f64, sy * j as f64, sz * k).normalize());
            }
        }
        // Row `i` starts after the longer rows before it.
        let at = |i: usize, j: usize| first + (i * (steps + 1) - i * i.saturating_sub(1) / 2 + j) as u32;
        let mut push = |[a, b, c]: [u32; 3]| triangles.push(if mirrored { [a, c, b] } else { [a, b, c] });
        for i in 0..steps {
            for j in 0..steps - i {
                push([at(i, j), at(i + 1, j), at(i, j + 1)]);
                if j + 1 < steps - i {
                    push([at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
                }
            }
        }
    }
    (directions, triangles)
}

/// Corners and triangles of a surface, counter-clockwise from outside.
pub(crate) type DrawnSurface = (Vec<Vec3>, Vec<[u32; 3]>);

/// A surface through the support points of a grid of directions; triangles that these make into a line are left out.
pub(crate) fn surface_of_support(support: &Support<'_>, steps: usize) -> DrawnSurface {
    let (directions, mut triangles) = sphere_grid(steps);
    let points: Vec<Vec3> = directions.iter().map(|&d| support.full_support(d).as_vec3()).collect();
    triangles.retain(|t| {
        let [a, b, c] = t.map(|i| points[i as usize]);
        a != b && b != c && c != a
    });
    (points, triangles)
}

/// Steps of the two grids that the mass of a shape is reckoned on.
const MASS_STEPS: [usize; 2] = [24, 48];

/// Mass, centre and inertia at density one of a shape known by its support alone.
///
/// The volume inside the support points of a grid misses a share that falls with the square of the grid's step: that of two
/// grids tells what it would be at step zero (Richardson's extrapolation).
pub(crate) fn mass_of_support(support: &Support<'_>) -> Result<MassProperties, ShapeError> {
    let [coarse, fine] = MASS_STEPS.map(|steps| {
        let (directions, triangles) = sphere_grid(steps);
        let points: Vec<DVec3> = directions.iter().map(|&d| support.full_support(d)).collect();
        let mut moments = Moments::default();
        triangles.iter().for_each(|t| moments.add_triangle(t.map(|i| points[i as usize])));
        moments
    });
    fine.blend(4.0 / 3.0, &coarse, -1.0 / 3.0).unit_mass().ok_or(ShapeError::NoVolume {
        shape: "the shape",
        advice: "give it some thickness, or give its body a mass and the shape a density of zero",
    })
}

/// The feature of a shape known by its support alone: the support points of directions around the one asked for, where they
/// stay as far apart as the directions come closer. Those of a round spot come closer too.
pub(crate) fn sampled_feature(support: &dyn Fn(Vec3) -> Vec3, d: Vec3, size: Real, out: &mut Feature) {
    /// How far the directions lean, and how far the closer ones.
    const LEANS: [Real; 2] = [0.06, 0.02];
    /// The share of their spread that the closer ones of a face or an edge still have.
    const LASTING: Real = 0.6;
    let (t1, t2) = tangents(d);
    let top = support(d);
    let rings = LEANS.map(|lean| {
        let mut ring = [top; FEATURE_POINTS / 2];
        for (k, point) in ring.iter_mut().enumerate() {
            let (cosine, sine) = SIXTEENTHS[2 * k];
            *point = support((d + (t1 * cosine + t2 * sine) * lean).normalize());
        }
        ring
    });
    let spread = rings
        .map(|ring| ring.iter().fold(0.0, |most, p| crate::math::max((*p - ring[0]).length_squared(), most)).sqrt());
    let near = 0.02 * size;
    if spread[0] < near || spread[1] < LASTING * spread[0] {
        out.push(top);
        return;
    }
    for point in rings[0] {
        let new = out.points().iter().all(|other| (*other - point).length_squared() > near * near);
        if new {
            out.push(point);
        }
    }
}
