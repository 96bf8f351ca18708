//! Every kind of convex shape against every other, held against the definition in `f64`: the separation of two convex shapes
//! is the largest gap along a direction, `max over n of (min of n · x2 − max of n · x1)`.
//!
//! The directions of a grid, the best of them refined by a search with shrinking steps, and for polyhedra all their separating
//! axes give a bound from below; the gap along the kernel's own normal, which no direction can beat by definition unless the
//! kernel is wrong, gives one from above.

use super::tests::Random;
use super::*;
use crate::math::{Mat3, Vec3, tangents};
use crate::shape::{ConvexHull, ConvexShape};
use glam::{DMat3, DVec3};

/// The upper half of a ball.
#[derive(Debug)]
struct HalfBall(Real);

impl ConvexShape for HalfBall {
    fn support(&self, direction: Vec3) -> Vec3 {
        let across = Vec3::new(direction.x, 0.0, direction.z);
        if direction.y > 0.0 { direction.normalize_or_zero() * self.0 } else { across.normalize_or_zero() * self.0 }
    }

    fn center(&self) -> Vec3 {
        Vec3::new(0.0, 0.375 * self.0, 0.0)
    }
}

const KINDS: [&str; 14] = [
    "sphere",
    "capsule",
    "cuboid",
    "hull",
    "cylinder",
    "cone",
    "tapered capsule",
    "triangle",
    "cloud",
    "rounded box",
    "rounded cylinder",
    "ellipsoid",
    "sheared cylinder",
    "half ball",
];

/// The first four have kernels of their own, which prefer faces to edges by up to a hundredth of the size.
const OLD: usize = 4;

/// A shape of a kind, about `size` large, its proportions at random up to `thin`.
fn specimen(kind: usize, size: Real, thin: Real, random: &mut Random) -> Shape {
    let mut length =
        || size * if random.unit() < 0.5 { random.between(0.3, 1.0) } else { random.between(1.0 / thin, 1.0) };
    let [a, b, c] = [length(), length(), length()];
    let half = Vec3::new(a, b, c);
    let mut points = |count: usize| -> Vec<Vec3> { (0..count).map(|_| random.direction() * half).collect() };
    match kind {
        0 => Shape::sphere(a),
        1 => Shape::capsule(a, b),
        2 => Shape::cuboid(half),
        3 => Shape::hull(&points(14)),
        4 => Shape::cylinder(a, b),
        5 => Shape::cone(a, b),
        6 => Shape::tapered_capsule(0.6 * (a - b).abs() + 0.2 * c, a, b),
        7 => Shape::triangle([Vec3::ZERO, Vec3::new(a, 0.1 * b, 0.0), Vec3::new(0.3 * a, b, c)]),
        8 => Shape::point_cloud(&points(11)),
        9 => Shape::rounded(&Shape::cuboid(half).unwrap(), 0.3 * c),
        10 => Shape::rounded(&Shape::cylinder(a, b).unwrap(), 0.2 * c),
        11 => Shape::ellipsoid(half),
        12 => Shape::cylinder(a, b).unwrap().transformed(
            Mat3::from_cols(Vec3::X, Vec3::new(0.4, 0.9, -0.2), Vec3::Z * 0.7),
            Vec3::new(0.1, 0.2, -0.1) * size,
        ),
        _ => Shape::custom(HalfBall(a)),
    }
    .unwrap()
}

/// Two shapes as the definition sees them.
struct Pair<'a> {
    support1: Support<'a>,
    support2: Support<'a>,
    rotation: DMat3,
    position: DVec3,
}

impl<'a> Pair<'a> {
    fn new(shape1: &'a Shape, shape2: &'a Shape, pose: &Pose) -> Self {
        let m = pose.rotation.to_mat3();
        let rotation = DMat3::from_cols(m.x_axis.as_dvec3(), m.y_axis.as_dvec3(), m.z_axis.as_dvec3());
        let (support1, support2) = (Support::new(shape1).unwrap(), Support::new(shape2).unwrap());
        Self { support1, support2, rotation, position: pose.position.as_dvec3() }
    }

    fn gap(&self, n: DVec3) -> f64 {
        let n = n.normalize();
        let back = self.rotation.transpose() * -n;
        n.dot(self.position) - self.support2.full_support(back).dot(back) - self.support1.full_support(n).dot(n)
    }

    /// Climbs from a direction by steps that shrink, each round along other tangents, so that ridges do not stop it.
    fn climb(&self, mut n: DVec3) -> f64 {
        let (mut best, mut step, mut failures) = (self.gap(n), 0.3, 0);
        let (mut cosine, mut sine) = (1.0, 0.0);
        while step > 1e-7 {
            let (t1, t2) = tangents(n.as_vec3());
            let along = t1.as_dvec3() * cosine + t2.as_dvec3() * sine;
            let across = n.cross(along);
            (cosine, sine) = (0.8 * cosine - 0.6 * sine, 0.6 * cosine + 0.8 * sine);
            let mut better = None;
            for way in [along, -along, across, -across] {
                let next = (n + way * step).normalize();
                let gap = self.gap(next);
                if gap > best {
                    (best, better) = (gap, Some(next));
                }
            }
            match better {
                Some(next) => (n, failures) = (next, 0),
                None if failures < 4 => failures += 1,
                None => (step, failures) = (0.4 * step, 0),
            }
        }
        best
    }

    /// The best gap found.
    fn oracle(&self, grid: &[DVec3], axes: &[DVec3]) -> f64 {
        let mut tried: Vec<(f64, DVec3)> = grid.iter().map(|&n| (self.gap(n), n)).collect();
        tried.sort_by(|a, b| b.0.total_cmp(&a.0));
        let climbed = tried[..3].iter().map(|&(_, n)| self.climb(n)).fold(f64::MIN, f64::max);
        axes.iter().map(|&n| self.gap(n)).fold(climbed, f64::max)
    }

    /// Face normals of both and products of edges, where both are polyhedra.
    fn axes(&self, shape1: &Shape, shape2: &Shape) -> Vec<DVec3> {
        let (Some((mut normals, edges1)), Some((others, edges2))) = (polyhedron(shape1), polyhedron(shape2)) else {
            return Vec::new();
        };
        normals.extend(others.iter().map(|n| -(self.rotation * *n)));
        for e1 in &edges1 {
            for e2 in &edges2 {
                let n = e1.cross(self.rotation * *e2);
                if n.length() > 1e-5 * e1.length() * e2.length() {
                    normals.extend([n, -n]);
                }
            }
        }
        normals
    }
}

/// Face normals and edges.
fn polyhedron(shape: &Shape) -> Option<(Vec<DVec3>, Vec<DVec3>)> {
    let hull = match shape {
        Shape::Cuboid(s) => ConvexHull::from_cuboid(s.half_extents()).ok()?,
        Shape::Hull(s) => (**s).clone(),
        Shape::PointCloud(s) => ConvexHull::new(s.points()).ok()?,
        Shape::Triangle(s) => {
            let [a, b, c] = s.corners().map(Vec3::as_dvec3);
            let edges = vec![b - a, c - b, a - c];
            let normal = edges[0].cross(edges[1]);
            let mut normals = vec![normal, -normal];
            normals.extend(edges.iter().map(|e| e.cross(normal)));
            return Some((normals, edges));
        }
        _ => return None,
    };
    let v = hull.vertices();
    let edges = (0..hull.edges().len())
        .step_by(2)
        .map(|k| (v[hull.edges()[k ^ 1].origin as usize] - v[hull.edges()[k].origin as usize]).as_dvec3());
    Some((hull.planes().iter().map(|p| p.normal.as_dvec3()).collect(), edges.collect()))
}

/// What the old kernels' preference is relative to.
fn preference(shape: &Shape) -> Real {
    let extents = shape.local_aabb().half_extents();
    super::polyhedron::tolerance_size(shape.inner_radius(), extents.max_element())
}

/// A pose with about a given gap along a random direction; a third of them square to each other.
fn pose_with_gap(shape1: &Shape, shape2: &Shape, gap: Real, small: Real, random: &mut Random) -> Pose {
    let square = random.unit() < 0.3;
    let rotation = if square {
        let (axis, turns) =
            ([Vec3::X, Vec3::Y, Vec3::Z][(random.unit() * 2.99) as usize], (random.unit() * 3.99) as u32);
        let quarter = crate::math::Rotation::from_xyzw(axis.x, axis.y, axis.z, 1.0).normalize();
        (0..turns).fold(crate::math::Rotation::IDENTITY, |r, _| r.mul(quarter)).normalize()
    } else {
        random.rotation()
    };
    let u = if square { [Vec3::X, Vec3::Y, Vec3::Z][(random.unit() * 2.99) as usize] } else { random.direction() };
    let pair = Pair::new(shape1, shape2, &Pose::new(Vec3::ZERO, rotation));
    let apart = f64::from(gap) - pair.gap(u.as_dvec3());
    let (t1, t2) = tangents(u);
    let aside = (t1 * random.between(-1.0, 1.0) + t2 * random.between(-1.0, 1.0)) * (0.5 * small);
    Pose::new((u.as_dvec3() * apart).as_vec3() + aside, rotation)
}

struct Case {
    size1: Real,
    size2: Real,
    thin: Real,
    /// Gaps reach from `−deep` to a tenth of it, times the smaller size.
    deep: Real,
}

const GRID_STEPS: usize = 5;

/// Holds pairs of two kinds, `count` of them, against the definition.
fn check(kinds: (usize, usize), (pool1, pool2): (&[Shape], &[Shape]), case: &Case, count: usize, random: &mut Random) {
    let grid = crate::shape::sphere_grid(GRID_STEPS).0;
    for round in 0..count {
        let (shape1, shape2) = (&pool1[round % pool1.len()], &pool2[round / 3 % pool2.len()]);
        let small = Support::new(shape1).unwrap().size().min(Support::new(shape2).unwrap().size());
        let gap = match round % 4 {
            0 => random.between(-1e-6, 1e-6) * small,
            1 => random.between(-0.05, 0.05) * small,
            _ => random.between(-case.deep, 0.1 * case.deep) * small,
        };
        let pose = pose_with_gap(shape1, shape2, gap, small, random);
        let margin = if round % 2 == 0 { 0.0 } else { 0.02 * small };
        check_pair(kinds, (shape1, shape2), &pose, margin, &grid);
    }
}

fn check_pair(kinds: (usize, usize), (shape1, shape2): (&Shape, &Shape), pose: &Pose, margin: Real, grid: &[DVec3]) {
    let small = Support::new(shape1).unwrap().size().min(Support::new(shape2).unwrap().size());
    let large = shape1.reach().max(shape2.reach());
    let pair = Pair::new(shape1, shape2, pose);
    let found = contacts(shape1, shape2, pose, margin);
    let mirrored = contacts(shape2, shape1, &pose.inverse(), margin);
    let old = kinds.0 < OLD && kinds.1 < OLD;
    // A normal in single precision is off by that much of the lever; a user's support function too.
    let rounding = if old || kinds.0.max(kinds.1) == KINDS.len() - 1 { 1e-6 * large } else { 4e-7 * large };
    let best = pair.oracle(grid, &pair.axes(shape1, shape2));
    let exact = f64::from(1e-4 * small + rounding) + 1e-4 * best.abs();
    let loose = if old { f64::from(2e-2 * preference(shape1).min(preference(shape2)) + rounding) } else { exact };
    let told = || {
        let names = (KINDS[kinds.0], KINDS[kinds.1]);
        format!("{names:?} {pose:?} margin {margin}: {:?}\n{shape1:?}\n{shape2:?}", found.points())
    };
    if found.points().is_empty() {
        // The kernel's own axis proves the gap.
        let axis = closest(&pair.support1, &pair.support2, pose).map_or(f64::MIN, |c| pair.gap(c.normal.as_dvec3()));
        assert!(best.max(axis) > f64::from(margin) - exact, "lost: {best} {axis} {}", told());
        return;
    }
    let n = found.points()[0].normal;
    assert!((n.length() - 1.0).abs() < 1e-5, "{}", told());
    let (own, least) = (pair.gap(n.as_dvec3()), lowest(&found));
    assert!(old || own >= best - exact, "not the least way out: {own} < {best} {}", told());
    assert!(least >= best - loose, "too deep: {least} < {best} {}", told());
    assert!(
        if old { least >= own - loose } else { (least - own).abs() <= exact },
        "separation {least}, not {own}: {}",
        told()
    );
    let turned = 2.0 * loose + f64::from(3e-7 * large);
    if least < f64::from(margin) - turned {
        assert!(!mirrored.points().is_empty(), "mirrored lost: {}", told());
        assert!(old || (lowest(&mirrored) - least).abs() <= turned, "mirrored: {:?} {}", mirrored.points(), told());
    }
    for p in found.points() {
        assert!(p.point1.is_finite() && p.separation <= margin + exact as Real && p.normal == n, "{}", told());
        assert_eq!(found.points().iter().filter(|q| q.feature == p.feature).count(), 1, "{}", told());
    }
    if !old {
        check_surface(&pair, &found, (shape1, shape2), pose, &told);
    }
}

/// The points are on the surfaces: none outside, and of the nearest one none inside.
fn check_surface(
    pair: &Pair<'_>,
    found: &Manifold,
    (shape1, shape2): (&Shape, &Shape),
    pose: &Pose,
    told: &impl Fn() -> String,
) {
    let small = pair.support1.size().min(pair.support2.size());
    let dot = Support::Sphere(crate::shape::Sphere::new(1.0).unwrap());
    let large = shape1.reach().max(shape2.reach()) + pose.position.length();
    let slack = 0.03 * small + 1e-6 * large;
    let inverse = pose.inverse();
    for p in found.points() {
        for (shape, point) in [(shape1, p.point1), (shape2, inverse.transform_point(p.point2()))] {
            let support = Support::new(shape).unwrap();
            let outside = closest(&support, &dot, &Pose::from_position(point));
            let outside = outside.map_or(0.0, |c| c.distance - support.radius());
            assert!(outside <= slack, "{point} is outside of {shape:?} by {outside}: {}", told());
        }
        let n = p.normal.as_dvec3();
        if f64::from(p.separation) <= lowest(found) {
            let top = pair.support1.full_support(n).dot(n) - n.dot(p.point1.as_dvec3());
            assert!(top.abs() <= f64::from(2e-4 * small + 1e-6 * large), "off the surface by {top}: {}", told());
        }
    }
}

fn contacts(a: &Shape, b: &Shape, pose: &Pose, margin: Real) -> Manifold {
    let mut manifold = Manifold::EMPTY;
    collide(a, b, pose, margin, &mut PairCache::default(), &mut manifold);
    manifold
}

fn lowest(manifold: &Manifold) -> f64 {
    manifold.points().iter().fold(f64::MAX, |m, p| m.min(p.separation.into()))
}

fn check_all(case: &Case, count: usize) {
    let mut random = Random(0x5EED_0F0A_C1E5 ^ u64::from(case.thin.to_bits()) << 20 ^ u64::from(case.size2.to_bits()));
    let mut pool = |size: Real| -> Vec<Vec<Shape>> {
        let some = count.clamp(4, 40);
        (0..KINDS.len()).map(|kind| (0..some).map(|_| specimen(kind, size, case.thin, &mut random)).collect()).collect()
    };
    let (pool1, pool2) = (pool(case.size1), pool(case.size2));
    for (first, shapes1) in pool1.iter().enumerate() {
        for (second, shapes2) in pool2.iter().enumerate() {
            let mut random = Random(0x00C0_FFEE + (first * 100 + second) as u64);
            check((first, second), (shapes1, shapes2), case, count, &mut random);
        }
    }
}

const USUAL: Case = Case { size1: 1.0, size2: 0.8, thin: 5.0, deep: 1.0 };
const THIN: Case = Case { size1: 1.0, size2: 1.0, thin: 100.0, deep: 1.0 };
const TINY: Case = Case { size1: 1e-3, size2: 2e-3, thin: 5.0, deep: 1.0 };
const HUGE: Case = Case { size1: 1e3, size2: 5e2, thin: 5.0, deep: 1.0 };
const TINY_ON_HUGE: Case = Case { size1: 1e3, size2: 1e-3, thin: 3.0, deep: 1.0 };
const DEEP: Case = Case { size1: 1.0, size2: 0.7, thin: 5.0, deep: 2.5 };

#[test]
fn every_kind_against_every_kind() {
    check_all(&USUAL, 24);
}

#[test]
fn thin_shapes() {
    check_all(&THIN, 12);
}

#[test]
fn tiny_and_huge_shapes() {
    check_all(&TINY, 8);
    check_all(&HUGE, 8);
    check_all(&TINY_ON_HUGE, 8);
}

#[test]
fn deep_overlaps() {
    check_all(&DEEP, 12);
}

#[test]
#[ignore = "minutes: two million pairs"]
fn every_kind_against_every_kind_in_full() {
    for (case, share) in [(&USUAL, 3), (&THIN, 2), (&TINY, 1), (&HUGE, 1), (&TINY_ON_HUGE, 1), (&DEEP, 2)] {
        check_all(case, 1000 * share);
    }
}
