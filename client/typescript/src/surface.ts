// The closed surface of a mesh collider.
//
// Enters: the bytes of a MeshShape. Leaves: its numbers, in arrays of their own.

/** Points and the triangles over them. */
export interface Surface {
  /** x y z of each (m), at time 0. */
  points: Float32Array<ArrayBuffer>;
  /** Three points each, turned outwards. */
  triangles: Uint32Array<ArrayBuffer>;
}

export function surface({ pointsF32, trianglesU32 }: { pointsF32: Uint8Array; trianglesU32: Uint8Array }): Surface {
  return { points: new Float32Array(new Uint8Array(pointsF32).buffer), triangles: new Uint32Array(new Uint8Array(trianglesU32).buffer) };
}
