// Opens a recording from disk in a headless Chromium and checks that it is drawn: node tests/browser.mjs FILE.html
// [--picture OUT.png --width W --height H --frame N] [--grid]. Prints a line of JSON. CHROMIUM names the browser.

import assert from 'node:assert/strict';
import { createHash } from 'node:crypto';
import { resolve } from 'node:path';
import { pathToFileURL } from 'node:url';
import { parseArgs } from 'node:util';
import { chromium } from 'playwright-core';

const LEAST_LIT = 0.05;
/** Lines of the ground are seen from all of these directions, as this share of the pixels. */
const DIRECTIONS = 36;
const LEAST_GRID = 0.004;
/** The second picture that is compared with that of frame 0. */
const LATER = 100;

const options = Object.fromEntries(['picture', 'width', 'height', 'frame'].map((name) => [name, { type: 'string' }]));
options.grid = { type: 'boolean' };
const { values, positionals: [file] } = parseArgs({ options, allowPositionals: true });
assert.ok(file, 'a file is needed: node tests/browser.mjs FILE.html');
const url = pathToFileURL(resolve(file)).href;

const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium',
  args: ['--no-sandbox', '--enable-unsafe-swiftshader', '--use-angle=swiftshader'],
});
try {
  const viewport = { width: Number(values.width ?? 1200), height: Number(values.height ?? 760) };
  const page = await browser.newPage({ viewport });
  const problems = watch(page);
  const report = await check(page);
  assert.deepEqual(problems, []);
  console.log(JSON.stringify(report));
} finally {
  await browser.close();
}

/** Collects what must not happen. */
function watch(page) {
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

async function check(page) {
  await page.addInitScript(() => {
    window.contextLost = false;
    addEventListener('webglcontextlost', () => (window.contextLost = true), true);
  });
  await page.goto(url);
  await page.evaluate(() => window.nappe.ready);
  const frames = await page.evaluate(() => window.nappe.frameCount);
  if (frames === 0) {
    const message = await page.textContent('#message');
    await save(page);
    return { frames, message };
  }

  const later = Math.min(LATER, frames - 1);
  const [first, second] = [await picture(page, 0), await picture(page, later)];
  if (later > 0) assert.notEqual(first, second, `frames 0 and ${later} look the same`);
  const lit = await page.evaluate(() => window.nappe.litShare());
  assert.ok(lit >= LEAST_LIT, `${lit} of the pixels are lit, less than ${LEAST_LIT}`);

  if (values.grid) {
    const shares = await page.evaluate((directions) => window.nappe.gridShares(directions), DIRECTIONS);
    assert.ok(Math.min(...shares) >= LEAST_GRID, `lines of the grid change ${shares.map((share) => share.toFixed(4))} of the pixels`);
  }

  const { renderer, seconds, bytes, finite } = await page.evaluate(async () => {
    const measured = await window.nappe.measure();
    return { ...measured, renderer: window.nappe.renderer, finite: window.nappe.positions().every(Number.isFinite) };
  });
  assert.ok(finite, 'positions are not finite');
  await page.evaluate((frame) => window.nappe.seek(frame), Number(values.frame ?? later));
  await save(page);
  assert.equal(await page.evaluate(() => window.contextLost), false, 'the graphics were lost');
  assert.equal(await page.isHidden('#message'), true, await page.textContent('#message'));
  return { renderer, frames, lit_share: Number(lit.toFixed(3)), decode_mb_per_second: Math.round(bytes / seconds / 1e6) };
}

/** The canvas at a frame, as a hash of its pixels. */
async function picture(page, frame) {
  await page.evaluate((index) => window.nappe.seek(index), frame);
  return createHash('sha256').update(await page.locator('#canvas').screenshot()).digest('hex');
}

async function save(page) {
  if (values.picture !== undefined) await page.screenshot({ path: values.picture });
}
