//! What a scene file may contain. The comments on the fields are the descriptions in the JSON schema.

use serde::Deserialize;
use serde::de::{Deserializer, Error, Visitor};
use std::collections::BTreeMap;

/// A number that is finite in single precision.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(transparent))]
pub(crate) struct Number(pub f32);

impl<'de> Deserialize<'de> for Number {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Finite;
        impl Visitor<'_> for Finite {
            type Value = Number;
            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("a number")
            }
            fn visit_f64<E: Error>(self, value: f64) -> Result<Number, E> {
                let single = value as f32;
                if single.is_finite() {
                    Ok(Number(single))
                } else {
                    Err(E::custom(format!("{value:e} is too large: numbers must be finite in single precision")))
                }
            }
            fn visit_i64<E: Error>(self, value: i64) -> Result<Number, E> {
                Ok(Number(value as f32))
            }
            fn visit_u64<E: Error>(self, value: u64) -> Result<Number, E> {
                Ok(Number(value as f32))
            }
        }
        deserializer.deserialize_f64(Finite)
    }
}

/// Three numbers: x, y and z.
pub(crate) type Triple = [Number; 3];

/// A scene for the `arbiter3d` command. Metres, kilograms, seconds; +y is up unless gravity says otherwise.
#[derive(Debug, Default, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub(crate) struct SceneFile {
    /// Where the schema is, for editors. Ignored.
    #[serde(rename = "$schema")]
    pub _schema: Option<String>,
    /// What the scene shows. Ignored by the engine.
    #[serde(rename = "description")]
    pub _description: Option<String>,
    /// How long to run, seconds. Default 10.
    pub seconds: Option<Number>,
    /// Steps a second, 0.1 to 1000000. Default 60.
    pub hz: Option<Number>,
    /// Start of the random numbers that scatter grids. Default 0.
    pub seed: u64,
    /// Settings of the world.
    pub world: WorldSpec,
    /// Meshes by name, for shapes to refer to.
    pub meshes: BTreeMap<String, MeshSpec>,
    /// Bodies, one by one.
    pub bodies: Vec<BodySpec>,
    /// Bodies repeated on grids.
    pub grids: Vec<GridSpec>,
}

/// Settings of the world. All have defaults; lengths and speeds are multiplied by `length_unit`.
#[derive(Debug, Default, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub(crate) struct WorldSpec {
    /// Acceleration of every dynamic body, m/s². Default [0, -9.81, 0].
    pub gravity: Option<Triple>,
    /// Solver slices of a step, 1 to 64. Default 4.
    pub substeps: Option<u32>,
    /// How many of the file's units make a metre: 1000 for millimetres. Default 1.
    pub length_unit: Option<Number>,
    /// Scale of overlap that does not matter, metres: contacts at rest give at most 1.97 of it. Default 0.005.
    pub slop: Option<Number>,
    /// Gap below which contacts are found ahead of touching, metres. Default 0.02.
    pub speculative_distance: Option<Number>,
    /// Gap or drift at which a cached contact breaks, metres. Default 0.02.
    pub contact_break_distance: Option<Number>,
    /// Stiffness of contacts, Hz. Default 45.
    pub contact_hertz: Option<Number>,
    /// Damping ratio of contacts. Default 3.
    pub contact_damping_ratio: Option<Number>,
    /// Speed limit at which overlapping bodies are pushed apart, m/s. Default 3.
    pub push_out_speed: Option<Number>,
    /// Approach speed below which nothing bounces, m/s. Default 1.
    pub restitution_threshold: Option<Number>,
    /// Approach speed from which on a contact is a hit, m/s. Default 1.
    pub hit_speed_threshold: Option<Number>,
    /// Speed limit of bodies, m/s. Default 1000.
    pub max_linear_speed: Option<Number>,
    /// Whether resting islands may fall asleep. Default true.
    pub allow_sleep: Option<bool>,
    /// How long an island rests before it sleeps, seconds. Default 0.5.
    pub time_to_sleep: Option<Number>,
    /// Speed below which a body rests, m/s. Default 0.05.
    pub sleep_speed: Option<Number>,
    /// Whether fast bodies are stopped at static shapes they would pass through. Default true.
    pub continuous: Option<bool>,
}

/// A triangle mesh in a Wavefront OBJ file. Faces with more than three corners are split; faces without area are left
/// out, and their number is printed.
#[derive(Debug, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct MeshSpec {
    /// Path of the OBJ file, relative to the scene file.
    pub file: String,
    /// Multiplies all coordinates. Default 1.
    pub scale: Option<Number>,
    /// Which axis of the OBJ file points up: "z" turns it to y. Default "y".
    #[serde(default)]
    pub up: UpAxis,
    /// "one": solid on the side from which the corners wind counter-clockwise. "two": solid on both. Default "one".
    #[serde(default)]
    pub sides: SidesSpec,
    /// Whether to reverse the winding of all faces. Default false.
    #[serde(default)]
    pub flip: bool,
}

/// An axis that points up.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub(crate) enum UpAxis {
    #[default]
    Y,
    Z,
}

/// Which sides of its triangles a mesh is solid on.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub(crate) enum SidesSpec {
    #[default]
    One,
    Two,
}

/// A turn about an axis.
#[derive(Clone, Copy, Debug, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct Turn {
    /// The axis, of any length but zero.
    pub axis: Triple,
    /// The angle, counter-clockwise seen against the axis.
    pub degrees: Number,
}

/// A rigid body.
#[derive(Debug, Default, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub(crate) struct BodySpec {
    /// What the body is, for readers of the file. Ignored.
    #[serde(rename = "name")]
    pub _name: Option<String>,
    /// "static", "kinematic" (moves as told) or "dynamic" (moves by forces). Default "dynamic".
    pub kind: KindSpec,
    /// Origin of the body's frame, metres; in a grid, from the body's place on it. Default [0, 0, 0].
    pub position: Option<Triple>,
    /// Unit quaternion [x, y, z, w]. Default [0, 0, 0, 1]. Either this or `turn`.
    pub rotation: Option<[Number; 4]>,
    /// The rotation as axis and angle.
    pub turn: Option<Turn>,
    /// Velocity of the centre of mass, m/s. Default [0, 0, 0].
    pub linear_velocity: Option<Triple>,
    /// Angular velocity about world axes, rad/s. Default [0, 0, 0].
    pub angular_velocity: Option<Triple>,
    /// Rate at which linear velocity decays, 1/s. Default 0.
    pub linear_damping: Option<Number>,
    /// Rate at which angular velocity decays, 1/s. Default 0.
    pub angular_damping: Option<Number>,
    /// Multiplies gravity. Default 1.
    pub gravity_scale: Option<Number>,
    /// World axes on which the body may not move. Default none.
    pub locked_axes: Vec<AxisSpec>,
    /// Total mass, kg: scales the densities of the shapes. Default: by the densities as they are.
    pub mass: Option<Number>,
    /// Whether the body may fall asleep. Default true.
    pub can_sleep: Option<bool>,
    /// Whether the body starts awake. Default true.
    pub awake: Option<bool>,
    /// Whether continuous collision stops the body at static shapes when it is fast. Default true.
    pub continuous: Option<bool>,
    /// What the body is made of.
    pub shapes: Vec<ShapeSpec>,
}

/// How a body moves.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub(crate) enum KindSpec {
    Static,
    Kinematic,
    #[default]
    Dynamic,
}

/// An axis that is locked.
#[derive(Clone, Copy, Debug, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub(crate) enum AxisSpec {
    TranslationX,
    TranslationY,
    TranslationZ,
    RotationX,
    RotationY,
    RotationZ,
}

/// A shape on a body: exactly one geometry (`sphere`, `capsule`, …, `mesh`), and how it sits there.
#[derive(Debug, Default, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub(crate) struct ShapeSpec {
    /// A ball about the origin.
    pub sphere: Option<SphereSpec>,
    /// A segment on the y axis with a radius.
    pub capsule: Option<CapsuleSpec>,
    /// A box about the origin.
    pub cuboid: Option<CuboidSpec>,
    /// The convex hull of some points.
    pub hull: Option<HullSpec>,
    /// A cylinder along the y axis.
    pub cylinder: Option<CylinderSpec>,
    /// A cone along the y axis, its tip up.
    pub cone: Option<CylinderSpec>,
    /// The convex hull of two balls on the y axis.
    pub tapered_capsule: Option<TaperedCapsuleSpec>,
    /// An ellipsoid about the origin.
    pub ellipsoid: Option<EllipsoidSpec>,
    /// Everything below the origin; for static and kinematic bodies. Written as `{}`.
    pub half_space: Option<HalfSpaceSpec>,
    /// A single triangle, solid on both sides.
    pub triangle: Option<TriangleSpec>,
    /// The shrink-wrap of points, which may be flat.
    pub point_cloud: Option<HullSpec>,
    /// Ground by a grid of heights; for static and kinematic bodies.
    pub height_field: Option<HeightFieldSpec>,
    /// Solid cubic cells.
    pub voxels: Option<VoxelsSpec>,
    /// Placed geometries that are one shape: of each child only geometry, `scale`, `rounding`, `position`, `rotation`,
    /// `turn`, `density_factor` and `part` count.
    pub compound: Option<Vec<ShapeSpec>>,
    /// Of a child of a compound: how many times as dense it is as the rest, zero or more. Default 1.
    pub density_factor: Option<Number>,
    /// Of a child of a compound: which of the compound's `palette` its surface is. Default 0.
    pub part: Option<u8>,
    /// Surfaces of the parts of a compound, of voxels or of a height field, by their numbers; parts with a number past the end
    /// have the surface of the shape. Default: all have.
    pub palette: Vec<SurfaceSpec>,
    /// Name of a mesh in `meshes`.
    pub mesh: Option<String>,
    /// Cuts a closed mesh into convex hulls, of which at most this share (above 0) may be empty: 0.05 is a good start.
    /// Default: the mesh as it is.
    pub decompose: Option<Number>,
    /// Grows a convex geometry by a radius on all sides, metres. Default: not.
    pub rounding: Option<Number>,
    /// Multiplies the geometry along its axes, before `rounding`; negative numbers mirror. Default [1, 1, 1].
    pub scale: Option<Triple>,
    /// Where the shape's frame sits on the body, metres. Default [0, 0, 0].
    pub position: Option<Triple>,
    /// Unit quaternion [x, y, z, w]. Default [0, 0, 0, 1]. Either this or `turn`.
    pub rotation: Option<[Number; 4]>,
    /// The rotation as axis and angle.
    pub turn: Option<Turn>,
    /// Mass per volume, kg/m³. Default 1000.
    pub density: Option<Number>,
    /// Coulomb friction. Default 0.5.
    pub friction: Option<Number>,
    /// Share of the approach speed given back, 0 to 1. Default 0.
    pub restitution: Option<Number>,
    /// Torque that resists rolling, as a share of normal force times radius. Default 0.01.
    pub rolling_resistance: Option<Number>,
    /// Velocity of the surface in the body's frame, m/s: a conveyor belt. Default [0, 0, 0].
    pub tangent_velocity: Option<Triple>,
    /// Friction that differs along a direction: skis, tracks. Default none.
    pub anisotropy: Option<AnisotropySpec>,
    /// How the frictions of two shapes make one. Default "maximum".
    pub friction_combine: Option<CombineSpec>,
    /// How the restitutions of two shapes make one. Default "maximum".
    pub restitution_combine: Option<CombineSpec>,
    /// Which shapes it meets.
    pub filter: Option<FilterSpec>,
    /// Whether it only reports what overlaps it and pushes nothing. Default false.
    pub sensor: bool,
    /// The way in which bodies pass through it, a unit vector in its frame. Default none: nothing passes.
    pub one_way: Option<Triple>,
}

/// What a part of a shape is made of.
#[derive(Debug, Default, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub(crate) struct SurfaceSpec {
    /// Coulomb friction. Default 0.5.
    pub friction: Option<Number>,
    /// Share of the approach speed given back, 0 to 1. Default 0.
    pub restitution: Option<Number>,
    /// Torque that resists rolling, as a share of normal force times radius. Default 0.01.
    pub rolling_resistance: Option<Number>,
    /// Velocity of the surface in the body's frame, m/s: a conveyor belt. Default [0, 0, 0].
    pub tangent_velocity: Option<Triple>,
    /// Friction that differs along a direction: skis, tracks. Default none.
    pub anisotropy: Option<AnisotropySpec>,
    /// How the frictions of two shapes make one. Default "maximum".
    pub friction_combine: Option<CombineSpec>,
    /// How the restitutions of two shapes make one. Default "maximum".
    pub restitution_combine: Option<CombineSpec>,
}

/// Friction that differs along a direction.
#[derive(Clone, Copy, Debug, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct AnisotropySpec {
    /// Unit vector in the shape's frame.
    pub direction: Triple,
    /// Friction along it as a share of that across, 0.001 to 1000.
    pub ratio: Number,
}

/// A ball.
#[derive(Debug, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct SphereSpec {
    /// Metres.
    pub radius: Number,
}

/// A segment on the y axis with a radius.
#[derive(Debug, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct CapsuleSpec {
    /// From the middle to each end of the segment, metres.
    pub half_length: Number,
    /// Metres.
    pub radius: Number,
}

/// A box.
#[derive(Debug, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct CuboidSpec {
    /// Half the size along each axis, metres.
    pub half_extents: Triple,
}

/// A convex hull.
#[derive(Debug, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct HullSpec {
    /// At least four points that are not flat, metres; at most 255 of them on the hull.
    pub points: Vec<Triple>,
}

/// A cylinder or a cone.
#[derive(Debug, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct CylinderSpec {
    /// From the middle to each end, metres.
    pub half_length: Number,
    /// Of the cylinder, or of the cone's base, metres.
    pub radius: Number,
}

/// Two balls and all that is between them.
#[derive(Debug, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct TaperedCapsuleSpec {
    /// From the middle to the centre of each ball, metres.
    pub half_length: Number,
    /// Of the upper ball, metres.
    pub top_radius: Number,
    /// Of the lower ball, metres.
    pub bottom_radius: Number,
}

/// An ellipsoid.
#[derive(Debug, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct EllipsoidSpec {
    /// Half the size along each axis, metres.
    pub half_axes: Triple,
}

/// An endless floor; it has no numbers.
#[derive(Debug, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct HalfSpaceSpec {}

/// A grid of heights.
#[derive(Debug, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct HeightFieldSpec {
    /// Heights of the points, row by row along z, metres.
    pub heights: Vec<Number>,
    /// Points in a row along x, at least two.
    pub points_per_row: usize,
    /// From one point to the next along x and along z, metres.
    pub cell: [Number; 2],
    /// Of each cell in turn, row by row, which of the shape's `palette` its surface is. Default: all 0.
    #[serde(default)]
    pub parts: Vec<u8>,
}

/// Solid cubic cells.
#[derive(Debug, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct VoxelsSpec {
    /// Edge of a cell, metres.
    pub cell_size: Number,
    /// The solid cells: cell [i, j, k] reaches from (i, j, k) to (i + 1, j + 1, k + 1) times the cell size.
    pub cells: Vec<[i32; 3]>,
    /// Of each cell in turn, which of the shape's `palette` its surface is. Default: all 0.
    #[serde(default)]
    pub parts: Vec<u8>,
}

/// A triangle.
#[derive(Debug, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct TriangleSpec {
    /// Its corners, metres.
    pub corners: [Triple; 3],
}

/// How two numbers make one.
#[derive(Clone, Copy, Debug, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub(crate) enum CombineSpec {
    Maximum,
    Average,
    GeometricMean,
    Multiply,
    Minimum,
}

/// Two shapes collide when each one's mask has a category of the other; a shared non-zero group overrules that.
#[derive(Debug, Default, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub(crate) struct FilterSpec {
    /// What this shape is, as bits. Default 1.
    pub category: Option<u64>,
    /// What this shape meets, as bits. Default all.
    pub mask: Option<u64>,
    /// Positive: always collides with its own group; negative: never. Default 0: no group.
    pub group: i32,
}

/// Bodies on the points of a regular grid, the given ones in turn.
#[derive(Debug, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct GridSpec {
    /// How many points along x, y and z.
    pub count: [u32; 3],
    /// From one point to the next along x, y and z, metres.
    pub spacing: Triple,
    /// Centre of the lowest layer, metres. Default [0, 0, 0].
    pub origin: Option<Triple>,
    /// Fill only so many points, the lowest layers first. Default: all.
    pub limit: Option<u64>,
    /// Move each body by up to so much along each axis, at random, metres. Default 0.
    pub scatter: Option<Number>,
    /// Turn each body at random. Default false.
    #[serde(default)]
    pub random_rotation: bool,
    /// The bodies that the points get in turn: the first point the first one, and so on, again from the start.
    pub bodies: Vec<BodySpec>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    /// The published schema is that of these structures. `UPDATE_SCHEMA=1 cargo test` writes it anew.
    #[test]
    fn the_published_schema_is_up_to_date() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/scene.schema.json");
        let schema = serde_json::to_string_pretty(&schemars::schema_for!(SceneFile)).unwrap() + "\n";
        if std::env::var_os("UPDATE_SCHEMA").is_some() {
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(&path, &schema).unwrap();
        }
        let published = std::fs::read_to_string(&path).unwrap_or_default();
        assert!(published == schema, "docs/scene.schema.json is out of date: run UPDATE_SCHEMA=1 cargo test");
    }

    #[test]
    fn numbers_are_finite_in_single_precision() {
        let number = |text: &str| serde_json::from_str::<Number>(text).map(|number| number.0);
        assert_eq!(number("-2").unwrap(), -2.0);
        assert_eq!(number("18446744073709551615").unwrap(), 1.844_674_4e19);
        assert_eq!(number("3.4e38").unwrap(), 3.4e38);
        assert!(number("3.5e38").is_err() && number("\"1\"").is_err());
    }
}
