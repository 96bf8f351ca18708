//! Convex shapes known by their support and their features: cylinders, cones, tapered capsules, triangles, clouds, rounded
//! and transformed shapes, and those of the user's own, against each other and against every other convex shape.
//!
//! The closest points of the cores (`distance`), or where these overlap the least way out (`penetration`), give the normal and
//! the separation. Then each shape tells what of it lies most along the normal: a face, a line or a point. Both are seen
//! along the normal, as figures in the plane square to it: where they overlap, the gap between the two surfaces along the
//! normal is the difference of two linear heights, and its corners make the manifold. The closest point itself is added
//! where the corners miss it. So a can stands on four points of its rim, rolls on a line, and balances on a point.
//!
//! A solid that touches with an edge may have another face that looks more along the normal, and two solids that meet edge to
//! edge show faces that do not overlap at all. So where the features leave no more than one point, those edges of both that
//! lie most level to the normal are tried as well, against the features and against each other.
//!
//! Nothing in this prefers one of the two shapes: with roles exchanged, the same points come out, mirrored.
//!
//! Features are placed in `f64` and looked at from the touching point, so that a pebble on a hall keeps its height.

use super::clip::{ClipPoint, choose_four, clip_polygon};
use super::nearest::{Nearest, nearest};
use super::{Manifold, ManifoldPoint};
use crate::math::{Pose, Real, Vec3, clamp, max, min, tangents};
use crate::shape::Support;
use crate::shape::distance::Placed;
use crate::shape::{FEATURE_POINTS, Feature, Shape};
use glam::{DMat3, DVec3};

/// Lines whose angle has a sine below this are parallel: two points.
const PARALLEL_SINE: Real = 0.05;
/// But only as far as they lie side by side, seen along the normal, by less than this share of the smaller size.
const ASIDE: Real = 0.04;
/// The corners miss the closest point if they are all farther by this share of the smaller size.
pub(super) const MISSED: Real = 1e-4;
/// A corner as near as the closest point but for this share of the smaller size counts whatever the margin: rounding.
const LEVEL: Real = 1e-5;
/// Corners count as equally deep within this share of what [`choose_four`] takes for it: what leans by a thousandth stands on
/// its lowest corner.
pub(super) const EQUALLY_DEEP: Real = 0.05;
/// A face's normal is taken for that of the contact if it is off by no more (half a degree), and if along it the shapes are no
/// deeper than they are by this share of the smaller size.
const FLAT_COSINE: f64 = 0.99996;
const AS_GOOD: Real = 2e-5;
/// How far overlapping shapes are moved beyond touching to see where they touch, as a share of the smaller size.
const LIFT: f64 = 1e-3;
/// Corners of two features clipped by each other at most.
const CLIPPED: usize = 2 * FEATURE_POINTS;
/// The feature number of a closest point that no corner stands for.
pub(super) const WITNESS: u32 = 0x7FFF_FFFF;

/// Contacts of two convex shapes of any kind; nothing for others.
pub(crate) fn collide((shape1, shape2): (&Shape, &Shape), pose: &Pose, margin: Real, manifold: &mut Manifold) {
    manifold.clear();
    let (Some(support1), Some(support2)) = (Support::new(shape1), Support::new(shape2)) else { return };
    let placed = Placed::new(&support1, &support2, pose);
    let Some(mut touch) = Touch::find(&placed, margin) else { return };
    let size = min(support1.size(), support2.size());
    let nearest = touch;
    let mut features = Features::along(touch.normal, (&support1, &support2), pose);
    touch.lean_on_face(&placed, (&features.first, &features.second), size);
    if touch.separation > margin {
        return;
    }
    let leant = touch.normal != nearest.normal;
    if leant {
        features = Features::along(touch.normal, (&support1, &support2), pose);
    }
    let mut patch = touch.widest_patch(&placed, &features, (margin, size), leant);
    if leant && patch.count == 0 {
        // What is lowest over the face is beside it: an edge of the face touches, along the normal that was found.
        touch = nearest;
        features = Features::along(touch.normal, (&support1, &support2), pose);
        patch = touch.widest_patch(&placed, &features, (margin, size), false);
    }
    touch.hand_on(&placed, &patch, size, manifold);
}

/// What of two shapes lies most along a normal, each in its own frame.
struct Features<'a> {
    first: Feature,
    second: Feature,
    supports: (&'a Support<'a>, &'a Support<'a>),
    /// Towards shape 1 in the frame of shape 2.
    normals: [Vec3; 2],
}

impl<'a> Features<'a> {
    fn along(normal: Vec3, supports: (&'a Support<'a>, &'a Support<'a>), pose: &Pose) -> Self {
        let normals = [normal, -pose.rotation.inverse_rotate(normal)];
        let (mut first, mut second) = (Feature::default(), Feature::default());
        supports.0.feature(normals[0], &mut first);
        supports.1.feature(normals[1], &mut second);
        Self { first, second, supports, normals }
    }

    /// The edges that lie most level to the normal.
    fn edges(&self) -> (Feature, Feature) {
        let (mut first, mut second) = (Feature::default(), Feature::default());
        self.supports.0.edge(self.normals[0], &mut first);
        self.supports.1.edge(self.normals[1], &mut second);
        (first, second)
    }
}

/// Where the figures of two features overlap within the margin.
pub(super) struct Patch {
    corners: [ClipPoint; CLIPPED],
    count: usize,
    /// The least separation of the corners.
    lowest: Real,
}

/// The nearest points of two shapes, or the deepest ones.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Touch {
    /// On the surface of shape 1, in its frame.
    pub point1: DVec3,
    /// Unit vector from shape 1 to shape 2.
    pub normal: Vec3,
    /// Gap, metres; negative where the shapes overlap.
    pub separation: Real,
}

impl Touch {
    /// `None` if the shapes are apart by more than `margin`.
    pub(super) fn find(placed: &Placed<'_>, margin: Real) -> Option<Self> {
        let [radius1, radius2] = placed.radii();
        // A hair beyond what rounding may make of the separation.
        let limit = (radius1 + radius2 + f64::from(margin)) * (1.0 + 1e-6);
        let Nearest { point1, normal, distance } = nearest(placed, limit)?;
        let separation = (distance - radius1 - radius2) as Real;
        let point1 = point1 + normal * radius1;
        (separation <= margin).then_some(Self { point1, normal: normal.as_vec3(), separation })
    }

    /// Takes the normal of a face for that of the contact, where it tells about the same: search and rounding leave the normal
    /// of shapes that lie flat on each other a little off, and of an edge along a face there are many almost as good.
    fn lean_on_face(&mut self, placed: &Placed<'_>, (feature1, feature2): (&Feature, &Feature), size: Real) {
        let [radius1, radius2] = placed.radii();
        let here = self.normal.as_dvec3();
        let least = f64::from(self.separation) - f64::from(AS_GOOD * size);
        let plane2 = plane_of(feature2).map(|normal| placed.place(DVec3::ZERO) - placed.place(normal));
        let mut best = least;
        for normal in [plane_of(feature1), plane2].into_iter().flatten() {
            let normal = normal / normal.length();
            if normal.dot(here) < FLAT_COSINE {
                continue;
            }
            let corner = placed.corner(-normal);
            let gap = corner.difference.dot(normal) - radius1 - radius2;
            if gap > best {
                best = gap;
                self.point1 += normal * (normal.dot(corner.point1 - self.point1) + radius1);
                (self.normal, self.separation) = (normal.as_vec3(), gap as Real);
            }
        }
    }

    /// What the features share, or where that is no more than a point, the edges with them or with each other. Lines that both
    /// lie beside a face whose normal this is do not meet along it.
    fn widest_patch(
        &self,
        placed: &Placed<'_>,
        features: &Features<'_>,
        (margin, size): (Real, Real),
        leant: bool,
    ) -> Patch {
        let (feature1, feature2) = (&features.first, &features.second);
        let mut patch = self.patch(placed, (feature1, feature2), (margin, size));
        if patch.count < 2 {
            let (edge1, edge2) = features.edges();
            for pair in [(&edge1, feature2), (feature1, &edge2), (&edge1, &edge2)] {
                let corners = [pair.0.points().len(), pair.1.points().len()];
                if corners[0] > 1 && corners[1] > 1 && (!leant || corners[0].max(corners[1]) > 2) {
                    let other = self.patch(placed, pair, (margin, size));
                    if other.count > patch.count && other.lowest <= self.separation + MISSED * size {
                        patch = other;
                    }
                }
            }
        }
        patch
    }

    /// What two features, each in the frame of its shape, share.
    pub(super) fn patch(
        &self,
        placed: &Placed<'_>,
        (feature1, feature2): (&Feature, &Feature),
        (margin, size): (Real, Real),
    ) -> Patch {
        let (t1, t2) = tangents(self.normal);
        let to_plane = DMat3::from_cols(t1.as_dvec3(), t2.as_dvec3(), self.normal.as_dvec3()).transpose();
        let view = View { point: self.point1, to_plane };
        let figure1 = Figure::new(feature1, |point| view.see(point));
        let figure2 = Figure::new(feature2, |point| view.see(placed.place(point)));
        let mut corners = [ClipPoint::default(); CLIPPED];
        let count = figure1.overlap(&figure2, ASIDE * size, &mut corners);
        let (mut kept, mut lowest) = (0, Real::MAX);
        let limit = max(self.separation + LEVEL * size, margin);
        for k in 0..count {
            let p = corners[k].position;
            let low = figure1.height(p.x, p.y);
            let separation = figure2.height(p.x, p.y) - low;
            if separation <= limit && separation.is_finite() {
                // Nothing is deeper along the normal than the closest point, but planes through corners that are not quite
                // level may say so.
                let separation = max(separation, self.separation);
                lowest = min(separation, lowest);
                let position = Vec3::new(p.x, p.y, low);
                corners[kept] = ClipPoint { position, separation, feature: corners[k].feature };
                kept += 1;
            }
        }
        Patch { corners, count: kept, lowest }
    }

    /// The four corners that matter, with the closest point where all of them are farther.
    pub(super) fn hand_on(&self, placed: &Placed<'_>, patch: &Patch, size: Real, manifold: &mut Manifold) {
        let corners = &patch.corners[..patch.count];
        let (t1, t2) = tangents(self.normal);
        let (chosen, mut count) = if corners.len() <= 4 {
            ([0, 1, 2, 3], corners.len())
        } else {
            let flat = |i: usize| (corners[i].position.x, corners[i].position.y);
            choose_four(corners.len(), flat, |i| corners[i].separation, EQUALLY_DEEP * size)
        };
        if patch.lowest > self.separation + MISSED * size {
            count = count.min(3);
            let (point1, normal, separation) = (self.witness(placed).as_vec3(), self.normal, self.separation);
            manifold.push(ManifoldPoint { point1, normal, separation, feature: WITNESS });
        }
        for &k in &chosen[..count] {
            let ClipPoint { position, separation, feature } = corners[k];
            let across = t1 * position.x + t2 * position.y + self.normal * position.z;
            let point1 = (self.point1 + across.as_dvec3()).as_vec3();
            manifold.push(ManifoldPoint { point1, normal: self.normal, separation, feature });
        }
    }

    /// The closest point. Of cores that overlap, or touch but for rounding, it is that of the cores moved just apart: the way
    /// out of an overlap tells the plane that they touch in, but where in it only if no other part of the boundary is as near.
    fn witness(&self, placed: &Placed<'_>) -> DVec3 {
        let [radius1, radius2] = placed.radii();
        let (normal, lift) = (self.normal.as_dvec3(), LIFT * placed.size());
        let distance = f64::from(self.separation) + radius1 + radius2;
        if distance > lift {
            return self.point1;
        }
        let apart = placed.gap_after(normal * (lift - distance));
        apart.map_or(self.point1, |gap| gap.point1 + normal * radius1)
    }
}

/// Normal of a face, of any length, outwards; nothing of a line or a point.
fn plane_of(feature: &Feature) -> Option<DVec3> {
    let (first, rest) = feature.points().split_first()?;
    let way = |point: &Vec3| point.as_dvec3() - first.as_dvec3();
    let normal = rest.windows(2).fold(DVec3::ZERO, |sum, pair| sum + way(&pair[0]).cross(way(&pair[1])));
    (normal.length_squared() > 0.0).then_some(normal)
}

/// Where a contact is looked at from: along its normal, about a point.
struct View {
    point: DVec3,
    /// Two tangents and the normal, as rows.
    to_plane: DMat3,
}

impl View {
    fn see(&self, point: DVec3) -> Vec3 {
        (self.to_plane * (point - self.point)).as_vec3()
    }
}

/// A feature in the plane square to the normal, and how high it is over that plane.
struct Figure {
    corners: [Vec3; FEATURE_POINTS],
    count: usize,
    /// `height = slope · (x, y) + base`.
    slope: [Real; 2],
    base: Real,
}

impl Figure {
    /// The figure of a feature, winding counter-clockwise.
    fn new(feature: &Feature, see: impl Fn(DVec3) -> Vec3) -> Self {
        let mut corners = [Vec3::ZERO; FEATURE_POINTS];
        let count = feature.points().len();
        for (corner, point) in corners.iter_mut().zip(feature.points()) {
            *corner = see(point.as_dvec3());
        }
        let mut figure = Self { corners, count, slope: [0.0; 2], base: corners[0].z };
        match count {
            0 | 1 => {}
            2 => figure.lean_along_line(),
            _ => figure.lean_in_plane(),
        }
        figure
    }

    /// Of a line: its height changes along it only.
    fn lean_along_line(&mut self) {
        let along = self.corners[1] - self.corners[0];
        let squared = along.x * along.x + along.y * along.y;
        if squared > 0.0 {
            self.slope = [along.z * along.x / squared, along.z * along.y / squared];
            self.base = self.corners[0].z - self.slope[0] * self.corners[0].x - self.slope[1] * self.corners[0].y;
        }
    }

    /// Of a face: its plane, by Newell's sum over its edges, through the middle of its corners.
    fn lean_in_plane(&mut self) {
        let (mut normal, mut middle) = (Vec3::ZERO, Vec3::ZERO);
        for k in 0..self.count {
            let (a, b) = (self.corners[k], self.corners[(k + 1) % self.count]);
            normal += (a - self.corners[0]).cross(b - self.corners[0]);
            middle += a;
        }
        middle *= 1.0 / self.count as Real;
        if normal.z < 0.0 {
            self.corners[..self.count].reverse();
        }
        if normal.z.abs() > 0.05 * normal.length() {
            self.slope = [-normal.x / normal.z, -normal.y / normal.z];
        }
        self.base = middle.z - self.slope[0] * middle.x - self.slope[1] * middle.y;
    }

    fn height(&self, x: Real, y: Real) -> Real {
        self.slope[0] * x + self.slope[1] * y + self.base
    }

    /// Corners of what two figures share; none where one of them is a point, or lines cross: the closest point says it all.
    fn overlap(&self, other: &Self, aside: Real, out: &mut [ClipPoint; CLIPPED]) -> usize {
        match (self.count, other.count) {
            (0 | 1, _) | (_, 0 | 1) => 0,
            (2, 2) => self.shared_stretch(other, aside, out),
            (2, _) => other.clip_line(self, out),
            (_, 2) => self.clip_line(other, out),
            _ => self.clip_face(other, out),
        }
    }

    /// Ends of the stretch that two parallel lines share: where they are no farther apart than `aside`.
    fn shared_stretch(&self, other: &Self, aside: Real, out: &mut [ClipPoint; CLIPPED]) -> usize {
        let flat = |v: Vec3| Vec3::new(v.x, v.y, 0.0);
        let (a, along) = (flat(self.corners[0]), flat(self.corners[1] - self.corners[0]));
        let other_along = flat(other.corners[1] - other.corners[0]);
        let squared = along.length_squared();
        let cross = along.x * other_along.y - along.y * other_along.x;
        if cross * cross > PARALLEL_SINE * PARALLEL_SINE * squared * other_along.length_squared() || squared == 0.0 {
            return 0;
        }
        let [p, q] = [other.corners[0], other.corners[1]].map(|end| flat(end - a).dot(along) / squared);
        let own = |share: Real| a + along * share;
        let there = |share: Real| flat(other.corners[0]) + other_along * clamp((share - p) / (q - p), 0.0, 1.0);
        let (low, high) = (max(min(p, q), 0.0), min(max(p, q), 1.0));
        // How far the other line is to the left, which changes evenly along them.
        let left = |share: Real| {
            let way = there(share) - own(share);
            (along.x * way.y - along.y * way.x) / squared.sqrt()
        };
        let (first, last) = (left(low), left(high));
        let reach = |limit: Real| low + (high - low) * ((limit - first) / (last - first));
        let (mut from, mut to) = (low, high);
        for sign in [1.0, -1.0] {
            match (first * sign > aside, last * sign > aside) {
                (true, true) => return 0,
                (true, false) => from = max(reach(sign * aside), from),
                (false, true) => to = min(reach(sign * aside), to),
                (false, false) => {}
            }
        }
        if to - from < 1e-3 {
            return 0;
        }
        for (k, share) in [from, to].into_iter().enumerate() {
            // Half way between the two lines: neither is preferred.
            let position = (own(share) + there(share)) * 0.5;
            out[k] = ClipPoint { position, separation: 0.0, feature: k as u32 + 1 };
        }
        2
    }

    /// Ends of the part of a line that is over this face.
    fn clip_line(&self, line: &Self, out: &mut [ClipPoint; CLIPPED]) -> usize {
        let (p, q) = (line.corners[0], line.corners[1]);
        let (mut enter, mut leave) = (0.0, 1.0);
        let (mut first, mut last) = (0, 0);
        for k in 0..self.count {
            let (normal, offset) = self.side(k);
            let (from, to) = (normal.dot(p) - offset, normal.dot(q) - offset);
            if from > 0.0 && to > 0.0 {
                return 0;
            }
            if from > 0.0 && from / (from - to) > enter {
                (enter, first) = (from / (from - to), k + 1);
            } else if to > 0.0 && from / (from - to) < leave {
                (leave, last) = (from / (from - to), k + 1);
            }
        }
        if enter > leave {
            return 0;
        }
        for (end, (share, cut)) in [(enter, first), (leave, last)].into_iter().enumerate() {
            let feature = 0x100 | (cut as u32) << 1 | end as u32;
            out[end] = ClipPoint { position: p + (q - p) * share, separation: 0.0, feature };
        }
        2
    }

    /// Outward normal of a side and where it is.
    fn side(&self, k: usize) -> (Vec3, Real) {
        let (a, b) = (self.corners[k], self.corners[(k + 1) % self.count]);
        let normal = Vec3::new(b.y - a.y, a.x - b.x, 0.0);
        (normal, normal.dot(a))
    }

    /// Corners of the part of another face that is over this one.
    fn clip_face(&self, other: &Self, out: &mut [ClipPoint; CLIPPED]) -> usize {
        let mut buffer = [ClipPoint::default(); CLIPPED];
        let (mut front, mut back) = (out, &mut buffer);
        for (k, (corner, place)) in other.corners[..other.count].iter().zip(front.iter_mut()).enumerate() {
            *place = ClipPoint { position: *corner, separation: 0.0, feature: (k as u32 + 1) << 12 };
        }
        let mut count = other.count;
        for k in 0..self.count {
            count = clip_polygon(&front[..count], self.side(k), k as u32, &mut back[..]);
            std::mem::swap(&mut front, &mut back);
        }
        if self.count % 2 == 1 {
            // The last result is in the spare buffer, which the other name holds now.
            back.copy_from_slice(&front[..]);
        }
        count
    }
}
