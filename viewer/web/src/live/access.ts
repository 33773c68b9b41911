// Who may look: a code of the address, which works once, is traded for the server's token; without one, the token is
// asked for. The tab keeps it in its session storage, and it stands in no address.

import { type Client, NappeError } from '../../../../client/typescript/src/index.ts';
import { element } from '../page/dom.ts';
import { isShut, shut } from './words.ts';

/** Paths of a proxy lead to other servers. */
const KEY = `nappe token ${location.pathname}`;

/** Takes the code out of the address, so that it is in no history and no copied address; empty if there is none. */
export function takeCode(): string {
  const code = location.hash.replace(/^#/, '');
  if (location.hash !== '') history.replaceState(history.state, '', location.pathname + location.search);
  return code;
}

/** Gives the client the token that the code is good for, or the one that the tab has. */
export async function enter(client: Client, code: string): Promise<void> {
  if (code === '') return show(client, kept());
  try {
    const token = await client.openLink(code);
    keep(token);
    show(client, token);
  } catch (error) {
    if (!(error instanceof NappeError) || error.isTransient) throw error;
    show(client, kept());
    // A tab that has the token needs no link, and a server without a token asks for none.
    try {
      await client.info();
    } catch (refusal) {
      if (isShut(refusal)) await ask(client, shut(error));
    }
  }
}

/** What a call gives; where it is refused for the token, another one is asked for, as often as needed. */
export async function admitted<T>(client: Client, call: () => Promise<T>): Promise<T> {
  for (;;) {
    try {
      return await call();
    } catch (error) {
      if (!isShut(error)) throw error;
      await ask(client, shut(error));
    }
  }
}

/** Asks for a token until the server takes one. Nothing else of the page is shown meanwhile. */
async function ask(client: Client, why: string): Promise<void> {
  const door = element('door');
  const others = ['desk', 'app'].map(element).filter((other) => !other.hidden);
  for (const other of others) other.hidden = true;
  door.hidden = false;
  element('door-why').textContent = why;
  const input = element<HTMLInputElement>('token');
  input.focus();
  for (;;) {
    await submitted();
    const token = input.value.trim();
    input.value = '';
    try {
      show(client, token);
      await client.info();
      keep(token);
      break;
    } catch (error) {
      element('door-why').textContent = isShut(error) ? 'This is not the token of the server.' : `${error instanceof Error ? error.message : String(error)}.`;
      input.focus();
    }
  }
  door.hidden = true;
  for (const other of others) other.hidden = false;
}

function submitted(): Promise<void> {
  return new Promise((resolve) => {
    element('door-form').addEventListener('submit', (event) => {
      event.preventDefault();
      resolve();
    }, { once: true });
  });
}

/** A server that asks for no token gives an empty one for a code. */
function show(client: Client, token: string | null): void {
  client.setToken(token === '' ? null : token);
}

/** A browser that keeps nothing asks again after a reload. */
function kept(): string | null {
  try {
    return sessionStorage.getItem(KEY);
  } catch {
    return null;
  }
}

function keep(token: string): void {
  try {
    sessionStorage.setItem(KEY, token);
  } catch {
    // The client has it until the page is left.
  }
}
