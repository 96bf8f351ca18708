//! The separating axis test of cuboid pairs, `L` side by side.
//!
//! Every lane goes through all fifteen axes: an early way out for one would not stop the others, and a whole test costs less
//! than fetching the boxes.

use super::lanes::{CuboidLanes, Pick};
use super::{EDGE_GAIN, FACE_BIAS, PARALLEL};
use crate::math::Real;
use crate::simd::{Number, Wide, WideVec3};

/// `c[j]`: axis `j` of box 2 in the frame of box 1.
pub(super) type Columns<const L: usize> = [WideVec3<L>; 3];

/// What the axes tell: 0–2 are faces of box 1, 3–5 faces of box 2, `6 + 3 i + j` the edges `i × j`.
pub(crate) struct Axes<const L: usize> {
    /// The face to build the contact on, or one along which the boxes are apart.
    pub(super) face: Wide<L>,
    pub(super) face_gap: Wide<L>,
    /// The pair of edges that is better than the face; 0 for none.
    pub(super) edge: Wide<L>,
    pub(super) edge_gap: Wide<L>,
    /// Positive where the boxes are apart by more than the margin.
    apart: Wide<L>,
}

impl<const L: usize> Axes<L> {
    /// Nothing tested.
    pub(crate) const EMPTY: Self =
        Self { face: Wide::ZERO, face_gap: Wide::ZERO, edge: Wide::ZERO, edge_gap: Wide::ZERO, apart: Wide::ZERO };

    /// What the axes of a lane tell; nothing if its boxes are apart by more than the margin.
    #[inline(always)]
    pub(crate) fn near(&self, lane: usize) -> Option<Near> {
        let near = Near {
            face: self.face[lane],
            face_gap: self.face_gap[lane],
            edge: self.edge[lane],
            edge_gap: self.edge_gap[lane],
        };
        (self.apart[lane] <= 0.0).then_some(near)
    }

    /// Puts into a lane what its axes have told.
    #[inline(always)]
    pub(crate) fn set(&mut self, lane: usize, near: &Near) {
        self.face[lane] = near.face;
        self.face_gap[lane] = near.face_gap;
        self.edge[lane] = near.edge;
        self.edge_gap[lane] = near.edge_gap;
    }
}

/// One lane of [`Axes`], of boxes that are not apart.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Near {
    face: Real,
    face_gap: Real,
    edge: Real,
    edge_gap: Real,
}

impl<const L: usize> CuboidLanes<L> {
    /// Tests the fifteen axes.
    #[inline(always)]
    pub(crate) fn test_axes(&self) -> Axes<L> {
        let columns = self.pose.rotation.axes();
        let (face, face_gap) = self.best_face(&columns);
        let floor = face_gap + self.size * Wide::splat(EDGE_GAIN);
        let (edge, edge_gap) = self.best_edge(&columns, floor);
        let one = Wide::splat(1.0);
        let by_edge = edge.if_positive(edge_gap.if_above(self.margin, one, Wide::ZERO), Wide::ZERO);
        let apart = face_gap.if_above(self.margin, one, by_edge);
        Axes { face, face_gap, edge, edge_gap, apart }
    }

    #[inline(always)]
    fn best_face(&self, c: &Columns<L>) -> (Wide<L>, Wide<L>) {
        let (a, b, t) = (self.half1.columns(), self.half2.columns(), self.pose.position.columns());
        let row = c.each_ref().map(WideVec3::columns);
        let reach1 = |i: usize| row[0][i].abs() * b[0] + row[1][i].abs() * b[1] + row[2][i].abs() * b[2];
        let gap1: [Wide<L>; 3] = std::array::from_fn(|i| t[i].abs() - a[i] - reach1(i));
        let gap2: [Wide<L>; 3] = std::array::from_fn(|j| {
            let along = row[j][0] * t[0] + row[j][1] * t[1] + row[j][2] * t[2];
            along.abs() - b[j] - (row[j][0].abs() * a[0] + row[j][1].abs() * a[1] + row[j][2].abs() * a[2])
        });
        let (axis1, best1) = largest(&gap1);
        let (axis2, best2) = largest(&gap2);
        let axis2 = axis2 + Wide::splat(3.0);
        // Box 2 has to be better by the bias, but where the boxes are apart.
        let biased = best1 + self.size * Wide::splat(FACE_BIAS);
        let (second, second_gap) = (best2.if_above(biased, axis2, axis1), best2.if_above(biased, best2, best1));
        let second = best2.if_above(self.margin, axis2, second);
        let second_gap = best2.if_above(self.margin, best2, second_gap);
        (best1.if_above(self.margin, axis1, second), best1.if_above(self.margin, best1, second_gap))
    }

    /// The edge pair with the largest gap, if that is above `floor`.
    #[inline(always)]
    fn best_edge(&self, columns: &Columns<L>, floor: Wide<L>) -> (Wide<L>, Wide<L>) {
        let (a, b, t) = (self.half1.columns(), self.half2.columns(), self.pose.position.columns());
        let c = columns.each_ref().map(WideVec3::columns);
        let (mut axis, mut best) = (Wide::ZERO, floor);
        for i in 0..3 {
            let (i1, i2) = ((i + 1) % 3, (i + 2) % 3);
            for j in 0..3 {
                let (j1, j2) = ((j + 1) % 3, (j + 2) % 3);
                let reach1 = a[i1] * c[j][i2].abs() + a[i2] * c[j][i1].abs();
                let reach2 = b[j1] * c[j2][i].abs() + b[j2] * c[j1][i].abs();
                let gap = (t[i2] * c[j][i1] - t[i1] * c[j][i2]).abs() - (reach1 + reach2);
                let squared = c[j][i1] * c[j][i1] + c[j][i2] * c[j][i2];
                // Parallel edges are left to the faces: no gap at all.
                let gap = squared.if_above(Wide::splat(PARALLEL), gap / squared.sqrt(), floor);
                axis = gap.if_above(best, Wide::splat((6 + 3 * i + j) as f32), axis);
                best = gap.if_above(best, gap, best);
            }
        }
        (axis, best)
    }
}

/// Index and value of the largest of three, the first of those that are equal.
#[inline(always)]
fn largest<const L: usize>(values: &[Wide<L>; 3]) -> (Wide<L>, Wide<L>) {
    let [x, y, z] = *values;
    let (axis, best) = (y.if_above(x, Wide::splat(1.0), Wide::ZERO), y.if_above(x, y, x));
    (z.if_above(best, Wide::splat(2.0), axis), z.if_above(best, z, best))
}

/// In each lane one of the three columns.
#[inline(always)]
pub(super) fn pick_column<const L: usize>(which: &Pick<L>, c: &Columns<L>) -> WideVec3<L> {
    WideVec3 {
        x: which.of([c[0].x, c[1].x, c[2].x]),
        y: which.of([c[0].y, c[1].y, c[2].y]),
        z: which.of([c[0].z, c[1].z, c[2].z]),
    }
}
