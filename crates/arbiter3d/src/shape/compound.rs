//! Compounds: one shape made of many placed ones.
//!
//! The children are baked once: their boxes into a tree of eight boxes a node (that of meshes), their masses into a sum.
//! A child that is a compound itself is taken apart, so there is never more than one level. Whatever looks for children asks
//! the tree for those near a box or along a ray, so a thousand of them cost little more than the few that are near.

use super::geometry::Geometry;
use super::mass::Moments;
use super::mesh_tree::{Descent, LEAF, MeshTree, Slabs};
use super::ray::{Ray, ShapeHit, cast_ray};
use super::{DrawnSurface, MassProperties, Shape, ShapeError};
use crate::math::{Aabb, Mat3, Pose, Quat, Real, Rotation, Vec3, max};
use crate::simd::{LaneVec3, Lanes};
use glam::DMat3;

/// Compounds of up to so many children have the box around their children, larger ones the box around their box.
const FEW: usize = 8;
/// How far from one the length of a rotation may be.
const UNIT_TOLERANCE: Real = 1e-3;

/// A shape and where it sits in a [`Compound`].
///
/// ```
/// use arbiter3d::{CompoundChild, Shape, math::Vec3};
/// let head = CompoundChild::new(Shape::sphere(0.2)?).at(Vec3::new(0.0, 0.5, 0.0)).with_density_factor(7.8);
/// assert_eq!(head.position.y, 0.5);
/// # Ok::<(), arbiter3d::ShapeError>(())
/// ```
#[derive(Clone, Debug)]
pub struct CompoundChild {
    /// The geometry: anything but a half-space.
    pub shape: Shape,
    /// Where its frame sits in that of the compound, metres.
    pub position: Vec3,
    /// How its frame is turned in that of the compound.
    pub rotation: Quat,
    /// How many times as dense it is as the shape definition says, zero or more. Default 1.
    pub density_factor: Real,
    /// Which of [`ShapeDefinition::palette`](crate::ShapeDefinition::palette) its surface is; the material of the shape
    /// definition for numbers past the palette's end. A mesh, height field or voxel grid with materials of its own keeps
    /// those that are not zero. Default 0.
    pub material: u8,
}

impl CompoundChild {
    /// A shape at the origin of the compound.
    #[must_use]
    pub fn new(shape: Shape) -> Self {
        Self { shape, position: Vec3::ZERO, rotation: Quat::IDENTITY, density_factor: 1.0, material: 0 }
    }

    /// The same, its frame at a position in the compound, metres.
    #[must_use]
    pub fn at(self, position: Vec3) -> Self {
        Self { position, ..self }
    }

    /// The same, turned.
    #[must_use]
    pub fn rotated(self, rotation: Quat) -> Self {
        Self { rotation, ..self }
    }

    /// The same, so many times as dense.
    #[must_use]
    pub fn with_density_factor(self, density_factor: Real) -> Self {
        Self { density_factor, ..self }
    }

    /// The same with another material of the palette.
    #[must_use]
    pub fn with_material(self, material: u8) -> Self {
        Self { material, ..self }
    }

    pub(crate) fn pose(&self) -> Pose {
        Pose::new(self.position, Rotation::from_quat(self.rotation))
    }
}

/// One shape made of many placed ones, for bodies of any kind. It is baked: to change a child, build a new one.
///
/// The whole has one filter and one arbiter with each shape that it meets. Each child may have a material of its own: a
/// hammer with an iron head and a slippery handle is one compound. Where several children touch the same shape, contacts of
/// different materials are solved apart, up to two in an arbiter: that of the deepest contact, and that of the deepest of
/// the others.
///
/// ```
/// use arbiter3d::{CompoundChild, Material, Shape, ShapeDefinition, math::Vec3};
/// let handle = CompoundChild::new(Shape::capsule(0.3, 0.02)?).with_density_factor(0.7).with_material(0);
/// let head = Shape::cuboid(Vec3::new(0.03, 0.03, 0.1))?;
/// let head = CompoundChild::new(head).at(Vec3::Y * 0.3).with_density_factor(7.8).with_material(1);
/// let wood = Material { friction: 0.2, ..Material::default() };
/// let iron = Material { friction: 0.6, restitution: 0.4, ..Material::default() };
/// let hammer = ShapeDefinition::new(Shape::compound(&[handle, head])?).palette(vec![wood, iron]);
/// # Ok::<(), arbiter3d::ShapeError>(())
/// ```
///
/// ```
/// use arbiter3d::{CompoundChild, Shape, math::Vec3};
/// let beam = Shape::cuboid(Vec3::new(1.0, 0.1, 0.1))?;
/// let post = CompoundChild::new(Shape::cuboid(Vec3::new(0.1, 1.0, 0.1))?).at(Vec3::new(0.0, -1.1, 0.0));
/// let letter_t = Shape::compound(&[CompoundChild::new(beam), post])?;
/// assert!((letter_t.mass_properties(1000.0)?.mass - 160.0).abs() < 1e-3);
/// # Ok::<(), arbiter3d::ShapeError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Compound {
    children: Vec<CompoundChild>,
    /// In the order of the tree.
    placed: Vec<PlacedChild>,
    tree: MeshTree,
    unit_mass: Result<MassProperties, ShapeError>,
    inner_ball: (Vec3, Real),
    /// Materials with round children, each with the largest radius of those.
    rounded: Vec<(u8, Real)>,
}

/// Where a child is.
#[derive(Clone, Copy, Debug)]
struct PlacedChild {
    pose: Pose,
    aabb: Aabb,
    child: u32,
}

impl Compound {
    /// Bakes some children; those of children that are compounds take the place of these.
    ///
    /// # Errors
    /// If there is none, one is a half-space, or one has a position, rotation or density factor that makes no sense.
    pub fn new(children: &[CompoundChild]) -> Result<Self, ShapeError> {
        let mut flat = Vec::with_capacity(children.len());
        for (child, given) in children.iter().enumerate() {
            check(child, given)?;
            match &given.shape {
                Shape::Compound(inner) => flat.extend(inner.children.iter().map(|grandchild| {
                    let pose = given.pose().mul(&grandchild.pose());
                    CompoundChild {
                        shape: grandchild.shape.clone(),
                        position: pose.position,
                        rotation: pose.rotation.to_quat(),
                        density_factor: given.density_factor * grandchild.density_factor,
                        material: if grandchild.material == 0 { given.material } else { grandchild.material },
                    }
                })),
                _ => flat.push(given.clone()),
            }
        }
        if flat.is_empty() {
            return Err(ShapeError::NoChildren);
        }
        Ok(Self::bake(flat))
    }

    fn bake(children: Vec<CompoundChild>) -> Self {
        let place = |(child, given): (usize, &CompoundChild)| {
            let pose = given.pose();
            PlacedChild { pose, aabb: given.shape.aabb(&pose), child: child as u32 }
        };
        let unsorted: Vec<PlacedChild> = children.iter().enumerate().map(place).collect();
        let (tree, order) = MeshTree::build(unsorted.iter().map(|placed| placed.aabb));
        let mut inner_ball = (children[0].pose().transform_point(children[0].shape.inner_ball().0), 0.0);
        for child in &children {
            let (center, radius) = child.shape.inner_ball();
            if radius > inner_ball.1 {
                inner_ball = (child.pose().transform_point(center), radius);
            }
        }
        let mut rounded: Vec<(u8, Real)> = Vec::new();
        for child in &children {
            let radius = child.shape.rounding_radius();
            match rounded.iter_mut().find(|(material, _)| *material == child.material) {
                Some((_, largest)) => *largest = max(*largest, radius),
                None if radius > 0.0 => rounded.push((child.material, radius)),
                None => {}
            }
        }
        Self {
            unit_mass: sum_of_masses(&children),
            rounded,
            placed: order.iter().map(|&at| unsorted[at as usize]).collect(),
            children,
            tree,
            inner_ball,
        }
    }

    /// The children as they were baked.
    #[must_use]
    pub fn children(&self) -> &[CompoundChild] {
        &self.children
    }

    /// The largest radius with which children of a material roll.
    pub(crate) fn rounding_of(&self, material: u8) -> Real {
        self.rounded.iter().find(|(of, _)| *of == material).map_or(0.0, |(_, radius)| *radius)
    }

    /// Which material of the palette a child has where its own shape has the material `own`.
    pub(crate) fn child_material(&self, child: usize, own: u8) -> u8 {
        match (own, self.children.get(child)) {
            (0, Some(child)) => child.material,
            _ => own,
        }
    }

    /// The first child along a ray in the frame of the compound, and where the ray meets it.
    #[must_use]
    pub fn cast_ray(&self, ray: &Ray) -> Option<(usize, ShapeHit)> {
        if !(ray.origin.is_finite() && ray.direction.is_finite()) {
            return None;
        }
        let slabs = Slabs::of_point(ray.origin, ray.direction);
        let mut search = ChildSearch { compound: self, ray, slabs, best: None };
        self.tree.descend(ray.max_fraction, &mut search);
        search.best
    }

    /// Calls `visit` with the number, the shape and the pose of each child whose box overlaps `aabb`, always in the same
    /// order.
    pub fn for_each_child<'a>(&'a self, aabb: &Aabb, mut visit: impl FnMut(usize, &'a Shape, &'a Pose)) {
        self.tree.query(aabb, |at| {
            let placed = &self.placed[at];
            if placed.aabb.overlaps(aabb) {
                visit(placed.child as usize, &self.children[placed.child as usize].shape, &placed.pose);
            }
        });
    }

    /// All children after an affine map.
    pub(super) fn transformed(&self, linear: Mat3, translation: Vec3) -> Result<Self, ShapeError> {
        let map = |child: &CompoundChild| {
            let pose = child.pose();
            let turned = linear * pose.rotation.to_mat3();
            let shape = child.shape.transformed(turned, linear * pose.position + translation)?;
            let CompoundChild { density_factor, material, .. } = *child;
            Ok(CompoundChild { density_factor, material, ..CompoundChild::new(shape) })
        };
        self.children.iter().map(map).collect::<Result<Vec<_>, _>>().map(Self::bake)
    }

    /// The surfaces of all children.
    pub(super) fn triangulate(&self, steps: usize) -> DrawnSurface {
        let (mut corners, mut triangles) = (Vec::new(), Vec::new());
        for child in &self.children {
            let (pose, first) = (child.pose(), corners.len() as u32);
            let surface = child.shape.triangulate(steps);
            corners.extend(surface.0.iter().map(|&corner| pose.transform_point(corner)));
            triangles.extend(surface.1.iter().map(|triangle| triangle.map(|corner| corner + first)));
        }
        (corners, triangles)
    }
}

/// The first child along a ray.
struct ChildSearch<'a> {
    compound: &'a Compound,
    ray: &'a Ray,
    slabs: Slabs,
    best: Option<(usize, ShapeHit)>,
}

impl ChildSearch<'_> {
    /// Casts the ray at a child, in the order of the tree. Returns how far is still of interest.
    fn cast_at(&mut self, at: usize, limit: Real) -> Real {
        let placed = &self.compound.placed[at];
        let local = Ray {
            origin: placed.pose.inverse_transform_point(self.ray.origin),
            direction: placed.pose.rotation.inverse_rotate(self.ray.direction),
            max_fraction: limit,
        };
        let number = placed.child as usize;
        let Some(hit) = cast_ray(&self.compound.children[number].shape, &local) else { return limit };
        if self.best.is_none_or(|(child, old)| hit.fraction < old.fraction || child > number) {
            self.best = Some((number, ShapeHit { normal: placed.pose.rotation.rotate(hit.normal), ..hit }));
        }
        hit.fraction
    }
}

impl Descent for ChildSearch<'_> {
    #[inline(always)]
    fn distances<W: Lanes<LEAF>>(&self, low: &LaneVec3<W>, high: &LaneVec3<W>, limit: Real) -> W {
        self.slabs.enter(low, high, limit)
    }

    #[inline(always)]
    fn leaf<W: Lanes<LEAF>>(&mut self, first: usize, count: usize, limit: Real) -> Real {
        let mut limit = limit;
        for at in first..first + count {
            limit = self.cast_at(at, limit);
        }
        limit
    }
}

fn check(child: usize, given: &CompoundChild) -> Result<(), ShapeError> {
    let bad = |what| Err(ShapeError::BadChild { child, what });
    if matches!(given.shape, Shape::HalfSpace(_)) {
        return bad("is a half-space: attach that to the body as a shape of its own");
    }
    if !given.position.is_finite() {
        return bad("has a position that is not finite");
    }
    let off = (given.rotation.length() - 1.0).abs();
    if off.is_nan() || off > UNIT_TOLERANCE {
        return bad("has a rotation that is not of unit length: normalize it");
    }
    if !(given.density_factor >= 0.0 && given.density_factor.is_finite()) {
        return bad("has a density factor that is not a finite number of zero or more");
    }
    Ok(())
}

fn sum_of_masses(children: &[CompoundChild]) -> Result<MassProperties, ShapeError> {
    let mut sum = Moments::default();
    for child in children.iter().filter(|child| child.density_factor > 0.0) {
        let mass = child.shape.mass_properties(child.density_factor)?.transform(&child.pose());
        sum = sum.blend(1.0, &Moments::of(&mass), 1.0);
    }
    let advice = "give a child a density factor above zero";
    sum.unit_mass().ok_or(ShapeError::NoVolume { shape: "the compound", advice })
}

impl Geometry for Compound {
    fn local_aabb(&self) -> Aabb {
        self.tree.around()
    }

    fn aabb(&self, pose: &Pose) -> Aabb {
        if self.children.len() > FEW {
            return self.tree.around().transform(pose);
        }
        let around = |placed: &PlacedChild| self.children[placed.child as usize].shape.aabb(&pose.mul(&placed.pose));
        self.placed.iter().fold(Aabb::EMPTY, |all, placed| all.union(&around(placed)))
    }

    fn mass_properties(&self, density: Real) -> Result<MassProperties, ShapeError> {
        self.unit_mass.clone().map(|mass| mass.scaled(density))
    }

    /// That of the thickest child.
    fn inner_ball(&self) -> (Vec3, Real) {
        self.inner_ball
    }

    fn reach_from(&self, point: Vec3) -> Real {
        let reach = |child: &CompoundChild| child.shape.reach_from(child.pose().inverse_transform_point(point));
        self.children.iter().fold(0.0, |most, child| max(reach(child), most))
    }

    fn cast_ray(&self, ray: &Ray) -> Option<ShapeHit> {
        self.cast_ray(ray).map(|(_, hit)| hit)
    }
}

/// The moments of a cuboid at density one about a point of the axes' directions.
pub(super) fn moments_of_box(half_extents: glam::DVec3, center: glam::DVec3) -> Moments {
    let volume = 8.0 * half_extents.x * half_extents.y * half_extents.z;
    let second = DMat3::from_diagonal(half_extents * half_extents * (volume / 3.0));
    Moments { volume, first: glam::DVec3::ZERO, second }.map(&DMat3::IDENTITY, center)
}
