// How cloth looks: matt, lighter along its outline as fibres are, and of another shade on its inside.

import { type Color, DoubleSide, MeshLambertMaterial } from 'three';

const INSIDE = /* glsl */ `
  #include <color_fragment>
  if (gl_FrontFacing != outsideIsFront) diffuseColor.rgb = mix(diffuseColor.rgb, vec3(0.55, 0.5, 0.45), 0.38);
`;

const SHEEN = /* glsl */ `
  float grazing = 1.0 - abs(dot(normalize(vViewPosition), normal));
  outgoingLight += 0.16 * grazing * grazing * grazing * (0.35 + outgoingLight);
  #include <opaque_fragment>
`;

/** `outside` is the side of the triangles that has the colour itself. */
export function fabric(color: Color, outside: 'front' | 'back'): MeshLambertMaterial {
  const material = new MeshLambertMaterial({ color, side: DoubleSide });
  material.onBeforeCompile = (shader) => {
    shader.uniforms['outsideIsFront'] = { value: outside === 'front' };
    shader.fragmentShader = `uniform bool outsideIsFront;\n${shader.fragmentShader}`
      .replace('#include <color_fragment>', INSIDE)
      .replace('#include <opaque_fragment>', SHEEN);
  };
  return material;
}
