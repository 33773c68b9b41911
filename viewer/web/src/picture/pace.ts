// How finely pictures are drawn: all the time on a graphics card, only at rest where a picture takes long, and as coarsely
// as that needs.
//
// Enters: when pictures are drawn, and whether the view moves. Leaves: how finely to draw the next one.

/** A picture that takes longer (ms) is slow: less than 20 per second. One that takes less than the second is quick. */
const SLOW = 50;
const QUICK = 20;
/** Quick pictures become finer again so long (ms) after they were slow, and twice as long after each time that fails. */
const AGAIN = 10_000;
/** Pictures that are measured before one judges, unless one takes longer than `HOPELESS` (ms). */
const MEASURED = 3;
const HOPELESS = 200;
/** The view is at rest so long (ms) after the last picture is on the screen. */
const REST = 250;

/** `fine`: with occlusion; `plain`: without; `coarse`: without, at half the resolution. */
export type Quality = 'fine' | 'plain' | 'coarse';
const QUALITIES: readonly Quality[] = ['fine', 'plain', 'coarse'];

export class Pace {
  private readonly durations: number[] = [];
  /** Of a scene that moves. */
  private moving: Quality = 'fine';
  private measuring = false;
  private timer = 0;
  private pictures = 0;
  /** The next picture is the first of its quality, for which shaders are made. */
  private isFirst = true;
  private retryAt = 0;
  private patience = AGAIN;

  /** `settle` draws a fine picture when nothing has moved for a while. */
  constructor(private readonly settle: () => void) {}

  /** For the next picture; `what` changed since the last. */
  quality(what: 'view' | 'scene'): Quality {
    return what === 'view' && this.moving !== 'fine' ? 'coarse' : this.moving;
  }

  /** A picture of a quality was drawn just now. */
  drawn(quality: Quality): void {
    clearTimeout(this.timer);
    const picture = ++this.pictures;
    if (quality === this.moving) this.measure();
    if (quality === 'fine') return;
    afterPicture(() => {
      if (picture === this.pictures) this.timer = window.setTimeout(this.settle, REST);
    });
  }

  /** Another size takes another time. */
  reset(): void {
    this.moving = 'fine';
    this.isFirst = true;
    this.durations.length = 0;
  }

  private measure(): void {
    if (this.measuring) return;
    const measured = this.moving;
    this.measuring = true;
    const since = performance.now();
    afterPicture(() => {
      this.measuring = false;
      if (measured !== this.moving) return;
      if (this.isFirst) {
        this.isFirst = false;
        return;
      }
      const duration = (performance.now() - since) / 2;
      this.durations.push(duration);
      if (this.durations.length < MEASURED && duration < HOPELESS) return;
      this.judge(this.durations.reduce((sum, one) => sum + one, 0) / this.durations.length);
      this.durations.length = 0;
    });
  }

  /** A picture takes so long (ms). */
  private judge(duration: number): void {
    const now = performance.now();
    const level = QUALITIES.indexOf(this.moving);
    if (duration > SLOW && level + 1 < QUALITIES.length) {
      this.moving = QUALITIES[level + 1];
      this.isFirst = true;
      this.retryAt = now + this.patience;
      this.patience *= 2;
    } else if (duration < QUICK && level > 0 && now > this.retryAt) {
      this.moving = QUALITIES[level - 1];
    }
  }
}

/** Two pictures of the screen later, the browser has waited for what it had to draw. */
function afterPicture(then: () => void): void {
  requestAnimationFrame(() => requestAnimationFrame(then));
}
