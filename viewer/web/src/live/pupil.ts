// A tab that a link to one session let in, as a class opens it: it may watch that session, and has a copy of its own.
//
// Enters: the session of the address, when a link was opened. Leaves: three buttons: watch, my own copy, start again.

import { type Client, NappeError, type Session } from '../../../../client/typescript/src/index.ts';
import { element } from '../page/dom.ts';
import { pass } from '../page/notice.ts';
import { answering } from './late.ts';
import { refused } from './words.ts';

/** Paths of a proxy lead to other servers. */
const KEY = `nappe class ${location.pathname}`;

/** Keeps for this tab whether its token is good for a session, and for copies of it, alone. */
export async function learn(client: Client, sessionId: string): Promise<void> {
  // No change at all is refused to everybody, and says why.
  const error: unknown = await client.update(sessionId, {}).catch((error: unknown) => error);
  if (!(error instanceof NappeError)) return;
  if (error.isTransient) throw error;
  try {
    if (error.reason === 'LINK_TOO_NARROW') sessionStorage.setItem(KEY, sessionId);
    else sessionStorage.removeItem(KEY);
  } catch {
    // A browser that keeps nothing has no such buttons: the server refuses what the token is not good for.
  }
}

/** Shows the buttons of such a tab, which is at a session: whether it may do no more than watch that one. */
export function showPupil(client: Client, { sessionId }: Session): boolean {
  const shared = kept();
  if (shared === null) return false;
  element('pupil').hidden = false;
  const isShared = sessionId === shared;
  element('watch').setAttribute('aria-pressed', String(isShared));
  element('own').setAttribute('aria-pressed', String(!isShared));
  element('watch').addEventListener('click', () => go(shared));
  const copies = async () => (await client.list()).filter((session) => session.sessionId !== shared);
  const copy = async () => (await client.fork(shared)).sessionId;
  wire('own', async () => (await copies())[0]?.sessionId ?? await copy());
  wire('again', async () => {
    for (const session of await copies()) await client.delete(session);
    return copy();
  });
  return isShared;
}

/** A button that finds a session, and goes to it. */
function wire(id: string, find: () => Promise<string>): void {
  const button = element<HTMLButtonElement>(id);
  button.addEventListener('click', () => {
    button.disabled = true;
    const answered = answering('the copy');
    find().then(go, (error: unknown) => pass(refused('the copy', error))).finally(() => {
      answered();
      button.disabled = false;
    });
  });
}

function go(sessionId: string): void {
  location.assign(`?${new URLSearchParams({ session: sessionId })}`);
}

function kept(): string | null {
  try {
    return sessionStorage.getItem(KEY);
  } catch {
    return null;
  }
}
