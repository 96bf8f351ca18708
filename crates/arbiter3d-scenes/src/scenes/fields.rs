//! Many bodies of which few do anything.

use crate::builder::{Builder, cuboid, plain};
use crate::{BuiltScene, SceneOptions};
use arbiter3d::{
    BodyDefinition, Error, Shape, ShapeDefinition, World,
    math::{Real, Vec3},
};

/// Box3D's `large_world`: 1,000 × 1,000 static slabs of 10 m; every fifth step a ball drops somewhere else.
pub(crate) fn large_world(options: &SceneOptions, size: usize) -> Result<BuiltScene, Error> {
    let mut scene = Builder::new(options, size)?;
    let slab = cuboid(Vec3::new(5.0, 0.25, 5.0))?;
    let half_width = 5.0 * scene.size as Real;
    let place = |index: usize| -half_width + 10.0 * (index as Real + 0.5);
    for i in 0..scene.size {
        for j in 0..scene.size {
            scene.add(&BodyDefinition::fixed().at(Vec3::new(place(i), 0.0, place(j))), &slab)?;
        }
    }
    let ball = plain(Shape::sphere(0.5)?);
    let hook = move |step: usize, world: &mut World| {
        if step > 0 && step.is_multiple_of(5) { drop_ball(world, &ball, step / 5 - 1, half_width) } else { Ok(()) }
    };
    scene.finish_with(500, Box::new(hook))
}

/// Drops ball `index` at its place in a 10 × 10 pattern over the inner four fifths of the plain.
fn drop_ball(world: &mut World, ball: &ShapeDefinition, index: usize, half_width: Real) -> Result<(), Error> {
    if index >= 100 {
        return Ok(());
    }
    let place = |cell: usize| half_width * (-0.8 + 0.16 * (cell as Real + 0.5));
    let position = Vec3::new(place(index % 10), 1.5, place(index / 10));
    let body = world.add_body(&BodyDefinition::dynamic().at(position))?;
    world.add_shape(body, ball)?;
    Ok(())
}

/// Boxes that sleep from the start, 2 m apart, and beside them 100 balls that bounce for ever.
pub(crate) fn sleeping_field(options: &SceneOptions, size: usize) -> Result<BuiltScene, Error> {
    const AWAKE_SIDE: usize = 10;
    let mut scene = Builder::new(options, size)?;
    let half_width = sleepers(&mut scene)?;
    let ball = plain(Shape::sphere(0.5)?).restitution(1.0);
    for index in 0..AWAKE_SIDE * AWAKE_SIDE {
        let (i, j) = (index / AWAKE_SIDE, index % AWAKE_SIDE);
        let position = Vec3::new(half_width + 10.0 + 4.0 * i as Real, 3.0 + 0.1 * j as Real, 4.0 * j as Real);
        scene.add(&BodyDefinition { can_sleep: false, ..BodyDefinition::dynamic().at(position) }, &ball)?;
    }
    scene.finish(500)
}

/// Nothing but boxes that sleep from the start: what an idle world costs.
pub(crate) fn sleeping_all(options: &SceneOptions, size: usize) -> Result<BuiltScene, Error> {
    let mut scene = Builder::new(options, size)?;
    sleepers(&mut scene)?;
    scene.finish(500)
}

/// Adds ground, wider than the boxes by 60 m, and the sleeping boxes in a square; returns half the width of that.
fn sleepers(scene: &mut Builder) -> Result<Real, Error> {
    const SPACING: Real = 2.0;
    let count = scene.size;
    let side = (count as Real).sqrt() as usize + 1;
    let half_width = 0.5 * SPACING * side as Real;
    scene.ground(Vec3::new(half_width + 60.0, 1.0, half_width + 60.0))?;
    let cube = cuboid(Vec3::splat(0.5))?;
    for index in 0..count {
        let (i, j) = (index / side, index % side);
        let position = Vec3::new(SPACING * i as Real - half_width, 0.5, SPACING * j as Real - half_width);
        scene.add(&BodyDefinition { awake: false, ..BodyDefinition::dynamic().at(position) }, &cube)?;
    }
    Ok(half_width)
}
