//! Continuous collision: fast dynamic bodies are stopped at static and kinematic shapes that they would pass through.
//!
//! A body is fast when some point of it has moved farther in the step than half its inner radius, by going or by turning. Its
//! shapes, piece by piece ([`piece`]), are swept from where they were to where they are ([`way`]) against the static tree and the
//! kinematic shapes; at the first impact the body stays where it came within a slop of touching, with the velocity that it had
//! there. Contact is then found in the next step, which turns the velocity away. The rest of the step's motion is lost: to go on
//! would be to leave the place where it hits. (Bullets lose nothing: see [`bullets`].) A body that was in contact already
//! goes on along what holds it: it might be held in every step, and hang there while its speed grows. Only one that turns far
//! in the step, and is no body of many pieces, stays: a thin rod that whirls would be worked through a wall.
//!
//! Every piece has a core, which is thinner by half its inner radius. Only a shape whose core would hit is stopped:
//! what merely slides or rolls on a floor comes near ever new triangles of it, and must not be held. A shape that comes from
//! afar is stopped where its surface hits; one that starts the step within the speculative distance has a contact
//! already, which lets it go along the surface or away, and is stopped where its core hits. So only what the core comes
//! near is looked at: of a mesh those triangles whose box meets the core's way and whose plane the core reaches. That
//! leaves nothing for a log that rolls over ten thousand triangles.
//!
//! Against a kinematic shape the way is that seen from the shape, and a body that hits goes on with the shape to the end of the
//! step: a door takes along what has run into it. A kinematic body that is itself fast takes along what is slow or asleep too; the
//! next step finds the contact and strikes.
//!
//! Source: conservative advancement, Mirtich, "Impulse-based Dynamic Simulation", 1996.

mod bullets;
mod impact;
mod mover;
mod piece;
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
use crate::arbiter::NONE;
use crate::broad_phase::{BroadPhase, TreeKind};
use crate::math::{Aabb, Pose, Real, Vec3, min};
use crate::narrow_phase::{Approach, Support, Sweep, Touch, approach, gap};
use crate::parallel::SharedSlice;
use crate::shape::{Cuboid, MeshSides, Shape, Surface};
use crate::solver::SolverBodies;
pub(crate) use bullets::FlightScratch;
pub(super) use bullets::MOST_TURN;
pub use impact::Impact;
use mover::{Mover, is_fast};
pub(super) use piece::depth_on_body;
use piece::{Piece, each_piece, has_pieces};
use way::{Way, turned_back};

/// How far a body goes on at most along what holds it in a step, in speculative distances: a metre by default. What would go
/// farther stays: the contact that it has had says little of what it would slide on.
const MOST_SLIDE: Real = 50.0;
/// How often a body goes on along what holds it in a step.
const MOST_SLIDES: usize = 4;
/// Share of its way that a body has to get on for its turn to go on too.
const LEAST_PROGRESS: Real = 1e-3;

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
    /// Stops fast bodies at the first static or kinematic shapes on their ways, and has fast kinematic bodies take along what
    /// they would sweep over.
    pub(crate) fn stop_at_impacts(&mut self, fast: &mut Vec<FastBody>) {
        self.flight.held.clear();
        let swept_over = self.kinematic_sweeps();
        if fast.is_empty() && !swept_over {
            return;
        }
        self.list_kinematic_shapes();
        if swept_over {
            self.list_swept_over(fast);
        }
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
            if let Some(stop) = stop {
                if !self.bodies[body.index as usize].awake {
                    self.wake(body.index);
                }
                self.stop_at(body.index, &stop.way.last());
                self.take_back(body.index, stop);
                crate::storage::push(&mut self.flight.held, (body.index, stop.way));
            }
        }
        self.flight.held.sort_unstable_by_key(|held| held.0);
        self.stops = stops;
    }

    /// Takes back what speed towards an obstacle a body has gained in the part of the step that it has not moved for. What
    /// falls on a floor would hit it too fast by up to `g dt`.
    fn take_back(&mut self, index: u32, stop: &Held) {
        let state = &mut self.solver_bodies.states[index as usize];
        let (approach, gained) = (
            -state.linear_velocity.dot(stop.normal),
            -self.solver_bodies.motions[index as usize].acceleration.dot(stop.normal) * (stop.lost * self.dt),
        );
        if approach > 0.0 && gained > 0.0 {
            let free = self.bodies[index as usize].locked_axes.free().0;
            state.linear_velocity += free * stop.normal * min(gained, approach);
        }
    }

    /// Whether a kinematic body that is no bullet moves farther in this step than it is thick.
    fn kinematic_sweeps(&self) -> bool {
        let sweeps = |index: u32| {
            let (body, state) = (&self.bodies[index as usize], &self.solver_bodies.states[index as usize]);
            let way = state.translation.length() + state.turn.length() * body.reach;
            body.sweeps() && way > body.inner_radius
        };
        self.scaled.continuous && self.awake_kinematic.iter().any(|&index| sweeps(index))
    }

    /// Appends the slow and the sleeping bodies that kinematic ones may have swept over.
    fn list_swept_over(&self, fast: &mut Vec<FastBody>) {
        let known = fast.len();
        let near = self.scaled.speculative_distance;
        for moving in &self.kinematic_shapes {
            let shape = &self.shapes[moving.slot as usize];
            let bat = &self.bodies[shape.body as usize];
            if !bat.sweeps() || moving.way.length_at(shape) <= bat.inner_radius {
                continue;
            }
            self.broad_phase.tree(TreeKind::Moving).query(&moving.bounds.expand(near), |slot| {
                let index = self.shapes[slot as usize].body;
                let body = &self.bodies[index as usize];
                if body.is_dynamic() && body.continuous && !body.bullet && body.enabled && !body.frozen {
                    let end = self.solver_bodies.masses[index as usize].pose();
                    let state = &self.solver_bodies.states[index as usize];
                    let moved = if body.awake { state.translation } else { Vec3::ZERO };
                    let turn = if body.awake { state.turn } else { Vec3::ZERO };
                    let start = Pose::new(end.position - moved, turned_back(end.rotation, turn));
                    crate::storage::push(fast, FastBody { index, start });
                }
                true
            });
        }
        // Fast ones have been listed with the pose that they had.
        let (before, found) = fast.split_at_mut(known);
        found.sort_unstable_by_key(|body| body.index);
        let mut kept = known;
        let mut last = NONE;
        for at in 0..found.len() {
            let body = found[at];
            if body.index != last && before.binary_search_by_key(&body.index, |body| body.index).is_err() {
                found[kept - known] = body;
                kept += 1;
            }
            last = body.index;
        }
        fast.truncate(kept);
    }

    /// Lists the kinematic bodies that are awake, where they go in this step; or those at rest.
    pub(crate) fn list_kinematic_bodies(&self, awake: bool, list: &mut Vec<KinematicBody>) {
        list.clear();
        let among = if awake { &self.awake_kinematic } else { &self.kinematic };
        for &index in among {
            let (body, state) = (&self.bodies[index as usize], &self.solver_bodies.states[index as usize]);
            if !body.enabled || body.awake != awake {
                continue;
            }
            let (moved, turned) = if awake { (state.translation.length(), state.turn.length()) } else { (0.0, 0.0) };
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

/// Where a body is held.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Held {
    /// How it has come there.
    way: Way,
    /// From what holds it to the body.
    normal: Vec3,
    /// Share of the step in which it has not moved towards that.
    lost: Real,
}

/// An impact with a shape.
#[derive(Clone, Copy)]
struct Hit {
    /// Share of the way, 0 to 1.
    time: Real,
    /// Unit vector from that shape, in its frame until it is turned.
    normal: Vec3,
    /// Whether there was a contact when the way began.
    touches: bool,
}

/// Where a way is blocked.
#[derive(Clone, Copy)]
struct Stop {
    /// The normal is in world space.
    hit: Hit,
    /// Where a kinematic shape takes the body to.
    carried: Option<Pose>,
}

impl ImpactSearch<'_> {
    /// Where the centre frame of a body is to be stopped, if it is.
    fn stop_of(&self, fast: &FastBody) -> Option<Held> {
        let state = &self.solver.states[fast.index as usize];
        let end = self.solver.masses[fast.index as usize].pose();
        let body = &self.bodies[fast.index as usize];
        let turn = if body.awake { state.turn } else { Vec3::ZERO };
        let way = Way::new(fast.start, end, turn);
        let slots = &body.shape_slots;
        let first = self.first_stop(slots, &way, self.kinematic)?;
        let (time, normal) = (first.hit.time, first.hit.normal);
        let Some(carried) = first.carried else {
            let has_many = || slots.iter().any(|&slot| has_pieces(&self.shapes[slot as usize].geometry));
            if first.hit.touches && (way.parts == 1 || has_many()) {
                return Some(self.slide(body, &way, first.hit));
            }
            // What a contact has held for all of the step has gained nothing.
            let lost = if first.hit.touches { 0.0 } else { 1.0 - time };
            return Some(Held { way: way.stopped(time), normal, lost });
        };
        // What takes it along must not take it through a wall.
        let rest = Way::new(way.at(time), carried, turn * (1.0 - time));
        let at = self.first_stop(slots, &rest, &[]).map_or(carried, |stop| rest.at(stop.hit.time));
        Some(Held { way: Way::still(at), normal, lost: 0.0 })
    }

    /// Lets a body go on along what holds it. It has had a contact with that for all of the step, so its
    /// velocity is what the contact has made of it; only what is new (of a body that comes from afar) has to be met where it is.
    ///
    /// What is left of the way has its part towards the obstacle taken out; where turning alone is what is held, the body
    /// goes on without it.
    fn slide(&self, body: &Body, way: &Way, hit: Hit) -> Held {
        let slots = &body.shape_slots;
        let free = body.locked_axes.free().0;
        let (mut way, mut hit, mut normals) = (*way, hit, [Vec3::ZERO; MOST_SLIDES]);
        for at in 0..MOST_SLIDES {
            let here = way.at(hit.time);
            let left = 1.0 - hit.time;
            normals[at] = hit.normal;
            let along = free * along_all((way.end.position - way.start.position) * left, &normals[..=at]);
            if along.length() > MOST_SLIDE * self.settings.speculative_distance {
                return Held { way: Way::still(here), normal: hit.normal, lost: 0.0 };
            }
            // What is held at once is held by its turning, or by more than one obstacle.
            let turns = hit.time > LEAST_PROGRESS && at + 2 < MOST_SLIDES;
            let (rotation, turn) =
                if turns { (way.end.rotation, way.turn * left) } else { (here.rotation, Vec3::ZERO) };
            way = Way::new(here, Pose::new(here.position + along, rotation), turn);
            match self.first_stop(slots, &way, self.kinematic) {
                None => return Held { way: Way::still(way.end), normal: hit.normal, lost: 0.0 },
                Some(stop) if stop.carried.is_some() || !stop.hit.touches => {
                    return Held { way: Way::still(way.at(stop.hit.time)), normal: stop.hit.normal, lost: 0.0 };
                }
                Some(stop) => hit = stop.hit,
            }
        }
        Held { way: Way::still(way.at(hit.time)), normal: hit.normal, lost: 0.0 }
    }

    /// The first impact of the shapes of a body on its way.
    fn first_stop(&self, slots: &[u32], way: &Way, kinematic: &[KinematicShape]) -> Option<Stop> {
        let mut first: Option<Stop> = None;
        for &slot in slots {
            let shape = &self.shapes[slot as usize];
            if shape.sensor || kinematic.is_empty() && has_pieces(&shape.geometry) && self.is_clear(shape, None, way) {
                continue;
            }
            each_piece(shape, &mut |piece| {
                let fast = is_fast(piece, way, 0.0);
                if !fast && kinematic.is_empty() {
                    return;
                }
                if kinematic.is_empty() && self.is_clear(shape, Some(piece), way) {
                    return;
                }
                self.stop_piece((shape, slot, piece), way, (fast, kinematic), &mut first);
            });
        }
        first
    }

    /// The first impact of a piece, if it is before the one found.
    fn stop_piece(
        &self,
        (shape, slot, piece): (&ShapeSlot, u32, &Piece<'_>),
        way: &Way,
        (fast, kinematic): (bool, &[KinematicShape]),
        first: &mut Option<Stop>,
    ) {
        for part in 0..way.parts {
            let from = part as Real / way.parts as Real;
            let limit = first.map_or(1.0, |stop| stop.hit.time);
            if from >= limit {
                break;
            }
            let mut ends = way.part(part);
            // Of what is made of many pieces, most come nowhere before the first of them hits.
            let until = if has_pieces(&shape.geometry) { limit * way.parts as Real - part as Real } else { 1.0 };
            let until = if until < 1.0 { until } else { 1.0 };
            if until < 1.0 {
                ends[1] = ends[0].interpolate(&ends[1], until);
            }
            let mover = Mover::new((shape, slot), piece, &ends, Mover::turns_much(way));
            let found = if fast { self.first_impact(&mover) } else { None };
            let found = found.map(|hit| Stop { hit, carried: None });
            let found = self.first_carrier(&mover, (&ends, way, [from, until / way.parts as Real]), (found, kinematic));
            if let Some(stop) = found {
                let time = (part as Real + stop.hit.time * until) / way.parts as Real;
                if time < limit {
                    *first = Some(Stop { hit: Hit { time, ..stop.hit }, ..stop });
                }
                break;
            }
        }
    }

    /// Whether nothing static is near the way of a shape but meshes, of which no triangle is: told by balls, long before the
    /// shape's own box is made. Without a `piece` all of them are meant.
    ///
    /// A piece turns about the middle of its core, which goes straight: a ball around that middle holds the core, which is all
    /// that stops it. Where the body turns far, or all pieces are meant, the ball is around the centre of mass. The middle goes
    /// straight beside that one and at its distance from it; so no point comes farther from the way of the centre than
    /// the farthest is from it at first, and twice that distance.
    fn is_clear(&self, shape: &ShapeSlot, piece: Option<&Piece<'_>>, way: &Way) -> bool {
        let (ends, reach) = match piece {
            Some(piece) if !Mover::turns_much(way) => {
                let middle = piece.place.transform_point(piece.middle());
                let ends = [&way.start, &way.end].map(|pose| pose.transform_point(middle));
                (ends, piece.core.support.reach(piece.core.middle))
            }
            _ => {
                let farthest = shape.middle.length() + shape.reach;
                let pivot = piece.map_or(farthest, |piece| piece.place.transform_point(piece.middle()).length());
                ([way.start.position, way.end.position], farthest + 2.0 * pivot)
            }
        };
        let around =
            Aabb::from_points(ends).expand(reach + self.settings.speculative_distance + 2.0 * self.settings.slop);
        let mut clear = true;
        self.broad_phase.query_static(&around, |slot| {
            let other = &self.shapes[slot as usize];
            let Shape::Mesh(mesh) = &other.geometry else {
                clear = false;
                return;
            };
            if clear {
                let pose = self.bodies[other.body as usize].pose.mul(&other.pose);
                clear = !mesh.meets_facet(&around.transform(&pose.inverse()));
            }
        });
        clear
    }

    /// Where on its path a shape first comes within a slop of a static one; the normal is in world space.
    ///
    /// Nothing stops a shape but what its core would hit, so that alone is looked for.
    fn first_impact(&self, mover: &Mover<'_>) -> Option<Hit> {
        let mut first = None;
        let near = 2.0 * self.settings.slop;
        self.broad_phase.query_static(&mover.around(near), |slot| {
            let other = &self.shapes[slot as usize];
            let body = &self.bodies[other.body as usize];
            if body.kind == BodyKind::Static && self.may_hit(mover, slot) {
                let pose = body.pose.mul(&other.pose);
                let seen = mover.relative_to(&[pose; 2]);
                if !self.lets_pass(other, &seen) {
                    first = earlier(first, self.impact_with(&other.geometry, &seen).map(|hit| hit.turned(&pose)));
                }
            }
        });
        first
    }

    /// The first impact with a kinematic shape in a part of a way (from a share of it on, so much of it), if it comes before
    /// the one `found`.
    fn first_carrier(
        &self,
        mover: &Mover<'_>,
        (ends, way, [from, share]): (&[Pose; 2], &Way, [Real; 2]),
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
            let frames = [fixed.way.at(from), fixed.way.at(from + share)];
            let [start, end] = [0, 1].map(|at| frames[at].relative(&ends[at]));
            // What goes along with a drum is slow, seen from there; and nothing slow gets through what is thick.
            let turn = (way.turn - fixed.way.turn) * share;
            let slack = self.bodies[other.body as usize].inner_radius;
            if !is_fast(&mover.piece, &Way::new(start, end, turn), slack) {
                continue;
            }
            // Seen from a body that moves, ways are bent; swept about the centre, so that the body goes as its shape does.
            let from_other = other.from_center.inverse();
            let seen = [start, end].map(|pose| from_other.mul(&pose));
            let seen = Mover::new((mover.shape, mover.slot), &mover.piece, &seen, true);
            if !other.geometry.local_aabb().overlaps(&seen.around(near)) || self.lets_pass(other, &seen) {
                continue;
            }
            let Some(hit) = self.impact_with(&other.geometry, &seen) else { continue };
            if first.is_none_or(|stop| hit.time < stop.hit.time) {
                let carried = Some(fixed.way.end.mul(&start.interpolate(&end, hit.time)));
                first = Some(Stop { hit: hit.turned(&fixed.way.end.mul(&other.from_center)), carried });
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
    fn impact_with(&self, geometry: &Shape, mover: &Mover<'_>) -> Option<Hit> {
        match geometry {
            Shape::Mesh(mesh) => self.mesh_impact(Surface::Mesh(mesh), mover),
            Shape::HeightField(field) => self.mesh_impact(Surface::Field(field), mover),
            Shape::Compound(compound) => {
                let mut first = None;
                compound.for_each_child(&mover.around(2.0 * self.settings.slop), |_, child, pose| {
                    let hit = self.impact_with(child, &mover.relative_to(&[*pose; 2]));
                    first = earlier(first, hit.map(|hit| hit.turned(pose)));
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
            Shape::HalfSpace(_) => {
                // All of it that is within reach: a block with its top at height zero.
                let around = mover.around(2.0 * self.settings.slop);
                let half = around.half_extents().max_element() + around.min.y.abs();
                let middle = Vec3::new(around.center().x, -half, around.center().z);
                let block = Cuboid::new(Vec3::splat(half)).ok()?;
                self.impact(&Support::Cuboid(block), &mover.relative_to(&[Pose::from_position(middle); 2]))
            }
            convex => Support::new(convex).and_then(|fixed| self.impact(&fixed, mover)),
        }
    }

    /// First impact with a triangle of a mesh, coming from its solid side; all in the mesh's frame.
    fn mesh_impact(&self, mesh: Surface<'_>, mover: &Mover<'_>) -> Option<Hit> {
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
    fn impact(&self, fixed: &Support<'_>, mover: &Mover<'_>) -> Option<Hit> {
        if mover.whole {
            match self.approach(fixed, (&mover.support, &mover.path)) {
                Approach::Overlap => {}
                Approach::Miss => return None,
                Approach::Touch(touch) => return Some(Hit::from_afar(touch)),
            }
        }
        let core = match self.approach(fixed, (&mover.core, &mover.core_path)) {
            Approach::Overlap => return self.impact_inside(fixed, mover),
            Approach::Miss => return None,
            Approach::Touch(touch) => touch,
        };
        if gap(fixed, &mover.support, &mover.path.start) <= self.settings.speculative_distance {
            return Some(Hit::of_contact(core));
        }
        match self.approach(fixed, (&mover.support, &mover.path)) {
            Approach::Touch(surface) if surface.time < core.time => Some(Hit::from_afar(surface)),
            _ => Some(Hit::from_afar(core)),
        }
    }

    /// The impact of what is left of a shape when violent steps have pushed its core in: its spine stays on this side, or at
    /// least its very middle.
    fn impact_inside(&self, fixed: &Support<'_>, mover: &Mover<'_>) -> Option<Hit> {
        if let Some((spine, path)) = mover.spine() {
            match self.approach(fixed, (&spine, &path)) {
                Approach::Overlap => {}
                Approach::Miss => return None,
                Approach::Touch(touch) => return Some(Hit::of_contact(touch)),
            }
        }
        let (middle, path) = mover.middle();
        let Approach::Touch(touch) = self.approach(fixed, (&middle, &path)) else { return None };
        let no_nearer = gap(fixed, &middle, &path.start) <= middle.radius();
        // Half the gap in each step is nothing in the end.
        let time = if no_nearer { 0.0 } else { touch.time };
        Some(Hit { time, ..Hit::of_contact(touch) })
    }

    fn approach(&self, fixed: &Support<'_>, (shape, path): (&Support<'_>, &Sweep)) -> Approach {
        approach(fixed, &Sweep::still(Pose::IDENTITY), shape, path, self.settings.slop)
    }
}

impl Hit {
    fn from_afar(Touch { time, normal }: Touch) -> Self {
        Self { time, normal, touches: false }
    }

    fn of_contact(touch: Touch) -> Self {
        Self { touches: true, ..Self::from_afar(touch) }
    }

    /// The same with its normal in the frame from which `pose` places the shape.
    fn turned(self, pose: &Pose) -> Self {
        Self { normal: pose.rotation.rotate(self.normal), ..self }
    }
}

/// The earlier of two hits, of which either may be missing.
fn earlier(a: Option<Hit>, b: Option<Hit>) -> Option<Hit> {
    match (a, b) {
        (Some(a), Some(b)) => Some(if b.time < a.time { b } else { a }),
        (a, b) => a.or(b),
    }
}

/// What of a way is left that goes into none of the obstacles with these normals: along the last, or along the edge of two.
fn along_all(way: Vec3, normals: &[Vec3]) -> Vec3 {
    let Some((last, before)) = normals.split_last() else { return way };
    let mut along = way - *last * min(way.dot(*last), 0.0);
    for normal in before {
        if along.dot(*normal) < 0.0 {
            let edge = last.cross(*normal);
            let squared = edge.length_squared();
            along = if squared > 1e-6 { edge * (along.dot(edge) / squared) } else { Vec3::ZERO };
        }
    }
    // Into a corner of three.
    if before.iter().any(|normal| along.dot(*normal) < -1e-5 * way.length()) { Vec3::ZERO } else { along }
}
