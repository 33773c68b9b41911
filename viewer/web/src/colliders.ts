// Colliders: a solid of each shape, or the part of an endless one that the scene needs, moving with its velocity.
//
// Enters: colliders, the bounds of the scene (m), then the time (s) of each frame. Leaves: lit objects.

import {
  BoxGeometry, type BufferGeometry, CapsuleGeometry, CylinderGeometry, Matrix4, Mesh, MeshLambertMaterial, type Object3D,
  SphereGeometry, Vector3,
} from 'three';
import { SOLID_COLOR } from './coloring.ts';
import { facets } from './facets.ts';
import { type Bounds, along, cross, length, minus, tangents, unit } from './geometry.ts';
import { disc, lit, trough } from './ground.ts';
import type { Collider, ColliderShape, Vector } from './scene.ts';
import { rgb } from './stage.ts';

/** A drawn solid over the solid: between particles that lie on a ball, a triangle passes below its surface. */
const SOLID_SCALE = 0.985;
const FACETS = 64;

/** A shape as it is drawn: around its own origin, which is a point at time 0. */
interface Outline {
  origin: Vector;
  object: Object3D;
}

export class Colliders {
  readonly objects: Object3D[];
  private readonly moving: { outline: Outline; velocity: Vector }[];

  /** Everything is drawn relative to `origin`. */
  constructor(colliders: readonly Collider[], scene: Bounds, private readonly origin: Vector) {
    const all = colliders.map(({ name, shape, velocity }) => {
      const outline = outlineOf(shape, scene);
      outline.object.name = name;
      this.place(outline, velocity, 0);
      return { outline, velocity };
    });
    this.objects = all.map(({ outline }) => outline.object);
    this.moving = all.filter(({ velocity }) => length(velocity) > 0);
  }

  update(time: number): void {
    for (const { outline, velocity } of this.moving) this.place(outline, velocity, time);
  }

  private place({ origin, object }: Outline, velocity: Vector, time: number): void {
    object.position.set(...minus(along(origin, time, velocity), this.origin));
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
      return { origin, object: solid(lit(positions, normals, triangles)) };
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
