// The page that a server brings along: which of its parts is shown, and in which order it begins.

import { connect, NappeError } from '../../../client/typescript/src/index.ts';
import { admitted, enter, takeCode } from './live/access.ts';
import { element } from './page/dom.ts';
import { showList } from './live/list.ts';
import { pass, stand } from './page/notice.ts';
import { keptWarnings, takeScenes } from './live/own.ts';
import { learn } from './live/pupil.ts';
import type { Ray } from './picture/ray.ts';
import { SessionPage } from './live/session_page.ts';
import { Themes } from './page/theme.ts';
import { absent, lost, odd, unreadable } from './live/words.ts';

/** What scripts and tests may use. */
interface Handles {
  /** What the page shows is there, or the page says why it is not. */
  ready: Promise<void>;
  /** The session that is shown; null for the list. */
  session: SessionPage | null;
  litShare(): number;
  /** Positions of the frame that is drawn (m). */
  positions(): Float32Array;
  /** The half-line that is seen at a place of the window (CSS pixels). */
  ray(x: number, y: number): Ray | null;
  renderer(): string;
}

/** Seconds without a byte after which the line counts as broken: the server says something every 5 s. */
const SILENCE = 8;
/** Between two attempts to begin (ms). */
const AGAIN = 1_000;

async function start(handles: Handles, themes: Themes): Promise<void> {
  const client = connect('.', { silenceSeconds: SILENCE });
  let code = takeCode();
  takeScenes(client);
  const id = new URLSearchParams(location.search).get('session') ?? '';
  for (let attempt = 1; ; attempt++) {
    try {
      await enter(client, code);
      if (code !== '' && id !== '') await learn(client, id);
      // It works once.
      code = '';
      if (id === '') return await showList(client);
      const session = await admitted(client, () => client.get(id));
      if (attempt > 1) stand(null);
      handles.session = new SessionPage(client, session, themes);
      const warnings = keptWarnings(session.sessionId);
      if (warnings.length > 0) pass(odd(warnings));
      return await handles.session.ready;
    } catch (error) {
      if (!(error instanceof NappeError)) throw error;
      if (error.reason === 'SESSION_NOT_FOUND') return stand(absent);
      if (!error.isTransient) return stand(unreadable(error));
      stand(lost(attempt));
      await new Promise((resolve) => setTimeout(resolve, AGAIN));
    }
  }
}

const picture = () => handles.session?.picture ?? null;
const handles: Handles = {
  ready: Promise.resolve(),
  session: null,
  litShare: () => picture()?.stage.litShare() ?? 0,
  positions: () => picture()?.view.positions() ?? new Float32Array(0),
  ray: (x, y) => picture()?.view.ray(x, y) ?? null,
  renderer: () => picture()?.stage.rendererName() ?? '',
};
const themes = new Themes();
element('old').hidden = true;
// A link that is pasted into the tab changes only what stands behind #.
addEventListener('hashchange', () => {
  if (location.hash !== '') location.reload();
});
element('desk-theme').addEventListener('click', () => themes.toggle());
handles.ready = start(handles, themes);
(window as unknown as { nappe: Handles }).nappe = handles;
