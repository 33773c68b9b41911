// How a picture is looked at: buttons and keys that move the view and change what is drawn.

import { element } from '../page/dom.ts';
import { type Actions, press } from '../page/keys.ts';
import type { Move, Stage } from './stage.ts';
import type { View } from './view.ts';

/** What is drawn, and on what. */
export interface Picture {
  stage: Stage;
  view: View;
}

/** What happens besides. */
export interface ViewDeeds {
  toggleTheme(): void;
  /** The view was moved by a key or a button. */
  moved(): void;
  /** Colours mean something else. */
  recolored(): void;
}

/** Buttons by the key that does the same. */
export const VIEW_BUTTONS = {
  home: 'r', follow: 'f', wireframe: 'w', pins: 'p', colors: 'c', theme: 't', screen: 's', 'help-open': 'h',
};

/** Keys that move the view; those with `Shift` stand for arrows with it. */
const MOVES: Record<string, Move> = {
  'Shift ArrowLeft': 'left', 'Shift ArrowRight': 'right', 'Shift ArrowUp': 'up', 'Shift ArrowDown': 'down',
  j: 'pan left', l: 'pan right', i: 'pan up', k: 'pan down', '+': 'in', '=': 'in', '-': 'out',
};

/** What the keys of the view do. There is no picture where nothing can be drawn. */
export function viewing(picture: Picture | null, deeds: ViewDeeds): Actions {
  const others = { h: toggleHelp, s: toggleScreen, t: () => deeds.toggleTheme() };
  element('screen').hidden = !document.fullscreenEnabled;
  element('colors').hidden = picture?.view.hasColors !== true;
  press('colors', picture?.view.showsColors === true);
  element('pins').hidden = picture?.view.hasPins !== true;
  return picture === null ? others : { ...others, ...moves(picture, deeds), ...looks(picture, deeds) };
}

function moves({ stage }: Picture, deeds: ViewDeeds): Actions {
  return Object.fromEntries(Object.entries(MOVES).map(([key, move]) => [key, () => {
    stage.move(move);
    deeds.moved();
  }]));
}

function looks({ stage, view }: Picture, deeds: ViewDeeds): Actions {
  return {
    w: () => press('wireframe', view.toggleWireframe()),
    p: () => press('pins', view.togglePins()),
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
