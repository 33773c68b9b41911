// Requests: what a caller gives, as messages of the contract.
//
// Enters: arguments. Leaves: messages, or an error that names the argument.

import { create, type MessageInitShape, type MessageShape } from '@bufbuild/protobuf';
import { refused } from './errors.ts';
import {
  ChangesSchema, CreateSessionRequestSchema, ForkSessionRequestSchema, Precision, StepSessionRequestSchema, UpdateParametersRequestSchema,
} from './gen/nappe/v1/simulation_pb.ts';

/** A session: its id, or its id and its uid, as a `Session` has them. With the uid, another one of the same id is refused. */
export type SessionRef = string | { readonly sessionId: string; readonly uid: string };

/** Binary32 or binary64. */
export type PrecisionName = 'f32' | 'f64';

/** A session to make; what is absent is as the scene says. */
export interface CreateOptions {
  /** Name of a scene that the server ships; or `sceneText`. */
  scene?: string;
  /** The text of a scene file (TOML). */
  sceneText?: string;
  /** 4 to 63 of a-z, 0-9 and '-', starting with a letter. Absent: the server chooses. */
  sessionId?: string;
  precision?: PrecisionName;
  /** Absent: as many as the server has cores, within its limit. */
  threadCount?: number;
  /** The session ends by itself after so many steps; 0: never. */
  stepLimit?: bigint;
  /** Steps between frames. */
  frameIntervalSteps?: number;
  /** Ranks of a cluster that step the session together. */
  rankCount?: number;
}

/** Changes of parameters, as the contract's `Changes` has them; what is absent stays as it is. */
export type Changes = Omit<Exclude<MessageInitShape<typeof ChangesSchema>, MessageShape<typeof ChangesSchema>>, '$typeName'>;

/** Changes, when they take effect, and when the call answers. */
export type UpdateOptions = Changes & {
  /** Index of the step before which they take effect; absent: the next. */
  atStep?: bigint;
  /** Whether to answer only when they take effect. */
  wait?: boolean;
};

/** How a session steps. */
export interface StepOptions {
  /** Whether to answer only after the steps; it does unless this is false. */
  wait?: boolean;
  /** Instead of a count: steps until so many are taken in all, so that the call can be repeated. */
  to?: bigint;
  /** Changes before the first of the steps. */
  changes?: Changes;
}

/** A session that stands where another one stands. */
export interface ForkOptions {
  /** Its id; absent: the server chooses. */
  newSessionId?: string;
  /** Steps since the initial state of the one that is copied after which it ends; 0: never. Absent: as that one. */
  stepLimit?: bigint;
}

/** The fields of every request about a session. */
export function named(session: SessionRef): { sessionId: string; sessionUid: string } {
  if (typeof session === 'string') return { sessionId: session, sessionUid: '' };
  return { sessionId: session.sessionId, sessionUid: session.uid };
}

/** A request for a new session; its id makes a repeated one return the session of the first. */
export function createRequest(options: CreateOptions): MessageShape<typeof CreateSessionRequestSchema> {
  const { scene, sceneText, precision, ...rest } = options;
  if ((scene === undefined) === (sceneText === undefined)) {
    throw refused('a session has the name of a scene, or its text, and not both: give scene or sceneText', 'scene');
  }
  return create(CreateSessionRequestSchema, {
    ...rest,
    scene: scene === undefined ? { case: 'sceneText', value: sceneText ?? '' } : { case: 'sceneName', value: scene },
    precision: precision === undefined ? Precision.UNSPECIFIED : { f32: Precision.F32, f64: Precision.F64 }[precision],
    requestId: uuid(),
  });
}

/** A request for steps. */
export function stepRequest(session: SessionRef, count: number, options: StepOptions): MessageShape<typeof StepSessionRequestSchema> {
  if (!Number.isSafeInteger(count) || count < 1) throw refused(`the count of steps is ${count}; allowed: whole numbers from 1`, 'count');
  const { wait = true, to, changes } = options;
  const steps = to === undefined ? { stepCount: BigInt(count) } : { toStep: to };
  return create(StepSessionRequestSchema, { ...named(session), ...steps, wait, ...(changes === undefined ? {} : { changes }) });
}

/** A request for changes of parameters. */
export function updateRequest(session: SessionRef, options: UpdateOptions): MessageShape<typeof UpdateParametersRequestSchema> {
  return create(UpdateParametersRequestSchema, { ...options, ...named(session) });
}

/** A request for a copy. */
export function forkRequest(session: SessionRef, options: ForkOptions): MessageShape<typeof ForkSessionRequestSchema> {
  return create(ForkSessionRequestSchema, { ...options, ...named(session) });
}

/** A random UUID. `crypto.randomUUID` is only there on pages that came over TLS or from loopback. */
function uuid(): string {
  const bytes = crypto.getRandomValues(new Uint8Array(16));
  bytes[6] = (bytes[6] & 0x0f) | 0x40;
  bytes[8] = (bytes[8] & 0x3f) | 0x80;
  const digits = Array.from(bytes, (byte) => byte.toString(16).padStart(2, '0')).join('');
  return digits.replace(/^(.{8})(.{4})(.{4})(.{4})/, '$1-$2-$3-$4-');
}
