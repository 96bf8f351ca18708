//! The core of a convex shape as the searches of one pair see it: its numbers once in `f64`, a closed form for the
//! farthest point, and what else is known in closed form.
//!
//! Resolved once a pair: which kind it is, what a rounded shape is made of, the matrix of an ellipsoid. What else is
//! known:
//!
//! - the face that looks towards a point (`face_towards`), for cores that have faces;
//! - the normals of a round side (`belt`), which are on a circle for cylinders, cones and hulls of two balls;
//! - how deep a point lies inside (`inner_depth`): the radius of the largest ball around it that fits, or less;
//! - the curvature where a direction is farthest (`curvature`): the second derivative of the support function, which
//!   for an ellipsoid `{c + L u : |u| ≤ 1}` with `x = L Lᵀ n / |Lᵀ n|` is `(L Lᵀ − x xᵀ) / (n · x)`.
//!
//! A ball whose radius is the least radius of curvature rolls inside of a smooth convex body along all of its boundary
//! (Blaschke's rolling theorem); for an ellipsoid with half axes `a ≥ b ≥ c` that is `c² / a`.

use super::support::{Support, furthest};
use super::{ConvexHull, Custom, Transformed};
use crate::math::Vec3;
use glam::{DMat3, DVec2, DVec3};

/// Where the curvature is not known: by how much directions lean between which it is measured. Farthest points in
/// single precision tell it to a hundred thousandth of the size then.
const LEAN: f64 = 1e-2;

/// The core of a convex shape.
#[derive(Clone, Copy)]
pub(crate) enum Core<'a> {
    /// The origin.
    Point,
    /// From `-half_length` to `half_length` on y.
    Segment(f64),
    /// Half extents.
    Cuboid(DVec3),
    Hull(&'a ConvexHull),
    /// The hull of some points.
    Points(&'a [Vec3]),
    Triangle([DVec3; 3]),
    Cylinder {
        half_length: f64,
        radius: f64,
    },
    Cone {
        half_length: f64,
        radius: f64,
    },
    /// The hull of two balls on y.
    TwoBalls {
        half_length: f64,
        top: f64,
        bottom: f64,
    },
    Ellipsoid(Ellipsoid),
    Transformed(&'a Transformed),
    Custom(&'a Custom),
}

/// The outward normals of a side that is straight along lines to an apex, or to none: unit vectors with the same `y`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Belt {
    /// Their `y`.
    pub rise: f64,
    /// Height of the side along them.
    pub offset: f64,
}

/// The image of the unit ball under `u → linear · u + center`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ellipsoid {
    pub linear: DMat3,
    pub center: DVec3,
    /// Radius of a ball that rolls inside.
    pub rolling: f64,
}

impl<'a> Core<'a> {
    pub(crate) fn new(support: &Support<'a>) -> Self {
        match *support {
            Support::Sphere(_) => Self::Point,
            Support::Capsule(s) => Self::Segment(s.half_length().into()),
            Support::Cuboid(s) => Self::Cuboid(s.half_extents().as_dvec3()),
            Support::Hull(s) => Self::Hull(s),
            Support::Triangle(corners) => Self::Triangle(corners.map(Vec3::as_dvec3)),
            Support::Cylinder(s) => Self::Cylinder { half_length: s.half_length().into(), radius: s.radius().into() },
            Support::Cone(s) => Self::Cone { half_length: s.half_length().into(), radius: s.radius().into() },
            Support::TaperedCapsule(s) => {
                let [slim, top, bottom] = [s.core_radius(), s.top_radius(), s.bottom_radius()].map(f64::from);
                let half_length = s.half_length().into();
                if top == bottom {
                    Self::Segment(half_length)
                } else {
                    Self::TwoBalls { half_length, top: top - slim, bottom: bottom - slim }
                }
            }
            Support::Cloud(s) => Self::Points(s.points()),
            Support::Rounded(rounded) | Support::Slim { rounded, .. } => {
                Support::new(rounded.core()).map_or(Self::Point, |core| Self::new(&core))
            }
            Support::Transformed(s) => s.ellipsoid().map_or(Self::Transformed(s), Self::Ellipsoid),
            Support::Custom(s) => Self::Custom(s),
            Support::Points(points) => Self::Points(points),
        }
    }

    /// A point that is farthest along `direction`.
    #[inline]
    pub(crate) fn support(&self, direction: DVec3) -> DVec3 {
        let sign = |d: f64, h: f64| if d < 0.0 { -h } else { h };
        match self {
            Self::Point => DVec3::ZERO,
            Self::Segment(h) => DVec3::new(0.0, sign(direction.y, *h), 0.0),
            Self::Cuboid(h) => DVec3::new(sign(direction.x, h.x), sign(direction.y, h.y), sign(direction.z, h.z)),
            Self::Hull(s) => furthest(s.vertices(), direction),
            Self::Points(points) => furthest(points, direction),
            Self::Triangle(corners) => furthest_corner(corners, direction),
            Self::Cylinder { half_length, radius } => {
                let rim = to_rim(direction, *radius);
                DVec3::new(rim.x, sign(direction.y, *half_length), rim.y)
            }
            Self::Cone { half_length, radius } => {
                let across = (direction.x * direction.x + direction.z * direction.z).sqrt();
                if 2.0 * half_length * direction.y > radius * across {
                    return DVec3::new(0.0, *half_length, 0.0);
                }
                let rim = to_rim(direction, *radius);
                DVec3::new(rim.x, -half_length, rim.y)
            }
            Self::TwoBalls { half_length, top, bottom } => {
                let length = direction.length();
                let unit = if length > 0.0 { direction / length } else { DVec3::Y };
                if half_length * direction.y + top * length >= bottom * length - half_length * direction.y {
                    unit * *top + DVec3::new(0.0, *half_length, 0.0)
                } else {
                    unit * *bottom - DVec3::new(0.0, *half_length, 0.0)
                }
            }
            Self::Ellipsoid(s) => s.support(direction),
            Self::Transformed(s) => s.support(direction),
            Self::Custom(s) => s.support(direction),
        }
    }

    /// A point inside.
    pub(crate) fn middle(&self) -> DVec3 {
        match self {
            Self::Hull(s) => crate::shape::Geometry::inner_ball(*s).0.as_dvec3(),
            Self::Points(points) => points.first().map_or(DVec3::ZERO, |point| point.as_dvec3()),
            Self::Triangle([a, b, c]) => (*a + *b + *c) / 3.0,
            Self::Ellipsoid(s) => s.center,
            Self::Custom(s) => s.shape().center().as_dvec3(),
            Self::Transformed(s) => crate::shape::Geometry::inner_ball(*s).0.as_dvec3(),
            Self::TwoBalls { .. } | Self::Point | Self::Segment(_) => DVec3::ZERO,
            Self::Cuboid(_) | Self::Cylinder { .. } | Self::Cone { .. } => DVec3::ZERO,
        }
    }

    /// Outward unit normal of the face whose plane a point is highest over, with the plane's distance from the origin;
    /// `None` if some round side is nearer, or no face is known.
    pub(crate) fn face_towards(&self, point: DVec3) -> Option<(DVec3, f64)> {
        match self {
            Self::Cuboid(h) => {
                let over = point.abs() - *h;
                let axis = if over.x >= over.y && over.x >= over.z { 0 } else { 1 + usize::from(over.z > over.y) };
                let mut normal = DVec3::ZERO;
                normal[axis] = if point[axis] < 0.0 { -1.0 } else { 1.0 };
                Some((normal, h[axis]))
            }
            Self::Hull(s) => {
                let (mut best, mut highest) = (None, f64::MIN);
                for plane in s.planes() {
                    let (normal, offset) = (plane.normal.as_dvec3(), f64::from(plane.offset));
                    let height = normal.dot(point) - offset;
                    if height > highest {
                        (best, highest) = (Some((normal, offset)), height);
                    }
                }
                best
            }
            Self::Cylinder { half_length, radius } => {
                let across = (point.x * point.x + point.z * point.z).sqrt();
                let up = if point.y < 0.0 { -DVec3::Y } else { DVec3::Y };
                (point.y.abs() - half_length >= across - radius).then_some((up, *half_length))
            }
            Self::Cone { half_length, radius } => {
                (-half_length - point.y >= over_cone(*half_length, *radius, point)).then_some((-DVec3::Y, *half_length))
            }
            _ => None,
        }
    }

    /// The normals of the round side.
    pub(crate) fn belt(&self) -> Option<Belt> {
        match self {
            Self::Segment(_) => Some(Belt { rise: 0.0, offset: 0.0 }),
            Self::Cylinder { radius, .. } => Some(Belt { rise: 0.0, offset: *radius }),
            Self::Cone { half_length, radius } => {
                let rise = radius / (4.0 * half_length * half_length + radius * radius).sqrt();
                Some(Belt { rise, offset: rise * half_length })
            }
            Self::TwoBalls { half_length, top, bottom } => {
                let rise = (bottom - top) / (2.0 * half_length);
                Some(Belt { rise, offset: rise * half_length + top })
            }
            _ => None,
        }
    }

    /// Radius of a ball around a point that fits inside, as large as is known in closed form; negative outside or where
    /// nothing is known. `touching` is the point of the boundary that is farthest along the unit vector `normal`.
    pub(crate) fn inner_depth(&self, point: DVec3, touching: DVec3, normal: DVec3) -> f64 {
        match self {
            Self::Cuboid(h) => {
                let inside = *h - point.abs();
                smaller(smaller(inside.x, inside.y), inside.z)
            }
            Self::Hull(s) => s.planes().iter().fold(f64::MAX, |least, plane| {
                smaller(f64::from(plane.offset) - plane.normal.as_dvec3().dot(point), least)
            }),
            Self::Cylinder { half_length, radius } => {
                let across = (point.x * point.x + point.z * point.z).sqrt();
                smaller(radius - across, half_length - point.y.abs())
            }
            Self::Cone { half_length, radius } => {
                smaller(half_length + point.y, -over_cone(*half_length, *radius, point))
            }
            Self::Segment(half_length) => {
                let across = (point.x * point.x + point.z * point.z).sqrt();
                smaller(-across, half_length - point.y.abs())
            }
            Self::TwoBalls { half_length, top, bottom } => inside_two_balls([*half_length, *top, *bottom], point),
            Self::Ellipsoid(s) => s.rolling - (point - (touching - normal * s.rolling)).length(),
            _ => f64::MIN,
        }
    }

    /// Second derivatives of the support function along two tangents of the unit vector `normal`: both along the first,
    /// mixed, both along the second. `None` where they are endless. `touching` is the point farthest along `normal`.
    pub(crate) fn curvature(&self, touching: DVec3, normal: DVec3, [t1, t2]: [DVec3; 2]) -> Option<[f64; 3]> {
        let ring = |radius: f64| {
            let across = (normal.x * normal.x + normal.z * normal.z).sqrt();
            if across <= 0.0 {
                return None;
            }
            let tangent = DVec3::new(-normal.z / across, 0.0, normal.x / across);
            let (a, b, scale) = (tangent.dot(t1), tangent.dot(t2), radius / across);
            Some([scale * a * a, scale * a * b, scale * b * b])
        };
        match self {
            Self::Point | Self::Segment(_) | Self::Cuboid(_) => Some([0.0; 3]),
            Self::Hull(_) | Self::Points(_) | Self::Triangle(_) => Some([0.0; 3]),
            Self::Cylinder { radius, .. } => ring(*radius),
            Self::Cone { radius, .. } => {
                if touching.y > 0.0 {
                    Some([0.0; 3])
                } else {
                    ring(*radius)
                }
            }
            Self::TwoBalls { top, bottom, .. } => {
                let radius = if touching.y > 0.0 { *top } else { *bottom };
                Some([radius, 0.0, radius])
            }
            Self::Ellipsoid(s) => {
                let x = touching - s.center;
                let (a, b, height) = (s.on_ball(t1), s.on_ball(t2), normal.dot(x));
                let (along1, along2) = (x.dot(t1), x.dot(t2));
                let [k11, k12, k22] =
                    [a.dot(a) - along1 * along1, a.dot(b) - along1 * along2, b.dot(b) - along2 * along2];
                Some([k11 / height, k12 / height, k22 / height])
            }
            Self::Transformed(_) | Self::Custom(_) => {
                // Half the differences of the farthest points of directions that lean to both sides.
                let bend = |t: DVec3| {
                    let [ahead, behind] = [LEAN, -LEAN].map(|lean| self.support(normal + t * lean));
                    (ahead - behind) / (2.0 * LEAN)
                };
                let (along1, along2) = (bend(t1), bend(t2));
                Some([along1.dot(t1), 0.5 * (along1.dot(t2) + along2.dot(t1)), along2.dot(t2)])
            }
        }
    }
}

impl Ellipsoid {
    /// The transposed matrix times a direction.
    #[inline]
    fn on_ball(&self, d: DVec3) -> DVec3 {
        DVec3::new(self.linear.x_axis.dot(d), self.linear.y_axis.dot(d), self.linear.z_axis.dot(d))
    }

    #[inline]
    fn support(&self, direction: DVec3) -> DVec3 {
        let d = self.on_ball(direction);
        let length = d.length();
        if length > 0.0 { self.linear * (d / length) + self.center } else { self.center }
    }
}

pub(crate) fn smaller(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// The point of a circle about y that is farthest along a direction: its x and z.
#[inline]
fn to_rim(direction: DVec3, radius: f64) -> DVec2 {
    let across = (direction.x * direction.x + direction.z * direction.z).sqrt();
    let scale = if across > 0.0 { radius / across } else { 0.0 };
    DVec2::new(direction.x * scale, direction.z * scale)
}

/// How far a point is outside of a cone's side, continued without end.
fn over_cone(half_length: f64, radius: f64, point: DVec3) -> f64 {
    let across = (point.x * point.x + point.z * point.z).sqrt();
    let slant = (4.0 * half_length * half_length + radius * radius).sqrt();
    (2.0 * half_length * across + radius * (point.y - half_length)) / slant
}

/// The line square to the common tangent through the point meets the axis between the centres, or one ball is nearest.
fn inside_two_balls([half_length, top, bottom]: [f64; 3], point: DVec3) -> f64 {
    let across = (point.x * point.x + point.z * point.z).sqrt();
    let slope = (bottom - top) / (2.0 * half_length);
    let cosine = (1.0 - slope * slope).sqrt();
    let axis_height = point.y - across * slope / cosine;
    let ball = |height: f64, radius: f64| {
        let up = point.y - height;
        radius - (across * across + up * up).sqrt()
    };
    if axis_height >= half_length {
        ball(half_length, top)
    } else if axis_height <= -half_length {
        ball(-half_length, bottom)
    } else {
        slope * half_length + top - cosine * across - slope * point.y
    }
}

/// The first of the corners that are farthest along `direction`.
fn furthest_corner(corners: &[DVec3; 3], direction: DVec3) -> DVec3 {
    let [a, b, c] = corners.map(|corner| corner.dot(direction));
    if c > a && c > b {
        corners[2]
    } else if b > a {
        corners[1]
    } else {
        corners[0]
    }
}
