//! Surfaces of triangles as the kernels see them: meshes and height fields.
//!
//! A kernel asks for the triangles near a box, eight at a time, for the corners and the normal of one, and for what is known
//! of the edges and corners around it. Which of the two answers is told once per question by a branch that always goes the
//! same way within a pair: kernels are compiled once, and nothing is asked through a table of functions.

use super::height_field::HeightField;
use super::mesh::{Facet, MeshSides, TriangleMesh};
use super::mesh_edges::Surroundings;
use super::mesh_tree::{Descent, LEAF, Leaves};
use super::{Geometry, Shape};
use crate::math::{Aabb, Real, Vec3};
use crate::simd::{LaneVec3, Lanes};

/// A mesh or a height field. Triangles have internal numbers, which are not the user's.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Surface<'a> {
    Mesh(&'a TriangleMesh),
    Field(&'a HeightField),
}

impl<'a> Surface<'a> {
    /// The surface of a shape, if it is one.
    pub(crate) fn of(shape: &'a Shape) -> Option<Self> {
        match shape {
            Shape::Mesh(mesh) => Some(Self::Mesh(mesh)),
            Shape::HeightField(field) => Some(Self::Field(field)),
            _ => None,
        }
    }

    pub(crate) fn sides(self) -> MeshSides {
        match self {
            Self::Mesh(mesh) => mesh.sides(),
            Self::Field(_) => MeshSides::One,
        }
    }

    pub(crate) fn local_aabb(self) -> Aabb {
        match self {
            Self::Mesh(mesh) => mesh.local_aabb(),
            Self::Field(field) => field.local_aabb(),
        }
    }

    /// Radius of a ball inside; zero for what is not closed.
    pub(crate) fn inner_radius(self) -> Real {
        match self {
            Self::Mesh(mesh) => Geometry::inner_ball(mesh).1,
            Self::Field(_) => 0.0,
        }
    }

    /// Shows the leaves near a box.
    #[inline]
    pub(crate) fn walk(self, aabb: &Aabb, leaves: &mut impl Leaves) {
        match self {
            Self::Mesh(mesh) => mesh.walk(aabb, leaves),
            Self::Field(field) => field.walk(aabb, leaves),
        }
    }

    /// Shows the leaves to a search that wants the nearest first.
    #[inline]
    pub(crate) fn descend(self, limit: Real, search: &mut impl Descent) {
        match self {
            Self::Mesh(mesh) => mesh.descend(limit, search),
            Self::Field(field) => field.descend(limit, search),
        }
    }

    /// The user's number of a triangle.
    #[inline(always)]
    pub(crate) fn id(self, index: usize) -> u32 {
        match self {
            Self::Mesh(mesh) => mesh.id(index),
            Self::Field(_) => index as u32,
        }
    }

    /// Calls `visit` with the internal number of every triangle whose box overlaps `aabb`, in ascending order.
    #[inline]
    pub(crate) fn for_each_facet(self, aabb: &Aabb, visit: impl FnMut(usize)) {
        match self {
            Self::Mesh(mesh) => mesh.for_each_facet(aabb, visit),
            Self::Field(field) => field.for_each_facet(aabb, visit),
        }
    }

    /// Corners of a triangle.
    #[inline(always)]
    pub(crate) fn corners(self, index: usize) -> [Vec3; 3] {
        match self {
            Self::Mesh(mesh) => mesh.corners(index),
            Self::Field(field) => field.corners(index),
        }
    }

    /// Corners and normal of a triangle.
    #[inline(always)]
    pub(crate) fn facet(self, index: usize) -> Facet {
        match self {
            Self::Mesh(mesh) => mesh.facet(index),
            Self::Field(field) => field.facet(index),
        }
    }

    /// The triangles of a leaf side by side; lanes past the last hold that one again.
    #[inline(always)]
    pub(crate) fn corners_of_leaf<W: Lanes<LEAF>>(self, first: usize, count: usize) -> [LaneVec3<W>; 3] {
        match self {
            Self::Mesh(mesh) => mesh.corners_of_leaf(first, count),
            Self::Field(field) => field.corners_of_leaf(first, count),
        }
    }

    /// What is known about the edges and corners of a triangle.
    #[inline(always)]
    pub(crate) fn surroundings(self, index: usize) -> Surroundings {
        match self {
            Self::Mesh(mesh) => *mesh.surroundings(index),
            Self::Field(field) => field.surroundings(index),
        }
    }

    /// Calls `visit` with the far ends of all edges that meet in a corner, some of them twice, until it returns false.
    pub(crate) fn each_end(self, corner: Vec3, visit: impl FnMut(Vec3) -> bool) {
        match self {
            Self::Mesh(mesh) => mesh.each_end(corner, visit),
            Self::Field(field) => field.each_end(corner, visit),
        }
    }

    /// Whether triangles may have other materials than the first of the palette.
    pub(crate) fn has_materials(self) -> bool {
        match self {
            Self::Mesh(mesh) => !mesh.materials().is_empty(),
            Self::Field(field) => field.has_materials(),
        }
    }

    /// Which material of the palette a triangle has.
    #[inline(always)]
    pub(crate) fn material(self, index: usize) -> u8 {
        match self {
            Self::Mesh(mesh) => mesh.material(index),
            Self::Field(field) => field.material(index),
        }
    }
}
