// Scenes of one's own: files that are chosen or dropped become a session that plays; each that is refused is told by its name.

import assert from 'node:assert/strict';
import { mkdtemp, rm, truncate, writeFile } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { eventually, open } from './start.mjs';

const PLAYING = 2;
/** More than a server takes as a scene or as a mesh (bytes). */
const HUGE = 300 << 20;

/** A sheet of 3 by 3 points. */
const OBJ = [
  ...[0, 1, 2].flatMap((row) => [0, 1, 2].map((column) => `v ${0.1 * column} ${-0.1 * row} 0`)),
  ...[1, 2, 4, 5].flatMap((corner) => [`f ${corner} ${corner + 3} ${corner + 1}`, `f ${corner + 1} ${corner + 3} ${corner + 4}`]),
].join('\n') + '\n';

const scene = (mesh, title = 'A sheet of my own') => `version = 1
title = "${title}"
dt = 0.001
[[body]]
name = "sheet" # its mesh was file = "other.obj"
mesh = { file = "${mesh}" }
mass = { particle = 0.1 }
pins = [0]
springs = { stretch = { stiffness = 1000, damping = 0.1 } }
`;

const asFile = (name, text) => ({ name, mimeType: 'application/octet-stream', buffer: Buffer.from(text) });

export async function own({ browser, server: { client }, line }) {
  const chosen = await chooses(browser, client, line);
  const dropped = await drops(browser, client, line);
  await refuses(browser, client, line);
  await names(browser, client, line);
  return { chosen_plays_ms: Math.round(chosen), dropped_plays_ms: Math.round(dropped) };
}

/** Waits until the page of a new session shows it, and it plays; how long that took since `begin` (ms). */
async function plays(tab, client, title, begin) {
  await tab.page.waitForURL(/\?session=/);
  await tab.ready();
  await eventually(async () => (await tab.drawn()) > 1, 'it is seen to move');
  const took = performance.now() - begin;
  assert.equal(await tab.text('title'), title);
  const sessionId = new URL(tab.page.url()).searchParams.get('session');
  assert.equal((await client.get(sessionId)).state, PLAYING);
  assert.equal((await client.get(sessionId)).particleCount, 9n);
  await client.delete(sessionId);
  return took;
}

/** Files that are chosen have no folders: a mesh is known by its name. */
async function chooses(browser, client, line) {
  const tab = await open(browser, line.address);
  await tab.ready();
  const begin = performance.now();
  await tab.page.setInputFiles('#files', [asFile('sheet.obj', OBJ), asFile('mine.toml', scene('meshes/sheet.obj'))]);
  const took = await plays(tab, client, 'A sheet of my own', begin);
  await tab.leave();
  return took;
}

/** A drop on the page of a session makes another one. */
async function drops(browser, client, line) {
  await client.create({ scene: 'hanging_sheet', sessionId: 'seen-before' });
  const tab = await open(browser, `${line.address}?session=seen-before`);
  await tab.ready();
  const begin = performance.now();
  await tab.page.evaluate((files) => {
    const dataTransfer = new DataTransfer();
    for (const [name, text] of files) dataTransfer.items.add(new File([text], name));
    const send = (type) => document.body.dispatchEvent(new DragEvent(type, { dataTransfer, bubbles: true, cancelable: true }));
    // Whoever prevents what the browser would do takes the files.
    if (send('dragover') || send('drop')) throw new Error('the browser would leave the page');
  }, [['dropped.toml', scene('sheet.obj', 'A dropped sheet')], ['sheet.obj', OBJ]]);
  await tab.page.waitForURL((url) => !url.href.endsWith('seen-before'));
  const took = await plays(tab, client, 'A dropped sheet', begin);
  await tab.leave();
  await client.delete('seen-before');
  return took;
}

async function refuses(browser, client, line) {
  const folder = await mkdtemp(join(tmpdir(), 'nappe-own-'));
  const huge = async (name) => {
    const path = join(folder, name);
    await writeFile(path, '');
    await truncate(path, HUGE);
    return path;
  };
  const small = async (name, text) => {
    const path = join(folder, name);
    await writeFile(path, text);
    return path;
  };
  const tab = await open(browser, line.address);
  await tab.ready();
  // How much of files is read, and in how large pieces.
  await tab.page.evaluate(() => {
    window.read = 0;
    const { arrayBuffer } = Blob.prototype;
    Blob.prototype.arrayBuffer = function () {
      window.read += this.size;
      return arrayBuffer.call(this);
    };
  });
  const bytes = HUGE.toLocaleString('en');
  const cases = [
    [[asFile('photo.png', 'no scene')], /^photo\.png was refused: it is no scene\. A scene is a text file whose name ends in \.toml/],
    [[asFile('a.obj', OBJ), asFile('b.obj', OBJ)], /^a\.obj, b\.obj were refused: none of them is a scene/],
    [[asFile('a.toml', scene('x.obj')), asFile('b.toml', scene('x.obj'))], /^a\.toml, b\.toml were refused: these are several scenes/],
    [[await huge('huge.toml')], new RegExp(`^huge\\.toml was refused: it has ${bytes} bytes, and a scene of this server has at most [\\d,]+\\.`)],
    [[await small('heavy.toml', scene('huge.obj')), await huge('huge.obj')], new RegExp(`^huge\\.obj was refused: it has ${bytes} bytes, and a mesh of this server has at most [\\d,]+\\.`)],
    [[asFile('out.toml', scene('../../etc/sheet.obj')), asFile('sheet.obj', OBJ)], /^out\.toml was refused: it names the mesh \.\.\/\.\.\/etc\/sheet\.obj, which is outside its folder/],
    [[asFile('root.toml', scene('/etc/sheet.obj')), asFile('sheet.obj', OBJ)], /^root\.toml was refused: it names the mesh \/etc\/sheet\.obj, which is outside its folder/],
    [[asFile('alone.toml', scene('sheet.obj'))], /^alone\.toml was refused: it names the mesh sheet\.obj, and sheet\.obj is not among the files/],
    [[asFile('model.toml', scene('model.gltf')), asFile('model.gltf', '{}')], /^model\.gltf was refused: its ending is none of a mesh that is read/],
    [[asFile('bytes.toml', Buffer.from([0xff, 0xfe, 0x00, 0x80]))], /^bytes\.toml was refused: it is no text in UTF-8/],
    [[asFile('wrong.toml', 'version = 1\ndt = "much"\n')], /^Refused: wrong\.toml:[^]*\bdt\b/],
    [[asFile('torn.toml', scene('torn.obj')), asFile('torn.obj', 'v 0 0\nf 1 2 9\n')], /^Refused: torn\.obj:1/],
  ];
  for (const [files, expected] of cases) {
    await tab.page.setInputFiles('#files', files);
    await eventually(async () => expected.test(await tab.notice()), `${expected}: ${await tab.notice()}`);
  }
  const read = await tab.page.evaluate(() => window.read);
  assert.ok(read < 1 << 20, `${read} bytes of files were read`);
  assert.equal(new URL(tab.page.url()).search, '', 'the list stays');
  assert.deepEqual(await client.list(), [], 'no session was made');
  await tab.page.click('#notice-deeds button');
  assert.equal(await tab.notice(), '');
  await tab.leave();
  await rm(folder, { recursive: true });
}

/** Ids of one letter, and of as many capitals as there may be. */
async function names(browser, client, line) {
  const most = 'Z'.repeat(63);
  for (const sessionId of ['a', 'A', '7', most]) await client.create({ scene: 'hanging_sheet', sessionId });
  await assert.rejects(client.create({ scene: 'hanging_sheet', sessionId: `${most}Z` }), { reason: 'INVALID_FIELD' });
  const tab = await open(browser, line.address, { viewport: { width: 360, height: 640 } });
  await tab.ready();
  const ids = await tab.page.evaluate(() => [...document.querySelectorAll('.card .id')].map(({ textContent }) => textContent));
  assert.deepEqual(ids.sort(), ['7', 'A', most, 'a']);
  assert.ok(await tab.page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), 'a long id is broken');
  await tab.leave();
  for (const sessionId of ['a', most]) {
    const shown = await open(browser, `${line.address}?session=${sessionId}`, { dark: true });
    await shown.ready();
    await shown.page.click('#step');
    await eventually(async () => (await client.get(sessionId)).step === 1n, `${sessionId} takes a step`);
    await shown.leave();
  }
}
