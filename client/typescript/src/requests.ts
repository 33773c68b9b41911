// Requests: what a caller gives, as messages of the contract.
//
// Enters: arguments. Leaves: messages, or an error that names the argument.

import { create, type DescMessage, type MessageInitShape, type MessageShape } from '@bufbuild/protobuf';
import { fieldNames, filled, flag, OPTIONS, real, record, text, whole, word, wrong, type Given, type Whole } from './checks.ts';
import { refused } from './errors.ts';
import type { LiveFrame } from './frame.ts';
import {
  ChangesSchema, CreateSessionRequestSchema, ForkSessionRequestSchema, MakeLinkRequestSchema, PauseSessionRequestSchema, PlaySessionRequestSchema, Precision,
  StepSessionRequestSchema, UpdateParametersRequestSchema,
} from './gen/nappe/v1/simulation_pb.ts';

/** A session: its id, or its id and its uid, as a `Session` has them. With the uid, another one of the same id is refused. */
export type SessionRef = string | { readonly sessionId: string; readonly uid: string };

/** Binary32 or binary64. */
export type PrecisionName = (typeof PRECISIONS)[number];
export const PRECISIONS = ['f32', 'f64'] as const;

/** A session to make; what is absent is as the scene says. */
export interface CreateOptions {
  /** Name of a scene that the server ships; or `sceneText`. */
  scene?: string;
  /** The text of a scene file (TOML). */
  sceneText?: string;
  /**
   * The file of a session that `save` gave, in place of a scene: the new session goes on from there at the same step, to the bit, also
   * with snow. What is absent is as it was there.
   */
  checkpoint?: Blob | Uint8Array<ArrayBuffer>;
  /** 1 to 63 letters (a-z, A-Z), digits and '-', which is not the first. Absent: the server chooses. */
  sessionId?: string;
  precision?: PrecisionName;
  /** Absent: as many as the server has cores, within its limit. */
  threadCount?: Whole;
  /** The session ends by itself after so many steps; 0: never. */
  stepLimit?: Whole;
  /** Steps between frames. */
  frameIntervalSteps?: Whole;
  /** Ranks of a cluster that step the session together. */
  rankCount?: Whole;
  /**
   * A frame of this scene, with velocities and not yet released, at which the session begins, with its step and its time: the session
   * goes on as the one that the frame is of, to the bit. A frame in another precision is refused, and so are scenes with snow.
   */
  begin?: LiveFrame;
}

/** Changes of parameters, as the contract's `Changes` has them; what is absent stays as it is. */
export type Changes = Given<MessageShape<typeof ChangesSchema>>;

/** Changes, when they take effect, and when the call answers. */
export type UpdateOptions = Changes & {
  /** Index of the step before which they take effect; absent: the next. */
  atStep?: Whole;
  /** Whether to answer only when they take effect. */
  wait?: boolean;
};

/** How a session plays. */
export interface PlayOptions {
  /** Simulated seconds per second of wall clock; 0: as fast as possible. */
  realTimeFactor?: number | bigint;
}

/** How a session is paused. */
export interface PauseOptions {
  /** Whether to answer only once the session stands; it does unless this is false. */
  wait?: boolean;
}

/** How a session steps. */
export interface StepOptions {
  /** Whether to answer only after the steps; it does unless this is false. */
  wait?: boolean;
  /** Instead of a count: steps until so many are taken in all, so that the call can be repeated. */
  to?: Whole;
  /** Changes before the first of the steps. */
  changes?: Changes;
}

/** A session that stands where another one stands. */
export interface ForkOptions {
  /** Its id; absent: the server chooses. */
  newSessionId?: string;
  /** Steps since the initial state of the one that is copied after which it ends; 0: never. Absent: as that one. */
  stepLimit?: Whole;
}

/** A link to one session, for several who each get a token of their own. */
export interface LinkOptions {
  /** Copies that each who opens it may have at a time, at most 4; absent: none. */
  forks?: Whole;
  /** How often it can be opened, at most 1000; absent: once. */
  uses?: Whole;
  /** Seconds after which it ends, with the tokens that it gave, at most 43200; absent: as a link to everything. */
  seconds?: Whole;
}

/** What a message is made from, once it was checked. */
type Init<D extends DescMessage> = Omit<Exclude<MessageInitShape<D>, MessageShape<D>>, '$typeName'>;

/** The fields of every request about a session. */
export function named(session: SessionRef): { sessionId: string; sessionUid: string } {
  if (typeof session === 'string') return { sessionId: session, sessionUid: '' };
  const { sessionId, uid } = (session ?? {}) as { sessionId?: unknown; uid?: unknown };
  if (typeof sessionId === 'string' && typeof uid === 'string') return { sessionId, sessionUid: uid };
  throw wrong(session, 'session', 'the id of a session, or a Session, which has its sessionId and its uid');
}

const CREATE = ['scene', 'sceneText', 'checkpoint', 'sessionId', 'precision', 'threadCount', 'stepLimit', 'frameIntervalSteps', 'rankCount', 'begin'];

/** A request for a new session, without the frame or the file that it begins at; its id makes a repeated one return the session of the first. */
export function createRequest(options: CreateOptions): MessageShape<typeof CreateSessionRequestSchema> {
  const { scene, sceneText, checkpoint, precision, begin, ...rest } = record(options, OPTIONS, CREATE);
  if ([scene, sceneText, checkpoint].filter((given) => given !== undefined).length !== 1) {
    throw refused('a session has the name of a scene, its text, or the file of a session: give one of scene, sceneText and checkpoint', 'scene');
  }
  return create(CreateSessionRequestSchema, {
    ...(filled(CreateSessionRequestSchema, rest, OPTIONS, CREATE) as Init<typeof CreateSessionRequestSchema>),
    scene: source(scene, sceneText),
    precision: precision === undefined ? Precision.UNSPECIFIED : { f32: Precision.F32, f64: Precision.F64 }[word(precision, 'precision', PRECISIONS)],
    requestId: uuid(),
  });
}

/** Where a scene comes from: its name, its text, or a file that is yet to be sent. */
function source(scene: unknown, sceneText: unknown): MessageShape<typeof CreateSessionRequestSchema>['scene'] {
  if (scene !== undefined) return { case: 'sceneName', value: text(scene, 'scene') };
  if (sceneText !== undefined) return { case: 'sceneText', value: text(sceneText, 'sceneText') };
  return { case: 'checkpointId', value: '' };
}

/** A request to play. */
export function playRequest(session: SessionRef, options: PlayOptions): MessageShape<typeof PlaySessionRequestSchema> {
  const { realTimeFactor = 0 } = record(options, OPTIONS, ['realTimeFactor']);
  return create(PlaySessionRequestSchema, { ...named(session), realTimeFactor: real(realTimeFactor, 'realTimeFactor', 0) });
}

/** A request to pause. */
export function pauseRequest(session: SessionRef, options: PauseOptions): MessageShape<typeof PauseSessionRequestSchema> {
  const { wait = true } = record(options, OPTIONS, ['wait']);
  return create(PauseSessionRequestSchema, { ...named(session), wait: flag(wait, 'wait') });
}

/** A request for steps. */
export function stepRequest(session: SessionRef, count: Whole, options: StepOptions): MessageShape<typeof StepSessionRequestSchema> {
  const stepCount = whole(count, 'count', 1n);
  const { wait = true, to, changes } = record(options, OPTIONS, ['wait', 'to', 'changes']);
  const steps = to === undefined ? { stepCount } : { toStep: whole(to, 'to') };
  const changed = changes === undefined ? {} : { changes: filled(ChangesSchema, changes, 'changes') as Init<typeof ChangesSchema> };
  return create(StepSessionRequestSchema, { ...named(session), ...steps, ...changed, wait: flag(wait, 'wait') });
}

const UPDATE = fieldNames(UpdateParametersRequestSchema, ['sessionId', 'sessionUid']);

/** A request for changes of parameters. */
export function updateRequest(session: SessionRef, options: UpdateOptions): MessageShape<typeof UpdateParametersRequestSchema> {
  const changes = filled(UpdateParametersRequestSchema, options, OPTIONS, UPDATE) as Init<typeof UpdateParametersRequestSchema>;
  return create(UpdateParametersRequestSchema, { ...changes, ...named(session) });
}

const FORK = fieldNames(ForkSessionRequestSchema, ['sessionId', 'sessionUid']);

/** A request for a copy. */
export function forkRequest(session: SessionRef, options: ForkOptions): MessageShape<typeof ForkSessionRequestSchema> {
  const fields = filled(ForkSessionRequestSchema, options, OPTIONS, FORK) as Init<typeof ForkSessionRequestSchema>;
  return create(ForkSessionRequestSchema, { ...fields, ...named(session) });
}

const LINK = fieldNames(MakeLinkRequestSchema, ['sessionId']);

/** A request for a link to one session. */
export function linkRequest(session: SessionRef, options: LinkOptions): MessageShape<typeof MakeLinkRequestSchema> {
  const fields = filled(MakeLinkRequestSchema, options, OPTIONS, LINK) as Init<typeof MakeLinkRequestSchema>;
  return create(MakeLinkRequestSchema, { ...fields, sessionId: named(session).sessionId });
}

/** A random UUID. `crypto.randomUUID` is only there on pages that came over TLS or from loopback. */
function uuid(): string {
  const bytes = crypto.getRandomValues(new Uint8Array(16));
  bytes[6] = (bytes[6] & 0x0f) | 0x40;
  bytes[8] = (bytes[8] & 0x3f) | 0x80;
  const digits = Array.from(bytes, (byte) => byte.toString(16).padStart(2, '0')).join('');
  return digits.replace(/^(.{8})(.{4})(.{4})(.{4})/, '$1-$2-$3-$4-');
}
