//! Clipping of a face against the side planes of another, and the choice of the four points that carry a contact best.
//!
//! Clipping is Sutherland and Hodgman's ("Reentrant polygon clipping", 1974): each plane cuts the polygon into one
//! with at most one more corner. The choice keeps the deepest point, then adds the one farthest from it, the one that
//! makes the largest triangle and the one that adds most area to it. Equal candidates go to the lowest index, and a
//! candidate must win by a relative [`TIE`], so that rounding does not make a resting contact jump from one equal
//! choice to the next.

use crate::math::{Real, Vec3, max, min, tangents};

/// A candidate must beat the best so far by this share: the eight points of two crossed boxes stay where they are.
const TIE: Real = 1e-3;

/// A corner of a clipped face: where it is, how far in front of the reference face, which features made it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct ClipPoint {
    /// On the incident face.
    pub position: Vec3,
    /// Signed distance to the plane of the reference face.
    pub separation: Real,
    /// Stable from step to step while the same features meet.
    pub feature: u32,
}

/// Cuts the polygon by `normal · x <= offset`; `features` names the corners that the cut makes.
///
/// `feature` of a corner made on the edge that leaves corner `c` is `(c.feature << 12) ^ cut`, with the top bit telling
/// which way the edge crosses. Returns the new count; `output` needs room for one more corner than `input`: only a
/// polygon that rounding has bent inwards could make more, and those are left out.
pub(crate) fn clip_polygon(input: &[ClipPoint], plane: (Vec3, Real), cut: u32, output: &mut [ClipPoint]) -> usize {
    let Some(last) = input.last() else { return 0 };
    let mut count = 0;
    let mut previous = *last;
    let mut previous_distance = plane.0.dot(previous.position) - plane.1;
    for &current in input {
        let distance = plane.0.dot(current.position) - plane.1;
        if (previous_distance <= 0.0) != (distance <= 0.0) && count < output.len() {
            let t = previous_distance / (previous_distance - distance);
            let direction = if distance <= 0.0 { 0x8000_0000 } else { 0 };
            output[count] = ClipPoint {
                position: previous.position + (current.position - previous.position) * t,
                separation: previous.separation + (current.separation - previous.separation) * t,
                feature: (previous.feature.wrapping_mul(0x9E37_79B1) & 0x7FFF_F000) ^ (cut + 1) ^ direction,
            };
            count += 1;
        }
        if distance <= 0.0 && count < output.len() {
            output[count] = current;
            count += 1;
        }
        (previous, previous_distance) = (current, distance);
    }
    count
}

/// Chooses at most four of the points (on a plane with `normal`): their indices and how many.
///
/// `size` is a length of the shapes: points less deep than the deepest by under a ten thousandth of it count as
/// deepest.
#[inline(always)]
pub(crate) fn reduce(points: &[ClipPoint], normal: Vec3, size: Real) -> ([usize; 4], usize) {
    if points.len() <= 4 {
        return ([0, 1, 2, 3], points.len());
    }
    let (u, v) = tangents(normal);
    let flat = |i: usize| (points[i].position.dot(u), points[i].position.dot(v));
    choose_four(points.len(), flat, |i| points[i].separation, size)
}

/// [`reduce`] for five or more points in the coordinates of their plane.
#[inline(always)]
pub(crate) fn choose_four(
    count: usize,
    position: impl Fn(usize) -> (Real, Real),
    separation: impl Fn(usize) -> Real,
    size: Real,
) -> ([usize; 4], usize) {
    let lowest = (0..count).fold(Real::MAX, |m, i| min(separation(i), m));
    let a = (0..count).position(|i| separation(i) <= lowest + 1e-4 * size).unwrap_or(0);
    let (ax, ay) = position(a);
    let b = best(count, |i| {
        let (x, y) = position(i);
        (x - ax) * (x - ax) + (y - ay) * (y - ay)
    });
    let beyond = |i: usize, (px, py): (Real, Real), (qx, qy): (Real, Real)| {
        let (x, y) = position(i);
        (x - px) * (qy - py) - (y - py) * (qx - px)
    };
    let (pa, pb) = ((ax, ay), position(b));
    let c = best(count, |i| beyond(i, pa, pb).abs());
    // Wind a, b, c so that what is inside is not beyond; a point outside adds the triangle over the side that it is
    // beyond.
    let (pb, pc) = if beyond(c, pa, pb) < 0.0 { (pb, position(c)) } else { (position(c), pb) };
    let d = best(count, |i| max(max(beyond(i, pa, pb), beyond(i, pb, pc)), max(beyond(i, pc, pa), 0.0)));
    // Points that coincide give no length or area, and are found twice: drop them.
    let mut chosen = ([a, 0, 0, 0], 1);
    for index in [b, c, d] {
        if !chosen.0[..chosen.1].contains(&index) {
            chosen.0[chosen.1] = index;
            chosen.1 += 1;
        }
    }
    chosen
}

/// The index with the largest score; the lowest of those that are equal.
#[inline(always)]
fn best(count: usize, score: impl Fn(usize) -> Real) -> usize {
    // Selects, not branches: which of eight equal corners is a hair farther cannot be foretold.
    let (mut index, mut floor) = (0, score(0) * (1.0 + TIE));
    for i in 1..count {
        let s = score(i);
        let wins = s > floor;
        index = std::hint::select_unpredictable(wins, i, index);
        floor = std::hint::select_unpredictable(wins, s * (1.0 + TIE), floor);
    }
    index
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ring(count: usize) -> Vec<ClipPoint> {
        (0..count)
            .map(|i| {
                let angle = std::f64::consts::TAU * i as f64 / count as f64;
                ClipPoint {
                    position: Vec3::new(libm::cos(angle) as Real, 0.0, -libm::sin(angle) as Real),
                    separation: -0.1,
                    feature: i as u32,
                }
            })
            .collect()
    }

    fn chosen(points: &[ClipPoint]) -> Vec<u32> {
        let (indices, count) = reduce(points, Vec3::Y, 1.0);
        let mut features: Vec<u32> = indices[..count].iter().map(|&i| points[i].feature).collect();
        features.sort_unstable();
        features
    }

    /// The four points of an octagon are a square, whichever of its corners comes first (PM2).
    #[test]
    fn an_octagon_reduces_to_the_same_square_for_every_even_rotation() {
        let points = ring(8);
        assert_eq!(chosen(&points), [0, 2, 4, 6]);
        for shift in [2, 4, 6] {
            let mut turned = points.clone();
            turned.rotate_left(shift);
            assert_eq!(chosen(&turned), [0, 2, 4, 6]);
            turned.reverse();
            turned.rotate_right(1);
            assert_eq!(chosen(&turned), [0, 2, 4, 6]);
        }
    }

    #[test]
    fn the_deepest_point_stays_even_inside_the_patch() {
        let mut points = ring(8);
        points.push(ClipPoint { position: Vec3::new(0.1, 0.0, 0.1), separation: -0.2, feature: 77 });
        assert!(chosen(&points).contains(&77));
    }

    #[test]
    fn clipping_a_square_by_a_diagonal_leaves_a_triangle() {
        let square = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(x, z)| ClipPoint {
            position: Vec3::new(x, 0.0, z),
            separation: x,
            feature: 1,
        });
        let mut output = [ClipPoint::default(); 5];
        let n = Vec3::new(1.0, 0.0, 1.0);
        let count = clip_polygon(&square, (n, 1.5), 3, &mut output);
        assert_eq!(count, 5);
        assert!(
            output[..count]
                .iter()
                .all(|p| n.dot(p.position) <= 1.5 + 1e-6 && (p.separation - p.position.x).abs() < 1e-6)
        );
        let count = clip_polygon(&square, (n, -1.0), 3, &mut output);
        assert_eq!(count, 0);
    }
}
