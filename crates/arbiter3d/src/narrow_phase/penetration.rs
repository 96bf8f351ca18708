//! How deep two convex cores overlap, and along which normal: the expanding polytope algorithm.
//!
//! The cores overlap where the origin is inside the set of differences `x1 − x2`; the least motion that parts them leads
//! from the origin to the nearest point of its boundary. A polytope inside the set grows: the face nearest to the origin
//! is replaced by those to the set's farthest point along its normal, until that is no farther than the face. Source: van
//! den Bergen, "Proximity Queries and Penetration Depth Computation on 3D Game Objects", 2001.
//!
//! Unlike there, the first tetrahedron need not hold the origin: a face that the origin is in front of has a negative
//! distance and so comes first. The depth told is that along the normal found, which is never less than the least one, and
//! more by no more than [`GAIN`]. Round sets would need many corners for that: they are searched less finely, and the way out
//! is then polished with closest points.
//!
//! All in `f64`, as in `distance`.

use super::distance::{Gap, Nearness, Placed};
use glam::DVec3;

/// A face is on the boundary if the set reaches past it by less than this share of the size.
const GAIN: f64 = 1e-7;
/// Of round sets: by less than this share of the smaller shape's size, because the rest is polished.
const ROUND_GAIN: f64 = 1e-5;
/// And this share of the depth.
const ROUND_SHARE: f64 = 5e-6;
/// But no less than this share of the set's size.
const ROUNDING: f64 = 1e-9;
/// What is thinner than this share of its size is flat.
const FLAT: f64 = 1e-9;
/// A triangle is a sliver if twice its area is less than this share of the square of its longest edge.
const SLIVER: f64 = 1e-10;
/// A polyhedron of `n` corners has `2n − 4` faces.
const MAX_CORNERS: usize = 96;
const MAX_FACES: usize = 2 * MAX_CORNERS - 4;
const MAX_HORIZON: usize = 64;
/// How far beyond touching the shapes are moved apart to see the way out better, as a share of the smaller size.
const LIFT: f64 = 1e-2;
/// Times that is done.
const POLISHINGS: usize = 3;

/// Where two overlapping cores are to be parted, in the frame of shape 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Penetration {
    /// Deepest point of the core of shape 1 in that of shape 2.
    pub point1: DVec3,
    /// Unit vector from shape 1 to shape 2: moved along it by `depth`, shape 2 only touches.
    pub normal: DVec3,
    /// Metres; below zero by rounding.
    pub depth: f64,
}

#[derive(Clone, Copy)]
struct Corner {
    difference: DVec3,
    point1: DVec3,
}

#[derive(Clone, Copy)]
struct Face {
    corners: [u16; 3],
    /// Outward unit normal; zero for a sliver, which is never looked at and goes with the first neighbour that goes.
    normal: DVec3,
    /// `normal · x` on the face; the largest number there is for a sliver.
    offset: f64,
}

/// A growing polytope.
struct Polytope {
    corners: [Corner; MAX_CORNERS],
    corner_count: usize,
    faces: [Face; MAX_FACES],
    face_count: usize,
}

/// Overlap of two cores that are not apart.
pub(super) fn penetration(placed: &Placed<'_>) -> Penetration {
    let found = least_way_out(placed).unwrap_or_else(|| along(placed, placed.position().normalize_or(DVec3::Y)));
    if placed.is_round() { polished(placed, found) } else { found }
}

/// The expanding polytope; `None` if all of it is slivers.
fn least_way_out(placed: &Placed<'_>) -> Option<Penetration> {
    // `Placed` gives differences `x2 − x1`.
    let corner = |direction: DVec3| {
        let corner = placed.corner(-direction);
        Corner { difference: -corner.difference, point1: corner.point1 }
    };
    let first = match first_corners(&corner) {
        Ok(first) => first,
        Err((normal, on_plane)) => return Some(flat_penetration(normal, on_plane)),
    };
    let mut polytope = Polytope::new(first);
    let size = first.iter().fold(0.0, |size: f64, c| larger(c.difference.length_squared(), size)).sqrt();
    let round_gain = if placed.is_round() { ROUND_GAIN * placed.size() } else { 0.0 };
    // The least depth seen, for a search that has to be given up.
    let mut best = along(placed, placed.position().normalize_or(DVec3::Y));
    loop {
        let nearest = polytope.nearest_face()?;
        let face = polytope.faces[nearest];
        let reached = corner(face.normal);
        let height = reached.difference.dot(face.normal);
        let gain = if round_gain > 0.0 {
            larger(round_gain + ROUND_SHARE * height.abs(), ROUNDING * size)
        } else {
            GAIN * size
        };
        if height - face.offset <= gain {
            return Some(polytope.result(&face, height));
        }
        if height < best.depth {
            best = Penetration { point1: reached.point1, normal: face.normal, depth: height };
        }
        if !polytope.expand(nearest, reached) {
            return Some(best);
        }
    }
}

/// How far the cores overlap along a unit direction.
fn along(placed: &Placed<'_>, normal: DVec3) -> Penetration {
    let corner = placed.corner(-normal);
    Penetration { point1: corner.point1, normal, depth: -corner.difference.dot(normal) }
}

/// The same way out, seen from a little farther: with the shapes moved just apart along the normal found, the closest points
/// tell the true one the better the shallower the overlap is, because the normal of a round surface turns by less than the
/// position that it is looked at from.
fn polished(placed: &Placed<'_>, found: Penetration) -> Penetration {
    let (mut best, lift) = (found, LIFT * placed.size());
    for _ in 0..POLISHINGS {
        let moved = placed.moved(best.normal * (best.depth + lift));
        let Nearness::Gap(Gap { point1, way }) = moved.nearness(f64::INFINITY) else { break };
        let normal = way / way.length();
        let next = Penetration { point1, ..along(placed, normal) };
        if next.depth >= best.depth {
            break;
        }
        best = next;
    }
    best
}

fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// Four corners of the set that span a volume; else the normal of the plane that it lies in, and a corner.
fn first_corners(corner: &impl Fn(DVec3) -> Corner) -> Result<[Corner; 4], (DVec3, Corner)> {
    let axes = [DVec3::X, DVec3::Y, DVec3::Z];
    let ends = axes.map(|axis| [corner(axis), corner(-axis)]);
    let length = |[a, b]: &[Corner; 2]| (a.difference - b.difference).length_squared();
    let mut longest = 0;
    for axis in 1..3 {
        if length(&ends[axis]) > length(&ends[longest]) {
            longest = axis;
        }
    }
    let [a, b] = ends[longest];
    let along = b.difference - a.difference;
    let squared = along.length_squared();
    if squared == 0.0 {
        return Err((DVec3::Y, a));
    }
    // The corner farthest from the line, of those along both directions square to it.
    let sideways = along.cross(axes[(longest + 1) % 3]);
    let upwards = along.cross(sideways);
    let off_line = |c: &Corner| (c.difference - a.difference).cross(along).length_squared() / squared;
    let mut c = a;
    for direction in [sideways, -sideways, upwards, -upwards] {
        let candidate = corner(direction);
        if off_line(&candidate) > off_line(&c) {
            c = candidate;
        }
    }
    if off_line(&c) <= FLAT * FLAT * squared {
        return Err((sideways.normalize(), a));
    }
    let normal = along.cross(c.difference - a.difference).normalize();
    let height = |d: &Corner| (d.difference - a.difference).dot(normal);
    let (above, below) = (corner(normal), corner(-normal));
    let d = if height(&above) >= -height(&below) { above } else { below };
    if height(&d).abs() <= FLAT * squared.sqrt() {
        return Err((normal, a));
    }
    Ok([a, b, c, d])
}

/// Two flat cores in one plane overlap by nothing across it; the plane is the origin's but for rounding.
fn flat_penetration(normal: DVec3, on_plane: Corner) -> Penetration {
    let height = on_plane.difference.dot(normal);
    let normal = if height > 0.0 { -normal } else { normal };
    Penetration { point1: on_plane.point1, normal, depth: -height.abs() }
}

impl Polytope {
    fn new(first: [Corner; 4]) -> Self {
        let none = Corner { difference: DVec3::ZERO, point1: DVec3::ZERO };
        let dead = Face { corners: [0; 3], normal: DVec3::ZERO, offset: 0.0 };
        let mut polytope =
            Self { corners: [none; MAX_CORNERS], corner_count: 4, faces: [dead; MAX_FACES], face_count: 0 };
        polytope.corners[..4].copy_from_slice(&first);
        let [a, b, c, d] = first.map(|c| c.difference);
        let outward = (b - a).cross(c - a).dot(d - a) < 0.0;
        let faces = if outward {
            [[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]]
        } else {
            [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
        };
        faces.into_iter().for_each(|corners| polytope.push_face(corners));
        polytope
    }

    fn push_face(&mut self, corners: [u16; 3]) {
        let [a, b, c] = corners.map(|i| self.corners[i as usize].difference);
        let cross = (b - a).cross(c - a);
        let length = cross.length();
        let longest = larger(larger((b - a).length_squared(), (c - a).length_squared()), (c - b).length_squared());
        // The normal of a sliver is rounding.
        let good = length > SLIVER * longest;
        let normal = if good { cross / length } else { DVec3::ZERO };
        let offset = if good { normal.dot(a) } else { f64::MAX };
        self.faces[self.face_count] = Face { corners, normal, offset };
        self.face_count += 1;
    }

    /// The face with the least offset, the first of several.
    fn nearest_face(&self) -> Option<usize> {
        let (mut best, mut least) = (None, f64::MAX);
        for (index, face) in self.faces[..self.face_count].iter().enumerate() {
            if face.offset < least {
                (best, least) = (Some(index), face.offset);
            }
        }
        best
    }

    /// Takes in a corner that a face sees; false if there is no room for it.
    ///
    /// What goes is the connected patch of faces that see the corner: among flat faces rounding would have others see it
    /// too, here and there.
    fn expand(&mut self, seen: usize, corner: Corner) -> bool {
        let mut outline = Outline { edges: [[0; 2]; MAX_HORIZON], count: 0 };
        if self.corner_count == MAX_CORNERS || !outline.cross(self.faces[seen].corners) {
            return false;
        }
        // Those that see the corner, the patch first.
        let mut patch = [seen as u16; MAX_FACES];
        let mut seeing = 1;
        for (index, face) in self.faces[..self.face_count].iter().enumerate() {
            let sliver = face.offset == f64::MAX;
            if index != seen && (sliver || face.normal.dot(corner.difference) > face.offset) {
                patch[seeing] = index as u16;
                seeing += 1;
            }
        }
        let (mut patch_count, mut grows) = (1, true);
        while grows {
            grows = false;
            let mut k = patch_count;
            while k < seeing {
                let corners = self.faces[patch[k] as usize].corners;
                if outline.touches(corners) {
                    if !outline.cross(corners) {
                        return false;
                    }
                    patch.swap(patch_count, k);
                    patch_count += 1;
                    grows = true;
                }
                k += 1;
            }
        }
        if self.face_count - patch_count + outline.count > MAX_FACES {
            return false;
        }
        // The last face takes the place of each that goes, from the back so that none of those moves.
        patch[..patch_count].sort_unstable();
        for &index in patch[..patch_count].iter().rev() {
            self.face_count -= 1;
            self.faces[index as usize] = self.faces[self.face_count];
        }
        let index = self.corner_count as u16;
        self.corners[self.corner_count] = corner;
        self.corner_count += 1;
        outline.edges[..outline.count].iter().for_each(|&[a, b]| self.push_face([a, b, index]));
        true
    }

    /// What a face on the boundary tells.
    fn result(&self, face: &Face, height: f64) -> Penetration {
        let [a, b, c] = face.corners.map(|i| self.corners[i as usize]);
        let on_face = face.normal * face.offset;
        let area = |p: DVec3, q: DVec3| (p - on_face).cross(q - on_face).dot(face.normal);
        let weights =
            [area(b.difference, c.difference), area(c.difference, a.difference), area(a.difference, b.difference)];
        let sum = weights[0] + weights[1] + weights[2];
        let point1 = if sum > 0.0 {
            (a.point1 * weights[0] + b.point1 * weights[1] + c.point1 * weights[2]) / sum
        } else {
            a.point1
        };
        Penetration { point1, normal: face.normal, depth: height }
    }
}

/// The edges around a patch of faces, in the sense of those.
struct Outline {
    edges: [[u16; 2]; MAX_HORIZON],
    count: usize,
}

impl Outline {
    fn twin(&self, [a, b]: [u16; 2]) -> Option<usize> {
        self.edges[..self.count].iter().position(|edge| *edge == [b, a])
    }

    /// Whether a face shares an edge with the patch.
    fn touches(&self, [a, b, c]: [u16; 3]) -> bool {
        [[a, b], [b, c], [c, a]].into_iter().any(|edge| self.twin(edge).is_some())
    }

    /// Adds a face to the patch; false if there is no room.
    fn cross(&mut self, [a, b, c]: [u16; 3]) -> bool {
        for edge in [[a, b], [b, c], [c, a]] {
            if let Some(twin) = self.twin(edge) {
                self.count -= 1;
                self.edges[twin] = self.edges[self.count];
            } else if self.count == MAX_HORIZON {
                return false;
            } else {
                self.edges[self.count] = edge;
                self.count += 1;
            }
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Pose, Rotation, Vec3};
    use crate::narrow_phase::support::Support;
    use crate::narrow_phase::tests::Random;
    use crate::shape::{Cuboid, Cylinder, Shape};

    fn depth(a: &Support<'_>, b: &Support<'_>, pose: &Pose) -> Option<Penetration> {
        let pairs = [Placed::new(a, b, pose), Placed::new(b, a, &pose.inverse())];
        let [found, swapped] =
            pairs.map(|pair| matches!(pair.nearness(f64::INFINITY), Nearness::Overlap).then(|| penetration(&pair)));
        assert_eq!(found.is_some(), swapped.is_some());
        if let (Some(x), Some(y)) = (found, swapped) {
            assert!((x.depth - y.depth).abs() < 1e-5, "{x:?} {y:?}");
        }
        found
    }

    #[test]
    fn known_depths() {
        let cube = Support::Cuboid(Cuboid::new(Vec3::ONE).unwrap());
        let found = depth(&cube, &cube, &Pose::from_position(Vec3::new(0.1, 1.7, -0.2))).unwrap();
        assert!((found.depth - 0.3).abs() < 1e-6 && (found.normal - DVec3::Y).length() < 1e-6, "{found:?}");
        assert!(depth(&cube, &cube, &Pose::from_position(Vec3::new(0.0, 2.1, 0.0))).is_none());
        let can = Support::Cylinder(Cylinder::new(1.0, 0.5).unwrap());
        let lying = Pose::new(Vec3::new(0.0, 1.45, 0.0), Rotation::from_xyzw(1.0, 0.0, 0.0, 1.0).normalize());
        let found = depth(&cube, &can, &lying).unwrap();
        assert!((found.depth - 0.05).abs() < 1e-6 && (found.normal - DVec3::Y).length() < 1e-5, "{found:?}");
        // Two balls as ellipsoids: the line of centres.
        let ball = Shape::ellipsoid(Vec3::ONE).unwrap();
        let ball = Support::new(&ball).unwrap();
        let found = depth(&ball, &ball, &Pose::from_position(Vec3::new(0.9, 1.2, 0.0))).unwrap();
        assert!((found.depth - 0.5).abs() < 1e-5, "{found:?}");
        assert!((found.normal - DVec3::new(0.6, 0.8, 0.0)).length() < 2e-3, "{found:?}");
    }

    /// Moved out along the normal by the depth, shapes touch; moved by a little less in any direction, they overlap.
    #[test]
    fn the_depth_is_the_least_way_out() {
        let mut random = Random(0x0BAD_5EED_1234_5678);
        let shapes = [
            Shape::cylinder(0.7, 0.4).unwrap(),
            Shape::cone(0.6, 0.5).unwrap(),
            Shape::ellipsoid(Vec3::new(0.3, 0.9, 0.5)).unwrap(),
            Shape::cuboid(Vec3::new(0.5, 0.2, 0.8)).unwrap(),
        ];
        let mut overlaps = 0;
        for round in 0..2000 {
            let (a, b) = (Support::new(&shapes[round % 4]).unwrap(), Support::new(&shapes[round / 4 % 4]).unwrap());
            let pose = Pose::new(random.vector() * 0.8, random.rotation());
            let Some(found) = depth(&a, &b, &pose) else { continue };
            overlaps += 1;
            let moved = |d: Vec3| Pose::new(pose.position + d, pose.rotation);
            let way = (found.normal * (found.depth + 1e-4)).as_vec3();
            let out = super::super::distance::closest(&a, &b, &moved(way));
            assert!(out.is_some_and(|c| c.distance < 2e-4), "{round}: {found:?} {out:?}");
            for _ in 0..20 {
                let d = random.direction() * (0.995 * found.depth as f32 - 1e-5);
                assert!(super::super::distance::closest(&a, &b, &moved(d)).is_none_or(|c| c.distance < 1e-5));
            }
        }
        assert!(overlaps > 800, "{overlaps}");
    }
}
