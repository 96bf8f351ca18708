//! Surfaces of several materials: children of compounds, cells of voxels, triangles of meshes.

mod common;

use arbiter3d::math::Vec3;
use arbiter3d::{
    BodyDefinition, BodyId, CompoundChild, Material, QueryFilter, Shape, ShapeDefinition, VoxelGrid, World,
};
use common::*;

fn surface(friction: f32, restitution: f32) -> Material {
    Material { friction, restitution, rolling_resistance: 0.0, ..Material::default() }
}

/// Height of the middle of a sled.
const HEIGHT: f32 = 0.055;

/// A flat sled on two small feet a metre apart, the left one (x < 0) of material 0, the right one of material 1. The feet are
/// small, so that friction against twisting hardly counts.
fn sled() -> Shape {
    let foot = |x: f32, material: u8| {
        CompoundChild::new(cuboid(0.005, 0.02, 0.01)).at(Vec3::new(x, -0.035, 0.0)).with_material(material)
    };
    let deck = CompoundChild::new(cuboid(0.6, 0.015, 0.6));
    Shape::compound(&[deck, foot(-0.5, 0), foot(0.5, 1)]).unwrap()
}

/// Slides a body along z with the right side on what grips with 0.2, the left on ice, and holds it against what Coulomb says:
/// half of the load brakes, half a metre beside the middle.
fn brakes_and_turns(world: &mut World, body: BodyId) {
    run(world, 0.3);
    world.body_mut(body).unwrap().set_linear_velocity(Vec3::Z * 4.0).unwrap();
    let mass = world.body(body).unwrap().mass_properties();
    let inertia = mass.inertia.yy;
    let (steps, friction, lever) = (12, 0.2, 0.5);
    run(world, steps as f32 * DT);
    let time = steps as f32 * DT;
    let lost = 4.0 - velocity(world, body).z;
    assert_relative(lost, 0.5 * friction * GRAVITY * time, 0.03, "speed lost");
    let turning = 0.5 * friction * GRAVITY * mass.mass * lever / inertia * time;
    // Friction on the right, backwards, turns the front to the right.
    assert_relative(spin(world, body).y.abs(), turning, 0.05, "turning");
    assert!(spin(world, body).y > 0.0, "{}", spin(world, body));
}

#[test]
fn a_compound_half_of_ice_half_of_rubber_turns_as_coulomb_says() {
    let mut world = sleepless();
    floor(&mut world, 0.0);
    let shape = ShapeDefinition::new(sled()).palette(vec![surface(0.0, 0.0), surface(0.2, 0.0)]);
    let body = add(&mut world, &BodyDefinition::dynamic().at(Vec3::Y * HEIGHT), &shape);
    brakes_and_turns(&mut world, body);
}

/// The same sled, all of ice, on ground that is ice on the left and grips on the right: a mesh, voxels, a compound.
#[test]
fn ground_half_of_ice_half_of_rubber_turns_as_coulomb_says() {
    let corner = |x: f32, z: f32| Vec3::new(x, 0.0, z);
    let corners = [-9.0, 0.0, 9.0].map(|x| [corner(x, -9.0), corner(x, 9.0)]).concat();
    let mesh = arbiter3d::TriangleMesh::new(corners, vec![[0, 1, 2], [2, 1, 3], [2, 3, 4], [4, 3, 5]]).unwrap();
    let mesh = Shape::Mesh(mesh.with_materials(vec![0, 0, 1, 1]).unwrap().into());
    let cells = || (0..400).map(|at| [at % 20 - 10, -1, at / 20 - 10]);
    let right: Vec<_> = cells().filter(|cell| cell[0] >= 0).map(|cell| (cell, 1)).collect();
    let voxels = Shape::Voxels(VoxelGrid::new(0.9, cells()).unwrap().with_materials(&right).unwrap().into());
    let half = |x: f32, material| {
        CompoundChild::new(cuboid(4.5, 0.5, 9.0)).at(Vec3::new(x, -0.5, 0.0)).with_material(material)
    };
    let compound = Shape::compound(&[half(-4.5, 0), half(4.5, 1)]).unwrap();
    for ground in [mesh, voxels, compound] {
        let mut world = sleepless();
        let ground = ShapeDefinition::new(ground).palette(vec![surface(0.0, 0.0), surface(0.2, 0.0)]);
        world.add_shape(BodyId::WORLD, &ground).unwrap();
        let sled = ShapeDefinition::new(sled()).friction(0.0).rolling_resistance(0.0);
        let body = add(&mut world, &BodyDefinition::dynamic().at(Vec3::Y * HEIGHT), &sled);
        brakes_and_turns(&mut world, body);
        let below = |x: f32| {
            let hit = world.cast_ray(Vec3::new(x, 1.0, 5.0), -Vec3::Y * 2.0, 1.0, &QueryFilter::default());
            hit.unwrap().unwrap().material.friction
        };
        assert_eq!((below(-1.0), below(1.0)), (0.0, 0.2), "rays tell the material");
    }
}

/// A hammer bounces as the part it falls on: 0.6² of the height from the head, not at all from the handle.
#[test]
fn each_child_bounces_by_its_own_restitution() {
    let ball = |y: f32, material| CompoundChild::new(sphere(0.2)).at(Vec3::Y * y).with_material(material);
    let dumbbell = Shape::compound(&[ball(-0.5, 0), ball(0.5, 1)]).unwrap();
    for (degrees, restitution) in [(0.0, 0.0), (180.0, 0.6)] {
        let mut world = sleepless();
        floor(&mut world, 0.0);
        let shape = ShapeDefinition::new(dumbbell.clone()).palette(vec![surface(0.0, 0.0), surface(0.0, 0.6)]);
        let upright = BodyDefinition::dynamic().at(Vec3::Y * 2.7).rotated(turn(Vec3::Z, degrees));
        let body = add(&mut world, &upright, &shape);
        run(&mut world, 0.75); // 2 m take 0.64 s
        let mut highest = 0.0_f32;
        for _ in 0..60 {
            world.step(DT).unwrap();
            highest = highest.max(position(&world, body).y - 0.7);
        }
        assert_near(highest, 2.0 * restitution * restitution, 0.02, "height of the bounce");
    }
}

/// Users' own friction is that of all contacts; otherwise each contact tells its own.
#[test]
fn contacts_tell_their_own_friction() {
    let mut world = sleepless();
    floor(&mut world, 0.0);
    let shape = ShapeDefinition::new(sled()).palette(vec![surface(0.1, 0.0), surface(0.4, 0.3)]);
    let body = add(&mut world, &BodyDefinition::dynamic().at(Vec3::Y * HEIGHT), &shape);
    run(&mut world, 0.1);
    let key = world.arbiters().next().unwrap().key();
    let frictions = |world: &World| {
        let data = *world.arbiter(key).unwrap().data();
        let side = |slot: usize| data.contact(slot).unwrap().local_anchor2().x > 0.0;
        let slots: Vec<_> = data.contacts().map(|(slot, _)| slot).collect();
        assert_eq!(slots.len(), 4);
        slots.iter().map(|&slot| (side(slot), data.friction_of(slot), data.restitution_of(slot))).collect::<Vec<_>>()
    };
    for (right, friction, restitution) in frictions(&world) {
        assert_eq!((friction, restitution), if right { (0.4, 0.3) } else { (0.1, 0.0) });
    }
    let id = world.arbiter(key).unwrap().id();
    world.arbiter_mut(id).unwrap().data_mut().set_friction(0.7).unwrap();
    run(&mut world, 0.1);
    assert!(frictions(&world).iter().all(|&(_, friction, _)| friction == 0.7));
    assert!(velocity(&world, body).length() < 0.01);
}

/// A round child rolls with the resistance of its material: a wheel of two balls slows down at 5/7 c g (c: resistance).
#[test]
fn each_child_rolls_with_its_own_resistance() {
    for (material, resistance) in [(0, 0.05_f32), (1, 0.1)] {
        let mut world = sleepless();
        floor(&mut world, 0.8);
        let ball = Shape::compound(&[CompoundChild::new(sphere(0.3)).with_material(material)]).unwrap();
        let palette = [0.05, 0.1].map(|rolling_resistance| Material { rolling_resistance, ..surface(0.8, 0.0) });
        let rolling = BodyDefinition::dynamic().at(Vec3::Y * 0.3).moving(Vec3::X * 4.0, -Vec3::Z * 4.0 / 0.3);
        let body = add(&mut world, &rolling, &ShapeDefinition::new(ball).palette(palette.to_vec()));
        run(&mut world, 1.0);
        assert_relative(4.0 - velocity(&world, body).x, 5.0 / 7.0 * resistance * GRAVITY, 0.03, "speed lost");
    }
}
