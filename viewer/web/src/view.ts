// A scene on a stage: what is drawn of each frame.
//
// Enters: a scene and its first frame, then frames. Leaves: a picture. Particles may be far from the world's origin,
// so everything is drawn relative to an origin of the scene's own, from which positions are exact to the step.

import { BufferAttribute, DynamicDrawUsage } from 'three';
import { bodyBounds, cameraOf, sceneBounds } from './camera.ts';
import { Cloth } from './cloth.ts';
import { Colliders } from './colliders.ts';
import type { Legend } from './coloring.ts';
import { Bounds, minus } from './geometry.ts';
import { restore } from './packed.ts';
import type { Frame, Scene, Vector } from './scene.ts';
import { Snow } from './snow.ts';
import type { Stage } from './stage.ts';

export class View {
  private readonly origin: Vector;
  private readonly local: BufferAttribute;
  private readonly cloth: Cloth;
  private readonly snow: Snow;
  private readonly colliders: Colliders;

  constructor(private readonly stage: Stage, scene: Scene, private shown: Frame) {
    this.origin = originOf(shown);
    this.local = new BufferAttribute(new Float32Array(3 * scene.particleCount), 3).setUsage(DynamicDrawUsage);
    this.writePositions(shown);

    const bodies = bodyBounds(scene, (particle) => position(shown, particle));
    const all = sceneBounds(scene, bodies);
    this.cloth = new Cloth(scene.bodies, this.local);
    this.snow = new Snow(scene, this.local, shown.scalar);
    this.colliders = new Colliders(scene.colliders, all, this.origin);
    stage.add(...this.colliders.objects, ...this.cloth.objects, ...this.snow.objects);

    const { eye, target } = cameraOf(scene, all, bodies);
    const local = (point: Vector) => minus(point, this.origin);
    stage.look({ camera: { eye: local(eye), target: local(target) }, corners: all.corners().map(local), radius: all.radius() });
    this.show(shown);
  }

  /** Draws a frame at once. */
  show(frame: Frame): void {
    this.shown = frame;
    this.writePositions(frame);
    this.cloth.update();
    this.snow.update(frame.scalar);
    this.colliders.update(frame.time);
    this.stage.drawChanged();
  }

  toggleWireframe(): boolean {
    const wireframe = this.cloth.toggleWireframe();
    this.stage.changed();
    return wireframe;
  }

  legend(): Legend | null {
    return this.snow.legend();
  }

  /** Positions of the shown frame (m), in the world. */
  positions(): Float32Array {
    return restore(this.shown.numbers, this.shown.step);
  }

  private writePositions({ numbers, step }: Frame): void {
    const positions = this.local.array;
    const [x, y, z] = this.origin;
    for (let i = 0; i < numbers.length; i += 3) {
      positions[i] = numbers[i] * step - x;
      positions[i + 1] = numbers[i + 1] * step - y;
      positions[i + 2] = numbers[i + 2] * step - z;
    }
    this.local.needsUpdate = true;
  }
}

function position({ numbers, step }: Frame, particle: number): Vector {
  return [numbers[3 * particle] * step, numbers[3 * particle + 1] * step, numbers[3 * particle + 2] * step];
}

/** Centre of a frame's bounds, in whole metres. */
function originOf(frame: Frame): Vector {
  const bounds = new Bounds();
  for (let particle = 0; 3 * particle < frame.numbers.length; particle++) bounds.add(position(frame, particle));
  const [x, y, z] = bounds.center();
  return [Math.round(x), Math.round(y), Math.round(z)];
}
