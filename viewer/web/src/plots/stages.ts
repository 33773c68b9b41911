// Seconds per stage of a step, as bars.

import type { Diagnostics } from '../../../../client/typescript/src/index.ts';
import { make } from '../page/dom.ts';

/** A mean forgets half of what was in so many frames. */
const HALF_LIFE = 15;

export class Stages {
  /** Mean seconds by the name of the stage, in the order of a step. */
  private readonly means = new Map<string, number>();
  private total = 0;
  private step = -1n;

  constructor(private readonly host: HTMLElement) {}

  add({ step, stages, stepSeconds }: Diagnostics): void {
    // Frame 0 has taken no step, and a frame that comes again none that is new.
    if (step === this.step || stages.length === 0) return;
    const share = this.step < 0n ? 1 : 1 - 0.5 ** (1 / HALF_LIFE);
    this.step = step;
    const mixed = (mean: number | undefined, now: number) => (mean === undefined ? now : mean + share * (now - mean));
    this.total = mixed(this.total, stepSeconds);
    for (const { stage, seconds } of stages) this.means.set(stage, mixed(this.means.get(stage), seconds));
  }

  /** Writes the means. */
  show(): void {
    if (this.means.size === 0) return;
    const caption = make('figcaption');
    caption.append(make('strong', '', 'Time of a step'), make('b', '', milliseconds(this.total)));
    const rows = [...this.means].flatMap(([stage, seconds]) => {
      const bar = make('span', 'bar');
      bar.style.setProperty('--share', String(Math.min(seconds / Math.max(this.total, 1e-12), 1)));
      return [make('span', 'name', stage.replaceAll('_', ' ')), bar, make('b', '', milliseconds(seconds))];
    });
    const table = make('div', 'rows');
    table.append(...rows);
    const figure = make('figure', 'plot stages');
    figure.append(caption, table);
    this.host.replaceChildren(figure);
  }
}

function milliseconds(seconds: number): string {
  const ms = 1e3 * seconds;
  return `${ms >= 100 ? ms.toFixed(0) : ms >= 1 ? ms.toFixed(1) : ms.toFixed(2)} ms`;
}
