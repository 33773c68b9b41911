// Calls on the real server: sessions are made, steered, changed, copied and deleted.

import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { after, before, test } from 'node:test';
import { load } from './bundle.mjs';
import { eventually, serve } from './server.mjs';

const { ChangeKind, Code, connect, forcesOf, NappeError, SessionState } = await load('src/index.ts');

let server;
let client;
before(async () => {
  server = await serve({ words: ['--max-sessions', '300', '--history-bytes-per-session', String(8 << 20)] });
  client = connect(server.address, { token: server.token });
});
after(() => server.stop());

test('the server says what it is', async () => {
  const info = await client.info();
  assert.match(info.version, /^\d+\.\d+\.\d+/);
  assert.equal(info.limits.maxSessions, 300);
  assert.deepEqual(await client.shippedScenes(), info.scenes);
  assert.ok(info.scenes.includes('demo') && info.scenes.includes('snow_and_cloth'));
  assert.equal(client.address, `http://${server.address}`);
});

test('a code is traded for the token once', async () => {
  const { code, expiresInSeconds } = await client.makeLink();
  assert.match(code, /^[0-9a-f]{32}$/);
  assert.ok(expiresInSeconds > 0);
  const other = connect(server.address);
  await assert.rejects(other.makeLink(), { reason: 'TOKEN_MISSING' });
  const token = await other.openLink(code);
  assert.equal(token, server.token);
  other.setToken(token);
  assert.deepEqual(await other.list(), []);
  for (const wrong of [code, '0'.repeat(32), '', 'x'.repeat(1000)]) await assert.rejects(connect(server.address).openLink(wrong), ({ reason }) => reason !== null, wrong);
});

test('a link to one session gives tokens for it and for copies of it', async () => {
  const shown = await client.create({ scene: 'flag', sessionId: 'shown', stepLimit: 0n });
  const { code, expiresInSeconds } = await client.makeSessionLink(shown, { forks: 1, uses: 2n, seconds: 60 });
  assert.equal(expiresInSeconds, 60);
  const pupils = [];
  for (let i = 0; i < 2; i++) {
    const pupil = connect(server.address);
    pupil.setToken(await pupil.openLink(code));
    pupils.push(pupil);
  }
  await assert.rejects(connect(server.address).openLink(code), { reason: 'LINK_NOT_FOUND' });
  const copy = await pupils[0].fork('shown');
  await assert.rejects(pupils[0].fork('shown'), { reason: 'LINK_TOO_NARROW' });
  await assert.rejects(pupils[0].step('shown'), { reason: 'LINK_TOO_NARROW' });
  assert.equal((await pupils[0].step(copy, 2)).step, 2n);
  await assert.rejects(pupils[1].get(copy), { reason: 'SESSION_NOT_FOUND' });
  assert.deepEqual((await pupils[1].list()).map(({ sessionId }) => sessionId), ['shown']);
  await assert.rejects(client.makeSessionLink('shown', { forks: 5 }), { reason: 'INVALID_FIELD' });
  for (const session of [copy, shown]) await client.delete(session);
});

test('a session is made, stepped, played, paused and deleted', async () => {
  const made = await client.create({ scene: 'flag', sessionId: 'steered', precision: 'f64', stepLimit: 0n, threadCount: 1 });
  assert.deepEqual([made.sessionId, made.state, made.warnings], ['steered', SessionState.PAUSED, []]);
  assert.equal((await client.step(made)).step, 1n);
  assert.equal((await client.step(made, 9)).step, 10n);
  assert.equal((await client.step(made, 1, { to: 12n })).step, 12n);
  assert.equal((await client.step('steered', 1, { to: 12n })).step, 12n, 'a repeated call takes no step twice');

  assert.equal((await client.play(made, { realTimeFactor: 1 })).state, SessionState.PLAYING);
  await eventually(async () => (await client.get(made)).step > 12n);
  const paused = await client.pause(made);
  assert.equal(paused.state, SessionState.PAUSED);
  assert.equal((await client.get('steered')).stateHash, paused.stateHash);

  await client.delete(made);
  await assert.rejects(client.get(made), { reason: 'SESSION_NOT_FOUND' });
});

test('a mesh file is sent in pieces, and a scene names it', async () => {
  // Comments make it longer than a piece, and a faulty line stands behind them.
  const long = '# a comment of a mesh\n'.repeat(60_000);
  const points = 'v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n';
  const scene = (id) => `version = 1\ndt = 0.001\n[[body]]\nname = "b"\nmesh = { upload = "${id}" }\nmass = { particle = 0.1 }\nsprings = { stretch = { stiffness = 10 } }\n`;
  for (const data of [new Blob([long, points]), new TextEncoder().encode(points)]) {
    const { meshId, warnings } = await client.uploadFile({ name: 'sheet.obj', format: 'obj', data });
    assert.deepEqual(warnings, []);
    const made = await client.create({ sceneText: scene(meshId) });
    assert.equal(made.particleCount, 3n);
    await client.delete(made);
  }
  const bad = client.uploadFile({ name: 'bad.obj', format: 'obj', data: new Blob([long, 'v 0 0\n']) });
  await assert.rejects(bad, (error) => error.reason === 'INVALID_MESH' && error.message.startsWith('bad.obj:60001'));
  await assert.rejects(client.uploadFile({ name: 'x', format: 'obj', data: new Blob([]) }), { reason: 'INVALID_FIELD' });
});

test('parameters change, all or none, and a copy has them', async () => {
  const made = await client.create({ scene: 'flag' });
  const accepted = await client.update(made, { gravity: { x: 0, y: -1.5, z: 0 }, drag: 0.25 });
  assert.deepEqual([accepted.effectiveStep, accepted.order], [0n, 1n]);
  await assert.rejects(client.update(made, { wind: { x: 1 }, drag: -1 }), { code: Code.INVALID_ARGUMENT });
  const stepped = await client.step(made, 3, { changes: { wind: { x: 0, y: 0, z: 2 } } });
  assert.deepEqual([stepped.parameters.gravity.y, stepped.parameters.wind.z, stepped.parameters.cloths[0].drag], [-1.5, 2, 0.25]);

  const copy = await client.fork(made, { newSessionId: 'copied', stepLimit: 5n });
  assert.deepEqual([copy.sessionId, copy.stateHash, copy.step, copy.stepLimit], ['copied', stepped.stateHash, 3n, 5n]);
  const [one, other] = [await client.step(made, 2), await client.step(copy, 2)];
  assert.equal(one.stateHash, other.stateHash);
  assert.equal(other.state, SessionState.FINISHED);
  await Promise.all([client.delete(made), client.delete(copy)]);
});

test('numbers are bigints or numbers alike', async () => {
  const made = await client.create({ scene: 'flag', stepLimit: 10, threadCount: 1n, frameIntervalSteps: 1n });
  assert.deepEqual([made.stepLimit, made.threadCount, made.frameIntervalSteps], [10n, 1, 1]);
  assert.equal((await client.step(made, 2n)).step, 2n);
  assert.equal((await client.step(made, 1n, { to: 4 })).step, 4n);
  assert.equal((await client.update(made, { drag: 1n, atStep: 6 })).effectiveStep, 6n);
  assert.equal((await client.update(made, { drag: 0.5, atStep: 7n })).effectiveStep, 7n);
  const copy = await client.fork(made, { stepLimit: 8 });
  assert.equal(copy.stepLimit, 8n);
  await client.step(made, 6);
  const numbers = [];
  for await (const { frame } of client.frames(made, { every: true, from: 3, attempts: 0n })) numbers.push(frame);
  assert.deepEqual(numbers, [3n, 4n, 5n, 6n, 7n, 8n, 9n, 10n]);
  await Promise.all([client.delete(made), client.delete(copy)]);
});

test('what the server tells is written as JSON, whole numbers as texts and arrays by their lengths', async () => {
  const written = (value) => JSON.parse(JSON.stringify(value));
  const made = await client.create({ scene: 'flag', stepLimit: 10n });
  const { sessionId, step, stepLimit, particleCount, parameters, warnings, state, createTime } = written(made);
  assert.deepEqual([sessionId, step, stepLimit, state, warnings], [made.sessionId, '0', '10', SessionState.PAUSED, []]);
  assert.equal(particleCount, String(made.particleCount));
  assert.deepEqual(parameters.gravity, { x: made.parameters.gravity.x, y: made.parameters.gravity.y, z: made.parameters.gravity.z });
  assert.equal(createTime.seconds, String(made.createTime.seconds));
  assert.equal(written(await client.get(made)).stateHash, String(made.stateHash));
  assert.ok(written(await client.list()).some(({ uid }) => uid === made.uid));
  assert.equal(written(await client.info()).limits.maxParticles, String((await client.info()).limits.maxParticles));
  assert.deepEqual(written(await client.update(made, { drag: 1 })), { effectiveStep: '0', order: '1' });

  const seen = [];
  await client.step(made, 10);
  for await (const frame of client.frames(made, { every: true, fields: ['velocities'], onChange: (change) => seen.push(change), onEnd: (end) => seen.push(end) })) {
    const told = written(frame);
    assert.deepEqual([told.frame, told.step, told.time, told.positions], [String(frame.frame), String(frame.step), frame.time, frame.positions.length]);
    assert.deepEqual([told.fields, told.stateHash], [{ velocities: frame.fields.velocities.length }, frame.stateHash === null ? null : String(frame.stateHash)]);
    assert.equal(told.topology.bodies[0].triangles, frame.topology.bodies[0].triangles.length);
    assert.equal(told.session.sessionUid, made.uid);
    assert.equal(told.diagnostics?.frame, frame.diagnostics === null ? undefined : String(frame.frame));
    for (const part of [frame.topology, frame.session, frame.diagnostics]) assert.ok(JSON.stringify(part).length > 1);
  }
  assert.ok(seen.length >= 2 && written(seen).at(-1).step === '10');
  for await (const row of client.diagnostics(made, { every: true })) assert.equal(written(row).frame, String(row.frame));
  assert.ok(written(await client.topology(made)).bodies[0].springs >= 0);
  await client.delete(made);
});

test('a pull draws a particle, is told, and ends by itself', async () => {
  const made = await client.create({ scene: 'hanging_sheet', stepLimit: 0n });
  const [{ name }] = (await client.topology(made)).bodies;
  const count = ({ parameters }) => parameters.cloths[0].pullCount;
  const pull = { body: name, particlesU32: Uint32Array.of(820, 821), pointsF64: Float64Array.of(0, 1, 0, 0, 1, 0), frequency: 50, most: 20, seconds: 0.01 };
  assert.deepEqual([count(await client.step(made, 1, { changes: { pulls: [pull] } })), count(await client.step(made, 1)), count(made)], [2, 0, 0]);
  await client.update(made, { pulls: [{ ...pull, seconds: 10n }] });
  assert.equal(count(await client.step(made, 1)), 2);
  await client.update(made, { pulls: [{ body: name }] });
  assert.equal(count(await client.step(made, 1)), 0);
  const before = await client.get(made);
  for (const wrong of [{ frequency: 101 }, { frequency: 0 }, { most: 1e300 }, { seconds: 0 }, { pointsF64: Float64Array.of(0, 1, 0) }, { particlesU32: Uint32Array.of(0, 1600) }]) {
    await assert.rejects(client.update(made, { pulls: [{ ...pull, ...wrong }] }), { code: Code.INVALID_ARGUMENT, reason: 'INVALID_CHANGE' });
  }
  assert.equal((await client.get(made)).stateHash, before.stateHash);
  await client.delete(made);
});

test('forces that calls have set are read back', async () => {
  const made = await client.create({ scene: 'flag', stepLimit: 0n });
  const [{ name, particleCount, pins }] = (await client.topology(made)).bodies;
  assert.deepEqual(forcesOf(made.parameters), []);
  const told = async (forces) => forcesOf((await client.step(made, 1, { changes: { forces } })).parameters);
  assert.deepEqual(await told([{ body: name, force: { x: 0, y: 1e-3 } }]), [{ body: name, particles: null, forces: Float64Array.of(0, 1e-3, 0) }]);

  const some = [0, 1, 2].map((i) => particleCount - 1 - i).filter((particle) => !pins.includes(particle));
  const each = Float64Array.from({ length: 3 * some.length }, (_, i) => 1e-4 * (i + 1));
  const off = { body: name, force: {} };
  const [one] = await told([off, { body: name, particlesU32: Uint32Array.from(some), forcesF64: each }]);
  const byParticle = ({ particles, forces }) => new Map(Array.from(particles, (particle, i) => [particle, [...forces.subarray(3 * i, 3 * i + 3)]]));
  assert.deepEqual(byParticle(one), new Map([...byParticle({ particles: some, forces: each })].sort(([a], [b]) => a - b)));
  assert.deepEqual(forcesOf((await client.get(made)).parameters), [one]);
  const listed = (await client.list()).find(({ uid }) => uid === made.uid);
  assert.deepEqual(forcesOf(listed.parameters), [{ body: name, particles: null, forces: null }]);

  // What was read can be sent as it is.
  const { parameters } = await client.get(made);
  assert.deepEqual(await told([off]), []);
  assert.deepEqual(await told(parameters.forces), [one]);
  assert.deepEqual(await told([off, { body: name, particlesU32: Uint32Array.from(some), force: { z: 2e-3 } }]), [
    { body: name, particles: Uint32Array.from(some).sort(), forces: Float64Array.from({ length: 3 * some.length }, (_, i) => (i % 3 === 2 ? 2e-3 : 0)) },
  ]);
  await client.delete(made);
});

test('a list of more than a page is whole', async () => {
  const text = readFileSync(new URL('../../../server/scenes/drap10.toml', import.meta.url), 'utf8');
  const made = [];
  for (let i = 0; i < 203; i += 7) {
    // A server takes so many connections of one address.
    const ids = Array.from({ length: 7 }, (_, j) => `many-${i + j}`);
    made.push(...(await Promise.all(ids.map((sessionId) => client.create({ sceneText: text, sessionId, threadCount: 1 })))));
  }
  const found = new Set((await client.list()).map(({ sessionId }) => sessionId));
  assert.ok(made.every(({ sessionId }) => found.has(sessionId)));
  for (const session of made) await client.delete(session);
});

test('a call that is given up ends at once, here and on the server', async () => {
  const made = await client.create({ scene: 'demo', stepLimit: 0n });
  const giveUp = new AbortController();
  const waiting = client.step(made, 1_000_000, {}, giveUp.signal);
  await eventually(async () => (await client.get(made)).step > 0n);
  giveUp.abort(new Error('enough'));
  const error = await waiting.catch((met) => met);
  assert.ok(error instanceof NappeError);
  assert.deepEqual([error.code, error.codeName, error.cause.message], [Code.CANCELLED, 'CANCELLED', 'enough']);
  await assert.rejects(client.get(made, AbortSignal.abort()), { code: Code.CANCELLED });
  await client.delete(made);
});

test('what is no address, no token and no scene is refused before anything is sent', async () => {
  for (const url of ['', 'ftp://127.0.0.1', 'unix:/run/x', 'http://user:pass@127.0.0.1:1', 'http://']) {
    assert.throws(() => connect(url), { code: Code.INVALID_ARGUMENT, metadata: { field: 'url' } }, url);
  }
  for (const token of ['', 'short', 'with a blank in it', 'line\nafter line of it', 'ü'.repeat(20)]) {
    assert.throws(() => connect(server.address, { token }), { metadata: { field: 'token' } }, token);
  }
  await assert.rejects(client.create({}), { metadata: { field: 'scene' } });
  await assert.rejects(client.create({ scene: 'demo', sceneText: '' }), { metadata: { field: 'scene' } });
  await assert.rejects(client.step('none', 0), { metadata: { field: 'count' } });
  assert.equal(connect('http://127.0.0.1:6277/behind/a/proxy/').address, 'http://127.0.0.1:6277/behind/a/proxy');
  assert.equal(connect('[::1]:6277').address, 'http://[::1]:6277');
  assert.ok(ChangeKind.PRESENT === 1);
});

test('an address is relative to the page', async () => {
  globalThis.location = { href: 'http://host:1234/behind/?session=a#b' };
  try {
    assert.equal(connect('.').address, 'http://host:1234/behind');
    assert.equal(connect('').address, 'http://host:1234/behind');
    assert.equal(connect('/').address, 'http://host:1234');
  } finally {
    delete globalThis.location;
  }
});
