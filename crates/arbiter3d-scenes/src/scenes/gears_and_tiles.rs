//! Meshes that move, and ground made of tiles.

use crate::builder::{Builder, Mixed, plain};
use crate::turns::{about, sin_cos};
use crate::{BuiltScene, SceneOptions, meshes};
use arbiter3d::{
    BodyDefinition, BodyId, Error, LockedAxes, Shape, ShapeDefinition, WorldSettings,
    math::{Real, Vec3},
};
use std::f32::consts::PI;

/// Two gears with involute teeth, 12 and 24, on two shafts: the small one is driven at 2 rad/s, the large one turns half as
/// fast the other way.
pub(crate) fn gears(options: &SceneOptions, size: usize) -> Result<BuiltScene, Error> {
    const MODULE: Real = 0.1;
    let settings = WorldSettings { gravity: Vec3::ZERO, allow_sleep: false, ..WorldSettings::default() };
    let mut scene = Builder::with_settings(options, size, settings)?;
    let gear = |teeth: usize, half_width: Real| -> Result<ShapeDefinition, Error> {
        let (corners, triangles) = meshes::gear(teeth, MODULE, half_width);
        Ok(ShapeDefinition::new(Shape::mesh(corners, triangles)?).friction(0.1))
    };
    let driver = BodyDefinition::kinematic().moving(Vec3::ZERO, Vec3::Z * 2.0);
    scene.add(&driver, &gear(12, 0.12)?)?;
    // The distance of the pitch circles; a gap of the large gear meets the tooth of the small one on the line between them.
    let place = Vec3::new(0.5 * MODULE * 36.0, 0.0, 0.0);
    let driven = BodyDefinition {
        locked_axes: LockedAxes::TRANSLATION | LockedAxes::ROTATION_X | LockedAxes::ROTATION_Y,
        angular_damping: 0.2,
        ..BodyDefinition::dynamic().at(place).rotated(about(Vec3::Z, PI / 24.0))
    };
    scene.add(&driven, &gear(24, 0.1)?)?;
    scene.finish(300)
}

/// 3 × 3 height fields of 16 m side by side, 200 bodies that fall on them.
pub(crate) fn height_field_tiles(options: &SceneOptions, size: usize) -> Result<BuiltScene, Error> {
    const CELLS: usize = 32;
    const CELL: Real = 0.5;
    let mut scene = Builder::new(options, size)?;
    let width = CELLS as Real * CELL;
    let wave = |x: Real, z: Real| 0.8 * sin_cos(0.4 * x).0 * sin_cos(0.3 * z).0;
    for tile in 0..9 {
        let (x, z) = (width * ((tile % 3) as Real - 1.5), width * ((tile / 3) as Real - 1.5));
        let at = |i: usize| (x + CELL * (i % (CELLS + 1)) as Real, z + CELL * (i / (CELLS + 1)) as Real);
        let heights = (0..(CELLS + 1) * (CELLS + 1)).map(|i| wave(at(i).0, at(i).1)).collect();
        let field = plain(Shape::height_field(heights, CELLS + 1, [CELL; 2])?);
        scene.world.add_shape(BodyId::WORLD, &field.at(Vec3::new(x, 0.0, z)))?;
    }
    let mut random = scene.random(1);
    let kinds = Mixed::new(&mut random)?.resisting_to_roll();
    for index in 0..scene.size {
        let place = |k: usize| 1.3 * (k as Real - 7.0);
        let height = 2.0 + 0.01 * index as Real;
        scene.drop(Vec3::new(place(index % 15), height, place(index / 15 % 15)), kinds.get(index))?;
    }
    scene.finish(600)
}
