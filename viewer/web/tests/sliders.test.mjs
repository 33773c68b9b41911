// Scales of sliders, what they change, and how that is taken back.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { load } from './bundle.mjs';

const { Knobs, PLACES, knobsOf, placeOf, valueAt } = await load('src/live/knobs.ts');
const [STRETCH, BEND] = [1, 3];

/** Parameters of two bodies, of which the second has springs that differ. */
function parameters({ gravity = { x: 0, y: -9.81, z: 0 }, drag = 0, stiffness = 200 } = {}) {
  const springs = (kind, min, max, damping) => ({ kind, minStiffness: min, maxStiffness: max, minDamping: damping, maxDamping: damping });
  return {
    gravity, wind: undefined, colliderPoses: [], forces: [],
    cloths: [
      { body: 'a sheet', drag, springs: [springs(STRETCH, stiffness, stiffness, 0.02), springs(BEND, 5, 5, 0)] },
      { body: 'other', drag, springs: [springs(STRETCH, 10, 40, 0.1)] },
    ],
  };
}

function knobs(...from) {
  const all = new Knobs();
  all.hear(parameters(...from), 0n);
  return all;
}

test('a scale has its value at the place that shows it, and both ends', () => {
  for (const { scale, value, key } of knobsOf(parameters({ drag: 1e-4 }))) {
    for (let place = 0; place <= PLACES; place++) assert.equal(placeOf(scale, valueAt(scale, place)), place, `${key}, ${place}`);
    if (value === null) continue;
    const near = valueAt(scale, placeOf(scale, value));
    assert.ok(Math.abs(near - value) <= 0.01 * Math.abs(value) + 1e-12, `${key}: ${near}, not ${value}`);
  }
  const { scale } = knobsOf(parameters()).find(({ key }) => key === 'gravity 1');
  assert.deepEqual([valueAt(scale, 0), valueAt(scale, PLACES / 2), valueAt(scale, PLACES)], [-20, 0, 20]);
  assert.equal(placeOf(scale, 1e6), PLACES, 'what others set may lie beyond');
});

test('amounts go by a logarithm over three decades on either side, and to 0', () => {
  const of = (key) => knobsOf(parameters()).find((knob) => knob.key === key).scale;
  const stiffness = of('stiffness 1 a sheet');
  assert.deepEqual([valueAt(stiffness, 0), valueAt(stiffness, 1), valueAt(stiffness, PLACES)], [0, 0.2, 2e5]);
  const half = Math.sqrt(valueAt(stiffness, 301) * valueAt(stiffness, 501)) / valueAt(stiffness, 401);
  assert.ok(Math.abs(half - 1) < 1e-3, 'places as far apart are the same factor');
  for (const key of ['drag', 'damping 3 a sheet']) {
    assert.equal(placeOf(of(key), 0), 0);
    assert.ok(valueAt(of(key), PLACES) > 0, 'what begins at 0 can be moved');
  }
});

test('a component of gravity goes with the others, and springs by body and kind', () => {
  const all = knobs();
  all.set('gravity 0', 3);
  assert.deepEqual(all.changes(['gravity 0']), { gravity: { x: 3, y: -9.81, z: 0 }, springs: [] });
  all.set('gravity 1', -1);
  assert.deepEqual(all.changes(['gravity 1']).gravity, { x: 3, y: -1, z: 0 }, 'what has not taken effect yet is not lost');
  all.set('stiffness 1 a sheet', 70);
  assert.deepEqual(all.changes(['stiffness 1 a sheet']), { springs: [{ body: 'a sheet', kind: STRETCH, stiffness: 70 }] });
  all.set('damping 3 a sheet', 0.5);
  all.set('drag', 0.1);
  assert.deepEqual(all.changes(['damping 3 a sheet', 'drag']), { drag: 0.1, springs: [{ body: 'a sheet', kind: BEND, damping: 0.5 }] });
});

test('a slider stays where it was moved until that has taken effect, then follows others', () => {
  const all = knobs();
  const key = 'stiffness 1 a sheet';
  all.set(key, 300);
  all.hear(parameters(), 4n);
  assert.equal(all.value(key), 300, 'the server has not answered');
  all.answered(key, 300, 5n);
  all.hear(parameters(), 5n);
  assert.equal(all.value(key), 300, 'step 5 has not been taken');
  all.hear(parameters({ stiffness: 300 }), 6n);
  assert.equal(all.value(key), 300);
  all.hear(parameters({ stiffness: 20 }), 9n);
  assert.equal(all.value(key), 20, 'another client changed it');

  all.set(key, 400);
  all.set(key, 500);
  all.answered(key, 400, 9n);
  all.hear(parameters({ stiffness: 400 }), 12n);
  assert.equal(all.value(key), 500, 'the newer one is still on its way');
  all.refused(key);
  assert.equal(all.value(key), 400);
});

test('what was moved goes back one by one, and all at once to the start', () => {
  const all = knobs();
  for (const [key, value] of [['drag', 0.1], ['gravity 1', -2], ['drag', 0.2]]) {
    all.keep(key);
    all.set(key, value);
  }
  assert.deepEqual([all.back(), all.value('drag'), all.value('gravity 1')], ['drag', 0.1, -2]);
  assert.deepEqual(all.backToStart().sort(), ['drag', 'gravity 1']);
  assert.deepEqual([all.value('drag'), all.value('gravity 1')], [0, -9.81]);
  assert.deepEqual(all.backToStart(), [], 'all are there');
  assert.deepEqual([all.back(), all.back()].sort(), ['drag', 'gravity 1'], 'and that can be taken back');
  assert.deepEqual([all.value('drag'), all.value('gravity 1')], [0.1, -2]);
  assert.deepEqual([all.back(), all.back(), all.back()], ['gravity 1', 'drag', null]);
});

test('springs that differ are not one number, and are left alone', () => {
  const all = knobs();
  const key = 'stiffness 1 other';
  assert.equal(all.value(key), null);
  all.keep(key);
  assert.deepEqual([all.back(), all.backToStart()], [null, []]);
});
