//! Mass, centre of mass and inertia.

use crate::math::{Pose, Real, SymmetricMat3, Vec3};

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
}
