// Plays a recording: time, texts, the selected body and the user's hands. data.js reads what is drawn by stage.js.
'use strict';

const byId = (id) => document.getElementById(id);
const PLAY_ICON = 'M4 2l10 6-10 6z';
const PAUSE_ICON = 'M3 2h4v12H3zM9 2h4v12H9z';

class Player {
  constructor(scene, chunkElements, detailElements) {
    this.data = scene;
    this.times = scene.frames.times;
    this.frameCount = this.times.length;
    this.chunks = new BlockCache(chunkElements, 4, (bytes, index) =>
      decodeChunk(bytes, scene.chunks[index][1], scene.bodies.length),
    );
    this.details = new BlockCache(detailElements, 6, (bytes) => decodeDetail(bytes, scene.detail_step));
    this.chunkStarts = scene.chunks.map(([first]) => first);
    this.time = 0;
    this.frame = 0;
    this.speed = 1;
    this.playing = false;
    this.bySpeed = false;
    this.selected = -1;
    this.pace = { seconds: 0, ticks: 0, mayDropShadows: true, sharpness: 1 };
    this.shown = {};
  }

  async start() {
    this.stage = new Stage(byId('view'), this.data);
    this.stage.resize();
    await this.seek(0);
    const first = this.frameAt(0);
    this.stage.pose(first, first, 0);
    this.stage.build();
    this.connect();
    this.describeScene();
    const wanted = /^#frame=(\d+)$/.exec(location.hash);
    if (wanted) await this.seek(Number(wanted[1]));
    else if (this.frameCount > 1) this.setPlaying(true);
    this.last = performance.now();
    requestAnimationFrame((now) => this.tick(now));
  }

  describeScene() {
    byId('scrub').max = this.frameCount - 1;
    byId('glass-row').hidden = this.stage.glassBodies.size === 0;
    byId('notes').hidden = this.data.notes.length === 0;
    byId('notes').replaceChildren(...this.data.notes.map((note) => element('li', '', note)));
    byId('legend-top').textContent = `${this.data.top_speed.toPrecision(2)} m/s`;
    byId('legend').querySelector('i').style.background = `linear-gradient(to right, ${SPEED_STOPS.join(', ')})`;
    byId('message').hidden = true;
  }

  // -- time

  chunkOf(frame) {
    return lastNotAbove(this.chunkStarts, frame);
  }

  /** A frame's bodies if its chunk is at hand. */
  frameAt(index) {
    const chunk = this.chunkOf(index);
    return this.chunks.peek(chunk)?.[index - this.chunkStarts[chunk]] ?? null;
  }

  /** Pauses nothing: jumps to a frame as soon as its chunk is there. */
  async seek(frame) {
    this.frame = Math.max(0, Math.min(this.frameCount - 1, frame));
    this.time = this.times[this.frame];
    await this.chunks.load(this.chunkOf(this.frame));
  }

  setPlaying(playing) {
    if (playing && this.frame === this.frameCount - 1) this.seek(0);
    // A pause lands on a recorded frame, so that what is listed is what is seen.
    if (!playing) this.time = this.times[this.frame];
    this.playing = playing;
    this.stage.setSharpness(playing ? this.pace.sharpness : 1);
    byId('play-icon').setAttribute('d', playing ? PAUSE_ICON : PLAY_ICON);
    byId('play').setAttribute('aria-label', playing ? 'Pause' : 'Play');
  }

  stepBy(frames) {
    this.setPlaying(false);
    return this.seek(this.frame + frames);
  }

  advance(seconds) {
    const end = this.times[this.frameCount - 1];
    const time = Math.min(this.time + seconds * this.speed, end);
    const frame = lastNotAbove(this.times, time + 1e-9);
    const chunk = this.chunkOf(frame);
    if (chunk + 1 < this.chunkStarts.length) this.chunks.load(chunk + 1);
    if (this.frameAt(frame) === null) {
      this.chunks.load(chunk);
      return;
    }
    this.time = time;
    this.frame = frame;
    if (time >= end) this.setPlaying(false);
  }

  /** Where drawing is too slow for a film, shadows go first, once; then pixels get coarser while playing. */
  keepPace(seconds) {
    const pace = this.pace;
    pace.seconds += 0.2 * (seconds - pace.seconds);
    pace.ticks++;
    if (pace.seconds < 0.07 || pace.ticks < 5) return;
    pace.ticks = 0;
    if (pace.mayDropShadows) {
      pace.mayDropShadows = false;
      if (byId('show-shadows').checked) byId('show-shadows').click();
    } else {
      this.stage.setSharpness((pace.sharpness = 0.5));
    }
  }

  tick(now) {
    // The first tick may be stamped before the page was ready.
    const seconds = Math.min(Math.max((now - this.last) / 1000, 0), 0.2);
    this.last = now;
    if (this.playing) {
      this.keepPace(seconds);
      this.advance(seconds);
    }
    this.stage.controls.update();
    this.refresh(now);
    if (this.stage.dirty) this.stage.draw();
    requestAnimationFrame((next) => this.tick(next));
  }

  // -- what is seen

  /** Brings the picture and the texts up to date with time, selection and options; does nothing if they are. */
  refresh(now) {
    const frame = this.frameAt(this.frame);
    if (frame === null) return;
    const shown = this.shown;
    if (shown.time !== this.time || shown.frame !== this.frame) {
      this.placeBodies(frame);
      this.showNumbers(frame);
    }
    const paint = `${this.frame} ${this.selected} ${this.bySpeed}`;
    if (shown.paint !== paint) {
      this.stage.paint(frame, this.bySpeed ? this.speedsAt(this.frame) : null, this.selected);
      shown.paint = paint;
    }
    this.refreshDetail(frame, now);
    shown.time = this.time;
    shown.frame = this.frame;
  }

  placeBodies(frame) {
    const next = this.frame + 1 < this.frameCount ? this.frameAt(this.frame + 1) : null;
    const span = this.times[this.frame + 1] - this.times[this.frame];
    const blend = next ? (this.time - this.times[this.frame]) / span : 0;
    this.stage.pose(frame, next ?? frame, blend);
    this.stage.place();
  }

  showNumbers(frame) {
    let [present, awake] = [0, 0];
    for (let body = 0; body < frame.states.length; body++) {
      if (frame.states[body] !== ABSENT) present++;
      if (frame.states[body] === AWAKE && this.data.bodies[body].kind !== 'static') awake++;
    }
    const { frames } = this.data;
    const numbers = {
      step: frames.steps[this.frame],
      bodies: present,
      awake,
      arbiters: frames.arbiters[this.frame],
      contacts: frames.contacts[this.frame],
    };
    for (const [name, number] of Object.entries(numbers)) byId(`stat-${name}`).textContent = number.toLocaleString('en');
    byId('stat-time').textContent = `${this.times[this.frame].toFixed(2)} s`;
    byId('scrub').value = this.frame;
    byId('clock').textContent = `${this.time.toFixed(2)} / ${this.times[this.frameCount - 1].toFixed(2)} s`;
  }

  /** Speeds from the difference to the frame before, in the first frame of a chunk to the one after. */
  speedsAt(index) {
    const other = index > this.chunkStarts[this.chunkOf(index)] ? index - 1 : Math.min(index + 1, this.frameCount - 1);
    const [a, b] = [this.frameAt(index), this.frameAt(other) ?? this.frameAt(index)];
    const seconds = Math.abs(this.times[index] - this.times[other]) || this.data.frame_seconds;
    return Float32Array.from(a.states, (state, body) => {
      if (state === ABSENT || b.states[body] === ABSENT) return 0;
      const p = COMPONENTS * body;
      const d = [0, 1, 2].map((axis) => a.poses[p + axis] - b.poses[p + axis]);
      return (this.data.position_step * Math.hypot(...d)) / seconds;
    });
  }

  /** The sample of arbiters that holds for this frame: the last one taken. */
  sampleIndex() {
    return lastNotAbove(this.data.detail_frames, this.frame);
  }

  refreshDetail(frame, now) {
    const everything = byId('show-contacts').checked;
    const sample = everything || this.selected >= 0 ? this.sampleIndex() : -1;
    const detail = sample >= 0 ? this.details.peek(sample) : null;
    if (sample >= 0 && !detail) this.details.load(sample);
    const overlay = detail ? `${sample} ${everything} ${this.selected}` : 'none';
    if (this.shown.overlay !== overlay && (detail || sample < 0)) {
      this.showContacts(detail, everything);
      this.shown.overlay = overlay;
    }
    const old = detail && this.data.detail_frames[sample] !== this.frame;
    byId('contacts-age').textContent = old ? `of step ${this.data.frames.steps[this.data.detail_frames[sample]]}` : '';
    const panel = `${this.selected} ${this.frame} ${detail ? sample : -1}`;
    const soon = this.playing && now - (this.shown.panelTime ?? 0) < 100 && this.shown.panelBody === this.selected;
    if (this.shown.panel === panel || soon) return;
    Object.assign(this.shown, { panel, panelTime: now, panelBody: this.selected });
    this.showPanel(frame, detail, sample);
  }

  showContacts(detail, everything) {
    const chosen = [];
    if (detail) {
      const mine = (arbiter) => detail.bodies1[arbiter] === this.selected || detail.bodies2[arbiter] === this.selected;
      let contact = 0;
      for (let arbiter = 0; arbiter < detail.count; arbiter++) {
        const take = everything || mine(arbiter);
        for (let i = 0; i < detail.contactCounts[arbiter]; i++, contact++) if (take) chosen.push(contact);
      }
    }
    this.stage.overlay.show(detail, chosen, 0.6 * this.stage.typicalRadius);
    this.stage.dirty = true;
  }

  // -- the selected body

  select(body) {
    this.selected = body;
  }

  showPanel(frame, detail, sample) {
    const body = this.selected;
    byId('panel').hidden = body < 0;
    if (body < 0) return;
    byId('body-name').textContent = this.nameOf(body);
    byId('body-facts').textContent = this.factsOf(body, frame);
    const list = detail ? arbitersOf(detail, body) : [];
    const known = this.data.detail_frames.length > 0;
    byId('arbiter-title').textContent = known ? `${list.length} ${list.length === 1 ? 'arbiter' : 'arbiters'}` : 'Arbiters were not recorded';
    const from = this.data.detail_frames[sample];
    const note = byId('sample-note');
    note.hidden = !detail || from === this.frame;
    if (!note.hidden) {
      const jump = element('button', 'link', `step ${this.data.frames.steps[from]}`);
      jump.dataset.frame = from;
      note.replaceChildren('as sampled at ', jump);
    }
    byId('arbiters').replaceChildren(...list.map((arbiter) => this.arbiterItem(arbiter)));
  }

  nameOf(body) {
    return this.data.bodies[body].name ?? `Body ${body}`;
  }

  factsOf(body, frame) {
    const { kind, name } = this.data.bodies[body];
    const state = ['not in the world', 'asleep', 'awake'][frame.states[body]];
    const p = [0, 1, 2].map((axis) => (frame.poses[COMPONENTS * body + axis] * this.data.position_step).toFixed(3));
    const island = frame.islands[body] < 0 ? '' : `, island ${frame.islands[body]}`;
    const doing = kind === 'static' && frame.states[body] !== ABSENT ? '' : `, ${state}`;
    const lines = [`${name ? `body ${body}, ` : ''}${kind}${doing}${island}`, `position ${p.join(', ')} m`];
    if (kind !== 'static') lines.push(`speed ${this.speedsAt(this.frame)[body].toFixed(3)} m/s`);
    return lines.join('\n');
  }

  arbiterItem(arbiter) {
    const item = element('li');
    const other = element('button', 'link', this.nameOf(arbiter.other));
    other.dataset.body = arbiter.other;
    const head = element('div', 'row');
    head.append(element('span', 'key', `${arbiter.key1}:${arbiter.key2}`), other);
    const contacts = `${arbiter.impulses.length} ${arbiter.impulses.length === 1 ? 'contact' : 'contacts'}`;
    const friction = `friction ${Number(arbiter.friction.toPrecision(4))}`;
    const impulses = arbiter.impulses.map((impulse) => Number(impulse.toPrecision(3))).join(' · ');
    item.append(head, element('div', '', `${contacts}, ${friction}`));
    if (impulses) item.append(element('div', 'impulses', `normal impulses ${impulses} N·s`));
    return item;
  }

  // -- the user's hands

  connect() {
    const canvas = byId('view');
    let press = null;
    canvas.addEventListener('pointerdown', (event) => (press = [event.clientX, event.clientY, event.button]));
    canvas.addEventListener('pointerup', (event) => {
      if (!press || press[2] !== 0 || Math.hypot(event.clientX - press[0], event.clientY - press[1]) > 4) return;
      this.select(this.stage.pick(event.clientX, event.clientY));
    });
    window.addEventListener('resize', () => this.stage.resize());
    window.addEventListener('keydown', (event) => this.onKey(event));
    byId('play').addEventListener('click', () => this.setPlaying(!this.playing));
    byId('back').addEventListener('click', () => this.stepBy(-1));
    byId('forward').addEventListener('click', () => this.stepBy(1));
    byId('scrub').addEventListener('input', (event) => this.seek(Number(event.target.value)));
    byId('speed').addEventListener('change', (event) => (this.speed = Number(event.target.value)));
    byId('colour-island').addEventListener('click', () => this.colourBySpeed(false));
    byId('colour-speed').addEventListener('click', () => this.colourBySpeed(true));
    byId('show-shadows').addEventListener('change', (event) => this.stage.setShadows(event.target.checked));
    byId('see-through').addEventListener('change', (event) => this.stage.setGlass(event.target.checked));
    byId('frame-view').addEventListener('click', () => this.frameView());
    byId('deselect').addEventListener('click', () => this.select(-1));
    byId('panel').addEventListener('click', (event) => {
      const { body, frame } = event.target.dataset;
      if (body !== undefined) this.select(Number(body));
      if (frame !== undefined) this.stepBy(Number(frame) - this.frame);
    });
  }

  colourBySpeed(bySpeed) {
    this.bySpeed = bySpeed;
    byId('colour-island').setAttribute('aria-pressed', String(!bySpeed));
    byId('colour-speed').setAttribute('aria-pressed', String(bySpeed));
    byId('legend').hidden = !bySpeed;
  }

  frameView() {
    if (this.selected < 0) return this.stage.frameView();
    const at = 12 * this.selected;
    const centre = new THREE.Vector3(...[3, 7, 11].map((offset) => this.stage.matrices[at + offset]));
    return this.stage.frameView({ centre, radius: 7 * this.stage.bodyRadius[this.selected] });
  }

  onKey(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target.tagName === 'SELECT') return;
    const stride = event.shiftKey ? 10 : 1;
    const actions = {
      ' ': () => this.setPlaying(!this.playing),
      ArrowLeft: () => this.stepBy(-stride),
      ArrowRight: () => this.stepBy(stride),
      Home: () => this.stepBy(-this.frameCount),
      End: () => this.stepBy(this.frameCount),
      Escape: () => this.select(-1),
      1: () => this.colourBySpeed(false),
      2: () => this.colourBySpeed(true),
      c: () => byId('show-contacts').click(),
      f: () => this.frameView(),
    };
    const action = actions[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!action) return;
    event.preventDefault();
    action();
  }

  // -- for tests and the curious

  /** Where a body is, as drawn: { position, quaternion, state, island, screen: [x, y] in CSS pixels }. */
  bodyAt(body) {
    const frame = this.frameAt(this.frame);
    const position = [3, 7, 11].map((offset) => this.stage.matrices[12 * body + offset]);
    const projected = new THREE.Vector3(...position).project(this.stage.camera);
    const screen = [((projected.x + 1) / 2) * window.innerWidth, ((1 - projected.y) / 2) * window.innerHeight];
    const quaternion = [...this.stage.quaternions.subarray(4 * body, 4 * body + 4)];
    return { position, quaternion, state: frame.states[body], island: frame.islands[body], screen };
  }

  /** Milliseconds to place, paint and draw a frame, up to the last pixel; the mean of several frames in a row. */
  async measure(frames) {
    const gl = this.stage.renderer.getContext();
    const [first, pixel] = [this.frame, new Uint8Array(4)];
    const times = { script: 0, draw: 0 };
    for (let i = 0; i < frames; i++) {
      await this.seek(Math.min(first + i, this.frameCount - 1));
      const start = performance.now();
      this.refresh(start);
      const placed = performance.now();
      this.stage.draw();
      gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
      times.script += (placed - start) / frames;
      times.draw += (performance.now() - placed) / frames;
    }
    return times;
  }
}

function arbitersOf(detail, body) {
  const list = [];
  let first = 0;
  for (let i = 0; i < detail.count; i++) {
    const next = first + detail.contactCounts[i];
    const [body1, body2] = [detail.bodies1[i], detail.bodies2[i]];
    if (body1 === body || body2 === body) {
      const other = body1 === body ? body2 : body1;
      const impulses = [...detail.impulses.subarray(first, next)];
      list.push({ key1: detail.keys1[i], key2: detail.keys2[i], other, friction: detail.friction[i], impulses });
    }
    first = next;
  }
  return list;
}

function element(tag, className = '', text = '') {
  const made = document.createElement(tag);
  made.className = className;
  made.textContent = text;
  return made;
}

async function main() {
  if (typeof DecompressionStream === 'undefined') {
    throw new Error('this page needs a browser with DecompressionStream (Chrome 80, Firefox 113, Safari 16.4 or later)');
  }
  const scene = JSON.parse(new TextDecoder().decode(await readBlock(document.querySelector('script.scene'))));
  if (scene.frames.times.length === 0) throw new Error('nothing was recorded: the recording has no frames');
  const player = new Player(scene, document.querySelectorAll('script.chunk'), document.querySelectorAll('script.detail'));
  await player.start();
  window.replay = player;
}

function report(error) {
  byId('message').hidden = false;
  byId('message').textContent = `The replay cannot be shown: ${error.message}`;
}

// A block that cannot be read may turn up only when the slider gets there.
window.addEventListener('unhandledrejection', (event) => report(event.reason));
main();
