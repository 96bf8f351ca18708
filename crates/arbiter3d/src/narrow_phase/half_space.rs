//! Half-spaces (all below the plane through the origin, normal y) against convex shapes: exact, as every height is.

use super::clip::choose_four;
use super::mesh_points::{Candidate, Candidates, NO_FACET, position_number};
use super::support::Support;
use super::{Manifold, ManifoldPoint};
use crate::math::{Pose, Real, Vec3, max};
use crate::shape::{Feature, Shape, Surface};

/// Contacts of a half-space (shape 1) with a convex shape or a surface; nothing for others.
pub(crate) fn collide(shape: &Shape, pose: &Pose, margin: Real, manifold: &mut Manifold) {
    manifold.clear();
    if let Some(surface) = Surface::of(shape) {
        return collide_surface(surface, pose, margin, manifold);
    }
    let Some(support) = Support::new(shape) else { return };
    let down = -pose.rotation.inverse_rotate(Vec3::Y);
    let lowest = pose.position.y - support.extent(down);
    if lowest > margin {
        return;
    }
    let mut feature = Feature::default();
    support.feature(down, &mut feature);
    let mut points = [Vec3::ZERO; crate::shape::FEATURE_POINTS];
    let (mut count, mut least) = (0, Real::MAX);
    for &corner in feature.points() {
        let point = pose.transform_point(corner);
        least = crate::math::min(point.y, least);
        if point.y <= margin {
            points[count] = point;
            count += 1;
        }
    }
    let size = max(support.inner_ball().1, 1e-3 * support.reach(Vec3::ZERO));
    let (chosen, chosen_count) = if count <= 4 {
        ([0, 1, 2, 3], count)
    } else {
        choose_four(count, |i| (points[i].x, points[i].z), |i| points[i].y, size)
    };
    for &k in &chosen[..chosen_count] {
        push(points[k], k as u32 + 1, manifold);
    }
    // A thinned or sampled feature can lack the lowest point.
    if least > lowest + 1e-4 * size && manifold.points().len() < 4 {
        let deepest = support.full_support(down.as_dvec3()).as_vec3();
        push(pose.transform_point(deepest), 0, manifold);
    }
}

/// The corners of a surface that are under the plane.
fn collide_surface(surface: Surface<'_>, pose: &Pose, margin: Real, manifold: &mut Manifold) {
    let around = surface.local_aabb();
    let size = max(surface.inner_radius(), 1e-3 * around.half_extents().length());
    let mut candidates = Candidates::new(0.02 * size);
    surface.for_each_facet(&around, |triangle| {
        for corner in surface.corners(triangle) {
            let point = pose.transform_point(corner);
            if point.y <= margin {
                candidates.push(Candidate {
                    position: Vec3::new(point.x, 0.0, point.z),
                    normal: Vec3::Y,
                    separation: point.y,
                    feature: position_number(corner),
                    facet: NO_FACET,
                    triangle: triangle as u32,
                });
            }
        }
    });
    let mut deepest = (Real::MAX, 0);
    candidates.choose(|c| {
        if c.separation < deepest.0 {
            deepest = (c.separation, surface.material(c.triangle as usize));
        }
        push(c.position + Vec3::Y * c.separation, c.feature, manifold);
    });
    manifold.set_materials([0, deepest.1]);
}

fn push(point: Vec3, feature: u32, manifold: &mut Manifold) {
    let point1 = Vec3::new(point.x, 0.0, point.z);
    manifold.push(ManifoldPoint { point1, normal: Vec3::Y, separation: point.y, feature });
}
