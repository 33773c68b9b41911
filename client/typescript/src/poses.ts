// Where colliders are at the time of a frame, and how they are turned.
//
// Enters: ColliderPose, from a server that is not trusted. Leaves: poses of colliders that are there, each once, with
// finite positions and turns of length 1.

import { broken } from './errors.ts';
import type { ColliderPose, Frame as Wire } from './gen/nappe/v1/frame_pb.ts';
import type { Topology } from './topology.ts';

/** How far the length of a turn may be from 1. */
const UNIT_TOLERANCE = 1e-6;

/** A pose of a collider that keys of the scene or calls move. */
export interface Pose {
  /** The collider's name. */
  readonly name: string;
  /** Of its reference point (m). */
  readonly position: readonly [number, number, number];
  /** How it is turned since time 0: a quaternion x, y, z, w of length 1. */
  readonly turn: readonly [number, number, number, number];
}

/** The poses of a frame, whose first piece this is. */
export function readPoses(piece: Wire, topology: Topology): readonly Pose[] {
  if (piece.poses.length === 0) return [];
  const left = new Set(topology.colliders.map(({ name }) => name));
  return piece.poses.map((wire) => {
    const pose = read(wire);
    const wrong = (what: string): Error => broken(`frame ${piece.frame}: the pose of collider '${pose.name}': ${what}`);
    if (!left.delete(pose.name)) throw wrong('no collider has this name, or it comes twice');
    if (!pose.position.every(Number.isFinite)) throw wrong('its position is not finite');
    // What is not a number is near to nothing.
    if (!(Math.abs(Math.hypot(...pose.turn) - 1) <= UNIT_TOLERANCE)) throw wrong('its turn is not of length 1');
    return pose;
  });
}

/** What is absent is 0, or no turn. */
function read({ name, position, turn }: ColliderPose): Pose {
  return {
    name, position: [position?.x ?? 0, position?.y ?? 0, position?.z ?? 0],
    turn: turn === undefined ? [0, 0, 0, 1] : [turn.x, turn.y, turn.z, turn.w],
  };
}
