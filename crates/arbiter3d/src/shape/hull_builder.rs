//! Quickhull on a lattice: the exactly convex triangulated hull of a cloud of points.
//!
//! The outline is Barber, Dobkin and Huhdanpaa, "The quickhull algorithm for convex hulls", 1996, with the
//! bookkeeping of Dirk Gregorius, "Implementing QuickHull", GDC 2014: start from a tetrahedron; every triangle keeps
//! the list of points in front of it (its conflicts); take the point farthest in front of any triangle, remove the
//! triangles it sees, and join the rim of the hole (the horizon) to it; hand the conflicts of the removed triangles
//! to the new ones.
//!
//! What usually breaks a quickhull is a rounded visibility test: the horizon stops being one simple loop. Here the
//! test is exact. The points are first snapped to a lattice of 2^29 or more steps along their largest extent (about a
//! hundred times finer than the tolerance below), so that a triangle's normal fits an `i64` and its product with a
//! point an `i128`. A triangle is removed only if the point is strictly in front of its plane, and hence the visible
//! triangles of a convex hull are one disk, the horizon is one simple loop, and no new triangle has zero area.
//!
//! Tolerances decide only *which* points are worth adding: those more than `3 ε (|x|max + |y|max + |z|max)` in front
//! of a triangle, about the rounding that the coordinates of a point on a face have seen already. As a hull vertex is
//! never in front of a triangle, two hull vertices are always farther apart than the tolerance: near duplicates are
//! welded.
//!
//! Invariants: the triangles are a closed surface, counter-clockwise seen from outside, every edge convex or exactly
//! flat; every input point is within the tolerance of the inside, unless the vertex limit stopped the work early.

use super::ShapeError;
use crate::math::{Real, Vec3};
use glam::DVec3;

/// The largest extent has between `2^LATTICE_BITS` and twice as many steps. With differences below 2^30 a cross product
/// is below 2^61, and its dot product with a third difference below 2^93.
const LATTICE_BITS: u64 = 29;

/// No triangle, no point.
const NONE: usize = usize::MAX;

/// The points in lattice steps, and what it takes to get there.
pub(super) struct Lattice {
    /// Whole numbers from 0 to 2^30.
    pub(super) points: Vec<DVec3>,
    /// Points nearer to a plane than this count as on it, in lattice steps.
    pub(super) tolerance: f64,
    /// The same in metres.
    pub(super) tolerance_in_metres: f64,
}

impl Lattice {
    /// Snaps finite points.
    pub(super) fn new(points: &[Vec3]) -> Result<Self, ShapeError> {
        if let Some(index) = points.iter().position(|p| !p.is_finite()) {
            return Err(ShapeError::NotFinite { index, point: points[index] });
        }
        if points.len() < 4 {
            return Err(ShapeError::TooFewPoints { count: points.len() });
        }
        let first = points[0].as_dvec3();
        let (mut low, mut high) = (first, first);
        for point in points {
            low = low.min(point.as_dvec3());
            high = high.max(point.as_dvec3());
        }
        let largest = low.abs().max(high.abs());
        let tolerance_in_metres = 3.0 * f64::from(Real::EPSILON) * (largest.x + largest.y + largest.z);
        let extent = (high - low).max_element();
        if extent <= 0.0 {
            return Err(ShapeError::Flat { count: points.len(), tolerance: tolerance_in_metres as Real });
        }
        // The power of two that brings the extent to [2^29, 2^30): it keeps coordinates with few digits exact. The
        // extent of `f32` coordinates is a normal `f64`, so both exponents are in range.
        let exponent = extent.to_bits() >> 52;
        let scale = f64::from_bits((2 * 1023 + LATTICE_BITS - exponent) << 52);
        let snap = |x: f64| ((x * scale + 0.5) as i64) as f64;
        let points = points
            .iter()
            .map(|point| {
                let offset = point.as_dvec3() - low;
                DVec3::new(snap(offset.x), snap(offset.y), snap(offset.z))
            })
            .collect();
        Ok(Self { points, tolerance: tolerance_in_metres * scale, tolerance_in_metres })
    }
}

/// A triangle of a finished hull.
#[derive(Clone, Debug)]
pub(super) struct HullTriangle {
    /// Counter-clockwise seen from outside; positions in [`TriangulatedHull::points`].
    pub(super) vertices: [usize; 3],
    /// The triangle across the edge from `vertices[k]` to the next one.
    pub(super) neighbors: [usize; 3],
    /// Unit normal, pointing out.
    pub(super) normal: DVec3,
    /// Twice the area, in square lattice steps.
    pub(super) double_area: f64,
}

/// The exactly convex hull of lattice points.
#[derive(Clone, Debug)]
pub(super) struct TriangulatedHull {
    /// Hull vertices in lattice steps, in the order of the input.
    pub(super) points: Vec<DVec3>,
    /// Which input point each vertex is.
    pub(super) sources: Vec<usize>,
    /// The surface.
    pub(super) triangles: Vec<HullTriangle>,
    /// Whether points were left outside because of the vertex limit.
    pub(super) truncated: bool,
}

impl TriangulatedHull {
    /// The hull of `points` with at most `limit` vertices, the farthest first; `None` if they are flat.
    pub(super) fn new(points: &[DVec3], tolerance: f64, limit: usize) -> Option<Self> {
        let mut quickhull = Quickhull::new(points, tolerance)?;
        quickhull.run(limit);
        Some(quickhull.finish())
    }
}

/// A triangle under construction.
struct Face {
    vertices: [usize; 3],
    neighbors: [usize; 3],
    /// Edge cross product, exact.
    exact_normal: [i64; 3],
    normal: DVec3,
    double_area: f64,
    /// Points more than the tolerance in front of the triangle, and not assigned to another one.
    conflicts: Vec<usize>,
    farthest: usize,
    farthest_distance: f64,
    alive: bool,
    visible: bool,
}

/// An edge of the hole: it runs `from → to` with the hole on its left, and `outside` stays on its right.
#[derive(Clone, Copy)]
struct HorizonEdge {
    from: usize,
    to: usize,
    outside: usize,
}

struct Quickhull<'a> {
    points: &'a [DVec3],
    tolerance: f64,
    faces: Vec<Face>,
    free: Vec<usize>,
    /// For each point, the position in the unordered horizon of the edge that starts there.
    horizon_at: Vec<usize>,
}

impl<'a> Quickhull<'a> {
    /// Starts with a tetrahedron and the conflicts of its four triangles.
    fn new(points: &'a [DVec3], tolerance: f64) -> Option<Self> {
        let corners = tetrahedron(points, tolerance)?;
        let mut hull =
            Self { points, tolerance, faces: Vec::new(), free: Vec::new(), horizon_at: vec![NONE; points.len()] };
        let [a, b, c, d] = corners;
        // Triangle k lies opposite to corner k: across an edge is the triangle opposite to the third corner.
        for vertices in [[b, d, c], [a, c, d], [a, d, b], [a, b, c]] {
            let opposite = |v: usize| corners.iter().position(|&corner| corner == v).unwrap_or(0);
            let neighbors = [opposite(vertices[2]), opposite(vertices[0]), opposite(vertices[1])];
            hull.add_face(vertices, neighbors);
        }
        let all: Vec<usize> = (0..points.len()).collect();
        hull.assign(&all, &[0, 1, 2, 3]);
        Some(hull)
    }

    /// Adds points until none is left outside or the hull has `limit` vertices.
    fn run(&mut self, limit: usize) {
        loop {
            let Some((face, point)) = self.farthest() else {
                // A conflict can be lost when it is within the tolerance of all new triangles but not of an old one.
                if self.sweep() {
                    continue;
                }
                return;
            };
            if self.vertex_count() >= limit || !self.insert(point, face) {
                return;
            }
        }
    }

    /// Euler: a closed surface of `2 (V − 2)` triangles has `V` vertices.
    fn vertex_count(&self) -> usize {
        (self.faces.len() - self.free.len()) / 2 + 2
    }

    /// The conflict farthest from its triangle; ties go to the first triangle.
    fn farthest(&self) -> Option<(usize, usize)> {
        let mut best = None;
        let mut best_distance = self.tolerance;
        for (index, face) in self.faces.iter().enumerate() {
            if face.alive && face.farthest_distance > best_distance {
                best_distance = face.farthest_distance;
                best = Some((index, face.farthest));
            }
        }
        best
    }

    /// Looks at every point again; whether some are outside.
    fn sweep(&mut self) -> bool {
        let all: Vec<usize> = (0..self.points.len()).collect();
        let alive: Vec<usize> = (0..self.faces.len()).filter(|&face| self.faces[face].alive).collect();
        self.assign(&all, &alive);
        self.farthest().is_some()
    }

    /// Gives each point to the one of these triangles that it is farthest in front of; points in front of none are
    /// inside.
    fn assign(&mut self, points: &[usize], faces: &[usize]) {
        for &point in points {
            let position = self.points[point];
            let mut best = NONE;
            let mut best_distance = self.tolerance;
            for &face in faces {
                let candidate = &self.faces[face];
                let distance = candidate.normal.dot(position - self.points[candidate.vertices[0]]);
                if distance > best_distance {
                    best_distance = distance;
                    best = face;
                }
            }
            if best != NONE {
                let face = &mut self.faces[best];
                face.conflicts.push(point);
                if best_distance > face.farthest_distance {
                    face.farthest_distance = best_distance;
                    face.farthest = point;
                }
            }
        }
    }

    /// Makes `point` a vertex; `face` must be one that it sees. Nothing is changed if the horizon is not a simple loop,
    /// which exact tests rule out.
    fn insert(&mut self, point: usize, face: usize) -> bool {
        let visible = self.visible_faces(point, face);
        let horizon = self.horizon(&visible);
        for &face in &visible {
            self.faces[face].visible = false;
        }
        let Some(horizon) = horizon else {
            return false;
        };
        let mut orphans = Vec::new();
        for &face in &visible {
            self.faces[face].alive = false;
            orphans.append(&mut self.faces[face].conflicts);
            self.free.push(face);
        }
        orphans.retain(|&orphan| orphan != point);
        let cone: Vec<usize> =
            horizon.iter().map(|edge| self.add_face([edge.from, edge.to, point], [edge.outside, NONE, NONE])).collect();
        for (k, edge) in horizon.iter().enumerate() {
            self.faces[cone[k]].neighbors[1] = cone[(k + 1) % cone.len()];
            self.faces[cone[k]].neighbors[2] = cone[(k + cone.len() - 1) % cone.len()];
            let outside = &mut self.faces[edge.outside];
            for side in 0..3 {
                if outside.vertices[side] == edge.to && outside.vertices[(side + 1) % 3] == edge.from {
                    outside.neighbors[side] = cone[k];
                }
            }
        }
        self.assign(&orphans, &cone);
        true
    }

    /// All triangles that `point` is strictly in front of, found from one of them and marked.
    fn visible_faces(&mut self, point: usize, start: usize) -> Vec<usize> {
        let mut visible = vec![start];
        self.faces[start].visible = true;
        let mut next = 0;
        while next < visible.len() {
            for neighbor in self.faces[visible[next]].neighbors {
                if !self.faces[neighbor].visible && self.sees(point, neighbor) {
                    self.faces[neighbor].visible = true;
                    visible.push(neighbor);
                }
            }
            next += 1;
        }
        visible
    }

    /// Whether `point` is strictly in front of a triangle's plane: exact.
    fn sees(&self, point: usize, face: usize) -> bool {
        let face = &self.faces[face];
        let offset = whole(self.points[point] - self.points[face.vertices[0]]);
        (0..3).map(|k| i128::from(face.exact_normal[k]) * i128::from(offset[k])).sum::<i128>() > 0
    }

    /// The rim of the marked triangles as a loop, or `None` if it is not exactly one simple loop.
    fn horizon(&mut self, visible: &[usize]) -> Option<Vec<HorizonEdge>> {
        let mut edges = Vec::new();
        let mut simple = true;
        for &face in visible {
            let Face { vertices, neighbors, .. } = self.faces[face];
            for side in 0..3 {
                if !self.faces[neighbors[side]].visible {
                    let from = vertices[side];
                    simple &= self.horizon_at[from] == NONE;
                    self.horizon_at[from] = edges.len();
                    edges.push(HorizonEdge { from, to: vertices[(side + 1) % 3], outside: neighbors[side] });
                }
            }
        }
        let mut ordered = Vec::with_capacity(edges.len());
        let mut current = 0;
        while simple && ordered.len() < edges.len() {
            ordered.push(edges[current]);
            current = self.horizon_at[edges[current].to];
            simple = current != NONE && (current != 0 || ordered.len() == edges.len());
        }
        for edge in &edges {
            self.horizon_at[edge.from] = NONE;
        }
        (simple && ordered.len() >= 3).then_some(ordered)
    }

    fn add_face(&mut self, vertices: [usize; 3], neighbors: [usize; 3]) -> usize {
        let [a, b, c] = vertices.map(|v| self.points[v]);
        let exact_normal = exact_cross(whole(b - a), whole(c - a));
        let cross = DVec3::new(exact_normal[0] as f64, exact_normal[1] as f64, exact_normal[2] as f64);
        let double_area = cross.length();
        let face = Face {
            vertices,
            neighbors,
            exact_normal,
            normal: cross / double_area,
            double_area,
            conflicts: Vec::new(),
            farthest: NONE,
            farthest_distance: 0.0,
            alive: true,
            visible: false,
        };
        if let Some(slot) = self.free.pop() {
            self.faces[slot] = face;
            slot
        } else {
            self.faces.push(face);
            self.faces.len() - 1
        }
    }

    /// Renumbers triangles and vertices without gaps, vertices in the order of the input.
    fn finish(self) -> TriangulatedHull {
        let truncated = self.farthest().is_some();
        let mut number = vec![NONE; self.points.len()];
        let mut face_number = vec![NONE; self.faces.len()];
        let alive = (0..self.faces.len()).filter(|&face| self.faces[face].alive);
        for (position, index) in alive.enumerate() {
            face_number[index] = position;
            for v in self.faces[index].vertices {
                number[v] = 0;
            }
        }
        let sources: Vec<usize> = (0..self.points.len()).filter(|&v| number[v] == 0).collect();
        for (index, &source) in sources.iter().enumerate() {
            number[source] = index;
        }
        let triangles = self
            .faces
            .iter()
            .filter(|face| face.alive)
            .map(|face| HullTriangle {
                vertices: face.vertices.map(|v| number[v]),
                neighbors: face.neighbors.map(|f| face_number[f]),
                normal: face.normal,
                double_area: face.double_area,
            })
            .collect();
        let points = sources.iter().map(|&source| self.points[source]).collect();
        TriangulatedHull { points, sources, triangles, truncated }
    }
}

/// Four points with volume: the two extremes that are farthest apart, the point farthest from their line, and the point
/// farthest from the plane of the three. Ordered so that the fourth is behind the first three.
fn tetrahedron(points: &[DVec3], tolerance: f64) -> Option<[usize; 4]> {
    let mut extremes = [0; 6];
    for (index, &point) in points.iter().enumerate() {
        for axis in 0..3 {
            if point[axis] < points[extremes[axis]][axis] {
                extremes[axis] = index;
            }
            if point[axis] > points[extremes[axis + 3]][axis] {
                extremes[axis + 3] = index;
            }
        }
    }
    let mut pair = (0, 0, tolerance * tolerance);
    for (k, &i) in extremes.iter().enumerate() {
        for &j in &extremes[k + 1..] {
            let squared = (points[i] - points[j]).length_squared();
            if squared > pair.2 {
                pair = (i, j, squared);
            }
        }
    }
    let (a, b, squared) = pair;
    if a == b {
        return None;
    }
    let origin = points[a];
    let axis = (points[b] - origin) / squared.sqrt();
    let (c, _) = farthest_by(points, tolerance * tolerance, |p| axis.cross(p - origin).length_squared())?;
    let cross = exact_cross(whole(points[b] - origin), whole(points[c] - origin));
    let normal = DVec3::new(cross[0] as f64, cross[1] as f64, cross[2] as f64).normalize();
    let (d, _) = farthest_by(points, tolerance, |p| normal.dot(p - origin).abs())?;
    Some(if normal.dot(points[d] - origin) < 0.0 { [a, b, c, d] } else { [a, c, b, d] })
}

/// The first point with the largest measure above `least`.
fn farthest_by(points: &[DVec3], least: f64, measure: impl Fn(DVec3) -> f64) -> Option<(usize, f64)> {
    let mut best = None;
    let mut largest = least;
    for (index, &point) in points.iter().enumerate() {
        let value = measure(point);
        if value > largest {
            largest = value;
            best = Some((index, value));
        }
    }
    best
}

/// A difference of lattice points as whole numbers.
fn whole(offset: DVec3) -> [i64; 3] {
    [offset.x as i64, offset.y as i64, offset.z as i64]
}

fn exact_cross(a: [i64; 3], b: [i64; 3]) -> [i64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
