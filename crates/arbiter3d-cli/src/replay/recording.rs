//! What a recording is fed with, and the buffer that keeps it compressed while the run goes on.
//!
//! Memory stays near the size of the final page: frames are coded as they come, about a million poses to a chunk, and
//! nothing else of them is kept. The unit of length does not matter: positions are rounded to a power of two below
//! 1/2048 of the smallest moving shape's radius (0.24 mm for a cube of 1 m), contact points to four times that.

use super::codec::{CodedBody, PoseEncoder, QuantisedPose, quantise_pose};
use super::detail::{DetailSample, DetailSampler};
use serde::Serialize;
use std::collections::{BTreeMap, HashMap};
use std::io;

/// Poses in a chunk: the price of a jump of the slider is to decode one chunk, about 30 ms for this many.
const POSES_A_CHUNK: usize = 500_000;

/// Frames in a chunk, at most and at least.
const CHUNK_FRAMES: (usize, usize) = (8, 120);

/// The viewer itself: script, style and three.js, in bytes of the page.
const VIEWER_BYTES: usize = 700_000;

/// Contact points are drawn as dots: they are rounded this many times coarser than positions.
const DETAIL_COARSENESS: f64 = 4.0;

/// Why a frame or a part of the scene was refused. Nothing has been recorded of it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecordingError {
    /// A frame with more or fewer bodies than were added.
    #[error(
        "the frame has {found} bodies, but {expected} were added: give every body in every frame, gone ones as Absent"
    )]
    BodyCount {
        /// Bodies in the frame.
        found: usize,
        /// Bodies added so far.
        expected: usize,
    },
    /// An index that names nothing.
    #[error("{what} {index} does not exist, there are {count}: add it first")]
    NoSuch {
        /// "body", "geometry" or "vertex".
        what: &'static str,
        /// The index given.
        index: u32,
        /// How many there are.
        count: usize,
    },
    /// A NaN or an infinity.
    #[error("{what} {index} has a number that is not finite")]
    NotFinite {
        /// "body", "arbiter", "contact", "geometry" or "shape".
        what: &'static str,
        /// Which one.
        index: usize,
    },
    /// The arbiters' contact counts do not add up to the number of contacts.
    #[error(
        "the arbiters count {counted} contacts in all, but {found} were given: list each arbiter's contacts in order"
    )]
    ContactCount {
        /// Sum over the arbiters.
        counted: usize,
        /// Contacts in the list.
        found: usize,
    },
    /// The compressor failed.
    #[error("cannot compress the frame: {0}")]
    Compress(#[from] io::Error),
}

/// What a page is called, how much time a frame is, and how large the page may get.
///
/// ```
/// use arbiter3d_cli::replay::RecordingOptions;
/// let options = RecordingOptions::new("pyramid", 1.0 / 60.0);
/// assert_eq!(options.page_target_bytes, 24_000_000);
/// ```
#[derive(Clone, Debug)]
pub struct RecordingOptions {
    /// Title of the page: the scene's name.
    pub title: String,
    /// Seconds from one frame to the next, above zero.
    pub frame_seconds: f64,
    /// Contact details are sampled so densely that the page stays below this size, as long as the poses leave room for
    /// any. Default 24 MB.
    pub page_target_bytes: usize,
    /// Later poses are thinned, to every second frame, every fourth, …, so that the page stays below this size.
    /// Default 96 MB.
    pub page_limit_bytes: usize,
}

impl RecordingOptions {
    /// The default sizes.
    #[must_use]
    pub fn new(title: impl Into<String>, frame_seconds: f64) -> Self {
        Self { title: title.into(), frame_seconds, page_target_bytes: 24_000_000, page_limit_bytes: 96_000_000 }
    }
}

/// Geometry in a shape's own frame, metres.
///
/// ```
/// use arbiter3d_cli::replay::Geometry;
/// let crate_geometry = Geometry::Cuboid { half_extents: [0.5, 0.5, 0.5] };
/// # let _ = crate_geometry;
/// ```
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Geometry {
    /// A ball about the origin.
    Sphere {
        /// Its radius.
        radius: f32,
    },
    /// A segment on the y axis with a radius.
    Capsule {
        /// From the origin to each end of the segment.
        half_length: f32,
        /// Distance from the segment to the surface.
        radius: f32,
    },
    /// A box about the origin.
    Cuboid {
        /// Half its edges.
        half_extents: [f32; 3],
    },
    /// A convex polyhedron.
    Hull {
        /// Corners.
        vertices: Vec<[f32; 3]>,
        /// Corners of each triangle, counter-clockwise seen from outside.
        triangles: Vec<[u32; 3]>,
    },
    /// A triangle mesh, shown from both sides.
    Mesh {
        /// Corners.
        vertices: Vec<[f32; 3]>,
        /// Corners of each triangle.
        triangles: Vec<[u32; 3]>,
    },
}

impl Geometry {
    /// Every number it has, bit for bit: equal geometry is kept once.
    fn bits(&self) -> Vec<u32> {
        let floats = |kind: u32, numbers: &[f32]| {
            std::iter::once(kind).chain(numbers.iter().map(|number| number.to_bits())).collect::<Vec<_>>()
        };
        match self {
            Self::Sphere { radius } => floats(0, &[*radius]),
            Self::Capsule { half_length, radius } => floats(1, &[*half_length, *radius]),
            Self::Cuboid { half_extents } => floats(2, half_extents),
            Self::Hull { vertices, triangles } | Self::Mesh { vertices, triangles } => {
                let kind = if matches!(self, Self::Hull { .. }) { 3 } else { 4 };
                let mut bits = floats(kind, vertices.as_flattened());
                bits.extend(triangles.as_flattened());
                bits.push(vertices.len() as u32);
                bits
            }
        }
    }

    /// Distance of the farthest point from the origin.
    fn radius(&self) -> f32 {
        let length = |v: &[f32; 3]| (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
        match self {
            Self::Sphere { radius } => *radius,
            Self::Capsule { half_length, radius } => half_length + radius,
            Self::Cuboid { half_extents } => length(half_extents),
            Self::Hull { vertices, .. } | Self::Mesh { vertices, .. } => {
                vertices.iter().map(length).fold(0.0, f32::max)
            }
        }
    }

    fn check(&self, index: usize) -> Result<(), RecordingError> {
        if !self.radius().is_finite() {
            return Err(RecordingError::NotFinite { what: "geometry", index });
        }
        if let Self::Hull { vertices, triangles } | Self::Mesh { vertices, triangles } = self
            && let Some(&index) = triangles.as_flattened().iter().find(|&&index| index as usize >= vertices.len())
        {
            return Err(RecordingError::NoSuch { what: "vertex", index, count: vertices.len() });
        }
        Ok(())
    }
}

/// How a body moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum BodyKind {
    /// Never moves.
    Static,
    /// Moves as it is told to.
    Kinematic,
    /// Moves as forces tell it to.
    Dynamic,
}

/// What stays the same about a body.
///
/// ```
/// use arbiter3d_cli::replay::{BodyInfo, BodyKind};
/// let wheel = BodyInfo { kind: BodyKind::Dynamic, name: Some("front wheel".into()) };
/// # let _ = wheel;
/// ```
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BodyInfo {
    /// How it moves.
    pub kind: BodyKind,
    /// Shown in the side panel instead of its number.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
}

/// A geometry that sits on a body.
///
/// ```
/// use arbiter3d_cli::replay::ShapeInstance;
/// let shape = ShapeInstance { body: 0, geometry: 0, position: [0.0; 3], rotation: [0.0, 0.0, 0.0, 1.0] };
/// # let _ = shape;
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ShapeInstance {
    /// Index of the body.
    pub body: u32,
    /// Index of the geometry.
    pub geometry: u32,
    /// Where the geometry's origin is in the body's frame.
    pub position: [f32; 3],
    /// How the geometry is turned in the body's frame: quaternion x, y, z, w.
    pub rotation: [f32; 4],
}

/// Whether a body is there and awake.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BodyState {
    /// Not in the world at this time: its pose is ignored and it is not drawn.
    Absent,
    /// In the world, not simulated until something wakes it.
    Asleep,
    /// In the world and simulated. Static bodies count as awake or asleep as the caller likes.
    Awake,
}

/// One body in one frame.
///
/// ```
/// use arbiter3d_cli::replay::{BodySample, BodyState};
/// let mut sample = BodySample::at([0.0, 2.0, 0.0], [0.0, 0.0, 0.0, 1.0]);
/// sample.state = BodyState::Asleep;
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodySample {
    /// Origin of the body's frame in the world.
    pub position: [f32; 3],
    /// Turn from the body's frame to the world's: unit quaternion x, y, z, w.
    pub rotation: [f32; 4],
    /// Whether it is there and awake.
    pub state: BodyState,
    /// Equal numbers mean the same island, in this frame; [`BodySample::NO_ISLAND`] for none. The numbers themselves may
    /// change from frame to frame: colours follow the island's first body.
    pub island: u32,
}

impl BodySample {
    /// The island of a body that is in none.
    pub const NO_ISLAND: u32 = u32::MAX;

    /// An awake body without an island.
    #[must_use]
    pub fn at(position: [f32; 3], rotation: [f32; 4]) -> Self {
        Self { position, rotation, state: BodyState::Awake, island: Self::NO_ISLAND }
    }

    fn is_finite(&self) -> bool {
        self.position.iter().chain(&self.rotation).all(|number| number.is_finite())
    }
}

/// One contact of an arbiter, in the world's frame.
///
/// ```
/// use arbiter3d_cli::replay::ContactSample;
/// let contact = ContactSample { point: [0.0; 3], normal: [0.0, 1.0, 0.0], normal_impulse: 0.16 };
/// # let _ = contact;
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactSample {
    /// Where it is, metres.
    pub point: [f32; 3],
    /// Unit vector from body 1 to body 2.
    pub normal: [f32; 3],
    /// Impulse along the normal in the last step, N·s.
    pub normal_impulse: f32,
}

/// One arbiter.
///
/// ```
/// use arbiter3d_cli::replay::ArbiterSample;
/// let arbiter = ArbiterSample { key: (4, 9), bodies: (0, 3), friction: 0.6, contact_count: 4 };
/// # let _ = arbiter;
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArbiterSample {
    /// Key 1 and key 2.
    pub key: (u64, u64),
    /// Indices of body 1 and body 2.
    pub bodies: (u32, u32),
    /// Its friction, as users may have edited it.
    pub friction: f32,
    /// How many of the contacts are its own: they follow those of the arbiter before.
    pub contact_count: u8,
}

/// Arbiters and contacts of a frame.
///
/// ```
/// use arbiter3d_cli::replay::{ArbiterSample, ContactDetail, ContactSample};
/// let detail = ContactDetail {
///     arbiters: &[ArbiterSample { key: (1, 2), bodies: (0, 1), friction: 0.5, contact_count: 1 }],
///     contacts: &[ContactSample { point: [0.0; 3], normal: [0.0, 1.0, 0.0], normal_impulse: 0.2 }],
/// };
/// # let _ = detail;
/// ```
#[derive(Clone, Copy, Debug)]
pub struct ContactDetail<'a> {
    /// In any order; sorted by key they take the fewest bytes.
    pub arbiters: &'a [ArbiterSample],
    /// The contacts of the first arbiter, then those of the second, …
    pub contacts: &'a [ContactSample],
}

/// The world after a step.
///
/// ```
/// use arbiter3d_cli::replay::{BodySample, Frame};
/// let bodies = [BodySample::at([0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0])];
/// let frame = Frame { step: 1, bodies: &bodies, arbiter_count: 0, contact_count: 0, detail: None };
/// # let _ = frame;
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Frame<'a> {
    /// Number of the step, for display.
    pub step: u64,
    /// Every body that was added, in that order.
    pub bodies: &'a [BodySample],
    /// Arbiters in the world.
    pub arbiter_count: usize,
    /// Contacts in the world.
    pub contact_count: usize,
    /// Needed only when [`Recording::wants_detail`] says so; else it is ignored.
    pub detail: Option<ContactDetail<'a>>,
}

/// Compressed frames that belong together.
#[derive(Debug)]
pub(super) struct Chunk {
    pub first_frame: usize,
    pub frames: usize,
    pub bytes: Vec<u8>,
}

/// From this frame on, only every `stride`-th frame was kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub(super) struct Thinning {
    pub frame: usize,
    pub stride: usize,
}

/// Numbers of every frame that the page keeps in the clear.
#[derive(Default, Serialize)]
pub(super) struct FrameTable {
    pub steps: Vec<u64>,
    pub times: Vec<f64>,
    pub arbiters: Vec<usize>,
    pub contacts: Vec<usize>,
}

/// The buffer of a run: scene first, then a frame after each step, then [`Recording::write_html`].
///
/// ```
/// use arbiter3d_cli::replay::*;
/// let mut recording = Recording::new(RecordingOptions::new("one falling ball", 1.0 / 60.0));
/// let ball = recording.add_geometry(Geometry::Sphere { radius: 0.5 })?;
/// let body = recording.add_body(BodyInfo { kind: BodyKind::Dynamic, name: None });
/// recording.add_shape(ShapeInstance { body, geometry: ball, position: [0.0; 3], rotation: [0.0, 0.0, 0.0, 1.0] })?;
/// for step in 0..60 {
///     let time = step as f32 / 60.0;
///     let bodies = [BodySample::at([0.0, 9.0 - 4.905 * time * time, 0.0], [0.0, 0.0, 0.0, 1.0])];
///     recording.push_frame(&Frame { step, bodies: &bodies, arbiter_count: 0, contact_count: 0, detail: None })?;
/// }
/// # let path = std::env::temp_dir().join(format!("arbiter3d-one-falling-ball-{}.html", std::process::id()));
/// let statistics = recording.write_html(&path)?;
/// assert_eq!(statistics.frames, 60);
/// # std::fs::remove_file(path)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Recording {
    pub(super) options: RecordingOptions,
    pub(super) geometries: Vec<Geometry>,
    pub(super) shapes: Vec<ShapeInstance>,
    pub(super) bodies: Vec<BodyInfo>,
    pub(super) table: FrameTable,
    pub(super) chunks: Vec<Chunk>,
    pub(super) thinning: Vec<Thinning>,
    known_geometry: BTreeMap<Vec<u32>, u32>,
    inverse_step: Option<f64>,
    encoder: PoseEncoder,
    sampler: DetailSampler,
    chunk_bytes: usize,
    pushed: usize,
    coded: Vec<CodedBody>,
    island_names: HashMap<u32, i32>,
    top_speed: f64,
}

impl Recording {
    /// An empty recording.
    #[must_use]
    pub fn new(options: RecordingOptions) -> Self {
        Self {
            options,
            geometries: Vec::new(),
            shapes: Vec::new(),
            bodies: Vec::new(),
            table: FrameTable::default(),
            chunks: Vec::new(),
            thinning: Vec::new(),
            known_geometry: BTreeMap::new(),
            inverse_step: None,
            encoder: PoseEncoder::new(),
            sampler: DetailSampler::new(),
            chunk_bytes: 0,
            pushed: 0,
            coded: Vec::new(),
            island_names: HashMap::new(),
            top_speed: 0.0,
        }
    }

    /// Adds a geometry, or finds the equal one that is there, and gives its index.
    ///
    /// # Errors
    /// A number that is not finite, or a triangle with a vertex that does not exist.
    pub fn add_geometry(&mut self, geometry: Geometry) -> Result<u32, RecordingError> {
        let next = self.geometries.len();
        geometry.check(next)?;
        let index = *self.known_geometry.entry(geometry.bits()).or_insert(next as u32);
        if index as usize == next {
            self.geometries.push(geometry);
        }
        Ok(index)
    }

    /// Adds a body and gives its index. In the frames recorded before, it counts as absent.
    pub fn add_body(&mut self, body: BodyInfo) -> u32 {
        self.bodies.push(body);
        (self.bodies.len() - 1) as u32
    }

    /// Puts a geometry on a body.
    ///
    /// # Errors
    /// An unknown body or geometry, or a number that is not finite.
    pub fn add_shape(&mut self, shape: ShapeInstance) -> Result<(), RecordingError> {
        check_index("body", shape.body, self.bodies.len())?;
        check_index("geometry", shape.geometry, self.geometries.len())?;
        if !shape.position.iter().chain(&shape.rotation).all(|number| number.is_finite()) {
            return Err(RecordingError::NotFinite { what: "shape", index: self.shapes.len() });
        }
        self.shapes.push(shape);
        Ok(())
    }

    /// Whether the next frame's arbiters and contacts will be kept: gathering them can be spared otherwise.
    #[must_use]
    pub fn wants_detail(&self) -> bool {
        self.keeps_next_frame() && self.sampler.wants(self.frames())
    }

    /// Frames kept so far.
    #[must_use]
    pub fn frames(&self) -> usize {
        self.table.steps.len()
    }

    /// Records a frame, [`RecordingOptions::frame_seconds`] after the one before; the first one is at time 0.
    ///
    /// # Errors
    /// The frame does not fit the bodies added, has numbers that are not finite, or its contacts do not add up. It is
    /// then not recorded, and the recording can go on.
    pub fn push_frame(&mut self, frame: &Frame) -> Result<(), RecordingError> {
        self.check_frame(frame)?;
        if self.keeps_next_frame() {
            let index = self.frames();
            self.push_poses(frame)?;
            if let Some(detail) = frame.detail.as_ref().filter(|_| self.sampler.wants(index)) {
                self.sampler.push(index, detail, self.inverse_step() / DETAIL_COARSENESS)?;
                self.sampler.shrink_to(self.detail_limit());
            }
            self.table.steps.push(frame.step);
            self.table.times.push(self.pushed as f64 * self.options.frame_seconds);
            self.table.arbiters.push(frame.arbiter_count);
            self.table.contacts.push(frame.contact_count);
            self.close_full_chunk()?;
        }
        self.pushed += 1;
        Ok(())
    }

    /// Closes the open chunk, so that everything recorded so far is in `chunks` and in the samples.
    pub(super) fn flush(&mut self) -> io::Result<()> {
        if self.encoder.frames() > 0 {
            let frames = self.encoder.frames();
            let bytes = self.encoder.finish()?;
            self.chunk_bytes += bytes.len();
            self.chunks.push(Chunk { first_frame: self.frames() - frames, frames, bytes });
        }
        self.sampler.shrink_to(self.detail_limit());
        Ok(())
    }

    pub(super) fn detail_samples(&self) -> &[DetailSample] {
        self.sampler.samples()
    }

    pub(super) fn detail_stride(&self) -> usize {
        self.sampler.stride()
    }

    /// The speed at which colours by speed end: twice the root mean square of the fastest frame, so that a single stray
    /// body does not darken all others.
    pub(super) fn top_speed(&self) -> f64 {
        if self.top_speed.is_finite() && self.top_speed > 0.0 { self.top_speed } else { 1.0 }
    }

    /// Metres of a step of a coded position, and of a coded contact point.
    pub(super) fn steps(&self) -> (f64, f64) {
        let step = 1.0 / self.inverse_step();
        (step, step * DETAIL_COARSENESS)
    }

    fn inverse_step(&self) -> f64 {
        self.inverse_step.unwrap_or(4096.0)
    }

    fn stride(&self) -> usize {
        self.thinning.last().map_or(1, |thinning| thinning.stride)
    }

    fn keeps_next_frame(&self) -> bool {
        self.pushed.is_multiple_of(self.stride())
    }

    fn push_poses(&mut self, frame: &Frame) -> io::Result<()> {
        let shapes = &self.shapes;
        let (bodies, geometries) = (&self.bodies, &self.geometries);
        let inverse_step = *self.inverse_step.get_or_insert_with(|| inverse_step(shapes, bodies, geometries));
        self.coded.resize(frame.bodies.len(), CodedBody { pose: [0; 7], state: 0, island: -1 });
        let stride = self.stride();
        let mut speeds = SpeedAverage::default();
        self.island_names.clear();
        for (index, (sample, coded)) in frame.bodies.iter().zip(&mut self.coded).enumerate() {
            let was_there = coded.state != BodyState::Absent as i32;
            coded.state = sample.state as i32;
            coded.island = match sample.island {
                BodySample::NO_ISLAND => -1,
                island => *self.island_names.entry(island).or_insert(index as i32),
            };
            if sample.state != BodyState::Absent {
                let pose = quantise_pose(&sample.position, &sample.rotation, inverse_step);
                if was_there && bodies[index].kind == BodyKind::Dynamic {
                    speeds.add(&coded.pose, &pose);
                }
                coded.pose = pose;
            }
        }
        let seconds = self.options.frame_seconds * stride as f64;
        self.top_speed = self.top_speed.max(2.0 * speeds.root_mean_square() / (inverse_step * seconds));
        self.encoder.push(&mut self.coded)
    }

    fn close_full_chunk(&mut self) -> io::Result<()> {
        let (least, most) = CHUNK_FRAMES;
        if self.encoder.frames() < (POSES_A_CHUNK / self.bodies.len().max(1)).clamp(least, most) {
            return Ok(());
        }
        self.flush()?;
        // Each doubling of the stride takes half of what is left: thinned frames always fit, however long the run.
        let limit = self.options.page_limit_bytes;
        let mut stride = self.stride();
        while in_page(self.chunk_bytes) > limit - limit / (2 * stride) && stride < 1 << 16 {
            stride *= 2;
        }
        if stride > self.stride() {
            self.thinning.push(Thinning { frame: self.frames(), stride });
        }
        Ok(())
    }

    /// What the poses leave of the target, and an eighth of it at least.
    fn detail_limit(&self) -> usize {
        let target = self.options.page_target_bytes;
        let used = VIEWER_BYTES + in_page(self.chunk_bytes + self.encoder.bytes());
        target.saturating_sub(used).max(target / 8) / 4 * 3
    }

    fn check_frame(&self, frame: &Frame) -> Result<(), RecordingError> {
        let expected = self.bodies.len();
        if frame.bodies.len() != expected {
            return Err(RecordingError::BodyCount { found: frame.bodies.len(), expected });
        }
        let broken = |body: &BodySample| body.state != BodyState::Absent && !body.is_finite();
        if let Some(index) = frame.bodies.iter().position(broken) {
            return Err(RecordingError::NotFinite { what: "body", index });
        }
        frame.detail.as_ref().map_or(Ok(()), |detail| check_detail(detail, expected))
    }
}

/// Mean square of the bodies' moves from one frame to the next, in coded steps.
#[derive(Default)]
struct SpeedAverage {
    squares: f64,
    count: usize,
}

impl SpeedAverage {
    fn add(&mut self, from: &QuantisedPose, to: &QuantisedPose) {
        let squared = |axis: usize| (f64::from(to[axis]) - f64::from(from[axis])).powi(2);
        let move_squared: f64 = (0..3).map(squared).sum();
        if move_squared > 0.0 {
            self.squares += move_squared;
            self.count += 1;
        }
    }

    fn root_mean_square(&self) -> f64 {
        (self.squares / self.count.max(1) as f64).sqrt()
    }
}

/// Size in the page of compressed bytes: base64 needs four characters for three.
pub(super) fn in_page(bytes: usize) -> usize {
    bytes.div_ceil(3) * 4
}

fn check_detail(detail: &ContactDetail, bodies: usize) -> Result<(), RecordingError> {
    for (index, arbiter) in detail.arbiters.iter().enumerate() {
        check_index("body", arbiter.bodies.0, bodies)?;
        check_index("body", arbiter.bodies.1, bodies)?;
        if !arbiter.friction.is_finite() {
            return Err(RecordingError::NotFinite { what: "arbiter", index });
        }
    }
    let numbers = |contact: &ContactSample| {
        contact.point.iter().chain(&contact.normal).all(|number| number.is_finite())
            && contact.normal_impulse.is_finite()
    };
    if let Some(index) = detail.contacts.iter().position(|contact| !numbers(contact)) {
        return Err(RecordingError::NotFinite { what: "contact", index });
    }
    let counted = detail.arbiters.iter().map(|arbiter| usize::from(arbiter.contact_count)).sum();
    let found = detail.contacts.len();
    if counted == found { Ok(()) } else { Err(RecordingError::ContactCount { counted, found }) }
}

fn check_index(what: &'static str, index: u32, count: usize) -> Result<(), RecordingError> {
    if (index as usize) < count { Ok(()) } else { Err(RecordingError::NoSuch { what, index, count }) }
}

/// Steps a unit of length: a power of two, at least 2048 to the radius of the smallest moving geometry.
fn inverse_step(shapes: &[ShapeInstance], bodies: &[BodyInfo], geometries: &[Geometry]) -> f64 {
    let smallest = |moving: bool| {
        shapes
            .iter()
            .filter(|shape| !moving || bodies[shape.body as usize].kind == BodyKind::Dynamic)
            .map(|shape| f64::from(geometries[shape.geometry as usize].radius()))
            .filter(|&radius| radius > 1e-9)
            .reduce(f64::min)
    };
    let wanted = 2048.0 / smallest(true).or_else(|| smallest(false)).unwrap_or(1.0);
    let mut inverse_step = 2.0_f64.powi(-30);
    while inverse_step < wanted {
        inverse_step *= 2.0;
    }
    inverse_step
}

#[cfg(test)]
mod tests {
    use super::*;

    const IDENTITY: [f32; 4] = [0.0, 0.0, 0.0, 1.0];

    fn recording(bodies: usize) -> Recording {
        let mut recording = Recording::new(RecordingOptions::new("test", 0.1));
        for body in 0..bodies as u32 {
            let geometry = recording.add_geometry(Geometry::Cuboid { half_extents: [0.5; 3] }).unwrap();
            recording.add_body(BodyInfo { kind: BodyKind::Dynamic, name: None });
            recording.add_shape(ShapeInstance { body, geometry, position: [0.0; 3], rotation: IDENTITY }).unwrap();
        }
        recording
    }

    fn frame(bodies: &[BodySample]) -> Frame<'_> {
        Frame { step: 0, bodies, arbiter_count: 0, contact_count: 0, detail: None }
    }

    #[test]
    fn equal_geometry_is_kept_once_and_hulls_differ_from_meshes() {
        let mut recording = recording(5);
        assert_eq!(recording.geometries.len(), 1);
        let (vertices, triangles) = (vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], vec![[0, 1, 2]]);
        let hull = Geometry::Hull { vertices: vertices.clone(), triangles: triangles.clone() };
        assert_eq!(recording.add_geometry(hull.clone()).unwrap(), 1);
        assert_eq!(recording.add_geometry(hull).unwrap(), 1);
        assert_eq!(recording.add_geometry(Geometry::Mesh { vertices, triangles }).unwrap(), 2);
    }

    #[test]
    fn bad_input_is_refused_with_a_message_and_not_recorded() {
        let mut recording = recording(2);
        let good = BodySample::at([0.0; 3], IDENTITY);
        let bad = BodySample::at([0.0, f32::NAN, 0.0], IDENTITY);
        let message = |result: Result<(), RecordingError>| result.unwrap_err().to_string();
        assert!(message(recording.push_frame(&frame(&[good]))).contains("has 1 bodies, but 2"));
        assert!(message(recording.push_frame(&frame(&[good, bad]))).contains("body 1 has a number that is not finite"));
        let arbiters = [ArbiterSample { key: (0, 1), bodies: (0, 1), friction: 0.5, contact_count: 2 }];
        let detail = Some(ContactDetail { arbiters: &arbiters, contacts: &[] });
        let both = [good, good];
        let unsound = Frame { detail, ..frame(&both) };
        assert!(message(recording.push_frame(&unsound)).contains("count 2 contacts in all, but 0"));
        let shape = ShapeInstance { body: 7, geometry: 0, position: [0.0; 3], rotation: IDENTITY };
        assert!(message(recording.add_shape(shape)).contains("body 7 does not exist"));
        let triangles = vec![[0, 0, 9]];
        let mesh = recording.add_geometry(Geometry::Mesh { vertices: vec![[0.0; 3]], triangles });
        assert!(message(mesh.map(|_| ())).contains("vertex 9 does not exist"));
        assert_eq!((recording.frames(), recording.geometries.len()), (0, 1));
        let absent = BodySample { state: BodyState::Absent, ..bad };
        recording.push_frame(&frame(&[good, absent])).unwrap();
        assert_eq!(recording.frames(), 1);
    }

    /// Islands are named after their first body, whatever number the caller gives them.
    #[test]
    fn islands_keep_their_name_when_their_numbers_change() {
        let mut recording = recording(4);
        for numbers in [[9, 4, 9, BodySample::NO_ISLAND], [0, 77, 0, BodySample::NO_ISLAND]] {
            let bodies = numbers.map(|island| BodySample { island, ..BodySample::at([0.0; 3], IDENTITY) });
            recording.push_frame(&frame(&bodies)).unwrap();
            let names: Vec<_> = recording.coded.iter().map(|coded| coded.island).collect();
            assert_eq!(names, [0, 1, 0, -1]);
        }
    }

    #[test]
    fn positions_are_rounded_finer_than_a_thousandth_of_the_smallest_body() {
        assert_eq!(inverse_step(&[], &[], &[]), 2048.0);
        let recording = recording(1);
        let inverse = inverse_step(&recording.shapes, &recording.bodies, &recording.geometries);
        assert_eq!(inverse, 4096.0);
    }

    /// Random jumps cannot be predicted, so the limit is reached: thinning keeps the run whole and says where it began.
    #[test]
    fn a_run_past_the_limit_is_thinned_and_still_reaches_its_end() {
        let mut recording = recording(100);
        recording.options.page_limit_bytes = 200_000;
        let mut seed = 1_u32;
        for _ in 0..4000 {
            let bodies: Vec<_> = (0..100)
                .map(|_| {
                    seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                    BodySample::at([(seed >> 8) as f32 * 1e-4, 0.0, 0.0], IDENTITY)
                })
                .collect();
            recording.push_frame(&frame(&bodies)).unwrap();
        }
        recording.flush().unwrap();
        let strides: Vec<_> = recording.thinning.iter().map(|thinning| thinning.stride).collect();
        assert!(strides.len() > 2 && strides.is_sorted(), "{strides:?}");
        assert!(in_page(recording.chunk_bytes) < 260_000, "{}", recording.chunk_bytes);
        let last = *recording.table.times.last().unwrap();
        assert!(last > 399.9 - 0.1 * recording.stride() as f64, "the last frame is at {last} s");
        assert!(recording.frames() < 2000);
    }
}
