//! Which triangles of a mesh share an edge or a corner, and which edges and corners can touch at all.
//!
//! Contact with a surface is a local matter: a point of the mesh can hold a body off along `n` only if no direction along
//! the surface from that point climbs towards `n`. So an edge of a triangle allows the normals with `n · u ≤ 0` for the
//! direction `u` that leads from the edge into the neighbour, and a corner those with `n · d ≤ 0` for every edge `d` that
//! leaves it. Flat and concave edges allow no normal of their own, so that seams inside a surface are never felt.
//!
//! Corners are joined by position, so triangles that share no indices are neighbours all the same, and an open edge that
//! runs along another triangle (a T-junction) is a seam with that one. Where more than two
//! triangles meet at an edge, the neighbour that closes most of the front side counts.

use crate::math::{Real, Vec3};

/// How a triangle goes on across an edge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MeshEdge {
    /// It does not: no other triangle has this edge.
    #[default]
    Boundary,
    /// The neighbour bends away from the front side: a ridge.
    Convex,
    /// The neighbour goes on in the same plane, to a tenth of a degree.
    Flat,
    /// The neighbour bends towards the front side: a groove.
    Concave,
}

/// Below this sine of the angle between two neighbours their edge is flat. Only the cost depends on it: steeper edges
/// are tested against the normals they allow, flat ones need no test.
const FLAT_SINE: Real = 1e-3;

/// An open edge is closed by a triangle no farther from its middle than this share of its length.
const SEAM_GAP: Real = 1e-4;

/// The neighbourhood of one triangle.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Neighborhood {
    /// Unit vector in the plane of the neighbour across edge `i`, at a right angle to the edge and away from it; zero at a boundary.
    pub(crate) inward: [Vec3; 3],
    /// Welded number of corner `i`.
    pub(crate) corners: [u32; 3],
    pub(crate) kinds: [MeshEdge; 3],
}

/// The welded corners, their neighbours, and the neighbourhood of each triangle.
#[derive(Clone, Debug, Default)]
pub(super) struct Adjacency {
    pub(super) triangles: Vec<Neighborhood>,
    /// For each triangle the unit vectors in its own plane from its edges inwards.
    pub(super) own: Vec<[Vec3; 3]>,
    /// For each triangle the smallest number of those it is joined to by flat edges.
    pub(super) patches: Vec<u32>,
    /// For each welded corner whether a convex or open edge ends there.
    pub(super) sharp: Vec<bool>,
    /// For each welded corner whether any edge that ends there is not flat.
    pub(super) bent: Vec<bool>,
    first: Vec<u32>,
    ends: Vec<u32>,
}

/// One side of an edge: its welded ends in ascending order, then whose it is.
type Side = (u32, u32, u32, u32);

impl Adjacency {
    pub(super) fn new(vertices: &[Vec3], triangles: &[[u32; 3]], normals: &[Vec3]) -> Self {
        let welded = weld(vertices);
        let mut adjacency = Self {
            triangles: triangles
                .iter()
                .map(|t| Neighborhood { corners: t.map(|i| welded[i as usize]), ..Neighborhood::default() })
                .collect(),
            own: vec![[Vec3::ZERO; 3]; triangles.len()],
            patches: (0..triangles.len() as u32).collect(),
            sharp: vec![false; vertices.len()],
            bent: vec![false; vertices.len()],
            ..Self::default()
        };
        let sides = adjacency.sides();
        let inward = |side: &Side| inward(vertices, &triangles[side.2 as usize], normals[side.2 as usize], side.3);
        for group in sides.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            for side in group {
                let others = group.iter().filter(|other| other.2 != side.2);
                let candidates = others.map(|other| (other.2, inward(other)));
                adjacency.join(side, normals[side.2 as usize], inward(side), candidates);
            }
        }
        adjacency.link_corners(vertices.len(), &sides);
        adjacency
    }

    /// The welded corners that edges join to a welded corner.
    pub(super) fn ends(&self, corner: u32) -> &[u32] {
        &self.ends[self.first[corner as usize] as usize..self.first[corner as usize + 1] as usize]
    }

    fn sides(&self) -> Vec<Side> {
        let mut sides: Vec<Side> = Vec::with_capacity(3 * self.triangles.len());
        for (index, triangle) in self.triangles.iter().enumerate() {
            for edge in 0..3 {
                let (a, b) = (triangle.corners[edge], triangle.corners[(edge + 1) % 3]);
                sides.push((a.min(b), a.max(b), index as u32, edge as u32));
            }
        }
        sides.sort_unstable();
        sides
    }

    /// Records the neighbour across one side that closes most of the front.
    fn join(&mut self, side: &Side, normal: Vec3, own: Vec3, others: impl Iterator<Item = (u32, Vec3)>) {
        let mut closest: Option<(Real, u32, Vec3)> = None;
        for (other, inward) in others {
            let closing = closing(inward, normal, own);
            if closest.is_none_or(|(most, ..)| closing > most) {
                closest = Some((closing, other, inward));
            }
        }
        let kind = match closest {
            None => MeshEdge::Boundary,
            Some((closing, ..)) if closing > FLAT_SINE => MeshEdge::Concave,
            Some((closing, ..)) if closing < -FLAT_SINE => MeshEdge::Convex,
            Some(_) => MeshEdge::Flat,
        };
        let triangle = &mut self.triangles[side.2 as usize];
        triangle.kinds[side.3 as usize] = kind;
        self.own[side.2 as usize][side.3 as usize] = own;
        if let Some((_, other, inward)) = closest {
            triangle.inward[side.3 as usize] = inward;
            if kind == MeshEdge::Flat {
                self.join_patches(side.2, other);
            }
        }
    }

    /// Closes the open edges that run along another triangle without sharing its corners (T-junctions): `near` calls back
    /// with the triangles around a point. The middle of the edge decides for all of it.
    pub(super) fn close_seams(
        &mut self,
        vertices: &[Vec3],
        triangles: &[[u32; 3]],
        normals: &[Vec3],
        near: impl Fn(Vec3, Real, &mut dyn FnMut(u32)),
    ) {
        for index in 0..triangles.len() {
            for edge in 0..3 {
                if self.triangles[index].kinds[edge] != MeshEdge::Boundary {
                    continue;
                }
                let corner = |t: usize, i: usize| vertices[triangles[t][i % 3] as usize];
                let (a, b) = (corner(index, edge), corner(index, edge + 1));
                let (middle, along) = ((a + b) * 0.5, (b - a).normalize_or_zero());
                let gap = SEAM_GAP * (b - a).length();
                let side = (0, 0, index as u32, edge as u32);
                let mut others = Vec::new();
                near(middle, gap, &mut |other| {
                    // Away from the edge inside the other triangle, if that goes on from the middle.
                    let across = normals[other as usize].cross(along).normalize_or_zero();
                    let goes_on = |u: Vec3| {
                        (0..3).all(|i| {
                            let start = corner(other as usize, i);
                            let inward = normals[other as usize].cross(corner(other as usize, i + 1) - start);
                            inward.dot(middle + u * (3.0 * gap) - start) >= -gap * inward.length()
                        })
                    };
                    let plane = normals[other as usize].dot(middle - corner(other as usize, 0)).abs();
                    if other != index as u32 && plane <= gap && across != Vec3::ZERO {
                        others.extend([across, -across].into_iter().filter(|u| goes_on(*u)).map(|u| (other, u)));
                    }
                });
                let own = self.own[index][edge];
                // What folds back onto the triangle itself is a second sheet, not its continuation.
                let ahead = others.into_iter().filter(|(_, u)| u.dot(own) < 0.99);
                self.join(&side, normals[index], own, ahead);
            }
        }
    }

    /// Marks the corners in which edges end that are not flat. Call once all edges are known.
    pub(super) fn mark_corners(&mut self) {
        for triangle in &self.triangles {
            for (edge, kind) in triangle.kinds.iter().enumerate() {
                for corner in [triangle.corners[edge], triangle.corners[(edge + 1) % 3]] {
                    self.sharp[corner as usize] |= matches!(kind, MeshEdge::Boundary | MeshEdge::Convex);
                    self.bent[corner as usize] |= *kind != MeshEdge::Flat;
                }
            }
        }
        self.flatten_patches();
    }

    fn patch(&mut self, triangle: u32) -> u32 {
        let mut root = triangle;
        while self.patches[root as usize] != root {
            // Path halving: every other link skips one, so that walks stay short.
            self.patches[root as usize] = self.patches[self.patches[root as usize] as usize];
            root = self.patches[root as usize];
        }
        root
    }

    fn join_patches(&mut self, a: u32, b: u32) {
        let (a, b) = (self.patch(a), self.patch(b));
        self.patches[a.max(b) as usize] = a.min(b);
    }

    fn flatten_patches(&mut self) {
        for triangle in 0..self.patches.len() as u32 {
            self.patches[triangle as usize] = self.patch(triangle);
        }
    }

    fn link_corners(&mut self, vertices: usize, sides: &[Side]) {
        let mut links: Vec<(u32, u32)> = sides.iter().flat_map(|s| [(s.0, s.1), (s.1, s.0)]).collect();
        links.sort_unstable();
        links.dedup();
        self.first = vec![0; vertices + 1];
        for link in &links {
            self.first[link.0 as usize + 1] += 1;
        }
        for i in 0..vertices {
            self.first[i + 1] += self.first[i];
        }
        self.ends = links.iter().map(|link| link.1).collect();
    }
}

/// How far a neighbour closes the front of a triangle: the sine of its angle above the triangle's plane, continued to
/// ±2 for neighbours that fold back over (or under) it.
fn closing(neighbor: Vec3, normal: Vec3, own: Vec3) -> Real {
    let rise = neighbor.dot(normal);
    if neighbor.dot(own) < 0.0 {
        rise
    } else if rise > FLAT_SINE {
        2.0 - rise
    } else {
        // Folded back under the triangle, or onto it (a sheet modelled twice): nothing closes the front.
        -2.0 - rise
    }
}

/// Unit vector in the plane of a triangle from its edge inwards.
fn inward(vertices: &[Vec3], triangle: &[u32; 3], normal: Vec3, edge: u32) -> Vec3 {
    let corner = |i: u32| vertices[triangle[(i % 3) as usize] as usize].as_dvec3();
    let along = corner(edge + 1) - corner(edge);
    let across = normal.as_dvec3().cross(along);
    (across / across.length()).as_vec3()
}

/// For each vertex the first one at the same position.
fn weld(vertices: &[Vec3]) -> Vec<u32> {
    // Adding zero makes −0 and +0 one position.
    let key = |i: u32| vertices[i as usize] + Vec3::ZERO;
    let order = |a: Vec3, b: Vec3| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)).then(a.z.total_cmp(&b.z));
    let mut sorted: Vec<u32> = (0..vertices.len() as u32).collect();
    sorted.sort_unstable_by(|&a, &b| order(key(a), key(b)).then(a.cmp(&b)));
    let mut welded = vec![0; vertices.len()];
    for group in sorted.chunk_by(|&a, &b| key(a) == key(b)) {
        for &vertex in group {
            welded[vertex as usize] = group[0];
        }
    }
    welded
}
