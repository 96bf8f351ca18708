//! Convex polyhedra: vertices, merged faces, half edges, and what collision detection wants to know about them.
//!
//! Built in three steps: `hull_builder` finds the exactly convex triangulated hull, `hull_merge` joins coplanar
//! triangles and drops vertices that are no corners, and this file fits the planes and pairs the half edges.
//!
//! Planes: the normal is Newell's (the sum of the cross products of consecutive corners, twice the vector area), the
//! offset is the largest over *all* vertices, so that nothing sticks out. Newell's normal of a sliver can tilt; the
//! plane then falls back on the normal of the face's largest triangle, which supports the hull exactly.
//!
//! Mass: the divergence theorem over the triangles of the faces, as signed tetrahedra `(0, a, b, c)` about an inside
//! point near the centre, with `d = a · (b × c)`:
//!
//! ```text
//! ∫ 1 = d/6,   ∫ x = d/24 (a + b + c),   ∫ x xᵀ = d/120 (a aᵀ + b bᵀ + c cᵀ + s sᵀ),   s = a + b + c
//! ```
//!
//! Source: Brian Mirtich, "Fast and Accurate Computation of Polyhedral Mass Properties", 1996, for the reduction; the
//! moments of the unit simplex for the numbers. All of it in double precision, stored in single.
//!
//! Invariants: closed (`V − E + F = 2`), counter-clockwise from outside, the twin of half edge `i` is `i ^ 1`, faces
//! have three corners or more, vertices three faces or more. Vertices keep the order of the input points; a face
//! starts at its lowest vertex, and the faces are sorted: the same points give the same hull, bit for bit.

use super::geometry::Geometry;
use super::hull_builder::{Lattice, TriangulatedHull};
use super::hull_core::eroded_corners;
use super::hull_features::{HullFeatures, LANES};
use super::hull_merge::{Outline, simplify, triangles_as_outlines};
use super::ray::{Ray, ShapeHit, cast_planes};
use super::{MassProperties, ShapeError, positive};
use crate::math::{Aabb, Pose, Real, SymmetricMat3, Vec3, max};
use glam::DVec3;
use std::collections::BTreeMap;

/// Vertices a hull can have: half edges name them with a byte, and one value stays free.
const MAX_VERTICES: usize = 255;

/// How many vertices are tried, before the ones that are no corners go, until a hull counts as too large.
const MAX_TRIED_VERTICES: usize = 4 * MAX_VERTICES;

/// Squared sine below which two edges count as parallel (about 0.06°).
const PARALLEL: f64 = 1e-6;

/// A plane `normal · x = offset`; the inside of a hull has `normal · x <= offset` for every face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Unit normal, pointing out.
    pub normal: Vec3,
    /// Distance of the plane from the origin along the normal, metres.
    pub offset: Real,
}

impl Plane {
    /// How far a point is in front of the plane; negative behind it (inside), metres.
    #[inline(always)]
    #[must_use]
    pub fn distance(&self, point: Vec3) -> Real {
        self.normal.dot(point) - self.offset
    }
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
/// assert_eq!(cube.edges().len(), 24);
/// assert_eq!(cube.centroid(), Vec3::splat(0.5));
/// for face in 0..6 {
///     let plane = cube.planes()[face];
///     assert!(cube.face_vertices(face).all(|v| plane.distance(cube.vertices()[v]).abs() < 1e-6));
/// }
/// let (_, highest) = cube.support(Vec3::new(0.1, 1.0, 0.2));
/// assert_eq!(highest, Vec3::ONE);
/// # Ok::<(), arbiter3d::ShapeError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct ConvexHull {
    vertices: Vec<Vec3>,
    planes: Vec<Plane>,
    face_edges: Vec<u16>,
    edges: Vec<HalfEdge>,
    edge_directions: Vec<Vec3>,
    features: HullFeatures,
    aabb: Aabb,
    inner_radius: Real,
    /// A hull inside this one that is nowhere nearer to its surface than half the inner radius: see `hull_core`.
    core: Vec<Vec3>,
    /// The same, nine tenths of the inner radius inside.
    spine: Vec<Vec3>,
    unit_mass: MassProperties,
}

impl ConvexHull {
    /// The convex hull of some points, metres.
    ///
    /// Points closer to a face than about `3 ε (|x| + |y| + |z|)` of the largest coordinates (half a micrometre for a
    /// crate of one metre) count as on it, and points that are no corners of the hull are left out.
    ///
    /// # Errors
    /// If a point is not finite, the points are fewer than four or flat, the hull needs more than 255 vertices, or it
    /// is so small or large that its mass is not a number in single precision.
    pub fn new(points: &[Vec3]) -> Result<Self, ShapeError> {
        Self::build(points, MAX_TRIED_VERTICES)
    }

    /// The hull of some points, kept to `max_vertices` (4 to 255; values outside are clamped).
    ///
    /// Vertices are added farthest first and the rest is left outside, so the result is within the true hull.
    ///
    /// ```
    /// use arbiter3d::{ConvexHull, math::Vec3};
    /// let ring = |i: i32| Vec3::new((i * i % 101) as f32, (i * 7 % 97) as f32, (i * i * i % 89) as f32);
    /// let points: Vec<Vec3> = (0..1000).map(ring).collect();
    /// let rough = ConvexHull::with_max_vertices(&points, 16)?;
    /// assert!(rough.vertices().len() <= 16);
    /// # Ok::<(), arbiter3d::ShapeError>(())
    /// ```
    ///
    /// # Errors
    /// If a point is not finite, the points are fewer than four or flat, or their size is out of range.
    pub fn with_max_vertices(points: &[Vec3], max_vertices: usize) -> Result<Self, ShapeError> {
        Self::build(points, max_vertices.clamp(4, MAX_VERTICES))
    }

    /// A box about the origin as a hull; half extents in metres. Corner `i` has bit 0, 1, 2 of `i` set where x, y, z is
    /// positive.
    ///
    /// # Errors
    /// If a half extent is not a finite length above zero, or the mass is out of range.
    pub fn from_cuboid(half_extents: Vec3) -> Result<Self, ShapeError> {
        positive("cuboid half extent x", half_extents.x)?;
        positive("cuboid half extent y", half_extents.y)?;
        positive("cuboid half extent z", half_extents.z)?;
        let h = half_extents;
        let side = |i: usize, bit: usize, half: Real| if i >> bit & 1 == 1 { half } else { -half };
        let vertices = (0..8).map(|i| Vec3::new(side(i, 0, h.x), side(i, 1, h.y), side(i, 2, h.z))).collect();
        let faces = [
            ([0, 1, 5, 4], DVec3::NEG_Y),
            ([0, 2, 3, 1], DVec3::NEG_Z),
            ([0, 4, 6, 2], DVec3::NEG_X),
            ([1, 3, 7, 5], DVec3::X),
            ([2, 6, 7, 3], DVec3::Y),
            ([4, 5, 7, 6], DVec3::Z),
        ];
        let outlines = faces.map(|(corners, normal)| Outline { corners: corners.to_vec(), normal });
        let size = f64::from(h.max_element());
        let polyhedron = Polyhedron { vertices, outlines: &outlines, tolerance: size * f64::from(Real::EPSILON) };
        polyhedron.assemble().unwrap_or(Err(ShapeError::SizeOutOfRange { size: h.max_element() * 2.0 }))
    }

    fn build(points: &[Vec3], limit: usize) -> Result<Self, ShapeError> {
        let lattice = Lattice::new(points)?;
        let tolerance = lattice.tolerance_in_metres;
        let flat = || ShapeError::Flat { count: points.len(), tolerance: tolerance as Real };
        let too_many = |count: usize| ShapeError::TooManyFeatures { what: "vertices", count, limit: MAX_VERTICES };
        let exact = TriangulatedHull::new(&lattice.points, lattice.tolerance, limit).ok_or_else(flat)?;
        if exact.truncated && limit > MAX_VERTICES {
            return Err(too_many(exact.points.len()));
        }
        let pick = |hull: &TriangulatedHull| hull.sources.iter().map(|&source| points[source]).collect::<Vec<Vec3>>();
        if let Some((hull, outlines)) = simplify(&exact, lattice.tolerance) {
            if hull.points.len() > MAX_VERTICES {
                return Err(too_many(hull.points.len()));
            }
            if let Some(done) = (Polyhedron { vertices: pick(&hull), outlines: &outlines, tolerance }).assemble() {
                return done;
            }
        }
        if exact.points.len() > MAX_VERTICES {
            return Err(too_many(exact.points.len()));
        }
        let outlines = triangles_as_outlines(&exact);
        Polyhedron { vertices: pick(&exact), outlines: &outlines, tolerance }.assemble().unwrap_or_else(|| Err(flat()))
    }

    /// Corners, metres.
    #[must_use]
    pub fn vertices(&self) -> &[Vec3] {
        &self.vertices
    }

    /// The corners drawn inwards, each in the place of its vertex: what continuous collision lets nothing come to.
    pub(crate) fn core(&self) -> &[Vec3] {
        &self.core
    }

    /// The corners drawn in nearly as far as the shape is thick.
    pub(crate) fn spine(&self) -> &[Vec3] {
        &self.spine
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

    /// The vertices of a face, counter-clockwise seen from outside, as positions in [`vertices`](Self::vertices);
    /// none if there is no such face.
    pub fn face_vertices(&self, face: usize) -> impl Iterator<Item = usize> + '_ {
        let first = self.face_edges.get(face).copied();
        let mut current = first;
        std::iter::from_fn(move || {
            let edge = self.edges[usize::from(current?)];
            current = Some(edge.next).filter(|&next| Some(next) != first);
            Some(usize::from(edge.origin))
        })
    }

    /// Unit directions of the edges; parallel edges share one. A box has three.
    #[must_use]
    pub fn edge_directions(&self) -> &[Vec3] {
        &self.edge_directions
    }

    /// Centre of mass, metres.
    #[inline(always)]
    #[must_use]
    pub fn centroid(&self) -> Vec3 {
        self.unit_mass.center
    }

    /// Distance from the centre of mass to the nearest face, metres.
    #[must_use]
    pub fn inner_radius(&self) -> Real {
        self.inner_radius
    }

    /// The vertex farthest along `direction` (of any length), and its position; of several, the first.
    #[inline]
    #[must_use]
    pub fn support(&self, direction: Vec3) -> (usize, Vec3) {
        let mut best = [-Real::INFINITY; LANES];
        let mut found = [0_u32; LANES];
        for (group, corners) in self.features.corners.iter().enumerate() {
            for lane in 0..LANES {
                let reach =
                    corners.x[lane] * direction.x + corners.y[lane] * direction.y + corners.z[lane] * direction.z;
                let farther = reach > best[lane];
                best[lane] = if farther { reach } else { best[lane] };
                found[lane] = if farther { group as u32 } else { found[lane] };
            }
        }
        // Each lane holds its first best; padding repeats vertex 0, which wins ties by its lower position.
        let mut index = 0;
        let mut reach = -Real::INFINITY;
        for lane in 0..LANES {
            let candidate = found[lane] as usize * LANES + lane;
            if best[lane] > reach || (best[lane] == reach && candidate < index) {
                reach = best[lane];
                index = candidate;
            }
        }
        (index, self.vertices[index])
    }

    /// What collision detection reads besides corners, faces and edges.
    #[inline(always)]
    pub(crate) fn features(&self) -> &HullFeatures {
        &self.features
    }

    /// The box around the hull placed by `pose`: that of its corners.
    pub(crate) fn aabb(&self, pose: &Pose) -> Aabb {
        let [min, max] = self.features.extremes(&pose.rotation.to_mat3());
        Aabb { min: pose.position + min, max: pose.position + max }
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

impl Geometry for ConvexHull {
    fn local_aabb(&self) -> Aabb {
        self.local_aabb()
    }

    fn aabb(&self, pose: &Pose) -> Aabb {
        self.aabb(pose)
    }

    fn mass_properties(&self, density: Real) -> Result<MassProperties, ShapeError> {
        Ok(self.mass_properties(density))
    }

    fn inner_ball(&self) -> (Vec3, Real) {
        (self.centroid(), self.inner_radius())
    }

    fn reach_from(&self, point: Vec3) -> Real {
        self.vertices.iter().fold(0.0, |far, v| max((*v - point).length(), far))
    }

    fn cast_ray(&self, ray: &Ray) -> Option<ShapeHit> {
        cast_planes(&self.planes, ray)
    }
}

/// Vertices and loops on the way to a hull.
struct Polyhedron<'a> {
    vertices: Vec<Vec3>,
    outlines: &'a [Outline],
    /// Metres.
    tolerance: f64,
}

impl Polyhedron<'_> {
    /// Planes, half edges and mass; `None` if the loops are no closed surface or not convex within the tolerance, an
    /// error if single precision cannot hold the mass.
    fn assemble(self) -> Option<Result<ConvexHull, ShapeError>> {
        let (edges, face_edges) = self.half_edges()?;
        let planes: Vec<Plane> = self.outlines.iter().map(|outline| self.plane(outline)).collect::<Option<_>>()?;
        let aabb = Aabb::from_points(self.vertices.iter().copied());
        let Some(unit_mass) = self.unit_mass() else {
            return Some(Err(ShapeError::SizeOutOfRange { size: (aabb.max - aabb.min).max_element() }));
        };
        let center = unit_mass.center.as_dvec3();
        let height = |plane: &Plane| f64::from(plane.offset) - plane.normal.as_dvec3().dot(center);
        let inner_radius = lowest(planes.iter().map(height)) as Real;
        let edge_directions = self.edge_directions(&edges);
        let features = HullFeatures::new(&self.vertices, &planes, &edges, unit_mass.center);
        let core = eroded_corners(&self.vertices, &planes, unit_mass.center, 0.5 * inner_radius);
        let spine = eroded_corners(&self.vertices, &planes, unit_mass.center, 0.9 * inner_radius);
        let vertices = self.vertices;
        Some(Ok(ConvexHull {
            vertices,
            planes,
            face_edges,
            edges,
            edge_directions,
            features,
            aabb,
            inner_radius,
            core,
            spine,
            unit_mass,
        }))
    }

    fn position(&self, vertex: usize) -> DVec3 {
        self.vertices[vertex].as_dvec3()
    }

    /// Pairs the sides of the loops: twins get positions `2k` and `2k + 1` when the first of them is met.
    fn half_edges(&self) -> Option<(Vec<HalfEdge>, Vec<u16>)> {
        let count: usize = self.outlines.iter().map(|outline| outline.corners.len()).sum();
        // Euler's formula, and each vertex in use.
        let mut used = vec![false; self.vertices.len()];
        self.outlines.iter().flat_map(|outline| &outline.corners).for_each(|&v| used[v] = true);
        if self.vertices.len() + self.outlines.len() != count / 2 + 2
            || !count.is_multiple_of(2)
            || used.contains(&false)
        {
            return None;
        }
        let mut index_of: BTreeMap<(usize, usize), u16> = BTreeMap::new();
        let sides = |outline: &Outline| {
            let corners = outline.corners.clone();
            (0..corners.len()).map(move |k| (corners[k], corners[(k + 1) % corners.len()]))
        };
        for (from, to) in self.outlines.iter().flat_map(sides) {
            let fresh = u16::try_from(index_of.len()).ok()?;
            if !index_of.contains_key(&(from, to)) {
                index_of.insert((from, to), fresh);
                index_of.insert((to, from), fresh.checked_add(1)?);
            }
        }
        if index_of.len() != count {
            return None;
        }
        let blank = HalfEdge { origin: 0, face: u16::MAX, next: 0 };
        let mut edges = vec![blank; count];
        let mut face_edges = Vec::with_capacity(self.outlines.len());
        for (face, outline) in self.outlines.iter().enumerate() {
            let loop_edges: Vec<u16> = sides(outline).map(|side| index_of[&side]).collect();
            face_edges.push(*loop_edges.first()?);
            for (k, &edge) in loop_edges.iter().enumerate() {
                let half_edge = &mut edges[usize::from(edge)];
                if half_edge.face != u16::MAX {
                    return None;
                }
                let origin = u8::try_from(outline.corners[k]).ok()?;
                *half_edge = HalfEdge { origin, face: face as u16, next: loop_edges[(k + 1) % loop_edges.len()] };
            }
        }
        Some((edges, face_edges))
    }

    /// The plane of a face: Newell's normal, or the exact supporting normal if that one tilts; `None` if neither is
    /// within the tolerance.
    fn plane(&self, outline: &Outline) -> Option<Plane> {
        let corner = |k: usize| self.position(outline.corners[k % outline.corners.len()]);
        let origin = corner(0);
        let newell = (1..outline.corners.len() - 1)
            .map(|k| (corner(k) - origin).cross(corner(k + 1) - origin))
            .fold(DVec3::ZERO, |sum, cross| sum + cross)
            .normalize_or_zero();
        for normal in [newell, outline.normal] {
            if normal.dot(outline.normal) < 0.5 {
                continue;
            }
            let normal = normal.as_vec3();
            let height = |v: usize| normal.as_dvec3().dot(self.position(v));
            let offset = highest((0..self.vertices.len()).map(height));
            let lowest_corner = lowest(outline.corners.iter().map(|&v| height(v)));
            if offset - lowest_corner <= 3.0 * self.tolerance {
                return Some(Plane { normal, offset: offset as Real });
            }
        }
        None
    }

    /// Volume, centre and inertia at density 1; `None` if single precision cannot hold them.
    fn unit_mass(&self) -> Option<MassProperties> {
        let count = self.vertices.len() as f64;
        let inside = (0..self.vertices.len()).map(|v| self.position(v)).fold(DVec3::ZERO, |sum, p| sum + p) / count;
        let mut volume = 0.0;
        let mut first = DVec3::ZERO;
        // Second moments xx, yy, zz and xy, xz, yz.
        let (mut squares, mut products) = (DVec3::ZERO, DVec3::ZERO);
        let mixed = |p: DVec3| DVec3::new(p.x * p.y, p.x * p.z, p.y * p.z);
        for outline in self.outlines {
            let corner = |k: usize| self.position(outline.corners[k]) - inside;
            let a = corner(0);
            for k in 1..outline.corners.len() - 1 {
                let (b, c) = (corner(k), corner(k + 1));
                let d = a.dot(b.cross(c));
                let sum = a + b + c;
                volume += d / 6.0;
                first += sum * (d / 24.0);
                squares += (a * a + b * b + c * c + sum * sum) * (d / 120.0);
                products += (mixed(a) + mixed(b) + mixed(c) + mixed(sum)) * (d / 120.0);
            }
        }
        let center = first / volume;
        let squares = squares - center * center * volume;
        let products = products - mixed(center) * volume;
        let inertia = SymmetricMat3 {
            xx: (squares.y + squares.z) as Real,
            yy: (squares.x + squares.z) as Real,
            zz: (squares.x + squares.y) as Real,
            xy: -products.x as Real,
            xz: -products.y as Real,
            yz: -products.z as Real,
        };
        let mass = volume as Real;
        let holds = |x: Real| x >= Real::MIN_POSITIVE && x.is_finite();
        let fits = holds(mass) && holds(inertia.xx) && holds(inertia.yy) && holds(inertia.zz);
        fits.then_some(MassProperties { mass, center: (center + inside).as_vec3(), inertia })
    }

    /// The direction of each edge that is not parallel to an earlier one.
    fn edge_directions(&self, edges: &[HalfEdge]) -> Vec<Vec3> {
        let mut directions: Vec<DVec3> = Vec::new();
        for pair in edges.chunks_exact(2) {
            let run = self.position(usize::from(pair[1].origin)) - self.position(usize::from(pair[0].origin));
            let direction = run.normalize_or_zero();
            if directions.iter().all(|known| known.cross(direction).length_squared() > PARALLEL) {
                directions.push(direction);
            }
        }
        directions.into_iter().map(|direction| direction.as_vec3()).collect()
    }
}

/// The least value; of zeros with different signs the first, which `f64::min` leaves open.
fn lowest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(f64::INFINITY, |least, value| if value < least { value } else { least })
}

/// The largest value; of zeros with different signs the first.
fn highest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(-f64::INFINITY, |largest, value| if value > largest { value } else { largest })
}

#[cfg(test)]
mod tests;
