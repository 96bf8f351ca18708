//! From the triangles of a hull to its faces: coplanar triangles merge, and vertices that are no corners go.
//!
//! Flat regions: the largest free triangle is a seed; its face takes in neighbours whose vertices are within the
//! tolerance of the *seed's* plane. Measuring against one plane, which supports the hull exactly, keeps a chain of
//! slightly bent triangles from rolling up into one face. The outline of a region is the loop of edges whose twin is
//! in another region.
//!
//! A merged outline can have vertices that are no corners. Let `a, b, c` be neighbours on it:
//! - `b` is on the line `ac` within the tolerance (the middle of an edge), or the outline is concave there;
//! - a vertex on no outline is inside a face.
//!
//! Each of these is within about the tolerance of the hull of the other vertices: the vertices of a region are in a
//! slab of that height, and in the plane such a `b` is on a segment or inside the outline of the others. So the
//! vertex is dropped, and the exact hull of the rest is built again, rather than repairing the surface by local
//! surgery (which is where merging hulls usually go wrong). No two neighbours are dropped in one pass, so that a
//! finely rounded outline loses vertices only until those left stand out by the tolerance. Every pass has fewer
//! vertices: it ends.
//!
//! What is left: faces with strictly convex outlines, and at every vertex three faces or more.

use super::hull_builder::{HullTriangle, TriangulatedHull};
use glam::DVec3;

/// Triangles turned by more than 60° from the seed are not the same face, however small they are: a region must not
/// fold.
const LEAST_COSINE: f64 = 0.5;

const NONE: usize = usize::MAX;

/// One face of the polyhedron.
#[derive(Clone, Debug)]
pub(super) struct Outline {
    /// Counter-clockwise seen from outside, the lowest vertex first.
    pub(super) corners: Vec<usize>,
    /// Unit normal of a plane that supports the hull exactly and is within the tolerance of the corners.
    pub(super) normal: DVec3,
}

/// Drops vertices that are no corners until none is left, and returns the hull with its faces; `None` if that fails.
pub(super) fn simplify(hull: &TriangulatedHull, tolerance: f64) -> Option<(TriangulatedHull, Vec<Outline>)> {
    let mut hull = hull.clone();
    loop {
        let outlines = Regions::new(&hull, tolerance).outlines();
        let redundant = redundant_vertices(&hull, &outlines, tolerance);
        if !redundant.contains(&true) {
            return Some((hull, outlines));
        }
        let kept: Vec<usize> = (0..hull.points.len()).filter(|&v| !redundant[v]).collect();
        let points: Vec<DVec3> = kept.iter().map(|&v| hull.points[v]).collect();
        let mut next = TriangulatedHull::new(&points, tolerance, NONE)?;
        for source in &mut next.sources {
            *source = hull.sources[kept[*source]];
        }
        next.truncated = hull.truncated;
        hull = next;
    }
}

/// Every triangle a face: always valid, and the way out if merging fails.
pub(super) fn triangles_as_outlines(hull: &TriangulatedHull) -> Vec<Outline> {
    in_order(hull.triangles.iter().map(|t| Outline { corners: t.vertices.to_vec(), normal: t.normal }).collect())
}

/// Starts each loop at its lowest vertex and sorts the loops, so that the result does not depend on how it was found.
fn in_order(mut outlines: Vec<Outline>) -> Vec<Outline> {
    for outline in &mut outlines {
        let lowest = (0..outline.corners.len()).min_by_key(|&k| outline.corners[k]).unwrap_or(0);
        outline.corners.rotate_left(lowest);
    }
    outlines.sort_by(|a, b| a.corners.cmp(&b.corners));
    outlines
}

/// How a vertex of an outline sits between its neighbours.
#[derive(Clone, Copy, PartialEq, Eq)]
enum CornerKind {
    /// Stands out: needed.
    Convex,
    /// On the segment between its neighbours, or on its inner side.
    Redundant,
}

/// Triangles grouped into flat regions.
struct Regions<'a> {
    hull: &'a TriangulatedHull,
    tolerance: f64,
    /// The region of each triangle.
    region_of: Vec<usize>,
    /// The triangles of each region, its seed first.
    members: Vec<Vec<usize>>,
}

impl<'a> Regions<'a> {
    fn new(hull: &'a TriangulatedHull, tolerance: f64) -> Self {
        let count = hull.triangles.len();
        let mut regions = Self { hull, tolerance, region_of: vec![NONE; count], members: Vec::new() };
        let mut seeds: Vec<usize> = (0..count).collect();
        seeds.sort_by(|&a, &b| hull.triangles[b].double_area.total_cmp(&hull.triangles[a].double_area));
        for seed in seeds {
            if regions.region_of[seed] == NONE {
                regions.grow(seed);
            }
        }
        regions
    }

    /// Floods from a seed over free triangles on its plane.
    fn grow(&mut self, seed: usize) {
        let region = self.members.len();
        let mut members = vec![seed];
        self.region_of[seed] = region;
        let mut next = 0;
        while next < members.len() {
            for neighbor in self.hull.triangles[members[next]].neighbors {
                if self.region_of[neighbor] == NONE && self.is_on_plane(seed, neighbor) {
                    self.region_of[neighbor] = region;
                    members.push(neighbor);
                }
            }
            next += 1;
        }
        self.members.push(members);
    }

    fn is_on_plane(&self, seed: usize, triangle: usize) -> bool {
        let seed = &self.hull.triangles[seed];
        let HullTriangle { vertices, normal, .. } = &self.hull.triangles[triangle];
        let origin = self.hull.points[seed.vertices[0]];
        let near = |v: &usize| seed.normal.dot(self.hull.points[*v] - origin).abs() <= self.tolerance;
        seed.normal.dot(*normal) > LEAST_COSINE && vertices.iter().all(near)
    }

    /// The loops around the regions. Regions that are no simple disk, or that leave a vertex with two faces which
    /// neither face can do without, are taken apart into their triangles first.
    fn outlines(mut self) -> Vec<Outline> {
        loop {
            let loops: Vec<Option<Vec<usize>>> = (0..self.members.len()).map(|region| self.outline(region)).collect();
            if let Some(broken) = loops.iter().position(Option::is_none).or_else(|| self.too_eager(&loops)) {
                self.take_apart(broken);
                continue;
            }
            let normal = |region: usize| self.hull.triangles[self.members[region][0]].normal;
            let outlines = loops.into_iter().flatten().enumerate();
            return in_order(outlines.map(|(region, corners)| Outline { corners, normal: normal(region) }).collect());
        }
    }

    /// The border of one region, `None` if it is not one simple loop. A single triangle always has one.
    fn outline(&self, region: usize) -> Option<Vec<usize>> {
        let mut edges: Vec<(usize, usize)> = Vec::new();
        for &member in &self.members[region] {
            let triangle = &self.hull.triangles[member];
            for side in 0..3 {
                if self.region_of[triangle.neighbors[side]] != region {
                    edges.push((triangle.vertices[side], triangle.vertices[(side + 1) % 3]));
                }
            }
        }
        edges.sort_unstable();
        if edges.windows(2).any(|pair| pair[0].0 == pair[1].0) {
            return None;
        }
        let start = edges.first()?.0;
        let mut corners = Vec::with_capacity(edges.len());
        let mut current = start;
        while corners.len() < edges.len() {
            corners.push(current);
            let edge = edges.binary_search_by_key(&current, |edge| edge.0).ok()?;
            current = edges[edge].1;
            if current == start {
                break;
            }
        }
        (current == start && corners.len() == edges.len() && corners.len() >= 3).then_some(corners)
    }

    /// A region to take apart because it shares a vertex with only one other one, and both need that vertex as a
    /// corner: the tip of a needle thinner than the tolerance. Dropping the vertex would cut the needle off.
    fn too_eager(&self, loops: &[Option<Vec<usize>>]) -> Option<usize> {
        let count = self.hull.points.len();
        let mut faces = vec![0; count];
        let mut needed = vec![true; count];
        for (region, corners) in loops.iter().enumerate() {
            let corners = corners.as_deref().unwrap_or_default();
            let normal = self.hull.triangles[self.members[region][0]].normal;
            for k in 0..corners.len() {
                faces[corners[k]] += 1;
                needed[corners[k]] &= corner_kind(self.hull, corners, normal, k, self.tolerance) == CornerKind::Convex;
            }
        }
        let vertex = (0..count).find(|&v| faces[v] > 0 && faces[v] < 3 && needed[v])?;
        (0..self.members.len()).find(|&region| {
            self.members[region].len() > 1 && loops[region].as_ref().is_some_and(|corners| corners.contains(&vertex))
        })
    }

    fn take_apart(&mut self, region: usize) {
        for member in self.members[region].split_off(1) {
            self.region_of[member] = self.members.len();
            self.members.push(vec![member]);
        }
    }
}

/// How corner `k` of an outline sits between the ones before and after it.
fn corner_kind(hull: &TriangulatedHull, corners: &[usize], normal: DVec3, k: usize, tolerance: f64) -> CornerKind {
    let before = hull.points[corners[(k + corners.len() - 1) % corners.len()]];
    let after = hull.points[corners[(k + 1) % corners.len()]];
    let (span, offset) = (after - before, hull.points[corners[k]] - before);
    // Counter-clockwise outlines have the outside on the right: the direction `span × normal`.
    let outward = span.cross(normal).normalize_or_zero();
    let excess = outward.dot(offset);
    let along = span.dot(offset);
    let between = along > 0.0 && along < span.length_squared();
    // The end of a sliver is also near the line of its neighbours, but beyond them: it must stay.
    if excess < -tolerance || (excess <= tolerance && between) { CornerKind::Redundant } else { CornerKind::Convex }
}

/// Marks the vertices to drop in this pass, no two of them neighbours.
fn redundant_vertices(hull: &TriangulatedHull, outlines: &[Outline], tolerance: f64) -> Vec<bool> {
    let count = hull.points.len();
    let mut candidate = vec![true; count];
    for outline in outlines {
        for &v in &outline.corners {
            candidate[v] = false;
        }
    }
    for outline in outlines {
        for (k, &v) in outline.corners.iter().enumerate() {
            let kind = corner_kind(hull, &outline.corners, outline.normal, k, tolerance);
            candidate[v] |= kind == CornerKind::Redundant;
        }
    }
    let mut neighbors = vec![Vec::new(); count];
    for triangle in &hull.triangles {
        for side in 0..3 {
            neighbors[triangle.vertices[side]].push(triangle.vertices[(side + 1) % 3]);
        }
    }
    let mut redundant = vec![false; count];
    for v in 0..count {
        redundant[v] = candidate[v] && !neighbors[v].iter().any(|&other| redundant[other]);
    }
    redundant
}
