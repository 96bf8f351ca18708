//! Mesh contacts against planes, grooves, ridges and corners whose contacts are known, and against brute force.

use super::*;
use crate::math::{Rotation, max, min};
use crate::shape::{HeightField, ShapeError, TriangleMesh};

/// Numbers from a linear congruential generator, in `[-1, 1)`.
struct Random(u64);

impl Random {
    fn next(&mut self) -> Real {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 40) as Real) / 8_388_608.0 - 1.0
    }

    fn vector(&mut self) -> Vec3 {
        Vec3::new(self.next(), self.next(), self.next())
    }

    fn rotation(&mut self) -> Rotation {
        loop {
            let (v, w) = (self.vector(), self.next());
            let q = Rotation::from_xyzw(v.x, v.y, v.z, w);
            if (0.01..1.0).contains(&q.dot(q)) {
                return q.normalize();
            }
        }
    }
}

/// A floor of `cells × cells` squares of side `size` about the origin at height `y(x, z)`.
fn floor(cells: u32, size: Real, y: impl Fn(Real, Real) -> Real) -> TriangleMesh {
    let side = cells + 1;
    let at = |i: u32| (i as Real - 0.5 * cells as Real) * size;
    let vertices =
        (0..side * side).map(|i| Vec3::new(at(i % side), y(at(i % side), at(i / side)), at(i / side))).collect();
    let mut triangles = Vec::new();
    for cell in 0..cells * cells {
        let i = cell / cells * side + cell % cells;
        triangles.extend([[i, i + side, i + 1], [i + 1, i + side, i + side + 1]]);
    }
    TriangleMesh::new(vertices, triangles).unwrap()
}

/// The surface of a box, each side cut into `cuts × cuts` squares.
fn block(half: Vec3, cuts: u32) -> TriangleMesh {
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for (u, v) in [(Vec3::X, Vec3::Y), (Vec3::Y, Vec3::Z), (Vec3::Z, Vec3::X)] {
        for (u, v) in [(u, v), (v, u)] {
            let start = vertices.len() as u32;
            let at = |i: u32| 2.0 * i as Real / cuts as Real - 1.0;
            for i in 0..=cuts {
                vertices.extend((0..=cuts).map(|j| (u * at(i) + v * at(j) + u.cross(v)) * half));
            }
            for cell in 0..cuts * cuts {
                let i = start + cell / cuts * (cuts + 1) + cell % cuts;
                let (right, up) = (i + cuts + 1, i + 1);
                triangles.extend([[i, right, up], [up, right, right + 1]]);
            }
        }
    }
    TriangleMesh::new(vertices, triangles).unwrap()
}

fn touch(mesh: &TriangleMesh, shape: &Shape, pose: &Pose) -> Manifold {
    let mut manifold = Manifold::EMPTY;
    collide(Surface::Mesh(mesh), shape, pose, 0.02, &mut manifold);
    manifold
}

fn at(x: Real, y: Real, z: Real) -> Pose {
    Pose::from_position(Vec3::new(x, y, z))
}

fn some_shapes() -> Result<[Shape; 4], ShapeError> {
    let points: Vec<Vec3> = (0..20).scan(Random(5), |r, _| Some(r.vector().normalize() * 0.6)).collect();
    Ok([
        Shape::sphere(0.5)?,
        Shape::capsule(0.5, 0.3)?,
        Shape::cuboid(Vec3::new(0.5, 0.3, 0.7))?,
        Shape::hull(&points)?,
    ])
}

/// How far the lowest point of a shape is from its origin, by brute force.
fn lowest(shape: &Shape, pose: &Pose) -> Real {
    match shape {
        Shape::Hull(hull) => {
            hull.vertices().iter().map(|v| pose.transform_point(*v).y).fold(Real::MAX, crate::math::min)
        }
        _ => shape.aabb(pose).min.y,
    }
}

/// Whatever triangles a shape lies over, a flat floor answers as the plane does.
#[test]
fn a_flat_floor_is_a_plane() {
    let mut random = Random(11);
    let floors = [floor(100, 1.0, |_, _| 0.0), floor(100, 0.13, |_, _| 0.0), floor(2, 50.0, |_, _| 0.0)];
    for shape in some_shapes().unwrap() {
        for i in 0..600 {
            let mesh = &floors[i % 3];
            let mut pose = Pose::new(random.vector() * 4.0, random.rotation());
            // From 8 cm deep to just inside the margin.
            pose.position.y += -0.03 + 0.0499 * random.next() - lowest(&shape, &pose);
            let bottom = lowest(&shape, &pose);
            let manifold = touch(mesh, &shape, &pose);
            let mut deepest = Real::MAX;
            for point in manifold.points() {
                assert!((point.normal - Vec3::Y).length() < 1e-6, "{i} {shape:?} {pose:?} {manifold:?}");
                assert!(point.point1.y.abs() < 1e-5);
                deepest = deepest.min(point.separation);
            }
            assert!((deepest - bottom).abs() < 1e-5, "{i} {deepest} {bottom} {shape:?} {pose:?} {manifold:?}");
        }
    }
}

/// A box lying flat keeps its four corners, on few triangles and on hundreds, turned any way.
#[test]
fn a_flat_box_keeps_its_corners() {
    let mut random = Random(12);
    let shape = Shape::cuboid(Vec3::new(0.5, 0.25, 0.8)).unwrap();
    for mesh in [floor(2, 50.0, |_, _| 0.0), floor(20, 1.0, |_, _| 0.0), floor(100, 0.05, |_, _| 0.0)] {
        for i in 0..100 {
            let turn = Rotation::from_xyzw(0.0, random.next(), 0.0, random.next()).normalize();
            let turn = if i % 4 == 0 { Rotation::IDENTITY } else { turn };
            let place = if i % 8 == 0 { Vec3::ZERO } else { random.vector() * 0.7 };
            let pose = Pose::new(Vec3::new(place.x, 0.249, place.z), turn);
            let manifold = touch(&mesh, &shape, &pose);
            assert_eq!(manifold.points().len(), 4);
            for corner in 0..4 {
                let corner = Vec3::new([-0.5, 0.5][corner & 1], -0.25, [-0.8, 0.8][corner >> 1]);
                let corner = pose.transform_point(corner);
                let nearest = manifold.points().iter().map(|p| (p.point2() - corner).length()).fold(9.0, Real::min);
                assert!(nearest < 1e-4, "{i}: no point at {corner:?}: {manifold:?}");
            }
            for p in manifold.points() {
                assert!((p.separation + 0.001).abs() < 1e-5 && p.normal == Vec3::Y);
            }
        }
    }
}

/// Two planes at 90° that meet at the bottom: two points on each side.
#[test]
fn a_box_in_a_groove_touches_both_sides() {
    let mesh = floor(8, 1.0, |x, _| x.abs());
    let s = (0.5_f32).sqrt();
    let eighth = Rotation::from_xyzw(0.0, 0.0, 0.38268343, 0.9238795);
    let shape = Shape::cuboid(Vec3::splat(0.5)).unwrap();
    let pose = Pose::new(Vec3::new(0.0, s * 2.0 * 0.499, 0.1), eighth);
    let manifold = touch(&mesh, &shape, &pose);
    assert_eq!(manifold.points().len(), 4, "{manifold:?}");
    for side in [-1.0, 1.0] {
        let normal = Vec3::new(side * s, s, 0.0);
        let points: Vec<_> = manifold.points().iter().filter(|p| (p.normal - normal).length() < 1e-5).collect();
        assert_eq!(points.len(), 2, "{manifold:?}");
        assert!(points.iter().all(|p| (p.separation + 0.001).abs() < 1e-4));
        assert!((points[0].point1 - points[1].point1).length() > 0.9);
    }
    for shape in [Shape::sphere(0.5).unwrap(), Shape::capsule(0.3, 0.5).unwrap()] {
        let lying = Rotation::from_xyzw(s, 0.0, 0.0, s);
        let manifold = touch(&mesh, &shape, &Pose::new(Vec3::new(0.0, 0.499 / s, 0.1), lying));
        for side in [-1.0, 1.0] {
            let normal = Vec3::new(side * s, s, 0.0);
            assert!(manifold.points().iter().any(|p| (p.normal - normal).length() < 1e-5), "{manifold:?}");
        }
        assert!(manifold.points().iter().all(|p| (p.separation + 0.001).abs() < 1e-4));
    }
}

/// Three walls that meet at the origin: at least a point on each.
#[test]
fn a_box_in_a_corner_touches_three_walls() {
    let vertices = vec![Vec3::ZERO, Vec3::X * 5.0, Vec3::Y * 5.0, Vec3::Z * 5.0];
    let mesh = TriangleMesh::new(vertices, vec![[0, 3, 1], [0, 1, 2], [0, 2, 3]]).unwrap();
    for shape in [Shape::cuboid(Vec3::splat(0.5)).unwrap(), Shape::sphere(0.5).unwrap()] {
        let manifold = touch(&mesh, &shape, &at(0.499, 0.498, 0.497));
        for (normal, depth) in [(Vec3::X, 0.001), (Vec3::Y, 0.002), (Vec3::Z, 0.003)] {
            assert!(
                manifold.points().iter().any(|p| p.normal == normal && (p.separation + depth).abs() < 1e-5),
                "{manifold:?}"
            );
        }
    }
}

/// A roof: on its ridge, normals lie between those of its sides, and a level box is held straight up.
#[test]
fn a_ridge_pushes_between_its_sides() {
    let mesh = floor(8, 1.0, |x, _| -0.5 * x.abs());
    for shape in some_shapes().unwrap() {
        let mut random = Random(3);
        for _ in 0..200 {
            let mut pose = Pose::new(Vec3::new(0.05 * random.next(), 0.0, random.next()), random.rotation());
            pose.position.y = 0.3 - 0.03 * random.next().abs();
            for p in touch(&mesh, &shape, &pose).points() {
                let tilt = p.normal.x / p.normal.y;
                assert!(
                    p.normal.y > 0.89 && tilt.abs() < 0.51 && p.normal.z.abs() < 0.025,
                    "{pose:?} {p:?} {:?}",
                    shape.inner_radius()
                );
            }
        }
    }
    let manifold = touch(&mesh, &Shape::cuboid(Vec3::new(0.6, 0.3, 0.7)).unwrap(), &at(0.0, 0.299, 0.03));
    assert!(manifold.points().len() >= 2);
    assert!(manifold.points().iter().all(|p| (p.normal - Vec3::Y).length() < 1e-6));
    assert!(manifold.points().iter().any(|p| p.point1.z > 0.7) && manifold.points().iter().any(|p| p.point1.z < -0.6));
    let manifold = touch(&mesh, &Shape::sphere(0.3).unwrap(), &at(0.0, 0.299, 0.03));
    assert_eq!(manifold.points().len(), 1);
    assert!((manifold.points()[0].normal - Vec3::Y).length() < 1e-5);
    assert!((manifold.points()[0].separation + 0.001).abs() < 1e-5);
}

/// A box hanging over the edge of a block, rocked by any small angle, is held up and never pushed off sideways.
#[test]
fn an_overhanging_box_is_not_pushed_sideways() {
    let blocks = [1, 3, 40].map(|cuts| block(Vec3::new(2.0, 1.0, 3.0), cuts));
    let mut random = Random(4);
    let shape = Shape::cuboid(Vec3::new(0.5, 0.3, 0.5)).unwrap();
    for i in 0..3000 {
        let rock = random.vector() * 0.05;
        let turn = Rotation::from_xyzw(rock.x, 0.3 * random.next(), rock.z, 1.0).normalize();
        let mut pose = Pose::new(Vec3::new(2.0 + 0.4 * random.next(), 0.0, 2.9 * random.next()), turn);
        pose.position.y = 1.0 - lowest(&shape, &pose) - 0.002;
        let manifold = touch(&blocks[i % 3], &shape, &pose);
        for p in manifold.points() {
            assert!(p.separation > -0.003, "{i} {pose:?} {manifold:?}");
            if p.separation < 0.0 {
                assert!(p.normal.y > 0.95, "{i} {pose:?} {manifold:?}");
            }
        }
    }
}

/// One-sided: from behind nothing, from the front also when most of the shape has sunk. Two-sided: the nearer side.
#[test]
fn the_side_of_the_centre_decides() {
    let square = vec![
        Vec3::new(-5.0, 0.0, -5.0),
        Vec3::new(-5.0, 0.0, 5.0),
        Vec3::new(5.0, 0.0, 5.0),
        Vec3::new(5.0, 0.0, -5.0),
    ];
    let triangles = vec![[0, 1, 2], [0, 2, 3]];
    let one = TriangleMesh::new(square.clone(), triangles.clone()).unwrap();
    let two = TriangleMesh::with_sides(square, triangles, MeshSides::Two).unwrap();
    let mut random = Random(9);
    for shape in some_shapes().unwrap() {
        for _ in 0..50 {
            let turn = random.rotation();
            for depth in [0.01, 0.1, 0.2] {
                let center = match &shape {
                    Shape::Hull(hull) => turn.rotate(hull.centroid()),
                    _ => Vec3::ZERO,
                };
                let front = Pose::new(Vec3::new(0.3, depth, 0.2) - center, turn);
                let back = Pose::new(Vec3::new(0.3, -depth, 0.2) - center, turn);
                assert!(touch(&one, &shape, &back).points().is_empty());
                for (mesh, pose, normal) in [(&one, front, Vec3::Y), (&two, front, Vec3::Y), (&two, back, -Vec3::Y)] {
                    let manifold = touch(mesh, &shape, &pose);
                    assert!(manifold.points().iter().any(|p| p.separation < 0.0), "{shape:?} {pose:?}");
                    assert!(manifold.points().iter().all(|p| p.normal == normal), "{shape:?} {pose:?} {manifold:?}");
                }
            }
        }
    }
}

/// Features keep their numbers while a shape slides over seams.
#[test]
fn features_survive_sliding() {
    let mesh = floor(100, 0.1, |_, _| 0.0);
    let shape = Shape::cuboid(Vec3::splat(0.25)).unwrap();
    let turn = Rotation::from_xyzw(0.0, 0.2, 0.0, 1.0).normalize();
    let features = |x: Real| {
        let pose = Pose::new(Vec3::new(x, 0.249, 0.03), turn);
        let mut features: Vec<u32> = touch(&mesh, &shape, &pose).points().iter().map(|p| p.feature).collect();
        features.sort_unstable();
        features
    };
    let start = features(0.0);
    assert_eq!(start.len(), 4);
    for i in 1..200 {
        assert_eq!(features(0.0137 * i as Real), start);
    }
}

/// On a bumpy terrain whatever overlaps a triangle from its front has a point, and no point lies: the separation is
/// never deeper than the shape reaches under the triangle's plane.
#[test]
fn overlap_never_goes_unanswered() {
    let mut bumps = Random(21);
    let heights: Vec<Real> = (0..41 * 41).map(|_| 0.15 * bumps.next()).collect();
    let mesh = floor(40, 0.4, |x, z| {
        let (i, j) = ((x / 0.4 + 20.5) as usize, (z / 0.4 + 20.5) as usize);
        heights[j * 41 + i]
    });
    let mut random = Random(22);
    for shape in some_shapes().unwrap() {
        let mut touching = 0;
        for i in 0..1500 {
            let pose = Pose::new(random.vector() * Vec3::new(6.0, 0.3, 6.0) + Vec3::Y * 0.5, random.rotation());
            let manifold = touch(&mesh, &shape, &pose);
            let deepest = manifold.points().iter().map(|p| p.separation).fold(Real::MAX, Real::min);
            if overlaps_in_front(&mesh, &shape, &pose) {
                touching += 1;
                assert!(deepest <= 1e-4, "{i} {shape:?} {pose:?} {manifold:?}");
            }
            for p in manifold.points() {
                assert!(p.normal.is_normalized() && p.separation <= 0.02 + 1e-6 && p.separation > -1.2);
                assert!(p.normal.y > 0.2, "{i} {pose:?} {manifold:?}");
            }
        }
        assert!(touching > 200, "{touching}");
    }
}

/// Whether some triangle of which the shape's centre is in front overlaps the shape, sampled: points of the triangle
/// that lie inside the shape by more than a tenth of a millimetre.
fn overlaps_in_front(mesh: &TriangleMesh, shape: &Shape, pose: &Pose) -> bool {
    let mut found = false;
    mesh.for_each_triangle(&shape.aabb(pose), |[a, b, c], _| {
        let center = match shape {
            Shape::Hull(hull) => pose.transform_point(hull.centroid()),
            _ => pose.position,
        };
        if (b - a).cross(c - a).dot(center - a) <= 0.0 {
            return;
        }
        for i in 0..=12 {
            for j in 0..=12 - i {
                let point = a + (b - a) * (i as Real / 12.0) + (c - a) * (j as Real / 12.0);
                found |= inside(shape, pose.inverse_transform_point(point)) < -1e-4;
            }
        }
    });
    found
}

/// Signed distance from a shape in its own frame; for polyhedra the distance inside is exact, outside a lower bound.
fn inside(shape: &Shape, p: Vec3) -> Real {
    match shape {
        Shape::Sphere(s) => p.length() - s.radius(),
        Shape::Capsule(c) => (p - Vec3::Y * p.y.clamp(-c.half_length(), c.half_length())).length() - c.radius(),
        Shape::Cuboid(c) => (p.abs() - c.half_extents()).max_element(),
        Shape::Hull(h) => h.planes().iter().map(|f| f.normal.dot(p) - f.offset).fold(-Real::MAX, Real::max),
        _ => Real::MAX,
    }
}

/// A single triangle: with the shape's centre in front, contacts exist exactly where the two are closer than the margin
/// along every axis, and a sphere's separation is its exact distance.
#[test]
fn one_triangle_matches_brute_force() {
    let mut random = Random(31);
    for _ in 0..3000 {
        let corners: Vec<Vec3> = (0..3).map(|_| random.vector()).collect();
        let Ok(mesh) = TriangleMesh::new(corners.clone(), vec![[0, 1, 2]]) else { continue };
        let normal = mesh.facet(0).normal();
        let center = random.vector() * 1.5;
        if normal.dot(center - corners[0]) < 0.01 {
            continue;
        }
        let mut distance = Real::MAX;
        for i in 0..=100 {
            for j in 0..=100 - i {
                let (s, t) = (i as Real / 100.0, j as Real / 100.0);
                let point = corners[0] + (corners[1] - corners[0]) * s + (corners[2] - corners[0]) * t;
                distance = distance.min((point - center).length());
            }
        }
        let manifold = touch(&mesh, &Shape::sphere(0.4).unwrap(), &Pose::from_position(center));
        if distance - 0.4 < 0.019 {
            assert_eq!(manifold.points().len(), 1);
            let p = manifold.points()[0];
            assert!(p.separation <= distance - 0.4 + 1e-5 && p.separation > distance - 0.4 - 0.02);
            assert!((p.point1 + p.normal * (p.separation + 0.4) - center).length() < 1e-5);
        } else if distance - 0.4 > 0.04 {
            assert!(manifold.points().is_empty());
        }
    }
}

/// The penetration along the chosen axis is the least of all axes (faces of the solid, the triangle's face, all cross
/// products of edges) that push in front of the triangle, and none where one of them shows a gap.
#[test]
fn one_triangle_against_solids_matches_all_axes() {
    let mut random = Random(32);
    let shapes = some_shapes().unwrap();
    let mut seen = [0, 0];
    for i in 0..4000 {
        let corners: Vec<Vec3> = (0..3).map(|_| random.vector()).collect();
        let Ok(mesh) = TriangleMesh::new(corners.clone(), vec![[0, 1, 2]]) else { continue };
        let shape = &shapes[2 + i % 2];
        let pose = Pose::new(random.vector(), random.rotation());
        let (vertices, normals, edges) = match shape {
            Shape::Hull(h) => {
                (h.vertices().to_vec(), h.planes().iter().map(|p| p.normal).collect(), h.edge_directions().to_vec())
            }
            _ => {
                let h = Vec3::new(0.5, 0.3, 0.7);
                let v = (0..8).map(|i| h * Vec3::new([-1.0, 1.0][i & 1], [-1.0, 1.0][i >> 1 & 1], [-1.0, 1.0][i >> 2]));
                (v.collect::<Vec<_>>(), vec![Vec3::X, Vec3::Y, Vec3::Z], vec![Vec3::X, Vec3::Y, Vec3::Z])
            }
        };
        let center = match shape {
            Shape::Hull(h) => pose.transform_point(h.centroid()),
            _ => pose.position,
        };
        let face = mesh.facet(0).normal();
        if face.dot(center - corners[0]) < 0.05 {
            continue;
        }
        let mut axes: Vec<Vec3> = normals.iter().map(|n: &Vec3| pose.rotation.rotate(*n)).collect();
        axes.push(face);
        for e in &edges {
            for k in 0..3 {
                let cross = pose.rotation.rotate(*e).cross(corners[(k + 1) % 3] - corners[k]);
                if cross.length() > 1e-3 {
                    axes.push(cross.normalize());
                }
            }
        }
        let (mut widest, mut least) = (-Real::MAX, -Real::MAX);
        for axis in axes.iter().flat_map(|a| [*a, -*a]) {
            let low = vertices.iter().map(|v| axis.dot(pose.transform_point(*v))).fold(Real::MAX, Real::min);
            let high = corners.iter().map(|c| axis.dot(*c)).fold(-Real::MAX, Real::max);
            widest = widest.max(low - high);
            if axis.dot(face) > 0.0 {
                least = least.max(low - high);
            }
        }
        let manifold = touch(&mesh, shape, &pose);
        let deepest = manifold.points().iter().map(|p| p.separation).fold(Real::MAX, Real::min);
        if widest > 0.0201 {
            assert!(manifold.points().is_empty(), "{i} {widest} {manifold:?}");
        } else if widest < -1e-3 && widest == least {
            seen[0] += 1;
            assert!(deepest < 0.0, "{i} {widest} {least} {manifold:?}");
            assert!(deepest > least - 0.01, "{i} deeper than the least axis: {deepest} {least} {pose:?} {manifold:?}");
            seen[1] += u32::from((deepest - least).abs() < 2e-3);
        }
    }
    assert!(seen[0] > 300 && seen[1] * 10 > seen[0] * 7, "{seen:?}");
}

/// A slab larger than the buffer of points by far: the corners of the floor's own rim bound the patch.
#[test]
fn a_huge_box_on_thousands_of_triangles_keeps_the_rim() {
    let mesh = floor(100, 0.1, |_, _| 0.0);
    let manifold = touch(&mesh, &Shape::cuboid(Vec3::new(50.0, 1.0, 50.0)).unwrap(), &at(0.3, 0.999, 0.1));
    assert_eq!(manifold.points().len(), 4);
    for p in manifold.points() {
        assert!((p.point1.x.abs() - 5.0).abs() < 1e-3 && (p.point1.z.abs() - 5.0).abs() < 1e-3, "{manifold:?}");
        assert!((p.separation + 0.001).abs() < 1e-5 && p.normal == Vec3::Y);
    }
}

/// A slope a kilometre from the origin, its corners rounded to 30 µm: the normal stays the slope's to a ten thousandth
/// (the rounding), whichever seams the shape lies over.
#[test]
fn a_rounded_slope_has_no_bumps() {
    let slope = 0.75;
    let far = Vec3::new(1000.3, 500.7, -800.1);
    let flat = floor(60, 0.7, |x, _| x * slope);
    let vertices: Vec<Vec3> = flat.vertices().iter().map(|v| *v + far).collect();
    let mesh = TriangleMesh::new(vertices, flat.triangles().to_vec()).unwrap();
    let normal = Vec3::new(-0.6, 0.8, 0.0);
    let mut random = Random(41);
    for shape in some_shapes().unwrap() {
        for _ in 0..300 {
            let turn = random.rotation();
            let down = turn.inverse_rotate(-normal);
            let below = match &shape {
                Shape::Sphere(s) => s.radius(),
                Shape::Capsule(c) => c.radius() + down.y.abs() * c.half_length(),
                Shape::Cuboid(c) => down.abs().dot(c.half_extents()),
                Shape::Hull(h) => down.dot(h.support(down).1),
                _ => 0.0,
            };
            let (x, z) = (8.0 * random.next(), 8.0 * random.next());
            let pose = Pose::new(Vec3::new(x, x * slope, z) + far + normal * (below - 0.005), turn);
            let manifold = touch(&mesh, &shape, &pose);
            let deepest = manifold.points().iter().map(|p| p.separation).fold(9.0, Real::min);
            assert!((deepest + 0.005).abs() < 2e-4, "{deepest} {pose:?}");
            for p in manifold.points() {
                assert!((p.normal - normal).length() < 3e-4, "{shape:?} {pose:?} {p:?}");
            }
        }
    }
}

/// A floor with dents: whatever lies level on it is never tripped, that is pushed along a normal steeper than the
/// steepest dent, by the sides of the dents' triangles.
#[test]
fn small_dents_do_not_trip() {
    let mut random = Random(51);
    for dent in [1e-4, 1e-3, 5e-3] {
        let heights: Vec<Real> = (0..61 * 61).map(|_| dent * random.next()).collect();
        let mesh = floor(60, 0.25, |x, z| heights[(z / 0.25 + 30.5) as usize * 61 + (x / 0.25 + 30.5) as usize]);
        let steepest = (0..mesh.triangles().len()).map(|i| (mesh.facet(i).normal() - Vec3::Y).length());
        let steepest = steepest.fold(0.0, Real::max);
        for shape in some_shapes().unwrap() {
            for _ in 0..300 {
                let turn = Rotation::from_xyzw(0.0, random.next(), 0.0, random.next()).normalize();
                let mut pose = Pose::new(random.vector() * 4.0, turn);
                pose.position.y = 0.0;
                pose.position.y = -lowest(&shape, &pose) - 0.002;
                for p in touch(&mesh, &shape, &pose).points() {
                    let tilt = (p.normal - Vec3::Y).length();
                    assert!(tilt <= 1.5 * steepest + 2e-3, "{dent} {tilt} {steepest} {pose:?} {p:?} {shape:?}");
                }
            }
        }
    }
}

/// Poses and shapes that overflow single precision give no nonsense and no panic; a margin of zero still finds overlaps.
#[test]
fn extreme_numbers_are_survived() {
    let mesh = floor(10, 1.0, |x, z| 0.2 * ((x + 2.0 * z) as i32 % 3) as Real);
    let mut random = Random(61);
    for scale in [0.0, 1e-30, 1e10, 1e18, 1e25, 1e38, Real::INFINITY, Real::NAN] {
        for shape in some_shapes().unwrap() {
            for p in touch(&mesh, &shape, &Pose::new(Vec3::Y * scale, random.rotation())).points() {
                assert!(p.normal.is_normalized() && p.point1.is_finite());
            }
        }
        if let Ok(shape) = Shape::cuboid(Vec3::splat(scale)) {
            for p in touch(&mesh, &shape, &at(0.1, 0.9 * scale, 0.2)).points() {
                assert!(p.normal.is_normalized() && p.point1.is_finite() && p.separation.is_finite());
            }
        }
    }
    let mut manifold = Manifold::EMPTY;
    let flat = floor(10, 1.0, |_, _| 0.0);
    for shape in some_shapes().unwrap() {
        let mut pose = Pose::new(Vec3::ZERO, random.rotation());
        pose.position.y = -lowest(&shape, &pose) - 0.01;
        collide(Surface::Mesh(&flat), &shape, &pose, 0.0, &mut manifold);
        assert!(manifold.points().iter().any(|p| (p.separation + 0.01).abs() < 1e-5));
        pose.position.y += 0.011;
        collide(Surface::Mesh(&flat), &shape, &pose, 0.0, &mut manifold);
        assert!(manifold.points().is_empty());
    }
}

/// Tiles of unlike size, whose corners lie amid the neighbours' edges, are one floor.
#[test]
fn unlike_tiles_make_one_floor() {
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for (start, size, count) in [(-4.0, 4.0, 2), (0.0, 0.7, 12)] {
        for tile in 0..count * count {
            let (i, j) = ((tile % count) as Real, (tile / count) as Real);
            let low = Vec3::new(start + i * size, 0.0, -4.0 + j * size);
            if size == 4.0 && i > 0.0 {
                continue;
            }
            let first = vertices.len() as u32;
            vertices.extend([low, low + Vec3::Z * size, low + Vec3::X * size, low + (Vec3::X + Vec3::Z) * size]);
            triangles.extend([[first, first + 1, first + 2], [first + 2, first + 1, first + 3]]);
        }
    }
    let mesh = TriangleMesh::new(vertices, triangles).unwrap();
    let mut random = Random(71);
    for shape in some_shapes().unwrap() {
        for _ in 0..500 {
            let turn = random.rotation();
            let mut pose = Pose::new(Vec3::new(0.5 * random.next(), 0.0, 2.0 * random.next()), turn);
            pose.position.y = -lowest(&shape, &pose) - 0.005;
            let manifold = touch(&mesh, &shape, &pose);
            assert!(manifold.points().iter().all(|p| p.normal == Vec3::Y), "{shape:?} {pose:?} {manifold:?}");
            assert!(manifold.points().iter().any(|p| (p.separation + 0.005).abs() < 1e-5));
        }
    }
}

/// A floor of fans of slivers a tenth of the shape's size wide: shapes pushed in as deep as a fast landing leaves them keep
/// their deepest point, and go straight up.
#[test]
fn deep_shapes_on_slivers_keep_their_deepest_point() {
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    // Each strip of 4 m × 6 m is a fan about a corner of its own, whose other side is cut finely.
    for strip in 0..2 {
        let (first, left) = (vertices.len() as u32, 4.0 * strip as Real - 4.0);
        vertices.push(Vec3::new(left, 0.0, -3.0));
        vertices.extend((0..=100).map(|i| Vec3::new(left + 4.0, 0.0, -3.0 + 0.06 * i as Real)));
        vertices.push(Vec3::new(left, 0.0, 3.0));
        triangles.extend((1..=101).map(|i| [first, first + i + 1, first + i]));
    }
    let mesh = TriangleMesh::new(vertices, triangles).unwrap();
    let mut random = Random(83);
    for shape in some_shapes().unwrap() {
        for round in 0..400 {
            let mut pose = Pose::new(Vec3::new(random.next(), 0.0, random.next()), random.rotation());
            let depth = 0.9 * shape.inner_radius() * (round % 10) as Real / 10.0;
            pose.position.y = -lowest(&shape, &pose) - depth;
            let manifold = touch(&mesh, &shape, &pose);
            assert!(manifold.points().iter().all(|p| p.normal == Vec3::Y), "{shape:?} {pose:?} {manifold:?}");
            let deepest = manifold.points().iter().fold(Real::MAX, |m, p| min(m, p.separation));
            assert!((deepest + depth).abs() < 1e-4, "{shape:?} {pose:?}: {deepest}, not {depth} deep");
        }
    }
}

/// A box on a floor beside a wall of the same mesh, nearer than the margin: the floor's points alone hold it up however it
/// is tipped by rounding, so its middle is well inside of them.
#[test]
fn a_box_beside_a_wall_stands_on_the_floor() {
    let mut vertices: Vec<Vec3> = vec![];
    let mut triangles = vec![];
    for quad in [[[-5, 0, -5], [-5, 0, 5], [5, 0, -5], [5, 0, 5]], [[0, 0, 5], [0, 3, 5], [0, 0, -5], [0, 3, -5]]] {
        let first = vertices.len() as u32;
        vertices.extend(quad.map(|corner: [i8; 3]| Vec3::from(corner.map(Real::from))));
        triangles.extend([[first, first + 1, first + 2], [first + 2, first + 1, first + 3]]);
    }
    let mesh = TriangleMesh::with_sides(vertices, triangles, MeshSides::Two).unwrap();
    let half = Vec3::new(0.3, 0.5, 0.4);
    let shape = Shape::cuboid(half).unwrap();
    for tip in [0.0, 0.002, -0.002, 0.004, -0.004] {
        for gap in [0.002, 0.004, 0.008, 0.015] {
            let turn = Rotation::from_xyzw(tip, 0.0, 0.5 * tip, 1.0).normalize();
            let mut pose = Pose::new(Vec3::new(half.x + gap + tip.abs(), 0.0, 0.3), turn);
            pose.position.y = -lowest(&shape, &pose);
            let manifold = touch(&mesh, &shape, &pose);
            let floor: Vec<Vec3> = manifold.points().iter().filter(|p| p.normal.y > 0.9).map(|p| p.point1).collect();
            for k in 0..64 {
                let outwards = Vec3::new(libm::cosf(0.098_174_8 * k as Real), 0.0, libm::sinf(0.098_174_8 * k as Real));
                let reach = floor.iter().fold(-Real::MAX, |m, p| max(m, outwards.dot(*p - pose.position)));
                assert!(reach > 0.05, "tip {tip}, gap {gap}: falls to {outwards}: {floor:?}");
            }
        }
    }
}

/// A box that leans a little over the rim of a ledge bears on both ends of the stretch of rim under it.
#[test]
fn a_rim_bears_at_both_ends() {
    let mesh = block(Vec3::new(5.0, 1.0, 5.0), 1);
    let half = Vec3::new(0.4, 0.3, 0.5);
    let shape = Shape::cuboid(half).unwrap();
    for roll in [-0.01, -0.004, 0.0, 0.004, 0.01] {
        // Pitched down over the rim at x = 5 by 17°, rolled about its length by little.
        let turn = Rotation::from_xyzw(roll, 0.0, -0.15, 1.0).normalize();
        let mut pose = Pose::new(Vec3::new(5.0, 0.0, 0.0), turn);
        let under = |pose: &Pose, z: Real| {
            // Height of the underside over the rim at this z.
            let (normal, on) = (turn.rotate(-Vec3::Y), pose.transform_point(-Vec3::Y * half.y));
            (normal.dot(on) - normal.x * 5.0 - normal.z * z) / normal.y - 1.0
        };
        pose.position.y = 0.0;
        pose.position.y = -min(under(&pose, -0.5), under(&pose, 0.5)) - 0.002;
        let manifold = touch(&mesh, &shape, &pose);
        let (low, high) = manifold.points().iter().fold((Real::MAX, -Real::MAX), |(low, high), p| {
            assert!((p.point1 - Vec3::new(5.0, 1.0, p.point1.z)).length() < 1e-3, "{p:?}");
            (min(low, p.point1.z), max(high, p.point1.z))
        });
        assert!(low < -0.4 && high > 0.4, "roll {roll}: from {low} to {high}");
    }
}

/// Height fields of all diagonals, with holes: contacts of the four kinds of convex shapes are those of the mesh of the same
/// triangles.
#[test]
fn a_height_field_answers_as_its_mesh_does() {
    use crate::shape::{FieldDiagonals, FieldSide};
    let mut random = Random(77);
    let mut touches = 0;
    for diagonals in [FieldDiagonals::Falling, FieldDiagonals::Rising, FieldDiagonals::Alternating] {
        let heights = (0..30 * 30).map(|_| 0.15 * random.next()).collect();
        let holes: Vec<bool> = (0..29 * 29).map(|cell| cell % 11 == 4).collect();
        let mut field = HeightField::new(heights, 30, [0.4, 0.3]).unwrap().with_diagonals(diagonals);
        field = field.with_holes(&holes).unwrap();
        for side in [FieldSide::LowX, FieldSide::HighX, FieldSide::LowZ, FieldSide::HighZ] {
            field = field.with_end(side);
        }
        let (points, triangles) = Shape::HeightField(field.clone().into()).triangulate(1);
        let mesh = TriangleMesh::new(points, triangles).unwrap();
        for shape in some_shapes().unwrap() {
            for i in 0..200 {
                let place = Vec3::new(5.8, 0.45, 4.35) + random.vector() * Vec3::new(6.0, 0.3, 4.5);
                let pose = Pose::new(place, random.rotation());
                let (mut found, expected) = (Manifold::EMPTY, touch(&mesh, &shape, &pose));
                collide(Surface::Field(&field), &shape, &pose, 0.02, &mut found);
                // Which four of many points are kept may depend on the order of the triangles; the deepest does not.
                let deepest = |m: &Manifold| {
                    let least = m.points().iter().map(|p| p.separation).fold(Real::MAX, min);
                    *m.points().iter().find(|p| p.separation == least).unwrap()
                };
                if expected.points().is_empty() {
                    assert!(found.points().is_empty(), "{i} {shape:?} {pose:?} {found:?}");
                    continue;
                }
                touches += 1;
                let (found, expected) = (deepest(&found), deepest(&expected));
                assert!((found.separation - expected.separation).abs() < 1e-4, "{i} {shape:?} {found:?} {expected:?}");
                assert!((found.normal - expected.normal).length() < 1e-4, "{i} {shape:?} {found:?} {expected:?}");
            }
        }
    }
    assert!(touches > 500, "{touches}");
}
