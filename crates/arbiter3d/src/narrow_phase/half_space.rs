//! Half-spaces (all below the plane through the origin, normal y) against convex shapes: exact, as every height is.

use super::clip::choose_four;
use super::general::{EQUALLY_DEEP, MISSED};
use super::mesh_points::{Candidate, Candidates, Held, NO_FACET, position_number};
use super::{Manifold, ManifoldPoint};
use crate::math::{Pose, Real, Vec3, max, min};
use crate::shape::Support;
use crate::shape::{FEATURE_POINTS, Feature, Shape, Surface};

/// Contacts of a half-space (shape 1) with a convex shape or a surface; nothing for others.
pub(crate) fn collide(shape: &Shape, pose: &Pose, margin: Real, manifold: &mut Manifold) {
    let held = Held::take(manifold);
    if let Some(surface) = Surface::of(shape) {
        return collide_surface(surface, pose, margin, (&held, manifold));
    }
    let Some(support) = Support::new(shape) else { return };
    let down = -pose.rotation.inverse_rotate(Vec3::Y);
    let lowest = pose.position.y - support.extent(down);
    if lowest > margin {
        return;
    }
    let mut feature = Feature::default();
    support.feature(down, &mut feature);
    let mut points = [(Vec3::ZERO, 0); FEATURE_POINTS];
    let (mut count, mut least) = (0, Real::MAX);
    for (number, &corner) in feature.points().iter().enumerate() {
        let point = pose.transform_point(corner);
        least = min(point.y, least);
        if point.y <= margin {
            points[count] = (point, number as u32 + 1);
            count += 1;
        }
    }
    let size = support.size();
    let (chosen, mut chosen_count) = if count <= 4 {
        ([0, 1, 2, 3], count)
    } else {
        choose_four(count, |i| (points[i].0.x, points[i].0.z), |i| points[i].0.y, EQUALLY_DEEP * size)
    };
    // A thinned or sampled feature can lack the lowest point.
    if least > lowest + MISSED * size {
        chosen_count = chosen_count.min(3);
        let deepest = pose.transform_point(support.full_support(down.as_dvec3()).as_vec3());
        push(Vec3::new(deepest.x, lowest, deepest.z), 0, manifold);
    }
    for &k in &chosen[..chosen_count] {
        push(points[k].0, points[k].1, manifold);
    }
}

/// The corners of a surface that are under the plane.
fn collide_surface(surface: Surface<'_>, pose: &Pose, margin: Real, (held, manifold): (&Held, &mut Manifold)) {
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
    let mut materials = [[0; 2]; 4];
    candidates.choose(
        held,
        |point| point,
        |c| {
            materials[manifold.points().len() & 3][1] = surface.material(c.triangle as usize);
            push(c.position + Vec3::Y * c.separation, c.feature, manifold);
        },
    );
    manifold.set_point_materials(&materials);
}

fn push(point: Vec3, feature: u32, manifold: &mut Manifold) {
    let point1 = Vec3::new(point.x, 0.0, point.z);
    manifold.push(ManifoldPoint { point1, normal: Vec3::Y, separation: point.y, feature });
}
