// A mesh takes as much of the picture as the box around it, and hides what the ellipsoid in that box does.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { load } from './bundle.mjs';
import { ball } from './solids.mjs';

const { addExtent, hides, meshShape } = await load('src/extent.ts');
const { Bounds } = await load('src/geometry.ts');

const CENTER = [0.8, 0.8, 1.3];
const RADIUS = 0.7;

/** A ball whose points include those of its box, six of the edges' middles of the first icosahedron. */
function mesh() {
  const { points, triangles } = ball(CENTER, RADIUS, 2);
  return meshShape(Float32Array.from(points.flat()), Uint32Array.from(triangles.flat()));
}

const sphere = { kind: 'sphere', center: CENTER, radius: RADIUS };

function bodies(center, half) {
  const bounds = new Bounds();
  for (const side of [-half, half]) bounds.add(center.map((part) => part + side));
  return bounds;
}

test('a mesh of a ball is framed as the ball', () => {
  const around = bodies([0, 1, 0], 0.5);
  const [exact, made] = [sphere, mesh()].map((shape) => {
    const scene = around.copy();
    addExtent(shape, scene, around);
    return scene.corners();
  });
  exact.forEach((corner, i) => corner.forEach((part, axis) => assert.ok(Math.abs(part - made[i][axis]) < 1e-6, `${made[i]} is not ${corner}`)));
});

test('a mesh that is far larger than the bodies does not make the picture as large', () => {
  const around = bodies([0, 0, 0], 0.1);
  const scene = around.copy();
  const { points, triangles } = ball([0, -500, 0], 500, 0);
  addExtent(meshShape(Float32Array.from(points.flat()), Uint32Array.from(triangles.flat())), scene, around);
  assert.ok(scene.radius() < 10 * around.radius(), `${scene.radius()} m`);
});

test('a mesh of a ball hides what the ball hides', () => {
  const made = mesh();
  let hidden = 0;
  for (let i = 0; i < 2000; i++) {
    const [eye, at] = [3 * i, 3 * i + 1].map((k) => [0, 1, 2].map((axis) => CENTER[axis] + 3 * Math.sin(12.9898 * (k + 1) * (axis + 1))));
    const exact = hides(sphere, eye, at);
    assert.equal(hides(made, eye, at), exact, `from ${eye} to ${at}`);
    hidden += exact ? 1 : 0;
  }
  assert.ok(hidden > 100 && hidden < 1900, `${hidden}`);
});
