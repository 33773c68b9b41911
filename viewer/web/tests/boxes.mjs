// Opens recordings on three screens and counts pixels of bodies under the boxes that stand before the picture:
// node tests/boxes.mjs FILE.html ... Prints a line of JSON. CHROMIUM names the browser.

import assert from 'node:assert/strict';
import { basename, resolve } from 'node:path';
import { pathToFileURL } from 'node:url';
import { alone, emptyWindow, isProgram } from './chromium.mjs';

const SCREENS = [[1280, 800], [900, 640], [360, 640]];
/** Frames of each recording, from its first to its last. */
const FRAMES = 20;
/** A pixel belongs to a body if it covers more of the background than this, of 255. */
const COVERED = 3;
/** Of the picture: less of a body is no sign that one is drawn at all. */
const LEAST_SHARE = 5e-5;
/** Snow before a light background: share of its pixels whose red, green or blue differs by so much, of 255. */
const LEAST_SEEN = 0.6;
const OTHER = 10;

/** Counts in all files, on all screens. */
export async function boxes(browser, files) {
  const report = {};
  for (const file of files) report[basename(file, '.html')] = await recording(browser, pathToFileURL(resolve(file)).href);
  return report;
}

async function recording(browser, url) {
  const shares = [];
  let light = null;
  for (const [width, height] of SCREENS) {
    const { page, leave } = await emptyWindow(browser, { viewport: { width, height }, colorScheme: 'light' });
    const errors = [];
    page.on('pageerror', (error) => errors.push(String(error)));
    await page.goto(url);
    await page.evaluate(() => window.nappe.ready);
    for (const { frame, under, share } of await count(page)) {
      const where = `${url}, ${width} x ${height}, frame ${frame}`;
      assert.deepEqual(under, {}, `${where}: pixels of bodies under boxes`);
      shares.push(share);
      assert.ok(share > LEAST_SHARE, `${where}: ${share} of the picture shows bodies`);
    }
    await lines(page, `${url}, ${width} x ${height}`);
    if (light === null) light = await contrast(page);
    await leave();
    assert.deepEqual(errors, []);
  }
  if (light !== null) assert.ok(light > LEAST_SEEN, `${url}: ${light} of the snow differs from what is light behind it`);
  const mean = shares.reduce((sum, share) => sum + share, 0) / shares.length;
  return { mean_share: Number(mean.toFixed(4)), ...(light === null ? {} : { seen: Number(light.toFixed(3)) }) };
}

/** Pixels of bodies under each box, in frames from the first to the last. */
const count = (page) => page.evaluate(async ([frames, covered]) => {
  const canvas = document.getElementById('canvas');
  const last = window.nappe.frameCount - 1;
  const found = [];
  for (let i = 0; i < frames; i++) {
    const frame = Math.round((i * last) / (frames - 1));
    await window.nappe.seek(frame);
    // Boxes that changed with the frame are heard of by then.
    await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
    const pixels = window.nappe.bodyPixels();
    const { width, height } = canvas;
    const picture = canvas.getBoundingClientRect();
    const covers = (x, y) => pixels[4 * ((height - 1 - y) * width + x) + 3] > covered;
    const under = {};
    for (const box of document.querySelectorAll('.info, .legend, .corner')) {
      const { left, right, top, bottom } = box.getBoundingClientRect();
      const [x, y] = [width / picture.width, height / picture.height];
      const clipped = (at, most) => Math.min(Math.max(at, 0), most);
      const [first, end] = [left, right].map((at) => clipped(Math.round((at - picture.left) * x), width));
      const [upper, lower] = [top, bottom].map((at) => clipped(Math.round((at - picture.top) * y), height));
      let sum = 0;
      for (let row = upper; row < lower; row++) for (let column = first; column < end; column++) sum += covers(column, row) ? 1 : 0;
      if (sum > 0) under[box.className] = sum;
    }
    let all = 0;
    for (let at = 3; at < pixels.length; at += 4) all += pixels[at] > covered ? 1 : 0;
    found.push({ frame, under, share: all / (width * height) });
  }
  return found;
}, [FRAMES, COVERED]);

/** The title takes one line while it plays; what it is about opens beside the picture; pins are hidden by a key. */
async function lines(page, name) {
  const box = () => page.evaluate(() => document.querySelector('.info').getBoundingClientRect().height);
  const rest = await box();
  const plays = await page.evaluate(() => {
    document.getElementById('app').classList.add('running');
    const { height } = document.querySelector('.info').getBoundingClientRect();
    document.getElementById('app').classList.remove('running');
    return height;
  });
  const noted = await page.isVisible('#end');
  assert.ok(noted || plays <= 50, `${name}: the title is ${plays} pixels high while it plays`);
  assert.ok(plays <= rest, `${name}: ${plays} pixels, and ${rest} while it stands`);

  await page.click('#about');
  assert.ok(await page.isVisible('#about-sheet'), name);
  const left = () => page.evaluate(() => document.getElementById('about-sheet').getBoundingClientRect().left);
  const covered = await page.evaluate(() => document.getElementById('canvas').getBoundingClientRect().right);
  if ((await page.viewportSize()).width > 800) assert.ok(await left() >= covered - 1, `${name}: it lies over the plots`);
  await page.keyboard.press('Escape');
  assert.equal(await page.isVisible('#about-sheet'), false, name);

  const pins = () => page.getAttribute('#pins', 'aria-pressed');
  if (await page.evaluate(() => document.getElementById('pins').hidden)) return;
  assert.equal(await pins(), 'true');
  await page.keyboard.press('p');
  assert.equal(await pins(), 'false');
  await page.keyboard.press('p');
}

/** Share of the pixels of snow, in the first frame, that differ from a picture without it; null where there is no snow. */
async function contrast(page) {
  if (await page.evaluate(() => document.getElementById('colors').hidden)) return null;
  await page.evaluate(() => window.nappe.seek(0));
  const parts = await page.evaluate(([covered, other]) => {
    const sky = getComputedStyle(document.documentElement).getPropertyValue('--sky').trim();
    const [red, green, blue] = [1, 3, 5].map((at) => parseInt(sky.slice(at, at + 2), 16));
    const pixels = window.nappe.bodyPixels();
    let [all, seen] = [0, 0];
    for (let at = 0; at < pixels.length; at += 4) {
      // Edges, which are half covered, are left out.
      if (pixels[at + 3] < 255 - covered) continue;
      all += 1;
      const apart = [red, green, blue].map((value, channel) => Math.abs(value - pixels[at + channel]));
      if (Math.max(...apart) > other) seen += 1;
    }
    return [all, seen];
  }, [COVERED, OTHER]);
  return parts[0] === 0 ? 0 : parts[1] / parts[0];
}

/** No bar to scroll lies below the plots, nor beside them, in a window of a notebook. */
export async function bars(browser, file) {
  const { page, leave } = await emptyWindow(browser, { viewport: { width: 1200, height: 760 } });
  await page.goto(pathToFileURL(resolve(file)).href);
  await page.evaluate(() => window.nappe.ready);
  await page.evaluate(() => window.nappe.seek(window.nappe.frameCount - 1));
  const found = await page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => {
    const side = document.getElementById('side');
    const [right, down] = [side.scrollWidth - side.clientWidth, side.scrollHeight - side.clientHeight];
    done({ bar: side.offsetHeight - side.clientHeight, right, down, plots: document.querySelectorAll('.plot').length });
  }))));
  await leave();
  assert.ok(found.plots >= 2 && found.bar === 0 && found.right <= 0 && found.down <= 0, `bars at the plots: ${JSON.stringify(found)}`);
  return found;
}

if (isProgram(import.meta.url)) await alone((browser) => boxes(browser, process.argv.slice(2)));
