// The upright axis of plots: places and labels of numbers from 1e-300 to 1e300, and where a logarithm is chosen.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { load } from './bundle.mjs';

const { isWide, linear, logarithmic } = await load('src/plots/axis.ts');
const { timeDigits } = await load('src/page/numbers.ts');

const FALL = Array.from({ length: 60 }, (_, i) => 12 * (i / 60) ** 2);
const EXPLOSION = Array.from({ length: 41 }, (_, i) => 10 ** i);
const HARD = [
  [0], [5, 5, 5], [-3, -3], [1e40, 2e40], [1e300, -1e300, 0], [1e-300, 2e-300], [-1e40, 1e40, 0, 1e-12], EXPLOSION, FALL, [],
  [450.121, 450.129], [1e-320, 1], [2, 3, 9], [3, 70, 0], [-4, 40],
];

for (const [name, make] of [['linear', linear], ['logarithmic', logarithmic]]) {
  test(`a ${name} axis of any numbers is finite, in order, and has labels within it`, () => {
    for (const numbers of HARD) {
      const { place, range, ticks } = make(numbers);
      const said = `${name}, ${numbers.slice(0, 4)}`;
      assert.ok(range.every(Number.isFinite) && range[0] < range[1], `${said}: ${range}`);
      for (const number of numbers) {
        const at = place(number);
        assert.ok(at >= range[0] && at <= range[1], `${said}: ${number} stands at ${at} outside ${range}`);
      }
      assert.ok(ticks.length >= 1 && ticks.length <= 12, `${said}: ${ticks.length} labels`);
      ticks.forEach(({ at }, i) => assert.ok(at >= range[0] && at <= range[1] && (i === 0 || at > ticks[i - 1].at), said));
      assert.equal(new Set(ticks.map(({ label }) => label)).size, ticks.length, `${said}: ${ticks.map(({ label }) => label)}`);
      assert.ok(ticks.every(({ label }) => label.length <= 10), `${said}: ${ticks.map(({ label }) => label)}`);
    }
  });
}

test('labels say what stands there', () => {
  for (const numbers of [[0, 250], [-2, 1.5], [1e40, 2e40], [3e-7, 9e-7]]) {
    const { place, ticks } = linear(numbers);
    for (const { at, label } of ticks) {
      assert.ok(Math.abs(place(Number(label)) - at) < 1e-6, `${label} stands at ${at}, not ${place(Number(label))}`);
    }
  }
  const { place, ticks } = logarithmic(EXPLOSION);
  for (const { at, label } of ticks) assert.ok(Math.abs(place(Number(label)) - at) < 1e-9, label);
});

test('an explosion is a straight line', () => {
  const { place } = logarithmic(EXPLOSION);
  const steps = EXPLOSION.slice(4).map((number, i) => place(number) - place(EXPLOSION[i + 3]));
  for (const step of steps) assert.ok(Math.abs(step - 1) < 0.01, `${step}`);
  // Also downwards, as an energy below 0 explodes.
  assert.equal(place(-1e20), -place(1e20));
});

test('a logarithm is chosen for more than three decades, and not for what starts from rest', () => {
  assert.equal(isWide([FALL]), false);
  assert.equal(isWide([[5, 5, 5], [0, 0, 0]]), false);
  assert.equal(isWide([[null, 5, 5, 5], [null, 0, 1e-9, 1]]), false, 'what is small beside another');
  assert.equal(isWide([FALL.map((x) => x - 30)]), false);
  assert.equal(isWide([Array.from({ length: 100 }, (_, i) => 0.9 * 10 ** (0.03 * i))]), false);
  assert.equal(isWide([FALL.slice(0, 41), EXPLOSION]), true);
  assert.equal(isWide([Array.from({ length: 100 }, (_, i) => 10 ** (-0.05 * i))]), true, 'what decays');
  assert.equal(isWide([[...FALL, 1e5, 1e9]]), true, 'what explodes in the last two frames');
  assert.equal(isWide([[]]), false);
});

test('times have the digits that tell frames apart', () => {
  assert.deepEqual([1 / 60, 0.008, 0.0025, 1e-6, 0, 2].map(timeDigits), [3, 3, 4, 6, 3, 3]);
});
