// A mark at one particle: a red point with a white rim, which nothing hides.

import { BufferAttribute, BufferGeometry, Points } from 'three';
import { sphereMaterial } from './spheres.ts';
import { rgb } from './stage.ts';

/** From the rim to the middle: radius (pixels) and colour. */
const DISCS = [{ pixels: 9, color: [255, 255, 255] }, { pixels: 6, color: [229, 40, 36] }] as const;
/** After all else, since it asks for no depth. */
const LAST = 1000;

/** Points at a particle, whose position is shared with everything that is drawn. */
export function mark(particle: number, positions: BufferAttribute): Points[] {
  const geometry = new BufferGeometry().setAttribute('position', positions).setIndex([particle]);
  return DISCS.map(({ pixels, color }, index) => {
    const material = sphereMaterial({ pixels }, rgb(color), 'one color');
    material.depthTest = material.depthWrite = false;
    const points = new Points(geometry, material);
    points.name = 'mark';
    points.frustumCulled = false;
    points.renderOrder = LAST + index;
    return points;
  });
}
