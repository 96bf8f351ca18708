//! One run: a fresh world of one engine, stepped for the scene's number of steps, only the step call timed.

use crate::engine::{Kind, build};
use crate::ruler::States;
use crate::scene::Scene;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Instant;

/// Steps before the end at which the depth of contacts is looked at too: where bodies tumble, that of one moment is chance.
const MOMENTS: [usize; 4] = [80, 60, 40, 20];
/// Scenes with more bodies are looked at only at the end.
const MOST_BODIES: usize = 50_000;

/// What one run gave.
#[derive(Debug, Default)]
pub struct Run {
    /// Milliseconds of each step but the first, which builds what later ones reuse.
    pub steps: Vec<f64>,
    /// Where the bodies ended.
    pub states: States,
    /// Where they were at [`MOMENTS`] before.
    pub earlier: Vec<States>,
    /// The engine's own count of contacts.
    pub contacts: Option<usize>,
    /// Bytes that the engine held at the end.
    pub bytes: Option<isize>,
    /// The most that it held after any step.
    pub peak_bytes: Option<isize>,
    /// Why it ended early, if it did.
    pub stopped: Option<String>,
    /// Whether it ended because its time was up.
    pub timed_out: bool,
}

impl Run {
    /// Mean of the timed steps, milliseconds.
    pub fn mean(&self) -> f64 {
        mean(&self.steps)
    }

    /// Mean of the slowest tenth of the timed steps, milliseconds.
    pub fn worst_tenth(&self) -> f64 {
        let mut sorted = self.steps.clone();
        sorted.sort_unstable_by(|a, b| b.total_cmp(a));
        sorted.truncate(sorted.len().div_ceil(10));
        mean(&sorted)
    }
}

/// Mean of some numbers; 0 of none.
pub fn mean(values: &[f64]) -> f64 {
    if values.is_empty() { 0.0 } else { values.iter().sum::<f64>() / values.len() as f64 }
}

/// Builds the scene on an engine and runs it, for at most `max_seconds` of stepping.
///
/// `note` hears the number of steps done.
pub fn run(kind: Kind, scene: &Scene, threads: usize, max_seconds: f64, note: &dyn Fn(usize)) -> Run {
    let attempt = catch_unwind(AssertUnwindSafe(|| try_run(kind, scene, threads, max_seconds, note)));
    let stopped = match attempt {
        Ok(Ok(run)) => return run,
        Ok(Err(reason)) => reason,
        Err(panic) => {
            let text = panic.downcast_ref::<String>().map(String::as_str).or(panic.downcast_ref::<&str>().copied());
            format!("panicked: {}", text.unwrap_or("no message"))
        }
    };
    Run { stopped: Some(stopped), ..Run::default() }
}

fn try_run(kind: Kind, scene: &Scene, threads: usize, max_seconds: f64, note: &dyn Fn(usize)) -> Result<Run, String> {
    let mut run = Run { steps: Vec::with_capacity(scene.steps), ..Run::default() };
    // Before bytes are counted.
    let bodies = scene.all_bodies().count();
    let room = if bodies <= MOST_BODIES { bodies } else { 0 };
    run.earlier.extend(MOMENTS.iter().map(|_| States::with_capacity(room)));
    let before = held_before(kind);
    let mut engine = build(kind, scene, threads)?;
    let mut script = scene.script.iter().peekable();
    let mut spent = 0.0;
    for step in 0..scene.steps {
        while let Some((_, change)) = script.next_if(|(at, _)| *at == step) {
            engine.apply(change)?;
        }
        let clock = Instant::now();
        let result = engine.step(scene.dt);
        let seconds = clock.elapsed().as_secs_f64();
        spent += seconds;
        if step > 0 {
            run.steps.push(1e3 * seconds);
        }
        run.bytes = engine.bytes().map(|bytes| bytes - before);
        run.peak_bytes = run.peak_bytes.max(run.bytes);
        if let Some(moment) = MOMENTS.iter().position(|ahead| step + 1 + ahead == scene.steps)
            && bodies <= MOST_BODIES
        {
            run.earlier[moment].extend((0..count(scene, script.len())).map(|body| engine.state(body)));
        }
        note(step + 1);
        if let Err(reason) = result {
            run.stopped = Some(format!("step {step}: {reason}"));
            break;
        }
        if spent > max_seconds && step + 1 < scene.steps {
            run.stopped = Some(format!("stopped after {} of {} steps, {max_seconds} s", step + 1, scene.steps));
            run.timed_out = true;
            break;
        }
    }
    run.contacts = engine.contacts();
    run.states = (0..count(scene, script.len())).map(|body| engine.state(body)).collect();
    run.earlier.retain(|states| !states.is_empty());
    Ok(run)
}

/// Bodies that there are while `left` changes of the script are still to come.
fn count(scene: &Scene, left: usize) -> usize {
    let done = &scene.script[..scene.script.len() - left];
    scene.bodies.len() + done.iter().filter(|(_, change)| matches!(change, crate::scene::Change::Spawn(_))).count()
}

/// What the engine's byte count says before its world exists.
fn held_before(kind: Kind) -> isize {
    match kind {
        // SAFETY: reads a counter.
        Kind::Box3d => unsafe { boxddd_sys::ffi::b3GetByteCount() as isize },
        _ => crate::memory::held(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_worst_tenth_is_the_mean_of_the_slowest() {
        let run = Run { steps: (1..=20).map(f64::from).collect(), ..Run::default() };
        assert_eq!((run.mean(), run.worst_tenth()), (10.5, 19.5));
        assert_eq!(Run::default().worst_tenth(), 0.0);
    }
}
