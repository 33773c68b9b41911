// Arguments, checked before anything is sent, and put into the shape that the contract has.
//
// Enters: what a caller gives. Leaves: values, or an error that names the argument and says what is allowed.

import { ScalarType, type DescField, type DescMessage } from '@bufbuild/protobuf';
import { refused, type NappeError } from './errors.ts';

/** A whole number, in either of the two ways that there are. */
export type Whole = number | bigint;

/** What a caller may give in place of a message: any of its fields, numbers in either way, bytes as any typed array. */
export type Given<T> =
  T extends bigint ? Whole :
  T extends number ? T | bigint :
  T extends Uint8Array ? ArrayBufferView :
  T extends readonly (infer U)[] ? readonly Given<U>[] :
  T extends object ? { readonly [P in keyof T as P extends `$${string}` ? never : P]?: Given<T[P]> } :
  T;

const MAX_UINT32 = 2n ** 32n - 1n;
const MAX_UINT64 = 2n ** 64n - 1n;
/** Longest text that a message repeats. */
const SHOWN = 60;

/** A whole number of at most 64 bits. */
export function whole(value: unknown, name: string, least = 0n, most = MAX_UINT64): bigint {
  const found = typeof value === 'bigint' ? value : Number.isSafeInteger(value) ? BigInt(value as number) : null;
  if (found !== null && found >= least && found <= most) return found;
  const isInexact = found === null && Number.isInteger(value);
  throw wrong(value, name, `whole numbers from ${least}${most === MAX_UINT64 ? '' : ` to ${most}`}${isInexact ? ', those above 2^53 as a bigint' : ''}`);
}

/** A finite number. */
export function real(value: unknown, name: string, least = -Infinity): number {
  const found = typeof value === 'bigint' ? Number(value) : value;
  if (typeof found === 'number' && Number.isFinite(found) && found >= least) return found;
  throw wrong(value, name, `finite numbers${least === -Infinity ? '' : ` from ${least}`}`);
}

export function flag(value: unknown, name: string): boolean {
  if (typeof value === 'boolean') return value;
  throw wrong(value, name, 'true or false');
}

export function text(value: unknown, name: string): string {
  if (typeof value === 'string') return value;
  throw wrong(value, name, 'a text');
}

/** One of these words. */
export function word<T extends string>(value: unknown, name: string, words: readonly T[]): T {
  const found = words.find((known) => known === value);
  if (found !== undefined) return found;
  throw wrong(value, name, words.map((known) => `'${known}'`).join(', '));
}

export function callable(value: unknown, name: string): void {
  if (typeof value !== 'function') throw wrong(value, name, 'a function');
}

export function list(value: unknown, name: string): readonly unknown[] {
  if (Array.isArray(value)) return value;
  throw wrong(value, name, 'an array');
}

/** What ends a call: absent, or a signal. */
export function checkSignal(value: unknown): void {
  const isSignal = typeof value === 'object' && value !== null && 'aborted' in value && 'addEventListener' in value;
  if (value !== undefined && !isSignal) throw wrong(value, 'signal', 'an AbortSignal');
}

/** An object with no other keys than these. */
export function record(value: unknown, name: string, keys: readonly string[]): Record<string, unknown> {
  if (typeof value !== 'object' || value === null || Array.isArray(value) || ArrayBuffer.isView(value)) throw wrong(value, name, 'an object');
  const unknown = Object.keys(value).find((key) => !keys.includes(key) && !key.startsWith('$'));
  if (unknown === undefined) return value as Record<string, unknown>;
  throw refused(`${name} has a key '${unknown}'; allowed: ${keys.join(', ')}`, within(name, unknown));
}

/** The names of the fields of a message, but for those that a caller does not give. */
export function fieldNames({ fields }: DescMessage, others: readonly string[] = []): string[] {
  return fields.map(({ localName }) => localName).filter((name) => !others.includes(name));
}

/** The fields of a message, from those of these names that a caller gives; `owner` is what they belong to. */
export function filled(schema: DescMessage, given: unknown, owner: string, names: readonly string[] = fieldNames(schema)): Record<string, unknown> {
  const found: Record<string, unknown> = {};
  for (const [key, value] of Object.entries(record(given, owner, names))) {
    const field = schema.fields.find(({ localName }) => localName === key);
    if (field === undefined || value === undefined) continue;
    const name = within(owner, key);
    found[key] = field.fieldKind === 'list' ? list(value, name).map((item, i) => single(field, item, `${name}[${i}]`)) : single(field, value, name);
  }
  return found;
}

/** The name of what holds the arguments of a call, each of which has a name of its own. */
export const OPTIONS = 'options';

const within = (owner: string, key: string): string => (owner === OPTIONS ? key : `${owner}.${key}`);

/** A value of a field, or of its list. */
function single({ message, enum: words, scalar }: DescField, value: unknown, name: string): unknown {
  if (message !== undefined) return filled(message, value, name);
  if (words !== undefined) {
    const known = words.values.find(({ number }) => number === value || BigInt(number) === value);
    if (known !== undefined) return known.number;
    throw wrong(value, name, words.values.map(({ number, localName }) => `${number} (${localName})`).join(', '));
  }
  switch (scalar) {
    case ScalarType.STRING:
      return text(value, name);
    case ScalarType.BOOL:
      return flag(value, name);
    case ScalarType.BYTES:
      if (ArrayBuffer.isView(value)) return new Uint8Array(value.buffer, value.byteOffset, value.byteLength);
      throw wrong(value, name, 'a typed array');
    case ScalarType.DOUBLE:
    case ScalarType.FLOAT:
      return real(value, name);
    case ScalarType.UINT32:
    case ScalarType.FIXED32:
      return Number(whole(value, name, 0n, MAX_UINT32));
    default:
      return whole(value, name);
  }
}

/** The error of an argument that is not allowed. */
export function wrong(value: unknown, name: string, allowed: string): NappeError {
  return refused(`${name} is ${shown(value)}; allowed: ${allowed}`, name);
}

function shown(value: unknown): string {
  if (typeof value === 'string') return value.length > SHOWN ? `'${value.slice(0, SHOWN)}...'` : `'${value}'`;
  if (Array.isArray(value) || ArrayBuffer.isView(value)) return 'an array';
  if (typeof value === 'object' && value !== null) return 'an object';
  return typeof value === 'function' ? 'a function' : String(value);
}
