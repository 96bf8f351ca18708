//! Scenes in which everything is fast: what continuous collision is for.

use crate::builder::Builder;
use crate::{BuiltScene, SceneOptions};
use arbiter3d::{
    BodyDefinition, BodyId, CombineRule, CompoundChild, Error, Material, Shape, ShapeDefinition, WorldSettings,
    math::{Quat, Real, Vec3},
};

/// Half the width of the room.
const ROOM: Real = 50.0;
/// Half the thickness of its walls.
const WALL: Real = 0.2;

/// Jolt's HighSpeed: balls, boxes and bodies of two shapes at 250 m/s in a closed room with elastic walls.
///
/// Jolt's random numbers are another generator's; the distributions are its own.
pub(crate) fn high_speed_room(options: &SceneOptions, size: usize) -> Result<BuiltScene, Error> {
    room(options, size, false)
}

/// The same with bullets.
pub(crate) fn high_speed_bullets(options: &SceneOptions, size: usize) -> Result<BuiltScene, Error> {
    room(options, size, true)
}

fn room(options: &SceneOptions, size: usize, bullet: bool) -> Result<BuiltScene, Error> {
    let mut scene = Builder::new(options, size)?;
    // Friction is Jolt's mean of two, the bounce the larger.
    let material = |friction: Real, restitution: Real| Material {
        friction,
        restitution,
        friction_combine: CombineRule::GeometricMean,
        ..Material::default()
    };
    for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
        for side in [-1.0, 1.0] {
            let half = Vec3::splat(ROOM) - axis * (ROOM - WALL);
            let mut slab = ShapeDefinition::new(Shape::cuboid(half)?).at(axis * side * ROOM);
            slab.material = material(1.0, 1.0);
            scene.world.add_shape(BodyId::WORLD, &slab)?;
        }
    }
    let kinds = [
        vec![ShapeDefinition::new(Shape::sphere(0.5)?)],
        vec![ShapeDefinition::new(Shape::cuboid(Vec3::new(0.25, 0.5, 0.5))?)],
        vec![
            ShapeDefinition::new(Shape::capsule(0.5, 0.125)?).at(Vec3::new(0.0, 0.5, 0.0)),
            ShapeDefinition::new(Shape::cuboid(Vec3::new(0.5, 0.125, 0.125))?).at(Vec3::new(0.5, 0.0, 0.0)),
        ],
    ];
    let mut random = scene.random(5489);
    for index in 0..size {
        let position = random.in_cube(45.0);
        let rotation = random_rotation(&mut random);
        let velocity = random.unit_vector() * 250.0;
        let surface = material(random.range(0.5, 1.0), random.range(0.9, 1.0));
        let body = BodyDefinition::dynamic().at(position).rotated(rotation).moving(velocity, Vec3::ZERO);
        let body = scene.world.add_body(&BodyDefinition { bullet, ..body })?;
        for shape in &kinds[index % kinds.len()] {
            scene.world.add_shape(body, &ShapeDefinition { material: surface, ..shape.clone() })?;
        }
    }
    scene.finish(3600)
}

/// Thin rods of all kinds spin at 100 rad/s in a closed room with walls of 1 cm.
pub(crate) fn spinning_rods(options: &SceneOptions, size: usize) -> Result<BuiltScene, Error> {
    let mut scene = Builder::with_settings(options, size, WorldSettings::default())?;
    let half = 1.5 * (size as Real).sqrt() + 3.0;
    for height in [-0.005, 10.005] {
        let floor = ShapeDefinition::new(Shape::cuboid(Vec3::new(half, 0.005, half))?).at(Vec3::Y * height);
        scene.world.add_shape(BodyId::WORLD, &floor)?;
    }
    for (axis, other) in [(Vec3::X, Vec3::Z), (Vec3::Z, Vec3::X)] {
        for side in [-1.0, 1.0] {
            let wall = ShapeDefinition::new(Shape::cuboid(axis * 0.005 + Vec3::Y * 5.0 + other * half)?);
            scene.world.add_shape(BodyId::WORLD, &wall.at(axis * side * half + Vec3::Y * 5.0))?;
        }
    }
    let corner = |i: u8| Vec3::from([i & 1, i >> 1 & 1, i >> 2].map(|bit| Real::from(bit) * 2.0 - 1.0));
    let bar: Vec<Vec3> = (0..8).map(|i| corner(i) * Vec3::new(0.01, 1.0, 0.01)).collect();
    let rods = [Shape::capsule(0.99, 0.01)?, Shape::cuboid(Vec3::new(0.01, 1.0, 0.01))?, Shape::hull(&bar)?];
    let mut random = scene.random(1);
    let across = (size as Real).sqrt().ceil() as usize;
    for index in 0..size {
        let place = |at: usize| 3.0 * (at as Real - 0.5 * (across as Real - 1.0));
        let position = Vec3::new(place(index % across), 2.0, place(index / across));
        let rotation = random_rotation(&mut random);
        let spin = random.unit_vector() * 100.0;
        let body = BodyDefinition::dynamic().at(position).rotated(rotation).moving(Vec3::ZERO, spin);
        scene.add(&body, &ShapeDefinition::new(rods[index % rods.len()].clone()))?;
    }
    scene.finish(600)
}

/// Bodies of parts and of all slender kinds at 100 m/s in a room of 20 m with elastic walls of 1 cm; each third one is a
/// bullet. A paddle of 2 cm turns in the middle at 10 rad/s.
pub(crate) fn high_speed_kinds(options: &SceneOptions, size: usize) -> Result<BuiltScene, Error> {
    let mut scene = Builder::with_settings(options, size, WorldSettings::default())?;
    for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
        for side in [-1.0, 1.0] {
            let wall = ShapeDefinition::new(Shape::cuboid(Vec3::splat(KINDS_ROOM) - axis * (KINDS_ROOM - 0.005))?);
            scene.world.add_shape(BodyId::WORLD, &wall.at(axis * side * KINDS_ROOM).restitution(0.9))?;
        }
    }
    let paddle = scene.world.add_body(&BodyDefinition::kinematic().moving(Vec3::ZERO, Vec3::Y * 10.0))?;
    scene.world.add_shape(paddle, &ShapeDefinition::new(Shape::cuboid(Vec3::new(4.0, 1.0, 0.01))?))?;
    let kinds = fast_kinds()?;
    let mut random = scene.random(7);
    let mut placed = 0;
    while placed < size {
        let position = random.in_cube(KINDS_ROOM - 1.0);
        if position.length() < 5.5 {
            continue; // where the paddle is
        }
        let velocity = random.unit_vector() * 100.0;
        let body = BodyDefinition::dynamic().at(position).rotated(random_rotation(&mut random));
        let body = BodyDefinition { bullet: placed % 3 == 2, ..body.moving(velocity, random.unit_vector() * 20.0) };
        scene.add(&body, &ShapeDefinition::new(kinds[placed % kinds.len()].clone()).restitution(0.5))?;
        placed += 1;
    }
    scene.finish(600)
}

/// Half the width of the room of [`high_speed_kinds`].
const KINDS_ROOM: Real = 10.0;

/// A hammer, an L, stairs of voxels, a ring as a mesh, and slender bodies of the round kinds.
fn fast_kinds() -> Result<[Shape; 10], Error> {
    let hammer = [
        CompoundChild::new(Shape::capsule(0.4, 0.015)?),
        CompoundChild::new(Shape::cuboid(Vec3::new(0.12, 0.05, 0.05))?).at(Vec3::Y * 0.45),
    ];
    let letter = [
        CompoundChild::new(Shape::cuboid(Vec3::new(0.3, 0.02, 0.02))?).at(Vec3::X * 0.28),
        CompoundChild::new(Shape::cuboid(Vec3::new(0.02, 0.2, 0.02))?).at(Vec3::Y * 0.18),
    ];
    let (count, mut vertices, mut triangles) = (24_u32, Vec::new(), Vec::new());
    for at in 0..count {
        let angle = f64::from(at) / f64::from(count) * std::f64::consts::TAU;
        let out = Vec3::new(libm::cos(angle) as Real, 0.0, libm::sin(angle) as Real);
        for (radius, y) in [(0.3, -0.03), (0.4, -0.03), (0.4, 0.03), (0.3, 0.03)] {
            vertices.push(out * radius + Vec3::Y * y);
        }
        for side in 0..4 {
            let (next, beside) = ((at + 1) % count, (side + 1) % 4);
            let [a, b, c, d] = [4 * at + side, 4 * at + beside, 4 * next + side, 4 * next + beside];
            triangles.extend([[a, b, d], [a, d, c]]);
        }
    }
    Ok([
        Shape::compound(&hammer)?,
        Shape::compound(&letter)?,
        Shape::voxels(0.05, (0..8).map(|at| [at, at / 2, 0]))?,
        Shape::mesh(vertices, triangles)?,
        Shape::cone(0.4, 0.04)?,
        Shape::tapered_capsule(0.4, 0.06, 0.02)?,
        Shape::ellipsoid(Vec3::new(0.03, 0.4, 0.03))?,
        Shape::rounded(&Shape::cuboid(Vec3::new(0.01, 0.4, 0.01))?, 0.01)?,
        Shape::cylinder(0.02, 0.3)?,
        Shape::cylinder(0.4, 0.02)?,
    ])
}

/// Even over all rotations: a random direction in four dimensions.
fn random_rotation(random: &mut crate::Random) -> Quat {
    loop {
        let (v, w) = (random.in_cube(1.0), random.range(-1.0, 1.0));
        let squared = v.length_squared() + w * w;
        if squared > 0.01 && squared <= 1.0 {
            let scale = 1.0 / squared.sqrt();
            return Quat::from_xyzw(v.x * scale, v.y * scale, v.z * scale, w * scale);
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::{SceneOptions, find};
    use arbiter3d::{
        BodyKind,
        math::{Real, Vec3},
    };

    /// Plays a scene and looks at it after each step; the mean time of a step in milliseconds.
    fn play(name: &str, size: usize, steps: usize, mut check: impl FnMut(&arbiter3d::World, usize)) -> f64 {
        let options = SceneOptions { size: Some(size), ..SceneOptions::default() };
        let mut scene = find(name).unwrap().build(&options).unwrap();
        let mut total = 0.0;
        for step in 0..steps {
            scene.world.step(1.0 / 60.0).unwrap();
            total += scene.world.timings().total();
            check(&scene.world, step);
        }
        total / steps as f64
    }

    /// No body's centre leaves the room.
    fn nobody_escapes(name: &str, size: usize, steps: usize) {
        let time = play(name, size, steps, |world, step| {
            for id in world.bodies() {
                let body = world.body(id).unwrap();
                if body.kind() == BodyKind::Dynamic {
                    let farthest: Real = body.position().abs().max_element();
                    assert!(farthest < super::ROOM, "step {step}: {id:?} is at {}", body.position());
                    assert!(!body.is_frozen());
                }
            }
        });
        println!("{name}: {size} bodies, {time} ms a step");
    }

    #[test]
    fn nobody_escapes_from_the_high_speed_room() {
        nobody_escapes("high_speed_room", 300, 600);
        nobody_escapes("high_speed_bullets", 300, 600);
    }

    #[test]
    #[ignore = "minutes long: Jolt's own size"]
    fn nobody_of_5000_escapes_from_the_high_speed_room_within_a_minute() {
        nobody_escapes("high_speed_room", 5000, 3600);
    }

    #[test]
    #[ignore = "minutes long: Jolt's own size"]
    fn no_bullet_of_5000_escapes_from_the_high_speed_room_within_a_minute() {
        nobody_escapes("high_speed_bullets", 5000, 3600);
    }

    /// None of a hundred bodies that bounce between walls of a centimetre for seven seconds, spinning at up to 400 rad/s, gets its
    /// centre of mass through.
    #[test]
    fn bodies_of_all_kinds_stay_in_their_room() {
        play("high_speed_kinds", 100, 400, |world, step| {
            for id in world.bodies() {
                let center = world.body(id).unwrap().center_of_mass();
                assert!(center.abs().max_element() < super::KINDS_ROOM, "step {step}: {id:?} is at {center}");
            }
        });
    }

    /// No rod's middle leaves the room, and no end comes farther out than the walls are thick.
    #[test]
    fn spinning_rods_stay_in_their_room() {
        let half = 1.5 * 10.0 + 3.0;
        play("spinning_rods", 100, 600, |world, step| {
            for id in world.bodies() {
                let body = world.body(id).unwrap();
                if body.kind() == BodyKind::Dynamic {
                    let (middle, end) = (body.position(), body.rotation() * Vec3::Y);
                    for point in [middle, middle + end, middle - end] {
                        let out = point.x.abs().max(point.z.abs()) - half;
                        let below = Real::max(-point.y, point.y - 10.0);
                        assert!(out.max(below) < 0.015, "step {step}: {id:?} is at {point}");
                    }
                }
            }
        });
    }
}
