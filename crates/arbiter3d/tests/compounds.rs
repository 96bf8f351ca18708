//! Compounds and voxel grids: mass, rays, contacts, and how they rest.

mod common;

use arbiter3d::math::{Pose, Quat, Vec3};
use arbiter3d::narrow_phase::{Manifold, PairCache, collide};
use arbiter3d::*;
use common::*;

/// A table: a plate on four legs, its feet at -0.5.
fn table() -> Shape {
    let leg = |x: f32, z: f32| CompoundChild::new(cuboid(0.05, 0.4, 0.05)).at(Vec3::new(x, -0.1, z));
    let top = CompoundChild::new(cuboid(0.6, 0.1, 0.6)).at(Vec3::new(0.0, 0.4, 0.0));
    Shape::compound(&[top, leg(-0.5, -0.5), leg(0.5, -0.5), leg(-0.5, 0.5), leg(0.5, 0.5)]).unwrap()
}

fn down(x: f32, z: f32) -> Ray {
    Ray::new(Vec3::new(x, 5.0, z), Vec3::new(0.0, -10.0, 0.0))
}

/// A box cut into a compound of 3 × 3 × 3 or into cells has the mass of the box.
#[test]
fn parts_weigh_what_the_whole_weighs() {
    let whole = cuboid(0.6, 0.6, 0.6).mass_properties(700.0).unwrap();
    let cells = || (0..27).map(|at| [at % 3, at / 3 % 3, at / 9]);
    let children: Vec<_> = cells()
        .map(|c| CompoundChild::new(cube(0.2)).at(Vec3::from_array(c.map(|x| (x as f32 - 1.0) * 0.4))))
        .collect();
    let compound = Shape::compound(&children).unwrap().mass_properties(700.0).unwrap();
    let grid = Shape::voxels(0.4, cells()).unwrap().mass_properties(700.0).unwrap();
    assert!((grid.center - Vec3::splat(0.6)).length() < 1e-5 && compound.center.length() < 1e-6);
    for parts in [compound, grid] {
        assert!((parts.mass / whole.mass - 1.0).abs() < 1e-5);
        let (a, b) = (parts.inertia, whole.inertia);
        assert!((a.xx / b.xx - 1.0).abs() < 1e-4 && a.xy.abs() < 1e-4 * b.xx, "{a:?}, not {b:?}");
    }
    let heavy = children[0].clone().with_density_factor(4.0);
    let uneven = Shape::compound(&[heavy, children[26].clone()]).unwrap().mass_properties(1.0).unwrap();
    assert!((uneven.center + Vec3::splat(0.24)).length() < 1e-5, "{}", uneven.center);
}

#[test]
fn rays_tell_the_child_and_the_cell() {
    let Shape::Compound(table) = table() else { panic!("a compound") };
    let (child, hit) = table.cast_ray(&down(0.1, 0.2)).unwrap();
    assert!(child == 0 && (hit.fraction - 0.45).abs() < 1e-6 && hit.normal == Vec3::Y);
    let under = Ray::new(Vec3::new(-2.0, 0.0, -0.5), Vec3::X * 4.0);
    assert_eq!(table.cast_ray(&under).unwrap().0, 1);
    assert!(table.cast_ray(&Ray::new(Vec3::new(-2.0, 0.0, 0.0), Vec3::X * 4.0)).is_none(), "between the legs");

    // A random grid against all of its cells as boxes.
    let mut random = Random(5);
    let cells: Vec<[i32; 3]> = (0..400).map(|_| [0; 3].map(|_| random.range(-12.0, 12.0).floor() as i32)).collect();
    let grid = VoxelGrid::new(0.5, cells.iter().copied()).unwrap();
    let boxes: Vec<_> = cells
        .iter()
        .map(|c| CompoundChild::new(cube(0.25)).at((Vec3::from_array(c.map(|x| x as f32)) + Vec3::splat(0.5)) * 0.5))
        .collect();
    let boxes = Compound::new(&boxes).unwrap();
    let mut hits = 0;
    for _ in 0..4000 {
        let ray = Ray::new(random.vector(9.0), random.vector(20.0));
        let (walked, tested) = (grid.cast_ray(&ray), boxes.cast_ray(&ray));
        assert_eq!(walked.is_some(), tested.is_some(), "{ray:?}");
        if let (Some((cell, walked)), Some((_, tested))) = (walked, tested) {
            hits += 1;
            assert!((walked.fraction - tested.fraction).abs() < 2e-6, "{ray:?}: {walked:?}, {tested:?}");
            assert!(grid.is_solid(cell) && (walked.normal - tested.normal).length() < 1e-6, "{ray:?}");
        }
    }
    assert!(hits > 500, "{hits}");
}

/// Changed grids are those built anew, whatever has changed.
#[test]
fn a_changed_grid_is_one_built_anew() {
    let mut random = Random(6);
    let mut cell = || [0; 3].map(|_| random.range(-10.0, 10.0).floor() as i32);
    let mut cells: std::collections::BTreeSet<[i32; 3]> = (0..300).map(|_| cell()).collect();
    let mut grid = VoxelGrid::new(1.0, cells.iter().copied()).unwrap();
    for round in 0..30 {
        let changes: Vec<_> = (0..40).map(|k| (cell(), (k + round) % 3 == 0)).collect();
        for &(cell, solid) in &changes {
            if solid {
                cells.insert(cell)
            } else {
                cells.remove(&cell)
            };
        }
        grid = grid.with(&changes).unwrap();
        let new = VoxelGrid::new(1.0, cells.iter().copied()).unwrap();
        let boxes = |grid: &VoxelGrid| {
            let mut list = Vec::new();
            let all = math::Aabb::new(Vec3::splat(-99.0), Vec3::splat(99.0));
            grid.for_each_box(&all, |number, cuboid, at| list.push((number, cuboid, at)));
            list
        };
        assert_eq!((grid.solid_count(), boxes(&grid)), (new.solid_count(), boxes(&new)));
        let volume: f32 = boxes(&grid).iter().map(|(_, cuboid, _)| 8.0 * cuboid.half_extents().element_product()).sum();
        assert_eq!(volume, cells.len() as f32);
    }
    let gone: Vec<_> = cells.iter().map(|&cell| (cell, false)).collect();
    assert_eq!(grid.with(&gone).unwrap_err(), ShapeError::NoCells);
}

#[test]
fn bad_compounds_and_grids_are_told_so() {
    assert_eq!(Shape::compound(&[]).unwrap_err(), ShapeError::NoChildren);
    let good = CompoundChild::new(sphere(1.0));
    for bad in [
        CompoundChild::new(Shape::half_space()),
        good.clone().at(Vec3::new(f32::NAN, 0.0, 0.0)),
        good.clone().rotated(Quat::from_xyzw(0.0, 0.0, 0.0, 0.5)),
        good.clone().with_density_factor(-1.0),
    ] {
        let error = Shape::compound(&[good.clone(), bad]).unwrap_err();
        assert!(matches!(error, ShapeError::BadChild { child: 1, .. }), "{error}");
    }
    assert!(Shape::voxels(0.0, [[0; 3]]).is_err());
    assert_eq!(Shape::voxels(1.0, []).unwrap_err(), ShapeError::NoCells);
    let cell = [0, 1 << 21, 0];
    assert_eq!(Shape::voxels(1.0, [cell]).unwrap_err(), ShapeError::CellTooFar { cell });
    // A compound of what has no mass is for static bodies.
    let sheet = Shape::mesh(vec![Vec3::ZERO, Vec3::Z, Vec3::X], vec![[0, 1, 2]]).unwrap();
    let ground = ShapeDefinition::new(Shape::compound(&[CompoundChild::new(sheet)]).unwrap());
    let mut world = world();
    let body = world.add_body(&BodyDefinition::dynamic()).unwrap();
    assert!(world.add_shape(body, &ground).is_err());
    assert!(world.add_shape(BodyId::WORLD, &ground).is_ok());
}

/// A compound in a compound is taken apart, placed where it was.
#[test]
fn nested_compounds_are_flat() {
    let turned = CompoundChild::new(table()).at(Vec3::Y * 3.0).rotated(turn(Vec3::X, 180.0));
    let Shape::Compound(both) = Shape::compound(&[CompoundChild::new(table()), turned]).unwrap() else { panic!() };
    assert_eq!(both.children().len(), 10);
    assert!(both.children().iter().all(|child| !matches!(child.shape, Shape::Compound(_))));
    let (child, hit) = both.cast_ray(&down(0.5, 0.5)).unwrap();
    assert!((hit.fraction - 0.15).abs() < 1e-6 && (6..10).contains(&child), "{child} {hit:?}");
    let scaled = Shape::Compound(both).scaled(Vec3::new(2.0, 1.0, 1.0)).unwrap();
    assert!((scaled.local_aabb().max - Vec3::new(1.2, 3.5, 0.6)).length() < 1e-5, "{:?}", scaled.local_aabb());
}

/// A table stands on its four feet: four points at the corners, each told by its leg.
#[test]
fn a_table_stands_on_four_feet() {
    let (mut manifold, pose) = (Manifold::EMPTY, Pose::from_position(Vec3::new(0.0, 1.495, 0.0)));
    collide(&cuboid(5.0, 1.0, 5.0), &table(), &pose, 0.02, &mut PairCache::default(), &mut manifold);
    let mut corners: Vec<_> =
        manifold.points().iter().map(|p| (p.point1.x.round() as i32, p.point1.z.round() as i32)).collect();
    corners.sort_unstable();
    assert_eq!(corners, [(-1, -1), (-1, 1), (1, -1), (1, 1)]);
    assert!(manifold.points().iter().all(|p| p.normal == Vec3::Y && (p.separation + 0.005).abs() < 1e-6));
    let mut children: Vec<_> = manifold.points().iter().map(|p| p.feature >> 12).collect();
    children.sort_unstable();
    assert_eq!(children, [1, 2, 3, 4]);
}

/// Tables, voxel blocks and boxes dropped on each other, on a half-space, a mesh, voxels and a compound, come to rest and sleep.
#[test]
fn compounds_and_voxels_rest_on_everything() {
    let sheet = [(-9.0, -9.0), (-9.0, 9.0), (9.0, -9.0), (9.0, 9.0)].map(|(x, z)| Vec3::new(x, 0.0, z));
    let tiles: Vec<_> = (0..144)
        .map(|at| Vec3::new((at % 12) as f32 - 5.5, -0.5, (at / 12) as f32 - 5.5))
        .map(|at| CompoundChild::new(cube(0.5)).at(at))
        .collect();
    let floors = [
        Shape::half_space(),
        Shape::mesh(sheet.to_vec(), vec![[0, 1, 2], [2, 1, 3]]).unwrap(),
        Shape::voxels(0.5, (0..400).map(|at| [at % 20 - 10, -1, at / 20 - 10])).unwrap(),
        Shape::compound(&tiles).unwrap(),
    ];
    let block = Shape::voxels(0.2, (0..27).filter(|at| at % 2 == 0).map(|at| [at % 3, at / 3 % 3, at / 9])).unwrap();
    for floor in floors {
        let mut world = world();
        world.add_shape(BodyId::WORLD, &ShapeDefinition::new(floor.clone())).unwrap();
        let shapes = [table(), block.clone(), cube(0.2), table(), wedge(0.2), block.clone()];
        let bodies: Vec<_> = shapes
            .iter()
            .enumerate()
            .map(|(at, shape)| drop_shape(&mut world, shape, Vec3::new(0.05 * at as f32, 0.6 + 1.1 * at as f32, 0.0)))
            .collect();
        run(&mut world, 12.0);
        assert!(world.deepest_penetration() < 0.011, "{} m", world.deepest_penetration());
        for &body in &bodies {
            let lowest = world.shape(world.body(body).unwrap().shapes()[0]).unwrap().aabb().min.y;
            assert!(
                lowest > -0.15 && velocity(&world, body).length() < 0.05,
                "{body:?} at {}, {} m/s, down to {lowest}",
                position(&world, body),
                velocity(&world, body)
            );
        }
        world.validate().unwrap();
    }
}

/// A bullet does not pass a wall of a compound or of voxels, and a fast compound stops at a thin wall.
#[test]
fn fast_bodies_stop_at_what_is_made_of_parts() {
    let panes = |x: i32| CompoundChild::new(cuboid(0.01, 0.5, 0.5)).at(Vec3::new(0.0, x as f32, 0.0));
    let walls = [
        Shape::compound(&[-1, 0, 1].map(panes)).unwrap(),
        Shape::voxels(0.02, (-40..40).flat_map(|y| (-40..40).map(move |z| [0, y, z]))).unwrap(),
    ];
    for wall in walls {
        for shape in [sphere(0.1), table()] {
            let mut world = weightless();
            world.add_shape(BodyId::WORLD, &ShapeDefinition::new(wall.clone())).unwrap();
            let moving = BodyDefinition::dynamic().at(Vec3::new(-5.0, 0.1, 0.07)).moving(Vec3::X * 200.0, Vec3::ZERO);
            let body = add(&mut world, &moving, &ShapeDefinition::new(shape));
            run(&mut world, 0.5);
            assert!(position(&world, body).x < 0.1, "at {}", position(&world, body));
        }
    }
}
