// Opens a recording from disk in a headless Chromium and checks that it is drawn: node tests/browser.mjs FILE.html
// [--picture OUT.png --width W --height H --frame N] [--grid]. Prints a line of JSON. CHROMIUM names the browser.

import assert from 'node:assert/strict';
import { createHash } from 'node:crypto';
import { resolve } from 'node:path';
import { pathToFileURL } from 'node:url';
import { parseArgs } from 'node:util';
import { SMALL, alone, drawn, emptyWindow, isProgram } from './chromium.mjs';

const LEAST_LIT = 0.05;
/**
 * Lines of the ground are seen from all of these directions, as this share of the pixels of a window of this size. They look the
 * same after a quarter turn, and 13 directions of a circle are then all others: one every seven degrees of the quarter.
 */
const DIRECTIONS = 13;
const LEAST_GRID = 0.004;
const LARGE = { width: 1200, height: 760 };
/** The second picture that is compared with that of frame 0. */
const LATER = 100;
/** What stands before the picture. */
const HIDDEN = '#side, #controls, .info, .legend { visibility: hidden !important }';

if (isProgram(import.meta.url)) {
  const options = Object.fromEntries(['picture', 'width', 'height', 'frame'].map((name) => [name, { type: 'string' }]));
  options.grid = { type: 'boolean' };
  const { values, positionals: [file] } = parseArgs({ options, allowPositionals: true });
  assert.ok(file, 'a file is needed: node tests/browser.mjs FILE.html');
  await alone((browser) => shows(browser, file, values));
}

/** Opens a file; the page plays at once, as it does for who has not asked for less motion. */
export async function shows(browser, file, values = {}) {
  const url = pathToFileURL(resolve(file)).href;
  const size = values.picture === undefined ? SMALL : LARGE;
  const viewport = { width: Number(values.width ?? size.width), height: Number(values.height ?? size.height) };
  const losses = () => {
    window.contextLost = false;
    addEventListener('webglcontextlost', () => (window.contextLost = true), true);
  };
  const options = { viewport, reducedMotion: 'no-preference', sharp: values.picture !== undefined, scripts: [[losses]] };
  const { page, leave } = await emptyWindow(browser, options);
  const problems = watch(page, url);
  const report = await check(page, url, values);
  assert.deepEqual(problems, []);
  await leave();
  return report;
}

/** Collects what must not happen. */
function watch(page, url) {
  const problems = [];
  page.on('console', (message) => {
    if (['error', 'warning'].includes(message.type()) && !ofReadPixels(message)) problems.push(message.text());
  });
  page.on('pageerror', (error) => problems.push(String(error)));
  page.on('request', (request) => {
    if (request.url() !== url && !request.url().startsWith('data:')) problems.push(`a request of ${request.url()}`);
  });
  return problems;
}

/** Chromium says that reading pixels waits for the renderer, which is what `litShare` is for. */
function ofReadPixels(message) {
  return message.type() === 'warning' && message.text().includes('GPU stall due to ReadPixels');
}

async function check(page, url, values) {
  await page.goto(url);
  await page.evaluate(() => window.nappe.ready);
  const frames = await page.evaluate(() => window.nappe.frameCount);
  if (frames === 0) {
    const message = await page.textContent('#message');
    await save(page, values);
    return { frames, message };
  }

  const later = Math.min(LATER, frames - 1);
  const [first, second] = [await picture(page, 0), await picture(page, later)];
  if (later > 0) assert.notEqual(first, second, `frames 0 and ${later} look the same`);
  const lit = await page.evaluate(() => window.nappe.litShare());
  assert.ok(lit >= LEAST_LIT, `${lit} of the pixels are lit, less than ${LEAST_LIT}`);

  if (values.grid) await grid(page);

  const { renderer, seconds, bytes, finite } = await page.evaluate(async () => {
    const measured = await window.nappe.measure();
    return { ...measured, renderer: window.nappe.renderer, finite: window.nappe.positions().every(Number.isFinite) };
  });
  assert.ok(finite, 'positions are not finite');
  await page.evaluate((frame) => window.nappe.seek(frame), Number(values.frame ?? later));
  await save(page, values);
  assert.equal(await page.evaluate(() => window.contextLost), false, 'the graphics were lost');
  assert.equal(await page.isHidden('#message'), true, await page.textContent('#message'));
  return { renderer, frames, lit_share: Number(lit.toFixed(3)), decode_mb_per_second: Math.round(bytes / seconds / 1e6) };
}

/** A line is a pixel thick, so that its share depends on the size of the picture: it is that of a desk. */
async function grid(page) {
  const before = page.viewportSize();
  await page.setViewportSize(LARGE);
  await drawn(page);
  const { shares, half, whole } = await page.evaluate((directions) => {
    const shares = window.nappe.gridShares(directions);
    const { width, clientWidth } = document.getElementById('canvas');
    return { shares, half: width, whole: clientWidth };
  }, DIRECTIONS);
  assert.ok(whole > SMALL.width && half === Math.floor(whole / 2), `${half} pixels are drawn of ${whole}`);
  assert.ok(Math.min(...shares) >= LEAST_GRID, `lines of the grid change ${shares.map((share) => share.toFixed(4))} of the pixels`);
  await page.setViewportSize(before);
  await drawn(page);
}

/** The canvas at a frame, as a hash of its pixels, without the words before it, which are others in each frame. */
async function picture(page, frame) {
  await page.evaluate((index) => window.nappe.seek(index), frame);
  return createHash('sha256').update(await page.locator('#canvas').screenshot({ style: HIDDEN })).digest('hex');
}

async function save(page, values) {
  if (values.picture !== undefined) await page.screenshot({ path: values.picture });
}
