// How a call ended: the status of gRPC, from headers or trailers, and the details that a nappe server puts into it.
//
// Enters: headers. Leaves: a status, which may be an error.

import { BinaryReader, WireType } from '@bufbuild/protobuf/wire';
import { Code, NappeError } from './errors.ts';

/** How a call ended. */
export interface Status {
  code: number;
  message: string;
  /** A google.rpc.Status, packed. */
  details: Uint8Array | null;
}

/** The status among headers; null where there is none. */
export function readStatus(header: (name: string) => string | null): Status | null {
  const code = header('grpc-status');
  if (code === null) return null;
  const details = header('grpc-status-details-bin');
  return {
    code: /^[0-9]{1,3}$/.test(code) ? Number(code) : Code.UNKNOWN,
    message: percentDecoded(header('grpc-message') ?? ''),
    details: details === null ? null : base64Decoded(details),
  };
}

/** The headers in the last message of a body: lines of a name, a colon and a value. */
export function readTrailers(bytes: Uint8Array): (name: string) => string | null {
  const found = new Map<string, string>();
  for (const line of new TextDecoder().decode(bytes).split('\r\n')) {
    const colon = line.indexOf(':');
    if (colon > 0) found.set(line.slice(0, colon).trim().toLowerCase(), line.slice(colon + 1).trim());
  }
  return (name) => found.get(name) ?? null;
}

/** The error of a call that ended with a status other than OK; `address` is where it went. */
export function statusError({ code, message, details }: Status, address: string, method: string): NappeError {
  const info = details === null ? null : errorInfo(details);
  if (info !== null) return new NappeError(code, message || info.reason, info);
  if (code === Code.UNIMPLEMENTED) {
    return new NappeError(code, `what answers at ${address} is no server of nappe, or an older one: ${message || method}`);
  }
  return new NappeError(code, message || `${method} ended with ${Code[code] ?? code}`);
}

function percentDecoded(text: string): string {
  try {
    return decodeURIComponent(text);
  } catch {
    return text;
  }
}

function base64Decoded(text: string): Uint8Array | null {
  try {
    return Uint8Array.from(atob(text), (character) => character.charCodeAt(0));
  } catch {
    return null; // not of a nappe server
  }
}

/** The google.rpc.ErrorInfo in the details of a google.rpc.Status; null if there is none. */
function errorInfo(details: Uint8Array): { reason: string; metadata: Record<string, string> } | null {
  try {
    // Status.details is field 3, a list of google.protobuf.Any with a type (1) and bytes (2).
    for (const any of fields(details).filter(([number]) => number === 3).map(([, bytes]) => fields(bytes))) {
      if (text(any, 1).endsWith('/google.rpc.ErrorInfo')) return readInfo(fields(last(any, 2)));
    }
  } catch {
    // Bytes that are no message are no details.
  }
  return null;
}

type Fields = [number: number, bytes: Uint8Array][];

/** Reason is field 1, metadata are entries with a key (1) and a value (2) in field 3. */
function readInfo(info: Fields): { reason: string; metadata: Record<string, string> } | null {
  const entries = info.filter(([number]) => number === 3).map(([, bytes]) => fields(bytes));
  const metadata = Object.fromEntries(entries.map((entry) => [text(entry, 1), text(entry, 2)] as const).sort());
  return text(info, 1) === '' ? null : { reason: text(info, 1), metadata };
}

/** The fields of a message that are bytes or texts; the others are passed over. */
function fields(message: Uint8Array): Fields {
  const reader = new BinaryReader(message);
  const found: Fields = [];
  while (reader.pos < reader.len) {
    const [number, type] = reader.tag();
    if (type === WireType.LengthDelimited) found.push([number, reader.bytes()]);
    else reader.skip(type, number);
  }
  return found;
}

function last(found: Fields, wanted: number): Uint8Array {
  return found.filter(([number]) => number === wanted).at(-1)?.[1] ?? new Uint8Array(0);
}

function text(found: Fields, wanted: number): string {
  return new TextDecoder().decode(last(found, wanted));
}
