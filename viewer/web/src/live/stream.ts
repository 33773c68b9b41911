// The stream of one session, which is asked for anew when something else is wanted of it.
//
// Enters: how often, and which fields. Leaves: frames, changes, how the line is. Of another session of the same id
// nothing comes. It has a place among the streams of this browser for as long as it is open.

import type {
  Client, LiveFrame, NappeError, Progress, Session, SessionEnd, StateChange, Topology,
} from '../../../../client/typescript/src/index.ts';
import { Place } from './place.ts';

export interface StreamEvents {
  topology(topology: Topology): void;
  /** Whoever hears it releases the frame. */
  frame(frame: LiveFrame): void;
  change(change: StateChange): void;
  progress(progress: Progress): void;
  end(end: SessionEnd): void;
  /** The line broke, and is tried again for the `attempt`-th time. */
  lost(attempt: number): void;
  back(): void;
  /** Other pages of this browser have all places: frames come once one of them has left its own. */
  crowded(): void;
  /** It has a place after all. */
  seated(): void;
  /** The stream ended by an error, and is not tried again. */
  ended(error: unknown): void;
}

export class Stream {
  /** Frames per second, at most. */
  private rate: number;
  private isColored = false;
  private abort: AbortController | null = null;
  private isLost = false;
  /** It was said that other pages have all places. */
  private isCrowded = false;
  private readonly place = new Place();

  constructor(private readonly client: Client, private readonly session: Session, rate: number, private readonly events: StreamEvents) {
    this.rate = rate;
  }

  /** Asks for frames, instead of those that come now. */
  open(): void {
    this.abort?.abort();
    const abort = new AbortController();
    this.abort = abort;
    void this.run(abort.signal);
  }

  close(): void {
    this.abort?.abort();
    this.end();
  }

  /** Frames may come. */
  get isOpen(): boolean {
    return this.abort !== null && !this.isCrowded;
  }

  /** The line broke and is not back. */
  get waits(): boolean {
    return this.isLost;
  }

  setRate(rate: number): void {
    if (rate === this.rate) return;
    this.rate = rate;
    if (this.isOpen) this.open();
  }

  /** Whether frames have what the colours of snow show. */
  setColored(isColored: boolean): void {
    if (isColored === this.isColored) return;
    this.isColored = isColored;
    // A session that stands at its end has one more frame, with them.
    this.open();
  }

  private async run(signal: AbortSignal): Promise<void> {
    // What is said by a stream that was given up counts no more.
    const heard = <A extends unknown[]>(hear: (...said: A) => void) => (...said: A): void => {
      if (!signal.aborted) hear(...said);
    };
    const { events } = this;
    if (!(await this.takePlace(signal))) return;
    try {
      const frames = this.client.frames(this.session, {
        rate: this.rate, fields: this.isColored ? ['plastic_ratio'] : [], signal,
        onTopology: heard((topology: Topology) => events.topology(topology)),
        onChange: heard((change: StateChange) => this.changed(change)),
        onProgress: heard((progress: Progress) => events.progress(progress)),
        onEnd: heard((end: SessionEnd) => events.end(end)),
        onReconnect: heard((attempt: number, _error: NappeError) => {
          this.isLost = true;
          events.lost(attempt);
        }),
      });
      for await (const frame of frames) {
        if (signal.aborted) frame.release();
        else events.frame(frame);
      }
      if (!signal.aborted) this.end();
    } catch (error) {
      if (signal.aborted) return;
      this.end();
      events.ended(error);
    }
  }

  private end(): void {
    this.abort = null;
    this.place.leave();
  }

  /** Waits for a place; false if the stream is not wanted any more. */
  private async takePlace(signal: AbortSignal): Promise<boolean> {
    const isSeated = await this.place.take(signal, () => {
      this.isCrowded = true;
      this.events.crowded();
    });
    if (isSeated && this.isCrowded) {
      this.isCrowded = false;
      this.events.seated();
    }
    return isSeated;
  }

  /** Every stream begins with how the session stands: then the line is there. */
  private changed(change: StateChange): void {
    if (this.isLost) {
      this.isLost = false;
      this.events.back();
    }
    this.events.change(change);
  }
}
