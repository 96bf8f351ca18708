//! Shapes on bodies: what the world keeps of them, and how users read and change them.

use super::World;
use super::definition::{BodyKind, ContactEvents, Filter, Material, ShapeDefinition};
use crate::arbiter::{EndReason, NONE};
use crate::broad_phase::TreeKind;
use crate::error::{Error, unit_rotation, unit_vec};
use crate::id::{BodyId, ShapeId};
use crate::math::{Aabb, Pose, Quat, Real, Vec3};
use crate::place_table::mix;
use crate::shape::{Shape, Sphere};
use crate::storage;
use std::sync::Arc;

/// What the world keeps of a shape.
#[derive(Clone, Debug)]
#[repr(C, align(64))] // what the narrow phase reads fills the first cache line
pub(crate) struct ShapeSlot {
    pub geometry: Shape,
    pub id: ShapeId,
    /// Body slot; `NONE` for a free place.
    pub body: u32,
    /// Where the shape's frame sits seen from the body's centre of mass.
    pub from_center: Pose,
    /// Whether that is right at it, with the body's axes.
    pub centered: bool,
    /// Middle of the shape's box, seen from the body's centre of mass in the body's axes.
    pub middle: Vec3,
    /// Distance of the farthest point of the shape from that middle.
    pub reach: Real,
    /// How far it may creep before the broad phase hears of it, but for the limit: an eighth of the radius of its box.
    pub creep: Real,
    pub sensor: bool,
    pub events: ContactEvents,
    /// Where the shape's frame sits on the body.
    pub pose: Pose,
    pub density: Real,
    pub material: Material,
    /// Materials of parts of the surface; empty where all of it is of one.
    pub palette: Option<Arc<[Material]>>,
    pub filter: Filter,
    /// The way in which bodies pass through it, in its frame, of unit length.
    pub one_way: Option<Vec3>,
    pub user_data: u128,
}

impl ShapeSlot {
    /// The material of a part of the surface.
    pub fn surface(&self, index: u8) -> &Material {
        self.palette.as_ref().and_then(|palette| palette.get(index as usize)).unwrap_or(&self.material)
    }

    /// Whether some part of the surface has a restitution.
    #[inline(always)]
    pub fn bounces(&self) -> bool {
        let palette = self.palette.as_deref().unwrap_or_default();
        self.material.restitution > 0.0 || palette.iter().any(|material| material.restitution > 0.0)
    }

    /// Notes where the centre of mass of the body is.
    pub fn set_center(&mut self, center: Vec3) {
        self.from_center = Pose::new(self.pose.position - center, self.pose.rotation);
        self.centered = self.from_center == Pose::IDENTITY;
        self.middle = self.from_center.transform_point(self.geometry.local_aabb().center());
    }
}

/// A shape, to read.
///
/// ```
/// use arbiter3d::{BodyId, Shape, ShapeDefinition, World, math::Vec3};
/// let mut world = World::default();
/// let floor = world.add_shape(BodyId::WORLD, &ShapeDefinition::new(Shape::cuboid(Vec3::new(10.0, 1.0, 10.0))?))?;
/// assert_eq!(world.shape(floor).unwrap().body(), BodyId::WORLD);
/// # Ok::<(), arbiter3d::Error>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct ShapeRef<'a> {
    world: &'a World,
    slot: &'a ShapeSlot,
}

/// A shape, to read and change.
///
/// ```
/// use arbiter3d::{BodyId, Material, Shape, ShapeDefinition, World, math::Vec3};
/// let mut world = World::default();
/// let floor = world.add_shape(BodyId::WORLD, &ShapeDefinition::new(Shape::cuboid(Vec3::new(10.0, 1.0, 10.0))?))?;
/// let ice = Material { friction: 0.0, ..Material::default() };
/// world.shape_mut(floor).unwrap().set_material(ice)?;
/// # Ok::<(), arbiter3d::Error>(())
/// ```
#[derive(Debug)]
pub struct ShapeMut<'a> {
    world: &'a mut World,
    slot: u32,
}

impl<'a> ShapeRef<'a> {
    pub(crate) fn new(world: &'a World, slot: u32) -> Self {
        Self { world, slot: &world.shapes[slot as usize] }
    }

    /// Its id.
    #[must_use]
    pub fn id(&self) -> ShapeId {
        self.slot.id
    }

    /// The body that carries it.
    #[must_use]
    pub fn body(&self) -> BodyId {
        self.world.body_id(self.slot.body)
    }

    /// The geometry.
    #[must_use]
    pub fn geometry(&self) -> &'a Shape {
        &self.slot.geometry
    }

    /// Where its frame sits on the body, metres.
    #[must_use]
    pub fn position(&self) -> Vec3 {
        self.slot.pose.position
    }

    /// How its frame is turned on the body.
    #[must_use]
    pub fn rotation(&self) -> Quat {
        self.slot.pose.rotation.to_quat()
    }

    /// Pose of its frame in the world.
    #[must_use]
    pub fn world_pose(&self) -> Pose {
        self.world.bodies[self.slot.body as usize].pose.mul(&self.slot.pose)
    }

    /// The box around it, world.
    #[must_use]
    pub fn aabb(&self) -> Aabb {
        self.slot.geometry.aabb(&self.world_pose())
    }

    /// Mass per volume, kg/m³.
    #[must_use]
    pub fn density(&self) -> Real {
        self.slot.density
    }

    /// The surface.
    #[must_use]
    pub fn material(&self) -> Material {
        self.slot.material
    }

    /// The materials of its triangles or cells; empty where all of it is of [`ShapeRef::material`].
    #[must_use]
    pub fn palette(&self) -> &'a [Material] {
        self.slot.palette.as_deref().unwrap_or_default()
    }

    /// Which shapes it meets.
    #[must_use]
    pub fn filter(&self) -> Filter {
        self.slot.filter
    }

    /// Whether it only reports overlaps.
    #[must_use]
    pub fn is_sensor(&self) -> bool {
        self.slot.sensor
    }

    /// What it asks to be told of its arbiters.
    #[must_use]
    pub fn events(&self) -> ContactEvents {
        self.slot.events
    }

    /// The way in which bodies pass through it, a unit vector in its frame.
    #[must_use]
    pub fn one_way(&self) -> Option<Vec3> {
        self.slot.one_way
    }

    /// Yours.
    #[must_use]
    pub fn user_data(&self) -> u128 {
        self.slot.user_data
    }
}

impl<'a> ShapeMut<'a> {
    pub(crate) fn new(world: &'a mut World, slot: u32) -> Self {
        Self { world, slot }
    }

    /// The same shape, to read.
    #[must_use]
    pub fn read(&self) -> ShapeRef<'_> {
        ShapeRef::new(self.world, self.slot)
    }

    fn slot(&mut self) -> &mut ShapeSlot {
        &mut self.world.shapes[self.slot as usize]
    }

    /// Changes the surface. Live arbiters of the shape follow in the next step, but for what users have set on them.
    /// Where the surface moves at another speed than before, what touches it wakes.
    ///
    /// # Errors
    /// If a number is not finite or out of its range.
    pub fn set_material(&mut self, material: Material) -> Result<(), Error> {
        material.validate()?;
        let old = std::mem::replace(&mut self.slot().material, material.normalized());
        let body = self.slot().body;
        self.world.refresh_materials_of(body);
        if old.tangent_velocity != material.tangent_velocity {
            // A belt that is switched on carries off what sleeps on it.
            self.world.wake_neighbours(body);
            self.world.wake(body);
        }
        Ok(())
    }

    /// Changes which shapes it meets; arbiters that this rules out end at once, and the bodies wake.
    pub fn set_filter(&mut self, filter: Filter) {
        self.slot().filter = filter;
        self.world.refilter(self.slot);
        self.world.flush_events();
    }

    /// Makes it a sensor or a solid shape; its arbiters end, and the bodies wake.
    pub fn set_sensor(&mut self, sensor: bool) {
        if self.slot().sensor != sensor {
            self.slot().sensor = sensor;
            self.world.sensors = if sensor { self.world.sensors + 1 } else { self.world.sensors - 1 };
            let body = self.slot().body;
            self.world.renew_proxy(self.slot, EndReason::FilterChanged);
            self.world.update_mass(body);
            self.world.flush_events();
        }
    }

    /// Changes what it asks to be told of its arbiters, from the next step on.
    pub fn set_events(&mut self, events: ContactEvents) {
        self.slot().events = events;
        self.world.refresh_traits(self.slot);
    }

    /// Makes it a platform that bodies pass through along a unit vector in its frame, or solid from all sides. What
    /// stands on it goes on standing, what is passing is judged anew.
    ///
    /// # Errors
    /// If the vector is not finite and of unit length.
    pub fn set_one_way(&mut self, one_way: Option<Vec3>) -> Result<(), Error> {
        self.slot().one_way = one_way.map(|way| unit_vec("one_way", way)).transpose()?;
        self.world.refresh_traits(self.slot);
        let body = self.slot().body;
        self.world.forget_manifolds(body);
        self.world.wake(body);
        Ok(())
    }

    /// Changes the density, kg/m³, and with it the mass of the body.
    ///
    /// # Errors
    /// If it is not from 0 to 10¹².
    pub fn set_density(&mut self, density: Real) -> Result<(), Error> {
        self.slot().density = crate::error::in_range("density", density, 0.0, 1e12)?;
        let body = self.slot().body;
        self.world.update_mass(body);
        Ok(())
    }

    /// Sets what is yours.
    pub fn set_user_data(&mut self, user_data: u128) {
        self.slot().user_data = user_data;
    }
}

impl World {
    pub(crate) fn shape_slot(&self, id: ShapeId) -> Result<u32, Error> {
        let found = self.shape_slots.find(mix(0, id.0), |slot| self.shapes[slot as usize].id == id);
        found.ok_or(Error::UnknownShape { id })
    }

    /// Attaches a shape to a body and returns its id. The body's mass follows unless it was given.
    ///
    /// # Errors
    /// If the body is unknown, a number is out of its range, or a shape without a volume (an open mesh, a height field, a
    /// half-space, a triangle) would go on a dynamic body, unless it is a sensor or its density is zero.
    pub fn add_shape(&mut self, body: BodyId, definition: &ShapeDefinition) -> Result<ShapeId, Error> {
        let index = self.body_index(body)?;
        definition.validate()?;
        let rotation = unit_rotation("shape rotation", definition.rotation)?;
        if self.bodies[index as usize].kind == BodyKind::Dynamic && !definition.sensor {
            has_mass(&definition.shape, definition.density)?;
        }
        let id = ShapeId(self.next_id);
        self.next_id += 1;
        let shape = ShapeSlot {
            id,
            body: index,
            pose: Pose::new(definition.position, rotation),
            from_center: Pose::IDENTITY, // `update_mass` tells
            centered: false,
            middle: Vec3::ZERO,
            reach: definition.shape.reach_from(definition.shape.local_aabb().center()),
            creep: 0.125 * definition.shape.local_aabb().half_extents().length(),
            geometry: definition.shape.clone(),
            density: definition.density,
            material: definition.material.normalized(),
            palette: (!definition.palette.is_empty())
                .then(|| definition.palette.iter().map(|m| m.normalized()).collect()),
            filter: definition.filter,
            sensor: definition.sensor,
            events: definition.events,
            one_way: definition.one_way.map(|way| way / way.length()),
            user_data: definition.user_data,
        };
        let slot = if let Some(slot) = self.free_shapes.pop() {
            self.shapes[slot as usize] = shape;
            slot
        } else {
            storage::push(&mut self.shapes, shape);
            self.moved_shapes.push(false);
            (self.shapes.len() - 1) as u32
        };
        self.sensors += u32::from(definition.sensor);
        let shapes = &self.shapes;
        self.shape_slots.insert(mix(0, id.0), slot, |slot| mix(0, shapes[slot as usize].id.0));
        let owner = &mut self.bodies[index as usize];
        if owner.shapes.is_empty() {
            // Most bodies have one shape: without this, room for four.
            owner.shapes.reserve_exact(1);
            owner.shape_slots.reserve_exact(1);
        }
        owner.shapes.push(id);
        owner.shape_slots.push(slot);
        if owner.enabled {
            self.add_proxy(slot);
        }
        self.update_mass(index);
        // A body that was added asleep sleeps on with its first shape; later ones change what rests on what.
        let body = &self.bodies[index as usize];
        if body.awake || body.shapes.len() > 1 {
            self.wake(index);
        }
        Ok(id)
    }

    /// Removes a shape; its arbiters end, and what touched it wakes.
    ///
    /// # Errors
    /// If the shape is unknown.
    pub fn remove_shape(&mut self, id: ShapeId) -> Result<(), Error> {
        let slot = self.shape_slot(id)?;
        let body = self.shapes[slot as usize].body;
        self.drop_shape(slot, EndReason::ShapeRemoved);
        let owner = &mut self.bodies[body as usize];
        owner.shapes.retain(|&other| other != id);
        owner.shape_slots.retain(|&other| other != slot);
        self.update_mass(body);
        self.wake(body);
        self.flush_events();
        Ok(())
    }

    /// Frees the place of a shape; the body's lists are the caller's to mend.
    pub(crate) fn drop_shape(&mut self, slot: u32, reason: EndReason) {
        self.remove_proxy(slot, reason);
        let shapes = &self.shapes;
        let hash = |slot: u32| mix(0, shapes[slot as usize].id.0);
        self.shape_slots.remove(hash(slot), slot, hash);
        let shape = &mut self.shapes[slot as usize];
        shape.body = NONE;
        // A hull or a mesh is let go of now, not when the place is taken again.
        shape.geometry = Shape::Sphere(Sphere::UNIT);
        self.sensors -= u32::from(shape.sensor);
        self.free_shapes.push(slot);
    }

    /// Checks that all shapes of a body may be carried by a dynamic one.
    pub(crate) fn check_dynamic(&self, body: u32) -> Result<(), Error> {
        let shapes = self.bodies[body as usize].shape_slots.iter().map(|&slot| &self.shapes[slot as usize]);
        shapes.filter(|shape| !shape.sensor).try_for_each(|shape| has_mass(&shape.geometry, shape.density))
    }

    /// Box of a shape now.
    pub(crate) fn tight_aabb(&self, slot: u32) -> Aabb {
        let shape = &self.shapes[slot as usize];
        shape.geometry.aabb(&self.bodies[shape.body as usize].pose.mul(&shape.pose))
    }

    /// Box that a shape may move in before the broad phase hears of it: 12.5 % of its radius, at most 5 cm, beyond the
    /// speculative distance.
    pub(crate) fn fat_margin(&self, slot: u32) -> Real {
        let shape = &self.shapes[slot as usize];
        let settings = &self.scaled;
        let still = self.bodies[shape.body as usize].kind == BodyKind::Static;
        let creep = if still { 0.0 } else { crate::math::min(shape.creep, 2.5 * settings.speculative_distance) };
        settings.speculative_distance + creep
    }

    pub(crate) fn add_proxy(&mut self, slot: u32) {
        let fat = self.tight_aabb(slot).expand(self.fat_margin(slot));
        let kind = match self.bodies[self.shapes[slot as usize].body as usize].kind {
            BodyKind::Static => TreeKind::Static,
            BodyKind::Kinematic | BodyKind::Dynamic => TreeKind::Moving,
        };
        self.broad_phase.add(slot, kind, fat);
        self.note_still(slot);
    }

    /// Takes a shape out of the broad phase with all its pairs.
    pub(crate) fn remove_proxy(&mut self, slot: u32, reason: EndReason) {
        let body = self.shapes[slot as usize].body;
        let pairs: Vec<u32> =
            self.pairs_of_body(body).filter(|&pair| self.pairs[pair as usize].has_shape(slot)).collect();
        for pair in pairs {
            self.remove_pair(pair, reason);
        }
        self.broad_phase.remove(slot);
    }

    /// Ends the pairs of a shape that its filter no longer lets be, and finds those that it lets be now.
    fn refilter(&mut self, slot: u32) {
        let body = self.shapes[slot as usize].body;
        let ruled_out = |pair: &u32| {
            let [a, b] = self.pairs[*pair as usize].shapes;
            (a == slot || b == slot) && !self.may_pair(a, b)
        };
        let pairs: Vec<u32> = self.pairs_of_body(body).filter(ruled_out).collect();
        for pair in pairs {
            self.remove_pair(pair, EndReason::FilterChanged);
        }
        self.broad_phase.touch(slot);
        self.note_still(slot);
        self.wake(body);
    }

    /// Finds the pairs of a shape anew.
    pub(crate) fn renew_proxy(&mut self, slot: u32, reason: EndReason) {
        let body = self.shapes[slot as usize].body;
        self.remove_proxy(slot, reason);
        if self.bodies[body as usize].enabled {
            self.add_proxy(slot);
        }
        self.wake(body);
    }
}

/// A shape that is to give a dynamic body a mass must have a volume.
fn has_mass(shape: &Shape, density: Real) -> Result<(), Error> {
    if density > 0.0 {
        shape.mass_properties(density)?;
    }
    Ok(())
}
