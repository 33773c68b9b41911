// All tests of both pages that need a browser, in one: node tests/all.mjs NAPPE-SERVER CLOTH.html SNOW.html. CLOTH is a recording
// of several blocks above a plane. Prints a line of JSON for each part. CHROMIUM names the browser.

import assert from 'node:assert/strict';
import { bars, boxes } from './boxes.mjs';
import { shows } from './browser.mjs';
import { launch } from './chromium.mjs';
import { live } from './live.mjs';
import { odd } from './odd.mjs';
import { screens } from './screens.mjs';

const [program, cloth, snow] = process.argv.slice(2);
assert.ok(snow, 'node tests/all.mjs NAPPE-SERVER CLOTH.html SNOW.html');
const PARTS = {
  'show cloth': (browser) => shows(browser, cloth, { grid: true }),
  'show snow': (browser) => shows(browser, snow),
  'bodies under boxes': (browser) => boxes(browser, [cloth, snow]),
  'bars at the plots': (browser) => bars(browser, cloth),
  'odd recordings': (browser) => odd(browser, cloth),
  'screens and controls': (browser) => screens(browser, cloth),
  'live, on a server': (browser) => live(browser, program),
};

const browser = await launch();
try {
  for (const [part, work] of Object.entries(PARTS)) {
    const begin = performance.now();
    try {
      const found = await work(browser);
      console.log(JSON.stringify({ part, seconds: Math.round((performance.now() - begin) / 100) / 10, ...found }));
    } catch (error) {
      console.error(`Page: ${part} failed.`);
      throw error;
    }
  }
} finally {
  await browser.close();
}
