// Who may look: the token is asked for, kept in the tab, and stands in no address.

import assert from 'node:assert/strict';
import { TOKEN, eventually, makeLink, open } from './start.mjs';

export async function door({ browser, server: { client }, line, page }) {
  await client.create({ scene: 'hanging_sheet', sessionId: 'behind' });
  const tab = await open(browser, line.address, { token: null, lost: true });
  await eventually(() => tab.page.isVisible('#door'), 'the token is asked for');
  assert.equal(await tab.page.isVisible('#desk'), false);
  const give = async (token) => {
    await tab.page.fill('#token', token);
    await tab.page.keyboard.press('Enter');
  };
  await give('f'.repeat(32));
  await eventually(async () => (await tab.text('door-why')).includes('not the token'), 'another token is none');
  await give(TOKEN);
  await tab.ready();
  await eventually(() => tab.page.isVisible('.card'), 'the list is shown');
  assert.equal(await tab.page.isVisible('#door'), false);
  await tab.page.reload();
  await tab.ready();
  assert.ok(await tab.page.isVisible('.card'), 'the tab keeps it');
  const kept = await tab.page.evaluate(() => [location.href, document.cookie, JSON.stringify(localStorage), JSON.stringify(history.state)].join(' '));
  assert.ok(!kept.includes(TOKEN), `the token stands where it should not: ${kept}`);
  await tab.leave();

  const wrong = await open(browser, `${line.address}?session=behind`, { token: 'e'.repeat(32), lost: true, dark: true });
  await eventually(() => wrong.page.isVisible('#door'), 'the token of another server is not enough');
  assert.match(await wrong.text('door-why'), /not the one of this server/);
  await wrong.page.fill('#token', TOKEN);
  await wrong.page.keyboard.press('Enter');
  await wrong.ready();
  assert.equal(await wrong.text('title'), (await client.get('behind')).title);
  await wrong.leave();
  // A server that has no page has no links.
  if (page === undefined) await links(browser, line);
  return {};
}

/** A link lets a tab in once, and the code is taken out of the address. */
async function links(browser, line) {
  const code = await makeLink(line.address);
  const first = await open(browser, `${line.address}?session=behind#${code}`, { token: null });
  await first.ready();
  assert.ok(await first.page.isVisible('#canvas'));
  assert.equal(first.page.url(), `${line.address}?session=behind`);
  await first.page.reload();
  await first.ready();
  assert.ok(await first.page.isVisible('#canvas'), 'the tab is let in again');
  await first.leave();

  const second = await open(browser, `${line.address}#${code}`, { token: null, lost: true });
  await eventually(() => second.page.isVisible('#door'), 'it works once');
  assert.match(await second.text('door-why'), /no longer good/);
  await second.leave();
}
