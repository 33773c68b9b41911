// A recording in the page's own document: frames by their index, decoded block by block when they are asked for.
//
// Enters: a document with data elements, perhaps cut off. Leaves: the scene, what plots show, frames.

import { type Head, readHead } from './head.ts';
import { FormatError, type Fields, bytes, fields, list, number, optional, positive, text, whole } from '../page/json.ts';
import { addBase, inflate, restore, sum } from '../../../../client/typescript/src/packed.ts';
import { readPoses } from './poses.ts';
import { type Diagnostics, type Frame, type Range, isPoints } from '../scene.ts';

/** Decoded blocks that are kept: no more than so many, nor so many bytes beyond two. */
const KEPT_BLOCKS = 4;
const KEPT_BYTES = 400e6;
/** Frames that are looked at before the first picture, and particles of all frames up to which any may be. */
const SAMPLES = 12;
const FEW = 10e6;

/** What is known of a frame without decoding it. */
export interface FrameFacts extends Diagnostics {
  /** Number of the frame in its session. */
  frame: number;
  /** Steps taken. */
  step: number;
  /** Each coordinate is within this of what was computed (m). */
  bound: number;
}

/** Why a session failed. */
export interface Failure {
  /** A stable word, such as NOT_FINITE. */
  reason: string;
  /** One sentence. */
  message: string;
  /** Whether the simulation diverged; otherwise something else went wrong. */
  diverged: boolean;
  /** Index of the step that was not taken, from 0. */
  step: number;
  /** Before that step (s). */
  time: number;
  /** Over all bodies; null if none is known. */
  particle: number | null;
}

export interface End {
  hash: string | null;
  finished: boolean;
  /** Null if it did not fail, or if the file is older than this page. */
  failure: Failure | null;
}

interface Block {
  element: Element;
  /** Index of its first frame in the recording. */
  first: number;
  count: number;
}

interface Decoded {
  frames: Frame[] | null;
  promise: Promise<Frame[]>;
}

export class Recording {
  private readonly decoded = new Map<Block, Decoded>();
  /** Block of each frame. */
  private readonly blockOf: Block[];

  private constructor(
    readonly head: Head,
    private readonly blocks: Block[],
    readonly facts: FrameFacts[],
    /** Null if the file was cut off. */
    readonly end: End | null,
  ) {
    this.blockOf = blocks.flatMap((block) => new Array<Block>(block.count).fill(block));
  }

  /** Reads all but the arrays of frames. */
  static async open(document: Document): Promise<Recording> {
    const headJson = json(document.querySelector('script.nappe-head'));
    if (headJson === undefined) {
      throw new FormatError('it has no head: it was cut off before the first frame, or is the page alone');
    }
    const head = await readHead(headJson);

    const blocks: Block[] = [];
    const facts: FrameFacts[] = [];
    for (const element of document.querySelectorAll('script.nappe-block')) {
      const block = json(element);
      // The rest of a file that was cut off.
      if (block === undefined) break;
      const found = readFacts(fields(block, 'a block'));
      blocks.push({ element, first: facts.length, count: found.length });
      facts.push(...found);
    }
    makeTimesIncrease(facts, head.dt);

    const end = optional(json(document.querySelector('script.nappe-end')), (json) => readEnd(json, head.scene.particleCount));
    return new Recording(head, blocks, facts, end);
  }

  get frameCount(): number {
    return this.facts.length;
  }

  get blockCount(): number {
    return this.blocks.length;
  }

  /** The frame, if it is decoded already. */
  ready(index: number): Frame | null {
    const block = this.blockOf[index];
    return this.decoded.get(block)?.frames?.[index - block.first] ?? null;
  }

  async frame(index: number): Promise<Frame> {
    const block = this.blockOf[index];
    const frames = await this.decode(block);
    return frames[index - block.first];
  }

  /**
   * Frames that show how far the motion goes: some of all frames if these are few, else the first of some blocks, which
   * need no other frame. What cannot be read is left out; it is reported when it is shown.
   */
  async *samples(): AsyncGenerator<Frame> {
    const few = this.blocks.length <= KEPT_BLOCKS && this.frameCount * this.head.scene.particleCount <= FEW;
    const sources = few ? [...this.facts.keys()] : this.blocks;
    const stride = Math.ceil(sources.length / SAMPLES);
    for (let at = 0; at < sources.length + stride - 1; at += stride) {
      const source = sources[Math.min(at, sources.length - 1)];
      try {
        yield typeof source === 'number' ? await this.frame(source) : (await decode(source, this.head, 1))[0];
      } catch {
        continue;
      }
    }
  }

  /** Decodes the block after that of a frame, ahead of its use. What fails here is reported when it is asked for. */
  prefetchAfter(index: number): void {
    const block = this.blockOf[index];
    const next = this.blockOf[block.first + block.count];
    if (next !== undefined && !this.decoded.has(next)) this.decode(next).catch(() => undefined);
  }

  /** Decodes every block anew, and keeps none: the seconds that it takes, and the bytes of positions in binary32. */
  async measure(): Promise<{ seconds: number; bytes: number }> {
    const since = performance.now();
    for (const block of this.blocks) await decode(block, this.head);
    const bytes = 12 * this.head.scene.particleCount * this.frameCount;
    return { seconds: (performance.now() - since) / 1e3, bytes };
  }

  /** Least and largest scalar of bare points over all frames, which reads them block by block; null if there is none. */
  async scalarRange(): Promise<Range | null> {
    const bodies = this.head.scene.bodies.filter(isPoints);
    let [least, largest] = [Infinity, -Infinity];
    for (const block of bodies.length === 0 ? [] : this.blocks) {
      for (const scalars of await decodeScalars(block, this.head)) {
        for (const { firstParticle, particleCount } of bodies) {
          for (let i = firstParticle; i < firstParticle + particleCount; i++) {
            if (scalars[i] < least) least = scalars[i];
            if (scalars[i] > largest) largest = scalars[i];
          }
        }
      }
    }
    return least <= largest ? [least, largest] : null;
  }

  private decode(block: Block): Promise<Frame[]> {
    const known = this.decoded.get(block);
    if (known !== undefined) {
      // Blocks stand in the order of their use.
      this.decoded.delete(block);
      this.decoded.set(block, known);
      return known.promise;
    }

    const entry: Decoded = { frames: null, promise: decode(block, this.head) };
    this.decoded.set(block, entry);
    this.forget();
    entry.promise.then((frames) => (entry.frames = frames)).catch(() => this.decoded.delete(block));
    return entry.promise;
  }

  /** Drops the blocks that were used least recently. */
  private forget(): void {
    const bytesOf = (block: Block) => 12 * block.count * this.head.scene.particleCount;
    const bytes = () => [...this.decoded.keys()].reduce((total, block) => total + bytesOf(block), 0);
    while (this.decoded.size > KEPT_BLOCKS || (this.decoded.size > 2 && bytes() > KEPT_BYTES)) {
      const [oldest] = this.decoded.keys();
      this.decoded.delete(oldest);
    }
  }
}

/** Index of the last frame that is not later than a time (s); 0 before the first. */
export function frameAt(facts: readonly Diagnostics[], time: number): number {
  let low = 0;
  let high = facts.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (facts[middle].time <= time) low = middle;
    else high = middle - 1;
  }
  return low;
}

/** What an element holds; undefined if there is none, or no whole JSON in it. */
function json(element: Element | null): unknown {
  try {
    return element === null ? undefined : JSON.parse(element.textContent ?? '');
  } catch {
    return undefined;
  }
}

function readFacts(block: Fields): FrameFacts[] {
  const bound = 0.5 * positive(block['step'], 'step of a block');
  return list(block['frames'], 'frames of a block').map((json, index) => {
    const frame = fields(json, `frame ${index} of a block`);
    const value = (field: string) => optional(frame[field], (value) => number(value, field));
    return {
      frame: whole(frame['frame'], 'number of a frame'),
      step: whole(frame['step'], 'step of a frame'),
      time: number(frame['time'], 'time of a frame'),
      bound,
      kinetic: value('kinetic'),
      elastic: value('elastic'),
      gravitational: value('gravitational'),
      stretch: value('stretch'),
      dt: value('dt'),
    };
  });
}

/** Playing and plots need times that increase: a frame that does not come later is put one step later. */
function makeTimesIncrease(facts: FrameFacts[], dt: number): void {
  const least = dt > 0 ? dt : 1e-3;
  for (let i = 1; i < facts.length; i++) {
    if (facts[i].time <= facts[i - 1].time) facts[i].time = facts[i - 1].time + least;
  }
}

function readEnd(json: unknown, particles: number): End {
  const end = fields(json, 'the end');
  return {
    hash: optional(end['hash'], (hash) => text(hash, 'hash')),
    finished: end['finished'] === true,
    failure: optional(end['failure'], (failure) => readFailure(failure, particles)),
  };
}

function readFailure(json: unknown, particles: number): Failure {
  const failure = fields(json, 'the failure');
  return {
    reason: text(failure['reason'], 'reason of the failure'),
    message: text(failure['message'], 'message of the failure'),
    diverged: failure['diverged'] === true,
    step: whole(failure['step'], 'step of the failure'),
    time: number(failure['time'], 'time of the failure'),
    particle: optional(failure['particle'], (value) => whole(value, 'particle of the failure', particles - 1)),
  };
}

/** The first frames of a block, or all: inflated side by side, then summed one after another. */
async function decode(block: Block, head: Head, most = Infinity): Promise<Frame[]> {
  const parsed = fields(json(block.element), 'a block');
  const step = positive(parsed['step'], 'step of a block');
  const scalarStep = optional(parsed['scalar_step'], (value) => positive(value, 'scalar_step of a block'));
  const particles = head.scene.particleCount;
  const shapes = { positions: { particles, components: 3 }, scalar: { particles, components: 1 } };

  const inflated = list(parsed['frames'], 'frames of a block').slice(0, most).map((json, index) => {
    const frame = fields(json, `frame ${index} of a block`);
    const positions = inflate(bytes(frame['positions'], 'positions'), shapes.positions);
    const scalar = optional(frame['scalar'], (data) => inflate(bytes(data, 'scalar'), shapes.scalar));
    // Each is awaited below, but not before those ahead of it.
    positions.catch(() => undefined);
    scalar?.catch(() => undefined);
    return { positions, scalar, time: number(frame['time'], 'time of a frame'), poses: readPoses(frame['poses']) };
  });

  const frames: Frame[] = [];
  let numbers: Int32Array | null = null;
  let scalars: Int32Array | null = null;
  for (const { positions, scalar, time, poses } of inflated) {
    numbers = added(sum(await positions, shapes.positions), numbers);
    scalars = scalar === null ? null : added(sum(await scalar, shapes.scalar), scalars);
    const shown = scalars !== null && scalarStep !== null ? restore(scalars, scalarStep) : null;
    frames.push({ time, numbers, step, scalar: shown, poses });
  }
  return frames;
}

/** The scalars alone of all frames of a block that have any. */
async function decodeScalars(block: Block, head: Head): Promise<Float32Array[]> {
  const parsed = fields(json(block.element), 'a block');
  const step = optional(parsed['scalar_step'], (value) => positive(value, 'scalar_step of a block'));
  const shape = { particles: head.scene.particleCount, components: 1 };
  const frames: Float32Array[] = [];
  let numbers: Int32Array | null = null;
  for (const frame of step === null ? [] : list(parsed['frames'], 'frames of a block')) {
    const data = fields(frame, 'a frame of a block')['scalar'];
    numbers = data === null || data === undefined ? null : added(sum(await inflate(bytes(data, 'scalar'), shape), shape), numbers);
    if (numbers !== null && step !== null) frames.push(restore(numbers, step));
  }
  return frames;
}

function added(numbers: Int32Array, base: Int32Array | null): Int32Array {
  if (base !== null) addBase(numbers, base);
  return numbers;
}
