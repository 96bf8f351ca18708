//! Cuboid against cuboid: the separating axis test on its fifteen axes, then one face clipped against another.
//!
//! With the axes of box 2 as columns of `C` in the frame of box 1, `A = |C|`, centre distance `t` and half extents
//! `a`, `b`, the signed gaps along the candidate axes are (Gottschalk, Lin, Manocha, "OBBTree", 1996)
//!
//! ```text
//! face i of box 1   |t_i| − a_i − Σ_j A_ij b_j
//! face j of box 2   |Σ_i C_ij t_i| − b_j − Σ_i A_ij a_i
//! edges i × j       (|t · (e_i × c_j)| − reach of both) / √(1 − C_ij²)
//! ```
//!
//! The largest gap tells the direction of least overlap. The choice must not change from step to step in a resting
//! stack: faces of box 1 win over those of box 2 unless these are better by a share of the smaller box
//! ([`FACE_BIAS`]). An edge pair whose axis is almost a face normal, as in every stack that leans by a hair, has to
//! beat the face as clipped by [`EDGE_BIAS`], since the face gives up to four points and the edges only one. At other
//! angles edges win at once: a face would push the wrong way.
//!
//! A face contact is found without walking polygons: each edge of the incident face is cut by the rectangle of the
//! reference face (Liang, Barsky, "A new concept and method for line clipping", 1984), and the corners of the rectangle
//! that lie over the incident face are added. The rectangle is grown by [`GROWTH`] so that corners that lie on its
//! border, as in every tidy stack, count as inside and keep their feature.
//!
//! Pairs are worked on `L` side by side ([`CuboidLanes`]): all that most pairs need is free of branches. Contacts of edges,
//! and what is rarer still, are found lane by lane. One pair alone is one lane, so all counts of lanes give the same bits.

mod axes;
mod face;
mod lanes;

pub(crate) use axes::Near;
pub(crate) use lanes::{CuboidLanes, CuboidPair, WideManifold};

use super::{Manifold, ManifoldPoint};
use crate::math::{Mat3, Pose, Real, Vec3, clamp};
use crate::shape::Cuboid;
use crate::shape::Support;
use crate::shape::distance::closest;
use crate::simd::{Lanes, Number, Quad, Wide};

/// A face of box 2 is the reference when it is better by this share of the smaller box's [`cuboid_size`].
const FACE_BIAS: Real = 2e-3;
/// An edge pair is looked at when it is better than the best face by this share of the smaller box's [`cuboid_size`].
const EDGE_GAIN: Real = 2e-4;
/// Along a face normal, an edge pair makes the contact when the clipped face is deeper by this share of the smaller
/// box's [`cuboid_size`].
pub(super) const EDGE_BIAS: Real = 5e-3;
/// Cosine above which the axis of an edge pair is taken to be along a face normal (11°).
pub(super) const ALIGNED: Real = 0.98;
/// Share by which the reference rectangle is grown.
const GROWTH: Real = 1e-4;
/// Edges with `sin² ` of their angle below this are parallel: the face axes stand in for their cross product.
const PARALLEL: Real = 1e-5;

/// The corners of a face, in turn, as multiples of its two half sides.
const SIGNS: [(Real, Real); 4] = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)];

/// Cuboid against cuboid, one pair.
pub(crate) fn cuboid_cuboid(cuboid1: &Cuboid, cuboid2: &Cuboid, pose: &Pose, margin: Real, manifold: &mut Manifold) {
    manifold.clear();
    let pair = CuboidPair::new((cuboid1, cuboid2), pose, margin);
    let lanes = CuboidLanes::<Wide<1>>::load(&[&pair]);
    if let Some(near) = lanes.test_axes().near(0) {
        let mut found = WideManifold::EMPTY;
        lanes.contacts(&[&pair], &[&near], 1, &mut found);
        found.push_lane(0, manifold);
    }
}

impl<W: Number> CuboidLanes<W> {
    /// Puts the contacts of the first `count` pairs, which are not apart, into `manifold`; `self` is what `pairs` hold.
    #[inline(always)]
    pub(crate) fn contacts<const L: usize>(
        &self,
        pairs: &[&CuboidPair; L],
        near: &[&Near; L],
        count: usize,
        manifold: &mut WideManifold<L>,
    ) where
        W: Lanes<L>,
    {
        let mut quads: [&Quad; L] = [&[0.0; 4]; L];
        for (quad, near) in quads.iter_mut().zip(near) {
            *quad = &near.0;
        }
        let [face, ..] = W::load(&quads);
        self.face_contacts(face, count, manifold);
        for lane in 0..count.min(L) {
            if near[lane].edge() > 0.0 || manifold.count[lane] == 0 {
                edge_or_passing(pairs[lane], near[lane], lane, manifold);
            }
        }
    }
}

/// A lane in which a pair of edges is better than the face, or the face as clipped is empty.
fn edge_or_passing<const L: usize>(boxes: &CuboidPair, near: &Near, lane: usize, manifold: &mut WideManifold<L>) {
    let (a, b, pose, face) = (boxes.half1(), boxes.half2(), boxes.pose(), near.face() as usize);
    if near.edge() > 0.0 {
        let (pair, size) = (near.edge() as usize - 6, boxes.size());
        let boxes = Boxes::new(a, b, &pose);
        let face_counts = boxes.cosine(pair, face) > ALIGNED;
        if !(face_counts && manifold.stands_in(lane, near.edge_gap() - EDGE_BIAS * size)) {
            manifold.set_point(lane, boxes.edge_contact(pair));
        }
    }
    if manifold.count[lane] == 0 {
        manifold.set_point(lane, passing_by(a, b, &pose, (boxes.margin(), near.face_gap(), face)));
    }
}

/// Whether a face contact is there and nowhere deeper than `depth`.
pub(super) fn stands_in(manifold: &Manifold, depth: Real) -> bool {
    !manifold.points().is_empty() && manifold.points().iter().all(|p| p.separation >= depth)
}

/// Boxes that pass each other with no corner over the other's face: the closest points, or the deepest corner.
#[cold]
fn passing_by(a: Vec3, b: Vec3, pose: &Pose, (margin, gap, axis): (Real, Real, usize)) -> Option<ManifoldPoint> {
    let feature = 0x4000;
    let (cuboid1, cuboid2) = (Cuboid::new(a).ok()?, Cuboid::new(b).ok()?);
    if let Some(c) = closest(&Support::Cuboid(cuboid1), &Support::Cuboid(cuboid2), pose) {
        let point = ManifoldPoint { point1: c.point1, normal: c.normal, separation: c.distance, feature };
        return (c.distance <= margin).then_some(point);
    }
    let m = pose.rotation.to_mat3();
    let mut normal = if axis < 3 { Vec3::AXES[axis] } else { m.col(axis - 3) };
    if normal.dot(pose.position) < 0.0 {
        normal = -normal;
    }
    let corner = |h: Real, d: Real| if d < 0.0 { -h } else { h };
    let point1 = if axis < 3 {
        let d = -pose.rotation.inverse_rotate(normal);
        m * Vec3::new(corner(b.x, d.x), corner(b.y, d.y), corner(b.z, d.z)) + pose.position - normal * gap
    } else {
        Vec3::new(corner(a.x, normal.x), corner(a.y, normal.y), corner(a.z, normal.z))
    };
    Some(ManifoldPoint { point1, normal, separation: gap, feature })
}

/// Two boxes, told in the frame of the first.
struct Boxes {
    /// Half extents of box 1.
    a: Vec3,
    /// Half extents of box 2.
    b: Vec3,
    /// `c[i][j]`: coordinate `i` of axis `j` of box 2.
    c: [[Real; 3]; 3],
    /// Centre of box 2.
    t: Vec3,
}

impl Boxes {
    fn new(a: Vec3, b: Vec3, pose: &Pose) -> Self {
        let Mat3 { x_axis: x, y_axis: y, z_axis: z } = pose.rotation.to_mat3();
        Self { a, b, c: [[x.x, y.x, z.x], [x.y, y.y, z.y], [x.z, y.z, z.z]], t: pose.position }
    }

    /// Squared length of `e_i × c_j`.
    fn edge_length_squared(&self, i: usize, j: usize) -> Real {
        let (i1, i2) = ((i + 1) % 3, (i + 2) % 3);
        self.c[i1][j] * self.c[i1][j] + self.c[i2][j] * self.c[i2][j]
    }

    /// Cosine of the angle between the axis of an edge pair and that of a face, never negative.
    fn cosine(&self, pair: usize, face: usize) -> Real {
        let (i, j) = (pair / 3, pair % 3);
        // `e_i × c_j` has no part along `e_i`, and along another axis the coordinate of `c_j` on the third; so for box
        // 2.
        let part = match face {
            k @ 0..=2 if k != i => self.c[3 - i - k][j],
            k @ 3..=5 if k - 3 != j => self.c[i][6 - j - k],
            _ => 0.0,
        };
        part.abs() / self.edge_length_squared(i, j).sqrt()
    }

    /// The closest points of one edge of each box; nothing if the boxes are apart and the edges are closest beyond
    /// their ends.
    fn edge_contact(&self, pair: usize) -> Option<ManifoldPoint> {
        let (i, j) = (pair / 3, pair % 3);
        let column = |k: usize| Vec3::new(self.c[0][k], self.c[1][k], self.c[2][k]);
        let t = self.t;
        let (mut d1, d2) = (Vec3::ZERO, column(j));
        d1[i] = 1.0;
        let axis = d1.cross(d2);
        let axis = if axis.dot(t) < 0.0 { -axis } else { axis };
        let normal = axis * (1.0 / axis.length());
        // The edge of each box that lies furthest towards the other one.
        let (mut p1, mut p2) = (Vec3::ZERO, t);
        let mut feature = 0x2000 | (pair as u32) << 4;
        for k in 1..3 {
            let (k1, k2) = ((i + k) % 3, (j + k) % 3);
            let (up1, up2) = (normal[k1] >= 0.0, normal.dot(column(k2)) < 0.0);
            p1[k1] = if up1 { self.a[k1] } else { -self.a[k1] };
            p2 += column(k2) * if up2 { self.b[k2] } else { -self.b[k2] };
            feature |= (up1 as u32) << (k - 1) | (up2 as u32) << (k + 1);
        }
        let w = p2 - p1;
        let cosine = self.c[i][j];
        let (along1, along2) = (w[i], w.dot(d2));
        let squared = self.edge_length_squared(i, j);
        let (s, t) = ((along1 - cosine * along2) / squared, (cosine * along1 - along2) / squared);
        let separation = w.dot(normal);
        if separation > 0.0 && (s.abs() > self.a[i] || t.abs() > self.b[j]) {
            return None;
        }
        let point1 = p1 + d1 * clamp(s, -self.a[i], self.a[i]);
        Some(ManifoldPoint { point1, normal, separation, feature })
    }
}

#[cfg(test)]
mod tests;
