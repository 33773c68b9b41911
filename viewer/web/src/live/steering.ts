// What steers a session: buttons, keys, lists. One command is sent after the other.

import { type Client, NappeError, type Session, SessionState } from '../../../../client/typescript/src/index.ts';
import { element } from '../page/dom.ts';
import { type Actions, choose } from '../page/keys.ts';
import { answering } from './late.ts';

/** Steps that the larger of two buttons takes. */
const MANY = 10;
/** A key that is held sends no more commands ahead than these. */
const MOST_WAITING = 3;
/** A press of Delete is asked about for so long (ms). */
const ASKED = 5_000;

/** Buttons by the key that does the same. */
export const STEERING_BUTTONS = { play: ' ', step: '.', ten: 'PageDown' };

export interface SteeringEvents {
  /** How the session stands after a command, which was sent at a time (ms). */
  done(session: Session, asked: number): void;
  /** `doing` is what was asked for, as a noun. */
  refused(doing: string, error: unknown): void;
  forked(fork: Session): void;
  deleted(): void;
}

export class Steering {
  /** What play and pause switch: how the session stands, or will once the commands under way are done. */
  private plays = false;
  private state = SessionState.UNSPECIFIED;
  private last: Promise<void> = Promise.resolve();
  private waiting = 0;
  private isOver = false;

  constructor(private readonly client: Client, private readonly session: Session, private readonly events: SteeringEvents) {
    const speed = element<HTMLSelectElement>('speed');
    speed.addEventListener('change', () => {
      if (this.plays) this.play();
    });
    element('fork').addEventListener('click', () => this.fork());
    this.askBeforeDeleting(element<HTMLButtonElement>('delete'));
  }

  get actions(): Actions {
    const one = () => this.step(1);
    return {
      ' ': () => (this.plays ? this.pause() : this.play()), '.': one, ArrowRight: one, PageDown: () => this.step(MANY),
      ',': () => choose('speed', -1), ';': () => choose('speed', 1),
    };
  }

  /** How the session stands, as it was told last. */
  show(state: SessionState): void {
    this.state = state;
    if (this.waiting === 0) this.plays = state === SessionState.PLAYING;
    this.draw();
  }

  private draw(): void {
    if (this.isOver) return;
    const { state } = this;
    const play = element<HTMLButtonElement>('play');
    play.classList.toggle('playing', this.plays);
    play.setAttribute('aria-label', this.plays ? 'Pause' : 'Play');
    const isOver = state === SessionState.FINISHED || state === SessionState.FAILED;
    for (const id of [...Object.keys(STEERING_BUTTONS), 'speed']) element<HTMLButtonElement>(id).disabled = isOver;
    // One that failed cannot be copied.
    element<HTMLButtonElement>('fork').disabled = state === SessionState.FAILED;
  }

  /** The session is gone: nothing can be asked of it. */
  end(): void {
    this.isOver = true;
    for (const id of [...Object.keys(STEERING_BUTTONS), 'speed', 'fork', 'delete']) element<HTMLButtonElement>(id).disabled = true;
  }

  private play(): void {
    const realTimeFactor = Number(element<HTMLSelectElement>('speed').value);
    this.plays = true;
    this.command('Playing', () => this.client.play(this.session, { realTimeFactor }));
  }

  private pause(): void {
    this.plays = false;
    this.command('Pausing', () => this.client.pause(this.session));
  }

  /** A session that plays is paused first. */
  private step(count: number): void {
    this.plays = false;
    const step = () => this.client.step(this.session, count, { wait: false });
    this.command(count === 1 ? 'The step' : 'The steps', () => step().catch(async (error: unknown) => {
      if (!(error instanceof NappeError) || error.reason !== 'SESSION_PLAYING') throw error;
      await this.client.pause(this.session);
      return step();
    }));
  }

  private fork(): void {
    this.send('The fork', () => this.client.fork(this.session), (fork) => this.events.forked(fork));
  }

  /** `call` gives how the session stands. */
  private command(doing: string, call: () => Promise<Session>): void {
    this.send(doing, call, (session, asked) => this.events.done(session, asked));
  }

  /** `done` is told what `call` gave, which was made at a time (ms). */
  private send<T>(doing: string, call: () => Promise<T>, done: (given: T, asked: number) => void): void {
    if (this.isOver || this.waiting > MOST_WAITING) return;
    this.waiting += 1;
    const answered = answering(doing);
    this.last = this.last.then(async () => {
      const asked = performance.now();
      try {
        const given = await call().finally(answered);
        done(given, asked);
      } catch (error) {
        this.plays = this.state === SessionState.PLAYING;
        this.events.refused(doing, error);
      }
      this.waiting -= 1;
      this.draw();
    });
    this.draw();
  }

  private askBeforeDeleting(button: HTMLButtonElement): void {
    let timer: ReturnType<typeof setTimeout> | undefined;
    const ask = (isAsked: boolean) => {
      clearTimeout(timer);
      button.classList.toggle('danger', isAsked);
      button.textContent = isAsked ? 'Delete for good' : 'Delete';
      if (isAsked) timer = setTimeout(() => ask(false), ASKED);
    };
    button.addEventListener('click', () => {
      if (!button.classList.contains('danger')) return ask(true);
      ask(false);
      this.send('Deleting', () => this.client.delete(this.session), () => this.events.deleted());
    });
    button.addEventListener('blur', () => ask(false));
  }
}
