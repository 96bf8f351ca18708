//! One face clipped against another, for `L` pairs of cuboids side by side.
//!
//! Which box has the reference face, which of its faces that is, and which face of the other looks against it differ from lane
//! to lane: rows, columns and roles are put in order by selects first, and from there on all lanes do the same.

use super::super::clip::choose_four;
use super::axes::{Columns, pick_column};
use super::lanes::{CuboidLanes, Pick, WideManifold};
use super::{GROWTH, SIGNS};
use crate::math::Real;
use crate::simd::{Number, Wide, WideVec3};

/// Candidates for corners of a clipped face: the two ends of each of four sides, and the four corners of the rectangle.
const CANDIDATES: usize = 12;

/// Name of each candidate: which side, and which end of it; or which corner of the rectangle.
const NAMES: [[u32; 3]; 4] = [[0, 2, 16], [4, 6, 20], [8, 10, 24], [12, 14, 28]];

/// Reference faces, each in the frame of its own box, and the faces of the other boxes that look most against them.
struct FacePairs<const L: usize> {
    /// Axis of the reference face.
    k: Pick<L>,
    /// Which of the two faces on that axis.
    sign: Wide<L>,
    /// Offset of the reference plane along the signed axis.
    offset: Wide<L>,
    /// Half extents of the reference rectangle, grown.
    rectangle: [Wide<L>; 2],
    /// Centre of the incident face: two coordinates in the rectangle, then the height over it.
    center: [Wide<L>; 3],
    /// From the centre of the incident face to the middles of two neighbouring sides.
    p: [Wide<L>; 3],
    q: [Wide<L>; 3],
    /// Axis of the incident face, and which way it looks along it.
    j: Wide<L>,
    towards: Wide<L>,
}

/// Corners of clipped faces: coordinates in the reference rectangle, height over it, and a bit for each that counts.
struct Patches<const L: usize> {
    x: [Wide<L>; CANDIDATES],
    y: [Wide<L>; CANDIDATES],
    height: [Wide<L>; CANDIDATES],
    present: [u32; L],
    /// Among the lower eight bits of a name: the end of a side that is cut off.
    names: [[u32; L]; CANDIDATES],
}

impl<const L: usize> CuboidLanes<L> {
    /// Clips the incident face against the reference face `axis`, 0 to 5.
    #[inline(always)]
    pub(super) fn face_contacts(&self, axis: &Wide<L>, count: usize) -> WideManifold<L> {
        let c = self.pose.rotation.axes();
        let swap = axis.if_above(Wide::splat(2.5), Wide::splat(1.0), Wide::ZERO);
        let k = Pick(swap.if_positive(*axis - Wide::splat(3.0), *axis));
        let pairs = FacePairs::new(self, &c, swap, k);
        let patches = pairs.clip(self.margin);
        let mut manifold = WideManifold::EMPTY;
        let (mut x, mut y) = ([Wide::<L>::ZERO; 4], [Wide::<L>::ZERO; 4]);
        for lane in 0..count.min(L) {
            let base = pairs.feature(lane) | if swap[lane] > 0.0 { 0x1000 } else { 0 };
            let (chosen, points) = patches.choose(lane, self.size[lane]);
            manifold.count[lane] = points as u32;
            for (i, &candidate) in chosen.iter().enumerate().take(points) {
                x[i][lane] = patches.x[candidate][lane];
                y[i][lane] = patches.y[candidate][lane];
                manifold.separation[i][lane] = patches.height[candidate][lane];
                manifold.feature[i][lane] = base | patches.names[candidate][lane];
            }
        }
        pairs.place(self, &c, swap, (&x, &y), &mut manifold);
        manifold
    }
}

impl<const L: usize> FacePairs<L> {
    #[inline(always)]
    fn new(lanes: &CuboidLanes<L>, c: &Columns<L>, swap: Wide<L>, k: Pick<L>) -> Self {
        let role = |first: Wide<L>, second: Wide<L>| swap.if_positive(second, first);
        let (a, b, t) = (lanes.half1.columns(), lanes.half2.columns(), lanes.pose.position);
        let half1: [Wide<L>; 3] = std::array::from_fn(|i| role(a[i], b[i]));
        let half2: [Wide<L>; 3] = std::array::from_fn(|i| role(b[i], a[i]));
        // Axis `j` of the incident box in the frame of the reference box, and its centre.
        let column = c.each_ref().map(WideVec3::columns);
        let turned: [[Wide<L>; 3]; 3] =
            std::array::from_fn(|j| std::array::from_fn(|i| role(column[j][i], column[i][j])));
        let ahead = t.columns();
        let position: [Wide<L>; 3] = std::array::from_fn(|i| role(ahead[i], -c[i].dot(&t)));
        // Rows in the order u, v, k.
        let around = |v: &[Wide<L>; 3]| [k.of([v[1], v[2], v[0]]), k.of([v[2], v[0], v[1]]), k.of(*v)];
        let axes = turned.each_ref().map(around);
        let (half1, position) = (around(&half1), around(&position));
        let one = Wide::splat(1.0);
        let sign = Wide::ZERO.if_above(position[2], -one, one);
        // A face must look along the normal clearly more to take over: a box at 45° keeps its incident face.
        let steep = axes.each_ref().map(|axis| axis[2].abs());
        let clearly = Wide::splat(1e-3);
        let floor = steep[0] + clearly;
        let j = steep[1].if_above(floor, one, Wide::ZERO);
        let floor = steep[1].if_above(floor, steep[1] + clearly, floor);
        let j = steep[2].if_above(floor, Wide::splat(2.0), j);
        let pick = Pick(j);
        let side = |s: usize| -> [Wide<L>; 3] {
            std::array::from_fn(|x| pick.of([axes[s % 3][x], axes[(s + 1) % 3][x], axes[(s + 2) % 3][x]]))
        };
        let half = |s: usize| pick.of([half2[s % 3], half2[(s + 1) % 3], half2[(s + 2) % 3]]);
        let scaled = |v: [Wide<L>; 3], scale: Wide<L>| [v[0] * scale, v[1] * scale, v[2] * scale * sign];
        // The incident face looks against the normal.
        let towards = (side(0)[2] * sign).if_positive(-one, one);
        let out = scaled(side(0), towards * half(0));
        let offset = half1[2];
        let growth = Wide::splat(1.0 + GROWTH);
        Self {
            k,
            sign,
            offset,
            rectangle: [half1[0] * growth, half1[1] * growth],
            center: [position[0] + out[0], position[1] + out[1], (position[2] * sign - offset) + out[2]],
            p: scaled(side(1), half(1)),
            q: scaled(side(2), half(2)),
            j,
            towards,
        }
    }

    /// What names the two faces.
    #[inline(always)]
    fn feature(&self, lane: usize) -> u32 {
        let (k, j) = (self.k.0[lane] as u32, self.j[lane] as u32);
        let (up, towards) = (u32::from(self.sign[lane] > 0.0), u32::from(self.towards[lane] > 0.0));
        (k << 1 | up) << 8 | (j << 1 | towards) << 5
    }

    /// The corners of the incident faces seen through the reference rectangles that are not further than `margin`.
    #[inline(always)]
    fn clip(&self, margin: Wide<L>) -> Patches<L> {
        let mut patches = Patches {
            x: [Wide::ZERO; CANDIDATES],
            y: [Wide::ZERO; CANDIDATES],
            height: [Wide::ZERO; CANDIDATES],
            present: [0; L],
            names: [[0; L]; CANDIDATES],
        };
        self.cut_sides(margin, &mut patches);
        self.look_for_corners(margin, &mut patches);
        patches
    }

    /// Each side of the incident face, cut by the rectangle (Liang and Barsky).
    #[inline(always)]
    fn cut_sides(&self, margin: Wide<L>, patches: &mut Patches<L>) {
        let (m, p, q, r) = (&self.center, &self.p, &self.q, &self.rectangle);
        let (zero, one, two) = (Wide::<L>::ZERO, Wide::<L>::splat(1.0), Wide::<L>::splat(2.0));
        // A side along the border may not divide by zero: a tiny slope keeps it inside or throws it far out.
        let steep = |way: Wide<L>| way.abs().if_positive(way, Wide::splat(1e-30));
        let inverse: [[Wide<L>; 2]; 2] = std::array::from_fn(|x| [p[x], q[x]].map(|side| one / steep(side * two)));
        for (e, (a, b)) in SIGNS.into_iter().enumerate() {
            let corner: [Wide<L>; 3] = std::array::from_fn(|x| m[x] + Wide::splat(a) * p[x] + Wide::splat(b) * q[x]);
            let along = if e % 2 == 0 { p } else { q };
            let scale = if e < 2 { -two } else { two };
            let way: [Wide<L>; 3] = std::array::from_fn(|x| scale * along[x]);
            let (mut enter, mut leave) = (zero, one);
            for x in 0..2 {
                let inverse = if e < 2 { -inverse[x][e % 2] } else { inverse[x][e % 2] };
                let (low, high) = ((-r[x] - corner[x]) * inverse, (r[x] - corner[x]) * inverse);
                enter = low.min(high).max(enter);
                leave = high.max(low).min(leave);
            }
            let at = |t: Wide<L>| [corner[0] + way[0] * t, corner[1] + way[1] * t, corner[2] + way[2] * t];
            let crosses = enter.if_above(leave, zero, one);
            patches.set(2 * e, at(enter), crosses, margin);
            let ends = leave.if_above(enter, one.if_above(leave, one, zero), zero);
            patches.set(2 * e + 1, at(leave), ends, margin);
            let [first, second, _] = NAMES[e];
            patches.names[2 * e] = std::array::from_fn(|lane| first | u32::from(enter[lane] > 0.0));
            patches.names[2 * e + 1] = [second; L];
        }
    }

    /// Corners of the rectangle over the incident face: solves `s p + t q = corner − m` by Cramer's rule.
    #[inline(always)]
    fn look_for_corners(&self, margin: Wide<L>, patches: &mut Patches<L>) {
        let (m, p, q, r) = (&self.center, &self.p, &self.q, &self.rectangle);
        let area = p[0] * q[1] - p[1] * q[0];
        let (s_slope, t_slope) = (p[2] / area, q[2] / area);
        let (size, zero, one) = (area.abs(), Wide::ZERO, Wide::splat(1.0));
        for (e, (a, b)) in SIGNS.into_iter().enumerate() {
            let at = [Wide::splat(a) * r[0], Wide::splat(b) * r[1]];
            let (x, y) = (at[0] - m[0], at[1] - m[1]);
            let (s, t) = (x * q[1] - y * q[0], p[0] * y - p[1] * x);
            let height = m[2] + (s * s_slope + t * t_slope);
            let over = size.if_above(s.abs(), size.if_above(t.abs(), one, zero), zero);
            patches.set(8 + e, [at[0], at[1], height], over, margin);
            patches.names[8 + e] = [NAMES[e][2]; L];
        }
    }

    /// Chosen corners as points in the frames of box 1, with their normals.
    #[inline(always)]
    fn place(
        &self,
        lanes: &CuboidLanes<L>,
        c: &Columns<L>,
        swap: Wide<L>,
        (x, y): (&[Wide<L>; 4], &[Wide<L>; 4]),
        manifold: &mut WideManifold<L>,
    ) {
        let (zero, plane) = (Wide::ZERO, self.sign * self.offset);
        let role = |first: Wide<L>, second: Wide<L>| swap.if_positive(second, first);
        // From the order u, v, k back to x, y, z.
        let back = |u: Wide<L>, v: Wide<L>, k: Wide<L>| WideVec3 {
            x: self.k.of([k, v, u]),
            y: self.k.of([u, k, v]),
            z: self.k.of([v, u, k]),
        };
        let normal = back(zero, zero, self.sign);
        let column = pick_column(&self.k, c).scale(-self.sign);
        manifold.normal =
            WideVec3 { x: role(normal.x, column.x), y: role(normal.y, column.y), z: role(normal.z, column.z) };
        for i in 0..4 {
            let point = back(x[i], y[i], plane);
            // Where box 2 has the reference face, the point on box 1 is the one on the incident face.
            let incident = back(x[i], y[i], plane + self.sign * manifold.separation[i]);
            let turned = c[0].scale(incident.x) + c[1].scale(incident.y) + c[2].scale(incident.z);
            let swapped = turned + lanes.pose.position;
            manifold.point1[i] =
                WideVec3 { x: role(point.x, swapped.x), y: role(point.y, swapped.y), z: role(point.z, swapped.z) };
        }
    }
}

impl<const L: usize> Patches<L> {
    /// Writes a candidate; it counts where `valid` is positive and its height within the margin.
    #[inline(always)]
    fn set(&mut self, candidate: usize, [x, y, height]: [Wide<L>; 3], valid: Wide<L>, margin: Wide<L>) {
        (self.x[candidate], self.y[candidate], self.height[candidate]) = (x, y, height);
        for lane in 0..L {
            let counts = (valid[lane] > 0.0) & (height[lane] <= margin[lane]);
            self.present[lane] |= u32::from(counts) << candidate;
        }
    }

    /// At most four candidates of a lane, and how many.
    #[inline(always)]
    fn choose(&self, lane: usize, size: Real) -> ([usize; 4], usize) {
        let mut present = self.present[lane];
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
