//! The cache rules and the breaking of contacts, through registered contacts.

use crate::common::Random;
use crate::support::*;
use arbiter3d::math::{Quat, Vec3};
use arbiter3d::narrow_phase::{Manifold, PairCache, collide};
use arbiter3d::*;

const KEY: ArbiterKey = ArbiterKey::new(1, 2);

fn bare_world() -> (World, BodyId, ArbiterId) {
    let mut world = weightless();
    let body = add_bare(&mut world, Vec3::ZERO);
    let id = world.get_or_create_arbiter(KEY, BodyId::WORLD, body).unwrap();
    (world, body, id)
}

fn put(world: &mut World, id: ArbiterId, point: Vec3, separation: f32) {
    world.register_contact(id, ContactPoint::new(point, point + Vec3::Y * separation, Vec3::Y)).unwrap();
}

/// Point on body 1 of each slot.
fn slots(world: &World, id: ArbiterId) -> Vec<(usize, Vec3)> {
    world.contact_points(world.arbiter_by_id(id).unwrap()).map(|(slot, point, _)| (slot, point)).collect()
}

const RING: [Vec3; 4] =
    [Vec3::new(1.0, 0.0, 1.0), Vec3::new(1.0, 0.0, -1.0), Vec3::new(-1.0, 0.0, -1.0), Vec3::new(-1.0, 0.0, 1.0)];

/// A slot is free: within the break distance of a contact the new point takes that contact's place, beyond it the lowest
/// free slot.
#[test]
fn a_near_point_replaces_and_a_far_one_takes_the_lowest_free_slot() {
    let (mut world, _, id) = bare_world();
    put(&mut world, id, Vec3::ZERO, 0.0);
    put(&mut world, id, Vec3::new(0.019, 0.0, 0.0), 0.0);
    assert_eq!(slots(&world, id), [(0, Vec3::new(0.019, 0.0, 0.0))]);
    put(&mut world, id, Vec3::new(0.040, 0.0, 0.0), 0.0);
    assert_eq!(slots(&world, id).len(), 2, "21 mm off is another contact");
    // Of two contacts that are near enough, the nearer one is replaced.
    put(&mut world, id, Vec3::new(0.031, 0.0, 0.0), 0.0);
    assert_eq!(slots(&world, id), [(0, Vec3::new(0.019, 0.0, 0.0)), (1, Vec3::new(0.031, 0.0, 0.0))]);
    put(&mut world, id, Vec3::X, 0.0);
    world.arbiter_mut(id).unwrap().data_mut().remove_contact(0).unwrap();
    put(&mut world, id, Vec3::Z, 0.0);
    assert_eq!(slots(&world, id)[0], (0, Vec3::Z), "the lowest free slot");
}

/// The break distance is a setting and scales with the world's unit of length.
#[test]
fn the_break_distance_follows_the_settings() {
    for (distance, unit, reach) in [(0.1, 1.0, 0.1), (0.02, 100.0, 2.0)] {
        let settings =
            WorldSettings { contact_break_distance: distance, length_unit: unit, ..WorldSettings::default() };
        let mut world = World::new(settings).unwrap();
        let body = add_bare(&mut world, Vec3::ZERO);
        let id = world.get_or_create_arbiter(KEY, BodyId::WORLD, body).unwrap();
        put(&mut world, id, Vec3::ZERO, 0.0);
        put(&mut world, id, Vec3::new(0.95 * reach, 0.0, 0.0), 0.0);
        assert_eq!(slots(&world, id).len(), 1);
        put(&mut world, id, Vec3::new(0.95 * reach, 0.0, 1.05 * reach), 0.0);
        assert_eq!(slots(&world, id).len(), 2);
    }
}

/// A body pressed on a point of the world by gravity and sliding along it: impulses along both directions.
fn loaded() -> (World, ArbiterId, Contact) {
    let mut world = World::default();
    let body = add_bare(&mut world, Vec3::ZERO);
    world.body_mut(body).unwrap().set_linear_velocity(Vec3::new(3.0, 0.0, 1.0)).unwrap();
    world.body_mut(body).unwrap().set_locked_axes(LockedAxes::ROTATION);
    let point = ContactPoint::new(Vec3::ZERO, Vec3::ZERO, Vec3::Y);
    let id = world.register_contact_by_key(KEY, BodyId::WORLD, body, point).unwrap();
    world.step(5e-3).unwrap();
    let contact = *world.arbiter_by_id(id).unwrap().data().contact(0).unwrap();
    assert!(contact.normal_impulse() > 1e-3 && contact.tangent_impulse().length() > 1e-4, "{contact:?}");
    (world, id, contact)
}

/// The replacing point inherits the impulses, the tangential one turned into its own plane, and brings its own normal.
#[test]
fn a_near_point_inherits_the_impulses_and_refreshes_the_normal() {
    let (mut world, id, old) = loaded();
    let normal = Vec3::new(0.6, 0.8, 0.0);
    let at = world.contact_points(world.arbiter_by_id(id).unwrap()).next().unwrap().1;
    world.register_contact(id, ContactPoint::new(at, at, normal)).unwrap();
    let data = world.arbiter_by_id(id).unwrap().data();
    let new = data.contact(0).unwrap();
    assert_eq!(data.contact_count(), 1);
    assert_close(new.normal(), normal, 1e-6);
    assert_eq!(new.normal_impulse(), old.normal_impulse());
    let turned = old.tangent_impulse() - normal * normal.dot(old.tangent_impulse());
    assert_close(new.tangent_impulse(), turned, 1e-6);
    assert!(turned.length() > 1e-4);
}

#[test]
fn a_far_point_starts_without_impulses() {
    let (mut world, id, _) = loaded();
    put(&mut world, id, Vec3::new(0.5, 0.0, 0.0), 0.0);
    let new = *world.arbiter_by_id(id).unwrap().data().contact(1).unwrap();
    assert_eq!((new.normal_impulse(), new.tangent_impulse()), (0.0, Vec3::ZERO));
}

/// All slots full: the candidate whose removal leaves the largest quadrilateral goes, for each of the four.
#[test]
fn a_full_cache_gives_up_the_candidate_that_leaves_the_largest_area() {
    for (slot, corner) in RING.into_iter().enumerate() {
        let (mut world, _, id) = bare_world();
        for point in RING {
            put(&mut world, id, point, 0.0);
        }
        let far = corner * 3.0;
        put(&mut world, id, far, 0.0);
        for (other, point) in slots(&world, id) {
            assert_eq!(point, if other == slot { far } else { RING[other] });
        }
    }
}

/// The same by brute force: whatever five points come, what is kept is as wide as the best four with the new one.
#[test]
fn the_kept_patch_is_the_widest_there_is() {
    let area = |p: [Vec3; 4]| {
        let pairs = [(p[0] - p[1], p[2] - p[3]), (p[0] - p[2], p[1] - p[3]), (p[0] - p[3], p[1] - p[2])];
        pairs.iter().map(|(a, b)| a.cross(*b).length()).fold(0.0_f32, f32::max)
    };
    let mut random = Random(1);
    for round in 0..300 {
        let (mut world, _, id) = bare_world();
        let points: [Vec3; 5] = std::array::from_fn(|_| random.vector(1.0) * Vec3::new(1.0, 0.0, 1.0));
        let close = |i: usize, j: usize| (points[i] - points[j]).length() < 0.05;
        if (0..5).any(|i| (0..i).any(|j| close(i, j))) {
            continue;
        }
        for point in points {
            put(&mut world, id, point, 0.0);
        }
        let kept: Vec<Vec3> = slots(&world, id).iter().map(|(_, point)| *point).collect();
        assert!(kept.contains(&points[4]), "the new point is always let in");
        let best = (0..4)
            .map(|out| area(std::array::from_fn(|i| if i == out { points[4] } else { points[i] })))
            .fold(0.0_f32, f32::max);
        let found = area([kept[0], kept[1], kept[2], kept[3]]);
        assert!(found >= 0.999 * best, "round {round}: {found} of {best}");
    }
}

/// Equal areas: the lowest slot goes, but never the deepest contact.
#[test]
fn ties_go_to_the_lowest_slot_that_is_not_the_deepest() {
    for (deepest, goes) in [(1, 0), (0, 1), (3, 0)] {
        let (mut world, _, id) = bare_world();
        for (slot, point) in RING.into_iter().enumerate() {
            put(&mut world, id, point, if slot == deepest { -0.5 } else { -0.1 });
        }
        put(&mut world, id, Vec3::ZERO, 0.0);
        for (slot, point) in slots(&world, id) {
            assert_eq!(point, if slot == goes { Vec3::ZERO } else { RING[slot] }, "deepest {deepest}");
        }
    }
}

/// PM1: a point of a full cache registered again leaves the four world points as they were.
#[test]
fn registering_a_point_of_a_full_cache_again_changes_nothing() {
    for again in RING {
        let (mut world, _, id) = bare_world();
        for point in RING {
            put(&mut world, id, point, -0.1);
        }
        let before = slots(&world, id);
        put(&mut world, id, again, -0.1);
        assert_eq!(slots(&world, id), before);
    }
}

/// The manifold of two boxes of 2 m, the upper one 5 cm deep (10 cm) and turned by 45° about y, in world space.
fn turned_boxes() -> Vec<ContactPoint> {
    let cube = Shape::cuboid(Vec3::ONE).unwrap();
    let half = libm::sqrtf(0.5 - 0.25 * libm::sqrtf(2.0));
    let turn = Quat::from_xyzw(0.0, half, 0.0, libm::sqrtf(1.0 - half * half));
    let pose = math::Pose::new(Vec3::new(0.0, 1.9, 0.0), math::Rotation::from_quat(turn));
    let mut manifold = Manifold::EMPTY;
    collide(&cube, &cube, &pose, 0.02, &mut PairCache::default(), &mut manifold);
    manifold.points().iter().map(|p| ContactPoint::new(p.point1, p.point2(), p.normal)).collect()
}

/// PM2 and PM3: a manifold of four keeps precisely its points, in whichever order they come.
#[test]
fn a_manifold_is_kept_whole_in_any_order() {
    let points = turned_boxes();
    assert_eq!(points.len(), 4);
    let mut wanted: Vec<Vec3> = points.iter().map(|point| point.point1).collect();
    wanted.sort_by(|a, b| a.to_array().partial_cmp(&b.to_array()).unwrap());
    for shift in 0..4 {
        let mut world = weightless();
        let a = add_bare(&mut world, Vec3::ZERO);
        let b = add_bare(&mut world, Vec3::new(0.0, 1.9, 0.0));
        for i in 0..points.len() {
            world.register_contact_by_key(KEY, a, b, points[(i + shift) % points.len()]).unwrap();
        }
        // Registered once more, all four find their own slot.
        for &point in &points {
            world.register_contact_by_key(KEY, a, b, point).unwrap();
        }
        let found = sorted_points(&world, world.arbiter(KEY).unwrap());
        assert_eq!(found.len(), 4);
        for ((p1, _), wanted) in found.iter().zip(&wanted) {
            assert_close(*p1, *wanted, 1e-6);
        }
    }
}

/// After integration a contact goes when its gap or its sideways drift has passed the break distance, not before.
#[test]
fn gap_and_drift_each_break_a_contact_past_the_break_distance() {
    for direction in [Vec3::Y, Vec3::X, Vec3::new(0.0, 0.0, -1.0)] {
        for (distance, kept) in [(0.0195, true), (0.0205, false)] {
            let (mut world, body, id) = bare_world();
            world.arbiter_mut(id).unwrap().data_mut().set_friction(0.0).unwrap();
            put(&mut world, id, Vec3::ZERO, 0.0);
            world.body_mut(body).unwrap().set_linear_velocity(direction * (distance / 0.25)).unwrap();
            world.step(0.25).unwrap();
            assert_eq!(world.arbiter_by_id(id).is_some(), kept, "{direction} by {distance}");
            if kept && direction == Vec3::Y {
                let gap = world.arbiter_by_id(id).unwrap().data().contact(0).unwrap().separation();
                assert!((gap - distance).abs() < 1e-5, "the gap is followed: {gap}");
            }
        }
    }
}

/// Only what broke goes: the other contacts of the arbiter stay, and the solved bits tell that all took part.
#[test]
fn a_broken_contact_leaves_the_others_alone() {
    let (mut world, body, id) = bare_world();
    put(&mut world, id, Vec3::ZERO, 0.0);
    put(&mut world, id, Vec3::X, 0.0);
    // Turning about z lifts the point at x = 1 by 3 cm and leaves the one at the centre.
    world.body_mut(body).unwrap().set_angular_velocity(Vec3::new(0.0, 0.0, 0.3)).unwrap();
    world.step(0.1).unwrap();
    let data = world.arbiter_by_id(id).unwrap().data();
    assert_eq!(data.usage_mask(), 0b0011_0001);
}

/// An arbiter whose last contact broke ends in that same step.
#[test]
fn the_arbiter_ends_in_the_step_in_which_its_last_contact_breaks() {
    let (mut world, body, id) = bare_world();
    put(&mut world, id, Vec3::ZERO, 0.0);
    world.step(DT).unwrap();
    assert_eq!(world.drain_begin_events().count(), 1);
    world.body_mut(body).unwrap().set_linear_velocity(Vec3::new(0.0, 0.03 / DT, 0.0)).unwrap();
    world.step(DT).unwrap();
    let ends: Vec<EndEvent> = world.drain_end_events().collect();
    assert_eq!((ends.len(), ends[0].reason, ends[0].arbiter), (1, EndReason::Separated, id));
    assert_eq!(ends[0].data.usage_mask() >> 4, 1, "the contact that broke was solved in its last step");
}

/// Friction about the normal needs two points: what it carried must not go on to turn a body that is left with one.
#[test]
fn a_body_left_with_one_contact_is_not_turned_by_what_it_had_with_two() {
    let mut world = World::default();
    let body = add_bare(&mut world, Vec3::ZERO);
    world.body_mut(body).unwrap().set_locked_axes(LockedAxes::ROTATION_X | LockedAxes::ROTATION_Z);
    let id = world.get_or_create_arbiter(KEY, BodyId::WORLD, body).unwrap();
    put(&mut world, id, Vec3::new(0.3, 0.0, 0.0), 0.0);
    put(&mut world, id, Vec3::new(-0.3, 0.0, 0.0), 0.0);
    for _ in 0..5 {
        world.body_mut(body).unwrap().apply_torque(Vec3::new(0.0, 0.5, 0.0)).unwrap();
        world.step(DT).unwrap();
    }
    assert!(world.body(body).unwrap().angular_velocity().y.abs() < 1e-3, "friction holds it");
    world.arbiter_mut(id).unwrap().data_mut().remove_contact(1).unwrap();
    for _ in 0..30 {
        world.step(DT).unwrap();
    }
    assert!(
        world.body(body).unwrap().angular_velocity().y.abs() < 1e-2,
        "{}",
        world.body(body).unwrap().angular_velocity()
    );
}

/// Impulses that are reset start from nothing in the next step; the contacts stay where they are.
#[test]
fn reset_impulses_forget_the_past_and_keep_the_contacts() {
    let (mut world, id, old) = loaded();
    let data = world.arbiter_mut(id).unwrap().data_mut();
    data.reset_impulses();
    let contact = data.contact(0).unwrap();
    assert_eq!((contact.normal_impulse(), contact.total_normal_impulse()), (0.0, 0.0));
    assert_eq!((contact.tangent_impulse(), contact.local_anchor2()), (Vec3::ZERO, old.local_anchor2()));
    let body = world.arbiter_by_id(id).unwrap().body2();
    world.body_mut(body).unwrap().set_linear_velocity(Vec3::ZERO).unwrap();
    world.step(5e-3).unwrap();
    let again = world.arbiter_by_id(id).unwrap().data().contact(0).unwrap().total_normal_impulse();
    assert!((again - 2.0 * 9.81 * 5e-3).abs() < 0.02, "the weight is carried again: {again}");
}
