//! Which scenes are timed, at which size, and how one tells that an engine has failed them.

use arbiter3d::math::Real;

/// What must hold at the end of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Outcome {
    /// Bodies move about; none may be lost.
    Moves,
    /// What is built stands: heights are multiplied by `settles` (after subtracting `base`) and stay within 3 %, and no body
    /// drifts sideways by more than `drift` metres.
    Stands {
        /// Height that does not settle.
        base: Real,
        /// Share of the height above it that remains.
        settles: Real,
        /// Allowed sideways drift, metres.
        drift: Real,
    },
    /// What starts asleep stays asleep where it is.
    Sleeps,
}

/// A scene to be timed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Entry {
    /// Its name in `arbiter3d-scenes`.
    pub name: &'static str,
    /// Its size; `None` for the published one.
    pub size: Option<usize>,
    /// Steps; `None` for the published number.
    pub steps: Option<usize>,
    /// What must hold at the end.
    pub outcome: Outcome,
}

const STANDS: Outcome = Outcome::Stands { base: 0.0, settles: 1.0, drift: 0.5 };
/// Jolt's pyramid of boxes of 2 m starts with gaps of half a metre between its layers.
const DROPS: Outcome = Outcome::Stands { base: 1.0, settles: 0.8, drift: 1.0 };

/// Name, outcome, and size and steps of the quick set.
const SCENES: [(&str, Outcome, usize, usize); 17] = [
    ("large_pyramid", STANDS, 50, 100),
    ("many_pyramids", STANDS, 7, 100),
    ("colosseum", STANDS, 4, 100),
    ("jolt_pyramid", DROPS, 10, 150),
    ("convex_pile", Outcome::Moves, 20, 200),
    ("junkyard", Outcome::Moves, 3, 250),
    ("washer", Outcome::Moves, 10, 300),
    ("rotating_cube", Outcome::Moves, 10, 200),
    ("spheres10k", Outcome::Moves, 2000, 200),
    ("mesh_rain10k", Outcome::Moves, 2048, 200),
    ("convex_vs_mesh", Outcome::Moves, 4, 200),
    ("trees100", Outcome::Moves, 50, 200),
    ("trees50", Outcome::Moves, 50, 200),
    ("trees25", Outcome::Moves, 50, 200),
    ("large_world", Outcome::Moves, 300, 300),
    ("sleeping_field", Outcome::Sleeps, 20_000, 200),
    ("sleeping_all", Outcome::Sleeps, 20_000, 200),
];

/// All scenes at their published size, or the quick set.
pub fn entries(quick: bool) -> Vec<Entry> {
    let entry = |&(name, outcome, size, steps): &(&'static str, Outcome, usize, usize)| Entry {
        name,
        size: quick.then_some(size),
        steps: quick.then_some(steps),
        outcome,
    };
    SCENES.iter().map(entry).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_scene_exists_and_every_quick_size_is_smaller() {
        for entry in entries(true) {
            let scene = arbiter3d_scenes::find(entry.name).unwrap_or_else(|| panic!("no scene {}", entry.name));
            assert!(entry.size.unwrap() <= scene.size.default, "{}", entry.name);
        }
        assert!(entries(false).iter().all(|entry| entry.size.is_none() && entry.steps.is_none()));
    }
}
