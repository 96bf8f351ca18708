//! Queries against height fields answer what they answer against a mesh of the same triangles, which is tested against brute
//! force.

use crate::common::*;
use arbiter3d::math::{Pose, Rotation, Vec3};
use arbiter3d::{BodyDefinition, FieldDiagonals, HeightField, QueryFilter, Shape, ShapeCast, ShapeDefinition, World};
use std::sync::Arc;

/// A rough field of some cells, each 0.5 × 0.7 m, a fifth of them holes.
fn rough(random: &mut Random, [columns, rows]: [usize; 2], diagonals: FieldDiagonals) -> HeightField {
    let heights = (0..(columns + 1) * (rows + 1)).map(|_| random.range(-0.4, 0.4)).collect();
    let holes: Vec<bool> = (0..columns * rows).map(|cell| cell % 5 == 3).collect();
    let field = HeightField::new(heights, columns + 1, [0.5, 0.7]).unwrap().with_diagonals(diagonals);
    field.with_holes(&holes).unwrap()
}

/// A world with a field, one with its mesh, and which triangle of the field each of the mesh is.
fn twins(field: HeightField) -> (World, World, Vec<u32>) {
    let cells = (field.columns() * field.rows()) as u32;
    let numbers = (0..2 * cells).filter(|t| !field.is_hole(*t as usize / 2)).collect();
    let field = Shape::HeightField(Arc::new(field));
    let (vertices, triangles) = field.triangulate(0);
    let place = BodyDefinition::fixed().at(Vec3::new(-3.0, 0.5, -2.0)).rotated(turn(Vec3::new(0.36, 0.8, -0.48), 40.0));
    let worlds = [field, Shape::mesh(vertices, triangles).unwrap()].map(|shape| {
        let mut world = weightless();
        add(&mut world, &place, &ShapeDefinition::new(shape));
        world
    });
    let [field, mesh] = worlds;
    (field, mesh, numbers)
}

/// One cell, a single row of cells, and fields of two and three levels of blocks whose last ones are not full.
const SIZES: [[usize; 2]; 5] = [[1, 1], [70, 1], [1, 9], [21, 13], [70, 33]];

#[test]
fn casts_and_distances_are_those_of_the_mesh() {
    let mut random = Random(77);
    let filter = QueryFilter::default();
    let diagonals = [FieldDiagonals::Falling, FieldDiagonals::Rising, FieldDiagonals::Alternating];
    let (mut hits, mut near) = (0, 0);
    for (size, diagonals) in SIZES.into_iter().flat_map(|size| diagonals.map(|diagonals| (size, diagonals))) {
        let (field, mesh, numbers) = twins(rough(&mut random, size, diagonals));
        let named = |triangle: Option<u32>| triangle.map(|t| numbers[t as usize]);
        for round in 0..200 {
            let pose = Pose::new(random.vector(9.0), Rotation::from_quat(random.rotation()));
            let shape = random.shape();
            let end = Pose::new(
                random.vector(9.0),
                if round % 3 == 0 { Rotation::from_quat(random.rotation()) } else { pose.rotation },
            );
            let cast = ShapeCast::between(&shape, pose, end);
            let [found, expected] = [&field, &mesh].map(|world| world.cast_shape(&cast, &filter).unwrap());
            hits += usize::from(found.is_some());
            // Where several are touched at once, any may be told; of an overlap the contacts tell, and those know of borders.
            assert_eq!(found.map(|hit| hit.fraction), expected.map(|hit| hit.fraction), "{size:?} round {round}");
            if let (Some(hit), Some(other)) = (found, expected)
                && hit.fraction > 0.0
            {
                let off = hit.point.distance(other.point).max(hit.normal.distance(other.normal));
                assert!(off < 1e-5 && hit.triangle.is_some(), "{size:?} round {round}: {hit:?} {other:?}");
            }
            let reach = if round % 2 == 0 { f32::INFINITY } else { 2.0 };
            let [found, expected] =
                [&field, &mesh].map(|world| world.closest_point(pose.position, reach, &filter).unwrap());
            near += usize::from(found.is_some());
            assert_eq!(
                found.map(|h| (h.distance, h.point, h.triangle)),
                expected.map(|h| (h.distance, h.point, named(h.triangle)))
            );
            let [found, expected] = [&field, &mesh].map(|world| {
                let hit = world.cast_ray(pose.position, end.position - pose.position, 1.0, &filter).unwrap();
                hit.map(|hit| (hit.fraction, hit.triangle))
            });
            assert_eq!(found, expected.map(|(fraction, triangle)| (fraction, named(triangle))));
        }
    }
    assert!(hits > 200 && near > 1500, "{hits} {near}");
}
