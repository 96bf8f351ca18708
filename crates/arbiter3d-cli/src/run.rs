//! `arbiter3d run`: steps a scene, shows how far it is, and reports.

use crate::args::RunOptions;
use crate::film::Film;
use crate::list::print_lines;
use crate::measure::{Clock, PhaseTimes, State};
use crate::problem::Problem;
use crate::report::{Csv, Output, Row, Summary};
use crate::source::{self, Machine, Source};
use indicatif::{ProgressBar, ProgressStyle};
use std::path::PathBuf;

pub(crate) fn run(options: &RunOptions) -> Result<(), Problem> {
    let machine = Machine { threads: options.threads, simd: options.simd };
    let mut source = source::open(&options.scene, &options.build, machine)?;
    for note in &source.notes {
        eprintln!("note: {note}");
    }
    let mut outputs = Outputs::open(options, &source)?;
    let progress = progress_bar(source.scene.steps);
    let mut clock = Clock::default();
    let mut frozen = 0;
    for step in 0..source.scene.steps {
        frozen += take_step(&mut source, step, &mut clock, &mut outputs)?;
        progress.inc(1);
    }
    progress.finish_and_clear();
    let summary = summarise(&source, options, &clock, frozen);
    let mut lines = summary.lines();
    lines.extend(outputs.finish(&summary)?);
    print_lines(&lines)
}

/// Takes one step, records it, and says how many bodies were frozen in it.
fn take_step(source: &mut Source, step: usize, clock: &mut Clock, outputs: &mut Outputs) -> Result<usize, Problem> {
    let scene = &mut source.scene;
    let in_scene = |error| source::engine(&source.name, error);
    scene.prepare_step(step).map_err(in_scene)?;
    let dt = scene.dt();
    let (report, milliseconds) = clock.time(|| scene.world.step(dt));
    let frozen = report.map_err(in_scene)?.frozen.len();
    clock.add_phases(&scene.world);
    if let Some(csv) = &mut outputs.csv {
        let (phases, state) = (PhaseTimes::last(&scene.world), State::of(&scene.world));
        let time = (step + 1) as f64 / f64::from(scene.hz);
        csv.row(&Row { step: step + 1, time, milliseconds, phases: &phases, state: &state })?;
    }
    if let Some(film) = &mut outputs.film {
        film.push(&scene.world, step + 1)?;
    }
    Ok(frozen)
}

fn summarise(source: &Source, options: &RunOptions, clock: &Clock, frozen: usize) -> Summary {
    let world = &source.scene.world;
    let times = clock.step_times(0);
    Summary {
        scene: source.name.clone(),
        steps: source.scene.steps,
        hz: source.scene.hz,
        substeps: world.settings().substeps,
        threads: options.threads,
        simd: world.simd_level().to_string(),
        seed: options.build.seed,
        ms_per_step: times.mean,
        step_times: times,
        phases: clock.phases_per_step(),
        state: State::of(world),
        frozen,
    }
}

fn progress_bar(steps: usize) -> ProgressBar {
    let style = ProgressStyle::with_template("{bar:40} {pos}/{len} steps  {per_sec}  {eta} left");
    let bar = ProgressBar::new(steps as u64);
    style.map_or(bar.clone(), |style| bar.with_style(style))
}

/// Files that a run fills as it goes.
struct Outputs {
    csv: Option<Csv>,
    json: Option<Output>,
    film: Option<Film>,
    notes: Vec<String>,
}

/// Past this many bodies a page would take minutes to write and more memory to show than a browser has.
const MOST_BODIES_IN_A_PAGE: usize = 200_000;

impl Outputs {
    fn open(options: &RunOptions, source: &Source) -> Result<Self, Problem> {
        let csv = options.csv.as_deref().map(Csv::create).transpose()?;
        let json = options.json.as_deref().map(Output::create).transpose()?;
        let mut outputs = Self { csv, json, film: None, notes: Vec::new() };
        let bodies = source.scene.world.bodies().count();
        if options.html.is_none() && !options.no_html && bodies > MOST_BODIES_IN_A_PAGE {
            outputs
                .notes
                .push(format!("{:<20} none: {bodies} bodies are many for a page; ask with --html FILE", "page"));
        } else if !options.no_html {
            let path = match &options.html {
                Some(path) => path.clone(),
                None => default_page(&source.name)?,
            };
            outputs.film = Some(Film::begin(path, &source.name, &source.scene)?);
        }
        Ok(outputs)
    }

    /// Writes what is left to write and gives lines that say where.
    fn finish(self, summary: &Summary) -> Result<Vec<String>, Problem> {
        let mut lines = self.notes;
        if let Some(csv) = self.csv {
            csv.finish()?;
        }
        if let Some(mut json) = self.json {
            json.json(summary)?;
            json.finish()?;
        }
        if let Some(film) = self.film {
            lines.push(format!("{:<20} {}", "page", film.finish()?));
        }
        Ok(lines)
    }
}

/// `target/arbiter3d/<scene>.html`, with its folder.
fn default_page(scene: &str) -> Result<PathBuf, Problem> {
    let folder = PathBuf::from("target/arbiter3d");
    std::fs::create_dir_all(&folder).map_err(|error| crate::report::cannot_write(&folder, error))?;
    Ok(folder.join(format!("{scene}.html")))
}
