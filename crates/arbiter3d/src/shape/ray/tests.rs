//! Rays against closed formulas, and against marching along the exact distance of the shape.

use super::super::convex_ray::cast_support;
use super::super::support::Support;
use super::*;
use crate::random::Random;

fn ray(origin: [Real; 3], direction: [Real; 3], max_fraction: Real) -> Ray {
    Ray { origin: origin.into(), direction: direction.into(), max_fraction }
}

fn sphere(radius: Real) -> Shape {
    Shape::sphere(radius).unwrap()
}

fn cuboid(half_extents: Vec3) -> Shape {
    Shape::cuboid(half_extents).unwrap()
}

fn box_planes(half_extents: Vec3) -> Vec<Plane> {
    [Vec3::X, Vec3::Y, Vec3::Z]
        .into_iter()
        .flat_map(|axis| [axis, -axis].map(|normal| Plane { normal, offset: half_extents.dot(axis) }))
        .collect()
}

/// From 0.25 above a ball and a box of 1.2: fraction 0.25 for a unit direction, 0.125 for one of length 2, zero from inside,
/// nothing for a ray that leads away.
#[test]
fn straight_down_on_a_ball_and_a_box() {
    let planes = box_planes(Vec3::splat(1.2));
    let ball = |ray: &Ray| cast_ray(&sphere(1.2), ray);
    let brick = |ray: &Ray| cast_ray(&cuboid(Vec3::splat(1.2)), ray);
    let hull = |ray: &Ray| cast_planes(&planes, ray);
    for cast in [&ball as &dyn Fn(&Ray) -> Option<ShapeHit>, &brick, &hull] {
        let hit = cast(&ray([0.0, 1.45, 0.0], [0.0, -1.0, 0.0], Real::MAX)).unwrap();
        assert!((hit.fraction - 0.25).abs() < 2e-7 && hit.normal == Vec3::Y, "{hit:?}");
        let hit = cast(&ray([0.0, 1.45, 0.0], [0.0, -2.0, 0.0], Real::INFINITY)).unwrap();
        assert!((hit.fraction - 0.125).abs() < 1e-7 && hit.normal == Vec3::Y, "{hit:?}");
        let hit = cast(&ray([0.0, 0.95, 0.0], [0.0, -1.0, 0.0], 1.0));
        assert_eq!(hit, Some(ShapeHit::INSIDE));
        assert_eq!(cast(&ray([0.0, -1.45, 0.0], [0.0, -1.1, 0.0], Real::MAX)), None);
        assert_eq!(cast(&ray([0.0, 1.45, 0.0], [0.0, -1.0, 0.0], 0.24)), None, "ends before the surface");
    }
}

/// From (1, 2, 3) to a ball of radius 4 at (10, 11, 12): the normal points back at the start.
#[test]
fn towards_the_centre_of_a_far_ball() {
    let center = Vec3::new(10.0, 11.0, 12.0);
    let ray = Ray { origin: Vec3::new(1.0, 2.0, 3.0) - center, direction: Vec3::splat(9.0), max_fraction: Real::MAX };
    let hit = cast_ray(&sphere(4.0), &ray).unwrap();
    assert!((hit.normal + Vec3::splat(1.0 / 3.0_f32.sqrt())).length() < 1e-6);
    assert!((ray.at(hit.fraction).length() - 4.0).abs() < 1e-4);
}

/// Ten kilometres away, a ray that passes the centre of a ball of 0.5 m at 0.3 m still hits where it should.
#[test]
fn a_far_origin_keeps_its_digits() {
    let ray = ray([-1e4, 0.3, 0.0], [1e4, 0.0, 0.0], 2.0);
    for shape in [sphere(0.5), Shape::capsule(1.0, 0.5).unwrap()] {
        let hit = cast_ray(&shape, &ray).unwrap();
        assert!((ray.at(hit.fraction).x + if matches!(shape, Shape::Sphere(_)) { 0.4 } else { 0.5 }).abs() < 2e-3);
    }
    let hit = cast_ray(&sphere(0.5), &ray).unwrap();
    assert!((hit.normal - Vec3::new(-0.8, 0.6, 0.0)).length() < 1e-5, "{hit:?}");
}

#[test]
fn a_capsule_is_hit_on_its_side_and_on_both_ends() {
    let capsule = Shape::capsule(1.0, 0.5).unwrap();
    let side = cast_ray(&capsule, &ray([2.0, 0.5, 0.0], [-3.0, 0.0, 0.0], 1.0)).unwrap();
    assert!((side.fraction - 0.5).abs() < 1e-6 && side.normal == Vec3::X);
    for sign in [1.0, -1.0] {
        let along = cast_ray(&capsule, &ray([0.3, 3.0 * sign, 0.0], [0.0, -2.0 * sign, 0.0], 1.0)).unwrap();
        assert!((along.fraction - 0.8).abs() < 1e-6, "{along:?}");
        assert!((along.normal - Vec3::new(0.6, 0.8 * sign, 0.0)).length() < 1e-6);
        // Past the end of the axis, inside the infinite cylinder, and leading away.
        assert_eq!(cast_ray(&capsule, &ray([0.3, 3.0 * sign, 0.0], [0.0, sign, 0.0], 10.0)), None);
    }
    assert_eq!(cast_ray(&capsule, &ray([0.2, 1.2, 0.0], [1.0, 0.0, 0.0], 1.0)), Some(ShapeHit::INSIDE));
}

/// A ray that starts on the surface and leads in hits at 0 with the normal there.
#[test]
fn starting_on_the_surface_and_leading_in_is_a_hit_at_zero() {
    for (shape, reach) in [
        (sphere(1.5), Vec3::new(1.5, 1.5, 1.5)),
        (cuboid(Vec3::new(0.3, 1.1, 2.7)), Vec3::new(0.3, 1.1, 2.7)),
        (Shape::capsule(0.7, 0.9).unwrap(), Vec3::new(0.9, 1.6, 0.9)),
    ] {
        for axis in [Vec3::X, Vec3::Y, Vec3::Z, -Vec3::X, -Vec3::Y, -Vec3::Z] {
            let origin = axis * reach;
            let hit = cast_ray(&shape, &Ray::new(origin, axis * -0.7)).unwrap();
            assert!(hit.fraction < 1e-6, "{shape:?} {axis}: {hit:?}");
            assert!((hit.normal - axis).length() < 1e-5 || hit.normal == Vec3::ZERO, "{shape:?} {axis}: {hit:?}");
        }
    }
}

#[test]
fn numbers_that_are_not_finite_and_zero_directions_miss() {
    let planes = box_planes(Vec3::ONE);
    for bad in [Real::NAN, Real::INFINITY] {
        for axis in 0..3 {
            let mut broken = [Ray::new(Vec3::splat(3.0), -Vec3::ONE); 2];
            broken[0].origin[axis] = bad;
            broken[1].direction[axis] = -bad;
            for ray in &broken {
                let capsule = Shape::capsule(1.0, 0.5).unwrap();
                for shape in [sphere(1.0), cuboid(Vec3::ONE), capsule] {
                    assert_eq!(cast_ray(&shape, ray), None, "{shape:?} {ray:?}");
                }
                assert_eq!(cast_planes(&planes, ray), None, "{ray:?}");
            }
        }
    }
    for shape in [sphere(1.0), cuboid(Vec3::ONE), Shape::capsule(1.0, 1.0).unwrap()] {
        assert_eq!(cast_ray(&shape, &ray([3.0, 0.0, 0.0], [0.0, 0.0, 0.0], 1.0)), None);
        assert_eq!(cast_ray(&shape, &ray([0.1, 0.2, 0.3], [0.0, 0.0, 0.0], 1.0)), Some(ShapeHit::INSIDE));
        assert_eq!(cast_ray(&shape, &ray([3.0, 0.0, 0.0], [-1.0, 0.0, 0.0], Real::NAN)), None);
    }
}

/// Exact distance of a point from the surface, in double precision.
fn distance(shape: &Shape, point: [f64; 3]) -> f64 {
    let length = |v: [f64; 3]| (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
    match shape {
        Shape::Sphere(s) => length(point) - f64::from(s.radius()),
        Shape::Capsule(s) => {
            let half_length = f64::from(s.half_length());
            let y = point[1] - point[1].clamp(-half_length, half_length);
            length([point[0], y, point[2]]) - f64::from(s.radius())
        }
        Shape::Cuboid(s) => {
            let half_extents = s.half_extents();
            let outside = [0, 1, 2].map(|axis| point[axis].abs() - f64::from(half_extents[axis]));
            let deepest = outside[0].max(outside[1]).max(outside[2]);
            length(outside.map(|x| x.max(0.0))) + deepest.min(0.0)
        }
        _ => f64::NAN,
    }
}

/// Walks along the ray by the distance to the shape until it is gone. `None` when it never gets within a micrometre.
fn march(shape: &Shape, ray: &Ray) -> Option<f64> {
    let length = f64::from(ray.direction.length());
    let mut fraction = 0.0;
    while fraction <= f64::from(ray.max_fraction) {
        let point = [0, 1, 2].map(|axis| f64::from(ray.origin[axis]) + f64::from(ray.direction[axis]) * fraction);
        let gap = distance(shape, point);
        if gap < 1e-6 {
            return Some(fraction);
        }
        fraction += gap / length;
    }
    None
}

/// 10,000 random rays a shape: same answer as marching, a point on the surface, and the normal is the distance's gradient.
#[test]
fn random_rays_agree_with_marching() {
    let mut random = Random(17);
    for shape in [sphere(0.8), Shape::capsule(0.9, 0.4).unwrap(), cuboid(Vec3::new(0.5, 1.1, 0.8))] {
        let mut hits = 0;
        for _ in 0..10_000 {
            let ray = Ray { origin: random.vector() * 2.0, direction: random.vector() * 4.0, max_fraction: 1.0 };
            let (hit, expected) = (cast_ray(&shape, &ray), march(&shape, &ray));
            let Some(hit) = hit else {
                // Marching stops a micrometre short, so it may see what a ray grazes or just fails to reach.
                if let Some(fraction) = expected {
                    let beyond = Ray { max_fraction: 1.001, ..ray };
                    let near = fraction < 0.999 && cast_ray(&shape, &beyond).is_none();
                    let inner = [0, 1, 2].map(|axis| f64::from(ray.at(fraction as Real + 1e-3)[axis]));
                    assert!(!near || distance(&shape, inner) > -1e-5, "{shape:?} {ray:?}");
                }
                continue;
            };
            hits += 1;
            let point = [0, 1, 2].map(|axis| f64::from(ray.at(hit.fraction)[axis]));
            if hit.normal == Vec3::ZERO {
                assert!(hit.fraction == 0.0 && distance(&shape, point) < 1e-6);
                continue;
            }
            assert!(distance(&shape, point).abs() < 2e-5, "{shape:?} {ray:?}: {}", distance(&shape, point));
            let expected = expected.unwrap_or(1.0);
            assert!(expected <= f64::from(hit.fraction) + 1e-5, "an earlier hit was missed");
            assert!((hit.normal.length() - 1.0).abs() < 1e-5 && hit.normal.dot(ray.direction) <= 1e-6);
            let out = |step: f64| [0, 1, 2].map(|axis| point[axis] + step * f64::from(hit.normal[axis]));
            assert!((distance(&shape, out(0.01)) - 0.01).abs() < 5e-5, "{shape:?} {ray:?}: not the normal");
        }
        assert!(hits > 300, "{hits}");
    }
}

/// The planes of a box, cast as a hull, give what the box gives.
#[test]
fn planes_and_box_agree() {
    let mut random = Random(29);
    let half_extents = Vec3::new(0.5, 1.1, 0.8);
    let planes = box_planes(half_extents);
    for _ in 0..5_000 {
        let ray = Ray { origin: random.vector() * 2.0, direction: random.vector() * 4.0, max_fraction: 1.0 };
        assert_eq!(cast_planes(&planes, &ray), cast_ray(&cuboid(half_extents), &ray));
    }
}

/// Kinds with a kernel of their own, cast as any convex shape is: the same hits.
#[test]
fn any_convex_shape_is_hit_where_the_kernels_hit() {
    let mut random = Random(31);
    let points: Vec<Vec3> = (0..30).map(|_| random.vector()).collect();
    let hull = Shape::hull(&points).unwrap();
    for shape in [sphere(0.8), Shape::capsule(0.9, 0.4).unwrap(), cuboid(Vec3::new(0.5, 1.1, 0.8)), hull] {
        let support = Support::new(&shape).unwrap();
        let mut hits = 0;
        for _ in 0..5_000 {
            let ray = Ray { origin: random.vector() * 2.0, direction: random.vector() * 4.0, max_fraction: 1.0 };
            let (kernel, general) = (cast_ray(&shape, &ray), cast_support(&support, &ray));
            let (Some(kernel), Some(general)) = (kernel, general) else {
                // What one grazes the other may miss.
                let hit = kernel.or(general);
                let grazes = |hit: ShapeHit| hit.normal.dot(ray.direction).abs() < 0.03 || hit.fraction > 0.9999;
                assert!(hit.is_none_or(grazes), "{shape:?} {ray:?} {hit:?}");
                continue;
            };
            hits += 1;
            let slant = (kernel.normal.dot(ray.direction).abs() / ray.direction.length()).max(0.01);
            let off = (kernel.fraction - general.fraction).abs() * ray.direction.length() * slant;
            assert!(off < 2e-5, "{shape:?} {ray:?}: {kernel:?} {general:?}");
        }
        assert!(hits > 300, "{hits}");
    }
}
