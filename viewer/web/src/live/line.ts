// What the line carries: frames and bytes per second, and frames that were left out.

/** What is counted is that of so long (ms). */
const WINDOW = 1_000;
/** Of what the line carried in the second that told of it, so much is asked for. */
const SHARE = 0.7;
/** Of the frames that could come, a line that carries less is the one that bounds them. */
const NEARLY_ALL = 0.8;

interface Passed {
  /** ms. */
  at: number;
  bytes: number;
  /** Frames that were shown, and that were not, in the browser or before. */
  shown: number;
  leftOut: number;
}

export interface Carried {
  /** Per second. */
  frames: number;
  bytes: number;
  leftOut: number;
}

export class Line {
  private readonly passed: Passed[] = [];

  /** A frame came, after others that the server left out. */
  received(at: number, bytes: number, dropped: number): void {
    this.add({ at, bytes, shown: 0, leftOut: dropped });
  }

  /** A frame was drawn, and others that came before it were not. */
  drawn(at: number, unseen: number): void {
    this.add({ at, bytes: 0, shown: 1, leftOut: unseen });
  }

  /** In the last second. */
  read(now: number): Carried {
    this.forget(now);
    const sum = (of: (passed: Passed) => number) => this.passed.reduce((total, passed) => total + of(passed), 0);
    return { frames: sum(({ shown }) => shown), bytes: sum(({ bytes }) => bytes), leftOut: sum(({ leftOut }) => leftOut) };
  }

  private add(passed: Passed): void {
    this.passed.push(passed);
    this.forget(passed.at);
  }

  private forget(now: number): void {
    const first = this.passed.findIndex(({ at }) => at > now - WINDOW);
    this.passed.splice(0, first < 0 ? this.passed.length : first);
  }
}

/**
 * Whether a second with `received` frames of `made` tells what the line carries. One in which all of a few frames came does
 * not: more may be made later.
 */
export function isTold(received: number, made: number, rate: number): boolean {
  return made >= NEARLY_ALL * rate || received < NEARLY_ALL * made;
}

/**
 * Pictures per second to ask for, by what such a second brought: `received` frames of `made`, at `rate` at most. A line
 * that carries what is made keeps its rate.
 */
export function rateFor(received: number, made: number, rate: number): number {
  const possible = Math.min(made, rate);
  if (received >= NEARLY_ALL * possible) return rate;
  return Math.max(1, Math.floor(SHARE * received));
}
