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
//! reference face (Liang, Barsky, "A new concept and method for line clipping", 1984), four edges side by side, and
//! the corners of the rectangle that lie over the incident face are added. The rectangle is grown by [`GROWTH`] so
//! that corners that lie on its border, as in every tidy stack, count as inside and keep their feature.

use super::clip::choose_four;
use super::distance::{Support, closest};
use super::polyhedron::cuboid_size;
use super::{Manifold, ManifoldPoint, PairCache};
use crate::math::{Mat3, Pose, Real, Vec3, clamp, max, min};
use crate::shape::Cuboid;

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

/// Two boxes, told in the frame of the first.
struct Boxes {
    /// Half extents of box 1.
    a: [Real; 3],
    /// Half extents of box 2.
    b: [Real; 3],
    /// `c[i][j]`: coordinate `i` of axis `j` of box 2.
    c: [[Real; 3]; 3],
    /// Centre of box 2.
    t: [Real; 3],
}

/// Cuboid against cuboid.
pub(crate) fn cuboid_cuboid(
    cuboid1: &Cuboid,
    cuboid2: &Cuboid,
    pose: &Pose,
    margin: Real,
    cache: &mut PairCache,
    manifold: &mut Manifold,
) {
    manifold.clear();
    let m = pose.rotation.to_mat3();
    let boxes = Boxes::new(cuboid1, cuboid2, &m, pose.position);
    let cached = cache.words[0] as usize;
    if (1..=15).contains(&cached) && boxes.gap(cached - 1) > margin {
        return;
    }
    let size = min(cuboid_size(cuboid1.half_extents()), cuboid_size(cuboid2.half_extents()));
    let face = boxes.best_face(margin, size);
    cache.words[0] = face.axis as u32 + 1;
    if face.gap > margin {
        return;
    }
    let edge = boxes.best_edge(face.gap + EDGE_GAIN * size);
    if let Some(edge) = edge {
        cache.words[0] = edge.axis as u32 + 1;
        if edge.gap > margin {
            return;
        }
    }
    if edge.is_none_or(|edge| boxes.cosine(edge.axis - 6, face.axis) > ALIGNED) {
        boxes.face_contact(face.axis, &m, (margin, size), manifold);
    }
    if let Some(edge) = edge
        && !stands_in(manifold, edge.gap - EDGE_BIAS * size)
    {
        manifold.clear();
        boxes.edge_contact(edge.axis - 6, manifold);
    }
    if manifold.points().is_empty() {
        passing_by(cuboid1, cuboid2, pose, (margin, face.gap, face.axis), manifold);
    }
}

/// Whether a face contact is there and nowhere deeper than `depth`.
pub(super) fn stands_in(manifold: &Manifold, depth: Real) -> bool {
    !manifold.points().is_empty() && manifold.points().iter().all(|p| p.separation >= depth)
}

/// Boxes that pass each other with no corner over the other's face: the closest points, or the deepest corner.
#[cold]
fn passing_by(
    cuboid1: &Cuboid,
    cuboid2: &Cuboid,
    pose: &Pose,
    (margin, gap, axis): (Real, Real, usize),
    manifold: &mut Manifold,
) {
    let feature = 0x4000;
    if let Some(c) = closest(&Support::Cuboid(*cuboid1), &Support::Cuboid(*cuboid2), pose) {
        if c.distance <= margin {
            manifold.push(ManifoldPoint { point1: c.point1, normal: c.normal, separation: c.distance, feature });
        }
        return;
    }
    let m = pose.rotation.to_mat3();
    let mut normal = if axis < 3 { Vec3::AXES[axis] } else { m.col(axis - 3) };
    if normal.dot(pose.position) < 0.0 {
        normal = -normal;
    }
    let corner = |h: Real, d: Real| if d < 0.0 { -h } else { h };
    let (a, b) = (cuboid1.half_extents(), cuboid2.half_extents());
    let point1 = if axis < 3 {
        let d = -pose.rotation.inverse_rotate(normal);
        m * Vec3::new(corner(b.x, d.x), corner(b.y, d.y), corner(b.z, d.z)) + pose.position - normal * gap
    } else {
        Vec3::new(corner(a.x, normal.x), corner(a.y, normal.y), corner(a.z, normal.z))
    };
    manifold.push(ManifoldPoint { point1, normal, separation: gap, feature });
}

/// A candidate: axes 0–2 are faces of box 1, 3–5 faces of box 2, `6 + 3 i + j` the edges `i × j`.
#[derive(Clone, Copy)]
struct Axis {
    axis: usize,
    gap: Real,
}

impl Boxes {
    #[inline(always)]
    fn new(cuboid1: &Cuboid, cuboid2: &Cuboid, m: &Mat3, t: Vec3) -> Self {
        let (x, y, z) = (m.x_axis, m.y_axis, m.z_axis);
        Self {
            a: cuboid1.half_extents().to_array(),
            b: cuboid2.half_extents().to_array(),
            c: [[x.x, y.x, z.x], [x.y, y.y, z.y], [x.z, y.z, z.z]],
            t: t.to_array(),
        }
    }

    #[inline(always)]
    fn face1_gap(&self, i: usize) -> Real {
        let (b, c) = (&self.b, &self.c[i]);
        self.t[i].abs() - self.a[i] - (c[0].abs() * b[0] + c[1].abs() * b[1] + c[2].abs() * b[2])
    }

    #[inline(always)]
    fn face2_gap(&self, j: usize) -> Real {
        let (a, c, t) = (&self.a, &self.c, &self.t);
        let u = c[0][j] * t[0] + c[1][j] * t[1] + c[2][j] * t[2];
        u.abs() - self.b[j] - (c[0][j].abs() * a[0] + c[1][j].abs() * a[1] + c[2][j].abs() * a[2])
    }

    /// Gap along `e_i × c_j`, not yet divided by the length of that product.
    #[inline(always)]
    fn edge_gap(&self, i: usize, j: usize) -> Real {
        let (a, b, c, t) = (&self.a, &self.b, &self.c, &self.t);
        let (i1, i2) = ((i + 1) % 3, (i + 2) % 3);
        let (j1, j2) = ((j + 1) % 3, (j + 2) % 3);
        let reach1 = a[i1] * c[i2][j].abs() + a[i2] * c[i1][j].abs();
        let reach2 = b[j1] * c[i][j2].abs() + b[j2] * c[i][j1].abs();
        (t[i2] * c[i1][j] - t[i1] * c[i2][j]).abs() - (reach1 + reach2)
    }

    /// Squared length of `e_i × c_j`.
    #[inline(always)]
    fn edge_length_squared(&self, i: usize, j: usize) -> Real {
        let (i1, i2) = ((i + 1) % 3, (i + 2) % 3);
        self.c[i1][j] * self.c[i1][j] + self.c[i2][j] * self.c[i2][j]
    }

    /// Gap along one axis; no gap for parallel edges.
    fn gap(&self, axis: usize) -> Real {
        match axis {
            0..=2 => self.face1_gap(axis),
            3..=5 => self.face2_gap(axis - 3),
            _ => {
                let (i, j) = ((axis - 6) / 3, (axis - 6) % 3);
                let squared = self.edge_length_squared(i, j);
                if squared > PARALLEL { self.edge_gap(i, j) / squared.sqrt() } else { -Real::MAX }
            }
        }
    }

    /// The face to build the contact on, or one along which the boxes are apart by more than `margin`.
    #[inline(always)]
    fn best_face(&self, margin: Real, size: Real) -> Axis {
        let mut best = Axis { axis: 0, gap: self.face1_gap(0) };
        for i in 1..3 {
            let gap = self.face1_gap(i);
            if gap > best.gap {
                best = Axis { axis: i, gap };
            }
        }
        if best.gap > margin {
            return best;
        }
        let mut other = Axis { axis: 3, gap: self.face2_gap(0) };
        for j in 1..3 {
            let gap = self.face2_gap(j);
            if gap > other.gap {
                other = Axis { axis: 3 + j, gap };
            }
        }
        if other.gap > margin || other.gap > best.gap + FACE_BIAS * size { other } else { best }
    }

    /// The edge pair with the largest gap, if that is above `floor`.
    #[inline(always)]
    fn best_edge(&self, floor: Real) -> Option<Axis> {
        let mut best = Axis { axis: 0, gap: floor };
        for i in 0..3 {
            for j in 0..3 {
                let gap = self.edge_gap(i, j);
                let squared = self.edge_length_squared(i, j);
                // The product is at most one long, so dividing an overlap only makes it larger: no root for most axes.
                if squared <= PARALLEL || (gap <= 0.0 && gap <= best.gap) {
                    continue;
                }
                let gap = gap / squared.sqrt();
                if gap > best.gap {
                    best = Axis { axis: 6 + 3 * i + j, gap };
                }
            }
        }
        (best.axis != 0).then_some(best)
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

    /// Clips the incident face against the reference face.
    #[inline(always)]
    fn face_contact(&self, axis: usize, m: &Mat3, reach: (Real, Real), manifold: &mut Manifold) {
        if axis < 3 {
            FacePair::new(&self.a, &self.b, &self.c, &self.t, axis).contact(reach, manifold);
            return;
        }
        let (c, t) = (&self.c, Vec3::from_array(self.t));
        let transposed = [[c[0][0], c[1][0], c[2][0]], [c[0][1], c[1][1], c[2][1]], [c[0][2], c[1][2], c[2][2]]];
        let back = |j: usize| -(c[0][j] * self.t[0] + c[1][j] * self.t[1] + c[2][j] * self.t[2]);
        let face = FacePair::new(&self.b, &self.a, &transposed, &[back(0), back(1), back(2)], axis - 3);
        face.contact(reach, manifold);
        // Found in the frame of box 2 with the roles swapped.
        let normal = -(*m * face.normal());
        for p in manifold.points_mut() {
            p.point1 = *m * p.point2() + t;
            p.normal = normal;
            p.feature |= 0x1000;
        }
    }

    /// The closest points of one edge of each box; nothing if the boxes are apart and the edges are closest beyond
    /// their ends.
    fn edge_contact(&self, pair: usize, manifold: &mut Manifold) {
        let (i, j) = (pair / 3, pair % 3);
        let column = |k: usize| Vec3::new(self.c[0][k], self.c[1][k], self.c[2][k]);
        let t = Vec3::from_array(self.t);
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
            return;
        }
        let point1 = p1 + d1 * clamp(s, -self.a[i], self.a[i]);
        manifold.push(ManifoldPoint { point1, normal, separation, feature });
    }
}

/// A reference face, in the frame of its own box, and the face of the other box that looks most against it.
struct FacePair {
    /// Axis of the reference face.
    k: usize,
    /// Which of the two faces on that axis.
    sign: Real,
    /// Offset of the reference plane along the signed axis.
    offset: Real,
    /// Half extents of the reference rectangle, grown.
    rectangle: [Real; 2],
    /// Centre of the incident face: two coordinates in the rectangle, then the height over it.
    center: [Real; 3],
    /// From the centre of the incident face to the middles of two neighbouring sides.
    p: [Real; 3],
    q: [Real; 3],
    feature: u32,
}

/// Corners of a clipped face: coordinates in the reference rectangle and height over it.
///
/// There are at most eight, but rounding might find one twice: hence room for all twelve candidates, and for an index
/// of four bits, which needs no check. Arrays a coordinate, so that what was written by ones is read by ones.
#[derive(Default)]
struct Patch {
    x: [Real; 16],
    y: [Real; 16],
    height: [Real; 16],
    feature: [u32; 16],
    count: usize,
}

impl FacePair {
    /// `half1`, `half2`: half extents of the reference and the incident box; `c`, `t`: placement of the incident box.
    #[inline(always)]
    fn new(half1: &[Real; 3], half2: &[Real; 3], c: &[[Real; 3]; 3], t: &[Real; 3], k: usize) -> Self {
        let (u, v) = ((k + 1) % 3, (k + 2) % 3);
        let sign: Real = if t[k] < 0.0 { -1.0 } else { 1.0 };
        let mut j = 0;
        for other in 1..3 {
            // A face must look along the normal clearly more to take over: a box at 45° keeps its incident face.
            if c[k][other].abs() > c[k][j].abs() + 1e-3 {
                j = other;
            }
        }
        // The incident face looks against the normal.
        let towards: Real = if c[k][j] * sign > 0.0 { -1.0 } else { 1.0 };
        let local = |j: usize, scale: Real| [c[u][j] * scale, c[v][j] * scale, c[k][j] * scale * sign];
        let out = local(j, towards * half2[j]);
        let (j1, j2) = ((j + 1) % 3, (j + 2) % 3);
        let offset = half1[k];
        Self {
            k,
            sign,
            offset,
            rectangle: [half1[u] * (1.0 + GROWTH), half1[v] * (1.0 + GROWTH)],
            center: [t[u] + out[0], t[v] + out[1], (t[k] * sign - offset) + out[2]],
            p: local(j1, half2[j1]),
            q: local(j2, half2[j2]),
            feature: ((k as u32) << 1 | (sign > 0.0) as u32) << 8 | ((j as u32) << 1 | (towards > 0.0) as u32) << 5,
        }
    }

    #[inline(always)]
    fn normal(&self) -> Vec3 {
        let mut normal = Vec3::ZERO;
        normal[self.k] = self.sign;
        normal
    }

    /// Up to four points, in the frame of the reference box.
    #[inline(always)]
    fn contact(&self, (margin, size): (Real, Real), manifold: &mut Manifold) {
        let mut patch = Patch::default();
        self.clip(margin, &mut patch);
        let (chosen, count) = if patch.count <= 4 {
            ([0, 1, 2, 3], patch.count)
        } else {
            choose_four(patch.count, |i| (patch.x[i], patch.y[i]), |i| patch.height[i], size)
        };
        let normal = self.normal();
        let (u, v, origin) = (Vec3::AXES[(self.k + 1) % 3], Vec3::AXES[(self.k + 2) % 3], normal * self.offset);
        for &k in &chosen[..count] {
            let point1 = origin + u * patch.x[k] + v * patch.y[k];
            manifold.push(ManifoldPoint { point1, normal, separation: patch.height[k], feature: patch.feature[k] });
        }
    }

    /// The corners of the incident face seen through the reference rectangle that are not further than `margin`.
    ///
    /// All twelve candidates are written, each over the last one if that did not count.
    #[inline(always)]
    fn clip(&self, margin: Real, patch: &mut Patch) {
        let (m, p, q, r) = (&self.center, &self.p, &self.q, &self.rectangle);
        let (corner, way) = self.sides();
        let (mut enter, mut leave) = ([0.0; 4], [1.0; 4]);
        for x in 0..2 {
            for e in 0..4 {
                // A side along the border may not divide by zero: a tiny slope keeps it inside or throws it far out.
                let inverse = 1.0 / if way[x][e] == 0.0 { 1e-30 } else { way[x][e] };
                let (low, high) = ((-r[x] - corner[x][e]) * inverse, (r[x] - corner[x][e]) * inverse);
                enter[e] = max(min(low, high), enter[e]);
                leave[e] = min(max(high, low), leave[e]);
            }
        }
        let mut push = |x: Real, y: Real, height: Real, feature: u32, valid: bool| {
            let i = patch.count & 15;
            (patch.x[i], patch.y[i], patch.height[i]) = (x, y, height);
            patch.feature[i] = self.feature | feature;
            patch.count += (valid & (height <= margin)) as usize;
        };
        for e in 0..4 {
            let (t, u) = (enter[e], leave[e]);
            let at = |x: usize, t: Real| corner[x][e] + way[x][e] * t;
            push(at(0, t), at(1, t), at(2, t), (e as u32) << 2 | (t > 0.0) as u32, t <= u);
            push(at(0, u), at(1, u), at(2, u), (e as u32) << 2 | 2, (t < u) & (u < 1.0));
        }
        // Corners of the rectangle over the incident face: solve `s p + t q = corner − m` by Cramer's rule.
        let area = p[0] * q[1] - p[1] * q[0];
        let (s_slope, t_slope) = (p[2] / area, q[2] / area);
        for (e, (a, b)) in SIGNS.into_iter().enumerate() {
            let (x, y) = (a * r[0] - m[0], b * r[1] - m[1]);
            let (s, t) = (x * q[1] - y * q[0], p[0] * y - p[1] * x);
            let height = m[2] + (s * s_slope + t * t_slope);
            let over = (s.abs() < area.abs()) & (t.abs() < area.abs());
            push(a * r[0], b * r[1], height, 16 | (e as u32) << 2, over);
        }
    }

    /// The corners of the incident face, and from each the way to the next: two coordinates in the rectangle, then the
    /// height.
    #[inline(always)]
    fn sides(&self) -> ([[Real; 4]; 3], [[Real; 4]; 3]) {
        let (mut corner, mut way) = ([[0.0; 4]; 3], [[0.0; 4]; 3]);
        for x in 0..3 {
            let (m, p, q) = (self.center[x], self.p[x], self.q[x]);
            for e in 0..4 {
                corner[x][e] = m + SIGNS[e].0 * p + SIGNS[e].1 * q;
            }
            way[x] = [-2.0 * p, -2.0 * q, 2.0 * p, 2.0 * q];
        }
        (corner, way)
    }
}
