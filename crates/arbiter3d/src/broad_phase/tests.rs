//! Pairs against brute force.

use super::*;
use crate::random::Random;
use std::cell::Cell;
use std::collections::BTreeSet;

#[derive(Clone, Copy)]
struct Shape {
    tight: Aabb,
    kind: TreeKind,
    moved: bool,
}

/// A caller of the broad phase that also does everything the slow way.
struct Scene {
    broad: BroadPhase,
    shapes: Vec<Option<Shape>>,
    known: PairSet,
    random: Random,
}

const MARGIN: Real = 0.05;

impl Scene {
    fn add(&mut self, index: usize) {
        let tight = Aabb::from_center(self.random.vector() * 4.0, Vec3::splat(0.2) + self.random.vector().abs() * 0.5);
        let kind = if self.random.below(4) == 0 { TreeKind::Static } else { TreeKind::Moving };
        self.broad.add(index as u32, kind, tight.expand(MARGIN));
        self.shapes[index] = Some(Shape { tight, kind, moved: true });
    }

    fn step(&mut self) {
        for index in 0..self.shapes.len() {
            let choice = self.random.below(20);
            let Some(shape) = &mut self.shapes[index] else {
                if choice < 4 {
                    self.add(index);
                }
                continue;
            };
            let moves = shape.kind == TreeKind::Moving || choice == 5;
            if choice == 0 {
                self.broad.remove(index as u32);
                self.shapes[index] = None;
            } else if choice == 1 {
                self.broad.touch(index as u32);
                shape.moved = true;
            } else if moves && index % 3 != 0 {
                let by = self.random.vector() * 0.08;
                shape.tight = Aabb::new(shape.tight.min + by, shape.tight.max + by);
                let left = !self.broad.fat_aabb(index as u32).unwrap().contains(&shape.tight);
                let told = self.broad.update(index as u32, &shape.tight, &shape.tight.expand(MARGIN));
                assert_eq!(told, left);
                shape.moved |= told;
            }
        }
        self.broad.validate().unwrap();
    }

    /// Overlapping pairs that the filter lets pass and of which a shape has moved.
    fn brute_force(&self) -> Vec<(u32, u32)> {
        let moved = |shape: u32| self.shapes[shape as usize].is_some_and(|shape| shape.moved);
        self.overlaps().into_iter().filter(|&(a, b)| filter(a, b) && (moved(a) || moved(b))).collect()
    }

    fn overlaps(&self) -> Vec<(u32, u32)> {
        let mut pairs = Vec::new();
        for a in 0..self.shapes.len() as u32 {
            for b in a + 1..self.shapes.len() as u32 {
                let (Some(first), Some(second)) = (self.shapes[a as usize], self.shapes[b as usize]) else { continue };
                let both_static = first.kind == TreeKind::Static && second.kind == TreeKind::Static;
                let overlap = self.broad.fat_aabb(a).unwrap().overlaps(self.broad.fat_aabb(b).unwrap());
                if overlap && !both_static {
                    pairs.push((a, b));
                }
            }
        }
        pairs
    }
}

fn filter(a: u32, b: u32) -> bool {
    !(a + b).is_multiple_of(5)
}

/// 300 steps of motion, creation, removal and touching; the pairs are exactly those that brute force finds, in order. Those
/// that are called known have overlapped in the last search, and most that have are called so.
#[test]
fn found_pairs_agree_with_brute_force() {
    let mut scene =
        Scene { broad: BroadPhase::new(), shapes: vec![None; 150], known: PairSet::new(), random: Random(11) };
    let (mut out, mut total) = (Vec::new(), 0);
    let mut last = BTreeSet::new();
    let (known_pairs, old_pairs) = (Cell::new(0), Cell::new(0));
    for _ in 0..300 {
        scene.step();
        let wanted = scene.brute_force();
        let tell = |a: u32, b: u32, known: bool| {
            assert!(!known || last.contains(&(a, b)), "{a} and {b} have not overlapped before");
            known_pairs.set(known_pairs.get() + usize::from(known));
            old_pairs.set(old_pairs.get() + usize::from(last.contains(&(a, b))));
            filter(a, b)
        };
        scene.broad.find_pairs(tell, &mut out);
        assert_eq!(out, wanted);
        total += out.len();
        last = scene.overlaps().into_iter().collect();
        for shape in scene.shapes.iter_mut().flatten() {
            shape.moved = false;
        }
        scene.broad.find_pairs(|_, _, _| true, &mut out);
        assert_eq!(out, [], "nothing has moved since");
    }
    assert!(total > 10_000, "{total}");
    let share = f64::from(known_pairs.get() as u32) / f64::from(old_pairs.get() as u32);
    assert!(share > 0.5, "{} of {} old pairs are known", known_pairs.get(), old_pairs.get());
}

/// Boxes moved by threads and lifted together leave the same trees as boxes moved one by one, few or many.
#[test]
fn boxes_lifted_together_are_as_boxes_moved_one_by_one() {
    let mut random = Random(5);
    let mut one_by_one = BroadPhase::new();
    for shape in 0..600 {
        let kind = if shape % 6 == 0 { TreeKind::Static } else { TreeKind::Moving };
        one_by_one.add(shape, kind, Aabb::from_center(random.vector() * 5.0, Vec3::splat(0.5)));
    }
    let mut together = one_by_one.clone();
    let mut pool = StagePool::new(3);
    let (mut expected, mut found) = (Vec::new(), Vec::new());
    for round in 0..30 {
        let share = if round % 3 == 0 { 50 } else { 2 };
        let mut moved = Vec::new();
        for shape in (0..600).filter(|shape| shape % 6 != 0) {
            if random.below(share) == 0 {
                let tight = Aabb::from_center(random.vector() * 5.0, Vec3::splat(0.4));
                let told = one_by_one.update(shape, &tight, &tight.expand(0.1));
                // SAFETY: there is only this thread.
                assert_eq!(unsafe { together.boxes().update(shape, &tight, || tight.expand(0.1)) }, told);
                if told {
                    moved.push(shape);
                }
            }
        }
        together.lift(&moved, Some(&mut pool));
        together.validate().unwrap();
        one_by_one.find_pairs(|_, _, _| true, &mut expected);
        together.find_pairs(|_, _, _| true, &mut found);
        assert_eq!(found, expected, "round {round}, {} moved", moved.len());
        assert!(!found.is_empty());
    }
}

/// No touching pair is ever missing from the set that a caller keeps, though most shapes rest in most steps.
#[test]
fn the_kept_pairs_hold_every_overlap() {
    let mut scene =
        Scene { broad: BroadPhase::new(), shapes: vec![None; 100], known: PairSet::new(), random: Random(23) };
    let mut out = Vec::new();
    let mut removed_from = [false; 100];
    for _ in 0..200 {
        let before: Vec<bool> = scene.shapes.iter().map(Option::is_some).collect();
        scene.step();
        for (index, &was) in before.iter().enumerate() {
            removed_from[index] = was && scene.shapes[index].is_none();
        }
        for a in 0..100 {
            for b in a + 1..100 {
                if removed_from[a as usize] || removed_from[b as usize] {
                    scene.known.remove(a, b);
                }
            }
        }
        let Scene { broad, known, .. } = &mut scene;
        broad.find_pairs(|a, b, _| !known.contains(a, b), &mut out);
        for &(a, b) in &out {
            assert_eq!(scene.known.insert(a, b, 0), None);
        }
        for a in 0..100 {
            for b in a + 1..100 {
                let (Some(first), Some(second)) = (&scene.shapes[a], &scene.shapes[b]) else { continue };
                let both_static = first.kind == TreeKind::Static && second.kind == TreeKind::Static;
                if !both_static && first.tight.overlaps(&second.tight) {
                    assert!(scene.known.contains(a as u32, b as u32));
                }
            }
        }
    }
}

/// Cutting the work into parts, done in any order, gives the same pairs.
#[test]
fn the_cut_of_the_work_does_not_show() {
    let mut whole = BroadPhase::new();
    let mut random = Random(2);
    for shape in 0..400 {
        let kind = if shape % 3 == 0 { TreeKind::Static } else { TreeKind::Moving };
        whole.add(shape, kind, Aabb::from_center(random.vector() * 4.0, Vec3::splat(0.5)));
    }
    let mut cut = whole.clone();
    let (mut expected, mut found) = (Vec::new(), Vec::new());
    whole.find_pairs(|_, _, _| true, &mut expected);
    cut.prepare(16);
    assert!(cut.work().len() >= 16);
    for part in cut.work().iter().rev() {
        cut.pairs_of(part, |_, _, _| true, |a, b| found.push((a, b)));
    }
    cut.finish(&mut found, Some(&mut StagePool::new(2)));
    assert!(expected.len() > 500);
    assert_eq!(found, expected);
}

/// Unit spheres at one point, with a filter for shapes of one body: 1, 3, 9 pairs, then fewer as shapes go.
#[test]
fn pair_counts_follow_shapes_that_come_and_go() {
    // Shape → body; bodies 3 and later have what the test needs.
    let body = [0_u32, 1, 2, 3, 3, 4];
    let unit = Aabb::from_center(Vec3::ZERO, Vec3::ONE);
    let mut broad = BroadPhase::new();
    let mut known = BTreeSet::new();
    let mut out = Vec::new();
    let mut search = |broad: &mut BroadPhase, known: &mut BTreeSet<(u32, u32)>| {
        broad.find_pairs(|a, b, _| body[a as usize] != body[b as usize] && !known.contains(&(a, b)), &mut out);
        known.extend(out.iter().copied());
        known.len()
    };
    let mut counts = Vec::new();
    for added in [&[0_u32, 1][..], &[2], &[3, 4], &[]] {
        for &shape in added {
            broad.add(shape, TreeKind::Moving, unit);
        }
        counts.push(search(&mut broad, &mut known));
    }
    assert_eq!(counts, [1, 3, 9, 9]);
    counts.clear();
    for removed in [1_u32, 4, 3] {
        broad.remove(removed);
        known.retain(|&(a, b)| a != removed && b != removed);
        counts.push(search(&mut broad, &mut known));
    }
    assert_eq!(counts, [5, 3, 1]);
    broad.add(5, TreeKind::Static, unit);
    assert_eq!(search(&mut broad, &mut known), 3);
    broad.remove(5);
    known.retain(|&(_, b)| b != 5);
    assert_eq!(search(&mut broad, &mut known), 1);
    assert_eq!(broad.len(), 2);
}

/// 2,000 boxes at one point have 1,999,000 pairs, and every one is reported.
#[test]
fn a_crowd_at_one_point_loses_no_pair() {
    let mut broad = BroadPhase::new();
    for shape in 0..2_000 {
        broad.add(shape, TreeKind::Moving, Aabb::from_center(Vec3::ZERO, Vec3::ONE));
    }
    let mut out = Vec::new();
    broad.find_pairs(|_, _, _| true, &mut out);
    assert_eq!(out.len(), 2_000 * 1_999 / 2);
    assert!(out.windows(2).all(|pair| pair[0] < pair[1]));
}

/// A search that repeats itself allocates nothing: no buffer grows after the first rounds.
#[test]
fn buffers_are_reused() {
    let mut random = Random(4);
    let mut broad = BroadPhase::new();
    for shape in 0..500 {
        let kind = if shape % 5 == 0 { TreeKind::Static } else { TreeKind::Moving };
        broad.add(shape, kind, Aabb::from_center(random.vector() * 5.0, Vec3::splat(0.5)));
    }
    let mut out = Vec::with_capacity(100_000);
    let mut sizes = Vec::new();
    for _ in 0..40 {
        for shape in 0..500 {
            broad.touch(shape);
        }
        broad.find_pairs(|_, _, _| true, &mut out);
        sizes.push((broad.work.capacity(), broad.links.capacity(), out.capacity()));
    }
    assert!(sizes[REBUILD_INTERVAL as usize * 2..].windows(2).all(|pair| pair[0] == pair[1]), "{sizes:?}");
}

/// Shapes that leave their fat box in step with the rebuilds, but never in the search that rebuilds, do not spoil the tree.
#[test]
fn motion_in_step_with_the_rebuilds_keeps_the_tree_good() {
    let mut random = Random(8);
    let mut broad = BroadPhase::new();
    for shape in 0..1_000 {
        broad.add(shape, TreeKind::Moving, Aabb::from_center(random.vector() * 10.0, Vec3::splat(0.3)));
    }
    let mut out = Vec::new();
    broad.find_pairs(|_, _, _| true, &mut out);
    let fresh = broad.tree(TreeKind::Moving).cost();
    for step in 0..400 {
        if step % REBUILD_INTERVAL == 3 {
            for shape in 0..1_000 {
                let aabb = Aabb::from_center(random.vector() * 10.0, Vec3::splat(0.3));
                broad.update(shape, &aabb, &aabb);
            }
        }
        broad.find_pairs(|_, _, _| true, &mut out);
    }
    while !broad.searches.is_multiple_of(REBUILD_INTERVAL) {
        broad.find_pairs(|_, _, _| true, &mut out);
    }
    broad.validate().unwrap();
    let kept = broad.tree(TreeKind::Moving).cost();
    assert!(kept < 1.2 * fresh, "{kept} {fresh}");
}

/// Queries over both trees see a moved proxy at once, before any search; rays stop in both trees when told.
#[test]
fn queries_see_both_trees_and_fresh_moves() {
    let mut broad = BroadPhase::new();
    broad.add(0, TreeKind::Static, Aabb::from_center(Vec3::ZERO, Vec3::ONE));
    broad.add(1, TreeKind::Moving, Aabb::from_center(Vec3::ZERO, Vec3::ONE));
    broad.add(2, TreeKind::Moving, Aabb::from_center(Vec3::new(4.0, 0.0, 0.0), Vec3::ONE));
    let moved = Aabb::from_center(Vec3::new(10.0, 0.0, 0.0), Vec3::ONE);
    assert!(broad.update(1, &moved, &moved));
    let found = |aabb: Aabb| {
        let mut found = Vec::new();
        broad.query(&aabb, |shape| {
            found.push(shape);
            true
        });
        found
    };
    assert_eq!(found(Aabb::from_center(Vec3::ZERO, Vec3::splat(2.0))), [0]);
    assert_eq!(found(Aabb::new(Vec3::new(8.0, -1.0, -1.0), Vec3::new(12.0, 1.0, 1.0))), [1]);
    let mut seen = Vec::new();
    broad.ray(Vec3::new(-5.0, 0.0, 0.0), Vec3::X, 100.0, |shape, limit| {
        seen.push(shape);
        limit
    });
    seen.sort_unstable();
    assert_eq!(seen, [0, 1, 2]);
}
