//! Continuous collision: fast dynamic bodies are stopped at static and kinematic shapes that they would pass through.
//!
//! A body is fast when some point of it has moved farther in the step than half its inner radius, by going or by turning. Its
//! shapes are swept from where they were to where they are ([`way`]) against the static tree and the kinematic shapes; at
//! the first impact the body stays where it came within a slop of touching, with its velocity. Contact is then found in the
//! next step, which turns the velocity away. The rest of the step's motion is lost. (Bullets lose nothing: see [`bullets`].)
//!
//! Every shape has a core, which is thinner by half its inner radius ([`mover`]). Only a shape whose core would hit is stopped:
//! what merely slides or rolls on a floor comes near ever new triangles of it, and must not be held. A shape that comes from
//! afar is stopped where its surface hits; one that starts the step within the speculative distance has a contact
//! already, which lets it go along the surface or away, and is stopped where its core hits. So only what the core comes
//! near is looked at: of a mesh those triangles whose box meets the core's way and whose plane the core reaches. That
//! leaves nothing for a log that rolls over ten thousand triangles.
//!
//! Against a kinematic shape the way is that seen from the shape, and a body that hits goes on with the shape to the end of the
//! step: a door takes along what has run into it.
//!
//! Source: conservative advancement, Mirtich, "Impulse-based Dynamic Simulation", 1996.

mod bullets;
mod impact;
mod mover;
#[cfg(test)]
mod tests;
mod way;

use super::World;
use super::bodies::Body;
use super::definition::BodyKind;
use super::filters::UserFilters;
use super::one_way;
use super::settings::WorldSettings;
use super::shapes::ShapeSlot;
use crate::broad_phase::BroadPhase;
use crate::math::{Aabb, Pose, Real, Vec3, min};
use crate::narrow_phase::{Support, Sweep, gap, time_of_impact};
use crate::parallel::SharedSlice;
use crate::shape::{MeshSides, Shape, Surface};
use crate::solver::SolverBodies;
pub(crate) use bullets::FlightScratch;
pub use impact::Impact;
use mover::{Mover, is_fast};
use way::{Way, turned_back};

/// A body that may have passed through something, and the pose of its centre of mass when the step began.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FastBody {
    pub index: u32,
    pub start: Pose,
}

/// What a body needs to know of a kinematic one to tell whether it may have passed through it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct KinematicBody {
    center: Vec3,
    moved: Real,
    turned: Real,
    reach: Real,
    thickness: Real,
}

impl KinematicBody {
    /// Whether a body whose points have come no farther than `traveled`, and that has its own `thickness`, may have gone
    /// through: seen from this one it has moved farther than both are thick, and it was near.
    pub fn may_be_passed(&self, center: Vec3, (traveled, reach, thickness): (Real, Real, Real)) -> bool {
        let apart = (center - self.center).length();
        let moved = traveled + self.moved + self.turned * apart;
        moved > thickness + self.thickness && apart < self.reach + 3.0 * reach + moved
    }
}

/// A shape of a kinematic body on its way through the step.
#[derive(Clone, Debug)]
pub(crate) struct KinematicShape {
    slot: u32,
    way: Way,
    /// The box around all of its way.
    bounds: Aabb,
}

impl World {
    /// Stops fast bodies at the first static or kinematic shapes on their ways.
    pub(crate) fn stop_at_impacts(&mut self, fast: &[FastBody]) {
        if fast.is_empty() {
            return;
        }
        self.list_kinematic_shapes();
        let mut stops = std::mem::take(&mut self.stops);
        stops.clear();
        crate::storage::reserve(&mut stops, fast.len());
        stops.resize(fast.len(), None);
        let places = SharedSlice::new(&mut stops);
        let search = ImpactSearch {
            shapes: &self.shapes,
            bodies: &self.bodies,
            solver: &self.solver_bodies,
            broad_phase: &self.broad_phase,
            settings: &self.scaled,
            filters: &self.filters,
            kinematic: &self.kinematic_shapes,
        }; // not `impact_search`: the pool is changed meanwhile
        self.pool.run_ranges(fast.len(), 1, |range| {
            for at in range {
                // SAFETY: each place belongs to one run.
                unsafe { *places.get_mut(at) = search.stop_of(&fast[at]) };
            }
        });
        for (body, stop) in fast.iter().zip(&stops) {
            if let Some(at) = stop {
                self.stop_at(body.index, at);
            }
        }
        self.stops = stops;
    }

    /// Lists the kinematic bodies, where they go in this step.
    pub(crate) fn list_kinematic_bodies(&mut self, list: &mut Vec<KinematicBody>) {
        list.clear();
        for &index in self.kinematic.iter().filter(|&&index| self.bodies[index as usize].enabled) {
            let (body, state) = (&self.bodies[index as usize], &self.solver_bodies.states[index as usize]);
            let (moved, turned) =
                if body.awake { (state.translation.length(), state.turn.length()) } else { (0.0, 0.0) };
            let center = self.solver_bodies.masses[index as usize].center;
            let (reach, thickness) = (body.reach, body.inner_radius);
            crate::storage::push(list, KinematicBody { center, moved, turned, reach, thickness });
        }
    }

    /// Lists the solid shapes of kinematic bodies, with their ways.
    fn list_kinematic_shapes(&mut self) {
        let mut list = std::mem::take(&mut self.kinematic_shapes);
        list.clear();
        for &index in self.kinematic.iter().filter(|&&index| self.bodies[index as usize].enabled) {
            let (body, state) = (&self.bodies[index as usize], &self.solver_bodies.states[index as usize]);
            let end = self.solver_bodies.masses[index as usize].pose();
            let way = if body.awake {
                let start = Pose::new(end.position - state.translation, turned_back(end.rotation, state.turn));
                Way::new(start, end, state.turn)
            } else {
                Way::still(end)
            };
            for &slot in &body.shape_slots {
                let shape = &self.shapes[slot as usize];
                if shape.sensor {
                    continue;
                }
                let around = |pose: &Pose| shape.geometry.aabb(&pose.mul(&shape.from_center));
                let mut bounds = around(&way.end);
                for part in 0..way.parts {
                    bounds = bounds.union(&around(&way.part(part)[0]));
                }
                // Arcs bulge out of their chords by `1 − cos(φ/2)` of the radius, less than `φ² / 8`.
                let turn = way.turn.length() / way.parts as Real;
                let bulge = 0.125 * turn * turn * (shape.middle.length() + shape.reach);
                crate::storage::push(&mut list, KinematicShape { slot, way, bounds: bounds.expand(bulge) });
            }
        }
        self.kinematic_shapes = list;
    }

    /// Puts a body, given the frame of its centre of mass, where it was stopped.
    fn stop_at(&mut self, index: u32, at: &Pose) {
        let mass = &mut self.solver_bodies.masses[index as usize];
        (mass.center, mass.rotation) = (at.position, at.rotation);
        let body = &mut self.bodies[index as usize];
        body.pose = at.mul(&Pose::from_position(body.mass.center).inverse());
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

/// What a search for impacts reads.
struct ImpactSearch<'a> {
    shapes: &'a [ShapeSlot],
    bodies: &'a [Body],
    solver: &'a SolverBodies,
    broad_phase: &'a BroadPhase,
    settings: &'a WorldSettings,
    filters: &'a UserFilters,
    kinematic: &'a [KinematicShape],
}

/// Where a way is blocked.
#[derive(Clone, Copy)]
struct Stop {
    /// Share of the way, 0 to 1.
    time: Real,
    /// Where a kinematic shape takes the body to.
    carried: Option<Pose>,
}

impl ImpactSearch<'_> {
    /// Where the centre frame of a body is to be stopped, if it is.
    fn stop_of(&self, fast: &FastBody) -> Option<Pose> {
        let state = &self.solver.states[fast.index as usize];
        let end = self.solver.masses[fast.index as usize].pose();
        let way = Way::new(fast.start, end, state.turn);
        let slots = &self.bodies[fast.index as usize].shape_slots;
        let first = self.first_stop(slots, &way, self.kinematic)?;
        let Some(carried) = first.carried else { return Some(way.at(first.time)) };
        // What takes it along must not take it through a wall.
        let rest = Way::new(way.at(first.time), carried, state.turn * (1.0 - first.time));
        Some(self.first_stop(slots, &rest, &[]).map_or(carried, |stop| rest.at(stop.time)))
    }

    /// The first impact of the shapes of a body on its way.
    fn first_stop(&self, slots: &[u32], way: &Way, kinematic: &[KinematicShape]) -> Option<Stop> {
        let mut first = None;
        let mut limit = 1.0;
        for &slot in slots {
            let shape = &self.shapes[slot as usize];
            if shape.sensor || !is_fast(shape, way, 0.0) {
                continue;
            }
            if kinematic.is_empty() && self.is_clear(shape, way) {
                continue;
            }
            for part in 0..way.parts {
                let from = part as Real / way.parts as Real;
                if from >= limit {
                    break;
                }
                let ends = way.part(part);
                let Some(mover) = Mover::new((shape, slot), &ends, Mover::turns_much(way)) else { break };
                let found = self.first_impact(&mover).map(|time| Stop { time, carried: None });
                let found = self.first_carrier(&mover, (&ends, way, part), (found, kinematic));
                if let Some(stop) = found {
                    let time = (part as Real + stop.time) / way.parts as Real;
                    if time < limit {
                        limit = time;
                        first = Some(Stop { time, ..stop });
                    }
                    break;
                }
            }
        }
        first
    }

    /// Whether nothing static is near the way of a shape but meshes, of which no triangle is: told by balls around the
    /// centre of mass, long before the shape's own box is made.
    ///
    /// A shape turns about the middle of its core, which goes straight beside the centre of mass and at its distance
    /// from that one; so no point comes farther from the way of the centre than the farthest is from it at first, and
    /// twice that distance.
    fn is_clear(&self, shape: &ShapeSlot, way: &Way) -> bool {
        let pivot = match &shape.geometry {
            Shape::Sphere(_) | Shape::Capsule(_) | Shape::Cuboid(_) => shape.from_center.position,
            Shape::Hull(hull) => shape.from_center.transform_point(hull.centroid()),
            _ => return false,
        };
        let reach = shape.middle.length() + shape.reach + 2.0 * pivot.length();
        let path = Aabb::from_points([way.start.position, way.end.position]);
        let around = path.expand(reach + self.settings.speculative_distance + 2.0 * self.settings.slop);
        let mut clear = true;
        self.broad_phase.query_static(&around, |slot| {
            let other = &self.shapes[slot as usize];
            let Shape::Mesh(mesh) = &other.geometry else {
                clear = false;
                return;
            };
            if clear {
                let pose = self.bodies[other.body as usize].pose.mul(&other.pose);
                mesh.for_each_facet(&around.transform(&pose.inverse()), |_| clear = false);
            }
        });
        clear
    }

    /// Share of the path at which a shape first comes within a slop of a static one.
    ///
    /// Nothing stops a shape but what its core would hit, so that alone is looked for.
    fn first_impact(&self, mover: &Mover<'_>) -> Option<Real> {
        let mut first = None;
        let near = 2.0 * self.settings.slop;
        self.broad_phase.query_static(&mover.around(near), |slot| {
            let other = &self.shapes[slot as usize];
            let body = &self.bodies[other.body as usize];
            if body.kind == BodyKind::Static && self.may_hit(mover, slot) {
                let pose = body.pose.mul(&other.pose);
                let seen = mover.relative_to(&[pose; 2]);
                if !self.lets_pass(other, &seen) {
                    first = earlier(first, self.impact_with(&other.geometry, &seen));
                }
            }
        });
        first
    }

    /// The first impact with a kinematic shape in part `part` of a way, if it comes before the one `found`.
    fn first_carrier(
        &self,
        mover: &Mover<'_>,
        (ends, way, part): (&[Pose; 2], &Way, usize),
        (found, kinematic): (Option<Stop>, &[KinematicShape]),
    ) -> Option<Stop> {
        let mut first = found;
        if kinematic.is_empty() {
            return first;
        }
        let near = 2.0 * self.settings.slop;
        let around = mover.around(near);
        for fixed in kinematic.iter().filter(|fixed| fixed.bounds.overlaps(&around) && self.may_hit(mover, fixed.slot))
        {
            let other = &self.shapes[fixed.slot as usize];
            let frames = [part, part + 1].map(|node| fixed.way.at(node as Real / way.parts as Real));
            let [start, end] = [0, 1].map(|at| frames[at].relative(&ends[at]));
            // What goes along with a drum is slow, seen from there; and nothing slow gets through what is thick.
            let turn = (way.turn - fixed.way.turn) / way.parts as Real;
            if !is_fast(mover.shape, &Way::new(start, end, turn), other.geometry.inner_radius()) {
                continue;
            }
            // Seen from a body that moves, ways are bent; swept about the centre, so that the body goes as its shape does.
            let from_other = other.from_center.inverse();
            let seen = [start, end].map(|pose| from_other.mul(&pose));
            let Some(seen) = Mover::new((mover.shape, mover.slot), &seen, true) else { continue };
            if !other.geometry.local_aabb().overlaps(&seen.around(near)) || self.lets_pass(other, &seen) {
                continue;
            }
            let Some(time) = self.impact_with(&other.geometry, &seen) else { continue };
            if first.is_none_or(|stop| time < stop.time) {
                first = Some(Stop { time, carried: Some(fixed.way.end.mul(&start.interpolate(&end, time))) });
            }
        }
        first
    }

    /// Whether a one-way platform lets the shape through.
    fn lets_pass(&self, platform: &ShapeSlot, seen: &Mover<'_>) -> bool {
        let ends = (&seen.path.start, &seen.path.end);
        one_way::lets_pass(platform, &seen.shape.geometry, ends, self.settings.speculative_distance)
    }

    fn may_hit(&self, mover: &Mover<'_>, slot: u32) -> bool {
        let other = &self.shapes[slot as usize];
        !other.sensor
            && mover.shape.filter.accepts(&other.filter)
            && self.filters.passes_pair((self.shapes, self.bodies), [mover.slot, slot])
    }

    /// First impact with a shape, in whose frame the mover is.
    fn impact_with(&self, geometry: &Shape, mover: &Mover<'_>) -> Option<Real> {
        match geometry {
            Shape::Mesh(mesh) => self.mesh_impact(Surface::Mesh(mesh), mover),
            Shape::HeightField(field) => self.mesh_impact(Surface::Field(field), mover),
            Shape::Compound(compound) => {
                let mut first = None;
                compound.for_each_child(&mover.around(2.0 * self.settings.slop), |_, child, pose| {
                    first = earlier(first, self.impact_with(child, &mover.relative_to(&[*pose; 2])));
                });
                first
            }
            Shape::Voxels(grid) => {
                let mut first = None;
                grid.for_each_box(&mover.around(2.0 * self.settings.slop), |_, cuboid, center| {
                    let seen = mover.relative_to(&[Pose::from_position(center); 2]);
                    first = earlier(first, self.impact(&Support::Cuboid(cuboid), &seen));
                });
                first
            }
            convex => Support::new(convex).and_then(|fixed| self.impact(&fixed, mover)),
        }
    }

    /// First impact with a triangle of a mesh, coming from its solid side; all in the mesh's frame.
    fn mesh_impact(&self, mesh: Surface<'_>, mover: &Mover<'_>) -> Option<Real> {
        let near = 2.0 * self.settings.slop;
        let mut first = None;
        let swings = mover.swings();
        mesh.for_each_facet(&mover.around(near), |index| {
            let facet = mesh.facet(index);
            let (corners, normal) = (facet.corners(), facet.normal());
            let heights = mover.heights(normal, corners[0]);
            let (in_front, comes) = (heights[0] >= 0.0, swings || heights[1] < heights[0]);
            if mesh.sides() == MeshSides::One && !(in_front && comes) {
                return;
            }
            let side = if in_front { 1.0 } else { -1.0 };
            if mover.lowest_over(normal * side, heights.map(|height| height * side)) <= near {
                first = earlier(first, self.impact(&Support::Triangle(corners), mover));
            }
        });
        first
    }

    /// First impact with a convex shape at the origin.
    fn impact(&self, fixed: &Support<'_>, mover: &Mover<'_>) -> Option<Real> {
        let (still, slop) = (Sweep::still(Pose::IDENTITY), self.settings.slop);
        if mover.whole && gap(fixed, &mover.support, &mover.path.start) > 0.0 {
            return time_of_impact(fixed, &still, &mover.support, &mover.path, slop);
        }
        // A violent step before can have pushed the core in: then its spine stays on this side, or at least its very middle.
        if gap(fixed, &mover.core, &mover.core_path.start) <= 0.0 {
            if let Some(spine) = mover.spine()
                && gap(fixed, &spine, &mover.core_path.start) > 0.0
            {
                return time_of_impact(fixed, &still, &spine, &mover.core_path, slop);
            }
            let (middle, path) = mover.middle();
            let hit = time_of_impact(fixed, &still, &middle, &path, slop)?;
            let no_nearer = gap(fixed, &middle, &path.start) <= middle.radius();
            return Some(if no_nearer { 0.0 } else { hit }); // half the gap in each step is nothing in the end
        }
        let core = time_of_impact(fixed, &still, &mover.core, &mover.core_path, slop)?;
        if gap(fixed, &mover.support, &mover.path.start) <= self.settings.speculative_distance {
            return Some(core);
        }
        let surface = time_of_impact(fixed, &still, &mover.support, &mover.path, slop);
        Some(surface.map_or(core, |surface| min(surface, core)))
    }
}

/// The earlier of two times, of which either may be missing.
fn earlier(a: Option<Real>, b: Option<Real>) -> Option<Real> {
    match (a, b) {
        (Some(a), Some(b)) => Some(min(a, b)),
        (a, b) => a.or(b),
    }
}
