//! The inside of a closed mesh: its mass, and a ball that fits in it.
//!
//! Mass, centre and inertia are exact: by the divergence theorem the sum of the signed tetrahedra from the origin to all
//! triangles, in double precision.
//!
//! The ball is a good one, not always the largest. From some triangles a ray goes inwards; halfway to where it leaves again is
//! a point inside, which is then moved to the middle between what is left and right, above and below, before and behind it.
//! The nearest triangle tells how large the ball about it may be; the largest ball counts.

use super::MassProperties;
use super::mass::Moments;
use super::mesh::{MeshSides, TriangleMesh};
use super::mesh_tree::{Descent, LEAF, box_distances};
use super::surface::Surface;
use super::surface_ray::first_triangle;
use crate::math::{Aabb, Real, Vec3, clamp, min};
use crate::simd::{LaneVec3, Lanes};

/// Triangles from which rays go inwards.
const STARTS: usize = 24;
/// How often a point is moved to the middle along each axis.
const ROUNDS: usize = 3;

#[derive(Clone, Debug)]
pub(super) struct Interior {
    /// Mass properties at density one; `None` if the mesh is inside out.
    pub(super) unit: Option<MassProperties>,
    pub(super) ball: (Vec3, Real),
}

impl Interior {
    pub(super) fn of(mesh: &TriangleMesh) -> Self {
        let mut moments = Moments::default();
        let vertices = mesh.vertices();
        for triangle in mesh.triangles() {
            moments.add_triangle(triangle.map(|i| vertices[i as usize].as_dvec3()));
        }
        let unit = moments.unit_mass();
        let ball = match unit {
            Some(_) => inner_ball(mesh),
            None => (mesh.local_aabb().center(), 0.0),
        };
        Self { unit, ball }
    }
}

fn inner_ball(mesh: &TriangleMesh) -> (Vec3, Real) {
    let size = mesh.local_aabb().half_extents().length();
    let count = mesh.triangles().len();
    let starts = STARTS.min(count);
    let mut best = (mesh.local_aabb().center(), 0.0);
    for k in 0..starts {
        let index = k * count / starts;
        let [a, b, c] = mesh.corners(index);
        let inwards = -mesh.facet(index).normal();
        let start = (a + b + c) * (1.0 / 3.0) + inwards * (1e-4 * size);
        let Some(mut point) = middle(mesh, start, inwards, size) else { continue };
        for _ in 0..ROUNDS {
            for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
                point = middle(mesh, point, axis, size).unwrap_or(point);
            }
        }
        let radius = clearance(mesh, point, size);
        if radius > best.1 * 1.0001 {
            best = (point, radius);
        }
    }
    best
}

/// The middle between what is before and behind a point that is inside; `None` if it is not.
fn middle(mesh: &TriangleMesh, point: Vec3, axis: Vec3, size: Real) -> Option<Vec3> {
    let inside = |direction: Vec3| {
        let (distance, _, back) = first_triangle(Surface::Mesh(mesh), (point, direction, 4.0 * size), MeshSides::Two)?;
        back.then_some(distance)
    };
    let (ahead, behind) = (inside(axis)?, inside(-axis).unwrap_or(0.0));
    Some(point + axis * (0.5 * (ahead - behind)))
}

/// Distance of the nearest triangle, at most `limit`.
fn clearance(mesh: &TriangleMesh, point: Vec3, limit: Real) -> Real {
    let mut nearest = Nearest { mesh, point, squared: limit * limit };
    mesh.descend(limit * limit, &mut nearest);
    nearest.squared.sqrt()
}

struct Nearest<'a> {
    mesh: &'a TriangleMesh,
    point: Vec3,
    squared: Real,
}

impl Descent for Nearest<'_> {
    #[inline(always)]
    fn distances<W: Lanes<LEAF>>(&self, low: &LaneVec3<W>, high: &LaneVec3<W>, limit: Real) -> W {
        box_distances(&Aabb::new(self.point, self.point), low, high, limit)
    }

    #[inline(always)]
    fn leaf<W: Lanes<LEAF>>(&mut self, first: usize, count: usize, _: Real) -> Real {
        for index in first..first + count {
            self.squared = min(distance_squared(&self.mesh.corners(index), self.point), self.squared);
        }
        self.squared
    }
}

/// Square of the distance of a point from a triangle.
pub(crate) fn distance_squared(corners: &[Vec3; 3], point: Vec3) -> Real {
    let [a, b, c] = *corners;
    let normal = (b - a).cross(c - a);
    let mut least = Real::MAX;
    let mut inside = true;
    for (from, to) in [(a, b), (b, c), (c, a)] {
        let (along, out) = (to - from, point - from);
        inside &= normal.cross(along).dot(out) >= 0.0;
        let t = clamp(out.dot(along) / along.length_squared(), 0.0, 1.0);
        least = min((out - along * t).length_squared(), least);
    }
    let height = normal.dot(point - a);
    if inside { height * height / normal.length_squared() } else { least }
}
