//! Sensors: shapes that report who overlaps them, and push nobody.
//!
//! A sensor sees the shapes of bodies of every kind, awake or asleep, but for those of its own body and other sensors.
//! It has a broad-phase pair with each shape near it. Pairs with an awake body are tested in each step, with the
//! others. The rest changes only by what users do: such a pair is tested once in the step after it was made or one of
//! its bodies was placed elsewhere, which wakes nobody.
//!
//! The search for pairs leaves out those of two static shapes: they would be all that a level is made of. Those of a
//! static sensor and a static shape are found here, when either comes or moves.

use super::World;
use super::definition::BodyKind;
use super::events::SensorEvent;
use crate::arbiter::ArbiterKey;
use crate::id::ShapeId;
use crate::narrow_phase::{Manifold, collide_on};
use crate::storage;

impl World {
    /// Shapes inside a sensor now, by id; those that sleep included. Empty for a shape that is no sensor.
    ///
    /// It is the state as of the last step: what has been added or moved since then counts from the next one on.
    ///
    /// ```
    /// use arbiter3d::{BodyDefinition, Shape, ShapeDefinition, World};
    /// let mut world = World::default();
    /// let gate = world.add_body(&BodyDefinition::fixed())?;
    /// let gate = world.add_shape(gate, &ShapeDefinition::new(Shape::sphere(2.0)?).sensor())?;
    /// let ball = world.add_body(&BodyDefinition::dynamic())?;
    /// let ball = world.add_shape(ball, &ShapeDefinition::new(Shape::sphere(0.5)?))?;
    /// world.step(1.0 / 60.0)?;
    /// assert_eq!(world.sensor_visitors(gate), [ball]);
    /// # Ok::<(), arbiter3d::Error>(())
    /// ```
    #[must_use]
    pub fn sensor_visitors(&self, sensor: ShapeId) -> Vec<ShapeId> {
        let Ok(slot) = self.shape_slot(sensor) else { return Vec::new() };
        if !self.shapes[slot as usize].sensor {
            return Vec::new();
        }
        let mut inside: Vec<ShapeId> = self
            .pairs_of_body(self.shapes[slot as usize].body)
            .map(|index| &self.pairs[index as usize])
            .filter(|pair| pair.overlapping && pair.has_shape(slot))
            .map(|pair| self.shapes[pair.shapes[usize::from(pair.shapes[0] == slot)] as usize].id)
            .collect();
        inside.sort_unstable();
        inside
    }

    /// Notes that shapes overlap a sensor, or no longer do.
    pub(crate) fn set_sensor_overlap(&mut self, pair_index: u32, begin: bool) {
        let pair = &mut self.pairs[pair_index as usize];
        pair.overlapping = begin;
        let [a, b] = pair.shapes.map(|slot| &self.shapes[slot as usize]);
        let (sensor, visitor) = if a.sensor { (a.id, b.id) } else { (b.id, a.id) };
        storage::push(&mut self.events.sensor.events, SensorEvent { sensor, visitor, begin });
    }

    /// A proxy has come or moved: if it is static, the next search looks for static sensors and what they see.
    pub(crate) fn note_still(&mut self, slot: u32) {
        let body = self.shapes[slot as usize].body;
        if self.bodies.get(body as usize).is_some_and(|body| body.kind == BodyKind::Static) {
            storage::push(&mut self.still_news, slot);
        }
    }

    /// Adds to a sorted list of new pairs those of a static sensor and a static shape of which one has come or moved.
    pub(crate) fn find_still_sensors(&mut self, found: &mut Vec<(u32, u32)>) {
        let mut news = std::mem::take(&mut self.still_news);
        let first = found.len();
        if self.sensors > 0 {
            for &slot in &news {
                let shape = &self.shapes[slot as usize];
                let Some(near) = self.broad_phase.fat_aabb(slot) else { continue };
                self.broad_phase.query_static(near, |other| {
                    let pair = if slot < other { (slot, other) } else { (other, slot) };
                    let is_new = slot != other
                        && shape.sensor != self.shapes[other as usize].sensor
                        && self.may_pair(pair.0, pair.1)
                        && !self.pair_set.contains(pair.0, pair.1);
                    if is_new {
                        found.push(pair);
                    }
                });
            }
        }
        if found.len() > first {
            found.sort_unstable();
            found.dedup();
        }
        news.clear();
        self.still_news = news;
    }

    /// Tests the pairs of sensors that have to be looked at though their bodies rest; appends what has changed.
    pub(crate) fn test_resting_sensors(&mut self, changes: &mut Vec<(u32, bool)>) {
        let mut list = std::mem::take(&mut self.resting_sensors);
        list.sort_unstable();
        list.dedup();
        for &index in &list {
            let pair = &self.pairs[index as usize];
            if pair.alive && pair.sensor && !pair.active {
                let overlaps = self.overlaps_now(index);
                if overlaps != pair.overlapping {
                    changes.push((index, overlaps));
                }
            }
        }
        list.clear();
        self.resting_sensors = list;
    }

    /// Whether the shapes of a pair overlap in the present poses, as the narrow phase would find it.
    fn overlaps_now(&self, index: u32) -> bool {
        let pair = &self.pairs[index as usize];
        let [a, b] = pair.shapes.map(|slot| &self.shapes[slot as usize]);
        let [pose_a, pose_b] = [a, b].map(|shape| self.bodies[shape.body as usize].pose.mul(&shape.pose));
        let (mut cache, mut manifold) = (pair.cache, Manifold::EMPTY);
        let shapes = (&a.geometry, &b.geometry);
        collide_on(self.level, shapes, &pose_a.relative(&pose_b), 0.0, (&mut cache, &mut manifold));
        self.filters.passes_contact(pair, (&self.shapes, &self.bodies), &mut manifold) && !manifold.points().is_empty()
    }

    /// The key that the events of a pair are sorted by.
    pub(crate) fn pair_key(&self, pair: u32) -> ArbiterKey {
        let [a, b] = self.pairs[pair as usize].shapes.map(|slot| self.shapes[slot as usize].id);
        ArbiterKey::of_shapes(a, b)
    }
}
