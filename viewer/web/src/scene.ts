// What a page draws: a scene, which never changes, and its frames. Neither says where they come from.

export type Vector = readonly [number, number, number];
/** A turn: x y z along its axis times the sine of half its angle, and the cosine of that. */
export type Quaternion = readonly [number, number, number, number];

/** What the colour of bare points shows. */
export type ColorBy = 'plastic_ratio' | 'speed' | 'stress';

/** A body: particles that follow each other, joined by triangles, or by springs, or by nothing, as snow is. */
export interface Body {
  name: string;
  firstParticle: number;
  particleCount: number;
  /** Three particles each. */
  triangles: Uint32Array<ArrayBuffer>;
  /** Two particles each; only a body without triangles has any. */
  springs: Uint32Array<ArrayBuffer>;
  pins: Uint32Array<ArrayBuffer>;
  /** Red, green and blue of sRGB, 0 to 255, as the scene says; null: the page chooses. */
  color: Vector | null;
}

/** True for bare points, as snow is. */
export const isPoints = (body: Body): boolean => body.triangles.length === 0 && body.springs.length === 0;

/** A closed surface at time 0. */
export interface MeshShape {
  kind: 'mesh';
  /** x y z of each (m). */
  points: Float32Array<ArrayBuffer>;
  /** Three points each, turned outwards. */
  triangles: Uint32Array<ArrayBuffer>;
  /** The box around all triangles (m). */
  low: Vector;
  high: Vector;
  /** The point that poses place (m). */
  origin: Vector;
}

/** A collider's shape at time 0 (m). */
export type ColliderShape =
  | MeshShape
  | { kind: 'plane'; point: Vector; normal: Vector }
  | { kind: 'sphere'; center: Vector; radius: number }
  | { kind: 'capsule'; start: Vector; end: Vector; radius: number }
  | { kind: 'box'; center: Vector; half_extent: Vector; axis_x: Vector; axis_y: Vector }
  | { kind: 'cylinder'; start: Vector; end: Vector; radius: number }
  | { kind: 'half_pipe'; point: Vector; axis: Vector; up: Vector; radius: number };

export interface Collider {
  name: string;
  /** m/s. */
  velocity: Vector;
  shape: ColliderShape;
}

/** Where a collider is that keys or calls move. */
export interface Pose {
  /** The collider's name. */
  name: string;
  /** Of its centre, of the middle of its segment, of its point, or of the origin of its mesh (m). */
  position: Vector;
  /** Since time 0. */
  turn: Quaternion;
}

/** From the least to the largest. */
export type Range = readonly [number, number];

export interface Scene {
  title: string;
  particleCount: number;
  colorBy: ColorBy | null;
  bodies: Body[];
  colliders: Collider[];
}

/** Positions and perhaps scalars of all particles at one time. */
export interface Frame {
  /** s. */
  time: number;
  /**
   * Positions are these, x y z of each particle, times `step` (m): whole numbers of a recording, or numbers of binary32
   * with a step of 1.
   */
  numbers: Int32Array | Float32Array;
  step: number;
  /** What the scene's colour shows, of each particle. */
  scalar: Float32Array<ArrayBuffer> | null;
  /** Any other collider is where its velocity has brought it, and is not turned. */
  poses: readonly Pose[];
}

/** What plots show of a frame; null where it is not known. */
export interface Diagnostics {
  /** s. */
  time: number;
  /** J. */
  kinetic: number | null;
  elastic: number | null;
  gravitational: number | null;
  /** Largest length of a spring over its length at rest. */
  stretch: number | null;
  /** s. */
  dt: number | null;
}
