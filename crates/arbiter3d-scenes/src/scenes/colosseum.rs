//! Jitter2's colosseum: stacked rings of stones, 8,817 of them with six layers.
//!
//! Layer `l` has `L − l` rings of radius `15 + 3.5 r + 2.5 l`. A ring is two walls 1.25 m to both sides of that radius, each
//! three courses high with every other course shifted by half a stone, under a platform of stones laid flat; the next
//! layer stands 3.5 m higher.

use crate::builder::{Builder, cuboid};
use crate::turns::{about, sin_cos, then};
use crate::{BuiltScene, SceneOptions};
use arbiter3d::{
    BodyDefinition, Error, Shape, ShapeDefinition, World,
    math::{Real, Vec3},
};
use std::f32::consts::{FRAC_PI_2, PI};

/// Size of a stone, metres.
const STONE: Vec3 = Vec3::new(0.5, 1.0, 3.0);
/// Courses of a wall.
const COURSES: usize = 3;
/// Radius of the innermost ring, metres.
const INNER_RADIUS: Real = 15.0;
/// From one ring to the next, metres.
const RING_PITCH: Real = STONE.z + 0.5;

/// The colosseum alone, without sleeping.
pub(crate) fn colosseum(options: &SceneOptions, size: usize) -> Result<BuiltScene, Error> {
    let mut scene = Builder::sleepless(options, size)?;
    build(&mut scene)?;
    scene.finish(100)
}

/// The colosseum stands for 2 s; then a ball of 5 m radius and 200 t comes at 40 m/s.
pub(crate) fn colosseum_break(options: &SceneOptions, size: usize) -> Result<BuiltScene, Error> {
    let mut scene = Builder::new(options, size)?;
    build(&mut scene)?;
    let steps_before = (2.0 * scene.hz + 0.5) as usize;
    let steps = (10.0 * scene.hz + 0.5) as usize;
    let outer_radius = INNER_RADIUS + RING_PITCH * (scene.size - 1) as Real + STONE.z;
    let throw = move |step: usize, world: &mut World| {
        if step == steps_before { throw_ball(world, outer_radius) } else { Ok(()) }
    };
    scene.finish_with(steps, Box::new(throw))
}

/// Adds the ball one metre outside the outermost ring, flying inward.
fn throw_ball(world: &mut World, outer_radius: Real) -> Result<(), Error> {
    const RADIUS: Real = 5.0;
    const MASS: Real = 200_000.0;
    let density = MASS / (4.0 / 3.0 * PI * RADIUS * RADIUS * RADIUS);
    let start = Vec3::new(-(outer_radius + RADIUS + 1.0), 9.0, 0.0);
    let ball = world.add_body(&BodyDefinition::dynamic().at(start).moving(Vec3::new(40.0, 0.0, 0.0), Vec3::ZERO))?;
    world.add_shape(ball, &ShapeDefinition::new(Shape::sphere(RADIUS)?).density(density).friction(0.6))?;
    Ok(())
}

fn build(scene: &mut Builder) -> Result<(), Error> {
    scene.ground(Vec3::splat(100.0))?;
    let stone = cuboid(STONE * 0.5)?;
    for layer in 0..scene.size {
        let base = layer as Real * (COURSES as Real * STONE.y + STONE.x);
        for ring in 0..scene.size - layer {
            let radius = INNER_RADIUS + ring as Real * RING_PITCH + layer as Real * (STONE.z - STONE.x);
            let offset = 0.5 * STONE.z - 0.5 * STONE.x;
            wall(scene, &stone, radius + offset, base)?;
            wall(scene, &stone, radius - offset, base)?;
            platform(scene, &stone, radius, base + COURSES as Real * STONE.y)?;
        }
    }
    Ok(())
}

/// Three courses of standing stones that leave a tenth of the circle open.
fn wall(scene: &mut Builder, stone: &ShapeDefinition, radius: Real, base: Real) -> Result<(), Error> {
    let count = (0.9 * 2.0 * PI * radius / STONE.z) as usize;
    let step = 2.0 * PI / count as Real;
    for course in 0..COURSES {
        let shift = if course % 2 == 0 { 0.5 } else { 0.0 };
        for index in 0..count {
            let angle = (index as Real + shift) * step;
            let position = on_circle(angle, radius, base + (course as Real + 0.5) * STONE.y);
            scene.add(&BodyDefinition::dynamic().at(position).rotated(about(Vec3::Y, angle)), stone)?;
        }
    }
    Ok(())
}

/// A ring of stones laid flat across both walls.
fn platform(scene: &mut Builder, stone: &ShapeDefinition, radius: Real, base: Real) -> Result<(), Error> {
    let count = (0.95 * 2.0 * PI * (radius - 0.5 * STONE.z) / STONE.y) as usize;
    let step = 2.0 * PI / count as Real;
    let flat = about(Vec3::Z, FRAC_PI_2);
    for index in 0..count {
        let angle = index as Real * step;
        let rotation = then(flat, about(Vec3::Y, angle + FRAC_PI_2));
        let position = on_circle(angle, radius, base + 0.5 * STONE.x);
        scene.add(&BodyDefinition::dynamic().at(position).rotated(rotation), stone)?;
    }
    Ok(())
}

fn on_circle(angle: Real, radius: Real, height: Real) -> Vec3 {
    let (s, c) = sin_cos(angle);
    Vec3::new(-c * radius, height, s * radius)
}
