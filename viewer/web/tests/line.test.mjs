// What the line carries, what is asked of it, and what is kept of a minute.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { load } from './bundle.mjs';

const { Line, isTold, rateFor } = await load('src/live/line.ts');
const { Minute } = await load('src/plots/minute.ts');

test('frames, bytes and what was left out are those of the last second', () => {
  const line = new Line();
  for (let i = 0; i < 30; i++) {
    line.received(100 * i, 1000, 2);
    if (i % 2 === 0) line.drawn(100 * i + 1, 1);
  }
  assert.deepEqual(line.read(2950), { frames: 5, bytes: 10_000, leftOut: 25 });
  assert.deepEqual(line.read(10_000), { frames: 0, bytes: 0, leftOut: 0 });
});

test('a line that carries what is made keeps its rate, also where little is made', () => {
  assert.equal(rateFor(60, 60, 60), 60);
  assert.equal(rateFor(57, 500, 60), 60, 'what is above the rate is left out');
  assert.equal(rateFor(12, 12, 60), 60, 'a slow session is no slow line');
});

test('a second in which all of a few frames came does not tell what the line carries', () => {
  assert.equal(isTold(12, 12, 60), false);
  assert.equal(isTold(40, 40, 60), false);
  assert.equal(isTold(60, 60, 60), true);
  assert.equal(isTold(57, 500, 60), true);
  assert.equal(isTold(8, 12, 60), true, 'a line that carries less than a few frames is slow');
});

test('a slow line is asked for 70 % of what it carried, and for something', () => {
  assert.equal(rateFor(20, 60, 60), 14);
  assert.equal(rateFor(20, 1000, 60), 14);
  assert.equal(rateFor(0.4, 50, 60), 1);
});

test('a minute keeps the last 60 s, no more than 3600 frames, and no frame twice', () => {
  const frame = (time) => ({ time, kinetic: time, elastic: null, gravitational: null, stretch: null, dt: null });
  const slow = new Minute();
  for (let time = 0; time <= 100; time += 2) slow.add(frame(time));
  assert.deepEqual([slow.frames[0].time, slow.frames.at(-1).time, slow.frames.length], [40, 100, 31]);
  slow.add(frame(100));
  slow.add(frame(99));
  assert.equal(slow.frames.length, 31, 'what does not come later is left out');

  const quick = new Minute();
  for (let i = 0; i < 5000; i++) quick.add(frame(i / 1000));
  assert.deepEqual([quick.frames.length, quick.frames.at(-1).time], [3600, 4.999]);
});
