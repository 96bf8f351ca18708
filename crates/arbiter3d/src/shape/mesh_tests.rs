//! The tree and the rays against brute force, the neighbourhood of known edges, and what is refused.

use super::*;

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
}

fn soup(random: &mut Random, count: usize, sides: MeshSides) -> TriangleMesh {
    let mut vertices = Vec::new();
    for _ in 0..count {
        let center = random.vector() * 10.0;
        vertices.extend([0; 3].map(|_| center + random.vector()));
    }
    let triangles = (0..count as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    TriangleMesh::with_sides(vertices, triangles, sides).unwrap()
}

fn depth(mesh: &TriangleMesh, index: usize) -> usize {
    let node = mesh.nodes()[index];
    if node.count > 0 { 0 } else { 1 + depth(mesh, index + 1).max(depth(mesh, node.first as usize)) }
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
            let ray = Ray::new(origin, direction).unwrap();
            let hits = (0..500).filter_map(|i| ray.hit(mesh.facet(i), sides)).filter(|h| h.distance <= 20.0);
            let nearest = hits.min_by(|a, b| (a.distance, a.triangle).partial_cmp(&(b.distance, b.triangle)).unwrap());
            assert_eq!(mesh.cast_ray(origin, direction, 20.0), nearest);
        }
    }
}

#[test]
fn equal_centroids_stay_within_the_stack() {
    let triangles = vec![[0, 1, 2]; 3000];
    let mesh = TriangleMesh::new(vec![Vec3::ZERO, Vec3::Z, Vec3::X], triangles).unwrap();
    assert!(depth(&mesh, 0) <= 12, "halving gives log2(3000 / 4) levels");
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
    assert!(depth(&mesh, 0) < 63);
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
        let tilt = Vec3::new(0.3 * random.next(), -1.0, 0.3 * random.next());
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
        (0..side * side).map(|i| Vec3::new((i % side) as Real, 0.1 * random.next(), (i / side) as Real)).collect();
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

/// Two triangles hinged about the z axis: the second one's outer corner is up, level or down. Unshared indices on purpose.
#[test]
fn edges_know_whether_they_bend() {
    for (height, kind) in [(0.0, MeshEdge::Flat), (0.5, MeshEdge::Concave), (-0.5, MeshEdge::Convex)] {
        let vertices = vec![Vec3::ZERO, Vec3::Z, Vec3::X, Vec3::ZERO, Vec3::new(-1.0, height, 0.0), Vec3::Z];
        let mesh = TriangleMesh::new(vertices, vec![[0, 1, 2], [3, 4, 5]]).unwrap();
        let i = (0..2).find(|&i| mesh.facet(i).id == 0).unwrap();
        assert_eq!(mesh.neighborhood(i).kinds, [kind, MeshEdge::Boundary, MeshEdge::Boundary]);
        let expected = Vec3::new(-1.0, height, 0.0).normalize();
        assert!((mesh.neighborhood(i).inward[0] - expected).length() < 1e-6);
        assert_eq!(mesh.facet(i).sharp_edges & 1, u8::from(kind == MeshEdge::Convex));
        assert_eq!(mesh.facet(0).patch == mesh.facet(1).patch, kind == MeshEdge::Flat);
        assert_eq!(mesh.corner_ends(0).count(), 3);
    }
}

/// A wall standing on the seam of a floor: seen from the floor the seam is a groove, whatever else meets there.
#[test]
fn three_triangles_at_an_edge_close_the_front() {
    let vertices = vec![Vec3::ZERO, Vec3::Z, Vec3::X, -Vec3::X, Vec3::Y];
    let mesh = TriangleMesh::new(vertices, vec![[0, 1, 2], [1, 0, 3], [0, 1, 4]]).unwrap();
    for i in 0..3 {
        let facet = mesh.facet(i);
        let edge = (0..3)
            .find(|&e| {
                facet.corners[e].x == 0.0
                    && facet.corners[(e + 1) % 3].x == 0.0
                    && facet.corners[e].y == 0.0
                    && facet.corners[(e + 1) % 3].y == 0.0
            })
            .unwrap();
        if facet.id < 2 {
            assert_eq!(mesh.neighborhood(i).kinds[edge], MeshEdge::Concave);
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
        let facet = mesh.facet(i);
        for edge in 0..3 {
            let seam = facet.corners[edge].x == 0.0 && facet.corners[(edge + 1) % 3].x == 0.0;
            let expected = if seam { MeshEdge::Flat } else { MeshEdge::Boundary };
            assert_eq!(mesh.neighborhood(i).kinds[edge], expected, "triangle {} edge {edge}", facet.id);
        }
    }
}
