// Vectors and boxes, in doubles.

import type { Quaternion, Vector } from '../scene.ts';

/** `a + s b`. */
export const along = (a: Vector, s: number, b: Vector): Vector => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
export const minus = (a: Vector, b: Vector): Vector => along(a, -1, b);
export const dot = (a: Vector, b: Vector): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const length = (a: Vector): number => Math.sqrt(dot(a, a));
export const cross = (a: Vector, b: Vector): Vector =>
  [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

/** The direction of a vector; null if it has none. */
export function unit(a: Vector): Vector | null {
  const size = length(a);
  return size > 0 && Number.isFinite(size) ? [a[0] / size, a[1] / size, a[2] / size] : null;
}

/** A vector that goes along with a turn of length 1. */
export function turned([x, y, z, w]: Quaternion, v: Vector): Vector {
  const axis: Vector = [x, y, z];
  const across = along([0, 0, 0], 2, cross(axis, v));
  return along(along(v, w, across), 1, cross(axis, across));
}

/** Two unit vectors that make a right-handed frame with the unit vector `normal`. */
export function tangents(normal: Vector): [Vector, Vector] {
  // The axis farthest from the normal, so that the cross product is not small.
  const helper: Vector = Math.abs(normal[1]) < 0.9 ? [0, 1, 0] : [0, 0, 1];
  const first = unit(cross(helper, normal)) ?? [1, 0, 0];
  return [first, cross(normal, first)];
}

/** A box around points; of none at first. */
export class Bounds {
  private low = [Infinity, Infinity, Infinity];
  private high = [-Infinity, -Infinity, -Infinity];

  copy(): Bounds {
    const copy = new Bounds();
    copy.low = [...this.low];
    copy.high = [...this.high];
    return copy;
  }

  add(point: ArrayLike<number>): void {
    for (let axis = 0; axis < 3; axis++) {
      this.low[axis] = Math.min(this.low[axis], point[axis]);
      this.high[axis] = Math.max(this.high[axis], point[axis]);
    }
  }

  /** Whether a point lies in the box, grown by a length on every side. */
  holds(point: ArrayLike<number>, beyond: number): boolean {
    return this.low.every((low, axis) => point[axis] >= low - beyond && point[axis] <= this.high[axis] + beyond);
  }

  get isEmpty(): boolean {
    return this.low[0] > this.high[0];
  }

  /** The origin if the box is empty. */
  center(): Vector {
    if (this.isEmpty) return [0, 0, 0];
    return [0, 1, 2].map((axis) => 0.5 * (this.low[axis] + this.high[axis])) as unknown as Vector;
  }

  /** The eight corners, the lowest first. */
  corners(): Vector[] {
    if (this.isEmpty) return [];
    const ends = [this.low, this.high];
    return Array.from({ length: 8 }, (_, i) => [ends[i & 1][0], ends[(i >> 1) & 1][1], ends[i >> 2][2]] as Vector);
  }

  /** The lowest y; 0 if the box is empty. */
  floor(): number {
    return this.isEmpty ? 0 : this.low[1];
  }

  /** Radius of the ball around it; 1 if the box is empty or a point. */
  radius(): number {
    if (this.isEmpty) return 1;
    const radius = 0.5 * Math.hypot(...this.high.map((high, axis) => high - this.low[axis]));
    return radius > 0 && Number.isFinite(radius) ? radius : 1;
  }

  /** The point of the box, grown to `reach` times its radius on every side, that is nearest to `point`. */
  nearest(point: Vector, reach: number): Vector {
    const center = this.center();
    const far = reach * this.radius();
    return point.map((at, axis) => Math.min(Math.max(at, center[axis] - far), center[axis] + far)) as unknown as Vector;
  }
}
