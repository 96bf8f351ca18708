//! The manifolds of the engine's own arbiters after a step.

use crate::support::*;
use arbiter3d::math::{Quat, Vec3};
use arbiter3d::*;

/// A turn by 45° about y.
fn eighth_turn() -> Quat {
    let half = libm::sqrtf(0.5 - 0.25 * libm::sqrtf(2.0));
    Quat::from_xyzw(0.0, half, 0.0, libm::sqrtf(1.0 - half * half))
}

/// Contacts of two boxes of 2 m one above the other at `height`, found but not solved: (on A, on B) from A's centre.
fn stacked(offset: Vec3, height: f32, turn: Quat) -> (Vec<(Vec3, Vec3)>, Vec<Contact>) {
    let mut world = weightless();
    let cube = Shape::cuboid(Vec3::ONE).unwrap();
    let (a, _) = add(&mut world, offset, cube.clone());
    let (b, _) = add(&mut world, offset + Vec3::new(0.0, height, 0.0), cube);
    world.body_mut(b).unwrap().set_rotation(turn).unwrap();
    world.on_begin_collide(Box::new(|context, id| {
        context.arbiter_mut(id).unwrap().data_mut().set_solve_mode(SolveMode::NONE);
    }));
    world.step(DT).unwrap();
    let arbiter = only_arbiter(&world, a);
    let contacts: Vec<Contact> = arbiter.data().contacts().map(|(_, contact)| *contact).collect();
    let rotation = math::Rotation::from_quat(turn);
    let points = contacts.iter().map(|contact| {
        (contact.local_anchor1(), rotation.rotate(contact.local_anchor2()) + Vec3::new(0.0, height, 0.0))
    });
    (points.collect(), contacts)
}

/// MF1.
#[test]
fn equal_boxes_touch_in_their_four_corners() {
    let (points, contacts) = stacked(Vec3::ZERO, 1.9, Quat::IDENTITY);
    assert_eq!(points.len(), 4);
    let mut corners = Vec::new();
    for ((a, b), contact) in points.into_iter().zip(contacts) {
        assert!((a.x.abs() - 1.0).abs() < 1e-4 && (a.z.abs() - 1.0).abs() < 1e-4, "{a}");
        assert!((a.y - 1.0).abs() < 1e-4 && (b.y - 0.9).abs() < 1e-4, "{a} {b}");
        assert!(((a - b).dot(contact.normal()) + contact.separation()).abs() < 1e-4);
        assert!((contact.separation() + 0.1).abs() < 1e-4);
        corners.push((a.x > 0.0, a.z > 0.0));
    }
    corners.sort_unstable();
    assert_eq!(corners, [(false, false), (false, true), (true, false), (true, true)]);
}

/// MF2 and MF3.
#[test]
fn turned_boxes_touch_in_four_points_around_the_middle() {
    let (points, _) = stacked(Vec3::ZERO, 1.9, eighth_turn());
    assert_eq!(points.len(), 4);
    for (i, (a, b)) in points.iter().enumerate() {
        assert!(a.x.abs() <= 1.0002 && a.z.abs() <= 1.0002, "inside the lower face: {a}");
        assert!(b.x.abs() + b.z.abs() <= 2.0_f32.sqrt() + 2e-4, "inside the upper face: {b}");
        assert!(points[..i].iter().all(|(other, _)| (*other - *a).length() > 0.1), "all different");
    }
    // The patch reaches round the middle: a point far out to each of the four sides of some frame.
    for side in [Vec3::X, -Vec3::X, Vec3::Z, -Vec3::Z] {
        assert!(points.iter().any(|(a, _)| a.dot(side) > 0.05), "{side}");
    }
    let d = [points[0].0, points[1].0, points[2].0, points[3].0];
    let pairs = [(d[0] - d[1], d[2] - d[3]), (d[0] - d[2], d[1] - d[3]), (d[0] - d[3], d[1] - d[2])];
    let area = pairs.iter().map(|(a, b)| 0.5 * a.cross(*b).length()).fold(0.0_f32, f32::max);
    // The octagon of both faces has 3.31 m²; its best four corners have 2.34 to 2.83.
    assert!(area > 2.3, "{area} m²");
}

/// MF4: the same far from the origin, as exactly as the positions there can be told.
#[test]
fn manifolds_do_not_depend_on_where_the_bodies_are() {
    for turn in [Quat::IDENTITY, eighth_turn()] {
        let (near, _) = stacked(Vec3::ZERO, 1.875, turn);
        let (far, _) = stacked(Vec3::new(1e4, -2e4, 3e4), 1.875, turn);
        assert_eq!(near.len(), far.len());
        for (a, b) in near.iter().zip(&far) {
            assert_close(a.0, b.0, 1e-3);
            assert_close(a.1, b.1, 1e-3);
        }
    }
}

/// A ridge lowered with its edge onto a box, as shape 2 (MF5) and as shape 1 (MF6).
#[test]
fn a_ridge_on_a_face_touches_in_the_two_ends_of_its_edge() {
    for ridge_first in [false, true] {
        let mut world = weightless();
        let cube = Shape::cuboid(Vec3::splat(2.0)).unwrap();
        let corners = [-2.0, 2.0]
            .into_iter()
            .flat_map(|x| [Vec3::new(x, -1.0, 0.0), Vec3::new(x, 1.0, 1.0), Vec3::new(x, 1.0, -1.0)]);
        let ridge = Shape::hull(&corners.collect::<Vec<_>>()).unwrap();
        let above = Vec3::new(0.0, 2.9, 0.0);
        if ridge_first {
            add(&mut world, above, ridge);
            add(&mut world, Vec3::ZERO, cube);
        } else {
            add(&mut world, Vec3::ZERO, cube);
            add(&mut world, above, ridge);
        }
        let found: Log<(Vec3, Vec3, Vec3)> = Log::default();
        let log = found.clone();
        world.on_begin_collide(Box::new(move |context, id| {
            let arbiter = context.arbiter(id).unwrap();
            let points: Vec<_> = context.world().contact_points(arbiter).collect();
            for (slot, p1, p2) in points {
                log.push((p1, p2, arbiter.data().contact(slot).unwrap().normal()));
            }
        }));
        world.step(DT).unwrap();
        let mut found = found.all();
        found.sort_by(|a, b| a.0.x.total_cmp(&b.0.x));
        assert_eq!(found.len(), 2);
        for ((p1, p2, normal), x) in found.into_iter().zip([-2.0, 2.0]) {
            let (on_cube, on_ridge) = if ridge_first { (p2, p1) } else { (p1, p2) };
            assert_close(on_cube, Vec3::new(x, 2.0, 0.0), 1e-4);
            assert_close(on_ridge, Vec3::new(x, 1.9, 0.0), 1e-4);
            assert_close(normal, if ridge_first { -Vec3::Y } else { Vec3::Y }, 1e-4);
        }
    }
}

/// A whole manifold in the first step, for every pair of kinds: no building up over several steps.
#[test]
fn manifolds_are_complete_in_the_first_step() {
    let mut world = World::default();
    add_floor(&mut world);
    let box_hull: Vec<Vec3> = (0..8_u8)
        .map(|i| Vec3::new(f32::from(i & 1), f32::from(i >> 1 & 1), f32::from(i >> 2)) - Vec3::splat(0.5))
        .collect();
    let lying = Quat::from_xyzw(0.0, 0.0, 0.5_f32.sqrt(), 0.5_f32.sqrt());
    for (i, (shape, turn, height, count)) in [
        (Shape::sphere(0.5).unwrap(), Quat::IDENTITY, 0.499, 1),
        (Shape::capsule(0.5, 0.25).unwrap(), lying, 0.249, 2),
        (Shape::cuboid(Vec3::splat(0.5)).unwrap(), Quat::IDENTITY, 0.499, 4),
        (Shape::hull(&box_hull).unwrap(), Quat::IDENTITY, 0.499, 4),
    ]
    .into_iter()
    .enumerate()
    {
        let (body, _) = add(&mut world, Vec3::new(3.0 * i as f32, height, 0.0), shape);
        world.body_mut(body).unwrap().set_rotation(turn).unwrap();
        world.step(1e-4).unwrap();
        assert_eq!(only_arbiter(&world, body).data().contact_count(), count, "case {i}");
    }
}
