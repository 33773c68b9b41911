// Boxes that stand before the picture: how much of its height they leave free.
//
// Enters: the element that the picture fills. Leaves: heights (CSS pixels) along its upper and its lower edge, which hold
// for a while: the title is measured as large as it is when nothing plays, so that the view does not jump when it shrinks.

import { element } from '../page/dom.ts';

/** Heights that boxes take (CSS pixels). */
export interface Insets {
  top: number;
  bottom: number;
}

/** Between a box and what the view holds (CSS pixels). */
const GAP = 8;
/** Boxes along the upper edge of the picture, and along its lower one; a page may lack some. */
const UPPER = '.info';
const LOWER = '.legend, .corner';

/** What the boxes take now; nothing where there are none. */
export function insetsOf(host: HTMLElement): Insets {
  const app = element('app');
  const runs = app.classList.contains('running');
  if (runs) app.classList.remove('running');
  const picture = host.getBoundingClientRect();
  const insets = { top: 0, bottom: 0 };
  for (const { top, bottom, height } of rectangles(host, UPPER)) {
    if (height > 0 && top < picture.bottom) insets.top = Math.max(insets.top, bottom - picture.top + GAP);
  }
  for (const { top, height } of rectangles(host, LOWER)) {
    if (height > 0) insets.bottom = Math.max(insets.bottom, picture.bottom - top + GAP);
  }
  if (runs) app.classList.add('running');
  return { top: Math.ceil(insets.top), bottom: Math.ceil(insets.bottom) };
}

/** Calls it when a box has another size, appears or goes. */
export function followBoxes(host: HTMLElement, changed: () => void): void {
  const observer = new ResizeObserver(changed);
  for (const box of host.querySelectorAll(`${UPPER}, ${LOWER}`)) observer.observe(box);
}

/** Shrinks the title to one line while something plays. */
export function setRunning(runs: boolean): void {
  element('app').classList.toggle('running', runs);
}

const rectangles = (host: HTMLElement, boxes: string): DOMRect[] =>
  [...host.querySelectorAll(boxes)].map((box) => box.getBoundingClientRect());
