// More pages of one browser than it has connections to a server: four watch, the others say why they do not, and each can steer.

import assert from 'node:assert/strict';
import { blind } from '../chromium.mjs';
import { TOKEN, eventually } from './start.mjs';

const PAGES = 8;
/** Pages that watch at a time. */
const WATCHERS = 4;
/** A press is answered within two seconds, or it is said that it is not (ms); a machine that has much else to do takes longer. */
const LATE = 6_000;
const [PAUSED, PLAYING] = [1, 2];

export async function crowd({ browser, server: { client }, line }) {
  // Connections, and places for streams, are those of all pages of a context.
  const context = await browser.newContext();
  const tabs = [];
  for (let number = 0; number < PAGES; number++) tabs.push(await begin(context, client, line, number));
  const watchers = async () => {
    const counts = await Promise.all(tabs.map(async ({ id }) => (await client.get(id)).watcherCount));
    return counts.reduce((sum, count) => sum + count, 0);
  };
  const told = async () => (await Promise.all(tabs.map((tab) => tab.isTold()))).filter(Boolean).length;
  const stands = (waiting, what) => eventually(async () => (await watchers()) === WATCHERS && (await told()) === waiting, what);
  await stands(PAGES - WATCHERS, 'four watch, and the others say why they do not');

  const times = [];
  for (const state of [PLAYING, PAUSED]) {
    for (const tab of tabs) times.push(await press(tab, client, state));
  }

  const seen = async (isTold) => {
    for (const tab of tabs) if ((await tab.isTold()) === isTold) return tab;
    return null;
  };
  const closed = await seen(false);
  await closed.page.close();
  tabs.splice(tabs.indexOf(closed), 1);
  await stands(3, 'a page that is closed leaves its place to another');
  const rests = await seen(false);
  await rests.hide();
  await stands(2, 'a tab that nobody sees leaves its place to another');
  await rests.show();
  await stands(3, 'once it is seen again, it waits for a place');
  for (const tab of tabs) {
    if (!(await tab.isTold())) await eventually(async () => (await tab.drawn()) > 0, 'who watches has pictures');
    assert.deepEqual(tab.problems, []);
  }
  await context.close();
  return { slowest_press_ms: Math.round(Math.max(...times)) };
}

/** A page with a session of its own; its picture is nothing to the server. */
async function begin(context, client, line, number) {
  const { sessionId: id } = await client.create({ scene: 'hanging_sheet', sessionId: `crowd-${number}`, stepLimit: 0n });
  const page = await context.newPage();
  await page.addInitScript((token) => sessionStorage.setItem('nappe token /', token), TOKEN);
  await page.addInitScript(blind);
  const problems = [];
  page.on('pageerror', (error) => problems.push(String(error)));
  await page.goto(`${line.address}?session=${id}`);
  await eventually(() => page.isVisible('#app'), 'the page has its session');
  const notice = () => page.evaluate(() => (document.getElementById('notice').hidden ? '' : document.getElementById('notice').textContent));
  return {
    id, page, problems, notice,
    isTold: async () => (await notice()).startsWith('Four other pages of this browser watch this server'),
    drawn: () => page.evaluate(() => window.nappe.session?.drawnCount ?? 0),
    hide: () => page.evaluate(() => {
      Object.defineProperty(document, 'hidden', { get: () => true, configurable: true });
      document.dispatchEvent(new Event('visibilitychange'));
    }),
    show: () => page.evaluate(() => {
      delete document.hidden;
      document.dispatchEvent(new Event('visibilitychange'));
    }),
  };
}

/** Presses the button that plays and pauses: how long until that is done, or the page says that there is no answer (ms). */
async function press({ id, page, notice }, client, state) {
  const is = async () => (await client.get(id)).state === state;
  await page.click('#play');
  const took = await eventually(async () => (await is()) || (await notice()).includes('has no answer yet'), 'a button is answered, or it is said that it is not', LATE);
  await eventually(is, 'it is done in the end');
  // The page knows it, before the next press means the opposite.
  const label = state === PLAYING ? 'Pause' : 'Play';
  await eventually(async () => (await page.getAttribute('#play', 'aria-label')) === label, 'the page knows it');
  return took;
}
