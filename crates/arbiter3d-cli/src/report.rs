//! What a run leaves behind: a table, a JSON object, a CSV file.

use crate::measure::{PhaseTimes, State, StepTimes};
use crate::problem::Problem;
use serde::Serialize;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// The summary of a run; its fields are those of the JSON object.
#[derive(Debug, Serialize)]
pub(crate) struct Summary {
    pub scene: String,
    pub steps: usize,
    pub hz: f32,
    pub substeps: u32,
    pub threads: usize,
    pub simd: String,
    pub seed: u64,
    /// Mean over all steps, milliseconds.
    pub ms_per_step: f64,
    /// Median and extremes as well.
    pub step_times: StepTimes,
    /// Mean milliseconds a step of each phase.
    pub phases: PhaseTimes,
    #[serde(flatten)]
    pub state: State,
    /// How often a body went non-finite and was frozen.
    pub frozen: usize,
}

impl Summary {
    /// The table printed at the end, a line an entry.
    pub fn lines(&self) -> Vec<String> {
        let mut lines = Vec::new();
        let mut row = |name: &str, value: String| lines.push(format!("{name:<20} {value}"));
        let threads = if self.threads == 1 { "1 thread".into() } else { format!("{} threads", self.threads) };
        let state = &self.state;
        row("scene", self.scene.clone());
        row("steps", format!("{} at {} Hz, {} substeps, {threads}, {}", self.steps, self.hz, self.substeps, self.simd));
        let times = &self.step_times;
        let spread = format!("median {:.3}, min {:.3}, max {:.3}", times.median, times.min, times.max);
        row("time a step", format!("{:.3} ms ({spread})", self.ms_per_step));
        for &(name, milliseconds) in &self.phases.0 {
            let share = 100.0 * milliseconds / self.ms_per_step.max(1e-9);
            row(&format!("  {name}"), format!("{milliseconds:.3} ms  {share:.0} %"));
        }
        let fixed = state.bodies - state.dynamic;
        row("bodies", format!("{}: {} awake, {} asleep, {fixed} not dynamic", state.bodies, state.awake, state.asleep));
        row("arbiters", state.arbiters.to_string());
        row("contacts", state.contacts.to_string());
        row("deepest penetration", format!("{:.3} mm", 1e3 * state.deepest_penetration));
        row("kinetic energy", format!("{:.6e} J", state.kinetic_energy));
        row("potential energy", format!("{:.6e} J", state.potential_energy));
        let heights = format!("from {:.3} to {:.3}", state.min_height, state.max_height);
        row("mean height", format!("{:.4} m ({heights})", state.mean_height));
        row("state hash", format!("{:016x}", state.state_hash));
        if self.frozen > 0 {
            row("FROZEN", format!("{} bodies went non-finite and were stopped", self.frozen));
        }
        lines
    }
}

/// A file opened before the run, so that a bad path is found before an hour of work.
pub(crate) struct Output {
    path: PathBuf,
    writer: BufWriter<File>,
}

impl Output {
    pub fn create(path: &Path) -> Result<Self, Problem> {
        let file = File::create(path).map_err(|error| cannot_write(path, error))?;
        Ok(Self { path: path.to_owned(), writer: BufWriter::new(file) })
    }

    pub fn line(&mut self, text: &str) -> Result<(), Problem> {
        writeln!(self.writer, "{text}").map_err(|error| cannot_write(&self.path, error))
    }

    /// Writes a value as readable JSON.
    pub fn json(&mut self, value: &impl Serialize) -> Result<(), Problem> {
        let text = serde_json::to_string_pretty(value).map_err(|error| cannot_write(&self.path, error.into()))?;
        self.line(&text)
    }

    pub fn finish(mut self) -> Result<(), Problem> {
        self.writer.flush().map_err(|error| cannot_write(&self.path, error))
    }
}

pub(crate) fn cannot_write(path: &Path, reason: std::io::Error) -> Problem {
    Problem::File { action: "write", path: path.to_owned(), reason }
}

/// One row a step.
pub(crate) struct Csv {
    output: Output,
    has_heading: bool,
}

/// What a row of the CSV file holds.
pub(crate) struct Row<'a> {
    /// Steps taken, so 1 for the first row.
    pub step: usize,
    /// Simulated seconds.
    pub time: f64,
    pub milliseconds: f64,
    pub phases: &'a PhaseTimes,
    pub state: &'a State,
}

impl Csv {
    pub fn create(path: &Path) -> Result<Self, Problem> {
        Ok(Self { output: Output::create(path)?, has_heading: false })
    }

    pub fn row(&mut self, row: &Row) -> Result<(), Problem> {
        if !self.has_heading {
            self.has_heading = true;
            self.output.line(&heading(row.phases))?;
        }
        let state = row.state;
        let phases: String = row.phases.0.iter().map(|(_, milliseconds)| format!("{milliseconds:.6},")).collect();
        self.output.line(&format!(
            "{},{:.6},{:.6},{phases}{},{},{},{},{},{},{},{:016x}",
            row.step,
            row.time,
            row.milliseconds,
            state.awake,
            state.asleep,
            state.arbiters,
            state.contacts,
            state.deepest_penetration,
            state.kinetic_energy,
            state.potential_energy,
            state.state_hash
        ))
    }

    pub fn finish(self) -> Result<(), Problem> {
        self.output.finish()
    }
}

fn heading(phases: &PhaseTimes) -> String {
    let phases: String = phases.0.iter().map(|(name, _)| format!("{}_ms,", name.replace([' ', '-'], "_"))).collect();
    format!(
        "step,time,ms,{phases}awake,asleep,arbiters,contacts,deepest_penetration,kinetic_energy,potential_energy,state_hash"
    )
}
