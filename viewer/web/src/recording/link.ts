// The part of the page's address that says what is shown: #t=1.2&view=..., the time and where the camera stands.

import type { Camera } from '../picture/camera.ts';
import type { Vector } from '../scene.ts';

/** What a link says; null for what it does not. */
export interface Place {
  /** s. */
  time: number | null;
  /** In the world (m); null is the view from the start. */
  camera: Camera | null;
}

/** What the part after # says. What is no number there counts as not said. */
export function readLink(hash: string): Place {
  const said = new URLSearchParams(hash.replace(/^#/, ''));
  const time = numbers(said.get('t'), 1);
  const view = numbers(said.get('view'), 6);
  const camera = view === null ? null : { eye: view.slice(0, 3) as unknown as Vector, target: view.slice(3) as unknown as Vector };
  // The eye must stand somewhere else than what it looks at.
  const stands = camera !== null && camera.eye.some((coordinate, axis) => coordinate !== camera.target[axis]);
  return { time: time === null ? null : time[0], camera: stands ? camera : null };
}

/** The part after #, with it. */
export function writeLink({ time, camera }: Place): string {
  const parts = time === null ? [] : [`t=${short(time)}`];
  if (camera !== null) parts.push(`view=${[...camera.eye, ...camera.target].map(short).join(',')}`);
  return `#${parts.join('&')}`;
}

function numbers(text: string | null, count: number): number[] | null {
  if (text === null) return null;
  const all = text.split(',').map((part) => (part.trim() === '' ? NaN : Number(part)));
  return all.length === count && all.every((number) => Math.abs(number) < 1e30) ? all : null;
}

const short = (number: number): string => String(Number(number.toPrecision(6)));
