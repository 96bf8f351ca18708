//! Arbiters and contacts of single frames, sampled evenly over a run under a limit of bytes.
//!
//! A colosseum of 8,818 boxes has 47,000 contacts, half a megabyte a frame when compressed: too much for every frame.
//! So samples stand alone, and whenever they outgrow their limit every second one is thrown away and from then on only
//! half as many are taken. At any time the samples are those of the frames `0, s, 2s, …` with the smallest `s = 2ᵏ` that
//! fits.
//!
//! The layout of a sample, a column after another (integers as in `codec`):
//!
//! ```text
//! arbiter count
//! key 1, key 2          difference to the arbiter before, signed 64 bit
//! body 1, body 2        difference to the arbiter before
//! friction              four planes of bytes of the f32, high byte first
//! contacts an arbiter   one byte each
//! contact count
//! x, y, z               difference to the contact before, in detail steps
//! normal x, y, z        one byte each, 127 = 1
//! normal impulse        the three high bytes of the f32, as planes, rounded to 12 bits of precision
//! ```

use super::codec::{compress, quantise, write_signed, write_unsigned};
use super::recording::ContactDetail;
use std::io;

/// One frame's arbiters and contacts, compressed.
pub(super) struct DetailSample {
    /// Index of the recorded pose frame that it belongs to.
    pub frame: usize,
    pub bytes: Vec<u8>,
}

/// The samples kept so far and the rule for the next one.
pub(super) struct DetailSampler {
    samples: Vec<DetailSample>,
    bytes: usize,
    stride: usize,
}

impl DetailSampler {
    pub(super) fn new() -> Self {
        Self { samples: Vec::new(), bytes: 0, stride: 1 }
    }

    /// Whether this frame's turn has come.
    pub(super) fn wants(&self, frame: usize) -> bool {
        frame.is_multiple_of(self.stride)
    }

    /// Takes a sample. `inverse_step` is detail steps a metre.
    pub(super) fn push(&mut self, frame: usize, detail: &ContactDetail, inverse_step: f64) -> io::Result<()> {
        let bytes = encode(detail, inverse_step)?;
        self.bytes += bytes.len();
        self.samples.push(DetailSample { frame, bytes });
        Ok(())
    }

    /// Drops every second sample until the rest fits; the first one always stays.
    pub(super) fn shrink_to(&mut self, limit: usize) {
        while self.bytes > limit && self.samples.len() > 1 {
            self.stride *= 2;
            self.samples.retain(|sample| sample.frame.is_multiple_of(self.stride));
            self.bytes = self.samples.iter().map(|sample| sample.bytes.len()).sum();
        }
    }

    pub(super) fn samples(&self) -> &[DetailSample] {
        &self.samples
    }

    /// Frames from one sample to the next.
    pub(super) fn stride(&self) -> usize {
        self.stride
    }
}

fn encode(detail: &ContactDetail, inverse_step: f64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::with_capacity(16 * detail.arbiters.len() + 16 * detail.contacts.len());
    let (arbiters, contacts) = (detail.arbiters, detail.contacts);
    write_unsigned(&mut bytes, arbiters.len() as u64);
    write_keys(&mut bytes, arbiters.iter().map(|arbiter| arbiter.key.0));
    write_keys(&mut bytes, arbiters.iter().map(|arbiter| arbiter.key.1));
    write_differences(&mut bytes, arbiters.iter().map(|arbiter| arbiter.bodies.0 as i32));
    write_differences(&mut bytes, arbiters.iter().map(|arbiter| arbiter.bodies.1 as i32));
    write_planes(&mut bytes, 4, arbiters.iter().map(|arbiter| arbiter.friction.to_bits()));
    bytes.extend(arbiters.iter().map(|arbiter| arbiter.contact_count));
    write_unsigned(&mut bytes, contacts.len() as u64);
    for axis in 0..3 {
        write_differences(&mut bytes, contacts.iter().map(|contact| quantise(contact.point[axis], inverse_step)));
    }
    for axis in 0..3 {
        bytes.extend(contacts.iter().map(|contact| (contact.normal[axis] * 127.0).round() as i8 as u8));
    }
    write_planes(&mut bytes, 3, contacts.iter().map(|contact| round_bits(contact.normal_impulse)));
    compress(&bytes)
}

/// Rounds to 12 bits of precision: the low 12 of the 24 compress to nothing.
fn round_bits(value: f32) -> u32 {
    (value.to_bits().saturating_add(0x800)) & !0xfff
}

fn write_keys(bytes: &mut Vec<u8>, keys: impl Iterator<Item = u64>) {
    let mut last = 0_u64;
    for key in keys {
        let difference = key.wrapping_sub(last) as i64;
        write_unsigned(bytes, ((difference << 1) ^ (difference >> 63)) as u64);
        last = key;
    }
}

fn write_differences(bytes: &mut Vec<u8>, numbers: impl Iterator<Item = i32>) {
    let mut last = 0_i32;
    for number in numbers {
        write_signed(bytes, number.wrapping_sub(last));
        last = number;
    }
}

/// Writes the `count` high bytes of each word, a byte position after another.
fn write_planes(bytes: &mut Vec<u8>, count: u32, words: impl Iterator<Item = u32> + Clone) {
    for plane in 0..count {
        bytes.extend(words.clone().map(|word| (word >> (24 - 8 * plane)) as u8));
    }
}

#[cfg(test)]
mod tests {
    use super::super::codec::tests::{Reader, decompress};
    use super::super::recording::{ArbiterSample, ContactSample};
    use super::*;

    fn contact(x: f32, impulse: f32) -> ContactSample {
        ContactSample { point: [x, 0.5, -x], normal: [0.0, 1.0, 0.0], normal_impulse: impulse }
    }

    fn arbiter(key: (u64, u64), contact_count: u8) -> ArbiterSample {
        ArbiterSample { key, bodies: (3, 1), friction: 0.6, contact_count }
    }

    #[test]
    fn keys_of_all_64_bits_and_contact_points_survive() {
        let arbiters = [arbiter((1, u64::MAX), 1), arbiter((u64::MAX, 2), 1)];
        let contacts = [contact(12.25, 100.0), contact(-7.5, 0.013)];
        let sample = encode(&ContactDetail { arbiters: &arbiters, contacts: &contacts }, 1024.0).unwrap();
        let plain = decompress(&sample);
        let mut reader = Reader(&plain);
        assert_eq!(reader.unsigned(), 2);
        for expected in [[1, u64::MAX], [u64::MAX, 2]] {
            let mut key = 0_u64;
            for part in expected {
                let zigzag = reader.unsigned();
                key = key.wrapping_add((zigzag >> 1) ^ (zigzag & 1).wrapping_neg());
                assert_eq!(key, part);
            }
        }
        assert_eq!([reader.signed(), reader.signed(), reader.signed(), reader.signed()], [3, 0, 1, 0]);
        reader.0 = &reader.0[4 * 2 + 2..];
        assert_eq!(reader.unsigned(), 2);
        let x = reader.signed();
        assert_eq!([x, x + reader.signed()], [12_544, -7_680]);
    }

    #[test]
    fn impulses_keep_three_digits() {
        for value in [0.0_f32, 0.013, 1.0, 123.456, 9.87e6] {
            let rounded = f32::from_bits(round_bits(value));
            assert!((rounded - value).abs() <= value * 3e-4, "{value} became {rounded}");
        }
    }

    #[test]
    fn samples_stay_even_under_the_limit() {
        let contacts: Vec<_> =
            (0..400_u16).map(|i| contact(f32::from(i % 97 * (i % 89)), f32::from(i) * 1.7)).collect();
        let arbiters: Vec<_> = (0..100).map(|i| arbiter((i, i * i), 4)).collect();
        let detail = ContactDetail { arbiters: &arbiters, contacts: &contacts };
        let mut sampler = DetailSampler::new();
        for frame in 0..100 {
            if sampler.wants(frame) {
                sampler.push(frame, &detail, 1024.0).unwrap();
                sampler.shrink_to(20_000);
            }
        }
        let frames: Vec<_> = sampler.samples().iter().map(|sample| sample.frame).collect();
        let expected: Vec<_> = (0..100).step_by(sampler.stride()).collect();
        assert_eq!(frames, expected);
        assert!(sampler.bytes <= 20_000 && sampler.stride() > 1 && sampler.stride() < 64, "{}", sampler.stride());
    }
}
