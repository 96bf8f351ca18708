//! How long each phase of the last step took.

use std::fmt;

/// A phase of the step, in order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Phase {
    /// New and moved proxies, new pairs.
    BroadPhase,
    /// Manifolds, contact providers, new arbiters.
    NarrowPhase,
    /// Begin events.
    BeginEvents,
    /// Colouring.
    Coloring,
    /// Rows from arbiters.
    Prepare,
    /// Substeps and restitution.
    Solve,
    /// Impulses back to the arbiters.
    Store,
    /// Poses, boxes, continuous collision.
    Finalize,
    /// Broken contacts, end events.
    EndEvents,
    /// Islands and sleep.
    Sleep,
}

impl Phase {
    /// All phases, in order.
    pub const ALL: [Self; 10] = [
        Self::BroadPhase,
        Self::NarrowPhase,
        Self::BeginEvents,
        Self::Coloring,
        Self::Prepare,
        Self::Solve,
        Self::Store,
        Self::Finalize,
        Self::EndEvents,
        Self::Sleep,
    ];

    /// A short name, as in tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::BroadPhase => "broad phase",
            Self::NarrowPhase => "narrow phase",
            Self::BeginEvents => "begin events",
            Self::Coloring => "colouring",
            Self::Prepare => "prepare",
            Self::Solve => "solve",
            Self::Store => "store",
            Self::Finalize => "finalize",
            Self::EndEvents => "end events",
            Self::Sleep => "sleep",
        }
    }
}

impl fmt::Display for Phase {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Milliseconds of each phase of the last step. All zero on WebAssembly, which has no clock of its own.
///
/// ```
/// let mut world = arbiter3d::World::default();
/// world.step(1.0 / 60.0)?;
/// let total: f64 = world.timings().iter().map(|(_, milliseconds)| milliseconds).sum();
/// assert!((total - world.timings().total()).abs() < 1e-9);
/// # Ok::<(), arbiter3d::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Timings {
    milliseconds: [f64; Phase::ALL.len()],
}

impl Timings {
    /// Milliseconds of one phase.
    #[must_use]
    pub fn get(&self, phase: Phase) -> f64 {
        self.milliseconds[phase as usize]
    }

    /// All phases in order, with their milliseconds.
    pub fn iter(&self) -> impl Iterator<Item = (Phase, f64)> + '_ {
        Phase::ALL.into_iter().map(|phase| (phase, self.get(phase)))
    }

    /// Milliseconds of the whole step.
    #[must_use]
    pub fn total(&self) -> f64 {
        self.milliseconds.iter().sum()
    }
}

/// A clock that is asked at the end of each phase.
pub(crate) struct PhaseClock {
    timings: Timings,
    #[cfg(not(target_arch = "wasm32"))]
    last: std::time::Instant,
}

impl PhaseClock {
    pub fn start() -> Self {
        Self {
            timings: Timings::default(),
            #[cfg(not(target_arch = "wasm32"))]
            last: std::time::Instant::now(),
        }
    }

    /// The phase is over.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn mark(&mut self, phase: Phase) {
        let now = std::time::Instant::now();
        self.timings.milliseconds[phase as usize] += (now - self.last).as_secs_f64() * 1e3;
        self.last = now;
    }

    #[cfg(target_arch = "wasm32")]
    pub fn mark(&mut self, _: Phase) {}

    pub fn finish(self) -> Timings {
        self.timings
    }
}
