//! Bodies that fall into heaps, on flat ground and on meshes.

use crate::builder::{Builder, Mixed, cuboid, plain};
use crate::meshes::{fibonacci_sphere, prism, surface};
use crate::random::Random;
use crate::turns::sin_cos;
use crate::{BuiltScene, SceneOptions};
use arbiter3d::{
    BodyDefinition, BodyId, CompoundChild, Error, Shape, ShapeDefinition, World,
    math::{Real, Vec3},
};

/// Box3D's `convex_pile`: 8 × 8 rocks a layer, all with the hull of the same 32 random points on a sphere of 2 m.
pub(crate) fn convex_pile(options: &SceneOptions, size: usize) -> Result<BuiltScene, Error> {
    const RADIUS: Real = 2.0;
    let mut scene = Builder::new(options, size)?;
    scene.ground(Vec3::new(250.0, 1.0, 250.0))?;
    let rock = plain(Shape::hull(&scene.random(42).points_on_sphere(32, RADIUS))?);
    for layer in 0..scene.size {
        for z in 0..8 {
            for x in 0..8 {
                let height = RADIUS + 2.0 * RADIUS * layer as Real;
                scene.drop(Vec3::new((x as Real - 4.0) * 4.0, height, (z as Real - 4.0) * 4.0), &rock)?;
            }
        }
    }
    scene.finish(500)
}

/// Box3D's `junkyard`: 21 × 21 rocks a layer in a walled yard, and a pillar that circles through them at 6° a second.
pub(crate) fn junkyard(options: &SceneOptions, size: usize) -> Result<BuiltScene, Error> {
    let mut scene = Builder::new(options, size)?;
    let ground = scene.world.add_body(&BodyDefinition::fixed().at(Vec3::new(0.0, -1.0, 0.0)))?;
    scene.world.add_shape(ground, &cuboid(Vec3::new(120.0, 1.0, 120.0))?)?;
    for side in [-50.0, 50.0] {
        scene.world.add_shape(ground, &cuboid(Vec3::new(1.0, 8.0, 50.0))?.at(Vec3::new(side, 8.0, 0.0)))?;
        scene.world.add_shape(ground, &cuboid(Vec3::new(50.0, 8.0, 1.0))?.at(Vec3::new(0.0, 8.0, side)))?;
    }
    let rock = plain(Shape::hull(&fibonacci_sphere(10, 1.5))?);
    let mut scatter = scene.scatter(0.25);
    for layer in 0..scene.size {
        for x in 0..21 {
            for z in 0..21 {
                let corner = Vec3::new(-40.0 + 4.0 * x as Real, 25.0 + 4.0 * layer as Real, -40.0 + 4.0 * z as Real);
                scene.drop(corner + scatter(), &rock)?;
            }
        }
    }
    let start = Vec3::new(PUSHER_RADIUS, 0.0, 0.0);
    let pillar = plain(Shape::hull(&prism(16, 4.0, 0.0, 24.0))?);
    let pusher = scene.add(&BodyDefinition::kinematic().at(start), &pillar)?;
    let hz = scene.hz;
    scene.finish_with(500, Box::new(move |step, world| push(world, pusher, step, hz)))
}

/// Radius of the pillar's path, metres.
const PUSHER_RADIUS: Real = 35.0;

/// Gives the pillar the velocity that takes it to its next place on the circle.
fn push(world: &mut World, pusher: BodyId, step: usize, hz: Real) -> Result<(), Error> {
    let angle = -6.0_f32.to_radians() * (step + 1) as Real / hz;
    let (s, c) = sin_cos(angle);
    let target = Vec3::new(PUSHER_RADIUS * c, 0.0, PUSHER_RADIUS * s);
    let Some(position) = world.body(pusher).map(|body| body.position()) else { return Ok(()) };
    let velocity = (target - position) * hz;
    world.body_mut(pusher).map_or(Ok(()), |mut body| body.set_linear_velocity(velocity))
}

/// Jolt's `ConvexVsMesh`: 21 × 21 boxes, balls, capsules and pyramids, a layer each, on hills of 20,000 triangles.
pub(crate) fn convex_vs_mesh(options: &SceneOptions, size: usize) -> Result<BuiltScene, Error> {
    const CELLS: usize = 100;
    let rough = |shape: Shape| ShapeDefinition::new(shape).friction(0.5).restitution(0.6);
    let mut scene = Builder::new(options, size)?;
    let waves: Vec<(Real, Real)> = (0..=CELLS).map(|i| sin_cos(50.0 * i as Real / CELLS as Real)).collect();
    let corner = Vec3::new(-150.0, 5.0, -150.0);
    let (vertices, triangles) = surface(CELLS, CELLS, 3.0, corner, |i, j| 5.0 * waves[i].0 * waves[j].1);
    scene.add(&BodyDefinition::fixed(), &rough(Shape::mesh(vertices, triangles)?))?;
    let pyramid = [Vec3::Y, Vec3::X, -Vec3::X, Vec3::Z, -Vec3::Z];
    let shapes = [
        rough(Shape::cuboid(Vec3::new(0.5, 0.75, 1.0))?),
        rough(Shape::sphere(0.5)?),
        rough(Shape::capsule(0.75, 0.5)?),
        rough(Shape::hull(&pyramid)?),
    ];
    let mut scatter = scene.scatter(0.5);
    for layer in 0..scene.size {
        for i in -10..=10 {
            for j in -10..=10 {
                let position = Vec3::new(7.5 * i as Real, 15.0 + 2.0 * layer as Real, 7.5 * j as Real);
                scene.drop(position + scatter(), &shapes[layer % 4])?;
            }
        }
    }
    scene.finish(500)
}

/// 16 × 16 mixed bodies a layer over a wavy mesh of 64 × 64 cells.
pub(crate) fn mesh_rain(options: &SceneOptions, size: usize) -> Result<BuiltScene, Error> {
    const CELLS: usize = 64;
    const SIDE: usize = 16;
    let mut scene = Builder::new(options, size)?;
    let coordinate = |i: usize| i as Real - 0.5 * CELLS as Real;
    let along_x: Vec<Real> = (0..=CELLS).map(|i| sin_cos(0.3 * coordinate(i)).0).collect();
    let along_z: Vec<Real> = (0..=CELLS).map(|i| sin_cos(0.25 * coordinate(i)).1).collect();
    let corner = Vec3::new(coordinate(0), 0.0, coordinate(0));
    scene.mesh(surface(CELLS, CELLS, 1.0, corner, |i, j| 1.5 * along_x[i] * along_z[j]))?;
    let mixed = Mixed::new(&mut scene.random(7))?;
    let mut scatter = scene.scatter(0.1);
    for index in 0..scene.size {
        let (y, x, z) = (index / (SIDE * SIDE), index / SIDE % SIDE, index % SIDE);
        let position = Vec3::new(
            (x as Real - 8.0) * 1.5 + 0.1 * (y % 3) as Real,
            5.0 + 1.6 * y as Real,
            (z as Real - 8.0) * 1.5 + 0.07 * (y % 5) as Real,
        );
        scene.drop(position + scatter(), mixed.get(x + z + y))?;
    }
    scene.finish(200)
}

/// Compounds of three to six parts, 8 × 8 a layer, rain into a pit: one half of its floor is voxels, the other a compound of
/// boxes.
pub(crate) fn compound_rain(options: &SceneOptions, size: usize) -> Result<BuiltScene, Error> {
    const HALF: i32 = 12;
    let mut scene = Builder::new(options, size)?;
    let inside = |x: i32, z: i32| x > -HALF && z > -HALF && x < HALF - 1 && z < HALF - 1;
    let all = || (-HALF..HALF).flat_map(|x| (-HALF..HALF).map(move |z| (x, z)));
    // Hills of one cell in places, walls of five around.
    let height = |x: i32, z: i32| if inside(x, z) { i32::from((x * x + 3 * z) % 11 == 0) } else { 5 };
    let cells = all().filter(|&(x, _)| x < 0).flat_map(|(x, z)| (-1..height(x, z)).map(move |y| [x, y, z]));
    scene.add(&BodyDefinition::fixed(), &plain(Shape::voxels(1.0, cells)?))?;
    let block = |(x, z): (i32, i32)| {
        let top = height(x, z) as Real;
        let shape = Shape::cuboid(Vec3::new(0.5, 0.5 * (top + 1.0), 0.5))?;
        Ok(CompoundChild::new(shape).at(Vec3::new(x as Real + 0.5, 0.5 * (top - 1.0), z as Real + 0.5)))
    };
    let blocks = all().filter(|&(x, _)| x >= 0).map(block).collect::<Result<Vec<_>, Error>>()?;
    scene.add(&BodyDefinition::fixed(), &plain(Shape::compound(&blocks)?))?;
    let mut random = scene.random(11);
    let kinds = (0..8).map(|kind| compound_of(3 + kind % 4, &mut random)).collect::<Result<Vec<_>, Error>>()?;
    for index in 0..scene.size {
        let (layer, x, z) = (index / 64, index / 8 % 8, index % 8);
        let position = Vec3::new(2.4 * (x as Real - 3.5), 3.0 + 1.8 * layer as Real, 2.4 * (z as Real - 3.5));
        let body = BodyDefinition::dynamic().at(position).rotated(random.rotation());
        scene.add(&body, &plain(kinds[index % kinds.len()].clone()))?;
    }
    scene.finish(300)
}

/// A bunch of boxes, balls and capsules about the origin.
fn compound_of(parts: usize, random: &mut Random) -> Result<Shape, Error> {
    let shapes = [Shape::cuboid(Vec3::new(0.35, 0.15, 0.2))?, Shape::sphere(0.25)?, Shape::capsule(0.3, 0.12)?];
    let mut children = Vec::with_capacity(parts);
    for part in 0..parts {
        let child = CompoundChild::new(shapes[part % 3].clone()).at(random.in_cube(0.35)).rotated(random.rotation());
        children.push(child);
    }
    Ok(Shape::compound(&children)?)
}

/// Adds a floor with four walls of `height`; `inner` is half the inner width, metres.
fn tray(scene: &mut Builder, inner: Real, height: Real) -> Result<(), Error> {
    let ground = scene.ground(Vec3::new(inner + 1.0, 1.0, inner + 1.0))?;
    // Offsets are from the ground's centre, one metre below its top.
    for side in [-1.0, 1.0] {
        let (center, half_height) = (side * (inner + 0.5), 0.5 * height);
        let along_z = cuboid(Vec3::new(0.5, half_height, inner + 1.0))?;
        scene.world.add_shape(ground, &along_z.at(Vec3::new(center, 1.0 + half_height, 0.0)))?;
        let along_x = cuboid(Vec3::new(inner, half_height, 0.5))?;
        scene.world.add_shape(ground, &along_x.at(Vec3::new(0.0, 1.0 + half_height, center)))?;
    }
    Ok(())
}

/// 10,000 balls of half a metre pour into a pit: 20 × 20 a layer, every other layer shifted.
pub(crate) fn spheres(options: &SceneOptions, size: usize) -> Result<BuiltScene, Error> {
    let mut scene = Builder::new(options, size)?;
    tray(&mut scene, 15.0, 12.0)?;
    let ball = plain(Shape::sphere(0.5)?);
    let mut scatter = scene.scatter(0.1);
    for index in 0..scene.size {
        let (layer, x, z) = (index / 400, index / 20 % 20, index % 20);
        let shift = if layer % 2 == 1 { 0.4 } else { 0.0 };
        let position = Vec3::new(x as Real - 9.7, layer as Real, z as Real - 9.7) * 1.2 + Vec3::new(shift, 2.0, shift);
        scene.drop(position + scatter(), &ball)?;
    }
    scene.finish(500)
}

/// A few hundred mixed bodies, turned at random, fall into a tray.
pub(crate) fn boxes_rain(options: &SceneOptions, size: usize) -> Result<BuiltScene, Error> {
    let mut scene = Builder::new(options, size)?;
    tray(&mut scene, 8.0, 3.0)?;
    let mut random = scene.random(11);
    let mixed = Mixed::new(&mut random)?.resisting_to_roll();
    for index in 0..scene.size {
        let (layer, x, z) = (index / 36, index / 6 % 6, index % 6);
        let corner = Vec3::new(x as Real - 2.5, layer as Real, z as Real - 2.5) * 2.0 + Vec3::new(0.0, 3.0, 0.0);
        let body = BodyDefinition::dynamic().at(corner + random.in_cube(0.3)).rotated(random.rotation());
        scene.add(&body, mixed.get(index))?;
    }
    scene.finish(600)
}

/// 1,000 cans, turned at random, fall into a pit and stay awake: the steps between 4 and 5 s are those of a heap at rest.
pub(crate) fn cans(options: &SceneOptions, size: usize) -> Result<BuiltScene, Error> {
    heap(options, size, &Shape::cylinder(0.3, 0.2)?)
}

/// The same of ellipsoids, which know no face and no edge.
pub(crate) fn ellipsoids(options: &SceneOptions, size: usize) -> Result<BuiltScene, Error> {
    heap(options, size, &Shape::ellipsoid(Vec3::new(0.2, 0.3, 0.25))?)
}

/// Bodies of one kind and no more than 35 cm in reach fall into a tray of 8 × 8 m: 10 × 10 a layer.
fn heap(options: &SceneOptions, size: usize, shape: &Shape) -> Result<BuiltScene, Error> {
    let mut scene = Builder::sleepless(options, size)?;
    tray(&mut scene, 4.0, 6.0)?;
    let mut random = scene.random(17);
    let shape = plain(shape.clone()).rolling_resistance(0.05);
    for index in 0..scene.size {
        let (layer, x, z) = (index / 100, index / 10 % 10, index % 10);
        let position = Vec3::new(x as Real - 4.5, layer as Real, z as Real - 4.5) * 0.77 + Vec3::new(0.0, 1.0, 0.0);
        let body = BodyDefinition::dynamic().at(position).rotated(random.rotation());
        scene.add(&body, &shape)?;
    }
    scene.finish(300)
}
