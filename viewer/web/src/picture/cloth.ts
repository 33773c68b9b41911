// Bodies of triangles or springs, and their pins.
//
// Enters: topology once, then positions (m) of all particles at each frame. Leaves: lit meshes, lines, points.

import {
  BufferAttribute, BufferGeometry, LineBasicMaterial, LineSegments, type Material, Mesh, MeshBasicMaterial, type Object3D,
  Points,
} from 'three';
import { PALETTE, PIN_COLOR, THEMES } from './coloring.ts';
import { fabric } from './fabric.ts';
import { dot, length } from './geometry.ts';
import type { Body, Vector } from '../scene.ts';
import { sphereMaterial } from './spheres.ts';
import { rgb } from './stage.ts';
import type { Theme } from '../page/theme.ts';

const PIN_PIXELS = 2;

/** Draws all bodies of a scene that are not bare points. */
export class Cloth {
  readonly objects: Object3D[] = [];
  private readonly meshes: { body: Body; mesh: Mesh; surface: Material }[] = [];
  private readonly pins: Points[] = [];
  /** Edges are not lit, so that they can be read from any side. */
  private readonly edges = new MeshBasicMaterial({ wireframe: true, color: rgb(THEMES.dark.wire) });
  private readonly normals: BufferAttribute;

  /** `positions` are those of all particles, shared by everything that is drawn; the view from the start is along `toEye`. */
  constructor(bodies: readonly Body[], private readonly positions: BufferAttribute, private readonly toEye: Vector) {
    this.normals = new BufferAttribute(new Float32Array(positions.array.length), 3);
    bodies.forEach((body, index) => this.add(body, index));
  }

  /** After positions changed. */
  update(): void {
    if (this.meshes.length === 0) return;
    const normals = this.normals.array as Float32Array;
    for (const { body } of this.meshes) writeNormals(normals, this.positions.array as Float32Array, body);
    this.normals.needsUpdate = true;
  }

  /** The edges of triangles instead of surfaces. */
  showEdges(on: boolean): void {
    for (const { mesh, surface } of this.meshes) {
      mesh.material = on ? this.edges : surface;
      mesh.castShadow = !on;
    }
  }

  get hasPins(): boolean {
    return this.pins.length > 0;
  }

  showPins(on: boolean): void {
    for (const points of this.pins) points.visible = on;
  }

  colorEdges(theme: Theme): void {
    this.edges.color.copy(rgb(THEMES[theme].wire));
  }

  private add(body: Body, index: number): void {
    const color = rgb(body.color ?? PALETTE[index % PALETTE.length]);
    if (body.triangles.length > 0) {
      const surface = fabric(color, this.outside(body));
      const mesh = new Mesh(this.geometry(body.triangles).setAttribute('normal', this.normals), surface);
      mesh.castShadow = mesh.receiveShadow = true;
      this.meshes.push({ body, mesh, surface });
      this.addObject(mesh, body.name);
    } else if (body.springs.length > 0) {
      const lines = new LineSegments(this.geometry(body.springs), new LineBasicMaterial({ color }));
      lines.castShadow = true;
      this.addObject(lines, body.name);
    }
    if (body.pins.length > 0) {
      const material = sphereMaterial({ pixels: PIN_PIXELS }, rgb(PIN_COLOR), 'one color');
      const points = new Points(this.geometry(body.pins), material);
      this.pins.push(points);
      this.addObject(points, `${body.name}: pins`);
    }
  }

  /** Which side of a body's triangles is its outside: that which is seen first, unless the surface is closed. */
  private outside({ triangles }: Body): 'front' | 'back' {
    let [area, seen] = [0, 0];
    for (let corner = 0; corner + 2 < triangles.length; corner += 3) {
      const normal = areaNormal(this.positions.array, triangles, corner);
      area += length(normal);
      seen += dot(normal, this.toEye);
    }
    return seen < -0.05 * area ? 'back' : 'front';
  }

  private geometry(indices: Uint32Array<ArrayBuffer>): BufferGeometry {
    return new BufferGeometry().setAttribute('position', this.positions).setIndex(new BufferAttribute(indices, 1));
  }

  private addObject(object: Object3D, name: string): void {
    object.name = name;
    // Positions change each frame, and their bounds are not kept.
    object.frustumCulled = false;
    this.objects.push(object);
  }
}

/** Twice the area of a triangle times its unit normal. */
function areaNormal(positions: ArrayLike<number>, triangles: Uint32Array, corner: number): Vector {
  const [a, b, c] = [3 * triangles[corner], 3 * triangles[corner + 1], 3 * triangles[corner + 2]];
  const [x, y, z] = [positions[a], positions[a + 1], positions[a + 2]];
  const [ux, uy, uz] = [positions[b] - x, positions[b + 1] - y, positions[b + 2] - z];
  const [vx, vy, vz] = [positions[c] - x, positions[c + 1] - y, positions[c + 2] - z];
  return [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx];
}

/** Unit normal of each vertex: the mean of its triangles' normals, weighted by their areas; up where there is none. */
function writeNormals(normals: Float32Array, positions: Float32Array, body: Body): void {
  const [first, last] = [3 * body.firstParticle, 3 * (body.firstParticle + body.particleCount)];
  normals.fill(0, first, last);
  const { triangles } = body;
  for (let corner = 0; corner + 2 < triangles.length; corner += 3) {
    const [a, b, c] = [3 * triangles[corner], 3 * triangles[corner + 1], 3 * triangles[corner + 2]];
    const [nx, ny, nz] = areaNormal(positions, triangles, corner);
    normals[a] += nx; normals[a + 1] += ny; normals[a + 2] += nz;
    normals[b] += nx; normals[b + 1] += ny; normals[b + 2] += nz;
    normals[c] += nx; normals[c + 1] += ny; normals[c + 2] += nz;
  }
  for (let i = first; i < last; i += 3) {
    const size = Math.sqrt(normals[i] ** 2 + normals[i + 1] ** 2 + normals[i + 2] ** 2);
    if (size > 0) {
      normals[i] /= size; normals[i + 1] /= size; normals[i + 2] /= size;
    } else {
      normals[i + 1] = 1;
    }
  }
}
