//! The voxel terrain of the example of that name: bodies rest and sleep on contacts that the engine is told, not on shapes.

#[path = "../examples/voxel_terrain/terrain.rs"]
mod terrain;

use arbiter3d::math::Vec3;
use arbiter3d::*;
use terrain::{Ground, Terrain, Voxel, rain};

const DT: f32 = 1.0 / 60.0;

/// The rain after it has come to rest, and how many steps that took.
fn settled(threads: usize) -> (World, Ground, Vec<BodyId>, usize) {
    let mut world = World::new(WorldSettings { threads, ..WorldSettings::default() }).unwrap();
    let ground = Ground::add_to(&mut world, Terrain::hills()).unwrap();
    let bodies = rain(&mut world, &ground).unwrap();
    let mut steps = 0;
    while world.awake_count() > 0 && steps < 1800 {
        world.step(DT).unwrap();
        steps += 1;
    }
    (world, ground, bodies, steps)
}

fn voxel_at(position: Vec3) -> Voxel {
    position.floor().as_ivec3().to_array()
}

/// Points of a body and how far it reaches down from each: a capsule that leans over a ledge is lower at one end.
fn parts_below(world: &World, body: BodyId) -> Vec<(Vec3, f32)> {
    let body = world.body(body).unwrap();
    let shape = world.shape(body.shapes()[0]).unwrap();
    match shape.geometry() {
        Shape::Capsule(capsule) => {
            let end = body.rotation() * Vec3::Y * capsule.half_length();
            vec![(body.position() + end, capsule.radius()), (body.position() - end, capsule.radius())]
        }
        _ => vec![(body.position(), body.position().y - shape.aabb().min.y)],
    }
}

#[test]
fn five_hundred_bodies_rest_and_sleep_on_voxels() {
    let (world, ground, bodies, steps) = settled(1);
    assert_eq!((world.sleeping_count(), bodies.len()), (500, 500), "after {steps} steps");
    assert!(world.shape(ShapeId::from_raw(0)).is_none() && world.body(BodyId::WORLD).unwrap().shapes().is_empty());
    assert!(world.deepest_penetration() < 0.01, "{} m", world.deepest_penetration());
    for &body in &bodies {
        let position = world.body(body).unwrap().position();
        assert!(!ground.terrain().is_solid(voxel_at(position)), "{body:?} is in the ground at {position}");
        let [x, y, z] = voxel_at(position);
        assert!(y >= 4 && (1..63).contains(&x) && (1..63).contains(&z), "{body:?} has left at {position}");
        for (middle, reach) in parts_below(&world, body) {
            let [x, y, z] = voxel_at(middle);
            let lowest = middle.y - reach;
            let depth = (y - 1..=y).filter(|&y| ground.terrain().is_solid([x, y, z])).map(|y| (y + 1) as f32 - lowest);
            assert!(depth.fold(0.0, f32::max) < 0.011, "{body:?} sticks in the ground at {middle}");
        }
    }
    world.validate().unwrap();
}

#[test]
fn voxel_contacts_give_the_same_bits_on_any_number_of_threads() {
    let (one, _, _, steps) = settled(1);
    let (two, _, _, steps_of_two) = settled(2);
    assert_eq!((steps, one.hash()), (steps_of_two, two.hash()));
}

/// Bodies that stand on a voxel, with all that are tied to them.
fn standing_on(world: &World, ground: &Ground, bodies: &[BodyId], voxel: Voxel) -> Vec<BodyId> {
    let islands = world.islands();
    let island = |body: &BodyId| islands[body.index() as usize];
    let touching = bodies.iter().filter(|&&body| ground.voxels_under(world, body).contains(&voxel));
    let theirs: Vec<u32> = touching.map(island).collect();
    bodies.iter().copied().filter(|body| theirs.contains(&island(body))).collect()
}

#[test]
fn a_dug_out_voxel_wakes_only_what_stood_on_it() {
    let (mut world, ground, bodies, _) = settled(1);
    let mut woken = 0;
    for &body in bodies.iter().step_by(50) {
        let voxel = ground.voxels_under(&world, body).into_iter().max_by_key(|voxel| voxel[1]).expect("it rests");
        let stood = standing_on(&world, &ground, &bodies, voxel);
        let ended = ground.dig(&mut world, voxel).unwrap();
        let awake: Vec<BodyId> = bodies.iter().copied().filter(|&body| world.body(body).unwrap().is_awake()).collect();
        assert_eq!(awake, stood);
        assert_eq!(world.drain_end_events().filter(|end| end.reason == EndReason::ArbiterRemoved).count(), ended);
        woken += awake.len();
        for _ in 0..600 {
            world.step(DT).unwrap();
        }
        assert_eq!(world.awake_count(), 0, "all sleep again");
        world.validate().unwrap();
    }
    assert!((10..250).contains(&woken), "{woken} of 500 woken by 10 voxels");
}

#[test]
fn a_ball_on_a_dug_out_voxel_falls_to_the_next_one() {
    let (mut world, ground, bodies, _) = settled(1);
    let is_lone_ball = |&&body: &&BodyId| {
        let shape = world.shape(world.body(body).unwrap().shapes()[0]).unwrap();
        let voxels = ground.voxels_under(&world, body);
        let below = voxel_at(world.body(body).unwrap().position() - Vec3::Y);
        matches!(shape.geometry(), Shape::Sphere(_))
            && world.arbiters_of(body).count() == 1
            && voxels == [below]
            && standing_on(&world, &ground, &bodies, below) == [body]
    };
    let lone_balls: Vec<BodyId> = bodies.iter().filter(is_lone_ball).take(5).copied().collect();
    assert_eq!(lone_balls.len(), 5);
    for ball in lone_balls {
        let voxel = ground.voxels_under(&world, ball)[0];
        let before = world.body(ball).unwrap().position();
        assert_eq!(ground.dig(&mut world, voxel).unwrap(), 1);
        for _ in 0..600 {
            world.step(DT).unwrap();
            assert!(world.awake_count() <= 1, "nobody else wakes");
        }
        let after = world.body(ball).unwrap();
        assert!(!after.is_awake());
        assert!((before.y - after.position().y - 1.0).abs() < 0.01, "{before} to {}", after.position());
        assert!(ground.voxels_under(&world, ball).contains(&[voxel[0], voxel[1] - 1, voxel[2]]));
    }
}

/// A ball and a box that slide over a plain of many voxels never feel an edge between two of them.
#[test]
fn edges_between_voxels_of_a_plain_give_no_bump() {
    for shape in [
        Shape::sphere(0.35).unwrap(),
        Shape::cuboid(Vec3::new(0.3, 0.2, 0.4)).unwrap(),
        Shape::capsule(0.3, 0.25).unwrap(),
    ] {
        let height = match &shape {
            Shape::Cuboid(_) => 0.2,
            Shape::Sphere(_) => 0.35,
            _ => 0.25,
        };
        let mut world = World::default();
        Ground::add_to(&mut world, Terrain::new(|_, _| 5)).unwrap();
        let sideways = math::Quat::from_xyzw(0.0, 0.0, 0.5_f32.sqrt(), 0.5_f32.sqrt());
        let turn = if matches!(shape, Shape::Capsule(_)) { sideways } else { math::Quat::IDENTITY };
        let start = BodyDefinition::dynamic().at(Vec3::new(5.3, 5.0 + height - 0.004, 8.1)).rotated(turn);
        let body = world.add_body(&BodyDefinition { can_sleep: false, ..start }).unwrap();
        world.add_shape(body, &ShapeDefinition::new(shape).friction(0.0).rolling_resistance(0.0)).unwrap();
        for _ in 0..60 {
            world.step(DT).unwrap();
        }
        world.body_mut(body).unwrap().set_linear_velocity(Vec3::new(6.0, 0.0, 3.5)).unwrap();
        for step in 0..300 {
            world.step(DT).unwrap();
            let velocity = world.body(body).unwrap().linear_velocity();
            assert!(velocity.y.abs() < 1e-3, "step {step}: {velocity}");
            assert!((velocity - Vec3::new(6.0, velocity.y, 3.5)).length() < 1e-3, "step {step}: {velocity}");
        }
    }
}
