//! Random use of everything that touches arbiters: the world stays consistent, and every begin has its end.

use crate::common::Random;
use crate::support::*;
use arbiter3d::math::Vec3;
use arbiter3d::*;

/// Small whole numbers from a seed.
#[derive(Clone)]
struct Dice(Random);

impl Dice {
    fn roll(&mut self, sides: u64) -> u64 {
        self.0.bits() % sides
    }

    fn place(&mut self) -> Vec3 {
        let mut coordinate = |sides| self.roll(sides) as f32 * 0.3;
        Vec3::new(coordinate(12), 0.3 + coordinate(10), coordinate(8))
    }

    fn pick<T: Copy>(&mut self, list: &[T]) -> Option<T> {
        (!list.is_empty()).then(|| list[self.roll(list.len() as u64) as usize])
    }
}

/// One random call; errors are fine, panics and inconsistencies are not.
fn act(world: &mut World, dice: &mut Dice, keys: &std::ops::Range<u64>) {
    let bodies: Vec<BodyId> = world.bodies().collect();
    let arbiters: Vec<ArbiterId> = world.arbiters().map(Arbiter::id).collect();
    let (Some(body), Some(other)) = (dice.pick(&bodies), dice.pick(&bodies)) else { return };
    let shape = dice.pick(world.body(body).unwrap().shapes());
    let at = dice.place();
    match dice.roll(22) {
        0..=2 if bodies.len() < 30 => {
            let kinds = [BodyKind::Dynamic, BodyKind::Dynamic, BodyKind::Kinematic, BodyKind::Static];
            let kind = dice.pick(&kinds).unwrap();
            let new = world.add_body(&BodyDefinition { kind, ..BodyDefinition::dynamic().at(at) }).unwrap();
            world.add_shape(new, &ShapeDefinition::new(Shape::sphere(0.5).unwrap())).unwrap();
        }
        3 => drop(world.remove_body(body)),
        4 => {
            let cube = ShapeDefinition::new(Shape::cuboid(Vec3::splat(0.4)).unwrap()).at(at * 0.1);
            drop(world.add_shape(body, &cube));
        }
        5 => drop(shape.map(|shape| world.remove_shape(shape))),
        6 => drop(dice.pick(&arbiters).map(|id| world.remove_arbiter(id))),
        7..=10 => {
            let key = ArbiterKey::new(keys.start + dice.roll(6), keys.start + dice.roll(3));
            let contact = ContactPoint::new(at, at - Vec3::Y * 0.01, Vec3::Y);
            drop(world.register_contact_by_key(key, body, other, contact));
        }
        11 => {
            // A key of two live shapes, before or after the engine has made their arbiter.
            let second = dice.pick(world.body(other).unwrap().shapes());
            if let (Some(first), Some(second)) = (shape, second) {
                let key = ArbiterKey::of_shapes(first, second);
                let (b1, b2) = if first < second { (body, other) } else { (other, body) };
                drop(world.get_or_create_arbiter(key, b1, b2));
            }
        }
        12 => {
            let kind = dice.pick(&[BodyKind::Dynamic, BodyKind::Kinematic, BodyKind::Static]).unwrap();
            drop(world.body_mut(body).unwrap().set_kind(kind));
        }
        13 => drop(world.body_mut(body).unwrap().set_enabled(dice.roll(3) > 0)),
        14 => drop(world.body_mut(body).unwrap().set_position(at)),
        15 => world.body_mut(body).unwrap().sleep(),
        16 => drop(world.body_mut(body).unwrap().set_linear_velocity(at - Vec3::ONE)),
        17 => {
            let filter = Filter { mask: dice.roll(2), group: dice.roll(3) as i32 - 1, ..Filter::default() };
            let _ = shape.and_then(|shape| world.shape_mut(shape)).map(|mut shape| shape.set_filter(filter));
        }
        18 => {
            let sensor = dice.roll(2) == 0;
            let _ = shape.and_then(|shape| world.shape_mut(shape)).map(|mut shape| shape.set_sensor(sensor));
        }
        19 => {
            if let Some(arbiter) = dice.pick(&arbiters).and_then(|id| world.arbiter_mut(id)) {
                match dice.roll(3) {
                    0 => arbiter.data_mut().clear(),
                    1 => arbiter.data_mut().set_solve_mode(SolveMode::LINEAR),
                    _ => drop(arbiter.data_mut().set_normal(0, Vec3::X)),
                }
            }
        }
        20 if dice.roll(40) == 0 => world.clear(),
        _ => drop(world.step(DT).unwrap()),
    }
}

/// Listeners that remove and register at random.
fn add_meddlers(world: &mut World, seed: u64, keys: &std::ops::Range<u64>) {
    let meddle = |mut dice: Dice, start: u64| {
        move |context: &mut StepContext<'_>, b1: BodyId, b2: BodyId| match dice.roll(12) {
            0 => drop(context.remove_body(b1)),
            1 => drop(context.remove_body(b2)),
            2 => {
                let first = context.world().arbiters().map(Arbiter::id).min();
                let _ = first.map(|id| context.remove_arbiter(id));
            }
            3 | 4 => {
                let at = dice.place();
                let key = ArbiterKey::new(start + dice.roll(6), start + dice.roll(3));
                drop(context.register_contact_by_key(key, b1, b2, ContactPoint::new(at, at, Vec3::Z)));
            }
            5 => {
                let shape = context.body(b2).and_then(|body| body.shapes().first().copied());
                let _ = shape.map(|shape| context.remove_shape(shape));
            }
            _ => {}
        }
    };
    let mut at_begin = meddle(Dice(Random(seed ^ 1)), keys.start);
    world.on_begin_collide(Box::new(move |context, id| {
        let arbiter = context.arbiter(id).expect("alive while its begin is raised");
        let (b1, b2) = (arbiter.body1(), arbiter.body2());
        at_begin(context, b1, b2);
    }));
    let mut at_end = meddle(Dice(Random(seed ^ 2)), keys.start);
    world.on_end_collide(Box::new(move |context, event| at_end(context, event.body1, event.body2)));
}

/// Returns a hash of all states, and how many arbiters began.
fn run(seed: u64, threads: usize) -> (u64, usize) {
    let mut world = World::new(WorldSettings { threads, ..WorldSettings::default() }).unwrap();
    add_floor(&mut world);
    let keys = world.reserve_ids(100).unwrap();
    let heard: Log<(ArbiterId, bool)> = Log::default();
    let (begin, end) = (heard.clone(), heard.clone());
    world.on_begin_collide(Box::new(move |_, id| begin.push((id, true))));
    world.on_end_collide(Box::new(move |_, event| end.push((event.arbiter, false))));
    if !seed.is_multiple_of(3) {
        add_meddlers(&mut world, seed, &keys);
    }
    let mut dice = Dice(Random(seed));
    let mut hash = 0_u64;
    for call in 0..400 {
        act(&mut world, &mut dice, &keys);
        world.validate().unwrap_or_else(|broken| panic!("seed {seed}, call {call}: {broken}"));
        hash = hash.rotate_left(1) ^ world.hash();
    }
    world.clear();
    world.validate().unwrap();
    assert_eq!(world.body_count(), 0);
    let mut live = std::collections::HashSet::new();
    for (id, begins) in heard.all() {
        assert!(if begins { live.insert(id) } else { live.remove(&id) }, "seed {seed}: {id:?} out of turn");
    }
    // What listeners made while the world was cleared has not begun; all that had begun has ended.
    assert!(live.is_empty(), "seed {seed}: {} begins without end", live.len());
    (hash, heard.len() / 2)
}

#[test]
fn random_use_keeps_the_world_consistent_and_every_begin_has_its_end() {
    let mut begun = 0;
    for seed in 0..60 {
        let alone = run(seed, 1);
        begun += alone.1;
        if seed % 10 == 0 {
            assert_eq!(run(seed, 2), alone, "seed {seed} on two threads");
        }
    }
    assert!(begun > 1500, "{begun} arbiters began");
}
