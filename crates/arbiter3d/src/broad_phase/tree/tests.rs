//! Trees against brute force.

use super::*;
use crate::math::{Real, Vec3};
use crate::random::Random;

fn box_of(random: &mut Random) -> Aabb {
    let half_extents = Vec3::splat(0.1) + random.vector().abs() * 0.6;
    Aabb::from_center(random.vector() * 8.0, half_extents)
}

/// Leaves and what their boxes should be.
#[derive(Default)]
struct Model {
    tree: DynamicTree,
    boxes: Vec<(u32, u32, Aabb)>,
    next: u32,
}

impl Model {
    fn insert(&mut self, aabb: Aabb) {
        let leaf = self.tree.insert(aabb, self.next);
        self.boxes.push((leaf, self.next, aabb));
        self.next += 1;
    }

    fn edit(&mut self, random: &mut Random) {
        let kind = random.below(10);
        if self.boxes.len() < 5 || kind < 3 {
            self.insert(box_of(random));
            return;
        }
        let index = random.below(self.boxes.len() as u32) as usize;
        let (leaf, _, aabb) = &mut self.boxes[index];
        match kind {
            3 | 4 => {
                self.tree.remove(*leaf);
                self.boxes.swap_remove(index);
            }
            5..=7 => {
                let move_by = random.vector();
                *aabb = Aabb::new(aabb.min + move_by, aabb.max + move_by);
                self.tree.move_leaf(*leaf, aabb);
            }
            8 => {
                *aabb = box_of(random);
                self.tree.move_leaf(*leaf, aabb);
            }
            _ => self.tree.mark(*leaf),
        }
    }

    fn maintain(&mut self, random: &mut Random) {
        match random.below(6) {
            0 => self.tree.rebuild_loose(),
            1 => self.tree.refit_marked(),
            2 => self.tree.clear_marks(|_, _| (), None),
            3 => self.tree.rebuild(),
            _ => {}
        }
    }

    fn expect(&self, mut found: Vec<u32>, holds: impl Fn(&Aabb) -> bool) {
        found.sort_unstable();
        let mut wanted: Vec<u32> =
            self.boxes.iter().filter(|(_, _, aabb)| holds(aabb)).map(|&(_, data, _)| data).collect();
        wanted.sort_unstable();
        assert_eq!(found, wanted);
    }

    fn check(&self, random: &mut Random) {
        self.tree.validate().unwrap();
        for &(leaf, data, aabb) in &self.boxes {
            assert_eq!((*self.tree.aabb(leaf), self.tree.data(leaf)), (aabb, data));
        }
        let mut found = Vec::new();
        let probe = box_of(random).expand(0.5);
        self.tree.query(&probe, |data| {
            found.push(data);
            true
        });
        self.expect(found, |aabb| aabb.overlaps(&probe));

        let (origin, mut direction, limit) = (random.vector() * 10.0, random.vector() * 12.0, random.signed().abs());
        if random.below(3) == 0 {
            direction = Vec3::new(0.0, direction.y, -0.0);
        }
        let mut found = Vec::new();
        self.tree.ray(origin, direction, limit, |data, present| {
            found.push(data);
            present
        });
        self.expect(found, |aabb| DynamicTree::line_meets(origin, direction, limit, aabb));
    }
}

/// 12,000 random inserts, removals, moves, marks, refits and rebuilds; box and ray queries after every tenth.
#[test]
fn walks_agree_with_brute_force_through_random_edits() {
    let (mut model, mut random) = (Model::default(), Random(1));
    for _ in 0..1_200 {
        for _ in 0..10 {
            model.edit(&mut random);
        }
        model.maintain(&mut random);
        model.check(&mut random);
    }
    while let Some((leaf, ..)) = model.boxes.pop() {
        model.tree.remove(leaf);
    }
    model.tree.validate().unwrap();
    assert!(model.tree.is_empty());
}

/// Pairs inside a tree and between two, at least one of them marked, each once, however the work is cut.
#[test]
fn pair_search_agrees_with_brute_force() {
    let mut random = Random(5);
    let mut models = [Model::default(), Model::default()];
    for round in 0..200 {
        for model in &mut models {
            if round % 4 == 0 {
                model.tree.clear_marks(|_, _| (), None);
            }
            for _ in 0..20 {
                model.edit(&mut random);
            }
            model.maintain(&mut random);
        }
        let [left, right] = &models;
        for (first, second) in [(left, left), (left, right)] {
            let within = std::ptr::eq(first, second);
            let mut wanted = Vec::new();
            for &(a, a_data, a_box) in &first.boxes {
                for &(b, b_data, b_box) in &second.boxes {
                    let marked = first.tree.is_marked(a) || second.tree.is_marked(b);
                    if marked && a_box.overlaps(&b_box) && !(within && a_data >= b_data) {
                        wanted.push((a_data, b_data));
                    }
                }
            }
            wanted.sort_unstable();
            let search =
                if within { PairSearch::within(&first.tree) } else { PairSearch::between(&first.tree, &second.tree) };
            for parts in [1, 7, 100_000] {
                let (mut work, mut found) = (Vec::new(), Vec::new());
                search.split(parts, &mut work);
                for part in work {
                    search.run(part, |a, b| {
                        let (a, b) = (first.tree.data(a.index() as u32), second.tree.data(b.index() as u32));
                        found.push(if within && a > b { (b, a) } else { (a, b) });
                    });
                }
                found.sort_unstable();
                assert_eq!(found, wanted);
            }
        }
    }
}

/// The limit that `visit` returns prunes: the nearest of 1,000 boxes in a row is found in a few visits.
#[test]
fn a_closest_hit_ray_prunes_and_finds_the_nearest() {
    let mut tree = DynamicTree::new();
    for i in 0..1_000_u32 {
        tree.insert(
            Aabb::from_center(Vec3::new(2.0 * (i * 617 % 1_000) as Real, 0.0, 0.0), Vec3::splat(0.5)),
            i * 617 % 1_000,
        );
    }
    let (mut nearest, mut visits) = (None, 0);
    tree.ray(Vec3::new(399.0, 0.1, 0.2), Vec3::new(2.0, 0.0, 0.0), 1e6, |data, limit| {
        visits += 1;
        let fraction = (2.0 * data as Real - 0.5 - 399.0) / 2.0;
        if fraction < limit {
            nearest = Some(data);
        }
        fraction.min(limit)
    });
    assert_eq!(nearest, Some(200));
    assert!(visits <= 4, "{visits} visits");
}

/// Returning `false`, or a negative limit, ends a walk at once.
#[test]
fn walks_stop_when_told() {
    let mut tree = DynamicTree::new();
    for i in 0..100 {
        tree.insert(Aabb::from_center(Vec3::ZERO, Vec3::ONE), i);
    }
    let mut visits = 0;
    tree.query(&Aabb::from_center(Vec3::ZERO, Vec3::ONE), |_| {
        visits += 1;
        visits < 3
    });
    assert_eq!(visits, 3);
    tree.ray(Vec3::ZERO, Vec3::X, 1.0, |_, _| {
        visits += 1;
        -1.0
    });
    assert_eq!(visits, 4);
}

/// A ray that runs inside the plane of a face, with zero components of either sign, meets the box.
#[test]
fn rays_along_a_face_touch() {
    let mut tree = DynamicTree::new();
    tree.insert(Aabb::new(Vec3::ZERO, Vec3::ONE), 7);
    for zero in [0.0, -0.0] {
        for y in [0.0, 0.5, 1.0] {
            let mut hits = 0;
            tree.ray(Vec3::new(-1.0, y, 1.0), Vec3::new(4.0, zero, zero), 1.0, |_, limit| {
                hits += 1;
                limit
            });
            assert_eq!(hits, 1, "y = {y}, zero = {zero}");
        }
        tree.ray(Vec3::new(-1.0, 1.001, 1.0), Vec3::new(4.0, zero, zero), 1.0, |_, _| panic!("passes above"));
    }
}

fn height_of(boxes: impl Iterator<Item = Aabb>) -> u32 {
    let mut tree = DynamicTree::new();
    for (data, aabb) in boxes.enumerate() {
        tree.insert(aabb, data as u32);
    }
    tree.validate().unwrap();
    tree.height()
}

/// 10,000 leaves need a height of 14; the inputs that make naive trees into lists stay near it.
#[test]
fn hard_inputs_stay_balanced() {
    let unit = Aabb::from_center(Vec3::ZERO, Vec3::ONE);
    let equal = height_of((0..10_000).map(|_| unit));
    assert!(equal <= 20, "{equal}");
    let line = |i: i32| Aabb::from_center(Vec3::new(i as Real, 0.0, 0.0), Vec3::splat(0.4));
    let (ascending, descending) = (height_of((0..10_000).map(line)), height_of((0..10_000).rev().map(line)));
    assert!(ascending <= 40 && descending <= 40, "{ascending} {descending}");
    let nested = height_of((0..10_000).map(|i| unit.expand(i as Real * 0.01)));
    let shrinking = height_of((0..10_000).rev().map(|i| unit.expand(i as Real * 0.01)));
    assert!(nested <= MAX_HEIGHT && shrinking <= MAX_HEIGHT, "{nested} {shrinking}");
    let growing = height_of((0..120).map(|i| {
        let scale = (0..i).fold(1e-15, |scale: Real, _| scale * 1.7);
        Aabb::from_center(Vec3::splat(scale), Vec3::splat(0.1 * scale))
    }));
    assert!(growing <= MAX_HEIGHT, "{growing}");
}

/// Rebuilding identical and exponentially spaced boxes stays within the height of the stacks too.
#[test]
fn rebuilds_of_hard_inputs_stay_balanced() {
    let mut tree = DynamicTree::new();
    for i in 0..10_000 {
        let leaf = tree.insert(Aabb::from_center(Vec3::ZERO, Vec3::ONE), i);
        tree.mark(leaf);
    }
    tree.rebuild_loose();
    tree.validate().unwrap();
    assert!(tree.height() <= 15, "{}", tree.height());
    let mut tree = DynamicTree::new();
    let mut scale = 1e-18;
    for i in 0..130 {
        let leaf = tree.insert(Aabb::from_center(Vec3::splat(scale), Vec3::splat(0.1 * scale)), i);
        tree.mark(leaf);
        scale *= 1.9;
    }
    tree.rebuild_loose();
    tree.validate().unwrap();
    tree.rebuild();
    tree.validate().unwrap();
}

/// Building everything anew after many insertions beats the inserted tree, most of all where sizes differ.
#[test]
fn a_built_tree_is_better_than_an_inserted_one() {
    let mut random = Random(6);
    let mut tree = DynamicTree::new();
    for i in 0..4_000 {
        let size = if i % 50 == 0 { 3.0 } else { 0.2 };
        tree.insert(Aabb::from_center(random.vector() * 20.0, Vec3::splat(size)), i);
    }
    assert!(tree.wants_rebuild());
    let inserted = tree.cost();
    tree.rebuild();
    tree.validate().unwrap();
    assert!(tree.cost() < 0.9 * inserted, "{} {inserted}", tree.cost());
    assert!(!tree.wants_rebuild());
}

/// Random motion spoils a tree that is only refitted; a rebuild brings the cost back to that of a fresh tree.
#[test]
fn a_rebuild_restores_the_cost() {
    let mut random = Random(3);
    let (mut tree, mut boxes) = (DynamicTree::new(), Vec::new());
    for i in 0..2_000 {
        let aabb = box_of(&mut random);
        boxes.push((tree.insert(aabb, i), aabb));
    }
    let fresh = tree.cost();
    for (leaf, aabb) in &mut boxes {
        let center = random.vector() * 8.0;
        *aabb = Aabb::from_center(center, aabb.half_extents());
        tree.move_leaf(*leaf, aabb);
    }
    tree.refit_marked();
    let spoiled = tree.cost();
    tree.rebuild_loose();
    let rebuilt = tree.cost();
    assert!(spoiled > 5.0 * fresh, "{spoiled} {fresh}");
    assert!(rebuilt < 1.2 * fresh, "{rebuilt} {fresh}");
}

/// After a refit no box above a moved leaf is larger than it must be.
#[test]
fn a_refit_is_tight() {
    let mut random = Random(9);
    let (mut tree, mut leaves) = (DynamicTree::new(), Vec::new());
    for i in 0..500 {
        leaves.push(tree.insert(box_of(&mut random), i));
    }
    for _ in 0..20 {
        for _ in 0..30 {
            let leaf = leaves[random.below(500) as usize];
            tree.move_leaf(leaf, &box_of(&mut random));
        }
        tree.refit_marked();
        tree.clear_marks(|_, _| (), None);
        for index in tree.inner_nodes() {
            let node = &tree.nodes[index as usize];
            for side in 0..2 {
                assert_eq!(node.bounds[side], tree.box_of(node.children[side]));
            }
        }
        assert!(leaves.iter().all(|&leaf| !tree.is_marked(leaf)));
    }
}

/// Infinite and NaN boxes never get here, but huge ones may: areas overflow, nothing else breaks.
#[test]
fn huge_boxes_do_no_harm() {
    let mut tree = DynamicTree::new();
    for i in 0..200 {
        let far = Vec3::splat(1e30 * (i % 7) as Real - 3e30);
        let leaf = tree.insert(Aabb::from_center(far, Vec3::splat(1e25 * (1 + i % 3) as Real)), i);
        tree.mark(leaf);
    }
    tree.validate().unwrap();
    tree.rebuild_loose();
    tree.validate().unwrap();
    tree.rebuild();
    tree.validate().unwrap();
    let mut count = 0;
    tree.query(&Aabb::from_center(Vec3::ZERO, Vec3::splat(1e31)), |_| {
        count += 1;
        true
    });
    assert_eq!(count, 200);
}
