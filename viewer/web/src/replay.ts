// The page that replays a recording: what it is made of, and in which order it begins.

import { type Motion, bodyBounds, motionBounds, poseBounds } from './picture/camera.ts';
import { connect } from './recording/controls.ts';
import { element } from './page/dom.ts';
import { describe, showFacts } from './recording/facts.ts';
import type { Bounds } from './picture/geometry.ts';
import { FormatError } from './page/json.ts';
import { showLegend } from './picture/legend.ts';
import { Links } from './recording/links.ts';
import { PackedError } from '../../../client/typescript/src/packed.ts';
import { Player } from './recording/player.ts';
import { Plots } from './plots/plots.ts';
import { Recording, frameAt } from './recording/recording.ts';
import { csv, download, fileName } from './recording/save.ts';
import type { Frame, Pose } from './scene.ts';
import { Stage } from './picture/stage.ts';
import { Themes } from './page/theme.ts';
import { View } from './picture/view.ts';
import type { Picture } from './picture/viewing.ts';

/** What scripts and tests may use. */
interface Handles {
  /** The first frame is drawn, or the page says why there is none. */
  ready: Promise<void>;
  /** Resolves when the frame is drawn. */
  seek(index: number): Promise<void>;
  frameCount: number;
  /** Of the frames (s). */
  times: readonly number[];
  /** A frame as the button saves it, in the colours of the whole recording: an address that holds a PNG. */
  picture(index: number): Promise<string>;
  /** Positions of the shown frame (m). */
  positions(): Float32Array;
  litShare(): number;
  /** Share of the pixels that lines of the grid change, from so many directions. */
  gridShares(directions: number): number[];
  /** The picture without colliders: red, green, blue and coverage of each pixel, from rows at the bottom to those at the top. */
  bodyPixels(): Uint8Array;
  renderer: string;
  measure(): Promise<{ seconds: number; bytes: number }>;
}

/** Screens on which the plots would leave too little room for the picture. */
const NARROW = '(max-width: 800px), (max-height: 480px)';
const CALM = '(prefers-reduced-motion: reduce)';

function say(sentence: string): void {
  const message = element('message');
  message.hidden = sentence === '';
  message.textContent = sentence;
}

function reason(error: unknown): string {
  const known = error instanceof FormatError || error instanceof PackedError;
  return known || error instanceof Error ? error.message : String(error);
}

async function start(handles: Handles, themes: Themes): Promise<void> {
  if (typeof DecompressionStream === 'undefined') {
    return say('This browser cannot unpack the recording, since it has no DecompressionStream. Browsers since 2023 have it.');
  }
  let recording: Recording;
  try {
    recording = await Recording.open(document);
  } catch (error) {
    return say(`This file cannot be shown: ${reason(error)}.`);
  }

  describe(recording);
  handles.frameCount = recording.frameCount;
  handles.times = recording.facts.map(({ time }) => time);
  if (recording.frameCount === 0) return say('This recording holds no frame.');
  try {
    await run(recording, handles, themes);
  } catch (error) {
    say(`This recording cannot be shown: ${reason(error)}.`);
  }
}

async function run(recording: Recording, handles: Handles, themes: Themes): Promise<void> {
  const calm = matchMedia(CALM).matches;
  const picture = draw(recording, await recording.frame(0), await motion(recording), calm);
  const failed = (error: unknown) => say(`This part of the recording cannot be read: ${reason(error)}.`);

  const player: Player = new Player(source(recording), {
    show: (frame: Frame, index) => {
      picture?.view.show(frame);
      plots.show(index);
      showFacts(recording, index);
      showLegend(element('legend'), picture?.view.legend() ?? null);
      controls.show(index);
    },
    changed: () => {
      controls.playing(player.playing);
      links.note();
    },
    failed,
  });
  const seek = (index: number) => {
    player.pause();
    links.note();
    return player.seek(index);
  };
  const seekTime = (time: number) => void seek(nearest(recording, time)).catch(() => undefined);
  const plots = new Plots(element('plots'), recording.facts, seekTime);
  const links = new Links(element('canvas'), {
    read: () => ({ time: recording.facts[player.index].time, camera: picture?.view.camera() ?? null }),
    open: ({ time, camera }) => {
      picture?.view.lookFrom(camera);
      if (time !== null) seekTime(time);
    },
    isMoving: () => player.playing,
  });
  const controls = connect(player, picture, recording.frameCount, {
    toggleTheme: () => themes.toggle(),
    moved: () => links.note(),
    recolored: () => showLegend(element('legend'), picture?.view.legend() ?? null),
    ...saves(recording, player, picture),
  });
  showPlots(plots);
  themes.follow((theme) => {
    picture?.view.setTheme(theme);
    plots.redraw();
  });
  hand(handles, recording, picture, seek);
  element('controls').hidden = false;
  const linked = links.initial();
  if (linked.camera !== null) picture?.view.lookFrom(linked.camera);
  await player.seek(linked.time === null ? 0 : nearest(recording, linked.time));
  if (!calm && linked.time === null) player.play();
  if (picture === null) return;
  const scaled = setScale(recording, picture);
  scaled.catch(failed);
  handles.picture = async (index) => {
    await scaled;
    await seek(index);
    return address(await picture.stage.png(paper()));
  };
}

/** An address that holds a file. */
function address(file: Blob | null): Promise<string> {
  return new Promise((resolve, reject) => {
    if (file === null) return reject(new Error('the browser makes no PNG'));
    const reader = new FileReader();
    reader.onload = () => resolve(String(reader.result));
    reader.onerror = () => reject(new Error('the PNG cannot be read'));
    reader.readAsDataURL(file);
  });
}

/** The colour behind the picture. */
function paper(): string {
  return getComputedStyle(document.body).backgroundColor;
}

/** The picture of the first frame; null, and a message, if this browser draws none. */
function draw(recording: Recording, first: Frame, motion: Motion, calm: boolean): Picture | null {
  let stage: Stage;
  try {
    stage = new Stage(element<HTMLCanvasElement>('canvas'), element('stage'), !calm, (lost) =>
      say(lost ? 'The graphics were lost. The picture comes back when the browser has them again.' : ''));
  } catch {
    element('canvas').hidden = true;
    say('This browser cannot draw the recording, since WebGL 2 is missing or switched off. The plots show its numbers.');
    return null;
  }
  const { scene } = recording.head;
  // Frames may lack what the head says of their colours.
  const view = new View(stage, first.scalar === null ? { ...scene, colorBy: null } : scene, first, motion);
  const particle = recording.end?.failure?.particle ?? null;
  if (particle !== null) view.markParticle(particle);
  return { stage, view };
}

/** Where bodies and colliders are in the whole recording, which the view from the start holds. */
async function motion(recording: Recording): Promise<Motion> {
  const { scene } = recording.head;
  const all: Bounds[] = [];
  const poses: Pose[] = [];
  for await (const frame of recording.samples()) {
    all.push(bodyBounds(scene, frame));
    poses.push(...frame.poses);
  }
  const bodies = motionBounds(bodyBounds(scene, await recording.frame(0)), all);
  return { bodies, colliders: poseBounds(scene, bodies, poses) };
}

function source(recording: Recording) {
  return {
    frameCount: recording.frameCount,
    time: (index: number) => recording.facts[index].time,
    indexAt: (time: number) => frameAt(recording.facts, time),
    ready: (index: number) => recording.ready(index),
    frame: (index: number) => recording.frame(index),
    prefetchAfter: (index: number) => recording.prefetchAfter(index),
  };
}

/** What can be saved from the page, and how. */
function saves(recording: Recording, player: Player, picture: Picture | null) {
  const { scene, source } = recording.head;
  const name = (ending: string) => fileName(scene.title, ending);
  return {
    savePicture: () => {
      const time = recording.facts[player.index].time;
      void picture?.stage.png(paper()).then((blob) => {
        if (blob !== null) download(name(`-${Number(time.toFixed(6))}s.png`), blob);
      });
    },
    saveNumbers: () => download(name('.csv'), csv(recording.facts)),
    saveScene: source === null ? null : () => download(name('.toml'), source),
  };
}

function showPlots(plots: Plots): void {
  const side = element<HTMLDetailsElement>('side');
  side.hidden = plots.isEmpty;
  side.open = !matchMedia(NARROW).matches;
}

/** The colours get the scale of all frames, which are read for it after the first is shown. */
async function setScale(recording: Recording, { view }: Picture): Promise<void> {
  const { colorBy } = recording.head.scene;
  // The scale of the others is always the same.
  const range = colorBy === 'speed' || colorBy === 'stress' ? await recording.scalarRange() : null;
  if (range === null) return;
  view.setScale(...range);
  showLegend(element('legend'), view.legend());
}

function hand(handles: Handles, recording: Recording, picture: Picture | null, seek: Handles['seek']): void {
  Object.assign(handles, { seek, measure: () => recording.measure() });
  if (picture === null) return;
  const { stage, view } = picture;
  Object.assign(handles, { positions: () => view.positions(), litShare: () => stage.litShare(), renderer: stage.rendererName() });
  handles.gridShares = (directions) => view.gridShares(directions);
  handles.bodyPixels = () => view.bodyPixels();
}

/** Index of the frame whose time (s) is nearest. */
function nearest({ facts }: Recording, time: number): number {
  const before = frameAt(facts, time);
  const after = Math.min(before + 1, facts.length - 1);
  return time - facts[before].time <= facts[after].time - time ? before : after;
}

const handles: Handles = {
  ready: Promise.resolve(),
  seek: () => Promise.reject(new Error('there is no frame')),
  frameCount: 0,
  times: [],
  picture: () => Promise.reject(new Error('there is no picture')),
  positions: () => new Float32Array(0),
  litShare: () => 0,
  gridShares: () => [],
  bodyPixels: () => new Uint8Array(0),
  renderer: '',
  measure: () => Promise.resolve({ seconds: 0, bytes: 0 }),
};
const themes = new Themes();
// The data elements stand after this script.
handles.ready = new Promise((resolve) => {
  document.addEventListener('DOMContentLoaded', () => void start(handles, themes).then(resolve), { once: true });
});
(window as unknown as { nappe: Handles }).nappe = handles;
