//! Closed surfaces of triangles for shapes of every kind.
//!
//! Boxes and hulls give their faces. A round shape gives the triangles through points of its surface, moved and grown
//! so that volume and centroid are those of the shape: what floats displaces its exact volume, and only the shape of
//! the water line is that of a polyhedron (within 0.4 % of the radius).

use super::clip::{Clipper, Triangle};
use crate::math::Real;
use crate::shape::{ConvexHull, MassProperties, Shape};

/// Steps along the edges of the octahedron that round shapes are divided by: 1,152 triangles.
const STEPS: usize = 12;

/// The triangles of a shape in its frame; none for a surface without an inside.
pub(super) fn triangles(shape: &Shape) -> Vec<Triangle> {
    let Ok(exact) = shape.mass_properties(1.0) else { return Vec::new() };
    let (points, corners) = shape.triangulate(STEPS);
    let triangles = corners.iter().map(|corners| corners.map(|corner| points[corner as usize])).collect();
    grown(&exact, triangles)
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

/// The triangles moved and scaled until they hold the volume of the shape, about its centre of mass.
fn grown(exact: &MassProperties, mut triangles: Vec<Triangle>) -> Vec<Triangle> {
    let mut clipper = Clipper::default();
    clipper.load(triangles.iter().copied());
    let inside = clipper.solid();
    if inside.volume <= 0.0 {
        return Vec::new();
    }
    let wanted = exact.mass / inside.volume;
    // Newton's iteration for the cube root, which is close to one.
    let mut scale: Real = 1.0;
    for _ in 0..8 {
        scale -= (scale * scale * scale - wanted) / (3.0 * scale * scale);
    }
    for triangle in &mut triangles {
        *triangle = triangle.map(|point| exact.center + (point - inside.center) * scale);
    }
    triangles
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Vec3;

    /// All outlines are closed and hold the volume of their shape about its centre of mass.
    #[test]
    fn outlines_have_the_volume_of_their_shapes() {
        let shapes = [
            Shape::sphere(0.7).unwrap(),
            Shape::capsule(0.6, 0.3).unwrap(),
            Shape::cylinder(0.4, 0.5).unwrap(),
            Shape::cone(0.5, 0.5).unwrap(),
            Shape::rounded(&Shape::cuboid(Vec3::splat(0.3)).unwrap(), 0.1).unwrap(),
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
