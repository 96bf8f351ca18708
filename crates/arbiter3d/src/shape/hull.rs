//! Convex polyhedra with half edges. (Builder to come.)

use super::{MassProperties, ShapeError};
use crate::math::{Aabb, Real, Vec3};

/// A plane `normal · x = offset`; the inside of a hull has `normal · x <= offset` for every face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Unit normal, pointing out.
    pub normal: Vec3,
    /// Distance of the plane from the origin along the normal, metres.
    pub offset: Real,
}

/// One side of an edge: it starts at `origin`, runs counter-clockwise (seen from outside) around `face`.
///
/// Twins are neighbours in the list: the twin of edge `i` is `i ^ 1`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HalfEdge {
    /// Vertex the edge starts at.
    pub origin: u8,
    /// Face on its left.
    pub face: u16,
    /// Next edge around the face.
    pub next: u16,
}

/// A convex polyhedron of up to 255 vertices, with merged faces and half edges.
///
/// ```
/// use arbiter3d::{ConvexHull, math::Vec3};
/// let corners: Vec<Vec3> = (0..8).map(|i| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32)).collect();
/// let cube = ConvexHull::new(&corners)?;
/// assert_eq!(cube.planes().len(), 6);
/// # Ok::<(), arbiter3d::ShapeError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct ConvexHull {
    vertices: Vec<Vec3>,
    planes: Vec<Plane>,
    face_edges: Vec<u16>,
    edges: Vec<HalfEdge>,
    aabb: Aabb,
    inner_radius: Real,
    unit_mass: MassProperties,
}

impl ConvexHull {
    /// The convex hull of some points, metres.
    ///
    /// # Errors
    /// If a point is not finite, the points are flat, or the hull needs more than 255 vertices.
    pub fn new(points: &[Vec3]) -> Result<Self, ShapeError> {
        Err(ShapeError::TooFewPoints { count: points.len() })
    }

    /// Corners, metres.
    #[must_use]
    pub fn vertices(&self) -> &[Vec3] {
        &self.vertices
    }

    /// Face planes.
    #[must_use]
    pub fn planes(&self) -> &[Plane] {
        &self.planes
    }

    /// The first half edge of each face.
    #[must_use]
    pub fn face_edges(&self) -> &[u16] {
        &self.face_edges
    }

    /// Half edges, twins side by side.
    #[must_use]
    pub fn edges(&self) -> &[HalfEdge] {
        &self.edges
    }

    /// Distance from the centre of mass to the nearest face, metres.
    #[must_use]
    pub fn inner_radius(&self) -> Real {
        self.inner_radius
    }

    pub(crate) fn local_aabb(&self) -> Aabb {
        self.aabb
    }

    pub(crate) fn mass_properties(&self, density: Real) -> MassProperties {
        MassProperties {
            mass: self.unit_mass.mass * density,
            center: self.unit_mass.center,
            inertia: self.unit_mass.inertia.scale(density),
        }
    }
}
