//! Scenes in which everything is fast: what continuous collision is for.

use crate::builder::Builder;
use crate::{BuiltScene, SceneOptions};
use arbiter3d::{
    BodyDefinition, BodyId, CombineRule, Error, Material, Shape, ShapeDefinition, WorldSettings,
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
