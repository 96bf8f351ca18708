//! Laws that every pair of shapes keeps, and the cuboid kernel against separating axes in `f64`.

use super::*;
use crate::math::{Rotation, Vec3};
use glam::{DMat3, DVec3};

/// Numbers that repeat from run to run (Marsaglia's xorshift, 2003).
pub(super) struct Random(pub u64);

impl Random {
    pub fn unit(&mut self) -> Real {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 40) as Real / (1u64 << 24) as Real
    }

    pub fn between(&mut self, low: Real, high: Real) -> Real {
        low + (high - low) * self.unit()
    }

    pub fn vector(&mut self) -> Vec3 {
        Vec3::new(self.between(-1.0, 1.0), self.between(-1.0, 1.0), self.between(-1.0, 1.0))
    }

    pub fn direction(&mut self) -> Vec3 {
        loop {
            let v = self.vector();
            if v.length_squared() > 0.01 && v.length_squared() < 1.0 {
                return v.normalize();
            }
        }
    }

    pub fn rotation(&mut self) -> Rotation {
        let (v, w) = (self.vector(), self.between(-1.0, 1.0));
        Rotation::from_xyzw(v.x, v.y, v.z, w).normalize()
    }
}

pub(super) fn contacts(a: &Shape, b: &Shape, pose: &Pose, margin: Real) -> Manifold {
    let mut manifold = Manifold::EMPTY;
    collide(a, b, pose, margin, &mut PairCache::default(), &mut manifold);
    manifold
}

fn lowest(manifold: &Manifold) -> Real {
    manifold.points().iter().fold(Real::MAX, |m, p| if p.separation < m { p.separation } else { m })
}

fn matrix(rotation: Rotation) -> DMat3 {
    let m = rotation.to_mat3();
    DMat3::from_cols(m.x_axis.as_dvec3(), m.y_axis.as_dvec3(), m.z_axis.as_dvec3())
}

/// Gap of two boxes along a unit axis.
fn box_gap(h1: DVec3, h2: DVec3, m: &DMat3, t: DVec3, n: DVec3) -> f64 {
    let reach1 = h1.dot(n.abs());
    let reach2 = h2.dot(DVec3::new(m.x_axis.dot(n), m.y_axis.dot(n), m.z_axis.dot(n)).abs());
    t.dot(n).abs() - reach1 - reach2
}

/// The largest gap over the fifteen axes.
fn box_oracle(h1: DVec3, h2: DVec3, m: &DMat3, t: DVec3) -> f64 {
    let own = [DVec3::X, DVec3::Y, DVec3::Z];
    let others = [m.x_axis, m.y_axis, m.z_axis];
    let mut best = f64::MIN;
    for n in own.into_iter().chain(others) {
        best = best.max(box_gap(h1, h2, m, t, n.normalize()));
    }
    for a in own {
        for b in others {
            let n = a.cross(b);
            if n.length() > 1e-6 {
                best = best.max(box_gap(h1, h2, m, t, n.normalize()));
            }
        }
    }
    best
}

fn assert_sound(manifold: &Manifold, size: Real, margin: Real) {
    for p in manifold.points() {
        assert!((p.normal.length() - 1.0).abs() < 1e-5, "{p:?}");
        assert!(p.point1.is_finite() && p.separation.is_finite() && p.separation <= margin + 1e-5 * size);
        assert_eq!(p.normal, manifold.points()[0].normal);
        assert_eq!(manifold.points().iter().filter(|q| q.feature == p.feature).count(), 1, "{manifold:?}");
    }
}

#[test]
fn boxes_agree_with_the_separating_axes_in_double_precision() {
    let mut random = Random(0x1234_5678_9ABC_DEF1);
    let (mut touching, mut lifted, mut single) = (0, 0, 0);
    for round in 0..40_000 {
        let mut half = || Vec3::new(random.between(0.1, 1.0), random.between(0.1, 1.0), random.between(0.1, 1.0));
        let (h1, h2) = (half(), half());
        let rotation = random.rotation();
        let t = random.vector() * 1.8;
        let margin = if round % 2 == 0 { 0.0 } else { 0.05 };
        let pose = Pose::new(t, rotation);
        let m = contacts(&Shape::cuboid(h1).unwrap(), &Shape::cuboid(h2).unwrap(), &pose, margin);
        let (d1, d2, rot, dt) = (h1.as_dvec3(), h2.as_dvec3(), matrix(rotation), t.as_dvec3());
        let oracle = box_oracle(d1, d2, &rot, dt) as Real;
        let size = h1.min_element().min(h2.min_element());
        assert_sound(&m, size, margin);
        if oracle < -1e-5 {
            assert!(!m.points().is_empty(), "overlap {oracle} lost");
        }
        if oracle > margin + 1e-5 {
            assert!(m.points().is_empty());
        }
        if m.points().is_empty() {
            continue;
        }
        touching += 1;
        let n = m.points()[0].normal;
        let gap = box_gap(d1, d2, &rot, dt, n.as_dvec3()) as Real;
        assert!(n.dot(t) >= 0.0);
        if oracle <= 0.0 {
            // The axis taken is the best one but for the preference for faces.
            assert!(gap <= oracle + 1e-4 * size && gap >= oracle - 8e-3 * size, "{gap} {oracle} {size}");
            lifted += (lowest(&m) > 0.0) as u32;
        }
        single += (m.points().len() == 1) as u32;
        assert!(lowest(&m) >= gap - 1e-4 * size, "{} {gap}", lowest(&m));
    }
    assert!(touching > 9_000, "{touching}");
    eprintln!("touching {touching} lifted {lifted} single {single}");
}

#[test]
fn a_b_mirrors_b_a() {
    let mut random = Random(0xFEED_BEEF_1234_5671);
    let shapes = shapes();
    let mut touching = 0;
    for _ in 0..500 {
        for a in &shapes {
            for b in &shapes {
                let pose = Pose::new(random.vector(), random.rotation());
                let (ab, ba) = (contacts(a, b, &pose, 0.02), contacts(b, a, &pose.inverse(), 0.02));
                assert_sound(&ab, 0.3, 0.02);
                if ab.points().is_empty() || ba.points().is_empty() {
                    let other = if ab.points().is_empty() { &ba } else { &ab };
                    assert!(other.points().is_empty() || lowest(other) > 0.0, "{a:?} {b:?} {pose:?} {other:?}");
                    continue;
                }
                touching += 1;
                let (m, n) = (ab.points()[0].normal, pose.rotation.rotate(ba.points()[0].normal));
                let (d1, d2) = (lowest(&ab), lowest(&ba));
                assert!((d1 - d2).abs() < 0.01 || m.dot(n) > -0.999, "{a:?} {b:?} {pose:?}: {d1} {d2} {m} {n}");
            }
        }
    }
    assert!(touching > 1000);
}

fn shapes() -> Vec<Shape> {
    vec![
        Shape::sphere(0.3).unwrap(),
        Shape::capsule(0.5, 0.2).unwrap(),
        Shape::cuboid(Vec3::new(0.3, 0.5, 0.4)).unwrap(),
    ]
}
