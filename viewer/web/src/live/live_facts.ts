// What the page says of a session in words: its title, how it stands, and what it is.

import { type Session, SessionState } from '../../../../client/typescript/src/index.ts';
import { element, make } from '../page/dom.ts';
import type { Carried } from './line.ts';
import { timeDigits } from '../page/numbers.ts';

export const STATES: Record<SessionState, string> = {
  [SessionState.UNSPECIFIED]: 'Unknown', [SessionState.PAUSED]: 'Paused', [SessionState.PLAYING]: 'Playing',
  [SessionState.FINISHED]: 'Finished', [SessionState.FAILED]: 'Failed',
};

/** Of a session without a title, its id. */
export const titleOf = ({ title, sessionId }: Session): string => (title.trim() === '' ? sessionId : title);

export const many = (number: number | bigint): string => number.toLocaleString('en');

/** What a session is, and what is counted in it. */
export function showSession(session: Session): void {
  document.title = `${titleOf(session)} – nappe`;
  element('title').textContent = titleOf(session);
  element('about-rows').replaceChildren(...rows(session).flatMap(([name, value]) => [make('dt', '', name), make('dd', '', value)]));
}

export function showState(state: SessionState): void {
  const shown = element('state');
  if (shown.textContent === STATES[state]) return;
  shown.textContent = STATES[state];
  shown.dataset['state'] = SessionState[state];
}

/** `dt` is the time between two steps (s). */
export function showTime(time: number, step: bigint, dt: number): void {
  element('time').textContent = `${time.toFixed(timeDigits(dt))} s`;
  element('frame').textContent = `step ${many(step)}`;
}

/** `age` is how old the picture is (s), where that is known and much; `pace` is simulated seconds per second. */
export function showLine({ frames, bytes, leftOut }: Carried, pace: number | null, age: number | null): void {
  const parts = [
    `${frames} ${frames === 1 ? 'picture' : 'pictures'}/s`, `${readableBytes(bytes)}/s`, `${many(leftOut)} left out`,
    pace === null ? '' : `${pace.toPrecision(2)}× real time`, age === null ? '' : `about ${age.toFixed(1)} s old`,
  ];
  element('corner').hidden = false;
  element('corner').replaceChildren(...parts.filter((part) => part !== '').map((part) => make('span', '', part)));
}

function readableBytes(bytes: number): string {
  if (bytes < 1e3) return `${bytes} B`;
  const [size, unit] = bytes < 1e6 ? [bytes / 1e3, 'kB'] : [bytes / 1e6, 'MB'];
  return `${size.toFixed(size < 10 ? 1 : 0)} ${unit}`;
}

function rows(session: Session): [string, string][] {
  const { snowParticleCount: snow, particleCount, stepLimit, notices } = { ...session, notices: session.diagnostics?.notices };
  const doubts: [string, bigint][] = notices === undefined ? [] : [
    ['Solves cut short', notices.cappedSolves], ['Indefinite solves', notices.indefiniteSolves],
    ['Particles through colliders', notices.passedParticles], ['Pinched particles', notices.pinchedParticles],
    ['Torn particles', notices.tornParticles],
    ['Steps taken again', notices.rejectedSteps],
  ];
  const known: [string, string | null][] = [
    ['Id', session.sessionId],
    ['Particles', snow > 0n && snow < particleCount ? `${many(particleCount)}, ${many(snow)} of snow` : many(particleCount)],
    ['Springs', session.springCount > 0n ? many(session.springCount) : null],
    ['Steps', stepLimit > 0n ? `${many(session.step)} of ${many(stepLimit)}` : many(session.step)],
    ['Frames', session.frameIntervalSteps > 1 ? `every ${many(session.frameIntervalSteps)} steps` : 'every step'],
    ['Length of a step', `${Number((1e3 * session.dtSeconds).toPrecision(4))} ms`],
    ['Computed in', session.precision === 2 ? 'binary64' : 'binary32'],
    ['Threads', many(session.threadCount)],
    ['Watchers', many(session.watcherCount)],
    ['State hash', session.stateHash === undefined ? null : session.stateHash.toString(16).padStart(16, '0')],
    ...doubts.map(([name, count]): [string, string | null] => [name, count > 0n ? many(count) : null]),
  ];
  return known.filter((row): row is [string, string] => row[1] !== null);
}
