// Numbers of particles to colours, and the legend that explains them.

import type { ColorBy, Range } from '../scene.ts';
import type { Theme } from '../page/theme.ts';

type Rgb = readonly [number, number, number];

/** Colours of bodies, in turn. */
export const PALETTE: readonly Rgb[] =
  [[205, 92, 76], [74, 144, 190], [226, 176, 84], [110, 168, 120], [160, 112, 180], [200, 200, 205]];
export const PIN_COLOR: Rgb = [250, 210, 70];
export const SOLID_COLOR: Rgb = [150, 158, 170];
export const SNOW_COLOR: Rgb = [238, 242, 249];

/** What the picture shows in each theme; the page's own colours are in its style. */
export const THEMES: Record<Theme, { ground: Rgb; grid: Rgb; wire: Rgb; snow: Rgb; /** Of snow: `Surface.setRim`. */ rim: number }> = {
  dark: { ground: [78, 83, 92], grid: [124, 131, 144], wire: [214, 226, 240], snow: SNOW_COLOR, rim: 0 },
  light: { ground: [190, 196, 205], grid: [146, 153, 165], wire: [34, 44, 60], snow: [228, 235, 246], rim: 0.5 },
};

/** J_P at which the colours end. */
const PACKED = 0.8;
const LOOSE = 1.5;
const WHITE: Rgb = [240, 244, 250];
const BLUE: Rgb = [38, 96, 190];
const AMBER: Rgb = [222, 150, 62];
/** Decades of stress from violet to yellow. */
const STRESS_DECADES = 3;
/** From small to large: dark violet to light yellow, in steps of equal lightness (viridis). */
const RAMP: readonly Rgb[] = [[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]];
/** The colour of numbers that are not finite. */
const NO_NUMBER: Rgb = [255, 0, 255];

/** A scale of colours in words: colours from left to right, and what stands below each. */
export interface Legend {
  title: string;
  colors: Rgb[];
  labels: string[];
}

/** The colours of a recording. Scales of speed and stress end at the largest seen so far. */
export class Coloring {
  private largest = -Infinity;

  constructor(private readonly by: ColorBy) {}

  /** Writes red, green, blue of each number into `colors`. */
  write(scalar: Float32Array, colors: Uint8Array): void {
    for (const number of scalar) {
      if (number > this.largest && Number.isFinite(number)) this.largest = number;
    }
    for (let i = 0; i < scalar.length; i++) {
      const rgb = this.color(scalar[i]);
      colors[3 * i] = rgb[0];
      colors[3 * i + 1] = rgb[1];
      colors[3 * i + 2] = rgb[2];
    }
  }

  /** The scale is that of these numbers, instead of those seen so far. */
  setScale([, largest]: Range): void {
    this.largest = largest;
  }

  private color(number: number): Rgb {
    if (!Number.isFinite(number)) return NO_NUMBER;
    switch (this.by) {
      case 'plastic_ratio':
        return packing(number);
      case 'stress':
        return ramp(1 + (number - this.largest) / STRESS_DECADES);
      case 'speed':
        return ramp(number / this.largest);
    }
  }

  legend(): Legend {
    switch (this.by) {
      case 'plastic_ratio':
        return {
          title: 'Snow: plastic ratio J_P',
          colors: [BLUE, WHITE, AMBER],
          labels: [`packed, ${PACKED}`, '1', `loose, ${LOOSE}`],
        };
      case 'stress': {
        const largest = Number.isFinite(this.largest) ? this.largest : 0;
        return {
          title: 'Stress (Pa), by its logarithm',
          colors: [...RAMP],
          labels: [short(10 ** (largest - STRESS_DECADES)), short(10 ** largest)],
        };
      }
      case 'speed':
        return { title: 'Speed (m/s)', colors: [...RAMP], labels: ['0', short(Math.max(this.largest, 0))] };
    }
  }
}

/** White at 1, blue below, amber above; linear in ln J_P on either side. */
function packing(ratio: number): Rgb {
  const logarithm = Math.log(Math.max(ratio, 1e-38));
  return logarithm < 0
    ? mix(WHITE, BLUE, logarithm / Math.log(PACKED))
    : mix(WHITE, AMBER, logarithm / Math.log(LOOSE));
}

/** From the first colour (0) to the last (1); what is no number counts as 0. */
function ramp(share: number): Rgb {
  const last = RAMP.length - 1;
  const at = Number.isNaN(share) ? 0 : Math.min(Math.max(share, 0), 1) * last;
  const step = Math.min(Math.floor(at), last - 1);
  return mix(RAMP[step], RAMP[step + 1], at - step);
}

function mix(from: Rgb, to: Rgb, share: number): Rgb {
  const part = Math.min(Math.max(share, 0), 1);
  const channel = (index: number) => Math.round(from[index] + part * (to[index] - from[index]));
  return [channel(0), channel(1), channel(2)];
}

export const css = ([red, green, blue]: Rgb): string => `rgb(${red} ${green} ${blue})`;

/** A number of three digits. */
function short(number: number): string {
  if (number === 0 || !Number.isFinite(number)) return '0';
  return number >= 1e4 || number < 1e-2 ? number.toExponential(1) : String(Number(number.toPrecision(3)));
}
