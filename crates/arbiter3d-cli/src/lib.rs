//! The parts of the `arbiter3d` command that can be used and tested on their own, and [`main_with`], which is the command.

pub mod replay;

mod args;
mod bench;
mod film;
mod list;
mod measure;
mod problem;
mod report;
mod run;
mod scene_file;
mod source;

use arbiter3d_scenes::{BuiltScene, SceneOptions};
use args::{Arguments, Command};
use clap::Parser;
use problem::Problem;
use std::ffi::OsString;
use std::path::Path;
use std::process::ExitCode;

/// Builds the world of a scene file (`docs/scene-format.md`), for tools and tests of one's own.
///
/// ```
/// use arbiter3d_cli::load_scene;
/// let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/hello.json");
/// let mut scene = load_scene(&path, &Default::default())?;
/// scene.step(0).map_err(|error| error.to_string())?;
/// # Ok::<(), String>(())
/// ```
///
/// # Errors
/// The line that the command would print: what is wrong, and where.
pub fn load_scene(path: &Path, options: &SceneOptions) -> Result<BuiltScene, String> {
    scene_file::load(path, options).map(|loaded| loaded.scene).map_err(|problem| problem.line())
}

/// Runs the command with these arguments, of which the first is the program's name.
///
/// Anything wrong with what the user gave ends with code 2 and one line on standard error.
///
/// ```
/// let code = arbiter3d_cli::main_with(["arbiter3d", "list"].map(Into::into));
/// assert_eq!(format!("{code:?}"), format!("{:?}", std::process::ExitCode::SUCCESS));
/// ```
pub fn main_with(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    let outcome = match Arguments::try_parse_from(args::with_default_command(arguments)) {
        Ok(arguments) => match arguments.command {
            Command::Run(options) => run::run(&options),
            Command::List => list::list(),
            Command::Bench(options) => bench::bench(&options),
        },
        // `--help` and `--version` arrive here as well, and go to standard output.
        Err(error) if !error.use_stderr() => return print_help(&error),
        Err(error) => Err(Problem::Arguments { message: args::one_line(&error) }),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(Problem::ClosedPipe) => ExitCode::SUCCESS,
        Err(problem) => {
            eprintln!("arbiter3d: {}", problem.line());
            ExitCode::from(problem.exit_code())
        }
    }
}

fn print_help(error: &clap::Error) -> ExitCode {
    if error.print().is_ok() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
