// A place of the picture to the half-line that is seen there, and a point to the place where it is seen.
//
// Enters: a camera, where the picture is in the window, a place (CSS pixels) or a point in the camera's world (m). Leaves: a ray in
// that world, or a place.

import { type Camera, Vector3 } from 'three';
import type { Vector } from '../scene.ts';

export interface Ray {
  /** Where the camera stands (m). */
  origin: Vector;
  /** Of length 1. */
  direction: Vector;
}

/** A place of the window (CSS pixels). */
export interface Place {
  x: number;
  y: number;
}

/** The rectangle that the picture fills in the window (CSS pixels). */
export interface Rectangle {
  left: number;
  top: number;
  width: number;
  height: number;
}

/** The camera's matrices are up to date. */
export function rayThrough(camera: Camera, picture: Rectangle, x: number, y: number): Ray {
  const across = (2 * (x - picture.left)) / picture.width - 1;
  const up = 1 - (2 * (y - picture.top)) / picture.height;
  const origin = new Vector3().setFromMatrixPosition(camera.matrixWorld);
  const direction = new Vector3(across, up, 0.5).unproject(camera).sub(origin).normalize();
  return { origin: origin.toArray(), direction: direction.toArray() };
}

/** Where a point is seen, also beside the picture; null if it is not before the camera. The camera's matrices are up to date. */
export function placeOf(camera: Camera, picture: Rectangle, point: Vector): Place | null {
  const at = new Vector3(...point).applyMatrix4(camera.matrixWorldInverse);
  if (!(at.z < 0)) return null;
  at.applyMatrix4(camera.projectionMatrix);
  return { x: picture.left + 0.5 * (1 + at.x) * picture.width, y: picture.top + 0.5 * (1 - at.y) * picture.height };
}
