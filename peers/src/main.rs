//! Times arbiter3d and its peers (Box3D, Rapier, Jolt) on the scenes of `arbiter3d-scenes`, side by side.
//!
//! A scene is read once into plain data ([`scene`]), each engine builds its world from that ([`engine`]), runs alternate
//! between engines ([`run`]), and what a run has come to is measured with the same code for all ([`ruler`]). A time counts
//! only if the run did what the scene asks ([`verdict`]).

mod args;
mod catalog;
mod engine;
mod memory;
mod queries;
mod report;
mod ruler;
mod run;
mod scene;
mod verdict;

use args::{Args, Command, Plan, Wrong, write};
use clap::Parser;
use indicatif::{ProgressBar, ProgressStyle};
use report::Row;
use scene::Scene;
use std::process::ExitCode;

#[global_allocator]
static ALLOCATOR: memory::Counting = memory::Counting;

fn main() -> ExitCode {
    let args = Args::parse();
    let result = match &args.command {
        Some(Command::Queries(queries)) => queries::compare(queries),
        None => compare(&args),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(wrong) => {
            eprintln!("error: {wrong}");
            ExitCode::from(2)
        }
    }
}

fn compare(args: &Args) -> Result<(), Wrong> {
    let plan = args.plan()?;
    let runs = plan.entries.len() * plan.engines.len() * plan.threads.len() * args.reps();
    let bar = ProgressBar::new(runs as u64);
    let style = ProgressStyle::with_template("{elapsed_precise} {bar:30} {pos}/{len} {msg}");
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    let mut rows = Vec::new();
    for entry in &plan.entries {
        rows.extend(time_scene(entry, args, &plan, &bar));
        // After each scene, so that a long run that is broken off has not been for nothing.
        save(args, &rows)?;
    }
    bar.finish_and_clear();
    print!("{}", report::table::table(&rows));
    Ok(())
}

fn save(args: &Args, rows: &[Row]) -> Result<(), Wrong> {
    if let Some(path) = &args.svg {
        write(path, Some(&report::svg::draw(rows)))?;
    }
    if let Some(path) = &args.json {
        write(path, Some(&format!("{:#}\n", report::json::value(rows))))?;
    }
    Ok(())
}

/// All rows of a scene, threads and engines alternating within each repetition.
fn time_scene(entry: &catalog::Entry, args: &Args, plan: &Plan, bar: &ProgressBar) -> Vec<Row> {
    bar.set_message(format!("{}: building", entry.name));
    let scene = match Scene::load(entry, args.steps) {
        Ok(scene) => scene,
        Err(error) => {
            bar.suspend(|| eprintln!("{}: {error}", entry.name));
            return Vec::new();
        }
    };
    let mut rows: Vec<Row> = Vec::new();
    for &kind in &plan.engines {
        if let Some(reason) = engine::unsupported(kind, &scene) {
            bar.suspend(|| eprintln!("{}: left out for {}: {reason}", entry.name, kind.name()));
            bar.inc((plan.threads.len() * args.reps()) as u64);
        } else {
            rows.extend(plan.threads.iter().map(|&threads| Row::new(entry.name, kind, threads, &scene)));
        }
    }
    rows.sort_by_key(|row| row.threads);
    while rows.iter().any(|row| !row.is_done) {
        for row in rows.iter_mut().filter(|row| !row.is_done) {
            let title = format!("{} {} {} thr", row.scene, row.engine.name(), row.threads);
            let note = |step: usize| {
                if step.is_multiple_of(10) {
                    bar.set_message(format!("{title} step {step}"));
                }
            };
            let run = run::run(row.engine, &scene, row.threads, args.max_seconds, &note);
            row.add(run, entry.outcome, &scene, args.reps());
            // Runs beyond those that were asked for are not on the bar.
            bar.inc(u64::from(row.means.len() <= args.reps()));
        }
    }
    rows
}
