// Pictures per second that are asked for: as the reader chooses, and until then as the line carries.
//
// What was made is asked of the server: what lies in the sockets of a slow line does not say that anything was left out.

import { element, make } from '../page/dom.ts';
import { isTold, rateFor } from './line.ts';

const FIRST = 60;
/** A second in which fewer frames were made says nothing of the line. */
const ENOUGH = 5;
/** After so many seconds that tell nothing a line carries what is made: one hiccup later on does not make it slow. */
const TRIES = 10;

export class RateChoice {
  private isMade = false;
  private before: { at: number; frame: bigint } | null = null;
  private received = 0;
  private tried = 0;

  constructor(private readonly changed: (rate: number) => void) {
    const select = element<HTMLSelectElement>('rate');
    select.value = String(FIRST);
    select.addEventListener('change', () => {
      this.isMade = true;
      changed(Number(select.value));
    });
  }

  get rate(): number {
    return Number(element<HTMLSelectElement>('rate').value);
  }

  /** The line was judged, or the reader has chosen. */
  get isOver(): boolean {
    return this.isMade;
  }

  /** A frame came. */
  count(): void {
    this.received += 1;
  }

  /** The server has made frames up to this one, at a time (ms). The session plays, and has played since the last look. */
  look(at: number, frame: bigint): void {
    const { before, received } = this;
    this.before = { at, frame };
    this.received = 0;
    if (this.isMade || before === null) return;
    const seconds = (at - before.at) / 1e3;
    const made = Number(frame - before.frame) / seconds;
    if (made < ENOUGH) return;
    this.tried += 1;
    const told = isTold(received / seconds, made, FIRST);
    this.isMade = told || this.tried === TRIES;
    if (!told) return;
    const rate = rateFor(received / seconds, made, FIRST);
    if (rate !== FIRST) this.choose(rate);
  }

  /** The session does not play, or nobody listens to it. */
  rest(): void {
    this.before = null;
  }

  private choose(rate: number): void {
    const select = element<HTMLSelectElement>('rate');
    const options = [...select.options];
    if (!options.some(({ value }) => Number(value) === rate)) {
      const next = options.find(({ value }) => Number(value) > rate) ?? null;
      select.insertBefore(Object.assign(make('option', '', String(rate)), { value: String(rate) }), next);
    }
    select.value = String(rate);
    this.changed(rate);
  }
}
