//! What collision detection reads of a hull besides its corners, faces and edges, worked out once when it is built.
//!
//! Corners and face planes stand in groups of [`LANES`], each coordinate in an array of its own, so that one loop over
//! a group becomes a few vector instructions. The corners are padded with the first corner, which changes no extreme;
//! the planes are padded with one that everything is endlessly far behind.
//!
//! Per half edge: the plane through it, square to its face, that clipping cuts by. Per face: its edges, each with `cos²`
//! of half the arc between the normals of its faces, `(1 + a · b) / 2`, which bounds what a pair of edges can gain over
//! a face. Per corner: the faces around it, in the order of their half edges.

use super::hull::{HalfEdge, Plane};
use crate::math::{Mat3, Real, Vec3, max, min};
use crate::simd::{KernelOfEight, Lanes, run_eight};

/// Corners or faces of a group.
pub(crate) const LANES: usize = 8;

/// Corners side by side.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(32))]
pub(crate) struct CornerGroup {
    pub x: [Real; LANES],
    pub y: [Real; LANES],
    pub z: [Real; LANES],
}

/// Face planes side by side.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(32))]
pub(crate) struct FaceGroup {
    /// Normals.
    pub x: [Real; LANES],
    pub y: [Real; LANES],
    pub z: [Real; LANES],
    pub offset: [Real; LANES],
    /// The least `cos²` of half the arc over the edges of the face.
    pub cosine_squared: [Real; LANES],
}

impl FaceGroup {
    /// Planes that everything is behind.
    pub(crate) const PADDING: Self = Self {
        x: [0.0; LANES],
        y: [0.0; LANES],
        z: [0.0; LANES],
        offset: [Real::MAX; LANES],
        cosine_squared: [1.0; LANES],
    };

    #[inline(always)]
    pub(crate) fn set(&mut self, lane: usize, plane: &Plane, cosine_squared: Real) {
        (self.x[lane], self.y[lane], self.z[lane]) = (plane.normal.x, plane.normal.y, plane.normal.z);
        (self.offset[lane], self.cosine_squared[lane]) = (plane.offset, cosine_squared);
    }
}

/// An edge as one of its faces sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct BorderEdge {
    /// Half the number of its half edges.
    pub edge: u16,
    /// `cos²` of half the arc between the normals of its faces.
    pub cosine_squared: Real,
}

/// See the top of this file.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct HullFeatures {
    pub corners: Vec<CornerGroup>,
    pub faces: Vec<FaceGroup>,
    /// For each half edge the plane through it, square to its face, looking out of the face.
    pub sides: Vec<Plane>,
    /// Where in `border` each face's edges start, and the end of the last.
    pub border_starts: Vec<u16>,
    /// The edges around each face.
    pub border: Vec<BorderEdge>,
    /// Where in `ring_faces` each corner's faces start, and the end of the last.
    pub ring_starts: Vec<u16>,
    pub ring_faces: Vec<u16>,
    /// Radius of a ball about the centre of mass that holds the hull.
    pub outer_radius: Real,
}

/// [`HullFeatures::extremes`].
struct ExtremesKernel<'a> {
    corners: &'a [CornerGroup],
    rotation: &'a Mat3,
    found: &'a mut [Vec3; 2],
}

impl KernelOfEight for ExtremesKernel<'_> {
    #[inline(always)]
    fn run<W: Lanes<LANES>>(self) {
        for axis in 0..3 {
            let row = self.rotation.row(axis);
            let (x, y, z) = (W::splat(row.x), W::splat(row.y), W::splat(row.z));
            let (mut least, mut most) = (W::splat(Real::MAX), W::splat(-Real::MAX));
            for corners in self.corners {
                let along = W::from_array(corners.x) * x + W::from_array(corners.y) * y + W::from_array(corners.z) * z;
                (least, most) = (along.min(least), along.max(most));
            }
            let (mut least, mut most) = (least.to_array(), most.to_array());
            // Halves against each other, which the compiler does side by side.
            for half in [4, 2, 1] {
                for lane in 0..half {
                    least[lane] = min(least[lane + half], least[lane]);
                    most[lane] = max(most[lane + half], most[lane]);
                }
            }
            (self.found[0][axis], self.found[1][axis]) = (least[0], most[0]);
        }
    }
}

impl HullFeatures {
    /// The least and the largest coordinates of the corners turned by `rotation`.
    #[inline]
    pub(crate) fn extremes(&self, rotation: &Mat3) -> [Vec3; 2] {
        let mut found = [Vec3::ZERO; 2];
        run_eight(ExtremesKernel { corners: &self.corners, rotation, found: &mut found });
        found
    }

    pub(crate) fn new(vertices: &[Vec3], planes: &[Plane], edges: &[HalfEdge], center: Vec3) -> Self {
        let arcs = arcs(planes, edges);
        let (ring_starts, ring_faces) = rings(vertices.len(), edges);
        let (border_starts, border) = borders(planes.len(), edges, &arcs);
        let distance = |v: &Vec3| (v.as_dvec3() - center.as_dvec3()).length();
        let furthest = vertices.iter().map(distance).fold(0.0, |most: f64, d| if d > most { d } else { most });
        Self {
            corners: corner_groups(vertices),
            faces: face_groups(planes, edges, &arcs),
            sides: (0..edges.len()).map(|edge| side(vertices, planes, edges, edge)).collect(),
            border_starts,
            border,
            ring_starts,
            ring_faces,
            outer_radius: furthest as Real,
        }
    }
}

fn corner_groups(vertices: &[Vec3]) -> Vec<CornerGroup> {
    let group = |start: usize| {
        let corner = |lane: usize| vertices.get(start + lane).copied().unwrap_or(vertices[0]);
        let list = |axis: usize| std::array::from_fn(|lane| corner(lane)[axis]);
        CornerGroup { x: list(0), y: list(1), z: list(2) }
    };
    (0..vertices.len()).step_by(LANES).map(group).collect()
}

fn face_groups(planes: &[Plane], edges: &[HalfEdge], arcs: &[Real]) -> Vec<FaceGroup> {
    let mut sharpest = vec![1.0; planes.len()];
    for (index, edge) in edges.iter().enumerate() {
        let least = &mut sharpest[usize::from(edge.face)];
        *least = min(arcs[index / 2], *least);
    }
    let mut groups = vec![FaceGroup::PADDING; planes.len().div_ceil(LANES)];
    for (face, plane) in planes.iter().enumerate() {
        groups[face / LANES].set(face % LANES, plane, sharpest[face]);
    }
    groups
}

fn side(vertices: &[Vec3], planes: &[Plane], edges: &[HalfEdge], edge: usize) -> Plane {
    let [a, b] = [edge, edge ^ 1].map(|e| vertices[usize::from(edges[e].origin)]);
    let out = (b - a).cross(planes[usize::from(edges[edge].face)].normal);
    let normal = out * (1.0 / out.length());
    Plane { normal, offset: normal.dot(a) }
}

fn arcs(planes: &[Plane], edges: &[HalfEdge]) -> Vec<Real> {
    let normal = |edge: &HalfEdge| planes[usize::from(edge.face)].normal;
    edges.as_chunks::<2>().0.iter().map(|[left, right]| 0.5 * (1.0 + normal(left).dot(normal(right)))).collect()
}

fn borders(count: usize, edges: &[HalfEdge], arcs: &[Real]) -> (Vec<u16>, Vec<BorderEdge>) {
    let (mut starts, mut border) = (vec![0], Vec::with_capacity(edges.len()));
    for face in 0..count {
        let own = edges.iter().enumerate().filter(|(_, edge)| usize::from(edge.face) == face);
        border.extend(own.map(|(edge, _)| BorderEdge { edge: edge as u16 / 2, cosine_squared: arcs[edge / 2] }));
        starts.push(border.len() as u16);
    }
    (starts, border)
}

fn rings(count: usize, edges: &[HalfEdge]) -> (Vec<u16>, Vec<u16>) {
    let mut starts = vec![0_u16; count + 1];
    for edge in edges {
        starts[usize::from(edge.origin) + 1] += 1;
    }
    for corner in 0..count {
        starts[corner + 1] += starts[corner];
    }
    let mut next = starts.clone();
    let mut faces = vec![0; edges.len()];
    for edge in edges {
        let place = &mut next[usize::from(edge.origin)];
        faces[usize::from(*place)] = edge.face;
        *place += 1;
    }
    (starts, faces)
}
