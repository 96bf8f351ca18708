//! Convex decomposition: a closed mesh as a few convex hulls that fill it almost.
//!
//! The solid is cut in two by a plane square to an axis, and each part again, until every part fills its hull but for a small
//! share (its *concavity*) or there are as many as may be. The part whose hull holds most that is empty is cut next, along the
//! plane after which the two hulls hold least that is empty; planes through corners of the part are tried, and some between.
//! At the end neighbours are joined whose common hull is filled well enough. The measure by volume and the greedy choice are
//! those of Mamou's V-HACD (2016, after "A simple and efficient approach for 3D mesh approximate convex decomposition", 2009);
//! the parts are cut exactly instead of being counted in voxels, so that what is made of boxes comes out as these boxes.
//!
//! A part is a chain: triangles of the mesh, clipped, and for each cut a fan that closes them. Fans of a cut that is not
//! convex overlap, with signs that cancel: volumes are right without any polygon being put together. The hull is that of the
//! clipped triangles and of the corners of the part's box that are inside the solid. All in `f64`, in a fixed order.

use super::{ConvexHull, ShapeError, TriangleMesh, positive};
use crate::math::{Real, Vec3};
use glam::DVec3;

/// Planes between the corners that are tried along each axis.
const EVEN_PLANES: usize = 7;
/// Planes through corners that are tried along each axis.
const CORNER_PLANES: usize = 12;
/// Planes closer to the end of a part than this share of its length are not tried.
const LEAST_SLICE: f64 = 1e-3;
/// What an unequal cut costs against what is empty in the hulls: halving a ring empties nothing at first, slicing it would.
const BALANCE: f64 = 0.1;
/// Corners of the hulls by which cuts are judged: with too few, large hulls seem smaller than the two halves of them.
const JUDGED_VERTICES: usize = 200;

/// How finely a mesh is decomposed.
///
/// ```
/// use arbiter3d::DecompositionSettings;
/// let coarse = DecompositionSettings { max_hulls: 8, concavity: 0.1, ..DecompositionSettings::default() };
/// assert_eq!(coarse.max_vertices, 64);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DecompositionSettings {
    /// Most hulls, one or more. Default 32.
    pub max_hulls: usize,
    /// Share of a hull's volume that may be empty, above 0 and below 1; the hulls together hold at most that share that the
    /// mesh does not, unless there are too few. Default 0.05.
    pub concavity: Real,
    /// Most corners of a hull, 4 to 255. Default 64.
    pub max_vertices: usize,
}

impl Default for DecompositionSettings {
    fn default() -> Self {
        Self { max_hulls: 32, concavity: 0.05, max_vertices: 64 }
    }
}

type Triangle = [DVec3; 3];

/// Some of the solid, between planes.
#[derive(Clone)]
struct Part {
    /// Of the mesh, clipped.
    surface: Vec<Triangle>,
    /// What closes it.
    caps: Vec<Triangle>,
    low: DVec3,
    high: DVec3,
    /// Corners of its box inside the solid.
    corners: Vec<DVec3>,
    volume: f64,
    hull_volume: f64,
    /// Whether no cut has been found for it.
    whole: bool,
}

/// A plane square to an axis.
#[derive(Clone, Copy)]
struct Cut {
    axis: usize,
    at: f64,
}

impl TriangleMesh {
    /// Convex hulls that together fill the inside of a closed mesh almost, in its frame: ready as children of a
    /// [`Compound`](super::Compound).
    ///
    /// ```
    /// use arbiter3d::{DecompositionSettings, Shape, TriangleMesh, math::Vec3};
    /// let (corners, triangles) = Shape::cuboid(Vec3::ONE)?.triangulate(1);
    /// let hulls = TriangleMesh::new(corners, triangles)?.convex_decomposition(&DecompositionSettings::default())?;
    /// assert_eq!(hulls.len(), 1);
    /// # Ok::<(), arbiter3d::ShapeError>(())
    /// ```
    ///
    /// # Errors
    /// If the mesh is not closed, or winds the wrong way round, or a setting is out of its range.
    pub fn convex_decomposition(&self, settings: &DecompositionSettings) -> Result<Vec<ConvexHull>, ShapeError> {
        positive("concavity", settings.concavity)?;
        let open = open_edges(self);
        if open > 0 {
            return Err(ShapeError::OpenMesh { edges: open });
        }
        let whole = Part::whole(self);
        if whole.volume <= 0.0 {
            let advice = "turn its triangles around: they wind counter-clockwise seen from outside";
            return Err(ShapeError::NoVolume { shape: "the mesh", advice });
        }
        let concavity = f64::from(settings.concavity);
        let mut parts = divide(whole, settings.max_hulls.max(1), concavity);
        join(&mut parts, concavity);
        let hulls = parts.iter().map(|part| ConvexHull::with_max_vertices(&part.points(), settings.max_vertices));
        // What is too flat for a hull is nothing of the volume.
        let hulls: Vec<ConvexHull> = hulls.filter_map(Result::ok).collect();
        if hulls.is_empty() {
            return Err(ShapeError::NoVolume { shape: "the mesh", advice: "it is too flat for a hull" });
        }
        Ok(hulls)
    }
}

/// How many edges are without a triangle on the other side. Corners at the same place are one.
fn open_edges(mesh: &TriangleMesh) -> usize {
    let bits = |v: Vec3| v.to_array().map(|x| (x + 0.0).to_bits());
    let mut edges = Vec::with_capacity(3 * mesh.triangles().len());
    for triangle in mesh.triangles() {
        let [a, b, c] = triangle.map(|corner| bits(mesh.vertices()[corner as usize]));
        for (from, to) in [(a, b), (b, c), (c, a)] {
            edges.push(if from < to { (from, to, 1) } else { (to, from, -1) });
        }
    }
    edges.sort_unstable();
    let balance =
        |run: &[([u32; 3], [u32; 3], i32)]| run.iter().map(|edge| edge.2).sum::<i32>().unsigned_abs() as usize;
    edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)).map(balance).sum()
}

/// Cuts parts until all are nearly convex or there are enough.
fn divide(whole: Part, most: usize, concavity: f64) -> Vec<Part> {
    let solid = whole.surface.clone();
    let mut parts = vec![whole];
    while parts.len() < most {
        let mut worst: Option<(usize, f64)> = None;
        for (at, part) in parts.iter().enumerate() {
            let empty = part.empty();
            let divides = !part.whole && empty > concavity * part.hull_volume;
            if divides && worst.is_none_or(|(_, most)| empty > most) {
                worst = Some((at, empty));
            }
        }
        let Some((at, _)) = worst else { break };
        match parts[at].best_cut(&solid) {
            Some((low, high)) => {
                parts[at] = low;
                parts.push(high);
            }
            None => parts[at].whole = true,
        }
    }
    parts
}

/// Joins parts whose common hull is filled well enough, the best filled first.
fn join(parts: &mut Vec<Part>, concavity: f64) {
    loop {
        let mut best: Option<(usize, usize, f64)> = None;
        for first in 0..parts.len() {
            for second in first + 1..parts.len() {
                let together = parts[first].volume + parts[second].volume;
                let (a, b) = (&parts[first], &parts[second]);
                let slack = (b.high - b.low + a.high - a.low).max_element() * 1e-6;
                let apart = (a.low - b.high).max(b.low - a.high).max_element() > slack;
                if apart {
                    continue;
                }
                let hull = hull_volume(&[parts[first].points(), parts[second].points()].concat());
                let empty = 1.0 - together / hull;
                if empty <= concavity && best.is_none_or(|(_, _, least)| empty < least) {
                    best = Some((first, second, empty));
                }
            }
        }
        let Some((first, second, _)) = best else { return };
        let other = parts.remove(second);
        let part = &mut parts[first];
        part.surface.extend(other.surface);
        part.corners.extend(other.corners);
        part.volume += other.volume;
        (part.low, part.high) = (part.low.min(other.low), part.high.max(other.high));
    }
}

impl Part {
    fn whole(mesh: &TriangleMesh) -> Self {
        let corner = |corner: u32| mesh.vertices()[corner as usize].as_dvec3();
        let surface: Vec<Triangle> = mesh.triangles().iter().map(|triangle| triangle.map(corner)).collect();
        Self::new(surface, Vec::new(), Vec::new())
    }

    fn new(surface: Vec<Triangle>, caps: Vec<Triangle>, corners: Vec<DVec3>) -> Self {
        let (mut low, mut high) = (DVec3::MAX, DVec3::MIN);
        for &point in surface.iter().flatten().chain(&corners) {
            (low, high) = (low.min(point), high.max(point));
        }
        let middle = (low + high) * 0.5;
        let six = |&[a, b, c]: &Triangle| (a - middle).dot((b - middle).cross(c - middle));
        let volume = surface.iter().chain(&caps).map(six).sum::<f64>() / 6.0;
        let mut part = Self { surface, caps, low, high, corners, volume, hull_volume: 0.0, whole: false };
        part.hull_volume = hull_volume(&part.points());
        part
    }

    /// What its hull is that of.
    fn points(&self) -> Vec<Vec3> {
        let mut points: Vec<Vec3> =
            self.surface.iter().flatten().chain(&self.corners).map(|point| point.as_vec3() + Vec3::ZERO).collect();
        let bits = |p: &Vec3| p.to_array().map(Real::to_bits);
        points.sort_unstable_by_key(bits);
        points.dedup_by_key(|p| bits(p));
        points
    }

    /// Volume of the hull that is empty.
    fn empty(&self) -> f64 {
        if self.hull_volume > self.volume { self.hull_volume - self.volume } else { 0.0 }
    }

    /// The two parts after the best cut.
    fn best_cut(&self, solid: &[Triangle]) -> Option<(Self, Self)> {
        let mut best: Option<(f64, (Self, Self))> = None;
        for axis in 0..3 {
            for at in self.planes(axis) {
                let Some((low, high)) = self.cut(Cut { axis, at }, solid) else { continue };
                let cost = low.empty() + high.empty() + BALANCE * (low.volume - high.volume).abs();
                if best.as_ref().is_none_or(|(least, _)| cost < *least) {
                    best = Some((cost, (low, high)));
                }
            }
        }
        best.map(|(_, parts)| parts)
    }

    /// Where to try cuts along an axis, ascending.
    fn planes(&self, axis: usize) -> Vec<f64> {
        let (low, length) = (self.low[axis], self.high[axis] - self.low[axis]);
        let inside = |&at: &f64| at > low + LEAST_SLICE * length && at < low + (1.0 - LEAST_SLICE) * length;
        let mut corners: Vec<f64> = self.surface.iter().flatten().map(|point| point[axis]).filter(inside).collect();
        corners.sort_unstable_by(f64::total_cmp);
        corners.dedup();
        let count = corners.len().min(CORNER_PLANES);
        let mut planes: Vec<f64> = (0..count).map(|k| corners[k * corners.len() / count]).collect();
        planes.extend((1..=EVEN_PLANES).map(|k| low + length * k as f64 / (EVEN_PLANES + 1) as f64));
        planes.sort_unstable_by(f64::total_cmp);
        planes
    }

    fn cut(&self, cut: Cut, solid: &[Triangle]) -> Option<(Self, Self)> {
        // Corners of both parts' boxes on the plane.
        let (u, v) = ((cut.axis + 1) % 3, (cut.axis + 2) % 3);
        let mut on_plane = Vec::new();
        for bits in 0..4 {
            let mut corner = DVec3::ZERO;
            corner[cut.axis] = cut.at;
            corner[u] = if bits & 1 == 0 { self.low[u] } else { self.high[u] };
            corner[v] = if bits & 2 == 0 { self.low[v] } else { self.high[v] };
            if is_inside(solid, corner) {
                on_plane.push(corner);
            }
        }
        let side = |sign: f64| {
            let (mut surface, mut caps, mut rim) = (Vec::new(), Vec::new(), Vec::new());
            self.surface.iter().for_each(|triangle| cut.clip(sign, triangle, &mut surface, &mut rim));
            self.caps.iter().for_each(|triangle| cut.clip(sign, triangle, &mut caps, &mut rim));
            if let Some(&(apex, _)) = rim.first() {
                caps.extend(rim.iter().map(|&(from, to)| [apex, to, from]));
            }
            let mut corners = on_plane.clone();
            corners.extend(self.corners.iter().filter(|corner| (corner[cut.axis] - cut.at) * sign < 0.0));
            (!surface.is_empty()).then(|| Self::new(surface, caps, corners))
        };
        let (low, high) = (side(1.0)?, side(-1.0)?);
        let least = 1e-6 * self.volume;
        (low.volume > least && high.volume > least).then_some((low, high))
    }
}

impl Cut {
    /// Adds what of a triangle is below the plane (above it for a negative sign), and its edges on the plane to `rim`.
    fn clip(&self, sign: f64, triangle: &Triangle, out: &mut Vec<Triangle>, rim: &mut Vec<(DVec3, DVec3)>) {
        let over = triangle.map(|corner| (corner[self.axis] - self.at) * sign);
        if over.iter().all(|&over| over >= 0.0) {
            return; // Above, or in the plane: then its fans would cancel it.
        }
        let (mut polygon, mut heights) = ([DVec3::ZERO; 4], [0.0; 4]);
        let mut count = 0;
        for k in 0..3 {
            let next = (k + 1) % 3;
            if over[k] <= 0.0 {
                (polygon[count], heights[count]) = (triangle[k], over[k]);
                count += 1;
            }
            if over[k] * over[next] < 0.0 {
                // From the lower corner on either side, so that neighbours get the very same point.
                let (from, to) = if over[k] < 0.0 { (k, next) } else { (next, k) };
                let share = over[from] / (over[from] - over[to]);
                let mut point = triangle[from] + (triangle[to] - triangle[from]) * share;
                point[self.axis] = self.at;
                (polygon[count], heights[count]) = (point, 0.0);
                count += 1;
            }
        }
        for k in 1..count - 1 {
            out.push([polygon[0], polygon[k], polygon[k + 1]]);
        }
        for k in 0..count {
            let next = (k + 1) % count;
            if heights[k] == 0.0 && heights[next] == 0.0 {
                rim.push((polygon[k], polygon[next]));
            }
        }
    }
}

/// Volume of the hull of some points; zero for flat ones.
fn hull_volume(points: &[Vec3]) -> f64 {
    let hull = ConvexHull::with_max_vertices(points, JUDGED_VERTICES);
    hull.map_or(0.0, |hull| f64::from(hull.mass_properties(1.0).mass))
}

/// Whether a point is inside a closed surface: how often a ray leaves it, less how often it enters.
fn is_inside(solid: &[Triangle], point: DVec3) -> bool {
    // Along no axis and no diagonal, past edges and corners that are.
    let direction = DVec3::new(0.6712, 0.5937, 0.4443);
    let mut winding = 0;
    for &[a, b, c] in solid {
        let (e1, e2) = (b - a, c - a);
        let across = direction.cross(e2);
        let determinant = e1.dot(across);
        let from = point - a;
        let (u, q) = (from.dot(across) / determinant, from.cross(e1));
        let (v, t) = (direction.dot(q) / determinant, e2.dot(q) / determinant);
        if u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0 {
            winding += if determinant < 0.0 { 1 } else { -1 };
        }
    }
    winding != 0
}

#[cfg(test)]
#[path = "decomposition_tests.rs"]
mod tests;
