//! Friction: ramps, sliding, spinning, rolling, belts.

mod common;

use arbiter3d::math::Vec3;
use arbiter3d::{BodyDefinition, BodyId, CombineRule, Material, Shape, ShapeDefinition, World};
use common::*;

const SLOPE: f32 = 30.0;

/// A ramp through the origin that falls towards +x, and a body that touches it there.
fn on_ramp(shape: &Shape, height: f32, friction: f32) -> (World, BodyId) {
    let mut world = sleepless();
    let tilt = turn(Vec3::Z, -SLOPE);
    let ramp = BodyDefinition::fixed().at(tilt * Vec3::new(0.0, -1.0, 0.0)).rotated(tilt);
    add(&mut world, &ramp, &ShapeDefinition::new(cuboid(200.0, 1.0, 20.0)).friction(friction).rolling_resistance(0.0));
    let body = BodyDefinition::dynamic().at(tilt * Vec3::new(0.0, height, 0.0)).rotated(tilt);
    let body = add(&mut world, &body, &ShapeDefinition::new(shape.clone()).friction(friction).rolling_resistance(0.0));
    (world, body)
}

fn downhill() -> Vec3 {
    turn(Vec3::Z, -SLOPE) * Vec3::X
}

/// A box on a ramp sticks where the friction exceeds tan 30° = 0.577.
#[test]
fn a_box_sticks_above_the_friction_angle() {
    for shape in [cube(0.5), cuboid(0.5, 0.1, 0.3), cuboid(1.0, 0.5, 0.5)] {
        let height = shape.local_aabb().max.y;
        let (mut world, block) = on_ramp(&shape, height, 0.6);
        let start = position(&world, block);
        run(&mut world, 5.0);
        let moved = position(&world, block).distance(start);
        println!("stuck box moved {:.4} mm", moved * 1e3);
        assert!(moved < 1e-3, "moved {moved} m");
    }
}

/// Below the friction angle it slides at g (sin θ − μ cos θ).
#[test]
fn a_box_slides_below_the_friction_angle() {
    for friction in [0.0_f32, 0.2, 0.4, 0.5] {
        for shape in [cube(0.5), cuboid(0.5, 0.1, 0.3)] {
            let height = shape.local_aabb().max.y;
            let (mut world, block) = on_ramp(&shape, height, friction);
            run(&mut world, 1.0);
            let (at, speed) = (position(&world, block), velocity(&world, block).dot(downhill()));
            run(&mut world, 2.0);
            let gained = (velocity(&world, block).dot(downhill()) - speed) / 2.0;
            let expected = GRAVITY * (0.5 - friction * 0.866_025_4);
            assert_relative(gained, expected, 0.01, "acceleration");
            let slid = (position(&world, block) - at).dot(downhill());
            assert_relative(slid, 2.0 * speed + 2.0 * expected, 0.01, "way");
            println!("mu {friction}: a {gained}, expected {expected}");
        }
    }
}

/// A ball on a ramp rolls at 5/7 g sin θ when it grips (μ > 2/7 tan θ), and slips at g (sin θ − μ cos θ) when it does not.
#[test]
fn a_ball_rolls_or_slips_down_a_ramp() {
    for (friction, expected) in [(0.6, 5.0 / 7.0 * 0.5), (0.1, 0.5 - 0.1 * 0.866_025_4)] {
        let (mut world, ball) = on_ramp(&sphere(0.5), 0.5, friction);
        run(&mut world, 0.5);
        let speed = velocity(&world, ball).dot(downhill());
        run(&mut world, 2.0);
        let gained = (velocity(&world, ball).dot(downhill()) - speed) / 2.0;
        assert_relative(gained, GRAVITY * expected, 0.01, "acceleration");
        let slip = velocity(&world, ball).dot(downhill()) + spin(&world, ball).z * 0.5;
        if friction > 0.5 {
            assert!(slip.abs() < 0.01, "a ball that grips does not slip: {slip}");
        } else {
            assert!(slip > 1.0, "a ball that slips: {slip}");
        }
    }
}

/// A sliding box stops after v²/2μg, in any direction.
#[test]
fn a_sliding_box_stops_after_v_squared_over_2_mu_g() {
    for degrees in [0.0, 30.0, 45.0, 77.0] {
        let mut world = sleepless();
        floor(&mut world, 0.3);
        let block = BodyDefinition::dynamic().at(Vec3::Y * 0.25);
        let block = add(&mut world, &block, &ShapeDefinition::new(cuboid(0.5, 0.25, 0.5)).friction(0.3));
        run(&mut world, 0.5);
        let start = position(&world, block);
        world.body_mut(block).unwrap().set_linear_velocity(heading(degrees) * 4.0).unwrap();
        run(&mut world, 3.0);
        let way = position(&world, block) - start;
        assert_relative(way.dot(heading(degrees)), 16.0 / (2.0 * 0.3 * GRAVITY), 0.02, "way");
        assert!(way.cross(heading(degrees)).y.abs() < 0.01, "straight: {way}");
        assert!(velocity(&world, block).length() < 1e-3);
    }
}

/// A box that spins on the floor is stopped by friction, and stays where it is.
#[test]
fn a_spinning_box_is_stopped_by_friction() {
    let mut world = sleepless();
    floor(&mut world, 0.5);
    let block = drop_shape(&mut world, &cube(0.5), Vec3::Y * 0.5);
    run(&mut world, 0.5);
    world.body_mut(block).unwrap().set_angular_velocity(Vec3::Y * 5.0).unwrap();
    // Corners at √½ m: τ = μ m g √½, I = m/6 · 1 m², so it stops after 5 / (0.5 · 9.81 · 0.707 · 6) = 0.24 s.
    run(&mut world, 0.12);
    let half_way = spin(&world, block).y;
    assert!(half_way > 1.0 && half_way < 4.0, "{half_way}");
    run(&mut world, 0.88);
    assert!(spin(&world, block).length() < 1e-3, "{}", spin(&world, block));
    let drift = position(&world, block) * Vec3::new(1.0, 0.0, 1.0);
    assert!(drift.length() < 0.005, "{drift}");
}

/// Rolling resistance stops a ball: the torque c r N slows it by c g / 1.4, so it rolls v² · 1.4 / 2cg.
#[test]
fn rolling_resistance_stops_a_ball() {
    for resistance in [0.02, 0.05, 0.1] {
        let mut world = sleepless();
        floor(&mut world, 0.8);
        let ball = BodyDefinition::dynamic().at(Vec3::Y * 0.5).moving(Vec3::X * 2.0, Vec3::Z * -4.0);
        let shape = ShapeDefinition::new(sphere(0.5)).friction(0.8).rolling_resistance(resistance);
        let ball = add(&mut world, &ball, &shape);
        let expected = 4.0 * 1.4 / (2.0 * resistance * GRAVITY);
        run(&mut world, 2.0 * 1.4 / (resistance * GRAVITY) + 1.0);
        println!("rolling resistance {resistance}: {} m, expected {expected}", position(&world, ball).x);
        assert_relative(position(&world, ball).x, expected, 0.03, "way");
        assert!(velocity(&world, ball).length() < 1e-3, "stopped: {}", velocity(&world, ball));
    }
}

/// Without rolling resistance a ball rolls on, and a thrown ball ends up rolling at 5/7 of its speed.
#[test]
fn without_rolling_resistance_a_ball_rolls_on() {
    let mut world = sleepless();
    floor(&mut world, 0.5);
    let rolling = BodyDefinition::dynamic().at(Vec3::Y * 0.5).moving(Vec3::X * 2.0, Vec3::Z * -4.0);
    let ideal = ShapeDefinition::new(sphere(0.5)).rolling_resistance(0.0);
    let rolling = add(&mut world, &rolling, &ideal);
    let thrown = BodyDefinition::dynamic().at(Vec3::new(0.0, 0.5, 5.0)).moving(Vec3::X * 7.0, Vec3::ZERO);
    let thrown = add(&mut world, &thrown, &ideal);
    run(&mut world, 10.0);
    assert_relative(velocity(&world, rolling).x, 2.0, 0.005, "speed of the rolling ball");
    assert_relative(position(&world, rolling).x, 20.0, 0.005, "its way");
    assert_relative(velocity(&world, thrown).x, 5.0, 0.01, "speed of the ball that was thrown without spin");
    assert_relative(spin(&world, thrown).z, -10.0, 0.01, "its spin");
}

/// A belt carries a box along: first it slips at μg, then it goes at the speed of the belt.
#[test]
fn a_belt_carries_a_box_at_its_speed() {
    for belt_first in [true, false] {
        for turned in [0.0, 90.0] {
            let mut world = sleepless();
            let mut block = None;
            let add_block = |world: &mut World| drop_shape(world, &cube(0.5), Vec3::Y * 0.5);
            if !belt_first {
                block = Some(add_block(&mut world));
            }
            let material = Material { tangent_velocity: Vec3::X * 2.0, ..Material::default() };
            let belt = ShapeDefinition { material, ..ShapeDefinition::new(cuboid(50.0, 1.0, 50.0)) };
            let body = BodyDefinition::fixed().at(-Vec3::Y).rotated(turn(Vec3::Y, turned));
            add(&mut world, &body, &belt);
            let block = block.unwrap_or_else(|| add_block(&mut world));
            let ahead = turn(Vec3::Y, turned) * Vec3::X;
            run(&mut world, 0.2);
            assert_relative(velocity(&world, block).dot(ahead), 0.5 * GRAVITY * 0.2, 0.1, "speed while it slips");
            run(&mut world, 1.8);
            assert!(velocity(&world, block).distance(ahead * 2.0) < 0.01, "{}", velocity(&world, block));
            let start = position(&world, block);
            run(&mut world, 2.0);
            assert_relative((position(&world, block) - start).dot(ahead), 4.0, 0.005, "way in 2 s");
        }
    }
}

/// The larger friction counts unless the materials say otherwise.
#[test]
fn frictions_are_combined_by_rule() {
    let cases = [
        (CombineRule::Maximum, 0.4),
        (CombineRule::Average, 0.25),
        (CombineRule::GeometricMean, 0.2),
        (CombineRule::Multiply, 0.04),
        (CombineRule::Minimum, 0.1),
    ];
    for (rule, expected) in cases {
        let mut world = sleepless();
        floor(&mut world, 0.4);
        let material = Material { friction: 0.1, friction_combine: rule, ..Material::default() };
        let shape = ShapeDefinition { material, ..ShapeDefinition::new(cuboid(0.5, 0.1, 0.5)) };
        let block = add(&mut world, &BodyDefinition::dynamic().at(Vec3::Y * 0.1), &shape);
        run(&mut world, 0.2);
        world.body_mut(block).unwrap().set_linear_velocity(Vec3::X * 10.0).unwrap();
        run(&mut world, 1.0);
        assert_near(velocity(&world, block).x, 10.0 - expected * GRAVITY, 0.05, "speed after a second");
    }
}
