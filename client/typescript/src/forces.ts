// Forces that calls have set, as a session's parameters tell them.
//
// Enters: parameters. Leaves: particles and forces as arrays.

import { concatenated } from './bytes.ts';
import type { Parameters } from './gen/nappe/v1/simulation_pb.ts';

/** Forces that act on a body until calls set others. */
export interface CalledForces {
  /** The body's name. */
  readonly body: string;
  /** Indices within the body; null: all its particles that are not pinned. */
  readonly particles: Uint32Array<ArrayBuffer> | null;
  /** x y z of the force on each (N), or of the one force on all. Null where there are more than a server tells, and in lists of sessions. */
  readonly forces: Float64Array<ArrayBuffer> | null;
}

/** The forces that calls have set, by body. */
export function forcesOf({ forces }: Parameters): CalledForces[] {
  return forces.map(({ body, particlesU32, force, forcesF64 }) => {
    const particles = particlesU32.length === 0 ? null : new Uint32Array(concatenated([particlesU32]));
    if (force === undefined) return { body, particles, forces: forcesF64.length === 0 ? null : new Float64Array(concatenated([forcesF64])) };
    const one = [force.x, force.y, force.z];
    return { body, particles, forces: Float64Array.from({ length: 3 * (particles?.length ?? 1) }, (_, i) => one[i % 3]) };
  });
}
