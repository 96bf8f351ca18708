//! Convex shapes grown by a radius: rounded boxes, hulls, cylinders.

use super::convex::{Feature, mass_of_support};
use super::convex_ray::cast_support;
use super::geometry::Geometry;
use super::ray::{Ray, ShapeHit};
use super::support::Support;
use super::{MassProperties, Shape, ShapeError, positive};
use crate::math::{Aabb, Pose, Real, SymmetricMat3, Vec3};
use glam::DVec3;

/// A convex shape grown by a radius on all sides.
///
/// ```
/// use arbiter3d::{Shape, math::Vec3};
/// // A die of 2 cm with edges rounded by 2 mm.
/// let die = Shape::rounded(&Shape::cuboid(Vec3::splat(0.008))?, 0.002)?;
/// assert!((die.local_aabb().max.x - 0.01).abs() < 1e-7);
/// # Ok::<(), arbiter3d::ShapeError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Rounded {
    core: Shape,
    radius: Real,
    unit_mass: MassProperties,
}

impl Rounded {
    /// `core` grown by `radius`, metres.
    ///
    /// # Errors
    /// If the radius is not a finite length above zero, or the core is not convex.
    pub fn new(core: &Shape, radius: Real) -> Result<Self, ShapeError> {
        let radius = positive("rounding radius", radius)?;
        if Support::new(core).is_none() {
            return Err(ShapeError::NotConvex { what: "the core of a rounded shape" });
        }
        let mut rounded = Self { core: core.clone(), radius, unit_mass: MassProperties::default() };
        rounded.unit_mass = match mass_by_formula(core, radius) {
            Some(mass) => mass?,
            None => mass_of_support(&Support::Rounded(&rounded))?,
        };
        Ok(rounded)
    }

    /// The shape inside.
    #[must_use]
    pub fn core(&self) -> &Shape {
        &self.core
    }

    /// By how much it is grown, metres.
    #[must_use]
    pub fn radius(&self) -> Real {
        self.radius
    }

    /// The core's feature, moved out.
    pub(crate) fn feature(&self, d: Vec3, out: &mut Feature) {
        if let Some(core) = Support::new(&self.core) {
            core.feature(d, out);
        }
        out.points_mut().iter_mut().for_each(|point| *point += d * self.radius);
    }

    /// The core's most level edge, moved out.
    pub(crate) fn edge(&self, d: Vec3, out: &mut Feature) {
        if let Some(core) = Support::new(&self.core) {
            core.edge(d, out);
        }
        out.points_mut().iter_mut().for_each(|point| *point += d * self.radius);
    }
}

/// Mass properties at density one of a core grown by a radius, for cores of which there is a formula.
fn mass_by_formula(core: &Shape, radius: Real) -> Option<Result<MassProperties, ShapeError>> {
    let grown = match core {
        Shape::Sphere(s) => Shape::sphere(s.radius() + radius),
        Shape::Capsule(s) => Shape::capsule(s.half_length(), s.radius() + radius),
        Shape::TaperedCapsule(s) => {
            Shape::tapered_capsule(s.half_length(), s.top_radius() + radius, s.bottom_radius() + radius)
        }
        Shape::Cuboid(s) => return Some(Ok(mass_of_cuboid(s.half_extents().as_dvec3(), radius.into()))),
        Shape::Cylinder(s) => return Some(Ok(mass_of_cylinder(s.half_length(), s.radius(), radius))),
        _ => return None,
    };
    Some(grown.and_then(|shape| shape.mass_properties(1.0)))
}

/// A box, its six slabs, twelve quarter cylinders and eight eighths of a ball. With `u` the way beyond an edge,
/// `∫ (a + |u|)²` is known over discs and balls of radius `r`.
fn mass_of_cuboid(half: DVec3, r: f64) -> MassProperties {
    const PI: f64 = std::f64::consts::PI;
    let [a, b, c] = half.to_array();
    let volume = 8.0 * a * b * c
        + 8.0 * r * (a * b + b * c + c * a)
        + 2.0 * PI * r * r * (a + b + c)
        + 4.0 / 3.0 * PI * r * r * r;
    // The second moment along the axis with half extent `a`.
    let square = |a: f64, b: f64, c: f64| {
        let cube = |x: f64| x * x * x;
        let level = (8.0 * a * b * c + 8.0 * r * a * (b + c) + 2.0 * PI * r * r * a) * a * a / 3.0;
        let slabs = 8.0 * b * c * (cube(a + r) - cube(a)) / 3.0;
        let disc = PI * r * r * a * a + 8.0 / 3.0 * a * r * r * r + 0.25 * PI * r * r * r * r;
        let ball = 4.0 / 3.0 * PI * r * r * r * a * a + PI * a * r * r * r * r + 4.0 / 15.0 * PI * r * r * r * r * r;
        level + slabs + disc * 2.0 * (b + c) + ball
    };
    symmetric(volume, [square(a, b, c), square(b, c, a), square(c, a, b)])
}

/// A solid of revolution about y: within the half length `h` its radius is `R + r`, beyond `R + s` with `s² = r² − t²`,
/// `t` the way beyond. The integrals of powers of `s` from `t = 0` to `r`, alone, times `t` and times `t²`, are known.
fn mass_of_cylinder(half_length: Real, core_radius: Real, radius: Real) -> MassProperties {
    const PI: f64 = std::f64::consts::PI;
    let [h, core, r] = [half_length, core_radius, radius].map(f64::from);
    let (r2, r3, r4, r5) = (r * r, r * r * r, r * r * r * r, r * r * r * r * r);
    let plain = [r, PI * r2 / 4.0, 2.0 / 3.0 * r3, 3.0 / 16.0 * PI * r4, 8.0 / 15.0 * r5];
    let times_t = [r2 / 2.0, r3 / 3.0, r4 / 4.0];
    let times_t2 = [r3 / 3.0, PI * r4 / 16.0, 2.0 / 15.0 * r5];
    let squared = |of: &[f64]| core * core * of[0] + 2.0 * core * of[1] + of[2];
    let full = (core + r) * (core + r);
    let fourth = core * core * (core * core * plain[0] + 4.0 * core * plain[1] + 6.0 * plain[2])
        + 4.0 * core * plain[3]
        + plain[4];
    let volume = PI * (2.0 * h * full + 2.0 * squared(&plain));
    let across = 0.25 * PI * (2.0 * h * full * full + 2.0 * fourth);
    let beyond = h * h * squared(&plain) + 2.0 * h * squared(&times_t) + squared(&times_t2);
    let along = PI * (2.0 / 3.0 * h * h * h * full + 2.0 * beyond);
    symmetric(volume, [across, along, across])
}

/// Of a volume and the second moments along the axes of what is symmetric to all planes between them.
fn symmetric(volume: f64, [x, y, z]: [f64; 3]) -> MassProperties {
    let inertia = SymmetricMat3::diagonal(DVec3::new(y + z, z + x, x + y).as_vec3());
    MassProperties { mass: volume as Real, center: Vec3::ZERO, inertia }
}

impl Geometry for Rounded {
    fn local_aabb(&self) -> Aabb {
        self.core.local_aabb().expand(self.radius)
    }

    fn aabb(&self, pose: &Pose) -> Aabb {
        self.core.aabb(pose).expand(self.radius)
    }

    fn mass_properties(&self, density: Real) -> Result<MassProperties, ShapeError> {
        Ok(self.unit_mass.scaled(density))
    }

    fn inner_ball(&self) -> (Vec3, Real) {
        let (center, radius) = self.core.inner_ball();
        (center, radius + self.radius)
    }

    fn reach_from(&self, point: Vec3) -> Real {
        self.core.reach_from(point) + self.radius
    }

    fn rounding_radius(&self) -> Real {
        self.core.rounding_radius() + self.radius
    }

    fn cast_ray(&self, ray: &Ray) -> Option<ShapeHit> {
        cast_support(&Support::Rounded(self), ray)
    }
}
