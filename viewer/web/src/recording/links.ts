// Keeps the page's address a link to what is shown: the time and the view, once both rest.

import { type Place, readLink, writeLink } from './link.ts';

/** After the last change (ms): a turn goes on for a while after the hand has let go. */
const REST = 700;

/** What is shown, and how to show something else. */
export interface Shown {
  read(): Place;
  open(place: Place): void;
  /** While it plays, nothing is written. */
  isMoving(): boolean;
}

export class Links {
  private timer: ReturnType<typeof setTimeout> | undefined;

  constructor(canvas: HTMLElement, private readonly shown: Shown) {
    for (const name of ['pointerup', 'wheel', 'touchend']) canvas.addEventListener(name, () => this.note(), { passive: true });
    // Not called by what is written here.
    addEventListener('hashchange', () => shown.open(readLink(location.hash)));
  }

  /** What the address said when the page was opened. */
  initial(): Place {
    return readLink(location.hash);
  }

  /** Something changed. */
  note(): void {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.write(), REST);
  }

  private write(): void {
    if (this.shown.isMoving()) return;
    try {
      history.replaceState(history.state, '', writeLink(this.shown.read()));
    } catch {
      // A frame without an address of its own, as in a notebook, has no links.
    }
  }
}
