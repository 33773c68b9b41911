// The upright axis of a plot: where a number stands on it, and what is written beside it.
//
// Enters: all numbers of a plot, from 1e-300 to 1e300 and 0. Leaves: places of ordinary size, for which a plot needs no care.

import { scientific } from '../page/numbers.ts';

/** Quantities of which the largest spans more decades than this are shown by their logarithms. */
const DECADES = 3;
/** The share of the numbers that may be smaller than where the span begins: one that starts from rest begins at 0. */
const SMALL_SHARE = 0.1;
/** Numbers so many times smaller than that are all drawn as nearly 0. */
const DEPTH = 1e3;
const MOST_TICKS = 5;
/** Room beyond the least and the largest number, over the length of the axis. */
const ROOM = 0.05;

export interface Tick {
  at: number;
  label: string;
}

export interface Axis {
  /** Where a number stands. */
  place(number: number): number;
  /** The least and the largest place that is shown. */
  range: [number, number];
  ticks: Tick[];
}

/** Whether the largest of some quantities, from one frame to another, spans so many decades that a logarithm shows more. */
export function isWide(quantities: readonly (readonly (number | null)[])[]): boolean {
  const [first = []] = quantities;
  const sizes = sortedSizes(first.map((_, frame) => Math.max(...quantities.map((numbers) => Math.abs(numbers[frame] ?? 0)))));
  return sizes.length > 0 && sizes[sizes.length - 1] / beginning(sizes) > 10 ** DECADES;
}

/** Equal differences are equally long. */
export function linear(numbers: readonly number[]): Axis {
  const largest = sortedSizes(numbers).pop() ?? 1;
  // A power of ten, by which the labels are multiplied again.
  const unit = 10 ** Math.max(Math.floor(Math.log10(largest)), -300);
  const place = (number: number) => number / unit;
  const range = lengthened(...ends(numbers.map(place)));
  const step = niceStep((range[1] - range[0]) / MOST_TICKS);
  const ticks: Tick[] = [];
  for (let index = Math.ceil(range[0] / step); index * step <= range[1]; index++) {
    const at = index * step;
    ticks.push({ at, label: label(at * unit, step * unit) });
  }
  return { place, range, ticks };
}

/** Equal ratios are equally long, on both sides of 0; around 0, equal differences are, and where numbers hardly differ. */
export function logarithmic(numbers: readonly number[]): Axis {
  const sizes = sortedSizes(numbers);
  const largest = sizes.length > 0 ? sizes[sizes.length - 1] : 1;
  const unit = sizes.length > 0 ? Math.max(sizes[0], beginning(sizes) / DEPTH) : 1;
  const place = (number: number) => Math.sign(number) * logarithm(Math.abs(number), unit);
  const [least, most] = ends(numbers.map(place));
  const room = ROOM * (most - least || 1);
  const range: [number, number] = [least - (least < 0 ? room : 0), most + room];
  const ticks = decades(unit, largest, place).filter(({ at }) => at >= range[0] && at <= range[1]);
  return ticks.length < 2 ? linear(numbers) : { place, range, ticks };
}

/** log10(1 + size / unit), also where the ratio is no number. */
function logarithm(size: number, unit: number): number {
  const decades = Math.log10(size) - Math.log10(unit);
  return decades > 15 ? decades : Math.log10(1 + 10 ** decades);
}

/** 0, and powers of ten on both sides of it; of few powers, what lies between them too. */
function decades(unit: number, largest: number, place: (number: number) => number): Tick[] {
  const [first, last] = [Math.ceil(Math.log10(unit)), Math.floor(Math.log10(largest))];
  const every = Math.max(1, Math.ceil((last - first) / (MOST_TICKS - 1)));
  const ticks: Tick[] = [{ at: 0, label: '0' }];
  for (let power = last; power >= first - 1; power -= every) {
    for (const times of last - first < 2 ? [1, 2, 5] : [1]) {
      const number = times * 10 ** power;
      const text = power < -3 || power > 3 ? `${times}e${power}` : String(Number(number.toPrecision(1)));
      if (number >= unit && number <= largest) ticks.push({ at: place(number), label: text }, { at: -place(number), label: `-${text}` });
    }
  }
  // What is too near to 0 would be written over it.
  const room = 0.07 * place(largest);
  return ticks.filter(({ at }) => at === 0 || Math.abs(at) > room).sort((a, b) => a.at - b.at);
}

/** Sizes of the numbers that are not 0, from the smallest on. */
function sortedSizes(numbers: readonly number[]): number[] {
  return numbers.map(Math.abs).filter((size) => size > 0 && Number.isFinite(size)).sort((a, b) => a - b);
}

function beginning(sizes: readonly number[]): number {
  return sizes[Math.floor(SMALL_SHARE * (sizes.length - 1))];
}

function ends(places: readonly number[]): [number, number] {
  let [least, most] = [Infinity, -Infinity];
  for (const place of places) {
    if (place < least) least = place;
    if (place > most) most = place;
  }
  return least <= most ? [least, most] : [0, 1];
}

/** With room on both sides, and with 0 if it is near. */
function lengthened(least: number, most: number): [number, number] {
  const length = most - least;
  // What does not change stands in the middle.
  if (length <= 1e-12 * Math.max(Math.abs(least), Math.abs(most))) {
    const half = Math.abs(most) / 2 || 1;
    return [least - half, most + half];
  }
  const room = ROOM * length;
  const from = least >= 0 && least < 0.4 * most ? 0 : least - room;
  const to = most <= 0 && most > 0.4 * least ? 0 : most + room;
  return [from, to];
}

/** 1, 2 or 5 times a power of ten, and no less than `least`. */
function niceStep(least: number): number {
  const power = 10 ** Math.floor(Math.log10(least));
  return [1, 2, 5, 10].map((times) => times * power).find((step) => step >= 0.999 * least) ?? 10 * power;
}

/** A number beside others that differ from it by a step, with the digits that tell them apart. */
function label(number: number, step: number): string {
  const size = Math.abs(number);
  if (size < 1e-9 * step || size === 0) return '0';
  const digits = -Math.floor(Math.log10(step) + 1e-9);
  if (size >= 1e5 || digits > 4) {
    return scientific(number, Math.min(Math.max(Math.floor(Math.log10(size) + 1e-9) + digits, 0), 6));
  }
  return number.toFixed(Math.max(digits, 0));
}
