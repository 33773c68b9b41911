// Pieces of the wire to whole frames.
//
// Enters: messages of a stream, from a server that is not trusted. Leaves: frames whose arrays cover every particle
// with finite numbers, in memory that is used again once it is handed back.

import { Joining, Pool, type Numbers } from './arrays.ts';
import { broken } from './errors.ts';
import { Field, type Carried, type Diagnostics, type Frame as Wire } from './gen/nappe/v1/frame_pb.ts';
import type { StateChange } from './gen/nappe/v1/simulation_pb.ts';
import { type Pose, readPoses } from './poses.ts';
import { place, type Topology } from './topology.ts';
import { writable } from './written.ts';

/** Arrays in each frame besides positions. */
export type FieldName = 'velocities' | 'plastic_ratio' | 'stress' | 'force' | 'acceleration';

/** The number of each array on the wire, and its numbers per particle. */
const FIELDS: Record<FieldName | 'positions', { field: Field; width: number }> = {
  positions: { field: Field.POSITIONS, width: 3 },
  velocities: { field: Field.VELOCITIES, width: 3 },
  plastic_ratio: { field: Field.PLASTIC_RATIO, width: 1 },
  stress: { field: Field.STRESS_NORM, width: 1 },
  force: { field: Field.FORCES, width: 3 },
  acceleration: { field: Field.ACCELERATIONS, width: 3 },
};

/** The particles at one instant. */
export interface LiveFrame {
  /** Frame 0 is the initial state, and numbers only grow. */
  readonly frame: bigint;
  /** Steps taken before it. */
  readonly step: bigint;
  /** Simulated time (s). */
  readonly time: number;
  /** Hash of all on which further steps depend; null in frames that carry none. */
  readonly stateHash: bigint | null;
  /** Frames that were left out since the one before, of a stream of the newest. */
  readonly dropped: bigint;
  /** How the session stands: the newest change that came before the frame. */
  readonly session: StateChange | null;
  /** Of the step that made the frame. */
  readonly diagnostics: Diagnostics | null;
  readonly topology: Topology;
  /**
   * Where the colliders are that keys of the scene or calls move. Any other is where its velocity has brought it since
   * time 0, and is not turned.
   */
  readonly poses: readonly Pose[];
  /** What further steps depend on beside the arrays, for a session that begins at the frame; null in frames without velocities. */
  readonly carried: Carried | null;
  /** x y z of each particle (m). */
  readonly positions: Numbers;
  /** The arrays that were asked for: velocities (m/s), force (N) and acceleration (m/s²) have three numbers per particle, the others one. */
  readonly fields: Partial<Record<FieldName, Numbers>>;
  /** Bytes of the stream that brought it. */
  readonly bytes: number;
  /** Hands its arrays back: they are overwritten by frames that come later. */
  release(): void;
}

/** The number of an array on the wire. */
export const fieldNumber = (name: FieldName | 'positions'): Field | undefined => FIELDS[name]?.field;

/** A frame in the making. */
interface Making {
  wire: Wire;
  count: number;
  received: number;
  bytes: number;
  arrays: Map<Field, Joining>;
  poses: readonly Pose[];
}

/** Puts the frames of one stream together. */
export class FrameJoiner {
  readonly #names: readonly (FieldName | 'positions')[];
  readonly #pool = new Pool();
  #topology: Topology | null = null;
  #partial: Making | null = null;

  /** Of a stream that carries these arrays besides positions. */
  constructor(fields: readonly FieldName[]) {
    this.#names = ['positions', ...fields];
  }

  /** A stream begins, or begins anew: a frame in the making is void. */
  begin(topology: Topology | null): void {
    this.#topology = topology;
    this.#drop();
  }

  /** Takes the next piece, which came in so many bytes; the frame when its last one has come. */
  add(piece: Wire, bytes: number, session: StateChange | null): LiveFrame | null {
    const partial = this.#accept(piece);
    const particles = this.#topology?.particleCount ?? 0;
    const told = `frame ${piece.frame}`;
    for (const data of piece.fields) partial.arrays.get(data.field)?.append(data, particles, this.#pool, told);
    partial.received += 1;
    partial.bytes += bytes;
    if (partial.received < partial.count) return null;
    this.#partial = null;
    return this.#finish(partial, session);
  }

  /** The frame in the making that a piece continues, or a new one. */
  #accept(piece: Wire): Making {
    const { index, count } = place(piece);
    const begun = this.#partial;
    if (begun !== null && begun.wire.frame !== piece.frame) {
      throw broken(`frame ${begun.wire.frame} broke off after ${begun.received} of ${begun.count} pieces: frame ${piece.frame} began`);
    }
    const expected = begun?.received ?? 0;
    if (count === 0 || index !== expected || count !== (begun?.count ?? count)) {
      throw broken(`frame ${piece.frame}: piece ${index} of ${count} came where piece ${expected} was next`);
    }
    if (begun !== null) return begun;

    if (this.#topology?.id !== piece.topologyId) throw broken(`frame ${piece.frame} belongs to topology ${piece.topologyId}, which did not come`);
    if (!Number.isFinite(piece.timeSeconds)) throw broken(`frame ${piece.frame}: its time is ${piece.timeSeconds} s`);
    const poses = readPoses(piece, this.#topology);
    const arrays = new Map(this.#names.map((name) => [FIELDS[name].field, new Joining(name, FIELDS[name].width)]));
    this.#partial = { wire: piece, count, received: 0, bytes: 0, arrays, poses };
    return this.#partial;
  }

  #finish({ wire, arrays, bytes, poses }: Making, session: StateChange | null): LiveFrame {
    const topology = this.#topology as Topology;
    const told = `frame ${wire.frame}`;
    const whole = this.#names.map((name) => [name, (arrays.get(FIELDS[name].field) as Joining).whole(topology.particleCount, told)] as const);
    let held = whole.map(([, array]) => array);
    return writable({
      frame: wire.frame, step: wire.step, time: wire.timeSeconds, stateHash: wire.stateHash ?? null, dropped: wire.droppedCount,
      session, diagnostics: wire.diagnostics === undefined ? null : writable(wire.diagnostics), topology, poses, carried: wire.carried ?? null, positions: whole[0][1], fields: Object.fromEntries(whole.slice(1)), bytes,
      release: () => {
        for (const array of held) this.#pool.give(array);
        held = [];
      },
    });
  }

  #drop(): void {
    for (const { taken } of this.#partial?.arrays.values() ?? []) {
      if (taken !== null) this.#pool.give(taken);
    }
    this.#partial = null;
  }
}
