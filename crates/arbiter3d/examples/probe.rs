//! probe
use arbiter3d::{math::*, *};
fn main() {
    let base: usize = std::env::args().nth(1).map_or(20, |a| a.parse().unwrap());
    let steps: usize = std::env::args().nth(2).map_or(200, |a| a.parse().unwrap());
    let threads: usize = std::env::args().nth(3).map_or(1, |a| a.parse().unwrap());
    let simd = std::env::args().nth(4).map(|a| a.parse().unwrap());
    let mut world =
        World::new(WorldSettings { threads, simd, allow_sleep: false, ..WorldSettings::default() }).unwrap();
    let ground = Shape::cuboid(Vec3::new(400.0, 1.0, 400.0)).unwrap();
    world.add_shape(BodyId::WORLD, &ShapeDefinition::new(ground).at(Vec3::new(0.0, -1.0, 0.0)).friction(0.6)).unwrap();
    let cube = Shape::cuboid(Vec3::splat(0.5)).unwrap();
    for i in 0..base {
        for j in i..base {
            let y = (2.0 * i as f32 + 1.0) * 0.5;
            let x = (i as f32 + 1.0) * 0.5 + (j - i) as f32 - 0.5 * base as f32;
            let b = world.add_body(&BodyDefinition::dynamic().at(Vec3::new(x, y, 0.0))).unwrap();
            world.add_shape(b, &ShapeDefinition::new(cube.clone()).density(100.0).friction(0.6)).unwrap();
        }
    }
    let mut sums = [0.0; 10];
    let t = std::time::Instant::now();
    for k in 0..steps {
        world.step(1.0 / 60.0).unwrap();
        if steps > 250 && k % 50 == 49 {
            let mut z = 0.0f32;
            let mut tilt = [0.0f32; 3];
            let mut vz = 0.0f32;
            let mut vx = 0.0f32;
            let mut wm = Vec3::ZERO;
            for id in world.bodies().skip(1) {
                let b = world.body(id).unwrap();
                z = z.max(b.position().z.abs());
                let q = b.rotation();
                for (t, c) in tilt.iter_mut().zip([q.x, q.y, q.z]) {
                    *t = t.max(c.abs());
                }
                vz = vz.max(b.linear_velocity().z.abs());
                vx = vx.max(b.linear_velocity().x.abs());
                wm = wm.max(b.angular_velocity().abs());
            }
            println!(
                "{k} z {z:.4} tilt {tilt:.5?} vx {vx:.4} vz {vz:.4} w {wm:.4} ke {:.1} pen {:.4}",
                world.kinetic_energy(),
                world.deepest_penetration()
            );
        }
        for (i, (_, ms)) in world.timings().iter().enumerate() {
            sums[i] += ms;
        }
    }
    println!(
        "{:?} ms/step {:.3} {:?} arb {} con {} pen {} ke {:.3} hash {:x}",
        world.simd_level(),
        t.elapsed().as_secs_f64() * 1e3 / steps as f64,
        Phase::ALL.iter().zip(sums).map(|(p, s)| format!("{p} {:.3}", s / steps as f64)).collect::<Vec<_>>(),
        world.arbiter_count(),
        world.contact_count(),
        world.deepest_penetration(),
        world.kinetic_energy(),
        world.hash()
    );
    let (mut mean, mut n, mut top) = (0.0, 0.0, 0.0f32);
    for id in world.bodies().skip(1) {
        let p = world.body(id).unwrap().position();
        mean += p.y;
        n += 1.0;
        top = top.max(p.y);
    }
    println!("mean {} top {}", mean / n, top);
    world.validate().unwrap();
}
