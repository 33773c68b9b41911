// What the picture holds, and where the camera stands: on the side from which solids hide the bodies least.
//
// Enters: a scene, frames of it. Leaves: bounds, the camera's position and target (m).

import { REACH, addExtent, hides, placed } from './extent.ts';
import { Bounds, along, dot, minus } from './geometry.ts';
import { type Frame, type Pose, type Scene, type Vector, isPoints } from '../scene.ts';

/** From the centre of the scene to the camera, over the radius of the scene. */
const EYE: Vector = [0.68, 0.48, 1.28];
/** Signs along x and z; of sides that hide as little, the first is taken. */
const SIDES = [[1, 1], [-1, 1], [1, -1], [-1, -1]];

/** Particles of snow that are asked where it is, and the share of them on either side of an axis that counts as spray. */
const SAMPLES = 4000;
const SPRAY = 0.01;
/** The picture holds spray within so many radii of the rest of a body. */
const SPRAY_REACH = 1.6;
/** The picture holds motion as far as so many radii of the bodies at the start. */
const FARTHEST = 12;
/** Planes that bodies fall on have a unit normal with at least this height, and are at most so many radii below. */
const LEVEL = 0.7;
const DEEPEST = 4;

/** Where everything is over time. */
export interface Motion {
  /** Of all bodies. */
  bodies: Bounds;
  /** Of the colliders that have poses. */
  colliders: Bounds;
}

export interface Camera {
  eye: Vector;
  /** What is in the middle of the picture. */
  target: Vector;
}

/** Bounds of all bodies in one frame: of all particles of a mesh, and of snow without spray that flies far. */
export function bodyBounds(scene: Scene, { numbers, step }: Frame): Bounds {
  const all = new Bounds();
  const at = (i: number): Vector => [numbers[3 * i] * step, numbers[3 * i + 1] * step, numbers[3 * i + 2] * step];
  for (const body of scene.bodies) {
    const last = body.firstParticle + body.particleCount;
    if (!isPoints(body)) {
      for (let i = body.firstParticle; i < last; i++) all.add(at(i));
      continue;
    }
    const axes: number[][] = [[], [], []];
    for (let i = body.firstParticle; i < last; i += Math.ceil(body.particleCount / SAMPLES)) {
      at(i).forEach((value, axis) => axes[axis].push(value));
    }
    if (axes[0].length === 0) continue;
    const left = Math.floor(SPRAY * axes[0].length);
    for (const values of axes) values.sort((a, b) => a - b);
    const most = new Bounds();
    for (const end of [left, axes[0].length - 1 - left]) most.add(axes.map((values) => values[end]));
    const near = most.corners();
    const [low, high] = [near[0], near[7]].map((corner) => [...corner]);
    const [least, largest] = [-1, 1].map((side) => most.center().map((at) => at + side * SPRAY_REACH * most.radius()));
    for (let i = body.firstParticle; i < last; i++) {
      for (let axis = 0; axis < 3; axis++) {
        const value = numbers[3 * i + axis] * step;
        if (value < low[axis]) low[axis] = Math.max(value, Math.min(least[axis], low[axis]));
        else if (value > high[axis]) high[axis] = Math.min(value, Math.max(largest[axis], high[axis]));
      }
    }
    all.add(low);
    all.add(high);
  }
  return all;
}

/** Bounds of the bodies, and of where they come to when they fall on a plane that is not far below. */
export function fallBounds(scene: Scene, bodies: Bounds): Bounds {
  const all = bodies.copy();
  for (const { shape } of scene.colliders) {
    if (shape.kind !== 'plane' || shape.normal[1] < LEVEL) continue;
    for (const corner of bodies.corners()) {
      const depth = dot(minus(corner, shape.point), shape.normal) / shape.normal[1];
      if (depth > 0 && depth < DEEPEST * bodies.radius()) all.add([corner[0], corner[1] - depth, corner[2]]);
    }
  }
  return all;
}

/** Bounds of the bodies in a whole recording, whose frames may explode: never so far that the start is not seen. */
export function motionBounds(first: Bounds, others: readonly Bounds[]): Bounds {
  const all = first.copy();
  for (const bounds of others) bounds.corners().forEach((corner) => all.add(first.nearest(corner, FARTHEST)));
  return all;
}

/** A scene whose colliders are where they begin: at poses, if these are told. */
export function begun(scene: Scene, poses: readonly Pose[]): Scene {
  const colliders = scene.colliders.map((collider) => {
    const pose = poses.find(({ name }) => name === collider.name);
    return pose === undefined ? collider : { ...collider, shape: placed(collider.shape, pose) };
  });
  return { ...scene, colliders };
}

/** Bounds of colliders at some poses, as far as the picture holds them around the bodies. */
export function poseBounds(scene: Scene, bodies: Bounds, poses: readonly Pose[]): Bounds {
  const all = new Bounds();
  for (const pose of poses) {
    const collider = scene.colliders.find(({ name }) => name === pose.name);
    if (collider === undefined) continue;
    const own = new Bounds();
    addExtent(placed(collider.shape, pose), own, bodies);
    for (const corner of own.corners()) all.add(bodies.nearest(corner, REACH));
  }
  return all;
}

/** Bounds of the bodies and of what the picture should hold around them. */
export function sceneBounds(scene: Scene, { bodies, colliders }: Motion): Bounds {
  const all = bodies.copy();
  for (const { shape } of scene.colliders) addExtent(shape, all, bodies);
  for (const corner of colliders.corners()) all.add(corner);
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
