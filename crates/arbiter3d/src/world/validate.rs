//! Checks every invariant of a world: for debugging, tests and fuzzing.

use super::World;
use super::definition::BodyKind;
use crate::arbiter::NONE;

impl World {
    /// Checks that all records agree with each other and all numbers are finite. Slow: for tests.
    ///
    /// # Errors
    /// Says which invariant is broken; that is a bug in this crate.
    pub fn validate(&self) -> Result<(), String> {
        self.arbiters.validate()?;
        self.broad_phase.validate()?;
        self.validate_bodies()?;
        self.validate_pairs()?;
        for arbiter in self.arbiters.iter() {
            let awake = [arbiter.body1, arbiter.body2].iter().any(|body| self.bodies[body.index as usize].awake);
            if arbiter.awake != awake {
                return Err(format!("{:?}: awake {} but its bodies {awake}", arbiter.id, arbiter.awake));
            }
            for (slot, contact) in arbiter.data.contacts() {
                let finite = contact.normal.is_finite() && contact.local_anchor1.is_finite();
                if !finite || (contact.normal.length() - 1.0).abs() > 1e-2 || contact.normal_impulse < 0.0 {
                    return Err(format!("{:?}: bad contact in slot {slot}: {contact:?}", arbiter.id));
                }
            }
        }
        Ok(())
    }

    fn validate_bodies(&self) -> Result<(), String> {
        for (place, &index) in self.awake.iter().enumerate() {
            let body = &self.bodies[index as usize];
            if !body.alive || !body.awake || body.awake_place as usize != place || body.island != NONE {
                return Err(format!("body {index} at place {place} of the awake list: {body:?}"));
            }
        }
        let kinematic = |&index: &u32| self.bodies[index as usize].kind == BodyKind::Kinematic;
        let mut awake_kinematic: Vec<u32> = self.awake.iter().copied().filter(kinematic).collect();
        awake_kinematic.sort_unstable();
        if awake_kinematic != self.awake_kinematic {
            return Err(format!("awake kinematic bodies {awake_kinematic:?}, listed {:?}", self.awake_kinematic));
        }
        for (index, body) in self.bodies.iter().enumerate().filter(|(_, body)| body.alive) {
            let state = &self.solver_bodies.states[index];
            if !body.pose.is_finite() || !state.linear_velocity.is_finite() || !state.angular_velocity.is_finite() {
                return Err(format!("body {index} is not finite"));
            }
            if body.kind == BodyKind::Static && body.awake {
                return Err(format!("static body {index} is awake"));
            }
            if body.enabled && body.is_dynamic() && body.awake == (body.island != NONE) {
                return Err(format!("body {index}: awake {} and in island {}", body.awake, body.island));
            }
            if body.island != NONE && !self.sleeping.bodies(body.island).any(|other| other as usize == index) {
                return Err(format!("body {index} is missing from island {}", body.island));
            }
            for (id, slot) in body.shapes.iter().zip(&body.shape_slots) {
                let shape = &self.shapes[*slot as usize];
                if shape.id != *id || shape.body as usize != index {
                    return Err(format!("body {index}: slot {slot} holds another shape than {id:?}"));
                }
            }
        }
        Ok(())
    }

    fn validate_pairs(&self) -> Result<(), String> {
        let mut bearings = vec![0; self.bearings.counts().len()];
        for (index, pair) in self.pairs.iter().enumerate().filter(|(_, pair)| pair.alive) {
            let awake = pair.bodies.iter().any(|&body| self.bodies[body as usize].awake);
            if awake != pair.active {
                return Err(format!("pair {index}: active {} with awake bodies {awake}", pair.active));
            }
            if self.pair_set.get(pair.shapes[0], pair.shapes[1]) != Some(index as u32) {
                return Err(format!("pair {index} is missing from the set"));
            }
            if pair.arbiter != NONE {
                let arbiter = self.arbiters.at(pair.arbiter);
                if !arbiter.alive || arbiter.pair as usize != index {
                    return Err(format!("pair {index} and its arbiter {} do not know each other", pair.arbiter));
                }
            }
            let moves = pair.bodies.map(|body| self.solver_bodies.states[body as usize].moves != 0);
            let borne = (!pair.sensor && moves[0] != moves[1]).then(|| pair.bodies[usize::from(moves[1])]);
            if pair.borne() != borne {
                return Err(format!("pair {index}: body {:?} should be {borne:?}, the one that moves", pair.borne()));
            }
            borne.into_iter().for_each(|body| bearings[body as usize] += 1);
        }
        if bearings != self.bearings.counts() || !self.bearings.is_valid() {
            return Err(format!("pairs with what nothing can push: {:?}, not {bearings:?}", self.bearings));
        }
        Ok(())
    }
}
