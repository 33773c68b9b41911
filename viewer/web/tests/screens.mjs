// Opens a recording on screens from a phone to a wall, light and dark, and uses every control:
// node tests/screens.mjs FILE.html. CHROMIUM names the browser.

import assert from 'node:assert/strict';
import { readFile } from 'node:fs/promises';
import { resolve } from 'node:path';
import { pathToFileURL } from 'node:url';
import { alone, emptyWindow, isProgram } from './chromium.mjs';

/** The last is 1280 x 800 at a zoom of 200 %. */
const SCREENS = [[360, 640, 'dark'], [740, 360, 'light'], [1280, 800, 'dark'], [1280, 800, 'light'], [2560, 1440, 'light'], [640, 400, 'dark']];
/** Least width and height of what a finger presses (CSS pixels). */
const FINGER = 44;
/** What does not play stands still for so many pictures of the screen, of which each shows another frame where it plays. */
const STILL = 20;

let browser;
let url;

export async function screens(shared, file) {
  browser = shared;
  url = pathToFileURL(resolve(file)).href;
  const sizes = {};
  for (const [width, height, colorScheme] of SCREENS) sizes[width] = await screen({ viewport: { width, height }, colorScheme });
  assert.ok(sizes[2560] > 1.2 * sizes[1280] && sizes[1280] === sizes[360], `text grows on wide screens: ${JSON.stringify(sizes)}`);
  const { page, close } = await opened({ viewport: { width: 1280, height: 800 } });
  await controls(page);
  await saves(page);
  await close();
  await links();
  return { screens: SCREENS.length };
}

/** Opens the page, paused, and fails at anything that a script throws. */
async function opened(options = {}, hash = '') {
  const watch = () => {
    window.contexts = new Set();
    const original = HTMLCanvasElement.prototype.getContext;
    HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
      const made = original.call(this, kind, ...rest);
      if (kind.startsWith('webgl')) window.contexts.add(made);
      return made;
    };
  };
  const { page, leave } = await emptyWindow(browser, { ...options, scripts: [[watch]] });
  const errors = [];
  page.on('pageerror', (error) => errors.push(String(error)));
  await page.goto(url + hash);
  await page.evaluate(() => window.nappe.ready);
  return { page, close: async () => { await leave(); assert.deepEqual(errors, []); } };
}

/** Checks a screen, and gives the size of its text (pixels). */
async function screen(options) {
  const { page, close } = await opened(options);
  const name = `${options.viewport.width} x ${options.viewport.height}, ${options.colorScheme}`;
  await page.evaluate(() => window.nappe.seek(3));
  assert.equal(await page.evaluate(() => window.contexts.size), 1, `${name}: WebGL contexts`);
  await uncovered(page, name);
  await fingers(page, name);
  assert.equal(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), true, `${name}: it is wider than the screen`);
  if (await page.isVisible('#more')) {
    await page.click('#more');
    await fingers(page, `${name}, more`);
    await uncovered(page, `${name}, more`);
    await page.keyboard.press('Escape');
    assert.equal(await page.isVisible('#save-numbers'), false, `${name}: the list closes`);
  }
  const panel = await page.evaluate(() => getComputedStyle(document.querySelector('#controls')).backgroundColor);
  const brightness = panel.match(/\d+/g).slice(0, 3).reduce((sum, channel) => sum + Number(channel), 0) / 3;
  assert.equal(brightness > 128, options.colorScheme === 'light', `${name}: the panel is ${panel}`);
  const size = await page.evaluate(() => parseFloat(getComputedStyle(document.querySelector('#frame')).fontSize));
  await close();
  return size;
}

/** Nothing lies over the title and the time, and both are within the screen. */
async function uncovered(page, name) {
  const over = await page.evaluate(() => ['title', 'time', 'frame'].flatMap((id) => {
    const { left, right, top, bottom } = document.getElementById(id).getBoundingClientRect();
    const spots = [[left + 2, top + 2], [right - 2, top + 2], [left + 2, bottom - 2], [right - 2, bottom - 2], [(left + right) / 2, (top + bottom) / 2]];
    const info = document.querySelector('.info');
    info.style.pointerEvents = 'auto';
    const found = spots.map(([x, y]) => document.elementFromPoint(x, y)).filter((seen) => seen === null || seen.closest('.info') === null);
    info.style.pointerEvents = '';
    return found.map((seen) => `${id} is under ${seen === null ? 'the edge' : seen.id || seen.className}`);
  }));
  assert.deepEqual(over, [], name);
}

/** What is pressed is large enough. */
async function fingers(page, name) {
  const small = await page.evaluate((least) => [...document.querySelectorAll('button, select, summary, input')].flatMap((target) => {
    const { width, height } = target.getBoundingClientRect();
    if (width === 0 || (width >= least && height >= least)) return [];
    return [`${target.id || target.textContent}: ${width} x ${height}`];
  }), FINGER);
  assert.deepEqual(small, [], name);
}

async function controls(page) {
  const pressed = (id) => page.getAttribute(`#${id}`, 'aria-pressed');
  const theme = () => page.evaluate(() => document.documentElement.dataset.theme);
  const before = await theme();
  await page.keyboard.press('t');
  assert.notEqual(await theme(), before, 'a key switches light and dark');
  await page.click('#theme');
  assert.equal(await theme(), before, 'and a button');

  await page.keyboard.press('f');
  assert.equal(await pressed('follow'), 'true');
  assert.match(await page.textContent('#follow'), /^Follow ./);
  while ((await pressed('follow')) === 'true') await page.keyboard.press('f');

  await page.keyboard.press('End');
  await page.selectOption('#speed', '0.05');
  await page.keyboard.press('.');
  assert.equal(await page.inputValue('#speed'), '0.1');
  await page.selectOption('#speed', '4');
  await page.keyboard.press('o');
  assert.equal(await pressed('loop'), 'true');
  // From the end it starts over, and again at the end, which a run without a loop does not.
  await page.focus('#canvas');
  const last = Number(await page.getAttribute('#scrub', 'max'));
  await page.evaluate((index) => window.nappe.seek(index), last - 1);
  await page.keyboard.press(' ');
  await page.waitForFunction((index) => Number(document.querySelector('#scrub').value) < index - 5, last, { timeout: 20_000 });
  assert.equal(await page.getAttribute('#play', 'aria-label'), 'Pause', 'a loop plays on');
  await page.keyboard.press(' ');

  const log = page.locator('.plot .scale').first();
  const was = await log.getAttribute('aria-pressed');
  await log.click();
  assert.notEqual(await log.getAttribute('aria-pressed'), was);
  const labels = await page.evaluate(() => [...document.querySelectorAll('.plot .uplot')].map((plot) => plot.getAttribute('aria-label')));
  assert.ok(labels.length >= 2 && labels.every((label) => /over time from .* to .* s: .* from .* to /.test(label)), `${labels}`);
  const dashes = await page.evaluate(() => [...document.querySelector('.plot').querySelectorAll('line')].map((line) => line.getAttribute('stroke-dasharray')));
  assert.equal(new Set(dashes).size, dashes.length, 'lines differ without their colours');
}

/** Waits for so many pictures of the screen. */
const pictures = (page, count) => page.evaluate((most) => new Promise((done) => {
  const next = (left) => (left === 0 ? done() : requestAnimationFrame(() => next(left - 1)));
  next(most);
}), count);

async function links() {
  const { page, close } = await opened();
  await page.evaluate(() => window.nappe.seek(5));
  await page.waitForFunction(() => location.hash.startsWith('#t='));
  assert.ok(!page.url().includes('view='), 'the view from the start is not said');
  await page.keyboard.press('Shift+ArrowLeft');
  await page.waitForFunction(() => location.hash.includes('view='));
  const { hash } = new URL(page.url());
  const shown = await page.textContent('#time');
  await close();

  const again = await opened({ reducedMotion: 'no-preference' }, hash);
  assert.equal(await again.page.textContent('#time'), shown, 'a link leads to its time, and nothing plays');
  assert.equal(await again.page.getAttribute('#play', 'aria-label'), 'Play');
  await pictures(again.page, STILL);
  assert.equal(await again.page.textContent('#time'), shown, 'nor later');
  await again.page.evaluate(() => window.nappe.seek(6));
  await again.page.waitForFunction((before) => location.hash !== before, hash);
  const view = (link) => new URLSearchParams(link.slice(1)).get('view').split(',').map(Number);
  const [wanted, found] = [view(hash), view(new URL(again.page.url()).hash)];
  assert.ok(wanted.every((number, i) => Math.abs(number - found[i]) < 1e-4), `a link leads to its view: ${wanted}; ${found}`);
  await again.page.evaluate(() => (location.hash = '#t=0'));
  await again.page.waitForFunction(() => document.querySelector('#scrub').value === '0');
  await again.close();
}

async function saves(page) {
  const saved = async (id) => {
    await page.evaluate(() => document.querySelector('#saves').classList.contains('open') || document.querySelector('#save').click());
    const [file] = await Promise.all([page.waitForEvent('download'), page.click(`#${id}`)]);
    return { name: file.suggestedFilename(), bytes: await readFile(await file.path()) };
  };
  const numbers = await saved('save-numbers');
  assert.match(numbers.name, /^[^/]+\.csv$/);
  const lines = numbers.bytes.toString('utf8').trim().split('\n');
  assert.equal(lines.length - 1, await page.evaluate(() => window.nappe.frameCount), 'a line for each frame');

  const picture = await saved('save-picture');
  assert.match(picture.name, /s\.png$/);
  const lit = await page.evaluate(async (base64) => {
    const image = new Image();
    image.src = `data:image/png;base64,${base64}`;
    await image.decode();
    const canvas = Object.assign(document.createElement('canvas'), { width: image.width, height: image.height });
    const context = canvas.getContext('2d');
    context.drawImage(image, 0, 0);
    const { data } = context.getImageData(0, 0, image.width, image.height);
    let others = 0;
    for (let i = 0; i < data.length; i += 4) others += Math.abs(data[i] - data[0]) > 8 ? 1 : 0;
    return others / (data.length / 4);
  }, picture.bytes.toString('base64'));
  assert.ok(lit > 0.02, `${lit} of the saved picture is not background`);

  const text = await page.textContent('#source-text');
  const scene = await saved('save-scene');
  assert.deepEqual([scene.name.endsWith('.toml'), scene.bytes.toString('utf8')], [true, text]);
}

if (isProgram(import.meta.url)) await alone((made) => screens(made, process.argv[2]));
