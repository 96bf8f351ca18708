//! The `arbiter3d` command.

use std::process::ExitCode;

fn main() -> ExitCode {
    arbiter3d_cli::main_with(std::env::args_os())
}
