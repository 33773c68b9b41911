// Errors: what the real server refuses, every reason of the contract, and answers that are none of a nappe server.

import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { createServer } from 'node:http';
import { after, before, test } from 'node:test';
import { BinaryWriter, WireType } from '@bufbuild/protobuf/wire';
import { load } from './bundle.mjs';
import { eventually, serve } from './server.mjs';

const { Code, connect, NappeError } = await load('src/index.ts');
const ROWS = JSON.parse(readFileSync(new URL('../../../proto/nappe/v1/reasons.json', import.meta.url), 'utf8'));

let server;
let client;
before(async () => {
  server = await serve({ words: ['--max-sessions', '2', '--max-watchers-per-session', '1', '--max-steps-per-call', '1000', '--max-scene-bytes', '2000', '--max-message-bytes', '4000'] });
  client = connect(server.address, { token: server.token });
});
after(() => server.stop());

/** What a call or a stream fails with. */
async function met(doing) {
  try {
    const got = await doing;
    if (typeof got?.[Symbol.asyncIterator] === 'function') await got.next();
  } catch (error) {
    assert.ok(error instanceof NappeError, String(error));
    return error;
  }
  return assert.fail('nothing was refused');
}

/** That an error says all that the server knows: its reason with code, remedy and these keys of metadata. */
function says(error, reason, ...keys) {
  const row = ROWS.find((known) => known.reason === reason);
  assert.deepEqual([error.reason, error.codeName, error.code, error.remedy], [reason, row.code, Code[row.code], row.remedy], String(error));
  assert.ok(error.message.length > 0 && keys.every((key) => error.metadata[key]?.length > 0), JSON.stringify(error.metadata));
}

test('what a session refuses', async () => {
  const made = await client.create({ scene: 'flag', sessionId: 'refusing', stepLimit: 5n });
  says(await met(client.create({ scene: 'flag', sessionId: 'refusing' })), 'SESSION_EXISTS', 'session_id');
  says(await met(client.create({ scene: 'flagg' })), 'SCENE_NOT_FOUND', 'known');
  says(await met(client.create({ sceneText: 'version = 1\ntitle = 3' })), 'INVALID_SCENE', 'line', 'violation');
  says(await met(client.create({ sceneText: 'x'.repeat(3000) })), 'SCENE_TOO_LARGE', 'bytes', 'allowed');
  says(await met(client.create({ sceneText: 'x'.repeat(5000) })), 'MESSAGE_TOO_LARGE');
  says(await met(client.create({ scene: 'flag', sessionId: '-A' })), 'INVALID_FIELD', 'field');
  says(await met(client.step(made, 1001)), 'INVALID_FIELD', 'field', 'value', 'allowed');
  says(await met(client.update(made, { pins: [{ particle: 1_000_000, target: {}, durationSeconds: 1 }] })), 'INVALID_CHANGE', 'particle');
  says(await met(client.update(made, { springs: [{ kind: 1, stiffness: -1 }] })), 'INVALID_CHANGE');

  const watching = client.frames(made);
  await watching.next();
  says(await met(client.frames(made)), 'TOO_MANY_WATCHERS');
  await watching.return();
  await eventually(async () => (await client.get(made)).watcherCount === 0);

  const other = await client.create({ scene: 'flag' });
  says(await met(client.create({ scene: 'flag' })), 'TOO_MANY_SESSIONS');
  await client.play(other);
  says(await met(client.step(other)), 'SESSION_PLAYING');
  await client.delete(other);
  says(await met(client.get(other)), 'SESSION_NOT_FOUND', 'session_id');
  says(await met(client.topology(other)), 'SESSION_NOT_FOUND', 'session_id');
  says(await met(client.get({ ...made, uid: other.uid })), 'SESSION_REPLACED', 'session_uid');

  await client.step(made, 5);
  says(await met(client.step(made)), 'SESSION_FINISHED');
  says(await met(client.update(made, { drag: 1 })), 'SESSION_FINISHED');
  says(await met(client.frames(made, { every: true, from: 1000n })), 'FRAME_NOT_MADE');
  await client.delete(made);
});

test('steps that another client cuts short say so', async () => {
  const made = await client.create({ scene: 'demo', stepLimit: 0n });
  const waiting = met(client.step(made, 1000));
  await eventually(async () => (await client.get(made)).step > 0n);
  await client.pause(made);
  says(await waiting, 'STEPS_INTERRUPTED');
  await client.delete(made);
});

test('a frame that is no longer kept is told with the oldest that is', async () => {
  const small = await serve({ words: ['--history-bytes-per-session', '200000'] });
  const short = connect(small.address, { token: small.token });
  const made = await short.create({ scene: 'flag', frameIntervalSteps: 1, stepLimit: 0n });
  await short.step(made, 100);
  const error = await met(short.frames(made, { every: true, from: 0n }));
  says(error, 'FRAME_EXPIRED', 'oldest_frame');
  assert.equal(BigInt(error.metadata.oldest_frame), (await short.get(made)).oldestFrame);
  await small.stop();
});

test('tokens and hosts', async () => {
  says(await met(connect(server.address).list()), 'TOKEN_MISSING');
  const wrong = connect(server.address, { token: 'f'.repeat(32) });
  says(await met(wrong.list()), 'TOKEN_WRONG');
  says(await met(wrong.frames('any')), 'TOKEN_WRONG');
  wrong.setToken(server.token);
  assert.deepEqual(await wrong.list(), []);
  const foreign = (url, options) => fetch(url, { ...options, headers: { ...options.headers, origin: 'http://evil.example' } });
  says(await met(connect(server.address, { token: server.token, fetch: foreign }).list()), 'ORIGIN_NOT_ALLOWED');
});

/** A google.rpc.Status with an ErrorInfo, after a detail of another kind. */
function packed(reason, metadata) {
  const text = (writer, field, value) => writer.tag(field, WireType.LengthDelimited).string(value);
  const info = text(text(new BinaryWriter(), 1, reason), 2, 'nappe.v1');
  for (const [key, value] of Object.entries(metadata)) info.tag(3, WireType.LengthDelimited).bytes(text(text(new BinaryWriter(), 1, key), 2, value).finish());
  const any = (type, value) => text(new BinaryWriter(), 1, `type.googleapis.com/${type}`).tag(2, WireType.LengthDelimited).bytes(value).finish();
  const status = new BinaryWriter().tag(1, WireType.Varint).int32(3);
  for (const detail of [any('google.rpc.BadRequest', new Uint8Array(0)), any('google.rpc.ErrorInfo', info.finish())]) {
    status.tag(3, WireType.LengthDelimited).bytes(detail);
  }
  return Buffer.from(status.finish()).toString('base64').replaceAll('=', '');
}

/** What a call of a client fails with, whose answers are those of `answer`. */
async function answered(answer) {
  const fake = createServer((request, response) => request.resume().on('end', () => answer(response)));
  await new Promise((resolve) => fake.listen(0, '127.0.0.1', resolve));
  try {
    return await met(connect(`127.0.0.1:${fake.address().port}`).list());
  } finally {
    fake.closeAllConnections();
    fake.close();
  }
}

const WEB = { 'content-type': 'application/grpc-web+proto' };
const framed = (flags, bytes) => Buffer.concat([Buffer.from([flags, 0, 0, bytes.length >> 8, bytes.length & 255]), Buffer.from(bytes)]);

test('every reason of the contract comes with its code, what it names and its remedy', async () => {
  for (const [i, { reason, code, is_divergence }] of ROWS.entries()) {
    const metadata = { particle: '12', größe: '1e9' };
    const status = { 'grpc-status': String(Code[code]), 'grpc-message': 'zu gro%C3%9F: 100%25', 'grpc-status-details-bin': packed(reason, metadata) };
    const lines = Object.entries(status).map(([name, value]) => `${name}:${value}\r\n`).join('');
    // In headers, where there is no body, and in trailers.
    const error = await answered((response) => (i % 2 === 0 ? response.writeHead(200, { ...WEB, ...status }).end() : response.writeHead(200, WEB).end(framed(0x80, Buffer.from(lines)))));
    says(error, reason, 'particle');
    assert.deepEqual([error.message, error.metadata, error.isDivergence], ['zu groß: 100%', metadata, is_divergence]);
    assert.equal(error.isTransient, code === 'UNAVAILABLE' || code === 'DEADLINE_EXCEEDED');
  }
});

test('what is no answer of a nappe server is told as what it is', async () => {
  const of = async (answer) => (({ codeName, reason, message }) => `${codeName} ${reason}: ${message}`)(await answered(answer));
  const body = (...parts) => (response) => response.writeHead(200, WEB).end(Buffer.concat(parts));
  assert.match(await of((response) => response.writeHead(502).end('bad gateway')), /^UNAVAILABLE null: .* status 502 of HTTP/);
  assert.match(await of((response) => response.writeHead(404).end()), /^UNIMPLEMENTED null/);
  assert.match(await of((response) => response.writeHead(200, { 'content-type': 'text/html' }).end('<p>')), /^UNIMPLEMENTED null: .* no gRPC-Web/);
  assert.match(await of((response) => response.writeHead(301, { location: '/elsewhere' }).end()), /^UNAVAILABLE null/);
  assert.match(await of((response) => response.writeHead(200, { ...WEB, 'grpc-status': '12' }).end()), /^UNIMPLEMENTED null: .* no server of nappe, or an older one/);
  assert.match(await of((response) => response.writeHead(200, { ...WEB, 'grpc-status': 'x', 'grpc-message': '%', 'grpc-status-details-bin': '!' }).end()), /^UNKNOWN null: %/);
  assert.match(await of(body()), /^UNAVAILABLE null: .* ended without a status/);
  assert.match(await of(body(framed(0, []))), /^UNAVAILABLE null: .* ended without a status/);
  assert.match(await of(body(framed(0, []).subarray(0, 3))), /^UNAVAILABLE null: .* within a message/);
  assert.match(await of(body(framed(0, [1, 2, 3]).subarray(0, 7))), /^UNAVAILABLE null: .* within a message/);
  assert.match(await of(body(framed(0x80, Buffer.from('grpc-status:0\r\n')))), /^DATA_LOSS null: .* has no message/);
  assert.match(await of(body(framed(0, []), framed(0, []))), /^DATA_LOSS null: .* more than one message/);
  assert.match(await of(body(framed(1, []))), /^DATA_LOSS null: .* flags 1/);
  assert.match(await of(body(Buffer.from([0, 255, 255, 255, 255]))), /^DATA_LOSS null: .* 4294967295 bytes/);
  assert.match(await of(body(framed(0, [255, 255, 255]))), /^DATA_LOSS null: .* are no nappe.v1.ListSessionsResponse/);
  assert.match(await of((response) => response.destroy()), /^UNAVAILABLE null/);
});

test('no answer in time is a deadline, and nobody there is told with what helps', async () => {
  const { call } = await load('src/grpcweb.ts');
  const { SimulationService } = await load('src/gen/nappe/v1/simulation_pb.ts');
  const silent = createServer(() => undefined);
  await new Promise((resolve) => silent.listen(0, '127.0.0.1', resolve));
  const target = { address: `http://127.0.0.1:${silent.address().port}`, token: null, fetch, silenceSeconds: 30 };
  const late = call(target, SimulationService.method.getServerInfo, { $typeName: 'nappe.v1.GetServerInfoRequest' }, { seconds: 0.1 });
  await assert.rejects(late, ({ code, message }) => code === Code.DEADLINE_EXCEEDED && /did not answer GetServerInfo within 0.1 s/.test(message));
  silent.closeAllConnections();
  await new Promise((resolve) => silent.close(resolve));

  const error = await met(connect(target.address).list());
  assert.deepEqual([error.code, error.isTransient], [Code.UNAVAILABLE, true]);
  assert.match(error.message, /no server answers at .*ECONNREFUSED/);
  assert.match(error.remedy, /nappe serve/);
});
