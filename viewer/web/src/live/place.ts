// A place among the streams of this browser. Over HTTP/1.1 a browser has six connections to a server, and a stream holds one
// for as long as it is open: some are left for calls.
//
// Enters: a page that wants to watch. Leaves: its place, until it leaves it. All pages of one origin share the places, whatever
// they show.

/** Streams at a time, of all pages together. */
const PLACES = ['nappe stream 0', 'nappe stream 1', 'nappe stream 2', 'nappe stream 3'];

export class Place {
  private readonly locks = shared();
  /** Gives the place back; null where there is none. */
  private release: (() => void) | null = null;

  /** Resolves once there is a place, at once if there is one already; with false if it is no longer wanted. `waits` hears that none is free. */
  async take(signal: AbortSignal, waits: () => void): Promise<boolean> {
    const { locks } = this;
    if (locks === undefined) return !signal.aborted;
    for (const name of PLACES) {
      if (signal.aborted || this.release !== null) return !signal.aborted;
      if (await this.hold(locks, name, { ifAvailable: true }, signal)) return true;
    }
    if (signal.aborted) return false;

    waits();
    const waiting = new AbortController();
    const end = () => waiting.abort();
    signal.addEventListener('abort', end, { once: true });
    const has = await Promise.race(PLACES.map((name) => this.hold(locks, name, { signal: waiting.signal }, signal)));
    signal.removeEventListener('abort', end);
    // One is enough.
    end();
    return has;
  }

  leave(): void {
    this.release?.();
    this.release = null;
  }

  /** Resolves once the place of this name is held, which it is until it is left; with false if it is not. */
  private hold(locks: LockManager, name: string, options: LockOptions, signal: AbortSignal): Promise<boolean> {
    return new Promise((resolve) => {
      const granted = (lock: Lock | null): Promise<void> => {
        const isTaken = lock !== null && !signal.aborted && this.release === null;
        resolve(isTaken);
        return isTaken ? new Promise<void>((release) => (this.release = release)) : Promise.resolve();
      };
      // A browser that refuses locks to a page lets it watch without.
      locks.request(name, options, granted).catch((error: unknown) => resolve(!signal.aborted && !isAbort(error)));
    });
  }
}

const isAbort = (error: unknown): boolean => error instanceof DOMException && error.name === 'AbortError';

/** The locks that pages of this origin share; none where a browser has no locks, or calls and streams share one connection. */
function shared(): LockManager | undefined {
  const entries = performance.getEntriesByType('navigation') as PerformanceNavigationTiming[];
  const protocol = entries[0]?.nextHopProtocol ?? '';
  // Of pages that are not secure, browsers keep locks away.
  return /^h[23]/.test(protocol) ? undefined : (navigator.locks as LockManager | undefined);
}
