//! Bodies on slopes, at walls, and far from their frames.

use crate::math::{Real, Rotation, Vec3};
use crate::{BodyDefinition, Shape, ShapeDefinition, World};

/// A slope of 10° as one box and as a mesh of cells of 1 m, without friction.
fn slopes() -> [Shape; 2] {
    let cells = 100;
    let corner = |i: usize, j: usize| Vec3::new(i as Real - 1.0, 0.0, j as Real - 10.0);
    let vertices = (0..=cells).flat_map(|i| (0..=20).map(move |j| corner(i, j))).collect();
    let mut triangles = Vec::new();
    for a in (0..cells as u32).flat_map(|i| (0..20).map(move |j| i * 21 + j)) {
        triangles.extend([[a, a + 1, a + 21], [a + 1, a + 22, a + 21]]);
    }
    [Shape::cuboid(Vec3::new(200.0, 1.0, 10.0)).unwrap(), Shape::mesh(vertices, triangles).unwrap()]
}

/// Two balls on an axle, a box and a hull slide down a slope faster than their own size a step: they are not held by
/// the surface that they slide on.
#[test]
fn fast_bodies_slide_on_without_being_held() {
    let angle: Real = 10.0_f32.to_radians();
    let down = Vec3::new(libm::cosf(angle), -libm::sinf(angle), 0.0);
    let up = Vec3::new(libm::sinf(angle), libm::cosf(angle), 0.0);
    let turn = Rotation::from_xyzw(0.0, 0.0, -libm::sinf(0.5 * angle), libm::cosf(0.5 * angle)).to_quat();
    let ball = ShapeDefinition::new(Shape::sphere(0.3).unwrap()).friction(0.0);
    let cube = ShapeDefinition::new(Shape::cuboid(Vec3::splat(0.3)).unwrap()).friction(0.0);
    let bodies = [
        vec![ball.clone().at(Vec3::new(0.0, 0.0, -0.45)), ball.clone().at(Vec3::new(0.0, 0.0, 0.45))],
        vec![ball],
        vec![cube],
    ];
    for (kind, slope) in slopes().into_iter().enumerate() {
        for shapes in &bodies {
            let mut world = World::default();
            let below = if kind == 0 { -up } else { Vec3::ZERO };
            let ground = world.add_body(&BodyDefinition::fixed().at(below).rotated(turn)).unwrap();
            world.add_shape(ground, &ShapeDefinition::new(slope.clone()).friction(0.0)).unwrap();
            let moving = BodyDefinition::dynamic().at(up * 0.3).rotated(turn).moving(down * 40.0, Vec3::ZERO);
            let body = world.add_body(&moving).unwrap();
            for shape in shapes {
                world.add_shape(body, shape).unwrap();
            }
            for _ in 0..60 {
                world.step(1.0 / 60.0).unwrap();
            }
            let moved = world.body(body).unwrap().position();
            let expected = 40.0 + 0.5 * 9.81 * libm::sinf(angle);
            assert!((moved.dot(down) - expected).abs() < 0.1, "{kind}: {} m, not {expected} m", moved.dot(down));
            assert!((moved.dot(up) - 0.3).abs() < 0.01, "{kind}: {} m over the slope", moved.dot(up));
        }
    }
}

/// Bodies of 5 cm at 200 m/s, straight and at glancing angles, never get through a wall of 1 cm or a mesh.
#[test]
fn fast_bodies_do_not_pass_through_thin_walls() {
    let corners = [(-9.0, -9.0), (9.0, -9.0), (9.0, 9.0), (-9.0, 9.0)];
    let square = corners.map(|(x, y)| Vec3::new(x, y, 0.0)).to_vec();
    let walls =
        [Shape::cuboid(Vec3::new(9.0, 9.0, 0.005)).unwrap(), Shape::mesh(square, vec![[0, 1, 2], [0, 2, 3]]).unwrap()];
    let rock: Vec<Vec3> =
        (0..8u8).map(|i| [i & 1, i >> 1 & 1, i >> 2].map(|b| 0.1 * Real::from(b) - 0.05).into()).collect();
    let shapes = [
        Shape::sphere(0.05).unwrap(),
        Shape::cuboid(Vec3::splat(0.05)).unwrap(),
        Shape::capsule(0.2, 0.05).unwrap(),
        Shape::hull(&rock).unwrap(),
    ];
    for (shape, wall, round) in
        shapes.iter().flat_map(|s| walls.iter().flat_map(move |w| (0..40).map(move |r| (s, w, r))))
    {
        let mut world = World::new(crate::WorldSettings { gravity: Vec3::ZERO, ..Default::default() }).unwrap();
        world.add_shape(crate::BodyId::WORLD, &ShapeDefinition::new(wall.clone())).unwrap();
        let lean = 0.1 * (round % 8) as Real;
        let velocity = Vec3::new(lean, 0.3 * lean, -1.0) * 200.0;
        let start = Vec3::new(-2.0 * lean, 0.0, 0.5 + 0.37 * round as Real);
        let definition = BodyDefinition::dynamic().at(start).moving(velocity, Vec3::new(30.0, 20.0, 10.0) * lean);
        let body = world.add_body(&definition).unwrap();
        world.add_shape(body, &ShapeDefinition::new(shape.clone())).unwrap();
        for step in 0..30 {
            world.step(1.0 / 60.0).unwrap();
            let position = world.body(body).unwrap().position();
            let beside = position.x.abs() > 8.5 || position.y.abs() > 8.5;
            assert!(position.z > 0.0 || beside, "{shape:?}, round {round}, step {step}: at {position}");
            if beside {
                break;
            }
        }
    }
}

/// A thin plate given as a hull 40 m away from its frame, and from its body's origin, is stopped at a one-sided floor
/// however its frame lies to the floor; below or above it.
#[test]
fn a_part_far_from_its_frame_is_stopped_on_the_side_where_it_is() {
    let corners = [(-9.0, -9.0), (-9.0, 9.0), (9.0, 9.0), (9.0, -9.0)];
    let square = corners.map(|(x, z)| Vec3::new(x, 0.0, z)).to_vec();
    let floor = Shape::mesh(square, vec![[0, 1, 2], [0, 2, 3]]).unwrap();
    for offset in [Vec3::new(3.0, 40.0, -2.0), Vec3::new(-3.0, -40.0, 2.0), Vec3::new(40.0, 0.0, 0.0)] {
        let plate: Vec<Vec3> = (0..8u8)
            .map(|i| Vec3::from([i & 1, i >> 1 & 1, i >> 2].map(|b| Real::from(b) - 0.5)))
            .map(|p| p * Vec3::new(0.8, 0.1, 0.8) + offset)
            .collect();
        let mut world = World::new(crate::WorldSettings { gravity: Vec3::ZERO, ..Default::default() }).unwrap();
        world.add_shape(crate::BodyId::WORLD, &ShapeDefinition::new(floor.clone())).unwrap();
        let falling = BodyDefinition::dynamic().at(Vec3::Y * 1.5 - offset).moving(Vec3::Y * -150.0, Vec3::ZERO);
        let body = world.add_body(&falling).unwrap();
        world.add_shape(body, &ShapeDefinition::new(Shape::hull(&plate).unwrap())).unwrap();
        for _ in 0..10 {
            world.step(1.0 / 60.0).unwrap();
            let height = world.body(body).unwrap().center_of_mass().y;
            assert!(height > 0.02, "frame at {offset}: the plate is at {height}");
        }
    }
}
