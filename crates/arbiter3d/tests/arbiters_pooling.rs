//! A world in steady state allocates nothing while contacts come and go: every allocation of the process is counted.
//!
//! A binary of its own, since the counter sees all threads: one test, so that nothing else runs beside it.

#[path = "common/counting.rs"]
mod counting;

use arbiter3d::math::Vec3;
use arbiter3d::*;
use counting::allocations;

/// Carries bare bodies on points at height zero and takes the arbiters away again: custom arbiters that come and go.
#[derive(Default)]
struct Points {
    bodies: Vec<BodyId>,
    step: u64,
}

impl ContactProvider for Points {
    fn provide(&mut self, context: &mut StepContext<'_>) {
        self.step += 1;
        self.bodies.clear();
        self.bodies.extend(context.awake_bodies());
        for &id in &self.bodies {
            let body = context.body(id).unwrap();
            let position = body.position();
            if body.shapes().is_empty() && position.y < 0.02 {
                let key = ArbiterKey::new(u64::MAX, u64::from(id.index()));
                let ground = Vec3::new(position.x, 0.0, position.z);
                let contact = ContactPoint::new(ground, position, Vec3::Y);
                let arbiter = context.register_contact_by_key(key, BodyId::WORLD, id, contact).unwrap();
                context.arbiter_mut(arbiter).unwrap().data_mut().set_restitution(1.0).unwrap();
                if (self.step + u64::from(id.index())).is_multiple_of(31) {
                    context.remove_arbiter(arbiter).unwrap();
                }
            }
        }
    }
}

/// Bouncing balls, tumbling boxes and rolling capsules between walls, and bare bodies that a provider bounces.
///
/// With events, all shapes ask for all there are, and listeners hear of them.
fn restless(threads: usize, events: ContactEvents) -> World {
    let mut world = World::new(WorldSettings { threads, ..WorldSettings::default() }).unwrap();
    let floor = Shape::cuboid(Vec3::new(8.0, 1.0, 8.0)).unwrap();
    let bouncy = |shape: Shape| {
        ShapeDefinition::new(shape).restitution(1.0).friction(0.3).rolling_resistance(0.0).events(events)
    };
    world.add_shape(BodyId::WORLD, &bouncy(floor).at(Vec3::new(0.0, -1.0, 0.0))).unwrap();
    for (x, z) in [(9.0, 0.0), (-9.0, 0.0), (0.0, 9.0), (0.0, -9.0)] {
        let wall = Shape::cuboid(Vec3::new(if x == 0.0 { 10.0 } else { 1.0 }, 40.0, if z == 0.0 { 10.0 } else { 1.0 }));
        world.add_shape(BodyId::WORLD, &bouncy(wall.unwrap()).at(Vec3::new(x, 0.0, z))).unwrap();
    }
    for i in 0..90_u16 {
        // A dense block that bursts: there are never more contacts than in the beginning.
        let [x, y, z] = [i % 6, i / 36, i / 6 % 6].map(|n| f32::from(n) * 0.7);
        let position = Vec3::new(x - 2.0, 0.4 + y, z - 2.0);
        let shape = match i % 3 {
            0 => Shape::sphere(0.4),
            1 => Shape::capsule(0.3, 0.3),
            _ => Shape::cuboid(Vec3::splat(0.35)),
        };
        let moving = BodyDefinition {
            linear_velocity: Vec3::new(f32::from(i % 7) - 3.0, 0.0, f32::from(i % 5) - 2.0),
            ..BodyDefinition::dynamic().at(position)
        };
        let body = world.add_body(&moving).unwrap();
        world.add_shape(body, &bouncy(shape.unwrap())).unwrap();
    }
    for i in 0..20_u16 {
        let position = Vec3::new(100.0 + f32::from(i), 0.2 + 0.1 * f32::from(i), 0.0);
        world.add_body(&BodyDefinition { can_sleep: false, ..BodyDefinition::dynamic().at(position) }).unwrap();
    }
    world.add_contact_provider(Box::new(Points::default()));
    if events != ContactEvents::NONE {
        let gate = world.add_body(&BodyDefinition::fixed()).unwrap();
        world.add_shape(gate, &bouncy(Shape::cuboid(Vec3::splat(3.0)).unwrap()).sensor()).unwrap();
        world.on_hit(Box::new(|_, hit| assert!(hit.speed >= 1.0)));
        world.on_pre_solve(Box::new(|context, id| {
            context.arbiter_mut(id).unwrap().data_mut().set_friction(0.2).unwrap();
        }));
    }
    world
}

#[test]
fn a_world_in_steady_state_allocates_nothing_while_contacts_come_and_go() {
    for (threads, events) in
        [(1, ContactEvents::NONE), (2, ContactEvents::NONE), (1, ContactEvents::ALL), (2, ContactEvents::ALL)]
    {
        let mut world = restless(threads, events);
        for _ in 0..1200 {
            world.step(1.0 / 60.0).unwrap();
        }
        let (mut begins, mut ends, mut asked) = (0, 0, 0);
        let before = allocations();
        for _ in 0..400 {
            world.step(1.0 / 60.0).unwrap();
            begins += world.begin_events().len();
            asked += world.hit_events().len().min(world.persist_events().len());
            ends += world.drain_end_events().count();
        }
        let made = allocations() - before;
        assert!(begins > 300 && ends > 300, "contacts come and go: {begins} begins, {ends} ends");
        assert!(asked > 50 || events == ContactEvents::NONE, "{asked} steps with hits and contacts that go on");
        assert_eq!(made, 0, "allocations in 400 steps on {threads} threads, {events:?}");
    }
}
