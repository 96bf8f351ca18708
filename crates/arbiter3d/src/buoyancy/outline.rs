//! Closed surfaces of triangles for shapes of every kind.
//!
//! Boxes and hulls give their faces. A round shape gives the triangles through points of its surface, grown about its
//! centre of mass so that the volume is that of the shape: what floats displaces its exact volume, and only the shape of
//! the water line is that of a polyhedron (within 0.4 % of the radius).

use super::clip::{Clipper, Triangle};
use crate::math::{Real, Vec3, normalize_or};
use crate::shape::{ConvexHull, Shape};

/// Steps along the edges of the octahedron that round shapes are divided by: 1,152 triangles.
const STEPS: i32 = 12;

/// The triangles of a shape in its frame; none for a surface without an inside.
pub(super) fn triangles(shape: &Shape) -> Vec<Triangle> {
    match shape {
        Shape::Cuboid(cuboid) => {
            ConvexHull::from_cuboid(cuboid.half_extents()).map_or(Vec::new(), |hull| faces(&hull).collect())
        }
        Shape::Hull(hull) => faces(hull).collect(),
        Shape::Sphere(sphere) => round(shape, sphere.radius(), 0.0),
        Shape::Capsule(capsule) => round(shape, capsule.radius(), capsule.half_length()),
        Shape::Mesh(_) => Vec::new(),
    }
}

/// The faces of a hull as fans.
pub(super) fn faces(hull: &ConvexHull) -> impl Iterator<Item = Triangle> + '_ {
    (0..hull.planes().len()).flat_map(|face| {
        let mut corners = hull.face_vertices(face).map(|vertex| hull.vertices()[vertex]);
        let first = corners.next().unwrap_or_default();
        let mut before = corners.next().unwrap_or_default();
        corners.map(move |corner| [first, std::mem::replace(&mut before, corner), corner])
    })
}

/// A ball, or one cut in half whose halves are `2 half_length` apart along y.
fn round(shape: &Shape, radius: Real, half_length: Real) -> Vec<Triangle> {
    let mut triangles = Vec::new();
    for octant in 0..8 {
        let sign = Vec3::from_array([0, 1, 2].map(|axis| if octant >> axis & 1 == 1 { -1.0 } else { 1.0 }));
        let mirrored = sign.x * sign.y * sign.z < 0.0;
        let end = Vec3::Y * (half_length * sign.y);
        let point = |i: i32, j: i32| {
            let direction = Vec3::new(i as Real, j as Real, (STEPS - i - j) as Real) * sign;
            normalize_or(direction, Vec3::Y) * radius + end
        };
        let mut push = |a, b, c| triangles.push(if mirrored { [a, c, b] } else { [a, b, c] });
        for i in 0..STEPS {
            for j in 0..STEPS - i {
                push(point(i, j), point(i + 1, j), point(i, j + 1));
                if i + j + 1 < STEPS {
                    push(point(i + 1, j), point(i + 1, j + 1), point(i, j + 1));
                }
            }
            // The wall from the equator of this half to the middle.
            if half_length > 0.0 {
                let (from, to) = (point(i, 0), point(i + 1, 0));
                push(to, from, from - end);
                push(to, from - end, to - end);
            }
        }
    }
    grown(shape, triangles)
}

/// The triangles scaled about the centre of mass of the shape until they hold its volume.
fn grown(shape: &Shape, mut triangles: Vec<Triangle>) -> Vec<Triangle> {
    let mut clipper = Clipper::default();
    clipper.load(triangles.iter().copied());
    let (inside, exact) = (clipper.solid().volume, shape.mass_properties(1.0));
    let Some(exact) = exact.filter(|exact| inside > 0.0 && exact.mass > 0.0) else { return triangles };
    let wanted = exact.mass / inside;
    // Newton's iteration for the cube root, which is close to one.
    let mut scale: Real = 1.0;
    for _ in 0..8 {
        scale -= (scale * scale * scale - wanted) / (3.0 * scale * scale);
    }
    for triangle in &mut triangles {
        *triangle = triangle.map(|point| exact.center + (point - exact.center) * scale);
    }
    triangles
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All outlines are closed and hold the volume of their shape about its centre of mass.
    #[test]
    fn outlines_have_the_volume_of_their_shapes() {
        let shapes = [
            Shape::sphere(0.7).unwrap(),
            Shape::capsule(0.6, 0.3).unwrap(),
            Shape::cuboid(Vec3::new(1.0, 0.2, 0.5)).unwrap(),
            Shape::hull(&[Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z, Vec3::ONE]).unwrap(),
        ];
        for shape in &shapes {
            let mut clipper = Clipper::default();
            clipper.load(triangles(shape));
            let (solid, exact) = (clipper.solid(), shape.mass_properties(1.0).unwrap());
            assert!((solid.volume / exact.mass - 1.0).abs() < 1e-5, "{shape:?}: {}", solid.volume);
            assert!((solid.center - exact.center).length() < 1e-5, "{shape:?}: {}", solid.center);
            // The vector areas of a closed surface sum to zero.
            let open = triangles(shape).iter().fold(Vec3::ZERO, |sum, [a, b, c]| sum + (*b - *a).cross(*c - *a));
            assert!(open.length() < 1e-4, "{shape:?}: {open}");
        }
    }
}
