// The ray through a pixel meets what is drawn there.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { PerspectiveCamera, Vector3 } from 'three';
import { load } from './bundle.mjs';

const { rayThrough } = await load('src/picture/ray.ts');
const PICTURE = { left: 120, top: 40, width: 800, height: 500 };

function camera() {
  const camera = new PerspectiveCamera(50, PICTURE.width / PICTURE.height, 0.01, 100);
  camera.position.set(1.5, 2, -3);
  camera.lookAt(0.2, 0.4, 0.1);
  camera.updateMatrixWorld();
  return camera;
}

test('the ray through a pixel goes through the point that is drawn at it', () => {
  const eye = camera();
  for (const point of [[0.2, 0.4, 0.1], [0, 0, 0], [0.9, 0.1, 0.4], [-0.6, 1.2, 0.3]]) {
    const drawn = new Vector3(...point).project(eye);
    const x = PICTURE.left + ((1 + drawn.x) / 2) * PICTURE.width;
    const y = PICTURE.top + ((1 - drawn.y) / 2) * PICTURE.height;
    const { origin, direction } = rayThrough(eye, PICTURE, x, y);
    const to = new Vector3(...point).sub(new Vector3(...origin));
    const along = to.dot(new Vector3(...direction));
    assert.ok(along > 0, 'the point is before the camera');
    const beside = to.addScaledVector(new Vector3(...direction), -along).length();
    assert.ok(beside < 1e-9, `${point}: ${beside} m beside the ray`);
  }
});

test('the ray has length 1, and the middle of the picture is where the camera looks', () => {
  const eye = camera();
  const { origin, direction } = rayThrough(eye, PICTURE, PICTURE.left + PICTURE.width / 2, PICTURE.top + PICTURE.height / 2);
  assert.deepEqual(origin, [1.5, 2, -3]);
  assert.ok(Math.abs(Math.hypot(...direction) - 1) < 1e-12);
  const ahead = eye.getWorldDirection(new Vector3()).toArray();
  assert.ok(direction.every((part, axis) => Math.abs(part - ahead[axis]) < 1e-9), `${direction} is not ${ahead}`);
});
