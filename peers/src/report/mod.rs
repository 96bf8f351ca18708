//! Rows of results, and what they come to: ratios to the fastest peer, geometric means, the worst scene.

pub mod json;
pub mod svg;
pub mod table;

use crate::catalog::Outcome;
use crate::engine::Kind;
use crate::ruler::{Quality, measure};
use crate::run::{Run, mean};
use crate::scene::Scene;
use crate::verdict::judge;
use std::collections::BTreeMap;

/// One engine on one scene with one number of threads.
#[derive(Clone, Debug)]
pub struct Row {
    /// The scene.
    pub scene: String,
    /// The engine.
    pub engine: Kind,
    /// Threads.
    pub threads: usize,
    /// Bodies at the start.
    pub bodies: usize,
    /// Steps of a run.
    pub steps: usize,
    /// Mean step of each repetition, milliseconds.
    pub means: Vec<f64>,
    /// Fastest time of each step over the repetitions, milliseconds.
    pub best_steps: Vec<f64>,
    /// Mean of the slowest tenth of the steps, milliseconds, in the repetition where it is least.
    pub worst_tenth: f64,
    /// The engine's own count of contacts at the end.
    pub contacts: Option<usize>,
    /// What the run has come to.
    pub quality: Quality,
    /// Bytes held at the end, and the most after any step.
    pub bytes: [Option<isize>; 2],
    /// Why the time does not count, if so.
    pub failure: Option<String>,
    /// Whether the run was stopped by the clock.
    pub timed_out: bool,
    /// Whether no more runs are wanted.
    pub is_done: bool,
}

/// Milliseconds of stepping below which a run is cheap.
const CHEAP: f64 = 100.0;
/// How often cheap runs are repeated at least.
const CHEAP_REPS: usize = 5;

impl Row {
    /// A row to which no run has been added.
    pub fn new(name: &str, engine: Kind, threads: usize, scene: &Scene) -> Self {
        Self {
            scene: name.into(),
            engine,
            threads,
            bodies: scene.bodies.len(),
            steps: scene.steps,
            means: Vec::new(),
            best_steps: Vec::new(),
            worst_tenth: 0.0,
            contacts: None,
            quality: Quality::default(),
            bytes: [None; 2],
            failure: None,
            timed_out: false,
            is_done: false,
        }
    }

    /// Adds a run. After `reps` of them, or one that was stopped, the row is done and its last run is measured. Runs of less
    /// than [`CHEAP`] are repeated at least [`CHEAP_REPS`] times: one interruption by another program would outweigh them.
    pub fn add(&mut self, run: Run, outcome: Outcome, scene: &Scene, reps: usize) {
        if !run.steps.is_empty() {
            self.means.push(run.mean());
            let worst = run.worst_tenth();
            if self.means.len() == 1 {
                (self.worst_tenth, self.best_steps) = (worst, run.steps.clone());
            } else {
                self.worst_tenth = self.worst_tenth.min(worst);
                self.best_steps.truncate(run.steps.len());
                self.best_steps.iter_mut().zip(&run.steps).for_each(|(best, step)| *best = best.min(*step));
            }
        }
        let is_cheap = run.steps.iter().sum::<f64>() < CHEAP;
        let wanted = if is_cheap { reps.max(CHEAP_REPS) } else { reps };
        self.is_done = run.stopped.is_some() || self.means.len() >= wanted;
        if !self.is_done {
            return;
        }
        (self.contacts, self.bytes, self.timed_out) = (run.contacts, [run.bytes, run.peak_bytes], run.timed_out);
        match measure(scene, &run.states, &run.earlier) {
            Ok(quality) => {
                self.quality = quality;
                self.failure = judge(outcome, scene, &run, &quality);
            }
            Err(error) => self.failure = Some(format!("cannot be measured: {error}")),
        }
    }

    /// Median of the repetitions, milliseconds a step.
    pub fn median(&self) -> f64 {
        let mut sorted = self.means.clone();
        sorted.sort_unstable_by(f64::total_cmp);
        match (sorted.len(), sorted.len() / 2) {
            (0, _) => 0.0,
            (count, half) if count % 2 == 0 => 0.5 * (sorted[half - 1] + sorted[half]),
            (_, half) => sorted[half],
        }
    }

    /// The fastest repetition, milliseconds a step.
    pub fn fastest(&self) -> f64 {
        self.means.iter().copied().reduce(f64::min).unwrap_or(0.0)
    }

    /// Mean over the steps of the fastest time that each has taken: what remains when other programs disturb at times.
    pub fn floor(&self) -> f64 {
        mean(&self.best_steps)
    }

    /// Whether the time may be compared.
    pub fn counts(&self) -> bool {
        self.failure.is_none() && self.median() > 0.0
    }
}

/// How many times as fast as the fastest peer we are, on one scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Ratio {
    /// The scene.
    pub scene: String,
    /// Threads of both.
    pub threads: usize,
    /// The fastest peer.
    pub peer: Kind,
    /// The peer's time over ours: above 1 where we are faster.
    pub ratio: f64,
}

/// The ratios of all scenes on which we and a peer have a time that counts.
pub fn ratios(rows: &[Row]) -> Vec<Ratio> {
    let ours = rows.iter().filter(|row| row.engine == Kind::Arbiter && row.counts());
    let ratio = |ours: &Row| {
        let same = |row: &&Row| row.scene == ours.scene && row.threads == ours.threads && row.engine != Kind::Arbiter;
        let peers = rows.iter().filter(same).filter(|row| row.counts());
        let fastest = peers.min_by(|a, b| a.median().total_cmp(&b.median()))?;
        let ratio = fastest.median() / ours.median();
        Some(Ratio { scene: ours.scene.clone(), threads: ours.threads, peer: fastest.engine, ratio })
    };
    ours.filter_map(ratio).collect()
}

/// Geometric mean of the ratios, by number of threads.
pub fn geometric_means(ratios: &[Ratio]) -> BTreeMap<usize, f64> {
    let mut logarithms: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
    for ratio in ratios {
        logarithms.entry(ratio.threads).or_default().push(ratio.ratio.ln());
    }
    logarithms.into_iter().map(|(threads, l)| (threads, (l.iter().sum::<f64>() / l.len() as f64).exp())).collect()
}

/// The scene on which we are slowest against the fastest peer.
pub fn worst(ratios: &[Ratio]) -> Option<&Ratio> {
    ratios.iter().min_by(|a, b| a.ratio.total_cmp(&b.ratio))
}

#[cfg(test)]
pub mod samples {
    use super::*;

    pub fn row(scene: &str, engine: Kind, threads: usize, means: &[f64]) -> Row {
        Row {
            scene: scene.into(),
            engine,
            threads,
            bodies: 10,
            steps: 100,
            means: means.to_vec(),
            best_steps: vec![0.5, 1.5],
            worst_tenth: 2.0,
            contacts: Some(40),
            quality: Quality::default(),
            bytes: [Some(1000), Some(2000)],
            failure: None,
            timed_out: false,
            is_done: false,
        }
    }

    /// We are twice as fast on `a`, half as fast on `b`; on `a` the peer that would be fastest has failed.
    pub fn rows() -> Vec<Row> {
        let mut failed = row("a", Kind::Jolt, 1, &[0.1]);
        failed.failure = Some("fell".into());
        vec![
            row("a", Kind::Arbiter, 1, &[1.0, 5.0, 0.9]),
            row("a", Kind::Box3d, 1, &[2.0]),
            row("a", Kind::Rapier, 1, &[3.0]),
            failed,
            row("b", Kind::Arbiter, 1, &[4.0]),
            row("b", Kind::Box3d, 1, &[8.0]),
            row("b", Kind::Rapier, 1, &[2.0]),
            row("b", Kind::Arbiter, 2, &[3.0]),
            row("b", Kind::Rapier, 2, &[2.0]),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ratios_are_to_the_fastest_peer_that_has_not_failed() {
        let ratios = ratios(&samples::rows());
        let seen: Vec<_> = ratios.iter().map(|r| (&r.scene[..], r.threads, r.peer, r.ratio)).collect();
        let expected = [("a", 1, Kind::Box3d, 2.0), ("b", 1, Kind::Rapier, 0.5), ("b", 2, Kind::Rapier, 2.0 / 3.0)];
        assert_eq!(seen, expected);
        let means = geometric_means(&ratios);
        assert!((means[&1] - 1.0).abs() < 1e-12 && (means[&2] - 2.0 / 3.0).abs() < 1e-12);
        let worst = worst(&ratios).unwrap();
        assert_eq!((&worst.scene[..], worst.threads), ("b", 1));
    }

    #[test]
    fn a_scene_that_we_fail_has_no_ratio() {
        let mut rows = samples::rows();
        rows[0].failure = Some("fell".into());
        assert!(ratios(&rows).iter().all(|ratio| ratio.scene != "a"));
        assert!(super::worst(&[]).is_none() && geometric_means(&[]).is_empty());
    }

    /// A step that was disturbed in one repetition counts as in the other.
    #[test]
    fn the_floor_takes_each_step_at_its_best() {
        let options = arbiter3d_scenes::SceneOptions { size: Some(2), ..Default::default() };
        let built = arbiter3d_scenes::find("large_pyramid").unwrap().build(&options).unwrap();
        let scene = Scene::read(built, 4).unwrap();
        let mut row = Row::new("large_pyramid", Kind::Box3d, 1, &scene);
        for steps in [[1.0, 9.0, 2.0], [5.0, 3.0, 1.0]] {
            row.add(Run { steps: steps.to_vec(), ..Run::default() }, Outcome::Moves, &scene, 2);
        }
        assert!(!row.is_done, "such cheap runs are repeated more often");
        assert_eq!(row.best_steps, [1.0, 3.0, 1.0]);
        assert_eq!((row.fastest(), row.median()), (3.0, 3.5));
    }

    #[test]
    fn the_median_of_two_is_their_mean() {
        let row = samples::row("a", Kind::Box3d, 1, &[3.0, 1.0]);
        assert_eq!((row.median(), row.fastest(), row.floor()), (2.0, 1.0, 1.0));
    }
}
