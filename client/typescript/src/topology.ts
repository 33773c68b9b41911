// What does not change from frame to frame: bodies, their triangles or springs, pins, colliders.
//
// Enters: the topology of a stream, in pieces, from a server that is not trusted. Leaves: a Topology whose indices are
// all in range, so that a page can follow them without looking.

import { concatenated } from './bytes.ts';
import { colliderArrays, joinedColliders, keepArrays, wrongCollider } from './colliders.ts';
import { broken } from './errors.ts';
import { plain, writable } from './written.ts';
import type { BodyTopology, Chunk, ColliderShape, Topology as Wire } from './gen/nappe/v1/frame_pb.ts';

/** Most particles of a frame that are held. */
const MAX_PARTICLES = 1 << 24;
/** Most bytes of all pieces of a topology together. */
const MAX_BYTES = 192 << 20;

/** One body: its particles, which follow each other, and what joins them. Indices are over all particles of the session. */
export interface Body {
  name: string;
  firstParticle: number;
  particleCount: number;
  /** Three particles each. */
  triangles: Uint32Array<ArrayBuffer>;
  /** Two particles each; only a body without triangles has any. */
  springs: Uint32Array<ArrayBuffer>;
  pins: Uint32Array<ArrayBuffer>;
  /** Texture coordinates, a pair for each of its particles, or none. */
  uv: Float32Array<ArrayBuffer>;
  /** Red, green and blue of sRGB, each 0 to 255, that the scene gives it; null: a viewer chooses. */
  color: readonly [number, number, number] | null;
  /** Masses of its particles (kg), or none from an older server. */
  masses: Float32Array<ArrayBuffer>;
  /** Volumes of its particles at rest (m³), or none of cloth. */
  volumes: Float32Array<ArrayBuffer>;
  /** A figure is led by its frames, and to be drawn as solids are; null: an object of snow, or a body of an older server. */
  role: 'cloth' | 'figure' | null;
}

/** What a session is made of. */
export interface Topology {
  /** Number of the topology, which frames refer to. */
  id: number;
  /** Particles of every frame. */
  particleCount: number;
  /** Uid of the session. */
  sessionUid: string;
  /** In the order of their particles; together they hold every particle once. */
  bodies: Body[];
  colliders: ColliderShape[];
}

/** Position among the pieces of the same whole, and how many there are. */
export function place({ chunk }: { chunk?: Chunk | undefined }): { index: number; count: number } {
  return chunk ?? { index: 0, count: 1 };
}

/** A piece with arrays of its own: those of the wire are overwritten by the next message. */
function kept(wire: Wire): Wire {
  for (const body of wire.bodies) {
    for (const array of ARRAYS) body[array] = body[array].slice();
  }
  for (const collider of wire.colliders) keepArrays(collider);
  return wire;
}

const ARRAYS = ['trianglesU32', 'springsU32', 'pinsU32', 'uvF32', 'massF32', 'volumeF32'] as const;

/** Puts the pieces of one topology together. */
export class TopologyJoiner {
  #pieces: Wire[] = [];
  #bytes = 0;

  /** Takes the next piece; the whole when its last one has come. Piece 0 begins anew. */
  add(piece: Wire): Topology | null {
    const { index, count } = place(piece);
    if (index === 0) [this.#pieces, this.#bytes] = [[], 0];
    const next = this.#pieces.length;
    if (index !== next || index >= count || !belongs(piece, this.#pieces[0] ?? piece)) {
      throw broken(`topology: piece ${index} of ${count} came where piece ${next} was next`);
    }
    this.#bytes += size(piece);
    if (this.#bytes > MAX_BYTES) throw broken(`topology: ${this.#bytes} bytes came; at most ${MAX_BYTES} are held`);

    this.#pieces.push(kept(piece));
    if (index + 1 < count) return null;
    const pieces = this.#pieces;
    this.#pieces = [];
    return read(pieces);
  }
}

const belongs = (piece: Wire, first: Wire): boolean =>
  piece.topologyId === first.topologyId && piece.particleCount === first.particleCount && place(piece).count === place(first).count;

/** What a body or a collider takes in memory without its arrays counts as well. */
function size({ bodies, colliders }: Wire): number {
  const arrays = (body: BodyTopology): number => ARRAYS.reduce((sum, array) => sum + body[array].length, 0);
  const held = bodies.reduce((sum, body) => sum + 256 + body.name.length + arrays(body), 0);
  const surface = (collider: ColliderShape): number => colliderArrays(collider).reduce((sum, array) => sum + array.length, 0);
  return colliders.reduce((sum, collider) => sum + 256 + collider.name.length + surface(collider), held);
}

function read(pieces: Wire[]): Topology {
  const [{ topologyId, particleCount, sessionUid }] = pieces;
  if (particleCount > MAX_PARTICLES) throw broken(`topology: ${particleCount} particles are announced; at most ${MAX_PARTICLES} are held`);
  let held = 0;
  const bodies = joined(pieces.flatMap((piece) => piece.bodies)).map((parts) => {
    const body = readBody(parts, held, particleCount);
    held += body.particleCount;
    return body;
  });
  if (held !== particleCount) throw broken(`topology: the bodies hold ${held} of ${particleCount} particles`);

  const colliders = joinedColliders(pieces.flatMap((piece) => piece.colliders));
  const wrong = wrongCollider(colliders);
  if (wrong !== null) throw broken(`topology: collider '${wrong.name}': ${wrong.what}`);
  return writable({ id: topologyId, particleCount, sessionUid, bodies, colliders });
}

/** Parts of a body stand under the same first particle, one after the other. */
function joined(parts: BodyTopology[]): BodyTopology[][] {
  const bodies: BodyTopology[][] = [];
  for (const part of parts) {
    const last = bodies.at(-1);
    if (last !== undefined && last[0].firstParticle === part.firstParticle && last[0].name === part.name) last.push(part);
    else bodies.push([part]);
  }
  return bodies;
}

function readBody(parts: BodyTopology[], expected: number, particles: number): Body {
  const [{ name, firstParticle, particleCount }] = parts;
  if (firstParticle !== expected || particleCount > particles - expected) {
    throw broken(`topology: body '${name}' starts at particle ${firstParticle} and has ${particleCount}, where ${expected} is next of ${particles}`);
  }
  const bytes = (array: (typeof ARRAYS)[number], numbers: number): ArrayBuffer => {
    const all = concatenated(parts.map((part) => part[array]));
    if (all.byteLength % (4 * numbers) === 0) return all;
    throw broken(`topology: ${array} of body '${name}' take ${all.byteLength} bytes, no multiple of ${4 * numbers}`);
  };
  const body: Body = {
    name, firstParticle, particleCount,
    triangles: new Uint32Array(bytes('trianglesU32', 3)),
    springs: new Uint32Array(bytes('springsU32', 2)),
    pins: new Uint32Array(bytes('pinsU32', 1)),
    uv: new Float32Array(bytes('uvF32', 2)),
    color: parts[0].color === undefined ? null : channels(parts[0].color),
    masses: new Float32Array(bytes('massF32', 1)),
    volumes: new Float32Array(bytes('volumeF32', 1)),
    role: ([null, 'cloth', 'figure'] as const)[parts[0].role] ?? null,
  };
  if (body.uv.length !== 0 && body.uv.length !== 2 * particleCount) {
    throw broken(`topology: body '${name}' has ${body.uv.length / 2} texture coordinates for ${particleCount} particles`);
  }
  for (const list of ['masses', 'volumes'] as const) {
    const numbers = body[list];
    if ((numbers.length === 0 || numbers.length === particleCount) && numbers.every((number) => number >= 0 && number < Infinity)) continue;
    throw broken(`topology: body '${name}' has ${numbers.length} ${list} for ${particleCount} particles, all of which have to be finite and 0 or more`);
  }
  for (const list of ['triangles', 'springs', 'pins'] as const) {
    const outside = body[list].find((index) => index < firstParticle || index >= firstParticle + particleCount);
    if (outside === undefined) continue;
    const last = Math.max(0, firstParticle + particleCount - 1);
    throw broken(`topology: ${list} of body '${name}' name particle ${outside}; allowed: ${firstParticle} to ${last}`);
  }
  return body;
}

const channels = (color: number): [number, number, number] => [(color >> 16) & 255, (color >> 8) & 255, color & 255];

/** Whether two topologies say the same. */
export function sameTopology(a: Topology, b: Topology): boolean {
  const text = (topology: Topology): string => JSON.stringify(plain(topology));
  const arrays = ({ bodies, colliders }: Topology): Numbers[] =>
    [...bodies.flatMap(({ triangles, springs, pins, uv, masses, volumes }) => [triangles, springs, pins, uv, masses, volumes]), ...colliders.flatMap(colliderArrays)];
  const others = arrays(b);
  // The texts say how many arrays there are, and how long each is.
  return text(a) === text(b) && arrays(a).every((array, i) => array.every((number, at) => number === others[i][at]));
}

type Numbers = Uint32Array | Float32Array | Uint8Array;
