// Errors of the client: what failed, where, the server's own reason, and what to do.
//
// Enters: how a call ended. Leaves: a NappeError.

import { REASONS } from './gen/reasons.ts';
import type { Failure } from './gen/nappe/v1/simulation_pb.ts';

/** Status codes of gRPC. */
export enum Code {
  OK = 0,
  CANCELLED = 1,
  UNKNOWN = 2,
  INVALID_ARGUMENT = 3,
  DEADLINE_EXCEEDED = 4,
  NOT_FOUND = 5,
  ALREADY_EXISTS = 6,
  PERMISSION_DENIED = 7,
  RESOURCE_EXHAUSTED = 8,
  FAILED_PRECONDITION = 9,
  ABORTED = 10,
  OUT_OF_RANGE = 11,
  UNIMPLEMENTED = 12,
  INTERNAL = 13,
  UNAVAILABLE = 14,
  DATA_LOSS = 15,
  UNAUTHENTICATED = 16,
}

/** A reason that a server of this version gives, as docs/errors.md lists them. */
export type Reason = keyof typeof REASONS;

/** What is known of an error besides its code and its message. */
export interface Known {
  reason?: string | null;
  metadata?: Record<string, string>;
  remedy?: string | null;
  cause?: unknown;
}

/** Something that a server refused, or that could not be done. */
export class NappeError extends Error {
  override readonly name: string = 'NappeError';
  readonly code: Code;
  /** The server's reason; null where it was not the server that refused. */
  readonly reason: string | null;
  /** The values that the message names, as texts. */
  readonly metadata: Record<string, string>;
  /** What to do about it; null where nothing general can be said. */
  readonly remedy: string | null;

  constructor(code: Code, message: string, known: Known = {}) {
    super(message, known.cause === undefined ? {} : { cause: known.cause });
    this.code = code;
    this.reason = known.reason ?? null;
    this.metadata = known.metadata ?? {};
    this.remedy = known.remedy ?? row(this.reason)?.remedy ?? null;
  }

  /** The code in words, such as `NOT_FOUND`. */
  get codeName(): string {
    return Code[this.code] ?? String(this.code);
  }

  /** Whether the same call may succeed later: the server is away, draining or late. */
  get isTransient(): boolean {
    return this.code === Code.UNAVAILABLE || this.code === Code.DEADLINE_EXCEEDED;
  }

  /** Whether it says that a simulation went wrong. */
  get isDivergence(): boolean {
    return row(this.reason)?.isDivergence ?? false;
  }
}

/** The error of a session that failed. */
export function failureError(failure: Failure): NappeError {
  const metadata: Record<string, string> = { step: String(failure.step), time_seconds: String(failure.timeSeconds) };
  if (failure.particle !== undefined) metadata.particle = String(failure.particle);
  if (failure.value !== undefined) metadata.value = String(failure.value);
  const code = Code[row(failure.reason)?.code ?? 'UNKNOWN'];
  return new NappeError(code, failure.message, { reason: failure.reason, metadata });
}

/** What this package refuses by itself, before anything is sent. */
export function refused(message: string, field: string): NappeError {
  return new NappeError(Code.INVALID_ARGUMENT, message, { metadata: { field } });
}

/** Bytes of a server that are not what the contract says. */
export function broken(what: string): NappeError {
  return new NappeError(Code.DATA_LOSS, `the server's stream does not decode: ${what}`);
}

function row(reason: string | null): (typeof REASONS)[Reason] | null {
  return reason !== null && Object.hasOwn(REASONS, reason) ? REASONS[reason as Reason] : null;
}
