// Opens recordings that are cut off, empty or hostile, and browsers that lack something: node tests/odd.mjs FILE.html.
// FILE is a recording of several blocks. CHROMIUM names the browser.

import assert from 'node:assert/strict';
import { mkdtemp, readFile, rm, writeFile } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { pathToFileURL } from 'node:url';
import { chromium } from 'playwright-core';

const CUTS = 20;
const ELEMENT = /<script type="application\/json" class="nappe-(\w+)">(.*)<\/script>\n/g;

const text = await readFile(process.argv[2], 'utf8');
const elements = [...text.matchAll(ELEMENT)].map((match) => (
  { kind: match[1], json: match[2], start: match.index, end: match.index + match[0].length }
));
const start = elements[0].start;
const folder = await mkdtemp(join(tmpdir(), 'nappe-page-'));
const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium',
  args: ['--no-sandbox', '--enable-unsafe-swiftshader', '--use-angle=swiftshader'],
});
try {
  await cuts();
  await empty();
  await hostile();
  await lacking();
  console.log(JSON.stringify({ cuts: CUTS, blocks: elements.filter(({ kind }) => kind === 'block').length }));
} finally {
  await browser.close();
  await rm(folder, { recursive: true });
}

/** What a page says of a file: its frames, its message, and whether a script of the file ran. */
async function opened(content, before = () => {}) {
  const file = join(folder, 'odd.html');
  await writeFile(file, content);
  const page = await browser.newPage({ viewport: { width: 480, height: 480 } });
  const errors = [];
  page.on('pageerror', (error) => errors.push(String(error)));
  page.on('dialog', (dialog) => { errors.push('a script of the file ran'); void dialog.dismiss(); });
  await page.addInitScript(before);
  await page.goto(pathToFileURL(file).href);
  const frames = await page.evaluate(async () => {
    await window.nappe?.ready;
    return window.nappe?.frameCount ?? 0;
  });
  const message = (await page.isVisible('#message')) ? await page.textContent('#message') : '';
  const body = await page.evaluate(() => document.body.innerText);
  await page.close();
  assert.deepEqual(errors, []);
  return { frames, message, body };
}

async function cuts() {
  let seed = 7;
  for (let index = 0; index < CUTS; index++) {
    seed = (seed * 48271) % 0x7fffffff;
    const at = start + Math.floor((seed / 0x7fffffff) * (text.length - start));
    const whole = elements.filter(({ kind, end }) => kind === 'block' && end <= at + 1);
    const expected = whole.reduce((sum, { json }) => sum + JSON.parse(json).frames.length, 0);
    const { frames, message, body } = await opened(text.slice(0, at));
    assert.equal(frames, expected, `cut at ${at}`);
    if (frames > 0) assert.match(body, /cut off/, `cut at ${at}`);
    else assert.notEqual(message, '', `cut at ${at}: nothing is said`);
  }
}

async function empty() {
  const [head, block] = [elements[0], elements[1]];
  const end = elements.at(-1);
  const none = await opened(text.slice(0, head.end) + text.slice(end.start));
  assert.equal(none.frames, 0);
  assert.notEqual(none.message, '', 'a file without a frame says nothing');
  const first = JSON.parse(block.json);
  const one = element('block', { ...first, frames: first.frames.slice(0, 1) });
  const alone = await opened(text.slice(0, head.end) + one + text.slice(end.start));
  assert.deepEqual([alone.frames, alone.message], [1, '']);
}

function element(kind, value) {
  const json = JSON.stringify(value).replaceAll('<', '\\u003c');
  return `<script type="application/json" class="nappe-${kind}">${json}</script>\n`;
}

async function hostile() {
  const title = '</script><script>alert(1)</script><img src=x onerror=alert(2)>';
  const head = { ...JSON.parse(elements[0].json), title };
  const { frames, body } = await opened(text.slice(0, start) + element('head', head) + text.slice(elements[0].end));
  assert.ok(frames > 0 && body.includes(title), 'the title is text');
}

async function lacking() {
  const inflate = await opened(text, () => { delete window.DecompressionStream; });
  assert.match(inflate.body, /DecompressionStream|decompress/i);
  const graphics = await opened(text, () => {
    const original = HTMLCanvasElement.prototype.getContext;
    HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
      return kind === 'webgl2' ? null : original.call(this, kind, ...rest);
    };
  });
  assert.match(graphics.body, /WebGL/);
}
