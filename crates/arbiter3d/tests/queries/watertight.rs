//! Rays at shared edges and corners of meshes and height fields: none slips through. And as many rays as it takes
//! against brute force.

use crate::common::*;
use crate::{brute_force, strewn_with};
use arbiter3d::math::Vec3;
use arbiter3d::{
    BodyDefinition, FieldDiagonals, HeightField, MeshSides, QueryFilter, Shape, ShapeDefinition, TriangleMesh, World,
};
use std::sync::Arc;

/// Corners and triangles.
type Surface = (Vec<Vec3>, Vec<[u32; 3]>);

/// A ball with bumps: an octahedron whose faces are cut into four, `levels` times.
fn bumpy_ball(levels: usize) -> Surface {
    let mut vertices = vec![Vec3::X, -Vec3::X, Vec3::Y, -Vec3::Y, Vec3::Z, -Vec3::Z];
    let mut triangles = vec![[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
    for _ in 0..levels {
        let mut middles = std::collections::BTreeMap::new();
        let mut finer = Vec::with_capacity(4 * triangles.len());
        for [a, b, c] in triangles {
            let mut middle = |a: u32, b: u32| -> u32 {
                *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                    vertices.push((vertices[a as usize] + vertices[b as usize]).normalize());
                    vertices.len() as u32 - 1
                })
            };
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            finer.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        triangles = finer;
    }
    // Bumps that keep it star-shaped about the origin.
    let mut random = Random(71);
    let vertices = vertices.into_iter().map(|v| v * random.range(4.6, 5.4)).collect();
    (vertices, triangles)
}

/// Hills with an open rim.
fn hills(cells: usize) -> Surface {
    let mut random = Random(72);
    let side = cells + 1;
    let vertices = (0..side * side)
        .map(|k| Vec3::new((k % side) as f32 * 0.7, random.range(-0.4, 0.4), (k / side) as f32 * 0.7))
        .collect();
    let triangles = (0..cells * cells).flat_map(|k| {
        let a = (k / cells * side + k % cells) as u32;
        let b = a + side as u32;
        [[a, b, b + 1], [a, b + 1, a + 1]]
    });
    (vertices, triangles.collect())
}

/// A turned mesh in a world of its own, and the pose to look at it from within its frame.
fn world_with(mesh: TriangleMesh, random: &mut Random) -> World {
    let mut world = weightless();
    let body = BodyDefinition::fixed().at(random.vector(20.0)).rotated(random.rotation());
    add(&mut world, &body, &ShapeDefinition::new(Shape::Mesh(Arc::new(mesh))));
    world
}

/// A corner of some triangle, or a point on one of its edges.
fn seam(random: &mut Random, vertices: &[Vec3], triangles: &[[u32; 3]]) -> Vec3 {
    let triangle = triangles[(random.bits() % triangles.len() as u64) as usize];
    let k = (random.bits() % 3) as usize;
    let (a, b) = (vertices[triangle[k] as usize], vertices[triangle[(k + 1) % 3] as usize]);
    if random.bits().is_multiple_of(3) { a } else { a + (b - a) * random.range(0.0, 1.0) }
}

/// Rays from within a closed mesh at its seams: each hits, where it was aimed at. Rays from outside at the seams of
/// triangles that all face the eye hit a one-sided one.
fn closed_mesh(count: usize) {
    let mut random = Random(73);
    let (vertices, triangles) = bumpy_ball(4);
    let mesh = |sides| TriangleMesh::with_sides(vertices.clone(), triangles.clone(), sides).unwrap();
    let two_sided = mesh(MeshSides::Two);
    let world = world_with(mesh(MeshSides::Two), &mut random);
    let pose = world.shape(world.body(world.bodies().nth(1).unwrap()).unwrap().shapes()[0]).unwrap().world_pose();
    for k in 0..count {
        let target = seam(&mut random, &vertices, &triangles);
        let origin = if k % 5 == 0 { Vec3::ZERO } else { random.vector(1.0) };
        let way = target - origin;
        let fraction = if k % 2 == 0 {
            two_sided.cast_ray(origin, way, f32::INFINITY).map(|hit| hit.distance)
        } else {
            let (from, way) = (pose.transform_point(origin), pose.rotation.rotate(way));
            let hit = world.cast_ray(from, way, f32::INFINITY, &QueryFilter::default()).unwrap();
            hit.map(|hit| hit.fraction)
        };
        let fraction = fraction.unwrap_or_else(|| panic!("ray {k} from {origin} to {target} leaks"));
        // From off the middle a bump may be in the way.
        assert!(fraction < 1.0 + 1e-4 && (origin != Vec3::ZERO || fraction > 1.0 - 1e-4), "{k}: {fraction}");
    }
    let one_sided = mesh(MeshSides::One);
    for k in 0..count / 4 {
        let target = seam(&mut random, &vertices, &triangles);
        // From outside: what is in the way of the seam faces the eye.
        let eye = target * random.range(3.0, 30.0) + random.vector(0.5);
        let hit = one_sided.cast_ray(eye, target - eye, 2.0);
        assert!(hit.is_some_and(|hit| hit.distance < 1.0 + 1e-4), "ray {k} from {eye} to {target} leaks");
    }
}

/// Cells along each side of the hills.
const CELLS: usize = 40;

/// Rays from above at the inner seams of open hills, steep and slanted, near and far.
fn open_ground(count: usize, (vertices, triangles): &Surface, cast: impl Fn(Vec3, Vec3) -> Option<f32>) {
    let mut random = Random(74);
    let extent = CELLS as f32 * 0.7;
    for k in 0..count {
        let target = seam(&mut random, vertices, triangles);
        if target.x < 1.0 || target.z < 1.0 || target.x > extent - 1.0 || target.z > extent - 1.0 {
            continue;
        }
        // Steep enough to meet every triangle from its front.
        let height = [1.0, 20.0, 500.0][k % 3];
        let slant = if k % 4 == 0 { 0.0 } else { 0.3 * height };
        let eye = target + Vec3::new(random.range(-slant, slant), height, random.range(-slant, slant));
        let hit = cast(eye, target - eye);
        assert!(hit.is_some_and(|fraction| fraction < 1.0 + 1e-3), "ray {k} from {eye} to {target} leaks");
    }
}

fn open_mesh(count: usize) {
    let hills = hills(CELLS);
    let mesh = TriangleMesh::new(hills.0.clone(), hills.1.clone()).unwrap();
    open_ground(count, &hills, |eye, way| mesh.cast_ray(eye, way, 2.0).map(|hit| hit.distance));
}

/// The same hills as a height field, cut either way.
fn height_field(count: usize) {
    let heights: Vec<f32> = hills(CELLS).0.iter().map(|corner| corner.y).collect();
    for diagonals in [FieldDiagonals::Falling, FieldDiagonals::Alternating] {
        let field = HeightField::new(heights.clone(), CELLS + 1, [0.7, 0.7]).unwrap().with_diagonals(diagonals);
        let surface = Shape::HeightField(Arc::new(field.clone())).triangulate(0);
        open_ground(count / 2, &surface, |eye, way| field.cast_ray(eye, way, 2.0).map(|hit| hit.distance));
    }
}

#[test]
fn no_ray_leaks_through_the_seams_of_a_closed_mesh() {
    closed_mesh(500_000);
}

#[test]
fn no_ray_leaks_through_the_seams_of_an_open_mesh() {
    open_mesh(500_000);
}

#[test]
fn no_ray_leaks_through_the_seams_of_a_height_field() {
    height_field(500_000);
}

#[test]
#[ignore = "10⁷ rays at each kind of surface"]
fn no_ray_of_ten_million_leaks() {
    closed_mesh(10_000_000);
    open_mesh(10_000_000);
    height_field(10_000_000);
}

/// Closest hits of the world are those of asking each shape on its own.
fn rays_against_brute_force(count: usize) {
    let mut random = Random(75);
    let world = strewn_with(&mut random, MeshSides::One, 60);
    let filter = QueryFilter::default();
    let mut hits = 0;
    for k in 0..count {
        let origin = random.vector(11.0);
        let direction = if k % 9 == 0 { Vec3::Z * 20.0 } else { random.vector(20.0) };
        let expected = brute_force(&world, origin, direction, 1.0, &filter).first().copied();
        let found = world.cast_ray(origin, direction, 1.0, &filter).unwrap();
        assert_eq!(found.map(|hit| (hit.fraction, hit.shape)), expected, "{origin} {direction}");
        hits += usize::from(found.is_some());
    }
    assert!(hits > count / 20, "{hits}");
}

#[test]
fn a_hundred_thousand_rays_hit_what_brute_force_hits() {
    rays_against_brute_force(100_000);
}

#[test]
#[ignore = "10⁶ rays"]
fn a_million_rays_hit_what_brute_force_hits() {
    rays_against_brute_force(1_000_000);
}

/// Where a ray meets a triangle, in double precision (Möller and Trumbore, 1997), and how far inside of it.
fn exact_hit(origin: Vec3, way: Vec3, corners: [Vec3; 3]) -> Option<(f64, f64)> {
    let (o, d) = (origin.as_dvec3(), way.as_dvec3());
    let [a, b, c] = corners.map(|corner| corner.as_dvec3());
    let (e1, e2) = (b - a, c - a);
    let p = d.cross(e2);
    let determinant = e1.dot(p);
    let s = o - a;
    let q = s.cross(e1);
    let (u, v, t) = (s.dot(p) / determinant, d.dot(q) / determinant, e2.dot(q) / determinant);
    let inside = u.min(v).min(1.0 - u - v);
    (determinant != 0.0 && t >= 0.0).then_some((t, inside))
}

/// Random rays through a closed mesh of 512 triangles against all of its triangles in double precision.
#[test]
fn rays_hit_the_triangles_that_double_precision_hits() {
    let mut random = Random(76);
    let (vertices, triangles) = bumpy_ball(3);
    let mesh = TriangleMesh::with_sides(vertices.clone(), triangles.clone(), MeshSides::Two).unwrap();
    let mut hits = 0;
    for _ in 0..20_000 {
        let (origin, way) = (random.vector(9.0), random.vector(20.0));
        let found = mesh.cast_ray(origin, way, 1.0);
        let all = triangles.iter().enumerate().filter_map(|(k, triangle)| {
            let (t, inside) = exact_hit(origin, way, triangle.map(|i| vertices[i as usize]))?;
            (t <= 1.0 && inside > -1e-9).then_some((t, inside, k as u32))
        });
        let Some((t, inside, k)) = all.min_by(|a, b| a.0.total_cmp(&b.0)) else {
            assert!(found.is_none(), "{found:?}");
            continue;
        };
        let found = found.unwrap_or_else(|| panic!("missed triangle {k} at {t}"));
        assert!((f64::from(found.distance) - t).abs() < 1e-6, "{found:?} {t}");
        assert!(found.triangle == k || inside < 1e-6, "{found:?} instead of {k}");
        hits += 1;
    }
    assert!(hits > 3000, "{hits}");
}
