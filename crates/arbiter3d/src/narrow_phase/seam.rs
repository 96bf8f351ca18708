//! Seams: contacts with inner edges and faces of what is one surface to the eye.
//!
//! Two boxes side by side make a flat floor, but each of them has four side faces and twelve edges. What slides from one to
//! the other overlaps the second by a hair along the way and by more in height: the least way out is back. That contact is
//! real for the box alone, and none at all for the floor.
//!
//! Given a contact with A (its [`Patch`]) of something that also bears on the surface elsewhere ([`Bearing`]), with `m` the
//! true normal of the surface where it bears, and `t` the part of the contact's normal `n` that is square to `m`: the contact
//! is at a seam if, at each of its points `p`,
//!
//! - just across the seam, at `p + ε t`, the surface of all together is as high as `p` or higher, seen along `m`: `p` is on
//!   it or under it;
//! - on the way into A, at `p − L t` for three lengths `L`, the surface goes on, and is nowhere higher than across.
//!
//! and the contact is not simply with the open surface at `p`, whose normal it then has: what lies in a hollow bears on it
//! with several normals.
//!
//! A contact that leans by little from `m` and reaches into A bears on A: it is no ghost, only its normal is off (a can that
//! lies across the edge of A leaves A soonest with a slight lean). It is straightened: it gets the normal `m`.
//!
//! A wall or a step rises inside A, a fence has points above the floor, behind the ridge of a roof the surface falls: none
//! of these is a seam. A contact whose normal is as near to `m` as that of the bearing is no less true than it and never
//! hidden, so of two contacts at most one goes. All is asked of the shapes by rays, so that it holds for boxes, hulls, meshes,
//! compounds and voxels alike; nothing is remembered from step to step.

use crate::math::{Real, Vec3, max, min, tangents};
use crate::shape::{Ray, ShapeHit};

/// How far across the seam, and how much higher or lower counts as flat, in scales.
const ACROSS: Real = 0.5;
/// How far inside, in scales: near enough for thin fences, far enough for ramps.
const INSIDE: [Real; 3] = [0.1, 1.0, 4.0];
/// Where rays start over what they look for, in scales.
const LIFT: Real = 4.0;
/// What rises by more than this (a sine) from where something bears is no part of the same surface.
const STEEP: Real = 0.4;
/// How far beside a ray that falls into a crack others are cast, in scales.
const BESIDE: Real = 0.01;
/// Points are looked at nearer to their middle by this share: those at the border of two shapes behind belong to both.
const INWARDS: Real = 0.02;
/// A bearing has to lean less than this (its cosine) from the surface that it bears on.
const BEARS: Real = 0.9;
/// A contact that pushes into the surface by more than this (a sine) is never hidden.
const PUSHES_IN: Real = 0.3;
/// A contact that leans by no more than this (a sine) bears if A goes on [`BESIDE_POINT`] scales beyond one of its points, the way
/// it leans: the point is on the face of A, not at its edge.
const LEANS: Real = 0.05;
const BESIDE_POINT: Real = 0.05;
/// How far above a point the open surface that it is on goes on, in scales.
const GOES_ON: Real = 0.05;
/// Normals are as near to the surface's if the squares of their distances differ by no more than this.
const AS_NEAR: Real = 1e-8;

/// A normal is that of the surface if the square of their distance is no more; of points that share a normal one has to be.
const SAME_NORMAL: Real = 1e-9;
/// The others may be off by more: points are given one normal where theirs differ by up to a degree.
const ALIKE: Real = 7e-4;

/// Casts a ray at all of a surface.
pub(crate) type Cast<'a> = &'a dyn Fn(&Ray) -> Option<ShapeHit>;

/// The points of a contact with one normal.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Patch {
    /// On the fixed shape.
    pub points: [Vec3; 4],
    pub count: usize,
    /// Away from the fixed shape.
    pub normal: Vec3,
}

/// A contact with another fixed shape that may carry what a hidden one would have carried.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bearing {
    /// Middle of its points on the fixed shape.
    pub point: Vec3,
    /// Away from the fixed shape.
    pub normal: Vec3,
}

/// What becomes of a contact beside a bearing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Verdict {
    /// It is true as it is.
    Counts,
    /// It is at a seam.
    Hidden,
    /// It bears, with this normal.
    Straightened(Vec3),
}

impl Patch {
    /// What the contact is if there is this bearing on the same surface. `cast` casts rays at all of the surface and `own` at A,
    /// in the frame of the points; `scale` is the length (metres) below which edges are none.
    pub fn beside(&self, bearing: &Bearing, (cast, own): (Cast<'_>, Cast<'_>), scale: Real) -> Verdict {
        if self.is_no_seam(bearing, scale) {
            return Verdict::Counts;
        }
        let Some(m) = surface_normal(bearing, cast, scale) else { return Verdict::Counts };
        let off = |normal: Vec3| (normal - m).length_squared();
        let along = self.normal.dot(m);
        let across = self.normal - m * along;
        let lean = across.length();
        if off(self.normal) <= off(bearing.normal) + AS_NEAR || along < -PUSHES_IN || lean <= 0.0 {
            return Verdict::Counts;
        }
        let across = across * (1.0 / lean);
        if self.is_on_surface(m, cast, scale) || !self.goes_on(bearing, (m, across), cast, scale) {
            return Verdict::Counts;
        }
        let bears = lean <= LEANS && along > 0.0 && self.is_on_face(own, (m, across), scale);
        if bears { Verdict::Straightened(m) } else { Verdict::Hidden }
    }

    /// Whether the surface goes on at each point, across the seam and inwards.
    fn goes_on(&self, bearing: &Bearing, (m, across): (Vec3, Vec3), cast: Cast<'_>, scale: Real) -> bool {
        let middle = self.middle();
        let flat = ACROSS * scale;
        self.points[..self.count].iter().all(|&point| {
            let point = point + (middle - point) * INWARDS;
            let lift = LIFT * scale + max((bearing.point - point).dot(m), 0.0);
            let Some(there) = height(cast, point + across * flat, m, (lift, flat)) else { return false };
            INSIDE.iter().all(|&inside| {
                let here = height(cast, point - across * (inside * scale), m, (lift, lift));
                here.is_some_and(|here| here < lift && here <= there + flat)
            })
        })
    }

    /// Whether A goes on level beyond a point, the way the contact leans.
    fn is_on_face(&self, own: Cast<'_>, (m, across): (Vec3, Vec3), scale: Real) -> bool {
        self.points[..self.count].iter().any(|&point| {
            let origin = point + across * (BESIDE_POINT * scale) + m * scale;
            let hit = own(&Ray { origin, direction: -m, max_fraction: 2.0 * scale });
            hit.is_some_and(|hit| hit.normal.dot(m) > BEARS && (hit.fraction - scale).abs() < LEANS * scale)
        })
    }
}

impl Patch {
    /// The middle of the points.
    fn middle(&self) -> Vec3 {
        self.points[..self.count].iter().fold(Vec3::ZERO, |sum, &point| sum + point) / self.count as Real
    }

    /// What this contact says of the surface that it is on.
    pub fn bearing(&self) -> Bearing {
        Bearing { point: self.middle(), normal: self.normal }
    }

    /// Whether the contact is with the open surface itself: what lies in a hollow bears on it with more than one normal, and
    /// all are true. Looked at a little above the points, seen along `up`: there a wall goes on, and a side that another
    /// shape covers does not.
    fn is_on_surface(&self, up: Vec3, cast: Cast<'_>, scale: Real) -> bool {
        let middle = self.middle();
        let mut exact = false;
        let near = self.points[..self.count].iter().all(|&point| {
            let point = point + (middle - point) * INWARDS + up * (GOES_ON * scale);
            let bearing = Bearing { point, normal: self.normal };
            let off = surface_normal(&bearing, cast, scale).map(|normal| (normal - self.normal).length_squared());
            exact |= off.is_some_and(|off| off <= SAME_NORMAL);
            off.is_some_and(|off| off <= ALIKE)
        });
        near && exact
    }

    /// What shows without a ray that it is no seam: the same normal, or a point well above the surface that bears, as those
    /// of a wall are.
    fn is_no_seam(&self, bearing: &Bearing, scale: Real) -> bool {
        let high = |point: &Vec3| {
            let apart = *point - bearing.point;
            let over = apart.dot(bearing.normal) - ACROSS * scale;
            over > 0.0 && over * over > STEEP * STEEP * apart.length_squared()
        };
        (self.normal - bearing.normal).length_squared() <= AS_NEAR || self.points[..self.count].iter().any(high)
    }
}

/// The normal of the surface that a bearing is on, if it bears on it.
fn surface_normal(bearing: &Bearing, cast: Cast<'_>, scale: Real) -> Option<Vec3> {
    let origin = bearing.point + bearing.normal * scale;
    let ray = Ray { origin, direction: -bearing.normal, max_fraction: 2.0 * scale };
    let mut hits = beside(&ray, scale).into_iter().filter_map(|ray| cast(&ray));
    hits.find(|hit| hit.normal.dot(bearing.normal) > BEARS).map(|hit| hit.normal)
}

/// How high a surface is over a point, looked for from `lift` above it (there if it is even higher) to `depth` below.
fn height(cast: Cast<'_>, point: Vec3, up: Vec3, (lift, depth): (Real, Real)) -> Option<Real> {
    let ray = Ray { origin: point + up * lift, direction: -up, max_fraction: lift + depth };
    let mut highest = None;
    for hit in beside(&ray, lift).iter().filter_map(cast) {
        if hit.normal != Vec3::ZERO {
            return Some(lift - hit.fraction);
        }
        // It starts inside, maybe only by rounding: in the floor below a wall.
        highest = Some(lift);
    }
    highest
}

/// A ray and two beside it: rounding leaves cracks between shapes that only touch, and a ray can fall into one.
fn beside(ray: &Ray, scale: Real) -> [Ray; 3] {
    let (t1, t2) = tangents(ray.direction);
    let by = (t1 * 0.8 + t2 * 0.6) * (BESIDE * scale);
    [*ray, Ray { origin: ray.origin + by, ..*ray }, Ray { origin: ray.origin - by, ..*ray }]
}

/// The length below which edges are none: a share of the slop, and of the size of small shapes.
pub(crate) fn scale_of(slop: Real, size: Real) -> Real {
    if size > 0.0 { min(slop, 0.25 * size) } else { slop }
}
