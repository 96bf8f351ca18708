//! How deep two convex cores overlap, and along which normal.
//!
//! The cores overlap where the origin is inside the set of differences `x1 − x2`. Its height along a unit vector `n`,
//! the largest `n · (x1 − x2)`, is how far shape 2 has to move along `n` to part from shape 1; the least of all heights
//! is the depth.
//!
//! Of polyhedra it is found by the expanding polytope: one inside the set grows, the face nearest to the origin being
//! replaced by those to the set's farthest point along its normal, until that is no farther than the face. Source: van
//! den Bergen, "Proximity Queries and Penetration Depth Computation on 3D Game Objects", 2001. Unlike there, the first
//! tetrahedron need not hold the origin: a face that the origin is in front of has a negative distance and so comes
//! first.
//!
//! Round sets would need many corners for that. They are searched the other way round:
//!
//! 1. The lowest of some heights: along the line of centres, the faces that look at each other, the last direction in
//!    which the closest points were looked for.
//! 2. Moved just apart along that direction, the closest points give a better one, which is never higher and soon the
//!    lowest around: the normal of a round surface turns by less than the position that it is looked at from
//!    (`polished`).
//! 3. That no other way out is shorter, far from it, is proved. A point that is `a` deep in core 1 and `b` deep in core
//!    2 (balls of these radii around it fit in) shows that the set of differences holds a ball of radius `a + b` about
//!    the origin, so that nothing is lower. Where the deepest points show that, nothing is left to do (`is_proved`).
//! 4. Else the polytope grows until all of its faces are as far as the height found, but for a tolerance. A face that
//!    is not and whose own height is lower begins anew at 2.
//!
//! All in `f64`, as in `distance`.

use crate::shape::cores::smaller;
use crate::shape::distance::{Gap, Placed, Settled, Simplex, larger, tangents};
use glam::DVec3;

/// A face is on the boundary if the set reaches past it by less than this share of the size.
const GAIN: f64 = 1e-7;
/// Of round sets no way out is shorter than the one found by more than this share of the smaller shape's size,
const ROUND_GAIN: f64 = 1e-5;
/// and this share of the depth,
const ROUND_SHARE: f64 = 5e-6;
/// but no less than this share of the set's size.
const ROUNDING: f64 = 1e-9;
/// What is thinner than this share of its size is flat.
const FLAT: f64 = 1e-9;
/// Around the way out the set is known from directions that lean by this tangent: as far as its smooth part stays
/// within the tolerance of the triangle between them.
const RING_LEAN: f64 = 4e-3;
const RING: [(f64, f64); 3] = [(1.0, 0.0), (-0.5, 0.866_025_403_784), (-0.5, -0.866_025_403_784)];
/// A tetrahedron to begin with has at least six times this share of the cube of its shortest edge as its volume.
const THICK: f64 = 1e-3;
/// A triangle is a sliver if twice its area is less than this share of the square of its longest edge.
const SLIVER: f64 = 1e-10;
/// Corners that most pairs get by with, and at most. A polyhedron of `n` corners has `2n − 4` faces.
const FEW_CORNERS: usize = 20;
const FEW_FACES: usize = 2 * FEW_CORNERS - 4;
const MAX_CORNERS: usize = 96;
const MAX_FACES: usize = 2 * MAX_CORNERS - 4;
const MAX_HORIZON: usize = 64;
/// How far beyond touching the shapes are moved apart to see the way out better, as a share of the smaller size.
const LIFT: f64 = 5e-2;
/// Times that is done at most,
const POLISHINGS: usize = 4;
/// and as long as it gains this share of the smaller size.
const POLISH_GAIN: f64 = 1e-6;

/// Points that ought to touch are opposite each other within this share of the smaller size.
const ASIDE: f64 = 1e-3;
/// Unit vectors whose dot product is less than one by no more than this tell the same way.
const SAME_WAY: f64 = 1e-6;

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

/// A growing polytope with room for some corners and faces.
struct Polytope<const C: usize, const F: usize> {
    corners: [Corner; C],
    corner_count: usize,
    faces: [Face; F],
    face_count: usize,
}

/// A way out with the points of both cores that touch at last.
#[derive(Clone, Copy)]
struct Way {
    found: Penetration,
    /// A point of core 2 deep in core 1, `depth` behind `point1` but for what is left to polish.
    point2: DVec3,
    /// The farthest point of core 1 along the normal, and that of core 2 against it.
    touching: [DVec3; 2],
}

/// Overlap of two cores that are not apart, as the search with `simplex` has told.
pub(super) fn penetration(placed: &Placed<'_>, simplex: &Simplex) -> Penetration {
    if placed.is_round() {
        return round_penetration(placed, simplex);
    }
    let few = grow::<FEW_CORNERS, FEW_FACES>(placed, simplex, None);
    few.or_else(|| grow::<MAX_CORNERS, MAX_FACES>(placed, simplex, None))
        .map_or_else(|| along(placed, toward(placed)).found, |way| way.found)
}

fn round_penetration(placed: &Placed<'_>, simplex: &Simplex) -> Penetration {
    let size = placed.size();
    let way = polished(placed, shallowest(placed, simplex), size);
    let tolerance = ROUND_GAIN * size + ROUND_SHARE * way.found.depth;
    if is_proved(placed, &way, tolerance) {
        return way.opposite(placed, size);
    }
    let goal = Goal { way, size, tolerance };
    let few = grow::<FEW_CORNERS, FEW_FACES>(placed, simplex, Some(&goal));
    few.or_else(|| grow::<MAX_CORNERS, MAX_FACES>(placed, simplex, Some(&goal))).unwrap_or(way).opposite(placed, size)
}

impl Way {
    /// What was found. Where the closest points did not help (the support of a large shape in single precision is too
    /// coarse for a small one beside it), farthest points of both cores can lie far aside from each other: the smaller
    /// shape's counts.
    fn opposite(self, placed: &Placed<'_>, size: f64) -> Penetration {
        let Penetration { point1, normal, depth } = self.found;
        let other = self.point2 + normal * depth;
        let aside = (point1 - other).length_squared() > ASIDE * ASIDE * size * size;
        Penetration { point1: if aside && placed.is_second_smaller() { other } else { point1 }, ..self.found }
    }
}

/// The way out that has to be proved the shortest.
struct Goal {
    way: Way,
    size: f64,
    tolerance: f64,
}

/// From one centre to the other.
fn toward(placed: &Placed<'_>) -> DVec3 {
    let [core1, core2] = placed.cores();
    (placed.place(core2.middle()) - core1.middle()).normalize_or(DVec3::Y)
}

/// The expanding polytope; `None` if there is no room for all that it needs. Of polyhedra it finds the least way out,
/// of round cores it proves that none is shorter than the goal, or finds one.
fn grow<const C: usize, const F: usize>(placed: &Placed<'_>, simplex: &Simplex, goal: Option<&Goal>) -> Option<Way> {
    let corner = |direction: DVec3| {
        let corner = placed.corner(-direction);
        Corner { difference: -corner.difference, point1: corner.point1 }
    };
    let first = match tetrahedron(simplex).map_or_else(|| first_corners(&corner), Ok) {
        Ok(first) => first,
        Err((normal, on_plane)) => {
            let found = flat_penetration(normal, on_plane);
            return Some(Way { found, ..along(placed, found.normal) });
        }
    };
    let size = first.iter().fold(0.0, |size: f64, c| larger(c.difference.length_squared(), size)).sqrt();
    let rounding = ROUNDING * size;
    let mut polytope = Polytope::<C, F>::new(first);
    if let Some(goal) = goal {
        let normal = goal.way.found.normal;
        let [t1, t2] = tangents(normal);
        for (along1, along2) in RING {
            let direction = normal + (t1 * along1 + t2 * along2) * RING_LEAN;
            polytope.take_in(corner(direction.normalize()), rounding);
        }
    }
    // The least depth seen, for a search that has to be given up.
    let mut best = goal.map_or_else(|| along(placed, toward(placed)), |goal| goal.way);
    let gain = goal.map_or(GAIN * size, |goal| larger(0.5 * goal.tolerance, rounding));
    loop {
        let nearest = polytope.nearest_face()?;
        let face = polytope.faces[nearest];
        if goal.is_some_and(|goal| face.offset >= best.found.depth - larger(goal.tolerance, rounding)) {
            return Some(best);
        }
        let reached = corner(face.normal);
        let height = reached.difference.dot(face.normal);
        match goal {
            Some(goal) if height < best.found.depth - gain => {
                let lower = polished(placed, along(placed, face.normal), goal.size);
                if lower.found.depth < best.found.depth {
                    best = lower;
                }
                if best.found.depth - gain <= face.offset {
                    return Some(best);
                }
            }
            Some(_) => {}
            None if height - face.offset <= gain => {
                let found = polytope.result(&face, height);
                return Some(Way { found, ..best });
            }
            None if height < best.found.depth => best = along(placed, face.normal),
            None => {}
        }
        if height - face.offset <= rounding {
            // Nothing is beyond this face, and all others are farther.
            return Some(best);
        }
        if !polytope.expand(nearest, reached) {
            return if C == MAX_CORNERS { Some(best) } else { None };
        }
    }
}

/// How far the cores overlap along a unit direction.
fn along(placed: &Placed<'_>, normal: DVec3) -> Way {
    let corner = placed.corner(-normal);
    let (point1, point2) = (corner.point1, corner.point1 + corner.difference);
    let found = Penetration { point1, normal, depth: -corner.difference.dot(normal) };
    Way { found, point2, touching: [point1, point2] }
}

/// The least overlap along some directions.
fn shallowest(placed: &Placed<'_>, simplex: &Simplex) -> Way {
    let [core1, core2] = placed.cores();
    let [middle1, middle2] = [core1.middle(), placed.place(core2.middle())];
    let mut best = along(placed, (middle2 - middle1).normalize_or(DVec3::Y));
    let mut offer = |direction: DVec3| {
        let way = along(placed, direction);
        if way.found.depth < best.found.depth {
            best = way;
        }
    };
    if let Some(last) = simplex.direction().try_normalize() {
        offer(last);
    }
    if let Some((normal, _)) = core1.face_towards(middle2) {
        offer(normal);
    }
    if let Some((normal, _)) = core2.face_towards(placed.turn_back(middle1 - placed.position())) {
        offer(-placed.turn(normal));
    }
    best
}

/// The same way out, seen from a little farther: with the shapes moved just apart along the normal found, the closest
/// points tell the true one the better the shallower the overlap is, because the normal of a round surface turns by
/// less than the position that it is looked at from.
fn polished(placed: &Placed<'_>, from: Way, size: f64) -> Way {
    let (mut best, lift) = (from, LIFT * size);
    let aligned = POLISH_GAIN * size;
    let settled = placed.settle(from.found.normal, DVec3::ZERO, f64::INFINITY, |aside, _| aside <= aligned * aligned);
    if let Settled::At { corner, normal, height, .. } = settled
        && height <= from.found.depth
    {
        let (point1, point2) = (corner.point1, corner.point1 + corner.difference);
        return Way { found: Penetration { point1, normal, depth: height }, point2, touching: [point1, point2] };
    }
    for _ in 0..POLISHINGS {
        let Penetration { normal, depth, .. } = best.found;
        let shift = normal * (depth + lift);
        let Some(Gap { point1, way }) = placed.gap_after(shift) else { break };
        let mut next = along(placed, way / way.length());
        (next.found.point1, next.point2) = (point1, point1 + way - shift);
        let gained = depth - next.found.depth;
        if gained >= 0.0 {
            best = next;
        } else if next.found.normal.dot(normal) > 1.0 - SAME_WAY {
            // The same but for rounding: of a line or a face, any corner was the deepest point so far.
            (best.found.point1, best.point2) = (next.found.point1, next.point2);
        }
        if gained <= POLISH_GAIN * size {
            break;
        }
    }
    best
}

/// Whether the points that touch show that no way out is shorter: a point `a` deep in core 1 and `b` deep in core 2 is
/// the middle of a ball of radius `a + b` in the set of differences.
fn is_proved(placed: &Placed<'_>, way: &Way, tolerance: f64) -> bool {
    let [core1, core2] = placed.cores();
    let Penetration { point1, normal, depth } = way.found;
    let inner1 = |point: DVec3| core1.inner_depth(point, way.touching[0], normal);
    let local = |point: DVec3| placed.turn_back(point - placed.position());
    let (touching2, back) = (local(way.touching[1]), placed.turn_back(-normal));
    let inner2 = |point: DVec3| core2.inner_depth(local(point), touching2, back);
    let wanted = depth - tolerance;
    if inner1(way.point2) >= wanted || inner2(point1) >= wanted {
        return true;
    }
    let middle = (point1 + way.point2) * 0.5;
    let (a, b) = (inner1(middle), inner2(middle));
    a >= 0.0 && b >= 0.0 && a + b >= wanted
}

/// The corners of a search that ended in a tetrahedron around the origin, if it is not flat.
fn tetrahedron(simplex: &Simplex) -> Option<[Corner; 4]> {
    let corners: &[_; 4] = simplex.corners().try_into().ok()?;
    let first = corners.map(|c| Corner { difference: -c.difference, point1: c.point1 });
    let [a, b, c] = [1, 2, 3].map(|k| first[k].difference - first[0].difference);
    let normal = a.cross(b);
    let longest = smaller(smaller(a.length_squared(), b.length_squared()), c.length_squared());
    (normal.dot(c).abs() > THICK * longest * longest.sqrt()).then_some(first)
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

impl<const C: usize, const F: usize> Polytope<C, F> {
    fn new(first: [Corner; 4]) -> Self {
        let none = Corner { difference: DVec3::ZERO, point1: DVec3::ZERO };
        let dead = Face { corners: [0; 3], normal: DVec3::ZERO, offset: 0.0 };
        let mut polytope = Self { corners: [none; C], corner_count: 4, faces: [dead; F], face_count: 0 };
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

    /// Takes in a corner if it is outside by more than rounding.
    fn take_in(&mut self, corner: Corner, rounding: f64) {
        let (mut seeing, mut farthest) = (None, rounding);
        for (index, face) in self.faces[..self.face_count].iter().enumerate() {
            let above = face.normal.dot(corner.difference) - face.offset;
            if above > farthest {
                (seeing, farthest) = (Some(index), above);
            }
        }
        if let Some(seeing) = seeing {
            self.expand(seeing, corner);
        }
    }

    /// Takes in a corner that a face sees; false if there is no room for it.
    ///
    /// What goes is the connected patch of faces that see the corner: among flat faces rounding would have others see
    /// it too, here and there.
    fn expand(&mut self, seen: usize, corner: Corner) -> bool {
        let mut outline = Outline { edges: [[0; 2]; MAX_HORIZON], count: 0 };
        if self.corner_count == C || !outline.cross(self.faces[seen].corners) {
            return false;
        }
        // Those that see the corner, the patch first.
        let mut patch = [seen as u16; F];
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
        if self.face_count - patch_count + outline.count > F {
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
    use crate::random::Random;
    use crate::shape::Support;
    use crate::shape::distance::Nearness;
    use crate::shape::{Cuboid, Cylinder, Shape};

    fn depth(a: &Support<'_>, b: &Support<'_>, pose: &Pose) -> Option<Penetration> {
        let pairs = [Placed::new(a, b, pose), Placed::new(b, a, &pose.inverse())];
        let [found, swapped] = pairs.map(|pair| {
            let mut simplex = Simplex::default();
            let overlap = matches!(pair.nearness_by(f64::INFINITY, &mut simplex), Nearness::Overlap);
            overlap.then(|| penetration(&pair, &simplex))
        });
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
            let out = crate::shape::distance::closest(&a, &b, &moved(way));
            assert!(out.is_some_and(|c| c.distance < 2e-4), "{round}: {found:?} {out:?}");
            for _ in 0..20 {
                let d = random.direction() * (0.995 * found.depth as f32 - 1e-5);
                assert!(crate::shape::distance::closest(&a, &b, &moved(d)).is_none_or(|c| c.distance < 1e-5));
            }
        }
        assert!(overlaps > 800, "{overlaps}");
    }
}
