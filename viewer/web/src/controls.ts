// Buttons, the slider, and keys.

import type { Player } from './player.ts';
import type { Move, Stage } from './stage.ts';
import type { View } from './view.ts';

/** Frames that Page Up and Page Down skip. */
const PAGE = 10;

/** What is drawn, and on what. */
export interface Picture {
  stage: Stage;
  view: View;
}

/** What the controls do besides playing. */
export interface Deeds {
  toggleTheme(): void;
  /** The view was moved by a key or a button. */
  moved(): void;
  /** Colours mean something else. */
  recolored(): void;
  savePicture(): void;
  saveNumbers(): void;
  /** Null if the recording does not hold the scene's text. */
  saveScene: (() => void) | null;
}

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

/** Buttons by the key that does the same. */
const PLAYING = { first: 'Home', back: 'ArrowLeft', play: ' ', forward: 'ArrowRight', last: 'End', loop: 'o' };
const VIEWING = { home: 'r', follow: 'f', wireframe: 'w', colors: 'c' };
const OTHERS = { theme: 't', screen: 's', 'help-open': 'h' };

/** Wires the page's controls to what they do. There is no picture where nothing can be drawn. */
export function connect(player: Player, picture: Picture | null, frameCount: number, deeds: Deeds): Controls {
  const seek = (index: number) => {
    player.pause();
    // A failure is told by the player.
    player.seek(index).catch(() => undefined);
  };
  const actions: Actions = {
    ...playing(player, seek, frameCount), ...(picture === null ? {} : viewing(picture, deeds)),
    h: toggleHelp, s: toggleScreen, t: () => deeds.toggleTheme(),
  };
  const scrub = element<HTMLInputElement>('scrub');
  scrub.max = String(frameCount - 1);
  scrub.addEventListener('input', () => seek(Number(scrub.value)));
  scrub.disabled = frameCount < 2;

  for (const [id, key] of Object.entries({ ...PLAYING, ...VIEWING, ...OTHERS })) {
    const button = element<HTMLButtonElement>(id);
    button.disabled = actions[key] === undefined || (id in PLAYING && frameCount < 2);
    button.addEventListener('click', () => actions[key]?.());
  }
  element('screen').hidden = !document.fullscreenEnabled;
  element('colors').hidden = picture?.view.hasColors !== true;
  element('colors').setAttribute('aria-pressed', String(picture?.view.showsColors === true));
  const speed = element<HTMLSelectElement>('speed');
  speed.addEventListener('change', () => (player.speed = Number(speed.value)));
  wireSaves(picture, deeds);
  popup('more', 'views');
  popup('save', 'saves');
  listen(actions, (move) => {
    picture?.stage.move(move);
    deeds.moved();
  });

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
    ',': () => changeSpeed(-1),
    '.': () => changeSpeed(1),
  };
}

function viewing({ stage, view }: Picture, deeds: Deeds): Actions {
  return {
    w: () => press('wireframe', view.toggleWireframe()),
    c: () => {
      press('colors', view.toggleColors());
      deeds.recolored();
    },
    r: () => {
      stage.goHome('eased');
      deeds.moved();
    },
    f: () => {
      const name = view.followNext();
      press('follow', name !== null);
      element('follow').textContent = name === null || name === '' ? 'Follow' : `Follow ${name}`;
    },
  };
}

function press(id: string, pressed: boolean): void {
  element(id).setAttribute('aria-pressed', String(pressed));
}

/** The next slower or faster one of the list. */
function changeSpeed(by: number): void {
  const speed = element<HTMLSelectElement>('speed');
  speed.selectedIndex = Math.min(Math.max(speed.selectedIndex + by, 0), speed.options.length - 1);
  speed.dispatchEvent(new Event('change'));
}

function wireSaves(picture: Picture | null, { savePicture, saveNumbers, saveScene }: Deeds): void {
  element<HTMLButtonElement>('save-picture').disabled = picture === null;
  element('save-picture').addEventListener('click', savePicture);
  element('save-numbers').addEventListener('click', saveNumbers);
  element('save-scene').hidden = saveScene === null;
  if (saveScene !== null) element('save-scene').addEventListener('click', saveScene);
}

/** A button that opens what lies beside it, until something else is pressed. */
function popup(opener: string, panel: string): void {
  const open = (isOpen: boolean) => {
    element(panel).classList.toggle('open', isOpen);
    element(opener).setAttribute('aria-expanded', String(isOpen));
  };
  element(opener).addEventListener('click', () => open(!element(panel).classList.contains('open')));
  document.addEventListener('pointerdown', (event) => {
    const target = event.target as Element;
    if (target.closest(`#${panel}, #${opener}`) === null) open(false);
  });
  document.addEventListener('keydown', (event) => {
    if (event.key === 'Escape') open(false);
  });
}

function listen(actions: Actions, move: (move: Move) => void): void {
  document.addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const target = event.target as HTMLElement;
    const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    // A list and a text need their own keys, and so does the help; a button is pressed by space.
    if (target.closest('select, pre') !== null || (element<HTMLDialogElement>('help').open && key !== 'h')) return;
    if (key === ' ' && target.closest('button, summary') !== null) return;

    const moved = MOVES[event.shiftKey && key.startsWith('Arrow') ? `Shift ${key}` : key];
    const action = moved === undefined ? actions[key] : () => move(moved);
    if (action === undefined) return;
    event.preventDefault();
    action();
  });
}

function toggleHelp(): void {
  const help = element<HTMLDialogElement>('help');
  if (help.open) return help.close();
  help.showModal();
  // Else the button at its end has the focus, and a small screen begins there.
  element('help-title').focus();
}

function toggleScreen(): void {
  // A browser that refuses leaves all as it was.
  const change = document.fullscreenElement === null ? document.documentElement.requestFullscreen() : document.exitFullscreen();
  change.catch(() => undefined);
}
