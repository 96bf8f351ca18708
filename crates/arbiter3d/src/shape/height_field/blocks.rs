//! The blocks of a height field: the lowest and highest points of squares of 4 × 4, 16 × 16, … cells, and how searches use
//! them.
//!
//! A box is looked up by its columns and rows; blocks below or above it are passed over. A search that wants the nearest first
//! goes down from the largest block as through the tree of a mesh: sixteen blocks within a block, eight boxes at a time, and
//! in the smallest the four rows, each a leaf of eight triangles.

use super::super::mesh_tree::{Descent, LEAF, Leaves};
use super::{HOLE, HeightField};
use crate::math::{Aabb, Real, Vec3, max, max3, min, min3};
use crate::simd::{KernelOfEight, LaneVec3, Lanes, run_eight};

/// Cells of a block along each side, and blocks of a block of the next level.
const BLOCK: usize = 4;

/// Lowest and highest points of square blocks of cells.
#[derive(Clone, Debug)]
pub(super) struct Level {
    pub(super) columns: usize,
    pub(super) blocks: Vec<[Real; 2]>,
}

impl HeightField {
    /// Finds the lowest and highest points of all blocks.
    pub(super) fn measure_blocks(&mut self) {
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

    /// Shows rows of up to four cells to a search that wants the nearest first.
    #[inline]
    pub(crate) fn descend(&self, limit: Real, search: &mut impl Descent) {
        run_eight(FieldDescent { field: self, limit, search });
    }

    /// Boxes and numbers of the first or the last two rows of blocks within a block, or of all its rows of cells; `None` if
    /// there are none. Lanes left over hold a box that nothing meets.
    #[inline(always)]
    fn halves_of<W: Lanes<LEAF>>(
        &self,
        level: u32,
        block: usize,
        half: usize,
    ) -> Option<(LaneVec3<W>, LaneVec3<W>, [u32; LEAF])> {
        let [mut low, mut high] = [[[Real::MAX; LEAF]; 3], [[-Real::MAX; LEAF]; 3]];
        let mut places = [0; LEAF];
        let own = &self.levels[level as usize - 1];
        let (column, row) = (block % own.columns * BLOCK, block / own.columns * BLOCK);
        if level == 1 {
            if half > 0 {
                return None;
            }
            let last = (column + BLOCK).min(self.columns);
            let [least, most] = own.blocks[block];
            let [start, end] = [column as Real * self.cell[0], last as Real * self.cell[0]];
            for lane in 0..BLOCK.min(self.rows - row) {
                let [near, far] = [row + lane, row + lane + 1].map(|line| line as Real * self.cell[1]);
                for (axis, [from, to]) in [[start, end], [least, most], [near, far]].into_iter().enumerate() {
                    (low[axis][lane], high[axis][lane]) = (from, to);
                }
                places[lane] = ((row + lane) * self.columns + column) as u32;
            }
        } else {
            let (within, size) = (&self.levels[level as usize - 2], BLOCK.pow(level - 1));
            let rows = within.blocks.len() / within.columns;
            let (first, end) = (row + 2 * half, (row + 2 * half + 2).min(rows));
            if first >= end {
                return None;
            }
            let mut lane = 0;
            for j in first..end {
                let [near, far] = [j * size, ((j + 1) * size).min(self.rows)].map(|line| line as Real * self.cell[1]);
                for i in column..(column + BLOCK).min(within.columns) {
                    let lines = [i * size, ((i + 1) * size).min(self.columns)];
                    let [start, end] = lines.map(|line| line as Real * self.cell[0]);
                    let index = j * within.columns + i;
                    let [least, most] = within.blocks[index];
                    (low[0][lane], low[1][lane], low[2][lane]) = (start, least, near);
                    (high[0][lane], high[1][lane], high[2][lane]) = (end, most, far);
                    places[lane] = index as u32;
                    lane += 1;
                }
            }
        }
        let ([x0, y0, z0], [x1, y1, z1]) = (low, high);
        let low = LaneVec3 { x: W::from_array(x0), y: W::from_array(y0), z: W::from_array(z0) };
        let high = LaneVec3 { x: W::from_array(x1), y: W::from_array(y1), z: W::from_array(z1) };
        Some((low, high, places))
    }

    /// Shows the cells of a row of a smallest block, without the holes.
    #[inline(always)]
    fn search_row<W: Lanes<LEAF>>(&self, first: usize, limit: Real, search: &mut impl Descent) -> Real {
        let column = first % self.columns;
        let end = first + BLOCK.min(self.columns - column);
        let (mut cell, mut limit) = (first, limit);
        while cell < end && limit >= 0.0 {
            let start = cell;
            while cell < end && self.cells[cell] & HOLE == 0 {
                cell += 1;
            }
            if cell > start {
                limit = search.leaf::<W>(2 * start, 2 * (cell - start), limit);
            }
            cell += usize::from(cell < end);
        }
        limit
    }

    /// Calls `visit` with the number of every triangle whose box overlaps `aabb`, in ascending order.
    #[inline]
    pub(crate) fn for_each_facet(&self, aabb: &Aabb, visit: impl FnMut(usize)) {
        self.walk(aabb, &mut Overlapping { field: self, aabb, visit });
    }
}

/// A block on the way down, or a row of cells.
#[derive(Clone, Copy)]
struct Place {
    distance: Real,
    /// 0 for a row of up to four cells, which `index` is the first of; else `index` is a block of that level.
    level: u32,
    index: u32,
}

/// A field has at most 2³⁰ cells, so fifteen levels of up to sixteen blocks each.
const MOST_PLACES: usize = 15 * (BLOCK * BLOCK - 1) + 1;

/// A search of the nearest first.
struct FieldDescent<'a, S> {
    field: &'a HeightField,
    limit: Real,
    search: &'a mut S,
}

impl<S: Descent> KernelOfEight for FieldDescent<'_, S> {
    #[inline(always)]
    fn run<W: Lanes<LEAF>>(self) {
        let (field, mut limit) = (self.field, self.limit);
        let mut stack = [Place { distance: 0.0, level: 0, index: 0 }; MOST_PLACES];
        (stack[0].level, stack[0].index) = (field.levels.len() as u32, 0);
        let mut top = 1;
        while top > 0 {
            top -= 1;
            let place = stack[top];
            if place.distance > limit {
                continue;
            }
            if place.level == 0 {
                limit = field.search_row::<W>(place.index as usize, limit, self.search);
                if limit < 0.0 {
                    return;
                }
                continue;
            }
            let bottom = top;
            for half in 0..2 {
                let Some((low, high, places)) = field.halves_of::<W>(place.level, place.index as usize, half) else {
                    break;
                };
                let distances = self.search.distances::<W>(&low, &high, limit);
                let mut lanes = W::splat(Real::MAX).if_above(distances, W::splat(1.0), W::ZERO).positive();
                let distances = distances.to_array();
                while lanes != 0 {
                    let lane = lanes.trailing_zeros() as usize % LEAF;
                    lanes &= lanes - 1;
                    let distance = distances[lane];
                    let mut at = top;
                    while at > bottom && stack[at - 1].distance < distance {
                        stack[at] = stack[at - 1];
                        at -= 1;
                    }
                    stack[at] = Place { distance, level: place.level - 1, index: places[lane] };
                    top += 1;
                }
            }
        }
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
