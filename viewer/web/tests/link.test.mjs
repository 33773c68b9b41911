// Links to a time and a view, and the names and contents of what is saved.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { load } from './bundle.mjs';

const { readLink, writeLink } = await load('src/recording/link.ts');
const { csv, fileName } = await load('src/recording/save.ts');

test('a link says what it was made of', () => {
  const camera = { eye: [1.25, -2.5, 1e5], target: [0, 1e-3, -7] };
  for (const place of [{ time: 1.2, camera }, { time: 0, camera: null }, { time: null, camera }, { time: null, camera: null }]) {
    assert.deepEqual(readLink(writeLink(place)), place);
  }
  assert.equal(writeLink({ time: 1.2, camera: null }), '#t=1.2');
});

test('what is no link says nothing', () => {
  const nothing = { time: null, camera: null };
  for (const hash of ['', '#', '#t=', '#t=abc', '#t=1,2', '#t=NaN', '#t=Infinity', '#view=1,2,3', '#view=1,2,3,4,5,x', '#%', '#view=0,0,0,0,0,0']) {
    assert.deepEqual(readLink(hash), nothing, hash);
  }
  assert.deepEqual(readLink('#t=2&view=broken'), { time: 2, camera: null });
});

test('the table has a line for each frame and nothing where nothing is known', () => {
  const row = { frame: 0, step: 0, time: 0, bound: 1, kinetic: null, elastic: 1e40, gravitational: -2, stretch: null, dt: 0.005 };
  const lines = csv([row, { ...row, frame: 1, step: 4, time: 0.02 }]).split('\n');
  assert.deepEqual(lines, [
    'frame,step,time_s,kinetic_J,elastic_J,gravitational_J,stretch,dt_s', '0,0,0,,1e+40,-2,,0.005', '1,4,0.02,,1e+40,-2,,0.005', '',
  ]);
});

test('names of files are names, whatever the title is', () => {
  assert.equal(fileName('A flag that flutters', '.csv'), 'a-flag-that-flutters.csv');
  assert.equal(fileName('../../etc/passwd', '.csv'), 'etc-passwd.csv');
  assert.equal(fileName('</script><b>', '.png'), 'script-b.png');
  assert.equal(fileName('Neige fraîche – été', '.toml'), 'neige-fraîche-été.toml');
  assert.equal(fileName('***', '.csv'), 'recording.csv');
  assert.ok(fileName('x'.repeat(1000), '.csv').length < 80);
});
