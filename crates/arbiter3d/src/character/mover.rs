//! A shape that is moved through the world by hand: what is around it, how far it comes, what it stands on.
//!
//! The shape keeps a *skin* free between itself and everything else, so that it moves along surfaces without rubbing on
//! them and small errors never make it overlap. All functions are pure questions to the world; none keeps anything.
//!
//! - [`ShapeMover::collect_planes`]: the planes that limit it here, one a contact point.
//! - [`ShapeMover::slide`]: rounds of *collect, solve, cast*. The way to the target is bent to respect all planes
//!   nearby (`planes.rs`), and cast; where the cast meets something new, the mover stops a skin before it, and the next
//!   round knows that plane too. A slope too steep to walk on counts as a wall besides: the mover slides down on it,
//!   but no push from the side brings it up.
//! - [`ShapeMover::recover`]: the shortest way out of what has come too close.
//! - [`ShapeMover::probe_ground`]: what is below, and whether one can stand on it.
//! - [`ShapeMover::step_up`]: up, ahead and down on something higher.
//!
//! A one-way platform is in its way only where a question starts above it.
//!
//! The way of working is that of Quake's player code and of the movers of Box3D, with an exact solver of planes.

use super::planes::{PlaneLimit, solve_planes};
use crate::error::{Error, finite_vec, in_range};
use crate::id::{BodyId, ShapeId};
use crate::math::{Pose, Real, Rotation, Vec3, max, min, normalize_or};
use crate::query::ShapeCast;
use crate::shape::Shape;
use crate::world::{CastHit, Material, QueryFilter, ShapeContacts, ShapeRef, World, stops};

/// Rounds of a slide. Each ends at a new obstacle; three make a corner.
const ROUNDS: usize = 6;

/// Ways shorter than this are not worth a round, metres.
const SHORTEST: Real = 1e-5;

/// Planes farther than this many skins are left to the cast.
const REACH: Real = 1.5;

/// How far above a slope (in skins) it may touch beside an edge and still be the ground.
const TOUCH: Real = 1.5;

/// The skin from top to bottom where the ground is (nearly) a wall, as a multiple of the skin.
const SLANT: Real = 5.0;

/// A plane that limits a mover.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactPlane {
    /// Unit normal, towards the mover, world.
    pub normal: Vec3,
    /// Gap between the mover's shape and the plane, metres; negative where they overlap.
    pub separation: Real,
    /// Where the surface is, world.
    pub point: Vec3,
    /// Body it belongs to.
    pub body: BodyId,
    /// Shape it belongs to.
    pub shape: ShapeId,
}

impl ContactPlane {
    fn overlaps(&self) -> bool {
        self.separation <= 0.0
    }
}

/// What a mover stands on, or would soon.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ground {
    /// The body.
    pub body: BodyId,
    /// The shape.
    pub shape: ShapeId,
    /// Triangle of a mesh, as numbered by the user; `None` where several were close.
    pub triangle: Option<u32>,
    /// What it is made of.
    pub material: Material,
    /// Where it is touched, world.
    pub point: Vec3,
    /// Unit normal there, world.
    pub normal: Vec3,
    /// Velocity of the ground at that point, m/s.
    pub velocity: Vec3,
    /// Angular velocity of the ground, rad/s.
    pub angular_velocity: Vec3,
    /// How far the mover can sink until the ground is a skin away, metres; slightly negative where it is closer.
    pub distance: Real,
    /// Whether one can stand on it: it is no steeper than allowed, or an edge with level ground close below.
    pub walkable: bool,
}

/// How a slide went.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlideResult {
    /// Where it ended.
    pub position: Vec3,
    /// Whether something kept it from its target.
    pub blocked: bool,
}

/// Lists that the questions of a mover fill, kept from one to the next: a character that moves on allocates nothing.
#[derive(Clone, Debug, Default)]
pub(super) struct MoverLists {
    contacts: Vec<ShapeContacts>,
    /// Those of the last [`ShapeMover::planes_at`].
    pub planes: Vec<ContactPlane>,
    pub limits: Vec<PlaneLimit>,
    /// What a slide has met: normal, gap, and where the gap was that.
    met: Vec<(Vec3, Real, Vec3)>,
}

/// A convex shape that stands upright and is moved by hand.
///
/// ```
/// use arbiter3d::{BodyId, Shape, ShapeDefinition, ShapeMover, World, math::Vec3};
/// let mut world = World::default();
/// let wall = ShapeDefinition::new(Shape::cuboid(Vec3::new(0.5, 5.0, 50.0))?);
/// world.add_shape(BodyId::WORLD, &wall.at(Vec3::new(3.0, 0.0, 0.0)))?;
/// let capsule = Shape::capsule(0.5, 0.3)?;
/// let mover = ShapeMover::new(&capsule);
/// // Towards the wall and along it: it ends a skin before the wall, as far along as wanted.
/// let slide = mover.slide(&world, Vec3::ZERO, Vec3::new(4.0, 0.0, 1.0))?;
/// assert!(slide.blocked && slide.position.distance(Vec3::new(2.2 - mover.skin, 0.0, 1.0)) < 1e-3);
/// # Ok::<(), arbiter3d::Error>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct ShapeMover<'a> {
    /// The shape; its y axis points up.
    pub shape: &'a Shape,
    /// Gap that is kept to everything, metres (10⁻⁶ to 10³). Default 0.02.
    pub skin: Real,
    /// Unit vector up. Default +y.
    pub up: Vec3,
    /// Cosine of the steepest slope that can be walked on, −1 to 1. Default that of 50°.
    pub walkable_cosine: Real,
    /// What is in its way. Default everything but sensors.
    pub filter: QueryFilter<'a>,
}

impl<'a> ShapeMover<'a> {
    /// A mover with a skin of 2 cm that walks on slopes of up to 50°, y being up.
    #[must_use]
    pub fn new(shape: &'a Shape) -> Self {
        Self { shape, skin: 0.02, up: Vec3::Y, walkable_cosine: 0.642_787_6, filter: QueryFilter::default() }
    }

    /// The pose of the shape at a position.
    #[must_use]
    pub fn pose(&self, position: Vec3) -> Pose {
        let turned = Vec3::Y.cross(self.up);
        let rotation = if self.up.y > -0.9999 {
            Rotation::from_xyzw(turned.x, turned.y, turned.z, 1.0 + self.up.y).normalize()
        } else {
            Rotation::from_xyzw(1.0, 0.0, 0.0, 0.0)
        };
        Pose::new(position, rotation)
    }

    /// Distance from the origin of the shape down to its lowest point.
    pub(super) fn depth_of_foot(&self) -> Real {
        -self.shape.local_aabb().min.y
    }

    /// Whether a shape that the filter lets through is in the way of the mover at a position.
    fn sees(&self, pose: &Pose, shape: &ShapeRef<'_>) -> bool {
        self.filter.predicate.is_none_or(|accepts| accepts(shape)) && stops(shape, (self.shape, pose))
    }

    /// Where the shape first meets something on a way from a position; what it overlaps, by its planes, does not count.
    fn cast(
        &self,
        world: &World,
        position: Vec3,
        way: Vec3,
        planes: &[ContactPlane],
    ) -> Result<Option<CastHit>, Error> {
        let start = self.pose(position);
        let ignores = |shape: ShapeId| planes.iter().any(|plane| plane.overlaps() && plane.shape == shape);
        let sees = |shape: &ShapeRef<'_>| !ignores(shape.id()) && self.sees(&start, shape);
        let filter = QueryFilter { predicate: Some(&sees), ..self.filter };
        world.cast_shape(&ShapeCast::along(self.shape, start, way), &filter)
    }

    /// Whether a ray first meets something that can be walked on.
    fn is_walkable(&self, world: &World, position: Vec3, (from, way): (Vec3, Vec3)) -> Result<bool, Error> {
        let pose = self.pose(position);
        let sees = |shape: &ShapeRef<'_>| self.sees(&pose, shape);
        let hit = world.cast_ray(from, way, 1.0, &QueryFilter { predicate: Some(&sees), ..self.filter })?;
        Ok(hit.is_some_and(|hit| hit.normal.dot(self.up) >= self.walkable_cosine))
    }

    fn check(&self, position: Vec3) -> Result<(), Error> {
        finite_vec("position of the mover", position)?;
        in_range("skin", self.skin, 1e-6, 1e3)?;
        crate::error::unit_vec("up", self.up)?;
        in_range("walkable_cosine", self.walkable_cosine, -1.0, 1.0).map(|_| ())
    }

    /// Appends the planes closer than `margin` (metres) to the shape at a position, oldest shapes first.
    ///
    /// # Errors
    /// If a number is not finite or out of its range.
    pub fn collect_planes(
        &self,
        world: &World,
        position: Vec3,
        margin: Real,
        planes: &mut Vec<ContactPlane>,
    ) -> Result<(), Error> {
        self.append_planes(world, (position, margin), &mut Vec::new(), planes)
    }

    /// The planes closer than `margin` to the shape at a position, into the lists.
    pub(super) fn planes_at(
        &self,
        world: &World,
        position: Vec3,
        margin: Real,
        lists: &mut MoverLists,
    ) -> Result<(), Error> {
        lists.planes.clear();
        self.append_planes(world, (position, margin), &mut lists.contacts, &mut lists.planes)
    }

    fn append_planes(
        &self,
        world: &World,
        (position, margin): (Vec3, Real),
        found: &mut Vec<ShapeContacts>,
        planes: &mut Vec<ContactPlane>,
    ) -> Result<(), Error> {
        self.check(position)?;
        let pose = self.pose(position);
        let sees = |shape: &ShapeRef<'_>| self.sees(&pose, shape);
        let filter = QueryFilter { predicate: Some(&sees), ..self.filter };
        world.collect_contacts((self.shape, &pose), margin, &filter, found)?;
        for contacts in &*found {
            let (body, shape) = (contacts.body, contacts.shape);
            planes.extend(contacts.manifold.points().iter().map(|point| ContactPlane {
                normal: point.normal,
                separation: point.separation,
                point: point.point1,
                body,
                shape,
            }));
        }
        Ok(())
    }

    /// What a plane allows: to come as close as the skin.
    pub(super) fn limit(&self, normal: Vec3, separation: Real) -> PlaneLimit {
        PlaneLimit { normal, least: min(self.skin - separation, 0.0) }
    }

    /// A wall where a plane is too steep to walk on but leans back.
    pub(super) fn wall(&self, limit: PlaneLimit) -> Option<PlaneLimit> {
        let rise = limit.normal.dot(self.up);
        let level = limit.normal - self.up * rise;
        let length = level.length();
        let steep = rise > 0.0 && rise < self.walkable_cosine - 1e-4 && length > 1e-3;
        steep.then(|| PlaneLimit { normal: level / length, least: limit.least / length })
    }

    /// Moves by a displacement, along what is in the way; stops where no way leads closer to the target.
    ///
    /// # Errors
    /// If a number is not finite or out of its range.
    pub fn slide(&self, world: &World, start: Vec3, displacement: Vec3) -> Result<SlideResult, Error> {
        self.slide_with(world, start, displacement, &mut MoverLists::default())
    }

    /// As [`ShapeMover::slide`], with lists to fill.
    pub(super) fn slide_with(
        &self,
        world: &World,
        start: Vec3,
        displacement: Vec3,
        lists: &mut MoverLists,
    ) -> Result<SlideResult, Error> {
        self.check(start)?;
        let target = finite_vec("target of the mover", start + displacement)?;
        let mut position = start;
        lists.met.clear();
        for _ in 0..ROUNDS {
            if (target - position).length() <= SHORTEST {
                return Ok(SlideResult { position, blocked: false });
            }
            self.planes_at(world, position, self.skin * REACH, lists)?;
            let MoverLists { planes, limits, met, .. } = &mut *lists;
            limits.clear();
            limits.extend(planes.iter().map(|plane| self.limit(plane.normal, plane.separation)));
            limits.extend(met.iter().map(|&(normal, gap, at)| self.limit(normal, gap + (position - at).dot(normal))));
            for index in 0..limits.len() {
                limits.extend(self.wall(limits[index]));
            }
            let way = solve_planes(target - position, limits).vector;
            if way.length() <= SHORTEST {
                break;
            }
            let (moved, hit) = self.advance(world, position, way, planes)?;
            position += moved;
            if let Some(hit) = hit {
                let gap = (way * hit.fraction - moved).dot(-hit.normal);
                met.push((hit.normal, gap, position));
            }
        }
        let blocked = (target - position).length() > SHORTEST;
        Ok(SlideResult { position, blocked })
    }

    /// Goes straight until a skin before what it meets. Shapes it overlaps are left to their planes, for a short way.
    pub(super) fn advance(
        &self,
        world: &World,
        position: Vec3,
        way: Vec3,
        planes: &[ContactPlane],
    ) -> Result<(Vec3, Option<CastHit>), Error> {
        let length = way.length();
        let direction = way / length;
        let length = if planes.iter().any(ContactPlane::overlaps) { min(length, self.skin) } else { length };
        // Look a little farther than the way, so that the skin is kept at its end too.
        let reach = direction * (length + 2.0 * self.skin);
        let Some(hit) = self.cast(world, position, reach, planes)? else { return Ok((direction * length, None)) };
        let approach = max(-direction.dot(hit.normal), 0.05);
        let free = hit.fraction * (length + 2.0 * self.skin) - self.skin / approach;
        if free >= length {
            return Ok((direction * length, None));
        }
        let fraction = hit.fraction * (length + 2.0 * self.skin) / way.length();
        Ok((direction * max(free, 0.0), Some(CastHit { fraction, ..hit })))
    }

    /// The shortest displacement that frees the shape of what is closer than its skin, and whether there is one: caught
    /// between walls that close in, there is none, and the displacement is a compromise. Gaps that miss less than a
    /// twentieth of the skin are left as they are, so that nothing trembles.
    ///
    /// # Errors
    /// If a number is not finite or out of its range.
    pub fn recover(&self, world: &World, position: Vec3) -> Result<(Vec3, bool), Error> {
        self.recover_with(world, position, &mut MoverLists::default())
    }

    /// As [`ShapeMover::recover`], with lists to fill.
    pub(super) fn recover_with(
        &self,
        world: &World,
        position: Vec3,
        lists: &mut MoverLists,
    ) -> Result<(Vec3, bool), Error> {
        let mut total = Vec3::ZERO;
        for _ in 0..4 {
            self.planes_at(world, position + total, self.skin * REACH, lists)?;
            let MoverLists { planes, limits, .. } = &mut *lists;
            if planes.iter().all(|plane| plane.separation >= 0.95 * self.skin) {
                return Ok((total, true));
            }
            limits.clear();
            limits.extend(planes.iter().map(|p| PlaneLimit { normal: p.normal, least: self.skin - p.separation }));
            let solution = solve_planes(Vec3::ZERO, limits);
            total += solution.vector;
            if !solution.satisfied {
                return Ok((total, false));
            }
        }
        Ok((total, true))
    }

    /// The ground no farther than `reach` (metres) below the skin; of what is touched, the part one can stand on best.
    ///
    /// # Errors
    /// If a number is not finite or out of its range.
    pub fn probe_ground(&self, world: &World, position: Vec3, reach: Real) -> Result<Option<Ground>, Error> {
        self.probe_ground_with(world, position, reach, &mut MoverLists::default())
    }

    /// As [`ShapeMover::probe_ground`], with lists to fill.
    pub(super) fn probe_ground_with(
        &self,
        world: &World,
        position: Vec3,
        reach: Real,
        lists: &mut MoverLists,
    ) -> Result<Option<Ground>, Error> {
        self.check(position)?;
        in_range("reach", reach, 0.0, 1e6)?;
        self.planes_at(world, position, self.skin * TOUCH, lists)?;
        let mut best: Option<ContactPlane> = None;
        for &plane in &lists.planes {
            let rise = plane.normal.dot(self.up);
            if rise >= self.walkable_cosine && best.is_none_or(|best| rise > best.normal.dot(self.up)) {
                best = Some(plane);
            }
        }
        if let Some(plane) = best {
            let Some(shape) = world.shape(plane.shape) else { return Ok(None) };
            let distance = (plane.separation - self.skin) / plane.normal.dot(self.up);
            let ground = self.ground(world, (plane.body, plane.shape, plane.point, plane.normal), distance);
            return Ok(ground.map(|ground| Ground { material: shape.material(), walkable: true, ..ground }));
        }
        // On a slant the skin is longer from top to bottom.
        let length = reach + SLANT * self.skin;
        let Some(hit) = self.cast(world, position, self.up * -length, &[])? else { return Ok(None) };
        let slant = min(1.0 / max(hit.normal.dot(self.up), 1e-3), SLANT);
        let distance = hit.fraction * length - (self.skin + hit.depth) * slant;
        if distance > reach {
            return Ok(None);
        }
        let Some(ground) = self.ground(world, (hit.body, hit.shape, hit.point, hit.normal), distance) else {
            return Ok(None);
        };
        let walkable = hit.normal.dot(self.up) >= self.walkable_cosine || self.stands_over(world, position, reach)?;
        Ok(Some(Ground { material: hit.material, triangle: hit.triangle, walkable, ..ground }))
    }

    fn ground(
        &self,
        world: &World,
        (body, shape, point, normal): (BodyId, ShapeId, Vec3, Vec3),
        distance: Real,
    ) -> Option<Ground> {
        let motion = world.body(body)?;
        Some(Ground {
            body,
            shape,
            triangle: None,
            material: Material::default(),
            point,
            normal,
            velocity: motion.velocity_at(point),
            angular_velocity: motion.angular_velocity(),
            distance,
            walkable: false,
        })
    }

    /// Whether straight below the middle is a surface to walk on, no farther than `reach` below the foot, and half as
    /// much more: on stairs whose treads are shorter than its radius a capsule hangs between two edges, higher than the
    /// tread by more than a step.
    fn stands_over(&self, world: &World, position: Vec3, reach: Real) -> Result<bool, Error> {
        let down = self.up * -(self.depth_of_foot() + self.skin + 1.5 * reach);
        self.is_walkable(world, position, (position, down))
    }

    /// Tries to go by a level `displacement` over something up to `height` (metres) high: up, ahead, and down on it.
    /// Gives the new position if what is there can be walked on; the way up ends at ceilings.
    ///
    /// # Errors
    /// If a number is not finite or out of its range.
    pub fn step_up(
        &self,
        world: &World,
        position: Vec3,
        displacement: Vec3,
        height: Real,
    ) -> Result<Option<Vec3>, Error> {
        self.step_up_with(world, position, (displacement, height), &mut MoverLists::default())
    }

    /// As [`ShapeMover::step_up`], with lists to fill.
    pub(super) fn step_up_with(
        &self,
        world: &World,
        position: Vec3,
        (displacement, height): (Vec3, Real),
        lists: &mut MoverLists,
    ) -> Result<Option<Vec3>, Error> {
        self.check(position)?;
        let rise = self.advance(world, position, self.up * max(height, SHORTEST), &[])?.0;
        let room = rise.dot(self.up);
        if room <= self.skin {
            return Ok(None);
        }
        let ahead = self.slide_with(world, position + rise, displacement, lists)?.position;
        // The slide may have changed the height on a slope.
        let fall = max((ahead - position).dot(self.up), 0.0);
        let length = fall + SLANT * self.skin;
        let Some(hit) = self.cast(world, ahead, self.up * -length, &[])? else { return Ok(None) };
        let slant = min(1.0 / max(hit.normal.dot(self.up), 1e-3), SLANT);
        let landing = ahead - self.up * max(hit.fraction * length - self.skin * slant, 0.0);
        let landing = self.raised(world, landing, lists)?;
        // One must come to stand on it, not only against its edge: it is no higher than a step, and there is room
        // above.
        let highest = (position - self.up * (self.depth_of_foot() + self.skin)).dot(self.up) + min(height, room);
        let ahead = normalize_or(displacement, Vec3::ZERO);
        self.planes_at(world, landing, self.skin * REACH, lists)?;
        for plane in &lists.planes {
            let rise = plane.normal.dot(self.up);
            let low = rise > 0.05 && plane.point.dot(self.up) <= highest + 0.1 * self.skin;
            if low && (rise >= self.walkable_cosine || self.top_is_walkable(world, landing, (plane.point, ahead))?) {
                return Ok(Some(landing));
            }
        }
        Ok(None)
    }

    /// A position raised until nothing below is closer than the skin: a cast down keeps it to what it meets first only,
    /// and to be pushed out sideways from the next edge would cost the way just made.
    pub(super) fn raised(&self, world: &World, position: Vec3, lists: &mut MoverLists) -> Result<Vec3, Error> {
        self.planes_at(world, position, self.skin, lists)?;
        let mut lift: Real = 0.0;
        for plane in &lists.planes {
            let rise = plane.normal.dot(self.up);
            if rise > 0.1 {
                lift = max((self.skin - plane.separation) / rise, lift);
            }
        }
        Ok(position + self.up * min(lift, SLANT * self.skin))
    }

    /// Whether the surface just behind an edge can be walked on.
    fn top_is_walkable(&self, world: &World, position: Vec3, (edge, ahead): (Vec3, Vec3)) -> Result<bool, Error> {
        let above = edge + ahead * self.skin + self.up * (2.0 * self.skin);
        self.is_walkable(world, position, (above, self.up * (-4.0 * self.skin)))
    }
}
