// The picture: renderer, camera, light. It is drawn only when something changed.
//
// Enters: a canvas, objects in metres around the scene's own origin. Leaves: pixels.

import {
  Color, MOUSE, Mesh, type Object3D, PCFShadowMap, PerspectiveCamera, SRGBColorSpace, Scene, TOUCH, Vector3, WebGLRenderer,
} from 'three';
import { OrbitControls } from 'three/examples/jsm/controls/OrbitControls.js';
import { followBoxes, insetsOf } from './boxes.ts';
import type { Camera } from './camera.ts';
import { Lights } from './lights.ts';
import { Occlusion } from './occlusion.ts';
import { Pace, type Quality } from './pace.ts';
import { type Place, type Ray, placeOf, rayThrough } from './ray.ts';
import type { Vector } from '../scene.ts';
import { height, ratio } from './spheres.ts';

const FIELD_OF_VIEW = 50;
/** The camera stands so much farther than where the picture just holds the scene. */
const MARGIN = 1.03;
/** Boxes before the picture take no more of its height than this share, in a window that is very low. */
const MOST_TAKEN = 0.6;
const MOST_PIXEL_RATIO = 2;
/** Surroundings within so many radii of the scene take light from a crease. */
const OCCLUSION_REACH = 0.07;
/** A pixel is lit if it covers more of the background than this, of 255. */
const LIT_THRESHOLD = 3;
/** A change of view from the keyboard takes so long (ms). */
const EASE = 280;
/** Radians, pixels and share of the distance that one key press moves. */
const KEY_ANGLE = Math.PI / 24;
const KEY_PIXELS = 40;
const KEY_ZOOM = 0.85;

export const rgb = ([red, green, blue]: readonly [number, number, number]): Color =>
  new Color().setRGB(red / 255, green / 255, blue / 255, SRGBColorSpace);

type Prepare = (renderer: WebGLRenderer, camera: PerspectiveCamera, quality: Quality) => void;

/** The view from the start. */
export interface Home {
  /** From where; how far away is left to the stage, which knows how wide the picture is. */
  camera: Camera;
  /** What the picture holds (m). */
  corners: readonly Vector[];
  /** Radius of the scene (m). */
  radius: number;
}

export type Move = 'left' | 'right' | 'up' | 'down' | 'pan left' | 'pan right' | 'pan up' | 'pan down' | 'in' | 'out';

export class Stage {
  private readonly renderer: WebGLRenderer;
  private readonly scene = new Scene();
  private readonly camera = new PerspectiveCamera(FIELD_OF_VIEW);
  private readonly controls: OrbitControls;
  private readonly lights = new Lights();
  private readonly occlusion: Occlusion;
  private readonly pace = new Pace(() => this.draw('fine'));
  private home: Home | null = null;
  private requested = false;
  /** The view is that from the start, which is fitted to the picture. */
  private atHome = true;
  /** Heights that boxes take (CSS pixels), and the share of the height that they leave free. */
  private insets = { top: 0, bottom: 0 };
  private free = 1;

  /** What has to be drawn aside before the scene is. */
  private prepare: Prepare | null = null;
  private easing: { since: number; eye: Vector3; target: Vector3; toEye: Vector3; toTarget: Vector3 } | null = null;

  /** Throws if there is no WebGL 2. `lost` hears that the graphics are gone, or back. */
  constructor(canvas: HTMLCanvasElement, private readonly host: HTMLElement, private readonly damped: boolean, lost: (lost: boolean) => void) {
    // The page's background shows where nothing is drawn.
    this.renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true, powerPreference: 'high-performance' });
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = PCFShadowMap;
    this.occlusion = new Occlusion(this.renderer);
    this.scene.add(...this.lights.objects);

    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enableDamping = damped;
    this.controls.dampingFactor = 0.15;
    this.controls.mouseButtons = { LEFT: MOUSE.ROTATE, MIDDLE: MOUSE.DOLLY, RIGHT: MOUSE.PAN };
    this.controls.touches = { ONE: TOUCH.ROTATE, TWO: TOUCH.DOLLY_PAN };
    this.controls.addEventListener('change', () => this.request());
    this.controls.addEventListener('start', () => {
      this.atHome = false;
      this.easing = null;
    });

    canvas.addEventListener('webglcontextlost', () => lost(true));
    canvas.addEventListener('webglcontextrestored', () => {
      lost(false);
      this.changed();
    });
    new ResizeObserver(() => this.resize()).observe(host);
    followBoxes(host, () => this.reframe());
    this.resize();
  }

  add(objects: readonly Object3D[]): void {
    for (const object of objects) this.scene.add(object);
  }

  /** Takes objects away, with what the graphics hold of them. */
  remove(objects: readonly Object3D[]): void {
    for (const object of objects) {
      this.scene.remove(object);
      object.traverse((part) => {
        if (!(part instanceof Mesh)) return;
        part.geometry.dispose();
        part.material.dispose();
      });
    }
  }

  /** Draws what the scene needs aside, before each picture. */
  before(prepare: Prepare): void {
    this.prepare = prepare;
  }

  /** Looks at a scene, and lights it. A reader who moved the view keeps it. */
  look(home: Home, how: 'at once' | 'eased' = 'at once'): void {
    const { radius } = home;
    this.home = home;
    this.lights.aim(home.camera, radius);
    this.camera.near = 0.01 * radius;
    this.camera.far = 100 * radius;
    this.controls.minDistance = 0.03 * radius;
    this.controls.maxDistance = 30 * radius;
    this.camera.updateProjectionMatrix();
    if (this.atHome) this.goHome(how);
  }

  /** The view from the start. */
  goHome(how: 'at once' | 'eased'): void {
    if (this.home === null) return;
    this.atHome = true;
    this.stop();
    this.aim();
    const { camera, corners } = this.home;
    const target = new Vector3(...camera.target);
    const toEye = new Vector3(...camera.eye).sub(target).normalize();
    const eye = target.clone().addScaledVector(toEye, MARGIN * this.distance(target, toEye, corners));
    if (how === 'eased' && this.damped) {
      this.easing = { since: performance.now(), eye: this.camera.position.clone(), target: this.controls.target.clone(), toEye: eye, toTarget: target };
    } else {
      this.easing = null;
      this.controls.target.copy(target);
      this.camera.position.copy(eye);
    }
    this.controls.update();
    this.request();
  }

  /** Where the camera stands, around the scene's origin (m); null for the view from the start. */
  viewpoint(): Camera | null {
    return this.atHome ? null : { eye: this.camera.position.toArray(), target: this.controls.target.toArray() };
  }

  /** Looks from a place around the scene's origin (m). */
  lookFrom({ eye, target }: Camera): void {
    this.atHome = false;
    this.stop();
    this.camera.position.set(...eye);
    this.controls.target.set(...target);
    this.controls.update();
    this.request();
  }

  /** Moves the view along with what it follows, by so much (m). */
  shift(by: Vector): void {
    const step = new Vector3(...by);
    this.controls.target.add(step);
    this.camera.position.add(step);
    this.atHome = false;
  }

  /** The point in the middle of the view. */
  target(): Vector {
    return this.controls.target.toArray();
  }

  move(move: Move): void {
    const controls = this.controls;
    this.atHome = false;
    switch (move) {
      case 'left': controls.rotateLeft(-KEY_ANGLE); break;
      case 'right': controls.rotateLeft(KEY_ANGLE); break;
      case 'up': controls.rotateUp(KEY_ANGLE); break;
      case 'down': controls.rotateUp(-KEY_ANGLE); break;
      case 'pan left': controls.pan(KEY_PIXELS, 0); break;
      case 'pan right': controls.pan(-KEY_PIXELS, 0); break;
      case 'pan up': controls.pan(0, KEY_PIXELS); break;
      case 'pan down': controls.pan(0, -KEY_PIXELS); break;
      case 'in': controls.dollyIn(KEY_ZOOM); break;
      case 'out': controls.dollyOut(KEY_ZOOM); break;
    }
    controls.update();
    this.request();
  }

  /** Objects moved or look different: their shadows are drawn anew, too. */
  changed(): void {
    this.lights.changed();
    this.request();
  }

  /** As `changed`, and at once. */
  drawChanged(): void {
    this.lights.changed();
    this.draw(this.pace.quality('scene'));
  }

  /** Draws before the next picture of the screen. */
  request(): void {
    if (this.requested) return;
    this.requested = true;
    requestAnimationFrame((now) => {
      this.requested = false;
      this.ease(now);
      this.controls.update();
      this.draw(this.pace.quality('view'));
    });
  }

  draw(quality: Quality): void {
    this.sharpen(quality === 'coarse' ? 0.5 : 1);
    this.prepare?.(this.renderer, this.camera, quality);
    if (quality === 'fine' && this.home !== null) this.occlusion.render(this.scene, this.camera, OCCLUSION_REACH * this.home.radius);
    else this.renderer.render(this.scene, this.camera);
    this.pace.drawn(quality);
  }

  /** The half-line that is seen at a place of the window (CSS pixels), around the scene's own origin (m). */
  ray(x: number, y: number): Ray {
    this.camera.updateMatrixWorld();
    return rayThrough(this.camera, this.renderer.domElement.getBoundingClientRect(), x, y);
  }

  /** Where a point around the scene's own origin (m) is seen; null if it is not before the camera. */
  seen(point: Vector): Place | null {
    this.camera.updateMatrixWorld();
    return placeOf(this.camera, this.renderer.domElement.getBoundingClientRect(), point);
  }

  /** The direction into the picture, of length 1. */
  facing(): Vector {
    return this.camera.getWorldDirection(new Vector3()).toArray();
  }

  /** Whether pointers and the wheel turn and move the view. */
  listen(on: boolean): void {
    this.controls.enabled = on;
  }

  /** Radius of the scene (m). */
  get radius(): number {
    return this.home?.radius ?? 1;
  }

  /** Share of the pixels that differ from the background. */
  litShare(): number {
    const pixels = this.pixels();
    let lit = 0;
    for (let at = 3; at < pixels.length; at += 4) if (pixels[at] > LIT_THRESHOLD) lit++;
    return lit / Math.max(1, pixels.length / 4);
  }

  /** What is on the canvas, before a colour, as PNG; null if the browser cannot make it. */
  png(background: string): Promise<Blob | null> {
    this.draw('fine');
    const { domElement } = this.renderer;
    const copy = Object.assign(document.createElement('canvas'), { width: domElement.width, height: domElement.height });
    const paper = copy.getContext('2d')!;
    paper.fillStyle = background;
    paper.fillRect(0, 0, copy.width, copy.height);
    paper.drawImage(domElement, 0, 0);
    return new Promise((resolve) => copy.toBlob(resolve));
  }

  /** Red, green, blue and coverage of each pixel, from rows at the bottom to those at the top. */
  pixels(quality: Quality = 'plain'): Uint8Array {
    this.draw(quality);
    const gl = this.renderer.getContext();
    const { drawingBufferWidth: width, drawingBufferHeight: height } = gl;
    const pixels = new Uint8Array(4 * width * height);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    return pixels;
  }

  /** Turns the view to the left (radians), at once. */
  turn(angle: number): void {
    this.stop();
    this.controls.rotateLeft(angle);
    this.controls.update();
    this.atHome = false;
  }

  /** What draws, in the words of the browser. */
  rendererName(): string {
    const gl = this.renderer.getContext();
    const unmasked = gl.getExtension('WEBGL_debug_renderer_info');
    return String(gl.getParameter(unmasked === null ? gl.RENDERER : unmasked.UNMASKED_RENDERER_WEBGL));
  }

  /** Ends what is left of a turn, which goes on for a while after the hand has let go. */
  private stop(): void {
    const damped = this.controls.enableDamping;
    this.controls.enableDamping = false;
    this.controls.update();
    this.controls.enableDamping = damped;
  }

  /** The middle of the view becomes that of what boxes leave free. */
  private aim(): void {
    const [width, tall] = [Math.max(1, this.host.clientWidth), Math.max(1, this.host.clientHeight)];
    this.insets = insetsOf(this.host);
    const { top, bottom } = this.insets;
    const share = Math.min(1, (MOST_TAKEN * tall) / Math.max(1, top + bottom));
    this.free = 1 - (share * (top + bottom)) / tall;
    this.camera.setViewOffset(width, tall, 0, 0.5 * share * (bottom - top), width, tall);
  }

  /** Boxes became larger or smaller: the view from the start is fitted anew, and one that a reader moved stays. */
  private reframe(): void {
    if (!this.atHome || this.home === null) return;
    const { top, bottom } = insetsOf(this.host);
    if (top !== this.insets.top || bottom !== this.insets.bottom) this.goHome('at once');
  }

  /** From where the part that boxes leave free just holds all corners, in the direction `toEye` of the target. */
  private distance(target: Vector3, toEye: Vector3, corners: readonly Vector[]): number {
    const tangent = Math.tan((this.camera.fov * Math.PI) / 360);
    const right = new Vector3(0, 1, 0).cross(toEye).normalize();
    const up = toEye.clone().cross(right);
    const distances = corners.map((corner) => {
      const from = new Vector3(...corner).sub(target);
      const across = Math.abs(from.dot(right)) / this.camera.aspect;
      return from.dot(toEye) + Math.max(across, Math.abs(from.dot(up)) / this.free) / tangent;
    });
    return Math.max(...distances, this.controls.minDistance);
  }

  /** Goes on with a change of view: fast at first, then slower. */
  private ease(now: number): void {
    if (this.easing === null) return;
    const { since, eye, target, toEye, toTarget } = this.easing;
    const left = 1 - Math.min(Math.max(now - since, 0) / EASE, 1);
    const share = 1 - left ** 3;
    this.camera.position.lerpVectors(eye, toEye, share);
    this.controls.target.lerpVectors(target, toTarget, share);
    if (left === 0) this.easing = null;
    else this.request();
  }

  /** Pixels of the picture over those of the page. */
  private sharpen(share: number): void {
    ratio.value = share * Math.min(window.devicePixelRatio, MOST_PIXEL_RATIO);
    if (this.renderer.getPixelRatio() === ratio.value) return;
    this.renderer.setPixelRatio(ratio.value);
    height.value = this.renderer.domElement.height;
  }

  private resize(): void {
    const width = Math.max(1, this.host.clientWidth);
    const tall = Math.max(1, this.host.clientHeight);
    this.sharpen(1);
    this.renderer.setSize(width, tall, false);
    this.pace.reset();
    this.camera.aspect = width / tall;
    // It is that of the shorter side, or nearly so: a narrow screen shows the middle of the scene.
    const half = Math.tan((FIELD_OF_VIEW * Math.PI) / 360) / Math.min(1, 1.25 * this.camera.aspect);
    this.camera.fov = (360 / Math.PI) * Math.atan(half);
    this.aim();
    height.value = this.renderer.domElement.height;
    if (this.atHome) this.goHome('at once');
    // At once, since the canvas is empty now.
    this.draw('plain');
  }
}
