// The page of one session: its picture, plots and words, as they come in the stream.
//
// Enters: a session of the server. Leaves: a page that follows it until it is left.

import {
  ChangeKind, type Client, type LiveFrame, NappeError, type Session, SessionState, type StateChange,
} from '../../../../client/typescript/src/index.ts';
import { setRunning } from '../picture/boxes.ts';
import { element } from '../page/dom.ts';
import { Hand } from './hand.ts';
import { type Actions, listen, popup, sheet, wireButtons } from '../page/keys.ts';
import { showLegend } from '../picture/legend.ts';
import { Line } from './line.ts';
import { showLine, showSession, showState, showTime, titleOf } from './live_facts.ts';
import { LivePicture } from './live_picture.ts';
import { diagnosticsOf } from './live_scene.ts';
import { Minute } from '../plots/minute.ts';
import { Newest } from './newest.ts';
import { type Notice, pass, stand } from '../page/notice.ts';
import { Plots } from '../plots/plots.ts';
import { showPupil } from './pupil.ts';
import { RateChoice } from './rate_choice.ts';
import { Sliders } from './sliders.ts';
import { Stages } from '../plots/stages.ts';
import { STEERING_BUTTONS, Steering } from './steering.ts';
import { Stream } from './stream.ts';
import type { Themes } from '../page/theme.ts';
import { type Picture, VIEW_BUTTONS, viewing } from '../picture/viewing.ts';
import * as words from './words.ts';

/** Between two looks at what the stream does not tell, and between two attempts once the stream has given up (ms). */
const LOOK_EVERY = 2_000;
/** The same until the line is judged. */
const JUDGE_EVERY = 1_000;
/** From a change of parameters to the look at what they are now (ms): more changes may follow. */
const SETTLED = 100;
/** Between two changes of plots and counts (ms). */
const WRITE_EVERY = 333;
/** A tab that is not seen for so long (ms) watches no more, until it is seen again: other pages may have its place. */
const UNSEEN = 5_000;
/** Attempts after which a server that said that it ends counts as lost. */
const PATIENT = 6;
/** A picture that is older than this (s) is said to be old. */
const OLD = 0.5;
/** Screens on which the plots would leave too little room for the picture. */
const NARROW = '(max-width: 800px), (max-height: 480px)';
const CALM = '(prefers-reduced-motion: reduce)';

export class SessionPage {
  /** Resolves when the first frame is drawn. */
  readonly ready: Promise<void>;
  picture: Picture | null = null;
  newest: LiveFrame | null = null;
  state = SessionState.UNSPECIFIED;
  drawnCount = 0;
  /** Steps that were taken, as the page says. */
  private step = 0n;
  private readonly line = new Line();
  private readonly minute = new Minute();
  private readonly stages = new Stages(element('stages'));
  private plots: Plots | null = null;
  private readonly rates: RateChoice;
  private readonly stream: Stream;
  private readonly steering: Steering;
  private readonly sliders: Sliders;
  private readonly looks = new Newest();
  private readonly live: LivePicture;
  private hand: Hand | null = null;
  private beginning: () => void = () => undefined;
  /** The session is gone: nothing is asked of it any more. */
  private isOver = false;
  /** The token of this tab is good for watching the session, and no more. */
  private readonly isWatched: boolean;
  /** The server said that it ends, and has not come back. */
  private isDraining = false;
  /** When the last change came (ms). */
  private changed = 0;
  /** Simulated seconds per second, and the seconds that the picture is old; null where they are not known. */
  private pace: number | null = null;
  private age: number | null = null;
  private paced: { at: number; time: number } | null = null;
  private hasNews = false;

  constructor(private readonly client: Client, private session: Session, private readonly themes: Themes) {
    this.ready = new Promise((resolve) => (this.beginning = resolve));
    element('app').hidden = false;
    element<HTMLDetailsElement>('side').open = !matchMedia(NARROW).matches;
    showSession(session);
    this.live = new LivePicture(titleOf(session), matchMedia(CALM).matches, {
      began: (picture) => this.begin(picture),
      drawn: (frame, unseen) => this.drawn(frame, unseen),
    });
    this.rates = new RateChoice((rate) => this.stream.setRate(rate));
    this.steering = new Steering(client, session, {
      done: (now, asked) => this.told(now, asked),
      refused: (doing, error) => this.refused(doing, error),
      forked: (fork) => pass({ kind: 'news', what: `The fork is ${fork.sessionId}.`, remedy: 'It stands where this session stands, paused.', deeds: [{ label: 'Open it', href: `?${new URLSearchParams({ session: fork.sessionId })}` }] }),
      deleted: () => this.end(words.deleted),
    });
    this.sliders = new Sliders(client, session, (doing, error) => this.refused(doing, error));
    this.sliders.show(session);
    this.stream = new Stream(client, session, this.rates.rate, {
      topology: () => undefined,
      frame: (frame) => this.take(frame),
      change: (change) => this.hear(change),
      progress: () => undefined,
      end: ({ step }) => stand(words.finished(step)),
      lost: (attempt) => this.lost(attempt),
      back: () => this.back(),
      crowded: () => stand(words.crowded),
      seated: () => stand(this.standing()),
      ended: (error) => this.ended(error),
    });
    // Whoever waits for a picture can steer all the same.
    wireButtons(STEERING_BUTTONS, this.steering.actions);
    listen(this.steering.actions);
    popup('more', 'views');
    popup('save', 'saves');
    sheet('about', 'about-sheet', 'about-close');
    this.tell(session.state);
    this.isWatched = showPupil(client, session);
    if (this.isWatched) this.letBe();
    this.stream.open();
    setInterval(() => this.write(), WRITE_EVERY);
    this.lookOn();
    this.rest();
  }

  /** The view is moved from the first picture on; null where there is none. */
  private begin(picture: Picture | null): void {
    this.picture = picture;
    const actions = viewing(picture, {
      toggleTheme: () => this.themes.toggle(),
      moved: () => undefined,
      recolored: () => {
        if (!this.isOver) this.stream.setColored(picture?.view.showsColors === true);
        this.legend();
      },
    });
    wireButtons(VIEW_BUTTONS, actions);
    listen(actions);
    if (picture !== null) this.hand = new Hand(this.client, () => this.session, picture, (doing, error) => this.refused(doing, error));
    const taking: Actions = this.hand?.actions ?? {};
    wireButtons({ hand: 'g' }, taking);
    listen(taking);
    this.hand?.show(this.state);
    if (this.isWatched) this.letBe();
    this.themes.follow((theme) => {
      picture?.view.setTheme(theme);
      this.plots?.redraw();
    });
    this.markFailure();
    this.beginning();
  }

  private take(frame: LiveFrame): void {
    const now = performance.now();
    this.line.received(now, frame.bytes, Number(frame.dropped));
    this.rates.count();
    if (frame.diagnostics !== null) {
      this.minute.add(diagnosticsOf(frame.diagnostics));
      this.stages.add(frame.diagnostics);
    }
    this.hasNews = true;
    this.newest = frame;
    this.live.take(frame);
  }

  private drawn(frame: LiveFrame, unseen: number): void {
    this.drawnCount += 1;
    this.line.drawn(performance.now(), unseen);
    this.tellTime(frame.time, frame.step);
    this.hand?.drawn(frame.time);
    this.legend();
  }

  private legend(): void {
    showLegend(element('legend'), this.picture?.view.legend() ?? null);
  }

  /** Plots and counts, which change less often than the picture. */
  private write(): void {
    if (document.hidden || this.drawnCount === 0) return;
    showLine(this.line.read(performance.now()), this.state === SessionState.PLAYING ? this.pace : null, this.age);
    if (!this.hasNews) return;
    this.hasNews = false;
    const { frames } = this.minute;
    if (frames.length === 0) return;
    element('side').hidden = false;
    this.stages.show();
    if (this.plots === null) {
      this.plots = new Plots(element('plots'), frames, null);
      this.plots.redraw();
    }
    this.plots.replace(frames);
  }

  /** What somebody did, or how the session stands. */
  private hear(change: StateChange): void {
    this.changed = performance.now();
    if (change.kind === ChangeKind.DRAINING) {
      this.isDraining = true;
      return stand(words.draining);
    }
    if (change.kind === ChangeKind.DELETED) return this.end(words.deleted);
    if (change.kind === ChangeKind.PARAMETERS || change.kind === ChangeKind.RESET) this.looks.put(() => this.follow());
    if (change.kind === ChangeKind.NOTICE) pass({ kind: 'trouble', what: change.notice, remedy: '' });
    if (change.failure !== undefined) this.session.failure = change.failure;
    this.tell(change.state);
    // All steps are equally long.
    const { timeSeconds, step, dtSeconds } = this.session;
    if (change.state !== SessionState.PLAYING) this.tellTime(timeSeconds + Number(change.step - step) * dtSeconds, change.step);
  }

  /** How the session stands after a call. What the stream told since the call was sent is newer. */
  private told(session: Session, asked: number): void {
    if (this.changed > asked) return;
    this.session = session;
    showSession(session);
    this.sliders.show(session);
    this.tell(session.state);
    if (session.state !== SessionState.PLAYING) this.tellTime(session.timeSeconds, session.step);
  }

  /** Not every step has a frame: what was told last may be newer than the picture. */
  private tellTime(time: number, step: bigint): void {
    if (step < this.step) return;
    this.step = step;
    showTime(time, step, this.session.dtSeconds);
  }

  private tell(state: SessionState): void {
    const fails = state === SessionState.FAILED && this.state !== state;
    this.state = state;
    setRunning(state === SessionState.PLAYING);
    showState(state);
    this.steering.show(state);
    this.hand?.show(state);
    if (state !== SessionState.PLAYING) this.age = null;
    const { failure } = this.session;
    if (!fails || failure === undefined) return;
    stand(words.failed(failure));
    this.markFailure();
  }

  private markFailure(): void {
    const particle = this.session.failure?.particle;
    if (particle !== undefined) this.live.mark(Number(particle));
  }

  private lookOn(): void {
    setTimeout(() => void this.look().then(() => this.lookOn()), this.rates.isOver ? LOOK_EVERY : JUDGE_EVERY);
  }

  /** What the stream does not tell: watchers, hash, limits; how old the picture is. */
  private async look(): Promise<void> {
    if (document.hidden || this.isOver) return this.rates.rest();
    const since = performance.now();
    try {
      const session = await this.client.get(this.session);
      this.told(session, since);
      this.measure(session);
      // The line is there again before the stream has tried.
      if (this.stream.waits) this.stream.open();
    } catch (error) {
      if (!isTransient(error)) this.ended(error);
    }
  }

  /** What somebody changed of the parameters; the next look tells it too, if this one does not. */
  private async follow(): Promise<void> {
    await new Promise((resolve) => setTimeout(resolve, SETTLED));
    if (this.isOver) return;
    const since = performance.now();
    await this.client.get(this.session).then((session) => this.told(session, since), () => undefined);
  }

  private measure({ timeSeconds, state, frame: made }: Session): void {
    const now = performance.now();
    const frame = this.newest;
    if (frame === null || state !== SessionState.PLAYING || !this.stream.isOpen) {
      this.paced = this.age = this.pace = null;
      this.rates.rest();
      return;
    }
    this.rates.look(now, made);
    const before = this.paced;
    this.paced = { at: now, time: timeSeconds };
    if (before === null || timeSeconds <= before.time) return;
    this.pace = (timeSeconds - before.time) / ((now - before.at) / 1e3);
    const age = (timeSeconds - frame.time) / this.pace;
    this.age = age > OLD ? age : null;
  }

  /** A server that said that it ends is not missed. */
  private lost(attempt: number): void {
    this.rates.rest();
    if (!this.isDraining || attempt > PATIENT) stand(words.lost(attempt));
  }

  private back(): void {
    this.isDraining = false;
    stand(this.standing());
    pass(words.back);
  }

  /** What is to be said as long as nothing else is. */
  private standing(): Notice | null {
    const { failure, step } = this.session;
    if (this.state === SessionState.FAILED && failure !== undefined) return words.failed(failure);
    return this.state === SessionState.FINISHED ? words.finished(step) : null;
  }

  private refused(doing: string, error: unknown): void {
    if (words.isShut(error)) return location.reload();
    pass(words.refused(doing, error));
  }

  /** The stream ended, or the session was looked for, by an error. */
  private ended(error: unknown): void {
    if (this.isOver) return;
    // The page asks for the token when it begins.
    if (words.isShut(error)) return location.reload();
    const reason = error instanceof NappeError ? error.reason : null;
    if (reason === 'SESSION_NOT_FOUND') return this.end(words.gone);
    if (reason === 'SESSION_DELETED') return this.end(words.deleted);
    if (reason === 'SESSION_REPLACED') return this.end(words.replaced);
    if (this.state === SessionState.FAILED) return;
    if (isTransient(error)) stand(words.lost(1));
    else if (reason !== null && PASSING.has(reason)) pass(words.refused('the stream', error));
    else return this.end(words.unreadable(error));
    setTimeout(() => {
      if (!this.isOver && !this.stream.isOpen && !document.hidden) this.stream.open();
    }, LOOK_EVERY);
  }

  /** Nothing more comes. */
  private end(notice: Notice): void {
    this.isOver = true;
    this.stream.close();
    this.letBe();
    stand(notice);
  }

  /** Nothing can be asked of the session by this page. */
  private letBe(): void {
    this.steering.end();
    this.sliders.end();
    this.hand?.end();
  }

  /** A tab that nobody sees keeps no stream for long. */
  private rest(): void {
    let timer: ReturnType<typeof setTimeout> | undefined;
    const look = () => {
      clearTimeout(timer);
      if (document.hidden) timer = setTimeout(() => this.stream.close(), UNSEEN);
      else if (!this.isOver && !this.stream.isOpen) this.stream.open();
    };
    document.addEventListener('visibilitychange', look);
    // A tab may be opened behind others.
    if (document.hidden) look();
    addEventListener('pagehide', () => this.stream.close());
    addEventListener('pageshow', (event) => {
      if (event.persisted && !this.isOver) this.stream.open();
    });
  }
}

/** What ends a stream, but not the next one. */
const PASSING = new Set(['WATCHER_STALLED', 'WATCHER_TOO_SLOW', 'TOO_MANY_WATCHERS', 'TOO_MANY_COMMANDS', 'INTERNAL']);

const isTransient = (error: unknown): boolean => error instanceof NappeError && error.isTransient;
