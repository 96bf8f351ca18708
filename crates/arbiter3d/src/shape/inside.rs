//! What is well inside a convex shape that is known by points of its surface: the eroded corners of their hull.

use super::ConvexHull;
use super::convex::sphere_grid;
use super::support::Support;
use crate::math::{Real, Vec3};
use glam::DVec3;

/// Corners of the hull at most: continuous collision looks at all of them again and again.
const CORNERS: usize = 64;
/// Steps of the grid of directions in which a shape is asked.
const STEPS: usize = 4;

/// Points inside a convex shape, for continuous collision (see `hull_core`).
#[derive(Clone, Debug)]
pub(crate) struct Inside {
    /// Half the inner radius inside.
    pub core: Vec<Vec3>,
    /// Nine tenths of it inside.
    pub spine: Vec<Vec3>,
    pub middle: Vec3,
    pub inner_radius: Real,
}

impl Inside {
    pub(super) fn of_hull(hull: &ConvexHull) -> Self {
        let (core, spine) = (hull.core().to_vec(), hull.spine().to_vec());
        Self { core, spine, middle: hull.centroid(), inner_radius: hull.inner_radius() }
    }

    /// From support points in many directions; `map` takes a point to where it counts. `None` if they lie on a plane.
    pub(super) fn of_support(support: &Support<'_>, map: impl Fn(DVec3) -> DVec3) -> Option<Self> {
        let directions = sphere_grid(STEPS).0;
        let points: Vec<Vec3> = directions.iter().map(|&d| map(support.full_support(d)).as_vec3()).collect();
        ConvexHull::with_max_vertices(&points, CORNERS).ok().map(|hull| Self::of_hull(&hull))
    }
}
