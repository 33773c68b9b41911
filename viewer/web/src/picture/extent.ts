// What a collider fills, as coarsely as the camera needs: how far it reaches, and what it hides.

import { Bounds, along, cross, dot, length, minus, turned } from './geometry.ts';
import type { ColliderShape, MeshShape, Pose, Vector } from '../scene.ts';

/** A solid adds to the bounds of the scene what lies within so many radii of the bodies. */
export const REACH = 3;
/** Balls along the axis of a round solid, to see whether it hides something. */
const BALLS = 9;

/** A mesh, with the box around all of its triangles; poses place `origin` (m). */
export function meshShape(points: Float32Array<ArrayBuffer>, triangles: Uint32Array<ArrayBuffer>, origin: Vector = [0, 0, 0]): MeshShape {
  const box = new Bounds();
  for (const point of triangles) box.add(points.subarray(3 * point, 3 * point + 3));
  const corners = box.corners();
  return { kind: 'mesh', points, triangles, low: corners[0], high: corners[7], origin };
}

/** A shape at a pose; of a mesh only the box around it. */
export function placed(shape: ColliderShape, { position, turn }: Pose): ColliderShape {
  const way = (vector: Vector) => turned(turn, vector);
  switch (shape.kind) {
    case 'plane':
      return { ...shape, point: position, normal: way(shape.normal) };
    case 'half_pipe':
      return { ...shape, point: position, axis: way(shape.axis), up: way(shape.up) };
    case 'sphere':
      return { ...shape, center: position };
    case 'capsule':
    case 'cylinder': {
      const half = way(along([0, 0, 0], 0.5, minus(shape.end, shape.start)));
      return { ...shape, start: minus(position, half), end: along(position, 1, half) };
    }
    case 'box':
      return { ...shape, center: position, axis_x: way(shape.axis_x), axis_y: way(shape.axis_y) };
    case 'mesh': {
      const [box, all] = [new Bounds(), new Bounds()];
      for (const corner of [shape.low, shape.high]) box.add(corner);
      for (const corner of box.corners()) all.add(along(position, 1, way(minus(corner, shape.origin))));
      const corners = all.corners();
      return { ...shape, low: corners[0], high: corners[7], origin: position };
    }
  }
}

/** Grows the bounds of the scene by what a collider fills; endless ones have no bounds. */
export function addExtent(shape: ColliderShape, scene: Bounds, bodies: Bounds): void {
  const addBall = (center: Vector, reach: number) => {
    for (const side of [reach, -reach]) scene.add(bodies.nearest(along(center, side, [1, 1, 1]), REACH));
  };
  switch (shape.kind) {
    case 'sphere':
      // A ball is all in the picture: bodies fall around it.
      scene.add(along(shape.center, shape.radius, [1, 1, 1]));
      scene.add(along(shape.center, -shape.radius, [1, 1, 1]));
      break;
    case 'capsule':
    case 'cylinder':
      addBall(shape.start, shape.radius);
      addBall(shape.end, shape.radius);
      break;
    case 'box':
      addBall(shape.center, length(shape.half_extent));
      break;
    case 'mesh':
      for (const corner of [shape.low, shape.high]) scene.add(bodies.nearest(corner, REACH));
      break;
    case 'plane':
    case 'half_pipe':
      break;
  }
}

/** Whether a collider stands between the eye and a point that is not in it; endless ones hide nothing. */
export function hides(shape: ColliderShape, eye: Vector, at: Vector): boolean {
  switch (shape.kind) {
    case 'sphere':
      return meetsBall(eye, at, shape.center, shape.radius);
    case 'capsule':
    case 'cylinder': {
      const step = minus(shape.end, shape.start);
      const balls = Array.from({ length: BALLS }, (_, ball) => along(shape.start, ball / (BALLS - 1), step));
      return balls.some((center) => meetsBall(eye, at, center, shape.radius));
    }
    case 'box': {
      const axes = [shape.axis_x, shape.axis_y, cross(shape.axis_x, shape.axis_y)];
      const local = (from: Vector) => axes.map((axis) => dot(minus(from, shape.center), axis));
      return crosses(local(eye), local(at), shape.half_extent);
    }
    case 'mesh': {
      // The ellipsoid in its box, as a ball of radius 1.
      const half = along([0, 0, 0], 0.5, minus(shape.high, shape.low));
      const [from, to] = [eye, at].map((point) => minus(point, along(shape.low, 1, half)).map((part, axis) => part / half[axis]) as unknown as Vector);
      return meetsBall(from, to, [0, 0, 0], 1);
    }
    case 'plane':
    case 'half_pipe':
      return false;
  }
}

/** Whether a segment goes through the box of a half extent around the origin, and does not end in it. */
function crosses(from: number[], to: number[], half: Vector): boolean {
  let enter = 0;
  let leave = 1;
  for (let axis = 0; axis < 3; axis++) {
    const step = to[axis] - from[axis];
    if (step === 0) {
      // Along the box's side, a segment is within it or not.
      if (Math.abs(from[axis]) >= half[axis]) leave = -1;
      continue;
    }
    const ends = [-half[axis], half[axis]].map((side) => (side - from[axis]) / step);
    enter = Math.max(enter, Math.min(ends[0], ends[1]));
    leave = Math.min(leave, Math.max(ends[0], ends[1]));
  }
  return enter < leave && leave < 1;
}

/** Whether a segment goes through a ball, and does not end in it. */
function meetsBall(from: Vector, to: Vector, center: Vector, radius: number): boolean {
  const step = minus(to, from);
  const share = dot(step, minus(center, from)) / dot(step, step);
  const nearest = along(from, Math.min(Math.max(share, 0), 1), step);
  return length(minus(center, nearest)) < radius && length(minus(center, to)) > radius;
}
