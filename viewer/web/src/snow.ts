// Bodies of bare points, as snow is: a white surface, or bare points, or the colours of a number of each.
//
// Enters: positions (m) of all particles, and at each frame perhaps a scalar of each. Leaves: lit objects.

import { BufferAttribute, BufferGeometry, type Object3D, Points } from 'three';
import { Coloring, type Legend, SNOW_COLOR } from './coloring.ts';
import { SHADOW_PIXELS } from './lights.ts';
import { type Range, type Scene, isPoints } from './scene.ts';
import { spacing } from './spacing.ts';
import { sphereDepthMaterial, sphereMaterial } from './spheres.ts';
import { rgb } from './stage.ts';
import { Surface } from './surface.ts';

/** Radius of points that have no spacing, and of all where the edges of triangles are shown (pixels). */
const POINT_PIXELS = 1.5;
/** A shadow is that of spheres with this radius over the side of a particle's cube. */
const SHADOW_RADIUS = 0.7;
/** Spacing of a frame is looked for between that of the first and so many times it: spray has none. */
const MOST_SPREAD = 1.6;

interface Powder {
  first: number;
  count: number;
  /** Side of a particle's cube in the first frame (m). */
  side: number;
  resize: (side: number) => void;
  shadow: { value: number };
}

/** Draws all bodies of a scene that are bare points. */
export class Snow {
  readonly objects: Object3D[] = [];
  readonly surface: Surface | null;
  private readonly bare: Points[] = [];
  private readonly powders: Powder[] = [];
  private readonly coloring: Coloring | null;
  private readonly tint: BufferAttribute;
  private scalar: Float32Array | null = null;
  /** Where the recording was made with other colours than the usual ones, they are shown from the start. */
  private falseColors: boolean;
  private wireframe = false;

  /** `positions` are those of the first frame. */
  constructor(scene: Scene, private readonly positions: BufferAttribute) {
    this.coloring = scene.colorBy !== null ? new Coloring(scene.colorBy) : null;
    const bodies = scene.bodies.filter((body) => isPoints(body) && body.particleCount > 0);
    this.tint = new BufferAttribute(new Uint8Array(bodies.length > 0 ? positions.array.length : 0).fill(255), 3, true);
    this.surface = bodies.length > 0 ? new Surface(rgb(SNOW_COLOR)) : null;
    this.falseColors = this.hasColors && scene.colorBy !== 'plastic_ratio';
    for (const { name, firstParticle, particleCount } of bodies) {
      const side = spacing(this.own(firstParticle, particleCount));
      this.addPoints(name, firstParticle, particleCount, side === null);
      if (side !== null) this.addPowder(firstParticle, particleCount, side);
    }
    if (this.surface !== null) this.objects.push(this.surface.mesh);
  }

  update(scalar: Float32Array | null): void {
    this.scalar = scalar;
    for (const { first, count, side, resize, shadow } of this.powders) {
      const now = Math.min(Math.max(spacing(this.own(first, count)) ?? side, side), MOST_SPREAD * side);
      resize(now);
      shadow.value = SHADOW_RADIUS * now;
    }
    if (this.falseColors) this.paint();
  }

  /** Colours are those of a scale from the least to the largest number. */
  setScale(range: Range): void {
    this.coloring?.setScale(range);
  }

  /** White, or the colours of what the recording says of each particle; false if it says nothing. */
  showFalseColors(on: boolean): boolean {
    this.falseColors = on && this.hasColors;
    if (this.falseColors) this.paint();
    else {
      (this.tint.array as Uint8Array).fill(255);
      this.tint.needsUpdate = true;
    }
    return this.falseColors;
  }

  /** Bare points instead of a surface. */
  showPoints(on: boolean): void {
    this.wireframe = on;
    if (this.surface !== null) this.surface.mesh.visible = !on;
    for (const points of this.bare) points.visible = on || points.userData['alone'] === true;
  }

  /** What the colours mean; null if there are none. */
  legend(): Legend | null {
    return this.falseColors ? this.coloring!.legend() : null;
  }

  get showsColors(): boolean {
    return this.falseColors;
  }

  get hasColors(): boolean {
    return this.coloring !== null && this.surface !== null;
  }

  /** Whether the surface has to be prepared before a picture. */
  get isSurface(): boolean {
    return this.surface !== null && !this.wireframe && this.powders.length > 0;
  }

  private own(first: number, count: number): Float32Array {
    return this.positions.array.subarray(3 * first, 3 * (first + count)) as Float32Array;
  }

  private paint(): void {
    if (this.scalar === null) return;
    this.coloring!.write(this.scalar, this.tint.array as Uint8Array);
    this.tint.needsUpdate = true;
  }

  private addPoints(name: string, first: number, count: number, alone: boolean): void {
    const geometry = new BufferGeometry().setAttribute('position', this.positions).setAttribute('tint', this.tint);
    geometry.setDrawRange(first, count);
    const points = new Points(geometry, sphereMaterial({ pixels: POINT_PIXELS }, rgb(SNOW_COLOR), 'tinted'));
    Object.assign(points, { name, frustumCulled: false, visible: alone, userData: { alone } });
    this.bare.push(points);
    this.objects.push(points);
  }

  private addPowder(first: number, count: number, side: number): void {
    const shadow = { value: SHADOW_RADIUS * side };
    const geometry = new BufferGeometry().setAttribute('position', this.positions);
    geometry.setDrawRange(first, count);
    const { seen, cast } = sphereDepthMaterial(shadow, SHADOW_PIXELS);
    const caster = new Points(geometry, seen);
    Object.assign(caster, { frustumCulled: false, castShadow: true, customDepthMaterial: cast });
    this.objects.push(caster);
    const resize = this.surface!.add(this.positions, this.tint, first, count);
    this.powders.push({ first, count, side, resize, shadow });
  }
}
