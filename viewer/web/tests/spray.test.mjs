// Dense snow is a surface, and what flies alone is mist.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { load } from './bundle.mjs';

const { Spray } = await load('src/picture/spray.ts');
const { bodyBounds } = await load('src/picture/camera.ts');

const SIDE = 0.02;
const ACROSS = 10;

/** A cube of particles on a lattice, then `alone` of them far apart, one after the other along x. */
function particles(alone) {
  const cube = Array.from({ length: ACROSS ** 3 }, (_, i) => [i % ACROSS, Math.floor(i / ACROSS) % ACROSS, Math.floor(i / ACROSS ** 2)].map((at) => SIDE * at));
  const far = Array.from({ length: alone }, (_, i) => [2 + 0.5 * i, 1, 1]);
  return Float32Array.from([...cube, ...far].flat());
}

test('a cube of snow is dense, up to its corners', () => {
  const positions = particles(0);
  assert.equal(new Spray(0, ACROSS ** 3, SIDE).sort(positions), ACROSS ** 3);
});

test('particles that fly alone come last, each once', () => {
  const alone = 40;
  const count = ACROSS ** 3 + alone;
  const spray = new Spray(0, count, SIDE);
  assert.equal(spray.sort(particles(alone)), ACROSS ** 3);
  assert.deepEqual([...spray.order].sort((a, b) => a - b), Array.from({ length: count }, (_, i) => i));
  assert.ok([...spray.order.slice(ACROSS ** 3)].every((particle) => particle >= ACROSS ** 3), 'they are the last');
});

test('a body whose particles begin elsewhere names its own', () => {
  const [first, count] = [7, ACROSS ** 3];
  const positions = new Float32Array(3 * (first + count));
  positions.set(particles(0), 3 * first);
  const spray = new Spray(first, count, SIDE);
  assert.equal(spray.sort(positions), count);
  assert.equal(spray.order[0], first);
});

test('the picture holds spray that is near, and not what flies far', () => {
  const body = (positions) => {
    const count = positions.length / 3;
    const none = new Uint32Array(0);
    const own = { name: 'ball', firstParticle: 0, particleCount: count, triangles: none, springs: none, pins: none, color: null };
    return bodyBounds({ bodies: [own] }, { numbers: positions, step: 1 }).corners()[7];
  };
  const near = Float32Array.from([...particles(0), 0.25, 0, 0]);
  assert.ok(Math.abs(body(near)[0] - 0.25) < 1e-6, `${body(near)}`);
  const [far] = body(Float32Array.from([...particles(0), 50, 0, 0]));
  assert.ok(far > 0.18 && far < 0.5, `${far}`);
});
