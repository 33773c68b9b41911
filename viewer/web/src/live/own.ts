// A new session of a scene of one's own: files that are chosen in the list, or dropped on any page.
//
// Enters: files of the browser. Leaves: the page of a session that plays, or a sentence that names the file that was
// refused.

import type { Client, Limits } from '../../../../client/typescript/src/index.ts';
import { admitted } from './access.ts';
import { element } from '../page/dom.ts';
import { type Given, type MeshParts, Meshes, Refused, checkSize, meshPaths, sceneAmong, withUploads } from './files.ts';
import { type Notice, pass, settle } from '../page/notice.ts';
import { notTaken, refusedFile, sending } from './words.ts';

/** Files of folders that are looked at, at most. */
const MOST_FILES = 2_000;
/** Simulated seconds per second of a new session, as the list of speeds has it at first. */
const SPEED = 1;

/** Takes files from now on. */
export function takeScenes(client: Client): void {
  const own = new OwnScenes(client);
  const input = element<HTMLInputElement>('files');
  input.addEventListener('change', () => {
    const chosen = [...(input.files ?? [])].map((file) => ({ path: file.name, file }));
    // The same files can be chosen again once they were changed.
    input.value = '';
    void own.take(() => Promise.resolve(chosen));
  });
  const mark = (isOver: boolean) => document.body.classList.toggle('dropping', isOver);
  addEventListener('dragover', (event) => {
    if (event.dataTransfer?.types.includes('Files') !== true) return;
    event.preventDefault();
    mark(true);
  });
  addEventListener('dragleave', (event) => {
    if (event.relatedTarget === null) mark(false);
  });
  addEventListener('drop', (event) => {
    mark(false);
    if (event.dataTransfer?.types.includes('Files') !== true) return;
    // Otherwise the browser would leave the page, and show the file.
    event.preventDefault();
    const dropped = [...event.dataTransfer.items].filter(({ kind }) => kind === 'file').map(itemOf);
    void own.take(() => filesOf(dropped));
  });
}

class OwnScenes {
  private isBusy = false;

  constructor(private readonly client: Client) {}

  /** Makes a session of files, and goes to its page. */
  async take(files: () => Promise<Given[]>): Promise<void> {
    // Whoever has not been let in yet makes no session.
    if (this.isBusy || !element('door').hidden) return;
    this.isBusy = true;
    let name = 'the scene';
    try {
      const given = await files();
      if (given.length === 0) return;
      const scene = sceneAmong(given);
      name = scene.path;
      const { limits } = await admitted(this.client, () => this.client.info());
      const text = await this.sceneText(scene, limits);
      const ids = new Map<string, string>();
      const meshes = new Meshes(scene, given);
      // All are found, and small enough, before the first is sent.
      const found = meshPaths(text).map((mesh) => [mesh, sized(mesh, meshes.of(mesh), limits)] as const);
      for (const [mesh, parts] of found) {
        name = mesh;
        say(sending(mesh));
        ids.set(mesh, await this.upload(mesh, parts, limits));
      }
      name = scene.path;
      say(sending(name));
      await this.open(withUploads(text, ids));
    } catch (error) {
      say(error instanceof Refused ? notTaken(error) : refusedFile(name, error));
    } finally {
      this.isBusy = false;
    }
  }

  private async sceneText({ path, file }: Given, limits: Limits | undefined): Promise<string> {
    checkSize(path, file.size, bound(limits?.maxSceneBytes), 'a scene');
    try {
      return new TextDecoder('utf-8', { fatal: true }).decode(await file.arrayBuffer());
    } catch (error) {
      // A file that cannot be read, such as one that was deleted, is told as the browser tells it.
      if (!(error instanceof TypeError)) throw error;
      throw new Refused(path, 'it is no text in UTF-8', 'Save it as UTF-8; a scene is a text.');
    }
  }

  private async upload(mesh: string, { format, data, others, isPacked }: MeshParts, limits: Limits | undefined): Promise<string> {
    const bytes = isPacked ? await unpacked(mesh, data, bound(limits?.maxMeshBytes)) : data;
    return (await this.client.uploadFile({ name: mesh.slice(mesh.lastIndexOf('/') + 1).slice(-64), format, data: bytes, ...others })).meshId;
  }

  /** Makes the session and lets it play; its page shows how it stands, whatever comes of that. */
  private async open(sceneText: string): Promise<void> {
    const session = await this.client.create({ sceneText });
    keep(session.sessionId, session.warnings);
    await this.client.play(session, { realTimeFactor: SPEED }).catch(() => undefined);
    settle();
    location.assign(`?${new URLSearchParams({ session: session.sessionId })}`);
  }
}

/** What a drop holds: its items are gone once the event is over, and what they stand for is not. */
type Dropped = FileSystemEntry | File | null;

const itemOf = (item: DataTransferItem): Dropped => item.webkitGetAsEntry() ?? item.getAsFile();

async function filesOf(dropped: readonly Dropped[]): Promise<Given[]> {
  const found: Given[] = [];
  for (const one of dropped) {
    if (one instanceof File) found.push({ path: one.name, file: one });
    else if (one !== null) await walk(one, found);
  }
  return found;
}

async function walk(entry: FileSystemEntry, found: Given[]): Promise<void> {
  if (entry.isFile) {
    const file = await new Promise<File>((resolve, reject) => (entry as FileSystemFileEntry).file(resolve, reject));
    found.push({ path: entry.fullPath.replace(/^\//, ''), file });
    return;
  }
  const reader = (entry as FileSystemDirectoryEntry).createReader();
  // A folder is told in parts; the last is empty.
  for (;;) {
    const some = await new Promise<FileSystemEntry[]>((resolve, reject) => reader.readEntries(resolve, reject));
    if (some.length === 0) return;
    for (const inner of some) {
      if (found.length >= MOST_FILES) throw new Refused(entry.fullPath.replace(/^\//, ''), `this folder holds more than ${MOST_FILES} files`, 'Drop the scene with its mesh files alone.');
      await walk(inner, found);
    }
  }
}

/** The limit that a server told; one that told none has none here, and refuses by itself. */
const bound = (limit: bigint | undefined): number => (limit === undefined ? Infinity : Number(limit));

function sized(mesh: string, parts: MeshParts, limits: Limits | undefined): MeshParts {
  const bytes = [parts.data, ...Object.values(parts.others)].reduce((sum, { size }) => sum + size, 0);
  checkSize(mesh, bytes, bound(limits?.maxMeshBytes), 'a mesh');
  return parts;
}

/** The bytes that gzip has packed; no more than `most` are unpacked. */
async function unpacked(mesh: string, file: File, most: number): Promise<Blob> {
  const reader = file.stream().pipeThrough(new DecompressionStream('gzip')).getReader();
  const chunks: Uint8Array<ArrayBuffer>[] = [];
  let length = 0;
  for (;;) {
    const { value, done } = await reader.read().catch(() => {
      throw new Refused(mesh, 'it cannot be unpacked as gzip', 'It may be cut off: pack it again.');
    });
    if (done) return new Blob(chunks);
    length += value.length;
    if (length > most) void reader.cancel().catch(() => undefined);
    checkSize(mesh, length, most, 'a mesh');
    chunks.push(value as Uint8Array<ArrayBuffer>);
  }
}

/** Stands long enough to be read, or until it is closed. */
function say(notice: Notice): void {
  pass(notice.kind === 'news' ? notice : { ...notice, deeds: [{ label: 'Close', act: settle }] });
}

const keyOf = (id: string): string => `nappe warnings ${location.pathname} ${id}`;

/** What is odd about the scene is said on the page of its session, which is another one. */
function keep(id: string, warnings: readonly string[]): void {
  try {
    if (warnings.length > 0) sessionStorage.setItem(keyOf(id), JSON.stringify(warnings));
  } catch {
    // A browser that keeps nothing does not say it.
  }
}

/** What was found odd about the scene of a session that was made here; said once. */
export function keptWarnings(id: string): string[] {
  try {
    const kept = sessionStorage.getItem(keyOf(id));
    sessionStorage.removeItem(keyOf(id));
    return kept === null ? [] : (JSON.parse(kept) as string[]);
  } catch {
    return [];
  }
}
