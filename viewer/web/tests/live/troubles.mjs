// What breaks: the line, the server, the session that is shown.

import assert from 'node:assert/strict';
import { eventually, lineTo, open, serve, sleep } from './start.mjs';

/** The picture goes on within so long after a cut (ms), and what happened is said; slow machines take longer. */
const LATE = 6_000;
/** Within so long (ms) a page looks for its session again. */
const LOOKS = 2_500;

export async function troubles({ browser, server, line, program, page }) {
  const cut = await cuts(browser, server, line);
  const stays = await given(browser, server, line);
  const rate = await crawls(browser, server, page);
  await none(browser, line);
  await stays();
  const killed = await kills(browser, program, page);
  await drains(browser, program, page);
  return { cut_ms: Math.round(cut), killed_ms: Math.round(killed), slow_line_rate: rate };
}

async function cuts(browser, { client }, line) {
  await client.create({ scene: 'hanging_sheet', sessionId: 'to-cut', stepLimit: 0n });
  const tab = await open(browser, `${line.address}?session=to-cut`, { lost: true });
  await tab.ready();
  await client.play('to-cut', { realTimeFactor: 1 });
  let took = 0;
  for (let i = 0; i < 3; i++) {
    await eventually(async () => (await tab.text('state')) === 'Playing', 'it plays', LATE);
    line.cut();
    await sleep(50);
    const before = await tab.drawn();
    took = Math.max(took, await eventually(async () => (await tab.drawn()) > before + 2, 'the picture goes on', LATE));
  }
  await eventually(async () => !(await tab.notice()).includes('lost'), 'no trouble stands', LATE);
  // A tab has one stream, also after cuts.
  await eventually(async () => (await client.get('to-cut')).watcherCount === 1, 'one stream is left', LATE);
  await tab.close();
  await eventually(async () => (await client.get('to-cut')).watcherCount === 0, 'none watches once the tab is closed', LATE);
  return took;
}

/** A slow line is asked for less than it carries, so that the picture is not old. */
async function crawls(browser, { client }, page) {
  await client.create({ scene: 'demo', sessionId: 'slow-line', stepLimit: 0n });
  const { port } = new URL(client.address);
  // Three frames per second, each of 7744 particles: a machine with much other work makes more.
  const line = await lineTo(Number(port), page, 3 * 7744 * 12);
  const tab = await open(browser, `${line.address}?session=slow-line`);
  await tab.ready();
  await client.play('slow-line', { realTimeFactor: 0.3 });
  await eventually(() => tab.page.evaluate(() => Number(document.getElementById('rate').value) < 60), 'a slow line is noticed');
  const rate = await tab.page.evaluate(() => Number(document.getElementById('rate').value));
  assert.ok(rate <= 3, `${rate} pictures per second are asked for`);
  await client.pause('slow-line');
  await tab.leave();
  line.close();
  return rate;
}

/** Deleted by another, given to another. What is returned checks later that nothing came of it. */
async function given(browser, { client }, line) {
  await client.create({ scene: 'hanging_sheet', sessionId: 'given' });
  const tab = await open(browser, `${line.address}?session=given`);
  await tab.ready();
  await client.delete('given');
  await eventually(async () => (await tab.notice()).startsWith('This session was deleted.'), 'it is said', LATE);
  await client.create({ scene: 'demo', sessionId: 'given' });
  const [drawn, since] = [await tab.drawn(), performance.now()];
  return async () => {
    await sleep(Math.max(0, LOOKS - (performance.now() - since)));
    assert.equal(await tab.drawn(), drawn, 'nothing of the other session is drawn');
    await tab.leave();
  };
}

async function none(browser, line) {
  const tab = await open(browser, `${line.address}?session=never-made`, { lost: true });
  await tab.ready();
  assert.match(await tab.notice(), /^No session has this id\./);
  await tab.page.click('#notice-deeds a');
  await tab.page.waitForURL(line.address);
  await tab.leave();
}

/** Killed, and started on its port with the same token: nothing of its other sessions is shown as this one. */
async function kills(browser, program, page) {
  const first = await serve(program);
  const line = await lineTo(first.port, page);
  await first.client.create({ scene: 'hanging_sheet', sessionId: 'killed', stepLimit: 0n });
  const [tab, list] = [
    await open(browser, `${line.address}?session=killed`, { lost: true }), await open(browser, line.address, { lost: true }),
  ];
  await tab.ready();
  await list.ready();
  await first.client.play('killed', { realTimeFactor: 1 });
  await eventually(async () => (await tab.text('state')) === 'Playing', 'it plays', LATE);
  await first.stop('SIGKILL');
  line.cut();
  const said = await eventually(async () => (await tab.notice()).startsWith('The connection to the server is lost.'), 'it is said', LATE);
  await eventually(async () => (await list.notice()).startsWith('The connection to the server is lost.'), 'the list says it, too', LATE);

  const second = await serve(program, { port: first.port });
  await second.client.create({ scene: 'demo', sessionId: 'killed' });
  const drawn = await tab.drawn();
  await eventually(async () => /^Another session has this id now\.|^This session is not there any more\./.test(await tab.notice()), `what is there is offered: ${await tab.notice()}`, 2 * LATE);
  await sleep(500);
  assert.ok((await tab.drawn()) <= drawn + 1, 'no frame of the other session is drawn');
  assert.equal(await tab.page.evaluate(() => window.nappe.positions().length), 3 * await tab.page.evaluate(() => window.nappe.session.newest.topology.particleCount));
  await eventually(() => list.page.evaluate(() => document.querySelectorAll('.card').length === 1), 'the list goes on by itself', 2 * LATE);
  await tab.leave();
  await list.leave();
  line.close();
  await second.stop();
  return said;
}

async function drains(browser, program, page) {
  const server = await serve(program);
  const line = await lineTo(server.port, page);
  await server.client.create({ scene: 'hanging_sheet', sessionId: 'drained', stepLimit: 0n });
  const tab = await open(browser, `${line.address}?session=drained`, { lost: true, dark: true });
  await tab.ready();
  await server.stop('SIGTERM');
  await eventually(async () => (await tab.notice()).startsWith('The server is shutting down.'), 'that the server shuts down is said', LATE);
  await tab.leave();
  line.close();
}
