//! Triangle meshes: validation, the tree over the triangles, their neighbours, rays.
//!
//! A mesh holds the user's vertices as given, the triangles and 16 bytes about the neighbourhood of each in the order of the
//! tree, and the tree: 40 bytes a triangle in all. Corners and normals are made from them as they are needed. Every number
//! reported to the user is a position in the user's list.

use super::geometry::Geometry;
use super::mesh_core::InnerShell;
use super::mesh_edges::{Adjacency, Surface, Surroundings};
use super::mesh_interior::Interior;
use super::mesh_tree::{Descent, LEAF, Leaves, MeshTree};
use super::ray::{Ray, ShapeHit};
use super::surface_ray::first_triangle;
use super::{MassProperties, ShapeError};
use crate::math::{Aabb, Real, Vec3, max3, min3};
use crate::simd::{LaneVec3, Lanes, Quad};
use glam::DVec3;
use std::sync::OnceLock;

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

/// Corners and unit normal of a triangle, as three groups of four numbers: so eight of them become lanes at once.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Facet {
    pub(crate) quads: [Quad; 3],
}

impl Facet {
    pub(crate) const NONE: Self = Self { quads: [[0.0; 4]; 3] };

    #[inline(always)]
    pub(super) fn new([a, b, c]: [Vec3; 3], normal: Vec3) -> Self {
        Self { quads: [[a.x, a.y, a.z, b.x], [b.y, b.z, c.x, c.y], [c.z, normal.x, normal.y, normal.z]] }
    }

    #[inline(always)]
    pub(crate) fn corners(&self) -> [Vec3; 3] {
        let [a, b, c] = &self.quads;
        [Vec3::new(a[0], a[1], a[2]), Vec3::new(a[3], b[0], b[1]), Vec3::new(b[2], b[3], c[0])]
    }

    #[inline(always)]
    pub(crate) fn normal(&self) -> Vec3 {
        let [_, x, y, z] = self.quads[2];
        Vec3::new(x, y, z)
    }
}

/// A triangle mesh, for static and kinematic bodies, and, if it is closed, for dynamic ones.
///
/// A mesh is its surface. What this means where it meets other shapes:
///
/// - A convex shape is pushed to the front of each triangle that it is in front of with its centre, by a two-sided mesh
///   also to the back. One that lies wholly inside a closed mesh touches nothing as long as no triangle is near.
/// - Another mesh, or a height field, is pushed to the front, also by two-sided meshes: give meshes that are to push each other
///   triangles that wind counter-clockwise seen from outside. Sheets that are open on both sides hold convex shapes, and
///   meshes from the front alone.
/// - A mesh wholly inside another, with no triangles near each other, touches nothing: neither contacts nor the events of a
///   sensor come of it. Where sensors have to see what is inside, make them of convex shapes or a compound of those
///   (`TriangleMesh::convex_decomposition`, with the feature `decomposition`).
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
    /// The user's and one more, so that four numbers can be read wherever a vertex starts.
    vertices: Vec<Vec3>,
    /// In the order of the tree, as the next.
    triangles: Vec<[u32; 3]>,
    surroundings: Vec<Surroundings>,
    sides: MeshSides,
    tree: MeshTree,
    /// In the user's order, once they are asked for.
    given: OnceLock<Vec<[u32; 3]>>,
    /// Of each of the user's triangles; empty if all are zero.
    materials: Vec<u8>,
    open_edges: usize,
    /// Of a closed mesh, once it is asked for.
    interior: OnceLock<Interior>,
    /// The same.
    shell: OnceLock<InnerShell>,
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
            .map(|(triangle, t)| {
                normal_of(t.map(|i| vertices[i as usize])).ok_or(ShapeError::DegenerateTriangle { triangle })
            })
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
            triangles.into_iter().filter_map(|t| normal_of(t.map(|i| vertices[i as usize])).map(|n| (t, n))).collect();
        if kept.is_empty() {
            return Err(ShapeError::EmptyMesh);
        }
        let (triangles, normals): (Vec<_>, Vec<_>) = kept.into_iter().unzip();
        let left_out = given - triangles.len();
        Ok((Self::build(vertices, triangles, sides, &normals), left_out))
    }

    fn build(mut vertices: Vec<Vec3>, triangles: Vec<[u32; 3]>, sides: MeshSides, normals: &[Vec3]) -> Self {
        let surface = Surface { vertices: &vertices, triangles: &triangles, normals };
        let boxes = triangles.iter().map(|t| {
            let [a, b, c] = t.map(|i| vertices[i as usize]);
            Aabb::new(min3(a, min3(b, c)), max3(a, max3(b, c)))
        });
        let (tree, order) = MeshTree::build(boxes);
        let mut adjacency = Adjacency::new(&surface);
        adjacency.close_seams(|point, gap, visit| {
            tree.query(&Aabb::from_center(point, Vec3::splat(gap)), |slot| visit(order[slot]));
        });
        let open_edges = adjacency.open_edges();
        let surroundings = adjacency.finish(&order);
        vertices.reserve_exact(1);
        vertices.push(Vec3::ZERO);
        vertices.shrink_to_fit();
        Self {
            vertices,
            triangles: order.iter().map(|&id| triangles[id as usize]).collect(),
            surroundings,
            sides,
            tree,
            given: OnceLock::new(),
            materials: Vec::new(),
            open_edges,
            interior: OnceLock::new(),
            shell: OnceLock::new(),
        }
    }

    /// The same with materials: for each triangle as given which of
    /// [`ShapeDefinition::palette`](crate::ShapeDefinition::palette).
    ///
    /// # Errors
    /// If there are not as many as triangles.
    pub fn with_materials(mut self, materials: Vec<u8>) -> Result<Self, ShapeError> {
        let (given, expected) = (materials.len(), self.triangles.len());
        if given != expected {
            return Err(ShapeError::WrongCount { what: "materials", given, expected });
        }
        self.materials = materials;
        Ok(self)
    }

    /// The materials of the triangles as given; empty if all are zero.
    #[must_use]
    pub fn materials(&self) -> &[u8] {
        &self.materials
    }

    /// Corner positions, metres.
    #[must_use]
    pub fn vertices(&self) -> &[Vec3] {
        &self.vertices[..self.vertices.len() - 1]
    }

    /// Triangles as given: three indices into the vertices. The first call makes the list, 12 bytes a triangle.
    #[must_use]
    pub fn triangles(&self) -> &[[u32; 3]] {
        self.given.get_or_init(|| {
            let mut given = vec![[0; 3]; self.triangles.len()];
            for (triangle, around) in self.triangles.iter().zip(&self.surroundings) {
                given[around.id as usize] = *triangle;
            }
            given
        })
    }

    /// Edges that no triangle closes, or along which two triangles wind the same way; corners count as one where their
    /// positions are equal. A mesh without any is closed: it has a volume, and dynamic bodies can carry it.
    #[must_use]
    pub fn open_edges(&self) -> usize {
        self.open_edges
    }

    /// What is known of the inside of a closed mesh.
    fn interior(&self) -> Option<&Interior> {
        (self.open_edges == 0).then(|| self.interior.get_or_init(|| Interior::of(self)))
    }

    /// What continuous collision sweeps of a closed mesh that is not inside out.
    pub(crate) fn inner_shell(&self) -> Option<&InnerShell> {
        let solid = self.interior().is_some_and(|interior| interior.ball.1 > 0.0);
        solid.then(|| self.shell.get_or_init(|| InnerShell::of(self)))
    }

    /// Which sides are solid.
    #[must_use]
    pub fn sides(&self) -> MeshSides {
        self.sides
    }

    /// Calls `visit` with the corners and the number of every triangle whose box overlaps `aabb`. No allocation.
    #[inline]
    pub fn for_each_triangle(&self, aabb: &Aabb, mut visit: impl FnMut([Vec3; 3], u32)) {
        self.for_each_facet(aabb, |index| visit(self.corners(index), self.surroundings[index].id));
    }

    /// The first triangle that the ray meets between `origin` and `origin + limit · direction`; one-sided meshes are met
    /// from the front only. Of triangles met at the same distance the one with the smallest number is reported.
    #[must_use]
    pub fn cast_ray(&self, origin: Vec3, direction: Vec3, limit: Real) -> Option<MeshRayHit> {
        let found = first_triangle(super::Surface::Mesh(self), (origin, direction, limit), self.sides);
        found.map(|(distance, index, back)| {
            let normal = self.facet(index).normal();
            let normal = if back { -normal } else { normal };
            MeshRayHit { distance, normal, triangle: self.surroundings[index].id }
        })
    }

    /// Shows the triangles to a search that wants the nearest first.
    pub(crate) fn descend(&self, limit: Real, search: &mut impl Descent) {
        self.tree.descend(limit, search);
    }

    /// The user's number of a triangle.
    #[inline(always)]
    pub(crate) fn id(&self, index: usize) -> u32 {
        self.surroundings[index].id
    }

    pub(crate) fn local_aabb(&self) -> Aabb {
        self.tree.around()
    }

    /// Calls `visit` with the internal number of every triangle whose box overlaps `aabb`, in ascending order.
    #[inline]
    pub(crate) fn for_each_facet(&self, aabb: &Aabb, mut visit: impl FnMut(usize)) {
        self.tree.query(aabb, |index| {
            if self.facet_aabb(index).overlaps(aabb) {
                visit(index);
            }
        });
    }

    #[inline(always)]
    fn facet_aabb(&self, index: usize) -> Aabb {
        let [a, b, c] = self.corners(index);
        Aabb::new(min3(a, min3(b, c)), max3(a, max3(b, c)))
    }

    /// Whether the box of a triangle overlaps the given one: the search ends with the first that does.
    pub(crate) fn meets_facet(&self, aabb: &Aabb) -> bool {
        let mut search = FirstFacet { mesh: self, aabb, found: false };
        self.tree.descend(Real::MAX, &mut search);
        search.found
    }

    /// Shows the leaves of the tree whose boxes overlap the given one.
    #[inline]
    pub(crate) fn walk(&self, aabb: &Aabb, leaves: &mut impl Leaves) {
        self.tree.walk(aabb, leaves);
    }

    /// Corners of a triangle by its internal number.
    #[inline(always)]
    pub(crate) fn corners(&self, index: usize) -> [Vec3; 3] {
        let [a, b, c] = self.triangles[index];
        [self.vertices[a as usize], self.vertices[b as usize], self.vertices[c as usize]]
    }

    /// Corners and normal of a triangle by its internal number.
    #[inline(always)]
    pub(crate) fn facet(&self, index: usize) -> Facet {
        let corners = self.corners(index);
        Facet::new(corners, unit_normal(&corners))
    }

    /// The triangles of a leaf side by side; lanes past the last hold that one again.
    #[inline(always)]
    pub(crate) fn corners_of_leaf<W: Lanes<LEAF>>(&self, first: usize, count: usize) -> [LaneVec3<W>; 3] {
        let own = &self.triangles[first..first + count];
        let mut triangles = [[0; 3]; LEAF];
        if let Ok(full) = <&[[u32; 3]; LEAF]>::try_from(own) {
            triangles = *full;
        } else {
            for (lane, triangle) in triangles.iter_mut().enumerate() {
                *triangle = own[lane.min(count - 1)];
            }
        }
        let mut corners = [LaneVec3::ZERO; 3];
        for (i, corner) in corners.iter_mut().enumerate() {
            let mut quads = [&[0.0; 4]; LEAF];
            for (quad, triangle) in quads.iter_mut().zip(&triangles) {
                *quad = self.quad(triangle[i]);
            }
            let [x, y, z, _] = W::load(&quads);
            *corner = LaneVec3 { x, y, z };
        }
        corners
    }

    /// The coordinates of a vertex of a triangle and one number more.
    #[inline(always)]
    fn quad(&self, vertex: u32) -> &Quad {
        debug_assert!(vertex as usize + 1 < self.vertices.len());
        // SAFETY: `check` has found that all corners are vertices of the user's, after which one more stands, and neither list
        // changes: two vertices are six numbers in a row, of which these are the first four. To check each of the 24 corners
        // of a leaf again was a fifth of the work on it.
        unsafe { &*self.vertices.as_ptr().add(vertex as usize).cast::<Quad>() }
    }

    /// What is known about the edges and corners of a triangle by its internal number.
    #[inline(always)]
    pub(crate) fn surroundings(&self, index: usize) -> &Surroundings {
        &self.surroundings[index]
    }

    #[inline(always)]
    pub(crate) fn material(&self, index: usize) -> u8 {
        if self.materials.is_empty() { 0 } else { self.materials[self.surroundings[index].id as usize] }
    }

    /// Calls `visit` with the far ends of all edges that meet in a corner, some of them twice, until it returns false.
    pub(crate) fn each_end(&self, corner: Vec3, visit: impl FnMut(Vec3) -> bool) {
        self.tree.walk(&Aabb::new(corner, corner), &mut Ends { mesh: self, corner, visit, goes_on: true });
    }
}

/// The far ends of the edges of a corner.
struct Ends<'a, F> {
    mesh: &'a TriangleMesh,
    corner: Vec3,
    visit: F,
    goes_on: bool,
}

impl<F: FnMut(Vec3) -> bool> Leaves for Ends<'_, F> {
    #[inline(always)]
    fn leaf<W: Lanes<LEAF>>(&mut self, first: usize, count: usize) {
        for index in first..first + count {
            let corners = self.mesh.corners(index);
            for i in 0..3 {
                if self.goes_on && corners[i] == self.corner {
                    self.goes_on = (self.visit)(corners[(i + 1) % 3]) && (self.visit)(corners[(i + 2) % 3]);
                }
            }
        }
    }
}

impl Geometry for TriangleMesh {
    fn local_aabb(&self) -> Aabb {
        self.local_aabb()
    }

    fn mass_properties(&self, density: Real) -> Result<MassProperties, ShapeError> {
        let interior = self.interior().ok_or(ShapeError::OpenMesh { edges: self.open_edges })?;
        let advice = "turn its triangles around: seen from outside they have to wind counter-clockwise";
        let unit = interior.unit.ok_or(ShapeError::NoVolume { shape: "the mesh", advice })?;
        Ok(unit.scaled(density))
    }

    fn inner_ball(&self) -> (Vec3, Real) {
        self.interior().map_or((self.local_aabb().center(), 0.0), |interior| interior.ball)
    }

    fn cast_ray(&self, ray: &Ray) -> Option<ShapeHit> {
        let hit = self.cast_ray(ray.origin, ray.direction, ray.max_fraction)?;
        Some(ShapeHit { fraction: hit.distance, normal: hit.normal })
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

/// A search for any triangle whose box overlaps another one.
struct FirstFacet<'a> {
    mesh: &'a TriangleMesh,
    aabb: &'a Aabb,
    found: bool,
}

impl Descent for FirstFacet<'_> {
    #[inline(always)]
    fn distances<W: Lanes<LEAF>>(&self, low: &LaneVec3<W>, high: &LaneVec3<W>, _limit: Real) -> W {
        let (min, max) = (self.aabb.min, self.aabb.max);
        let x = (low.x - W::splat(max.x)).max(W::splat(min.x) - high.x);
        let y = (low.y - W::splat(max.y)).max(W::splat(min.y) - high.y);
        let z = (low.z - W::splat(max.z)).max(W::splat(min.z) - high.z);
        x.max(y).max(z).if_positive(W::splat(Real::MAX), W::ZERO)
    }

    #[inline(always)]
    fn leaf<W: Lanes<LEAF>>(&mut self, first: usize, count: usize, limit: Real) -> Real {
        self.found = (first..first + count).any(|index| self.mesh.facet_aabb(index).overlaps(self.aabb));
        if self.found { -1.0 } else { limit }
    }
}

/// Twice the area along the normal.
#[inline(always)]
fn cross_of([a, b, c]: &[Vec3; 3]) -> DVec3 {
    let a = a.as_dvec3();
    (b.as_dvec3() - a).cross(c.as_dvec3() - a)
}

/// Unit normal of a triangle that has an area.
#[inline(always)]
pub(super) fn unit_normal(corners: &[Vec3; 3]) -> Vec3 {
    let cross = cross_of(corners);
    (cross * (1.0 / cross.length())).as_vec3()
}

/// Unit normal; `None` where the height over the longest edge is below a millionth of that edge, so that rounding would
/// decide which way the triangle faces.
#[inline(always)]
fn normal_of([a, b, c]: [Vec3; 3]) -> Option<Vec3> {
    let cross = cross_of(&[a, b, c]);
    let (a, b, c) = (a.as_dvec3(), b.as_dvec3(), c.as_dvec3());
    let larger = |x: f64, y: f64| if x > y { x } else { y };
    let longest =
        larger((b - a).length_squared(), larger((c - b).length_squared(), larger((a - c).length_squared(), 0.0)));
    let length = cross.length();
    (length > 1e-6 * longest).then(|| (cross * (1.0 / length)).as_vec3())
}

#[cfg(test)]
#[path = "mesh_tests.rs"]
mod tests;
