// The hand: a pin and a patch of the cloth are drawn along, and a tab that dies lets go. Sliders: each is a change at a step.

import assert from 'node:assert/strict';
import { join } from 'node:path';
import { eventually, open } from './start.mjs';

/** Of `hanging_sheet`: particles in a row, simulated length of a step (s), steps between frames. */
const SIDE = 40;
const DT = 0.005;
const INTERVAL = 4;
/** Steps after which a pull that nobody renews is over. */
const STEPS = Math.round(0.5 / DT);

export async function hand({ browser, server: { client }, line, pictures }) {
  const beside = await pins(browser, client, line);
  const moved = await pulls(browser, client, line, pictures);
  await dies(browser, client, line);
  await turns(browser, client, line);
  await sliders(browser, client, line, pictures);
  return { pin_beside_pixels: Number(beside.toFixed(2)), patch_moved_mm: Number((1e3 * moved).toFixed(2)) };
}

/** A sheet that stands, in a view that nothing but a hand moves, with the hand on. */
async function begin(browser, client, line, sessionId) {
  const session = await client.create({ scene: 'hanging_sheet', sessionId, stepLimit: 0n });
  const tab = await open(browser, `${line.address}?session=${sessionId}`, { viewport: { width: 900, height: 560 } });
  await tab.ready();
  await tab.page.focus('#canvas');
  await tab.page.keyboard.press('-');
  await tab.page.keyboard.press('g');
  assert.equal(await tab.page.getAttribute('#hand', 'aria-pressed'), 'true');
  return { session, tab, page: tab.page };
}

const camera = (page) => page.evaluate(() => window.nappe.session.picture.view.camera());

/** Where a particle of the picture is seen in the window. */
const seen = (page, particle) => page.evaluate((index) => {
  const { view } = window.nappe.session.picture;
  return view.seen(view.particle(index));
}, particle);

/** Presses at a place, and draws along by so many pixels; what was sent last is answered then. */
async function draw(page, { x, y }, [right, down]) {
  await page.mouse.move(x, y);
  await page.mouse.down();
  await page.mouse.move(x + right, y + down, { steps: 8 });
  await eventually(() => page.evaluate(() => !window.nappe.session.hand.calls.isBusy), 'the server has answered');
}

async function pins(browser, client, line) {
  const { tab, page } = await begin(browser, client, line, 'led');
  const view = await camera(page);
  const width = await page.evaluate(() => document.getElementById('canvas').clientWidth);
  const pin = await page.evaluate(() => window.nappe.session.picture.view.bodies[0].pins[0]);
  const [from, middle] = [await seen(page, pin), await seen(page, (SIDE * SIDE + SIDE) / 2)];
  const way = [0.6 * (middle.x - from.x), 0.6 * (middle.y - from.y)];
  await page.keyboard.press(' ');
  await draw(page, { x: from.x + 4, y: from.y + 5 }, way);
  assert.ok(await page.isVisible('#pull'), 'a line shows where it is drawn');
  await page.mouse.up();
  assert.equal(await page.isVisible('#pull'), false);
  const beside = async () => {
    const at = await seen(page, pin);
    return Math.hypot(at.x - (from.x + 4 + way[0]), at.y - (from.y + 5 + way[1]));
  };
  await eventually(async () => (await beside()) < 0.01 * width, 'the pin ends under the pointer');
  assert.ok(Math.hypot(...way) > 0.05 * width, 'it was led far');
  assert.deepEqual(await camera(page), view, 'the view did not turn');
  const found = await beside();
  await tab.leave();
  await client.delete('led');
  return found;
}

/** While the session stands, a pull is shown, and acts with the next step. */
async function pulls(browser, client, line, pictures) {
  const { session, tab, page } = await begin(browser, client, line, 'pulled');
  await client.step(session, 10 * INTERVAL);
  const isShown = (step) => () => page.evaluate((wanted) => window.nappe.session.newest?.step === BigInt(wanted) && window.nappe.session.live.waiting === null, step);
  await eventually(isShown(10 * INTERVAL), 'the steps are shown');
  const twin = await client.fork(session, { newSessionId: 'twin' });

  await draw(page, await seen(page, (SIDE * SIDE + SIDE) / 2), [90, 20]);
  const { particles, target, at } = await page.evaluate(() => {
    const { held, where } = window.nappe.session.hand;
    return { particles: [...held.hold.particles], target: held.target, at: held.hold.at(where) };
  });
  assert.ok(particles.length > 3 && particles.length <= 48, `${particles.length} particles`);
  assert.ok(await page.isVisible('#pull'));
  assert.equal((await client.get(session)).parameters.cloths[0].pullCount, 0, 'it waits for a step');

  await client.step(session, INTERVAL);
  await client.step(twin, INTERVAL);
  await eventually(isShown(11 * INTERVAL), 'the next frame is shown');
  assert.equal((await client.get(session)).parameters.cloths[0].pullCount, particles.length);
  if (pictures !== undefined) await page.screenshot({ path: join(pictures, 'pull.png') });
  const pulled = await page.evaluate((indices) => indices.map((index) => window.nappe.session.picture.view.particle(index)), particles);
  const free = await positionsOf(client, twin);
  const toTarget = target.map((part, axis) => part - at[axis]);
  const moved = particles.reduce((sum, particle, i) =>
    sum + toTarget.reduce((along, part, axis) => along + part * (pulled[i][axis] - free[3 * particle + axis]), 0), 0) / particles.length / Math.hypot(...toTarget);
  assert.ok(moved > 1e-4, `the patch moved by ${moved} m towards the pointer`);

  await page.mouse.up();
  await eventually(() => page.evaluate(() => !window.nappe.session.hand.calls.isBusy), 'letting go is sent');
  await client.step(session, INTERVAL);
  assert.equal((await client.get(session)).parameters.cloths[0].pullCount, 0, 'letting go ends the pull');
  await tab.leave();
  for (const { sessionId } of [session, twin]) await client.delete(sessionId);
  return moved;
}

/** Positions of the newest frame. */
async function positionsOf(client, session) {
  for await (const frame of client.frames(session)) {
    const positions = Float64Array.from(frame.positions);
    frame.release();
    return positions;
  }
  throw new Error('no frame came');
}

/** A tab that is killed has sent nothing: its pull ends by its time. */
async function dies(browser, client, line) {
  const { session, tab, page } = await begin(browser, client, line, 'dies');
  const pulled = async () => (await client.get(session)).parameters.cloths[0].pullCount > 0;
  await draw(page, await seen(page, (SIDE * SIDE + SIDE) / 2), [60, 0]);
  await client.step(session, 1);
  assert.ok(await pulled(), 'it pulls');
  const devtools = await page.context().newCDPSession(page);
  const crash = page.waitForEvent('crash');
  devtools.send('Page.crash').catch(() => undefined);
  await crash;
  await client.step(session, STEPS - 10);
  assert.ok(await pulled(), 'its time is not over');
  await client.step(session, 10);
  assert.equal(await pulled(), false, 'its time is over');
  await tab.close();
  await client.delete(session);
}

/** Beside the cloth the hand turns the view, and without it everywhere. */
async function turns(browser, client, line) {
  const { session, tab, page } = await begin(browser, client, line, 'turns');
  const { left, bottom } = await page.evaluate(() => {
    const { left, bottom } = document.getElementById('canvas').getBoundingClientRect();
    return { left, bottom };
  });
  const turned = async (place, what) => {
    const view = await camera(page);
    await draw(page, place, [40, -20]);
    await page.mouse.up();
    assert.notDeepEqual(await camera(page), view, what);
  };
  await turned({ x: left + 6, y: bottom - 30 }, 'beside the cloth');
  await page.keyboard.press('g');
  assert.equal(await page.getAttribute('#hand', 'aria-pressed'), 'false');
  await turned(await seen(page, (SIDE * SIDE + SIDE) / 2), 'the hand is off');
  await client.step(session, 1);
  assert.equal((await client.get(session)).parameters.cloths[0].pullCount, 0);
  await tab.leave();
  await client.delete(session);
}

async function sliders(browser, client, line, pictures) {
  const { session, tab, page } = await begin(browser, client, line, 'slid');
  if (!(await page.isVisible('#knobs'))) await page.click('#more');
  await page.click('#knobs');
  const row = (label) => page.locator('.knob', { has: page.getByText(label, { exact: true }) });
  const value = async (label) => Number((await row(label).locator('output').textContent()).split(' ')[0]);
  const shows = (label, expected) => eventually(async () => (await value(label)) === expected, `${label} shows ${expected}`);
  const said = (label, step) => eventually(async () => (await row(label).locator('small').textContent()) === `before step ${step}`, `${label} says step ${step}`);
  const stretch = async () => (await client.get(session)).parameters.cloths[0].springs.find(({ kind }) => kind === 1).minStiffness;
  const [STRETCH, GRAVITY] = ['sheet, stretch: stiffness', 'Gravity y'];
  assert.deepEqual([await value(STRETCH), await value(GRAVITY), await value('Drag')], [200, -9.81, 1e-4]);

  // The same change by a call before the same step gives the same bits.
  await client.step(session, 3);
  const twin = await client.fork(session);
  await row(STRETCH).locator('input').fill('600');
  await said(STRETCH, 3);
  const set = await value(STRETCH);
  assert.ok(set > 300 && set < 2_000, `${set} N/m`);
  await client.update(twin, { springs: [{ body: 'sheet', kind: 1, stiffness: set }] });
  const [ours, others] = [await client.step(session, 8), await client.step(twin, 8)];
  assert.notEqual(ours.stateHash, undefined);
  assert.equal(ours.stateHash, others.stateHash);
  assert.equal(await stretch(), set);

  await client.update(session, { drag: 0.01 });
  await client.step(session, 1);
  await shows('Drag', 0.01);
  await shows(STRETCH, set);
  if (pictures !== undefined) await page.screenshot({ path: join(pictures, 'sliders.png') });

  await page.click('#knobs-back');
  await said(STRETCH, 12);
  await client.step(session, 1);
  assert.equal(await stretch(), 200, 'the last change is taken back');
  await row(GRAVITY).locator('input').fill('500');
  await said(GRAVITY, 13);
  await client.step(session, 1);
  await shows(GRAVITY, 0);
  assert.deepEqual((await client.get(session)).parameters.gravity.y, 0);
  await page.click('#knobs-start');
  await said(GRAVITY, 14);
  await client.step(session, 1);
  const { gravity, cloths: [{ drag }] } = (await client.get(session)).parameters;
  assert.deepEqual([gravity.y, drag], [-9.81, 1e-4], 'all is as it was at first');

  // A slider that has the focus has the arrows, and no step is taken by them.
  const { step } = await client.get(session);
  await row('Wind x').locator('input').focus();
  await page.keyboard.press('ArrowRight');
  await said('Wind x', Number(step));
  assert.deepEqual([(await client.get(session)).step, await value('Wind x')], [step, 0.04]);
  await tab.leave();
  for (const { sessionId } of [session, twin]) await client.delete(sessionId);
}
