//! The command line, checked: every mistake gives one line that says what would be right.

use crate::catalog::{Entry, entries};
use crate::engine::Kind;
use crate::queries::QueryArgs;
use clap::{Parser, Subcommand};
use std::path::PathBuf;

/// Times arbiter3d and other physics engines side by side on the same scenes.
#[derive(Debug, Parser)]
#[command(version)]
pub struct Args {
    /// Something other than steps
    #[command(subcommand)]
    pub command: Option<Command>,
    /// Smaller scenes and fewer steps: minutes instead of hours
    #[arg(long)]
    pub quick: bool,
    /// Only these scenes
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    pub scenes: Vec<String>,
    /// Which engines: arbiter3d, box3d, rapier, jolt (the last only if built with `--features jolt`)
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    pub engines: Vec<String>,
    /// Numbers of threads
    #[arg(long, value_delimiter = ',', default_value = "1,2", value_name = "NUMBERS")]
    pub threads: Vec<usize>,
    /// Runs of each, of which the median and the fastest are reported; 3 unless given, 1 with --quick
    #[arg(long, value_name = "NUMBER")]
    pub reps: Option<usize>,
    /// Size of every scene, instead of its own
    #[arg(long, value_name = "NUMBER")]
    pub size: Option<usize>,
    /// Steps of every scene, instead of its own
    #[arg(long, value_name = "NUMBER")]
    pub steps: Option<usize>,
    /// Stops a run after so many seconds of stepping
    #[arg(long, default_value_t = 120.0, value_name = "SECONDS")]
    pub max_seconds: f64,
    /// Writes the results to a file as JSON
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Draws the results into a file as SVG
    #[arg(long, value_name = "FILE")]
    pub svg: Option<PathBuf>,
}

/// What else this program times.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Rays and shape casts a second
    Queries(QueryArgs),
}

/// What is to be run.
#[derive(Debug)]
pub struct Plan {
    /// Scenes in the order of the catalogue.
    pub entries: Vec<Entry>,
    /// Engines in their usual order.
    pub engines: Vec<Kind>,
    /// Numbers of threads.
    pub threads: Vec<usize>,
}

/// What is wrong with the command line or the files it names.
#[derive(Debug, PartialEq, thiserror::Error)]
pub enum Wrong {
    /// No such scene.
    #[error("there is no scene {name:?}; there are: {known}")]
    Scene { name: String, known: String },
    /// No such engine.
    #[error("there is no engine {name:?}; there are: arbiter3d, box3d, rapier, jolt")]
    Engine { name: String },
    /// Not in this build.
    #[error(
        "this program was built without jolt; run it with `cargo run --release --features jolt` (needs cmake and clang)"
    )]
    NotBuiltIn,
    /// A number that makes no sense.
    #[error("{option} is {value}: it must be {wanted}")]
    Number { option: &'static str, value: String, wanted: &'static str },
    /// A scene does not come in this size.
    #[error("--size is {wanted}: {name} takes from 1 to {limit} {meaning}")]
    Size { name: &'static str, wanted: usize, limit: usize, meaning: &'static str },
    /// A file cannot be written.
    #[error("cannot write {path}: {reason}")]
    File { path: String, reason: String },
}

impl Args {
    /// Checks everything that can be checked before the first run, output files included.
    pub fn plan(&self) -> Result<Plan, Wrong> {
        let number = |option, value: String, wanted| Err(Wrong::Number { option, value, wanted });
        if self.reps == Some(0) {
            return number("--reps", "0".into(), "at least 1");
        }
        if self.steps.is_some_and(|steps| steps < 2) {
            return number(
                "--steps",
                self.steps.unwrap_or(0).to_string(),
                "at least 2, as the first step is not timed",
            );
        }
        if !(self.max_seconds > 0.0 && self.max_seconds.is_finite()) {
            return number("--max-seconds", self.max_seconds.to_string(), "a number above 0");
        }
        if let Some(&threads) = self.threads.iter().find(|threads| !(1..=64).contains(*threads)) {
            return number("--threads", threads.to_string(), "from 1 to 64");
        }
        let plan = Plan { entries: self.entries()?, engines: self.engines()?, threads: distinct(&self.threads) };
        for path in [&self.json, &self.svg].into_iter().flatten() {
            write(path, None)?;
        }
        Ok(plan)
    }

    /// Runs of each.
    pub fn reps(&self) -> usize {
        self.reps.unwrap_or(if self.quick { 1 } else { 3 })
    }

    fn entries(&self) -> Result<Vec<Entry>, Wrong> {
        let mut all = entries(self.quick);
        if self.size.is_some() {
            all.iter_mut().for_each(|entry| entry.size = self.size);
        }
        let known = || all.iter().map(|entry| entry.name).collect::<Vec<_>>().join(", ");
        if let Some(name) = self.scenes.iter().find(|name| all.iter().all(|entry| entry.name != **name)) {
            return Err(Wrong::Scene { name: name.clone(), known: known() });
        }
        let wanted = |entry: &Entry| self.scenes.is_empty() || self.scenes.iter().any(|name| name == entry.name);
        let entries: Vec<Entry> = all.into_iter().filter(wanted).collect();
        for entry in &entries {
            let size = arbiter3d_scenes::find(entry.name).map(|scene| scene.size);
            if let (Some(wanted), Some(size)) = (self.size, size)
                && !(1..=size.limit).contains(&wanted)
            {
                return Err(Wrong::Size { name: entry.name, wanted, limit: size.limit, meaning: size.meaning });
            }
        }
        Ok(entries)
    }

    fn engines(&self) -> Result<Vec<Kind>, Wrong> {
        if self.engines.is_empty() {
            return Ok(Kind::ALL.into_iter().filter(|kind| kind.is_built_in()).collect());
        }
        let find = |name: &String| Kind::find(name).ok_or_else(|| Wrong::Engine { name: name.clone() });
        let mut kinds = self.engines.iter().map(find).collect::<Result<Vec<_>, _>>()?;
        kinds.sort_unstable();
        kinds.dedup();
        if kinds.iter().all(|kind| kind.is_built_in()) { Ok(kinds) } else { Err(Wrong::NotBuiltIn) }
    }
}

fn distinct(numbers: &[usize]) -> Vec<usize> {
    let mut sorted = numbers.to_vec();
    sorted.sort_unstable();
    sorted.dedup();
    sorted
}

/// Writes a file; without text only tries whether it could, leaving an existing one as it is.
pub fn write(path: &PathBuf, text: Option<&str>) -> Result<(), Wrong> {
    let result = match text {
        Some(text) => std::fs::write(path, text),
        None => std::fs::OpenOptions::new().append(true).create(true).open(path).map(drop),
    };
    result.map_err(|error| Wrong::File { path: path.display().to_string(), reason: error.to_string() })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan(line: &str) -> Result<Plan, String> {
        let args = Args::try_parse_from(format!("peers {line}").split_whitespace()).map_err(|e| e.to_string())?;
        args.plan().map_err(|wrong| wrong.to_string())
    }

    #[test]
    fn the_default_is_everything_that_is_built_in() {
        let plan = plan("").unwrap();
        assert_eq!(plan.threads, [1, 2]);
        assert_eq!(plan.entries.len(), entries(false).len());
        assert_eq!(&plan.engines[..3], [Kind::Arbiter, Kind::Box3d, Kind::Rapier]);
    }

    #[test]
    fn wrong_input_gives_one_line_that_names_it() {
        let cases = [
            ("--scenes large_pyramid,nowhere", "nowhere"),
            ("--engines havok", "havok"),
            ("--reps 0", "--reps"),
            ("--scenes large_pyramid --size 5000", "1 to 1000 rows"),
            ("--steps 1", "--steps"),
            ("--threads 0", "--threads"),
            ("--max-seconds -1", "--max-seconds"),
            ("--json /nonexistent/directory/file.json", "/nonexistent/directory/file.json"),
        ];
        for (line, named) in cases {
            let line = line.replace("--max-seconds -1", "--max-seconds=-1");
            let message = plan(&line).unwrap_err();
            assert!(message.contains(named) && !message.contains('\n'), "{line}: {message}");
        }
    }

    #[test]
    fn names_come_in_the_usual_order_and_once() {
        let plan =
            plan("--quick --engines rapier,arbiter3d,rapier --scenes washer,large_pyramid --threads 2,1,2").unwrap();
        assert_eq!(plan.engines, [Kind::Arbiter, Kind::Rapier]);
        assert_eq!(plan.threads, [1, 2]);
        assert_eq!(plan.entries.iter().map(|entry| entry.name).collect::<Vec<_>>(), ["large_pyramid", "washer"]);
    }
}
