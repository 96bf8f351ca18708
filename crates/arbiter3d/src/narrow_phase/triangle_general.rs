//! One triangle of a mesh against any convex shape known by its support and its features.
//!
//! The closest points of triangle and shape, or the least way out where they overlap, give one axis; the triangle's face gives
//! the other. As for cuboids and hulls (`triangle_solid`) the one with less overlap decides. The face: what of the shape lies
//! lowest (a disc, a line, a point) is cut to the prism over the triangle. The other axis: if the surface has a summit along it
//! there (see `mesh_edges`), the edge or the corner makes the contact with what of the shape lies most towards it. If not, it
//! is a neighbour's matter, or the face pushes where the surface goes on too far. Triangles without sharp edges, which are
//! most, and those under the lowest point need no search.

use super::general::{MISSED, Touch, WITNESS};
use super::mesh_points::Candidates;
use super::triangle::{Frame, Group, Reach, Solid, Triangle};
use super::triangle_lanes::{BACKWARD, Near, Planes};
use super::{Manifold, ManifoldPoint};
use crate::math::{Aabb, Pose, Real, Vec3, clamp, max};
use crate::shape::Support;
use crate::shape::distance::Placed;
use crate::shape::{Feature, LEAF as LANES, Surface};
use crate::simd::Lanes;

/// An edge of a triangle lies level with its highest corner below this sine.
const LEVEL_SINE: Real = 0.02;
/// A point counts as over a triangle up to this share of the shape's size beyond its sides: seams flatter than that have no
/// normals of their own.
const SEAM_SINE: Real = 2e-3;
/// Overlaps up to this share of the size are shallow: inside a smooth surface its face alone pushes.
const SHALLOW: Real = 0.5;
/// A feature lies along the triangle below this sine (3°): all of it bears although another axis overlaps less.
const FLAT_SINE: Real = 0.05;
/// What bears is near a point up to this share of the size.
const BESIDE: Real = 0.1;
/// Its points count unless they are deeper than the overlap by this share of the scale.
const EXTRA_DEPTH: Real = 0.25;
/// The triangle's face wins unless another axis is better by this share of the scale.
const BIAS: Real = 0.02;
/// Numbers of points that edges and corners make start here.
const RIM: u32 = 0x1000_0000;

/// A convex shape with what of it is lowest over the last triangle.
pub(super) struct General<'a> {
    support: Support<'a>,
    bounds: Aabb,
    center: Vec3,
    size: Real,
    /// Looks up to the shape.
    normal: Vec3,
    below: Feature,
    lowest: Vec3,
}

impl<'a> General<'a> {
    pub(super) fn new(support: Support<'a>) -> Self {
        let (bounds, center, size) = (support.bounds(&Pose::IDENTITY), support.inner_ball().0, support.size());
        Self { support, bounds, center, size, normal: Vec3::ZERO, below: Feature::default(), lowest: Vec3::ZERO }
    }

    /// Finds what is lowest over a plane with this normal.
    fn turn_to(&mut self, normal: Vec3) {
        if normal != self.normal {
            self.normal = normal;
            self.lowest = self.support.full_support(-normal.as_dvec3()).as_vec3();
            self.below = Feature::default();
            self.support.feature(-normal, &mut self.below);
        }
    }

    /// Whether what is lowest is no more than a line.
    fn rolls(&self) -> bool {
        self.below.points().len() < 3
    }

    /// The lowest point nearest to another one, if it is near; of what rolls: a hair ahead of what bears, the next moment
    /// would press it into the triangle.
    fn bearing_point(&self, point: Vec3) -> Vec3 {
        let nearest = match *self.below.points() {
            [a] => a,
            [a, b] => {
                let along = b - a;
                a + along * clamp((point - a).dot(along) / along.length_squared(), 0.0, 1.0)
            }
            _ => return point,
        };
        let aside = nearest - point;
        let aside = aside - self.normal * aside.dot(self.normal);
        if aside.length_squared() < BESIDE * BESIDE * self.size * self.size { point + aside } else { point }
    }

    fn touch(&mut self, triangle: &Triangle, reach: &Reach, out: &mut Candidates) -> bool {
        self.turn_to(triangle.normal);
        let height = triangle.height(self.lowest);
        if height > reach.margin {
            return false;
        }
        let pair = Pair { shape: self, triangle, reach, height };
        let shallow = triangle.is_plain() && height >= -SHALLOW * self.size;
        if (shallow || pair.stands_on_face()) && !reach.second_look {
            return pair.touch_face(&FacePoints::ALL, out) == 0 && height < 0.0;
        }
        pair.touch_nearest(out)
    }
}

impl Solid for General<'_> {
    fn center(&self) -> Vec3 {
        self.center
    }

    fn inner_radius(&self) -> Real {
        self.size
    }

    fn bounds(&self) -> Aabb {
        self.bounds
    }

    #[inline(always)]
    fn keep_reached<W: Lanes<LANES>>(&self, near: &Near, sides: W, planes: &Planes<W>) -> W {
        near.keep_in_box(sides, planes)
    }

    fn touch_group(
        &mut self,
        mesh: Surface<'_>,
        frame: &Frame,
        group: &mut Group,
        reach: &Reach,
        out: &mut Candidates,
    ) -> bool {
        group.drain(mesh, frame, |triangle| self.touch(triangle, reach, out))
    }
}

/// Which points of the shape's lowest feature count.
struct FacePoints {
    /// Those at least so high over the triangle: deeper ones have a shorter way out.
    least: Real,
    /// Also those where a rim cuts the feature.
    rims: bool,
}

impl FacePoints {
    const ALL: Self = Self { least: -Real::MAX, rims: true };
}

/// What of the triangle an axis leads to.
#[derive(Clone, Copy)]
enum Part {
    Edge(usize),
    Corner(usize),
}

/// A shape over a triangle.
struct Pair<'a> {
    shape: &'a General<'a>,
    triangle: &'a Triangle<'a>,
    reach: &'a Reach,
    /// Of the shape's lowest point over the triangle's plane.
    height: Real,
}

impl Pair<'_> {
    /// Whether the lowest point is over the triangle, farther from each edge than deep: then no axis is better than the face's.
    fn stands_on_face(&self) -> bool {
        let (lowest, triangle) = (self.shape.lowest, self.triangle);
        (0..3).all(|i| triangle.inward[i].dot(lowest - triangle.corners[i]) >= self.height.abs())
    }

    /// Adds the points along the axis of least overlap; returns as [`Solid::touch_group`].
    fn touch_nearest(&self, out: &mut Candidates) -> bool {
        let triangle = Support::Triangle(self.triangle.corners);
        let placed = Placed::new(&triangle, &self.shape.support, &Pose::IDENTITY);
        let Some(touch) = Touch::find(&placed, self.reach.margin) else { return false };
        let bias = BIAS * self.reach.scale;
        let backward = touch.normal.dot(self.triangle.normal) <= BACKWARD;
        let on_face = backward || self.height >= touch.separation - bias;
        let mut points = if on_face { self.touch_face(&FacePoints::ALL, out) } else { 0 };
        if points == 0 && !backward {
            points = match self.part_of(&touch) {
                Some(part) => self.touch_part(part, &touch, &placed, out),
                None if touch.separation < 0.0 && self.is_hemmed_in(&touch) => self.touch_face(&FacePoints::ALL, out),
                None => 0,
            };
        }
        if !on_face && !self.reach.second_look && self.lies_flat() {
            let least = touch.separation - EXTRA_DEPTH * self.reach.scale;
            self.touch_face(&FacePoints { least, rims: points == 0 }, out);
        }
        if points > 0 || touch.separation >= 0.0 {
            return false;
        }
        if self.reach.second_look && self.touch_face(&FacePoints::ALL, out) == 0 {
            self.push_out(&touch, out);
        }
        true
    }

    /// The edge or the corner that lies along an axis, if the surface has a summit along it there.
    fn part_of(&self, touch: &Touch) -> Option<Part> {
        let (triangle, normal) = (self.triangle, touch.normal);
        let rise = triangle.corners.map(|corner| normal.dot(corner));
        let top = self.top(normal);
        let level = |i: usize| {
            let length = (triangle.corners[i] - triangle.corners[top]).length();
            rise[top] - rise[i] <= LEVEL_SINE * length
        };
        let (next, last) = ((top + 1) % 3, (top + 2) % 3);
        let edge = match (level(next), level(last)) {
            (true, true) => self.nearest_edge(touch.point1.as_vec3()),
            (true, false) => top,
            (false, true) => last,
            (false, false) => return triangle.corner_allows(top, normal).then_some(Part::Corner(top)),
        };
        if triangle.edge_allows(edge, normal) {
            return Some(Part::Edge(edge));
        }
        // At the end of an edge that is a seam another one may be a rim.
        triangle.corner_allows(top, normal).then_some(Part::Corner(top))
    }

    fn nearest_edge(&self, point: Vec3) -> usize {
        let [ab, bc, ca] = self.triangle.insides(point);
        if ca < ab && ca < bc { 2 } else { usize::from(bc < ab) }
    }

    /// The corner of the triangle that is farthest along a direction.
    fn top(&self, direction: Vec3) -> usize {
        let [a, b, c] = self.triangle.corners.map(|corner| direction.dot(corner));
        if a >= b && a >= c { 0 } else { 1 + usize::from(c > b) }
    }

    /// Whether the surface around the triangle goes on along the axis so far that the way out along the triangle's normal is
    /// shorter after all.
    fn is_hemmed_in(&self, touch: &Touch) -> bool {
        let far = touch.separation - self.height;
        self.triangle.goes_on(self.top(touch.normal), touch.normal, far, -0.5 * self.height)
    }

    /// Whether the shape's lowest feature is a line or a face (almost) along the triangle.
    fn lies_flat(&self) -> bool {
        let (corners, normal) = (self.shape.below.points(), self.triangle.normal);
        let along = |across: Vec3, length: Real| across.length() <= FLAT_SINE * length;
        match corners {
            [] | [_] => false,
            [a, b] => (*b - *a).dot(normal).abs() <= FLAT_SINE * (*b - *a).length(),
            [first, rest @ ..] => {
                let area = rest.windows(2).fold(Vec3::ZERO, |sum, p| sum + (p[0] - *first).cross(p[1] - *first));
                along(area.cross(normal), area.length())
            }
        }
    }

    /// The lowest feature cut by the prism over the triangle, the triangle's corners under it, and the lowest point where
    /// those are all higher.
    fn touch_face(&self, wanted: &FacePoints, out: &mut Candidates) -> usize {
        let below = self.shape.below.points();
        let mut least = Real::MAX;
        let mut points = match below {
            [] | [_] => 0,
            [a, b] => self.touch_line((*a, *b), wanted, &mut least, out),
            corners => self.touch_polygon(corners, wanted, &mut least, out),
        };
        if self.height + MISSED * self.shape.size < least {
            let slack = SEAM_SINE * self.shape.size;
            let lowest = self.shape.lowest;
            if self.triangle.insides(lowest).iter().all(|inside| *inside >= -slack) {
                points += self.face_point(lowest, wanted.least, if below.len() > 1 { WITNESS } else { 0 }, out);
            }
        }
        points
    }

    /// Whether a side that cut something off is no end of the contact: the neighbour has the rest, or rims do not count.
    fn left_out(&self, wanted: &FacePoints, cut: u32) -> bool {
        let seams = !self.reach.second_look;
        seams && self.triangle.is_seam(cut) || !wanted.rims && cut < 3 && self.triangle.edge_is_sharp(cut as usize)
    }

    fn touch_line(&self, (a, b): (Vec3, Vec3), wanted: &FacePoints, least: &mut Real, out: &mut Candidates) -> usize {
        let triangle = self.triangle;
        let Some((ends, cuts)) = Triangle::clip(&triangle.insides(a), &triangle.insides(b)) else { return 0 };
        let mut points = 0;
        for k in 0..2 {
            if cuts[k] == 3 || !self.left_out(wanted, cuts[k]) {
                let feature = if cuts[k] == 3 { k as u32 } else { self.cut(0, cuts[k], k as u32) };
                let point = a + (b - a) * ends[k];
                *least = crate::math::min(triangle.height(point), *least);
                points += self.face_point(point, wanted.least, feature, out);
            }
        }
        points
    }

    fn touch_polygon(&self, corners: &[Vec3], wanted: &FacePoints, least: &mut Real, out: &mut Candidates) -> usize {
        let triangle = self.triangle;
        let bent = |i: usize| self.reach.second_look || !triangle.around.corner_is_flat(i);
        let mut under = [bent(0), bent(1), bent(2)];
        let mut points = 0;
        let mut end = triangle.insides(corners[0]);
        for (k, &a) in corners.iter().enumerate() {
            let b = corners[(k + 1) % corners.len()];
            // The polygon winds counter-clockwise about the direction to the triangle.
            let inside = (b - a).cross(triangle.normal);
            for (corner, under) in triangle.corners.iter().zip(&mut under) {
                *under &= inside.dot(*corner - a) > 0.0;
            }
            let start = end;
            end = triangle.insides(b);
            let Some((ends, cuts)) = Triangle::clip(&start, &end) else { continue };
            if cuts[0] == 3 {
                *least = crate::math::min(triangle.height(a), *least);
                points += self.face_point(a, wanted.least, k as u32, out);
            }
            for side in 0..2 {
                if cuts[side] != 3 && !self.left_out(wanted, cuts[side]) {
                    let feature = self.cut(k, cuts[side], side as u32);
                    points += self.face_point(a + (b - a) * ends[side], wanted.least, feature, out);
                }
            }
        }
        let plane =
            corners.windows(2).skip(1).fold(Vec3::ZERO, |sum, p| sum + (p[0] - corners[0]).cross(p[1] - corners[0]));
        let plane = plane * (1.0 / max(plane.length(), Real::MIN_POSITIVE));
        let slope = plane.dot(triangle.normal);
        for (i, corner) in triangle.corners.iter().enumerate() {
            if under[i] && slope < -0.01 && wanted.rims {
                let gap = plane.dot(corners[0] - *corner) / slope;
                let feature = 512 + (triangle.around.id << 2 | i as u32);
                points += self.face_point(*corner + triangle.normal * gap, wanted.least, feature, out);
            }
        }
        points
    }

    /// Number of the point where side `cut` of this triangle's prism cuts an edge of the feature.
    fn cut(&self, edge: usize, cut: u32, end: u32) -> u32 {
        1024 + (self.triangle.around.id << 8 | (edge as u32) << 3 | cut << 1 | end)
    }

    /// A point of the shape over (or under) the triangle.
    fn face_point(&self, point: Vec3, least: Real, feature: u32, out: &mut Candidates) -> usize {
        let height = self.triangle.height(point);
        if height > self.reach.margin || height < least {
            return 0;
        }
        out.push(self.triangle.face_candidate(point, height, 0.0, feature));
        1
    }

    /// An edge or a corner against what of the shape lies most towards it.
    fn touch_part(&self, part: Part, touch: &Touch, placed: &Placed<'_>, out: &mut Candidates) -> usize {
        let (mut own, mut other) = (Feature::default(), Feature::default());
        let number = match part {
            Part::Edge(i) => {
                let (a, b) = self.triangle.edge(i);
                own.push(a);
                own.push(b);
                i
            }
            Part::Corner(i) => {
                own.push(self.triangle.corners[i]);
                4 + i
            }
        };
        self.shape.support.feature(-touch.normal, &mut other);
        let mut manifold = Manifold::EMPTY;
        let patch = touch.patch(placed, (&own, &other), (self.reach.margin, self.shape.size));
        touch.hand_on(placed, &patch, self.shape.size, &mut manifold);
        for &ManifoldPoint { point1, normal, separation, feature } in manifold.points() {
            let feature = RIM + ((number as u32) << 24 ^ feature);
            out.push(if self.shape.rolls() {
                self.triangle.rolling_candidate(point1, normal, separation, feature)
            } else {
                self.triangle.rim_candidate(point1, normal, separation, feature)
            });
        }
        manifold.points().len()
    }

    /// An overlap that no face and no summit explains, as a push along the face: so far that a plane square to the least way
    /// out is cleared, but no farther than above the triangle's plane.
    fn push_out(&self, touch: &Touch, out: &mut Candidates) {
        let cosine = max(touch.normal.dot(self.triangle.normal), 0.1);
        let depth = max(touch.separation / cosine, self.height);
        let point = self.shape.bearing_point(touch.point1.as_vec3()) + self.triangle.normal * depth;
        out.push(self.triangle.face_candidate(point, depth, 0.0, WITNESS));
    }
}
