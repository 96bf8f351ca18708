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
const SLEEPER: f64 = 0.01;

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
