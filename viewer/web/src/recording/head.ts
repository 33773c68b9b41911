// The head of a recording: what never changes.
//
// Enters: its JSON, which is not trusted. Leaves: a scene, and facts about the file.

import { FormatError, type Fields, bytes, fields, list, number, optional, positive, text, vector, whole } from '../page/json.ts';
import { unpack } from '../../../../client/typescript/src/packed.ts';
import { meshShape } from '../picture/extent.ts';
import type { Body, Collider, ColliderShape, ColorBy, Scene, Vector } from '../scene.ts';

const FORMAT = 1;
/** More particles than a browser can show: positions of 768 MB. */
const MOST_PARTICLES = 1 << 26;
const COLORS: readonly ColorBy[] = ['plastic_ratio', 'speed', 'stress'];

export interface Head {
  scene: Scene;
  program: string;
  precision: string;
  /** The scene's own file, as TOML. */
  source: string | null;
  /** s; 0 if the file does not say. */
  dt: number;
}

export async function readHead(json: unknown): Promise<Head> {
  const head = fields(json, 'the head');
  if (head['format'] !== FORMAT) {
    throw new FormatError(`it has format ${String(head['format'])}, and this page shows format ${FORMAT}`);
  }
  const particleCount = whole(head['particles'], 'particles', MOST_PARTICLES);
  const bodies = list(head['bodies'], 'bodies');
  const colliders = list(head['colliders'], 'colliders');
  const scene: Scene = {
    title: text(head['title'], 'title'),
    particleCount,
    colorBy: COLORS.find((by) => by === head['color']) ?? null,
    bodies: await Promise.all(bodies.map((body, index) => readBody(body, `body ${index}`, particleCount))),
    colliders: (await Promise.all(colliders.map((collider, index) => readCollider(collider, `collider ${index}`)))).flat(),
  };
  return {
    scene,
    program: optional(head['program'], (value) => text(value, 'program')) ?? 'nappe',
    precision: optional(head['precision'], (value) => text(value, 'precision')) ?? '',
    source: optional(head['scene'], (value) => text(value, 'scene')),
    dt: optional(head['dt_seconds'], (value) => number(value, 'dt_seconds')) ?? 0,
  };
}

async function readBody(json: unknown, name: string, particles: number): Promise<Body> {
  const body = fields(json, name);
  const firstParticle = whole(body['first_particle'], `first_particle of ${name}`, particles);
  const particleCount = whole(body['particle_count'], `particle_count of ${name}`, particles - firstParticle);
  const within = (indices: Uint32Array<ArrayBuffer>, what: string) => {
    if (indices.some((index) => index < firstParticle || index >= firstParticle + particleCount)) {
      throw new FormatError(`${what} of ${name} name particles that are not its own`);
    }
    return indices;
  };
  const [triangles, springs] = await Promise.all([
    readIndices(body['triangles'], `triangles of ${name}`, 3),
    readIndices(body['springs'], `springs of ${name}`, 2),
  ]);
  const pins = list(body['pins'] ?? [], `pins of ${name}`).map((pin) => whole(pin, `a pin of ${name}`, particles));
  return {
    name: text(body['name'], `name of ${name}`),
    firstParticle,
    particleCount,
    triangles: within(triangles, 'triangles'),
    springs: within(springs, 'springs'),
    pins: within(Uint32Array.from(pins), 'pins'),
    color: optional(body['color'], (value) => color(value, `color of ${name}`)),
  };
}

/** Red, green and blue of sRGB. */
function color(json: unknown, name: string): Vector {
  const parts = vector(json, name);
  if (parts.some((part) => part < 0 || part > 255)) throw new FormatError(`${name} is not within 0 to 255`);
  return parts;
}

async function readIndices(json: unknown, name: string, components: number): Promise<Uint32Array<ArrayBuffer>> {
  if (json === null || json === undefined) return new Uint32Array(0);
  const packed = fields(json, name);
  const count = whole(packed['count'], `count of ${name}`, 4 * MOST_PARTICLES);
  const numbers = await unpack(bytes(packed['data'], name), { particles: count, components }, null);
  // A negative number becomes a large one, which is no particle of the body and no point of the mesh.
  return Uint32Array.from(numbers);
}

/** A shape that is newer than this page is left out. */
async function readCollider(json: unknown, name: string): Promise<Collider[]> {
  const collider = fields(json, name);
  const shape = await readShape(fields(collider['shape'], `shape of ${name}`), name);
  if (shape === null) return [];
  return [{ name: text(collider['name'], `name of ${name}`), velocity: vector(collider['velocity'], `velocity of ${name}`), shape }];
}

async function readShape(shape: Fields, name: string): Promise<ColliderShape | null> {
  const at = (field: string) => vector(shape[field], `${field} of ${name}`);
  const radius = () => positive(shape['radius'], `radius of ${name}`);
  switch (shape['kind']) {
    case 'plane':
      return { kind: 'plane', point: at('point'), normal: at('normal') };
    case 'sphere':
      return { kind: 'sphere', center: at('center'), radius: radius() };
    case 'capsule':
      return { kind: 'capsule', start: at('start'), end: at('end'), radius: radius() };
    case 'cylinder':
      return { kind: 'cylinder', start: at('start'), end: at('end'), radius: radius() };
    case 'box':
      return { kind: 'box', center: at('center'), half_extent: at('half_extent'), axis_x: at('axis_x'), axis_y: at('axis_y') };
    case 'half_pipe':
      return { kind: 'half_pipe', point: at('point'), axis: at('axis'), up: at('up'), radius: radius() };
    case 'mesh':
      return readMesh(shape, name);
    default:
      return null;
  }
}

async function readMesh(shape: Fields, name: string): Promise<ColliderShape> {
  const packed = bytes(shape['points'], `points of ${name}`);
  if (packed.length % 12 !== 0) throw new FormatError(`points of ${name} take ${packed.length} bytes, no multiple of 12`);
  const points = new Float32Array(packed.buffer);
  if (!points.every(Number.isFinite)) throw new FormatError(`a point of ${name} is not finite`);
  const triangles = await readIndices(shape['triangles'], `triangles of ${name}`, 3);
  if (triangles.length === 0) throw new FormatError(`${name} has no triangles`);
  if (triangles.some((index) => index >= points.length / 3)) throw new FormatError(`triangles of ${name} name points that it has not`);
  // Files that are older than poses have no origin, and need none.
  const origin = optional(shape['origin'], (value) => vector(value, `origin of ${name}`));
  return meshShape(points, triangles, origin ?? undefined);
}
