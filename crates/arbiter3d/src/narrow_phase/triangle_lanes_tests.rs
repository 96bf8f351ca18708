//! Triangles eight at a time give the bits of one at a time.

use super::*;
use crate::math::{Aabb, Pose, Rotation};
use crate::narrow_phase::triangle_lanes::Near;
use crate::random::Random;
use crate::shape::polyhedron::CuboidFeatures;
use crate::shape::{ConvexHull, Cuboid, Leaves, TriangleMesh};
use crate::simd::{LaneVec3, Lanes, Wide};

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
    let facets = indices.map(|index| mesh.facet(index as usize));
    let search =
        Search { solid, frame, facets: &facets, sides: [1.0; LANES], margin: reach.margin, bias: BIAS * reach.scale };
    let (wanted, sharp) = ([1.0; LANES], [1.0; LANES]);
    let mut found = FaceSearch { search, wanted, sharp, shallow: -Real::MAX }.find();
    EdgeSearch { search, found: &mut found }.find();
    let mut counts = [0; 3];
    for (k, &index) in indices.iter().enumerate() {
        let triangle = Triangle::new(Surface::Mesh(mesh), frame, index, 1.0);
        let mut underside = Underside::NONE;
        underside.turn_to(solid, triangle.normal, found.corner[k] as usize);
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
        mesh.for_each_facet(&around, |index| near.push(index as u32));
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
        let cuboid = CuboidFeatures::new(&Cuboid::new(Vec3::new(0.49, 0.19, 0.29)).unwrap());
        let mut solid = Faceted::new(cuboid.view());
        solid.place(&frame);
        let reach = Reach { margin: 0.01, scale: 0.01, second_look: false };
        let near =
            Near { frame: &frame, reach: &reach, bounds, size: 0.5, center: pose.position, one_sided, behind: 0.002 };
        for first in (0..count).step_by(LANES) {
            let leaf = LANES.min(count - first);
            let sides = near.sides(&solid, &mesh.corners_of_leaf::<Wide<LANES>>(first, leaf)).to_array();
            for (index, side) in (first..first + leaf).zip(sides) {
                let (corners, normal) = (mesh.corners(index), mesh.facet(index).normal());
                let height = normal.dot(pose.position - corners[0]);
                let local = corners.map(|corner| frame.inverse * (corner - frame.position));
                let around = Aabb::from_points(local);
                let inner = Aabb::from_center(bounds.center(), bounds.half_extents() - Vec3::splat(1e-4));
                let outer = bounds.expand(1e-4);
                let front = height >= if one_sided { -near.behind } else { 0.0 };
                let back = if one_sided { 0.0 } else { -1.0 };
                let expected = if front { 1.0 } else { back };
                if !around.overlaps(&outer) {
                    assert_eq!(side, 0.0, "triangle {index}, height {height}");
                } else if around.overlaps(&inner) && (height + near.behind).abs().min(height.abs()) > 1e-6 {
                    assert_eq!(side, expected, "triangle {index}, height {height}");
                }
                kept += usize::from(side > 0.0);
                behind += usize::from(side < 0.0);
            }
        }
    }
    assert!(kept > 1000 && behind > 500, "{kept} {behind}");
}

/// Collects triangles, or those alone whose leaf a shape's own box reaches.
struct Collect<'a> {
    near: Option<&'a Near<'a>>,
    found: Vec<usize>,
}

impl Leaves for Collect<'_> {
    fn keep<W: Lanes<LANES>>(&self, overlapping: W, center: &LaneVec3<W>, half: &LaneVec3<W>) -> W {
        self.near.map_or(overlapping, |near| near.keep_boxes(overlapping, center, half))
    }

    fn leaf<W: Lanes<LANES>>(&mut self, first: usize, count: usize) {
        self.found.extend(first..first + count);
    }
}

/// Boxes of the tree beside the shape's own box are passed over, none that holds a triangle in that box.
#[test]
fn passing_over_boxes_loses_no_triangle() {
    let mut random = Random(0x0123_4567_89AB_CDEF);
    let mesh = rough(&mut random);
    let (mut walked, mut kept) = (0, 0);
    for _ in 0..500 {
        let pose = Pose::new(random.vector(), random.rotation());
        let frame = frame_of(&pose);
        let bounds = Aabb::from_center(Vec3::new(0.1, 0.3, 0.0), Vec3::new(0.1, 2.0, 0.1));
        let aabb = bounds.transform(&pose);
        let reach = Reach { margin: 0.0, scale: 0.01, second_look: false };
        let center = pose.position;
        let near = Near { frame: &frame, reach: &reach, bounds, size: 2.3, center, one_sided: true, behind: 0.0 };
        let (mut all, mut some) =
            (Collect { near: None, found: Vec::new() }, Collect { near: Some(&near), found: Vec::new() });
        mesh.walk(&aabb, &mut all);
        mesh.walk(&aabb, &mut some);
        for &index in &all.found {
            let local = mesh.corners(index).map(|corner| frame.inverse * (corner - frame.position));
            if Aabb::from_points(local).overlaps(&bounds) {
                assert!(some.found.contains(&index));
            }
        }
        (walked, kept) = (walked + all.found.len(), kept + some.found.len());
    }
    assert!(kept < walked * 3 / 4, "{kept} of {walked}");
}
