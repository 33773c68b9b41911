// Snow as a surface: a sphere around each particle, of which only the nearest are seen, and whose normals are mixed
// where they overlap (surface splatting, Zwicker et al. 2001, Botsch et al. 2005).
//
// Enters: points of a scene with positions (m), perhaps colours. Leaves: a triangle over the picture that shades them.

import {
  type BufferGeometry, type Color, CustomBlending, DepthTexture, GLSL3, HalfFloatType,
  Matrix4, type Mesh, OneFactor, type PerspectiveCamera, Points, Scene, ShaderMaterial, UniformsLib, UniformsUtils,
  type WebGLRenderer, WebGLRenderTarget,
} from 'three';
import type { Quality } from './pace.ts';
import { SCREEN_VERTEX, VIEW_POSITION, screenMesh } from './screen.ts';
import { SPHERE_SIZE, height, sun } from './spheres.ts';

/** Radius of a drawn sphere over the side of the cube that a particle has to itself. */
const OVERLAP = 0.9;
/** Normals and depths are smoothed over a disc with this radius over that of a sphere. */
const SMOOTHING = 1.7;
/** Places of that disc that are looked at. */
const TAPS: Record<Quality, number> = { fine: 24, plain: 9, coarse: 9 };

const SPLAT_VERTEX = /* glsl */ `
  ${SPHERE_SIZE}
  #ifdef BLENDED
    in vec3 tint;
    out vec3 vTint;
  #endif
  out vec3 vCenter;

  void main() {
    vec4 mvPosition = modelViewMatrix * vec4(position, 1.0);
    vCenter = mvPosition.xyz;
    gl_Position = projectionMatrix * mvPosition;
    gl_PointSize = max(2.0 * radius * pixelsPerMetre(-mvPosition.z), 2.0);
    #ifdef BLENDED
      vTint = tint;
    #endif
  }
`;

const SPLAT_FRAGMENT = /* glsl */ `
  uniform mat4 projectionMatrix;
  uniform float radius;
  in vec3 vCenter;
  #ifdef BLENDED
    in vec3 vTint;
  #endif
  layout(location = 0) out vec4 normals;
  layout(location = 1) out vec4 colors;

  void main() {
    vec2 at = vec2(2.0, -2.0) * gl_PointCoord + vec2(-1.0, 1.0);
    float square = dot(at, at);
    if (square > 1.0) discard;
    vec3 normal = vec3(at, sqrt(1.0 - square));
    float z = vCenter.z + radius * normal.z;
    #ifdef BLENDED
      float weight = (1.0 - square) * (1.0 - square) + 0.01;
      normals = weight * vec4(normal, 1.0);
      colors = weight * vec4(vTint, 1.0);
      // What lies a radius deeper than the nearest is mixed in, too.
      z += radius;
    #else
      normals = colors = vec4(0.0);
    #endif
    gl_FragDepth = 0.5 - 0.5 * (projectionMatrix[2][2] * z + projectionMatrix[3][2]) / z;
  }
`;

const SHADE = /* glsl */ `
  #include <common>
  #include <bsdfs>
  #include <lights_pars_begin>
  #include <shadowmap_pars_fragment>
  ${VIEW_POSITION}
  uniform sampler2D normals;
  uniform sampler2D colors;
  uniform sampler2D depths;
  uniform mat4 toWorld;
  uniform vec3 sun;
  uniform float lift;
  uniform float smoothing;
  uniform int taps;
  uniform vec3 white;
  uniform float rim;
  #if NUM_DIR_LIGHT_SHADOWS > 0
    uniform mat4 directionalShadowMatrix[NUM_DIR_LIGHT_SHADOWS];
  #endif
  varying vec2 vAt;

  void main() {
    float depth = texture2D(depths, vAt).x;
    if (depth >= 1.0) discard;
    float front = viewPosition(vAt, depth).z;
    // Spheres are smoothed over their neighbours: a mean over a disc in the picture, of what is about as deep.
    vec2 disc = smoothing * vec2(projection[0][0], projection[1][1]) / (-2.0 * front);
    vec4 sum = vec4(0.0);
    vec4 tint = vec4(0.0);
    vec2 mean = vec2(0.0);
    for (int i = 0; i < taps; i++) {
      float share = float(i) / float(taps);
      vec2 place = vAt + disc * sqrt(share) * vec2(cos(2.399963 * float(i)), sin(2.399963 * float(i)));
      float z = viewPosition(place, texture2D(depths, place).x).z;
      float weight = exp(-2.0 * share) * smoothstep(2.0, 0.6, abs(z - front) / smoothing);
      vec4 normal = texture2D(normals, place);
      sum += weight * normal / max(normal.w, 1e-4);
      vec4 color = texture2D(colors, place);
      tint += weight * color / max(color.w, 1e-4);
      mean += weight * vec2(z, 1.0);
    }
    vec3 normal = normalize(sum.xyz);
    vec3 albedo = white * pow((tint.rgb / tint.w + 0.055) / 1.055, vec3(2.4));
    float grazing = 1.0 - clamp(normal.z, 0.0, 1.0);
    albedo *= 1.0 - rim * grazing * grazing;
    float z = mean.x / mean.y;
    depth = 0.5 - 0.5 * (projection[2][2] * z + projection[3][2]) / z;

    float shade = 1.0;
    #if defined(USE_SHADOWMAP) && NUM_DIR_LIGHT_SHADOWS > 0
      // Asked for outside of the snow, on the side that the sun sees.
      vec4 world = toWorld * vec4(viewPosition(vAt, depth), 1.0);
      world.xyz += lift * sun;
      DirectionalLightShadow map = directionalLightShadows[0];
      shade = getShadow(directionalShadowMap[0], map.shadowMapSize, map.shadowIntensity, map.shadowBias, map.shadowRadius, directionalShadowMatrix[0] * world);
    #endif

    // Light that goes a little way through snow softens the edge between light and dark.
    vec3 irradiance = getHemisphereLightIrradiance(hemisphereLights[0], normal);
    for (int i = 0; i < NUM_DIR_LIGHTS; i++) {
      float facing = max((dot(normal, directionalLights[i].direction) + 0.18) / 1.18, 0.0);
      irradiance += facing * (i == 0 ? shade : 1.0) * directionalLights[i].color;
    }
    gl_FragColor = vec4(RECIPROCAL_PI * irradiance * albedo, 1.0);
    #include <colorspace_fragment>
    gl_FragDepth = depth;
  }
`;

export class Surface {
  /** Stands in the scene for all points. */
  readonly mesh: Mesh;
  private readonly target: WebGLRenderTarget;
  private readonly front = new Scene();
  private readonly blended = new Scene();
  private readonly shade;

  constructor(white: Color) {
    const depthTexture = new DepthTexture(1, 1);
    this.target = new WebGLRenderTarget(1, 1, { count: 2, type: HalfFloatType, depthTexture });
    this.shade = {
      ...UniformsUtils.clone(UniformsLib.lights),
      projection: { value: new Matrix4() }, toWorld: { value: new Matrix4() }, sun, lift: { value: 0 }, smoothing: { value: 0 }, taps: { value: TAPS.fine },
      white: { value: white }, rim: { value: 0 },
      normals: { value: this.target.textures[0] }, colors: { value: this.target.textures[1] }, depths: { value: depthTexture },
    };
    this.mesh = screenMesh(new ShaderMaterial({
      lights: true, uniforms: this.shade, vertexShader: SCREEN_VERTEX, fragmentShader: SHADE,
    }));
    this.mesh.receiveShadow = true;
  }

  /** How much darker snow is where it is seen along its surface: a share of its light. */
  setRim(rim: number): void {
    this.shade.rim.value = rim;
  }

  /** Points of a body, with positions and tints, whose particles have cubes of a side (m) to themselves; it may change. */
  add(geometry: BufferGeometry): (side: number) => void {
    const radius = { value: 0 };
    for (const [scene, defines, blending] of [
      [this.front, {}, { colorWrite: false }],
      [this.blended, { BLENDED: '' }, { blending: CustomBlending, blendSrc: OneFactor, blendDst: OneFactor, depthWrite: false }],
    ] as const) {
      const points = new Points(geometry, new ShaderMaterial({
        glslVersion: GLSL3, defines, uniforms: { radius, pixels: { value: 0 }, height }, transparent: false,
        vertexShader: SPLAT_VERTEX, fragmentShader: SPLAT_FRAGMENT, ...blending,
      }));
      points.frustumCulled = false;
      scene.add(points);
    }
    return (side) => {
      radius.value = OVERLAP * side;
      // Of the largest spheres, if bodies differ.
      this.shade.lift.value = Math.max(this.shade.lift.value, 1.2 * radius.value);
      this.shade.smoothing.value = SMOOTHING * this.shade.lift.value / 1.2;
    };
  }

  /** Before the scene is drawn: depths, normals and colours of what is seen of the points. */
  prepare(renderer: WebGLRenderer, camera: PerspectiveCamera, quality: Quality): void {
    const { width, height: tall } = renderer.domElement;
    const share = quality === 'fine' ? 1 : 0.5;
    this.target.setSize(Math.ceil(share * width), Math.ceil(share * tall));
    this.shade.taps.value = TAPS[quality];
    height.value = share * tall;
    this.shade.projection.value.copy(camera.projectionMatrix);
    this.shade.toWorld.value.copy(camera.matrixWorld);
    renderer.setRenderTarget(this.target);
    renderer.clear();
    renderer.autoClear = false;
    renderer.render(this.front, camera);
    renderer.render(this.blended, camera);
    renderer.autoClear = true;
    renderer.setRenderTarget(null);
    height.value = tall;
  }
}
