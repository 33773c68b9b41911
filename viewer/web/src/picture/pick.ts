// A place of the picture to what is there: a cloth, the particles around that place, the nearest of some particles.
//
// Enters: a half-line or a place of the window, positions x y z of all particles (m). Leaves: particles, over all bodies.

import { Bounds, along, cross, dot, length, minus } from './geometry.ts';
import type { Place, Ray } from './ray.ts';
import type { Body, Vector } from '../scene.ts';

/** Particles that are taken at a time, at most. */
const MOST_TAKEN = 48;
/** They lie within this share of the body's extent around the place where it is taken. */
const REACH = 0.03;
/** A half-line through an edge that two triangles share meets one of them, whatever is rounded. */
const EDGE = 1e-9;

/** Where a body is met. */
export interface Hit {
  body: Body;
  /** Its particles there. */
  corners: readonly number[];
  /** m. */
  point: Vector;
}

/** What is taken of a body. */
export interface Patch {
  particles: number[];
  /** Length of the diagonal of the box around the body (m). */
  extent: number;
}

/** Where a particle is (m). */
export const particleAt = (positions: ArrayLike<number>, particle: number): Vector =>
  [positions[3 * particle], positions[3 * particle + 1], positions[3 * particle + 2]];

/** The nearest triangle that a half-line meets, from either side; null if it meets none. */
export function nearestHit(ray: Ray, positions: ArrayLike<number>, bodies: readonly Body[]): Hit | null {
  let hit: Hit | null = null;
  let nearest = Infinity;
  for (const body of bodies) {
    for (let corner = 0; corner + 2 < body.triangles.length; corner += 3) {
      const corners = body.triangles.subarray(corner, corner + 3);
      const distance = distanceTo(ray, positions, corners);
      if (distance >= nearest) continue;
      nearest = distance;
      hit = { body, corners: [...corners], point: along(ray.origin, distance, ray.direction) };
    }
  }
  return hit;
}

/** Along a half-line to a triangle (m); infinity if it does not meet it. */
function distanceTo({ origin, direction }: Ray, positions: ArrayLike<number>, corners: Uint32Array): number {
  const a = particleAt(positions, corners[0]);
  const first = minus(particleAt(positions, corners[1]), a);
  const second = minus(particleAt(positions, corners[2]), a);
  const across = cross(direction, second);
  const volume = dot(first, across);
  const from = minus(origin, a);
  const u = dot(from, across) / volume;
  const side = cross(from, first);
  const v = dot(direction, side) / volume;
  // Of a triangle that is seen along its plane, these are no numbers.
  if (!(u >= -EDGE && v >= -EDGE && u + v <= 1 + EDGE)) return Infinity;
  const distance = dot(second, side) / volume;
  return distance > 0 ? distance : Infinity;
}

/** The particle that is seen nearest to a place of the window, within so many pixels; null if there is none. */
export function nearestSeen(particles: Iterable<number>, seen: (particle: number) => Place | null, at: Place, within: number): number | null {
  let found: number | null = null;
  let nearest = within;
  for (const particle of particles) {
    const place = seen(particle);
    if (place === null) continue;
    const distance = Math.hypot(place.x - at.x, place.y - at.y);
    if (distance > nearest) continue;
    nearest = distance;
    found = particle;
  }
  return found;
}

/** The particles around a hit, the nearest first, without pins; those of the hit itself are always among them. */
export function patchAround({ body, corners, point }: Hit, positions: ArrayLike<number>): Patch {
  const box = new Bounds();
  const last = body.firstParticle + body.particleCount;
  for (let particle = body.firstParticle; particle < last; particle++) box.add(particleAt(positions, particle));
  const [low, high] = [box.corners()[0], box.corners()[7]];
  const extent = length(minus(high, low));

  const pins = new Set(body.pins);
  const found: { particle: number; distance: number }[] = [];
  for (let particle = body.firstParticle; particle < last; particle++) {
    if (pins.has(particle)) continue;
    const distance = length(minus(particleAt(positions, particle), point));
    if (distance <= REACH * extent || corners.includes(particle)) found.push({ particle, distance });
  }
  found.sort((a, b) => a.distance - b.distance || a.particle - b.particle);
  return { particles: found.slice(0, MOST_TAKEN).map(({ particle }) => particle), extent };
}

/** Where a half-line meets the plane through a point, which is not along it. */
export function onPlane({ origin, direction }: Ray, point: Vector, normal: Vector): Vector {
  return along(origin, dot(minus(point, origin), normal) / dot(direction, normal), direction);
}
