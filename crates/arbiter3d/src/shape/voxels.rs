//! Voxel grids: cubic cells that are solid or not.
//!
//! Cells are kept as bits in chunks of 8 × 8 × 8, chunks in order of their coordinates, so that memory goes with what is
//! solid. Within a chunk the cells are merged into boxes: along x, then runs of the same length along z, then layers of the
//! same runs along y. Contacts are those with the boxes near a shape; the faces between boxes are known to be inside, as a ray
//! through the grid tells what is behind them.
//!
//! Rays walk from cell to cell: along each axis the next wall is a fixed share of the ray away, and the nearest of the three
//! is crossed. Source: Amanatides and Woo, "A Fast Voxel Traversal Algorithm for Ray Tracing", 1987.
//!
//! Chunks are shared: a changed grid copies the list of chunks, and works anew only on those in which a cell has changed.

use super::compound::moments_of_box;
use super::geometry::Geometry;
use super::mass::Moments;
use super::ray::{Ray, ShapeHit};
use super::{Cuboid, DrawnSurface, MassProperties, ShapeError, positive};
use crate::math::{Aabb, Real, Vec3, max};
use glam::DVec3;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Cells along each side of a chunk.
const SIDE: i32 = 8;
/// Cells of a chunk.
const CELLS: usize = (SIDE * SIDE * SIDE) as usize;
/// How far under its surface, in cells, a cell is looked for.
const UNDER: Real = 0.01;
/// Largest coordinate of a cell: their corners are whole numbers of cells in single precision.
const FARTHEST: i32 = 1 << 20;

/// Cubic cells that are solid or not, for bodies of any kind. It is baked: [`VoxelGrid::with`] gives a changed one.
///
/// Cell `[i, j, k]` fills the cube from `(i, j, k)` to `(i + 1, j + 1, k + 1)` times the cell size.
///
/// ```
/// use arbiter3d::VoxelGrid;
/// let floor = VoxelGrid::new(0.5, (0..100).map(|i| [i % 10, -1, i / 10]))?;
/// let dug = floor.with(&[([3, -1, 3], false)])?;
/// assert_eq!((floor.solid_count(), dug.solid_count()), (100, 99));
/// assert!(floor.is_solid([3, -1, 3]) && !dug.is_solid([3, -1, 3]));
/// # Ok::<(), arbiter3d::ShapeError>(())
/// ```
#[derive(Clone, Debug)]
pub struct VoxelGrid {
    cell_size: Real,
    /// By coordinates z, y, x of chunks.
    chunks: BTreeMap<[i32; 3], Arc<Chunk>>,
    solid: usize,
    aabb: Aabb,
    unit_mass: Result<MassProperties, ShapeError>,
    inner_ball: (Vec3, Real),
    /// Of chunks with a cell whose material is not zero: that of each cell, layer by layer along y, in each row by row along z.
    materials: BTreeMap<[i32; 3], Arc<[u8; CELLS]>>,
}

/// 8 × 8 × 8 cells.
#[derive(Clone, Debug, Default)]
struct Chunk {
    /// A word for each layer along y; bit `8 z + x`.
    layers: [u64; SIDE as usize],
    boxes: Vec<CellBox>,
    /// Of its cells, in cells.
    moments: Moments,
    low: [i32; 3],
    high: [i32; 3],
}

/// Some solid cells of a chunk: corner and size in cells of the grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct CellBox {
    low: [i32; 3],
    high: [i32; 3],
}

impl CellBox {
    fn place(&self, cell_size: Real) -> (Vec3, Vec3) {
        let corner = |c: [i32; 3]| Vec3::from_array(c.map(|x| x as Real)) * cell_size;
        let (low, high) = (corner(self.low), corner(self.high));
        ((low + high) * 0.5, (high - low) * 0.5)
    }
}

/// Coordinates of the chunk of a cell, and the bit of the cell in its layer.
fn locate([x, y, z]: [i32; 3]) -> ([i32; 3], usize, u64) {
    let chunk = [z, y, x].map(|c| c.div_euclid(SIDE));
    let [x, y, z] = [x, y, z].map(|c| c.rem_euclid(SIDE) as usize);
    (chunk, y, 1 << (8 * z + x))
}

/// Coordinates of the chunk of a cell, and which of its cells it is.
fn place_in_chunk([x, y, z]: [i32; 3]) -> ([i32; 3], usize) {
    let [cx, cy, cz] = [x, y, z].map(|c| c.rem_euclid(SIDE));
    ([z, y, x].map(|c| c.div_euclid(SIDE)), ((cy * SIDE + cz) * SIDE + cx) as usize)
}

impl Chunk {
    /// Merges the cells into boxes, and sums them up.
    fn bake(&mut self, [cz, cy, cx]: [i32; 3]) {
        let corner = [cx * SIDE, cy * SIDE, cz * SIDE];
        self.boxes.clear();
        self.moments = Moments::default();
        (self.low, self.high) = ([i32::MAX; 3], [i32::MIN; 3]);
        let mut left = self.layers;
        for y in 0..SIDE as usize {
            while left[y] != 0 {
                let size = take_box(&mut left, y);
                let low = [corner[0] + size.x as i32, corner[1] + y as i32, corner[2] + size.z as i32];
                let high = [low[0] + size.along_x as i32, low[1] + size.along_y as i32, low[2] + size.along_z as i32];
                self.boxes.push(CellBox { low, high });
                for axis in 0..3 {
                    self.low[axis] = self.low[axis].min(low[axis]);
                    self.high[axis] = self.high[axis].max(high[axis]);
                }
                let [low, high] = [low, high].map(|c| DVec3::from_array(c.map(f64::from)));
                let moments = moments_of_box((high - low) * 0.5, (high + low) * 0.5);
                self.moments = self.moments.blend(1.0, &moments, 1.0);
            }
        }
    }
}

/// A box of cells within a chunk, from `x, z` of a layer on.
struct Taken {
    x: u32,
    z: u32,
    along_x: u32,
    along_y: usize,
    along_z: u32,
}

/// Takes the first cell that is left in layer `y` out, with as large a box as can be had along x, then z, then y.
fn take_box(left: &mut [u64; SIDE as usize], y: usize) -> Taken {
    let first = left[y].trailing_zeros();
    let (x, z) = (first % 8, first / 8);
    let row = |z: u32| (left[y] >> (8 * z)) as u8;
    let along_x = (row(z) >> x).trailing_ones();
    let run = ((((1_u32 << along_x) - 1) << x) & 0xff) as u8;
    let mut along_z = 1;
    while z + along_z < 8 && row(z + along_z) & run == run {
        along_z += 1;
    }
    let mask = (z..z + along_z).fold(0, |mask, z| mask | u64::from(run) << (8 * z));
    let mut along_y = 1;
    while y + along_y < left.len() && left[y + along_y] & mask == mask {
        along_y += 1;
    }
    left[y..y + along_y].iter_mut().for_each(|layer| *layer &= !mask);
    Taken { x, z, along_x, along_y, along_z }
}

impl VoxelGrid {
    /// A grid of solid cells, each `cell_size` metres long; cells named twice count once.
    ///
    /// # Errors
    /// If the size is not a finite length above zero, there is no cell, or one has a coordinate beyond ±2²⁰.
    pub fn new(cell_size: Real, cells: impl IntoIterator<Item = [i32; 3]>) -> Result<Self, ShapeError> {
        positive("voxel cell size", cell_size)?;
        let mut chunks: BTreeMap<[i32; 3], Chunk> = BTreeMap::new();
        for cell in cells {
            check(cell)?;
            let (chunk, layer, bit) = locate(cell);
            chunks.entry(chunk).or_default().layers[layer] |= bit;
        }
        let bake = |(at, mut chunk): ([i32; 3], Chunk)| {
            chunk.bake(at);
            (at, Arc::new(chunk))
        };
        Self::finish(cell_size, chunks.into_iter().map(bake).collect())
    }

    /// The same grid with other materials: of some cells, solid or not, which of
    /// [`ShapeDefinition::palette`](crate::ShapeDefinition::palette). Cells that are not named keep theirs, at first 0.
    ///
    /// ```
    /// use arbiter3d::VoxelGrid;
    /// let rock = VoxelGrid::new(0.5, [[0, 0, 0], [1, 0, 0]])?;
    /// let with_ore = rock.with_materials(&[([1, 0, 0], 3)])?;
    /// assert_eq!((with_ore.material([0, 0, 0]), with_ore.material([1, 0, 0])), (0, 3));
    /// # Ok::<(), arbiter3d::ShapeError>(())
    /// ```
    ///
    /// # Errors
    /// If a cell has a coordinate beyond ±2²⁰.
    pub fn with_materials(&self, changes: &[([i32; 3], u8)]) -> Result<Self, ShapeError> {
        let mut changed = self.clone();
        for &(cell, material) in changes {
            check(cell)?;
            let (chunk, at) = place_in_chunk(cell);
            if material != changed.material(cell) {
                let cells = changed.materials.entry(chunk).or_insert_with(|| Arc::new([0; CELLS]));
                Arc::make_mut(cells)[at] = material;
            }
        }
        Ok(changed)
    }

    /// Which material of the palette a cell has.
    #[must_use]
    pub fn material(&self, cell: [i32; 3]) -> u8 {
        let (chunk, at) = place_in_chunk(cell);
        self.materials.get(&chunk).map_or(0, |cells| cells[at])
    }

    /// The material of the cell that a point on the surface belongs to; `normal` points outwards there.
    pub(crate) fn material_under(&self, point: Vec3, normal: Vec3) -> u8 {
        if self.materials.is_empty() {
            return 0;
        }
        self.material(self.cell_at(point - normal * (UNDER * self.cell_size)))
    }

    /// The same grid with some cells made solid (`true`) or empty (`false`), the last word on a cell counting. Costs the
    /// chunks of 8 × 8 × 8 cells that change, and a look at every chunk.
    ///
    /// # Errors
    /// If no cell is left, or one has a coordinate beyond ±2²⁰.
    pub fn with(&self, changes: &[([i32; 3], bool)]) -> Result<Self, ShapeError> {
        let mut chunks = self.chunks.clone();
        let mut changed = std::collections::BTreeSet::new();
        for &(cell, solid) in changes {
            check(cell)?;
            if self.is_solid(cell) == solid && !changed.contains(&locate(cell).0) {
                continue;
            }
            let (at, layer, bit) = locate(cell);
            let chunk = Arc::make_mut(chunks.entry(at).or_default());
            if solid {
                chunk.layers[layer] |= bit
            } else {
                chunk.layers[layer] &= !bit
            }
            changed.insert(at);
        }
        for at in changed {
            let empty = chunks.get(&at).is_none_or(|chunk| chunk.layers == [0; SIDE as usize]);
            if empty {
                chunks.remove(&at);
            } else if let Some(chunk) = chunks.get_mut(&at) {
                Arc::make_mut(chunk).bake(at);
            }
        }
        let changed = Self::finish(self.cell_size, chunks)?;
        Ok(Self { materials: self.materials.clone(), ..changed })
    }

    fn finish(cell_size: Real, chunks: BTreeMap<[i32; 3], Arc<Chunk>>) -> Result<Self, ShapeError> {
        if chunks.is_empty() {
            return Err(ShapeError::NoCells);
        }
        let (mut sum, mut aabb) = (Moments::default(), Aabb::EMPTY);
        let (mut solid, mut inner_ball) = (0, (Vec3::ZERO, 0.0));
        for chunk in chunks.values() {
            sum = sum.blend(1.0, &chunk.moments, 1.0);
            solid += chunk.layers.iter().map(|layer| layer.count_ones() as usize).sum::<usize>();
            let (center, half) = CellBox { low: chunk.low, high: chunk.high }.place(cell_size);
            aabb = aabb.union(&Aabb::from_center(center, half));
            for cells in &chunk.boxes {
                let (center, half) = cells.place(cell_size);
                if half.min_element() > inner_ball.1 {
                    inner_ball = (center, half.min_element());
                }
            }
        }
        let scale = glam::DMat3::from_diagonal(DVec3::splat(cell_size.into()));
        let no_volume = ShapeError::NoVolume { shape: "the voxel grid", advice: "use larger or smaller cells" };
        let unit_mass = sum.map(&scale, DVec3::ZERO).unit_mass().ok_or(no_volume);
        Ok(Self { cell_size, chunks, solid, aabb, unit_mass, inner_ball, materials: BTreeMap::new() })
    }

    /// Length of a cell, metres.
    #[must_use]
    pub fn cell_size(&self) -> Real {
        self.cell_size
    }

    /// How many cells are solid.
    #[must_use]
    pub fn solid_count(&self) -> usize {
        self.solid
    }

    /// Whether a cell is solid.
    #[must_use]
    pub fn is_solid(&self, cell: [i32; 3]) -> bool {
        let (chunk, layer, bit) = locate(cell);
        self.chunks.get(&chunk).is_some_and(|chunk| chunk.layers[layer] & bit != 0)
    }

    /// The cell that holds a point of the grid's frame.
    #[must_use]
    pub fn cell_at(&self, point: Vec3) -> [i32; 3] {
        (point / self.cell_size).floor().as_ivec3().to_array()
    }

    /// Calls `visit` with each of the boxes that the solid cells are merged into and that overlap `aabb`: a number that
    /// names it, the box and where its middle is. Always in the same order.
    pub fn for_each_box(&self, aabb: &Aabb, mut visit: impl FnMut(u32, Cuboid, Vec3)) {
        let length = SIDE as Real * self.cell_size;
        let cell = |x: Real| (x / length).floor() as i32; // saturates
        let (low, high) = (aabb.min.to_array().map(cell), aabb.max.to_array().map(|x| cell(x).saturating_add(1)));
        let mut visit_chunk = |at: &[i32; 3], chunk: &Chunk| {
            // The number of the chunk only has to differ from its neighbours'.
            let [z, y, x] = at.map(|c| (c & 15) as u32);
            for (number, cells) in chunk.boxes.iter().enumerate() {
                let (center, half) = cells.place(self.cell_size);
                if let (true, Ok(cuboid)) = (Aabb::from_center(center, half).overlaps(aabb), Cuboid::new(half)) {
                    visit(((z * 16 + y) * 16 + x) << 8 | (number as u32 & 255), cuboid, center);
                }
            }
        };
        let inside = |at: &[i32; 3]| {
            let near = |c: i32, axis: usize| c >= low[axis].saturating_sub(1) && c <= high[axis];
            near(at[0], 2) && near(at[1], 1) && near(at[2], 0)
        };
        let first = [low[2].saturating_sub(1), i32::MIN, i32::MIN];
        // Rows of chunks that the box spans are few next to what lies between them in a large grid.
        let rows = (i64::from(high[2]) - i64::from(low[2]) + 2) * (i64::from(high[1]) - i64::from(low[1]) + 2);
        if rows > 64 {
            self.chunks.range(first..).filter(|(at, _)| inside(at)).for_each(|(at, chunk)| visit_chunk(at, chunk));
            return;
        }
        for z in low[2].saturating_sub(1)..=high[2] {
            for y in low[1].saturating_sub(1)..=high[1] {
                let row = [z, y, low[0].saturating_sub(1)]..=[z, y, high[0]];
                self.chunks.range(row).for_each(|(at, chunk)| visit_chunk(at, chunk));
            }
        }
    }

    /// The first solid cell along a ray in the frame of the grid, and where the ray meets it.
    #[must_use]
    pub fn cast_ray(&self, ray: &Ray) -> Option<([i32; 3], ShapeHit)> {
        let (mut enter, mut leave, mut axis) = (0.0, ray.max_fraction, 3);
        for k in 0..3 {
            let (origin, rate) = (ray.origin[k], ray.direction[k]);
            let (low, high) = (self.aabb.min[k] - origin, self.aabb.max[k] - origin);
            if !(origin.is_finite() && rate.is_finite()) || rate == 0.0 && (low > 0.0 || high < 0.0) {
                return None;
            }
            if rate != 0.0 {
                let (near, far) = if rate > 0.0 { (low / rate, high / rate) } else { (high / rate, low / rate) };
                if near >= enter {
                    (enter, axis) = (near, k);
                }
                leave = crate::math::min(far, leave);
            }
        }
        (enter <= leave).then(|| self.walk(ray, (enter, axis), leave)).flatten()
    }

    /// From cell to cell; the ray enters the grid's box through a wall across `axis` (3: it starts inside).
    fn walk(&self, ray: &Ray, (enter, mut axis): (Real, usize), leave: Real) -> Option<([i32; 3], ShapeHit)> {
        let size = f64::from(self.cell_size);
        let (origin, direction) = (ray.origin.as_dvec3() / size, ray.direction.as_dvec3() / size);
        let at = origin + direction * f64::from(enter);
        let mut cell = at.floor().as_ivec3().to_array();
        let (mut step, mut next, mut every) = ([0; 3], [f64::INFINITY; 3], [f64::INFINITY; 3]);
        for k in 0..3 {
            let rate = direction[k];
            if k == axis {
                // On the wall exactly: rounding may say either side.
                cell[k] = at[k].round() as i32 - i32::from(rate < 0.0);
            } else if rate < 0.0 && f64::from(cell[k]) == at[k] {
                cell[k] -= 1;
            }
            if rate != 0.0 {
                step[k] = if rate > 0.0 { 1 } else { -1 };
                every[k] = 1.0 / rate.abs();
                next[k] = (f64::from(cell[k] + i32::from(rate > 0.0)) - origin[k]) / rate;
            }
        }
        // On a wall at the start, the cell ahead counts as entered through it.
        let mut fraction = f64::from(enter);
        if axis == 3 {
            axis = (0..3).find(|&k| step[k] != 0 && at[k] == at[k].floor()).unwrap_or(3);
        }
        loop {
            if self.is_solid(cell) {
                let mut normal = Vec3::ZERO;
                if axis < 3 {
                    normal[axis] = -step[axis] as Real;
                }
                let fraction = fraction as Real;
                return (fraction <= ray.max_fraction).then_some((cell, ShapeHit { fraction, normal }));
            }
            axis = if next[0] <= next[1] && next[0] <= next[2] { 0 } else { 1 + usize::from(next[2] < next[1]) };
            fraction = next[axis];
            if !(fraction <= f64::from(leave) && fraction.is_finite()) {
                return None;
            }
            cell[axis] += step[axis];
            next[axis] += every[axis];
        }
    }

    /// The boxes, for drawing.
    pub(super) fn triangulate(&self) -> DrawnSurface {
        let (mut corners, mut triangles) = (Vec::new(), Vec::new());
        for cells in self.chunks.values().flat_map(|chunk| &chunk.boxes) {
            let (center, half) = cells.place(self.cell_size);
            let first = corners.len() as u32;
            for bits in 0..8 {
                let sign = |bit: u32| if bits >> bit & 1 == 1 { 1.0 } else { -1.0 };
                corners.push(center + half * Vec3::new(sign(0), sign(1), sign(2)));
            }
            for [a, b, c, d] in [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]] {
                triangles.extend([[a, b, c], [a, c, d]].map(|triangle| triangle.map(|corner: u32| corner + first)));
            }
        }
        (corners, triangles)
    }
}

fn check(cell: [i32; 3]) -> Result<(), ShapeError> {
    if cell.iter().all(|c| (-FARTHEST..FARTHEST).contains(c)) { Ok(()) } else { Err(ShapeError::CellTooFar { cell }) }
}

impl Geometry for VoxelGrid {
    fn local_aabb(&self) -> Aabb {
        self.aabb
    }

    fn mass_properties(&self, density: Real) -> Result<MassProperties, ShapeError> {
        self.unit_mass.clone().map(|mass| mass.scaled(density))
    }

    /// That of the thickest box.
    fn inner_ball(&self) -> (Vec3, Real) {
        self.inner_ball
    }

    fn reach_from(&self, point: Vec3) -> Real {
        let far = |chunk: &Chunk| {
            let (center, half) = CellBox { low: chunk.low, high: chunk.high }.place(self.cell_size);
            Aabb::from_center(center, half).farthest_from(point).length()
        };
        self.chunks.values().fold(0.0, |most, chunk| max(far(chunk), most))
    }

    fn cast_ray(&self, ray: &Ray) -> Option<ShapeHit> {
        self.cast_ray(ray).map(|(_, hit)| hit)
    }
}
