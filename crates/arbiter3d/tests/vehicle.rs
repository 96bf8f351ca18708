//! Ray-cast vehicles keep to the laws of springs, friction, steering and drag.

mod common;

use arbiter3d::math::{Quat, Vec3};
use arbiter3d::{
    AntiRollBar, BodyDefinition, BodyId, CombineRule, Error, Material, Shape, ShapeDefinition, Vehicle,
    VehicleControls, VehicleDefinition, World,
};
use common::{
    DT, GRAVITY, add, assert_near, assert_relative, cuboid, floor, position, sleepless, spin, turn, velocity,
};

const MASS: f32 = 1200.0;
const HALF_BASE: f32 = 1.4;
const ATTACHED_AT: f32 = -0.2;
const RADIUS: f32 = 0.35;

/// A car of 1200 kg without drag and rolling resistance.
fn plain_car() -> VehicleDefinition {
    let mut car = VehicleDefinition { drag: 0.0, ..VehicleDefinition::car(0.8, HALF_BASE, ATTACHED_AT) };
    car.wheels.iter_mut().for_each(|wheel| wheel.tyre.rolling_resistance = 0.0);
    car
}

/// The height of the chassis at which a car rests: its springs sink by g / (2πf)².
fn ride_height(definition: &VehicleDefinition) -> f32 {
    let suspension = &definition.wheels[0].suspension;
    let rate = std::f32::consts::TAU * suspension.frequency;
    RADIUS + suspension.rest_length - GRAVITY / (rate * rate) - ATTACHED_AT
}

struct Car {
    world: World,
    vehicle: Vehicle,
    chassis: BodyId,
}

impl Car {
    fn place(mut world: World, definition: &VehicleDefinition, at: Vec3, rotation: Quat) -> Self {
        let body = BodyDefinition::dynamic().at(at).rotated(rotation);
        let shape = ShapeDefinition::new(cuboid(0.8, 0.3, 2.0)).density(MASS / 3.84);
        let chassis = add(&mut world, &body, &shape);
        let vehicle = Vehicle::new(&world, chassis, definition).unwrap();
        Self { world, vehicle, chassis }
    }

    /// On a level floor, at rest on its springs.
    fn on_floor(definition: &VehicleDefinition) -> Self {
        let mut world = sleepless();
        floor(&mut world, 0.5);
        Self::place(world, definition, Vec3::new(0.0, ride_height(definition), 0.0), Quat::IDENTITY)
    }

    /// Sets it rolling ahead.
    fn rolling(mut self, speed: f32) -> Self {
        self.world.body_mut(self.chassis).unwrap().set_linear_velocity(Vec3::new(0.0, 0.0, -speed)).unwrap();
        self.run(0.5);
        self.world.body_mut(self.chassis).unwrap().set_linear_velocity(Vec3::new(0.0, 0.0, -speed)).unwrap();
        self
    }

    fn control(&mut self, controls: VehicleControls) {
        self.vehicle.set_controls(controls).unwrap();
    }

    fn step(&mut self) {
        self.vehicle.update(&mut self.world, DT).unwrap();
        self.world.step(DT).unwrap();
    }

    fn run(&mut self, seconds: f32) {
        for _ in 0..(seconds / DT).round() as usize {
            self.step();
        }
    }

    fn position(&self) -> Vec3 {
        position(&self.world, self.chassis)
    }

    fn up(&self) -> Vec3 {
        self.world.body(self.chassis).unwrap().rotation() * Vec3::Y
    }

    fn loads(&self) -> Vec<f32> {
        (0..4).map(|wheel| self.vehicle.wheel(wheel).unwrap().contact.map_or(0.0, |contact| contact.load)).collect()
    }
}

fn braking() -> VehicleControls {
    VehicleControls { brake: 1.0, ..VehicleControls::default() }
}

fn full_throttle() -> VehicleControls {
    VehicleControls { throttle: 1.0, ..VehicleControls::default() }
}

/// A car dropped on its wheels comes to rest where its springs carry it, each wheel with a quarter of the weight.
#[test]
fn the_ride_height_is_that_of_the_springs() {
    for frequency in [1.0, 1.7, 3.0] {
        let mut definition = plain_car();
        definition.wheels.iter_mut().for_each(|wheel| wheel.suspension.frequency = frequency);
        let mut car = Car::on_floor(&definition);
        car.world.body_mut(car.chassis).unwrap().set_position(Vec3::new(0.0, 1.2, 0.0)).unwrap();
        car.run(6.0);
        let sag = GRAVITY / (std::f32::consts::TAU * frequency).powi(2);
        let stop = definition.wheels[0].suspension.travel;
        // Where a soft spring sinks past its travel, the bump stop carries the rest with 20 times the stiffness.
        let sag = if sag > stop { stop + (sag - stop) / 21.0 } else { sag };
        let carried = RADIUS + 0.35 - ATTACHED_AT - car.position().y;
        assert_relative(carried, sag, 0.02, "sag");
        for load in car.loads() {
            assert_relative(load, MASS * GRAVITY / 4.0, 0.01, "load of a wheel");
        }
        assert!(velocity(&car.world, car.chassis).length() < 1e-3);
    }
}

/// Locked wheels stop a car in v² / (2 μ g), with the friction of a sliding tyre.
#[test]
fn locked_wheels_stop_in_the_distance_of_friction() {
    for (friction, sliding) in [(1.0, 1.0), (0.6, 1.0), (1.0, 0.8)] {
        let mut definition = plain_car();
        for wheel in &mut definition.wheels {
            (wheel.tyre.friction, wheel.tyre.sliding_grip) = (friction, sliding);
        }
        let mut car = Car::on_floor(&definition).rolling(20.0);
        let start = car.position().z;
        car.control(braking());
        car.run(8.0);
        let stopped = start - car.position().z;
        let speed = velocity(&car.world, car.chassis).length();
        assert!(speed < 1e-3, "still moves at {speed} m/s");
        assert_relative(stopped, 400.0 / (2.0 * friction * sliding * GRAVITY), 0.05, "braking distance");
    }
}

/// Ice combines by the minimum: the same brakes need ten times the way.
#[test]
fn the_ground_has_a_say_in_the_friction() {
    let mut car = Car::on_floor(&plain_car());
    let shape = car.world.body(BodyId::WORLD).unwrap().shapes()[0];
    let ice = Material { friction: 0.1, friction_combine: CombineRule::Minimum, ..Material::default() };
    car.world.shape_mut(shape).unwrap().set_material(ice).unwrap();
    let mut car = car.rolling(5.0);
    let start = car.position().z;
    car.control(braking());
    car.run(10.0);
    assert_relative(start - car.position().z, 25.0 / (2.0 * 0.1 * 0.8 * GRAVITY), 0.05, "way on ice");
}

/// At low speed the middle of the rear axle goes round a circle of radius base / tan(angle).
#[test]
fn slow_cars_turn_about_the_centre_of_their_wheels() {
    for angle in [0.1_f32, 0.35, 0.6] {
        let mut car = Car::on_floor(&plain_car()).rolling(2.0);
        car.control(VehicleControls { steering: angle, ..VehicleControls::default() });
        car.run(3.0);
        let body = car.world.body(car.chassis).unwrap();
        let axle = body.pose().transform_point(Vec3::new(0.0, 0.0, HALF_BASE));
        let radius = body.velocity_at(axle).length() / body.angular_velocity().y;
        let expected = 2.0 * HALF_BASE / f64::from(angle).tan() as f32;
        assert!(body.linear_velocity().length() > 1.0, "has stopped");
        assert_relative(radius, expected, 0.05, "turning radius");
    }
}

/// Parked on 10° with the handbrake for ten seconds, a car stays within a millimetre; without it, it rolls at g sin
/// 10°.
#[test]
fn the_handbrake_holds_on_a_slope() {
    let parked = |handbrake: f32| {
        let mut world = sleepless();
        let tilt = turn(Vec3::X, 10.0);
        let slope = ShapeDefinition::new(cuboid(50.0, 1.0, 200.0)).at(tilt * -Vec3::Y).rotated(tilt);
        world.add_shape(BodyId::WORLD, &slope).unwrap();
        let definition = plain_car();
        let mut car = Car::place(world, &definition, tilt * (Vec3::Y * ride_height(&definition)), tilt);
        car.control(VehicleControls { handbrake, ..VehicleControls::default() });
        car.run(2.0);
        let start = car.position();
        car.run(10.0);
        (car.position() - start, car)
    };
    let (crept, _) = parked(1.0);
    assert!(crept.length() < 1e-3, "crept by {crept}");
    let (_, car) = parked(0.0);
    // Twelve seconds of free rolling; four wheels add their inertia over r².
    let inertia = MASS + 4.0 * 1.2 / (RADIUS * RADIUS);
    let expected = 12.0 * GRAVITY * 0.173_648 * MASS / inertia;
    assert_relative(velocity(&car.world, car.chassis).length(), expected, 0.01, "speed of free rolling");
}

/// A hundred metres under power straight on, and less than a centimetre to the side.
#[test]
fn straight_on_is_straight() {
    let mut car = Car::on_floor(&plain_car());
    car.control(full_throttle());
    while car.position().z > -100.0 {
        car.step();
        assert!(car.position().x.abs() < 0.01, "{} m aside at {} m", car.position().x, -car.position().z);
    }
    assert!(velocity(&car.world, car.chassis).z < -20.0);
}

/// The engine's torque against the drag: v = √(T / (r c)).
#[test]
fn the_top_speed_is_where_drag_meets_torque() {
    let mut definition = plain_car();
    (definition.drag, definition.drive_torque) = (3.0, 700.0);
    let mut world = sleepless();
    let road = ShapeDefinition::new(cuboid(50.0, 1.0, 3000.0)).at(Vec3::new(0.0, -1.0, 0.0));
    world.add_shape(BodyId::WORLD, &road).unwrap();
    let mut car = Car::place(world, &definition, Vec3::new(0.0, ride_height(&definition), 2900.0), Quat::IDENTITY);
    car.control(full_throttle());
    car.run(90.0);
    let expected = (700.0_f32 / (RADIUS * 3.0)).sqrt();
    assert_relative(car.vehicle.speed(&car.world).unwrap(), expected, 0.01, "top speed");
    let wheel = car.vehicle.wheel(2).unwrap();
    // The tread is faster by the slip that the thrust takes.
    let slip = 0.1 * wheel.contact.unwrap().longitudinal_force / wheel.contact.unwrap().load;
    assert_relative(wheel.angular_velocity * RADIUS, expected / (1.0 - slip), 0.003, "speed of the tread");
}

/// More torque than the tyres hold spins the wheels: the thrust is that of two sliding tyres.
#[test]
fn spinning_wheels_push_with_sliding_friction() {
    let mut definition = plain_car();
    definition.drive_torque = 20_000.0;
    let mut car = Car::on_floor(&definition);
    car.control(full_throttle());
    car.run(1.0);
    let thrust: f32 = [2, 3].map(|i| car.vehicle.wheel(i).unwrap().contact.unwrap().longitudinal_force).iter().sum();
    let loads = car.loads();
    assert_relative(thrust, 0.8 * (loads[2] + loads[3]), 0.01, "thrust");
    assert!(car.vehicle.wheel(2).unwrap().angular_velocity > 100.0);
    // The nose rises: the rear carries more than the front.
    assert!(loads[2] > 1.2 * loads[0], "{loads:?}");
}

/// A hill of 15° throws the car; it flies, lands on its wheels and drives on.
#[test]
fn a_jump_lands_on_the_wheels() {
    let mut world = sleepless();
    floor(&mut world, 0.5);
    let tilt = turn(Vec3::X, 15.0);
    let ramp = ShapeDefinition::new(cuboid(4.0, 1.0, 5.0)).rotated(tilt).at(Vec3::new(0.0, 0.25, -30.0));
    world.add_shape(BodyId::WORLD, &ramp).unwrap();
    let definition = plain_car();
    let at = Vec3::new(0.0, ride_height(&definition), 0.0);
    let mut car = Car::place(world, &definition, at, Quat::IDENTITY).rolling(15.0);
    let mut flew = 0;
    for _ in 0..300 {
        car.step();
        flew += usize::from(car.loads().iter().all(|&load| load == 0.0));
        assert!(car.up().y > 0.7, "up is {}", car.up());
    }
    assert!(flew > 20, "in the air for {flew} steps");
    assert!(car.up().y > 0.999 && car.loads().iter().all(|&load| load > 2000.0), "{} {:?}", car.up(), car.loads());
    assert!(car.position().z < -60.0 && (car.position().y - ride_height(&definition)).abs() < 0.02);
}

/// Anti-roll bars halve the lean in a corner, and the outer wheels carry what the inner ones lose.
#[test]
fn anti_roll_bars_resist_roll() {
    let lean = |stiffness: f32| {
        let mut definition = plain_car();
        definition.anti_roll_bars =
            [(0, 1), (2, 3)].map(|(left, right)| AntiRollBar { left, right, stiffness }).to_vec();
        let mut car = Car::on_floor(&definition).rolling(10.0);
        car.control(VehicleControls { steering: 0.1, ..VehicleControls::default() });
        car.run(2.0);
        let loads = car.loads();
        assert!(loads[1] + loads[3] > loads[0] + loads[2] + 500.0, "the right wheels are outside: {loads:?}");
        assert_relative(loads.iter().sum(), MASS * GRAVITY, 0.02, "all loads");
        let body = car.world.body(car.chassis).unwrap();
        (body.rotation() * Vec3::X).y.abs()
    };
    // A bar of half the spring's stiffness doubles the stiffness against roll: k + 2 · k/2.
    let spring = MASS / 4.0 * (std::f32::consts::TAU * 1.7_f32).powi(2);
    let (soft, stiff) = (lean(0.0), lean(0.5 * spring));
    assert!(soft > 0.01, "{soft}");
    assert_relative(stiff / soft, 0.5, 0.1, "lean with bars");
}

/// On a slab that glides without friction, car and slab take opposite momentum.
#[test]
fn the_ground_is_pushed_back() {
    let mut world = sleepless();
    floor(&mut world, 0.0);
    let slab = ShapeDefinition::new(cuboid(5.0, 0.25, 20.0)).density(50.0).friction(0.0);
    let slab = add(&mut world, &BodyDefinition::dynamic().at(Vec3::new(0.0, 0.25, 0.0)), &slab);
    let definition = plain_car();
    let at = Vec3::new(0.0, 0.5 + ride_height(&definition), 10.0);
    let mut car = Car::place(world, &definition, at, Quat::IDENTITY);
    car.control(VehicleControls { throttle: 0.5, ..VehicleControls::default() });
    car.run(2.0);
    let ahead = velocity(&car.world, car.chassis).z * MASS;
    let back = velocity(&car.world, slab).z * car.world.body(slab).unwrap().mass();
    assert!(ahead < -2000.0, "{ahead}");
    assert_near(ahead + back, 0.0, 0.01 * ahead.abs(), "momentum of both");
    // The slab carries the car: the floor holds both, and the slab does not sink.
    assert_near(position(&car.world, slab).y, 0.25, 0.01, "height of the slab");
}

/// Cornering hard with full brakes needs more room than without: the friction circle is shared.
#[test]
fn braking_takes_grip_from_steering() {
    let turned = |brake: f32| {
        let mut car = Car::on_floor(&plain_car()).rolling(15.0);
        car.control(VehicleControls { steering: 0.15, brake, ..VehicleControls::default() });
        car.run(0.75);
        let body = car.world.body(car.chassis).unwrap();
        for wheel in 0..4 {
            let Some(contact) = car.vehicle.wheel(wheel).unwrap().contact else { continue };
            let force = contact.longitudinal_force.hypot(contact.lateral_force);
            assert!(force <= 1.001 * contact.load, "wheel {wheel}: {force} of {}", contact.load);
        }
        (body.rotation() * Vec3::Z).x
    };
    let (free, locked) = (turned(0.0), turned(1.0));
    assert!(free > 0.3 && locked.abs() < 0.3 * free, "{free} {locked}");
}

/// A parked car falls asleep like any body, costs nothing, and wakes when its driver does something.
#[test]
fn parked_cars_sleep_until_they_are_driven() {
    let mut world = World::default();
    floor(&mut world, 0.5);
    let definition = plain_car();
    let mut car = Car::place(world, &definition, Vec3::new(0.0, 1.2, 0.0), Quat::IDENTITY);
    car.control(VehicleControls { handbrake: 1.0, ..VehicleControls::default() });
    car.run(6.0);
    assert!(!car.world.body(car.chassis).unwrap().is_awake());
    let before = car.position();
    car.run(1.0);
    assert_eq!(car.position(), before);
    car.control(full_throttle());
    car.run(1.0);
    assert!(velocity(&car.world, car.chassis).z < -2.0);
}

/// Ground taken from under a sleeping car wakes it.
#[test]
fn a_sleeping_car_falls_when_its_ground_goes() {
    let mut world = World::default();
    floor(&mut world, 0.5);
    let bridge = BodyDefinition::fixed().at(Vec3::new(0.0, 4.75, 0.0));
    let bridge = add(&mut world, &bridge, &ShapeDefinition::new(cuboid(5.0, 0.25, 5.0)));
    let mut car = Car::place(world, &plain_car(), Vec3::new(0.0, 6.0, 0.0), Quat::IDENTITY);
    car.run(6.0);
    assert!(!car.world.body(car.chassis).unwrap().is_awake());
    car.world.remove_body(bridge).unwrap();
    car.run(3.0);
    assert!(car.position().y < 1.2);
}

/// The same drive gives the same bits, on one thread and on two.
#[test]
fn a_drive_has_the_same_bits() {
    let drive = |threads: usize| {
        let settings = arbiter3d::WorldSettings { threads, ..arbiter3d::WorldSettings::default() };
        let mut world = World::new(settings).unwrap();
        floor(&mut world, 0.5);
        let mut car = Car::place(world, &plain_car(), Vec3::new(0.0, 1.0, 0.0), Quat::IDENTITY);
        for step in 0..300 {
            let steering = if step % 120 < 60 { 0.2 } else { -0.25 };
            let brake = if step > 240 { 0.7 } else { 0.0 };
            car.control(VehicleControls { throttle: 1.0, brake, steering, handbrake: 0.0 });
            car.step();
        }
        assert!(spin(&car.world, car.chassis).length() > 1e-4);
        (car.world.hash(), car.vehicle.wheel(2).unwrap().angle.to_bits())
    };
    assert_eq!(drive(1), drive(1));
    assert_eq!(drive(1), drive(2));
}

/// Wheels are drawn where they stand, turned to the side they are steered to.
#[test]
fn wheel_poses_follow_steering_and_spin() {
    let mut car = Car::on_floor(&plain_car()).rolling(3.0);
    car.control(VehicleControls { steering: 0.4, ..VehicleControls::default() });
    car.run(0.1);
    let state = *car.vehicle.wheel(0).unwrap();
    let ground_speed = car.world.body(car.chassis).unwrap().velocity_at(state.contact.unwrap().point).length();
    assert_relative(state.angular_velocity * RADIUS, ground_speed, 0.02, "tread");
    let pose = car.vehicle.wheel_pose(0).unwrap();
    let height = car.world.body(car.chassis).unwrap().pose().transform_point(pose.position).y;
    assert_near(height, RADIUS, 0.01, "centre of the wheel");
    // The axle points left (−x) and, the inner wheel steering a little more than 0.4, back (+z).
    let axle = pose.rotation.rotate(Vec3::NEG_X);
    let angle = axle.z.atan2(-axle.x);
    assert!(angle > 0.4 && angle < 0.55, "{angle}");
}

#[test]
fn bad_definitions_are_refused() {
    let mut world = World::default();
    let body = add(&mut world, &BodyDefinition::dynamic(), &ShapeDefinition::new(Shape::sphere(0.5).unwrap()));
    let car = plain_car();
    assert!(matches!(Vehicle::new(&world, BodyId::WORLD, &car), Err(Error::NotDynamic { .. })));
    let mut bad = car.clone();
    bad.wheels[1].radius = f32::NAN;
    assert!(matches!(Vehicle::new(&world, body, &bad), Err(Error::OutOfRange { what: "wheel radius", .. })));
    let mut bad = car.clone();
    bad.anti_roll_bars = vec![AntiRollBar { left: 0, right: 4, stiffness: 1.0 }];
    assert!(Vehicle::new(&world, body, &bad).is_err());
    let mut vehicle = Vehicle::new(&world, body, &car).unwrap();
    assert!(vehicle.set_controls(VehicleControls { throttle: 1.5, ..VehicleControls::default() }).is_err());
    assert!(vehicle.set_wheel_torque(4, 1.0).is_err() && vehicle.update(&mut world, f32::NAN).is_err());
    world.remove_body(body).unwrap();
    assert!(matches!(vehicle.update(&mut world, DT), Err(Error::UnknownBody { .. })));
}
