//! Triangle mesh against a convex shape. (Kernel to come.)

use super::{Manifold, PairCache};
use crate::math::{Pose, Real};
use crate::shape::{Shape, TriangleMesh};

/// Contacts of a mesh (shape 1, whose frame the manifold is in) and a convex shape placed in that frame by `pose`.
pub(crate) fn collide(
    mesh: &TriangleMesh,
    convex: &Shape,
    pose: &Pose,
    margin: Real,
    cache: &mut PairCache,
    manifold: &mut Manifold,
) {
    let _ = (mesh, convex, pose, margin, cache);
    manifold.clear();
}
