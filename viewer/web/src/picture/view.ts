// A scene on a stage: what is drawn of each frame.
//
// Enters: a scene, its first frame, the bounds of its motion, then frames. Leaves: a picture. Particles may be far from
// the world's origin, so everything is drawn relative to an origin of the scene's own, from which positions are exact to
// the step.

import { BufferAttribute, DynamicDrawUsage } from 'three';
import { type Camera, type Motion, begun, cameraOf, sceneBounds } from './camera.ts';
import { Cloth } from './cloth.ts';
import { Colliders } from './colliders.ts';
import type { Legend } from './coloring.ts';
import { type Bounds, along, minus, unit } from './geometry.ts';
import { colorGround, showGrid } from './ground.ts';
import { mark } from './mark.ts';
import type { Place, Ray } from './ray.ts';
import type { Body, Frame, Scene, Vector } from '../scene.ts';
import { Snow } from './snow.ts';
import type { Home, Stage } from './stage.ts';
import type { Theme } from '../page/theme.ts';

export class View {
  private readonly origin: Vector;
  private readonly local: BufferAttribute;
  private readonly cloth: Cloth;
  private readonly snow: Snow;
  private colliders: Colliders;
  /** The scene with its colliders as they are in the first frame. */
  private readonly begun: Scene;
  /** Towards the camera, from the start. */
  private readonly toEye: Vector;
  private wireframe = false;
  private pinned = true;
  /** Index of the body that the view follows, and where its middle was; null for none. */
  private followed: { body: number; middle: Vector } | null = null;

  /** `motion` says where everything is in the whole recording. */
  constructor(private readonly stage: Stage, private readonly scene: Scene, private shown: Frame, motion: Motion) {
    const [x, y, z] = motion.bodies.center();
    this.origin = [Math.round(x), Math.round(y), Math.round(z)];
    this.local = new BufferAttribute(new Float32Array(3 * scene.particleCount), 3).setUsage(DynamicDrawUsage);
    this.writePositions(shown);

    this.begun = begun(scene, shown.poses);
    const all = sceneBounds(this.begun, motion);
    const { eye, target } = cameraOf(this.begun, all, motion.bodies);
    this.toEye = unit(minus(eye, target)) ?? [0, 1, 0];
    this.cloth = new Cloth(scene.bodies, this.local, this.toEye);
    this.snow = new Snow(scene, this.local);
    this.colliders = new Colliders(scene.colliders, all, this.origin);
    const { surface } = this.snow;
    stage.add([...this.colliders.objects, ...this.cloth.objects, ...this.snow.objects]);
    stage.before((renderer, camera, quality) => {
      if (this.snow.isSurface) surface!.prepare(renderer, camera, quality);
    });

    stage.look(this.home(all));
    this.show(shown);
  }

  /** The picture holds more: something went beyond the bounds that were known. */
  refit(motion: Motion): void {
    const all = sceneBounds(this.begun, motion);
    this.stage.remove(this.colliders.objects);
    this.colliders = new Colliders(this.scene.colliders, all, this.origin);
    this.colliders.update(this.shown);
    this.stage.add(this.colliders.objects);
    this.stage.look(this.home(all), 'eased');
  }

  /** Draws a frame at once. */
  show(frame: Frame): void {
    this.shown = frame;
    this.writePositions(frame);
    this.cloth.update();
    this.snow.update(frame.scalar);
    this.colliders.update(frame);
    if (this.followed !== null) {
      const middle = this.middle(this.followed.body);
      this.stage.shift(minus(middle, this.followed.middle));
      this.followed.middle = middle;
    }
    this.stage.drawChanged();
  }

  /** Colours are those of this scale, which is that of the whole recording. */
  setScale(least: number, largest: number): void {
    this.snow.setScale([least, largest]);
    this.show(this.shown);
  }

  /** Draws a red point at a particle from now on. */
  markParticle(particle: number): void {
    this.stage.add(mark(particle, this.local));
    this.stage.changed();
  }

  /** The half-line that is seen at a place of the window (CSS pixels), in the world (m). */
  ray(x: number, y: number): Ray {
    const { origin, direction } = this.stage.ray(x, y);
    return { origin: along(this.origin, 1, origin), direction };
  }

  /** Where a point of the world (m) is seen in the window; null if it is not before the camera. */
  seen(point: Vector): Place | null {
    return this.stage.seen(minus(point, this.origin));
  }

  get bodies(): readonly Body[] {
    return this.scene.bodies;
  }

  /** Where the camera stands, in the world (m); null for the view from the start. */
  camera(): Camera | null {
    const camera = this.stage.viewpoint();
    return camera && { eye: along(this.origin, 1, camera.eye), target: along(this.origin, 1, camera.target) };
  }

  /** Looks from a place in the world (m), or from that of the start. */
  lookFrom(camera: Camera | null): void {
    if (camera === null) return this.stage.goHome('at once');
    this.stage.lookFrom({ eye: minus(camera.eye, this.origin), target: minus(camera.target, this.origin) });
  }

  toggleWireframe(): boolean {
    this.wireframe = !this.wireframe;
    this.cloth.showEdges(this.wireframe);
    this.snow.showPoints(this.wireframe);
    this.stage.changed();
    return this.wireframe;
  }

  /** Shows the pins, or hides them: whether they are shown now. */
  togglePins(): boolean {
    this.pinned = !this.pinned;
    this.cloth.showPins(this.pinned);
    this.stage.changed();
    return this.pinned;
  }

  get hasPins(): boolean {
    return this.cloth.hasPins;
  }

  /** Switches between white snow and the colours of what the recording says of each particle. */
  toggleColors(): boolean {
    const shows = this.snow.showFalseColors(!this.snow.showsColors);
    this.stage.changed();
    return shows;
  }

  get showsColors(): boolean {
    return this.snow.showsColors;
  }

  get hasColors(): boolean {
    return this.snow.hasColors;
  }

  /** Follows the middle of the next body, or of none after the last: its name, or null. */
  followNext(): string | null {
    const body = this.followed === null ? 0 : this.followed.body + 1;
    if (body >= this.scene.bodies.length) {
      this.followed = null;
      return null;
    }
    const middle = this.middle(body);
    this.stage.shift(minus(middle, this.stage.target()));
    this.followed = { body, middle };
    this.stage.request();
    return this.scene.bodies[body].name;
  }

  setTheme(theme: Theme): void {
    colorGround(theme);
    this.cloth.colorEdges(theme);
    this.snow.setTheme(theme);
    this.stage.changed();
  }

  /** The picture without colliders, as `Stage.pixels` gives it: what covers something belongs to a body. */
  bodyPixels(): Uint8Array {
    const { objects } = this.colliders;
    for (const object of objects) object.visible = false;
    const pixels = this.stage.pixels();
    for (const object of objects) object.visible = true;
    this.stage.changed();
    return pixels;
  }

  /** Share of the pixels that lines of the grid change, from so many directions around the scene. */
  gridShares(directions: number): number[] {
    return Array.from({ length: directions }, () => {
      this.stage.turn((2 * Math.PI) / directions);
      const pixels = this.stage.pixels('coarse');
      showGrid(false);
      const bare = this.stage.pixels('coarse');
      showGrid(true);
      return pixels.filter((value, at) => at % 4 === 0 && value !== bare[at]).length / (pixels.length / 4);
    });
  }

  legend(): Legend | null {
    return this.snow.legend();
  }

  /** Positions of the shown frame (m), in the world. */
  positions(): Float32Array {
    const { numbers, step } = this.shown;
    return Float32Array.from(numbers, (number) => number * step);
  }

  /** Where a particle of the shown frame is (m), in the world. */
  particle(index: number): Vector {
    const { numbers, step } = this.shown;
    return [numbers[3 * index] * step, numbers[3 * index + 1] * step, numbers[3 * index + 2] * step];
  }

  /** The view that holds all of some bounds, from the side that was chosen at the start. */
  private home(all: Bounds): Home {
    const local = (point: Vector) => minus(point, this.origin);
    const target = local(all.center());
    const eye = along(target, all.radius(), this.toEye);
    return { camera: { eye, target }, corners: all.corners().map(local), radius: all.radius() };
  }

  /** Mean position of a body's particles, as it is drawn (m). */
  private middle(body: number): Vector {
    const { firstParticle, particleCount } = this.scene.bodies[body];
    const sum = [0, 0, 0];
    for (let i = 3 * firstParticle; i < 3 * (firstParticle + particleCount); i++) sum[i % 3] += this.local.array[i];
    return sum.map((axis) => axis / Math.max(particleCount, 1)) as unknown as Vector;
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
