// Endless colliders, as much of them as the scene needs: a plane as a disc with a grid, a half-pipe as a trough.
//
// Enters: the collider's numbers (m), the bounds of the scene. Leaves: objects around the collider's own point.

import {
  BufferAttribute, BufferGeometry, CircleGeometry, DoubleSide, Matrix4, Mesh, MeshLambertMaterial, Vector2, Vector3,
} from 'three';
import { THEMES } from './coloring.ts';
import { type Bounds, along, cross, dot, minus, tangents, unit } from './geometry.ts';
import type { Vector } from '../scene.ts';
import { rgb } from './stage.ts';
import type { Theme } from '../page/theme.ts';

/** Radius of the drawn disc over the radius of the scene; the disc is whole up to `SOLID`, and fades beyond. */
const PLANE_SCALE = 2.4;
const SOLID = 0.4;
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
/** A plane that stands steeper than this height of its unit normal is a wall, and is seen through. */
const STEEP = 0.5;
const WALL_OPACITY = 0.45;

/** Colours of all that is drawn here, which follow the theme. */
const ground = { value: rgb(THEMES.dark.ground) };
const lines = { value: rgb(THEMES.dark.grid) };
const opacity = { value: 1 };

export function colorGround(theme: Theme): void {
  ground.value.copy(rgb(THEMES[theme].ground));
  lines.value.copy(rgb(THEMES[theme].grid));
}

/** Whether planes have lines. */
export function showGrid(on: boolean): void {
  opacity.value = on ? 1 : 0;
}

/** The part of a plane below the scene. From below it is not seen, so that it hides nothing. */
export function disc(point: Vector, normal: Vector, scene: Bounds): Mesh {
  const up = unit(normal) ?? [0, 1, 0];
  const [first, second] = tangents(up);
  const toCenter = minus(scene.center(), point);
  const foot = along(along(toCenter, -dot(toCenter, up), up), -DEPTH * scene.radius(), up);
  const radius = PLANE_SCALE * scene.radius();

  // The grid stands still in the world, wherever the disc is.
  const spacing = roundLength(radius / GRID_LINES);
  const middle = along(point, 1, foot);
  const offset = new Vector2(...[first, second].map((axis) => dot(middle, axis) % spacing));
  const mesh = new Mesh(new CircleGeometry(radius, DISC_CORNERS), discMaterial(radius, spacing, offset, Math.abs(up[1]) < STEEP));
  const [x, y, z] = [first, second, up].map((axis) => new Vector3(...axis));
  mesh.geometry.applyMatrix4(new Matrix4().makeBasis(x, y, z).setPosition(...foot));
  mesh.receiveShadow = true;
  return mesh;
}

/** Lines whose distance is one, two or five times a power of ten (m), drawn as thin as a pixel at any distance. */
function discMaterial(radius: number, spacing: number, offset: Vector2, wall: boolean): MeshLambertMaterial {
  const material = new MeshLambertMaterial({ transparent: true });
  material.onBeforeCompile = (shader) => {
    Object.assign(shader.uniforms, {
      ground, lines, gridOpacity: opacity, spacing: { value: spacing }, offset: { value: offset }, rim: { value: radius },
      whole: { value: wall ? WALL_OPACITY : 1 },
    });
    shader.vertexShader = shader.vertexShader
      .replace('#include <common>', '#include <common>\nvarying vec2 vPlane;')
      .replace('#include <begin_vertex>', '#include <begin_vertex>\nvPlane = 2.0 * uv - 1.0;');
    shader.fragmentShader = shader.fragmentShader
      .replace('#include <common>', `#include <common>\n${DISC_PARS}`)
      .replace('#include <color_fragment>', DISC_COLOR);
  };
  return material;
}

const DISC_PARS = /* glsl */ `
  varying vec2 vPlane;
  uniform vec3 ground;
  uniform vec3 lines;
  uniform vec2 offset;
  uniform float spacing;
  uniform float rim;
  uniform float whole;
  uniform float gridOpacity;
`;

const DISC_COLOR = /* glsl */ `
  vec2 cell = (rim * vPlane + offset) / spacing;
  vec2 pixel = max(fwidth(cell), 1e-6);
  vec2 line = 1.0 - min(abs(fract(cell - 0.5) - 0.5) / pixel, 1.0);
  // Lines closer than two pixels would be a grey that flickers.
  line *= smoothstep(0.5, 0.2, pixel);
  diffuseColor.rgb = mix(ground, lines, gridOpacity * max(line.x, line.y));
  diffuseColor.a = whole * (1.0 - smoothstep(${SOLID}, 1.0, length(vPlane)));
`;

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
  const mesh = new Mesh(lit(positions, normals, indices), plain());
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

/** Flat arrays: x y z of each corner, three corners of each triangle. */
export function lit(positions: number[], normals: number[], indices: number[]): BufferGeometry {
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(new Float32Array(positions), 3));
  geometry.setAttribute('normal', new BufferAttribute(new Float32Array(normals), 3));
  geometry.setIndex(indices);
  return geometry;
}

/** The colour of the ground, and no grid. */
function plain(): MeshLambertMaterial {
  const material = new MeshLambertMaterial({ side: DoubleSide });
  material.color = ground.value;
  return material;
}
