// The stream of one session, which is asked for anew when something else is wanted of it.
//
// Enters: how often, and which fields. Leaves: frames, changes, how the line is. Of another session of the same id
// nothing comes.

import type {
  Client, LiveFrame, NappeError, Progress, Session, SessionEnd, StateChange, Topology,
} from '../../../client/typescript/src/index.ts';

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
  /** The stream ended by an error, and is not tried again. */
  ended(error: unknown): void;
}

export class Stream {
  /** Frames per second, at most. */
  private rate: number;
  private isColored = false;
  private abort: AbortController | null = null;
  private isLost = false;

  constructor(private readonly client: Client, private readonly session: Session, rate: number, private readonly events: StreamEvents) {
    this.rate = rate;
  }

  /** Asks for frames, in place of those that come now. */
  open(): void {
    this.close();
    const abort = new AbortController();
    this.abort = abort;
    void this.run(abort.signal);
  }

  close(): void {
    this.abort?.abort();
    this.abort = null;
  }

  get isOpen(): boolean {
    return this.abort !== null;
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
      if (!signal.aborted) this.abort = null;
    } catch (error) {
      if (signal.aborted) return;
      this.abort = null;
      events.ended(error);
    }
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
