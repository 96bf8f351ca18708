//! A voxel terrain as a collision system of one's own: no shape, no broad-phase proxy, only contacts.
//!
//! What such a system needs is little:
//! 1. **keys**: one arbiter for each voxel and shape that touch, `(base + voxel, shape)`, where `base` comes from
//!    [`World::reserve_ids`], so that no key clashes with the engine's own;
//! 2. **contacts**: in each step a [`ContactProvider`] looks at the bodies that are awake and registers where they touch
//!    voxels. The engine does the rest: it caches, warm-starts and solves the contacts, raises begin and end, and lets bodies
//!    sleep on them. A sleeping body is not looked at and costs nothing;
//! 3. **changes**: when a voxel is dug out, its arbiters are removed, which wakes what stood on it and nothing else.

use arbiter3d::math::{Pose, Rotation, Vec3};
use arbiter3d::narrow_phase::{Manifold, PairCache, collide};
use arbiter3d::*;
use std::sync::{Arc, PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard};

/// Voxels along x and z; each is a cube of one metre.
const WIDTH: i32 = 64;
/// Voxels along y, as many as a `u32` has bits.
const HEIGHT: i32 = 32;
/// Contacts are told this far ahead of touching, metres.
const MARGIN: f32 = 0.02;

/// A voxel: how many metres its lowest corner lies along x, y and z.
pub type Voxel = [i32; 3];

/// 64 × 64 columns of 32 voxels: bit `y` of a column is set where there is ground.
pub struct Terrain {
    columns: Vec<u32>,
}

impl Terrain {
    /// Ground up to a height, in whole metres up to 32, that depends on the place.
    pub fn new(height: impl Fn(i32, i32) -> u32) -> Self {
        let column = |i: i32| (1_u64 << height(i % WIDTH, i / WIDTH)) - 1;
        Self { columns: (0..WIDTH * WIDTH).map(|i| column(i) as u32).collect() }
    }

    /// Hills of 4 to 16 m behind a wall, the same on every machine: noise of whole numbers, blended by plain arithmetic.
    pub fn hills() -> Self {
        let at_rim = |i: i32| i == 0 || i == WIDTH - 1;
        let hill = |x: i32, z: i32| 4.0 + 9.0 * noise(x, z, 16) + 3.0 * noise(x, z, 5);
        Self::new(|x, z| if at_rim(x) || at_rim(z) { 32 } else { hill(x, z) as u32 })
    }

    /// Where a voxel stands in the numbering of all voxels; `None` outside the terrain.
    fn number(voxel: Voxel) -> Option<usize> {
        let [x, y, z] = voxel;
        let inside = (0..WIDTH).contains(&x) && (0..HEIGHT).contains(&y) && (0..WIDTH).contains(&z);
        inside.then_some(((z * WIDTH + x) * HEIGHT + y) as usize)
    }

    /// Whether there is ground. The world goes on in rock at the sides and below.
    pub fn is_solid(&self, voxel: Voxel) -> bool {
        match Self::number(voxel) {
            Some(number) => self.columns[number / 32] >> (number % 32) & 1 == 1,
            None => voxel[1] < HEIGHT,
        }
    }

    /// Takes a voxel away.
    fn remove(&mut self, voxel: Voxel) {
        if let Some(number) = Self::number(voxel) {
            self.columns[number / 32] &= !(1 << (number % 32));
        }
    }

    /// Height of the ground in a column, metres.
    pub fn ground(&self, x: i32, z: i32) -> i32 {
        (0..HEIGHT).rev().find(|&y| self.is_solid([x, y, z])).map_or(0, |y| y + 1)
    }

    /// Turns a contact normal away from faces that have ground behind them.
    ///
    /// Inside a floor of many voxels there are edges that nobody can feel: a ball that rolls over one is as near to the
    /// edge of the next voxel as to the face below it. A normal with a part towards more ground comes from such an edge;
    /// without that part it is the normal of the open surface. Where little is left, the voxel behind has the contact.
    fn open_normal(&self, voxel: Voxel, normal: Vec3) -> Option<Vec3> {
        let mut open = normal;
        for axis in 0..3 {
            let mut behind = voxel;
            behind[axis] += if normal[axis] > 0.0 { 1 } else { -1 };
            if self.is_solid(behind) {
                open[axis] = 0.0;
            }
        }
        let length = open.length();
        (length > 0.7).then(|| open / length)
    }
}

/// Smooth noise from 0 to 1 on a lattice `spacing` voxels wide.
fn noise(x: i32, z: i32, spacing: i32) -> f32 {
    let corner = |dx: i32, dz: i32| random((x / spacing + dx) as u32, (z / spacing + dz) as u32, spacing as u32);
    let ease = |a: i32| {
        let t = (a % spacing) as f32 / spacing as f32;
        t * t * (3.0 - 2.0 * t)
    };
    let blend = |a: f32, b: f32, t: f32| a + (b - a) * t;
    let (tx, tz) = (ease(x), ease(z));
    blend(blend(corner(0, 0), corner(1, 0), tx), blend(corner(0, 1), corner(1, 1), tx), tz)
}

/// A number from 0 to 1 that belongs to three whole numbers.
pub fn random(a: u32, b: u32, c: u32) -> f32 {
    let mut h = a.wrapping_mul(0x9E37_79B1) ^ b.wrapping_mul(0x85EB_CA77) ^ c.wrapping_mul(0xC2B2_AE3D);
    for _ in 0..2 {
        h = (h ^ h >> 15).wrapping_mul(0x2C1B_3C6D);
        h = (h ^ h >> 12).wrapping_mul(0x297A_2D39);
    }
    (h >> 8) as f32 / 16_777_216.0
}

/// The terrain in the hands of the game and of the collision system at once.
#[derive(Clone)]
pub struct Ground {
    terrain: Arc<RwLock<Terrain>>,
    /// First of the ids reserved for voxels.
    base: u64,
}

impl Ground {
    /// Puts a terrain under a world.
    pub fn add_to(world: &mut World, terrain: Terrain) -> Result<Self, Error> {
        let ids = world.reserve_ids((WIDTH * WIDTH * HEIGHT) as u64)?;
        let ground = Self { terrain: Arc::new(RwLock::new(terrain)), base: ids.start };
        world.add_contact_provider(Box::new(VoxelCollision {
            ground: ground.clone(),
            cube: Shape::cuboid(Vec3::splat(0.5))?,
            found: Vec::new(),
        }));
        Ok(ground)
    }

    /// The terrain, to read.
    pub fn terrain(&self) -> RwLockReadGuard<'_, Terrain> {
        self.terrain.read().unwrap_or_else(PoisonError::into_inner)
    }

    fn terrain_mut(&self) -> RwLockWriteGuard<'_, Terrain> {
        self.terrain.write().unwrap_or_else(PoisonError::into_inner)
    }

    /// First half of the keys of a voxel's arbiters.
    fn key1(&self, voxel: Voxel) -> Option<u64> {
        Terrain::number(voxel).map(|number| self.base + number as u64)
    }

    /// The voxels a body stands on or leans against.
    pub fn voxels_under(&self, world: &World, body: BodyId) -> Vec<Voxel> {
        let number = |arbiter: &Arbiter| (arbiter.key().key1 - self.base) as i32;
        let ours = world.arbiters_of(body).filter(|arbiter| arbiter.body1() == BodyId::WORLD);
        ours.map(number).map(|n| [n / HEIGHT % WIDTH, n % HEIGHT, n / HEIGHT / WIDTH]).collect()
    }

    /// Digs a voxel out: its arbiters end, and what stood on it wakes. Returns how many arbiters that were.
    pub fn dig(&self, world: &mut World, voxel: Voxel) -> Result<usize, Error> {
        self.terrain_mut().remove(voxel);
        let Some(key1) = self.key1(voxel) else { return Ok(0) };
        let of_voxel = world.arbiters_of(BodyId::WORLD).filter(|arbiter| arbiter.key().key1 == key1);
        let arbiters: Vec<ArbiterId> = of_voxel.map(Arbiter::id).collect();
        for &arbiter in &arbiters {
            world.remove_arbiter(arbiter)?;
        }
        Ok(arbiters.len())
    }
}

/// Finds where awake bodies touch voxels.
struct VoxelCollision {
    ground: Ground,
    /// The shape of a voxel, about its centre.
    cube: Shape,
    /// Contacts of this step, gathered first: reading the world ends before writing to it begins.
    found: Vec<(ArbiterKey, BodyId, ContactPoint)>,
}

impl ContactProvider for VoxelCollision {
    fn provide(&mut self, context: &mut StepContext<'_>) {
        let ground = self.ground.clone();
        let terrain = ground.terrain();
        let dt = context.dt();
        for body in context.awake_bodies().filter_map(|id| context.body(id)) {
            for shape in body.shapes().iter().filter_map(|&id| context.shape(id)) {
                self.find(&terrain, &Mover { body, shape, dt });
            }
        }
        for (key, body, contact) in self.found.drain(..) {
            let registered = context.register_contact_by_key(key, BodyId::WORLD, body, contact);
            registered.expect("the key is ours, the points are finite and the normal is of unit length");
        }
    }
}

/// A shape on a body that is awake.
struct Mover<'a> {
    body: BodyRef<'a>,
    shape: ShapeRef<'a>,
    /// Seconds of the step.
    dt: f32,
}

impl Mover<'_> {
    /// How far off a voxel may be to be touched in this step, metres.
    fn reach(&self) -> f32 {
        MARGIN + self.body.linear_velocity().length() * self.dt
    }

    /// How much nearer a point of the body comes in this step to a surface with this normal, metres.
    fn closing(&self, point: Vec3, normal: Vec3) -> f32 {
        (-self.body.velocity_at(point).dot(normal) * self.dt).max(0.0)
    }
}

impl VoxelCollision {
    /// Gathers the contacts of one shape with all voxels that it can reach.
    fn find(&mut self, terrain: &Terrain, mover: &Mover<'_>) {
        let near = mover.shape.aabb().expand(mover.reach());
        let (low, high) = (near.min.floor().as_ivec3(), near.max.floor().as_ivec3());
        for y in low.y..=high.y {
            for z in low.z..=high.z {
                for x in low.x..=high.x {
                    if terrain.is_solid([x, y, z]) {
                        self.touch(terrain, [x, y, z], mover);
                    }
                }
            }
        }
    }

    /// Gathers the contacts of one shape with one voxel.
    fn touch(&mut self, terrain: &Terrain, voxel: Voxel, mover: &Mover<'_>) {
        let Some(key1) = self.ground.key1(voxel) else { return };
        let key = ArbiterKey::new(key1, mover.shape.id().raw());
        let center = Vec3::from_array(voxel.map(|i| i as f32 + 0.5));
        let pose = Pose::from_position(center).relative(&mover.shape.world_pose());
        let mut manifold = Manifold::EMPTY;
        let cache = &mut PairCache::default();
        collide(&self.cube, mover.shape.geometry(), &pose, mover.reach(), cache, &mut manifold);
        for point in manifold.points() {
            let Some(normal) = terrain.open_normal(voxel, point.normal) else { continue };
            let (on_voxel, on_shape) = (center + point.point1, center + point.point2());
            // What is still apart counts only if it comes near enough within this step.
            if (on_shape - on_voxel).dot(normal) <= MARGIN + mover.closing(on_shape, normal) {
                self.found.push((key, mover.body.id(), ContactPoint::new(on_voxel, on_shape, normal)));
            }
        }
    }
}

/// A rain of boxes, balls and capsules over the hills: five layers of a hundred.
pub fn rain(world: &mut World, ground: &Ground) -> Result<Vec<BodyId>, Error> {
    let kinds = [Shape::cuboid(Vec3::new(0.4, 0.3, 0.35))?, Shape::sphere(0.35)?, Shape::capsule(0.3, 0.25)?];
    let mut bodies = Vec::new();
    for i in 0..500_u32 {
        let jitter = |axis| 3.0 * random(i, axis, 7);
        let (x, z) = (10.0 + 4.0 * (i % 10) as f32 + jitter(0), 10.0 + 4.0 * (i / 10 % 10) as f32 + jitter(1));
        let y = ground.terrain().ground(x as i32, z as i32) as f32 + 1.5 + 1.5 * (i / 100) as f32;
        let axis = Vec3::new(random(i, 2, 7) - 0.5, random(i, 3, 7) - 0.5, random(i, 4, 7) - 0.5);
        let tumbled = Rotation::from_xyzw(axis.x, axis.y, axis.z, 0.5).normalize();
        let body = world.add_body(&BodyDefinition::dynamic().at(Vec3::new(x, y, z)).rotated(tumbled.to_quat()))?;
        let shape = ShapeDefinition::new(kinds[i as usize % 3].clone());
        world.add_shape(body, &shape.friction(0.6).rolling_resistance(0.05))?;
        bodies.push(body);
    }
    Ok(bodies)
}
