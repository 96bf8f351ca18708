//! Continuous collision: fast dynamic bodies are stopped at static shapes that they would pass through.
//!
//! A body is fast when some point of it has moved farther in the step than half its inner radius. Its shapes are swept from
//! where they were to where they are against the static tree; at the first impact the body stays where it came within a slop of
//! touching, with its velocity. Contact is then found in the next step, which turns the velocity away. The rest of the step's
//! motion is lost.
//!
//! Source: conservative advancement, Mirtich, "Impulse-based Dynamic Simulation", 1996.

use super::World;
use super::definition::BodyKind;
use super::shapes::ShapeSlot;
use crate::math::{Pose, Real, min};
use crate::narrow_phase::{Support, Sweep, time_of_impact};
use crate::shape::{MeshSides, Shape, TriangleMesh};

impl World {
    /// Stops a fast body at the first static shape on its way.
    pub(crate) fn stop_at_impact(&mut self, index: u32) {
        let body = &self.bodies[index as usize];
        let state = &self.solver_bodies.states[index as usize];
        let end = self.solver_bodies.masses[index as usize].pose();
        // The start of the step, at the centre of mass: the rotation by the step's rotation vector undone.
        let start = Pose::new(end.position - state.translation, end.rotation.integrate(-state.turn));
        let center = Pose::from_position(body.mass.center);
        let mut first: Real = 1.0;
        for &slot in &body.shape_slots {
            let shape = &self.shapes[slot as usize];
            if !shape.sensor
                && let Some(support) = Support::new(&shape.geometry)
            {
                let from_center = center.inverse().mul(&shape.pose);
                let path = Sweep { start: start.mul(&from_center), end: end.mul(&from_center) };
                first = min(self.first_impact(shape, &support, &path, first), first);
            }
        }
        if first < 1.0 {
            let at = start.interpolate(&end, first);
            let mass = &mut self.solver_bodies.masses[index as usize];
            (mass.center, mass.rotation) = (at.position, at.rotation);
            let body = &mut self.bodies[index as usize];
            body.pose = at.mul(&center.inverse());
            let slots = std::mem::take(&mut body.shape_slots);
            for &slot in &slots {
                let near = self.tight_aabb(slot).expand(self.scaled.speculative_distance);
                if self.broad_phase.update(slot, &near, &near.expand(self.scaled.speculative_distance)) {
                    self.note_moved(slot);
                }
            }
            self.bodies[index as usize].shape_slots = slots;
        }
    }

    /// Fraction of the path at which a shape first comes within a slop of a static one; `limit` if it does not.
    fn first_impact(&self, shape: &ShapeSlot, support: &Support<'_>, path: &Sweep, limit: Real) -> Real {
        let swept = shape.geometry.aabb(&path.start).union(&shape.geometry.aabb(&path.end));
        let mut first = limit;
        self.broad_phase.query(&swept, |slot| {
            let other = &self.shapes[slot as usize];
            let body = &self.bodies[other.body as usize];
            if body.kind == BodyKind::Static && !other.sensor && shape.filter.accepts(&other.filter) {
                let pose = body.pose.mul(&other.pose);
                let impact = match &other.geometry {
                    Shape::Mesh(mesh) => self.mesh_impact(mesh, &pose, support, path),
                    convex => Support::new(convex)
                        .and_then(|fixed| time_of_impact(&fixed, &Sweep::still(pose), support, path, self.scaled.slop)),
                };
                first = min(impact.unwrap_or(limit), first);
            }
            true
        });
        first
    }

    /// First impact with a triangle of a mesh, coming from its solid side.
    fn mesh_impact(&self, mesh: &TriangleMesh, pose: &Pose, support: &Support<'_>, path: &Sweep) -> Option<Real> {
        let local = Sweep { start: pose.relative(&path.start), end: pose.relative(&path.end) };
        let reach = support.reach() + support.radius();
        let swept = crate::math::Aabb::from_points([local.start.position, local.end.position]).expand(reach);
        let motion = local.end.position - local.start.position;
        let mut first = None;
        mesh.for_each_triangle(&swept, |corners, _| {
            let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
            let from_behind = mesh.sides() == MeshSides::One
                && (motion.dot(normal) >= 0.0 || (local.start.position - corners[0]).dot(normal) < 0.0);
            if !from_behind {
                let still = Sweep::still(Pose::IDENTITY);
                let impact = time_of_impact(&Support::Triangle(corners), &still, support, &local, self.scaled.slop);
                if let Some(t) = impact
                    && first.is_none_or(|earliest| t < earliest)
                {
                    first = Some(t);
                }
            }
        });
        first
    }
}
