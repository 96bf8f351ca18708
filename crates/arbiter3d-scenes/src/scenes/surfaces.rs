//! Surfaces that do something: platforms to be passed one way, belts, and skids.

use crate::builder::{Builder, Mixed};
use crate::turns::{about, then};
use crate::{BuiltScene, SceneOptions};
use arbiter3d::{
    BodyDefinition, Error, Shape, ShapeDefinition,
    math::{Real, Rotation, Vec3},
};

/// Platforms in a column of [`one_way_platforms`].
const FLOORS: usize = 5;
/// From one to the next, metres.
const STOREY: Real = 3.0;

/// Columns of five one-way platforms. A body is thrown up through each and comes to stand on the next higher floor than
/// its left neighbour; beside them a lift rises through what lies on the ground and carries what stands on it.
pub(crate) fn one_way_platforms(options: &SceneOptions, size: usize) -> Result<BuiltScene, Error> {
    let mut scene = Builder::sleepless(options, size)?;
    scene.ground(Vec3::new(10.0 + 2.0 * size as Real, 1.0, 10.0))?;
    let mixed = Mixed::new(&mut scene.random(7))?.resisting_to_roll();
    let slab = ShapeDefinition::new(Shape::cuboid(Vec3::new(1.4, 0.1, 1.4))?).friction(1.0).one_way(Vec3::Y);
    for column in 0..size {
        let x = 3.0 * (column as Real - 0.5 * (size as Real - 1.0));
        for floor in 1..=FLOORS {
            let body = BodyDefinition::fixed().at(Vec3::new(x, STOREY * floor as Real - 0.1, 0.0));
            scene.add(&body, &slab)?;
        }
        // Its middle comes 1.3 m above the floor that it is to stand on.
        let rise = STOREY * (1 + column % FLOORS) as Real + 1.3 - 0.6;
        let thrown = BodyDefinition::dynamic().at(Vec3::new(x, 0.6, 0.0));
        scene.add(&thrown.moving(Vec3::Y * (2.0 * 9.81 * rise).sqrt(), Vec3::ZERO), mixed.get(column))?;
    }
    let lift = Vec3::new(0.0, -0.5, 5.0);
    scene.add(&BodyDefinition::kinematic().at(lift).moving(Vec3::Y, Vec3::ZERO), &slab)?;
    let cube = ShapeDefinition::new(Shape::cuboid(Vec3::splat(0.4))?);
    scene.drop(lift + Vec3::new(-0.7, 1.5, 0.0), &cube)?;
    scene.finish(360)
}

/// Half a side of the ring of belts of [`conveyors`].
const RING: Real = 4.0;

/// Eight boxes go round on a ring of four belts at 2 m/s, and seven skids with a tenth of the friction along their own
/// axis lie on a slope of 30°, each turned by 15° more: the first runs straight down, the last sticks.
pub(crate) fn conveyors(options: &SceneOptions, size: usize) -> Result<BuiltScene, Error> {
    let mut scene = Builder::sleepless(options, size)?;
    scene.ground(Vec3::new(60.0, 1.0, 60.0))?;
    let belt = ShapeDefinition::new(Shape::cuboid(Vec3::new(RING, 0.5, 1.0))?).tangent_velocity(Vec3::X * 2.0);
    let cube = ShapeDefinition::new(Shape::cuboid(Vec3::splat(0.25))?);
    for side in 0..4 {
        let turn = about(Vec3::Y, -std::f32::consts::FRAC_PI_2 * side as Real);
        let rotation = Rotation::from_quat(turn);
        // Each belt ends where it meets the side of the next one.
        let place = rotation.rotate(Vec3::new(-1.0, 0.5, -RING));
        scene.add(&BodyDefinition::fixed().at(place).rotated(turn), &belt)?;
        for x in [-3.0, 0.0] {
            scene.drop(rotation.rotate(Vec3::new(x, 1.25, -RING)), &cube)?;
        }
    }
    let slope = about(Vec3::Z, -30.0_f32.to_radians());
    let tilt = Rotation::from_quat(slope);
    let (foot, normal) = (Vec3::new(0.0, 20.0, -25.0), tilt.rotate(Vec3::Y));
    let ramp = ShapeDefinition::new(Shape::cuboid(Vec3::new(30.0, 1.0, 15.0))?).friction(0.8);
    scene.add(&BodyDefinition::fixed().at(foot - normal).rotated(slope), &ramp)?;
    let skid = ShapeDefinition::new(Shape::cuboid(Vec3::new(0.6, 0.1, 0.3))?).friction(0.8).anisotropy(Vec3::X, 0.1);
    for index in 0..=6 {
        let turn = then(about(Vec3::Y, (15.0 * index as Real).to_radians()), slope);
        let place = foot + normal * 0.1 + tilt.rotate(Vec3::new(-20.0, 0.0, 3.5 * (index as Real - 3.0)));
        scene.add(&BodyDefinition::dynamic().at(place).rotated(turn), &skid)?;
    }
    scene.finish(600)
}
