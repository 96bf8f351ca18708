//! The replay page from end to end: recordings of known motion are written, and a browser checks what they show.
//!
//! The motion is given by formulas, so that the browser test can compare what the page decodes with what was recorded.
//! The browser part needs Node, `playwright-core` and Chromium; where one is missing it says so and is left out, unless
//! `ARBITER3D_REQUIRE_BROWSER` is set. `tests/browser/README.md` says how to install them.

use arbiter3d_cli::replay::{
    ArbiterSample, BodyInfo, BodyKind, BodySample, BodyState, ContactDetail, ContactSample, Frame, Geometry,
    PageStatistics, Recording, RecordingOptions, ShapeInstance,
};
use std::path::{Path, PathBuf};
use std::process::Command;

const IDENTITY: [f32; 4] = [0.0, 0.0, 0.0, 1.0];
const GRAVITY: f32 = 9.81;

/// A number in [0, 1) that only depends on its seeds: data that compresses no better than measured motion.
fn random(seeds: [usize; 2]) -> f32 {
    let mut bits = (seeds[0] as u32).wrapping_mul(0x9e37_79b9) ^ (seeds[1] as u32).wrapping_mul(0x85eb_ca6b);
    for _ in 0..2 {
        bits = (bits ^ (bits >> 15)).wrapping_mul(0x2c1b_3c6d);
    }
    (bits >> 8) as f32 / 16_777_216.0
}

/// Bodies that fall onto a floor from a grid, each from its own height and with its own spin.
struct Rain {
    columns: usize,
    count: usize,
    spacing: f32,
    /// Height of a body's centre when it rests.
    rest_height: f32,
    /// Speed after a bounce by the speed before; zero ends the motion.
    bounce: f32,
    /// Largest horizontal speed.
    drift: f32,
    /// Largest error of a moving body's position, from frame to frame.
    jitter: f32,
}

impl Rain {
    fn floor(recording: &mut Recording) {
        let geometry = recording.add_geometry(Geometry::Cuboid { half_extents: [60.0, 1.0, 60.0] }).unwrap();
        let body = recording.add_body(BodyInfo { kind: BodyKind::Static, name: Some("floor".into()) });
        recording.add_shape(ShapeInstance { body, geometry, position: [0.0, -1.0, 0.0], rotation: IDENTITY }).unwrap();
    }

    /// Body 0 is the floor, the drops follow.
    fn samples(&self, time: f32) -> Vec<BodySample> {
        let floor = BodySample { state: BodyState::Asleep, ..BodySample::at([0.0; 3], IDENTITY) };
        std::iter::once(floor).chain((0..self.count).map(|drop| self.sample(drop, time))).collect()
    }

    fn sample(&self, drop: usize, time: f32) -> BodySample {
        let half = (self.columns - 1) as f32 / 2.0;
        let (row, column) = (drop / self.columns % self.columns, drop % self.columns);
        let layer = drop / (self.columns * self.columns);
        let fall = 1.0 + random([drop, 0]) * 3.0 + layer as f32 * 1.2 * self.spacing;
        let landing = (2.0 * fall / GRAVITY).sqrt();
        let (height, moving) = if time < landing {
            (fall - 0.5 * GRAVITY * time * time, time)
        } else if self.bounce > 0.0 {
            (self.bounced_height(landing, time), time)
        } else {
            (0.0, landing)
        };
        let angle = (0.2 + 2.0 * random([drop, 1])) * (moving - landing);
        let (sine, cosine) = (libm::sinf(angle), libm::cosf(angle));
        let tilt = 6.0 * random([drop, 2]);
        let noise = |axis: usize| {
            let frame = (time * 1000.0) as usize;
            self.jitter * (random([drop * 3 + axis, frame]) - 0.5) + self.drift * moving * (random([drop, axis]) - 0.5)
        };
        let position = [
            (column as f32 - half) * self.spacing + noise(3),
            self.rest_height + height,
            (row as f32 - half) * self.spacing + noise(4),
        ];
        let asleep = moving + 0.5 < time;
        BodySample {
            position,
            rotation: [libm::cosf(tilt) * sine, 0.0, libm::sinf(tilt) * sine, cosine],
            state: if asleep { BodyState::Asleep } else { BodyState::Awake },
            island: drop as u32 / 4 + 17,
        }
    }

    /// Height above the rest at a time after the landing: parabola after parabola, each one lower.
    fn bounced_height(&self, landing: f32, time: f32) -> f32 {
        let mut speed = self.bounce * GRAVITY * landing;
        let mut left = time - landing;
        while speed > 0.1 && left > 2.0 * speed / GRAVITY {
            left -= 2.0 * speed / GRAVITY;
            speed *= self.bounce;
        }
        (speed * left - 0.5 * GRAVITY * left * left).max(0.0)
    }
}

/// An arbiter with four contacts around a point; `impulse` is the first contact's, the others' are 0.25, 0.5 and 0.75 N·s
/// more.
fn arbiter(key: (u64, u64), bodies: (u32, u32), point: [f32; 3], impulse: f32) -> (ArbiterSample, [ContactSample; 4]) {
    let turn = 6.0 * random([key.1 as usize, 9]);
    let (x, z) = (0.5 * libm::cosf(turn), 0.5 * libm::sinf(turn));
    let corners = [[x, z], [-z, x], [-x, -z], [z, -x]];
    let contact = |corner: usize| ContactSample {
        point: [point[0] + corners[corner][0], point[1], point[2] + corners[corner][1]],
        normal: [0.0, 1.0, 0.0],
        normal_impulse: impulse + 0.25 * corner as f32,
    };
    (ArbiterSample { key, bodies, friction: 0.6, contact_count: 4 }, [0, 1, 2, 3].map(contact))
}

fn push(recording: &mut Recording, step: usize, bodies: &[BodySample], pairs: &[(ArbiterSample, [ContactSample; 4])]) {
    let arbiters: Vec<_> = pairs.iter().map(|(arbiter, _)| *arbiter).collect();
    let contacts: Vec<_> = pairs.iter().flat_map(|(_, contacts)| *contacts).collect();
    let detail = ContactDetail { arbiters: &arbiters, contacts: &contacts };
    let frame = Frame {
        step: step as u64,
        bodies,
        arbiter_count: arbiters.len(),
        contact_count: contacts.len(),
        detail: recording.wants_detail().then_some(detail),
    };
    recording.push_frame(&frame).unwrap();
}

fn octahedron(radius: f32) -> Geometry {
    let vertices = [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]]
        .map(|vertex: [i8; 3]| vertex.map(|coordinate| f32::from(coordinate) * radius));
    let triangles = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
    Geometry::Hull { vertices: vertices.into(), triangles: triangles.into() }
}

/// A bowl of triangles around the floor.
fn hills() -> Geometry {
    let (side, cell) = (33_u32, 2.5_f32);
    let coordinate = |i: u32| (i as f32 - (side - 1) as f32 / 2.0) * cell;
    let height =
        |x: f32, z: f32| (0.006 * (x * x + z * z) - 2.2 + 0.5 * libm::sinf(0.5 * x) * libm::cosf(0.4 * z)).min(9.0);
    let vertices = (0..side * side)
        .map(|i| (coordinate(i % side), coordinate(i / side)))
        .map(|(x, z)| [x, height(x, z), z])
        .collect();
    let corner = |i: u32| i / (side - 1) * side + i % (side - 1);
    let triangles = (0..(side - 1) * (side - 1))
        .flat_map(|i| {
            [[corner(i), corner(i) + side, corner(i) + 1], [corner(i) + 1, corner(i) + side, corner(i) + side + 1]]
        })
        .collect();
    Geometry::Mesh { vertices, triangles }
}

/// Five kinds of shapes in turn; body 0 is the floor. Names every hundredth.
fn add_mixed_bodies(recording: &mut Recording, count: usize) {
    let kinds: [Vec<(Geometry, [f32; 3])>; 5] = [
        vec![(Geometry::Cuboid { half_extents: [0.5; 3] }, [0.0; 3])],
        vec![(Geometry::Sphere { radius: 0.5 }, [0.0; 3])],
        vec![(Geometry::Capsule { half_length: 0.25, radius: 0.25 }, [0.0; 3])],
        vec![(octahedron(0.6), [0.0; 3])],
        vec![
            (Geometry::Cuboid { half_extents: [0.5, 0.15, 0.15] }, [0.0, -0.35, 0.0]),
            (Geometry::Cuboid { half_extents: [0.15, 0.35, 0.15] }, [0.0, 0.15, 0.0]),
        ],
    ];
    for drop in 0..count {
        let name = (drop % 100 == 0).then(|| format!("marked {drop}"));
        let body = recording.add_body(BodyInfo { kind: BodyKind::Dynamic, name });
        for (geometry, position) in &kinds[drop % kinds.len()] {
            let geometry = recording.add_geometry(geometry.clone()).unwrap();
            recording.add_shape(ShapeInstance { body, geometry, position: *position, rotation: IDENTITY }).unwrap();
        }
    }
}

/// 500 bodies of all kinds for 3 s; the last one enters only after 1 s. Gives the page and what it must show.
fn write_mixed(path: &Path) -> serde_json::Value {
    let mut recording = Recording::new(RecordingOptions::new("rain <of> \"mixed\" shapes & co", 1.0 / 30.0));
    Rain::floor(&mut recording);
    let rain = Rain { columns: 23, count: 500, spacing: 1.5, rest_height: 0.5, bounce: 0.0, drift: 0.0, jitter: 0.0 };
    add_mixed_bodies(&mut recording, rain.count);
    let geometry = recording.add_geometry(hills()).unwrap();
    let body = recording.add_body(BodyInfo { kind: BodyKind::Static, name: Some("hills".into()) });
    recording.add_shape(ShapeInstance { body, geometry, position: [0.0; 3], rotation: IDENTITY }).unwrap();
    let mut expected = Vec::new();
    for step in 0..90 {
        let time = step as f32 / 30.0;
        let mut bodies = rain.samples(time);
        if step < 30 {
            bodies[500].state = BodyState::Absent;
        }
        bodies.push(BodySample { state: BodyState::Asleep, ..BodySample::at([0.0; 3], IDENTITY) });
        let resting = (1..501).filter(|&body| bodies[body].position[1] <= 0.5);
        let pairs: Vec<_> = resting
            .map(|body| {
                let [x, _, z] = bodies[body].position;
                arbiter((u64::MAX - 1, body as u64 + 1), (0, body as u32), [x, 0.0, z], 0.5)
            })
            .collect();
        push(&mut recording, step, &bodies, &pairs);
        for body in [0, 1, 250, 499, 500] {
            let BodySample { position, rotation, state, .. } = bodies[body];
            let state = state as u8;
            expected.push(serde_json::json!({
                "frame": step, "body": body, "position": position, "rotation": rotation, "state": state,
            }));
        }
    }
    let statistics = recording.write_html(path).unwrap();
    assert_eq!((statistics.frames, statistics.detail_frames), (90, 90));
    assert_eq!(statistics.notes, Vec::<String>::new());
    serde_json::json!({
        "title": "rain <of> \"mixed\" shapes & co", "poses": expected, "bodies": 502,
        "resting": { "body": 261, "key": format!("{}:262", u64::MAX - 1), "other": "floor",
            "impulses": "0.5 · 0.75 · 1 · 1.25", "friction": "0.6" },
    })
}

/// 27 balls in a closed box that turns with them: one frame a degree.
fn write_drum(path: &Path) -> serde_json::Value {
    let mut recording = Recording::new(RecordingOptions::new("drum", 1.0 / 30.0));
    let drum = recording.add_body(BodyInfo { kind: BodyKind::Kinematic, name: Some("drum".into()) });
    for wall in 0..6 {
        let (mut half_extents, mut position) = ([3.0; 3], [0.0; 3]);
        half_extents[wall / 2] = 0.1;
        position[wall / 2] = if wall % 2 == 0 { 3.1 } else { -3.1 };
        let geometry = recording.add_geometry(Geometry::Cuboid { half_extents }).unwrap();
        recording.add_shape(ShapeInstance { body: drum, geometry, position, rotation: IDENTITY }).unwrap();
    }
    let geometry = recording.add_geometry(Geometry::Sphere { radius: 0.7 }).unwrap();
    for _ in 0..27 {
        let body = recording.add_body(BodyInfo { kind: BodyKind::Dynamic, name: None });
        recording.add_shape(ShapeInstance { body, geometry, position: [0.0; 3], rotation: IDENTITY }).unwrap();
    }
    for step in 0..30 {
        let half = (step as f32).to_radians() / 2.0;
        let (sine, cosine) = (libm::sinf(2.0 * half), libm::cosf(2.0 * half));
        let rotation = [0.0, 0.0, libm::sinf(half), libm::cosf(half)];
        let ball = |i: usize| {
            let [x, y, z] = [i % 3, i / 3 % 3, i / 9].map(|cell| 2.0 * (cell as f32 - 1.0));
            BodySample::at([cosine * x - sine * y, sine * x + cosine * y, z], rotation)
        };
        let bodies: Vec<_> = std::iter::once(BodySample::at([0.0; 3], rotation)).chain((0..27).map(ball)).collect();
        push(&mut recording, step, &bodies, &[]);
    }
    recording.write_html(path).unwrap();
    serde_json::json!({ "container": "drum" })
}

/// As many boxes and contacts as the colosseum, 60 frames a second; with bounces, all of them move all the time.
fn write_storm(path: &Path, frames: usize, bounce: f32) -> PageStatistics {
    let mut recording = Recording::new(RecordingOptions::new("storm of 8,818 boxes", 1.0 / 60.0));
    Rain::floor(&mut recording);
    let rain = Rain { columns: 30, count: 8817, spacing: 2.0, rest_height: 0.5, bounce, drift: 2.0, jitter: 2e-4 };
    let geometry = recording.add_geometry(Geometry::Cuboid { half_extents: [0.5; 3] }).unwrap();
    for _ in 0..rain.count {
        let body = recording.add_body(BodyInfo { kind: BodyKind::Dynamic, name: None });
        recording.add_shape(ShapeInstance { body, geometry, position: [0.0; 3], rotation: IDENTITY }).unwrap();
    }
    for step in 0..frames {
        let bodies = rain.samples(step as f32 / 60.0);
        let pairs: Vec<_> = (0..rain.count * 4 / 3)
            .map(|pair| {
                let (body, other) = (pair % rain.count + 1, pair % rain.count * (pair / rain.count));
                let mut point = bodies[body].position;
                point[1] -= 0.5;
                let (arbiter, mut contacts) =
                    arbiter((other as u64 + 1, body as u64 + 1), (other as u32, body as u32), point, 0.0);
                for (corner, contact) in contacts.iter_mut().enumerate() {
                    contact.normal_impulse = random([pair * 4 + corner, step]);
                    contact.normal[0] = 0.05 * random([pair, step]);
                }
                (arbiter, contacts)
            })
            .collect();
        push(&mut recording, step, &bodies, &pairs);
    }
    recording.write_html(path).unwrap()
}

fn temporary(name: &str) -> PathBuf {
    let directory = PathBuf::from(env!("CARGO_TARGET_TMPDIR"));
    std::fs::create_dir_all(&directory).unwrap();
    directory.join(name)
}

/// Runs the browser test on pages; false if this machine has no browser for it.
fn browse(arguments: &[&Path]) -> bool {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/browser/replay.test.mjs");
    let required = std::env::var_os("ARBITER3D_REQUIRE_BROWSER").is_some();
    let output = match Command::new("node").arg(script).args(arguments).output() {
        Ok(output) => output,
        Err(error) if !required => {
            eprintln!("browser test left out: cannot run node ({error})");
            return false;
        }
        Err(error) => panic!("cannot run node ({error}), and ARBITER3D_REQUIRE_BROWSER is set"),
    };
    let report = format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    println!("{report}");
    // The script ends with 77 when playwright-core or Chromium is missing.
    if output.status.code() == Some(77) && !required {
        eprintln!("browser test left out: {report}");
        return false;
    }
    assert!(output.status.success(), "the browser test failed:\n{report}");
    true
}

#[test]
fn the_page_shows_in_a_browser_what_was_recorded() {
    let (page, expected) = (temporary("mixed.html"), temporary("mixed.json"));
    let facts = write_mixed(&page);
    std::fs::write(&expected, facts.to_string()).unwrap();
    browse(&[&page, &expected]);
}

#[test]
fn a_closed_container_does_not_hide_what_is_in_it() {
    let (page, expected) = (temporary("drum.html"), temporary("drum.json"));
    let facts = write_drum(&page);
    std::fs::write(&expected, facts.to_string()).unwrap();
    browse(&[&page, &expected]);
}

/// The promise for the largest scene: ten seconds of a colosseum in less than 25 MB, and the page says what it left out.
#[test]
fn ten_seconds_of_a_colosseum_fit_into_25_megabytes() {
    let page = temporary("storm.html");
    let statistics = write_storm(&page, 600, 0.7);
    println!("{statistics:?}");
    assert_eq!(statistics.frames, 600, "every frame's poses are there");
    assert!(statistics.bytes < 25_000_000, "{statistics:?}");
    assert!(statistics.detail_frames >= 5, "{statistics:?}");
    assert!(statistics.notes[0].starts_with("Arbiters and contacts are kept every"), "{:?}", statistics.notes);
    assert_eq!(std::fs::metadata(&page).unwrap().len(), statistics.bytes as u64);
}
