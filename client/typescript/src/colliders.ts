// Colliders: the contract's own shapes, checked so that they can be drawn.
//
// Enters: ColliderShape, from the wire. Leaves: what is wrong with its numbers, if anything.

import type { ColliderShape, Vector3 } from './gen/nappe/v1/frame_pb.ts';

/** How far a direction's length may be from 1, and the cosine of two at right angles from 0: the rounding of binary32. */
const UNIT_TOLERANCE = 1e-5;

type Complaint = string | null;

/** What is wrong with a collider; null if it can be drawn. A shape that this client is too old to know is fine. */
export function complaint({ velocity, shape: { case: kind, value: shape } }: ColliderShape): Complaint {
  const moving = finite(velocity);
  if (moving !== null) return moving;
  switch (kind) {
    case 'plane':
      return finite(shape.point) ?? unit(shape.normal);
    case 'sphere':
      return finite(shape.center) ?? radius(shape.radius);
    case 'capsule':
      return finite(shape.start, shape.end) ?? radius(shape.radius);
    case 'box':
      return finite(shape.center) ?? extent(shape.halfExtent) ?? rightAngles(shape.axisX, shape.axisY);
    case 'cylinder':
      return finite(shape.start, shape.end) ?? radius(shape.radius) ?? apart(shape.start, shape.end);
    case 'halfPipe':
      return finite(shape.point) ?? radius(shape.radius) ?? rightAngles(shape.axis, shape.up);
    case undefined:
      return null;
  }
}

type Vector = Vector3 | undefined;

/** The three numbers of a vector; an absent one is zero, as everywhere in proto3. */
const components = (vector: Vector): number[] => (vector === undefined ? [0, 0, 0] : [vector.x, vector.y, vector.z]);

const dot = (a: Vector, b: Vector): number => components(a).reduce((sum, x, axis) => sum + x * components(b)[axis], 0);

const finite = (...vectors: Vector[]): Complaint =>
  vectors.flatMap(components).every(Number.isFinite) ? null : 'a coordinate is not finite';

const radius = (length: number): Complaint =>
  Number.isFinite(length) && length > 0 ? null : 'its radius is not a positive number';

const extent = (half: Vector): Complaint =>
  finite(half) ?? (components(half).every((length) => length > 0) ? null : 'half of its extent is not positive along each axis');

const apart = (start: Vector, end: Vector): Complaint =>
  components(start).some((x, axis) => x !== components(end)[axis]) ? null : 'its two ends are one point';

const unit = (direction: Vector): Complaint =>
  finite(direction) ?? (Math.abs(Math.sqrt(dot(direction, direction)) - 1) > UNIT_TOLERANCE ? 'a direction of it is not of length 1' : null);

const rightAngles = (a: Vector, b: Vector): Complaint =>
  unit(a) ?? unit(b) ?? (Math.abs(dot(a, b)) > UNIT_TOLERANCE ? 'two directions of it are not at right angles' : null);
