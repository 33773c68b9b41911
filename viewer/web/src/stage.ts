// The picture: renderer, camera, light. It is drawn only when something changed.
//
// Enters: a canvas, objects in metres around the scene's own origin. Leaves: pixels.

import {
  Color, DirectionalLight, HemisphereLight, MOUSE, type Object3D, PCFShadowMap, PerspectiveCamera, SRGBColorSpace,
  Scene, TOUCH, Vector3, WebGLRenderer,
} from 'three';
import { OrbitControls } from 'three/examples/jsm/controls/OrbitControls.js';
import type { Camera } from './camera.ts';
import { BACKGROUND } from './coloring.ts';
import type { Vector } from './scene.ts';
import { height, sun } from './spheres.ts';

const FIELD_OF_VIEW = 50;
/** The camera stands so much farther than where the picture just holds the scene. */
const MARGIN = 1.03;
const MOST_PIXEL_RATIO = 2;
const SHADOW_PIXELS = 2048;
/** From the scene to the sun, as the camera sees it: right, up, towards the camera. */
const SUN = new Vector3(-0.45, 1.3, 0.55).normalize();
/** A pixel differs from the background if a channel does by more than this. */
const LIT_THRESHOLD = 3;
/** Radians, pixels and share of the distance that one key press moves. */
const KEY_ANGLE = Math.PI / 24;
const KEY_PIXELS = 40;
const KEY_ZOOM = 0.85;

export const rgb = ([red, green, blue]: readonly [number, number, number]): Color =>
  new Color().setRGB(red / 255, green / 255, blue / 255, SRGBColorSpace);

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
  private readonly light = new DirectionalLight(0xfffaf2, 2.6);
  private home: Home | null = null;
  private requested = false;
  /** The view is that from the start, which is fitted to the picture. */
  private atHome = true;

  /** Throws if there is no WebGL 2. `lost` hears that the graphics are gone, or back. */
  constructor(canvas: HTMLCanvasElement, private readonly host: HTMLElement, damped: boolean, lost: (lost: boolean) => void) {
    this.renderer = new WebGLRenderer({ canvas, antialias: true, powerPreference: 'high-performance' });
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = PCFShadowMap;
    this.scene.background = rgb(BACKGROUND);
    this.light.castShadow = true;
    this.light.shadow.mapSize.set(SHADOW_PIXELS, SHADOW_PIXELS);
    this.light.shadow.autoUpdate = false;
    this.scene.add(this.light, this.light.target, new HemisphereLight(0xdfe8f5, 0x4a4640, 1.5));

    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enableDamping = damped;
    this.controls.dampingFactor = 0.15;
    this.controls.mouseButtons = { LEFT: MOUSE.ROTATE, MIDDLE: MOUSE.DOLLY, RIGHT: MOUSE.PAN };
    this.controls.touches = { ONE: TOUCH.ROTATE, TWO: TOUCH.DOLLY_PAN };
    this.controls.addEventListener('change', () => this.request());
    this.controls.addEventListener('start', () => (this.atHome = false));

    canvas.addEventListener('webglcontextlost', () => lost(true));
    canvas.addEventListener('webglcontextrestored', () => {
      lost(false);
      this.changed();
    });
    new ResizeObserver(() => this.resize()).observe(host);
    this.resize();
  }

  add(...objects: Object3D[]): void {
    this.scene.add(...objects);
  }

  /** Looks at a scene, and lights it. */
  look(home: Home): void {
    const { radius } = home;
    this.home = home;
    this.camera.near = 0.01 * radius;
    this.camera.far = 100 * radius;
    this.controls.minDistance = 0.03 * radius;
    this.controls.maxDistance = 30 * radius;
    this.lightUp(radius);
    this.goHome();
  }

  /** The view from the start. */
  goHome(): void {
    if (this.home === null) return;
    this.atHome = true;
    this.stop();
    const { camera, corners } = this.home;
    const target = new Vector3(...camera.target);
    const toEye = new Vector3(...camera.eye).sub(target).normalize();
    this.controls.target.copy(target);
    this.camera.position.copy(target).addScaledVector(toEye, MARGIN * this.distance(target, toEye, corners));
    this.camera.updateProjectionMatrix();
    this.controls.update();
    this.request();
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
    this.light.shadow.needsUpdate = true;
    this.request();
  }

  /** As `changed`, and at once. */
  drawChanged(): void {
    this.light.shadow.needsUpdate = true;
    this.draw();
  }

  /** Draws before the next picture of the screen. */
  request(): void {
    if (this.requested) return;
    this.requested = true;
    requestAnimationFrame(() => {
      this.requested = false;
      this.controls.update();
      this.draw();
    });
  }

  draw(): void {
    this.renderer.render(this.scene, this.camera);
  }

  /** Share of the pixels that differ from the background. */
  litShare(): number {
    this.draw();
    const gl = this.renderer.getContext();
    const { drawingBufferWidth: width, drawingBufferHeight: height } = gl;
    const pixels = new Uint8Array(4 * width * height);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);

    let lit = 0;
    for (let at = 0; at < pixels.length; at += 4) {
      if (BACKGROUND.some((channel, index) => Math.abs(pixels[at + index] - channel) > LIT_THRESHOLD)) lit++;
    }
    return lit / Math.max(1, width * height);
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

  /** From where the picture just holds all corners, in the direction `toEye` of the target. */
  private distance(target: Vector3, toEye: Vector3, corners: readonly Vector[]): number {
    const tangent = Math.tan((0.5 * FIELD_OF_VIEW * Math.PI) / 180);
    const right = new Vector3(0, 1, 0).cross(toEye).normalize();
    const up = toEye.clone().cross(right);
    const distances = corners.map((corner) => {
      const from = new Vector3(...corner).sub(target);
      const across = Math.abs(from.dot(right)) / this.camera.aspect;
      return from.dot(toEye) + Math.max(across, Math.abs(from.dot(up))) / tangent;
    });
    return Math.max(...distances, this.controls.minDistance);
  }

  private lightUp(radius: number): void {
    if (this.home === null) return;
    const { eye, target } = this.home.camera;
    const toCamera = new Vector3(eye[0] - target[0], 0, eye[2] - target[2]).normalize();
    const right = new Vector3(0, 1, 0).cross(toCamera);
    sun.value.set(0, SUN.y, 0).addScaledVector(right, SUN.x).addScaledVector(toCamera, SUN.z);
    this.light.target.position.set(...target);
    this.light.position.copy(sun.value).multiplyScalar(4 * radius).add(this.light.target.position);

    const { camera } = this.light.shadow;
    const reach = 1.7 * radius;
    Object.assign(camera, { left: -reach, right: reach, top: reach, bottom: -reach, near: 0.5 * radius, far: 8 * radius });
    camera.updateProjectionMatrix();
    this.light.shadow.normalBias = (3 * reach) / SHADOW_PIXELS;
    this.light.shadow.bias = -0.004;
    this.changed();
  }

  private resize(): void {
    const width = Math.max(1, this.host.clientWidth);
    const tall = Math.max(1, this.host.clientHeight);
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, MOST_PIXEL_RATIO));
    this.renderer.setSize(width, tall, false);
    this.camera.aspect = width / tall;
    // It is that of the shorter side, or nearly so: a narrow screen shows the middle of the scene.
    const half = Math.tan((FIELD_OF_VIEW * Math.PI) / 360) / Math.min(1, 1.25 * this.camera.aspect);
    this.camera.fov = (360 / Math.PI) * Math.atan(half);
    this.camera.updateProjectionMatrix();
    height.value = this.renderer.domElement.height;
    if (this.atHome) this.goHome();
    // At once, since the canvas is empty now.
    this.draw();
  }
}
