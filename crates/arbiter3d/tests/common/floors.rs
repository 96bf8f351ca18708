//! Level floors put together in many ways, and what slides and rolls over them.
//!
//! Bodies of a run are in one world and do not meet each other: all shapes in all directions cost little more than one.

use super::*;
use arbiter3d::{CompoundChild, ConvexShape, Filter};

/// Cells along each side of a floor: 1,024 in all.
pub const CELLS: i32 = 32;
/// Length of a cell, metres. Bodies start off the middle, so that they meet seams at all sorts of places.
pub const CELL: f32 = 0.8;
/// Directions in which bodies slide and roll.
pub const DIRECTIONS: usize = 32;

/// How a floor is put together; its top is at height zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Floor {
    /// Boxes as shapes of one static body.
    Shapes,
    /// Boxes, each a static body.
    Bodies,
    /// Boxes on one kinematic body.
    Platform,
    /// A compound of boxes.
    Compound,
    /// Cells.
    Voxels,
    /// Two meshes that meet along a line.
    Meshes,
    /// One mesh.
    Mesh,
    /// One height field.
    Field,
    /// Four by four height fields.
    Tiles,
    /// Two boxes that overlap by half, of the same height.
    Overlapping,
    /// Boxes of random size that overlap.
    Patchwork,
}

pub const FLOORS: [Floor; 11] = [
    Floor::Shapes,
    Floor::Bodies,
    Floor::Platform,
    Floor::Compound,
    Floor::Voxels,
    Floor::Meshes,
    Floor::Mesh,
    Floor::Field,
    Floor::Tiles,
    Floor::Overlapping,
    Floor::Patchwork,
];

/// Corners of the cells about the origin.
pub fn cells() -> impl Iterator<Item = (i32, i32)> {
    (0..CELLS * CELLS).map(|at| (at % CELLS - CELLS / 2, at / CELLS - CELLS / 2))
}

fn middle((x, z): (i32, i32)) -> Vec3 {
    Vec3::new((x as f32 + 0.5) * CELL, -0.5 * CELL, (z as f32 + 0.5) * CELL)
}

/// A mesh of some of the floor, two triangles a cell.
fn mesh_of(cells: impl Iterator<Item = (i32, i32)>) -> Shape {
    let (mut corners, mut triangles) = (Vec::new(), Vec::new());
    for (x, z) in cells {
        let first = corners.len() as u32;
        let corner = |i: i32, j: i32| Vec3::new((x + i) as f32 * CELL, 0.0, (z + j) as f32 * CELL);
        corners.extend([corner(0, 0), corner(0, 1), corner(1, 0), corner(1, 1)]);
        triangles.extend([[first, first + 1, first + 2], [first + 2, first + 1, first + 3]]);
    }
    Shape::mesh(corners, triangles).unwrap()
}

/// Height fields of so many cells along each side, side by side.
fn fields(cells: i32) -> impl Iterator<Item = (Shape, Vec3)> {
    let points = cells as usize + 1;
    let shape = Shape::height_field(vec![0.0; points * points], points, [CELL; 2]).unwrap();
    let count = CELLS / cells;
    let corner = move |at: i32| (at * cells - CELLS / 2) as f32 * CELL;
    (0..count * count).map(move |at| (shape.clone(), Vec3::new(corner(at % count), 0.0, corner(at / count))))
}

/// Builds a floor of a material.
pub fn lay(world: &mut World, floor: Floor, material: &dyn Fn(Shape) -> ShapeDefinition) {
    let half = 0.5 * CELL;
    let mut place = |body: BodyId, shape: Shape, at: Vec3| {
        world.add_shape(body, &material(shape).at(at)).unwrap();
    };
    match floor {
        Floor::Shapes => cells().for_each(|cell| place(BodyId::WORLD, cube(half), middle(cell))),
        Floor::Platform => {
            let body = world.add_body(&BodyDefinition::kinematic()).unwrap();
            for cell in cells() {
                world.add_shape(body, &material(cube(half)).at(middle(cell))).unwrap();
            }
        }
        Floor::Bodies => {
            for cell in cells() {
                add(world, &BodyDefinition::fixed().at(middle(cell)), &material(cube(half)));
            }
        }
        Floor::Compound => {
            let children: Vec<_> = cells().map(|cell| CompoundChild::new(cube(half)).at(middle(cell))).collect();
            place(BodyId::WORLD, Shape::compound(&children).unwrap(), Vec3::ZERO);
        }
        Floor::Voxels => {
            let grid = Shape::voxels(CELL, cells().map(|(x, z)| [x, -1, z])).unwrap();
            place(BodyId::WORLD, grid, Vec3::ZERO);
        }
        Floor::Meshes => {
            for side in [-1, 1] {
                let half = mesh_of(cells().filter(|&(x, _)| (x < 0) == (side < 0)));
                place(BodyId::WORLD, half, Vec3::ZERO);
            }
        }
        Floor::Mesh => place(BodyId::WORLD, mesh_of(cells()), Vec3::ZERO),
        Floor::Field => fields(CELLS).for_each(|(field, at)| place(BodyId::WORLD, field, at)),
        Floor::Tiles => fields(CELLS / 4).for_each(|(field, at)| place(BodyId::WORLD, field, at)),
        Floor::Overlapping => {
            for x in [-4.0, 4.0] {
                place(BodyId::WORLD, cuboid(8.0, 0.5, 14.0), Vec3::new(x, -0.5, 0.0));
            }
        }
        Floor::Patchwork => {
            let mut random = Random(7);
            for cell in cells() {
                let size = Vec3::new(random.range(1.0, 1.8), random.range(0.4, 0.9), random.range(1.0, 1.8)) * half;
                place(BodyId::WORLD, Shape::cuboid(size).unwrap(), Vec3::new(middle(cell).x, -size.y, middle(cell).z));
            }
        }
    }
}

/// The upper half of a ball about the origin; its flat side is down.
#[derive(Debug)]
pub struct HalfBall(pub f32);

impl ConvexShape for HalfBall {
    fn support(&self, direction: Vec3) -> Vec3 {
        let across = Vec3::new(direction.x, 0.0, direction.z);
        if direction.y > 0.0 { direction.normalize() * self.0 } else { across.normalize_or_zero() * self.0 }
    }

    fn center(&self) -> Vec3 {
        Vec3::new(0.0, 0.375 * self.0, 0.0)
    }
}

/// A shape that slides: its name, how high its origin is over the floor, how it is turned.
#[derive(Clone, Debug)]
pub struct Slider {
    pub name: &'static str,
    pub shape: Shape,
    pub height: f32,
    pub lying: Quat,
}

impl Slider {
    fn new(name: &'static str, shape: Shape, height: f32, lying: Quat) -> Self {
        Self { name, shape, height, lying }
    }
}

/// All kinds of shapes, as they lie on a floor.
pub fn sliders() -> Vec<Slider> {
    let (flat, side, over) = (Quat::IDENTITY, turn(Vec3::Z, 90.0), turn(Vec3::Z, 180.0));
    let hull = [-0.3, 0.3].map(|x| [-0.2, 0.2].map(|y| [-0.4, 0.4].map(|z| Vec3::new(x, y, z)))).concat().concat();
    let half_ball = || Shape::custom(HalfBall(0.3)).unwrap();
    let slab = Shape::rounded(&cuboid(0.3, 0.1, 0.2), 0.1).unwrap();
    vec![
        Slider::new("a box", cuboid(0.3, 0.2, 0.5), 0.2, flat),
        Slider::new("a ball", sphere(0.3), 0.3, flat),
        Slider::new("a lying capsule", capsule(0.4, 0.2), 0.2, side),
        Slider::new("a hull", Shape::hull(&hull).unwrap(), 0.2, flat),
        Slider::new("a wedge", wedge(0.3), 0.3, flat),
        Slider::new("a standing cylinder", Shape::cylinder(0.3, 0.25).unwrap(), 0.3, flat),
        Slider::new("a lying cylinder", Shape::cylinder(0.3, 0.25).unwrap(), 0.25, side),
        Slider::new("a cone", Shape::cone(0.3, 0.25).unwrap(), 0.3, flat),
        Slider::new("a rounded box", slab, 0.2, flat),
        Slider::new("an ellipsoid", Shape::ellipsoid(Vec3::new(0.4, 0.2, 0.3)).unwrap(), 0.2, flat),
        Slider::new("a half ball", half_ball(), 0.0, flat),
        Slider::new("a half ball on its round side", half_ball(), 0.3, over),
    ]
}

/// What a passage of 11 m over a floor does to a body.
#[derive(Clone, Copy, Debug)]
pub struct Passage {
    pub slider: usize,
    /// Degrees from x towards z.
    pub towards: f32,
    /// Largest vertical speed, m/s.
    pub bump: f32,
    /// Least speed ahead as a share of that at the start.
    pub least: f32,
    /// Way ahead, metres.
    pub ahead: f32,
    /// Way aside, metres.
    pub aside: f32,
    /// Of what rolls, how far its axis has turned off, radians.
    pub turned: f32,
}

/// A body on its way: where it starts and where it goes.
struct Run {
    body: BodyId,
    start: Vec3,
    along: Vec3,
    passage: Passage,
}

/// Puts shapes on a floor in 32 directions, 5 m before the middle, each as `place` has it, none meeting another.
fn start(
    world: &mut World,
    sliders: &[Slider],
    place: &dyn Fn(usize, &Slider, Vec3) -> (BodyDefinition, ShapeDefinition),
) -> Vec<Run> {
    let mut runs = Vec::new();
    for (slider, kind) in sliders.iter().enumerate() {
        for direction in 0..DIRECTIONS {
            let towards = 360.0 * (direction as f32 + 0.13) / DIRECTIONS as f32;
            let along = heading(towards);
            let start = Vec3::new(0.07, kind.height, 0.11) - along * 5.0;
            let (body, shape) = place(direction, kind, along);
            let body = BodyDefinition { can_sleep: false, ..body.at(start) };
            let body = add(world, &body, &shape.filter(Filter { group: -1, ..Filter::default() }));
            let passage = Passage { slider, towards, bump: 0.0, least: 1.0, ahead: 0.0, aside: 0.0, turned: 0.0 };
            runs.push(Run { body, start, along, passage });
        }
    }
    runs
}

/// Steps, and notes the speeds against the one that bodies have had at the start.
fn pass(world: &mut World, runs: &mut [Run], steps: usize, speed: f32) -> Vec<Passage> {
    for _ in 0..steps {
        world.step(DT).unwrap();
        for Run { body, along, passage, .. } in &mut *runs {
            let v = velocity(world, *body);
            passage.bump = passage.bump.max(v.y.abs());
            passage.least = passage.least.min(v.dot(*along) / speed);
        }
    }
    let finish = |run: &Run| {
        let moved = position(world, run.body) - run.start;
        let ahead = moved.dot(run.along);
        let aside = (moved - run.along * ahead) * Vec3::new(1.0, 0.0, 1.0);
        Passage { ahead, aside: aside.length(), ..run.passage }
    };
    runs.iter().map(finish).collect()
}

/// Slides shapes over a floor without friction in 32 directions.
pub fn slide(floor: Floor, sliders: &[Slider]) -> Vec<Passage> {
    let speed = 4.0;
    let ice = |shape: Shape| ShapeDefinition::new(shape).friction(0.0).rolling_resistance(0.0);
    let mut world = world();
    lay(&mut world, floor, &ice);
    let mut runs = start(&mut world, sliders, &|direction, slider, along| {
        // Turned at random about the vertical, so that corners, edges and faces lead.
        let about = turn(Vec3::Y, 37.0 * direction as f32) * slider.lying;
        (BodyDefinition::dynamic().rotated(about).moving(along * speed, Vec3::ZERO), ice(slider.shape.clone()))
    });
    run(&mut world, 0.25);
    pass(&mut world, &mut runs, 150, speed)
}

/// What rolls, about its x axis or any.
pub fn rollers() -> Vec<Slider> {
    let flat = Quat::IDENTITY;
    let half_side = turn(Vec3::Z, 90.0);
    vec![
        Slider::new("a ball", sphere(0.3), 0.3, flat),
        Slider::new("a capsule", capsule(0.4, 0.3), 0.3, half_side),
        Slider::new("a cylinder", Shape::cylinder(0.3, 0.3).unwrap(), 0.3, half_side),
    ]
}

/// Rolls shapes over a floor with friction in 32 directions, square to their axes, for 3.4 s at 3 m/s.
pub fn roll(floor: Floor, rollers: &[Slider]) -> Vec<Passage> {
    let (speed, radius) = (3.0, 0.3);
    let grip = |shape: Shape| ShapeDefinition::new(shape).friction(0.8).rolling_resistance(0.0);
    let mut world = world();
    lay(&mut world, floor, &grip);
    let mut runs = start(&mut world, rollers, &|_, roller, along| {
        // The axis, which lies along x, is turned to where the top of what rolls is on the right of its way.
        let axis = Vec3::Y.cross(along);
        let half = (Vec3::X + axis).normalize_or(Vec3::Z);
        let to_axis = Quat::from_xyzw(0.0, Vec3::X.cross(half).y, 0.0, Vec3::X.dot(half));
        let body = BodyDefinition::dynamic().rotated((to_axis * roller.lying).normalize());
        (body.moving(along * speed, axis * (speed / radius)), grip(roller.shape.clone()))
    });
    run(&mut world, 0.25);
    let mut passages = pass(&mut world, &mut runs, 204 - 15, speed);
    for (run, passage) in runs.iter().zip(&mut passages) {
        passage.turned = spin(&world, run.body).normalize().dot(run.along).abs();
    }
    passages
}
