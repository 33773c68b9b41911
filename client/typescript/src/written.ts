// What a server tells, as JSON: for 64 bits and for arrays JSON has no form.
//
// Enters: a value. Leaves: the same, which JSON.stringify writes.

/** Lets JSON.stringify write a value: bigints as texts of their digits, typed arrays as their lengths. */
export function writable<T>(value: T): T {
  Object.defineProperty(value, 'toJSON', { value: () => plain(value), configurable: true, writable: true });
  return value;
}

/** A value that JSON.stringify writes. */
export function plain(value: unknown): unknown {
  if (typeof value === 'bigint') return value.toString();
  if (ArrayBuffer.isView(value)) return (value as Uint8Array).length;
  if (Array.isArray(value)) return value.map(plain);
  if (typeof value !== 'object' || value === null) return value;
  // What begins with $ is of the library for messages.
  return Object.fromEntries(Object.entries(value).filter(([key]) => !key.startsWith('$')).map(([key, own]) => [key, plain(own)]));
}
