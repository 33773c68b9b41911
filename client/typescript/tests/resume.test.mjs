// Streams that break: what comes through cuts is what the client in Rust gets, and never of another session.

import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { after, before, test } from 'node:test';
import { load } from './bundle.mjs';
import { proxy } from './proxy.mjs';
import { eventually, example, serve } from './server.mjs';

const { Code, connect } = await load('src/index.ts');
const { delay } = await load('src/resume.ts');

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

/** What the example `raw` of the client in Rust writes: number, hash and positions of each frame. */
function rustFrames(output) {
  const found = [];
  for (let at = 0; at < output.length; ) {
    const [number, hash, length] = [0, 8, 16].map((offset) => output.readBigUInt64LE(at + offset));
    at += 24 + Number(length);
    found.push([number, hash, output.subarray(at - Number(length), at)]);
  }
  return found;
}

const RAW = example('raw');
const skip = RAW === null && process.env.CI !== 'true' ? 'the example `raw` of the Rust client is not built' : false;
for (const [scene, steps] of [['demo', 120], ['snow_and_cloth', 40]]) {
  for (const precision of ['f32', 'f64']) {
    test(`${scene} in ${precision} through three cuts is what the client in Rust gets`, { skip }, async () => {
      const between = await proxy(server.port);
      const made = await client.create({ scene, stepLimit: BigInt(steps), frameIntervalSteps: 1 });
      const rust = spawn(RAW, [server.address, made.sessionId, precision, server.tokenFile], { stdio: ['ignore', 'pipe', 'inherit'] });
      const output = [];
      rust.stdout.on('data', (data) => output.push(data));
      const ended = new Promise((resolve) => rust.once('close', resolve));

      const through = connect(between.address, { token: server.token });
      const told = { reconnects: [], back: 0, end: null };
      const reading = all(through.frames(made.sessionId, {
        every: true, from: 0n, precision, paced: true,
        onReconnect: (attempt, error) => told.reconnects.push(error.code), onReconnected: () => (told.back += 1), onEnd: (end) => (told.end = end),
      }));
      await eventually(async () => (await client.get(made)).watcherCount === 2);
      const total = Number(made.particleCount) * (precision === 'f32' ? 12 : 24) * steps;
      between.cutAfter = [1, 1, 1].map(() => Math.floor(total / 5));
      await client.play(made);
      const ours = (await reading).map(({ frame, stateHash, positions }) => [frame, stateHash ?? 0n, Buffer.from(positions.buffer)]);
      assert.equal(await ended, 0);
      const theirs = rustFrames(Buffer.concat(output));
      assert.deepEqual(ours.map(([number, hash]) => [number, hash]), theirs.map(([number, hash]) => [number, hash]));
      assert.ok(ours.every(([, , bytes], i) => bytes.equals(theirs[i][2])));
      assert.deepEqual([ours.length, between.cuts, told.back], [steps + 1, 3, 3]);
      assert.ok(told.reconnects.length >= 3 && told.reconnects.every((code) => code === Code.UNAVAILABLE));
      assert.equal(told.end.stateHash, (await client.get(made)).stateHash);
      between.close();
      await client.delete(made);
    });
  }
}

test('diagnostics go on after a cut, without a gap', async () => {
  const between = await proxy(server.port);
  const made = await client.create({ scene: 'flag', stepLimit: 30n, frameIntervalSteps: 1 });
  const stream = connect(between.address, { token: server.token }).diagnostics(made, { every: true, from: 0n });
  const found = [(await stream.next()).value.frame];
  between.cut();
  await client.play(made);
  for await (const { frame } of stream) found.push(frame);
  assert.deepEqual(found, Array.from({ length: 31 }, (_, i) => BigInt(i)));
  between.close();
  await client.delete(made);
});

test('a stream of the newest goes on with the newest', async () => {
  const between = await proxy(server.port);
  const made = await client.create({ scene: 'flag', frameIntervalSteps: 1 });
  let topologies = 0;
  const stream = connect(between.address, { token: server.token }).frames(made, { onTopology: () => (topologies += 1) });
  assert.equal((await stream.next()).value.frame, 0n);
  between.cut();
  await client.step(made, 7);
  assert.equal((await stream.next()).value.frame, 7n);
  assert.equal(topologies, 1);
  await stream.return();
  between.close();
  await client.delete(made);
});

test('frames of another session of the same id never come', async () => {
  const between = await proxy(server.port);
  const through = connect(between.address, { token: server.token });
  const first = await client.create({ scene: 'flag', sessionId: 'once-and-again' });
  const frames = through.frames('once-and-again', { every: true });
  const diagnostics = through.diagnostics('once-and-again');
  await frames.next();
  await diagnostics.next();
  await client.delete(first);
  const second = await client.create({ scene: 'flag', sessionId: 'once-and-again' });
  // The stream was told of the end; one that was cut before that is not.
  await assert.rejects(frames.next(), { reason: 'SESSION_DELETED' });
  await assert.rejects(diagnostics.next(), { reason: 'SESSION_DELETED' });

  const again = through.frames('once-and-again', { every: true });
  await again.next();
  between.isFrozen = true;
  await client.delete(second);
  const third = await client.create({ scene: 'flag', sessionId: 'once-and-again' });
  between.isFrozen = false;
  between.cut();
  await assert.rejects(again.next(), ({ reason, metadata }) => reason === 'SESSION_REPLACED' && metadata.session_uid === third.uid);
  await assert.rejects(client.play(first), { reason: 'SESSION_REPLACED' });
  between.close();
  await client.delete(third);
});

test('attempts end', async () => {
  const between = await proxy(server.port);
  const made = await client.create({ scene: 'flag' });
  const attempts = [];
  const through = connect(between.address, { token: server.token });
  const stream = through.frames(made, { attempts: 3, onReconnect: (attempt) => attempts.push(attempt) });
  await stream.next();
  between.close();
  await assert.rejects(stream.next(), { code: Code.UNAVAILABLE, reason: null });
  assert.deepEqual(attempts, [1, 2, 3]);
  assert.deepEqual(await stream.next(), { value: undefined, done: true });
  // One that never was open is not asked for again.
  await assert.rejects(through.frames(made, { onReconnect: (attempt) => attempts.push(attempt) }).next(), { code: Code.UNAVAILABLE });
  assert.equal(attempts.length, 3);
  await client.delete(made);
});

test('waiting for the next attempt ends with the stream', async () => {
  const between = await proxy(server.port);
  const made = await client.create({ scene: 'flag' });
  for (const isLeft of [true, false]) {
    const giveUp = new AbortController();
    const broke = [];
    const stream = connect(between.address, { token: server.token }).frames(made, { signal: giveUp.signal, onReconnect: () => broke.push(0) });
    await stream.next();
    const waiting = stream.next().catch(({ code }) => code);
    between.cut();
    await eventually(() => broke.length > 0);
    if (isLeft) await stream.return();
    else giveUp.abort();
    assert.deepEqual(await waiting, isLeft ? { value: undefined, done: true } : Code.CANCELLED);
  }
  between.close();
  await eventually(async () => (await client.get(made)).watcherCount === 0);
  await client.delete(made);
});

test('a connection that is silent is broken', async () => {
  const between = await proxy(server.port);
  const made = await client.create({ scene: 'flag' });
  const words = [];
  const through = connect(between.address, { token: server.token, silenceSeconds: 0.3 });
  const stream = through.frames(made, { every: true, onReconnect: (_, { message }) => words.push(message) });
  assert.equal((await stream.next()).value.frame, 0n);
  between.isFrozen = true;
  const waiting = stream.next();
  await eventually(() => words.length > 0);
  assert.match(words[0], /not a byte came for 0.3 s/);
  between.isFrozen = false;
  between.cut();
  await client.step(made, made.frameIntervalSteps);
  assert.equal((await waiting).value.frame, 1n);
  await stream.return();
  between.close();
  await client.delete(made);
});

test('a server that was started anew on its port is another one, and says so', async () => {
  const first = await serve();
  const other = connect(first.address, { token: first.token });
  const made = await other.create({ scene: 'flag', sessionId: 'gone' });
  const broke = [];
  const stream = other.frames(made, { onReconnect: (_, error) => broke.push(error) });
  await stream.next();
  const waiting = stream.next();
  await first.stop('SIGKILL');
  await eventually(() => broke.length > 0);
  const second = await serve({ address: first.address });
  await other.create({ scene: 'flag', sessionId: 'gone' }).catch(() => undefined);
  await assert.rejects(waiting, ({ reason }) => reason === 'SESSION_REPLACED' || reason === 'SESSION_NOT_FOUND');

  const kinds = [];
  const watched = other.frames('gone', { onChange: ({ kind }) => kinds.push(kind), attempts: 2 });
  await watched.next();
  const drained = watched.next();
  await second.stop('SIGTERM');
  await assert.rejects(drained, { code: Code.UNAVAILABLE });
});

test('waits double up to 5 s, and are drawn from half of that to all of it', () => {
  assert.deepEqual([1, 2, 3, 6, 7, 10, 1000].map((failures) => delay(failures, 1)), [0.1, 0.2, 0.4, 3.2, 5, 5, 5]);
  assert.deepEqual([1, 7].map((failures) => delay(failures, 0)), [0.05, 2.5]);
});
