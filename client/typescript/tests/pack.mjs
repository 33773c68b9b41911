// Packs arrays as docs/frames.md defines them, for tests.

import { deflateRawSync } from 'node:zlib';

/** Whole numbers, particle by particle; those of `base` are taken away. */
export function pack(numbers, particles, components, base = null) {
  const count = particles * components;
  const zigzag = new Uint32Array(count);
  for (let component = 0; component < components; component++) {
    let before = 0;
    for (let particle = 0; particle < particles; particle++) {
      const at = particle * components + component;
      const number = (numbers[at] - (base === null ? 0 : base[at])) | 0;
      const difference = (number - before) | 0;
      zigzag[component * particles + particle] = (difference << 1) ^ (difference >> 31);
      before = number;
    }
  }
  if (count === 0) return new Uint8Array(0);
  const largest = zigzag.reduce((a, b) => Math.max(a, b), 0);
  const planeCount = [2 ** 8, 2 ** 16, 2 ** 24].filter((limit) => largest >= limit).length + 1;
  const planes = new Uint8Array(planeCount * count);
  for (let plane = 0; plane < planeCount; plane++) {
    for (let i = 0; i < count; i++) planes[plane * count + i] = (zigzag[i] >>> (8 * plane)) & 255;
  }
  return new Uint8Array(deflateRawSync(planes));
}
