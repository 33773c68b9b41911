// Opens the page that the server brings along in a headless Chromium, against a real server:
// node tests/live.mjs NAPPE-SERVER [--page FILE.html] [--only PART] [--pictures FOLDER]. --page serves that file in place of the
// server's own page. Prints a line of JSON. CHROMIUM names the browser.

import assert from 'node:assert/strict';
import { parseArgs } from 'node:util';
import { alone, isProgram } from './chromium.mjs';
import { crowd } from './live/crowd.mjs';
import { door } from './live/door.mjs';
import { hand } from './live/hand.mjs';
import { list } from './live/list.mjs';
import { loads } from './live/loads.mjs';
import { odd } from './live/odd.mjs';
import { own } from './live/own.mjs';
import { picture } from './live/picture.mjs';
import { lineTo, serve } from './live/start.mjs';
import { pupil } from './live/pupil.mjs';
import { steering } from './live/steering.mjs';
import { troubles } from './live/troubles.mjs';

const PARTS = { picture, steering, hand, list, own, odd, troubles, door, pupil, crowd };
/** What takes minutes runs by its name alone. */
const SLOW = { loads };

if (isProgram(import.meta.url)) {
  const { values, positionals: [program] } = parseArgs({
    allowPositionals: true, options: { page: { type: 'string' }, only: { type: 'string' }, pictures: { type: 'string' } },
  });
  assert.ok(program, 'node tests/live.mjs NAPPE-SERVER');
  await alone((browser) => live(browser, program, values));
}

export async function live(browser, program, { only, page, pictures } = {}) {
  const parts = only === undefined ? PARTS : { [only]: { ...PARTS, ...SLOW }[only] };
  const report = {};
  for (const [name, part] of Object.entries(parts)) {
    const server = await serve(program);
    const line = await lineTo(server.port, page);
    const begin = performance.now();
    try {
      const found = await part({ browser, server, line, program, page, pictures });
      report[name] = { ...found, seconds: Math.round((performance.now() - begin) / 100) / 10 };
    } finally {
      line.close();
      await server.stop();
    }
  }
  return report;
}
