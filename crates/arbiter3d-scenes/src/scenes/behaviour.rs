//! Small scenes whose outcome a formula gives.

use crate::builder::Builder;
use crate::turns::about;
use crate::{BuiltScene, SceneOptions};
use arbiter3d::{
    BodyDefinition, Error, Shape, ShapeDefinition, WorldSettings,
    math::{Real, Rotation, Vec3},
};

/// Eleven boxes with friction 0, 0.1, … 1 on a frictionless slope of 30° (whose tangent is 0.577).
pub(crate) fn ramps(options: &SceneOptions, size: usize) -> Result<BuiltScene, Error> {
    let mut scene = Builder::new(options, size)?;
    let turn = about(Vec3::Z, -30.0_f32.to_radians());
    let (along, normal) = {
        let rotation = Rotation::from_quat(turn);
        (rotation.rotate(Vec3::X), rotation.rotate(Vec3::Y))
    };
    // The slope's surface goes through the origin; friction is the maximum of both sides, so the boxes' own counts.
    let slope = ShapeDefinition::new(Shape::cuboid(Vec3::new(100.0, 1.0, 20.0))?).friction(0.0);
    scene.add(&BodyDefinition::fixed().at(-normal).rotated(turn), &slope)?;
    let cube = Shape::cuboid(Vec3::splat(0.5))?;
    for index in 0..=10 {
        let position = along * -50.0 + normal * 0.5 + Vec3::new(0.0, 0.0, 2.5 * (index as Real - 5.0));
        let definition = ShapeDefinition::new(cube.clone()).friction(0.1 * index as Real);
        scene.add(&BodyDefinition::dynamic().at(position).rotated(turn), &definition)?;
    }
    scene.finish(240)
}

/// Eleven balls with restitution 0, 0.1, … 1 fall 5 m: each rises to the square of its restitution times 5 m.
pub(crate) fn bounce(options: &SceneOptions, size: usize) -> Result<BuiltScene, Error> {
    const RADIUS: Real = 0.5;
    let mut scene = Builder::new(options, size)?;
    let slab = ShapeDefinition::new(Shape::cuboid(Vec3::new(30.0, 1.0, 10.0))?);
    scene.add(&BodyDefinition::fixed().at(-Vec3::Y), &slab)?;
    for index in 0..=10 {
        let position = Vec3::new(3.0 * (index as Real - 5.0), 5.0 + RADIUS, 0.0);
        let ball = ShapeDefinition::new(Shape::sphere(RADIUS)?).restitution(0.1 * index as Real);
        scene.drop(position, &ball)?;
    }
    scene.finish(600)
}

/// PEEL's T-handle: two boxes of together 0.1 kg spin about the axis of middle inertia, which is unstable.
pub(crate) fn t_handle(options: &SceneOptions, size: usize) -> Result<BuiltScene, Error> {
    let weightless = WorldSettings { gravity: Vec3::ZERO, ..WorldSettings::default() };
    let mut scene = Builder::with_settings(options, size, weightless)?;
    // 0.1 kg over 0.01 + 0.002 m³.
    let density = 0.1 / 0.012;
    let spin = Vec3::new(7.5, 5.025, 0.0);
    let body = scene.world.add_body(&BodyDefinition::dynamic().moving(Vec3::ZERO, spin))?;
    let bar = ShapeDefinition::new(Shape::cuboid(Vec3::new(0.05, 0.5, 0.05))?).density(density);
    let stem = ShapeDefinition::new(Shape::cuboid(Vec3::new(0.1, 0.05, 0.05))?).density(density);
    scene.world.add_shape(body, &bar)?;
    scene.world.add_shape(body, &stem.at(Vec3::new(0.1, 0.0, 0.0)))?;
    let steps = (20.0 * scene.hz + 0.5) as usize;
    scene.finish(steps)
}
