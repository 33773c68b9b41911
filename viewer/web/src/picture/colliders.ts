// Colliders: a solid of each shape, or the part of an endless one that the scene needs, at its pose or moving with its
// velocity.
//
// Enters: colliders, the bounds of the scene (m), then frames. Leaves: lit objects.

import {
  BoxGeometry, type BufferGeometry, CapsuleGeometry, CylinderGeometry, Matrix4, Mesh, MeshLambertMaterial, type Object3D,
  Quaternion, SphereGeometry, Vector3,
} from 'three';
import { SOLID_COLOR } from './coloring.ts';
import { facets } from './facets.ts';
import { type Bounds, along, cross, length, minus, tangents, unit } from './geometry.ts';
import { disc, lit, trough } from './ground.ts';
import type { Collider, ColliderShape, Frame, Pose, Vector } from '../scene.ts';
import { rgb } from './stage.ts';

/** A drawn solid over the solid: between particles that lie on a ball, a triangle passes below its surface. */
const SOLID_SCALE = 0.985;
const FACETS = 64;

/** A shape as it is drawn: around its own origin, which is a point at time 0; and the point that its poses place. */
interface Outline {
  origin: Vector;
  object: Object3D;
  reference?: Vector;
}

/** A collider, and how its object is turned at time 0. */
interface Placed {
  outline: Outline;
  start: Quaternion;
  velocity: Vector;
}

export class Colliders {
  readonly objects: Object3D[];
  private readonly all: Placed[];

  /** Everything is drawn relative to `origin`. */
  constructor(colliders: readonly Collider[], scene: Bounds, private readonly origin: Vector) {
    this.all = colliders.map(({ name, shape, velocity }) => {
      const outline = outlineOf(shape, scene);
      outline.object.name = name;
      return { outline, start: outline.object.quaternion.clone(), velocity };
    });
    this.objects = this.all.map(({ outline }) => outline.object);
    this.update({ time: 0, poses: [] });
  }

  update({ time, poses }: Pick<Frame, 'time' | 'poses'>): void {
    const posed = new Map(poses.map((pose) => [pose.name, pose]));
    for (const placed of this.all) this.place(placed, posed.get(placed.outline.object.name), time);
  }

  private place({ outline: { origin, object, reference = origin }, start, velocity }: Placed, pose: Pose | undefined, time: number): void {
    if (pose === undefined) {
      object.quaternion.copy(start);
      object.position.set(...minus(along(origin, time, velocity), this.origin));
      return;
    }
    const turn = new Quaternion(...pose.turn);
    object.quaternion.multiplyQuaternions(turn, start);
    object.position.set(...minus(origin, reference)).applyQuaternion(turn);
    object.position.add(new Vector3(...minus(pose.position, this.origin)));
  }
}

function outlineOf(shape: ColliderShape, scene: Bounds): Outline {
  switch (shape.kind) {
    case 'plane':
      return { origin: shape.point, object: disc(shape.point, shape.normal, scene) };
    case 'half_pipe':
      return { origin: shape.point, object: trough(shape, scene) };
    case 'sphere':
      return { origin: shape.center, object: solid(new SphereGeometry(SOLID_SCALE * shape.radius, FACETS, FACETS / 2)) };
    case 'capsule': {
      const span = length(minus(shape.end, shape.start));
      return rod(shape, new CapsuleGeometry(SOLID_SCALE * shape.radius, span, FACETS / 4, FACETS));
    }
    case 'cylinder': {
      const [radius, span] = [SOLID_SCALE * shape.radius, SOLID_SCALE * length(minus(shape.end, shape.start))];
      return rod(shape, new CylinderGeometry(radius, radius, span, FACETS));
    }
    case 'box': {
      const [x, y, z] = shape.half_extent.map((half) => 2 * SOLID_SCALE * half);
      const object = solid(new BoxGeometry(x, y, z));
      turn(object, shape.axis_x, shape.axis_y);
      return { origin: shape.center, object };
    }
    case 'mesh': {
      const origin = along(shape.low, 0.5, minus(shape.high, shape.low));
      const { positions, normals, triangles } = facets(shape, origin);
      return { origin, object: solid(lit(positions, normals, triangles)), reference: shape.origin };
    }
  }
}

/** A round solid whose middle is its origin, and whose y goes along a segment. */
function rod({ start, end }: { start: Vector; end: Vector }, geometry: BufferGeometry): Outline {
  const object = solid(geometry);
  const y = unit(minus(end, start));
  if (y !== null) {
    // Tangents z, x and the axis make a right-handed frame.
    const [, x] = tangents(y);
    turn(object, x, y);
  }
  return { origin: along(start, 0.5, minus(end, start)), object };
}

/** Turns an object so that its own x and y point there. */
function turn(object: Object3D, x: Vector, y: Vector): void {
  const axes = [x, y, cross(x, y)].map((axis) => new Vector3(...axis));
  object.quaternion.setFromRotationMatrix(new Matrix4().makeBasis(axes[0], axes[1], axes[2]));
}

function solid(geometry: BufferGeometry): Mesh {
  const mesh = new Mesh(geometry, new MeshLambertMaterial({ color: rgb(SOLID_COLOR) }));
  mesh.castShadow = mesh.receiveShadow = true;
  return mesh;
}
