//! Every kind of convex shape against every other, held against the definition in `f64`: the separation of two convex shapes
//! is the largest gap along a direction, `max over n of (min of n · x2 − max of n · x1)`.
//!
//! The directions of a grid, the best of them refined by a search with shrinking steps, and for polyhedra all their separating
//! axes give a bound from below; the gap along the kernel's own normal, which no direction can beat by definition unless the
//! kernel is wrong, gives one from above.

use super::*;
use crate::math::{Mat3, Vec3, max, min, tangents};
use crate::random::Random;
use crate::shape::{ConvexHull, ConvexShape};
use glam::{DMat3, DVec3};
use std::sync::atomic::{AtomicUsize, Ordering};

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

    /// The best gap found. Of polyhedra that overlap one of the axes is the best direction of all: no search is needed.
    fn oracle(&self, grid: &[DVec3], axes: &[DVec3]) -> f64 {
        let best = axes.iter().map(|&n| self.gap(n)).fold(f64::MIN, f64::max);
        if !axes.is_empty() && best < 0.0 {
            return best;
        }
        let mut tried: Vec<(f64, DVec3)> = grid.iter().map(|&n| (self.gap(n), n)).collect();
        tried.sort_by(|a, b| b.0.total_cmp(&a.0));
        tried[..3].iter().map(|&(_, n)| self.climb(n)).fold(best, f64::max)
    }

    /// Face normals of both and products of edges, where both are polyhedra.
    fn axes(&self, first: &Specimen, second: &Specimen) -> Vec<DVec3> {
        let (Some((normals, edges1)), Some((others, edges2))) = (&first.polyhedron, &second.polyhedron) else {
            return Vec::new();
        };
        let mut axes = normals.clone();
        axes.extend(others.iter().map(|n| -(self.rotation * *n)));
        for e1 in edges1 {
            for e2 in edges2 {
                let n = e1.cross(self.rotation * *e2);
                if n.length() > 1e-5 * e1.length() * e2.length() {
                    axes.extend([n, -n]);
                }
            }
        }
        axes
    }
}

/// A shape, and its faces and edges if it has some.
struct Specimen {
    shape: Shape,
    polyhedron: Option<Solid>,
}

impl Specimen {
    fn new(kind: usize, size: Real, thin: Real, random: &mut Random) -> Self {
        let shape = specimen(kind, size, thin, random);
        Self { polyhedron: polyhedron(&shape), shape }
    }
}

/// Face normals and edges.
type Solid = (Vec<DVec3>, Vec<DVec3>);

fn polyhedron(shape: &Shape) -> Option<Solid> {
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
    crate::shape::polyhedron::tolerance_size(shape.inner_radius(), extents.max_element())
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

/// Holds pairs of two kinds, `count` of them, against the definition; what is wrong with them.
fn check(kinds: (usize, usize), (pool1, pool2): (&[Specimen], &[Specimen]), case: &Case, count: usize) -> Vec<String> {
    let mut random = Random(0x00C0_FFEE + (kinds.0 * 100 + kinds.1) as u64);
    let grid = crate::shape::sphere_grid(GRID_STEPS).0;
    let mut wrong = Vec::new();
    for round in 0..count {
        let (first, second) = (&pool1[round % pool1.len()], &pool2[round / 3 % pool2.len()]);
        let small = small_size(&first.shape, &second.shape);
        let gap = match round % 4 {
            0 => random.between(-1e-6, 1e-6) * small,
            1 => random.between(-0.05, 0.05) * small,
            _ => random.between(-case.deep, 0.1 * case.deep) * small,
        };
        let pose = pose_with_gap(&first.shape, &second.shape, gap, small, &mut random);
        let margin = if round % 2 == 0 { 0.0 } else { 0.02 * small };
        if let Err(what) = check_pair(kinds, (first, second), &pose, margin, &grid) {
            wrong.push(what);
        }
    }
    wrong
}

/// The smaller of the sizes that tolerances are relative to.
fn small_size(shape1: &Shape, shape2: &Shape) -> Real {
    Support::new(shape1).unwrap().size().min(Support::new(shape2).unwrap().size())
}

/// Tells what is wrong unless a law holds.
fn law(holds: bool, told: impl FnOnce() -> String) -> Result<(), String> {
    if holds { Ok(()) } else { Err(told()) }
}

fn check_pair(
    kinds: (usize, usize),
    (first, second): (&Specimen, &Specimen),
    pose: &Pose,
    margin: Real,
    grid: &[DVec3],
) -> Result<(), String> {
    let (shape1, shape2) = (&first.shape, &second.shape);
    let small = small_size(shape1, shape2);
    let large = shape1.reach().max(shape2.reach());
    let pair = Pair::new(shape1, shape2, pose);
    let found = contacts(shape1, shape2, pose, margin);
    let mirrored = contacts(shape2, shape1, &pose.inverse(), margin);
    let old = kinds.0 < OLD && kinds.1 < OLD;
    // A normal in single precision is off by that much of the lever; a user's support function too.
    let rounding = if old || kinds.0.max(kinds.1) == KINDS.len() - 1 { 1e-6 * large } else { 4e-7 * large };
    let best = pair.oracle(grid, &pair.axes(first, second));
    let exact = f64::from(1e-4 * small + rounding) + 1e-4 * best.abs();
    let loose = if old { f64::from(2e-2 * preference(shape1).min(preference(shape2)) + rounding) } else { exact };
    let told = || {
        let names = (KINDS[kinds.0], KINDS[kinds.1]);
        format!("{names:?} {pose:?} margin {margin}: {:?}\n{shape1:?}\n{shape2:?}", found.points())
    };
    if found.points().is_empty() {
        // The kernel's own axis proves the gap, or one near that from shape to shape: of a pebble beside the rim of a hall-sized
        // dome the grid of directions does not know.
        let axis = closest(&pair.support1, &pair.support2, pose).map_or(f64::MIN, |c| pair.gap(c.normal.as_dvec3()));
        let axis = axis.max(pair.climb(pair.position.normalize_or(DVec3::Y)));
        return law(best.max(axis) > f64::from(margin) - exact, || format!("lost: {best} {axis} {}", told()));
    }
    let n = found.points()[0].normal;
    law((n.length() - 1.0).abs() < 1e-5, || format!("not unit: {}", told()))?;
    let (own, least) = (pair.gap(n.as_dvec3()), lowest(&found));
    law(old || own >= best - exact, || format!("not the least way out: {own} < {best} {}", told()))?;
    law(least >= best - loose, || format!("too deep: {least} < {best} {}", told()))?;
    let near = if old { least >= own - loose } else { (least - own).abs() <= exact };
    law(near, || format!("wrong separation: {least}, not {own}: {}", told()))?;
    let turned = 2.0 * loose + f64::from(3e-7 * large);
    if least < f64::from(margin) - turned {
        law(!mirrored.points().is_empty(), || format!("mirrored lost: {}", told()))?;
        let same = old || (lowest(&mirrored) - least).abs() <= turned;
        law(same, || format!("mirrored: {:?} {}", mirrored.points(), told()))?;
    }
    for p in found.points() {
        let within = p.point1.is_finite() && p.separation <= margin + exact as Real && p.normal == n;
        law(within, || format!("beyond the margin: {}", told()))?;
        let once = found.points().iter().filter(|q| q.feature == p.feature).count() == 1;
        law(once, || format!("a feature twice: {}", told()))?;
    }
    if old { Ok(()) } else { check_surface(&pair, &found, (shape1, shape2), pose, &told) }
}

/// The points are on the surfaces: none outside, and of the nearest one none inside.
fn check_surface(
    pair: &Pair<'_>,
    found: &Manifold,
    (shape1, shape2): (&Shape, &Shape),
    pose: &Pose,
    told: &impl Fn() -> String,
) -> Result<(), String> {
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
            law(outside <= slack, || format!("outside: {point} of {shape:?} by {outside}: {}", told()))?;
        }
        let n = p.normal.as_dvec3();
        if f64::from(p.separation) <= lowest(found) {
            let top = pair.support1.full_support(n).dot(n) - n.dot(p.point1.as_dvec3());
            let on = top.abs() <= f64::from(2e-4 * small + 1e-6 * large);
            law(on, || format!("off the surface by {top}: {}", told()))?;
        }
    }
    Ok(())
}

fn contacts(a: &Shape, b: &Shape, pose: &Pose, margin: Real) -> Manifold {
    let mut manifold = Manifold::EMPTY;
    collide(a, b, pose, margin, &mut PairCache::default(), &mut manifold);
    manifold
}

fn lowest(manifold: &Manifold) -> f64 {
    manifold.points().iter().fold(f64::MAX, |m, p| m.min(p.separation.into()))
}

/// Every kind against every kind, on two threads: what is wrong.
fn find_wrong(case: &Case, count: usize) -> Vec<String> {
    let mut random = Random(0x5EED_0F0A_C1E5 ^ u64::from(case.thin.to_bits()) << 20 ^ u64::from(case.size2.to_bits()));
    let mut pool = |size: Real| -> Vec<Vec<Specimen>> {
        let some = count.clamp(4, 40);
        let mut kind = |kind| (0..some).map(|_| Specimen::new(kind, size, case.thin, &mut random)).collect();
        (0..KINDS.len()).map(&mut kind).collect()
    };
    let (pool1, pool2) = (pool(case.size1), pool(case.size2));
    let next = AtomicUsize::new(0);
    let work = || {
        let mut wrong = Vec::new();
        loop {
            let at = next.fetch_add(1, Ordering::Relaxed);
            if at >= KINDS.len() * KINDS.len() {
                return wrong;
            }
            let kinds = (at / KINDS.len(), at % KINDS.len());
            wrong.extend(check(kinds, (&pool1[kinds.0], &pool2[kinds.1]), case, count));
        }
    };
    let wrong: Vec<String> = std::thread::scope(|scope| {
        let threads = [(); 2].map(|()| scope.spawn(work));
        threads.into_iter().flat_map(|thread| thread.join().unwrap()).collect()
    });
    println!("{} pairs, {} wrong", count * KINDS.len() * KINDS.len(), wrong.len());
    wrong
}

fn check_all(cases: &[(&Case, usize)]) {
    let wrong: Vec<String> = cases.iter().flat_map(|(case, count)| find_wrong(case, *count)).collect();
    assert!(wrong.is_empty(), "{} pairs are wrong:\n{}", wrong.len(), wrong[..wrong.len().min(20)].join("\n\n"));
}

const USUAL: Case = Case { size1: 1.0, size2: 0.8, thin: 5.0, deep: 1.0 };
const THIN: Case = Case { size1: 1.0, size2: 1.0, thin: 100.0, deep: 1.0 };
const TINY: Case = Case { size1: 1e-3, size2: 2e-3, thin: 5.0, deep: 1.0 };
const HUGE: Case = Case { size1: 1e3, size2: 5e2, thin: 5.0, deep: 1.0 };
const TINY_ON_HUGE: Case = Case { size1: 1e3, size2: 1e-3, thin: 3.0, deep: 1.0 };
const DEEP: Case = Case { size1: 1.0, size2: 0.7, thin: 5.0, deep: 2.5 };

#[test]
fn every_kind_against_every_kind() {
    check_all(&[(&USUAL, 72)]);
}

#[test]
fn thin_shapes() {
    check_all(&[(&THIN, 40)]);
}

#[test]
fn tiny_and_huge_shapes() {
    check_all(&[(&TINY, 24), (&HUGE, 24), (&TINY_ON_HUGE, 24)]);
}

#[test]
fn deep_overlaps() {
    check_all(&[(&DEEP, 40)]);
}

/// A triangle on a level edge exactly on a box has the ends of the edge for points, though its face leans over it.
#[test]
fn an_edge_that_just_touches_has_two_points() {
    let block = Shape::cuboid(Vec3::new(0.4, 0.25, 0.416_333)).unwrap();
    let sail = Shape::triangle([Vec3::ZERO, Vec3::X * 0.6, Vec3::new(0.2, 0.6, 0.55)]).unwrap();
    let pose = Pose::from_position(Vec3::new(-0.3, -0.1, 0.416_333));
    let found = contacts(&block, &sail, &pose, 0.0);
    assert_eq!(found.points().len(), 2, "{found:?}");
    for p in found.points() {
        assert!((p.point1.y + 0.1).abs() < 1e-6 && (p.point1.x.abs() - 0.3).abs() < 1e-6, "{p:?}");
    }
}

/// Two prisms of diamonds that meet edge to parallel edge share the stretch between their ends, whichever faces are chosen.
#[test]
fn parallel_edges_share_a_stretch() {
    let corner = |k: u32| {
        Vec3::new(
            [0.5, -0.5][k as usize & 1],
            [0.3, 0.0, -0.3, 0.0][k as usize >> 1],
            [0.0, 0.3, 0.0, -0.3][k as usize >> 1],
        )
    };
    let prism = Shape::point_cloud(&(0..8).map(corner).collect::<Vec<_>>()).unwrap();
    for gap in [0.001, 0.005] {
        for shift in [-0.2, 0.3] {
            let found = contacts(&prism, &prism, &Pose::from_position(Vec3::new(shift, 0.6 + gap, 0.0)), 0.01);
            let ends = [max(-0.5, shift - 0.5), min(0.5, shift + 0.5)];
            for end in ends {
                let near = |p: &ManifoldPoint| (p.point1 - Vec3::new(end, 0.3, 0.0)).length() < 1e-3;
                assert!(found.points().iter().any(near), "nothing at {end}: {found:?}");
            }
            assert!(found.points().iter().all(|p| (p.separation - gap).abs() < 1e-5), "{found:?}");
        }
    }
}

#[test]
#[ignore = "minutes: 1.4 million pairs"]
fn every_kind_against_every_kind_in_full() {
    check_all(&[(&USUAL, 3000), (&THIN, 2000), (&DEEP, 2000)]);
}

#[test]
#[ignore = "minutes: 0.6 million pairs"]
fn tiny_and_huge_shapes_in_full() {
    check_all(&[(&TINY, 1000), (&HUGE, 1000), (&TINY_ON_HUGE, 1000)]);
}
