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

/// Sixteen bodies slide without friction at 4 m/s, each its own way, over a floor of 1,024 separate boxes; every other one is
/// a ball.
pub(crate) fn box_floor_slide(options: &SceneOptions, size: usize) -> Result<BuiltScene, Error> {
    const HALF: i32 = 16;
    const BODIES: usize = 16;
    let mut scene = Builder::sleepless(options, size)?;
    let smooth = |shape: Shape| ShapeDefinition::new(shape).friction(0.0).rolling_resistance(0.0);
    let tile = smooth(Shape::cuboid(Vec3::new(0.75, 0.5, 0.75))?);
    for at in (-HALF..HALF).flat_map(|x| (-HALF..HALF).map(move |z| (x, z))) {
        let position = Vec3::new(1.5 * (at.0 as Real + 0.5), -0.5, 1.5 * (at.1 as Real + 0.5));
        scene.add(&BodyDefinition::fixed().at(position), &tile)?;
    }
    let shapes = [smooth(Shape::cuboid(Vec3::new(0.3, 0.25, 0.4))?), smooth(Shape::sphere(0.25)?)];
    for index in 0..BODIES {
        let turn = about(Vec3::Y, (index as Real + 0.3) * 2.0 * std::f32::consts::PI / BODIES as Real);
        let along = turn * Vec3::X;
        let body = BodyDefinition::dynamic().at(along * 3.0 + Vec3::Y * 0.25).rotated(turn);
        scene.add(&body.moving(along * 4.0, Vec3::ZERO), &shapes[index % 2])?;
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
