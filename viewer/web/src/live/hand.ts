// The hand: takes a pin, or a cloth at any place of the picture, and draws it along until it lets go.
//
// Enters: the pointer over the picture, while the hand is on; frames that were drawn. Leaves: changes, one call at a time, of which
// only the newest waits; a line from what is held to where it is drawn.

import { type Client, type Session, SessionState } from '../../../../client/typescript/src/index.ts';
import { element } from '../page/dom.ts';
import { type Actions, press } from '../page/keys.ts';
import { length } from '../picture/geometry.ts';
import { type Hit, nearestHit, nearestSeen, onPlane, patchAround } from '../picture/pick.ts';
import type { Place } from '../picture/ray.ts';
import type { Picture } from '../picture/viewing.ts';
import { type Body, type Vector, isPoints } from '../scene.ts';
import { ClothHold, type Hold, PinHold, RENEWED } from './holds.ts';
import { Newest } from './newest.ts';

/** A pin is taken from within so many pixels, and so is a body without triangles; by a finger from farther. */
const WITHIN = { mouse: 12, touch: 24 };
/** While a session stands, changes wait for its next step: between two of them so long is waited (ms). */
const CALM = 100;

/** What is held by a pointer. */
interface Held {
  pointer: number;
  hold: Hold;
  /** What is held moves in this plane, along the picture. */
  point: Vector;
  normal: Vector;
  /** Where it is drawn (m). */
  target: Vector;
  /** When the last change was sent (ms), and the simulated time of the newest picture then (s). */
  sent: number;
  sentTime: number;
}

export class Hand {
  private isOn = false;
  private isEnded = false;
  private held: Held | null = null;
  private state = SessionState.UNSPECIFIED;
  /** Simulated time of the newest picture (s). */
  private time = 0;
  private readonly calls = new Newest();
  private readonly canvas = element<HTMLCanvasElement>('canvas');
  private readonly line = document.getElementById('pull')!;
  private readonly where = (particle: number): Vector => this.picture.view.particle(particle);

  /** `session` gives how it stands; `refused` hears what was not done. */
  constructor(
    private readonly client: Client, private readonly session: () => Session, private readonly picture: Picture,
    private readonly refused: (doing: string, error: unknown) => void,
  ) {
    // Before what turns the view, which listens to the canvas itself, and rests while something is held.
    element('stage').addEventListener('pointerdown', (event) => this.take(event), { capture: true });
    this.canvas.addEventListener('pointermove', (event) => this.move(event));
    for (const end of ['pointerup', 'pointercancel', 'lostpointercapture'] as const) {
      this.canvas.addEventListener(end, ({ pointerId }) => {
        if (pointerId === this.held?.pointer) this.letGo();
      });
    }
    addEventListener('blur', () => this.letGo());
    addEventListener('pagehide', () => this.letGo());
  }

  get actions(): Actions {
    return { g: () => this.toggle() };
  }

  /** How the session stands, as it was told last. */
  show(state: SessionState): void {
    this.state = state;
    const isOver = this.isEnded || state === SessionState.FINISHED || state === SessionState.FAILED;
    if (isOver && this.isOn) this.toggle();
    element<HTMLButtonElement>('hand').disabled = isOver;
  }

  /** Nothing can be changed by this page any more. */
  end(): void {
    this.isEnded = true;
    this.show(this.state);
  }

  /** A picture of a simulated time (s) was drawn. */
  drawn(time: number): void {
    this.time = time;
    const { held } = this;
    if (held === null) return;
    this.draw(held);
    // Time goes back where a session is set to its start.
    if (held.hold.isRenewed && Math.abs(time - held.sentTime) >= RENEWED) this.send(held);
  }

  private toggle(): void {
    if (element<HTMLButtonElement>('hand').disabled) return;
    this.isOn = !this.isOn;
    press('hand', this.isOn);
    this.canvas.classList.toggle('hand', this.isOn);
    if (!this.isOn) this.letGo();
  }

  private take(event: PointerEvent): void {
    if (!this.isOn || this.held !== null || event.target !== this.canvas || event.button !== 0) return;
    const found = this.find({ x: event.clientX, y: event.clientY }, event.pointerType === 'touch' ? WITHIN.touch : WITHIN.mouse);
    if (found === null) return;
    this.picture.stage.listen(false);
    this.canvas.setPointerCapture(event.pointerId);
    const { hold, point } = found;
    this.held = { pointer: event.pointerId, hold, point, target: point, normal: this.picture.stage.facing(), sent: performance.now(), sentTime: this.time };
    this.draw(this.held);
    this.send(this.held);
  }

  /** What is at a place of the window; null where the view is to be turned. */
  private find(at: Place, within: number): { hold: Hold; point: Vector } | null {
    const { view, stage } = this.picture;
    const { dtSeconds, parameters } = this.session();
    const bodies = view.bodies.filter((body) => !isPoints(body));
    const seen = (particle: number) => view.seen(this.where(particle));
    const pin = nearestSeen(bodies.flatMap(({ pins }) => [...pins]), seen, at, within);
    if (pin !== null) return { hold: new PinHold(pin, stage.radius, dtSeconds), point: this.where(pin) };

    const positions = view.positions();
    const hit = nearestHit(view.ray(at.x, at.y), positions, bodies) ?? this.nearRope(bodies, seen, at, within);
    const patch = hit && patchAround(hit, positions);
    if (hit === null || patch === null || patch.particles.length === 0) return null;
    const { x, y, z } = parameters?.gravity ?? { x: 0, y: 0, z: 0 };
    return { hold: new ClothHold(hit, patch, this.where, length([x, y, z]), dtSeconds), point: hit.point };
  }

  /** A particle of a body that has no triangles. */
  private nearRope(bodies: readonly Body[], seen: (particle: number) => Place | null, at: Place, within: number): Hit | null {
    for (const body of bodies) {
      if (body.triangles.length > 0) continue;
      const particles = Array.from({ length: body.particleCount }, (_, index) => body.firstParticle + index);
      const found = nearestSeen(particles, seen, at, within);
      if (found !== null) return { body, corners: [found], point: this.where(found) };
    }
    return null;
  }

  private move({ pointerId, clientX, clientY }: PointerEvent): void {
    const { held } = this;
    if (pointerId !== held?.pointer) return;
    held.target = onPlane(this.picture.view.ray(clientX, clientY), held.point, held.normal);
    this.draw(held);
    this.send(held);
  }

  /** Sends the target that holds when the call is made. */
  private send(held: Held): void {
    this.calls.put(async () => {
      const now = performance.now();
      const { target, hold } = held;
      const changes = hold.to(target, hold.at(this.where), ((now - held.sent) / 1e3) * speed());
      held.sent = now;
      held.sentTime = this.time;
      try {
        await this.client.update(this.session(), changes);
      } catch (error) {
        if (this.held === held) this.drop();
        this.refused(hold.name, error);
      }
      if (this.state !== SessionState.PLAYING) await new Promise((resolve) => setTimeout(resolve, CALM));
    });
  }

  private letGo(): void {
    const changes = this.held?.hold.end() ?? null;
    this.drop();
    if (changes === null) return;
    // One that is not answered ends by its time.
    this.calls.put(() => this.client.update(this.session(), changes).then(() => undefined, () => undefined));
  }

  private drop(): void {
    this.held = null;
    this.picture.stage.listen(true);
    this.line.toggleAttribute('hidden', true);
  }

  private draw({ hold, target }: Held): void {
    const { view } = this.picture;
    const at = hold.at(this.where);
    const [from, to] = [view.seen(at), view.seen(target)];
    this.line.toggleAttribute('hidden', from === null || to === null);
    if (from === null || to === null) return;
    const { left, top } = element('stage').getBoundingClientRect();
    const [line, end] = this.line.children;
    const put = (part: Element, numbers: Record<string, number>) => Object.entries(numbers).forEach(([name, number]) => part.setAttribute(name, number.toFixed(1)));
    put(line, { x1: from.x - left, y1: from.y - top, x2: to.x - left, y2: to.y - top });
    put(end, { cx: to.x - left, cy: to.y - top });
    this.line.classList.toggle('most', hold.isAtBound(target, at));
  }
}

/** Simulated seconds per second, as the list has it; as fast as possible counts as real time. */
function speed(): number {
  return Number(element<HTMLSelectElement>('speed').value) || 1;
}
