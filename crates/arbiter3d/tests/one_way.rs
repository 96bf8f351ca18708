//! One-way platforms: through from below, to stand on from above.

mod common;

use arbiter3d::math::Vec3;
use arbiter3d::{BodyDefinition, BodyId, Shape, ShapeDefinition, World};
use common::*;

/// Half the height of the platforms.
const HALF: f32 = 0.1;

/// A platform whose top is at `top`.
fn platform(world: &mut World, body: BodyDefinition, top: f32) -> BodyId {
    let shape = ShapeDefinition::new(cuboid(4.0, HALF, 4.0)).one_way(Vec3::Y);
    add(world, &body.at(Vec3::Y * (top - HALF)), &shape)
}

fn shapes() -> [(Shape, f32); 4] {
    [(sphere(0.3), 0.3), (cube(0.3), 0.3), (capsule(0.2, 0.2), 0.4), (icosahedron(0.3), 0.25)]
}

/// Whatever is thrown up from below passes without losing speed, and stands on the platform when it comes back, still.
#[test]
fn bodies_pass_from_below_and_stand_from_above() {
    for kinematic in [false, true] {
        for (shape, low) in shapes() {
            for speed in [8.0, 12.0, 20.0] {
                let mut world = sleepless();
                let body = if kinematic { BodyDefinition::kinematic() } else { BodyDefinition::fixed() };
                platform(&mut world, body, 2.0);
                let thrown = BodyDefinition::dynamic().moving(Vec3::Y * speed, Vec3::ZERO);
                let body = add(&mut world, &thrown, &ShapeDefinition::new(shape.clone()));
                let what = format!("{shape:?} at {speed} m/s, kinematic {kinematic}");
                let (mut top, mut time) = (0.0_f32, 0.0);
                while velocity(&world, body).y > 0.0 {
                    world.step(DT).unwrap();
                    time += DT;
                    top = top.max(position(&world, body).y);
                    assert!(world.begin_events().is_empty(), "{what}: it touches on its way up");
                }
                assert_relative(top, speed * speed / (2.0 * GRAVITY), 0.01, &what);
                run(&mut world, time + 4.0);
                let height = position(&world, body).y;
                assert!(height > 2.0 + low - 0.02, "{what}: it stands at {height}");
                run(&mut world, 0.5);
                let (place, speed) = (position(&world, body), velocity(&world, body).length());
                assert!(speed < 2e-3, "{what}: it trembles at {speed} m/s");
                assert!(place.distance(Vec3::new(place.x, height, place.z)) < 1e-3, "{what}");
            }
        }
    }
}

/// A throw that ends inside the platform comes back down: what has begun to pass goes on passing.
#[test]
fn what_turns_back_inside_falls_out_again() {
    for (shape, _) in shapes() {
        for share in [0.2, 0.5, 0.8, 0.95] {
            let mut world = sleepless();
            floor(&mut world, 0.5);
            platform(&mut world, BodyDefinition::fixed(), 3.0);
            // From 1 m to between the platform's underside and 3.2 m.
            let height = 1.9 + share;
            let speed = (2.0 * GRAVITY * (height - 1.0)).sqrt();
            let body = BodyDefinition::dynamic().at(Vec3::Y).moving(Vec3::Y * speed, Vec3::ZERO);
            let body = add(&mut world, &body, &ShapeDefinition::new(shape.clone()));
            let half = shape.local_aabb().half_extents().y;
            run(&mut world, 3.0);
            let stands = height - half > 3.0;
            let end = position(&world, body).y;
            assert!(!stands && end < 1.0, "{shape:?} turned at {height} and is at {end}");
        }
    }
}

/// A moving platform carries what stands on it, and passes what it sinks upon.
#[test]
fn a_moving_platform_carries_and_passes() {
    let mut world = sleepless();
    floor(&mut world, 0.5);
    let lift = platform(&mut world, BodyDefinition::kinematic(), 2.0);
    let above = drop_shape(&mut world, &cube(0.3), Vec3::new(1.0, 2.3, 0.0));
    let below = drop_shape(&mut world, &cube(0.3), Vec3::new(-1.0, 0.3, 0.0));
    run(&mut world, 0.5);
    for (velocity, seconds) in [(-1.0, 1.6), (0.0, 0.5), (1.5, 2.0)] {
        world.body_mut(lift).unwrap().set_linear_velocity(Vec3::Y * velocity).unwrap();
        run(&mut world, seconds);
        let top = position(&world, lift).y + HALF;
        assert_near(position(&world, above).y, top + 0.3, 0.02, "what stands on the lift");
        if velocity <= 0.0 {
            assert_near(position(&world, below).y, 0.3, 0.01, "what the lift sinks upon");
        }
    }
    // The lift sank to 0.4 m over the floor, into the lower box; rising again it must not lift it: it came from below.
    assert_near(position(&world, below).y, 0.3, 0.01, "what the lift rises from");
}

/// Bullets from below fly through, whatever their speed; those from above are stopped.
#[test]
fn continuous_collision_lets_pass_from_below_and_stops_from_above() {
    for speed in [30.0, 100.0, 333.0] {
        for (shape, _) in [(sphere(0.05), 0.05), (cube(0.05), 0.05), (capsule(0.1, 0.05), 0.15)] {
            let mut world = weightless();
            platform(&mut world, BodyDefinition::fixed(), 0.0);
            let up = BodyDefinition::dynamic().at(Vec3::new(1.0, -5.123, 0.0)).moving(Vec3::Y * speed, Vec3::ZERO);
            let up = add(&mut world, &up, &ShapeDefinition::new(shape.clone()));
            let down = BodyDefinition::dynamic().at(Vec3::new(-1.0, 5.123, 0.0)).moving(Vec3::Y * -speed, Vec3::ZERO);
            let down = add(&mut world, &down, &ShapeDefinition::new(shape.clone()));
            run(&mut world, 30.0 * DT);
            assert_near(position(&world, up).y, -5.123 + speed * 0.5, 0.01, "way of the one from below");
            let height = position(&world, down).y;
            assert!(height > -0.01, "{shape:?} at {speed} m/s from above is at {height}");
        }
    }
}

/// A box slides from one platform to the next without a bump, and does not fall through that one.
#[test]
fn a_box_slides_from_platform_to_platform() {
    for speed in [2.0, 8.0] {
        let mut world = sleepless();
        for at in 0..4 {
            let shape = ShapeDefinition::new(cuboid(2.0, HALF, 4.0)).one_way(Vec3::Y).friction(0.0);
            add(&mut world, &BodyDefinition::fixed().at(Vec3::new(4.0 * at as f32, -HALF, 0.0)), &shape);
        }
        let shape = ShapeDefinition::new(cube(0.3)).friction(0.0);
        let block = add(&mut world, &BodyDefinition::dynamic().at(Vec3::Y * 0.3), &shape);
        run(&mut world, 0.5);
        world.body_mut(block).unwrap().set_linear_velocity(Vec3::X * speed).unwrap();
        while position(&world, block).x < 11.0 {
            world.step(DT).unwrap();
            let (place, velocity) = (position(&world, block), velocity(&world, block));
            assert!((place.y - 0.3).abs() < 0.01, "{speed} m/s: at {place}");
            assert!((velocity.x - speed).abs() < 0.02 * speed, "{speed} m/s: now {velocity}");
        }
    }
}

/// The direction is that of the shape's frame: a platform on its head, or turned as a shape, lets pass the other way.
#[test]
fn the_direction_turns_with_the_shape() {
    for by_body in [true, false] {
        let mut world = weightless();
        let over = turn(Vec3::X, 180.0);
        let (body, shape) = (BodyDefinition::fixed(), ShapeDefinition::new(cuboid(4.0, HALF, 4.0)).one_way(Vec3::Y));
        let (body, shape) = if by_body { (body.rotated(over), shape) } else { (body, shape.rotated(over)) };
        add(&mut world, &body, &shape);
        let ball = |y: f32| BodyDefinition::dynamic().at(Vec3::new(y, y, 0.0)).moving(Vec3::Y * -2.0 * y, Vec3::ZERO);
        let from_above = add(&mut world, &ball(1.0), &ShapeDefinition::new(sphere(0.2)));
        let from_below = add(&mut world, &ball(-1.0), &ShapeDefinition::new(sphere(0.2)));
        run(&mut world, 1.0);
        assert_near(position(&world, from_above).y, -1.0, 0.01, "what passes");
        assert!(position(&world, from_below).y < -0.25, "what is stopped");
    }
}

/// The flag may be set and cleared on a live shape; bad directions are refused.
#[test]
fn the_flag_may_change() {
    let mut world = sleepless();
    let body = platform(&mut world, BodyDefinition::fixed(), 2.0);
    let shape = world.body(body).unwrap().shapes()[0];
    assert_eq!(world.shape(shape).unwrap().one_way(), Some(Vec3::Y));
    assert!(world.shape_mut(shape).unwrap().set_one_way(Some(Vec3::ONE)).is_err());
    let bad = ShapeDefinition::new(cube(1.0)).one_way(Vec3::splat(f32::NAN));
    assert!(world.add_shape(body, &bad).is_err());
    world.shape_mut(shape).unwrap().set_one_way(None).unwrap();
    let ball = BodyDefinition::dynamic().at(Vec3::Y * 0.5).moving(Vec3::Y * 10.0, Vec3::ZERO);
    let ball = add(&mut world, &ball, &ShapeDefinition::new(sphere(0.3)));
    run(&mut world, 0.3);
    assert!(position(&world, ball).y < 1.6, "a solid platform stops it");
    world.shape_mut(shape).unwrap().set_one_way(Some(Vec3::Y)).unwrap();
    world.body_mut(ball).unwrap().set_position(Vec3::Y * 0.5).unwrap();
    world.body_mut(ball).unwrap().set_linear_velocity(Vec3::Y * 10.0).unwrap();
    run(&mut world, 0.3);
    assert!(position(&world, ball).y > 2.3, "it passes");
}
