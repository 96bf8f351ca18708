//! Restitution: rebounds, collisions of two, rest.

mod common;

use arbiter3d::math::Vec3;
use arbiter3d::{BodyDefinition, CombineRule, Material, Shape, ShapeDefinition};
use common::*;

/// Height of the first rebound of a shape that falls by `height` onto the floor, from its speed on the way up.
fn rebound(shape: &Shape, height: f32, restitution: f32, rate: f32) -> f32 {
    let mut world = sleepless();
    floor(&mut world, 0.5);
    let rest = shape.local_aabb().max.y;
    let body = BodyDefinition::dynamic().at(Vec3::Y * (rest + height));
    let body = add(&mut world, &body, &ShapeDefinition::new(shape.clone()).restitution(restitution));
    let mut hit = false;
    let mut top: f32 = 0.0;
    for _ in 0..(4.0 * rate) as usize {
        world.step(1.0 / rate).unwrap();
        let (y, v) = (position(&world, body).y - rest, velocity(&world, body).y);
        hit |= world.arbiter_count() > 0;
        if hit && v > 0.0 && world.arbiter_count() == 0 {
            // The rest of the way up, free of the sampling.
            top = top.max(y + v * v / (2.0 * GRAVITY));
        }
        if hit && top > 0.0 && v < 0.0 {
            break;
        }
    }
    assert!(hit, "it reached the floor");
    top
}

/// A rebound reaches e² of the height of the fall, for a ball and for a box that lands flat.
#[test]
fn a_rebound_reaches_e_squared_h() {
    let mut failures = Vec::new();
    for (name, shape) in [("sphere", sphere(0.5)), ("box", cube(0.5))] {
        for height in [0.5, 1.0, 2.0, 5.0] {
            for restitution in [0.0_f32, 0.3, 0.6, 0.9, 1.0] {
                for rate in [60.0, 100.0] {
                    let top = rebound(&shape, height, restitution, rate);
                    let expected = restitution * restitution * height;
                    let error = if restitution > 0.0 { top / expected - 1.0 } else { top / height };
                    let line =
                        format!("{name} h {height} e {restitution} at {rate} Hz: {top} ({:+.2} %)", error * 100.0);
                    if error.abs() > 0.02 {
                        failures.push(line);
                    }
                }
            }
        }
    }
    assert!(failures.is_empty(), "not within 2 % of e²h:\n{}", failures.join("\n"));
}

/// Two equal balls that meet head on exchange their velocities when elastic, and share them when plastic.
#[test]
fn two_balls_collide_by_newtons_law() {
    for restitution in [0.0_f32, 0.5, 1.0] {
        for (r1, r2) in [(0.5, 0.5), (0.5, 0.25), (0.2, 0.6)] {
            let mut world = weightless();
            let shape = |radius| ShapeDefinition::new(sphere(radius)).restitution(restitution);
            let body = |x: f32, v: f32| BodyDefinition::dynamic().at(Vec3::X * x).moving(Vec3::X * v, Vec3::ZERO);
            let a = add(&mut world, &body(-2.0, 6.0), &shape(r1));
            let b = add(&mut world, &body(2.0, -3.0), &shape(r2));
            run(&mut world, 1.0);
            let (m1, m2) = (world.body(a).unwrap().mass(), world.body(b).unwrap().mass());
            let center = (m1 * 6.0 - m2 * 3.0) / (m1 + m2);
            let v1 = center - restitution * 9.0 * m2 / (m1 + m2);
            let v2 = center + restitution * 9.0 * m1 / (m1 + m2);
            assert_near(velocity(&world, a).x, v1, 0.01, "velocity of the first");
            assert_near(velocity(&world, b).x, v2, 0.01, "velocity of the second");
        }
    }
}

/// Slow contacts do not bounce: a body comes to rest however elastic it is.
#[test]
fn below_the_threshold_nothing_bounces() {
    let mut world = sleepless();
    floor(&mut world, 0.5);
    let ball = BodyDefinition::dynamic().at(Vec3::Y * 0.53);
    let ball = add(&mut world, &ball, &ShapeDefinition::new(sphere(0.5)).restitution(1.0));
    run(&mut world, 0.5); // falls 3 cm, arrives at 0.77 m/s
    for _ in 0..60 {
        world.step(DT).unwrap();
        assert!(velocity(&world, ball).y.abs() < 0.02, "{}", velocity(&world, ball));
    }
}

/// A ball of restitution 0.8 loses its height bounce by bounce and comes to rest within the time of the series.
#[test]
fn a_bouncing_ball_comes_to_rest() {
    let mut world = world();
    floor(&mut world, 0.5);
    let ball = BodyDefinition::dynamic().at(Vec3::Y * 2.5);
    let ball = add(&mut world, &ball, &ShapeDefinition::new(sphere(0.5)).restitution(0.8).rolling_resistance(0.01));
    // t₀ = √(2h/g) = 0.64 s, and the series t₀ (1 + e) / (1 − e) = 5.7 s.
    run(&mut world, 8.0);
    assert!(!world.body(ball).unwrap().is_awake(), "asleep at {}", position(&world, ball));
    assert_near(position(&world, ball).y, 0.5, 0.01, "height");
}

/// Restitutions are combined by rule, the larger by default.
#[test]
fn restitutions_are_combined_by_rule() {
    for (rule, expected) in [(CombineRule::Maximum, 0.8_f32), (CombineRule::Average, 0.4), (CombineRule::Minimum, 0.0)]
    {
        let mut world = weightless();
        floor(&mut world, 0.0);
        let material = Material { restitution: 0.8, restitution_combine: rule, ..Material::default() };
        let shape = ShapeDefinition { material, ..ShapeDefinition::new(sphere(0.5)) };
        let ball = BodyDefinition::dynamic().at(Vec3::Y * 2.0).moving(Vec3::Y * -5.0, Vec3::ZERO);
        let ball = add(&mut world, &ball, &shape);
        run(&mut world, 1.0);
        assert_near(velocity(&world, ball).y, 5.0 * expected, 0.02, "speed after the bounce");
    }
}
