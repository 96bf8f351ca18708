//! Distance of two convex shapes: the Gilbert–Johnson–Keerthi algorithm on support maps.
//!
//! Each shape is a core (a point, a segment, corners) grown by a radius. The distance of the cores is that of the
//! origin from the set of differences `x2 − x1`, which is searched with simplices of up to four of its extreme points:
//! the point `v` of the simplex closest to the origin gives the next direction, until no extreme point lies further
//! towards the origin. Sources: Gilbert, Johnson, Keerthi, "A fast procedure for computing the distance between
//! complex objects", 1988; Ericson, "Real-Time Collision Detection", 2005, chapter 5.1 (closest points of triangles
//! and tetrahedra by regions).
//!
//! The search runs in `f64` on the `f32` input: gaps of a millimetre beside corners a hundred kilometres away keep
//! their sign and direction, and the result is the same on every machine, as `f64` arithmetic is IEEE's too. The
//! witness points come from the weights of the simplex. Only the cores are compared: where they overlap, [`closest`]
//! gives `None` and the caller turns to the separating axes.

use super::cores::Core;
use super::support::Support;
use crate::math::{Pose, Real, Vec3};
use glam::{DMat3, DVec3};

mod linear_cast;
mod newton;

pub(crate) use linear_cast::{Cast, CastPoint, linear_cast};
pub(crate) use newton::{Settled, tangents};

/// Cores closer than this share of their size overlap: beyond it the direction is rounding.
const TOUCHING: f64 = 1e-9;
/// A tetrahedron is flat where a corner is over the opposite face at a smaller sine than this: corners of boxes and
/// prisms often lie on one plane but for rounding.
const FLAT: f64 = 1e-10;
/// The search ends when a new extreme point gains less than this share of the distance.
const GAIN: f64 = 1e-12;
/// Round cores come closer by ever less (unless Newton's method works): the direction is good to three hundred
/// thousandths then.
const ROUND_GAIN: f64 = 1e-9;
/// With the shapes moved, as it is done once more from there.
const LIFTED_GAIN: f64 = 1e-8;
/// The rounds before which round cores are tried with Newton's method, from the direction reached.
const TRIES: [usize; 4] = [3, 6, 10, 20];
/// Polyhedra of 255 corners need less than 20 rounds; the cap is for rounding that goes in circles.
const MAX_ROUNDS: usize = 64;

/// The closest points of two cores that are apart, in the frame of shape 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Closest {
    /// On the core of shape 1.
    pub point1: Vec3,
    /// On the core of shape 2.
    pub point2: Vec3,
    /// Unit vector from `point1` to `point2`.
    pub normal: Vec3,
    /// Distance of the cores (take off the radii for that of the shapes), metres.
    pub distance: Real,
}

/// An extreme point of the difference `x2 − x1`, and where on shape 1 it comes from.
#[derive(Clone, Copy, Default)]
pub(crate) struct Corner {
    pub(crate) difference: DVec3,
    pub(crate) point1: DVec3,
}

/// Up to four corners and the weights that make the point closest to the origin.
#[derive(Default)]
pub(crate) struct Simplex {
    corners: [Corner; 4],
    weights: [f64; 4],
    count: usize,
    /// The last direction looked against.
    direction: DVec3,
}

/// Closest points of two cores, `pose` placing shape 2 in the frame of shape 1; `None` where the cores overlap.
pub(crate) fn closest(shape1: &Support, shape2: &Support, pose: &Pose) -> Option<Closest> {
    let placed = Placed::new(shape1, shape2, pose);
    let Nearness::Gap(Gap { point1, way }) = placed.nearness(f64::INFINITY) else {
        return None;
    };
    let distance = way.length();
    Some(Closest {
        point1: point1.as_vec3(),
        point2: (point1 + way).as_vec3(),
        normal: unit(way / distance),
        distance: distance as Real,
    })
}

/// The closest points of two cores as found, not rounded.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Gap {
    /// On the core of shape 1.
    pub(crate) point1: DVec3,
    /// From there to the core of shape 2; never zero.
    pub(crate) way: DVec3,
}

/// How two cores lie.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Nearness {
    /// Farther apart than was asked for.
    Beyond,
    Gap(Gap),
    Overlap,
}

/// The search for [`closest`], given up once a direction shows a gap beyond `limit`; `start` points from shape 1 to
/// shape 2 and is not zero; `shift` is added to the position of shape 2. The simplex is left as it was last.
fn search(placed: &Placed<'_>, limit: f64, (start, shift): (DVec3, DVec3), simplex: &mut Simplex) -> Nearness {
    let gain = if !placed.round {
        GAIN
    } else if shift == DVec3::ZERO {
        ROUND_GAIN
    } else {
        LIFTED_GAIN
    };
    let mut v = start;
    let mut point1 = DVec3::ZERO;
    let mut size = 0.0;
    let mut shortest = f64::MAX;
    // Whether some direction has shown a gap: without one, a search that ends by rounding ends inside.
    let mut apart = false;
    simplex.count = 0;
    for round in 0..MAX_ROUNDS {
        if placed.round && apart && TRIES.contains(&round) {
            match placed.settle(v.normalize(), shift, limit, |aside, height| aside <= gain * height * height) {
                Settled::Beyond => return Nearness::Beyond,
                Settled::At { corner, normal, height, .. } if height < 0.0 => {
                    return Nearness::Gap(Gap { point1: corner.point1, way: normal * -height });
                }
                _ => {}
            }
        }
        let mut corner = placed.corner(-v);
        corner.difference += shift;
        let w = corner.difference;
        simplex.direction = v;
        size = larger(size, w.length_squared());
        let squared = v.length_squared();
        let along = v.dot(w);
        if along > 0.0 {
            apart = true;
            if along * along > limit * limit * squared {
                return Nearness::Beyond;
            }
        }
        if simplex.count > 0 && (squared - along <= gain * squared || simplex.has(w)) {
            break;
        }
        simplex.push(corner);
        let Some(mut feature) = simplex.nearest_feature(true) else {
            if along > 0.0 {
                break; // All corners are on one side of the origin: a tetrahedron that holds it is flat, and rounding.
            }
            return Nearness::Overlap;
        };
        if feature.squared >= shortest {
            // Of corners that almost coincide the regions are rounding: the nearest of all faces, edges and corners is
            // not.
            feature = simplex.nearest_of_all();
        }
        if feature.squared >= shortest {
            break;
        }
        simplex.keep(&feature);
        if feature.squared <= TOUCHING * TOUCHING * size {
            return Nearness::Overlap;
        }
        (v, point1, shortest) = (feature.point, simplex.witness(), feature.squared);
    }
    if apart { Nearness::Gap(Gap { point1, way: v }) } else { Nearness::Overlap }
}

/// To `f32`, still of unit length.
fn unit(v: DVec3) -> Vec3 {
    v.as_vec3()
}

pub(crate) fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// Two shapes and the placement of the second one.
pub(crate) struct Placed<'a> {
    shapes: [&'a Support<'a>; 2],
    cores: [Core<'a>; 2],
    rotation: DMat3,
    position: DVec3,
    round: bool,
}

impl<'a> Placed<'a> {
    pub(crate) fn new(shape1: &'a Support<'a>, shape2: &'a Support<'a>, pose: &Pose) -> Self {
        let m = pose.rotation.to_mat3();
        let rotation = DMat3::from_cols(m.x_axis.as_dvec3(), m.y_axis.as_dvec3(), m.z_axis.as_dvec3());
        Self {
            shapes: [shape1, shape2],
            cores: [Core::new(shape1), Core::new(shape2)],
            rotation,
            position: pose.position.as_dvec3(),
            round: shape1.has_round_core() || shape2.has_round_core(),
        }
    }

    /// Whether one of the shapes has a round core, so that no few corners make their difference.
    pub(crate) fn is_round(&self) -> bool {
        self.round
    }

    pub(crate) fn cores(&self) -> &[Core<'a>; 2] {
        &self.cores
    }

    /// The smaller of the shapes' sizes.
    pub(crate) fn size(&self) -> f64 {
        let [a, b] = self.shapes.map(Support::size);
        f64::from(if a < b { a } else { b })
    }

    /// Whether shape 2 is the smaller one.
    pub(crate) fn is_second_smaller(&self) -> bool {
        let [a, b] = self.shapes.map(Support::size);
        b < a
    }

    /// Where shape 2 is.
    pub(crate) fn position(&self) -> DVec3 {
        self.position
    }

    /// The closest points, unless the cores are apart by more than `limit` (zero or more) or overlap.
    pub(crate) fn nearness(&self, limit: f64) -> Nearness {
        self.nearness_by(limit, &mut Simplex::default())
    }

    /// As [`Placed::nearness`]; where the cores overlap, `simplex` tells which corners show it.
    pub(crate) fn nearness_by(&self, limit: f64, simplex: &mut Simplex) -> Nearness {
        let start = if self.position.length_squared() == 0.0 { DVec3::X } else { self.position };
        search(self, limit, (start, DVec3::ZERO), simplex)
    }

    /// The closest points with shape 2 moved by `way`, if that is enough for a gap.
    pub(crate) fn gap_after(&self, way: DVec3) -> Option<Gap> {
        let nearness = search(self, f64::INFINITY, (way, way), &mut Simplex::default());
        if let Nearness::Gap(gap) = nearness { Some(gap) } else { None }
    }

    /// How far the surfaces are from the cores.
    pub(crate) fn radii(&self) -> [f64; 2] {
        self.shapes.map(|shape| shape.radius().into())
    }

    /// Puts a point of shape 2 into the frame of shape 1.
    pub(crate) fn place(&self, point: DVec3) -> DVec3 {
        let m = &self.rotation;
        m.x_axis * point.x + m.y_axis * point.y + m.z_axis * point.z + self.position
    }

    /// Turns a direction of shape 2 into the frame of shape 1.
    pub(crate) fn turn(&self, direction: DVec3) -> DVec3 {
        let m = &self.rotation;
        m.x_axis * direction.x + m.y_axis * direction.y + m.z_axis * direction.z
    }

    /// Turns a direction of the frame of shape 1 into that of shape 2.
    #[inline]
    pub(crate) fn turn_back(&self, direction: DVec3) -> DVec3 {
        let m = &self.rotation;
        DVec3::new(m.x_axis.dot(direction), m.y_axis.dot(direction), m.z_axis.dot(direction))
    }

    /// The extreme point of the difference along `direction`.
    pub(crate) fn corner(&self, direction: DVec3) -> Corner {
        let point1 = self.cores[0].support(-direction);
        let point2 = self.place(self.cores[1].support(self.turn_back(direction)));
        Corner { difference: point2 - point1, point1 }
    }
}

impl Simplex {
    /// Its corners.
    pub(crate) fn corners(&self) -> &[Corner] {
        &self.corners[..self.count]
    }

    /// The last direction, from shape 1 to shape 2, along which a corner was looked for; of any length.
    pub(crate) fn direction(&self) -> DVec3 {
        self.direction
    }

    fn push(&mut self, corner: Corner) {
        self.corners[self.count] = corner;
        self.count += 1;
    }

    fn has(&self, difference: DVec3) -> bool {
        self.corners().iter().any(|c| c.difference == difference)
    }

    /// The point that the weights make.
    fn point(&self) -> DVec3 {
        let mut sum = DVec3::ZERO;
        for k in 0..self.count {
            sum += self.corners[k].difference * self.weights[k];
        }
        sum
    }

    /// The point of shape 1 that the weights make.
    fn witness(&self) -> DVec3 {
        let mut sum = DVec3::ZERO;
        for k in 0..self.count {
            sum += self.corners[k].point1 * self.weights[k];
        }
        sum
    }

    #[inline(always)]
    fn differences<const N: usize>(&self, at: [usize; N]) -> [DVec3; N] {
        at.map(|k| self.corners[k].difference)
    }

    /// The face, edge or corner closest to the origin; `None` if it is inside. `settled` as for
    /// [`closest_on_tetrahedron`].
    #[inline(always)]
    fn nearest_feature(&self, settled: bool) -> Option<Feature> {
        match self.count {
            1 => Some(Feature::corner(0, self.corners[0].difference)),
            2 => Some(closest_on_segment(self.differences([0, 1]), [0, 1])),
            3 => Some(closest_on_triangle(self.differences([0, 1, 2]), [0, 1, 2])),
            _ => closest_on_tetrahedron(&self.differences([0, 1, 2, 3]), settled),
        }
    }

    /// As [`Simplex::nearest_feature`] for an origin outside, by trying all of them: slower, but no rounding makes it
    /// farther than any of them.
    #[cold]
    fn nearest_of_all(&self) -> Feature {
        let mut best = Feature::corner(0, self.corners[0].difference);
        let mut offer = |feature: Feature| {
            if feature.squared < best.squared {
                best = feature;
            }
        };
        for a in 0..self.count {
            offer(Feature::corner(a, self.corners[a].difference));
            for b in a + 1..self.count {
                offer(closest_on_segment(self.differences([a, b]), [a, b]));
                for c in b + 1..self.count {
                    offer(closest_on_triangle(self.differences([a, b, c]), [a, b, c]));
                }
            }
        }
        best
    }

    /// Keeps the corners of the feature closest to the origin; false if that is inside.
    fn reduce(&mut self) -> bool {
        let feature = self.nearest_feature(false);
        if let Some(feature) = &feature {
            self.keep(feature);
        }
        feature.is_some()
    }

    /// Drops the corners that are not part of a feature and takes over its weights.
    #[inline(always)]
    fn keep(&mut self, feature: &Feature) {
        let corners = self.corners;
        for k in 0..3 {
            self.corners[k] = corners[feature.at[k] & 3];
            self.weights[k] = feature.weights[k];
        }
        self.count = feature.count;
    }
}

/// A corner, an edge or a face of a simplex with its point closest to the origin.
#[derive(Clone, Copy)]
struct Feature {
    /// Which corners; past the count anything.
    at: [usize; 3],
    weights: [f64; 3],
    count: usize,
    point: DVec3,
    /// Square of the point's distance.
    squared: f64,
}

impl Feature {
    #[inline(always)]
    fn new(at: [usize; 3], weights: [f64; 3], count: usize, point: DVec3) -> Self {
        Self { at, weights, count, point, squared: point.length_squared() }
    }

    #[inline(always)]
    fn corner(at: usize, point: DVec3) -> Self {
        Self::new([at; 3], [1.0, 0.0, 0.0], 1, point)
    }
}

#[inline(always)]
fn closest_on_segment([p, q]: [DVec3; 2], [a, b]: [usize; 2]) -> Feature {
    let way = q - p;
    let along = -p.dot(way);
    let squared = way.length_squared();
    if along <= 0.0 {
        Feature::corner(a, p)
    } else if along >= squared {
        Feature::corner(b, q)
    } else {
        let t = along / squared;
        Feature::new([a, b, b], [1.0 - t, t, 0.0], 2, p * (1.0 - t) + q * t)
    }
}

/// The weights of the origin's projection are the areas of the triangles that it makes with the sides. Where one is not
/// positive the closest point is on that side, or on the closest of those.
#[inline]
fn closest_on_triangle([p, q, r]: [DVec3; 3], [a, b, c]: [usize; 3]) -> Feature {
    let n = (q - p).cross(r - p);
    let u = q.cross(r).dot(n);
    let v = r.cross(p).dot(n);
    let w = p.cross(q).dot(n);
    let sum = u + v + w;
    if u > 0.0 && v > 0.0 && w > 0.0 && sum > 0.0 {
        let weights = [u / sum, v / sum, w / sum];
        return Feature::new([a, b, c], weights, 3, p * weights[0] + q * weights[1] + r * weights[2]);
    }
    let mut best = Feature { squared: f64::INFINITY, ..Feature::corner(a, p) };
    let mut offer = |feature: Feature| {
        if feature.squared < best.squared {
            best = feature;
        }
    };
    if w <= 0.0 {
        offer(closest_on_segment([p, q], [a, b]));
    }
    if u <= 0.0 {
        offer(closest_on_segment([q, r], [b, c]));
    }
    if v <= 0.0 {
        offer(closest_on_segment([r, p], [c, a]));
    }
    if best.squared == f64::INFINITY {
        // All areas are above zero, but not their sum: no number is.
        best.squared = p.length_squared();
    }
    best
}

/// `None` if the origin is inside. If the last corner was looked for from the face of the others, the origin is on the
/// same side of that face: it is `settled`.
#[inline(always)]
fn closest_on_tetrahedron(p: &[DVec3; 4], settled: bool) -> Option<Feature> {
    let mut best: Option<Feature> = None;
    let faces = [[0, 1, 3, 2], [0, 2, 3, 1], [1, 2, 3, 0], [0, 1, 2, 3]];
    for [a, b, c, opposite] in faces.into_iter().take(if settled { 3 } else { 4 }) {
        let n = (p[b] - p[a]).cross(p[c] - p[a]);
        let (up, inside) = (p[opposite] - p[a], n.dot(p[opposite] - p[a]));
        let origin = -n.dot(p[a]);
        // The origin is beyond this face, or the tetrahedron is flat (then the sign is rounding) and all its faces
        // count.
        let is_flat = inside * inside <= FLAT * FLAT * n.length_squared() * up.length_squared();
        if is_flat || (inside > 0.0) != (origin > 0.0) {
            let feature = closest_on_triangle([p[a], p[b], p[c]], [a, b, c]);
            if best.is_none_or(|best| feature.squared < best.squared) {
                best = Some(feature);
            }
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::super::{Capsule, Cuboid, Sphere};
    use super::*;
    use crate::math::Rotation;
    use crate::random::Random;

    fn gap(a: &Support, b: &Support, pose: &Pose) -> Option<Closest> {
        let found = closest(a, b, pose);
        let swapped = closest(b, a, &pose.inverse());
        assert_eq!(found.is_none(), swapped.is_none());
        if let (Some(x), Some(y)) = (found, swapped) {
            assert!((x.distance - y.distance).abs() < 1e-5 * (1.0 + x.distance));
        }
        found
    }

    /// Corners 100 km away, a gap of a millimetre: neither is lost.
    #[test]
    fn a_small_gap_beside_large_coordinates_is_exact() {
        let far = Support::Triangle([
            Vec3::new(1e5, 0.001, -1e5),
            Vec3::new(-1.3e5, 0.001, -1e5),
            Vec3::new(0.0, 0.001, 1.7e5),
        ]);
        let point = Support::Sphere(Sphere::new(1.0).unwrap());
        let found = gap(&point, &far, &Pose::IDENTITY).unwrap();
        assert!((found.distance - 0.001).abs() < 1e-9, "{found:?}");
        assert!((found.point2 - Vec3::new(0.0, 0.001, 0.0)).length() < 1e-9, "{found:?}");
        assert!((found.normal - Vec3::Y).length() < 1e-7);
        let floor = Support::Cuboid(Cuboid::new(Vec3::new(4000.0, 0.5, 4000.0)).unwrap());
        for height in [0.0005, 0.002, 0.02] {
            for k in 0..25 {
                let at = Vec3::new(150.0 * (k % 5) as Real, 0.5 + height, -770.0 * (k / 5) as Real);
                let found = gap(&floor, &point, &Pose::from_position(at)).unwrap();
                assert!((found.distance - (at.y - 0.5)).abs() < 1e-9 && (found.normal - Vec3::Y).length() < 1e-6);
            }
        }
    }

    /// Closest points on boxes against projecting back and forth between them, which converges slowly but surely.
    #[test]
    fn boxes_are_as_far_apart_as_alternating_projections_find() {
        let mut random = Random(0x1357_9BDF_2468_ACE1);
        let mut apart = 0;
        for _ in 0..2000 {
            let half = |r: &mut Random| Vec3::new(r.between(0.1, 1.0), r.between(0.1, 1.0), r.between(0.1, 1.0));
            let (h1, h2) = (half(&mut random), half(&mut random));
            let pose = Pose::new(random.vector() * 3.0, random.rotation());
            let (a, b) = (Support::Cuboid(Cuboid::new(h1).unwrap()), Support::Cuboid(Cuboid::new(h2).unwrap()));
            let m = pose.rotation.to_mat3();
            let m = DMat3::from_cols(m.x_axis.as_dvec3(), m.y_axis.as_dvec3(), m.z_axis.as_dvec3());
            let (t, h1, h2) = (pose.position.as_dvec3(), h1.as_dvec3(), h2.as_dvec3());
            let mut p = DVec3::ZERO;
            let mut q = t;
            for _ in 0..20_000 {
                q = t + m * (m.transpose() * (p - t)).clamp(-h2, h2);
                let next = q.clamp(-h1, h1);
                let done = (next - p).length() < 1e-12;
                p = next;
                if done {
                    break;
                }
            }
            let expected = (q - p).length();
            match gap(&a, &b, &pose) {
                Some(found) => {
                    apart += 1;
                    assert!((f64::from(found.distance) - expected).abs() < 1e-4, "{found:?} {expected}");
                    assert!(((found.point2 - found.point1).length() - found.distance).abs() < 1e-5);
                    assert!((found.normal.length() - 1.0).abs() < 1e-6);
                }
                None => assert!(expected < 1e-3, "{expected}"),
            }
        }
        assert!(apart > 1000);
    }

    #[test]
    fn known_distances() {
        let cube = Support::Cuboid(Cuboid::new(Vec3::splat(0.5)).unwrap());
        let ball = Support::Sphere(Sphere::new(1.0).unwrap());
        let tilted = Pose::new(Vec3::new(0.0, 3.0, 0.0), Rotation::from_xyzw(0.1, 0.0, 0.0, 1.0).normalize());
        let found = gap(&cube, &ball, &tilted).unwrap();
        assert!((found.distance - ball.radius() - 1.5).abs() < 1e-6);
        assert!((found.point1 - Vec3::new(0.0, 0.5, 0.0)).length() < 1e-6);
        assert!(gap(&cube, &ball, &Pose::from_position(Vec3::new(0.0, 0.4, 0.0))).is_none());
        // Crossed rods touch nowhere; coincident points and coplanar, crossing triangles overlap.
        let rod = Support::Capsule(Capsule::new(1.0, 0.1).unwrap());
        let crossed = Pose::new(Vec3::new(0.0, 0.0, 0.3), Rotation::from_xyzw(0.0, 0.0, 1.0, 1.0).normalize());
        assert!((gap(&rod, &rod, &crossed).unwrap().distance - 0.3).abs() < 1e-6);
        assert!(gap(&rod, &rod, &Pose::IDENTITY).is_none() && gap(&ball, &ball, &Pose::IDENTITY).is_none());
        let triangle = Support::Triangle([Vec3::ZERO, Vec3::X, Vec3::Y]);
        assert!(gap(&triangle, &triangle, &Pose::from_position(Vec3::new(0.2, 0.1, 0.0))).is_none());
    }
}
