//! A piece of a shape on its way through a part of a step, with its core.

use super::piece::{Core, Piece};
use super::way::Way;
use crate::math::{Aabb, Pose, Real, Vec3, max, min};
use crate::narrow_phase::{Support, Sweep};
use crate::shape::Sphere;
use crate::world::shapes::ShapeSlot;

/// From this turn on (radians) a shape is swept about its body's centre of mass. Below, about its own middle, which then goes
/// straight: no more than a hundredth of its distance from the centre beside its true arc, and far more easily searched where a
/// shape is small and far out.
const TURN_ABOUT_CENTER: Real = 0.3;

/// Whether some point of a piece's core has moved so far that its surface may have been passed, or `slack` farther. Of a body
/// of many shapes (a tree that falls) most have not.
pub(super) fn is_fast(piece: &Piece<'_>, way: &Way, slack: Real) -> bool {
    let thickness = piece.thickness();
    let middle = piece.place.transform_point(piece.middle());
    let moved = (way.end.transform_point(middle) - way.start.transform_point(middle)).length();
    // After more than half a turn the middle may be back.
    let around = if way.parts > 1 { way.turn.length() * middle.length() } else { 0.0 };
    let moved = moved + around;
    moved > thickness + slack || moved + way.turn.length() * piece.length() > thickness + slack
}

/// A piece of a shape on its way through a part of a step.
#[derive(Clone, Copy)]
pub(super) struct Mover<'a> {
    pub shape: &'a ShapeSlot,
    pub slot: u32,
    pub piece: Piece<'a>,
    pub support: Support<'a>,
    pub path: Sweep,
    /// By how much the core is thinner than the shape.
    thickness: Real,
    pub core: Support<'a>,
    pub core_path: Sweep,
    /// Middle of the core in its frame.
    core_middle: Vec3,
    /// Whether the shape itself is looked at, rather than its core.
    pub whole: bool,
    /// How far a point of what is looked at may bulge out of the chord of its arc.
    bulge: Real,
}

impl<'a> Mover<'a> {
    /// A piece of a shape of a body whose centre frame goes from `start` to `end`; `about_center` has it turn about the centre
    /// of mass in any case.
    pub fn new(
        (shape, slot): (&'a ShapeSlot, u32),
        piece: &Piece<'a>,
        [start, end]: &[Pose; 2],
        about_center: bool,
    ) -> Self {
        let Core { support: core, shift, middle, depth: thickness } = piece.core;
        // A hull's frame may be far from the hull (a part of a tree is given about the tree's foot): it turns about its middle.
        let on_body = &piece.place;
        let pivot = if about_center { on_body.inverse().position } else { shift + middle };
        let path = Sweep { start: start.mul(on_body), end: end.mul(on_body), pivot };
        let core_path = shifted(&path, shift);
        let bulge = bulge(&core, &core_path);
        let (support, piece, core_middle) = (piece.surface, *piece, middle);
        Self { shape, slot, piece, support, path, thickness, core, core_path, core_middle, whole: false, bulge }
    }

    /// The same, of which all counts rather than the core alone.
    pub fn as_whole(self) -> Self {
        Self { whole: true, bulge: bulge(&self.support, &self.path), ..self }
    }

    /// What is looked at, its path and its middle.
    fn seen(&self) -> (&Support<'a>, &Sweep, Vec3) {
        if self.whole {
            let shift = self.path.pivot - self.core_path.pivot;
            (&self.support, &self.path, self.core_middle + shift)
        } else {
            (&self.core, &self.core_path, self.core_middle)
        }
    }

    /// Whether a part of a way turns so much that shapes have to be swept about the centre of mass.
    pub fn turns_much(way: &Way) -> bool {
        way.turn.length() > TURN_ABOUT_CENTER
    }

    /// A core far thinner, and its path: what is left of a shape when its core has been pushed in.
    pub fn spine(&self) -> Option<(Support<'a>, Sweep)> {
        self.piece.spine().map(|spine| (spine.support, shifted(&self.path, spine.shift)))
    }

    /// A small ball in the middle of the core, and its path.
    pub fn middle(&self) -> (Support<'a>, Sweep) {
        let path = shifted(&self.core_path, self.core_middle);
        (Sphere::new(0.1 * self.thickness).map_or(self.core, Support::Sphere), path)
    }

    /// Whether parts of it may come nearer to a plane than its middle does: it turns, and is not a ball.
    pub fn swings(&self) -> bool {
        let (shape, path, _) = self.seen();
        path.start.rotation != path.end.rotation && !matches!(shape, Support::Sphere(_))
    }

    /// The box around all of its way and what is as `near` to it.
    pub fn around(&self, near: Real) -> Aabb {
        let (shape, path, _) = self.seen();
        let ends = shape.bounds(&path.start).union(&shape.bounds(&path.end));
        ends.expand(self.bulge + near + 1e-3 * self.thickness)
    }

    /// Heights of its middle over a plane at the start and at the end.
    pub fn heights(&self, normal: Vec3, on_plane: Vec3) -> [Real; 2] {
        let (_, path, middle) = self.seen();
        [&path.start, &path.end].map(|pose| (pose.transform_point(middle) - on_plane).dot(normal))
    }

    /// Its least height over a plane on its way, given those of its middle at the start and at the end.
    pub fn lowest_over(&self, normal: Vec3, [from, to]: [Real; 2]) -> Real {
        let (shape, path, middle) = self.seen();
        let extent = |pose: &Pose| {
            let down = pose.rotation.inverse_rotate(-normal);
            shape.extent(down) - middle.dot(down)
        };
        min(from - extent(&path.start), to - extent(&path.end)) - self.bulge - 1e-3 * self.thickness
    }

    /// The same seen from a frame that goes from one pose to another.
    pub fn relative_to(&self, [from, to]: &[Pose; 2]) -> Self {
        let seen =
            |path: &Sweep| Sweep { start: from.relative(&path.start), end: to.relative(&path.end), pivot: path.pivot };
        Self { path: seen(&self.path), core_path: seen(&self.core_path), ..*self }
    }
}

/// The path of a frame that sits at `shift` in the frame on a path.
fn shifted(path: &Sweep, shift: Vec3) -> Sweep {
    let shifted = Pose::from_position(shift);
    Sweep { start: path.start.mul(&shifted), end: path.end.mul(&shifted), pivot: path.pivot - shift }
}

/// How far a point of a shape may bulge out of the chord of its arc. At radius `r` and a turn by `θ` that is
/// `r (1 − cos θ/2)`, and the dot product of the two rotations is that cosine.
fn bulge(shape: &Support<'_>, path: &Sweep) -> Real {
    let cosine = path.start.rotation.dot(path.end.rotation).abs();
    let reach = if cosine < 1.0 { shape.reach(path.pivot) - shape.radius() } else { 0.0 };
    if reach > 0.0 { reach * max(1.0 - cosine, 0.0) } else { 0.0 }
}
