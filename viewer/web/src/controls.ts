// Buttons, the slider, and keys.

import type { Player } from './player.ts';
import type { Move, Stage } from './stage.ts';
import type { View } from './view.ts';

/** Frames that Page Up and Page Down skip. */
const PAGE = 10;

export interface Controls {
  show(index: number): void;
  playing(playing: boolean): void;
}

const element = <T extends HTMLElement>(id: string) => document.getElementById(id) as T;

/** Keys that move the view; those with `Shift` stand for arrows with it. */
const MOVES: Record<string, Move> = {
  'Shift ArrowLeft': 'left', 'Shift ArrowRight': 'right', 'Shift ArrowUp': 'up', 'Shift ArrowDown': 'down',
  j: 'pan left', l: 'pan right', i: 'pan up', k: 'pan down', '+': 'in', '=': 'in', '-': 'out',
};

/** Wires the page's controls to what they do. */
export function connect(player: Player, stage: Stage, view: View, frameCount: number): Controls {
  const seek = (index: number) => {
    player.pause();
    // A failure is told by the player.
    player.seek(index).catch(() => undefined);
  };
  const actions = actionsOf(player, stage, view, seek, frameCount);
  const scrub = element<HTMLInputElement>('scrub');
  scrub.max = String(frameCount - 1);
  scrub.addEventListener('input', () => seek(Number(scrub.value)));

  const buttons = { first: 'Home', back: 'ArrowLeft', play: ' ', forward: 'ArrowRight', last: 'End' };
  for (const [id, key] of Object.entries(buttons)) {
    element<HTMLButtonElement>(id).disabled = frameCount < 2;
    element(id).addEventListener('click', actions[key]);
  }
  scrub.disabled = frameCount < 2;
  for (const [id, key] of Object.entries({ wireframe: 'w', home: 'r', screen: 'f', 'help-open': 'h' })) {
    element(id).addEventListener('click', actions[key]);
  }
  element('screen').hidden = !document.fullscreenEnabled;
  const speed = element<HTMLSelectElement>('speed');
  speed.addEventListener('change', () => (player.speed = Number(speed.value)));
  listen(actions, stage);

  return {
    show: (index) => {
      scrub.value = String(index);
      scrub.setAttribute('aria-valuetext', `frame ${index + 1} of ${frameCount}`);
    },
    playing: (playing) => {
      const play = element('play');
      play.classList.toggle('playing', playing);
      play.setAttribute('aria-label', playing ? 'Pause' : 'Play');
    },
  };
}

type Actions = Record<string, () => void>;

function actionsOf(player: Player, stage: Stage, view: View, seek: (index: number) => void, frameCount: number): Actions {
  return {
    ' ': () => (player.playing ? player.pause() : player.play()),
    ArrowLeft: () => seek(player.index - 1),
    ArrowRight: () => seek(player.index + 1),
    PageUp: () => seek(player.index - PAGE),
    PageDown: () => seek(player.index + PAGE),
    Home: () => seek(0),
    End: () => seek(frameCount - 1),
    h: toggleHelp,
    w: () => element('wireframe').setAttribute('aria-pressed', String(view.toggleWireframe())),
    c: () => view.toggleColors(),
    f: toggleScreen,
    r: () => stage.goHome('eased'),
  };
}

function listen(actions: Actions, stage: Stage): void {
  document.addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const target = event.target as HTMLElement;
    const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    // A list needs its own keys, and so does the help; a button is pressed by space.
    if (target instanceof HTMLSelectElement || (element<HTMLDialogElement>('help').open && key !== 'h')) return;
    if (key === ' ' && target.closest('button, summary') !== null) return;

    const move = MOVES[event.shiftKey && key.startsWith('Arrow') ? `Shift ${key}` : key];
    const action = move === undefined ? actions[key] : () => stage.move(move);
    if (action === undefined) return;
    event.preventDefault();
    action();
  });
}

function toggleHelp(): void {
  const help = element<HTMLDialogElement>('help');
  if (help.open) help.close();
  else help.showModal();
}

function toggleScreen(): void {
  // A browser that refuses leaves all as it was.
  const change = document.fullscreenElement === null ? document.documentElement.requestFullscreen() : document.exitFullscreen();
  change.catch(() => undefined);
}
