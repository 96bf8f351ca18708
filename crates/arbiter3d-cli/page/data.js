// Reads the blocks of data in the page. How they are laid out is said where they are written: src/replay/codec.rs and
// src/replay/detail.rs.
'use strict';

/** The bytes of a block: base64, then zlib. */
async function readBlock(element) {
  const text = atob(element.textContent);
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** Walks over the variable-length integers of a block. */
class Reader {
  constructor(bytes) {
    this.bytes = bytes;
    this.at = 0;
  }

  /** Up to 32 bits. */
  unsigned() {
    const bytes = this.bytes;
    let byte = bytes[this.at++];
    if (byte < 128) return byte;
    let value = byte & 127;
    for (let shift = 7; ; shift += 7) {
      byte = bytes[this.at++];
      value |= (byte & 127) << shift;
      if (byte < 128) return value >>> 0;
    }
  }

  signed() {
    const value = this.unsigned();
    return (value >>> 1) ^ -(value & 1);
  }

  signed64() {
    let value = 0n;
    for (let shift = 0n; ; shift += 7n) {
      const byte = this.bytes[this.at++];
      value |= BigInt(byte & 127) << shift;
      if (byte < 128) return (value >> 1n) ^ -(value & 1n);
    }
  }

  /** Ascending indices, written as the gaps between them. */
  indices() {
    const indices = new Uint32Array(this.unsigned());
    let next = 0;
    for (let i = 0; i < indices.length; i++) {
      indices[i] = next + this.unsigned();
      next = indices[i] + 1;
    }
    return indices;
  }

  bytesOf(count) {
    this.at += count;
    return this.bytes.subarray(this.at - count, this.at);
  }

  /** Floats of which the high bytes were kept, one plane of bytes after another. */
  floats(count, planes) {
    const words = new Uint32Array(count);
    for (let plane = 0; plane < planes; plane++) {
      const bytes = this.bytesOf(count);
      for (let i = 0; i < count; i++) words[i] |= bytes[i] << (24 - 8 * plane);
    }
    return new Float32Array(words.buffer);
  }

  /** Integers written as differences to the one before. */
  running(count) {
    const numbers = new Int32Array(count);
    let last = 0;
    for (let i = 0; i < count; i++) numbers[i] = last = (last + this.signed()) | 0;
    return numbers;
  }

  runningKeys(count) {
    const keys = new BigUint64Array(count);
    let last = 0n;
    for (let i = 0; i < count; i++) keys[i] = last = BigInt.asUintN(64, last + this.signed64());
    return keys;
  }
}

const COMPONENTS = 7;

/** All frames of a chunk, as { poses: Int32Array (x y z qx qy qz qw of each body), states, islands }. */
function decodeChunk(bytes, frameCount, bodyCount) {
  const reader = new Reader(bytes);
  const velocity = new Int32Array(COMPONENTS * bodyCount);
  const frames = [];
  let last = {
    poses: new Int32Array(COMPONENTS * bodyCount),
    states: new Uint8Array(bodyCount),
    islands: new Int32Array(bodyCount),
  };
  for (let index = 0; index < frameCount; index++) {
    const frame = { poses: last.poses.slice(), states: last.states.slice(), islands: last.islands.slice() };
    for (const body of reader.indices()) frame.states[body] += reader.signed();
    for (const body of reader.indices()) frame.islands[body] += reader.signed();
    const poses = frame.poses;
    for (let i = 0; i < poses.length; i++) poses[i] += velocity[i];
    const missed = reader.indices();
    for (let component = 0; component < COMPONENTS; component++) {
      for (let i = 0; i < missed.length; i++) poses[COMPONENTS * missed[i] + component] += reader.signed();
    }
    if (index > 0) for (let i = 0; i < poses.length; i++) velocity[i] = poses[i] - last.poses[i];
    frames.push((last = frame));
  }
  return frames;
}

/** Arbiters and contacts of one frame. */
function decodeDetail(bytes, detailStep) {
  const reader = new Reader(bytes);
  const count = reader.unsigned();
  const detail = { count };
  detail.keys1 = reader.runningKeys(count);
  detail.keys2 = reader.runningKeys(count);
  detail.bodies1 = reader.running(count);
  detail.bodies2 = reader.running(count);
  detail.friction = reader.floats(count, 4);
  detail.contactCounts = reader.bytesOf(count);
  const contacts = (detail.contacts = reader.unsigned());
  detail.points = new Float32Array(3 * contacts);
  detail.normals = new Float32Array(3 * contacts);
  for (let axis = 0; axis < 3; axis++) {
    const numbers = reader.running(contacts);
    for (let i = 0; i < contacts; i++) detail.points[3 * i + axis] = numbers[i] * detailStep;
  }
  for (let axis = 0; axis < 3; axis++) {
    const numbers = new Int8Array(reader.bytesOf(contacts));
    for (let i = 0; i < contacts; i++) detail.normals[3 * i + axis] = numbers[i] / 127;
  }
  detail.impulses = reader.floats(contacts, 3);
  return detail;
}

/** Decoded blocks by index, the least recently used one forgotten first. */
class BlockCache {
  constructor(elements, capacity, decode) {
    Object.assign(this, { elements, capacity, decode, ready: new Map(), pending: new Map() });
  }

  /** The block if it is at hand; else null, and `load` brings it. */
  peek(index) {
    const block = this.ready.get(index);
    if (block === undefined) return null;
    this.ready.delete(index);
    this.ready.set(index, block);
    return block;
  }

  load(index) {
    if (this.ready.has(index)) return Promise.resolve(this.peek(index));
    if (!this.pending.has(index)) {
      const job = readBlock(this.elements[index]).then((bytes) => {
        const block = this.decode(bytes, index);
        this.pending.delete(index);
        this.ready.set(index, block);
        while (this.ready.size > this.capacity) this.ready.delete(this.ready.keys().next().value);
        return block;
      });
      this.pending.set(index, job);
    }
    return this.pending.get(index);
  }
}

/** Index of the last entry that is not above `value`; −1 if there is none. */
function lastNotAbove(sorted, value) {
  let low = 0;
  let high = sorted.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (sorted[middle] <= value) low = middle + 1;
    else high = middle;
  }
  return low - 1;
}

const ABSENT = 0;
const AWAKE = 2;
