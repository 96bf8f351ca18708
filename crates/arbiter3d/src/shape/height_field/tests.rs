//! Height fields against the mesh of the same triangles.

use super::super::TriangleMesh;
use super::super::surface_ray::SharpRay;
use super::*;
use crate::math::{max3, min3};

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

/// A rough field of 21 × 13 cells with every seventh a hole.
fn rough(random: &mut Random, diagonals: FieldDiagonals) -> HeightField {
    let heights = (0..22 * 14).map(|_| 0.3 * random.next()).collect();
    let holes: Vec<bool> = (0..21 * 13).map(|cell| cell % 7 == 3).collect();
    let field = HeightField::new(heights, 22, [0.5, 0.7]).unwrap();
    field.with_diagonals(diagonals).with_holes(&holes).unwrap()
}

const DIAGONALS: [FieldDiagonals; 3] = [FieldDiagonals::Falling, FieldDiagonals::Rising, FieldDiagonals::Alternating];

/// The mesh of a field, and the numbers of its triangles in the field.
fn mesh_of(field: &HeightField) -> (TriangleMesh, Vec<u32>) {
    let (points, triangles) = field.triangles();
    let numbers = (0..2 * field.cells.len() as u32).filter(|&t| !field.is_hole(t as usize / 2)).collect();
    (TriangleMesh::new(points, triangles).unwrap(), numbers)
}

/// A hundred thousand rays of all directions, many along grid lines, through corners and along the surface: the same triangle
/// and distance as by trying every triangle.
#[test]
fn rays_hit_what_brute_force_hits() {
    let mut random = Random(3);
    for diagonals in DIAGONALS {
        let field = rough(&mut random, diagonals);
        let all: Vec<usize> = (0..2 * field.cells.len()).filter(|t| !field.is_hole(t / 2)).collect();
        let mut hits = 0;
        for nth in 0..34_000 {
            let from = Vec3::new(5.25, 0.0, 4.55) + random.vector() * Vec3::new(7.0, 1.0, 6.0);
            let corner = field.point((nth * 7) % 22, (nth * 5) % 14);
            let (origin, to) = match nth % 5 {
                0 => (from, from + random.vector() * 10.0),
                1 => (corner + Vec3::Y * (1.0 + random.next()), corner - Vec3::Y),
                2 => (Vec3::new(corner.x, 0.4, -1.0), Vec3::new(corner.x, -0.4, 10.0)),
                3 => (from, corner),
                _ => (from + Vec3::Y * 3.0, from + random.vector() - Vec3::Y * 3.0),
            };
            let Some(ray) = SharpRay::new(origin, to - origin, &field.around) else { continue };
            let tried = all.iter().filter_map(|&t| {
                let hit = ray.hit(&field.corners(t), MeshSides::One)?;
                (hit.0 <= 1.5).then_some((hit.0, t as u32))
            });
            let best = tried.min_by(|a, b| a.partial_cmp(b).unwrap());
            let found = field.cast_ray(origin, to - origin, 1.5).map(|hit| (hit.distance, hit.triangle));
            assert_eq!(found, best, "{nth} {diagonals:?} from {origin:?} to {to:?}");
            hits += usize::from(found.is_some());
        }
        assert!(hits > 10_000, "{hits}");
    }
}

/// What is told of edges and corners is what the mesh of the same triangles tells, but for the border.
#[test]
fn edges_bend_as_those_of_the_mesh() {
    let mut random = Random(9);
    for diagonals in DIAGONALS {
        let mut field = rough(&mut random, diagonals);
        for side in [FieldSide::LowX, FieldSide::HighX, FieldSide::LowZ, FieldSide::HighZ] {
            field = field.with_end(side);
        }
        let (mesh, numbers) = mesh_of(&field);
        for index in 0..mesh.triangles().len() {
            let expected = mesh.surroundings(index);
            let own = numbers[expected.id as usize] as usize;
            let found = field.surroundings(own);
            assert_eq!(field.facet(own).quads, mesh.facet(index).quads);
            for i in 0..3 {
                assert_eq!(found.edge_is_sharp(i), expected.edge_is_sharp(i), "{own} {i}");
                assert_eq!(found.edge_is_flat(i), expected.edge_is_flat(i), "{own} {i}");
                assert_eq!(found.corner_is_sharp(i), expected.corner_is_sharp(i), "{own} {i}");
                assert_eq!(found.corner_is_flat(i), expected.corner_is_flat(i), "{own} {i}");
                if found.edge_is_sharp(i) {
                    assert_eq!(found.bend(i), expected.bend(i), "{own} {i}");
                }
                let corner = field.corners(own)[i];
                let (mut ends, mut others) = (Vec::new(), Vec::new());
                field.each_end(corner, |end| {
                    ends.push(end.to_array());
                    true
                });
                mesh.each_end(corner, |end| {
                    others.push(end.to_array());
                    true
                });
                others.sort_by(|a, b| a.partial_cmp(b).unwrap());
                others.dedup();
                ends.sort_by(|a, b| a.partial_cmp(b).unwrap());
                assert_eq!(ends, others, "{own} {i}");
            }
        }
    }
}

/// Boxes find the triangles that trying all of them finds.
#[test]
fn boxes_find_their_triangles() {
    let mut random = Random(21);
    let field = rough(&mut random, FieldDiagonals::Alternating);
    for _ in 0..3000 {
        let middle = Vec3::new(5.25, 0.0, 4.55) + random.vector() * Vec3::new(7.0, 0.6, 6.0);
        let half = random.vector().abs();
        let aabb = Aabb::new(middle - half, middle + half);
        let overlaps = |&t: &usize| {
            let [a, b, c] = field.corners(t);
            !field.is_hole(t / 2) && Aabb::new(min3(a, min3(b, c)), max3(a, max3(b, c))).overlaps(&aabb)
        };
        let expected: Vec<usize> = (0..2 * field.cells.len()).filter(overlaps).collect();
        let mut found = Vec::new();
        field.for_each_facet(&aabb, |index| found.push(index));
        assert_eq!(found, expected);
    }
}

/// A field of a quarter of a million cells with materials takes less than eight bytes a cell.
#[test]
fn a_cell_takes_less_than_eight_bytes() {
    let field = HeightField::new(vec![0.5; 513 * 513], 513, [1.0, 1.0]).unwrap();
    let field = field.with_materials(vec![3; 512 * 512]).unwrap();
    let per_cell = field.bytes() as f64 / (512.0 * 512.0);
    assert!(per_cell < 8.0, "{per_cell}");
}

#[test]
fn wrong_lists_are_refused() {
    assert!(matches!(HeightField::new(vec![0.0; 5], 2, [1.0; 2]), Err(ShapeError::FieldSize { .. })));
    assert!(matches!(HeightField::new(vec![0.0; 3], 3, [1.0; 2]), Err(ShapeError::FieldSize { .. })));
    assert!(matches!(HeightField::new(vec![], 0, [1.0; 2]), Err(ShapeError::FieldSize { .. })));
    assert!(matches!(HeightField::new(vec![0.0; 4], 2, [1.0, -1.0]), Err(ShapeError::NotPositive { .. })));
    let bad = HeightField::new(vec![0.0, 1.0, Real::NAN, 0.0], 2, [1.0; 2]);
    assert!(matches!(bad, Err(ShapeError::NotFinite { index: 2, .. })));
    let field = HeightField::new(vec![0.0; 4], 2, [1.0; 2]).unwrap();
    assert!(matches!(field.clone().with_holes(&[]), Err(ShapeError::WrongCount { expected: 1, .. })));
    assert!(field.with_materials(vec![1, 2]).is_err());
}
