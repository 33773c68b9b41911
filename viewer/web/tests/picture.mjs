// Draws recordings as their pages show them, side by side: node tests/picture.mjs OUT.png FILE.html[@SECONDS[@STEPS]] ...
// [--size WxH] [--count N --delay MS] [--page]. Moves STEPS steps towards the scene. With --count the picture moves
// (APNG) from that time on, and starts over at its end. --page leaves what stands around the picture. CHROMIUM names the
// browser.

import assert from 'node:assert/strict';
import { writeFile } from 'node:fs/promises';
import { resolve } from 'node:path';
import { pathToFileURL } from 'node:url';
import { parseArgs } from 'node:util';
import { chromium } from 'playwright-core';
import UPNG from 'upng-js';

const COLORS = 256;
/** The last picture of a moving one stays so long (ms). */
const REST = 1500;
/** A page draws finer once nothing has moved for a while (ms). */
const FINE = 400;
/** What stands around the picture. */
const HIDDEN = '#side, #controls, .info, .legend { display: none !important }';

const { values, positionals: [out, ...recordings] } = parseArgs({
  allowPositionals: true,
  options: {
    size: { type: 'string', default: '320x240' }, count: { type: 'string', default: '1' },
    delay: { type: 'string', default: '40' }, page: { type: 'boolean', default: false },
  },
});
assert.ok(out !== undefined && recordings.length > 0, 'node tests/picture.mjs OUT.png FILE.html[@SECONDS[@STEPS]] ...');
const [width, height] = values.size.split('x').map(Number);
const [count, delay] = [Number(values.count), Number(values.delay)];

const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium',
  args: ['--no-sandbox', '--enable-unsafe-swiftshader', '--use-angle=swiftshader'],
});
try {
  const strips = [];
  for (const recording of recordings) strips.push(await pictures(...recording.split('@')));
  const joined = Array.from({ length: count }, (_, i) => beside(strips.map((strip) => strip[i])));
  const delays = joined.map((_, i) => (i + 1 < count ? delay : REST));
  const png = Buffer.from(UPNG.encode(joined, width * recordings.length, height, COLORS, delays));
  await writeFile(out, png);
  console.log(`${out}: ${count} of ${width * recordings.length} x ${height} pixels, ${Math.ceil(png.length / 1024)} KiB`);
} finally {
  await browser.close();
}

/** The pictures of one recording, as bytes of red, green, blue and opacity. */
async function pictures(file, time = '0', steps = '0') {
  const page = await browser.newPage({ viewport: { width, height }, colorScheme: 'dark', reducedMotion: 'reduce' });
  await page.goto(`${pathToFileURL(resolve(file)).href}#t=${time}`);
  if (!values.page) await page.addStyleTag({ content: HIDDEN });
  await page.evaluate(() => window.nappe.ready);
  const first = Number(await page.inputValue('#scrub'));
  for (let i = 0; i < Number(steps); i++) await page.keyboard.press('+');
  const all = [];
  for (let i = 0; i < count; i++) {
    await page.evaluate((frame) => window.nappe.seek(Math.min(frame, window.nappe.frameCount - 1)), first + i);
    await page.waitForTimeout(FINE);
    const png = UPNG.decode(await page.screenshot());
    all.push(new Uint8Array(UPNG.toRGBA8(png)[0]));
  }
  await page.close();
  return all;
}

/** One picture of several of the same size, from left to right. */
function beside(parts) {
  const row = 4 * width;
  const whole = new Uint8Array(row * parts.length * height);
  parts.forEach((part, k) => {
    for (let y = 0; y < height; y++) whole.set(part.subarray(y * row, (y + 1) * row), row * (y * parts.length + k));
  });
  return whole.buffer;
}
