// What the hand takes, how hard it pulls, how fast it leads a pin, and that its calls do not queue.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { PerspectiveCamera } from 'three';
import { load } from './bundle.mjs';

const { nearestHit, nearestSeen, onPlane, particleAt, patchAround } = await load('src/picture/pick.ts');
const { ClothHold, PinHold, strengthOf } = await load('src/live/holds.ts');
const { Newest } = await load('src/live/newest.ts');
const { placeOf, rayThrough } = await load('src/picture/ray.ts');

/** A square sheet in the plane of a z, with its particles row by row from the origin. */
function sheet(name, side, spacing, z = 0, firstParticle = 0, pins = []) {
  const positions = [];
  const triangles = [];
  for (let row = 0; row < side; row++) {
    for (let column = 0; column < side; column++) {
      positions.push(column * spacing, row * spacing, z);
      if (row === side - 1 || column === side - 1) continue;
      const a = firstParticle + row * side + column;
      triangles.push(a, a + 1, a + side, a + side, a + 1, a + side + 1);
    }
  }
  return {
    positions,
    body: {
      name, firstParticle, particleCount: side * side, triangles: Uint32Array.from(triangles), springs: new Uint32Array(0),
      pins: Uint32Array.from(pins), color: null,
    },
  };
}

const distance = (a, b) => Math.hypot(...a.map((part, axis) => part - b[axis]));

test('the nearest cloth on the half-line is taken, from either side, and none where none is', () => {
  const far = sheet('far', 5, 0.25);
  const near = sheet('near', 5, 0.1, 1, 25);
  const positions = [...far.positions, ...near.positions];
  const bodies = [far.body, near.body];
  const down = (x, y) => ({ origin: [x, y, 3], direction: [0, 0, -1] });
  const hit = nearestHit(down(0.13, 0.23), positions, bodies);
  assert.equal(hit.body.name, 'near');
  assert.ok(distance(hit.point, [0.13, 0.23, 1]) < 1e-12, `${hit.point}`);
  assert.deepEqual([...hit.corners].sort((a, b) => a - b), [25 + 11, 25 + 12, 25 + 16]);
  assert.equal(nearestHit(down(0.7, 0.7), positions, bodies).body.name, 'far', 'beside the near one');
  assert.equal(nearestHit({ origin: [0.13, 0.23, -2], direction: [0, 0, 1] }, positions, bodies).body.name, 'far', 'from behind');
  assert.equal(nearestHit(down(1.1, 0.5), positions, bodies), null);
  assert.equal(nearestHit({ origin: [0.2, 0.2, 3], direction: [0, 0, 1] }, positions, bodies), null, 'it lies behind the eye');
  assert.equal(nearestHit({ origin: [-1, 0.2, 0], direction: [1, 0, 0] }, positions, [far.body]), null, 'along its plane');
  for (let share = 0; share <= 1; share += 1 / 64) assert.notEqual(nearestHit(down(0.4 * share, 0.4 * (1 - share)), positions, [near.body]), null, 'on an edge');
});

test('a patch has 48 particles at most, the nearest, and no pin', () => {
  const side = 101;
  const center = 50 * side + 50;
  const { positions, body } = sheet('sheet', side, 0.01, 0, 0, [center]);
  const point = particleAt(positions, center);
  const { particles, extent } = patchAround({ body, corners: [center, center + 1, center + side], point }, positions);
  assert.ok(Math.abs(extent - Math.SQRT2) < 1e-12);
  assert.deepEqual([particles.length, new Set(particles).size, particles.includes(center)], [48, 48, false]);
  const farthest = Math.max(...particles.map((particle) => distance(particleAt(positions, particle), point)));
  const others = Array.from({ length: side * side }, (_, particle) => particle).filter((particle) => particle !== center && !particles.includes(particle));
  assert.ok(others.every((particle) => distance(particleAt(positions, particle), point) >= farthest - 1e-12));
  assert.ok(farthest <= 0.03 * extent);
});

test('of a coarse cloth the corners of the triangle are taken, and of pins alone nothing', () => {
  const { positions, body } = sheet('coarse', 4, 1);
  const hit = nearestHit({ origin: [1.3, 1.3, 1], direction: [0, 0, -1] }, positions, [body]);
  assert.deepEqual([...patchAround(hit, positions).particles].sort((a, b) => a - b), [5, 6, 9]);
  const pinned = { ...body, pins: Uint32Array.from([5, 6, 9]) };
  assert.deepEqual(patchAround({ ...hit, body: pinned }, positions).particles, []);
});

test('a pin is taken within its pixels, the nearest of several', () => {
  const places = { 3: { x: 100, y: 100 }, 5: { x: 108, y: 100 }, 7: null };
  const near = (x, y, within) => nearestSeen([3, 5, 7], (particle) => places[particle], { x, y }, within);
  assert.equal(near(103, 100, 12), 3);
  assert.equal(near(105, 100, 12), 5);
  assert.equal(near(120, 101, 12), null);
  assert.equal(near(120, 101, 24), 5);
});

test('a point is seen where its ray goes through the picture, and not behind the camera', () => {
  const camera = new PerspectiveCamera(50, 1.6, 0.01, 100);
  camera.position.set(1, 2, 3);
  camera.lookAt(0, 0, 0);
  camera.updateMatrixWorld();
  const picture = { left: 120, top: 40, width: 800, height: 500 };
  const { x, y } = placeOf(camera, picture, [0.3, -0.2, 0.4]);
  const on = onPlane(rayThrough(camera, picture, x, y), [0.3, -0.2, 0.4], [1, 2, 3]);
  assert.ok(distance(on, [0.3, -0.2, 0.4]) < 1e-9, `${on}`);
  assert.equal(placeOf(camera, picture, [2, 4, 6]), null);
});

test('a pull is three weights of the body, at a frequency that its extent and the step allow', () => {
  const { most, frequency } = strengthOf(48, 1600, 1.379, 9.81, 0.005);
  assert.ok(Math.abs(most - (3 * 9.81 * 1600) / 48) < 1e-9);
  assert.ok(Math.abs(frequency - Math.sqrt((10 * most) / 1.379)) < 1e-9 && frequency < 100);
  assert.equal(strengthOf(48, 1600, 1.379, 9.81, 0.01).frequency, 0.5 / 0.01);
  assert.equal(strengthOf(1, 1, 0, 9.81, 0.01).frequency, 0.5 / 0.01, 'of one particle');
  assert.ok(strengthOf(5, 100, 1, 0, 0.01).most > 0, 'where nothing falls');
  assert.equal(strengthOf(1, 1e9, 1, 9.81, 0.01).most, 1e6);
});

test('a cloth is drawn with the offsets of its particles, for half a second, and let go without points', () => {
  const { positions, body } = sheet('cloth', 4, 1, 0, 7);
  const where = (particle) => particleAt(positions, particle - 7);
  const hold = new ClothHold({ body, corners: [], point: [1.2, 1.3, 0] }, { particles: [12, 13], extent: 4 }, where, 10, 0.01);
  const { pulls: [pull] } = hold.to([5, 5, 5]);
  assert.equal(pull.body, 'cloth');
  assert.deepEqual([...pull.particlesU32], [5, 6]);
  [5 - 0.2, 5 - 0.3, 5, 5 + 0.8, 5 - 0.3, 5].forEach((part, at) => assert.ok(Math.abs(pull.pointsF64[at] - part) < 1e-12));
  assert.deepEqual([pull.seconds, pull.most, pull.frequency], [0.5, (3 * 10 * 16) / 2, Math.sqrt((10 * 240) / 4)]);
  assert.ok(distance(hold.at(where), [1.2, 1.3, 0]) < 1e-12);
  assert.ok(distance(hold.at((particle) => where(particle).map((part) => part + 2)), [3.2, 3.3, 2]) < 1e-12);
  // The acceleration of a pull is the square of its frequency times the way, until it is as large as it may be.
  assert.deepEqual([0.39, 0.41].map((way) => hold.isAtBound([1.2, 1.3, way], [1.2, 1.3, 0])), [false, true]);
  const { pulls: [end] } = hold.end();
  assert.deepEqual([end.body, [...end.particlesU32], 'pointsF64' in end], ['cloth', [5, 6], false]);
});

test('a pin is led at two radii per second at most, in a step at least', () => {
  const hold = new PinHold(9, 0.5, 0.005);
  const seconds = (way, passed) => hold.to([way, 0, 0], [0, 0, 0], passed).pins[0].durationSeconds;
  assert.equal(seconds(2, 0.016), 2);
  assert.equal(seconds(0.01, 0.016), 0.016);
  assert.equal(seconds(0, 0), 0.005);
  for (const way of [0.001, 0.1, 1, 30]) assert.ok(way / seconds(way, 0) <= 1 + 1e-12);
  assert.deepEqual(hold.to([1, 2, 3], [1, 2, 3], 1).pins[0], { particle: 9, target: { x: 1, y: 2, z: 3 }, durationSeconds: 1 });
  assert.deepEqual([hold.isAtBound([0.05, 0, 0], [0, 0, 0]), hold.isAtBound([1, 0, 0], [0, 0, 0]), hold.end()], [false, true, null]);
});

test('one call is under way at a time, and only the newest waits', async () => {
  const calls = new Newest();
  const made = [];
  const answers = [];
  const put = (name) => calls.put(() => {
    made.push(name);
    return new Promise((resolve) => answers.push(resolve));
  });
  for (let i = 0; i < 1_000; i++) put(i);
  assert.deepEqual(made, [0]);
  answers.shift()();
  await new Promise((resolve) => setImmediate(resolve));
  assert.deepEqual(made, [0, 999]);
  answers.shift()();
  await new Promise((resolve) => setImmediate(resolve));
  put('again');
  assert.deepEqual(made, [0, 999, 'again']);
});
