// Diagnostics of the last 60 s, for plots.

import type { Diagnostics } from '../scene.ts';

/** Simulated seconds that are kept, and frames at most: those of a minute at 60 per second. */
const SECONDS = 60;
const MOST = 3600;

export class Minute {
  private readonly kept: Diagnostics[] = [];

  /** From the oldest to the newest. */
  get frames(): readonly Diagnostics[] {
    return this.kept;
  }

  /** A frame that is no later than the newest is left out. */
  add(frame: Diagnostics): void {
    const newest = this.kept.at(-1);
    if (newest !== undefined && frame.time <= newest.time) return;
    this.kept.push(frame);
    const old = this.kept.findIndex(({ time }) => time >= frame.time - SECONDS);
    this.kept.splice(0, Math.max(old, this.kept.length - MOST));
  }
}
