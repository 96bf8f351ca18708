//! Everything that can be wrong with what a user gave, each as one line that says what and where.

use std::path::PathBuf;

/// Why the command stops.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Problem {
    /// An option or its value.
    #[error("{message}")]
    Arguments { message: String },
    /// Neither a scene's name nor a file.
    #[error("there is no scene {name:?} and no file of that name; {hint}")]
    UnknownScene { name: String, hint: String },
    /// A file that cannot be opened, read or written.
    #[error("cannot {action} {}: {reason}", path.display())]
    File { action: &'static str, path: PathBuf, reason: std::io::Error },
    /// A scene file that is not what the format asks for.
    #[error("{}: {place}{message}", path.display())]
    SceneFile { path: PathBuf, place: Place, message: String },
    /// A mesh file with a broken line; line 0 stands for the file as a whole.
    #[error("{}{}: {message}", path.display(), line_suffix(*line))]
    MeshFile { path: PathBuf, line: usize, message: String },
    /// The engine refuses a built-in scene or its options.
    #[error("{scene}: {error}")]
    Engine { scene: String, error: arbiter3d::Error },
    /// Two ways of computing the same scene differ.
    #[error("{message}")]
    Disagreement { message: String },
    /// The page cannot be recorded.
    #[error("cannot record the page: {0}")]
    Recording(#[from] crate::replay::RecordingError),
    /// Whoever reads standard output has gone: nothing to complain about.
    #[error("standard output was closed")]
    ClosedPipe,
}

/// The JSON path of a value, such as `bodies[3].position[1]`; empty for the file as a whole.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Place(pub String);

impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if self.0.is_empty() { Ok(()) } else { write!(f, "{}: ", self.0) }
    }
}

fn line_suffix(line: usize) -> String {
    if line == 0 { String::new() } else { format!(":{line}") }
}

impl Problem {
    /// The message without line breaks, whatever file names and values it quotes.
    pub fn line(&self) -> String {
        self.to_string().split_whitespace().collect::<Vec<_>>().join(" ")
    }

    /// 2 for what the user can mend, 1 for what we must.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Disagreement { .. } | Self::Recording(_) => 1,
            _ => 2,
        }
    }
}
