//! What of a shape is swept: its convex pieces, each with a core that lies well inside.
//!
//! A convex shape is one piece, a compound or a voxel grid one for each part, a closed mesh one for each triangle: the triangle
//! with its like of the mesh's inner shell, so that hollows stay hollow (`mesh_core`). Open meshes, half-spaces and what has
//! no thickness have none: nothing of them is inside.
//!
//! The core is the shape made thinner by half its inner radius, exactly where that has a simple form: balls, capsules, boxes,
//! cylinders and what is rounded, that is by eroding them. A tapered capsule, which is a row of balls, has the row of half
//! the radii. A cone is eroded but for its tip, of which a tenth is given up at most, or the inner radius if that is more: a
//! spike would lose half of its length. Hulls have eroded corners (`hull_core`), and so have the hulls of points of what is
//! known by support points alone.
//!
//! The *spine* is the same nine tenths of the inner radius below the surface: it is left when a violent step has pushed the
//! core in.

use crate::math::{Pose, Real, Vec3, max, min};
use crate::narrow_phase::Support;
use crate::shape::{Capsule, Cone, Cuboid, Cylinder, InnerShell, Rounded, Shape, Sphere, TaperedCapsule, TriangleMesh};
use crate::world::definition::BodyKind;
use crate::world::shapes::ShapeSlot;

/// Depth of the core, in inner radii.
const CORE: Real = 0.5;
/// Depth of the spine.
const SPINE: Real = 0.9;
/// Share of a cone's height that its core gives up at the tip at most, or the core's depth if that is more.
const TIP: Real = 0.1;

/// What is inside a convex shape at some depth.
#[derive(Clone, Copy)]
pub(super) struct Core<'a> {
    pub support: Support<'a>,
    /// Where its frame sits in the shape's.
    pub shift: Vec3,
    /// Its middle, in its frame.
    pub middle: Vec3,
    /// How far it is from the surface at least.
    pub depth: Real,
}

impl<'a> Core<'a> {
    fn centered(support: Support<'a>, depth: Real) -> Self {
        Self { support, shift: Vec3::ZERO, middle: Vec3::ZERO, depth }
    }

    /// The core at a depth in inner radii; `None` for what has no thickness, or no core of that depth.
    fn of(surface: &Support<'a>, share: Real) -> Option<Self> {
        let points = |core: &'a [Vec3], spine: &'a [Vec3], middle: Vec3, inner: Real| {
            let (points, depth) = if share > CORE { (spine, SPINE * inner) } else { (core, CORE * inner) };
            (inner > 0.0 && !points.is_empty()).then_some(Self {
                support: Support::Points(points),
                shift: Vec3::ZERO,
                middle,
                depth,
            })
        };
        match surface {
            Support::Hull(hull) => points(hull.core(), hull.spine(), hull.centroid(), hull.inner_radius()),
            Support::Cloud(cloud) => cloud.inside().and_then(|i| points(&i.core, &i.spine, i.middle, i.inner_radius)),
            Support::Transformed(s) => s.inside().and_then(|i| points(&i.core, &i.spine, i.middle, i.inner_radius)),
            Support::Custom(s) => s.inside().and_then(|i| points(&i.core, &i.spine, i.middle, i.inner_radius)),
            Support::Rounded(rounded) => Self::of_rounded(rounded, share),
            Support::TaperedCapsule(s) => {
                let keep = 1.0 - share;
                let slim =
                    TaperedCapsule::new(s.half_length(), keep * s.top_radius(), keep * s.bottom_radius()).ok()?;
                let middle =
                    Vec3::Y * if s.top_radius() > s.bottom_radius() { s.half_length() } else { -s.half_length() };
                let depth = share * min(s.top_radius(), s.bottom_radius());
                Some(Self { middle, ..Self::centered(Support::TaperedCapsule(slim), depth) })
            }
            solid => Self::eroded(solid, share * inner_radius(solid)),
        }
    }

    /// A rounded shape loses of its rounding first, then of what is inside.
    fn of_rounded(rounded: &'a Rounded, share: Real) -> Option<Self> {
        let inside = Support::new(rounded.core())?;
        let inner = inside.inner_ball().1;
        let depth = share * (inner + rounded.radius());
        let rest = depth - rounded.radius();
        if rest < 0.0 {
            let middle = rounded.core().inner_ball().0;
            return Some(Self { middle, ..Self::centered(Support::Slim { rounded, radius: -rest }, depth) });
        }
        // Some have a core of fixed depth, which is no less than what is left.
        let core = Self::eroded(&inside, rest).or_else(|| Self::of(&inside, share))?;
        Some(Self { depth, ..core })
    }

    /// The points of a shape of a simple form that are at least at a depth, which is less than its inner radius.
    fn eroded(solid: &Support<'a>, depth: Real) -> Option<Self> {
        let support = match solid {
            Support::Sphere(s) => Support::Sphere(Sphere::new(s.radius() - depth).ok()?),
            Support::Capsule(s) => Support::Capsule(Capsule::new(s.half_length(), s.radius() - depth).ok()?),
            Support::Cuboid(s) => Support::Cuboid(Cuboid::new(s.half_extents() - Vec3::splat(depth)).ok()?),
            Support::Cylinder(s) => Support::Cylinder(Cylinder::new(s.half_length() - depth, s.radius() - depth).ok()?),
            Support::Cone(cone) => return Self::of_cone(cone, depth),
            _ => return None,
        };
        Some(Self::centered(support, depth))
    }

    /// A smaller cone in a cone: its base and its side at least at `depth`, its tip as far as it goes.
    fn of_cone(cone: &Cone, depth: Real) -> Option<Self> {
        let (radius, height) = (cone.radius(), 2.0 * cone.half_length());
        let slant = (radius * radius + height * height).sqrt();
        let drop = min(depth * slant / radius, max(TIP * height, depth));
        let left = height - depth - drop;
        // The side of the base is eroded as it should be; from there to the tip the core comes nearer to the surface.
        let base = (height - depth) * (radius / height) - depth * slant / height;
        let small = Cone::new(0.5 * left, base).ok()?;
        let shift = Vec3::Y * (0.5 * (depth - drop));
        let middle = Vec3::Y * (min(base, 0.25 * left) - 0.5 * left);
        let depth = min(depth, drop * radius / slant);
        Some(Self { support: Support::Cone(small), shift, middle, depth })
    }
}

fn inner_radius(solid: &Support<'_>) -> Real {
    match solid {
        Support::Sphere(s) => s.radius(),
        Support::Capsule(s) => s.radius(),
        Support::Cuboid(s) => s.half_extents().min_element(),
        other => other.inner_ball().1,
    }
}

/// A convex piece of a shape on a body, with its core.
#[derive(Clone, Copy)]
pub(super) struct Piece<'a> {
    pub surface: Support<'a>,
    /// Where its frame sits, seen from the body's centre of mass.
    pub place: Pose,
    pub core: Core<'a>,
}

impl<'a> Piece<'a> {
    fn solid(surface: Support<'a>, place: Pose) -> Option<Self> {
        Some(Self { surface, place, core: Core::of(&surface, CORE)? })
    }

    /// By how much the core is thinner than the shape.
    pub fn thickness(&self) -> Real {
        self.core.depth
    }

    /// A core far thinner than the core.
    pub fn spine(&self) -> Option<Core<'a>> {
        Core::of(&self.surface, SPINE)
    }

    /// Middle of the core in the piece's frame.
    pub fn middle(&self) -> Vec3 {
        self.core.shift + self.core.middle
    }

    /// How far the core reaches out from its middle, beyond a ball of the thickness.
    pub fn length(&self) -> Real {
        match &self.core.support {
            Support::Sphere(_) => 0.0,
            Support::Capsule(s) => s.half_length(),
            support => support.reach(self.core.middle) - self.core.depth,
        }
    }
}

/// Whether a shape may have more than one piece.
pub(super) fn has_pieces(shape: &Shape) -> bool {
    matches!(shape, Shape::Compound(_) | Shape::Voxels(_) | Shape::Mesh(_))
}

/// Calls `visit` with the pieces of a shape.
#[inline]
pub(super) fn each_piece<'a>(slot: &'a ShapeSlot, visit: &mut dyn FnMut(&Piece<'a>)) {
    each_piece_of(&slot.geometry, &slot.from_center, visit);
}

fn each_piece_of<'a>(shape: &'a Shape, place: &Pose, visit: &mut dyn FnMut(&Piece<'a>)) {
    match shape {
        Shape::Compound(compound) => {
            compound.for_each_child(&shape.local_aabb(), |_, child, pose| {
                each_piece_of(child, &place.mul(pose), visit);
            });
        }
        Shape::Voxels(grid) => grid.for_each_box(&shape.local_aabb(), |_, cuboid, center| {
            let place = place.mul(&Pose::from_position(center));
            Piece::solid(Support::Cuboid(cuboid), place).iter().for_each(&mut *visit);
        }),
        Shape::Mesh(mesh) => {
            if let Some(shell) = mesh.inner_shell() {
                each_triangle(mesh, shell, place, visit);
            }
        }
        convex => {
            let piece = Support::new(convex).and_then(|surface| Piece::solid(surface, *place));
            piece.iter().for_each(visit);
        }
    }
}

fn each_triangle<'a>(mesh: &'a TriangleMesh, shell: &'a InnerShell, place: &Pose, visit: &mut dyn FnMut(&Piece<'a>)) {
    let vertices = mesh.vertices();
    for triangle in mesh.triangles() {
        let corners = triangle.map(|vertex| vertices[vertex as usize]);
        let [a, b, c] = triangle.map(|vertex| shell.point(vertex as usize));
        let depth = triangle.iter().fold(Real::MAX, |least, &vertex| min(shell.depth(vertex as usize), least));
        let middle = (a + b + c) * (1.0 / 3.0);
        let core = Core { support: Support::Triangle([a, b, c]), shift: Vec3::ZERO, middle, depth };
        visit(&Piece { surface: Support::Triangle(corners), place: *place, core });
    }
}

/// How far any part of a shape on a body of some kind may move before it has to be swept: the depth of the core of its
/// thinnest piece.
pub(in crate::world) fn depth_on_body(shape: &Shape, kind: BodyKind) -> Real {
    match shape {
        // The shell of what is not swept is not made.
        Shape::Mesh(_) if kind != BodyKind::Dynamic => CORE * shape.inner_radius(),
        _ => least_depth(shape),
    }
}

fn least_depth(shape: &Shape) -> Real {
    match shape {
        Shape::Sphere(_) | Shape::Capsule(_) | Shape::Cuboid(_) | Shape::Hull(_) | Shape::Cylinder(_) => {
            CORE * shape.inner_radius()
        }
        // Sharp ridges would have a mesh swept at every speed.
        Shape::Mesh(mesh) => {
            let least = mesh.inner_shell().map_or(0.0, InnerShell::least_depth);
            max(least, 0.125 * CORE * shape.inner_radius())
        }
        Shape::HalfSpace(_) | Shape::HeightField(_) | Shape::Triangle(_) => 0.0,
        // Its boxes are a cell thick at least.
        Shape::Voxels(grid) => 0.5 * CORE * grid.cell_size(),
        Shape::Compound(compound) => {
            compound.children().iter().fold(Real::MAX, |least, child| min(least_depth(&child.shape), least))
        }
        _ => {
            let mut least = Real::MAX;
            each_piece_of(shape, &Pose::IDENTITY, &mut |piece| least = min(piece.thickness(), least));
            if least < Real::MAX { least } else { 0.0 }
        }
    }
}
