// A stream that is asked for again when its connection breaks.
//
// Enters: how to ask for it. Leaves: what its messages bring. What to ask for the next time is the source's to say.

import type { Whole } from './checks.ts';
import { Code, NappeError } from './errors.ts';
import { cancelled, type Answer } from './grpcweb.ts';

/** Attempts in a row, unless the caller says otherwise. */
const MAX_ATTEMPTS = 10;
/** Wait before the first attempt, and the longest before one (s). */
const [FIRST_WAIT, LONGEST_WAIT] = [0.1, 5];

/** What a caller wants to know of a connection. */
export interface Resuming {
  /** Attempts in a row to ask again for a stream that broke (default 10, 0.1 s to 5 s apart); 0: none. */
  attempts?: Whole;
  /** Ends the stream, with an error of code CANCELLED. */
  signal?: AbortSignal;
  /** The connection broke, or did not come back; this attempt is made next, the first being 1. */
  onReconnect?: (attempt: number, error: NappeError) => void;
  /** The connection is back, after so many attempts. */
  onReconnected?: (attempts: number) => void;
}

/** How to ask for a stream, from where it stands, and what its messages bring. */
export interface Source<T> {
  open(signal: AbortSignal): Promise<Answer>;
  /** Null where a message brings nothing by itself, as a piece of a frame. */
  read(bytes: Uint8Array): T | null;
  /** Whether the session ended, after which nothing comes. */
  readonly isOver: boolean;
  /** The stream in words, for messages. */
  readonly words: string;
}

/** What the source brings, until the session ends. Leaving the loop, or `return`, ends the stream, also while it waits. */
export function resuming<T>(source: Source<T>, options: Resuming): AsyncIterableIterator<T> {
  const controller = new AbortController();
  const items = read(source, options, controller);
  return {
    next: () => items.next(),
    return: async () => {
      controller.abort(LEFT);
      return items.return(undefined);
    },
    [Symbol.asyncIterator]() {
      return this;
    },
  };
}

/** Why a stream ends that nobody reads any more. */
const LEFT = Symbol('left');

async function* read<T>(source: Source<T>, options: Resuming, controller: AbortController): AsyncGenerator<T, undefined> {
  const { attempts = MAX_ATTEMPTS, signal, onReconnect, onReconnected } = options;
  const cancel = (): void => controller.abort(signal?.reason);
  if (signal?.aborted) cancel();
  signal?.addEventListener('abort', cancel);
  let failures = 0;
  let wasOpen = false;
  try {
    for (;;) {
      let answer: Answer | null = null;
      try {
        answer = await source.open(controller.signal);
        wasOpen = true;
        if (failures > 0) onReconnected?.(failures);
        for (let bytes = await answer.next(); bytes !== null; bytes = await answer.next()) {
          failures = 0;
          const item = source.read(bytes);
          if (item !== null) yield item;
          if (source.isOver) return;
        }
        throw new NappeError(Code.DATA_LOSS, `${source.words} stopped without its end`);
      } catch (error) {
        if (controller.signal.reason === LEFT) return;
        failures += 1;
        const isWorthIt = wasOpen && error instanceof NappeError && error.isTransient && failures <= attempts;
        if (!isWorthIt) throw error;
        onReconnect?.(failures, error);
        if (!(await pause(delay(failures, Math.random()), controller.signal))) return;
      } finally {
        answer?.close();
      }
    }
  } finally {
    signal?.removeEventListener('abort', cancel);
  }
}

/** Seconds to wait after so many failures in a row: they double, and each is drawn from half of that to all of it. */
export function delay(failures: number, draw: number): number {
  const longest = Math.min(FIRST_WAIT * 2 ** Math.min(failures - 1, 31), LONGEST_WAIT);
  return longest * (0.5 + 0.5 * draw);
}

/** Waits; false if the stream was left meanwhile. */
function pause(seconds: number, signal: AbortSignal): Promise<boolean> {
  return new Promise((resolve, reject) => {
    const end = (): void => {
      clearTimeout(timer);
      if (signal.reason === LEFT) resolve(false);
      else reject(cancelled(signal.reason));
    };
    const timer = setTimeout(() => {
      signal.removeEventListener('abort', end);
      resolve(true);
    }, seconds * 1000);
    if (signal.aborted) end();
    else signal.addEventListener('abort', end, { once: true });
  });
}
