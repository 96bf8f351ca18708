//! Laws that every pair of shapes keeps, and the cuboid kernel against separating axes in `f64`.

use super::*;
use crate::math::{Rotation, Vec3};
use crate::random::Random;
use crate::shape::ConvexHull;
use crate::shape::polyhedron::cuboid_size;
use glam::{DMat3, DVec3};

pub(super) fn contacts(a: &Shape, b: &Shape, pose: &Pose, margin: Real) -> Manifold {
    let mut manifold = Manifold::EMPTY;
    collide(a, b, pose, margin, &mut PairCache::default(), &mut manifold);
    manifold
}

fn lowest(manifold: &Manifold) -> Real {
    manifold.points().iter().fold(Real::MAX, |m, p| if p.separation < m { p.separation } else { m })
}

fn matrix(rotation: Rotation) -> DMat3 {
    let m = rotation.to_mat3();
    DMat3::from_cols(m.x_axis.as_dvec3(), m.y_axis.as_dvec3(), m.z_axis.as_dvec3())
}

/// Gap of two boxes along a unit axis.
fn box_gap(h1: DVec3, h2: DVec3, m: &DMat3, t: DVec3, n: DVec3) -> f64 {
    let reach1 = h1.dot(n.abs());
    let reach2 = h2.dot(DVec3::new(m.x_axis.dot(n), m.y_axis.dot(n), m.z_axis.dot(n)).abs());
    t.dot(n).abs() - reach1 - reach2
}

/// The largest gap over the fifteen axes.
fn box_oracle(h1: DVec3, h2: DVec3, m: &DMat3, t: DVec3) -> f64 {
    let own = [DVec3::X, DVec3::Y, DVec3::Z];
    let others = [m.x_axis, m.y_axis, m.z_axis];
    let mut best = f64::MIN;
    for n in own.into_iter().chain(others) {
        best = best.max(box_gap(h1, h2, m, t, n.normalize()));
    }
    for a in own {
        for b in others {
            let n = a.cross(b);
            if n.length() > 1e-6 {
                best = best.max(box_gap(h1, h2, m, t, n.normalize()));
            }
        }
    }
    best
}

fn assert_sound(manifold: &Manifold, size: Real, margin: Real) {
    for p in manifold.points() {
        assert!((p.normal.length() - 1.0).abs() < 1e-5, "{p:?}");
        assert!(p.point1.is_finite() && p.separation.is_finite() && p.separation <= margin + 1e-5 * size);
        assert_eq!(p.normal, manifold.points()[0].normal);
        assert_eq!(manifold.points().iter().filter(|q| q.feature == p.feature).count(), 1, "{manifold:?}");
    }
}

#[test]
fn boxes_agree_with_the_separating_axes_in_double_precision() {
    let mut random = Random(0x1234_5678_9ABC_DEF1);
    let (mut touching, mut lifted) = (0, 0);
    for round in 0..40_000 {
        let mut half = || Vec3::new(random.between(0.1, 1.0), random.between(0.1, 1.0), random.between(0.1, 1.0));
        let (h1, h2) = (half(), half());
        let rotation = random.rotation();
        let t = random.vector() * 1.8;
        let margin = if round % 2 == 0 { 0.0 } else { 0.05 };
        let pose = Pose::new(t, rotation);
        let m = contacts(&Shape::cuboid(h1).unwrap(), &Shape::cuboid(h2).unwrap(), &pose, margin);
        let (d1, d2, rot, dt) = (h1.as_dvec3(), h2.as_dvec3(), matrix(rotation), t.as_dvec3());
        let oracle = box_oracle(d1, d2, &rot, dt) as Real;
        let size = cuboid_size(h1).min(cuboid_size(h2));
        assert_sound(&m, size, margin);
        if oracle < -1e-5 {
            assert!(!m.points().is_empty(), "overlap {oracle} lost");
        }
        if oracle > margin + 1e-5 {
            assert!(m.points().is_empty());
        }
        if m.points().is_empty() {
            continue;
        }
        touching += 1;
        let n = m.points()[0].normal;
        let gap = box_gap(d1, d2, &rot, dt, n.as_dvec3()) as Real;
        assert!(n.dot(t) >= 0.0);
        if oracle <= 0.0 {
            // The best axis but for the preference for faces: never deeper by more than that, never along a made-up
            // axis.
            assert!(gap <= oracle + 1e-4 * size && lowest(&m) >= oracle - 8e-3 * size, "{gap} {oracle} {size}");
            lifted += (lowest(&m) > 0.0) as u32;
        }
        assert!(lowest(&m) >= gap - 1e-4 * size, "{} {gap}", lowest(&m));
    }
    // No overlap is told as a gap.
    assert!(touching > 9_000 && lifted == 0, "{touching} {lifted}");
}

#[test]
fn a_b_mirrors_b_a() {
    let mut random = Random(0xFEED_BEEF_1234_5671);
    let shapes = shapes();
    let mut touching = 0;
    for _ in 0..500 {
        for a in &shapes {
            for b in &shapes {
                let pose = Pose::new(random.vector(), random.rotation());
                let (ab, ba) = (contacts(a, b, &pose, 0.02), contacts(b, a, &pose.inverse(), 0.02));
                assert_sound(&ab, 0.3, 0.02);
                if ab.points().is_empty() || ba.points().is_empty() {
                    let other = if ab.points().is_empty() { &ba } else { &ab };
                    assert!(other.points().is_empty() || lowest(other) > 0.0, "{a:?} {b:?} {pose:?} {other:?}");
                    continue;
                }
                touching += 1;
                let (m, n) = (ab.points()[0].normal, pose.rotation.rotate(ba.points()[0].normal));
                let (d1, d2) = (lowest(&ab), lowest(&ba));
                assert!((d1 - d2).abs() < 0.01 || m.dot(n) > -0.999, "{a:?} {b:?} {pose:?}: {d1} {d2} {m} {n}");
            }
        }
    }
    assert!(touching > 1000);
}

fn box_hull(h: Vec3) -> Shape {
    let corner = |i: u32| {
        let sign = |bit: u32, x: Real| if i >> bit & 1 == 1 { x } else { -x };
        Vec3::new(sign(0, h.x), sign(1, h.y), sign(2, h.z))
    };
    Shape::hull(&(0..8).map(corner).collect::<Vec<_>>()).unwrap()
}

fn random_hull(random: &mut Random, count: usize, size: Real) -> Shape {
    let shift = random.vector() * 0.2 * size;
    let points: Vec<Vec3> = (0..count).map(|_| random.direction() * random.between(0.5, 1.0) * size + shift).collect();
    Shape::hull(&points).unwrap()
}

/// The largest gap of two convex polyhedra over all face normals and all products of edges, by brute force.
pub(super) fn hull_oracle(a: &ConvexHull, b: &ConvexHull, pose: &Pose) -> f64 {
    let (m, t) = (matrix(pose.rotation), pose.position.as_dvec3());
    let v1: Vec<DVec3> = a.vertices().iter().map(|v| v.as_dvec3()).collect();
    let v2: Vec<DVec3> = b.vertices().iter().map(|v| m * v.as_dvec3() + t).collect();
    let edges = |hull: &ConvexHull, v: &[DVec3]| -> Vec<DVec3> {
        let e = hull.edges();
        (0..e.len()).step_by(2).map(|k| v[e[k ^ 1].origin as usize] - v[e[k].origin as usize]).collect()
    };
    let mut axes: Vec<DVec3> = a.planes().iter().map(|p| p.normal.as_dvec3()).collect();
    axes.extend(b.planes().iter().map(|p| -(m * p.normal.as_dvec3())));
    let (edges1, edges2) = (edges(a, &v1), edges(b, &v2));
    for e1 in &edges1 {
        for e2 in &edges2 {
            let n = e1.cross(*e2);
            if n.length() > 1e-6 * e1.length() * e2.length() {
                axes.extend([n, -n]);
            }
        }
    }
    axes.iter().fold(f64::MIN, |best, n| best.max(points_gap(&v1, &v2, n.normalize())))
}

fn points_gap(v1: &[DVec3], v2: &[DVec3], n: DVec3) -> f64 {
    let high = v1.iter().fold(f64::MIN, |m, v| m.max(v.dot(n)));
    let low = v2.iter().fold(f64::MAX, |m, v| m.min(v.dot(n)));
    low - high
}

#[test]
fn a_box_as_a_hull_is_as_deep_as_the_cuboid() {
    let mut random = Random(0x0DDB_A115_0DDB_A115);
    let mut touching = 0;
    for _ in 0..10_000 {
        let mut half = || Vec3::new(random.between(0.1, 1.0), random.between(0.1, 1.0), random.between(0.1, 1.0));
        let (h1, h2) = (half(), half());
        let pose = Pose::new(random.vector() * 1.5, random.rotation());
        let (a, b) = (Shape::cuboid(h1).unwrap(), Shape::cuboid(h2).unwrap());
        let expected = contacts(&a, &b, &pose, 0.0);
        let size = cuboid_size(h1).min(cuboid_size(h2));
        for (a, b) in [(box_hull(h1), box_hull(h2)), (box_hull(h1), b.clone()), (a.clone(), box_hull(h2))] {
            let found = contacts(&a, &b, &pose, 0.0);
            assert_sound(&found, size, 0.0);
            let oracle = box_oracle(h1.as_dvec3(), h2.as_dvec3(), &matrix(pose.rotation), pose.position.as_dvec3());
            if oracle.abs() < 1e-2 * f64::from(size) {
                continue;
            }
            assert_eq!(found.points().is_empty(), expected.points().is_empty());
            if !found.points().is_empty() {
                let difference = (lowest(&found) - lowest(&expected)).abs();
                // Both may prefer different faces, within the preference.
                assert!(difference < 9e-3 * size || found.points()[0].normal.dot(expected.points()[0].normal) < 0.999);
                touching += 1;
            }
        }
    }
    assert!(touching > 5_000, "{touching}");
}

#[test]
fn hulls_agree_with_all_separating_axes_in_double_precision() {
    let mut random = Random(0xABCD_EF01_2345_6789);
    let (mut touching, mut lifted) = (0, 0);
    for round in 0..1200 {
        let count = 4 + round % 17;
        let a = random_hull(&mut random, count, 1.0);
        let b = random_hull(&mut random, 4 + round % 13, 0.7);
        let (Shape::Hull(ha), Shape::Hull(hb)) = (&a, &b) else { unreachable!() };
        let pose = Pose::new(random.direction() * random.between(0.2, 1.8), random.rotation());
        let oracle = hull_oracle(ha, hb, &pose) as Real;
        let m = contacts(&a, &b, &pose, 0.0);
        let size = min_size(&a, &b);
        assert_sound(&m, size, 0.0);
        assert!(oracle >= -1e-5 || !m.points().is_empty(), "overlap {oracle} lost");
        assert!(oracle <= 1e-5 || m.points().is_empty(), "apart {oracle}");
        if m.points().is_empty() {
            continue;
        }
        touching += 1;
        let n = m.points()[0].normal.as_dvec3();
        let r = matrix(pose.rotation);
        let v1: Vec<DVec3> = ha.vertices().iter().map(|v| v.as_dvec3()).collect();
        let v2: Vec<DVec3> = hb.vertices().iter().map(|v| r * v.as_dvec3() + pose.position.as_dvec3()).collect();
        let gap = points_gap(&v1, &v2, n) as Real;
        assert!(gap <= oracle + 1e-4 && lowest(&m) >= oracle - 8e-3 * size - 1e-4, "{gap} {oracle}");
        assert!(lowest(&m) >= gap - 1e-4);
        lifted += (lowest(&m) > 0.0) as u32;
        // Remembering the last axis changes nothing.
        let mut cache = PairCache::default();
        let mut again = Manifold::EMPTY;
        for _ in 0..2 {
            collide(&a, &b, &pose, 0.0, &mut cache, &mut again);
            assert_eq!(again.points(), m.points());
        }
    }
    assert!(touching > 400 && lifted == 0);
}

fn min_size(a: &Shape, b: &Shape) -> Real {
    crate::math::min(a.inner_radius(), b.inner_radius())
}

fn shapes() -> Vec<Shape> {
    let mut random = Random(0x5555_AAAA_1234_8765);
    vec![
        random_hull(&mut random, 12, 0.6),
        random_hull(&mut random, 30, 0.5),
        box_hull(Vec3::new(0.4, 0.3, 0.3)),
        Shape::sphere(0.3).unwrap(),
        Shape::capsule(0.5, 0.2).unwrap(),
        Shape::cuboid(Vec3::new(0.3, 0.5, 0.4)).unwrap(),
    ]
}

fn turn_y(angle: Real) -> Rotation {
    Rotation::from_xyzw(0.0, libm::sinf(0.5 * angle), 0.0, libm::cosf(0.5 * angle))
}

fn unit_cube() -> Shape {
    Shape::cuboid(Vec3::ONE).unwrap()
}

/// Both kernels for boxes: the cuboid's, and that for hulls.
fn stacked(pose: &Pose) -> [Manifold; 3] {
    let hull = box_hull(Vec3::ONE);
    [(unit_cube(), unit_cube()), (hull.clone(), hull.clone()), (unit_cube(), hull)]
        .map(|(a, b)| contacts(&a, &b, pose, 0.02))
}

/// MF1
#[test]
fn equal_boxes_touch_in_their_four_corners() {
    for m in stacked(&Pose::from_position(Vec3::new(0.0, 1.9, 0.0))) {
        assert_eq!(m.points().len(), 4);
        for p in m.points() {
            assert!((p.point1.x.abs() - 1.0).abs() < 1e-4 && (p.point1.z.abs() - 1.0).abs() < 1e-4, "{p:?}");
            assert!((p.point1.y - 1.0).abs() < 1e-6 && (p.point2().y - 0.9).abs() < 1e-6);
            assert!((p.separation + 0.1).abs() < 1e-6 && p.normal == Vec3::Y);
        }
    }
}

/// MF2, MF3
#[test]
fn a_box_turned_by_45_degrees_touches_in_all_four_quadrants() {
    for m in stacked(&Pose::new(Vec3::new(0.0, 1.9, 0.0), turn_y(std::f32::consts::FRAC_PI_4))) {
        assert_eq!(m.points().len(), 4);
        let mut quadrants = [false; 4];
        for p in m.points() {
            assert!(p.point1.x.abs() <= 1.0 + 2e-4 && p.point1.z.abs() <= 1.0 + 2e-4);
            assert!(p.point1.x.abs() + p.point1.z.abs() <= 2.0_f32.sqrt() + 4e-4);
            assert!(p.point1.x.abs() > 0.05 && p.point1.z.abs() > 0.05);
            quadrants[(p.point1.x > 0.0) as usize * 2 + (p.point1.z > 0.0) as usize] = true;
        }
        assert_eq!(quadrants, [true; 4]);
    }
}

/// MF4: a scene moved by tens of kilometres has the same relative pose but for the rounding of positions.
#[test]
fn far_from_the_origin_the_points_stay_the_same() {
    let offset = Vec3::new(1e4, -2e4, 3e4);
    let pose2 = Pose::new(Vec3::new(0.0, 1.875, 0.0), turn_y(0.5));
    let here = contacts(&unit_cube(), &unit_cube(), &pose2, 0.02);
    let (far1, far2) = (Pose::from_position(offset), Pose::new(pose2.position + offset, pose2.rotation));
    let there = contacts(&unit_cube(), &unit_cube(), &far1.relative(&far2), 0.02);
    assert_eq!(here.points().len(), there.points().len());
    for (p, q) in here.points().iter().zip(there.points()) {
        assert!((p.point1 - q.point1).length() < 1e-3 && p.feature == q.feature);
    }
}

/// MF5, MF6: a ridge lowered onto a box touches along its edge, whichever of the two comes first.
#[test]
fn a_ridge_touches_with_both_ends_of_its_edge() {
    let ridge: Vec<Vec3> = [-2.0, 2.0]
        .iter()
        .flat_map(|&x| [Vec3::new(x, -1.0, 0.0), Vec3::new(x, 1.0, 1.0), Vec3::new(x, 1.0, -1.0)])
        .collect();
    let (ridge, cube) = (Shape::hull(&ridge).unwrap(), Shape::cuboid(Vec3::splat(2.0)).unwrap());
    let pose = Pose::from_position(Vec3::new(0.0, 2.9, 0.0));
    let (below, above) = (contacts(&cube, &ridge, &pose, 0.02), contacts(&ridge, &cube, &pose.inverse(), 0.02));
    assert_eq!((below.points().len(), above.points().len()), (2, 2));
    for p in below.points() {
        assert!((p.normal - Vec3::Y).length() < 1e-5);
        assert!((p.point1 - Vec3::new(2.0 * p.point1.x.signum(), 2.0, 0.0)).length() < 1e-4, "{p:?}");
        assert!((p.point2().y - 1.9).abs() < 1e-4);
    }
    for p in above.points() {
        assert!((p.normal + Vec3::Y).length() < 1e-5);
        let point1 = p.point1 + pose.position;
        assert!((point1 - Vec3::new(2.0 * point1.x.signum(), 1.9, 0.0)).length() < 1e-4, "{p:?}");
    }
    assert!(below.points()[0].point1.x * below.points()[1].point1.x < 0.0);
}

/// A millimetre box and a kilometre box give the same contact, scaled.
#[test]
fn the_size_of_the_world_does_not_matter() {
    let mut random = Random(0x7777_1111_3333_5555);
    let bodies: Vec<(Shape, Shape, Shape)> = vec![
        scaled(|s| Shape::cuboid(Vec3::new(0.5, 0.3, 0.4) * s).unwrap()),
        scaled(|s| Shape::capsule(0.5 * s, 0.25 * s).unwrap()),
        scaled(|s| Shape::sphere(0.4 * s).unwrap()),
        scaled(|s| {
            let mut random = Random(0x1111_2222_3333_4444);
            random_hull(&mut random, 20, 0.6 * s)
        }),
    ];
    for _ in 0..300 {
        for a in &bodies {
            for b in &bodies {
                let (t, rotation) = (random.vector() * 0.9, random.rotation());
                let at = |s: Real| Pose::new(t * s, rotation);
                let one = contacts(&a.0, &b.0, &at(1.0), 0.02);
                for (small, large, s) in [(&a.1, &b.1, 1.0 / 1024.0), (&a.2, &b.2, 1024.0)] {
                    let other = contacts(small, large, &at(s), 0.02 * s);
                    assert_eq!(one.points().len(), other.points().len(), "{a:?} {b:?}");
                    for (p, q) in one.points().iter().zip(other.points()) {
                        assert!((p.point1 * s - q.point1).length() < 1e-4 * s && (p.normal - q.normal).length() < 1e-4);
                        assert!((p.separation * s - q.separation).abs() < 1e-4 * s);
                    }
                }
            }
        }
    }
}

/// Powers of two, so that scaling is exact.
fn scaled(make: impl Fn(Real) -> Shape) -> (Shape, Shape, Shape) {
    (make(1.0), make(1.0 / 1024.0), make(1024.0))
}

/// Spheres and capsules against the distance of their cores, found by GJK, wherever the cores are apart.
#[test]
fn rounded_shapes_agree_with_the_distance_of_their_cores() {
    use crate::shape::Support;
    use crate::shape::distance::closest;
    let mut random = Random(0x2468_1357_2468_1357);
    let rounded = [Shape::sphere(0.3).unwrap(), Shape::capsule(0.5, 0.2).unwrap()];
    let (mut checked, mut double) = (0, 0);
    for _ in 0..2000 {
        for a in shapes() {
            for b in &rounded {
                let pose = Pose::new(random.vector() * 1.2, random.rotation());
                let (s1, s2) = (Support::new(&a).unwrap(), Support::new(b).unwrap());
                let m = contacts(&a, b, &pose, 0.05);
                assert_sound(&m, 0.2, 0.05);
                let Some(c) = closest(&s1, &s2, &pose) else {
                    assert!(lowest(&m) < 0.0, "{a:?} {b:?} {pose:?} {m:?}");
                    continue;
                };
                let gap = c.distance - s1.radius() - s2.radius();
                if (gap - 0.05).abs() < 1e-4 {
                    continue;
                }
                assert_eq!(m.points().is_empty(), gap > 0.05);
                if !m.points().is_empty() {
                    // A face stands in for a normal that differs by less than 3.6 degrees.
                    assert!((lowest(&m) - gap).abs() < 3e-3, "{m:?} {c:?} {gap} {b:?} {pose:?}");
                    assert!(m.points()[0].normal.dot(c.normal) > 0.99, "{m:?} {c:?}");
                    checked += 1;
                    double += (m.points().len() == 2) as u32;
                }
            }
        }
    }
    assert!(checked > 2000 && double > 20, "{checked} {double}");
}

#[test]
fn a_lying_capsule_touches_a_box_in_two_points() {
    let (floor, capsule) = (Shape::cuboid(Vec3::new(2.0, 0.5, 2.0)).unwrap(), Shape::capsule(0.5, 0.2).unwrap());
    let lying = Rotation::from_xyzw(0.0, 0.0, 0.5_f32.sqrt(), 0.5_f32.sqrt());
    // Resting, sunk to the axis and below it.
    for (y, separation) in [(0.71, 0.01), (0.69, -0.01), (0.5, -0.2), (0.45, -0.25)] {
        for x in [0.0, 1.8] {
            let m = contacts(&floor, &capsule, &Pose::new(Vec3::new(x, y, 0.0), lying), 0.02);
            assert_eq!(m.points().len(), 2, "{y}");
            let (a, b) = (m.points()[0], m.points()[1]);
            for p in [a, b] {
                assert!(
                    (p.separation - separation).abs() < 1e-5 && p.normal == Vec3::Y && (p.point1.y - 0.5).abs() < 1e-6
                );
            }
            let (low, high) = (x - 0.5, (x + 0.5).min(2.0));
            assert!(
                (a.point1.x.min(b.point1.x) - low).abs() < 1e-5 && (a.point1.x.max(b.point1.x) - high).abs() < 1e-3
            );
        }
    }
    let standing = contacts(&floor, &capsule, &Pose::from_position(Vec3::new(0.0, 1.19, 0.0)), 0.02);
    assert_eq!(standing.points().len(), 1);
    assert!((standing.points()[0].separation + 0.01).abs() < 1e-5);
}

#[test]
fn parallel_capsules_share_two_points_crossed_ones_one() {
    let capsule = Shape::capsule(1.0, 0.25).unwrap();
    let m = contacts(&capsule, &capsule, &Pose::from_position(Vec3::new(0.45, 0.5, 0.0)), 0.02);
    assert_eq!(m.points().len(), 2);
    let ys: Vec<Real> = m.points().iter().map(|p| p.point1.y).collect();
    assert!((ys[0] + 0.5).abs() < 1e-6 && (ys[1] - 1.0).abs() < 1e-6, "{ys:?}");
    assert!(m.points().iter().all(|p| (p.separation + 0.05).abs() < 1e-6 && (p.normal - Vec3::X).length() < 1e-6));
    let crossed = Pose::new(Vec3::new(0.45, 0.5, 0.0), Rotation::from_xyzw(1.0, 0.0, 0.0, 1.0).normalize());
    let m = contacts(&capsule, &capsule, &crossed, 0.02);
    assert_eq!(m.points().len(), 1);
    assert!((m.points()[0].point1 - Vec3::new(0.25, 0.5, 0.0)).length() < 1e-5);
}

/// Coincident centres, centres on faces, parallel edges: unit normals, finite points, never nothing.
#[test]
fn degenerate_placements_still_give_a_contact() {
    let mut all = shapes();
    all.push(unit_cube());
    let quarter = Rotation::from_xyzw(0.0, 0.0, 1.0, 1.0).normalize();
    for a in &all {
        for b in &all {
            for rotation in
                [Rotation::IDENTITY, quarter, turn_y(1e-4), turn_y(std::f32::consts::FRAC_PI_4), turn_y(1e-9)]
            {
                for position in [Vec3::ZERO, Vec3::X * 1e-20, Vec3::Y * 0.1, Vec3::new(0.1, 0.1, 0.1)] {
                    let m = contacts(a, b, &Pose::new(position, rotation), 0.02);
                    assert!(!m.points().is_empty() && lowest(&m) < 0.0, "{a:?} {b:?} {rotation:?} {position}");
                    assert_sound(&m, 0.2, 0.02);
                }
            }
        }
    }
    let on_face = contacts(&unit_cube(), &Shape::sphere(0.5).unwrap(), &Pose::from_position(Vec3::X), 0.02);
    assert_eq!((on_face.points()[0].normal, on_face.points()[0].separation), (Vec3::X, -0.5));
}

/// A box that rocks by hairs on another keeps its four points and their names.
#[test]
fn features_do_not_flicker_in_a_resting_stack() {
    let mut random = Random(0x9999_8888_7777_6661);
    let lower = Shape::cuboid(Vec3::new(0.5, 0.5, 0.5)).unwrap();
    for (x, z) in [(0.0, 0.0), (0.5, 0.0), (0.2, -0.3)] {
        let mut first: Option<Vec<u32>> = None;
        for _ in 0..2000 {
            let tilt = random.vector() * 5e-4;
            let rotation = Rotation::from_xyzw(tilt.x, 0.05 * tilt.y, tilt.z, 1.0).normalize();
            // It rocks about the middle of its lower face, which is in the contact.
            let position = Vec3::new(x, 0.498, z) + rotation.rotate(Vec3::Y * 0.5) + random.vector() * 1e-5;
            let m = contacts(&lower, &lower, &Pose::new(position, rotation), 0.02);
            let mut features: Vec<u32> = m.points().iter().map(|p| p.feature).collect();
            features.sort_unstable();
            assert_eq!(features.len(), 4);
            assert_eq!(first.get_or_insert_with(|| features.clone()), &features);
        }
    }
}

/// Two boxes on their edges, crossed: however little they overlap, the normal is square to both edges, not that of a
/// face 45° off.
#[test]
fn crossed_edges_push_square_to_both() {
    let cube = Shape::cuboid(Vec3::splat(0.5)).unwrap();
    let hull = box_hull(Vec3::splat(0.5));
    let eighth = |x: Real, z: Real| Rotation::from_xyzw(x, 0.0, z, libm::cosf(std::f32::consts::PI / 8.0)).normalize();
    let sine = libm::sinf(std::f32::consts::PI / 8.0);
    for (a, b) in [(&cube, &cube), (&hull, &hull), (&cube, &hull)] {
        for depth in [-0.01, -0.001, 0.001, 0.005, 0.05] {
            let pose1 = Pose::new(Vec3::ZERO, eighth(0.0, sine));
            let pose2 = Pose::new(Vec3::new(0.02, 2.0_f32.sqrt() - depth, 0.03), eighth(sine, 0.0));
            let m = contacts(a, b, &pose1.relative(&pose2), 0.02);
            assert_eq!(m.points().len(), 1, "{depth}");
            let p = m.points()[0];
            assert!((pose1.rotation.rotate(p.normal) - Vec3::Y).length() < 1e-4);
            assert!((p.separation + depth).abs() < 1e-5);
            let at = pose1.transform_point(p.point1);
            assert!((at - Vec3::new(0.0, 0.5 * 2.0_f32.sqrt(), 0.03)).length() < 1e-4, "{at}");
        }
    }
}

/// A box that leans by half a degree on another keeps a patch under it, though an edge pair overlaps a little less.
#[test]
fn a_leaning_box_keeps_its_patch() {
    let mut random = Random(0x3141_5926_5358_9793);
    let cube = Shape::cuboid(Vec3::splat(0.5)).unwrap();
    let hull = box_hull(Vec3::splat(0.5));
    for _ in 0..2000 {
        let tilt = random.direction() * 0.004;
        let rotation = Rotation::from_xyzw(tilt.x, tilt.y, tilt.z, 1.0).normalize();
        let position = Vec3::new(random.between(-0.6, 0.6), 0.995, random.between(-0.6, 0.6));
        for (a, b) in [(&cube, &cube), (&hull, &hull)] {
            let m = contacts(a, b, &Pose::new(position, rotation), 0.02);
            assert!(m.points().len() >= 3 && m.points()[0].normal.y > 0.999, "{position} {rotation:?} {m:?}");
        }
    }
}

#[test]
fn a_capsule_beside_an_edge_touches_in_two_points() {
    let cube = Shape::cuboid(Vec3::ONE).unwrap();
    let capsule = Shape::capsule(0.5, 0.2).unwrap();
    let lean = Rotation::from_xyzw(0.003, 0.0, 0.002, 1.0).normalize();
    for a in [cube, box_hull(Vec3::ONE)] {
        let m = contacts(&a, &capsule, &Pose::new(Vec3::new(1.12, 0.8, 1.12), lean), 0.02);
        assert_eq!(m.points().len(), 2);
        let separation = 0.12 * 2.0_f32.sqrt() - 0.2;
        for p in m.points() {
            assert!((p.separation - separation).abs() < 5e-3 && (p.normal.x - p.normal.z).abs() < 0.1);
            assert!((p.point1.x - 1.0).abs() < 1e-5 && (p.point1.z - 1.0).abs() < 1e-5);
        }
        let mut ys = [m.points()[0].point1.y, m.points()[1].point1.y];
        ys.sort_by(Real::total_cmp);
        assert!((ys[0] - 0.3).abs() < 1e-3 && (ys[1] - 1.0).abs() < 1e-5, "{ys:?}");
    }
}

/// Two sheets a millimetre thick and metres long, one on the other: four corners each time, far from the middle too.
#[test]
fn thin_sheets_stack() {
    let mut random = Random(0x1212_3434_5656_7878);
    let sheet = Shape::cuboid(Vec3::new(2.0, 0.0005, 1.5)).unwrap();
    let floor = Shape::cuboid(Vec3::new(100.0, 1.0, 100.0)).unwrap();
    let hull = box_hull(Vec3::new(2.0, 0.0005, 1.5));
    for _ in 0..500 {
        let tilt = random.vector() * 2e-5;
        let rotation = Rotation::from_xyzw(tilt.x, random.between(-1.0, 1.0), tilt.z, 1.0).normalize();
        let pose = Pose::new(Vec3::new(random.between(-90.0, 90.0), 1.0004, 40.0), rotation);
        for upper in [&sheet, &hull] {
            let m = contacts(&floor, upper, &pose, 0.02);
            assert!(m.points().len() == 4 && (m.points()[0].normal - Vec3::Y).length() < 1e-6, "{m:?}");
        }
    }
    let m = contacts(&sheet, &sheet, &Pose::new(Vec3::new(0.1, 0.0009, 0.2), turn_y(0.3)), 0.02);
    assert!(m.points().len() == 4 && m.points().iter().all(|p| (p.separation + 1e-4).abs() < 1e-6), "{m:?}");
}

/// A pose that is not finite, or a cache from another pair, must not panic: what comes out is caught later.
#[test]
fn nonsense_does_not_panic() {
    let all = shapes();
    for a in &all {
        for b in &all {
            for bad in [Real::NAN, Real::INFINITY, 1e30] {
                contacts(a, b, &Pose::from_position(Vec3::new(bad, 0.1, 0.0)), 0.02);
                contacts(a, b, &Pose::new(Vec3::ZERO, Rotation::from_xyzw(bad, 0.0, 0.0, 1.0)), 0.02);
            }
            for word in [1, 15, 16, 1 << 30 | 500, 2 << 30 | 99, u32::MAX] {
                let (pose, mut m) = (Pose::from_position(Vec3::X * 0.4), Manifold::EMPTY);
                collide(a, b, &pose, 0.02, &mut PairCache { words: [word; 2] }, &mut m);
                assert_eq!(m.points(), contacts(a, b, &pose, 0.02).points());
            }
        }
    }
}

/// Boxes and hulls that are apart, against the distance that GJK finds: where edges or corners are closest, the one
/// point is theirs, and none is told for shapes that only pass each other.
#[test]
fn shapes_apart_tell_their_distance() {
    use crate::shape::Support;
    use crate::shape::distance::closest;
    let mut random = Random(0x4444_3333_2222_1111);
    let all = &shapes()[..4];
    let (mut apart, mut lost, mut early, mut late) = (0, 0, 0, 0);
    for _ in 0..20_000 {
        let (a, b) = (&all[random.0 as usize % 3], &all[random.0 as usize / 7 % 3]);
        let pose = Pose::new(random.direction() * random.between(0.5, 1.3), random.rotation());
        let Some(c) = closest(&Support::new(a).unwrap(), &Support::new(b).unwrap(), &pose) else { continue };
        let m = contacts(a, b, &pose, 0.1);
        if c.distance < 0.1 {
            apart += 1;
            lost += m.points().is_empty() as u32;
            late += (!m.points().is_empty() && lowest(&m) > c.distance + 0.02) as u32;
            early += (!m.points().is_empty() && lowest(&m) < c.distance - 0.02) as u32;
        }
    }
    assert!(apart > 1000 && lost == 0 && early * 50 < apart && late * 50 < apart, "{apart} {lost} {early} {late}");
}

/// A rock in the ground touches it with its lowest corner, also where two of its faces meet almost flat and the one that
/// looks straighter down ends before that corner.
#[test]
fn the_deepest_corner_is_in_the_manifold() {
    let mut random = Random(77);
    let corner = |x: Real, z: Real| Vec3::new(50.0 * x, 50.0, 50.0 * z);
    let square = vec![corner(-1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0), corner(1.0, -1.0)];
    let grounds = [Shape::cuboid(Vec3::splat(50.0)).unwrap(), Shape::mesh(square, vec![[0, 1, 2], [0, 2, 3]]).unwrap()];
    // A prism whose side is bent by a third of a degree, and rocks.
    let bent = [(0.5, -0.35, 0.0), (-0.25, -0.35, 0.43), (-0.25, -0.35, -0.43), (0.3, 0.4, 0.0), (-0.15, 0.4, 0.26)];
    let mut hulls = vec![Shape::hull(&bent.map(|(x, y, z)| Vec3::new(x, y, z))).unwrap()];
    for count in 6..20 {
        hulls.push(Shape::hull(&(0..count).map(|_| random.direction() * 0.5).collect::<Vec<_>>()).unwrap());
    }
    for round in 0..3000 {
        let shape = &hulls[round % hulls.len()];
        let Shape::Hull(hull) = shape else { unreachable!() };
        let rotation = random.rotation();
        let low = hull.vertices().iter().map(|&v| rotation.rotate(v).y).fold(Real::MAX, Real::min);
        let depth = random.between(0.0, 0.1);
        let position = Vec3::new(random.between(-5.0, 5.0), 50.0 - low - depth, random.between(-5.0, 5.0));
        for ground in &grounds {
            let found = lowest(&contacts(ground, shape, &Pose::new(position, rotation), 0.02));
            assert!((found + depth).abs() < 1e-4, "round {round}: {found}, the corner is at {}", -depth);
        }
    }
}
