// Calls of gRPC-Web over `fetch`, in browsers and in Node: one message is sent, one or a stream of them comes back.
//
// Enters: a method and its message. Leaves: messages, or a NappeError. A call that is left ends on the server too: its
// request is aborted, which closes the connection over HTTP/1.1.

import { fromBinary, toBinary, type DescMessage, type DescMethod, type MessageShape } from '@bufbuild/protobuf';
import { broken, Code, NappeError } from './errors.ts';
import { framed, Pieces } from './framing.ts';
import { readStatus, readTrailers, statusError, type Status } from './status.ts';

/** A server, and what it is shown. */
export interface Target {
  /** Where calls go, without a / at its end. */
  address: string;
  token: string | null;
  fetch: typeof fetch;
  /** Seconds without a byte after which a stream counts as broken. */
  silenceSeconds: number;
}

/** What bounds a call. */
export interface Bounds {
  /** Seconds until the answer; absent: any number. */
  seconds?: number | undefined;
  signal?: AbortSignal | undefined;
}

/** A method with the messages of its request and its answers. */
export type Method<I extends DescMessage, O extends DescMessage> = DescMethod & { input: I; output: O };

/** Makes a call with one answer. */
export async function call<I extends DescMessage, O extends DescMessage>(
  target: Target, method: Method<I, O>, message: MessageShape<I>, bounds: Bounds = {},
): Promise<MessageShape<O>> {
  const answer = await Answer.begin(target, method, toBinary(method.input, message), bounds, null);
  try {
    const bytes = await answer.next();
    if (bytes === null) throw broken(`the answer to ${method.name} has no message`);
    // Bytes of the answer are kept, and what is read next would overwrite them.
    const read = decoded(method.output, bytes.slice());
    if ((await answer.next()) !== null) throw broken(`the answer to ${method.name} has more than one message`);
    return read;
  } finally {
    answer.close();
  }
}

/** Asks for a stream, and waits until the server has accepted it. */
export function stream<I extends DescMessage, O extends DescMessage>(
  target: Target, method: Method<I, O>, message: MessageShape<I>, signal: AbortSignal,
): Promise<Answer> {
  return Answer.begin(target, method, toBinary(method.input, message), { signal }, target.silenceSeconds);
}

/** A message of these bytes. */
export function decoded<O extends DescMessage>(schema: O, bytes: Uint8Array): MessageShape<O> {
  try {
    return fromBinary(schema, bytes, { readUnknownFields: false });
  } catch (error) {
    throw broken(`${bytes.length} bytes are no ${schema.typeName} (${error instanceof Error ? error.message : 'unknown'})`);
  }
}

/** The answer to a call, message by message. */
export class Answer {
  readonly #target: Target;
  readonly #method: DescMethod;
  readonly #controller = new AbortController();
  readonly #silence: number | null;
  readonly #signal: AbortSignal | undefined;
  readonly #cancel = (): void => this.#end(cancelled(this.#signal?.reason));
  #timer: ReturnType<typeof setTimeout> | undefined;
  /** Why this side ended the call. */
  #ended: NappeError | null = null;
  #isOver = false;
  #pieces = new Pieces(() => Promise.resolve(null));
  #cancelBody: () => void = () => undefined;

  private constructor(target: Target, method: DescMethod, { seconds, signal }: Bounds, silence: number | null) {
    this.#target = target;
    this.#method = method;
    this.#silence = silence;
    this.#signal = signal;
    if (signal?.aborted) this.#cancel();
    signal?.addEventListener('abort', this.#cancel);
    if (seconds === undefined) return;
    const late = `${target.address} did not answer ${method.name} within ${seconds} s`;
    this.#timer = setTimeout(() => this.#end(new NappeError(Code.DEADLINE_EXCEEDED, late)), seconds * 1000);
  }

  /** Sends the request, and waits for the head of the answer. A stream that is silent for `silence` seconds is broken. */
  static async begin(
    target: Target, method: DescMethod, message: Uint8Array, bounds: Bounds, silence: number | null,
  ): Promise<Answer> {
    const answer = new Answer(target, method, bounds, silence);
    try {
      await answer.#send(message, bounds.seconds);
      return answer;
    } catch (error) {
      answer.close();
      throw error;
    }
  }

  /** The next message, a view that the one after it may overwrite; null at the end. */
  async next(): Promise<Uint8Array | null> {
    try {
      if (this.#ended !== null) throw this.#ended;
      const piece = await this.#pieces.next();
      if (piece !== null && !piece.isTrailers) return piece.bytes;
      const status = piece === null ? null : readStatus(readTrailers(piece.bytes));
      if (status === null) throw this.#brokenOff('the answer ended without a status');
      // The end of the body lets the connection be used again.
      await this.#pieces.next();
      this.#isOver = true;
      this.#check(status);
      return null;
    } catch (error) {
      throw this.#ended ?? error;
    }
  }

  /** Ends the call, here and on the server. */
  close(): void {
    clearTimeout(this.#timer);
    this.#signal?.removeEventListener('abort', this.#cancel);
    if (this.#isOver) return;
    this.#isOver = true;
    this.#abort();
  }

  async #send(message: Uint8Array, seconds: number | undefined): Promise<void> {
    const { address, token, fetch } = this.#target;
    const headers: Record<string, string> = { 'content-type': 'application/grpc-web+proto', 'x-grpc-web': '1' };
    if (token !== null) headers.authorization = `Bearer ${token}`;
    // Longer than here, so that this side names the call and the limit.
    if (seconds !== undefined) headers['grpc-timeout'] = `${Math.ceil(seconds) + 1}S`;
    const url = `${address}/${this.#method.parent.typeName}/${this.#method.name}`;
    const { signal } = this.#controller;
    const response = await this.#heard(
      () => fetch(url, { method: 'POST', headers, body: framed(message), signal, cache: 'no-store', redirect: 'error', referrerPolicy: 'no-referrer' }),
      (cause) => new NappeError(Code.UNAVAILABLE, `no server answers at ${address}: ${innermost(cause)}`, { cause, remedy: START }),
    );

    const status = readStatus((name) => response.headers.get(name));
    if (status === null && !response.ok) throw this.#refusedByHttp(response);
    if (status === null && !response.headers.get('content-type')?.startsWith('application/grpc-web')) {
      throw new NappeError(Code.UNIMPLEMENTED, `what answers at ${address} is no server of nappe: its answer is no gRPC-Web`);
    }
    if (status !== null) {
      // There is no body then.
      this.#isOver = true;
      await response.body?.cancel();
      this.#check(status);
    }
    const reader = response.body?.getReader();
    if (reader === undefined) throw this.#brokenOff('the answer has no body');
    this.#cancelBody = () => void reader.cancel().catch(() => undefined);
    this.#pieces = new Pieces(() => this.#heard(
      () => reader.read().then(({ value, done }) => (done ? null : value)), (cause) => this.#brokenOff(innermost(cause), cause),
    ));
  }

  /** Waits for the network, which has to say something in time if this is a stream. */
  async #heard<T>(wait: () => Promise<T>, failed: (cause: unknown) => NappeError): Promise<T> {
    if (this.#ended !== null) throw this.#ended;
    const silence = this.#silence;
    const timer = silence === null ? undefined : setTimeout(() => this.#end(this.#brokenOff(`not a byte came for ${silence} s`)), silence * 1000);
    try {
      return await wait();
    } catch (cause) {
      throw this.#ended ?? failed(cause);
    } finally {
      clearTimeout(timer);
    }
  }

  #end(why: NappeError): void {
    this.#ended ??= why;
    this.#abort();
  }

  /** In Node, a signal no longer reaches a body whose request was collected as garbage: its reader does. */
  #abort(): void {
    this.#controller.abort();
    this.#cancelBody();
  }

  #check(status: Status): void {
    if (status.code !== Code.OK) throw statusError(status, this.#target.address, this.#method.name);
  }

  #brokenOff(what: string, cause?: unknown): NappeError {
    return new NappeError(Code.UNAVAILABLE, `the connection to ${this.#target.address} broke: ${what}`, { cause, remedy: START });
  }

  /** An answer without a status of gRPC: of something between, such as a proxy. */
  #refusedByHttp({ status }: Response): NappeError {
    const codes: Record<number, Code> = {
      401: Code.UNAUTHENTICATED, 403: Code.PERMISSION_DENIED, 404: Code.UNIMPLEMENTED,
      429: Code.UNAVAILABLE, 502: Code.UNAVAILABLE, 503: Code.UNAVAILABLE, 504: Code.UNAVAILABLE,
    };
    const told = `what answers at ${this.#target.address} ended ${this.#method.name} with status ${status} of HTTP`;
    return new NappeError(codes[status] ?? Code.UNKNOWN, told);
  }
}

const START = 'Start a server with `nappe serve`; check the address.';

/** The error of a call that its caller gave up. */
export function cancelled(cause: unknown): NappeError {
  return new NappeError(Code.CANCELLED, 'the call was given up', { cause });
}

/** The last error of a chain: "connection refused" rather than "fetch failed". */
function innermost(error: unknown): string {
  let last = error;
  while (last instanceof Error && last.cause instanceof Error) last = last.cause;
  return last instanceof Error ? last.message || last.name : String(last);
}
