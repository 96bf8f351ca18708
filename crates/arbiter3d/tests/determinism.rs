//! The same bits for any number of threads and any SIMD level: ten scenes against checked-in hashes.
//!
//! The state hash is taken after each tenth step and folded into one number a scene. After a change that is meant to alter
//! results, print the new table with
//!
//! ```text
//! ARBITER3D_BLESS=1 cargo test -p arbiter3d --test determinism -- --nocapture golden
//! ```
//!
//! and put it into [`GOLDEN`]. Scenes use no platform mathematics, so the numbers hold on every machine.

mod common;

use arbiter3d::math::Vec3;
use arbiter3d::{
    ArbiterKey, BodyDefinition, BodyId, BodyKind, CompoundChild, ContactEvents, ContactPoint, ContactProvider,
    LockedAxes, Shape, ShapeDefinition, SimdLevel, StepContext, World, WorldSettings,
};
use common::*;

/// The hashes of the scenes, in their order.
const GOLDEN: [(&str, u64); 10] = [
    ("pile", 0x7900_4ca1_ad6b_f33e),
    ("hulls", 0x9585_7ac8_52b6_5294),
    ("mesh rain", 0x8355_e47d_0a0d_ce7f),
    ("bullets", 0xc13b_8bc1_c5e0_ca5d),
    ("custom contacts", 0x770f_f93e_d37a_7820),
    ("coming and going", 0xb070_2f44_4310_0f4a),
    ("surfaces", 0x51d1_fc05_f301_3131),
    ("rods and bullets", 0xd0f5_c9a0_990b_4ac8),
    ("compounds and voxels", 0x4a81_354e_cdcb_ed7d),
    ("mixed convex", 0x211d_e0e0_248f_fe07),
];

/// A scene: how it begins, and what is done before each step.
struct Scene {
    name: &'static str,
    steps: usize,
    build: fn(&mut World),
    before_step: fn(&mut World, usize),
}

const SCENES: [Scene; 10] = [
    Scene { name: "pile", steps: 180, build: pile, before_step: |_, _| {} },
    Scene { name: "hulls", steps: 150, build: hulls, before_step: |_, _| {} },
    Scene { name: "mesh rain", steps: 180, build: mesh_rain, before_step: |_, _| {} },
    Scene { name: "bullets", steps: 120, build: bullets, before_step: shoot },
    Scene { name: "custom contacts", steps: 180, build: custom_contacts, before_step: |_, _| {} },
    Scene { name: "coming and going", steps: 300, build: coming_and_going, before_step: come_and_go },
    Scene { name: "surfaces", steps: 180, build: surfaces, before_step: ask_for_surfaces },
    Scene { name: "rods and bullets", steps: 240, build: rods_and_bullets, before_step: |_, _| {} },
    Scene { name: "compounds and voxels", steps: 150, build: compounds_and_voxels, before_step: |_, _| {} },
    Scene { name: "mixed convex", steps: 180, build: mixed_convex, before_step: |_, _| {} },
];

/// Bodies of all shapes on a lattice over the origin, each turned and moving at random.
fn scatter(world: &mut World, count: usize, bounciness: f32, random: &mut Random) {
    for at in 0..count {
        let place = Vec3::new((at % 8) as f32 - 3.5, (at / 64) as f32 + 0.7, (at / 8 % 8) as f32 - 3.5) * 1.1;
        let body = BodyDefinition::dynamic().at(place + random.vector(0.1)).rotated(random.rotation());
        let body = body.moving(random.vector(2.0), random.vector(3.0));
        add(world, &body, &ShapeDefinition::new(random.shape()).restitution(bounciness));
    }
}

fn pile(world: &mut World) {
    floor(world, 0.6);
    scatter(world, 400, 0.3, &mut Random(41));
}

fn hulls(world: &mut World) {
    floor(world, 0.6);
    let mut random = Random(42);
    for at in 0..150 {
        let points: Vec<Vec3> = (0..16).map(|_| random.vector(0.4)).collect();
        let place = Vec3::new((at % 5) as f32 - 2.0, (at / 25) as f32 + 0.7, (at / 5 % 5) as f32 - 2.0);
        let body = BodyDefinition::dynamic().at(place).moving(Vec3::ZERO, random.vector(2.0));
        add(world, &body, &ShapeDefinition::new(Shape::hull(&points).unwrap()).friction(0.4));
    }
}

/// Hills without sines: products of coordinates only.
fn mesh_rain(world: &mut World) {
    let cells = 32_u32;
    let at = |i: u32| (i as f32 - 16.0) * 0.6;
    let height = |x: f32, z: f32| 0.3 * (x * x - 4.0) * (z * z - 9.0) / 40.0;
    let mut vertices = Vec::new();
    let mut triangles = Vec::new();
    for z in 0..=cells {
        for x in 0..=cells {
            vertices.push(Vec3::new(at(x), height(at(x) * 0.4, at(z) * 0.4), at(z)));
        }
    }
    for z in 0..cells {
        for x in 0..cells {
            let corner = z * (cells + 1) + x;
            triangles.push([corner, corner + cells + 1, corner + 1]);
            triangles.push([corner + 1, corner + cells + 1, corner + cells + 2]);
        }
    }
    let mesh = Shape::mesh(vertices, triangles).unwrap();
    world.add_shape(BodyId::WORLD, &ShapeDefinition::new(mesh).at(-Vec3::Y)).unwrap();
    scatter(world, 300, 0.0, &mut Random(43));
}

fn bullets(world: &mut World) {
    floor(world, 0.5);
    for row in 0..6 {
        for column in 0..12 - row {
            let place = Vec3::new(column as f32 * 1.02 + row as f32 * 0.51 - 6.0, 0.5 + row as f32, 0.0);
            drop_shape(world, &cube(0.5), place);
        }
    }
    let wall = ShapeDefinition::new(cuboid(20.0, 10.0, 0.005)).at(Vec3::new(0.0, 10.0, 2.0));
    world.add_shape(BodyId::WORLD, &wall).unwrap();
}

fn shoot(world: &mut World, step: usize) {
    if step.is_multiple_of(4) {
        let mut random = Random(1000 + step as u64);
        let from = Vec3::new(random.range(-5.0, 5.0), random.range(0.5, 5.0), -6.0);
        let body = BodyDefinition::dynamic()
            .at(from)
            .moving(Vec3::new(random.range(-20.0, 20.0), 0.0, 150.0), random.vector(20.0));
        let shape = [sphere(0.05), capsule(0.3, 0.02), cuboid(0.1, 0.1, 0.02)][step / 4 % 3].clone();
        add(world, &body, &ShapeDefinition::new(shape).density(8000.0));
    }
}

/// A floor of waves, made of cells, for spheres of half a metre: keys of its own, one for each sphere and cell.
struct Waves {
    keys: u64,
}

impl ContactProvider for Waves {
    fn provide(&mut self, context: &mut StepContext<'_>) {
        let spheres: Vec<(BodyId, Vec3)> =
            context.awake_bodies().filter_map(|id| Some((id, context.body(id)?.position()))).collect();
        for (id, position) in spheres {
            let cell = position.x.floor();
            let slope = if (cell as i64).rem_euclid(2) == 0 { 0.25 } else { -0.25 };
            let ground = if slope > 0.0 { (position.x - cell) * slope } else { 0.25 + (position.x - cell) * slope };
            let length = (1.0 + slope * slope).sqrt();
            let normal = Vec3::new(-slope / length, 1.0 / length, 0.0);
            let gap = (position.y - ground) / length - 0.5;
            if gap < 0.02 {
                let bottom = position - normal * 0.5;
                let key = ArbiterKey::new(self.keys + (cell as i64 + 512) as u64, u64::from(id.index()));
                let contact = ContactPoint::new(bottom - normal * gap, bottom, normal);
                let _ = context.register_contact_by_key(key, BodyId::WORLD, id, contact);
            }
        }
    }
}

fn custom_contacts(world: &mut World) {
    let keys = world.reserve_ids(1024).unwrap().start;
    world.add_contact_provider(Box::new(Waves { keys }));
    let mut random = Random(45);
    for at in 0..200 {
        let place = Vec3::new((at % 10) as f32 - 4.5, (at / 100) as f32 * 1.2 + 1.0, (at / 10 % 10) as f32 - 4.5);
        let body = BodyDefinition::dynamic().at(place * 1.05).moving(random.vector(1.0), random.vector(2.0));
        add(world, &body, &ShapeDefinition::new(sphere(0.5)).rolling_resistance(0.05));
    }
}

fn coming_and_going(world: &mut World) {
    floor(world, 0.6);
    scatter(world, 120, 0.0, &mut Random(46));
    let spinner = BodyDefinition::kinematic().at(Vec3::Y * 0.5).moving(Vec3::ZERO, Vec3::Y * 1.0);
    add(world, &spinner, &ShapeDefinition::new(cuboid(3.0, 0.2, 0.2)));
}

/// Compounds, voxel blocks and others fall on a pit of voxels beside a floor of separate boxes and one of a compound.
fn compounds_and_voxels(world: &mut World) {
    let pit = (0..256).flat_map(|at| [[at % 16, -1, at / 16], [0, at / 16, at % 16], [at / 16, at % 3, 0]]);
    let pit = ShapeDefinition::new(Shape::voxels(0.5, pit).unwrap()).at(Vec3::new(-4.0, 0.0, -4.0));
    world.add_shape(BodyId::WORLD, &pit).unwrap();
    let tile = |at: i32| Vec3::new((at % 8) as f32 + 4.5, -0.5, (at / 8) as f32 - 3.5);
    for at in 0..32 {
        world.add_shape(BodyId::WORLD, &ShapeDefinition::new(cube(0.5)).at(tile(at))).unwrap();
    }
    let tiles: Vec<_> = (32..64).map(|at| CompoundChild::new(cube(0.5)).at(tile(at))).collect();
    world.add_shape(BodyId::WORLD, &ShapeDefinition::new(Shape::compound(&tiles).unwrap())).unwrap();
    let mut random = Random(47);
    for at in 0..120 {
        let shape = match at % 3 {
            0 => {
                let child = |k: usize| CompoundChild::new(random_shape(k)).at(Vec3::Y * (0.3 * k as f32 - 0.3));
                Shape::compound(&[0, 1, 2].map(child)).unwrap()
            }
            1 => Shape::voxels(0.15, (0..12).map(|k| [k % 3, k / 3 % 2, k * at % 4])).unwrap(),
            _ => random.shape(),
        };
        let place = Vec3::new((at % 12) as f32 - 2.0, (at / 48) as f32 * 1.5 + 1.5, (at / 12 % 4) as f32 * 1.5 - 2.5);
        let body = BodyDefinition::dynamic().at(place + random.vector(0.1)).rotated(random.rotation());
        add(world, &body.moving(random.vector(2.0), random.vector(3.0)), &ShapeDefinition::new(shape));
    }
}

fn random_shape(kind: usize) -> Shape {
    [sphere(0.2), cuboid(0.3, 0.1, 0.2), capsule(0.2, 0.1)][kind].clone()
}

/// Adds, removes, pushes, teleports and changes bodies; for the last part all is left alone, and sleeps in part.
fn come_and_go(world: &mut World, step: usize) {
    if step > 200 || !step.is_multiple_of(5) {
        return;
    }
    let mut random = Random(2000 + step as u64);
    let bodies: Vec<BodyId> = world.bodies().skip(2).collect();
    let mut pick = || bodies[random.bits() as usize % bodies.len()];
    let (gone, pushed, moved, changed, hidden) = (pick(), pick(), pick(), pick(), pick());
    let kind = [BodyKind::Dynamic, BodyKind::Static, BodyKind::Dynamic][step / 5 % 3];
    world.body_mut(changed).unwrap().set_kind(kind).unwrap();
    world.body_mut(pushed).unwrap().apply_impulse(Vec3::new(50.0, 200.0, -30.0)).unwrap();
    world.body_mut(moved).unwrap().set_position(Vec3::new(0.5, 6.0, 0.5)).unwrap();
    let enabled = world.body(hidden).unwrap().is_enabled();
    world.body_mut(hidden).unwrap().set_enabled(!enabled).unwrap();
    world.remove_body(gone).unwrap();
    let mut random = Random(3000 + step as u64);
    let body = BodyDefinition::dynamic().at(Vec3::Y * 5.0 + random.vector(2.0)).rotated(random.rotation());
    let body = BodyDefinition {
        locked_axes: if step.is_multiple_of(20) { LockedAxes::ROTATION_Y } else { LockedAxes::NONE },
        ..body
    };
    add(world, &body, &ShapeDefinition::new(random.shape()));
}

/// Spinning rods, bullets of all shapes, resting crates and a door that swings, in a room with thin elastic walls.
fn rods_and_bullets(world: &mut World) {
    for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
        for side in [-1.0, 1.0] {
            let wall = Shape::cuboid(Vec3::splat(6.0) - axis * 5.99).unwrap();
            let wall = ShapeDefinition::new(wall).at(axis * side * 6.0 + Vec3::Y * 6.0);
            world.add_shape(BodyId::WORLD, &wall.restitution(0.9)).unwrap();
        }
    }
    let door = BodyDefinition::kinematic().at(Vec3::Y * 3.0).moving(Vec3::ZERO, Vec3::Y * 4.0);
    add(world, &door, &ShapeDefinition::new(cuboid(2.0, 2.0, 0.02)));
    let mut random = Random(47);
    let rods = [capsule(0.6, 0.01), cuboid(0.01, 0.6, 0.01), Shape::hull(&bar(0.6)).unwrap()];
    for at in 0..60 {
        let body = BodyDefinition::dynamic().at(Vec3::Y * 6.0 + random.vector(4.5)).rotated(random.rotation());
        let (speed, spin) = [(10.0, 60.0), (150.0, 20.0), (0.0, 0.0)][at % 3];
        let body = BodyDefinition { bullet: at % 3 == 1, ..body.moving(random.vector(speed), random.vector(spin)) };
        let shape = if at % 3 == 0 { rods[at / 3 % 3].clone() } else { random.shape() };
        add(world, &body, &ShapeDefinition::new(shape).restitution(0.5));
    }
}

/// Corners of a bar along y.
fn bar(half: f32) -> Vec<Vec3> {
    let side = |i: u32, bit: u32, half: f32| if i >> bit & 1 == 1 { half } else { -half };
    (0..8).map(|i| Vec3::new(side(i, 0, 0.01), side(i, 1, half), side(i, 2, 0.01))).collect()
}

/// Bodies of all shapes, some with easy friction one way, are thrown up through one-way platforms, of which one moves,
/// and fall on belts, of which one turns. Hooks make ice of every third contact.
fn surfaces(world: &mut World) {
    let belt = ShapeDefinition::new(cuboid(6.0, 1.0, 12.0)).friction(0.8);
    let fixed = BodyDefinition::fixed().at(Vec3::new(-6.0, -1.0, 0.0));
    add(world, &fixed, &belt.clone().tangent_velocity(Vec3::X * 2.0));
    let turning = BodyDefinition::kinematic().at(Vec3::new(6.0, -1.0, 0.0)).moving(Vec3::ZERO, Vec3::Y * 0.3);
    add(world, &turning, &belt.tangent_velocity(Vec3::Z * -1.5));
    let platform = ShapeDefinition::new(cuboid(5.0, 0.1, 5.0)).one_way(Vec3::Y);
    add(world, &BodyDefinition::fixed().at(Vec3::Y * 2.5), &platform);
    add(world, &BodyDefinition::kinematic().at(Vec3::Y * 4.0).moving(Vec3::Y * -0.5, Vec3::ZERO), &platform);
    let gate = BodyDefinition::fixed().at(Vec3::Y * 2.0);
    add(world, &gate, &ShapeDefinition::new(cuboid(3.0, 1.0, 3.0)).sensor());
    let mut random = Random(47);
    for at in 0..200 {
        let place = Vec3::new((at % 10) as f32 - 4.5, (at / 100) as f32 + 0.7, (at / 10 % 10) as f32 - 4.5) * 1.05;
        let body = BodyDefinition::dynamic().at(place).rotated(random.rotation());
        let body = body.moving(random.vector(2.0) + Vec3::Y * 9.0, random.vector(3.0));
        let shape = ShapeDefinition::new(random.shape()).restitution(0.2);
        let shape = if at % 2 == 0 { shape.anisotropy(Vec3::X, 0.1) } else { shape };
        let events = if at % 3 == 0 { ContactEvents::ALL } else { ContactEvents::NONE };
        add(world, &body, &shape.events(events));
    }
    world.on_pre_solve(Box::new(|context, id| {
        if let Some(arbiter) = context.arbiter_mut(id) {
            arbiter.data_mut().set_friction(0.05).unwrap();
        }
    }));
}

/// The hits of a step push bodies in the next one: the order and numbers of the events are part of the hash.
fn ask_for_surfaces(world: &mut World, _: usize) {
    let hits: Vec<(BodyId, f32)> = world.hit_events().iter().map(|hit| (hit.body2, hit.impulse)).collect();
    for (body, impulse) in hits {
        let _ = world.body_mut(body).unwrap().apply_impulse(Vec3::new(0.1, 0.0, -0.1) * impulse);
    }
}

/// Kinds known by their support, with boxes and balls among them, half on hills and half on a level floor.
fn mixed_convex(world: &mut World) {
    floor(world, 0.6);
    let corner = |i: u32, j: u32| {
        Vec3::new(i as f32 * 2.0 - 9.0, if (i + j).is_multiple_of(2) { 0.4 } else { 0.05 }, j as f32 * 2.0)
    };
    let vertices = (0..60).map(|at| corner(at % 10, at / 10)).collect();
    let cell = |at: u32| at / 9 * 10 + at % 9;
    let hills = (0..45).flat_map(|at| {
        let c = cell(at);
        [[c, c + 10, c + 1], [c + 1, c + 10, c + 11]]
    });
    let hills = Shape::mesh(vertices, hills.collect()).unwrap();
    world.add_shape(BodyId::WORLD, &ShapeDefinition::new(hills)).unwrap();
    let mut random = Random(47);
    let block = cuboid(0.3, 0.2, 0.25);
    let shapes = [
        Shape::cylinder(0.3, 0.25).unwrap(),
        Shape::cone(0.35, 0.3).unwrap(),
        Shape::tapered_capsule(0.3, 0.15, 0.25).unwrap(),
        Shape::ellipsoid(Vec3::new(0.4, 0.25, 0.3)).unwrap(),
        Shape::rounded(&block, 0.05).unwrap(),
        Shape::point_cloud(&[Vec3::X, Vec3::Y, Vec3::Z, -Vec3::ONE].map(|p| p * 0.4)).unwrap(),
        block,
        sphere(0.3),
    ];
    for at in 0..160 {
        let place = Vec3::new((at % 8) as f32 - 3.5, (at / 64) as f32 + 1.0, (at / 8 % 8) as f32 - 3.5) * 1.1;
        let body = BodyDefinition::dynamic().at(place).rotated(random.rotation());
        let body = body.moving(random.vector(1.0), random.vector(3.0));
        add(world, &body, &ShapeDefinition::new(shapes[at % 8].clone()));
    }
}

fn settings(threads: usize, simd: SimdLevel) -> WorldSettings {
    WorldSettings { threads, simd: Some(simd), ..WorldSettings::default() }
}

/// Runs a scene and returns its hash after each tenth step.
fn play(world: &mut World, scene: &Scene) -> Vec<u64> {
    (scene.build)(world);
    let mut hashes = Vec::new();
    for step in 0..scene.steps {
        (scene.before_step)(world, step);
        world.step(DT).unwrap();
        if step % 10 == 9 {
            hashes.push(world.hash());
        }
    }
    world.validate().unwrap();
    hashes
}

fn run_scene(scene: &Scene, threads: usize, simd: SimdLevel) -> Vec<u64> {
    play(&mut World::new(settings(threads, simd)).unwrap(), scene)
}

/// All hashes of a scene in one.
fn fold(hashes: &[u64]) -> u64 {
    hashes
        .iter()
        .fold(0xcbf2_9ce4_8422_2325, |sum, &hash| (sum ^ hash).wrapping_mul(0x0000_0100_0000_01b3).rotate_left(23))
}

/// Asserts that two runs agree, and says where they part.
#[track_caller]
fn assert_same(name: &str, variant: &str, expected: &[u64], found: &[u64]) {
    let parted = expected.iter().zip(found).position(|(a, b)| a != b);
    assert_eq!(
        parted,
        None,
        "{name}, {variant}: parts from the reference before step {}",
        parted.unwrap_or(0) * 10 + 10
    );
    assert_eq!(expected.len(), found.len());
}

/// Threads and SIMD levels do not change a bit, and the results are the checked-in ones.
fn check(index: usize) {
    let scene = &SCENES[index];
    let reference = run_scene(scene, 1, SimdLevel::Scalar);
    for simd in SimdLevel::available() {
        assert_same(scene.name, &format!("{simd}"), &reference, &run_scene(scene, 1, simd));
    }
    for threads in [2, 5] {
        let found = run_scene(scene, threads, SimdLevel::best());
        assert_same(scene.name, &format!("{threads} threads"), &reference, &found);
    }
    let hash = fold(&reference);
    if std::env::var_os("ARBITER3D_BLESS").is_some() {
        println!("    (\"{}\", {hash:#018x}),", scene.name);
        return;
    }
    let (name, golden) = GOLDEN[index];
    assert_eq!(name, scene.name);
    assert_eq!(hash, golden, "{name}: {hash:#018x} is not the golden hash; see the top of this file");
}

/// Spheres, capsules, boxes and hulls fall, bounce and pile up.
#[test]
fn golden_pile() {
    check(0);
}

/// Random hulls.
#[test]
fn golden_hulls() {
    check(1);
}

/// Mixed bodies rain on a mesh.
#[test]
fn golden_mesh_rain() {
    check(2);
}

/// Bullets into a pyramid and a thin wall.
#[test]
fn golden_bullets() {
    check(3);
}

/// Arbiters that a contact provider feeds.
#[test]
fn golden_custom_contacts() {
    check(4);
}

/// Bodies added, removed, pushed, moved and changed while others sleep and wake.
#[test]
fn golden_coming_and_going() {
    check(5);
}

/// Shapes made of parts, and floors of many shapes.
#[test]
fn golden_compounds_and_voxels() {
    check(8);
}

/// One-way platforms, belts, friction that differs along a direction, hooks and hits.
#[test]
fn golden_surfaces() {
    check(6);
}

/// Rods that spin, bullets and a door.
#[test]
fn golden_rods_and_bullets() {
    check(7);
}

/// Cylinders, cones and other shapes known by their support, on a floor and on a mesh.
#[test]
fn golden_mixed_convex() {
    check(9);
}

/// The scenes do what they are for: they have contacts, sleepers and motion.
#[test]
fn the_scenes_are_worth_hashing() {
    for (scene, contacts) in SCENES.iter().zip([500, 300, 400, 50, 150, 100, 150, 5, 200, 150]) {
        let mut world = World::new(settings(1, SimdLevel::best())).unwrap();
        let hashes = play(&mut world, scene);
        let found = world.contact_count();
        println!("{}: {found} contacts, {} awake, {} asleep", scene.name, world.awake_count(), world.sleeping_count());
        assert!(found >= contacts, "{}: only {found} contacts", scene.name);
        let mut unique = hashes.clone();
        unique.sort_unstable();
        unique.dedup();
        assert!(unique.len() * 2 > hashes.len(), "{}: the state hardly changes", scene.name);
    }
}

/// Two worlds in one process give the same hashes, also when their steps take turns.
#[test]
fn two_worlds_side_by_side_agree() {
    let scene = &SCENES[0];
    let mut worlds = [1, 2].map(|threads| World::new(settings(threads, SimdLevel::best())).unwrap());
    for world in &mut worlds {
        (scene.build)(world);
    }
    for step in 0..120 {
        for world in &mut worlds {
            world.step(DT).unwrap();
        }
        assert_eq!(worlds[0].hash(), worlds[1].hash(), "step {step}");
    }
}

/// A scene that is built again after the world was cleared runs as in a new world: poses and velocities are the same bits.
#[test]
fn a_cleared_world_runs_like_a_new_one() {
    let scene = &SCENES[0];
    let mut fresh = World::new(settings(1, SimdLevel::best())).unwrap();
    let mut cleared = World::new(settings(1, SimdLevel::best())).unwrap();
    (scene.build)(&mut cleared);
    run(&mut cleared, 1.0);
    cleared.clear();
    (scene.build)(&mut fresh);
    (scene.build)(&mut cleared);
    // Slots are used again in another order, so bodies are compared in the order in which they were added: by shape id.
    let state = |world: &World| {
        let mut bodies: Vec<_> = world
            .bodies()
            .skip(1)
            .map(|id| world.body(id).unwrap())
            .map(|body| (body.shapes()[0], body.position(), body.rotation(), body.linear_velocity()))
            .collect();
        bodies.sort_by_key(|body| body.0);
        bodies.into_iter().map(|(_, p, q, v)| (p, q, v)).collect::<Vec<_>>()
    };
    for step in 0..120 {
        assert_eq!(state(&fresh), state(&cleared), "step {step}");
        fresh.step(DT).unwrap();
        cleared.step(DT).unwrap();
    }
}

/// What happens far away does not change a bit of what happens here.
#[test]
fn distant_bodies_change_nothing() {
    let run_with = |distant: bool| {
        let mut world = World::new(settings(1, SimdLevel::best())).unwrap();
        floor(&mut world, 0.6);
        let near: Vec<BodyId> = (0..30)
            .map(|at| {
                drop_shape(&mut world, &cube(0.5), Vec3::new((at % 3) as f32 * 1.3, 0.5 + (at / 3) as f32 * 1.1, 0.0))
            })
            .collect();
        if distant {
            for at in 0..30 {
                drop_shape(&mut world, &cube(0.5), Vec3::new(80.0, 0.7 + at as f32 * 1.1, 0.0));
            }
        }
        run(&mut world, 3.0);
        near.iter().map(|&body| (position(&world, body), velocity(&world, body))).collect::<Vec<_>>()
    };
    assert_eq!(run_with(false), run_with(true));
}
