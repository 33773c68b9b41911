// The body of an answer in gRPC-Web: before each message five bytes, one of flags and four of its length.
//
// Enters: chunks of bytes as the network cuts them. Leaves: messages, which are views that the next one may overwrite.

import { broken, Code, NappeError } from './errors.ts';

/** Bytes before each message. */
const HEAD_BYTES = 5;
/** Largest message that is taken (bytes), as in the client in Rust. */
const MAX_MESSAGE_BYTES = 8 << 20;
/** The flag of the last message, which holds the trailers. */
const TRAILERS = 0x80;

/** A message of a body. */
export interface Piece {
  isTrailers: boolean;
  bytes: Uint8Array;
}

/** A message with its five bytes, to be sent. */
export function framed(message: Uint8Array): Uint8Array<ArrayBuffer> {
  const bytes = new Uint8Array(HEAD_BYTES + message.length);
  new DataView(bytes.buffer).setUint32(1, message.length);
  bytes.set(message, HEAD_BYTES);
  return bytes;
}

/** Cuts a body into its messages. */
export class Pieces {
  readonly #read: () => Promise<Uint8Array | null>;
  #chunk = new Uint8Array(0);
  /** How much of the chunk has been taken. */
  #at = 0;
  /** Where messages are joined that came in several chunks; used again for the next. */
  #joined = new Uint8Array(HEAD_BYTES);

  /** `read` gives the next chunk, and null at the end of the body. */
  constructor(read: () => Promise<Uint8Array | null>) {
    this.#read = read;
  }

  /** The next message; null at the end of the body. */
  async next(): Promise<Piece | null> {
    const head = await this.#take(HEAD_BYTES);
    if (head === null) return null;
    const [flags, a, b, c, d] = head;
    const length = a * 2 ** 24 + ((b << 16) | (c << 8) | d);
    if ((flags & ~TRAILERS) !== 0) throw broken(`a message has flags ${flags}; compressed ones are not read`);
    if (length > MAX_MESSAGE_BYTES) throw broken(`a message has ${length} bytes; at most ${MAX_MESSAGE_BYTES} are taken`);

    const bytes = await this.#take(length);
    if (bytes === null) throw cut();
    return { isTrailers: flags === TRAILERS, bytes };
  }

  /** So many bytes; null if the body ended before the first. */
  async #take(count: number): Promise<Uint8Array | null> {
    if (this.#chunk.length - this.#at >= count) {
      this.#at += count;
      return this.#chunk.subarray(this.#at - count, this.#at);
    }

    if (this.#joined.length < count) this.#joined = new Uint8Array(Math.max(count, 2 * this.#joined.length));
    let filled = 0;
    for (;;) {
      const part = this.#chunk.subarray(this.#at, this.#at + count - filled);
      this.#joined.set(part, filled);
      this.#at += part.length;
      filled += part.length;
      if (filled === count) return this.#joined.subarray(0, count);

      const chunk = await this.#read();
      if (chunk === null) {
        if (filled === 0) return null;
        throw cut();
      }
      this.#chunk = chunk as Uint8Array<ArrayBuffer>;
      this.#at = 0;
    }
  }
}

function cut(): NappeError {
  return new NappeError(Code.UNAVAILABLE, 'the connection broke: the answer ended within a message');
}
