//! Nothing is felt of the inner edges of meshes and height fields, nor of the borders between tiles.

mod common;

use arbiter3d::math::Vec3;
use arbiter3d::{BodyDefinition, BodyId, HeightField, Shape, ShapeDefinition, World};
use common::*;

const DIRECTIONS: usize = 32;

/// A flat mesh of 32 m with cells of half a metre.
fn flat_mesh() -> Vec<(Shape, Vec3)> {
    let side = 65_u32;
    let at = |i: u32| 0.5 * i as f32 - 16.0;
    let vertices = (0..side * side).map(|i| Vec3::new(at(i % side), 0.0, at(i / side))).collect();
    let mut triangles = Vec::new();
    for cell in 0..64 * 64 {
        let i = cell / 64 * side + cell % 64;
        triangles.extend([[i, i + side, i + 1], [i + 1, i + side, i + side + 1]]);
    }
    vec![(Shape::mesh(vertices, triangles).unwrap(), Vec3::ZERO)]
}

/// The same as one height field.
fn flat_field() -> Vec<(Shape, Vec3)> {
    vec![(Shape::height_field(vec![0.0; 65 * 65], 65, [0.5; 2]).unwrap(), Vec3::new(-16.0, 0.0, -16.0))]
}

/// The same as 8 × 8 height fields of 4 m.
fn tiles() -> Vec<(Shape, Vec3)> {
    let tile = Shape::height_field(vec![0.0; 81], 9, [0.5; 2]).unwrap();
    let corner = |i: usize| 4.0 * i as f32 - 16.0;
    (0..64).map(|i| (tile.clone(), Vec3::new(corner(i % 8), 0.0, corner(i / 8)))).collect()
}

fn ground(floor: &[(Shape, Vec3)], friction: f32) -> World {
    let mut world = world();
    for (shape, place) in floor {
        let definition = ShapeDefinition::new(shape.clone()).at(*place).friction(friction).rolling_resistance(0.0);
        world.add_shape(BodyId::WORLD, &definition).unwrap();
    }
    world
}

/// What 10 m over a floor do to a body: largest vertical speed (m/s), share of the speed lost, way aside (m).
#[derive(Clone, Copy, Debug, Default)]
struct Passage {
    bump: f32,
    lost: f32,
    aside: f32,
}

/// A body at rest on the floor gets a speed of 6 m/s, rolling if `rolls` is its radius, and goes 10 m.
fn pass(floor: &[(Shape, Vec3)], shape: &ShapeDefinition, lying: bool, degrees: f32, rolls: Option<f32>) -> Passage {
    let friction = if rolls.is_some() { 0.5 } else { 0.0 };
    let mut world = ground(floor, friction);
    let ahead = heading(degrees);
    let turned = turn(Vec3::Y, -degrees) * if lying { turn(Vec3::Z, 90.0) } else { turn(Vec3::Z, 0.0) };
    let height = if lying { shape.shape.local_aabb().max.x } else { -shape.shape.local_aabb().min.y };
    let body = BodyDefinition::dynamic().at(Vec3::new(0.13, height, 0.21)).rotated(turned);
    let body = add(&mut world, &body, &shape.clone().friction(friction).rolling_resistance(0.0));
    run(&mut world, 0.5);
    world.body_mut(body).unwrap().set_linear_velocity(ahead * 6.0).unwrap();
    if let Some(radius) = rolls {
        world.body_mut(body).unwrap().set_angular_velocity(Vec3::Y.cross(ahead) * (6.0 / radius)).unwrap();
    }
    let start = position(&world, body);
    let mut passage = Passage::default();
    for _ in 0..100 {
        world.step(DT).unwrap();
        passage.bump = passage.bump.max(velocity(&world, body).y.abs());
    }
    let way = position(&world, body) - start;
    assert!(way.dot(ahead) > 9.0, "{way}");
    passage.lost = 1.0 - velocity(&world, body).dot(ahead) / 6.0;
    passage.aside = way.cross(ahead).dot(Vec3::Y).abs();
    passage
}

fn all_ways(name: &str, floor: &[(Shape, Vec3)]) {
    let shapes = [
        ("sphere", sphere(0.3), false),
        ("box", cuboid(0.4, 0.2, 0.3), false),
        ("capsule", capsule(0.4, 0.2), true),
        ("hull", wedge(0.3), false),
    ];
    for (kind, shape, lying) in shapes {
        let mut worst = Passage::default();
        for direction in 0..DIRECTIONS {
            let degrees = 360.0 / DIRECTIONS as f32 * direction as f32;
            let passage = pass(floor, &ShapeDefinition::new(shape.clone()), lying, degrees, None);
            assert!(passage.bump < 1e-3, "{kind} over {name} at {degrees}°: {passage:?}");
            assert!(passage.lost.abs() < 1e-3, "{kind} over {name} at {degrees}°: {passage:?}");
            worst.bump = worst.bump.max(passage.bump);
            worst.lost = worst.lost.max(passage.lost);
            worst.aside = worst.aside.max(passage.aside);
        }
        println!("{kind} over {name}: {worst:?}");
    }
    let mut worst = Passage::default();
    for direction in 0..DIRECTIONS {
        let degrees = 360.0 / DIRECTIONS as f32 * direction as f32;
        let passage = pass(floor, &ShapeDefinition::new(sphere(0.3)), false, degrees, Some(0.3));
        assert!(passage.bump < 1e-3 && passage.aside < 1e-3, "rolling over {name} at {degrees}°: {passage:?}");
        worst.bump = worst.bump.max(passage.bump);
        worst.lost = worst.lost.max(passage.lost);
        worst.aside = worst.aside.max(passage.aside);
    }
    println!("ball that rolls over {name}: {worst:?}");
}

#[test]
fn no_inner_edge_of_a_mesh_is_felt() {
    all_ways("a mesh", &flat_mesh());
}

#[test]
fn no_inner_edge_of_a_height_field_is_felt() {
    all_ways("a height field", &flat_field());
}

#[test]
fn no_seam_between_height_fields_is_felt() {
    all_ways("tiles", &tiles());
}

/// Tiles of a slope of 10°, also on bodies of their own: a ball that rolls down over 3 × 3 of them keeps its line and gains
/// speed as on one plane: 5/7 g sin 10°.
#[test]
fn a_ball_rolls_down_tiles_of_a_slope() {
    let slope = libm::tan(10.0_f64.to_radians()) as f32;
    let mut world = world();
    for tile in 0..9 {
        let corner = |i: usize| 6.0 * i as f32 - 9.0;
        let (x, z) = (corner(tile % 3), corner(tile / 3));
        let heights = (0..169).map(|i| -slope * (x + 0.5 * (i % 13) as f32)).collect();
        let field = HeightField::new(heights, 13, [0.5; 2]).unwrap();
        let body = world.add_body(&BodyDefinition::fixed().at(Vec3::new(x, 0.0, z))).unwrap();
        let definition = ShapeDefinition::new(Shape::HeightField(field.into())).rolling_resistance(0.0);
        world.add_shape(body, &definition).unwrap();
    }
    let (sine, cosine) = (libm::sin(10.0_f64.to_radians()) as f32, libm::cos(10.0_f64.to_radians()) as f32);
    let start = Vec3::new(-8.0, slope * 8.0, 0.0) + Vec3::new(sine, cosine, 0.0) * 0.3;
    let ball = ShapeDefinition::new(sphere(0.3)).rolling_resistance(0.0);
    let ball = add(&mut world, &BodyDefinition::dynamic().at(start), &ball);
    let normal = Vec3::new(sine, cosine, 0.0);
    for step in 0..180 {
        world.step(DT).unwrap();
        let away = velocity(&world, ball).dot(normal).abs();
        assert!(step < 30 || away < 1e-3, "step {step}: {away} m/s off the plane");
    }
    assert_relative(velocity(&world, ball).length(), 5.0 / 7.0 * GRAVITY * sine * 3.0, 0.01, "speed");
    assert!(position(&world, ball).z.abs() < 1e-3, "{}", position(&world, ball));
}

/// Balls dropped into holes fall through, those beside them stay.
#[test]
fn holes_let_balls_through() {
    let holes: Vec<bool> = (0..100).map(|cell| (cell % 10) % 3 == 1 && (cell / 10) % 3 == 1).collect();
    let field = HeightField::new(vec![0.0; 121], 11, [1.0; 2]).unwrap().with_holes(&holes).unwrap();
    let mut world = world();
    world.add_shape(BodyId::WORLD, &ShapeDefinition::new(Shape::HeightField(field.into()))).unwrap();
    let middle = |cell: usize| Vec3::new((cell % 10) as f32 + 0.5, 0.6, (cell / 10) as f32 + 0.5);
    let balls: Vec<BodyId> = (0..100).map(|cell| drop_shape(&mut world, &sphere(0.3), middle(cell))).collect();
    run(&mut world, 2.0);
    for (cell, &ball) in balls.iter().enumerate() {
        let height = position(&world, ball).y;
        if holes[cell] {
            assert!(height < -5.0, "cell {cell}: {height}");
        } else {
            assert_near(height, 0.3, 5e-3, "height of a ball");
        }
    }
}
