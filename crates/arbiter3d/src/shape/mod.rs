//! Collision geometry.
//!
//! A [`Shape`] is geometry alone, in its own frame. Where it sits on a body and what it is made of (density, friction, …)
//! is said when it is attached. What takes memory is shared: cloning a `Shape` copies a reference, and 10,000 bodies with
//! one hull hold one hull.
//!
//! Convex kinds with kernels of their own: spheres, capsules, cuboids, hulls. Convex kinds known to the kernels by their
//! support function and their features (`convex`): cylinders, cones, tapered capsules, single triangles, point clouds,
//! anything convex grown by a radius or after an affine map, and shapes of the user's own. Then endless half-spaces, and
//! what is made of many parts: triangle meshes, height fields, compounds of other shapes, voxel grids.

mod capsule;
mod compound;
mod cone;
mod convex;
mod convex_ray;
pub(crate) mod cores;
mod cuboid;
mod custom;
mod cylinder;
#[cfg(feature = "decomposition")]
mod decomposition;
pub(crate) mod distance;
mod geometry;
mod half_space;
mod height_field;
mod hull;
mod hull_builder;
mod hull_core;
mod hull_features;
mod hull_merge;
mod inside;
mod mass;
mod mesh;
mod mesh_core;
mod mesh_edges;
mod mesh_interior;
mod mesh_tree;
mod mesh_tree_builder;
mod point_cloud;
pub(crate) mod polyhedron;
mod ray;
mod rounded;
mod sphere;
mod support;
mod surface;
mod surface_ray;
mod tapered_capsule;
mod transformed;
mod triangle;
mod voxels;

pub use capsule::Capsule;
pub use compound::{Compound, CompoundChild};
pub use cone::Cone;
use convex::DrawnSurface;
#[cfg(test)]
pub(crate) use convex::sphere_grid;
pub(crate) use convex::{FEATURE_POINTS, FLAT_SINE, Feature};
pub use cuboid::Cuboid;
pub use custom::{ConvexShape, Custom};
pub use cylinder::Cylinder;
#[cfg(feature = "decomposition")]
pub use decomposition::DecompositionSettings;
pub(crate) use geometry::Geometry;
pub use half_space::HalfSpace;
pub use height_field::{FieldDiagonals, FieldSide, HeightField};
pub use hull::{ConvexHull, HalfEdge, Plane};
pub(crate) use hull_features::{BorderEdge, CornerGroup, FaceGroup, LANES};
pub use mass::MassProperties;
pub(crate) use mesh::Facet;
pub use mesh::{MeshRayHit, MeshSides, TriangleMesh};
pub(crate) use mesh_core::InnerShell;
pub(crate) use mesh_edges::Surroundings;
pub(crate) use mesh_interior::distance_squared;
pub(crate) use mesh_tree::{Descent, LEAF, Leaves, Slabs, box_distances};
pub use point_cloud::PointCloud;
pub(crate) use ray::cast_placed;
pub use ray::{Ray, ShapeHit, cast_ray};
pub use rounded::Rounded;
pub use sphere::Sphere;
pub(crate) use support::Support;
pub(crate) use surface::Surface;
pub use tapered_capsule::TaperedCapsule;
pub use transformed::Transformed;
pub use triangle::Triangle;
pub(crate) use triangle::{triangle_edge, triangle_feature};
pub use voxels::VoxelGrid;

use crate::math::{Aabb, Mat3, Pose, Real, Vec3};
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
    /// Heights that are no grid.
    #[error(
        "{heights} heights in rows of {points_per_row}: a height field needs full rows, at least 2 × 2 heights, at most \
         2^30 cells"
    )]
    FieldSize {
        /// Heights given.
        heights: usize,
        /// Heights in a row.
        points_per_row: usize,
    },
    /// A list that tells of each cell or triangle has another length.
    #[error("{given} {what} were given, but there are {expected} cells or triangles: give one for each")]
    WrongCount {
        /// What was given.
        what: &'static str,
        /// How many.
        given: usize,
        /// How many there must be.
        expected: usize,
    },
    /// One ball of a tapered capsule holds the other.
    #[error(
        "balls of {top_radius} m and {bottom_radius} m are {distance} m apart, so one holds the other: use a sphere, or \
         move them apart"
    )]
    BallInBall {
        /// Distance of the centres, metres.
        distance: Real,
        /// Radius of the upper ball, metres.
        top_radius: Real,
        /// Radius of the lower ball, metres.
        bottom_radius: Real,
    },
    /// A shape that has to be convex is not.
    #[error("{what} must be convex and bounded: not a mesh, a half-space or another shape of many parts")]
    NotConvex {
        /// What it is for.
        what: &'static str,
    },
    /// An affine map that is flat or not finite.
    #[error("the determinant of the map is {determinant}: a shape after it would be flat or endless")]
    FlatTransform {
        /// The determinant of its linear part.
        determinant: Real,
    },
    /// A shape without a volume has no mass.
    #[error("{shape} has no volume, so no mass: {advice}")]
    NoVolume {
        /// Which shape.
        shape: &'static str,
        /// What to do.
        advice: &'static str,
    },
    /// A mesh with holes has no inside, so no mass.
    #[error(
        "{edges} edges of the mesh have no matching neighbour: close it, give the shape density 0, or use a static body"
    )]
    OpenMesh {
        /// How many edges are open, or run the same way in two triangles.
        edges: usize,
    },
    /// A point cloud without points.
    #[error("the point cloud has no points")]
    NoPoints,
    /// The support function of a custom shape gives a point that cannot be one.
    #[error(
        "along {direction:?} the support function gives {point:?}: it must be finite and not behind the centre {center:?}"
    )]
    BadSupport {
        /// The direction asked for.
        direction: Vec3,
        /// What the function gave.
        point: Vec3,
        /// What the shape gives as its centre.
        center: Vec3,
    },
    /// The box of a custom shape is empty or not finite.
    #[error("the box of the custom shape is from {min:?} to {max:?}: it must be finite, the lower corner first")]
    BadBox {
        /// Lower corner.
        min: Vec3,
        /// Upper corner.
        max: Vec3,
    },
    /// A compound without children.
    #[error("the compound has no children: give it at least one shape")]
    NoChildren,
    /// A child of a compound that cannot be one.
    #[error("child {child} of the compound {what}")]
    BadChild {
        /// Position in the list given.
        child: usize,
        /// What is wrong with it, and what to do.
        what: &'static str,
    },
    /// A voxel grid without solid cells.
    #[error("the voxel grid has no solid cell: remove the shape instead")]
    NoCells,
    /// A cell too far from the origin of its grid.
    #[error("cell {cell:?} is too far out: coordinates of cells go from -1048576 to 1048575")]
    CellTooFar {
        /// The cell.
        cell: [i32; 3],
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
    /// A cylinder along y.
    Cylinder(Cylinder),
    /// A cone along y.
    Cone(Cone),
    /// The convex hull of two balls on y.
    TaperedCapsule(TaperedCapsule),
    /// All below the origin, for static and kinematic bodies.
    HalfSpace(HalfSpace),
    /// A single triangle, solid on both sides.
    Triangle(Arc<Triangle>),
    /// The shrink-wrap of points.
    PointCloud(Arc<PointCloud>),
    /// A convex shape grown by a radius.
    Rounded(Arc<Rounded>),
    /// A convex shape after an affine map.
    Transformed(Arc<Transformed>),
    /// Ground by a grid of heights, for static and kinematic bodies.
    HeightField(Arc<HeightField>),
    /// A convex shape of the user's own.
    Custom(Arc<Custom>),
    /// Many placed shapes.
    Compound(Arc<Compound>),
    /// Solid cells.
    Voxels(Arc<VoxelGrid>),
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

    /// Ground by a grid of heights, metres, row by row (along z), `points_per_row` along x; cells measure `cell` metres along x
    /// and z. The first corner is at the origin. See [`HeightField`] for holes, materials and diagonals.
    ///
    /// # Errors
    /// If there are fewer than 2 × 2 heights, the rows are not all full, a height is not finite, or a cell has no size.
    pub fn height_field(heights: Vec<Real>, points_per_row: usize, cell: [Real; 2]) -> Result<Self, ShapeError> {
        HeightField::new(heights, points_per_row, cell).map(|field| Self::HeightField(Arc::new(field)))
    }

    /// A cylinder along y, from `-half_length` to `half_length`; metres.
    ///
    /// # Errors
    /// If a length is not finite and above zero.
    pub fn cylinder(half_length: Real, radius: Real) -> Result<Self, ShapeError> {
        Cylinder::new(half_length, radius).map(Self::Cylinder)
    }

    /// A cone along y: its tip at `half_length`, its base of `radius` at `-half_length`; metres.
    ///
    /// # Errors
    /// If a length is not finite and above zero.
    pub fn cone(half_length: Real, radius: Real) -> Result<Self, ShapeError> {
        Cone::new(half_length, radius).map(Self::Cone)
    }

    /// The convex hull of a ball of `top_radius` at `half_length` on y and one of `bottom_radius` at `-half_length`; metres.
    ///
    /// # Errors
    /// If a length is not finite and above zero, or one ball holds the other.
    pub fn tapered_capsule(half_length: Real, top_radius: Real, bottom_radius: Real) -> Result<Self, ShapeError> {
        TaperedCapsule::new(half_length, top_radius, bottom_radius).map(Self::TaperedCapsule)
    }

    /// All below the origin, an endless floor; for static and kinematic bodies.
    #[must_use]
    pub fn half_space() -> Self {
        Self::HalfSpace(HalfSpace)
    }

    /// A single triangle, solid on both sides; metres.
    ///
    /// # Errors
    /// If a corner is not finite, or the triangle has no area.
    pub fn triangle(corners: [Vec3; 3]) -> Result<Self, ShapeError> {
        Triangle::new(corners).map(|triangle| Self::Triangle(Arc::new(triangle)))
    }

    /// The shrink-wrap of points, metres; they may lie on a plane or a line.
    ///
    /// # Errors
    /// If there is no point, or one is not finite.
    pub fn point_cloud(points: &[Vec3]) -> Result<Self, ShapeError> {
        PointCloud::new(points).map(|cloud| Self::PointCloud(Arc::new(cloud)))
    }

    /// A convex shape grown by `radius` (metres) on all sides: rounded boxes, hulls, cylinders.
    ///
    /// # Errors
    /// If the radius is not a finite length above zero, or the core is not convex.
    pub fn rounded(core: &Self, radius: Real) -> Result<Self, ShapeError> {
        Rounded::new(core, radius).map(|rounded| Self::Rounded(Arc::new(rounded)))
    }

    /// An ellipsoid about the origin; half axes in metres.
    ///
    /// # Errors
    /// If a half axis is not a finite length above zero.
    pub fn ellipsoid(half_axes: Vec3) -> Result<Self, ShapeError> {
        for axis in 0..3 {
            positive("ellipsoid half axis", half_axes[axis])?;
        }
        Self::sphere(1.0)?.transformed(Mat3::from_diagonal(half_axes), Vec3::ZERO)
    }

    /// This shape after `x → linear · x + translation`: moved, turned, scaled (also by negative numbers) or sheared.
    ///
    /// Cuboids and hulls become hulls, clouds and triangles stay what they are, meshes are copied with their triangles
    /// turned around where the map mirrors; other convex shapes become [`Transformed`] ones.
    ///
    /// # Errors
    /// If a number is not finite, the map is (almost) flat, or the shape is a half-space or a height field.
    pub fn transformed(&self, linear: Mat3, translation: Vec3) -> Result<Self, ShapeError> {
        transformed::inverse_of(linear, translation)?;
        let map = |point: Vec3| linear * point + translation;
        let all = |points: &[Vec3]| points.iter().map(|&point| map(point)).collect::<Vec<_>>();
        match self {
            Self::Cuboid(s) => Self::hull(&all(ConvexHull::from_cuboid(s.half_extents())?.vertices())),
            Self::Hull(s) => Self::hull(&all(s.vertices())),
            Self::PointCloud(s) => Self::point_cloud(&all(s.points())),
            Self::Triangle(s) => Self::triangle(s.corners().map(map)),
            Self::Mesh(s) => {
                let mirrored = linear.determinant() < 0.0;
                let turn = |[a, b, c]: [u32; 3]| if mirrored { [a, c, b] } else { [a, b, c] };
                let triangles = s.triangles().iter().map(|&t| turn(t)).collect();
                let mesh = TriangleMesh::with_sides(all(s.vertices()), triangles, s.sides())?;
                let mesh = if s.materials().is_empty() { mesh } else { mesh.with_materials(s.materials().to_vec())? };
                Ok(Self::Mesh(Arc::new(mesh)))
            }
            Self::Compound(s) => Ok(Self::Compound(Arc::new(s.transformed(linear, translation)?))),
            _ => Transformed::new(self, linear, translation).map(|shape| Self::Transformed(Arc::new(shape))),
        }
    }

    /// This shape scaled along its axes; negative factors mirror.
    ///
    /// ```
    /// use arbiter3d::{Shape, math::Vec3};
    /// let coin = Shape::cylinder(0.5, 0.5)?.scaled(Vec3::new(2.0, 0.1, 2.0))?;
    /// assert!((coin.local_aabb().half_extents() - Vec3::new(1.0, 0.05, 1.0)).length() < 1e-5);
    /// # Ok::<(), arbiter3d::ShapeError>(())
    /// ```
    ///
    /// # Errors
    /// As [`Shape::transformed`].
    pub fn scaled(&self, scale: Vec3) -> Result<Self, ShapeError> {
        self.transformed(Mat3::from_diagonal(scale), Vec3::ZERO)
    }

    /// A convex shape of your own: see [`ConvexShape`].
    ///
    /// # Errors
    /// If its support function, tried in some hundred directions, or its box makes no sense.
    pub fn custom(shape: impl ConvexShape + 'static) -> Result<Self, ShapeError> {
        Custom::new(Box::new(shape)).map(|custom| Self::Custom(Arc::new(custom)))
    }

    /// Many placed shapes as one: see [`Compound`].
    ///
    /// # Errors
    /// If there is no child, one is a half-space, or one has a position, rotation or density factor that makes no sense.
    pub fn compound(children: &[CompoundChild]) -> Result<Self, ShapeError> {
        Compound::new(children).map(|compound| Self::Compound(Arc::new(compound)))
    }

    /// Solid cubic cells of `cell_size` metres: see [`VoxelGrid`].
    ///
    /// ```
    /// use arbiter3d::Shape;
    /// let stairs = Shape::voxels(0.25, (0..8).flat_map(|x| (0..=x).map(move |y| [x, y, 0])))?;
    /// assert!((stairs.mass_properties(1.0)?.mass - 36.0 * 0.25_f32.powi(3)).abs() < 1e-5);
    /// # Ok::<(), arbiter3d::ShapeError>(())
    /// ```
    ///
    /// # Errors
    /// If the size is not a finite length above zero, there is no cell, or one has a coordinate beyond ±2²⁰.
    pub fn voxels(cell_size: Real, cells: impl IntoIterator<Item = [i32; 3]>) -> Result<Self, ShapeError> {
        VoxelGrid::new(cell_size, cells).map(|grid| Self::Voxels(Arc::new(grid)))
    }

    /// What tells of the shape, whatever its kind.
    pub(crate) fn geometry(&self) -> &dyn Geometry {
        match self {
            Self::Sphere(s) => s,
            Self::Capsule(s) => s,
            Self::Cuboid(s) => s,
            Self::Hull(s) => &**s,
            Self::Mesh(s) => &**s,
            Self::Cylinder(s) => s,
            Self::Cone(s) => s,
            Self::TaperedCapsule(s) => s,
            Self::HalfSpace(s) => s,
            Self::Triangle(s) => &**s,
            Self::PointCloud(s) => &**s,
            Self::Rounded(s) => &**s,
            Self::Transformed(s) => &**s,
            Self::HeightField(s) => &**s,
            Self::Custom(s) => &**s,
            Self::Compound(s) => &**s,
            Self::Voxels(s) => &**s,
        }
    }

    /// The box around the shape in its own frame.
    #[must_use]
    pub fn local_aabb(&self) -> Aabb {
        match self {
            Self::Sphere(s) => s.local_aabb(),
            Self::Capsule(s) => s.local_aabb(),
            Self::Cuboid(s) => s.local_aabb(),
            Self::Hull(s) => s.local_aabb(),
            other => other.geometry().local_aabb(),
        }
    }

    /// The box around the shape placed by `pose`.
    #[inline]
    #[must_use]
    pub fn aabb(&self, pose: &Pose) -> Aabb {
        // The kinds that worlds are full of without a call through a table.
        match self {
            Self::Sphere(s) => Aabb::from_center(pose.position, Vec3::splat(s.radius())),
            Self::Capsule(s) => s.aabb(pose),
            Self::Cuboid(s) => s.aabb(pose),
            Self::Hull(s) => s.aabb(pose),
            other => other.geometry().aabb(pose),
        }
    }

    /// Mass, centre and inertia at `density` (kg/m³).
    ///
    /// # Errors
    /// If the shape has no volume: a half-space, a triangle, a flat cloud, a mesh that is not closed.
    pub fn mass_properties(&self, density: Real) -> Result<MassProperties, ShapeError> {
        self.geometry().mass_properties(density)
    }

    /// Radius of a ball that fits inside: how far the shape may move in a step before it can tunnel. Zero for meshes and
    /// what else has no inside.
    #[must_use]
    pub fn inner_radius(&self) -> Real {
        match self {
            Self::Sphere(s) => s.radius(),
            Self::Capsule(s) => s.radius(),
            Self::Cuboid(s) => s.half_extents().min_element(),
            Self::Hull(s) => s.inner_radius(),
            other => other.inner_ball().1,
        }
    }

    /// Whether the point that it touches with moves along its surface as it turns, otherwise than a sphere's or a capsule's.
    pub(crate) fn is_curved(&self) -> bool {
        match self {
            Self::Cylinder(_) | Self::Cone(_) | Self::TaperedCapsule(_) | Self::Custom(_) => true,
            Self::Rounded(s) => s.core().is_curved(),
            Self::Transformed(s) => matches!(s.shape(), Self::Sphere(_) | Self::Capsule(_)) || s.shape().is_curved(),
            _ => false,
        }
    }

    /// Centre and radius of a ball that fits inside.
    #[must_use]
    pub fn inner_ball(&self) -> (Vec3, Real) {
        self.geometry().inner_ball()
    }

    /// Distance of the farthest point of the shape from the origin of its frame, metres; for some kinds an upper bound.
    #[must_use]
    pub fn reach(&self) -> Real {
        self.reach_from(Vec3::ZERO)
    }

    /// Distance of the farthest point of the shape from a point of its frame; for some kinds an upper bound.
    pub(crate) fn reach_from(&self, point: Vec3) -> Real {
        self.geometry().reach_from(point)
    }

    /// The radius that rolls: how far the surface is from the inner core of a rounded shape, zero for polyhedra.
    #[must_use]
    pub fn rounding_radius(&self) -> Real {
        self.geometry().rounding_radius()
    }

    /// Corners and triangles of the surface, for drawing and exporting; the triangles wind counter-clockwise from outside.
    ///
    /// Cuboids, hulls, meshes and height fields as they are; other convex shapes through about `4 steps²` points of
    /// their surface, at least one step, at most 64. A half-space gives a square of 200 m.
    ///
    /// ```
    /// use arbiter3d::Shape;
    /// let (corners, triangles) = Shape::sphere(2.0)?.triangulate(8);
    /// assert!(corners.iter().all(|corner| (corner.length() - 2.0).abs() < 1e-5));
    /// assert_eq!(triangles.len(), 8 * 8 * 8);
    /// # Ok::<(), arbiter3d::ShapeError>(())
    /// ```
    #[must_use]
    pub fn triangulate(&self, steps: usize) -> (Vec<Vec3>, Vec<[u32; 3]>) {
        let fan = |hull: &ConvexHull| {
            let mut triangles = Vec::new();
            for face in 0..hull.planes().len() {
                let corners: Vec<u32> = hull.face_vertices(face).map(|corner| corner as u32).collect();
                triangles.extend(corners.windows(2).skip(1).map(|pair| [corners[0], pair[0], pair[1]]));
            }
            (hull.vertices().to_vec(), triangles)
        };
        match self {
            Self::Cuboid(s) => {
                ConvexHull::from_cuboid(s.half_extents()).map_or_else(|_| Default::default(), |h| fan(&h))
            }
            Self::Hull(s) => fan(s),
            Self::Mesh(s) => (s.vertices().to_vec(), s.triangles().to_vec()),
            Self::HeightField(s) => s.triangles(),
            Self::Triangle(s) => (s.corners().to_vec(), vec![[0, 1, 2], [0, 2, 1]]),
            Self::Compound(s) => s.triangulate(steps),
            Self::Voxels(s) => s.triangulate(),
            Self::HalfSpace(_) => {
                let corners = [(-1.0, -1.0), (-1.0, 1.0), (1.0, 1.0), (1.0, -1.0)];
                (corners.map(|(x, z)| Vec3::new(100.0 * x, 0.0, 100.0 * z)).to_vec(), vec![[0, 1, 2], [0, 2, 3]])
            }
            other => Support::new(other)
                .map_or_else(Default::default, |support| convex::surface_of_support(&support, steps.clamp(1, 64))),
        }
    }

    /// Which material of the palette a part of the surface has: a child of a compound and a triangle of a mesh or a height
    /// field by the numbers that the user knows them by, a cell of voxels by a point on it and the normal there.
    pub(crate) fn part_material(
        &self,
        (child, triangle): (Option<u32>, Option<u32>),
        (point, normal): (Vec3, Vec3),
    ) -> u8 {
        match (self, triangle) {
            (Self::Mesh(mesh), Some(triangle)) => mesh.materials().get(triangle as usize).copied().unwrap_or(0),
            (Self::HeightField(field), Some(triangle)) => field.material(triangle as usize),
            (Self::Voxels(grid), _) => grid.material_under(point, normal),
            (Self::Compound(compound), _) => {
                let number = child.map_or(usize::MAX, |child| child as usize);
                let own = compound.children().get(number).map_or(0, |child| {
                    let pose = child.pose();
                    let there = (pose.inverse_transform_point(point), pose.rotation.inverse_rotate(normal));
                    child.shape.part_material((None, triangle), there)
                });
                compound.child_material(number, own)
            }
            _ => 0,
        }
    }

    /// The radius with which parts of a material roll.
    pub(crate) fn part_rounding(&self, material: u8) -> Real {
        match self {
            Self::Compound(compound) => compound.rounding_of(material),
            _ => self.rounding_radius(),
        }
    }

    /// Whether the shape is convex and bounded.
    #[must_use]
    pub fn is_convex(&self) -> bool {
        Support::new(self).is_some()
    }
}
