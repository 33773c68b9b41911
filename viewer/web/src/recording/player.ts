// Which frame is shown when: plays in real time, seeks, and waits for what is not decoded yet.

import type { Frame } from '../scene.ts';

/** Seconds that a single picture of the screen may take of the clock: a tab that slept does not jump. */
const MOST_SECONDS = 0.5;
/** Seconds that the last frame stays before a loop starts over. */
const REST = 0.5;

/** Frames by their index. */
export interface FrameSource {
  readonly frameCount: number;
  /** s. */
  time(index: number): number;
  indexAt(time: number): number;
  /** The frame, if it is there already. */
  ready(index: number): Frame | null;
  frame(index: number): Promise<Frame>;
  prefetchAfter(index: number): void;
}

export interface PlayerEvents {
  show(frame: Frame, index: number): void;
  /** It plays now, or does not. */
  changed(): void;
  failed(error: unknown): void;
}

export class Player {
  /** Simulated seconds per second. */
  speed = 1;
  /** Starts over at the end, until it is paused. */
  loop = false;
  private shown = -1;
  private wanted = 0;
  private clock = 0;
  private last = 0;
  private running = false;
  private busy: Promise<void> | null = null;

  constructor(private readonly source: FrameSource, private readonly events: PlayerEvents) {}

  get playing(): boolean {
    return this.running;
  }

  /** Index of the frame that is shown, or will be as soon as it is decoded. */
  get index(): number {
    return this.wanted;
  }

  /** Starts over at the end. */
  play(): void {
    const last = this.source.frameCount - 1;
    if (this.running || last < 1) return;
    if (this.wanted >= last) this.wanted = 0;
    this.clock = this.source.time(this.wanted);
    this.last = performance.now();
    this.running = true;
    this.events.changed();
    requestAnimationFrame((now) => this.tick(now));
  }

  pause(): void {
    if (!this.running) return;
    this.running = false;
    this.events.changed();
  }

  /** Resolves when the frame, or one that was asked for later, is drawn. */
  async seek(index: number): Promise<void> {
    this.wanted = Math.min(Math.max(Math.round(index), 0), this.source.frameCount - 1);
    this.clock = this.source.time(this.wanted);
    await this.reach();
  }

  private tick(now: number): void {
    if (!this.running) return;
    const passed = Math.min(Math.max(now - this.last, 0) / 1e3, MOST_SECONDS);
    this.last = now;

    // The clock waits for a frame that is being decoded.
    if (this.busy === null) {
      this.clock += this.speed * passed;
      this.wanted = this.source.indexAt(this.clock);
      this.source.prefetchAfter(this.wanted);
      if (this.wanted !== this.shown) this.reach().catch(() => undefined);
      if (this.shown === this.source.frameCount - 1 && this.wanted === this.shown && !this.startOver()) return this.pause();
    }
    requestAnimationFrame((next) => this.tick(next));
  }

  /** At the end of a loop: rests there, then goes back to the start; false if there is no loop. */
  private startOver(): boolean {
    const end = this.source.time(this.source.frameCount - 1);
    if (this.loop && this.clock > end + this.speed * REST) {
      this.clock = this.source.time(0);
      this.wanted = 0;
      this.reach().catch(() => undefined);
    }
    return this.loop;
  }

  /** Shows the wanted frame: now if it is ready, or else after it is decoded, one block at a time. */
  private reach(): Promise<void> {
    if (this.busy !== null) return this.busy;
    const ready = this.source.ready(this.wanted);
    if (ready !== null) {
      this.show(ready, this.wanted);
      return Promise.resolve();
    }
    this.busy = this.chase().finally(() => (this.busy = null));
    return this.busy;
  }

  private async chase(): Promise<void> {
    try {
      while (this.shown !== this.wanted) {
        const target = this.wanted;
        this.show(await this.source.frame(target), target);
      }
    } catch (error) {
      this.pause();
      this.events.failed(error);
      throw error;
    }
  }

  private show(frame: Frame, index: number): void {
    this.shown = index;
    this.events.show(frame, index);
  }
}
