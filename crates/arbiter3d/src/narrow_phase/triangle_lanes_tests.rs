//! Triangles eight at a time give the bits of one at a time.

use super::*;
use crate::math::{Aabb, Pose, Rotation};
use crate::narrow_phase::polyhedron::CuboidFeatures;
use crate::narrow_phase::tests::Random;
use crate::narrow_phase::triangle_lanes::{LANES, Near};
use crate::shape::{ConvexHull, Cuboid};

/// A rough surface: every edge is a ridge or a groove.
fn rough(random: &mut Random) -> TriangleMesh {
    const SIDE: u32 = 12;
    let mut height = || 0.3 * random.between(-1.0, 1.0);
    let corner = |i: u32, y: Real| Vec3::new(0.5 * (i % SIDE) as Real - 3.0, y, 0.5 * (i / SIDE) as Real - 3.0);
    let vertices = (0..SIDE * SIDE).map(|i| corner(i, height())).collect();
    let cells = (0..(SIDE - 1) * (SIDE - 1)).map(|k| k / (SIDE - 1) * SIDE + k % (SIDE - 1));
    let triangles = cells.flat_map(|i| [[i, i + SIDE, i + 1], [i + 1, i + SIDE, i + SIDE + 1]]).collect();
    TriangleMesh::new(vertices, triangles).unwrap()
}

fn frame_of(pose: &Pose) -> Frame {
    let rotation = pose.rotation.to_mat3();
    Frame { rotation, inverse: rotation.transpose(), position: pose.position, scale: 0.02 }
}

/// Eight triangles against the solid, at once and one by one.
fn compare(solid: &Polyhedron, mesh: &TriangleMesh, frame: &Frame, indices: [u32; LANES], reach: &Reach) -> [usize; 3] {
    let group = Group { indices, sides: [1.0; LANES], count: LANES };
    let found = LeastOverlap {
        solid,
        frame,
        facets: group.facets(mesh),
        sides: group.sides,
        margin: reach.margin,
        bias: BIAS * reach.scale,
        shallow: -Real::MAX,
    }
    .find();
    let mut counts = [0; 3];
    for (k, &index) in indices.iter().enumerate() {
        let triangle = Triangle::new(mesh, frame, index, 1.0);
        let underside = Underside::new(solid, triangle.normal);
        let height = triangle.height(solid.vertices[underside.corner]);
        assert_eq!(height.to_bits(), found.height[k].to_bits());
        let pair = Pair { solid, triangle: &triangle, reach, underside: &underside, height };
        let alone = if height <= reach.margin { pair.least_overlap() } else { None };
        assert_eq!(alone.is_some(), found.near[k] == 1.0, "triangle {index}: {alone:?}");
        if let Some((axis, separation)) = alone {
            assert_eq!(axis, pair.axis(found.axis[k] as usize), "triangle {index}");
            assert_eq!(separation.to_bits(), found.separation[k].to_bits(), "triangle {index}");
            counts[match axis {
                Axis::Triangle => 0,
                Axis::Face { .. } => 1,
                Axis::Edges { .. } => 2,
            }] += 1;
        }
    }
    counts
}

#[test]
fn eight_triangles_at_once_give_the_axes_of_each_alone() {
    let mut random = Random(0x9E37_79B9_7F4A_7C15);
    let mesh = rough(&mut random);
    let count = mesh.triangles().len();
    let mut counts = [0; 3];
    for round in 0..600 {
        let points: Vec<Vec3> = (0..12).map(|_| random.vector() * 0.6).collect();
        let cuboid = CuboidFeatures::new(&Cuboid::new(Vec3::new(0.5, 0.3, 0.4)).unwrap());
        let hull = ConvexHull::new(&points).unwrap();
        let solid = if round % 2 == 0 { cuboid.view() } else { Polyhedron::from_hull(&hull) };
        let turned: Rotation = random.rotation();
        let pose = Pose::new(Vec3::new(random.between(-1.5, 1.5), random.between(0.0, 0.6), 0.0), turned);
        let frame = frame_of(&pose);
        let reach = Reach { margin: 0.02, scale: 0.02, second_look: false };
        let around = Aabb::from_center(pose.position, Vec3::splat(0.7));
        let mut near = Vec::new();
        mesh.for_each_candidate(&around, |index| near.push(index as u32));
        for start in 0..near.len() {
            // Neighbours of all kinds, so that a lane that minded them would show.
            let pick =
                |k: usize| if k % 3 == 2 { (7 * start + k) % count } else { near[(start + k) % near.len()] as usize };
            let found = compare(&solid, &mesh, &frame, std::array::from_fn(|k| pick(k) as u32), &reach);
            counts = std::array::from_fn(|k| counts[k] + found[k]);
        }
    }
    assert!(counts.iter().all(|&count| count > 1000), "{counts:?}");
}

#[test]
fn sifting_keeps_what_overlaps_both_boxes_on_the_right_side() {
    let mut random = Random(0x1234_5678_9ABC_DEF1);
    let mesh = rough(&mut random);
    let count = mesh.triangles().len();
    let (mut kept, mut behind) = (0, 0);
    for round in 0..1200 {
        let pose = Pose::new(random.vector(), random.rotation());
        let frame = frame_of(&pose);
        let bounds = Aabb::from_center(Vec3::ZERO, Vec3::new(0.5, 0.2, 0.3));
        let one_sided = round % 2 == 0;
        let near = Near {
            frame: &frame,
            aabb: bounds.transform(&pose),
            bounds,
            center: pose.position,
            far: 0.62,
            one_sided,
            behind: 0.002,
        };
        for octet in 0..count.div_ceil(LANES) {
            let sides = near.sides(mesh.octet(octet));
            for (index, side) in (LANES * octet..count).zip(sides) {
                let facet = mesh.facet(index);
                let height = facet.normal.dot(pose.position - facet.corners[0]);
                let local = facet.corners.map(|corner| frame.inverse * (corner - frame.position));
                let near_by = Aabb::from_points(facet.corners).overlaps(&near.aabb)
                    && Aabb::from_points(local).overlaps(&near.bounds)
                    && height.abs() <= near.far;
                let expected = match (near_by, one_sided) {
                    (false, _) => 0.0,
                    (true, true) if height >= -near.behind => 1.0,
                    (true, true) => 0.0,
                    (true, false) => {
                        if height >= 0.0 {
                            1.0
                        } else {
                            -1.0
                        }
                    }
                };
                assert_eq!(side, expected, "triangle {index}, height {height}");
                kept += usize::from(side > 0.0);
                behind += usize::from(side < 0.0);
            }
        }
    }
    assert!(kept > 1000 && behind > 500, "{kept} {behind}");
}
