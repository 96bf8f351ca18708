//! What floats and what sinks.

use crate::builder::{Builder, Mixed, plain};
use crate::{BuiltScene, SceneOptions};
use arbiter3d::{
    BodyDefinition, Error, FluidDefinition, FluidVolume, Shape,
    math::{Real, Vec3},
};

/// Depth of the pool, metres.
const DEPTH: Real = 4.0;

/// Density of the body of an index, kg/m³.
fn density(index: usize) -> Real {
    200.0 + 100.0 * (index % 16) as Real
}

/// Bodies of sixteen densities on a grid above a pool whose water is at y = 0.
pub(crate) fn buoyancy_pool(options: &SceneOptions, size: usize) -> Result<BuiltScene, Error> {
    let mut scene = Builder::new(options, size)?;
    let side = (1..).find(|side| side * side >= size).unwrap_or(1);
    let half = 1.25 * side as Real + 0.5;
    let middle = Vec3::new(0.0, -0.5 * DEPTH, 0.0);
    scene.add(
        &BodyDefinition::fixed().at(Vec3::new(0.0, -DEPTH - 0.5, 0.0)),
        &plain(Shape::cuboid(Vec3::new(half + 1.0, 0.5, half + 1.0))?),
    )?;
    for (axis, across) in [(Vec3::X, Vec3::Z), (Vec3::Z, Vec3::X)] {
        let wall = plain(Shape::cuboid(across * (half + 1.0) + axis * 0.5 + Vec3::Y * (0.5 * DEPTH + 0.5))?);
        for sign in [1.0, -1.0] {
            scene.add(&BodyDefinition::fixed().at(middle + axis * (sign * (half + 0.5))), &wall)?;
        }
    }
    let mut random = scene.random(7);
    let mixed = Mixed::new(&mut random)?.resisting_to_roll();
    let mut scatter = scene.scatter(0.2);
    for index in 0..size {
        let (row, column) = (index / side, index % side);
        let place = |number: usize| 2.5 * (number as Real - 0.5 * (side as Real - 1.0));
        let at = Vec3::new(place(column), 1.0 + 0.2 * (index % 4) as Real, place(row)) + scatter();
        // Each kind comes in all densities: four kinds, and every fourth index another four densities.
        let shape = mixed.get(index + index / 16).clone().density(density(index));
        scene.drop(at, &shape)?;
    }
    let water =
        FluidDefinition { linear_drag: 1.0, ..FluidDefinition::pool(middle, Vec3::new(half, 0.5 * DEPTH, half)) };
    let mut water = FluidVolume::new(water)?;
    let dt = 1.0 / scene.hz;
    scene.finish_with(1200, Box::new(move |_, world| water.update(world, dt)))
}

#[cfg(test)]
mod tests {
    use crate::{SceneOptions, find};
    use arbiter3d::{BodyId, BodyKind};

    /// After 20 s what is lighter than water is at the top, what is heavier on the bottom.
    #[test]
    fn light_bodies_float_and_heavy_ones_sink() {
        let mut scene = find("buoyancy_pool").unwrap().build(&SceneOptions::default()).unwrap();
        for step in 0..1200 {
            scene.step(step).unwrap();
        }
        let world = &scene.world;
        let dynamic = |id: &BodyId| world.body(*id).unwrap().kind() == BodyKind::Dynamic;
        let bodies: Vec<BodyId> = world.bodies().filter(dynamic).collect();
        for (index, &id) in bodies.iter().enumerate() {
            let (density, height) = (super::density(index), world.body(id).unwrap().position().y);
            if density < 950.0 {
                assert!(height > -0.7 && height < 0.7, "{index}: {density} kg/m³ at {height}");
            } else if density > 1050.0 {
                assert!(height < -super::DEPTH + 1.2, "{index}: {density} kg/m³ at {height}");
            }
        }
        // All is quiet.
        let fast = bodies.iter().filter(|&&id| world.body(id).unwrap().linear_velocity().length() > 0.2).count();
        assert!(fast <= 3, "{fast} bodies still move");
    }
}
