// Bodies of bare points, as snow is: spheres whose radius is half their spacing.
//
// Enters: positions (m) of all particles, and at each frame perhaps a scalar of each. Leaves: lit spheres.

import { BufferAttribute, BufferGeometry, Points } from 'three';
import { Coloring, type Legend, PALETTE } from './coloring.ts';
import { type Scene, isPoints } from './scene.ts';
import { spacing } from './spacing.ts';
import { type Radius, sphereDepthMaterial, sphereMaterial } from './spheres.ts';
import { rgb } from './stage.ts';

/** Radius of points that have no spacing. */
const POINT_PIXELS = 2.5;
const SHADOW_PIXELS = 2048;

/** Draws all bodies of a scene that are bare points. */
export class Snow {
  readonly objects: Points[] = [];
  private readonly coloring: Coloring | null;
  private readonly colors: BufferAttribute | null;

  /** `positions` are those of the first frame; `scalar` says whether frames have one. */
  constructor(scene: Scene, positions: BufferAttribute, scalar: Float32Array | null) {
    const tinted = scene.colorBy !== null && scalar !== null;
    this.coloring = tinted ? new Coloring(scene.colorBy!) : null;
    this.colors = tinted ? new BufferAttribute(new Uint8Array(positions.array.length), 3, true) : null;

    scene.bodies.forEach((body, index) => {
      if (!isPoints(body) || body.particleCount === 0) return;
      const { firstParticle, particleCount } = body;
      const own = positions.array.subarray(3 * firstParticle, 3 * (firstParticle + particleCount)) as Float32Array;
      const side = spacing(own);
      const radius: Radius = side === null ? { pixels: POINT_PIXELS } : { metres: 0.5 * side };

      const geometry = new BufferGeometry().setAttribute('position', positions);
      if (this.colors !== null) geometry.setAttribute('tint', this.colors);
      geometry.setDrawRange(firstParticle, particleCount);
      const color = rgb(PALETTE[index % PALETTE.length]);
      const points = new Points(geometry, sphereMaterial(radius, color, tinted ? 'tinted' : 'one color'));
      points.name = body.name;
      points.frustumCulled = false;
      points.receiveShadow = true;
      if (side !== null) {
        points.castShadow = true;
        points.customDepthMaterial = sphereDepthMaterial(0.5 * side, SHADOW_PIXELS);
      }
      this.objects.push(points);
    });
  }

  update(scalar: Float32Array | null): void {
    if (this.colors === null || this.coloring === null || scalar === null || this.objects.length === 0) return;
    this.coloring.write(scalar, this.colors.array as Uint8Array);
    this.colors.needsUpdate = true;
  }

  /** What the colours mean; null if they only tell bodies apart. */
  legend(): Legend | null {
    return this.objects.length > 0 ? (this.coloring?.legend() ?? null) : null;
  }
}
