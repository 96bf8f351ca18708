//! Vehicles, fluids and characters allocate nothing from step to step: every allocation of the process is counted.
//!
//! A binary of its own, since the counter sees all threads: one test, so that nothing else runs beside it.

#[path = "common/counting.rs"]
mod counting;

use arbiter3d::math::{Quat, Vec3};
use arbiter3d::*;
use counting::allocations;

#[test]
fn vehicles_fluids_and_characters_allocate_nothing_in_steady_steps() {
    const DT: f32 = 1.0 / 60.0;
    let mut world = World::new(WorldSettings { allow_sleep: false, ..WorldSettings::default() }).unwrap();
    let floor = ShapeDefinition::new(Shape::cuboid(Vec3::new(500.0, 1.0, 500.0)).unwrap());
    world.add_shape(BodyId::WORLD, &floor.at(Vec3::new(0.0, -1.0, 0.0))).unwrap();
    let chassis = world.add_body(&BodyDefinition::dynamic().at(Vec3::new(50.0, 1.0, 0.0))).unwrap();
    let hull = Shape::cuboid(Vec3::new(0.8, 0.3, 2.0)).unwrap();
    world.add_shape(chassis, &ShapeDefinition::new(hull).density(300.0)).unwrap();
    let mut definition = VehicleDefinition::car(0.8, 1.4, -0.1);
    definition.anti_roll_bars.push(AntiRollBar { left: 0, right: 1, stiffness: 1e4 });
    let mut car = Vehicle::new(&world, chassis, &definition).unwrap();
    let controls = VehicleControls { throttle: 0.5, steering: 0.1, ..VehicleControls::default() };
    car.set_controls(controls).unwrap();

    let points = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z, Vec3::ONE];
    let shapes = [
        Shape::sphere(0.5).unwrap(),
        Shape::capsule(0.5, 0.3).unwrap(),
        Shape::cuboid(Vec3::new(0.6, 0.2, 0.4)).unwrap(),
        Shape::hull(&points).unwrap(),
    ];
    for (index, shape) in shapes.into_iter().enumerate() {
        let at = Vec3::new(2.5 * index as f32, 3.5, 0.0);
        let body = world.add_body(&BodyDefinition::dynamic().at(at)).unwrap();
        world.add_shape(body, &ShapeDefinition::new(shape).density(600.0)).unwrap();
    }
    let pool = FluidDefinition::pool(Vec3::new(0.0, 1.5, 0.0), Vec3::new(8.0, 1.5, 8.0));
    let mut pool = FluidVolume::new(pool).unwrap();

    let mut hero = character_among_obstacles(&mut world);
    let mut step = 0;
    let mut run = |steps: usize| {
        let before = allocations();
        for _ in 0..steps {
            // Round a square of 4 m, against what stands there, with a jump at each corner.
            let [x, z] = [[3.0, 0.0], [0.0, 3.0], [-3.0, 0.0], [0.0, -3.0]][step / 80 % 4];
            if step % 80 == 0 {
                hero.jump(3.0).unwrap();
            }
            step += 1;
            hero.update(&mut world, Vec3::new(x, 0.0, z), DT).unwrap();
            car.update(&mut world, DT).unwrap();
            pool.update(&mut world, DT).unwrap();
            world.step(DT).unwrap();
        }
        allocations() - before
    };
    run(640);
    assert_eq!(run(640), 0);
}

/// A character with a stair, a wall, a steep slope and a light box around it, on a turntable.
fn character_among_obstacles(world: &mut World) -> CharacterController {
    let at = Vec3::new(-60.0, 0.0, 0.0);
    let mut stand = |half: Vec3, position: Vec3, turn: f32| {
        let turn = Quat::from_xyzw(0.0, 0.0, (1.0 - turn * turn).sqrt(), turn);
        let block = ShapeDefinition::new(Shape::cuboid(half).unwrap()).at(at + position).rotated(turn);
        world.add_shape(BodyId::WORLD, &block).unwrap();
    };
    stand(Vec3::new(0.5, 0.1, 2.0), Vec3::new(2.0, 0.1, 0.0), 1.0);
    stand(Vec3::new(0.2, 2.0, 4.0), Vec3::new(3.5, 2.0, 0.0), 1.0);
    stand(Vec3::new(2.0, 0.2, 2.0), Vec3::new(0.0, 0.5, 4.0), 0.9);
    let crate_body = world.add_body(&BodyDefinition::dynamic().at(at + Vec3::new(1.0, 0.4, 1.5))).unwrap();
    let light = ShapeDefinition::new(Shape::cuboid(Vec3::splat(0.3)).unwrap()).density(50.0);
    world.add_shape(crate_body, &light).unwrap();
    let turntable = BodyDefinition::kinematic().at(at).moving(Vec3::ZERO, Vec3::Y * 0.2);
    let turntable = world.add_body(&turntable).unwrap();
    let disc = Shape::cuboid(Vec3::new(1.5, 0.05, 1.5)).unwrap();
    world.add_shape(turntable, &ShapeDefinition::new(disc)).unwrap();
    CharacterController::new(at + Vec3::Y * 0.1, CharacterSettings::default()).unwrap()
}
