//! Convex hulls against hulls and cuboids: separating axes from faces and edge pairs, then a clipped face.
//!
//! For a face of one hull the gap is that of its plane to the lowest corner of the other hull. A pair of edges gives a
//! candidate only where it makes a face of the Minkowski difference: where the arcs that join the normals of their
//! faces cross on the unit sphere (Gregorius, "The Separating Axis Test between Convex Polyhedra", GDC 2013). With
//! edge directions `e1`, `e2`, face normals `a`, `b` left and right of `e1`, and `c`, `d` of `e2`, they cross when
//!
//! ```text
//! (c · e1)(d · e1) < 0,   (a · e2)(b · e2) < 0,   (c · e1)(b · e2) < 0
//! ```
//!
//! Most candidates are never looked at. The other hull holds a ball of radius `r` about its centre `m`, so the gap
//! along a unit normal `n` that supports this hull at `v` is at most `n · (m − v) − r`. For an edge, `n` is on the arc
//! between two normals, and `n · (m − v)` is at most the larger of the values at its ends, over the cosine of half the
//! arc where that is positive. What cannot beat the best gap so far is skipped; in round hulls this leaves the few
//! features next to the contact.
//!
//! Faces and edges are weighed against each other as in the cuboid kernel, with
//! [`tolerance_size`](crate::shape::polyhedron::tolerance_size) of the inner radius.
//!
//! The cache holds the last axis. It ends the search where the hulls are still apart along it, and else its gap is the
//! first to beat, which leaves out more candidates. As equal gaps go to the lowest face or edges in any case, the
//! result is the same bits with it or without.
//!
//! Loops over corners, faces and edges run over groups of eight in plain arrays, compiled once for what every
//! machine has and once for AVX2. Lanes never mix but to find a minimum, so both give the same bits.

mod edges;
mod view;

use super::cuboid::{ALIGNED, EDGE_BIAS, stands_in};
use super::{Manifold, ManifoldPoint, PairCache};
use crate::math::{Mat3, Pose, Real, Vec3, clamp, min};
use crate::shape::Support;
use crate::shape::distance::closest;
use crate::shape::polyhedron::{CuboidFeatures, Polyhedron};
use crate::shape::{ConvexHull, Cuboid, Plane};
#[cfg(target_arch = "x86_64")]
use crate::simd::Avx2;
use crate::simd::{Baseline, Instructions, Kernel, SimdLevel};
use edges::{Edge, EdgeGroup, MAX_EDGE_WORDS};
use view::View;

/// A face of hull 2 is the reference when it is better by this share of the smaller size.
const FACE_BIAS: Real = 2e-3;
/// An edge pair is looked at when it is better than the best face by this share of the smaller size.
const EDGE_GAIN: Real = 2e-4;

/// Share by which balls are taken to be larger or smaller than they are, so that rounding never makes them tell more
/// than is true.
const BALL_SLACK: Real = 1e-4;

/// A hull of 255 corners has at most 506 faces.
const MAX_FACE_GROUPS: usize = 64;
/// Groups of faces that most hulls get by with.
const FEW_FACE_GROUPS: usize = 8;

const FACE1: u32 = 1 << 30;
const FACE2: u32 = 2 << 30;
const EDGES: u32 = 3 << 30;

/// Two polyhedra and the placement of the second one in the frame of the first.
pub(crate) struct HullPair<'a> {
    pub polyhedron1: Polyhedron<'a>,
    pub polyhedron2: Polyhedron<'a>,
    /// Rotation and position of hull 2.
    m: Mat3,
    t: Vec3,
    margin: Real,
}

/// What a hull is held against.
pub(crate) trait Partner {
    /// What its view is made of.
    type Features<'a>
    where
        Self: 'a;
    fn features(&self) -> Self::Features<'_>;
    fn view<'a>(features: &'a Self::Features<'_>) -> Polyhedron<'a>;
    fn support(&self) -> Support<'_>;
}

impl Partner for ConvexHull {
    type Features<'a> = &'a Self;

    #[inline(always)]
    fn features(&self) -> &Self {
        self
    }

    #[inline(always)]
    fn view<'a>(features: &'a &Self) -> Polyhedron<'a> {
        Polyhedron::from_hull(features)
    }

    #[inline(always)]
    fn support(&self) -> Support<'_> {
        Support::Hull(self)
    }
}

impl Partner for Cuboid {
    type Features<'a> = CuboidFeatures;

    #[inline(always)]
    fn features(&self) -> CuboidFeatures {
        CuboidFeatures::new(self)
    }

    #[inline(always)]
    fn view(features: &CuboidFeatures) -> Polyhedron<'_> {
        features.view()
    }

    #[inline(always)]
    fn support(&self) -> Support<'_> {
        Support::Cuboid(*self)
    }
}

/// Hull (shape 1) against hull or cuboid.
pub(crate) fn collide(
    level: SimdLevel,
    (hull, partner): (&ConvexHull, &impl Partner),
    pose: &Pose,
    margin: Real,
    (cache, manifold): (&mut PairCache, &mut Manifold),
) {
    manifold.clear();
    on_level(level, FirstLook { level, hull, partner, pose, margin, cache, manifold });
}

/// Runs a kernel with eight lanes where the level has them.
#[inline(always)]
fn on_level<K: Kernel>(level: SimdLevel, kernel: K) {
    #[cfg(target_arch = "x86_64")]
    if matches!(level, SimdLevel::Avx2 | SimdLevel::Avx512)
        && let Some(avx2) = Avx2::detect()
    {
        avx2.run(kernel);
        return;
    }
    let _ = level;
    Baseline.run(kernel);
}

/// [`collide`]: what most pairs that were apart need, then the search for the others.
struct FirstLook<'a, P> {
    level: SimdLevel,
    hull: &'a ConvexHull,
    partner: &'a P,
    pose: &'a Pose,
    margin: Real,
    cache: &'a mut PairCache,
    manifold: &'a mut Manifold,
}

impl<P: Partner> Kernel for FirstLook<'_, P> {
    #[inline(always)]
    fn run(self) {
        let (m, t) = (self.pose.rotation.to_mat3(), self.pose.position);
        let features = self.partner.features();
        let pair = |hull| HullPair {
            polyhedron1: Polyhedron::from_hull(hull),
            polyhedron2: P::view(&features),
            m,
            t,
            margin: self.margin,
        };
        let Some(known) = pair(self.hull).touches(self.cache.words[0]) else { return };
        // Put together anew, so that pairs that are apart need not write down what they do not read.
        let pair = pair(self.hull);
        let supports = [Support::Hull(self.hull), self.partner.support()];
        pair.search(self.level, (self.pose, supports), known, (self.cache, self.manifold));
    }
}

/// The search for the best axis and the contact along it.
struct SearchKernel<'a, const G: usize> {
    pair: &'a HullPair<'a>,
    pose: &'a Pose,
    supports: [Support<'a>; 2],
    known: Axis,
    cache: &'a mut PairCache,
    manifold: &'a mut Manifold,
}

impl<const G: usize> Kernel for SearchKernel<'_, G> {
    #[inline(always)]
    fn run(self) {
        self.pair.search_faces::<G>((self.pose, self.supports), self.known, (self.cache, self.manifold));
    }
}

/// An axis as the cache holds it, and the gap along it.
#[derive(Clone, Copy)]
struct Axis {
    code: u32,
    gap: Real,
}

impl Axis {
    /// None, with a gap below all.
    const NONE: Self = Self { code: 0, gap: -Real::MAX };

    /// The face of the hull that `owner` stands for, with its gap.
    fn face_of(self, owner: u32) -> Option<(usize, Real)> {
        (self.code & EDGES == owner).then(|| (self.index(), self.gap))
    }

    /// The face, for a face axis.
    fn index(self) -> usize {
        (self.code & 0x3FFF_FFFF) as usize
    }

    /// The edges of hull 1 and hull 2, for a pair of edges.
    fn edges(self) -> (usize, usize) {
        (self.index() >> 15, self.index() & 0x7FFF)
    }
}

impl HullPair<'_> {
    /// Nothing if balls around the hulls, or the axis of the last step, show that they are farther apart than the
    /// margin; else what that axis tells.
    #[inline(always)]
    fn touches(&self, code: u32) -> Option<Axis> {
        let between = self.m * self.polyhedron2.center + self.t - self.polyhedron1.center;
        let reach = (self.polyhedron1.outer_radius + self.polyhedron2.outer_radius) * (1.0 + BALL_SLACK) + self.margin;
        if between.length_squared() > reach * reach {
            return None;
        }
        let known = self.known_axis(code);
        // Not `<=`: what is no number is left to the search.
        if known.gap > self.margin { None } else { Some(known) }
    }

    /// The axis of the last step with the gap that it has now.
    #[inline(always)]
    fn known_axis(&self, code: u32) -> Axis {
        let axis = Axis { code, gap: -Real::MAX };
        let (index, (e1, e2)) = (axis.index(), axis.edges());
        let gap = match code & EDGES {
            FACE1 if index < self.polyhedron1.planes.len() => {
                face_gap(self.polyhedron1.planes[index], &self.polyhedron2, &self.m, self.t)
            }
            FACE2 if index < self.polyhedron2.planes.len() => {
                let (inverse, t) = inverted(&self.m, self.t);
                face_gap(self.polyhedron2.planes[index], &self.polyhedron1, &inverse, t)
            }
            // The search names the first half of each edge.
            EDGES if e1 < self.polyhedron1.edges.len() && e2 < self.polyhedron2.edges.len() && (e1 | e2) & 1 == 0 => {
                let Some((gap, _)) = self.edge_gap(axis) else { return Axis::NONE };
                gap
            }
            _ => return Axis::NONE,
        };
        Axis { code, gap }
    }

    /// Contacts, in the frame of polyhedron 1; no axis is known to part the hulls.
    #[inline(always)]
    fn search(
        &self,
        level: SimdLevel,
        (pose, supports): (&Pose, [Support; 2]),
        known: Axis,
        (cache, manifold): (&mut PairCache, &mut Manifold),
    ) {
        let groups = self.polyhedron1.faces.len().max(self.polyhedron2.faces.len());
        let pair = self;
        // Many faces are rare: only they pay for clearing large buffers.
        if groups <= FEW_FACE_GROUPS {
            on_level(level, SearchKernel::<FEW_FACE_GROUPS> { pair, pose, supports, known, cache, manifold });
        } else {
            on_level(level, SearchKernel::<MAX_FACE_GROUPS> { pair, pose, supports, known, cache, manifold });
        }
    }

    #[inline(always)]
    fn search_faces<const G: usize>(
        &self,
        (pose, supports): (&Pose, [Support; 2]),
        known: Axis,
        (cache, manifold): (&mut PairCache, &mut Manifold),
    ) {
        let (inverse, t) = inverted(&self.m, self.t);
        let view1 = View::<G>::new(&self.polyhedron1, &self.polyhedron2, self.m, self.t);
        let view2 = View::<G>::new(&self.polyhedron2, &self.polyhedron1, inverse, t);
        let size = min(self.polyhedron1.size, self.polyhedron2.size);
        let face = self.best_face(&view1, &view2, known, size);
        cache.words[0] = face.code;
        if face.gap > self.margin {
            return;
        }
        let edges = self.best_edges(&view1, &view2, known, face.gap + EDGE_GAIN * size);
        if let Some(edges) = edges {
            cache.words[0] = edges.code;
            if edges.gap > self.margin {
                return;
            }
        }
        if edges.is_none_or(|edges| self.is_aligned(edges, face)) {
            self.face_contact(face, (&view1, &view2), size, manifold);
        }
        if let Some(edges) = edges
            && !stands_in(manifold, edges.gap - EDGE_BIAS * size)
        {
            manifold.clear();
            self.edge_contact(edges, manifold);
        }
        if manifold.points().is_empty() {
            self.passing_by(face, (pose, supports), manifold);
        }
    }

    /// Clips the incident face of one hull against the reference face of the other.
    #[inline(always)]
    fn face_contact<const G: usize>(
        &self,
        face: Axis,
        (view1, view2): (&View<G>, &View<G>),
        size: Real,
        manifold: &mut Manifold,
    ) {
        if face.code & EDGES == FACE1 {
            view1.face_contact(face.index(), (self.margin, size), manifold);
            return;
        }
        view2.face_contact(face.index(), (self.margin, size), manifold);
        // Found in the frame of hull 2 with the roles swapped.
        for p in manifold.points_mut() {
            p.point1 = view1.m * p.point2() + view1.t;
            p.normal = -(view1.m * p.normal);
            p.feature ^= 0x4000_0000;
        }
    }

    /// Whether the axis of a pair of edges is almost the normal of a face.
    #[inline(always)]
    fn is_aligned(&self, edges: Axis, face: Axis) -> bool {
        let normal = if face.code & EDGES == FACE1 {
            self.polyhedron1.planes[face.index()].normal
        } else {
            -(self.m * self.polyhedron2.planes[face.index()].normal)
        };
        self.edge_gap(edges).is_some_and(|(_, axis)| axis.dot(normal) > ALIGNED)
    }

    /// Gap and normal of a pair of edges that makes a face of the Minkowski difference.
    #[inline(always)]
    fn edge_gap(&self, edges: Axis) -> Option<(Real, Vec3)> {
        let (e1, e2) = edges.edges();
        Edge::new(&self.polyhedron1, e1).gap(&Edge::new(&self.polyhedron2, e2).placed(&self.m, self.t))
    }

    /// The face to build the contact on, or one along which the hulls are apart by more than the margin.
    #[inline(always)]
    fn best_face<const G: usize>(&self, view1: &View<G>, view2: &View<G>, known: Axis, size: Real) -> Axis {
        let (face, gap) = view1.best_face(known.face_of(FACE1), -Real::MAX);
        let best = Axis { code: FACE1 | face as u32, gap };
        if gap > self.margin {
            return best;
        }
        let floor = gap + FACE_BIAS * size;
        let (face, gap) = view2.best_face(known.face_of(FACE2), floor);
        if gap > floor { Axis { code: FACE2 | face as u32, gap } } else { best }
    }

    /// The edge pair with the largest gap, if that is above `floor`; of several the one with the lowest code.
    #[inline(always)]
    fn best_edges<const G: usize>(&self, view1: &View<G>, view2: &View<G>, known: Axis, floor: Real) -> Option<Axis> {
        let mut best = Axis { code: 0, gap: floor };
        if known.code & EDGES == EDGES && known.gap > floor {
            best = known;
        }
        let (set1, mut set2) = (view1.promising_edges(best.gap), view2.promising_edges(best.gap));
        let words = self.polyhedron1.edges.len().div_ceil(128).min(MAX_EDGE_WORDS);
        let mut group = EdgeGroup::default();
        while group.fill(&mut set2, &self.polyhedron2, (&self.m, self.t)) {
            for (word, &bits) in set1[..words].iter().enumerate() {
                let mut bits = bits;
                while bits != 0 {
                    let index1 = 64 * word as u32 + bits.trailing_zeros();
                    bits &= bits - 1;
                    group.improve(index1, &Edge::new(&self.polyhedron1, 2 * index1 as usize), &mut best);
                }
            }
        }
        (best.code != 0).then_some(best)
    }

    /// Closest points of the two edges; nothing if the hulls are apart and the edges are closest beyond their ends.
    #[inline(always)]
    fn edge_contact(&self, edges: Axis, manifold: &mut Manifold) {
        let (e1, e2) = edges.edges();
        let edge1 = Edge::new(&self.polyhedron1, e1);
        let edge2 = Edge::new(&self.polyhedron2, e2).placed(&self.m, self.t);
        let Some((separation, normal)) = edge1.gap(&edge2) else { return };
        let (d1, d2, w) = (edge1.along, edge2.along, edge2.start - edge1.start);
        let (a11, a12, a22) = (d1.dot(d1), d1.dot(d2), d2.dot(d2));
        let determinant = a11 * a22 - a12 * a12;
        let s = (w.dot(d1) * a22 - w.dot(d2) * a12) / determinant;
        let t = (w.dot(d1) * a12 - w.dot(d2) * a11) / determinant;
        if separation > 0.0 && !((0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t)) {
            return;
        }
        let point1 = edge1.start + d1 * clamp(s, 0.0, 1.0);
        let feature = 0x8000_0000 | edges.index() as u32;
        manifold.push(ManifoldPoint { point1, normal, separation, feature });
    }

    /// Hulls that pass each other with no corner over the other's face: the closest points, or the deepest corner.
    #[cold]
    #[inline(never)]
    fn passing_by(&self, axis: Axis, (pose, supports): (&Pose, [Support; 2]), manifold: &mut Manifold) {
        let feature = 0x2000_0000;
        if let Some(c) = closest(&supports[0], &supports[1], pose) {
            if c.distance <= self.margin {
                manifold.push(ManifoldPoint { point1: c.point1, normal: c.normal, separation: c.distance, feature });
            }
            return;
        }
        let index = axis.index();
        if axis.code & EDGES == FACE1 {
            let normal = self.polyhedron1.planes[index].normal;
            let corner = self.polyhedron2.lowest_corner(transposed_mul(&self.m, normal));
            let point1 = self.m * self.polyhedron2.vertices[corner] + self.t - normal * axis.gap;
            manifold.push(ManifoldPoint { point1, normal, separation: axis.gap, feature });
        } else {
            let normal2 = self.polyhedron2.planes[index].normal;
            let (inverse, t) = inverted(&self.m, self.t);
            let corner = self.polyhedron1.lowest_corner(transposed_mul(&inverse, normal2));
            let point1 = pose.transform_point(inverse * self.polyhedron1.vertices[corner] + t);
            let normal = -pose.rotation.rotate(normal2);
            manifold.push(ManifoldPoint { point1, normal, separation: axis.gap, feature });
        }
    }
}

/// `mᵀ v`: the direction `v` in the frame whose axes are the columns of `m`.
#[inline(always)]
fn transposed_mul(m: &Mat3, v: Vec3) -> Vec3 {
    Vec3::new(m.x_axis.dot(v), m.y_axis.dot(v), m.z_axis.dot(v))
}

/// The placement of hull 1 in the frame of hull 2.
#[inline(always)]
fn inverted(m: &Mat3, t: Vec3) -> (Mat3, Vec3) {
    let inverse = m.transpose();
    (inverse, -(inverse * t))
}

/// Height of the other hull, placed by `m` and `t`, over a plane.
#[inline(always)]
fn face_gap(plane: Plane, other: &Polyhedron, m: &Mat3, t: Vec3) -> Real {
    other.lowest(transposed_mul(m, plane.normal)) + plane.normal.dot(t) - plane.offset
}

#[cfg(test)]
mod tests;
