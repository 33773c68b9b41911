// A closed surface is drawn with edges where it has them, round elsewhere, and a little within the solid.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { load } from './bundle.mjs';
import { ball, box, torus } from './solids.mjs';

const { facets } = await load('src/picture/facets.ts');
const { meshShape } = await load('src/picture/extent.ts');

const shape = ({ points, triangles }) => meshShape(Float32Array.from(points.flat()), Uint32Array.from(triangles.flat()));
const triples = (flat) => Array.from({ length: flat.length / 3 }, (_, i) => flat.slice(3 * i, 3 * i + 3));
const dot = (a, b) => a.reduce((sum, part, axis) => sum + part * b[axis], 0);

function drawn(solid, origin = [0, 0, 0]) {
  const { positions, normals, triangles } = facets(shape(solid), origin);
  assert.equal(triangles.length, 3 * solid.triangles.length);
  return { positions: triples(positions), normals: triples(normals), triangles: triples(triangles) };
}

test('a box has six flat sides, a little within the solid', () => {
  const half = [2, 1, 3];
  const { positions, normals } = drawn(box([0, 0, 0], half));
  assert.equal(positions.length, 24, 'three normals at each corner');
  for (const normal of normals) assert.deepEqual([...normal].map(Math.abs).sort(), [0, 0, 1]);
  for (const at of positions) {
    for (let axis = 0; axis < 3; axis++) {
      const inside = half[axis] - Math.abs(at[axis]);
      assert.ok(inside > 0 && inside <= 0.015, `${at} is ${inside} m within the side`);
    }
  }
});

test('a ball is round, and as deep within the solid as an exact one', () => {
  const [center, radius] = [[1, 2, 3], 0.4];
  const solid = ball(center, radius, 3);
  const { positions, normals } = drawn(solid, center);
  assert.equal(positions.length, solid.points.length, 'a normal at each point');
  positions.forEach((at, i) => {
    const length = Math.hypot(...at);
    assert.ok(Math.abs(length - 0.985 * radius) < 1e-4, `${length} m`);
    assert.ok(dot(at, normals[i]) / length > 0.9999, 'the normal points outwards');
  });
});

test('triangles keep their side, on the inside of a ring too', () => {
  const solid = torus([0, 0, 0], 0.5, 0.2, 32, 16);
  const { positions, normals, triangles } = drawn(solid);
  assert.equal(positions.length, solid.points.length);
  for (const [a, b, c] of triangles) {
    const [u, v] = [b, c].map((end) => positions[end].map((part, axis) => part - positions[a][axis]));
    const normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    assert.ok(dot(normal, normals[a]) > 0.9 * Math.hypot(...normal));
  }
});

test('a thin part is not turned inside out', () => {
  // A needle of 1 mm on a ball of 1 m.
  const solid = ball([0, 0, 0], 1, 2);
  const first = solid.points.length;
  const needle = box([0, 0, 0], [0.0005, 1.5, 0.0005]);
  solid.points.push(...needle.points);
  solid.triangles.push(...needle.triangles.map((triangle) => triangle.map((index) => index + first)));
  const { positions, triangles } = drawn(solid);
  solid.triangles.slice(-12).forEach((triangle, i) => triangle.forEach((point, corner) => {
    const at = positions[triangles.at(i - 12)[corner]];
    for (const axis of [0, 2]) assert.ok(at[axis] * solid.points[point][axis] > 0, `${at} is on the other side of the needle`);
  }));
});

test('points of no triangle do not count, and a triangle of no area does no harm', () => {
  const solid = box([0, 0, 0], [1, 1, 1]);
  solid.points.unshift([1000, 0, 0], [0, -1000, 0]);
  solid.triangles = [...solid.triangles.map((triangle) => triangle.map((index) => index + 2)), [2, 2, 3]];
  const { low, high } = shape(solid);
  assert.deepEqual([low, high], [[-1, -1, -1], [1, 1, 1]]);
  const { positions, normals } = drawn(solid);
  assert.ok([...positions, ...normals].flat().every(Number.isFinite));
  assert.ok(positions.flat().every((part) => Math.abs(part) <= 1));
});

test('200,000 triangles take less than 5 s, with a point of half of them too', () => {
  const around = 100_000;
  const rim = Array.from({ length: around }, (_, i) => [Math.cos((2 * Math.PI * i) / around), 0, Math.sin((2 * Math.PI * i) / around)]);
  const sides = rim.flatMap((_, i) => [[i, around, (i + 1) % around], [(i + 1) % around, around + 1, i]]);
  for (const solid of [torus([0, 0, 0], 1, 0.4, 500, 200), { points: [...rim, [0, 1, 0], [0, -1, 0]], triangles: sides }]) {
    const begin = performance.now();
    drawn(solid);
    assert.ok(performance.now() - begin < 5000, `${performance.now() - begin} ms`);
  }
});
