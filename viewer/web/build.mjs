// Builds the pages: dist/replay.html, which recordings begin with, and dist/live.html, which the server serves. Each is
// one file that needs no other. The same sources give the same bytes. The package for Python has a copy of the first, so
// that it can be installed without the rest of the repository.

import { createHash } from 'node:crypto';
import { mkdir, readFile, writeFile } from 'node:fs/promises';
import { gzipSync } from 'node:zlib';
import { build } from 'esbuild';

const read = (path) => readFile(new URL(path, import.meta.url), 'utf8');
const target = ['chrome111', 'firefox114', 'safari16.4'];

/** Where each library is, and which of its files say the licence. */
const LIBRARIES = { 'three.js': ['node_modules/three', 'LICENSE'], uPlot: ['node_modules/uplot', 'LICENSE'] };
const CLIENT_LIBRARIES = {
  'protobuf-es': ['../../client/typescript/node_modules/@bufbuild/protobuf', 'dist/esm/index.js', 'dist/esm/wire/varint.js'],
};
/** What each page is made of; `connect` is whom it may call. */
const PAGES = [
  {
    name: 'replay', styles: ['page.css'], connect: "'none'", libraries: LIBRARIES,
    files: ['dist/replay.html', '../../client/python/src/nappe/replay.html'],
  },
  {
    name: 'live', styles: ['page.css', 'live.css'], connect: "'self'", libraries: { ...LIBRARIES, ...CLIENT_LIBRARIES },
    files: ['dist/live.html'],
  },
];
/** Largest page that the server serves, compressed (bytes). */
const MOST_COMPRESSED = 250_000;

/** Holds the compiled contract as a character for each byte: base64 would hide from compression what repeats in it. */
const contract = {
  name: 'contract',
  setup(build) {
    build.onLoad({ filter: /_pb\.ts$/ }, async ({ path }) => {
      const bytes = (packed) => JSON.stringify(Buffer.from(packed, 'base64').toString('latin1'));
      const text = await readFile(path, 'utf8');
      const contents = text.replace(/fileDesc\("([A-Za-z0-9+/=]+)"/g, (_, packed) => `fileDesc(btoa(${bytes(packed)})`);
      return { contents, loader: 'ts' };
    });
  },
};

/** Shaders of three.js that no page draws with: its materials of other kinds, and what these alone include. */
const UNUSED_SHADERS = [
  ...['background', 'backgroundCube', 'cube', 'distance', 'equirect', 'linedashed', 'meshmatcap', 'meshnormal', 'meshphong', 'meshphysical',
    'meshtoon', 'points', 'shadow', 'sprite'].flatMap((name) => [`${name}_vert`, `${name}_frag`]),
  ...['lights_toon', 'lights_phong', 'lights_physical', 'iridescence', 'transmission', 'metalnessmap', 'roughnessmap', 'map_particle']
    .flatMap((name) => [`${name}_fragment`, `${name}_pars_fragment`]),
  'clearcoat_normal_fragment_begin', 'clearcoat_normal_fragment_maps', 'clearcoat_pars_fragment', 'gradientmap_pars_fragment',
];

/** Leaves these shaders out: three.js holds all in one table, of which no bundler can tell what is used. */
const shaders = {
  name: 'shaders',
  setup(build) {
    build.onLoad({ filter: /three[\\/]build[\\/]three\.module\.js$/ }, async ({ path }) => {
      let contents = await readFile(path, 'utf8');
      for (const name of UNUSED_SHADERS) {
        const row = new RegExp(`^\\s*${name}: [\\w$]+,?$`, 'm');
        if (!row.test(contents)) throw new Error(`three.js has no shader ${name}`);
        contents = contents.replace(row, `${name}: '',`);
      }
      return { contents, loader: 'js' };
    });
  },
};

async function script(name) {
  const { outputFiles } = await build({
    entryPoints: [`src/${name}.ts`],
    absWorkingDir: import.meta.dirname,
    bundle: true,
    write: false,
    format: 'iife',
    minify: true,
    charset: 'utf8',
    legalComments: 'none',
    plugins: [contract, shaders],
    target,
  });
  const [{ text }] = outputFiles;
  // Either would end or change the element that holds the script.
  for (const forbidden of ['</script', '<!--', '<script']) {
    if (text.toLowerCase().includes(forbidden)) throw new Error(`the script holds ${forbidden}`);
  }
  return text.trimEnd();
}

async function style(names) {
  const parts = [await read('node_modules/uplot/dist/uPlot.min.css'), ...await Promise.all(names.map((name) => read(`src/${name}`)))];
  const { outputFiles } = await build({
    stdin: { contents: parts.join('\n'), loader: 'css' }, write: false, minify: true, legalComments: 'none', target,
  });
  return outputFiles[0].text.trimEnd();
}

async function notices(libraries) {
  const parts = ['This page is a part of nappe, which is licensed under MIT or Apache-2.0. It holds the libraries below.'];
  for (const [name, [path, ...licences]] of Object.entries(libraries)) {
    const { version } = JSON.parse(await read(`${path}/package.json`));
    const texts = await Promise.all(licences.map(async (file) => opening(await read(`${path}/${file}`)).trim()));
    parts.push([`${name} ${version}`, ...texts].join('\n\n'));
  }
  const text = parts.join('\n\n').replaceAll('\r\n', '\n');
  if (text.includes('--')) throw new Error('a notice would end the comment that holds it');
  return text;
}

/** The comment that a file of JavaScript begins with; all of any other file. */
function opening(text) {
  const lines = text.split('\n');
  if (!lines[0].startsWith('//')) return text;
  const end = lines.findIndex((line) => !line.startsWith('//'));
  return lines.slice(0, end).map((line) => line.replace(/^\/\/ ?/, '')).join('\n');
}

/** Names in capitals stand for what is made here, small ones for files in `src/parts`, which hold no other file. */
async function filled(text, made) {
  const names = [...text.matchAll(/{{([a-z_]+)}}/g)].map(([, name]) => name);
  const parts = Object.fromEntries(await Promise.all(names.map(async (name) => [name, await read(`src/parts/${name}.html`)])));
  return text.replace(/{{([a-z_]+)}}/g, (_, name) => parts[name]).replace(/{{([A-Z]+)}}/g, (_, name) => made[name]);
}

await mkdir(new URL('dist', import.meta.url), { recursive: true });
for (const { name, styles, connect, libraries, files } of PAGES) {
  const code = await script(name);
  const hash = `sha256-${createHash('sha256').update(code).digest('base64')}`;
  const made = { HASH: hash, CONNECT: connect, NOTICES: await notices(libraries), STYLE: await style(styles), SCRIPT: code };
  const page = await filled(await read(`src/${name}.html`), made);
  const compressed = gzipSync(page, { level: 9 }).length;
  if (compressed > MOST_COMPRESSED) throw new Error(`${name}.html has ${compressed} bytes compressed, more than ${MOST_COMPRESSED}`);
  for (const path of files) await writeFile(new URL(path, import.meta.url), page);
  console.log(`dist/${name}.html: ${Buffer.byteLength(page)} bytes, ${compressed} compressed`);
}
