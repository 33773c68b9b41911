// What the hand holds, a patch of a cloth or a pin, and what is asked of the server for it.
//
// Enters: where it was taken, where it is drawn to (m). Leaves: changes. The force of a pull is made by the server.

import type { Changes } from '../../../../client/typescript/src/index.ts';
import { along, length, minus } from '../picture/geometry.ts';
import type { Hit, Patch } from '../picture/pick.ts';
import type { Body, Vector } from '../scene.ts';

/** A pull of all that is held is as strong as so many weights of the body. */
const WEIGHTS = 3;
/** Weights where nothing falls are those of the earth (m/s²). */
const EARTH = 9.81;
/** The largest acceleration that a server takes (m/s²). */
const MOST = 1e6;
/** The largest frequency of a pull times the length of a step that a server takes. */
const MOST_PHASE = 0.5;
/** Drawn over a tenth of the body's extent, a pull is as strong as it becomes. */
const TENTHS = 10;
/** Simulated time after which a pull ends that nobody renews (s), and after which one that is held is renewed. */
const SECONDS = 0.5;
export const RENEWED = 0.2;
/** Radii of the scene that a pin goes in a second of simulated time, at most. */
const RADII = 2;
/** A pin that needs longer than this (s) for its way is held back by that. */
const BEHIND = 0.1;

/** Where a particle is (m). */
export type Where = (particle: number) => Vector;

/** What a hand holds. */
export interface Hold {
  /** What it is called where it is refused, as a noun. */
  readonly name: string;
  /** Where it is, by where particles are (m). */
  at(where: Where): Vector;
  /** What draws it to a target; `seconds` of simulated time have passed since the last one. */
  to(target: Vector, at: Vector, seconds: number): Changes;
  /** Whether it is drawn as hard, or as fast, as it may be. */
  isAtBound(target: Vector, at: Vector): boolean;
  /** What lets it go; null where nothing does, since it stays. */
  end(): Changes | null;
  /** It has to be renewed for as long as it is held. */
  readonly isRenewed: boolean;
}

export interface Strength {
  /** 1/s. */
  frequency: number;
  /** m/s². */
  most: number;
}

/** How hard `held` particles of `all` are pulled, of a body of an extent (m), under gravity (m/s²), in steps of `dt` (s). */
export function strengthOf(held: number, all: number, extent: number, gravity: number, dt: number): Strength {
  const most = Math.min((WEIGHTS * (gravity > 0 ? gravity : EARTH) * all) / held, MOST);
  return { most, frequency: Math.min(MOST_PHASE / dt, Math.sqrt((TENTHS * most) / extent)) };
}

/** A patch of a cloth, held where it was hit; `where` is that of this time. */
export class ClothHold implements Hold {
  readonly name = 'The pull';
  readonly isRenewed = true;
  private readonly body: Body;
  private readonly particles: readonly number[];
  /** Of each particle from the place that is held (m), and their mean. */
  private readonly offsets: Vector[];
  private readonly middle: Vector;
  private readonly strength: Strength;

  constructor({ body, point }: Hit, { particles, extent }: Patch, where: Where, gravity: number, dt: number) {
    this.body = body;
    this.particles = particles;
    this.offsets = particles.map((particle) => minus(where(particle), point));
    this.middle = mean(this.offsets);
    this.strength = strengthOf(particles.length, body.particleCount, extent, gravity, dt);
  }

  at(where: Where): Vector {
    return minus(mean(this.particles.map(where)), this.middle);
  }

  to(target: Vector): Changes {
    const pointsF64 = Float64Array.from(this.offsets.flatMap((offset) => along(target, 1, offset)));
    return { pulls: [{ ...this.named(), pointsF64, ...this.strength, seconds: SECONDS }] };
  }

  /** As the law of pulls has it for what is at rest. */
  isAtBound(target: Vector, at: Vector): boolean {
    return this.strength.frequency ** 2 * length(minus(target, at)) > this.strength.most;
  }

  end(): Changes {
    return { pulls: [this.named()] };
  }

  private named(): { body: string; particlesU32: Uint32Array } {
    const { name, firstParticle } = this.body;
    return { body: name, particlesU32: Uint32Array.from(this.particles, (particle) => particle - firstParticle) };
  }
}

/** A pin, of a scene with a radius (m), in steps of `dt` (s). */
export class PinHold implements Hold {
  readonly name = 'The pin';
  readonly isRenewed = false;

  constructor(private readonly pin: number, private readonly radius: number, private readonly dt: number) {}

  at(where: Where): Vector {
    return where(this.pin);
  }

  /** It goes on from where it is, which is no nearer than where it is seen. */
  to(target: Vector, at: Vector, seconds: number): Changes {
    const [x, y, z] = target;
    const durationSeconds = Math.max(seconds, this.least(target, at), this.dt);
    return { pins: [{ particle: this.pin, target: { x, y, z }, durationSeconds }] };
  }

  isAtBound(target: Vector, at: Vector): boolean {
    return this.least(target, at) > BEHIND;
  }

  end(): null {
    return null;
  }

  /** Simulated time that the way takes at least (s). */
  private least(target: Vector, at: Vector): number {
    return length(minus(target, at)) / (RADII * this.radius);
  }
}

function mean(points: readonly Vector[]): Vector {
  return points.reduce<Vector>((sum, point) => along(sum, 1 / points.length, point), [0, 0, 0]);
}
