//! Numbers taken from a world after a step, and their sums over a run.

use arbiter3d::{BodyId, BodyKind, World};
use serde::{Serialize, Serializer};
use std::time::Instant;

/// Milliseconds of a phase, in the order in which the phases run.
#[derive(Clone, Debug, Default)]
pub(crate) struct PhaseTimes(pub Vec<(&'static str, f64)>);

impl PhaseTimes {
    fn add(&mut self, world: &World) {
        let phases = world.timings().iter().map(|(phase, milliseconds)| (phase.name(), milliseconds));
        if self.0.is_empty() {
            self.0.extend(phases);
        } else {
            self.0.iter_mut().zip(phases).for_each(|(sum, (_, milliseconds))| sum.1 += milliseconds);
        }
    }

    /// The same divided by a number of steps.
    fn per_step(&self, steps: usize) -> Self {
        Self(self.0.iter().map(|&(name, sum)| (name, sum / steps.max(1) as f64)).collect())
    }

    /// Those of the last step alone.
    pub fn last(world: &World) -> Self {
        let mut times = Self::default();
        times.add(world);
        times
    }
}

impl Serialize for PhaseTimes {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().copied())
    }
}

/// Wall-clock times of the steps of a run.
#[derive(Clone, Debug, Default)]
pub(crate) struct Clock {
    milliseconds: Vec<f64>,
    phases: PhaseTimes,
}

/// Mean, median and extremes of the times of a run's steps, milliseconds.
#[derive(Clone, Debug, Default, Serialize)]
pub(crate) struct StepTimes {
    pub mean: f64,
    pub median: f64,
    pub min: f64,
    pub max: f64,
}

impl Clock {
    /// Times one step and gives its milliseconds with its result.
    pub fn time<T>(&mut self, step: impl FnOnce() -> T) -> (T, f64) {
        let start = Instant::now();
        let result = step();
        let milliseconds = start.elapsed().as_secs_f64() * 1e3;
        self.milliseconds.push(milliseconds);
        (result, milliseconds)
    }

    /// Adds the phases of the world's last step.
    pub fn add_phases(&mut self, world: &World) {
        self.phases.add(world);
    }

    pub fn phases_per_step(&self) -> PhaseTimes {
        self.phases.per_step(self.milliseconds.len())
    }

    /// Over all steps but the first `skipped`.
    pub fn step_times(&self, skipped: usize) -> StepTimes {
        let mut sorted = self.milliseconds[skipped.min(self.milliseconds.len())..].to_vec();
        sorted.sort_unstable_by(f64::total_cmp);
        let (Some(&min), Some(&max)) = (sorted.first(), sorted.last()) else { return StepTimes::default() };
        StepTimes {
            mean: sorted.iter().sum::<f64>() / sorted.len() as f64,
            median: median_of_sorted(&sorted),
            min,
            max,
        }
    }
}

/// The middle of sorted numbers, or the mean of the two middle ones; 0 for none.
pub(crate) fn median_of_sorted(sorted: &[f64]) -> f64 {
    match sorted.len() {
        0 => 0.0,
        n if n % 2 == 1 => sorted[n / 2],
        n => 0.5 * (sorted[n / 2 - 1] + sorted[n / 2]),
    }
}

/// What a world is like at one moment.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct State {
    /// All bodies but the world's own.
    pub bodies: usize,
    pub dynamic: usize,
    pub awake: usize,
    pub asleep: usize,
    pub arbiters: usize,
    pub contacts: usize,
    pub deepest_penetration: f32,
    pub kinetic_energy: f64,
    pub potential_energy: f64,
    /// Of the dynamic bodies' centres of mass; 0 where there are none.
    pub mean_height: f64,
    pub min_height: f64,
    pub max_height: f64,
    #[serde(serialize_with = "hexadecimal")]
    pub state_hash: u64,
}

fn hexadecimal<S: Serializer>(hash: &u64, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(&format_args!("{hash:016x}"))
}

impl State {
    pub fn of(world: &World) -> Self {
        let heights = Heights::of(world);
        Self {
            bodies: world.bodies().filter(|&id| id != BodyId::WORLD).count(),
            dynamic: heights.count,
            awake: world.awake_count(),
            asleep: world.sleeping_count(),
            arbiters: world.arbiter_count(),
            contacts: world.contact_count(),
            deepest_penetration: world.deepest_penetration(),
            kinetic_energy: world.kinetic_energy(),
            potential_energy: world.potential_energy(),
            mean_height: heights.mean(),
            min_height: heights.min,
            max_height: heights.max,
            state_hash: world.hash(),
        }
    }
}

#[derive(Default)]
struct Heights {
    count: usize,
    sum: f64,
    min: f64,
    max: f64,
}

impl Heights {
    fn of(world: &World) -> Self {
        let dynamic = world.bodies().filter_map(|id| world.body(id)).filter(|body| body.kind() == BodyKind::Dynamic);
        dynamic.fold(Self::default(), |mut heights, body| {
            let y = f64::from(body.center_of_mass().y);
            let first = heights.count == 0;
            heights.min = if first { y } else { heights.min.min(y) };
            heights.max = if first { y } else { heights.max.max(y) };
            heights.sum += y;
            heights.count += 1;
            heights
        })
    }

    fn mean(&self) -> f64 {
        if self.count == 0 { 0.0 } else { self.sum / self.count as f64 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_is_the_middle() {
        assert_eq!(median_of_sorted(&[1.0, 2.0, 9.0]), 2.0);
        assert_eq!(median_of_sorted(&[1.0, 2.0, 4.0, 9.0]), 3.0);
        assert_eq!(median_of_sorted(&[]), 0.0);
    }

    #[test]
    fn step_times_can_leave_out_the_first() {
        let clock = Clock { milliseconds: vec![100.0, 1.0, 3.0], phases: PhaseTimes::default() };
        let times = clock.step_times(1);
        assert_eq!((times.mean, times.min, times.max), (2.0, 1.0, 3.0));
    }

    #[test]
    fn heights_are_those_of_dynamic_bodies() {
        let built = arbiter3d_scenes::find("bounce").unwrap().build(&Default::default()).unwrap();
        let state = State::of(&built.world);
        assert_eq!((state.bodies, state.dynamic), (12, 11));
        assert!((state.mean_height - 5.5).abs() < 1e-6 && state.min_height == 5.5 && state.max_height == 5.5);
    }
}
