//! Materials of triangles and cells, closed meshes on dynamic bodies, meshes against meshes, mirrored meshes.

mod common;

use arbiter3d::math::{Pose, Vec3};
use arbiter3d::narrow_phase::{Manifold, PairCache, collide};
use arbiter3d::{
    BodyDefinition, BodyId, Error, HeightField, Material, Shape, ShapeDefinition, ShapeError, TriangleMesh, World,
};
use common::*;

fn ring(i: usize, count: usize) -> (f32, f32) {
    let angle = std::f64::consts::TAU * i as f64 / count as f64;
    (libm::cos(angle) as f32, libm::sin(angle) as f32)
}

/// A torus about the z axis.
fn torus(around: usize, across: usize, major: f32, tube: f32) -> Shape {
    let mut vertices = Vec::new();
    for i in 0..around {
        let (x, y) = ring(i, around);
        for j in 0..across {
            let (out, up) = ring(j, across);
            vertices.push(Vec3::new(x * (major + tube * out), y * (major + tube * out), tube * up));
        }
    }
    let index = |i: usize, j: usize| (i % around * across + j % across) as u32;
    let mut triangles = Vec::new();
    for i in 0..around {
        for j in 0..across {
            let [a, b, c, d] = [index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    Shape::mesh(vertices, triangles).unwrap()
}

/// The surface of a box.
fn box_mesh(half: Vec3) -> Shape {
    let (corners, triangles) = Shape::cuboid(half).unwrap().triangulate(1);
    Shape::mesh(corners, triangles).unwrap()
}

/// A floor of ±`half` metres with its cut at x = 0: left of it triangles of material 0, right of it of material 1.
fn mesh_of_two_materials(half: f32) -> Shape {
    let corner = |x: f32, z: f32| Vec3::new(x, 0.0, z);
    let vertices = [-half, 0.0, half].iter().flat_map(|&x| [corner(x, -half), corner(x, half)]).collect();
    let triangles = vec![[0, 1, 2], [2, 1, 3], [2, 3, 4], [4, 3, 5]];
    let mesh = TriangleMesh::new(vertices, triangles).unwrap().with_materials(vec![0, 0, 1, 1]).unwrap();
    Shape::Mesh(mesh.into())
}

fn material(friction: f32) -> Material {
    Material { friction, ..Material::default() }
}

/// From ice onto rubber: a box slides on at its speed, and past the border slows down by µg.
#[test]
fn a_box_slides_from_ice_to_rubber() {
    let materials = (0..40 * 40).map(|cell| u8::from(cell % 40 >= 20)).collect();
    let field = HeightField::new(vec![0.0; 41 * 41], 41, [1.0; 2]).unwrap().with_materials(materials).unwrap();
    let floors =
        [(mesh_of_two_materials(20.0), Vec3::ZERO), (Shape::HeightField(field.into()), Vec3::new(-20.0, 0.0, -20.0))];
    for (floor, place) in floors {
        let mut world = sleepless();
        let palette = vec![material(0.0), material(0.8)];
        world.add_shape(BodyId::WORLD, &ShapeDefinition::new(floor).at(place).palette(palette)).unwrap();
        let body = BodyDefinition::dynamic().at(Vec3::new(-4.0, 0.1, 0.0)).moving(Vec3::X * 8.0, Vec3::ZERO);
        let body = add(&mut world, &body, &ShapeDefinition::new(cuboid(0.4, 0.1, 0.4)).friction(0.0));
        while position(&world, body).x < -0.6 {
            world.step(DT).unwrap();
        }
        assert_relative(velocity(&world, body).x, 8.0, 1e-3, "speed on ice");
        while position(&world, body).x < 0.7 {
            world.step(DT).unwrap();
        }
        let before = velocity(&world, body).x;
        run(&mut world, 0.4);
        let slowed = (before - velocity(&world, body).x) / 0.4;
        assert_relative(slowed, 0.8 * GRAVITY, 0.02, "deceleration on rubber");
    }
}

/// What the user has set on an arbiter stays when another material comes under the body.
#[test]
fn a_friction_of_the_users_stays() {
    let mut world = sleepless();
    let floor = ShapeDefinition::new(mesh_of_two_materials(20.0)).palette(vec![material(0.0), material(0.8)]);
    world.add_shape(BodyId::WORLD, &floor).unwrap();
    let body = BodyDefinition::dynamic().at(Vec3::new(-2.0, 0.1, 0.0)).moving(Vec3::X * 4.0, Vec3::ZERO);
    let body = add(&mut world, &body, &ShapeDefinition::new(cuboid(0.4, 0.1, 0.4)).friction(0.0));
    run(&mut world, 0.1);
    let id = world.arbiters_of(body).next().unwrap().id();
    world.arbiter_mut(id).unwrap().data_mut().set_friction(0.0).unwrap();
    run(&mut world, 1.0);
    assert!(position(&world, body).x > 1.5);
    assert_relative(velocity(&world, body).x, 4.0, 1e-3, "speed");
}

/// Mass, centre and inertia of closed meshes: a box exactly, a fine torus as its formula says; a ball fits into each.
#[test]
fn closed_meshes_have_the_mass_of_what_they_enclose() {
    let half = Vec3::new(0.3, 0.7, 0.5);
    let (mesh, solid) = (box_mesh(half), Shape::cuboid(half).unwrap());
    let moved = mesh.transformed(arbiter3d::math::Mat3::IDENTITY, Vec3::new(3.0, -2.0, 1.0)).unwrap();
    let (a, b) = (mesh.mass_properties(700.0).unwrap(), solid.mass_properties(700.0).unwrap());
    let c = moved.mass_properties(700.0).unwrap();
    assert_relative(a.mass, b.mass, 1e-6, "mass");
    assert!(a.center.length() < 1e-6 && c.center.distance(Vec3::new(3.0, -2.0, 1.0)) < 1e-6);
    for (found, expected) in [(a.inertia.xx, b.inertia.xx), (a.inertia.yy, b.inertia.yy), (a.inertia.zz, b.inertia.zz)]
    {
        assert_relative(found, expected, 1e-5, "inertia");
    }
    assert_relative(c.inertia.xx, b.inertia.xx, 1e-5, "inertia of the moved box");
    assert_relative(mesh.inner_radius(), 0.3, 1e-3, "ball in a box");
    let ring = torus(120, 60, 0.5, 0.15);
    let mass = ring.mass_properties(1000.0).unwrap();
    let expected = 1000.0 * 2.0 * std::f32::consts::PI.powi(2) * 0.5 * 0.15 * 0.15;
    assert_relative(mass.mass, expected, 5e-3, "mass of a torus");
    assert_relative(mass.inertia.zz, expected * (0.25 + 0.75 * 0.15 * 0.15), 1e-2, "inertia of a torus");
    assert_relative(ring.inner_radius(), 0.15, 0.05, "ball in a torus");
}

/// Shapes without a volume do not go on dynamic bodies, unless they are sensors or weigh nothing; the error says why.
#[test]
fn what_has_no_volume_is_refused() {
    let mut world: World = world();
    let body = world.add_body(&BodyDefinition::dynamic()).unwrap();
    let mut corners = Shape::cuboid(Vec3::ONE).unwrap().triangulate(1);
    let field = Shape::height_field(vec![0.0; 4], 2, [1.0; 2]).unwrap();
    assert!(matches!(
        world.add_shape(body, &ShapeDefinition::new(field.clone())),
        Err(Error::Shape(ShapeError::NoVolume { shape: "a height field", .. }))
    ));
    corners.1.swap(0, 1);
    let inside_out = corners.1.iter().map(|&[a, b, c]| [a, c, b]).collect();
    let inside_out = Shape::mesh(corners.0.clone(), inside_out).unwrap();
    assert!(matches!(
        world.add_shape(body, &ShapeDefinition::new(inside_out)),
        Err(Error::Shape(ShapeError::NoVolume { .. }))
    ));
    let first = corners.1[0];
    corners.1[0] = [first[0], first[2], first[1]];
    let one_turned = Shape::mesh(corners.0.clone(), corners.1.clone()).unwrap();
    assert_eq!(
        world.add_shape(body, &ShapeDefinition::new(one_turned)),
        Err(Error::Shape(ShapeError::OpenMesh { edges: 6 }))
    );
    corners.1.remove(0);
    let open = ShapeDefinition::new(Shape::mesh(corners.0, corners.1).unwrap());
    assert_eq!(world.add_shape(body, &open), Err(Error::Shape(ShapeError::OpenMesh { edges: 3 })));
    world.add_shape(body, &open.clone().sensor()).unwrap();
    world.add_shape(body, &open.density(0.0)).unwrap();
    world.add_shape(body, &ShapeDefinition::new(field).density(0.0)).unwrap();
}

fn rests(world: &mut World, body: BodyId, seconds: f32, what: &str) -> Vec3 {
    run(world, seconds);
    let (v, w) = (velocity(world, body), spin(world, body));
    assert!(!world.body(body).unwrap().is_awake(), "{what} is awake: {} v {v} w {w}", position(world, body));
    position(world, body)
}

/// A torus dropped on a box, on a mesh, on a height field and on a half-space lies down flat and sleeps.
#[test]
fn a_torus_comes_to_rest() {
    let floors = [
        (cuboid(10.0, 1.0, 10.0), Vec3::NEG_Y, "a box"),
        (mesh_of_two_materials(10.0), Vec3::ZERO, "a mesh"),
        (box_mesh(Vec3::new(10.0, 1.0, 10.0)), Vec3::NEG_Y, "a closed mesh"),
        (Shape::height_field(vec![0.0; 41 * 41], 41, [0.5; 2]).unwrap(), Vec3::new(-10.0, 0.0, -10.0), "a field"),
        (Shape::half_space(), Vec3::ZERO, "a half-space"),
    ];
    for (floor, place, name) in floors {
        let mut world = world();
        world.add_shape(BodyId::WORLD, &ShapeDefinition::new(floor).at(place)).unwrap();
        let body = BodyDefinition::dynamic().at(Vec3::new(0.1, 0.9, 0.2)).rotated(turn(Vec3::X, 60.0));
        let body = add(&mut world, &body, &ShapeDefinition::new(torus(24, 12, 0.5, 0.15)));
        let place = rests(&mut world, body, 12.0, name);
        assert_near(place.y, 0.15, 0.01, name);
    }
}

/// Boxes made of meshes stand on each other as boxes do.
#[test]
fn a_stack_of_box_meshes_stands() {
    let mut world = world();
    floor(&mut world, 0.5);
    let block = box_mesh(Vec3::new(0.5, 0.25, 0.4));
    let bodies: Vec<BodyId> = (0..5)
        .map(|i| drop_shape(&mut world, &block, Vec3::new(0.1 * (i % 2) as f32, 0.26 + 0.51 * i as f32, 0.0)))
        .collect();
    run(&mut world, 6.0);
    for (i, &body) in bodies.iter().enumerate() {
        let place = position(&world, body);
        assert_near(place.y, 0.25 + 0.5 * i as f32, 0.02, "height");
        assert_near(place.x, 0.1 * (i % 2) as f32, 0.02, "place");
        assert!(!world.body(body).unwrap().is_awake(), "{i} is awake");
    }
}

/// A torus hangs on a rod: mesh around mesh.
#[test]
fn a_torus_hangs_on_a_rod() {
    let mut world = world();
    let sides = 12;
    let mut rod = Vec::new();
    for i in 0..sides {
        let (x, y) = ring(i, sides);
        rod.extend([Vec3::new(0.1 * x, 0.1 * y, -1.0), Vec3::new(0.1 * x, 0.1 * y, 1.0)]);
    }
    let (corners, triangles) = Shape::hull(&rod).unwrap().triangulate(1);
    world.add_shape(BodyId::WORLD, &ShapeDefinition::new(Shape::mesh(corners, triangles).unwrap())).unwrap();
    let ring = ShapeDefinition::new(torus(24, 12, 0.5, 0.1));
    let start = BodyDefinition { angular_damping: 2.0, ..BodyDefinition::dynamic().at(Vec3::new(0.05, -0.2, 0.0)) };
    let body = add(&mut world, &start, &ring);
    let mut deepest: f32 = 0.0;
    for _ in 0..600 {
        world.step(DT).unwrap();
        for arbiter in world.arbiters() {
            deepest = arbiter.data().contacts().fold(deepest, |m, (_, contact)| m.min(contact.separation()));
        }
    }
    // The tube's inside, at 0.4 m from the middle, lies on the rod's top at 0.1 m.
    let place = position(&world, body);
    assert_near(place.y, -0.3, 0.02, "height of the ring");
    assert!(place.x.abs() < 0.05 && place.z.abs() < 0.3, "{place}");
    assert!(deepest > -0.02, "{deepest}");
    assert!(velocity(&world, body).length() < 0.05 && spin(&world, body).length() < 0.2);
}

/// A mirrored and stretched mesh faces outwards as before: contacts are the mirror image, and its mass is right.
#[test]
fn a_mirrored_mesh_is_its_mirror_image() {
    let corners = vec![
        Vec3::new(-2.0, 0.0, -2.0),
        Vec3::new(-2.0, 0.3, 2.0),
        Vec3::new(2.0, 0.5, -2.0),
        Vec3::new(2.0, 1.4, 2.0),
    ];
    let mesh = Shape::mesh(corners, vec![[0, 1, 2], [2, 1, 3]]).unwrap();
    let mirrored = mesh.scaled(Vec3::new(-1.0, 1.0, 1.0)).unwrap();
    let flip = |v: Vec3| Vec3::new(-v.x, v.y, v.z);
    let mut random = Random(5);
    let mut number = || (random.bits() % 2001) as f32 / 1000.0 - 1.0;
    let mut touches = 0;
    for _ in 0..300 {
        let place = Vec3::new(1.5 * number(), 0.8 + 0.7 * number(), 1.5 * number());
        let touch = |mesh: &Shape, place: Vec3| {
            let mut manifold = Manifold::EMPTY;
            collide(mesh, &sphere(0.3), &Pose::from_position(place), 0.02, &mut PairCache::default(), &mut manifold);
            manifold
        };
        let (found, expected) = (touch(&mirrored, flip(place)), touch(&mesh, place));
        assert_eq!(found.points().len(), expected.points().len(), "{place}");
        for (a, b) in found.points().iter().zip(expected.points()) {
            touches += 1;
            assert!((a.normal - flip(b.normal)).length() < 1e-5 && (a.separation - b.separation).abs() < 1e-5);
        }
    }
    assert!(touches > 50, "{touches}");
    let stretched = box_mesh(Vec3::new(0.5, 0.4, 0.3)).scaled(Vec3::new(-2.0, 0.5, -1.0)).unwrap();
    assert_relative(stretched.mass_properties(1000.0).unwrap().mass, 8.0 * 1000.0 * 1.0 * 0.2 * 0.3, 1e-5, "mass");
    let inside_out = box_mesh(Vec3::new(0.5, 0.4, 0.3)).scaled(Vec3::new(-2.0, 0.5, 1.0)).unwrap();
    assert_relative(inside_out.mass_properties(1000.0).unwrap().mass, 8.0 * 1000.0 * 1.0 * 0.2 * 0.3, 1e-5, "mass");
}
