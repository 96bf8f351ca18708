//! Collision geometry: spheres, capsules, cuboids, convex hulls and triangle meshes.
//!
//! A [`Shape`] is geometry alone, in its own frame. Where it sits on a body and what it is made of (density, friction, …)
//! is said when it is attached. Hulls and meshes are shared: cloning a `Shape` copies a reference.

mod capsule;
mod cuboid;
mod hull;
mod hull_builder;
mod hull_core;
mod hull_features;
mod hull_merge;
mod mass;
mod mesh;
mod mesh_edges;
mod mesh_tree;
mod mesh_tree_builder;
mod sphere;

pub use capsule::Capsule;
pub use cuboid::Cuboid;
pub use hull::{ConvexHull, HalfEdge, Plane};
pub(crate) use hull_features::{BorderEdge, CornerGroup, FaceGroup, LANES};
pub use mass::MassProperties;
pub(crate) use mesh::Facet;
pub use mesh::{MeshRayHit, MeshSides, TriangleMesh};
pub(crate) use mesh_edges::Surroundings;
pub(crate) use mesh_tree::{LEAF, Leaves};
pub use sphere::Sphere;

use crate::math::{Aabb, Pose, Real, Vec3};
use std::sync::Arc;

/// Why a shape cannot be built. Each message names the argument or the element.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ShapeError {
    /// A length is zero, negative or not finite.
    #[error("{what} is {value}: it must be a finite length greater than zero")]
    NotPositive {
        /// The argument.
        what: &'static str,
        /// Its value.
        value: Real,
    },
    /// A point has a coordinate that is NaN or infinite.
    #[error("point {index} is {point:?}: all coordinates must be finite")]
    NotFinite {
        /// Position in the list given.
        index: usize,
        /// The point.
        point: Vec3,
    },
    /// Fewer than four points for a hull.
    #[error("a convex hull needs at least 4 points, got {count}")]
    TooFewPoints {
        /// Points given.
        count: usize,
    },
    /// The points of a hull lie (almost) on a plane, a line or a point.
    #[error("the {count} points are flat within {tolerance} m: a convex hull needs volume; use a mesh for a surface")]
    Flat {
        /// Points given.
        count: usize,
        /// The thickness below which points count as flat.
        tolerance: Real,
    },
    /// The hull needs more vertices, faces or edges than it can hold.
    #[error("the hull has {count} {what}, the limit is {limit}: simplify the points, or allow fewer vertices")]
    TooManyFeatures {
        /// "vertices", "faces" or "edges".
        what: &'static str,
        /// How many it would need, at least.
        count: usize,
        /// How many it may have.
        limit: usize,
    },
    /// A hull so small or large that its volume or inertia overflows or vanishes.
    #[error("the hull is {size} m large: its volume and inertia do not fit single precision; use 1e-7 m to 1e7 m")]
    SizeOutOfRange {
        /// Its largest extent, metres.
        size: Real,
    },
    /// A mesh without triangles.
    #[error("the mesh has no triangles")]
    EmptyMesh,
    /// A triangle refers to a vertex that does not exist.
    #[error("triangle {triangle} refers to vertex {index}, but the mesh has {vertices} vertices")]
    IndexOutOfRange {
        /// Which triangle.
        triangle: usize,
        /// The index it holds.
        index: u32,
        /// Number of vertices.
        vertices: usize,
    },
    /// A triangle whose area is zero.
    #[error("triangle {triangle} has no area: remove it, or weld and clean the mesh first")]
    DegenerateTriangle {
        /// Which triangle.
        triangle: usize,
    },
}

/// Checks that a length can be used: finite and above zero.
pub(crate) fn positive(what: &'static str, value: Real) -> Result<Real, ShapeError> {
    if value > 0.0 && value.is_finite() { Ok(value) } else { Err(ShapeError::NotPositive { what, value }) }
}

/// Collision geometry in its own frame.
///
/// ```
/// use arbiter3d::{Shape, math::Vec3};
/// let crate_shape = Shape::cuboid(Vec3::new(0.5, 0.5, 0.5))?;
/// let ball = Shape::sphere(0.25)?;
/// assert!(Shape::sphere(f32::NAN).is_err());
/// # Ok::<(), arbiter3d::ShapeError>(())
/// ```
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum Shape {
    /// A ball about the origin.
    Sphere(Sphere),
    /// A segment on the y axis with a radius.
    Capsule(Capsule),
    /// A box about the origin.
    Cuboid(Cuboid),
    /// A convex polyhedron.
    Hull(Arc<ConvexHull>),
    /// A triangle mesh, for static and kinematic bodies.
    Mesh(Arc<TriangleMesh>),
}

impl Shape {
    /// A sphere about the origin; radius in metres.
    ///
    /// # Errors
    /// If the radius is not a finite length above zero.
    pub fn sphere(radius: Real) -> Result<Self, ShapeError> {
        Sphere::new(radius).map(Self::Sphere)
    }

    /// A capsule along y: the segment from `-half_length` to `half_length`, grown by `radius`; metres.
    ///
    /// # Errors
    /// If a length is not finite and above zero.
    pub fn capsule(half_length: Real, radius: Real) -> Result<Self, ShapeError> {
        Capsule::new(half_length, radius).map(Self::Capsule)
    }

    /// A box about the origin; half extents in metres.
    ///
    /// # Errors
    /// If a half extent is not a finite length above zero.
    pub fn cuboid(half_extents: Vec3) -> Result<Self, ShapeError> {
        Cuboid::new(half_extents).map(Self::Cuboid)
    }

    /// The convex hull of some points, metres.
    ///
    /// # Errors
    /// If a point is not finite, the points are flat, or the hull has more than 255 vertices.
    pub fn hull(points: &[Vec3]) -> Result<Self, ShapeError> {
        ConvexHull::new(points).map(|hull| Self::Hull(Arc::new(hull)))
    }

    /// A triangle mesh, solid on the side from which its triangles wind counter-clockwise.
    ///
    /// # Errors
    /// If there is no triangle, an index is out of range, a vertex is not finite or a triangle has no area.
    pub fn mesh(vertices: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Result<Self, ShapeError> {
        TriangleMesh::new(vertices, triangles).map(|mesh| Self::Mesh(Arc::new(mesh)))
    }

    /// The box around the shape in its own frame.
    #[must_use]
    pub fn local_aabb(&self) -> Aabb {
        match self {
            Self::Sphere(s) => s.local_aabb(),
            Self::Capsule(s) => s.local_aabb(),
            Self::Cuboid(s) => s.local_aabb(),
            Self::Hull(s) => s.local_aabb(),
            Self::Mesh(s) => s.local_aabb(),
        }
    }

    /// The box around the shape placed by `pose`.
    #[inline]
    #[must_use]
    pub fn aabb(&self, pose: &Pose) -> Aabb {
        match self {
            Self::Sphere(s) => Aabb::from_center(pose.position, Vec3::splat(s.radius())),
            Self::Capsule(s) => s.aabb(pose),
            Self::Cuboid(s) => s.aabb(pose),
            Self::Hull(s) => s.aabb(pose),
            Self::Mesh(s) => s.local_aabb().transform(pose),
        }
    }

    /// Mass, centre and inertia at `density` (kg/m³); `None` for a mesh, which has no inside.
    #[must_use]
    pub fn mass_properties(&self, density: Real) -> Option<MassProperties> {
        match self {
            Self::Sphere(s) => Some(s.mass_properties(density)),
            Self::Capsule(s) => Some(s.mass_properties(density)),
            Self::Cuboid(s) => Some(s.mass_properties(density)),
            Self::Hull(s) => Some(s.mass_properties(density)),
            Self::Mesh(_) => None,
        }
    }

    /// Radius of a ball that fits inside: how far the shape may move in a step before it can tunnel. Zero for meshes.
    #[must_use]
    pub fn inner_radius(&self) -> Real {
        match self {
            Self::Sphere(s) => s.radius(),
            Self::Capsule(s) => s.radius(),
            Self::Cuboid(s) => s.half_extents().min_element(),
            Self::Hull(s) => s.inner_radius(),
            Self::Mesh(_) => 0.0,
        }
    }

    /// Distance of the farthest point of the shape from the origin of its frame, metres; for meshes an upper bound.
    #[must_use]
    pub fn reach(&self) -> Real {
        self.reach_from(Vec3::ZERO)
    }

    /// Distance of the farthest point of the shape from a point of its frame; for meshes an upper bound.
    pub(crate) fn reach_from(&self, point: Vec3) -> Real {
        match self {
            Self::Sphere(s) => point.length() + s.radius(),
            Self::Capsule(s) => {
                let along = Vec3::new(point.x, point.y.abs() + s.half_length(), point.z);
                along.length() + s.radius()
            }
            Self::Cuboid(s) => (crate::math::abs3(point) + s.half_extents()).length(),
            Self::Hull(s) => s.vertices().iter().fold(0.0, |far, v| crate::math::max((*v - point).length(), far)),
            Self::Mesh(s) => s.local_aabb().farthest_from(point).length(),
        }
    }

    /// The radius that rolls: how far the surface is from the inner core of a rounded shape, zero for polyhedra.
    #[must_use]
    pub fn rounding_radius(&self) -> Real {
        match self {
            Self::Sphere(s) => s.radius(),
            Self::Capsule(s) => s.radius(),
            _ => 0.0,
        }
    }

    /// Whether the shape has an inside, so that dynamic bodies may carry it.
    #[must_use]
    pub fn is_convex(&self) -> bool {
        !matches!(self, Self::Mesh(_))
    }
}
