//! Height fields: grids of heights as ground, with holes and materials per cell.
//!
//! Corner `(column, row)` of the grid lies at `(column · cell_x, height, row · cell_z)` of the shape's frame, heights are
//! listed row by row. Each cell is cut along a diagonal into two triangles that face up; all below them is solid. Triangle
//! `2 · cell + k` is the half `k` of a cell, `cell = row · columns + column`:
//!
//! ```text
//!     x →   falling          rising
//!   z   p00 ──── p10     p00 ──── p10
//!   ↓    │ 0   ╱ │        │ ╲   1 │        the first corner of each half is the one with the right angle,
//!        │   ╱ 1 │        │ 0  ╲  │        its second edge the diagonal
//!       p01 ──── p11     p01 ──── p11
//! ```
//!
//! A field keeps its heights, a byte a cell (by which kind of bend the surface crosses its low-x edge, its low-z edge and its
//! diagonal; whether it is a hole; which diagonal), a byte a corner (whether an edge that can touch, or any that is not flat,
//! ends there), and the lowest and highest point of blocks of 4 × 4, 16 × 16, … cells: 6.6 bytes a cell. All else is made from
//! the heights when it is asked for, by the same rules as for meshes (`mesh_edges`), so contacts are those of the same mesh.
//!
//! The outer border, unless it is told to end there, goes on beside the field for all that the field knows: it pushes along the
//! faces only, never from its rim, so tiles laid side by side, on one body or on many, have no seam that a wheel could feel.
//!
//! Rays walk the grid: strips of blocks across the longer way of the ray, in each the one or two blocks that it crosses, then
//! the strips of the blocks within. Strips are widened by more than rounding, and the two triangles of a cell are tried with
//! the watertight test of meshes, so nothing slips between cells.

use super::geometry::Geometry;
use super::mesh::{Facet, MeshRayHit, MeshSides, Ray as SharpRay, unit_normal};
use super::mesh_edges::{Bend, EdgeKind, Surroundings, kind_between};
use super::mesh_tree::{LEAF, Leaves};
use super::{MassProperties, ShapeError, positive};
use crate::math::{Aabb, Real, Vec3, max, max3, min, min3};
use crate::query::{Ray, ShapeHit};
use crate::simd::{KernelOfEight, LaneVec3, Lanes, run_eight};

/// Along which diagonal the cells of a height field are cut.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FieldDiagonals {
    /// From the corner with low x and high z to that with high x and low z.
    #[default]
    Falling,
    /// From the corner with low x and low z to that with high x and high z.
    Rising,
    /// In turns, like a chessboard: no direction is preferred.
    Alternating,
}

/// A side of a height field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FieldSide {
    /// At x = 0.
    LowX,
    /// At the largest x.
    HighX,
    /// At z = 0.
    LowZ,
    /// At the largest z.
    HighZ,
}

/// Ground by a grid of heights, for static and kinematic bodies.
///
/// ```
/// use arbiter3d::{HeightField, math::Vec3};
/// // Three corners along x, two along z: two cells of 1 m × 2 m that rise along x.
/// let field = HeightField::new(vec![0.0, 0.5, 1.0, 0.0, 0.5, 1.0], 3, [1.0, 2.0])?;
/// assert_eq!((field.columns(), field.rows()), (2, 1));
/// let hit = field.cast_ray(Vec3::new(1.5, 5.0, 1.0), -Vec3::Y, 10.0).unwrap();
/// assert!((hit.distance - 4.25).abs() < 1e-6 && hit.triangle / 2 == 1);
/// # Ok::<(), arbiter3d::ShapeError>(())
/// ```
#[derive(Clone, Debug)]
pub struct HeightField {
    /// Cells along x and z.
    columns: usize,
    rows: usize,
    cell: [Real; 2],
    heights: Vec<Real>,
    /// Two bits each: kinds of the low-x edge, of the low-z edge, of the diagonal; [`HOLE`], [`RISING`].
    cells: Vec<u8>,
    /// [`SHARP`] and [`BENT`].
    corners: Vec<u8>,
    /// Of each cell; empty if all are zero.
    materials: Vec<u8>,
    levels: Vec<Level>,
    around: Aabb,
    /// Which sides end: bits by [`FieldSide`].
    ends: u8,
}

const HOLE: u8 = 1 << 6;
const RISING: u8 = 1 << 7;
const SHARP: u8 = 1;
const BENT: u8 = 2;
/// Cells of a block along each side, and blocks of a block of the next level.
const BLOCK: usize = 4;
/// Cells at most: triangle numbers fit 32 bits.
const MOST_CELLS: usize = 1 << 30;

/// Lowest and highest points of square blocks of cells.
#[derive(Clone, Debug)]
struct Level {
    columns: usize,
    blocks: Vec<[Real; 2]>,
}

/// A side of a triangle: three of a cell's five edges.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Side {
    Diagonal,
    Outer(FieldSide),
}

impl HeightField {
    /// A field of heights in metres, given row by row (along z), `points_per_row` along x in each; cells measure `cell` metres
    /// along x and z. No holes, diagonals falling.
    ///
    /// # Errors
    /// If there are fewer than 2 × 2 heights, the rows are not all full, a height is not finite, or a cell has no size.
    pub fn new(heights: Vec<Real>, points_per_row: usize, cell: [Real; 2]) -> Result<Self, ShapeError> {
        let points = points_per_row.max(1);
        let (columns, rows) = (points - 1, (heights.len() / points).max(1) - 1);
        let fits = columns.checked_mul(rows).is_some_and(|cells| (1..=MOST_CELLS).contains(&cells));
        if !fits || points * (rows + 1) != heights.len() {
            return Err(ShapeError::FieldSize { heights: heights.len(), points_per_row });
        }
        positive("cell size along x", cell[0])?;
        positive("cell size along z", cell[1])?;
        if let Some(index) = heights.iter().position(|height| !height.is_finite()) {
            let at = [(index % points) as Real * cell[0], (index / points) as Real * cell[1]];
            return Err(ShapeError::NotFinite { index, point: Vec3::new(at[0], heights[index], at[1]) });
        }
        positive("width of the field", columns as Real * cell[0])?;
        positive("length of the field", rows as Real * cell[1])?;
        let mut field = Self {
            columns,
            rows,
            cell,
            cells: vec![0; columns * rows],
            corners: vec![0; heights.len()],
            heights,
            materials: Vec::new(),
            levels: Vec::new(),
            around: Aabb::EMPTY,
            ends: 0,
        };
        field.measure_blocks();
        field.look_at_edges();
        Ok(field)
    }

    /// The same with holes: `holes` tells of each cell, row by row, whether it is missing.
    ///
    /// # Errors
    /// If there are not as many as cells.
    pub fn with_holes(mut self, holes: &[bool]) -> Result<Self, ShapeError> {
        self.check_cells("holes", holes.len())?;
        for (cell, &hole) in self.cells.iter_mut().zip(holes) {
            *cell = if hole { *cell | HOLE } else { *cell & !HOLE };
        }
        self.look_at_edges();
        Ok(self)
    }

    /// The same with materials: for each cell, row by row, which of [`ShapeDefinition::palette`](crate::ShapeDefinition::palette).
    ///
    /// # Errors
    /// If there are not as many as cells.
    pub fn with_materials(mut self, materials: Vec<u8>) -> Result<Self, ShapeError> {
        self.check_cells("materials", materials.len())?;
        self.materials = materials;
        Ok(self)
    }

    /// The same cut along other diagonals.
    #[must_use]
    pub fn with_diagonals(mut self, diagonals: FieldDiagonals) -> Self {
        for (index, cell) in self.cells.iter_mut().enumerate() {
            let (column, row) = (index % self.columns, index / self.columns);
            let rising = match diagonals {
                FieldDiagonals::Falling => false,
                FieldDiagonals::Rising => true,
                FieldDiagonals::Alternating => (column + row) % 2 == 1,
            };
            *cell = if rising { *cell | RISING } else { *cell & !RISING };
        }
        self.look_at_edges();
        self
    }

    /// The same with a side at which the ground ends like a cliff, so that its rim can be touched. By default ground goes on
    /// beside each side, as a neighbouring tile.
    #[must_use]
    pub fn with_end(mut self, side: FieldSide) -> Self {
        self.ends |= 1 << side as u8;
        self.look_at_edges();
        self
    }

    fn check_cells(&self, what: &'static str, given: usize) -> Result<(), ShapeError> {
        let cells = self.cells.len();
        if given == cells { Ok(()) } else { Err(ShapeError::WrongCount { what, given, expected: cells }) }
    }

    /// Cells along x.
    #[must_use]
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Cells along z.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Size of a cell along x and z, metres.
    #[must_use]
    pub fn cell_size(&self) -> [Real; 2] {
        self.cell
    }

    /// Heights of the corners, row by row, metres.
    #[must_use]
    pub fn heights(&self) -> &[Real] {
        &self.heights
    }

    /// Whether a cell, by its number, is missing; those that do not exist are.
    #[must_use]
    pub fn is_hole(&self, cell: usize) -> bool {
        self.cells.get(cell).is_none_or(|bits| bits & HOLE != 0)
    }

    /// Corners of a triangle, counter-clockwise from above; `None` for those of holes and those that do not exist.
    #[must_use]
    pub fn triangle(&self, triangle: usize) -> Option<[Vec3; 3]> {
        (!self.is_hole(triangle / 2)).then(|| self.corners(triangle))
    }

    /// All corners and the triangles of all cells that are no holes.
    pub(super) fn triangles(&self) -> (Vec<Vec3>, Vec<[u32; 3]>) {
        let stride = self.columns + 1;
        let points = (0..self.heights.len()).map(|i| self.point(i % stride, i / stride)).collect();
        let number = |p: Vec3| {
            let place = |x: Real, size: Real| (x / size + 0.5) as usize;
            (place(p.z, self.cell[1]) * stride + place(p.x, self.cell[0])) as u32
        };
        let solid = (0..2 * self.cells.len()).filter(|index| !self.is_hole(index / 2));
        (points, solid.map(|index| self.corners(index).map(number)).collect())
    }

    /// Memory that the field takes, bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let levels: usize = self.levels.iter().map(|level| size_of_val(&level.blocks[..])).sum();
        size_of::<Self>()
            + size_of_val(&self.heights[..])
            + self.cells.len()
            + self.corners.len()
            + self.materials.len()
            + levels
    }

    /// The first triangle that the ray meets from above between `origin` and `origin + limit · direction`. Of triangles met
    /// at the same distance the one with the smallest number is reported.
    #[must_use]
    pub fn cast_ray(&self, origin: Vec3, direction: Vec3, limit: Real) -> Option<MeshRayHit> {
        let sharp = SharpRay::new(origin, direction, &self.around)?;
        let mut walk = FieldRay::new(self, sharp, origin, direction, limit);
        let top = self.levels.len();
        walk.cross(top, [0, 0], [self.columns, self.rows]);
        let (distance, triangle) = walk.best?;
        let normal = self.facet(triangle as usize).normal();
        Some(MeshRayHit { distance, normal, triangle })
    }

    pub(crate) fn local_aabb(&self) -> Aabb {
        self.around
    }

    /// A corner of the grid.
    #[inline(always)]
    fn point(&self, column: usize, row: usize) -> Vec3 {
        let height = self.heights[row * (self.columns + 1) + column];
        Vec3::new(column as Real * self.cell[0], height, row as Real * self.cell[1])
    }

    /// Corners of a triangle: see the picture above.
    #[inline(always)]
    pub(crate) fn corners(&self, index: usize) -> [Vec3; 3] {
        let cell = index / 2;
        let (i, j) = (cell % self.columns, cell / self.columns);
        let p = |right: usize, down: usize| self.point(i + right, j + down);
        match (self.cells[cell] & RISING != 0, index % 2) {
            (false, 0) => [p(0, 0), p(0, 1), p(1, 0)],
            (false, _) => [p(1, 1), p(1, 0), p(0, 1)],
            (true, 0) => [p(0, 1), p(1, 1), p(0, 0)],
            (true, _) => [p(1, 0), p(0, 0), p(1, 1)],
        }
    }

    #[inline(always)]
    pub(crate) fn facet(&self, index: usize) -> Facet {
        let corners = self.corners(index);
        Facet::new(corners, unit_normal(&corners))
    }

    /// The triangles of a leaf side by side; lanes past the last hold that one again.
    #[inline(always)]
    pub(crate) fn corners_of_leaf<W: Lanes<LEAF>>(&self, first: usize, count: usize) -> [LaneVec3<W>; 3] {
        let mut triangles = [[Vec3::ZERO; 3]; LEAF];
        for (lane, corners) in triangles.iter_mut().enumerate() {
            *corners = self.corners(first + lane.min(count - 1));
        }
        let mut lanes = [LaneVec3::ZERO; 3];
        for (i, corner) in lanes.iter_mut().enumerate() {
            let [mut x, mut y, mut z] = [[0.0; LEAF]; 3];
            for (lane, corners) in triangles.iter().enumerate() {
                (x[lane], y[lane], z[lane]) = (corners[i].x, corners[i].y, corners[i].z);
            }
            *corner = LaneVec3 { x: W::from_array(x), y: W::from_array(y), z: W::from_array(z) };
        }
        lanes
    }

    pub(crate) fn has_materials(&self) -> bool {
        !self.materials.is_empty()
    }

    pub(crate) fn material(&self, index: usize) -> u8 {
        self.materials.get(index / 2).copied().unwrap_or(0)
    }

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

    /// Finds the lowest and highest points of all blocks.
    fn measure_blocks(&mut self) {
        let (mut columns, mut rows) = (self.columns, self.rows);
        let mut size = 1;
        self.levels.clear();
        while columns > 1 || rows > 1 || self.levels.is_empty() {
            (columns, rows) = (columns.div_ceil(BLOCK), rows.div_ceil(BLOCK));
            size *= BLOCK;
            let blocks = (0..columns * rows).map(|block| self.measure_block(block % columns, block / columns, size));
            let blocks = blocks.collect();
            self.levels.push(Level { columns, blocks });
        }
        let [low, high] = self.levels[self.levels.len() - 1].blocks[0];
        let far = self.point(self.columns, self.rows);
        self.around = Aabb::new(Vec3::new(0.0, low, 0.0), Vec3::new(far.x, high, far.z));
    }

    /// Lowest and highest point of a block of `size × size` cells, from the blocks that it is made of.
    fn measure_block(&self, column: usize, row: usize, size: usize) -> [Real; 2] {
        let mut range = [Real::MAX, -Real::MAX];
        let mut take = |low: Real, high: Real| range = [min(range[0], low), max(range[1], high)];
        if let Some(level) = self.levels.last() {
            for j in row * BLOCK..((row + 1) * BLOCK).min(level.blocks.len() / level.columns) {
                for i in column * BLOCK..((column + 1) * BLOCK).min(level.columns) {
                    let [low, high] = level.blocks[j * level.columns + i];
                    take(low, high);
                }
            }
            return range;
        }
        for j in row * size..=((row + 1) * size).min(self.rows) {
            for i in column * size..=((column + 1) * size).min(self.columns) {
                let height = self.point(i, j).y;
                take(height, height);
            }
        }
        range
    }

    /// Finds the kinds of all edges and the flags of all corners.
    fn look_at_edges(&mut self) {
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

    /// The cells under a box: first and last column, first and last row; `None` if it is beside or above them all.
    fn cells_under(&self, aabb: &Aabb) -> Option<[usize; 4]> {
        if !aabb.overlaps(&self.around) {
            return None;
        }
        // Casts saturate; a cell more on each side makes up for rounding.
        let first = |low: Real, size: Real| ((low / size) as usize).saturating_sub(1);
        let last = |high: Real, size: Real, count: usize| ((high / size) as usize).min(count - 1);
        let mut range = [
            first(aabb.min.x, self.cell[0]),
            last(aabb.max.x, self.cell[0], self.columns),
            first(aabb.min.z, self.cell[1]),
            last(aabb.max.z, self.cell[1], self.rows),
        ];
        range[0] += usize::from(((range[0] + 1) as Real) * self.cell[0] < aabb.min.x);
        range[2] += usize::from(((range[2] + 1) as Real) * self.cell[1] < aabb.min.z);
        (range[0] <= range[1] && range[2] <= range[3]).then_some(range)
    }

    /// Shows runs of up to four cells under a box, in ascending order.
    #[inline]
    pub(crate) fn walk(&self, aabb: &Aabb, leaves: &mut impl Leaves) {
        if let Some(range) = self.cells_under(aabb) {
            run_eight(FieldWalk { field: self, range, heights: [aabb.min.y, aabb.max.y], leaves });
        }
    }

    /// Calls `visit` with the number of every triangle whose box overlaps `aabb`, in ascending order.
    #[inline]
    pub(crate) fn for_each_facet(&self, aabb: &Aabb, visit: impl FnMut(usize)) {
        self.walk(aabb, &mut Overlapping { field: self, aabb, visit });
    }
}

/// Calls a function with the triangles whose boxes overlap another.
struct Overlapping<'a, F> {
    field: &'a HeightField,
    aabb: &'a Aabb,
    visit: F,
}

impl<F: FnMut(usize)> Leaves for Overlapping<'_, F> {
    #[inline(always)]
    fn leaf<W: Lanes<LEAF>>(&mut self, first: usize, count: usize) {
        for index in first..first + count {
            let [a, b, c] = self.field.corners(index);
            if Aabb::new(min3(a, min3(b, c)), max3(a, max3(b, c))).overlaps(self.aabb) {
                (self.visit)(index);
            }
        }
    }
}

/// A walk over the cells under a box.
struct FieldWalk<'a, V> {
    field: &'a HeightField,
    range: [usize; 4],
    heights: [Real; 2],
    leaves: &'a mut V,
}

impl<V: Leaves> KernelOfEight for FieldWalk<'_, V> {
    #[inline(always)]
    fn run<W: Lanes<LEAF>>(self) {
        let [first_column, last_column, first_row, last_row] = self.range;
        let (field, level) = (self.field, &self.field.levels[0]);
        for row in first_row..=last_row {
            let blocks = row / BLOCK * level.columns;
            let mut column = first_column;
            while column <= last_column {
                let end = ((column / BLOCK + 1) * BLOCK).min(last_column + 1);
                let [low, high] = level.blocks[blocks + column / BLOCK];
                if low <= self.heights[1] && high >= self.heights[0] {
                    let base = row * field.columns;
                    while column < end {
                        let start = column;
                        while column < end && field.cells[base + column] & HOLE == 0 {
                            column += 1;
                        }
                        if column > start {
                            self.leaves.leaf::<W>(2 * (base + start), 2 * (column - start));
                        }
                        column += usize::from(column < end);
                    }
                }
                column = end;
            }
        }
    }
}

/// A ray on its way over the grid. Times are in multiples of its direction.
struct FieldRay<'a> {
    field: &'a HeightField,
    sharp: SharpRay,
    /// In cells along x and z, metres along y.
    origin: [f64; 3],
    direction: [f64; 3],
    /// Axis of the strips: 0 for x, 1 for z.
    major: usize,
    /// How many cells strips are widened by.
    slack: f64,
    reach: Real,
    best: Option<(Real, u32)>,
}

impl<'a> FieldRay<'a> {
    fn new(field: &'a HeightField, sharp: SharpRay, origin: Vec3, direction: Vec3, limit: Real) -> Self {
        let in_cells = |v: Vec3| {
            [f64::from(v.x) / f64::from(field.cell[0]), f64::from(v.z) / f64::from(field.cell[1]), f64::from(v.y)]
        };
        let (origin, direction) = (in_cells(origin), in_cells(direction));
        let major = usize::from(direction[1].abs() > direction[0].abs());
        // Corners are rounded to single precision: by less than this many cells.
        let slack = 1e-6 + 2e-7 * field.columns.max(field.rows) as f64;
        Self { field, sharp, origin, direction, major, slack, reach: limit, best: None }
    }

    /// When the ray is between two lines across an axis; an empty interval if never.
    fn times(&self, axis: usize, low: f64, high: f64) -> [f64; 2] {
        let (a, b) = (low - self.slack - self.origin[axis], high + self.slack - self.origin[axis]);
        let (d, limit) = (self.direction[axis], f64::from(self.reach));
        if d == 0.0 {
            return if a <= 0.0 && b >= 0.0 { [0.0, limit] } else { [1.0, -1.0] };
        }
        let (t0, t1) = if d > 0.0 { (a / d, b / d) } else { (b / d, a / d) };
        [if t0 > 0.0 { t0 } else { 0.0 }, if t1 < limit { t1 } else { limit }]
    }

    /// Least and most of a coordinate between two times.
    fn extent(&self, axis: usize, [t0, t1]: [f64; 2]) -> [f64; 2] {
        let (from, to) = (self.origin[axis] + t0 * self.direction[axis], self.origin[axis] + t1 * self.direction[axis]);
        if self.direction[axis] == 0.0 {
            return [self.origin[axis]; 2]; // an endless ray times nothing is not a number
        }
        if from <= to { [from, to] } else { [to, from] }
    }

    /// Crosses the blocks of a level (cells at level 0) from `low` to `high`, near strips first.
    fn cross(&mut self, level: usize, low: [usize; 2], high: [usize; 2]) {
        let size = BLOCK.pow(level as u32);
        let (major, minor) = (self.major, 1 - self.major);
        let strips = (high[major] - low[major]).div_ceil(size);
        for n in 0..strips {
            let k = if self.direction[major] >= 0.0 { n } else { strips - 1 - n };
            let start = low[major] + k * size;
            let end = (start + size).min(high[major]);
            let times = self.times(major, start as f64, end as f64);
            if times[0] > times[1] {
                continue;
            }
            let [from, to] = self.extent(minor, times);
            if to < low[minor] as f64 - self.slack || from > high[minor] as f64 + self.slack {
                continue;
            }
            let (from, to) = ((from - self.slack) as usize, (to + self.slack) as usize);
            let first = from.max(low[minor]) / size;
            let last = to.min(high[minor] - 1) / size;
            for block in first..=last {
                let mut place = [0; 2];
                (place[major], place[minor]) = (start / size, block);
                self.enter(level, place);
            }
        }
    }

    /// Enters a block of a level, unless the ray passes above or below it.
    fn enter(&mut self, level: usize, place: [usize; 2]) {
        let field = self.field;
        if level == 0 {
            self.try_cell(place[1] * field.columns + place[0]);
            return;
        }
        let size = BLOCK.pow(level as u32);
        let low = [place[0] * size, place[1] * size];
        let high = [(low[0] + size).min(field.columns), (low[1] + size).min(field.rows)];
        let [x, z] = [0, 1].map(|axis| self.times(axis, low[axis] as f64, high[axis] as f64));
        let times = [if x[0] > z[0] { x[0] } else { z[0] }, if x[1] < z[1] { x[1] } else { z[1] }];
        if times[0] > times[1] {
            return;
        }
        let [least, most] = field.levels[level - 1].blocks[place[1] * field.levels[level - 1].columns + place[0]];
        let [bottom, top] = self.extent(2, times);
        let slack = 1e-6 * (f64::from(least).abs() + f64::from(most).abs() + self.origin[2].abs());
        if top < f64::from(least) - slack || bottom > f64::from(most) + slack {
            return;
        }
        self.cross(level - 1, low, high);
    }

    fn try_cell(&mut self, cell: usize) {
        if self.field.is_hole(cell) {
            return;
        }
        for index in [2 * cell, 2 * cell + 1] {
            if let Some((distance, _)) = self.sharp.hit(&self.field.corners(index), MeshSides::One)
                && distance <= self.reach
                && self.best.is_none_or(|best| (distance, index as u32) < best)
            {
                self.reach = distance;
                self.best = Some((distance, index as u32));
            }
        }
    }
}

impl Geometry for HeightField {
    fn local_aabb(&self) -> Aabb {
        self.around
    }

    fn mass_properties(&self, _: Real) -> Result<MassProperties, ShapeError> {
        Err(ShapeError::NoVolume { shape: "a height field", advice: "put it on a static or kinematic body" })
    }

    fn inner_ball(&self) -> (Vec3, Real) {
        (self.around.center(), 0.0)
    }

    fn cast_ray(&self, ray: &Ray) -> Option<ShapeHit> {
        let hit = self.cast_ray(ray.origin, ray.direction, ray.max_fraction)?;
        Some(ShapeHit { fraction: hit.distance, normal: hit.normal })
    }
}

#[cfg(test)]
#[path = "height_field_tests.rs"]
mod tests;
