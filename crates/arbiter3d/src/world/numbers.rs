//! What there is in a world, in numbers: counts, energies, penetration, the state hash.

use super::World;
use super::bodies::Body;
use crate::math::{Real, Rotation, Vec3, max};

impl World {
    /// Bodies in the world, without its own.
    #[must_use]
    pub fn body_count(&self) -> usize {
        self.bodies.iter().filter(|body| body.alive).count() - 1
    }

    /// Dynamic bodies that are awake.
    #[must_use]
    pub fn awake_count(&self) -> usize {
        self.awake.iter().filter(|&&body| self.bodies[body as usize].is_dynamic()).count()
    }

    /// Dynamic bodies that are asleep.
    #[must_use]
    pub fn sleeping_count(&self) -> usize {
        self.dynamic_bodies().filter(|(_, body)| !body.awake).count()
    }

    /// Live arbiters, those of sleeping bodies included.
    #[must_use]
    pub fn arbiter_count(&self) -> usize {
        self.arbiters.len()
    }

    /// Contacts of all arbiters.
    #[must_use]
    pub fn contact_count(&self) -> usize {
        self.arbiters.iter().map(|arbiter| arbiter.data.contact_count()).sum()
    }

    /// Largest overlap of any contact, metres; zero or more.
    #[must_use]
    pub fn deepest_penetration(&self) -> Real {
        let contacts = self.arbiters.iter().flat_map(|arbiter| arbiter.data.contacts());
        contacts.fold(0.0, |deepest, (_, contact)| max(-contact.separation, deepest))
    }

    /// Energy of motion of the dynamic bodies, J.
    #[must_use]
    pub fn kinetic_energy(&self) -> f64 {
        self.dynamic_bodies()
            .map(|(index, body)| {
                let state = &self.solver_bodies.states[index];
                let spin = body.pose.rotation.inverse_rotate(state.angular_velocity);
                let turning = f64::from(spin.dot(body.mass.inertia.mul(spin)));
                0.5 * (f64::from(body.mass.mass) * f64::from(state.linear_velocity.length_squared()) + turning)
            })
            .sum()
    }

    /// Energy of height of the dynamic bodies against gravity, J; zero at the origin.
    #[must_use]
    pub fn potential_energy(&self) -> f64 {
        self.dynamic_bodies()
            .map(|(index, body)| {
                let height = -f64::from(self.settings.gravity.dot(self.solver_bodies.masses[index].center));
                f64::from(body.mass.mass) * f64::from(body.gravity_scale) * height
            })
            .sum()
    }

    /// Total linear momentum of the dynamic bodies, kg m/s.
    #[must_use]
    pub fn linear_momentum(&self) -> [f64; 3] {
        self.dynamic_bodies().fold([0.0; 3], |sum, (index, body)| {
            let velocity = self.solver_bodies.states[index].linear_velocity;
            std::array::from_fn(|axis| sum[axis] + f64::from(body.mass.mass) * f64::from(velocity[axis]))
        })
    }

    fn dynamic_bodies(&self) -> impl Iterator<Item = (usize, &Body)> {
        self.bodies.iter().enumerate().filter(|(_, body)| body.alive && body.enabled && body.is_dynamic())
    }

    /// A number that two worlds share exactly when (but for one chance in 2⁶⁴) all poses, velocities, rest times,
    /// contacts and impulses are the same bits.
    #[must_use]
    pub fn hash(&self) -> u64 {
        let mut hash = StateHash(0xcbf2_9ce4_8422_2325);
        for (index, body) in self.bodies.iter().enumerate().filter(|(_, body)| body.alive) {
            let state = &self.solver_bodies.states[index];
            hash.add(index as u64 | u64::from(body.awake) << 32 | u64::from(body.enabled) << 33);
            hash.vector(body.pose.position);
            hash.rotation(body.pose.rotation);
            hash.vector(state.linear_velocity);
            hash.vector(state.angular_velocity);
            hash.number(body.sleep_time);
        }
        let mut arbiters: Vec<_> = self.arbiters.iter().collect();
        arbiters.sort_unstable_by_key(|arbiter| arbiter.key);
        for arbiter in arbiters {
            hash.add(arbiter.key.key1);
            hash.add(arbiter.key.key2);
            hash.add(u64::from(arbiter.data.usage_mask));
            for (_, contact) in arbiter.data.contacts() {
                hash.vector(contact.local_anchor1);
                hash.vector(contact.normal);
                hash.number(contact.normal_impulse);
                hash.vector(contact.tangent_impulse);
            }
        }
        hash.0
    }
}

/// Mixes words one after the other: multiply, fold.
struct StateHash(u64);

impl StateHash {
    fn add(&mut self, word: u64) {
        let product = u128::from(self.0 ^ word).wrapping_mul(0x9E37_79B9_7F4A_7C15_F39C_C060_5CED_C835);
        self.0 = (product >> 64) as u64 ^ product as u64;
    }

    fn number(&mut self, x: Real) {
        self.add(u64::from(x.to_bits()));
    }

    fn vector(&mut self, v: Vec3) {
        self.add(u64::from(v.x.to_bits()) | u64::from(v.y.to_bits()) << 32);
        self.number(v.z);
    }

    fn rotation(&mut self, q: Rotation) {
        self.add(u64::from(q.x.to_bits()) | u64::from(q.y.to_bits()) << 32);
        self.add(u64::from(q.z.to_bits()) | u64::from(q.w.to_bits()) << 32);
    }
}
