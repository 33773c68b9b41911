// What sliders change: gravity, wind, drag, springs; the scale of each; what was changed, so that it can be taken back.
//
// Enters: parameters as the server tells them, places of sliders. Leaves: values, changes.

import type { Changes, Parameters } from '../../../../client/typescript/src/index.ts';
import { capital } from './words.ts';

/** Places of a slider, from 0 on. */
export const PLACES = 1_000;
/** Decades on either side of the value that a slider on a logarithm begins with. */
const DECADES = 3;
/** Components of gravity (m/s²) and of the wind (m/s) go at least so far on either side of 0. */
const FARTHEST = 20;
/** Middles of the scales of what begins at 0: drag and damping (N s/m), stiffness (N/m). */
const MIDDLES = { drag: 1e-4, damping: 1e-2, stiffness: 10 };
const AXES = ['x', 'y', 'z'] as const;
/** Words for kinds of springs, by their numbers in the contract. */
const KINDS: Readonly<Record<number, string>> = { 1: 'stretch', 2: 'shear', 3: 'bend' };

/** From `-most` to `most`; or 0, and then a logarithm. */
export type Scale = { most: number } | { low: number; high: number };

/** A kind of springs, as the contract numbers it. */
type Springs = Parameters['cloths'][number]['springs'][number]['kind'];

/** What a slider changes. */
export type Part =
  | { kind: 'gravity' | 'wind'; axis: number }
  | { kind: 'drag' }
  | { kind: 'stiffness' | 'damping'; body: string; springs: Springs };

export interface Knob {
  /** No other has it. */
  key: string;
  part: Part;
  label: string;
  unit: string;
  /** Null where it is not one number: springs or bodies differ, and one value for all of them could not be taken back. */
  value: number | null;
  scale: Scale;
}

/** The sliders of a session, in the order in which they are shown. */
export function knobsOf({ gravity, wind, cloths }: Parameters): Knob[] {
  const vectors = [['gravity', 'm/s²', gravity], ['wind', 'm/s', wind]] as const;
  const knobs = vectors.flatMap(([kind, unit, vector]) => AXES.map((axis, index) =>
    knob({ kind, axis: index }, `${kind} ${index}`, `${capital(kind)} ${axis}`, unit, vector?.[axis] ?? 0)));
  const drags = cloths.map(({ drag }) => drag);
  if (drags.length > 0) knobs.push(knob({ kind: 'drag' }, 'drag', 'Drag', 'N s/m', same(Math.min(...drags), Math.max(...drags))));
  for (const { body, springs } of cloths) {
    for (const { kind, minStiffness, maxStiffness, minDamping, maxDamping } of springs) {
      const of = `${body}, ${KINDS[kind] ?? kind}`;
      knobs.push(
        knob({ kind: 'stiffness', body, springs: kind }, `stiffness ${kind} ${body}`, `${of}: stiffness`, 'N/m', same(minStiffness, maxStiffness)),
        knob({ kind: 'damping', body, springs: kind }, `damping ${kind} ${body}`, `${of}: damping`, 'N s/m', same(minDamping, maxDamping)),
      );
    }
  }
  return knobs;
}

const same = (low: number, high: number): number | null => (low === high ? low : null);

function knob(part: Part, key: string, label: string, unit: string, value: number | null): Knob {
  return { key, part, label, unit, value, scale: scaleOf(part, value ?? 0) };
}

/** The scale of what begins with a value. */
function scaleOf({ kind }: Part, value: number): Scale {
  if (kind === 'gravity' || kind === 'wind') return { most: Math.max(FARTHEST, 2 * Math.abs(value)) };
  const middle = value > 0 ? value : MIDDLES[kind];
  return { low: middle / 10 ** DECADES, high: middle * 10 ** DECADES };
}

/** The value at a place of a slider, of four digits. */
export function valueAt(scale: Scale, place: number): number {
  const at = Math.min(Math.max(place, 0), PLACES);
  if ('most' in scale) return Number((scale.most * ((2 * at) / PLACES - 1)).toPrecision(4));
  if (at === 0) return 0;
  return Number((scale.low * (scale.high / scale.low) ** ((at - 1) / (PLACES - 1))).toPrecision(4));
}

/** The place that is nearest to a value. */
export function placeOf(scale: Scale, value: number): number {
  const place = 'most' in scale
    ? 0.5 * PLACES * (1 + value / scale.most)
    : value <= 0 ? 0 : Math.max(1, 1 + ((PLACES - 1) * Math.log(value / scale.low)) / Math.log(scale.high / scale.low));
  return Math.min(Math.max(Math.round(place), 0), PLACES);
}

/** Changes that set what these knobs change; components of a vector go together, so that `valueOf` gives those of any key. */
export function changesOf(parts: readonly Part[], valueOf: (key: string) => number): Changes {
  const vector = (kind: string) => ({ x: valueOf(`${kind} 0`), y: valueOf(`${kind} 1`), z: valueOf(`${kind} 2`) });
  const has = (wanted: Part['kind']) => parts.some(({ kind }) => kind === wanted);
  const springs = parts.flatMap((part) => {
    if (!('body' in part)) return [];
    const amount = valueOf(`${part.kind} ${part.springs} ${part.body}`);
    return [{ body: part.body, kind: part.springs, ...(part.kind === 'stiffness' ? { stiffness: amount } : { damping: amount }) }];
  });
  return {
    ...(has('gravity') ? { gravity: vector('gravity') } : {}), ...(has('wind') ? { wind: vector('wind') } : {}),
    ...(has('drag') ? { drag: valueOf('drag') } : {}), springs,
  };
}

/** Where sliders stand: as the server tells, but for what was changed here and has not taken effect. */
export class Knobs {
  private told = new Map<string, Knob>();
  /** Scales stay as they were at first, so that a slider does not run away from the hand. */
  private readonly first = new Map<string, Knob>();
  /** What was changed here; `before` is the step before which it takes effect, null until the server says. */
  private readonly waiting = new Map<string, { value: number; before: bigint | null }>();
  private readonly done: { key: string; value: number }[] = [];

  /** Parameters after so many steps. */
  hear(parameters: Parameters, step: bigint): void {
    this.told = new Map(knobsOf(parameters).map((knob) => [knob.key, knob]));
    for (const [key, knob] of this.told) if (!this.first.has(key)) this.first.set(key, knob);
    for (const [key, { before }] of this.waiting) if (before !== null && step > before) this.waiting.delete(key);
  }

  /** As they were when the first parameters came. */
  get all(): Knob[] {
    return [...this.first.values()];
  }

  /** Null where it is not one number. */
  value(key: string): number | null {
    return this.waiting.get(key)?.value ?? this.told.get(key)?.value ?? null;
  }

  /** Keeps the value of now, so that `back` gives it again. */
  keep(key: string): void {
    const value = this.value(key);
    if (value !== null) this.done.push({ key, value });
  }

  set(key: string, value: number): void {
    this.waiting.set(key, { value, before: null });
  }

  /** The changes of these keys, as they stand. */
  changes(keys: readonly string[]): Changes {
    return changesOf(keys.flatMap((key) => this.first.get(key)?.part ?? []), (key) => this.value(key) ?? 0);
  }

  /** A value takes effect before a step, unless another one was set meanwhile. */
  answered(key: string, value: number, before: bigint): void {
    if (this.waiting.get(key)?.value === value) this.waiting.set(key, { value, before });
  }

  /** What was set was refused: what the server tells holds again. */
  refused(key: string): void {
    this.waiting.delete(key);
  }

  /** Sets what was changed last as it was before: its key; null if nothing is left. */
  back(): string | null {
    const last = this.done.pop();
    if (last === undefined) return null;
    this.set(last.key, last.value);
    return last.key;
  }

  /** Sets all as they were at first: the keys of those that were not. */
  backToStart(): string[] {
    const others = this.all.filter(({ key, value }) => value !== null && this.value(key) !== null && this.value(key) !== value);
    for (const { key, value } of others) {
      this.keep(key);
      this.set(key, value!);
    }
    return others.map(({ key }) => key);
  }
}
