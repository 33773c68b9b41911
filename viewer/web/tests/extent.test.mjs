// A mesh takes as much of the picture as the box around it, and hides what the ellipsoid in that box does.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { load } from './bundle.mjs';
import { ball } from './solids.mjs';

const { addExtent, hides, meshShape, placed } = await load('src/picture/extent.ts');
const { begun, poseBounds, sceneBounds } = await load('src/picture/camera.ts');
const { Bounds } = await load('src/picture/geometry.ts');

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

/** A quarter turn about y, which takes x to -z. */
const QUARTER = [0, Math.SQRT1_2, 0, Math.SQRT1_2];

test('a shape at a pose is turned about its reference point', () => {
  const pose = { name: 'it', position: [5, 6, 7], turn: QUARTER };
  const near = (found, expected) => found.forEach((part, axis) => assert.ok(Math.abs(part - expected[axis]) < 1e-6, `${found}, not ${expected}`));
  near(placed(sphere, pose).center, [5, 6, 7]);
  const rod = placed({ kind: 'capsule', start: [0, 0, 0], end: [2, 0, 0], radius: 0.1 }, pose);
  near(rod.start, [5, 6, 8]);
  near(rod.end, [5, 6, 6]);
  const box = placed({ kind: 'box', center: [0, 1, 0], half_extent: [0.4, 0.2, 0.1], axis_x: [0, 1, 0], axis_y: [-1, 0, 0] }, pose);
  near(box.center, [5, 6, 7]);
  near(box.axis_x, [0, 1, 0]);
  near(box.axis_y, [0, 0, 1]);
  near(placed({ kind: 'plane', point: [0, 0, 0], normal: [1, 0, 0] }, pose).normal, [0, 0, -1]);
  const made = placed({ ...mesh(), origin: [0, 0, 0] }, pose);
  // Its middle, (0.8, 0.8, 1.3) from the origin, comes to (1.3, 0.8, -0.8) from there.
  near(made.low, [1.3, 0.8, -0.8].map((part, axis) => part - RADIUS + pose.position[axis]));
  near(made.high, [1.3, 0.8, -0.8].map((part, axis) => part + RADIUS + pose.position[axis]));
});

test('the picture holds a collider all along its way, and not where it is written if it begins elsewhere', () => {
  const around = bodies([0, 0, 0], 1);
  const box = { kind: 'box', center: [50, 0, 0], half_extent: [0.1, 0.1, 0.1], axis_x: [1, 0, 0], axis_y: [0, 1, 0] };
  const scene = { colliders: [{ name: 'it', velocity: [0, 0, 0], shape: box }] };
  const at = (x) => ({ name: 'it', position: [x, 0, 0], turn: [0, 0, 0, 1] });
  const still = new Bounds();
  const ends = (motion, poses) => {
    const all = sceneBounds(begun(scene, poses), { bodies: around, colliders: motion }).corners();
    return [all[0][0], all[7][0]];
  };
  const half = Math.hypot(0.1, 0.1, 0.1);
  assert.ok(ends(still, [])[1] > 3, 'written far away it is held as far as the picture goes');
  assert.deepEqual(ends(still, [at(-0.5)]), [-1, 1], 'it begins among the bodies');
  const [low, high] = ends(poseBounds(scene, around, [at(-0.5), at(2), at(-3), { ...at(9), name: 'another' }]), [at(-0.5)]);
  assert.ok(Math.abs(high - 2 - half) < 1e-9 && Math.abs(low + 3 + half) < 1e-9, `${low} to ${high}`);
  // One that goes far leaves the picture.
  const far = ends(poseBounds(scene, around, [at(1e6)]), [at(0)])[1];
  assert.ok(far < 3.1 * around.radius(), `${far}`);
});
