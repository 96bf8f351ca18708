//! Bullets: bodies that lose no time at an impact, and that meet whatever moves.
//!
//! After the solver has moved all bodies, each fast bullet has a way through the step, and so has everything else that has
//! moved. Of all meetings of a bullet with something else the earliest is taken; both bodies are put where they are at that time,
//! their arbiter begins, the impact is solved as an impulse ([`impact`](super::impact)), and both go on from there with their
//! new velocities for what is left of the step: two new ways, and the search goes on for those whom they concern. So a
//! bullet bounces between two walls as often as it should within one step. A body that is no bullet goes on in the same way
//! when a bullet has hit it, but is stopped at the first static shape, as fast bodies are.
//!
//! Meetings are dealt with one after the other, in the order of time and then of the bullets' places (a heap tells which is
//! next), so results do not depend on the number of threads. The searches run on all of them: the first one for all bullets,
//! and after each meeting those of the bullets that it concerns, which are found in a tree of the boxes around all ways.
//!
//! A bullet that has touched a shape when the step began is held by its core only, as in ordinary continuous collision: it
//! rolls, slides and rests by its arbiters. In a new contact the narrow phase leaves a fast bullet alone
//! (`most_closing`).
//!
//! Source: the events of Mirtich, "Impulse-based Dynamic Simulation", 1996, chapter 2, within one step.

use super::impact::Outcome;
use super::mover::Mover;
use super::piece::each_piece;
use super::way::Way;
use super::{FastBody, ImpactSearch};
use crate::arbiter::{ArbiterKey, NONE};
use crate::broad_phase::{DynamicTree, TreeKind};
use crate::math::{Aabb, Pose, Real, Vec3, max};
use crate::parallel::SharedSlice;
use crate::world::World;
use crate::world::definition::BodyKind;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// Impacts of one body in a step at most: one that is jammed between two others stays where it is for the rest.
const MOST_IMPACTS: u32 = 64;
/// Meetings of a bullet in a step at most, those with shapes that it may pass and those of a kinematic one among them.
const MOST_MEETINGS: u32 = 256;

/// Bodies turn by no more than this in a substep, radians.
pub(in crate::world) const MOST_TURN: Real = 1.5;
/// Searches from which on they are spread over threads.
const SEARCHES_FOR_THREADS: usize = 2;

/// A body that flies through a step, or moves through it.
#[derive(Clone, Debug)]
pub(super) struct Track {
    pub body: u32,
    /// Whether its meetings are looked for, rather than those of bullets with it.
    bullet: bool,
    /// When its present way began: a share of the step. The way goes on to the end of it. In double precision: at a million
    /// metres a second a step is longer than single precision has centimetres.
    time: f64,
    way: Way,
    impacts: u32,
    /// How often it has met something as a bullet.
    meetings: u32,
    /// Whether it has met something: it may stand somewhere on its way.
    met: bool,
    leaf: u32,
    next: Option<Meeting>,
    /// How often its next meeting has been changed: what the heap has of before is out of date.
    changes: u32,
    /// A shape that it passes in this step, since a filter or a listener wants that.
    pub passes: u32,
}

impl Track {
    /// Where it is at a time of the step.
    pub fn at(&self, time: f64) -> Pose {
        let left = 1.0 - self.time;
        if left > 0.0 { self.way.at(((time - self.time) / left) as Real) } else { self.way.last() }
    }

    /// What is left of a part of its way from a time of the step on: when it begins and ends, and where.
    fn part(&self, part: usize, from: f64) -> Option<([f64; 2], [Pose; 2])> {
        let [begin, end] = [part, part + 1].map(|node| {
            let share = node as f64 / self.way.parts as f64;
            self.time + (1.0 - self.time) * share
        });
        let [start, last] = self.way.part(part);
        if begin >= from {
            return Some(([begin, end], [start, last]));
        }
        (end > from).then(|| ([from, end], [self.at(from), last]))
    }
}

/// A bullet meets something.
#[derive(Clone, Copy, Debug)]
pub(super) struct Meeting {
    /// Share of the step.
    pub time: f64,
    /// The bullet's shape and the other one.
    pub slots: [u32; 2],
}

/// A meeting in the order in which they are dealt with.
#[derive(Clone, Copy, Debug)]
struct Due {
    meeting: Meeting,
    place: u32,
    changes: u32,
}

impl Ord for Due {
    /// The earliest is the greatest, and of several at one time that of the first bullet. Times are numbers.
    fn cmp(&self, other: &Self) -> Ordering {
        let times = other.meeting.time.partial_cmp(&self.meeting.time).unwrap_or(Ordering::Equal);
        times.then(other.place.cmp(&self.place)).then(self.changes.cmp(&other.changes))
    }
}

impl PartialOrd for Due {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Due {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Due {}

/// A search for the next meeting of a bullet.
#[derive(Clone, Copy, Debug)]
struct Search {
    place: u32,
    found: Option<Meeting>,
}

/// Buffers of the flight, kept from step to step.
#[derive(Debug, Default)]
pub(crate) struct FlightScratch {
    tracks: Vec<Track>,
    /// Places of bodies in the list; `NONE` in between.
    places: Vec<u32>,
    /// The boxes around all ways.
    tree: DynamicTree,
    /// The ways of the other bodies that have been stopped, by body.
    pub(super) held: Vec<(u32, Way)>,
    due: BinaryHeap<Due>,
    searches: Vec<Search>,
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
        while let Some(due) = flight.due.pop() {
            if flight.tracks[due.place as usize].changes == due.changes {
                self.meet(&mut flight, due.place as usize, due.meeting);
            }
        }
        self.end_tracks(&mut flight);
        self.flight = flight;
    }

    fn start_tracks(&self, flight: &mut FlightScratch, bullets: &[FastBody], movers: &[FastBody]) {
        flight.places.resize(self.bodies.len(), NONE);
        for (at, fast) in bullets.iter().chain(movers).enumerate() {
            let way = match flight.held.binary_search_by_key(&fast.index, |held| held.0) {
                Ok(held) => flight.held[held].1,
                Err(_) => {
                    let (mass, state) = (&self.solver_bodies.masses, &self.solver_bodies.states);
                    Way::new(fast.start, mass[fast.index as usize].pose(), state[fast.index as usize].turn)
                }
            };
            self.add_track(flight, fast.index, way);
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
            changes: 0,
            passes: NONE,
        };
        crate::storage::push(&mut flight.tracks, track);
    }

    /// The box around all of a body's way.
    fn box_of_way(&self, body: u32, way: &Way) -> Aabb {
        let reach = self.bodies[body as usize].reach + self.scaled.speculative_distance;
        Aabb::from_points([way.start.position, way.last().position]).expand(reach)
    }

    /// The first meeting of each bullet.
    fn find_first_meetings(&mut self, flight: &mut FlightScratch, count: usize) {
        self.list_kinematic_shapes();
        flight.searches.clear();
        crate::storage::reserve(&mut flight.searches, count);
        let search = |place| Search { place, found: None };
        flight.searches.extend((0..count as u32).map(search));
        self.search_all(flight, 0.0);
    }

    /// Does all searches of the list, from a time of the step on, on all threads.
    fn search_all(&mut self, flight: &mut FlightScratch, time: f64) {
        let FlightScratch { tracks, places, tree, searches, .. } = &mut *flight;
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
            tracks,
            tree,
            places,
        };
        if searches.len() < SEARCHES_FOR_THREADS {
            searches.iter_mut().for_each(|wanted| wanted.found = search.next_meeting(wanted.place, time));
        } else {
            let count = searches.len();
            let list = SharedSlice::new(searches);
            self.pool.run_ranges(count, 1, |range| {
                for at in range {
                    // SAFETY: each place belongs to one run.
                    let wanted = unsafe { list.get_mut(at) };
                    wanted.found = search.next_meeting(wanted.place, time);
                }
            });
        }
        for &Search { place, found, .. } in &flight.searches {
            let track = &mut flight.tracks[place as usize];
            let stands = match (track.next, found) {
                (Some(a), Some(b)) => a.time == b.time && a.slots == b.slots,
                (a, b) => a.is_none() && b.is_none(),
            };
            if !stands {
                track.next = found;
                track.changes += 1;
                if let Some(meeting) = found {
                    flight.due.push(Due { meeting, place, changes: track.changes });
                }
            }
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
        let before = both.map(|at| flight.tracks.get(at).map(|track| *flight.tree.aabb(track.leaf)));
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
        // The bullet's meeting is over.
        flight.tracks[place].next = None;
        flight.tracks[place].changes += 1;
        self.look_again(flight, (both, before), meeting.time);
    }

    /// Gives a body that has met something its way for the rest of the step.
    fn go_on(&mut self, flight: &mut FlightScratch, (at, body): (usize, u32), time: f64, outcome: Outcome) {
        let track = &mut flight.tracks[at];
        track.met = true;
        if !self.bodies[body as usize].alive || !self.bodies[body as usize].enabled {
            (track.bullet, track.next) = (false, None);
            track.changes += 1;
            return;
        }
        if outcome == Outcome::Passed || !self.bodies[body as usize].is_dynamic() {
            return;
        }
        let here = track.at(time);
        track.impacts += 1;
        let state = &self.solver_bodies.states[body as usize];
        let left = (1.0 - time) as Real * self.dt;
        // The next step limits both, and a way is cut into so many parts only.
        let (way, turn) = (
            shortened(state.linear_velocity, self.scaled.max_linear_speed) * left,
            shortened(state.angular_velocity, MOST_TURN * self.scaled.substeps as Real / self.dt) * left,
        );
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
                flight.tracks[at].way = stop.carried.map_or(way.stopped(stop.hit.time), Way::still);
            }
        }
        let aabb = self.box_of_way(body, &flight.tracks[at].way);
        flight.tree.move_leaf(flight.tracks[at].leaf, &aabb);
    }

    /// Finds the next meetings of all bullets that two bodies on new ways concern; `before` are the boxes around their old
    /// ones.
    fn look_again(&mut self, flight: &mut FlightScratch, (both, before): ([usize; 2], [Option<Aabb>; 2]), time: f64) {
        let mut searches = std::mem::take(&mut flight.searches);
        searches.clear();
        for (at, before) in both.into_iter().zip(before) {
            let Some(track) = flight.tracks.get(at) else { continue };
            let now = *flight.tree.aabb(track.leaf);
            let mut note = |place: u32| {
                if flight.tracks[place as usize].bullet || flight.tracks[place as usize].next.is_some() {
                    crate::storage::push(&mut searches, Search { place, found: None });
                }
                true
            };
            note(at as u32);
            flight.tree.query(&now, &mut note);
            before.iter().filter(|before| **before != now).for_each(|before| flight.tree.query(before, &mut note));
        }
        searches.sort_unstable_by_key(|search| search.place);
        searches.dedup_by_key(|search| search.place);
        flight.searches = searches;
        self.search_all(flight, time);
    }

    /// Puts all bodies on the ends of their ways, and breaks the contacts of impacts that they have left behind.
    fn end_tracks(&mut self, flight: &mut FlightScratch) {
        for track in flight.tracks.drain(..) {
            flight.tree.remove(track.leaf);
            flight.places[track.body as usize] = NONE;
            if track.met && self.bodies[track.body as usize].alive {
                let last = track.way.last();
                self.place_center(track.body, &last);
                self.stop_at(track.body, &last);
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

/// A vector no longer than `longest`.
fn shortened(vector: Vec3, longest: Real) -> Vec3 {
    let length = vector.length();
    if length > longest { vector * (longest / length) } else { vector }
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
    /// The next meeting of a bullet from a time of the step on.
    fn next_meeting(&self, place: u32, from: f64) -> Option<Meeting> {
        let track = &self.tracks[place as usize];
        let from = if from > track.time { from } else { track.time };
        let body = &self.impacts.bodies[track.body as usize];
        if from >= 1.0 || !track.bullet {
            return None;
        }
        let mut first: Option<Meeting> = None;
        for &slot in &body.shape_slots {
            let shape = &self.impacts.shapes[slot as usize];
            if shape.sensor {
                continue;
            }
            each_piece(shape, &mut |piece| {
                for (times, ends) in (0..track.way.parts).filter_map(|part| track.part(part, from)) {
                    if first.is_some_and(|meeting| meeting.time <= times[0]) {
                        break;
                    }
                    let mover = Mover::new((shape, slot), piece, &ends, true);
                    self.meet_in_part((track, &mover), times, &mut first);
                }
            });
        }
        first
    }

    /// The meeting of a bullet's shape with a shape whose body's frame goes from one pose to another between two times, if it
    /// is before the one found.
    fn meet_shape(
        &self,
        (track, mover): (&Track, &Mover<'_>),
        times: [f64; 2],
        (slot, frames): (u32, [Pose; 2]),
        first: &mut Option<Meeting>,
    ) {
        let search = &self.impacts;
        let other = &search.shapes[slot as usize];
        if slot == track.passes || !search.may_hit(mover, slot) {
            return;
        }
        let seen = mover.relative_to(&frames.map(|frame| frame.mul(&other.from_center)));
        if !other.geometry.local_aabb().overlaps(&seen.as_whole().around(2.0 * search.settings.slop)) {
            return;
        }
        // What it touched when the step began has a contact.
        let touches = track.time == 0.0 && self.touch([mover.slot, slot]);
        let seen = if touches { seen } else { seen.as_whole() };
        if let Some(hit) = search.impact_with(&other.geometry, &seen) {
            let time = times[0] + (times[1] - times[0]) * f64::from(hit.time);
            if time <= 1.0 && first.is_none_or(|meeting| time < meeting.time) {
                *first = Some(Meeting { time, slots: [mover.slot, slot] });
            }
        }
    }

    /// The meetings of a bullet's shape with the shapes of a body on a track.
    fn meet_track(&self, moving: (&Track, &Mover<'_>), times: [f64; 2], other: &Track, first: &mut Option<Meeting>) {
        let bodies = self.impacts.bodies;
        let dynamic = [moving.0.body, other.body].map(|body| bodies[body as usize].is_dynamic());
        if other.body != moving.0.body && (dynamic[0] || dynamic[1]) {
            let frames = times.map(|time| other.at(time));
            for &slot in &bodies[other.body as usize].shape_slots {
                self.meet_shape(moving, times, (slot, frames), first);
            }
        }
    }

    /// The first meeting of a bullet's shape between two times, if it is before the one found.
    fn meet_in_part(&self, moving: (&Track, &Mover<'_>), times: [f64; 2], first: &mut Option<Meeting>) {
        let (search, (track, mover)) = (&self.impacts, moving);
        let slop = search.settings.slop;
        let around = mover.as_whole().around(2.0 * slop);
        let dynamic = search.bodies[track.body as usize].is_dynamic();
        if dynamic {
            search.broad_phase.query_static(&around, |slot| {
                let body = search.shapes[slot as usize].body as usize;
                if search.bodies[body].kind == BodyKind::Static {
                    self.meet_shape(moving, times, (slot, [search.solver.masses[body].pose(); 2]), first);
                }
            });
        }
        self.tree.query(&around, |place| {
            self.meet_track(moving, times, &self.tracks[place as usize], first);
            true
        });
        // What has hardly moved stands where it is; its box is where it was at most a slop ago.
        search.broad_phase.tree(TreeKind::Moving).query(&around.expand(2.0 * slop), |slot| {
            let body = search.shapes[slot as usize].body;
            let may_meet = body != track.body && (dynamic || search.bodies[body as usize].is_dynamic());
            if self.places[body as usize] == NONE && may_meet {
                let frame = search.solver.masses[body as usize].pose();
                self.meet_shape(moving, times, (slot, [frame; 2]), first);
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
