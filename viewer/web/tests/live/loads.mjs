// A page that is loaded and closed many times leaves no watcher, no connection and no memory with the server.

import assert from 'node:assert/strict';
import { readFile, readdir } from 'node:fs/promises';
import { TOKEN, eventually, open } from './start.mjs';

/** Loads before the server is looked at, so that it has what it keeps, and after that. */
const BEFORE = 10;
const LOADS = 100;
/** Memory that the server may have more of then: its allocator's (bytes). */
const SLACK = 16 << 20;

export async function loads({ browser, server: { client, port, pid } }) {
  // It rests: frames of the past that a session keeps would hide what loads leave.
  await client.create({ scene: 'demo', sessionId: 'loaded', stepLimit: 0n });
  await client.step('loaded', 8);
  const address = `http://127.0.0.1:${port}/`;
  const load = async () => {
    // What it draws is nothing to the server.
    const tab = await open(browser, `${address}?session=loaded`, { dark: true });
    await tab.ready();
    await tab.close();
  };
  const nobody = async () => {
    const told = await fetch(`${address}metrics`, { headers: { authorization: `Bearer ${TOKEN}`, connection: 'close' } });
    return /^nappe_watchers 0$/m.test(await told.text());
  };
  const has = async () => ({
    descriptors: (await readdir(`/proc/${pid}/fd`)).length,
    resident: 4096 * Number((await readFile(`/proc/${pid}/statm`, 'utf8')).split(' ')[1]),
  });

  for (let i = 0; i < BEFORE; i++) await load();
  await eventually(nobody, 'nobody watches');
  const before = await has();
  for (let i = 0; i < LOADS; i++) await load();
  const gone = await eventually(nobody, 'nobody watches after all loads');
  let after = before;
  await eventually(async () => (after = await has()).descriptors <= before.descriptors, 'connections are closed');
  assert.ok(after.resident <= before.resident + SLACK, `${before.resident} bytes before, ${after.resident} after`);
  return { loads: LOADS, gone_ms: Math.round(gone), more_bytes: after.resident - before.resident };
}
