//! Contacts between two shapes. (Kernels to come.)

mod manifold;

pub use manifold::{Manifold, ManifoldPoint};

use crate::math::{Pose, Real};
use crate::shape::Shape;

/// What a pair remembers between steps to find its contact faster: the last separating or reference feature.
///
/// A cache never changes a result, only its cost: kernels verify what it suggests.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PairCache {
    /// Kernel-defined.
    pub words: [u32; 2],
}

/// Finds the contacts of two shapes that are closer than `margin`.
///
/// `pose` places shape 2 in the frame of shape 1; the manifold is in that frame, its normals point from shape 1 to shape 2.
pub fn collide(
    shape1: &Shape,
    shape2: &Shape,
    pose: &Pose,
    margin: Real,
    cache: &mut PairCache,
    manifold: &mut Manifold,
) {
    let _ = (shape1, shape2, pose, margin, cache);
    manifold.clear();
}
