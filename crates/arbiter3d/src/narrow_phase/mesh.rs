//! Triangle mesh against a convex shape.
//!
//! The mesh's tree finds the triangles near the shape; each is held against the shape by itself (`triangle`,
//! `triangle_solid`), knows from its neighbours which normals it may push along (so that seams are not felt), and
//! hands its points to a buffer that keeps the four that matter (`mesh_points`).
//!
//! Which side: a triangle of a one-sided mesh pushes only shapes whose centre is in front of its plane, however deep the
//! rest of them has sunk; the back of a two-sided one pushes those whose centre is behind.
//!
//! Nothing is lost between neighbours: a triangle may leave a contact to the neighbour that reaches further, but
//! if no triangle then reports a touch although some overlap the shape, they are looked at again and push along their faces.

use super::mesh_points::{Candidate, Candidates, Held};
use super::triangle::{Frame, Group, Reach, Solid};
use super::triangle_general::General;
use super::triangle_lanes::Near;
use super::triangle_solid::Faceted;
use super::{Manifold, ManifoldPoint};
use crate::math::{Aabb, Mat3, Pose, Real, Vec3, abs3, min};
use crate::shape::Support;
use crate::shape::polyhedron::{CuboidFeatures, Polyhedron};
use crate::shape::{LEAF, Leaves, MeshSides, Shape, Surface};
use crate::simd::{LaneVec3, Lanes};

/// How far behind a one-sided triangle a centre may be and still be pushed out in front, as a share of the scale of
/// the contact: a body that is halfway through does not flicker.
const BEHIND: Real = 0.1;

/// Contacts of a mesh (shape 1, whose frame the manifold is in) and a convex shape placed in that frame by `pose`.
pub(crate) fn collide(mesh: Surface<'_>, convex: &Shape, pose: &Pose, margin: Real, manifold: &mut Manifold) {
    let aabb = convex.aabb(pose).expand(margin);
    let mut contact = Contact { mesh, pose, aabb, margin, manifold };
    match convex {
        // A sphere has no directions of its own: the mesh's axes serve, and face normals stay exact.
        Shape::Sphere(sphere) => contact.gather(&mut { *sphere }, Mat3::IDENTITY),
        Shape::Capsule(capsule) => contact.gather(&mut { *capsule }, pose.rotation.to_mat3()),
        Shape::Cuboid(cuboid) => {
            contact.gather(&mut Faceted::new(CuboidFeatures::new(cuboid).view()), pose.rotation.to_mat3());
        }
        Shape::Hull(hull) => contact.gather(&mut Faceted::new(Polyhedron::from_hull(hull)), pose.rotation.to_mat3()),
        _ => {
            if let Some(support) = Support::new(convex) {
                contact.gather(&mut General::new(support), pose.rotation.to_mat3());
            } else {
                contact.manifold.clear();
            }
        }
    }
}

/// A convex shape near a mesh.
struct Contact<'a> {
    mesh: Surface<'a>,
    pose: &'a Pose,
    aabb: Aabb,
    margin: Real,
    manifold: &'a mut Manifold,
}

impl Contact<'_> {
    /// Finds the points and hands on the four that matter; `rotation` turns the solid's frame into the mesh's.
    fn gather(&mut self, solid: &mut impl Solid, rotation: Mat3) {
        let inner = solid.inner_radius();
        let scale = if self.margin > 0.0 { min(self.margin, inner) } else { 0.02 * inner };
        let frame = Frame { rotation, inverse: rotation.transpose(), position: self.pose.position, scale };
        let held = Held::take(self.manifold);
        let mut reach = Reach { margin: self.margin, scale, second_look: false };
        solid.place(&frame);
        let mut candidates = Candidates::new(0.02 * scale);
        let missing = self.touch_all(solid, &frame, &reach, &mut candidates);
        if missing && candidates.deepest() > 0.0 {
            reach.second_look = true;
            self.touch_all(solid, &frame, &reach, &mut candidates);
        }
        let (mesh, manifold, mut materials) = (self.mesh, &mut *self.manifold, [[0; 2]; 4]);
        let many = mesh.has_materials();
        let place = |point| frame.inverse * (point - frame.position);
        candidates.choose(&held, place, |candidate| {
            if many {
                materials[manifold.points().len() & 3][0] = mesh.material(candidate.triangle as usize);
            }
            manifold.push(point_in_mesh(mesh, &frame, candidate));
        });
        if many {
            manifold.set_point_materials(&materials);
        }
    }

    /// Adds the points of all triangles near the shape. Returns whether one might overlap that gave no point.
    fn touch_all(&self, solid: &mut impl Solid, frame: &Frame, reach: &Reach, out: &mut Candidates) -> bool {
        let bounds = solid.bounds().expand(self.margin);
        let near = Near {
            frame,
            reach,
            bounds,
            size: abs3(bounds.center()).max_element() + bounds.half_extents().max_element(),
            center: frame.position + frame.rotation * solid.center(),
            one_sided: self.mesh.sides() == MeshSides::One,
            behind: BEHIND * reach.scale,
        };
        let (mesh, touching) = (self.mesh, Group::default());
        let mut sieve = Sieve { mesh, near, solid, out, touching, missing: false };
        mesh.walk(&self.aabb, &mut sieve);
        let Sieve { solid, out, mut touching, missing, .. } = sieve;
        let missing = missing | solid.touch_group(mesh, frame, &mut touching, reach, out);
        missing | solid.finish(mesh, frame, reach, out)
    }
}

/// Hands on the triangles that are near a shape.
struct Sieve<'a, S> {
    mesh: Surface<'a>,
    near: Near<'a>,
    solid: &'a mut S,
    out: &'a mut Candidates,
    touching: Group,
    missing: bool,
}

impl<S: Solid> Leaves for Sieve<'_, S> {
    #[inline(always)]
    fn keep<W: Lanes<LEAF>>(&self, overlapping: W, center: &LaneVec3<W>, half: &LaneVec3<W>) -> W {
        self.near.keep_boxes(overlapping, center, half)
    }

    #[inline(always)]
    fn leaf<W: Lanes<LEAF>>(&mut self, first: usize, count: usize) {
        let found = self.near.sides(&*self.solid, &self.mesh.corners_of_leaf::<W>(first, count));
        let mut bits = found.abs().positive() & ((1 << count) - 1);
        let sides = found.to_array();
        while bits != 0 {
            let lane = bits.trailing_zeros() as usize % LEAF;
            bits &= bits - 1;
            if self.touching.push((first + lane) as u32, sides[lane]) {
                self.missing |=
                    self.solid.touch_group(self.mesh, self.near.frame, &mut self.touching, self.near.reach, self.out);
            }
        }
    }
}

/// A candidate in the frame of the mesh, with the exact normal of its triangle.
fn point_in_mesh(mesh: Surface<'_>, frame: &Frame, candidate: &Candidate) -> ManifoldPoint {
    let turned = frame.rotation * candidate.normal;
    let (separation, feature) = (candidate.separation, candidate.feature);
    let point1 = frame.rotation * candidate.position + frame.position;
    if !candidate.is_on_face() {
        return ManifoldPoint { point1, normal: turned * (1.0 / turned.length()), separation, feature };
    }
    let normal: Vec3 = mesh.facet(candidate.facet as usize).normal();
    let normal = if normal.dot(turned) < 0.0 { -normal } else { normal };
    ManifoldPoint { point1, normal, separation, feature }
}

#[cfg(test)]
#[path = "mesh_tests.rs"]
mod tests;
