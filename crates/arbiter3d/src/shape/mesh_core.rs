//! The inner shell of a closed mesh, for continuous collision: for each vertex a point inside of it.
//!
//! From a vertex a ray goes in against the mean normal of its triangles (by their areas); a quarter of the way to where it
//! leaves again is the point. So a plate of a thickness `d` has a shell that is `d / 4` inside on both sides, as the core of
//! a box is, and a bar keeps its length. Vertices at one place are one vertex, so the shell is closed as the mesh is, and has
//! the mesh's hollows and holes: what goes through a ring goes through its shell.
//!
//! Where a triangle of the shell crosses the mesh, as it may where a cavity is near a large face, its corners are drawn back
//! to half their way, again and again, and to the surface in the end.

use super::distance::closest;
use super::mesh::{MeshSides, TriangleMesh};
use super::support::Support;
use super::surface::Surface;
use super::surface_ray::first_triangle;
use crate::math::{Aabb, Pose, Real, Vec3, max, min, normalize_or};
use std::cmp::Ordering;

/// Share of the way through the mesh at which a point is.
const DEPTH: Real = 0.25;
/// How often corners of a triangle that crosses the mesh are drawn back.
const ROUNDS: usize = 6;

/// Points inside a closed mesh, by the user's vertices.
#[derive(Clone, Debug)]
pub(crate) struct InnerShell {
    points: Vec<Vec3>,
    /// How far each may move before the surface may have been passed.
    depths: Vec<Real>,
    least_depth: Real,
}

impl InnerShell {
    pub(super) fn of(mesh: &TriangleMesh) -> Self {
        let vertices = mesh.vertices();
        let first = first_at_place(vertices);
        let size = mesh.local_aabb().half_extents().length();
        let mut inwards = vec![Vec3::ZERO; vertices.len()];
        for triangle in mesh.triangles() {
            let [a, b, c] = triangle.map(|vertex| vertices[vertex as usize]);
            let normal = (b - a).cross(c - a);
            triangle.iter().for_each(|&vertex| inwards[first[vertex as usize] as usize] -= normal);
        }
        let mut ways: Vec<Vec3> = vec![Vec3::ZERO; vertices.len()];
        for at in (0..vertices.len()).filter(|&at| first[at] as usize == at) {
            let direction = normalize_or(inwards[at], Vec3::ZERO);
            let start = vertices[at] + direction * (1e-4 * size);
            if direction != Vec3::ZERO
                && let Some((distance, _, true)) =
                    first_triangle(Surface::Mesh(mesh), (start, direction, 4.0 * size), MeshSides::Two)
            {
                ways[at] = direction * (DEPTH * distance);
            }
        }
        draw_back(mesh, &first, &mut ways);
        let points: Vec<Vec3> = (0..vertices.len()).map(|at| vertices[at] + ways[first[at] as usize]).collect();
        let depths: Vec<Real> = first.iter().map(|&at| 0.5 * ways[at as usize].length()).collect();
        let corners = mesh.triangles().iter().flatten();
        let least_depth = corners.fold(Real::MAX, |least, &vertex| min(depths[vertex as usize], least));
        Self { points, depths, least_depth }
    }

    /// The point inside of a vertex.
    pub(crate) fn point(&self, vertex: usize) -> Vec3 {
        self.points[vertex]
    }

    /// How deep that counts: half of its way, for of a corner it is no nearer to one side than to the others.
    pub(crate) fn depth(&self, vertex: usize) -> Real {
        self.depths[vertex]
    }

    /// The least of these.
    pub(crate) fn least_depth(&self) -> Real {
        self.least_depth
    }
}

/// For each vertex the first one in some fixed order that is at the same place.
fn first_at_place(vertices: &[Vec3]) -> Vec<u32> {
    let compare = |a: Vec3, b: Vec3| {
        let by = |axis: usize| a[axis].partial_cmp(&b[axis]).unwrap_or(Ordering::Equal);
        by(0).then(by(1)).then(by(2))
    };
    let mut order: Vec<u32> = (0..vertices.len() as u32).collect();
    order.sort_by(|&a, &b| compare(vertices[a as usize], vertices[b as usize]));
    let mut first = vec![0; vertices.len()];
    let mut leader = 0;
    for &vertex in &order {
        if vertices[vertex as usize] != vertices[leader as usize] || vertex == order[0] {
            leader = vertex;
        }
        first[vertex as usize] = leader;
    }
    first
}

/// Shortens the ways of the corners of triangles that cross the mesh.
fn draw_back(mesh: &TriangleMesh, first: &[u32], ways: &mut [Vec3]) {
    let vertices = mesh.vertices();
    let mut shorten = vec![false; ways.len()];
    for round in 0..ROUNDS {
        for triangle in mesh.triangles() {
            let places = triangle.map(|vertex| first[vertex as usize] as usize);
            if places.iter().any(|&at| ways[at] != Vec3::ZERO)
                && crosses(mesh, places.map(|at| vertices[at] + ways[at]))
            {
                places.iter().for_each(|&at| shorten[at] = true);
            }
        }
        if !shorten.contains(&true) {
            return;
        }
        let keep = if round + 1 < ROUNDS { 0.5 } else { 0.0 };
        for (way, shorten) in ways.iter_mut().zip(&mut shorten) {
            *way *= if std::mem::take(shorten) { keep } else { 1.0 };
        }
    }
}

/// Whether a triangle overlaps one of the mesh.
fn crosses(mesh: &TriangleMesh, corners: [Vec3; 3]) -> bool {
    let around = Aabb::from_points(corners);
    let scale = max(around.half_extents().length(), 1e-6);
    let inner = Support::Triangle(corners);
    let mut crosses = false;
    mesh.for_each_facet(&around, |index| {
        if !crosses {
            let outer = Support::Triangle(mesh.corners(index));
            crosses = closest(&outer, &inner, &Pose::IDENTITY).is_none_or(|found| found.distance < 1e-6 * scale);
        }
    });
    crosses
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Shape;

    /// The surface of a shape as a mesh.
    fn surface(shape: &Shape) -> TriangleMesh {
        let (corners, triangles) = shape.triangulate(4);
        TriangleMesh::new(corners, triangles).unwrap()
    }

    fn shell_and_mesh(shape: &Shape) -> (InnerShell, TriangleMesh) {
        let mesh = surface(shape);
        (InnerShell::of(&mesh), mesh)
    }

    /// The shell of a thin bar as a mesh keeps nine tenths of its length, and is a quarter of the thickness inside.
    #[test]
    fn a_bar_keeps_its_length() {
        let (shell, mesh) = shell_and_mesh(&Shape::cuboid(Vec3::new(1.0, 0.01, 0.01)).unwrap());
        let box_of = Aabb::from_points((0..mesh.vertices().len()).map(|at| shell.point(at)));
        assert!(box_of.max.x > 0.9 && box_of.min.x < -0.9, "{box_of:?}");
        assert!(box_of.max.y < 0.0081 && box_of.max.z < 0.0081, "{box_of:?}");
    }

    /// Each triangle of the shell of an L of two bars is inside of it: its corners and its middle.
    #[test]
    fn the_shell_of_an_l_is_inside_of_it() {
        let outline = [(0.0, 0.0), (2.0, 0.0), (2.0, 0.2), (0.2, 0.2), (0.2, 1.0), (0.0, 1.0)];
        let corner = |(x, y): (Real, Real), z: Real| Vec3::new(x, y, z);
        let count = outline.len() as u32;
        let vertices = [-0.1, 0.1].iter().flat_map(|&z| outline.map(|at| corner(at, z))).collect::<Vec<_>>();
        let mut triangles = Vec::new();
        for [a, b, c] in [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]] {
            triangles.extend([[c, b, a], [a + count, b + count, c + count]]);
        }
        for a in 0..count {
            let b = (a + 1) % count;
            triangles.extend([[a, b, b + count], [a, b + count, a + count]]);
        }
        let mesh = TriangleMesh::new(vertices, triangles).unwrap();
        assert_eq!(mesh.open_edges(), 0);
        let shell = InnerShell::of(&mesh);
        let inside = |p: Vec3| {
            let bar = |x: Real, y: Real| p.x > 0.0 && p.x < x && p.y > 0.0 && p.y < y;
            p.z.abs() < 0.1 && (bar(2.0, 0.2) || bar(0.2, 1.0))
        };
        for triangle in mesh.triangles() {
            let [a, b, c] = triangle.map(|vertex| shell.point(vertex as usize));
            for point in [a, b, c, (a + b + c) * (1.0 / 3.0)] {
                assert!(inside(point), "{point}");
            }
        }
        assert!(shell.least_depth() > 0.01, "{}", shell.least_depth());
    }
}
