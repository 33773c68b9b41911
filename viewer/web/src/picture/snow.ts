// Bodies of bare points, as snow is: a white surface and mist where it is thin, or bare points, or the colours of a number
// of each.
//
// Enters: positions (m) of all particles, and at each frame perhaps a scalar of each. Leaves: lit objects.

import { BufferAttribute, BufferGeometry, DynamicDrawUsage, type Object3D, Points } from 'three';
import { Coloring, type Legend, SNOW_COLOR, THEMES } from './coloring.ts';
import { SHADOW_PIXELS } from './lights.ts';
import { mistMaterial } from './mist.ts';
import { type Range, type Scene, isPoints } from '../scene.ts';
import { spacing } from './spacing.ts';
import { sphereDepthMaterial, sphereMaterial } from './spheres.ts';
import { Spray } from './spray.ts';
import { rgb } from './stage.ts';
import { Surface } from './surface.ts';
import type { Theme } from '../page/theme.ts';

/** Radius of points that have no spacing, and of all where the edges of triangles are shown (pixels). */
const POINT_PIXELS = 1.5;
/** Particles that are asked for their spacing in each frame. */
const LATER_SAMPLES = 20;
/** Mist is drawn after the ground, which is drawn late where it fades. */
const OVER_GROUND = 1;
/** A shadow is that of spheres with this radius over the side of a particle's cube. */
const SHADOW_RADIUS = 0.7;
/** Spacing of a frame is looked for between that of the first and so many times it: spray has none. */
const MOST_SPREAD = 1.6;
/** Radius of a point of mist over the side of a particle's cube. */
const MIST_RADIUS = 0.4;

interface Powder {
  first: number;
  count: number;
  /** Side of a particle's cube in the first frame (m). */
  side: number;
  resize: (side: number) => void;
  shadow: { value: number };
  spray: Spray;
  /** Indices of particles, as `spray` has put them in order. */
  order: BufferAttribute;
  /** What is drawn of dense snow: surface and shadow. */
  dense: BufferGeometry[];
  mist: Points;
  denseCount: number;
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
  /** Of the surface, of mist and of bare points, in the theme. */
  private readonly color = rgb(SNOW_COLOR);

  /** `positions` are those of the first frame. */
  constructor(scene: Scene, private readonly positions: BufferAttribute) {
    this.coloring = scene.colorBy !== null ? new Coloring(scene.colorBy) : null;
    const bodies = scene.bodies.filter((body) => isPoints(body) && body.particleCount > 0);
    this.tint = new BufferAttribute(new Uint8Array(bodies.length > 0 ? positions.array.length : 0).fill(255), 3, true);
    this.surface = bodies.length > 0 ? new Surface(this.color) : null;
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
    for (const powder of this.powders) {
      const { first, count, side, resize, shadow } = powder;
      const now = Math.min(Math.max(spacing(this.own(first, count), LATER_SAMPLES) ?? side, side), MOST_SPREAD * side);
      resize(now);
      shadow.value = SHADOW_RADIUS * now;
      this.part(powder);
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

  /** Snow before a light background is a little darker, and darker still along its outline. */
  setTheme(theme: Theme): void {
    const { snow, rim } = THEMES[theme];
    this.color.copy(rgb(snow));
    this.surface?.setRim(rim);
  }

  /** Bare points instead of a surface. */
  showPoints(on: boolean): void {
    this.wireframe = on;
    if (this.surface !== null) this.surface.mesh.visible = !on;
    for (const { mist, denseCount, count } of this.powders) mist.visible = !on && denseCount < count;
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
    const points = new Points(geometry, sphereMaterial({ pixels: POINT_PIXELS }, this.color, 'tinted'));
    Object.assign(points, { name, frustumCulled: false, visible: alone, userData: { alone } });
    this.bare.push(points);
    this.objects.push(points);
  }

  private addPowder(first: number, count: number, side: number): void {
    const spray = new Spray(first, count, side);
    const order = new BufferAttribute(spray.order, 1).setUsage(DynamicDrawUsage);
    const shadow = { value: SHADOW_RADIUS * side };
    const solid = new BufferGeometry().setAttribute('position', this.positions).setIndex(order);
    const { seen, cast } = sphereDepthMaterial(shadow, SHADOW_PIXELS);
    const caster = new Points(solid, seen);
    Object.assign(caster, { frustumCulled: false, castShadow: true, customDepthMaterial: cast });

    const tinted = () => new BufferGeometry().setAttribute('position', this.positions).setAttribute('tint', this.tint).setIndex(order);
    const splats = tinted();
    const resize = this.surface!.add(splats);
    const mist = new Points(tinted(), mistMaterial(MIST_RADIUS * side, this.color));
    Object.assign(mist, { frustumCulled: false, renderOrder: OVER_GROUND });
    this.objects.push(caster, mist);
    const powder: Powder = { first, count, side, resize, shadow, spray, order, dense: [solid, splats], mist, denseCount: count };
    this.powders.push(powder);
    this.part(powder);
  }

  /** What is drawn as a surface, and what as mist. */
  private part(powder: Powder): void {
    const { spray, order, dense, mist, count, denseCount: before } = powder;
    const now = spray.sort(this.positions.array);
    powder.denseCount = now;
    // Where all is dense, and was, the order is the same.
    if (now < count || before < count) order.needsUpdate = true;
    for (const geometry of dense) geometry.setDrawRange(0, now);
    mist.geometry.setDrawRange(now, count - now);
    mist.visible = !this.wireframe && now < count;
  }
}
