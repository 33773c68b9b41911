// Sessions that are odd: one particle, no triangles, markup for words, long names, an end, a failure; browsers that lack
// something.

import assert from 'node:assert/strict';
import { eventually, open } from './start.mjs';

const EVIL = '</script><script>alert(1)</script><img src=x onerror=alert(2)>';

const body = (name, mesh, more = '') => `[[body]]\nname = ${JSON.stringify(name)}\nmesh = ${mesh}\nmass = { total = 1.0 }\n${more}\n`;
const scene = (title, bodies, head = '') => `version = 1\ntitle = ${JSON.stringify(title)}\ndt = 0.005\n${head}\n${bodies}`;

export async function odd({ browser, server: { client }, line }) {
  const show = async (sessionId, sceneText, then, options = {}) => {
    await client.create({ sceneText, sessionId, stepLimit: 0n });
    const tab = await open(browser, `${line.address}?session=${sessionId}`, options);
    await tab.ready();
    await then(tab);
    await tab.leave();
  };
  const plays = async (tab) => {
    const before = await tab.drawn();
    await tab.page.keyboard.press(' ');
    await eventually(async () => (await tab.drawn()) > before + 1, 'it moves');
    assert.equal(await tab.notice(), '');
    assert.ok(await tab.page.evaluate(() => window.nappe.litShare() > 0));
    await tab.page.keyboard.press(' ');
  };

  await show('one-particle', scene('One', body('alone', '{ chain = 1, spacing = 0.1 }')), async (tab) => {
    await plays(tab);
    await tab.page.click('#more');
    assert.match(await tab.text('about-rows'), /Particles1/);
  });
  await show('no-triangles', scene('Rope', body('rope', '{ chain = 40, spacing = 0.05 }', 'pins = ["first"]\nsprings.stretch = { stiffness = 500, damping = 0.1 }')), plays);
  await show('markup', scene(EVIL.slice(0, 60), body(EVIL.slice(0, 60), '{ chain = 9, spacing = 0.1 }')), async (tab) => {
    assert.equal(await tab.text('title'), EVIL.slice(0, 60));
    await tab.page.focus('#canvas');
    await tab.page.keyboard.press('f');
    assert.equal(await tab.text('follow'), `Follow ${EVIL.slice(0, 60)}`);
    assert.equal(await tab.page.evaluate(() => document.querySelectorAll('img').length), 0);
    await plays(tab);
  }, { viewport: { width: 360, height: 640 } });
  const list = await open(browser, line.address, { viewport: { width: 360, height: 640 } });
  await list.ready();
  assert.ok(await list.page.evaluate((words) => document.body.innerText.includes(words), EVIL.slice(0, 60)));
  assert.ok(await list.page.evaluate(() => document.documentElement.scrollWidth <= innerWidth));
  await list.leave();

  await ends(browser, client, line);
  await fails(browser, client, line);
  await lacks(browser, client, line);
  return {};
}

async function ends(browser, client, line) {
  await client.create({ scene: 'demo', sessionId: 'short', stepLimit: 8n });
  const tab = await open(browser, `${line.address}?session=short`, { dark: true });
  await tab.ready();
  await tab.page.keyboard.press(' ');
  await eventually(async () => (await tab.notice()).startsWith('The session finished after 8 steps.'), 'the end is said');
  assert.equal(await tab.text('state'), 'Finished');
  assert.ok(await tab.page.isDisabled('#play'));
  await tab.leave();
}

/** Explicit steps that are far too long: the page says where and what helps, and marks the particle. */
async function fails(browser, client, line) {
  const wild = body('wild', '{ grid = [12, 12], spacing = 0.1 }', 'integrator = "symplectic_euler"\nunchecked = true\nsprings.stretch = { stiffness = 1e7 }');
  await client.create({ sceneText: scene('Wild', wild), sessionId: 'wild', stepLimit: 0n });
  const tab = await open(browser, `${line.address}?session=wild`);
  await tab.ready();
  await tab.page.keyboard.press(' ');
  await eventually(async () => /^Diverged at [\d.]+ s: step \d+, particle \d+ \([A-Z_]+\)/.test(await tab.notice()), `the failure is said: ${await tab.notice()}`);
  assert.match(await tab.notice(), /Reduce dt/);
  assert.equal(await tab.text('state'), 'Failed');
  assert.ok(await tab.page.isDisabled('#play'));
  assert.equal(await tab.page.evaluate(() => document.getElementById('notice').dataset.kind), 'failure');
  await tab.leave();
}

async function lacks(browser, client, line) {
  await client.create({ scene: 'hanging_sheet', sessionId: 'unseen', stepLimit: 0n });
  const blind = await open(browser, `${line.address}?session=unseen`, { lost: true, dark: true });
  await blind.ready();
  assert.match(await blind.text('message'), /WebGL 2 is missing/);
  await blind.page.keyboard.press(' ');
  await eventually(async () => (await client.get('unseen')).state === 2, 'it is steered all the same');
  await eventually(() => blind.page.evaluate(() => document.querySelectorAll('.plot .uplot').length > 0), 'and plotted');
  await client.pause('unseen');
  await blind.leave();

  const lost = await open(browser, `${line.address}?session=unseen`, { lost: true });
  await lost.ready();
  const context = await lost.page.evaluateHandle(() => document.getElementById('canvas').getContext('webgl2').getExtension('WEBGL_lose_context'));
  await context.evaluate((extension) => extension.loseContext());
  await eventually(async () => /graphics were lost/.test(await lost.text('message')), 'it is said');
  await context.evaluate((extension) => extension.restoreContext());
  await eventually(async () => (await lost.text('message')) === '', 'and that they are back');
  await eventually(() => lost.page.evaluate(() => window.nappe.litShare() > 0.02), 'the picture is back');
  await lost.leave();
}
