//! Triangle meshes with a bounding-volume tree. (Tree to come.)

use super::ShapeError;
use crate::math::{Aabb, Vec3};

/// Which side of its triangles a mesh is solid on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MeshSides {
    /// Only bodies in front (where the corners wind counter-clockwise) collide: bodies that got behind fall free.
    #[default]
    One,
    /// Both sides push away.
    Two,
}

/// A node of the mesh's tree.
#[derive(Clone, Copy, Debug)]
pub struct MeshNode {
    /// Box around everything below.
    pub aabb: Aabb,
    /// First triangle of a leaf, or index of the second child (the first follows its parent).
    pub first: u32,
    /// Triangles in a leaf, zero for an inner node.
    pub count: u32,
}

/// A triangle mesh for static and kinematic bodies.
///
/// ```
/// use arbiter3d::{TriangleMesh, math::Vec3};
/// let floor = TriangleMesh::new(vec![Vec3::ZERO, Vec3::Z, Vec3::X], vec![[0, 1, 2]])?;
/// assert_eq!(floor.triangles().len(), 1);
/// # Ok::<(), arbiter3d::ShapeError>(())
/// ```
#[derive(Clone, Debug)]
pub struct TriangleMesh {
    vertices: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    sides: MeshSides,
    aabb: Aabb,
}

impl TriangleMesh {
    /// A one-sided mesh: solid on the side from which the corners wind counter-clockwise.
    ///
    /// # Errors
    /// If there is no triangle, an index is out of range, a vertex is not finite or a triangle has no area.
    pub fn new(vertices: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Result<Self, ShapeError> {
        Self::with_sides(vertices, triangles, MeshSides::One)
    }

    /// A mesh that is solid on one or on both sides.
    ///
    /// # Errors
    /// As [`TriangleMesh::new`].
    pub fn with_sides(vertices: Vec<Vec3>, triangles: Vec<[u32; 3]>, sides: MeshSides) -> Result<Self, ShapeError> {
        if triangles.is_empty() {
            return Err(ShapeError::EmptyMesh);
        }
        let aabb = Aabb::from_points(vertices.iter().copied());
        Ok(Self { vertices, triangles, sides, aabb })
    }

    /// Corner positions, metres.
    #[must_use]
    pub fn vertices(&self) -> &[Vec3] {
        &self.vertices
    }

    /// Triangles as given: three indices into the vertices.
    #[must_use]
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Which sides are solid.
    #[must_use]
    pub fn sides(&self) -> MeshSides {
        self.sides
    }

    pub(crate) fn local_aabb(&self) -> Aabb {
        self.aabb
    }
}
