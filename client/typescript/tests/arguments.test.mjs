// Arguments: whole numbers in either way, and every wrong one refused by its name before anything is sent.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { toBinary } from '@bufbuild/protobuf';
import { load } from './bundle.mjs';

const { Code, connect, NappeError } = await load('src/index.ts');
const { createRequest, forkRequest, stepRequest, updateRequest } = await load('src/requests.ts');
const { StepSessionRequestSchema, UpdateParametersRequestSchema } = await load('src/gen/nappe/v1/simulation_pb.ts');

let sent = 0;
const client = connect('127.0.0.1:1', {
  fetch: () => {
    sent += 1;
    return Promise.reject(new TypeError('nothing is there'));
  },
});
const SESSION = { sessionId: 'some', uid: 'u-1' };

/** What a call or a stream refuses, which names `field` and what is allowed; nothing was sent. */
async function refused(doing, field) {
  const before = sent;
  try {
    const got = await doing();
    if (typeof got?.next === 'function') await got.next();
  } catch (error) {
    assert.ok(error instanceof NappeError, `${doing}: ${error}`);
    assert.deepEqual([error.code, error.reason, error.metadata.field, sent], [Code.INVALID_ARGUMENT, null, field, before], String(error));
    assert.match(error.message, /^\S.*; allowed: \S/);
    return error.message;
  }
  return assert.fail(`${doing} was not refused`);
}

/** Each whole number of each call. */
const WHOLE = {
  count: (value) => client.step(SESSION, value),
  to: (value) => client.step(SESSION, 1, { to: value }),
  stepLimit: (value) => client.create({ scene: 'flag', stepLimit: value }),
  threadCount: (value) => client.create({ scene: 'flag', threadCount: value }),
  frameIntervalSteps: (value) => client.create({ scene: 'flag', frameIntervalSteps: value }),
  rankCount: (value) => client.create({ scene: 'flag', rankCount: value }),
  atStep: (value) => client.update(SESSION, { atStep: value }),
  from: (value) => client.frames(SESSION, { every: true, from: value }),
  attempts: (value) => client.diagnostics(SESSION, { attempts: value }),
  'pins[0].particle': (value) => client.update(SESSION, { pins: [{ particle: value, target: {} }] }),
  'changes.pins[1].particle': (value) => client.step(SESSION, 1, { changes: { pins: [{}, { particle: value }] } }),
};

test('a whole number that is none is refused by its name', async () => {
  for (const [name, call] of Object.entries(WHOLE)) {
    for (const value of [-1, -1n, 1.5, Number.NaN, -Infinity, 2 ** 60, 2n ** 64n, '2', null, true, {}, [], () => 1, Symbol('two')]) {
      const message = await refused(() => call(value), name);
      assert.match(message, /allowed: whole numbers from [01]/);
    }
  }
  assert.equal(await refused(() => client.step(SESSION, 0n), 'count'), 'count is 0; allowed: whole numbers from 1');
  assert.equal(await refused(() => client.create({ scene: 'flag', stepLimit: -1n }), 'stepLimit'), 'stepLimit is -1; allowed: whole numbers from 0');
  assert.match(await refused(() => client.create({ scene: 'flag', threadCount: 2 ** 32 }), 'threadCount'), /from 0 to 4294967295$/);
  assert.match(await refused(() => client.step(SESSION, 2 ** 60), 'count'), /those above 2\^53 as a bigint$/);
  await refused(() => client.fork(SESSION, { stepLimit: -1 }), 'stepLimit');
});

/** Each other argument, with what it is not. */
const OTHERS = [
  [(value) => client.play(SESSION, { realTimeFactor: value }), 'realTimeFactor', [Number.NaN, Infinity, -1, '1', null]],
  [(value) => client.update(SESSION, { drag: value }), 'drag', [Number.NaN, Infinity, '1', null, {}]],
  [(value) => client.update(SESSION, { gravity: value }), 'gravity', [9.81, 'down', null, [0, -9.81, 0], new Float64Array(3)]],
  [(value) => client.update(SESSION, { gravity: { x: value } }), 'gravity.x', [Number.NaN, '0', null]],
  [(value) => client.step(SESSION, 1, { changes: { wind: { y: value } } }), 'changes.wind.y', [Infinity, {}]],
  [(value) => client.step(SESSION, 1, { changes: value }), 'changes', [3, null, 'wind', []]],
  [(value) => client.update(SESSION, { pins: value }), 'pins', [{}, 3, null, 'top_left']],
  [(value) => client.update(SESSION, { pins: [value] }), 'pins[0]', [3, null, []]],
  [(value) => client.update(SESSION, { paths: [{ timesSeconds: value }] }), 'paths[0].timesSeconds', [1, null]],
  [(value) => client.update(SESSION, { paths: [{ timesSeconds: [0.1, value] }] }), 'paths[0].timesSeconds[1]', [Number.NaN, '1']],
  [(value) => client.update(SESSION, { springs: [{ kind: value }] }), 'springs[0].kind', [9, -1n, 'stretch', null]],
  [(value) => client.update(SESSION, { forces: [{ body: value }] }), 'forces[0].body', [3, null]],
  [(value) => client.update(SESSION, { forces: [{ forcesF64: value }] }), 'forces[0].forcesF64', [[0, 1, 0], 'up', 3, new ArrayBuffer(24)]],
  [(value) => client.update(SESSION, { pulls: [{ pointsF64: value }] }), 'pulls[0].pointsF64', [[0, 1, 0], 'up', 3, new ArrayBuffer(24)]],
  [(value) => client.update(SESSION, { pulls: [{ frequency: value }] }), 'pulls[0].frequency', [Number.NaN, Infinity, '1', null]],
  [(value) => client.update(SESSION, { wait: value }), 'wait', [1, 'yes', null]],
  [(value) => client.step(SESSION, 1, { wait: value }), 'wait', [0, null]],
  [(value) => client.pause(SESSION, { wait: value }), 'wait', [0, 'no']],
  [(value) => client.create({ scene: value }), 'scene', [3, {}]],
  [(value) => client.create({ sceneText: value }), 'sceneText', [3, null]],
  [(value) => client.create({ scene: 'flag', sessionId: value }), 'sessionId', [3, null]],
  [(value) => client.create({ scene: 'flag', precision: value }), 'precision', ['f16', 64, null]],
  [(value) => client.fork(SESSION, { newSessionId: value }), 'newSessionId', [3, null]],
  [(value) => client.uploadFile({ name: value, format: 'obj', data: new Blob([]) }), 'name', [3, null]],
  [(value) => client.uploadFile({ name: 'a', format: value, data: new Blob([]) }), 'format', ['gltf', 1, null]],
  [(value) => client.uploadFile({ name: 'a', format: 'obj', data: value }), 'data', [undefined, 'v 0 0 0', 3, null]],
  [(value) => client.uploadFile({ name: 'a', format: 'obj', data: new Blob([]), masses: value }), 'masses', [new Blob([]), 3]],
  [(value) => client.uploadFile({ name: 'a', format: 'eti', data: new Blob([]), faceset: value }), 'faceset', ['0', 3, null]],
  [(value) => client.uploadFile({ name: 'a', format: 'eti', data: new Blob([]), missingMass: value }), 'missingMass', [-1, Number.NaN, '1', null]],
  [(value) => client.openLink(value), 'code', [undefined, 3, null]],
  [(value) => client.frames(SESSION, { rate: value }), 'rate', [Number.NaN, -1, '30', null]],
  [(value) => client.frames(SESSION, { every: value }), 'every', [1, 'yes']],
  [(value) => client.frames(SESSION, { paced: value }), 'paced', [1]],
  [(value) => client.frames(SESSION, { precision: value }), 'precision', ['f16', 32]],
  [(value) => client.frames(SESSION, { fields: value }), 'fields', ['velocities', 3, null]],
  [(value) => client.frames(SESSION, { onTopology: value }), 'onTopology', [3, {}, null]],
  [(value) => client.diagnostics(SESSION, { onEnd: value }), 'onEnd', [3]],
  [(value) => client.frames(SESSION, { signal: value }), 'signal', [3, {}, null]],
  [(value) => connect(value), 'url', [undefined, 6277, null]],
  [(value) => connect('127.0.0.1:1', { fetch: value }), 'fetch', [3, null]],
  [(value) => connect('127.0.0.1:1', { silenceSeconds: value }), 'silenceSeconds', [0, -1n, Number.NaN, '30']],
];

test('every other argument that is wrong is refused by its name', async () => {
  for (const [call, name, values] of OTHERS) {
    for (const value of values) await refused(() => call(value), name);
  }
  assert.equal(await refused(() => client.create({ scene: 'flag', precision: 'f16' }), 'precision'), "precision is 'f16'; allowed: 'f32', 'f64'");
  assert.match(await refused(() => client.update(SESSION, { springs: [{ kind: 9 }] }), 'springs[0].kind'), /allowed: 0 \(UNSPECIFIED\), 1 \(STRETCH\)/);
});

test('what is no session, no signal and no option is refused by every call', async () => {
  const calls = [
    (...given) => client.get(...given), (...given) => client.delete(...given), (...given) => client.topology(...given),
  ];
  const withOptions = [
    (session, options, signal) => client.play(session, options, signal), (session, options, signal) => client.pause(session, options, signal),
    (session, options, signal) => client.step(session, 1, options, signal), (session, options, signal) => client.update(session, options ?? {}, signal),
    (session, options, signal) => client.fork(session, options, signal), (session, options, signal) => client.makeSessionLink(session, options, signal),
  ];
  const streams = [(session, options) => client.frames(session, options), (session, options) => client.diagnostics(session, options)];
  for (const call of [...calls, ...withOptions, ...streams]) {
    for (const session of [undefined, null, 3, {}, { sessionId: 'some' }, { sessionId: 3, uid: 'u-1' }]) await refused(() => call(session), 'session');
  }
  for (const call of [(...given) => client.info(...given), (...given) => client.list(...given), (...given) => client.makeLink(...given)]) {
    for (const signal of [3, null, {}]) await refused(() => call(signal), 'signal');
  }
  for (const call of calls) await refused(() => call(SESSION, { signal: new AbortController().signal }), 'signal');
  for (const call of withOptions) await refused(() => call(SESSION, undefined, { signal: new AbortController().signal }), 'signal');

  for (const call of [...withOptions, ...streams]) {
    for (const options of [3, 'all', []]) await refused(() => call(SESSION, options), 'options');
    const message = await refused(() => call(SESSION, { each: true }), 'each');
    assert.match(message, /^options has a key 'each'; allowed: \w+/);
  }
  await refused(() => client.create(), 'options');
  await refused(() => client.create({ scene: 'flag', requestId: 'mine' }), 'requestId');
  await refused(() => client.update(SESSION, { sessionUid: 'other' }), 'sessionUid');
  await refused(() => client.update(SESSION, { gravity: { w: 1 } }), 'gravity.w');
  await refused(() => connect('127.0.0.1:1', { tokn: 'x' }), 'tokn');
  await refused(() => connect('127.0.0.1:1', null), 'options');
});

test('numbers and bigints make the same requests, and typed arrays are the bytes that they hold', () => {
  const without = ({ requestId, ...rest }) => (assert.match(requestId, /^[0-9a-f-]{36}$/), rest);
  const created = (given) => without(createRequest({ scene: 'flag', ...given }));
  assert.deepEqual(
    created({ stepLimit: 7, threadCount: 2, frameIntervalSteps: 3, rankCount: 1 }),
    created({ stepLimit: 7n, threadCount: 2n, frameIntervalSteps: 3n, rankCount: 1n }),
  );
  assert.equal(created({}).stepLimit, undefined);
  assert.deepEqual(stepRequest(SESSION, 2n, { to: 9 }), stepRequest(SESSION, 5, { to: 9n }));
  assert.deepEqual(forkRequest('some', { stepLimit: 2 ** 53 - 1 }), forkRequest('some', { stepLimit: 2n ** 53n - 1n }));
  assert.equal(stepRequest('some', 2n ** 64n - 1n, {}).stepCount, 2n ** 64n - 1n);
  // Undefined is absent, and messages of answers are taken as they are.
  const { changes } = stepRequest('some', 1, { changes: { wind: { x: 1n }, drag: undefined, springs: [{ kind: 1n, stiffness: 3n }] } });
  assert.deepEqual([changes.wind.x, changes.wind.y, changes.drag, changes.springs[0].kind, changes.springs[0].stiffness], [1, 0, undefined, 1, 3]);
  const again = stepRequest('some', 1, { changes });
  assert.deepEqual(toBinary(StepSessionRequestSchema, again), toBinary(StepSessionRequestSchema, stepRequest('some', 1n, { changes })));

  const forces = Float64Array.of(0, 1, 0, 0, 2, 0).subarray(3);
  const update = updateRequest(SESSION, { atStep: 4, forces: [{ body: 'flag', particlesU32: Uint32Array.of(7), forcesF64: forces }] });
  assert.deepEqual(update.forces[0].forcesF64, new Uint8Array(Float64Array.of(0, 2, 0).buffer));
  assert.deepEqual(update.forces[0].particlesU32, Uint8Array.of(7, 0, 0, 0));
  assert.ok(toBinary(UpdateParametersRequestSchema, update).length > 32);
  assert.deepEqual([update.sessionId, update.sessionUid, update.atStep, update.wait], ['some', 'u-1', 4n, false]);
});
