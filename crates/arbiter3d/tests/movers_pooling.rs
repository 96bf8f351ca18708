//! Vehicles and fluids allocate nothing from step to step: every allocation of the process is counted.
//!
//! A binary of its own, since the counter sees all threads: one test, so that nothing else runs beside it.

#[path = "common/counting.rs"]
mod counting;

use arbiter3d::math::Vec3;
use arbiter3d::*;
use counting::allocations;

#[test]
fn vehicles_and_fluids_allocate_nothing_in_steady_steps() {
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

    let mut run = |steps: usize| {
        let before = allocations();
        for _ in 0..steps {
            car.update(&mut world, DT).unwrap();
            pool.update(&mut world, DT).unwrap();
            world.step(DT).unwrap();
        }
        allocations() - before
    };
    run(400);
    assert_eq!(run(300), 0);
}
