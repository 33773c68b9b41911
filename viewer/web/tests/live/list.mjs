// The list of sessions, which is renewed, and new ones of shipped scenes.

import assert from 'node:assert/strict';
import { join } from 'node:path';
import { eventually, open } from './start.mjs';

/** A session that another client makes is listed within so long (ms); a machine that has much else to do takes longer. */
const LISTED = 6_000;

export async function list({ browser, server: { client }, line, pictures }) {
  const tab = await open(browser, line.address, { colorScheme: 'dark' });
  await tab.ready();
  assert.ok(await tab.page.isVisible('#none'), 'an empty list says so');
  const cards = () => tab.page.evaluate(() => [...document.querySelectorAll('.card')].map((card) => card.innerText));

  await client.create({ scene: 'demo', sessionId: 'one-cloth', stepLimit: 0n });
  const listed = await eventually(async () => (await cards()).length === 1, 'it is listed', LISTED);
  assert.match((await cards())[0], /A cloth falls over a sphere\s+Paused\s+one-cloth\s+7,744 particles\s+0 watchers/);
  assert.equal(await tab.page.isVisible('#none'), false);
  await tab.page.focus('.card');
  await client.play('one-cloth', { realTimeFactor: 0.01 });
  await client.create({ scene: 'snow_and_cloth', sessionId: 'and-snow' });
  await eventually(async () => (await cards()).some((card) => card.includes('Playing')), 'its state is renewed', LISTED);
  await eventually(async () => (await cards()).length === 2, 'another is listed', LISTED);
  assert.ok(await tab.page.evaluate(() => document.activeElement.className === 'card' && document.activeElement.innerText.includes('one-cloth')), 'the focus stays');
  await client.pause('one-cloth');
  if (pictures !== undefined) await tab.page.screenshot({ path: join(pictures, 'list-dark.png') });
  await client.delete('and-snow');
  await eventually(async () => (await cards()).length === 1, 'one that is deleted is not', LISTED);

  await tab.page.selectOption('#scene', 'hanging_sheet');
  await Promise.all([tab.page.waitForURL(/\?session=/), tab.page.click('#create')]);
  await tab.ready();
  assert.equal((await client.list()).length, 2);
  assert.ok(await tab.page.isVisible('#canvas'));
  await tab.page.click('#up');
  await tab.page.waitForURL(line.address);
  await tab.ready();
  await tab.page.focus('.card');
  await Promise.all([tab.page.waitForURL(/\?session=one-cloth/), tab.page.keyboard.press('Enter')].reverse()).catch(() => undefined);
  await tab.leave();
  return { listed_ms: Math.round(listed) };
}
