//! Box3D's `trees100`, `trees50` and `trees25`: falling trees of many hulls on a wave mesh of ever smaller triangles.

use crate::builder::{Builder, plain};
use crate::meshes::{prism, wave};
use crate::{BuiltScene, SceneOptions};
use arbiter3d::{
    BodyDefinition, Error, Shape, ShapeDefinition, WorldSettings,
    math::{Real, Vec3},
};

/// Cells of 1 m.
pub(crate) fn trees100(options: &SceneOptions, size: usize) -> Result<BuiltScene, Error> {
    trees(options, size, 1)
}

/// Cells of half a metre.
pub(crate) fn trees50(options: &SceneOptions, size: usize) -> Result<BuiltScene, Error> {
    trees(options, size, 2)
}

/// Cells of a quarter of a metre.
pub(crate) fn trees25(options: &SceneOptions, size: usize) -> Result<BuiltScene, Error> {
    trees(options, size, 4)
}

fn trees(options: &SceneOptions, size: usize, scale: usize) -> Result<BuiltScene, Error> {
    // The published scene sets a sleep threshold of 0.2 m/s on each tree.
    let mut scene =
        Builder::with_settings(options, size, WorldSettings { sleep_speed: 0.2, ..WorldSettings::default() })?;
    scene.mesh(wave(150 * scale, 200 * scale, 1.0 / scale as Real, 0.4, [0.1, 0.05]))?;
    let trunk = trunk()?;
    for index in 0..scene.size {
        let position = Vec3::new(0.0, 1.0, -70.0 + 3.0 * index as Real);
        let body = scene.world.add_body(&BodyDefinition::dynamic().at(position))?;
        for piece in &trunk {
            scene.world.add_shape(body, piece)?;
        }
        // The tree turns about its foot, alternately to both sides, the later ones faster.
        let sign = if index % 2 == 0 { -1.0 } else { 1.0 };
        let spin = Vec3::new(0.0, 0.0, sign * 0.5 * (0.5 + 0.5 * index as Real / 50.0));
        let arm = scene.world.body(body).map_or(Vec3::ZERO, |tree| tree.center_of_mass() - position);
        if let Some(mut tree) = scene.world.body_mut(body) {
            tree.set_linear_velocity(spin.cross(arm))?;
            tree.set_angular_velocity(spin)?;
        }
    }
    scene.finish(500)
}

/// The 22 six-sided prisms of a tree, each a little thinner than the one below and sunk into it by its radius.
fn trunk() -> Result<Vec<ShapeDefinition>, Error> {
    let (mut radius, mut y) = (0.75, 1.0);
    let mut pieces = Vec::with_capacity(22);
    for _ in 0..22 {
        let height = 1.5 + 2.0 * radius;
        let hull = Shape::hull(&prism(6, radius, y - radius, y - radius + height))?;
        pieces.push(plain(hull).density(1.0).friction(0.9).rolling_resistance(0.05));
        y += height;
        radius *= 0.95;
    }
    Ok(pieces)
}
