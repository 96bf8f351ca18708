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

use super::mesh_points::{Candidate, Candidates, NO_FACET};
use super::polyhedron::{CuboidFeatures, Polyhedron};
use super::triangle::{Frame, Group, Reach, Solid};
use super::triangle_lanes::Near;
use super::triangle_solid::Solids;
use super::{Manifold, ManifoldPoint, PairCache};
use crate::math::{Aabb, Mat3, Pose, Real, Vec3};
use crate::shape::{MeshSides, OCTET, Shape, TriangleMesh};

/// How far behind a one-sided triangle a centre may be and still be pushed out in front, as a share of the scale of
/// the contact: a body that is halfway through does not flicker.
const BEHIND: Real = 0.1;

/// Contacts of a mesh (shape 1, whose frame the manifold is in) and a convex shape placed in that frame by `pose`.
pub(crate) fn collide(
    mesh: &TriangleMesh,
    convex: &Shape,
    pose: &Pose,
    margin: Real,
    _cache: &mut PairCache,
    manifold: &mut Manifold,
) {
    manifold.clear();
    let aabb = convex.aabb(pose).expand(margin);
    let mut contact = Contact { mesh, pose, aabb, margin, manifold };
    match convex {
        // A sphere has no directions of its own: the mesh's axes serve, and face normals stay exact.
        Shape::Sphere(sphere) => contact.gather(&mut { *sphere }, Mat3::IDENTITY),
        Shape::Capsule(capsule) => contact.gather(&mut { *capsule }, pose.rotation.to_mat3()),
        Shape::Cuboid(cuboid) => {
            contact.gather(&mut Solids::new(CuboidFeatures::new(cuboid).view()), pose.rotation.to_mat3());
        }
        Shape::Hull(hull) => contact.gather(&mut Solids::new(Polyhedron::from_hull(hull)), pose.rotation.to_mat3()),
        Shape::Mesh(_) => {}
    }
}

struct Contact<'a> {
    mesh: &'a TriangleMesh,
    pose: &'a Pose,
    aabb: Aabb,
    margin: Real,
    manifold: &'a mut Manifold,
}

impl Contact<'_> {
    fn gather(&mut self, solid: &mut impl Solid, rotation: Mat3) {
        let inner = solid.inner_radius();
        let scale = if self.margin > 0.0 { crate::math::min(self.margin, inner) } else { 0.02 * inner };
        let frame = Frame { rotation, inverse: rotation.transpose(), position: self.pose.position, scale };
        let mut reach = Reach { margin: self.margin, scale, second_look: false };
        let mut candidates = Candidates::new(0.02 * scale);
        let missing = self.touch_all(solid, &frame, &reach, &mut candidates);
        if missing && candidates.deepest() > 0.0 {
            reach.second_look = true;
            self.touch_all(solid, &frame, &reach, &mut candidates);
        }
        candidates.choose(|candidate| self.manifold.push(point_in_mesh(self.mesh, &frame, candidate)));
    }

    /// Adds the points of all triangles near the shape. Returns whether one might overlap that gave no point.
    fn touch_all(&self, solid: &mut impl Solid, frame: &Frame, reach: &Reach, out: &mut Candidates) -> bool {
        let near = Near {
            frame,
            aabb: self.aabb,
            bounds: solid.bounds().expand(self.margin),
            center: frame.position + frame.rotation * solid.center(),
            far: solid.outer_radius() + self.margin,
            one_sided: self.mesh.sides() == MeshSides::One,
            behind: BEHIND * reach.scale,
        };
        let mut missing = false;
        let mut touching = Group::default();
        let mut sift = |octet: usize, found: u8| {
            let sides = near.sides(self.mesh.octet(octet));
            for (k, &side) in sides.iter().enumerate() {
                let wanted = (found >> k & 1 == 1) & (side != 0.0);
                if wanted && touching.push((octet * OCTET + k) as u32, side) {
                    missing |= solid.touch_group(self.mesh, frame, &mut touching, reach, out);
                }
            }
        };
        // The tree gives ascending numbers: those of one octet in a row.
        let (mut octet, mut found) = (0, 0_u8);
        self.mesh.for_each_candidate(&self.aabb, |index| {
            if index / OCTET != octet && found != 0 {
                sift(octet, std::mem::take(&mut found));
            }
            octet = index / OCTET;
            found |= 1 << (index % OCTET);
        });
        if found != 0 {
            sift(octet, found);
        }
        missing | solid.touch_group(self.mesh, frame, &mut touching, reach, out)
    }
}

/// A candidate in the frame of the mesh, with the exact normal of its triangle.
fn point_in_mesh(mesh: &TriangleMesh, frame: &Frame, candidate: &Candidate) -> ManifoldPoint {
    let turned = frame.rotation * candidate.normal;
    let (separation, feature) = (candidate.separation, candidate.feature);
    let point1 = frame.rotation * candidate.position + frame.position;
    if candidate.facet == NO_FACET {
        return ManifoldPoint { point1, normal: turned * (1.0 / turned.length()), separation, feature };
    }
    let normal: Vec3 = mesh.facet(candidate.facet as usize).normal;
    let normal = if normal.dot(turned) < 0.0 { -normal } else { normal };
    ManifoldPoint { point1, normal, separation, feature }
}

#[cfg(test)]
#[path = "mesh_tests.rs"]
mod tests;
