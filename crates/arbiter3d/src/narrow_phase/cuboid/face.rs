//! One face clipped against another, for `L` pairs of cuboids side by side.
//!
//! Which box has the reference face, which of its faces that is, and which face of the other looks against it differ from lane
//! to lane: rows, columns and roles are put in order by selects first, and from there on all lanes do the same. Only the choice
//! among more than four corners is made lane by lane.

use super::super::clip::choose_four;
use super::axes::{Columns, pick_column};
use super::lanes::{CuboidLanes, WideManifold, pick};
use super::{GROWTH, SIGNS};
use crate::math::Real;
use crate::simd::{LaneVec3, Lanes, Number};

/// Candidates for corners of a clipped face: the two ends of each of four sides, and the four corners of the rectangle.
const CANDIDATES: usize = 12;

/// Name of each candidate: which side, and which end of it; or which corner of the rectangle. The first end of a side that is
/// cut off has the next number.
const NAMES: [u32; CANDIDATES] = [0, 2, 4, 6, 8, 10, 12, 14, 16, 20, 24, 28];

/// Reference faces, each in the frame of its own box, and the faces of the other boxes that look most against them.
struct FacePairs<W> {
    /// Positive where the reference face is on box 2.
    swap: W,
    /// Axis of the reference face.
    k: W,
    /// Which of the two faces on that axis.
    sign: W,
    /// Offset of the reference plane along the signed axis.
    offset: W,
    /// Half extents of the reference rectangle, grown.
    rectangle: [W; 2],
    /// Centre of the incident face: two coordinates in the rectangle, then the height over it.
    center: [W; 3],
    /// From the centre of the incident face to the middles of two neighbouring sides.
    p: [W; 3],
    q: [W; 3],
    /// Axis of the incident face, and which way it looks along it.
    j: W,
    towards: W,
}

/// Corners of clipped faces: coordinates in the reference rectangle and height over it. In plain arrays, since corners are
/// chosen lane by lane.
struct Patches<const L: usize> {
    x: [[Real; L]; CANDIDATES],
    y: [[Real; L]; CANDIDATES],
    height: [[Real; L]; CANDIDATES],
    /// Sum of `2^candidate` over those that count.
    present: [Real; L],
    /// Sum of `2^candidate` over ends that are cut off.
    cut: [Real; L],
    /// What the two faces give to the names of corners.
    faces: [Real; L],
}

impl<W: Number> CuboidLanes<W> {
    /// Clips the incident face against the reference face `axis`, 0 to 5.
    #[inline(always)]
    pub(super) fn face_contacts<const L: usize>(&self, axis: W, count: usize, manifold: &mut WideManifold<L>)
    where
        W: Lanes<L>,
    {
        let c = self.pose.rotation.axes();
        let pairs = FacePairs::new(self, &c, axis);
        let mut patches = Patches::<L>::EMPTY;
        pairs.clip(self.margin, &mut patches);
        let size = self.size.to_array();
        let (mut x, mut y) = ([[0.0; L]; 4], [[0.0; L]; 4]);
        for lane in 0..count.min(L) {
            let base = patches.faces[lane] as u32;
            let cut = patches.cut[lane] as u32;
            let (chosen, points) = patches.choose(lane, size[lane]);
            manifold.count[lane] = points as u32;
            for (i, &candidate) in chosen.iter().enumerate().take(points) {
                x[i][lane] = patches.x[candidate][lane];
                y[i][lane] = patches.y[candidate][lane];
                manifold.separation[i][lane] = patches.height[candidate][lane];
                manifold.feature[i][lane] = base | NAMES[candidate] | (cut >> candidate & 1);
            }
        }
        pairs.place(self, &c, (&x, &y), manifold);
    }
}

/// `second` where `swap` is positive, else `first`.
#[inline(always)]
fn role<W: Number>(swap: W, first: [W; 3], second: [W; 3]) -> [W; 3] {
    [
        swap.if_positive(second[0], first[0]),
        swap.if_positive(second[1], first[1]),
        swap.if_positive(second[2], first[2]),
    ]
}

/// Coordinates in the order u, v, k.
#[inline(always)]
fn around<W: Number>(k: W, [x, y, z]: [W; 3]) -> [W; 3] {
    [pick(k, [y, z, x]), pick(k, [z, x, y]), pick(k, [x, y, z])]
}

/// From the order u, v, k back to x, y, z.
#[inline(always)]
fn back<W: Number>(k: W, [a, b, c]: [W; 3]) -> LaneVec3<W> {
    LaneVec3 { x: pick(k, [c, b, a]), y: pick(k, [a, c, b]), z: pick(k, [b, a, c]) }
}

/// One of the three vectors in each lane.
#[inline(always)]
fn pick_vector<W: Number>(which: W, [a, b, c]: [&[W; 3]; 3]) -> [W; 3] {
    [pick(which, [a[0], b[0], c[0]]), pick(which, [a[1], b[1], c[1]]), pick(which, [a[2], b[2], c[2]])]
}

/// `v · scale`, the last coordinate along `sign`.
#[inline(always)]
fn scaled<W: Number>(v: [W; 3], scale: W, sign: W) -> [W; 3] {
    [v[0] * scale, v[1] * scale, v[2] * scale * sign]
}

/// The axis of the incident face: the one that looks most along the normal. A face must do so clearly more to take over: a
/// box at 45° keeps its incident face.
#[inline(always)]
fn steepest<W: Number>([x, y, z]: &[[W; 3]; 3]) -> W {
    let (x, y, z) = (x[2].abs(), y[2].abs(), z[2].abs());
    let clearly = W::splat(1e-3);
    let floor = x + clearly;
    let axis = y.if_above(floor, W::splat(1.0), W::ZERO);
    let floor = y.if_above(floor, y + clearly, floor);
    z.if_above(floor, W::splat(2.0), axis)
}

impl<W: Number> FacePairs<W> {
    #[inline(always)]
    fn new(lanes: &CuboidLanes<W>, c: &Columns<W>, axis: W) -> Self {
        let one = W::splat(1.0);
        let swap = axis.if_above(W::splat(2.5), one, W::ZERO);
        let k = swap.if_positive(axis - W::splat(3.0), axis);
        let (a, b, t) = (lanes.half1.columns(), lanes.half2.columns(), lanes.pose.position);
        let (half1, half2) = (role(swap, a, b), role(swap, b, a));
        // Axis `j` of the incident box in the frame of the reference box, and its centre.
        let [cx, cy, cz] = c;
        let axes = [
            around(k, role(swap, cx.columns(), [cx.x, cy.x, cz.x])),
            around(k, role(swap, cy.columns(), [cx.y, cy.y, cz.y])),
            around(k, role(swap, cz.columns(), [cx.z, cy.z, cz.z])),
        ];
        let position = around(k, role(swap, t.columns(), [-cx.dot(&t), -cy.dot(&t), -cz.dot(&t)]));
        let half1 = around(k, half1);
        let sign = W::ZERO.if_above(position[2], -one, one);
        let j = steepest(&axes);
        let [x, y, z] = &axes;
        let (side0, side1, side2) = (pick_vector(j, [x, y, z]), pick_vector(j, [y, z, x]), pick_vector(j, [z, x, y]));
        // In the order of the sides.
        let [h0, h1, h2] = half2;
        let reach = [pick(j, [h0, h1, h2]), pick(j, [h1, h2, h0]), pick(j, [h2, h0, h1])];
        // The incident face looks against the normal.
        let towards = (side0[2] * sign).if_positive(-one, one);
        let out = scaled(side0, towards * reach[0], sign);
        let offset = half1[2];
        let growth = W::splat(1.0 + GROWTH);
        Self {
            swap,
            k,
            sign,
            offset,
            rectangle: [half1[0] * growth, half1[1] * growth],
            center: [position[0] + out[0], position[1] + out[1], (position[2] * sign - offset) + out[2]],
            p: scaled(side1, reach[1], sign),
            q: scaled(side2, reach[2], sign),
            j,
            towards,
        }
    }

    /// What names the two faces: a whole number.
    #[inline(always)]
    fn names(&self) -> W {
        let (one, zero) = (W::splat(1.0), W::ZERO);
        let reference = self.k + self.k + self.sign.if_positive(one, zero);
        let incident = self.j + self.j + self.towards.if_positive(one, zero);
        let box2 = self.swap.if_positive(W::splat(4096.0), zero);
        box2 + reference * W::splat(256.0) + incident * W::splat(32.0)
    }

    /// The corners of the incident faces seen through the reference rectangles that are not further than `margin`.
    #[inline(always)]
    fn clip<const L: usize>(&self, margin: W, patches: &mut Patches<L>)
    where
        W: Lanes<L>,
    {
        let (sides, cut) = self.cut_sides(margin, patches);
        let corners = self.look_for_corners(margin, patches);
        (patches.present, patches.cut) = ((sides + corners).to_array(), cut.to_array());
        patches.faces = self.names().to_array();
    }

    /// Each side of the incident face, cut by the rectangle (Liang and Barsky). Gives the sums `present` and `cut`.
    #[inline(always)]
    fn cut_sides<const L: usize>(&self, margin: W, patches: &mut Patches<L>) -> (W, W)
    where
        W: Lanes<L>,
    {
        let (m, p, q) = (&self.center, &self.p, &self.q);
        let (zero, one, two) = (W::ZERO, W::splat(1.0), W::splat(2.0));
        let inverse_p = [slope(p[0] * two), slope(p[1] * two)];
        let inverse_q = [slope(q[0] * two), slope(q[1] * two)];
        let (mut present, mut cut) = (zero, zero);
        for (e, (a, b)) in SIGNS.into_iter().enumerate() {
            let (a, b) = (W::splat(a), W::splat(b));
            let corner = [m[0] + a * p[0] + b * q[0], m[1] + a * p[1] + b * q[1], m[2] + a * p[2] + b * q[2]];
            let (along, inverse) = if e % 2 == 0 { (p, &inverse_p) } else { (q, &inverse_q) };
            let (scale, inverse) = if e < 2 { (-two, [-inverse[0], -inverse[1]]) } else { (two, *inverse) };
            let way = [scale * along[0], scale * along[1], scale * along[2]];
            let (enter, leave) = self.inside(&corner, inverse);
            let (start, end) = (2 * e, 2 * e + 1);
            let crosses = enter.if_above(leave, zero, W::splat((1 << start) as Real));
            present += patches.set(start, at(&corner, &way, enter), crosses, margin);
            let ends = leave.if_above(enter, one.if_above(leave, W::splat((1 << end) as Real), zero), zero);
            present += patches.set(end, at(&corner, &way, leave), ends, margin);
            cut += enter.if_positive(W::splat((1 << start) as Real), zero);
        }
        (present, cut)
    }

    /// Where a side from `corner` enters and leaves the rectangle, as shares of its length.
    #[inline(always)]
    fn inside(&self, corner: &[W; 3], inverse: [W; 2]) -> (W, W) {
        let r = &self.rectangle;
        let (low, high) = ((-r[0] - corner[0]) * inverse[0], (r[0] - corner[0]) * inverse[0]);
        let (enter, leave) = (low.min(high).max(W::ZERO), high.max(low).min(W::splat(1.0)));
        let (low, high) = ((-r[1] - corner[1]) * inverse[1], (r[1] - corner[1]) * inverse[1]);
        (low.min(high).max(enter), high.max(low).min(leave))
    }

    /// Corners of the rectangle over the incident face: solves `s p + t q = corner − m` by Cramer's rule. Gives the sum
    /// `present`.
    #[inline(always)]
    fn look_for_corners<const L: usize>(&self, margin: W, patches: &mut Patches<L>) -> W
    where
        W: Lanes<L>,
    {
        let (m, p, q, r) = (&self.center, &self.p, &self.q, &self.rectangle);
        let area = p[0] * q[1] - p[1] * q[0];
        let (s_slope, t_slope) = (p[2] / area, q[2] / area);
        let (size, zero) = (area.abs(), W::ZERO);
        let mut present = zero;
        for (e, (a, b)) in SIGNS.into_iter().enumerate() {
            let corner = [W::splat(a) * r[0], W::splat(b) * r[1]];
            let (x, y) = (corner[0] - m[0], corner[1] - m[1]);
            let (s, t) = (x * q[1] - y * q[0], p[0] * y - p[1] * x);
            let height = m[2] + (s * s_slope + t * t_slope);
            let over = size.if_above(t.abs(), W::splat((256 << e) as Real), zero);
            let over = size.if_above(s.abs(), over, zero);
            present += patches.set(8 + e, [corner[0], corner[1], height], over, margin);
        }
        present
    }

    /// Chosen corners as points in the frames of box 1, with their normals.
    #[inline(always)]
    fn place<const L: usize>(
        &self,
        lanes: &CuboidLanes<W>,
        c: &Columns<W>,
        (x, y): (&[[Real; L]; 4], &[[Real; L]; 4]),
        manifold: &mut WideManifold<L>,
    ) where
        W: Lanes<L>,
    {
        let (swap, k, plane) = (self.swap, self.k, self.sign * self.offset);
        let normal = back(k, [W::ZERO, W::ZERO, self.sign]);
        let column = pick_column(k, c).scale(-self.sign);
        manifold.normal = select(swap, &normal, &column).to_wide();
        for i in 0..4 {
            let (x, y) = (W::from_array(x[i]), W::from_array(y[i]));
            let separation = W::from_array(manifold.separation[i].0);
            let point = back(k, [x, y, plane]);
            // Where box 2 has the reference face, the point on box 1 is the one on the incident face.
            let incident = back(k, [x, y, plane + self.sign * separation]);
            let turned = c[0].scale(incident.x) + c[1].scale(incident.y) + c[2].scale(incident.z);
            let swapped = turned + lanes.pose.position;
            manifold.point1[i] = select(swap, &point, &swapped).to_wide();
        }
    }
}

/// `second` where `swap` is positive, else `first`.
#[inline(always)]
fn select<W: Number>(swap: W, first: &LaneVec3<W>, second: &LaneVec3<W>) -> LaneVec3<W> {
    let [x, y, z] = role(swap, first.columns(), second.columns());
    LaneVec3 { x, y, z }
}

/// `1 / way`. A side along the border may not divide by zero: a tiny slope keeps it inside or throws it far out.
#[inline(always)]
fn slope<W: Number>(way: W) -> W {
    W::splat(1.0) / way.abs().if_positive(way, W::splat(1e-30))
}

/// The point at share `t` of a side.
#[inline(always)]
fn at<W: Number>(corner: &[W; 3], way: &[W; 3], t: W) -> [W; 3] {
    [corner[0] + way[0] * t, corner[1] + way[1] * t, corner[2] + way[2] * t]
}

impl<const L: usize> Patches<L> {
    const EMPTY: Self = Self {
        x: [[0.0; L]; CANDIDATES],
        y: [[0.0; L]; CANDIDATES],
        height: [[0.0; L]; CANDIDATES],
        present: [0.0; L],
        cut: [0.0; L],
        faces: [0.0; L],
    };

    /// Writes a candidate. Gives `valid`, but zero where its height is beyond the margin.
    #[inline(always)]
    fn set<W: Lanes<L>>(&mut self, candidate: usize, [x, y, height]: [W; 3], valid: W, margin: W) -> W {
        self.x[candidate] = x.to_array();
        self.y[candidate] = y.to_array();
        self.height[candidate] = height.to_array();
        margin.if_at_least(height, valid, W::ZERO)
    }

    /// At most four candidates of a lane, and how many.
    #[inline(always)]
    fn choose(&self, lane: usize, size: Real) -> ([usize; 4], usize) {
        let mut present = self.present[lane] as u32;
        let count = present.count_ones() as usize;
        let mut places = [0; CANDIDATES];
        for place in places.iter_mut().take(count) {
            *place = present.trailing_zeros() as usize;
            present &= present - 1;
        }
        if count <= 4 {
            return ([places[0], places[1], places[2], places[3]], count);
        }
        let position = |i: usize| (self.x[places[i]][lane], self.y[places[i]][lane]);
        let (chosen, count) = choose_four(count, position, |i| self.height[places[i]][lane], size);
        (chosen.map(|i| places[i]), count)
    }
}
