//! Which triangles of a mesh share an edge or a corner, and which edges and corners can touch at all.
//!
//! Contact with a surface is a local matter: a point of the mesh can hold a body off along `n` only if no direction along
//! the surface from that point climbs towards `n`. So an edge of a triangle allows the normals with `n · u ≤ 0` for the
//! direction `u` that leads from the edge into the neighbour, and a corner those with `n · d ≤ 0` for every edge `d` that
//! leaves it. Flat and concave edges allow no normal of their own, so that seams inside a surface are never felt.
//!
//! Corners are joined by position, so triangles that share no indices are neighbours all the same, and an open edge that
//! runs along another triangle (a T-junction) is a seam with that one. Where more than two triangles meet at an edge, the
//! neighbour that closes most of the front side counts.
//!
//! Of all this a mesh keeps six bytes a triangle: by which angle the surface bends at each edge ([`Bend`]), from which the
//! direction into the neighbour follows. Neighbours themselves are not kept: where a corner's edges are asked for, the
//! tree finds the triangles that have that corner.

use crate::math::{Real, Vec3};

/// How a triangle goes on across an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum EdgeKind {
    /// It does not: no other triangle has this edge.
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

/// By which angle the surface bends across an edge, in steps of a ten thousandth of a radian: positive towards the front.
///
/// The angle is told by `s / (|s| + |c|)` of its sine and cosine, continued to ±2 past a right angle: no trigonometry, and
/// level surfaces, right angles and the diagonals between them are exact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Bend(i16);

impl Bend {
    pub(super) const BOUNDARY: Self = Self(i16::MIN);
    /// Steps up to a right angle.
    const QUARTER: Real = 16000.0;
    /// Steps that count as flat: [`FLAT_SINE`].
    const FLAT: i16 = 16;

    /// The bend from a triangle (unit normal, unit vector inwards from the edge) to a neighbour (unit vector away from the
    /// edge).
    pub(super) fn new(kind: EdgeKind, normal: Vec3, own: Vec3, neighbor: Vec3) -> Self {
        if kind == EdgeKind::Boundary {
            return Self::BOUNDARY;
        }
        let (sine, cosine) = (neighbor.dot(normal), -neighbor.dot(own));
        let share = sine / (sine.abs() + cosine.abs());
        let turn = if cosine >= 0.0 { share } else { (2.0_f32 - share.abs()).copysign(sine) };
        let steps = (turn * Self::QUARTER + if turn < 0.0 { -0.5 } else { 0.5 }) as i16;
        let most = 2 * Self::QUARTER as i16;
        // Rounding must not change the kind.
        Self(match kind {
            EdgeKind::Concave => steps.clamp(Self::FLAT + 1, most),
            EdgeKind::Convex if steps >= -Self::FLAT && cosine < 0.0 => -most,
            EdgeKind::Convex => steps.clamp(-most, -Self::FLAT - 1),
            _ => steps.clamp(-Self::FLAT, Self::FLAT),
        })
    }

    pub(super) fn kind(self) -> EdgeKind {
        match self.0 {
            i16::MIN => EdgeKind::Boundary,
            steps if steps > Self::FLAT => EdgeKind::Concave,
            steps if steps < -Self::FLAT => EdgeKind::Convex,
            _ => EdgeKind::Flat,
        }
    }

    /// Whether no other triangle has the edge.
    pub(crate) fn is_boundary(self) -> bool {
        self == Self::BOUNDARY
    }

    /// Unit vector in the plane of the neighbour, at a right angle to the edge and away from it, for a triangle with that
    /// normal and that vector inwards from the edge; zero at a boundary.
    pub(crate) fn across(self, normal: Vec3, own: Vec3) -> Vec3 {
        if self == Self::BOUNDARY {
            return Vec3::ZERO;
        }
        let turn = Real::from(self.0) * (1.0 / Self::QUARTER);
        let sine = if turn.abs() <= 1.0 { turn } else { (2.0 - turn.abs()).copysign(turn) };
        let cosine = 1.0 - turn.abs();
        (normal * sine - own * cosine) * (1.0 / (sine * sine + cosine * cosine).sqrt())
    }
}

/// What is kept of a triangle and of those around it, beside the user's lists. 16 bytes.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(crate) struct Surroundings {
    /// Number in the user's list.
    pub(crate) id: u32,
    /// Equal for triangles joined by flat edges.
    pub(crate) patch: u32,
    bends: [Bend; 3],
    /// Three bits each: sharp edges, flat edges, sharp corners, flat corners.
    bits: u16,
}

impl Surroundings {
    /// As said at the fields.
    #[inline(always)]
    pub(super) fn from_parts(id: u32, patch: u32, bends: [Bend; 3], bits: u16) -> Self {
        Self { id, patch, bends, bits }
    }

    /// How the surface bends across edge `i` (from corner `i` to the next).
    pub(crate) fn bend(&self, i: usize) -> Bend {
        self.bends[i]
    }

    /// Whether edge `i` is convex or open, so that it can touch by itself.
    #[inline(always)]
    pub(crate) fn edge_is_sharp(&self, i: usize) -> bool {
        self.bits >> i & 1 == 1
    }

    /// Whether the surface goes on flat across edge `i`; never for 3, which is none.
    #[inline(always)]
    pub(crate) fn edge_is_flat(&self, i: usize) -> bool {
        i < 3 && self.bits >> (3 + i) & 1 == 1
    }

    /// Whether a sharp edge ends in corner `i`.
    #[inline(always)]
    pub(crate) fn corner_is_sharp(&self, i: usize) -> bool {
        self.bits >> (6 + i) & 1 == 1
    }

    /// Whether all around corner `i` the surface is flat.
    #[inline(always)]
    pub(crate) fn corner_is_flat(&self, i: usize) -> bool {
        self.bits >> (9 + i) & 1 == 1
    }

    /// Whether no edge and no corner can touch, only the face.
    #[inline(always)]
    pub(crate) fn is_plain(&self) -> bool {
        self.bits & 0o707 == 0
    }
}

/// What a mesh is made of, while its edges are looked at.
pub(super) struct Surface<'a> {
    pub(super) vertices: &'a [Vec3],
    pub(super) triangles: &'a [[u32; 3]],
    pub(super) normals: &'a [Vec3],
}

impl Surface<'_> {
    fn corner(&self, triangle: u32, i: u32) -> Vec3 {
        self.vertices[self.triangles[triangle as usize][(i % 3) as usize] as usize]
    }

    /// Unit vector in the plane of a triangle from its edge inwards.
    fn inward(&self, triangle: u32, edge: u32) -> Vec3 {
        let along = self.corner(triangle, edge + 1).as_dvec3() - self.corner(triangle, edge).as_dvec3();
        let across = self.normals[triangle as usize].as_dvec3().cross(along);
        (across / across.length()).as_vec3()
    }
}

/// How the triangles of a mesh are joined; gone once the mesh is built.
pub(super) struct Adjacency<'a> {
    surface: &'a Surface<'a>,
    /// For each vertex the first one at the same position.
    welded: Vec<u32>,
    bends: Vec<[Bend; 3]>,
    /// For each triangle one that it is joined to by a flat edge, with a smaller number, or itself.
    patches: Vec<u32>,
    /// For each welded corner [`SHARP`] if a convex or open edge ends there, [`BENT`] if any edge that is not flat does.
    corners: Vec<u8>,
    /// Sides that no side of the opposite direction matches.
    open_edges: usize,
}

const SHARP: u8 = 1;
const BENT: u8 = 2;

/// One side of an edge: the welded end with the larger number, then whose it is.
#[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
struct Side {
    end: u32,
    triangle: u32,
    edge: u8,
    /// Whether the triangle goes towards that end.
    forward: bool,
}

impl<'a> Adjacency<'a> {
    pub(super) fn new(surface: &'a Surface<'a>) -> Self {
        let mut adjacency = Self {
            surface,
            welded: weld(surface.vertices),
            bends: vec![[Bend::BOUNDARY; 3]; surface.triangles.len()],
            patches: (0..surface.triangles.len() as u32).collect(),
            corners: vec![0; surface.vertices.len()],
            open_edges: 0,
        };
        let (first, mut sides) = adjacency.sides();
        let mut inwards = Vec::new();
        for range in first.windows(2) {
            let at_corner = &mut sides[range[0] as usize..range[1] as usize];
            at_corner.sort_unstable();
            for group in at_corner.chunk_by(|a, b| a.end == b.end) {
                adjacency.open_edges += adjacency.unmatched(group);
                inwards.clear();
                inwards.extend(group.iter().map(|side| surface.inward(side.triangle, u32::from(side.edge))));
                for (k, side) in group.iter().enumerate() {
                    let others = group.iter().zip(&inwards).filter(|(other, _)| other.triangle != side.triangle);
                    adjacency.join(side, inwards[k], others.map(|(other, inward)| (other.triangle, *inward)));
                }
            }
        }
        adjacency
    }

    /// How many sides of an edge no side of the opposite direction matches. Zero for all edges of a closed mesh.
    pub(super) fn open_edges(&self) -> usize {
        self.open_edges
    }

    fn unmatched(&self, sides: &[Side]) -> usize {
        let forward = sides.iter().filter(|side| side.forward).count();
        forward.abs_diff(sides.len() - forward)
    }

    fn welded_corner(&self, triangle: u32, i: usize) -> u32 {
        self.welded[self.surface.triangles[triangle as usize][i % 3] as usize]
    }

    /// The sides of all edges, those of each welded corner in a row: where each row starts, and the sides. A side belongs
    /// to the end with the smaller number.
    fn sides(&self) -> (Vec<u32>, Vec<Side>) {
        let triangles = self.surface.triangles.len() as u32;
        let ends = |triangle: u32, edge: usize| {
            let (a, b) = (self.welded_corner(triangle, edge), self.welded_corner(triangle, edge + 1));
            (a.min(b), a.max(b), b > a)
        };
        let mut first = vec![0; self.welded.len() + 1];
        for triangle in 0..triangles {
            for edge in 0..3 {
                first[ends(triangle, edge).0 as usize] += 1;
            }
        }
        // Each row's end; filling it backwards leaves its start.
        let mut sum = 0;
        for count in &mut first {
            sum += *count;
            *count = sum;
        }
        let mut sides = vec![Side::default(); sum as usize];
        for triangle in 0..triangles {
            for edge in 0..3 {
                let (start, end, forward) = ends(triangle, edge);
                first[start as usize] -= 1;
                sides[first[start as usize] as usize] = Side { end, triangle, edge: edge as u8, forward };
            }
        }
        (first, sides)
    }

    /// Records the neighbour across one side that closes most of the front.
    fn join(&mut self, side: &Side, own: Vec3, others: impl Iterator<Item = (u32, Vec3)>) {
        let normal = self.surface.normals[side.triangle as usize];
        let mut closest: Option<(Real, u32, Vec3)> = None;
        for (other, inward) in others {
            let closing = closing(inward, normal, own);
            if closest.is_none_or(|(most, ..)| closing > most) {
                closest = Some((closing, other, inward));
            }
        }
        let Some((closing, other, inward)) = closest else { return };
        let kind = kind_of(closing);
        self.bends[side.triangle as usize][side.edge as usize] = Bend::new(kind, normal, own, inward);
        if kind == EdgeKind::Flat {
            self.join_patches(side.triangle, other);
        }
    }

    /// Closes the open edges that run along another triangle without sharing its corners (T-junctions): `near` calls back
    /// with the triangles around a point. The middle of the edge decides for all of it.
    pub(super) fn close_seams(&mut self, near: impl Fn(Vec3, Real, &mut dyn FnMut(u32))) {
        let surface = self.surface;
        for index in 0..surface.triangles.len() as u32 {
            for edge in 0..3 {
                if self.bends[index as usize][edge as usize] != Bend::BOUNDARY {
                    continue;
                }
                let (a, b) = (surface.corner(index, edge), surface.corner(index, edge + 1));
                let (middle, along) = ((a + b) * 0.5, (b - a).normalize_or_zero());
                let gap = SEAM_GAP * (b - a).length();
                let mut others = Vec::new();
                near(middle, gap, &mut |other| {
                    // Away from the edge inside the other triangle, if that goes on from the middle.
                    let normal = surface.normals[other as usize];
                    let across = normal.cross(along).normalize_or_zero();
                    let goes_on = |u: Vec3| {
                        (0..3).all(|i| {
                            let start = surface.corner(other, i);
                            let inward = normal.cross(surface.corner(other, i + 1) - start);
                            inward.dot(middle + u * (3.0 * gap) - start) >= -gap * inward.length()
                        })
                    };
                    let plane = normal.dot(middle - surface.corner(other, 0)).abs();
                    if other != index && plane <= gap && across != Vec3::ZERO {
                        others.extend([across, -across].into_iter().filter(|u| goes_on(*u)).map(|u| (other, u)));
                    }
                });
                let own = surface.inward(index, edge);
                // What folds back onto the triangle itself is a second sheet, not its continuation.
                let ahead = others.into_iter().filter(|(_, u)| u.dot(own) < 0.99);
                self.join(&Side { end: 0, triangle: index, edge: edge as u8, forward: true }, own, ahead);
            }
        }
    }

    /// What is to be kept, in the order of the tree. Call once all edges are known.
    pub(super) fn finish(mut self, order: &[u32]) -> Vec<Surroundings> {
        for triangle in 0..self.bends.len() as u32 {
            for edge in 0..3 {
                let mark = match self.bends[triangle as usize][edge].kind() {
                    EdgeKind::Flat => continue,
                    EdgeKind::Concave => BENT,
                    EdgeKind::Boundary | EdgeKind::Convex => BENT | SHARP,
                };
                for i in [edge, edge + 1] {
                    let corner = self.welded_corner(triangle, i);
                    self.corners[corner as usize] |= mark;
                }
            }
        }
        order.iter().map(|&id| self.surroundings(id)).collect()
    }

    fn surroundings(&mut self, id: u32) -> Surroundings {
        let bends = self.bends[id as usize];
        let mut bits = 0;
        for (i, bend) in bends.iter().enumerate() {
            let corner = self.corners[self.welded_corner(id, i) as usize];
            let sharp = matches!(bend.kind(), EdgeKind::Boundary | EdgeKind::Convex);
            bits |= u16::from(sharp) << i;
            bits |= u16::from(bend.kind() == EdgeKind::Flat) << (3 + i);
            bits |= u16::from(corner & SHARP != 0) << (6 + i);
            bits |= u16::from(corner & BENT == 0) << (9 + i);
        }
        Surroundings { id, patch: self.patch(id), bends, bits }
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
}

/// The kind of the edge from a triangle (unit normal, unit vector inwards from the edge) to one neighbour.
pub(super) fn kind_between(normal: Vec3, own: Vec3, neighbor: Vec3) -> EdgeKind {
    kind_of(closing(neighbor, normal, own))
}

fn kind_of(closing: Real) -> EdgeKind {
    if closing > FLAT_SINE {
        EdgeKind::Concave
    } else if closing < -FLAT_SINE {
        EdgeKind::Convex
    } else {
        EdgeKind::Flat
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

/// For each vertex the first one at the same position.
fn weld(vertices: &[Vec3]) -> Vec<u32> {
    const FREE: u32 = u32::MAX;
    // Adding zero makes −0 and +0 one position.
    let key = |i: u32| (vertices[i as usize] + Vec3::ZERO).to_array().map(Real::to_bits);
    let mask = (2 * vertices.len()).next_power_of_two() - 1;
    // A table of first vertices, tried from a place that the position gives.
    let mut table = vec![FREE; mask + 1];
    let mut first_at = |vertex: u32| {
        let wanted = key(vertex);
        let mixed = wanted.iter().fold(0_u64, |h, &bits| (h ^ u64::from(bits)).wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let mut place = (mixed >> 32) as usize & mask;
        while table[place] != FREE && key(table[place]) != wanted {
            place = (place + 1) & mask;
        }
        if table[place] == FREE {
            table[place] = vertex;
        }
        table[place]
    };
    (0..vertices.len() as u32).map(&mut first_at).collect()
}
