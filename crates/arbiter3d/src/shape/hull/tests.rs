//! Laws of the hull builder, checked on solids with known answers and on random clouds.

use super::*;
use crate::math::{Pose, Rotation};
use crate::random::Random;

fn cloud(seed: u64, count: usize) -> Vec<Vec3> {
    let mut random = Random(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1);
    (0..count).map(|_| random.in_ball()).collect()
}

fn grid(steps: usize) -> Vec<Vec3> {
    let at = |i: usize| i as Real / (steps - 1) as Real - 0.5;
    let index = |i: usize| Vec3::new(at(i % steps), at(i / steps % steps), at(i / steps / steps));
    (0..steps * steps * steps).map(index).collect()
}

fn cylinder(sides: usize) -> Vec<Vec3> {
    let ring = |k: usize| {
        let angle = k as f64 * std::f64::consts::TAU / sides as f64;
        (libm::cos(angle) as Real, libm::sin(angle) as Real)
    };
    (0..2 * sides).map(|k| Vec3::new(ring(k / 2).0, if k & 1 == 0 { -0.5 } else { 0.5 }, ring(k / 2).1)).collect()
}

fn rotated(points: &[Vec3], rotation: Rotation, shift: Vec3) -> Vec<Vec3> {
    let pose = Pose { position: shift, rotation };
    points.iter().map(|&point| pose.transform_point(point)).collect()
}

fn tolerance(points: &[Vec3]) -> f64 {
    let largest = points.iter().fold(Vec3::ZERO, |a, p| a.max(p.abs())).as_dvec3();
    3.0 * f64::from(Real::EPSILON) * (largest.x + largest.y + largest.z)
}

fn height(plane: &Plane, point: Vec3) -> f64 {
    plane.normal.as_dvec3().dot(point.as_dvec3()) - f64::from(plane.offset)
}

/// Half edges, Euler's formula, orientation, convexity, distinct vertices.
fn check(hull: &ConvexHull, points: &[Vec3]) {
    let tolerance = tolerance(points);
    let (vertices, edges) = (hull.vertices(), hull.edges());
    assert_eq!(vertices.len() + hull.planes().len(), edges.len() / 2 + 2, "Euler");
    for (i, edge) in edges.iter().enumerate() {
        let twin = edges[i ^ 1];
        assert_eq!(edges[usize::from(edge.next)].origin, twin.origin, "an edge ends where its twin starts");
        assert_eq!(edges[usize::from(edge.next)].face, edge.face);
        assert_ne!(edge.face, twin.face);
    }
    let mut visits = 0;
    for vertex in 0..vertices.len() {
        assert!(edges.iter().filter(|edge| usize::from(edge.origin) == vertex).count() >= 3, "three faces at a corner");
    }
    for (face, plane) in hull.planes().iter().enumerate() {
        assert!((plane.normal.length() - 1.0).abs() < 1e-6);
        let corners: Vec<usize> = hull.face_vertices(face).collect();
        assert!(corners.len() >= 3);
        visits += corners.len();
        let mut area = DVec3::ZERO;
        for k in 0..corners.len() {
            assert!(height(plane, vertices[corners[k]]) > -4.0 * tolerance, "corners lie on their face");
            let (a, b) = (vertices[corners[k]].as_dvec3(), vertices[corners[(k + 1) % corners.len()]].as_dvec3());
            area += (a - vertices[0].as_dvec3()).cross(b - vertices[0].as_dvec3());
        }
        assert!(area.dot(plane.normal.as_dvec3()) > 0.0, "counter-clockwise seen from outside");
        for &vertex in vertices {
            assert!(height(plane, vertex) < tolerance, "convex: {}", height(plane, vertex) / tolerance);
        }
        assert!(height(plane, hull.centroid()) < 0.0);
    }
    assert_eq!(visits, edges.len(), "each half edge belongs to the loop of its face");
    for (i, a) in vertices.iter().enumerate() {
        assert!(points.contains(a), "vertices are input points");
        assert!(vertices[..i].iter().all(|b| f64::from((*a - *b).length()) > 0.9 * tolerance), "welded");
    }
}

/// [`check`], and every input point inside every plane; returns the worst excess in tolerances.
fn check_all_inside(hull: &ConvexHull, points: &[Vec3]) -> f64 {
    check(hull, points);
    let mut worst: f64 = 0.0;
    for plane in hull.planes() {
        for &point in points {
            worst = worst.max(height(plane, point));
        }
    }
    worst /= tolerance(points);
    assert!(worst < 2.5, "a point sticks out by {worst} tolerances");
    worst
}

#[test]
fn known_solids_have_their_vertices_edges_and_faces() {
    let tetrahedron = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z];
    let octahedron = [Vec3::X, -Vec3::X, Vec3::Y, -Vec3::Y, Vec3::Z, -Vec3::Z];
    let solids: [(Vec<Vec3>, usize, usize, usize); 6] = [
        (tetrahedron.to_vec(), 4, 6, 4),
        (octahedron.to_vec(), 6, 12, 8),
        (grid(2), 8, 12, 6),
        (grid(3), 8, 12, 6),
        (grid(9), 8, 12, 6),
        (cylinder(32), 64, 96, 34),
    ];
    let mut random = Random(77);
    for (points, vertices, edges, faces) in solids {
        for turn in 0..40 {
            let shift = if turn & 1 == 0 { Vec3::ZERO } else { random.vector() * 10.0 };
            let placed = if turn == 0 { points.clone() } else { rotated(&points, random.rotation(), shift) };
            let hull = ConvexHull::new(&placed).unwrap();
            assert_eq!((hull.vertices().len(), hull.edges().len() / 2, hull.planes().len()), (vertices, edges, faces));
            check_all_inside(&hull, &placed);
        }
    }
}

#[test]
fn a_cube_of_inner_duplicate_and_face_points_is_a_cube() {
    let mut random = Random(5);
    let mut points: Vec<Vec3> = Vec::new();
    for _ in 0..2000 {
        let mut point = random.vector();
        points.push(point);
        point[(random.unit() * 3.0) as usize] = if random.unit() < 0.5 { -1.0 } else { 1.0 };
        points.push(point);
        point[(random.unit() * 3.0) as usize] = 1.0;
        points.push(point);
    }
    for corner in grid(2).iter().chain(&grid(2)) {
        points.push(*corner * 2.0);
        points.push(*corner * 2.0 + Vec3::splat(1e-40));
        points.push(*corner * (2.0 - 1e-7));
    }
    let hull = ConvexHull::new(&points).unwrap();
    assert_eq!((hull.vertices().len(), hull.planes().len()), (8, 6));
    assert_eq!(hull.edge_directions().len(), 3);
    check_all_inside(&hull, &points);
}

#[test]
fn random_clouds_are_inside_their_hulls() {
    for seed in 0..200 {
        let points = cloud(seed, 4 + seed as usize * 96 / 199);
        check_all_inside(&ConvexHull::new(&points).unwrap(), &points);
    }
}

/// One of the clouds that sloppy predicates lose the horizon on: grids and prisms with noise about the size of the
/// rounding, needles, caps hardly bent, all squashed and turned.
fn nearly_degenerate(random: &mut Random, round: usize) -> Vec<Vec3> {
    let small = |exponent: Real| libm::powf(10.0, -exponent);
    let (thin, noise) = (small(7.0 * random.unit()), small(2.0 + 7.0 * random.unit()));
    let seed = 1000 + round as u64;
    let base: Vec<Vec3> = match round % 5 {
        0 => grid(2 + round / 5 % 4),
        1 => cylinder(3 + round % 60),
        2 => cloud(seed, 60).iter().map(|p| p.normalize_or(Vec3::X)).collect(),
        3 => cloud(seed, 30).iter().map(|p| Vec3::new(p.x, p.y * thin * p.x, p.z * thin * p.x)).collect(),
        _ => cloud(seed, 60).iter().map(|p| Vec3::new(p.x, p.y, (1.0 - p.x * p.x - p.y * p.y) * thin)).collect(),
    };
    let squash = Vec3::new(1.0, small(4.0 * random.unit() * random.unit()), small(4.0 * random.unit() * random.unit()));
    let jittered: Vec<Vec3> = base.iter().chain(&base).map(|p| (*p + random.vector() * noise) * squash).collect();
    let shift = if round.is_multiple_of(2) { Vec3::ZERO } else { random.vector() * 3.0 };
    if round.is_multiple_of(3) { jittered } else { rotated(&jittered, random.rotation(), shift) }
}

#[test]
fn nearly_degenerate_clouds_still_make_closed_surfaces() {
    let mut random = Random(99);
    let (mut closed, mut flat) = (0, 0);
    for round in 0..1000 {
        let points = nearly_degenerate(&mut random, round);
        match ConvexHull::new(&points) {
            Ok(hull) => {
                check_all_inside(&hull, &points);
                closed += 1;
            }
            Err(ShapeError::Flat { .. }) => flat += 1,
            Err(error) => panic!("{error}"),
        }
    }
    assert!(closed > 800 && flat > 10, "{closed} closed, {flat} flat: the clouds should be on both sides of the limit");
}

#[test]
fn many_points_can_be_kept_to_few_vertices() {
    let points = cloud(3, 10_000);
    let Err(ShapeError::TooManyFeatures { count, limit, .. }) = ConvexHull::new(&points) else {
        panic!("a ball of ten thousand points has more than 255 corners");
    };
    assert!(count > limit);
    let mut volume = 0.0;
    for max in [4, 16, 64, 255] {
        let hull = ConvexHull::with_max_vertices(&points, max).unwrap();
        assert!(hull.vertices().len() <= max && hull.vertices().len() + 2 >= max);
        check(&hull, &points);
        assert!(hull.mass_properties(1.0).mass > volume, "more vertices fill more of the ball");
        volume = hull.mass_properties(1.0).mass;
    }
    // 4π/3 = 4.19; the best 64 vertices on a sphere reach about 3.8.
    let hull = ConvexHull::with_max_vertices(&points, 64).unwrap();
    assert!(hull.mass_properties(1.0).mass > 3.5);
    assert!(ConvexHull::with_max_vertices(&points, 0).is_ok());
}

#[test]
fn degenerate_input_says_what_is_wrong() {
    let flat = |points: &[Vec3]| matches!(ConvexHull::new(points), Err(ShapeError::Flat { .. }));
    let turn = Random(8).rotation();
    let plane: Vec<Vec3> = cloud(1, 50).iter().map(|p| Vec3::new(p.x, 0.0, p.z)).collect();
    let line: Vec<Vec3> = cloud(2, 50).iter().map(|p| Vec3::splat(p.x)).collect();
    assert!(flat(&plane) && flat(&line) && flat(&[Vec3::ONE; 9]) && flat(&[Vec3::ZERO; 9]));
    assert!(flat(&rotated(&plane, turn, Vec3::ONE)) && flat(&rotated(&line, turn, Vec3::ONE)));
    assert!(flat(&[Vec3::splat(1e6), Vec3::splat(1e6) + Vec3::X, Vec3::splat(1e6), Vec3::splat(1e6)]));
    assert_eq!(ConvexHull::new(&grid(2)[..3]), Err(ShapeError::TooFewPoints { count: 3 }));
    assert_eq!(ConvexHull::new(&[]), Err(ShapeError::TooFewPoints { count: 0 }));
    for bad in [Real::NAN, Real::INFINITY, -Real::INFINITY] {
        let mut points = grid(2);
        points[5].y = bad;
        assert!(matches!(ConvexHull::new(&points), Err(ShapeError::NotFinite { index: 5, .. })));
    }
    for scale in [1e-42, 1e-20, 1e20, 3e38] {
        let points: Vec<Vec3> = grid(2).iter().map(|p| *p * scale).collect();
        assert!(matches!(ConvexHull::new(&points), Err(ShapeError::SizeOutOfRange { .. })));
    }
    assert!(ConvexHull::from_cuboid(Vec3::new(1.0, 0.0, 1.0)).is_err());
}

#[test]
fn the_same_points_give_the_same_hull() {
    for seed in 0..20 {
        let points = cloud(seed, 80);
        assert_eq!(ConvexHull::new(&points), ConvexHull::new(&points.clone()));
    }
}

#[test]
fn size_does_not_change_the_topology() {
    for seed in 0..30_u64 {
        let points = if seed.is_multiple_of(3) { cylinder(5 + seed as usize) } else { cloud(seed, 20 + seed as usize) };
        let hull = ConvexHull::new(&points).unwrap();
        for scale in [1e-6, 1e-3, 1e3, 1e6] {
            let scaled: Vec<Vec3> = points.iter().map(|p| *p * scale).collect();
            let other = ConvexHull::new(&scaled).unwrap();
            assert_eq!(hull.edges(), other.edges());
            assert_eq!(hull.face_edges(), other.face_edges());
            check_all_inside(&other, &scaled);
            let ratio = other.inner_radius() / hull.inner_radius() / scale;
            assert!((ratio - 1.0).abs() < 1e-4);
        }
    }
}

#[test]
fn a_box_hull_has_the_mass_of_the_box_wherever_it_is() {
    let half = Vec3::new(0.3, 1.0, 2.5);
    let cuboid = ConvexHull::from_cuboid(half).unwrap();
    let corners: Vec<Vec3> = grid(2).iter().map(|p| *p * half * 2.0).collect();
    let built = ConvexHull::new(&corners).unwrap();
    assert_eq!(cuboid, built);
    check_all_inside(&cuboid, &corners);
    let exact = crate::Cuboid::new(half).unwrap().mass_properties(700.0);
    let shift = Vec3::new(20.0, -7.0, 3.0);
    let moved: Vec<Vec3> = corners.iter().map(|p| *p + shift).collect();
    for (hull, center) in [(cuboid, Vec3::ZERO), (ConvexHull::new(&moved).unwrap(), shift)] {
        let mass = hull.mass_properties(700.0);
        assert!((mass.mass / exact.mass - 1.0).abs() < 1e-5);
        assert!((mass.center - center).length() < 1e-5);
        let scale = exact.inertia.xx;
        for (a, b) in [
            (mass.inertia.xx, exact.inertia.xx),
            (mass.inertia.yy, exact.inertia.yy),
            (mass.inertia.zz, exact.inertia.zz),
        ] {
            assert!((a / b - 1.0).abs() < 1e-5);
        }
        assert!((mass.inertia.xy.abs() + mass.inertia.xz.abs() + mass.inertia.yz.abs()) < 1e-4 * scale);
        assert!((hull.inner_radius() - 0.3).abs() < 1e-5);
    }
}

/// Columns along z through a random hull, cut by its planes and summed: another way to the same integrals.
#[test]
fn mass_agrees_with_summing_columns() {
    let points: Vec<Vec3> = cloud(12, 30).iter().map(|p| *p + Vec3::new(0.5, 1.0, -2.0)).collect();
    let hull = ConvexHull::new(&points).unwrap();
    let aabb = hull.local_aabb();
    let steps = 400;
    let cell = (aabb.max - aabb.min).as_dvec3() / f64::from(steps);
    let (mut volume, mut first, mut squares, mut xz) = (0.0, DVec3::ZERO, DVec3::ZERO, 0.0);
    for column in 0..steps * steps {
        let x = f64::from(aabb.min.x) + (f64::from(column % steps) + 0.5) * cell.x;
        let y = f64::from(aabb.min.y) + (f64::from(column / steps) + 0.5) * cell.y;
        let (mut low, mut high) = (f64::from(aabb.min.z), f64::from(aabb.max.z));
        for plane in hull.planes() {
            let n = plane.normal.as_dvec3();
            let z = (f64::from(plane.offset) - n.x * x - n.y * y) / n.z;
            if n.z > 0.0 { high = high.min(z) } else { low = low.max(z) }
        }
        if high > low {
            let area = cell.x * cell.y;
            let (length, z) = ((high - low) * area, (high * high - low * low) / 2.0 * area);
            volume += length;
            first += DVec3::new(x * length, y * length, z);
            squares += DVec3::new(x * x * length, y * y * length, (high * high * high - low * low * low) / 3.0 * area);
            xz += x * z;
        }
    }
    let center = first / volume;
    let squares = squares - center * center * volume;
    let mass = hull.mass_properties(1.0);
    let close = |a: Real, b: f64, scale: f64| assert!((f64::from(a) - b).abs() < 1e-3 * scale, "{a} {b}");
    close(mass.mass, volume, volume);
    assert!((mass.center.as_dvec3() - center).length() < 1e-4);
    close(mass.inertia.xx, squares.y + squares.z, squares.element_sum());
    close(mass.inertia.yy, squares.x + squares.z, squares.element_sum());
    close(mass.inertia.zz, squares.x + squares.y, squares.element_sum());
    close(mass.inertia.xz, center.x * center.z * volume - xz, squares.element_sum());
}

#[test]
fn support_is_the_first_farthest_vertex() {
    let mut random = Random(4);
    for seed in 0..20 {
        let hull = if seed == 0 {
            ConvexHull::from_cuboid(Vec3::ONE).unwrap()
        } else {
            ConvexHull::new(&cloud(seed, 4 + 3 * seed as usize)).unwrap()
        };
        for k in 0..100 {
            let axis = [Vec3::X, -Vec3::Y, Vec3::Z, Vec3::ZERO, Vec3::new(-1.0, 0.0, 1.0)];
            let direction = axis.get(k).copied().unwrap_or(random.vector());
            let reach = |v: &Vec3| v.x * direction.x + v.y * direction.y + v.z * direction.z;
            let farthest = hull.vertices().iter().map(reach).fold(-Real::INFINITY, Real::max);
            let first = hull.vertices().iter().position(|v| reach(v) == farthest).unwrap();
            assert_eq!(hull.support(direction), (first, hull.vertices()[first]));
        }
        assert!(hull.support(Vec3::NAN).0 < hull.vertices().len());
    }
}

/// The triangulation that stands in when merging fails is itself a closed convex polyhedron.
#[test]
fn the_fallback_of_plain_triangles_is_valid() {
    for points in [cloud(9, 60), cylinder(20), grid(2), rotated(&grid(2), Random(3).rotation(), Vec3::ONE)] {
        let lattice = Lattice::new(&points).unwrap();
        let exact = TriangulatedHull::new(&lattice.points, lattice.tolerance, 255).unwrap();
        let outlines = triangles_as_outlines(&exact);
        let vertices = exact.sources.iter().map(|&source| points[source]).collect();
        let polyhedron = Polyhedron { vertices, outlines: &outlines, tolerance: lattice.tolerance_in_metres };
        let hull = polyhedron.assemble().unwrap().unwrap();
        assert_eq!(hull.planes().len(), 2 * hull.vertices().len() - 4);
        check_all_inside(&hull, &points);
    }
}

/// Plates and needles half a tolerance to a few tolerances thick: either flat, or a closed surface with three faces at
/// every corner, which does not lose its tip to merging.
#[test]
fn hulls_as_thin_as_the_tolerance_are_valid_or_flat() {
    let mut random = Random(4);
    let (mut closed, mut flat) = (0, 0);
    for round in 0..4000_u64 {
        let thickness = 3.0 * Real::EPSILON;
        let y = thickness * (0.5 + 8.0 * random.unit());
        let z = if round.is_multiple_of(2) { thickness * (0.5 + 8.0 * random.unit()) } else { 1.0 };
        let taper = |x: Real| if round.is_multiple_of(3) { 1.0 } else { (1.0 - x) * 0.5 };
        let count = 5 + (round % 12) as usize;
        let squash = |p: &Vec3| Vec3::new(p.x, p.y * y * taper(p.x), p.z * z * taper(p.x));
        let points: Vec<Vec3> = cloud(round, count).iter().map(squash).collect();
        let points = if round % 5 < 2 { points } else { rotated(&points, random.rotation(), Vec3::ZERO) };
        match ConvexHull::new(&points) {
            Ok(hull) => {
                check_all_inside(&hull, &points);
                closed += 1;
            }
            Err(error) => {
                assert!(matches!(error, ShapeError::Flat { .. }), "{error}");
                flat += 1;
            }
        }
    }
    assert!(closed > 2000 && flat > 500, "{closed} closed, {flat} flat");
}

/// Planes, corners, side planes, borders and rings tell the same as faces, vertices and half edges.
#[test]
fn features_tell_what_the_half_edges_tell() {
    let mut random = Random(0x1357_9BDF_2468_ACE0);
    for count in [4, 7, 12, 33, 80] {
        let points: Vec<Vec3> = (0..count).map(|_| random.in_ball()).collect();
        let hull = ConvexHull::new(&points).unwrap();
        let features = hull.features();
        for lane in 0..features.corners.len() * LANES {
            let group = &features.corners[lane / LANES];
            let corner = Vec3::new(group.x[lane % LANES], group.y[lane % LANES], group.z[lane % LANES]);
            assert_eq!(corner, hull.vertices.get(lane).copied().unwrap_or(hull.vertices[0]));
        }
        let mut met = vec![0; hull.edges.len() / 2];
        for (face, plane) in hull.planes.iter().enumerate() {
            let (group, lane) = (&features.faces[face / LANES], face % LANES);
            assert_eq!(Vec3::new(group.x[lane], group.y[lane], group.z[lane]), plane.normal);
            assert_eq!(group.offset[lane], plane.offset);
            let [start, end] = [face, face + 1].map(|f| usize::from(features.border_starts[f]));
            assert_eq!(end - start, hull.face_vertices(face).count());
            for border in &features.border[start..end] {
                let [left, right] = [0, 1].map(|side| hull.edges[usize::from(border.edge) * 2 + side].face);
                let cosine = hull.planes[usize::from(left)].normal.dot(hull.planes[usize::from(right)].normal);
                assert!((2.0 * border.cosine_squared - 1.0 - cosine).abs() < 1e-6);
                assert!(border.cosine_squared >= group.cosine_squared[lane]);
                assert!([left, right].contains(&(face as u16)));
                met[usize::from(border.edge)] += 1;
            }
        }
        assert!(met.iter().all(|&times| times == 2));
        for (index, edge) in hull.edges.iter().enumerate() {
            let (side, normal) = (features.sides[index], hull.planes[usize::from(edge.face)].normal);
            let ends = [index, index ^ 1].map(|e| hull.vertices[usize::from(hull.edges[e].origin)]);
            assert!(ends.iter().all(|&end| side.distance(end).abs() < 1e-6) && side.normal.dot(normal).abs() < 1e-6);
            assert!((side.normal.length() - 1.0).abs() < 1e-6);
            assert!(hull.face_vertices(usize::from(edge.face)).all(|v| side.distance(hull.vertices[v]) < 1e-6));
            let corner = usize::from(edge.origin);
            let [start, end] = [corner, corner + 1].map(|c| usize::from(features.ring_starts[c]));
            assert!(features.ring_faces[start..end].contains(&edge.face));
        }
        let furthest = hull.vertices.iter().map(|v| (*v - hull.centroid()).length()).fold(0.0, Real::max);
        assert!((features.outer_radius - furthest).abs() < 1e-6);
    }
}

/// The box of a placed hull is that of its placed corners, within rounding, for hulls of 4 to 60 corners in 200 poses.
#[test]
fn the_box_of_a_placed_hull_is_that_of_its_corners() {
    let mut random = Random(177);
    for count in [4, 9, 17, 60] {
        let points: Vec<Vec3> = (0..count).map(|_| random.in_ball() + Vec3::X * 3.0).collect();
        let hull = ConvexHull::new(&points).unwrap();
        for _ in 0..50 {
            let pose = Pose::new(random.in_ball() * 5.0, random.rotation());
            let found = hull.aabb(&pose);
            let wanted = Aabb::from_points(hull.vertices().iter().map(|&v| pose.transform_point(v)));
            assert!((found.min - wanted.min).abs().max_element() < 5e-6, "{found:?} {wanted:?}");
            assert!((found.max - wanted.max).abs().max_element() < 5e-6, "{found:?} {wanted:?}");
        }
    }
}
