//! Sleeping and waking.
//!
//! A body rests while the speed of its fastest point stays below `sleep_speed`. When every body of an island has rested for
//! `time_to_sleep`, the island sleeps: its bodies leave the list of awake ones, and with them go the pairs and arbiters that
//! no awake body has. A sleeping body costs a step nothing.

use super::definition::BodyKind;
use super::{World, list_body};
use crate::arbiter::NONE;
use crate::math::Vec3;

impl World {
    /// Wakes a body with its whole island; a kinematic body wakes what touches it if it moves. Static bodies do not wake, but
    /// what touches them does.
    pub(crate) fn wake(&mut self, index: u32) {
        let body = &self.bodies[index as usize];
        if !body.enabled {
            return;
        }
        match body.kind {
            BodyKind::Static => {}
            BodyKind::Kinematic => {
                if !body.awake && self.is_moving(index) {
                    self.set_awake(index);
                    self.wake_neighbours(index);
                }
            }
            BodyKind::Dynamic => {
                if body.island == NONE {
                    self.set_awake(index);
                } else {
                    let mut bodies = std::mem::take(&mut self.wake_scratch);
                    self.sleeping.take(body.island, &mut bodies);
                    for &other in &bodies {
                        self.bodies[other as usize].island = NONE;
                        self.set_awake(other);
                    }
                    bodies.clear();
                    self.wake_scratch = bodies;
                }
                self.bodies[index as usize].sleep_time = 0.0;
            }
        }
    }

    fn is_moving(&self, index: u32) -> bool {
        let state = &self.solver_bodies.states[index as usize];
        state.linear_velocity != Vec3::ZERO || state.angular_velocity != Vec3::ZERO
    }

    /// Wakes the bodies that touch this one.
    pub(crate) fn wake_neighbours(&mut self, index: u32) {
        let neighbours: Vec<u32> = self
            .arbiters
            .of_body(index)
            .map(|arbiter| self.arbiters.at(arbiter))
            .map(|arbiter| if arbiter.body1.index == index { arbiter.body2.index } else { arbiter.body1.index })
            .collect();
        for neighbour in neighbours {
            self.wake(neighbour);
        }
    }

    /// Puts one body on the awake list with its pairs and arbiters.
    fn set_awake(&mut self, index: u32) {
        let place = self.awake.len() as u32;
        let body = &mut self.bodies[index as usize];
        body.sleep_time = 0.0;
        if body.awake {
            return;
        }
        body.awake = true;
        body.awake_place = place;
        self.awake_changed = true;
        self.awake.push(index);
        if self.bodies[index as usize].kind == BodyKind::Kinematic {
            list_body(&mut self.awake_kinematic, index, true);
        }
        let mut edges = std::mem::take(&mut self.index_scratch);
        edges.extend(self.pairs_of_body(index));
        for pair in edges.drain(..) {
            self.activate_pair(pair);
        }
        edges.extend(self.arbiters.of_body(index));
        for arbiter in edges.drain(..) {
            self.arbiters.set_awake(arbiter, true);
        }
        self.index_scratch = edges;
    }

    /// Takes one body off the awake list; pairs and arbiters without an awake body rest with it.
    pub(crate) fn set_asleep(&mut self, index: u32) {
        let body = &mut self.bodies[index as usize];
        if !body.awake {
            return;
        }
        body.awake = false;
        self.awake_changed = true;
        if body.kind == BodyKind::Kinematic {
            list_body(&mut self.awake_kinematic, index, false);
        }
        let state = &mut self.solver_bodies.states[index as usize];
        (state.translation, state.turn) = (Vec3::ZERO, Vec3::ZERO);
        let place = std::mem::replace(&mut self.bodies[index as usize].awake_place, NONE);
        self.awake.swap_remove(place as usize);
        if let Some(&moved) = self.awake.get(place as usize) {
            self.bodies[moved as usize].awake_place = place;
        }
        let mut edges = std::mem::take(&mut self.index_scratch);
        edges.extend(self.pairs_of_body(index));
        for pair in edges.drain(..) {
            if !self.pairs[pair as usize].bodies.iter().any(|&other| self.bodies[other as usize].awake) {
                self.deactivate_pair(pair);
            }
        }
        edges.extend(self.arbiters.of_body(index));
        for arbiter in edges.drain(..) {
            let arbiter = self.arbiters.at(arbiter);
            let (b1, b2, at) = (arbiter.body1.index, arbiter.body2.index, arbiter.id.index);
            if !self.bodies[b1 as usize].awake && !self.bodies[b2 as usize].awake {
                self.arbiters.set_awake(at, false);
            }
        }
        self.index_scratch = edges;
    }

    /// Puts to sleep the islands whose bodies have all rested long enough.
    pub(crate) fn sleep_islands(&mut self) {
        if !self.settings.allow_sleep || !self.scratch.any_rested {
            return;
        }
        let mut members = std::mem::take(&mut self.member_scratch);
        self.find_idle(&mut members);
        members.sort_unstable();
        for island in members.chunk_by(|a, b| a.0 == b.0) {
            if island.iter().all(|&(_, body)| !self.is_carried(body)) {
                self.sleep_island(island);
            }
        }
        members.clear();
        self.member_scratch = members;
    }

    /// Bodies of the islands all of whose bodies have rested long enough, each with the root of its island.
    ///
    /// The ties are those of the step's rows: what has ended since then ties for one step more, and what has begun since then
    /// has woken its bodies.
    fn find_idle(&mut self, members: &mut Vec<(u32, u32)>) {
        let (finder, bodies) = (&mut self.finder, &self.bodies);
        finder.reset(bodies.len(), self.awake.iter().copied());
        for ([a, b], both_move) in self.plan.ties() {
            if both_move || (bodies[a as usize].is_dynamic() && bodies[b as usize].is_dynamic()) {
                finder.join(a, b);
            }
        }
        for &body in &self.awake {
            if bodies[body as usize].sleep_time < self.settings.time_to_sleep {
                finder.keep_awake(body);
            }
        }
        crate::storage::reserve(members, self.awake.len());
        members.extend(self.awake.iter().filter_map(|&body| Some((finder.idle_root(body)?, body))));
    }

    /// Joins awake bodies along their contacts as they are now.
    fn join_islands(&mut self, finder: &mut crate::island::IslandFinder) {
        finder.reset(self.bodies.len(), self.awake.iter().copied());
        self.arbiters.awake_by_key(None);
        for entry in self.arbiters.order() {
            let arbiter = self.arbiters.at(entry.index);
            let (a, b) = (arbiter.body1.index, arbiter.body2.index);
            if self.bodies[a as usize].is_dynamic() && self.bodies[b as usize].is_dynamic() {
                finder.join(a, b);
            }
        }
    }

    /// Whether a moving kinematic body or a running belt touches this one: however slowly they move, it goes on.
    fn is_carried(&self, body: u32) -> bool {
        self.arbiters.of_body(body).any(|index| {
            let arbiter = self.arbiters.at(index);
            let other = if arbiter.body1.index == body { arbiter.body2.index } else { arbiter.body1.index };
            let runs = arbiter.data.tangent_velocity != Vec3::ZERO;
            runs || self.bodies[other as usize].kind == BodyKind::Kinematic && self.bodies[other as usize].awake
        })
    }

    fn sleep_island(&mut self, island: &[(u32, u32)]) {
        let mut bodies = std::mem::take(&mut self.wake_scratch);
        bodies.extend(island.iter().map(|&(_, body)| body).filter(|&body| self.bodies[body as usize].is_dynamic()));
        for &(_, body) in island {
            let state = &mut self.solver_bodies.states[body as usize];
            (state.linear_velocity, state.angular_velocity) = (Vec3::ZERO, Vec3::ZERO);
            self.set_asleep(body);
        }
        if !bodies.is_empty() {
            let number = self.sleeping.add(&bodies);
            for &body in &bodies {
                self.bodies[body as usize].island = number;
            }
        }
        bodies.clear();
        self.wake_scratch = bodies;
    }

    /// Puts the island of a body to sleep now, unless one of its bodies may not sleep.
    pub(crate) fn put_to_sleep(&mut self, index: u32) {
        if !self.bodies[index as usize].awake {
            return;
        }
        let mut finder = std::mem::take(&mut self.finder);
        self.join_islands(&mut finder);
        let root = finder.root(index);
        let mut island: Vec<(u32, u32)> =
            self.awake.iter().map(|&body| (finder.root(body), body)).filter(|&(r, _)| r == root).collect();
        island.sort_unstable();
        self.finder = finder;
        if island.iter().all(|&(_, body)| self.bodies[body as usize].can_sleep) {
            self.sleep_island(&island);
        }
    }

    /// Number of the island of each body, by slot: the smallest slot in it for awake dynamic bodies, the same for sleeping
    /// ones, `u32::MAX` for the others.
    #[must_use]
    pub fn islands(&self) -> Vec<u32> {
        let mut finder = crate::island::IslandFinder::default();
        finder.reset(self.bodies.len(), 0..self.bodies.len() as u32);
        for arbiter in self.arbiters.iter() {
            let (a, b) = (arbiter.body1.index, arbiter.body2.index);
            if self.bodies[a as usize].is_dynamic() && self.bodies[b as usize].is_dynamic() {
                finder.join(a, b);
            }
        }
        (0..self.bodies.len() as u32)
            .map(|body| {
                let b = &self.bodies[body as usize];
                if b.alive && b.enabled && b.is_dynamic() { finder.root(body) } else { NONE }
            })
            .collect()
    }
}
