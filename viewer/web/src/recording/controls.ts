// Buttons, the slider, and keys of a recording.

import { setRunning } from '../picture/boxes.ts';
import { element } from '../page/dom.ts';
import { type Actions, choose, listen, popup, press, wireButtons } from '../page/keys.ts';
import type { Player } from './player.ts';
import { type Picture, VIEW_BUTTONS, type ViewDeeds, viewing } from '../picture/viewing.ts';

/** Frames that Page Up and Page Down skip. */
const PAGE = 10;

/** What the controls do besides playing. */
export interface Deeds extends ViewDeeds {
  savePicture(): void;
  saveNumbers(): void;
  /** Null if the recording does not hold the scene's text. */
  saveScene: (() => void) | null;
}

export interface Controls {
  show(index: number): void;
  playing(playing: boolean): void;
}

/** Buttons by the key that does the same. */
const PLAYING = { first: 'Home', back: 'ArrowLeft', play: ' ', forward: 'ArrowRight', last: 'End', loop: 'o' };

/** Wires the page's controls to what they do. There is no picture where nothing can be drawn. */
export function connect(player: Player, picture: Picture | null, frameCount: number, deeds: Deeds): Controls {
  const seek = (index: number) => {
    player.pause();
    // A failure is told by the player.
    player.seek(index).catch(() => undefined);
  };
  const actions: Actions = { ...playing(player, seek, frameCount), ...viewing(picture, deeds) };
  const scrub = element<HTMLInputElement>('scrub');
  scrub.max = String(frameCount - 1);
  scrub.addEventListener('input', () => seek(Number(scrub.value)));
  scrub.disabled = frameCount < 2;

  wireButtons({ ...PLAYING, ...VIEW_BUTTONS }, actions);
  for (const id of Object.keys(PLAYING)) element<HTMLButtonElement>(id).disabled = frameCount < 2;
  const speed = element<HTMLSelectElement>('speed');
  speed.addEventListener('change', () => (player.speed = Number(speed.value)));
  wireSaves(picture, deeds);
  popup('more', 'views');
  popup('save', 'saves');
  listen(actions);

  return {
    show: (index) => {
      scrub.value = String(index);
      scrub.setAttribute('aria-valuetext', `frame ${index + 1} of ${frameCount}`);
    },
    playing: (playing) => {
      setRunning(playing);
      const play = element('play');
      play.classList.toggle('playing', playing);
      play.setAttribute('aria-label', playing ? 'Pause' : 'Play');
    },
  };
}

function playing(player: Player, seek: (index: number) => void, frameCount: number): Actions {
  return {
    ' ': () => (player.playing ? player.pause() : player.play()),
    ArrowLeft: () => seek(player.index - 1),
    ArrowRight: () => seek(player.index + 1),
    PageUp: () => seek(player.index - PAGE),
    PageDown: () => seek(player.index + PAGE),
    Home: () => seek(0),
    End: () => seek(frameCount - 1),
    o: () => press('loop', (player.loop = !player.loop)),
    ',': () => choose('speed', -1),
    '.': () => choose('speed', 1),
  };
}

function wireSaves(picture: Picture | null, { savePicture, saveNumbers, saveScene }: Deeds): void {
  element<HTMLButtonElement>('save-picture').disabled = picture === null;
  element('save-picture').addEventListener('click', savePicture);
  element('save-numbers').addEventListener('click', saveNumbers);
  element('save-scene').hidden = saveScene === null;
  if (saveScene !== null) element('save-scene').addEventListener('click', saveScene);
}
