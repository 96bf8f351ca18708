//! What can be typed after `arbiter3d`.

use arbiter3d::SimdLevel;
use clap::{Args, Parser, Subcommand};
use std::ffi::OsString;
use std::path::PathBuf;

const AFTER_HELP: &str = "\
Examples:
  arbiter3d                                  the colosseum stands, then breaks
  arbiter3d list                             all scenes, a line each
  arbiter3d run large_pyramid --threads 2    a built-in scene on two threads
  arbiter3d run my_scene.json --steps 1200   a scene file of your own
  arbiter3d bench large_pyramid --simd all   how fast is it here?

Without a command, `run` is meant. After a run, open the page it names in a browser to replay it in 3D.";

/// Simulates rigid bodies: runs scenes, replays them in a page, measures them.
#[derive(Debug, Parser)]
#[command(
    name = "arbiter3d",
    version,
    override_usage = "arbiter3d [COMMAND] [OPTIONS]",
    after_help = AFTER_HELP,
    disable_help_subcommand = true
)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Run a scene and report times, energies and the state's hash; writes a page that replays the run
    Run(RunOptions),
    /// List the built-in scenes
    List,
    /// Measure scenes over thread counts and SIMD levels, in alternating rounds
    Bench(BenchOptions),
}

/// Options that say how a scene is built.
#[derive(Args, Clone, Debug, Default)]
pub(crate) struct SceneArguments {
    /// How many steps to take [default: the scene's own]
    #[arg(long, value_name = "COUNT", allow_negative_numbers = true, value_parser = count)]
    pub steps: Option<usize>,
    /// Steps a second of simulated time [default: the scene's own, mostly 60]
    #[arg(long, value_name = "RATE", allow_negative_numbers = true, value_parser = rate)]
    pub hz: Option<f32>,
    /// Solver slices of a step, 1 to 64 [default: the scene's own, mostly 4]
    #[arg(long, value_name = "COUNT", allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..=64))]
    pub substeps: Option<u32>,
    /// Reshuffle what is random in the scene; 0 is the scene as published
    #[arg(long, value_name = "NUMBER", allow_negative_numbers = true, default_value_t = 0)]
    pub seed: u64,
    /// Scale of a built-in scene: rows, layers, bodies (see `list`) [default: the scene's own]
    #[arg(long, value_name = "NUMBER", allow_negative_numbers = true, value_parser = count)]
    pub size: Option<usize>,
}

#[derive(Args, Clone, Debug)]
pub(crate) struct RunOptions {
    /// Name of a built-in scene, or a scene file (JSON, see docs/scene-format.md)
    #[arg(value_name = "SCENE|FILE", default_value = "colosseum_break")]
    pub scene: String,
    #[command(flatten)]
    pub build: SceneArguments,
    /// Threads that step the world, 1 to 64; results do not depend on it
    #[arg(long, value_name = "COUNT", allow_negative_numbers = true, default_value_t = 1, value_parser = threads)]
    pub threads: usize,
    /// Instruction set: scalar, sse2, avx2, avx512, neon or simd128; results do not depend on it [default: the best here]
    #[arg(long, value_name = "LEVEL", value_parser = simd_level)]
    pub simd: Option<SimdLevel>,
    /// Write a row for each step
    #[arg(long, value_name = "FILE")]
    pub csv: Option<PathBuf>,
    /// Write the summary as a JSON object
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Where to write the page that replays the run [default: target/arbiter3d/<scene>.html]
    #[arg(long, value_name = "FILE")]
    pub html: Option<PathBuf>,
    /// Write no page
    #[arg(long, conflicts_with = "html")]
    pub no_html: bool,
}

#[derive(Args, Clone, Debug)]
pub(crate) struct BenchOptions {
    /// Scenes or scene files to measure
    #[arg(value_name = "SCENE|FILE", default_values_t = ["large_pyramid", "colosseum", "rotating_cube"].map(String::from))]
    pub scenes: Vec<String>,
    #[command(flatten)]
    pub build: SceneArguments,
    /// Thread counts, with commas [default: 1 and all cores]
    #[arg(long, value_name = "COUNTS", allow_negative_numbers = true, value_delimiter = ',', value_parser = threads)]
    pub threads: Vec<usize>,
    /// SIMD levels, with commas, or `all` for all that this machine has [default: the best here]
    #[arg(long, value_name = "LEVELS", value_delimiter = ',', value_parser = simd_choice)]
    pub simd: Vec<SimdChoice>,
    /// How often each combination is run, the others in between
    #[arg(long, value_name = "COUNT", allow_negative_numbers = true, default_value_t = 3, value_parser = count)]
    pub rounds: usize,
    /// Write the results as a JSON array
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
}

/// A SIMD level, or all of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum SimdChoice {
    All,
    One(SimdLevel),
}

/// Inserts `run` where no command is given, so that `arbiter3d` and `arbiter3d --steps 10` work.
pub(crate) fn with_default_command(arguments: impl IntoIterator<Item = OsString>) -> Vec<OsString> {
    let mut arguments: Vec<OsString> = arguments.into_iter().collect();
    let first = arguments.get(1).and_then(|argument| argument.to_str());
    let is_option = |argument: &str| argument.starts_with('-');
    let is_own = |argument: &str| ["-h", "--help", "-V", "--version"].contains(&argument);
    if first.is_none_or(|argument| is_option(argument) && !is_own(argument)) && !arguments.is_empty() {
        arguments.insert(1, "run".into());
    }
    arguments
}

/// A parser's complaint without its usage text.
pub(crate) fn one_line(error: &clap::Error) -> String {
    let text = error.render().to_string();
    let lines =
        text.lines().take_while(|line| !line.starts_with("Usage:") && !line.starts_with("For more information"));
    let joined = lines.map(str::trim).filter(|line| !line.is_empty()).collect::<Vec<_>>().join("; ");
    format!("{} (see arbiter3d --help)", joined.trim_start_matches("error: "))
}

fn count(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(number @ 1..=1_000_000_000) => Ok(number),
        _ => Err("give a whole number from 1 to 1000000000".into()),
    }
}

fn threads(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(number @ 1..=64) => Ok(number),
        _ => Err("give a whole number from 1 to 64".into()),
    }
}

fn rate(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(number) if (0.1..=1e6).contains(&number) => Ok(number),
        _ => Err("give a number from 0.1 to 1000000".into()),
    }
}

fn simd_level(text: &str) -> Result<SimdLevel, String> {
    let here = || SimdLevel::available().iter().map(ToString::to_string).collect::<Vec<_>>().join(", ");
    match text.parse::<SimdLevel>() {
        Ok(level) if level.is_available() => Ok(level),
        Ok(level) => Err(format!("this machine has no {level}; it has {}", here())),
        Err(_) => Err(format!("there is no such level; this machine has {}", here())),
    }
}

fn simd_choice(text: &str) -> Result<SimdChoice, String> {
    if text == "all" { Ok(SimdChoice::All) } else { simd_level(text).map(SimdChoice::One) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn completed(arguments: &[&str]) -> Vec<String> {
        let all = std::iter::once("arbiter3d").chain(arguments.iter().copied()).map(OsString::from);
        with_default_command(all).into_iter().skip(1).map(|a| a.into_string().unwrap()).collect()
    }

    #[test]
    fn run_is_meant_where_no_command_is_given() {
        assert_eq!(completed(&[]), ["run"]);
        assert_eq!(completed(&["--steps", "3"]), ["run", "--steps", "3"]);
        assert_eq!(completed(&["--help"]), ["--help"]);
        assert_eq!(completed(&["list"]), ["list"]);
    }

    #[test]
    fn the_command_line_is_sound() {
        use clap::CommandFactory;
        Arguments::command().debug_assert();
    }

    #[test]
    fn complaints_are_one_line_that_names_the_option() {
        for (arguments, part) in [
            (["run", "--steps", "0"], "--steps"),
            (["run", "--hz", "NaN"], "--hz"),
            (["run", "--substeps", "65"], "--substeps"),
            (["run", "--threads", "0"], "--threads"),
            (["run", "--simd", "mmx"], "scalar"),
            (["run", "--stepz", "4"], "--stepz"),
        ] {
            let all = std::iter::once("arbiter3d").chain(arguments);
            let line = one_line(&Arguments::try_parse_from(all).unwrap_err());
            assert!(line.contains(part) && !line.contains('\n'), "{line}");
        }
    }
}
