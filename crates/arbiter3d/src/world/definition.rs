//! How bodies and shapes are asked for.

use crate::error::{Error, finite, finite_vec, in_range, unit_rotation, unit_vec};
use crate::math::{Quat, Real, Vec3};
use crate::shape::{MassProperties, Shape};

/// How a body moves.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum BodyKind {
    /// Never moves.
    Static,
    /// Moves at the velocity it is given; nothing pushes it.
    Kinematic,
    /// Moves by forces, contacts and joints.
    #[default]
    Dynamic,
}

/// World axes along or about which a body may not move.
///
/// ```
/// use arbiter3d::LockedAxes;
/// let upright = LockedAxes::ROTATION_X | LockedAxes::ROTATION_Z;
/// assert!(upright.contains(LockedAxes::ROTATION_X) && !upright.contains(LockedAxes::ROTATION));
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct LockedAxes(pub(crate) u8);

impl LockedAxes {
    /// All axes free.
    pub const NONE: Self = Self(0);
    /// No motion along x.
    pub const TRANSLATION_X: Self = Self(1);
    /// No motion along y.
    pub const TRANSLATION_Y: Self = Self(2);
    /// No motion along z.
    pub const TRANSLATION_Z: Self = Self(4);
    /// No motion at all along any axis.
    pub const TRANSLATION: Self = Self(7);
    /// No turning about x.
    pub const ROTATION_X: Self = Self(8);
    /// No turning about y.
    pub const ROTATION_Y: Self = Self(16);
    /// No turning about z.
    pub const ROTATION_Z: Self = Self(32);
    /// No turning at all.
    pub const ROTATION: Self = Self(56);

    /// Whether all axes of `other` are locked.
    #[must_use]
    pub fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// The six locks as bits: translation x, y, z, rotation x, y, z.
    #[must_use]
    pub fn bits(self) -> u8 {
        self.0
    }

    /// 1 for each free axis, 0 for each locked one: (translation, rotation).
    pub(crate) fn free(self) -> (Vec3, Vec3) {
        let free = |bit: u8| if self.0 & bit == 0 { 1.0 } else { 0.0 };
        (Vec3::new(free(1), free(2), free(4)), Vec3::new(free(8), free(16), free(32)))
    }
}

impl std::ops::BitOr for LockedAxes {
    type Output = Self;
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

/// A body to be added to a world. Every field has a default; see the constructors.
///
/// ```
/// use arbiter3d::{BodyDefinition, World, math::Vec3};
/// let mut world = World::default();
/// let falling = BodyDefinition { position: Vec3::new(0.0, 5.0, 0.0), ..BodyDefinition::dynamic() };
/// let body = world.add_body(&falling)?;
/// assert_eq!(world.body(body).unwrap().position().y, 5.0);
/// # Ok::<(), arbiter3d::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct BodyDefinition {
    /// Static, kinematic or dynamic. Default dynamic.
    pub kind: BodyKind,
    /// Origin of the body's frame, metres. Default zero.
    pub position: Vec3,
    /// Unit quaternion from body to world. Default identity.
    pub rotation: Quat,
    /// Velocity of the centre of mass, m/s. Default zero.
    pub linear_velocity: Vec3,
    /// Angular velocity about world axes, rad/s. Default zero.
    pub angular_velocity: Vec3,
    /// Rate at which linear velocity decays, 1/s (0 to 10⁶). Default 0.
    pub linear_damping: Real,
    /// Rate at which angular velocity decays, 1/s (0 to 10⁶). Default 0.
    pub angular_damping: Real,
    /// Multiplies gravity, any finite number. Default 1.
    pub gravity_scale: Real,
    /// World axes on which the body may not move. Default none.
    pub locked_axes: LockedAxes,
    /// Mass, centre and inertia in the body's frame. Default `None`: the sum over the shapes, by their densities.
    pub mass: Option<MassProperties>,
    /// Whether the body may fall asleep. Default true.
    pub can_sleep: bool,
    /// Whether the body starts awake. Default true.
    pub awake: bool,
    /// Whether the body takes part at all. Default true.
    pub enabled: bool,
    /// Whether continuous collision stops the body at static and kinematic shapes when it is fast, and a fast kinematic body
    /// takes along what it would sweep over. Default true.
    pub continuous: bool,
    /// Whether the body is a bullet: when it is fast, it meets dynamic bodies too, other bullets included, and bounces off
    /// within the step, losing no time. Counts while `continuous` is true. A kinematic bullet hits what it sweeps over.
    /// Default false.
    pub bullet: bool,
    /// Yours to use. Default 0.
    pub user_data: u128,
}

impl Default for BodyDefinition {
    fn default() -> Self {
        Self {
            kind: BodyKind::Dynamic,
            position: Vec3::ZERO,
            rotation: Quat::IDENTITY,
            linear_velocity: Vec3::ZERO,
            angular_velocity: Vec3::ZERO,
            linear_damping: 0.0,
            angular_damping: 0.0,
            gravity_scale: 1.0,
            locked_axes: LockedAxes::NONE,
            mass: None,
            can_sleep: true,
            awake: true,
            enabled: true,
            continuous: true,
            bullet: false,
            user_data: 0,
        }
    }
}

impl BodyDefinition {
    /// A dynamic body at the origin.
    #[must_use]
    pub fn dynamic() -> Self {
        Self::default()
    }

    /// A static body at the origin.
    #[must_use]
    pub fn fixed() -> Self {
        Self { kind: BodyKind::Static, ..Self::default() }
    }

    /// A kinematic body at the origin.
    #[must_use]
    pub fn kinematic() -> Self {
        Self { kind: BodyKind::Kinematic, ..Self::default() }
    }

    /// The same at another place, metres.
    #[must_use]
    pub fn at(self, position: Vec3) -> Self {
        Self { position, ..self }
    }

    /// The same turned.
    #[must_use]
    pub fn rotated(self, rotation: Quat) -> Self {
        Self { rotation, ..self }
    }

    /// The same with initial velocities, m/s and rad/s.
    #[must_use]
    pub fn moving(self, linear_velocity: Vec3, angular_velocity: Vec3) -> Self {
        Self { linear_velocity, angular_velocity, ..self }
    }

    pub(crate) fn validate(&self) -> Result<(), Error> {
        finite_vec("position", self.position)?;
        unit_rotation("rotation", self.rotation)?;
        finite_vec("linear_velocity", self.linear_velocity)?;
        finite_vec("angular_velocity", self.angular_velocity)?;
        in_range("linear_damping", self.linear_damping, 0.0, 1e6)?;
        in_range("angular_damping", self.angular_damping, 0.0, 1e6)?;
        finite("gravity_scale", self.gravity_scale)?;
        self.mass.as_ref().map_or(Ok(()), validate_mass)
    }
}

/// Mass and inertia must be those of real matter.
pub(crate) fn validate_mass(mass: &MassProperties) -> Result<(), Error> {
    finite_vec("centre of mass", mass.center)?;
    let good = mass.mass > 0.0 && mass.mass.is_finite() && mass.inertia.inverse().is_some();
    if good { Ok(()) } else { Err(Error::BadMass { mass: mass.mass }) }
}

/// How the numbers of two materials make one.
///
/// When two materials disagree, the later rule in this list holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum CombineRule {
    /// The larger.
    #[default]
    Maximum,
    /// The mean.
    Average,
    /// The square root of the product.
    GeometricMean,
    /// The product.
    Multiply,
    /// The smaller.
    Minimum,
}

impl CombineRule {
    /// One number from two.
    #[must_use]
    pub fn combine(self, a: Real, b: Real) -> Real {
        match self {
            Self::Maximum => crate::math::max(a, b),
            Self::Average => 0.5 * (a + b),
            Self::GeometricMean => (a * b).sqrt(),
            Self::Multiply => a * b,
            Self::Minimum => crate::math::min(a, b),
        }
    }
}

/// What a surface is like.
///
/// ```
/// use arbiter3d::Material;
/// let rubber = Material { friction: 1.0, restitution: 0.8, ..Material::default() };
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Coulomb friction, 0 or more. Default 0.5.
    pub friction: Real,
    /// Share of the approach speed given back, 0 to 1. Default 0.
    pub restitution: Real,
    /// Torque that resists rolling and spinning on the spot, as a share of normal force times radius; 0 or more.
    ///
    /// Default 0.01, a hard rubber ball on a hard floor: it rolls for long, holds on slopes of half a degree, and comes to
    /// rest at last, so that a heap with balls in it can sleep. Counts for round shapes; for polyhedra only where it is set
    /// above this default, with a quarter of the inner radius.
    pub rolling_resistance: Real,
    /// Velocity of the surface in the body's frame, m/s: a conveyor belt. Default zero.
    pub tangent_velocity: Vec3,
    /// Less or more friction along one direction of the surface than across it: skis, tracks, wheels. Default none.
    pub anisotropy: Option<Anisotropy>,
    /// How the frictions of two shapes make one. Default the maximum.
    pub friction_combine: CombineRule,
    /// How the restitutions of two shapes make one. Default the maximum.
    pub restitution_combine: CombineRule,
}

impl Default for Material {
    fn default() -> Self {
        Self {
            friction: 0.5,
            restitution: 0.0,
            rolling_resistance: Self::DEFAULT_ROLLING_RESISTANCE,
            tangent_velocity: Vec3::ZERO,
            anisotropy: None,
            friction_combine: CombineRule::Maximum,
            restitution_combine: CombineRule::Maximum,
        }
    }
}

impl Material {
    /// What [`Material::rolling_resistance`] is by default.
    pub const DEFAULT_ROLLING_RESISTANCE: Real = 0.01;

    pub(crate) fn validate(&self) -> Result<(), Error> {
        in_range("friction", self.friction, 0.0, 1e6)?;
        in_range("restitution", self.restitution, 0.0, 1.0)?;
        in_range("rolling_resistance", self.rolling_resistance, 0.0, 1e6)?;
        finite_vec("tangent_velocity", self.tangent_velocity)?;
        self.anisotropy.map_or(Ok(()), |anisotropy| anisotropy.validated().map(|_| ()))
    }

    /// Whether something of it turns with the body, so that arbiters must follow in each step.
    pub(crate) fn turns(&self) -> bool {
        self.tangent_velocity != Vec3::ZERO || self.anisotropy.is_some()
    }

    /// The same with vectors that are directions at exactly unit length.
    pub(crate) fn normalized(self) -> Self {
        Self { anisotropy: self.anisotropy.and_then(|anisotropy| anisotropy.validated().ok()), ..self }
    }
}

/// Friction that differs along one direction of a surface: an ellipse of friction instead of a circle.
///
/// Across the direction a shape has its [`Material::friction`], as combined with that of the other shape; along it,
/// that times `ratio`. A body slides in the direction in which friction takes most of its motion away: a ski that is
/// pushed at an angle runs straight on. Of two shapes with an anisotropy each, the one with the smaller ratio decides.
/// Spinning on the spot meets the friction across.
///
/// ```
/// use arbiter3d::{Anisotropy, Material, math::Vec3};
/// // A ski along its x axis: friction 0.05 along, 0.5 across.
/// let ski = Material { anisotropy: Some(Anisotropy::new(Vec3::X, 0.1)), ..Material::default() };
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Anisotropy {
    /// Unit vector in the shape's frame; what counts is its part along the surface. Where it stands straight up on the
    /// surface, friction is the same in all directions.
    pub direction: Vec3,
    /// Friction along the direction as a share of that across, 0.001 to 1000.
    pub ratio: Real,
}

impl Anisotropy {
    /// Friction along `direction` (unit vector, shape's frame) is `ratio` times that across.
    #[must_use]
    pub const fn new(direction: Vec3, ratio: Real) -> Self {
        Self { direction, ratio }
    }

    /// The same with an exact unit vector, or what is wrong with it.
    pub(crate) fn validated(self) -> Result<Self, Error> {
        let direction = unit_vec("anisotropy direction", self.direction)?;
        Ok(Self { direction, ratio: in_range("anisotropy ratio", self.ratio, 1e-3, 1e3)? })
    }
}

/// What a shape asks to be told of its arbiters beyond their begin and end, as a set. Nothing costs anything until it
/// is asked for.
///
/// ```
/// use arbiter3d::ContactEvents;
/// let wanted = ContactEvents::HITS | ContactEvents::PERSIST;
/// assert!(wanted.contains(ContactEvents::HITS) && !wanted.contains(ContactEvents::PRE_SOLVE));
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct ContactEvents(pub(crate) u8);

impl ContactEvents {
    /// Begin and end alone.
    pub const NONE: Self = Self(0);
    /// Listeners of [`World::on_pre_solve`](crate::World::on_pre_solve) get the arbiters before each solve. Their
    /// manifolds are made anew in each step.
    pub const PRE_SOLVE: Self = Self(1);
    /// A [`PersistEvent`](crate::PersistEvent) in each step in which an arbiter goes on.
    pub const PERSIST: Self = Self(2);
    /// A [`HitEvent`](crate::HitEvent) when something hits the shape.
    pub const HITS: Self = Self(4);
    /// All of them.
    pub const ALL: Self = Self(7);

    /// Whether everything in `other` is asked for.
    #[must_use]
    pub fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }
}

impl std::ops::BitOr for ContactEvents {
    type Output = Self;
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

/// Which shapes a shape meets.
///
/// Two shapes collide when each one's mask has a category of the other. A shared non-zero group overrules that: positive
/// always collides, negative never.
///
/// ```
/// use arbiter3d::Filter;
/// let debris = Filter { category: 2, mask: !2, ..Filter::default() };
/// assert!(!debris.accepts(&debris) && debris.accepts(&Filter::default()));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Filter {
    /// What this shape is, as bits. Default 1.
    pub category: u64,
    /// What this shape meets, as bits. Default all.
    pub mask: u64,
    /// Overrules the bits for shapes of the same non-zero group. Default 0.
    pub group: i32,
}

impl Default for Filter {
    fn default() -> Self {
        Self { category: 1, mask: u64::MAX, group: 0 }
    }
}

impl Filter {
    /// Whether two shapes with these filters collide.
    #[must_use]
    pub fn accepts(&self, other: &Self) -> bool {
        if self.group != 0 && self.group == other.group {
            return self.group > 0;
        }
        self.mask & other.category != 0 && other.mask & self.category != 0
    }
}

/// A shape to be attached to a body.
///
/// ```
/// use arbiter3d::{BodyDefinition, Shape, ShapeDefinition, World};
/// let mut world = World::default();
/// let body = world.add_body(&BodyDefinition::dynamic())?;
/// let shape = world.add_shape(body, &ShapeDefinition::new(Shape::sphere(0.5)?).density(500.0).friction(0.8))?;
/// # Ok::<(), arbiter3d::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct ShapeDefinition {
    /// The geometry.
    pub shape: Shape,
    /// Where its frame sits on the body, metres. Default zero.
    pub position: Vec3,
    /// How its frame is turned on the body. Default identity.
    pub rotation: Quat,
    /// Mass per volume, kg/m³, 0 or more. Default 1000.
    pub density: Real,
    /// The surface.
    pub material: Material,
    /// Materials of the triangles of a mesh, the cells of a height field or of voxels, the children of a compound, by the
    /// numbers that these were given ([`TriangleMesh::with_materials`](crate::TriangleMesh::with_materials),
    /// [`CompoundChild::with_material`](crate::CompoundChild::with_material), …); `material` for numbers past the end. Where a
    /// body touches two, each contact has the friction and restitution of its own; of more, all but that of the deepest
    /// contact count as the second deepest. Rolling resistance, surface velocity and anisotropy are those of the deepest
    /// contact. Default empty: all of it is of `material`.
    pub palette: Vec<Material>,
    /// Which shapes it meets.
    pub filter: Filter,
    /// Whether it only reports what overlaps it and pushes nothing. Default false.
    pub sensor: bool,
    /// What it asks to be told of its arbiters: the other shape of a pair may ask as well. Default nothing.
    pub events: ContactEvents,
    /// The way in which bodies pass through it, a unit vector in the shape's frame: what comes that way goes through,
    /// what comes the other way stands on it. Default `None`: nothing passes. See [`ShapeDefinition::one_way`].
    pub one_way: Option<Vec3>,
    /// Yours to use. Default 0.
    pub user_data: u128,
}

impl ShapeDefinition {
    /// A shape at the body's origin with density 1000 kg/m³, friction 0.5 and restitution 0.
    #[must_use]
    pub fn new(shape: Shape) -> Self {
        Self {
            shape,
            position: Vec3::ZERO,
            rotation: Quat::IDENTITY,
            density: 1000.0,
            material: Material::default(),
            palette: Vec::new(),
            filter: Filter::default(),
            sensor: false,
            events: ContactEvents::NONE,
            one_way: None,
            user_data: 0,
        }
    }

    /// The same at another place on the body, metres.
    #[must_use]
    pub fn at(self, position: Vec3) -> Self {
        Self { position, ..self }
    }

    /// The same turned on the body.
    #[must_use]
    pub fn rotated(self, rotation: Quat) -> Self {
        Self { rotation, ..self }
    }

    /// The same with another density, kg/m³.
    #[must_use]
    pub fn density(self, density: Real) -> Self {
        Self { density, ..self }
    }

    /// The same with another friction.
    #[must_use]
    pub fn friction(mut self, friction: Real) -> Self {
        self.material.friction = friction;
        self
    }

    /// The same with another restitution.
    #[must_use]
    pub fn restitution(mut self, restitution: Real) -> Self {
        self.material.restitution = restitution;
        self
    }

    /// The same with another rolling resistance.
    #[must_use]
    pub fn rolling_resistance(mut self, rolling_resistance: Real) -> Self {
        self.material.rolling_resistance = rolling_resistance;
        self
    }

    /// The same with another filter.
    #[must_use]
    pub fn filter(self, filter: Filter) -> Self {
        Self { filter, ..self }
    }

    /// The same with materials for the numbers of its triangles, cells or children.
    #[must_use]
    pub fn palette(self, palette: Vec<Material>) -> Self {
        Self { palette, ..self }
    }

    /// The same as a sensor.
    #[must_use]
    pub fn sensor(self) -> Self {
        Self { sensor: true, ..self }
    }

    /// The same with contact events.
    #[must_use]
    pub fn events(self, events: ContactEvents) -> Self {
        Self { events, ..self }
    }

    /// The same as a platform that bodies pass through along `direction` (unit vector, shape's frame) and stand on from
    /// the other side. A body that has begun to pass goes on passing until it is out again, whatever turns it
    /// meanwhile. Characters ([`ShapeMover`](crate::ShapeMover)) pass platforms of convex shape that they are not above.
    #[must_use]
    pub fn one_way(self, direction: Vec3) -> Self {
        Self { one_way: Some(direction), ..self }
    }

    /// The same as a conveyor belt: its surface moves at `velocity`, m/s, in the body's frame.
    #[must_use]
    pub fn tangent_velocity(mut self, velocity: Vec3) -> Self {
        self.material.tangent_velocity = velocity;
        self
    }

    /// The same with friction that differs along `direction` (unit vector, shape's frame): there it is `ratio` times
    /// that across.
    #[must_use]
    pub fn anisotropy(mut self, direction: Vec3, ratio: Real) -> Self {
        self.material.anisotropy = Some(Anisotropy::new(direction, ratio));
        self
    }

    pub(crate) fn validate(&self) -> Result<(), Error> {
        finite_vec("shape position", self.position)?;
        unit_rotation("shape rotation", self.rotation)?;
        in_range("density", self.density, 0.0, 1e12)?;
        self.one_way.map_or(Ok(()), |way| unit_vec("one_way", way).map(|_| ()))?;
        self.palette.iter().try_for_each(Material::validate)?;
        self.material.validate()
    }
}
