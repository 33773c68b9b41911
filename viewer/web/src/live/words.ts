// What the live page says of troubles, in words and with what helps.
//
// Enters: errors and failures of the client. Leaves: notices.

import { Code, type Failure, NappeError, failureError } from '../../../../client/typescript/src/index.ts';
import type { Refused } from './files.ts';
import type { Deed, Notice } from '../page/notice.ts';

/** To the list of sessions. */
const LIST: Deed = { label: 'Sessions', href: './' };
const AGAIN: Deed = { label: 'Open it', act: () => location.reload() };

/** The connection broke, and is tried again for the `attempt`-th time. */
export function lost(attempt: number): Notice {
  const tries = attempt < 2 ? '' : `, for the ${ordinal(attempt)} time now`;
  return {
    kind: 'trouble', what: `The connection to the server is lost. It is tried again${tries}.`,
    remedy: 'Look whether the server runs and the port is still forwarded. The page goes on by itself.',
  };
}

export const back: Notice = { kind: 'news', what: 'The connection is back.', remedy: '' };

export const draining: Notice = {
  kind: 'trouble', what: 'The server is shutting down.', remedy: 'Its sessions end with it. The page goes on once a server answers here again.',
};

export const deleted: Notice = {
  kind: 'failure', what: 'This session was deleted.', remedy: 'The picture is the last that came.', deeds: [LIST],
};

export const gone: Notice = {
  kind: 'failure', what: 'This session is not there any more.',
  remedy: 'It was deleted, or the server was started again: sessions do not outlive it.', deeds: [LIST],
};

export const absent: Notice = { kind: 'failure', what: 'No session has this id.', remedy: 'The list has those that there are.', deeds: [LIST] };

export const replaced: Notice = {
  kind: 'failure', what: 'Another session has this id now.',
  remedy: 'The one that was shown is gone; nothing of the other one is shown here yet.', deeds: [AGAIN, LIST],
};

/** The session came to its end, after some steps. */
export function finished(step: bigint): Notice {
  return { kind: 'news', what: `The session finished after ${step.toLocaleString('en')} steps.`, remedy: 'A fork goes on from here.' };
}

/** The session failed. */
export function failed(failure: Failure): Notice {
  const { isDivergence, remedy } = failureError(failure);
  const where = failure.particle === undefined ? '' : `, particle ${failure.particle}`;
  const time = Number(failure.timeSeconds.toPrecision(6));
  return {
    kind: 'failure', what: `${isDivergence ? 'Diverged' : 'Failed'} at ${time} s: step ${failure.step}${where} (${failure.reason})`,
    remedy: [failure.message, remedy].filter((part) => part !== null && part !== '').map(sentence).join(' '), deeds: [LIST],
  };
}

/** Why the token was not enough. */
export function shut(error: NappeError): string {
  if (error.reason === 'LINK_NOT_FOUND') return 'The link that was opened is no longer good: it works once, and for ten minutes. Make another one, or give the token.';
  if (error.reason === 'TOKEN_WRONG') return 'The token that this tab has is not the one of this server, which has a new one if it was started again.';
  return 'It is how the server knows who may call it.';
}

/** Other pages of this browser have all places among its streams. */
export const crowded: Notice = {
  kind: 'trouble', what: 'Four other pages of this browser watch this server already, which is as many as its connections allow.',
  remedy: 'This page steers its session all the same. Its picture goes on once one of the others is closed, or its tab is not seen for some seconds.',
};

/** A call that has no answer yet. */
export function late(doing: string): Notice {
  return {
    kind: 'trouble', what: `${capital(doing)} has no answer yet.`,
    remedy: 'A step that takes long delays it, a slow line, or other pages of this browser that hold its connections to the server: close one.',
  };
}

/** A call that did not do what it should. */
export function refused(doing: string, error: unknown): Notice {
  const known = error instanceof NappeError ? error : null;
  if (known?.isTransient === true) {
    return { kind: 'trouble', what: `The server did not answer: ${doing} may not have been done.`, remedy: 'Try again once the connection is back.' };
  }
  const why = sentence(error instanceof Error ? error.message : String(error));
  return { kind: 'trouble', what: `${capital(doing)} was refused: ${why}`, remedy: known?.remedy ?? '' };
}

/** A file on its way to the server. */
export function sending(file: string): Notice {
  return { kind: 'news', what: `${file} is sent to the server.`, remedy: '' };
}

/** A file that the page does not take. */
export function notTaken({ file, why, remedy }: Refused): Notice {
  return { kind: 'trouble', what: `${file} ${file.includes(', ') ? 'were' : 'was'} refused: ${sentence(why)}`, remedy };
}

/** A file that the server refused: what it calls the scene has the name of the file. */
export function refusedFile(file: string, error: unknown): Notice {
  const known = error instanceof NappeError ? error : null;
  if (known?.isTransient === true) return refused(`the session of ${file}`, error);
  const said = (error instanceof Error ? error.message : String(error)).replace(/^scene:/gm, () => `${file}:`);
  const what = said.startsWith(`${file}:`) ? `Refused: ${sentence(said)}` : `${file} was refused: ${sentence(said)}`;
  return { kind: 'trouble', what, remedy: known?.remedy ?? '' };
}

/** What is odd about a scene, but does not stop it. */
export function odd(warnings: readonly string[]): Notice {
  return { kind: 'news', what: warnings.map(sentence).join(' '), remedy: '' };
}

/** The server is reached, but what it sends cannot be shown. */
export function unreadable(error: unknown): Notice {
  const why = sentence(error instanceof Error ? error.message : String(error));
  const remedy = error instanceof NappeError && error.remedy !== null ? error.remedy : 'Reload the page; the server may be of another version.';
  return { kind: 'failure', what: `The session cannot be shown: ${why}`, remedy, deeds: [{ label: 'Reload', act: () => location.reload() }, LIST] };
}

/** Whether an error says that the token is missing, wrong, or for another server. */
export const isShut = (error: unknown): error is NappeError => error instanceof NappeError && error.code === Code.UNAUTHENTICATED;

export const capital = (words: string): string => `${words[0].toUpperCase()}${words.slice(1)}`;

function ordinal(number: number): string {
  const ending = number % 100 > 10 && number % 100 < 14 ? undefined : ['st', 'nd', 'rd'][(number % 10) - 1];
  return `${number}${ending ?? 'th'}`;
}

function sentence(text: string | null): string {
  const trimmed = (text ?? '').trim();
  return /[.!?]$/.test(trimmed) ? trimmed : `${trimmed}.`;
}
