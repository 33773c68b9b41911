// Streams of the real server: what they bring, how they are left, and how they end.

import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import { load } from './bundle.mjs';
import { eventually, serve } from './server.mjs';

const { ChangeKind, Code, connect, failureError, SessionState } = await load('src/index.ts');

let server;
let client;
before(async () => {
  server = await serve();
  client = connect(server.address, { token: server.token });
});
after(() => server.stop());

async function all(items) {
  const found = [];
  for await (const item of items) found.push(item);
  return found;
}

test('every frame comes in order with what was asked for, until the session ends', async () => {
  const made = await client.create({ scene: 'snow_and_cloth', stepLimit: 12n, frameIntervalSteps: 1 });
  const seen = { topologies: [], changes: [], ends: [] };
  const reading = all(client.frames(made, {
    every: true, from: 0n, fields: ['velocities', 'plastic_ratio', 'stress', 'force', 'acceleration'],
    onTopology: (topology) => seen.topologies.push(topology), onChange: (change) => seen.changes.push(change), onEnd: (end) => seen.ends.push(end),
  }));
  await eventually(() => seen.changes.length > 0);
  await client.play(made);
  const frames = await reading;
  assert.deepEqual(frames.map(({ frame }) => frame), Array.from({ length: 13 }, (_, i) => BigInt(i)));
  const particles = Number(made.particleCount);
  for (const { positions, fields, diagnostics, frame, step, time, topology, session, bytes } of frames) {
    assert.deepEqual([positions.length, fields.velocities.length], [3 * particles, 3 * particles]);
    assert.deepEqual([fields.plastic_ratio.length, fields.stress.length], [particles, particles]);
    assert.deepEqual([fields.force.length, fields.acceleration.length], [3 * particles, 3 * particles]);
    assert.equal(step, frame);
    assert.ok(Math.abs(time - Number(step) * made.dtSeconds) < 1e-9);
    assert.equal(diagnostics?.frame ?? 0n, frame);
    assert.equal(topology, seen.topologies[0]);
    assert.equal(session.sessionUid, made.uid);
    assert.ok(bytes > 32 * particles);
  }
  const plasticRatio = frames[12].fields.plastic_ratio;
  const cloth = Number(made.particleCount - made.snowParticleCount);
  assert.ok(plasticRatio.subarray(0, cloth).every((ratio) => ratio === 1) && plasticRatio.every((ratio) => ratio > 0));
  assert.deepEqual(seen.changes.map(({ kind }) => kind), [ChangeKind.PRESENT, ChangeKind.STATE, ChangeKind.STATE]);
  assert.equal(seen.changes[2].state, SessionState.FINISHED);
  const ended = await client.get(made);
  assert.deepEqual(seen.ends.map(({ frame, step, stateHash }) => [frame, step, stateHash]), [[12n, 12n, ended.stateHash]]);
  await client.delete(made);
});

test('the topology is what the session is made of', async () => {
  const made = await client.create({ scene: 'snow_and_cloth' });
  const { particleCount, bodies, colliders, sessionUid } = await client.topology(made);
  assert.deepEqual([BigInt(particleCount), sessionUid], [made.particleCount, made.uid]);
  assert.equal(bodies.reduce((sum, body) => sum + body.particleCount, 0), particleCount);
  const [cloth, snow] = [bodies.find((body) => body.triangles.length > 0), bodies.find((body) => body.triangles.length === 0)];
  assert.ok(cloth.triangles.every((index) => index >= cloth.firstParticle && index < cloth.firstParticle + cloth.particleCount));
  assert.equal(BigInt(snow.particleCount), made.snowParticleCount);
  assert.ok(colliders.some(({ shape }) => shape.case === 'plane'));
  await eventually(async () => (await client.get(made)).watcherCount === 0);
  await client.delete(made);
});

test('the newest frames come at most so often, and tell what was left out', async () => {
  const made = await client.create({ scene: 'flag', stepLimit: 0n, frameIntervalSteps: 1 });
  await client.play(made);
  const begin = performance.now();
  const frames = [];
  for await (const frame of client.frames(made, { rate: 50 })) {
    frames.push(frame);
    if (frames.length === 11) break;
  }
  assert.ok(performance.now() - begin > 190, 'eleven frames at 50 Hz take a fifth of a second');
  const last = frames.at(-1);
  const dropped = frames.slice(1).reduce((sum, frame) => sum + frame.dropped, 0n);
  assert.equal(last.frame - frames[0].frame, dropped + 10n);
  await client.delete(made);
});

test('arrays that were handed back are used again, and others stay as they are', async () => {
  const made = await client.create({ scene: 'flag', stepLimit: 40n, frameIntervalSteps: 1 });
  await client.step(made, 20);
  const buffers = new Set();
  let kept = null;
  for await (const frame of client.frames(made, { every: true, from: 0n })) {
    if (frame.frame === 3n) kept = { frame, numbers: frame.positions.slice() };
    else {
      buffers.add(frame.positions.buffer);
      frame.release();
      frame.release();
    }
    if (frame.frame === 20n) break;
  }
  assert.ok(buffers.size <= 2, `${buffers.size} arrays for 20 frames`);
  assert.deepEqual(kept.frame.positions, kept.numbers);
  await client.delete(made);
});

test('diagnostics come for every frame, with changes and the end', async () => {
  const made = await client.create({ scene: 'flag', stepLimit: 20n, frameIntervalSteps: 2 });
  const seen = { changes: [], ends: 0 };
  const reading = all(client.diagnostics(made, { every: true, from: 0n, onChange: ({ kind }) => seen.changes.push(kind), onEnd: () => (seen.ends += 1) }));
  await eventually(() => seen.changes.length > 0);
  await client.play(made);
  const found = await reading;
  const numbers = found.map(({ frame }) => frame);
  assert.deepEqual(numbers, Array.from({ length: 11 }, (_, i) => BigInt(i)));
  assert.ok(found[10].stepSeconds > 0 && found[10].stages.length > 0);
  assert.equal(seen.ends, 1);
  await client.delete(made);
});

test('a hundred streams that are left early leave no watcher', async () => {
  const made = await client.create({ scene: 'demo', stepLimit: 0n });
  await client.play(made);
  const watchers = async () => (await client.get(made)).watcherCount;
  let slowest = 0;
  for (let i = 0; i < 100; i += 10) {
    const begin = performance.now();
    await Promise.all(Array.from({ length: 10 }, (_, j) => leave(made, i + j)));
    await eventually(async () => (await watchers()) === 0);
    slowest = Math.max(slowest, (performance.now() - begin) / 1000);
  }
  // A stream whose end is not told is noticed with its next message, which comes after 5 s at most.
  assert.ok(slowest < 4, `watchers were left for ${slowest} s`);
  await client.delete(made);
});

/** Leaves a stream in each of the ways that there are. */
async function leave(session, way) {
  if (way % 4 === 0) {
    for await (const frame of client.frames(session)) return frame.release();
  } else if (way % 4 === 1) {
    const giveUp = new AbortController();
    const reading = all(client.frames(session, { signal: giveUp.signal }));
    setTimeout(() => giveUp.abort(), way);
    return assert.rejects(reading, { code: Code.CANCELLED });
  } else if (way % 4 === 2) {
    const stream = client.frames(session, { every: true, from: 1_000_000_000n });
    const waiting = stream.next();
    setTimeout(() => stream.return(), way);
    return assert.deepEqual(await waiting, { value: undefined, done: true });
  }
  for await (const _ of client.diagnostics(session)) return undefined;
}

test('a session that is deleted or fails while it is watched says so', async () => {
  const made = await client.create({ scene: 'flag' });
  const kinds = [];
  const frames = client.frames(made, { onChange: ({ kind }) => kinds.push(kind) });
  await frames.next();
  await client.delete(made);
  await assert.rejects(frames.next(), { reason: 'SESSION_DELETED', code: Code.NOT_FOUND });
  assert.deepEqual(kinds, [ChangeKind.PRESENT, ChangeKind.DELETED]);
  assert.deepEqual(await frames.next(), { value: undefined, done: true });

  const failing = await client.create({ scene: 'flag', stepLimit: 0n });
  const [particle] = (await client.topology(failing)).bodies[0].pins;
  const changes = [];
  const reading = all(client.frames(failing, { every: true, onChange: (change) => changes.push(change) }));
  await eventually(() => changes.length > 0);
  await client.update(failing, { pins: [{ particle, target: { x: 0, y: 99, z: 0 }, durationSeconds: 0.05 }] });
  await client.play(failing);
  const error = await reading.then(() => null, (met) => met);
  assert.deepEqual([error?.reason, error?.isDivergence], ['STRETCH_LIMIT', true], String(error));
  assert.ok(/^[0-9]+$/.test(error.metadata.step) && error.remedy.length > 0);
  const { state, failure } = changes.at(-1);
  assert.equal(state, SessionState.FAILED);
  const same = failureError(failure);
  assert.deepEqual([same.reason, same.code, same.remedy, same.metadata.step], [error.reason, error.code, error.remedy, error.metadata.step]);
  await client.delete(failing);
});

test('two streams at one session bring the same', async () => {
  const made = await client.create({ scene: 'flag', stepLimit: 30n, frameIntervalSteps: 1 });
  const begun = [];
  const reading = [1, 2].map(() => all(client.frames(made, { every: true, from: 0n, precision: 'f64', onChange: () => begun.push(0) })));
  await eventually(() => begun.length >= 2);
  await client.play(made);
  const [one, other] = await Promise.all(reading);
  assert.equal(one.length, 31);
  assert.ok(one[0].positions instanceof Float64Array);
  assert.deepEqual(one.map(({ positions }) => positions), other.map(({ positions }) => positions));
  await client.delete(made);
});
