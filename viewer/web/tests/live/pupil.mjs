// A link to one session, as a class opens it: the page watches that session, and has a copy that nobody else can touch.

import assert from 'node:assert/strict';
import { eventually, makeLink, open } from './start.mjs';

const [PAUSED, PLAYING] = [1, 2];

export async function pupil({ browser, server: { client }, line, page: ownPage }) {
  // A server that has no page has no links.
  if (ownPage !== undefined) return {};
  for (const sessionId of ['lesson', 'private']) await client.create({ scene: 'hanging_sheet', sessionId, stepLimit: 0n });
  // The id, one copy, one use, a minute.
  const code = await makeLink(line.address, [0x0a, 6, ...Buffer.from('lesson'), 0x10, 1, 0x18, 1, 0x20, 60]);
  const tab = await open(browser, `${line.address}?session=lesson#${code}`, { token: null });
  const { page } = tab;
  await tab.ready();
  for (const id of ['play', 'step', 'hand', 'fork', 'delete']) assert.ok(await page.isDisabled(`#${id}`), `${id} is for copies`);
  assert.equal(await page.getAttribute('#watch', 'aria-pressed'), 'true');
  const shown = () => new URL(page.url()).searchParams.get('session');
  const press = async (id) => {
    const before = shown();
    await page.click(`#${id}`);
    await page.waitForURL(() => shown() !== before);
    await tab.ready();
    return shown();
  };
  const ids = async () => (await client.list()).map(({ sessionId }) => sessionId).sort();

  const copy = await press('own');
  assert.deepEqual(await ids(), [copy, 'lesson', 'private'].sort());
  assert.equal(await page.getAttribute('#own', 'aria-pressed'), 'true');
  await page.click('#play');
  await eventually(async () => (await client.get(copy)).state === PLAYING, 'the copy plays');
  assert.equal((await client.get('lesson')).state, PAUSED);

  const again = await press('again');
  assert.notEqual(again, copy);
  assert.deepEqual(await ids(), [again, 'lesson', 'private'].sort(), 'a new copy in place of the first');
  assert.equal((await client.get(again)).step, 0n);
  assert.equal(await press('watch'), 'lesson');
  assert.equal(await press('own'), again, 'the copy is still there');
  assert.equal((await ids()).length, 3);
  await tab.leave();
  return {};
}
