//! Triangle meshes: validation, the tree over the triangles, their neighbours, rays.
//!
//! The user's vertices and triangles are kept as given; beside them stand the triangles in the order of the tree, with
//! corners, normal and neighbourhood in place, so that a query touches consecutive memory. Every number reported to the
//! user is a position in the user's list.
//!
//! Rays use the watertight test of Woop, Benthin and Wald ("Watertight Ray/Triangle Intersection", 2013) with its edge
//! functions in double precision: both sides of a shared edge compute the same number with opposite sign, so a ray
//! cannot slip through between them.

use super::ShapeError;
use super::mesh_edges::{Adjacency, Neighborhood};
use super::mesh_tree::{MeshTree, Slabs};
use crate::math::{Aabb, Real, Vec3};
use crate::simd::{LaneVec3, Wide};

pub use super::mesh_edges::MeshEdge;
pub use super::mesh_tree::MeshNode;

/// Which side of its triangles a mesh is solid on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MeshSides {
    /// Only bodies in front (where the corners wind counter-clockwise) collide: bodies that got behind fall free.
    #[default]
    One,
    /// Both sides push away.
    Two,
}

/// Where a ray meets a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshRayHit {
    /// Distance in multiples of the ray's direction.
    pub distance: Real,
    /// Unit normal of the triangle on the side that was hit.
    pub normal: Vec3,
    /// Which triangle, as numbered by the user.
    pub triangle: u32,
}

/// A triangle in the order of the tree: what every contact reads. 96 bytes.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(crate) struct Facet {
    pub(crate) corners: [Vec3; 3],
    pub(crate) normal: Vec3,
    /// Unit vectors in the plane from each edge inwards.
    pub(crate) inward: [Vec3; 3],
    /// Number in the user's list.
    pub(crate) id: u32,
    /// Equal for triangles joined by flat edges.
    pub(crate) patch: u32,
    /// Bit `i`: edge `i` (from corner `i` to the next) is convex or open, so that it can touch by itself.
    pub(crate) sharp_edges: u8,
    /// Bit `i`: such an edge ends in corner `i`.
    pub(crate) sharp_corners: u8,
    /// Bit `i`: the surface goes on flat across edge `i`.
    pub(crate) flat_edges: u8,
    /// Bit `i`: all around corner `i` the surface is flat.
    pub(crate) flat_corners: u8,
}

/// Triangles in an [`Octet`].
pub(crate) const OCTET: usize = 8;

/// Corners and normals of eight consecutive triangles side by side: what tells whether one of them is near. Those past the
/// end of the mesh are zero.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(crate) struct Octet {
    pub(crate) corners: [LaneVec3<Wide<OCTET>>; 3],
    pub(crate) normal: LaneVec3<Wide<OCTET>>,
}

impl Octet {
    fn new(facets: &[Facet]) -> Self {
        let mut octet = Self { corners: [LaneVec3::ZERO; 3], normal: LaneVec3::ZERO };
        for (lane, facet) in facets.iter().enumerate() {
            for (corners, corner) in octet.corners.iter_mut().zip(facet.corners) {
                corners.set::<OCTET>(lane, corner);
            }
            octet.normal.set::<OCTET>(lane, facet.normal);
        }
        octet
    }
}

/// A triangle mesh for static and kinematic bodies.
///
/// ```
/// use arbiter3d::{TriangleMesh, math::Vec3};
/// let floor = TriangleMesh::new(vec![Vec3::ZERO, Vec3::Z, Vec3::X], vec![[0, 1, 2]])?;
/// assert_eq!(floor.triangles().len(), 1);
/// let hit = floor.cast_ray(Vec3::new(0.2, 3.0, 0.2), -Vec3::Y, 10.0).unwrap();
/// assert_eq!((hit.distance, hit.normal), (3.0, Vec3::Y));
/// # Ok::<(), arbiter3d::ShapeError>(())
/// ```
#[derive(Clone, Debug)]
pub struct TriangleMesh {
    vertices: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    sides: MeshSides,
    tree: MeshTree,
    facets: Vec<Facet>,
    octets: Vec<Octet>,
    neighborhoods: Vec<Neighborhood>,
    adjacency: Adjacency,
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
        check(&vertices, &triangles)?;
        let normals = triangles
            .iter()
            .enumerate()
            .map(|(triangle, t)| normal_of(&vertices, t).ok_or(ShapeError::DegenerateTriangle { triangle }))
            .collect::<Result<Vec<Vec3>, _>>()?;
        Ok(Self::build(vertices, triangles, sides, &normals))
    }

    /// Like [`TriangleMesh::with_sides`] for meshes from modelling tools: triangles without area are left out. The second
    /// result is how many were; the numbers of the others close up.
    ///
    /// ```
    /// use arbiter3d::{MeshSides, TriangleMesh, math::Vec3};
    /// let corners = vec![Vec3::ZERO, Vec3::Z, Vec3::X];
    /// let (mesh, left_out) = TriangleMesh::cleaned(corners, vec![[0, 1, 1], [0, 1, 2]], MeshSides::One)?;
    /// assert_eq!((mesh.triangles().len(), left_out), (1, 1));
    /// # Ok::<(), arbiter3d::ShapeError>(())
    /// ```
    ///
    /// # Errors
    /// If no triangle is left, an index is out of range or a vertex is not finite.
    pub fn cleaned(
        vertices: Vec<Vec3>,
        triangles: Vec<[u32; 3]>,
        sides: MeshSides,
    ) -> Result<(Self, usize), ShapeError> {
        check(&vertices, &triangles)?;
        let given = triangles.len();
        let kept: Vec<([u32; 3], Vec3)> =
            triangles.into_iter().filter_map(|t| normal_of(&vertices, &t).map(|n| (t, n))).collect();
        if kept.is_empty() {
            return Err(ShapeError::EmptyMesh);
        }
        let (triangles, normals): (Vec<_>, Vec<_>) = kept.into_iter().unzip();
        let left_out = given - triangles.len();
        Ok((Self::build(vertices, triangles, sides, &normals), left_out))
    }

    fn build(vertices: Vec<Vec3>, triangles: Vec<[u32; 3]>, sides: MeshSides, normals: &[Vec3]) -> Self {
        let corners = |t: &[u32; 3]| t.map(|i| vertices[i as usize]);
        let boxes: Vec<Aabb> = triangles.iter().map(|t| Aabb::from_points(corners(t))).collect();
        let (tree, order) = MeshTree::build(&boxes);
        let mut adjacency = Adjacency::new(&vertices, &triangles, normals);
        adjacency.close_seams(&vertices, &triangles, normals, |point, gap, visit| {
            tree.query(&Aabb::from_center(point, Vec3::splat(gap)), |slot| visit(order[slot]));
        });
        adjacency.mark_corners();
        let facet = |&id: &u32| {
            let neighborhood = &adjacency.triangles[id as usize];
            let bits = |bit: &dyn Fn(usize) -> bool| (0..3).map(|i| u8::from(bit(i)) << i).sum();
            let sharp_edge = |i: usize| matches!(neighborhood.kinds[i], MeshEdge::Boundary | MeshEdge::Convex);
            let corner = |i: usize| neighborhood.corners[i] as usize;
            Facet {
                corners: corners(&triangles[id as usize]),
                normal: normals[id as usize],
                inward: adjacency.own[id as usize],
                id,
                patch: adjacency.patches[id as usize],
                sharp_edges: bits(&sharp_edge),
                sharp_corners: bits(&|i| adjacency.sharp[corner(i)]),
                flat_edges: bits(&|i| neighborhood.kinds[i] == MeshEdge::Flat),
                flat_corners: bits(&|i| !adjacency.bent[corner(i)]),
            }
        };
        let facets: Vec<Facet> = order.iter().map(facet).collect();
        let octets = facets.chunks(OCTET).map(Octet::new).collect();
        let neighborhoods = order.iter().map(|&id| adjacency.triangles[id as usize]).collect();
        (adjacency.triangles, adjacency.own, adjacency.patches) = (Vec::new(), Vec::new(), Vec::new());
        (adjacency.sharp, adjacency.bent) = (Vec::new(), Vec::new());
        Self { vertices, triangles, sides, tree, facets, octets, neighborhoods, adjacency }
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

    /// The nodes of the tree, depth first.
    #[must_use]
    pub fn nodes(&self) -> &[MeshNode] {
        self.tree.nodes()
    }

    /// Calls `visit` with the corners and the number of every triangle whose box overlaps `aabb`. No allocation.
    #[inline]
    pub fn for_each_triangle(&self, aabb: &Aabb, mut visit: impl FnMut([Vec3; 3], u32)) {
        self.for_each_facet(aabb, |index| visit(self.facets[index].corners, self.facets[index].id));
    }

    /// The first triangle that the ray meets between `origin` and `origin + limit · direction`; one-sided meshes are met
    /// from the front only. Of triangles met at the same distance the one with the smallest number is reported.
    #[must_use]
    pub fn cast_ray(&self, origin: Vec3, direction: Vec3, limit: Real) -> Option<MeshRayHit> {
        let ray = Ray::new(origin, direction)?;
        let mut best: Option<MeshRayHit> = None;
        let mut reach = limit;
        self.tree.cast(&Slabs::new(origin, direction), limit, |index| {
            if let Some(hit) = ray.hit(&self.facets[index], self.sides)
                && hit.distance <= reach
                && best.is_none_or(|b| (hit.distance, hit.triangle) < (b.distance, b.triangle))
            {
                reach = hit.distance;
                best = Some(hit);
            }
            reach
        });
        best
    }

    pub(crate) fn local_aabb(&self) -> Aabb {
        self.tree.nodes()[0].aabb
    }

    /// Calls `visit` with the internal number of every triangle whose box overlaps `aabb`, in ascending order.
    #[inline]
    pub(crate) fn for_each_facet(&self, aabb: &Aabb, mut visit: impl FnMut(usize)) {
        self.tree.query(aabb, |index| {
            let [a, b, c] = self.facets[index].corners;
            let around =
                Aabb::new(crate::math::min3(a, crate::math::min3(b, c)), crate::math::max3(a, crate::math::max3(b, c)));
            if around.overlaps(aabb) {
                visit(index);
            }
        });
    }

    /// Calls `visit` with the internal number of every triangle in a leaf of the tree whose box overlaps `aabb`, in
    /// ascending order.
    #[inline(always)]
    pub(crate) fn for_each_candidate(&self, aabb: &Aabb, visit: impl FnMut(usize)) {
        self.tree.query(aabb, visit);
    }

    /// Triangles `8 index` to `8 index + 7` by their internal numbers.
    #[inline(always)]
    pub(crate) fn octet(&self, index: usize) -> &Octet {
        &self.octets[index]
    }

    /// A triangle by its internal number.
    #[inline(always)]
    pub(crate) fn facet(&self, index: usize) -> &Facet {
        &self.facets[index]
    }

    /// The neighbours of a triangle by its internal number.
    #[inline(always)]
    pub(crate) fn neighborhood(&self, index: usize) -> &Neighborhood {
        &self.neighborhoods[index]
    }

    /// The far ends of all edges that meet in a welded corner, and their welded numbers.
    #[inline]
    pub(crate) fn corner_ends(&self, corner: u32) -> impl Iterator<Item = (Vec3, u32)> {
        self.adjacency.ends(corner).iter().map(|&end| (self.vertices[end as usize], end))
    }
}

fn check(vertices: &[Vec3], triangles: &[[u32; 3]]) -> Result<(), ShapeError> {
    if triangles.is_empty() {
        return Err(ShapeError::EmptyMesh);
    }
    if let Some(index) = vertices.iter().position(|v| !v.is_finite()) {
        return Err(ShapeError::NotFinite { index, point: vertices[index] });
    }
    for (triangle, indices) in triangles.iter().enumerate() {
        if let Some(&index) = indices.iter().find(|&&i| i as usize >= vertices.len()) {
            return Err(ShapeError::IndexOutOfRange { triangle, index, vertices: vertices.len() });
        }
    }
    Ok(())
}

/// Unit normal; `None` where the height over the longest edge is below a millionth of that edge, so that rounding would
/// decide which way the triangle faces.
fn normal_of(vertices: &[Vec3], triangle: &[u32; 3]) -> Option<Vec3> {
    let [a, b, c] = triangle.map(|i| vertices[i as usize].as_dvec3());
    let cross = (b - a).cross(c - a);
    let longest = [b - a, c - b, a - c].iter().map(|e| e.length_squared()).fold(0.0, |m, e| if e > m { e } else { m });
    let length = cross.length();
    (length > 1e-6 * longest).then(|| (cross / length).as_vec3())
}

/// A ray in the frame of the watertight test: sheared so that it runs along its longest axis.
struct Ray {
    origin: Vec3,
    direction: Vec3,
    axes: [usize; 3],
    shear: [f64; 3],
}

impl Ray {
    fn new(origin: Vec3, direction: Vec3) -> Option<Self> {
        let size = crate::math::abs3(direction);
        let z = if size.x >= size.y && size.x >= size.z { 0 } else { 1 + usize::from(size.z > size.y) };
        if !(size[z] > 0.0 && direction.is_finite() && origin.is_finite()) {
            return None;
        }
        let (x, y) = ((z + 1) % 3, (z + 2) % 3);
        let d = direction.as_dvec3();
        Some(Self { origin, direction, axes: [x, y, z], shear: [d[x] / d[z], d[y] / d[z], 1.0 / d[z]] })
    }

    fn hit(&self, facet: &Facet, sides: MeshSides) -> Option<MeshRayHit> {
        let facing = facet.normal.dot(self.direction);
        if sides == MeshSides::One && facing >= 0.0 {
            return None;
        }
        let origin = self.origin.as_dvec3();
        let [x, y, z] = self.axes;
        let sheared = facet.corners.map(|corner| {
            let p = corner.as_dvec3() - origin;
            [p[x] - self.shear[0] * p[z], p[y] - self.shear[1] * p[z], self.shear[2] * p[z]]
        });
        let [a, b, c] = sheared;
        let u = c[0] * b[1] - c[1] * b[0];
        let v = a[0] * c[1] - a[1] * c[0];
        let w = b[0] * a[1] - b[1] * a[0];
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        let sum = u + v + w;
        if sum == 0.0 {
            return None;
        }
        let distance = ((u * a[2] + v * b[2] + w * c[2]) / sum) as Real;
        let normal = if facing > 0.0 { -facet.normal } else { facet.normal };
        (distance >= 0.0).then_some(MeshRayHit { distance, normal, triangle: facet.id })
    }
}

#[cfg(test)]
#[path = "mesh_tests.rs"]
mod tests;
