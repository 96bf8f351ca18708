//! How deep two convex cores overlap, and along which normal: the expanding polytope algorithm.
//!
//! The cores overlap where the origin is inside the set of differences `x1 − x2`; the least motion that parts them leads
//! from the origin to the nearest point of its boundary. A polytope inside the set grows: the face nearest to the origin
//! is replaced by those to the set's farthest point along its normal, until that is no farther than the face. Source: van
//! den Bergen, "Proximity Queries and Penetration Depth Computation on 3D Game Objects", 2001.
//!
//! Unlike there, the first tetrahedron need not hold the origin: a face that the origin is in front of has a negative
//! distance and so comes first; if it cannot be moved past the origin, the cores are apart. The depth told is that along the
//! normal found, which is never less than the least one, and more by no more than [`GAIN`].
//!
//! All in `f64`, as in `distance`.

use super::distance::Placed;
use super::support::Support;
use crate::math::{Pose, Real, Vec3};
use glam::DVec3;

/// A face is on the boundary if the set reaches past it by less than this share of the size.
const GAIN: f64 = 1e-7;
/// What is thinner than this share of its size is flat.
const FLAT: f64 = 1e-9;
/// A triangle is a sliver if twice its area is less than this share of the square of its longest edge.
const SLIVER: f64 = 1e-10;
/// A polyhedron of `n` corners has `2n − 4` faces, and a corner adds two; all are kept, the dead ones too.
const MAX_CORNERS: usize = 96;
const MAX_FACES: usize = 512;
const MAX_HORIZON: usize = 64;

/// Where two overlapping cores are to be parted, in the frame of shape 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Penetration {
    /// Deepest point of the core of shape 1 in that of shape 2.
    pub point1: Vec3,
    /// Unit vector from shape 1 to shape 2: moved along it by `depth`, shape 2 only touches.
    pub normal: Vec3,
    /// Zero or more, metres.
    pub depth: Real,
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
    alive: bool,
}

/// A growing polytope.
struct Polytope {
    corners: [Corner; MAX_CORNERS],
    corner_count: usize,
    faces: [Face; MAX_FACES],
    face_count: usize,
}

/// Overlap of two cores, `pose` placing shape 2 in the frame of shape 1; `None` where they are apart.
pub(crate) fn penetration(shape1: &Support<'_>, shape2: &Support<'_>, pose: &Pose) -> Option<Penetration> {
    let placed = Placed::new(shape1, shape2, pose);
    // `Placed` gives differences `x2 − x1`.
    let corner = |direction: DVec3| {
        let corner = placed.corner(-direction);
        Corner { difference: -corner.difference, point1: corner.point1 }
    };
    let first = match first_corners(&corner) {
        Ok(first) => first,
        Err((normal, on_plane)) => return flat_penetration(normal, on_plane),
    };
    let mut polytope = Polytope::new(first);
    let size = first.iter().fold(0.0, |size: f64, c| larger(c.difference.length_squared(), size)).sqrt();
    loop {
        let nearest = polytope.nearest_face()?;
        let face = polytope.faces[nearest];
        let reached = corner(face.normal);
        let height = reached.difference.dot(face.normal);
        let done = height - face.offset <= GAIN * size;
        if done && face.offset < -GAIN * size {
            return None;
        }
        if done || !polytope.expand(nearest, reached) {
            return Some(polytope.result(&face, height));
        }
    }
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

/// Two flat cores in one plane overlap by nothing across it, if the plane is the origin's.
fn flat_penetration(normal: DVec3, on_plane: Corner) -> Option<Penetration> {
    let height = on_plane.difference.dot(normal);
    (height.abs() <= 1e-6 * (1.0 + on_plane.difference.length())).then(|| Penetration {
        point1: on_plane.point1.as_vec3(),
        normal: normal.as_vec3(),
        depth: 0.0,
    })
}

impl Polytope {
    fn new(first: [Corner; 4]) -> Self {
        let none = Corner { difference: DVec3::ZERO, point1: DVec3::ZERO };
        let dead = Face { corners: [0; 3], normal: DVec3::ZERO, offset: 0.0, alive: false };
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
        self.faces[self.face_count] = Face { corners, normal, offset, alive: true };
        self.face_count += 1;
    }

    /// The live face with the least offset, the first of several.
    fn nearest_face(&self) -> Option<usize> {
        let (mut best, mut least) = (None, f64::MAX);
        for (index, face) in self.faces[..self.face_count].iter().enumerate() {
            if face.alive && face.offset < least {
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
        let mut patch = [seen as u16; MAX_HORIZON];
        let (mut patch_count, mut grows) = (1, true);
        if self.corner_count == MAX_CORNERS || !outline.cross(self.faces[seen].corners) {
            return false;
        }
        while grows {
            grows = false;
            for (index, face) in self.faces[..self.face_count].iter().enumerate() {
                let sliver = face.offset == f64::MAX;
                let sees = face.alive && (sliver || face.normal.dot(corner.difference) > face.offset);
                if sees && outline.touches(face.corners) && !patch[..patch_count].contains(&(index as u16)) {
                    if patch_count == MAX_HORIZON || !outline.cross(face.corners) {
                        return false;
                    }
                    patch[patch_count] = index as u16;
                    patch_count += 1;
                    grows = true;
                }
            }
        }
        if self.face_count + outline.count > MAX_FACES {
            return false;
        }
        patch[..patch_count].iter().for_each(|&index| self.faces[index as usize].alive = false);
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
        Penetration { point1: point1.as_vec3(), normal: face.normal.as_vec3(), depth: larger(height, 0.0) as Real }
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
    use crate::math::Rotation;
    use crate::narrow_phase::tests::Random;
    use crate::shape::{Cuboid, Cylinder, Shape};

    fn depth(a: &Support<'_>, b: &Support<'_>, pose: &Pose) -> Option<Penetration> {
        let found = penetration(a, b, pose);
        let swapped = penetration(b, a, &pose.inverse());
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
        assert!((found.depth - 0.3).abs() < 1e-6 && (found.normal - Vec3::Y).length() < 1e-6, "{found:?}");
        assert!(depth(&cube, &cube, &Pose::from_position(Vec3::new(0.0, 2.1, 0.0))).is_none());
        let can = Support::Cylinder(Cylinder::new(1.0, 0.5).unwrap());
        let lying = Pose::new(Vec3::new(0.0, 1.45, 0.0), Rotation::from_xyzw(1.0, 0.0, 0.0, 1.0).normalize());
        let found = depth(&cube, &can, &lying).unwrap();
        assert!((found.depth - 0.05).abs() < 1e-6 && (found.normal - Vec3::Y).length() < 1e-5, "{found:?}");
        // Two balls as ellipsoids: the line of centres.
        let ball = Shape::ellipsoid(Vec3::ONE).unwrap();
        let ball = Support::new(&ball).unwrap();
        let found = depth(&ball, &ball, &Pose::from_position(Vec3::new(0.9, 1.2, 0.0))).unwrap();
        assert!((found.depth - 0.5).abs() < 1e-5, "{found:?}");
        assert!((found.normal - Vec3::new(0.6, 0.8, 0.0)).length() < 2e-3, "{found:?}");
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
            let out = super::super::distance::closest(&a, &b, &moved(found.normal * (found.depth + 1e-4)));
            assert!(out.is_some_and(|c| c.distance < 2e-4), "{round}: {found:?} {out:?}");
            for _ in 0..20 {
                let d = random.direction() * (0.995 * found.depth - 1e-5);
                assert!(super::super::distance::closest(&a, &b, &moved(d)).is_none_or(|c| c.distance < 1e-5));
            }
        }
        assert!(overlaps > 800, "{overlaps}");
    }
}
