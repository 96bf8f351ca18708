//! The narrow phase of a step: for each active pair, a new manifold or last step's once more.
//!
//! A manifold is used again while the bodies have hardly moved against each other since it was made ([`Pair::hardly_moved`]):
//! the anchors turn and move with their bodies, so gaps stay exact; the choice of points, the normal and the levers are those
//! of when it was made. That keeps tall stacks up: were normals and levers to follow each small tilt, a soft stack would
//! buckle under its own weight as a tall column does (measured: a triangle of 100 rows falls after 8 s, and stands for good
//! with levers kept). Where a pair turns together, on a turntable, normal and levers are turned along every 1.4°. Materials and arbiters are read anew each step
//! whatever is used again.
//!
//! Pairs are independent: they run on all threads, each writing its own arbiter. What begins is gathered and sorted by key.

use super::World;
use super::arbiters::surface_velocity;
use super::bodies::Body;
use super::filters::UserFilters;
use super::pairs::Pair;
use super::settings::WorldSettings;
use super::shapes::ShapeSlot;
use crate::arbiter::{Arbiter, ArbiterKey, Contact, ContactData, NONE, ONE_NORMAL, SLOTS, TANGENT_VELOCITY_OVERRIDDEN};
use crate::math::{Pose, Real, Rotation, Vec3, max, min};
use crate::narrow_phase::{Manifold, collide};
use crate::parallel::{Gather, SharedSlice};
use crate::solver::SolverBodies;

/// Pairs that a thread takes at a time.
const PAIRS_PER_BLOCK: usize = 64;

/// What a pair has to tell beyond its own records.
#[derive(Clone, Copy, Debug)]
enum News {
    /// The fat boxes have parted.
    Apart(u32),
    /// The shapes begin to touch.
    Begin(ArbiterKey, u32, Manifold),
    /// A sensor's overlap has begun or ended.
    Sensor(u32, bool),
    /// The arbiter has no contacts.
    Empty(u32),
}

/// What all pairs read.
struct CollideContext<'a> {
    shapes: &'a [ShapeSlot],
    bodies: &'a [Body],
    solver: &'a SolverBodies,
    broad_phase: &'a crate::broad_phase::BroadPhase,
    settings: &'a WorldSettings,
    filters: &'a UserFilters,
    /// Shapes whose proxies have moved since the last narrow phase.
    moved: &'a [bool],
    dt: Real,
}

/// Buffers of the narrow phase, kept from step to step.
#[derive(Debug, Default)]
pub(crate) struct NarrowPhaseScratch {
    news: Gather<News>,
    begins: Vec<(ArbiterKey, u32, Manifold)>,
    apart: Vec<u32>,
    sensors: Vec<(u32, bool)>,
    /// Arbiters that may have nothing left.
    pub empty: Vec<u32>,
}

impl World {
    /// Finds the contacts of all active pairs and makes the arbiters that begin.
    pub(crate) fn collide_pairs(&mut self, dt: Real) {
        let mut scratch = std::mem::take(&mut self.narrow);
        scratch.empty.clear();
        scratch.news.prepare(self.pool.threads(), PAIRS_PER_BLOCK);
        self.run_pairs(dt, &scratch.news);
        for item in scratch.news.list().drain(..) {
            match item {
                News::Apart(pair) => scratch.apart.push(pair),
                News::Begin(key, pair, manifold) => scratch.begins.push((key, pair, manifold)),
                News::Sensor(pair, overlaps) => scratch.sensors.push((pair, overlaps)),
                News::Empty(arbiter) => scratch.empty.push(arbiter),
            }
        }
        // Threads report in any order; events and places must not depend on it.
        scratch.sensors.sort_unstable_by_key(|&(pair, _)| self.pair_key(pair));
        for (pair, overlaps) in scratch.sensors.drain(..) {
            self.set_sensor_overlap(pair, overlaps);
        }
        scratch.apart.sort_unstable();
        for pair in scratch.apart.drain(..) {
            self.part_pair(pair);
        }
        scratch.empty.retain(|&index| self.arbiters.at(index).alive);
        scratch.begins.sort_unstable_by_key(|begin| begin.0);
        for (key, pair, manifold) in scratch.begins.drain(..) {
            self.begin_pair(key, pair, &manifold);
        }
        self.narrow = scratch;
    }

    fn run_pairs(&mut self, dt: Real, news: &Gather<News>) {
        self.active_pairs.refresh();
        let context = CollideContext {
            shapes: &self.shapes,
            bodies: &self.bodies,
            solver: &self.solver_bodies,
            broad_phase: &self.broad_phase,
            settings: &self.scaled,
            filters: &self.filters,
            moved: &self.moved_shapes,
            dt,
        };
        let active = self.active_pairs.list();
        let pairs = SharedSlice::new(&mut self.pairs);
        let arbiters = SharedSlice::new(self.arbiters.slots_mut());
        let blocks = active.len().div_ceil(PAIRS_PER_BLOCK);
        self.pool.run(blocks, |block| {
            let mut found = news.block();
            let start = block * PAIRS_PER_BLOCK;
            for &index in &active[start..(start + PAIRS_PER_BLOCK).min(active.len())] {
                // SAFETY: each active pair stands in the list once, and only this block visits it.
                let pair = unsafe { pairs.get_mut(index as usize) };
                // SAFETY: an arbiter belongs to one pair.
                let arbiter = (pair.arbiter != NONE).then(|| unsafe { arbiters.get_mut(pair.arbiter as usize) });
                if let Some(item) = context.collide_pair(index, pair, arbiter) {
                    found.push(item);
                }
            }
        });
    }

    fn pair_key(&self, pair: u32) -> ArbiterKey {
        let [a, b] = self.pairs[pair as usize].shapes.map(|slot| self.shapes[slot as usize].id);
        ArbiterKey::of_shapes(a, b)
    }

    /// Makes the arbiter of a pair that begins to touch.
    fn begin_pair(&mut self, key: ArbiterKey, pair_index: u32, manifold: &Manifold) {
        let pair = &self.pairs[pair_index as usize];
        let [b1, b2] = pair.bodies;
        let [center1, center2] = [b1, b2].map(|body| self.solver_bodies.masses[body as usize].pose());
        let between = center1.relative(&center2);
        let reusable = self.filters.contact.is_none();
        let ids = [self.body_id(b1), self.body_id(b2)];
        let index = match self.arbiters.find(key) {
            None => self.create_arbiter(key, ids[0], ids[1]),
            // The user has made an arbiter under the key of these shapes: it is theirs from now on.
            Some(index) if [self.arbiters.at(index).body1, self.arbiters.at(index).body2] == ids => index,
            Some(_) => return, // a key that was not reserved, in use between other bodies
        };
        self.arbiters.at_mut(index).pair = pair_index;
        let pair = &mut self.pairs[pair_index as usize];
        (pair.arbiter, pair.has_manifold, pair.manifold_pose) = (index, reusable, between);
        let context = ManifoldFrame::new(&self.pairs[pair_index as usize], &self.shapes, &self.bodies);
        let arbiter = self.arbiters.at_mut(index);
        update_contacts(&mut arbiter.data, manifold, &context, self.scaled.contact_break_distance);
        self.mix_shape_materials(index);
    }
}

/// Whether the shapes of a pair overlap in the present poses.
pub(crate) fn shapes_overlap(pair: &Pair, shapes: &[ShapeSlot], bodies: &[Body]) -> bool {
    let [a, b] = pair.shapes.map(|slot| &shapes[slot as usize]);
    let pose = |side: usize, shape: &ShapeSlot| bodies[pair.bodies[side] as usize].pose.mul(&shape.pose);
    let relative = pose(0, a).relative(&pose(1, b));
    let (mut cache, mut manifold) = (pair.cache, Manifold::EMPTY);
    collide(&a.geometry, &b.geometry, &relative, 0.0, &mut cache, &mut manifold);
    !manifold.points().is_empty()
}

impl CollideContext<'_> {
    fn collide_pair(&self, index: u32, pair: &mut Pair, mut arbiter: Option<&mut Arbiter>) -> Option<News> {
        if pair.shapes.iter().any(|&slot| self.moved[slot as usize]) && !self.boxes_overlap(pair) {
            return Some(News::Apart(index));
        }
        let [center1, center2] = pair.bodies.map(|body| self.solver.masses[body as usize].pose());
        let between = center1.relative(&center2);
        if let Some(arbiter) = arbiter.as_mut().filter(|_| pair.conveyor) {
            self.turn_conveyor(pair, &mut arbiter.data);
        }
        if pair.has_manifold && self.may_reuse(pair, &between) {
            if let Some(arbiter) = arbiter.filter(|_| !pair.hardly_turned(center1.rotation)) {
                pair.manifold_rotation = center1.rotation;
                turn_levers(&mut arbiter.data, center1.rotation, center2.rotation);
            }
            return None;
        }
        pair.manifold_rotation = center1.rotation;
        self.collide_anew(index, pair, &between, arbiter)
    }

    /// Surface velocities turn with their bodies.
    fn turn_conveyor(&self, pair: &Pair, data: &mut ContactData) {
        if data.flags & TANGENT_VELOCITY_OVERRIDDEN == 0 {
            let materials = pair.shapes.map(|slot| &self.shapes[slot as usize].material);
            let rotations = pair.bodies.map(|body| self.solver.masses[body as usize].rotation);
            data.tangent_velocity = surface_velocity(materials, rotations);
        }
    }

    /// Whether last time's manifold still holds, or last time's lack of one.
    #[inline(always)]
    fn may_reuse(&self, pair: &Pair, between: &Pose) -> bool {
        if pair.arbiter != NONE {
            return pair.hardly_moved(between);
        }
        let [v1, v2] = pair.bodies.map(|body| self.solver.states[body as usize].linear_velocity);
        pair.still_apart(between, (v2 - v1).length() * self.dt, self.settings.speculative_distance)
    }

    /// Makes a new manifold.
    fn collide_anew(&self, index: u32, pair: &mut Pair, between: &Pose, arbiter: Option<&mut Arbiter>) -> Option<News> {
        let [s1, s2] = pair.shapes.map(|slot| &self.shapes[slot as usize]);
        let [b1, b2] = pair.bodies.map(|body| &self.bodies[body as usize]);
        let relative = b1.pose.relative(&b2.pose);
        let margin = if pair.sensor { 0.0 } else { self.margin(pair, s1, s2) };
        let mut manifold = Manifold::EMPTY;
        let shapes_relative = s1.pose.inverse().mul(&relative.mul(&s2.pose));
        collide(&s1.geometry, &s2.geometry, &shapes_relative, margin, &mut pair.cache, &mut manifold);
        if !self.filters.passes_contact(pair, (self.shapes, self.bodies), &mut manifold) {
            manifold.clear();
        }
        if pair.sensor {
            let overlaps = !manifold.points().is_empty();
            return (overlaps != pair.overlapping).then_some(News::Sensor(index, overlaps));
        }
        let frame = ManifoldFrame::new(pair, self.shapes, self.bodies);
        if let Some(arbiter) = arbiter {
            (pair.has_manifold, pair.manifold_pose) = (self.filters.contact.is_none(), *between);
            update_contacts(&mut arbiter.data, &manifold, &frame, self.settings.contact_break_distance);
            return manifold.points().is_empty().then_some(News::Empty(pair.arbiter));
        }
        pair.has_manifold = manifold.points().is_empty() && self.filters.contact.is_none();
        pair.manifold_pose = *between;
        let key = ArbiterKey::of_shapes(s1.id, s2.id);
        self.begins(pair, &manifold, &frame).then_some(News::Begin(key, index, manifold))
    }

    fn boxes_overlap(&self, pair: &Pair) -> bool {
        let [a, b] = pair.shapes.map(|slot| self.broad_phase.fat_aabb(slot));
        matches!((a, b), (Some(a), Some(b)) if a.overlaps(b))
    }

    /// Gap up to which contacts count: the speculative distance, more for pairs that move fast against each other, but not
    /// more than the smaller shape (past that, continuous collision takes over).
    fn margin(&self, pair: &Pair, s1: &ShapeSlot, s2: &ShapeSlot) -> Real {
        let [v1, v2] = pair.bodies.map(|body| &self.solver.states[body as usize]);
        let closing = (v2.linear_velocity - v1.linear_velocity).length() * self.dt;
        let (r1, r2) = (s1.geometry.inner_radius(), s2.geometry.inner_radius());
        let size = match (r1 > 0.0, r2 > 0.0) {
            (true, true) => min(r1, r2),
            _ => max(r1, r2),
        };
        max(self.settings.speculative_distance, min(closing, size))
    }

    /// Whether a pair without arbiter touches, or closes fast enough to touch within this step.
    fn begins(&self, pair: &Pair, manifold: &Manifold, frame: &ManifoldFrame) -> bool {
        let [(v1, a1), (v2, a2)] =
            pair.bodies.map(|body| (&self.solver.states[body as usize], &self.solver.motions[body as usize]));
        let center = pair.bodies.map(|body| self.solver.masses[body as usize].center);
        manifold.points().iter().any(|point| {
            if point.separation <= 0.0 {
                return true;
            }
            let (at, normal) = (frame.world_point(point.point1), frame.world_direction(point.normal));
            let velocity1 = v1.linear_velocity + v1.angular_velocity.cross(at - center[0]);
            let velocity2 = v2.linear_velocity + v2.angular_velocity.cross(at - center[1]);
            let speed = normal.dot(velocity2 - velocity1) + normal.dot(a2.acceleration - a1.acceleration) * self.dt;
            point.separation + speed * self.dt <= 0.0
        })
    }
}

/// How a manifold in the frame of shape 1 becomes contacts.
struct ManifoldFrame {
    /// Shape 1 in the world.
    shape: Pose,
    body1: Pose,
    body2: Pose,
    center1: Vec3,
    center2: Vec3,
}

impl ManifoldFrame {
    fn new(pair: &Pair, shapes: &[ShapeSlot], bodies: &[Body]) -> Self {
        let [b1, b2] = pair.bodies.map(|body| &bodies[body as usize]);
        Self {
            shape: b1.pose.mul(&shapes[pair.shapes[0] as usize].pose),
            body1: b1.pose,
            body2: b2.pose,
            center1: b1.mass.center,
            center2: b2.mass.center,
        }
    }

    fn world_point(&self, point: Vec3) -> Vec3 {
        self.shape.transform_point(point)
    }

    fn world_direction(&self, direction: Vec3) -> Vec3 {
        self.shape.rotation.rotate(direction)
    }

    fn contact(&self, point: &crate::narrow_phase::ManifoldPoint) -> Contact {
        let normal = self.world_direction(point.normal);
        let local_anchor1 = self.body1.inverse_transform_point(self.world_point(point.point1)) - self.center1;
        let local_anchor2 = self.body2.inverse_transform_point(self.world_point(point.point2())) - self.center2;
        Contact {
            local_anchor1,
            local_anchor2,
            arm1: self.body1.rotation.rotate(local_anchor1),
            arm2: self.body2.rotation.rotate(local_anchor2),
            normal,
            local_normal: self.body1.rotation.inverse_rotate(normal),
            separation: point.separation,
            feature: point.feature,
            ..Contact::default()
        }
    }
}

/// Turns normals and levers to where the bodies have turned.
fn turn_levers(data: &mut ContactData, rotation1: Rotation, rotation2: Rotation) {
    for contact in &mut data.slots {
        contact.arm1 = rotation1.rotate(contact.local_anchor1);
        contact.arm2 = rotation2.rotate(contact.local_anchor2);
        if !contact.world_normal {
            contact.normal = rotation1.rotate(contact.local_normal);
        }
    }
}

/// Replaces the contacts of an arbiter by a new manifold; points that were there before keep their slot and impulses.
///
/// A point is the same when its features are; else when an old one not yet taken is within the break distance.
fn update_contacts(data: &mut ContactData, manifold: &Manifold, frame: &ManifoldFrame, break_distance: Real) {
    let old = data.slots;
    let mut unclaimed = (data.usage_mask & 15) | data.usage_mask >> 4;
    let mut matches = [SLOTS; SLOTS];
    let mut contacts = [Contact::default(); SLOTS];
    let points = manifold.points();
    for (i, point) in points.iter().enumerate() {
        contacts[i] = frame.contact(point);
        if let Some(slot) = (0..SLOTS).find(|&s| unclaimed >> s & 1 == 1 && old[s].feature == point.feature) {
            matches[i] = slot;
            unclaimed &= !(1 << slot);
        }
    }
    for i in 0..points.len() {
        if matches[i] == SLOTS {
            let near = |s: usize| (old[s].local_anchor1 - contacts[i].local_anchor1).length_squared();
            let mut best = break_distance * break_distance;
            for slot in (0..SLOTS).filter(|&s| unclaimed >> s & 1 == 1) {
                if near(slot) < best {
                    best = near(slot);
                    matches[i] = slot;
                }
            }
            if matches[i] < SLOTS {
                unclaimed &= !(1 << matches[i]);
            }
        }
    }
    let mut used: u8 = matches.iter().filter(|&&slot| slot < SLOTS).fold(0, |mask, &slot| mask | 1 << slot);
    for i in 0..points.len() {
        if matches[i] < SLOTS {
            contacts[i].inherit(&old[matches[i]]);
        } else {
            matches[i] = (!used).trailing_zeros() as usize;
            used |= 1 << matches[i];
        }
        data.slots[matches[i]] = contacts[i];
    }
    data.usage_mask = data.usage_mask & 0xf0 | used;
    let one_normal = points.iter().all(|point| point.normal == points[0].normal);
    data.flags = data.flags & !ONE_NORMAL | if one_normal { ONE_NORMAL } else { 0 };
}
