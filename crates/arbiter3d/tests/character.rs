//! The character walks, climbs, slides, rides and pushes as its settings say.

mod common;

use arbiter3d::math::{Pose, Quat, Vec3};
use arbiter3d::{
    BodyDefinition, BodyId, CharacterController, CharacterSettings, Error, Shape, ShapeDefinition, ShapeMover, World,
};
use common::{DT, GRAVITY, add, assert_near, assert_relative, cuboid, position, sphere, turn, velocity};

const SKIN: f32 = 0.02;
const RADIUS: f32 = 0.35;

struct Walk {
    world: World,
    hero: CharacterController,
    /// Deepest overlap of the capsule with anything so far.
    deepest: f32,
}

impl Walk {
    fn new(world: World, at: Vec3) -> Self {
        Self { world, hero: CharacterController::new(at, CharacterSettings::default()).unwrap(), deepest: 0.0 }
    }

    fn on_floor(at: Vec3) -> Self {
        let mut world = World::default();
        floor(&mut world);
        Self::new(world, at)
    }

    fn step(&mut self, wanted: Vec3) {
        self.hero.update(&mut self.world, wanted, DT).unwrap();
        self.world.step(DT).unwrap();
        assert!(self.hero.position().is_finite());
        let settings = self.hero.settings();
        let capsule = Shape::capsule(0.5 * settings.height - settings.radius, settings.radius).unwrap();
        let pose = Pose::from_position(self.hero.center());
        for contacts in self.world.collide_shape(&capsule, &pose, 0.0, &settings.filter).unwrap() {
            for point in contacts.manifold.points() {
                self.deepest = self.deepest.max(-point.separation);
            }
        }
    }

    fn walk(&mut self, wanted: Vec3, seconds: f32) {
        for _ in 0..(seconds / DT).round() as usize {
            self.step(wanted);
        }
    }

    fn at(&self) -> Vec3 {
        self.hero.position()
    }
}

fn floor(world: &mut World) {
    common::floor(world, 0.5);
}

fn fixed(world: &mut World, shape: Shape, at: Vec3, rotation: Quat) {
    world.add_shape(BodyId::WORLD, &ShapeDefinition::new(shape).at(at).rotated(rotation)).unwrap();
}

fn block(world: &mut World, half: Vec3, at: Vec3) {
    fixed(world, Shape::cuboid(half).unwrap(), at, Quat::IDENTITY);
}

/// A ramp that starts at `foot` and rises towards +x for `length` metres along its face.
fn ramp(world: &mut World, foot: Vec3, degrees: f32, length: f32) {
    let tilt = turn(Vec3::Z, degrees);
    let middle = foot + tilt * Vec3::new(0.5 * length, -0.5, 0.0);
    fixed(world, cuboid(0.5 * length, 0.5, 5.0), middle, tilt);
}

/// On a level floor: at the wanted speed, at the wanted height, without any vertical motion, and it stops at once.
#[test]
fn walks_level_and_stops() {
    let mut walk = Walk::on_floor(Vec3::new(0.0, 0.5, 0.0));
    walk.walk(Vec3::ZERO, 1.0);
    assert!(walk.hero.is_on_ground());
    assert_near(walk.at().y, 0.0, 0.002, "height of the feet");
    let wanted = Vec3::new(3.0, 0.0, 4.0);
    walk.walk(wanted, 0.5);
    let start = walk.at();
    for _ in 0..120 {
        let before = walk.at().y;
        walk.step(wanted);
        assert!((walk.at().y - before).abs() < 1e-3 * DT, "vertical speed {}", (walk.at().y - before) / DT);
        assert!(walk.hero.velocity().y.abs() < 1e-3);
    }
    assert!((walk.at() - start - wanted * 2.0).length() < 0.01);
    walk.walk(Vec3::ZERO, 0.1);
    let stopped = walk.at();
    walk.walk(Vec3::ZERO, 5.0);
    assert_eq!(walk.at(), stopped);
    assert!(walk.deepest < SKIN);
}

/// A fall follows gravity, a jump reaches its height.
#[test]
fn falls_and_jumps_as_gravity_says() {
    let mut walk = Walk::on_floor(Vec3::new(0.0, 10.0, 0.0));
    walk.walk(Vec3::ZERO, 1.0);
    assert_near(walk.at().y, 10.0 - 0.5 * GRAVITY, 0.01, "height after a second");
    walk.walk(Vec3::ZERO, 2.0);
    assert!(walk.hero.is_on_ground());
    let ground = walk.at().y;
    let speed = walk.hero.jump_speed(1.2);
    assert!(walk.hero.jump(speed).unwrap());
    let mut top = 0.0_f32;
    for _ in 0..90 {
        walk.step(Vec3::X * 2.0);
        top = top.max(walk.at().y);
    }
    assert_near(top - ground, 1.2, 0.01, "height of the jump");
    assert!(walk.hero.is_on_ground() && walk.hero.velocity().y == 0.0);
    assert!(walk.deepest < SKIN);
}

/// Stairs of 0.25 × 0.3 m are climbed and descended at the full speed, without a jolt of more than a step.
#[test]
fn stairs_are_walked_up_and_down_without_a_stop() {
    for speed in [1.0, 3.0, 6.0] {
        let mut walk = Walk::on_floor(Vec3::new(-1.0, 0.0, 0.0));
        for i in 0..10 {
            let height = 0.25 * (i + 1) as f32;
            let half = Vec3::new(0.15, 0.5 * height, 3.0);
            block(&mut walk.world, half, Vec3::new(0.5 + 0.3 * i as f32, 0.5 * height, 0.0));
            block(&mut walk.world, half, Vec3::new(9.2 - 0.3 * i as f32, 0.5 * height, 0.0));
        }
        block(&mut walk.world, Vec3::new(1.6, 1.25, 3.0), Vec3::new(4.85, 1.25, 0.0));
        walk.walk(Vec3::ZERO, 0.2);
        let mut before = walk.at();
        let mut top = 0.0_f32;
        let mut steps = 0;
        while walk.at().x < 11.0 {
            walk.step(Vec3::X * speed);
            steps += 1;
            let moved = walk.at() - before;
            assert!(steps < 10 || moved.x > 0.5 * speed * DT, "stalls at {} with {} m/s", walk.at(), moved.x / DT);
            assert!(moved.y.abs() < 0.26, "jolts at {}", walk.at());
            assert!(walk.hero.is_on_ground(), "loses the ground at {}", walk.at());
            (before, top) = (walk.at(), top.max(walk.at().y));
        }
        assert_near(top, 2.5, 0.005, "height of the landing");
        assert_near(walk.at().y, 0.0, 0.005, "height of the floor");
        assert!((steps as f32 * DT) < 1.1 * 12.0 / speed + 0.2, "took {} s", steps as f32 * DT);
        assert!(walk.deepest < SKIN, "{}", walk.deepest);
    }
}

/// Steps higher than allowed are walls.
#[test]
fn high_steps_are_walls() {
    let mut walk = Walk::on_floor(Vec3::ZERO);
    block(&mut walk.world, Vec3::new(1.0, 0.22, 3.0), Vec3::new(2.0, 0.22, 0.0));
    walk.walk(Vec3::X * 3.0, 2.0);
    assert_near(walk.at().x, 1.0 - RADIUS, 0.05, "stopped before the step");
    assert_near(walk.at().y, 0.0, 0.002, "height");
}

/// A slope of 45° is walked at full speed; on one of 60° nothing helps, and put on it one slides down.
#[test]
fn slopes_are_walked_or_slid_down() {
    let mut walk = Walk::on_floor(Vec3::new(-1.0, 0.0, 0.0));
    ramp(&mut walk.world, Vec3::ZERO, 45.0, 10.0);
    walk.walk(Vec3::X * 3.0, 1.0);
    let start = walk.at();
    walk.walk(Vec3::X * 3.0, 1.0);
    let way = walk.at() - start;
    assert_relative(way.length(), 3.0, 0.01, "speed up the slope");
    assert_relative(way.y, way.x, 0.01, "slope");
    walk.walk(Vec3::ZERO, 0.2);
    let stands = walk.at();
    walk.walk(Vec3::ZERO, 5.0);
    assert!((walk.at() - stands).length() < 1e-4, "creeps on the slope");
    walk.walk(Vec3::X * -3.0, 1.0);
    assert!(walk.hero.is_on_ground());
    assert!(walk.deepest < SKIN, "{}", walk.deepest);

    let mut walk = Walk::on_floor(Vec3::new(-1.0, 0.0, 0.0));
    ramp(&mut walk.world, Vec3::ZERO, 60.0, 10.0);
    for _ in 0..180 {
        walk.step(Vec3::X * 4.0);
        assert!(walk.at().y < 0.05, "climbs to {}", walk.at());
    }
    walk.hero.set_position(Vec3::new(3.0, 5.4, 0.0)).unwrap();
    walk.walk(Vec3::X * 4.0, 0.6);
    let (height, speed) = (walk.at().y, -walk.hero.velocity().y);
    assert!(!walk.hero.is_on_ground() && height < 5.0 && speed > 1.0, "{height} {speed}");
    walk.walk(Vec3::ZERO, 2.0);
    assert_near(walk.at().y, 0.0, 0.01, "height after the slide");
    assert!(walk.deepest < SKIN, "{}", walk.deepest);
}

/// Sliding down 60° without a push accelerates with g sin 60°.
#[test]
fn steep_slopes_are_free_of_friction() {
    let mut walk = Walk::new(World::default(), Vec3::ZERO);
    ramp(&mut walk.world, Vec3::new(-50.0, -86.6, 0.0), 60.0, 200.0);
    walk.hero.set_position(Vec3::new(0.0, 0.45, 0.0)).unwrap();
    walk.walk(Vec3::ZERO, 0.5);
    let before = walk.hero.velocity();
    walk.walk(Vec3::ZERO, 1.0);
    let gained = (walk.hero.velocity() - before).length();
    assert_relative(gained, GRAVITY * 0.866_025, 0.02, "speed gained in a second");
}

/// Walls at a slant are slid along, and what is left is the part along them.
#[test]
fn walls_are_slid_along() {
    let mut walk = Walk::on_floor(Vec3::ZERO);
    fixed(&mut walk.world, cuboid(0.5, 2.0, 20.0), Vec3::new(3.0, 2.0, 0.0), turn(Vec3::Y, 20.0));
    walk.walk(Vec3::X * 4.0, 1.5);
    let start = walk.at();
    walk.walk(Vec3::X * 4.0, 1.0);
    let slid = walk.at() - start;
    // A wall turned by 20° lets the share sin 20° of the speed along it.
    assert_relative(slid.length(), 4.0 * 0.342_02, 0.02, "speed along the wall");
    assert!(walk.deepest < SKIN);
}

/// Between two walls that close at 30° it comes to rest, does not tremble, and gets out again.
#[test]
fn acute_corners_neither_hold_nor_shake() {
    let mut walk = Walk::on_floor(Vec3::ZERO);
    for (side, degrees) in [(1.0, 15.0), (-1.0, -15.0)] {
        let rotation = turn(Vec3::Y, degrees);
        // Both inner faces meet in a line at x = 6.
        let middle = Vec3::new(6.0, 2.0, 0.0) + rotation * Vec3::new(-3.0, 0.0, 0.5 * side);
        fixed(&mut walk.world, cuboid(4.0, 2.0, 0.5), middle, rotation);
    }
    walk.walk(Vec3::new(4.0, 0.0, 0.3), 3.0);
    let rests = walk.at();
    // The circle of 0.35 m between walls at 15° to the axis: 0.35 / sin 15° before the corner.
    assert_near(rests.x, 6.0 - RADIUS / 0.258_819, 0.03, "place in the corner");
    for _ in 0..60 {
        walk.step(Vec3::new(4.0, 0.0, -0.3));
        assert!((walk.at() - rests).length() < 2e-3, "shakes by {}", (walk.at() - rests).length());
    }
    walk.walk(Vec3::X * -4.0, 1.0);
    assert!(walk.at().x < rests.x - 3.5, "is held at {}", walk.at());
    assert!(walk.deepest < SKIN);
}

/// A gap narrower than the capsule stops it; a wider one lets it through.
#[test]
fn gaps_let_through_what_fits() {
    for (gap, passes) in [(0.66, false), (0.76, true)] {
        let mut walk = Walk::on_floor(Vec3::ZERO);
        for side in [1.0, -1.0] {
            block(&mut walk.world, Vec3::new(0.5, 2.0, 2.0), Vec3::new(3.0, 2.0, side * (2.0 + 0.5 * gap)));
        }
        walk.walk(Vec3::X * 3.0, 3.0);
        assert_eq!(walk.at().x > 4.0, passes, "gap of {gap}: {}", walk.at());
        assert!(walk.deepest < SKIN);
    }
}

/// A groove too steep to walk on holds it between its sides: it stands, and can jump out.
#[test]
fn grooves_hold_like_a_floor() {
    let mut walk = Walk::new(World::default(), Vec3::new(0.0, 1.0, 0.0));
    for side in [60.0, -60.0] {
        let tilt = turn(Vec3::Z, side);
        let along = if side > 0.0 { Vec3::new(2.0, -0.5, 0.0) } else { Vec3::new(-2.0, -0.5, 0.0) };
        fixed(&mut walk.world, cuboid(2.0, 0.5, 5.0), tilt * along, tilt);
    }
    walk.walk(Vec3::ZERO, 2.0);
    assert!(walk.hero.is_on_ground(), "falls at {}", walk.at());
    let stands = walk.at();
    walk.walk(Vec3::ZERO, 1.0);
    assert!((walk.at() - stands).length() < 1e-3);
    let speed = walk.hero.jump_speed(1.0);
    assert!(walk.hero.jump(speed).unwrap());
    walk.walk(Vec3::ZERO, 0.3);
    assert!(walk.at().y > stands.y + 0.5);
    walk.walk(Vec3::Z * 3.0, 1.5);
    assert!(walk.at().z > 1.5, "is held at {}", walk.at());
    assert!(walk.deepest < SKIN);
}

/// It neither enters what is too low for it nor steps up into it.
#[test]
fn low_ceilings_stop_it() {
    let mut walk = Walk::on_floor(Vec3::ZERO);
    // A tunnel of 1.6 m, and behind it a step under a ceiling of 2 m: on the step only 1.7 m are left.
    block(&mut walk.world, Vec3::new(1.0, 0.5, 3.0), Vec3::new(3.0, 2.1, 0.0));
    walk.walk(Vec3::X * 3.0, 2.0);
    assert_near(walk.at().x, 2.0 - RADIUS, 0.05, "before the tunnel");
    block(&mut walk.world, Vec3::new(2.0, 0.15, 3.0), Vec3::new(3.0, 0.15, 20.0));
    block(&mut walk.world, Vec3::new(3.0, 0.5, 3.0), Vec3::new(3.0, 2.5, 20.0));
    walk.hero.set_position(Vec3::new(0.0, 0.0, 20.0)).unwrap();
    walk.walk(Vec3::X * 3.0, 2.0);
    assert_near(walk.at().x, 1.0 - RADIUS, 0.05, "before the step");
    assert_near(walk.at().y, 0.0, 0.002, "height");
    assert!(walk.deepest < SKIN);
    // A jump under a ceiling ends at it.
    walk.walk(Vec3::ZERO, 0.1);
    assert!(walk.hero.jump(8.0).unwrap());
    walk.walk(Vec3::ZERO, 0.2);
    assert!(walk.at().y < 0.21 && walk.hero.velocity().y < 0.0);
}

/// A platform that bodies pass upwards: the character jumps up through it at the full height, lands and walks on it, falls off
/// its end, and walks below it without knocking its head. An ordinary one stops the head.
#[test]
fn one_way_platforms_are_jumped_through() {
    let mut walk = Walk::on_floor(Vec3::ZERO);
    let platform = ShapeDefinition::new(cuboid(2.0, 0.1, 2.0)).at(Vec3::new(0.0, 1.9, 0.0));
    walk.world.add_shape(BodyId::WORLD, &platform.one_way(Vec3::Y)).unwrap();
    walk.walk(Vec3::ZERO, 0.1);
    assert_near(walk.at().y, 0.0, 0.002, "on the floor, the head in the platform's way");
    let speed = walk.hero.jump_speed(2.4);
    assert!(walk.hero.jump(speed).unwrap());
    let mut top = 0.0_f32;
    for _ in 0..120 {
        walk.step(Vec3::ZERO);
        top = top.max(walk.at().y);
    }
    assert_near(top, 2.4, 0.02, "height of the jump");
    assert!(walk.hero.is_on_ground());
    assert_near(walk.at().y, 2.0, 0.002, "on the platform");
    walk.walk(Vec3::X * 2.0, 0.5);
    assert_near(walk.at().x, 1.0, 0.1, "walks on it");
    assert_near(walk.at().y, 2.0, 0.002, "stays on it");
    walk.walk(Vec3::X * 3.0, 2.0);
    assert_near(walk.at().y, 0.0, 0.002, "down beside it");
    walk.walk(Vec3::X * -3.0, 3.0);
    assert!(walk.at().x < 0.0, "back below it");
    assert_near(walk.at().y, 0.0, 0.002, "on the floor again");
}

/// A lift carries it up and down at its own speed; a platform that turns takes it round on a circle.
#[test]
fn platforms_carry_it() {
    let mut world = World::default();
    let lift = BodyDefinition::kinematic().moving(Vec3::new(0.3, 1.5, 0.0), Vec3::ZERO);
    let lift = add(&mut world, &lift, &ShapeDefinition::new(cuboid(2.0, 0.25, 2.0)));
    let mut walk = Walk::new(world, Vec3::new(0.0, 0.3, 0.0));
    walk.walk(Vec3::ZERO, 1.0);
    let seat = walk.at() - position(&walk.world, lift);
    for up in [true, false] {
        let motion = if up { Vec3::new(0.3, 1.5, 0.0) } else { Vec3::new(-0.2, -3.0, 0.4) };
        walk.world.body_mut(lift).unwrap().set_linear_velocity(motion).unwrap();
        for _ in 0..120 {
            walk.step(Vec3::ZERO);
            assert!(walk.hero.is_on_ground());
            let drift = walk.at() - position(&walk.world, lift) - seat;
            assert!(drift.length() < 2e-3, "drifts by {drift}");
        }
        assert!((walk.hero.velocity() - motion).length() < 1e-3);
    }

    let mut world = World::default();
    let disc = BodyDefinition::kinematic().moving(Vec3::ZERO, Vec3::new(0.0, 0.8, 0.0));
    add(&mut world, &disc, &ShapeDefinition::new(cuboid(5.0, 0.5, 5.0)));
    let mut walk = Walk::new(world, Vec3::new(3.0, 0.5, 0.0));
    walk.walk(Vec3::ZERO, 0.5);
    let start = walk.at();
    for step in 1..=600 {
        walk.step(Vec3::ZERO);
        let round = turn(Vec3::Y, (0.8 * DT * step as f32).to_degrees()) * start;
        assert!((walk.at() - round).length() < 0.01, "step {step}: {} instead of {round}", walk.at());
    }
    assert!(walk.deepest < SKIN);
}

/// Jumping off a moving platform it keeps the platform's speed.
#[test]
fn jumps_keep_the_speed_of_the_platform() {
    let mut world = World::default();
    let sled = BodyDefinition::kinematic().moving(Vec3::new(3.0, 0.0, 0.0), Vec3::ZERO);
    add(&mut world, &sled, &ShapeDefinition::new(cuboid(20.0, 0.5, 2.0)));
    let mut walk = Walk::new(world, Vec3::new(0.0, 0.5, 0.0));
    walk.walk(Vec3::ZERO, 0.5);
    assert!(walk.hero.jump(4.0).unwrap());
    walk.walk(Vec3::ZERO, 0.3);
    assert!((walk.hero.velocity().x - 3.0).abs() < 1e-3 && !walk.hero.is_on_ground());
    let x = walk.at().x;
    walk.walk(Vec3::ZERO, 1.0);
    assert_near(walk.at().x - x, 3.0, 0.02, "way with the sled");
}

/// A crate of 40 kg is pushed along, one of 4 t is a wall, and neither is entered.
#[test]
fn crates_are_pushed_by_their_mass() {
    for (density, pushed) in [(40.0, true), (4000.0, false)] {
        let mut walk = Walk::on_floor(Vec3::ZERO);
        let at = BodyDefinition::dynamic().at(Vec3::new(2.0, 0.5, 0.0));
        let body = add(&mut walk.world, &at, &ShapeDefinition::new(cuboid(0.5, 0.5, 0.5)).density(density));
        walk.walk(Vec3::X * 2.0, 4.0);
        let way = position(&walk.world, body).x - 2.0;
        assert!(if pushed { way > 3.0 } else { way < 0.01 }, "{density}: pushed by {way}");
        assert!(walk.at().x < position(&walk.world, body).x - 0.5 - RADIUS + SKIN);
        assert!(walk.deepest < SKIN, "{}", walk.deepest);
    }
}

/// It presses on a raft with its weight: the board it stands on tips.
#[test]
fn its_weight_presses_on_what_is_below() {
    let mut walk = Walk::on_floor(Vec3::new(1.5, 1.2, 0.0));
    block(&mut walk.world, Vec3::new(0.1, 0.3, 1.0), Vec3::new(0.0, 0.3, 0.0));
    let at = BodyDefinition::dynamic().at(Vec3::new(0.0, 0.65, 0.0));
    let board = add(&mut walk.world, &at, &ShapeDefinition::new(cuboid(2.0, 0.05, 0.5)).density(200.0));
    walk.walk(Vec3::ZERO, 2.0);
    let tip = walk.world.body(board).unwrap().rotation() * Vec3::X;
    assert!(tip.y < -0.2, "the board's end is at {tip}");
}

/// A wall that comes closer pushes it away; two that close on it crush it, and it says so.
#[test]
fn moving_walls_push_and_crush() {
    let mut walk = Walk::on_floor(Vec3::ZERO);
    let wall = BodyDefinition::kinematic().at(Vec3::new(-2.0, 1.0, 0.0)).moving(Vec3::X * 2.0, Vec3::ZERO);
    let wall = add(&mut walk.world, &wall, &ShapeDefinition::new(cuboid(0.5, 1.0, 2.0)));
    walk.walk(Vec3::ZERO, 3.0);
    let gap = walk.at().x - position(&walk.world, wall).x - 0.5;
    assert!(gap > RADIUS - 0.05 && gap < RADIUS + 0.02, "{gap}");
    assert!(!walk.hero.is_crushed());
    block(&mut walk.world, Vec3::new(0.5, 1.0, 2.0), Vec3::new(6.0, 1.0, 0.0));
    let mut crushed = false;
    for _ in 0..40 {
        walk.step(Vec3::ZERO);
        crushed |= walk.hero.is_crushed();
    }
    assert!(crushed || walk.at().z.abs() > 1.0, "{}", walk.at());
}

/// A floor of many triangles is as smooth as one.
#[test]
fn mesh_floors_have_no_seams() {
    let mut world = World::default();
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for i in 0..=40 {
        for j in 0..=40 {
            vertices.push(Vec3::new(0.5 * i as f32 - 10.0, 0.0, 0.5 * j as f32 - 10.0));
        }
    }
    for i in 0..40_u32 {
        for j in 0..40 {
            let (a, b) = (i * 41 + j, (i + 1) * 41 + j);
            triangles.push([a, a + 1, b]);
            triangles.push([b, a + 1, b + 1]);
        }
    }
    fixed(&mut world, Shape::mesh(vertices, triangles).unwrap(), Vec3::ZERO, Quat::IDENTITY);
    let mut walk = Walk::new(world, Vec3::new(-8.0, 0.01, -7.3));
    walk.walk(Vec3::ZERO, 0.5);
    for heading in [0.0, 37.0, 90.0, 45.0] {
        let wanted = common::heading(heading) * 4.0;
        walk.walk(wanted, 0.2);
        for _ in 0..48 {
            let before = walk.at();
            walk.step(wanted);
            let moved = walk.at() - before;
            assert!((moved - wanted * DT).length() < 0.01 * DT, "{heading}°: {} m/s", moved / DT);
        }
    }
    assert!(walk.deepest < SKIN);
}

/// Off a ledge it falls; at the edge it neither hangs nor floats.
#[test]
fn ledges_end_where_they_end() {
    let mut walk = Walk::on_floor(Vec3::new(-3.0, 3.0, 0.0));
    block(&mut walk.world, Vec3::new(2.0, 1.5, 2.0), Vec3::new(-3.0, 1.5, 0.0));
    let mut left = None;
    for _ in 0..240 {
        walk.step(Vec3::X * 2.0);
        if left.is_none() && !walk.hero.is_on_ground() {
            left = Some(walk.at().x);
        }
    }
    let left = left.unwrap();
    assert!(left > -1.0 && left < -1.0 + RADIUS + 0.05, "leaves the ledge at {left}");
    assert_near(walk.at().y, 0.0, 0.002, "height below");
    assert!(walk.deepest < SKIN);
}

/// Up may be any direction: a character on the inside of a turned world.
#[test]
fn up_is_a_matter_of_choice() {
    let mut world = World::default();
    block(&mut world, Vec3::new(1.0, 50.0, 50.0), Vec3::new(-1.0, 0.0, 0.0));
    for i in 0..4 {
        let height = 0.25 * (i + 1) as f32;
        block(&mut world, Vec3::new(0.5 * height, 0.15, 3.0), Vec3::new(0.5 * height, 1.0 + 0.3 * i as f32, 0.0));
    }
    let settings = CharacterSettings { up: Vec3::X, ..CharacterSettings::default() };
    let mut hero = CharacterController::new(Vec3::new(0.5, 0.0, 0.0), settings).unwrap();
    for _ in 0..60 {
        hero.update(&mut world, Vec3::ZERO, DT).unwrap();
    }
    assert!(hero.is_on_ground());
    for _ in 0..40 {
        hero.update(&mut world, Vec3::Y * 3.0, DT).unwrap();
    }
    assert_near(hero.position().x, 1.0, 0.01, "height on the stairs");
    assert!(hero.position().y > 1.7, "{}", hero.position());
}

/// The parts alone: planes, slide, recovery.
#[test]
fn the_parts_stand_for_themselves() {
    let mut world = World::default();
    floor(&mut world);
    let ball = sphere(0.5);
    let mover = ShapeMover::new(&ball);
    let mut planes = Vec::new();
    mover.collect_planes(&world, Vec3::Y * 0.51, 0.05, &mut planes).unwrap();
    assert!(planes.len() == 1 && planes[0].normal == Vec3::Y && (planes[0].separation - 0.01).abs() < 1e-5);
    let (push, free) = mover.recover(&world, Vec3::Y * 0.3).unwrap();
    assert!(free && (push - Vec3::Y * 0.22).length() < 1e-4, "{push}");
    let slide = mover.slide(&world, Vec3::Y, Vec3::new(1.0, -2.0, 0.0)).unwrap();
    assert!(slide.blocked && (slide.position - Vec3::new(1.0, 0.52, 0.0)).length() < 1e-3, "{slide:?}");
    let ground = mover.probe_ground(&world, Vec3::Y, 1.0).unwrap().unwrap();
    assert!(ground.walkable && (ground.distance - 0.48).abs() < 1e-3 && ground.body == BodyId::WORLD);
    assert!(mover.probe_ground(&world, Vec3::Y * 3.0, 1.0).unwrap().is_none());
}

#[test]
fn bad_numbers_are_refused() {
    let with = |settings: CharacterSettings| CharacterController::new(Vec3::ZERO, settings).err();
    let flat = CharacterSettings { height: 0.6, ..CharacterSettings::default() };
    assert!(matches!(with(flat), Some(Error::OutOfRange { what: "character height", .. })));
    let up = CharacterSettings { up: Vec3::splat(1.0), ..CharacterSettings::default() };
    assert!(matches!(with(up), Some(Error::NotUnit { .. })));
    let mut world = World::default();
    let mut hero = CharacterController::new(Vec3::ZERO, CharacterSettings::default()).unwrap();
    assert!(hero.update(&mut world, Vec3::NAN, DT).is_err() && hero.update(&mut world, Vec3::ZERO, 2.0).is_err());
    assert!(hero.set_position(Vec3::NAN).is_err() && hero.jump(f32::INFINITY).is_err());
    hero.update(&mut world, Vec3::ZERO, DT).unwrap();
    assert!(velocity(&world, BodyId::WORLD) == Vec3::ZERO && !hero.is_on_ground());
}

/// Among 300 random boxes, ramps and balls, walking about and jumping: nothing is entered deeper than the skin, and it
/// never stays caught for good.
#[test]
fn clutter_is_neither_entered_nor_a_trap() {
    let mut random = common::Random(5);
    let mut walk = Walk::on_floor(Vec3::ZERO);
    for _ in 0..300 {
        let at = Vec3::new(random.range(-15.0, 15.0), random.range(-0.3, 1.5), random.range(-15.0, 15.0));
        if at.x.hypot(at.z) < 2.0 {
            continue;
        }
        let (shape, rotation) = (random.shape(), random.rotation());
        fixed(&mut walk.world, shape, at, rotation);
    }
    let mut covered = 0.0;
    for round in 0..150 {
        let wanted = common::heading(random.range(0.0, 360.0)) * random.range(1.0, 6.0);
        if round % 3 == 0 {
            let speed = walk.hero.jump_speed(1.0);
            walk.hero.jump(speed).unwrap();
        }
        let start = walk.at();
        for _ in 0..60 {
            let home = -walk.at() * 0.02;
            let before = walk.at();
            walk.step(wanted + home);
            let moved = (walk.at() - before).length();
            assert!(moved < 0.45 + 10.0 * DT, "round {round}: leaps by {moved} m to {}", walk.at());
        }
        covered += (walk.at() - start).length();
        assert!(walk.deepest < SKIN, "round {round}: {} m deep at {}", walk.deepest, walk.at());
    }
    assert!(covered > 150.0, "only {covered} m");
}

/// Triangles of a rectangle of `cells` × `cells` from a corner along two edges; they face along `u × v`.
fn rectangle(mesh: &mut (Vec<Vec3>, Vec<[u32; 3]>), corner: Vec3, [u, v]: [Vec3; 2], cells: u32) {
    let first = mesh.0.len() as u32;
    for i in 0..=cells {
        for j in 0..=cells {
            mesh.0.push(corner + (u * i as f32 + v * j as f32) / cells as f32);
        }
    }
    for i in 0..cells {
        for j in 0..cells {
            let (a, b) = (first + i * (cells + 1) + j, first + (i + 1) * (cells + 1) + j);
            mesh.1.extend([[a, b, a + 1], [b, b + 1, a + 1]]);
        }
    }
}

/// A room and its stairs in one mesh: walls and corners stop it, it slides along them, and the stairs are climbed.
#[test]
fn whole_rooms_may_be_one_mesh() {
    let mut mesh = (Vec::new(), Vec::new());
    let (x, y, z) = (Vec3::X, Vec3::Y, Vec3::Z);
    let low = Vec3::new(-4.0, 0.0, -4.0);
    rectangle(&mut mesh, low, [z * 8.0, x * 8.0], 11); // floor
    rectangle(&mut mesh, low, [y * 3.0, z * 8.0], 5);
    rectangle(&mut mesh, low, [x * 8.0, y * 3.0], 5);
    rectangle(&mut mesh, -low + y * 0.0, [x * -8.0, y * 3.0], 5);
    rectangle(&mut mesh, -low, [y * 3.0, z * -8.0], 5);
    for step in 0..4 {
        // Stairs of 1 m width and 0.3 m depth along the middle.
        let (height, at) = (0.25 * step as f32, 0.3 * step as f32);
        rectangle(&mut mesh, Vec3::new(at, height, -0.5), [z, y * 0.25], 2);
        rectangle(&mut mesh, Vec3::new(at, height + 0.25, -0.5), [z, x * if step == 3 { 1.0 } else { 0.3 }], 2);
    }
    let mut world = World::default();
    fixed(&mut world, Shape::mesh(mesh.0, mesh.1).unwrap(), Vec3::ZERO, Quat::IDENTITY);
    let mut walk = Walk::new(world, Vec3::new(-2.0, 0.05, -2.0));
    walk.walk(Vec3::ZERO, 0.3);
    let edge = 4.0 - RADIUS;
    // Into a corner, along the wall to the next, and so round.
    for (way, corner) in [((-1.0, -0.7), (-1.0, -1.0)), ((-0.5, 1.0), (-1.0, 1.0)), ((1.0, 0.5), (1.0, 1.0))] {
        for _ in 0..300 {
            walk.step(Vec3::new(way.0, 0.0, way.1) * 3.0);
            assert!(walk.deepest < SKIN, "{} m deep at {}", walk.deepest, walk.at());
            assert!(walk.at().y.abs() < 0.005, "leaves the floor at {}", walk.at());
        }
        let expected = Vec3::new(corner.0 * edge, 0.0, corner.1 * edge);
        assert!((walk.at() - expected).length() < 0.01, "{} instead of {expected}", walk.at());
    }
    walk.hero.set_position(Vec3::new(-1.5, 0.0, 0.0)).unwrap();
    walk.walk(Vec3::X * 3.0, 1.15);
    assert_near(walk.at().y, 1.0, 0.005, "height on the stairs");
    assert!(walk.hero.is_on_ground() && walk.deepest < SKIN, "{} m deep at {}", walk.deepest, walk.at());
}
