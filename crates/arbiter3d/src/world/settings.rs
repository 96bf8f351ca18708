//! Every constant of the step in one place.

use crate::error::{Error, finite_vec, in_range};
use crate::math::{Real, Vec3};
use crate::simd::SimdLevel;

/// Settings of a world. Lengths and speeds are for a world in metres and are multiplied by [`length_unit`].
///
/// ```
/// use arbiter3d::{World, WorldSettings, math::Vec3};
/// let settings = WorldSettings { gravity: Vec3::new(0.0, -1.62, 0.0), threads: 2, ..WorldSettings::default() };
/// let moon = World::new(settings)?;
/// # Ok::<(), arbiter3d::Error>(())
/// ```
///
/// [`length_unit`]: WorldSettings::length_unit
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorldSettings {
    /// Acceleration of every dynamic body, m/s² (not scaled by `length_unit`). Default (0, −9.81, 0).
    pub gravity: Vec3,
    /// Solver slices of a step, 1 to 64. Default 4.
    pub substeps: u32,
    /// How many of the world's units make a metre: 1000 for a world in millimetres. Default 1.
    pub length_unit: Real,
    /// Scale of overlap that does not matter: contacts at rest give at most 1.97 of it under any load (0 lifts that bound), and
    /// continuous collision stops bodies this far ahead of a surface. Default 0.005 m.
    pub slop: Real,
    /// Gap below which contacts are found ahead of touching. Default 0.02 m.
    pub speculative_distance: Real,
    /// Gap or tangential drift at which a cached contact breaks, and radius within which a new one replaces it.
    /// Default 0.02 m.
    pub contact_break_distance: Real,
    /// Stiffness of contacts, Hz; limited to 0.1875 of the substep rate. Default 45.
    pub contact_hertz: Real,
    /// Damping ratio of contacts. Default 3.
    pub contact_damping_ratio: Real,
    /// Speed limit at which overlapping bodies are pushed apart. Default 3 m/s.
    pub push_out_speed: Real,
    /// Approach speed below which nothing bounces. Default 1 m/s.
    pub restitution_threshold: Real,
    /// Approach speed from which on a contact is a hit: see [`HitEvent`](crate::HitEvent). Default 1 m/s.
    pub hit_speed_threshold: Real,
    /// Speed limit of bodies. Default 1000 m/s. Spin is limited to 1.5 radians a substep: 360 rad/s at 60 Hz with four.
    pub max_linear_speed: Real,
    /// Whether resting islands may fall asleep. Default true.
    pub allow_sleep: bool,
    /// How long an island rests before it sleeps, seconds. Default 0.5.
    pub time_to_sleep: Real,
    /// Speed below which a body rests. Default 0.05 m/s.
    pub sleep_speed: Real,
    /// Whether fast dynamic bodies are stopped at static shapes they would pass through. Default true.
    pub continuous: bool,
    /// Threads that step the world, 1 to 64; results do not depend on it. Default 1.
    pub threads: usize,
    /// Instruction set to use; `None` takes the best this machine has. Results do not depend on it. Default `None`.
    pub simd: Option<SimdLevel>,
}

impl Default for WorldSettings {
    fn default() -> Self {
        Self {
            gravity: Vec3::new(0.0, -9.81, 0.0),
            substeps: 4,
            length_unit: 1.0,
            slop: 0.005,
            speculative_distance: 0.02,
            contact_break_distance: 0.02,
            contact_hertz: 45.0,
            contact_damping_ratio: 3.0,
            push_out_speed: 3.0,
            restitution_threshold: 1.0,
            hit_speed_threshold: 1.0,
            max_linear_speed: 1000.0,
            allow_sleep: true,
            time_to_sleep: 0.5,
            sleep_speed: 0.05,
            continuous: true,
            threads: 1,
            simd: None,
        }
    }
}

impl WorldSettings {
    /// Checks every field.
    ///
    /// # Errors
    /// Names the first field that is not finite or out of its range, or an instruction set that this machine lacks.
    pub fn validate(&self) -> Result<(), Error> {
        finite_vec("gravity", self.gravity)?;
        in_range("substeps", self.substeps as Real, 1.0, 64.0)?;
        in_range("length_unit", self.length_unit, 1e-6, 1e6)?;
        in_range("slop", self.slop, 0.0, 1e3)?;
        in_range("speculative_distance", self.speculative_distance, 0.0, 1e3)?;
        in_range("contact_break_distance", self.contact_break_distance, 1e-9, 1e3)?;
        in_range("contact_hertz", self.contact_hertz, 0.0, 1e6)?;
        in_range("contact_damping_ratio", self.contact_damping_ratio, 0.0, 1e6)?;
        in_range("push_out_speed", self.push_out_speed, 0.0, 1e6)?;
        in_range("restitution_threshold", self.restitution_threshold, 0.0, 1e6)?;
        in_range("hit_speed_threshold", self.hit_speed_threshold, 0.0, 1e9)?;
        in_range("max_linear_speed", self.max_linear_speed, 1e-6, 1e9)?;
        in_range("time_to_sleep", self.time_to_sleep, 0.0, 1e9)?;
        in_range("sleep_speed", self.sleep_speed, 0.0, 1e9)?;
        in_range("threads", self.threads as Real, 1.0, 64.0)?;
        match self.simd {
            Some(level) if !level.is_available() => Err(Error::SimdUnavailable { level }),
            _ => Ok(()),
        }
    }

    /// A copy whose lengths are in the world's units.
    pub(crate) fn scaled(&self) -> Self {
        let unit = self.length_unit;
        Self {
            slop: self.slop * unit,
            speculative_distance: self.speculative_distance * unit,
            contact_break_distance: self.contact_break_distance * unit,
            push_out_speed: self.push_out_speed * unit,
            restitution_threshold: self.restitution_threshold * unit,
            hit_speed_threshold: self.hit_speed_threshold * unit,
            max_linear_speed: self.max_linear_speed * unit,
            sleep_speed: self.sleep_speed * unit,
            ..*self
        }
    }
}
