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
//! ends there), and the lowest and highest point of blocks of 4 × 4, 16 × 16, … cells: 6.6 bytes a cell. All else is
//! made from the heights when it is asked for, by the same rules as for meshes (`mesh_edges`), so contacts are those of
//! the same mesh.
//!
//! The outer border, unless it is told to end there, goes on beside the field for all that the field knows: it pushes along the
//! faces only, never from its rim, so tiles laid side by side, on one body or on many, have no seam that a wheel could feel.
//!
//! Searches go down the blocks, near ones first (`blocks`), and look at rows of four cells, eight triangles, at once.

mod blocks;
mod edges;
#[cfg(test)]
mod tests;

use super::geometry::Geometry;
use super::mesh::{Facet, MeshRayHit, MeshSides, unit_normal};
use super::mesh_tree::LEAF;
use super::ray::{Ray, ShapeHit};
use super::surface::Surface;
use super::surface_ray::first_triangle;
use super::{MassProperties, ShapeError, positive};
use crate::math::{Aabb, Real, Vec3};
use crate::simd::{LaneVec3, Lanes};
use blocks::Level;

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
/// Cells at most: triangle numbers fit 32 bits.
const MOST_CELLS: usize = 1 << 30;

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

    /// The same with materials: for each cell, row by row, which of
    /// [`ShapeDefinition::palette`](crate::ShapeDefinition::palette).
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
        let (distance, index, _) = first_triangle(Surface::Field(self), (origin, direction, limit), MeshSides::One)?;
        Some(MeshRayHit { distance, normal: self.facet(index).normal(), triangle: index as u32 })
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
