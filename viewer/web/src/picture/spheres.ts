// Spheres as point sprites: one vertex each, round, lit, in the shadow of others, and of true size and depth.

import { Color, ShaderMaterial, UniformsLib, UniformsUtils, Vector3 } from 'three';

/** Pixels along the height of the picture. */
export const height = { value: 1 };
/** Pixels of the picture over those of the page. */
export const ratio = { value: 1 };
/** Unit vector from the scene to the sun. */
export const sun = { value: new Vector3(0, 1, 0) };

/** A radius in metres, or one in pixels of the page at any distance. */
export type Radius = { metres: number } | { pixels: number };

/** For shaders: the size of a sphere in the picture. */
export const SPHERE_SIZE = /* glsl */ `
  uniform float radius;
  uniform float pixels;
  uniform float height;

  // Pixels of the picture for a metre at this depth. A parallel projection has the same for any.
  float pixelsPerMetre(float depth) {
    float scale = 0.5 * height * projectionMatrix[1][1];
    return projectionMatrix[3][3] == 1.0 ? scale : scale / max(depth, 1e-6);
  }
`;

const VERTEX = /* glsl */ `
  #include <common>
  #include <shadowmap_pars_vertex>
  ${SPHERE_SIZE}
  uniform float ratio;
  uniform vec3 sun;
  varying vec3 vCenter;
  varying float vRadius;
  #ifdef TINTED
    attribute vec3 tint;
    varying vec3 vTint;
  #endif

  void main() {
    vec4 mvPosition = modelViewMatrix * vec4(position, 1.0);
    float scale = pixelsPerMetre(-mvPosition.z);
    vRadius = radius > 0.0 ? radius : pixels * ratio / scale;
    vCenter = mvPosition.xyz;
    gl_Position = projectionMatrix * mvPosition;
    gl_PointSize = max(2.0 * vRadius * scale, 1.5);
    #ifdef TINTED
      vTint = tint;
    #endif

    // The shadow is asked for at the side that the sun sees, so that no sphere lies in its own.
    vec4 worldPosition = modelMatrix * vec4(position, 1.0);
    worldPosition.xyz += 1.2 * vRadius * sun;
    #include <shadowmap_vertex>
  }
`;

const FRAGMENT = /* glsl */ `
  #include <common>
  #include <bsdfs>
  #include <lights_pars_begin>
  #include <shadowmap_pars_fragment>
  #include <shadowmask_pars_fragment>
  uniform mat4 projectionMatrix;
  uniform vec3 color;
  varying vec3 vCenter;
  varying float vRadius;
  #ifdef TINTED
    varying vec3 vTint;
  #endif

  void main() {
    vec2 at = vec2(2.0, -2.0) * gl_PointCoord + vec2(-1.0, 1.0);
    float square = dot(at, at);
    if (square > 1.0) discard;
    vec3 normal = vec3(at, sqrt(1.0 - square));

    #ifdef TINTED
      vec3 albedo = pow((vTint + 0.055) / 1.055, vec3(2.4));
    #else
      vec3 albedo = color;
    #endif
    vec3 irradiance = getHemisphereLightIrradiance(hemisphereLights[0], normal);
    for (int i = 0; i < NUM_DIR_LIGHTS; i++) {
      float facing = max(dot(normal, directionalLights[i].direction), 0.0);
      irradiance += facing * (i == 0 ? getShadowMask() : 1.0) * directionalLights[i].color;
    }
    gl_FragColor = vec4(RECIPROCAL_PI * irradiance * albedo, 1.0);
    #include <colorspace_fragment>

    float z = vCenter.z + vRadius * normal.z;
    gl_FragDepth = 0.5 - 0.5 * (projectionMatrix[2][2] * z + projectionMatrix[3][2]) / z;
  }
`;

const DEPTH_VERTEX = /* glsl */ `
  ${SPHERE_SIZE}
  void main() {
    vec4 mvPosition = modelViewMatrix * vec4(position, 1.0);
    gl_Position = projectionMatrix * mvPosition;
    gl_PointSize = 2.0 * radius * pixelsPerMetre(-mvPosition.z);
  }
`;

const DEPTH_FRAGMENT = /* glsl */ `
  void main() {
    vec2 at = 2.0 * gl_PointCoord - 1.0;
    if (dot(at, at) > 1.0) discard;
    gl_FragColor = vec4(1.0);
  }
`;

/** Spheres of one colour, or of the colours in the attribute `tint`. */
export function sphereMaterial(radius: Radius, color: Color, colored: 'one color' | 'tinted'): ShaderMaterial {
  const material = new ShaderMaterial({
    lights: true,
    defines: colored === 'tinted' ? { TINTED: '' } : {},
    uniforms: { ...UniformsUtils.clone(UniformsLib.lights), color: { value: color }, ...size(radius) },
    vertexShader: VERTEX,
    fragmentShader: FRAGMENT,
  });
  // Shared by all, after the clone.
  material.uniforms['height'] = height;
  material.uniforms['ratio'] = ratio;
  material.uniforms['sun'] = sun;
  return material;
}

/**
 * Materials of spheres with a radius in metres that only cast shadows: unseen in the picture, discs in a shadow map of
 * some pixels along a side.
 */
export function sphereDepthMaterial(radius: { value: number }, mapPixels: number): { seen: ShaderMaterial; cast: ShaderMaterial } {
  const uniforms = { radius, pixels: { value: 0 }, height: { value: mapPixels } };
  const outside = 'void main() { gl_Position = vec4(2.0, 2.0, 2.0, 1.0); gl_PointSize = 1.0; }';
  return {
    seen: new ShaderMaterial({ vertexShader: outside, fragmentShader: 'void main() { gl_FragColor = vec4(0.0); }', depthWrite: false }),
    cast: new ShaderMaterial({ uniforms, vertexShader: DEPTH_VERTEX, fragmentShader: DEPTH_FRAGMENT }),
  };
}

function size(radius: Radius) {
  const [metres, pixels] = 'metres' in radius ? [radius.metres, 0] : [0, radius.pixels];
  return { radius: { value: metres }, pixels: { value: pixels } };
}
