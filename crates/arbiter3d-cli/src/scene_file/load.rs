//! Fills a world from a scene file.

use super::format::{
    AxisSpec, BodySpec, CombineSpec, GridSpec, HullSpec, KindSpec, Number, SceneFile, ShapeSpec, SurfaceSpec, Triple,
    Turn, VoxelsSpec, WorldSpec,
};
use super::{obj, parse};
use crate::problem::{Place, Problem};
use arbiter3d::{
    Anisotropy, BodyDefinition, BodyKind, CombineRule, CompoundChild, DecompositionSettings, Filter, HeightField,
    LockedAxes, Material, Shape, ShapeDefinition, VoxelGrid, World, WorldSettings,
    math::{Quat, Real, Vec3},
};
use arbiter3d_scenes::{BuiltScene, Random, SceneOptions, turns};
use std::collections::BTreeMap;
use std::path::Path;

/// More bodies than this are a slip of the pen.
const MOST_BODIES: u64 = 10_000_000;

/// A scene file's world and what there is to say about its meshes.
pub(crate) struct LoadedScene {
    pub scene: BuiltScene,
    pub notes: Vec<String>,
}

/// Reads a scene file and everything it refers to, and builds its world.
pub(crate) fn load(path: &Path, options: &SceneOptions) -> Result<LoadedScene, Problem> {
    let file = parse::read(path)?;
    let in_file = |(place, message)| Problem::SceneFile { path: path.to_owned(), place: Place(place), message };
    let (meshes, notes) = load_meshes(&file, path)?;
    let (hz, steps) = duration(&file, options).map_err(in_file)?;
    let mut world = world(&file.world, options).map_err(in_file)?;
    let seed = if options.seed == 0 { file.seed } else { options.seed };
    fill(&mut world, &file, &meshes, &mut Random::for_scene(1, seed)).map_err(in_file)?;
    Ok(LoadedScene { scene: BuiltScene { world, steps, hz, before_step: None }, notes })
}

/// JSON path and complaint.
type Complaint = (String, String);

type Meshes = BTreeMap<String, Shape>;

fn load_meshes(file: &SceneFile, path: &Path) -> Result<(Meshes, Vec<String>), Problem> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let (mut meshes, mut notes) = (Meshes::new(), Vec::new());
    for (name, spec) in &file.meshes {
        let mesh_path = folder.join(&spec.file);
        let loaded = obj::load(&mesh_path, spec)?;
        if loaded.left_out > 0 {
            notes.push(format!("{}: left out {} triangles without area", mesh_path.display(), loaded.left_out));
        }
        meshes.insert(name.clone(), loaded.shape);
    }
    Ok((meshes, notes))
}

/// Steps a second, and steps.
fn duration(file: &SceneFile, options: &SceneOptions) -> Result<(Real, usize), Complaint> {
    let hz = options.hz.unwrap_or(file.hz.map_or(60.0, |hz| hz.0));
    if !(0.1..=1e6).contains(&hz) {
        return Err(("hz".into(), format!("{hz} steps a second are out of range: give 0.1 to 1000000")));
    }
    let seconds = file.seconds.map_or(10.0, |seconds| seconds.0);
    let steps = f64::from(seconds) * f64::from(hz);
    if !(0.0..=1e9).contains(&steps) {
        return Err(("seconds".into(), format!("{seconds} s are {steps} steps: give 0 s to 1000000000 steps")));
    }
    Ok((hz, (steps + 0.5) as usize))
}

fn world(spec: &WorldSpec, options: &SceneOptions) -> Result<World, Complaint> {
    let default = WorldSettings::default();
    let number = |given: Option<Number>, default: Real| given.map_or(default, |number| number.0);
    let settings = WorldSettings {
        gravity: spec.gravity.map_or(default.gravity, vector),
        substeps: options.substeps.or(spec.substeps).unwrap_or(default.substeps),
        length_unit: number(spec.length_unit, default.length_unit),
        slop: number(spec.slop, default.slop),
        speculative_distance: number(spec.speculative_distance, default.speculative_distance),
        contact_break_distance: number(spec.contact_break_distance, default.contact_break_distance),
        contact_hertz: number(spec.contact_hertz, default.contact_hertz),
        contact_damping_ratio: number(spec.contact_damping_ratio, default.contact_damping_ratio),
        push_out_speed: number(spec.push_out_speed, default.push_out_speed),
        restitution_threshold: number(spec.restitution_threshold, default.restitution_threshold),
        hit_speed_threshold: number(spec.hit_speed_threshold, default.hit_speed_threshold),
        max_linear_speed: number(spec.max_linear_speed, default.max_linear_speed),
        allow_sleep: spec.allow_sleep.unwrap_or(default.allow_sleep),
        time_to_sleep: number(spec.time_to_sleep, default.time_to_sleep),
        sleep_speed: number(spec.sleep_speed, default.sleep_speed),
        continuous: spec.continuous.unwrap_or(default.continuous),
        threads: options.threads,
        simd: options.simd,
    };
    // The engine's message begins with the name of the field, which is the rest of the path.
    World::new(settings).map_err(|error| ("world".into(), error.to_string()))
}

fn fill(world: &mut World, file: &SceneFile, meshes: &Meshes, random: &mut Random) -> Result<(), Complaint> {
    let grids: u64 = file.grids.iter().map(cells).fold(0, u64::saturating_add);
    if grids.saturating_add(file.bodies.len() as u64) > MOST_BODIES {
        return Err(("grids".into(), format!("{grids} bodies are too many: the limit is {MOST_BODIES}")));
    }
    for (index, spec) in file.bodies.iter().enumerate() {
        let path = format!("bodies[{index}]");
        Template::new(spec, meshes, &path)?.add(world, &path)?;
    }
    for (index, spec) in file.grids.iter().enumerate() {
        fill_grid(world, spec, meshes, random, &format!("grids[{index}]"))?;
    }
    Ok(())
}

/// Bodies that a grid makes.
fn cells(grid: &GridSpec) -> u64 {
    let all = grid.count.iter().fold(1_u64, |product, &count| product.saturating_mul(u64::from(count)));
    all.min(grid.limit.unwrap_or(u64::MAX))
}

fn fill_grid(
    world: &mut World,
    grid: &GridSpec,
    meshes: &Meshes,
    random: &mut Random,
    path: &str,
) -> Result<(), Complaint> {
    let bodies: Vec<(Template, String)> = grid
        .bodies
        .iter()
        .enumerate()
        .map(|(index, spec)| {
            let path = format!("{path}.bodies[{index}]");
            Template::new(spec, meshes, &path).map(|template| (template, path))
        })
        .collect::<Result<_, _>>()?;
    if bodies.is_empty() {
        return Err((format!("{path}.bodies"), "a grid needs at least one body to repeat".into()));
    }
    let [columns, _, rows] = grid.count.map(u64::from);
    let centre = Vec3::new((columns as Real - 1.0) * 0.5, 0.0, (rows as Real - 1.0) * 0.5);
    let (spacing, origin) = (vector(grid.spacing), grid.origin.map_or(Vec3::ZERO, vector));
    let scatter = grid.scatter.map_or(0.0, |scatter| scatter.0);
    for cell in 0..cells(grid) {
        let (x, z, y) = (cell % columns, cell / columns % rows, cell / (columns * rows));
        let place = (Vec3::new(x as Real, y as Real, z as Real) - centre) * spacing + origin + random.in_cube(scatter);
        let (template, path) = &bodies[(cell % bodies.len() as u64) as usize];
        let turn = if grid.random_rotation { random.rotation() } else { Quat::IDENTITY };
        template.add_at(world, place, turn, path)?;
    }
    Ok(())
}

/// A body that can be added any number of times; hulls are built once and shared.
struct Template {
    body: BodyDefinition,
    shapes: Vec<ShapeDefinition>,
}

impl Template {
    fn new(spec: &BodySpec, meshes: &Meshes, path: &str) -> Result<Self, Complaint> {
        let default = BodyDefinition::default();
        let number = |given: Option<Number>, default: Real| given.map_or(default, |number| number.0);
        let body = BodyDefinition {
            kind: match spec.kind {
                KindSpec::Static => BodyKind::Static,
                KindSpec::Kinematic => BodyKind::Kinematic,
                KindSpec::Dynamic => BodyKind::Dynamic,
            },
            position: spec.position.map_or(default.position, vector),
            rotation: rotation(spec.rotation, spec.turn, path)?,
            linear_velocity: spec.linear_velocity.map_or(default.linear_velocity, vector),
            angular_velocity: spec.angular_velocity.map_or(default.angular_velocity, vector),
            linear_damping: number(spec.linear_damping, default.linear_damping),
            angular_damping: number(spec.angular_damping, default.angular_damping),
            gravity_scale: number(spec.gravity_scale, default.gravity_scale),
            locked_axes: spec.locked_axes.iter().fold(LockedAxes::NONE, |axes, &axis| axes | locked(axis)),
            can_sleep: spec.can_sleep.unwrap_or(default.can_sleep),
            awake: spec.awake.unwrap_or(default.awake),
            continuous: spec.continuous.unwrap_or(default.continuous),
            ..default
        };
        let shape = |(index, spec)| shape_definition(spec, meshes, &format!("{path}.shapes[{index}]"));
        let shapes = spec.shapes.iter().enumerate().map(shape).collect::<Result<Vec<_>, _>>()?;
        if shapes.is_empty() && body.kind == BodyKind::Dynamic {
            return Err((format!("{path}.shapes"), "a dynamic body needs a shape to have a mass".into()));
        }
        let mut template = Self { body, shapes };
        if let Some(mass) = spec.mass {
            template.set_mass(mass.0).map_err(|message| (format!("{path}.mass"), message))?;
        }
        Ok(template)
    }

    /// Scales all densities so that the shapes together weigh `mass`.
    fn set_mass(&mut self, mass: Real) -> Result<(), String> {
        let weigh = |shape: &ShapeDefinition| shape.shape.mass_properties(shape.density).map_or(0.0, |m| m.mass);
        let sum: Real = self.shapes.iter().map(weigh).sum();
        let factor = mass / sum;
        if mass > 0.0 && factor.is_finite() {
            self.shapes.iter_mut().for_each(|shape| shape.density *= factor);
            Ok(())
        } else {
            Err(format!("{mass} kg cannot be the mass of these shapes, which weigh {sum} kg by their densities"))
        }
    }

    fn add(&self, world: &mut World, path: &str) -> Result<(), Complaint> {
        self.add_definition(world, &self.body, path)
    }

    /// Adds the body at its own position from `place`, turned by `turn` after its own rotation.
    fn add_at(&self, world: &mut World, place: Vec3, turn: Quat, path: &str) -> Result<(), Complaint> {
        let body = self.body.clone();
        let (position, rotation) = (place + body.position, turns::then(body.rotation, turn));
        self.add_definition(world, &BodyDefinition { position, rotation, ..body }, path)
    }

    fn add_definition(&self, world: &mut World, body: &BodyDefinition, path: &str) -> Result<(), Complaint> {
        let id = world.add_body(body).map_err(|error| (path.to_owned(), error.to_string()))?;
        for (index, shape) in self.shapes.iter().enumerate() {
            world.add_shape(id, shape).map_err(|error| (format!("{path}.shapes[{index}]"), error.to_string()))?;
        }
        if !body.awake
            && let Some(mut body) = world.body_mut(id)
        {
            // More than one shape has woken it.
            body.sleep();
        }
        Ok(())
    }
}

fn shape_definition(spec: &ShapeSpec, meshes: &Meshes, path: &str) -> Result<ShapeDefinition, Complaint> {
    let surface = SurfaceSpec {
        friction: spec.friction,
        restitution: spec.restitution,
        rolling_resistance: spec.rolling_resistance,
        tangent_velocity: spec.tangent_velocity,
        anisotropy: spec.anisotropy,
        friction_combine: spec.friction_combine,
        restitution_combine: spec.restitution_combine,
    };
    let filter = spec.filter.as_ref().map_or(Filter::default(), |filter| Filter {
        category: filter.category.unwrap_or(1),
        mask: filter.mask.unwrap_or(u64::MAX),
        group: filter.group,
    });
    Ok(ShapeDefinition {
        position: spec.position.map_or(Vec3::ZERO, vector),
        rotation: rotation(spec.rotation, spec.turn, path)?,
        density: spec.density.map_or(1000.0, |number| number.0),
        material: material(&surface),
        palette: spec.palette.iter().map(material).collect(),
        filter,
        sensor: spec.sensor,
        one_way: spec.one_way.map(vector),
        ..ShapeDefinition::new(geometry(spec, meshes, path)?)
    })
}

fn material(spec: &SurfaceSpec) -> Material {
    let default = Material::default();
    let number = |given: Option<Number>, default: Real| given.map_or(default, |number| number.0);
    let combine_rule = |given: Option<CombineSpec>, default| given.map_or(default, combine);
    Material {
        friction: number(spec.friction, default.friction),
        restitution: number(spec.restitution, default.restitution),
        rolling_resistance: number(spec.rolling_resistance, default.rolling_resistance),
        tangent_velocity: spec.tangent_velocity.map_or(default.tangent_velocity, vector),
        anisotropy: spec.anisotropy.as_ref().map(|it| Anisotropy::new(vector(it.direction), it.ratio.0)),
        friction_combine: combine_rule(spec.friction_combine, default.friction_combine),
        restitution_combine: combine_rule(spec.restitution_combine, default.restitution_combine),
    }
}

/// The one geometry that a shape is given, scaled and rounded.
fn geometry(spec: &ShapeSpec, meshes: &Meshes, path: &str) -> Result<Shape, Complaint> {
    let mut shape = plain_geometry(spec, meshes, path)?;
    let complain = |name: &str, error: arbiter3d::ShapeError| (format!("{path}.{name}"), error.to_string());
    if let Some(Number(concavity)) = spec.decompose {
        shape = decomposed(&shape, concavity).map_err(|message| (format!("{path}.decompose"), message))?;
    }
    if let Some(scale) = spec.scale {
        shape = shape.scaled(vector(scale)).map_err(|error| complain("scale", error))?;
    }
    if let Some(Number(radius)) = spec.rounding {
        shape = Shape::rounded(&shape, radius).map_err(|error| complain("rounding", error))?;
    }
    Ok(shape)
}

/// Convex hulls instead of a mesh.
fn decomposed(shape: &Shape, concavity: Real) -> Result<Shape, String> {
    let Shape::Mesh(mesh) = shape else { return Err("only a mesh can be cut into convex hulls".to_owned()) };
    let settings = DecompositionSettings { concavity, ..DecompositionSettings::default() };
    let hulls = mesh.convex_decomposition(&settings).map_err(|error| error.to_string())?;
    let children: Vec<_> = hulls.into_iter().map(|hull| CompoundChild::new(Shape::Hull(hull.into()))).collect();
    Shape::compound(&children).map_err(|error| error.to_string())
}

/// A part of a compound.
fn compound_child(spec: &ShapeSpec, meshes: &Meshes, path: &str) -> Result<CompoundChild, Complaint> {
    Ok(CompoundChild {
        position: spec.position.map_or(Vec3::ZERO, vector),
        rotation: rotation(spec.rotation, spec.turn, path)?,
        density_factor: spec.density_factor.map_or(1.0, |number| number.0),
        material: spec.part.unwrap_or(0),
        ..CompoundChild::new(geometry(spec, meshes, path)?)
    })
}

/// The one geometry that a shape is given, as it is.
fn plain_geometry(spec: &ShapeSpec, meshes: &Meshes, path: &str) -> Result<Shape, Complaint> {
    let mut found: Vec<(&str, Result<Shape, String>)> = Vec::new();
    let mut add = |name, shape: Option<Result<Shape, arbiter3d::ShapeError>>| {
        found.extend(shape.map(|shape| (name, shape.map_err(|error| error.to_string()))));
    };
    let points = |hull: &HullSpec| hull.points.iter().copied().map(vector).collect::<Vec<Vec3>>();
    add("sphere", spec.sphere.as_ref().map(|s| Shape::sphere(s.radius.0)));
    add("capsule", spec.capsule.as_ref().map(|s| Shape::capsule(s.half_length.0, s.radius.0)));
    add("cuboid", spec.cuboid.as_ref().map(|s| Shape::cuboid(vector(s.half_extents))));
    add("hull", spec.hull.as_ref().map(|s| Shape::hull(&points(s))));
    add("cylinder", spec.cylinder.as_ref().map(|s| Shape::cylinder(s.half_length.0, s.radius.0)));
    add("cone", spec.cone.as_ref().map(|s| Shape::cone(s.half_length.0, s.radius.0)));
    add(
        "tapered_capsule",
        spec.tapered_capsule
            .as_ref()
            .map(|s| Shape::tapered_capsule(s.half_length.0, s.top_radius.0, s.bottom_radius.0)),
    );
    add("ellipsoid", spec.ellipsoid.as_ref().map(|s| Shape::ellipsoid(vector(s.half_axes))));
    add("half_space", spec.half_space.as_ref().map(|_| Ok(Shape::half_space())));
    add("triangle", spec.triangle.as_ref().map(|s| Shape::triangle(s.corners.map(vector))));
    add("point_cloud", spec.point_cloud.as_ref().map(|s| Shape::point_cloud(&points(s))));
    add(
        "height_field",
        spec.height_field.as_ref().map(|s| {
            let heights = s.heights.iter().map(|height| height.0).collect();
            let field = HeightField::new(heights, s.points_per_row, s.cell.map(|cell| cell.0))?;
            let parts = s.parts.clone();
            let field = if parts.is_empty() { field } else { field.with_materials(parts)? };
            Ok(Shape::HeightField(field.into()))
        }),
    );
    add("voxels", spec.voxels.as_ref().map(voxels));
    if let Some(children) = &spec.compound {
        let path = format!("{path}.compound");
        let children = children
            .iter()
            .enumerate()
            .map(|(index, child)| compound_child(child, meshes, &format!("{path}[{index}]")))
            .collect::<Result<Vec<_>, _>>()?;
        add("compound", Some(Shape::compound(&children)));
    }
    if let Some(name) = &spec.mesh {
        let known = || meshes.keys().map(|name| format!("{name:?}")).collect::<Vec<_>>().join(", ");
        let missing = || format!("there is no mesh {name:?} in \"meshes\", which has: {}", known());
        found.push(("mesh", meshes.get(name).cloned().ok_or_else(missing)));
    }
    match found.len() {
        1 => {
            let (name, shape) = found.remove(0);
            shape.map_err(|message| (format!("{path}.{name}"), message))
        }
        count => {
            let message = format!(
                "a shape has exactly one geometry (sphere, capsule, cuboid, hull, … or mesh), this one has {count}"
            );
            Err((path.to_owned(), message))
        }
    }
}

fn voxels(spec: &VoxelsSpec) -> Result<Shape, arbiter3d::ShapeError> {
    let grid = VoxelGrid::new(spec.cell_size.0, spec.cells.iter().copied())?;
    let (given, expected) = (spec.parts.len(), spec.cells.len());
    if given != 0 && given != expected {
        return Err(arbiter3d::ShapeError::WrongCount { what: "parts", given, expected });
    }
    let parts: Vec<_> = spec.cells.iter().copied().zip(spec.parts.iter().copied()).collect();
    Ok(Shape::Voxels(grid.with_materials(&parts)?.into()))
}

fn rotation(quaternion: Option<[Number; 4]>, turn: Option<Turn>, path: &str) -> Result<Quat, Complaint> {
    match (quaternion, turn) {
        (Some(_), Some(_)) => Err((format!("{path}.turn"), "give either rotation or turn, not both".into())),
        (Some(q), None) => {
            let q = q.map(|number| number.0);
            let length = (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]).sqrt();
            if (length - 1.0).abs() > arbiter3d::UNIT_TOLERANCE {
                let message =
                    format!("the quaternion has length {length}: it must be 1, or use turn with axis and angle");
                return Err((format!("{path}.rotation"), message));
            }
            Ok(Quat::from_array(q))
        }
        (None, Some(turn)) => {
            let axis = vector(turn.axis);
            let length = axis.length();
            if !(length > 1e-20 && length.is_finite()) {
                return Err((format!("{path}.turn.axis"), "an axis needs a direction: it must not be zero".into()));
            }
            Ok(turns::about(axis / length, turn.degrees.0.to_radians()))
        }
        (None, None) => Ok(Quat::IDENTITY),
    }
}

fn vector(triple: Triple) -> Vec3 {
    Vec3::new(triple[0].0, triple[1].0, triple[2].0)
}

fn locked(axis: AxisSpec) -> LockedAxes {
    match axis {
        AxisSpec::TranslationX => LockedAxes::TRANSLATION_X,
        AxisSpec::TranslationY => LockedAxes::TRANSLATION_Y,
        AxisSpec::TranslationZ => LockedAxes::TRANSLATION_Z,
        AxisSpec::RotationX => LockedAxes::ROTATION_X,
        AxisSpec::RotationY => LockedAxes::ROTATION_Y,
        AxisSpec::RotationZ => LockedAxes::ROTATION_Z,
    }
}

fn combine(rule: CombineSpec) -> CombineRule {
    match rule {
        CombineSpec::Maximum => CombineRule::Maximum,
        CombineSpec::Average => CombineRule::Average,
        CombineSpec::GeometricMean => CombineRule::GeometricMean,
        CombineSpec::Multiply => CombineRule::Multiply,
        CombineSpec::Minimum => CombineRule::Minimum,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn built(text: &str) -> Result<World, Complaint> {
        let file = parse::parse(text).map_err(|(place, message)| (place.0, message))?;
        let options = SceneOptions::default();
        duration(&file, &options)?;
        let mut world = world(&file.world, &options)?;
        fill(&mut world, &file, &Meshes::new(), &mut Random::for_scene(1, file.seed))?;
        Ok(world)
    }

    #[test]
    fn grids_repeat_their_bodies_in_turn_around_their_origin() {
        let world = built(
            r#"{"grids": [{"count": [3, 2, 2], "spacing": [2, 1, 4], "origin": [10, 5, 0], "limit": 11, "bodies": [
                {"shapes": [{"sphere": {"radius": 0.5}}]},
                {"position": [0, 0.25, 0], "shapes": [{"cuboid": {"half_extents": [1, 1, 1]}}]}]}]}"#,
        )
        .unwrap();
        let positions: Vec<Vec3> = world.bodies().skip(1).map(|id| world.body(id).unwrap().position()).collect();
        assert_eq!(positions.len(), 11);
        assert_eq!(positions[0], Vec3::new(8.0, 5.0, -2.0));
        assert_eq!(positions[1], Vec3::new(10.0, 5.25, -2.0));
        assert_eq!(positions[10], Vec3::new(10.0, 6.0, 2.0));
    }

    #[test]
    fn a_given_mass_scales_the_densities() {
        let shapes = r#"[{"cuboid": {"half_extents": [0.5, 0.5, 0.5]}}, {"sphere": {"radius": 1}, "density": 10}]"#;
        let world = built(&format!(r#"{{"bodies": [{{"mass": 7, "shapes": {shapes}}}]}}"#)).unwrap();
        let mass = world.body(world.bodies().nth(1).unwrap()).unwrap().mass();
        assert!((mass - 7.0).abs() < 1e-5, "{mass}");
    }

    #[test]
    fn bodies_that_start_asleep_sleep_until_something_comes() {
        let shapes = r#"[{"cuboid": {"half_extents": [0.5, 0.5, 0.5]}}, {"sphere": {"radius": 0.5}}]"#;
        let floor =
            r#"{"kind": "static", "position": [0, -1, 0], "shapes": [{"cuboid": {"half_extents": [9, 1, 9]}}]}"#;
        let sleeper = format!(r#"{{"position": [0, 0.5, 0], "awake": false, "shapes": {shapes}}}"#);
        let mut world = built(&format!(r#"{{"bodies": [{floor}, {sleeper}]}}"#)).unwrap();
        world.step(1.0 / 60.0).unwrap();
        assert_eq!((world.awake_count(), world.sleeping_count()), (0, 1));
    }

    #[test]
    fn a_turn_is_a_rotation() {
        let body = r#"{"turn": {"axis": [0, 0, 2], "degrees": 90}, "shapes": [{"sphere": {"radius": 1}}]}"#;
        let world = built(&format!(r#"{{"bodies": [{body}]}}"#)).unwrap();
        let rotation = world.body(world.bodies().nth(1).unwrap()).unwrap().rotation();
        let half = 0.5_f32.sqrt();
        assert!((rotation.z - half).abs() < 1e-6 && (rotation.w - half).abs() < 1e-6, "{rotation:?}");
    }

    #[test]
    fn surfaces_are_given_to_their_shapes() {
        let world = built(
            r#"{"world": {"hit_speed_threshold": 2.5}, "bodies": [{"shapes": [{"sphere": {"radius": 1},
                "one_way": [0, 1, 0], "tangent_velocity": [2, 0, 0],
                "anisotropy": {"direction": [0, 0, 1], "ratio": 0.25}}]}]}"#,
        )
        .unwrap();
        assert_eq!(world.settings().hit_speed_threshold, 2.5);
        let body = world.bodies().nth(1).unwrap();
        let shape = world.shape(world.body(body).unwrap().shapes()[0]).unwrap();
        assert_eq!((shape.one_way(), shape.material().tangent_velocity), (Some(Vec3::Y), Vec3::X * 2.0));
        assert_eq!(shape.material().anisotropy, Some(Anisotropy::new(Vec3::Z, 0.25)));
    }

    #[test]
    fn parts_have_surfaces_of_their_own() {
        let head = r#"{"cuboid": {"half_extents": [0.1, 0.1, 0.2]}, "density_factor": 7.8, "part": 1}"#;
        let handle = r#"{"capsule": {"half_length": 0.3, "radius": 0.02}, "position": [0, -0.4, 0]}"#;
        let palette = r#""palette": [{"friction": 0.1}, {"friction": 0.7, "restitution": 0.5}]"#;
        let hammer = format!(r#"{{"shapes": [{{"compound": [{handle}, {head}], {palette}}}]}}"#);
        let cells = r#"{"cell_size": 1, "cells": [[0, 0, 0], [1, 0, 0]], "parts": [0, 1]}"#;
        let ground = format!(r#"{{"kind": "static", "shapes": [{{"voxels": {cells}, {palette}}}]}}"#);
        let field = r#"{"heights": [0, 0, 0, 0, 0, 0], "points_per_row": 3, "cell": [1, 1], "parts": [1, 0]}"#;
        let field = format!(r#"{{"kind": "static", "shapes": [{{"height_field": {field}, {palette}}}]}}"#);
        let world = built(&format!(r#"{{"bodies": [{hammer}, {ground}, {field}]}}"#)).unwrap();
        let shape = |nth: usize| world.body(world.bodies().nth(nth).unwrap()).unwrap().shapes()[0];
        let hammer = world.shape(shape(1)).unwrap();
        assert_eq!(
            hammer.palette().iter().map(|m| (m.friction, m.restitution)).collect::<Vec<_>>(),
            [(0.1, 0.0), (0.7, 0.5)]
        );
        let Shape::Compound(compound) = hammer.geometry() else { panic!("a compound") };
        let of = |child: usize| (compound.children()[child].material, compound.children()[child].density_factor);
        assert_eq!((of(0), of(1)), ((0, 1.0), (1, 7.8)));
        let Shape::Voxels(grid) = world.shape(shape(2)).unwrap().geometry() else { panic!("voxels") };
        assert_eq!((grid.material([0, 0, 0]), grid.material([1, 0, 0])), (0, 1));
        let short =
            r#"{"bodies": [{"shapes": [{"voxels": {"cell_size": 1, "cells": [[0, 0, 0]], "parts": [1, 2]}}]}]}"#;
        let complaint = built(short).err().unwrap();
        assert!(complaint.0 == "bodies[0].shapes[0].voxels" && complaint.1.contains("parts"), "{complaint:?}");
    }

    #[test]
    fn what_the_engine_refuses_is_named_by_its_path() {
        let ball = r#""shapes": [{"sphere": {"radius": 1}}]"#;
        let cases = [
            (
                r#"{"bodies": [{"shapes": [{"sphere": {"radius": -1}}]}]}"#.to_owned(),
                "bodies[0].shapes[0].sphere",
                "-1",
            ),
            (r#"{"bodies": [{"shapes": [{"friction": 1}]}]}"#.to_owned(), "bodies[0].shapes[0]", "exactly one"),
            (r#"{"bodies": [{"shapes": [{"mesh": "x"}]}]}"#.to_owned(), "bodies[0].shapes[0].mesh", "no mesh \"x\""),
            (r#"{"bodies": [{}]}"#.to_owned(), "bodies[0].shapes", "needs a shape"),
            (format!(r#"{{"bodies": [{{"rotation": [1, 1, 0, 0], {ball}}}]}}"#), "bodies[0].rotation", "length"),
            (format!(r#"{{"bodies": [{{"linear_damping": -2, {ball}}}]}}"#), "bodies[0]", "linear_damping is -2"),
            (format!(r#"{{"bodies": [{{"mass": 0, {ball}}}]}}"#), "bodies[0].mass", "0 kg"),
            (
                r#"{"bodies": [{"shapes": [{"sphere": {"radius": 1}, "restitution": 2}]}]}"#.to_owned(),
                "bodies[0].shapes[0]",
                "restitution is 2",
            ),
            (
                r#"{"bodies": [{"shapes": [{"sphere": {"radius": 1}, "one_way": [0, 2, 0]}]}]}"#.to_owned(),
                "bodies[0].shapes[0]",
                "one_way",
            ),
            (
                r#"{"bodies": [{"shapes": [{"sphere": {"radius": 1}, "anisotropy": {"direction": [1, 0, 0], "ratio": 0}}]}]}"#
                    .to_owned(),
                "bodies[0].shapes[0]",
                "anisotropy ratio is 0",
            ),
            (r#"{"world": {"substeps": 0}}"#.to_owned(), "world", "substeps is 0"),
            (r#"{"hz": 0}"#.to_owned(), "hz", "0 steps a second"),
            (r#"{"seconds": -1}"#.to_owned(), "seconds", "-1 s"),
            (
                r#"{"grids": [{"count": [2, 2, 2], "spacing": [1, 1, 1], "bodies": []}]}"#.to_owned(),
                "grids[0].bodies",
                "at least one",
            ),
            (
                format!(
                    r#"{{"grids": [{{"count": [9999, 9999, 9999], "spacing": [1, 1, 1], "bodies": [{{{ball}}}]}}]}}"#
                ),
                "grids",
                "too many",
            ),
        ];
        for (text, path, part) in cases {
            let complaint = built(&text).err().unwrap();
            assert!(complaint.0 == path && complaint.1.contains(part), "{text} gives {complaint:?}");
        }
    }
}
