//! The scenes whose outcome is known do what a formula or other engines say.

use arbiter3d::{
    BodyId, BodyKind, World,
    math::{Rotation, Vec3},
};
use arbiter3d_scenes::{BuiltScene, SceneOptions, find};

fn built(name: &str) -> BuiltScene {
    find(name).unwrap().build(&SceneOptions::default()).unwrap()
}

fn run(scene: &mut BuiltScene, steps: usize) {
    for step in 0..steps {
        let report = scene.step(step).unwrap();
        assert!(report.frozen.is_empty(), "step {step} froze {:?}", report.frozen);
    }
}

fn dynamic(world: &World) -> Vec<BodyId> {
    world.bodies().filter(|&id| world.body(id).unwrap().kind() == BodyKind::Dynamic).collect()
}

fn positions(world: &World) -> Vec<Vec3> {
    dynamic(world).iter().map(|&id| world.body(id).unwrap().position()).collect()
}

fn mean_height(world: &World) -> f64 {
    let positions = positions(world);
    positions.iter().map(|p| f64::from(p.y)).sum::<f64>() / positions.len() as f64
}

/// Boxes with friction μ on 30° slide at g (sin 30° − μ cos 30°), or not at all where that is below zero.
#[test]
fn boxes_on_the_ramp_slide_as_coulomb_says() {
    let mut scene = built("ramps");
    let start = positions(&scene.world);
    let seconds = 2.0;
    run(&mut scene, 120);
    for (index, (before, after)) in start.iter().zip(positions(&scene.world)).enumerate() {
        let friction = 0.1 * index as f64;
        let acceleration = 9.81 * (0.5 - friction * 0.75_f64.sqrt());
        let moved = f64::from((after - *before).length());
        if acceleration > 0.0 {
            let expected = 0.5 * acceleration * seconds * seconds;
            assert!((moved / expected - 1.0).abs() < 0.02, "friction {friction}: {moved} m, expected {expected} m");
        } else {
            assert!(moved < 0.01, "friction {friction} slid {moved} m");
        }
    }
}

/// Without friction nothing on a level floor slows down, rises or turns off, whatever the floor is made of: 16 m each.
#[test]
fn a_floor_of_boxes_feels_like_one() {
    let mut scene = built("box_floor_slide");
    let start = positions(&scene.world);
    run(&mut scene, 240);
    for (from, to) in start.iter().zip(positions(&scene.world)) {
        let along = Vec3::new(from.x, 0.0, from.z) / 3.0;
        let expected = *from + along * 16.0;
        assert!((to - expected).length() < 0.005, "from {from} to {to}, not {expected}");
    }
}

/// Compounds fill the pit and stay in it, and lie still.
#[test]
fn compounds_come_to_rest_in_the_pit() {
    let options = SceneOptions { size: Some(192), ..SceneOptions::default() };
    let mut scene = find("compound_rain").unwrap().build(&options).unwrap();
    run(&mut scene, 600);
    for id in dynamic(&scene.world) {
        let body = scene.world.body(id).unwrap();
        let at = body.position();
        assert!(at.y > 0.0 && at.x.abs() < 12.0 && at.z.abs() < 12.0, "{id:?} at {at}");
        assert!(body.linear_velocity().length() < 0.3, "{id:?} moves at {}", body.linear_velocity());
    }
    assert!(scene.world.deepest_penetration() < 0.02, "{} m", scene.world.deepest_penetration());
}

/// Cans and ellipsoids fill their pit and stay in it, and hardly move after five seconds.
#[test]
fn heaps_of_cans_and_ellipsoids_come_to_rest_in_the_pit() {
    for name in ["cans", "ellipsoids"] {
        let options = SceneOptions { size: Some(300), ..SceneOptions::default() };
        let mut scene = find(name).unwrap().build(&options).unwrap();
        run(&mut scene, 300);
        for id in dynamic(&scene.world) {
            let body = scene.world.body(id).unwrap();
            let at = body.position();
            assert!(at.y > 0.18 && at.x.abs() < 3.81 && at.z.abs() < 3.81, "{name}: {id:?} at {at}");
            let speed = body.linear_velocity().length();
            assert!(speed < 0.5, "{name}: {id:?} moves at {speed} m/s");
        }
        let deepest = scene.world.deepest_penetration();
        assert!(deepest < 0.015, "{name}: {deepest} m");
    }
}

/// A ball with restitution e that falls from h rises to e² h.
#[test]
fn balls_rise_by_the_square_of_their_restitution() {
    let mut scene = built("bounce");
    let mut has_bounced = [false; 11];
    let mut top = [0.0_f32; 11];
    for step in 0..150 {
        scene.step(step).unwrap();
        for (index, &id) in dynamic(&scene.world).iter().enumerate() {
            let body = scene.world.body(id).unwrap();
            // The first rise ends where the ball falls again.
            has_bounced[index] |= body.linear_velocity().y > 0.0;
            let falls_again = has_bounced[index] && body.linear_velocity().y < -1.0;
            if has_bounced[index] && !falls_again && step < 122 {
                top[index] = top[index].max(body.position().y - 0.5);
            }
        }
    }
    for (index, top) in top.iter().enumerate().skip(3) {
        let expected = 5.0 * (0.1 * index as f32) * (0.1 * index as f32);
        assert!(
            (top - expected).abs() < 0.02 * expected + 0.02,
            "restitution 0.{index}: {top} m, expected {expected} m"
        );
    }
}

/// The handle flips 37 times in 20 s, by the exact motion of a free body.
#[test]
fn the_handle_flips_as_often_as_euler_says() {
    let mut scene = built("t_handle");
    let handle = dynamic(&scene.world)[0];
    let mut flips = 0;
    let mut last = 1.0;
    for step in 0..scene.steps {
        scene.step(step).unwrap();
        let body = scene.world.body(handle).unwrap();
        let spin = Rotation::from_quat(body.rotation()).inverse_rotate(body.angular_velocity()).x;
        if spin * last < 0.0 {
            flips += 1;
        }
        last = spin;
    }
    assert!((36..=38).contains(&flips), "{flips} flips");
}

/// After 100 steps the colosseum stands where it stands on other engines.
#[test]
fn the_colosseum_stands() {
    let mut scene = built("colosseum");
    run(&mut scene, 100);
    let mean = mean_height(&scene.world);
    assert!((mean - 8.13).abs() < 0.02, "mean height {mean}");
}

/// After 200 steps every cube of the large pyramid is over the same cubes: the stack of 100 has sunk by less than
/// 1.5 cm a row, and nothing has slid or left its plane.
#[test]
fn the_large_pyramid_stands() {
    let mut scene = built("large_pyramid");
    let before = positions(&scene.world);
    run(&mut scene, 200);
    for (before, after) in before.iter().zip(positions(&scene.world)) {
        let moved = after - *before;
        let rows = before.y + 0.5;
        assert!(moved.x.abs() < 0.4 && moved.z.abs() < 0.2, "from {before} to {after}");
        assert!(moved.y <= 0.01 && moved.y > -0.015 * rows - 0.01, "from {before} to {after}");
    }
}

/// The ball breaks the colosseum: it had slept or stood before, and has lost height after.
#[test]
fn the_ball_breaks_the_colosseum() {
    let mut scene =
        find("colosseum_break").unwrap().build(&SceneOptions { size: Some(3), ..SceneOptions::default() }).unwrap();
    run(&mut scene, 120);
    let stood = mean_height(&scene.world);
    for step in 120..300 {
        scene.step(step).unwrap();
    }
    let fallen = mean_height(&scene.world);
    assert!(fallen < stood - 0.2, "mean height {stood} m, then {fallen} m");
}

/// Bodies that start asleep stay so: only the hundred balls are ever awake.
#[test]
fn the_field_sleeps_from_the_start() {
    let options = SceneOptions { size: Some(1000), ..SceneOptions::default() };
    let mut scene = find("sleeping_field").unwrap().build(&options).unwrap();
    for step in 0..10 {
        scene.step(step).unwrap();
        assert_eq!((scene.world.awake_count(), scene.world.sleeping_count()), (100, 1000), "step {step}");
    }
}

/// A world in which all sleep stays as it is, to the bit.
#[test]
fn nothing_wakes_in_an_idle_world() {
    let options = SceneOptions { size: Some(1000), ..SceneOptions::default() };
    let mut scene = find("sleeping_all").unwrap().build(&options).unwrap();
    scene.step(0).unwrap();
    let hash = scene.world.hash();
    run(&mut scene, 100);
    assert_eq!((scene.world.awake_count(), scene.world.sleeping_count()), (0, 1000));
    assert_eq!(scene.world.hash(), hash);
}

/// Every kind of shape comes to rest on the waves: above them, hardly sunk in, and of 960 bodies no more than six go on rocking.
#[test]
fn the_shape_parade_comes_to_rest() {
    let restless: usize = (0..5).map(restless_in_parade).sum();
    assert!(restless <= 6, "{restless} go on rocking");
}

/// Bodies of a parade that move for most of its fifteenth second. Heaps in the valleys are one island each, which one of them
/// keeps awake: so they are counted rather than those awake.
fn restless_in_parade(seed: u64) -> usize {
    let options = SceneOptions { seed, ..SceneOptions::default() };
    let mut scene = find("shape_parade").unwrap().build(&options).unwrap();
    run(&mut scene, 840);
    let ids = dynamic(&scene.world);
    let mut moving = vec![0; ids.len()];
    for _ in 0..60 {
        run(&mut scene, 1);
        for (count, id) in moving.iter_mut().zip(&ids) {
            let body = scene.world.body(*id).unwrap();
            let speed = body.linear_velocity().length() + 0.3 * body.angular_velocity().length();
            *count += u32::from(speed > 0.05);
        }
    }
    let world = &scene.world;
    // An origin may be at a shape's corner: its centre of mass is inside.
    let height = |id: &BodyId| world.body(*id).unwrap().center_of_mass().y;
    let lowest = ids.iter().map(height).fold(f32::MAX, f32::min);
    assert!(lowest > -0.4, "seed {seed}: {lowest} is below the waves' lowest point");
    assert!(world.deepest_penetration() < 0.02, "seed {seed}: {}", world.deepest_penetration());
    let speeds = ids.iter().map(|id| world.body(*id).unwrap().linear_velocity().length()).sum::<f32>();
    let mean = speeds / ids.len() as f32;
    assert!(mean < 0.02, "seed {seed}: mean speed {mean} m/s");
    let restless = moving.iter().filter(|&&count| count > 30).count();
    println!("seed {seed}: {} awake, {restless} restless, mean speed {mean} m/s", world.awake_count());
    restless
}

/// What is held by continuous collision moves on: nothing that is faster than a metre a second stays where it is for more than ten
/// steps of the first four seconds.
#[test]
fn nothing_hangs_where_it_touches() {
    for seed in [0, 11, 34, 44] {
        let options = SceneOptions { seed, ..SceneOptions::default() };
        let mut scene = find("shape_parade").unwrap().build(&options).unwrap();
        let ids = dynamic(&scene.world);
        let mut held = vec![0; ids.len()];
        for _ in 0..240 {
            let before: Vec<Vec3> = ids.iter().map(|id| scene.world.body(*id).unwrap().center_of_mass()).collect();
            run(&mut scene, 1);
            for ((count, id), before) in held.iter_mut().zip(&ids).zip(&before) {
                let body = scene.world.body(*id).unwrap();
                let speed = body.linear_velocity().length();
                let moved = (body.center_of_mass() - *before).length();
                *count += u32::from(speed > 1.0 && moved < 0.2 * speed / 60.0);
            }
        }
        for (count, id) in held.iter().zip(&ids) {
            assert!(*count <= 10, "seed {seed}: {id:?} hangs for {count} steps");
        }
    }
}

/// What is thrown up through one-way platforms stands on the floor that it was thrown at, and the lift carries its
/// load.
#[test]
fn bodies_stand_on_the_floors_that_they_passed() {
    let mut scene = built("one_way_platforms");
    run(&mut scene, 360);
    let places = positions(&scene.world);
    for (column, place) in places[..10].iter().enumerate() {
        let top = 3.0 * (1 + column % 5) as f32;
        // The least is that of a rock on its flattest side, 0.2 m, the most that of the capsule on its end, 0.7 m.
        assert!((0.2..0.72).contains(&(place.y - top)), "column {column}: at {place}, floor at {top}");
    }
    // The lift was half a metre under the ground and rises at 1 m/s.
    let carried = places[10].y - 0.4 - 0.1;
    assert!((carried - (360.0 / 60.0 - 0.5)).abs() < 0.05, "the lift's load is at {carried}");
}

/// Boxes go round on the belts at nearly 2 m/s; skids slide along themselves by what gravity does there, and stick
/// across.
#[test]
fn belts_carry_round_and_skids_slide_along_themselves() {
    let mut scene = built("conveyors");
    let start = positions(&scene.world);
    run(&mut scene, 120);
    for (index, (before, after)) in start[8..].iter().zip(&positions(&scene.world)[8..]).enumerate() {
        let turned = (15.0 * index as f32).to_radians();
        let (along, across) = (9.81 * 0.5 * turned.cos(), 9.81 * 0.5 * turned.sin());
        // Friction across bears its part of gravity; of the friction along, the rest of the ellipse is left.
        let limit = 9.81 * 0.8 * 0.75_f32.sqrt();
        let acceleration = along - 0.1 * limit * (1.0 - (across / limit).powi(2)).sqrt();
        let expected = 2.0 * acceleration.max(0.0);
        let moved = (*after - *before).length();
        assert!((moved - expected).abs() < 0.02 * expected + 0.01, "skid {index} moved {moved} m, not {expected} m");
    }
    let (mut way, mut last) = ([0.0; 8], positions(&scene.world));
    for step in 120..600 {
        scene.step(step).unwrap();
        let now = positions(&scene.world);
        for (index, way) in way.iter_mut().enumerate() {
            let (place, out) = (now[index], now[index].x.abs().max(now[index].z.abs()));
            assert!((place.y - 1.25).abs() < 0.01 && (2.9..5.1).contains(&out), "step {step}: box {index} at {place}");
            *way += (place - last[index]).length();
        }
        last = now;
    }
    for (index, way) in way.iter().enumerate() {
        assert!((13.0..16.1).contains(way), "box {index} has come {way} m in 8 s");
    }
}

/// The driven gear turns half as fast the other way: after 5 s it has turned by 5 rad, in the last second by 1 rad, at a speed
/// that flanks of five facets let waver by a tenth. No tooth sinks into another by more than 3 mm.
#[test]
fn the_large_gear_turns_half_as_fast() {
    let mut scene = built("gears");
    let driven = dynamic(&scene.world)[0];
    let (mut turned, mut last_second, mut deepest) = (0.0, 0.0, 0.0_f32);
    for step in 0..300 {
        scene.step(step).unwrap();
        let speed = f64::from(scene.world.body(driven).unwrap().angular_velocity().z);
        assert!(step < 60 || (speed + 1.0).abs() < 0.1, "step {step}: {speed} rad/s");
        turned += speed / 60.0;
        last_second += if step >= 240 { speed / 60.0 } else { 0.0 };
        for arbiter in scene.world.arbiters() {
            deepest = arbiter.data().contacts().fold(deepest, |m, (_, contact)| m.min(contact.separation()));
        }
    }
    assert!((turned + 5.0).abs() < 0.1, "turned by {turned} rad");
    assert!((last_second + 1.0).abs() < 0.02, "{last_second} rad in the last second");
    assert!(deepest > -3e-3, "{deepest} m");
}

/// Nothing falls between the tiles: after 10 s all bodies are on the waves, and nearly all lie still.
#[test]
fn bodies_on_tiles_of_height_fields_come_to_rest() {
    let mut scene = built("height_field_tiles");
    run(&mut scene, 600);
    let mut still = 0;
    for id in dynamic(&scene.world) {
        let body = scene.world.body(id).unwrap();
        let p = body.position();
        let ground = 0.8 * libm::sin(0.4 * f64::from(p.x)) * libm::sin(0.3 * f64::from(p.z));
        assert!(f64::from(p.y) > ground + 0.2, "{p} over {ground}");
        still += usize::from(body.linear_velocity().length() < 0.1);
    }
    assert!(still >= 180, "{still} of 200");
}
