// The topology of a stream as a scene, and its diagnostics as plots show them.
//
// Enters: messages of the contract, whose indices and numbers the client has checked. Leaves: what a view draws.

import {
  type ColliderShape as Shape, type Diagnostics as Reported, type Topology, type Vector3, meshOf,
} from '../../../../client/typescript/src/index.ts';
import { meshShape } from '../picture/extent.ts';
import { type Body, type Collider, type ColliderShape, type Diagnostics, type Scene, type Vector, isPoints } from '../scene.ts';

export function sceneOf(title: string, { particleCount, bodies, colliders }: Topology): Scene {
  const drawn: Body[] = bodies.map(({ name, firstParticle, particleCount, triangles, springs, pins, color }) => (
    { name, firstParticle, particleCount, triangles, springs, pins, color }
  ));
  return {
    title, particleCount, bodies: drawn, colorBy: drawn.some(isPoints) ? 'plastic_ratio' : null,
    colliders: colliders.flatMap(colliderOf),
  };
}

export function diagnosticsOf(reported: Reported): Diagnostics {
  const steps = [reported.cloth, reported.snow].map((part) => part?.dtSeconds ?? 0).filter((dt) => dt > 0);
  return {
    time: reported.timeSeconds,
    kinetic: reported.kineticEnergy,
    elastic: reported.elasticEnergy,
    gravitational: reported.gravitationalEnergy,
    // 0 stands for a session without springs.
    stretch: reported.maxStretch > 0 ? reported.maxStretch : null,
    dt: steps.length > 0 ? Math.min(...steps) : null,
  };
}

/** A shape that is newer than this page is left out. */
function colliderOf({ name, velocity, shape }: Shape): Collider[] {
  const drawn = shapeOf(shape);
  return drawn === null ? [] : [{ name, velocity: vector(velocity), shape: drawn }];
}

function shapeOf(shape: Shape['shape']): ColliderShape | null {
  switch (shape.case) {
    case 'plane':
      return { kind: 'plane', point: vector(shape.value.point), normal: vector(shape.value.normal) };
    case 'sphere':
      return { kind: 'sphere', center: vector(shape.value.center), radius: shape.value.radius };
    case 'capsule':
    case 'cylinder':
      return { kind: shape.case, start: vector(shape.value.start), end: vector(shape.value.end), radius: shape.value.radius };
    case 'box': {
      const { center, halfExtent, axisX, axisY } = shape.value;
      return { kind: 'box', center: vector(center), half_extent: vector(halfExtent), axis_x: vector(axisX), axis_y: vector(axisY) };
    }
    case 'halfPipe': {
      const { point, axis, up, radius } = shape.value;
      return { kind: 'half_pipe', point: vector(point), axis: vector(axis), up: vector(up), radius };
    }
    case 'mesh': {
      const { points, triangles, origin } = meshOf(shape.value);
      return meshShape(points, triangles, origin);
    }
    default:
      return null;
  }
}

const vector = (of: Vector3 | undefined): Vector => [of?.x ?? 0, of?.y ?? 0, of?.z ?? 0];
