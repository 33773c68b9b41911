// The picture of a session: it comes, it moves, it fits narrow screens, and is looked at as that of a recording.

import assert from 'node:assert/strict';
import { join } from 'node:path';
import { eventually, open } from './start.mjs';

const LEAST_LIT = 0.05;
/** Least width and height of what a finger presses (CSS pixels). */
const FINGER = 44;
/** From the load to the first picture (ms), of a machine that has much else to do. */
const FIRST = 15_000;
/** Pictures before their rate is measured, and while it is. */
const WARM = 5;
const PICTURES = 10;

export async function picture({ browser, server, line, pictures }) {
  await server.client.create({ scene: 'demo', sessionId: 'cloth', stepLimit: 0n });
  await server.client.create({ scene: 'snow_and_cloth', sessionId: 'snow', stepLimit: 0n });
  const shoot = (page, name) => (pictures === undefined ? null : page.screenshot({ path: join(pictures, `${name}.png`) }));

  const begin = performance.now();
  const tab = await open(browser, `${line.address}?session=cloth`, { viewport: { width: 1280, height: 800 }, colorScheme: 'dark' });
  await tab.ready();
  const first = performance.now() - begin;
  assert.ok(first < FIRST, `the first picture comes after ${first} ms`);
  const lit = await tab.page.evaluate(() => window.nappe.litShare());
  assert.ok(lit > LEAST_LIT, `${lit} of the pixels are lit`);
  const renderer = await tab.page.evaluate(() => window.nappe.renderer());
  assert.notEqual(renderer, '');
  assert.ok(await tab.page.evaluate(() => window.nappe.positions().length > 0 && window.nappe.positions().every(Number.isFinite)));
  await rays(tab.page);
  const perSecond = await moves(tab);
  await shoot(tab.page, 'session-dark');
  await views(tab);
  await tab.leave();

  const light = await open(browser, `${line.address}?session=snow`, { viewport: { width: 1280, height: 800 }, colorScheme: 'light' });
  await light.ready();
  await colors(light, server);
  await shoot(light.page, 'session-light');
  await light.leave();
  await mesh(browser, server, line);
  await turning(browser, server, line);
  await narrow(browser, line, shoot);
  return { first_ms: Math.round(first), lit_share: Number(lit.toFixed(3)), pictures_per_second: perSecond, renderer };
}

/** A ray through a pixel starts at the camera; rays through neighbours part, and all have length 1. */
async function rays(page) {
  const [middle, beside] = await page.evaluate(() => {
    const { left, top, width, height } = document.getElementById('canvas').getBoundingClientRect();
    return [0, 100].map((by) => window.nappe.ray(left + width / 2 + by, top + height / 2));
  });
  assert.deepEqual(middle.origin, beside.origin);
  const angle = Math.acos(middle.direction.reduce((sum, part, axis) => sum + part * beside.direction[axis], 0));
  assert.ok(angle > 0.02 && angle < 0.3, `100 pixels are ${angle} radians apart`);
  // The scene is seen in the middle: the ray passes near the ball of the demo.
  const away = [0, 0.6, 0].map((at, axis) => at - middle.origin[axis]);
  const along = away.reduce((sum, part, axis) => sum + part * middle.direction[axis], 0);
  const apart = Math.hypot(...away.map((part, axis) => part - along * middle.direction[axis]));
  assert.ok(along > 0 && apart < 1, `the ball is ${apart} m beside what is seen in the middle`);
}

/** Pictures per second while it plays. */
async function moves(tab) {
  await tab.page.keyboard.press(' ');
  const before = await tab.page.evaluate(() => [...window.nappe.positions().slice(0, 300)]);
  // Until the browser knows how finely it can draw.
  const start = await tab.drawn();
  await eventually(async () => (await tab.drawn()) >= start + WARM, 'it moves');
  const [from, since] = [await tab.drawn(), performance.now()];
  await eventually(async () => (await tab.drawn()) >= from + PICTURES, 'it goes on');
  const perSecond = (await tab.drawn() - from) / ((performance.now() - since) / 1e3);
  assert.notDeepEqual(await tab.page.evaluate(() => [...window.nappe.positions().slice(0, 300)]), before);
  assert.ok(perSecond > 0.5, `${perSecond} pictures per second`);
  // Words and plots change less often than the picture.
  await eventually(async () => /^\d+ pictures?\/s[\d.]+ [kM]?B\/s[\d,]+ left out/.test(await tab.text('corner')), 'what the line carries is said');
  const plots = () => tab.page.evaluate(() => [...document.querySelectorAll('.plot .uplot')].map((plot) => plot.getAttribute('aria-label')));
  const whole = (label) => /over time from .* to .* s: .* from .* to /.test(label);
  await eventually(async () => (await plots()).length >= 2 && (await plots()).every(whole), 'plots are drawn');
  await eventually(async () => /Time of a step[\d.]+ ms.*force.*solve/.test(await tab.text('stages')), 'stages of a step are shown');
  await tab.page.keyboard.press(' ');
  return Number(perSecond.toFixed(1));
}

/** Follow, Edges, Theme and Reset view, by button and by key. */
async function views({ page }) {
  const pressed = (id) => page.getAttribute(`#${id}`, 'aria-pressed');
  const theme = () => page.evaluate(() => document.documentElement.dataset.theme);
  await page.click('#wireframe');
  assert.equal(await pressed('wireframe'), 'true');
  await page.keyboard.press('w');
  assert.equal(await pressed('wireframe'), 'false');
  const was = await theme();
  await page.keyboard.press('t');
  assert.notEqual(await theme(), was);
  await page.click('#theme');
  assert.equal(await theme(), was);
  await page.keyboard.press('f');
  assert.equal(await page.textContent('#follow'), 'Follow cloth');
  await page.keyboard.press('f');
  assert.equal(await page.textContent('#follow'), 'Follow');

  const camera = () => page.evaluate(() => window.nappe.session.picture.view.camera());
  await page.keyboard.press('Shift+ArrowLeft');
  assert.notEqual(await camera(), null, 'the view was moved');
  await page.click('#home');
  assert.equal(await camera(), null, 'it is that from the start');
  await page.keyboard.press('h');
  assert.ok(await page.isVisible('#help'));
  await page.keyboard.press('h');
}

/** What snow carries is asked for once its colours are. */
async function colors(tab, server) {
  const { page } = tab;
  await server.client.step('snow', 60, { wait: true });
  await eventually(async () => (await tab.text('frame')) === 'step 60', 'the steps of another client are shown');
  assert.equal(await page.isVisible('#legend'), false);
  await page.click('#colors');
  assert.equal(await page.getAttribute('#colors', 'aria-pressed'), 'true');
  assert.match(await tab.text('legend'), /plastic ratio/);
  await eventually(() => page.evaluate(() => window.nappe.session.newest.fields.plastic_ratio !== undefined), 'frames have them');
  await page.keyboard.press('c');
  assert.equal(await page.isVisible('#legend'), false);
}

/** A collider of triangles is drawn: without it, pixels are others. */
async function mesh(browser, server, line) {
  await server.client.create({ scene: 'cloth_on_torus', sessionId: 'ring', stepLimit: 0n });
  const tab = await open(browser, `${line.address}?session=ring`, { viewport: { width: 800, height: 600 }, colorScheme: 'dark' });
  await tab.ready();
  const { kinds, share } = await tab.page.evaluate(() => {
    const { stage, view } = window.nappe.session.picture;
    const meshes = view.scene.colliders.flatMap(({ shape }, index) => (shape.kind === 'mesh' ? [view.colliders.objects[index]] : []));
    const shown = stage.pixels();
    for (const mesh of meshes) mesh.visible = false;
    const bare = stage.pixels();
    for (const mesh of meshes) mesh.visible = true;
    const others = shown.filter((value, at) => at % 4 === 1 && Math.abs(value - bare[at]) > 16);
    return { kinds: view.scene.colliders.map(({ shape }) => shape.kind), share: others.length / (shown.length / 4) };
  });
  assert.ok(kinds.includes('mesh') && share > 0.005, `${kinds}: ${share} of the pixels show it`);
  await tab.leave();
}

/** A box that keys turn, below a sheet that hangs by two corners. */
const TURNING = `
version = 1
dt = 0.01

[[body]]
name = "sheet"
mesh = { grid = [6, 6], spacing = 0.1 }
mass = { density = 0.2 }
pins = ["top_left", "top_right"]
springs = { stretch = { stiffness = 50, damping = 0.02 }, shear = { stiffness = 20, damping = 0.01 } }

[[collider]]
name = "box"
box = { center = [0.25, -0.8, 0.3], size = [0.3, 0.1, 0.2] }

[[collider.key]]
time = 0
position = [0.25, -0.8, 0.3]

[[collider.key]]
time = 0.2
position = [0.25, -0.6, 0.3]
turn = [0, 1, 0, 1]
`;

/** A box that turns is drawn in frames 0, 10 and 20 where they say that it is. */
async function turning(browser, server, line) {
  await server.client.create({ sceneText: TURNING, sessionId: 'turning', stepLimit: 0n, frameIntervalSteps: 1 });
  const tab = await open(browser, `${line.address}?session=turning`, { viewport: { width: 800, height: 600 }, colorScheme: 'dark' });
  await tab.ready();
  for (const frame of [0, 10, 20]) {
    if (frame > 0) await server.client.step('turning', 10, { wait: true });
    await eventually(() => tab.page.evaluate((frame) => Number(window.nappe.session.live.shown?.frame ?? -1) === frame, frame), `frame ${frame} is drawn`);
    const { poses, turn, at } = await tab.page.evaluate(() => {
      const { picture: { view }, live: { shown } } = window.nappe.session;
      const [{ quaternion, position }] = view.colliders.objects;
      return { poses: shown.poses, turn: quaternion.toArray(), at: position.toArray().map((part, axis) => part + view.origin[axis]) };
    });
    const [half, share] = [(Math.PI / 4) * (frame / 20), frame / 20];
    const expected = { name: 'box', position: [0.25, -0.8 + 0.2 * share, 0.3], turn: [0, Math.sin(half), 0, Math.cos(half)] };
    assert.deepEqual(poses.map(({ name }) => name), ['box']);
    for (const [found, numbers] of [[poses[0].position, expected.position], [poses[0].turn, expected.turn], [at, expected.position], [turn, expected.turn]]) {
      assert.ok(found.every((part, axis) => Math.abs(part - numbers[axis]) < 1e-9), `frame ${frame}: ${found}, not ${numbers}`);
    }
  }
  await tab.leave();
}

/** 360 pixels of width: nothing is cut off, and all that is pressed is large enough. */
async function narrow(browser, line, shoot) {
  for (const [path, name] of [['?session=cloth', 'session-narrow'], ['', 'list-narrow']]) {
    const tab = await open(browser, line.address + path, { viewport: { width: 360, height: 640 }, colorScheme: 'light' });
    await tab.ready();
    assert.ok(await tab.page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), `${name} is wider than the screen`);
    await fingers(tab.page, name);
    await shoot(tab.page, name);
    if (path !== '') {
      await tab.page.click('#more');
      await fingers(tab.page, `${name}, more`);
      for (const id of ['rate', 'home', 'theme', 'fork', 'delete', 'help-open']) assert.ok(await tab.page.isVisible(`#${id}`), `${name}: ${id}`);
      await shoot(tab.page, `${name}-more`);
    }
    await tab.leave();
  }
}

async function fingers(page, name) {
  const small = await page.evaluate((least) => [...document.querySelectorAll('button, select, summary, .card, .up')].flatMap((target) => {
    const { width, height } = target.getBoundingClientRect();
    return width === 0 || (width >= least && height >= least) ? [] : [`${target.id || target.textContent}: ${width} x ${height}`];
  }), FINGER);
  assert.deepEqual(small, [], name);
}
