// A triangle that covers the whole picture, and what shaders on it share.

import { BufferAttribute, BufferGeometry, Mesh, Scene, type ShaderMaterial } from 'three';

/** For shaders of a triangle over the picture: `vAt` goes from 0 to 1 along its sides. */
export const SCREEN_VERTEX = /* glsl */ `
  varying vec2 vAt;
  void main() {
    vAt = 0.5 * position.xy + 0.5;
    gl_Position = vec4(position.xy, 0.0, 1.0);
  }
`;

/** Coordinates as the camera has them (m), from a depth between 0 and 1 of a perspective view. */
export const VIEW_POSITION = /* glsl */ `
  uniform mat4 projection;
  vec3 viewPosition(vec2 at, float depth) {
    float z = -projection[3][2] / (2.0 * depth - 1.0 + projection[2][2]);
    return vec3(-z * (2.0 * at - 1.0 + vec2(projection[2][0], projection[2][1])) / vec2(projection[0][0], projection[1][1]), z);
  }
`;

export function screenMesh(material: ShaderMaterial): Mesh {
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(new Float32Array([-1, -1, 0, 3, -1, 0, -1, 3, 0]), 3));
  const mesh = new Mesh(geometry, material);
  mesh.frustumCulled = false;
  return mesh;
}

/** A scene of nothing but the triangle. */
export function screenScene(material: ShaderMaterial): Scene {
  return new Scene().add(screenMesh(material));
}
