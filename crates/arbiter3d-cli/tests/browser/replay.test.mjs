// Opens replay pages in Chromium and checks what they show. Arguments: PAGE, and EXPECTED.json to compare with; with
// `--measure PAGE` it only prints how long a page takes to load and to draw. `SCREENSHOTS=DIRECTORY` keeps pictures.
// README.md says what must be installed. Ends with 77 when something is missing.

import { createRequire } from 'node:module';
import { existsSync, readFileSync } from 'node:fs';
import { pathToFileURL } from 'node:url';
import assert from 'node:assert/strict';

const EXECUTABLE = process.env.CHROMIUM ?? '/usr/bin/chromium';
const FLAGS = [
  '--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--disable-quic',
  '--no-first-run', '--disable-background-networking', '--disable-component-update', '--disable-sync',
];

function missing(what) {
  console.log(`${what} is missing: see tests/browser/README.md`);
  process.exit(77);
}

let chromium;
try {
  // `require`, because unlike `import` it also looks where NODE_PATH says.
  ({ chromium } = createRequire(import.meta.url)('playwright-core'));
} catch {
  missing('playwright-core');
}
if (!existsSync(EXECUTABLE)) missing(EXECUTABLE);

// Small, because everything is drawn by the CPU here.
const SIZE = process.env.SCREENSHOTS ? { width: 1280, height: 800 } : { width: 800, height: 500 };

async function open(browser, file, hash = '') {
  const page = await browser.newPage({ viewport: SIZE });
  const complaints = [];
  page.on('console', (message) => {
    // The software renderer reports that reading pixels is slow: that is this test, not the page.
    const harmless = /GPU stall due to ReadPixels/.test(message.text());
    if (['error', 'warning'].includes(message.type()) && !harmless) complaints.push(message.text());
  });
  page.on('pageerror', (error) => complaints.push(String(error)));
  page.on('request', (request) => {
    if (!/^(file|data|blob):/.test(request.url())) complaints.push(`the page asked the network for ${request.url()}`);
  });
  await page.goto(pathToFileURL(file).href + hash);
  await page.waitForFunction(() => window.replay !== undefined, null, { timeout: 120000 });
  return { page, complaints };
}

/** Goes to a frame and waits until it is drawn. */
async function seek(page, frame) {
  await page.locator('#scrub').evaluate((slider, value) => {
    slider.value = value;
    slider.dispatchEvent(new Event('input', { bubbles: true }));
  }, frame);
  await drawn(page, frame);
}

/** Waits until the picture shows `frame`. */
async function drawn(page, frame) {
  await page.waitForFunction((wanted) => replay.shown.frame === wanted && !replay.stage.dirty, frame);
}

/** The drawn picture, at a quarter of its size, as numbers. */
function pixels(page) {
  return page.evaluate(async () => {
    replay.stage.draw();
    const image = await createImageBitmap(document.getElementById('view'), { resizeWidth: 320, resizeHeight: 200 });
    const context = new OffscreenCanvas(320, 200).getContext('2d');
    context.drawImage(image, 0, 0);
    return [...context.getImageData(0, 0, 320, 200).data];
  });
}

/** How many of the 64,000 pixels differ clearly. */
function difference(a, b) {
  let count = 0;
  for (let i = 0; i < a.length; i += 4) {
    if (Math.abs(a[i] - b[i]) + Math.abs(a[i + 1] - b[i + 1]) + Math.abs(a[i + 2] - b[i + 2]) > 24) count++;
  }
  return count;
}

async function picture(page, name) {
  if (process.env.SCREENSHOTS) await page.screenshot({ path: `${process.env.SCREENSHOTS}/${name}.png` });
}

/** What a user does, one law after another. */
const LAWS = {
  async 'the title is text'({ page, expected }) {
    assert.equal(await page.locator('h1').textContent(), expected.title);
    assert.equal(await page.title(), `${expected.title} – Arbiter replay`);
  },

  async 'the canvas is not blank'({ page }) {
    await seek(page, 20);
    const image = await pixels(page);
    const colours = new Set();
    for (let i = 0; i < image.length; i += 4) colours.add((image[i] << 16) | (image[i + 1] << 8) | image[i + 2]);
    assert.ok(colours.size > 500, `only ${colours.size} colours`);
    await picture(page, 'falling');
  },

  async 'scrubbing changes the picture, and back'({ page }) {
    await seek(page, 20);
    const first = await pixels(page);
    await seek(page, 89);
    const last = await pixels(page);
    await seek(page, 20);
    const again = await pixels(page);
    assert.ok(difference(first, last) > 3000, `${difference(first, last)} pixels differ`);
    assert.equal(difference(first, again), 0);
  },

  async 'every pose is the recorded one within the rounding'({ page, expected }) {
    const step = await page.evaluate(() => replay.data.position_step);
    assert.ok(step < 1e-3);
    const shownPoses = await page.evaluate(async (poses) => {
      const shown = [];
      for (const { frame, body } of poses) {
        await replay.seek(frame);
        replay.refresh(performance.now());
        shown.push(replay.bodyAt(body));
      }
      return shown;
    }, expected.poses);
    for (const [i, { frame, body, position, rotation, state }] of expected.poses.entries()) {
      const shown = shownPoses[i];
      assert.equal(shown.state, state, `state of body ${body} in frame ${frame}`);
      if (state === 0) continue;
      for (let axis = 0; axis < 3; axis++) {
        const error = Math.abs(shown.position[axis] - position[axis]);
        assert.ok(error <= 0.51 * step + 1e-6, `body ${body}, frame ${frame}: off by ${error} m`);
      }
      const dot = Math.abs(shown.quaternion.reduce((sum, component, i) => sum + component * rotation[i], 0));
      assert.ok(dot > 1 - 1e-6, `body ${body}, frame ${frame}: turned by ${2 * Math.acos(dot)} rad`);
    }
  },

  async 'the numbers are those of the frame'({ page, expected }) {
    await seek(page, 89);
    assert.equal(await page.locator('#stat-step').textContent(), '89');
    assert.equal(await page.locator('#stat-time').textContent(), '2.97 s');
    assert.equal(await page.locator('#stat-bodies').textContent(), String(expected.bodies));
    assert.equal(await page.locator('#stat-arbiters').textContent(), '500');
    assert.equal(await page.locator('#stat-contacts').textContent(), '2,000');
    await seek(page, 0);
    assert.equal(await page.locator('#stat-bodies').textContent(), String(expected.bodies - 1));
    assert.equal(await page.locator('#stat-arbiters').textContent(), '0');
  },

  async 'play runs, pause holds'({ page }) {
    await seek(page, 0);
    await page.keyboard.press('Space');
    await page.waitForFunction(() => replay.frame >= 5);
    assert.equal(await page.locator('#play').getAttribute('aria-label'), 'Pause');
    await page.locator('#play').click();
    const held = await page.evaluate(() => replay.frame);
    await page.waitForTimeout(300);
    assert.equal(await page.evaluate(() => replay.frame), held);
    await page.keyboard.press('ArrowRight');
    assert.equal(await page.evaluate(() => replay.frame), held + 1);
    await page.keyboard.press('Shift+ArrowLeft');
    assert.equal(await page.evaluate(() => replay.frame), Math.max(held - 9, 0));
    await page.keyboard.press('End');
    assert.equal(await page.evaluate(() => replay.frame), 89);
  },

  async 'a click on a body lists its arbiters, and a link leads to the other body'({ page, expected }) {
    const { body, key, other, impulses, friction } = expected.resting;
    await seek(page, 89);
    const { screen } = await page.evaluate((index) => replay.bodyAt(index), body);
    await page.mouse.click(...screen);
    await page.waitForFunction(() => document.querySelectorAll('#arbiters li').length > 0);
    assert.equal(await page.locator('#body-name').textContent(), `Body ${body}`);
    assert.match(await page.locator('#body-facts').textContent(), /dynamic, asleep/);
    assert.equal(await page.locator('#arbiter-title').textContent(), '1 arbiter');
    assert.equal(await page.locator('#arbiters .key').textContent(), key);
    const text = await page.locator('#arbiters li').textContent();
    assert.ok(text.includes(other) && text.includes('4 contacts') && text.includes(`friction ${friction}`), text);
    assert.ok(text.includes(impulses), text);
    await picture(page, 'selected');
    await page.locator('#arbiters .link').click();
    await page.waitForFunction(() => document.querySelectorAll('#arbiters li').length === 500);
    assert.equal(await page.locator('#body-name').textContent(), other);
    await page.keyboard.press('Escape');
    await page.locator('#panel').waitFor({ state: 'hidden' });
  },

  async 'a drag turns the view and selects nothing'({ page }) {
    const before = await pixels(page);
    await page.mouse.move(600, 400);
    await page.mouse.down();
    await page.mouse.move(700, 420, { steps: 5 });
    await page.mouse.up();
    await page.waitForTimeout(300);
    assert.ok(difference(before, await pixels(page)) > 2000);
    assert.equal(await page.evaluate(() => replay.selected), -1);
    await page.keyboard.press('f');
  },

  async 'contacts, speed colours and shadows can be switched'({ page }) {
    // A slow machine has switched them off while playing.
    await page.locator('#show-shadows').check();
    await seek(page, 25);
    const plain = await pixels(page);
    await page.locator('#show-contacts').check();
    await page.waitForFunction(() => replay.shown.overlay?.includes('true') && !replay.stage.dirty);
    const contacts = await pixels(page);
    assert.ok(difference(plain, contacts) > 300, `${difference(plain, contacts)} pixels differ`);
    await picture(page, 'contacts');
    await page.locator('#show-contacts').uncheck();
    await page.locator('#colour-speed').click();
    await page.waitForFunction(() => replay.shown.paint?.endsWith('true') && !replay.stage.dirty);
    const speed = await pixels(page);
    assert.ok(difference(plain, speed) > 2000, `${difference(plain, speed)} pixels differ`);
    assert.ok(await page.locator('#legend').isVisible());
    await picture(page, 'speed');
    await page.locator('#show-shadows').uncheck();
    assert.ok(difference(speed, await pixels(page)) > 300);
    await page.locator('#show-shadows').check();
    await page.locator('#colour-island').click();
  },
};

const CONTAINER_LAWS = {
  async 'a click goes through see-through walls, and ends at solid ones'({ page, expected }) {
    await page.keyboard.press('Home');
    await drawn(page, 0);
    const nearest = await page.evaluate(() => {
      const camera = replay.stage.camera.position;
      const away = (body) => Math.hypot(...replay.bodyAt(body).position.map((x, i) => x - camera.getComponent(i)));
      return Array.from({ length: 27 }, (_, i) => i + 1).sort((a, b) => away(a) - away(b))[0];
    });
    const { screen } = await page.evaluate((body) => replay.bodyAt(body), nearest);
    await page.mouse.click(...screen);
    await page.locator('#panel').waitFor();
    assert.equal(await page.evaluate(() => replay.selected), nearest);
    await picture(page, 'container');
    await page.locator('#see-through').uncheck();
    await page.mouse.click(...screen);
    await page.waitForFunction((ball) => replay.selected !== ball, nearest);
    assert.equal(await page.evaluate(() => replay.nameOf(replay.selected)), expected.container);
    await page.locator('#see-through').check();
  },
};

async function check(browser, file, expected) {
  const { page, complaints } = await open(browser, file, '#frame=20');
  assert.equal(await page.evaluate(() => replay.frame), 20, 'the address says where to begin');
  for (const [law, test] of Object.entries(expected.container ? CONTAINER_LAWS : LAWS)) {
    const start = performance.now();
    try {
      await test({ page, expected });
    } catch (error) {
      error.message = `${law}: ${error.message}`;
      throw error;
    }
    console.log(`ok - ${law} (${Math.round(performance.now() - start)} ms)`);
  }
  assert.deepEqual(complaints, [], 'the console stays empty');
}

/** A page that cannot work says why, in words. */
async function checkBroken(browser, file) {
  const broken = readFileSync(file, 'utf8').replace(/(class="scene">.{40})/, '$1AAAA');
  const page = await browser.newPage({ viewport: SIZE });
  await page.setContent(broken);
  await page.waitForFunction(() => document.getElementById('message').textContent.startsWith('The replay cannot be shown'));
  console.log('ok - a damaged page says that it cannot be shown');
}

async function measure(browser, file) {
  const start = performance.now();
  const { page, complaints } = await open(browser, file, '#frame=120');
  const loaded = Math.round(performance.now() - start);
  await page.waitForFunction(() => replay.shown.frame === 120);
  await picture(page, 'large');
  const shadows = await page.evaluate(() => replay.measure(10));
  await page.locator('#show-shadows').uncheck();
  const plain = await page.evaluate(() => replay.measure(10));
  await page.keyboard.press('Home');
  await page.keyboard.press('Space');
  await page.waitForTimeout(4000);
  const film = await page.evaluate(async () => {
    const [start, first] = [performance.now(), replay.stage.renderer.info.render.frame];
    await new Promise((done) => setTimeout(done, 3000));
    return (1000 * (replay.stage.renderer.info.render.frame - first)) / (performance.now() - start);
  });
  await page.keyboard.press('Space');
  const jump = await page.evaluate(async () => {
    const start = performance.now();
    await replay.seek(replay.frameCount - 1);
    return performance.now() - start;
  });
  await page.locator('#show-contacts').check();
  await page.waitForTimeout(1000);
  await page.screenshot({ timeout: 60000 });
  await picture(page, 'large-contacts');
  const round = (times) => `placing ${times.script.toFixed(1)} ms, drawing ${times.draw.toFixed(1)} ms`;
  console.log(`loaded in ${loaded} ms; with shadows: ${round(shadows)}; without: ${round(plain)}`);
  console.log(`playing: ${film.toFixed(1)} pictures a second`);
  console.log(`jump to an unread chunk: ${jump.toFixed(0)} ms`);
  assert.deepEqual(complaints, []);
}

const browser = await chromium.launch({ executablePath: EXECUTABLE, args: FLAGS });
try {
  const [first, second] = process.argv.slice(2);
  if (first === '--measure') await measure(browser, second);
  else {
    await check(browser, first, JSON.parse(readFileSync(second, 'utf8')));
    await checkBroken(browser, first);
  }
} finally {
  await browser.close();
}
