// What steers: buttons, keys, lists; what others do.

import assert from 'node:assert/strict';
import { eventually, open } from './start.mjs';

const [PAUSED, PLAYING] = [1, 2];
/** Between a press and what it does, or between what another does and its words (ms), on a machine that draws by software. */
const LATE = 3_000;
/** What is played at a tenth of real time (s). */
const PLAYED = 0.06;

export async function steering({ browser, server: { client }, line }) {
  const session = await client.create({ scene: 'hanging_sheet', sessionId: 'sheet', stepLimit: 0n });
  const tab = await open(browser, `${line.address}?session=sheet`);
  await tab.ready();
  const is = async (state) => (await client.get(session)).state === state;
  const says = (word) => async () => (await tab.text('state')) === word;
  const times = [];
  const timed = async (...args) => times.push(await eventually(...args, LATE));

  await tab.page.click('#play');
  await timed(() => is(PLAYING), 'a button plays');
  await timed(says('Playing'), 'it says so');
  assert.equal(await tab.page.getAttribute('#play', 'aria-label'), 'Pause');
  await tab.page.focus('#canvas');
  await tab.page.keyboard.press(' ');
  await timed(() => is(PAUSED), 'a key pauses');
  await timed(says('Paused'), 'it says so');
  await tab.page.keyboard.press(' ');
  await timed(() => is(PLAYING), 'a key plays');
  await tab.page.click('#play');
  await timed(() => is(PAUSED), 'a button pauses');

  await steps(tab, client, session);
  const others = await byOthers(tab, client, session, says);
  await speeds(tab, client, session);
  await rates(tab);
  await forks(tab, client, session);
  await deletes(tab, client);
  await tab.leave();
  return { slowest_press_ms: Math.round(Math.max(...times)), slowest_other_ms: Math.round(Math.max(...others)) };
}

async function steps(tab, client, session) {
  const step = async () => Number((await client.get(session)).step);
  let expected = await step();
  for (const [press, count] of [
    [() => tab.page.click('#step'), 1], [() => tab.page.keyboard.press('.'), 1], [() => tab.page.keyboard.press('ArrowRight'), 1],
    [() => tab.page.click('#ten'), 10], [() => tab.page.keyboard.press('PageDown'), 10],
  ]) {
    await press();
    expected += count;
    await eventually(async () => (await step()) === expected, `${count} steps: ${await step()} of ${expected}`, LATE);
  }
  // A step pauses what plays. While steps are taken, the session plays, too.
  await eventually(async () => (await tab.text('state')) === 'Paused', 'the steps are done', LATE);
  await tab.page.focus('#canvas');
  await tab.page.keyboard.press(' ');
  await eventually(async () => (await client.get(session)).state === PLAYING, 'it plays', LATE);
  await tab.page.keyboard.press('.');
  await eventually(async () => (await client.get(session)).state === PAUSED, 'a step pauses it', LATE);
}

async function byOthers(tab, client, session, says) {
  const times = [];
  await client.play(session, { realTimeFactor: 0.5 });
  times.push(await eventually(says('Playing'), 'another client plays', LATE));
  await client.pause(session);
  times.push(await eventually(says('Paused'), 'another client pauses', LATE));
  const { step } = await client.step(session, 7);
  times.push(await eventually(async () => (await tab.text('frame')) === `step ${step}`, 'steps are told', LATE));
  await eventually(says('Paused'), 'and that they are done', LATE);
  return times;
}

/** The chosen speed is that of the session. */
async function speeds(tab, client, session) {
  const { timeSeconds: before } = await client.get(session);
  await tab.page.selectOption('#speed', '0.1');
  await tab.page.focus('#canvas');
  await tab.page.keyboard.press(' ');
  const since = performance.now();
  let after = before;
  await eventually(async () => (after = (await client.get(session)).timeSeconds) > before + PLAYED, 'it plays slowly');
  const factor = (after - before) / ((performance.now() - since) / 1e3);
  assert.ok(factor > 0.02 && factor < 0.15, `${factor} simulated seconds per second`);
  await tab.page.keyboard.press(' ');
  await tab.page.keyboard.press(';');
  assert.equal(await tab.page.inputValue('#speed'), '0.25');
  await eventually(async () => (await client.get(session)).state === PAUSED, 'it is paused', LATE);
}

/** Another rate is another stream, and there is only one. */
async function rates(tab) {
  const { page } = tab;
  if (!(await page.isVisible('#rate'))) await page.click('#more');
  await page.selectOption('#rate', '5');
  await page.keyboard.press('Escape');
  await page.selectOption('#speed', '1');
  await page.focus('#canvas');
  await page.keyboard.press(' ');
  await eventually(async () => /^[1-6] pictures?\/s/.test(await tab.text('corner')), 'five pictures per second at most');
  await page.keyboard.press(' ');
  await eventually(async () => (await tab.text('state')) === 'Paused', 'it is paused', LATE);
}

async function forks(tab, client, session) {
  await press(tab.page, 'fork');
  await eventually(async () => (await tab.notice()).includes('The fork is '), 'the fork is named', LATE);
  const all = await client.list();
  assert.equal(all.length, 2);
  const { step } = await client.get(session);
  const fork = all.find(({ uid }) => uid !== session.uid);
  assert.deepEqual([fork.step, (await tab.notice()).includes(fork.sessionId)], [step, true]);
}

/** Once is not enough, and asks. */
async function deletes(tab, client) {
  await press(tab.page, 'delete');
  assert.equal(await tab.text('delete'), 'Delete for good');
  assert.equal((await client.list()).length, 2);
  await tab.page.keyboard.press('Tab');
  assert.equal(await tab.text('delete'), 'Delete', 'who goes elsewhere did not mean it');
  await tab.page.focus('#delete');
  await tab.page.keyboard.press('Enter');
  await tab.page.keyboard.press('Enter');
  await eventually(async () => (await client.list()).length === 1, 'it is deleted by keys alone', LATE);
  await eventually(async () => (await tab.notice()).startsWith('This session was deleted.'), 'the page says so', LATE);
  assert.ok(await tab.page.isDisabled('#play'));
}

/** A button in one of the lists that others open. */
async function press(page, id) {
  for (const opener of ['more', 'save']) {
    if (!(await page.isVisible(`#${id}`)) && await page.isVisible(`#${opener}`)) await page.click(`#${opener}`);
  }
  await page.click(`#${id}`);
}
