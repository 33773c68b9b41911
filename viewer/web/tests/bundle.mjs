// A module of the page, for Node.

import { mkdtemp, rm } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { pathToFileURL } from 'node:url';
import { build } from 'esbuild';

export async function load(path) {
  const folder = await mkdtemp(join(tmpdir(), 'nappe-bundle-'));
  const outfile = join(folder, 'module.mjs');
  await build({ entryPoints: [path], absWorkingDir: new URL('..', import.meta.url).pathname, bundle: true, outfile, format: 'esm' });
  const module = await import(pathToFileURL(outfile).href);
  await rm(folder, { recursive: true });
  return module;
}
