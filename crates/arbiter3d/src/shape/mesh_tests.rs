//! The tree and the rays against brute force, the neighbourhood of known edges, and what is refused.

use super::super::mesh_edges::EdgeKind;
use super::*;
use crate::random::Random;

fn soup(random: &mut Random, count: usize, sides: MeshSides) -> TriangleMesh {
    let mut vertices = Vec::new();
    for _ in 0..count {
        let center = random.vector() * 10.0;
        vertices.extend([0; 3].map(|_| center + random.vector()));
    }
    let triangles = (0..count as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    TriangleMesh::with_sides(vertices, triangles, sides).unwrap()
}

#[test]
fn queries_and_rays_match_brute_force() {
    let mut random = Random(1);
    for sides in [MeshSides::One, MeshSides::Two] {
        let mesh = soup(&mut random, 500, sides);
        for _ in 0..300 {
            let aabb = Aabb::from_center(random.vector() * 10.0, Vec3::splat(1.5) + random.vector());
            let mut found = Vec::new();
            mesh.for_each_triangle(&aabb, |_, id| found.push(id));
            found.sort_unstable();
            let boxes = mesh.triangles().iter().map(|t| Aabb::from_points(t.map(|i| mesh.vertices()[i as usize])));
            let expected: Vec<u32> =
                boxes.enumerate().filter(|(_, b)| b.overlaps(&aabb)).map(|(i, _)| i as u32).collect();
            assert_eq!(found, expected);

            let (origin, direction) = (random.vector() * 12.0, random.vector());
            let ray = super::super::surface_ray::SharpRay::new(origin, direction, &mesh.local_aabb()).unwrap();
            let hits = (0..500).filter_map(|i| {
                let (distance, back) = ray.hit(&mesh.corners(i), sides)?;
                let normal = mesh.facet(i).normal();
                assert_eq!(back, normal.dot(direction) > 0.0);
                let normal = if back { -normal } else { normal };
                (distance <= 20.0).then_some(MeshRayHit { distance, normal, triangle: mesh.surroundings(i).id })
            });
            let nearest = hits.min_by(|a, b| (a.distance, a.triangle).partial_cmp(&(b.distance, b.triangle)).unwrap());
            assert_eq!(mesh.cast_ray(origin, direction, 20.0), nearest);
        }
    }
}

#[test]
fn equal_centers_and_doubling_sizes_stay_within_the_stack() {
    let triangles = vec![[0, 1, 2]; 3000];
    let mesh = TriangleMesh::new(vec![Vec3::ZERO, Vec3::Z, Vec3::X], triangles).unwrap();
    let mut count = 0;
    mesh.for_each_triangle(&mesh.local_aabb(), |_, _| count += 1);
    assert_eq!(count, 3000);
    // Sizes that double each time: the area rule peels one triangle off a level.
    let mut vertices = Vec::new();
    for i in 0..100 {
        let s = libm::exp2f(i as Real - 50.0);
        vertices.extend([Vec3::ZERO, Vec3::Z * s, Vec3::X * s]);
    }
    let triangles = (0..100).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    let mesh = TriangleMesh::new(vertices, triangles).unwrap();
    let mut count = 0;
    mesh.for_each_triangle(&mesh.local_aabb(), |_, _| count += 1);
    assert_eq!(count, 100);
    let down = mesh.cast_ray(Vec3::new(0.1, 1.0, 0.1), -Vec3::Y, 2.0).unwrap();
    assert_eq!((down.distance, down.normal), (1.0, Vec3::Y));
}

/// Rays aimed exactly at the vertices, edge middles and along the diagonals of a floor never slip through.
#[test]
fn rays_do_not_slip_through_seams() {
    let mesh = bumpy_floor(20);
    let mut random = Random(7);
    for &vertex in mesh.vertices() {
        if vertex.x <= 0.0 || vertex.z <= 0.0 || vertex.x >= 20.0 || vertex.z >= 20.0 {
            continue;
        }
        let tilt = Vec3::new(0.3 * random.signed(), -1.0, 0.3 * random.signed());
        let above = vertex - tilt * 5.0;
        let hit = mesh.cast_ray(above, vertex - above, 2.0).expect("a ray slipped through at a vertex");
        assert!((hit.distance - 1.0).abs() < 0.05 && hit.normal.y > 0.5);
        assert!(mesh.cast_ray(vertex - Vec3::Y * 3.0, Vec3::Y, 10.0).is_none(), "hit from behind");
    }
}

fn bumpy_floor(cells: u32) -> TriangleMesh {
    let mut random = Random(3);
    let side = cells + 1;
    let vertices =
        (0..side * side).map(|i| Vec3::new((i % side) as Real, 0.1 * random.signed(), (i / side) as Real)).collect();
    let mut triangles = Vec::new();
    for cell in 0..cells * cells {
        let i = cell / cells * side + cell % cells;
        triangles.extend([[i, i + side, i + 1], [i + 1, i + side, i + side + 1]]);
    }
    TriangleMesh::new(vertices, triangles).unwrap()
}

#[test]
fn bad_input_is_named() {
    let corners = vec![Vec3::ZERO, Vec3::Z, Vec3::X];
    assert_eq!(TriangleMesh::new(corners.clone(), vec![]).unwrap_err(), ShapeError::EmptyMesh);
    assert_eq!(
        TriangleMesh::new(corners.clone(), vec![[0, 1, 2], [0, 3, 2]]).unwrap_err(),
        ShapeError::IndexOutOfRange { triangle: 1, index: 3, vertices: 3 }
    );
    let with_nan = vec![Vec3::ZERO, Vec3::new(0.0, Real::NAN, 0.0), Vec3::X];
    assert!(matches!(TriangleMesh::new(with_nan, vec![[0, 1, 2]]), Err(ShapeError::NotFinite { index: 1, .. })));
    for flat in [[0, 1, 1], [2, 2, 2]] {
        assert_eq!(
            TriangleMesh::new(corners.clone(), vec![[0, 1, 2], flat]).unwrap_err(),
            ShapeError::DegenerateTriangle { triangle: 1 }
        );
    }
    let line = vec![Vec3::ZERO, Vec3::X * 1000.0, Vec3::new(500.0, 1e-4, 0.0)];
    assert!(TriangleMesh::new(line.clone(), vec![[0, 1, 2]]).is_err());
    assert_eq!(TriangleMesh::cleaned(line, vec![[0, 1, 2]], MeshSides::One).unwrap_err(), ShapeError::EmptyMesh);
    let tiny = corners.iter().map(|v| *v * 1e-4).collect();
    assert!(TriangleMesh::new(tiny, vec![[0, 1, 2]]).is_ok(), "only the shape counts, not the size");
}

fn kinds(mesh: &TriangleMesh, index: usize) -> [EdgeKind; 3] {
    [0, 1, 2].map(|edge| mesh.surroundings(index).bend(edge).kind())
}

/// Two triangles hinged about the z axis: the second one's outer corner is up, level or down. Unshared indices on purpose.
#[test]
fn edges_know_whether_they_bend() {
    for (height, kind) in [(0.0, EdgeKind::Flat), (0.5, EdgeKind::Concave), (-0.5, EdgeKind::Convex)] {
        let vertices = vec![Vec3::ZERO, Vec3::Z, Vec3::X, Vec3::ZERO, Vec3::new(-1.0, height, 0.0), Vec3::Z];
        let mesh = TriangleMesh::new(vertices, vec![[0, 1, 2], [3, 4, 5]]).unwrap();
        let i = (0..2).find(|&i| mesh.surroundings(i).id == 0).unwrap();
        let around = mesh.surroundings(i);
        assert_eq!(kinds(&mesh, i), [kind, EdgeKind::Boundary, EdgeKind::Boundary]);
        let expected = Vec3::new(-1.0, height, 0.0).normalize();
        assert!((around.bend(0).across(Vec3::Y, Vec3::X) - expected).length() < 1e-4);
        assert_eq!(around.edge_is_sharp(0), kind == EdgeKind::Convex);
        assert_eq!(around.edge_is_flat(0), kind == EdgeKind::Flat);
        assert_eq!(around.patch == mesh.surroundings(1 - i).patch, kind == EdgeKind::Flat);
        let mut ends = Vec::new();
        mesh.each_end(Vec3::ZERO, |end| {
            ends.push(end);
            true
        });
        ends.dedup_by(|a, b| a == b);
        for end in [Vec3::Z, Vec3::X, Vec3::new(-1.0, height, 0.0)] {
            assert!(ends.contains(&end));
        }
    }
}

/// A wall standing on the seam of a floor: seen from the floor the seam is a groove, whatever else meets there.
#[test]
fn three_triangles_at_an_edge_close_the_front() {
    let vertices = vec![Vec3::ZERO, Vec3::Z, Vec3::X, -Vec3::X, Vec3::Y];
    let mesh = TriangleMesh::new(vertices, vec![[0, 1, 2], [1, 0, 3], [0, 1, 4]]).unwrap();
    for i in 0..3 {
        let corners = mesh.corners(i);
        let on_seam = |e: usize| corners[e % 3].x == 0.0 && corners[e % 3].y == 0.0;
        let edge = (0..3).find(|&e| on_seam(e) && on_seam(e + 1)).unwrap();
        if mesh.surroundings(i).id < 2 {
            assert_eq!(kinds(&mesh, i)[edge], EdgeKind::Concave);
        }
    }
}

/// A long edge that meets two short ones, without a corner where they meet: flat all the same, from both sides.
#[test]
fn seams_without_shared_corners_are_closed() {
    let at = |x: Real, z: Real| Vec3::new(x, 0.0, z);
    let vertices = vec![at(0.0, 0.0), at(0.0, 2.0), at(2.0, 0.0), at(-1.0, 0.0), at(0.0, 1.3), at(-1.0, 2.0)];
    let mesh = TriangleMesh::new(vertices, vec![[0, 1, 2], [0, 3, 4], [4, 5, 1]]).unwrap();
    for i in 0..3 {
        let corners = mesh.corners(i);
        for edge in 0..3 {
            let seam = corners[edge].x == 0.0 && corners[(edge + 1) % 3].x == 0.0;
            let expected = if seam { EdgeKind::Flat } else { EdgeKind::Boundary };
            assert_eq!(kinds(&mesh, i)[edge], expected, "triangle {} edge {edge}", mesh.surroundings(i).id);
        }
    }
}

/// A hinge at all angles: what is kept of the bend gives back the direction into the neighbour to a ten thousandth.
#[test]
fn bends_keep_the_direction_into_the_neighbour() {
    for step in -1790..=1790 {
        let angle = (step as f32 / 10.0).to_radians();
        let expected = Vec3::new(-libm::cosf(angle), libm::sinf(angle), 0.0);
        let vertices = vec![Vec3::ZERO, Vec3::Z, Vec3::X, expected];
        let mesh = TriangleMesh::new(vertices, vec![[0, 1, 2], [0, 3, 1]]).unwrap();
        let around = (0..2).map(|i| mesh.surroundings(i)).find(|around| around.id == 0).unwrap();
        let across = around.bend(0).across(Vec3::Y, Vec3::X);
        assert!((across - expected).length() < 1e-4, "{angle} {across}");
        assert_eq!(around.bend(0).kind() == EdgeKind::Convex, step < 0, "{angle}");
        assert_eq!(around.bend(0).kind() == EdgeKind::Concave, step > 0, "{angle}");
    }
}

/// All that is held of a large mesh, beside the user's own lists: no more than 24 bytes a triangle.
#[test]
fn meshes_are_small() {
    let mesh = bumpy_floor(128);
    let held = mesh.surroundings.capacity() * size_of::<Surroundings>() + mesh.tree.bytes();
    let triangles = mesh.triangles().len();
    assert!(held <= 24 * triangles, "{held} bytes for {triangles} triangles");
    assert_eq!(mesh.vertices.capacity(), mesh.vertices().len() + 1);
}
