// A frame at which a session begins instead of at the start of its scene.
//
// Enters: a frame of a stream. Leaves: its particles, sent, and what a request says of it; what is wrong with a session that does not
// begin there.

import { create, type MessageShape } from '@bufbuild/protobuf';
import type { Numbers } from './arrays.ts';
import { real, whole, wrong } from './checks.ts';
import { Code, NappeError, refused } from './errors.ts';
import type { LiveFrame } from './frame.ts';
import {
  AppendUploadRequestSchema, BeginSchema, BeginUploadRequestSchema, FinishUploadRequestSchema, MeshHeaderSchema, Precision, SimulationService,
  type Begin, type Session,
} from './gen/nappe/v1/simulation_pb.ts';
import { call, type Target } from './grpcweb.ts';

/** Largest piece of an upload (bytes). */
const PIECE_BYTES = 1 << 20;
/** Longest time of one call of an upload (s): the server gives up before, where the rate of bytes is too low. */
const UPLOAD_SECONDS = 120;

const { method: METHODS } = SimulationService;

/** A frame to begin at, as it was when it was given. */
export interface Begun {
  name: string;
  begin: MessageShape<typeof BeginSchema>;
  header: MessageShape<typeof MeshHeaderSchema>;
  /** Positions, then velocities, in binary64. */
  bytes: Uint8Array<ArrayBuffer>;
  /** The precisions in which it is exact. */
  holds: ('f32' | 'f64')[];
}

/** Reads and copies a frame that a caller gives. */
export function readBegun(frame: LiveFrame): Begun {
  const arrays = stateOf(frame);
  const name = `frame ${frame.frame}`;
  const [positions, velocities] = arrays.map((array) => Float64Array.from(array));
  const bytes = new Uint8Array(positions.byteLength + velocities.byteLength);
  bytes.set(new Uint8Array(positions.buffer), 0);
  bytes.set(new Uint8Array(velocities.buffer), positions.byteLength);
  const count = BigInt(positions.length / 3);
  const isWide = arrays.some((array) => array instanceof Float64Array);
  const isNarrow = !isWide || arrays.every((array) => array.every((number) => Math.fround(number) === number));
  return {
    name, bytes,
    begin: create(BeginSchema, {
      step: whole(frame.step, 'begin.step'), timeSeconds: real(frame.time, 'begin.time'),
      carried: frame.carried ?? undefined,
    }),
    header: create(MeshHeaderSchema, { name, pointCount: count, velocityCount: count }),
    holds: [...(isWide ? ['f64' as const] : []), ...(isNarrow ? ['f32' as const] : [])],
  };
}

/** The positions and velocities of a frame. */
function stateOf(frame: unknown): [Numbers, Numbers] {
  const allowed = 'a frame of client.frames with the fields positions and velocities';
  const { positions, fields } = (typeof frame === 'object' && frame !== null ? frame : {}) as Partial<LiveFrame>;
  if (!isNumbers(positions)) throw wrong(frame, 'begin', allowed);
  const velocities = fields?.velocities;
  if (!isNumbers(velocities) || velocities.length !== positions.length) throw refused(`begin has no velocities; allowed: ${allowed}`, 'begin');
  return [positions, velocities];
}

const isNumbers = (value: unknown): value is Numbers => value instanceof Float32Array || value instanceof Float64Array;

/** Sends the particles of a frame, and gives what a request says of it. */
export async function sendBegun(target: Target, { begin, header, bytes }: Begun, signal: AbortSignal | undefined): Promise<Begin> {
  const bounds = { seconds: UPLOAD_SECONDS, signal };
  const announced = create(BeginUploadRequestSchema, { header: { case: 'mesh', value: header } });
  const { uploadId } = await call(target, METHODS.beginUpload, announced, bounds);
  for (let at = 0; at < bytes.length; at += PIECE_BYTES) {
    const piece = create(AppendUploadRequestSchema, { uploadId, offset: BigInt(at), data: bytes.subarray(at, at + PIECE_BYTES) });
    await call(target, METHODS.appendUpload, piece, bounds);
  }
  const { meshId } = await call(target, METHODS.finishUpload, create(FinishUploadRequestSchema, { uploadId }), bounds);
  begin.uploadId = meshId;
  return begin;
}

/** What is wrong with a session that was to begin at a frame; null if nothing is. */
export function beginFault({ name, begin: { step }, holds }: Begun, session: Session): NappeError | null {
  if (session.step !== step) {
    return new NappeError(Code.UNIMPLEMENTED, `the server does not begin at step ${step}, that of ${name}: its version is an earlier one`);
  }
  const own = session.precision === Precision.F64 ? 'f64' : 'f32';
  if (holds.includes(own)) return null;
  const allowed = `a frame in ${own}, or precision '${holds[0]}', which goes on in that of the frame`;
  return refused(`begin is in ${holds[0]}, and the session is to be in ${own}; allowed: ${allowed}`, 'begin');
}
