//! Convex shapes as the general algorithms see them: a core, known by its farthest points, grown by a radius.

use super::{
    Capsule, Cone, ConvexHull, Cuboid, Custom, Cylinder, FLAT_SINE, Feature, Geometry, PointCloud, Rounded, Shape,
    Sphere, TaperedCapsule, Transformed, triangle_edge, triangle_feature,
};
use crate::math::{Aabb, Pose, Real, Vec3};
use glam::DVec3;

use super::polyhedron::{CuboidFeatures, Polyhedron};

/// Of what has no inner radius: the share of its reach that counts as its size.
const FLAT_SIZE: Real = 0.1;

/// A convex shape as a core with a radius.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Support<'a> {
    Sphere(Sphere),
    Capsule(Capsule),
    Cuboid(Cuboid),
    Hull(&'a ConvexHull),
    Triangle([Vec3; 3]),
    Cylinder(Cylinder),
    Cone(Cone),
    TaperedCapsule(TaperedCapsule),
    Cloud(&'a PointCloud),
    Rounded(&'a Rounded),
    Transformed(&'a Transformed),
    Custom(&'a Custom),
    /// The hull of some points.
    Points(&'a [Vec3]),
    /// A rounded shape with a smaller rounding.
    Slim {
        rounded: &'a Rounded,
        radius: Real,
    },
}

impl<'a> Support<'a> {
    /// The support map of a shape; `None` for what is not convex or not bounded.
    pub(crate) fn new(shape: &'a Shape) -> Option<Self> {
        Some(match shape {
            Shape::Sphere(s) => Self::Sphere(*s),
            Shape::Capsule(s) => Self::Capsule(*s),
            Shape::Cuboid(s) => Self::Cuboid(*s),
            Shape::Hull(s) => Self::Hull(s),
            Shape::Triangle(s) => Self::Triangle(s.corners()),
            Shape::Cylinder(s) => Self::Cylinder(*s),
            Shape::Cone(s) => Self::Cone(*s),
            Shape::TaperedCapsule(s) => Self::TaperedCapsule(*s),
            Shape::PointCloud(s) => Self::Cloud(s),
            Shape::Rounded(s) => Self::Rounded(s),
            Shape::Transformed(s) => Self::Transformed(s),
            Shape::Custom(s) => Self::Custom(s),
            Shape::Mesh(_) | Shape::HeightField(_) | Shape::HalfSpace(_) => return None,
            Shape::Compound(_) | Shape::Voxels(_) => return None,
        })
    }

    /// How far the surface is from the core, metres.
    #[inline]
    pub(crate) fn radius(&self) -> Real {
        match self {
            Self::Sphere(s) => s.radius(),
            Self::Capsule(s) => s.radius(),
            Self::TaperedCapsule(s) => s.core_radius(),
            Self::Rounded(s) => s.radius() + Self::new(s.core()).map_or(0.0, |core| core.radius()),
            Self::Slim { rounded, radius } => radius + Self::new(rounded.core()).map_or(0.0, |core| core.radius()),
            _ => 0.0,
        }
    }

    /// Whether the core is more than a few corners.
    pub(crate) fn has_round_core(&self) -> bool {
        match self {
            Self::Sphere(_)
            | Self::Capsule(_)
            | Self::Cuboid(_)
            | Self::Hull(_)
            | Self::Triangle(_)
            | Self::Cloud(_) => false,
            Self::Rounded(s) | Self::Slim { rounded: s, .. } => {
                Self::new(s.core()).is_some_and(|core| core.has_round_core())
            }
            _ => true,
        }
    }

    /// A point of the core that is furthest along `direction`.
    #[inline]
    pub(crate) fn core_support(&self, direction: DVec3) -> DVec3 {
        let sign = |d: f64, h: Real| if d < 0.0 { -f64::from(h) } else { f64::from(h) };
        match self {
            Self::Sphere(_) => DVec3::ZERO,
            Self::Capsule(s) => DVec3::new(0.0, sign(direction.y, s.half_length()), 0.0),
            Self::Cuboid(s) => {
                let h = s.half_extents();
                DVec3::new(sign(direction.x, h.x), sign(direction.y, h.y), sign(direction.z, h.z))
            }
            Self::Hull(s) => furthest(s.vertices(), direction),
            Self::Triangle(corners) => furthest(corners, direction),
            Self::Cylinder(s) => s.support(direction),
            Self::Cone(s) => s.support(direction),
            Self::TaperedCapsule(s) => s.core_support(direction),
            Self::Cloud(s) => furthest(s.points(), direction),
            Self::Rounded(s) | Self::Slim { rounded: s, .. } => {
                Self::new(s.core()).map_or(DVec3::ZERO, |core| core.core_support(direction))
            }
            Self::Transformed(s) => s.support(direction),
            Self::Custom(s) => s.support(direction),
            Self::Points(points) => furthest(points, direction),
        }
    }

    /// A point of the shape that is furthest along `direction`.
    pub(crate) fn full_support(&self, direction: DVec3) -> DVec3 {
        let (core, radius) = (self.core_support(direction), f64::from(self.radius()));
        let length = direction.length();
        if radius > 0.0 && length > 0.0 { core + direction * (radius / length) } else { core }
    }

    /// What else is known of the shape.
    fn geometry(&self) -> Option<&dyn Geometry> {
        Some(match self {
            Self::Sphere(s) => s,
            Self::Capsule(s) => s,
            Self::Cuboid(s) => s,
            Self::Hull(s) => *s,
            Self::Triangle(_) | Self::Points(_) | Self::Slim { .. } => return None,
            Self::Cylinder(s) => s,
            Self::Cone(s) => s,
            Self::TaperedCapsule(s) => s,
            Self::Cloud(s) => *s,
            Self::Rounded(s) => *s,
            Self::Transformed(s) => *s,
            Self::Custom(s) => *s,
        })
    }

    /// The box around the shape placed by `pose`.
    pub(crate) fn bounds(&self, pose: &Pose) -> Aabb {
        match self {
            Self::Sphere(s) => Aabb::from_center(pose.position, Vec3::splat(s.radius())),
            Self::Capsule(s) => s.aabb(pose),
            Self::Cuboid(s) => s.aabb(pose),
            Self::Hull(s) => s.local_aabb().transform(pose),
            Self::Triangle(corners) => Aabb::from_points(corners.map(|corner| pose.transform_point(corner))),
            Self::Points(points) => Aabb::from_points(points.iter().map(|point| pose.transform_point(*point))),
            Self::Slim { rounded, radius } => rounded.core().aabb(pose).expand(*radius),
            other => other.geometry().map_or(Aabb::EMPTY, |shape| shape.aabb(pose)),
        }
    }

    /// How far the shape reaches along a unit vector of its frame, metres.
    pub(crate) fn extent(&self, direction: Vec3) -> Real {
        let longest = |points: &[Vec3]| points.iter().fold(-Real::MAX, |m, p| crate::math::max(p.dot(direction), m));
        match self {
            Self::Sphere(s) => s.radius(),
            Self::Capsule(s) => s.half_length() * direction.y.abs() + s.radius(),
            Self::Cuboid(s) => s.half_extents().dot(crate::math::abs3(direction)),
            Self::Hull(s) => longest(s.vertices()),
            Self::Triangle(corners) => longest(corners),
            Self::Points(points) => longest(points),
            other => {
                let d = direction.as_dvec3();
                other.full_support(d).dot(d) as Real
            }
        }
    }

    /// Largest distance of a point of the shape from `pivot`, a point in its frame, metres.
    pub(crate) fn reach(&self, pivot: Vec3) -> Real {
        let squared = |p: &Vec3| (*p - pivot).length_squared();
        let longest = |points: &[Vec3]| points.iter().fold(0.0, |m, p| crate::math::max(squared(p), m)).sqrt();
        let around_origin = match self {
            Self::Sphere(s) => s.radius(),
            Self::Capsule(s) => s.half_length() + s.radius(),
            Self::Cuboid(s) => s.half_extents().length(),
            Self::Hull(s) => return longest(s.vertices()),
            Self::Triangle(corners) => return longest(corners),
            Self::Points(points) => return longest(points),
            Self::Slim { rounded, radius } => return rounded.core().reach_from(pivot) + radius,
            other => return other.geometry().map_or(0.0, |shape| shape.reach_from(pivot)),
        };
        around_origin + pivot.length()
    }

    /// Largest distance of a point of the core from the line through `pivot` along `axis`, a unit vector of the shape's
    /// frame, metres: how fast the core's fastest point goes when it turns about that line. A log that rolls about its own
    /// axis is slow, and the radius of what is round does not count at all. An upper bound for some kinds.
    pub(crate) fn swing(&self, pivot: Vec3, axis: Vec3) -> Real {
        let lever = |p: Vec3| (p - pivot).cross(axis).length_squared();
        let longest = |points: &[Vec3]| points.iter().fold(0.0, |m, p| crate::math::max(lever(*p), m)).sqrt();
        match self {
            Self::Sphere(_) => lever(Vec3::ZERO).sqrt(),
            Self::Capsule(s) => longest(&[Vec3::Y * s.half_length(), Vec3::Y * -s.half_length()]),
            Self::Cuboid(s) => {
                let h = s.half_extents();
                let side = |i: u8, bit: u8, half: Real| if i >> bit & 1 == 1 { half } else { -half };
                let corner = |i: u8| Vec3::new(side(i, 0, h.x), side(i, 1, h.y), side(i, 2, h.z));
                longest(&[0, 1, 2, 3, 4, 5, 6, 7].map(corner))
            }
            Self::Hull(s) => longest(s.vertices()),
            Self::Triangle(corners) => longest(corners),
            Self::Points(points) => longest(points),
            // The far points of the ends of its axis, which is as far as its rims reach.
            Self::Cylinder(s) => longest(&[Vec3::Y * s.half_length(), Vec3::Y * -s.half_length()]) + s.radius(),
            other => crate::math::max(other.reach(pivot) - other.radius(), 0.0),
        }
    }

    /// Centre and radius of a ball that fits inside.
    pub(crate) fn inner_ball(&self) -> (Vec3, Real) {
        match self {
            Self::Triangle([a, b, c]) => ((*a + *b + *c) * (1.0 / 3.0), 0.0),
            Self::Slim { rounded, radius } => {
                let (center, inner) = rounded.core().inner_ball();
                (center, inner + radius)
            }
            other => other.geometry().map_or((Vec3::ZERO, 0.0), |shape| shape.inner_ball()),
        }
    }

    /// A length that tolerances are relative to: the inner radius, or for flat shapes a share of how far they reach.
    pub(crate) fn size(&self) -> Real {
        let (center, radius) = self.inner_ball();
        if radius > 0.0 { radius } else { FLAT_SIZE * self.reach(center) }
    }

    /// The face, line or point of the whole shape that lies most along a unit direction.
    pub(crate) fn feature(&self, direction: Vec3, out: &mut Feature) {
        let d = direction;
        match self {
            Self::Sphere(s) => out.push(d * s.radius()),
            Self::Capsule(s) => {
                let end = Vec3::Y * if d.y < 0.0 { -s.half_length() } else { s.half_length() };
                out.push(end + d * s.radius());
                if d.y.abs() < FLAT_SINE {
                    out.push(d * s.radius() - end);
                }
            }
            Self::Cuboid(s) => polyhedron_feature(&CuboidFeatures::new(s).view(), d, out),
            Self::Hull(s) => polyhedron_feature(&Polyhedron::from_hull(s), d, out),
            Self::Triangle(corners) => triangle_feature(*corners, d, out),
            Self::Cylinder(s) => s.feature(d, out),
            Self::Cone(s) => s.feature(d, out),
            Self::TaperedCapsule(s) => s.feature(d, out),
            Self::Cloud(s) => s.feature(d, out),
            Self::Rounded(s) => s.feature(d, out),
            Self::Transformed(s) => s.feature(d, out),
            Self::Custom(s) => s.feature(d, out),
            Self::Points(_) | Self::Slim { .. } => out.push(self.full_support(d.as_dvec3()).as_vec3()),
        }
    }

    /// The edge that lies most level to a unit direction at the furthest point along it; nothing where there is none.
    pub(crate) fn edge(&self, direction: Vec3, out: &mut Feature) {
        match self {
            Self::Capsule(_) | Self::Cylinder(_) | Self::Cone(_) | Self::TaperedCapsule(_) => {
                self.feature(direction, out);
                if out.points().len() > 2 {
                    *out = Feature::default();
                }
            }
            Self::Cuboid(s) => polyhedron_edge(&CuboidFeatures::new(s).view(), direction, out),
            Self::Hull(s) => polyhedron_edge(&Polyhedron::from_hull(s), direction, out),
            Self::Triangle(corners) => triangle_edge(*corners, direction, out),
            Self::Cloud(s) => s.edge(direction, out),
            Self::Rounded(s) => s.edge(direction, out),
            Self::Transformed(s) => s.edge(direction, out),
            Self::Sphere(_) | Self::Custom(_) | Self::Points(_) | Self::Slim { .. } => {}
        }
    }
}

/// Of the edges at the corner furthest along `d` the one that lies most level, if it lies level at all.
fn polyhedron_edge(solid: &Polyhedron<'_>, d: Vec3, out: &mut Feature) {
    let corner = solid.lowest_corner(-d);
    let (mut best, mut least) = (None, FLAT_SINE);
    for &face in solid.faces_around(corner) {
        for edge in solid.face_loop(face as usize).filter(|&edge| solid.edges[edge].origin as usize == corner) {
            let (a, b) = solid.edge_points(edge);
            let slope = d.dot(a - b) / (a - b).length();
            if slope < least {
                (best, least) = (Some(edge), slope);
            }
        }
    }
    // Of its two half edges always the same, so that its ends keep their order when both are as far.
    if let Some(edge) = best {
        let (a, b) = solid.edge_points(edge & !1);
        out.push(a);
        out.push(b);
    }
}

/// Of the faces around the corner furthest along `d` the one that looks most along it.
///
/// A solid so turned has faces within 55° there (a cube on its corner); the contact then is a point of the face, and what
/// lies out of reach is left out by its height.
fn polyhedron_feature(solid: &Polyhedron<'_>, d: Vec3, out: &mut Feature) {
    let corner = solid.lowest_corner(-d);
    let (mut best, mut cosine) = (0, -Real::MAX);
    for &face in solid.faces_around(corner) {
        let c = solid.planes[face as usize].normal.dot(d);
        if c > cosine + 1e-3 {
            (best, cosine) = (face as usize, c);
        }
    }
    let count = solid.face_loop(best).count();
    let corner_of = |edge: usize| solid.vertices[solid.edges[edge].origin as usize];
    out.set_thinned(count, |k| solid.face_loop(best).nth(k).map_or(Vec3::ZERO, corner_of));
}

/// The first of the points that are furthest along `direction`.
pub(crate) fn furthest(points: &[Vec3], direction: DVec3) -> DVec3 {
    let (mut best, mut most) = (DVec3::ZERO, f64::MIN);
    for point in points {
        let point = point.as_dvec3();
        let along = point.dot(direction);
        if along > most {
            (best, most) = (point, along);
        }
    }
    best
}
