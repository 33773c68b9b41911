// Ambient occlusion in creases, from the depths of the picture: the scene is drawn aside, then put on the canvas darker
// where its surroundings cover the sky. After Crytek's screen-space occlusion (Mittring 2007), with normals from depths.

import {
  DepthTexture, HalfFloatType, Matrix4, NoBlending, type PerspectiveCamera, type Scene, ShaderMaterial, UnsignedByteType, Vector2,
  type WebGLRenderer, WebGLRenderTarget,
} from 'three';
import { SCREEN_VERTEX, VIEW_POSITION, screenScene } from './screen.ts';

const SAMPLES = 12;
/** Edges of triangles are smoothed by so many samples per pixel. */
const EDGE_SAMPLES = 4;

const OCCLUSION = /* glsl */ `
  #include <common>
  ${VIEW_POSITION}
  uniform sampler2D depths;
  uniform vec2 texel;
  uniform float reach;
  varying vec2 vAt;

  vec3 at(vec2 place) { return viewPosition(place, texture2D(depths, place).x); }

  // The smaller of both differences, so that no edge tilts the surface before it.
  vec3 difference(vec3 here, vec2 step) {
    vec3 ahead = at(vAt + step) - here;
    vec3 behind = here - at(vAt - step);
    return abs(ahead.z) < abs(behind.z) ? ahead : behind;
  }

  void main() {
    float depth = texture2D(depths, vAt).x;
    if (depth >= 1.0) { gl_FragColor = vec4(1.0); return; }
    vec3 here = viewPosition(vAt, depth);
    vec3 normal = normalize(cross(difference(here, vec2(texel.x, 0.0)), difference(here, vec2(0.0, texel.y))));
    // Height of the reach in the picture, at this distance.
    vec2 scale = reach * vec2(projection[0][0], projection[1][1]) / (-2.0 * here.z);
    float turn = 6.2832 * fract(52.9829189 * fract(dot(floor(gl_FragCoord.xy), vec2(0.06711056, 0.00583715))));

    float covered = 0.0;
    for (int i = 0; i < ${SAMPLES}; i++) {
      float share = (float(i) + 0.5) / ${SAMPLES.toFixed(1)};
      float angle = turn + 2.399963 * float(i);
      vec3 to = at(vAt + share * scale * vec2(cos(angle), sin(angle))) - here;
      float size = length(to);
      float above = dot(to, normal) / max(size, 1e-9);
      covered += max(above - 0.12, 0.0) * smoothstep(1.5 * reach, 0.5 * reach, size);
    }
    gl_FragColor = vec4(vec3(1.0 - min(1.7 * covered / ${SAMPLES.toFixed(1)}, 0.75)), 1.0);
  }
`;

const JOIN = /* glsl */ `
  #include <common>
  ${VIEW_POSITION}
  uniform sampler2D picture;
  uniform sampler2D depths;
  uniform sampler2D occlusion;
  uniform vec2 texel;
  varying vec2 vAt;

  void main() {
    vec4 color = texture2D(picture, vAt);
    float here = viewPosition(vAt, texture2D(depths, vAt).x).z;
    float open = 0.0;
    float weight = 0.0;
    for (int i = 0; i < 16; i++) {
      vec2 place = vAt + 2.0 * texel * (vec2(i % 4, i / 4) - 1.5);
      float z = viewPosition(place, texture2D(depths, place).x).z;
      float same = max(1.0 - abs(z - here) / (0.02 * abs(here)), 1e-3);
      open += same * texture2D(occlusion, place).x;
      weight += same;
    }
    // Colours were multiplied with their coverage, as the canvas wants them, but before they are encoded.
    vec3 light = color.rgb / max(color.a, 1e-4) * mix(1.0, open / weight, color.a);
    gl_FragColor = vec4(light, 1.0);
    #include <colorspace_fragment>
    gl_FragColor = vec4(gl_FragColor.rgb * color.a, color.a);
  }
`;

export class Occlusion {
  private readonly picture: WebGLRenderTarget;
  private readonly half = new WebGLRenderTarget(1, 1, { depthBuffer: false, type: UnsignedByteType });
  private readonly uniforms;
  private readonly darken: Scene;
  private readonly join: Scene;

  constructor(private readonly renderer: WebGLRenderer) {
    const depthTexture = new DepthTexture(1, 1);
    this.picture = new WebGLRenderTarget(1, 1, { type: HalfFloatType, samples: EDGE_SAMPLES, depthTexture });
    this.uniforms = {
      projection: { value: new Matrix4() }, texel: { value: new Vector2() }, reach: { value: 1 },
      picture: { value: this.picture.texture }, depths: { value: depthTexture }, occlusion: { value: this.half.texture },
    };
    const made = (fragmentShader: string) => screenScene(new ShaderMaterial({
      uniforms: this.uniforms, vertexShader: SCREEN_VERTEX, fragmentShader, depthTest: false, depthWrite: false, blending: NoBlending,
    }));
    this.darken = made(OCCLUSION);
    this.join = made(JOIN);
  }

  /** Draws a scene on the canvas; what is farther than `reach` (m) covers nothing. */
  render(scene: Scene, camera: PerspectiveCamera, reach: number): void {
    const { width, height } = this.renderer.domElement;
    this.picture.setSize(width, height);
    this.half.setSize(Math.ceil(width / 2), Math.ceil(height / 2));
    this.uniforms.projection.value.copy(camera.projectionMatrix);
    this.uniforms.texel.value.set(1 / width, 1 / height);
    this.uniforms.reach.value = reach;
    for (const [drawn, target] of [[scene, this.picture], [this.darken, this.half], [this.join, null]] as const) {
      this.renderer.setRenderTarget(target);
      this.renderer.render(drawn, camera);
    }
  }
}
