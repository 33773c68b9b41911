// The frames and the diagnostics of a session, with reconnect and resume.
//
// Enters: messages of the two streams. Leaves: frames and diagnostics; changes of state and the end go to the caller's
// functions. A stream that comes back asks for the next frame (every frame) or the newest (latest), of the session that
// it began with: one that was given the same id later is refused with SESSION_REPLACED.

import { create } from '@bufbuild/protobuf';
import { callable, checkSignal, flag, list, OPTIONS, real, record, whole, word, type Whole } from './checks.ts';
import { broken, refused } from './errors.ts';
import { fieldNumber, FrameJoiner, type FieldName, type LiveFrame } from './frame.ts';
import { Encoding, type Diagnostics } from './gen/nappe/v1/frame_pb.ts';
import {
  Delivery, SimulationService, WatchDiagnosticsRequestSchema, WatchDiagnosticsResponseSchema, WatchFramesRequestSchema, WatchFramesResponseSchema,
  type Progress, type SessionEnd, type StateChange,
} from './gen/nappe/v1/simulation_pb.ts';
import { decoded, stream, type Answer, type Target } from './grpcweb.ts';
import { named, PRECISIONS, type PrecisionName, type SessionRef } from './requests.ts';
import { resuming, type Resuming, type Source } from './resume.ts';
import { sameTopology, TopologyJoiner, type Topology } from './topology.ts';
import { writable } from './written.ts';

/** How a stream is wanted, and what is told of it besides what it brings. */
export interface StreamOptions extends Resuming {
  /** Every frame, in order; otherwise the newest whenever the loop is ready. */
  every?: boolean;
  /** The first frame wanted, with `every`; absent: the newest. */
  from?: Whole;
  /** Most per second, without `every` (Hz). */
  rate?: number | bigint;
  /** How the session stands when the stream begins, and then whatever happens to it. */
  onChange?: (change: StateChange) => void;
  /** Nothing came for 5 s; the server is there. */
  onProgress?: (progress: Progress) => void;
  /** The session finished; the loop ends. */
  onEnd?: (end: SessionEnd) => void;
}

/** What frames hold, and what is told of them. */
export interface FrameOptions extends StreamOptions {
  /** Arrays besides positions. */
  fields?: readonly FieldName[];
  /** How numbers travel (default f32). */
  precision?: PrecisionName;
  /** Whether the session waits for this reader, with `every`, so that no frame is dropped before it came. */
  paced?: boolean;
  /** What the session is made of: before the first frame, and again only if it changed. */
  onTopology?: (topology: Topology) => void;
}

const CALLBACKS = ['onChange', 'onProgress', 'onEnd', 'onReconnect', 'onReconnected'];
const STREAM = ['every', 'from', 'rate', 'attempts', 'signal', ...CALLBACKS];
const FRAMES = [...STREAM, 'fields', 'precision', 'paced', 'onTopology'];

/** Checks the options of a stream, which may have these keys. */
function check(options: FrameOptions, keys: readonly string[]): void {
  const given = Object.entries(record(options, OPTIONS, keys)).filter(([, value]) => value !== undefined);
  for (const [name, value] of given) {
    if (name === 'every' || name === 'paced') flag(value, name);
    else if (name === 'from') whole(value, name);
    else if (name === 'rate') real(value, name, 0);
    else if (name === 'attempts' && value !== Infinity) whole(value, name);
    else if (name === 'precision') word(value, name, PRECISIONS);
    else if (name === 'fields') list(value, name);
    else if (name === 'signal') checkSignal(value);
    else if (name === 'onTopology' || CALLBACKS.includes(name)) callable(value, name);
  }
}

/** The frames of a session. */
export function frames(target: Target, session: SessionRef, options: FrameOptions): AsyncIterableIterator<LiveFrame> {
  check(options, FRAMES);
  return resuming(new Frames(target, session, options), options);
}

/** The diagnostics of a session, without particles. */
export function diagnostics(target: Target, session: SessionRef, options: StreamOptions): AsyncIterableIterator<Diagnostics> {
  check(options, STREAM);
  return resuming(new DiagnosticsSource(target, session, options), options);
}

/** What a session is made of: the beginning of a stream that is left then. */
export async function topology(target: Target, session: SessionRef, signal: AbortSignal | undefined): Promise<Topology> {
  checkSignal(signal);
  let found: Topology | null = null;
  const options: FrameOptions = { onTopology: (whole) => (found = whole), attempts: 0, ...(signal === undefined ? {} : { signal }) };
  const source = new Frames(target, session, options);
  // The first message after the topology says how the session stands.
  const until: Source<true> = {
    open: (ended) => source.open(ended),
    read: (bytes) => (source.read(bytes), found === null ? null : true),
    isOver: false,
    words: source.words,
  };
  for await (const _ of resuming(until, options)) break;
  if (found === null) throw broken(`${source.words} has no topology`);
  return found;
}

/** What both streams have. */
abstract class Watching<T> implements Source<T> {
  readonly #id: string;
  readonly #options: StreamOptions;
  /** The first frame wanted. */
  readonly #from: bigint | undefined;
  protected readonly target: Target;
  /** The newest that came. */
  protected change: StateChange | null = null;
  protected uid: string;
  /** The frame after the newest one given to the caller, or the first one wanted. */
  protected next: bigint | undefined;
  isOver = false;

  constructor(target: Target, session: SessionRef, options: StreamOptions) {
    const { sessionId, sessionUid } = named(session);
    this.target = target;
    this.#id = sessionId;
    this.uid = sessionUid;
    this.#options = options;
    this.#from = options.from === undefined ? undefined : BigInt(options.from);
    this.next = this.#from;
  }

  abstract open(signal: AbortSignal): Promise<Answer>;
  abstract read(bytes: Uint8Array): T | null;

  get words(): string {
    return `the stream of session '${this.#id}'`;
  }

  /** The fields that both requests have. */
  protected wanted(): { sessionId: string; sessionUid: string; delivery: Delivery; maxRateHz: number; fromFrame?: bigint } {
    const { every = false, rate = 0 } = this.#options;
    const fromFrame = every ? this.next : this.#from;
    return {
      sessionId: this.#id, sessionUid: this.uid, delivery: every ? Delivery.EVERY : Delivery.LATEST, maxRateHz: Number(rate),
      ...(fromFrame === undefined ? {} : { fromFrame }),
    };
  }

  protected changed(change: StateChange): null {
    this.change = writable(change);
    this.uid = change.sessionUid;
    this.#options.onChange?.(change);
    return null;
  }

  protected progressed(progress: Progress): null {
    this.#options.onProgress?.(writable(progress));
    return null;
  }

  protected ended(end: SessionEnd): null {
    this.isOver = true;
    this.#options.onEnd?.(writable(end));
    return null;
  }
}

class Frames extends Watching<LiveFrame> {
  readonly #options: FrameOptions;
  readonly #joiner: FrameJoiner;
  readonly #topologies = new TopologyJoiner();
  /** The newest given to the caller. */
  #topology: Topology | null = null;

  constructor(target: Target, session: SessionRef, options: FrameOptions) {
    super(target, session, options);
    const { fields = [] } = options;
    const unknown = fields.find((name) => fieldNumber(name) === undefined);
    if (unknown !== undefined) throw refused(`no array of a frame is called '${String(unknown)}': there are velocities, plastic_ratio, stress, force and acceleration`, 'fields');
    this.#options = options;
    this.#joiner = new FrameJoiner(fields);
  }

  open(signal: AbortSignal): Promise<Answer> {
    const { fields = [], precision = 'f32', paced = false } = this.#options;
    const request = create(WatchFramesRequestSchema, {
      ...this.wanted(),
      fields: (['positions', ...fields] as const).map(fieldNumber) as number[],
      encoding: precision === 'f64' ? Encoding.RAW_F64 : Encoding.RAW_F32,
      paceToWatcher: paced,
    });
    return stream(this.target, SimulationService.method.watchFrames, request, signal);
  }

  read(bytes: Uint8Array): LiveFrame | null {
    const { event } = decoded(WatchFramesResponseSchema, bytes);
    switch (event.case) {
      case 'topology': {
        this.uid = event.value.sessionUid;
        const whole = this.#topologies.add(event.value);
        const isNew = whole !== null && (this.#topology === null || !sameTopology(this.#topology, whole));
        if (isNew) this.#topology = whole;
        this.#joiner.begin(whole === null ? null : this.#topology);
        if (isNew) this.#options.onTopology?.(whole);
        return null;
      }
      case 'frame': {
        const frame = this.#joiner.add(event.value, bytes.length, this.change);
        if (frame !== null) this.next = frame.frame + 1n;
        return frame;
      }
      case 'change':
        return this.changed(event.value);
      case 'progress':
        return this.progressed(event.value);
      case 'end':
        return this.ended(event.value);
      default:
        return null; // an event of a newer server
    }
  }
}

class DiagnosticsSource extends Watching<Diagnostics> {
  open(signal: AbortSignal): Promise<Answer> {
    return stream(this.target, SimulationService.method.watchDiagnostics, create(WatchDiagnosticsRequestSchema, this.wanted()), signal);
  }

  read(bytes: Uint8Array): Diagnostics | null {
    const { event } = decoded(WatchDiagnosticsResponseSchema, bytes);
    switch (event.case) {
      case 'diagnostics':
        this.next = event.value.frame + 1n;
        return writable(event.value);
      case 'change':
        return this.changed(event.value);
      case 'progress':
        return this.progressed(event.value);
      case 'end':
        return this.ended(event.value);
      default:
        return null; // an event of a newer server
    }
  }
}
