// Undoes packed arrays, as docs/frames.md defines them.
//
// Enters: deflated bytes, the shape that they must have, perhaps a base. Leaves: whole numbers, particle by
// particle, and numbers in their unit. Bytes that are no array of that shape are refused.

/** Bytes that are no packed array of the expected shape. */
export class PackedError extends Error {}

/** Particles, and numbers for each. */
export interface Shape {
  particles: number;
  components: number;
}

/** Most bytes of a packed number before deflate. */
const MOST_PLANES = 4;

/** The whole numbers of a packed array; `base` is added, of the same shape. */
export async function unpack(data: Uint8Array<ArrayBuffer>, shape: Shape, base: Int32Array | null): Promise<Int32Array> {
  const numbers = sum(await inflate(data, shape), shape);
  if (base !== null) addBase(numbers, base);
  return numbers;
}

/** The planes of a packed array: particles times components bytes, one to four times. */
export async function inflate(data: Uint8Array<ArrayBuffer>, shape: Shape): Promise<Uint8Array> {
  const count = shape.particles * shape.components;
  if (count === 0) {
    if (data.length > 0) throw refused(shape, `${data.length} bytes`);
    return new Uint8Array(0);
  }
  if (data.length === 0) throw refused(shape, 'no bytes');

  const planes = await inflateAtMost(data, shape, MOST_PLANES * count);
  if (planes.length === 0 || planes.length % count !== 0) throw refused(shape, `${planes.length} inflated bytes`);
  return planes;
}

/** Inflates chunk by chunk, and stops as soon as there are more than `limit` bytes. */
async function inflateAtMost(data: Uint8Array<ArrayBuffer>, shape: Shape, limit: number): Promise<Uint8Array> {
  const inflater = new DecompressionStream('deflate-raw');
  const writer = inflater.writable.getWriter();
  // What fails here fails the reader too, which reports it.
  const written = writer.write(data).then(() => writer.close()).catch(() => undefined);
  const reader = inflater.readable.getReader();

  const chunks: Uint8Array[] = [];
  let length = 0;
  for (;;) {
    const { value, done } = await reader.read().catch((error: unknown) => {
      throw refused(shape, `bytes that cannot be inflated (${error instanceof Error ? error.message : 'unknown'})`);
    });
    if (done) break;
    length += value.length;
    if (length > limit) {
      reader.cancel().catch(() => undefined);
      throw refused(shape, `more than ${limit} inflated bytes`);
    }
    chunks.push(value);
  }
  await written;
  return chunks.length === 1 ? chunks[0] : join(chunks, length);
}

function join(chunks: Uint8Array[], length: number): Uint8Array {
  const all = new Uint8Array(length);
  let at = 0;
  for (const chunk of chunks) {
    all.set(chunk, at);
    at += chunk.length;
  }
  return all;
}

function refused({ particles, components }: Shape, found: string): PackedError {
  return new PackedError(`no packed array of ${particles} particles with ${components} components: ${found}`);
}

/** Planes to whole numbers: the bytes of each, its sign, then running sums over the particles. */
export function sum(planes: Uint8Array, { particles, components }: Shape): Int32Array {
  const count = particles * components;
  const numbers = new Int32Array(count);
  const planeCount = count === 0 ? 0 : planes.length / count;

  for (let component = 0; component < components; component++) {
    const first = component * particles;
    let number = 0;
    for (let particle = 0; particle < particles; particle++) {
      const at = first + particle;
      let zigzag = planes[at];
      if (planeCount > 1) zigzag |= planes[at + count] << 8;
      if (planeCount > 2) zigzag |= planes[at + 2 * count] << 16;
      if (planeCount > 3) zigzag |= planes[at + 3 * count] << 24;
      number = (number + ((zigzag >>> 1) ^ -(zigzag & 1))) | 0;
      numbers[particle * components + component] = number;
    }
  }
  return numbers;
}

/** Adds the numbers of an earlier array; sums wrap in 32 bits. */
export function addBase(numbers: Int32Array, base: Int32Array): void {
  if (numbers.length !== base.length) {
    throw new PackedError(`a base of ${base.length} numbers for an array of ${numbers.length}`);
  }
  for (let i = 0; i < numbers.length; i++) numbers[i] += base[i];
}

/** The numbers in their unit: exact in binary32, since the step is a power of two. */
export function restore(numbers: Int32Array, step: number): Float32Array<ArrayBuffer> {
  const restored = new Float32Array(numbers.length);
  for (let i = 0; i < numbers.length; i++) restored[i] = numbers[i] * step;
  return restored;
}
