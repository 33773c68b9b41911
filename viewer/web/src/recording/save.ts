// Files that a reader takes away from the page: numbers, a picture, the scene's text.

import type { FrameFacts } from './recording.ts';

/** Longest name of a file, without its ending. */
const LONGEST_NAME = 60;

/** A table of what is plotted, with a line for each frame; what is not known is empty. */
export function csv(facts: readonly FrameFacts[]): string {
  const head = 'frame,step,time_s,kinetic_J,elastic_J,gravitational_J,stretch,dt_s';
  const rows = facts.map(({ frame, step, time, kinetic, elastic, gravitational, stretch, dt }) =>
    [frame, step, time, kinetic, elastic, gravitational, stretch, dt].map((cell) => cell ?? '').join(','));
  return `${[head, ...rows].join('\n')}\n`;
}

/** A name of a file that says the title. */
export function fileName(title: string, ending: string): string {
  const words = title.normalize('NFKC').toLowerCase().replace(/[^\p{L}\p{N}]+/gu, '-').replace(/^-|-$/g, '');
  const name = [...words].slice(0, LONGEST_NAME).join('').replace(/-$/, '');
  return `${name === '' ? 'recording' : name}${ending}`;
}

/** Has the browser save a file. */
export function download(name: string, content: Blob | string): void {
  const blob = typeof content === 'string' ? new Blob([content], { type: 'text/plain' }) : content;
  const address = URL.createObjectURL(blob);
  const link = Object.assign(document.createElement('a'), { href: address, download: name });
  document.body.append(link);
  link.click();
  link.remove();
  // Some browsers read it only after the click has returned.
  setTimeout(() => URL.revokeObjectURL(address), 60_000);
}
