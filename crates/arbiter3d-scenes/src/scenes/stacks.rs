//! Pyramids and towers: stacks that must stand.

use crate::builder::{Builder, cuboid};
use crate::turns::about;
use crate::{BuiltScene, SceneOptions};
use arbiter3d::{
    BodyDefinition, Error, Shape, ShapeDefinition,
    math::{Quat, Real, Rotation, Vec3},
};
use std::f32::consts::TAU;

/// Centres of an upright triangle of unit cubes that touch their neighbours, the bottom row centred at x = 0.
fn triangle(rows: usize) -> impl Iterator<Item = Vec3> {
    let cell = move |row: usize, column: usize| {
        let x = (row as Real + 1.0) * 0.5 + (column - row) as Real - 0.5 * rows as Real;
        Vec3::new(x, 0.5 * (2.0 * row as Real + 1.0), 0.0)
    };
    (0..rows).flat_map(move |row| (row..rows).map(move |column| cell(row, column)))
}

/// Box3D's `large_pyramid`: 100 rows, cubes of 100 kg, no sleeping.
pub(crate) fn large_pyramid(options: &SceneOptions, size: usize) -> Result<BuiltScene, Error> {
    let mut scene = Builder::sleepless(options, size)?;
    scene.ground(Vec3::new(400.0, 1.0, 400.0))?;
    let cube = cuboid(Vec3::splat(0.5))?.density(100.0);
    for position in triangle(scene.size) {
        scene.drop(position, &cube)?;
    }
    scene.finish(200)
}

/// Box3D's `many_pyramids`: 14 × 14 triangles of 10 rows, no sleeping.
pub(crate) fn many_pyramids(options: &SceneOptions, size: usize) -> Result<BuiltScene, Error> {
    const ROWS: usize = 10;
    let mut scene = Builder::sleepless(options, size)?;
    let side = scene.size;
    let extent = 0.5 * side as Real * (ROWS as Real + 1.0);
    scene.ground(Vec3::new(extent, 1.0, extent))?;
    let cube = cuboid(Vec3::splat(0.5))?.density(100.0);
    let pitch = 2.0 * (extent - 1.0) / (side.max(2) - 1) as Real;
    for row in 0..side {
        for column in 0..side {
            let center_x = -extent + column as Real * (ROWS as Real + 1.0) + 1.0;
            // `triangle` is centred; the published one starts half a cube left of its own centre.
            let corner = Vec3::new(center_x - 0.5 + 0.5 * ROWS as Real, 0.0, 1.0 - extent + row as Real * pitch);
            for position in triangle(ROWS) {
                scene.drop(corner + position, &cube)?;
            }
        }
    }
    scene.finish(100)
}

/// Jitter2's `Pyramid(n)`: unit boxes a hundredth apart, friction as the engine has it.
pub(crate) fn gapped_pyramid(options: &SceneOptions, size: usize) -> Result<BuiltScene, Error> {
    let mut scene = Builder::new(options, size)?;
    scene.ground(Vec3::splat(100.0))?;
    let cube = cuboid(Vec3::splat(0.5))?;
    let rows = scene.size;
    for row in 0..rows {
        for column in row..rows {
            let x = (column as Real - 0.5 * row as Real) * 1.01;
            scene.drop(Vec3::new(x, 0.5 + row as Real, 0.0), &cube)?;
        }
    }
    scene.finish(600)
}

/// Jolt's `Pyramid`: boxes of 2 m a quarter of their height above each other, friction 0.2, no sleeping.
pub(crate) fn jolt_pyramid(options: &SceneOptions, size: usize) -> Result<BuiltScene, Error> {
    let mut scene = Builder::sleepless(options, size)?;
    let half_extents = Vec3::new(50.0, 1.0, 50.0);
    let ground = cuboid(half_extents)?.friction(0.2);
    scene.add(&BodyDefinition::fixed().at(Vec3::new(0.0, -1.0, 0.0)), &ground)?;
    square_pyramid(&mut scene, &cuboid(Vec3::ONE)?.friction(0.2))?;
    scene.finish(500)
}

/// Box3D's wide pyramid: as Jolt's, with boxes a little smaller than their cells.
pub(crate) fn wide_pyramid(options: &SceneOptions, size: usize) -> Result<BuiltScene, Error> {
    let mut scene = Builder::new(options, size)?;
    scene.ground(Vec3::new(100.0, 1.0, 100.0))?;
    square_pyramid(&mut scene, &cuboid(Vec3::splat(0.975))?)?;
    scene.finish(500)
}

/// Layers of n × n, (n−1) × (n−1), … boxes on cells of 2 m, each layer 2.5 m above the last, odd layers shifted by 1 m.
fn square_pyramid(scene: &mut Builder, cube: &ShapeDefinition) -> Result<(), Error> {
    let layers = scene.size;
    for layer in 0..layers {
        let shift = if layer % 2 == 1 { 1.0 } else { 0.0 };
        let place = |cell: usize| 2.0 * cell as Real - layers as Real + shift;
        let cells = layer / 2..layers - layer.div_ceil(2);
        for j in cells.clone() {
            for k in cells.clone() {
                scene.drop(Vec3::new(place(j), 1.0 + 2.5 * layer as Real, place(k)), cube)?;
            }
        }
    }
    Ok(())
}

/// Jitter2's `Tower(n)`: rings of 32 planks of 3 × 1 × 0.5 m at radius 19.5, each ring turned by half a plank.
pub(crate) fn tower(options: &SceneOptions, size: usize) -> Result<BuiltScene, Error> {
    const PLANKS: usize = 32;
    let mut scene = Builder::new(options, size)?;
    scene.ground(Vec3::splat(100.0))?;
    let plank = ShapeDefinition::new(Shape::cuboid(Vec3::new(1.5, 0.5, 0.25))?);
    for ring in 0..scene.size {
        for index in 0..PLANKS {
            let turns = ((ring + 1) as Real * 0.5 + (index + 1) as Real) / PLANKS as Real;
            let rotation: Quat = about(Vec3::Y, TAU * turns);
            let position = Rotation::from_quat(rotation).rotate(Vec3::new(0.0, 0.5 + ring as Real, 19.5));
            scene.add(&BodyDefinition::dynamic().at(position).rotated(rotation), &plank)?;
        }
    }
    scene.finish(600)
}
