//! A sphere against a cylinder, a cone or a tapered capsule: one point, by a closed form.
//!
//! These shapes are solids of revolution about y, so all happens in the half plane through the axis and the sphere's centre,
//! with the distance `ρ` from the axis and the height `y`: a rectangle, a triangle, or two discs with their common tangent.
//! The signed distance of the centre from that figure less the radius is the gap. In `f64`: a pebble on a tower keeps its gap.

use super::{Manifold, ManifoldPoint};
use crate::math::{Pose, Real};
use crate::shape::{Cone, Cylinder, Shape, Sphere, TaperedCapsule};
use glam::{DVec2, DVec3};

/// The point of a figure nearest to another.
#[derive(Clone, Copy)]
struct Nearest {
    /// On the outline.
    point: DVec2,
    /// Outward unit vector.
    normal: DVec2,
    /// Negative inside.
    distance: f64,
}

impl Nearest {
    /// Square to a side that the point is over or under.
    fn on_side(from: DVec2, normal: DVec2, distance: f64) -> Self {
        Self { point: from - normal * distance, normal, distance }
    }

    /// A point of the outline of a figure that the other is outside of.
    fn on_outline(from: DVec2, point: DVec2, fallback: DVec2) -> Self {
        let way = from - point;
        let distance = way.length();
        Self { point, normal: if distance > 0.0 { way / distance } else { fallback }, distance }
    }

    fn nearer(self, other: Self) -> Self {
        if other.distance < self.distance { other } else { self }
    }
}

/// Solid of revolution (shape 1) against sphere; false if the shape is none.
pub(crate) fn revolved_sphere(
    shape: &Shape,
    sphere: &Sphere,
    pose: &Pose,
    margin: Real,
    manifold: &mut Manifold,
) -> bool {
    manifold.clear();
    let center = pose.position.as_dvec3();
    let across = (center.x * center.x + center.z * center.z).sqrt();
    let outward = if across > 0.0 { DVec3::new(center.x / across, 0.0, center.z / across) } else { DVec3::X };
    let from = DVec2::new(across, center.y);
    let found = match shape {
        Shape::Cylinder(s) => near_cylinder(s, from),
        Shape::Cone(s) => near_cone(s, from),
        Shape::TaperedCapsule(s) => near_tapered_capsule(s, from),
        _ => return false,
    };
    let separation = (found.distance - f64::from(sphere.radius())) as Real;
    if separation <= margin {
        let spin = |p: DVec2| (outward * p.x + DVec3::Y * p.y).as_vec3();
        let (point1, normal) = (spin(found.point), spin(found.normal));
        manifold.push(ManifoldPoint { point1, normal, separation, feature: 0 });
    }
    true
}

fn near_cylinder(cylinder: &Cylinder, from: DVec2) -> Nearest {
    let (r, h) = (f64::from(cylinder.radius()), f64::from(cylinder.half_length()));
    let up = DVec2::new(0.0, if from.y < 0.0 { -1.0 } else { 1.0 });
    let (beside, above) = (from.x - r, from.y * up.y - h);
    if beside <= 0.0 && above <= 0.0 {
        if beside > above {
            return Nearest::on_side(from, DVec2::X, beside);
        }
        return Nearest::on_side(from, up, above);
    }
    let point = DVec2::new(if beside > 0.0 { r } else { from.x }, if above > 0.0 { up.y * h } else { from.y });
    Nearest::on_outline(from, point, up)
}

fn near_cone(cone: &Cone, from: DVec2) -> Nearest {
    let (r, h) = (f64::from(cone.radius()), f64::from(cone.half_length()));
    let (tip, rim, down) = (DVec2::new(0.0, h), DVec2::new(r, -h), -DVec2::Y);
    let slant = rim - tip;
    let squared = slant.length_squared();
    let side = DVec2::new(-slant.y, slant.x) / squared.sqrt();
    let (over_side, under_base) = (side.dot(from - tip), -h - from.y);
    if over_side <= 0.0 && under_base <= 0.0 {
        if over_side > under_base {
            return Nearest::on_side(from, side, over_side);
        }
        return Nearest::on_side(from, down, under_base);
    }
    let share = (from - tip).dot(slant) / squared;
    let on_side = if share <= 0.0 {
        Nearest::on_outline(from, tip, DVec2::Y)
    } else if share >= 1.0 {
        Nearest::on_outline(from, rim, down)
    } else if over_side > 0.0 {
        Nearest::on_side(from, side, over_side)
    } else {
        Nearest::on_outline(from, tip + slant * share, side)
    };
    let on_base = DVec2::new(if from.x < r { from.x } else { r }, -h);
    on_side.nearer(Nearest::on_outline(from, on_base, down))
}

/// The line square to the common tangent through the point meets the axis between the centres, or one ball is nearest.
fn near_tapered_capsule(capsule: &TaperedCapsule, from: DVec2) -> Nearest {
    let [h, top, bottom] = [capsule.half_length(), capsule.top_radius(), capsule.bottom_radius()].map(f64::from);
    let slope = (bottom - top) / (2.0 * h);
    let side = DVec2::new((1.0 - slope * slope).sqrt(), slope);
    let axis_height = from.y - from.x * slope / side.x;
    let ball = |height: f64, radius: f64, end: DVec2| {
        let way = from - DVec2::new(0.0, height);
        let distance = way.length();
        let normal = if distance > 0.0 { way / distance } else { end };
        Nearest::on_side(from, normal, distance - radius)
    };
    if axis_height >= h {
        ball(h, top, DVec2::Y)
    } else if axis_height <= -h {
        ball(-h, bottom, -DVec2::Y)
    } else {
        Nearest::on_side(from, side, side.dot(from) - slope * h - top)
    }
}
