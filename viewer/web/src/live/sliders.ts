// Sliders of what acts on a session. They follow what others change, and say from which step on a change holds.
//
// Enters: how the session stands, as often as it is told. Leaves: changes, of each slider one call at a time.

import { type Client, type Session, SessionState } from '../../../../client/typescript/src/index.ts';
import { element, make } from '../page/dom.ts';
import { sheet } from '../page/keys.ts';
import { readable } from '../page/numbers.ts';
import { type Knob, Knobs, PLACES, placeOf, valueAt } from './knobs.ts';
import { many } from './live_facts.ts';
import { Newest } from './newest.ts';

/** One slider. */
interface Row {
  knob: Knob;
  input: HTMLInputElement;
  output: HTMLOutputElement;
  note: HTMLElement;
  calls: Newest;
  /** The hand is on it. */
  isHeld: boolean;
}

export class Sliders {
  private readonly knobs = new Knobs();
  private readonly rows = new Map<string, Row>();
  private readonly together = new Newest();
  /** Nothing can be changed now, or ever again. */
  private isOver = false;
  private isEnded = false;

  /** `refused` hears what was not done. */
  constructor(private readonly client: Client, private readonly session: Session, private readonly refused: (doing: string, error: unknown) => void) {
    sheet('knobs', 'knobs-sheet', 'knobs-close');
    element('knobs-back').addEventListener('click', () => {
      const key = this.knobs.back();
      if (key !== null) this.send([key]);
    });
    element('knobs-start').addEventListener('click', () => this.send(this.knobs.backToStart()));
  }

  /** How the session stands, as it was told last. */
  show({ parameters, step, state }: Session): void {
    if (parameters === undefined) return;
    this.isOver = this.isEnded || state === SessionState.FINISHED || state === SessionState.FAILED;
    this.knobs.hear(parameters, step);
    for (const knob of this.knobs.all) if (!this.rows.has(knob.key)) this.add(knob);
    this.draw();
  }

  /** Nothing can be changed by this page any more. */
  end(): void {
    this.isOver = this.isEnded = true;
    this.draw();
  }

  private add(knob: Knob): void {
    const input = Object.assign(make('input'), { type: 'range', min: '0', max: String(PLACES) });
    const row: Row = { knob, input, output: make('output'), note: make('small'), calls: new Newest(), isHeld: false };
    this.rows.set(knob.key, row);
    input.addEventListener('input', () => {
      if (!row.isHeld) this.knobs.keep(knob.key);
      row.isHeld = true;
      this.knobs.set(knob.key, valueAt(knob.scale, Number(input.value)));
      this.send([knob.key]);
    });
    input.addEventListener('change', () => (row.isHeld = false));
    const label = make('label', 'knob');
    label.append(make('span', '', knob.label), row.output, input, row.note);
    element('knobs-rows').append(label);
  }

  private draw(): void {
    for (const [key, { knob, input, output, isHeld }] of this.rows) {
      const value = this.knobs.value(key);
      input.disabled = this.isOver || value === null;
      const words = value === null ? 'not one number' : `${readable(value)} ${knob.unit}`;
      output.textContent = words;
      input.setAttribute('aria-valuetext', words);
      if (!isHeld) input.value = String(placeOf(knob.scale, value ?? 0));
    }
    for (const id of ['knobs-back', 'knobs-start']) element<HTMLButtonElement>(id).disabled = this.isOver;
  }

  /** Sends these as they stand when the call is made. */
  private send(keys: readonly string[]): void {
    this.draw();
    if (keys.length === 0) return;
    const calls = keys.length === 1 ? this.rows.get(keys[0])!.calls : this.together;
    calls.put(async () => {
      const values = keys.map((key) => [key, this.knobs.value(key) ?? 0] as const);
      try {
        const { effectiveStep } = await this.client.update(this.session, this.knobs.changes(keys));
        for (const [key, value] of values) {
          this.knobs.answered(key, value, effectiveStep);
          this.rows.get(key)!.note.textContent = `before step ${many(effectiveStep)}`;
        }
      } catch (error) {
        for (const key of keys) this.knobs.refused(key);
        this.draw();
        this.refused('The change', error);
      }
    });
  }
}
