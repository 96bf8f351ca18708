//! Bodies on a terrain of 64 × 64 × 32 voxels that the engine knows nothing of: a first collision system of one's own.
//!
//! All of it is in `terrain.rs`; finding the contacts takes some 80 lines. Run with
//! `cargo run --release -p arbiter3d --example voxel_terrain`.

mod terrain;

use arbiter3d::{Error, World};
use terrain::{Ground, Terrain, rain};

/// Seconds a step.
const DT: f32 = 1.0 / 60.0;

fn main() -> Result<(), Error> {
    let mut world = World::default();
    let ground = Ground::add_to(&mut world, Terrain::hills())?;
    let bodies = rain(&mut world, &ground)?;
    println!("{} bodies fall on 64 x 64 x 32 voxels; the terrain has no shape at all.", bodies.len());

    let mut seconds = 0;
    while world.awake_count() > 0 && seconds < 60 {
        for _ in 0..60 {
            world.step(DT)?;
        }
        seconds += 1;
        let (awake, arbiters, contacts) = (world.awake_count(), world.arbiter_count(), world.contact_count());
        println!("{seconds:3} s: {awake:3} awake, {arbiters:4} arbiters, {contacts:4} contacts");
    }
    println!("Deepest overlap at rest: {:.1} mm.", 1e3 * world.deepest_penetration());

    // Dig under the first body that stands on one voxel only: it falls to the next one, and no other body wakes.
    let alone = |body: &&arbiter3d::BodyId| {
        ground.voxels_under(&world, **body).len() == 1 && world.arbiters_of(**body).count() == 1
    };
    let Some(&body) = bodies.iter().find(alone) else { return Ok(()) };
    let voxel = ground.voxels_under(&world, body)[0];
    let before = world.body(body).map_or(0.0, |body| body.position().y);
    let ended = ground.dig(&mut world, voxel)?;
    println!("Voxel {voxel:?} is dug out: {ended} arbiter ends, {} body wakes.", world.awake_count());
    while world.awake_count() > 0 {
        world.step(DT)?;
    }
    let after = world.body(body).map_or(0.0, |body| body.position().y);
    println!("It fell by {:.2} m to {:?} and sleeps again.", before - after, ground.voxels_under(&world, body));
    Ok(())
}
