//! One view of cuboids and hulls for the kernels that work on faces, edges and corners.
//!
//! A cuboid has the topology of a hull that never changes; only its eight corners and six offsets are filled in.
//! Corner `i` of a cuboid has `x > 0` if bit 0 of `i` is set, `y > 0` for bit 1, `z > 0` for bit 2. Face `2k` looks
//! down axis `k`, face `2k + 1` up.

use super::{BorderEdge, ConvexHull, CornerGroup, Cuboid, FaceGroup, HalfEdge, LANES, Plane};
use crate::math::{Real, Vec3, abs3, max, min};

/// Corners of each face of a cuboid, counter-clockwise from outside.
const LOOPS: [[u8; 4]; 6] = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];

const TOPOLOGY: ([HalfEdge; 24], [u16; 6]) = topology();

/// Numbers the half edges of a cuboid so that twins are neighbours.
const fn topology() -> ([HalfEdge; 24], [u16; 6]) {
    let mut edges = [HalfEdge { origin: 0, face: 0, next: 0 }; 24];
    let mut face_edges = [0; 6];
    // ids[f][k]: the half edge from corner k to corner k + 1 of face f.
    let mut ids = [[0u16; 4]; 6];
    let (mut f, mut count) = (0, 0);
    while f < 6 {
        let mut k = 0;
        while k < 4 {
            let (a, b) = (LOOPS[f][k], LOOPS[f][(k + 1) % 4]);
            let twin = find(&ids, f, b, a);
            ids[f][k] = if twin == u16::MAX { count } else { twin ^ 1 };
            if twin == u16::MAX {
                count += 2;
            }
            k += 1;
        }
        f += 1;
    }
    f = 0;
    while f < 6 {
        let mut k = 0;
        while k < 4 {
            edges[ids[f][k] as usize] = HalfEdge { origin: LOOPS[f][k], face: f as u16, next: ids[f][(k + 1) % 4] };
            k += 1;
        }
        face_edges[f] = ids[f][0];
        f += 1;
    }
    (edges, face_edges)
}

/// The half edge from `a` to `b` among the first `faces` faces.
const fn find(ids: &[[u16; 4]; 6], faces: usize, a: u8, b: u8) -> u16 {
    let mut f = 0;
    while f < faces {
        let mut k = 0;
        while k < 4 {
            if LOOPS[f][k] == a && LOOPS[f][(k + 1) % 4] == b {
                return ids[f][k];
            }
            k += 1;
        }
        f += 1;
    }
    u16::MAX
}

/// `cos²` of half the arc between the normals of two faces of a cuboid.
const ARC: Real = 0.5;

/// Where each face's edges start, and those edges.
const BORDERS: ([u16; 7], [BorderEdge; 24]) = borders();

const fn borders() -> ([u16; 7], [BorderEdge; 24]) {
    let mut border = [BorderEdge { edge: 0, cosine_squared: ARC }; 24];
    let (mut face, mut count) = (0, 0);
    while face < 6 {
        let mut edge = 0;
        while edge < 24 {
            if TOPOLOGY.0[edge].face == face {
                border[count].edge = edge as u16 / 2;
                count += 1;
            }
            edge += 1;
        }
        face += 1;
    }
    ([0, 4, 8, 12, 16, 20, 24], border)
}

/// Where each corner's faces start, and those faces, in the order of their half edges.
const RINGS: ([u16; 9], [u16; 24]) = rings();

const fn rings() -> ([u16; 9], [u16; 24]) {
    let (mut starts, mut faces) = ([0; 9], [0; 24]);
    let (mut corner, mut count) = (0, 0);
    while corner < 8 {
        starts[corner] = count as u16;
        let mut edge = 0;
        while edge < 24 {
            if TOPOLOGY.0[edge].origin as usize == corner {
                faces[count] = TOPOLOGY.0[edge].face;
                count += 1;
            }
            edge += 1;
        }
        corner += 1;
    }
    starts[8] = count as u16;
    (starts, faces)
}

/// A bit for each lane.
pub(crate) const ALL_LANES: u32 = (1 << LANES) - 1;

/// The lanes that hold a negative number, a bit each.
#[inline(always)]
pub(crate) fn negatives(values: &[Real; LANES]) -> u32 {
    // Sign bits spread over the lane and cut to the lane's bit: loops that compilers turn into vectors.
    let bits: [u32; LANES] = std::array::from_fn(|k| (((values[k].to_bits() as i32) >> 31) as u32) & (1 << k));
    bits.iter().fold(0, |all, bit| all | bit)
}

/// The lowest lane.
#[inline(always)]
fn lowest_of(values: &[Real; LANES]) -> Real {
    let fours: [Real; 4] = std::array::from_fn(|k| min(values[k + 4], values[k]));
    min(min(fours[3], fours[1]), min(fours[2], fours[0]))
}

/// `direction · v` for each corner of a group.
#[inline(always)]
fn corner_heights(group: &CornerGroup, direction: Vec3) -> [Real; LANES] {
    std::array::from_fn(|k| direction.x * group.x[k] + direction.y * group.y[k] + direction.z * group.z[k])
}

/// The length that tolerances of a shape are relative to: half its thickness, but for a sheet, whose thickness would
/// put them below the rounding of its other coordinates, a fiftieth of half its length.
#[inline(always)]
pub(crate) fn tolerance_size(half_thickness: Real, half_length: Real) -> Real {
    max(half_thickness, 0.02 * half_length)
}

/// [`tolerance_size`] of a cuboid.
#[inline(always)]
pub(crate) fn cuboid_size(half_extents: Vec3) -> Real {
    tolerance_size(half_extents.min_element(), half_extents.max_element())
}

/// The corners and planes of a cuboid.
pub(crate) struct CuboidFeatures {
    vertices: [Vec3; 8],
    planes: [Plane; 6],
    corners: [CornerGroup; 1],
    faces: [FaceGroup; 1],
    inner_radius: Real,
    outer_radius: Real,
    size: Real,
}

impl CuboidFeatures {
    pub(crate) fn new(cuboid: &Cuboid) -> Self {
        let h = cuboid.half_extents();
        let sign = |i: usize, bit: usize, x: Real| if i >> bit & 1 == 1 { x } else { -x };
        let plane = |normal: Vec3| Plane { normal, offset: abs3(normal).dot(h) };
        let planes = [-Vec3::X, Vec3::X, -Vec3::Y, Vec3::Y, -Vec3::Z, Vec3::Z].map(plane);
        let mut faces = FaceGroup::PADDING;
        for (face, plane) in planes.iter().enumerate() {
            faces.set(face, plane, ARC);
        }
        let list = |bit: usize, x: Real| std::array::from_fn::<Real, LANES, _>(|i| sign(i, bit, x));
        Self {
            vertices: std::array::from_fn(|i| Vec3::new(sign(i, 0, h.x), sign(i, 1, h.y), sign(i, 2, h.z))),
            planes,
            corners: [CornerGroup { x: list(0, h.x), y: list(1, h.y), z: list(2, h.z) }],
            faces: [faces],
            inner_radius: h.min_element(),
            outer_radius: h.length(),
            size: cuboid_size(h),
        }
    }

    pub(crate) fn view(&self) -> Polyhedron<'_> {
        Polyhedron {
            vertices: &self.vertices,
            planes: &self.planes,
            face_edges: &TOPOLOGY.1,
            edges: &TOPOLOGY.0,
            corners: &self.corners,
            faces: &self.faces,
            sides: &[],
            borders: (&BORDERS.0, &BORDERS.1),
            rings: (&RINGS.0, &RINGS.1),
            center: Vec3::ZERO,
            inner_radius: self.inner_radius,
            outer_radius: self.outer_radius,
            size: self.size,
        }
    }
}

/// Faces, edges and corners of a convex solid, in its own frame.
#[derive(Clone, Copy)]
pub(crate) struct Polyhedron<'a> {
    pub vertices: &'a [Vec3],
    pub planes: &'a [Plane],
    pub face_edges: &'a [u16],
    pub edges: &'a [HalfEdge],
    /// The corners, in groups.
    pub corners: &'a [CornerGroup],
    /// The planes, in groups.
    pub faces: &'a [FaceGroup],
    /// The plane through each half edge, square to its face; none for a cuboid, which has them made as they
    /// are needed.
    sides: &'a [Plane],
    /// Where each face's edges start, and those edges.
    borders: (&'a [u16], &'a [BorderEdge]),
    /// Where each corner's faces start, and those faces, in the order of their half edges.
    rings: (&'a [u16], &'a [u16]),
    /// A point inside.
    pub center: Vec3,
    /// Radius of a ball about `center` that fits inside.
    pub inner_radius: Real,
    /// Radius of a ball about `center` that holds the solid.
    pub outer_radius: Real,
    /// The length that tolerances are relative to: see [`tolerance_size`].
    pub size: Real,
}

impl<'a> Polyhedron<'a> {
    #[inline(always)]
    pub(crate) fn from_hull(hull: &'a ConvexHull) -> Self {
        let features = hull.features();
        Self {
            vertices: hull.vertices(),
            planes: hull.planes(),
            face_edges: hull.face_edges(),
            edges: hull.edges(),
            corners: &features.corners,
            faces: &features.faces,
            sides: &features.sides,
            borders: (&features.border_starts, &features.border),
            rings: (&features.ring_starts, &features.ring_faces),
            center: hull.centroid(),
            inner_radius: hull.inner_radius(),
            outer_radius: features.outer_radius,
            size: tolerance_size(hull.inner_radius(), hull.local_aabb().half_extents().max_element()),
        }
    }

    /// Start and end of a half edge.
    #[inline(always)]
    pub(crate) fn edge_points(&self, edge: usize) -> (Vec3, Vec3) {
        let e = self.edges[edge];
        (self.vertices[e.origin as usize], self.vertices[self.edges[edge ^ 1].origin as usize])
    }

    /// The half edges around a face, counter-clockwise from outside.
    pub(crate) fn face_loop(&self, face: usize) -> impl Iterator<Item = usize> + use<'a> {
        let (edges, first) = (self.edges, self.face_edges[face] as usize);
        let mut next = Some(first);
        std::iter::from_fn(move || {
            let edge = next?;
            let following = edges[edge].next as usize;
            next = (following != first).then_some(following);
            Some(edge)
        })
    }

    /// The plane through a half edge, square to its face, looking out of the face: `(normal, offset)` of unit length.
    #[inline(always)]
    pub(crate) fn side_plane(&self, edge: usize) -> (Vec3, Real) {
        if let Some(side) = self.sides.get(edge) {
            return (side.normal, side.offset);
        }
        let (a, b) = self.edge_points(edge);
        let out = (b - a).cross(self.planes[self.edges[edge].face as usize].normal);
        let out = out * (1.0 / out.length());
        (out, out.dot(a))
    }

    /// The edges around a face.
    #[inline(always)]
    pub(crate) fn border(&self, face: usize) -> &'a [BorderEdge] {
        &self.borders.1[self.borders.0[face] as usize..self.borders.0[face + 1] as usize]
    }

    /// The faces around a corner.
    #[inline(always)]
    pub(crate) fn faces_around(&self, corner: usize) -> &'a [u16] {
        &self.rings.1[self.rings.0[corner] as usize..self.rings.0[corner + 1] as usize]
    }

    /// The lowest value of `direction · v` over the corners.
    #[inline(always)]
    pub(crate) fn lowest(&self, direction: Vec3) -> Real {
        let mut running = [Real::MAX; LANES];
        for group in self.corners {
            let heights = corner_heights(group, direction);
            for k in 0..LANES {
                running[k] = min(heights[k], running[k]);
            }
        }
        lowest_of(&running)
    }

    /// The first corner with the lowest value of `direction · v`.
    #[inline(always)]
    pub(crate) fn lowest_corner(&self, direction: Vec3) -> usize {
        // To carry positions along with the minima costs more than to look for the minimum once it is known.
        let lowest = self.lowest(direction);
        for (index, group) in self.corners.iter().enumerate() {
            let heights = corner_heights(group, direction);
            // All are as high or higher: where the difference is zero, it is found.
            let higher = negatives(&std::array::from_fn(|k| lowest - heights[k]));
            if higher != ALL_LANES {
                let corner = index * LANES + (!higher).trailing_zeros() as usize;
                return if corner < self.vertices.len() { corner } else { 0 };
            }
        }
        0
    }

    /// The face whose normal is closest to `direction`.
    pub(crate) fn face_along(&self, direction: Vec3) -> usize {
        let (mut best, mut cosine) = (0, -Real::MAX);
        for (i, plane) in self.planes.iter().enumerate() {
            let c = plane.normal.dot(direction);
            if c > cosine {
                (best, cosine) = (i, c);
            }
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_topology_of_a_cuboid_is_closed_and_its_faces_wind_outwards() {
        let features = CuboidFeatures::new(&Cuboid::new(Vec3::new(1.0, 2.0, 3.0)).unwrap());
        let view = features.view();
        for (face, plane) in view.planes.iter().enumerate() {
            let edges: Vec<usize> = view.face_loop(face).collect();
            assert_eq!(edges.len(), 4);
            for edge in edges {
                assert_eq!(view.edges[edge].face as usize, face);
                let (a, b) = view.edge_points(edge);
                assert_eq!((b, a), view.edge_points(edge ^ 1));
                assert_eq!(plane.normal.dot(a), plane.offset);
                let (out, offset) = view.side_plane(edge);
                assert!(out.dot(plane.normal * plane.offset) < offset);
            }
        }
    }
}
