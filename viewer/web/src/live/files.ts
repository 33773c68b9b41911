// A scene of one's own among files: which of them is the scene, and which are the meshes that it names.
//
// Enters: files by their paths within what was given, the text of the scene. Leaves: files to send, or the one that is
// refused, by its name, and why. Nothing is read here: sizes are known before.

import type { MeshFormat } from '../../../../client/typescript/src/index.ts';

/** A file that was chosen or dropped; its path is that within the folder that was dropped, with / between names. */
export interface Given {
  path: string;
  file: File;
}

/** What is to be sent for a mesh of a scene. */
export interface MeshParts {
  format: MeshFormat;
  /** Its file; of a set of the MecaSim course, points.eti. */
  data: File;
  /** The other files of a set, where there are such. */
  others: Partial<Record<'faceset' | 'masses' | 'texcoord', File>>;
  /** Whether gzip has packed it. */
  isPacked: boolean;
}

/** A file that is not taken. */
export class Refused extends Error {
  constructor(readonly file: string, readonly why: string, readonly remedy: string) {
    super(`${file}: ${why}`);
  }
}

const ONE_FILE = ['obj', 'off', 'ply', 'stl'] as const;
const OTHERS = ['faceset', 'masses', 'texcoord'] as const;
/** Names of files that a sentence lists, at most. */
const LISTED = 5;

/** The only scene among the files. */
export function sceneAmong(given: readonly Given[]): Given {
  const scenes = given.filter(({ path }) => /\.toml$/i.test(path));
  if (scenes.length === 1) return scenes[0];
  const found = listed(scenes.length === 0 ? given : scenes);
  if (scenes.length > 1) throw new Refused(found, 'these are several scenes', 'Give one of them, with the mesh files that it names.');
  throw new Refused(found, given.length === 1 ? 'it is no scene' : 'none of them is a scene', 'A scene is a text file whose name ends in .toml. Give its mesh files together with it.');
}

/** Refuses a file of more bytes than the server takes, before it is read. */
export function checkSize(name: string, bytes: number, most: number, what: string): void {
  if (bytes <= most) return;
  const shown = (count: number): string => count.toLocaleString('en');
  throw new Refused(name, `it has ${shown(bytes)} bytes, and ${what} of this server has at most ${shown(most)}`, 'Give a smaller file, or start the server with a higher limit.');
}

/** `file = "figure.obj"`; texts and comments, in which the same may stand, are stepped over. */
const MESH = /(?<![\w-])file[ \t]*=[ \t]*(?:"([^"\\\n]+)"|'([^'\n]+)')|"{3}[^]*?"{3}|'{3}[^]*?'{3}|"(?:\\.|[^"\\\n])*"|'[^'\n]*'|#[^\n]*/g;

/** The mesh files that a scene names, each once. */
export function meshPaths(text: string): string[] {
  return [...new Set([...text.matchAll(MESH)].map(([, double, single]) => double ?? single).filter((path) => path !== undefined))];
}

/** The text with the ids of uploads in place of files. Lines stay where they are. */
export function withUploads(text: string, ids: ReadonlyMap<string, string>): string {
  return text.replace(MESH, (whole: string, double?: string, single?: string) => {
    const id = ids.get(double ?? single ?? '');
    return id === undefined ? whole : `upload = "${id}"`;
  });
}

/** Finds the files of meshes among those that were given beside a scene. */
export class Meshes {
  /** Files that were chosen have no folders: they are known by their names alone, each by one path. */
  private readonly isFlat: boolean;
  private readonly taken = new Map<string, string>();

  constructor(private readonly scene: Given, private readonly given: readonly Given[]) {
    this.isFlat = given.every(({ path }) => !path.includes('/'));
  }

  /** The files of the mesh that a scene names by this path. */
  of(mesh: string): MeshParts {
    const path = this.within(mesh);
    const name = path.slice(path.lastIndexOf('/') + 1);
    const packed = /\.gz$/i.test(name);
    const ending = /\.([^.]+)$/.exec(packed ? name.slice(0, -3) : name)?.[1].toLowerCase() ?? '';
    const format = ONE_FILE.find((known) => known === ending);
    if (format !== undefined) return { format, data: this.needed(mesh, path), others: {}, isPacked: packed };
    if (packed || (ending !== '' && ending !== 'eti')) {
      throw new Refused(mesh, `its ending is none of a mesh that is read`, 'Meshes are read from .obj, .off, .ply and .stl, also as .obj.gz and so on, and from folders of .eti files.');
    }
    const folder = ending === 'eti' ? path.slice(0, path.length - name.length) : `${path}/`;
    const others: MeshParts['others'] = {};
    for (const part of OTHERS) {
      const file = this.find(`${folder}${part}.eti`);
      if (file !== null) others[part] = file;
    }
    return { format: 'eti', data: this.needed(mesh, `${folder}points.eti`), others, isPacked: false };
  }

  private needed(mesh: string, path: string): File {
    const file = this.find(path);
    if (file !== null) return file;
    const remedy = 'Choose the scene and its mesh files together, or drop the folder that holds them.';
    throw new Refused(this.scene.path, `it names the mesh ${mesh}, and ${path} is not among the files that were given`, remedy);
  }

  private find(path: string): File | null {
    const key = this.isFlat ? path.slice(path.lastIndexOf('/') + 1) : path;
    const found = this.given.find((one) => one.path === key);
    if (found === undefined || (this.taken.get(key) ?? path) !== path) return null;
    this.taken.set(key, path);
    return found.file;
  }

  /** The path of a mesh within what was given. */
  private within(mesh: string): string {
    const parts: string[] = [];
    let leaves = /^(?:[/\\]|[A-Za-z]:)/.test(mesh);
    for (const part of mesh.split('/')) {
      if (part === '..') leaves ||= parts.pop() === undefined;
      else if (part !== '' && part !== '.') parts.push(part);
    }
    if (leaves) {
      const why = `it names the mesh ${mesh}, which is outside its folder`;
      throw new Refused(this.scene.path, why, 'A page sees only files that it was given: put the mesh beside the scene, and name it from there.');
    }
    return this.scene.path.slice(0, this.scene.path.lastIndexOf('/') + 1) + parts.join('/');
  }
}

function listed(given: readonly Given[]): string {
  const names = given.slice(0, LISTED).map(({ path }) => path);
  return names.join(', ') + (given.length > LISTED ? ` and ${given.length - LISTED} more` : '');
}
