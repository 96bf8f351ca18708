//! Every convex kind of shape in one scene.

use crate::builder::{Builder, plain};
use crate::meshes::wave;
use crate::{BuiltScene, SceneOptions};
use arbiter3d::{
    BodyDefinition, ConvexShape, Error, Shape, ShapeDefinition,
    math::{Mat3, Real, Vec3},
};

/// A lens: what two balls of radius 1 share whose centres are 1.2 apart, along y. A shape of one's own needs no more.
#[derive(Debug)]
struct Lens {
    scale: Real,
}

impl Lens {
    /// Half the distance of the centres; the rim's radius is √(1 − 0.6²) = 0.8.
    const HALF: Real = 0.6;
    const RIM: Real = 0.8;
}

impl ConvexShape for Lens {
    fn support(&self, direction: Vec3) -> Vec3 {
        let d = direction.normalize_or_zero();
        let across = Vec3::new(d.x, 0.0, d.z);
        // The upper cap belongs to the lower ball; past the rim's normals the rim itself is farthest.
        let point = if d.y.abs() > Self::HALF {
            d - Vec3::Y * if d.y < 0.0 { -Self::HALF } else { Self::HALF }
        } else {
            across.normalize_or_zero() * Self::RIM
        };
        point * self.scale
    }

    fn center(&self) -> Vec3 {
        Vec3::ZERO
    }

    /// Each side is part of a ball.
    fn rounding_radius(&self) -> Real {
        self.scale
    }
}

/// One of each kind, about half a metre large.
fn kinds() -> Result<Vec<ShapeDefinition>, Error> {
    let block = Shape::cuboid(Vec3::new(0.25, 0.15, 0.2))?;
    let leaning = Mat3::from_cols(Vec3::X, Vec3::new(0.4, 0.9, -0.2), Vec3::Z * 0.8);
    let corners: Vec<Vec3> = (0..12)
        .map(|i| Vec3::new((i * 7 % 11) as Real, (i * 5 % 13) as Real, (i * 3 % 8) as Real) * 0.05 - Vec3::splat(0.25))
        .collect();
    let shapes = [
        Shape::sphere(0.3)?,
        Shape::capsule(0.25, 0.2)?,
        block.clone(),
        Shape::hull(&corners)?,
        Shape::cylinder(0.3, 0.25)?,
        Shape::cone(0.3, 0.3)?,
        Shape::tapered_capsule(0.25, 0.12, 0.2)?,
        Shape::point_cloud(&corners)?,
        Shape::rounded(&block, 0.06)?,
        Shape::rounded(&Shape::cylinder(0.1, 0.25)?, 0.05)?,
        Shape::ellipsoid(Vec3::new(0.35, 0.2, 0.25))?,
        Shape::cylinder(0.3, 0.25)?.transformed(leaning, Vec3::ZERO)?,
        Shape::custom(Lens { scale: 0.4 })?,
    ];
    Ok(shapes.map(|shape| plain(shape).rolling_resistance(0.1)).to_vec())
}

/// Every convex kind in turn, 8 × 8 a layer, over waves of 60 × 60 cells: whatever meets whatever, on a mesh.
pub(crate) fn shape_parade(options: &SceneOptions, size: usize) -> Result<BuiltScene, Error> {
    const SIDE: usize = 8;
    let mut scene = Builder::new(options, size)?;
    scene.mesh(wave(60, 60, 0.5, 0.4, [0.15, 0.12]))?;
    let kinds = kinds()?;
    let mut random = scene.random(17);
    for index in 0..scene.size {
        let (y, x, z) = (index / (SIDE * SIDE), index / SIDE % SIDE, index % SIDE);
        let position = Vec3::new(x as Real - 3.5, 1.5 + y as Real, z as Real - 3.5);
        let spin = random.in_cube(1.0);
        let body = BodyDefinition::dynamic().at(position).moving(Vec3::ZERO, spin * 3.0);
        scene.add(&body, &kinds[index % kinds.len()])?;
    }
    scene.finish(900)
}
