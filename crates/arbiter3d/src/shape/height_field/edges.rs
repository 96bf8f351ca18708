//! How the surface of a height field goes on across its edges and around its corners: what meshes keep, made here from the
//! heights, but for two bits an edge and a byte a corner.

use super::super::mesh::unit_normal;
use super::super::mesh_edges::{Bend, EdgeKind, Surroundings, kind_between};
use super::{FieldSide, HOLE, HeightField, RISING};
use crate::math::{Real, Vec3};

/// Flags of a corner: an edge that can touch ends there; one that is not flat does.
const SHARP: u8 = 1;
const BENT: u8 = 2;

/// A side of a triangle: three of a cell's five edges.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Side {
    Diagonal,
    Outer(FieldSide),
}

impl HeightField {
    /// The edges of a triangle in order.
    fn sides_of(&self, index: usize) -> [Side; 3] {
        use FieldSide::{HighX, HighZ, LowX, LowZ};
        let [first, last] = match (self.cells[index / 2] & RISING != 0, index % 2) {
            (false, 0) => [LowX, LowZ],
            (false, _) => [HighX, HighZ],
            (true, 0) => [HighZ, LowX],
            (true, _) => [LowZ, HighX],
        };
        [Side::Outer(first), Side::Diagonal, Side::Outer(last)]
    }

    /// The triangle across an edge, if the field has it.
    fn neighbor(&self, index: usize, side: Side) -> Option<usize> {
        let cell = index / 2;
        let (i, j) = (cell % self.columns, cell / self.columns);
        let rising = |cell: usize| usize::from(self.cells[cell] & RISING != 0);
        let found = match side {
            Side::Diagonal => return Some(index ^ 1),
            Side::Outer(FieldSide::LowX) => (i > 0).then(|| 2 * (cell - 1) + 1),
            Side::Outer(FieldSide::HighX) => (i + 1 < self.columns).then(|| 2 * (cell + 1)),
            Side::Outer(FieldSide::LowZ) => {
                (j > 0).then(|| 2 * (cell - self.columns) + 1 - rising(cell - self.columns))
            }
            Side::Outer(FieldSide::HighZ) => {
                (j + 1 < self.rows).then(|| 2 * (cell + self.columns) + rising(cell + self.columns))
            }
        };
        found.filter(|&other| !self.is_hole(other / 2))
    }

    /// Whether an edge is part of the outer border.
    fn is_border(&self, cell: usize, side: FieldSide) -> bool {
        let (i, j) = (cell % self.columns, cell / self.columns);
        match side {
            FieldSide::LowX => i == 0,
            FieldSide::HighX => i + 1 == self.columns,
            FieldSide::LowZ => j == 0,
            FieldSide::HighZ => j + 1 == self.rows,
        }
    }

    fn ends_at(&self, side: FieldSide) -> bool {
        self.ends >> side as u8 & 1 == 1
    }

    /// How the surface goes on across an edge, as kept.
    #[inline]
    fn kind(&self, cell: usize, side: Side) -> EdgeKind {
        let bits = match side {
            Side::Diagonal => self.cells[cell] >> 4,
            Side::Outer(FieldSide::LowX) => self.cells[cell],
            Side::Outer(FieldSide::LowZ) => self.cells[cell] >> 2,
            Side::Outer(outer) if self.is_border(cell, outer) => return self.kind_of_border(outer),
            Side::Outer(FieldSide::HighX) => self.cells[cell + 1],
            Side::Outer(FieldSide::HighZ) => self.cells[cell + self.columns] >> 2,
        };
        match bits & 3 {
            0 => EdgeKind::Flat,
            1 => EdgeKind::Concave,
            2 => EdgeKind::Convex,
            _ => EdgeKind::Boundary,
        }
    }

    /// A border that goes on counts as a groove: what is cut there ends the contact with this field, but nothing is pushed
    /// from the edge.
    fn kind_of_border(&self, side: FieldSide) -> EdgeKind {
        if self.ends_at(side) { EdgeKind::Boundary } else { EdgeKind::Concave }
    }

    /// Unit normal of a triangle and unit vector inwards from one of its edges.
    fn inward(&self, index: usize, edge: usize) -> (Vec3, Vec3) {
        let corners = self.corners(index);
        let normal = unit_normal(&corners);
        let across = normal.cross(corners[(edge + 1) % 3] - corners[edge]);
        (normal, across * (1.0 / across.length()))
    }

    /// The normal and the inward vector at an edge of a triangle, and the inward vector of the neighbour there.
    fn across(&self, index: usize, edge: usize) -> Option<[Vec3; 3]> {
        let side = self.sides_of(index)[edge];
        let other = self.neighbor(index, side)?;
        let back = match side {
            Side::Diagonal => Side::Diagonal,
            Side::Outer(FieldSide::LowX) => Side::Outer(FieldSide::HighX),
            Side::Outer(FieldSide::HighX) => Side::Outer(FieldSide::LowX),
            Side::Outer(FieldSide::LowZ) => Side::Outer(FieldSide::HighZ),
            Side::Outer(FieldSide::HighZ) => Side::Outer(FieldSide::LowZ),
        };
        let other_edge = self.sides_of(other).iter().position(|&s| s == back)?;
        let (normal, own) = self.inward(index, edge);
        Some([normal, own, self.inward(other, other_edge).1])
    }

    /// What is known about the edges and corners of a triangle.
    pub(crate) fn surroundings(&self, index: usize) -> Surroundings {
        let cell = index / 2;
        let sides = self.sides_of(index);
        let flags = self.corner_flags(index);
        let (mut bits, mut bends) = (0, [Bend::default(); 3]);
        for (i, &side) in sides.iter().enumerate() {
            let kind = self.kind(cell, side);
            let sharp = matches!(kind, EdgeKind::Boundary | EdgeKind::Convex);
            bits |= u16::from(sharp) << i;
            bits |= u16::from(kind == EdgeKind::Flat) << (3 + i);
            bits |= u16::from(flags[i] & SHARP != 0) << (6 + i);
            bits |= u16::from(flags[i] & BENT == 0) << (9 + i);
            if sharp {
                // Of other edges nobody asks for the bend.
                bends[i] = match self.across(index, i) {
                    Some([normal, own, neighbor]) => Bend::new(kind, normal, own, neighbor),
                    None => Bend::BOUNDARY,
                };
            }
        }
        Surroundings::from_parts(index as u32, self.slope_number(index), bends, bits)
    }

    /// The flags of the corners of a triangle.
    fn corner_flags(&self, index: usize) -> [u8; 3] {
        let cell = index / 2;
        let base = cell / self.columns * (self.columns + 1) + cell % self.columns;
        let [p00, p10] = [self.corners[base], self.corners[base + 1]];
        let [p01, p11] = [self.corners[base + self.columns + 1], self.corners[base + self.columns + 2]];
        match (self.cells[cell] & RISING != 0, index % 2) {
            (false, 0) => [p00, p01, p10],
            (false, _) => [p11, p10, p01],
            (true, 0) => [p01, p11, p00],
            (true, _) => [p10, p00, p11],
        }
    }

    /// A number of the slopes along x and z in steps of 1/64: equal for triangles of one plane, so that what slides on it
    /// keeps its impulses.
    fn slope_number(&self, index: usize) -> u32 {
        let [a, b, c] = self.corners(index);
        // The corner with the right angle has one neighbour along x, the other along z.
        let (along_x, along_z) = if b.z == a.z { (b, c) } else { (c, b) };
        let slope_x = (along_x.y - a.y) / (along_x.x - a.x);
        let slope_z = (along_z.y - a.y) / (along_z.z - a.z);
        let [x, z] = [slope_x, slope_z].map(|slope| (slope * 64.0 + 32768.5) as u16);
        u32::from(x) << 16 | u32::from(z)
    }

    /// Calls `visit` with the far ends of all edges that meet in a corner until it returns false. Where the border goes on,
    /// edges that lead away from it count as going straight on.
    pub(crate) fn each_end(&self, corner: Vec3, mut visit: impl FnMut(Vec3) -> bool) {
        let nearest = |x: Real, size: Real, most: usize| ((x / size + 0.5) as usize).min(most);
        let (i, j) = (nearest(corner.x, self.cell[0], self.columns), nearest(corner.z, self.cell[1], self.rows));
        let beside = [
            i == 0 && !self.ends_at(FieldSide::LowX) || i == self.columns && !self.ends_at(FieldSide::HighX),
            j == 0 && !self.ends_at(FieldSide::LowZ) || j == self.rows && !self.ends_at(FieldSide::HighZ),
        ];
        for row in j.saturating_sub(1)..=(j + 1).min(self.rows) {
            for column in i.saturating_sub(1)..=(i + 1).min(self.columns) {
                if !self.are_joined([i, j], [column, row]) {
                    continue;
                }
                let end = self.point(column, row);
                if !visit(end) {
                    return;
                }
                if (beside[0] && column != i || beside[1] && row != j) && !visit(corner * 2.0 - end) {
                    return;
                }
            }
        }
    }

    /// Whether an edge joins two corners that are at most one cell apart.
    fn are_joined(&self, from: [usize; 2], to: [usize; 2]) -> bool {
        let solid = |column: usize, row: usize| {
            column < self.columns && row < self.rows && !self.is_hole(row * self.columns + column)
        };
        let (i, j) = (from[0].min(to[0]), from[1].min(to[1]));
        match (from[0] != to[0], from[1] != to[1]) {
            (true, true) => {
                let rising = (from[0] < to[0]) == (from[1] < to[1]);
                solid(i, j) && (self.cells[j * self.columns + i] & RISING != 0) == rising
            }
            (true, false) => solid(i, j) || j > 0 && solid(i, j - 1),
            (false, true) => solid(i, j) || i > 0 && solid(i - 1, j),
            (false, false) => false,
        }
    }

    /// Finds the kinds of all edges and the flags of all corners.
    pub(super) fn look_at_edges(&mut self) {
        for cell in 0..self.cells.len() {
            let diagonal = self.find_kind(cell, Side::Diagonal);
            let low_x = self.find_kind(cell, Side::Outer(FieldSide::LowX));
            let low_z = self.find_kind(cell, Side::Outer(FieldSide::LowZ));
            let kept = self.cells[cell] & (HOLE | RISING);
            self.cells[cell] = kept | diagonal << 4 | low_z << 2 | low_x;
        }
        let mut corners = std::mem::take(&mut self.corners);
        corners.fill(0);
        for index in (0..2 * self.cells.len()).filter(|index| !self.is_hole(index / 2)) {
            let (cell, sides) = (index / 2, self.sides_of(index));
            let base = cell / self.columns * (self.columns + 1) + cell % self.columns;
            let (right, down) = (base + 1, base + self.columns + 1);
            for side in sides {
                let mark = match self.kind(cell, side) {
                    EdgeKind::Flat => continue,
                    EdgeKind::Concave => BENT,
                    EdgeKind::Boundary | EdgeKind::Convex => BENT | SHARP,
                };
                let ends = match side {
                    Side::Diagonal if self.cells[cell] & RISING != 0 => [base, down + 1],
                    Side::Diagonal => [right, down],
                    Side::Outer(FieldSide::LowX) => [base, down],
                    Side::Outer(FieldSide::HighX) => [right, down + 1],
                    Side::Outer(FieldSide::LowZ) => [base, right],
                    Side::Outer(FieldSide::HighZ) => [down, down + 1],
                };
                ends.into_iter().for_each(|end| corners[end] |= mark);
            }
        }
        self.corners = corners;
    }

    /// The kind of one of the edges that a cell keeps, as two bits.
    fn find_kind(&self, cell: usize, side: Side) -> u8 {
        let border = match side {
            Side::Outer(outer) if self.is_border(cell, outer) => Some(self.kind_of_border(outer)),
            _ => None,
        };
        let kind = border.unwrap_or_else(|| {
            if self.is_hole(cell) {
                return EdgeKind::Boundary;
            }
            let on_side = |index: usize| self.sides_of(index).iter().position(|&s| s == side).map(|edge| (index, edge));
            let found = on_side(2 * cell).or_else(|| on_side(2 * cell + 1));
            match found.and_then(|(index, edge)| self.across(index, edge)) {
                Some([normal, own, neighbor]) => kind_between(normal, own, neighbor),
                None => EdgeKind::Boundary,
            }
        });
        match kind {
            EdgeKind::Flat => 0,
            EdgeKind::Concave => 1,
            EdgeKind::Convex => 2,
            EdgeKind::Boundary => 3,
        }
    }
}
