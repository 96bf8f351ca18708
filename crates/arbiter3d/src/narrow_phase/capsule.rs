//! Capsules against capsules, cuboids and hulls.
//!
//! Two capsules meet where their segments are closest (Ericson, "Real-Time Collision Detection", 2005, section 5.1.9).
//! Near parallel, the two ends of the stretch that they share carry the contact.
//!
//! Against a polyhedron, the closest points of the segment give the normal while the segment is outside; inside, the
//! faces and the cross products of its edges with the segment are tried for the direction of least overlap. If the
//! normal is (nearly) that of a face, the stretch of the segment over that face gives two points.

use super::sphere::{any_perpendicular, push_rounded};
use super::{Manifold, ManifoldPoint};
use crate::math::{Pose, Real, Vec3, clamp, max, min, normalize_or};
use crate::shape::Support;
use crate::shape::distance::{Closest, closest};
use crate::shape::polyhedron::{CuboidFeatures, Polyhedron};
use crate::shape::{Capsule, ConvexHull, Cuboid};

/// Segments whose angle has a sine below this are parallel: two points.
const PARALLEL_SINE: Real = 0.05;
/// A normal with a cosine above this to a face is taken to be that face's.
const FACE_COSINE: Real = 0.998;
/// A face stands in for the closest points if it is at most this share of the smaller size less deep.
const FACE_LOSS: Real = 0.01;
/// An edge must overlap less than the best face by this share of the smaller size to make the contact.
const EDGE_BIAS: Real = 5e-3;

/// Capsule against capsule.
pub(crate) fn capsule_capsule(a: &Capsule, b: &Capsule, pose: &Pose, margin: Real, manifold: &mut Manifold) {
    manifold.clear();
    let (h1, h2) = (a.half_length(), b.half_length());
    let (d1, d2) = (Vec3::Y, pose.rotation.rotate(Vec3::Y));
    let (center, cosine) = (pose.position, d2.y);
    let sine_squared = d2.x * d2.x + d2.z * d2.z;
    // Closest points `d1 s` and `center + d2 t`; for parallel segments any stretch will do, here from the middle.
    let (along1, along2) = (center.y, center.dot(d2));
    let mut s = if sine_squared > 1e-12 { (along1 - cosine * along2) / sine_squared } else { 0.0 };
    s = clamp(s, -h1, h1);
    let t = clamp(cosine * s - along2, -h2, h2);
    s = clamp(along1 + cosine * t, -h1, h1);
    let (p1, p2) = (d1 * s, center + d2 * t);
    let fallback = normalize_or(d1.cross(d2), any_perpendicular(d1));
    if sine_squared < PARALLEL_SINE * PARALLEL_SINE {
        let normal = normalize_or(p2 - p1, fallback);
        // The stretch of segment 1 that segment 2 covers.
        let (end1, end2) = (center.y - h2 * cosine.abs(), center.y + h2 * cosine.abs());
        let (low, high) = (max(end1, -h1), min(end2, h1));
        if normal.y.abs() < PARALLEL_SINE && high - low > 1e-2 * min(h1, h2) {
            let reach = a.radius() + b.radius();
            for (feature, y) in [(1, low), (2, high)] {
                let q1 = d1 * y;
                let q2 = center + d2 * clamp((y - center.y) / cosine, -h2, h2);
                let separation = (q2 - q1).dot(normal) - reach;
                if separation <= margin {
                    let point1 = q1 + normal * a.radius();
                    manifold.push(ManifoldPoint { point1, normal, separation, feature });
                }
            }
            return;
        }
    }
    push_rounded(p1, a.radius(), p2, b.radius(), fallback, (margin, manifold));
}

/// Cuboid (shape 1) against capsule.
pub(crate) fn cuboid_capsule(a: &Cuboid, b: &Capsule, pose: &Pose, margin: Real, manifold: &mut Manifold) {
    let features = CuboidFeatures::new(a);
    polyhedron_capsule(&features.view(), &Support::Cuboid(*a), b, pose, (margin, manifold));
}

/// Hull (shape 1) against capsule.
pub(crate) fn hull_capsule(a: &ConvexHull, b: &Capsule, pose: &Pose, margin: Real, manifold: &mut Manifold) {
    polyhedron_capsule(&Polyhedron::from_hull(a), &Support::Hull(a), b, pose, (margin, manifold));
}

/// A capsule beside a polyhedron, in the frame of the latter.
struct CapsulePair<'a> {
    polyhedron: &'a Polyhedron<'a>,
    /// Ends of the segment.
    ends: [Vec3; 2],
    radius: Real,
    margin: Real,
}

/// Polyhedron (shape 1, `support` its support map) against capsule.
fn polyhedron_capsule(
    polyhedron: &Polyhedron,
    support: &Support,
    capsule: &Capsule,
    pose: &Pose,
    (margin, manifold): (Real, &mut Manifold),
) {
    manifold.clear();
    let half = pose.rotation.rotate(Vec3::new(0.0, capsule.half_length(), 0.0));
    let ends = [pose.position - half, pose.position + half];
    let pair = CapsulePair { polyhedron, ends, radius: capsule.radius(), margin };
    let (face, gap) = pair.best_face();
    if gap > pair.radius + margin {
        return;
    }
    if let Some(c) = closest(support, &Support::Capsule(*capsule), pose) {
        if c.distance > pair.radius + margin {
            return;
        }
        pair.outside_contact(&c, manifold);
        return;
    }
    let size = min(polyhedron.size, pair.radius);
    match pair.best_edge(gap + EDGE_BIAS * size) {
        Some(edge) => pair.edge_contact(edge, manifold),
        None if pair.face_contact(face, manifold) => {}
        None => pair.deepest_end(face, manifold),
    }
}

impl CapsulePair<'_> {
    /// The segment is outside: the face that the normal is almost that of, or the closest points.
    fn outside_contact(&self, c: &Closest, manifold: &mut Manifold) {
        let separation = c.distance - self.radius;
        let face = self.polyhedron.face_along(c.normal);
        if self.polyhedron.planes[face].normal.dot(c.normal) > FACE_COSINE && self.face_contact(face, manifold) {
            // Beside an edge the stretch over the face can leave out the closest point.
            let allowed = separation + FACE_LOSS * min(self.polyhedron.size, self.radius);
            if manifold.points().iter().any(|p| p.separation <= allowed) {
                return;
            }
            manifold.clear();
        }
        if self.parallel_edge_contact(face, c, manifold) {
            return;
        }
        manifold.push(ManifoldPoint { point1: c.point1, normal: c.normal, separation, feature: 0 });
    }

    /// The face furthest from the segment, and how far its nearer end is (negative inside).
    fn best_face(&self) -> (usize, Real) {
        let (mut face, mut best) = (0, -Real::MAX);
        for (i, plane) in self.polyhedron.planes.iter().enumerate() {
            let gap = min(plane.normal.dot(self.ends[0]), plane.normal.dot(self.ends[1])) - plane.offset;
            if gap > best {
                (face, best) = (i, gap);
            }
        }
        (face, best)
    }

    /// The edge whose cross product with the segment has the largest gap, if that is above `floor`, and its normal.
    ///
    /// Only where the segment's directions cross the arc between the normals of the two faces can the product be a
    /// support.
    fn best_edge(&self, floor: Real) -> Option<(usize, Vec3)> {
        let direction = self.ends[1] - self.ends[0];
        let mut best = floor;
        let mut found = None;
        for edge in (0..self.polyhedron.edges.len()).step_by(2) {
            let edges = self.polyhedron.edges;
            let n1 = self.polyhedron.planes[edges[edge].face as usize].normal;
            let n2 = self.polyhedron.planes[edges[edge ^ 1].face as usize].normal;
            if n1.dot(direction) * n2.dot(direction) >= 0.0 {
                continue;
            }
            let (a, b) = self.polyhedron.edge_points(edge);
            let cross = (b - a).cross(direction);
            if cross.length_squared() < 1e-5 * (b - a).length_squared() * direction.length_squared() {
                continue; // Parallel: the faces beside the edge stand in.
            }
            let axis = normalize_or(cross, n1);
            let axis = if axis.dot(n1 + n2) < 0.0 { -axis } else { axis };
            let gap = axis.dot(self.ends[0] - a);
            if gap > best {
                (best, found) = (gap, Some((edge, axis)));
            }
        }
        found
    }

    /// The ends of the stretch of the segment that lies over a face; false if there is none within reach.
    fn face_contact(&self, face: usize, manifold: &mut Manifold) -> bool {
        let plane = self.polyhedron.planes[face];
        let ([p, q], way) = (self.ends, self.ends[1] - self.ends[0]);
        let (mut enter, mut leave) = (0.0, 1.0);
        let (mut enter_edge, mut leave_edge) = (0xFFF, 0xFFF);
        for edge in self.polyhedron.face_loop(face) {
            let (out, offset) = self.polyhedron.side_plane(edge);
            let (dp, dq) = (out.dot(p) - offset, out.dot(q) - offset);
            if dp > 0.0 && dq > 0.0 {
                return false;
            }
            if dp > 0.0 && dp / (dp - dq) > enter {
                (enter, enter_edge) = (dp / (dp - dq), edge);
            } else if dq > 0.0 && dp / (dp - dq) < leave {
                (leave, leave_edge) = (dp / (dp - dq), edge);
            }
        }
        if enter > leave {
            return false;
        }
        for (t, edge, end) in [(enter, enter_edge, 0), (leave, leave_edge, 1)] {
            let core = p + way * t;
            let height = plane.normal.dot(core) - plane.offset;
            let separation = height - self.radius;
            if separation <= self.margin {
                let feature = 0x8000_0000 | (face as u32) << 16 | (edge as u32) << 1 | end;
                manifold.push(ManifoldPoint {
                    point1: core - plane.normal * height,
                    normal: plane.normal,
                    separation,
                    feature,
                });
            }
        }
        !manifold.points().is_empty()
    }

    /// The ends of the stretch of the segment along an edge of `face` that runs beside it and holds the closest point;
    /// false if there is no such edge.
    fn parallel_edge_contact(&self, face: usize, c: &Closest, manifold: &mut Manifold) -> bool {
        let way = self.ends[1] - self.ends[0];
        let squared = way.length_squared();
        if c.normal.dot(way).abs() > PARALLEL_SINE * squared.sqrt() {
            return false;
        }
        let nearness = FACE_LOSS * min(self.polyhedron.size, self.radius);
        for edge in self.polyhedron.face_loop(face) {
            let (a, b) = self.polyhedron.edge_points(edge);
            let along = b - a;
            let length_squared = along.length_squared();
            let sine_squared = PARALLEL_SINE * PARALLEL_SINE * squared * length_squared;
            let off = (c.point1 - a).cross(along).length_squared();
            if along.cross(way).length_squared() > sine_squared || off > nearness * nearness * length_squared {
                continue;
            }
            // Both as multiples of the edge.
            let [p, q] = self.ends.map(|end| (end - a).dot(along) / length_squared);
            let (low, high) = (max(min(p, q), 0.0), min(max(p, q), 1.0));
            if high - low < 1e-2 {
                continue;
            }
            for (end, s) in [(0, low), (1, high)] {
                let point1 = a + along * s;
                let core = self.ends[0] + way * clamp((s - p) / (q - p), 0.0, 1.0);
                let separation = c.normal.dot(core - point1) - self.radius;
                if separation <= self.margin {
                    let feature = 0x1000_0000 | (edge as u32) << 1 | end;
                    manifold.push(ManifoldPoint { point1, normal: c.normal, separation, feature });
                }
            }
            return !manifold.points().is_empty();
        }
        false
    }

    /// Closest points of the segment and an edge of the polyhedron.
    fn edge_contact(&self, (edge, normal): (usize, Vec3), manifold: &mut Manifold) {
        let (a, b) = self.polyhedron.edge_points(edge);
        let (d1, d2, w) = (b - a, self.ends[1] - self.ends[0], self.ends[0] - a);
        let (a11, a12, a22) = (d1.dot(d1), d1.dot(d2), d2.dot(d2));
        let determinant = a11 * a22 - a12 * a12;
        let s = if determinant > 0.0 { (w.dot(d1) * a22 - w.dot(d2) * a12) / determinant } else { 0.0 };
        let point1 = a + d1 * clamp(s, 0.0, 1.0);
        let separation = normal.dot(w) - self.radius;
        manifold.push(ManifoldPoint { point1, normal, separation, feature: 0x4000_0000 | edge as u32 });
    }

    /// The deeper end alone, for a segment that runs past the face it is least deep under.
    fn deepest_end(&self, face: usize, manifold: &mut Manifold) {
        let plane = self.polyhedron.planes[face];
        let heights = self.ends.map(|p| plane.normal.dot(p) - plane.offset);
        let end = (heights[1] < heights[0]) as usize;
        manifold.push(ManifoldPoint {
            point1: self.ends[end] - plane.normal * heights[end],
            normal: plane.normal,
            separation: heights[end] - self.radius,
            feature: 0x2000_0000 | (face as u32) << 16 | end as u32,
        });
    }
}
