//! `arbiter3d bench`: milliseconds a step over scenes, thread counts and SIMD levels.
//!
//! Machines speed up and slow down for reasons of their own, so the combinations of a scene take turns: all of them once,
//! then all of them again. A run's figure is its mean time a step without step 0, which pays for set-up; reported are the
//! median and the minimum over the rounds. All combinations of a scene must end in the same state, to the bit.

use crate::args::{BenchOptions, SceneArguments, SimdChoice};
use crate::list::print_lines;
use crate::measure::{Clock, median_of_sorted};
use crate::problem::Problem;
use crate::report::Output;
use crate::source::{self, Machine};
use arbiter3d::SimdLevel;
use indicatif::ProgressBar;
use serde::Serialize;

/// One combination and what came out of it.
#[derive(Debug, Serialize)]
struct Measurement {
    scene: String,
    threads: usize,
    simd: String,
    steps: usize,
    rounds: usize,
    median_ms_per_step: f64,
    min_ms_per_step: f64,
    state_hash: String,
    #[serde(skip)]
    milliseconds: Vec<f64>,
}

pub(crate) fn bench(options: &BenchOptions) -> Result<(), Problem> {
    let mut json = options.json.as_deref().map(Output::create).transpose()?;
    let machines = combinations(options);
    let progress = ProgressBar::new((options.scenes.len() * machines.len() * options.rounds) as u64);
    let mut results: Vec<Measurement> = Vec::new();
    for scene in &options.scenes {
        results.extend(measure_scene(scene, options, &machines, &progress)?);
    }
    progress.finish_and_clear();
    print_lines(&table(&results))?;
    if let Some(mut json) = json.take() {
        json.json(&results)?;
        json.finish()?;
    }
    agreement(&results)
}

fn combinations(options: &BenchOptions) -> Vec<Machine> {
    let cores = std::thread::available_parallelism().map_or(1, |cores| cores.get().min(64));
    let mut threads = if options.threads.is_empty() { vec![1, cores] } else { options.threads.clone() };
    threads.dedup();
    let levels = |choice: &SimdChoice| match choice {
        SimdChoice::All => SimdLevel::available(),
        SimdChoice::One(level) => vec![*level],
    };
    let mut simd: Vec<SimdLevel> = options.simd.iter().flat_map(levels).collect();
    if simd.is_empty() {
        simd.push(SimdLevel::best());
    }
    simd.dedup();
    simd.iter().flat_map(|&level| threads.iter().map(move |&threads| Machine { threads, simd: Some(level) })).collect()
}

fn measure_scene(
    scene: &str,
    options: &BenchOptions,
    machines: &[Machine],
    progress: &ProgressBar,
) -> Result<Vec<Measurement>, Problem> {
    let mut results: Vec<Measurement> = Vec::new();
    for round in 0..options.rounds {
        for (index, &machine) in machines.iter().enumerate() {
            let run = run_once(scene, &options.build, machine)?;
            if round == 0 {
                results.push(run);
            } else {
                results[index].milliseconds.extend(run.milliseconds);
            }
            progress.inc(1);
        }
    }
    for result in &mut results {
        result.milliseconds.sort_unstable_by(f64::total_cmp);
        result.rounds = result.milliseconds.len();
        result.median_ms_per_step = median_of_sorted(&result.milliseconds);
        result.min_ms_per_step = result.milliseconds[0];
    }
    Ok(results)
}

fn run_once(scene: &str, build: &SceneArguments, machine: Machine) -> Result<Measurement, Problem> {
    let mut source = source::open(scene, build, machine)?;
    let mut clock = Clock::default();
    let (steps, dt) = (source.scene.steps, source.scene.dt());
    for step in 0..steps {
        let in_scene = |error| source::engine(scene, error);
        source.scene.prepare_step(step).map_err(in_scene)?;
        clock.time(|| source.scene.world.step(dt)).0.map_err(in_scene)?;
    }
    let skipped = usize::from(steps > 1);
    Ok(Measurement {
        scene: source.name,
        threads: machine.threads,
        simd: source.scene.world.simd_level().to_string(),
        steps,
        rounds: 1,
        median_ms_per_step: 0.0,
        min_ms_per_step: 0.0,
        state_hash: format!("{:016x}", source.scene.world.hash()),
        milliseconds: vec![clock.step_times(skipped).mean],
    })
}

fn table(results: &[Measurement]) -> Vec<String> {
    let width = results.iter().map(|result| result.scene.len()).max().unwrap_or(5).max(5);
    let heading = format!(
        "{:width$}  {:>7}  {:>8}  {:>6}  {:>12}  {:>12}  state hash",
        "scene", "threads", "simd", "steps", "median ms", "minimum ms"
    );
    let line = |r: &Measurement| {
        format!(
            "{:width$}  {:>7}  {:>8}  {:>6}  {:>12.3}  {:>12.3}  {}",
            r.scene, r.threads, r.simd, r.steps, r.median_ms_per_step, r.min_ms_per_step, r.state_hash
        )
    };
    std::iter::once(heading).chain(results.iter().map(line)).collect()
}

/// The state at the end must not depend on threads or instruction set.
fn agreement(results: &[Measurement]) -> Result<(), Problem> {
    let odd = results.iter().find_map(|result| {
        let first = results.iter().find(|first| first.scene == result.scene)?;
        (first.state_hash != result.state_hash).then_some((first, result))
    });
    let Some((first, other)) = odd else { return Ok(()) };
    let name = |m: &Measurement| format!("{} threads and {} give {}", m.threads, m.simd, m.state_hash);
    let message = format!("{}: {}, but {}: please report this", first.scene, name(first), name(other));
    Err(Problem::Disagreement { message })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn measurement(threads: usize, state_hash: &str) -> Measurement {
        let machine = Machine { threads, simd: None };
        let mut run = run_once("bounce", &SceneArguments { steps: Some(2), ..Default::default() }, machine).unwrap();
        run.state_hash = state_hash.into();
        run
    }

    #[test]
    fn a_state_that_depends_on_threads_is_reported() {
        assert!(agreement(&[measurement(1, "a"), measurement(2, "a")]).is_ok());
        let problem = agreement(&[measurement(1, "a"), measurement(2, "b")]).unwrap_err();
        assert_eq!(problem.exit_code(), 1);
        assert!(problem.line().contains("1 threads") && problem.line().contains("give b"));
    }
}
