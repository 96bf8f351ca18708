//! Bullets: bodies that lose no time at an impact, and that meet whatever moves.
//!
//! After the solver has moved all bodies, each fast bullet has a way through the step, and so has everything else that has
//! moved. Of all meetings of a bullet with something else the earliest is taken; both bodies are put where they are at that time,
//! their arbiter begins, the impact is solved as an impulse ([`impact`](super::impact)), and both go on from there with their
//! new velocities for what is left of the step: two new ways, and the search goes on for those whom they concern. So a
//! bullet bounces between two walls as often as it should within one step. A body that is no bullet goes on in the same way
//! when a bullet has hit it, but is stopped at the first static shape, as fast bodies are.
//!
//! Meetings are dealt with one after the other, in the order of time and then of the bullets' places, so results do
//! not depend on the number of threads; the first search, which is most of the work, runs on all of them.
//!
//! A bullet that has touched a shape when the step began is held by its core only, as in ordinary continuous collision: it
//! rolls, slides and rests by its arbiters. In a new contact the narrow phase leaves a fast bullet alone
//! (`most_closing`).
//!
//! Source: the events of Mirtich, "Impulse-based Dynamic Simulation", 1996, chapter 2, within one step.

use super::impact::Outcome;
use super::mover::Mover;
use super::way::Way;
use super::{FastBody, ImpactSearch};
use crate::arbiter::{ArbiterKey, NONE};
use crate::broad_phase::{DynamicTree, TreeKind};
use crate::math::{Aabb, Pose, Real, max};
use crate::parallel::SharedSlice;
use crate::world::World;
use crate::world::definition::BodyKind;

/// Impacts of one body in a step at most: one that is jammed between two others stays where it is for the rest.
const MOST_IMPACTS: u32 = 64;
/// Meetings of a bullet in a step at most, those with shapes that it may pass and those of a kinematic one among them.
const MOST_MEETINGS: u32 = 256;

/// A body that flies through a step, or moves through it.
#[derive(Clone, Debug)]
pub(super) struct Track {
    pub body: u32,
    /// Whether its meetings are looked for, rather than those of bullets with it.
    bullet: bool,
    /// When its present way began: a share of the step. The way goes on to the end of it.
    time: Real,
    way: Way,
    impacts: u32,
    /// How often it has met something as a bullet.
    meetings: u32,
    /// Whether it has met something: it may stand somewhere on its way.
    met: bool,
    leaf: u32,
    next: Option<Meeting>,
    /// A shape that it passes in this step, since a filter or a listener wants that.
    pub passes: u32,
}

impl Track {
    /// Where it is at a time of the step.
    pub fn at(&self, time: Real) -> Pose {
        let left = 1.0 - self.time;
        if left > 0.0 { self.way.at((time - self.time) / left) } else { self.way.end }
    }

    /// Its way from a time of the step on.
    fn rest(&self, time: Real) -> Way {
        let left = 1.0 - self.time;
        if time <= self.time || left <= 0.0 {
            return self.way;
        }
        Way::new(self.at(time), self.way.end, self.way.turn * ((1.0 - time) / left))
    }
}

/// A bullet meets something.
#[derive(Clone, Copy, Debug)]
pub(super) struct Meeting {
    /// Share of the step.
    pub time: Real,
    /// The bullet's shape and the other one.
    pub slots: [u32; 2],
}

/// Buffers of the flight, kept from step to step.
#[derive(Debug, Default)]
pub(crate) struct FlightScratch {
    tracks: Vec<Track>,
    /// Places of bodies in the list; `NONE` in between.
    places: Vec<u32>,
    /// The boxes around all ways.
    tree: DynamicTree,
    found: Vec<Option<Meeting>>,
    /// Arbiters that impacts have made or met.
    pub(super) arbiters: Vec<crate::arbiter::ArbiterId>,
}

impl World {
    /// Lets fast bullets meet what is on their ways. `movers` are the other bodies that have moved.
    pub(crate) fn fly_bullets(&mut self, bullets: &[FastBody], movers: &[FastBody]) {
        if bullets.is_empty() {
            return;
        }
        let mut flight = std::mem::take(&mut self.flight);
        self.start_tracks(&mut flight, bullets, movers);
        self.find_first_meetings(&mut flight, bullets.len());
        // Each meeting counts for one of its bodies: an end is certain.
        while let Some((place, meeting)) = next_meeting(&flight.tracks) {
            self.meet(&mut flight, place, meeting);
        }
        self.end_tracks(&mut flight);
        self.flight = flight;
    }

    fn start_tracks(&self, flight: &mut FlightScratch, bullets: &[FastBody], movers: &[FastBody]) {
        flight.places.resize(self.bodies.len(), NONE);
        for (at, fast) in bullets.iter().chain(movers).enumerate() {
            let (end, turn) = (
                self.solver_bodies.masses[fast.index as usize].pose(),
                self.solver_bodies.states[fast.index as usize].turn,
            );
            self.add_track(flight, fast.index, Way::new(fast.start, end, turn));
            flight.tracks[at].bullet = at < bullets.len();
        }
    }

    fn add_track(&self, flight: &mut FlightScratch, body: u32, way: Way) {
        let place = flight.tracks.len() as u32;
        flight.places[body as usize] = place;
        let leaf = flight.tree.insert(self.box_of_way(body, &way), place);
        let track = Track {
            body,
            bullet: false,
            time: 0.0,
            way,
            impacts: 0,
            meetings: 0,
            met: false,
            leaf,
            next: None,
            passes: NONE,
        };
        crate::storage::push(&mut flight.tracks, track);
    }

    /// The box around all of a body's way.
    fn box_of_way(&self, body: u32, way: &Way) -> Aabb {
        let reach = self.bodies[body as usize].reach + self.scaled.speculative_distance;
        Aabb::from_points([way.start.position, way.end.position]).expand(reach)
    }

    /// The first meeting of each bullet, found on all threads.
    fn find_first_meetings(&mut self, flight: &mut FlightScratch, count: usize) {
        self.list_kinematic_shapes();
        flight.found.clear();
        crate::storage::reserve(&mut flight.found, count);
        flight.found.resize(count, None);
        let places = SharedSlice::new(&mut flight.found);
        let search = FlightSearch {
            impacts: ImpactSearch {
                shapes: &self.shapes,
                bodies: &self.bodies,
                solver: &self.solver_bodies,
                broad_phase: &self.broad_phase,
                settings: &self.scaled,
                filters: &self.filters,
                kinematic: &[],
            },
            arbiters: &self.arbiters,
            tracks: &flight.tracks,
            tree: &flight.tree,
            places: &flight.places,
        };
        self.pool.run_ranges(count, 1, |range| {
            for at in range {
                // SAFETY: each place belongs to one run.
                unsafe { *places.get_mut(at) = search.first_meeting(at, 0.0) };
            }
        });
        for (track, found) in flight.tracks.iter_mut().zip(&flight.found) {
            track.next = *found;
        }
    }

    /// Deals with the meeting of a bullet: the impact, then new ways.
    fn meet(&mut self, flight: &mut FlightScratch, place: usize, meeting: Meeting) {
        let other = self.shapes[meeting.slots[1] as usize].body;
        if flight.places[other as usize] == NONE && self.bodies[other as usize].kind != BodyKind::Static {
            self.add_track(flight, other, Way::still(self.solver_bodies.masses[other as usize].pose()));
        }
        let both = [place, flight.places[other as usize] as usize];
        let tracks = both.map(|at| flight.tracks.get(at).map(|track| track.at(meeting.time)));
        let bodies = [flight.tracks[place].body, other];
        for (body, pose) in bodies.into_iter().zip(tracks) {
            if let Some(pose) = pose {
                self.place_center(body, &pose);
            }
        }
        let outcome = self.solve_impact(&mut flight.arbiters, &meeting);
        let jammed = flight.tracks.get(both[1]).is_some_and(|track| track.impacts >= MOST_IMPACTS);
        let bullet = &mut flight.tracks[place];
        if outcome == Outcome::Passed || jammed {
            bullet.passes = meeting.slots[1];
        }
        bullet.meetings += 1;
        bullet.bullet &= bullet.meetings < MOST_MEETINGS;
        for (at, body) in both.into_iter().zip(bodies) {
            if at < flight.tracks.len() {
                self.go_on(flight, (at, body), meeting.time, outcome);
            }
        }
        self.look_again(flight, both, meeting.time);
    }

    /// Gives a body that has met something its way for the rest of the step.
    fn go_on(&mut self, flight: &mut FlightScratch, (at, body): (usize, u32), time: Real, outcome: Outcome) {
        let track = &mut flight.tracks[at];
        track.met = true;
        if !self.bodies[body as usize].alive || !self.bodies[body as usize].enabled {
            (track.bullet, track.next) = (false, None);
            return;
        }
        if outcome == Outcome::Passed || !self.bodies[body as usize].is_dynamic() {
            return;
        }
        let here = track.at(time);
        track.impacts += 1;
        let state = &self.solver_bodies.states[body as usize];
        let left = (1.0 - time) * self.dt;
        let (way, turn) = (state.linear_velocity * left, state.angular_velocity * left);
        let steps = max((turn.length() * 4.0).ceil(), 1.0);
        let each = turn / steps;
        let rotation = (0..(steps as usize).min(256)).fold(here.rotation, |rotation, _| rotation.integrate(each));
        let mut way = Way::new(here, Pose::new(here.position + way, rotation), turn);
        if track.impacts >= MOST_IMPACTS || outcome == Outcome::Stuck {
            track.bullet = false;
            way = Way::still(here);
        }
        (track.time, track.way) = (time, way);
        if !track.bullet {
            // What a bullet has hit must not be driven through a wall.
            let search = self.impact_search();
            let slots = &self.bodies[body as usize].shape_slots;
            if let Some(stop) = search.first_stop(slots, &way, search.kinematic) {
                let end = stop.carried.unwrap_or_else(|| way.at(stop.time));
                flight.tracks[at].way = Way::new(here, end, turn * stop.time);
            }
        }
        let aabb = self.box_of_way(body, &flight.tracks[at].way);
        flight.tree.move_leaf(flight.tracks[at].leaf, &aabb);
    }

    /// Finds the next meetings of all bullets that two bodies on new ways concern.
    fn look_again(&mut self, flight: &mut FlightScratch, both: [usize; 2], time: Real) {
        let boxes = both.map(|at| flight.tracks.get(at).map(|track| *flight.tree.aabb(track.leaf)));
        let bodies = both.map(|at| flight.tracks.get(at).map_or(NONE, |track| track.body));
        for place in 0..flight.tracks.len() {
            let track = &flight.tracks[place];
            if !track.bullet {
                flight.tracks[place].next = None;
                continue;
            }
            let meets = |meeting: Meeting| bodies.contains(&self.shapes[meeting.slots[1] as usize].body);
            let own = flight.tree.aabb(track.leaf);
            let concerned = both.contains(&place)
                || track.next.is_some_and(meets)
                || boxes.iter().flatten().any(|aabb| aabb.overlaps(own));
            if concerned {
                let search = FlightSearch {
                    impacts: self.impact_search(),
                    arbiters: &self.arbiters,
                    tracks: &flight.tracks,
                    tree: &flight.tree,
                    places: &flight.places,
                };
                flight.tracks[place].next = search.first_meeting(place, time);
            }
        }
    }

    /// Puts all bodies on the ends of their ways, and breaks the contacts of impacts that they have left behind.
    fn end_tracks(&mut self, flight: &mut FlightScratch) {
        for track in flight.tracks.drain(..) {
            flight.tree.remove(track.leaf);
            flight.places[track.body as usize] = NONE;
            if track.met && self.bodies[track.body as usize].alive {
                self.place_center(track.body, &track.way.end);
                self.stop_at(track.body, &track.way.end);
            }
        }
        for id in flight.arbiters.drain(..) {
            let Some(index) = self.arbiters.index_of(id) else { continue };
            let arbiter = self.arbiters.at_mut(index);
            let masses = &self.solver_bodies.masses;
            let [pose1, pose2] = [arbiter.body1, arbiter.body2].map(|body| masses[body.index as usize].pose());
            arbiter.data.break_contacts(&pose1, &pose2, self.scaled.contact_break_distance);
            let states = [arbiter.body1, arbiter.body2].map(|body| &self.solver_bodies.states[body.index as usize]);
            let velocity = states[1].linear_velocity - states[0].linear_velocity;
            // What leaves has parted, and what comes back already is to be met in the next step's flight.
            if arbiter.data.contacts().any(|(_, c)| c.normal.dot(velocity).abs() * self.dt > self.scaled.slop) {
                arbiter.data.clear();
            }
            if arbiter.data.usage_mask & 15 == 0 {
                crate::storage::push(&mut self.narrow.empty, index);
            }
        }
    }

    fn impact_search(&self) -> ImpactSearch<'_> {
        ImpactSearch {
            shapes: &self.shapes,
            bodies: &self.bodies,
            solver: &self.solver_bodies,
            broad_phase: &self.broad_phase,
            settings: &self.scaled,
            filters: &self.filters,
            kinematic: &self.kinematic_shapes,
        }
    }
}

/// The earliest meeting of all, and the bullet's place; of several at one time, that of the first bullet.
fn next_meeting(tracks: &[Track]) -> Option<(usize, Meeting)> {
    let mut first: Option<(usize, Meeting)> = None;
    for (place, track) in tracks.iter().enumerate() {
        if let Some(meeting) = track.next
            && first.is_none_or(|(_, earliest)| meeting.time < earliest.time)
        {
            first = Some((place, meeting));
        }
    }
    first
}

/// What a search for meetings reads.
struct FlightSearch<'a> {
    impacts: ImpactSearch<'a>,
    arbiters: &'a crate::arbiter::ArbiterStore,
    tracks: &'a [Track],
    tree: &'a DynamicTree,
    places: &'a [u32],
}

impl FlightSearch<'_> {
    /// The first meeting of a bullet from a time of the step on.
    fn first_meeting(&self, place: usize, from: Real) -> Option<Meeting> {
        let track = &self.tracks[place];
        let from = max(track.time, from);
        let body = &self.impacts.bodies[track.body as usize];
        if from >= 1.0 || !track.bullet {
            return None;
        }
        let way = track.rest(from);
        let mut first: Option<Meeting> = None;
        for &slot in &body.shape_slots {
            let shape = &self.impacts.shapes[slot as usize];
            for part in 0..way.parts {
                let [begin, end] =
                    [part, part + 1].map(|node| from + (1.0 - from) * (node as Real / way.parts as Real));
                if shape.sensor || first.is_some_and(|meeting| meeting.time <= begin) {
                    break;
                }
                let Some(mover) = Mover::new((shape, slot), &way.part(part), true) else { break };
                self.meet_in_part((track, &mover), [begin, end], &mut first);
            }
        }
        first
    }

    /// The first meeting of a bullet's shape between two times, if it is before the one found.
    fn meet_in_part(&self, (track, mover): (&Track, &Mover<'_>), times: [Real; 2], first: &mut Option<Meeting>) {
        let search = &self.impacts;
        let slop = search.settings.slop;
        let around = mover.as_whole().around(2.0 * slop);
        let dynamic = search.bodies[track.body as usize].is_dynamic();
        let mut consider = |slot: u32, frames: [Pose; 2]| {
            let other = &search.shapes[slot as usize];
            if slot == track.passes || !search.may_hit(mover, slot) {
                return;
            }
            let seen = mover.relative_to(&frames.map(|frame| frame.mul(&other.from_center)));
            if !other.geometry.local_aabb().overlaps(&seen.as_whole().around(2.0 * slop)) {
                return;
            }
            // What it touched when the step began has a contact.
            let touches = track.time == 0.0 && self.touch([mover.slot, slot]);
            let seen = if touches { seen } else { seen.as_whole() };
            if let Some(t) = search.impact_with(&other.geometry, &seen) {
                let time = times[0] + (times[1] - times[0]) * t;
                if time <= 1.0 && first.is_none_or(|meeting| time < meeting.time) {
                    *first = Some(Meeting { time, slots: [mover.slot, slot] });
                }
            }
        };
        if dynamic {
            search.broad_phase.query_static(&around, |slot| {
                let body = search.shapes[slot as usize].body as usize;
                if search.bodies[body].kind == BodyKind::Static {
                    consider(slot, [search.solver.masses[body].pose(); 2]);
                }
            });
        }
        let may_meet = |body: u32| body != track.body && (dynamic || search.bodies[body as usize].is_dynamic());
        self.tree.query(&around, |place| {
            let other = &self.tracks[place as usize];
            if may_meet(other.body) {
                let frames = times.map(|time| other.at(time));
                search.bodies[other.body as usize].shape_slots.iter().for_each(|&slot| consider(slot, frames));
            }
            true
        });
        // What has hardly moved stands where it is; its box is where it was at most a slop ago.
        search.broad_phase.tree(TreeKind::Moving).query(&around.expand(2.0 * slop), |slot| {
            let body = search.shapes[slot as usize].body;
            if self.places[body as usize] == NONE && may_meet(body) {
                consider(slot, [search.solver.masses[body as usize].pose(); 2]);
            }
            true
        });
    }

    /// Whether two shapes have an arbiter with contacts.
    fn touch(&self, slots: [u32; 2]) -> bool {
        let [a, b] = slots.map(|slot| self.impacts.shapes[slot as usize].id);
        let found = self.arbiters.find(ArbiterKey::of_shapes(a, b));
        found.is_some_and(|index| self.arbiters.at(index).data.usage_mask & 15 != 0)
    }
}
