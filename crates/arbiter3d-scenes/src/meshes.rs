//! Triangle meshes and point sets made from formulas. Triangles wind counter-clockwise seen from outside (from above for
//! surfaces).

use crate::turns::sin_cos;
use arbiter3d::math::{Real, Vec3};
use std::f32::consts::{PI, TAU};

/// Corners and triangles of a mesh, ready for [`arbiter3d::Shape::mesh`].
pub type MeshData = (Vec<Vec3>, Vec<[u32; 3]>);

/// A surface over a grid of square cells: `height(i, j)` is the height of the corner at column `i` (along x) and row `j`
/// (along z). The first corner lies at `origin`.
pub fn surface(
    columns: usize,
    rows: usize,
    cell: Real,
    origin: Vec3,
    mut height: impl FnMut(usize, usize) -> Real,
) -> MeshData {
    let mut vertices = Vec::with_capacity((columns + 1) * (rows + 1));
    for i in 0..=columns {
        for j in 0..=rows {
            vertices.push(origin + Vec3::new(i as Real * cell, height(i, j), j as Real * cell));
        }
    }
    let mut triangles = Vec::with_capacity(2 * columns * rows);
    let stride = rows as u32 + 1;
    for i in 0..columns as u32 {
        for j in 0..rows as u32 {
            let a = i * stride + j;
            triangles.push([a, a + 1, a + stride]);
            triangles.push([a + 1, a + stride + 1, a + stride]);
        }
    }
    (vertices, triangles)
}

/// A flat square grid at y = 0, centred at the origin.
#[must_use]
pub fn grid(cells: usize, cell: Real) -> MeshData {
    let half = 0.5 * cells as Real * cell;
    surface(cells, cells, cell, Vec3::new(-half, 0.0, -half), |_, _| 0.0)
}

/// A wave of `amplitude` with `row_frequency` and `column_frequency` waves a metre along x and z, both counted from the
/// corner with the smallest coordinates; centred at the origin (the ground of Box3D's `trees` scenes).
#[must_use]
pub fn wave(columns: usize, rows: usize, cell: Real, amplitude: Real, frequencies: [Real; 2]) -> MeshData {
    let origin = Vec3::new(-0.5 * columns as Real * cell, 0.0, -0.5 * rows as Real * cell);
    let sine = |count: usize, frequency: Real| -> Vec<Real> {
        (0..=count).map(|i| sin_cos(TAU * frequency * (i as Real * cell)).0).collect()
    };
    let (along_x, along_z) = (sine(columns, frequencies[0]), sine(rows, frequencies[1]));
    surface(columns, rows, cell, origin, |i, j| amplitude * along_x[i] * along_z[j])
}

/// A torus about the z axis: `major` is the radius of the ring, `tube` that of its cross-section, metres.
#[must_use]
pub fn torus(ring_segments: usize, tube_segments: usize, major: Real, tube: Real) -> MeshData {
    let mut vertices = Vec::with_capacity(ring_segments * tube_segments);
    for i in 0..ring_segments {
        let (sin_ring, cos_ring) = sin_cos(TAU * i as Real / ring_segments as Real);
        for j in 0..tube_segments {
            let (sin_tube, cos_tube) = sin_cos(TAU * j as Real / tube_segments as Real);
            let radius = major + tube * cos_tube;
            vertices.push(Vec3::new(radius * cos_ring, radius * sin_ring, tube * sin_tube));
        }
    }
    let mut triangles = Vec::with_capacity(2 * ring_segments * tube_segments);
    let index = |i: usize, j: usize| ((i % ring_segments) * tube_segments + j % tube_segments) as u32;
    for i in 0..ring_segments {
        for j in 0..tube_segments {
            let (a, b) = (index(i, j), index(i + 1, j));
            let (c, d) = (index(i + 1, j + 1), index(i, j + 1));
            triangles.push([a, b, c]);
            triangles.push([a, c, d]);
        }
    }
    (vertices, triangles)
}

/// A gear about the z axis with involute teeth of 25°, from `-half_width` to `half_width`; a tooth lies on the x axis. The
/// pitch circle has the radius `module · teeth / 2`; teeth are 3 % thinner than their gaps.
#[must_use]
pub fn gear(teeth: usize, module: Real, half_width: Real) -> MeshData {
    let profile = gear_profile(teeth, f64::from(module));
    let count = profile.len() as u32;
    let mut vertices: Vec<Vec3> = profile.iter().map(|&[x, y]| Vec3::new(x, y, -half_width)).collect();
    vertices.extend(profile.iter().map(|&[x, y]| Vec3::new(x, y, half_width)));
    vertices.extend([Vec3::new(0.0, 0.0, -half_width), Vec3::new(0.0, 0.0, half_width)]);
    let mut triangles = Vec::with_capacity(4 * profile.len());
    for i in 0..count {
        let next = (i + 1) % count;
        triangles.push([2 * count, next, i]);
        triangles.push([2 * count + 1, count + i, count + next]);
        triangles.push([i, next, count + next]);
        triangles.push([i, count + next, count + i]);
    }
    (vertices, triangles)
}

/// The outline of a gear, counter-clockwise.
fn gear_profile(teeth: usize, module: f64) -> Vec<[Real; 2]> {
    const FLANK_POINTS: usize = 6;
    let pitch = 0.5 * module * teeth as f64;
    let (tip, root) = (pitch + 0.9 * module, pitch - 1.15 * module);
    let pressure = 25.0_f64.to_radians();
    let base = pitch * libm::cos(pressure);
    let unwound = |radius: f64| {
        let t = if radius > base { ((radius / base) * (radius / base) - 1.0).sqrt() } else { 0.0 };
        t - libm::atan(t)
    };
    let step = std::f64::consts::TAU / teeth as f64;
    let half_angle = |radius: f64| 0.2463 * step + unwound(pitch) - unwound(radius);
    let lowest = if base > root { base } else { root };
    let mut flank: Vec<[f64; 2]> = if base > root { vec![[root, half_angle(base) + 0.03 * step]] } else { Vec::new() };
    for k in 0..FLANK_POINTS {
        let radius = lowest + (tip - lowest) * k as f64 / (FLANK_POINTS - 1) as f64;
        flank.push([radius, half_angle(radius)]);
    }
    let mut profile = Vec::with_capacity(teeth * 2 * flank.len());
    for tooth in 0..teeth {
        let middle = step * tooth as f64;
        let rising = flank.iter().map(|&[radius, angle]| (radius, middle - angle));
        let falling = flank.iter().rev().map(|&[radius, angle]| (radius, middle + angle));
        let point =
            |(radius, angle): (f64, f64)| [(radius * libm::cos(angle)) as Real, (radius * libm::sin(angle)) as Real];
        profile.extend(rising.chain(falling).map(point));
    }
    profile
}

/// Corners of an upright prism with `sides` sides between the heights `low` and `high`: a cylinder of hulls.
#[must_use]
pub fn prism(sides: usize, radius: Real, low: Real, high: Real) -> Vec<Vec3> {
    let corner = |i: usize, y: Real| {
        let (s, c) = sin_cos(TAU * i as Real / sides as Real);
        Vec3::new(radius * c, y, radius * s)
    };
    (0..sides).flat_map(|i| [corner(i, low), corner(i, high)]).collect()
}

/// Points spread evenly over a sphere by the golden angle: the rocks of Box3D's `junkyard`.
#[must_use]
pub fn fibonacci_sphere(count: usize, radius: Real) -> Vec<Vec3> {
    let golden_ratio = 0.5 * (1.0 + 5.0_f32.sqrt());
    let point = |i: usize| {
        let z = 1.0 - (2 * i + 1) as Real / count as Real;
        let ring = (1.0 - z * z).sqrt();
        let (s, c) = sin_cos(i as Real * (2.0 * PI) / golden_ratio);
        Vec3::new(ring * c, ring * s, z) * radius
    };
    (0..count).map(point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn normal(mesh: &MeshData, triangle: [u32; 3]) -> Vec3 {
        let [a, b, c] = triangle.map(|i| mesh.0[i as usize]);
        (b - a).cross(c - a)
    }

    #[test]
    fn a_grid_faces_up_and_has_its_area() {
        let mesh = grid(8, 1.875);
        assert!(mesh.1.iter().all(|&t| normal(&mesh, t).y > 0.0));
        let area: Real = mesh.1.iter().map(|&t| 0.5 * normal(&mesh, t).length()).sum();
        assert!((area - 225.0).abs() < 1e-3);
    }

    #[test]
    fn a_torus_faces_outward_and_encloses_its_volume() {
        let mesh = torus(64, 64, 3.75, 1.0);
        // Divergence theorem: the volume is the sum of the tetrahedra to the origin, positive for outward winding.
        let volume: Real = mesh.1.iter().map(|&t| mesh.0[t[0] as usize].dot(normal(&mesh, t)) / 6.0).sum();
        let exact = 2.0 * PI * PI * 3.75;
        assert!((volume / exact - 1.0).abs() < 0.01, "{volume} {exact}");
    }

    #[test]
    fn waves_have_the_counts_that_box3d_publishes() {
        for (scale, triangles) in [(1, 60_000), (2, 240_000)] {
            let mesh = wave(150 * scale, 200 * scale, 1.0 / scale as Real, 0.4, [0.1, 0.05]);
            assert_eq!(mesh.1.len(), triangles);
            let top = mesh.0.iter().map(|v| v.y).fold(0.0, Real::max);
            assert!(top > 0.35 && top <= 0.4);
        }
    }

    #[test]
    fn points_of_a_prism_and_of_a_rock_lie_at_their_radius() {
        assert!(prism(6, 0.75, 0.0, 2.0).iter().all(|p| (p.x.hypot(p.z) - 0.75).abs() < 1e-6));
        let rock = fibonacci_sphere(10, 1.5);
        assert!(rock.len() == 10 && rock.iter().all(|p| (p.length() - 1.5).abs() < 1e-6));
    }
}
