// Bodies of triangles or springs, and their pins.
//
// Enters: topology once, then positions (m) of all particles at each frame. Leaves: lit meshes, lines, points.

import {
  BufferAttribute, BufferGeometry, DoubleSide, LineBasicMaterial, LineSegments, Mesh, MeshStandardMaterial, type Object3D,
  Points,
} from 'three';
import { PALETTE, PIN_COLOR } from './coloring.ts';
import type { Body } from './scene.ts';
import { sphereMaterial } from './spheres.ts';
import { rgb } from './stage.ts';

const PIN_PIXELS = 3.5;

/** Draws all bodies of a scene that are not bare points. */
export class Cloth {
  readonly objects: Object3D[] = [];
  private readonly meshes: { body: Body; material: MeshStandardMaterial }[] = [];
  private readonly normals: BufferAttribute;

  /** `positions` are those of all particles, shared by everything that is drawn. */
  constructor(bodies: readonly Body[], private readonly positions: BufferAttribute) {
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

  /** Switches between surfaces and the edges of their triangles. */
  toggleWireframe(): boolean {
    for (const { material } of this.meshes) material.wireframe = !material.wireframe;
    return this.meshes.some(({ material }) => material.wireframe);
  }

  private add(body: Body, index: number): void {
    const color = rgb(PALETTE[index % PALETTE.length]);
    if (body.triangles.length > 0) {
      const material = new MeshStandardMaterial({ color, side: DoubleSide, roughness: 0.82 });
      const mesh = new Mesh(this.geometry(body.triangles).setAttribute('normal', this.normals), material);
      mesh.castShadow = mesh.receiveShadow = true;
      this.meshes.push({ body, material });
      this.addObject(mesh, body.name);
    } else if (body.springs.length > 0) {
      const lines = new LineSegments(this.geometry(body.springs), new LineBasicMaterial({ color }));
      lines.castShadow = true;
      this.addObject(lines, body.name);
    }
    if (body.pins.length > 0) {
      const material = sphereMaterial({ pixels: PIN_PIXELS }, rgb(PIN_COLOR), 'one color');
      this.addObject(new Points(this.geometry(body.pins), material), `${body.name}: pins`);
    }
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

/** Unit normal of each vertex: the mean of its triangles' normals, weighted by their areas; up where there is none. */
function writeNormals(normals: Float32Array, positions: Float32Array, body: Body): void {
  const [first, last] = [3 * body.firstParticle, 3 * (body.firstParticle + body.particleCount)];
  normals.fill(0, first, last);
  const { triangles } = body;
  for (let corner = 0; corner + 2 < triangles.length; corner += 3) {
    const [a, b, c] = [3 * triangles[corner], 3 * triangles[corner + 1], 3 * triangles[corner + 2]];
    const [x, y, z] = [positions[a], positions[a + 1], positions[a + 2]];
    const [ux, uy, uz] = [positions[b] - x, positions[b + 1] - y, positions[b + 2] - z];
    const [vx, vy, vz] = [positions[c] - x, positions[c + 1] - y, positions[c + 2] - z];
    // Twice the area times the unit normal.
    const [nx, ny, nz] = [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx];
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
