// Colliders: the contract's own shapes, checked so that they can be drawn.
//
// Enters: ColliderShape, from the wire, whole or in parts. Leaves: what is wrong with its numbers, if anything; whole ones;
// the arrays of a mesh.

import { concatenated } from './bytes.ts';
import type { ColliderShape, MeshShape, Vector3 } from './gen/nappe/v1/frame_pb.ts';

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
    case 'mesh':
      return finite(shape.origin) ?? surface(shape);
    case undefined:
      return null;
  }
}

/** What is wrong with the colliders of a topology: the name of the first that is, and what. */
export function wrongCollider(colliders: ColliderShape[]): { name: string; what: string } | null {
  const meshes = new Set<string>();
  for (const collider of colliders) {
    const what = complaint(collider);
    if (what !== null) return { name: collider.name, what };
    if (collider.shape.case !== 'mesh') continue;
    // Parts that followed each other are one by now.
    if (meshes.has(collider.name)) return { name: collider.name, what: 'its arrays go on behind another collider' };
    meshes.add(collider.name);
  }
  return null;
}

/**
 * The arrays of a mesh: x y z of each point at time 0 (m), and three points of each triangle, turned outwards; and the
 * reference point that its poses place.
 */
export interface Mesh {
  kind: 'mesh';
  origin: [number, number, number];
  points: Float32Array<ArrayBuffer>;
  triangles: Uint32Array<ArrayBuffer>;
}

/** Reads the arrays of a mesh collider of a topology, which are copies. */
export function meshOf({ pointsF32, trianglesU32, origin }: MeshShape): Mesh {
  return {
    kind: 'mesh', origin: [origin?.x ?? 0, origin?.y ?? 0, origin?.z ?? 0],
    points: new Float32Array(new Uint8Array(pointsF32).buffer), triangles: new Uint32Array(new Uint8Array(trianglesU32).buffer),
  };
}

/** The arrays of a collider, which only a mesh has. */
export function colliderArrays({ shape }: ColliderShape): Uint8Array[] {
  return shape.case === 'mesh' ? [shape.value.pointsF32, shape.value.trianglesU32] : [];
}

/** Gives a collider arrays of its own: those of the wire are overwritten by the next message. */
export function keepArrays({ shape }: ColliderShape): void {
  if (shape.case !== 'mesh') return;
  shape.value.pointsF32 = shape.value.pointsF32.slice();
  shape.value.trianglesU32 = shape.value.trianglesU32.slice();
}

/** Whole colliders: parts of a mesh have one name and stand one after the other. */
export function joinedColliders(parts: ColliderShape[]): ColliderShape[] {
  const runs: ColliderShape[][] = [];
  for (const part of parts) {
    const last = runs.at(-1);
    if (last !== undefined && last[0].name === part.name && last[0].shape.case === 'mesh' && part.shape.case === 'mesh') last.push(part);
    else runs.push([part]);
  }
  for (const run of runs) {
    const [{ shape }] = run;
    if (run.length === 1 || shape.case !== 'mesh') continue;
    const [points, triangles] = [0, 1].map((array) => new Uint8Array(concatenated(run.map((part) => colliderArrays(part)[array]))));
    [shape.value.pointsF32, shape.value.trianglesU32] = [points, triangles];
  }
  return runs.map(([whole]) => whole);
}

function surface(mesh: MeshShape): Complaint {
  if (mesh.pointsF32.length % 12 !== 0 || mesh.trianglesU32.length % 12 !== 0) {
    return 'its arrays hold no whole number of points and triangles';
  }
  const { points, triangles } = meshOf(mesh);
  if (triangles.length === 0) return 'it has no triangles';
  if (!points.every(Number.isFinite)) return 'a coordinate is not finite';
  const count = points.length / 3;
  return triangles.every((point) => point < count) ? null : 'a triangle of it names a point that is not there';
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
