// The page that replays a recording: controls, keys, and what stands where.

import { bodyBounds, motionBounds } from './camera.ts';
import { css } from './coloring.ts';
import { type Controls, connect } from './controls.ts';
import type { Bounds } from './geometry.ts';
import { FormatError } from './json.ts';
import { PackedError } from './packed.ts';
import { Player } from './player.ts';
import { Plots } from './plots.ts';
import { Recording, frameAt } from './recording.ts';
import type { Frame } from './scene.ts';
import { Stage } from './stage.ts';
import { View } from './view.ts';

/** What scripts and tests may use. */
interface Handles {
  /** The first frame is drawn, or the page says why there is none. */
  ready: Promise<void>;
  /** Resolves when the frame is drawn. */
  seek(index: number): Promise<void>;
  frameCount: number;
  /** Positions of the shown frame (m). */
  positions(): Float32Array;
  litShare(): number;
  /** Share of the pixels that lines of the grid change, from so many directions. */
  gridShares(directions: number): number[];
  renderer: string;
  measure(): Promise<{ seconds: number; bytes: number }>;
}

const NARROW = '(max-width: 800px)';
const CALM = '(prefers-reduced-motion: reduce)';

function element<T extends HTMLElement>(id: string): T {
  return document.getElementById(id) as T;
}

function say(sentence: string): void {
  const message = element('message');
  message.hidden = sentence === '';
  message.textContent = sentence;
}

function reason(error: unknown): string {
  const known = error instanceof FormatError || error instanceof PackedError;
  return known || error instanceof Error ? error.message : String(error);
}

/** Why this browser cannot show a recording; null if it can. */
function obstacle(): string | null {
  if (typeof DecompressionStream === 'undefined') {
    return 'This browser cannot unpack the recording, since it has no DecompressionStream. Browsers since 2023 have it.';
  }
  if (document.createElement('canvas').getContext('webgl2') === null) {
    return 'This browser cannot draw the recording, since WebGL 2 is missing or switched off.';
  }
  return null;
}

async function start(handles: Handles): Promise<void> {
  const missing = obstacle();
  if (missing !== null) return say(missing);
  let recording: Recording;
  try {
    recording = await Recording.open(document);
  } catch (error) {
    return say(`This file cannot be shown: ${reason(error)}.`);
  }

  describe(recording);
  handles.frameCount = recording.frameCount;
  if (recording.frameCount === 0) return say('This recording holds no frame.');
  try {
    await run(recording, handles);
  } catch (error) {
    say(`This recording cannot be shown: ${reason(error)}.`);
  }
}

async function run(recording: Recording, handles: Handles): Promise<void> {
  const calm = matchMedia(CALM).matches;
  const first = await recording.frame(0);
  const stage = new Stage(element<HTMLCanvasElement>('canvas'), element('stage'), !calm, (lost) =>
    say(lost ? 'The graphics were lost. The picture comes back when the browser has them again.' : ''));
  const { scene } = recording.head;
  const bodies: Bounds[] = [];
  for await (const frame of recording.samples()) bodies.push(bodyBounds(scene, frame));
  const view = new View(stage, scene, first, motionBounds(bodyBounds(scene, first), bodies));

  const shown = (index: number) => {
    plots.show(index);
    showFacts(recording, index);
    showLegend(view);
    controls.show(index);
  };
  const player: Player = new Player(
    {
      frameCount: recording.frameCount,
      time: (index) => recording.facts[index].time,
      indexAt: (time) => frameAt(recording.facts, time),
      ready: (index) => recording.ready(index),
      frame: (index) => recording.frame(index),
      prefetchAfter: (index) => recording.prefetchAfter(index),
    },
    {
      show: (frame: Frame, index) => {
        view.show(frame);
        shown(index);
      },
      changed: () => controls.playing(player.playing),
      failed: (error) => say(`This part of the recording cannot be read: ${reason(error)}.`),
    },
  );
  const seek = (index: number) => {
    player.pause();
    return player.seek(index);
  };
  const plots = new Plots(element('plots'), recording.facts, (time) => void seek(nearest(recording, time)).catch(() => undefined));
  const controls: Controls = connect(player, stage, view, recording.frameCount);
  const side = element<HTMLDetailsElement>('side');
  side.hidden = plots.isEmpty;
  side.open = !matchMedia(NARROW).matches;

  Object.assign(handles, {
    seek,
    positions: () => view.positions(),
    litShare: () => stage.litShare(),
    gridShares: (directions: number) => view.gridShares(directions),
    renderer: stage.rendererName(),
    measure: () => recording.measure(),
  });
  element('facts').hidden = element('controls').hidden = false;
  await player.seek(0);
  if (!calm) player.play();
}

/** Index of the frame whose time (s) is nearest. */
function nearest({ facts }: Recording, time: number): number {
  const before = frameAt(facts, time);
  const after = Math.min(before + 1, facts.length - 1);
  return time - facts[before].time <= facts[after].time - time ? before : after;
}

/** What never changes. */
function describe(recording: Recording): void {
  const { scene, program, precision, source } = recording.head;
  const title = scene.title === '' ? 'Recording' : scene.title;
  document.title = `${title} – nappe`;
  element('title').textContent = title;
  element('end').textContent = endOf(recording);
  const particles = scene.particleCount.toLocaleString('en');
  element('about').textContent = `Recorded by ${program}${precision === '' ? '' : `, computed in ${precision}`}: ${particles} particles.`;
  element('source').hidden = source === null;
  element('source-text').textContent = source;
}

function endOf({ end, frameCount }: Recording): string {
  const whole = `${frameCount} whole ${frameCount === 1 ? 'frame is' : 'frames are'} shown`;
  if (end === null) return `This file was cut off: ${whole}.`;
  const parts = end.finished ? [] : ['Recorded up to here; the session went on.'];
  if (end.hash !== null) parts.push(`State hash ${end.hash}`);
  return parts.join(' ');
}

/** What changes with each frame. */
function showFacts(recording: Recording, index: number): void {
  const { time, bound } = recording.facts[index];
  element('frame').textContent = `Frame ${index + 1} of ${recording.frameCount}`;
  element('time').textContent = `${time.toFixed(3)} s`;
  element('bound').textContent = `Each coordinate within ${readableLength(bound)}`;
}

function readableLength(metres: number): string {
  const digits = (value: number) => String(Number(value.toPrecision(2)));
  if (metres < 1e-3) return metres < 1e-5 ? `${digits(1e6 * metres)} µm` : `${digits(1e3 * metres)} mm`;
  return metres < 1 ? `${digits(1e3 * metres)} mm` : `${digits(metres)} m`;
}

function showLegend(view: View): void {
  const legend = view.legend();
  const host = element('legend');
  host.hidden = legend === null;
  if (legend === null) return;
  if (host.childElementCount === 0) {
    host.append(...['title', 'bar', 'labels'].map((name) => Object.assign(document.createElement('div'), { className: name })));
  }
  const [title, bar, labels] = host.children as unknown as HTMLElement[];
  title.textContent = legend.title;
  bar.style.background = `linear-gradient(to right, ${legend.colors.map(css).join(', ')})`;
  labels.replaceChildren(...legend.labels.map((label) => Object.assign(document.createElement('span'), { textContent: label })));
}

const handles: Handles = {
  ready: Promise.resolve(),
  seek: () => Promise.reject(new Error('there is no frame')),
  frameCount: 0,
  positions: () => new Float32Array(0),
  litShare: () => 0,
  gridShares: () => [],
  renderer: '',
  measure: () => Promise.resolve({ seconds: 0, bytes: 0 }),
};
// The data elements stand after this script.
handles.ready = new Promise((resolve) => {
  document.addEventListener('DOMContentLoaded', () => void start(handles).then(resolve), { once: true });
});
(window as unknown as { nappe: Handles }).nappe = handles;
