// Sessions that begin at a frame of the real server: as the one that was never cut, or refused by what is wrong.

import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import { load } from './bundle.mjs';
import { eventually, serve } from './server.mjs';

const { Code, connect, NappeError } = await load('src/index.ts');

const SCENE = `
version = 1
dt = 0.005
steps = 40
frame_interval = 5
wind_at = [{ time = 0.02, velocity = [0, 0, 0] }, { time = 0.1, velocity = [3, 0, 2] }]

[[body]]
name = "sheet"
mesh = { grid = [6, 6], spacing = 0.1 }
mass = { density = 0.2 }
drag = 1e-3
pins = ["top_left", "top_right"]
moving_pin = [{ pin = "top_left", offset = [0.05, 0.05, 0], duration = 0.14 }]
springs = { stretch = { stiffness = 50, damping = 0.02 }, shear = { stiffness = 20, damping = 0.01 } }
`;

let server;
let client;
before(async () => {
  server = await serve();
  client = connect(server.address, { token: server.token });
});
after(() => server.stop());

/** All frames of a session that stands, with velocities, in a precision; the session has ended then. */
async function played(session, precision) {
  const frames = [];
  let isHeard = false;
  const reading = (async () => {
    const options = { every: true, from: 0n, fields: ['velocities'], precision, onChange: () => { isHeard = true; } };
    for await (const frame of client.frames(session, options)) frames.push(frame);
  })();
  await eventually(() => isHeard);
  await client.play(session);
  await reading;
  return frames;
}

for (const precision of ['f32', 'f64']) {
  test(`a session in ${precision} that begins at a frame goes on to the same end`, async () => {
    const whole = await client.create({ sceneText: SCENE, precision });
    const all = await played(whole, precision);
    assert.deepEqual(all.map(({ step }) => step), [0n, 5n, 10n, 15n, 20n, 25n, 30n, 35n, 40n]);
    assert.ok(all.every(({ carried }) => carried.numbers.length > 0 && carried.missing.length === 0));
    for (const at of [1, 3, 7]) {
      const begun = await client.create({ sceneText: SCENE, precision, begin: all[at] });
      assert.deepEqual([begun.step, begun.timeSeconds, begun.frame, begun.warnings], [all[at].step, all[at].time, 0n, []]);
      const rest = await played(begun, precision);
      assert.deepEqual(rest.map(({ step }) => step), all.slice(at).map(({ step }) => step));
      for (const [i, { positions, fields }] of rest.entries()) {
        assert.deepEqual([positions, fields.velocities], [all[at + i].positions, all[at + i].fields.velocities], `frame ${i}, begun at ${at}`);
      }
      assert.equal((await client.get(begun)).stateHash, (await client.get(whole)).stateHash);
      await client.delete(begun);
    }
    await client.delete(whole);
  });
}

test('frames at which no session begins are refused by what is wrong, and leave no session', async () => {
  const whole = await client.create({ sceneText: SCENE, precision: 'f64' });
  // The pin has arrived.
  const frame = (await played(whole, 'f64'))[7];
  const narrow = Object.assign({}, frame, { positions: Float32Array.from(frame.positions), fields: { velocities: Float32Array.from(frame.fields.velocities) } });
  for (const [begin, precision, told] of [
    [narrow, 'f64', 'begin is in f32, and the session is to be in f64; allowed: '],
    [frame, 'f32', 'begin is in f64, and the session is to be in f32; allowed: '],
  ]) {
    const refused = await client.create({ sceneText: SCENE, precision, sessionId: 'begun', begin }).catch((error) => error);
    assert.ok(refused instanceof NappeError, String(refused));
    assert.deepEqual([refused.code, refused.metadata.field], [Code.INVALID_ARGUMENT, 'begin']);
    assert.ok(refused.message.startsWith(told), refused.message);
  }
  const other = SCENE.replace('[6, 6]', '[6, 7]');
  await assert.rejects(client.create({ sceneText: other, begin: frame }), ({ reason, message }) => reason === 'INVALID_FIELD' && message.includes('36 particles, and the scene has 42'));
  await assert.rejects(client.create({ sceneText: SCENE, stepLimit: 5, begin: frame }), { reason: 'INVALID_FIELD' });
  const missing = Object.assign({}, frame, { fields: {} });
  for (const begin of [null, 3, 'frame', {}, missing]) {
    await assert.rejects(client.create({ sceneText: SCENE, begin }), { code: Code.INVALID_ARGUMENT, reason: null, metadata: { field: 'begin' } });
  }
  assert.deepEqual((await client.list()).map(({ sessionId }) => sessionId), [whole.sessionId]);
  await client.delete(whole);
});
