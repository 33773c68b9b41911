// The list of sessions, which is renewed while it is shown, and new ones of shipped scenes.

import { type Client, NappeError, type Session, SessionState } from '../../../../client/typescript/src/index.ts';
import { admitted } from './access.ts';
import { element, make } from '../page/dom.ts';
import { answering } from './late.ts';
import { STATES, many, titleOf } from './live_facts.ts';
import { pass, stand } from '../page/notice.ts';
import { back, lost, refused } from './words.ts';

/** Between two looks at the server (ms). */
const EVERY = 2_000;

/** Shows the list, and resolves once it is there. */
export async function showList(client: Client): Promise<void> {
  const list = new List(client);
  element('desk').hidden = false;
  await list.look();
  list.goOn();
}

class List {
  /** By their uids. */
  private readonly cards = new Map<string, Card>();
  private failures = 0;
  private knowsServer = false;

  constructor(private readonly client: Client) {
    element('new').addEventListener('submit', (event) => {
      event.preventDefault();
      void this.create();
    });
  }

  /** Looks again from now on, while the page is seen. */
  goOn(): void {
    setTimeout(() => {
      if (document.hidden) document.addEventListener('visibilitychange', () => void this.look().then(() => this.goOn()), { once: true });
      else void this.look().then(() => this.goOn());
    }, EVERY);
  }

  async look(): Promise<void> {
    try {
      // A server that was away may be another one now.
      if (!this.knowsServer) await this.describe();
      this.show(await admitted(this.client, () => this.client.list()));
      if (this.failures > 0) {
        stand(null);
        pass(back);
      }
      this.failures = 0;
    } catch (error) {
      this.failures += 1;
      this.knowsServer = false;
      const isAway = error instanceof NappeError && error.isTransient;
      stand(isAway ? lost(this.failures) : refused('the list', error));
    }
  }

  private async describe(): Promise<void> {
    const { version, scenes, threadCount } = await admitted(this.client, () => this.client.info());
    this.knowsServer = true;
    element('server').textContent = `nappe ${version} at ${location.host}, ${threadCount} ${threadCount === 1 ? 'core' : 'cores'}`;
    const select = element<HTMLSelectElement>('scene');
    const chosen = select.value;
    select.replaceChildren(...scenes.map((name) => Object.assign(make('option', '', name), { value: name })));
    if (scenes.includes(chosen)) select.value = chosen;
    else if (scenes.includes('demo')) select.value = 'demo';
  }

  private async create(): Promise<void> {
    const button = element<HTMLButtonElement>('create');
    button.disabled = true;
    const answered = answering('the session');
    try {
      const scene = element<HTMLSelectElement>('scene').value;
      const { sessionId } = await admitted(this.client, () => this.client.create({ scene })).finally(answered);
      location.assign(addressOf(sessionId));
    } catch (error) {
      pass(refused('the session', error));
    } finally {
      button.disabled = false;
    }
  }

  /** Cards that stay are kept, so that the one with the focus keeps it. */
  private show(sessions: readonly Session[]): void {
    const uids = new Set(sessions.map(({ uid }) => uid));
    for (const [uid, card] of this.cards) {
      if (uids.has(uid)) continue;
      card.link.parentElement!.remove();
      this.cards.delete(uid);
    }
    const host = element('cards');
    sessions.forEach((session, at) => {
      const card = this.cards.get(session.uid) ?? new Card(session);
      this.cards.set(session.uid, card);
      card.show(session);
      const item = card.link.parentElement!;
      if (host.children[at] !== item) host.insertBefore(item, host.children[at] ?? null);
    });
    element('none').hidden = sessions.length > 0;
  }
}

const addressOf = (id: string): string => `?${new URLSearchParams({ session: id })}`;

/** One session of the list. */
class Card {
  readonly link = make('a', 'card');
  private readonly state = make('span', 'state');
  private readonly numbers = make('span', 'numbers');

  constructor(session: Session) {
    this.link.href = addressOf(session.sessionId);
    this.link.append(make('strong', '', titleOf(session)), this.state, make('span', 'id', session.sessionId), this.numbers);
    make('li').append(this.link);
  }

  show({ state, particleCount, watcherCount, timeSeconds, step }: Session): void {
    this.state.textContent = STATES[state];
    this.state.dataset['state'] = SessionState[state];
    const parts = [
      `${many(particleCount)} ${particleCount === 1n ? 'particle' : 'particles'}`,
      `${many(watcherCount)} ${watcherCount === 1 ? 'watcher' : 'watchers'}`, `${Number(timeSeconds.toPrecision(4))} s, step ${many(step)}`,
    ];
    this.numbers.replaceChildren(...parts.map((part) => make('span', '', part)));
  }
}
