// One sentence above the page that says what happened, what helps, and what can be done about it.

import { element, make } from './dom.ts';

export interface Notice {
  /** `trouble` mends itself or can be mended; `failure` does not; `news` is neither. */
  kind: 'news' | 'trouble' | 'failure';
  what: string;
  remedy: string;
  deeds?: readonly Deed[];
}

/** A link, or what a button does. */
export type Deed = { label: string; href: string } | { label: string; act: () => void };

/** How long something stands that is only news (ms). */
const NEWS = 5_000;

/** What stands until something else does; null: nothing. */
let standing: Notice | null = null;
let timer: ReturnType<typeof setTimeout> | undefined;

/** Shows it until another takes its place; null takes it away. */
export function stand(notice: Notice | null): void {
  standing = notice;
  clearTimeout(timer);
  show(notice);
}

/** Shows it for a while, then again what stood before. */
export function pass(notice: Notice): void {
  clearTimeout(timer);
  show(notice);
  timer = setTimeout(() => show(standing), notice.deeds === undefined ? NEWS : 4 * NEWS);
}

/** Takes away what is shown for a while: what stood before is shown again. */
export function settle(): void {
  clearTimeout(timer);
  show(standing);
}

function show(notice: Notice | null): void {
  const host = element('notice');
  host.hidden = notice === null;
  if (notice === null) return;
  host.dataset['kind'] = notice.kind;
  write('notice-what', notice.what);
  write('notice-remedy', notice.remedy);
  element('notice-deeds').replaceChildren(...(notice.deeds ?? []).map(button));
}

/** The same words are not said again to those who hear the page. */
function write(id: string, words: string): void {
  if (element(id).textContent !== words) element(id).textContent = words;
}

function button(deed: Deed): HTMLElement {
  if ('href' in deed) return Object.assign(make('a', 'button', deed.label), { href: deed.href });
  const button = Object.assign(make('button', '', deed.label), { type: 'button' });
  button.addEventListener('click', deed.act);
  return button;
}
