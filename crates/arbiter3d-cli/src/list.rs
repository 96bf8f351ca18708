//! `arbiter3d list`: the built-in scenes.

use crate::problem::Problem;
use arbiter3d_scenes::{SCENES, Size};
use std::io::Write;

pub(crate) fn list() -> Result<(), Problem> {
    print_lines(&lines())
}

fn lines() -> Vec<String> {
    let width = SCENES.iter().map(|scene| scene.name.len()).max().unwrap_or(0);
    let size = |size: Size| match size.meaning {
        "" => String::new(),
        meaning => format!("  [--size: {meaning}, {}]", size.default),
    };
    SCENES.iter().map(|scene| format!("{:width$}  {}{}", scene.name, scene.description, size(scene.size))).collect()
}

/// Prints to standard output; a reader that has gone (`| head`) is no error.
pub(crate) fn print_lines(lines: &[String]) -> Result<(), Problem> {
    let mut out = std::io::stdout().lock();
    for line in lines {
        writeln!(out, "{line}").map_err(|_| Problem::ClosedPipe)?;
    }
    out.flush().map_err(|_| Problem::ClosedPipe)
}
