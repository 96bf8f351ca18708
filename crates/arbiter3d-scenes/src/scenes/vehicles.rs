//! A car with a driver.

use crate::builder::Builder;
use crate::turns::{about, sin_cos};
use crate::{BuiltScene, SceneOptions};
use arbiter3d::{
    AntiRollBar, BodyDefinition, BodyId, Error, Shape, ShapeDefinition, Vehicle, VehicleControls, VehicleDefinition,
    World,
    math::{Real, Vec3},
};
use std::f32::consts::{PI, TAU};

/// Radius of the track's middle, metres.
const TRACK: Real = 35.0;
/// Speed that the driver keeps, m/s.
const SPEED: Real = 11.0;

/// A car on a round track with four humps; crates stand on the inside of it, one of them in the way.
pub(crate) fn vehicle_track(options: &SceneOptions, size: usize) -> Result<BuiltScene, Error> {
    let mut scene = Builder::new(options, size)?;
    scene.ground(Vec3::new(80.0, 1.0, 80.0))?;
    for index in 0..4 {
        let (s, c) = sin_cos(PI * (0.25 + 0.5 * index as Real));
        // A quarter of a metre of a lying cylinder across the track.
        let hump = ShapeDefinition::new(Shape::hull(&prism(12.0, 5.0))?);
        let at = BodyDefinition::fixed().at(Vec3::new(TRACK * c, -11.75, TRACK * s));
        // Its axis points to the middle of the track.
        let turned = about(Vec3::Y, -PI * (0.25 + 0.5 * index as Real));
        scene.add(&at.rotated(turned), &hump)?;
    }
    let cube = ShapeDefinition::new(Shape::cuboid(Vec3::splat(0.5))?).density(50.0);
    for index in 0..8 {
        let (s, c) = sin_cos(TAU * (index as Real + 0.5) / 8.0 + 0.15);
        let radius = if index == 3 { TRACK } else { TRACK - 6.0 };
        scene.drop(Vec3::new(radius * c, 0.5, radius * s), &cube)?;
    }
    let dt = 1.0 / scene.hz;
    let mut drive = Drive::new(&mut scene.world)?;
    scene.finish_with(2400, Box::new(move |_, world| drive.step(world, dt)))
}

/// Corners of a lying prism of 96 sides along x.
fn prism(radius: Real, half_length: Real) -> Vec<Vec3> {
    let corner = |index: usize| {
        let (s, c) = sin_cos(TAU * (index / 2) as Real / 48.0);
        Vec3::new([half_length, -half_length][index % 2], radius * c, radius * s)
    };
    (0..192).map(corner).collect()
}

/// The car and its driver.
struct Drive {
    car: Vehicle,
    /// What is drawn of the wheels.
    wheels: Vec<BodyId>,
}

impl Drive {
    fn new(world: &mut World) -> Result<Self, Error> {
        let body = BodyDefinition { can_sleep: false, ..BodyDefinition::dynamic().at(Vec3::new(TRACK, 1.0, 0.0)) };
        let chassis = world.add_body(&body)?;
        world.add_shape(chassis, &ShapeDefinition::new(Shape::cuboid(Vec3::new(0.8, 0.25, 2.0))?).density(375.0))?;
        let bar = |left: usize, right: usize| AntiRollBar { left, right, stiffness: 20_000.0 };
        let definition = VehicleDefinition {
            anti_roll_bars: vec![bar(0, 1), bar(2, 3)],
            drive_torque: 1200.0,
            ..VehicleDefinition::car(0.85, 1.4, -0.1)
        };
        let car = Vehicle::new(world, chassis, &definition)?;
        let tyre = ShapeDefinition::new(Shape::hull(&prism(0.35, 0.12))?).sensor();
        let mut wheels = Vec::new();
        for _ in &definition.wheels {
            let wheel = world.add_body(&BodyDefinition::kinematic())?;
            world.add_shape(wheel, &tyre)?;
            wheels.push(wheel);
        }
        Ok(Self { car, wheels })
    }

    /// Steers towards a point ahead on the circle, at an even speed.
    fn step(&mut self, world: &mut World, dt: Real) -> Result<(), Error> {
        let chassis = self.car.chassis();
        let pose = world.body(chassis).map(|body| body.pose()).unwrap_or_default();
        let outwards = Vec3::new(pose.position.x, 0.0, pose.position.z).normalize_or_zero();
        // The car goes round from +x towards −z: ahead of it the circle is at this point.
        let ahead = Vec3::new(outwards.z, 0.0, -outwards.x);
        let target = (outwards + ahead * 0.25).normalize_or_zero() * TRACK;
        let local = pose.inverse_transform_point(target);
        // The circle through the car and the target: curvature 2 x / d² to the left, where x < 0.
        let curvature = -2.0 * local.x / (local.x * local.x + local.z * local.z).max(1.0);
        let speed = self.car.speed(world)?;
        let throttle = (0.5 * (SPEED - speed)).clamp(-0.3, 1.0);
        let steering = (2.8 * curvature).clamp(-0.6, 0.6);
        self.car.set_controls(VehicleControls { throttle, steering, ..VehicleControls::default() })?;
        self.car.update(world, dt)?;
        for (index, &wheel) in self.wheels.iter().enumerate() {
            let Some(local) = self.car.wheel_pose(index) else { continue };
            let place = pose.mul(&local);
            if let Some(mut body) = world.body_mut(wheel) {
                body.set_pose(place.position, place.rotation.to_quat())?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use crate::{SceneOptions, find};
    use arbiter3d::BodyKind;

    /// The car keeps to its track and its wheels for two rounds.
    #[test]
    fn the_car_goes_round() {
        let mut scene = find("vehicle_track").unwrap().build(&SceneOptions::default()).unwrap();
        let car = scene
            .world
            .bodies()
            .filter(|&id| scene.world.body(id).unwrap().kind() == BodyKind::Dynamic)
            .last()
            .unwrap();
        let mut before = 0.0_f64;
        let mut turned = 0.0;
        for step in 0..2400 {
            scene.step(step).unwrap();
            let body = scene.world.body(car).unwrap();
            let at = body.position();
            let (radius, angle) = (at.x.hypot(at.z), f64::from(-at.z).atan2(f64::from(at.x)));
            turned += (angle - before + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU) - std::f64::consts::PI;
            before = angle;
            assert!((radius - super::TRACK).abs() < 3.0, "step {step}: {radius} m from the middle");
            assert!((body.rotation() * arbiter3d::math::Vec3::Y).y > 0.8, "step {step}: falls over at {at}");
        }
        // 40 s at 11 m/s, but for the start, on a circle of 220 m.
        let rounds = turned / std::f64::consts::TAU;
        assert!(rounds > 1.7 && rounds < 2.1, "{rounds} rounds");
    }
}
