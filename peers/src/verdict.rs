//! Whether a run did what its scene asks. A time counts only if it did.

use crate::catalog::Outcome;
use crate::ruler::{Quality, start_height};
use crate::run::Run;
use crate::scene::Scene;

/// Share of the bodies that may be lost.
const LOST: f64 = 1e-3;
/// Relative error of the mean height of what stands.
const HEIGHT: f64 = 0.03;
/// How far a sleeping body may move, metres.
const SLEEPER: f64 = 0.05;

/// Why the run failed, if it did.
pub fn judge(outcome: Outcome, scene: &Scene, run: &Run, quality: &Quality) -> Option<String> {
    if let Some(reason) = &run.stopped {
        return Some(reason.clone());
    }
    if quality.not_finite > 0 {
        return Some(format!("{} bodies are not finite", quality.not_finite));
    }
    if quality.lost as f64 > LOST * scene.dynamic_count() as f64 {
        return Some(format!("{} bodies fell through the ground or flew off", quality.lost));
    }
    match outcome {
        Outcome::Moves => None,
        Outcome::Sleeps if quality.sleeper_drift > SLEEPER => {
            Some(format!("a sleeping body moved {:.3} m", quality.sleeper_drift))
        }
        Outcome::Sleeps => None,
        Outcome::Stands { base, settles, drift } => {
            let base = f64::from(base);
            let expected = base + f64::from(settles) * (start_height(scene) - base);
            if (quality.mean_height / expected - 1.0).abs() > HEIGHT {
                Some(format!("fell: mean height {:.3} m, expected {expected:.3} m", quality.mean_height))
            } else if quality.drift > f64::from(drift) {
                Some(format!("a body drifted {:.2} m sideways", quality.drift))
            } else {
                None
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalog::entries;
    use arbiter3d_scenes::{SceneOptions, find};

    /// What is said of a scene whose bodies, at first as they start, were changed by `change`.
    fn verdict(name: &str, change: impl Fn(&mut Quality)) -> Option<String> {
        let options = SceneOptions { size: Some(4), ..SceneOptions::default() };
        let scene = Scene::read(find(name).unwrap().build(&options).unwrap(), 2).unwrap();
        let outcome = entries(true).into_iter().find(|entry| entry.name == name).unwrap().outcome;
        let mut quality = Quality { mean_height: start_height(&scene), ..Quality::default() };
        change(&mut quality);
        judge(outcome, &scene, &Run::default(), &quality)
    }

    #[test]
    fn a_stack_that_stands_passes_and_one_that_falls_does_not() {
        assert_eq!(verdict("large_pyramid", |_| ()), None);
        assert_eq!(verdict("large_pyramid", |quality| quality.mean_height *= 0.98), None);
        assert!(verdict("large_pyramid", |quality| quality.mean_height *= 0.96).unwrap().starts_with("fell"));
        assert!(verdict("colosseum", |quality| quality.drift = 0.51).unwrap().contains("sideways"));
    }

    /// Jolt's pyramid is dropped: where it starts it cannot have been simulated.
    #[test]
    fn a_pyramid_that_hangs_in_the_air_fails() {
        assert!(verdict("jolt_pyramid", |_| ()).unwrap().starts_with("fell"));
        assert_eq!(
            verdict("jolt_pyramid", |quality| quality.mean_height = 1.0 + 0.8 * (quality.mean_height - 1.0)),
            None
        );
    }

    #[test]
    fn lost_bodies_and_disturbed_sleepers_fail() {
        assert_eq!(verdict("washer", |_| ()), None);
        assert!(verdict("washer", |quality| quality.lost = 1).unwrap().contains("1 bodies"));
        assert!(verdict("sleeping_all", |quality| quality.sleeper_drift = 0.1).is_some());
        let stopped = Run { stopped: Some("time".into()), ..Run::default() };
        let options = SceneOptions { size: Some(1), ..SceneOptions::default() };
        let scene = Scene::read(find("washer").unwrap().build(&options).unwrap(), 2).unwrap();
        assert_eq!(judge(Outcome::Moves, &scene, &stopped, &Quality::default()), Some("time".into()));
    }
}
