// Spray as mist: a soft point for each particle, through which what is behind it is seen.

import { type Color, ShaderMaterial } from 'three';
import { SPHERE_SIZE, height, ratio } from './spheres.ts';

/** Of the middle of a point: several behind each other are white. */
const OPACITY = 0.55;
/** Smallest radius of a point (pixels of the page). */
const LEAST_PIXELS = 0.8;

const VERTEX = /* glsl */ `
  ${SPHERE_SIZE}
  uniform float ratio;
  attribute vec3 tint;
  varying vec3 vTint;

  void main() {
    vec4 mvPosition = modelViewMatrix * vec4(position, 1.0);
    gl_Position = projectionMatrix * mvPosition;
    gl_PointSize = 2.0 * max(radius * pixelsPerMetre(-mvPosition.z), pixels * ratio);
    vTint = tint;
  }
`;

const FRAGMENT = /* glsl */ `
  uniform vec3 color;
  varying vec3 vTint;

  void main() {
    vec2 at = 2.0 * gl_PointCoord - 1.0;
    float square = dot(at, at);
    if (square > 1.0) discard;
    gl_FragColor = vec4(color * pow((vTint + 0.055) / 1.055, vec3(2.4)), ${OPACITY.toFixed(2)} * (1.0 - square));
    #include <colorspace_fragment>
  }
`;

/** Points with a radius in metres, of a colour times the attribute `tint`. The colour may change. */
export function mistMaterial(metres: number, color: Color): ShaderMaterial {
  return new ShaderMaterial({
    uniforms: { radius: { value: metres }, pixels: { value: LEAST_PIXELS }, color: { value: color }, height, ratio },
    vertexShader: VERTEX,
    fragmentShader: FRAGMENT,
    transparent: true,
    depthWrite: false,
  });
}
