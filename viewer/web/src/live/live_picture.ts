// The picture of a session: the newest frame that has come, drawn as often as the browser can.
//
// Enters: frames of a stream, whose arrays are handed back. Leaves: pictures; which frames were drawn.

import type { LiveFrame } from '../../../../client/typescript/src/index.ts';
import { type Motion, begun, bodyBounds, fallBounds, motionBounds, poseBounds } from '../picture/camera.ts';
import { element } from '../page/dom.ts';
import type { Bounds } from '../picture/geometry.ts';
import { sceneOf } from './live_scene.ts';
import type { Frame, Scene, Vector } from '../scene.ts';
import { Stage } from '../picture/stage.ts';
import { View } from '../picture/view.ts';
import type { Picture } from '../picture/viewing.ts';

/** Between two looks at how far bodies have gone (ms). */
const LOOK_EVERY = 500;
/** Bodies that are so far beyond what the picture holds, over its radius, make it hold more. */
const BEYOND = 0.1;

export interface PictureEvents {
  /** The first frame is drawn; null where nothing can be drawn. */
  began(picture: Picture | null): void;
  /** A frame is drawn, and so many that came before it are not. */
  drawn(frame: LiveFrame, unseen: number): void;
}

export class LivePicture {
  private readonly stage: Stage | null;
  private view: View | null = null;
  private scene: Scene | null = null;
  private waiting: LiveFrame | null = null;
  private shown: LiveFrame | null = null;
  private unseen = 0;
  private requested = false;
  private first: Bounds | null = null;
  private held: Motion | null = null;
  private looked = 0;

  constructor(private readonly title: string, isCalm: boolean, private readonly events: PictureEvents) {
    this.stage = makeStage(isCalm);
  }

  /** Draws a frame with the next picture of the screen, unless a newer one comes before that. */
  take(frame: LiveFrame): void {
    if (this.waiting !== null) {
      this.unseen += 1;
      this.waiting.release();
    }
    this.waiting = frame;
    if (this.requested) return;
    this.requested = true;
    requestAnimationFrame((now) => this.draw(now));
  }

  /** A mark at a particle from now on. */
  mark(particle: number): void {
    if (this.scene !== null && particle < this.scene.particleCount) this.view?.markParticle(particle);
  }

  private draw(now: number): void {
    this.requested = false;
    const frame = this.waiting;
    if (frame === null) return;
    this.waiting = null;
    const begins = this.scene === null;
    if (begins) this.begin(frame);
    else this.view?.show(frameOf(frame));
    // What is shown may be drawn again; what was, is not.
    this.shown?.release();
    this.shown = frame;
    if (begins) this.events.began(this.stage === null ? null : { stage: this.stage, view: this.view! });
    this.events.drawn(frame, this.unseen);
    this.unseen = 0;
    if (now - this.looked < LOOK_EVERY) return;
    this.looked = now;
    this.hold(frame);
  }

  private begin(frame: LiveFrame): void {
    const scene = sceneOf(this.title, frame.topology);
    this.scene = scene;
    this.first = bodyBounds(scene, frameOf(frame));
    const bodies = fallBounds(begun(scene, frame.poses), this.first);
    this.held = { bodies, colliders: poseBounds(scene, bodies, frame.poses) };
    if (this.stage !== null) this.view = new View(this.stage, scene, frameOf(frame), this.held);
  }

  /** Bodies and colliders that leave the picture make it larger, up to a bound. */
  private hold(frame: LiveFrame): void {
    if (this.scene === null || this.first === null || this.held === null || this.view === null) return;
    const { bodies: held, colliders } = this.held;
    const now = motionBounds(this.first, [bodyBounds(this.scene, frameOf(frame))]);
    const moved = poseBounds(this.scene, held, frame.poses);
    const leaves = (corners: readonly Vector[], bounds: Bounds) =>
      corners.some((corner) => corner.every(Number.isFinite) && !bounds.holds(corner, BEYOND * held.radius()));
    if (!leaves(now.corners(), held) && !leaves(moved.corners(), join(held, colliders))) return;
    this.held = { bodies: motionBounds(held, [now]), colliders: join(colliders, moved) };
    this.view.refit(this.held);
  }
}

/** The box around two others. */
function join(one: Bounds, other: Bounds): Bounds {
  const all = one.copy();
  for (const corner of other.corners()) all.add(corner);
  return all;
}

/** As a view draws it. */
function frameOf({ time, positions, fields, poses }: LiveFrame): Frame {
  const scalar = fields.plastic_ratio;
  return { time, numbers: positions as Float32Array, step: 1, scalar: scalar === undefined ? null : scalar as Float32Array<ArrayBuffer>, poses };
}

/** Null, and a message, if this browser draws nothing. */
function makeStage(isCalm: boolean): Stage | null {
  const say = (sentence: string) => {
    element('message').hidden = sentence === '';
    element('message').textContent = sentence;
  };
  try {
    return new Stage(element<HTMLCanvasElement>('canvas'), element('stage'), !isCalm, (lost) =>
      say(lost ? 'The graphics were lost. The picture comes back when the browser has them again; if it does not, reload the page.' : ''));
  } catch {
    element('canvas').hidden = true;
    say('This browser cannot draw the session, since WebGL 2 is missing or switched off. Numbers and plots are shown; the session can be steered.');
    return null;
  }
}
