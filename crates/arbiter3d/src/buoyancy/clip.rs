//! The part of a closed surface of triangles behind some planes: its volume, centroid and areas.
//!
//! Each plane cuts off what is in front of it, triangle by triangle. The cuts of the triangles are the edges of the
//! hole; as they run against the direction of the surface, one triangle from a common corner to each edge closes it, in
//! whatever order the edges come. The result is closed again, so the next plane may follow, and the divergence theorem
//! gives
//!
//! ```text
//! V = Σ a·(b × c) / 6        V x = Σ (a + b + c)/4 · a·(b × c) / 6
//! ```
//!
//! over the triangles `a b c`, wound counter-clockwise from outside. Exact for every closed surface, convex or not.
//! Source: Catto, "Buoyancy", Game Programming Gems 6, 2006 (one plane); the closing of the hole is folklore.
//!
//! All is relative to a point of the surface's own frame near it, so that far from the origin no digits are lost.

use crate::math::{Real, Vec3};
use crate::shape::Plane;

/// A triangle, counter-clockwise from outside.
pub(super) type Triangle = [Vec3; 3];

/// Surfaces being cut, kept so that nothing is allocated in later steps.
#[derive(Clone, Debug, Default)]
pub(super) struct Clipper {
    triangles: Vec<Triangle>,
    kept: Vec<Triangle>,
    /// Triangles of the face that the last cut has made.
    face: Vec<Triangle>,
}

/// Volume and centroid of a solid.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Solid {
    pub volume: Real,
    pub center: Vec3,
}

impl Clipper {
    /// Takes a closed surface.
    pub fn load(&mut self, triangles: impl IntoIterator<Item = Triangle>) {
        self.triangles.clear();
        self.triangles.extend(triangles);
        self.face.clear();
    }

    /// Cuts off what is in front of a plane.
    pub fn cut(&mut self, plane: &Plane) {
        self.kept.clear();
        self.face.clear();
        let mut corner = None;
        for index in 0..self.triangles.len() {
            let triangle = self.triangles[index];
            let heights = triangle.map(|point| plane.distance(point));
            if heights.iter().all(|&height| height <= 0.0) {
                self.kept.push(triangle);
            } else if heights.iter().any(|&height| height < 0.0) {
                let [entry, exit] = self.cut_triangle(&triangle, heights);
                let first = *corner.get_or_insert(exit);
                self.face.push([first, entry, exit]);
            }
        }
        self.kept.extend_from_slice(&self.face);
        std::mem::swap(&mut self.triangles, &mut self.kept);
    }

    /// Keeps the part of a triangle behind the plane; returns the points where its outline enters and leaves that part.
    fn cut_triangle(&mut self, triangle: &Triangle, heights: [Real; 3]) -> [Vec3; 2] {
        let below = heights.map(|height| height <= 0.0);
        // The corner that is alone on its side, and the two that follow it.
        let alone = (0..3).find(|&i| below[i] != below[(i + 1) % 3] && below[i] != below[(i + 2) % 3]).unwrap_or(0);
        let (next, last) = ((alone + 1) % 3, (alone + 2) % 3);
        let (a, b, c) = (triangle[alone], triangle[next], triangle[last]);
        let crossing = |other: usize, to: Vec3| {
            let t = heights[alone] / (heights[alone] - heights[other]);
            a + (to - a) * t
        };
        let (towards_next, towards_last) = (crossing(next, b), crossing(last, c));
        if below[alone] {
            self.kept.push([a, towards_next, towards_last]);
            [towards_last, towards_next]
        } else {
            self.kept.push([towards_next, b, c]);
            self.kept.push([towards_next, c, towards_last]);
            [towards_next, towards_last]
        }
    }

    /// Volume and centroid of what is left.
    pub fn solid(&self) -> Solid {
        let Some(&[origin, ..]) = self.triangles.first() else { return Solid::default() };
        let (mut volume, mut moment) = (0.0, Vec3::ZERO);
        for triangle in &self.triangles {
            let [a, b, c] = triangle.map(|point| point - origin);
            let part = a.dot(b.cross(c)) * (1.0 / 6.0);
            volume += part;
            moment += (a + b + c) * (0.25 * part);
        }
        if volume > 0.0 { Solid { volume, center: origin + moment / volume } } else { Solid::default() }
    }

    /// Area of the shadow along a unit vector; for surfaces with dents an upper bound.
    pub fn shadow(&self, direction: Vec3) -> Real {
        let mut doubled = 0.0;
        for [a, b, c] in &self.triangles {
            doubled += (*b - *a).cross(*c - *a).dot(direction).abs();
        }
        0.25 * doubled
    }

    /// Points with areas that stand for the face of the last cut: integrals of squares over it are exact, as the
    /// middles of the edges of a triangle, each with a third of its area, give them.
    pub fn face_points(&self, normal: Vec3) -> impl Iterator<Item = (Vec3, Real)> + '_ {
        self.face.iter().flat_map(move |&[a, b, c]| {
            let third = (b - a).cross(c - a).dot(normal) * (1.0 / 6.0);
            [(a + b) * 0.5, (b + c) * 0.5, (c + a) * 0.5].map(|point| (point, third))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::outline::triangles;
    use super::*;
    use crate::Shape;
    use crate::math::normalize_or;

    fn cut(shape: &Shape, planes: &[Plane]) -> Clipper {
        let mut clipper = Clipper::default();
        clipper.load(triangles(shape));
        planes.iter().for_each(|plane| clipper.cut(plane));
        clipper
    }

    fn plane(normal: Vec3, offset: Real) -> Plane {
        Plane { normal: normalize_or(normal, Vec3::Y), offset }
    }

    /// A box of 2 × 4 × 6 cut at a quarter of its height.
    #[test]
    fn a_cut_box_has_the_volume_and_centre_of_its_part() {
        let shape = Shape::cuboid(Vec3::new(1.0, 2.0, 3.0)).unwrap();
        let cut = cut(&shape, &[plane(Vec3::Y, -1.0)]);
        let solid = cut.solid();
        assert!((solid.volume - 12.0).abs() < 1e-5, "{}", solid.volume);
        assert!((solid.center - Vec3::new(0.0, -1.5, 0.0)).length() < 1e-6, "{}", solid.center);
        let face =
            |weight: fn(Vec3) -> Real| cut.face_points(Vec3::Y).map(|(point, area)| weight(point) * area).sum::<Real>();
        assert!((face(|_| 1.0) - 12.0).abs() < 1e-5);
        // The second moments of a rectangle of 2 × 6.
        assert!((face(|p| p.x * p.x) - 4.0).abs() < 1e-5 && (face(|p| p.z * p.z) - 36.0).abs() < 1e-4);
        assert!((cut.shadow(Vec3::Y) - 12.0).abs() < 1e-4 && (cut.shadow(Vec3::X) - 6.0).abs() < 1e-4);
    }

    /// The plane through three corners of a cube cuts off a corner of a sixth of its volume; three planes of an octant
    /// leave an eighth.
    #[test]
    fn skew_and_repeated_cuts_are_exact() {
        let cube = Shape::cuboid(Vec3::splat(0.5)).unwrap();
        let corner = cut(&cube, &[plane(Vec3::ONE, -0.5 / 3.0_f32.sqrt())]).solid();
        assert!((corner.volume - 1.0 / 6.0).abs() < 1e-6, "{}", corner.volume);
        assert!((corner.center - Vec3::splat(-0.25)).length() < 1e-6, "{}", corner.center);
        let octant = cut(&cube, &[plane(Vec3::X, 0.0), plane(-Vec3::Y, 0.0), plane(Vec3::Z, 0.0)]).solid();
        assert!((octant.volume - 0.125).abs() < 1e-6);
        assert!((octant.center - Vec3::new(-0.25, 0.25, -0.25)).length() < 1e-6, "{}", octant.center);
    }

    /// Both sides of any cut make the whole.
    #[test]
    fn both_sides_of_a_cut_make_the_whole() {
        let points = [Vec3::ZERO, Vec3::X, Vec3::Y * 2.0, Vec3::Z, Vec3::new(1.0, 1.0, 1.0), Vec3::new(-0.5, 0.3, 0.8)];
        let hull = Shape::hull(&points).unwrap();
        let whole = cut(&hull, &[]).solid();
        for step in 0..50 {
            let angle = step as Real * 0.37;
            let (s, c) = crate::math::sin_cos(angle);
            let front = plane(Vec3::new(s, 0.3 * c, c), 0.02 * step as Real - 0.3);
            let back = Plane { normal: -front.normal, offset: -front.offset };
            let (a, b) = (cut(&hull, &[front]).solid(), cut(&hull, &[back]).solid());
            assert!((a.volume + b.volume - whole.volume).abs() < 1e-5 * whole.volume, "{step}");
            let center = (a.center * a.volume + b.center * b.volume) / whole.volume;
            assert!((center - whole.center).length() < 1e-5, "{step}: {center}");
        }
    }
}
