// Mesh files to send, each as it is: a header, then its bytes in pieces, in calls of one message each.
//
// Enters: files. Leaves: headers and pieces, or an error that names the argument.

import { create, type MessageShape } from '@bufbuild/protobuf';
import { OPTIONS, real, record, text, word, wrong } from './checks.ts';
import { refused } from './errors.ts';
import { FileFormat, FileHeaderSchema } from './gen/nappe/v1/simulation_pb.ts';

/** Formats of mesh files that the server reads; `eti` is a set of the MecaSim course. */
export type MeshFormat = (typeof FORMATS)[number];
const FORMATS = ['obj', 'off', 'ply', 'stl', 'eti'] as const;

/** A mesh file to send. */
export interface MeshFile {
  /** Its name in messages. */
  name: string;
  format: MeshFormat;
  /** Its bytes; of a set, those of points.eti. A `File` of a page is a `Blob`, and is read piece by piece. */
  data: Blob | Uint8Array<ArrayBuffer>;
  /** Only of a set: its other files, where there are such. */
  faceset?: Blob | Uint8Array<ArrayBuffer>;
  masses?: Blob | Uint8Array<ArrayBuffer>;
  texcoord?: Blob | Uint8Array<ArrayBuffer>;
  /** Only of a set: the mass (kg) of points that masses.eti leaves out. Absent: such a set is refused. */
  missingMass?: number | bigint;
}

/** A mesh that the server keeps. */
export interface Uploaded {
  /** A scene names it as `mesh = { upload = "ID" }`. */
  meshId: string;
  /** What is odd about it but does not stop a simulation. */
  warnings: string[];
}

/** Largest piece of an upload (bytes). */
const PIECE_BYTES = 1 << 20;

const FILE = ['name', 'format', 'data', 'faceset', 'masses', 'texcoord', 'missingMass'];

/** What a file announces, and all its bytes. */
export function fileUpload(file: MeshFile): { header: MessageShape<typeof FileHeaderSchema>; bytes: Blob } {
  const { name, format, data, faceset, masses, texcoord, missingMass } = record(file, OPTIONS, FILE);
  const known = word(format, 'format', FORMATS);
  const parts = [bytesOf(data, 'data')];
  for (const [part, its] of Object.entries({ faceset, masses, texcoord })) {
    if (its !== undefined && known !== 'eti') throw refused(`${part} is a file of a set, and the format is '${known}'; allowed: no ${part}, or the format 'eti'`, part);
    parts.push(its === undefined ? new Blob([]) : bytesOf(its, part));
  }
  const [byteCount, facesetByteCount, massesByteCount, texcoordByteCount] = parts.map(({ size }) => BigInt(size));
  const header = create(FileHeaderSchema, {
    name: text(name, 'name'),
    format: { obj: FileFormat.OBJ, off: FileFormat.OFF, ply: FileFormat.PLY, stl: FileFormat.STL, eti: FileFormat.ETI }[known],
    byteCount, facesetByteCount, massesByteCount, texcoordByteCount,
    ...(missingMass === undefined ? {} : { missingMass: real(missingMass, 'missingMass', 0) }),
  });
  return { header, bytes: new Blob(parts) };
}

/** What the file of a session announces, and all its bytes. */
export function checkpointUpload(file: unknown): { header: MessageShape<typeof FileHeaderSchema>; bytes: Blob } {
  const bytes = bytesOf(file, 'checkpoint');
  return { header: create(FileHeaderSchema, { format: FileFormat.CHECKPOINT, byteCount: BigInt(bytes.size) }), bytes };
}

/** The bytes in pieces, each with the place where it begins; no more than one is in memory. */
export async function* pieces(bytes: Blob): AsyncGenerator<{ offset: bigint; data: Uint8Array<ArrayBuffer> }> {
  for (let at = 0; at < bytes.size; at += PIECE_BYTES) {
    const data = new Uint8Array(await bytes.slice(at, at + PIECE_BYTES).arrayBuffer());
    yield { offset: BigInt(at), data };
  }
}

function bytesOf(value: unknown, name: string): Blob {
  if (value instanceof Blob) return value;
  if (value instanceof Uint8Array) return new Blob([value as Uint8Array<ArrayBuffer>]);
  throw wrong(value, name, 'a Blob, such as a File, or a Uint8Array');
}
