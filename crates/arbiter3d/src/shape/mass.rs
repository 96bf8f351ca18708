//! Mass, centre of mass and inertia.

use crate::math::{Pose, Real, SymmetricMat3, Vec3};
use glam::{DMat3, DVec3};

/// Mass (kg), centre of mass (m, in the frame the properties are given in) and inertia about that centre (kg m²).
///
/// ```
/// use arbiter3d::{Shape, math::Vec3};
/// let mass = Shape::cuboid(Vec3::ONE)?.mass_properties(1000.0).unwrap();
/// assert_eq!(mass.mass, 8000.0);
/// # Ok::<(), arbiter3d::ShapeError>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MassProperties {
    /// Mass, kg.
    pub mass: Real,
    /// Centre of mass, metres.
    pub center: Vec3,
    /// Inertia tensor about the centre of mass, kg m².
    pub inertia: SymmetricMat3,
}

impl MassProperties {
    /// The same matter placed by `pose`.
    #[must_use]
    pub fn transform(&self, pose: &Pose) -> Self {
        Self {
            mass: self.mass,
            center: pose.transform_point(self.center),
            inertia: self.inertia.rotate(&pose.rotation.to_mat3()),
        }
    }

    /// Both together, by Steiner's rule.
    #[must_use]
    pub fn combine(&self, other: &Self) -> Self {
        let mass = self.mass + other.mass;
        if mass <= 0.0 {
            return *self;
        }
        let center = (self.center * self.mass + other.center * other.mass) / mass;
        let about = |m: &Self| m.inertia.add(&SymmetricMat3::steiner(m.mass, m.center - center));
        Self { mass, center, inertia: about(self).add(&about(other)) }
    }
}

impl MassProperties {
    /// The same matter `factor` times as dense.
    #[must_use]
    pub(crate) fn scaled(&self, factor: Real) -> Self {
        Self { mass: self.mass * factor, center: self.center, inertia: self.inertia.scale(factor) }
    }
}

/// Second moments `∫ x xᵀ` of a solid with its volume and its first moments, in `f64`: they add up over parts, and an affine
/// map turns them exactly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Moments {
    pub volume: f64,
    pub first: DVec3,
    pub second: DMat3,
}

impl Default for Moments {
    /// Of nothing. Not derived: the default of a matrix is the identity.
    fn default() -> Self {
        Self { volume: 0.0, first: DVec3::ZERO, second: DMat3::ZERO }
    }
}

impl Moments {
    /// Of what has these mass properties at density one.
    pub fn of(unit: &MassProperties) -> Self {
        let (volume, center, i) = (f64::from(unit.mass), unit.center.as_dvec3(), &unit.inertia);
        let column = |x: Real, y: Real, z: Real| DVec3::new(x.into(), y.into(), z.into());
        let inertia = DMat3::from_cols(column(i.xx, i.xy, i.xz), column(i.xy, i.yy, i.yz), column(i.xz, i.yz, i.zz));
        let half_trace = 0.5 * (inertia.x_axis.x + inertia.y_axis.y + inertia.z_axis.z);
        let central = DMat3::from_diagonal(DVec3::splat(half_trace)) - inertia;
        Self { volume, first: center * volume, second: central + outer(center, center) * volume }
    }

    /// Adds the tetrahedron from the origin to a triangle, counter-clockwise from outside.
    pub fn add_triangle(&mut self, [a, b, c]: [DVec3; 3]) {
        let volume = a.dot(b.cross(c)) / 6.0;
        let sum = a + b + c;
        self.volume += volume;
        self.first += sum * (0.25 * volume);
        let squares = outer(a, a) + outer(b, b) + outer(c, c) + outer(sum, sum);
        self.second += squares * (volume / 20.0);
    }

    /// Of the solid after `x → linear x + translation`.
    pub fn map(&self, linear: &DMat3, translation: DVec3) -> Self {
        let scale = linear.determinant().abs();
        let (volume, first) = (self.volume * scale, *linear * self.first * scale);
        let cross = outer(first, translation);
        let second = *linear * self.second * linear.transpose() * scale
            + cross
            + cross.transpose()
            + outer(translation, translation) * volume;
        Self { volume, first: first + translation * volume, second }
    }

    /// `a` times these and `b` times others.
    pub fn blend(&self, a: f64, other: &Self, b: f64) -> Self {
        Self {
            volume: self.volume * a + other.volume * b,
            first: self.first * a + other.first * b,
            second: self.second * a + other.second * b,
        }
    }

    /// Mass, centre and inertia at density one; `None` without a volume that `f32` can hold.
    pub fn unit_mass(&self) -> Option<MassProperties> {
        let center = self.first / self.volume;
        let central = self.second - outer(center, center) * self.volume;
        let trace = central.x_axis.x + central.y_axis.y + central.z_axis.z;
        let inertia = SymmetricMat3 {
            xx: (trace - central.x_axis.x) as Real,
            yy: (trace - central.y_axis.y) as Real,
            zz: (trace - central.z_axis.z) as Real,
            xy: -central.x_axis.y as Real,
            xz: -central.x_axis.z as Real,
            yz: -central.y_axis.z as Real,
        };
        let unit = MassProperties { mass: self.volume as Real, center: center.as_vec3(), inertia };
        let good = unit.mass > 0.0 && unit.mass.is_finite() && unit.center.is_finite() && inertia.is_finite();
        good.then_some(unit)
    }
}

/// `a bᵀ`.
fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

/// Nodes and weights of the five-point rule of Gauss and Legendre on `[−1, 1]`, exact for polynomials of degree nine.
const GAUSS: [(f64, f64); 5] = [
    (-0.906_179_845_938_664, 0.236_926_885_056_189_1),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (0.0, 0.568_888_888_888_888_9),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (0.906_179_845_938_664, 0.236_926_885_056_189_1),
];

/// A stretch of the axis of a solid of revolution, and `ρ²` along it.
pub(crate) type RevolvedPiece<'a> = (f64, f64, &'a dyn Fn(f64) -> f64);

/// At density one, of a solid of revolution about y: `π ∫ρ² dy` and its moments, exact where `ρ²` is a square polynomial.
pub(crate) fn mass_of_revolution(pieces: &[RevolvedPiece<'_>]) -> MassProperties {
    let (mut volume, mut first, mut second, mut fourth) = (0.0, 0.0, 0.0, 0.0);
    for &(low, high, squared) in pieces {
        let half = 0.5 * (high - low);
        for (node, weight) in GAUSS {
            let y = 0.5 * (low + high) + half * node;
            let area = std::f64::consts::PI * squared(y) * weight * half;
            volume += area;
            first += area * y;
            second += area * y * y;
            fourth += 0.25 * area * squared(y);
        }
    }
    let moments =
        Moments { volume, first: DVec3::Y * first, second: DMat3::from_diagonal(DVec3::new(fourth, second, fourth)) };
    moments.unit_mass().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Shape;

    #[test]
    fn two_halves_of_a_box_have_the_mass_of_the_whole() {
        let whole = Shape::cuboid(Vec3::new(1.0, 0.5, 0.25)).unwrap().mass_properties(3.0).unwrap();
        let half = Shape::cuboid(Vec3::new(0.5, 0.5, 0.25)).unwrap().mass_properties(3.0).unwrap();
        let moved = |x: Real| half.transform(&Pose::from_position(Vec3::new(x, 0.0, 0.0)));
        let sum = moved(-0.5).combine(&moved(0.5));
        assert!((sum.mass - whole.mass).abs() < 1e-5 && sum.center.length() < 1e-6);
        assert!((sum.inertia.yy - whole.inertia.yy).abs() < 1e-5);
    }

    /// The upper half of a ball.
    #[derive(Debug)]
    struct HalfBall;

    impl crate::ConvexShape for HalfBall {
        fn support(&self, direction: Vec3) -> Vec3 {
            let across = Vec3::new(direction.x, 0.0, direction.z);
            if direction.y > 0.0 { direction.normalize_or_zero() } else { across.normalize_or_zero() }
        }

        fn center(&self) -> Vec3 {
            Vec3::new(0.0, 0.375, 0.0)
        }
    }

    /// By columns: rays from above and from below tell where each begins and ends.
    fn by_columns(shape: &Shape) -> Moments {
        const CELLS: usize = 160;
        let bounds = shape.local_aabb();
        let (low, size) = (bounds.min.as_dvec3(), (bounds.max - bounds.min).as_dvec3());
        let mut sum = Moments::default();
        let area = size.x * size.z / (CELLS * CELLS) as f64;
        for i in 0..CELLS * CELLS {
            let cell = |k: usize| (k as f64 + 0.5) / CELLS as f64;
            let (x, z) = (low.x + size.x * cell(i % CELLS), low.z + size.z * cell(i / CELLS));
            let far = 1.5 * size.y as Real;
            let cast = |from: Real, way: Real| {
                let origin = Vec3::new(x as Real, from, z as Real);
                let ray = crate::shape::Ray { origin, direction: Vec3::Y * way, max_fraction: 1.0 };
                shape.geometry().cast_ray(&ray).map(|hit| f64::from(from + way * hit.fraction))
            };
            let (Some(top), Some(bottom)) =
                (cast(bounds.max.y + 0.2 * far, -2.0 * far), cast(bounds.min.y - 0.2 * far, 2.0 * far))
            else {
                continue;
            };
            let height = (top - bottom) * area;
            let (y, y2) = (0.5 * (top + bottom), (top * top + top * bottom + bottom * bottom) / 3.0);
            let middle = DVec3::new(x, y, z);
            sum.volume += height;
            sum.first += middle * height;
            let mut squares = outer(middle, middle);
            squares.y_axis.y = y2;
            sum.second += squares * height;
        }
        sum
    }

    /// Mass, centre and inertia of every kind against sums over columns.
    #[test]
    fn masses_are_what_quadrature_finds() {
        let sheared = crate::math::Mat3::from_cols(Vec3::X, Vec3::new(0.4, 0.9, -0.2), Vec3::Z * 0.7);
        let points: Vec<Vec3> = (0..20)
            .map(|i| Vec3::new((i * 7 % 11) as Real / 11.0, (i * 5 % 13) as Real / 13.0, (i * 3 % 17) as Real / 17.0))
            .collect();
        let shapes = [
            Shape::cylinder(0.6, 0.3),
            Shape::cone(0.6, 0.5),
            Shape::tapered_capsule(0.4, 0.2, 0.5),
            Shape::ellipsoid(Vec3::new(0.3, 0.5, 0.7)),
            Shape::cylinder(0.6, 0.3).unwrap().transformed(sheared, Vec3::new(0.3, -0.2, 0.1)),
            Shape::rounded(&Shape::cuboid(Vec3::new(0.3, 0.4, 0.5)).unwrap(), 0.2),
            Shape::rounded(&Shape::hull(&points).unwrap(), 0.1),
            Shape::rounded(&Shape::cylinder(0.4, 0.3).unwrap(), 0.1),
            Shape::point_cloud(&points),
            Shape::custom(HalfBall),
            Shape::capsule(0.4, 0.3),
            Shape::sphere(0.7),
            Shape::hull(&points),
        ];
        for shape in shapes.map(|shape| shape.unwrap()) {
            let (found, expected) = (shape.mass_properties(1.0).unwrap(), by_columns(&shape).unit_mass().unwrap());
            let size = shape.reach();
            assert!((found.mass / expected.mass - 1.0).abs() < 1e-3, "{shape:?}: {found:?} {expected:?}");
            assert!((found.center - expected.center).length() < 1e-3 * size, "{shape:?}: {found:?} {expected:?}");
            let (a, b) = (found.inertia, expected.inertia);
            let allowed = 2e-3 * (b.xx + b.yy + b.zz);
            for (x, y) in [(a.xx, b.xx), (a.yy, b.yy), (a.zz, b.zz), (a.xy, b.xy), (a.xz, b.xz), (a.yz, b.yz)] {
                assert!((x - y).abs() < allowed, "{shape:?}: {a:?} {b:?}");
            }
        }
    }

    /// Kinds with a formula, to 1e-5: mass, height of the centre, and the inertia about x, y and z there.
    #[test]
    fn masses_are_those_of_the_formulas() {
        const PI: f64 = std::f64::consts::PI;
        let (h, r) = (0.6, 0.3);
        let (a, b, c) = (0.3, 0.5, 0.7);
        let ball = 4.0 / 3.0 * PI * r * r * r;
        let tube = 2.0 * PI * r * r * h;
        let across = tube * (r * r / 4.0 + h * h / 3.0);
        let cone = tube / 3.0;
        let box_of = |m: f64| [m * (b * b + c * c) / 3.0, m * (a * a + c * c) / 3.0, m * (a * a + b * b) / 3.0];
        let (egg, brick) = (4.0 / 3.0 * PI * a * b * c, 8.0 * a * b * c);
        let egg_inertia = box_of(egg).map(|i| i * 0.6);
        let ends = ball * (0.4 * r * r + h * h + 0.75 * h * r);
        let capsule_inertia = [across + ends, (tube / 2.0 + 0.4 * ball) * r * r, across + ends];
        let cone_across = cone * (0.15 * r * r + 0.15 * h * h);
        let half = Vec3::new(a as Real, b as Real, c as Real);
        let corners = [-1.0, 1.0].map(|x| [-1.0, 1.0].map(|y| [-1.0, 1.0].map(|z| half * Vec3::new(x, y, z)))).concat();
        let [h32, r32] = [h as Real, r as Real];
        let slim = Shape::capsule(h32, 0.1);
        let cases = [
            (Shape::sphere(r32), ball, 0.0, [0.4 * ball * r * r; 3]),
            (Shape::cylinder(h32, r32), tube, 0.0, [across, 0.5 * tube * r * r, across]),
            (Shape::capsule(h32, r32), tube + ball, 0.0, capsule_inertia),
            (Shape::rounded(&slim.unwrap(), 0.2), tube + ball, 0.0, capsule_inertia),
            (Shape::tapered_capsule(h32, r32, r32), tube + ball, 0.0, capsule_inertia),
            (Shape::cone(h32, r32), cone, -0.5 * h, [cone_across, 0.3 * cone * r * r, cone_across]),
            (Shape::ellipsoid(half), egg, 0.0, egg_inertia),
            (Shape::sphere(1.0).unwrap().scaled(half), egg, 0.0, egg_inertia),
            (Shape::cuboid(half), brick, 0.0, box_of(brick)),
            (Shape::hull(&corners.concat()), brick, 0.0, box_of(brick)),
        ];
        for (shape, mass, height, inertia) in cases {
            let shape = shape.unwrap();
            let found = shape.mass_properties(1.0).unwrap();
            let near =
                |x: Real, y: f64, scale: f64| assert!((f64::from(x) - y).abs() < 1e-5 * scale, "{shape:?}: {x} {y}");
            near(found.mass, mass, mass);
            near(found.center.y, height, h);
            for (x, y) in [found.inertia.xx, found.inertia.yy, found.inertia.zz].into_iter().zip(inertia) {
                near(x, y, y);
            }
        }
    }

    /// The formulas of rounded boxes and cylinders are those of their support points, to what those are good for.
    #[test]
    fn rounded_shapes_have_the_mass_of_their_surface() {
        for core in [Shape::cuboid(Vec3::new(0.3, 0.5, 0.7)), Shape::cylinder(0.6, 0.3)] {
            let rounded = Shape::rounded(&core.unwrap(), 0.2).unwrap();
            let found = rounded.mass_properties(1.0).unwrap();
            let sampled = super::super::convex::mass_of_support(&crate::shape::Support::new(&rounded).unwrap());
            let sampled = sampled.unwrap();
            let near = |x: Real, y: Real| assert!((x - y).abs() < 3e-4 * y, "{x} {y}");
            near(found.mass, sampled.mass);
            near(found.inertia.xx, sampled.inertia.xx);
            near(found.inertia.yy, sampled.inertia.yy);
            near(found.inertia.zz, sampled.inertia.zz);
        }
    }

    /// A tapered capsule, cut into thin discs.
    #[test]
    fn a_tapered_capsule_has_the_mass_of_its_slices() {
        let (h, a, b) = (0.4, 0.2, 0.5);
        let found = Shape::tapered_capsule(h as Real, a as Real, b as Real).unwrap().mass_properties(1.0).unwrap();
        let slope = (b - a) / (2.0 * h);
        let side = (1.0_f64 - slope * slope).sqrt();
        let (low, high) = (slope * b - h, slope * a + h);
        let (mut volume, mut first, mut axial) = (0.0, 0.0, 0.0);
        let slices = 400_000;
        let (from, to) = (-h - b, h + a);
        for k in 0..slices {
            let y = from + (to - from) * (k as f64 + 0.5) / slices as f64;
            let squared = if y < low {
                b * b - (y + h) * (y + h)
            } else if y > high {
                a * a - (y - h) * (y - h)
            } else {
                let radius = (slope * h + a - slope * y) / side;
                radius * radius
            };
            let area = std::f64::consts::PI * squared * (to - from) / slices as f64;
            (volume, first, axial) = (volume + area, first + area * y, axial + 0.5 * area * squared);
        }
        assert!((f64::from(found.mass) / volume - 1.0).abs() < 1e-5);
        assert!((f64::from(found.center.y) - first / volume).abs() < 1e-5);
        assert!((f64::from(found.inertia.yy) / axial - 1.0).abs() < 1e-5);
    }
}
