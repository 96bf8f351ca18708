//! Decompositions of known solids.

use super::*;
use crate::shape::{MeshSides, Shape};

fn total(hulls: &[ConvexHull]) -> f64 {
    hulls.iter().map(|hull| f64::from(hull.mass_properties(1.0).mass)).sum()
}

/// A prism along z from a polygon that winds counter-clockwise, its ends given as triangles of the polygon.
fn prism(polygon: &[(Real, Real)], ends: &[[u32; 3]], half: Real) -> TriangleMesh {
    let count = polygon.len() as u32;
    let level = |z: Real| polygon.iter().map(move |&(x, y)| Vec3::new(x, y, z));
    let mut triangles: Vec<[u32; 3]> = ends.iter().map(|t| t.map(|i| i + count)).collect();
    triangles.extend(ends.iter().map(|&[a, b, c]| [a, c, b]));
    for k in 0..count {
        let next = (k + 1) % count;
        triangles.extend([[k, next, next + count], [k, next + count, k + count]]);
    }
    TriangleMesh::new(level(-half).chain(level(half)).collect(), triangles).unwrap()
}

fn letter_l() -> TriangleMesh {
    let outline = [(0.0, 0.0), (3.0, 0.0), (3.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0)];
    prism(&outline, &[[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]], 0.5)
}

fn torus(major: Real, minor: Real, around: u32, across: u32) -> TriangleMesh {
    let turn = |k: u32, of: u32| {
        let angle = std::f64::consts::TAU * f64::from(k) / f64::from(of);
        (libm::cos(angle) as Real, libm::sin(angle) as Real)
    };
    let mut corners = Vec::new();
    for i in 0..around {
        for j in 0..across {
            let ((c, s), (p, q)) = (turn(i, around), turn(j, across));
            let out = major + minor * p;
            corners.push(Vec3::new(out * c, minor * q, -out * s));
        }
    }
    let at = |i: u32, j: u32| (i % around) * across + j % across;
    let mut triangles = Vec::new();
    for (i, j) in (0..around).flat_map(|i| (0..across).map(move |j| (i, j))) {
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        triangles.extend([[a, b, c], [a, c, d]]);
    }
    TriangleMesh::new(corners, triangles).unwrap()
}

#[test]
fn an_l_is_two_boxes() {
    let hulls = letter_l().convex_decomposition(&DecompositionSettings::default()).unwrap();
    assert_eq!(hulls.len(), 2);
    assert!((total(&hulls) - 4.0).abs() < 0.02 * 4.0, "{}", total(&hulls));
    assert!(hulls.iter().all(|hull| hull.vertices().len() == 8));
}

#[test]
fn a_torus_is_a_ring_of_hulls_that_hold_little_more() {
    let torus = torus(1.0, 0.3, 32, 12);
    let volume = Part::whole(&torus).volume;
    let smooth = 2.0 * std::f64::consts::PI.powi(2) * 0.09;
    assert!((volume / smooth - 1.0).abs() < 0.06, "{volume} of {smooth}");
    let settings = DecompositionSettings { concavity: 0.06, ..DecompositionSettings::default() };
    let hulls = torus.convex_decomposition(&settings).unwrap();
    assert!((8..=32).contains(&hulls.len()), "{} hulls", hulls.len());
    let error = total(&hulls) / volume - 1.0;
    assert!((-0.01..0.08).contains(&error), "{} hulls hold {error} more", hulls.len());
    // The hole stays open, and the tube is filled.
    let holds = |point: Vec3| {
        hulls.iter().any(|hull| hull.planes().iter().all(|plane| plane.normal.dot(point) <= plane.offset + 1e-4))
    };
    assert!(!holds(Vec3::ZERO) && !holds(Vec3::new(0.5, 0.0, 0.0)));
    assert!(holds(Vec3::X) && holds(-Vec3::Z) && holds(Vec3::new(0.7, 0.1, 0.71)));
}

/// Few hulls allowed are few hulls; the same input gives the same bits.
#[test]
fn limits_are_kept_and_runs_agree() {
    let torus = torus(1.0, 0.3, 24, 8);
    let settings = DecompositionSettings { max_hulls: 5, max_vertices: 12, ..DecompositionSettings::default() };
    let [one, two] = [(), ()].map(|()| torus.convex_decomposition(&settings).unwrap());
    assert!(one.len() <= 5 && one.iter().all(|hull| hull.vertices().len() <= 12));
    assert_eq!(one.len(), two.len());
    assert!(one.iter().zip(&two).all(|(a, b)| a.vertices() == b.vertices()));
}

/// A thick block with a notch is cut where corners of the parts' boxes are inside it.
#[test]
fn corners_inside_the_solid_count() {
    let (corners, triangles) = Shape::sphere(1.0).unwrap().triangulate(6);
    let ball = TriangleMesh::new(corners, triangles).unwrap();
    let whole = Part::whole(&ball);
    let (low, high) = whole.cut(Cut { axis: 0, at: 0.1 }, &whole.surface).unwrap();
    assert!((low.volume + high.volume - whole.volume).abs() < 1e-9 * whole.volume);
    let (front, _) = low.cut(Cut { axis: 1, at: 0.05 }, &whole.surface).unwrap();
    let (octant, _) = front.cut(Cut { axis: 2, at: -0.1 }, &whole.surface).unwrap();
    assert!(octant.corners.contains(&DVec3::new(0.1, 0.05, -0.1)));
    assert!(octant.empty() < 0.01 * octant.volume, "{} of {}", octant.hull_volume, octant.volume);
}

#[test]
fn bad_meshes_are_told_so() {
    let settings = DecompositionSettings::default();
    let open = TriangleMesh::new(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]]).unwrap();
    assert_eq!(open.convex_decomposition(&settings).unwrap_err(), ShapeError::OpenMesh { edges: 3 });
    let (corners, mut triangles) = Shape::cuboid(Vec3::ONE).unwrap().triangulate(1);
    triangles.iter_mut().for_each(|t| t.swap(0, 1));
    let inside_out = TriangleMesh::with_sides(corners, triangles, MeshSides::One).unwrap();
    let error = inside_out.convex_decomposition(&settings).unwrap_err();
    assert!(matches!(error, ShapeError::NoVolume { .. }), "{error}");
    let bad = DecompositionSettings { concavity: Real::NAN, ..settings };
    assert!(letter_l().convex_decomposition(&bad).is_err());
}
