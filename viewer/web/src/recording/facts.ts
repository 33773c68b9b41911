// What the page says of a recording in words: its title and time, how it ended, and what it is.

import { element, make } from '../page/dom.ts';
import { sheet } from '../page/keys.ts';
import { readableLength, timeDigits } from '../page/numbers.ts';
import type { Failure, Recording } from './recording.ts';

/** Says what never changes. */
export function describe(recording: Recording): void {
  const { scene, source } = recording.head;
  const title = scene.title === '' ? 'Recording' : scene.title;
  document.title = `${title} – nappe`;
  element('title').textContent = title;
  say('end', outcome(recording));
  const failure = recording.end?.failure ?? null;
  if (failure !== null) {
    say('failure', headline(failure));
    say('failure-why', failure.message);
    element('banner').hidden = false;
    element('app').classList.add('failed');
  }
  element('about-rows').append(...rows(recording).flatMap(([name, value]) => [make('dt', '', name), make('dd', '', value)]));
  element('source').hidden = source === null;
  element('source-text').textContent = source;
  element('about').hidden = false;
  sheet('about', 'about-sheet', 'about-close');
}

/** Says what changes with each frame. */
export function showFacts(recording: Recording, index: number): void {
  const { facts, frameCount } = recording;
  const spacing = (facts[frameCount - 1].time - facts[0].time) / Math.max(1, frameCount - 1);
  element('facts').hidden = false;
  element('time').textContent = `${facts[index].time.toFixed(timeDigits(spacing))} s`;
  element('frame').textContent = `frame ${index + 1} of ${frameCount}`;
  element('bound').textContent = `within ${readableLength(facts[index].bound)} of what was computed`;
}

/** How a session failed, in a line. */
function headline({ diverged, time, step, particle, reason }: Failure): string {
  const where = particle === null ? '' : `, particle ${particle}`;
  return `${diverged ? 'Diverged' : 'Failed'} at ${Number(time.toPrecision(6))} s: step ${step}${where} (${reason})`;
}

/** How the recording ended if that was not the end of its session; a failure has a place of its own. */
function outcome({ end, frameCount, facts }: Recording): string {
  const whole = `${frameCount} whole ${frameCount === 1 ? 'frame is' : 'frames are'} shown`;
  if (end === null) return `This file was cut off: ${whole}.`;
  if (end.finished || end.failure !== null || frameCount === 0) return '';
  return `Recorded up to step ${facts[frameCount - 1].step}, before the session's end.`;
}

function rows({ head, end, facts, frameCount }: Recording): [string, string][] {
  const { scene, program, precision, dt } = head;
  const failure = end?.failure ?? null;
  const known: [string, string | null][] = [
    ['Particles', scene.particleCount.toLocaleString('en')],
    ['Steps', frameCount === 0 ? null : facts[frameCount - 1].step.toLocaleString('en')],
    ['Length of a step', dt > 0 ? `${Number((1e3 * dt).toPrecision(4))} ms` : null],
    ['Computed in', precision === '' ? null : precision],
    ['Recorded by', program],
    ['State hash', end?.hash ?? null],
    ['Failure', failure === null ? null : failure.message],
  ];
  return known.filter((row): row is [string, string] => row[1] !== null);
}

function say(id: string, sentence: string): void {
  element(id).hidden = sentence === '';
  element(id).textContent = sentence;
}
