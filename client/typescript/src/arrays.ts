// Pieces of one array over the particles, joined in aligned memory that is used again.
//
// Enters: FieldData in order. Leaves: the whole array, every number finite.

import { broken } from './errors.ts';
import { Encoding, type FieldData } from './gen/nappe/v1/frame_pb.ts';

/** Numbers over the particles, binary32 or binary64. */
export type Numbers = Float32Array<ArrayBuffer> | Float64Array<ArrayBuffer>;

/** Arrays that were handed back; more are left to the collector of garbage. */
const MAX_FREE = 16;

/** Memory of arrays that nobody holds any more. */
export class Pool {
  readonly #free: Numbers[] = [];

  /** An array of so many numbers, whatever they are. */
  take(length: number, isWide: boolean): Numbers {
    const found = this.#free.findIndex((array) => array.length === length && array instanceof Float64Array === isWide);
    if (found >= 0) return this.#free.splice(found, 1)[0];
    return isWide ? new Float64Array(length) : new Float32Array(length);
  }

  give(array: Numbers): void {
    if (this.#free.length < MAX_FREE) this.#free.push(array);
  }
}

/** An array in the making. */
export class Joining {
  readonly #name: string;
  /** Numbers per particle. */
  readonly #width: number;
  #numbers: Numbers | null = null;
  #encoding = Encoding.UNSPECIFIED;
  /** Particles that have come. */
  #received = 0;

  constructor(name: string, width: number) {
    this.#name = name;
    this.#width = width;
  }

  /** Appends a piece; `told` names the frame in messages. */
  append({ encoding, firstParticle, data }: FieldData, particles: number, pool: Pool, told: string): void {
    if (encoding !== Encoding.UNSPECIFIED && encoding !== Encoding.RAW_F32 && encoding !== Encoding.RAW_F64) {
      throw broken(`${told}: ${this.#name} in encoding ${encoding}, which is newer than this client`);
    }
    const isWide = encoding === Encoding.RAW_F64;
    if (this.#numbers === null) [this.#numbers, this.#encoding] = [pool.take(this.#width * particles, isWide), encoding];
    if (encoding !== this.#encoding) throw broken(`${told}: ${this.#name} change their encoding from piece to piece`);

    const element = this.#width * (isWide ? 8 : 4);
    if (data.length % element !== 0) throw broken(`${told}: ${data.length} bytes of ${this.#name}, no multiple of ${element}`);
    const end = this.#received + data.length / element;
    if (firstParticle !== this.#received || end > particles) {
      throw broken(`${told}: ${this.#name} go on at particle ${firstParticle} of ${particles}, not at ${this.#received}`);
    }
    const { buffer } = this.#numbers;
    new Uint8Array(buffer, element * this.#received, data.length).set(data);
    const [first, last] = [this.#width * this.#received, this.#width * end];
    if (!areFinite(this.#numbers, first, last)) {
      const at = this.#numbers.findIndex((number, i) => i >= first && !Number.isFinite(number));
      throw broken(`${told}: ${this.#name} of particle ${Math.floor(at / this.#width)} is ${this.#numbers[at]}`);
    }
    this.#received = end;
  }

  /** The whole array, if every particle has come. */
  whole(particles: number, told: string): Numbers {
    if (this.#received !== particles) throw broken(`${told}: ${this.#name} of ${this.#received} of ${particles} particles`);
    return this.#numbers ?? new Float32Array(0);
  }

  /** What has been taken of the pool. */
  get taken(): Numbers | null {
    return this.#numbers;
  }
}

/** One pass without a branch: a number that is not finite makes the sum one that is none. */
function areFinite(numbers: Numbers, first: number, last: number): boolean {
  let sum = 0;
  for (let i = first; i < last; i++) sum += numbers[i] - numbers[i];
  return sum === 0;
}
