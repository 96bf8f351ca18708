//! Surface against surface: two triangle meshes, or a mesh and a height field.
//!
//! Both are solid behind their triangles. What can touch are the features of each that stick out, and each pushes on
//! its own account:
//!
//! - *corners* of one surface at faces of the other: along the face's normal, if the surface with the corner has a summit there
//!   (none of the edges that leave the corner goes farther against the normal);
//! - *edges* that are convex on both sides and cross: along the normal square to both, if both surfaces have a summit there.
//!
//! That covers faces that lie on each other as well: the corners of where they overlap are corners of one over the other
//! and crossings of their borders. Seams inside a flat or hollow surface stick out nowhere and are never felt.
//!
//! How deep is deep: a corner that is inside the other surface is pushed out by the nearest face that it can be pushed out by.
//! Where two edges cross deep inside each other although such a face is near (the upright edge of a box and the lower edge
//! of one that stands on it with an overhang), the crossing says nothing, and is left out. First all is looked for
//! within a short way; only if nothing touches so, the surfaces may have run into each other, and everything up to the
//! size of the smaller one is looked at.
//!
//! Triangles of two-sided meshes push to their front here: a corner that has come through from behind has, by itself, no way to
//! tell which side it belongs on, where a convex shape has its centre. Surfaces of which one is wholly inside the other
//! have no features near each other and touch nothing. The points go through the same choice as those of a mesh with a
//! convex shape (`mesh_points`).

use super::mesh_points::{Candidate, Candidates, Held, NO_FACET, position_number};
use super::{Manifold, ManifoldPoint};
use crate::math::{Aabb, Pose, Real, Vec3, max, max3, min, min3};
use crate::shape::{Surface, Surroundings, distance_squared};

/// Sine by which an edge may leave a corner against the normal, or a normal the range that an edge allows: what lies flat on
/// another surface keeps its corners while it rocks.
const SUMMIT_SINE: Real = 0.05;
/// Edges whose angle has a sine below this do not cross: their ends say it all.
const PARALLEL_SINE: Real = 0.01;
/// A crossing of edges is deeper than a face near it explains if the face is nearer than this share of its depth.
const EXPLAINED: Real = 0.5;
/// How far surfaces are looked through at first, as a share of the size of the smaller one.
const SHALLOW: Real = 0.1;
/// Faces around a corner that are remembered.
const MOST_FACES: usize = 12;

/// Contacts of surface `a` (shape 1) and surface `b`, which `pose` places in the frame of `a`.
pub(super) fn collide((a, b): (Surface<'_>, Surface<'_>), pose: &Pose, margin: Real, manifold: &mut Manifold) {
    let held = Held::take(manifold);
    let (box_a, box_b) = (a.local_aabb().expand(margin), b.local_aabb().transform(pose).expand(margin));
    if !box_a.overlaps(&box_b) {
        return;
    }
    let common = Aabb::new(max3(box_a.min, box_b.min), min3(box_a.max, box_b.max));
    let size = match [a.inner_radius(), b.inner_radius()] {
        [x, y] if x > 0.0 && y > 0.0 => min(x, y),
        [x, y] if x > 0.0 || y > 0.0 => max(x, y),
        _ => 0.1 * min(box_a.half_extents().max_element(), box_b.half_extents().max_element()),
    };
    let scale = if margin > 0.0 { min(margin, size) } else { 0.02 * size };
    let inverse = pose.inverse();
    let mut candidates = Candidates::new(0.02 * scale);
    for reach in [max(SHALLOW * size, margin), size] {
        let search = Search { a, b, pose, inverse: &inverse, common: &common, margin, reach, scale };
        search.corners_of_b(&mut candidates);
        search.corners_of_a(&mut candidates);
        search.edges(&mut candidates);
        if candidates.deepest() < Real::MAX {
            break;
        }
    }
    let mut materials = [[0; 2]; 4];
    let many = a.has_materials() || b.has_materials();
    candidates.choose(
        &held,
        |point| point,
        |c| {
            if many {
                let on_b = inverse.transform_point(c.position + c.normal * c.separation);
                let found = [material_at(a, c.position, scale), material_at(b, on_b, scale)];
                materials[manifold.points().len() & 3] = found;
            }
            let normal = c.normal * (1.0 / c.normal.length());
            manifold.push(ManifoldPoint { point1: c.position, normal, separation: c.separation, feature: c.feature });
        },
    );
    if many {
        manifold.set_point_materials(&materials);
    }
}

/// The material of the triangle nearest to a point.
fn material_at(surface: Surface<'_>, point: Vec3, scale: Real) -> u8 {
    if !surface.has_materials() {
        return 0;
    }
    let mut nearest = (Real::MAX, 0);
    surface.for_each_facet(&Aabb::from_center(point, Vec3::splat(scale)), |index| {
        let squared = distance_squared(&surface.corners(index), point);
        if squared < nearest.0 {
            nearest = (squared, surface.material(index));
        }
    });
    nearest.1
}

/// A triangle with what is around it, in the frame of shape 1 or in its own.
struct Piece {
    corners: [Vec3; 3],
    normal: Vec3,
    /// Unit vectors in the plane from each edge inwards.
    inward: [Vec3; 3],
    around: Surroundings,
}

impl Piece {
    fn new(surface: Surface<'_>, index: usize) -> Self {
        let facet = surface.facet(index);
        Self::of(facet.corners(), facet.normal(), surface.surroundings(index))
    }

    fn of(corners: [Vec3; 3], normal: Vec3, around: Surroundings) -> Self {
        let inward = |i: usize| {
            let across = normal.cross(corners[(i + 1) % 3] - corners[i]);
            across * (1.0 / across.length())
        };
        Self { corners, normal, inward: [inward(0), inward(1), inward(2)], around }
    }

    /// The same placed by `pose`.
    fn placed(&self, pose: &Pose) -> Self {
        let corners = [0, 1, 2].map(|i| pose.transform_point(self.corners[i]));
        Self::of(corners, pose.rotation.rotate(self.normal), self.around)
    }

    fn aabb(&self) -> Aabb {
        let [a, b, c] = self.corners;
        Aabb::new(min3(a, min3(b, c)), max3(a, max3(b, c)))
    }

    /// Whether an edge sticks out. Of the two triangles at it one answers: that from which it leads to larger coordinates.
    fn owns_sharp_edge(&self, i: usize) -> bool {
        let (start, end) = (self.corners[i], self.corners[(i + 1) % 3]);
        self.around.edge_is_sharp(i)
            && (self.around.bend(i).is_boundary()
                || (start.x, start.y, start.z).partial_cmp(&(end.x, end.y, end.z)) == Some(std::cmp::Ordering::Less))
    }

    /// Whether edge `i` is square to a normal, as far as an edge that lies on a face is.
    fn lies_across(&self, i: usize, normal: Vec3) -> bool {
        let along = self.corners[(i + 1) % 3] - self.corners[i];
        along.dot(normal).abs() <= SUMMIT_SINE * along.length()
    }

    /// Whether the surface has a summit along `normal` at edge `i`.
    fn edge_allows(&self, i: usize, normal: Vec3) -> bool {
        self.inward[i].dot(normal) <= SUMMIT_SINE
            && self.normal.dot(normal) >= -SUMMIT_SINE
            && self.around.bend(i).across(self.normal, self.inward[i]).dot(normal) <= SUMMIT_SINE
    }
}

/// A face near a corner.
#[derive(Clone, Copy, Default)]
struct NearFace {
    normal: Vec3,
    height: Real,
}

/// What is looked for.
struct Search<'a> {
    a: Surface<'a>,
    b: Surface<'a>,
    /// From the frame of `b` to that of `a`.
    pose: &'a Pose,
    inverse: &'a Pose,
    /// Where both are, in the frame of `a`.
    common: &'a Aabb,
    margin: Real,
    /// Overlaps up to this depth count.
    reach: Real,
    /// Length that tolerances are relative to.
    scale: Real,
}

impl Search<'_> {
    /// Corners of `b` at faces of `a`.
    fn corners_of_b(&self, out: &mut Candidates) {
        let from_a = self.inverse;
        let region = self.common.transform(from_a);
        each_sharp_corner(self.b, &region, |corner| {
            let seen = self.pose.transform_point(corner);
            if !self.common.holds(seen) {
                return;
            }
            let allows = |normal: Vec3| is_summit(self.b, corner, -from_a.rotation.rotate(normal));
            self.near_faces(self.a, seen, allows, |face| {
                out.push(Candidate {
                    position: seen - face.normal * face.height,
                    normal: face.normal,
                    separation: face.height,
                    feature: position_number(corner),
                    facet: NO_FACET,
                    triangle: 0,
                });
            });
        });
    }

    /// Corners of `a` at faces of `b`.
    fn corners_of_a(&self, out: &mut Candidates) {
        each_sharp_corner(self.a, self.common, |corner| {
            let outwards = |normal: Vec3| -self.pose.rotation.rotate(normal);
            let allows = |normal: Vec3| is_summit(self.a, corner, outwards(normal));
            self.near_faces(self.b, self.inverse.transform_point(corner), allows, |face| {
                out.push(Candidate {
                    position: corner,
                    normal: outwards(face.normal),
                    separation: face.height,
                    feature: !position_number(corner),
                    facet: NO_FACET,
                    triangle: 0,
                });
            });
        });
    }

    /// Calls `visit` with the faces that a corner (in the frame of the surface) touches, of those along whose normals it can be
    /// pushed: all that it is in front of within the margin, and if it is behind, the nearest.
    fn near_faces(
        &self,
        surface: Surface<'_>,
        corner: Vec3,
        allows: impl Fn(Vec3) -> bool,
        mut visit: impl FnMut(&NearFace),
    ) {
        let around = Aabb::from_center(corner, Vec3::splat(max(self.reach, self.margin)));
        let slack = 1e-3 * self.scale;
        let (mut faces, mut count) = ([NearFace::default(); MOST_FACES], 0);
        let mut nearest = Real::MAX;
        surface.for_each_facet(&around, |index| {
            let facet = surface.facet(index);
            let (corners, normal) = (facet.corners(), facet.normal());
            let height = normal.dot(corner - corners[0]);
            if height > self.margin || height < -self.reach {
                return;
            }
            let over = (0..3).all(|i| {
                let along = corners[(i + 1) % 3] - corners[i];
                normal.cross(along).dot(corner - corners[i]) >= -slack * along.length()
            });
            if over {
                let known = faces[..count].iter().any(|face| face.normal.dot(normal) > 0.99999);
                if !known && count < MOST_FACES && allows(normal) {
                    nearest = min(height.abs(), nearest);
                    faces[count] = NearFace { normal, height };
                    count += 1;
                }
            }
        });
        for face in &faces[..count] {
            if face.height >= -slack || face.height.abs() <= nearest + slack {
                visit(face);
            }
        }
    }

    /// Convex edges that cross.
    fn edges(&self, out: &mut Candidates) {
        self.b.for_each_facet(&self.common.transform(self.inverse), |index| {
            let own = Piece::new(self.b, index);
            let sharp = [0, 1, 2].map(|i| own.owns_sharp_edge(i));
            if sharp == [false; 3] {
                return;
            }
            let piece = own.placed(self.pose);
            let region = piece.aabb().expand(max(self.reach, self.margin));
            if !region.overlaps(self.common) {
                return;
            }
            let region = Aabb::new(max3(region.min, self.common.min), min3(region.max, self.common.max));
            self.a.for_each_facet(&region, |other| {
                let other = Piece::new(self.a, other);
                for i in (0..3).filter(|&i| other.owns_sharp_edge(i)) {
                    for k in (0..3).filter(|&k| sharp[k]) {
                        self.crossing((&other, i), (&piece, k), &own, out);
                    }
                }
            });
        });
    }

    /// Edge `i` of a triangle of `a` and edge `k` of one of `b`, which `own` is in its own frame.
    fn crossing(&self, (a, i): (&Piece, usize), (b, k): (&Piece, usize), own: &Piece, out: &mut Candidates) {
        let (a0, b0) = (a.corners[i], b.corners[k]);
        let (d1, d2, r) = (a.corners[(i + 1) % 3] - a0, b.corners[(k + 1) % 3] - b0, a0 - b0);
        let cross = d1.cross(d2);
        let (u, v, w) = (d1.length_squared(), d2.length_squared(), d1.dot(d2));
        let squared = cross.length_squared();
        if squared <= PARALLEL_SINE * PARALLEL_SINE * u * v {
            return;
        }
        let (c, f) = (d1.dot(r), d2.dot(r));
        let (t, s) = ((w * f - c * v) / squared, (u * f - c * w) / squared);
        if !(t > 0.0 && t < 1.0 && s > 0.0 && s < 1.0) {
            return;
        }
        let (on_a, on_b) = (a0 + d1 * t, b0 + d2 * s);
        let unit = cross * (1.0 / squared.sqrt());
        for normal in [unit, -unit] {
            let separation = normal.dot(on_b - on_a);
            if separation > self.margin
                || separation < -self.reach
                || !a.edge_allows(i, normal)
                || !b.edge_allows(k, -normal)
                || self.is_explained((a, i), (b, k), [on_a, on_b], -separation)
            {
                continue;
            }
            let (first, second) = (a.corners[i] + a.corners[(i + 1) % 3], own.corners[k] + own.corners[(k + 1) % 3]);
            let feature = position_number(first) ^ position_number(second).rotate_left(7);
            out.push(Candidate { position: on_a, normal, separation, feature, facet: NO_FACET, triangle: 0 });
        }
    }

    /// Whether a face of the one that could push the edge of the other is so near to where the edges cross that it explains
    /// the overlap.
    fn is_explained(
        &self,
        (a, i): (&Piece, usize),
        (b, k): (&Piece, usize),
        [on_a, on_b]: [Vec3; 2],
        depth: Real,
    ) -> bool {
        if depth <= 0.02 * self.scale {
            return false;
        }
        let near = EXPLAINED * depth;
        let pushes_b = |normal: Vec3| b.lies_across(k, normal) && b.edge_allows(k, -normal);
        let pushes_a = |normal: Vec3| {
            let normal = self.pose.rotation.rotate(normal);
            a.lies_across(i, normal) && a.edge_allows(i, -normal)
        };
        is_within(self.a, on_b, near, pushes_b) || is_within(self.b, self.inverse.transform_point(on_a), near, pushes_a)
    }
}

/// Calls `visit` with the corners in a region at which a convex or open edge ends, most of them once.
fn each_sharp_corner(surface: Surface<'_>, region: &Aabb, mut visit: impl FnMut(Vec3)) {
    // The corners seen last, by their numbers: those of neighbouring triangles come close together.
    let mut seen = [Vec3::splat(Real::MAX); 64];
    surface.for_each_facet(region, |index| {
        let around = surface.surroundings(index);
        let corners = surface.corners(index);
        for (i, &corner) in corners.iter().enumerate() {
            let place = &mut seen[position_number(corner) as usize % 64];
            if around.corner_is_sharp(i) && *place != corner && region.holds(corner) {
                *place = corner;
                visit(corner);
            }
        }
    });
}

/// Whether no edge that leaves a corner goes farther along `normal`.
fn is_summit(surface: Surface<'_>, corner: Vec3, normal: Vec3) -> bool {
    let mut highest = true;
    surface.each_end(corner, |end| {
        let along = end - corner;
        highest = along.dot(normal) <= SUMMIT_SINE * along.length();
        highest
    });
    highest
}

/// Whether some triangle with a normal that counts is nearer to a point than `distance`.
fn is_within(surface: Surface<'_>, point: Vec3, distance: Real, counts: impl Fn(Vec3) -> bool) -> bool {
    let mut near = false;
    surface.for_each_facet(&Aabb::from_center(point, Vec3::splat(distance)), |index| {
        near |= distance_squared(&surface.corners(index), point) < distance * distance
            && counts(surface.facet(index).normal());
    });
    near
}
