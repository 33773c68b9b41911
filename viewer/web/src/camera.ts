// What the first picture holds, and where the camera stands: on the side from which solids hide the bodies least.
//
// Enters: a scene, the positions (m) of its first frame. Leaves: bounds, the camera's position and target (m).

import { addExtent, addFoot, hides } from './extent.ts';
import { Bounds, along } from './geometry.ts';
import { type Scene, type Vector, isPoints } from './scene.ts';

/** From the centre of the scene to the camera, over the radius of the scene. */
const EYE: Vector = [0.68, 0.48, 1.28];
/** Signs along x and z; of sides that hide as little, the first is taken. */
const SIDES = [[1, 1], [-1, 1], [1, -1], [-1, -1]];

export interface Camera {
  eye: Vector;
  /** What is in the middle of the picture. */
  target: Vector;
}

/** Bounds of the bodies, with room for those that hang from pins. */
export function bodyBounds(scene: Scene, position: (particle: number) => Vector): Bounds {
  const all = new Bounds();
  for (const { firstParticle, particleCount, pins } of scene.bodies) {
    const own = new Bounds();
    for (let i = firstParticle; i < firstParticle + particleCount; i++) own.add(position(i));
    own.corners().forEach((corner) => all.add(corner));

    let highest: Vector | null = null;
    for (const pin of pins) {
      const at = position(pin);
      if (highest === null || at[1] >= highest[1]) highest = at;
    }
    if (highest !== null) all.add(along(highest, -2 * own.radius(), [0, 1, 0]));
  }
  return all;
}

/** Bounds of the bodies and of what the picture should hold around them. */
export function sceneBounds(scene: Scene, bodies: Bounds): Bounds {
  const all = bodies.copy();
  const hasPoints = scene.bodies.some(isPoints);
  for (const { shape } of scene.colliders) {
    addExtent(shape, all, bodies);
    if (hasPoints) addFoot(shape, all, bodies);
  }
  return all;
}

export function cameraOf(scene: Scene, all: Bounds, bodies: Bounds): Camera {
  const target = all.center();
  const floor = all.floor();
  // Where bodies are, and where they come to when they fall.
  const seen = bodies.corners().flatMap((at): Vector[] => [at, [at[0], floor, at[2]]]);
  const hidden = (eye: Vector) =>
    seen.filter((at) => scene.colliders.some(({ shape }) => hides(shape, eye, at))).length;

  let best = { eye: target, count: Infinity };
  for (const [x, z] of SIDES) {
    const eye = along(target, all.radius(), [x * EYE[0], EYE[1], z * EYE[2]]);
    const count = hidden(eye);
    if (count < best.count) best = { eye, count };
  }
  return { eye: best.eye, target };
}
