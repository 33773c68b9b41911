// A place of the picture to the half-line that is seen there.
//
// Enters: a camera, where the picture is in the window, a place (CSS pixels). Leaves: a ray in the camera's world (m).

import { type Camera, Vector3 } from 'three';
import type { Vector } from '../scene.ts';

export interface Ray {
  /** Where the camera stands (m). */
  origin: Vector;
  /** Of length 1. */
  direction: Vector;
}

/** `picture` is the rectangle that the picture fills. The camera's matrices are up to date. */
export function rayThrough(camera: Camera, picture: { left: number; top: number; width: number; height: number }, x: number, y: number): Ray {
  const across = (2 * (x - picture.left)) / picture.width - 1;
  const up = 1 - (2 * (y - picture.top)) / picture.height;
  const origin = new Vector3().setFromMatrixPosition(camera.matrixWorld);
  const direction = new Vector3(across, up, 0.5).unproject(camera).sub(origin).normalize();
  return { origin: origin.toArray(), direction: direction.toArray() };
}
