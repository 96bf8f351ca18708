//! Bodies in fluids keep to Archimedes' principle and the law of drag.

mod common;

use arbiter3d::math::{Quat, Vec3};
use arbiter3d::{
    BodyDefinition, BodyId, Error, FluidDefinition, FluidSurface, FluidVolume, Plane, Shape, ShapeDefinition, World,
    WorldSettings,
};
use common::{
    DT, GRAVITY, add, assert_near, assert_relative, capsule, cube, cuboid, position, sleepless, sphere, turn,
};
use common::{floor, spin, velocity};
use std::sync::Arc;

fn water() -> FluidVolume {
    FluidVolume::new(FluidDefinition::default()).unwrap()
}

/// Water that brings bodies to rest soon.
fn thick() -> FluidDefinition {
    FluidDefinition { linear_drag: 2.0, angular_drag: 2.0, ..FluidDefinition::default() }
}

fn run(world: &mut World, fluid: &mut FluidVolume, seconds: f32) {
    for _ in 0..(seconds / DT).round() as usize {
        fluid.update(world, DT).unwrap();
        world.step(DT).unwrap();
    }
}

fn drop_in(world: &mut World, shape: Shape, density: f32, at: Vec3, rotation: Quat) -> BodyId {
    add(world, &BodyDefinition::dynamic().at(at).rotated(rotation), &ShapeDefinition::new(shape).density(density))
}

/// Depth of the lowest point of a ball of radius 1 that floats: V(h) = π h² (3 − h) / 3 = 4/3 π ρ.
fn ball_draught(density: f64) -> f32 {
    let (mut low, mut high) = (0.0_f64, 2.0_f64);
    for _ in 0..60 {
        let h = 0.5 * (low + high);
        if h * h * (3.0 - h) / 4.0 < density { low = h } else { high = h }
    }
    low as f32
}

/// What is lighter than water floats as deep as its weight demands.
#[test]
fn floating_bodies_have_their_draught() {
    let draught_of = |shape: Shape, density: f32, half: f32| {
        let mut world = sleepless();
        let mut fluid = FluidVolume::new(thick()).unwrap();
        let body = drop_in(&mut world, shape, density, Vec3::new(0.0, half, 0.0), Quat::IDENTITY);
        run(&mut world, &mut fluid, 15.0);
        assert!(velocity(&world, body).length() < 1e-3, "still moves");
        half - position(&world, body).y
    };
    for density in [100.0, 500.0, 900.0] {
        let part = density / 1000.0;
        assert_relative(draught_of(sphere(1.0), density, 1.0), ball_draught(f64::from(part)), 0.01, "ball");
        assert_relative(draught_of(cuboid(2.0, 0.5, 2.0), density, 0.5), part, 0.01, "box");
        assert_relative(draught_of(Shape::cylinder(0.5, 2.0).unwrap(), density, 0.5), part, 0.01, "cylinder");
    }
    // Half of a lying capsule is below the middle of its axis.
    let mut world = sleepless();
    let mut fluid = FluidVolume::new(thick()).unwrap();
    let lying = drop_in(&mut world, capsule(1.0, 0.5), 500.0, Vec3::Y * 0.3, turn(Vec3::Z, 90.0));
    run(&mut world, &mut fluid, 15.0);
    assert_near(position(&world, lying).y, 0.0, 0.005, "middle of the capsule");
    let submersion = fluid.submersion(&world, lying).unwrap();
    assert_relative(submersion.volume, 0.5 * world.body(lying).unwrap().mass() / 500.0, 0.005, "half of the capsule");
}

/// A body of the water's density stays where it is put, moving or turned; one slightly heavier sinks.
#[test]
fn what_weighs_as_much_as_water_hovers() {
    let mut world = sleepless();
    let shapes = [sphere(0.5), cube(0.5), capsule(0.5, 0.3), Shape::cylinder(0.5, 0.4).unwrap()];
    let mut bodies = Vec::new();
    for (index, shape) in shapes.into_iter().enumerate() {
        let at = Vec3::new(3.0 * index as f32, -5.0, 0.0);
        bodies.push((drop_in(&mut world, shape, 1000.0, at, turn(Vec3::X, 20.0)), at));
    }
    let stone = drop_in(&mut world, sphere(0.5), 1010.0, Vec3::new(0.0, -5.0, 5.0), Quat::IDENTITY);
    let mut fluid = water();
    run(&mut world, &mut fluid, 10.0);
    for (body, at) in bodies {
        assert!((position(&world, body) - at).length() < 2e-3, "{} from {at}", position(&world, body));
    }
    assert!(position(&world, stone).y < -6.0);
}

/// A plank set on its edge falls on its broad side, whichever way round.
#[test]
fn a_plank_rights_itself() {
    for angle in [85.0, 60.0, -70.0, 100.0, 265.0] {
        let mut world = sleepless();
        let plank = drop_in(&mut world, cuboid(1.5, 0.1, 0.5), 500.0, Vec3::Y * 0.2, turn(Vec3::X, angle));
        let mut fluid = FluidVolume::new(thick()).unwrap();
        run(&mut world, &mut fluid, 20.0);
        let up = world.body(plank).unwrap().rotation() * Vec3::Y;
        assert!(up.y.abs() > 0.9999, "{angle}°: {up}");
        assert_near(position(&world, plank).y, 0.0, 0.001, "height");
    }
}

/// A light ball rises at v = √(2 (ρ − ρb) V g / (ρ C A)); with drag in proportion, at (1 − ρb/ρ) g / k.
#[test]
fn rising_bodies_reach_their_terminal_speed() {
    for (density, linear, quadratic) in [(300.0, 0.0, 0.5), (900.0, 0.0, 1.0), (500.0, 4.0, 0.0), (5.0, 0.0, 0.5)] {
        let definition =
            FluidDefinition { linear_drag: linear, quadratic_drag: quadratic, ..FluidDefinition::default() };
        let mut fluid = FluidVolume::new(definition).unwrap();
        for round in [true, false] {
            let mut world = sleepless();
            let shape = if round { sphere(0.5) } else { cube(0.5) };
            let (volume, shadow) =
                if round { (std::f32::consts::FRAC_PI_6, std::f32::consts::FRAC_PI_4) } else { (1.0, 1.0) };
            let body = drop_in(&mut world, shape, density, Vec3::Y * -200.0, Quat::IDENTITY);
            run(&mut world, &mut fluid, 10.0);
            let lift = (1.0 - density / 1000.0) * GRAVITY;
            let expected =
                if linear > 0.0 { lift / linear } else { (2.0 * lift * volume / (quadratic * shadow)).sqrt() };
            assert_relative(velocity(&world, body).y, expected, 0.005, "speed of rise");
        }
    }
}

/// A river takes what floats along at its own speed.
#[test]
fn the_flow_carries_what_floats() {
    let flow = Vec3::new(1.5, 0.0, -0.5);
    let mut fluid = FluidVolume::new(FluidDefinition { flow, ..FluidDefinition::default() }).unwrap();
    let mut world = sleepless();
    let bodies = [sphere(0.5), cube(0.5), cuboid(1.0, 0.1, 0.3)]
        .map(|shape| drop_in(&mut world, shape, 500.0, Vec3::ZERO, Quat::IDENTITY));
    for (index, &body) in bodies.iter().enumerate() {
        world.body_mut(body).unwrap().set_position(Vec3::new(0.0, 0.0, 5.0 * index as f32)).unwrap();
    }
    run(&mut world, &mut fluid, 60.0);
    for body in bodies {
        let drift = velocity(&world, body);
        assert!((drift - flow).length() < 0.01, "{drift}");
    }
}

/// Spin dies away at the rate of the angular drag.
#[test]
fn spin_dies_away() {
    let definition = FluidDefinition { angular_drag: 0.8, quadratic_angular_drag: 0.0, ..FluidDefinition::default() };
    let mut fluid = FluidVolume::new(definition).unwrap();
    let mut world = sleepless();
    let body = drop_in(&mut world, cuboid(0.5, 0.5, 0.5), 1000.0, Vec3::Y * -5.0, Quat::IDENTITY);
    world.body_mut(body).unwrap().set_angular_velocity(Vec3::new(0.0, 4.0, 0.0)).unwrap();
    run(&mut world, &mut fluid, 2.0);
    assert_relative(spin(&world, body).length(), 4.0 * (-0.8_f32 * 2.0).exp(), 0.02, "spin after two seconds");
}

/// Balloons and shells, a hundred times lighter than water, float without jitter.
#[test]
fn very_light_bodies_float_quietly() {
    for shape in [sphere(0.3), cube(0.3), cuboid(1.0, 0.05, 0.4), capsule(0.4, 0.1)] {
        let mut world = sleepless();
        let mut fluid = water();
        let body = drop_in(&mut world, shape, 10.0, Vec3::Y * 0.5, turn(Vec3::Z, 10.0));
        run(&mut world, &mut fluid, 15.0);
        let (speed, spin) = (velocity(&world, body).length(), spin(&world, body).length());
        assert!(velocity(&world, body).y.abs() < 1e-4 && speed < 0.05 && spin < 0.02, "{speed} m/s, {spin} rad/s");
    }
}

/// What has come to rest on the water sleeps; a change of the fluid, or its end, wakes it.
#[test]
fn floating_bodies_sleep_until_the_water_changes() {
    let mut world = World::default();
    let mut fluid = FluidVolume::new(thick()).unwrap();
    let body = drop_in(&mut world, cuboid(1.0, 0.5, 1.0), 500.0, Vec3::Y * 0.2, Quat::IDENTITY);
    let ashore = drop_in(&mut world, cube(0.5), 500.0, Vec3::new(10.0, 3.5, 0.0), Quat::IDENTITY);
    let shore = ShapeDefinition::new(cuboid(2.0, 0.5, 2.0)).at(Vec3::new(10.0, 2.5, 0.0));
    world.add_shape(BodyId::WORLD, &shore).unwrap();
    run(&mut world, &mut fluid, 15.0);
    let asleep = |world: &World, body| !world.body(body).unwrap().is_awake();
    assert!(asleep(&world, body) && asleep(&world, ashore));
    let before = position(&world, body);
    run(&mut world, &mut fluid, 1.0);
    assert_eq!(position(&world, body), before);

    let higher = FluidDefinition { surface: FluidSurface::level(1.0), ..thick() };
    fluid.set_definition(&mut world, higher).unwrap();
    fluid.update(&mut world, DT).unwrap();
    assert!(!asleep(&world, body) && asleep(&world, ashore));
    run(&mut world, &mut fluid, 15.0);
    assert_near(position(&world, body).y, 1.0, 0.01, "height on the risen water");
    assert!(asleep(&world, body));
    fluid.wake(&mut world).unwrap();
    common::run(&mut world, 2.0);
    assert!(position(&world, body).y < -10.0);
}

/// A pool ends at its walls and bottom: half of a box across a wall is in it.
#[test]
fn pools_end_at_their_walls() {
    let mut fluid =
        FluidVolume::new(FluidDefinition::pool(Vec3::new(0.0, -1.0, 0.0), Vec3::new(2.0, 1.0, 3.0))).unwrap();
    let mut world = sleepless();
    let place = |world: &mut World, shape: Shape, at: Vec3| drop_in(world, shape, 500.0, at, Quat::IDENTITY);
    let wall = place(&mut world, cube(0.5), Vec3::new(2.0, -1.0, 0.0));
    let corner = place(&mut world, cube(0.5), Vec3::new(2.0, -2.0, 3.0));
    let ball = place(&mut world, sphere(0.5), Vec3::new(-2.0, -1.0, 0.0));
    let beside = place(&mut world, cube(0.5), Vec3::new(2.6, -1.0, 0.0));
    assert_near(fluid.submersion(&world, wall).unwrap().volume, 0.5, 1e-5, "box in the wall");
    let part = fluid.submersion(&world, corner).unwrap();
    assert_near(part.volume, 0.125, 1e-5, "box in a corner");
    assert!((part.center - Vec3::new(1.75, -1.75, 2.75)).length() < 1e-5);
    assert_relative(fluid.submersion(&world, ball).unwrap().volume, 0.261_799, 0.001, "ball in the wall");
    assert_eq!(fluid.submersion(&world, beside).unwrap().volume, 0.0);
}

/// A standing wave of slope 0.2: a ball floats on the slope and slides down no faster than gravity along it allows.
#[test]
fn waves_lift_what_floats() {
    let mut world = sleepless();
    let height = std::cell::Cell::new(0.0_f32);
    let body = drop_in(&mut world, cuboid(1.0, 0.5, 1.0), 500.0, Vec3::ZERO, Quat::IDENTITY);
    let mut fluid = FluidVolume::new(thick()).unwrap();
    let mut far = 0.0_f32;
    for step in 0..1200 {
        // A tide of 1 m in 10 s, slow against the period of the box of 1.4 s.
        height.set(common::heading(36.0 * step as f32 * DT).z);
        let level = height.get();
        let surface = FluidSurface::Height(Arc::new(move |_| level));
        fluid.set_definition(&mut world, FluidDefinition { surface, ..thick() }).unwrap();
        fluid.update(&mut world, DT).unwrap();
        world.step(DT).unwrap();
        // After the first swings, the drag of 2/s holds it back by 10 cm at most.
        if step > 400 {
            far = far.max((position(&world, body).y - level).abs());
        }
    }
    assert!(far < 0.12, "{far} m from the surface");
    // A slope tilts what floats on it.
    let slope = FluidSurface::Height(Arc::new(|at: Vec3| 0.2 * at.x));
    let lake = FluidDefinition { surface: slope, linear_drag: 20.0, ..thick() };
    fluid.set_definition(&mut world, lake).unwrap();
    run(&mut world, &mut fluid, 5.0);
    let body = world.body(body).unwrap();
    assert_near(body.position().y, 0.2 * body.position().x, 0.1, "height on the slope");
    let up = body.rotation() * Vec3::Y;
    assert!(up.x < -0.05, "{up}");
}

/// A stone on the bottom presses with its weight less the water's, so friction stops it in twice the way.
#[test]
fn stones_on_the_bottom_weigh_less() {
    let mut world = sleepless();
    floor(&mut world, 0.5);
    let stone = drop_in(&mut world, cuboid(0.5, 0.25, 0.5), 2000.0, Vec3::Y * 0.25, Quat::IDENTITY);
    let lake = FluidDefinition {
        surface: FluidSurface::level(5.0),
        linear_drag: 0.0,
        quadratic_drag: 0.0,
        angular_drag: 0.0,
        quadratic_angular_drag: 0.0,
        ..FluidDefinition::default()
    };
    let mut fluid = FluidVolume::new(lake).unwrap();
    run(&mut world, &mut fluid, 1.0);
    let start = position(&world, stone).x;
    world.body_mut(stone).unwrap().set_linear_velocity(Vec3::X * 2.0).unwrap();
    run(&mut world, &mut fluid, 3.0);
    let expected = 4.0 / (2.0 * 0.5 * GRAVITY * 0.5);
    assert_relative(position(&world, stone).x - start, expected, 0.03, "way of the stone");
}

/// Two runs, and one and two threads, give the same bits.
#[test]
fn floating_has_the_same_bits() {
    let float = |threads: usize| {
        let mut world = World::new(WorldSettings { threads, ..WorldSettings::default() }).unwrap();
        let mut random = common::Random(7);
        for _ in 0..60 {
            let shape = random.shape();
            let (at, rotation) = (random.vector(4.0), random.rotation());
            drop_in(&mut world, shape, 400.0, at, rotation);
        }
        let mut fluid = water();
        run(&mut world, &mut fluid, 3.0);
        world.hash()
    };
    assert_eq!(float(1), float(1));
    assert_eq!(float(1), float(2));
}

#[test]
fn bad_fluids_are_refused() {
    let with = |definition: FluidDefinition| FluidVolume::new(definition).err();
    let density = FluidDefinition { density: f32::NAN, ..FluidDefinition::default() };
    assert!(matches!(with(density), Some(Error::OutOfRange { what: "fluid density", .. })));
    let wall = Plane { normal: Vec3::ONE, offset: 0.0 };
    assert!(matches!(
        with(FluidDefinition { bounds: vec![wall], ..FluidDefinition::default() }),
        Some(Error::NotUnit { .. })
    ));
    let mut world = World::default();
    drop_in(&mut world, sphere(0.5), 500.0, Vec3::ZERO, Quat::IDENTITY);
    let storm = FluidSurface::Height(Arc::new(|_| f32::NAN));
    let mut fluid = FluidVolume::new(FluidDefinition { surface: storm, ..FluidDefinition::default() }).unwrap();
    assert!(matches!(fluid.update(&mut world, DT), Err(Error::NotFinite { .. })));
    assert!(water().update(&mut world, 0.0).is_err());
}
