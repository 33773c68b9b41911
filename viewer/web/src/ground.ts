// Endless colliders, as much of them as the scene needs: a plane as a disc with a grid, a half-pipe as a trough.
//
// Enters: the collider's numbers (m), the bounds of the scene. Leaves: objects around the collider's own point.

import {
  BufferAttribute, BufferGeometry, DoubleSide, Group, LineBasicMaterial, LineSegments, Mesh, MeshStandardMaterial,
} from 'three';
import { GROUND_COLOR } from './coloring.ts';
import { type Bounds, along, cross, dot, minus, tangents, unit } from './geometry.ts';
import type { Vector } from './scene.ts';
import { rgb } from './stage.ts';

/** Radius of the drawn disc over the radius of the scene; the disc is whole up to `SOLID`, and fades beyond. */
const PLANE_SCALE = 2.4;
const SOLID = 0.45;
const DISC_CORNERS = 96;
/**
 * The drawn surface lies this far below, over the radius of the scene: between particles that lie on a surface, a
 * triangle passes below it.
 */
const DEPTH = 0.004;
const TROUGH_FACETS = 48;
const TROUGH_SCALE = 1.4;
/** Lines of the grid from the centre to the rim, at least. */
const GRID_LINES = 8;
const GRID_COLOR = [118, 124, 136] as const;

/** The part of a plane below the scene. From below it is not seen, so that it hides nothing. */
export function disc(point: Vector, normal: Vector, scene: Bounds): Group {
  const up = unit(normal) ?? [0, 1, 0];
  const frame = tangents(up);
  const toCenter = minus(scene.center(), point);
  const foot = along(along(toCenter, -dot(toCenter, up), up), -DEPTH * scene.radius(), up);
  const radius = PLANE_SCALE * scene.radius();

  const group = new Group();
  group.add(discMesh(foot, up, frame, radius), grid(foot, frame, radius, point));
  return group;
}

function discMesh(foot: Vector, up: Vector, [first, second]: [Vector, Vector], radius: number): Mesh {
  const [positions, colors, indices] = [[...foot], [1, 1, 1, 1], [] as number[]];
  for (const [share, alpha] of [[SOLID, 1], [1, 0]]) {
    for (let corner = 0; corner < DISC_CORNERS; corner++) {
      const angle = (2 * Math.PI * corner) / DISC_CORNERS;
      const across = along(foot, share * radius * Math.cos(angle), first);
      positions.push(...along(across, share * radius * Math.sin(angle), second));
      colors.push(1, 1, 1, alpha);
    }
  }
  for (let corner = 0; corner < DISC_CORNERS; corner++) {
    const next = (corner + 1) % DISC_CORNERS;
    const [a, b] = [1 + corner, 1 + next];
    const [c, d] = [a + DISC_CORNERS, b + DISC_CORNERS];
    indices.push(0, a, b, a, c, d, a, d, b);
  }
  const geometry = lit(positions, positions.map((_, at) => up[at % 3]), indices);
  geometry.setAttribute('color', new BufferAttribute(new Float32Array(colors), 4));
  const mesh = new Mesh(geometry, material({ vertexColors: true, transparent: true }));
  mesh.receiveShadow = true;
  return mesh;
}

/** Lines of a length that is one, two or five times a power of ten (m), through the collider's own point. */
function grid(foot: Vector, frame: [Vector, Vector], radius: number, point: Vector): LineSegments {
  const spacing = roundLength(radius / GRID_LINES);
  const [positions, colors] = [[] as number[], [] as number[]];
  const { r, g, b } = rgb(GRID_COLOR);
  const alpha = (a: number, c: number) => 0.55 * Math.min(1, Math.max(0, (1 - Math.hypot(a, c) / radius) / (1 - SOLID)));
  const put = (axis: number, across: number, at: number) => {
    positions.push(...along(along(foot, across, frame[axis]), at, frame[1 - axis]));
    colors.push(r, g, b, alpha(across, at));
  };

  for (const axis of [0, 1]) {
    // The grid stands still in the world, wherever the disc is.
    const middle = dot(along(point, 1, foot), frame[axis]);
    const offset = Math.ceil(middle / spacing) * spacing - middle;
    for (let across = offset - spacing * Math.ceil(radius / spacing); across < radius; across += spacing) {
      const half = Math.sqrt(Math.max(0, radius * radius - across * across));
      // In pieces, since colours are mixed along each.
      for (let piece = -8; piece < 8; piece++) {
        put(axis, across, (half * piece) / 8);
        put(axis, across, (half * (piece + 1)) / 8);
      }
    }
  }
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(new Float32Array(positions), 3));
  geometry.setAttribute('color', new BufferAttribute(new Float32Array(colors), 4));
  return new LineSegments(geometry, new LineBasicMaterial({ vertexColors: true, transparent: true, depthWrite: false }));
}

/** The largest of 1, 2, 5, 10 ... times a power of ten that is no more than `length`. */
function roundLength(length: number): number {
  const power = 10 ** Math.floor(Math.log10(length));
  return [5, 2, 1].map((digit) => digit * power).find((round) => round <= length) ?? power;
}

/** The inside of a tube below its axis, with a bank on either side. */
export function trough(shape: { point: Vector; axis: Vector; up: Vector; radius: number }, scene: Bounds): Mesh {
  const axis = unit(shape.axis) ?? [0, 0, 1];
  const up = unit(shape.up) ?? [0, 1, 0];
  const side = cross(up, axis);
  const middle = dot(minus(scene.center(), shape.point), axis);
  const half = TROUGH_SCALE * scene.radius();

  const [positions, normals, indices] = [[] as number[], [] as number[], [] as number[]];
  const profile = troughProfile(shape.radius, half);
  for (const { across, height, normal } of profile) {
    for (const end of [middle - half, middle + half]) {
      positions.push(...along(along(along([0, 0, 0], across, side), height, up), end, axis));
      normals.push(...along(along([0, 0, 0], normal[0], side), normal[1], up));
    }
  }
  for (let strip = 0; strip < profile.length - 1; strip++) {
    const a = 2 * strip;
    indices.push(a, a + 1, a + 2, a + 2, a + 1, a + 3);
  }
  const mesh = new Mesh(lit(positions, normals, indices), material({ side: DoubleSide }));
  mesh.receiveShadow = true;
  return mesh;
}

interface ProfilePoint {
  across: number;
  height: number;
  normal: [number, number];
}

/** From bank to bank (m). */
function troughProfile(radius: number, bank: number): ProfilePoint[] {
  const flat = (across: number): ProfilePoint => ({ across, height: 0, normal: [0, 1] });
  const round = Array.from({ length: TROUGH_FACETS + 1 }, (_, facet): ProfilePoint => {
    const angle = Math.PI * (1 + facet / TROUGH_FACETS);
    const [x, y] = [Math.cos(angle), Math.sin(angle)];
    return { across: radius * x, height: radius * y, normal: [-x, -y] };
  });
  return [flat(-radius - bank), flat(-radius), ...round, flat(radius), flat(radius + bank)];
}

function lit(positions: number[], normals: number[], indices: number[]): BufferGeometry {
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(new Float32Array(positions), 3));
  geometry.setAttribute('normal', new BufferAttribute(new Float32Array(normals), 3));
  geometry.setIndex(indices);
  return geometry;
}

function material(options: ConstructorParameters<typeof MeshStandardMaterial>[0]): MeshStandardMaterial {
  // The grid lies in the surface, and is drawn over it.
  return new MeshStandardMaterial({
    color: rgb(GROUND_COLOR), roughness: 0.95, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1, ...options,
  });
}
