//! Triangle meshes: sliding over inner edges, resting, sides.

mod common;

use arbiter3d::math::Vec3;
use arbiter3d::{
    BodyDefinition, BodyId, BodyKind, Error, MeshSides, Shape, ShapeDefinition, ShapeError, TriangleMesh, World,
};
use common::*;

/// A grid of `cells` × `cells` squares of this size about the origin, solid from above.
fn grid(cells: u32, size: f32, height: impl Fn(f32, f32) -> f32, sides: MeshSides) -> Shape {
    let mut vertices = Vec::new();
    let mut triangles = Vec::new();
    let at = |i: u32| (i as f32 - 0.5 * cells as f32) * size;
    for z in 0..=cells {
        for x in 0..=cells {
            vertices.push(Vec3::new(at(x), height(at(x), at(z)), at(z)));
        }
    }
    for z in 0..cells {
        for x in 0..cells {
            let corner = z * (cells + 1) + x;
            triangles.push([corner, corner + cells + 1, corner + 1]);
            triangles.push([corner + 1, corner + cells + 1, corner + cells + 2]);
        }
    }
    Shape::Mesh(TriangleMesh::with_sides(vertices, triangles, sides).unwrap().into())
}

fn flat() -> Shape {
    grid(100, 0.5, |_, _| 0.0, MeshSides::One)
}

/// What sliding over a floor does to a body.
#[derive(Clone, Copy, Debug)]
struct Slide {
    /// Largest vertical speed, m/s.
    bump: f32,
    /// Speed along the heading at the end, m/s.
    speed: f32,
    /// Largest sideways speed, m/s.
    aside: f32,
}

/// Lets a body come to rest on the floor, pushes it in a direction, and watches it for a second.
fn slide(floor: &Shape, top: f32, shape: &Shape, degrees: f32) -> Slide {
    let mut world = sleepless();
    let ground = ShapeDefinition::new(floor.clone()).at(Vec3::Y * top).friction(0.2);
    world.add_shape(BodyId::WORLD, &ground).unwrap();
    let start = Vec3::new(0.13, shape.local_aabb().max.y, 0.21);
    // Capsules lie down and roll about their axis; turned with the heading so that they slide lengthwise.
    let ahead = heading(degrees);
    let body = BodyDefinition::dynamic().at(start).rotated(turn(Vec3::Y, -degrees));
    let body = add(&mut world, &body, &ShapeDefinition::new(shape.clone()).friction(0.2));
    run(&mut world, 0.5);
    world.body_mut(body).unwrap().set_linear_velocity(ahead * 6.0).unwrap();
    let (mut bump, mut aside): (f32, f32) = (0.0, 0.0);
    for _ in 0..60 {
        world.step(DT).unwrap();
        let v = velocity(&world, body);
        bump = bump.max(v.y.abs());
        aside = aside.max(v.cross(ahead).length());
    }
    Slide { bump, speed: velocity(&world, body).dot(ahead), aside }
}

fn slides_like_on_a_box(name: &str, shape: &Shape) {
    let (mesh, block) = (flat(), cuboid(25.0, 1.0, 25.0));
    let mut worst = Slide { bump: 0.0, speed: 0.0, aside: 0.0 };
    for direction in 0..16 {
        let degrees = direction as f32 * 22.5;
        let (on_mesh, on_box) = (slide(&mesh, 0.0, shape, degrees), slide(&block, -1.0, shape, degrees));
        let lost = on_box.speed - on_mesh.speed;
        worst.bump = worst.bump.max(on_mesh.bump);
        worst.speed = worst.speed.max(lost.abs());
        worst.aside = worst.aside.max(on_mesh.aside);
        assert!(on_mesh.bump < 1e-3, "{name} at {degrees}°: vertical speed {} m/s", on_mesh.bump);
        assert!(lost < 2e-3, "{name} at {degrees}°: {on_mesh:?} on the mesh, {on_box:?} on the box");
        assert!(on_mesh.aside < on_box.aside + 5e-3, "{name} at {degrees}°: {on_mesh:?}, on the box {on_box:?}");
    }
    println!(
        "{name}: bump {:.1e} m/s, speed differs by {:.1e} m/s, aside {:.1e} m/s",
        worst.bump, worst.speed, worst.aside
    );
}

/// A sphere does not feel the inner edges of a flat mesh.
#[test]
fn a_sphere_slides_over_inner_edges() {
    slides_like_on_a_box("sphere", &sphere(0.3));
}

/// Nor does a box.
#[test]
fn a_box_slides_over_inner_edges() {
    slides_like_on_a_box("box", &cuboid(0.4, 0.2, 0.3));
}

/// Nor a capsule that lies on its side: a hull-free rounded body with two contacts.
#[test]
fn a_capsule_slides_over_inner_edges() {
    let (mesh, block) = (flat(), cuboid(25.0, 1.0, 25.0));
    let slide_lying = |floor: &Shape, top: f32, degrees: f32| {
        let mut world = sleepless();
        let ground = ShapeDefinition::new(floor.clone()).at(Vec3::Y * top).friction(0.2);
        world.add_shape(BodyId::WORLD, &ground).unwrap();
        let lying = turn(Vec3::Y, -degrees) * turn(Vec3::Z, 90.0);
        let body = BodyDefinition::dynamic().at(Vec3::new(0.13, 0.2, 0.21)).rotated(lying);
        let body = add(&mut world, &body, &ShapeDefinition::new(capsule(0.4, 0.2)).friction(0.2));
        run(&mut world, 0.5);
        world.body_mut(body).unwrap().set_linear_velocity(heading(degrees) * 6.0).unwrap();
        let mut bump: f32 = 0.0;
        for _ in 0..60 {
            world.step(DT).unwrap();
            bump = bump.max(velocity(&world, body).y.abs());
        }
        (bump, velocity(&world, body).dot(heading(degrees)))
    };
    for direction in 0..16 {
        let degrees = direction as f32 * 22.5;
        let (on_mesh, on_box) = (slide_lying(&mesh, 0.0, degrees), slide_lying(&block, -1.0, degrees));
        assert!(on_mesh.0 < 1e-3, "at {degrees}°: vertical speed {} m/s", on_mesh.0);
        assert!(on_box.1 - on_mesh.1 < 2e-3, "at {degrees}°: {on_mesh:?} on the mesh, {on_box:?} on the box");
    }
}

/// A ball that rolls over a mesh keeps its speed as on a plane.
#[test]
fn a_ball_rolls_over_a_mesh_as_over_a_plane() {
    let mut world = sleepless();
    world.add_shape(BodyId::WORLD, &ShapeDefinition::new(flat()).rolling_resistance(0.0)).unwrap();
    for degrees in [0.0, 10.0, 45.0, 80.0] {
        let ahead = heading(degrees);
        let axis = Vec3::Y.cross(ahead);
        let body = BodyDefinition::dynamic().at(Vec3::Y * 0.3).moving(ahead * 3.0, axis * 10.0);
        let body = add(&mut world, &body, &ShapeDefinition::new(sphere(0.3)).rolling_resistance(0.0));
        run(&mut world, 3.0);
        assert_relative(position(&world, body).dot(ahead), 9.0, 0.005, "way");
        assert_near(position(&world, body).y, 0.3, 0.002, "height");
        world.remove_body(body).unwrap();
    }
}

/// A ball that rolls along a groove with sides of 45° lies on two normals, and rolling resistance acts under the load of both:
/// with torques `μ r N`, loads that add up to √2 m g, and the axis at r / √2 over the lines of contact, it slows down by
/// 2 μ g / (1 + 4/5).
#[test]
fn rolling_resistance_acts_under_both_sides_of_a_groove() {
    let mut world = sleepless();
    let groove = grid(40, 0.5, |x, _| x.abs(), MeshSides::One);
    world.add_shape(BodyId::WORLD, &ShapeDefinition::new(groove).friction(0.8).rolling_resistance(0.0)).unwrap();
    let (radius, root) = (0.3, std::f32::consts::SQRT_2);
    let along = Vec3::Z * 3.0;
    let spin = Vec3::X * (3.0 * root / radius);
    let body = BodyDefinition::dynamic().at(Vec3::new(0.0, radius * root, -4.0)).moving(along, spin);
    let ball = ShapeDefinition::new(sphere(radius)).friction(0.8).rolling_resistance(0.05);
    let body = add(&mut world, &body, &ball);
    run(&mut world, 0.5);
    let before = velocity(&world, body).z;
    run(&mut world, 1.0);
    assert_relative(before - velocity(&world, body).z, 2.0 * 0.05 * 9.81 / 1.8, 0.05, "deceleration");
}

/// Bodies of every kind come to rest on hills, above the ground at every corner, and sleep.
#[test]
fn mixed_bodies_rest_on_hills() {
    let mut world = world();
    let height = |x: f32, z: f32| 0.5 * (libm::sin(f64::from(0.9 * x)) * libm::cos(f64::from(0.8 * z))) as f32;
    let hills = ShapeDefinition::new(grid(60, 0.5, height, MeshSides::One)).friction(0.8);
    let hills = world.add_shape(BodyId::WORLD, &hills).unwrap();
    let mut random = Random(9);
    let mut bodies = Vec::new();
    for at in 0..200 {
        let place = Vec3::new((at % 10) as f32 - 4.5, 1.5 + (at / 50) as f32, (at / 10 % 5) as f32 * 2.0 - 4.0);
        let body = BodyDefinition::dynamic().at(place).rotated(random.rotation());
        let shape = ShapeDefinition::new(random.shape()).friction(0.8).rolling_resistance(0.1);
        bodies.push(add(&mut world, &body, &shape));
    }
    run(&mut world, 15.0);
    println!("hills: {} awake, deepest {:.2} mm", world.awake_count(), world.deepest_penetration() * 1e3);
    for &body in &bodies {
        let p = world.body(body).unwrap().center_of_mass();
        assert!(p.x.abs() < 15.0 && p.z.abs() < 15.0, "{p} is on the mesh");
        assert!(p.y > height(p.x, p.z) + 0.05, "{body:?} at {p} is above the ground");
    }
    assert!(world.awake_count() <= 1, "{} of 200 still awake", world.awake_count());
    assert!(world.deepest_penetration() < 0.02, "{}", world.deepest_penetration());
    assert!(world.shape(hills).is_some());
    world.validate().unwrap();
}

/// A one-sided mesh stops what comes from above, and lets pass what comes from below; a two-sided one stops both.
#[test]
fn a_mesh_has_one_or_two_sides() {
    for (sides, passes) in [(MeshSides::One, true), (MeshSides::Two, false)] {
        let mut world = weightless();
        world.add_shape(BodyId::WORLD, &ShapeDefinition::new(grid(4, 2.0, |_, _| 0.0, sides))).unwrap();
        let down = BodyDefinition::dynamic().at(Vec3::new(1.3, 1.0, 0.4)).moving(Vec3::Y * -2.0, Vec3::ZERO);
        let up = BodyDefinition::dynamic().at(Vec3::new(-1.3, -1.0, 0.4)).moving(Vec3::Y * 2.0, Vec3::ZERO);
        let down = add(&mut world, &down, &ShapeDefinition::new(sphere(0.2)));
        let up = add(&mut world, &up, &ShapeDefinition::new(sphere(0.2)));
        run(&mut world, 2.0);
        assert_near(position(&world, down).y, 0.2, 0.01, "from above");
        let y = position(&world, up).y;
        if passes { assert!(y > 2.0, "{y}") } else { assert_near(y, -0.2, 0.01, "from below") }
    }
}

/// A kinematic mesh carries what lies on it.
#[test]
fn a_kinematic_mesh_carries_riders() {
    let mut world = sleepless();
    let tray = BodyDefinition::kinematic().moving(Vec3::new(0.5, 0.25, 0.0), Vec3::ZERO);
    let tray = add(&mut world, &tray, &ShapeDefinition::new(grid(10, 0.5, |_, _| 0.0, MeshSides::One)));
    let rider = drop_shape(&mut world, &cuboid(0.3, 0.2, 0.3), Vec3::new(0.1, 0.2, 0.1));
    run(&mut world, 4.0);
    let gap = position(&world, rider) - position(&world, tray);
    assert!(gap.distance(Vec3::new(0.1, 0.2, 0.1)) < 0.05, "{gap}");
    assert_near(position(&world, tray).y, 1.0, 1e-3, "height of the tray");
}

/// Open meshes have no inside: they do not go on dynamic bodies, and their carriers cannot become dynamic.
#[test]
fn meshes_do_not_go_on_dynamic_bodies() {
    let mut world: World = world();
    let mesh = ShapeDefinition::new(grid(2, 1.0, |_, _| 0.0, MeshSides::One));
    let body = world.add_body(&BodyDefinition::dynamic()).unwrap();
    assert_eq!(world.add_shape(body, &mesh), Err(Error::Shape(ShapeError::OpenMesh { edges: 8 })));
    let fixed = world.add_body(&BodyDefinition::fixed()).unwrap();
    world.add_shape(fixed, &mesh).unwrap();
    assert_eq!(
        world.body_mut(fixed).unwrap().set_kind(BodyKind::Dynamic),
        Err(Error::Shape(ShapeError::OpenMesh { edges: 8 }))
    );
    assert_eq!(world.body(fixed).unwrap().kind(), BodyKind::Static);
    world.body_mut(fixed).unwrap().set_kind(BodyKind::Kinematic).unwrap();
}

/// Corners of an upright six-sided prism.
fn six_sided(radius: f32, low: f32, high: f32) -> Vec<Vec3> {
    let corner = |i: usize, y: f32| {
        let angle = std::f64::consts::TAU * i as f64 / 6.0;
        Vec3::new(radius * libm::cos(angle) as f32, y, radius * libm::sin(angle) as f32)
    };
    (0..6).flat_map(|i| [corner(i, low), corner(i, high)]).collect()
}

/// A trunk of twenty tapering prisms, 40 m high, one body that tips over about its foot.
fn falling_trunk(world: &mut World) -> BodyId {
    let spin = Vec3::Z * -0.5;
    let body = BodyDefinition::dynamic().at(Vec3::Y * 0.02).moving(spin.cross(Vec3::Y * 17.0), spin);
    let body = world.add_body(&body).unwrap();
    for part in 0..20_u8 {
        let (low, radius) = (2.0 * f32::from(part), 0.75 * libm::powf(0.95, f32::from(part)));
        let hull = Shape::hull(&six_sided(radius, low, low + 2.5)).unwrap();
        world.add_shape(body, &ShapeDefinition::new(hull).density(1.0).friction(0.9).rolling_resistance(0.05)).unwrap();
    }
    body
}

/// Nothing bounces that is not elastic: a falling trunk, whose tip comes down at 35 m/s, lies where it has hit, on level
/// ground and on waves, on whose crests it hits in several places one after the other.
#[test]
fn a_falling_trunk_does_not_bounce() {
    let wave = |x: f32, z: f32| 0.4 * libm::sinf(0.628 * x) * libm::sinf(0.314 * z + 0.8);
    let grounds = [(0.0, grid(120, 1.0, |_, _| 0.0, MeshSides::One)), (0.4, grid(120, 1.0, wave, MeshSides::One))];
    for (amplitude, ground) in grounds {
        let mut world = sleepless();
        world.add_shape(BodyId::WORLD, &ShapeDefinition::new(ground).friction(0.9)).unwrap();
        let trunk = falling_trunk(&mut world);
        let (mut down, mut highest): (usize, f32) = (0, 0.0);
        let (mut deepest, mut last): (f32, f32) = (0.0, 0.0);
        for _ in 0..600 {
            world.step(DT).unwrap();
            let body = world.body(trunk).unwrap();
            let axis = body.rotation() * Vec3::Y;
            down += usize::from(down > 0 || axis.y < 0.0);
            if down > 0 {
                highest = highest.max(body.position().y).max((body.position() + axis * 40.0).y);
            }
            let gaps = world.arbiters().flat_map(|arbiter| arbiter.data().contacts()).map(|(_, c)| c.separation());
            last = gaps.fold(0.0, f32::min);
            deepest = deepest.min(last);
        }
        assert!(down > 200, "it has fallen: {down} steps ago");
        // Lying, its axis is 0.75 m over the ground at its foot.
        assert!(highest < amplitude + 1.0, "an end of the trunk rose to {highest} m over waves of {amplitude} m");
        assert!(deepest > -0.1 && last > -0.005, "waves of {amplitude} m: {deepest} m deep, in the end {last} m");
    }
}
