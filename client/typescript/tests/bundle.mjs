// A module of the package, for Node.

import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { pathToFileURL } from 'node:url';
import { build } from 'esbuild';

export async function load(path) {
  const folder = mkdtempSync(join(tmpdir(), 'nappe-ts-'));
  try {
    const outfile = join(folder, 'module.mjs');
    const absWorkingDir = new URL('..', import.meta.url).pathname;
    await build({ entryPoints: [path], absWorkingDir, outfile, bundle: true, format: 'esm', target: 'node20' });
    return await import(pathToFileURL(outfile).href);
  } finally {
    rmSync(folder, { recursive: true, force: true });
  }
}
