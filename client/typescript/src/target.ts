// Which server is meant, and what it is shown.
//
// Enters: what a user or a page gives. Leaves: a target of calls, or an error that names what is wrong.

import { callable, OPTIONS, real, record, text } from './checks.ts';
import { refused } from './errors.ts';
import type { Target } from './grpcweb.ts';

/** How a server is reached. */
export interface ConnectOptions {
  /** What it is shown; none for one that asks for none. */
  token?: string | null;
  /** What sends requests in place of the global `fetch`. */
  fetch?: typeof fetch;
  /** Seconds without a byte after which a stream counts as broken (default 30). A server says something every 5 s. */
  silenceSeconds?: number | bigint;
}

/** Reads `HOST:PORT`, `http://...`, or an address relative to the page, such as `.`. */
export function readTarget(url: string, options: ConnectOptions): Target {
  record(options, OPTIONS, ['token', 'fetch', 'silenceSeconds']);
  const { token = null, fetch: sends = globalThis.fetch } = options;
  const silenceSeconds = real(options.silenceSeconds ?? 30, 'silenceSeconds');
  if (silenceSeconds <= 0) throw refused(`silenceSeconds is ${silenceSeconds}; allowed: numbers above 0`, 'silenceSeconds');
  callable(sends, 'fetch');
  return { address: readAddress(text(url, 'url')), token: readToken(token), fetch: sends, silenceSeconds };
}

/** Checks a token: bytes that no header takes are no broken connection. */
export function readToken(token: string | null): string | null {
  if (token === null || (typeof token === 'string' && /^[!-~]{16,512}$/.test(token))) return token;
  throw refused('the token is none: 16 to 512 printable characters of ASCII and no blanks', 'token');
}

function readAddress(url: string): string {
  const typed = /^[^\s:/]+:[0-9]{1,5}$|^\[[0-9A-Fa-f:.]+\]:[0-9]{1,5}$/.test(url) ? `http://${url}` : url;
  const page = (globalThis as { location?: { href: string } }).location?.href;
  let read: URL;
  try {
    read = new URL(typed, page);
  } catch {
    throw noAddress(url, 'it has no host and port');
  }
  if (read.protocol !== 'http:' && read.protocol !== 'https:') throw noAddress(url, 'only http and https are spoken');
  if (read.username !== '' || read.password !== '') throw noAddress(url, 'it has a user or a password; give the token by itself');
  return `${read.origin}${read.pathname}`.replace(/\/+$/, '');
}

const noAddress = (url: string, cause: string): Error =>
  refused(`'${url}' is not the address of a server: ${cause} (expected, for example, http://127.0.0.1:6277)`, 'url');
