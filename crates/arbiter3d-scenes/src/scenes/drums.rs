//! Bodies that are kept moving by a turning container.

use crate::builder::{Builder, cuboid, plain};
use crate::turns::sin_cos;
use crate::{BuiltScene, SceneOptions};
use arbiter3d::{
    BodyDefinition, Error, Shape, ShapeDefinition,
    math::{Real, Vec3},
};
use std::f32::consts::PI;

/// Box3D's `washer`: small cubes in a drum of 36 wedges and four paddles that turns at 25° a second.
pub(crate) fn washer(options: &SceneOptions, size: usize) -> Result<BuiltScene, Error> {
    let mut scene = Builder::new(options, size)?;
    scene.ground(Vec3::new(60.0, 1.0, 60.0))?;
    let spin = Vec3::new(0.0, 0.0, 25.0_f32.to_radians());
    let drum = BodyDefinition::kinematic().at(Vec3::new(0.0, 21.0, 0.0)).moving(Vec3::new(0.001, -0.002, 0.0), spin);
    let drum = scene.world.add_body(&drum)?;
    for wedge in drum_hulls()? {
        scene.world.add_shape(drum, &wedge)?;
    }
    let half = 0.2;
    let cube = cuboid(Vec3::splat(half))?;
    let count = scene.size;
    let corner = -2.0 * half * count as Real;
    for i in 0..count {
        for j in 0..count {
            for k in 0..count {
                let cell = Vec3::new(i as Real, j as Real, k as Real) * (4.0 * half) + Vec3::splat(corner);
                scene.drop(cell + Vec3::new(0.0, 21.0, 0.0), &cube)?;
            }
        }
    }
    scene.finish(1000)
}

/// Wedges of 10° widened by 1° to both sides so that none leaks, and a paddle on every ninth.
fn drum_hulls() -> Result<Vec<ShapeDefinition>, Error> {
    const WEDGES: usize = 36;
    const INNER: Real = 16.0;
    const OUTER: Real = 18.0;
    const PADDLE: Real = 14.0;
    let step = PI / 18.0;
    let mut hulls = Vec::with_capacity(WEDGES + 4);
    for index in 0..WEDGES {
        let (from, to) = (step * index as Real, step * (index + 1) as Real);
        hulls.push(wedge([from - 0.1 * step, to + 0.1 * step], [INNER, OUTER])?);
        if index % 9 == 0 {
            hulls.push(wedge([from, to], [PADDLE, INNER])?);
        }
    }
    Ok(hulls)
}

/// A prism along z over a ring segment between two angles and two radii.
fn wedge(angles: [Real; 2], radii: [Real; 2]) -> Result<ShapeDefinition, Error> {
    let mut points = Vec::with_capacity(8);
    for z in [-10.0, 10.0] {
        for angle in angles {
            let (s, c) = sin_cos(angle);
            points.extend(radii.map(|radius| Vec3::new(radius * c, radius * s, z)));
        }
    }
    Ok(plain(Shape::hull(&points)?))
}

/// Jitter2's `RotatingCube`: boxes of 1.5 m on a grid inside six plates of 50 m that turn together.
pub(crate) fn rotating_cube(options: &SceneOptions, size: usize) -> Result<BuiltScene, Error> {
    const HALF_WIDTH: Real = 25.0;
    let mut scene = Builder::new(options, size)?;
    let turning = BodyDefinition::kinematic().moving(Vec3::ZERO, Vec3::new(0.14, 0.02, 0.03));
    let container = scene.world.add_body(&turning)?;
    for axis in [Vec3::Y, Vec3::X, Vec3::Z] {
        // A plate is thin along its axis and as wide as the cube along the others.
        let plate = cuboid(Vec3::splat(HALF_WIDTH) + axis * (0.5 - HALF_WIDTH))?;
        scene.world.add_shape(container, &plate.clone().at(axis * HALF_WIDTH))?;
        scene.world.add_shape(container, &plate.at(axis * -HALF_WIDTH))?;
    }
    let cube = cuboid(Vec3::splat(0.75))?;
    let count = scene.size;
    let place = |index: usize| 2.0 * (index as Real - (count / 2) as Real);
    for i in 0..count {
        for j in 0..count {
            for k in 0..count {
                scene.drop(Vec3::new(place(i), place(j), place(k)), &cube)?;
            }
        }
    }
    scene.finish(200)
}
