// Lights: a warm sun that casts shadows, a cool fill from the other side, and the sky above the ground.
//
// Enters: where the camera stands at the start, and the radius of the scene (m). Leaves: lights, and where the sun is.

import { DirectionalLight, HemisphereLight, type Object3D, Vector3 } from 'three';
import type { Camera } from './camera.ts';
import { sun } from './spheres.ts';

export const SHADOW_PIXELS = 2048;
/** From the scene to the sun, and to the fill, as the camera sees it: right, up, towards the camera. */
const SUN = new Vector3(-0.55, 1.2, 0.6).normalize();
const FILL = new Vector3(0.9, 0.35, 0.3).normalize();
/** The shadow map covers so many radii of the scene on either side. */
const REACH = 1.7;
/** Softness of a shadow's edge, in texels. */
const SOFT = 2.5;

export class Lights {
  private readonly sun = new DirectionalLight(0xfff0da, 2.45);
  private readonly fill = new DirectionalLight(0xa9c6f7, 0.55);
  readonly objects: Object3D[] = [
    this.sun, this.sun.target, this.fill, this.fill.target, new HemisphereLight(0xc9daf6, 0x54504c, 1.25),
  ];

  constructor() {
    this.sun.castShadow = true;
    const { shadow } = this.sun;
    shadow.mapSize.set(SHADOW_PIXELS, SHADOW_PIXELS);
    shadow.autoUpdate = false;
    shadow.radius = SOFT;
  }

  /** Lights a scene as it looks best from the start. */
  aim({ eye, target }: Camera, radius: number): void {
    const toCamera = new Vector3(eye[0] - target[0], 0, eye[2] - target[2]).normalize();
    const right = new Vector3(0, 1, 0).cross(toCamera);
    const toWorld = (seen: Vector3) =>
      new Vector3(0, seen.y, 0).addScaledVector(right, seen.x).addScaledVector(toCamera, seen.z);
    sun.value.copy(toWorld(SUN));
    for (const [light, direction] of [[this.sun, sun.value], [this.fill, toWorld(FILL)]] as const) {
      light.target.position.set(...target);
      light.position.copy(direction).multiplyScalar(4 * radius).add(light.target.position);
    }
    const { shadow } = this.sun;
    const reach = REACH * radius;
    Object.assign(shadow.camera, { left: -reach, right: reach, top: reach, bottom: -reach, near: 0.5 * radius, far: 8 * radius });
    shadow.camera.updateProjectionMatrix();
    shadow.normalBias = (5 * reach) / SHADOW_PIXELS;
    shadow.bias = -0.005;
    this.changed();
  }

  /** Shadows are drawn anew with the next picture. */
  changed(): void {
    this.sun.shadow.needsUpdate = true;
  }
}
