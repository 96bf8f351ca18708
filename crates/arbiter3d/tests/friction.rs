//! Friction: ramps, sliding, spinning, rolling, belts.

mod common;

use arbiter3d::math::Vec3;
use arbiter3d::{Anisotropy, BodyDefinition, BodyId, BodyKind, CombineRule, Material, Shape, ShapeDefinition, World};
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

/// A ball on a ramp rolls at 5/7 g sin θ when it grips (μ > 2/7 tan θ), and slips at g (sin θ − μ cos θ) when it does
/// not.
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

/// Where two materials disagree, the later rule in the order maximum, average, geometric mean, product, minimum holds:
/// for friction and restitution apart.
#[test]
fn the_later_rule_of_two_holds() {
    let rules = [
        CombineRule::Maximum,
        CombineRule::Average,
        CombineRule::GeometricMean,
        CombineRule::Multiply,
        CombineRule::Minimum,
    ];
    let expected = [0.9_f32, 0.5, 0.3, 0.09, 0.1];
    for (i, first) in rules.into_iter().enumerate() {
        for (j, second) in rules.into_iter().enumerate() {
            let mut world = sleepless();
            let below = Material {
                friction: 0.9,
                restitution: 0.1,
                friction_combine: first,
                restitution_combine: second,
                ..Material::default()
            };
            let above = Material {
                friction: 0.1,
                restitution: 0.9,
                friction_combine: second,
                restitution_combine: CombineRule::Maximum,
                ..Material::default()
            };
            let ground = ShapeDefinition { material: below, ..ShapeDefinition::new(cuboid(9.0, 1.0, 9.0)) };
            world.add_shape(BodyId::WORLD, &ground.at(-Vec3::Y)).unwrap();
            let shape = ShapeDefinition { material: above, ..ShapeDefinition::new(cube(0.5)) };
            add(&mut world, &BodyDefinition::dynamic().at(Vec3::Y * 0.499), &shape);
            world.step(DT).unwrap();
            let data = world.arbiters().next().unwrap().data();
            assert_near(data.friction(), expected[i.max(j)], 1e-6, "friction");
            assert_near(data.restitution(), expected[j], 1e-6, "restitution");
        }
    }
}

/// A belt on a body that moves and turns: what lies on it goes with the body and along the belt, which turns with it.
#[test]
fn belts_move_and_turn_with_their_bodies() {
    let mut world = sleepless();
    let belt = ShapeDefinition::new(cuboid(50.0, 1.0, 50.0)).tangent_velocity(Vec3::X);
    let drive = BodyDefinition::kinematic().at(-Vec3::Y).moving(Vec3::Z * 3.0, Vec3::ZERO);
    add(&mut world, &drive, &belt);
    let block = drop_shape(&mut world, &cube(0.5), Vec3::Y * 0.5);
    run(&mut world, 3.0);
    assert!(velocity(&world, block).distance(Vec3::new(1.0, 0.0, 3.0)) < 0.01, "{}", velocity(&world, block));
    // A turntable with a belt: after a quarter turn the belt carries the other way. Near the axis, that is all there
    // is.
    let mut world = sleepless();
    let rate = std::f32::consts::FRAC_PI_2;
    let table = BodyDefinition::kinematic().at(-Vec3::Y).moving(Vec3::ZERO, Vec3::Y * rate);
    let table = add(&mut world, &table, &belt.friction(2.0));
    let block = drop_shape(&mut world, &cuboid(0.2, 0.1, 0.2), Vec3::Y * 0.1);
    // From rest it slips for a twentieth of a second; after that it lags by what it gains in a step, 0.18 m/s at most.
    run(&mut world, 0.1);
    for _ in 0..240 {
        world.step(DT).unwrap();
        let turned = world.body(table).unwrap().rotation();
        let carried = turned * Vec3::X + Vec3::Y.cross(position(&world, block)) * rate;
        if world.arbiters_of(block).count() > 0 && position(&world, block).length() < 3.0 {
            let lag = velocity(&world, block).distance(carried);
            let place = position(&world, block);
            assert!(lag < 0.2, "{lag} m/s behind {carried} at {place}");
        }
    }
}

/// From belt to belt a box takes the speed of each; side by side, two equal belts carry it straight on.
#[test]
fn a_box_on_two_belts_takes_their_speeds() {
    let mut world = sleepless();
    for (at, speed) in [(0.0, 1.0), (8.0, 3.0)] {
        for side in [-1.0, 1.0] {
            let belt = ShapeDefinition::new(cuboid(4.0, 1.0, 1.0)).tangent_velocity(Vec3::X * speed);
            add(&mut world, &BodyDefinition::fixed().at(Vec3::new(at, -1.0, side)), &belt);
        }
    }
    let block = drop_shape(&mut world, &cube(0.5), Vec3::new(-3.0, 0.5, 0.0));
    run(&mut world, 2.0);
    assert!(velocity(&world, block).distance(Vec3::X) < 0.01, "on the first: {}", velocity(&world, block));
    while position(&world, block).x < 6.5 {
        world.step(DT).unwrap();
    }
    assert!(velocity(&world, block).distance(Vec3::X * 3.0) < 0.02, "on the second: {}", velocity(&world, block));
    assert!(position(&world, block).z.abs() < 0.01 && (position(&world, block).y - 0.5).abs() < 0.01);
    assert!(spin(&world, block).length() < 0.02);
}

/// A belt that is switched on wakes what sleeps on it, and a slow one lets nothing on it fall asleep.
#[test]
fn a_running_belt_keeps_what_it_carries_awake() {
    for kind in [BodyKind::Static, BodyKind::Kinematic] {
        let mut world = world();
        let body = BodyDefinition { kind, ..BodyDefinition::dynamic() }.at(-Vec3::Y);
        let belt = add(&mut world, &body, &ShapeDefinition::new(cuboid(50.0, 1.0, 50.0)));
        let belt = world.body(belt).unwrap().shapes()[0];
        let block = drop_shape(&mut world, &cube(0.5), Vec3::Y * 0.5);
        run(&mut world, 3.0);
        assert!(!world.body(block).unwrap().is_awake());
        // Slower than what counts as rest.
        let running = Material { tangent_velocity: Vec3::X * 0.03, ..Material::default() };
        world.shape_mut(belt).unwrap().set_material(running).unwrap();
        let start = position(&world, block).x;
        run(&mut world, 10.0);
        assert_near(position(&world, block).x - start, 0.3, 0.01, "way in 10 s");
        assert!(world.body(block).unwrap().is_awake());
        world.shape_mut(belt).unwrap().set_material(Material::default()).unwrap();
        run(&mut world, 3.0);
        assert!(!world.body(block).unwrap().is_awake(), "the belt has stopped");
    }
}

/// A box with easy friction along its own x axis, on a ramp of 30° (tan 0.577), its axis `yaw` away from downhill.
fn skid(yaw: f32, friction: f32, ratio: f32) -> (World, BodyId) {
    let mut world = sleepless();
    let tilt = turn(Vec3::Z, -SLOPE);
    let ramp = BodyDefinition::fixed().at(tilt * -Vec3::Y).rotated(tilt);
    add(&mut world, &ramp, &ShapeDefinition::new(cuboid(200.0, 1.0, 200.0)).friction(friction));
    let rotation = tilt * turn(Vec3::Y, yaw);
    let body = BodyDefinition::dynamic().at(tilt * Vec3::Y * 0.1).rotated(rotation);
    let shape = ShapeDefinition::new(cuboid(0.5, 0.1, 0.5)).friction(friction).anisotropy(Vec3::X, ratio);
    let body = add(&mut world, &body, &shape);
    (world, body)
}

/// Along its easy axis a box slides at g (sin θ − μ₁ cos θ), across it sticks; one that is not steep enough sticks both
/// ways.
#[test]
fn a_skid_slides_along_its_axis_and_sticks_across() {
    for (ratio, yaw) in [(0.1, 0.0), (0.1, 180.0), (0.5, 0.0), (0.01, 0.0)] {
        let (mut world, body) = skid(yaw, 0.8, ratio);
        run(&mut world, 0.5);
        let speed = velocity(&world, body).dot(downhill());
        run(&mut world, 2.0);
        let gained = (velocity(&world, body).dot(downhill()) - speed) / 2.0;
        assert_relative(gained, GRAVITY * (0.5 - 0.8 * ratio * 0.866_025_4), 0.01, "acceleration");
        assert!(velocity(&world, body).z.abs() < 0.01);
    }
    // Across, and along with 0.8 · 0.8 = 0.64 > 0.577; a ratio above one turns the axes round.
    for (ratio, yaw) in [(0.1, 90.0), (0.01, -90.0), (0.8, 0.0), (8.0, 0.0)] {
        let (mut world, body) = skid(yaw, if ratio > 1.0 { 0.1 } else { 0.8 }, ratio);
        let start = position(&world, body);
        run(&mut world, 4.0);
        let moved = position(&world, body).distance(start);
        assert!(moved < 2e-3, "ratio {ratio}, yaw {yaw}: moved {moved} m");
    }
}

/// A skid at an angle runs along itself, but for what an ellipse of friction must let go: where friction across bears
/// the share `s` of what it could, `√(1 − s²)` of the friction along is left, and the drift is `r s / √(1 − s²)` of the
/// speed.
#[test]
fn a_skid_at_an_angle_runs_along_itself() {
    for (yaw, ratio) in [(30.0, 0.05), (45.0, 0.05), (-60.0, 0.05), (45.0, 0.02), (60.0, 0.01)] {
        let (mut world, body) = skid(yaw, 0.8, ratio);
        let along = world.body(body).unwrap().rotation() * Vec3::X;
        run(&mut world, 2.0);
        let v = velocity(&world, body);
        let speed = v.dot(along).abs();
        let (limit, pull) = (GRAVITY * 0.8 * 0.866_025_4, along.dot(downhill()).abs());
        let share = GRAVITY * 0.5 * (1.0 - pull * pull).sqrt() / limit;
        let rest = (1.0 - share * share).sqrt();
        let what = format!("yaw {yaw}, ratio {ratio}");
        assert_relative(speed, 2.0 * (GRAVITY * 0.5 * pull - ratio * limit * rest), 0.02, &what);
        assert_relative((v - v.dot(along) * along).length(), speed * ratio * share / rest, 0.05, &what);
    }
}

/// On a flat floor a skid that is kicked at 45° loses its motion across at μg, and goes on along itself.
#[test]
fn a_kicked_skid_turns_into_its_line() {
    let mut world = sleepless();
    floor(&mut world, 0.5);
    let shape = ShapeDefinition::new(cuboid(0.5, 0.1, 0.5)).friction(0.5).anisotropy(Vec3::X, 0.02);
    let body = add(&mut world, &BodyDefinition::dynamic().at(Vec3::Y * 0.1), &shape);
    run(&mut world, 0.2);
    world.body_mut(body).unwrap().set_linear_velocity(Vec3::new(4.0, 0.0, 4.0)).unwrap();
    run(&mut world, 1.2);
    let v = velocity(&world, body);
    assert!(v.z.abs() < 0.02, "across: {} m/s", v.z);
    assert!((3.5..4.0).contains(&v.x), "along: {} m/s", v.x);
}

/// The direction is the shape's: it turns with the shape on its body, and belongs to whichever of the two shapes has
/// it.
#[test]
fn the_direction_of_friction_is_that_of_the_shape() {
    for by_ground in [true, false] {
        let mut world = sleepless();
        let grain = Anisotropy::new(Vec3::X, 0.1);
        let material = Material { friction: 0.5, anisotropy: Some(grain), ..Material::default() };
        let plain = Material { friction: 0.5, ..Material::default() };
        let turned = turn(Vec3::Y, 90.0);
        let [below, above] = if by_ground { [material, plain] } else { [plain, material] };
        let ground = ShapeDefinition { material: below, ..ShapeDefinition::new(cuboid(50.0, 1.0, 50.0)) };
        world.add_shape(BodyId::WORLD, &ground.at(-Vec3::Y).rotated(turned)).unwrap();
        let shape = ShapeDefinition { material: above, ..ShapeDefinition::new(cuboid(0.5, 0.1, 0.5)) };
        let bodies = [Vec3::X, Vec3::Z].map(|way| {
            let body = BodyDefinition::dynamic().at(Vec3::Y * 0.1 + way * 9.0).moving(way * 5.0, Vec3::ZERO);
            add(&mut world, &body, &shape.clone().rotated(turned))
        });
        run(&mut world, 0.5);
        let [across, along] = bodies.map(|body| velocity(&world, body));
        assert_near(across.x, 5.0 - 0.5 * 0.5 * GRAVITY, 0.1, "speed across");
        assert_near(along.z, 5.0 - 0.5 * 0.05 * GRAVITY, 0.1, "speed along");
        let data = world.arbiters_of(bodies[0]).next().unwrap().data();
        let (direction, ratio) = data.anisotropy().unwrap();
        assert!(direction.z.abs() > 0.999 && ratio == 0.1, "{direction}");
    }
}

/// Bad anisotropies are refused, and one may be set on an arbiter, where it stays.
#[test]
fn anisotropy_is_checked_and_may_be_set_on_an_arbiter() {
    let mut world = sleepless();
    let ground = floor(&mut world, 0.5);
    let bad =
        [(Vec3::ONE, 0.5), (Vec3::splat(f32::NAN), 0.5), (Vec3::X, 0.0), (Vec3::X, -1.0), (Vec3::X, f32::INFINITY)];
    for (direction, ratio) in bad {
        let shape = ShapeDefinition::new(cube(0.5)).anisotropy(direction, ratio);
        assert!(world.add_shape(BodyId::WORLD, &shape).is_err(), "{direction} {ratio}");
        assert!(world.shape_mut(ground).unwrap().set_material(shape.material).is_err());
    }
    let body = drop_shape(&mut world, &cuboid(0.5, 0.1, 0.5), Vec3::Y * 0.1);
    world.step(DT).unwrap();
    let id = world.arbiters_of(body).next().unwrap().id();
    for (direction, ratio) in bad {
        assert!(world.arbiter_mut(id).unwrap().data_mut().set_anisotropy(Some((direction, ratio))).is_err());
    }
    world.arbiter_mut(id).unwrap().data_mut().set_anisotropy(Some((Vec3::X, 0.1))).unwrap();
    world.body_mut(body).unwrap().set_linear_velocity(Vec3::X * 5.0).unwrap();
    run(&mut world, 1.0);
    assert_near(velocity(&world, body).x, 5.0 - 0.05 * GRAVITY, 0.05, "speed after a second");
}

/// A plate that twists on the spot is braked by the friction that its corners have the way they slide there: of a point at
/// (x, z) seen from the middle, the friction ellipse leaves `μ √((ratio z)² + x²)` as torque a newton, if it is `ratio`
/// times smaller along x.
#[test]
fn a_twisting_plate_is_braked_by_the_friction_ellipse() {
    let (half, friction) = (Vec3::new(0.6, 0.1, 0.3), 0.4);
    for (direction, ratio, lever) in [
        (Vec3::X, 1.0, (0.36_f32 + 0.09).sqrt()),
        (Vec3::X, 0.1, (0.36_f32 + 0.0009).sqrt()),
        (Vec3::Z, 0.1, (0.0036_f32 + 0.09).sqrt()),
    ] {
        let mut world = sleepless();
        floor(&mut world, 0.0);
        let plate = ShapeDefinition::new(Shape::cuboid(half).unwrap()).friction(friction).rolling_resistance(0.0);
        let plate = if ratio < 1.0 { plate.anisotropy(direction, ratio) } else { plate };
        let body = add(&mut world, &BodyDefinition::dynamic().at(Vec3::Y * 0.1), &plate);
        run(&mut world, 0.3);
        world.body_mut(body).unwrap().set_angular_velocity(Vec3::Y * 6.0).unwrap();
        run(&mut world, 0.25);
        let mass = world.body(body).unwrap().mass_properties();
        let braking = friction * GRAVITY * mass.mass * lever / mass.inertia.yy;
        assert_relative(6.0 - spin(&world, body).y, braking * 0.25, 0.02, "spin lost");
        assert!(velocity(&world, body).length() < 0.02, "stays: {}", velocity(&world, body));
    }
}
