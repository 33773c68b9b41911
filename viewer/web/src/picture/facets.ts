// A closed surface as it is drawn: round where its triangles meet flatly, with an edge where they do not.
//
// Enters: points (m), triangles turned outwards. Leaves: corners with unit normals, and triangles over them, around an
// origin.

import { along, cross, dot, length, minus, unit } from './geometry.ts';
import type { MeshShape, Vector } from '../scene.ts';

/** Cosine of the angle (40 degrees) from which on there is an edge between two triangles. */
const CREASE = Math.cos((40 * Math.PI) / 180);
/**
 * The drawn surface lies this far within the solid, over half of its smallest extent: between particles that lie on a
 * surface, a triangle of cloth passes below it.
 */
const INSET = 0.015;
/** And no farther than this share of the shortest edge at a point: a thin part stays, and is not turned inside out. */
const OF_EDGE = 0.25;
/** A point of more triangles is round: it has one normal. */
const MOST_TRIANGLES = 64;

/** Flat arrays: x y z of each corner, three corners of each triangle. */
export interface Facets {
  positions: number[];
  normals: number[];
  triangles: number[];
}

/** The drawn surface of a mesh, relative to `origin`. */
export function facets(mesh: MeshShape, origin: Vector): Facets {
  const { low, high, triangles } = mesh;
  const inset = INSET * Math.min(...minus(high, low)) / 2;
  const faces = facesOf(mesh);
  const drawn: Facets = { positions: [], normals: [], triangles: new Array<number>(triangles.length) };

  for (const corners of cornersOfPoints(triangles)) {
    const round = sum(corners, faces, () => true);
    const edge = corners.reduce((least, corner) => Math.min(least, faces.edges[corner]), Infinity);
    const at = along(pointAt(mesh, triangles[corners[0]]), -Math.min(inset, OF_EDGE * edge), round);
    const made: { normal: Vector; index: number }[] = [];
    for (const corner of corners) {
      const own = faces.normals[Math.floor(corner / 3)];
      const normal = corners.length > MOST_TRIANGLES ? round : sum(corners, faces, (other) => dot(own, other) > CREASE, round);
      let same = made.find((one) => one.normal.every((part, axis) => part === normal[axis]));
      if (same === undefined) {
        same = { normal, index: drawn.positions.length / 3 };
        made.push(same);
        drawn.positions.push(...minus(at, origin));
        drawn.normals.push(...normal);
      }
      drawn.triangles[corner] = same.index;
    }
  }
  return drawn;
}

/** What is known of each triangle and of each of its corners. */
interface Faces {
  /** Unit normal of a triangle; 0 if it has no area. */
  normals: Vector[];
  /** Angle at a corner (rad). */
  angles: Float64Array;
  /** Length of the edge that begins at a corner (m). */
  edges: Float64Array;
}

function facesOf(mesh: MeshShape): Faces {
  const count = mesh.triangles.length;
  const faces: Faces = { normals: [], angles: new Float64Array(count), edges: new Float64Array(count) };
  for (let first = 0; first < count; first += 3) {
    const points = [0, 1, 2].map((corner) => pointAt(mesh, mesh.triangles[first + corner]));
    for (let corner = 0; corner < 3; corner++) {
      const [ahead, back] = [1, 2].map((step) => minus(points[(corner + step) % 3], points[corner]));
      faces.angles[first + corner] = Math.atan2(length(cross(ahead, back)), dot(ahead, back));
      faces.edges[first + corner] = length(ahead);
    }
    faces.normals.push(unit(cross(minus(points[1], points[0]), minus(points[2], points[0]))) ?? [0, 0, 0]);
  }
  return faces;
}

/** The corners at each point that has any, as indices into the triangles. */
function cornersOfPoints(triangles: Uint32Array): number[][] {
  const corners: number[][] = [];
  triangles.forEach((point, corner) => (corners[point] ??= []).push(corner));
  // It passes over points of no triangle.
  return corners.filter(() => true);
}

/**
 * Unit sum of the normals of those triangles that `counts` takes, each weighted by its angle there (Baerentzen and Aanaes
 * 2005); `none` where there is none.
 */
function sum(corners: readonly number[], { normals, angles }: Faces, counts: (normal: Vector) => boolean, none: Vector = [0, 1, 0]): Vector {
  let all: Vector = [0, 0, 0];
  for (const corner of corners) {
    const normal = normals[Math.floor(corner / 3)];
    if (counts(normal)) all = along(all, angles[corner], normal);
  }
  return unit(all) ?? none;
}

const pointAt = ({ points }: MeshShape, index: number): Vector => [points[3 * index], points[3 * index + 1], points[3 * index + 2]];
