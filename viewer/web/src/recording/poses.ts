// Where colliders are in a frame of a recording, and how they are turned.
//
// Enters: the JSON of a frame, which is not trusted. Leaves: poses.

import { FormatError, fields, list, number, text, vector } from '../page/json.ts';
import type { Pose } from '../scene.ts';

/** How far the length of a turn may be from 1. */
const UNIT_TOLERANCE = 1e-6;

/** None where the file is older than poses, or nothing is moved by keys or calls. */
export function readPoses(json: unknown): Pose[] {
  if (json === null || json === undefined) return [];
  return list(json, 'poses of a frame').map((entry) => {
    const pose = fields(entry, 'a pose');
    const name = text(pose['name'], 'name of a pose');
    const parts = list(pose['turn'], `turn of ${name}`).map((part) => number(part, `turn of ${name}`));
    if (parts.length !== 4 || Math.abs(Math.hypot(...parts) - 1) > UNIT_TOLERANCE) throw new FormatError(`turn of ${name} is no quaternion of length 1`);
    const [x, y, z, w] = parts;
    return { name, position: vector(pose['position'], `position of ${name}`), turn: [x, y, z, w] };
  });
}
