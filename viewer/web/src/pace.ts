// How finely pictures are drawn: all the time on a graphics card, only at rest where a picture takes long.
//
// Enters: when pictures are drawn, and whether the view moves. Leaves: how finely to draw the next one.

/** A picture that takes longer (ms) is slow: less than 20 per second. */
const SLOW = 50;
/** Pictures that are measured before one judges. */
const MEASURED = 3;
/** The view is at rest so long (ms) after the last picture is on the screen. */
const REST = 250;

/** `fine`: with occlusion; `plain`: without; `coarse`: without, at half the resolution. */
export type Quality = 'fine' | 'plain' | 'coarse';

export class Pace {
  private readonly durations: number[] = [];
  private slow = false;
  private measuring = false;
  private timer = 0;
  private pictures = 0;

  /** `settle` draws a fine picture when nothing has moved for a while. */
  constructor(private readonly settle: () => void) {}

  /** For the next picture; `what` changed since the last. */
  quality(what: 'view' | 'scene'): Quality {
    if (!this.slow) return 'fine';
    return what === 'view' ? 'coarse' : 'plain';
  }

  /** A picture of a quality was drawn just now. */
  drawn(quality: Quality): void {
    clearTimeout(this.timer);
    const picture = ++this.pictures;
    if (quality === 'fine') return this.measure();
    afterPicture(() => {
      if (picture === this.pictures) this.timer = window.setTimeout(this.settle, REST);
    });
  }

  /** Another size takes another time. */
  reset(): void {
    this.slow = false;
    this.durations.length = 0;
  }

  private measure(): void {
    if (this.measuring || this.slow) return;
    this.measuring = true;
    const since = performance.now();
    afterPicture(() => {
      this.measuring = false;
      this.durations.push((performance.now() - since) / 2);
      if (this.durations.length < MEASURED) return;
      this.slow = this.durations.reduce((sum, one) => sum + one, 0) > SLOW * MEASURED;
      this.durations.length = 0;
    });
  }
}

/** Two pictures of the screen later, the browser has waited for what it had to draw. */
function afterPicture(then: () => void): void {
  requestAnimationFrame(() => requestAnimationFrame(then));
}
