//! The separating axis test of cuboid pairs, `L` side by side.
//!
//! Every lane goes through all fifteen axes: an early way out for one would not stop the others, and a whole test costs less
//! than fetching the boxes.

use super::lanes::{CuboidLanes, pick};
use super::{EDGE_GAIN, FACE_BIAS, PARALLEL};
use crate::math::Real;
use crate::simd::{LaneVec3, Lanes, Number, Quad};

/// `c[j]`: axis `j` of box 2 in the frame of box 1.
pub(super) type Columns<W> = [LaneVec3<W>; 3];

/// What the axes of `L` pairs tell.
pub(crate) struct Axes<const L: usize> {
    near: [Quad; L],
    /// Positive where the boxes are apart by more than the margin.
    apart: [Real; L],
}

impl<const L: usize> Axes<L> {
    /// What the axes of a lane tell; nothing if its boxes are apart by more than the margin.
    #[inline(always)]
    pub(crate) fn near(&self, lane: usize) -> Option<Near> {
        (self.apart[lane] <= 0.0).then_some(Near(self.near[lane]))
    }
}

/// What the axes tell of boxes that are not apart: 0–2 are faces of box 1, 3–5 faces of box 2, `6 + 3 i + j` the edges
/// `i × j`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Near(pub(super) Quad);

impl Near {
    /// Nothing tested.
    pub(crate) const NONE: Self = Self([0.0; 4]);

    /// The face to build the contact on, or one along which the boxes are apart.
    pub(super) fn face(&self) -> Real {
        self.0[0]
    }

    pub(super) fn face_gap(&self) -> Real {
        self.0[1]
    }

    /// The pair of edges that is better than the face; 0 for none.
    pub(super) fn edge(&self) -> Real {
        self.0[2]
    }

    pub(super) fn edge_gap(&self) -> Real {
        self.0[3]
    }
}

/// The two boxes of each lane as plain columns.
struct Spans<W> {
    /// Half extents.
    a: [W; 3],
    b: [W; 3],
    /// Centre of box 2.
    t: [W; 3],
    /// `c[j][i]`: coordinate `i` of axis `j` of box 2; then without signs.
    c: [[W; 3]; 3],
    size: [[W; 3]; 3],
}

impl<W: Number> Spans<W> {
    #[inline(always)]
    fn new(lanes: &CuboidLanes<W>) -> Self {
        let [x, y, z] = lanes.pose.rotation.axes();
        Self {
            a: lanes.half1.columns(),
            b: lanes.half2.columns(),
            t: lanes.pose.position.columns(),
            c: [x.columns(), y.columns(), z.columns()],
            size: [sizes(&x), sizes(&y), sizes(&z)],
        }
    }

    /// Gap along face `i` of box 1.
    #[inline(always)]
    fn gap1(&self, i: usize) -> W {
        let (b, size) = (&self.b, &self.size);
        self.t[i].abs() - self.a[i] - (size[0][i] * b[0] + size[1][i] * b[1] + size[2][i] * b[2])
    }

    /// Gap along face `j` of box 2.
    #[inline(always)]
    fn gap2(&self, j: usize) -> W {
        let (a, t, c, size) = (&self.a, &self.t, &self.c[j], &self.size[j]);
        let along = c[0] * t[0] + c[1] * t[1] + c[2] * t[2];
        along.abs() - self.b[j] - (size[0] * a[0] + size[1] * a[1] + size[2] * a[2])
    }

    /// Gap along the edges `i × j`; `floor` where they are parallel: these are left to the faces.
    #[inline(always)]
    fn edge_gap(&self, i: usize, j: usize, floor: W) -> W {
        let (i1, i2, j1, j2) = ((i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3);
        let (a, b, t, c, size) = (&self.a, &self.b, &self.t, &self.c[j], &self.size);
        let reach1 = a[i1] * size[j][i2] + a[i2] * size[j][i1];
        let reach2 = b[j1] * size[j2][i] + b[j2] * size[j1][i];
        let gap = (t[i2] * c[i1] - t[i1] * c[i2]).abs() - (reach1 + reach2);
        let squared = c[i1] * c[i1] + c[i2] * c[i2];
        squared.if_above(W::splat(PARALLEL), gap / squared.sqrt(), floor)
    }
}

#[inline(always)]
fn sizes<W: Number>(v: &LaneVec3<W>) -> [W; 3] {
    [v.x.abs(), v.y.abs(), v.z.abs()]
}

impl<W: Number> CuboidLanes<W> {
    /// Tests the fifteen axes.
    #[inline(always)]
    pub(crate) fn test_axes<const L: usize>(&self) -> Axes<L>
    where
        W: Lanes<L>,
    {
        let spans = Spans::new(self);
        let (face, face_gap) = self.best_face(&spans);
        let floor = face_gap + self.size * W::splat(EDGE_GAIN);
        let (edge, edge_gap) = best_edge(&spans, floor);
        let one = W::splat(1.0);
        let by_edge = edge.if_positive(edge_gap.if_above(self.margin, one, W::ZERO), W::ZERO);
        let apart = face_gap.if_above(self.margin, one, by_edge);
        Axes { near: W::store(&[face, face_gap, edge, edge_gap]), apart: apart.to_array() }
    }

    #[inline(always)]
    fn best_face(&self, spans: &Spans<W>) -> (W, W) {
        let (axis1, best1) = largest([spans.gap1(0), spans.gap1(1), spans.gap1(2)]);
        let (axis2, best2) = largest([spans.gap2(0), spans.gap2(1), spans.gap2(2)]);
        let axis2 = axis2 + W::splat(3.0);
        // Box 2 has to be better by the bias, but where the boxes are apart.
        let biased = best1 + self.size * W::splat(FACE_BIAS);
        let (second, second_gap) = (best2.if_above(biased, axis2, axis1), best2.if_above(biased, best2, best1));
        let second = best2.if_above(self.margin, axis2, second);
        let second_gap = best2.if_above(self.margin, best2, second_gap);
        (best1.if_above(self.margin, axis1, second), best1.if_above(self.margin, best1, second_gap))
    }
}

/// The edge pair with the largest gap, if that is above `floor`.
#[inline(always)]
fn best_edge<W: Number>(spans: &Spans<W>, floor: W) -> (W, W) {
    let (mut axis, mut best) = (W::ZERO, floor);
    for i in 0..3 {
        for j in 0..3 {
            let gap = spans.edge_gap(i, j, floor);
            axis = gap.if_above(best, W::splat((6 + 3 * i + j) as f32), axis);
            best = gap.if_above(best, gap, best);
        }
    }
    (axis, best)
}

/// Index and value of the largest of three, the first of those that are equal.
#[inline(always)]
fn largest<W: Number>([x, y, z]: [W; 3]) -> (W, W) {
    let (axis, best) = (y.if_above(x, W::splat(1.0), W::ZERO), y.if_above(x, y, x));
    (z.if_above(best, W::splat(2.0), axis), z.if_above(best, z, best))
}

/// In each lane one of the three columns.
#[inline(always)]
pub(super) fn pick_column<W: Number>(which: W, c: &Columns<W>) -> LaneVec3<W> {
    LaneVec3 {
        x: pick(which, [c[0].x, c[1].x, c[2].x]),
        y: pick(which, [c[0].y, c[1].y, c[2].y]),
        z: pick(which, [c[0].z, c[1].z, c[2].z]),
    }
}
