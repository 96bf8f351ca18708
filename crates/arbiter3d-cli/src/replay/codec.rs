//! Poses, states and islands of consecutive frames in few bytes.
//!
//! Positions are rounded to multiples of a fixed step, rotations to quaternions in steps of 1/4096 (0.5 mrad). Each body is
//! predicted to go on as it did between the last two frames, `p̂ = 2 p₁ − p₀`; only bodies that the prediction misses are
//! written, and of those only the error. A body at rest or in straight flight therefore costs nothing, and a falling
//! one costs the same small number every frame, which DEFLATE then folds away. Components are written one after
//! another for all bodies (all x, then all y, …) because equal kinds of numbers compress better side by side.
//!
//! The layout of one frame, in variable-length integers (seven bits a byte, low first; signed ones zigzag-coded):
//!
//! ```text
//! states, islands:  count, index gaps[count], differences[count]
//! poses:            count, index gaps[count], then seven columns of errors[count]: x y z, qx qy qz qw
//! ```
//!
//! A chunk starts from zero: its first frame is complete, and after it every body is predicted to stand still.
//! All arithmetic wraps, here and in the page, so that absurd coordinates give absurd pictures and not errors.

use flate2::{Compression, write::ZlibEncoder};
use std::io::{self, Write as _};

/// Units of a quaternion component.
const ROTATION_SCALE: f32 = 4096.0;

/// Numbers of a pose: three of the position, four of the rotation.
const COMPONENTS: usize = 7;

/// Rounded pose of one body.
pub(super) type QuantisedPose = [i32; COMPONENTS];

/// What a chunk keeps of each body in each frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct CodedBody {
    pub pose: QuantisedPose,
    pub state: i32,
    pub island: i32,
}

/// Rounds a position and a rotation; `inverse_step` is steps a metre. Out of range saturates.
pub(super) fn quantise_pose(position: &[f32; 3], rotation: &[f32; 4], inverse_step: f64) -> QuantisedPose {
    let mut pose = [0; COMPONENTS];
    for (slot, &coordinate) in pose[..3].iter_mut().zip(position) {
        *slot = quantise(coordinate, inverse_step);
    }
    for (slot, component) in pose[3..].iter_mut().zip(rotation) {
        *slot = (component * ROTATION_SCALE).round() as i32;
    }
    pose
}

/// Rounds one coordinate to steps, in double precision so that far coordinates keep their last bits.
pub(super) fn quantise(coordinate: f32, inverse_step: f64) -> i32 {
    (f64::from(coordinate) * inverse_step).round() as i32
}

/// Appends an unsigned variable-length integer.
pub(super) fn write_unsigned(bytes: &mut Vec<u8>, mut value: u64) {
    while value >= 0x80 {
        bytes.push(value as u8 | 0x80);
        value >>= 7;
    }
    bytes.push(value as u8);
}

/// Appends a signed one: zigzag puts the sign into the lowest bit, so that small negatives stay short.
pub(super) fn write_signed(bytes: &mut Vec<u8>, value: i32) {
    write_unsigned(bytes, u64::from(((value << 1) ^ (value >> 31)) as u32));
}

/// Compresses one block on its own.
pub(super) fn compress(bytes: &[u8]) -> io::Result<Vec<u8>> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(bytes)?;
    encoder.finish()
}

/// Writes frames one after another into a compressed chunk.
pub(super) struct PoseEncoder {
    stream: ZlibEncoder<Vec<u8>>,
    frames: usize,
    previous: Vec<CodedBody>,
    velocity: Vec<QuantisedPose>,
    errors: Vec<QuantisedPose>,
    buffer: Vec<u8>,
}

impl PoseEncoder {
    pub(super) fn new() -> Self {
        Self {
            stream: ZlibEncoder::new(Vec::new(), Compression::default()),
            frames: 0,
            previous: Vec::new(),
            velocity: Vec::new(),
            errors: Vec::new(),
            buffer: Vec::new(),
        }
    }

    /// Frames since the chunk began.
    pub(super) fn frames(&self) -> usize {
        self.frames
    }

    /// Bytes that the open chunk has given so far (what the compressor still holds back is not counted).
    pub(super) fn bytes(&self) -> usize {
        self.stream.get_ref().len()
    }

    /// Appends a frame. `bodies` may have grown since the last one, never shrunk.
    pub(super) fn push(&mut self, bodies: &mut [CodedBody]) -> io::Result<()> {
        self.previous.resize(bodies.len(), CodedBody { pose: [0; COMPONENTS], state: 0, island: 0 });
        self.velocity.resize(bodies.len(), [0; COMPONENTS]);
        self.buffer.clear();
        self.write_column(bodies, |body| body.state);
        self.write_column(bodies, |body| body.island);
        self.write_poses(bodies);
        self.previous.copy_from_slice(bodies);
        self.frames += 1;
        self.stream.write_all(&self.buffer)
    }

    /// Ends the chunk, returns its bytes and is ready for the next one.
    pub(super) fn finish(&mut self) -> io::Result<Vec<u8>> {
        self.frames = 0;
        self.previous.clear();
        self.velocity.clear();
        self.stream.reset(Vec::new())
    }

    /// Differences of one number to the last frame.
    fn write_column(&mut self, bodies: &[CodedBody], number: impl Fn(&CodedBody) -> i32) {
        let differences =
            || bodies.iter().zip(&self.previous).map(|(new, old)| number(new).wrapping_sub(number(old))).enumerate();
        write_gaps(&mut self.buffer, differences().filter(|&(_, d)| d != 0).map(|(index, _)| index));
        for (_, difference) in differences().filter(|&(_, d)| d != 0) {
            write_signed(&mut self.buffer, difference);
        }
    }

    fn write_poses(&mut self, bodies: &mut [CodedBody]) {
        self.errors.clear();
        for ((body, previous), velocity) in bodies.iter_mut().zip(&self.previous).zip(&mut self.velocity) {
            keep_hemisphere(&mut body.pose, &previous.pose);
            let mut error = [0; COMPONENTS];
            for component in 0..COMPONENTS {
                let change = body.pose[component].wrapping_sub(previous.pose[component]);
                error[component] = change.wrapping_sub(velocity[component]);
                velocity[component] = if self.frames == 0 { 0 } else { change };
            }
            self.errors.push(error);
        }
        let missed = || self.errors.iter().enumerate().filter(|(_, error)| **error != [0; COMPONENTS]);
        write_gaps(&mut self.buffer, missed().map(|(index, _)| index));
        for component in 0..COMPONENTS {
            for (_, error) in missed() {
                write_signed(&mut self.buffer, error[component]);
            }
        }
    }
}

/// `q` and `−q` are one rotation: picks the one nearer to the last frame's, so that differences stay small.
fn keep_hemisphere(pose: &mut QuantisedPose, previous: &QuantisedPose) {
    let dot: i64 = pose[3..].iter().zip(&previous[3..]).map(|(a, b)| i64::from(*a) * i64::from(*b)).sum();
    if dot < 0 {
        for component in &mut pose[3..] {
            *component = component.wrapping_neg();
        }
    }
}

/// Writes how many indices there are, then each as its distance from the one before (the first from −1), less one.
fn write_gaps(buffer: &mut Vec<u8>, indices: impl Iterator<Item = usize> + Clone) {
    write_unsigned(buffer, indices.clone().count() as u64);
    let mut next = 0;
    for index in indices {
        write_unsigned(buffer, (index - next) as u64);
        next = index + 1;
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use std::io::Read as _;

    /// Reads what this file writes, the way the page does.
    pub struct Reader<'a>(pub &'a [u8]);

    impl Reader<'_> {
        pub fn unsigned(&mut self) -> u64 {
            let mut value = 0;
            for shift in (0..64).step_by(7) {
                let (&byte, rest) = self.0.split_first().expect("the block ends inside a number");
                self.0 = rest;
                value |= u64::from(byte & 0x7f) << shift;
                if byte < 0x80 {
                    break;
                }
            }
            value
        }

        pub fn signed(&mut self) -> i32 {
            let value = self.unsigned() as u32;
            (value >> 1) as i32 ^ -((value & 1) as i32)
        }

        pub fn indices(&mut self) -> Vec<usize> {
            let count = self.unsigned();
            let mut next = 0;
            (0..count)
                .map(|_| {
                    let index = next + self.unsigned() as usize;
                    next = index + 1;
                    index
                })
                .collect()
        }
    }

    pub fn decompress(bytes: &[u8]) -> Vec<u8> {
        let mut plain = Vec::new();
        flate2::read::ZlibDecoder::new(bytes).read_to_end(&mut plain).expect("the block is zlib data");
        plain
    }

    const STEPS_A_METRE: f64 = 4096.0;

    fn decode(chunk: &[u8], frames: usize, count: usize) -> Vec<Vec<CodedBody>> {
        let plain = decompress(chunk);
        let mut reader = Reader(&plain);
        let mut bodies = vec![CodedBody { pose: [0; 7], state: 0, island: 0 }; count];
        let mut velocity = vec![[0_i32; 7]; count];
        let mut decoded = Vec::new();
        for frame in 0..frames {
            for index in reader.indices() {
                bodies[index].state += reader.signed();
            }
            for index in reader.indices() {
                bodies[index].island += reader.signed();
            }
            let mut errors = vec![vec![0_i32; count]; COMPONENTS];
            let missed = reader.indices();
            for column in &mut errors {
                for &index in &missed {
                    column[index] = reader.signed();
                }
            }
            for index in 0..count {
                for component in 0..7 {
                    let change = velocity[index][component].wrapping_add(errors[component][index]);
                    let number = &mut bodies[index].pose[component];
                    *number = number.wrapping_add(change);
                    velocity[index][component] = if frame == 0 { 0 } else { change };
                }
            }
            decoded.push(bodies.clone());
        }
        assert!(reader.0.is_empty(), "{} bytes are left over", reader.0.len());
        decoded
    }

    /// Balls on parabolas that turn about a slanted axis; every third one rests, asleep after the fifth frame.
    fn frame(time: f32, count: usize) -> Vec<CodedBody> {
        (0..count)
            .map(|index| {
                let rests = index % 3 == 0;
                let (t, x) = (if rests { 0.0 } else { time }, index as f32);
                let (sine, cosine) = (libm::sinf(2.0 * t + x), libm::cosf(2.0 * t + x));
                let position = [x - t, 20.0 - 4.905 * t * t, -1000.0 + 3.0 * t];
                let pose = quantise_pose(&position, &[0.6 * sine, 0.0, 0.8 * sine, cosine], STEPS_A_METRE);
                let state = if rests && time > 0.3 { 1 } else { 2 };
                CodedBody { pose, state, island: (index as i32 % 7) - 1 }
            })
            .collect()
    }

    #[test]
    fn a_chunk_gives_back_the_rounded_frames_bit_for_bit() {
        let mut encoder = PoseEncoder::new();
        for chunk in 0..2 {
            let mut expected = Vec::new();
            for step in 0..20 {
                let mut bodies = frame((chunk * 20 + step) as f32 / 15.0, 30);
                encoder.push(&mut bodies).unwrap();
                expected.push(bodies);
            }
            assert_eq!(encoder.frames(), 20);
            let bytes = encoder.finish().unwrap();
            assert_eq!(decode(&bytes, 20, 30), expected);
        }
    }

    #[test]
    fn rounding_stays_within_half_a_step_and_saturates() {
        let pose = quantise_pose(&[1.000_1, -0.3, 1e30], &[0.0, 0.6, 0.0, 0.8], STEPS_A_METRE);
        assert!((f64::from(pose[0]) / STEPS_A_METRE - 1.000_1).abs() <= 0.5 / STEPS_A_METRE + 1e-7);
        assert!((f64::from(pose[1]) / STEPS_A_METRE + 0.3).abs() <= 0.5 / STEPS_A_METRE + 1e-7);
        assert_eq!(pose[2], i32::MAX);
        assert_eq!(pose[3..], [0, 2458, 0, 3277]);
    }

    /// The quaternion of a body that turns on and on passes through −q; the coded one never jumps.
    #[test]
    fn a_turning_body_never_changes_the_sign_of_its_quaternion() {
        let mut encoder = PoseEncoder::new();
        let mut last: Option<QuantisedPose> = None;
        for step in 0..100 {
            // An engine may hand out q or −q: here it flips on every other frame.
            let (half, sign) = (step as f32 * 0.05, if step % 2 == 0 { 1.0 } else { -1.0 });
            let rotation = [sign * libm::sinf(half), 0.0, 0.0, sign * libm::cosf(half)];
            let pose = quantise_pose(&[0.0; 3], &rotation, STEPS_A_METRE);
            let mut bodies = [CodedBody { pose, state: 2, island: -1 }];
            encoder.push(&mut bodies).unwrap();
            if let Some(last) = last {
                let jump = (0..7).map(|c| (bodies[0].pose[c] - last[c]).abs()).max().unwrap();
                assert!(jump < 500, "frame {step} jumps by {jump}");
            }
            last = Some(bodies[0].pose);
        }
    }

    /// 1,000 bodies at rest for 600 frames: two bytes a frame are enough once the first frame is written.
    #[test]
    fn bodies_at_rest_cost_nothing() {
        let mut encoder = PoseEncoder::new();
        let mut bodies = frame(0.0, 1000);
        encoder.push(&mut bodies).unwrap();
        let first = encoder.finish().unwrap().len();
        for _ in 0..600 {
            encoder.push(&mut bodies).unwrap();
        }
        let all = encoder.finish().unwrap().len();
        assert!(all < first + 100, "{all} bytes against {first} for the first frame alone");
    }

    #[test]
    fn numbers_of_every_size_survive() {
        let mut bytes = Vec::new();
        let signed = [0, 1, -1, 63, -64, 64, 8191, -8192, i32::MAX, i32::MIN];
        let unsigned = [0, 127, 128, u64::from(u32::MAX), u64::MAX];
        signed.iter().for_each(|&n| write_signed(&mut bytes, n));
        unsigned.iter().for_each(|&n| write_unsigned(&mut bytes, n));
        let mut reader = Reader(&bytes);
        assert!(signed.iter().all(|&n| reader.signed() == n));
        assert!(unsigned.iter().all(|&n| reader.unsigned() == n));
        assert!(reader.0.is_empty());
    }
}
