// Builds dist/replay.html: one file that needs no other. The same sources give the same bytes. The package for Python
// has a copy, so that it can be installed without the rest of the repository.

import { createHash } from 'node:crypto';
import { mkdir, readFile, writeFile } from 'node:fs/promises';
import { build } from 'esbuild';

const read = (path) => readFile(new URL(path, import.meta.url), 'utf8');
const target = ['chrome111', 'firefox114', 'safari16.4'];

async function script() {
  const { outputFiles } = await build({
    entryPoints: ['src/replay.ts'],
    absWorkingDir: import.meta.dirname,
    bundle: true,
    write: false,
    format: 'iife',
    minify: true,
    charset: 'utf8',
    legalComments: 'none',
    target,
  });
  const [{ text }] = outputFiles;
  // Either would end or change the element that holds the script.
  for (const forbidden of ['</script', '<!--', '<script']) {
    if (text.toLowerCase().includes(forbidden)) throw new Error(`the script holds ${forbidden}`);
  }
  return text.trimEnd();
}

async function style() {
  const parts = [await read('node_modules/uplot/dist/uPlot.min.css'), await read('src/page.css')];
  const { outputFiles } = await build({
    stdin: { contents: parts.join('\n'), loader: 'css' }, write: false, minify: true, legalComments: 'none', target,
  });
  return outputFiles[0].text.trimEnd();
}

async function notices() {
  const parts = ['This page is a part of nappe, which is licensed under MIT or Apache-2.0. It holds the libraries below.'];
  for (const [name, path] of [['three.js', 'three'], ['uPlot', 'uplot']]) {
    const { version } = JSON.parse(await read(`node_modules/${path}/package.json`));
    parts.push(`${name} ${version}\n\n${(await read(`node_modules/${path}/LICENSE`)).trim()}`);
  }
  const text = parts.join('\n\n').replaceAll('\r\n', '\n');
  if (text.includes('--')) throw new Error('a notice would end the comment that holds it');
  return text;
}

const code = await script();
const hash = `sha256-${createHash('sha256').update(code).digest('base64')}`;
const parts = { HASH: hash, NOTICES: await notices(), STYLE: await style(), SCRIPT: code };
const page = (await read('src/page.html')).replace(/{{(\w+)}}/g, (_, name) => parts[name]);
await mkdir(new URL('dist', import.meta.url), { recursive: true });
for (const path of ['dist/replay.html', '../../client/python/src/nappe/replay.html']) {
  await writeFile(new URL(path, import.meta.url), page);
}
console.log(`dist/replay.html: ${Buffer.byteLength(page)} bytes`);
