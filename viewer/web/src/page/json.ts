// Values of JSON that are not trusted: each is what it should be, or an error names it.

import type { Vector } from '../scene.ts';

/** What a file holds is not what its format says. */
export class FormatError extends Error {}

export type Fields = Record<string, unknown>;

export function fields(value: unknown, name: string): Fields {
  if (typeof value !== 'object' || value === null || Array.isArray(value)) throw new FormatError(`${name} is no object`);
  return value as Fields;
}

export function list(value: unknown, name: string): unknown[] {
  if (!Array.isArray(value)) throw new FormatError(`${name} is no list`);
  return value;
}

export function text(value: unknown, name: string): string {
  if (typeof value !== 'string') throw new FormatError(`${name} is no text`);
  return value;
}

export function number(value: unknown, name: string): number {
  if (typeof value !== 'number' || !Number.isFinite(value)) throw new FormatError(`${name} is no number`);
  return value;
}

export function positive(value: unknown, name: string): number {
  const positive = number(value, name);
  if (positive <= 0) throw new FormatError(`${name} is ${positive}, not above 0`);
  return positive;
}

/** A whole number from 0 to `most`. */
export function whole(value: unknown, name: string, most = Number.MAX_SAFE_INTEGER): number {
  const whole = number(value, name);
  if (!Number.isInteger(whole) || whole < 0 || whole > most) {
    throw new FormatError(`${name} is ${whole}, no whole number from 0 to ${most}`);
  }
  return whole;
}

export function vector(value: unknown, name: string): Vector {
  const parts = list(value, name);
  if (parts.length !== 3) throw new FormatError(`${name} has ${parts.length} components, not 3`);
  return [number(parts[0], name), number(parts[1], name), number(parts[2], name)];
}

/** What `read` makes of a value; null for null, and for what is not there. */
export function optional<T>(value: unknown, read: (value: unknown) => T): T | null {
  return value === null || value === undefined ? null : read(value);
}

/** The bytes of base64. */
export function bytes(value: unknown, name: string): Uint8Array<ArrayBuffer> {
  const digits = text(value, name);
  const native = Uint8Array as unknown as { fromBase64?: (digits: string) => Uint8Array<ArrayBuffer> };
  try {
    if (native.fromBase64 !== undefined) return native.fromBase64(digits);
    const binary = atob(digits);
    const all = new Uint8Array(binary.length);
    for (let i = 0; i < binary.length; i++) all[i] = binary.charCodeAt(i);
    return all;
  } catch {
    throw new FormatError(`${name} is no base64`);
  }
}
