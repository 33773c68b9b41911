// Opens recordings that are cut off, empty, hostile, or of a run that failed, or whose colliders are meshes or turn, and
// browsers that lack something: node tests/odd.mjs FILE.html.
// FILE is a recording of several blocks. CHROMIUM names the browser.

import assert from 'node:assert/strict';
import { mkdtemp, readFile, rm, writeFile } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { pathToFileURL } from 'node:url';
import UPNG from 'upng-js';
import { alone, blind, emptyWindow, isProgram, silence } from './chromium.mjs';
import { mesh, sample } from './sample.mjs';
import { ball } from './solids.mjs';

const CUTS = 20;
/** Of the cut recordings every so many is drawn, and plays; all are read. */
const DRAWN = 5;
/** Two colours are another if red, green or blue differ by more, of 255. */
const OTHER = 24;
/** From above one side. */
const VIEW = '#t=0&view=3,2,4,0,0.6,0.5';
const ELEMENT = /<script type="application\/json" class="nappe-(\w+)">(.*)<\/script>\n/g;

let text;
let elements;
let start;
let folder;
/** Windows with WebGL and without, which are used for one file after another. */
let seeing;
let unseeing;
/** Files that were opened. */
let files = 0;

export async function odd(browser, file) {
  text = await readFile(file, 'utf8');
  elements = [...text.matchAll(ELEMENT)].map((match) => (
    { kind: match[1], json: match[2], start: match.index, end: match.index + match[0].length }
  ));
  start = elements[0].start;
  folder = await mkdtemp(join(tmpdir(), 'nappe-page-'));
  const size = { viewport: { width: 820, height: 500 } };
  seeing = await emptyWindow(browser, size);
  unseeing = await emptyWindow(browser, { ...size, scripts: [[blind]] });
  try {
    for (const part of [cuts, empty, hostile, ended, scaled, meshes, poses, lacking]) await part();
    for (const window of [seeing, unseeing]) await window.leave();
  } finally {
    await rm(folder, { recursive: true });
  }
  return { cuts: CUTS, blocks: elements.filter(({ kind }) => kind === 'block').length };
}

/**
 * What a page says of a file: its frames, its message, its plots, and whether a script of the file ran. `before` runs before it,
 * `then` in it, and `look` outside, with the page. With `plays` it plays at once. In the dark there is no WebGL.
 */
async function opened(content, options = {}) {
  const { before = () => {}, then = () => null, look = () => null, hash = '', plays = false, dark = false } = options;
  const file = join(folder, `odd-${files++}.html`);
  await writeFile(file, content);
  const { page } = dark ? unseeing : seeing;
  const errors = [];
  page.on('pageerror', (error) => errors.push(String(error)));
  page.on('dialog', (dialog) => { errors.push('a script of the file ran'); void dialog.dismiss(); });
  const added = await page.addInitScript(before);
  await page.emulateMedia({ reducedMotion: plays ? 'no-preference' : 'reduce' });
  await page.goto(pathToFileURL(file).href + hash);
  const frames = await page.evaluate(async () => {
    await window.nappe?.ready;
    return window.nappe?.frameCount ?? 0;
  });
  const message = (await page.isVisible('#message')) ? await page.textContent('#message') : '';
  const body = await page.evaluate(() => document.body.innerText);
  const banner = (await page.isVisible('#banner')) ? await page.textContent('#failure') : '';
  const plots = await page.evaluate(() => [...document.querySelectorAll('.plot .uplot')].map((plot) => plot.getAttribute('aria-label')));
  const more = await page.evaluate(then);
  const looked = await look(page);
  await page.goto('about:blank');
  silence(page);
  await added.dispose();
  await rm(file);
  assert.deepEqual(errors, []);
  return { frames, message, body, banner, plots, more, looked };
}

/** The same of a file of which nothing is to be drawn. */
const read = (content) => opened(content, { dark: true });

/** The picture of a page at each of these frames, as it is saved: always as fine as can be, and without what stands before it. */
const pictures = (frames) => async (page) => {
  const all = [];
  for (const frame of frames) {
    await page.evaluate((index) => window.nappe.seek(index), frame);
    const [file] = await Promise.all([page.waitForEvent('download'), page.evaluate(() => document.getElementById('save-picture').click())]);
    all.push(await readFile(await file.path()));
  }
  return all;
};

async function cuts() {
  let seed = 7;
  for (let index = 0; index < CUTS; index++) {
    seed = (seed * 48271) % 0x7fffffff;
    const at = start + Math.floor((seed / 0x7fffffff) * (text.length - start));
    const whole = elements.filter(({ kind, end }) => kind === 'block' && end <= at + 1);
    const expected = whole.reduce((sum, { json }) => sum + JSON.parse(json).frames.length, 0);
    const options = index % DRAWN === 0 ? { plays: true } : { dark: true };
    const { frames, message, body } = await opened(text.slice(0, at), options);
    assert.equal(frames, expected, `cut at ${at}`);
    if (frames > 0) assert.match(body, /cut off/, `cut at ${at}`);
    else assert.notEqual(message, '', `cut at ${at}: nothing is said`);
  }
}

async function empty() {
  const [head, block] = [elements[0], elements[1]];
  const end = elements.at(-1);
  const none = await opened(text.slice(0, head.end) + text.slice(end.start), { plays: true });
  assert.equal(none.frames, 0);
  assert.notEqual(none.message, '', 'a file without a frame says nothing');
  const first = JSON.parse(block.json);
  const one = element('block', { ...first, frames: first.frames.slice(0, 1) });
  const single = await opened(text.slice(0, head.end) + one + text.slice(end.start), { plays: true });
  assert.deepEqual([single.frames, single.message], [1, '']);
}

function element(kind, value) {
  const json = JSON.stringify(value).replaceAll('<', '\\u003c');
  return `<script type="application/json" class="nappe-${kind}">${json}</script>\n`;
}

async function hostile() {
  const title = '</script><script>alert(1)</script><img src=x onerror=alert(2)>';
  const head = { ...JSON.parse(elements[0].json), title };
  const { frames, body } = await read(text.slice(0, start) + element('head', head) + text.slice(elements[0].end));
  assert.ok(frames > 0 && body.includes(title), 'the title is text');
}

/** The recording with another end, and with what is done to its frames. */
function changed(end, change = (frames) => frames) {
  const blocks = elements.filter(({ kind }) => kind === 'block').slice(0, 1).map(({ json }) => {
    const block = JSON.parse(json);
    return element('block', { ...block, frames: change(block.frames) });
  });
  const { failure } = end;
  return text.slice(0, elements[0].end) + blocks.join('') + element('end', { frames: 1, steps: 0, hash: null, finished: false, failure, ...end });
}

async function ended() {
  const evil = '<img src=x onerror=alert(3)>';
  const failure = { reason: 'NOT_FINITE', message: `it diverged ${evil}`, diverged: true, step: 218, time: 0.545, particle: 23, value: null };
  const diverged = await opened(changed({ failure }), {
    plays: true, then: () => [window.nappe.litShare() > 0, document.querySelector('#scrub').max],
  });
  assert.equal(diverged.banner, 'Diverged at 0.545 s: step 218, particle 23 (NOT_FINITE)');
  assert.ok(diverged.body.includes(evil) && !diverged.body.includes('went on'), diverged.body);
  assert.deepEqual(diverged.more, [true, String(diverged.frames - 1)], 'the slider ends with the frames');

  const first = await opened(changed({ failure: { ...failure, step: 0, time: 0, particle: null } }, (frames) => frames.slice(0, 1)), { plays: true });
  assert.deepEqual([first.frames, first.banner, first.message], [1, 'Diverged at 0 s: step 0 (NOT_FINITE)', '']);
  const lost = await read(changed({ failure: { ...failure, reason: 'RANK_LOST', diverged: false } }));
  assert.match(lost.banner, /^Failed at .*RANK_LOST/);
  const nonsense = await read(changed({ failure: { ...failure, particle: 1e9 } }));
  assert.match(nonsense.message, /particle of the failure/);

  const paused = await read(changed({}));
  assert.equal(paused.banner, '');
  assert.match(paused.body, /Recorded up to step \d+, before the session's end/);
  const whole = await read(changed({ finished: true }));
  assert.ok(whole.banner === '' && !whole.body.includes('Recorded up to'), whole.body);
  await exploded();
}

/** Energies up to 10^40 J: each plot has labels, and the energies a logarithm. */
async function exploded() {
  const energies = (frames) => frames.map((frame, i) => ({ ...frame, kinetic: 10 ** (40 * i / frames.length), elastic: 3, gravitational: -(10 ** ((30 * i) / frames.length)) }));
  const huge = await read(changed({}, energies));
  assert.match(huge.plots[0], /^Energy \(J\), logarithmic, over time from .* s: kinetic from 1 to .*e3\d; elastic from 3 to 3/);
  const alike = await read(changed({}, (frames) => frames.map((frame, i) => ({ ...frame, kinetic: 1e40 * (1 + i), elastic: 1e40, gravitational: 1e40 }))));
  assert.ok(!alike.plots[0].includes('logarithmic'), alike.plots[0]);
}

/** Colours have the scale of all frames, also while the first is shown. */
async function scaled() {
  const speeds = sample(text.slice(0, start), { frames: 40, side: 8, color: 'speed' });
  const { more } = await opened(speeds, { then: async () => {
    const legend = () => [...document.querySelectorAll('#legend .labels span')].map((label) => label.textContent).join(' ');
    await window.nappe.seek(0);
    // The frames are read for it after the first is shown.
    for (let wait = 0; wait < 100 && legend() !== '0 58.5'; wait++) await new Promise((done) => setTimeout(done, 50));
    return legend();
  } });
  assert.equal(more, '0 58.5', 'the largest speed is 39 x 1.5');
}

/** A ball of triangles is seen as an exact one, where the light falls on it too; what is no mesh is said. */
async function meshes() {
  const recording = sample(text.slice(0, start), { frames: 2, side: 8, snowy: false });
  const [line, json] = recording.match(/<script type="application\/json" class="nappe-head">(.*)<\/script>\n/);
  const head = JSON.parse(json);
  const made = (...shapes) => {
    const colliders = shapes.map((shape, index) => ({ name: `${index}`, velocity: [0, 0, 0], shape }));
    return recording.replace(line, () => element('head', { ...head, colliders }));
  };
  const seen = async (...shapes) => (await opened(made(...shapes), { hash: VIEW, look: pictures([0]) })).looked[0];
  const plane = { kind: 'plane', point: [0, 0, 0], normal: [0, 1, 0] };
  const bare = await seen(plane);
  const [center, radius] = [[-0.2, 0.6, 0.5], 0.4];
  const [exact, near] = [await seen(plane, { kind: 'sphere', center, radius }), await seen(plane, mesh(ball(center, radius, 4)))];
  const [shown, apart] = [share(bare, exact), share(exact, near)];
  assert.ok(shown > 0.03 && apart < 0.05 * shown, `${shown} of the pixels show the ball, and ${apart} differ from it`);

  const whole = mesh(ball(center, radius, 0));
  const broken = {
    'collider 0 has no triangles': { ...whole, triangles: null },
    'triangles of collider 0 name points that it has not': { ...whole, points: mesh({ points: [[0, 0, 0]], triangles: [[0, 0, 0]] }).points },
    'points of collider 0 take 16 bytes, no multiple of 12': { ...whole, points: Buffer.alloc(16).toString('base64') },
    'a point of collider 0 is not finite': mesh({ points: [[0, 0, NaN], [1, 0, 0], [0, 1, 0]], triangles: [[0, 1, 2]] }),
  };
  for (const [what, shape] of Object.entries(broken)) {
    const { frames, message } = await read(made(shape));
    assert.ok(frames === 0 && message.includes(what), `${what}: ${message}`);
  }
}

/** A box that turns is seen, in frames 0, 10 and 20, as one that begins so and stands still; what is no pose is said. */
async function poses() {
  const recording = sample(text.slice(0, start), { frames: 21, side: 8, snowy: false });
  // Below the bodies, where it hides nothing: the light comes from the side from which most is seen.
  const center = [-0.2, -0.8, 0.5];
  const axes = (angle) => ({ axis_x: [Math.cos(angle), 0, -Math.sin(angle)], axis_y: [0, 1, 0] });
  const solid = (at, angle) => ({ name: 'box', velocity: [0, 0, 0], shape: { kind: 'box', center: at, half_extent: [0.5, 0.2, 0.1], ...axes(angle) } });
  const place = (frame) => ({ at: [center[0] + 0.02 * frame, center[1], center[2]], angle: (Math.PI / 2) * (frame / 20) });
  const pose = ({ frame }) => {
    const { at, angle } = place(frame);
    return { name: 'box', position: at, turn: [0, Math.sin(angle / 2), 0, Math.cos(angle / 2)] };
  };
  const changed = (colliders, told) => recording.replace(ELEMENT, (line, kind, json) => {
    const value = JSON.parse(json);
    if (kind === 'head') return element(kind, { ...value, colliders });
    return kind === 'block' ? element(kind, { ...value, frames: value.frames.map((frame) => ({ ...frame, ...told(frame) })) }) : line;
  });
  const moved = changed([solid(center, 0)], (frame) => ({ poses: [pose(frame)] }));
  const frames = [0, 10, 20];
  const { looked: shots } = await opened(moved, { hash: VIEW, look: pictures(frames) });
  for (const [i, frame] of frames.entries()) {
    const { at, angle } = place(frame);
    const still = await opened(changed([solid(at, angle)], () => ({})), { hash: VIEW, look: pictures([frame]) });
    const apart = share(shots[i], still.looked[0]);
    assert.ok(apart < 1e-3, `frame ${frame}: ${apart} of the pixels differ`);
  }
  assert.ok(share(shots[0], shots[1]) > 0.01 && share(shots[1], shots[2]) > 0.01, 'it turns');

  const wrong = await read(changed([solid(center, 0)], () => ({ poses: [{ name: 'box', position: center, turn: [0, 0, 0, 2] }] })));
  assert.match(wrong.message, /turn of box is no quaternion of length 1/);
}

/** Share of the pixels whose colours differ. */
function share(one, other) {
  const [a, b] = [one, other].map((png) => new Uint8Array(UPNG.toRGBA8(UPNG.decode(png))[0]));
  assert.equal(a.length, b.length);
  let differ = 0;
  for (let at = 0; at < a.length; at += 4) differ += [0, 1, 2].some((color) => Math.abs(a[at + color] - b[at + color]) > OTHER) ? 1 : 0;
  return (4 * differ) / a.length;
}

async function lacking() {
  const inflate = await opened(text, { before: () => { delete window.DecompressionStream; } });
  assert.match(inflate.body, /DecompressionStream|decompress/i);
  const graphics = await opened(text, { dark: true, then: async () => {
    await window.nappe.seek(3);
    return document.querySelector('#scrub').value;
  } });
  assert.match(graphics.message, /WebGL 2 is missing/);
  assert.ok(graphics.frames > 0 && graphics.plots.length >= 2, 'the plots work without it');
  assert.equal(graphics.more, '3', 'they follow the slider');
}

if (isProgram(import.meta.url)) await alone((browser) => odd(browser, process.argv[2]));
