//! Where a scene comes from: a name in the registry, or a file.

use crate::args::SceneArguments;
use crate::problem::Problem;
use crate::scene_file;
use arbiter3d::{Error, SimdLevel};
use arbiter3d_scenes::{BuiltScene, SceneOptions, find, nearest};
use std::path::Path;

/// A scene ready to run, with what to call it.
pub(crate) struct Source {
    /// The registry's name, or the file's name without its ending.
    pub name: String,
    pub scene: BuiltScene,
    /// What the user should know about the scene, a line each.
    pub notes: Vec<String>,
}

/// How the machine is to be used; the result does not depend on it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Machine {
    pub threads: usize,
    pub simd: Option<SimdLevel>,
}

/// Builds the scene of this name, or the one in the file of this name.
pub(crate) fn open(scene: &str, arguments: &SceneArguments, machine: Machine) -> Result<Source, Problem> {
    let options = SceneOptions {
        seed: arguments.seed,
        threads: machine.threads,
        simd: machine.simd,
        substeps: arguments.substeps,
        hz: arguments.hz,
        size: arguments.size,
    };
    let mut source = match find(scene) {
        Some(found) => {
            let built = found.build(&options).map_err(|error| engine(scene, error))?;
            Source { name: scene.to_owned(), scene: built, notes: Vec::new() }
        }
        None => open_file(scene, &options)?,
    };
    source.scene.steps = arguments.steps.unwrap_or(source.scene.steps);
    Ok(source)
}

pub(crate) fn engine(scene: &str, error: Error) -> Problem {
    Problem::Engine { scene: scene.to_owned(), error }
}

fn open_file(name: &str, options: &SceneOptions) -> Result<Source, Problem> {
    let path = Path::new(name);
    let meant_as_file = path.extension().is_some() || path.components().count() > 1 || path.exists();
    if !meant_as_file {
        return Err(unknown_scene(name));
    }
    if options.size.is_some() {
        return Err(Problem::Arguments { message: "--size scales built-in scenes only, not scene files".into() });
    }
    let loaded = scene_file::load(path, options)?;
    let stem = path.file_stem().map_or_else(|| "scene".into(), |stem| stem.to_string_lossy().into_owned());
    Ok(Source { name: stem, scene: loaded.scene, notes: loaded.notes })
}

fn unknown_scene(name: &str) -> Problem {
    let near = nearest(name);
    let hint = if near.is_empty() {
        "`arbiter3d list` shows all scenes".to_owned()
    } else {
        format!("did you mean {}?", near.join(" or "))
    };
    Problem::UnknownScene { name: name.to_owned(), hint }
}
