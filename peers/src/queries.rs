//! Rays and shape casts a second: the same questions to every engine, one thread, in worlds of static shapes.
//!
//! Every engine is built from the same plain data and asked through its public interface for the closest hit. How many
//! questions hit and the sum of the fractions are reported beside each time: engines that did the same work agree on
//! both. Runs alternate between engines; the fastest of the repetitions counts.

use crate::args::Wrong;
use crate::engine::{Ask, Kind, ask};
use crate::scene::{Body, Scene};
use arbiter3d::math::{Quat, Real, Vec3};
use arbiter3d::{BodyDefinition, Shape, ShapeDefinition, WorldSettings};
use clap::Parser;
use std::path::PathBuf;
use std::time::Instant;

/// Rays and shape casts a second in worlds of static shapes, on one thread.
#[derive(Debug, Parser)]
pub struct QueryArgs {
    /// Fewer questions: seconds instead of minutes
    #[arg(long)]
    quick: bool,
    /// Only worlds whose name has this in it
    #[arg(long, value_name = "TEXT")]
    only: Option<String>,
    /// Which engines: arbiter3d, box3d, rapier
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    engines: Vec<String>,
    /// Writes the results to a file as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// What is asked, from where and how far.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Question {
    Ray,
    Ball,
    Box,
}

impl Question {
    const ALL: [Self; 3] = [Self::Ray, Self::Ball, Self::Box];

    fn name(self) -> &'static str {
        match self {
            Self::Ray => "ray",
            Self::Ball => "sphere cast",
            Self::Box => "box cast",
        }
    }
}

/// Radius of the ball that is cast, metres.
pub const BALL: Real = 0.3;
/// Half extents of the box that is cast.
pub const BOX: Vec3 = Vec3::new(0.2, 0.3, 0.4);

/// How the box that is cast is turned.
pub fn tilt() -> Quat {
    let length = (0.04_f32 + 0.01 + 0.09 + 0.64).sqrt();
    Quat::from_xyzw(0.2 / length, -0.1 / length, 0.3 / length, 0.8 / length)
}

/// A line from a point along a vector.
type Line = (Vec3, Vec3);

/// A world and the lines to ask about.
struct Setting {
    name: &'static str,
    scene: Scene,
    lines: Vec<Line>,
}

/// One engine's answer to one kind of question in one world.
struct Row {
    setting: &'static str,
    question: Question,
    kind: Kind,
    count: usize,
    /// Shortest time of a run, seconds.
    seconds: f64,
    hits: usize,
    fractions: f64,
}

impl Row {
    fn per_second(&self) -> f64 {
        self.count as f64 / self.seconds
    }
}

/// Runs everything and prints the table.
pub fn compare(args: &QueryArgs) -> Result<(), Wrong> {
    let engines = engines(&args.engines)?;
    let (count, reps) = if args.quick { (10_000, 3) } else { (100_000, 7) };
    let mut rows = Vec::new();
    for setting in settings(count) {
        if args.only.as_ref().is_some_and(|text| !setting.name.contains(text.as_str())) {
            continue;
        }
        let worlds: Vec<(Kind, Box<dyn Ask>)> =
            engines.iter().filter_map(|&kind| Some((kind, ask(kind, &setting.scene)?))).collect();
        for question in Question::ALL {
            let lines = if question == Question::Ray { &setting.lines[..] } else { &setting.lines[..count / 4] };
            let mut found: Vec<Row> =
                worlds.iter().map(|(kind, _)| row(setting.name, question, *kind, lines)).collect();
            for _ in 0..reps {
                for ((_, world), row) in worlds.iter().zip(&mut found) {
                    row.time(&**world, lines);
                }
            }
            rows.extend(found);
        }
    }
    print!("{}", table(&rows));
    if let Some(path) = &args.json {
        crate::args::write(path, Some(&format!("{:#}\n", json(&rows))))?;
    }
    Ok(())
}

fn engines(names: &[String]) -> Result<Vec<Kind>, Wrong> {
    if names.is_empty() {
        return Ok(vec![Kind::Arbiter, Kind::Box3d, Kind::Rapier]);
    }
    names.iter().map(|name| Kind::find(name).ok_or_else(|| Wrong::Engine { name: name.clone() })).collect()
}

fn row(setting: &'static str, question: Question, kind: Kind, lines: &[Line]) -> Row {
    Row { setting, question, kind, count: lines.len(), seconds: f64::MAX, hits: 0, fractions: 0.0 }
}

impl Row {
    fn time(&mut self, world: &dyn Ask, lines: &[Line]) {
        let (mut hits, mut fractions) = (0, 0.0);
        let start = Instant::now();
        for &(origin, way) in lines {
            let hit = match self.question {
                Question::Ray => world.ray(origin, way),
                Question::Ball => world.ball(origin, way),
                Question::Box => world.cuboid(origin, way),
            };
            if let Some(fraction) = hit {
                hits += 1;
                fractions += f64::from(fraction);
            }
        }
        let seconds = start.elapsed().as_secs_f64();
        if seconds < self.seconds {
            self.seconds = seconds;
        }
        (self.hits, self.fractions) = (hits, fractions);
    }
}

/// SplitMix64.
struct Random(u64);

impl Random {
    fn between(&mut self, low: Real, high: Real) -> Real {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        low + (high - low) * ((z ^ (z >> 31)) >> 40) as Real / 16_777_216.0
    }

    fn vector(&mut self, half: Real) -> Vec3 {
        Vec3::new(self.between(-half, half), self.between(-half, half), self.between(-half, half))
    }

    fn rotation(&mut self) -> Quat {
        let (v, w) = (self.vector(1.0), self.between(0.1, 1.0));
        let length = (v.length_squared() + w * w).sqrt();
        Quat::from_xyzw(v.x / length, v.y / length, v.z / length, w / length)
    }
}

fn settings(count: usize) -> Vec<Setting> {
    let (mesh, field) = hills(count);
    vec![boxes(count), mesh, field]
}

fn scene(bodies: Vec<Body>) -> Scene {
    Scene { settings: WorldSettings::default(), dt: 1.0 / 60.0, steps: 1, bodies, script: Vec::new() }
}

fn fixed(definition: BodyDefinition, shape: Shape) -> Body {
    Body { is_world: false, definition, shapes: vec![ShapeDefinition::new(shape)] }
}

/// A thousand boxes of up to two metres, turned every way, in a cube of 50 m.
fn boxes(count: usize) -> Setting {
    let mut random = Random(7);
    let bodies = (0..1000).map(|_| {
        let half = Vec3::new(random.between(0.3, 1.0), random.between(0.3, 1.0), random.between(0.3, 1.0));
        let definition = BodyDefinition::fixed().at(random.vector(25.0)).rotated(random.rotation());
        fixed(definition, Shape::cuboid(half).expect("a box"))
    });
    let scene = scene(bodies.collect());
    // From outside, so that nothing starts inside a box: engines say different things of that.
    let lines = (0..count).map(|_| {
        let to = random.vector(20.0);
        let from = random.vector(1.0).normalize_or_zero() * 60.0;
        (from, to - from)
    });
    Setting { name: "1,000 boxes", scene, lines: lines.collect() }
}

/// Hills of 100 × 100 m in 317 × 317 cells of two triangles, 200,978: as a mesh and as a height field, asked the same.
fn hills(count: usize) -> (Setting, Setting) {
    const CELLS: usize = 317;
    let mut random = Random(11);
    let waves: Vec<(Real, Real, Real)> = (0..12)
        .map(|k| {
            (
                random.between(-0.1, 0.1) * (1 + k) as Real,
                random.between(-0.1, 0.1) * (1 + k) as Real,
                3.0 / (1 + k) as Real,
            )
        })
        .collect();
    let height = |x: Real, z: Real| waves.iter().map(|(a, b, h)| h * (a * x + b * z).sin()).sum::<Real>();
    let corner = Vec3::new(-50.0, 0.0, -50.0);
    let cell = 100.0 / CELLS as Real;
    let place = |k: usize| k as Real * cell - 50.0;
    let points = (0..(CELLS + 1) * (CELLS + 1)).map(|k| (place(k % (CELLS + 1)), place(k / (CELLS + 1))));
    let heights: Vec<Real> = points.map(|(x, z)| height(x, z)).collect();
    let top = heights.iter().fold(0.0_f32, |top, y| top.max(*y));
    let field = Shape::height_field(heights, CELLS + 1, [cell, cell]).expect("a field");
    let (vertices, triangles) = field.triangulate(0);
    let mesh = Shape::mesh(vertices, triangles).expect("a mesh");
    let lines = (0..count).map(|_| {
        // Steep and flat ones, all from above.
        let from = Vec3::new(random.between(-45.0, 45.0), top + 1.0, random.between(-45.0, 45.0));
        let way = Vec3::new(random.between(-40.0, 40.0), -2.0 * top, random.between(-40.0, 40.0));
        (from, way)
    });
    let lines: Vec<Line> = lines.collect();
    let setting = |name, shape| {
        let body = fixed(BodyDefinition::fixed().at(corner), shape);
        Setting { name, scene: scene(vec![body]), lines: lines.clone() }
    };
    (setting("200k-triangle mesh", mesh), setting("200k-triangle field", field))
}

/// The fastest peer's rate for the same question.
fn best_peer(rows: &[Row], row: &Row) -> Option<f64> {
    let same = |other: &&Row| other.setting == row.setting && other.question == row.question;
    let peers = rows.iter().filter(same).filter(|other| other.kind != Kind::Arbiter);
    peers.map(Row::per_second).reduce(f64::max)
}

fn table(rows: &[Row]) -> String {
    use std::fmt::Write;
    let mut text = format!(
        "{:<20} {:<12} {:<10} {:>12} {:>8} {:>9} {:>14} {:>6}\n",
        "world", "question", "engine", "per second", "ns each", "hits", "Σ fractions", "ratio"
    );
    for row in rows {
        let ratio = best_peer(rows, row).filter(|_| row.kind == Kind::Arbiter);
        let _ = writeln!(
            text,
            "{:<20} {:<12} {:<10} {:>12.0} {:>8.0} {:>9} {:>14.3} {:>6}",
            row.setting,
            row.question.name(),
            row.kind.name(),
            row.per_second(),
            1e9 / row.per_second(),
            row.hits,
            row.fractions,
            ratio.map_or_else(String::new, |peer| format!("{:.2}", row.per_second() / peer)),
        );
    }
    text
}

fn json(rows: &[Row]) -> serde_json::Value {
    let row = |row: &Row| {
        serde_json::json!({
            "world": row.setting,
            "question": row.question.name(),
            "engine": row.kind.name(),
            "per_second": row.per_second(),
            "questions": row.count,
            "hits": row.hits,
            "sum_of_fractions": row.fractions,
        })
    };
    rows.iter().map(row).collect()
}
